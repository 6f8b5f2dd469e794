/* test_bad_input.c - input that is broken, degenerate or extreme: it is refused in a sentence, or it makes a model that lives:
   that goes through steps, stays finite and has a closed zero level. */
#include "fixtures.h"

enum { SIZE = 20, VOXELS = SIZE * SIZE * SIZE };

static d3 voxel(int i) { return d3_make(i % SIZE, i / SIZE % SIZE, i / (SIZE * SIZE)); }
static double ball(d3 x) { return d3_distance(x, d3_make(9.5, 9.5, 9.5)) - 5.0; }

/* ---- what has to hold whatever happened ---- */

static int finite(const springls_context *ctx)
{
    int i, m, n = springls_count(ctx);
    for (i = 0; i < n; i++) {
        fixture_springl s = fixture_get(ctx, i);
        if (!(d3_length(d3_of(s.p)) < 1e12) || !(d3_length(d3_of(s.a)) < 1e12)) return 0;
        for (m = 0; m < 3; m++)
            if (!(d3_length(d3_of(s.q[m])) < 1e12)) return 0;
    }
    return 1;
}

static greatest_test_res is_sane(springls_context *ctx)
{
    springls_mesh mesh;
    springls__mesh_report report;
    float *phi = (float *)malloc(VOXELS * sizeof *phi);
    int i;
    ASSERT(finite(ctx));
    ASSERT_OK(springls_copy_level_set(ctx, phi));
    for (i = 0; i < VOXELS; i++) ASSERT(fabsf(phi[i]) <= springls_get_params(ctx).band_half_width + 1.0f);
    free(phi);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    if (mesh.vertex_count) {
        report = fixture_report(&mesh);
        ASSERT_EQ(0, report.boundary_edges);
        ASSERT_EQ(0, report.nonmanifold_edges);
        ASSERT_EQ(0, report.misoriented_edges);
    }
    springls_mesh_free(ctx, &mesh);
    PASS();
}

/* Both algorithms, resampling and questions included. A model may die of it, but only by the right name. */
static greatest_test_res lives(springls_context *ctx)
{
    float wind[3] = { 0.4f, 0.2f, -0.1f };
    const float points[6] = { 1.0f, 2.0f, 3.0f, 9.5f, 9.0f, 9.2f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_hit hits[2];
    springls_measures measures;
    springls_status status = SPRINGLS_OK;
    int i;
    CHECK_CALL(is_sane(ctx));
    for (i = 0; i < 7 && status == SPRINGLS_OK; i++) {
        springls_step_desc step = fixture_step(&forces, i == 6 ? SPRINGLS_MODE_ELASTIC : SPRINGLS_MODE_FLUID, 1.0f);
        status = springls_step(ctx, &step);
        ASSERT(status == SPRINGLS_OK || (status == SPRINGLS_EMPTY_MODEL && springls_count(ctx) == 0));
    }
    CHECK_CALL(is_sane(ctx));
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 2, hits));
    ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, points, 2, 0.0f, hits));
    ASSERT_OK(springls_measure(ctx, &measures));
    PASS();
}

/* ---- level sets, labels, images ---- */

/* NaN and infinity are refused wherever they are, and leave nothing behind. */
TEST level_sets_are_finite(float bad)
{
    static const int places[5] = {0, 9 + SIZE * (9 + SIZE * 9), 4 + SIZE * (9 + SIZE * 9), VOXELS - 1, 8 + SIZE * (8 + SIZE * 16)};
    springls_context *ctx = fixture_context(SIZE, NULL);
    float phi[VOXELS];
    int i, k;
    for (k = 0; k < 5; k++) {
        for (i = 0; i < VOXELS; i++) phi[i] = (float)ball(voxel(i));
        phi[places[k]] = bad;
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_set_level_set(ctx, phi));
        ASSERT(strlen(springls_last_error(ctx)) > 10);
        ASSERT_EQ(0, springls_count(ctx));
        CHECK_CALL(is_sane(ctx));
    }
    springls_destroy(ctx);
    PASS();
}

