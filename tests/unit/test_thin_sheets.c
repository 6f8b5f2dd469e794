/* test_thin_sheets.c - sheets thinner than a voxel live through a flow and come back, and topology still changes where
   the surface really touches or breaks: two spheres become one part, a thread that is drawn out becomes two. */
#include "fixtures.h"
#include "../../src/stages/project.h"
#include "../../src/stages/volume_lock.h"

static springls_params without_the_rules(void)
{
    springls_params p = springls_default_params();
    p.keep_thin = p.nucleate = p.fill_from_springls = 0;
    p.min_component = 0.0f;
    return p;
}

/* ---- LeVeque's flow on a grid so coarse that half way the sheet is thinner than a voxel over much of its area ---- */

enum { GRID = 40, STEPS = 156 };

typedef struct outcome { double volume, halfway_volume, off, worst; int components, euler; } outcome;

/* A ball, out and back: volumes relative to the first, mean and largest distance of the particles from the ball. */
static springls_status out_and_back(const springls_params *p, outcome *out)
{
    const float n = (float)GRID;
    springls_context *ctx = fixture_sphere(GRID, p, 0.35f * n, 0.35f * n, 0.35f * n, 0.15f * n);
    struct exact_flow flow = EXACT_DEFORMATION(n, 2.5f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 2.5f / (float)STEPS);
    springls_status status = SPRINGLS_OK;
    springls_measures first, m;
    int i, count;
    memset(out, 0, sizeof *out);
    memset(&m, 0, sizeof m);
    fixture_of_zero_level(ctx);
    springls_measure(ctx, &first);
    for (i = 1; i <= STEPS && status == SPRINGLS_OK; i++) {
        status = springls_step(ctx, &step);
        if (i != STEPS / 2 || status != SPRINGLS_OK) continue;
        springls_measure(ctx, &m);
        out->halfway_volume = m.volume / first.volume;
    }
    if (status == SPRINGLS_OK) status = springls_measure(ctx, &m);
    count = springls_count(ctx);
    for (i = 0; i < count; i++) {
        double d = fabs(d3_distance(d3_of(fixture_particle(ctx, i)), d3_make(0.35 * n, 0.35 * n, 0.35 * n)) - 0.15 * n);
        out->off += d / count;
        if (d > out->worst) out->worst = d;
    }
    out->volume = m.volume / first.volume;
    out->components = m.components;
    out->euler = m.euler;
    springls_destroy(ctx);
    return status;
}

/* Half way the zero level has lost a tenth of the volume or more: that is sheet without a voxel centre in it. It is back in
   the end, where without the rules the sheet is torn: nearly a tenth is gone for good, and springls are far off. */
TEST a_thin_sheet_survives(void)
{
    springls_params p = springls_default_params(), bare = without_the_rules();
    outcome with, without;
    ASSERT_OK(out_and_back(&p, &with));
    ASSERT_OK(out_and_back(&bare, &without));
    ASSERT_LT(with.halfway_volume, 0.9);
    ASSERT_IN_RANGE(1.0, with.volume, 0.005);
    ASSERT_LT(with.off, 0.05);
    ASSERT_EQ(1, with.components);
    ASSERT_EQ(2, with.euler);
    ASSERT_LT(without.volume, 0.95);
    ASSERT_GT(without.off, 10.0 * with.off);
    PASS();
}

/* ---- a flow to or from the plane x = center, without divergence ---- */

typedef struct squeeze { float center, speed, width; } squeeze;

static void squeeze_velocity(void *user, const float *x, int count, float time, float *v)
{
    const squeeze *s = (const squeeze *)user;
    int i;
    (void)time;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        float t = springls__tanh((x[0] - s->center) / s->width), slope = 0.5f * s->speed * (1.0f - t * t) / s->width;
        v[0] = s->speed * t;
        v[1] = -slope * (x[1] - s->center);
        v[2] = -slope * (x[2] - s->center);
    }
}

/* Two spheres on the x axis, joined by a bar when its radius is not 0. */
typedef struct dumbbell { float center, apart, radius, bar; } dumbbell;

