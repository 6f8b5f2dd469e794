/* test_window.c - a grid that moves with the model: nothing depends on how far it has come, and every place that a caller gives or
   gets is where the model is in the world. */
#include "fixtures.h"

enum { SIZE = 48, MIDDLE = 24 };

/* A ball in a window that follows it, or in a grid that stays. */
static springls_context *ball(bool follow, const springls_params *params, float x, float radius,
                              const springls_allocator *allocator)
{
    springls_desc desc = fixture_desc(SIZE, params);
    springls_sphere sphere = fixture_ball(x, (float)MIDDLE, (float)MIDDLE, radius);
    springls_context *ctx = NULL;
    desc.follow = follow;
    if (allocator) desc.allocator = *allocator;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return NULL;
    if (springls_set_implicit(ctx, springls_implicit_sphere, &sphere) == SPRINGLS_OK) return ctx;
    springls_destroy(ctx);
    return NULL;
}

static springls_status blow(springls_context *ctx, float x, float y, float z, int steps)
{
    float wind[3];
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    wind[0] = x;
    wind[1] = y;
    wind[2] = z;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    return springls_run(ctx, &step, steps);
}

static int moved(const springls_context *ctx, int axis)
{
    int offset[3];
    springls_window_offset(ctx, offset);
    return offset[axis];
}

/* Rounds particles and vertices to multiples of 2^-12 voxel: the window's coordinates hold these without an error. */
static springls_status round_springls(springls_context *ctx)
{
    int i, k, count = springls_count(ctx);
    float *vertices = (float *)malloc((size_t)count * 12 * sizeof *vertices), *particles = vertices + 9 * (size_t)count;
    springls_status status;
    for (i = 0; i < count; i++) {
        springls__v3 p = fixture_particle(ctx, i);
        memcpy(particles + 3 * i, &p, sizeof p);
        for (k = 0; k < 3; k++) {
            springls__v3 q = fixture_vertex(ctx, i, k);
            memcpy(vertices + 9 * i + 3 * k, &q, sizeof q);
        }
    }
    for (i = 0; i < 12 * count; i++) vertices[i] = (float)floor((double)vertices[i] * 4096.0 + 0.5) / 4096.0f;
    status = springls_write(ctx, 0, count, vertices, particles);
    free(vertices);
    return status;
}

/* A ball that a wind has carried far has the bits of one that has stayed: particles, correspondences, ids. */
TEST what_is_carried_far_has_the_bits_of_what_stays(float x, float y, float z, float far)
{
    float wind[3];
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_context *carried = ball(true, NULL, (float)MIDDLE, 5.0f, NULL), *stays = ball(true, NULL, (float)MIDDLE, 5.0f, NULL);
    springls_measures there, here;
    int i, steps = (int)(far / fabsf(x));
    wind[0] = x;
    wind[1] = y;
    wind[2] = z;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    step.one_to_one = true;
    ASSERT_OK(round_springls(carried));
    ASSERT_OK(round_springls(stays));
    ASSERT_OK(springls_run(carried, &step, steps));
    ASSERT_EQ(steps, springls_get_stats(carried).steps);
    wind[0] = wind[1] = wind[2] = 0.0f;
    ASSERT_OK(springls_run(stays, &step, 2));
    ASSERT_EQ((int)x * steps, moved(carried, 0));
    ASSERT_EQ((int)y * steps, moved(carried, 1));
    ASSERT_EQ((int)z * steps, moved(carried, 2));
    ASSERT_EQ(0, moved(stays, 0));
    ASSERT_EQ(springls_count(stays), springls_count(carried));
    for (i = 0; i < springls_count(stays); i++) {
        springls__v3 p = fixture_particle(stays, i), q = fixture_particle(carried, i);
        springls__v3 a = fixture_origin(stays, i), b = fixture_origin(carried, i);
        ASSERT_MEM_EQ(&p, &q, sizeof p);
        ASSERT_MEM_EQ(&a, &b, sizeof a);
        ASSERT_EQ(springls_ids(stays)[i], springls_ids(carried)[i]);
    }
    ASSERT_OK(springls_measure(stays, &here));
    ASSERT_OK(springls_measure(carried, &there));
    ASSERT_LT(fabs(there.volume / here.volume - 1.0), 1e-3);
    ASSERT_LT(fabs(there.area / here.area - 1.0), 1e-3);
    for (i = 0; i < 3; i++) {
        const double way = (double)steps * (double)(i == 0 ? x : i == 1 ? y : z);
        ASSERT_LT(fabs((double)there.lower[i] - (double)here.lower[i] - way), 0.01);
    }
    springls_destroy(carried);
    springls_destroy(stays);
    PASS();
}