/* A function of any scale gives the same surface, and the distance to it. */
TEST scale_does_not_matter(double scale)
{
    springls_context *ctx = fixture_of_zero_level(fixture_context(SIZE, NULL));
    float phi[VOXELS], out[VOXELS];
    fixture_error error;
    double worst = 0.0;
    int i;
    for (i = 0; i < VOXELS; i++) phi[i] = (float)(scale * ball(voxel(i)));
    ASSERT_OK(springls_set_level_set(ctx, phi));
    error = fixture_sphere_error(ctx, d3_make(9.5, 9.5, 9.5), 5.0);
    ASSERT_IN_RANGE(0.0, error.max, 0.05);
    ASSERT_OK(springls_copy_level_set(ctx, out));
    for (i = 0; i < VOXELS; i++)
        if (fabs(ball(voxel(i))) < 2.0) worst = fmax(worst, fabs(ball(voxel(i)) - (double)out[i]));
    ASSERT_IN_RANGE(0.0, worst, 0.25);
    CHECK_CALL(lives(ctx));
    springls_destroy(ctx);
    PASS();
}

/* Nothing inside is no model; everything inside is the domain; noise, checkers and zeros are models or none. */
TEST strange_level_sets(int kind)
{
    springls_context *ctx = fixture_context(SIZE, NULL);
    float phi[VOXELS];
    springls_status status;
    int i;
    fixture_seed(7);
    for (i = 0; i < VOXELS; i++) {
        int x = i % SIZE, y = i / SIZE % SIZE, z = i / (SIZE * SIZE);
        phi[i] = kind == 0   ? 1.0f
               : kind == 1 ? -1.0f
               : kind == 2 ? 0.0f
               : kind == 3 ? -0.0f
               : kind == 4 ? ((x + y + z) % 2 ? 1.0f : -1.0f)
               : kind == 5 ? fixture_between(-1.0f, 1.0f)
               : kind == 6 ? (x == 9 ? -1.0f : 1.0f) /* a sheet one voxel thick */
               : kind == 7 ? (i == VOXELS / 2 ? -1e-30f : 1e30f)
                           : (x < 10 ? -1e-38f : FLT_MAX);
    }
    status = springls_set_level_set(ctx, phi);
    if (kind == 0 || kind == 2 || kind == 3) {
        ASSERT_EQ(SPRINGLS_EMPTY_MODEL, status);
    } else {
        ASSERT_EQ(SPRINGLS_OK, status);
        ASSERT_GT(springls_count(ctx), 0);
    }
    CHECK_CALL(lives(ctx));
    springls_destroy(ctx);
    PASS();
}

TEST strange_labels_and_images(void)
{
    springls_context *ctx = fixture_context(SIZE, NULL);
    int32_t labels[VOXELS];
    float image[VOXELS];
    int i;
    for (i = 0; i < VOXELS; i++) labels[i] = ball(voxel(i)) < 0.0 ? INT32_MAX : INT32_MIN;
    ASSERT_OK(springls_set_labels(ctx, labels, INT32_MAX));
    CHECK_CALL(lives(ctx));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_set_labels(ctx, labels, 5));
    ASSERT_OK(springls_set_labels(ctx, labels, -1)); /* all that are not 0: the whole domain */
    CHECK_CALL(lives(ctx));
    for (i = 0; i < VOXELS; i++) image[i] = ball(voxel(i)) < 0.0 ? 1000.0f : i % 3 ? NAN : -1000.0f;
    ASSERT_OK(springls_set_threshold(ctx, image, 500.0f, INFINITY));
    CHECK_CALL(lives(ctx));
    for (i = 0; i < VOXELS; i++) image[i] = ball(voxel(i)) < 0.0 ? INFINITY : -INFINITY;
    ASSERT_OK(springls_set_threshold(ctx, image, 0.0f, INFINITY));
    CHECK_CALL(lives(ctx));
    for (i = 0; i < VOXELS; i++) image[i] = 3.0f;
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_set_threshold(ctx, image, 5.0f, 9.0f));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_threshold(ctx, image, 9.0f, 5.0f));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_threshold(ctx, image, NAN, 5.0f));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_threshold(ctx, image, 1.0f, NAN));
    for (i = 0; i < VOXELS; i++) image[i] = NAN;
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_set_threshold(ctx, image, 0.0f, 1.0f));
    springls_destroy(ctx);
    PASS();
}

