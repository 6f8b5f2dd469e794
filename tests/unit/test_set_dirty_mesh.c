/* test_set_dirty_mesh.c - dirty meshes, and those of files, into springls and a level set; signs against a count of crossings. */
#include "set_mesh.h"

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
    ASSERT_EQ(SPRINGLS_OK, springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
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

/* What is outside stays outside: no voxel passes its side on through a hole. */
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
    RUN_SUITE(dirty);
    RUN_SUITE(signs);
    GREATEST_MAIN_END();
}
