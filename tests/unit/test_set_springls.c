/* test_set_springls.c - springls with an original surface of their own: springls_set_springls and springls_set_reference_mesh. */
#include "fixtures.h"

/* A ball's mesh, in the world, and springls made of its triangles: smaller and elsewhere, with correspondences on the mesh. */
typedef struct moved_ball {
    springls_mesh mesh;
    float *vertices, *origins;
    d3 center, moved;
    int count;
} moved_ball;

static const double radius = 6.0; /* voxels */

static moved_ball moved_ball_make(springls_context *ctx)
{
    moved_ball b;
    springls_sphere ball;
    int i, k;
    float world[3] = { 10.0f, 11.5f, 11.5f }, edge[3] = { 11.0f, 11.5f, 11.5f };
    memset(&b, 0, sizeof b);
    b.center = d3_make(10.0, 11.5, 11.5);
    b.moved = d3_make(19.0, 14.0, 15.0);
    springls_to_world(ctx, world, 1, world);
    springls_to_world(ctx, edge, 1, edge);
    ball = fixture_ball(world[0], world[1], world[2], 0.0f);
    ball.radius = (float)radius * springls__length(springls__v3_make(edge[0] - world[0], edge[1] - world[1], edge[2] - world[2]));
    springls_set_implicit(ctx, springls_implicit_sphere, &ball);
    springls_extract_mesh(ctx, &b.mesh);
    b.count = b.mesh.triangle_count;
    b.vertices = (float *)malloc((size_t)b.count * 9 * sizeof(float));
    b.origins = (float *)malloc((size_t)b.count * 3 * sizeof(float));
    for (i = 0; i < b.count; i++) {
        d3 sum = d3_make(0.0, 0.0, 0.0);
        for (k = 0; k < 3; k++) {
            springls__v3 q;
            d3 x;
            springls_to_voxel(ctx, b.mesh.positions + 3 * b.mesh.triangles[3 * i + k], 1, &q.x);
            sum = d3_mad(sum, d3_of(q), 1.0 / 3.0);
            x = d3_add(b.moved, d3_scale(d3_sub(d3_of(q), b.center), 0.8));
            q = d3_float(x);
            memcpy(b.vertices + 9 * i + 3 * k, &q, sizeof q);
        }
        {
            springls__v3 a = d3_float(sum);
            memcpy(b.origins + 3 * i, &a, sizeof a);
        }
    }
    return b;
}

static springls_status moved_ball_set(springls_context *ctx, const moved_ball *b)
{
    SPRINGLS__TRY(springls_set_springls(ctx, b->vertices, NULL, b->origins, b->count));
    return springls_set_reference_mesh(ctx, b->mesh.positions, b->mesh.vertex_count, 0, b->mesh.triangles,
                                       b->mesh.triangle_count, NULL);
}

static void moved_ball_free(springls_context *ctx, moved_ball *b)
{
    springls_mesh_free(ctx, &b->mesh);
    free(b->vertices);
    free(b->origins);
}

/* How far correspondences are from the original ball at most, voxels. */
static double furthest_origin(const springls_context *ctx, d3 center)
{
    double worst = 0.0;
    int i;
    for (i = 0; i < springls_count(ctx); i++)
        worst = fmax(worst, fabs(d3_distance(d3_of(fixture_origin(ctx, i)), center) - radius));
    return worst;
}

static springls_context *scaled_context(const springls_params *params, double spacing)
{
    springls_desc desc = fixture_desc(32, params);
    springls_context *ctx = NULL;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        desc.grid.spacing[axis] = spacing;
        desc.grid.origin[axis] = 3.0 * axis - 2.0;
    }
    springls_create(&desc, &ctx);
    return ctx;
}

