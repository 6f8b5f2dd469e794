/* test_soft_body.c - the example whose own solver drives springls: masses on springs, their hold on springls, and a bar that
   tears. */
#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_soft_body_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_soft_body_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#define main soft_body_main
#include "../../examples/soft_body.c"
#undef main

#include <stdio.h>

static struct bar small_bar(void)
{
    static const float center[3] = {23.5f, 12.0f, 14.0f};
    struct bar bar = {.length = 20.0f, .radius = 4.5f, .pull = 0.2f};
    bar_begin(&bar, center);
    return bar;
}

/* The bar is drawn out, thinnest in the middle, keeps its volume, and tears once, with no spring's force beyond. */
TEST the_solver_draws_out_and_tears(void)
{
    struct bar bar = small_bar();
    const double volume = bar_volume(&bar);
    int torn = 0;
    float thinnest = bar.radius, least = bar.radius;
    for (int f = 0; f < 12; ++f) {
        bar_advance(&bar);
    }
    for (int i = 0; i < MASSES; ++i) {
        thinnest = fminf(thinnest, bar.thickness[i]);
        least = i > MASSES / 3 && i < MASSES - MASSES / 3 ? fminf(least, bar.thickness[i]) : least;
    }
    ASSERT(thinnest == least);
    ASSERT(thinnest < 0.9f * radius_at(&bar, bar.x[MASSES / 2][0], bar.x[MASSES / 2][0]));
    ASSERT_IN_RANGE(1.0, bar_volume(&bar) / volume, 0.02);
    for (int f = 0; f < 200; ++f) {
        bar_advance(&bar);
    }
    for (int i = 0; i < MASSES - 1; ++i) {
        torn += bar.torn[i];
    }
    ASSERT_EQ(1, torn);
    ASSERT(bar.tear_frame > 12 && bar.tear_frame < 150);
    PASS();
}

/* Springls of both sides of the tear hang on springs of their own side; a place on a slice stays on it. */
TEST springls_hang_on_their_masses(void)
{
    struct bar bar = small_bar();
    float x[3];
    memcpy(bar.x_before, bar.x, sizeof bar.x);
    memcpy(bar.thickness_before, bar.thickness, sizeof bar.thickness);
    bar.torn[10] = true;
    memcpy(x, bar.x[10], sizeof x);
    x[0] += 0.5f;
    ASSERT_EQ(9, spring_of(&bar, 10, x));
    x[0] = bar.x[11][0] - 0.5f;
    ASSERT_EQ(11, spring_of(&bar, 11, x));
    ASSERT_EQ(0, spring_of(&bar, 0, bar.x[0]));
    ASSERT_EQ(MASSES - 2, spring_of(&bar, MASSES - 1, bar.x[MASSES - 1]));
    for (int i = 0; i < MASSES; ++i) {
        bar.x[i][1] += 2.0f;
        bar.thickness[i] *= 0.5f;
    }
    memcpy(x, bar.x_before[20], sizeof x);
    x[2] += 3.0f;
    carry(&bar, 20, x);
    ASSERT_IN_RANGE((double)bar.x[20][0], (double)x[0], 1e-4);
    ASSERT_IN_RANGE((double)bar.x[20][1], (double)x[1], 1e-4);
    ASSERT_IN_RANGE((double)bar.x[20][2] + 1.5, (double)x[2], 1e-4);
    PASS();
}

/* A ball of springls becomes two: the level set tears where the solver has. */
TEST the_body_tears(void)
{
    struct run run = {.common = cli_common_defaults()};
    springls_params params = springls_default_params();
    params.components = 1;
    run.tells_events = true;
    run.common.grid = 48;
    run.common.quiet = true;
    ASSERT_EQ(CLI_CONTINUE, set_up(&run, &params, NULL));
    ASSERT_EQ(SPRINGLS_OK, run_frames(&run));
    ASSERT_EQ(1, run.start.components);
    ASSERT_EQ(2, run.end.components);
    ASSERT_EQ(4, run.end.euler);
    ASSERT(run.events > 0);
    ASSERT(run.bar.tear_frame > 10);
    ASSERT(run.parted_frame > 10 && run.parted_frame < run.bar.frame);
    ASSERT_IN_RANGE(1.0, run.end.volume / run.start.volume, 0.1);
    ASSERT(run.end.upper[0] - run.end.lower[0] > 1.1f * (run.start.upper[0] - run.start.lower[0]));
    ASSERT(springls_get_stats(run.ctx).added + springls_get_stats(run.ctx).split > 100);
    free(run.vertices);
    springls_destroy(run.ctx);
    PASS();
}

SUITE(soft_body)
{
    RUN_TEST(the_solver_draws_out_and_tears);
    RUN_TEST(springls_hang_on_their_masses);
    RUN_TEST(the_body_tears);
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(soft_body);
    GREATEST_MAIN_END();
}

#endif
