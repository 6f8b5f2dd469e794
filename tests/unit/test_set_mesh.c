/* test_set_mesh.c - meshes, clean and dirty, into springls and a level set. */
#include "fixtures.h"
#include "../../src/model/winding_number.h"

/* ---- meshes ---- */

enum { MAX_POSITIONS = 400000, MAX_TRIANGLES = 800000 };
static float position[3 * MAX_POSITIONS];
static int triangle[3 * MAX_TRIANGLES];
static int positions, triangles;

static void add_position(double x, double y, double z)
{
    position[3 * positions] = (float)x;
    position[3 * positions + 1] = (float)y;
    position[3 * positions + 2] = (float)z;
    positions++;
}

static void add_triangle(int a, int b, int c)
{
    triangle[3 * triangles] = a;
    triangle[3 * triangles + 1] = b;
    triangle[3 * triangles + 2] = c;
    triangles++;
}

static void turn_triangle(int t)
{
    int swap = triangle[3 * t + 1];
    triangle[3 * t + 1] = triangle[3 * t + 2];
    triangle[3 * t + 2] = swap;
}

static void clear_mesh(void) { positions = triangles = 0; }

/* Rings of latitude from pole to pole; rings above `rings` * share are left out when share < 1: an open bowl. */
static void add_sphere(double cx, double cy, double cz, double r, int around, int rings, double share)
{
    const double pi = 3.14159265358979;
    int south = positions, i, j, kept = (int)(rings * share);
    add_position(cx, cy, cz - r);
    for (j = 1; j < rings; j++)
        for (i = 0; i < around; i++)
            add_position(cx + r * sin(pi * j / rings) * cos(2 * pi * i / around),
                         cy + r * sin(pi * j / rings) * sin(2 * pi * i / around), cz - r * cos(pi * j / rings));
    add_position(cx, cy, cz + r);
    for (i = 0; i < around; i++) add_triangle(south, south + 1 + (i + 1) % around, south + 1 + i);
    for (j = 1; j < rings - 1 && j < kept; j++)
        for (i = 0; i < around; i++) {
            int a = south + 1 + (j - 1) * around + i, b = south + 1 + (j - 1) * around + (i + 1) % around;
            add_triangle(a, b, b + around);
            add_triangle(a, b + around, a + around);
        }
    for (i = 0; i < around && kept >= rings; i++)
        add_triangle(positions - 1, positions - 1 - around + i, positions - 1 - around + (i + 1) % around);
}

static void add_torus(double c, double major, double minor, int around, int rings)
{
    const double pi = 3.14159265358979;
    int base = positions, i, j;
    for (j = 0; j < rings; j++)
        for (i = 0; i < around; i++) {
            double r = major + minor * cos(2 * pi * j / rings);
            add_position(c + r * cos(2 * pi * i / around), c + r * sin(2 * pi * i / around), c + minor * sin(2 * pi * j / rings));
        }
    for (j = 0; j < rings; j++)
        for (i = 0; i < around; i++) {
            int a = base + j * around + i, b = base + j * around + (i + 1) % around;
            int d = base + (j + 1) % rings * around + i, e = base + (j + 1) % rings * around + (i + 1) % around;
            add_triangle(a, b, e);
            add_triangle(a, e, d);
        }
}

static double mesh_volume(void)
{
    double v = 0.0;
    int t;
    for (t = 0; t < triangles; t++) {
        const float *a = position + 3 * triangle[3 * t], *b = position + 3 * triangle[3 * t + 1],
                    *c = position + 3 * triangle[3 * t + 2];
        v += (double)a[0] * ((double)b[1] * (double)c[2] - (double)b[2] * (double)c[1])
             + (double)a[1] * ((double)b[2] * (double)c[0] - (double)b[0] * (double)c[2])
             + (double)a[2] * ((double)b[0] * (double)c[1] - (double)b[1] * (double)c[0]);
    }
    return v / 6.0;
}

/* ---- contexts ---- */

static springls_context *ctx;
static springls_mesh_report report;
static char warning[256];

static void keep_warning(void *user, int level, const char *message)
{
    (void)user;
    if (level == 2) snprintf(warning, sizeof warning, "%s", message);
}

static springls_desc cube(int size)
{
    springls_desc desc = fixture_desc(size, NULL);
    desc.logger.log = keep_warning;
    warning[0] = 0;
    return desc;
}

static springls_status set_mesh(const springls_desc *desc)
{
    springls_status status = springls_create(desc, &ctx);
    if (status != SPRINGLS_OK) return status;
    status = springls_set_mesh(ctx, position, positions, 0, triangle, triangles, &report);
    fixture_here(ctx); /* to be looked at */
    return status;
}

static float *level_set(void)
{
    const int *size = ctx->model.grid.size;
    float *phi = (float *)malloc((size_t)size[0] * (size_t)size[1] * (size_t)size[2] * sizeof *phi);
    if (phi && springls_copy_level_set(ctx, phi) != SPRINGLS_OK) { free(phi); phi = NULL; }
    return phi;
}

/* Voxels inside, those at the surface by the share that a plane at distance phi leaves. */
static double inside_volume(const float *phi)
{
    size_t i, n = (size_t)ctx->model.grid.size[0] * (size_t)ctx->model.grid.size[1] * (size_t)ctx->model.grid.size[2];
    double v = 0.0;
    for (i = 0; i < n; i++) {
        double x = 0.5 - (double)phi[i];
        v += x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x;
    }
    return v;
}

/* Largest difference from a sphere's distance, both clamped at `clamp`. */
static double sphere_error(const float *phi, double c, double r, double clamp)
{
    int x, y, z, n = ctx->model.grid.size[0];
    double worst = 0.0;
    for (z = 0; z < n; z++)
        for (y = 0; y < n; y++)
            for (x = 0; x < n; x++) {
                double d = sqrt((x - c) * (x - c) + (y - c) * (y - c) + (z - c) * (z - c)) - r;
                double p = (double)phi[x + n * (y + n * z)];
                d = d > clamp ? clamp : d < -clamp ? -clamp : d;
                p = p > clamp ? clamp : p < -clamp ? -clamp : p;
                if (fabs(p - d) > worst) worst = fabs(p - d);
            }
    return worst;
}

