/* test_metric.c - lengths, curvature and distances are those of the world, whatever the spacing and the direction of the grid: a ball
   has on grids of 1 x 1 x 3 and with oblique axes what it has on cubes. */
#include "metric_grids.h"

/* A ball of R shrinks to sqrt(R^2 - 4 t), round. */
TEST curvature_is_the_worlds(int grid, bool voxel_units)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.8f);
    ASSERT(ctx);
    forces.curvature_weight = 1.0f; /* the smallest spacing is 1 */
    forces.voxel_units = voxel_units;
    ASSERT_OK(springls_run(ctx, &step, 35));
    CHECK_CALL(check_ball(ctx, 12.0));
    springls_destroy(ctx);
    PASS();
}

/* The curvature of eq. 22 moves springls that carry phi by -2 lambda evolve_step / R in each step. */
TEST lambda_is_the_worlds(int grid)
{
    springls_params params = level_set_params();
    springls_context *ctx;
    springls_step_desc step = fixture_step(NULL, SPRINGLS_MODE_FLUID, 0.0f);
    params.curvature = 0.2f;
    ctx = ball_on(grid, &params, 16.0f);
    ASSERT(ctx);
    ASSERT_OK(springls_run(ctx, &step, 20));
    CHECK_CALL(check_ball(ctx, sqrt(256.0 - 4.0 * 20 * (double)(params.curvature * params.evolve_step))));
    springls_destroy(ctx);
    PASS();
}

/* By eq. 23 springls that stay hold phi back: it comes to rest inside them by as much as on cubes. */
TEST evolve_is_the_worlds(int grid)
{
    springls_params params = springls_paper_params();
    springls_context *ctx;
    double off = 0.0, off2 = 0.0;
    springls_mesh mesh;
    int i;
    params.curvature = 0.2f;
    ctx = ball_on(grid, &params, 16.0f);
    ASSERT(ctx);
    for (i = 0; i < 20; i++) {
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    }
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    for (i = 0; i < mesh.vertex_count; i++) {
        const double r =
            d3_distance(d3_of(springls__load3(mesh.positions + 3 * i)), d3_make((double)CENTER, (double)CENTER, (double)CENTER));
        off += r - 16.0;
        off2 += (r - 16.0) * (r - 16.0);
    }
    off /= mesh.vertex_count;
    ASSERT_IN_RANGE(-0.05, off, 0.05);
    ASSERT_IN_RANGE(0.0, sqrt(off2 / mesh.vertex_count - off * off), 0.1);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

TEST smooth_is_the_worlds(int grid, bool keep_volume)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    ASSERT(ctx);
    ASSERT_OK(springls_smooth(ctx, 10.0f, keep_volume));
    CHECK_CALL(check_ball(ctx, keep_volume ? 16.0 : sqrt(256.0 - 100.0)));
    springls_destroy(ctx);
    PASS();
}

TEST offset_is_the_worlds(int grid, float distance)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    ASSERT(ctx);
    ASSERT_OK(springls_offset(ctx, distance));
    CHECK_CALL(check_ball(ctx, 16.0 + (double)distance));
    springls_destroy(ctx);
    PASS();
}

/* volume_lock gives back by an even offset of the world what a pressure has taken: the ball stays round. */
TEST volume_lock_is_the_worlds(int grid)
{
    springls_params params = level_set_params();
    springls_context *ctx;
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
    params.volume_lock = 1;
    ctx = ball_on(grid, &params, 16.0f);
    ASSERT(ctx);
    forces.curvature_weight = 1.0f;
    ASSERT_OK(springls_run(ctx, &step, 30));
    CHECK_CALL(check_ball(ctx, 16.0));
    springls_destroy(ctx);
    PASS();
}

