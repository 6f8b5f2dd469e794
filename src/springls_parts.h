/* springls_parts.h - the parts of springls.h in reading order: this list is its table of contents.
   `make springls.h` puts them together. */
#include "api.h"

#ifdef SPRINGLS_IMPLEMENTATION
#ifndef SPRINGLS_IMPLEMENTED
#define SPRINGLS_IMPLEMENTED

/* the maths of one element: the same text for C, C++ and OpenCL */
#include "../kernels_embed/compat.h"
#include "../kernels_embed/vector.h"
#include "../kernels_embed/triangle.h"
#include "../kernels_embed/model.h"
#include "../kernels_embed/grid.h"
#include "../kernels_embed/omega.h"
#include "../kernels_embed/cells.h"
#include "../kernels_embed/neighbors.h"
#include "../kernels_embed/advect.h"
#include "../kernels_embed/relax.h"
#include "../kernels_embed/winding.h"
#include "../kernels_embed/fan.h"
#include "../kernels_embed/around.h"
#include "../kernels_embed/contract.h"
#include "../kernels_embed/fit.h"
#include "../kernels_embed/project.h"
#include "../kernels_embed/edges.h"
#include "../kernels_embed/track.h"
#include "../kernels_embed/resample.h"
#include "../kernels_embed/unsigned_to_signed.h"
#include "../kernels_embed/evolve.h"
#include "../kernels_embed/topology.h"
#include "../kernels_embed/rebuild.h"
#include "../kernels_embed/project_brick.h"
#include "../kernels_embed/marching_cubes.h"
#include "../kernels_embed/fill_from_springls.h"
#include "../kernels_embed/fill_gaps.h"
#include "../kernels_embed/isosurface.h"
#include "../kernels_embed/lanes.h"
#include "../kernels_embed/lanes_neighbors.h"
#include "../kernels_embed/lanes_rows.h"
#include "../kernels_embed/lanes_project.h"
#include "../kernels_embed/rows.h"
#include "../kernels_embed/kernels.h"

/* what a context holds */
#include "internal.h"
#include "memory.h"
#include "params.h"
#include "kernels.h"
#include "lanes_relax.h"
#include "lanes_advect.h"
#include "coherence.h"
#include "run.h"
#include "stage.h"
#include "parts.h"
#include "constellation.h"
#include "grid.h"
#include "cells.h"
#include "neighbors.h"

/* the stages, as a step runs them */
#include "transform.h"
#include "advect.h"
#include "relax.h"
#include "contract.h"
#include "edges.h"
#include "track.h"
#include "resample.h"
#include "omega.h"
#include "topology.h"
#include "evolve.h"
#include "rebuild.h"
#include "project.h"
#include "fill_from_springls.h"
#include "fill_gaps.h"
#include "unsigned_to_signed.h"
#include "mesh_measure.h"
#include "volume_lock.h"
#include "step.h"

/* in */
#include "bvh.h"
#include "shapes.h"
#include "set_level_set.h"
#include "set_mesh.h"

/* out */
#include "query.h"
#include "read.h"
#include "attributes.h"
#include "material.h"
#include "combine.h"
#include "isosurface.h"
#include "remodel.h"
#include "measure.h"
#include "chunks.h"
#include "snapshot.h"
#include "kernel_source.h"

#include "context.h"

#endif
#endif