static uint32_t random_state = 1u;
static double random_unit(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (double)(random_state >> 8) / 16777216.0;
}

/* ---- clean meshes ---- */

TEST sphere_is_exact(void)
{
    springls_desc desc = cube(48);
    float *phi;
    int i;
    clear_mesh();
    add_sphere(23.4, 23.4, 23.4, 15.0, 160, 80, 1.0);
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    ASSERT(report.closed && !report.flipped && !report.used_winding);
    ASSERT_EQ(1, report.components);
    ASSERT_EQ(0, report.triangles_dropped);
    ASSERT_IN_RANGE(mesh_volume(), report.volume, 1.0);
    ASSERT_IN_RANGE(4.0 * 3.14159265 * 225.0, report.area, 5.0);
    ASSERT_EQ(triangles, springls_count(ctx));
    for (i = 0; i < triangles; i++) { /* every triangle is there, in order */
        const springls__springl *s = &ctx->model.set.s[i];
        const float *a = position + 3 * triangle[3 * i];
        ASSERT(s->q[0].x == a[0] && s->q[0].y == a[1] && s->q[0].z == a[2]);
        ASSERT(ctx->model.set.a[i].x == s->p.x && ctx->model.set.generation[i] == 0);
    }
    phi = level_set();
    ASSERT(phi != NULL);
    ASSERT_LT(sphere_error(phi, 23.4, 15.0, 3.0), 0.03);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

TEST inside_out_is_turned(void)
{
    springls_desc desc = cube(40);
    float *phi;
    int t;
    clear_mesh();
    add_sphere(20, 20, 20, 12.0, 80, 40, 1.0);
    for (t = 0; t < triangles; t++) turn_triangle(t);
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    ASSERT(report.closed && report.flipped && report.volume < 0.0);
    ASSERT(strstr(warning, "inside out") != NULL);
    ASSERT_GT(springls__dot(springls__springl_normal(ctx->model.set.s[0]),
                            springls__sub(ctx->model.set.s[0].p, springls__v3_make(20, 20, 20))),
              0.0f);
    phi = level_set();
    ASSERT_LT(sphere_error(phi, 20, 12.0, 3.0), 0.06);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

TEST cavity_stays_hollow(void)
{
    springls_desc desc = cube(48);
    float *phi;
    int t, first;
    clear_mesh();
    add_sphere(24, 24, 24, 18.0, 60, 30, 1.0);
    first = triangles;
    add_sphere(24, 24, 24, 9.0, 60, 30, 1.0);
    for (t = first; t < triangles; t++) turn_triangle(t);
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    ASSERT(report.closed && !report.flipped);
    ASSERT_EQ(2, report.components);
    phi = level_set();
    ASSERT_GT(phi[24 + 48 * (24 + 48 * 24)], 0.0f);
    ASSERT_LT(phi[24 + 48 * (24 + 48 * 10)], 0.0f);
    ASSERT_IN_RANGE(mesh_volume(), inside_volume(phi), 0.01 * mesh_volume());
    free(phi);
    springls_destroy(ctx);
    PASS();
}

/* A left-handed direction matrix mirrors: springls still face outwards in voxels. */
TEST mirrored_grid(void)
{
    springls_desc desc = cube(40);
    float *phi;
    desc.grid.direction[0] = -1.0;
    desc.grid.direction[4] = desc.grid.direction[8] = 1.0;
    desc.grid.origin[0] = 39.0;
    clear_mesh();
    add_sphere(19, 20, 20, 12.0, 80, 40, 1.0);
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    ASSERT(report.closed && !report.flipped && report.volume > 0.0);
    ASSERT_GT(springls__dot(springls__springl_normal(ctx->model.set.s[9]),
                            springls__sub(ctx->model.set.s[9].p, springls__v3_make(20, 20, 20))),
              0.0f);
    phi = level_set();
    ASSERT_LT(sphere_error(phi, 20, 12.0, 3.0), 0.06);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

/* A box of twelve triangles, turned about its center by |turn| radians. */
static void add_box(d3 center, d3 half, d3 turn)
{
    static const int face[36] = { 0,2,3, 0,3,1, 4,5,7, 4,7,6, 0,1,5, 0,5,4, 2,6,7, 2,7,3, 0,4,6, 0,6,2, 1,3,7, 1,7,5 };
    int base = positions, i;
    for (i = 0; i < 8; i++) {
        d3 x = d3_add(center, d3_rotate(d3_make(i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z),
                                        turn));
        add_position(x.x, x.y, x.z);
    }
    for (i = 0; i < 12; i++) add_triangle(base + face[3 * i], base + face[3 * i + 1], base + face[3 * i + 2]);
}

/* Big triangles, many voxels each. */
TEST box_of_twelve_triangles(void)
{
    springls_desc desc = cube(40);
    float *phi, half[3] = { 10.25f, 8.0f, 12.5f };
    springls_box box;
    int k, x, y, z;
    double worst = 0.0;
    for (k = 0; k < 3; k++) { box.center[k] = 19.5f; box.half[k] = half[k]; }
    clear_mesh();
    add_box(d3_make(19.5, 19.5, 19.5), d3_make(10.25, 8.0, 12.5), d3_make(0.0, 0.0, 0.0));
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    ASSERT(report.closed && !report.flipped);
    ASSERT_IN_RANGE(8.0 * 10.25 * 8.0 * 12.5, report.volume, 1e-3);
    phi = level_set();
    for (z = 0; z < 40; z++)
        for (y = 0; y < 40; y++)
            for (x = 0; x < 40; x++) {
                float p[3], d, v = phi[x + 40 * (y + 40 * z)];
                p[0] = (float)x; p[1] = (float)y; p[2] = (float)z;
                springls_implicit_box(&box, p, 1, &d);
                if (d > 3.0f) d = 3.0f;
                if (d < -3.0f) d = -3.0f;
                if (v > 3.0f) v = 3.0f;
                if (v < -3.0f) v = -3.0f;
                if (fabs((double)(v - d)) > worst) worst = fabs((double)(v - d));
            }
    ASSERT_LT(worst, 1e-4);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

/* ---- large triangles become several springls ---- */

static d3 corner_of(int i, int m)
{
    const float *q = (const float *)(const void *)((const char *)springls_view_vertices(ctx).data
                                                   + (size_t)i * springls_view_vertices(ctx).stride);
    return d3_make((double)q[3 * m], (double)q[3 * m + 1], (double)q[3 * m + 2]);
}

/* The parts are small, cover their triangles, come in their order, and meet corner to corner. */
TEST large_triangles_are_divided(void)
{
    springls_desc desc = cube(40);
    springls_mesh soup;
    springls_material *places;
    double area = 0.0;
    float *at;
    int *index, i, m, k, count;
    clear_mesh();
    add_box(d3_make(19.4, 19.7, 19.5), d3_make(9.0, 7.0, 7.8), d3_make(0.3, 0.5, 0.2));
    ASSERT_OK(set_mesh(&desc));
    count = springls_count(ctx);
    ASSERT_EQ(count, report.springls);
    ASSERT_IN_RANGE(1900, count, 1100); /* 1500 voxels^2 */
    ASSERT_EQ(12, springls_material_triangle_count(ctx));
    places = (springls_material *)malloc((size_t)count * sizeof *places);
    at = (float *)malloc((size_t)count * 3 * sizeof *at);
    ASSERT_OK(springls_springl_materials(ctx, places));
    ASSERT_OK(springls_interpolate_material(places, count, position, 3, triangle, triangles, at));
    for (i = 0; i < count; i++) {
        d3 a = corner_of(i, 0), b = corner_of(i, 1), c = corner_of(i, 2);
        area += 0.5 * d3_length(d3_cross(d3_sub(b, a), d3_sub(c, a)));
        for (m = 0; m < 3; m++) ASSERT_LTE(d3_distance(corner_of(i, m), corner_of(i, (m + 1) % 3)), 2.0001);
        if (i > 0) ASSERT_GTE(places[i].triangle, places[i - 1].triangle);
        ASSERT_LT(d3_distance(d3_of(ctx->model.set.s[i].p),
                              d3_make((double)at[3 * i], (double)at[3 * i + 1], (double)at[3 * i + 2])), 1e-4);
        ASSERT_EQ(0u, springls_generations(ctx)[i]);
    }
    ASSERT_IN_RANGE(report.area, area, 0.01);
    ASSERT_OK(springls_extract_soup(ctx, &soup)); /* set again, it is closed: every edge has its counterpart */
    index = (int *)malloc(3 * (size_t)count * sizeof *index);
    for (k = 0; k < 3 * count; k++) index[k] = k;
    ASSERT_OK(springls_set_mesh(ctx, soup.positions, 3 * count, 0, index, count, &report));
    ASSERT(report.closed);
    ASSERT_EQ(count, springls_count(ctx));
    springls_mesh_free(ctx, &soup);
    free(index);
    free(places);
    free(at);
    springls_destroy(ctx);
    PASS();
}

/* Cubes on voxel planes that overlap, share a face or are nested make one solid; none of its springls lies inside of it. */
TEST overlapping_cubes_are_one_solid(void)
{
    static const double cases[3][5] = { { 12, 8, 20, 20, 8 }, { 10, 6, 22, 10, 6 }, { 14, 10, 14, 14, 4 } };
    int i, k;
    for (i = 0; i < 3; i++) {
        const double *c = cases[i];
        springls_desc desc = cube(32);
        springls_measures m;
        clear_mesh();
        add_box(d3_make(c[0], c[0], c[0]), d3_make(c[1], c[1], c[1]), d3_make(0, 0, 0));
        add_box(d3_make(c[2], c[3], c[3]), d3_make(c[4], c[4], c[4]), d3_make(0, 0, 0));
        ASSERT_OK(set_mesh(&desc));
        ASSERT_OK(springls_measure(ctx, &m));
        ASSERT_EQ(1, m.components);
        ASSERT_EQ(2, m.euler);
        for (k = 0; k < springls_count(ctx); k++)
            ASSERT_GT(springls__grid_sample(&ctx->model.grid, ctx->model.grid.phi, ctx->model.set.s[k].p), -1.0f);
        springls_destroy(ctx);
    }
    PASS();
}

/* At rest solids whose faces lie on voxel planes stay as they are: the sides of voxels on them do not come and go. */
TEST solids_on_voxel_planes_rest(int second)
{
    static const double cases[4][5] = { { 12, 8, 20, 20, 8 }, { 10, 6, 22, 10, 6 }, { 12, 8, 20, 12, 8 }, { 16, 10, 0, 0, 0 } };
    const double *c = cases[second];
    springls_desc desc = cube(34);
    springls_forces forces = fixture_forces(fixture_wind, (float[3]){ 0 });
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.05f);
    springls_measures set, m;
    int i;
    clear_mesh();
    add_box(d3_make(c[0], c[0], c[0]), d3_make(c[1], c[1], c[1]), d3_make(0, 0, 0));
    if (c[4] > 0.0) add_box(d3_make(c[2], c[3], c[3]), d3_make(c[4], c[4], c[4]), d3_make(0, 0, 0));
    ASSERT_OK(set_mesh(&desc));
    ASSERT_OK(springls_measure(ctx, &set));
    for (i = 0; i < 40; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_measure(ctx, &m));
        ASSERT_EQ(1, m.components);
        ASSERT_EQ(2, m.euler);
        ASSERT_IN_RANGE(set.volume, m.volume, 1e-3 * set.volume);
    }
    springls_destroy(ctx);
    PASS();
}

/* Long thin triangles are divided into as many springls for their area as others, without slivers; they meet corner to corner,
   face alike and cover the bar. */
TEST long_triangles_are_divided_as_strips(void)
{
    static const double lengths[4] = { 16.0, 64.0, 65.3, 128.0 };
    int i, k, turned;
    for (i = 0; i < 8; i++) {
        const double length = lengths[i / 2], widths[2] = { 3.0, 1.6 }, w = widths[i % 2];
        springls_desc desc = cube(16);
        springls_mesh soup;
        double area = 0.0;
        int *index, count;
        desc.grid.size[0] = (int)length + 12;
        clear_mesh();
        turned = i % 3 == 1;
        add_box(d3_make(0.5 * length + 5.3, 7.4, 7.2), d3_make(0.5 * length, 0.5 * w, 0.5 * w),
                d3_make(turned ? 0.4 : 0.0, 0.0, 0.0));
        ASSERT_OK(set_mesh(&desc));
        count = springls_count(ctx);
        ASSERT_GTE(count, report.area);
        ASSERT_LTE(count, 2.7 * report.area);
        for (k = 0; k < count; k++) {
            d3 a = corner_of(k, 0), b = corner_of(k, 1), c = corner_of(k, 2);
            area += 0.5 * d3_length(d3_cross(d3_sub(b, a), d3_sub(c, a)));
        }
        ASSERT_IN_RANGE(report.area, area, 1e-4 * area);
        ASSERT_OK(springls_extract_soup(ctx, &soup));
        index = (int *)malloc(3 * (size_t)count * sizeof *index);
        for (k = 0; k < 3 * count; k++) index[k] = k;
        ASSERT_OK(springls_set_mesh(ctx, soup.positions, 3 * count, 0, index, count, &report));
        ASSERT(report.closed && !report.flipped && report.components == 1);
        ASSERT_EQ(0, report.triangles_dropped);
        springls_mesh_free(ctx, &soup);
        free(index);
        springls_destroy(ctx);
    }
    PASS();
}

/* A turn in 20 steps: without parts the twelve springls lose a third of the volume. */
TEST twelve_triangles_keep_their_volume(void)
{
    springls_rotation_flow turn = { { 19.5f, 19.5f, 19.5f }, { 0.267f, 0.535f, 0.802f }, 1.0f };
    springls_desc desc = cube(40);
    springls_forces forces = fixture_forces(springls_velocity_rotation, &turn);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, (float)(2.0 * fixture_pi / 20.0));
    springls_measures before, after;
    clear_mesh();
    add_box(d3_make(19.4, 19.7, 19.5), d3_make(10.0, 10.0, 10.0), d3_make(0.3, 0.5, 0.2));
    ASSERT_OK(set_mesh(&desc));
    ASSERT_OK(springls_measure(ctx, &before));
    step.max_displacement = 2.0f;
    ASSERT_OK(springls_run(ctx, &step, 20));
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_IN_RANGE(before.volume, after.volume, 0.001 * before.volume);
    ASSERT_EQ(1, after.components);
    ASSERT_EQ(2, after.euler);
    ASSERT_GT(springls_get_stats(ctx).at_edges, 100);
    springls_destroy(ctx);
    PASS();
}

TEST whole_triangles_on_request(void)
{
    springls_params params = springls_default_params();
    springls_desc desc = cube(40);
    params.split_input = 0;
    desc.params = &params;
    clear_mesh();
    add_box(d3_make(19.4, 19.7, 19.5), d3_make(9.0, 7.0, 8.0), d3_make(0.3, 0.5, 0.2));
    ASSERT_OK(set_mesh(&desc));
    ASSERT_EQ(12, springls_count(ctx));
    ASSERT_EQ(12, report.springls);
    springls_destroy(ctx);
    PASS();
}

/* Only what meets the grid is divided, and no more springls are made than there may be. */
TEST huge_triangles_in_a_small_grid(void)
{
    springls_desc desc = cube(16);
    int i;
    clear_mesh();
    add_box(d3_make(-4e5 + 7.3, 7.5, 7.5), d3_make(4e5, 4e5, 4e5), d3_make(0.0, 0.0, 0.0));
    ASSERT_OK(set_mesh(&desc));
    ASSERT_GT(springls_count(ctx), 300);
    ASSERT_LT(springls_count(ctx), 2000);
    for (i = 0; i < springls_count(ctx); i++) { /* exact in spite of the far corners */
        springls__v3 p = ctx->model.set.s[i].p;
        if (p.x > 0.0f && fabs((double)p.y - 7.5) < 8.0 && fabs((double)p.z - 7.5) < 8.0) ASSERT_IN_RANGE(7.3f, p.x, 0.04f);
    }
    springls_destroy(ctx);
    desc.max_springls = 100;
    ASSERT_OK(set_mesh(&desc));
    ASSERT_EQ(100, springls_count(ctx));
    ASSERT_GT(springls_get_stats(ctx).refused, 0);
    springls_destroy(ctx);
    PASS();
}

/* ---- dirty meshes ---- */

TEST open_bowl_is_closed_by_a_film(void)
{
    springls_desc desc = cube(48);
    float *phi;
    clear_mesh();
    add_sphere(24, 24, 24, 15.0, 80, 40, 0.75);
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    ASSERT(!report.closed && report.used_winding && !report.flipped);
    ASSERT_EQ(80, report.boundary_edges);
    ASSERT(strstr(warning, "80 boundary") != NULL);
    phi = level_set();
    ASSERT_LT(phi[24 + 48 * (24 + 48 * 20)], 0.0f);
    ASSERT_LT(phi[24 + 48 * (24 + 48 * 30)], 0.0f);
    ASSERT_GT(phi[24 + 48 * (24 + 48 * 40)], 0.0f);
    ASSERT_GT(phi[24 + 48 * (24 + 48 * 6)], 0.0f);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

/* Springls of the film follow those of the triangles and belong where they are; then nothing is left to fill. */
TEST springls_cover_the_film(void)
{
    springls_desc desc = cube(48);
    int i, lowest = 0, count;
    clear_mesh();
    add_sphere(24, 24, 24, 15.0, 80, 40, 0.75);
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    count = springls_count(ctx);
    ASSERT_GT(count, triangles + 100);
    for (i = triangles; i < count; i++) {
        springls__v3 p = ctx->model.set.s[i].p, a = ctx->model.set.a[i];
        ASSERT(springls__length(springls__sub(p, a)) == 0.0f);
        ASSERT(springls__springl_normal(ctx->model.set.s[i]).z > 0.5f);
        lowest += p.z < 24.0f;
    }
    ASSERT_EQ(0, lowest);
    ASSERT_EQ(0, (int)springls_get_stats(ctx).added);
    ASSERT_EQ(SPRINGLS_OK, springls_fill_gaps(ctx));
    ASSERT_LT(springls_count(ctx) - count, 10);
    springls_destroy(ctx);
    PASS();
}

/* Triangles within `r` of a place are left out. */
static void cut_mesh(float x, float y, float z, float r)
{
    int t, k, n = 0;
    for (t = 0; t < triangles; t++) {
        const float *a = &position[3 * triangle[3 * t]];
        float dx = a[0] - x, dy = a[1] - y, dz = a[2] - z;
        if (dx * dx + dy * dy + dz * dz < r * r) continue;
        for (k = 0; k < 3; k++) triangle[3 * n + k] = triangle[3 * t + k];
        n++;
    }
    triangles = n;
}

/* What is outside stays outside: through a hole no voxel tells another its side. */
TEST holes_do_not_leak(float r)
{
    springls_desc desc = cube(48);
    springls_measures m;
    float *phi;
    int x, y, z;
    clear_mesh();
    add_sphere(24, 24, 24, 15.0, 160, 80, 1.0);
    cut_mesh(39.0f, 24.0f, 24.0f, r);
    cut_mesh(24.0f, 9.0f, 24.0f, r);
    cut_mesh(15.0f, 15.0f, 16.0f, r);
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    ASSERT(!report.closed);
    ASSERT_EQ(SPRINGLS_OK, springls_measure(ctx, &m));
    ASSERT_EQ(1, m.components);
    ASSERT_EQ(2, m.euler);
    phi = level_set();
    for (z = 0; z < 48; z++)
        for (y = 0; y < 48; y++)
            for (x = 0; x < 48; x++) {
                float dx = (float)x - 24.0f, dy = (float)y - 24.0f, dz = (float)z - 24.0f,
                      d = sqrtf(dx * dx + dy * dy + dz * dz) - 15.0f;
                if (d < -0.5f * r - 0.5f) ASSERT_LT(phi[x + 48 * (y + 48 * z)], 0.0f);
                if (d > 0.5f * r + 0.5f) ASSERT_GT(phi[x + 48 * (y + 48 * z)], 0.0f);
            }
    free(phi);
    springls_destroy(ctx);
    PASS();
}

TEST turned_faces_are_repaired(void)
{
    springls_desc desc = cube(40);
    float *phi;
    int t;
    clear_mesh();
    add_sphere(20, 20, 20, 12.0, 80, 40, 1.0);
    for (t = 0; t < triangles; t += 7) turn_triangle(t);
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    ASSERT(!report.closed && report.misoriented_edges > 100 && !report.flipped);
    for (t = 0; t < triangles; t++)
        ASSERT(springls__dot(springls__springl_normal(ctx->model.set.s[t]),
                             springls__sub(ctx->model.set.s[t].p, springls__v3_make(20, 20, 20)))
               > 0.0f);
    phi = level_set();
    ASSERT_LT(sphere_error(phi, 20, 12.0, 3.0), 0.06);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

TEST repeated_faces_and_flat_ones(void)
{
    springls_desc desc = cube(40);
    float *phi;
    int t, n;
    clear_mesh();
    add_sphere(20, 20, 20, 12.0, 80, 40, 1.0);
    n = triangles;
    for (t = 0; t < n; t++) add_triangle(triangle[3 * t], triangle[3 * t + 1], triangle[3 * t + 2]);
    add_triangle(3, 3, 9);
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    ASSERT_EQ(n + 1, report.triangles_dropped);
    ASSERT(report.closed && report.nonmanifold_edges == 0);
    ASSERT_EQ(n, springls_count(ctx));
    phi = level_set();
    ASSERT_LT(sphere_error(phi, 20, 12.0, 3.0), 0.06);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

/* A face of 936 corners among the eight of a box: its triangles lie on each other, and no more springls are made than for as many
   different ones. In a step no place is crowded. */
TEST crowd_of_coincident_faces(void)
{
    springls_desc desc = cube(16);
    springls_step_desc step;
    int i, count, last;
    clear_mesh();
    add_box(d3_make(7.6, 7.4, 7.5), d3_make(2.5, 2.5, 2.5), d3_make(0.1, 0.2, 0.3));
    random_state = 7u;
    triangles = 0;
    for (i = 0, last = 1; i < 934; i++) {
        int next = (int)(8.0 * random_unit());
        add_triangle(0, last, next);
        last = next;
    }
    ASSERT_OK(set_mesh(&desc));
    count = springls_count(ctx);
    ASSERT_GT(report.triangles_dropped, 850); /* of 42 different ones at most */
    ASSERT_LT(count, 42 * 64);
    memset(&step, 0, sizeof step);
    step.dt = 1.0f;
    ASSERT_OK(springls_run(ctx, &step, 6));
    ASSERT_OK(springls_remesh(ctx));
    springls_destroy(ctx);
    PASS();
}

/* One of the faces of a box more often than the others, and turned round: the box is as it was. */
TEST faces_given_again(int turned)
{
    springls_desc desc = cube(24);
    springls_measures m;
    int count, t;
    clear_mesh();
    add_box(d3_make(11.6, 11.4, 11.5), d3_make(6.0, 6.0, 6.0), d3_make(0.1, 0.2, 0.3));
    ASSERT_OK(set_mesh(&desc));
    count = springls_count(ctx);
    springls_destroy(ctx);
    for (t = 0; t < 30; t++) add_triangle(triangle[0], triangle[1], triangle[2]);
    for (t = 0; t < turned; t++) add_triangle(triangle[0], triangle[2], triangle[1]);
    ASSERT_OK(set_mesh(&desc));
    ASSERT_EQ(count, springls_count(ctx));
    ASSERT_EQ(30 + turned, report.triangles_dropped);
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(1, m.components);
    ASSERT_EQ(2, m.euler);
    ASSERT_IN_RANGE(12.0 * 12.0 * 12.0, m.volume, 45.0);
    springls_destroy(ctx);
    PASS();
}

/* A triangle soup: equal points are one. */
TEST soup_is_welded(void)
{
    static float soup[3 * 3 * 20000];
    static int index[3 * 20000];
    springls_desc desc = cube(40);
    int i, k;
    clear_mesh();
    add_sphere(20, 20, 20, 12.0, 40, 20, 1.0);
    for (i = 0; i < 3 * triangles; i++) {
        index[i] = i;
        for (k = 0; k < 3; k++) soup[3 * i + k] = position[3 * triangle[i] + k];
    }
    ASSERT_EQ(SPRINGLS_OK, springls_create(&desc, &ctx));
    ASSERT_EQ(SPRINGLS_OK, springls_set_mesh(ctx, soup, 3 * triangles, 12, index, triangles, &report));
    ASSERT(report.closed);
    ASSERT_EQ(1, report.components);
    springls_destroy(ctx);
    PASS();
}

TEST strided_positions(void)
{
    static float wide[5 * 5000];
    springls_desc desc = cube(40);
    int i, k;
    clear_mesh();
    add_sphere(20, 20, 20, 12.0, 40, 20, 1.0);
    for (i = 0; i < positions; i++) {
        for (k = 0; k < 3; k++) wide[5 * i + k] = position[3 * i + k];
        wide[5 * i + 3] = wide[5 * i + 4] = NAN;
    }
    wide[5 * positions] = NAN; /* an unused position may be anything */
    ASSERT_EQ(SPRINGLS_OK, springls_create(&desc, &ctx));
    ASSERT_EQ(SPRINGLS_OK, springls_set_mesh(ctx, wide, positions + 1, 20, triangle, triangles, &report));
    ASSERT(report.closed);
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, springls_set_mesh(ctx, wide, positions, 10, triangle, triangles, NULL));
    ASSERT_EQ(report.springls, springls_count(ctx)); /* bad input leaves the model */
    springls_destroy(ctx);
    PASS();
}

/* A sheet of n x n squares at height z, bent by `bend` voxels, up or down. */
static void add_sheet(double z, double bend, bool up)
{
    const int n = 6;
    int base = positions, i, j;
    for (j = 0; j <= n; j++)
        for (i = 0; i <= n; i++)
            add_position(8.0 + 2.5 * i, 8.0 + 2.5 * j, z + bend * sin(fixture_pi * i / n) * sin(fixture_pi * j / n));
    for (j = 0; j < n; j++)
        for (i = 0; i < n; i++) {
            int a = base + i + (n + 1) * j, b = a + 1, c = a + n + 1, d = c + 1;
            add_triangle(a, up ? b : d, up ? d : b);
            add_triangle(a, up ? d : c, up ? c : d);
        }
}

/* Without an inside there is no solid: a flat patch, open or doubled. A bent one has a film, and a thin plate has two sides. */
TEST what_has_no_inside_is_refused(void)
{
    springls_desc desc = cube(32);
    double z;
    int doubled;
    for (doubled = 0; doubled < 2; doubled++)
        for (z = 15.0; z < 16.0; z += 0.25) {
            clear_mesh();
            add_sheet(z, 0.0, true);
            if (doubled) add_sheet(z, 0.0, false);
            ASSERT_STATUS(SPRINGLS_BAD_MESH, set_mesh(&desc));
            ASSERT(strstr(springls_last_error(ctx), "no inside") != NULL);
            ASSERT_EQ(0, springls_count(ctx));
            springls_destroy(ctx);
        }
    clear_mesh();
    add_sheet(15.3, 4.0, true);
    ASSERT_OK(set_mesh(&desc));
    springls_destroy(ctx);
    clear_mesh();
    add_box(d3_make(15.4, 15.4, 15.3), d3_make(8.0, 8.0, 0.1), d3_make(0.2, 0.1, 0.0));
    ASSERT_OK(set_mesh(&desc));
    springls_destroy(ctx);
    PASS();
}

TEST bad_input_is_refused(void)
{
    static const float point[12] = { 1, 1, 1, 9, 1, 1, 1, 9, 1, 5, 1, 1 };
    static const int good[3] = { 0, 1, 2 }, high[3] = { 0, 1, 4 }, low[3] = { 0, -1, 2 }, flat[3] = { 0, 1, 3 };
    float bad[12];
    springls_desc desc = cube(16);
    ASSERT_EQ(SPRINGLS_OK, springls_create(&desc, &ctx));
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, springls_set_mesh(NULL, point, 4, 0, good, 1, NULL));
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, springls_set_mesh(ctx, NULL, 4, 0, good, 1, NULL));
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, springls_set_mesh(ctx, point, 4, 0, NULL, 1, NULL));
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, springls_set_mesh(ctx, point, -1, 0, good, 1, NULL));
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, springls_set_mesh(ctx, point, 4, 0, good, INT32_MAX, NULL));
    ASSERT_EQ(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, point, 4, 0, good, 0, NULL));
    ASSERT_EQ(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, point, 4, 0, high, 1, NULL));
    ASSERT_EQ(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, point, 4, 0, low, 1, NULL));
    ASSERT_EQ(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, point, 4, 0, flat, 1, NULL));
    memcpy(bad, point, sizeof bad);
    bad[4] = NAN;
    ASSERT_EQ(SPRINGLS_NON_FINITE, springls_set_mesh(ctx, bad, 4, 0, good, 1, NULL));
    bad[4] = 1e38f;
    ASSERT_EQ(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, bad, 4, 0, good, 1, NULL));
    ASSERT(strstr(springls_last_error(ctx), "million") != NULL);
    ASSERT_EQ(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, point, 4, 0, good, 1, NULL)); /* a single triangle is no solid */
    ASSERT(strstr(springls_last_error(ctx), "no inside") != NULL);
    ASSERT_EQ(0, springls_count(ctx));
    clear_mesh();
    add_sphere(100, 8, 8, 5, 20, 10, 1.0);
    ASSERT_EQ(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, position, positions, 0, triangle, triangles, NULL));
    ASSERT(strstr(springls_last_error(ctx), "outside") != NULL);
    clear_mesh();
    add_sphere(15, 8, 8, 5, 20, 10, 1.0);
    ASSERT_EQ(SPRINGLS_OK, springls_set_mesh(ctx, position, positions, 0, triangle, triangles, NULL));
    ASSERT(strstr(warning, "beyond the grid") != NULL);
    springls_destroy(ctx);
    PASS();
}