/* ---- implicit functions ---- */

enum { FN_NAN, FN_NAN_NEAR, FN_INFINITE, FN_OUTSIDE, FN_INSIDE, FN_ZERO, FN_STEP, FN_NOISE, FN_STEEP, FNS };

static void strange(void *user, const float *points, int count, float *out)
{
    int i;
    for (i = 0; i < count; i++) {
        double d = ball(d3_make((double)points[3 * i], (double)points[3 * i + 1], (double)points[3 * i + 2]));
        switch (*(const int *)user) {
        case FN_NAN: out[i] = NAN; break;
        case FN_NAN_NEAR: out[i] = fabs(d) < 0.5 ? NAN : (float)d; break;
        case FN_INFINITE: out[i] = d < 0.0 ? -INFINITY : INFINITY; break;
        case FN_OUTSIDE: out[i] = 1e30f; break;
        case FN_INSIDE: out[i] = -1e30f; break;
        case FN_ZERO: out[i] = 0.0f; break;
        case FN_STEP: out[i] = d < 0.0 ? -0.5f : 0.5f; break; /* not a distance */
        case FN_NOISE:
            out[i] = (float)(fmod(fabs(points[3 * i] * 7.1 + points[3 * i + 1] * 3.3 + points[3 * i + 2]), 2.0) - 1.0);
            break;
        default: out[i] = (float)(d * 1e6); break;
        }
    }
}

TEST strange_functions(int kind)
{
    springls_context *ctx = fixture_context(SIZE, NULL);
    springls_status status = springls_set_implicit(ctx, strange, &kind);
    if (kind == FN_NAN || kind == FN_NAN_NEAR) ASSERT_EQ(SPRINGLS_NON_FINITE, status);
    if (kind == FN_OUTSIDE || kind == FN_ZERO || kind == FN_INFINITE) ASSERT_EQ(SPRINGLS_EMPTY_MODEL, status);
    if (kind == FN_INSIDE || kind == FN_STEP || kind == FN_NOISE) ASSERT_EQ(SPRINGLS_OK, status);
    if (status != SPRINGLS_OK) ASSERT_EQ(0, springls_count(ctx));
    CHECK_CALL(lives(ctx));
    springls_destroy(ctx);
    PASS();
}

/* ---- meshes ---- */

typedef struct soup { float x[64][3]; int t[64][3], points, triangles; } soup;

static void add(soup *s, d3 a, d3 b, d3 c)
{
    d3 corner[3];
    int k;
    corner[0] = a;
    corner[1] = b;
    corner[2] = c;
    for (k = 0; k < 3; k++) {
        s->x[s->points][0] = (float)corner[k].x;
        s->x[s->points][1] = (float)corner[k].y;
        s->x[s->points][2] = (float)corner[k].z;
        s->t[s->triangles][k] = s->points++;
    }
    s->triangles++;
}

/* A tetrahedron with corners at least `size` from each other. */
static void tetrahedron(soup *s, d3 at, double size)
{
    d3 a = at, b = d3_add(at, d3_make(size, 0, 0)), c = d3_add(at, d3_make(0, size, 0)), d = d3_add(at, d3_make(0, 0, size));
    add(s, a, c, b);
    add(s, a, b, d);
    add(s, a, d, c);
    add(s, b, c, d);
}

enum { ONE_TRIANGLE, TWO_SIDES, FAN_OF_THREE, MOEBIUS, NEEDLE, DUPLICATES, CROSSING, TINY, HUGE_ONE, BEYOND, TOUCHING, INSIDE_OUT,
       MESHES };

