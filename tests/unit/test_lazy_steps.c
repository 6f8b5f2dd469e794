/* test_lazy_steps.c - phi may stay behind the springls for a few steps, and no call shows it: readers find forms that agree,
   reading changes nothing that comes later, and what needs phi has it. */
#include "fixtures.h"

enum { SIZE = 32, STEPS = 17, READERS = 12 };

static const float wind[3] = { 0.25f, 0.05f, -0.1f };
static const d3 start = { 12.0, 14.5, 17.0 };
static const double radius = 7.0;

static springls_context *ball(const springls_params *params, const springls_tasks *tasks, springls_backend *backend)
{
    springls_desc desc = fixture_desc(SIZE, params);
    springls_sphere sphere = fixture_ball((float)start.x, (float)start.y, (float)start.z, (float)radius);
    springls_context *ctx = NULL;
    if (tasks) desc.tasks = *tasks;
    desc.backend = backend;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return NULL;
    if (springls_set_implicit(ctx, springls_implicit_sphere, &sphere) != SPRINGLS_OK) return NULL;
    return fixture_of_zero_level(ctx);
}

static springls_step_desc blown(springls_forces *forces)
{
    *forces = fixture_forces(fixture_wind, (void *)(uintptr_t)wind);
    return fixture_step(forces, SPRINGLS_MODE_FLUID, 1.0f);
}

static d3 centre_after(int steps) { return d3_mad(start, d3_make((double)wind[0], (double)wind[1], (double)wind[2]), steps); }

static d3 at_row(const float *rows, int i, int floats)
{
    return d3_make((double)rows[floats * i], (double)rows[floats * i + 1], (double)rows[floats * i + 2]);
}

/* The same by components, which are switched on for the time of reading. */
static double read_components(springls_context *ctx, bool all, d3 center)
{
    const springls_component *list;
    const springls_event *events;
    const float inside[3] = { (float)(center.x + radius - 0.3), (float)center.y, (float)center.z };
    springls_params params = springls_get_params(ctx);
    double worst = -1.0;
    uint32_t id;
    int count;
    params.components = 1;
    if (springls_set_params(ctx, &params) != SPRINGLS_OK) return -1.0;
    if (all && springls_components(ctx, &list, &count) == SPRINGLS_OK && count == 1)
        worst = d3_distance(at_row(list->center, 0, 3), center);
    if (!all && springls_component_of(ctx, inside, 1, &id) == SPRINGLS_OK) worst = id != 0u ? 0.0 : 1.0;
    if (springls_events(ctx, &events, &count) != SPRINGLS_OK || count != 0) worst = -1.0;
    params.components = 0;
    return springls_set_params(ctx, &params) == SPRINGLS_OK ? worst : -1.0;
}

/* Reads the level set in one of the ways there are. Returns how far it is from a ball about `center`, voxels; negative: failed.
   Phi left behind would be off by as much as the springls have moved. */
