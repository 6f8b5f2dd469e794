/* winding.h - the solid angle of one triangle: a surface winds around a point by the sum of them over 4 pi. */
#ifndef SPRINGLS__KERNEL_LANGUAGE_WINDING_H
#define SPRINGLS__KERNEL_LANGUAGE_WINDING_H

#include "triangle.h"

#include "width_float.h"
#include "winding_body.h"
#include "width_simd.h"
#include "winding_body.h"

#endif
