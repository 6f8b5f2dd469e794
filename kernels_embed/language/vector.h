/* vector.h - three-vectors and functions of single numbers. */
#ifndef SPRINGLS__KERNEL_LANGUAGE_VECTOR_H
#define SPRINGLS__KERNEL_LANGUAGE_VECTOR_H

#include "compat.h"

#define SPRINGLS__DEGREE 0.0174532925f /* radians */
#define SPRINGLS__OVER_PI 0.318309886f /* 1 / pi  */

typedef struct springls__v3 { float x, y, z; } springls__v3;

/* The primitives of every *_body.h for single numbers; simd.h has those for several at once. */
#define springls__broadcast(x) (x)
#define springls__select(where, yes, no) ((where) ? (yes) : (no))
#define springls__any(where) (where)
#define springls__not(where) (!(where))
#define springls__load(from) (*(from))
#define springls__store(to, x) (void)(*(to) = (x))
#define springls__to_int(x) ((int)(x))
#define springls__negated_if_odd(x, k) ((k) & 1 ? -(x) : (x))
#define springls__transpose(rows) (void)(rows)
#define springls__of_bits(bits) springls__float_of_bits(bits)
SPRINGLS__MATHS float springls__min(float a, float b) { return a < b ? a : b; }
SPRINGLS__MATHS float springls__max(float a, float b) { return a > b ? a : b; }

#include "width_float.h"
#include "vector_body.h"

SPRINGLS__MATHS int springls__imin(int a, int b) { return a < b ? a : b; }
SPRINGLS__MATHS int springls__imax(int a, int b) { return a > b ? a : b; }
SPRINGLS__MATHS int springls__iclamp(int x, int lo, int hi) { return springls__imin(springls__imax(x, lo), hi); }

SPRINGLS__MATHS springls__v3 springls__lerp(springls__v3 a, springls__v3 b, float t)
{
    return springls__mad(a, springls__sub(b, a), t);
}

SPRINGLS__MATHS springls__v3 springls__min3(springls__v3 a, springls__v3 b)
{
    return springls__v3_make(springls__min(a.x, b.x), springls__min(a.y, b.y), springls__min(a.z, b.z));
}

SPRINGLS__MATHS springls__v3 springls__max3(springls__v3 a, springls__v3 b)
{
    return springls__v3_make(springls__max(a.x, b.x), springls__max(a.y, b.y), springls__max(a.z, b.z));
}

/* A box along the axes. */
typedef struct springls__box { springls__v3 lower, upper; } springls__box;

/* Returns an empty box, to which springls__box_add adds places. */
SPRINGLS__MATHS springls__box springls__box_empty(void)
{
    springls__box box;
    box.lower = springls__v3_make(FLT_MAX, FLT_MAX, FLT_MAX);
    box.upper = springls__v3_make(-FLT_MAX, -FLT_MAX, -FLT_MAX);
    return box;
}

SPRINGLS__MATHS springls__box springls__box_add(springls__box box, springls__v3 x)
{
    box.lower = springls__min3(box.lower, x);
    box.upper = springls__max3(box.upper, x);
    return box;
}

/* Returns the box with `margin` more on every side. */
SPRINGLS__MATHS springls__box springls__box_widened(springls__box box, float margin)
{
    const springls__v3 by = springls__v3_make(margin, margin, margin);
    box.lower = springls__sub(box.lower, by);
    box.upper = springls__add(box.upper, by);
    return box;
}

SPRINGLS__MATHS bool springls__box_contains(springls__box box, springls__v3 x)
{
    return x.x >= box.lower.x && x.y >= box.lower.y && x.z >= box.lower.z && x.x <= box.upper.x && x.y <= box.upper.y
        && x.z <= box.upper.z;
}

/* Returns a unit vector perpendicular to n. */
SPRINGLS__MATHS springls__v3 springls__any_tangent(springls__v3 n)
{
    springls__v3 axis = springls__fabs(n.x) < 0.6f ? springls__v3_make(1.0f, 0.0f, 0.0f) : springls__v3_make(0.0f, 1.0f, 0.0f);
    return springls__normalize(springls__cross(n, axis));
}

/* Interpolates between eight corners: corner c lies at (c & 1, (c >> 1) & 1, c >> 2). */
SPRINGLS__INNER float springls__trilinear(const float corner[8], float u, float v, float w)
{
    float x00 = corner[0] + (corner[1] - corner[0]) * u, x10 = corner[2] + (corner[3] - corner[2]) * u;
    float x01 = corner[4] + (corner[5] - corner[4]) * u, x11 = corner[6] + (corner[7] - corner[6]) * u;
    float y0 = x00 + (x10 - x00) * v, y1 = x01 + (x11 - x01) * v;
    return y0 + (y1 - y0) * w;
}

#endif
