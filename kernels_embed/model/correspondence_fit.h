/* correspondence_fit.h - the moving-least-squares fit of fit.h for the correspondence alone, which is what vertices of the zero
   level need. Only its value at the origin counts: so the constant term comes last in an elimination, which leaves its value
   without square roots and without substituting back; and the normal matrix is kept as the 15 moments of the weights in it. */
#ifndef SPRINGLS__KERNEL_MODEL_CORRESPONDENCE_FIT_H
#define SPRINGLS__KERNEL_MODEL_CORRESPONDENCE_FIT_H

#include "fit.h"

#include "../language/width_float.h"
#include "correspondence_fit_body.h"
#include "../language/width_simd.h"
#include "correspondence_fit_body.h"

#endif
