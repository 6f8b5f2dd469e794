/* test_engine.cc - the game loop of examples/engine_embed.cpp on a small grid, and the code of docs/engine.md. No time is
   asserted. */
#define ENGINE_EMBED_TEST
#include "../../examples/engine_embed.cpp"

#include "engine_sample.h" /* made of docs/engine.md */
#include "greatest.h"
#include "examples/common/springls/exact_flows.h"

static engine::Options small_game(int threads)
{
    engine::Options options;
    options.grid = 32;
    options.frames = 40;
    options.threads = threads;
    options.budget = 1e6; /* a step a frame, however slow the machine is: ms */
    return options;
}

TEST the_game_is_played(int threads)
{
    const engine::Report report = engine::run(small_game(threads));
    ASSERT_EQ(40u, report.update.size());
    ASSERT_EQ(40, report.steps);
    ASSERT(report.rollback_same);
    ASSERT_GT(report.picks, 10);
    ASSERT_GT(report.touches, 0);
    ASSERT_EQ(0u, report.bytes_left);
    ASSERT_GT(report.peak_bytes, report.snapshot_bytes);
    ASSERT_GT(report.triangles, 500u);
    ASSERT_LT(std::fabs(static_cast<double>(report.triangles) / static_cast<double>(report.mesh_triangles) - 1), 0.02);
    PASS();
}

/* A budget that is always too small: frames come before steps are done, and nothing else changes. */
TEST steps_take_many_frames(void)
{
    engine::Options options = small_game(2);
    options.budget = 0.1;
    options.frames = 120;
    const engine::Report report = engine::run(options);
    ASSERT_LT(report.steps, 60);
    ASSERT_GT(engine::quantile(report.frames_a_step, 1), 2);
    ASSERT(report.rollback_same);
    ASSERT_EQ(0u, report.bytes_left);
    PASS();
}

TEST arguments_are_checked(void)
{
    char name[] = "engine_embed", grid[] = "--grid", bad[] = "7", unknown[] = "--fast", quiet[] = "--quiet",
         frames[] = "--frames", one[] = "1", small[] = "32";
    char *too_small[] = {name, grid, bad}, *not_known[] = {name, unknown}, *missing[] = {name, grid},
         *good[] = {name, quiet, frames, one, grid, small};
    ASSERT_EQ(2, engine::main(3, too_small));
    ASSERT_EQ(2, engine::main(2, not_known));
    ASSERT_EQ(2, engine::main(2, missing));
    ASSERT_EQ(0, engine::main(6, good));
    PASS();
}

static int uploads;
static void count_upload(const springls_chunk &) { ++uploads; }

TEST the_page_says_how(void)
{
    springls_desc desc{};
    springls_context *model;
    springls_chunks *chunks;
    springls_sphere ball{{16, 16, 16}, 9};
    struct exact_flow turn = EXACT_ROTATION(16, 16, 10, 0, 0, 1, 0.05f);
    springls_forces forces{};
    springls_step_desc step{};
    int frames = 0;
    bool meshing = false;
    for (int &side : desc.grid.size) side = 32;
    forces.velocity = exact_flow_velocity;
    forces.user = &turn;
    turn.center[0] = 4;
    step.forces = &forces;
    step.dt = 1;
    ASSERT_EQ(SPRINGLS_OK, springls_create(&desc, &model));
    ASSERT_EQ(SPRINGLS_OK, springls_set_implicit(model, springls_implicit_sphere, &ball));
    ASSERT_EQ(SPRINGLS_OK, springls_chunks_create(model, nullptr, &chunks));
    while (!update(model, chunks, step, 1e-4, meshing, count_upload) && frames < 10000) ++frames;
    ASSERT_GT(uploads, 8);
    ASSERT_GT(frames, 0);
    springls_chunks_destroy(model, chunks);
    springls_destroy(model);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TESTp(the_game_is_played, 1);
    RUN_TESTp(the_game_is_played, 3);
    RUN_TEST(steps_take_many_frames);
    RUN_TEST(arguments_are_checked);
    RUN_TEST(the_page_says_how);
    GREATEST_MAIN_END();
}
