/* advect_body.h - the motion of a springl's points (eq. 2), for one springl and for several at once, one a lane. */

/* Returns the displacement of the classical fourth-order Runge-Kutta scheme from its four slopes. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(rk4)(SPRINGLS__NUM3 k1, SPRINGLS__NUM3 k2, SPRINGLS__NUM3 k3, SPRINGLS__NUM3 k4,
                                                  float dt)
{
    SPRINGLS__NUM3 middle = SPRINGLS__W(scale)(SPRINGLS__W(add)(k2, k3), SPRINGLS__W(broadcast)(2.0f));
    return SPRINGLS__W(scale)(SPRINGLS__W(add)(SPRINGLS__W(add)(k1, k4), middle), SPRINGLS__W(broadcast)(dt * (1.0f / 6.0f)));
}

/* Returns the place at half time on the cubic from x to x + displacement that has these slopes at its ends. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(cubic_middle)(SPRINGLS__NUM3 x, SPRINGLS__NUM3 displacement, SPRINGLS__NUM3 first,
                                                           SPRINGLS__NUM3 last, float dt)
{
    SPRINGLS__NUM3 straight = SPRINGLS__W(scale)(displacement, SPRINGLS__W(broadcast)(0.5f));
    return SPRINGLS__W(add)(x, SPRINGLS__W(mad)(straight, SPRINGLS__W(sub)(first, last), SPRINGLS__W(broadcast)(0.125f * dt)));
}

/* Returns 4 f(middle) + f(end) - 2 stage2 - 2 stage3 - stage4, where f is the flow on the cubic of cubic_middle and stage2, 3, 4
   are the flows of the Runge-Kutta scheme: times dt / 6 it is how far the scheme is off Simpson's rule along the cubic. middle: f
   at half time; end: f at the end, less the flow of stage 4. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(simpson_residual)(SPRINGLS__NUM3 stage2, SPRINGLS__NUM3 stage3, SPRINGLS__NUM3 middle,
                                                               SPRINGLS__NUM3 end)
{
    SPRINGLS__NUM3 stages = SPRINGLS__W(scale)(SPRINGLS__W(add)(stage2, stage3), SPRINGLS__W(broadcast)(0.5f));
    return SPRINGLS__W(mad)(end, SPRINGLS__W(sub)(middle, stages), SPRINGLS__W(broadcast)(4.0f));
}

/* Estimates the error of a Runge-Kutta step from simpson_residual and, for the error of Simpson's rule itself, from the second
   difference of the slopes. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(rk4_error)(SPRINGLS__NUM3 k1, SPRINGLS__NUM3 k2, SPRINGLS__NUM3 k3, SPRINGLS__NUM3 k4,
                                                       SPRINGLS__NUM3 residual, float dt)
{
    const float path = 0.2f, rule = 0.01f;
    SPRINGLS__NUM3 bend = SPRINGLS__W(sub)(SPRINGLS__W(add)(k1, k4), SPRINGLS__W(add)(k2, k3));
    SPRINGLS__NUM speed2 = SPRINGLS__W(max)(SPRINGLS__W(max)(SPRINGLS__W(length2)(k1), SPRINGLS__W(length2)(k2)),
                                            SPRINGLS__W(length2)(k4));
    SPRINGLS__NUM sum = path * SPRINGLS__W(length)(residual);
    SPRINGLS__NUM bent = sum + rule * SPRINGLS__W(length2)(bend) / SPRINGLS__W(sqrt)(speed2);
    return springls__fabs(dt) * SPRINGLS__W(select)(speed2 > 0.0f, bent, sum);
}

/* The places, slopes or displacements of the points of a springl; error: with displacements, the estimated error of the particle's
   integration. */
typedef struct SPRINGLS__W(movers) {
    SPRINGLS__NUM3 x[SPRINGLS__MOVERS];
    SPRINGLS__NUM error;
} SPRINGLS__W(movers);

/* Places in several lanes as numbers. */
typedef struct SPRINGLS__W(lanes) { float x[SPRINGLS__WIDTH], y[SPRINGLS__WIDTH], z[SPRINGLS__WIDTH]; } SPRINGLS__W(lanes);

SPRINGLS__W_MATHS void SPRINGLS__W(lanes_store)(SPRINGLS__W(lanes) *lanes, SPRINGLS__NUM3 v)
{
    SPRINGLS__W(store)(lanes->x, v.x);
    SPRINGLS__W(store)(lanes->y, v.y);
    SPRINGLS__W(store)(lanes->z, v.z);
}

SPRINGLS__W_MATHS springls__v3 SPRINGLS__W(lane_get)(const SPRINGLS__W(lanes) *lanes, int lane)
{
    return springls__v3_make(lanes->x[lane], lanes->y[lane], lanes->z[lane]);
}

