/* test_metric_reads.c - what is read from a model, given to it by hand or kept of it is that of the world, whatever the spacing and the
   direction of the grid. */
#include "metric_grids.h"

/* Returns how far outside the ball of `radius` a place of the world is. */
static double outside(const float *x, double radius)
{
    return d3_distance(d3_of(springls__load3(x)), d3_make((double)CENTER, (double)CENTER, (double)CENTER)) - radius;
}

/* Returns the root of the mean square of that over `count` places, `stride` floats from one to the next. */
static double rms_outside(const float *x, int stride, int count, double radius)
{
    double sum = 0.0;
    int i;
    for (i = 0; i < count; i++) sum += outside(x + stride * i, radius) * outside(x + stride * i, radius);
    return sqrt(sum / (count ? count : 1));
}

/* Returns the distance of two places. */
static double apart(const float *a, const float *b) { return d3_distance(d3_of(springls__load3(a)), d3_of(springls__load3(b))); }

/* Returns the rows of a view in the world, to be freed. */
static float *worlds_of(springls_context *ctx, springls_view view)
{
    float *out = (float *)malloc(((size_t)view.count + 1) * 3 * sizeof *out);
    int i;
    for (i = 0; i < view.count; i++) {
        const springls__v3 x = world_of(ctx, view, i);
        memcpy(out + 3 * i, &x, 3 * sizeof *out);
    }
    return out;
}

