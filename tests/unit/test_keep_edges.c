/* test_keep_edges.c - boxes and slots stay sharp (params.keep_edges): measured against the exact shape, turned and moved. */
#include "fixtures.h"

/* A body moved rigidly: what is at x now was at back(x) at the start. */
typedef struct rigid { d3 center, turn, shift; } rigid;

static d3 back(const rigid *motion, d3 x)
{
    d3 d = d3_sub(d3_sub(x, motion->shift), motion->center);
    return d3_add(motion->center, d3_rotate(d, d3_scale(motion->turn, -1.0)));
}

typedef struct box { d3 center; double side[3]; } box; /* side: half lengths */

static const box the_box = { { 23.8, 23.4, 23.1 }, { 9.0, 7.0, 5.0 } };

/* Signed distance, and how many faces come within `near` of x: two at an edge. */
static double box_distance(const box *b, d3 x, double near, int *faces)
{
    double d[3], inside, beyond = 0.0;
    int k;
    d[0] = fabs(x.x - b->center.x) - b->side[0];
    d[1] = fabs(x.y - b->center.y) - b->side[1];
    d[2] = fabs(x.z - b->center.z) - b->side[2];
    inside = fmax(d[0], fmax(d[1], d[2]));
    for (*faces = 0, k = 0; k < 3; k++) {
        *faces += fabs(d[k]) < near;
        if (d[k] > 0.0) beyond += d[k] * d[k];
    }
    return inside <= 0.0 ? inside : sqrt(beyond);
}

typedef struct errors { double mean, most, edge_mean, edge_most; int count, edge_count; } errors;

static void add_error(errors *e, double d, int at_edge)
{
    e->count++;
    e->mean += fabs(d);
    e->most = fmax(e->most, fabs(d));
    if (!at_edge) return;
    e->edge_count++;
    e->edge_mean += fabs(d);
    e->edge_most = fmax(e->edge_most, fabs(d));
}

static errors mean_errors(errors e)
{
    e.mean /= e.count;
    e.edge_mean /= e.edge_count ? e.edge_count : 1;
    return e;
}

static errors particle_errors(const springls_context *ctx, const rigid *motion)
{
    errors e = { 0.0, 0.0, 0.0, 0.0, 0, 0 };
    int i, faces;
    for (i = 0; i < springls_count(ctx); i++) {
        double d = box_distance(&the_box, back(motion, d3_of(fixture_particle(ctx, i))), 1.5, &faces);
        add_error(&e, d, faces > 1);
    }
    return mean_errors(e);
}

static errors mesh_errors(springls_context *ctx, const rigid *motion)
{
    errors e = { 0.0, 0.0, 0.0, 0.0, 0, 0 };
    springls_mesh mesh;
    int i, faces;
    if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) return e;
    for (i = 0; i < mesh.vertex_count; i++) {
        const float *x = mesh.positions + 3 * i;
        double d = box_distance(&the_box, back(motion, d3_make((double)x[0], (double)x[1], (double)x[2])), 1.5, &faces);
        add_error(&e, d, faces > 1);
    }
    springls_mesh_free(ctx, &mesh);
    return mean_errors(e);
}

/* The box where it is now, as springls_set_implicit wants it. */
static void posed_box(void *user, const float *points, int count, float *out)
{
    int i, faces;
    for (i = 0; i < count; i++, points += 3)
        out[i] = (float)box_distance(
            &the_box, back((const rigid *)user, d3_make((double)points[0], (double)points[1], (double)points[2])), 1.0, &faces);
}

/* What marching cubes makes of the exact distance there: no model on this grid can do much better. */
static errors exact_mesh_errors(rigid *motion)
{
    springls_context *ctx = fixture_context(48, NULL);
    errors e = { 9.0, 9.0, 9.0, 9.0, 0, 0 };
    if (springls_set_implicit(ctx, posed_box, motion) == SPRINGLS_OK) e = mesh_errors(ctx, motion);
    springls_destroy(ctx);
    return e;
}

