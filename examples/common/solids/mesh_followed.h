/* mesh_followed.h - how much of a mesh the model that was set from it follows: what nobody asked to lose is to be seen. */
#ifndef EXAMPLES_SOLIDS_MESH_FOLLOWED_H
#define EXAMPLES_SOLIDS_MESH_FOLLOWED_H

#include "springls.h"

#include <stdbool.h>

struct mesh_followed {
    springls_mesh_report report; /* of springls_set_mesh */
    double area;                 /* share of the mesh's area that has the model's surface within `distance` of mesh_followed */
    double within;               /* share of the area that is further inside the model: covered by it, as where parts overlap */
    double volume;               /* the model's over the mesh's; 0: the mesh is not closed, and has none */
    int bodies;                  /* of the model, and cavities: more than the mesh's parts where one has fallen apart */
    bool little;                 /* a tenth of the area or of the volume is lost, or a part has fallen apart */
};

/* Sets a model from a mesh, and finds how much of it the model follows, at 20,000 places spread evenly over the mesh. distance: world
 * units, of a place to the surface. triangles: 3 indices each. Fails as springls_set_mesh, springls_closest and springls_measure do,
 * with SPRINGLS_OUT_OF_MEMORY where there is no room for the places. */
springls_status mesh_followed(springls_context *ctx, const float *positions, int position_count, const int *triangles,
                              int triangle_count, float distance, struct mesh_followed *followed);

/* Finds the same by `result`, the mesh that was extracted from the model: it takes less time than the model, and has needles and plates
 * that the model's zero level lacks. Where the mesh is open the model is asked instead: along sheets that enclose nothing the result has
 * rubble. followed->report: of springls_set_mesh. Fails as mesh_followed does. */
springls_status mesh_followed_by_mesh(springls_context *ctx, const float *positions, const int *triangles, int triangle_count,
                                      float distance, const springls_mesh *result, struct mesh_followed *followed);

/* Prints to `text` in one line what was mended, and what is lost: "2 parts, open, 1 turned; the model has 2 bodies, follows 89.0 %
 * of the area, covers 10.0 %". */
void mesh_followed_text(const struct mesh_followed *followed, char *text, size_t room);

/* Prints what to try where little of the mesh is followed. */
const char *mesh_followed_advice(const struct mesh_followed *followed);

#endif
