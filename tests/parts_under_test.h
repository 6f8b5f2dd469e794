/* parts_under_test.h - the library's declarations, and the parts that fixtures.h uses. */
#ifndef PARTS_UNDER_TEST_H
#define PARTS_UNDER_TEST_H

/* A part may define public functions too. Weak, they give way to those of the linked library (library.c). */
#ifndef SPRINGLS_UNDER_TEST_H
#define SPRINGLS_API __attribute__((weak)) extern
#include "../kernels_embed/language/vector.h"
#include "../src/model/constellation.h"
#include "../src/model/host_access.h"
#include "../src/model/mesh_measure.h"
#include "../src/runtime/resumable.h"
#include "../springls.h"
#ifdef SPRINGLS_TEST_OPENCL
#include "../springls_cl.h"
#endif
#endif

#endif