/* Correspondences keep their bits, materials number the mesh's triangles, and tracking leaves them where they are. */
TEST correspondences_lie_on_the_mesh(int half_spacing)
{
    springls_context *ctx = scaled_context(NULL, half_spacing ? 0.5 : 1.0);
    moved_ball b = moved_ball_make(ctx);
    springls_material *materials = (springls_material *)malloc((size_t)b.count * sizeof *materials);
    uint64_t before;
    int i, k, away = 0;
    ASSERT_OK(springls_set_springls(ctx, b.vertices, NULL, b.origins, b.count));
    before = springls_state_hash(ctx);
    ASSERT_OK(springls_set_reference_mesh(ctx, b.mesh.positions, b.mesh.vertex_count, 0, b.mesh.triangles,
                                          b.mesh.triangle_count, NULL));
    ASSERT(before == springls_state_hash(ctx));
    ASSERT_EQ(b.count, springls_material_triangle_count(ctx));
    ASSERT_OK(springls_springl_materials(ctx, materials));
    for (i = 0; i < b.count; i++) {
        springls__v3 a = fixture_origin(ctx, i);
        ASSERT_MEM_EQ(b.origins + 3 * i, &a, sizeof a);
        ASSERT_EQ(i, materials[i].triangle);
        for (k = 0; k < 3; k++) away += fabs((double)materials[i].barycentric[k] - 1.0 / 3.0) > 0.01;
    }
    ASSERT_LT(away, b.count / 20); /* triangles that are mere slivers */
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
    ASSERT_LT(furthest_origin(ctx, b.center), 0.06);
    free(materials);
    moved_ball_free(ctx, &b);
    springls_destroy(ctx);
    PASS();
}

/* New springls find their correspondences on the mesh too. */
TEST new_springls_find_it(void)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    moved_ball b;
    float wind[3] = { -0.4f, 0.1f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    int i;
    p.split_edge = 0.9f;
    p.cover = 0; /* its triangles are never so large that they are split */
    p.resample_period = 2;
    p.lazy_distance = 0.0f;
    ctx = scaled_context(&p, 1.0);
    b = moved_ball_make(ctx);
    ASSERT_OK(moved_ball_set(ctx, &b));
    for (i = 0; i < 8; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_GT(springls_get_stats(ctx).split + springls_get_stats(ctx).added, 200);
    ASSERT_LT(furthest_origin(ctx, b.center), 0.15);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
    ASSERT_LT(furthest_origin(ctx, b.center), 0.06);
    moved_ball_free(ctx, &b);
    springls_destroy(ctx);
    PASS();
}

/* Triangles keep the numbers that they have in the caller's mesh where others are dropped, and for a mesh that is inside out. */
TEST triangles_keep_their_numbers(void)
{
    springls_context *ctx = scaled_context(NULL, 1.0);
    moved_ball b = moved_ball_make(ctx);
    springls_material *materials = (springls_material *)malloc((size_t)b.count * sizeof *materials);
    int *triangles = (int *)malloc((size_t)(b.count + 2) * 3 * sizeof *triangles), i;
    springls_mesh_report report;
    ASSERT_OK(springls_set_springls(ctx, b.vertices, NULL, b.origins, b.count));
    memset(triangles, 0, 6 * sizeof *triangles); /* two without an area */
    for (i = 0; i < b.count; i++) {
        triangles[3 * i + 6] = b.mesh.triangles[3 * i];
        triangles[3 * i + 7] = b.mesh.triangles[3 * i + 2];
        triangles[3 * i + 8] = b.mesh.triangles[3 * i + 1];
    }
    ASSERT_OK(springls_set_reference_mesh(ctx, b.mesh.positions, b.mesh.vertex_count, 0, triangles, b.count + 2, &report));
    ASSERT_EQ(2, report.triangles_dropped);
    ASSERT(report.flipped && report.closed);
    ASSERT_EQ(b.count + 2, springls_material_triangle_count(ctx));
    ASSERT_OK(springls_springl_materials(ctx, materials));
    for (i = 0; i < b.count; i++) ASSERT_EQ(i + 2, materials[i].triangle);
    free(materials);
    free(triangles);
    moved_ball_free(ctx, &b);
    springls_destroy(ctx);
    PASS();
}

TEST wrong_meshes_change_nothing(void)
{
    springls_context *ctx = scaled_context(NULL, 1.0), *empty = scaled_context(NULL, 1.0);
    moved_ball b = moved_ball_make(ctx);
    const int far_index[3] = { 0, 1, 9999999 };
    float outside[9] = { 900.0f, 0.0f, 0.0f, 901.0f, 0.0f, 0.0f, 900.0f, 1.0f, 0.0f };
    const int one[3] = { 0, 1, 2 };
    size_t held;
    uint64_t before;
    ASSERT_OK(moved_ball_set(ctx, &b));
    before = springls_state_hash(ctx);
    held = springls_memory_used(ctx);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_reference_mesh(NULL, outside, 3, 0, one, 1, NULL));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_set_reference_mesh(empty, b.mesh.positions, b.mesh.vertex_count, 0,
                                                                    b.mesh.triangles, b.count, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_reference_mesh(ctx, NULL, 3, 0, one, 1, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_reference_mesh(ctx, outside, 3, 7, one, 1, NULL));
    ASSERT_STATUS(SPRINGLS_BAD_MESH, springls_set_reference_mesh(ctx, b.mesh.positions, b.mesh.vertex_count, 0, far_index, 1,
                                                                 NULL));
    ASSERT_STATUS(SPRINGLS_BAD_MESH, springls_set_reference_mesh(ctx, outside, 3, 0, one, 1, NULL));
    ASSERT(strstr(springls_last_error(ctx), "set_reference_mesh") != NULL);
    outside[4] = (float)NAN;
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_set_reference_mesh(ctx, outside, 3, 0, one, 1, NULL));
    ASSERT(before == springls_state_hash(ctx));
    ASSERT_EQ(held, springls_memory_used(ctx));
    ASSERT_EQ(b.count, springls_material_triangle_count(ctx));
    moved_ball_free(ctx, &b);
    springls_destroy(empty);
    springls_destroy(ctx);
    PASS();
}

