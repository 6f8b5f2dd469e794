/* model.h - the model as kernels see it: its arrays, their sizes, the parameters. */
#ifndef SPRINGLS__KERNEL_MODEL_MODEL_H
#define SPRINGLS__KERNEL_MODEL_MODEL_H

#include "../interface/parameters.h"
#include "arguments.h"
#include "metric.h"
#include "scratch.h"
#include "../language/triangle.h"

#include "../language/width_float.h"
#include "springl_body.h"
#include "../language/width_simd.h"
#include "springl_body.h"

/* ---- the arrays of a model ----
   A row of a list makes the member, the memory on host and device, the kernel argument and the bit of an array:
   X(NAME, element type, elements that belong together, struct of the model, member). */

/* Lists what a springl has: every place that stores, copies or drops springls follows this list, snapshots in its order. */
#define SPRINGLS__SPRINGL_ARRAYS(X)                                                                                              \
    X(S, springls__springl, 1, set, s)              /* triangle and particle                                                  */ \
    X(A, springls__v3, 1, set, a)                   /* correspondence on the original surface                                 */ \
    X(ID, uint32_t, 1, set, id)                                                                                                  \
    X(GENERATION, uint32_t, 1, set, generation)     /* splits and fills since the original springl                            */ \
    X(MASK, uint8_t, 1, set, mask)                  /* 1: is kept (springls_set_keep_mask)                                    */ \
    X(COMPONENT, uint32_t, 1, set, component)       /* id of its body when components were last found; 0: none                */ \
    X(CAVITY, uint32_t, 1, set, cavity)             /* id of the cavity that it bounds; 0: none                               */ \
    X(CONTACT_BODY, uint32_t, 1, set, contact_body) /* stays two on contact (params.contact); 0: not found yet                */ \
    X(OVERLAPPED, uint8_t, 1, set, overlapped)      /* 1: lay in another body when phi last followed (overlap.h)              */ \
    X(EDGE, uint8_t, 1, set, edge)                  /* 1: lay at a sharp edge in the last step (keep_edges.h)                 */ \
    X(ERROR, float, 1, set, error)                  /* of the correspondence, voxels: an estimate (error_estimates.h)         */ \
    X(PARENT, uint32_t, 1, set, parent)             /* id of the springl it was split from or filled beside; its own: none    */ \
    X(BIRTH, uint32_t, 1, set, birth)               /* 4 * step + kind: when and how it was last placed                       */ \
    X(PHI_AT, float, 1, set, phi)                   /* phi at p when phi was last synced with it (phi_n of eq. 27)            */ \
    X(SYNCED_POSITION, springls__v3, 1, set, synced_position) /* p when phi was last synced with it                           */

/* Lists what a grid has for each slot. */
#define SPRINGLS__SLOT_ARRAYS(X)                                                                                                 \
    X(SLOT_BRICK, int, 1, grid, slot_brick)         /* slot -> brick; -1: free or constant                                    */ \
    X(ACTIVE, int, 1, grid, active)                 /* slots in use by ascending brick: the order of every loop over bricks   */ \
    X(FREE_SLOTS, int, 1, grid, free_slots)                                                                                      \
    X(PHI, float, SPRINGLS__BRICK_VOXELS, grid, phi)                                                                             \
    X(PHI_NEXT, float, SPRINGLS__BRICK_VOXELS, grid, phi_next)                                                                   \
    X(CALM, uint8_t, SPRINGLS__OCTANTS, grid, calm) /* steps since a springl in the octant has stirred, to a limit (sleep.h)  */ \
    X(AWAKE, uint8_t, 1, grid, awake)               /* 1: in or around the brick springls have stirred lately (sleep.h)       */ \
    X(NEAR_AWAKE, uint8_t, 1, grid, near_awake)     /* 1: the brick or one around it is awake                                 */ \
    X(OMEGA, float, SPRINGLS__BRICK_VOXELS, grid, omega) /* distance to the springls, clamped (capture_range); < 0: unknown */   \
    X(CELL, uint32_t, SPRINGLS__CELLS, grid, cell)  /* springls of cell c: cells.ids[cell[c]] .. cells.ids[cell[c + 1] - 1]   */