/* Distances, gradients, closest points and rays, at places in all directions about the surface. */
TEST queries_are_the_worlds(int grid)
{
    enum { COUNT = 400 };
    static float points[3 * COUNT], origins[3 * COUNT], directions[3 * COUNT], distance[COUNT], gradient[3 * COUNT];
    static springls_hit near_hit[COUNT], ray_hit[COUNT];
    static double expected[COUNT];
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    int i, k;
    ASSERT(ctx);
    fixture_seed(7);
    for (i = 0; i < COUNT; i++) {
        const springls__v3 n = fixture_direction();
        const float d[3] = { n.x, n.y, n.z };
        expected[i] = -2.0 + 4.0 * i / COUNT;
        for (k = 0; k < 3; k++) {
            points[3 * i + k] = CENTER + d[k] * (float)(16.0 + expected[i]);
            origins[3 * i + k] = CENTER + d[k] * 30.0f;
            directions[3 * i + k] = -d[k];
        }
    }
    ASSERT_OK(springls_sample_distance(ctx, points, COUNT, distance));
    ASSERT_OK(springls_sample_gradient(ctx, points, COUNT, gradient));
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, COUNT, near_hit));
    ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, origins, directions, COUNT, 0.0f, ray_hit));
    for (i = 0; i < COUNT; i++) {
        double along = 0.0;
        for (k = 0; k < 3; k++) along -= (double)(gradient[3 * i + k] * directions[3 * i + k]);
        ASSERT_IN_RANGE(expected[i], (double)distance[i], 0.15);
        ASSERT_IN_RANGE(fabs(expected[i]), (double)near_hit[i].distance, 0.15);
        ASSERT_IN_RANGE(14.0, (double)ray_hit[i].distance, 0.15);
        ASSERT_IN_RANGE(1.0, along, 0.06);
    }
    springls_destroy(ctx);
    PASS();
}

/* Far from the surface a distance ends at one that every direction reaches, without a jump. */
TEST distances_end_evenly(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    float out[2], point[6] = { CENTER, CENTER, CENTER, CENTER + 22.0f, CENTER, CENTER };
    ASSERT(ctx);
    ASSERT_OK(springls_sample_distance(ctx, point, 2, out));
    ASSERT_IN_RANGE(-4.0, (double)out[0], 1e-6);
    ASSERT_IN_RANGE(4.0, (double)out[1], 1e-6);
    springls_destroy(ctx);
    PASS();
}

/* Volume and area of the model, of its components and of its chunks' mesh. */
TEST measures_are_the_worlds(int grid)
{
    const double volume = 4.0 / 3.0 * 3.14159265 * 4096.0, area = 4.0 * 3.14159265 * 256.0;
    springls_params params = level_set_params();
    const springls_component *components;
    springls_measures measures;
    springls_context *ctx;
    int count;
    params.components = 1;
    ctx = ball_on(grid, &params, 16.0f);
    ASSERT(ctx);
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_IN_RANGE(volume, measures.volume, 0.015 * volume);
    ASSERT_IN_RANGE(area, measures.area, 0.015 * area);
    ASSERT_OK(springls_components(ctx, &components, &count));
    ASSERT_EQ(1, count);
    ASSERT_IN_RANGE(volume, components[0].volume, 0.015 * volume);
    ASSERT_IN_RANGE(area, components[0].area, 0.015 * area);
    ASSERT_IN_RANGE((double)CENTER, (double)components[0].center[2], 0.02);
    springls_destroy(ctx);
    PASS();
}

/* At least 95 of 100 springls are nearer to where the flow takes their correspondence than estimated; without a force of z a
   particle keeps its height, and its turn follows from that. */