/* With everything that a step does, springls stay on their paths. */
TEST a_whole_step_keeps_its_accuracy(void)
{
    const float wind[3] = { 1.3f, -0.7f, 0.9f };
    const int steps = 300;
    springls_context *ctx = ball(true, NULL, (float)MIDDLE, 7.0f, NULL);
    springls_measures before, after;
    double worst = 0.0;
    int i, k;
    ASSERT_OK(springls_measure(ctx, &before));
    ASSERT_OK(blow(ctx, wind[0], wind[1], wind[2], steps));
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_LT(fabs(after.volume / before.volume - 1.0), 1e-3);
    ASSERT_EQ(1, after.components);
    ASSERT_EQ(0, (int)springls_get_stats(ctx).left);
    for (i = 0; i < springls_count(ctx); i++) {
        springls__v3 p = fixture_particle(ctx, i), a = fixture_origin(ctx, i);
        const float at[3] = { p.x, p.y, p.z }, from[3] = { a.x, a.y, a.z };
        for (k = 0; k < 3; k++)
            worst = fmax(worst, fabs((double)at[k] + moved(ctx, k) - (double)from[k] - (double)steps * (double)wind[k]));
    }
    ASSERT_LT(worst, 0.01);
    ASSERT_GT(moved(ctx, 0), 300);
    ASSERT_LT(moved(ctx, 1), -150);
    springls_destroy(ctx);
    PASS();
}

/* Points, hits, meshes and bounds are places of the world; material coordinates those of where the ball has come from. */
TEST places_are_of_the_world(void)
{
    const float radius = 7.0f, x = 480.0f;
    springls_context *ctx = ball(true, NULL, (float)MIDDLE, radius, NULL);
    float point[3] = { x, MIDDLE + 9.0f, MIDDLE }, ray[3] = { x - 20.0f, MIDDLE, MIDDLE }, along[3] = { 1.0f, 0.0f, 0.0f };
    float inside[3] = { x, MIDDLE, MIDDLE }, before[3] = { MIDDLE, MIDDLE, MIDDLE }, distance, voxel[3], world[3];
    uint8_t in[2];
    springls_hit hit;
    springls_mesh mesh;
    int i;
    ASSERT_OK(blow(ctx, 2.0f, 0.0f, 0.0f, (int)(x - MIDDLE) / 2));
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, point, 1, &hit));
    ASSERT_LT(fabs((double)hit.distance - 2.0), 0.02);
    ASSERT_LT(fabs((double)(hit.point[0] - x)), 0.1);
    ASSERT_LT(fabs((double)(hit.material[0] - MIDDLE)), 0.1);
    ASSERT_LT(fabs((double)(hit.material[1] - MIDDLE - radius)), 0.05);
    ASSERT(hit.material_triangle >= 0);
    ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_SOUP, ray, along, 1, 0.0f, &hit));
    ASSERT(hit.springl < 0 || fabs((double)hit.distance - 13.0) < 0.05);
    ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, ray, along, 1, 0.0f, &hit));
    ASSERT_LT(fabs((double)hit.distance - 13.0), 0.02);
    ASSERT_OK(springls_sample_distance(ctx, point, 1, &distance));
    ASSERT_LT(fabs((double)distance - 2.0), 0.05);
    ASSERT_OK(springls_sample_inside(ctx, inside, 1, in));
    ASSERT_OK(springls_sample_inside(ctx, before, 1, in + 1));
    ASSERT_EQ(1, in[0]);
    ASSERT_EQ(0, in[1]);
    springls_to_voxel(ctx, inside, 1, voxel);
    ASSERT_EQ(x - (float)moved(ctx, 0), voxel[0]);
    springls_to_world(ctx, voxel, 1, world);
    ASSERT_EQ(x, world[0]);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    for (i = 0; i < mesh.vertex_count; i++) {
        const float *p = mesh.positions + 3 * i, *a = mesh.correspondences + 3 * i;
        ASSERT_LT(fabs(d3_distance(d3_make(p[0], p[1], p[2]), d3_make(x, MIDDLE, MIDDLE)) - (double)radius), 0.05);
        if (mesh.springls[i] >= 0)
            ASSERT_LT(d3_distance(d3_make(p[0], p[1], p[2]), d3_make(a[0] + x - MIDDLE, a[1], a[2])), 0.1);
    }
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* What callbacks have been given. */
typedef struct witness { float lower[2], upper[2]; bool in_world; } witness;

