/* winding.h - the solid angle of one triangle: a surface winds around a point by the sum of them over 4 pi. */
#ifndef SPRINGLS__KERNEL_LANGUAGE_WINDING_H
#define SPRINGLS__KERNEL_LANGUAGE_WINDING_H

#include "triangle.h"

/* Returns the angle of (x, y) in (-pi, pi]; 0 at the origin. Absolute error below 5e-7. */
SPRINGLS__MATHS float springls__atan2(float y, float x)
{
    float ax = springls__fabs(x), ay = springls__fabs(y);
    float hi = springls__max(ax, ay), lo = springls__min(ax, ay);
    float r = hi > 0.0f ? lo / hi : 0.0f;
    float s = r * r;
    float a = r * (1.0f + s * (-0.33333037f + s * (0.19991872f + s * (-0.14197798f + s * (0.10618371f
                 + s * (-0.07456855f + s * (0.04213762f + s * (-0.01573125f + s * 0.00276628f))))))));
    if (ay > ax) a = 1.57079633f - a;
    if (x < 0.0f) a = 3.14159265f - a;
    return y < 0.0f ? -a : a;
}

/* Returns the solid angle under which t is seen from x, positive when its normal points away from x. */
SPRINGLS__MATHS float springls__solid_angle(springls__tri t, springls__v3 x)
{
    springls__v3 a = springls__sub(t.a, x), b = springls__sub(t.b, x), c = springls__sub(t.c, x);
    float la = springls__length(a), lb = springls__length(b), lc = springls__length(c);
    float volume = springls__dot(a, springls__cross(springls__sub(t.b, t.a), springls__sub(t.c, t.a)));
    float angle = la * lb * lc + springls__dot(a, b) * lc + springls__dot(b, c) * la + springls__dot(c, a) * lb;
    return 2.0f * springls__atan2(volume, angle);
}

#endif
