/* The declarations of stdlib.h that springls.h uses. */
#ifndef MSVC_STDLIB_H
#define MSVC_STDLIB_H
#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif
void *calloc(size_t count, size_t size);
void *malloc(size_t size);
void free(void *memory);
void *bsearch(const void *key, const void *base, size_t count, size_t size, int (*compare)(const void *, const void *));
void qsort(void *base, size_t count, size_t size, int (*compare)(const void *, const void *));
#ifdef __cplusplus
}
#endif
#endif
