/* displace_simd.cl - the kernel of advect for several springls at once, on a device that is a processor. */
#ifndef SPRINGLS__KERNEL_DEVICE_DISPLACE_SIMD_CL
#define SPRINGLS__KERNEL_DEVICE_DISPLACE_SIMD_CL

#include "displace.cl"

#include "../language/width_simd.h"
#include "displace_body.h"

/* Displaces springls begin, ..., end - 1, several at once. */
SPRINGLS__MATHS void springls__displace_elements(const springls__model *model, springls__arguments args, int begin, int end)
{
    springls__force_rule rule = *model->force.rule;
    for (; begin + SPRINGLS__LANES <= end; begin += SPRINGLS__LANES) springls__vec_displace(model, &rule, begin);
    for (; begin < end; begin++) springls__displace_element(model, args, begin);
}

#endif
