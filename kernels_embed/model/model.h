/* model.h - what the code of one element may see of a model: its arrays, their sizes, the parameters. */
#ifndef SPRINGLS__KERNEL_MODEL_MODEL_H
#define SPRINGLS__KERNEL_MODEL_MODEL_H

#include "../interface/parameters.h"
#include "../language/triangle.h"

#include "../language/width_float.h"
#include "springl_body.h"
#include "../language/width_simd.h"
#include "springl_body.h"

/* The constellation: arrays of `count` elements each. */
typedef struct springls__constellation {
    SPRINGLS__GLOBAL springls__springl *s;
    SPRINGLS__GLOBAL springls__v3 *a;         /* correspondence on the original surface                         */
    SPRINGLS__GLOBAL uint32_t *id;
    SPRINGLS__GLOBAL uint32_t *generation;
    SPRINGLS__GLOBAL uint8_t *mask;           /* 1: does not relax                                              */
    SPRINGLS__GLOBAL int32_t *component;           /* the component it was part of when volumes were last locked; -1: none known */
    SPRINGLS__GLOBAL uint8_t *edge;           /* 1: lies at a sharp edge, as of the last step (edges.h)         */
    SPRINGLS__GLOBAL uint32_t *parent;        /* id of the springl that it was split from or planted beside; its own: of none */
    SPRINGLS__GLOBAL uint32_t *birth;         /* 4 * step + kind: when and how it was last given its place      */
    SPRINGLS__GLOBAL float *phi;              /* the level set at p, when it was last in step with p (phi_n of eq. 27) */
    SPRINGLS__GLOBAL springls__v3 *synced_position;       /* where the particle was when phi was last in step with it       */
    int count, at_edges; /* at_edges: how many lie at a sharp edge */
    uint32_t next_id, step; /* step: of the model, modulo 2^30 */
} springls__constellation;

/* Kinds of springls: springls_kind of the interface. */
#define SPRINGLS__KIND_ORIGINAL 0u
#define SPRINGLS__KIND_SPLIT 1u
#define SPRINGLS__KIND_FILLED 2u

/* Sparse voxel grid: 8x8x8 bricks in a pool of slots, found through a dense top table. Slots 0 and 1 are constant
   bricks, far outside and far inside, so that every brick of the top table can be read without a test. */
#define SPRINGLS__BRICK 8
#define SPRINGLS__BRICK_VOXELS 512
#define SPRINGLS__OUTSIDE 0
#define SPRINGLS__INSIDE 1
#define SPRINGLS__FIRST_SLOT 2
#define SPRINGLS__CELL 2   /* a cell of springls is two voxels wide ... */
#define SPRINGLS__CELLS 65 /* ... 64 a brick, and one more              */

typedef struct springls__grid {
    int size[3];                        /* voxels                                                               */
    int bricks[3];                      /* of the top table                                                     */
    SPRINGLS__GLOBAL int *top;          /* brick -> slot                                                        */
    SPRINGLS__GLOBAL int *slot_brick;   /* slot -> brick                                                        */
    SPRINGLS__GLOBAL int *active;       /* slots in use, ordered by brick: the order of every loop over bricks  */
    SPRINGLS__GLOBAL int *free_slots;
    int active_count, free_count, slot_count;
    SPRINGLS__GLOBAL float *phi;        /* 512 a slot                                                           */
    SPRINGLS__GLOBAL float *phi_next;
    SPRINGLS__GLOBAL float *omega;      /* distance to the springls, clamped at params.capture_range; below 0: unknown */
    SPRINGLS__GLOBAL uint32_t *cell;    /* CELLS a slot: springls of cell c are ids[cell[c]] .. ids[cell[c+1]-1] */
    float far_value;                    /* |phi| in the constant bricks and the clamp everywhere                */
} springls__grid;

/* Springls by the cell of their particle (cells.h), and by brick they come near (omega.h). */
typedef struct springls__cell_list {
    SPRINGLS__GLOBAL uint32_t *ids;        /* ascending within a cell                                           */
    SPRINGLS__GLOBAL uint32_t *brick_list_first; /* brick_list_ids of active brick i: brick_list_first[i] .. brick_list_first[i+1]-1    */
    SPRINGLS__GLOBAL uint32_t *brick_list_ids;
    SPRINGLS__GLOBAL uint32_t *large;      /* springls that reach too far to be in cells                        */
    SPRINGLS__GLOBAL uint32_t *key;        /* the cell of each springl, counted through all slots               */
    float bounding_radius;                         /* of the springls that are in cells                                 */
    int large_count;
} springls__cell_list;

/* Forces that kernels can take by themselves (advect.h). */
struct springls__force_rule;
typedef struct springls__forces_here {
    SPRINGLS__GLOBAL struct springls__force_rule *rule;
    SPRINGLS__GLOBAL float *pressure, *velocity, *user;
} springls__forces_here;

#define SPRINGLS__SCRATCHES 8