static soup strange_mesh(int kind)
{
    soup s;
    d3 a = d3_make(5, 5, 5), b = d3_make(14, 5, 6), c = d3_make(7, 14, 8), d = d3_make(9, 8, 15);
    int i;
    memset(&s, 0, sizeof s);
    switch (kind) {
    case ONE_TRIANGLE: add(&s, a, b, c); break;
    case TWO_SIDES: add(&s, a, b, c); add(&s, a, c, b); break;
    case FAN_OF_THREE: add(&s, a, b, c); add(&s, a, b, d); add(&s, a, b, d3_make(4, 12, 14)); break;
    case MOEBIUS:
        for (i = 0; i < 8; i++) {
            d3 e[4];
            int k;
            for (k = 0; k < 4; k++) {
                double t = (i + k / 2) * fixture_pi / 4.0, w = (k % 2 ? 1.0 : -1.0) * 2.5, r = 6.0 + w * cos(t / 2.0);
                e[k] = d3_make(9.5 + r * cos(t), 9.5 + r * sin(t), 9.5 + w * sin(t / 2.0));
            }
            add(&s, e[0], e[1], e[2]);
            add(&s, e[2], e[1], e[3]);
        }
        break;
    case NEEDLE:
        add(&s, a, b, d3_mad(a, d3_sub(b, a), 0.5));
        add(&s, a, b, d3_add(d3_mad(a, d3_sub(b, a), 0.5), d3_make(0, 1e-4, 0)));
        break;
    case DUPLICATES: for (i = 0; i < 3; i++) tetrahedron(&s, a, 8.0); break;
    case CROSSING: tetrahedron(&s, a, 9.0); tetrahedron(&s, d3_make(7, 6, 6), 7.0); break;
    case TINY: tetrahedron(&s, d3_make(9.3, 9.4, 9.1), 1e-3); break;
    case HUGE_ONE: tetrahedron(&s, d3_make(-400, -400, -400), 2000.0); break;
    case BEYOND: tetrahedron(&s, d3_make(30, 30, 30), 5.0); break;
    case TOUCHING: tetrahedron(&s, d3_make(-0.5, -0.5, -0.5), 20.0); break;
    default:
        tetrahedron(&s, a, 8.0);
        for (i = 0; i < 4; i++) {
            int swap = s.t[i][1];
            s.t[i][1] = s.t[i][2];
            s.t[i][2] = swap;
        }
        break;
    }
    return s;
}

TEST strange_meshes(int kind)
{
    springls_context *ctx = fixture_context(SIZE, NULL);
    soup s = strange_mesh(kind);
    springls_mesh_report report;
    springls_status status = springls_set_mesh(ctx, s.x[0], s.points, 0, s.t[0], s.triangles, &report);
    bool inside = kind != ONE_TRIANGLE && kind != TWO_SIDES && kind != NEEDLE && kind != TINY;
    ASSERT_EQ(kind == BEYOND || !inside ? SPRINGLS_BAD_MESH : SPRINGLS_OK, status);
    if (!inside) ASSERT(strstr(springls_last_error(ctx), "no inside") != NULL);
    if (status == SPRINGLS_OK) ASSERT_EQ(report.springls, springls_count(ctx));
    if (status == SPRINGLS_OK) ASSERT(springls_count(ctx) >= s.triangles - report.triangles_dropped); /* and the film over holes */
    if (kind == INSIDE_OUT) ASSERT(report.flipped);
    if (kind == FAN_OF_THREE) ASSERT_EQ(1, report.nonmanifold_edges);
    CHECK_CALL(lives(ctx));
    springls_destroy(ctx);
    PASS();
}

