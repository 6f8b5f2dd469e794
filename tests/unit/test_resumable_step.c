/* test_resumable_step.c - springls_step_begin and _continue: the same bits however a step is cut, reading in between, what ends a
   step in progress; and the tables that it runs. Time is a clock of the test's own, so that nothing depends on the machine. */
#include "fixtures.h"

enum { FLUID, FLUID_PAPER, ELASTIC, ELASTIC_PAPER, ONLY_ADVECT, CUT, LOCKED, PRESERVED, FAR, EDGES, SCENES };
enum { SIZE = 24 };

/* A clock that goes on by `tick` whenever it is asked. */
typedef struct ticker { double now, tick; } ticker;

static double ticker_now(void *user)
{
    ticker *t = (ticker *)user;
    t->now += t->tick;
    return t->now;
}

typedef struct scene {
    springls_context *ctx;
    struct exact_flow flow;
    springls_forces forces;
    springls_step_desc step;
    ticker clock;
} scene;

static springls_status scene_begin(scene *s, int which)
{
    const int paper = which == FLUID_PAPER || which == ELASTIC_PAPER || which == PRESERVED;
    springls_params p = paper ? springls_paper_params() : springls_default_params();
    springls_desc desc = fixture_desc(SIZE, &p);
    springls_sphere ball = fixture_ball(10.0f, 11.0f, 12.0f, 6.0f);
    springls_box box = { { 11.5f, 11.5f, 11.5f }, { 5.0f, 4.0f, 6.0f } };
    springls_status status;
    memset(s, 0, sizeof *s);
    p.resample_period = 2;
    p.volume_lock = which == LOCKED;
    if (which == PRESERVED) p.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    if (which == FAR) p.relax_iterations = 3;
    s->clock.tick = 1.0;
    desc.trace.now = ticker_now;
    desc.trace.user = &s->clock;
    s->flow.size = (float)SIZE;
    s->flow.period = 3.0f;
    s->forces = fixture_forces(exact_flow_velocity, &s->flow);
    s->step = fixture_step(&s->forces,
                           which == ELASTIC || which == ELASTIC_PAPER ? SPRINGLS_MODE_ELASTIC
                               : which == ONLY_ADVECT                 ? SPRINGLS_MODE_ADVECT_ONLY
                                                                      : SPRINGLS_MODE_FLUID,
                           0.03f);
    if (which == CUT) {
        s->step.dt = 0.12f;
        s->step.max_displacement = 0.6f;
    }
    if (which == PRESERVED) s->step.stop_at_topology = true;
    if (which == FAR) s->step.dt = 0.4f; /* further than phi can be carried */
    status = springls_create(&desc, &s->ctx);
    if (status != SPRINGLS_OK) return status;
    return which == EDGES ? springls_set_implicit(s->ctx, springls_implicit_box, &box)
                          : springls_set_implicit(s->ctx, springls_implicit_sphere, &ball);
}

/* Makes every query that leaves a step in progress, each as if it were the first one since the springls moved. */
static springls_status look_around(springls_context *ctx)
{
    float points[6] = { 3.0f, 4.0f, 5.0f, 11.0f, 12.0f, 13.0f }, out[6];
    uint8_t inside[2];
    springls_hit hit[2];
    ctx->springl_surface_fresh = false;
    SPRINGLS__TRY(springls_sample_distance(ctx, points, 2, out));
    SPRINGLS__TRY(springls_sample_inside(ctx, points, 2, inside));
    SPRINGLS__TRY(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 2, hit));
    SPRINGLS__TRY(springls_closest(ctx, SPRINGLS_SURFACE_SOUP, points, 2, hit));
    if (hit[0].springl < 0 || hit[0].springl >= springls_count(ctx)
        || springls_view_particles(ctx).count != springls_count(ctx))
        return SPRINGLS_NON_FINITE;
    return springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, points + 3, 1, 0.0f, hit);
}