SPRINGLS__W_MATHS void SPRINGLS__W(lane_set)(SPRINGLS__W(lanes) *lanes, int lane, springls__v3 v)
{
    lanes->x[lane] = v.x;
    lanes->y[lane] = v.y;
    lanes->z[lane] = v.z;
}

/* Returns the normal of a triangle; one without area has none. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(normal_of)(SPRINGLS__NUM3 a, SPRINGLS__NUM3 b, SPRINGLS__NUM3 c)
{
    return SPRINGLS__W(normalize)(SPRINGLS__W(cross)(SPRINGLS__W(sub)(b, a), SPRINGLS__W(sub)(c, a)));
}

/* Returns the displacements with motion by eq. 22's curvature term added, for a level set that springls carry, or zero where the
   topology constraint holds a springl back. */
SPRINGLS__W_MATHS SPRINGLS__W(movers) SPRINGLS__W(corrected)(const springls__grid *g, const springls__force_rule *rule,
                                                             SPRINGLS__W(movers) at, SPRINGLS__W(movers) d)
{
    SPRINGLS__W(lanes) p, n, move[SPRINGLS__MOVERS];
    int m, lane;
    if (rule->smoothing == 0.0f && !rule->stop_at_topology) return d;
    SPRINGLS__W(lanes_store)(&p, at.x[0]);
    SPRINGLS__W(lanes_store)(&n, SPRINGLS__W(normal_of)(at.x[1], at.x[2], at.x[3]));
    for (m = 0; m < SPRINGLS__MOVERS; m++) SPRINGLS__W(lanes_store)(&move[m], d.x[m]);
    for (lane = 0; lane < SPRINGLS__WIDTH; lane++) {
        springls__v3 x = SPRINGLS__W(lane_get)(&p, lane), normal = SPRINGLS__W(lane_get)(&n, lane);
        springls__v3 smoothing = springls__smoothing_at(g, rule, x, normal), zero = springls__v3_make(0.0f, 0.0f, 0.0f);
        for (m = 0; rule->smoothing != 0.0f && m < SPRINGLS__MOVERS; m++)
            SPRINGLS__W(lane_set)(&move[m], lane, springls__add(SPRINGLS__W(lane_get)(&move[m], lane), smoothing));
        if (!rule->stop_at_topology || !springls__is_held(g, x, normal, SPRINGLS__W(lane_get)(&move[0], lane))) continue;
        for (m = 0; m < SPRINGLS__MOVERS; m++) SPRINGLS__W(lane_set)(&move[m], lane, zero);
    }
    for (m = 0; m < SPRINGLS__MOVERS; m++) d.x[m] = SPRINGLS__W(load_v3)(move[m].x, move[m].y, move[m].z);
    return d;
}

/* Returns the square of how far a springl turns or stretches when its points move by d: the largest displacement of a vertex
   relative to the particle, as a share of their distance. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(turned2)(SPRINGLS__W(movers) at, SPRINGLS__W(movers) d)
{
    SPRINGLS__NUM turning2 = SPRINGLS__W(broadcast)(0.0f);
    int m;
    for (m = 1; m < SPRINGLS__MOVERS; m++) {
        SPRINGLS__NUM arm2 = SPRINGLS__W(length2)(SPRINGLS__W(sub)(at.x[m], at.x[0]));
        SPRINGLS__NUM share2 = SPRINGLS__W(length2)(SPRINGLS__W(sub)(d.x[m], d.x[0])) / arm2;
        turning2 = SPRINGLS__W(select)(arm2 > 1e-4f, SPRINGLS__W(max)(turning2, share2), turning2);
    }
    return turning2;
}

/* Returns the error of a springl's correspondence after its points have moved by d: adds d.error, the error of a motion that
   turns or stretches as this one does, and that of rounding. turning2: as turned2 returns it. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(error_of_motion)(SPRINGLS__NUM error, SPRINGLS__W(movers) at, SPRINGLS__W(movers) d,
                                                             SPRINGLS__NUM turning2)
{
    const float order = 1.0f / 60.0f, rounding = 2e-7f;
    SPRINGLS__NUM length2 = SPRINGLS__W(length2)(d.x[0]);
    SPRINGLS__NUM r = rounding * SPRINGLS__W(max)(SPRINGLS__W(fabs)(at.x[0].x),
                                                  SPRINGLS__W(max)(SPRINGLS__W(fabs)(at.x[0].y), SPRINGLS__W(fabs)(at.x[0].z)));
    turning2 = SPRINGLS__W(min)(turning2, SPRINGLS__W(broadcast)(1.0f));
    r = SPRINGLS__W(sqrt)(error * error + r * r) + order * turning2 * turning2 * SPRINGLS__W(sqrt)(length2) + d.error;
    return SPRINGLS__W(select)(length2 > 0.0f, r, error);
}

/* Returns the square of the length of v by a metric. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(metric_length2)(springls__metric m, SPRINGLS__NUM3 v)
{
    return m.xx * v.x * v.x + m.yy * v.y * v.y + m.zz * v.z * v.z + 2.0f * (m.xy * v.x * v.y + m.xz * v.x * v.z + m.yz * v.y * v.z);
}

/* Stores springls first, first + 1, ..., which were at `at`, displaced by d: moved_springls, moved_error, motion_class, turning2,
   and displacement2 of the particle, FLT_MAX when the displacement of a point or its square is not finite. error: of their
   correspondences before. */
