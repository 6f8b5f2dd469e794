/* simd.h - springls__vec, SPRINGLS__LANES floats at once: the type of the hot loops. GCC and clang have the vectors of the
   target, OpenCL has float8, other compilers and SPRINGLS_NO_SIMD have one lane, a float. Each lane does the operations of a
   single number in the same order, so every width gives the same bits. */
#ifndef SPRINGLS__KERNEL_LANGUAGE_SIMD_H
#define SPRINGLS__KERNEL_LANGUAGE_SIMD_H

#include "vector.h"

#if defined(__OPENCL_VERSION__)

#define SPRINGLS__LANES 8
#define SPRINGLS__VEC_MATHS SPRINGLS__MATHS
typedef float8 springls__vec;
typedef int8 springls__vmask; /* of a comparison: all bits of a lane, or none */
#define springls__vec_load(from) vload8(0, from)
#define springls__vec_store(to, v) vstore8(v, 0, to)
#define springls__vec_broadcast(x) ((float8)(x))
#define springls__vec_select(where, yes, no) select(no, yes, where)
#define springls__vec_fabs(x) fabs(x)
#define springls__vec_sqrt(x) sqrt(x)
#define springls__vec_of_int(k) convert_float8(k)
#define springls__vec_to_int(x) convert_int8(x)
#define springls__vec_of_bits(bits) as_float8(bits)
#define springls__vec_negated_if_odd(x, k) as_float8(as_int8(x) ^ ((k) << 31))
#define springls__vec_not(where) (~(where))
#define springls__vec_any(where) any(where)
SPRINGLS__MATHS uint springls__vec_bits(int8 where)
{
    int8 bit = where & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
    int4 bits = bit.lo | bit.hi;
    return (uint)(bits.x | bits.y | bits.z | bits.w);
}
#define springls__vec_zip_low(a, b) ((float8)((a).s0, (b).s0, (a).s1, (b).s1, (a).s2, (b).s2, (a).s3, (b).s3))
#define springls__vec_zip_high(a, b) ((float8)((a).s4, (b).s4, (a).s5, (b).s5, (a).s6, (b).s6, (a).s7, (b).s7))
SPRINGLS__MATHS springls__vec springls__vec_min(springls__vec a, springls__vec b) { return select(b, a, a < b); }
SPRINGLS__MATHS springls__vec springls__vec_max(springls__vec a, springls__vec b) { return select(b, a, a > b); }

#elif !defined(__GNUC__) || defined(SPRINGLS_NO_SIMD)

#define SPRINGLS__LANES 1
#define SPRINGLS__VEC_MATHS SPRINGLS__MATHS
typedef float springls__vec;
typedef int springls__vmask; /* of a comparison: not 0, or 0 */
#define springls__vec_load(from) springls__load(from)
#define springls__vec_store(to, v) springls__store(to, v)
#define springls__vec_broadcast(x) springls__broadcast(x)
#define springls__vec_select(where, yes, no) springls__select(where, yes, no)
#define springls__vec_fabs(x) springls__fabs(x)
#define springls__vec_sqrt(x) springls__sqrt(x)
#define springls__vec_floor(x) springls__floor(x)
#define springls__vec_to_int(x) springls__to_int(x)
#define springls__vec_of_bits(bits) springls__of_bits(bits)
#define springls__vec_negated_if_odd(x, k) springls__negated_if_odd(x, k)
#define springls__vec_not(where) (!(where))
#define springls__vec_any(where) ((where) != 0)
#define springls__vec_bits(where) ((uint32_t)((where) != 0))
#define springls__vec_transpose(rows) (void)(rows)
#define springls__vec_min(a, b) springls__min(a, b)
#define springls__vec_max(a, b) springls__max(a, b)

#else

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

#define SPRINGLS__VEC_MATHS __attribute__((__unused__, __always_inline__)) static inline

typedef float springls__vec __attribute__((__vector_size__(4 * SPRINGLS__LANES)));
typedef int springls__vmask __attribute__((__vector_size__(4 * SPRINGLS__LANES))); /* of a comparison: all bits of a lane, or none */
typedef float springls__vec_anywhere __attribute__((__vector_size__(4 * SPRINGLS__LANES), __aligned__(4), __may_alias__));

#define springls__vec_of_int(k) __builtin_convertvector(k, springls__vec)
#define springls__vec_to_int(x) __builtin_convertvector(x, springls__vmask)
#define springls__vec_of_bits(bits) ((springls__vec)(bits))
#define springls__vec_negated_if_odd(x, k) ((springls__vec)((springls__vmask)(x) ^ ((k) << 31)))
#define springls__vec_not(where) (~(where))

SPRINGLS__VEC_MATHS springls__vec springls__vec_load(const float *from)
{
    return *(const springls__vec_anywhere *)(const void *)from;
}

SPRINGLS__VEC_MATHS void springls__vec_store(float *to, springls__vec v) { *(springls__vec_anywhere *)(void *)to = v; }

SPRINGLS__VEC_MATHS springls__vec springls__vec_broadcast(float x)
{
    springls__vec v = { 0 };
    return x - v; /* x + 0 would lose the sign of -0 */
}

