/* test_contouring.c - the mesh of what springls hold (params.contouring): closed and oriented, each vertex one fan; sharp edges and
   plates below a voxel, queries of them; its components and their volumes; the border of the grid; the same bits for any threads;
   memory that runs out. */
#include "fixtures.h"
#include "../examples/common/springls/exact_flows.h"

GREATEST_MAIN_DEFS();

static springls_params contoured(void)
{
    springls_params params = springls_default_params();
    params.contouring = SPRINGLS_CONTOURING_SPRINGLS;
    return params;
}

static springls_params followed(void)
{
    springls_params params = contoured();
    params.components = 1;
    return params;
}

/* ---- what is wrong with a mesh ---- */

static int compare_pair(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Returns how many vertices have triangles that are not one fan: from a corner's next vertex each triangle leads to another. */
static int split_vertices(const springls_mesh *mesh)
{
    const int n = 3 * mesh->triangle_count;
    uint64_t *side = (uint64_t *)malloc(((size_t)n + 1) * sizeof *side); /* vertex, the next one, the corner */
    int *fan = (int *)calloc((size_t)mesh->vertex_count + 1, sizeof *fan);
    int *degree = (int *)calloc((size_t)mesh->vertex_count + 1, sizeof *degree);
    int *start = (int *)malloc(((size_t)mesh->vertex_count + 1) * sizeof *start), i, split = 0;
    for (i = 0; i < n; i++) {
        const int v = mesh->triangles[i], next = mesh->triangles[i % 3 == 2 ? i - 2 : i + 1];
        side[i] = (uint64_t)v << 42 | (uint64_t)next << 21 | (uint64_t)mesh->triangles[i % 3 == 0 ? i + 2 : i - 1];
        start[v] = next;
        degree[v]++;
    }
    qsort(side, (size_t)n, sizeof *side, compare_pair);
    for (i = 0; i < mesh->vertex_count; i++) {
        int at = start[i];
        do {
            int low = 0, high = n;
            while (low < high) {
                const int middle = (low + high) / 2;
                if (side[middle] >> 21 < ((uint64_t)i << 21 | (uint64_t)at)) low = middle + 1;
                else high = middle;
            }
            at = low < n && side[low] >> 21 == ((uint64_t)i << 21 | (uint64_t)at) ? (int)(side[low] & 0x1fffff) : start[i];
            fan[i]++;
        } while (at != start[i] && fan[i] <= degree[i]);
        split += fan[i] != degree[i];
    }
    free(side);
    free(fan);
    free(degree);
    free(start);
    return split;
}

/* Returns six times the volume of a tetrahedron, exactly: places are multiples of 2^-16 voxel, and in one cell. */
static double volume_of_four(const float *a, const float *b, const float *c, const float *d)
{
    double u[3], v[3], w[3];
    int k;
    for (k = 0; k < 3; k++) {
        u[k] = (double)b[k] - (double)a[k];
        v[k] = (double)c[k] - (double)a[k];
        w[k] = (double)d[k] - (double)a[k];
    }
    return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
}

/* Returns whether the segment from p to q passes through the inside of a triangle. */
static int passes_through(const float *p, const float *q, const float *a, const float *b, const float *c)
{
    const double u = volume_of_four(p, q, a, b), v = volume_of_four(p, q, b, c), w = volume_of_four(p, q, c, a);
    if (!(volume_of_four(a, b, c, p) * volume_of_four(a, b, c, q) < 0.0)) return 0;
    return (u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0);
}

/* Returns in which cell of a grid of 128 a triangle lies; voxels are 1 wide. What lies beyond is of the cells at the border. */
static int cell_of_triangle(const springls_mesh *mesh, int t)
{
    int k, cell = 0;
    for (k = 2; k >= 0; k--) {
        const int *c = mesh->triangles + 3 * t;
        double sum = 0.0;
        int i;
        for (i = 0; i < 3; i++) sum += (double)mesh->positions[3 * c[i] + k];
        cell = 128 * cell + springls__imin(springls__imax((int)floor(sum / 3.0) + 2, 0), 127);
    }
    return cell;
}

/* Returns how many triangles have a side that passes through another one of their cell; -1: there is no memory to find out. */
static int crossing_triangles(const springls_mesh *mesh)
{
    enum { CELLS = 128 * 128 * 128 };
    int *first = (int *)malloc(CELLS * sizeof *first), *next = (int *)malloc(((size_t)mesh->triangle_count + 1) * sizeof *next);
    int t, other, k, count = 0;
    if (!first || !next) {
        free(first);
        free(next);
        return -1;
    }
    for (k = 0; k < CELLS; k++) first[k] = -1;
    for (t = 0; t < mesh->triangle_count; t++) {
        const int cell = cell_of_triangle(mesh, t);
        next[t] = first[cell];
        first[cell] = t;
    }
    for (t = 0; t < mesh->triangle_count; t++) {
        const int *c = mesh->triangles + 3 * t;
        int crosses = 0;
        for (other = first[cell_of_triangle(mesh, t)]; other >= 0; other = next[other])
            for (k = 0; k < 3; k++) {
                const int *d = mesh->triangles + 3 * other;
                crosses |= passes_through(mesh->positions + 3 * c[k], mesh->positions + 3 * c[(k + 1) % 3], mesh->positions + 3 * d[0],
                                          mesh->positions + 3 * d[1], mesh->positions + 3 * d[2]);
            }
        count += crosses;
    }
    free(first);
    free(next);
    return count;
}

typedef struct found { springls_mesh mesh; springls__mesh_report report; springls_measures measures; } found;

/* The components, where they are followed, are those of the mesh: as many as its parts, bodies with its volume and its area. Places inside
   lie in bodies. */
TEST components_are_the_mesh(springls_context *ctx, const found *f)
{
    enum { POINTS = 40 };
    const springls_component *list;
    double volume = 0.0, area = 0.0;
    float points[3 * POINTS];
    uint8_t inside[POINTS];
    uint32_t ids[POINTS];
    int count, i, k;
    if (!springls_get_params(ctx).components) PASS();
    for (i = 0; i < 3 * POINTS; i++) points[i] = fixture_between(4.0f, 60.0f);
    for (i = 0; i < POINTS && f->mesh.vertex_count > 0; i += 2) /* many beside the surface */
        for (k = 0; k < 3; k++)
            points[3 * i + k] = f->mesh.positions[3 * (i * 7919 % f->mesh.vertex_count) + k] + fixture_between(-1.0f, 1.0f);
    ASSERT_OK(springls_component_of(ctx, points, POINTS, ids));
    ASSERT_OK(springls_sample_inside(ctx, points, POINTS, inside));
    ASSERT_OK(springls_components(ctx, &list, &count));
    ASSERT_EQ(f->report.components, count);
    for (i = 0; i < count; i++) {
        ASSERT(list[i].volume > 0.0);
        if (list[i].cavity) continue;
        volume += list[i].volume;
        area += list[i].area;
    }
    ASSERT_IN_RANGE(f->report.volume, volume, 1e-5 * f->report.area);
    ASSERT_IN_RANGE(f->report.area, area, 1e-5 * f->report.area);
    for (i = 0; i < POINTS; i++) {
        for (k = 0; k < count && list[k].id != ids[i]; k++) continue;
        if (inside[i] || ids[i]) ASSERT(k < count && !list[k].cavity);
    }
    PASS();
}

/* Returns a hash of a triangle between places, from whichever corner it begins. */
static uint64_t triangle_hash(const float *a, const float *b, const float *c)
{
    const float *p[3];
    uint64_t sum = 0;
    int k, i;
    p[0] = a; p[1] = b; p[2] = c;
    for (k = 0; k < 3; k++) {
        uint64_t hash = SPRINGLS__HASH_BEGIN;
        for (i = 0; i < 3; i++) hash = springls__hash(hash, p[(k + i) % 3], 12);
        sum += hash * hash;
    }
    return sum;
}

/* Chunks without a tolerance have the triangles of the mesh, each once, to the bit, with its vertices' normals. */
TEST chunks_are_the_mesh(springls_context *ctx, const springls_mesh *mesh)
{
    const springls_chunks_desc exact = { .tolerance = -1.0f };
    const springls_chunk *chunk;
    springls_chunks *chunks;
    uint64_t of_mesh = 0, of_chunks = 0;
    int count, i, t, n = 0;
    ASSERT_OK(springls_chunks_create(ctx, &exact, &chunks));
    ASSERT_OK(springls_chunks_update(ctx, chunks, &chunk, &count));
    for (t = 0; t < mesh->triangle_count; t++) {
        const int *c = mesh->triangles + 3 * t;
        of_mesh += triangle_hash(mesh->positions + 3 * c[0], mesh->positions + 3 * c[1], mesh->positions + 3 * c[2])
                 + triangle_hash(mesh->normals + 3 * c[0], mesh->normals + 3 * c[1], mesh->normals + 3 * c[2]);
    }
    for (i = 0; i < count; i++)
        for (n += chunk[i].triangle_count, t = 0; t < chunk[i].triangle_count; t++) {
            const uint16_t *c = chunk[i].triangles + 3 * t;
            const float *x = chunk[i].positions, *m = chunk[i].normals;
            of_chunks += triangle_hash(x + 3 * c[0], x + 3 * c[1], x + 3 * c[2]) + triangle_hash(m + 3 * c[0], m + 3 * c[1], m + 3 * c[2]);
        }
    ASSERT_EQ(mesh->triangle_count, n);
    ASSERT_EQ(of_mesh, of_chunks);
    ASSERT_OK(springls_chunks_update(ctx, chunks, &chunk, &count));
    ASSERT_EQ(0, count);
    springls_chunks_destroy(ctx, chunks);
    PASS();
}

/* Extracts a mesh, and checks all that holds for each. */
TEST extract(springls_context *ctx, found *f)
{
    int i;
    ASSERT_OK(springls_extract_mesh(ctx, &f->mesh));
    ASSERT_OK(springls_measure(ctx, &f->measures));
    f->report = fixture_report(&f->mesh);
    ASSERT_EQ(0, f->report.boundary_edges);
    ASSERT_EQ(0, f->report.nonmanifold_edges);
    ASSERT_EQ(0, f->report.misoriented_edges);
    ASSERT_EQ(0, split_vertices(&f->mesh));
    ASSERT_EQ(0, crossing_triangles(&f->mesh));
    ASSERT_EQ(f->report.euler, f->measures.euler);
    ASSERT_EQ(f->report.components, f->measures.components);
    ASSERT_IN_RANGE(f->report.volume, f->measures.volume, 1e-3 * (1.0 + f->report.volume));
    for (i = 0; i < f->mesh.vertex_count; i++) {
        const float *n = f->mesh.normals + 3 * i;
        ASSERT_IN_RANGE(1.0, sqrt((double)n[0] * (double)n[0] + (double)n[1] * (double)n[1] + (double)n[2] * (double)n[2]), 1e-5);
        ASSERT(f->mesh.springls[i] >= -1 && f->mesh.springls[i] < springls_count(ctx));
    }
    CHECK_CALL(components_are_the_mesh(ctx, f));
    CHECK_CALL(chunks_are_the_mesh(ctx, &f->mesh));
    PASS();
}

/* ---- shapes ---- */

TEST a_ball_is_round(void)
{
    const d3 center = d3_make(31.3, 30.7, 32.1);
    springls_params params = contoured();
    springls_context *ctx = fixture_sphere(64, &params, 31.3f, 30.7f, 32.1f, 18.0f);
    double sum = 0.0;
    found f;
    int i;
    CHECK_CALL(extract(ctx, &f));
    ASSERT_EQ(1, f.report.components);
    ASSERT_EQ(2, f.report.euler);
    ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * 18.0 * 18.0 * 18.0, f.report.volume, 0.003 * f.report.volume);
    for (i = 0; i < f.mesh.vertex_count; i++) {
        const float *x = f.mesh.positions + 3 * i, *n = f.mesh.normals + 3 * i, *a = f.mesh.correspondences + 3 * i;
        const d3 from = d3_sub(d3_make((double)x[0], (double)x[1], (double)x[2]), center);
        sum += fabs(d3_length(from) - 18.0);
        ASSERT_IN_RANGE(18.0, d3_length(from), 0.03);
        ASSERT_GT(d3_dot(from, d3_make((double)n[0], (double)n[1], (double)n[2])), 18.0 * 0.995);
        ASSERT_IN_RANGE(0.0, d3_distance(d3_add(from, center), d3_make((double)a[0], (double)a[1], (double)a[2])), 0.03);
        ASSERT(f.mesh.springls[i] >= 0);
    }
    ASSERT_LT(sum / f.mesh.vertex_count, 0.002);
    springls_mesh_free(ctx, &f.mesh);
    springls_destroy(ctx);
    PASS();
}

