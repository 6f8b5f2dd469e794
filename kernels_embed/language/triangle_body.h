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

/* Returns the squared distance from x to the segment from a to b, at weights 1 - s and s of its ends, as springls__tri_closest has it. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(segment_closest2)(springls__v3 a, springls__v3 b, SPRINGLS__NUM3 x)
{
    const SPRINGLS__NUM3 start = SPRINGLS__W(broadcast3)(a), along = SPRINGLS__W(broadcast3)(springls__sub(b, a));
    const SPRINGLS__NUM s = SPRINGLS__W(segment_parameter)(x, start, along, SPRINGLS__W(broadcast)(springls__inverse_length2(a, b)));
    const SPRINGLS__NUM3 at = SPRINGLS__W(mad)(SPRINGLS__W(scale)(start, 1.0f - s), SPRINGLS__W(broadcast3)(b), s);
    return SPRINGLS__W(length2)(SPRINGLS__W(sub)(x, at));
}

/* Returns the squared distance from x to the triangle, by Voronoi regions: the bits of springls__tri_closest. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(tri_closest2)(springls__tri t, SPRINGLS__NUM3 x)
{
    const springls__v3 ab = springls__sub(t.b, t.a), ac = springls__sub(t.c, t.a), n = springls__cross(ab, ac);
    const SPRINGLS__NUM3 a = SPRINGLS__W(broadcast3)(t.a), b = SPRINGLS__W(broadcast3)(t.b), c = SPRINGLS__W(broadcast3)(t.c);
    const SPRINGLS__NUM one = SPRINGLS__W(broadcast)(1.0f);
    const float n2 = springls__length2(n);
    SPRINGLS__NUM inner = -one, of_face = one, of_edges;
    if (n2 > 1e-20f) {
        const SPRINGLS__NUM3 ax = SPRINGLS__W(sub)(x, a), normal = SPRINGLS__W(broadcast3)(n);
        const SPRINGLS__NUM w = SPRINGLS__W(dot)(SPRINGLS__W(cross)(SPRINGLS__W(broadcast3)(ab), ax), normal) / n2;
        const SPRINGLS__NUM v = SPRINGLS__W(dot)(SPRINGLS__W(cross)(ax, SPRINGLS__W(broadcast3)(ac)), normal) / n2;
        const SPRINGLS__NUM u = 1.0f - v - w;
        inner = SPRINGLS__W(min)(SPRINGLS__W(min)(u, v), w);
        of_face = SPRINGLS__W(length2)(SPRINGLS__W(sub)(x, SPRINGLS__W(mad)(SPRINGLS__W(mad)(SPRINGLS__W(scale)(a, u), b, v), c, w)));
        if (!SPRINGLS__W(any)(inner < 0.0f)) return of_face;
    }
    of_edges = SPRINGLS__W(segment_closest2)(t.a, t.b, x);
    of_edges = SPRINGLS__W(min)(of_edges, SPRINGLS__W(segment_closest2)(t.b, t.c, x));
    of_edges = SPRINGLS__W(min)(of_edges, SPRINGLS__W(segment_closest2)(t.c, t.a, x));
    return SPRINGLS__W(select)(inner >= 0.0f, of_face, of_edges);
}
