/* test_set_mesh.c - clean meshes into springls and a level set. */
#include "fixtures.h"
#include "../../src/model/mesh_distance.h"
#include "set_mesh.h"

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
    struct exact_flow turn = EXACT_ROTATION(19.5f, 19.5f, 19.5f, 0.267f, 0.535f, 0.802f, 1.0f);
    springls_desc desc = cube(40);
    springls_forces forces = fixture_forces(exact_flow_velocity, &turn);
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

/* Of triangles far below a voxel, few springls are made. They lie on the surface and come from places of it, and phi is what it is. */
TEST tiny_triangles_are_thinned_out(void)
{
    springls_desc desc = cube(24);
    const double c = 11.4, r = 5.0;
    springls_material *materials;
    float *phi;
    int i;
    clear_mesh();
    add_sphere(c, c, c, r, 500, 250, 1.0);
    ASSERT_OK(set_mesh(&desc));
    ASSERT_EQ(0, report.triangles_dropped);
    ASSERT_EQ(report.springls, springls_count(ctx));
    ASSERT_LT(report.springls, triangles / 8);
    ASSERT_GT(report.springls, (int)(4.0 * 3.14159 * r * r * 8.0)); /* eight a voxel^2 and more */
    materials = (springls_material *)malloc((size_t)report.springls * sizeof *materials);
    ASSERT(materials != NULL);
    ASSERT_OK(springls_springl_materials(ctx, materials));
    for (i = 0; i < report.springls; i++) {
        const springls__v3 center = springls__v3_make((float)c, (float)c, (float)c), a = ctx->model.set.a[i];
        ASSERT_IN_RANGE(r, springls__length(springls__sub(ctx->model.set.s[i].p, center)), 0.01);
        ASSERT_IN_RANGE(r, springls__length(springls__sub(a, center)), 1e-3);
        ASSERT_LT(springls__length(springls__sub(a, ctx->model.set.s[i].p)), 0.01f);
        ASSERT(materials[i].triangle >= 0 && materials[i].triangle < triangles);
    }
    free(materials);
    phi = level_set();
    ASSERT(phi != NULL);
    ASSERT_LT(sphere_error(phi, c, r, 2.5), 0.03);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

/* Two sheets of tiny triangles closer than the cells in which they are thinned out stay two. */
TEST tiny_triangles_of_thin_plates_stay_apart(void)
{
    enum { SIDE = 80 };
    springls_params params = springls_default_params();
    springls_desc desc = cube(24);
    int sheet, i, j, front = 0, back = 0;
    clear_mesh();
    for (sheet = 0; sheet < 2; sheet++)
        for (i = 0; i <= SIDE; i++)
            for (j = 0; j <= SIDE; j++) {
                const bool rim = i == 0 || j == 0 || i == SIDE || j == SIDE;
                add_position(7.3 + 0.1 * i, 7.4 + 0.1 * j, 11.1 + (rim ? 0.0 : 0.06 * sheet));
            }
    for (sheet = 0; sheet < 2; sheet++)
        for (i = 0; i < SIDE; i++)
            for (j = 0; j < SIDE; j++) {
                const int a = sheet * (SIDE + 1) * (SIDE + 1) + i * (SIDE + 1) + j, b = a + 1, d = a + SIDE + 1;
                add_triangle(a, sheet ? d : b, sheet ? b : d);
                add_triangle(b, sheet ? d : d + 1, sheet ? d + 1 : d);
            }
    params.contouring = SPRINGLS_CONTOURING_SPRINGLS;
    desc.params = &params;
    ASSERT_OK(set_mesh(&desc));
    ASSERT_LT(report.springls, triangles / 2);
    for (i = 0; i < report.springls; i++) {
        const float z = springls__springl_normal(ctx->model.set.s[i]).z;
        front += z > 0.9f;
        back += z < -0.9f;
    }
    ASSERT_GT(front, 500);
    ASSERT_GT(back, 500);
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

/* ---- open meshes ---- */

/* Adds an open cup, or one that is inside out. */
static void add_cup(double x, double y, double z, double r, double share, bool inverted)
{
    const int first = triangles;
    int t;
    add_sphere(x, y, z, r, 24, 12, share);
    for (t = first; t < triangles && inverted; t++) turn_triangle(t);
}

/* Makes a surface of the mesh as it is. */
static springls_status mesh_surface(springls_context *of, springls__surface *surface)
{
    springls__springl *s = (springls__springl *)calloc((size_t)triangles, sizeof *s);
    springls_status status;
    int i;
    for (i = 0; i < 3 * triangles; i++) s[i / 3].q[i % 3] = springls__load3(position + 3 * triangle[i]);
    memset(surface, 0, sizeof *surface);
    status = springls__surface_build(of, surface, s, triangles);
    free(s);
    return status == SPRINGLS_OK ? springls__surface_make_dipoles(of, surface) : status;
}

/* Open meshes that overlap themselves, or are inside out, wind around places any number of times. Voxels have the side of single places,
   also where that of a whole block is decided at once; `winding` is one that is there, so that the case is what it is meant to be. */
TEST voxels_have_the_sides_of_places(float winding)
{
    const float band = 4.0f, at_once = band + 0.1f;
    const int bricks = 6;
    springls_desc desc = cube(8);
    springls__surface surface;
    springls__mesh_distance m;
    float nearest = 1.0f;
    int b, i, far_away = 0;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(mesh_surface(ctx, &surface));
    m.surface = m.nearest = &surface;
    m.balanced = false;
    m.band = band;
    for (b = 0; b < bricks * bricks * bricks; b += 5) { /* saves time */
        springls__v3 x[SPRINGLS__BRICK_VOXELS];
        float out[SPRINGLS__BRICK_VOXELS];
        for (i = 0; i < SPRINGLS__BRICK_VOXELS; i++)
            x[i] = springls__v3_make((float)(b % bricks * 8 + i % 8), (float)(b / bricks % bricks * 8 + i / 8 % 8),
                                     (float)(b / bricks / bricks * 8 + i / 64));
        springls__mesh_signed_distance(&m, x, SPRINGLS__BRICK_VOXELS, out);
        for (i = b % 11; i < SPRINGLS__BRICK_VOXELS; i += 11) {
            const float w = springls__surface_winding(&surface, x[i], 8.0f), side = springls__open_side_of_winding(w);
            nearest = springls__min(nearest, springls__fabs(w - winding));
            if (springls__fabs(out[i]) == at_once) {
                ASSERT_IN_RANGE(side, out[i] / at_once, 0.02f);
                far_away++;
            } else {
                const springls__surface_hit h = springls__surface_closest(&surface, x[i], band + 3.0f);
                const float d = h.triangle < 0 ? band + 3.0f : springls__sqrt(h.hit.d2);
                ASSERT_IN_RANGE(side * d, out[i], 0.15f * d);
            }
        }
    }
    ASSERT_LT(nearest, 0.05f);
    ASSERT_GT(far_away, 50);
    springls__surface_free(ctx, &surface);
    springls_destroy(ctx);
    PASS();
}

TEST open_meshes_that_are_no_solids(void)
{
    int second;
    clear_mesh(); /* a cup within a cup */
    add_cup(24.2, 24.3, 24.1, 21.0, 0.8, false);
    add_cup(24.2, 24.3, 24.1, 13.0, 0.8, false);
    CHECK_CALL(voxels_have_the_sides_of_places(1.9f));
    clear_mesh(); /* inside out */
    add_cup(24.2, 24.3, 24.1, 20.0, 0.8, true);
    CHECK_CALL(voxels_have_the_sides_of_places(-0.9f));
    clear_mesh(); /* one within the other, and inside out */
    add_cup(24.2, 24.3, 24.1, 21.0, 0.8, false);
    add_cup(24.2, 24.3, 24.1, 13.0, 0.5, true);
    CHECK_CALL(voxels_have_the_sides_of_places(0.5f));
    for (second = 0; second < 2; second++) { /* one above the other, of opposite orientation: between them the winding number crosses 0 */
        clear_mesh();
        add_cup(24.2, 24.3, 4.0 + second, 14.0, 0.5, false);
        add_cup(24.2, 24.3, 36.0 + second, 14.0 - 2.0 * second, 0.7, true);
        CHECK_CALL(voxels_have_the_sides_of_places(0.0f));
    }
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
    RUN_TEST(tiny_triangles_are_thinned_out);
    RUN_TEST(tiny_triangles_of_thin_plates_stay_apart);
    RUN_TEST(huge_triangles_in_a_small_grid);
    RUN_TEST(open_meshes_that_are_no_solids);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(clean);
    GREATEST_MAIN_END();
}