SPRINGLS__VEC_MATHS springls__vec springls__vec_select(springls__vmask where, springls__vec yes, springls__vec no)
{
    return (springls__vec)((where & (springls__vmask)yes) | (~where & (springls__vmask)no));
}

/* Returns a < b ? a : b, the second where they are equal or not ordered. */
SPRINGLS__VEC_MATHS springls__vec springls__vec_min(springls__vec a, springls__vec b)
{
#if defined(SPRINGLS__SIMD)
    return (springls__vec)SPRINGLS__SIMD(min)((springls__simd)a, (springls__simd)b);
#else
    return springls__vec_select(a < b, a, b);
#endif
}

SPRINGLS__VEC_MATHS springls__vec springls__vec_max(springls__vec a, springls__vec b)
{
#if defined(SPRINGLS__SIMD)
    return (springls__vec)SPRINGLS__SIMD(max)((springls__simd)a, (springls__simd)b);
#else
    return springls__vec_select(a > b, a, b);
#endif
}

SPRINGLS__VEC_MATHS springls__vec springls__vec_fabs(springls__vec x)
{
    springls__vmask sign = (springls__vmask)springls__vec_broadcast(-0.0f);
    return (springls__vec)((springls__vmask)x & ~sign);
}

SPRINGLS__VEC_MATHS springls__vec springls__vec_sqrt(springls__vec x)
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

SPRINGLS__VEC_MATHS bool springls__vec_any(springls__vmask where)
{
#if defined(SPRINGLS__SIMD)
    return SPRINGLS__SIMD(movemask)((springls__simd)where) != 0;
#else
    int i, any = 0;
    for (i = 0; i < SPRINGLS__LANES; i++) any |= where[i];
    return any != 0;
#endif
}

/* Returns a bit for each lane. */
SPRINGLS__VEC_MATHS uint32_t springls__vec_bits(springls__vmask where)
{
#if defined(SPRINGLS__SIMD)
    return (uint32_t)SPRINGLS__SIMD(movemask)((springls__simd)where);
#else
    uint32_t bits = 0u;
    int i;
    for (i = 0; i < SPRINGLS__LANES; i++) bits |= (uint32_t)(where[i] & 1) << i;
    return bits;
#endif
}

/* Interleaves the lower halves of two vectors, or the upper ones. */
#if defined(__clang__) && SPRINGLS__LANES == 8
#define springls__vec_zip_low(a, b) __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11)
#define springls__vec_zip_high(a, b) __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15)
#elif defined(__clang__)
#define springls__vec_zip_low(a, b) __builtin_shufflevector(a, b, 0, 4, 1, 5)
#define springls__vec_zip_high(a, b) __builtin_shufflevector(a, b, 2, 6, 3, 7)
#else
SPRINGLS__VEC_MATHS springls__vec springls__vec_zip_low(springls__vec a, springls__vec b)
{
#if SPRINGLS__LANES == 8
    const springls__vmask from = { 0, 8, 1, 9, 2, 10, 3, 11 };
#else
    const springls__vmask from = { 0, 4, 1, 5 };
#endif
    return __builtin_shuffle(a, b, from);
}

SPRINGLS__VEC_MATHS springls__vec springls__vec_zip_high(springls__vec a, springls__vec b)
{
#if SPRINGLS__LANES == 8
    const springls__vmask from = { 4, 12, 5, 13, 6, 14, 7, 15 };
#else
    const springls__vmask from = { 2, 6, 3, 7 };
#endif
    return __builtin_shuffle(a, b, from);
}
#endif

#endif

typedef struct springls__vec3 { springls__vec x, y, z; } springls__vec3;

#if SPRINGLS__LANES > 1
/* Transposes a square of numbers. */
SPRINGLS__VEC_MATHS void springls__vec_transpose(springls__vec *rows)
{
    springls__vec old[SPRINGLS__LANES];
    int round, i;
    for (round = 1; round < SPRINGLS__LANES; round *= 2) {
        for (i = 0; i < SPRINGLS__LANES; i++) old[i] = rows[i];
        for (i = 0; i < SPRINGLS__LANES / 2; i++) {
            rows[2 * i] = springls__vec_zip_low(old[i], old[i + SPRINGLS__LANES / 2]);
            rows[2 * i + 1] = springls__vec_zip_high(old[i], old[i + SPRINGLS__LANES / 2]);
        }
    }
}

/* Returns x rounded down, for |x| < 2^31. */
SPRINGLS__VEC_MATHS springls__vec springls__vec_floor(springls__vec x)
{
    springls__vec t = springls__vec_of_int(springls__vec_to_int(x));
    return t - springls__vec_select(t > x, springls__vec_broadcast(1.0f), springls__vec_broadcast(0.0f));
}
#endif

#include "width_simd.h"
#include "vector_body.h"

/* Holds the numbers that springls__vec_from reads. */
SPRINGLS__CONST float springls__ramp[8] = { 0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f };

/* Returns first, first + 1, ..., for the places along a row of eight. */
SPRINGLS__VEC_MATHS springls__vec springls__vec_from(int first) { return springls__vec_load(springls__ramp + first); }

#endif