TEST error_estimates_are_the_worlds(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    springls_forces forces = fixture_forces(swirl, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    springls_error_estimate *errors;
    const double time = 2.0;
    int i, count, good = 0;
    ASSERT(ctx);
    step.max_displacement = 2.0f;
    ASSERT_OK(springls_run(ctx, &step, 20));
    count = springls_count(ctx);
    errors = (springls_error_estimate *)malloc((size_t)count * sizeof *errors);
    ASSERT_OK(springls_springl_errors(ctx, errors));
    for (i = 0; i < count; i++) {
        const springls__v3 p = world_of(ctx, springls_view_particles(ctx), i), a = world_of(ctx, springls_view_correspondences(ctx), i);
        const d3 middle = d3_make((double)CENTER, (double)CENTER, (double)a.z);
        const d3 turn = d3_make(0.0, 0.0, ((double)a.z - (double)CENTER) * 0.01 * time);
        const d3 now = d3_add(middle, d3_rotate(d3_sub(d3_of(a), middle), turn));
        good += d3_distance(now, d3_of(p)) <= (double)errors[i].place + 1e-4;
    }
    ASSERT_GTE(good, (count * 95 + 99) / 100);
    free(errors);
    springls_destroy(ctx);
    PASS();
}

/* An estimate is a length of the world: the same springls on voxels a hundred times as large have a hundred times the error. */
TEST error_estimates_scale(void)
{
    static const float scale[2] = { 1.0f, 100.0f };
    springls_error_estimate *errors[2];
    int k, i, count = 0;
    for (k = 0; k < 2; k++) {
        springls_desc desc = fixture_desc(32, NULL);
        springls_sphere ball = { { 15.5f, 15.5f, 15.5f }, 9.0f };
        float wind[3] = { 0.4f, 0.3f, 0.2f };
        springls_forces forces = fixture_forces(fixture_wind, wind);
        springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
        springls_context *ctx;
        forces.voxel_units = true;
        for (i = 0; i < 3; i++) {
            desc.grid.spacing[i] = (double)scale[k];
            ball.center[i] *= scale[k];
        }
        ball.radius *= scale[k];
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        ASSERT_OK(springls_run(ctx, &step, 6));
        if (k == 1) count = count < springls_count(ctx) ? count : springls_count(ctx);
        else count = springls_count(ctx);
        errors[k] = (springls_error_estimate *)malloc((size_t)springls_count(ctx) * sizeof **errors);
        ASSERT_OK(springls_springl_errors(ctx, errors[k]));
        springls_destroy(ctx);
    }
    for (i = 0; i < count; i++) ASSERT_IN_RANGE(100.0 * (double)errors[0][i].place, (double)errors[1][i].place, 1.0);
    for (k = 0; k < 2; k++) free(errors[k]);
    PASS();
}

/* ---- what models are made from ---- */

/* From a mesh, a level set, intensities and springls comes the same ball; from labels one of their volume. */
TEST inputs_are_the_worlds(int grid)
{
    springls_context *ctx = context_on(grid, NULL), *cubes = ball_on(CUBES, NULL, 16.0f);
    float *depth;
    int32_t *labels = (int32_t *)malloc(sizeof *labels * 48 * 48 * 48);
    springls_measures measures;
    springls_mesh mesh;
    int i;
    ASSERT(ctx && cubes && labels);
    depth = depths_on(ctx);
    ASSERT_OK(springls_extract_mesh(cubes, &mesh));
    ASSERT_OK(springls_set_mesh(ctx, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL));
    CHECK_CALL(check_ball(ctx, 16.0));
    springls_mesh_free(cubes, &mesh);
    for (i = 0; i < 48 * 48 * 48; i++) labels[i] = depth[i] > 0.0f;
    ASSERT_OK(springls_set_threshold(ctx, depth, 0.0f, 1e6f));
    CHECK_CALL(check_ball(ctx, 16.0));
    ASSERT_OK(springls_extract_soup(ctx, &mesh));
    ASSERT_EQ(3 * mesh.triangle_count, mesh.vertex_count);
    springls_to_voxel(ctx, mesh.positions, mesh.vertex_count, mesh.positions);
    ASSERT_OK(springls_set_springls(ctx, mesh.positions, NULL, NULL, mesh.triangle_count));
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_IN_RANGE(4.0 / 3.0 * 3.14159265 * 4096.0, measures.volume, 0.015 * measures.volume);
    springls_mesh_free(ctx, &mesh);
    for (i = 0; i < 48 * 48 * 48; i++) depth[i] = -depth[i];
    ASSERT_OK(springls_set_level_set(ctx, depth));
    CHECK_CALL(check_ball(ctx, 16.0));
    ASSERT_OK(springls_set_labels(ctx, labels, 1));
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_IN_RANGE(4.0 / 3.0 * 3.14159265 * 4096.0, measures.volume, 0.03 * measures.volume);
    free(depth);
    free(labels);
    springls_destroy(ctx);
    springls_destroy(cubes);
    PASS();
}

/* ---- what changes them ---- */

/* Of two balls 14 apart: the lens that both have, of pi (R + r - d)^2 (d^2 + 2 d (R + r) - 3 (R - r)^2) / (12 d). */
TEST combinations_are_the_worlds(int grid)
{
    static const float towards[3][3] = { { 14, 0, 0 }, { 0, 14, 0 }, { 0, 0, 14 } };
    const double ball = 4.0 / 3.0 * 3.14159265 * 4096.0, lens = 3.14159265 * 100.0 * (196.0 + 28.0 * 24.0 - 192.0) / 168.0;
    int k, i;
    for (k = 0; k < 3; k++) {
        springls_context *ctx = ball_on(grid, NULL, 16.0f);
        springls_sphere tool = { { CENTER, CENTER, CENTER }, 8.0f };
        springls_measures measures;
        ASSERT(ctx);
        for (i = 0; i < 3; i++) tool.center[i] += towards[k][i];
        ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &tool));
        ASSERT_OK(springls_measure(ctx, &measures));
        ASSERT_IN_RANGE(ball - lens, measures.volume, 0.015 * ball);
        springls_destroy(ctx);
    }
    PASS();
}