/* Lists what a grid has. */
#define SPRINGLS__GRID_ARRAYS(X)                                                                                                 \
    X(TOP, int, 1, grid, top)                       /* entry of the top table -> slot                                         */ \
    X(PLANE, int, 1, grid, plane)                   /* of the top table: see springls__entry_at                               */ \
    SPRINGLS__SLOT_ARRAYS(X)

/* Lists what is found for the springls when it is needed: one element a springl, then lists of their own length. */
#define SPRINGLS__SEARCH_ARRAYS(X)                                                                                               \
    X(IDS, uint32_t, 1, cells, ids)                 /* springls by cell, ascending within a cell                              */ \
    X(KEY, uint32_t, 1, cells, key)                 /* the cell of each springl, counted through all slots                    */ \
    X(NEIGHBORS, int, SPRINGLS__NEIGHBOR_ROW, cells, neighbors) /* the nearest edges of its vertices (neighbors.h)            */ \
    X(ASLEEP, uint8_t, 1, cells, asleep)            /* 0: awake, when that was last found (sleep.h); 2: passed over by an edit */
#define SPRINGLS__LIST_ARRAYS(X)                                                                                                 \
    X(PLACES, float, 3, cells, places)              /* particles in the order of ids, in blocks: eight x, eight y, eight z    */ \
    X(BRICK_LIST_FIRST, uint32_t, 1, cells, brick_list_first) /* list of active brick i: [i] .. [i + 1] - 1 of brick_list_ids */ \
    X(BRICK_LIST_IDS, uint32_t, 1, cells, brick_list_ids)                                                                        \
    X(UNBINNED, uint32_t, 1, cells, unbinned)       /* springls in no cell: too large, or outside all active bricks           */

/* Lists the arrays that forces (advect.h) and springls_write (write.h) send to a device. */
#define SPRINGLS__FORCE_ARRAYS(X)                                                                                                \
    X(FORCE_RULE, struct springls__force_rule, 1, force, rule) X(FORCE_PRESSURE, float, 1, force, pressure)                      \
    X(FORCE_VELOCITY, float, 1, force, velocity) X(FORCE_USER, float, 1, force, user)                                            \
    X(WRITTEN_VERTICES, springls__v3, 1, force, written_vertices) X(WRITTEN_PARTICLES, springls__v3, 1, force, written_particles)

/* Lists the working memory of stages, which is undefined between them: scratch, and what collectives on a device use. */
#define SPRINGLS__SCRATCH_ARRAYS(X)                                                                                              \
    X(SCRATCH0, uint8_t, 1, work, scratch[0]) X(SCRATCH1, uint8_t, 1, work, scratch[1])                                          \
    X(SCRATCH2, uint8_t, 1, work, scratch[2]) X(SCRATCH3, uint8_t, 1, work, scratch[3])                                          \
    X(SCRATCH4, uint8_t, 1, work, scratch[4]) X(SCRATCH5, uint8_t, 1, work, scratch[5])                                          \
    X(SCRATCH6, uint8_t, 1, work, scratch[6]) X(SCRATCH7, uint8_t, 1, work, scratch[7])
#define SPRINGLS__DEVICE_ARRAYS(X)                                                                                               \
    X(COUNTS, uint32_t, 1, work, counts)            /* of a collective                                                        */ \
    X(SUMS, uint32_t, 1, work, sums)                /* counts of each chunk of a collective                                   */ \
    X(BRICK_FLAG, uint8_t, 1, work, brick_flag)     /* 1: the brick is to be active                                           */ \
    X(NEW_SLOTS, int, 1, work, new_slots)           /* slots of the bricks that were added                                    */ \
    X(SPARE, springls__record, 1, work, spare)      /* springls between their old and new places                              */