static void watched_wind(void *user, const springls_batch *batch, float *out)
{
    witness *w = (witness *)user;
    int i;
    for (i = 0; i < batch->count; i++) {
        w->lower[0] = fminf(w->lower[0], batch->points[3 * i]);
        w->upper[0] = fmaxf(w->upper[0], batch->points[3 * i]);
        w->lower[1] = fminf(w->lower[1], batch->correspondences[3 * i]);
        w->upper[1] = fmaxf(w->upper[1], batch->correspondences[3 * i]);
        out[3 * i] = 2.0f;
        out[3 * i + 1] = out[3 * i + 2] = 0.0f;
    }
}

/* Forces and their region are given where they were before the window moved: on the lattice, or in the world. */
TEST forces_stay_in_place(bool in_world)
{
    springls_context *ctx = ball(true, NULL, (float)MIDDLE, 6.0f, NULL);
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    witness w;
    ASSERT_OK(blow(ctx, 2.0f, 0.0f, 0.0f, 100));
    w.lower[0] = w.lower[1] = FLT_MAX;
    w.upper[0] = w.upper[1] = -FLT_MAX;
    forces.velocity_batch = watched_wind;
    forces.user = &w;
    forces.voxel_units = !in_world;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    forces.region_lower[0] = 224.0f; /* half of the ball */
    forces.region_upper[0] = 300.0f;
    forces.region_upper[1] = forces.region_upper[2] = (float)SIZE;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_LT(fabs((double)w.upper[0] - 230.0), 0.6);
    ASSERT_GT(w.lower[0], 222.0f);
    ASSERT_LT(fabs((double)w.upper[1] - 30.0), 0.2);
    ASSERT_GT(w.lower[1], 22.0f);
    springls_destroy(ctx);
    PASS();
}

static void rotation_by_callback(void *user, const float *points, int count, float time, float *out)
{
    exact_flow_velocity(user, points, count, time, out);
}

/* A flow of which a device has the text has the same bits as one of which it has none, in a window that has moved; its centre stays
   in place. */
TEST flows_stay_in_place(void)
{
    struct exact_flow flow = EXACT_ROTATION(24.0f, 224.0f, 24.0f, 0.0f, 0.0f, 1.0f, 0.01f);
    springls_context *ctx[2];
    uint64_t hash[2];
    int i, steps = 314; /* half a turn about a point 200 voxels away */
    springls_measures m;
    for (i = 0; i < 2; i++) {
        springls_forces forces = fixture_forces(i ? rotation_by_callback : exact_flow_velocity, &flow);
        springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
        ctx[i] = ball(true, NULL, (float)MIDDLE, 5.0f, NULL);
        ASSERT_OK(springls_run(ctx[i], &step, steps));
        hash[i] = springls_state_hash(ctx[i]);
    }
    ASSERT(hash[0] == hash[1]);
    ASSERT_OK(springls_measure(ctx[0], &m));
    ASSERT_LT(fabs(0.5 * (double)(m.lower[0] + m.upper[0]) - (24.0 + 200.0 * sin(3.14))), 0.1);
    ASSERT_LT(fabs(0.5 * (double)(m.lower[1] + m.upper[1]) - (224.0 - 200.0 * cos(3.14))), 0.1);
    for (i = 0; i < 2; i++) springls_destroy(ctx[i]);
    PASS();
}

static char *snapshot_of(springls_context *ctx, springls_snapshot_kind kind, size_t *size)
{
    char *block;
    if (springls_snapshot(ctx, kind, NULL, 0, size) != SPRINGLS_OK) return NULL;
    block = (char *)malloc(*size);
    if (springls_snapshot(ctx, kind, block, *size, size) == SPRINGLS_OK) return block;
    free(block);
    return NULL;
}

