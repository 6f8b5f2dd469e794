/* bench.h - measures the time of a frame of the tool push. */
#ifndef EXAMPLES_VIEWER_BENCH_H
#define EXAMPLES_VIEWER_BENCH_H

#include "springls_cl.h"

/* Pushes a ball on grids of 64^3, 96^3, 128^3 and 192^3, or on that of desc->grid.size[0] if it is not 0, for 60 frames after
 * 10 warm-up frames, and writes one JSON object into `json` (NULL: standard output). Without a display frames are not drawn,
 * and "drawn" is false. Returns the exit status. */
int viewer_bench(const springls_desc *desc, const char *json, const char *backend, int threads);

#endif
