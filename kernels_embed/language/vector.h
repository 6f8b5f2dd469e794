/* vector.h - three-vectors and the few scalar functions that every stage needs.
   tanh, atanh, exp, sin and cos are our own: libm's and OpenCL's differ in the last bits, and state must not. */
#ifndef SPRINGLS__KERNEL_LANGUAGE_VECTOR_H
#define SPRINGLS__KERNEL_LANGUAGE_VECTOR_H

#include "compat.h"

typedef struct springls__v3 { float x, y, z; } springls__v3;

SPRINGLS__MATHS float springls__min(float a, float b) { return a < b ? a : b; }
SPRINGLS__MATHS float springls__max(float a, float b) { return a > b ? a : b; }
SPRINGLS__MATHS float springls__clamp(float x, float lo, float hi) { return springls__min(springls__max(x, lo), hi); }
SPRINGLS__MATHS int springls__imin(int a, int b) { return a < b ? a : b; }
SPRINGLS__MATHS int springls__imax(int a, int b) { return a > b ? a : b; }
SPRINGLS__MATHS int springls__iclamp(int x, int lo, int hi) { return springls__imin(springls__imax(x, lo), hi); }

SPRINGLS__MATHS springls__v3 springls__v3_make(float x, float y, float z)
{
    springls__v3 v;
    v.x = x; v.y = y; v.z = z;
    return v;
}

SPRINGLS__MATHS springls__v3 springls__add(springls__v3 a, springls__v3 b)
{
    return springls__v3_make(a.x + b.x, a.y + b.y, a.z + b.z);
}

SPRINGLS__MATHS springls__v3 springls__sub(springls__v3 a, springls__v3 b)
{
    return springls__v3_make(a.x - b.x, a.y - b.y, a.z - b.z);
}

SPRINGLS__MATHS springls__v3 springls__scale(springls__v3 a, float s)
{
    return springls__v3_make(a.x * s, a.y * s, a.z * s);
}

/* a + s b */
SPRINGLS__MATHS springls__v3 springls__mad(springls__v3 a, springls__v3 b, float s)
{
    return springls__v3_make(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s);
}

SPRINGLS__MATHS springls__v3 springls__lerp(springls__v3 a, springls__v3 b, float t)
{
    return springls__mad(a, springls__sub(b, a), t);
}

SPRINGLS__MATHS float springls__dot(springls__v3 a, springls__v3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

SPRINGLS__MATHS springls__v3 springls__cross(springls__v3 a, springls__v3 b)
{
    return springls__v3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

SPRINGLS__MATHS float springls__length2(springls__v3 a) { return springls__dot(a, a); }
SPRINGLS__MATHS float springls__length(springls__v3 a) { return springls__sqrt(springls__dot(a, a)); }

/* The unit vector along a; the zero vector stays zero. */
SPRINGLS__MATHS springls__v3 springls__normalize(springls__v3 a)
{
    float l2 = springls__length2(a);
    return l2 > 1e-30f ? springls__scale(a, 1.0f / springls__sqrt(l2)) : springls__v3_make(0.0f, 0.0f, 0.0f);
}

/* A unit vector perpendicular to n. */
SPRINGLS__MATHS springls__v3 springls__any_tangent(springls__v3 n)
{
    springls__v3 axis = springls__fabs(n.x) < 0.6f ? springls__v3_make(1.0f, 0.0f, 0.0f) : springls__v3_make(0.0f, 1.0f, 0.0f);
    return springls__normalize(springls__cross(n, axis));
}

/* exp(x) for x in [-80, 80], relative error below 3e-7: x = k ln 2 + r with |r| <= ln 2 / 2, a series in r, and 2^k
   by repeated squaring, which is exact. */
SPRINGLS__MATHS float springls__exp(float x)
{
    float k = springls__floor(springls__clamp(x, -80.0f, 80.0f) * 1.44269504f + 0.5f);
    float r = (springls__clamp(x, -80.0f, 80.0f) - k * 0.693359375f) + k * 2.12194440e-4f;
    float e = 1.0f + r * (1.0f + r * (0.5f + r * (1.66666667e-1f + r * (4.16666667e-2f
                   + r * (8.33333333e-3f + r * 1.38888889e-3f)))));
    int n = (int)k;
    float two = n < 0 ? 0.5f : 2.0f;
    int i;
    for (i = n < 0 ? -n : n; i > 0; i >>= 1) {
        if (i & 1) e *= two;
        two *= two;
    }
    return e;
}

/* tanh(x) = (1 - e) / (1 + e) with e = exp(-2|x|); an odd series where that would cancel. */
SPRINGLS__MATHS float springls__tanh(float x)
{
    float a = springls__fabs(x);
    float t;
    if (a < 0.25f) {
        float x2 = x * x;
        return x * (1.0f + x2 * (-3.33333333e-1f + x2 * (1.33333333e-1f + x2 * (-5.39682540e-2f + x2 * 2.18694885e-2f))));
    }
    if (a > 9.0f) return x < 0.0f ? -1.0f : 1.0f;
    t = springls__exp(-2.0f * a);
    t = (1.0f - t) / (1.0f + t);
    return x < 0.0f ? -t : t;
}

/* Natural logarithm of a normal positive float, by halving into [2/3, 4/3] and the atanh series. */
SPRINGLS__MATHS float springls__ln(float x)
{
    float k = 0.0f, s, s2;
    while (x > 1.33333333f) { x *= 0.5f; k += 1.0f; }
    while (x < 0.66666667f) { x *= 2.0f; k -= 1.0f; }
    s = (x - 1.0f) / (x + 1.0f);
    s2 = s * s;
    return k * 0.69314718f + 2.0f * s * (1.0f + s2 * (0.33333333f + s2 * (0.2f + s2 * (0.14285714f + s2 * 0.11111111f))));
}

/* atanh(x) = log((1 + x) / (1 - x)) / 2, its argument kept 1e-3 away from the poles. */
SPRINGLS__MATHS float springls__atanh(float x)
{
    float c = springls__clamp(x, -0.999f, 0.999f);
    return 0.5f * springls__ln((1.0f + c) / (1.0f - c));
}

/* sin(pi x) for any x of moderate size: reduced to [-1/2, 1/2], odd polynomial of degree 11 (absolute error below 2e-7). */
SPRINGLS__MATHS float springls__sinpi(float x)
{
    float k = springls__floor(x + 0.5f);
    float r = x - k;
    float r2 = r * r;
    float s = r * (3.14159265f + r2 * (-5.16771278f + r2 * (2.55016404f + r2 * (-0.599264529f
                 + r2 * (0.0821458866f + r2 * -0.00737043094f)))));
    float half_k = k * 0.5f;
    return half_k == springls__floor(half_k) ? s : -s;
}

SPRINGLS__MATHS float springls__cospi(float x) { return springls__sinpi(x + 0.5f); }

/* Trilinear value between eight corners: corner c lies at (c & 1, (c >> 1) & 1, c >> 2). */
SPRINGLS__MATHS float springls__trilinear(const float corner[8], float u, float v, float w)
{
    float x00 = corner[0] + (corner[1] - corner[0]) * u, x10 = corner[2] + (corner[3] - corner[2]) * u;
    float x01 = corner[4] + (corner[5] - corner[4]) * u, x11 = corner[6] + (corner[7] - corner[6]) * u;
    float y0 = x00 + (x10 - x00) * v, y1 = x01 + (x11 - x01) * v;
    return y0 + (y1 - y0) * w;
}

#endif