static const d3 turn_center = { 31.37, 31.52, 31.21 };

/* Sets a box with these halves, turned about an axis along no other by so many degrees. */
static springls_status set_box(springls_context *ctx, d3 center, double hx, double hy, double hz, double degrees)
{
    static const int triangles[36] = { 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6,
                                       1, 3, 5, 3, 7, 5 };
    float x[24];
    int i;
    for (i = 0; i < 8; i++) {
        d3 p = d3_make(i & 1 ? hx : -hx, i & 2 ? hy : -hy, i & 4 ? hz : -hz);
        p = d3_add(center, d3_rotate(p, d3_scale(d3_make(0.48, 0.6, 0.64), degrees * fixture_pi / 180.0)));
        x[3 * i] = (float)p.x;
        x[3 * i + 1] = (float)p.y;
        x[3 * i + 2] = (float)p.z;
    }
    return springls_set_mesh(ctx, x, 8, 0, triangles, 12, NULL);
}

static springls_status set_turned_box(springls_context *ctx, double hx, double hy, double hz, double degrees)
{
    return set_box(ctx, turn_center, hx, hy, hz, degrees);
}

/* The area of a box falls short where edges are lost. */
TEST a_turned_box_has_sharp_edges(void)
{
    springls_params params = followed();
    springls_context *ctx = fixture_context(64, &params);
    found f;
    ASSERT_OK(set_turned_box(ctx, 9.0, 7.0, 5.0, 20.0));
    CHECK_CALL(extract(ctx, &f));
    ASSERT_EQ(2, f.report.euler);
    ASSERT_IN_RANGE(2520.0, f.report.volume, 0.0005 * 2520.0);
    ASSERT_IN_RANGE(1144.0, f.report.area, 0.001 * 1144.0);
    springls_mesh_free(ctx, &f.mesh);
    springls_destroy(ctx);
    PASS();
}

