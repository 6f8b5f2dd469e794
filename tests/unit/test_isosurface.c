/* test_isosurface.c - the watertight mesh of the zero level, the soup and the surfels against exact shapes, in voxels and in
   a world that is scaled, turned and mirrored. */
#include "fixtures.h"

GREATEST_MAIN_DEFS();

enum { SPHERE, TORUS, BOX, CUT_SPHERE, SHAPES };
static const int size = 32;

static springls_context *make(int shape)
{
    return fixture_of_zero_level(shape == SPHERE  ? fixture_sphere(size, NULL, 15.5f, 15.3f, 15.1f, 8.0f)
                                 : shape == TORUS ? fixture_torus(size, NULL, 9.0f, 4.0f)
                                 : shape == BOX   ? fixture_box(size, NULL, 7.3f)
                                                  : fixture_sphere(size, NULL, 2.0f, 15.5f, 29.0f, 8.0f));
}

static d3 at(const float *values, int i)
{
    return d3_make((double)values[3 * i], (double)values[3 * i + 1], (double)values[3 * i + 2]);
}

/* Distance from the shape, negative inside, and its direction. The smallest radius of curvature is 8 or 4. */
static double exact(int shape, d3 x, d3 *normal)
{
    d3 c = shape == SPHERE ? d3_make(15.5, 15.3, 15.1) : d3_make(2.0, 15.5, 29.0);
    if (shape == TORUS) {
        double ring = hypot(x.x - 15.5, x.y - 15.5);
        c = d3_make(15.5 + 9.0 * (x.x - 15.5) / ring, 15.5 + 9.0 * (x.y - 15.5) / ring, 15.5);
    }
    *normal = d3_scale(d3_sub(x, c), 1.0 / d3_distance(x, c));
    return d3_distance(x, c) - (shape == TORUS ? 4.0 : 8.0);
}

/* Welded, closed, oriented: every edge lies between exactly two triangles that run opposite ways along it, and every vertex
   belongs to a triangle. */
