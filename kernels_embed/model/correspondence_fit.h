/* correspondence_fit.h - the moving-least-squares fit of fit.h for the correspondence alone, which is what vertices of the zero
   level need. Only its value at the origin counts, which is a sum of the particles' correspondences: first their shares are found,
   by an elimination without square roots of the normal matrix, kept as the 15 moments of the weights in it; then the sum. */
#ifndef SPRINGLS__KERNEL_MODEL_CORRESPONDENCE_FIT_H
#define SPRINGLS__KERNEL_MODEL_CORRESPONDENCE_FIT_H

#include "fit.h"

#define SPRINGLS__CORRESPONDENCE_RADIUS 2.0f /* voxels; a larger one costs more and is not more accurate */

#include "../language/width_float.h"
#include "correspondence_fit_body.h"
#include "../language/width_simd.h"
#include "correspondence_fit_body.h"

#endif