SPRINGLS__W_MATHS void SPRINGLS__W(displaced_store)(const springls__model *model, const springls__force_rule *rule, int first,
                                                    SPRINGLS__W(movers) at, SPRINGLS__W(movers) d, SPRINGLS__NUM error)
{
    SPRINGLS__NUM particle2, largest2, turning2;
    SPRINGLS__COND finite;
    SPRINGLS__W(springl) s;
    float squares[2][SPRINGLS__WIDTH];
    int m, lane;
    d = SPRINGLS__W(corrected)(&model->grid, rule, at, d);
    particle2 = largest2 = SPRINGLS__W(length2)(d.x[0]);
    finite = particle2 < 1e18f;
    for (m = 1; m < SPRINGLS__MOVERS; m++) {
        SPRINGLS__NUM d2 = SPRINGLS__W(length2)(d.x[m]);
        finite = finite & (d2 < 1e18f);
        largest2 = SPRINGLS__W(max)(largest2, d2);
    }
    SPRINGLS__W(store)(squares[0], particle2);
    SPRINGLS__W(store)(squares[1], largest2);
    for (lane = 0; lane < SPRINGLS__WIDTH; lane++)
        springls__motion_class(model)[first + lane] = springls__motion_class_of(squares[0][lane], squares[1][lane]);
    if (!springls__is_uniform(rule->lengths)) particle2 = SPRINGLS__W(metric_length2)(rule->lengths, d.x[0]);
    particle2 = SPRINGLS__W(select)(finite, particle2, SPRINGLS__W(broadcast)(FLT_MAX));
    SPRINGLS__W(store)(springls__displacement2(model) + first, particle2);
    turning2 = SPRINGLS__W(turned2)(at, d);
    if (!rule->euler) error = SPRINGLS__W(error_of_motion)(error, at, d, turning2);
    SPRINGLS__W(store)(springls__turning2(model) + first, turning2);
    SPRINGLS__W(store)(springls__moved_error(model) + first, error);
    s.p = SPRINGLS__W(add)(at.x[0], d.x[0]);
    for (m = 0; m < 3; m++) s.q[m] = SPRINGLS__W(add)(at.x[m + 1], d.x[m + 1]);
    SPRINGLS__W(springl_store)(springls__moved_springls(model), first, SPRINGLS__W(springl_finished)(s));
}

/* Returns whether a particle lies in the region of the forces. */
SPRINGLS__W_MATHS SPRINGLS__COND SPRINGLS__W(in_force_region)(springls__v3 lower, springls__v3 upper, SPRINGLS__NUM3 p)
{
    return (p.x >= lower.x) & (p.y >= lower.y) & (p.z >= lower.z) & (p.x <= upper.x) & (p.y <= upper.y) & (p.z <= upper.z);
}

/* Returns points xyz, xyz, ..., one a lane. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(gather3)(const float *xyz)
{
    SPRINGLS__W(lanes) lanes;
    int lane;
    for (lane = 0; lane < SPRINGLS__WIDTH; lane++)
        SPRINGLS__W(lane_set)(&lanes, lane, springls__v3_make(xyz[3 * lane], xyz[3 * lane + 1], xyz[3 * lane + 2]));
    return SPRINGLS__W(load_v3)(lanes.x, lanes.y, lanes.z);
}

/* Displaces springls to the places first, first + 1, ... of what is moved. x: their particles, xyz each, `stride` points later
   their q0s, and so on; d: displacements in the same order; step: their estimated errors; error: of the correspondences so far. */
SPRINGLS__W_MATHS void SPRINGLS__W(displace_by)(const springls__model *model, const springls__force_rule *rule, int first,
                                                const float *x, const float *d, int stride, const float *step, const float *error)
{
    SPRINGLS__W(movers) at, by;
    int m;
    for (m = 0; m < SPRINGLS__MOVERS; m++) {
        at.x[m] = SPRINGLS__W(gather3)(x + 3 * m * stride);
        by.x[m] = SPRINGLS__W(gather3)(d + 3 * m * stride);
    }
    at.error = SPRINGLS__W(broadcast)(0.0f);
    by.error = SPRINGLS__W(load)(step);
    SPRINGLS__W(displaced_store)(model, rule, first, at, by, SPRINGLS__W(load)(error));
}