/* Three steps at once, and in parts of `seconds`; every: and somebody looks after every so many of them, 0: never. */
TEST the_same_bits_however_it_is_cut(int which, double seconds, int every)
{
    scene whole, cut;
    int i, calls = 0;
    ASSERT_OK(scene_begin(&whole, which));
    ASSERT_OK(scene_begin(&cut, which));
    for (i = 0; i < 3; i++) {
        bool done = false;
        ASSERT_OK(springls_step(whole.ctx, &whole.step));
        ASSERT_OK(springls_step_begin(cut.ctx, &cut.step));
        while (!done) {
            ASSERT(springls_step_in_progress(cut.ctx));
            ASSERT_OK(springls_step_continue(cut.ctx, seconds, &done));
            if (every && calls % every == 0) ASSERT_OK(look_around(cut.ctx));
            calls++;
        }
        ASSERT(!springls_step_in_progress(cut.ctx));
        ASSERT_EQ(springls_state_hash(whole.ctx), springls_state_hash(cut.ctx));
        ASSERT_EQ(springls_time(whole.ctx), springls_time(cut.ctx));
        ASSERT_EQ(springls_get_stats(whole.ctx).steps, springls_get_stats(cut.ctx).steps);
        ASSERT_EQ(springls_get_stats(whole.ctx).added, springls_get_stats(cut.ctx).added);
        ASSERT_EQ(springls_get_stats(whole.ctx).removed, springls_get_stats(cut.ctx).removed);
    }
    if (seconds == 0.0) ASSERT_GT(calls, which == ONLY_ADVECT ? 9 : 40);
    if (seconds > 1e9) ASSERT_EQ(3, calls);
    springls_destroy(whole.ctx);
    springls_destroy(cut.ctx);
    PASS();
}

/* Moves what is beyond one end of a ball. */
static void pull_end(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)time;
    memset(out, 0, 3 * (size_t)count * sizeof *out);
    for (i = 0; i < count; i++) out[3 * i] = points[3 * i] < 11.0f ? points[3 * i] - 11.0f : 0.0f;
}

/* A query between measuring how far springls have moved and looking which of them stir wakes nothing. */
TEST queries_wake_nothing(void)
{
    springls_forces forces = fixture_forces(pull_end, NULL);
    springls_step_desc rest, pull = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.05f);
    springls_context *whole, *cut;
    bool done = false;
    int i, b, asleep = 0;
    memset(&rest, 0, sizeof rest);
    whole = fixture_sphere(48, NULL, 23.5f, 23.5f, 23.5f, 14.0f);
    cut = fixture_sphere(48, NULL, 23.5f, 23.5f, 23.5f, 14.0f);
    for (b = 0; b < 2; b++) {
        springls_context *ctx = b ? cut : whole;
        springls_params p = springls_get_params(ctx);
        p.lazy_distance = 0.0f;
        ASSERT_OK(springls_set_params(ctx, &p));
        for (i = 0; i < 40; i++) ASSERT_OK(springls_step(ctx, &rest));
        ASSERT(ctx->at_rest);
    }
    ASSERT_OK(springls_step(whole, &pull));
    ASSERT_OK(springls_step_begin(cut, &pull));
    while (!done) {
        ASSERT_OK(springls_step_continue(cut, 0.0, &done));
        ASSERT_OK(look_around(cut));
    }
    ASSERT_OK(springls__to_host(whole, SPRINGLS__BIT(CALM), 0));
    ASSERT_OK(springls__to_host(cut, SPRINGLS__BIT(CALM), 0));
    ASSERT_EQ(whole->model.grid.slot_count, cut->model.grid.slot_count);
    for (i = SPRINGLS__FIRST_SLOT * SPRINGLS__OCTANTS; i < whole->model.grid.slot_count * SPRINGLS__OCTANTS; i++) {
        ASSERT_EQ(whole->model.grid.calm[i], cut->model.grid.calm[i]);
        asleep += whole->model.grid.calm[i] > 0;
    }
    ASSERT_GT(asleep, 0);
    ASSERT_EQ(springls_state_hash(whole), springls_state_hash(cut));
    springls_destroy(whole);
    springls_destroy(cut);
    PASS();
}

/* A clock that goes on with the work that is given out: `cost` seconds an element. */
static double work_clock;
static void costly_for(void *user, int count, int grain, springls_task task, void *arg)
{
    (void)grain;
    work_clock += *(const double *)user * (double)count;
    task(arg, 0, count);
}