/* Whatever is wrong with its arrays, the model that was there stays. */
TEST broken_meshes_change_nothing(void)
{
    springls_context *ctx = fixture_sphere(SIZE, NULL, 9.5f, 9.5f, 9.5f, 5.0f);
    uint64_t before = springls_state_hash(ctx);
    soup s = strange_mesh(CROSSING);
    static const int indices[4] = { -1, 24, INT32_MAX, INT32_MIN };
    static const float values[3] = { NAN, INFINITY, -INFINITY };
    int i, k;
    ASSERT_EQ(24, s.points);
    for (i = 0; i < 4; i++) {
        s = strange_mesh(CROSSING);
        s.t[i][i % 3] = indices[i];
        ASSERT_STATUS(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, s.x[0], s.points, 0, s.t[0], s.triangles, NULL));
    }
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) {
            s = strange_mesh(CROSSING);
            s.x[5 * i][k] = values[i];
            ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_set_mesh(ctx, s.x[0], s.points, 0, s.t[0], s.triangles, NULL));
        }
    s = strange_mesh(CROSSING);
    s.x[3][0] = 1e30f;
    ASSERT_STATUS(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, s.x[0], s.points, 0, s.t[0], s.triangles, NULL));
    s = strange_mesh(CROSSING);
    for (i = 0; i < s.triangles; i++) s.t[i][2] = s.t[i][1];
    ASSERT_STATUS(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, s.x[0], s.points, 0, s.t[0], s.triangles, NULL));
    ASSERT_STATUS(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, s.x[0], s.points, 0, s.t[0], 0, NULL));
    ASSERT_STATUS(SPRINGLS_BAD_MESH, springls_set_mesh(ctx, s.x[0], 0, 0, s.t[0], s.triangles, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_mesh(ctx, s.x[0], -1, 0, s.t[0], s.triangles, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_mesh(ctx, s.x[0], s.points, 0, s.t[0], -1, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_mesh(ctx, s.x[0], s.points, 0, s.t[0], INT32_MAX, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_mesh(ctx, s.x[0], s.points, 7, s.t[0], s.triangles, NULL));
    ASSERT(before == springls_state_hash(ctx));
    s = strange_mesh(CROSSING); /* what no triangle uses may be anything */
    s.x[24][0] = NAN;
    ASSERT_OK(springls_set_mesh(ctx, s.x[0], 25, 0, s.t[0], s.triangles, NULL));
    springls_destroy(ctx);
    PASS();
}

/* ---- raw springls ---- */

TEST broken_springls_change_nothing(void)
{
    springls_context *ctx = fixture_sphere(SIZE, NULL, 9.5f, 9.5f, 9.5f, 5.0f);
    uint64_t before = springls_state_hash(ctx);
    static const float bad[4] = { NAN, INFINITY, -INFINITY, 2e6f };
    float q[9] = { 5, 5, 5, 8, 5, 5, 5, 8, 5 }, p[3] = { 6, 6, 5 }, a[3] = { 6, 6, 5 };
    int i, k;
    for (i = 0; i < 4; i++)
        for (k = 0; k < 15; k++) {
            float *x = k < 9 ? &q[k] : k < 12 ? &p[k - 9] : &a[k - 12], was = *x;
            *x = bad[i];
            ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_set_springls(ctx, q, p, a, 1));
            *x = was;
        }
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_springls(ctx, q, p, a, 0));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_springls(ctx, q, p, a, -5));
    ASSERT(before == springls_state_hash(ctx));
    springls_destroy(ctx);
    PASS();
}