TEST mesh_is_watertight(int shape)
{
    static const int euler[SHAPES] = { 2, 0, 2, 2 };
    springls_context *ctx = make(shape);
    springls_mesh mesh;
    springls_measures measures;
    springls__mesh_report report;
    uint8_t *used;
    int i;
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    ASSERT_GT(mesh.triangle_count, 500);
    used = (uint8_t *)calloc((size_t)mesh.vertex_count, 1);
    for (i = 0; i < 3 * mesh.triangle_count; i++) {
        ASSERT(mesh.triangles[i] >= 0 && mesh.triangles[i] < mesh.vertex_count);
        used[mesh.triangles[i]] = 1;
    }
    for (i = 0; i < mesh.vertex_count; i++) ASSERT(used[i]);
    report = fixture_report(&mesh);
    ASSERT_EQ(0, report.boundary_edges);
    ASSERT_EQ(0, report.nonmanifold_edges);
    ASSERT_EQ(0, report.misoriented_edges);
    ASSERT_EQ(1, report.components);
    ASSERT_EQ(euler[shape], report.euler);
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_IN_RANGE(report.volume, measures.volume, 1e-3);
    ASSERT_IN_RANGE(report.area, measures.area, 1e-3);
    ASSERT_EQ(report.euler, measures.euler);
    ASSERT_GT(report.volume, 0.0); /* counter-clockwise from outside */
    free(used);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* Vertices stand off a surface of curvature radius r by at most 1 / (8 r), the error of linear interpolation of its distance
   over a voxel; facets, of edges up to sqrt(3), cut 3 / (8 r) deep. */
TEST mesh_is_the_shape(int shape)
{
    const double r = shape == TORUS ? 4.0 : 8.0;
    springls_context *ctx = make(shape);
    springls_mesh mesh;
    springls_measures measures;
    d3 n;
    int i;
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    for (i = 0; i < mesh.vertex_count; i++) {
        d3 x = at(mesh.positions, i), normal = at(mesh.normals, i);
        int closing = shape == CUT_SPHERE && (x.x < 0.5 || x.z > 30.5); /* the closing surface and its edge */
        ASSERT_IN_RANGE(1.0, d3_length(normal), 1e-5);
        ASSERT_IN_RANGE(15.5, x.x, 16.0);
        ASSERT_IN_RANGE(15.5, x.z, 16.0);
        if (closing) continue;
        ASSERT_IN_RANGE(0.0, exact(shape, x, &n), 1.0 / (8.0 * r) + 1e-4);
        ASSERT_GT(d3_dot(n, normal), cos(1.0 / (2.0 * r))); /* the normal turns by as much over half a voxel */
    }
    ASSERT_OK(springls_measure(ctx, &measures));
    if (shape == SPHERE) {
        const double area = 4.0 * fixture_pi * 64.0, cut = 3.0 / 64.0;
        ASSERT_IN_RANGE(area * 8.0 / 3.0, measures.volume, area * cut);
        ASSERT_IN_RANGE(area, measures.area, area * 2.0 * cut / 8.0);
        ASSERT_IN_RANGE(7.5, measures.lower[0], 0.1);
        ASSERT_IN_RANGE(23.1, measures.upper[2], 0.1);
    }
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* A surface that the border cuts is closed half a voxel beyond the last centres, by faces that look out of the domain. */
TEST border_is_closed(void)
{
    springls_context *ctx = make(CUT_SPHERE);
    springls_mesh mesh;
    int i, closing = 0;
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    for (i = 0; i < mesh.vertex_count; i++) {
        d3 x = at(mesh.positions, i);
        if (x.x > -0.499 || d3_distance(x, d3_make(-0.5, 15.5, 29.0)) > 6.0 || x.z > 30.0) continue;
        ASSERT_LT((double)mesh.normals[3 * i], -0.99);
        closing++;
    }
    ASSERT_GT(closing, 20);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* Each vertex has its nearest springl, as looking at all of them finds it, and its correspondence: at first, and after
   the model has moved away. Where there are no springls it has none and is its own correspondence. */
TEST vertices_have_springl_and_correspondence(void)
{
    springls_context *ctx = fixture_of_zero_level(fixture_sphere(size, NULL, 12.5f, 15.5f, 15.5f, 8.0f));
    float wind[3] = { 3.0f, 1.0f, -0.5f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_ELASTIC, 1.0f);
    springls_mesh mesh;
    uint8_t *keep;
    int i, moved, bare = 0;
    step.one_to_one = true;
    for (moved = 0; moved < 2; moved++) {
        d3 back = moved ? d3_make(3.0, 1.0, -0.5) : d3_make(0.0, 0.0, 0.0);
        if (moved) ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_extract_mesh(ctx, &mesh));
        for (i = 0; i < mesh.vertex_count; i++) {
            d3 x = at(mesh.positions, i);
            ASSERT_LT(d3_distance(d3_sub(x, back), at(mesh.correspondences, i)), 0.1);
            if (i % 7) continue;
            ASSERT(mesh.springls[i] >= 0 && mesh.springls[i] < springls_count(ctx));
            {
                fixture_springl s = fixture_get(ctx, mesh.springls[i]);
                d3 t[3];
                t[0] = d3_of(s.q[0]);
                t[1] = d3_of(s.q[1]);
                t[2] = d3_of(s.q[2]);
                ASSERT_IN_RANGE(fixture_distance(ctx, x), d3_triangle_distance(t, x), 1e-4);
            }
        }
        springls_mesh_free(ctx, &mesh);
    }
    keep = (uint8_t *)malloc((size_t)springls_count(ctx));
    for (i = 0; i < springls_count(ctx); i++) keep[i] = fixture_particle(ctx, i).z < 15.0f;
    fixture_keep(ctx, keep);
    free(keep);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    for (i = 0; i < mesh.vertex_count; i++) {
        d3 x = at(mesh.positions, i);
        ASSERT_EQ(fixture_distance(ctx, x) < 1.0, mesh.springls[i] >= 0);
        if (mesh.springls[i] >= 0) continue;
        ASSERT_EQ(0.0, d3_distance(x, at(mesh.correspondences, i)));
        bare++;
    }
    ASSERT_GT(bare, 100);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* The grid in a world: voxels of 0.5 x 2 x 1.25 or of 0.7, turned by 30 degrees about z; mirror: the first axis runs the
   other way. */
static springls_desc world(int uniform, int mirror)
{
    springls_desc desc = fixture_desc(size, NULL);
    const double c = cos(fixture_pi / 6.0), s = sin(fixture_pi / 6.0), m = mirror ? -1.0 : 1.0;
    const double direction[9] = { m * c, -s, 0.0, m * s, c, 0.0, 0.0, 0.0, 1.0 };
    desc.grid.spacing[0] = uniform ? 0.7 : 0.5;
    desc.grid.spacing[1] = uniform ? 0.7 : 2.0;
    desc.grid.spacing[2] = uniform ? 0.7 : 1.25;
    desc.grid.origin[0] = -20.0;
    desc.grid.origin[1] = 3.0;
    desc.grid.origin[2] = 100.0;
    memcpy(desc.grid.direction, direction, sizeof direction);
    return desc;
}

/* A sphere of the world, whatever the voxels: vertices on it, normals along its radii, triangles counter-clockwise. */
TEST mesh_is_in_the_world(int uniform, int mirror)
{
    springls_desc desc = world(uniform, mirror);
    const float middle[3] = { 15.5f, 15.5f, 15.5f };
    const double radius = uniform ? 5.6 : 6.0, coarse = uniform ? 0.7 : 2.0;
    springls_sphere sphere;
    springls_context *ctx;
    springls_mesh mesh;
    springls__mesh_report report;
    d3 center;
    int i;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT(fixture_of_zero_level(ctx) != NULL);
    springls_to_world(ctx, middle, 1, sphere.center);
    sphere.radius = (float)radius;
    center = at(sphere.center, 0);
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &sphere));
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    report = fixture_report(&mesh);
    ASSERT_EQ(0, report.boundary_edges);
    ASSERT_EQ(2, report.euler);
    ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * pow(radius, 3.0), report.volume,
                    4.0 * fixture_pi * radius * radius * 3.0 * coarse * coarse / (8.0 * radius));
    for (i = 0; i < mesh.vertex_count; i++) {
        d3 out = d3_sub(at(mesh.positions, i), center);
        ASSERT_IN_RANGE(radius, d3_length(out), coarse * coarse / (8.0 * radius) + 1e-3);
        ASSERT_IN_RANGE(1.0, d3_length(at(mesh.normals, i)), 1e-5);
        ASSERT_GT(d3_dot(out, at(mesh.normals, i)) / d3_length(out), cos(coarse / (2.0 * radius)));
        ASSERT_LT(d3_distance(at(mesh.positions, i), at(mesh.correspondences, i)), 0.15 * coarse);
    }
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* The soup is the springls, three vertices each; flat unit normals that agree with the order of the corners. */
TEST soup_is_the_springls(int mirror)
{
    springls_desc desc = world(0, mirror);
    const float middle[3] = { 15.5f, 15.5f, 15.5f };
    springls_sphere sphere;
    springls_context *ctx;
    springls_mesh soup;
    int i, m;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT(fixture_of_zero_level(ctx) != NULL);
    springls_to_world(ctx, middle, 1, sphere.center);
    sphere.radius = 6.0f;
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &sphere));
    ASSERT_OK(springls_extract_soup(ctx, &soup));
    ASSERT_EQ(springls_count(ctx), soup.triangle_count);
    ASSERT_EQ(3 * springls_count(ctx), soup.vertex_count);
    for (i = 0; i < soup.triangle_count; i++) {
        fixture_springl s = fixture_get(ctx, i);
        const int *t = soup.triangles + 3 * i;
        d3 a = at(soup.positions, t[0]), n = d3_cross(d3_sub(at(soup.positions, t[1]), a), d3_sub(at(soup.positions, t[2]), a));
        float expected[3];
        for (m = 0; m < 3; m++) {
            springls_to_world(ctx, &s.q[m].x, 1, expected);
            ASSERT_MEM_EQ(expected, (soup.positions + 9 * i + 3 * m), sizeof expected);
            /* nothing has moved: what a corner shows of the original is the place on it that is nearest */
            ASSERT_LT(d3_distance(at(soup.correspondences, 3 * i + m), at(soup.positions, 3 * i + m)), 0.05);
            ASSERT_EQ(i, soup.springls[3 * i + m]);
            ASSERT(t[m] / 3 == i);
            ASSERT_GT(d3_dot(n, at(soup.normals, 3 * i + m)) / d3_length(n), 0.999);
            ASSERT_IN_RANGE(1.0, d3_length(at(soup.normals, 3 * i + m)), 1e-5);
        }
        ASSERT_GT(d3_dot(n, d3_sub(a, at(sphere.center, 0))), 0.0);
    }
    springls_mesh_free(ctx, &soup);
    springls_destroy(ctx);
    PASS();
}