/* A snapshot has the place of the window: what is restored goes on with the same bits, and a frame brings the window back. */
TEST snapshots_keep_the_window(void)
{
    springls_context *ctx = ball(true, NULL, (float)MIDDLE, 6.0f, NULL), *other = ball(true, NULL, (float)MIDDLE, 4.0f, NULL);
    char *all, *frame;
    size_t size, frame_size;
    uint64_t hash;
    int before;
    ASSERT_OK(blow(ctx, 2.0f, -1.0f, 0.0f, 100));
    all = snapshot_of(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    frame = snapshot_of(ctx, SPRINGLS_SNAPSHOT_KIND_FRAME, &frame_size);
    ASSERT(all && frame);
    before = moved(ctx, 0);
    ASSERT_GT(before, 100);
    ASSERT_OK(springls_restore(other, all, size));
    ASSERT_EQ(before, moved(other, 0));
    ASSERT(springls_state_hash(ctx) == springls_state_hash(other));
    ASSERT_OK(blow(ctx, 1.5f, 0.5f, -1.0f, 40));
    ASSERT_OK(blow(other, 1.5f, 0.5f, -1.0f, 40));
    hash = springls_state_hash(ctx);
    ASSERT(hash == springls_state_hash(other));
    ASSERT_GT(moved(ctx, 0), before);
    ASSERT_OK(springls_restore(ctx, frame, frame_size));
    ASSERT_EQ(before, moved(ctx, 0));
    ASSERT_OK(blow(ctx, 1.5f, 0.5f, -1.0f, 40));
    ASSERT(hash == springls_state_hash(ctx));
    ASSERT_OK(springls_reset(ctx));
    ASSERT_EQ(0, moved(ctx, 0));
    free(all);
    free(frame);
    springls_destroy(ctx);
    springls_destroy(other);
    PASS();
}

/* A step that is divided moves the window as a whole one does. */
TEST divided_steps_have_the_same_bits(void)
{
    springls_context *whole = ball(true, NULL, (float)MIDDLE, 6.0f, NULL), *divided = ball(true, NULL, (float)MIDDLE, 6.0f, NULL);
    float wind[3] = { 3.0f, 1.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    bool done;
    int i;
    step.max_displacement = 2.0f;
    for (i = 0; i < 12; i++) {
        ASSERT_OK(springls_step(whole, &step));
        ASSERT_OK(springls_step_begin(divided, &step));
        for (done = false; !done;) ASSERT_OK(springls_step_continue(divided, 0.0, &done));
    }
    ASSERT_GT(moved(whole, 0), 8);
    ASSERT(springls_state_hash(whole) == springls_state_hash(divided));
    springls_destroy(whole);
    springls_destroy(divided);
    PASS();
}

/* Steps of any length: springls that a step takes beyond the border are in the window after it. */
TEST a_leap_is_followed(springls_mode mode)
{
    springls_context *ctx = ball(true, NULL, (float)MIDDLE, 6.0f, NULL);
    float leap[3] = { 333.0f, -47.0f, 5.0f };
    springls_forces forces = fixture_forces(fixture_wind, leap);
    springls_step_desc step = fixture_step(&forces, mode, 1.0f);
    springls_measures before, after;
    ASSERT_OK(springls_measure(ctx, &before));
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_LT(fabs(after.volume / before.volume - 1.0), 0.01);
    ASSERT_LT(fabs((double)(after.lower[0] - before.lower[0] - leap[0])), 0.1);
    ASSERT_EQ(0, (int)springls_get_stats(ctx).left);
    springls_destroy(ctx);
    PASS();
}

/* Further than floats can follow: refused, and the model stays as it was. */
TEST a_leap_too_far_is_refused(void)
{
    springls_context *ctx = ball(true, NULL, (float)MIDDLE, 6.0f, NULL);
    springls_measures before, after;
    ASSERT_OK(springls_measure(ctx, &before));
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, blow(ctx, 1e7f, 0.0f, 0.0f, 1));
    ASSERT(strstr(springls_last_error(ctx), "at most 1000000") != NULL);
    ASSERT_EQ(0, moved(ctx, 0));
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_EQ(before.volume, after.volume);
    springls_destroy(ctx);
    PASS();
}

/* ---- chunks ---- */

enum { CHUNKS = 4096 };

typedef struct store { springls_chunk chunk[CHUNKS]; int count; } store;

/* Takes what has changed. Returns how many places of vertices lie outside of the brick that their chunk is named after. */
static int store_put(store *s, const springls_chunk *changed, int count)
{
    int i, j, k, wrong = 0;
    for (i = 0; i < count; i++) {
        for (j = 0; j < s->count && memcmp(s->chunk[j].brick, changed[i].brick, sizeof changed[i].brick) != 0;) j++;
        if (j == CHUNKS) return -1;
        if (j == s->count) s->count++;
        s->chunk[j] = changed[i];
        for (k = 0; k < 3 * changed[i].vertex_count; k++) {
            double from = (double)changed[i].positions[k] - 8.0 * changed[i].brick[k % 3];
            wrong += !(from > -0.01 && from < 8.01);
        }
    }
    return wrong;
}

/* The chunks of a consumer are the mesh, whichever way the window has gone between its updates; a chunk's brick is its place. */
TEST chunks_keep_their_names(springls_contouring contouring)
{
    static const float way[][3] = { { 2, 0, 0 }, { 2, 1, 0 }, { -2, 0, -1 }, { 0, 0, 0 }, { -2, 0, 0 } };
    static const int steps[] = { 5, 30, 80, 1, 3 };
    static store s;
    springls_params params = springls_default_params();
    springls_context *ctx;
    springls_chunks_desc desc;
    springls_chunks *chunks;
    const springls_chunk *changed;
    springls_mesh mesh;
    int i, k, count, triangles;
    params.contouring = contouring;
    ctx = ball(true, &params, (float)MIDDLE, 7.0f, NULL);
    memset(&desc, 0, sizeof desc);
    desc.tolerance = -1.0f;
    desc.correspondences = true;
    s.count = 0;
    ASSERT_OK(springls_chunks_create(ctx, &desc, &chunks));
    for (i = 0; i < 5; i++) {
        ASSERT_OK(blow(ctx, way[i][0], way[i][1], way[i][2], steps[i]));
        ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &count));
        ASSERT_EQ(0, store_put(&s, changed, count));
        for (k = 1; k < count; k++)
            ASSERT(changed[k].brick[2] > changed[k - 1].brick[2] || (changed[k].brick[2] == changed[k - 1].brick[2]
                   && (changed[k].brick[1] > changed[k - 1].brick[1] || (changed[k].brick[1] == changed[k - 1].brick[1]
                   && changed[k].brick[0] > changed[k - 1].brick[0]))));
        ASSERT_OK(springls_extract_mesh(ctx, &mesh));
        for (k = triangles = 0; k < s.count; k++) triangles += s.chunk[k].triangle_count;
        ASSERT_EQ(mesh.triangle_count, triangles);
        springls_mesh_free(ctx, &mesh);
    }
    springls_chunks_destroy(ctx, chunks);
    springls_destroy(ctx);
    PASS();
}

