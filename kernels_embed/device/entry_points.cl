/* entry_points.cl - the kernels that OpenCL starts: each makes the model of its arguments and does its elements. No maths
   here. */
#ifndef SPRINGLS__KERNEL_DEVICE_ENTRY_POINTS_CL
#define SPRINGLS__KERNEL_DEVICE_ENTRY_POINTS_CL

#include "collectives.cl"
#include "kernels.h"
#include "regions.cl"

#define SPRINGLS__ARGUMENT(name, type, block, owner, member) __global type *name,
#define SPRINGLS__MEMBER(name, type, block, owner, member) model.owner.member = name;

#define SPRINGLS__BEGIN(first)                                                                                                   \
    springls__model model;                                                                                                       \
    int i = (first) * grain, end = springls__imin(i + grain, count);                                                             \
    SPRINGLS__ARRAYS(SPRINGLS__MEMBER)                                                                                           \
    springls__shape_set(&model, shape);                                                                                          \
    model.params = params;

/* Defines kernel springls_name: springls__name_element for every element before `count`, `grain` of them a work item. */
#define SPRINGLS__ENTRY(kernel_name, task, writes)                                                                               \
    __kernel void springls_##kernel_name(SPRINGLS__ARRAYS(SPRINGLS__ARGUMENT) springls__shape shape, springls_params params,     \
                                         springls__arguments args, int count, int grain)                                        \
    {                                                                                                                            \
        SPRINGLS__BEGIN((int)get_global_id(0))                                                                                   \
        model.group = springls__alone();                                                                                         \
        for (; i < end; i++) springls__##kernel_name##_element(&model, args, i);                                                 \
    }

/* Defines one for bricks: `grain` of them a work group, whose items share `memory`. */
#define SPRINGLS__BRICK_ENTRY(kernel_name, task, writes, floats)                                                                 \
    __kernel void springls_##kernel_name(SPRINGLS__ARRAYS(SPRINGLS__ARGUMENT) springls__shape shape, springls_params params,     \
                                         springls__arguments args, int count, int grain)                                        \
    {                                                                                                                            \
        __local float memory[floats];                                                                                            \
        SPRINGLS__BEGIN((int)get_group_id(0))                                                                                    \
        model.group.item = (int)get_local_id(0);                                                                                 \
        model.group.items = (int)get_local_size(0);                                                                              \
        for (; i < end; i++) springls__##kernel_name##_element(&model, args, i, memory);                                         \
    }

/* Defines one that does several elements at once where a work item has several: on a processor. */
#if defined(SPRINGLS__ON_PROCESSOR)
#define SPRINGLS__SIMD_ENTRY(kernel_name, task, writes)                                                                          \
    __kernel void springls_##kernel_name(SPRINGLS__ARRAYS(SPRINGLS__ARGUMENT) springls__shape shape, springls_params params,     \
                                         springls__arguments args, int count, int grain)                                        \
    {                                                                                                                            \
        SPRINGLS__BEGIN((int)get_global_id(0))                                                                                   \
        model.group = springls__alone();                                                                                         \
        springls__##kernel_name##_elements(&model, args, i, end);                                                                \
    }
#else
#define SPRINGLS__SIMD_ENTRY SPRINGLS__ENTRY
#endif

SPRINGLS__KERNELS(SPRINGLS__ENTRY)
SPRINGLS__SIMD_KERNELS(SPRINGLS__SIMD_ENTRY)
SPRINGLS__BRICK_KERNELS(SPRINGLS__BRICK_ENTRY)

#define SPRINGLS__COLLECTIVE_ENTRY(kernel_name, task) SPRINGLS__ENTRY(kernel_name, task, 0)
SPRINGLS__COLLECTIVES(SPRINGLS__COLLECTIVE_ENTRY)

#endif