/* A snapshot of all holds the mesh; one of a frame belongs to the original surface of its time. */
TEST snapshots_hold_the_mesh(void)
{
    springls_context *ctx = scaled_context(NULL, 1.0), *other = scaled_context(NULL, 1.0);
    moved_ball b = moved_ball_make(ctx);
    void *frame, *all;
    size_t frame_size, all_size;
    ASSERT_OK(springls_set_springls(ctx, b.vertices, NULL, b.origins, b.count));
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_FRAME, NULL, 0, &frame_size));
    frame = malloc(frame_size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_FRAME, frame, frame_size, &frame_size));
    ASSERT_OK(moved_ball_set(ctx, &b));
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_restore(ctx, frame, frame_size));
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &all_size));
    all = malloc(all_size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, all, all_size, &all_size));
    ASSERT_OK(springls_restore(other, all, all_size));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
    ASSERT_OK(springls_run_stage(other, SPRINGLS_STAGE_TRACK));
    ASSERT(springls_state_hash(ctx) == springls_state_hash(other));
    ASSERT_LT(furthest_origin(other, b.center), 0.06);
    free(frame);
    free(all);
    moved_ball_free(ctx, &b);
    springls_destroy(other);
    springls_destroy(ctx);
    PASS();
}

SUITE(set_springls)
{
    RUN_TESTp(correspondences_lie_on_the_mesh, 0);
    RUN_TESTp(correspondences_lie_on_the_mesh, 1);
    RUN_TEST(new_springls_find_it);
    RUN_TEST(triangles_keep_their_numbers);
    RUN_TEST(wrong_meshes_change_nothing);
    RUN_TEST(snapshots_hold_the_mesh);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(set_springls);
    GREATEST_MAIN_END();
}
