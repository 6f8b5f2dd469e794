/* context.h - what a context holds. Lengths are in voxels everywhere below the public interface. */
#ifndef SPRINGLS__RUNTIME_CONTEXT_H
#define SPRINGLS__RUNTIME_CONTEXT_H

#include "base.h"
#include "../../kernels_embed/stages/advect.h"

/* A growable array from the context's allocator, and its copy at a place in device memory; device_bytes 0: it has none. A stale
   one has old contents. */
typedef struct springls__buffer {
    void *data;
    size_t bytes;
    size_t device_at, device_bytes;
    bool host_stale, device_stale;
} springls__buffer;

/* What a context has of a device's memory: one buffer of the backend's for all arrays, of which `used` bytes are given away. */
typedef struct springls__device_memory {
    void *buffer;
    size_t bytes, used;
} springls__device_memory;

/* The scratch arrays of roles (scratch.h). */
enum {
#define SPRINGLS__ROLE_NUMBER(role, type, number) SPRINGLS__ROLE_##role = (int)SPRINGLS__ARRAY_SCRATCH0 + (number),
    SPRINGLS__KERNEL_ROLES(SPRINGLS__ROLE_NUMBER) SPRINGLS__HOST_ROLES(SPRINGLS__ROLE_NUMBER)
#undef SPRINGLS__ROLE_NUMBER
    SPRINGLS__ROLE_NONE
};

#define SPRINGLS__ROLE_ARRAY(role) ((springls__array)SPRINGLS__ROLE_##role)

/* Sets of arrays: a bit each. */
#define SPRINGLS__BIT(array) ((uint64_t)1 << SPRINGLS__ARRAY_##array)
#define SPRINGLS__ROLE_BIT(role) ((uint64_t)1 << SPRINGLS__ROLE_##role)
#define SPRINGLS__OR_BIT(name, type, block, owner, member) | ((uint64_t)1 << SPRINGLS__ARRAY_##name)
#define SPRINGLS__ALL_BITS ((uint64_t)0 SPRINGLS__ARRAYS(SPRINGLS__OR_BIT))
#define SPRINGLS__SET_BITS ((uint64_t)0 SPRINGLS__SPRINGL_ARRAYS(SPRINGLS__OR_BIT))
#define SPRINGLS__SLOT_BITS ((uint64_t)0 SPRINGLS__SLOT_ARRAYS(SPRINGLS__OR_BIT))
#define SPRINGLS__GRID_BITS ((uint64_t)0 SPRINGLS__GRID_ARRAYS(SPRINGLS__OR_BIT))
#define SPRINGLS__SEARCH_BITS ((uint64_t)0 SPRINGLS__SEARCH_ARRAYS(SPRINGLS__OR_BIT))
#define SPRINGLS__WORK_BITS ((uint64_t)0 SPRINGLS__SCRATCH_ARRAYS(SPRINGLS__OR_BIT) SPRINGLS__DEVICE_ARRAYS(SPRINGLS__OR_BIT))

#define SPRINGLS__ONE_MORE(name, type, block, owner, member) + 1
#define SPRINGLS__SPRINGL_ARRAY_COUNT (0 SPRINGLS__SPRINGL_ARRAYS(SPRINGLS__ONE_MORE)) /* the first of all arrays */

SPRINGLS__FN bool springls__has_array(uint64_t arrays, int array) { return (arrays >> array & 1u) != 0; }

/* A node of a bounding volume hierarchy: a leaf of `count` triangles order[first], order[first+1] ..., or, when count is
   0, the parent of nodes first and first+1. Children follow their parents in a hierarchy that is built at once. */
typedef struct springls__bvh_node { float lower[3]; int first; float upper[3]; int count; } springls__bvh_node;

/* The triangles of a node as one directed area, for points that are far away; weight is the sum of their areas. */
typedef struct springls__dipole { springls__v3 center; float radius2; springls__v3 area; float weight; } springls__dipole;

