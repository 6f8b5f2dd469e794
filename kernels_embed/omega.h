/* omega.h - the unsigned level set: distance to a springl's triangle (eq. 21). */

/* A triangle prepared for many voxels: everything the distance needs that does not depend on the voxel. */
typedef struct springls__tri_plan {
    springls__tri t;
    springls__v3 edge[3], side[3], n; /* side: in-plane inward normal of an edge (not unit); n: twice the area vector */
    float inverse_edge2[3], inverse_n2;
} springls__tri_plan;

SPRINGLS__MATHS springls__tri_plan springls__tri_plan_make(springls__tri t)
{
    springls__tri_plan plan;
    float n2;
    plan.t = t;
    plan.n = springls__tri_area2(t);
    n2 = springls__length2(plan.n);
    plan.inverse_n2 = n2 > 1e-20f ? 1.0f / n2 : 0.0f; /* no area: inside is never true, edges decide */
    plan.edge[0] = springls__sub(t.b, t.a);
    plan.edge[1] = springls__sub(t.c, t.b);
    plan.edge[2] = springls__sub(t.a, t.c);
    plan.side[0] = springls__cross(plan.n, plan.edge[0]);
    plan.side[1] = springls__cross(plan.n, plan.edge[1]);
    plan.side[2] = springls__cross(plan.n, plan.edge[2]);
    plan.inverse_edge2[0] = springls__inverse_length2(t.a, t.b);
    plan.inverse_edge2[1] = springls__inverse_length2(t.b, t.c);
    plan.inverse_edge2[2] = springls__inverse_length2(t.c, t.a);
    return plan;
}

/* Squared distance from x to the segment that starts at a, of vector e. */
SPRINGLS__MATHS float springls__segment_distance2(springls__v3 x, springls__v3 a, springls__v3 e, float inverse)
{
    springls__v3 d = springls__sub(x, a);
    float s = springls__clamp(springls__dot(d, e) * inverse, 0.0f, 1.0f);
    return springls__length2(springls__mad(d, e, -s));
}

/* Squared distance from x to the triangle, without a branch. */
SPRINGLS__MATHS float springls__tri_distance2(const springls__tri_plan plan, springls__v3 x)
{
    springls__v3 da = springls__sub(x, plan.t.a), db = springls__sub(x, plan.t.b), dc = springls__sub(x, plan.t.c);
    float height = springls__dot(plan.n, da);
    float inner = springls__min(springls__min(springls__dot(plan.side[0], da), springls__dot(plan.side[1], db)),
                                springls__dot(plan.side[2], dc));
    float e0 = springls__segment_distance2(x, plan.t.a, plan.edge[0], plan.inverse_edge2[0]);
    float e1 = springls__segment_distance2(x, plan.t.b, plan.edge[1], plan.inverse_edge2[1]);
    float e2 = springls__segment_distance2(x, plan.t.c, plan.edge[2], plan.inverse_edge2[2]);
    float edges = springls__min(springls__min(e0, e1), e2);
    float face = height * height * plan.inverse_n2;
    float use_face = inner >= 0.0f ? plan.inverse_n2 : 0.0f;
    return use_face > 0.0f ? face : edges;
}