static springls_context *box_model(int keep_edges)
{
    springls_params params = springls_default_params();
    springls_box b;
    springls_context *ctx;
    int k;
    params.keep_edges = keep_edges;
    ctx = fixture_context(48, &params);
    b.center[0] = (float)the_box.center.x;
    b.center[1] = (float)the_box.center.y;
    b.center[2] = (float)the_box.center.z;
    for (k = 0; k < 3; k++) b.half[k] = (float)the_box.side[k];
    springls_set_implicit(ctx, springls_implicit_box, &b);
    return ctx;
}

/* Steps of a turn about (.48 .6 .64) through the middle of the box; 150 make a whole one. */
static springls_status turn(springls_context *ctx, int steps, rigid *motion)
{
    const double speed = 2.0 * fixture_pi / 150.0;
    struct exact_flow flow = EXACT_ROTATION((float)the_box.center.x, (float)the_box.center.y, (float)the_box.center.z, 0.48f, 0.6f,
                                            0.64f, (float)speed);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    motion->center = the_box.center;
    motion->shift = d3_make(0.0, 0.0, 0.0);
    motion->turn = d3_scale(d3_make(0.48, 0.6, 0.64), speed * steps);
    return springls_run(ctx, &step, steps);
}

static const rigid at_rest = { { 0.0, 0.0, 0.0 }, { 0.0, 0.0, 0.0 }, { 0.0, 0.0, 0.0 } };

static double volume_of(springls_context *ctx)
{
    springls_measures m;
    return springls_measure(ctx, &m) == SPRINGLS_OK && m.components == 1 && m.euler == 2 ? m.volume : -1.0;
}

/* Marching cubes cuts corners off; the springls do not keep what it did. */
TEST initial_springls_are_on_the_faces(void)
{
    springls_context *ctx = box_model(1);
    errors p = particle_errors(ctx, &at_rest);
    ASSERT_GT(p.edge_count, 300);
    ASSERT_LT(p.edge_mean, 0.002);
    ASSERT_LT(p.edge_most, 0.2);
    springls_destroy(ctx);
    PASS();
}

/* Wherever its faces lie to the voxels, on them or close beside, a box has all its edges: springls along each of the twelve are
   marked, and none cuts one off. */
TEST faces_may_lie_on_voxel_planes(void)
{
    static const float offset[7] = { 0.0f, 1e-5f, -1e-5f, 0.05f, -0.1f, 0.15f, 0.2f };
    springls_context *ctx = fixture_context(32, NULL);
    springls_box b;
    int o, i, k, marked[12];
    for (o = 0; o < 7; o++) {
        for (k = 0; k < 3; k++) {
            b.center[k] = 15.0f + offset[o];
            b.half[k] = 6.0f;
        }
        memset(marked, 0, sizeof marked);
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_box, &b));
        fixture_here(ctx);
        for (i = 0; i < springls_count(ctx); i++) {
            springls__v3 p = ctx->model.set.s[i].p, n = springls__springl_normal(ctx->model.set.s[i]);
            float x[3], most = springls__max(springls__max(springls__fabs(n.x), springls__fabs(n.y)), springls__fabs(n.z)), off;
            springls_implicit_box(&b, &p.x, 1, &off);
            ASSERT_IN_RANGE(0.0f, off, 0.2f);
            ASSERT_GT(most, 0.99f);
            if (!ctx->model.set.edge[i]) continue;
            x[0] = p.x - b.center[0]; x[1] = p.y - b.center[1]; x[2] = p.z - b.center[2];
            for (k = 0; k < 3; k++) { /* edges along axis k */
                float u = x[(k + 1) % 3], v = x[(k + 2) % 3];
                if (springls__fabs(u) > 4.0f && springls__fabs(v) > 4.0f) marked[4 * k + 2 * (u > 0.0f) + (v > 0.0f)]++;
            }
        }
        for (k = 0; k < 12; k++) ASSERT_GT(marked[k], 10);
    }
    springls_destroy(ctx);
    PASS();
}

/* Three eighths of a turn, where no face lies along the grid, and a whole one: edges of the box are where they belong, and an
   average over their sides would be far from there. */
