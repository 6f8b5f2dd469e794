/* exact_flows.h - the two flows with exact answers (section 5.2) as velocity callbacks. */
#ifndef SPRINGLS__STAGES_EXACT_FLOWS_H
#define SPRINGLS__STAGES_EXACT_FLOWS_H

#include "../../kernels_embed/stages/advect.h"
#include "../runtime/base.h"

/* Writes the velocities of the deformation at SPRINGLS__LANES points, xyz each, to out. */
SPRINGLS__FN void springls__deformation_velocities(const float *points, float n, float amplitude, float *out)
{
    float axis[3][SPRINGLS__LANES];
    springls__vec3 u;
    int lane, k;
    for (lane = 0; lane < SPRINGLS__LANES; lane++)
        for (k = 0; k < 3; k++) axis[k][lane] = points[3 * lane + k];
    u = springls__vec_deformation_velocity(springls__vec_load_v3(axis[0], axis[1], axis[2]), n, amplitude);
    springls__vec_store(axis[0], u.x);
    springls__vec_store(axis[1], u.y);
    springls__vec_store(axis[2], u.z);
    for (lane = 0; lane < SPRINGLS__LANES; lane++)
        for (k = 0; k < 3; k++) out[3 * lane + k] = axis[k][lane];
}

SPRINGLS_API void springls_velocity_deformation(void *deformation_flow, const float *points, int count, float time, float *out)
{
    const springls_deformation_flow *flow = (const springls_deformation_flow *)deformation_flow;
    const float n = flow->grid_size, amplitude = springls__deformation_amplitude(n, flow->period, time);
    int i;
    for (i = 0; i + SPRINGLS__LANES <= count; i += SPRINGLS__LANES)
        springls__deformation_velocities(points + 3 * i, n, amplitude, out + 3 * i);
    for (; i < count; i++) {
        springls__v3 u = springls__deformation_velocity(springls__v3_make(points[3 * i], points[3 * i + 1], points[3 * i + 2]),
                                                        n, amplitude);
        out[3 * i] = u.x;
        out[3 * i + 1] = u.y;
        out[3 * i + 2] = u.z;
    }
}

SPRINGLS_API void springls_velocity_rotation(void *rotation_flow, const float *points, int count, float time, float *out)
{
    const springls_rotation_flow *flow = (const springls_rotation_flow *)rotation_flow;
    springls__v3 center = springls__v3_make(flow->center[0], flow->center[1], flow->center[2]);
    springls__v3 axis = springls__normalize(springls__v3_make(flow->axis[0], flow->axis[1], flow->axis[2]));
    int i;
    (void)time;
    for (i = 0; i < count; i++) {
        springls__v3 u = springls__rotation_velocity(springls__v3_make(points[3 * i], points[3 * i + 1], points[3 * i + 2]),
                                                     center, axis, flow->angular_velocity);
        out[3 * i] = u.x;
        out[3 * i + 1] = u.y;
        out[3 * i + 2] = u.z;
    }
}

#endif
