/* relax.h - one springl seeks equilibrium with its neighbours (section 4.3).

   The paper's "forces" (eq. 4, 5, 12) are energy gradients and point away from their targets; eq. 10, 11, 17 and 18
   subtract them. Here d points from a vertex to its neighbour and is added, which is the same motion. World-frame
   springs M s are used where eq. 9 and 19 print s: the pose b is zero at the start of every iteration. */

typedef struct springls__relax_rule {
    float rest, radius, d_max;       /* 2r, R, d_max (Table 1)                   */
    float kappa_int, kappa_ext;      /* eq. 4, 5                                 */
    float sharpness;                 /* lambda_c                                 */
    float step_length, step_rotation; /* xi, rho (eq. 17, 18)                    */
    int threshold, weight, physical; /* H, W, and which torque                   */
} springls__relax_rule;

/* Hermite cubic on [a, b] from value ya with slope sa to value yb with slope 0. */
SPRINGLS__MATHS float springls__hermite(float x, float a, float b, float ya, float sa, float yb)
{
    float h = b - a, t = (x - a) / h, u = 1.0f - t;
    return ya * (1.0f + 2.0f * t) * u * u + sa * h * t * u * u + yb * t * t * (3.0f - 2.0f * t);
}

/* W_c and W_d of section 5.1: slope 1 at 0, W(peak) = peak with slope 0, zero from R on with slope 0. Repulsion (x < 0)
   continues the slope at 0. */
SPRINGLS__MATHS float springls__weight_spline(float x, float peak, float radius)
{
    if (x <= 0.0f) return x;
    if (x >= radius) return 0.0f;
    return x < peak ? springls__hermite(x, 0.0f, peak, 0.0f, 1.0f, peak) : springls__hermite(x, peak, radius, peak, 0.0f, 0.0f);
}

/* W(x), Fig. 8b: a linear, b atanh, c far spline, d near spline. */
SPRINGLS__MATHS float springls__weight(int which, float x, float d_max, float radius)
{
    if (which == 0) return x;
    if (which == 1) return springls__atanh(x);
    return springls__weight_spline(x, which == 2 ? d_max : 0.5f * d_max, radius);
}

/* H(x), Fig. 8a: a linear, b tanh. */
SPRINGLS__MATHS float springls__threshold(int which, float x) { return which == 0 ? x : springls__tanh(x); }

/* alpha(|d|) d of eq. 12, towards the neighbour: alpha(x) = W((x - 2r) / R) / x. */
SPRINGLS__MATHS springls__v3 springls__attraction(springls__relax_rule rule, springls__v3 d)
{
    float x = springls__length(d);
    float w = springls__weight(rule.weight, (x - rule.rest) / rule.radius, rule.d_max, rule.radius);
    return springls__scale(d, x > 1e-6f ? rule.kappa_ext * w / x : 0.0f);
}

/* g of eq. 13 from c of eq. 12: beta(x) = H(lambda_c x) / x. */
SPRINGLS__MATHS springls__v3 springls__thresholded(springls__relax_rule rule, springls__v3 c)
{
    float x = springls__length(c);
    return springls__scale(c, x > 1e-6f ? springls__threshold(rule.threshold, rule.sharpness * x) / x : 0.0f);
}

/* v turned by |w| radians about w (Rodrigues). */
SPRINGLS__MATHS springls__v3 springls__rotate(springls__v3 v, springls__v3 w)
{
    float angle = springls__length(w), s, c;
    springls__v3 axis;
    if (angle < 1e-7f) return v;
    axis = springls__scale(w, 1.0f / angle);
    s = springls__sinpi(angle * 0.318309886f);
    c = springls__cospi(angle * 0.318309886f);
    return springls__add(springls__add(springls__scale(v, c), springls__scale(springls__cross(axis, v), s)),
                         springls__scale(axis, springls__dot(axis, v) * (1.0f - c)));
}

