/* springls_parts.h - the parts of springls.h in reading order: this list is its table of contents.
   `make springls.h` puts them together. */
#include "interface/api.h"

#ifdef SPRINGLS_IMPLEMENTATION
#ifndef SPRINGLS_IMPLEMENTED
#define SPRINGLS_IMPLEMENTED

/* the maths of one element: the same text for C, C++ and OpenCL */
#include "../kernels_embed/language/compat.h"
#include "../kernels_embed/language/vector.h"
#include "../kernels_embed/language/simd.h"
#include "../kernels_embed/language/triangle.h"
#include "../kernels_embed/model/model.h"
#include "../kernels_embed/model/grid.h"
#include "../kernels_embed/stages/unsigned_distance.h"
#include "../kernels_embed/model/cell_list.h"
#include "../kernels_embed/model/neighbors.h"
#include "../kernels_embed/stages/advect.h"
#include "../kernels_embed/stages/relax.h"
#include "../kernels_embed/language/winding.h"
#include "../kernels_embed/model/angular_gaps.h"
#include "../kernels_embed/model/neighborhood.h"
#include "../kernels_embed/stages/contract.h"
#include "../kernels_embed/model/fit.h"
#include "../kernels_embed/stages/project.h"
#include "../kernels_embed/stages/keep_edges.h"
#include "../kernels_embed/stages/track.h"
#include "../kernels_embed/stages/resample.h"
#include "../kernels_embed/stages/unsigned_to_signed.h"
#include "../kernels_embed/stages/evolve.h"
#include "../kernels_embed/stages/topology.h"
#include "../kernels_embed/stages/rebuild.h"
#include "../kernels_embed/stages/project_brick.h"
#include "../kernels_embed/model/marching_cubes.h"
#include "../kernels_embed/stages/fill_from_springls.h"
#include "../kernels_embed/stages/fill_gaps.h"
#include "../kernels_embed/output/isosurface.h"
#include "../kernels_embed/device/kernels.h"

/* what a context holds */
#include "runtime/context.h"
#include "runtime/memory.h"
#include "model/parameter_sets.h"
#include "runtime/kernel_table.h"
#include "runtime/residency.h"
#include "runtime/launch.h"
#include "runtime/stage_clock.h"
#include "runtime/resumable.h"
#include "model/constellation.h"
#include "model/grid.h"
#include "model/cell_list.h"
#include "model/neighbors.h"

/* the stages, as a step runs them */
#include "model/transform.h"
#include "stages/advect.h"
#include "stages/relax.h"
#include "stages/contract.h"
#include "stages/keep_edges.h"
#include "stages/track.h"
#include "stages/resample.h"
#include "stages/unsigned_distance.h"
#include "stages/topology.h"
#include "stages/evolve.h"
#include "stages/rebuild.h"
#include "stages/project.h"
#include "stages/fill_from_springls.h"
#include "stages/fill_gaps.h"
#include "stages/unsigned_to_signed.h"
#include "model/mesh_measure.h"
#include "stages/volume_lock.h"
#include "solver/step.h"

/* in */
#include "model/bvh.h"
#include "input/shapes.h"
#include "input/set_level_set.h"
#include "input/set_mesh.h"

/* out */
#include "output/query.h"
#include "output/views.h"
#include "model/attributes.h"
#include "output/material.h"
#include "tools/combine.h"
#include "output/isosurface.h"
#include "tools/remodel.h"
#include "output/measure.h"
#include "output/chunks.h"
#include "output/snapshot.h"
#include "output/kernel_source.h"

#include "lifecycle/create.h"

#endif
#endif
