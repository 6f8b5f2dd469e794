/* relax_body.h - the equations of section 4.3, for one springl and for several at once, one a lane.

   The paper's "forces" (eq. 4, 5, 12) are energy gradients and point away from their targets; eq. 10, 11, 17 and 18
   subtract them. Here d points from a vertex to its neighbour and is added, which is the same motion. World-frame
   springs M s are used where eq. 9 and 19 print s: the pose b is zero at the start of every iteration. */

/* Returns the Hermite cubic on [a, b] from value ya with slope sa to value yb with slope 0. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(hermite)(SPRINGLS__NUM x, float a, float b, float ya, float sa, float yb)
{
    const float h = b - a;
    SPRINGLS__NUM t = (x - a) / h, u = 1.0f - t;
    return ya * (1.0f + 2.0f * t) * u * u + sa * h * t * u * u + yb * t * t * (3.0f - 2.0f * t);
}

/* Returns W_c or W_d of section 5.1: slope 1 at 0, W(peak) = peak with slope 0, zero from R on with slope 0. Repulsion (x < 0)
   continues the slope at 0. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(weight_spline)(SPRINGLS__NUM x, float peak, float radius)
{
    SPRINGLS__NUM rising = SPRINGLS__W(hermite)(x, 0.0f, peak, 0.0f, 1.0f, peak);
    SPRINGLS__NUM falling = SPRINGLS__W(hermite)(x, peak, radius, peak, 0.0f, 0.0f);
    SPRINGLS__NUM w = SPRINGLS__W(select)(x < peak, rising, falling);
    w = SPRINGLS__W(select)(x >= radius, SPRINGLS__W(broadcast)(0.0f), w);
    return SPRINGLS__W(select)(x <= 0.0f, x, w);
}

/* Returns W(x), Fig. 8b: a linear, b atanh, c far spline, d near spline. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(weight)(springls_weight which, SPRINGLS__NUM x, float d_max, float radius)
{
    if (which == SPRINGLS_WEIGHT_LINEAR) return x;
    if (which == SPRINGLS_WEIGHT_ATANH) return SPRINGLS__W(atanh)(x);
    return SPRINGLS__W(weight_spline)(x, which == SPRINGLS_WEIGHT_SPLINE_FAR ? d_max : 0.5f * d_max, radius);
}

/* Returns H(x), Fig. 8a: a linear, b tanh. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(threshold)(springls_threshold which, SPRINGLS__NUM x)
{
    return which == SPRINGLS_THRESHOLD_LINEAR ? x : SPRINGLS__W(tanh)(x);
}

/* Returns alpha(|d|) of eq. 12 for d towards the neighbour: alpha(x) = W((x - 2r) / R) / x. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(attraction)(springls__relax_rule rule, SPRINGLS__NUM3 d)
{
    SPRINGLS__NUM x = SPRINGLS__W(length)(d);
    SPRINGLS__NUM w = SPRINGLS__W(weight)(rule.weight, (x - rule.rest) / rule.radius, rule.d_max, rule.radius);
    return SPRINGLS__W(select)(x > 1e-6f, rule.kappa_ext * w / x, SPRINGLS__W(broadcast)(0.0f));
}

/* Returns g of eq. 13 from c of eq. 12: beta(x) = H(lambda_c x) / x. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(thresholded)(springls__relax_rule rule, SPRINGLS__NUM3 c)
{
    SPRINGLS__NUM x = SPRINGLS__W(length)(c), beta = SPRINGLS__W(threshold)(rule.threshold, rule.sharpness * x) / x;
    return SPRINGLS__W(scale)(c, SPRINGLS__W(select)(x > 1e-6f, beta, SPRINGLS__W(broadcast)(0.0f)));
}

/* The neighbour edge of one vertex in each lane: its ends, and 1 / length^2, below 0 if there is none. */
typedef struct SPRINGLS__W(edges) {
    float a[3][SPRINGLS__WIDTH], b[3][SPRINGLS__WIDTH], inverse[SPRINGLS__WIDTH];
} SPRINGLS__W(edges);

