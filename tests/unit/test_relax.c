/* test_relax.c - relaxation (section 4.3) against its own energies, differentiated numerically in double precision. */
#include "fixtures.h"

/* The rule under test, in double precision, written from the paper and not from the library. */
typedef struct rules { double rest, radius, d_max, kappa_int, kappa_ext, sharpness, xi, rho; int h, w, physical; } rules;

static rules rules_of(const springls_params *p)
{
    rules r;
    r.rest = 2.0 * (double)p->particle_radius;
    r.radius = (double)p->neighbor_radius;
    r.d_max = (double)p->d_max;
    r.kappa_int = (double)p->kappa_int;
    r.kappa_ext = (double)p->kappa_ext;
    r.sharpness = (double)p->sharpness;
    r.xi = (double)p->relax_step_length;
    r.rho = (double)p->relax_step_rotation;
    r.h = (int)p->threshold;
    r.w = (int)p->weight;
    r.physical = p->torque == SPRINGLS_TORQUE_PHYSICAL;
    return r;
}

/* The cubic through (x0, y0) with slope s0 and (x1, y1) with slope 0. */
static double cubic(double x, double x0, double y0, double s0, double x1, double y1)
{
    double h = x1 - x0, t = (x - x0) / h, c = (y1 - y0) / h;
    double a2 = (3.0 * c - 2.0 * s0), a3 = (s0 - 2.0 * c); /* y0 + h (s0 t + a2 t^2 + a3 t^3) */
    return y0 + h * (s0 * t + a2 * t * t + a3 * t * t * t);
}

static double weight(const rules *r, double x)
{
    double peak = r->w == SPRINGLS_WEIGHT_SPLINE_FAR ? r->d_max : 0.5 * r->d_max;
    if (r->w == SPRINGLS_WEIGHT_LINEAR) return x;
    if (r->w == SPRINGLS_WEIGHT_ATANH) return atanh(x > 0.999 ? 0.999 : x < -0.999 ? -0.999 : x);
    if (x <= 0.0) return x;
    if (x >= r->radius) return 0.0;
    return x < peak ? cubic(x, 0.0, 0.0, 1.0, peak, peak) : cubic(x, peak, peak, 0.0, r->radius, 0.0);
}

enum { MOST = 8 };

/* The neighbours of a vertex: the closest edge of each other springl, nearest first, at most `most`. */
typedef struct near_edge { d3 a, b; double d; } near_edge;

static int near_edges(const fixture_springl *all, int count, int self, d3 q, double radius, int most, near_edge *out)
{
    int i, e, n = 0;
    for (i = 0; i < count; i++) {
        near_edge best;
        int k;
        if (i == self) continue;
        best.d = radius;
        best.a = best.b = q;
        for (e = 0; e < 3; e++) {
            d3 a = d3_of(all[i].q[e]), b = d3_of(all[i].q[(e + 1) % 3]);
            double d = d3_distance(q, d3_on_segment(q, a, b));
            if (d < best.d) { best.d = d; best.a = a; best.b = b; }
        }
        if (best.d >= radius) continue;
        for (k = n; k > 0 && out[k - 1].d > best.d; k--)
            if (k < most) out[k] = out[k - 1];
        if (k < most) out[k] = best;
        if (n < most) n++;
    }
    return n;
}

/* g of eq. 12 and 13 at q towards fixed points (pull < 0 as in the paper, which subtracts it). */
static d3 force(const rules *r, d3 q, const d3 *points, int count)
{
    d3 c = d3_make(0.0, 0.0, 0.0);
    double x;
    int k;
    for (k = 0; k < count; k++) {
        d3 d = d3_sub(q, points[k]);
        x = d3_length(d);
        if (x > 1e-6) c = d3_mad(c, d, r->kappa_ext * weight(r, (x - r->rest) / r->radius) / x);
    }
    x = d3_length(c);
    if (x <= 1e-6) return d3_make(0.0, 0.0, 0.0);
    return d3_scale(c, (r->h == SPRINGLS_THRESHOLD_LINEAR ? r->sharpness * x : tanh(r->sharpness * x)) / x);
}