/* A triangle mesh with a bounding volume hierarchy: the original surface, in voxels, or the model (bvh.h, springl_surface.h). */
typedef struct springls__surface {
    springls__v3 *points;   /* 3 a triangle, unwelded                                                           */
    int *order;             /* triangle of leaf position i                                                      */
    springls__bvh_node *nodes;
    springls__dipole *dipoles; /* one a node; NULL until springls__surface_make_dipoles                         */
    int *source;            /* 2 * triangle of the mesh given + 1 if it was turned (corners 1 and 2 swapped); NULL: itself */
    int count, given;       /* given: triangles of the mesh given, more than count where some were dropped      */
    int node_count;         /* nodes, but for those that join parts: see springls__bvh_nodes                    */
    int parts;              /* hierarchies joined in it: their roots are in parts_memory, and after the node_count nodes of parts come
                               those that join them (bvh_join.h); 0: it was built at once                       */
    int *joint, joints;     /* the first triangle of each tool that combinations have joined, after the surface that was set */
    float magnitude;        /* the largest |coordinate|: what rounding errors are relative to                   */
    springls__buffer points_memory, order_memory, nodes_memory, dipoles_memory, source_memory, parts_memory, joint_memory;
} springls__surface;

enum { SPRINGLS__OLD_PLACES, SPRINGLS__NEW_VALUES, SPRINGLS__MERGE_TARGETS, SPRINGLS__ATTRIBUTE_BUFFERS };

#define SPRINGLS__SURFACE_OF_ALL 0

/* Arrays of springl contouring: see springls__contour, then surface_parts.h. */
enum {
    SPRINGLS__SURFACE_JOB,
    SPRINGLS__SURFACE_BRICK_LIST,
    SPRINGLS__SURFACE_HASH,
    SPRINGLS__SURFACE_KEY,
    SPRINGLS__SURFACE_REGION,
    SPRINGLS__SURFACE_SPRINGLS,
    SPRINGLS__SURFACE_SURFEL,
    SPRINGLS__SURFACE_FIRST_FOUND,
    SPRINGLS__SURFACE_FOUND,
    SPRINGLS__SURFACE_HIT,
    SPRINGLS__SURFACE_CROSSING,
    SPRINGLS__SURFACE_ARC,
    SPRINGLS__SURFACE_INNER,
    SPRINGLS__SURFACE_TRIANGLE,
    SPRINGLS__SURFACE_RANK,
    SPRINGLS__SURFACE_MESH_POSITION,
    SPRINGLS__SURFACE_MESH_NORMAL,
    SPRINGLS__SURFACE_MESH_SPRINGL,
    SPRINGLS__SURFACE_MESH_CORNER,
    SPRINGLS__SURFACE_VERTEX_PART,
    SPRINGLS__SURFACE_SPRINGL_PART,
    SPRINGLS__SURFACE_PARTS,
    SPRINGLS__SURFACE_BUFFERS
};

/* What springls carry besides themselves (attribute_values.h): `channels` floats each, in the order of springls. */
typedef struct springls__attribute {
    char name[SPRINGLS_MAX_NAME_LENGTH + 1];
    int channels;
    springls_policy split, fill, merge;
    springls__buffer values;
} springls__attribute;

/* The largest of some floats, at least 0, and how many are more than a limit. */
typedef struct springls__largest { float value; int more; } springls__largest;

/* A device where kernels run instead of the host (springls_cl.h). A function that fails stores the reason in ctx->error and does
   not log it: springls__fall_back_to_host does. */