/* Takes the ball 2, -1, 1.5 along, in ten steps. */
static springls_status blow(springls_context *ctx)
{
    float wind[3] = { 2.0f, -1.0f, 1.5f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    return springls_run(ctx, &step, 10);
}

/* ---- springls, meshes, chunks ---- */

/* Surfels are on the ball and face outwards; each reaches to the furthest corner of its springl. */
TEST surfels_are_the_worlds(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    float *surfels, *particles;
    int i, k, m;
    ASSERT(ctx);
    surfels = (float *)malloc((size_t)springls_count(ctx) * 7 * sizeof *surfels);
    particles = worlds_of(ctx, springls_view_particles(ctx));
    ASSERT_OK(springls_extract_surfels(ctx, surfels));
    ASSERT_IN_RANGE(0.0, rms_outside(surfels, 7, springls_count(ctx), 16.0), 0.05);
    for (i = 0; i < springls_count(ctx); i++) {
        const float *s = surfels + 7 * i;
        double along = 0.0, reach = 0.0;
        ASSERT_IN_RANGE(0.0, apart(s, particles + 3 * i), 1e-5);
        for (k = 0; k < 3; k++) along += (double)((s[k] - CENTER) * s[3 + k]) / 16.0;
        for (m = 0; m < 3; m++) {
            const springls__v3 q = fixture_at(springls_view_vertices(ctx), i, m);
            float corner[3];
            springls_to_world(ctx, &q.x, 1, corner);
            reach = fmax(reach, apart(s, corner));
        }
        ASSERT_IN_RANGE(1.0, along, 0.02);
        ASSERT_IN_RANGE(reach, (double)s[6], 1e-3);
    }
    free(surfels);
    free(particles);
    springls_destroy(ctx);
    PASS();
}

/* What is in voxels is so on every grid: rows of eq. 27 hold particles and correspondences as views do, phi has the sign of the place. */
TEST voxels_stay_voxels(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    float *rows, *phi, *depth;
    int i;
    ASSERT(ctx);
    rows = (float *)malloc((size_t)springls_count(ctx) * 16 * sizeof *rows);
    ASSERT_OK(springls_pack_matrix(ctx, rows));
    for (i = 0; i < springls_count(ctx); i++) {
        const springls__v3 p = fixture_particle(ctx, i), q = fixture_vertex(ctx, i, 0), a = fixture_origin(ctx, i);
        ASSERT_MEM_EQ(rows + 16 * i, &p, 3 * sizeof(float));
        ASSERT_MEM_EQ(rows + 16 * i + 4, &q, 3 * sizeof(float));
        ASSERT(rows[16 * i + 7] == a.x && rows[16 * i + 11] == a.y && rows[16 * i + 15] == a.z);
        ASSERT_IN_RANGE(0.0, (double)rows[16 * i + 3], 0.1);
    }
    depth = depths_on(ctx);
    phi = (float *)malloc(sizeof *phi * 48 * 48 * 48);
    ASSERT_OK(springls_copy_level_set(ctx, phi));
    for (i = 0; i < 48 * 48 * 48; i++) ASSERT(fabsf(depth[i]) < 0.1f || (phi[i] < 0.0f) == (depth[i] > 0.0f));
    free(rows);
    free(phi);
    free(depth);
    springls_destroy(ctx);
    PASS();
}

/* Chunks are the mesh of the ball, in one update or in pieces; no vertex is further from a coarser level than that says. */
TEST chunks_are_the_worlds(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    springls_chunks_desc desc = { .tolerance = -1.0f, .correspondences = true };
    springls_chunks *whole, *pieces;
    const springls_chunk *list, *parts = NULL;
    int count, part_count = 0, i, k, v, t, fine = 0, coarse = 0;
    bool done = false;
    ASSERT(ctx);
    ASSERT_OK(springls_chunks_create(ctx, &desc, &whole));
    ASSERT_OK(springls_chunks_create(ctx, &desc, &pieces));
    ASSERT_OK(springls_chunks_begin(ctx, pieces));
    while (!done) ASSERT_OK(springls_chunks_continue(ctx, pieces, 0.0, &parts, &part_count, &done));
    ASSERT_OK(springls_chunks_update(ctx, whole, &list, &count));
    ASSERT_EQ(count, part_count);
    for (i = 0; i < count; i++) {
        const springls_chunk *chunk = &list[i];
        springls_lod lod;
        memset(&lod, 0, sizeof lod);
        ASSERT_EQ(chunk->vertex_count, parts[i].vertex_count);
        if (!chunk->vertex_count) continue;
        ASSERT_MEM_EQ(chunk->positions, parts[i].positions, (size_t)chunk->vertex_count * 3 * sizeof(float));
        ASSERT_IN_RANGE(0.0, rms_outside(chunk->positions, 3, chunk->vertex_count, 16.0), 0.1);
        for (v = 0; v < chunk->vertex_count; v++) {
            const float *x = chunk->positions + 3 * v, *n = chunk->normals + 3 * v;
            double along = 0.0;
            for (k = 0; k < 3; k++) along += (double)((x[k] - CENTER) * n[k]) / 16.0;
            ASSERT_IN_RANGE(1.0, along, 0.03);
            ASSERT_IN_RANGE(0.0, apart(x, chunk->correspondences + 3 * v), 0.15);
        }
        lod.chunk = chunk;
        lod.level = 2;
        lod.triangles = (uint16_t *)malloc((size_t)chunk->triangle_count * 3 * sizeof *lod.triangles);
        for (k = 0; k < 6; k++) lod.neighbors[k] = 2;
        ASSERT_OK(springls_chunks_lod(ctx, &lod, 1));
        ASSERT_IN_RANGE(0.25, (double)lod.error, 0.25 + 1e-5);
        fine += chunk->triangle_count;
        coarse += lod.triangle_count;
        for (v = 0; v < chunk->vertex_count && lod.triangle_count; v++) {
            double nearest = DBL_MAX;
            for (t = 0; t < lod.triangle_count; t++) {
                d3 corner[3];
                for (k = 0; k < 3; k++) corner[k] = d3_of(springls__load3(chunk->positions + 3 * lod.triangles[3 * t + k]));
                nearest = fmin(nearest, d3_triangle_distance(corner, d3_of(springls__load3(chunk->positions + 3 * v))));
            }
            ASSERT_IN_RANGE(0.0, nearest, 0.5 + 1e-4); /* 2^2 / 8 smallest spacings */
        }
        free(lod.triangles);
    }
    ASSERT_LT(coarse, fine / 2);
    springls_chunks_destroy(ctx, whole);
    springls_chunks_destroy(ctx, pieces);
    springls_destroy(ctx);
    PASS();
}

/* ---- points ---- */

/* Which side points are on, and in which body. */
TEST sides_are_the_worlds(int grid, springls_contouring contouring)
{
    enum { COUNT = 400 };
    springls_params params = level_set_params();
    const springls_component *components;
    springls_context *ctx;
    float points[3 * COUNT];
    uint8_t inside[COUNT];
    uint32_t body[COUNT];
    int i, count;
    params.components = 1;
    params.contouring = contouring;
    ctx = ball_on(grid, &params, 16.0f);
    ASSERT(ctx);
    fixture_seed(11);
    for (i = 0; i < COUNT; i++) {
        const springls__v3 n = fixture_direction();
        const float r = i % 2 ? 15.7f : 16.3f;
        points[3 * i] = CENTER + r * n.x;
        points[3 * i + 1] = CENTER + r * n.y;
        points[3 * i + 2] = CENTER + r * n.z;
    }
    ASSERT_OK(springls_sample_inside(ctx, points, COUNT, inside));
    ASSERT_OK(springls_components(ctx, &components, &count));
    ASSERT_EQ(1, count);
    ASSERT_OK(springls_component_of(ctx, points, COUNT, body));
    for (i = 0; i < COUNT; i++) {
        ASSERT_EQ(i % 2, inside[i]);
        ASSERT_EQ(components[0].id, body[i]);
    }
    for (i = 0; i < springls_count(ctx); i++) ASSERT_EQ(components[0].id, springls_component_ids(ctx)[i]);
    springls_destroy(ctx);
    PASS();
}

/* A ball that is cut away has died at its centre. */
TEST events_are_the_worlds(int grid)
{
    fixture_balls two = { { { { CENTER - 7.0f, CENTER, CENTER }, 8.0f }, { { CENTER + 10.0f, CENTER, CENTER }, 5.0f } } };
    springls_sphere tool = { { CENTER + 10.0f, CENTER, CENTER }, 7.0f };
    springls_params params = level_set_params();
    springls_step_desc still = fixture_step(NULL, SPRINGLS_MODE_FLUID, 0.0f);
    springls_context *ctx;
    const springls_event *events;
    int count, k;
    params.components = 1;
    ctx = context_on(grid, &params);
    ASSERT(ctx);
    ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &two));
    ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &tool));
    ASSERT_OK(springls_step(ctx, &still));
    ASSERT_OK(springls_events(ctx, &events, &count));
    ASSERT_EQ(1, count);
    ASSERT_EQ(SPRINGLS_EVENT_KIND_DEATH, events[0].kind);
    for (k = 0; k < 3; k++) ASSERT_IN_RANGE((double)tool.center[k], (double)events[0].place[k], 0.05);
    ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * 125.0, events[0].before[0].volume, 42.0); /* two or three voxels across */
    springls_destroy(ctx);
    PASS();
}

