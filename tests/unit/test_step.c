/* test_step.c - Algorithms 2 and 3: which stages run in which order and how they are timed, how far a step goes, when a run
   stops, and whether the model arrives where its forces send it. */
#include "fixtures.h"

static springls_params set_of(int which) { return which ? springls_default_params() : springls_paper_params(); }

/* ---- stages in order ---- */

enum { MOST_EVENTS = 4096 };

typedef struct diary {
    int stage[MOST_EVENTS], begin[MOST_EVENTS], count;
    double seconds[MOST_EVENTS], clock;
} diary;

static void note(void *user, int stage, int begin, double seconds)
{
    diary *d = (diary *)user;
    if (d->count == MOST_EVENTS) return;
    d->stage[d->count] = stage;
    d->begin[d->count] = begin;
    d->seconds[d->count++] = seconds;
}

/* A clock that goes on by a quarter of a second with every look at it. */
static double look(void *user)
{
    diary *d = (diary *)user;
    return d->clock += 0.25;
}

static springls_context *traced(int which, float lazy_distance, diary *d)
{
    springls_params p = set_of(which);
    springls_desc desc = fixture_desc(32, &p);
    springls_sphere sphere = fixture_ball(13.5f, 15.5f, 15.5f, 8.0f);
    springls_context *ctx = NULL;
    p.lazy_distance = lazy_distance;
    memset(d, 0, sizeof *d);
    desc.trace.stage = note;
    desc.trace.now = look;
    desc.trace.user = d;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return NULL;
    springls_set_implicit(ctx, springls_implicit_sphere, &sphere);
    d->count = 0;
    return ctx;
}

/* The initials of the stages that have begun since: A R C S(plit: resample) E B(uild) F U P K V; tracking is part of F. */
static const char *stages_since(diary *d, int from)
{
    static const char initial[] = "ARCSEBFTUPKV";
    static char text[256];
    int i, n = 0;
    for (i = from; i < d->count && n < 255; i++)
        if (d->begin[i] && d->stage[i] != SPRINGLS_STAGE_TRACK) text[n++] = initial[d->stage[i]];
    text[n] = '\0';
    return text;
}

/* The manual's DATA FLOW, to the letter. */
TEST stages_run_in_order(int which, springls_mode mode, int one_to_one)
{
    static diary d;
    springls_context *ctx = traced(which, 0.0f, &d);
    float wind[3] = { 0.3f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, mode, 1.0f);
    int i, from;
    step.one_to_one = one_to_one;
    for (i = 1; i <= 11; i++) {
        const char *expected = "A";
        from = d.count;
        ASSERT_OK(springls_step(ctx, &step));
        if (mode == SPRINGLS_MODE_FLUID && which == 0) expected = i % 5 || one_to_one ? "AREBEBEBEB" : "ARCSREBEBEBEBF";
        if (mode == SPRINGLS_MODE_FLUID && which == 1) expected = one_to_one ? "ARP" : i % 5 ? "AP" : "ARPCSFR";
        if (mode == SPRINGLS_MODE_ELASTIC && which == 0) expected = one_to_one ? "AUEBEBEBEBR" : "AUEBEBEBEBRFCS";
        if (mode == SPRINGLS_MODE_ELASTIC && which == 1) expected = one_to_one ? "AUEBEBEBPR" : "AUEBEBEBPRFCSR";
        ASSERT_STR_EQ(expected, stages_since(&d, from));
    }
    springls_destroy(ctx);
    PASS();
}

/* A step only advects while springls have moved less than lazy_distance, the next step as far as this one; resampling comes with
   every fifth whole step. The first time phi follows after 0.15 voxel: whether there are thin sheets is not known. */
