/* compat.h - the one place where the three languages of kernels_embed/ differ.
   Everything below this file is the same text in C99, C++98 and OpenCL C 1.2. */
#ifndef SPRINGLS__COMPAT
#define SPRINGLS__COMPAT

#ifdef __OPENCL_VERSION__
  #pragma OPENCL FP_CONTRACT OFF
  #define SPRINGLS__MATHS   static inline      /* a function of the shared maths        */
  #define SPRINGLS__GLOBAL  __global           /* memory that kernels and host share    */
  #define SPRINGLS__CONST   static __constant  /* a read-only table                     */
  typedef uchar uint8_t;
  typedef int int32_t;
  typedef uint uint32_t;
  #define springls__sqrt(x)   sqrt(x)
  #define springls__fabs(x)   fabs(x)
#else
  #include <float.h>
  #include <math.h>
  #if defined(__clang__)
    #pragma STDC FP_CONTRACT OFF
  #endif
  #if defined(__GNUC__)
    #define SPRINGLS__MATHS __attribute__((unused)) static inline
  #else
    #define SPRINGLS__MATHS static inline
  #endif
  #define SPRINGLS__GLOBAL
  #define SPRINGLS__CONST static const
  #define springls__sqrt(x)   sqrtf(x)
  #define springls__fabs(x)   fabsf(x)
#endif

/* floorf: a function call where the target has no instruction for it, and called everywhere. */
SPRINGLS__MATHS float springls__floor(float x)
{
    float whole = springls__fabs(x) < 8388608.0f ? (float)(int)x : x;
    return whole > x ? whole - 1.0f : whole;
}

#endif