/* A surfel lies at its springl's particle, faces as phi does there, however its triangle is tilted, and reaches to its furthest
   vertex (section 6). */
TEST surfels_cover_their_springls(int uniform)
{
    springls_desc desc = world(uniform, 0);
    const float middle[3] = { 15.5f, 15.5f, 15.5f };
    springls_sphere sphere;
    springls_context *ctx;
    float *surfels;
    int i, m;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT(fixture_of_zero_level(ctx) != NULL);
    springls_to_world(ctx, middle, 1, sphere.center);
    sphere.radius = 6.0f;
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &sphere));
    surfels = (float *)malloc((size_t)springls_count(ctx) * 7 * sizeof *surfels);
    for (i = 0; i < springls_count(ctx); i++) { /* tilted by about 20 degrees */
        springls__springl *s = &fixture_here(ctx)->set.s[i];
        s->q[0] = springls__mad(s->q[0], springls__springl_normal(*s), 0.3f);
        *s = springls__springl_finished(*s);
    }
    springls__constellation_changed(ctx);
    ASSERT_OK(springls_extract_surfels(ctx, surfels));
    for (i = 0; i < springls_count(ctx); i++) {
        fixture_springl s = fixture_get(ctx, i);
        const float *surfel = surfels + 7 * i;
        float world_point[3];
        d3 center = at(surfel, 0), n = at(surfel, 1), outward = d3_sub(center, at(sphere.center, 0)), q[3];
        double furthest = 0.0;
        springls_to_world(ctx, &s.p.x, 1, world_point);
        ASSERT_MEM_EQ(world_point, surfel, sizeof world_point);
        for (m = 0; m < 3; m++) {
            springls_to_world(ctx, &s.q[m].x, 1, world_point);
            q[m] = at(world_point, 0);
            furthest = fmax(furthest, d3_distance(q[m], center));
        }
        ASSERT_IN_RANGE(furthest, surfel[6], 1e-4);
        ASSERT_IN_RANGE(1.0, d3_length(n), 1e-5);
        ASSERT_GT(d3_dot(n, outward) / d3_length(outward), 0.99);
    }
    free(surfels);
    springls_destroy(ctx);
    PASS();
}

