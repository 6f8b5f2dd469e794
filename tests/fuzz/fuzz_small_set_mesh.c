/* fuzz_small_set_mesh.c - the fuzzer of springls_set_mesh with meshes of a few triangles in grids of a few voxels. */
#define SMALL_MODELS
enum { MOST_POINTS = 16, MOST_TRIANGLES = 28, MOST_SIDE = 8, MOST_LOW = 3, MOST_SPRINGLS = 80 };
#include "fuzz_set_mesh.c"
