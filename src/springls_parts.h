/* springls_parts.h - the parts of springls.h: what a user reads, and the parts that no other part includes. They include the
   rest, each what it uses. `make springls.h` puts them together. */
#include "interface/manual.h"
#include "interface/api.h"

#ifdef SPRINGLS_IMPLEMENTATION
#ifndef SPRINGLS_IMPLEMENTED
#define SPRINGLS_IMPLEMENTED

/* Equal bits need a*b+c rounded twice. Clang and OpenCL have a pragma (compat.h), GCC takes an option. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#endif

#include "solver/stage_calls.h"
#include "lifecycle/create.h"
#include "input/shapes.h"
#include "input/set_reference.h"
#include "input/set_springls.h"
#include "input/write.h"
#include "output/attributes.h"
#include "output/chunks.h"
#include "output/component_views.h"
#include "output/error_estimates.h"
#include "output/material.h"
#include "output/measure.h"
#include "output/snapshot.h"
#include "output/views.h"
#include "output/kernel_source.h"
#include "tools/remodel.h"

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif

#endif
#endif