/* ---- signs against an independent count of crossings ---- */

static int crossings(double x, double y, double z) /* upwards, odd: inside */
{
    int t, n = 0;
    for (t = 0; t < triangles; t++) {
        double p[3][3], u, v, w, det;
        int i, k;
        for (i = 0; i < 3; i++)
            for (k = 0; k < 3; k++) p[i][k] = (double)position[3 * triangle[3 * t + i] + k] - (k == 0 ? x : k == 1 ? y : z);
        u = p[1][0] * p[2][1] - p[1][1] * p[2][0];
        v = p[2][0] * p[0][1] - p[2][1] * p[0][0];
        w = p[0][0] * p[1][1] - p[0][1] * p[1][0];
        if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) continue;
        det = u + v + w;
        if (det != 0 && (u * p[0][2] + v * p[1][2] + w * p[2][2]) / det > 0) n++;
    }
    return n;
}

TEST signs_agree_with_parity(void)
{
    springls_desc desc = cube(64);
    springls__surface *surface;
    float worst = 0.0f;
    int i;
    clear_mesh();
    add_torus(31.5, 18.0, 7.0, 90, 40);
    add_sphere(31.5, 31.5, 31.5, 6.0, 30, 15, 1.0);
    ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
    ASSERT(report.closed);
    surface = &ctx->original;
    ASSERT_EQ(SPRINGLS_OK, springls__surface_make_dipoles(ctx, surface));
    for (i = 0; i < 2000; i++) {
        double x = 63 * random_unit() + 1e-4, y = 63 * random_unit() + 2e-4, z = 15.0 + 33.0 * random_unit();
        float w = springls__surface_winding(surface, springls__v3_make((float)x, (float)y, (float)z), 2.0f), error;
        int inside = crossings((double)(float)x, (double)(float)y, (double)(float)z) & 1;
        error = springls__fabs(w - (float)inside);
        worst = springls__max(worst, error);
    }
    ASSERT_LT(worst, 0.2f);
    springls_destroy(ctx);
    PASS();
}