static double work_now(void *user)
{
    (void)user;
    return work_clock;
}

/* Loops that are cut take no longer than they are allowed, but for a smallest piece or a loop that is not cut. */
TEST a_budget_is_kept(void)
{
    double cost = 1e-6, longest = 0.0, sum = 0.0;
    const double budget = 1e-3;
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_sphere ball = fixture_ball(11.5f, 11.5f, 11.5f, 8.0f);
    scene s;
    bool done = false;
    int calls = 0;
    if (desc.backend) SKIPm("a device does loops whole");
    ASSERT_OK(scene_begin(&s, FLUID));
    springls_destroy(s.ctx);
    desc.tasks.parallel_for = costly_for;
    desc.tasks.user = &cost;
    desc.trace.now = work_now;
    work_clock = 0.0;
    ASSERT_OK(springls_create(&desc, &s.ctx));
    ASSERT_OK(springls_set_implicit(s.ctx, springls_implicit_sphere, &ball));
    ASSERT_OK(springls_step_begin(s.ctx, &s.step));
    while (!done) {
        double before = work_clock;
        ASSERT_OK(springls_step_continue(s.ctx, budget, &done));
        if (work_clock - before > longest) longest = work_clock - before;
        sum += work_clock - before;
        calls++;
    }
    ASSERT_GT(sum, 10.0 * budget);
    ASSERT_GT(calls, 8);
    ASSERT_LT(longest, budget + cost * 1.5 * springls_count(s.ctx));
    springls_destroy(s.ctx);
    PASS();
}

typedef enum ender {
    BY_STEP,
    BY_STAGE,
    BY_PARAMS,
    BY_TIME,
    BY_MASK,
    BY_REFERENCE,
    BY_SPEED,
    BY_MESH,
    BY_MEASURE,
    BY_CHUNKS,
    BY_SNAPSHOT,
    BY_ATTRIBUTE,
    BY_OFFSET,
    BY_COMBINING,
    BY_BEGIN,
    ENDERS
} ender;

static springls_status end_by(scene *s, ender which)
{
    springls_context *ctx = s->ctx;
    springls_params p = springls_get_params(ctx);
    springls_measures measures;
    springls_mesh mesh;
    springls_chunks *chunks;
    const springls_chunk *changed;
    springls_sphere bite = fixture_ball(13.0f, 12.0f, 12.0f, 4.0f);
    springls_attribute_desc heat = { "heat", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    springls_status status = SPRINGLS_OK;
    float speed;
    size_t size;
    int count;
    switch (which) {
    case BY_STEP: return springls_step(ctx, &s->step);
    case BY_STAGE: return springls_run_stage(ctx, SPRINGLS_STAGE_RELAX);
    case BY_PARAMS: return springls_set_params(ctx, &p);
    case BY_TIME: springls_set_time(ctx, springls_time(ctx)); return SPRINGLS_OK;
    case BY_MASK: return springls_set_keep_mask(ctx, NULL);
    case BY_REFERENCE: return springls_set_reference(ctx);
    case BY_SPEED: return springls_max_speed(ctx, &s->forces, 0.0f, &speed);
    case BY_MESH:
        status = springls_extract_mesh(ctx, &mesh);
        springls_mesh_free(ctx, &mesh);
        return status;
    case BY_MEASURE: return springls_measure(ctx, &measures);
    case BY_CHUNKS:
        status = springls_chunks_create(ctx, NULL, &chunks);
        if (status == SPRINGLS_OK) status = springls_chunks_update(ctx, chunks, &changed, &count);
        springls_chunks_destroy(ctx, chunks);
        return status;
    case BY_SNAPSHOT: return springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size);
    case BY_OFFSET: return springls_offset(ctx, 0.5f);
    case BY_COMBINING: return springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &bite);
    case BY_ATTRIBUTE: return springls_add_attribute(ctx, &heat, NULL, NULL);
    default: return springls_step_begin(ctx, &s->step);
    }
}

