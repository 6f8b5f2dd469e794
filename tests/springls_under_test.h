/* springls_under_test.h - the library, private to one test program, with its inner functions in reach. Goes before fixtures.h; only
   tests that look into springls_cl.h need it. */
#ifndef SPRINGLS_UNDER_TEST_H
#define SPRINGLS_UNDER_TEST_H

#define SPRINGLS_STATIC
#include "library.c"

#endif