/* ---- several models ---- */

/* Volume of the union of two balls of radius r, d apart. */
static double union_volume(double r, double d)
{
    double ball_volume = 4.0 / 3.0 * fixture_pi * r * r * r;
    double lens = d < 2.0 * r ? fixture_pi * (4.0 * r + d) * (2.0 * r - d) * (2.0 * r - d) / 12.0 : 0.0;
    return 2.0 * ball_volume - lens;
}

/* Models in windows of their own are combined where they are in the world. */
TEST windows_are_combined(springls_operation operation)
{
    const double r = 7.0, apart = 8.0, one = 4.0 / 3.0 * fixture_pi * r * r * r;
    springls_context *a = ball(true, NULL, (float)MIDDLE, (float)r, NULL), *b = ball(true, NULL, (float)MIDDLE, (float)r, NULL);
    springls_measures m;
    springls_stats stats;
    uint64_t hash;
    double both = union_volume(r, apart), expected;
    int own = 0, i;
    ASSERT_OK(blow(a, 2.0f, 0.0f, 0.0f, 100));
    ASSERT_OK(blow(b, 2.0f, 0.0f, 0.0f, 104));
    ASSERT(moved(a, 0) != moved(b, 0));
    hash = springls_state_hash(b);
    ASSERT_OK(springls_combine(a, operation, b));
    ASSERT(hash == springls_state_hash(b));
    ASSERT_OK(springls_measure(a, &m));
    expected = operation == SPRINGLS_OPERATION_UNION ? both
             : operation == SPRINGLS_OPERATION_DIFFERENCE ? both - one : 2.0 * one - both;
    ASSERT_LT(fabs(m.volume - expected), 0.02 * one);
    ASSERT_EQ(1, m.components);
    if (operation == SPRINGLS_OPERATION_UNION) ASSERT_LT(fabs((double)m.upper[0] - 239.0), 0.1);
    if (operation == SPRINGLS_OPERATION_INTERSECTION) ASSERT_LT(fabs((double)m.upper[0] - 231.0), 0.1);
    for (i = 0; i < springls_count(a); i++) own += fixture_origin(a, i).x < (float)MIDDLE;
    ASSERT_GT(own, 0);
    stats = springls_get_stats(a);
    ASSERT_EQ(0, (int)stats.left);
    ASSERT_OK(blow(a, 2.0f, 0.0f, 0.0f, 50));
    ASSERT_OK(springls_measure(a, &m));
    ASSERT_LT(fabs(m.volume - expected), 0.03 * one);
    springls_destroy(a);
    springls_destroy(b);
    PASS();
}

/* A union that does not fit in one window is refused, and nothing has changed; what does not meet is not changed by a
   difference. */
