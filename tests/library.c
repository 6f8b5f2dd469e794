/* library.c - the library that tests link, compiled once for each set of flags.
   -DSPRINGLS_PARTS (make PARTS=1) takes the parts instead of springls.h: then messages name the part.
   -DSPRINGLS_TEST_OPENCL adds springls_cl.h. */
#define SPRINGLS_IMPLEMENTATION
#ifdef SPRINGLS_PARTS
#include "../src/springls_parts.h"
#else
#include "../springls.h"
#endif
#ifdef SPRINGLS_TEST_OPENCL
#include "../springls_cl.h"
#endif