/* A springl with its closest points held: three lengths and a rotation b, from which eq. 3 makes the vertices. */
typedef struct frozen { d3 p, s[3]; double l[3]; d3 points[3][MOST]; int count[3]; } frozen;

static frozen freeze(const fixture_springl *all, int count, int self, double radius, int most)
{
    frozen f;
    near_edge edges[MOST + 1];
    int m, k;
    f.p = d3_of(all[self].p);
    for (m = 0; m < 3; m++) {
        d3 q = d3_of(all[self].q[m]), arm = d3_sub(q, f.p);
        f.l[m] = d3_length(arm);
        f.s[m] = d3_scale(arm, 1.0 / f.l[m]);
        f.count[m] = near_edges(all, count, self, q, radius, most, edges);
        for (k = 0; k < f.count[m]; k++) f.points[m][k] = d3_on_segment(q, edges[k].a, edges[k].b);
    }
    return f;
}

static d3 frozen_vertex(const frozen *f, int m, const double l[3], d3 b)
{
    return d3_mad(f->p, d3_rotate(f->s[m], b), l[m]);
}

/* eq. 7, written for R = 1: springs of constant kappa_ext and rest length 2r to the closest points. */
static double energy(const rules *r, const frozen *f, const double l[3], d3 b)
{
    double e = 0.0;
    int m, k;
    for (m = 0; m < 3; m++) {
        d3 q = frozen_vertex(f, m, l, b);
        e += 0.5 * r->kappa_int * (l[m] - r->rest) * (l[m] - r->rest);
        for (k = 0; k < f->count[m]; k++) {
            double x = d3_distance(q, f->points[m][k]) - r->rest;
            e += 0.5 * r->kappa_ext * x * x;
        }
    }
    return e;
}

/* eq. 14. */
static double energy_star(const rules *r, const frozen *f, const double l[3], d3 b)
{
    double e = 0.0;
    int m;
    for (m = 0; m < 3; m++) {
        d3 g = force(r, frozen_vertex(f, m, l, b), f->points[m], f->count[m]);
        e += 0.5 * d3_dot(g, g) + 0.5 * r->kappa_int * (l[m] - r->rest) * (l[m] - r->rest);
    }
    return e;
}

typedef double (*energy_fn)(const rules *, const frozen *, const double l[3], d3 b);

/* Central differences of an energy by the three lengths, then the three components of b. */
static void gradient(energy_fn fn, const rules *r, const frozen *f, double out[6])
{
    const double h = 1e-5;
    int i;
    for (i = 0; i < 6; i++) {
        double side[2];
        int k;
        for (k = 0; k < 2; k++) {
            double l[3], step = k ? h : -h;
            d3 b = d3_make(i == 3 ? step : 0.0, i == 4 ? step : 0.0, i == 5 ? step : 0.0);
            memcpy(l, f->l, sizeof l);
            if (i < 3) l[i] += step;
            side[k] = fn(r, f, l, b);
        }
        out[i] = (side[1] - side[0]) / (2.0 * h);
    }
}

static springls_params soup_params(void)
{
    springls_params p = springls_paper_params();
    p.relax_iterations = 1;
    p.particle_radius = 0.05f;
    p.neighbor_radius = 1.0f;
    return p;
}

/* W and H linear, R = 1, physical torque: the update follows a gradient. */
static springls_params linear_params(void)
{
    springls_params p = soup_params();
    p.threshold = SPRINGLS_THRESHOLD_LINEAR;
    p.weight = SPRINGLS_WEIGHT_LINEAR;
    p.torque = SPRINGLS_TORQUE_PHYSICAL;
    p.sharpness = 1.0f;
    return p;
}

