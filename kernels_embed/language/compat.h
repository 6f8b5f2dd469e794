/* compat.h - the one place where the three languages of kernels_embed/ differ.
   Everything below this file is the same text in C99, C++98 and OpenCL C 1.2. */
#ifndef SPRINGLS__KERNEL_LANGUAGE_COMPAT_H
#define SPRINGLS__KERNEL_LANGUAGE_COMPAT_H

#ifdef __OPENCL_VERSION__
  #pragma OPENCL FP_CONTRACT OFF
  /* Marks a function of the shared maths. PoCL 3.1 loses stores to local memory in functions that it does not inline, where a work
     group has several items; where it has one, it compiles twice as fast without. */
  #if defined(SPRINGLS__ON_PROCESSOR)
    #define SPRINGLS__MATHS static
  #else
    #define SPRINGLS__MATHS static inline __attribute__((always_inline))
  #endif
  #define SPRINGLS__INNER   SPRINGLS__MATHS    /* the maths of inner loops              */
  #define SPRINGLS__NOINLINE static __attribute__((noinline)) /* large maths without SPRINGLS__LOCAL memory */
  #define SPRINGLS__GLOBAL  __global           /* memory that kernels and host share    */
  #define SPRINGLS__LOCAL   __local            /* memory of one work group              */
  #define SPRINGLS__BARRIER barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE)
  /* Returns a counter in global memory and raises it by 1; work items may meet there. */
  #define SPRINGLS__NEXT(pointer) atomic_inc((volatile __global uint *)(pointer))
  /* Raises a number in global memory to at least `number`; work items may meet there. */
  #define SPRINGLS__RAISE(pointer, number) atomic_max((volatile __global uint *)(pointer), number)
  /* Reads an int, lowers one to at most `number` with *before as it was, adds to one; work items may meet there. */
  #define SPRINGLS__READ(pointer) atomic_or(pointer, 0)
  #define SPRINGLS__LOWER(before, pointer, number) ((before) = atomic_min(pointer, number))
  #define SPRINGLS__ADD(pointer, number) atomic_add(pointer, number)
  /* Writes a number where other work items may write the same one meanwhile. */
  #define SPRINGLS__MARK(pointer, number) (*(pointer) = (number))
  #define SPRINGLS__CONST   static __constant  /* a read-only table                     */
  /* Calls springls_cl_desc.velocity_source for displace.cl. */
  #define SPRINGLS__USER_VELOCITY                                                                                         \
      float3 springls_velocity(float3 x, float time, __global const float *user);                                         \
      static inline springls__v3 springls__user_velocity(springls__v3 x, float time, __global const float *user)          \
      {                                                                                                                   \
          float3 v = springls_velocity((float3)(x.x, x.y, x.z), time, user);                                              \
          return springls__v3_make(v.x, v.y, v.z);                                                                        \
      }
  typedef uchar uint8_t;
  typedef int int32_t;
  typedef long int64_t;
  typedef uint uint32_t;
  #define springls__sqrt(x)   sqrt(x)
  #define springls__fabs(x)   fabs(x)
  #define springls__float_of_bits(bits) as_float(bits)
  #define springls__float_bits(x) as_uint(x)
  #define springls__lowest_bit(bits) (31 - (int)clz((bits) & (0u - (bits))))
#else
  #include <float.h>
  #include <math.h>
  #include <stddef.h>
  #include <stdint.h>
  #if !defined(__cplusplus)
    #include <stdbool.h>
  #endif
  #include <string.h>
  #if defined(__clang__)
    #pragma STDC FP_CONTRACT OFF
  #endif
  /* Only the maths of inner loops is inline: to inline the rest would make the code larger and slower to compile, and no step
     faster. */
  #if defined(__GNUC__)
    #define SPRINGLS__MATHS __attribute__((__unused__)) static
    #define SPRINGLS__INNER __attribute__((__unused__)) static inline
  #else
    #define SPRINGLS__MATHS static inline
    #define SPRINGLS__INNER static inline
  #endif
  #define SPRINGLS__NOINLINE SPRINGLS__MATHS
  #define SPRINGLS__GLOBAL
  #define SPRINGLS__LOCAL
  #define SPRINGLS__BARRIER (void)0
  #define SPRINGLS__NEXT(pointer) ((*(pointer))++)
  #define SPRINGLS__RAISE(pointer, number) (*(pointer) = *(pointer) < (number) ? (number) : *(pointer))
  #define SPRINGLS__READ(pointer) (*(pointer))
  #define SPRINGLS__LOWER(before, pointer, number) \
      ((before) = *(pointer), *(pointer) = (number) < (before) ? (number) : (before))
  #define SPRINGLS__ADD(pointer, number) (*(pointer) += (number))
  #if defined(__GNUC__)
    #define SPRINGLS__MARK(pointer, number) __atomic_store_n(pointer, number, __ATOMIC_RELAXED)
  #else
    #define SPRINGLS__MARK(pointer, number) (*(pointer) = (number))
  #endif
  #define SPRINGLS__CONST static const
  #define springls__sqrt(x)   sqrtf(x)
  #define springls__fabs(x)   fabsf(x)
  SPRINGLS__MATHS float springls__float_of_bits(int32_t bits)
  {
      float x;
      memcpy(&x, &bits, sizeof x);
      return x;
  }
  SPRINGLS__MATHS uint32_t springls__float_bits(float x)
  {
      uint32_t bits;
      memcpy(&bits, &x, sizeof bits);
      return bits;
  }
  /* Returns the number of the lowest bit that is set; at least one must be. */
  SPRINGLS__MATHS int springls__lowest_bit(uint32_t bits)
  {
  #if defined(__GNUC__)
      return __builtin_ctz(bits);
  #else
      int number = 0;
      for (; !(bits & 1u); bits >>= 1) number++;
      return number;
  #endif
  }
#endif

/* Returns x rounded down; floorf would be a function call where the target has no instruction for it. */
SPRINGLS__MATHS float springls__floor(float x)
{
    float whole = springls__fabs(x) < 8388608.0f ? (float)(int)x : x;
    return whole > x ? whole - 1.0f : whole;
}

#endif