TEST lazy_steps_only_advect(void)
{
    static diary d;
    springls_context *ctx = traced(1, 2.1f, &d);
    float wind[3] = { 0.5f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    int i, from, whole = 0;
    for (i = 0; i < 22; i++) {
        const char *expected = i % 4 ? "A" : ++whole % 5 ? "AP" : "ARPCSFR";
        if (i == 12) wind[0] = -0.5f;
        from = d.count;
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_STR_EQ(expected, stages_since(&d, from));
        ASSERT_EQ(i + 1, springls_get_stats(ctx).steps);
    }
    springls_destroy(ctx);
    PASS();
}

/* A step that goes much further than the lazy ones before it makes phi follow first, so that it can be carried along. */
TEST phi_follows_before_a_sudden_step(void)
{
    static diary d;
    springls_context *ctx = traced(1, 2.6f, &d);
    float wind[3] = { 0.3f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    int i, from = 0;
    step.max_displacement = 3.0f;
    for (i = 0; i < 9; i++) {
        from = d.count;
        if (i == 8) wind[0] = 1.95f;
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_STR_EQ(i == 0 ? "AP" : i < 8 ? "A" : "PAP", stages_since(&d, from));
    }
    springls_destroy(ctx);
    PASS();
}

/* Turns about the middle of the grid, by *angle a unit of time. */
static void turn(void *angle, const float *points, int count, float time, float *out)
{
    const float middle = 16.0f, a = *(const float *)angle;
    int i;
    (void)time;
    for (i = 0; i < count; i++) {
        out[3 * i] = a * (middle - points[3 * i + 1]);
        out[3 * i + 1] = a * (points[3 * i] - middle);
        out[3 * i + 2] = 0.0f;
    }
}

/* Phi follows before springls have turned by more than 0.18, however little they have moved. */
TEST phi_follows_when_springls_turn(void)
{
    static diary d;
    springls_context *ctx = traced(1, 3.5f, &d);
    float angle = 0.04f;
    springls_forces forces = fixture_forces(turn, &angle);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    int i, from;
    for (i = 0; i < 9; i++) {
        from = d.count;
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_LT(springls_get_stats(ctx).largest_displacement, 0.5f);
        ASSERT_STR_EQ(i % 4 ? "A" : "AP", stages_since(&d, from));
    }
    springls_destroy(ctx);
    PASS();
}

/* Sub-steps are equal parts of the lazy distance, no longer than max_displacement; a whole step of 3.5 voxels counts as two of
   resample_period. */
TEST substeps_divide_the_lazy_distance(void)
{
    static diary d;
    springls_context *ctx = traced(1, 3.5f, &d);
    float wind[3] = { 1.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.2f);
    int i, from;
    ASSERT_OK(springls_step(ctx, &step)); /* a whole one: whether there are thin sheets is not known */
    step.dt = 3.47f;
    step.max_displacement = 2.0f;
    for (i = 0; i < 6; i++) {
        from = d.count;
        wind[0] = i % 2 ? 1.0f : -1.0f;
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_IN_RANGE(1.735f, springls_get_stats(ctx).largest_displacement, 1e-3f);
        ASSERT_STR_EQ(i % 3 == 1 ? "AARPCSFR" : "AAP", stages_since(&d, from));
    }
    springls_destroy(ctx);
    PASS();
}

static void no_pressure(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    (void)user, (void)points, (void)normals, (void)time;
    memset(out, 0, sizeof *out * (size_t)count);
}

/* Relax turns springls in every step that does not move their vertices with a flow. */
TEST relax_is_left_out_in_a_flow_only(int pressure, int wind, float curvature)
{
    static diary d;
    springls_context *ctx = traced(1, 0.0f, &d);
    float along[3] = { 0.3f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(wind ? fixture_wind : NULL, along);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
    int from = d.count;
    if (pressure) forces.pressure = no_pressure;
    forces.curvature_weight = curvature;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_STR_EQ(pressure || !wind || curvature > 0.0f ? "ARP" : "AP", stages_since(&d, from));
    springls_destroy(ctx);
    PASS();
}

/* Begins and ends pair up; a begin has no time; an end has the clock's time since its begin, inner stages included; the
   statistics add them up. */
TEST stages_are_timed(int which)
{
    static diary d;
    springls_context *ctx = traced(which, 0.0f, &d);
    float wind[3] = { 0.3f, 0.2f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_stats stats;
    double sum[SPRINGLS_STAGE_COUNT] = { 0.0 }, before[SPRINGLS_STAGE_COUNT];
    int open[16], inside[16], depth = 0, i;
    stats = springls_get_stats(ctx);
    memcpy(before, stats.seconds, sizeof before);
    for (i = 0; i < 5; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_LT(d.count, MOST_EVENTS);
    for (i = 0; i < d.count; i++) {
        if (d.begin[i]) {
            ASSERT_EQ(0.0, d.seconds[i]);
            ASSERT_LT(depth, 16);
            open[depth] = d.stage[i];
            inside[depth++] = 0;
            continue;
        }
        ASSERT_GT(depth, 0);
        depth--;
        ASSERT_EQ(open[depth], d.stage[i]);
        ASSERT_EQ(0.25 + 0.5 * inside[depth], d.seconds[i]);
        sum[d.stage[i]] += d.seconds[i];
        if (depth > 0) inside[depth - 1] += 1 + inside[depth];
    }
    ASSERT_EQ(0, depth);
    stats = springls_get_stats(ctx);
    for (i = 0; i < SPRINGLS_STAGE_COUNT; i++) ASSERT_EQ(sum[i], stats.seconds[i] - before[i]);
    ASSERT_EQ(1.25, sum[SPRINGLS_STAGE_ADVECT]);
    springls_destroy(ctx);
    PASS();
}

TEST stages_have_names(void)
{
    int i, j;
    for (i = 0; i < SPRINGLS_STAGE_COUNT; i++)
        for (j = 0; j < i; j++) ASSERT(strcmp(springls_stage_name((springls_stage)i), springls_stage_name((springls_stage)j)) != 0);
    ASSERT_STR_EQ("advect", springls_stage_name(SPRINGLS_STAGE_ADVECT));
    ASSERT_STR_EQ("unsigned_to_signed", springls_stage_name(SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    ASSERT_STR_EQ("", springls_stage_name(SPRINGLS_STAGE_COUNT));
    ASSERT_STR_EQ("", springls_stage_name((springls_stage)-1));
    PASS();
}

/* ---- where the model goes ---- */

/* The mean distance of the zero level from a sphere, and of the correspondences from where they should be when the model
   has only been shifted. */
static double tracking_error(springls_context *ctx, d3 shift)
{
    double sum = 0.0;
    int i, count = springls_count(ctx);
    for (i = 0; i < count; i++) sum += d3_distance(d3_sub(d3_of(fixture_particle(ctx, i)), shift), d3_of(fixture_origin(ctx, i)));
    return sum / count;
}

/* A sphere in the wind arrives where the wind sends it, as large as it was, with its correspondences. With the paper's
   rules it starts from springls of two voxels, which lie 4 / (8 * 8) inside the sphere, and its level set lags behind. */
TEST wind_carries_the_model(int which, springls_mode mode, float dt, int steps)
{
    springls_params p = set_of(which);
    springls_context *ctx = fixture_sphere(40, &p, 13.5f, 19.5f, 19.5f, 8.0f);
    float wind[3] = { 1.0f, 0.3f, -0.2f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, mode, dt);
    double t = (double)dt * steps;
    d3 shift = d3_make(t, 0.3 * t, -0.2 * t);
    springls_measures before, after;
    fixture_error error;
    int i;
    ASSERT_OK(springls_measure(ctx, &before));
    for (i = 0; i < steps; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_IN_RANGE(t, springls_time(ctx), 1e-5);
    ASSERT_EQ(steps, springls_get_stats(ctx).steps);
    error = fixture_sphere_error(ctx, d3_add(d3_make(13.5, 19.5, 19.5), shift), 8.0);
    ASSERT_IN_RANGE(0.0, error.mean, which ? 0.03 : 0.25);
    ASSERT_IN_RANGE(0.0, error.max, which ? 0.2 : 0.6);
    ASSERT_IN_RANGE(0.0, tracking_error(ctx, shift), which ? 0.05 : 0.4);
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_EQ(1, after.components);
    ASSERT_EQ(2, after.euler);
    ASSERT_IN_RANGE(0.0, (after.volume - before.volume) / before.area, which ? 0.02 : 0.2);
    springls_destroy(ctx);
    PASS();
}

static void blow_up(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)points;
    (void)normals;
    (void)time;
    for (i = 0; i < count; i++) out[i] = 1.0f;
}

/* Pressure blows a sphere up from radius 5 to 9: springls split or are added, and all of it stays covered. */
TEST pressure_blows_it_up(int which)
{
    springls_params p = set_of(which);
    springls_context *ctx = fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, 5.0f);
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.4f);
    springls_measures measures;
    springls_mesh mesh;
    int i;
    double radius;
    forces.pressure = blow_up;
    for (i = 0; i < 10; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_OK(springls_measure(ctx, &measures));
    radius = cbrt(measures.volume * 0.75 / fixture_pi);
    ASSERT_IN_RANGE(9.0, radius, which ? 0.1 : 0.5);
    ASSERT_EQ(2, measures.euler);
    ASSERT_GT(springls_get_stats(ctx).split + springls_get_stats(ctx).added, 100);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    for (i = 0; i < mesh.vertex_count; i++) ASSERT(mesh.springls[i] >= 0);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* Without resampling springl i stays springl i, whatever happens to it. */
TEST one_to_one_keeps_them(int which, springls_mode mode)
{
    springls_params p = set_of(which);
    springls_context *ctx = fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, 6.0f);
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, mode, 0.4f);
    fixture_springl *before = fixture_copy(ctx);
    int i, count = springls_count(ctx);
    forces.pressure = blow_up;
    step.one_to_one = true;
    for (i = 0; i < 8; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(count, springls_count(ctx));
    for (i = 0; i < count; i++) {
        fixture_springl s = fixture_get(ctx, i);
        ASSERT_EQ(before[i].id, s.id);
        ASSERT_MEM_EQ(&before[i].a, &s.a, sizeof s.a);
        ASSERT_GT(d3_distance(d3_of(s.p), d3_make(15.5, 15.5, 15.5)), 8.5);
    }
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* Advecting only: springls move, the level set stays, to the bit. */
TEST advect_only_leaves_phi(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 13.5f, 15.5f, 15.5f, 8.0f);
    float wind[3] = { 2.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_ADVECT_ONLY, 1.0f);
    float *before = fixture_phi(ctx), *after;
    fixture_springl *was = fixture_copy(ctx);
    int i, m;
    ASSERT_OK(springls_step(ctx, &step));
    after = fixture_phi(ctx);
    ASSERT_MEM_EQ(before, after, 32 * 32 * 32 * sizeof *before);
    for (i = 0; i < springls_count(ctx); i++) {
        fixture_springl s = fixture_get(ctx, i);
        ASSERT_LT(d3_distance(d3_add(d3_of(was[i].p), d3_make(2.0, 0.0, 0.0)), d3_of(s.p)), 1e-5);
        for (m = 0; m < 3; m++) ASSERT_LT(d3_distance(d3_add(d3_of(was[i].q[m]), d3_make(2.0, 0.0, 0.0)), d3_of(s.q[m])), 1e-5);
        ASSERT_MEM_EQ(&was[i].a, &s.a, sizeof s.a);
    }
    free(before);
    free(after);
    free(was);
    springls_destroy(ctx);
    PASS();
}

/* Springls of the mask are carried, not relaxed: the wind does not bend them, relaxing would. */
TEST masked_springls_keep_their_shape(void)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    float wind[3] = { 0.3f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    fixture_springl *was;
    int i, m, count, bent = 0;
    uint8_t *mask;
    p.lazy_distance = 0.0f;
    ctx = fixture_sphere(32, &p, 13.5f, 15.5f, 15.5f, 8.0f);
    was = fixture_copy(ctx);
    count = springls_count(ctx);
    mask = (uint8_t *)malloc((size_t)count);
    step.one_to_one = true;
    for (i = 0; i < count; i++) mask[i] = (uint8_t)(i % 3 == 0);
    ASSERT_OK(springls_set_keep_mask(ctx, mask));
    for (i = 0; i < 3; i++) ASSERT_OK(springls_step(ctx, &step));
    for (i = 0; i < count; i++) {
        fixture_springl s = fixture_get(ctx, i);
        double change = 0.0;
        for (m = 0; m < 3; m++)
            change = fmax(change, d3_distance(d3_sub(d3_of(s.q[m]), d3_of(s.p)), d3_sub(d3_of(was[i].q[m]), d3_of(was[i].p))));
        if (mask[i]) ASSERT_LT(change, 1e-5);
        else bent += change > 1e-3;
    }
    ASSERT_GT(bent, count / 3);
    free(mask);
    free(was);
    springls_destroy(ctx);
    PASS();
}

/* eq. 24-25 let springls go that nothing holds: a free model moves the same with and without the stop, which lets no step be
   lazy. */
TEST free_springls_are_not_stopped(int which)
{
    uint64_t hash[2];
    int stop, i;
    for (stop = 0; stop < 2; stop++) {
        springls_params p = set_of(which);
        springls_context *ctx;
        float wind[3] = { 0.4f, 0.1f, 0.0f };
        springls_forces forces = fixture_forces(fixture_wind, wind);
        springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
        p.lazy_distance = 0.0f;
        ctx = fixture_sphere(32, &p, 13.5f, 15.5f, 15.5f, 7.0f);
        step.stop_at_topology = stop;
        for (i = 0; i < 7; i++) ASSERT_OK(springls_step(ctx, &step));
        hash[stop] = springls_state_hash(ctx);
        springls_destroy(ctx);
    }
    ASSERT(hash[0] == hash[1]);
    PASS();
}

/* ---- how far a step goes ---- */

/* dt = 0: the fastest springl moves by max_displacement, or by two voxels, which suit the default parameters. */
TEST step_is_as_long_as_allowed(float max_displacement)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    struct exact_flow flow = EXACT_ROTATION(15.5f, 15.5f, 15.5f, 0.0f, 0.0f, 1.0f, 3.0f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_ADVECT_ONLY, 0.0f);
    double expected = max_displacement > 0.0f ? (double)max_displacement : 2.0;
    float speed;
    step.max_displacement = max_displacement;
    ASSERT_OK(springls_max_speed(ctx, &forces, 0.0f, &speed));
    ASSERT_IN_RANGE(24.0, speed, 0.5);
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_IN_RANGE(expected, springls_get_stats(ctx).largest_displacement, 0.02 * expected); /* the chord of the arc */
    ASSERT_IN_RANGE(expected / (double)speed, springls_time(ctx), 1e-6);
    springls_destroy(ctx);
    PASS();
}

/* A longer dt is cut into equal sub-steps, none longer than max_displacement, and ends at the same time and place. */
TEST long_steps_are_cut(void)
{
    springls_context *ctx = fixture_sphere(40, NULL, 10.5f, 19.5f, 19.5f, 6.0f);
    float wind[3] = { 2.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 3.1f);
    step.max_displacement = 0.5f;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(13, springls_get_stats(ctx).steps); /* 6.2 / 0.5 */
    ASSERT_IN_RANGE(6.2 / 13.0, springls_get_stats(ctx).largest_displacement, 1e-4);
    ASSERT_IN_RANGE(3.1, springls_time(ctx), 1e-5);
    ASSERT_IN_RANGE(0.0, fixture_sphere_error(ctx, d3_make(16.7, 19.5, 19.5), 6.0).mean, 0.05);
    step.dt = 0.2f; /* short enough: not cut */
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(14, springls_get_stats(ctx).steps);
    step.dt = 1e6f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step(ctx, &step));
    springls_destroy(ctx);
    PASS();
}

/* Moves a ball by 6.2 voxels in a step that is zeroed but for its forces, dt and mode. */
static uint64_t moved_ball(const springls_params *params, springls_mode mode, float max_displacement, springls_stats *stats)
{
    springls_context *ctx = fixture_sphere(40, params, 10.5f, 19.5f, 19.5f, 6.0f);
    float wind[3] = { 2.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step;
    uint64_t hash = 0;
    memset(&step, 0, sizeof step);
    step.forces = &forces;
    step.mode = mode;
    step.dt = 3.1f;
    step.max_displacement = max_displacement;
    if (springls_step(ctx, &step) == SPRINGLS_OK) hash = springls_state_hash(ctx);
    *stats = springls_get_stats(ctx);
    springls_destroy(ctx);
    return hash;
}

/* Zero divides dt as suits the parameters, to the same bits as their number; a negative number never divides it. */
TEST zeroed_steps_are_cut(springls_mode mode, int paper)
{
    const springls_params params = paper ? springls_paper_params() : springls_default_params();
    const float own = paper ? 0.5f : 2.0f;
    springls_stats zeroed, given, undivided;
    const uint64_t hash = moved_ball(&params, mode, 0.0f, &zeroed);
    ASSERT(hash != 0);
    ASSERT_EQ(hash, moved_ball(&params, mode, own, &given));
    ASSERT_EQ(given.steps, zeroed.steps);
    ASSERT_EQ(paper ? 13 : 4, zeroed.steps);
    ASSERT_LT(zeroed.largest_displacement, 1.001f * own);
    ASSERT(hash != moved_ball(&params, mode, -1.0f, &undivided));
    ASSERT_EQ(1, undivided.steps);
    ASSERT_IN_RANGE(6.2, undivided.largest_displacement, 1e-3);
    PASS();
}

/* However far springls have gone while phi stayed, the next step takes it along: by the way or, further than the band, afresh. */
TEST phi_catches_up(float voxels)
{
    springls_context *ctx = fixture_sphere(56, NULL, 12.5f, 19.5f, 19.5f, 6.0f);
    float wind[3] = { 1.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_ADVECT_ONLY, 1.0f);
    springls_measures m;
    int i;
    for (i = 1; i < (int)voxels; i++) ASSERT_OK(springls_step(ctx, &step));
    step.mode = SPRINGLS_MODE_FLUID;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(1, m.components);
    ASSERT_EQ(2, m.euler);
    ASSERT_IN_RANGE(0.0, fixture_sphere_error(ctx, d3_make(12.5 + (double)voxels, 19.5, 19.5), 6.0).mean, 0.03);
    springls_destroy(ctx);
    PASS();
}

/* Algorithm 3 makes phi afresh of springls with gaps between them: a thin plate stays one, and as thick as it was. */
TEST plate_turns_in_elastic_steps(float half)
{
    springls_context *ctx = fixture_context(32, NULL);
    springls_box plate = { { 16.0f, 16.0f, 16.0f }, { 9.0f, 9.0f, 0.0f } };
    struct exact_flow flow = EXACT_ROTATION(16.0f, 16.0f, 16.0f, 0.0f, 0.0f, 1.0f, 1.0f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_ELASTIC, 1.0f);
    springls_measures before, after;
    plate.half[2] = half;
    step.max_displacement = 1.0f;
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_box, &plate));
    ASSERT_OK(springls_measure(ctx, &before));
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_EQ(1, after.components);
    ASSERT_IN_RANGE(before.volume, after.volume, 0.15 * before.volume);
    springls_destroy(ctx);
    PASS();
}

/* A force that grows during the step does not take particles further than allowed in a sub-step. */
static void growing(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)points;
    for (i = 0; i < count; i++) {
        out[3 * i] = 40.0f * time * time * time;
        out[3 * i + 1] = out[3 * i + 2] = 0.0f;
    }
}

TEST sub_steps_follow_the_force(void)
{
    springls_context *ctx = fixture_sphere(40, NULL, 10.5f, 19.5f, 19.5f, 6.0f);
    springls_forces forces = fixture_forces(growing, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    step.max_displacement = 1.5f; /* ten voxels in all, most of them late: at the start nothing moves */
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT(springls_get_stats(ctx).steps >= 7 && springls_get_stats(ctx).steps <= 14);
    ASSERT_LT(springls_get_stats(ctx).largest_displacement, 1.501f);
    ASSERT_EQ(1.0, springls_time(ctx));
    ASSERT_IN_RANGE(0.0, fixture_sphere_error(ctx, d3_make(20.5, 19.5, 19.5), 6.0).mean, 0.03);
    step.max_displacement = 1e-5f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step(ctx, &step));
    springls_destroy(ctx);
    PASS();
}

/* Nothing moves: a step of dt = 0 ends at once, and time stands still. */
TEST still_model_takes_no_time(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    float still[3] = { 0.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, still);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.0f);
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(0.0, springls_time(ctx));
    ASSERT_EQ(0.0f, springls_get_stats(ctx).largest_displacement);
    springls_set_time(ctx, 7.5);
    ASSERT_EQ(7.5, springls_time(ctx));
    springls_destroy(ctx);
    PASS();
}

/* Forces are asked at the model's own time, which set_time sets. */
static void calendar(void *user, const float *points, int count, float time, float *out)
{
    float *seen = (float *)user;
    int i;
    (void)points;
    if (time < seen[0]) seen[0] = time;
    if (time > seen[1]) seen[1] = time;
    for (i = 0; i < 3 * count; i++) out[i] = 0.1f;
}

TEST forces_are_given_the_time(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    float seen[2] = { 1e9f, -1e9f };
    springls_forces forces = fixture_forces(calendar, seen);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_ADVECT_ONLY, 0.5f);
    springls_set_time(ctx, 4.0);
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(4.0f, seen[0]);
    ASSERT_EQ(4.5f, seen[1]);
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(5.0f, seen[1]);
    springls_destroy(ctx);
    PASS();
}

