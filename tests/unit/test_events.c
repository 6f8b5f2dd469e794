/* test_events.c - components have ids that last, and events: mergers, splits, births and deaths of bodies and of bubbles. */
#include "springls_under_test.h"

#include "fixtures.h"

static const float middle = 16.37f;

static springls_params tracked(void)
{
    springls_params params = springls_default_params();
    params.components = 1;
    return params;
}

static fixture_balls apart(void)
{
    fixture_balls b;
    b.ball[0] = fixture_ball(middle + 7.0f, middle, middle, 4.4f);
    b.ball[1] = fixture_ball(middle - 7.0f, middle, middle, 5.0f);
    return b;
}

/* Both halves of space move towards the plane x = middle. user: the speed. */
static void squeeze(void *user, const float *x, int count, float time, float *v)
{
    int i;
    (void)time;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        v[0] = *(const float *)user * springls__clamp((middle - x[0]) * 0.5f, -1.0f, 1.0f);
        v[1] = v[2] = 0.0f;
    }
}

/* Both halves of space move away from the plane x = middle, and what is near it is squeezed to its middle. user: the speed. */
static void pull(void *user, const float *x, int count, float time, float *v)
{
    int i;
    (void)time;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        float speed = *(const float *)user, near = expf(-0.08f * (x[0] - middle) * (x[0] - middle));
        v[0] = speed * springls__clamp((x[0] - middle) * 0.25f, -1.0f, 1.0f);
        v[1] = -speed * near * springls__clamp((x[1] - middle), -1.0f, 1.0f);
        v[2] = -speed * near * springls__clamp((x[2] - middle), -1.0f, 1.0f);
    }
}

static void shrink(void *user, const float *x, int count, float time, float *v)
{
    int i, c;
    (void)time;
    for (i = 0; i < count; i++, x += 3, v += 3)
        for (c = 0; c < 3; c++) v[c] = *(const float *)user * (middle - x[c]);
}

/* Counts events of a kind whose parts that appear or vanish are larger than a few voxels; *last is the last of them. */
static int large_events(const springls_event *events, int count, springls_event_kind kind, const springls_event **last)
{
    int i, k, n = 0;
    for (i = 0; i < count; i++) {
        int large = 0;
        for (k = 0; k < events[i].before_count; k++) large += events[i].before[k].volume > 4.0;
        for (k = 0; k < events[i].after_count; k++) large += events[i].after[k].volume > 4.0;
        if (events[i].kind != kind) continue;
        if (large < (kind == SPRINGLS_EVENT_KIND_MERGE || kind == SPRINGLS_EVENT_KIND_SPLIT ? 3 : 1)) continue;
        *last = &events[i];
        n++;
    }
    return n;
}

/* Two balls that are pressed together become one, with the id of the larger one. */
TEST balls_merge(void)
{
    springls_params params = tracked();
    springls_context *ctx = fixture_context(32, &params);
    fixture_balls b = apart();
    float speed = 0.25f;
    springls_forces forces = fixture_forces(squeeze, &speed);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    const springls_component *parts;
    const springls_event *events, *merger = NULL;
    springls_measures before, after;
    int i, count, mergers = 0;
    ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &b));
    ASSERT_OK(springls_components(ctx, &parts, &count));
    ASSERT_EQ(2, count);
    ASSERT_EQ(1, parts[0].id);
    ASSERT_EQ(2, parts[1].id);
    ASSERT_IN_RANGE((double)(middle - 7.0f), parts[0].center[0], 0.01);
    ASSERT_IN_RANGE((double)middle, parts[1].center[1], 0.01);
    ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * 125.0, parts[0].volume, 15.0);
    ASSERT_IN_RANGE(4.0 * fixture_pi * 4.4 * 4.4, parts[1].area, 7.0);
    for (i = 0; i < 16 && !mergers; i++) {
        ASSERT_OK(springls_measure(ctx, &before));
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_events(ctx, &events, &count));
        mergers = large_events(events, count, SPRINGLS_EVENT_KIND_MERGE, &merger);
    }
    ASSERT_EQ(1, mergers);
    ASSERT_FALSE(merger->cavity);
    ASSERT_EQ(i, merger->step);
    ASSERT_IN_RANGE(springls_time(ctx), merger->time, 1e-9);
    ASSERT_EQ(2, merger->before_count);
    ASSERT_EQ(1, merger->after_count);
    ASSERT_EQ(1, merger->before[0].id);
    ASSERT_EQ(2, merger->before[1].id);
    ASSERT_EQ(1, merger->after[0].id);
    ASSERT_IN_RANGE(before.volume, merger->before[0].volume + merger->before[1].volume, 1e-3 * before.volume);
    ASSERT_IN_RANGE(before.area, merger->before[0].area + merger->before[1].area, 1e-3 * before.area);
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_IN_RANGE(after.volume, merger->after[0].volume, 0.01 * after.volume);
    for (i = 0; i < 3; i++) ASSERT_IN_RANGE((double)middle, merger->place[i], 1.0);
    springls_destroy(ctx);
    PASS();
}