TEST a_union_of_what_is_far_apart_is_refused(bool follow, int window)
{
    springls_context *a = ball(follow, NULL, (float)MIDDLE, 7.0f, NULL), *b = NULL;
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_sphere there = fixture_ball((float)MIDDLE, (float)MIDDLE + (float)window, (float)MIDDLE, 7.0f);
    springls_measures m;
    uint64_t hash, other;
    int offset[3], count;
    desc.follow = follow;
    desc.window[1] = window;
    ASSERT_OK(springls_create(&desc, &b));
    ASSERT_OK(springls_set_implicit(b, springls_implicit_sphere, &there));
    ASSERT_GT(springls_count(b), 0);
    hash = springls_state_hash(a);
    other = springls_state_hash(b);
    count = springls_count(a);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine(a, SPRINGLS_OPERATION_UNION, b));
    ASSERT(strstr(springls_last_error(a), "along axis 1 both models reach from voxel") != NULL);
    ASSERT(hash == springls_state_hash(a) && other == springls_state_hash(b));
    springls_window_offset(a, offset);
    ASSERT_EQ(0, offset[1]);
    ASSERT_OK(springls_combine(a, SPRINGLS_OPERATION_DIFFERENCE, b));
    ASSERT_EQ(count, springls_count(a));
    ASSERT_OK(springls_measure(a, &m));
    ASSERT_EQ(1, m.components);
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_combine(a, SPRINGLS_OPERATION_INTERSECTION, b));
    springls_destroy(a);
    springls_destroy(b);
    PASS();
}

/* A shape of the world is combined, and a mesh of the world made the original, after the window has moved. */
TEST inputs_of_the_world_meet_the_model(void)
{
    springls_context *ctx = ball(true, NULL, (float)MIDDLE, 7.0f, NULL);
    springls_sphere hole = fixture_ball(224.0f, (float)MIDDLE + 7.0f, (float)MIDDLE, 5.0f);
    springls_measures m;
    springls_mesh mesh;
    float before[3];
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    ASSERT_OK(blow(ctx, 2.0f, 0.0f, 0.0f, 100));
    memcpy(before, springls_view_correspondences(ctx).data, sizeof before);
    ASSERT_OK(springls_set_reference_mesh(ctx, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL));
    ASSERT_MEM_EQ(before, springls_view_correspondences(ctx).data, sizeof before);
    springls_mesh_free(ctx, &mesh);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
    ASSERT_LT(d3_distance(d3_of(fixture_origin(ctx, 0)), d3_make(before[0], before[1], before[2])), 0.1);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    springls_mesh_free(ctx, &mesh);
    ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &hole));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_LT(m.volume, 0.95 * 4.0 / 3.0 * fixture_pi * 343.0);
    ASSERT_GT(m.volume, 0.6 * 4.0 / 3.0 * fixture_pi * 343.0);
    ASSERT_LT(fabs((double)m.upper[0] - 231.0), 0.1);
    ASSERT_OK(springls_set_reference(ctx));
    ASSERT_LT(d3_distance(d3_of(fixture_origin(ctx, 0)), d3_of(fixture_particle(ctx, 0))), 1e-6);
    springls_destroy(ctx);
    PASS();
}

/* A mesh is set where it is in the world, however far the window has come. */
TEST a_mesh_is_set_in_the_world(void)
{
    springls_context *stayed = ball(true, NULL, (float)MIDDLE, 7.0f, NULL), *gone = ball(true, NULL, (float)MIDDLE, 7.0f, NULL);
    springls_mesh mesh;
    ASSERT_OK(springls_extract_mesh(stayed, &mesh));
    ASSERT_OK(blow(gone, 2.0f, 0.0f, 0.0f, 30));
    ASSERT_GT(moved(gone, 0), 0);
    ASSERT_OK(springls_set_mesh(stayed, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL));
    ASSERT_OK(springls_set_mesh(gone, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL));
    ASSERT_EQ(0, moved(gone, 0));
    ASSERT_EQ(springls_state_hash(stayed), springls_state_hash(gone));
    springls_mesh_free(stayed, &mesh);
    springls_destroy(stayed);
    springls_destroy(gone);
    PASS();
}

/* Components keep their ids while the window moves, and their places are those of the world. */
TEST components_are_followed(void)
{
    springls_params params = springls_default_params();
    springls_context *ctx;
    const springls_component *list;
    const springls_event *events;
    uint32_t id;
    int count;
    params.components = 1;
    params.volume_lock = 1;
    ctx = ball(true, &params, (float)MIDDLE, 7.0f, NULL);
    ASSERT_OK(blow(ctx, 2.0f, 0.0f, 0.0f, 1));
    ASSERT_OK(springls_components(ctx, &list, &count));
    ASSERT_EQ(1, count);
    id = list[0].id;
    ASSERT_OK(blow(ctx, 2.0f, 0.0f, 0.0f, 59));
    ASSERT_OK(springls_components(ctx, &list, &count));
    ASSERT_EQ(1, count);
    ASSERT_EQ(id, list[0].id);
    ASSERT_LT(fabs((double)list[0].center[0] - 144.0), 0.1);
    ASSERT_OK(springls_events(ctx, &events, &count));
    ASSERT_EQ(0, count);
    springls_destroy(ctx);
    PASS();
}

/* ---- borders ---- */