/* One springl, springls without area, all at one place, far outside, larger than the grid, with their particle far away. */
TEST strange_springls(int kind, int which)
{
    springls_params params = which ? springls_default_params() : springls_paper_params();
    springls_context *ctx = fixture_context(SIZE, &params);
    enum { N = 40 };
    float q[N][9], p[N][3];
    int i, k;
    fixture_seed(3);
    for (i = 0; i < N; i++) {
        springls__v3 c = fixture_point(5.0f, 14.0f);
        for (k = 0; k < 9; k++) {
            float o = fixture_between(-1.0f, 1.0f), x = k % 3 == 0 ? c.x : k % 3 == 1 ? c.y : c.z;
            q[i][k] = kind == 1 ? x
                    : kind == 2 ? 9.0f + (float)(k / 3 == k % 3)
                    : kind == 3 ? 1e5f + x + o : kind == 4 ? x + 500.0f * o : x + o;
        }
        for (k = 0; k < 3; k++) p[i][k] = kind == 5 ? q[i][k] + 300.0f : (q[i][k] + q[i][k + 3] + q[i][k + 6]) / 3.0f;
    }
    ASSERT_OK(springls_set_springls(ctx, q[0], p[0], NULL, kind == 0 ? 1 : N));
    CHECK_CALL(lives(ctx));
    springls_destroy(ctx);
    PASS();
}

/* ---- forces ---- */

/* Winds that blow a model out of the domain, one step or a thousand domains at a time. */
TEST storms_leave_a_sound_model(float speed, springls_mode mode, int which)
{
    springls_params params = which ? springls_default_params() : springls_paper_params();
    springls_context *ctx = fixture_sphere(SIZE, &params, 9.5f, 9.5f, 9.5f, 5.0f);
    float wind[3] = { speed, 0.3f * speed, -0.1f * speed };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, mode, 1.0f);
    int i;
    for (i = 0; i < 6; i++) {
        springls_status status = springls_step(ctx, &step);
        ASSERT(status == SPRINGLS_OK || status == SPRINGLS_NON_FINITE
               || (status == SPRINGLS_EMPTY_MODEL && springls_count(ctx) == 0));
        CHECK_CALL(is_sane(ctx));
    }
    springls_destroy(ctx);
    PASS();
}

/* Explosions and implosions: every point by an affine map of huge or negative scale. */
static void burst(void *user, const float *points, const float *correspondences, int count, float time, float *out)
{
    float scale = *(const float *)user;
    int i;
    (void)points;
    (void)correspondences;
    (void)time;
    memset(out, 0, (size_t)count * 12 * sizeof *out);
    for (i = 0; i < count; i++, out += 12) {
        out[0] = out[5] = out[10] = scale;
        out[3] = out[7] = out[11] = -9.5f * scale;
    }
}

TEST explosions_leave_a_sound_model(float scale, springls_mode mode)
{
    springls_context *ctx = fixture_sphere(SIZE, NULL, 9.5f, 9.5f, 9.5f, 5.0f);
    springls_forces forces = fixture_forces(NULL, &scale);
    springls_step_desc step = fixture_step(&forces, mode, 1.0f);
    int i;
    forces.affine = burst;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    for (i = 0; i < 6; i++) {
        springls_status status = springls_step(ctx, &step);
        ASSERT(status == SPRINGLS_OK || status == SPRINGLS_NON_FINITE
               || (status == SPRINGLS_EMPTY_MODEL && springls_count(ctx) == 0));
        CHECK_CALL(is_sane(ctx));
    }
    springls_destroy(ctx);
    PASS();
}

/* Sampled fields with a NaN where springls are, and on grids that are none. */
TEST strange_fields(void)
{
    springls_context *ctx = fixture_sphere(SIZE, NULL, 9.5f, 9.5f, 9.5f, 5.0f);
    static float data[3 * VOXELS];
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
    uint64_t before = springls_state_hash(ctx);
    forces.velocity_grid.data = data;
    data[3 * (4 + SIZE * (9 + SIZE * 9))] = NAN;
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_step(ctx, &step));
    data[3 * (4 + SIZE * (9 + SIZE * 9))] = 0.0f;
    forces.velocity_grid.grid.size[0] = 4;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step(ctx, &step)); /* 4 x 0 x 0 */
    forces.velocity_grid.grid.size[1] = forces.velocity_grid.grid.size[2] = 4;
    forces.velocity_grid.grid.spacing[1] = -1.0;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step(ctx, &step));
    ASSERT(before == springls_state_hash(ctx));
    memset(&forces.velocity_grid.grid, 0, sizeof forces.velocity_grid.grid);
    forces.velocity_grid.grid.size[0] = forces.velocity_grid.grid.size[1] = forces.velocity_grid.grid.size[2] = 1;
    forces.velocity_grid.grid.origin[0] = 1e9; /* one sample, far away, holds everywhere */
    data[0] = 0.3f;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_IN_RANGE(0.15, springls_get_stats(ctx).largest_displacement, 1e-5);
    springls_destroy(ctx);
    PASS();
}

