/* rebuild.h - re-distancing: phi becomes a signed distance again without moving its zero level (Table 2). */

/* True when a voxel and one of its six neighbours lie on different sides. */
SPRINGLS__MATHS int springls__at_interface(springls__cross7 v)
{
    float lo = springls__min(springls__min(springls__min(v.xm, v.xp), springls__min(v.ym, v.yp)), springls__min(v.zm, v.zp));
    float hi = springls__max(springls__max(springls__max(v.xm, v.xp), springls__max(v.ym, v.yp)), springls__max(v.zm, v.zp));
    return v.c < 0.0f ? hi >= 0.0f : lo < 0.0f;
}

/* Square of the slope along one axis: central, or the steeper side where the two disagree (a ridge or a thin sheet). */
SPRINGLS__MATHS float springls__slope2(float m, float c, float p)
{
    float central = 0.5f * (p - m), left = c - m, right = p - c;
    float steep = springls__max(springls__fabs(left), springls__fabs(right));
    float flat = springls__fabs(central);
    float slope = flat < 0.5f * steep ? steep : flat;
    return slope * slope;
}

/* Sub-voxel distance of a voxel at the interface: phi over its slope. */
SPRINGLS__MATHS float springls__interface_distance(springls__cross7 v)
{
    float g2 = springls__slope2(v.xm, v.c, v.xp) + springls__slope2(v.ym, v.c, v.yp) + springls__slope2(v.zm, v.c, v.zp);
    return v.c / springls__sqrt(springls__max(g2, 1e-4f));
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

/* New distance of a voxel away from the interface: all its neighbours lie on its side. */
SPRINGLS__MATHS float springls__redistance(springls__cross7 v, float far_value)
{
    float d = springls__eikonal(springls__min(springls__fabs(v.xm), springls__fabs(v.xp)),
                                springls__min(springls__fabs(v.ym), springls__fabs(v.yp)),
                                springls__min(springls__fabs(v.zm), springls__fabs(v.zp)));
    d = springls__min(d, far_value);
    return v.c < 0.0f ? -d : d;
}
