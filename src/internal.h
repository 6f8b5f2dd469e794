/* internal.h - what a context holds. Lengths are voxels everywhere below the public interface. */

#include <float.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef SPRINGLS_ASSERT
#include <assert.h>
#define SPRINGLS_ASSERT(condition) assert(condition)
#endif

#if defined(__GNUC__)
#define SPRINGLS__FN __attribute__((unused)) static
#define SPRINGLS__PRINTF(text, first) __attribute__((format(printf, text, first)))
#else
#define SPRINGLS__FN static
#define SPRINGLS__PRINTF(text, first)
#endif

/* The hot record: all that relax, omega and every distance query need of a springl, in one cache line. */
typedef struct springls__springl {
    springls__v3 q[3];      /* triangle vertices, counter-clockwise seen from outside                           */
    springls__v3 p;         /* particle                                                                         */
    float inverse_edge2[3]; /* 1/|q[m+1]-q[m]|^2, 0 for an edge of no length                                    */
    float reach;            /* max |q[m] - p|                                                                   */
} springls__springl;

enum { SPRINGLS__MAX_NEIGHBORS = 8 }; /* edges a vertex: the paper's limit, and a register of eight lanes */

/* A growable array from the context's allocator. */
typedef struct springls__buffer { void *data; size_t bytes; } springls__buffer;

/* The constellation: arrays of `count` elements each. */
typedef struct springls__constellation {
    springls__springl *s;
    springls__v3 *a;        /* correspondence on the original surface                                           */
    uint32_t *id;
    uint32_t *generation;
    uint8_t *mask;          /* 1: does not relax                                                                */
    int32_t *part;          /* the component it was part of when volumes were last locked; -1: none known       */
    uint8_t *edge;          /* 1: lies at a sharp edge, as of the last step (edges.h)                           */
    float *phi;             /* the level set at p, when it was last in step with p (phi_n of eq. 27)             */
    springls__v3 *was;      /* where the particle was when phi was last in step with it                          */
    int count;
    uint32_t next_id;
    springls__buffer s_memory, a_memory, id_memory, generation_memory, mask_memory, part_memory, edge_memory, phi_memory, was_memory;
} springls__constellation;

/* Sparse voxel grid: 8x8x8 bricks in a pool of slots, found through a dense top table. Slots 0 and 1 are constant
   bricks, far outside and far inside, so that every brick of the top table can be read without a test. */
enum { SPRINGLS__BRICK = 8, SPRINGLS__BRICK_VOXELS = 512, SPRINGLS__OUTSIDE = 0, SPRINGLS__INSIDE = 1,
       SPRINGLS__FIRST_SLOT = 2,
       SPRINGLS__CELL = 2, SPRINGLS__CELLS = 65 }; /* a cell of springls is two voxels wide; 64 a brick, and one more */

typedef struct springls__grid {
    int size[3];            /* voxels                                                                           */
    int bricks[3];          /* of the top table                                                                 */
    int *top;               /* brick -> slot                                                                    */
    int *slot_brick;        /* slot -> brick                                                                    */
    int *active;            /* slots in use, ordered by brick: the order of every loop over bricks              */
    int *free_slots;
    int active_count, free_count, slot_count;
    float *phi;             /* 512 a slot                                                                       */
    float *phi_next;
    float *omega;           /* distance to the springls, clamped at params.capture; below 0: unknown            */
    uint32_t *cell;         /* CELLS a slot: springls of cell c are ids[cell[c]] .. ids[cell[c+1]-1]             */
    float far_value;        /* |phi| in the constant bricks and the clamp everywhere                            */
    springls__buffer top_memory, slot_memory, active_memory, free_memory;
    springls__buffer phi_memory, next_memory, omega_memory, cell_memory;
} springls__grid;

/* Springls by the cell of their particle (cells.h), and by brick they come near (omega.h). */
typedef struct springls__cells {
    uint32_t *ids;          /* ascending within a cell                                                          */
    uint32_t *near_first;   /* near_ids of active brick i: near_first[i] .. near_first[i+1]-1                   */
    uint32_t *near_ids;
    float reach;            /* of the springls that are in cells; larger ones are in `large` only               */
    uint32_t *large;
    int large_count;
    springls__buffer ids_memory, near_first_memory, near_memory, large_memory, key_memory;
} springls__cells;

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
    int count, node_count;
    float magnitude;        /* the largest |coordinate|: what rounding errors are relative to                   */
    springls__buffer points_memory, order_memory, nodes_memory, dipoles_memory, source_memory;
} springls__surface;

struct springls_context {
    springls_desc desc;     /* as given, allocator and max_springls resolved, params NULL                                  */
    springls_params params;
    double to_world[12];    /* row-major 3x4, voxel -> world                                                    */
    double to_voxel[12];
    float smallest_spacing, largest_spacing;
    springls__constellation set;
    springls__grid grid;
    springls__grid reference; /* phi_ref: top table and phi only                                                */
    springls__surface original;
    springls__surface model;  /* the springls themselves, for closest and ray queries                           */
    springls__cells cells;
    springls__buffer scratch[8]; /* working memory of the stage that runs, grown and kept                       */
    springls__buffer neighbors;
    springls__buffer locked_memory; /* doubles: the volumes that components are to have, params.volume_lock     */
    int locked_count;       /* 0: not known yet                                                                 */
    int neighbors_age;      /* steps since they were found; negative: never, or springls have come or gone       */
    springls_stats stats;
    double time;
    int iteration;          /* k of Algorithm 2                                                                 */
    bool cells_fresh, omega_fresh, model_fresh; /* false after anything that moves springls                     */
    size_t memory_used;
    char error[256];
};

SPRINGLS__FN springls_status springls__fail(springls_context *ctx, springls_status status, const char *format, ...)
    SPRINGLS__PRINTF(3, 4);
SPRINGLS__FN void springls__log(const springls_context *ctx, int level, const char *format, ...) SPRINGLS__PRINTF(3, 4);

/* Returns the failure of an expression from the calling function. */
#define SPRINGLS__TRY(expression)                                                       \
    do {                                                                                \
        springls_status springls__try_status = (expression);                            \
        if (springls__try_status != SPRINGLS_OK) return springls__try_status;           \
    } while (0)
