/* displace.cl - the kernel of advect: a device's forces are samples, motion by curvature and the text of the user's velocity
   (springls_cl_desc.velocity_source). On the host callbacks run in the loop (src/stages/forces.h), which is the stage's own. */
#ifndef SPRINGLS__KERNEL_DEVICE_DISPLACE_CL
#define SPRINGLS__KERNEL_DEVICE_DISPLACE_CL

#include "../stages/advect.h"

SPRINGLS__USER_VELOCITY

#include "../language/width_float.h"
#include "displace_body.h"

/* Displaces springl i by the forces of the rule, into moved_springls. */
SPRINGLS__MATHS void springls__displace_element(const springls__model *model, springls__arguments args, int i)
{
    springls__force_rule rule = *model->force.rule;
    (void)args;
    springls__displace(model, &rule, i);
}

#endif