/* ---- questions ---- */

TEST strange_questions(void)
{
    springls_context *ctx = fixture_sphere(SIZE, NULL, 9.5f, 9.5f, 9.5f, 5.0f);
    static const float bad[3] = { NAN, INFINITY, -INFINITY };
    const float far_away[6] = { 1e30f, -1e30f, 1e30f, 3e38f, 3e38f, -3e38f }, none[3] = { 0.0f, 0.0f, 0.0f };
    float x[3] = { 9.5f, 9.5f, 9.5f }, out[6];
    uint8_t inside[2];
    springls_hit hit[2];
    int i;
    for (i = 0; i < 3; i++) {
        x[i] = bad[i];
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_sample_distance(ctx, x, 1, out));
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_sample_gradient(ctx, x, 1, out));
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_sample_inside(ctx, x, 1, inside));
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, x, 1, hit));
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, x, far_away, 1, 0.0f, hit));
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, far_away, x, 1, 0.0f, hit));
        x[i] = 9.5f;
    }
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, x, x, 1, -1.0f, hit));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, x, x, 1, NAN, hit));
    ASSERT_OK(springls_sample_distance(ctx, far_away, 2, out));
    ASSERT(out[0] > 3.0f && out[0] < 100.0f && out[1] > 3.0f && out[1] < 100.0f);
    ASSERT_OK(springls_sample_inside(ctx, far_away, 2, inside));
    ASSERT(!inside[0] && !inside[1]);
    ASSERT_OK(springls_sample_gradient(ctx, far_away, 2, out));
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, far_away, 2, hit));
    ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, far_away, x, 1, 0.0f, hit));
    /* a direction of no length hits nothing */
    ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, x, none, 1, 0.0f, hit));
    ASSERT_EQ(-1, hit[0].springl);
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, NULL, 0, NULL));
    springls_destroy(ctx);
    PASS();
}

/* ---- parameters ---- */