static double read_level(springls_context *ctx, int how, d3 center)
{
    float at[6], out[6], *all, *room = (float *)malloc((size_t)SIZE * SIZE * SIZE * sizeof(float) + 16 * sizeof(float) * 20000);
    double worst = -1.0;
    springls_mesh mesh;
    springls_measures measures;
    springls_hit hit;
    springls_chunks *chunks;
    const springls_chunk *changed;
    int i, k, count;
    at[0] = (float)(center.x + radius); at[1] = (float)center.y; at[2] = (float)center.z;
    at[3] = -1.0f; at[4] = at[5] = 0.0f;
    switch (how) {
    case 0:
        if (springls_sample_distance(ctx, at, 1, out) == SPRINGLS_OK) worst = fabs((double)out[0]);
        break;
    case 1:
        if (springls_measure(ctx, &measures) != SPRINGLS_OK) break;
        for (worst = 0.0, k = 0; k < 3; k++)
            worst = fmax(worst, fabs((double)measures.upper[k] - (k == 0 ? center.x : k == 1 ? center.y : center.z) - radius));
        break;
    case 2:
        if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) break;
        for (worst = 0.0, i = 0; i < mesh.vertex_count; i++)
            worst = fmax(worst, fabs(d3_distance(at_row(mesh.positions, i, 3), center) - radius));
        springls_mesh_free(ctx, &mesh);
        break;
    case 3:
        if (springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, at, 1, &hit) == SPRINGLS_OK) worst = (double)hit.distance;
        break;
    case 4:
        at[0] += 4.0f;
        if (springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, at, at + 3, 1, 0.0f, &hit) == SPRINGLS_OK)
            worst = fabs((double)hit.distance - 4.0);
        break;
    case 5:
        if (springls_copy_level_set(ctx, room) != SPRINGLS_OK) break;
        for (worst = 0.0, i = 0; i < SIZE * SIZE * SIZE; i++) {
            double d = d3_distance(d3_make(i % SIZE, i / SIZE % SIZE, i / SIZE / SIZE), center) - radius;
            if (fabs(d) < 1.0) worst = fmax(worst, fabs(d - (double)room[i]));
        }
        break;
    case 6:
        if (springls_count(ctx) > 20000 || springls_pack_matrix(ctx, room) != SPRINGLS_OK) break;
        for (worst = 0.0, i = 0; i < springls_count(ctx); i++) worst = fmax(worst, fabs((double)room[16 * i + 3]));
        break;
    case 7:
        if (springls_chunks_create(ctx, NULL, &chunks) != SPRINGLS_OK) break;
        if (springls_chunks_update(ctx, chunks, &changed, &count) == SPRINGLS_OK)
            for (worst = 0.0, i = 0; i < count; i++)
                for (k = 0; k < changed[i].vertex_count; k++)
                    worst = fmax(worst, fabs(d3_distance(at_row(changed[i].positions, k, 3), center) - radius));
        springls_chunks_destroy(ctx, chunks);
        break;
    case 8:
        at[0] -= 0.3f;
        at[3] = at[0] + 0.6f; at[4] = at[1]; at[5] = at[2];
        all = room;
        if (springls_sample_inside(ctx, at, 2, (uint8_t *)all) == SPRINGLS_OK)
            worst = ((uint8_t *)all)[0] == 1 && ((uint8_t *)all)[1] == 0 ? 0.0 : 1.0;
        break;
    case 9:
    case 10: worst = read_components(ctx, how == 9, center); break;
    default:
        if (springls_count(ctx) > 20000 || springls_extract_surfels(ctx, room) != SPRINGLS_OK) break;
        for (worst = 0.0, i = 0; i < springls_count(ctx); i++) {
            d3 n = at_row(room + 3, i, 7), out_of = d3_sub(d3_of(fixture_particle(ctx, i)), center);
            worst = fmax(worst, 1.0 - d3_dot(n, out_of) / d3_length(out_of));
        }
    }
    free(room);
    return worst;
}

/* Returns how many springls are further than 0.05 voxel from phi as it is held, without a reader's door. */
static int left_behind(springls_context *ctx)
{
    const springls__model *model = fixture_here(ctx);
    int i, n = 0;
    for (i = 0; i < model->set.count; i++)
        n += fabsf(springls__grid_sample(&model->grid, model->grid.phi, model->set.s[i].p)) > 0.05f;
    return n;
}

/* Whatever reads the level set after a lazy step finds it where the springls are. */
TEST readers_see_forms_that_agree(int how)
{
    springls_forces forces;
    springls_step_desc step = blown(&forces);
    springls_context *ctx = ball(NULL, NULL, fixture_backend());
    int i, lazy = 0;
    for (i = 1; i <= STEPS; i++) {
        double off;
        ASSERT_OK(springls_step(ctx, &step));
        lazy += left_behind(ctx) > springls_count(ctx) / 2;
        off = read_level(ctx, how, centre_after(i));
        ASSERT_GTE(off, 0.0);
        ASSERT_LT(off, 0.06);
    }
    ASSERT_GT(lazy, STEPS / 2);
    springls_destroy(ctx);
    PASS();
}

