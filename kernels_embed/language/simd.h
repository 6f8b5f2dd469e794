/* lanes.h - vectors of several floats, for the hot loops of lanes_*.h: the same operations in the same order as the scalar text of
   kernels_embed/, hence the same bits, whatever the width. GCC and clang make of them the SIMD that the target has. Other
   compilers, and SPRINGLS_NO_SIMD, run the scalar text. */
#ifndef SPRINGLS__KERNEL_LANGUAGE_SIMD_H
#define SPRINGLS__KERNEL_LANGUAGE_SIMD_H

#include "vector.h"

#if defined(__OPENCL_VERSION__)
#define SPRINGLS__LANES 8
#define SPRINGLS__LANE SPRINGLS__MATHS
typedef float8 springls__vec;
typedef int8 springls__vmask; /* a comparison: all bits of a lane or none */
#define springls__vec_load(from) vload8(0, from)
#define springls__vec_store(to, v) vstore8(v, 0, to)
#define springls__vec_all(x) ((float8)(x))
#define springls__vec_select(where, yes, no) select(no, yes, where)
#define springls__vec_min(a, b) springls__vec_lesser(a, b)
#define springls__vec_max(a, b) springls__vec_greater(a, b)
#define springls__vec_abs(x) fabs(x)
#define springls__vec_sqrt(x) sqrt(x)
#define springls__vec_of_ints(k) convert_float8(k)
#define springls__vec_to_ints(x) convert_int8(x)
#define springls__vec_of_bits(bits) as_float8(bits)
#define springls__vmask_any(where) any(where)
SPRINGLS__MATHS springls__vec springls__vec_lesser(springls__vec a, springls__vec b) { return select(b, a, a < b); }
SPRINGLS__MATHS springls__vec springls__vec_greater(springls__vec a, springls__vec b) { return select(b, a, a > b); }

#elif defined(__GNUC__) && !defined(SPRINGLS_NO_SIMD)
#if defined(__AVX2__)
#include <immintrin.h>
#define SPRINGLS__LANES 8
#define SPRINGLS__SIMD(operation) _mm256_##operation##_ps
typedef __m256 springls__simd;
#else
#define SPRINGLS__LANES 4
#if defined(__SSE2__)
#include <emmintrin.h>
#define SPRINGLS__SIMD(operation) _mm_##operation##_ps
typedef __m128 springls__simd;
#endif
#endif

#define SPRINGLS__LANE __attribute__((unused, always_inline)) static inline

typedef float springls__vec __attribute__((vector_size(4 * SPRINGLS__LANES)));
typedef int springls__vmask __attribute__((vector_size(4 * SPRINGLS__LANES))); /* a comparison: all bits of a lane or none */
typedef float springls__vec_anywhere __attribute__((vector_size(4 * SPRINGLS__LANES), aligned(4), may_alias));


SPRINGLS__LANE springls__vec springls__vec_load(const float *from) { return *(const springls__vec_anywhere *)(const void *)from; }
SPRINGLS__LANE void springls__vec_store(float *to, springls__vec v) { *(springls__vec_anywhere *)(void *)to = v; }

SPRINGLS__LANE springls__vec springls__vec_all(float x)
{
    springls__vec v = { 0 };
    return x - v; /* x + 0 would lose the sign of -0 */
}

SPRINGLS__LANE springls__vec springls__vec_select(springls__vmask where, springls__vec yes, springls__vec no)
{
    return (springls__vec)((where & (springls__vmask)yes) | (~where & (springls__vmask)no));
}

/* a < b ? a : b, as springls__min: the second where they are equal or not ordered. */
SPRINGLS__LANE springls__vec springls__vec_min(springls__vec a, springls__vec b)
{
#if defined(SPRINGLS__SIMD)
    return (springls__vec)SPRINGLS__SIMD(min)((springls__simd)a, (springls__simd)b);
#else
    return springls__vec_select(a < b, a, b);
#endif
}

SPRINGLS__LANE springls__vec springls__vec_max(springls__vec a, springls__vec b)
{
#if defined(SPRINGLS__SIMD)
    return (springls__vec)SPRINGLS__SIMD(max)((springls__simd)a, (springls__simd)b);
#else
    return springls__vec_select(a > b, a, b);
#endif
}

SPRINGLS__LANE springls__vec springls__vec_abs(springls__vec x)
{
    springls__vmask sign = (springls__vmask)springls__vec_all(-0.0f);
    return (springls__vec)((springls__vmask)x & ~sign);
}

SPRINGLS__LANE springls__vec springls__vec_sqrt(springls__vec x)
{
#if defined(SPRINGLS__SIMD)
    return (springls__vec)SPRINGLS__SIMD(sqrt)((springls__simd)x);
#else
    springls__vec r = x;
    int i;
    for (i = 0; i < SPRINGLS__LANES; i++) r[i] = springls__sqrt(x[i]);
    return r;
#endif
}

SPRINGLS__LANE bool springls__vmask_any(springls__vmask where)
{
#if defined(SPRINGLS__SIMD)
    return SPRINGLS__SIMD(movemask)((springls__simd)where) != 0;
#else
    int i, any = 0;
    for (i = 0; i < SPRINGLS__LANES; i++) any |= where[i];
    return any != 0;
#endif
}

#define springls__vec_of_ints(k) __builtin_convertvector(k, springls__vec)
#define springls__vec_to_ints(x) __builtin_convertvector(x, springls__vmask)
#define springls__vec_of_bits(bits) ((springls__vec)(bits))
#endif

#ifdef SPRINGLS__LANES

typedef struct springls__vec3 { springls__vec x, y, z; } springls__vec3;