static void dumbbell_distance(void *user, const float *points, int count, float *out)
{
    const dumbbell *d = (const dumbbell *)user;
    int i;
    for (i = 0; i < count; i++, points += 3) {
        float x = fabsf(points[0] - d->center), y = points[1] - d->center, z = points[2] - d->center, r = sqrtf(y * y + z * z);
        float ball = sqrtf((x - d->apart) * (x - d->apart) + r * r) - d->radius, bar = fmaxf(x - d->apart, r - d->bar);
        out[i] = d->bar > 0.0f ? fminf(ball, bar) : ball;
    }
}

static springls_context *make_dumbbell(dumbbell *shape)
{
    springls_context *ctx = fixture_context(48, NULL);
    springls_set_implicit(ctx, dumbbell_distance, shape);
    return ctx;
}

/* How many springls lie deeper inside than `depth`, by phi. */
static int deep_springls(springls_context *ctx, float depth)
{
    int i, n = 0;
    for (i = 0; i < springls_count(ctx); i++) n += springls__phi_or_beyond(&fixture_here(ctx)->grid, fixture_particle(ctx, i)) < -depth;
    return n;
}

/* Components without specks, those of less than ten voxels. */
static int bodies(springls_context *ctx)
{
    springls__labels parts;
    int i, n = 0;
    fixture_here(ctx);
    if (springls__find_components(ctx, &parts) != SPRINGLS_OK) return -1;
    for (i = 0; i < parts.count; i++) n += !parts.item[i].cavity && !springls__is_tiny_body(parts.item[i].surface.volume);
    return n;
}

/* Carries each of two bodies along the x axis by its own speed: the side of a correspondence distinguishes them. */
static void toward_velocity(void *user, const float *x, const float *a, int count, float time, float *out)
{
    const squeeze *s = (const squeeze *)user;
    int i;
    (void)x, (void)time;
    memset(out, 0, (size_t)count * 12 * sizeof *out);
    for (i = 0; i < count; i++) out[12 * i + 3] = a[3 * i] > s->center ? s->speed : -s->speed;
}

/* Two spheres are pushed into each other: apart as long as there is a voxel between them, then one part. A wall inside goes,
   and does not come back: in the seam contract removes springls and fill_gaps adds some, for a few resamplings. */
TEST spheres_merge(void)
{
    dumbbell shape = { 23.5f, 6.7f, 4.8f, 0.0f };
    squeeze flow = { 23.5f, -12.0f, 0.0f };
    springls_context *ctx = make_dumbbell(&shape);
    springls_forces forces = { 0 };
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.0125f);
    springls_measures m;
    int i;
    forces.affine = toward_velocity;
    forces.user = &flow;
    for (i = 0; i < 8; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(2, m.components); /* at time 0.1 the gap is 1.4 voxels */
    for (; i < 32; i++) ASSERT_OK(springls_step(ctx, &step));
    flow.speed = 0.0f;
    for (; i < 52; i++) ASSERT_OK(springls_step(ctx, &step));
    for (; i < 72; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_EQ(1, bodies(ctx));
        ASSERT_EQ(0, deep_springls(ctx, 1.0f));
    }
    springls_destroy(ctx);
    PASS();
}

/* A bar between two balls is drawn out to a thread much thinner than a voxel: it breaks and leaves two bodies and no drops. Its
   radius is 2.4 exp(-3.5 t): it is a voxel thick after 36 steps, and 0.73 after 43. */
TEST a_thread_breaks(void)
{
    dumbbell shape = { 23.5f, 6.7f, 4.8f, 2.4f };
    squeeze flow = { 23.5f, 16.8f, 2.4f };
    springls_context *ctx = make_dumbbell(&shape);
    springls_forces forces = fixture_forces(squeeze_velocity, &flow);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.0125f);
    springls_measures first, m;
    int i;
    step.max_displacement = 1.0f;
    ASSERT_OK(springls_measure(ctx, &first));
    ASSERT_EQ(1, first.components);
    for (i = 0; i < 48; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_measure(ctx, &m));
        ASSERT(i < 43 || bodies(ctx) == 2);
    }
    ASSERT_IN_RANGE(first.volume, m.volume, 0.05 * first.volume);
    springls_destroy(ctx);
    PASS();
}

/* ---- what a voxel and a springl are told ---- */