/* Whose faces, edges and corners lie on nodes of the grid, or by this much beside them: all of these nodes have the same side. */
TEST a_box_on_nodes_has_sharp_edges(double beside, int from_mesh)
{
    const float center = (float)(20.0 + beside);
    springls_box box = { { center, center, center }, { 6.0f, 5.0f, 4.0f } };
    springls_params params = followed();
    springls_context *ctx = fixture_context(40, &params);
    found f;
    int i, k;
    if (from_mesh) ASSERT_OK(set_box(ctx, d3_scale(d3_make(1.0, 1.0, 1.0), (double)center), 6.0, 5.0, 4.0, 0.0));
    else ASSERT_OK(springls_set_implicit(ctx, springls_implicit_box, &box));
    CHECK_CALL(extract(ctx, &f));
    ASSERT_EQ(2, f.report.euler);
    ASSERT_IN_RANGE(960.0, f.report.volume, 0.004 * 960.0);
    ASSERT_IN_RANGE(592.0, f.report.area, 0.01 * 592.0);
    for (i = 0; i < f.mesh.vertex_count; i++) {
        float outside = -1e9f;
        for (k = 0; k < 3; k++) outside = fmaxf(outside, fabsf(f.mesh.positions[3 * i + k] - center) - box.half[k]);
        ASSERT_IN_RANGE(0.0, outside, 0.05);
    }
    springls_mesh_free(ctx, &f.mesh);
    springls_destroy(ctx);
    PASS();
}

static void squeeze(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)time;
    for (i = 0; i < count; i++) {
        out[3 * i] = out[3 * i + 1] = 0.0f;
        out[3 * i + 2] = *(const float *)user * ((float)turn_center.z - points[3 * i + 2]);
    }
}