SPRINGLS__LANE springls__vec springls__vec_clamp(springls__vec x, float lo, float hi)
{
    return springls__vec_min(springls__vec_max(x, springls__vec_all(lo)), springls__vec_all(hi));
}

/* x rounded down, for |x| < 2^31. */
SPRINGLS__LANE springls__vec springls__vec_floor(springls__vec x)
{
    springls__vec t = springls__vec_of_ints(springls__vec_to_ints(x));
    return t - springls__vec_select(t > x, springls__vec_all(1.0f), springls__vec_all(0.0f));
}

SPRINGLS__LANE springls__vec3 springls__vec3_all(springls__v3 v)
{
    springls__vec3 r;
    r.x = springls__vec_all(v.x);
    r.y = springls__vec_all(v.y);
    r.z = springls__vec_all(v.z);
    return r;
}

SPRINGLS__LANE springls__vec3 springls__vec3_add(springls__vec3 a, springls__vec3 b)
{
    a.x += b.x;
    a.y += b.y;
    a.z += b.z;
    return a;
}

SPRINGLS__LANE springls__vec3 springls__vec3_sub(springls__vec3 a, springls__vec3 b)
{
    a.x -= b.x;
    a.y -= b.y;
    a.z -= b.z;
    return a;
}

SPRINGLS__LANE springls__vec3 springls__vec3_scale(springls__vec3 a, springls__vec s)
{
    a.x *= s;
    a.y *= s;
    a.z *= s;
    return a;
}

/* a + s b */
SPRINGLS__LANE springls__vec3 springls__vec3_mad(springls__vec3 a, springls__vec3 b, springls__vec s)
{
    a.x += b.x * s;
    a.y += b.y * s;
    a.z += b.z * s;
    return a;
}

SPRINGLS__LANE springls__vec springls__vec3_dot(springls__vec3 a, springls__vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

SPRINGLS__LANE springls__vec3 springls__vec3_cross(springls__vec3 a, springls__vec3 b)
{
    springls__vec3 r;
    r.x = a.y * b.z - a.z * b.y;
    r.y = a.z * b.x - a.x * b.z;
    r.z = a.x * b.y - a.y * b.x;
    return r;
}

SPRINGLS__LANE springls__vec springls__vec3_length(springls__vec3 a) { return springls__vec_sqrt(springls__vec3_dot(a, a)); }

SPRINGLS__LANE springls__vec3 springls__vec3_normalize(springls__vec3 a)
{
    springls__vec l2 = springls__vec3_dot(a, a), zero = springls__vec_all(0.0f);
    springls__vec s = springls__vec_all(1.0f) / springls__vec_sqrt(l2);
    springls__vmask some = l2 > springls__vec_all(1e-30f);
    a = springls__vec3_scale(a, s);
    a.x = springls__vec_select(some, a.x, zero);
    a.y = springls__vec_select(some, a.y, zero);
    a.z = springls__vec_select(some, a.z, zero);
    return a;
}

/* 2^k for whole k in [-126, 127]. */
SPRINGLS__LANE springls__vec springls__vec_power2(springls__vec k)
{
    return springls__vec_of_bits((springls__vec_to_ints(k) + 127) << 23);
}

SPRINGLS__LANE springls__vec springls__vec_exp(springls__vec x)
{
    springls__vec in = springls__vec_clamp(x, -80.0f, 80.0f), k = springls__vec_floor(in * 1.44269504f + 0.5f);
    springls__vec r = (in - k * 0.693359375f) + k * 2.12194440e-4f;
    springls__vec e = 1.0f + r * (1.0f + r * (0.5f + r * (1.66666667e-1f + r * (4.16666667e-2f
                          + r * (8.33333333e-3f + r * 1.38888889e-3f)))));
    return e * springls__vec_power2(k);
}

SPRINGLS__LANE springls__vec springls__vec_tanh(springls__vec x)
{
    springls__vec a = springls__vec_abs(x), x2 = x * x, t = springls__vec_exp(-2.0f * a);
    springls__vec series = x * (1.0f + x2 * (-3.33333333e-1f + x2 * (1.33333333e-1f + x2 * (-5.39682540e-2f + x2 * 2.18694885e-2f))));
    t = springls__vec_select(a > 9.0f, springls__vec_all(1.0f), (1.0f - t) / (1.0f + t));
    t = springls__vec_select(x < 0.0f, -t, t);
    return springls__vec_select(a < 0.25f, series, t);
}

SPRINGLS__LANE springls__vec springls__vec_sinpi(springls__vec x)
{
    springls__vec k = springls__vec_floor(x + 0.5f), r = x - k, r2 = r * r, half_k = k * 0.5f;
    springls__vec s = r * (3.14159265f + r2 * (-5.16771278f + r2 * (2.55016404f + r2 * (-0.599264529f
                          + r2 * (0.0821458866f + r2 * -0.00737043094f)))));
    return springls__vec_select(half_k == springls__vec_floor(half_k), s, -s);
}

SPRINGLS__LANE springls__vec springls__vec_cospi(springls__vec x) { return springls__vec_sinpi(x + 0.5f); }

SPRINGLS__LANE springls__vec springls__segment_distance2_lanes(springls__vec3 x, springls__v3 a, springls__v3 e, float inverse)
{
    springls__vec3 d = springls__vec3_sub(x, springls__vec3_all(a)), along = springls__vec3_all(e);
    springls__vec s = springls__vec_clamp(springls__vec3_dot(d, along) * inverse, 0.0f, 1.0f);
    d = springls__vec3_mad(d, along, -s);
    return springls__vec3_dot(d, d);
}

#endif

#endif