/* ---- running ---- */

typedef struct reports { int count, stop_at, rising; float last; } reports;

static int report(void *user, float fraction)
{
    reports *r = (reports *)user;
    r->rising = r->rising && fraction > r->last && fraction <= 1.0f;
    r->last = fraction;
    return ++r->count == r->stop_at;
}

static springls_context *reported(reports *r)
{
    springls_desc desc = fixture_desc(32, NULL);
    springls_sphere sphere = fixture_ball(13.5f, 15.5f, 15.5f, 7.0f);
    springls_context *ctx = NULL;
    memset(r, 0, sizeof *r);
    desc.progress.report = report;
    desc.progress.user = r;
    springls_create(&desc, &ctx);
    springls_set_implicit(ctx, springls_implicit_sphere, &sphere);
    memset(r, 0, sizeof *r);
    r->rising = 1;
    return ctx;
}

/* A report after every step; a run that is cancelled leaves the model as after its last whole step. */
TEST run_reports_and_can_be_cancelled(void)
{
    reports r;
    springls_context *ctx = reported(&r);
    float wind[3] = { 0.4f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    uint64_t third;
    int i;
    for (i = 0; i < 3; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(0, r.count);
    third = springls_state_hash(ctx);
    springls_destroy(ctx);
    ctx = reported(&r);
    ASSERT_OK(springls_run(ctx, &step, 8));
    ASSERT_EQ(8, r.count);
    ASSERT(r.rising);
    ASSERT_EQ(1.0f, r.last);
    springls_destroy(ctx);
    ctx = reported(&r);
    r.stop_at = 3;
    ASSERT_STATUS(SPRINGLS_CANCELLED, springls_run(ctx, &step, 8));
    ASSERT_EQ(3, springls_get_stats(ctx).steps);
    ASSERT(third == springls_state_hash(ctx));
    r.stop_at = 0;
    ASSERT_OK(springls_run(ctx, &step, 2)); /* and can go on */
    ASSERT_OK(springls_run(ctx, &step, 0));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_run(ctx, &step, -1));
    springls_destroy(ctx);
    PASS();
}

/* An active contour that has arrived does not go on to the last step. */
static void towards_radius(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)normals;
    (void)time;
    for (i = 0; i < count; i++) {
        d3 x = d3_make((double)points[3 * i] - 15.5, (double)points[3 * i + 1] - 15.5, (double)points[3 * i + 2] - 15.5);
        out[i] = (float)fmax(fmin(8.0 - d3_length(x), 1.0), -1.0);
    }
}

