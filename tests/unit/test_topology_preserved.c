/* test_topology_preserved.c - a whole model with its topology held (section 4.5), measured at every step. */
#include "fixtures.h"

/* Towards the plane x = 15.5 from both sides. */
static void together(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)time;
    for (i = 0; i < count; i++) {
        out[3 * i] = points[3 * i] < 15.5f ? 0.4f : -0.4f;
        out[3 * i + 1] = out[3 * i + 2] = 0.0f;
    }
}

static void two_balls(void *user, const float *points, int count, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < count; i++) {
        d3 x = d3_make((double)points[3 * i], (double)points[3 * i + 1], (double)points[3 * i + 2]);
        out[i] = (float)fmin(d3_distance(x, d3_make(8.5, 15.5, 15.5)) - 5.5, d3_distance(x, d3_make(22.5, 15.5, 15.5)) - 5.5);
    }
}

/* Two spheres that are driven into each other merge where topology is free and stay two where it is preserved. */
TEST merging_is_a_choice(int which, int preserved, int stop)
{
    springls_params p = which ? springls_default_params() : springls_paper_params();
    springls_context *ctx;
    springls_forces forces = fixture_forces(together, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    fixture_topology topology;
    int i;
    p.topology = preserved ? SPRINGLS_TOPOLOGY_PRESERVED : SPRINGLS_TOPOLOGY_FREE;
    step.stop_at_topology = stop;
    ctx = fixture_context(32, &p);
    ASSERT_OK(springls_set_implicit(ctx, two_balls, NULL));
    topology = fixture_measure(ctx);
    ASSERT_EQ(2, topology.components);
    for (i = 0; i < 12; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        topology = fixture_measure(ctx);
        if (!preserved) continue;
        ASSERT_EQ_FMT(2, topology.components, "%d");
        ASSERT_EQ_FMT(2, topology.euler, "%d");
        ASSERT_EQ_FMT(0, topology.cavities, "%d");
    }
    if (!preserved) ASSERT_EQ_FMT(1, topology.components, "%d");
    springls_destroy(ctx);
    PASS();
}

/* A smooth velocity that changes at random with time. */
typedef struct weather { float k[3][6]; } weather;

static void storm(void *user, const float *points, int count, float time, float *out)
{
    const weather *w = (const weather *)user;
    int i, c;
    for (i = 0; i < count; i++)
        for (c = 0; c < 3; c++) {
            const float *k = w->k[c], *x = points + 3 * i;
            out[3 * i + c] = 0.9f * springls__sinpi(k[0] * x[0] + k[1] * x[1] + k[2] * x[2] + k[3] * time + k[4]);
        }
}

/* Under random forces that would tear and join it, a torus beside a sphere keeps parts, handles and cavities at every
   step, and the extracted mesh has the topology of the voxels. */
TEST topology_survives_storms(int which, int seed)
{
    springls_params p = which ? springls_default_params() : springls_paper_params();
    springls_context *ctx;
    weather w;
    springls_forces forces = fixture_forces(storm, &w);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
    fixture_topology first, now;
    springls_measures measures;
    float *phi = (float *)malloc(32 * 32 * 32 * sizeof *phi);
    int i, c, k;
    p.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    p.curvature = 0.02f;
    ctx = fixture_context(32, &p);
    for (i = 0; i < 32 * 32 * 32; i++) {
        double x = i % 32, y = i / 32 % 32, z = i / 1024;
        double torus = hypot(hypot(x - 15.5, y - 15.5) - 7.5, z - 11.5) - 2.8;
        double ball = d3_distance(d3_make(x, y, z), d3_make(15.5, 15.5, 22.5)) - 4.0;
        phi[i] = (float)fmin(torus, ball);
    }
    ASSERT_OK(springls_set_level_set(ctx, phi));
    free(phi);
    first = fixture_measure(ctx);
    ASSERT_EQ(2, first.components);
    ASSERT_EQ(1, first.euler); /* 0 + 1 */
    fixture_seed((uint32_t)seed);
    for (i = 0; i < 16; i++) {
        if (i % 4 == 0)
            for (c = 0; c < 3; c++)
                for (k = 0; k < 6; k++) w.k[c][k] = fixture_between(-0.09f, 0.09f) * (k >= 3 ? 10.0f : 1.0f);
        ASSERT_OK(springls_step(ctx, &step));
        now = fixture_measure(ctx);
        ASSERT_EQ_FMT(first.components, now.components, "%d");
        ASSERT_EQ_FMT(first.euler, now.euler, "%d");
        ASSERT_EQ_FMT(first.cavities, now.cavities, "%d");
    }
    ASSERT_OK(springls_measure(ctx, &measures)); /* a closed surface has twice the Euler number of what it encloses */
    ASSERT_EQ_FMT(2 * first.euler, measures.euler, "%d");
    ASSERT_EQ_FMT(first.components, measures.components, "%d");
    springls_destroy(ctx);
    PASS();
}

/* The same for springls, wherever they are: those of the left ball go right and those of the right ball left. */
static void through(void *user, const float *points, const float *correspondences, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)points;
    (void)time;
    memset(out, 0, 12 * (size_t)count * sizeof *out);
    for (i = 0; i < count; i++) out[12 * i + 3] = correspondences[3 * i] < 15.5f ? 0.4f : -0.4f;
}

/* eq. 24-25: springls that would run through each other stop where the level set is held. Without the stop they go on:
   10 steps of 0.4 carry them 2.5 voxels beyond the plane. */
TEST springls_stop(void)
{
    int stop;
    double deepest[2];
    for (stop = 0; stop < 2; stop++) {
        springls_params p = springls_default_params();
        springls_context *ctx;
        springls_forces forces = fixture_forces(NULL, NULL);
        springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
        int i;
        forces.affine = through;
        p.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        step.stop_at_topology = stop;
        step.one_to_one = true;
        ctx = fixture_context(32, &p);
        ASSERT_OK(springls_set_implicit(ctx, two_balls, NULL));
        for (i = 0; i < 10; i++) ASSERT_OK(springls_step(ctx, &step));
        ASSERT_EQ(2, fixture_measure(ctx).components);
        deepest[stop] = 0.0;
        for (i = 0; i < springls_count(ctx); i++) {
            int left = fixture_origin(ctx, i).x < 15.5f;
            double over = left ? (double)fixture_particle(ctx, i).x - 15.5 : 15.5 - (double)fixture_particle(ctx, i).x;
            deepest[stop] = fmax(deepest[stop], over);
        }
        springls_destroy(ctx);
    }
    ASSERT_GT(deepest[0], 2.0);
    ASSERT_LT(deepest[1], 1.0);
    PASS();
}

SUITE(topology_preserved)
{
    int which, seed;
    for (which = 0; which < 2; which++) {
        RUN_TESTp(merging_is_a_choice, which, 0, 0);
        RUN_TESTp(merging_is_a_choice, which, 1, 0);
        RUN_TESTp(merging_is_a_choice, which, 1, 1);
        for (seed = 1; seed < 4; seed++) RUN_TESTp(topology_survives_storms, which, seed);
    }
    RUN_TEST(springls_stop);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(topology_preserved);
    GREATEST_MAIN_END();
}
