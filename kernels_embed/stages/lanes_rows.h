/* lanes_rows.h - a row of eight voxels at a time: omega, sides, eq. 23 and re-distancing. phi and omega point into tiles. */

#ifdef SPRINGLS__LANES

/* springls__tri_distance2 at x, x + (1, 0, 0), ... */
SPRINGLS__LANE springls__vec springls__tri_distance2_lanes(const springls__tri_plan *plan, springls__vec3 at)
{
    springls__vec3 da = springls__vec3_sub(at, springls__vec3_all(plan->t.a));
    springls__vec3 db = springls__vec3_sub(at, springls__vec3_all(plan->t.b));
    springls__vec3 dc = springls__vec3_sub(at, springls__vec3_all(plan->t.c));
    springls__vec height = springls__vec3_dot(springls__vec3_all(plan->n), da);
    springls__vec inner = springls__vec_min(springls__vec_min(springls__vec3_dot(springls__vec3_all(plan->side[0]), da),
                                                                springls__vec3_dot(springls__vec3_all(plan->side[1]), db)),
                                            springls__vec3_dot(springls__vec3_all(plan->side[2]), dc));
    springls__vec edges = springls__vec_min(
        springls__vec_min(springls__segment_distance2_lanes(at, plan->t.a, plan->edge[0], plan->inverse_edge2[0]),
                          springls__segment_distance2_lanes(at, plan->t.b, plan->edge[1], plan->inverse_edge2[1])),
        springls__segment_distance2_lanes(at, plan->t.c, plan->edge[2], plan->inverse_edge2[2]));
    return plan->inverse_n2 > 0.0f ? springls__vec_select(inner >= 0.0f, height * height * plan->inverse_n2, edges) : edges;
}

/* row[i] = min(row[i], distance from (x + i, y, z) to the springl), where its bounding sphere comes closer than that. */
SPRINGLS__MATHS void springls__omega_row(const springls__tri_plan *plan, springls__v3 center, float reach, int x, int y, int z,
                                         SPRINGLS__GLOBAL float *row)
{
    const float ramp[8] = { 0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f };
    springls__vec3 at = springls__vec3_all(springls__v3_make((float)x, (float)y, (float)z)), d;
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec best = springls__vec_load(row + i), within = best + reach;
        at.x = (float)x + springls__vec_load(ramp + i);
        d = springls__vec3_sub(at, springls__vec3_all(center));
        if (!springls__vmask_any(springls__vec3_dot(d, d) < within * within)) continue;
        best = springls__vec_min(best, springls__vec_sqrt(springls__tri_distance2_lanes(plan, at)));
        springls__vec_store(row + i, best);
    }
}

/* Adds to side[i] what the springl says at (x + i, y, z), where omega is less than `capture` and the springl's bounding
   sphere is at most half a voxel further than the nearest springl. */
SPRINGLS__MATHS void springls__side_row(const springls__tri_plan *plan, springls__v3 center, float reach, float capture, int x,
                                        int y, int z, SPRINGLS__GLOBAL const float *omega, SPRINGLS__LOCAL float *side)
{
    const float ramp[8] = { 0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f };
    springls__vec3 at = springls__vec3_all(springls__v3_make((float)x, (float)y, (float)z)), d;
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec nearest = springls__vec_load(omega + i), within = nearest + 0.5f + reach, d2, height;
        springls__vmask counts;
        at.x = (float)x + springls__vec_load(ramp + i);
        d = springls__vec3_sub(at, springls__vec3_all(center));
        counts = (nearest < capture) & (springls__vec3_dot(d, d) < within * within);
        if (!springls__vmask_any(counts)) continue;
        d2 = springls__tri_distance2_lanes(plan, at) + 0.01f;
        height = springls__vec3_dot(springls__vec3_all(plan->n), springls__vec3_sub(at, springls__vec3_all(plan->t.a)));
        height = springls__vec_select(counts, height / (d2 * d2 * springls__vec_sqrt(d2)), springls__vec_all(0.0f));
        springls__vec_store(side + i, springls__vec_load(side + i) + height);
    }
}

typedef struct springls__vec_cross7 { springls__vec c, xm, xp, ym, yp, zm, zp; } springls__vec_cross7;