static void whirl(void *user, const float *points, int count, float time, float *out)
{
    const d3 w = *(const d3 *)user;
    int i;
    (void)time;
    for (i = 0; i < count; i++) {
        const float *p = points + 3 * i;
        const springls__v3 v = d3_float(d3_cross(w, d3_sub(d3_make((double)p[0], (double)p[1], (double)p[2]), turn_center)));
        memcpy(out + 3 * i, &v, sizeof v);
    }
}

/* Makes a plate of 22.6 x 18.8 voxels and this thickness: below a voxel by eight steps from one of 1.5 voxels. */
static springls_status make_plate(springls_context *ctx, double thickness)
{
    float rate = (float)(log(1.5 / thickness) / 8.0);
    springls_forces forces = fixture_forces(squeeze, &rate);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_status status = set_turned_box(ctx, 11.3, 9.4, thickness < 1.0 ? 0.75 : 0.5 * thickness, 0.0);
    int i;
    step.one_to_one = true; /* ordinary steps lose springls of thin ones */
    for (i = 0; i < 8 && thickness < 1.0 && status == SPRINGLS_OK; i++) status = springls_step(ctx, &step);
    return status;
}

/* Plates, which steps make thin and turn: one body, whole, down to a tenth of a voxel. */
TEST a_plate_stays_whole(double thickness)
{
    const double area = 22.6 * 18.8;
    d3 axis = d3_scale(d3_make(0.48, 0.6, 0.64), fixture_pi / 180.0);
    springls_params params = contoured();
    springls_context *ctx = fixture_context(64, &params);
    springls_forces forces = fixture_forces(whirl, &axis);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    found f;
    int i;
    step.one_to_one = thickness < 1.0; /* ordinary steps lose springls of thinner ones */
    ASSERT_OK(make_plate(ctx, thickness));
    for (i = 0; i < 20; i++) ASSERT_OK(springls_step(ctx, &step));
    params.components = 1;
    ASSERT_OK(springls_set_params(ctx, &params));
    CHECK_CALL(extract(ctx, &f));
    ASSERT_EQ(1, f.report.components);
    ASSERT_EQ(2, f.report.euler);
    ASSERT_IN_RANGE(area * thickness, f.report.volume, 0.015 * area * thickness);
    springls_mesh_free(ctx, &f.mesh);
    springls_destroy(ctx);
    PASS();
}

/* A thin sheet that passes through a node is crossed by one of the two edges there: else the other's crossings were a body of their own.
   Rims, where hits end, may still have such specks. */
TEST a_sheet_through_nodes_is_crossed_once(void)
{
    d3 axis = d3_scale(d3_make(0.48, 0.6, 0.64), fixture_pi / 180.0);
    springls_params params = contoured();
    springls_context *ctx = fixture_context(64, &params);
    springls_forces forces = fixture_forces(whirl, &axis);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    found f;
    int i;
    step.one_to_one = true;
    ASSERT_OK(make_plate(ctx, 0.1));
    for (i = 0; i < 40; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        CHECK_CALL(extract(ctx, &f));
        ASSERT_EQ(1, f.report.components);
        springls_mesh_free(ctx, &f.mesh);
    }
    springls_destroy(ctx);
    PASS();
}

/* The two sheets of a plate that has been squeezed are not the sides of a crease, and it keeps its springls through a turn. */
TEST a_squeezed_plate_keeps_its_springls(double thickness)
{
    d3 axis = d3_scale(d3_make(0.48, 0.6, 0.64), fixture_pi / 180.0);
    springls_params params = contoured();
    springls_context *ctx = fixture_context(64, &params);
    springls_forces forces = fixture_forces(whirl, &axis);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    int count;
    ASSERT_OK(make_plate(ctx, thickness));
    ASSERT_EQ(0, springls_get_stats(ctx).at_edges);
    count = springls_count(ctx);
    ASSERT_OK(springls_run(ctx, &step, 20));
    ASSERT_GT(springls_count(ctx), 95 * count / 100);
    springls_destroy(ctx);
    PASS();
}

/* A plate between nodes of the grid, or with its faces on them, has no voxel inside; what springls show is enough. A solid that has neither
   is refused. */
TEST a_plate_without_voxels_is_set(double from, double thickness)
{
    const d3 center = d3_make(20.1, 20.2, from + 0.5 * thickness);
    const double volume = 16.0 * 14.0 * thickness, tolerance = thickness < 0.1 ? 0.08 : 0.025; /* at the rims */
    springls_step_desc step = fixture_step(NULL, SPRINGLS_MODE_FLUID, 0.1f);
    springls_params params = followed();
    springls_context *ctx = fixture_context(40, &params);
    found f;
    ASSERT_OK(set_box(ctx, center, 8.0, 7.0, 0.5 * thickness, 0.0));
    CHECK_CALL(extract(ctx, &f));
    ASSERT_EQ(1, f.report.components);
    ASSERT_EQ(2, f.report.euler);
    ASSERT_IN_RANGE(volume, f.report.volume, tolerance * volume);
    springls_mesh_free(ctx, &f.mesh);
    ASSERT_OK(springls_step(ctx, &step));
    CHECK_CALL(extract(ctx, &f));
    ASSERT_EQ(1, f.report.components);
    springls_mesh_free(ctx, &f.mesh);
    ASSERT_STATUS(SPRINGLS_BAD_MESH, set_box(ctx, d3_make(20.5, 20.5, 20.5), 0.2, 0.2, 0.2, 0.0));
    ASSERT_EQ(0, springls_count(ctx));
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    ASSERT_OK(springls_set_params(ctx, &params));
    ASSERT_STATUS(SPRINGLS_BAD_MESH, set_box(ctx, center, 8.0, 7.0, 0.5 * thickness, 0.0));
    springls_destroy(ctx);
    PASS();
}

