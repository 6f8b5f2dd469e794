/* rebuild.h - re-distancing: phi becomes a signed distance again without moving its zero level (Table 2). */

/* The smallest and the largest of the six neighbours. */
SPRINGLS__MATHS float springls__least(springls__cross7 v)
{
    return springls__min(springls__min(springls__min(v.xm, v.xp), springls__min(v.ym, v.yp)), springls__min(v.zm, v.zp));
}

SPRINGLS__MATHS float springls__most(springls__cross7 v)
{
    return springls__max(springls__max(springls__max(v.xm, v.xp), springls__max(v.ym, v.yp)), springls__max(v.zm, v.zp));
}

/* True when a voxel and one of its six neighbours lie on different sides. */
SPRINGLS__MATHS int springls__at_interface(springls__cross7 v)
{
    float lo = springls__least(v), hi = springls__most(v);
    return v.c < 0.0f ? hi >= 0.0f : lo < 0.0f;
}

/* Square of the slope along one axis: central, or the steeper side where the two disagree (a ridge or a thin sheet). One
   side flat makes the central slope half of the steeper: that is a ridge, whatever the rounding. */
SPRINGLS__MATHS float springls__slope2(float m, float c, float p)
{
    float central = 0.5f * (p - m), left = c - m, right = p - c;
    float steep = springls__max(springls__fabs(left), springls__fabs(right));
    float flat = springls__fabs(central);
    float slope = flat < 0.65f * steep ? steep : flat;
    return slope * slope;
}

/* Sub-voxel distance of a voxel near the interface: phi over its slope. A slope within 5 % of 1 is left as it is, from 10 %
   on it becomes 1: what is a distance already does not creep, however often it is rebuilt. */
SPRINGLS__MATHS float springls__interface_distance(springls__cross7 v)
{
    float g2 = springls__slope2(v.xm, v.c, v.xp) + springls__slope2(v.ym, v.c, v.yp) + springls__slope2(v.zm, v.c, v.zp);
    float excess = springls__sqrt(springls__max(g2, 1e-4f)) - 1.0f;
    float share = springls__clamp(20.0f * springls__fabs(excess) - 1.0f, 0.0f, 1.0f);
    return v.c / (1.0f + share * excess);
}

/* Beside a plane a voxel that is not at the interface is at least 1/sqrt(3) away. Beside a sharp edge or corner it can be
   nearer, and the way by its neighbours would be too long: there too its own slope tells its distance d. One of its 26
   neighbours is then on the other side, unlike with the remnants of parts that have vanished. */
#define SPRINGLS__NEAR 0.577f

SPRINGLS__MATHS int springls__at_sharp_edge(float phi, float d) { return springls__fabs(phi) < 1.0f && springls__fabs(d) < SPRINGLS__NEAR; }

/* First guess for a voxel that gets its distance from its neighbours: it is not near. */
SPRINGLS__MATHS float springls__distance_guess(float phi, float far_value)
{
    float d = springls__clamp(springls__fabs(phi), SPRINGLS__NEAR, far_value);
    return phi < 0.0f ? -d : d;
}

/* |grad d| = 1 (Godunov) from the smaller neighbour distance along each axis. */
SPRINGLS__MATHS float springls__eikonal(float x, float y, float z)
{
    float a = springls__min(x, springls__min(y, z)), c = springls__max(x, springls__max(y, z));
    float b = springls__max(springls__min(x, y), springls__min(springls__max(x, y), z));
    float one = a + 1.0f;
    float two = 0.5f * (a + b + springls__sqrt(springls__max(2.0f - (a - b) * (a - b), 0.0f)));
    float sum = a + b + c;
    float three = (sum + springls__sqrt(springls__max(sum * sum - 3.0f * (a * a + b * b + c * c - 1.0f), 0.0f))) * (1.0f / 3.0f);
    float d = one > b ? two : one;
    return d > c ? three : d;
}

/* New distance of a voxel from its neighbours'. It keeps its own at the interface, and where it is near and one of its 26
   neighbours on the other side (touches): near springls alone are no surface. */
SPRINGLS__MATHS float springls__redistance(springls__cross7 v, int touches, float far_value)
{
    float d = springls__eikonal(springls__min(springls__fabs(v.xm), springls__fabs(v.xp)),
                                springls__min(springls__fabs(v.ym), springls__fabs(v.yp)),
                                springls__min(springls__fabs(v.zm), springls__fabs(v.zp)));
    d = springls__min(d, far_value);
    if ((touches && springls__fabs(v.c) < SPRINGLS__NEAR) || springls__at_interface(v)) return v.c;
    return v.c < 0.0f ? -d : d;
}
