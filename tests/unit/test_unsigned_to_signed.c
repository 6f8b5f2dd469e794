/* test_unsigned_to_signed.c - signs from springls alone (section 4.5): the paper's rule, by which the background is what the
   border can reach, and the default, by which the springls themselves say where their outside is. */
#include "fixtures.h"

GREATEST_MAIN_DEFS();

enum { SPHERE, TORUS, TWO_SPHERES, SHELLS, CORNER, PAPERS_SHAPES, NEIGHBOURS = PAPERS_SHAPES, SLOT, PLATE, SHAPES };
static const int size = 40;

static springls_params set_of(int which) { return which ? springls_default_params() : springls_paper_params(); }

static double outside_of_box(d3 x, d3 half)
{
    return fmax(fabs(x.x - 19.5) - half.x, fmax(fabs(x.y - 19.5) - half.y, fabs(x.z - 19.5) - half.z));
}

/* Negative inside. SHELLS: a ball of radius 14 with a hollow of radius 7. CORNER: cut by three faces of the domain.
   NEIGHBOURS: two spheres 1 apart. SLOT: a box with a cut 1.6 wide. PLATE: 1.6 thick. */
static double exact(int shape, d3 x)
{
    double r = d3_distance(x, d3_make(19.5, 19.5, 19.5)), ring;
    switch (shape) {
    case SPHERE: return r - 11.3;
    case TORUS: ring = hypot(x.x - 19.5, x.y - 19.5) - 11.0; return hypot(ring, x.z - 19.5) - 5.0;
    case TWO_SPHERES: return fmin(d3_distance(x, d3_make(9.5, 19.5, 19.5)) - 6.0, d3_distance(x, d3_make(30.0, 21.5, 19.5)) - 7.0);
    case SHELLS: return fmax(r - 14.0, 7.0 - r);
    case CORNER: return d3_distance(x, d3_make(2.0, 3.0, 36.0)) - 10.0;
    case NEIGHBOURS: return fmin(d3_distance(x, d3_make(10.5, 19.5, 19.5)) - 8.0, d3_distance(x, d3_make(28.5, 19.5, 19.5)) - 9.0);
    case SLOT: return fmax(outside_of_box(x, d3_make(12.2, 12.2, 12.2)), -fmax(fabs(x.x - 19.5) - 0.8, 14.0 - x.z));
    default: return outside_of_box(x, d3_make(12.2, 12.2, 0.8));
    }
}

static void implicit(void *user, const float *points, int count, float *out)
{
    int i;
    for (i = 0; i < count; i++)
        out[i] =
            (float)exact(*(const int *)user, d3_make((double)points[3 * i], (double)points[3 * i + 1], (double)points[3 * i + 2]));
}

/* A shape's springls at the full resolution, of which some are missing. */
static springls_context *make(int which, int shape, int missing_percent)
{
    springls_params params = set_of(which);
    springls_context *ctx;
    int i, count;
    uint8_t *keep;
    params.initial_stride = 1;
    if (missing_percent) params.keep_edges = 0; /* springls drawn back from edges would leave gaps of their own there */
    ctx = fixture_context(size, &params);
    springls_set_implicit(ctx, implicit, &shape);
    fixture_seed(91 + (uint32_t)shape);
    count = springls_count(ctx);
    keep = (uint8_t *)malloc((size_t)count);
    for (i = 0; i < count; i++) keep[i] = (int)(fixture_bits() % 100u) >= missing_percent;
    fixture_keep(ctx, keep);
    free(keep);
    return ctx;
}

static d3 voxel(int i) { return d3_make(i % size, i / size % size, i / (size * size)); }

/* The paper: everything inside is inside, everything further out than the shell of 1.5 voxels that stops the background is
   outside, and nothing leaks, also with a twentieth of the springls missing. The hollow of a ball cannot be reached from
   the border, so by this rule it is inside. */
