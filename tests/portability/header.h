/* What a user includes. */
#ifdef WITH_OPENCL
#include "springls_cl.h"
#else
#include "springls.h"
#endif