/* Who works on a brick: item `item` of `items`, each on rows item, item + items, ... of its 64. On the host one does all. */
#define SPRINGLS__ROWS 64

typedef struct springls__group { int item, items; } springls__group;

SPRINGLS__MATHS springls__group springls__alone(void)
{
    springls__group group;
    group.item = 0;
    group.items = 1;
    return group;
}

SPRINGLS__MATHS bool springls__is_mine(springls__group group, int row) { return row % group.items == group.item; }

typedef struct springls__model {
    springls__constellation set;
    springls__grid grid;
    springls__grid reference;           /* phi_ref: top table and phi only                                      */
    springls__cell_list cells;
    SPRINGLS__GLOBAL int *neighbors;    /* NEIGHBOR_ROW a springl (neighbors.h)                                 */
    SPRINGLS__GLOBAL void *scratch[SPRINGLS__SCRATCHES]; /* working memory of the stage that runs               */
    springls__forces_here force;        /* what moves it, where no callback does                                */
    SPRINGLS__GLOBAL uint32_t *counts;     /* on a device: what a collective has counted (collect.cl)           */
    SPRINGLS__GLOBAL uint32_t *sums;       /* ... of its chunks, ...                                            */
    SPRINGLS__GLOBAL uint32_t *brick_flag; /* ... which bricks are to be active, ...                            */
    SPRINGLS__GLOBAL int *new_slots;      /* ... slots of new ones, ...                                        */
    SPRINGLS__GLOBAL uint32_t *spare;      /* ... and springls on their way                                     */
    springls__group group;
    springls_params params;
} springls__model;

/* All arrays: name, element, elements that belong together, place in the model. */
#define SPRINGLS__ARRAYS(X)                                                                                                       \
    X(S, springls__springl, 1, set.s) X(A, springls__v3, 1, set.a) X(ID, uint32_t, 1, set.id)                                     \
    X(GENERATION, uint32_t, 1, set.generation)                                                                                    \
    X(MASK, uint8_t, 1, set.mask) X(COMPONENT, int32_t, 1, set.component) X(EDGE, uint8_t, 1, set.edge)                                     \
    X(PARENT, uint32_t, 1, set.parent) X(BIRTH, uint32_t, 1, set.birth) X(PHI_AT, float, 1, set.phi)                              \
    X(SYNCED_POSITION, springls__v3, 1, set.synced_position)                                                                                              \
    X(TOP, int, 1, grid.top) X(SLOT_BRICK, int, 1, grid.slot_brick) X(ACTIVE, int, 1, grid.active)                                \
    X(FREE_SLOTS, int, 1, grid.free_slots) X(PHI, float, SPRINGLS__BRICK_VOXELS, grid.phi)                                        \
    X(PHI_NEXT, float, SPRINGLS__BRICK_VOXELS, grid.phi_next) X(OMEGA, float, SPRINGLS__BRICK_VOXELS, grid.omega)                 \
    X(CELL, uint32_t, SPRINGLS__CELLS, grid.cell)                                                                                 \
    X(REFERENCE_TOP, int, 1, reference.top) X(REFERENCE_PHI, float, SPRINGLS__BRICK_VOXELS, reference.phi)                        \
    X(IDS, uint32_t, 1, cells.ids) X(BRICK_LIST_FIRST, uint32_t, 1, cells.brick_list_first) X(BRICK_LIST_IDS, uint32_t, 1, cells.brick_list_ids)          \
    X(LARGE, uint32_t, 1, cells.large) X(KEY, uint32_t, 1, cells.key) X(NEIGHBORS, int, SPRINGLS__NEIGHBOR_ROW, neighbors)        \
    X(SCRATCH0, uint8_t, 1, scratch[0]) X(SCRATCH1, uint8_t, 1, scratch[1]) X(SCRATCH2, uint8_t, 1, scratch[2])                   \
    X(SCRATCH3, uint8_t, 1, scratch[3]) X(SCRATCH4, uint8_t, 1, scratch[4]) X(SCRATCH5, uint8_t, 1, scratch[5])                   \
    X(SCRATCH6, uint8_t, 1, scratch[6]) X(SCRATCH7, uint8_t, 1, scratch[7])                                                       \
    X(FORCE_RULE, struct springls__force_rule, 1, force.rule) X(FORCE_PRESSURE, float, 1, force.pressure)                         \
    X(FORCE_VELOCITY, float, 1, force.velocity) X(FORCE_USER, float, 1, force.user)                                               \
    X(COUNTS, uint32_t, 1, counts) X(SUMS, uint32_t, 1, sums) X(BRICK_FLAG, uint32_t, 1, brick_flag)                              \
    X(NEW_SLOTS, int, 1, new_slots) X(SPARE, uint32_t, SPRINGLS__PACKED_WORDS, spare)

