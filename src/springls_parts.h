/* springls_parts.h - the parts of springls.h: what a user reads, and the parts that no other part includes. They include the
   rest, each what it uses. `make springls.h` puts them together. */
#include "interface/manual.h"

/* SPRINGLS__LIST_OF_PARTS */

#include "interface/api.h"

#ifdef SPRINGLS_IMPLEMENTATION
#ifndef SPRINGLS_IMPLEMENTED
#define SPRINGLS_IMPLEMENTED

#if defined(__TINYC__)
#error "springls.h: tcc cannot compile this: of a 12-byte struct that a function returns it stores 16 bytes, over another variable"
#elif defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ == 2
#error "springls.h: the x87 unit does not round to float, which equal bits need: compile with -msse2 -mfpmath=sse"
#else

/* Equal bits need every operation as it is written and rounded to float, whatever -ffast-math the program has. For a*b+c clang and
   OpenCL have a pragma (compat.h), GCC takes an option; excess-precision is for the S/390, where -std=c99 computes floats in double. */
#if defined(__clang__)
#if __clang_major__ >= 14 && (defined(__x86_64__) || defined(__aarch64__))
#define SPRINGLS__FLOAT_CONTROL
#pragma float_control(precise, on, push)
#endif
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off", "excess-precision=fast", "no-unsafe-math-optimizations", "no-associative-math")
#pragma GCC optimize("no-reciprocal-math", "no-finite-math-only", "signed-zeros")
#endif

#include "solver/stage_calls.h"
#include "lifecycle/create.h"
#include "input/shapes.h"
#include "input/set_reference.h"
#include "input/set_springls.h"
#include "input/write.h"
#include "output/attributes.h"
#include "output/chunks.h"
#include "output/chunk_lod.h"
#include "output/component_views.h"
#include "output/error_estimates.h"
#include "output/extract_soup.h"
#include "output/material.h"
#include "output/measure.h"
#include "output/place_now.h"
#include "output/restore.h"
#include "output/snapshot_delta.h"
#include "output/views.h"
#include "output/kernel_source.h"
#include "tools/follow_level_set.h"
#include "tools/remodel.h"
#include "tiling/set_labels.h"
#include "tiling/join.h"
#include "tiling/tiling_snapshot.h"
#include "tiling/tiling_step.h"
#include "tiling/walls.h"
#include "tiling/closest_wall.h"

#if defined(SPRINGLS__FLOAT_CONTROL)
#pragma float_control(pop)
#elif defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif

/* The last, because it includes the system's headers: nothing of the library meets what they define. */
#include "runtime/threads.h"

#endif
#endif
#endif