/* The triangle after one iteration of eq. 17 and 18, given the thresholded force at each vertex. */
SPRINGLS__MATHS springls__tri springls__relax_springl(springls__relax_rule rule, springls__tri t, springls__v3 p,
                                                      springls__v3 ga, springls__v3 gb, springls__v3 gc)
{
    springls__v3 g[3], spring[3], turn = springls__v3_make(0.0f, 0.0f, 0.0f);
    float length[3];
    springls__tri out;
    int m;
    g[0] = ga; g[1] = gb; g[2] = gc;
    spring[0] = springls__sub(t.a, p);
    spring[1] = springls__sub(t.b, p);
    spring[2] = springls__sub(t.c, p);
    for (m = 0; m < 3; m++) {
        float arm;
        length[m] = springls__length(spring[m]);
        spring[m] = springls__normalize(spring[m]);
        arm = rule.physical ? length[m] : 1.0f;                                                /* eq. 19 or eq. 20 */
        turn = springls__mad(turn, springls__cross(spring[m], g[m]), arm);
    }
    turn = springls__scale(turn, rule.step_rotation);                                          /* eq. 18           */
    for (m = 0; m < 3; m++) {
        float along = springls__dot(spring[m], g[m]) - rule.kappa_int * (length[m] - rule.rest); /* eq. 4, 17       */
        length[m] = springls__max(length[m] + rule.step_length * along, 0.25f * rule.rest);
        spring[m] = springls__mad(p, springls__rotate(spring[m], turn), length[m]);            /* eq. 3            */
    }
    out.a = spring[0]; out.b = spring[1]; out.c = spring[2];
    return out;
}

SPRINGLS__MATHS springls__relax_rule springls__relax_rule_of(const springls_params *params)
{
    springls__relax_rule rule;
    rule.rest = 2.0f * params->particle_radius;
    rule.radius = params->neighbor_radius;
    rule.d_max = params->d_max;
    rule.kappa_int = params->kappa_int;
    rule.kappa_ext = params->kappa_ext;
    rule.sharpness = params->sharpness;
    rule.step_length = params->relax_step_length;
    rule.step_rotation = params->relax_step_rotation;
    rule.threshold = (int)params->threshold;
    rule.weight = (int)params->weight;
    rule.physical = params->torque == SPRINGLS_TORQUE_PHYSICAL;
    return rule;
}


/* g of eq. 13 at a vertex: the closest points slide along their edges as the vertex moves. */
SPRINGLS__MATHS springls__v3 springls__vertex_force(springls__relax_rule rule, SPRINGLS__GLOBAL const springls__springl *all, springls__v3 q, SPRINGLS__GLOBAL const int *codes)
{
    springls__v3 c = springls__v3_make(0.0f, 0.0f, 0.0f);
    int k;
    for (k = 0; k < SPRINGLS__MAX_NEIGHBORS && codes[k] >= 0; k++) {
        SPRINGLS__GLOBAL const springls__springl *o = &all[codes[k] / 3];
        int e = codes[k] % 3;
        springls__v3 a = o->q[e], b = o->q[e == 2 ? 0 : e + 1];
        float s = springls__segment_parameter(q, a, b, o->inverse_edge2[e]);
        c = springls__add(c, springls__attraction(rule, springls__sub(springls__lerp(a, b, s), q)));
    }
    return springls__thresholded(rule, c);
}


/* One iteration of Algorithm 1 for springl i: from S to SCRATCH1. */
SPRINGLS__MATHS void springls__relax_element(const springls__model *model, springls__job job, int i)
{
    SPRINGLS__GLOBAL const int *row = model->cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW;
    SPRINGLS__GLOBAL const springls__springl *all = model->set.s;
    springls__relax_rule rule = springls__relax_rule_of(&model->params);
    springls__springl s = all[i];
    springls__tri t = springls__springl_tri(s);
    (void)job;
    if (!model->set.mask[i]) {
        t = springls__relax_springl(rule, t, s.p, springls__vertex_force(rule, all, t.a, row),
                                    springls__vertex_force(rule, all, t.b, row + SPRINGLS__MAX_NEIGHBORS),
                                    springls__vertex_force(rule, all, t.c, row + 2 * SPRINGLS__MAX_NEIGHBORS));
        s = springls__springl_make(t, s.p);
    }
    ((SPRINGLS__GLOBAL springls__springl *)model->work.scratch[1])[i] = s;
}

/* Section 4.3.1: n . grad phi < 0 is a flipped triangle. Only where phi is certain of its gradient, on one clear sheet. */
SPRINGLS__MATHS void springls__orient_element(const springls__model *model, springls__job job, int i)
{
    const springls__grid *g = &model->grid;
    springls__springl s = model->set.s[i];
    springls__v3 gradient = springls__grid_gradient(g, g->phi, s.p), q = s.q[1];
    bool certain = springls__length2(gradient) > 0.49f && springls__fabs(springls__grid_sample(g, g->phi, s.p)) < 0.5f;
    (void)job;
    if (!certain || springls__dot(springls__springl_normal(s), gradient) >= 0.0f) return;
    s.q[1] = s.q[2];
    s.q[2] = q;
    model->set.s[i] = springls__springl_finished(s);
}