TEST the_border_reaches_the_background(int shape, int missing_percent)
{
    springls_context *ctx = make(0, shape, missing_percent);
    float *phi;
    int i, inside = 0, outside = 0;
    ASSERT_GT(springls_count(ctx), 500);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    phi = fixture_phi(ctx);
    for (i = 0; i < size * size * size; i++) {
        d3 x = voxel(i);
        double d = shape == SHELLS ? d3_distance(x, d3_make(19.5, 19.5, 19.5)) - 14.0 : exact(shape, x);
        if (d < -0.1) {
            ASSERT(phi[i] < 0.0f);
            inside++;
        }
        if (d > 2.0) {
            ASSERT(phi[i] > 0.0f);
            outside++;
        }
    }
    ASSERT_GT(inside, 1000);
    ASSERT_GT(outside, 1000);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

/* The default: every voxel is on its side, in hollows, clefts and thin plates too. Flat springls stand off a radius of 5 by
   1.7^2 / (8 * 5) = 0.07 voxel; where a third of them are missing the rims of holes three voxels wide say what is between. */
TEST voxels_are_on_their_side(int shape, int missing_percent, double tolerance)
{
    springls_context *ctx = make(1, shape, missing_percent);
    float *phi;
    int i, inside = 0, outside = 0;
    ASSERT_GT(springls_count(ctx), 300);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    phi = fixture_phi(ctx);
    for (i = 0; i < size * size * size; i++) {
        double d = exact(shape, voxel(i));
        if (fabs(d) < tolerance) continue;
        if (shape == SLOT && fabs(outside_of_box(voxel(i), d3_make(12.2, 12.2, 12.2))) < 1.0) continue; /* springls cut its edges */
        ASSERT_EQ(d < 0.0, phi[i] < 0.0f);
        inside += d < 0.0;
        outside += d > 0.0;
    }
    ASSERT_GT(inside, 500);
    ASSERT_GT(outside, 1000);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

/* A few springls that are turned inside out spoil no more than what is next to them. */
TEST turned_springls_do_little_harm(void)
{
    springls_context *ctx = make(1, SPHERE, 0);
    float *phi;
    int i, turned = 0;
    for (i = 0; i < springls_count(ctx); i++) {
        springls__springl *s = &fixture_here(ctx)->set.s[i];
        springls__v3 q = s->q[1];
        if (fixture_bits() % 100u >= 3) continue;
        s->q[1] = s->q[2];
        s->q[2] = q;
        *s = springls__springl_finished(*s);
        turned++;
    }
    ASSERT_GT(turned, 50);
    springls__constellation_changed(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    phi = fixture_phi(ctx);
    for (i = 0; i < size * size * size; i++) {
        double d = exact(SPHERE, voxel(i));
        if (fabs(d) > 1.0) ASSERT_EQ(d < 0.0, phi[i] < 0.0f);
    }
    free(phi);
    springls_destroy(ctx);
    PASS();
}

/* The zero level is on the springls, with the topology of the shape: at once with the default, after a few evolutions with
   the paper's rule. */
TEST zero_level_is_on_the_springls(int which, int shape, int euler, int components)
{
    springls_context *ctx = make(which, shape, 0);
    springls_measures measures;
    springls_mesh mesh;
    double mean = 0.0, worst = 0.0;
    int i;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    for (i = 0; !which && i < 12; i++) {
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    }
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_EQ_FMT(components, measures.components, "%d");
    ASSERT_EQ_FMT(euler, measures.euler, "%d");
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    for (i = 0; i < mesh.vertex_count; i++) {
        const float *x = mesh.positions + 3 * i;
        double d = fabs(exact(shape, d3_make((double)x[0], (double)x[1], (double)x[2])));
        if (x[0] < 1.0f || x[1] < 1.0f || x[2] > (float)size - 2.0f) continue; /* the closing surface and its edges */
        mean += d / mesh.vertex_count;
        worst = fmax(worst, d);
    }
    ASSERT_IN_RANGE(0.0, mean, which ? 0.05 : 0.1);
    ASSERT_IN_RANGE(0.0, worst, 0.5);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* It needs springls only: whatever phi was before makes no difference. */
TEST phi_before_does_not_matter(int which)
{
    springls_context *one = make(which, TORUS, 0), *two = make(which, TORUS, 0);
    springls__grid *g = &fixture_here(two)->grid;
    float *a, *b;
    int i;
    for (i = 0; i < g->slot_count * SPRINGLS__BRICK_VOXELS; i++)
        g->phi[i] = i >= 2 * SPRINGLS__BRICK_VOXELS && i % 7 == 0 ? -1.0f : g->phi[i];
    ASSERT_OK(springls_run_stage(one, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    ASSERT_OK(springls_run_stage(two, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    a = fixture_phi(one);
    b = fixture_phi(two);
    ASSERT_MEM_EQ(a, b, (size_t)size * (size_t)size * (size_t)size * sizeof *a);
    free(a);
    free(b);
    springls_destroy(one);
    springls_destroy(two);
    PASS();
}

/* Springls that have left the domain wholly do not harm; without springls the call is refused. */
TEST springls_may_be_outside(void)
{
    springls_context *ctx = make(1, SPHERE, 0);
    ASSERT_OK(fixture_translate(ctx, 100.0f, 0.0f, 0.0f));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    ASSERT_OK(fixture_translate(ctx, -120.0f, 0.0f, 0.0f));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    fixture_clear(ctx);
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    springls_destroy(ctx);
    PASS();
}

/* A model of raw springls is a model: the level set follows from them, its particles and correspondences are as given. */
TEST raw_springls_make_a_model(void)
{
    springls_context *from = make(1, SPHERE, 0), *to = fixture_context(size, NULL);
    int i, m, count = springls_count(from);
    float *vertices = (float *)malloc((size_t)count * 9 * sizeof *vertices), *a = (float *)malloc((size_t)count * 3 * sizeof *a);
    fixture_error error;
    for (i = 0; i < count; i++) {
        for (m = 0; m < 3; m++) {
            springls__v3 q = fixture_vertex(from, i, m);
            memcpy(vertices + 9 * i + 3 * m, &q.x, 3 * sizeof(float));
        }
        for (m = 0; m < 3; m++) a[3 * i + m] = (float)(i + m);
    }
    ASSERT_OK(springls_set_springls(to, vertices, NULL, a, count));
    ASSERT_EQ(count, springls_count(to));
    for (i = 0; i < count; i++) {
        springls__v3 b = fixture_origin(to, i);
        ASSERT_MEM_EQ((a + 3 * i), &b, sizeof b);
        ASSERT_LT(d3_distance(d3_of(fixture_particle(from, i)), d3_of(fixture_particle(to, i))), 1e-5);
    }
    error = fixture_sphere_error(to, d3_make(19.5, 19.5, 19.5), 11.3);
    ASSERT_IN_RANGE(0.0, error.mean, 0.05);
    free(vertices);
    free(a);
    springls_destroy(from);
    springls_destroy(to);
    PASS();
}

SUITE(unsigned_to_signed)
{
    int shape, which;
    for (shape = 0; shape < PAPERS_SHAPES; shape++) {
        RUN_TESTp(the_border_reaches_the_background, shape, 0);
        RUN_TESTp(the_border_reaches_the_background, shape, 5);
    }
    for (shape = 0; shape < SHAPES; shape++) {
        RUN_TESTp(voxels_are_on_their_side, shape, 0, 0.1);
        RUN_TESTp(voxels_are_on_their_side, shape, 30, 0.25);
    }
    RUN_TEST(turned_springls_do_little_harm);
    for (which = 0; which < 2; which++) {
        RUN_TESTp(zero_level_is_on_the_springls, which, SPHERE, 2, 1);
        RUN_TESTp(zero_level_is_on_the_springls, which, TORUS, 0, 1);
        RUN_TESTp(zero_level_is_on_the_springls, which, TWO_SPHERES, 4, 2);
        RUN_TESTp(zero_level_is_on_the_springls, which, CORNER, 2, 1);
    }
    RUN_TESTp(zero_level_is_on_the_springls, 1, SHELLS, 4, 2);
    RUN_TESTp(zero_level_is_on_the_springls, 1, NEIGHBOURS, 4, 2);
    for (which = 0; which < 2; which++) RUN_TESTp(phi_before_does_not_matter, which);
    RUN_TEST(springls_may_be_outside);
    RUN_TEST(raw_springls_make_a_model);
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(unsigned_to_signed);
    GREATEST_MAIN_END();
}