/* ---- the same bits however the work is cut ---- */

static void backwards(void *user, int count, int grain, springls_task task, void *arg)
{
    int end = count, piece = *(int *)user * grain;
    while (end > 0) {
        int begin = end > piece ? end - piece : 0;
        task(arg, begin, end);
        end = begin;
    }
}

TEST same_bits_however_cut(void)
{
    springls_desc desc = cube(48);
    float *first = NULL, *phi;
    int piece, open;
    for (open = 0; open < 2; open++) {
        clear_mesh();
        add_sphere(24, 24, 24, 15.0, 50, 25, open ? 0.8 : 1.0);
        for (piece = 0; piece < 4; piece++) {
            desc.tasks.parallel_for = piece ? backwards : NULL;
            desc.tasks.user = &piece;
            ASSERT_EQ(SPRINGLS_OK, set_mesh(&desc));
            phi = level_set();
            if (piece) {
                ASSERT_MEM_EQ(first, phi, 48 * 48 * 48 * sizeof *phi);
                free(phi);
            } else first = phi;
            springls_destroy(ctx);
        }
        free(first);
    }
    PASS();
}

/* ---- files ---- */

static int read_off(FILE *file)
{
    char line[512];
    int stage = 0, v = 0, f = 0, i, n;
    while (fgets(line, sizeof line, file)) {
        char *at = line;
        if (line[0] == '#' || line[0] == '\n' || line[0] == '\r') continue;
        if (stage == 0) { stage = 1; if (!strncmp(line, "OFF", 3)) continue; }
        if (stage == 1) {
            if (sscanf(line, "%d %d", &v, &f) != 2 || v <= 0 || v > MAX_POSITIONS) return 0;
            stage = 2;
        } else if (positions < v) {
            double x = strtod(at, &at), y = strtod(at, &at), z = strtod(at, &at);
            add_position(x, y, z);
        } else if (f-- > 0) {
            int corner[3] = { 0, 0, 0 };
            n = (int)strtol(at, &at, 10);
            for (i = 0; i < n; i++) {
                corner[i < 2 ? i : 2] = (int)strtol(at, &at, 10);
                if (i >= 2) { add_triangle(corner[0], corner[1], corner[2]); corner[1] = corner[2]; }
            }
        }
    }
    return triangles > 0;
}