/* A square sheet across z, its sides at height +-half about z = 16, springls of size 1 side by side. */
static void lay_sheet(springls_context *ctx, double half, double from, double to, int facing)
{
    double x, y, side;
    for (side = -1.0; side <= 1.0; side += 2.0)
        for (y = from; y <= to; y += 0.7)
            for (x = from; x <= to; x += 0.7) {
                float z = (float)(16.0 + side * half), up = (float)(side * facing);
                springls__v3 c = springls__v3_make((float)x, (float)y, z);
                springls__v3 u = springls__v3_make(0.5f, 0.0f, 0.0f), v = springls__v3_make(-0.25f, 0.433f * up, 0.0f);
                springls__v3 w = springls__v3_make(-0.25f, -0.433f * up, 0.0f);
                fixture_add(ctx, springls__add(c, u), springls__add(c, v), springls__add(c, w));
            }
}

/* A grid without a surface: phi is far outside everywhere. */
static springls_context *empty_level_set(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 4.0f, 4.0f, 4.0f, 3.0f);
    fixture_clear(ctx);
    springls__grid_clear(ctx, &ctx->model.grid);
    return ctx;
}

static float phi_at(springls_context *ctx, int x, int y, int z)
{
    const springls__grid *g = &fixture_here(ctx)->grid;
    return springls__grid_phi(g, g->phi, x, y, z);
}

/* Between the two sides of a sheet voxels become inside, at the springls' distance, though phi has nothing there: also where
   the bricks have to be made first. */
TEST a_sheet_nucleates(void)
{
    springls_context *ctx = empty_level_set();
    springls_measures m;
    int x, y;
    lay_sheet(ctx, 0.3, 11.0, 20.9, 1);
    ASSERT_OK(fixture_table(ctx, springls__project_level_set));
    for (y = 13; y <= 18; y++)
        for (x = 13; x <= 18; x++) {
            ASSERT_IN_RANGE(-0.3f, phi_at(ctx, x, y, 16), 0.02f);
            ASSERT_IN_RANGE(0.7f, phi_at(ctx, x, y, 15), 0.05f);
            ASSERT_IN_RANGE(0.7f, phi_at(ctx, x, y, 17), 0.05f);
        }
    ASSERT(phi_at(ctx, 24, 16, 16) > 2.0f); /* beside the sheet nothing happens */
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(1, m.components);
    ASSERT_EQ(2, m.euler);
    springls_destroy(ctx);
    PASS();
}

/* The sides of a gap both face it, and say outside; with the switch off nobody is asked. */
TEST a_gap_does_not(int nucleate)
{
    springls_params p = springls_default_params();
    springls_context *ctx = empty_level_set();
    int x, y;
    p.nucleate = nucleate;
    ASSERT_OK(springls_set_params(ctx, &p));
    lay_sheet(ctx, 0.3, 11.0, 20.9, nucleate ? -1 : 1);
    ASSERT_OK(fixture_table(ctx, springls__project_level_set));
    for (y = 8; y < 24; y++)
        for (x = 8; x < 24; x++) ASSERT(phi_at(ctx, x, y, 16) >= 0.0f);
    springls_destroy(ctx);
    PASS();
}

/* Two rows of springls, one over the other, are a ribbon too narrow to be a sheet: it may vanish. */
TEST a_ribbon_does_not(void)
{
    springls_context *ctx = empty_level_set();
    double x;
    int i;
    for (x = 8.0; x < 24.0; x += 0.7)
        for (i = 0; i < 2; i++) {
            springls__v3 c = springls__v3_make((float)x, 16.0f, i ? 16.3f : 15.7f);
            springls__v3 u = springls__v3_make(0.0f, 0.4f, 0.0f), v = springls__v3_make(0.4f, 0.0f, 0.0f);
            fixture_add(ctx, springls__add(c, u), springls__sub(c, i ? v : u), springls__sub(c, i ? u : v));
        }
    ASSERT_OK(fixture_table(ctx, springls__project_level_set));
    for (i = 8; i < 24; i++) ASSERT(phi_at(ctx, i, 16, 16) >= 0.0f);
    springls_destroy(ctx);
    PASS();
}

