/* test_fill_gaps.c - springls for exposed zero crossings (section 4.4): all of them, no others, with correspondences. */
#include "fixtures.h"
#include "../../src/stages/fill_gaps.h"

static const d3 center = { 15.5, 15.5, 15.5 };

static springls_params set_of(int which) { return which ? springls_default_params() : springls_paper_params(); }

/* Removes springls whose particle is within `size` of the point where direction n leaves the sphere; how many. */
static int cut_hole(springls_context *ctx, d3 n, double radius, double size)
{
    int i, count = springls_count(ctx);
    uint8_t *keep = (uint8_t *)malloc((size_t)count);
    d3 at = d3_mad(center, d3_scale(n, 1.0 / d3_length(n)), radius);
    for (i = 0; i < count; i++) keep[i] = d3_distance(d3_of(fixture_particle(ctx, i)), at) > size;
    fixture_keep(ctx, keep);
    free(keep);
    return count - springls_count(ctx);
}

/* The largest distance from the centre of a triangle of the zero level to the springls, and how many are beyond d_max. */
static double worst_gap(springls_context *ctx, double d_max, int *beyond)
{
    springls_mesh mesh;
    double worst = 0.0;
    int t, m;
    *beyond = 0;
    if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) return DBL_MAX;
    for (t = 0; t < mesh.triangle_count; t++) {
        d3 c = d3_make(0.0, 0.0, 0.0);
        double d;
        for (m = 0; m < 3; m++) {
            const float *x = mesh.positions + 3 * mesh.triangles[3 * t + m];
            c = d3_mad(c, d3_make((double)x[0], (double)x[1], (double)x[2]), 1.0 / 3.0);
        }
        d = fixture_distance(ctx, c);
        if (d > worst) worst = d;
        *beyond += d > d_max;
    }
    springls_mesh_free(ctx, &mesh);
    return worst;
}

/* Where the springls cover the zero level, nothing is added. */
TEST nothing_to_fill(int which)
{
    springls_params p = set_of(which);
    springls_context *ctx = fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, 9.0f);
    int count = springls_count(ctx), beyond;
    uint64_t hash;
    ASSERT_GT(count, 100);
    worst_gap(ctx, 0.5, &beyond);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    if (beyond == 0) ASSERT_EQ(count, springls_count(ctx));
    ASSERT_EQ(springls_count(ctx) - count, springls_get_stats(ctx).added);
    hash = springls_state_hash(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS)); /* what it has filled it does not fill again */
    ASSERT(hash == springls_state_hash(ctx));
    springls_destroy(ctx);
    PASS();
}

/* With the paper's rule each exposed triangle of the zero level becomes one springl and covered ones none. Springls that
   fill from their neighbourhood need fewer, and a few passes for a wide hole. Afterwards no zero crossing is further than
   d_max from the springls. */
TEST holes_are_covered(int which, float size)
{
    springls_params p = set_of(which);
    springls_context *ctx = fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, 9.0f);
    int beyond, removed, before, added, i;
    const double near = size > 2.0f ? 0.25 : 0.15; /* a fit has little to go by in the middle of a wide hole */
    double worst;
    fixture_springl *old;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    removed = cut_hole(ctx, d3_make(0.3, -0.5, 0.8), 9.0, (double)size);
    ASSERT_GT(removed, 3);
    before = springls_count(ctx);
    old = fixture_copy(ctx);
    worst_gap(ctx, 0.5, &beyond);
    ASSERT_GT(beyond, 3);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    for (i = 0; which && i < 2; i++) ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    added = springls_count(ctx) - before;
    if (which) ASSERT(added > 0 && added < removed + 3);
    else ASSERT_EQ(beyond, added);
    for (i = 0; i < before; i++) { /* the others stay as they were */
        fixture_springl s = fixture_get(ctx, i);
        ASSERT_MEM_EQ(&old[i], &s, sizeof s);
    }
    for (i = before; i < springls_count(ctx); i++) {
        fixture_springl s = fixture_get(ctx, i);
        d3 out = d3_sub(d3_of(s.p), center);
        ASSERT(s.id > old[before - 1].id);
        ASSERT(i == before || s.id > springls_ids(ctx)[i - 1]);
        ASSERT(s.generation >= 1);
        ASSERT_GT(d3_dot(fixture_normal(&s), out) / d3_length(out), 0.9); /* faces out */
        ASSERT_IN_RANGE(9.0, d3_length(out), near);
        ASSERT_IN_RANGE(9.0, d3_distance(d3_of(s.a), center), near); /* on the original surface */
    }
    worst = worst_gap(ctx, 0.5, &beyond);
    ASSERT_EQ_FMT(0, beyond, "%d");
    ASSERT_LT(worst, 0.5 + 1e-4);
    free(old);
    springls_destroy(ctx);
    PASS();
}

