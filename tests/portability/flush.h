/* flush.h - the calling thread's float unit, told to take denormal numbers for zero, as audio and game engines do. */
#ifndef FLUSH_H
#define FLUSH_H

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

/* Makes denormal operands and results of this thread zero, or stops that. Returns false on platforms without a way to do so
   here. */
static bool flush_denormals(bool on)
{
#if defined(__SSE2__)
    const unsigned flags = 0x8040u; /* FTZ, DAZ */
    _mm_setcsr(on ? _mm_getcsr() | flags : _mm_getcsr() & ~flags);
    return true;
#elif defined(__aarch64__) && defined(__GNUC__)
    const uint64_t flag = (uint64_t)1 << 24; /* FZ */
    uint64_t control;
    __asm__ volatile("mrs %0, fpcr" : "=r"(control));
    control = on ? control | flag : control & ~flag;
    __asm__ volatile("msr fpcr, %0" : : "r"(control));
    return true;
#elif defined(__arm__) && defined(__ARM_FP) && defined(__GNUC__)
    const uint32_t flag = (uint32_t)1 << 24; /* FZ */
    uint32_t control;
    __asm__ volatile("vmrs %0, fpscr" : "=r"(control));
    control = on ? control | flag : control & ~flag;
    __asm__ volatile("vmsr fpscr, %0" : : "r"(control));
    return true;
#else
    (void)on;
    return false;
#endif
}

/* Is half of the smallest normal number zero? */
static bool denormals_are_flushed(void)
{
    volatile float smallest = 1.17549435e-38f;
    smallest = smallest * 0.5f;
    return smallest == 0.0f;
}

#endif