/* A dumbbell that is drawn out parts at its neck; both ends have their volumes, and the larger one keeps the id. */
TEST a_dumbbell_splits(void)
{
    springls_params params = tracked();
    springls_context *ctx = fixture_context(32, &params);
    springls_sphere spheres[3];
    springls_metasphere dumbbell;
    float speed = 0.25f;
    springls_forces forces = fixture_forces(pull, &speed);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    const springls_event *events, *split = NULL;
    springls_measures after;
    int i, count, splits = 0;
    spheres[0] = fixture_ball(middle - 5.0f, middle, middle, 4.5f);
    spheres[1] = fixture_ball(middle + 5.0f, middle, middle, 4.0f);
    spheres[2] = fixture_ball(middle, middle, middle, 2.2f);
    dumbbell.spheres = spheres;
    dumbbell.count = 3;
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_metasphere, &dumbbell));
    for (i = 0; i < 40 && !splits; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_events(ctx, &events, &count));
        splits = large_events(events, count, SPRINGLS_EVENT_KIND_SPLIT, &split);
    }
    ASSERT_EQ(1, splits);
    ASSERT_EQ(1, split->before_count);
    ASSERT_EQ(1, split->before[0].id);
    ASSERT(split->after_count >= 2);
    for (i = 0; i < 3; i++) ASSERT_IN_RANGE((double)middle, split->place[i], 1.5);
    ASSERT_OK(springls_measure(ctx, &after));
    {
        double volume = 0.0;
        uint32_t largest = 0;
        double most = 0.0;
        for (i = 0; i < split->after_count; i++) {
            volume += split->after[i].volume;
            if (split->after[i].volume > most) largest = split->after[i].id;
            if (split->after[i].volume > most) most = split->after[i].volume;
        }
        ASSERT_EQ(1, largest);
        ASSERT_IN_RANGE(after.volume, volume, 0.01 * volume);
    }
    springls_destroy(ctx);
    PASS();
}

/* A drop that shrinks dies, where it was; the model may be empty from then on. */
TEST a_drop_dies(void)
{
    springls_params params = tracked();
    springls_context *ctx = fixture_context(32, &params);
    fixture_balls b;
    float speed = 0.2f;
    springls_forces forces = fixture_forces(shrink, &speed);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
    const springls_event *events;
    int i, k, count, deaths = 0;
    b.ball[0] = fixture_ball(middle, middle, middle, 3.0f);
    b.ball[1] = fixture_ball(26.0f, 26.0f, 26.0f, 4.0f);
    ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &b));
    for (i = 0; i < 40 && !deaths && springls_count(ctx); i++) {
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_events(ctx, &events, &count));
        for (k = 0; k < count; k++) {
            if (events[k].kind != SPRINGLS_EVENT_KIND_DEATH || events[k].cavity || events[k].before[0].id > 2) continue;
            deaths++;
            ASSERT_EQ(0, events[k].after_count);
            ASSERT_EQ(NULL, events[k].after);
            ASSERT_IN_RANGE((double)middle, events[k].place[0], 1.0);
            ASSERT_EQ(1, events[k].before[0].id);
        }
    }
    ASSERT_EQ(1, deaths);
    springls_destroy(ctx);
    PASS();
}