/* ---- original surface ---- */

/* The estimates of vertices of meshes: 95 of 100 are nearer to where the flow takes their correspondence. */
TEST mesh_errors_are_the_worlds(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    springls_forces forces = fixture_forces(swirl, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    springls_error_estimate *errors;
    springls_mesh mesh;
    int i, good = 0;
    ASSERT(ctx);
    step.max_displacement = 2.0f;
    ASSERT_OK(springls_run(ctx, &step, 20));
    ASSERT_OK(springls_extract_soup(ctx, &mesh));
    errors = (springls_error_estimate *)malloc((size_t)mesh.vertex_count * sizeof *errors);
    ASSERT_OK(springls_mesh_errors(ctx, &mesh, errors));
    for (i = 0; i < mesh.vertex_count; i++) {
        const springls__v3 a = springls__load3(mesh.correspondences + 3 * i);
        const d3 middle = d3_make((double)CENTER, (double)CENTER, (double)a.z);
        const d3 turn = d3_make(0.0, 0.0, ((double)a.z - (double)CENTER) * 0.01 * 2.0);
        const d3 now = d3_add(middle, d3_rotate(d3_sub(d3_of(a), middle), turn));
        good += d3_distance(now, d3_of(springls__load3(mesh.positions + 3 * i))) <= (double)errors[i].place + 1e-4;
    }
    ASSERT_GTE(good, (mesh.vertex_count * 95 + 99) / 100);
    free(errors);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* Fails unless places on the triangles of `original` are the correspondences, `count` places of the world. */
static enum greatest_test_res check_places(const springls_mesh *original, const springls_material *places, const float *correspondences,
                                           int count, double tolerance)
{
    float *at = (float *)malloc(((size_t)count + 1) * 3 * sizeof *at);
    double sum = 0.0;
    int i;
    ASSERT_OK(springls_interpolate_material(places, count, original->positions, 3, original->triangles, original->triangle_count, at));
    for (i = 0; i < count; i++) sum += apart(at + 3 * i, correspondences + 3 * i);
    ASSERT_IN_RANGE(0.0, sum / count, tolerance);
    free(at);
    PASS();
}

/* Material coordinates of springls, of a mesh's vertices and of its corners are their correspondences on the mesh that was set. Moved
   2, -1, 1.5 they are what they were: each place less the way. */
TEST materials_are_the_worlds(int grid, bool reference_mesh)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f), *cubes = ball_on(CUBES, NULL, 16.0f);
    springls_mesh original, mesh;
    springls_material *places;
    float *correspondences, *corners;
    int *neighbors, i, k;
    ASSERT(ctx && cubes);
    ASSERT_OK(springls_extract_mesh(cubes, &original));
    if (reference_mesh) {
        ASSERT_OK(springls_set_reference_mesh(ctx, original.positions, original.vertex_count, 0, original.triangles,
                                              original.triangle_count, NULL));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
    } else
        ASSERT_OK(springls_set_mesh(ctx, original.positions, original.vertex_count, 0, original.triangles, original.triangle_count, NULL));
    ASSERT_EQ(original.triangle_count, springls_material_triangle_count(ctx));
    neighbors = (int *)malloc((size_t)original.triangle_count * 3 * sizeof *neighbors);
    ASSERT_OK(springls_find_seams(ctx, original.positions, original.vertex_count, 0, original.triangles, original.triangle_count, NULL, 0,
                                  neighbors));
    for (i = 0; i < 3 * original.triangle_count; i++) ASSERT_GTE(neighbors[i], 0);
    ASSERT_OK(blow(ctx));
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    places = (springls_material *)malloc(sizeof *places * (size_t)(springls_count(ctx) + 3 * mesh.triangle_count));
    ASSERT_OK(springls_springl_materials(ctx, places));
    correspondences = worlds_of(ctx, springls_view_correspondences(ctx));
    CHECK_CALL(check_places(&original, places, correspondences, springls_count(ctx), 0.02));
    ASSERT_OK(springls_mesh_materials(ctx, &mesh, places));
    CHECK_CALL(check_places(&original, places, mesh.correspondences, mesh.vertex_count, 0.02));
    corners = (float *)malloc((size_t)mesh.triangle_count * 9 * sizeof *corners);
    for (i = 0; i < 3 * mesh.triangle_count; i++)
        memcpy(corners + 3 * i, mesh.correspondences + 3 * mesh.triangles[i], 3 * sizeof *corners);
    ASSERT_OK(springls_corner_materials(ctx, &mesh, neighbors, places));
    CHECK_CALL(check_places(&original, places, corners, 3 * mesh.triangle_count, 0.02));
    for (i = 0; i < mesh.triangle_count; i++)
        for (k = 0; k < 3; k++) {
            static const float way[3] = { 2.0f, -1.0f, 1.5f };
            const float *x = mesh.positions + 3 * mesh.triangles[3 * i];
            ASSERT_IN_RANGE((double)(x[k] - way[k]), (double)corners[9 * i + k], 0.25);
        }
    free(neighbors);
    free(places);
    free(correspondences);
    free(corners);
    springls_mesh_free(ctx, &mesh);
    springls_mesh_free(cubes, &original);
    springls_destroy(ctx);
    springls_destroy(cubes);
    PASS();
}

