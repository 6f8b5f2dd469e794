/* correspondence_fit.h - a quadratic moving-least-squares fit of the correspondence over neighboring particles, at one place: what
   vertices of the zero level take. Its weights have 15 moments, and its value at the origin is what elimination leaves. */
#ifndef SPRINGLS__KERNEL_MODEL_CORRESPONDENCE_FIT_H
#define SPRINGLS__KERNEL_MODEL_CORRESPONDENCE_FIT_H

#include "fit.h"

#include "../language/width_float.h"
#include "correspondence_fit_body.h"
#include "../language/width_simd.h"
#include "correspondence_fit_body.h"

#endif
