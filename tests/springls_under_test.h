/* springls_under_test.h - the library, private to one test program, with its inner functions in reach.
   -DSPRINGLS_PARTS (make PARTS=1) takes the parts instead of springls.h: then messages name the part.
   -DSPRINGLS_TEST_OPENCL adds springls_cl.h. */
#ifndef SPRINGLS_UNDER_TEST_H
#define SPRINGLS_UNDER_TEST_H

#define SPRINGLS_STATIC
#define SPRINGLS_IMPLEMENTATION
#ifdef SPRINGLS_PARTS
#include "../src/springls_parts.h"
#else
#include "../springls.h"
#endif
#ifdef SPRINGLS_TEST_OPENCL
#include "../springls_cl.h"
#endif

#endif