/* A tool makes events too: a bubble is carved and filled in, and a body is cut; ids pass from part to part. */
TEST tools_make_events(void)
{
    springls_params params = tracked();
    springls_context *ctx = fixture_sphere(32, &params, middle, middle, middle, 9.0f);
    springls_sphere bubble = fixture_ball(middle + 1.0f, middle, middle, 4.0f);
    springls_box slab = { { 14.0f, 16.0f, 16.0f }, { 2.0f, 15.0f, 15.0f } };
    const springls_component *parts;
    const springls_event *events;
    int count;
    ASSERT_OK(springls_components(ctx, &parts, &count));
    ASSERT_EQ(1, count);
    ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &bubble));
    ASSERT_OK(springls_events(ctx, &events, &count));
    ASSERT_EQ(1, count);
    ASSERT_EQ(SPRINGLS_EVENT_KIND_BIRTH, events[0].kind);
    ASSERT(events[0].cavity);
    ASSERT_IN_RANGE((double)middle + 1.0, events[0].place[0], 0.1);
    ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * 64.0, events[0].after[0].volume, 15.0);
    ASSERT_OK(springls_components(ctx, &parts, &count));
    ASSERT_EQ(2, count);
    ASSERT_FALSE(parts[0].cavity);
    ASSERT(parts[1].cavity);
    ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * (729.0 - 64.0), parts[0].volume, 60.0);
    bubble.radius = 6.0f;
    ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &bubble));
    ASSERT_OK(springls_events(ctx, &events, &count));
    ASSERT_EQ(2, count); /* none has been forgotten: no step has begun */
    ASSERT_EQ(SPRINGLS_EVENT_KIND_DEATH, events[1].kind);
    ASSERT(events[1].cavity);
    ASSERT_EQ(2, events[1].before[0].id);
    ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_box, &slab));
    ASSERT_OK(springls_events(ctx, &events, &count));
    ASSERT_EQ(3, count);
    ASSERT_EQ(SPRINGLS_EVENT_KIND_SPLIT, events[2].kind);
    ASSERT_EQ(1, events[2].before[0].id);
    ASSERT_EQ(2, events[2].after_count);
    ASSERT_OK(springls_components(ctx, &parts, &count));
    ASSERT_EQ(2, count);
    ASSERT_EQ(1, parts[0].id);
    ASSERT_EQ(3, parts[1].id);
    ASSERT(parts[0].volume > parts[1].volume);
    springls_destroy(ctx);
    PASS();
}