/* Reads the edge that codes[NEIGHBOR_ROW * lane] names (neighbors.h); where it is -1, one of springl `instead` takes its place.
   Returns whether any lane has one. */
SPRINGLS__W_MATHS bool SPRINGLS__W(edges_load)(SPRINGLS__W(edges) *edges, SPRINGLS__GLOBAL const springls__springl *all,
                                               SPRINGLS__GLOBAL const int *codes, int instead)
{
    bool some = false;
    int lane;
    for (lane = 0; lane < SPRINGLS__WIDTH; lane++) {
        int code = codes[SPRINGLS__NEIGHBOR_ROW * lane], e = code >= 0 ? code % 3 : 0;
        SPRINGLS__GLOBAL const springls__springl *o = &all[code >= 0 ? code / 3 : instead];
        springls__v3 a = o->q[e], b = o->q[e == 2 ? 0 : e + 1];
        edges->a[0][lane] = a.x;
        edges->a[1][lane] = a.y;
        edges->a[2][lane] = a.z;
        edges->b[0][lane] = b.x;
        edges->b[1][lane] = b.y;
        edges->b[2][lane] = b.z;
        edges->inverse[lane] = code >= 0 ? o->inverse_edge2[e] : -1.0f;
        some = some || code >= 0;
    }
    return some;
}

/* Returns g of eq. 13 at vertex q: the closest points slide along their edges as the vertex moves. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(vertex_force)(springls__relax_rule rule,
                                                           SPRINGLS__GLOBAL const springls__springl *all, SPRINGLS__NUM3 q,
                                                           SPRINGLS__GLOBAL const int *codes, int instead)
{
    SPRINGLS__NUM3 c = SPRINGLS__W(broadcast3)(springls__v3_make(0.0f, 0.0f, 0.0f));
    SPRINGLS__W(edges) edges;
    int k;
    for (k = 0; k < SPRINGLS__MAX_NEIGHBORS && SPRINGLS__W(edges_load)(&edges, all, codes + k, instead); k++) {
        SPRINGLS__NUM3 a = SPRINGLS__W(load_v3)(edges.a[0], edges.a[1], edges.a[2]);
        SPRINGLS__NUM3 ab = SPRINGLS__W(sub)(SPRINGLS__W(load_v3)(edges.b[0], edges.b[1], edges.b[2]), a);
        SPRINGLS__NUM inverse = SPRINGLS__W(load)(edges.inverse), s = SPRINGLS__W(segment_parameter)(q, a, ab, inverse);
        SPRINGLS__NUM3 d = SPRINGLS__W(sub)(SPRINGLS__W(mad)(a, ab, s), q);
        SPRINGLS__NUM alpha = SPRINGLS__W(attraction)(rule, d);
        c = SPRINGLS__W(mad)(c, d, SPRINGLS__W(select)(inverse >= 0.0f, alpha, SPRINGLS__W(broadcast)(0.0f)));
    }
    return SPRINGLS__W(thresholded)(rule, c);
}

/* A turn about an axis by an angle, as sine and cosine; none where the angle is too small for an axis. */
typedef struct SPRINGLS__W(turn) {
    SPRINGLS__NUM3 axis;
    SPRINGLS__NUM sine, cosine;
    SPRINGLS__COND some;
} SPRINGLS__W(turn);

/* Returns the turn by |w| radians about w. */
SPRINGLS__W_MATHS SPRINGLS__W(turn) SPRINGLS__W(turn_by)(SPRINGLS__NUM3 w)
{
    SPRINGLS__NUM angle = SPRINGLS__W(length)(w);
    SPRINGLS__W(turn) turn;
    turn.some = angle >= 1e-7f;
    turn.axis = SPRINGLS__W(scale)(w, 1.0f / angle);
    turn.sine = SPRINGLS__W(sinpi)(angle * SPRINGLS__OVER_PI);
    turn.cosine = SPRINGLS__W(cospi)(angle * SPRINGLS__OVER_PI);
    return turn;
}