/* An empty model gives empty meshes, which may be freed, twice too. */
TEST nothing_gives_nothing(void)
{
    springls_context *ctx = fixture_context(size, NULL);
    springls_mesh mesh, zero;
    springls_measures measures;
    memset(&zero, 0, sizeof zero);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    ASSERT_MEM_EQ(&zero, &mesh, sizeof mesh);
    ASSERT_OK(springls_extract_soup(ctx, &mesh));
    ASSERT_MEM_EQ(&zero, &mesh, sizeof mesh);
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_EQ(0.0, measures.volume);
    ASSERT_EQ(0, measures.components);
    springls_mesh_free(ctx, &mesh);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* Zeros exactly on voxels, and noise that touches itself everywhere, are as closed as a sphere. */
TEST awkward_fields_are_closed(int kind)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    float phi[16 * 16 * 16];
    springls_mesh mesh;
    springls__mesh_report report;
    int i, repeat;
    p.keep_edges = 0; /* noise is nothing but edges */
    ctx = fixture_context(16, &p);
    fixture_seed(31 + (uint32_t)kind);
    for (repeat = 0; repeat < 5; repeat++) {
        for (i = 0; i < 16 * 16 * 16; i++) {
            int x = i % 16, y = i / 16 % 16, z = i / 256;
            phi[i] = kind == 0 ? (float)(abs(x - 8) + abs(y - 8) + abs(z - 8) - 3 - repeat) : fixture_between(-1.0f, 1.0f);
        }
        ASSERT_OK(springls_set_level_set(ctx, phi));
        ASSERT_OK(springls_extract_mesh(ctx, &mesh));
        report = fixture_report(&mesh);
        ASSERT_EQ(0, report.boundary_edges);
        ASSERT_EQ(0, report.nonmanifold_edges);
        ASSERT_EQ(0, report.misoriented_edges);
        ASSERT_EQ(report.euler % 2, 0);
        for (i = 0; i < 3 * mesh.vertex_count; i++) ASSERT(fabsf(mesh.positions[i]) < 20.0f && fabsf(mesh.normals[i]) < 1.001f);
        springls_mesh_free(ctx, &mesh);
    }
    springls_destroy(ctx);
    PASS();
}

SUITE(isosurface)
{
    int shape, mirror;
    for (shape = 0; shape < SHAPES; shape++) {
        RUN_TESTp(mesh_is_watertight, shape);
        if (shape != BOX) RUN_TESTp(mesh_is_the_shape, shape);
    }
    RUN_TEST(border_is_closed);
    RUN_TEST(vertices_have_springl_and_correspondence);
    for (mirror = 0; mirror < 2; mirror++) {
        RUN_TESTp(mesh_is_in_the_world, 1, mirror);
        RUN_TESTp(mesh_is_in_the_world, 0, mirror);
        RUN_TESTp(soup_is_the_springls, mirror);
        RUN_TESTp(surfels_cover_their_springls, mirror);
    }
    RUN_TEST(nothing_gives_nothing);
    RUN_TESTp(awkward_fields_are_closed, 0);
    RUN_TESTp(awkward_fields_are_closed, 1);
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(isosurface);
    GREATEST_MAIN_END();
}