static int read_obj(FILE *file)
{
    char line[512];
    while (fgets(line, sizeof line, file)) {
        char *at = line + 2;
        if (line[0] == 'v' && line[1] == ' ') {
            double x = strtod(at, &at), y = strtod(at, &at), z = strtod(at, &at);
            if (positions < MAX_POSITIONS) add_position(x, y, z);
        } else if (line[0] == 'f' && line[1] == ' ') {
            int corner[3] = { 0, 0, 0 }, i = 0;
            for (;;) {
                char *end;
                long index = strtol(at, &end, 10);
                if (end == at) break;
                at = end;
                while (*at && *at != ' ' && *at != '\n') at++;
                corner[i < 2 ? i : 2] = (int)index - 1;
                if (i >= 2 && triangles < MAX_TRIANGLES) { add_triangle(corner[0], corner[1], corner[2]); corner[1] = corner[2]; }
                i++;
            }
        }
    }
    return triangles > 0;
}

/* Into the middle of a grid of n voxels a side. */
static void fit_to(int n)
{
    double lower[3], upper[3], size = 0.0;
    int i, k;
    for (k = 0; k < 3; k++) { lower[k] = 1e30; upper[k] = -1e30; }
    for (i = 0; i < 3 * positions; i++) {
        if ((double)position[i] < lower[i % 3]) lower[i % 3] = (double)position[i];
        if ((double)position[i] > upper[i % 3]) upper[i % 3] = (double)position[i];
    }
    for (k = 0; k < 3; k++)
        if (upper[k] - lower[k] > size) size = upper[k] - lower[k];
    for (i = 0; i < 3 * positions; i++)
        position[i] = (float)(((double)position[i] - 0.5 * (lower[i % 3] + upper[i % 3])) / size * (n - 10) + 0.5 * (n - 1));
}

