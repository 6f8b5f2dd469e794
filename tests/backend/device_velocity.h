/* device_velocity.h - the kernel of advect as C, to be included after the rest of the library; where the velocity is that of
   exact_flow_velocity, as on a device that has its text. */
#ifndef DEVICE_VELOCITY_H
#define DEVICE_VELOCITY_H

#include "examples/common/springls/exact_flows.h"

#define SPRINGLS__USER_VELOCITY
static springls__v3 springls__user_velocity(springls__v3 x, float time, const float *user)
{
    struct exact_flow flow;
    springls__v3 v;
    memcpy(&flow, user, sizeof flow);
    exact_flow_velocity(&flow, &x.x, 1, time, &v.x);
    return v;
}

/* The parts that it is made of are those that the test has from springls.h or from the parts. */
#ifndef SPRINGLS__KERNEL_STAGES_ADVECT_H
#define SPRINGLS__KERNEL_STAGES_ADVECT_H
#endif
#include "kernels_embed/device/displace.cl"

#endif
