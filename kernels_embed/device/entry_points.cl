/* entry_points.cl - the kernels that OpenCL starts: each makes the model of its arguments and does its elements. No maths
   here. */
#ifndef SPRINGLS__KERNEL_DEVICE_ENTRY_POINTS_CL
#define SPRINGLS__KERNEL_DEVICE_ENTRY_POINTS_CL

#include "displace_simd.cl"
#include "kernels.h"

/* All arrays are in one buffer: drivers look at each buffer of a kernel whenever it starts. */
#define SPRINGLS__MEMBER(name, type, block, owner, member)                                                                       \
    model.owner.member = (__global type *)(memory + (size_t)places.at[SPRINGLS__ARRAY_##name] * (SPRINGLS__PLACE_BYTES / 8));

/* A program has the kernels of the rows that name it: springls_cl.h leaves out the others by a definition of SPRINGLS__IN_x for
   each program x. Without that all are in one. */
#if !defined(SPRINGLS__IN_LISTS)
#define SPRINGLS__IN_LISTS(define, name, floats) define(name, floats)
#define SPRINGLS__IN_MOVE SPRINGLS__IN_LISTS
#define SPRINGLS__IN_RESAMPLE SPRINGLS__IN_LISTS
#define SPRINGLS__IN_EDGES SPRINGLS__IN_LISTS
#define SPRINGLS__IN_FILL SPRINGLS__IN_LISTS
#define SPRINGLS__IN_LEVEL_SET SPRINGLS__IN_LISTS
#define SPRINGLS__IN_SIGNS SPRINGLS__IN_LISTS
#define SPRINGLS__IN_SURFACE SPRINGLS__IN_LISTS
#endif

#define SPRINGLS__SIGNATURE(name)                                                                                                \
    __kernel void springls_##name(__global ulong *memory, springls__places places, springls__shape shape,                        \
                                  springls_params params, springls__arguments args, int count, int grain)

#define SPRINGLS__BEGIN(first)                                                                                                   \
    springls__model model;                                                                                                       \
    int i = (first) * grain, end = springls__imin(i + grain, count);                                                             \
    SPRINGLS__ARRAYS(SPRINGLS__MEMBER)                                                                                           \
    springls__shape_set(&model, shape);                                                                                          \
    model.params = params;

/* Defines kernel springls_name: springls__name_element for every element before `count`, `grain` of them a work item. */
#define SPRINGLS__DEFINE(name, floats)                                                                                           \
    SPRINGLS__SIGNATURE(name)                                                                                                    \
    {                                                                                                                            \
        SPRINGLS__BEGIN((int)get_global_id(0))                                                                                   \
        model.group = springls__alone();                                                                                         \
        for (; i < end; i++) springls__##name##_element(&model, args, i);                                                        \
    }

/* Defines one for bricks: `grain` of them a work group, whose items share local memory. */
#define SPRINGLS__DEFINE_BRICK(name, floats)                                                                                     \
    SPRINGLS__SIGNATURE(name)                                                                                                    \
    {                                                                                                                            \
        __local float shared[floats];                                                                                            \
        SPRINGLS__BEGIN((int)get_group_id(0))                                                                                    \
        model.group.item = (int)get_local_id(0);                                                                                 \
        model.group.items = (int)get_local_size(0);                                                                              \
        for (; i < end; i++) springls__##name##_element(&model, args, i, shared);                                                \
    }

/* Defines one that does several elements at once where a work item has several: on a processor. */
#if defined(SPRINGLS__ON_PROCESSOR)
#define SPRINGLS__DEFINE_SIMD(name, floats)                                                                                      \
    SPRINGLS__SIGNATURE(name)                                                                                                    \
    {                                                                                                                            \
        SPRINGLS__BEGIN((int)get_global_id(0))                                                                                   \
        model.group = springls__alone();                                                                                         \
        springls__##name##_elements(&model, args, i, end);                                                                       \
    }
#else
#define SPRINGLS__DEFINE_SIMD SPRINGLS__DEFINE
#endif

#define SPRINGLS__ENTRY(name, program, grain, writes) SPRINGLS__IN_##program(SPRINGLS__DEFINE, name, 0)
#define SPRINGLS__SIMD_ENTRY(name, program, grain, writes) SPRINGLS__IN_##program(SPRINGLS__DEFINE_SIMD, name, 0)
#define SPRINGLS__BRICK_ENTRY(name, program, grain, writes, floats) SPRINGLS__IN_##program(SPRINGLS__DEFINE_BRICK, name, floats)
SPRINGLS__KERNELS(SPRINGLS__ENTRY)
SPRINGLS__ORDERED_KERNELS(SPRINGLS__ENTRY)
SPRINGLS__SIMD_KERNELS(SPRINGLS__SIMD_ENTRY)
SPRINGLS__DEVICE_KERNELS(SPRINGLS__SIMD_ENTRY)
SPRINGLS__BRICK_KERNELS(SPRINGLS__BRICK_ENTRY)

#endif
