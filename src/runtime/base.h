/* base.h - the base of every host part: the C library, attributes of functions, assertions and SPRINGLS__TRY. */
#ifndef SPRINGLS__RUNTIME_BASE_H
#define SPRINGLS__RUNTIME_BASE_H

#include "../interface/api.h"

#include <float.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef SPRINGLS_ASSERT
#include <assert.h>
#define SPRINGLS_ASSERT(condition) assert(condition)
#endif

#if defined(__GNUC__)
#define SPRINGLS__FN __attribute__((__unused__)) static
#define SPRINGLS__PRINTF(text, first) __attribute__((__format__(__printf__, text, first)))
#else
#define SPRINGLS__FN static
#define SPRINGLS__PRINTF(text, first)
#endif

/* The linkage of public functions that a program may leave out: they are the library's own then, and go where nothing calls them. */
#ifdef SPRINGLS_NO_SNAPSHOTS
#define SPRINGLS__SNAPSHOTS_API SPRINGLS__FN
#else
#define SPRINGLS__SNAPSHOTS_API SPRINGLS_API
#endif
#ifdef SPRINGLS_NO_CHUNKS
#define SPRINGLS__CHUNKS_API SPRINGLS__FN
#else
#define SPRINGLS__CHUNKS_API SPRINGLS_API
#endif
#ifdef SPRINGLS_NO_TOOLS
#define SPRINGLS__TOOLS_API SPRINGLS__FN
#else
#define SPRINGLS__TOOLS_API SPRINGLS_API
#endif
#ifdef SPRINGLS_NO_EVENTS
#define SPRINGLS__EVENTS_API SPRINGLS__FN
#else
#define SPRINGLS__EVENTS_API SPRINGLS_API
#endif
#ifdef SPRINGLS_NO_QUERIES
#define SPRINGLS__QUERIES_API SPRINGLS__FN
#else
#define SPRINGLS__QUERIES_API SPRINGLS_API
#endif
#ifdef SPRINGLS_NO_TILINGS
#define SPRINGLS__TILINGS_API SPRINGLS__FN
#else
#define SPRINGLS__TILINGS_API SPRINGLS_API
#endif

/* Returns the failure of an expression from the calling function. */
#define SPRINGLS__TRY(expression)                                                       \
    do {                                                                                \
        springls_status springls__try_status = (expression);                            \
        if (springls__try_status != SPRINGLS_OK) return springls__try_status;           \
    } while (0)

#endif