TEST mesh_files(void)
{
    static const char *const names[] = {
        "armadillo.off",           "beetle.obj", "bones.off",          "bull.off",  "cow.obj",
        "elephant-with-holes.off", "femur.off",  "knot1.off",          "man.off",   "mech-holes-shark.off",
        "rocker-arm.obj",          "spot.obj",   "stanford-bunny.obj", "teapot.obj"};
    const char *data = getenv("SPRINGLS_DATA");
    size_t i, read = 0;
    if (!data || !data[0]) SKIPm("SPRINGLS_DATA is not set");
    for (i = 0; i < sizeof names / sizeof *names; i++) {
        springls_desc desc = cube(96);
        char path[1024];
        FILE *file;
        float *phi;
        double volume, expected;
        int ok;
        snprintf(path, sizeof path, "%s/meshes/%s", data, names[i]);
        file = fopen(path, "r");
        if (!file) continue;
        clear_mesh();
        ok = strstr(names[i], ".off") ? read_off(file) : read_obj(file);
        fclose(file);
        ASSERTm(names[i], ok);
        read++;
        fit_to(96);
        ASSERT_EQm(names[i], SPRINGLS_OK, set_mesh(&desc));
        phi = level_set();
        volume = inside_volume(phi);
        expected = fabs(report.volume);
        if (GREATEST_IS_VERBOSE())
            printf("%-24s %6d triangles, %s, %d boundary %d non-manifold %d misoriented, %d components, volume %.0f, inside %.0f\n",
                   names[i], triangles, report.closed ? "closed" : "open", report.boundary_edges, report.nonmanifold_edges,
                   report.misoriented_edges, report.components, expected, volume);
        /* overlapping parts count twice in the mesh's volume */
        if (report.closed && report.components == 1) ASSERT_IN_RANGEm(names[i], expected, volume, 0.01 * expected);
        free(phi);
        springls_destroy(ctx);
    }
    if (!read) SKIPm("no meshes there");
    PASS();
}