TEST box_stays_sharp_through_a_turn(void)
{
    springls_context *ctx = box_model(1), *blunt = box_model(0);
    double before;
    errors p, mesh, exact;
    rigid motion;
    int part;
    before = volume_of(ctx);
    for (part = 0; part < 2; part++) {
        ASSERT_OK(turn(ctx, part ? 94 : 56, &motion));
        ASSERT_OK(turn(blunt, part ? 94 : 56, &motion));
        motion.turn = d3_scale(motion.turn, part ? 150.0 / 94.0 : 1.0);
        p = particle_errors(ctx, &motion);
        mesh = mesh_errors(ctx, &motion);
        exact = exact_mesh_errors(&motion);
        ASSERT_GT(springls_get_stats(ctx).at_edges, 100);
        ASSERT_LT(p.edge_mean, 0.005);
        ASSERT_LT(mesh.edge_mean, 2.0 * exact.edge_mean);
        ASSERT_LT(2.0 * p.edge_mean, particle_errors(blunt, &motion).edge_mean);
        ASSERT_LT(1.4 * mesh.edge_mean, mesh_errors(blunt, &motion).edge_mean);
        ASSERT_IN_RANGE(before, volume_of(ctx), 0.006 * before);
    }
    ASSERT_EQ(0, springls_get_stats(blunt).at_edges);
    springls_destroy(ctx);
    springls_destroy(blunt);
    PASS();
}

/* There and back by steps that are no whole voxels. */
TEST box_stays_sharp_when_it_is_moved(void)
{
    springls_context *ctx = box_model(1);
    double before = volume_of(ctx);
    float v[3] = { 0.317f, 0.211f, -0.157f };
    springls_forces forces = fixture_forces(fixture_wind, v);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    errors p, mesh, exact;
    rigid motion = at_rest;
    int leg, k;
    for (leg = 0; leg < 3; leg++) {
        ASSERT_OK(springls_run(ctx, &step, 11));
        motion.shift = d3_add(motion.shift, d3_scale(d3_make((double)v[0], (double)v[1], (double)v[2]), 11.0));
        p = particle_errors(ctx, &motion);
        mesh = mesh_errors(ctx, &motion);
        exact = exact_mesh_errors(&motion);
        ASSERT_LT(p.edge_mean, 0.012);
        ASSERT_LT(mesh.edge_mean, 2.0 * exact.edge_mean);
        ASSERT_IN_RANGE(before, volume_of(ctx), 0.006 * before);
        for (k = 0; k < 3; k++) v[k] = -v[k];
    }
    springls_destroy(ctx);
    PASS();
}

/* Springls as large as faces allow, split again and again: the children stay on the side of their parents. */
TEST splits_stay_on_their_side(void)
{
    springls_context *ctx = box_model(1);
    springls_params params = springls_get_params(ctx);
    errors p;
    rigid motion;
    int count;
    params.cover = 0; /* which keeps edges below split_edge */
    params.split_edge = 0.9f;
    params.merge_distance = 0.0f;
    ASSERT_OK(springls_set_params(ctx, &params));
    ASSERT_OK(turn(ctx, 1, &motion));
    count = springls_count(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
    ASSERT_GT(springls_count(ctx), count + 100);
    p = particle_errors(ctx, &motion);
    ASSERT_LT(p.edge_mean, 0.02);
    springls_destroy(ctx);
    PASS();
}

/* Zalesak's body: convex edges of curved faces, concave ones at the roof of the slot. */
TEST slot_stays_sharp(void)
{
    springls_params params = springls_default_params();
    double mean[2], moved[2], volume[2];
    int keep;
    for (keep = 0; keep < 2; keep++) {
        springls_notched_sphere body = { { 23.8f, 23.4f, 23.1f }, 12.0f, 4.0f, 10.0f };
        springls_context *ctx;
        springls_mesh mesh;
        rigid motion;
        int i, m;
        params.keep_edges = keep;
        ctx = fixture_context(48, &params);
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_notched_sphere, &body));
        volume[keep] = volume_of(ctx);
        ASSERT_OK(turn(ctx, 75, &motion));
        volume[keep] = volume_of(ctx) / volume[keep] - 1.0;
        ASSERT_OK(springls_extract_mesh(ctx, &mesh));
        for (mean[keep] = 0.0, i = 0; i < mesh.vertex_count; i++) {
            const float *x = mesh.positions + 3 * i;
            springls__v3 y = d3_float(back(&motion, d3_make((double)x[0], (double)x[1], (double)x[2])));
            float d;
            springls_implicit_notched_sphere(&body, &y.x, 1, &d);
            mean[keep] += (double)fabsf(d) / mesh.vertex_count;
        }
        for (moved[keep] = 0.0, m = springls_count(ctx), i = 0; i < m; i++) {
            springls__v3 y = d3_float(back(&motion, d3_of(fixture_particle(ctx, i))));
            float d;
            springls_implicit_notched_sphere(&body, &y.x, 1, &d);
            moved[keep] += (double)fabsf(d) / m;
        }
        springls_mesh_free(ctx, &mesh);
        springls_destroy(ctx);
    }
    ASSERT_LT(1.15 * mean[1], mean[0]);
    ASSERT_LT(1.2 * moved[1], moved[0]);
    ASSERT_IN_RANGE(0.0, volume[1], 0.002);
    PASS();
}