/* Any parameters in range: the model may be served badly, but it lives. */
TEST any_parameters(int seed)
{
    springls_params p = seed % 2 ? springls_default_params() : springls_paper_params();
    springls_context *ctx;
    fixture_seed((uint32_t)seed);
    p.d_max = fixture_between(0.05f, 2.0f);
    p.particle_radius = fixture_between(0.0f, 1.0f);
    p.neighbor_radius = fixture_between(0.05f, 4.0f);
    p.max_neighbors = 1 + (int)(fixture_bits() % 8u);
    p.relax_iterations = (int)(fixture_bits() % 12u);
    p.threshold = (springls_threshold)(fixture_bits() % 2u);
    p.weight = (springls_weight)(fixture_bits() % 4u);
    p.torque = (springls_torque)(fixture_bits() % 2u);
    p.sharpness = fixture_between(0.0f, 100.0f);
    p.kappa_int = fixture_between(0.0f, 10.0f);
    p.kappa_ext = fixture_between(0.0f, 10.0f);
    p.relax_step_length = fixture_between(0.0f, 1.0f);
    p.relax_step_rotation = fixture_between(0.0f, 1.0f);
    p.relax_same_side = (int)(fixture_bits() % 2u);
    p.contract_distance = fixture_between(0.1f, 3.0f);
    p.min_angle = fixture_between(0.0f, 60.0f);
    p.max_angle = fixture_between(60.0f, 180.0f);
    p.min_area = fixture_between(0.0f, 1.0f);
    p.reshape = (int)(fixture_bits() % 2u);
    p.merge_distance = fixture_between(0.0f, 1.5f);
    p.resample_period = 1 + (int)(fixture_bits() % 4u);
    p.resample_last = (int)(fixture_bits() % 2u);
    p.split_edge = fixture_between(0.8f, 4.0f);
    p.split_area = fixture_between(0.4f, 4.0f);
    p.placement = (springls_placement)(fixture_bits() % 2u);
    p.band_half_width = fixture_between(2.0f, 6.0f);
    p.capture_range = fixture_between(0.3f, 6.0f);
    p.evolve_iterations = (int)(fixture_bits() % 6u);
    p.evolve_step = fixture_between(0.0f, 1.0f);
    p.evolve_width = fixture_between(0.5f, 3.0f);
    p.curvature = fixture_between(-0.2f, 0.2f);
    p.project_level_set = (int)(fixture_bits() % 2u);
    p.carry_level_set = (int)(fixture_bits() % 2u);
    p.keep_edges = (int)(fixture_bits() % 2u);
    p.min_component = fixture_between(0.0f, 4.0f);
    p.topology = (springls_topology)(fixture_bits() % 2u);
    p.nearest_rule = fixture_between(0.0f, 4.0f);
    p.track_iterations = (int)(fixture_bits() % 8u);
    p.track_step = fixture_between(0.0f, 1.0f);
    p.vertex_velocity = (int)(fixture_bits() % 2u);
    p.half_time_sampling = (int)(fixture_bits() % 2u);
    p.initial_stride = 1 << (fixture_bits() % 3u);
    p.project_initial = (int)(fixture_bits() % 2u);
    ctx = fixture_sphere(SIZE, &p, 8.5f, 9.0f, 10.0f, 5.0f);
    ASSERT_GT(springls_count(ctx), 0);
    CHECK_CALL(lives(ctx));
    springls_destroy(ctx);
    PASS();
}

SUITE(bad_input)
{
    static const float speeds[4] = { 1.0f, 30.0f, 1e4f, 1e8f }, scales[4] = { -1.0f, -2.0f, 3.0f, 1e6f };
    int i, which;
    RUN_TESTp(level_sets_are_finite, NAN);
    RUN_TESTp(level_sets_are_finite, INFINITY);
    RUN_TESTp(level_sets_are_finite, -INFINITY);
    RUN_TESTp(scale_does_not_matter, 1.0);
    RUN_TESTp(scale_does_not_matter, 1e-6);
    RUN_TESTp(scale_does_not_matter, 1e-25);
    RUN_TESTp(scale_does_not_matter, 1e6);
    RUN_TESTp(scale_does_not_matter, 1e30);
    for (i = 0; i < 9; i++) RUN_TESTp(strange_level_sets, i);
    RUN_TEST(strange_labels_and_images);
    for (i = 0; i < FNS; i++) RUN_TESTp(strange_functions, i);
    for (i = 0; i < MESHES; i++) RUN_TESTp(strange_meshes, i);
    RUN_TEST(broken_meshes_change_nothing);
    RUN_TEST(broken_springls_change_nothing);
    for (which = 0; which < 2; which++) {
        for (i = 0; i < 6; i++) RUN_TESTp(strange_springls, i, which);
        for (i = 0; i < 4; i++) {
            RUN_TESTp(storms_leave_a_sound_model, speeds[i], SPRINGLS_MODE_FLUID, which);
            RUN_TESTp(storms_leave_a_sound_model, speeds[i], SPRINGLS_MODE_ELASTIC, which);
            RUN_TESTp(explosions_leave_a_sound_model, scales[i], which ? SPRINGLS_MODE_ELASTIC : SPRINGLS_MODE_FLUID);
        }
    }
    RUN_TEST(strange_fields);
    RUN_TEST(strange_questions);
    for (i = 0; i < 10; i++) RUN_TESTp(any_parameters, i);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(bad_input);
    GREATEST_MAIN_END();
}
