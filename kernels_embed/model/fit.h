/* fit.h - a quadratic moving-least-squares fit over neighboring particles: the surface's height and the correspondence as
   functions of two tangent coordinates. It gives split and filled springls a place and a correspondence of third-order
   accuracy; copying (section 4.7) has none. */
#ifndef SPRINGLS__KERNEL_MODEL_FIT_H
#define SPRINGLS__KERNEL_MODEL_FIT_H

#include "../language/simd.h"

#define SPRINGLS__FIT_TERMS 6  /* 1 u v uu uv vv                              */
#define SPRINGLS__FIT_VALUES 4 /* height, and the three coordinates of a      */
#define SPRINGLS__FIT_RADIUS 2.5f /* voxels */

#include "../language/width_float.h"
#include "fit_body.h"
#include "../language/width_simd.h"
#include "fit_body.h"

SPRINGLS__MATHS springls__fit springls__fit_begin(springls__v3 origin, springls__v3 n, springls__v3 a0)
{
    return springls__fit_begin_in(origin, n, springls__any_tangent(n), a0);
}

/* Returns how many terms a number of neighbors is enough for: a quadratic's with ten or more, a plane's with four or more. */
SPRINGLS__MATHS int springls__fit_terms(float count) { return count >= 10.0f ? 6 : count >= 4.0f ? 3 : 0; }

#endif