/* Limits of all these tests: measured, with room. Measured at the worst of the poses: a box's particles 0.0001 (without the
   switch 0.030), vertices 1.04 times the exact ones' (without 2.2 to 3.1), volume 0.25 %; a slot's vertices 0.011 (0.017),
   particles 0.0055 (0.0074). */

/* On a ball nothing is an edge, apart from a triangle now and then. */
TEST smooth_surfaces_have_no_edges(void)
{
    springls_context *ctx = fixture_sphere(48, NULL, 23.8f, 23.4f, 23.1f, 10.0f);
    d3 center = the_box.center;
    rigid motion;
    double most = 0.0;
    int i, step, edges = 0;
    for (step = 0; step < 40; step++) {
        ASSERT_OK(turn(ctx, 1, &motion));
        edges += springls_get_stats(ctx).at_edges;
    }
    for (i = 0; i < springls_count(ctx); i++)
        most = fmax(most, fabs(d3_distance(d3_of(fixture_particle(ctx, i)), center) - 10.0));
    ASSERT_LT(edges, 40 * springls_count(ctx) / 100);
    ASSERT_LT(most, 0.01);
    springls_destroy(ctx);
    PASS();
}

static const double rounding = 3.0; /* voxels */

/* A box with round edges: one with the inner sides, grown by the rounding. */
static void rounded_box(void *user, const float *points, int count, float *out)
{
    const box *b = (const box *)user;
    int i, faces;
    for (i = 0; i < count; i++, points += 3)
        out[i] = (float)(box_distance(b, d3_make((double)points[0], (double)points[1], (double)points[2]), 0.0, &faces) - rounding);
}

/* Springls of rounded edges lie on them: they are not moved as if they cut across a crease. */
TEST rounded_edges_are_no_creases(double x, double y, double z)
{
    box inner = { { 0.0, 0.0, 0.0 }, { 1.0, 7.0, 7.0 } };
    springls_context *ctx = fixture_context(32, NULL);
    int i, faces, off = 0;
    inner.center = d3_make(x, y, z);
    ASSERT_OK(springls_set_implicit(ctx, rounded_box, &inner));
    for (i = 0; i < springls_count(ctx); i++)
        off += fabs(box_distance(&inner, d3_of(fixture_particle(ctx, i)), 0.0, &faces) - rounding) > 0.05;
    ASSERT_LT(off, springls_count(ctx) / 200);
    springls_destroy(ctx);
    PASS();
}

SUITE(sharp_edges)
{
    RUN_TESTp(rounded_edges_are_no_creases, 16.25, 15.772, 15.228);
    RUN_TESTp(rounded_edges_are_no_creases, 15.125, 15.154, 15.846);
    RUN_TESTp(rounded_edges_are_no_creases, 15.875, 15.918, 15.082);
    RUN_TEST(initial_springls_are_on_the_faces);
    RUN_TEST(faces_may_lie_on_voxel_planes);
    RUN_TEST(box_stays_sharp_through_a_turn);
    RUN_TEST(box_stays_sharp_when_it_is_moved);
    RUN_TEST(splits_stay_on_their_side);
    RUN_TEST(slot_stays_sharp);
    RUN_TEST(smooth_surfaces_have_no_edges);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(sharp_edges);
    GREATEST_MAIN_END();
}