/* What needs the model whole ends the step first, and then does what it does after a whole step. */
TEST others_end_the_step(int which)
{
    scene whole, cut;
    bool done;
    int i;
    ASSERT_OK(scene_begin(&whole, FLUID));
    ASSERT_OK(scene_begin(&cut, FLUID));
    for (i = 0; i < 2; i++) ASSERT_OK(springls_step(whole.ctx, &whole.step));
    ASSERT_OK(springls_step(cut.ctx, &cut.step));
    ASSERT_OK(springls_step_begin(cut.ctx, &cut.step));
    for (i = 0; i < 12; i++) ASSERT_OK(springls_step_continue(cut.ctx, 0.0, &done));
    ASSERT(!done);
    ASSERT_OK(end_by(&whole, (ender)which));
    ASSERT_OK(end_by(&cut, (ender)which));
    ASSERT_EQ(which == BY_BEGIN, springls_step_in_progress(cut.ctx));
    ASSERT_EQ(springls_get_stats(whole.ctx).steps, springls_get_stats(cut.ctx).steps);
    ASSERT_EQ(springls_state_hash(whole.ctx), springls_state_hash(cut.ctx));
    springls_destroy(whole.ctx);
    springls_destroy(cut.ctx);
    PASS();
}

/* Inputs and reset drop it; the next life is like any. */
TEST inputs_drop_the_step(int by_reset)
{
    springls_sphere ball = fixture_ball(12.0f, 12.0f, 12.0f, 5.0f);
    scene s, other;
    bool done;
    int i;
    ASSERT_OK(scene_begin(&s, FLUID));
    ASSERT_OK(scene_begin(&other, FLUID));
    ASSERT_OK(springls_step_begin(s.ctx, &s.step));
    for (i = 0; i < 7; i++) ASSERT_OK(springls_step_continue(s.ctx, 0.0, &done));
    ASSERT(!done);
    if (by_reset) {
        ASSERT_OK(springls_reset(s.ctx));
        ASSERT_EQ(0, springls_count(s.ctx));
        ASSERT(!springls_step_in_progress(s.ctx));
    }
    ASSERT_OK(springls_set_implicit(s.ctx, springls_implicit_sphere, &ball));
    ASSERT_OK(springls_set_implicit(other.ctx, springls_implicit_sphere, &ball));
    ASSERT(!springls_step_in_progress(s.ctx));
    ASSERT_OK(springls_step(s.ctx, &s.step));
    ASSERT_OK(springls_step(other.ctx, &other.step));
    ASSERT_EQ(springls_state_hash(other.ctx), springls_state_hash(s.ctx));
    springls_destroy(s.ctx);
    springls_destroy(other.ctx);
    PASS();
}

static void broken(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)points;
    (void)time;
    for (i = 0; i < 3 * count; i++) out[i] = i % 7 == 3 ? (float)NAN : 0.1f;
}

/* A force that fails ends the step with the model as it was. */
TEST failures_end_the_step(void)
{
    scene s;
    uint64_t before;
    springls_status status = SPRINGLS_OK;
    bool done = false;
    ASSERT_OK(scene_begin(&s, FLUID));
    ASSERT_OK(springls_step(s.ctx, &s.step));
    before = springls_state_hash(s.ctx);
    s.forces.velocity = broken;
    ASSERT_OK(springls_step_begin(s.ctx, &s.step));
    while (status == SPRINGLS_OK && !done) status = springls_step_continue(s.ctx, 0.0, &done);
    ASSERT_STATUS(SPRINGLS_NON_FINITE, status);
    ASSERT(done);
    ASSERT(!springls_step_in_progress(s.ctx));
    ASSERT_EQ(before, springls_state_hash(s.ctx));
    s.forces.velocity = exact_flow_velocity;
    ASSERT_OK(springls_step(s.ctx, &s.step));
    springls_destroy(s.ctx);
    PASS();
}

/* _begin copies what it is given. */
TEST descriptions_are_copied(void)
{
    scene whole, cut;
    bool done = false;
    ASSERT_OK(scene_begin(&whole, FLUID));
    ASSERT_OK(scene_begin(&cut, FLUID));
    ASSERT_OK(springls_step(whole.ctx, &whole.step));
    ASSERT_OK(springls_step_begin(cut.ctx, &cut.step));
    memset(&cut.forces, 0, sizeof cut.forces);
    memset(&cut.step, 0, sizeof cut.step);
    while (!done) ASSERT_OK(springls_step_continue(cut.ctx, 0.0, &done));
    ASSERT_EQ(springls_state_hash(whole.ctx), springls_state_hash(cut.ctx));
    springls_destroy(whole.ctx);
    springls_destroy(cut.ctx);
    PASS();
}