TEST run_stops_when_nothing_moves(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 6.0f);
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.4f);
    springls_stats stats;
    forces.pressure = towards_radius;
    step.one_to_one = true;
    ASSERT_OK(springls_run(ctx, &step, 30)); /* nobody has asked for a stop */
    ASSERT_EQ(30, springls_get_stats(ctx).steps);
    step.stop_at_rest = true;
    ASSERT_OK(springls_run(ctx, &step, 400));
    stats = springls_get_stats(ctx);
    ASSERT_LT(stats.steps, 400);
    ASSERT_GT(stats.steps, 5);
    ASSERT(stats.moving_share <= 0.001f);
    ASSERT_IN_RANGE(0.0, fixture_sphere_error(ctx, d3_make(15.5, 15.5, 15.5), 8.0).mean, 0.1);
    springls_destroy(ctx);
    PASS();
}

/* ---- refusals ---- */

static void not_a_number(void *user, const float *points, int count, float time, float *out)
{
    int i, bad = *(const int *)user;
    (void)points;
    (void)time;
    for (i = 0; i < 3 * count; i++) out[i] = i == 3 * count / 2 ? (bad == 0 ? NAN : bad == 1 ? INFINITY : 3e38f) : 0.1f;
}

/* A force that is not finite is refused with a message, and leaves model and time as they were. */
TEST bad_forces_leave_the_model(int bad, springls_mode mode, float dt)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    springls_forces forces = fixture_forces(not_a_number, &bad);
    springls_step_desc step = fixture_step(&forces, mode, dt);
    uint64_t before = springls_state_hash(ctx);
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_step(ctx, &step));
    ASSERT(strlen(springls_last_error(ctx)) > 10);
    ASSERT(before == springls_state_hash(ctx));
    ASSERT_EQ(0.0, springls_time(ctx));
    ASSERT_EQ(0, springls_get_stats(ctx).steps);
    springls_destroy(ctx);
    PASS();
}