/* Ids last where nothing happens, on springls, on places, on vertices of meshes and of chunks. */
TEST ids_last(void)
{
    springls_params params = tracked();
    springls_context *ctx = fixture_context(32, &params);
    fixture_balls b = apart();
    struct exact_flow turn = EXACT_ROTATION(16.37f, 16.37f, 16.37f, 0.3f, 0.2f, 1.0f, 0.125664f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &turn);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    const springls_component *parts;
    const springls_event *events;
    const springls_chunk *chunk;
    const uint32_t *ids;
    springls_chunks *chunks;
    springls_mesh mesh;
    uint32_t of[3000];
    int i, k, count;
    ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &b));
    for (i = 0; i < 50; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_events(ctx, &events, &count));
        ASSERT_EQ(0, count);
        ASSERT_OK(springls_components(ctx, &parts, &count));
        ASSERT_EQ(2, count);
        ASSERT_EQ(2, parts[1].id);
    }
    for (k = 0; k < 3; k++) ASSERT_IN_RANGE((double)b.ball[1].center[k], parts[0].center[k], 0.05); /* a whole turn */
    ids = springls_component_ids(ctx);
    for (i = 0; i < springls_count(ctx); i++)
        ASSERT_EQ(fixture_particle(ctx, i).x > middle ? 2u : 1u, ids[i]);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    ASSERT_LT(mesh.vertex_count, 3000);
    ASSERT_OK(springls_component_of(ctx, mesh.positions, mesh.vertex_count, of));
    for (i = 0; i < mesh.vertex_count; i++) ASSERT_EQ(mesh.positions[3 * i] > middle ? 2u : 1u, of[i]);
    springls_mesh_free(ctx, &mesh);
    ASSERT_OK(springls_component_of(ctx, b.ball[0].center, 1, of));
    ASSERT_EQ(2, of[0]);
    b.ball[0].center[1] = 30.0f;
    ASSERT_OK(springls_component_of(ctx, b.ball[0].center, 1, of));
    ASSERT_EQ(0, of[0]);
    ASSERT_OK(springls_chunks_create(ctx, NULL, &chunks));
    ASSERT_OK(springls_chunks_update(ctx, chunks, &chunk, &count));
    ASSERT_GT(count, 4);
    for (i = 0; i < count; i++) {
        ASSERT_OK(springls_component_of(ctx, chunk[i].positions, chunk[i].vertex_count, of));
        for (k = 0; k < chunk[i].vertex_count; k++) ASSERT_EQ(chunk[i].positions[3 * k] > middle ? 2u : 1u, of[k]);
    }
    springls_chunks_destroy(ctx, chunks);
    params.components = 0; /* what nobody follows is not shown */
    ASSERT_OK(springls_set_params(ctx, &params));
    ASSERT_EQ(NULL, springls_component_ids(ctx));
    springls_destroy(ctx);
    PASS();
}

/* Hashes components and events, but for their pointers. */
static uint64_t story(springls_context *ctx, uint64_t hash)
{
    const springls_component *parts;
    const springls_event *events;
    int i, count;
    if (springls_components(ctx, &parts, &count) != SPRINGLS_OK) return 0;
    hash = springls__hash(hash, parts, (size_t)count * sizeof *parts);
    if (springls_events(ctx, &events, &count) != SPRINGLS_OK) return 0;
    for (i = 0; i < count; i++) {
        hash = springls__hash(hash, &events[i], offsetof(springls_event, before));
        hash = springls__hash(hash, events[i].before, (size_t)events[i].before_count * sizeof *events[i].before);
        hash = springls__hash(hash, events[i].after, (size_t)events[i].after_count * sizeof *events[i].after);
    }
    hash = springls__hash(hash, springls_component_ids(ctx), (size_t)springls_count(ctx) * sizeof(uint32_t));
    return hash ^ springls_state_hash(ctx);
}

/* The same story on any number of threads, in pieces, and after a restore; and the model has the bits that it has without,
   where no step is lazy. */