/* LeVeque's sheet at half time: phi has four parts there, and lost 13 % of the volume. */
TEST a_sheet_is_whole(void)
{
    const double volume = 4.0 / 3.0 * fixture_pi * 9.6 * 9.6 * 9.6;
    struct exact_flow flow = EXACT_DEFORMATION(64.0f, 3.0f);
    springls_params params = contoured();
    springls_context *ctx = fixture_sphere(64, &params, 22.4f, 22.4f, 22.4f, 9.6f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    springls_step_desc step = springls_default_step_desc();
    uint64_t hash;
    found f;
    int i;
    step.forces = &forces;
    step.dt = 0.075f;
    for (i = 0; i < 20; i++) ASSERT_OK(springls_step(ctx, &step));
    hash = springls_state_hash(ctx);
    params.components = 1;
    ASSERT_OK(springls_set_params(ctx, &params));
    CHECK_CALL(extract(ctx, &f));
    ASSERT_EQ(1, f.report.components);
    ASSERT_EQ(2, f.report.euler);
    ASSERT_IN_RANGE(volume, f.report.volume, 0.006 * volume);
    ASSERT(hash == springls_state_hash(ctx)); /* reading changes nothing */
    springls_mesh_free(ctx, &f.mesh);
    springls_destroy(ctx);
    PASS();
}

/* A body that the border cuts is closed half a voxel beyond the last centres. */
TEST the_border_is_closed(void)
{
    springls_params params = followed();
    springls_context *ctx = fixture_sphere(32, &params, 2.0f, 15.5f, 29.0f, 8.0f);
    int i, closing = 0;
    found f;
    CHECK_CALL(extract(ctx, &f));
    ASSERT_EQ(2, f.report.euler);
    for (i = 0; i < f.mesh.vertex_count; i++) {
        const float *x = f.mesh.positions + 3 * i;
        ASSERT_IN_RANGE(15.5, (double)x[0], 16.0);
        ASSERT_IN_RANGE(15.5, (double)x[2], 16.0);
        closing += x[0] == -0.5f && f.mesh.normals[3 * i] < -0.99f;
    }
    ASSERT_GT(closing, 20);
    springls_mesh_free(ctx, &f.mesh);
    springls_destroy(ctx);
    PASS();
}

/* Each vertex has the correspondence of its own side of a sheet. */
TEST sides_of_a_sheet_keep_their_correspondences(void)
{
    springls_params params = contoured();
    springls_context *ctx = fixture_context(64, &params);
    int i, judged = 0;
    found f;
    ASSERT_OK(set_turned_box(ctx, 11.3, 9.4, 0.5, 0.0));
    CHECK_CALL(extract(ctx, &f));
    for (i = 0; i < f.mesh.vertex_count; i++) {
        const float n = f.mesh.normals[3 * i + 2], side = n > 0.0f ? 0.5f : -0.5f;
        if (fabsf(n) < 0.99f) continue;
        judged++;
        ASSERT_IN_RANGE(turn_center.z + (double)side, (double)f.mesh.correspondences[3 * i + 2], 0.01);
    }
    ASSERT_GT(judged, 600);
    springls_mesh_free(ctx, &f.mesh);
    springls_destroy(ctx);
    PASS();
}

/* Rays, closest points and insides are those of the mesh: a plate of a quarter of a voxel, which phi does not hold. */
TEST queries_follow_the_mesh(void)
{
    enum { POINTS = 400 };
    springls_params params = contoured();
    springls_context *ctx = fixture_context(64, &params);
    float points[2 * 3 * POINTS], directions[3 * POINTS];
    springls_hit ray[POINTS], closest[POINTS];
    uint8_t inside[2 * POINTS];
    const double z = turn_center.z;
    int i;
    ASSERT_OK(make_plate(ctx, 0.25));
    fixture_seed(7u);
    for (i = 0; i < POINTS; i++) {
        float *above = points + 3 * i, *middle = points + 3 * (POINTS + i);
        above[0] = middle[0] = (float)turn_center.x + fixture_between(-9.0f, 9.0f); /* off the rims, which are round */
        above[1] = middle[1] = (float)turn_center.y + fixture_between(-7.0f, 7.0f);
        above[2] = (float)z + 2.0f;
        middle[2] = (float)z;
        directions[3 * i] = directions[3 * i + 1] = 0.0f;
        directions[3 * i + 2] = -1.0f;
    }
    ASSERT_OK(springls_sample_inside(ctx, points, 2 * POINTS, inside));
    ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, directions, POINTS, 0.0f, ray));
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, POINTS, closest));
    for (i = 0; i < POINTS; i++) {
        ASSERT_EQ(0, inside[i]);
        ASSERT_EQ(1, inside[POINTS + i]);
        ASSERT(ray[i].springl >= 0 && closest[i].springl >= 0);
        ASSERT_IN_RANGE(z + 0.125, (double)ray[i].point[2], 0.01);
        ASSERT_IN_RANGE(1.875, (double)ray[i].distance, 0.01);
        ASSERT_IN_RANGE((double)ray[i].distance, (double)closest[i].distance, 0.01);
        ASSERT(closest[i].distance <= ray[i].distance + 1e-5f);
        ASSERT_GT((double)ray[i].normal[2], 0.999);
        ASSERT_IN_RANGE(z + 0.75, (double)ray[i].material[2], 0.01);
    }
    for (i = 0; i < POINTS; i++) points[3 * i + 2] -= 4.0f; /* from below, upwards */
    for (i = 0; i < POINTS; i++) directions[3 * i + 2] = 1.0f;
    ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, directions, POINTS, 0.0f, ray));
    for (i = 0; i < POINTS; i++) ASSERT_IN_RANGE(z - 0.125, (double)ray[i].point[2], 0.01);
    springls_destroy(ctx);
    PASS();
}