TEST followed_and_remeshed_are_the_worlds(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    springls_sphere grown = { { CENTER, CENTER, CENTER }, 17.0f };
    springls_follow_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.fn = springls_implicit_sphere;
    desc.user = &grown;
    ASSERT(ctx);
    ASSERT_OK(springls_follow_level_set(ctx, &desc));
    CHECK_CALL(check_ball(ctx, 17.0));
    ASSERT_OK(springls_remesh(ctx));
    CHECK_CALL(check_ball(ctx, 17.0));
    ASSERT_OK(springls_settle(ctx, 20));
    CHECK_CALL(check_ball(ctx, 17.0));
    springls_destroy(ctx);
    PASS();
}

/* A wind of the world takes the ball along, and its material points, up to a unit off the surface: 95 of 100 are found as near as is
   estimated. */
TEST motion_is_the_worlds(int grid)
{
    enum { COUNT = 60 };
    const float shift[3] = { 2.0f, -1.0f, 1.5f };
    float wind[3] = { 2.0f, -1.0f, 1.5f }, points[3 * COUNT];
    springls_material_place places[COUNT];
    springls_params params = level_set_params();
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    const springls_component *components;
    springls_context *ctx;
    double off = 0.0;
    int i, k, count, good = 0;
    params.components = 1;
    ctx = ball_on(grid, &params, 16.0f);
    ASSERT(ctx);
    fixture_seed(3);
    for (i = 0; i < COUNT; i++) {
        const springls__v3 n = fixture_direction();
        const float r = (float)(15 + i % 3);
        points[3 * i] = CENTER + r * n.x;
        points[3 * i + 1] = CENTER + r * n.y;
        points[3 * i + 2] = CENTER + r * n.z;
    }
    ASSERT_OK(springls_run(ctx, &step, 10));
    ASSERT_OK(springls_components(ctx, &components, &count));
    for (k = 0; k < 3; k++) ASSERT_IN_RANGE((double)(CENTER + shift[k]), (double)components[0].center[k], 0.03);
    ASSERT_OK(springls_place_now(ctx, points, COUNT, places));
    for (i = 0; i < COUNT; i++) {
        const d3 now = d3_of(springls__v3_make(points[3 * i] + shift[0], points[3 * i + 1] + shift[1], points[3 * i + 2] + shift[2]));
        ASSERT_GTE(places[i].springl, 0);
        off += d3_distance(now, d3_of(springls__load3(places[i].place))) / COUNT;
        good += d3_distance(now, d3_of(springls__load3(places[i].place))) <= (double)places[i].error + 1e-4;
    }
    ASSERT_GTE(good, COUNT * 95 / 100);
    ASSERT_IN_RANGE(0.0, off, 0.08);
    springls_destroy(ctx);
    PASS();
}

