/* opencl_kernels.c - the kernels of kernels_embed as a device has them, compiled as C: items of a group meet at barriers, and all of
   them at atomic operations. Only what the two languages call differently is defined here. */
#include "kernels_embed/language/compat.h"

#undef SPRINGLS__BARRIER
#undef SPRINGLS__NEXT
#undef SPRINGLS__RAISE
#undef SPRINGLS__READ
#undef SPRINGLS__LOWER
#undef SPRINGLS__ADD
#define SPRINGLS__BARRIER device_barrier(__FILE__, __LINE__)
#define SPRINGLS__NEXT(pointer) atomic_add(pointer, 1u)
#define SPRINGLS__RAISE(pointer, number) atomic_max(pointer, number)
#define SPRINGLS__READ(pointer) atomic_or(pointer, 0)
#define SPRINGLS__LOWER(before, pointer, number) ((before) = atomic_min(pointer, number))
#define SPRINGLS__ADD(pointer, number) atomic_add(pointer, number)
#define __global
#define atomic_add(pointer, n) __atomic_fetch_add(pointer, n, __ATOMIC_RELAXED)
#define atomic_or(pointer, bits) __atomic_fetch_or(pointer, bits, __ATOMIC_RELAXED)

typedef unsigned char uchar;
typedef unsigned int uint;

static int atomic_min(volatile int *pointer, int n)
{
    int old = __atomic_load_n(pointer, __ATOMIC_RELAXED);
    while (n < old && !__atomic_compare_exchange_n(pointer, &old, n, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) continue;
    return old;
}

static uint atomic_max(volatile uint *pointer, uint n)
{
    uint old = __atomic_load_n(pointer, __ATOMIC_RELAXED);
    while (n > old && !__atomic_compare_exchange_n(pointer, &old, n, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) continue;
    return old;
}

#include "opencl_kernels.h"

#include "kernels_embed/device/kernels.h"
#include "device_velocity.h"

#define KERNEL_ELEMENT(name, ...)                                                                            \
    static void name##_element(const springls__model *model, springls__arguments args, int i, float *memory) \
    {                                                                                                        \
        (void)memory;                                                                                        \
        springls__##name##_element(model, args, i);                                                          \
    }
SPRINGLS__KERNELS(KERNEL_ELEMENT)
SPRINGLS__SIMD_KERNELS(KERNEL_ELEMENT)
SPRINGLS__DEVICE_KERNELS(KERNEL_ELEMENT)
SPRINGLS__ORDERED_KERNELS(KERNEL_ELEMENT)

#define KERNEL_ALONE(name, ...) { #name, name##_element, 0 },
#define KERNEL_BRICK(name, program, grain, writes, floats) { #name, springls__##name##_element, floats },
const device_kernel device_kernels[] = {
    SPRINGLS__KERNELS(KERNEL_ALONE) SPRINGLS__SIMD_KERNELS(KERNEL_ALONE) SPRINGLS__DEVICE_KERNELS(KERNEL_ALONE)
    SPRINGLS__ORDERED_KERNELS(KERNEL_ALONE)
    SPRINGLS__BRICK_KERNELS(KERNEL_BRICK) { NULL, NULL, 0 }
};

#define ARRAY_ROW(name, type, block, owner, member) { #name, sizeof(type) * (block) },
const device_array device_arrays[] = { SPRINGLS__ARRAYS(ARRAY_ROW) };

char *device_array_at(const device_arguments *arguments, int array)
{
    return arguments->memory + (size_t)arguments->places.at[array] * SPRINGLS__PLACE_BYTES;
}

void device_run_item(const device_kernel *kernel, const device_arguments *arguments, int first, springls__group group, float *memory)
{
    const int end = springls__imin((first + 1) * arguments->grain, arguments->count);
    springls__model model;
    int i;
#define ARRAY_SET(name, type, block, owner, member) model.owner.member = (type *)(void *)device_array_at(arguments, SPRINGLS__ARRAY_##name);
    SPRINGLS__ARRAYS(ARRAY_SET)
    springls__shape_set(&model, arguments->shape);
    model.params = arguments->params;
    model.group = group;
    for (i = first * arguments->grain; i < end; i++) kernel->element(&model, arguments->args, i, memory);
}