/* Lists all arrays. */
#define SPRINGLS__ARRAYS(X)                                                                                                      \
    SPRINGLS__SPRINGL_ARRAYS(X) SPRINGLS__GRID_ARRAYS(X)                                                                         \
    X(REFERENCE_TOP, int, 1, reference, top) X(REFERENCE_PLANE, int, 1, reference, plane)                                        \
    X(REFERENCE_PHI, float, SPRINGLS__BRICK_VOXELS, reference, phi)                                                              \
    SPRINGLS__SEARCH_ARRAYS(X) SPRINGLS__LIST_ARRAYS(X) SPRINGLS__SCRATCH_ARRAYS(X) SPRINGLS__FORCE_ARRAYS(X)                    \
    SPRINGLS__DEVICE_ARRAYS(X)

typedef enum springls__array {
#define SPRINGLS__ARRAY_NUMBER(name, type, block, owner, member) SPRINGLS__ARRAY_##name,
    SPRINGLS__ARRAYS(SPRINGLS__ARRAY_NUMBER)
#undef SPRINGLS__ARRAY_NUMBER
    SPRINGLS__ARRAY_COUNT
} springls__array;

/* Where the arrays of a model are in a device's memory: multiples of SPRINGLS__PLACE_BYTES, which suits every type and reaches
   2 TiB. */
#define SPRINGLS__PLACE_BYTES 512
typedef struct springls__places { uint32_t at[SPRINGLS__ARRAY_COUNT]; } springls__places;

#define SPRINGLS__ARRAY_MEMBER(name, type, block, owner, member) SPRINGLS__GLOBAL type *member;

/* ---- the structs of a model ---- */

/* The constellation: arrays of `count` elements each. */
typedef struct springls__constellation {
    SPRINGLS__SPRINGL_ARRAYS(SPRINGLS__ARRAY_MEMBER)
    int count, at_edges;    /* at_edges: how many lie at a sharp edge   */
    uint32_t next_id, step; /* step: of the model, modulo 2^30          */
} springls__constellation;

/* All of one springl. */
typedef struct springls__record {
#define SPRINGLS__RECORD_MEMBER(name, type, block, owner, member) type member;
    SPRINGLS__SPRINGL_ARRAYS(SPRINGLS__RECORD_MEMBER)
#undef SPRINGLS__RECORD_MEMBER
} springls__record;

/* Names the kinds of springls: springls_kind of the interface. */
#define SPRINGLS__KIND_ORIGINAL 0u
#define SPRINGLS__KIND_SPLIT 1u
#define SPRINGLS__KIND_FILLED 2u

/* Names what is done with a springl, or with a seed of one. */
#define SPRINGLS__REMOVE 0
#define SPRINGLS__KEEP 1
#define SPRINGLS__RESHAPE 2
#define SPRINGLS__UNDECIDED 3

/* The sparse grid: bricks of 8x8x8 voxels in a pool of slots, found through a top table. Slots 0 and 1 are constant bricks, far
   outside and far inside, so that every brick of the top table can be read without a test. Bricks are numbered through the whole
   domain, x fastest; the top table has entries where there may be something only (top_table.h). */
#define SPRINGLS__BRICK 8
#define SPRINGLS__BRICK_VOXELS 512
#define SPRINGLS__OCTANTS 8 /* of 4^3 voxels */
#define SPRINGLS__OUTSIDE 0
#define SPRINGLS__INSIDE 1
#define SPRINGLS__FIRST_SLOT 2
#define SPRINGLS__CELL 2   /* voxels: width of a cell of springls                          */
#define SPRINGLS__CELLS 65 /* 64 cells a brick, and where the next brick begins          */

