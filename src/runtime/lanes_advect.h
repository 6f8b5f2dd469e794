/* lanes_advect.h - springls__deformation_velocity of kernels_embed/advect.h for a few points at a time. */
#ifndef SPRINGLS__RUNTIME_LANES_ADVECT_H
#define SPRINGLS__RUNTIME_LANES_ADVECT_H

#include "../../kernels_embed/language/simd.h"
#include "base.h"

#ifdef SPRINGLS__LANES

/* All points but the last few; returns how many. */
SPRINGLS__FN int springls__deformation_velocities(const float *points, int count, float n, float period, float time, float *out)
{
    float axis[3][SPRINGLS__LANES];
    float s = n * springls__cospi(time / period);
    int first, lane, k;
    for (first = 0; first + SPRINGLS__LANES <= count; first += SPRINGLS__LANES) {
        springls__vec x[3], once[3], twice[3];
        for (lane = 0; lane < SPRINGLS__LANES; lane++)
            for (k = 0; k < 3; k++) axis[k][lane] = points[3 * (first + lane) + k];
        for (k = 0; k < 3; k++) {
            x[k] = springls__vec_load(axis[k]) * (1.0f / n);
            once[k] = springls__vec_sinpi(x[k]);
            twice[k] = springls__vec_sinpi(2.0f * x[k]);
        }
        springls__vec_store(axis[0], 2.0f * once[0] * once[0] * twice[1] * twice[2] * s);
        springls__vec_store(axis[1], -twice[0] * once[1] * once[1] * twice[2] * s);
        springls__vec_store(axis[2], -twice[0] * twice[1] * once[2] * once[2] * s);
        for (lane = 0; lane < SPRINGLS__LANES; lane++)
            for (k = 0; k < 3; k++) out[3 * (first + lane) + k] = axis[k][lane];
    }
    return first;
}

#else

SPRINGLS__FN int springls__deformation_velocities(const float *points, int count, float n, float period, float time, float *out)
{
    (void)points, (void)count, (void)n, (void)period, (void)time, (void)out;
    return 0;
}

#endif

#endif