/* Nothing has moved, so a new springl's true correspondence is its own place. The quadratic rule finds it within a tenth
   of a voxel; the paper's average within the width of the hole and its rim. */
TEST correspondences_are_near_the_truth(int which)
{
    springls_params p = set_of(which);
    springls_context *ctx;
    double mean = 0.0, worst = 0.0;
    int i, first, n = 0;
    p.initial_stride = 1;
    p.project_initial = 1;
    ctx = fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, 9.0f);
    cut_hole(ctx, d3_make(0.3, -0.5, 0.8), 9.0, 1.2);
    cut_hole(ctx, d3_make(-0.3, 0.7, 0.1), 9.0, 1.2);
    cut_hole(ctx, d3_make(0.0, 0.0, -1.0), 9.0, 1.2);
    first = springls_count(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    for (i = first; i < springls_count(ctx); i++, n++) {
        double e = d3_distance(d3_of(fixture_particle(ctx, i)), d3_of(fixture_origin(ctx, i)));
        mean += e;
        if (e > worst) worst = e;
    }
    ASSERT_GT(n, 5);
    mean /= n;
    if (which) {
        ASSERT_LT(mean, 0.05);
        ASSERT_LT(worst, 0.1);
    } else {
        ASSERT_LT(worst, 1.2 + 0.6);
    }
    springls_destroy(ctx);
    PASS();
}

/* The same after the model has moved away from its original: correspondences are on the original, not on the model. */
TEST correspondences_survive_motion(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 12.5f, 15.5f, 15.5f, 8.0f);
    float wind[3] = { 4.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_ELASTIC, 1.0f);
    uint8_t *keep;
    int i, first;
    step.one_to_one = true;
    ASSERT_OK(springls_step(ctx, &step));
    keep = (uint8_t *)malloc((size_t)springls_count(ctx));
    for (i = 0; i < springls_count(ctx); i++)
        keep[i] = d3_distance(d3_of(fixture_particle(ctx, i)), d3_make(16.5, 15.5, 23.5)) > 1.2;
    fixture_keep(ctx, keep);
    free(keep);
    first = springls_count(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    ASSERT_GT(springls_count(ctx), first);
    for (i = first; i < springls_count(ctx); i++) {
        d3 back = d3_sub(d3_of(fixture_particle(ctx, i)), d3_make(4.0, 0.0, 0.0));
        ASSERT_LT(d3_distance(back, d3_of(fixture_origin(ctx, i))), 0.15);
    }
    springls_destroy(ctx);
    PASS();
}

/* max_springls holds here too: what does not fit is refused and counted, and can be filled once there is room. */
TEST room_is_respected(void)
{
    springls_params p = springls_paper_params();
    springls_desc desc = fixture_desc(32, &p);
    springls_sphere sphere = fixture_ball(15.5f, 15.5f, 15.5f, 9.0f);
    springls_context *ctx;
    int beyond, count;
    desc.max_springls = 100000;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &sphere));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    cut_hole(ctx, d3_make(0.0, 0.0, 1.0), 9.0, 3.0);
    count = springls_count(ctx);
    worst_gap(ctx, 0.5, &beyond);
    ASSERT_GT(beyond, 10);
    ctx->desc.max_springls = count + 7;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    ASSERT_EQ(count + 7, springls_count(ctx));
    ASSERT_EQ(beyond - 7, springls_get_stats(ctx).refused);
    ctx->desc.max_springls = 100000;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    worst_gap(ctx, 0.5, &beyond);
    ASSERT_EQ(0, beyond);
    springls_destroy(ctx);
    PASS();
}

/* The closing surface at the border of the domain is part of the zero level, and is filled as well. */
/* A model that has been full from the start moves on, with no springl more than it may have and nothing written beyond. */
TEST full_models_stay_full(int most)
{
    springls_desc desc = fixture_desc(48, NULL);
    struct exact_flow flow = EXACT_DEFORMATION(48.0f, 3.0f);
    springls_sphere ball = fixture_ball(17.0f, 17.0f, 17.0f, 7.0f);
    springls_step_desc step;
    springls_forces forces;
    springls_context *ctx;
    int i;
    desc.max_springls = most;
    memset(&forces, 0, sizeof forces);
    forces.velocity = exact_flow_velocity;
    forces.user = &flow;
    memset(&step, 0, sizeof step);
    step.forces = &forces;
    step.dt = 0.03f;
    step.max_displacement = 2.0f;
    ASSERT_EQ(SPRINGLS_OK, springls_create(&desc, &ctx));
    ASSERT_EQ(SPRINGLS_OK, springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    for (i = 0; i < 3; i++) {
        ASSERT_EQ(SPRINGLS_OK, springls_step(ctx, &step));
        ASSERT(springls_count(ctx) <= most);
    }
    ASSERT(springls_get_stats(ctx).refused > 0);
    springls_destroy(ctx);
    PASS();
}

TEST the_border_is_filled(void)
{
    springls_context *ctx = fixture_sphere(24, NULL, 3.0f, 11.5f, 20.0f, 7.0f);
    int i, beyond, count = springls_count(ctx), n = 0;
    uint8_t *keep = (uint8_t *)malloc((size_t)count);
    for (i = 0; i < count; i++) keep[i] = fixture_particle(ctx, i).x > 0.0f;
    fixture_keep(ctx, keep);
    free(keep);
    ASSERT_LT(springls_count(ctx), count - 20);
    for (i = 0; i < 14; i++) ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS)); /* from the middle to the sharp edge */
    worst_gap(ctx, 0.5, &beyond);
    ASSERT_EQ_FMT(0, beyond, "%d");
    for (i = 0; i < springls_count(ctx); i++) n += fixture_particle(ctx, i).x < -0.4f;
    ASSERT_GT(n, 20);
    springls_destroy(ctx);
    PASS();
}

