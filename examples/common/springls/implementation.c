/* implementation.c - the library's code, compiled once for all example programs. */
#define SPRINGLS_IMPLEMENTATION
#include "springls_cl.h"