struct springls_backend {
    /* Gives an array of ctx->memory `bytes` of device memory; keeps the first `keep` of what it had. Other arrays may move. */
    springls_status (*resize)(springls_context *ctx, springls__buffer *buffer, size_t bytes, size_t keep);
    void (*release)(springls_context *ctx); /* frees a context's device memory */
    /* Copies the first `bytes` of a buffer to the host, or to the device, and waits for that. */
    springls_status (*transfer)(springls_context *ctx, springls__buffer *buffer, size_t bytes, bool to_host);
    /* Copies `data` to a buffer's device memory. */
    springls_status (*upload)(springls_context *ctx, springls__buffer *buffer, const void *data, size_t bytes);
    springls_status (*finish)(springls_context *ctx); /* waits until the device is idle     */
    bool timed;                                       /* every stage ends with finish       */
    springls_velocity_fn user_velocity; /* the callback that the device has program text of */
    size_t user_bytes; /* of `user` that the text reads */
    springls_status (*run)(springls_context *ctx, int kernel, int count, springls__arguments args);
};

/* A run of a kernel on the host. */
typedef struct springls__kernel_run {
    const springls_context *ctx;
    const struct springls__kernel_info *kernel;
    springls__arguments args;
} springls__kernel_run;

/* Does the work of the elements begin <= i < end. memory: the floats of its lane (launch.h); NULL if the loop needs none. */
typedef void (*springls__loop_work)(void *arg, int begin, int end, float *memory);

/* A loop that is run in pieces; floats: of memory for each lane (launch.h); piece: elements of the last piece; pace:
   seconds an element takes (resumable.h). */
typedef struct springls__pieces {
    springls__loop_work work;
    void *arg;
    size_t floats;
    int next, count, grain, piece;
    double pace;
    springls__kernel_run kernel;
} springls__pieces;

/* A place in a table of entries (entries.h). clock: when its stage has begun or, while a step is left, the seconds it has taken. */
typedef struct springls__place {
    const struct springls__entry *table;
    int next;               /* the entry that follows                                                           */
    int round;              /* how often the loop around it has been run to its end                             */
    int stage;              /* whose clock runs; -1: none                                                       */
    double clock;
} springls__place;

enum { SPRINGLS__MAX_CALLS = 8 }; /* of tables, one inside the other */

/* The table at work, and how far it has come (resumable.h). */
typedef struct springls__work {
    springls__place place[SPRINGLS__MAX_CALLS];
    int depth;              /* how many of them are in use; the last one is at work                             */
    bool on_device;         /* its kernels run on the backend, if there is one                                  */
    int found;              /* what an entry has counted for a condition that follows                           */
    int added;              /* resample, fill_gaps: springls that are being stored behind the others            */
    bool keeps_phi;         /* the kernel at work, or the last one, sees to it that phi_next has phi where bricks are asleep */
    float displacement;     /* project: the largest displacement of a particle since phi was last synced, voxels */
    springls__pieces loop;  /* the loop that the last entry has ended with                                      */
} springls__work;

/* The motion of advect: its forces, its numbers, and what has come of it. */
typedef struct springls__motion {
    springls_context *ctx;
    springls_forces forces;
    bool in_world;          /* forces are of the world, which is not the lattice                                */
    bool stop_at_topology;
    float time, dt;
    float max_displacement; /* of a particle, voxels; 0: no limit                                               */
    int tries;              /* how often it was cut short because particles would have moved further            */
    springls__force_rule rule;
    float affine_weight;
    bool has_region;        /* forces act in a region alone                                                     */
    int *listed;            /* the springls in it, ascending; NULL: all                                         */
    int count;              /* how many springls the forces act on                                              */
    float moved;            /* the largest displacement of a particle, voxels; negative: not finite             */
    float turned;           /* how far a springl turns or stretches at most: see springls__turned2              */
    bool again;             /* a particle would move further than it may                                        */
    bool none;              /* no point has moved at all                                                        */
    int moving;             /* how many springls have moved by more than 0.01 voxel                             */
} springls__motion;

/* The level set as the steps have left it, while phi has followed the springls for a reader (follow.h). */
typedef struct springls__saved_level_set {
    springls__buffer memory; /* SPRINGLS__SAVED_BITS, one after the other                                       */
    springls__table table;
    int active_count, free_count, slot_count, some_asleep;
    float lag, lag_turned, away;
    bool opposed, in_use;
} springls__saved_level_set;