/* In a step that is cut the sub-steps before the failure stay. */
static void late_failure(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)points;
    for (i = 0; i < 3 * count; i++) out[i] = time > 0.55f ? NAN : 1.0f;
}

TEST whole_sub_steps_stay(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    springls_forces forces = fixture_forces(late_failure, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    step.max_displacement = 0.45f; /* of sqrt(3): four sub-steps, of which the third fails */
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_step(ctx, &step));
    ASSERT_EQ(2, springls_get_stats(ctx).steps);
    ASSERT_IN_RANGE(0.5, springls_time(ctx), 1e-6);
    ASSERT_IN_RANGE(0.0, fixture_sphere_error(ctx, d3_make(16.0, 16.0, 16.0), 8.0).mean, 0.05);
    springls_destroy(ctx);
    PASS();
}

TEST nonsense_is_refused(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f), *empty = fixture_context(32, NULL);
    float wind[3] = { 0.1f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    const float bad[4] = { -1.0f, NAN, INFINITY, -INFINITY };
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
    uint64_t before = springls_state_hash(ctx);
    int i;
    for (i = 0; i < 4; i++) {
        step.dt = bad[i];
        ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step(ctx, &step));
        step.dt = 0.5f;
        step.max_displacement = bad[i];
        if (i) ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step(ctx, &step)); /* -1 is none of these */
        step.max_displacement = 0.0f;
    }
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step(ctx, NULL));
    step.mode = (springls_mode)17;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step(ctx, &step));
    step.mode = SPRINGLS_MODE_FLUID;
    ASSERT(before == springls_state_hash(ctx));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_step(empty, &step));
    springls_destroy(empty);
    springls_destroy(ctx);
    PASS();
}