/* ---- tilings ---- */

/* A body shrinks by tension to sqrt(R^2 - 4 t), round; its closest wall, its labels and its volume are those. */
TEST tilings_are_the_worlds(int grid)
{
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_sphere ball = { { CENTER, CENTER, CENTER }, 16.0f };
    springls_context *empty = context_on(grid, NULL);
    springls_tiling *tiling;
    springls_tiling_measures measures;
    springls_wall_hit hit[200];
    float points[600];
    int32_t labels[200];
    int i;
    ASSERT(empty);
    ASSERT_OK(springls_tiling_create(&empty->desc, &tiling));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, springls_implicit_sphere, &ball));
    step.tension = 1.0f;
    step.dt = 0.25f;
    for (i = 0; i < 60; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_OK(springls_tiling_measure(tiling, &measures));
    ASSERT_IN_RANGE(4.0 / 3.0 * 3.14159265 * pow(196.0, 1.5), measures.volume, 0.02 * measures.volume);
    fixture_seed(5);
    for (i = 0; i < 200; i++) {
        const springls__v3 n = fixture_direction();
        const float r = i % 2 ? 12.0f : 16.0f;
        points[3 * i] = CENTER + r * n.x;
        points[3 * i + 1] = CENTER + r * n.y;
        points[3 * i + 2] = CENTER + r * n.z;
    }
    ASSERT_OK(springls_tiling_sample_labels(tiling, points, 200, labels));
    ASSERT_OK(springls_tiling_closest_wall(tiling, points, 200, hit));
    for (i = 0; i < 200; i++) {
        ASSERT_EQ(i % 2, labels[i]);
        ASSERT_IN_RANGE(2.0, (double)hit[i].distance, 0.3);
    }
    springls_tiling_destroy(tiling);
    springls_destroy(empty);
    PASS();
}

SUITE(metric)
{
    int grid;
    for (grid = first_grid(); grid < GRIDS; grid++) {
        RUN_TESTp(curvature_is_the_worlds, grid, false);
        RUN_TESTp(curvature_is_the_worlds, grid, true);
        RUN_TESTp(lambda_is_the_worlds, grid);
        RUN_TESTp(evolve_is_the_worlds, grid);
        RUN_TESTp(smooth_is_the_worlds, grid, false);
        RUN_TESTp(smooth_is_the_worlds, grid, true);
        RUN_TESTp(offset_is_the_worlds, grid, -4.0f);
        RUN_TESTp(offset_is_the_worlds, grid, 3.0f);
        RUN_TESTp(volume_lock_is_the_worlds, grid);
        RUN_TESTp(queries_are_the_worlds, grid);
        RUN_TESTp(distances_end_evenly, grid);
        RUN_TESTp(measures_are_the_worlds, grid);
        RUN_TESTp(error_estimates_are_the_worlds, grid);
        RUN_TESTp(inputs_are_the_worlds, grid);
        RUN_TESTp(combinations_are_the_worlds, grid);
        RUN_TESTp(followed_and_remeshed_are_the_worlds, grid);
        RUN_TESTp(motion_is_the_worlds, grid);
        RUN_TESTp(tilings_are_the_worlds, grid);
    }
    RUN_TEST(error_estimates_scale);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(metric);
    GREATEST_MAIN_END();
}