/* The widest and the second widest angle of a fan and the middle of the widest, against all pairs in double precision. */
TEST openings_are_found(void)
{
    int trial, i, k;
    fixture_seed(77);
    for (trial = 0; trial < 300; trial++) {
        springls__v3 n = fixture_direction();
        springls__angular_gaps fan = springls__angular_gaps_begin(n);
        springls__widest_gap opening;
        int count = trial % 12;
        double angle[12], widest = 0.0, second = 0.0, middle = 0.0;
        for (i = 0; i < count; i++) {
            float length = fixture_between(0.1f, 2.0f), height = fixture_between(-1.0f, 1.0f);
            angle[i] = (double)fixture_between(-3.1415f, 3.1415f);
            springls__angular_gaps_add(&fan,
                                             springls__mad(springls__mad(springls__scale(fan.e1, length * (float)cos(angle[i])),
                                                                         fan.e2, length * (float)sin(angle[i])),
                                                           n, height));
        }
        springls__angular_gaps_add(&fan, springls__scale(n, 0.5f)); /* right above: no direction */
        ASSERT_EQ(count, fan.count);
        for (i = 0; i < count; i++) {
            double gap = 2.0 * fixture_pi;
            for (k = 0; k < count; k++) {
                double after = angle[k] - angle[i] + (angle[k] > angle[i] ? 0.0 : 2.0 * fixture_pi);
                if (k != i && after < gap) gap = after;
            }
            if (gap > widest) {
                second = widest;
                widest = gap;
                middle = angle[i] + 0.5 * gap;
            } else if (gap > second) {
                second = gap;
            }
        }
        opening = springls__angular_gaps_widest(&fan);
        ASSERT_IN_RANGE(count ? widest : 2.0 * fixture_pi, (double)opening.angle, 1e-4);
        ASSERT_IN_RANGE(second, (double)opening.second, 1e-4);
        if (count == 0 || widest - second < 1e-3) continue;
        ASSERT_IN_RANGE(cos(middle), (double)springls__dot(opening.middle, fan.e1), 1e-4);
        ASSERT_IN_RANGE(sin(middle), (double)springls__dot(opening.middle, fan.e2), 1e-4);
    }
    PASS();
}

/* Neighbours on a disc are a sheet's, on half a disc those of its rim; on a line they are a thread's, on half a line its end. */
TEST sheets_and_threads_are_told_apart(int part, int expected)
{
    springls__angular_gaps fan = springls__angular_gaps_begin(springls__v3_make(0.0f, 0.0f, 1.0f));
    int i;
    fixture_seed(5);
    for (i = 0; i < 24; i++) {
        float u = fixture_between(-2.0f, 2.0f), v = fixture_between(-2.0f, 2.0f);
        if (part == 1) u = fabsf(u);
        if (part >= 2) v *= 0.2f;
        if (part == 2) u += u < 0.0f ? -0.7f : 0.7f;
        if (part == 3) u = fabsf(u) + 0.7f;
        springls__angular_gaps_add(&fan, springls__v3_make(u, v, 0.3f));
    }
    ASSERT_EQ(expected, springls__spans_sheet(&fan));
    PASS();
}