TEST the_same_everywhere(void)
{
    uint64_t told[4] = { 1u, 1u, 1u, 1u }, state[2] = { 0u, 0u };
    float speed = 0.25f;
    springls_forces forces = fixture_forces(squeeze, &speed);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    int way, i;
    for (way = 0; way < 4; way++) {
        springls_params params = tracked();
        springls_desc desc;
        fixture_workers workers;
        fixture_balls b = apart();
        springls_context *ctx, *other;
        void *block;
        size_t size;
        bool done;
        params.lazy_distance = 0.0f;
        desc = fixture_desc(32, &params);
        if (way == 1) desc.tasks = fixture_tasks(&workers, 5, FIXTURE_THREADS);
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &b));
        for (i = 0; i < 12; i++) {
            if (way == 2) {
                ASSERT_OK(springls_step_begin(ctx, &step));
                do ASSERT_OK(springls_step_continue(ctx, 0.0, &done));
                while (!done);
            } else {
                ASSERT_OK(springls_step(ctx, &step));
            }
            told[way] = story(ctx, told[way]);
            if (way != 3 || i % 3 != 1) continue;
            ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
            block = malloc(size);
            ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
            ASSERT_OK(springls_create(&desc, &other));
            ASSERT_OK(springls_restore(other, block, size));
            ASSERT(story(ctx, 1u) == story(other, 1u));
            springls_destroy(ctx);
            ctx = other;
            free(block);
        }
        if (way == 0) state[0] = springls_state_hash(ctx);
        ASSERT(told[way] == told[0]);
        springls_destroy(ctx);
    }
    {
        springls_params params = springls_default_params();
        springls_context *ctx;
        fixture_balls b = apart();
        params.lazy_distance = 0.0f;
        ctx = fixture_context(32, &params);
        ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &b));
        ASSERT_OK(springls_run(ctx, &step, 12));
        state[1] = springls_state_hash(ctx);
        ASSERT(state[0] == state[1]);
        springls_destroy(ctx);
    }
    PASS();
}

/* The volume lock reports what each component needed. */
TEST corrections_are_reported(void)
{
    springls_params params = springls_default_params();
    springls_context *ctx = fixture_context(32, &params);
    fixture_balls b = apart();
    float speed = 0.01f;
    springls_forces forces = fixture_forces(shrink, &speed);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    const springls_component *parts;
    int i, count;
    ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &b));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_components(ctx, &parts, &count));
    params.volume_lock = 1;
    ASSERT_OK(springls_set_params(ctx, &params));
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_OK(springls_components(ctx, &parts, &count));
    ASSERT_EQ(2, count);
    for (i = 0; i < 2; i++) { /* all lengths have shrunk by a hundredth */
        float radius = b.ball[1 - i].radius;
        ASSERT_IN_RANGE(0.01 * (double)radius, (double)parts[i].correction, 0.002);
        ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * pow((double)radius, 3.0), parts[i].volume, 15.0);
    }
    ASSERT_IN_RANGE((double)springls_get_stats(ctx).volume_correction, (double)parts[0].correction, 1e-6);
    springls_destroy(ctx);
    PASS();
}

/* Calls that have no use are refused, and the step that is cut short leaves what there was. */
TEST bad_calls_are_refused(void)
{
    springls_context *ctx = fixture_context(16, NULL);
    const springls_component *parts;
    const springls_event *events;
    float place[3] = { 1.0f, NAN, 1.0f };
    uint32_t id;
    int count = 7;
    springls_params params = tracked();
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_events(ctx, &events, &count));
    ASSERT_EQ(0, count);
    ASSERT_EQ(NULL, events);
    ASSERT_OK(springls_set_params(ctx, &params));
    ASSERT_OK(springls_events(ctx, &events, &count));
    ASSERT_EQ(0, count);
    ASSERT_OK(springls_components(ctx, &parts, &count));
    ASSERT_EQ(0, count);
    ASSERT_EQ(NULL, springls_component_ids(ctx));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_events(ctx, NULL, &count));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_events(NULL, &events, &count));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_components(ctx, &parts, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_component_of(ctx, NULL, 1, &id));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_component_of(ctx, place, -1, &id));
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_component_of(ctx, place, 1, &id));
    springls_destroy(ctx);
    PASS();
}