SUITE(clean)
{
    RUN_TEST(sphere_is_exact);
    RUN_TEST(inside_out_is_turned);
    RUN_TEST(cavity_stays_hollow);
    RUN_TEST(mirrored_grid);
    RUN_TEST(box_of_twelve_triangles);
    RUN_TEST(large_triangles_are_divided);
    RUN_TEST(long_triangles_are_divided_as_strips);
    RUN_TEST(overlapping_cubes_are_one_solid);
    RUN_TESTp(solids_on_voxel_planes_rest, 0);
    RUN_TESTp(solids_on_voxel_planes_rest, 1);
    RUN_TESTp(solids_on_voxel_planes_rest, 2);
    RUN_TESTp(solids_on_voxel_planes_rest, 3);
    RUN_TEST(twelve_triangles_keep_their_volume);
    RUN_TEST(whole_triangles_on_request);
    RUN_TEST(huge_triangles_in_a_small_grid);
}

SUITE(dirty)
{
    RUN_TEST(open_bowl_is_closed_by_a_film);
    RUN_TEST(springls_cover_the_film);
    RUN_TESTp(holes_do_not_leak, 1.5f);
    RUN_TESTp(holes_do_not_leak, 3.0f);
    RUN_TEST(turned_faces_are_repaired);
    RUN_TEST(repeated_faces_and_flat_ones);
    RUN_TEST(crowd_of_coincident_faces);
    RUN_TESTp(faces_given_again, 0);
    RUN_TESTp(faces_given_again, 30);
    RUN_TEST(soup_is_welded);
    RUN_TEST(strided_positions);
    RUN_TEST(what_has_no_inside_is_refused);
    RUN_TEST(bad_input_is_refused);
}

SUITE(signs)
{
    RUN_TEST(signs_agree_with_parity);
    RUN_TEST(same_bits_however_cut);
    RUN_TEST(mesh_files);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(clean);
    RUN_SUITE(dirty);
    RUN_SUITE(signs);
    GREATEST_MAIN_END();
}