/* A model that takes itself as the original surface has correspondences where its particles are. */
TEST references_are_the_worlds(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    springls_hit hit;
    float far_away[3] = { CENTER + 30.0f, CENTER + 10.0f, CENTER - 20.0f };
    int i;
    ASSERT(ctx);
    ASSERT_OK(springls_smooth(ctx, 10.0f, false));
    ASSERT_OK(springls_set_reference(ctx));
    for (i = 0; i < springls_count(ctx); i++) {
        const springls__v3 p = fixture_particle(ctx, i), a = fixture_origin(ctx, i);
        ASSERT_MEM_EQ(&p, &a, sizeof p);
    }
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
    ASSERT_OK(blow(ctx));
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_SOUP, far_away, 1, &hit));
    ASSERT_IN_RANGE((double)hit.point[0] - 2.0, (double)hit.material[0], 0.1);
    ASSERT_IN_RANGE((double)hit.point[1] + 1.0, (double)hit.material[1], 0.1);
    ASSERT_IN_RANGE((double)hit.point[2] - 1.5, (double)hit.material[2], 0.1);
    springls_destroy(ctx);
    PASS();
}

/* An attribute that is a place of the world stays that of the correspondence where springls are split and filled, and at the vertices of
   meshes and chunks. */
TEST attributes_are_the_worlds(int grid)
{
    static const springls_attribute_desc desc = { "place", 3, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND };
    springls_context *ctx = ball_on(grid, NULL, 12.0f);
    springls_chunks_desc consumer = { .tolerance = -1.0f, .correspondences = true };
    springls_chunks *chunks;
    const springls_chunk *list;
    springls_mesh mesh;
    float *places, *at;
    springls_provenance *births;
    double off = 0.0;
    int i, v, index, count, born = 0;
    ASSERT(ctx);
    places = worlds_of(ctx, springls_view_correspondences(ctx));
    ASSERT_OK(springls_add_attribute(ctx, &desc, NULL, &index));
    ASSERT_OK(springls_set_attribute(ctx, index, places));
    free(places);
    ASSERT_OK(springls_offset(ctx, 4.0f));
    births = (springls_provenance *)malloc((size_t)springls_count(ctx) * sizeof *births);
    ASSERT_OK(springls_get_provenance(ctx, births));
    for (i = 0; i < springls_count(ctx); i++) born += births[i].kind != SPRINGLS_KIND_ORIGINAL;
    ASSERT_GT(born, 0);
    free(births);
    places = worlds_of(ctx, springls_view_correspondences(ctx));
    for (i = 0; i < springls_count(ctx); i++) {
        float value[3];
        const springls__v3 row = fixture_at(springls_view_attribute(ctx, index), i, 0);
        memcpy(value, &row, sizeof value);
        off += apart(value, places + 3 * i) / springls_count(ctx);
    }
    ASSERT_IN_RANGE(0.0, off, 0.12);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    at = (float *)malloc((size_t)mesh.vertex_count * 3 * sizeof *at);
    ASSERT_OK(springls_mesh_attribute(ctx, &mesh, index, at));
    for (off = 0.0, v = 0; v < mesh.vertex_count; v++) off += apart(at + 3 * v, mesh.correspondences + 3 * v) / mesh.vertex_count;
    ASSERT_IN_RANGE(0.0, off, 0.12);
    ASSERT_OK(springls_chunks_create(ctx, &consumer, &chunks));
    ASSERT_OK(springls_chunks_update(ctx, chunks, &list, &count));
    for (i = 0; i < count; i++) {
        ASSERT_LTE(list[i].vertex_count, mesh.vertex_count);
        ASSERT_OK(springls_chunk_attribute(ctx, &list[i], index, at));
        for (off = 0.0, v = 0; v < list[i].vertex_count; v++) off += apart(at + 3 * v, list[i].correspondences + 3 * v);
        ASSERT_IN_RANGE(0.0, off, 0.4 * list[i].vertex_count);
    }
    springls_chunks_destroy(ctx, chunks);
    springls_mesh_free(ctx, &mesh);
    free(places);
    free(at);
    springls_destroy(ctx);
    PASS();
}

/* ---- motion ---- */

static void blow_out(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    (void)points, (void)normals, (void)time;
    while (count-- > 0) *out++ = *(const float *)user;
}

