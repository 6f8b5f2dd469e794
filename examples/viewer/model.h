/* model.h - the body that the viewer works on: a springls context in a cubic grid about a mesh or a ball. */
#ifndef EXAMPLES_VIEWER_MODEL_H
#define EXAMPLES_VIEWER_MODEL_H

#include "springls_cl.h"
#include "surface/mesh_io.h"

enum { VIEWER_TEXT = MESH_TEXT };

struct viewer_model {
    springls_context *ctx;
    springls_desc desc; /* of ctx */
    int grid;           /* voxels a side */
    float voxel;        /* world units */
    float middle[3];    /* of the grid */
    float lower[3], upper[3]; /* box of the body as it was made: what its texture hangs on */
    int colors;         /* the attribute with the mesh's colours; -1: it had none */
    int rest_steps_due;      /* steps without a force that are still due */
    unsigned version;   /* grows with every change */
    double step_seconds; /* of the last step */
    springls_chunks *chunks;    /* what viewer_model_chunks has told; NULL: nothing yet */
    bool chunks_with_material;
    unsigned chunk_generation;           /* another number: all chunks are told anew */
    char error[VIEWER_TEXT];
};

/* Grid, parameters, backend and threads are the caller's choice; desc->grid.size[0] counts, the rest of desc->grid is made
 * so that the body takes two thirds of the grid. False: one line in model->error, and the model is as it was. */
bool viewer_model_ball(struct viewer_model *model, const springls_desc *desc);
bool viewer_model_mesh(struct viewer_model *model, const springls_desc *desc, const struct mesh *mesh);
bool viewer_model_file(struct viewer_model *model, const springls_desc *desc, const char *path);

/* One more body in the grid of `like`: of a function, a ball about `place`, or a mesh there, scaled so that its longest side is
 * 2 * radius. */
bool viewer_model_second(struct viewer_model *second, const struct viewer_model *like, springls_implicit_fn fn, void *user);
bool viewer_model_second_ball(struct viewer_model *second, const struct viewer_model *like, const float place[3], float radius);
bool viewer_model_second_file(struct viewer_model *second, const struct viewer_model *like, const float place[3], float radius,
                              const char *path);
void viewer_model_free(struct viewer_model *model);

/* The other body is on the same grid. After a failure the model may be empty. */
bool viewer_model_combine(struct viewer_model *model, springls_operation operation, struct viewer_model *other);

/* True when status is OK; else model->error has the sentence. */
bool viewer_model_check(struct viewer_model *model, springls_status status);

/* One step of Algorithm 2 under these forces for the time 1, no particle further than two voxels. */
bool viewer_model_step(struct viewer_model *model, const springls_forces *forces);

/* Without a force: springls that a tool has moved find their rest, gaps are filled. */
bool viewer_model_rest_step(struct viewer_model *model);
bool viewer_model_at_rest(const struct viewer_model *model);

/* Chunks of the surface that have changed since the last call. When model->telling changes, those told before are void:
 * with another model, or when `material` (correspondences) is asked for or no longer. */
bool viewer_model_chunks(struct viewer_model *model, bool material, const springls_chunk **changed, int *count);

/* After springls_restore: the model is another one, and at rest. */
void viewer_model_restored(struct viewer_model *model);

/* The colours that springls have carried from the mesh, 3 floats a vertex of a mesh just extracted; free them. NULL: it had
 * none, or there is no memory for them. */
float *viewer_model_colors(struct viewer_model *model, const springls_mesh *mesh);

#endif
