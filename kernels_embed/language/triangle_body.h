/* triangle_body.h - distances to segments and triangles, for single points and for several at once. */

/* Returns 1 / |b - a|^2, or 0 for a segment of no length. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(inverse_length2)(SPRINGLS__NUM3 a, SPRINGLS__NUM3 b)
{
    SPRINGLS__NUM l2 = SPRINGLS__W(length2)(SPRINGLS__W(sub)(b, a));
    return SPRINGLS__W(select)(l2 > 1e-20f, 1.0f / l2, SPRINGLS__W(broadcast)(0.0f));
}

/* Returns the parameter in [0, 1] of the point closest to x of the segment that starts at a, of vector ab; inverse is
   1 / |ab|^2, or 0 for a segment of no length. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(segment_parameter)(SPRINGLS__NUM3 x, SPRINGLS__NUM3 a, SPRINGLS__NUM3 ab,
                                                               SPRINGLS__NUM inverse)
{
    return SPRINGLS__W(clamp)(SPRINGLS__W(dot)(SPRINGLS__W(sub)(x, a), ab) * inverse, 0.0f, 1.0f);
}

/* Returns the squared distance from x to the segment that starts at a, of vector ab; inverse as above. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(segment_distance2)(SPRINGLS__NUM3 x, springls__v3 a, springls__v3 ab, float inverse)
{
    SPRINGLS__NUM3 start = SPRINGLS__W(broadcast3)(a), along = SPRINGLS__W(broadcast3)(ab);
    SPRINGLS__NUM s = SPRINGLS__W(segment_parameter)(x, start, along, SPRINGLS__W(broadcast)(inverse));
    return SPRINGLS__W(length2)(SPRINGLS__W(mad)(SPRINGLS__W(sub)(x, start), along, -s));
}

/* Returns the squared distance from x to the triangle of the plan (eq. 21): to its plane inside of the three edges, else to the
   nearest edge. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(tri_distance2)(const springls__tri_plan *plan, SPRINGLS__NUM3 x)
{
    SPRINGLS__NUM3 da = SPRINGLS__W(sub)(x, SPRINGLS__W(broadcast3)(plan->t.a));
    SPRINGLS__NUM3 db = SPRINGLS__W(sub)(x, SPRINGLS__W(broadcast3)(plan->t.b));
    SPRINGLS__NUM3 dc = SPRINGLS__W(sub)(x, SPRINGLS__W(broadcast3)(plan->t.c));
    SPRINGLS__NUM height = SPRINGLS__W(dot)(SPRINGLS__W(broadcast3)(plan->n), da);
    SPRINGLS__NUM inner = SPRINGLS__W(min)(SPRINGLS__W(min)(SPRINGLS__W(dot)(SPRINGLS__W(broadcast3)(plan->inward[0]), da),
                                                            SPRINGLS__W(dot)(SPRINGLS__W(broadcast3)(plan->inward[1]), db)),
                                           SPRINGLS__W(dot)(SPRINGLS__W(broadcast3)(plan->inward[2]), dc));
    SPRINGLS__NUM e0 = SPRINGLS__W(segment_distance2)(x, plan->t.a, plan->edge[0], plan->inverse_edge2[0]);
    SPRINGLS__NUM e1 = SPRINGLS__W(segment_distance2)(x, plan->t.b, plan->edge[1], plan->inverse_edge2[1]);
    SPRINGLS__NUM e2 = SPRINGLS__W(segment_distance2)(x, plan->t.c, plan->edge[2], plan->inverse_edge2[2]);
    SPRINGLS__NUM edges = SPRINGLS__W(min)(SPRINGLS__W(min)(e0, e1), e2);
    if (plan->inverse_n2 <= 0.0f) return edges;
    return SPRINGLS__W(select)(inner >= 0.0f, height * height * plan->inverse_n2, edges);
}