/* Turns about the world's (1, 1, 1) through the centre, and moves on by (1, 0, 0). */
static void turn_about(void *user, const float *points, const float *correspondences, int count, float time, float *out)
{
    static const float spin[9] = { 0, -0.2f, 0.2f, 0.2f, 0, -0.2f, -0.2f, 0.2f, 0 };
    (void)user, (void)points, (void)correspondences, (void)time;
    for (; count-- > 0; out += 12) {
        int i;
        for (i = 0; i < 3; i++) {
            memcpy(out + 4 * i, spin + 3 * i, 3 * sizeof *out);
            out[4 * i + 3] = -(spin[3 * i] + spin[3 * i + 1] + spin[3 * i + 2]) * CENTER + (i == 0 ? 1.0f : 0.0f);
        }
    }
}

/* The same pressure by batches. */
static void blow_out_batch(void *user, const springls_batch *batch, float *out)
{
    blow_out(user, batch->points, batch->normals, batch->count, batch->time, out);
}

/* The ball grows by a pressure and turns by an affine map; particles stay at their height on the axis that turns nothing. A region of
   the world moves half of it. */
TEST forces_are_the_worlds(int grid)
{
    float growth = 0.5f, speed, wind[3] = { 2.0f, -1.0f, 1.5f };
    springls_forces forces[3];
    springls_step_desc step;
    int i, k;
    memset(forces, 0, sizeof forces);
    forces[0].pressure = blow_out;
    forces[1].pressure_batch = blow_out_batch;
    forces[2].affine = turn_about;
    for (i = 0; i < 3; i++) {
        springls_context *ctx = ball_on(grid, NULL, 15.0f);
        springls_measures measures;
        ASSERT(ctx);
        forces[i].user = &growth;
        step = fixture_step(&forces[i], SPRINGLS_MODE_FLUID, 0.2f);
        ASSERT_OK(springls_run(ctx, &step, 10));
        ASSERT_OK(springls_measure(ctx, &measures));
        if (i < 2) CHECK_CALL(check_ball(ctx, 16.0));
        ASSERT_IN_RANGE(i < 2 ? 4.0 / 3.0 * fixture_pi * 4096.0 : 4.0 / 3.0 * fixture_pi * 3375.0, measures.volume, 0.02 * measures.volume);
        if (i == 2) {
            float *p = worlds_of(ctx, springls_view_particles(ctx)), *a = worlds_of(ctx, springls_view_correspondences(ctx));
            const double turned = 2.0 * 0.2 * sqrt(3.0);
            for (k = 0; k < springls_count(ctx); k++) {
                const d3 axis = d3_make(turned / sqrt(3.0), turned / sqrt(3.0), turned / sqrt(3.0));
                const d3 middle = d3_make((double)CENTER, (double)CENTER, (double)CENTER);
                const d3 x = d3_sub(d3_of(springls__load3(p + 3 * k)), middle), y = d3_sub(d3_of(springls__load3(a + 3 * k)), middle);
                /* the way on by (1, 0, 0) turns with it: its part along the axis is 2 / 3 of (1, 1, 1) / 3 */
                ASSERT_IN_RANGE(d3_dot(y, axis) / turned + 2.0 / sqrt(3.0), d3_dot(x, axis) / turned, 0.25);
            }
            free(p);
            free(a);
        }
        springls_destroy(ctx);
    }
    {
        springls_context *ctx = ball_on(grid, NULL, 16.0f);
        springls_forces blown = fixture_forces(fixture_wind, wind);
        float *before, *after;
        ASSERT(ctx);
        for (k = 0; k < 3; k++) {
            blown.region_lower[k] = k == 0 ? CENTER : -1000.0f;
            blown.region_upper[k] = 1000.0f;
        }
        ASSERT_OK(springls_max_speed(ctx, &blown, 0.0f, &speed));
        ASSERT_IN_RANGE(sqrt(4.0 + 1.0 + 2.25), (double)speed, 1e-5);
        before = worlds_of(ctx, springls_view_particles(ctx));
        ASSERT_OK(springls_advect(ctx, &blown, 0.0f, 1.0f));
        after = worlds_of(ctx, springls_view_particles(ctx));
        for (i = 0; i < springls_count(ctx); i++)
            for (k = 0; k < 3; k++)
                ASSERT_IN_RANGE((double)(before[3 * i + k] + (before[3 * i] >= CENTER ? wind[k] : 0.0f)), (double)after[3 * i + k], 1e-4);
        free(before);
        free(after);
        springls_destroy(ctx);
    }
    PASS();
}