/* Memory that is refused at any time is reported, and given back. */
TEST refused_memory_is_reported(void)
{
    int at, refused = 0;
    for (at = 0; at < 400; at++) {
        springls_params params = tracked();
        springls_desc desc = fixture_desc(24, &params);
        fixture_heap heap;
        springls_sphere ball = fixture_ball(11.3f, 11.6f, 11.4f, 6.0f);
        float speed = 0.2f, place[3] = { 11.0f, 11.0f, 11.0f };
        springls_forces forces = fixture_forces(squeeze, &speed);
        springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
        const springls_event *events;
        const springls_component *parts;
        springls_context *ctx;
        springls_status status;
        uint32_t id;
        int count;
        desc.allocator = fixture_allocator(&heap);
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        heap.fail_at = heap.calls + at;
        status = springls_components(ctx, &parts, &count);
        if (status == SPRINGLS_OK) status = springls_step(ctx, &step);
        if (status == SPRINGLS_OK) status = springls_events(ctx, &events, &count);
        if (status == SPRINGLS_OK) status = springls_component_of(ctx, place, 1, &id);
        if (status != SPRINGLS_OK) {
            ASSERT_STATUS(SPRINGLS_OUT_OF_MEMORY, status);
            refused++;
        }
        springls_destroy(ctx);
        ASSERT_EQ(0, heap.blocks);
        ASSERT_EQ(0, heap.wrong_sizes);
        if (status == SPRINGLS_OK) break;
    }
    ASSERT_GT(refused, 12);
    ASSERT_LT(at, 400);
    PASS();
}

/* Moves x by LeVeque's flow from time 0 to `time`, in double precision. */
static void exact_flow(double size, double period, double time, double x[3])
{
    const int steps = 100;
    const double h = time / steps;
    int i, s, c;
    for (i = 0; i < steps; i++) {
        static const double part[4] = { 0.0, 0.5, 0.5, 1.0 }, weight[4] = { 1.0, 2.0, 2.0, 1.0 };
        double k[4][3], y[3], sum[3] = { 0.0, 0.0, 0.0 };
        for (s = 0; s < 4; s++) {
            double pi = fixture_pi, t = size * cos(pi * (i + part[s]) * h / period), a[3], b[3];
            for (c = 0; c < 3; c++) {
                y[c] = (x[c] + (s ? part[s] * h * k[s - 1][c] : 0.0)) / size;
                a[c] = sin(pi * y[c]);
                b[c] = sin(2.0 * pi * y[c]);
            }
            k[s][0] = 2.0 * a[0] * a[0] * b[1] * b[2] * t;
            k[s][1] = -b[0] * a[1] * a[1] * b[2] * t;
            k[s][2] = -b[0] * b[1] * a[2] * a[2] * t;
            for (c = 0; c < 3; c++) sum[c] += weight[s] / 6.0 * k[s][c];
        }
        for (c = 0; c < 3; c++) x[c] += h * sum[c];
    }
}

/* The error estimates hold for 95 in 100 springls, and are a few times the error. */
TEST errors_are_estimated(void)
{
    enum { SIZE = 48 };
    struct exact_flow flow = EXACT_DEFORMATION((float)SIZE, 1.6f);
    springls_context *ctx = fixture_sphere(SIZE, NULL, 0.35f * SIZE, 0.35f * SIZE, 0.35f * SIZE, 0.15f * SIZE);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.2f);
    int part, i, c, count;
    step.max_displacement = 2.0f;
    for (part = 1; part <= 8; part++) {
        springls_error_estimate *errors;
        int within = 0, larger = 0;
        ASSERT_OK(springls_step(ctx, &step));
        count = springls_count(ctx);
        errors = (springls_error_estimate *)malloc((size_t)count * sizeof *errors);
        ASSERT_OK(springls_springl_errors(ctx, errors));
        for (i = 0; i < count; i++) {
            double x[3], error;
            d3 p = d3_of(fixture_particle(ctx, i));
            springls__v3 a = ctx->model.set.a[i];
            x[0] = (double)a.x;
            x[1] = (double)a.y;
            x[2] = (double)a.z;
            exact_flow((double)SIZE, 1.6, springls_time(ctx), x);
            error = d3_distance(p, d3_make(x[0], x[1], x[2]));
            within += error <= (double)errors[i].place;
            larger += (double)errors[i].place > 12.0 * error;
            ASSERT(errors[i].correspondence > 0.0f);
            ASSERT(errors[i].place >= 0.5f * errors[i].correspondence);
        }
        ASSERT_GT(within, 0.95 * count);
        if (part < 8) ASSERT_LT(larger, 0.5 * count); /* the median; at the end errors of integration have cancelled */
        free(errors);
    }
    {
        springls_mesh mesh;
        springls_error_estimate *errors;
        int within = 0;
        ASSERT_OK(springls_extract_mesh(ctx, &mesh));
        errors = (springls_error_estimate *)malloc((size_t)mesh.vertex_count * sizeof *errors);
        ASSERT_OK(springls_mesh_errors(ctx, &mesh, errors));
        for (i = 0; i < mesh.vertex_count; i++) { /* a whole period: everything is back where it was */
            double d2 = 0.0;
            for (c = 0; c < 3; c++) d2 += pow((double)(mesh.positions[3 * i + c] - mesh.correspondences[3 * i + c]), 2.0);
            within += sqrt(d2) <= (double)errors[i].place;
        }
        ASSERT_GT(within, 0.95 * mesh.vertex_count);
        free(errors);
        springls_mesh_free(ctx, &mesh);
    }
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_springl_errors(ctx, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_mesh_errors(ctx, NULL, NULL));
    springls_destroy(ctx);
    PASS();
}