static int depth[SPRINGLS_STAGE_COUNT], unbalanced;
static void watch(void *user, int stage, int begin, double seconds)
{
    (void)user;
    depth[stage] += begin ? 1 : -1;
    unbalanced += depth[stage] < 0 || depth[stage] > 1 || seconds < 0.0;
}

/* Every stage that has begun for the trace ends there, of steps that are dropped too, and its clock stands still between
   parts. */
TEST stages_are_traced_once(void)
{
    springls_desc desc = fixture_desc(SIZE, NULL);
    scene s;
    bool done = false;
    int i;
    ASSERT_OK(scene_begin(&s, FLUID));
    springls_destroy(s.ctx);
    s.clock.tick = 0.0;
    desc.trace.now = ticker_now;
    desc.trace.user = &s.clock;
    desc.trace.stage = watch;
    memset(depth, 0, sizeof depth);
    unbalanced = 0;
    ASSERT_OK(springls_create(&desc, &s.ctx));
    for (i = 0; i < 2; i++) {
        springls_sphere ball = fixture_ball(11.0f, 11.0f, 12.0f, 6.0f);
        int call;
        ASSERT_OK(springls_set_implicit(s.ctx, springls_implicit_sphere, &ball));
        ASSERT_OK(springls_step_begin(s.ctx, &s.step));
        for (call = 0, done = false; !done && (i == 1 || call < 4); call++) {
            s.clock.now += 100.0; /* between the calls */
            ASSERT_OK(springls_step_continue(s.ctx, 0.0, &done));
        }
    }
    ASSERT(done);
    ASSERT_EQ(0, unbalanced);
    for (i = 0; i < SPRINGLS_STAGE_COUNT; i++) {
        ASSERT_EQ(0, depth[i]);
        ASSERT_EQ(0.0, springls_get_stats(s.ctx).seconds[i]);
    }
    springls_destroy(s.ctx);
    PASS();
}

/* What the entries of a table have done, a letter each. */
static char did[32];

static springls_status note(char letter)
{
    const size_t n = strlen(did);
    if (n + 1 < sizeof did) did[n] = letter;
    return SPRINGLS_OK;
}

static springls_status do_a(springls_context *ctx) { return ctx ? note('a') : SPRINGLS_OUT_OF_MEMORY; }
static springls_status do_b(springls_context *ctx) { return ctx ? note('b') : SPRINGLS_OUT_OF_MEMORY; }
static springls_status do_c(springls_context *ctx) { return ctx ? note('c') : SPRINGLS_OUT_OF_MEMORY; }
static springls_status do_fail(springls_context *ctx) { return ctx ? SPRINGLS_CANCELLED : SPRINGLS_OUT_OF_MEMORY; }
static bool never(const springls_context *ctx) { return !ctx; }
static bool always(const springls_context *ctx) { return ctx != NULL; }
static bool thrice(const springls_context *ctx) { return springls__round(ctx) < 3; }
static bool in_second_round(const springls_context *ctx) { return springls__round(ctx) == 1; }

