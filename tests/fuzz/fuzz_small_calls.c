/* fuzz_small_calls.c - the fuzzer of calls with models of some voxels, which take a small part of the time. */
#define SMALL_MODELS
enum { MOST_CALLS = 8, MOST_SUB_STEPS = 3, MOST_CHANGES = 4, MOST_SIDE = 8, MOST_SPRINGLS = 120 };
#include "fuzz_calls.c"