/* A flow as narrow as a step of two voxels is long: it pulls both sides of a plane together and lets them out sideways, along
   and then four times as far back. */
enum { NARROW_SIZE = 48 };

static void narrow_velocity(const double x[3], double time, double v[3])
{
    const double n = NARROW_SIZE, plane = 0.5 * n + 0.37, width = 0.05 * n, speed = 0.08 * n * 0.5 * fixture_pi;
    double factor = speed * cos(0.5 * fixture_pi * time) * (time > 1.0 ? 4.0 : 1.0);
    double side = tanh((x[0] - plane) / width), out = 0.5 / width * (1.0 - side * side);
    v[0] = -factor * side;
    v[1] = factor * out * (x[1] - plane);
    v[2] = factor * out * (x[2] - plane);
}

static void narrow_flow(void *user, const float *points, int count, float time, float *out)
{
    int i, c;
    (void)user;
    for (i = 0; i < 3 * count; i += 3) {
        double x[3], v[3];
        for (c = 0; c < 3; c++) x[c] = (double)points[i + c];
        narrow_velocity(x, (double)time, v);
        for (c = 0; c < 3; c++) out[i + c] = (float)v[c];
    }
}

static d3 exact_narrow_flow(springls__v3 a)
{
    const int steps = 800;
    const double h = 2.0 / steps;
    double x[3];
    int i, s, c;
    x[0] = (double)a.x;
    x[1] = (double)a.y;
    x[2] = (double)a.z;
    for (i = 0; i < steps; i++) {
        static const double part[4] = { 0.0, 0.5, 0.5, 1.0 }, weight[4] = { 1.0, 2.0, 2.0, 1.0 };
        double k[4][3], y[3];
        for (s = 0; s < 4; s++) {
            for (c = 0; c < 3; c++) y[c] = x[c] + (s ? part[s] * h * k[s - 1][c] : 0.0);
            narrow_velocity(y, (i + part[s]) * h, k[s]);
        }
        for (s = 0; s < 4; s++)
            for (c = 0; c < 3; c++) x[c] += h * weight[s] / 6.0 * k[s][c];
    }
    return d3_make(x[0], x[1], x[2]);
}