/* The step in progress (step.h). */
typedef struct springls__stepping {
    bool active;
    struct springls_chunks *chunks; /* their update is in progress (chunks.h) instead of a step                 */
    struct springls__combination *combination; /* is in progress (combine.h) instead of a step                  */
    springls_context *owned; /* a model that ends with the combination; NULL: none                              */
    springls_status (*go_on)(springls_context *ctx); /* is asked before it is resumed; NULL: nothing is to be asked */
    void (*ended)(springls_context *ctx, springls_status status); /* is told its end, CANCELLED: dropped; NULL: nobody is */
    springls_step_desc desc;
    springls_forces forces;
    float max_displacement; /* of a particle in a sub-step, voxels; FLT_MAX: dt is never divided                 */
    double end_time;        /* of the step                                                                      */
    float time_left;        /* of dt; 0 if the step is not cut into sub-steps, and at its end                   */
    float longest_substep;  /* that the force permits                                                           */
    float longest_displacement; /* of a particle in the next sub-step, voxels                                   */
    float expected;         /* largest displacement in the next sub-step, voxels; 0: not known                  */
    int substeps;           /* so far                                                                           */
    bool resamples;         /* this sub-step contracts and resamples                                            */
    bool phi_from_springls; /* phi is computed from the springls alone, and not carried along                   */
    bool is_lazy;           /* this sub-step leaves phi behind                                                  */
} springls__stepping;

/* Where on the lattice of springls_desc.grid a window of its size is: its first voxel is voxel `offset` there. */
typedef struct springls__window {
    int offset[3];           /* multiples of 8 */
    double to_world[12];     /* row-major 3x4, voxel of the window -> world */
    double to_voxel[12];
} springls__window;

