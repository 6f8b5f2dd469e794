/* internal.h - what a context holds. Lengths are voxels everywhere below the public interface. */
#ifndef SPRINGLS__RUNTIME_CONTEXT_H
#define SPRINGLS__RUNTIME_CONTEXT_H

#include "../interface/api.h"
#include "../../kernels_embed/stages/advect.h"

/* A growable array from the context's allocator, and its twin on the backend's device: a stale one has old contents. */
typedef struct springls__buffer {
    void *data;
    size_t bytes;
    void *device;
    size_t device_bytes;
    bool host_stale, device_stale;
} springls__buffer;

/* The arrays of the model by number. */
typedef enum springls__array {
#define SPRINGLS__ARRAY_NUMBER(name, type, block, member) SPRINGLS__ARRAY_##name,
    SPRINGLS__ARRAYS(SPRINGLS__ARRAY_NUMBER)
#undef SPRINGLS__ARRAY_NUMBER
    SPRINGLS__ARRAY_COUNT
} springls__array;

/* A node of a bounding volume hierarchy: a leaf of `count` triangles order[first], order[first+1] ..., or, when count is
   0, the parent of nodes first and first+1. Children follow their parents. */
typedef struct springls__bvh_node { float lower[3]; int first; float upper[3]; int count; } springls__bvh_node;

/* A node seen from afar: all its triangles as one directed area; weight is the area without direction. */
typedef struct springls__dipole { springls__v3 center; float radius2; springls__v3 area; float weight; } springls__dipole;

/* A triangle mesh with a bounding volume hierarchy: the original surface, in voxels, or the model (bvh.h, query.h). */
typedef struct springls__surface {
    springls__v3 *points;   /* 3 a triangle, unwelded                                                           */
    int *order;             /* triangle of leaf position i                                                      */
    springls__bvh_node *nodes;
    springls__dipole *dipoles; /* one a node; NULL until asked for                                              */
    int *source;            /* 2 * triangle of the mesh given + 1 if it was turned (corners 1 and 2 swapped); NULL: itself */
    int count, given, node_count; /* given: triangles of the mesh given, more than count where some were dropped */
    float magnitude;        /* the largest |coordinate|: what rounding errors are relative to                   */
    springls__buffer points_memory, order_memory, nodes_memory, dipoles_memory, source_memory;
} springls__surface;

enum { SPRINGLS__OLD_PLACES, SPRINGLS__NEW_VALUES, SPRINGLS__MERGE_TARGETS, SPRINGLS__ATTRIBUTE_BUFFERS };

/* What springls carry (attributes.h): `channels` floats a springl, in springl order. A table of these and their values is all there is. */
typedef struct springls__attribute {
    char name[SPRINGLS_MAX_NAME_LENGTH + 1];
    int channels;
    springls_policy split, fill, merge;
    springls__buffer values;
} springls__attribute;

/* Another place where kernels run (springls_cl.h). A call that fails says why in ctx->error and logs nothing: springls__fall_back_to_host does. */
struct springls_backend {
    /* Device memory for a buffer, at least `bytes`; its first `keep` bytes are kept. */
    springls_status (*resize)(springls_context *ctx, springls__buffer *buffer, size_t bytes, size_t keep);
    void (*release)(springls_context *ctx, springls__buffer *buffer);
    /* The first `bytes` of a buffer from the device to the host, or back; what is on its way has arrived. */
    springls_status (*transfer)(springls_context *ctx, springls__buffer *buffer, size_t bytes, bool to_host);
    /* Device memory of a buffer gets these bytes. */
    springls_status (*upload)(springls_context *ctx, springls__buffer *buffer, const void *data, size_t bytes);
    springls_status (*finish)(springls_context *ctx); /* waits until everything asked for is done */
    bool timed;                                       /* every stage ends with that            */
    springls_velocity_fn user_velocity; /* the callback that the device has kernel text of, and what it wants of `user` */
    size_t user_bytes;
    springls_status (*run)(springls_context *ctx, int kernel, int count, springls__job job);
    /* Collectives: what the function of the same name (springls__...) does on the host. One that returns DEVICE can still be done there,
       unless it has set ctx->lost. Other failures are the host's, and have been told by springls__fail. */
    springls_status (*count_of)(springls_context *ctx, int array, int count, uint8_t value, int *found);
    springls_status (*largest)(springls_context *ctx, int scratch, int count, float *largest);
    springls_status (*scan)(springls_context *ctx, int scratch, int count, int *total);
    springls_status (*constellation_compact)(springls_context *ctx);
    springls_status (*cells_build)(springls_context *ctx);
    springls_status (*cells_cover_around)(springls_context *ctx);
    springls_status (*band_move)(springls_context *ctx); /* its second half: SCRATCH0 tells the reach of each brick */
    springls_status (*near_build)(springls_context *ctx, float margin);
    springls_status (*bricks_around_springls)(springls_context *ctx);
    springls_status (*settle_regions)(springls_context *ctx);
};