/* The estimates also hold, and the median is a small factor, where the error is that of steps as long as the field is wide. */
TEST errors_of_long_steps_are_estimated(void)
{
    springls_sphere balls[2] = { { { 0, 0, 0 }, 0.1f * NARROW_SIZE }, { { 0, 0, 0 }, 0.1f * NARROW_SIZE } };
    springls_metasphere two;
    springls_desc desc = fixture_desc(NARROW_SIZE, NULL);
    springls_forces forces = fixture_forces(narrow_flow, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.25f);
    springls_error_estimate *errors;
    springls_context *ctx = NULL;
    int i, k, count, within = 0, larger = 0;
    for (k = 0; k < 2; k++) {
        for (i = 0; i < 3; i++) balls[k].center[i] = 0.5f * NARROW_SIZE + 0.37f;
        balls[k].center[0] += (k ? 0.11f : -0.11f) * NARROW_SIZE;
    }
    two.spheres = balls;
    two.count = 2;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_metasphere, &two));
    step.max_displacement = 2.0f;
    for (k = 0; k < 8; k++) ASSERT_OK(springls_step(ctx, &step));
    count = springls_count(ctx);
    errors = (springls_error_estimate *)malloc((size_t)count * sizeof *errors);
    ASSERT_OK(springls_springl_errors(ctx, errors));
    for (i = 0; i < count; i++) {
        double error = d3_distance(d3_of(fixture_particle(ctx, i)), exact_narrow_flow(ctx->model.set.a[i]));
        within += error <= (double)errors[i].place;
        larger += (double)errors[i].place > 6.0 * error;
    }
    ASSERT_GT(within, 0.95 * count);
    ASSERT_LT(larger, 0.5 * count);
    free(errors);
    springls_destroy(ctx);
    PASS();
}

/* Gives ids to two components, 60 and the rest: one of 100 has split into 60 and 40, and one of `other` has merged with the 40. */
static void split_and_merge(springls_context *ctx, double other, uint32_t id[2])
{
    static springls__component previous[2];
    static springls__current_component current[2];
    springls__component_link links[6] = { { 0, 0, 60 }, { 0, 1, 40 }, { 1, 1, 30 } };
    springls__component_graph graph;
    uint64_t key[3];
    memset(&graph, 0, sizeof graph);
    memset(previous, 0, sizeof previous);
    memset(current, 0, sizeof current);
    previous[0].view.id = 1;
    previous[0].view.volume = 100.0;
    previous[1].view.id = 2;
    previous[1].view.volume = other;
    current[0].surface.volume = 60.0;
    current[1].surface.volume = 40.0 + other;
    graph.previous = previous;
    graph.previous_count = 2;
    graph.labels.item = current;
    graph.labels.count = 2;
    graph.link = links;
    graph.link_count = 3;
    springls__sort_links_by_current(&graph, key);
    ctx->last_component_id = 2;
    id[0] = id[1] = 0;
    if (springls__assign_component_ids(ctx, &graph) != SPRINGLS_OK) return;
    id[0] = current[0].id;
    id[1] = current[1].id;
}

/* What merges with a part that splits off in the same step gets the larger one's id, which is new when that is the part. */
TEST splits_and_mergers_of_one_step_have_ids(void)
{
    springls_context *ctx = fixture_context(16, NULL);
    uint32_t id[2];
    split_and_merge(ctx, 50.0, id);
    ASSERT_EQ(1, id[0]);
    ASSERT_EQ(2, id[1]);
    split_and_merge(ctx, 30.0, id);
    ASSERT_EQ(1, id[0]);
    ASSERT_EQ(3, id[1]);
    springls_destroy(ctx);
    PASS();
}

SUITE(events)
{
    RUN_TEST(balls_merge);
    RUN_TEST(a_dumbbell_splits);
    RUN_TEST(a_drop_dies);
    RUN_TEST(tools_make_events);
    RUN_TEST(ids_last);
    RUN_TEST(splits_and_mergers_of_one_step_have_ids);
    RUN_TEST(the_same_everywhere);
    RUN_TEST(corrections_are_reported);
    RUN_TEST(errors_are_estimated);
    RUN_TEST(errors_of_long_steps_are_estimated);
    RUN_TEST(bad_calls_are_refused);
    RUN_TEST(refused_memory_is_reported);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(events);
    GREATEST_MAIN_END();
}