/* Reading in every step, in every way, leaves the bits of a model that nobody has looked at, and views that were taken before. */
TEST reading_changes_nothing(void)
{
    springls_forces forces;
    springls_step_desc step = blown(&forces);
    springls_context *ctx[2];
    int i, how;
    for (i = 0; i < 2; i++) ctx[i] = ball(NULL, NULL, i ? fixture_backend() : NULL);
    for (i = 1; i <= STEPS; i++) {
        const uint32_t *ids;
        springls_view particles;
        fixture_springl *before;
        ASSERT_OK(springls_step(ctx[0], &step));
        ASSERT_OK(springls_step(ctx[1], &step));
        before = fixture_copy(ctx[1]);
        particles = springls_view_particles(ctx[1]);
        ids = springls_ids(ctx[1]);
        for (how = 0; how < READERS; how++) ASSERT_GTE(read_level(ctx[1], how, centre_after(i)), 0.0);
        for (how = 0; how < particles.count; how++) {
            springls__v3 p = fixture_at(particles, how, 0);
            ASSERT_MEM_EQ(&before[how].p, &p, sizeof p);
            ASSERT_EQ(before[how].id, ids[how]);
        }
        free(before);
        if (i % 3 == 0) ASSERT(springls_state_hash(ctx[0]) == springls_state_hash(ctx[1]));
    }
    ASSERT(springls_state_hash(ctx[0]) == springls_state_hash(ctx[1]));
    for (i = 0; i < 2; i++) springls_destroy(ctx[i]);
    PASS();
}

/* A snapshot between lazy steps goes on with the same bits, also when the model is being read; on threads, in pieces and on a
   device too. */
