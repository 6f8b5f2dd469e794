/* kernel_table.h - makes of each line of the table in kernels_embed/device/kernels.h a number, a record and a loop. */
#ifndef SPRINGLS__RUNTIME_KERNEL_TABLE_H
#define SPRINGLS__RUNTIME_KERNEL_TABLE_H

#include "../../kernels_embed/device/kernels.h"
#include "context.h"

typedef enum springls__kernel {
#define SPRINGLS__KERNEL_NUMBER(name, program, grain, writes) SPRINGLS__KERNEL_##name,
    SPRINGLS__KERNELS(SPRINGLS__KERNEL_NUMBER) SPRINGLS__SIMD_KERNELS(SPRINGLS__KERNEL_NUMBER)
    SPRINGLS__DEVICE_KERNELS(SPRINGLS__KERNEL_NUMBER) SPRINGLS__ORDERED_KERNELS(SPRINGLS__KERNEL_NUMBER)
#define SPRINGLS__BRICK_NUMBER(name, program, grain, writes, floats) SPRINGLS__KERNEL_##name,
    SPRINGLS__BRICK_KERNELS(SPRINGLS__BRICK_NUMBER)
#undef SPRINGLS__BRICK_NUMBER
#undef SPRINGLS__KERNEL_NUMBER
    SPRINGLS__KERNEL_COUNT
} springls__kernel;

typedef struct springls__kernel_info {
    const char *name;
    /* Runs it on the host; NULL: a stage has a loop of its own. */
    void (*range)(const springls__model *model, springls__arguments args, int begin, int end, float *memory);
    int grain;
    uint64_t writes;
    bool brick; /* a work group does one                                    */
    int floats; /* of memory that a range needs; 0: what it needs is on the stack */
    bool ordered; /* elements meet: the host runs them in order             */
} springls__kernel_info;

/* A range has as many floats on its stack; one that needs more gets them from its lane (launch.h). */
enum { SPRINGLS__STACK_FLOATS = 2048 };

#define SPRINGLS__RANGE(name, program, grain, writes)                                                                            \
    SPRINGLS__FN void springls__##name##_range(const springls__model *model, springls__arguments args, int begin, int end,       \
                                                 float *memory)                                                                  \
    {                                                                                                                            \
        (void)memory;                                                                                                            \
        for (; begin < end; begin++) springls__##name##_element(model, args, begin);                                             \
    }

#define SPRINGLS__SIMD_RANGE(name, program, grain, writes)                                                                       \
    SPRINGLS__FN void springls__##name##_range(const springls__model *model, springls__arguments args, int begin, int end,       \
                                                 float *memory)                                                                  \
    {                                                                                                                            \
        (void)memory;                                                                                                            \
        springls__##name##_elements(model, args, begin, end);                                                                    \
    }

#define SPRINGLS__BRICK_RANGE(name, program, grain, writes, floats)                                                              \
    SPRINGLS__FN void springls__##name##_range(const springls__model *model, springls__arguments args, int begin, int end,       \
                                                 float *memory)                                                                  \
    {                                                                                                                            \
        float stack[(floats) <= SPRINGLS__STACK_FLOATS ? (floats) : 1];                                                          \
        if ((floats) <= SPRINGLS__STACK_FLOATS) memory = stack;                                                                  \
        for (; begin < end; begin++) springls__##name##_element(model, args, begin, memory);                                     \
    }

#endif