/* Springls that the caller has written are followed: the ball is where it was put, by a step in pieces. */
TEST written_springls_are_the_worlds(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    springls_step_desc still = fixture_step(NULL, SPRINGLS_MODE_FLUID, 0.0f);
    springls_measures measures;
    float *particles;
    int i;
    bool done = false;
    ASSERT(ctx);
    particles = worlds_of(ctx, springls_view_particles(ctx));
    for (i = 0; i < springls_count(ctx); i++) particles[3 * i + 2] += 1.0f;
    springls_to_voxel(ctx, particles, springls_count(ctx), particles);
    ASSERT_OK(springls_write(ctx, 0, springls_count(ctx), NULL, particles));
    ASSERT_OK(springls_step_begin(ctx, &still));
    while (!done) ASSERT_OK(springls_step_continue(ctx, 0.0, &done));
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * 4096.0, measures.volume, 0.015 * measures.volume);
    ASSERT_IN_RANGE((double)CENTER + 17.0, (double)measures.upper[2], 0.15);
    ASSERT_IN_RANGE((double)CENTER - 15.0, (double)measures.lower[2], 0.15);
    free(particles);
    springls_destroy(ctx);
    PASS();
}

/* A grid that follows a ball through the world finds it where the wind has taken it. */
TEST moving_grids_are_the_worlds(int grid)
{
    float wind[3] = { 8.0f, -6.0f, 10.0f };
    springls_sphere ball = { { CENTER, CENTER, CENTER }, 12.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.2f);
    springls_desc desc = desc_on(grid, NULL);
    springls_measures measures;
    springls_context *ctx;
    int offset[3], k;
    desc.follow = true;
    step.max_displacement = 2.0f;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    ASSERT_OK(springls_run(ctx, &step, 20));
    springls_window_offset(ctx, offset);
    ASSERT(offset[0] != 0 || offset[1] != 0 || offset[2] != 0);
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * 1728.0, measures.volume, 0.015 * measures.volume);
    for (k = 0; k < 3; k++) {
        ASSERT_IN_RANGE((double)(CENTER + 4.0f * wind[k]) - 12.0, (double)measures.lower[k], 0.3);
        ASSERT_IN_RANGE((double)(CENTER + 4.0f * wind[k]) + 12.0, (double)measures.upper[k], 0.3);
    }
    springls_destroy(ctx);
    PASS();
}

/* Each stage alone leaves the ball a ball: springls that cover it are relaxed, split and joined, and phi is made from them. */
TEST stages_are_the_worlds(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f);
    uint8_t *kept;
    int i;
    ASSERT(ctx);
    for (i = 0; i < 5; i++) {
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    }
    CHECK_CALL(check_ball(ctx, 16.0));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    CHECK_CALL(check_ball(ctx, 16.0));
    kept = (uint8_t *)malloc((size_t)springls_count(ctx));
    memset(kept, 1, (size_t)springls_count(ctx));
    ASSERT_OK(springls_set_keep_mask(ctx, kept));
    ASSERT_OK(springls_settle(ctx, 4));
    CHECK_CALL(check_ball(ctx, 16.0));
    free(kept);
    springls_destroy(ctx);
    PASS();
}

/* ---- shapes, combinations, copies ---- */

TEST shapes_are_the_worlds(int grid)
{
    springls_box box = { { CENTER, CENTER, CENTER }, { 12.0f, 10.0f, 9.0f } };
    springls_torus torus = { { CENTER, CENTER, CENTER }, { 0.36f, 0.48f, 0.8f }, 11.0f, 5.0f };
    springls_sphere parts[2] = { { { CENTER - 6.0f, CENTER, CENTER }, 9.0f }, { { CENTER + 6.0f, CENTER, CENTER }, 9.0f } };
    springls_metasphere metasphere;
    springls_notched_sphere notched = { { CENTER, CENTER, CENTER }, 14.0f, 9.0f, 20.0f };
    springls_implicit_fn fn[4] = { springls_implicit_box, springls_implicit_torus, springls_implicit_metasphere,
                                   springls_implicit_notched_sphere };
    void *shape[4];
    int i;
    metasphere.spheres = parts;
    metasphere.count = 2;
    shape[0] = &box;
    shape[1] = &torus;
    shape[2] = &metasphere;
    shape[3] = &notched;
    for (i = 0; i < 4; i++) {
        springls_context *ctx = context_on(grid, NULL), *cubes = context_on(CUBES, NULL);
        springls_measures here, there;
        int k;
        ASSERT(ctx && cubes);
        ASSERT_OK(springls_set_implicit(ctx, fn[i], shape[i]));
        ASSERT_OK(springls_set_implicit(cubes, fn[i], shape[i]));
        ASSERT_OK(springls_measure(ctx, &here));
        ASSERT_OK(springls_measure(cubes, &there));
        if (i == 1) ASSERT_IN_RANGE(2.0 * fixture_pi * fixture_pi * 11.0 * 25.0, here.volume, 0.03 * here.volume);
        ASSERT_IN_RANGE(there.volume, here.volume, 0.03 * there.volume);
        ASSERT_IN_RANGE(there.area, here.area, 0.05 * there.area);
        for (k = 0; k < 3; k++) ASSERT_IN_RANGE((double)there.lower[k], (double)here.lower[k], 0.6);
        springls_destroy(ctx);
        springls_destroy(cubes);
    }
    PASS();
}

