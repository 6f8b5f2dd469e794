/* kernel_source.h - the OpenCL program text, for springls_cl.h and for engines with an OpenCL host of their own.
   kernels_embed/embed.c puts the text in the place of the comment below, one literal a line: no compiler limits the
   length of that. Read as a part, without springls.h, there is none: then the text is empty. */
#ifndef SPRINGLS__OUTPUT_KERNEL_SOURCE_H
#define SPRINGLS__OUTPUT_KERNEL_SOURCE_H

#include "../interface/api.h"

static const char *const springls__kernel_lines[] = {
    /* SPRINGLS__EMBED_KERNELS */
    ""   /* counts as no line: it is here so that the list is never empty */
};

SPRINGLS_API void springls_kernel_source(const char *const **lines, int *count)
{
    if (lines) *lines = springls__kernel_lines;
    if (count) *count = (int)(sizeof springls__kernel_lines / sizeof *springls__kernel_lines) - 1;
}

#endif