/* Makes the mesh of a plate 1.2 voxels thick, across (2, 3, 6). */
static void oblique_plate(float positions[24], int triangles[36])
{
    static const int face[6][4] = { { 0, 4, 6, 2 }, { 1, 3, 7, 5 }, { 0, 1, 5, 4 }, { 2, 6, 7, 3 },
                                    { 0, 2, 3, 1 }, { 4, 5, 7, 6 } };
    static const int corner[6] = { 0, 1, 2, 0, 2, 3 };
    const float across[3] = { 2.0f / 7.0f, 3.0f / 7.0f, 6.0f / 7.0f }, h = 1.0f / sqrtf(13.0f);
    const float v[3] = { -3.0f * h, 2.0f * h, 0.0f }, w[3] = { -12.0f * h / 7.0f, -18.0f * h / 7.0f, 13.0f * h / 7.0f };
    int i, k;
    for (i = 0; i < 8; i++)
        for (k = 0; k < 3; k++)
            positions[3 * i + k] = 16.0f + (i & 1 ? 8.0f : -8.0f) * v[k] + (i & 2 ? 8.0f : -8.0f) * w[k]
                                 + (i & 4 ? 0.6f : -0.6f) * across[k];
    for (i = 0; i < 6; i++)
        for (k = 0; k < 6; k++) triangles[6 * i + k] = face[i][corner[k]];
}

/* A plate that runs askew between voxels has no holes, neither when it is set nor at rest. */
TEST an_oblique_plate_has_no_holes(void)
{
    float positions[24];
    int triangles[36], i;
    springls_context *ctx = fixture_context(32, NULL);
    springls_step_desc rest;
    springls_measures m;
    memset(&rest, 0, sizeof rest);
    rest.dt = 0.1f;
    oblique_plate(positions, triangles);
    ASSERT_EQ(SPRINGLS_OK, springls_set_mesh(ctx, positions, 8, 0, triangles, 12, NULL));
    for (i = 0; i <= 5; i++) {
        ASSERT_EQ(SPRINGLS_OK, springls_measure(ctx, &m));
        ASSERT_EQ(1, m.components);
        ASSERT_EQ(2, (int)m.euler);
        ASSERT_EQ(SPRINGLS_OK, springls_step(ctx, &rest));
    }
    springls_destroy(ctx);
    PASS();
}

/* Far from any zero level contract keeps a sheet, by its other side, and removes what has neither other side nor neighbours.
   The paper's rule removes all. */
TEST contract_keeps_the_sheet(void)
{
    springls_params paper = springls_default_params();
    springls_context *ctx = empty_level_set();
    int sheet, lone = 0, i;
    lay_sheet(ctx, 0.2, 11.0, 20.9, 1);
    sheet = springls_count(ctx);
    for (i = 0; i < 3; i++)
        lone += fixture_add(ctx, springls__v3_make(4.0f + 5.0f * (float)i, 5.0f, 26.0f),
                            springls__v3_make(5.0f + 5.0f * (float)i, 5.0f, 26.0f), springls__v3_make(4.5f + 5.0f * (float)i, 6.0f, 26.0f))
            >= 0;
    ASSERT_EQ(3, lone);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_EQ(sheet, springls_count(ctx));
    for (i = 0; i < sheet; i++) ASSERT_EQ((uint32_t)i, springls_ids(ctx)[i]);
    paper.keep_thin = 0;
    ASSERT_OK(springls_set_params(ctx, &paper));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_EQ(0, springls_count(ctx));
    springls_destroy(ctx);
    PASS();
}

/* What two merged bodies have left inside goes, though its sides oppose each other: they have passed through each other, and phi
   is inside. */
TEST contract_removes_a_wall(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 16.0f, 16.0f, 16.0f, 10.0f);
    fixture_clear(ctx);
    lay_sheet(ctx, 0.2, 13.0, 18.9, 1);
    lay_sheet(ctx, 1.5, 13.0, 18.9, 1);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_EQ(0, springls_count(ctx));
    springls_destroy(ctx);
    PASS();
}

SUITE(thin_sheets)
{
    RUN_TEST(an_oblique_plate_has_no_holes);
    RUN_TEST(a_thin_sheet_survives);
    RUN_TEST(spheres_merge);
    RUN_TEST(a_thread_breaks);
    RUN_TEST(a_sheet_nucleates);
    RUN_TESTp(a_gap_does_not, 1);
    RUN_TESTp(a_gap_does_not, 0);
    RUN_TEST(a_ribbon_does_not);
    RUN_TEST(contract_keeps_the_sheet);
    RUN_TEST(contract_removes_a_wall);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(thin_sheets);
    GREATEST_MAIN_END();
}