/* All of a springl, on its way to another place. */
typedef struct springls__packed {
    springls__springl s;
    springls__v3 a, synced_position;
    uint32_t id, generation;
    int32_t component;
    float phi;
    uint32_t mask, edge, parent, birth;
} springls__packed;
#define SPRINGLS__PACKED_WORDS (sizeof(springls__packed) / 4)

#define SPRINGLS__MAX_NEIGHBORS 8 /* edges a vertex: the paper's limit, and a register of eight lanes */
#define SPRINGLS__NEIGHBOR_ROW 24 /* of the three vertices of a springl */

/* The numbers that one run of a kernel is given besides. */
typedef struct springls__job { int i[4]; float f[4]; } springls__job;

SPRINGLS__MATHS springls__springl springls__springl_make(springls__tri t, springls__v3 p)
{
    springls__springl s;
    s.q[0] = t.a; s.q[1] = t.b; s.q[2] = t.c;
    s.p = p;
    s.inverse_edge2[0] = s.inverse_edge2[1] = s.inverse_edge2[2] = s.bounding_radius = 0.0f;
    return springls__springl_finished(s);
}

SPRINGLS__MATHS springls__tri springls__springl_tri(springls__springl s)
{
    springls__tri t;
    t.a = s.q[0]; t.b = s.q[1]; t.c = s.q[2];
    return t;
}

SPRINGLS__MATHS springls__v3 springls__springl_normal(springls__springl s) { return springls__tri_normal(springls__springl_tri(s)); }

/* Does springl i lie at a sharp edge that is to be kept? */
SPRINGLS__MATHS bool springls__at_edge(const springls__model *model, int i) { return model->params.keep_edges && model->set.edge[i]; }

SPRINGLS__MATHS uint32_t springls__birth_of(const springls__model *model, uint32_t kind) { return 4u * model->set.step + kind; }

/* A new springl in place i, at or beyond `count`: its id follows from the place. */
SPRINGLS__MATHS void springls__springl_add(const springls__model *model, int i, springls__springl s, springls__v3 a, uint32_t generation, uint8_t mask)
{
    model->set.s[i] = s;
    model->set.a[i] = a;
    model->set.id[i] = model->set.next_id + (uint32_t)(i - model->set.count);
    model->set.generation[i] = generation;
    model->set.mask[i] = mask;
    model->set.component[i] = -1;
    model->set.edge[i] = 0;
    model->set.parent[i] = model->set.id[i];
    model->set.birth[i] = springls__birth_of(model, generation ? SPRINGLS__KIND_FILLED : SPRINGLS__KIND_ORIGINAL);
    model->set.phi[i] = 0.0f;
    model->set.synced_position[i] = s.p;
}

/* phi has been made to follow the springls. */
SPRINGLS__MATHS void springls__mark_phi_synced_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    model->set.synced_position[i] = model->set.s[i].p;
}

/* To SCRATCH7: how far a particle has come since then, squared. */
SPRINGLS__MATHS void springls__displacement_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    ((SPRINGLS__GLOBAL float *)model->scratch[7])[i] = springls__length2(springls__sub(model->set.s[i].p, model->set.synced_position[i]));
}

/* The model's numbers, as kernels are given them. */
typedef struct springls__shape {
    int size[3], bricks[3], springls, at_edges;
    uint32_t next_id, step;
    int active_count, free_count, slot_count, large_count;
    float far_value, reference_far_value, bounding_radius;
} springls__shape;

SPRINGLS__MATHS springls__shape springls__shape_of(const springls__model *model)
{
    springls__shape shape;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        shape.size[axis] = model->grid.size[axis];
        shape.bricks[axis] = model->grid.bricks[axis];
    }
    shape.springls = model->set.count;
    shape.at_edges = model->set.at_edges;
    shape.next_id = model->set.next_id;
    shape.step = model->set.step;
    shape.active_count = model->grid.active_count;
    shape.free_count = model->grid.free_count;
    shape.slot_count = model->grid.slot_count;
    shape.large_count = model->cells.large_count;
    shape.far_value = model->grid.far_value;
    shape.reference_far_value = model->reference.far_value;
    shape.bounding_radius = model->cells.bounding_radius;
    return shape;
}

SPRINGLS__MATHS void springls__shape_set(springls__model *model, springls__shape shape)
{
    int axis;
    for (axis = 0; axis < 3; axis++) {
        model->grid.size[axis] = model->reference.size[axis] = shape.size[axis];
        model->grid.bricks[axis] = model->reference.bricks[axis] = shape.bricks[axis];
    }
    model->set.count = shape.springls;
    model->set.at_edges = shape.at_edges;
    model->set.next_id = shape.next_id;
    model->set.step = shape.step;
    model->grid.active_count = shape.active_count;
    model->grid.free_count = shape.free_count;
    model->grid.slot_count = shape.slot_count;
    model->cells.large_count = shape.large_count;
    model->grid.far_value = shape.far_value;
    model->reference.far_value = shape.reference_far_value;
    model->cells.bounding_radius = shape.bounding_radius;
}

#endif