/* A tool that is a model, a function or either in pieces: the same cut. */
TEST combinations_in_pieces_are_the_worlds(int grid)
{
    springls_sphere tool = { { CENTER + 14.0f, CENTER, CENTER }, 8.0f };
    uint64_t hash[4];
    int i;
    for (i = 0; i < 4; i++) {
        springls_context *ctx = ball_on(grid, NULL, 16.0f), *other = context_on(grid, NULL);
        springls_measures measures;
        bool done = i < 2;
        ASSERT(ctx && other);
        ASSERT_OK(springls_set_implicit(other, springls_implicit_sphere, &tool));
        if (i == 0) ASSERT_OK(springls_combine(ctx, SPRINGLS_OPERATION_DIFFERENCE, other));
        else if (i == 1) ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &tool));
        else if (i == 2) ASSERT_OK(springls_combine_begin(ctx, SPRINGLS_OPERATION_DIFFERENCE, other));
        else ASSERT_OK(springls_combine_implicit_begin(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &tool));
        while (!done) ASSERT_OK(springls_combine_continue(ctx, 0.0, &done));
        ASSERT_OK(springls_measure(ctx, &measures));
        ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * 4096.0 - fixture_pi * 100.0 * (196.0 + 28.0 * 24.0 - 192.0) / 168.0, measures.volume,
                        0.015 * measures.volume);
        hash[i] = springls_state_hash(ctx);
        ASSERT_EQ(hash[0], hash[i]);
        springls_destroy(ctx);
        springls_destroy(other);
    }
    PASS();
}

/* A snapshot, made again from a difference, is the ball on its own grid, and refused on another. */
TEST snapshots_are_the_worlds(int grid)
{
    springls_context *ctx = ball_on(grid, NULL, 16.0f), *twin = context_on(grid, NULL);
    springls_context *other = context_on((grid + 1) % GRIDS, NULL);
    char *bytes[2], *again, *delta;
    size_t size[2], delta_size, again_size;
    int i;
    ASSERT(ctx && twin && other);
    for (i = 0; i < 2; i++) {
        if (i == 1) ASSERT_OK(springls_offset(ctx, -2.0f));
        ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size[i]));
        bytes[i] = (char *)malloc(size[i]);
        ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, bytes[i], size[i], &size[i]));
    }
    delta = (char *)malloc(size[0] + 64);
    again = (char *)malloc(size[0]);
    ASSERT_OK(springls_snapshot_delta(ctx, bytes[1], size[1], bytes[0], size[0], delta, size[0] + 64, &delta_size));
    ASSERT_OK(springls_snapshot_patch(ctx, bytes[1], size[1], delta, delta_size, again, size[0], &again_size));
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_restore(other, again, again_size));
    ASSERT_OK(springls_restore(twin, again, again_size));
    CHECK_CALL(check_ball(twin, 16.0));
    ASSERT_OK(springls_restore(twin, bytes[1], size[1]));
    CHECK_CALL(check_ball(twin, 14.0));
    for (i = 0; i < 2; i++) free(bytes[i]);
    free(delta);
    free(again);
    springls_destroy(ctx);
    springls_destroy(twin);
    springls_destroy(other);
    PASS();
}

/* A tiling keeps its walls through a snapshot. */
static springls_status restore_into(springls_tiling **tiling, const springls_desc *desc)
{
    springls_tiling *twin;
    size_t size;
    char *bytes;
    springls_status status = springls_tiling_snapshot(*tiling, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size);
    if (status != SPRINGLS_OK) return status;
    bytes = (char *)malloc(size);
    status = springls_tiling_snapshot(*tiling, SPRINGLS_SNAPSHOT_KIND_ALL, bytes, size, &size);
    if (status == SPRINGLS_OK) status = springls_tiling_create(desc, &twin);
    if (status == SPRINGLS_OK) {
        status = springls_tiling_restore(twin, bytes, size);
        springls_tiling_destroy(*tiling);
        *tiling = twin;
    }
    free(bytes);
    return status;
}

/* Two halves of a ball, from labels: their outer walls are on the ball, the wall between them on the plane x = 30, and they face each
   other there. Joined they are the ball. */