TEST snapshots_go_on(int way)
{
    springls_forces forces;
    springls_step_desc step = blown(&forces);
    fixture_workers workers;
    springls_tasks tasks = fixture_tasks(&workers, 5, FIXTURE_THREADS);
    springls_context *ctx = ball(NULL, NULL, NULL);
    springls_context *other = ball(NULL, way == 1 ? &tasks : NULL, way == 3 ? fixture_backend() : NULL);
    size_t size;
    void *block;
    int i, k;
    for (i = 0; i < 4; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_GT(left_behind(ctx), springls_count(ctx) / 2);
    ASSERT_GTE(read_level(ctx, i % READERS, centre_after(4)), 0.0);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    block = malloc(size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    ASSERT_GTE(read_level(other, 2, start), 0.0);
    ASSERT_OK(springls_restore(other, block, size));
    ASSERT(springls_state_hash(ctx) == springls_state_hash(other));
    for (i = 0; i < STEPS; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        if (way == 2) {
            bool done = false;
            ASSERT_OK(springls_step_begin(other, &step));
            for (k = 0; !done; k++) {
                ASSERT_OK(springls_step_continue(other, 0.0, &done));
                if (k % 3 == 0) ASSERT_GTE(read_level(other, 0, start), 0.0);
            }
        } else {
            ASSERT_OK(springls_step(other, &step));
        }
        ASSERT(springls_state_hash(ctx) == springls_state_hash(other));
    }
    free(block);
    springls_destroy(ctx);
    springls_destroy(other);
    PASS();
}

static springls_status steps(springls_context *ctx, const springls_step_desc *step, int count, int *taken)
{
    springls_status status = SPRINGLS_OK;
    for (; count > 0 && status == SPRINGLS_OK; count--, ++*taken) status = springls_step(ctx, step);
    return status;
}

/* Steps that need phi make it follow first, and a step without forces makes it follow at once. */
TEST some_steps_are_whole(int which)
{
    springls_forces forces;
    springls_step_desc step = blown(&forces), whole = step;
    springls_params p = springls_default_params();
    springls_context *ctx = ball(NULL, NULL, fixture_backend());
    int taken = 0;
    p.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    ASSERT_OK(steps(ctx, &step, 4, &taken));
    ASSERT_GT(left_behind(ctx), springls_count(ctx) / 2);
    if (which == 0) memset(&whole, 0, sizeof whole);
    if (which == 1) forces.curvature_weight = 0.01f;
    if (which == 2) whole.stop_at_topology = true;
    if (which == 3) p.components = 1;
    if (which == 4) p.volume_lock = 1;
    if (which == 5) p.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    if (which == 6) p.contact = SPRINGLS_CONTACT_SEPARATE;
    if (which == 7) p.lazy_distance = 0.0f;
    ASSERT_OK(springls_set_params(ctx, &p));
    ASSERT_OK(springls_step(ctx, &whole));
    ASSERT_LT(left_behind(ctx), springls_count(ctx) / 50);
    ASSERT_LT(read_level(ctx, 2, centre_after(which == 0 ? taken : taken + 1)), 0.06);
    springls_destroy(ctx);
    PASS();
}

/* Calls that change the model find phi where the springls are, and the step after them is a whole one. */
TEST changes_find_phi_there(int which)
{
    springls_forces forces;
    springls_step_desc step = blown(&forces);
    springls_params p = springls_default_params();
    const springls_component *components;
    springls_context *ctx = ball(NULL, NULL, fixture_backend());
    float place[3];
    int taken = 0, count;
    springls__v3 first;
    ASSERT_OK(steps(ctx, &step, 4, &taken));
    ASSERT_GT(left_behind(ctx), springls_count(ctx) / 2);
    if (which == 0) {
        first = fixture_particle(ctx, 0);
        memcpy(place, &first, sizeof place);
        ASSERT_OK(springls_write(ctx, 0, 1, NULL, place));
    } else if (which == 1) {
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
    } else if (which == 2) {
        ASSERT_OK(springls_set_reference(ctx));
    } else {
        p.components = 1;
        ASSERT_OK(springls_set_params(ctx, &p));
        ASSERT_OK(springls_components(ctx, &components, &count));
        ASSERT_EQ(1, count);
        ASSERT_IN_RANGE(centre_after(taken).x, (double)components[0].center[0], 0.01);
    }
    ASSERT_LT(left_behind(ctx), springls_count(ctx) / 50);
    if (which < 2) {
        ASSERT_OK(steps(ctx, &step, 1, &taken));
        ASSERT_LT(left_behind(ctx), springls_count(ctx) / 50);
    }
    springls_destroy(ctx);
    PASS();
}

/* Springls that move alone leave phi where they were just before, not where phi was some steps ago. */
TEST phi_stays_for_springls_alone(void)
{
    springls_forces forces;
    springls_step_desc step = blown(&forces);
    springls_context *ctx = ball(NULL, NULL, fixture_backend());
    int taken = 0;
    ASSERT_OK(steps(ctx, &step, 4, &taken));
    step.mode = SPRINGLS_MODE_ADVECT_ONLY;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_LT(read_level(ctx, 2, centre_after(taken)), 0.06);
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
    ASSERT_LT(read_level(ctx, 2, centre_after(taken)), 0.06);
    step.mode = SPRINGLS_MODE_FLUID;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_LT(left_behind(ctx), springls_count(ctx) / 50);
    ASSERT_LT(read_level(ctx, 2, centre_after(taken + 3)), 0.06);
    springls_destroy(ctx);
    PASS();
}

/* A reader without memory fails, and the model is what it was. */
TEST readers_fail_without_harm(void)
{
    fixture_heap heap;
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_sphere sphere = fixture_ball((float)start.x, (float)start.y, (float)start.z, (float)radius);
    springls_forces forces;
    springls_step_desc step = blown(&forces);
    springls_context *ctx;
    springls_measures measures;
    uint64_t hash;
    int i;
    desc.allocator = fixture_allocator(&heap);
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &sphere));
    for (i = 0; i < 4; i++) ASSERT_OK(springls_step(ctx, &step));
    hash = springls_state_hash(ctx);
    heap.fail_at = heap.calls;
    ASSERT_EQ(SPRINGLS_OUT_OF_MEMORY, springls_measure(ctx, &measures));
    heap.fail_at = -1;
    ASSERT(hash == springls_state_hash(ctx));
    ASSERT_LT(read_level(ctx, 1, centre_after(4)), 0.06);
    ASSERT(hash == springls_state_hash(ctx));
    springls_destroy(ctx);
    PASS();
}

SUITE(lazy_steps)
{
    int how;
    for (how = 0; how < READERS; how++) RUN_TESTp(readers_see_forms_that_agree, how);
    RUN_TEST(reading_changes_nothing);
    for (how = 0; how < 4; how++)
        if (how < 3 || fixture_backend()) RUN_TESTp(snapshots_go_on, how);
    for (how = 0; how < 8; how++) RUN_TESTp(some_steps_are_whole, how);
    for (how = 0; how < 4; how++) RUN_TESTp(changes_find_phi_there, how);
    RUN_TEST(phi_stays_for_springls_alone);
    RUN_TEST(readers_fail_without_harm);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(lazy_steps);
    GREATEST_MAIN_END();
}