/* Returns v after the turn (Rodrigues). */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(rotate)(SPRINGLS__NUM3 v, SPRINGLS__W(turn) turn)
{
    SPRINGLS__NUM3 across = SPRINGLS__W(scale)(SPRINGLS__W(cross)(turn.axis, v), turn.sine);
    SPRINGLS__NUM3 along = SPRINGLS__W(scale)(turn.axis, SPRINGLS__W(dot)(turn.axis, v) * (1.0f - turn.cosine));
    SPRINGLS__NUM3 r = SPRINGLS__W(add)(SPRINGLS__W(add)(SPRINGLS__W(scale)(v, turn.cosine), across), along);
    return SPRINGLS__W(v3_make)(SPRINGLS__W(select)(turn.some, r.x, v.x), SPRINGLS__W(select)(turn.some, r.y, v.y),
                                SPRINGLS__W(select)(turn.some, r.z, v.z));
}

/* Returns the springl after one iteration of eq. 17 and 18, given the thresholded force g at each vertex. */
SPRINGLS__W_MATHS SPRINGLS__W(springl) SPRINGLS__W(relaxed)(springls__relax_rule rule, SPRINGLS__W(springl) s,
                                                            const SPRINGLS__NUM3 *g)
{
    SPRINGLS__NUM3 spring[3], torque = SPRINGLS__W(broadcast3)(springls__v3_make(0.0f, 0.0f, 0.0f));
    SPRINGLS__NUM length[3];
    SPRINGLS__W(turn) turn;
    int m;
    for (m = 0; m < 3; m++) {
        SPRINGLS__NUM arm;
        spring[m] = SPRINGLS__W(sub)(s.q[m], s.p);
        length[m] = SPRINGLS__W(length)(spring[m]);
        spring[m] = SPRINGLS__W(normalize)(spring[m]);
        arm = rule.physical ? length[m] : SPRINGLS__W(broadcast)(1.0f);                           /* eq. 19 or eq. 20 */
        torque = SPRINGLS__W(mad)(torque, SPRINGLS__W(cross)(spring[m], g[m]), arm);
    }
    turn = SPRINGLS__W(turn_by)(SPRINGLS__W(scale)(torque, SPRINGLS__W(broadcast)(rule.step_rotation)));   /* eq. 18 */
    for (m = 0; m < 3; m++) {
        SPRINGLS__NUM along = SPRINGLS__W(dot)(spring[m], g[m]) - rule.kappa_int * (length[m] - rule.rest); /* eq. 4, 17 */
        length[m] = SPRINGLS__W(max)(length[m] + rule.step_length * along, SPRINGLS__W(broadcast)(0.25f * rule.rest));
        s.q[m] = SPRINGLS__W(mad)(s.p, SPRINGLS__W(rotate)(spring[m], turn), length[m]);          /* eq. 3 */
    }
    return SPRINGLS__W(springl_finished)(s);
}

/* Does one iteration of Algorithm 1 for the springls first, first + 1, ..., one a lane: from S to relaxed_springls. */
SPRINGLS__W_MATHS void SPRINGLS__W(relax_springl)(const springls__model *model, springls__relax_rule rule, int first)
{
    SPRINGLS__GLOBAL const springls__springl *all = model->set.s;
    SPRINGLS__GLOBAL const int *codes = model->cells.neighbors + (size_t)first * SPRINGLS__NEIGHBOR_ROW;
    SPRINGLS__W(springl) s = SPRINGLS__W(springl_load)(all, first);
    SPRINGLS__NUM3 g[3];
    int m;
    for (m = 0; m < 3; m++)
        g[m] = SPRINGLS__W(vertex_force)(rule, all, s.q[m], codes + SPRINGLS__MAX_NEIGHBORS * m, first);
    s = SPRINGLS__W(relaxed)(rule, s, g);
    SPRINGLS__W(springl_store)(springls__relaxed_springls(model), first, s);
}