/* ---- components ---- */

static void bubble_and_core(void *user, const float *points, int count, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < count; i++) {
        const float x = points[3 * i] - 31.3f, y = points[3 * i + 1] - 30.6f, z = points[3 * i + 2] - 31.8f;
        const float r = sqrtf(x * x + y * y + z * z);
        out[i] = fmaxf(r - 22.0f, fminf(16.0f - r, r - 5.0f));
    }
}

/* A ball in a bubble in a ball: two bodies and a cavity, each with its own volume. */
TEST components_lie_in_each_other(void)
{
    const double ball = 4.0 / 3.0 * fixture_pi, volume[3] = { ball * (10648.0 - 4096.0), ball * (4096.0 - 125.0), ball * 125.0 };
    const float points[12] = { 50.5f, 31.0f, 31.0f, 41.8f, 30.7f, 31.8f, 32.0f, 31.0f, 31.0f, 46.5f, 31.0f, 31.0f };
    springls_params params = followed();
    springls_context *ctx = fixture_context(64, &params);
    const springls_component *list;
    uint32_t ids[4];
    int count, i, k, seen = 0;
    ASSERT_OK(springls_set_implicit(ctx, bubble_and_core, NULL));
    ASSERT_OK(springls_component_of(ctx, points, 4, ids));
    ASSERT_OK(springls_components(ctx, &list, &count));
    ASSERT_EQ(3, count);
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++)
            if (fabs(list[i].volume - volume[k]) < 0.02 * volume[k] && list[i].cavity == (k == 1)) {
                seen |= 1 << k;
                if (k != 1) ASSERT_EQ(list[i].id, ids[k]);
            }
    ASSERT_EQ(7, seen);
    ASSERT_EQ(0u, ids[1]);
    ASSERT_EQ(ids[0], ids[3]); /* in the bubble, beside its wall */
    springls_destroy(ctx);
    PASS();
}

static void press(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user, (void)time;
    for (i = 0; i < count; i++) {
        out[3 * i] = points[3 * i] < 24.0f ? 0.25f : -0.25f;
        out[3 * i + 1] = out[3 * i + 2] = 0.0f;
    }
}

/* Two balls are pressed together until they are one: at every step components, ids of springls and places are those of the mesh, and
   there is one merger. With another surface the components are that one's. */
TEST pressed_balls_have_the_components_of_the_mesh(springls_contact contact)
{
    springls_params params = followed();
    fixture_balls balls;
    springls_context *ctx;
    springls_forces forces = fixture_forces(press, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    const springls_event *events;
    const springls_component *list;
    int i, k, count, other, changes = 0, before = 2;
    found f;
    params.contact = contact;
    ctx = fixture_context(48, &params);
    balls.ball[0] = fixture_ball(16.1f, 23.6f, 23.4f, 6.5f);
    balls.ball[1] = fixture_ball(31.9f, 23.6f, 23.4f, 6.5f);
    ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &balls));
    for (i = 0; i < 12; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        CHECK_CALL(extract(ctx, &f));
        ASSERT_OK(springls_events(ctx, &events, &count));
        for (k = 0; k < count; k++) changes += events[k].after_count - events[k].before_count;
        ASSERT_EQ(before + changes, f.report.components);
        before = f.report.components - changes;
        springls_mesh_free(ctx, &f.mesh);
    }
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    ASSERT_OK(springls_set_params(ctx, &params));
    ASSERT_OK(springls_components(ctx, &list, &other));
    ASSERT_EQ(1, other);
    springls_destroy(ctx);
    PASS();
}

static void deflate(void *user, const float *points, int count, float time, float *out)
{
    int i, k;
    (void)user, (void)time;
    for (i = 0; i < count; i++)
        for (k = 0; k < 3; k++) out[3 * i + k] = 0.004f * ((k == 2 ? (float)turn_center.z : 31.4f) - points[3 * i + k]);
}