/* The bricks that a top table has: a box of them, less what is left out. Bricks at places 4 k to 4 k + 3 along an axis are a
   group; a group is kept when some brick in it, or beside it, is not outside. Each place in a kept group has a plane of entries,
   and each run of places between kept groups has one plane for all of them, which is outside. So the planes beside that of an
   active brick are its neighbors', and bodies far apart cost no more than near to each other. All bricks beyond the box are
   outside, and so are its outermost ones, except at the border of the domain: reading beyond it is reading its nearest brick. */
#define SPRINGLS__GROUP_WORDS 4 /* of 32 groups each: the domain has up to 512 bricks along an axis */
#define SPRINGLS__MOST_PLANES 512

/* The words of each axis, one after the other. */
typedef struct springls__brick_groups { uint32_t kept[3 * SPRINGLS__GROUP_WORDS]; } springls__brick_groups;

typedef struct springls__table {
    int lower[3], upper[3]; /* the first voxel, and the first one beyond, along each axis           */
    int bricks[3];          /* planes                                                               */
    springls__brick_groups groups;
} springls__table;

typedef struct springls__grid {
    int size[3];            /* voxels                                                                */
    int bricks[3];          /* of the domain                                                         */
    springls__table table;
    SPRINGLS__GRID_ARRAYS(SPRINGLS__ARRAY_MEMBER)
    int active_count, free_count, slot_count;
    float far_value;        /* |phi| in the constant bricks and the clamp everywhere                 */
    int some_asleep;        /* 0: all bricks are awake                                               */
    int phi_kept;           /* 1: phi_next has phi in the bricks that are asleep                     */
    springls__metric metric;
} springls__grid;

/* Lists of springls: by the cell of their particle (cell_list.h), by brick they come near, by vertex they are near to. */
typedef struct springls__cell_list {
    SPRINGLS__SEARCH_ARRAYS(SPRINGLS__ARRAY_MEMBER)
    SPRINGLS__LIST_ARRAYS(SPRINGLS__ARRAY_MEMBER)
    float bounding_radius;  /* the largest of the springls that are in cells                         */
    int unbinned_count;        /* springls in no cell                                                   */
    int asleep_count;       /* springls that `asleep` is of: later ones are awake                    */
} springls__cell_list;

/* Forces that kernels evaluate by themselves (advect.h). */
struct springls__force_rule;
typedef struct springls__force_arrays { SPRINGLS__FORCE_ARRAYS(SPRINGLS__ARRAY_MEMBER) } springls__force_arrays;

typedef struct springls__work_arrays {
    SPRINGLS__GLOBAL void *scratch[8];
    SPRINGLS__DEVICE_ARRAYS(SPRINGLS__ARRAY_MEMBER)
} springls__work_arrays;

/* The work items that share a brick: item `item` of `items` does rows item, item + items, ... of its 64. The host has one. */
#define SPRINGLS__ROWS 64

typedef struct springls__group { int item, items; } springls__group;

SPRINGLS__MATHS springls__group springls__alone(void)
{
    springls__group group;
    group.item = 0;
    group.items = 1;
    return group;
}

/* Returns whether a row is this item's; one alone does not divide, which takes long. */
SPRINGLS__MATHS bool springls__is_mine(springls__group group, int row)
{
    return group.items == 1 || row % group.items == group.item;
}

typedef struct springls__model {
    springls__constellation set;
    springls__grid grid;
    springls__grid reference;      /* phi_ref: top table and phi only                                       */
    springls__cell_list cells;
    springls__force_arrays force;  /* what moves the springls where no callback does                        */
    springls__work_arrays work;
    springls__group group;
    springls_params params;
} springls__model;

/* Makes the accessor of a role: its elements in working memory (scratch.h). */
#define SPRINGLS__ROLE_ACCESSOR(role, type, number)                                                                              \
    SPRINGLS__MATHS SPRINGLS__GLOBAL type *springls__##role(const springls__model *model)                                        \
    {                                                                                                                            \
        return (SPRINGLS__GLOBAL type *)model->work.scratch[number];                                                             \
    }
