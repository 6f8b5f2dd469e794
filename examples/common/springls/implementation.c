/* implementation.c - the one source file of the example programs that holds the library's code. */
#define SPRINGLS_IMPLEMENTATION
#include "springls_cl.h"