SPRINGLS__LANE springls__vec_cross7 springls__tile_cross_lanes(SPRINGLS__LOCAL const float *t)
{
    springls__vec_cross7 v;
    v.c = springls__vec_load(t);
    v.xm = springls__vec_load(t - 1);
    v.xp = springls__vec_load(t + 1);
    v.ym = springls__vec_load(t - SPRINGLS__TILE);
    v.yp = springls__vec_load(t + SPRINGLS__TILE);
    v.zm = springls__vec_load(t - SPRINGLS__TILE * SPRINGLS__TILE);
    v.zp = springls__vec_load(t + SPRINGLS__TILE * SPRINGLS__TILE);
    return v;
}

/* f times the upwind difference of phi */
SPRINGLS__LANE springls__vec springls__upwind_lanes(springls__vec f, springls__vec m, springls__vec c, springls__vec p)
{
    return f * springls__vec_select(f > 0.0f, c - m, p - c);
}

/* springls__evolve_voxel where |phi| <= width, phi itself elsewhere. */
SPRINGLS__LANE void springls__evolve_lanes(SPRINGLS__LOCAL const float *phi, SPRINGLS__LOCAL const float *omega, float width,
                                           float step, SPRINGLS__GLOBAL float *out)
{
    springls__vec_cross7 v = springls__tile_cross_lanes(phi), o;
    springls__vmask inside = springls__vec_abs(v.c) <= width;
    springls__vec change;
    if (!springls__vmask_any(inside)) {
        springls__vec_store(out, v.c);
        return;
    }
    o = springls__tile_cross_lanes(omega);
    change = springls__upwind_lanes(0.25f * (o.xm * o.xm - o.xp * o.xp), v.xm, v.c, v.xp)
           + springls__upwind_lanes(0.25f * (o.ym * o.ym - o.yp * o.yp), v.ym, v.c, v.yp)
           + springls__upwind_lanes(0.25f * (o.zm * o.zm - o.zp * o.zp), v.zm, v.c, v.zp);
    change = v.c - springls__vec_clamp(step * change, -0.9f, 0.9f);
    springls__vec_store(out, springls__vec_select(inside, change, v.c));
}

SPRINGLS__MATHS void springls__evolve_row(SPRINGLS__LOCAL const float *phi, SPRINGLS__LOCAL const float *omega, float width,
                                          float step, SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) springls__evolve_lanes(phi + i, omega + i, width, step, out + i);
}

SPRINGLS__LANE springls__vec springls__least_lanes(springls__vec_cross7 v)
{
    return springls__vec_min(springls__vec_min(springls__vec_min(v.xm, v.xp), springls__vec_min(v.ym, v.yp)),
                             springls__vec_min(v.zm, v.zp));
}

SPRINGLS__LANE springls__vec springls__most_lanes(springls__vec_cross7 v)
{
    return springls__vec_max(springls__vec_max(springls__vec_max(v.xm, v.xp), springls__vec_max(v.ym, v.yp)),
                             springls__vec_max(v.zm, v.zp));
}

SPRINGLS__LANE springls__vmask springls__at_interface_lanes(springls__vec_cross7 v)
{
    springls__vec lo = springls__least_lanes(v), hi = springls__most_lanes(v);
    springls__vmask inside = v.c < 0.0f;
    return (inside & (hi >= 0.0f)) | (~inside & (lo < 0.0f));
}

SPRINGLS__LANE springls__vec springls__slope2_lanes(springls__vec m, springls__vec c, springls__vec p)
{
    springls__vec flat = springls__vec_abs(0.5f * (p - m));
    springls__vec steep = springls__vec_max(springls__vec_abs(c - m), springls__vec_abs(p - c));
    springls__vec slope = springls__vec_select(flat < 0.65f * steep, steep, flat);
    return slope * slope;
}

SPRINGLS__LANE springls__vec springls__interface_distance_lanes(springls__vec_cross7 v)
{
    springls__vec g2 = springls__slope2_lanes(v.xm, v.c, v.xp) + springls__slope2_lanes(v.ym, v.c, v.yp)
                       + springls__slope2_lanes(v.zm, v.c, v.zp);
    springls__vec excess = springls__vec_sqrt(springls__vec_max(g2, springls__vec_all(1e-4f))) - 1.0f;
    springls__vec share = springls__vec_clamp(20.0f * springls__vec_abs(excess) - 1.0f, 0.0f, 1.0f);
    return v.c / (1.0f + share * excess);
}

