/* test_keep_mask.c - springls of the keep mask are moved by advect and by nothing else (section 4.8). */
#include "fixtures.h"

static springls_params set_of(int which) { return which ? springls_default_params() : springls_paper_params(); }

/* A sphere with springls that every stage would change: every third one is, in turn, a sliver, far too large, turned round, or
   far from the zero level; and twins, too close to another springl, at the end. */
static springls_context *bad_sphere(const springls_params *p, uint8_t *mask)
{
    springls_context *ctx = fixture_sphere(32, p, 15.5f, 15.5f, 15.5f, 8.0f);
    int i, m, count = springls_count(ctx);
    for (i = 0; i < count; i++) {
        springls__springl *s = &fixture_here(ctx)->set.s[i];
        springls__v3 n = springls__springl_normal(*s);
        if (i % 3) continue;
        for (m = 0; m < 3; m++) {
            if (i % 4 == 0 && m == 0) s->q[m] = springls__lerp(s->q[1], s->q[2], 0.5f);
            if (i % 4 == 1) s->q[m] = springls__mad(s->p, springls__sub(s->q[m], s->p), 4.0f);
            if (i % 4 == 3) s->q[m] = springls__mad(s->q[m], n, 1.5f);
        }
        if (i % 4 == 2) *s = springls__reversed(*s);
        if (i % 4 == 3) s->p = springls__mad(s->p, n, 1.5f);
        *s = springls__springl_finished(*s);
    }
    for (i = 0; i < 30; i++) {
        springls__springl s = fixture_here(ctx)->set.s[7 * i];
        fixture_add(ctx, s.q[0], s.q[1], s.q[2]);
    }
    springls__constellation_changed(ctx);
    for (i = 0; i < springls_count(ctx); i++) mask[i] = i % 3 == 0 || i >= count;
    return ctx;
}

/* Finds the springl with an id; -1: it is gone. */
static int find_id(const springls_context *ctx, uint32_t id)
{
    const uint32_t *ids = springls_ids(ctx);
    int i;
    for (i = 0; i < springls_count(ctx); i++)
        if (ids[i] == id) return i;
    return -1;
}

/* After steps in a wind springls of the mask have moved by the wind, and kept their shape, their correspondence and their
   age; others have been changed. */
TEST kept_springls_stay_as_they_are(int which, springls_mode mode)
{
    enum { STEPS = 12 };
    springls_params p = set_of(which);
    uint8_t mask[4000];
    springls_context *ctx;
    int i, m, count, changed = 0, gone = 0;
    fixture_springl *before;
    float wind[3] = { 0.05f, -0.04f, 0.03f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, mode, 1.0f);
    d3 moved = d3_make(STEPS * 0.05, STEPS * -0.04, STEPS * 0.03);
    p.lazy_distance = 0.0f;
    ctx = bad_sphere(&p, mask);
    before = fixture_copy(ctx);
    count = springls_count(ctx);
    ASSERT_OK(springls_set_keep_mask(ctx, mask));
    ASSERT_OK(springls_run(ctx, &step, STEPS));
    for (i = 0; i < count; i++) {
        int now = find_id(ctx, before[i].id);
        fixture_springl s;
        double change = 0.0;
        if (mask[i]) ASSERT_GTE(now, 0);
        gone += now < 0;
        if (now < 0) continue;
        s = fixture_get(ctx, now);
        for (m = 0; m < 3; m++) change = fmax(change, d3_distance(d3_add(d3_of(before[i].q[m]), moved), d3_of(s.q[m])));
        if (mask[i]) {
            ASSERT_LT(change, 1e-4);
            ASSERT_MEM_EQ(&before[i].a, &s.a, sizeof s.a);
            ASSERT_EQ(before[i].generation, s.generation);
        } else {
            changed += change > 0.01;
        }
    }
    ASSERT_GT(changed + gone, count / 6);
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* Each of the stages alone would change springls of the mask without it. */
TEST stages_change_what_is_not_kept(int kept)
{
    springls_params p = springls_default_params();
    uint8_t mask[4000];
    springls_context *ctx = bad_sphere(&p, mask);
    springls_stats stats;
    int i, count = springls_count(ctx), removed = 0, split;
    for (i = 0; i < count; i++) mask[i] = (uint8_t)(mask[i] || kept);
    ASSERT_OK(springls_set_keep_mask(ctx, kept ? mask : NULL));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
    split = springls_count(ctx) - count;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    stats = springls_get_stats(ctx);
    removed = count + split - springls_count(ctx);
    if (kept) {
        ASSERT_EQ(0, split);
        ASSERT_EQ(0, removed);
        ASSERT(stats.reshaped == 0);
    } else {
        ASSERT_GT(split, 50);
        ASSERT_GT(removed, 50);
        ASSERT(stats.reshaped > 50);
    }
    springls_destroy(ctx);
    PASS();
}

/* Of two close springls the one that is not kept goes, though it is the older. */
TEST what_is_close_to_a_kept_one_goes(void)
{
    springls_params p = springls_default_params();
    springls_context *ctx = fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, 8.0f);
    uint8_t mask[4000];
    springls__springl s;
    uint32_t old_id, new_id;
    int count;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    count = springls_count(ctx);
    s = fixture_here(ctx)->set.s[count / 2];
    old_id = springls_ids(ctx)[count / 2];
    fixture_add(ctx, s.q[0], s.q[1], s.q[2]);
    ctx->model.set.generation[count] = 9u;
    new_id = springls_ids(ctx)[count];
    memset(mask, 0, sizeof mask);
    mask[count] = 1;
    ASSERT_OK(springls_set_keep_mask(ctx, mask));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_EQ(-1, find_id(ctx, old_id));
    ASSERT_GTE(find_id(ctx, new_id), 0);
    springls_destroy(ctx);
    PASS();
}

SUITE(keep_mask)
{
    RUN_TESTp(kept_springls_stay_as_they_are, 0, SPRINGLS_MODE_FLUID);
    RUN_TESTp(kept_springls_stay_as_they_are, 1, SPRINGLS_MODE_FLUID);
    RUN_TESTp(kept_springls_stay_as_they_are, 1, SPRINGLS_MODE_ELASTIC);
    RUN_TESTp(stages_change_what_is_not_kept, 0);
    RUN_TESTp(stages_change_what_is_not_kept, 1);
    RUN_TEST(what_is_close_to_a_kept_one_goes);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(keep_mask);
    GREATEST_MAIN_END();
}