TEST halves_are_the_worlds(int grid)
{
    springls_context *ctx = context_on(grid, NULL);
    const double volume = 4.0 / 3.0 * fixture_pi * 4096.0;
    float *depth = depths_on(ctx);
    int32_t *labels = (int32_t *)malloc(sizeof *labels * 48 * 48 * 48), *copy = (int32_t *)malloc(sizeof *copy * 48 * 48 * 48), *facing;
    springls_tiling *tiling;
    springls_tiling_step_desc settle = springls_default_tiling_step_desc();
    springls_tiling_measures measures[2];
    springls_context *body;
    springls_walls walls;
    double outer = 0.0, middle = 0.0, faces = 0.0;
    int i, k, outer_count = 0, middle_count = 0;
    ASSERT(ctx && depth && labels && copy);
    for (i = 0; i < 48 * 48 * 48; i++) {
        float voxel[3], world[3];
        voxel[0] = (float)(i % 48);
        voxel[1] = (float)(i / 48 % 48);
        voxel[2] = (float)(i / 48 / 48);
        springls_to_world(ctx, voxel, 1, world);
        labels[i] = depth[i] > 0.0f ? world[0] < CENTER ? 1 : 2 : 0;
    }
    ASSERT_OK(springls_tiling_create(&ctx->desc, &tiling));
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 2));
    ASSERT_OK(springls_tiling_copy_labels(tiling, copy));
    ASSERT_MEM_EQ(labels, copy, sizeof *labels * 48 * 48 * 48);
    ASSERT_OK(springls_tiling_step(tiling, &settle, NULL));
    ASSERT_OK(restore_into(&tiling, &ctx->desc));
    ASSERT_OK(springls_tiling_extract(tiling, &walls));
    for (i = 0; i < walls.triangle_count; i++)
        for (k = 0; k < 3; k++) {
            const float *x = walls.positions + 3 * walls.triangles[3 * i + k];
            if (walls.labels[2 * i] && walls.labels[2 * i + 1]) {
                middle += fabs((double)(x[0] - CENTER));
                middle_count++;
            } else {
                outer += outside(x, 16.0);
                outer_count++;
            }
        }
    ASSERT_IN_RANGE(0.0, outer / outer_count, 0.25);
    ASSERT_IN_RANGE(0.0, middle / middle_count, 0.45);
    springls_walls_free(tiling, &walls);
    ASSERT_OK(springls_tiling_measure(tiling, measures));
    for (k = 0; k < 2; k++) ASSERT_IN_RANGE(0.5 * volume, measures[k].volume, 0.04 * volume);
    body = springls_tiling_body(tiling, 1);
    facing = (int32_t *)malloc(sizeof *facing * (size_t)springls_count(body));
    ASSERT_OK(springls_tiling_facing(tiling, 1, facing));
    for (i = 0; i < springls_count(body); i++) faces += facing[i] == 2;
    ASSERT_GT(faces, 0.0);
    for (i = 0; i < springls_count(body); i++)
        if (facing[i] == 2) ASSERT_IN_RANGE((double)CENTER, (double)world_of(body, springls_view_particles(body), i).x, 1.2);
    ASSERT_OK(springls_tiling_join(tiling, 1, 2));
    ASSERT_OK(springls_tiling_measure(tiling, measures));
    ASSERT_IN_RANGE(volume, measures[0].volume, 0.04 * volume);
    free(facing);
    free(labels);
    free(copy);
    free(depth);
    springls_tiling_destroy(tiling);
    springls_destroy(ctx);
    PASS();
}

/* A body from a mesh has its volume. */
TEST tilings_take_meshes_of_the_world(int grid)
{
    springls_context *ctx = context_on(grid, NULL), *cubes = ball_on(CUBES, NULL, 16.0f);
    springls_tiling *tiling;
    springls_tiling_measures measures;
    springls_mesh mesh;
    ASSERT(ctx && cubes);
    ASSERT_OK(springls_extract_mesh(cubes, &mesh));
    ASSERT_OK(springls_tiling_create(&ctx->desc, &tiling));
    ASSERT_OK(springls_tiling_add_mesh(tiling, 7, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL));
    ASSERT_OK(springls_tiling_measure(tiling, &measures));
    ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * 4096.0, measures.volume, 0.015 * measures.volume);
    ASSERT_IN_RANGE(4.0 * fixture_pi * 256.0, measures.area, 0.015 * measures.area);
    CHECK_CALL(check_ball(springls_tiling_body(tiling, 7), 16.0));
    springls_tiling_destroy(tiling);
    springls_mesh_free(cubes, &mesh);
    springls_destroy(ctx);
    springls_destroy(cubes);
    PASS();
}

SUITE(metric_reads)
{
    int grid;
    for (grid = first_grid(); grid < GRIDS; grid++) {
        RUN_TESTp(surfels_are_the_worlds, grid);
        RUN_TESTp(voxels_stay_voxels, grid);
        RUN_TESTp(chunks_are_the_worlds, grid);
        RUN_TESTp(sides_are_the_worlds, grid, SPRINGLS_CONTOURING_LEVEL_SET);
        RUN_TESTp(sides_are_the_worlds, grid, SPRINGLS_CONTOURING_SPRINGLS);
        RUN_TESTp(events_are_the_worlds, grid);
        RUN_TESTp(mesh_errors_are_the_worlds, grid);
        RUN_TESTp(materials_are_the_worlds, grid, false);
        RUN_TESTp(materials_are_the_worlds, grid, true);
        RUN_TESTp(references_are_the_worlds, grid);
        RUN_TESTp(attributes_are_the_worlds, grid);
        RUN_TESTp(forces_are_the_worlds, grid);
        RUN_TESTp(written_springls_are_the_worlds, grid);
        RUN_TESTp(moving_grids_are_the_worlds, grid);
        RUN_TESTp(stages_are_the_worlds, grid);
        RUN_TESTp(shapes_are_the_worlds, grid);
        RUN_TESTp(combinations_in_pieces_are_the_worlds, grid);
        RUN_TESTp(snapshots_are_the_worlds, grid);
        RUN_TESTp(halves_are_the_worlds, grid);
        RUN_TESTp(tilings_take_meshes_of_the_world, grid);
    }
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(metric_reads);
    GREATEST_MAIN_END();
}