/* Springls that leave a grid are counted; a window that follows loses none. */
TEST springls_that_leave_are_counted(void)
{
    springls_context *fixed = ball(false, NULL, (float)MIDDLE, 6.0f, NULL), *follows = ball(true, NULL, (float)MIDDLE, 6.0f, NULL);
    springls_stats stats;
    int count = springls_count(fixed);
    ASSERT_OK(blow(fixed, 1.74f, 0.0f, 0.0f, 17)); /* the last one resamples, which removes them */
    ASSERT_OK(blow(follows, 1.74f, 0.0f, 0.0f, 17));
    stats = springls_get_stats(fixed);
    ASSERT_GT(stats.left, 500);
    ASSERT_LT(stats.left, stats.removed + 1);
    ASSERT_LT(springls_count(fixed), count);
    ASSERT_EQ(0, (int)springls_get_stats(follows).left);
    springls_destroy(fixed);
    springls_destroy(follows);
    PASS();
}

/* A model that is larger than the window moves with it as far as it fits, and what does not fit is counted. */
TEST what_is_too_large_leaves(void)
{
    springls_box bar = { { MIDDLE, MIDDLE, MIDDLE }, { 22.0f, 4.0f, 4.0f } };
    springls_context *ctx = ball(true, NULL, (float)MIDDLE, 6.0f, NULL);
    springls_measures m;
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_box, &bar));
    ASSERT_OK(blow(ctx, 1.5f, 0.0f, 0.0f, 40));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_GT(m.volume, 0.0);
    ASSERT_GT(m.upper[0], 70.0f);
    ASSERT_LT(m.upper[0] - m.lower[0], (float)SIZE + 0.1f);
    springls_destroy(ctx);
    PASS();
}

TEST a_size_that_bricks_do_not_fill_is_refused(void)
{
    springls_desc desc = fixture_desc(SIZE + 4, NULL);
    springls_context *ctx = NULL;
    desc.follow = true;
    ASSERT(strstr(springls_create_error(&desc), "multiple of 8") != NULL);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_create(&desc, &ctx));
    ASSERT(ctx == NULL);
    desc.follow = false;
    ASSERT_STR_EQ("", springls_create_error(&desc));
    PASS();
}

/* A model is made in a window beside another one that has come far, and combined with it; a reset leaves the window there. */
TEST a_window_begins_anywhere(void)
{
    springls_context *a = ball(true, NULL, (float)MIDDLE, 7.0f, NULL), *b = NULL;
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_sphere hole;
    springls_measures m;
    int offset[3];
    double before;
    ASSERT_OK(blow(a, 2.0f, 0.0f, 0.0f, 100));
    ASSERT_OK(springls_measure(a, &m));
    before = m.volume;
    springls_window_offset(a, desc.window);
    ASSERT_GT(desc.window[0], 100);
    hole = fixture_ball((float)MIDDLE + 200.0f, (float)MIDDLE, (float)MIDDLE, 4.0f);
    ASSERT_OK(springls_create(&desc, &b));
    ASSERT_OK(springls_set_implicit(b, springls_implicit_sphere, &hole));
    springls_window_offset(b, offset);
    ASSERT_EQ(0, memcmp(offset, desc.window, sizeof offset));
    ASSERT_OK(springls_measure(b, &m));
    ASSERT_LT(fabs((double)(m.lower[0] + m.upper[0]) - 2.0 * (MIDDLE + 200.0)), 0.1);
    ASSERT_OK(springls_combine(a, SPRINGLS_OPERATION_DIFFERENCE, b));
    ASSERT_OK(springls_measure(a, &m));
    ASSERT_LT(fabs(before - m.volume - 4.0 / 3.0 * fixture_pi * 64.0), 0.02 * before);
    ASSERT_OK(springls_reset(b));
    springls_window_offset(b, offset);
    ASSERT_EQ(0, memcmp(offset, desc.window, sizeof offset));
    springls_destroy(a);
    springls_destroy(b);
    desc.window[1] = 4;
    ASSERT(strstr(springls_create_error(&desc), "window is no multiple of 8") != NULL);
    desc.window[1] = INT32_MIN;
    ASSERT(strstr(springls_create_error(&desc), "out of range") != NULL);
    desc.window[1] = 8;
    desc.grid.size[0] = 30;
    ASSERT(strstr(springls_create_error(&desc), "but window is set") != NULL);
    PASS();
}