/* Blocks are left out or repeated whole, one inside the other and one after the other; a table that is called counts rounds of its own. */
TEST a_table_runs_as_it_reads(void)
{
    static const springls__entry inner[] = {
        SPRINGLS__REPEAT_WHILE(springls__twice) SPRINGLS__DO(do_c) SPRINGLS__END
    SPRINGLS__END };
    static const springls__entry outer[] = {
        SPRINGLS__DO(do_a)
        SPRINGLS__IF(never)
            SPRINGLS__REPEAT_WHILE(always) SPRINGLS__DO(do_fail) SPRINGLS__END
            SPRINGLS__IF(always) SPRINGLS__DO(do_fail) SPRINGLS__END
        SPRINGLS__END
        SPRINGLS__REPEAT_WHILE(thrice)
            SPRINGLS__IF(in_second_round) SPRINGLS__DO(do_b) SPRINGLS__END
            SPRINGLS__CALL(inner)
        SPRINGLS__END
        SPRINGLS__REPEAT_WHILE(never) SPRINGLS__DO(do_fail) SPRINGLS__END
        SPRINGLS__REPEAT_WHILE(springls__twice) SPRINGLS__DO(do_a) SPRINGLS__END
    SPRINGLS__END };
    static const springls__entry failing[] = {
        SPRINGLS__CALL(inner)
        SPRINGLS__REPEAT_WHILE(always) SPRINGLS__DO(do_fail) SPRINGLS__END
    SPRINGLS__END };
    springls_context *ctx = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 4.0f);
    memset(did, 0, sizeof did);
    ASSERT_OK(springls__run_table(ctx, outer));
    ASSERT_STR_EQ("accbccccaa", did);
    ASSERT_EQ(SPRINGLS_CANCELLED, springls__run_stage(ctx, (int)SPRINGLS_STAGE_RELAX, failing));
    ASSERT_STR_EQ("accbccccaacc", did);
    ASSERT_EQ(0, ctx->work.depth);
    springls_destroy(ctx);
    PASS();
}

TEST wrong_arguments_are_told(void)
{
    scene s;
    bool done = false;
    springls_step_desc bad;
    ASSERT_OK(scene_begin(&s, FLUID));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step_begin(NULL, &s.step));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step_begin(s.ctx, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step_continue(NULL, 1.0, &done));
    ASSERT(done);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step_continue(s.ctx, 1.0, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step_continue(s.ctx, (double)NAN, &done));
    done = false;
    ASSERT_OK(springls_step_continue(s.ctx, 1.0, &done)); /* nothing to do */
    ASSERT(done);
    ASSERT(!springls_step_in_progress(NULL));
    ASSERT_OK(springls_step_begin(s.ctx, &s.step));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step_continue(s.ctx, (double)NAN, &done));
    ASSERT(!done); /* it goes on */
    while (!done) ASSERT_OK(springls_step_continue(s.ctx, 1.0, &done));
    bad = s.step;
    bad.dt = -1.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step_begin(s.ctx, &bad));
    ASSERT(!springls_step_in_progress(s.ctx));
    s.forces.region_lower[1] = 3.0f; /* above region_upper: found now, not by the call that completes the step */
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step_begin(s.ctx, &s.step));
    ASSERT(strstr(springls_last_error(s.ctx), "from 3 to 0 along axis 1"));
    s.forces.region_lower[1] = 0.0f;
    s.forces.integrator = (springls_integrator)7;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step_begin(s.ctx, &s.step));
    ASSERT(strstr(springls_last_error(s.ctx), "no integrator 7"));
    ASSERT(!springls_step_in_progress(s.ctx));
    s.forces.integrator = SPRINGLS_INTEGRATOR_RK4;
    ASSERT_OK(springls_reset(s.ctx));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_step_begin(s.ctx, &s.step));
    springls_destroy(s.ctx);
    springls_destroy(NULL);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    int which;
    GREATEST_MAIN_BEGIN();
    for (which = 0; which < SCENES; which++) {
        RUN_TESTp(the_same_bits_however_it_is_cut, which, 0.0, 0);
        RUN_TESTp(the_same_bits_however_it_is_cut, which, 0.0, 1);
        RUN_TESTp(the_same_bits_however_it_is_cut, which, 7.0, 3);
    }
    RUN_TESTp(the_same_bits_however_it_is_cut, FLUID, 23.0, 0);
    RUN_TESTp(the_same_bits_however_it_is_cut, FLUID, HUGE_VAL, 0);
    RUN_TEST(queries_wake_nothing);
    RUN_TEST(a_budget_is_kept);
    for (which = 0; which < ENDERS; which++) RUN_TESTp(others_end_the_step, which);
    RUN_TESTp(inputs_drop_the_step, 0);
    RUN_TESTp(inputs_drop_the_step, 1);
    RUN_TEST(failures_end_the_step);
    RUN_TEST(descriptions_are_copied);
    RUN_TEST(stages_are_traced_once);
    RUN_TEST(a_table_runs_as_it_reads);
    RUN_TEST(wrong_arguments_are_told);
    GREATEST_MAIN_END();
}
