/* finite.h - distinguishes numbers from NaN and infinity by their bits: a compiler that may assume finite numbers (-ffast-math) takes every
   comparison with a NaN for true or false as it likes. All input is checked with these, before it is compared. */
#ifndef SPRINGLS__RUNTIME_FINITE_H
#define SPRINGLS__RUNTIME_FINITE_H

#include "base.h"

/* Returns the bits of |x|; volatile, because compilers know what numbers the bits of a float may be. */
SPRINGLS__FN uint32_t springls__magnitude_bits_float(float x)
{
    uint32_t bits;
    volatile uint32_t seen;
    memcpy(&bits, &x, sizeof bits);
    seen = bits;
    return seen & 0x7fffffffu;
}

SPRINGLS__FN uint64_t springls__magnitude_bits(double x)
{
    uint64_t bits;
    volatile uint64_t seen;
    memcpy(&bits, &x, sizeof bits);
    seen = bits;
    return seen & 0x7fffffffffffffffu;
}

/* Returns whether a number is neither NaN nor infinite. */
SPRINGLS__FN bool springls__finite_float(float x) { return springls__magnitude_bits_float(x) < 0x7f800000u; }
SPRINGLS__FN bool springls__finite(double x) { return springls__magnitude_bits(x) < 0x7ff0000000000000u; }

SPRINGLS__FN bool springls__is_nan_float(float x) { return springls__magnitude_bits_float(x) > 0x7f800000u; }
SPRINGLS__FN bool springls__is_nan(double x) { return springls__magnitude_bits(x) > 0x7ff0000000000000u; }

#endif