/* Springls that fill from their neighbourhood keep their distance from each other, and from max_springls. */
TEST seeds_keep_their_distance(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 9.0f);
    int before, i, k;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    ASSERT_GT(cut_hole(ctx, d3_make(0.3, -0.5, 0.8), 9.0, 2.5), 20);
    ASSERT_GT(cut_hole(ctx, d3_make(-0.3, 0.5, 0.1), 9.0, 2.0), 20);
    before = springls_count(ctx);
    ctx->desc.max_springls = before + 4;
    ASSERT_OK(fixture_table(ctx, springls__fill_holes));
    ASSERT_EQ(before + 4, springls_count(ctx));
    ASSERT_GT(springls_get_stats(ctx).refused, 0);
    ctx->desc.max_springls = before + 1000;
    for (i = 0; i < 3; i++) ASSERT_OK(fixture_table(ctx, springls__fill_holes));
    ASSERT_GT(springls_count(ctx), before + 8);
    for (i = before; i < springls_count(ctx); i++) {
        fixture_springl s = fixture_get(ctx, i);
        ASSERT(s.generation >= 1);
        ASSERT_IN_RANGE(0.3248, fixture_area(&s), 1e-3);
        for (k = 0; k < i; k++) ASSERT(d3_distance(d3_of(s.p), d3_of(fixture_particle(ctx, k))) > 0.7 - 1e-5);
    }
    springls_destroy(ctx);
    PASS();
}

/* A rim is no hole: springls of an open half of a sphere do not grow beyond it. */
TEST rims_do_not_grow(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 9.0f);
    uint8_t *keep = (uint8_t *)malloc((size_t)springls_count(ctx));
    int i, pass;
    for (i = 0; i < springls_count(ctx); i++) keep[i] = fixture_particle(ctx, i).z > 15.5f;
    fixture_keep(ctx, keep);
    free(keep);
    for (pass = 0; pass < 10; pass++) ASSERT_OK(fixture_table(ctx, springls__fill_holes));
    for (i = 0; i < springls_count(ctx); i++) ASSERT_GT(fixture_particle(ctx, i).z, 14.5f);
    springls_destroy(ctx);
    PASS();
}

/* Sectors are counted by angle; where they close, no gap between the directions is 102 degrees wide, as the exact angles show. */
TEST sectors_close_only_without_a_gap(void)
{
    springls__v3 up = springls__v3_make(0.0f, 0.0f, 1.0f);
    int k, i, closed = 0, open = 0;
    for (k = 0; k < 32; k++) {
        double angle = fixture_pi * (k + 0.5) / 16.0;
        ASSERT_EQ(1u << k, springls__sector((float)cos(angle), (float)sin(angle)));
    }
    fixture_seed(77);
    for (i = 0; i < 4000; i++) {
        springls__angular_gaps gaps = springls__angular_gaps_begin(up);
        uint32_t sectors = 0u;
        for (k = 0; k < 3 + i % 12; k++) {
            springls__v3 d = springls__v3_make(fixture_between(-1.0f, 1.0f), fixture_between(-1.0f, 1.0f), 0.0f);
            springls__angular_gaps_add(&gaps, d);
            sectors |= springls__sector(springls__dot(d, gaps.e1), springls__dot(d, gaps.e2));
        }
        if (!springls__sectors_close(sectors)) {
            open++;
            continue;
        }
        closed++;
        ASSERT_LT(springls__angular_gaps_widest(&gaps).angle, 101.26f * SPRINGLS__DEGREE);
    }
    ASSERT(closed > 500 && open > 500);
    ASSERT(!springls__sectors_close(0x00ffffffu) && !springls__sectors_close(0x0ffffff0u));
    ASSERT(springls__sectors_close(0x01010101u));
    PASS();
}

SUITE(fill_gaps)
{
    RUN_TEST(sectors_close_only_without_a_gap);
    RUN_TEST(openings_are_found);
    RUN_TESTp(sheets_and_threads_are_told_apart, 0, 1);
    RUN_TESTp(sheets_and_threads_are_told_apart, 1, 1);
    RUN_TESTp(sheets_and_threads_are_told_apart, 2, 0);
    RUN_TESTp(sheets_and_threads_are_told_apart, 3, 0);
    RUN_TEST(seeds_keep_their_distance);
    RUN_TEST(rims_do_not_grow);
    RUN_TESTp(nothing_to_fill, 0);
    RUN_TESTp(nothing_to_fill, 1);
    RUN_TESTp(holes_are_covered, 0, 1.5f);
    RUN_TESTp(holes_are_covered, 0, 3.5f);
    RUN_TESTp(holes_are_covered, 1, 1.5f);
    RUN_TESTp(holes_are_covered, 1, 3.5f);
    RUN_TESTp(correspondences_are_near_the_truth, 0);
    RUN_TESTp(correspondences_are_near_the_truth, 1);
    RUN_TEST(correspondences_survive_motion);
    RUN_TEST(room_is_respected);
    RUN_TESTp(full_models_stay_full, 1);
    RUN_TESTp(full_models_stay_full, 100);
    RUN_TESTp(full_models_stay_full, 700);
    RUN_TEST(the_border_is_filled);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(fill_gaps);
    GREATEST_MAIN_END();
}