/* Relaxes a random soup once and compares each vertex with a step of length xi, rho against the gradient of an energy. */
static enum greatest_test_res compare_with_gradient(const springls_params *p, energy_fn energy_of, uint32_t seed,
                                                    int most_neighbors, int fewest)
{
    enum { COUNT = 120 };
    const rules r = rules_of(p);
    springls_context *ctx = fixture_context(16, p);
    fixture_springl *before;
    int i, m, pulled = 0;
    fixture_seed(seed);
    fixture_random_soup(ctx, COUNT, 5.0f, 10.0f, 1.0f);
    before = fixture_copy(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
    for (i = 0; i < COUNT; i++) {
        const frozen f = freeze(before, COUNT, i, r.radius, most_neighbors);
        double g[6], l[3];
        d3 b;
        gradient(energy_of, &r, &f, g);
        for (m = 0; m < 3; m++) l[m] = f.l[m] - r.xi * g[m];
        b = d3_scale(d3_make(g[3], g[4], g[5]), -r.rho);
        for (m = 0; m < 3; m++) {
            ASSERT_LT(d3_distance(frozen_vertex(&f, m, l, b), d3_of(fixture_vertex(ctx, i, m))), 1e-5);
            pulled += f.count[m] >= fewest;
        }
    }
    ASSERT_GT(pulled, 100);
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* One iteration is exactly a step against the gradient of eq. 7, as finite differences of that energy give it. */
TEST update_is_minus_the_gradient_of_eq7(void)
{
    springls_params p = linear_params();
    p.kappa_ext = 0.7f;
    p.relax_step_length = p.relax_step_rotation = 0.05f;
    CHECK_CALL(compare_with_gradient(&p, energy, 11, MOST, 2));
    PASS();
}

/* Where the Jacobian of g is the identity (one neighbour a vertex, W and H linear, 2r = 0, R = 1) the update is exactly
   against the gradient of eq. 14; that is the assumption under which the paper drops the Jacobian. */
TEST update_is_minus_the_gradient_of_eq14(void)
{
    springls_params p = linear_params();
    p.kappa_ext = 1.0f;
    p.particle_radius = 0.0f;
    p.max_neighbors = 1;
    CHECK_CALL(compare_with_gradient(&p, energy_star, 12, 1, 1));
    PASS();
}

/* Iteration by iteration of one relaxation, the physical system of a springl among still neighbours lowers eq. 7: the
   closest points slide along the edges found at its start. */
TEST energy_falls(void)
{
    springls_params p = soup_params();
    near_edge edges[3][MOST + 1];
    double before = DBL_MAX, first = 0.0;
    int steps, i, m, k, n[3] = { 0, 0, 0 };
    p.threshold = SPRINGLS_THRESHOLD_LINEAR;
    p.weight = SPRINGLS_WEIGHT_LINEAR;
    p.torque = SPRINGLS_TORQUE_PHYSICAL;
    p.sharpness = 1.0f;
    p.relax_step_length = p.relax_step_rotation = 0.02f;
    for (steps = 0; steps < 40; steps++) {
        springls_context *ctx;
        fixture_springl s;
        rules r;
        uint8_t mask[60];
        double e = 0.0;
        p.relax_iterations = steps;
        r = rules_of(&p);
        ctx = fixture_context(16, &p);
        fixture_seed(13);
        fixture_random_soup(ctx, 60, 6.0f, 9.0f, 1.0f);
        if (steps == 0) {
            fixture_springl *all = fixture_copy(ctx);
            for (m = 0; m < 3; m++) n[m] = near_edges(all, 60, 0, d3_of(all[0].q[m]), r.radius, MOST, edges[m]);
            free(all);
            ASSERT_GT(n[0] + n[1] + n[2], 5);
        }
        for (i = 0; i < 60; i++) mask[i] = i != 0;
        ASSERT_OK(springls_set_keep_mask(ctx, mask));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
        s = fixture_get(ctx, 0);
        for (m = 0; m < 3; m++) {
            d3 q = d3_of(s.q[m]);
            double l = d3_distance(q, d3_of(s.p)) - r.rest;
            e += 0.5 * r.kappa_int * l * l;
            for (k = 0; k < n[m]; k++) {
                double x = d3_distance(q, d3_on_segment(q, edges[m][k].a, edges[m][k].b)) - r.rest;
                e += 0.5 * r.kappa_ext * x * x;
            }
        }
        ASSERT(e <= before + 1e-6);
        if (steps == 0) first = e;
        before = e;
        springls_destroy(ctx);
    }
    ASSERT_LT(before, 0.9 * first);
    PASS();
}

/* W_c and W_d meet every condition of section 5.1: values and slopes at 0, at the peak and at R; zero beyond R. */
TEST splines_meet_their_conditions(void)
{
    const float d_max = 0.5f, radius = 0.6f;
    int which;
    for (which = SPRINGLS_WEIGHT_SPLINE_FAR; which <= SPRINGLS_WEIGHT_SPLINE_NEAR; which++) {
        const float peak = which == SPRINGLS_WEIGHT_SPLINE_FAR ? d_max : 0.5f * d_max, h = 1e-4f;
        float x;
#define W(x) springls__weight((springls_weight)which, x, d_max, radius)
        ASSERT_EQ(0.0f, W(0.0f));
        ASSERT_IN_RANGE(peak, W(peak), 1e-6);
        ASSERT_EQ(0.0f, W(radius));
        ASSERT_IN_RANGE(1.0, (W(h) - W(-h)) / (2.0f * h), 1e-2);
        ASSERT_IN_RANGE(0.0, (W(peak + h) - W(peak - h)) / (2.0f * h), 2e-2); /* |W''| is 300 beyond the peak of W_c */
        ASSERT_IN_RANGE(0.0, (W(peak) - W(peak - h)) / h, 2e-2);
        ASSERT_IN_RANGE(0.0, (W(radius) - W(radius - h)) / h, 2e-2);
        for (x = radius; x < 3.0f; x += 0.01f) ASSERT_EQ(0.0f, W(x));
        for (x = -1.0f; x < radius; x += 1e-3f) {
            ASSERT_LT(fabs((double)(W(x + 1e-3f) - W(x))), 2e-2); /* no jump */
            ASSERT((W(x) < 0.0f) == (x < 0.0f) || W(x) == 0.0f);  /* attracts outside 2r, repels inside */
            ASSERT(W(x) <= peak + 1e-6f);
        }
#undef W
    }
    PASS();
}

/* All eight pairs of H and W, with either torque, do what the formulas of section 4.3 say in double precision. */
TEST every_rule_is_the_formula(int threshold, int weight_kind, int torque)
{
    springls_params p = soup_params();
    springls_context *ctx;
    fixture_springl *before;
    rules r;
    int i, m, pulled = 0;
    p.threshold = (springls_threshold)threshold;
    p.weight = (springls_weight)weight_kind;
    p.torque = (springls_torque)torque;
    p.neighbor_radius = 0.8f;
    p.sharpness = 3.0f;
    r = rules_of(&p);
    ctx = fixture_context(16, &p);
    fixture_seed(14);
    fixture_random_soup(ctx, 100, 5.0f, 10.0f, 1.0f);
    before = fixture_copy(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
    for (i = 0; i < 100; i++) {
        frozen f = freeze(before, 100, i, r.radius, MOST);
        d3 turn = d3_make(0.0, 0.0, 0.0), g[3];
        double l[3];
        for (m = 0; m < 3; m++) {
            g[m] = force(&r, frozen_vertex(&f, m, f.l, turn), f.points[m], f.count[m]);
            pulled += f.count[m] > 0;
        }
        for (m = 0; m < 3; m++) { /* eq. 17; eq. 18 with eq. 19 or 20 */
            l[m] = f.l[m] - r.xi * (d3_dot(f.s[m], g[m]) + r.kappa_int * (f.l[m] - r.rest));
            if (l[m] < 0.25 * r.rest) l[m] = 0.25 * r.rest;
            turn = d3_mad(turn, d3_cross(f.s[m], g[m]), -r.rho * (r.physical ? f.l[m] : 1.0));
        }
        for (m = 0; m < 3; m++)
            ASSERT_LT(d3_distance(frozen_vertex(&f, m, l, turn), d3_of(fixture_vertex(ctx, i, m))), 1e-4);
    }
    ASSERT_GT(pulled, 50);
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* However crowded and badly shaped the soup, every rule keeps all vertices finite and moves them no further than the
   largest force allows. */
TEST every_rule_is_bounded(int threshold, int weight_kind)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    double most, strongest;
    int round, i, m;
    p.relax_iterations = 1;
    p.threshold = (springls_threshold)threshold;
    p.weight = (springls_weight)weight_kind;
    strongest = weight_kind == SPRINGLS_WEIGHT_ATANH ? atanh(0.999) : 1.0; /* of one neighbour, |W| */
    most = threshold == SPRINGLS_THRESHOLD_TANH ? 1.0 : (double)p.sharpness * 8.0 * strongest;
    ctx = fixture_context(16, &p);
    fixture_seed(15);
    fixture_random_soup(ctx, 200, 6.0f, 9.0f, 1.0f);
    for (i = 0; i < 12; i++) { /* flat, tiny, coincident */
        springls__v3 c = fixture_point(6.0f, 9.0f), d = fixture_direction();
        fixture_add(ctx, c, springls__mad(c, d, i % 3 ? 1.0f : 0.0f), springls__mad(c, d, i % 2 ? 0.5f : 1e-6f));
        fixture_add(ctx, c, springls__mad(c, d, i % 3 ? 1.0f : 0.0f), springls__mad(c, d, i % 2 ? 0.5f : 1e-6f));
    }
    for (round = 0; round < 15; round++) {
        fixture_springl *before = fixture_copy(ctx);
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
        for (i = 0; i < springls_count(ctx); i++)
            for (m = 0; m < 3; m++) {
                double l = d3_distance(d3_of(before[i].q[m]), d3_of(before[i].p));
                double stretch = (double)p.relax_step_length * (most + (double)p.kappa_int * (l + 0.1)) + 0.025;
                double turn = (double)p.relax_step_rotation * 3.0 * most * (l + stretch);
                double moved = d3_distance(d3_of(before[i].q[m]), d3_of(fixture_vertex(ctx, i, m)));
                ASSERT(moved <= stretch + turn + 1e-4); /* false for NaN */
            }
        free(before);
    }
    springls_destroy(ctx);
    PASS();
}

/* An equilateral springl about p and, facing each vertex at a distance, an edge square to its spring; the three facing
   springls do not relax. */
static springls_context *surrounded(const springls_params *p, springls__v3 center, double arm, double gap)
{
    springls_context *ctx = fixture_context(16, p);
    springls__v3 q[3];
    uint8_t mask[4] = { 0, 1, 1, 1 };
    int m;
    for (m = 0; m < 3; m++) {
        double a = 2.0 * fixture_pi * m / 3.0;
        q[m] = springls__add(center, springls__v3_make((float)(arm * cos(a)), (float)(arm * sin(a)), 0.0f));
    }
    fixture_add_at(ctx, q[0], q[1], q[2], center, center);
    for (m = 0; m < 3; m++) {
        double a = 2.0 * fixture_pi * m / 3.0;
        d3 u = d3_make(cos(a), sin(a), 0.0), v = d3_make(-sin(a), cos(a), 0.0), foot = d3_mad(d3_of(center), u, arm + gap);
        fixture_add(ctx, d3_float(d3_mad(foot, v, 0.4)), d3_float(d3_mad(foot, v, -0.4)), d3_float(d3_mad(foot, u, 0.6)));
    }
    springls_set_keep_mask(ctx, mask);
    return ctx;
}

/* Where the pull of the neighbours balances the springs, nothing moves; and a springl turned or stretched away from
   there comes back. */
TEST equilibrium_stays_and_attracts(int torque)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    springls__v3 center = springls__v3_make(8.0f, 8.0f, 8.0f);
    fixture_springl start, end;
    const double arm = 0.5, rest = 0.1, radius = 0.6;
    double gap;
    int m;
    p.threshold = SPRINGLS_THRESHOLD_LINEAR;
    p.weight = SPRINGLS_WEIGHT_LINEAR;
    p.torque = (springls_torque)torque;
    p.sharpness = 1.0f;
    p.kappa_int = 0.5f;
    p.relax_iterations = 50;
    gap = rest + radius * 0.5 * (arm - rest); /* (gap - 2r) / R = kappa_int (arm - 2r) */
    ctx = surrounded(&p, center, arm, gap);
    start = fixture_get(ctx, 0);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
    end = fixture_get(ctx, 0);
    for (m = 0; m < 3; m++) ASSERT_LT(d3_distance(d3_of(start.q[m]), d3_of(end.q[m])), 1e-5);
    for (m = 0; m < 3; m++) { /* out of the plane and longer */
        d3 s = d3_rotate(d3_sub(d3_of(start.q[m]), d3_of(center)), d3_make(0.1, 0.15, 0.0));
        fixture_here(ctx)->set.s[0].q[m] = d3_float(d3_mad(d3_of(center), s, 1.15));
    }
    ctx->model.set.s[0] = springls__springl_finished(ctx->model.set.s[0]);
    springls__constellation_changed(ctx);
    for (m = 0; m < 40; m++) ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
    end = fixture_get(ctx, 0);
    for (m = 0; m < 3; m++) ASSERT_LT(d3_distance(d3_of(start.q[m]), d3_of(end.q[m])), 0.01);
    springls_destroy(ctx);
    PASS();
}

/* With one vertex pulled across its spring, physical torque (eq. 19) turns the springl by the spring's length times what
   normalised torque (eq. 20) turns it. */
TEST torques_differ_by_the_arm(void)
{
    const double arm = 0.4;
    double turned[2];
    int torque, m;
    for (torque = 0; torque < 2; torque++) {
        springls_params p = springls_paper_params();
        springls_context *ctx;
        springls__v3 c = springls__v3_make(8.0f, 8.0f, 8.0f), q[3], after;
        uint8_t mask[2] = { 0, 1 };
        p.relax_iterations = 1;
        p.torque = torque ? SPRINGLS_TORQUE_PHYSICAL : SPRINGLS_TORQUE_NORMALIZED;
        ctx = fixture_context(16, &p);
        for (m = 0; m < 3; m++)
            q[m] = springls__add(c,
                                 springls__v3_make((float)(arm * cos(2.0 * fixture_pi * m / 3.0)),
                                                   (float)(arm * sin(2.0 * fixture_pi * m / 3.0)), 0.0f));
        fixture_add_at(ctx, q[0], q[1], q[2], c, c);
        fixture_add(ctx, springls__v3_make(q[0].x - 0.1f, 8.0f, 8.3f), springls__v3_make(q[0].x + 0.1f, 8.0f, 8.3f),
                    springls__v3_make(q[0].x, 8.0f, 9.3f)); /* straight above the first vertex */
        ASSERT_OK(springls_set_keep_mask(ctx, mask));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
        after = springls__sub(fixture_vertex(ctx, 0, 0), c);
        turned[torque] = atan2((double)after.z, (double)after.x);
        ASSERT_IN_RANGE(0.0, after.y, 1e-6);
        springls_destroy(ctx);
    }
    ASSERT_IN_RANGE(0.1 * tanh(5.0 * (0.3 - 0.1) / 0.6), turned[0], 1e-5);
    ASSERT_IN_RANGE(arm * turned[0], turned[1], 1e-5);
    PASS();
}

/* Relaxing a turned and shifted constellation gives the turned and shifted result. */
TEST relax_follows_rigid_motion(int set)
{
    springls_params p = set ? springls_default_params() : springls_paper_params();
    springls_context *one, *two;
    d3 axis = d3_make(0.4, -0.9, 0.7), shift = d3_make(1.3, -0.4, 2.6), middle = d3_make(8.0, 8.0, 8.0);
    int i, m, k;
    p.relax_iterations = 3;
    one = fixture_context(24, &p);
    two = fixture_context(24, &p);
    fixture_seed(16);
    fixture_random_soup(one, 100, 5.0f, 11.0f, 1.0f);
    for (i = 0; i < 100; i++) {
        fixture_springl s = fixture_get(one, i);
        springls__v3 x[4];
        for (m = 0; m < 4; m++) {
            d3 from = d3_of(m < 3 ? s.q[m] : s.p);
            x[m] = d3_float(d3_add(d3_add(d3_rotate(d3_sub(from, middle), axis), middle), shift));
        }
        fixture_add_at(two, x[0], x[1], x[2], x[3], x[3]);
    }
    ASSERT_OK(springls_run_stage(one, SPRINGLS_STAGE_RELAX));
    ASSERT_OK(springls_run_stage(two, SPRINGLS_STAGE_RELAX));
    for (i = 0; i < 100; i++)
        for (k = 0; k < 3; k++) {
            d3 from = d3_of(fixture_vertex(one, i, k));
            d3 expected = d3_add(d3_add(d3_rotate(d3_sub(from, middle), axis), middle), shift);
            ASSERT_LT(d3_distance(expected, d3_of(fixture_vertex(two, i, k))), 2e-4);
        }
    springls_destroy(one);
    springls_destroy(two);
    PASS();
}

/* Particles, correspondences and ids never change; springls of the mask keep every bit. */
TEST particles_and_masked_springls_stay(void)
{
    springls_context *ctx = fixture_sphere(24, NULL, 11.5f, 11.5f, 11.5f, 7.0f);
    int i, m, count = springls_count(ctx), moved = 0;
    fixture_springl *before;
    uint8_t *mask = (uint8_t *)malloc((size_t)count);
    ASSERT_GT(count, 500);
    for (i = 0; i < count; i++) mask[i] = (uint8_t)(i % 3 == 0);
    ASSERT_OK(springls_set_keep_mask(ctx, mask));
    before = fixture_copy(ctx);
    for (i = 0; i < 3; i++) ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
    ASSERT_EQ(count, springls_count(ctx));
    for (i = 0; i < count; i++) {
        fixture_springl now = fixture_get(ctx, i);
        ASSERT_MEM_EQ(&before[i].p, &now.p, sizeof now.p);
        ASSERT_MEM_EQ(&before[i].a, &now.a, sizeof now.a);
        ASSERT_EQ(before[i].id, now.id);
        if (mask[i]) ASSERT_MEM_EQ(before[i].q, now.q, sizeof now.q);
        else
            for (m = 0; m < 3; m++) moved += d3_distance(d3_of(before[i].q[m]), d3_of(now.q[m])) > 1e-4;
    }
    ASSERT_GT(moved, count);
    free(before);
    free(mask);
    springls_destroy(ctx);
    PASS();
}

/* With relax_same_side a neighbour that faces the other way does not pull; without, it does. */
TEST relax_same_side_leaves_out_the_other_side(void)
{
    int same_side;
    for (same_side = 0; same_side < 2; same_side++) {
        springls_params p = springls_paper_params();
        springls_context *ctx;
        springls__v3 with, without;
        p.relax_iterations = 1;
        p.kappa_int = 0.0f;
        p.relax_same_side = same_side;
        ctx = fixture_context(16, &p);
        fixture_add(ctx, springls__v3_make(7.0f, 7.0f, 8.0f), springls__v3_make(8.0f, 7.0f, 8.0f),
                    springls__v3_make(7.0f, 8.0f, 8.0f));
        fixture_add(ctx, springls__v3_make(7.0f, 7.0f, 8.4f), springls__v3_make(7.0f, 8.0f, 8.4f),
                    springls__v3_make(8.0f, 7.0f, 8.4f));
        without = fixture_vertex(ctx, 0, 0);
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
        with = fixture_vertex(ctx, 0, 0);
        if (same_side) ASSERT_LT(d3_distance(d3_of(with), d3_of(without)), 1e-6); /* alone it rests: kappa_int is 0 */
        else ASSERT_GT(d3_distance(d3_of(with), d3_of(without)), 1e-3);
        springls_destroy(ctx);
    }
    PASS();
}

/* New parameters count from the next call on, the range of the neighbour search included. */
TEST new_parameters_count_at_once(void)
{
    springls_params p = springls_paper_params();
    springls_context *one, *two;
    int i;
    p.relax_iterations = 1;
    one = fixture_context(16, &p);
    two = fixture_context(16, &p);
    fixture_seed(17);
    fixture_random_soup(one, 60, 6.0f, 9.0f, 1.0f);
    ASSERT_OK(springls_run_stage(one, SPRINGLS_STAGE_RELAX));
    for (i = 0; i < 60; i++) {
        fixture_springl s = fixture_get(one, i);
        fixture_add_at(two, s.q[0], s.q[1], s.q[2], s.p, s.a);
    }
    p.neighbor_radius = 1.2f;
    p.max_neighbors = 3;
    ASSERT_OK(springls_set_params(one, &p));
    ASSERT_OK(springls_set_params(two, &p));
    ASSERT_OK(springls_run_stage(one, SPRINGLS_STAGE_RELAX));
    ASSERT_OK(springls_run_stage(two, SPRINGLS_STAGE_RELAX)); /* never searched with the old range */
    for (i = 0; i < 60; i++) {
        fixture_springl a = fixture_get(one, i), b = fixture_get(two, i);
        ASSERT_MEM_EQ(a.q, b.q, sizeof a.q);
    }
    springls_destroy(one);
    springls_destroy(two);
    PASS();
}

SUITE(relax)
{
    int h, w, torque;
    char suffix[48];
    RUN_TEST(update_is_minus_the_gradient_of_eq7);
    RUN_TEST(update_is_minus_the_gradient_of_eq14);
    RUN_TEST(energy_falls);
    RUN_TEST(splines_meet_their_conditions);
    for (h = 0; h < 2; h++)
        for (w = 0; w < 4; w++) {
            for (torque = 0; torque < 2; torque++) {
                sprintf(suffix, "H%d_W%d_torque%d", h, w, torque);
                greatest_set_test_suffix(suffix);
                RUN_TESTp(every_rule_is_the_formula, h, w, torque);
            }
            sprintf(suffix, "H%d_W%d", h, w);
            greatest_set_test_suffix(suffix);
            RUN_TESTp(every_rule_is_bounded, h, w);
        }
    for (torque = 0; torque < 2; torque++) RUN_TESTp(equilibrium_stays_and_attracts, torque);
    RUN_TEST(torques_differ_by_the_arm);
    for (h = 0; h < 2; h++) RUN_TESTp(relax_follows_rigid_motion, h);
    RUN_TEST(particles_and_masked_springls_stay);
    RUN_TEST(relax_same_side_leaves_out_the_other_side);
    RUN_TEST(new_parameters_count_at_once);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(relax);
    GREATEST_MAIN_END();
}