SUITE(step)
{
    int which, bad;
    for (which = 0; which < 2; which++) {
        RUN_TESTp(stages_run_in_order, which, SPRINGLS_MODE_FLUID, 0);
        RUN_TESTp(stages_run_in_order, which, SPRINGLS_MODE_FLUID, 1);
        RUN_TESTp(stages_run_in_order, which, SPRINGLS_MODE_ELASTIC, 0);
        RUN_TESTp(stages_run_in_order, which, SPRINGLS_MODE_ELASTIC, 1);
        RUN_TESTp(stages_run_in_order, which, SPRINGLS_MODE_ADVECT_ONLY, 0);
        RUN_TESTp(stages_are_timed, which);
        RUN_TESTp(wind_carries_the_model, which, SPRINGLS_MODE_FLUID, 0.4f, 20);
        RUN_TESTp(wind_carries_the_model, which, SPRINGLS_MODE_ELASTIC, 0.4f, 20);
        RUN_TESTp(wind_carries_the_model, which, SPRINGLS_MODE_ELASTIC, 4.0f, 2);
        RUN_TESTp(pressure_blows_it_up, which);
        RUN_TESTp(one_to_one_keeps_them, which, SPRINGLS_MODE_FLUID);
        RUN_TESTp(one_to_one_keeps_them, which, SPRINGLS_MODE_ELASTIC);
        RUN_TESTp(free_springls_are_not_stopped, which);
    }
    RUN_TEST(lazy_steps_only_advect);
    RUN_TEST(phi_follows_when_springls_turn);
    RUN_TEST(substeps_divide_the_lazy_distance);
    RUN_TEST(phi_follows_before_a_sudden_step);
    RUN_TESTp(relax_is_left_out_in_a_flow_only, 0, 1, 0.0f);
    RUN_TESTp(relax_is_left_out_in_a_flow_only, 1, 1, 0.0f);
    RUN_TESTp(relax_is_left_out_in_a_flow_only, 0, 1, 0.1f);
    RUN_TESTp(relax_is_left_out_in_a_flow_only, 0, 0, 0.0f);
    RUN_TEST(stages_have_names);
    RUN_TEST(advect_only_leaves_phi);
    RUN_TEST(masked_springls_keep_their_shape);
    RUN_TESTp(step_is_as_long_as_allowed, 0.0f);
    RUN_TESTp(step_is_as_long_as_allowed, -1.0f);
    RUN_TESTp(step_is_as_long_as_allowed, 0.2f);
    RUN_TEST(long_steps_are_cut);
    RUN_TESTp(zeroed_steps_are_cut, SPRINGLS_MODE_FLUID, 0);
    RUN_TESTp(zeroed_steps_are_cut, SPRINGLS_MODE_FLUID, 1);
    RUN_TESTp(zeroed_steps_are_cut, SPRINGLS_MODE_ELASTIC, 0);
    RUN_TESTp(zeroed_steps_are_cut, SPRINGLS_MODE_ADVECT_ONLY, 0);
    RUN_TESTp(zeroed_steps_are_cut, SPRINGLS_MODE_ADVECT_ONLY, 1);
    RUN_TESTp(phi_catches_up, 3.0f);
    RUN_TESTp(phi_catches_up, 17.0f);
    RUN_TESTp(plate_turns_in_elastic_steps, 0.6f);
    RUN_TESTp(plate_turns_in_elastic_steps, 1.2f);
    RUN_TEST(sub_steps_follow_the_force);
    RUN_TEST(still_model_takes_no_time);
    RUN_TEST(forces_are_given_the_time);
    RUN_TEST(run_reports_and_can_be_cancelled);
    RUN_TEST(run_stops_when_nothing_moves);
    for (bad = 0; bad < 3; bad++) {
        RUN_TESTp(bad_forces_leave_the_model, bad, SPRINGLS_MODE_FLUID, 0.5f);
        RUN_TESTp(bad_forces_leave_the_model, bad, SPRINGLS_MODE_FLUID, 0.0f);
        RUN_TESTp(bad_forces_leave_the_model, bad, SPRINGLS_MODE_ELASTIC, 0.5f);
    }
    RUN_TEST(whole_sub_steps_stay);
    RUN_TEST(nonsense_is_refused);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(step);
    GREATEST_MAIN_END();
}
