/* kernel_source.h - holds the OpenCL program text, for springls_cl.h and for engines with an OpenCL host of their own.
   kernels_embed/embed.c replaces the comment below by the text, one string literal a line, because compilers limit the length
   of a literal. When this file is included without springls.h, the text is empty. */
#ifndef SPRINGLS__OUTPUT_KERNEL_SOURCE_H
#define SPRINGLS__OUTPUT_KERNEL_SOURCE_H

#include "../interface/api.h"

static const char *const springls__kernel_lines[] = {
#ifndef SPRINGLS_NO_OPENCL
    /* SPRINGLS__EMBED_KERNELS */
#endif
    ""   /* not counted: the array must not be empty */
};

SPRINGLS_API void springls_kernel_source(const char *const **strings, int *count)
{
    if (strings) *strings = springls__kernel_lines;
    if (count) *count = (int)(sizeof springls__kernel_lines / sizeof *springls__kernel_lines) - 1;
}

#endif
