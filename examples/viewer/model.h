/* model.h - the viewer's body: a springls context in a cubic grid around a mesh or a ball, with room to grow. The grid moves with
 * the body (springls_desc.follow), so that it may go anywhere. */
#ifndef EXAMPLES_VIEWER_MODEL_H
#define EXAMPLES_VIEWER_MODEL_H

#include "springls.h"
#include "surface/mesh_io.h"

enum { VIEWER_TEXT = MESH_TEXT, VIEWER_ROOM = 8 };

struct viewer_model {
    springls_context *ctx;
    springls_desc desc; /* description of ctx */
    int grid;           /* voxels along the side of a cube of which the body filled two thirds at the start */
    float voxel;        /* world units */
    float middle[3];    /* of the grid, where it was made */
    float lower[3], upper[3]; /* box of the body at the start, for its texture */
    int colors;         /* the attribute with the mesh's colors; -1: none */
    int mask;           /* the attribute with the mask, 1: wholly masked; -1: nothing is */
    unsigned mask_version; /* incremented with every change of it */
    int rest_steps_due;      /* steps without a force that are still due */
    double budget;           /* seconds that a step's call, or one of its continuations, may take; 0: until it is done */
    bool stepping;           /* a step is in progress */
    springls_forces forces;  /* of that step */
    bool (*prepare)(struct viewer_model *model, void *user, int first, int count); /* is due before it begins; NULL: nothing */
    int prepared;            /* springls for which that is done */
    void *force_user;        /* what its forces need: a copy of their user data; and samples; NULL: none */
    float *force_samples;
    unsigned version;   /* incremented with every change */
    double step_seconds; /* of the last step, so far */
    springls_chunks *chunks;    /* the chunks returned by viewer_model_chunks; NULL: none yet */
    bool chunks_with_material;
    bool chunks_in_progress;    /* some work of viewer_model_chunks is left */
    unsigned chunk_generation;           /* incremented when all chunks become invalid */
    char error[VIEWER_TEXT];
};

/* Make the model: a ball, a mesh, or a mesh file. Of desc->grid only size[0] counts: the body fills two thirds of a cube of so many
 * voxels a side, in the middle of a grid of which the side is VIEWER_ROOM times as long. Return false with one line in
 * model->error and the model unchanged. */
bool viewer_model_ball(struct viewer_model *model, const springls_desc *desc);
bool viewer_model_mesh(struct viewer_model *model, const springls_desc *desc, const struct mesh *mesh);
bool viewer_model_file(struct viewer_model *model, const springls_desc *desc, const char *path);

/* Replaces the old model by the new one if that is `good`, else frees the new one and keeps its error. Returns `good`. */
bool viewer_model_replace(struct viewer_model *model, struct viewer_model *made, bool good);

/* Computes the box of the particles, in the world. Returns false if there are none. */
bool viewer_model_box(const struct viewer_model *model, float lower[3], float upper[3]);

/* Make a second body in the grid of `like`, where that is now: from a function, a ball around `place`, or a mesh there, scaled so
 * that its longest side is 2 * radius. */
bool viewer_model_second(struct viewer_model *second, const struct viewer_model *like, springls_implicit_fn fn, void *user);
bool viewer_model_second_ball(struct viewer_model *second, const struct viewer_model *like, const float place[3], float radius);
bool viewer_model_second_file(struct viewer_model *second, const struct viewer_model *like, const float place[3], float radius,
                              const char *path);
void viewer_model_free(struct viewer_model *model);

/* Combines the model with another on the same grid. After a failure the model may be empty. */
bool viewer_model_combine(struct viewer_model *model, springls_operation operation, struct viewer_model *other);

/* Returns true when status is OK; else puts a sentence in model->error. */
bool viewer_model_check(struct viewer_model *model, springls_status status);

/* Prepares `count` springls from `first` on for the forces of a step, whose user data are passed. */
typedef bool (*viewer_prepare_fn)(struct viewer_model *model, void *user, int first, int count);

/* Runs one step of Algorithm 2, of duration 1, with these forces; no particle moves further than two voxels. With a budget the
 * step may still be in progress then. Copies the `size` bytes of the forces' user data; samples, from malloc or NULL, belong to
 * the model from now on. prepare, if not NULL, is called for all springls before the step begins. Completes a step in progress
 * first. */
bool viewer_model_step(struct viewer_model *model, const springls_forces *forces, size_t size, float *samples,
                       viewer_prepare_fn prepare);

/* Continues the step in progress, if any, within the budget. */
bool viewer_model_continue(struct viewer_model *model);

/* Completes the step in progress, if any: whatever saves, changes or replaces the model, or reads all of it, begins with this. */
bool viewer_model_finish(struct viewer_model *model);

/* Takes one step without a force, in which moved springls come to rest and gaps are filled. */
bool viewer_model_rest_step(struct viewer_model *model);
bool viewer_model_at_rest(const struct viewer_model *model); /* no step is due or in progress */

/* Returns the chunks of the surface that have changed since the last call; none while model->chunks_in_progress, which the
 * next call continues within the budget. When model->chunk_generation changes, earlier chunks are invalid: for another model,
 * or when `material` (correspondences) changes. */
bool viewer_model_chunks(struct viewer_model *model, bool material, const springls_chunk **changed, int *count);

/* Returns the description of the model's grid and of the body at the start: a model without a context. */
struct viewer_model viewer_model_grid(const struct viewer_model *model);

/* Restores a snapshot, in a new context where it was taken in another grid: that of `like`, which needs no context. The model is at
 * rest then. Returns false with one line in model->error and the model unchanged. */
bool viewer_model_restore(struct viewer_model *model, const struct viewer_model *like, const void *block, size_t size);

/* Sets the mask, a number from 0 to 1 a springl; NULL: none. Springls with 1 are kept (springls_set_keep_mask). */
bool viewer_model_set_mask(struct viewer_model *model, const float *values);
bool viewer_model_invert_mask(struct viewer_model *model);

/* Returns the mask of a springl, given the view of the attribute; 0: none, or no such springl. */
float viewer_model_mask_of(const springls_view *mask, int springl);

/* Returns the colors that springls carry from the mesh, 3 floats a vertex of a mesh just extracted; the caller frees them.
 * NULL: there are none, or memory is short. */
float *viewer_model_colors(struct viewer_model *model, const springls_mesh *mesh);

#endif