/* Memory that runs out at any allocation while the window moves: one failure, and nothing is leaked. */
TEST memory_may_run_out(springls_contouring contouring)
{
    springls_params params = springls_default_params();
    int fail_at, failures = 0;
    params.contouring = contouring;
    for (fail_at = 0; fail_at < 2000; fail_at++) {
        fixture_heap heap;
        springls_allocator allocator = fixture_allocator(&heap);
        springls_context *ctx;
        springls_chunks *chunks = NULL;
        const springls_chunk *changed;
        springls_status status;
        int count, calls;
        ctx = ball(true, &params, 20.0f, 3.0f, &allocator);
        ASSERT(ctx != NULL);
        calls = heap.calls;
        heap.fail_at = calls + fail_at;
        status = springls_chunks_create(ctx, NULL, &chunks);
        if (status == SPRINGLS_OK) status = springls_chunks_update(ctx, chunks, &changed, &count);
        if (status == SPRINGLS_OK) status = blow(ctx, 4.0f, 0.0f, 0.0f, 6);
        if (status == SPRINGLS_OK) status = springls_chunks_update(ctx, chunks, &changed, &count);
        ASSERT(status == SPRINGLS_OK || status == SPRINGLS_OUT_OF_MEMORY);
        failures += status == SPRINGLS_OUT_OF_MEMORY;
        if (status == SPRINGLS_OK) ASSERT(moved(ctx, 0) > 0);
        else ASSERT(strlen(springls_last_error(ctx)) > 0);
        heap.fail_at = -1;
        if (chunks) { /* what has failed can go on */
            ASSERT_OK(blow(ctx, 4.0f, 0.0f, 0.0f, 6));
            ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &count));
            ASSERT_GT(count, 0);
        }
        springls_chunks_destroy(ctx, chunks);
        springls_destroy(ctx);
        ASSERT_EQ(0, heap.blocks);
        ASSERT_EQ(0, heap.wrong_sizes);
        if (status == SPRINGLS_OK) break;
    }
    ASSERT_GT(failures, 5);
    PASS();
}

SUITE(window)
{
    greatest_set_test_suffix("east");
    RUN_TESTp(what_is_carried_far_has_the_bits_of_what_stays, 4.0f, 0.0f, 0.0f, 10000.0f);
    greatest_set_test_suffix("west");
    RUN_TESTp(what_is_carried_far_has_the_bits_of_what_stays, -4.0f, 2.0f, -2.0f, 1600.0f);
    RUN_TEST(a_whole_step_keeps_its_accuracy);
    RUN_TEST(places_are_of_the_world);
    greatest_set_test_suffix("lattice");
    RUN_TESTp(forces_stay_in_place, false);
    greatest_set_test_suffix("world");
    RUN_TESTp(forces_stay_in_place, true);
    RUN_TEST(flows_stay_in_place);
    RUN_TEST(snapshots_keep_the_window);
    RUN_TEST(divided_steps_have_the_same_bits);
    greatest_set_test_suffix("elastic");
    RUN_TESTp(a_leap_is_followed, SPRINGLS_MODE_ELASTIC);
    greatest_set_test_suffix("fluid");
    RUN_TESTp(a_leap_is_followed, SPRINGLS_MODE_FLUID);
    RUN_TEST(a_leap_too_far_is_refused);
    greatest_set_test_suffix("zero_level");
    RUN_TESTp(chunks_keep_their_names, SPRINGLS_CONTOURING_LEVEL_SET);
    greatest_set_test_suffix("springls");
    RUN_TESTp(chunks_keep_their_names, SPRINGLS_CONTOURING_SPRINGLS);
    greatest_set_test_suffix("union");
    RUN_TESTp(windows_are_combined, SPRINGLS_OPERATION_UNION);
    greatest_set_test_suffix("difference");
    RUN_TESTp(windows_are_combined, SPRINGLS_OPERATION_DIFFERENCE);
    RUN_TESTp(a_union_of_what_is_far_apart_is_refused, true, SIZE);
    RUN_TESTp(a_union_of_what_is_far_apart_is_refused, false, SIZE);
    RUN_TESTp(a_union_of_what_is_far_apart_is_refused, true, -40000);
    greatest_set_test_suffix("intersection");
    RUN_TESTp(windows_are_combined, SPRINGLS_OPERATION_INTERSECTION);
    RUN_TEST(inputs_of_the_world_meet_the_model);
    RUN_TEST(a_mesh_is_set_in_the_world);
    RUN_TEST(components_are_followed);
    RUN_TEST(springls_that_leave_are_counted);
    RUN_TEST(what_is_too_large_leaves);
    RUN_TEST(a_size_that_bricks_do_not_fill_is_refused);
    RUN_TEST(a_window_begins_anywhere);
    greatest_set_test_suffix("zero_level");
    RUN_TESTp(memory_may_run_out, SPRINGLS_CONTOURING_LEVEL_SET);
    greatest_set_test_suffix("springls");
    RUN_TESTp(memory_may_run_out, SPRINGLS_CONTOURING_SPRINGLS);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(window);
    GREATEST_MAIN_END();
}
