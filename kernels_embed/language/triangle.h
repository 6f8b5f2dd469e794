/* triangle.h - distances and shapes of one triangle. */

typedef struct springls__tri { springls__v3 a, b, c; } springls__tri;

/* The point of a triangle closest to some other point: bary are its weights on a, b, c. */
typedef struct springls__tri_hit { springls__v3 point; float d2; float bary[3]; } springls__tri_hit;

/* Parameter in [0,1] of the point of segment a-b closest to x; inv is 1/|b-a|^2, or 0 for a segment of no length. */
SPRINGLS__MATHS float springls__segment_parameter(springls__v3 x, springls__v3 a, springls__v3 b, float inv)
{
    return springls__clamp(springls__dot(springls__sub(x, a), springls__sub(b, a)) * inv, 0.0f, 1.0f);
}

SPRINGLS__MATHS float springls__inverse_length2(springls__v3 a, springls__v3 b)
{
    float l2 = springls__length2(springls__sub(b, a));
    return l2 > 1e-20f ? 1.0f / l2 : 0.0f;
}

SPRINGLS__MATHS springls__tri_hit springls__tri_hit_make(springls__tri t, springls__v3 x, float u, float v, float w)
{
    springls__tri_hit h;
    h.bary[0] = u; h.bary[1] = v; h.bary[2] = w;
    h.point = springls__v3_make(t.a.x * u + t.b.x * v + t.c.x * w, t.a.y * u + t.b.y * v + t.c.y * w,
                                t.a.z * u + t.b.z * v + t.c.z * w);
    h.d2 = springls__length2(springls__sub(x, h.point));
    return h;
}

/* Closest point of triangle t to x, by Voronoi regions. A triangle of no area answers with its closest edge point. */
SPRINGLS__MATHS springls__tri_hit springls__tri_closest(springls__tri t, springls__v3 x)
{
    springls__v3 ab = springls__sub(t.b, t.a), ac = springls__sub(t.c, t.a);
    springls__v3 n = springls__cross(ab, ac), ax = springls__sub(x, t.a);
    float n2 = springls__length2(n);
    springls__tri_hit best, h;
    float s;
    if (n2 > 1e-20f) {
        float w = springls__dot(springls__cross(ab, ax), n) / n2;
        float v = springls__dot(springls__cross(ax, ac), n) / n2;
        float u = 1.0f - v - w;
        if (u >= 0.0f && v >= 0.0f && w >= 0.0f) return springls__tri_hit_make(t, x, u, v, w);
    }
    s = springls__segment_parameter(x, t.a, t.b, springls__inverse_length2(t.a, t.b));
    best = springls__tri_hit_make(t, x, 1.0f - s, s, 0.0f);
    s = springls__segment_parameter(x, t.b, t.c, springls__inverse_length2(t.b, t.c));
    h = springls__tri_hit_make(t, x, 0.0f, 1.0f - s, s);
    if (h.d2 < best.d2) best = h;
    s = springls__segment_parameter(x, t.c, t.a, springls__inverse_length2(t.c, t.a));
    h = springls__tri_hit_make(t, x, s, 0.0f, 1.0f - s);
    if (h.d2 < best.d2) best = h;
    return best;
}

/* Twice the vector area: its direction is the outward normal of a counter-clockwise triangle. */
SPRINGLS__MATHS springls__v3 springls__tri_area2(springls__tri t)
{
    return springls__cross(springls__sub(t.b, t.a), springls__sub(t.c, t.a));
}

SPRINGLS__MATHS springls__v3 springls__tri_normal(springls__tri t) { return springls__normalize(springls__tri_area2(t)); }

SPRINGLS__MATHS springls__v3 springls__tri_centroid(springls__tri t)
{
    return springls__scale(springls__add(springls__add(t.a, t.b), t.c), 1.0f / 3.0f);
}