SPRINGLS__KERNEL_ROLES(SPRINGLS__ROLE_ACCESSOR)

#define SPRINGLS__LARGEST_SPECK 64 /* voxels of a part of phi: larger ones are not looked for          */
#define SPRINGLS__MAX_NEIGHBORS 8  /* edges a vertex: the paper's limit, and a register of eight lanes */
#define SPRINGLS__NEIGHBOR_ROW 24  /* edges a springl, of its three vertices                           */

SPRINGLS__MATHS springls__springl springls__springl_make(springls__tri t, springls__v3 p)
{
    springls__springl s;
    s.q[0] = t.a; s.q[1] = t.b; s.q[2] = t.c;
    s.p = p;
    s.inverse_edge2[0] = s.inverse_edge2[1] = s.inverse_edge2[2] = s.bounding_radius = 0.0f;
    return springls__springl_finished(s);
}

/* Returns the springl moved so that its particle is at p. */
SPRINGLS__MATHS springls__springl springls__moved_to(springls__springl s, springls__v3 p)
{
    int m;
    for (m = 0; m < 3; m++) s.q[m] = springls__add(s.q[m], springls__sub(p, s.p));
    s.p = p;
    return s;
}

SPRINGLS__MATHS springls__tri springls__springl_tri(springls__springl s)
{
    springls__tri t;
    t.a = s.q[0]; t.b = s.q[1]; t.c = s.q[2];
    return t;
}

SPRINGLS__INNER springls__v3 springls__springl_normal(springls__springl s)
{
    return springls__tri_normal(springls__springl_tri(s));
}

/* Returns s with its triangle turned round: the normal points the other way. */
SPRINGLS__MATHS springls__springl springls__reversed(springls__springl s)
{
    springls__v3 q = s.q[1];
    s.q[1] = s.q[2];
    s.q[2] = q;
    return springls__springl_finished(s);
}

/* Returns true when springl i lies at a sharp edge that is to be kept. */
SPRINGLS__MATHS bool springls__at_edge(const springls__model *model, int i)
{
    return model->params.keep_edges && model->set.edge[i];
}

SPRINGLS__MATHS uint32_t springls__birth_of(const springls__model *model, uint32_t kind) { return 4u * model->set.step + kind; }

SPRINGLS__MATHS springls__record springls__record_load(const springls__model *model, int i)
{
    springls__record record;
#define SPRINGLS__LOAD_MEMBER(name, type, block, owner, member) record.member = model->owner.member[i];
    SPRINGLS__SPRINGL_ARRAYS(SPRINGLS__LOAD_MEMBER)
#undef SPRINGLS__LOAD_MEMBER
    return record;
}

SPRINGLS__MATHS void springls__record_store(const springls__model *model, int i, springls__record record)
{
#define SPRINGLS__STORE_MEMBER(name, type, block, owner, member) model->owner.member[i] = record.member;
    SPRINGLS__SPRINGL_ARRAYS(SPRINGLS__STORE_MEMBER)
#undef SPRINGLS__STORE_MEMBER
}

/* Begins springl i anew, without a parent and components; its id follows from its place, at or beyond `count`. */
SPRINGLS__MATHS void springls__record_renew(const springls__model *model, int i, springls__record *record)
{
    record->id = record->parent = model->set.next_id + (uint32_t)(i - model->set.count);
    record->component = record->cavity = record->contact_body = 0u;
    record->overlapped = 0;
    record->phi = record->error = 0.0f;
    record->synced_position = record->s.p;
}

/* Gives springl i the components and the body of springl `from`, beside which it is new. */
SPRINGLS__MATHS void springls__inherit_components(const springls__model *model, int i, int from)
{
    model->set.component[i] = model->set.component[from];
    model->set.cavity[i] = model->set.cavity[from];
    model->set.contact_body[i] = model->set.contact_body[from];
}

