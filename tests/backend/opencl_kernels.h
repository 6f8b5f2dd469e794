/* opencl_kernels.h - between the device of emulator.c and the kernels that it runs (opencl_kernels.c). */
#ifndef OPENCL_KERNELS_H
#define OPENCL_KERNELS_H

#include <stddef.h>

#include "kernels_embed/model/arguments.h"
#include "kernels_embed/model/model.h"

/* The arguments of a kernel, in their order. */
typedef struct device_arguments {
    char *memory;
    springls__places places;
    springls__shape shape;
    springls_params params;
    springls__arguments args;
    int count, grain;
} device_arguments;

typedef struct device_kernel {
    const char *name;
    void (*element)(const springls__model *model, springls__arguments args, int i, float *memory);
    size_t floats; /* of memory that the items of a group share; 0: items are alone */
} device_kernel;

typedef struct device_array { const char *name; size_t element; } device_array; /* element: its bytes */

extern const device_kernel device_kernels[]; /* the last has no name */
extern const device_array device_arrays[SPRINGLS__ARRAY_COUNT];

/* Returns where an array begins. */
char *device_array_at(const device_arguments *arguments, int array);

/* Does the elements of one item: those of its group where items share memory. */
void device_run_item(const device_kernel *kernel, const device_arguments *arguments, int first, springls__group group, float *memory);

/* Returns when all items of the group have come here. */
void device_barrier(const char *file, int line);

#endif