struct springls_context {
    springls_desc desc;     /* as given, but allocator and max_springls have their defaults filled in, and params is NULL */
    double lattice_to_world[12]; /* row-major 3x4, voxel of springls_desc.grid -> world                          */
    bool lattice_is_world;       /* that is the identity: spacing 1, origin 0, no direction                      */
    springls__window window;     /* where the grid is: of phi, and of all springls but their correspondences     */
    springls__window original_window; /* of correspondences, phi_ref and the original surface                    */
    int home[3];                 /* window.offset after an input                                                 */
    float smallest_spacing, largest_spacing;
    springls__model model;
    springls__buffer memory[SPRINGLS__ARRAY_COUNT]; /* of the model's arrays                                    */
    springls__device_memory device_memory;
    springls__surface original;
    uint64_t reference_stamp; /* of the reference level set and the original surface (snapshot.h); 0: not known  */
    springls__surface springl_surface; /* the triangles of the springls, for queries                             */
    springls__surface correspondences; /* those of the springls, for springls_place_now                          */
    springls__buffer bvh_memory; /* working memory of bvh.h                                                      */
    springls__attribute attributes[SPRINGLS_MAX_ATTRIBUTES]; /* those behind the last keep their memory          */
    int attribute_count;
    springls__buffer attribute_memory[SPRINGLS__ATTRIBUTE_BUFFERS]; /* working memory of stages/inherit.h        */
    springls__buffer component_memory; /* components as found last, by id (components.h)                        */
    springls__buffer lock_item_memory, lock_node_memory; /* of volume_lock.h, while a mesh is made in between   */
    springls__buffer next_component_memory; /* the next ones while they are found; springls_components lends it  */
    springls__buffer label_rank, label_voxel, label_node, label_id_memory; /* of voxels (label_components.h)     */
    springls__buffer event_memory, event_part_memory;         /* of the last step and since (events.h)            */
    int component_count, label_first_brick, label_count, event_count, event_part_count;
    int new_events;                 /* how many events, the last ones, have been found since the last step              */
    uint32_t last_component_id;
    uint32_t last_contact_body;     /* largest of the bodies that stay two; 0: they are not found yet                        */
    bool components_found;  /* they have been found since the model was set                                      */
    bool volumes_locked;    /* the volumes that they are to keep have been measured                              */
    bool neighbors_missing; /* some springls slept when the lists were built, and have none                      */
    int neighbors_uses;     /* relaxations that may still use the lists; 0: they are to be built                 */
    springls_backend *backend; /* NULL: scalar                                                                   */
    springls_status backend_status; /* why the backend has been left, until the outermost call reports it       */
    bool lost;              /* the model could not be copied from the device: all work stops until the report    */
    springls_sampled_field on_device_field[2]; /* pressure and velocity, as last copied to the device            */
    bool on_device;         /* kernels run on the backend: true in stages, false in inputs and queries           */
    uint32_t late_unread;   /* a bit for each count that has been found and not been read (launch.h)            */
    int calls;              /* depth of the stages and steps at work, one inside the other                       */
    springls_stats stats;
    double time;
    int iteration;          /* whole steps since resampling was last due (k of Algorithm 2); long ones count more */
    float lag;              /* voxels that springls have moved at most, in lazy steps, since phi last followed; FLT_MAX:
                               they have been moved otherwise, and phi follows in the next step                 */
    float lag_turned;       /* the same of how far springls have turned: the sum of motion.turned                */
    float away;             /* voxels: no particle is further from its synced_position; FLT_MAX: not known      */
    bool opposed;           /* the model may have thin sheets or gaps, whose sides are near one voxel           */
    springls__saved_level_set saved;
    springls__work work;
    float curvature_span;   /* voxels: how far along tangents curvature is measured, if further than usual      */
    springls__motion motion;
    springls__stepping step;
    struct springls__completion *completion; /* of a model that is being completed (completion.h)               */
    springls__buffer undo_memory; /* the model as it was before a combination (combine_undo.h)                   */
    bool at_rest;           /* all bricks are asleep, and no springl has moved since that was found             */
    bool cells_fresh, omega_fresh, springl_surface_fresh; /* false after anything that moves springls or their triangles */
    bool particles_listed;  /* the cell list has all particles where they are; triangles may have changed since           */
    int keyed;              /* the first so many springls have the keys of their cells; triangles may have changed since */
    int particles_outside;  /* how many in the cell list lie outside active bricks                               */
    uint64_t springls_version; /* counts what may have changed springls: springls_mesh.version is one more        */
    springls__buffer surface_memory[SPRINGLS__SURFACE_BUFFERS]; /* of surface_table.h: the mesh of springls, and what it is made with */
    uint64_t surface_version; /* the model_version that this mesh is of; 0: there is none                         */
    int surface_vertices, surface_triangles, surface_bricks;
    int surface_region;     /* bricks in SURFACE_REGION whose triangles the table has; SPRINGLS__SURFACE_OF_ALL: of all bricks */
    uint64_t parts_version; /* the surface_version that its parts are of (surface_parts.h); 0: there are none        */
    int part_count;
    springls__surface contour_surface; /* the triangles of that mesh, for queries                                 */
    uint64_t contour_surface_version;  /* the surface_version that they are of; 0: there are none                 */
    uint64_t correspondences_version; /* the model_version that `correspondences` is of; 0: there is none         */
    uint64_t nearby_version; /* the model_version that queries of few places have made bricks of that mesh of      */
    int nearby_bricks;       /* how many, margins included                                                        */
    springls__buffer id_memory; /* working memory of springls_index_of                                            */
    uint64_t phi_version;   /* counts what may have changed the level set (residency.h)                          */
    uint64_t model_version; /* counts what may have changed springls or the level set                            */
    uint64_t attributes_version; /* counts what callers change of attributes                                     */
    uint64_t shape_version; /* counts what may have changed the shape of springls, or the level set              */
    uint64_t components_version, labels_version; /* the version that components, and labels of voxels, were found from; 0: none */
    size_t memory_used;
    char error[256];
};

#endif
