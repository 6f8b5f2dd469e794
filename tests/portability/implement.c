/* The one file that holds the implementation; with -DWITH_OPENCL that of springls_cl.h too. */
#define SPRINGLS_IMPLEMENTATION
#include "header.h"