/* volume_lock keeps the volume of the mesh of springls: of a ball, and of a plate of half a voxel, which phi does not hold. */
TEST a_locked_volume_is_the_mesh(int plate)
{
    springls_params params = contoured();
    springls_context *ctx = plate ? fixture_context(64, &params) : fixture_sphere(64, &params, 31.3f, 31.6f, 31.2f, 9.0f);
    springls_forces forces = fixture_forces(deflate, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_measures first, last;
    int i;
    if (plate) ASSERT_OK(make_plate(ctx, 0.5));
    step.one_to_one = plate;
    params.volume_lock = 1;
    ASSERT_OK(springls_set_params(ctx, &params));
    ASSERT_OK(springls_measure(ctx, &first));
    for (i = 0; i < 6; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_OK(springls_measure(ctx, &last));
    ASSERT_IN_RANGE(first.volume, last.volume, (plate ? 1e-3 : 1e-5) * first.volume); /* without the lock: -7 % */
    if (!plate) ASSERT_EQ(1, last.components); /* rims of plates have specks */
    ASSERT_GT(springls_get_stats(ctx).volume_correction, plate ? 0.001f : 0.03f);
    springls_destroy(ctx);
    PASS();
}

/* ---- the model's state is anything ---- */

/* Springls with noise: whatever they are, the mesh is closed. */
TEST noise_is_closed(int seed)
{
    springls_params params = followed();
    springls_context *ctx = fixture_sphere(32, &params, 15.5f, 15.5f, 15.5f, 8.0f);
    const float amount = 0.1f * (float)(seed % 10);
    springls__model *model = fixture_here(ctx);
    found f;
    int i, m;
    fixture_seed((uint32_t)seed);
    for (i = 0; i < model->set.count; i++) {
        springls__springl s = springls__moved_to(model->set.s[i], springls__mad(model->set.s[i].p, fixture_direction(), amount));
        for (m = 0; m < 3; m++) s.q[m] = springls__mad(s.q[m], fixture_direction(), 0.5f * amount);
        model->set.s[i] = springls__springl_finished(s);
    }
    ctx->cells_fresh = ctx->particles_listed = false;
    CHECK_CALL(extract(ctx, &f));
    springls_mesh_free(ctx, &f.mesh);
    springls_destroy(ctx);
    PASS();
}

/* Random triangles: no surface at all. */
TEST soup_is_closed(int seed)
{
    springls_params params = followed();
    springls_context *ctx = fixture_sphere(32, &params, 15.5f, 15.5f, 15.5f, 9.0f);
    found f;
    fixture_seed((uint32_t)seed);
    fixture_random_soup(ctx, 200 * (1 + seed % 5), 4.0f, 28.0f, 1.0f + (float)(seed % 3));
    CHECK_CALL(extract(ctx, &f));
    springls_mesh_free(ctx, &f.mesh);
    springls_destroy(ctx);
    PASS();
}

TEST nothing_has_no_mesh(void)
{
    springls_params params = contoured();
    springls_context *ctx = fixture_context(16, &params);
    springls_measures measures;
    springls_mesh mesh;
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_EQ(0, mesh.triangle_count);
    ASSERT_EQ(0, measures.components);
    springls_destroy(ctx);
    PASS();
}

/* Returns whether two meshes are the same bits. */
static int same_mesh(const springls_mesh *a, const springls_mesh *b)
{
    const size_t v = 3 * (size_t)a->vertex_count * sizeof(float), t = 3 * (size_t)a->triangle_count * sizeof(int);
    return a->vertex_count == b->vertex_count && a->triangle_count == b->triangle_count && memcmp(a->positions, b->positions, v) == 0
        && memcmp(a->normals, b->normals, v) == 0 && memcmp(a->triangles, b->triangles, t) == 0
        && memcmp(a->correspondences, b->correspondences, v) == 0 && memcmp(a->springls, b->springls, v / 3) == 0;
}

/* The mesh is kept while the model stays, and made anew after what changes it: as a model has it that is restored. */
TEST the_kept_mesh_is_of_the_model(void)
{
    springls_params params = followed();
    springls_context *ctx = fixture_sphere(32, &params, 15.5f, 15.2f, 15.8f, 8.0f), *other = fixture_context(32, &params);
    d3 axis = d3_make(0.1, 0.0, 0.0);
    springls_forces forces = fixture_forces(whirl, &axis);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_mesh first, again, moved, restored;
    springls_measures measures;
    const float point[3] = { 15.0f, 15.0f, 15.0f };
    uint32_t id[2];
    size_t size = 0;
    void *snapshot;
    ASSERT_OK(springls_extract_mesh(ctx, &first));
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_OK(springls_extract_mesh(ctx, &again));
    ASSERT(same_mesh(&first, &again));
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_OK(springls_extract_mesh(ctx, &moved));
    ASSERT(!same_mesh(&first, &moved));
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    snapshot = malloc(size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, snapshot, size, &size));
    ASSERT_OK(springls_restore(other, snapshot, size));
    ASSERT_OK(springls_set_params(other, &params));
    ASSERT_OK(springls_extract_mesh(other, &restored));
    ASSERT(same_mesh(&moved, &restored));
    ASSERT_OK(springls_component_of(ctx, point, 1, &id[0]));
    ASSERT_OK(springls_component_of(other, point, 1, &id[1]));
    ASSERT(id[0] == 1u && id[1] == 1u);
    free(snapshot);
    springls_mesh_free(ctx, &first);
    springls_mesh_free(ctx, &again);
    springls_mesh_free(ctx, &moved);
    springls_mesh_free(other, &restored);
    springls_destroy(ctx);
    springls_destroy(other);
    PASS();
}

/* A job system that cuts loops in odd ways, in threads where there are any, gives the same mesh. */
TEST threads_give_the_same_mesh(void)
{
    springls_params params = contoured();
    springls_desc desc = fixture_desc(64, &params);
    springls_context *one = fixture_context(64, &params), *many;
    fixture_workers workers;
    springls_mesh a, b;
    desc.tasks = fixture_tasks(&workers, 5, FIXTURE_THREADS);
    ASSERT_OK(springls_create(&desc, &many));
    ASSERT_OK(set_turned_box(one, 9.0, 7.0, 5.0, 20.0));
    ASSERT_OK(set_turned_box(many, 9.0, 7.0, 5.0, 20.0));
    ASSERT_OK(springls_extract_mesh(one, &a));
    ASSERT_OK(springls_extract_mesh(many, &b));
    ASSERT(same_mesh(&a, &b));
    springls_mesh_free(one, &a);
    springls_mesh_free(many, &b);
    springls_destroy(one);
    springls_destroy(many);
    PASS();
}

/* Memory that runs out at any allocation fails the call, and nothing else. */
TEST memory_may_run_out(void)
{
    fixture_heap heap;
    springls_params params = followed();
    springls_desc desc = fixture_desc(16, &params);
    springls_sphere ball = fixture_ball(7.5f, 7.5f, 7.5f, 4.0f);
    springls_status status;
    int fail = 0;
    do {
        springls_context *ctx;
        const float point[3] = { 7.0f, 7.5f, 12.5f };
        springls_mesh mesh;
        springls_hit hit;
        uint32_t id;
        memset(&mesh, 0, sizeof mesh);
        desc.allocator = fixture_allocator(&heap);
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        heap.fail_at = heap.calls + fail++;
        status = springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, point, 1, &hit);
        if (status == SPRINGLS_OK) status = springls_component_of(ctx, point, 1, &id);
        if (status == SPRINGLS_OK) status = springls_extract_mesh(ctx, &mesh);
        ASSERT(status == SPRINGLS_OK || (status == SPRINGLS_OUT_OF_MEMORY && !mesh.positions));
        springls_mesh_free(ctx, &mesh);
        heap.fail_at = -1;
        ASSERT_OK(springls_extract_mesh(ctx, &mesh));
        springls_mesh_free(ctx, &mesh);
        springls_destroy(ctx);
        ASSERT_EQ(0, heap.blocks);
    } while (status != SPRINGLS_OK);
    ASSERT_GT(fail, 10);
    PASS();
}

