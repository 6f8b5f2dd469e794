/* The one file that holds the implementation. */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"