/* Returns true when two springls are of bodies that stay two. */
SPRINGLS__MATHS bool springls__of_two_contact_bodies(const springls__model *model, int i, int other)
{
    uint32_t a = model->set.contact_body[i], b = model->set.contact_body[other];
    return model->params.contact == SPRINGLS_CONTACT_SEPARATE && a != b && a != 0u && b != 0u;
}

/* Returns true when springl i lies in another body: it is no part of the surface that phi has. */
SPRINGLS__MATHS bool springls__is_overlapped(const springls__model *model, int i)
{
    return model->params.contact == SPRINGLS_CONTACT_SEPARATE && model->set.overlapped[i];
}

/* Stores a new springl in place i, at or beyond `count`. */
SPRINGLS__MATHS void springls__springl_add(const springls__model *model, int i, springls__springl s, springls__v3 a,
                                           uint32_t generation, uint8_t mask)
{
    springls__record record;
    record.s = s;
    record.a = a;
    record.generation = generation;
    record.mask = mask;
    record.edge = 0;
    record.birth = springls__birth_of(model, generation ? SPRINGLS__KIND_FILLED : SPRINGLS__KIND_ORIGINAL);
    springls__record_renew(model, i, &record);
    springls__record_store(model, i, record);
}

/* Finds the squared displacement of particle i since phi was last synced with it, voxel^2. */
SPRINGLS__MATHS void springls__displacement_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__synced_distance2(model)[i] = springls__length2(springls__sub(model->set.s[i].p, model->set.synced_position[i]));
}

/* Lists the numbers of a model that kernels are given besides its arrays: X(type, name, place in the model). */
#define SPRINGLS__MODEL_NUMBERS(X)                                                                                               \
    X(int, springls, set.count) X(int, at_edges, set.at_edges) X(uint32_t, next_id, set.next_id) X(uint32_t, step, set.step)     \
    X(int, active_count, grid.active_count) X(int, free_count, grid.free_count) X(int, slot_count, grid.slot_count)              \
    X(int, unbinned_count, cells.unbinned_count) X(float, bounding_radius, cells.bounding_radius)                                \
    X(int, some_asleep, grid.some_asleep) X(int, phi_kept, grid.phi_kept) X(int, asleep_count, cells.asleep_count)                \
    X(float, far_value, grid.far_value) X(float, reference_far_value, reference.far_value)                                       \
    X(springls__metric, metric, grid.metric)

typedef struct springls__shape {
    int size[3], bricks[3];
    springls__table table, reference_table;
#define SPRINGLS__NUMBER_MEMBER(type, name, place) type name;
    SPRINGLS__MODEL_NUMBERS(SPRINGLS__NUMBER_MEMBER)
#undef SPRINGLS__NUMBER_MEMBER
} springls__shape;

SPRINGLS__MATHS springls__shape springls__shape_of(const springls__model *model)
{
    springls__shape shape;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        shape.size[axis] = model->grid.size[axis];
        shape.bricks[axis] = model->grid.bricks[axis];
    }
    shape.table = model->grid.table;
    shape.reference_table = model->reference.table;
#define SPRINGLS__READ_NUMBER(type, name, place) shape.name = model->place;
    SPRINGLS__MODEL_NUMBERS(SPRINGLS__READ_NUMBER)
#undef SPRINGLS__READ_NUMBER
    return shape;
}

SPRINGLS__MATHS void springls__shape_set(springls__model *model, springls__shape shape)
{
    int axis;
    for (axis = 0; axis < 3; axis++) {
        model->grid.size[axis] = model->reference.size[axis] = shape.size[axis];
        model->grid.bricks[axis] = model->reference.bricks[axis] = shape.bricks[axis];
    }
    model->grid.table = shape.table;
    model->reference.table = shape.reference_table;
#define SPRINGLS__WRITE_NUMBER(type, name, place) model->place = shape.name;
    SPRINGLS__MODEL_NUMBERS(SPRINGLS__WRITE_NUMBER)
#undef SPRINGLS__WRITE_NUMBER
}

#endif