typedef springls_status (*springls__stage_fn)(springls_context *ctx);

/* A run of a kernel here. */
typedef struct springls__range_job {
    const springls_context *ctx;
    const struct springls__kernel_info *kernel;
    springls__job job;
} springls__range_job;

/* A loop that is run in pieces; pace: seconds that an element of the last one took. */
typedef struct springls__pieces {
    springls_task task;
    void *arg;
    int next, count, grain;
    double pace;
    springls__range_job kernel;
} springls__pieces;

/* The stage at work, and how far it has come (resumable.h). */
typedef struct springls__work {
    springls__stage_fn stage;
    int phase;              /* the next one: a constant of the stage's enum                                     */
    int repetition;         /* how often a phase has been repeated                                              */
    bool pending;           /* the phase is still to run                                                        */
    float displacement;     /* project: the longest way of a particle since phi was last in step, voxels        */
    springls__pieces loop;  /* that the phase before has ended with                                             */
} springls__work;

/* The motion of advect: its forces, its numbers, and what has come of it. */
typedef struct springls__motion {
    springls_context *ctx;
    springls_forces forces;
    bool stop_at_topology;
    float time, dt;
    float max_displacement; /* of a particle, voxels; 0: no limit                                               */
    int tries;
    springls__force_rule rule;
    float affine_weight;
    springls__movers *displacement;
    struct springls__block_motion *blocks;
    float moved;            /* how far the fastest goes; negative: not finite                                   */
    int moving;
} springls__motion;

/* What an entry of an algorithm is: a stage to run, or the begin or the end of a loop. */
typedef enum springls__entry_kind { SPRINGLS__ENTRY_RUN, SPRINGLS__ENTRY_REPEAT_WHILE, SPRINGLS__ENTRY_END_REPEAT } springls__entry_kind;

/* An entry of an algorithm (step.h). */
typedef struct springls__step_entry {
    springls__entry_kind kind;
    int stage;              /* whose clock runs, or -1: none                                                    */
    bool (*when)(const springls_context *ctx); /* its condition; NULL: always                                   */
    springls__stage_fn run;
} springls__step_entry;

/* The step in progress (step.h). */
typedef struct springls__stepping {
    const springls__step_entry *next;
    double stage_seconds;   /* that the stage at work has taken so far                                          */
    bool active;
    int stage;              /* at work, or -1                                                                   */
    springls_step_desc desc;
    springls_forces forces;
    double end_time;        /* of the step                                                                      */
    float time_left;        /* of dt; 0 where the step is not cut into sub-steps                                */
    float longest_substep;  /* as the force permits                                                             */
    int substeps;           /* so far                                                                           */
    bool resamples;         /* this sub-step does                                                               */
    bool phi_from_springls; /* phi is computed from the springls alone, and not carried along                   */
    int iterations_left;    /* of evolve and rebuild                                                            */
} springls__stepping;

struct springls_context {
    springls_desc desc;     /* as given, allocator and max_springls resolved, params NULL                                  */
    double to_world[12];    /* row-major 3x4, voxel -> world                                                    */
    double to_voxel[12];
    float smallest_spacing, largest_spacing;
    springls__model model;
    springls__buffer memory[SPRINGLS__ARRAY_COUNT]; /* of the model's arrays, grown and kept                    */
    springls__surface original;
    uint64_t reference_stamp; /* of the reference level set and the original surface (snapshot.h); 0: not known  */
    springls__surface springl_surface; /* the springls themselves, for closest and ray queries                   */
    springls__attribute attributes[SPRINGLS_MAX_ATTRIBUTES]; /* behind the last: memory for the next             */
    int attribute_count;
    springls__buffer attribute_memory[SPRINGLS__ATTRIBUTE_BUFFERS]; /* working memory of attributes.h            */
    springls__buffer locked_memory; /* doubles: the volumes that components are to have, params.volume_lock     */
    int locked_count;       /* 0: not known yet                                                                 */
    int neighbors_age;      /* steps since they were found; negative: never, or springls have come or gone       */
    springls_backend *backend; /* NULL: scalar                                                                   */
    springls_status backend_status; /* why it has been left, until the call at work has told                    */
    bool lost;              /* and the model could not be brought back: nothing goes on until then               */
    springls_sampled_field on_device_field[2]; /* what the device has: pressure and velocity                     */
    bool on_device;         /* kernels run on the backend: a stage is at work, and not an input or a query       */
    int calls;              /* stages and steps at work, one inside the other                                    */
    springls_stats stats;
    double time;
    int iteration;          /* k of Algorithm 2                                                                 */
    springls__work work;
    springls__motion motion;
    springls__stepping step;
    bool cells_fresh, omega_fresh, model_fresh; /* false after anything that moves springls                     */
    size_t memory_used;
    char error[256];
};

#endif
