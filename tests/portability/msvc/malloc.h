/* malloc.h - what the compiler's own header of intrinsics uses of it, which CL/cl_platform.h includes for types of vectors. */
#ifndef MSVC_MALLOC_H
#define MSVC_MALLOC_H
#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif
void *_aligned_malloc(size_t size, size_t alignment);
void _aligned_free(void *memory);
#ifdef __cplusplus
}
#endif
#endif