/* The same of steps that follow components, or keep volumes, of the mesh. */
TEST memory_may_run_out_in_a_step(int lock)
{
    fixture_heap heap;
    springls_params params = contoured();
    springls_desc desc = fixture_desc(16, &params);
    springls_sphere ball = fixture_ball(7.5f, 7.5f, 7.5f, 4.0f);
    springls_forces forces = fixture_forces(deflate, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    springls_status status;
    int fail = 0;
    params.volume_lock = lock;
    params.components = !lock;
    do {
        springls_context *ctx;
        const springls_component *list;
        int count;
        desc.allocator = fixture_allocator(&heap);
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        heap.fail_at = heap.calls + fail++;
        status = springls_step(ctx, &step);
        if (status == SPRINGLS_OK) status = springls_step(ctx, &step);
        ASSERT(status == SPRINGLS_OK || status == SPRINGLS_OUT_OF_MEMORY);
        heap.fail_at = -1;
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_components(ctx, &list, &count));
        ASSERT_EQ(1, count);
        springls_destroy(ctx);
        ASSERT_EQ(0, heap.blocks);
    } while (status != SPRINGLS_OK);
    ASSERT_GT(fail, 10);
    PASS();
}

SUITE(contouring)
{
    static const double thickness[5] = { 2.0, 1.0, 0.5, 0.25, 0.1 };
    static const double besides[7] = { 0.0, 1e-5, -1e-5, 1e-3, -1e-3, 3e-3, -0.02 };
    int i;
    RUN_TEST(a_ball_is_round);
    RUN_TEST(a_turned_box_has_sharp_edges);
    for (i = 0; i < 14; i++) RUN_TESTp(a_box_on_nodes_has_sharp_edges, besides[i / 2], i % 2);
    for (i = 0; i < 5; i++) RUN_TESTp(a_plate_stays_whole, thickness[i]);
    RUN_TEST(a_sheet_through_nodes_is_crossed_once);
    for (i = 2; i < 5; i++) RUN_TESTp(a_squeezed_plate_keeps_its_springls, thickness[i]);
    for (i = 0; i < 5; i++) RUN_TESTp(a_plate_without_voxels_is_set, 20.3, i < 4 ? 0.5 * thickness[i + 1] : 0.02);
    RUN_TESTp(a_plate_without_voxels_is_set, 20.0, 1.0);
    RUN_TESTp(a_plate_without_voxels_is_set, 20.0001, 1.0);
    RUN_TESTp(a_plate_without_voxels_is_set, 20.0, 0.1);
    RUN_TEST(a_sheet_is_whole);
    RUN_TEST(the_border_is_closed);
    RUN_TEST(sides_of_a_sheet_keep_their_correspondences);
    RUN_TEST(queries_follow_the_mesh);
    RUN_TEST(components_lie_in_each_other);
    RUN_TESTp(pressed_balls_have_the_components_of_the_mesh, SPRINGLS_CONTACT_MERGE);
    RUN_TESTp(pressed_balls_have_the_components_of_the_mesh, SPRINGLS_CONTACT_SEPARATE);
    for (i = 0; i < 2; i++) RUN_TESTp(a_locked_volume_is_the_mesh, i);
    for (i = 0; i < 20; i++) RUN_TESTp(noise_is_closed, i);
    for (i = 0; i < 20; i++) RUN_TESTp(soup_is_closed, i);
    RUN_TEST(nothing_has_no_mesh);
    RUN_TEST(the_kept_mesh_is_of_the_model);
    RUN_TEST(threads_give_the_same_mesh);
    RUN_TEST(memory_may_run_out);
    for (i = 0; i < 2; i++) RUN_TESTp(memory_may_run_out_in_a_step, i);
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(contouring);
    GREATEST_MAIN_END();
}