/* Is one of the 26 neighbours on the other side? */
SPRINGLS__LANE springls__vmask springls__touches_lanes(SPRINGLS__LOCAL const float *t)
{
    springls__vec lo = springls__vec_load(t), hi = lo, c = lo;
    springls__vmask inside = c < 0.0f;
    int i;
    for (i = 0; i < 27; i++) {
        springls__vec v = springls__vec_load(t + i % 3 - 1 + SPRINGLS__TILE * (i / 3 % 3 - 1 + SPRINGLS__TILE * (i / 9 - 1)));
        lo = springls__vec_min(lo, v);
        hi = springls__vec_max(hi, v);
    }
    return (inside & (hi >= 0.0f)) | (~inside & (lo < 0.0f));
}

/* springls__interface_distance at the interface and sharp edges, springls__distance_guess elsewhere. */
SPRINGLS__LANE void springls__interface_lanes(SPRINGLS__LOCAL const float *phi, float far_value, SPRINGLS__GLOBAL float *out)
{
    springls__vec_cross7 v = springls__tile_cross_lanes(phi);
    springls__vec size = springls__vec_abs(v.c), d = springls__vec_clamp(size, SPRINGLS__NEAR, far_value), own;
    springls__vmask crossed = springls__at_interface_lanes(v), edge = size < 1.0f;
    d = springls__vec_select(v.c < 0.0f, -d, d);
    if (springls__vmask_any(crossed | edge)) {
        own = springls__interface_distance_lanes(v);
        edge = edge & ~crossed & (springls__vec_abs(own) < SPRINGLS__NEAR);
        if (springls__vmask_any(edge)) crossed = crossed | (edge & springls__touches_lanes(phi));
        d = springls__vec_select(crossed, own, d);
    }
    springls__vec_store(out, d);
}

SPRINGLS__MATHS void springls__interface_row(SPRINGLS__LOCAL const float *phi, float far_value, SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) springls__interface_lanes(phi + i, far_value, out + i);
}

SPRINGLS__LANE springls__vec springls__eikonal_lanes(springls__vec x, springls__vec y, springls__vec z)
{
    const springls__vec zero = springls__vec_all(0.0f);
    springls__vec a = springls__vec_min(x, springls__vec_min(y, z)), c = springls__vec_max(x, springls__vec_max(y, z));
    springls__vec b = springls__vec_max(springls__vec_min(x, y), springls__vec_min(springls__vec_max(x, y), z));
    springls__vec one = a + 1.0f, two, three, sum, d;
    two = 0.5f * (a + b + springls__vec_sqrt(springls__vec_max(2.0f - (a - b) * (a - b), zero)));
    sum = a + b + c;
    three = (sum + springls__vec_sqrt(springls__vec_max(sum * sum - 3.0f * (a * a + b * b + c * c - 1.0f), zero)))
            * (1.0f / 3.0f);
    d = springls__vec_select(one > b, two, one);
    return springls__vec_select(d > c, three, d);
}

SPRINGLS__LANE void springls__redistance_lanes(SPRINGLS__LOCAL const float *phi, float far_value, SPRINGLS__GLOBAL float *out)
{
    springls__vec_cross7 v = springls__tile_cross_lanes(phi);
    springls__vec x = springls__vec_min(springls__vec_abs(v.xm), springls__vec_abs(v.xp));
    springls__vec y = springls__vec_min(springls__vec_abs(v.ym), springls__vec_abs(v.yp));
    springls__vec z = springls__vec_min(springls__vec_abs(v.zm), springls__vec_abs(v.zp));
    springls__vec d = springls__vec_all(far_value);
    springls__vmask kept = springls__at_interface_lanes(v), near_by = ~kept & (springls__vec_abs(v.c) < SPRINGLS__NEAR);
    if (springls__vmask_any(near_by)) kept = kept | (near_by & springls__touches_lanes(phi));
    if (springls__vmask_any(springls__vec_min(x, springls__vec_min(y, z)) < d))
        d = springls__vec_min(springls__eikonal_lanes(x, y, z), d);
    d = springls__vec_select(v.c < 0.0f, -d, d);
    springls__vec_store(out, springls__vec_select(kept, v.c, d));
}

SPRINGLS__MATHS void springls__redistance_row(SPRINGLS__LOCAL const float *phi, float far_value, SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) springls__redistance_lanes(phi + i, far_value, out + i);
}

#endif
