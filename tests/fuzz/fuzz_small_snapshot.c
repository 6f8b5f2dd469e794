/* fuzz_small_snapshot.c - the fuzzer of snapshots with models of some voxels. */
#define SMALL_MODELS
enum { SIZE = 8, MOST_SPRINGLS = 150 };
#include "fuzz_snapshot.c"
