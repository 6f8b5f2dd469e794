/* solids_shapes.h - the shapes of `make solids`: closed meshes whose topology is known. */
#ifndef BENCH_SOLIDS_SHAPES_H
#define BENCH_SOLIDS_SHAPES_H

#include "examples/common/surface/mesh_io.h"

enum { SOLIDS_GENERATED = 7 };

/* Makes shape number 0 to SOLIDS_GENERATED - 1; *name is a constant. Returns false with an empty mesh if memory is short. */
bool solids_shape(int number, struct mesh *mesh, const char **name);

#endif
