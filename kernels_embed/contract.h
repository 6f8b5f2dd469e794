/* contract.h - which springls are poor (section 4.6), and a good shape for one that is. */

/* Cosine of the angle at a between b and c; 1 (angle 0) where a side has no length. */
SPRINGLS__MATHS float springls__corner_cosine(springls__v3 a, springls__v3 b, springls__v3 c)
{
    springls__v3 ab = springls__sub(b, a), ac = springls__sub(c, a);
    float l2 = springls__length2(ab) * springls__length2(ac);
    return l2 > 1e-12f ? springls__dot(ab, ac) / springls__sqrt(l2) : 1.0f;
}

/* True when an angle lies outside [min, max], given by their cosines, or the area is too small. */
SPRINGLS__MATHS int springls__bad_shape(springls__tri t, float cos_min_angle, float cos_max_angle, float min_area)
{
    float a = springls__corner_cosine(t.a, t.b, t.c), b = springls__corner_cosine(t.b, t.c, t.a), c = springls__corner_cosine(t.c, t.a, t.b);
    float largest = springls__max(a, springls__max(b, c)), smallest = springls__min(a, springls__min(b, c));
    float area2 = springls__length2(springls__tri_area2(t));
    return largest > cos_min_angle || smallest < cos_max_angle || area2 < 4.0f * min_area * min_area || area2 < 1e-12f;
}

/* An equilateral triangle about p, facing n, of the given area; its first vertex points the way of `toward`. */
SPRINGLS__MATHS springls__tri springls__equilateral(springls__v3 p, springls__v3 n, springls__v3 toward, float area)
{
    float radius = springls__sqrt(area * 0.769800359f); /* area = (3 sqrt 3 / 4) radius^2 */
    springls__v3 u = springls__sub(toward, springls__scale(n, springls__dot(toward, n))), v;
    springls__tri t;
    if (springls__length2(u) < 1e-8f)
        u = springls__fabs(n.x) < 0.6f ? springls__cross(n, springls__v3_make(1.0f, 0.0f, 0.0f))
                                       : springls__cross(n, springls__v3_make(0.0f, 1.0f, 0.0f));
    u = springls__normalize(u);
    v = springls__cross(n, u);
    t.a = springls__mad(p, u, radius);
    t.b = springls__mad(springls__mad(p, u, -0.5f * radius), v, 0.866025404f * radius);
    t.c = springls__mad(springls__mad(p, u, -0.5f * radius), v, -0.866025404f * radius);
    return t;
}

/* phi cannot hold a sheet thinner than a voxel, so there a springl may be far from the zero level and yet be right. What a
   neighbour at d from it, facing n_other, has to say: 1 when it lies on the other side of the same sheet, behind the springl. */
SPRINGLS__MATHS int springls__is_far_side(springls__v3 d, springls__v3 n, springls__v3 n_other)
{
    const float reach = 1.6f, aside = 1.0f;
    float depth = -springls__dot(d, n), d2 = springls__length2(d);
    return springls__dot(n, n_other) < -0.5f && depth > -0.1f && d2 < reach * reach && d2 - depth * depth < aside * aside;
}

/* 1 when it is beside the springl, on the same side or round the sheet's rim. */
SPRINGLS__MATHS int springls__is_beside(springls__v3 d, springls__v3 n, springls__v3 n_other)
{
    const float reach = 1.5f;
    return springls__dot(n, n_other) > -0.2f && springls__length2(d) < reach * reach;
}
