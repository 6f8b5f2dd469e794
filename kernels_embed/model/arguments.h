/* arguments.h - the numbers that a run of a kernel is given besides the model, by kernel; the others take none. Lengths are
   voxels. */
#ifndef SPRINGLS__KERNEL_MODEL_ARGUMENTS_H
#define SPRINGLS__KERNEL_MODEL_ARGUMENTS_H

/* Names the numbers in the array COUNTS, which kernels find and the host reads later, several in one reading (launch.h). */
typedef enum springls__late_count {
    SPRINGLS__COUNT_OUTSIDE, /* of the cell list: springls outside active bricks */
    SPRINGLS__COUNT_RADIUS,  /* the largest bounding radius of those in cells, its bits */
    SPRINGLS__COUNT_UNBINNED,
    SPRINGLS__COUNT_BRICKS,  /* of bricks: those dropped, added, active and beyond the top table */
    SPRINGLS__COUNT_BRICKS_ADDED,
    SPRINGLS__COUNT_BRICKS_ACTIVE,
    SPRINGLS__COUNT_BRICKS_BEYOND,
    SPRINGLS__COUNT_NOW,     /* read at once */
    SPRINGLS__COUNT_LARGEST,
    SPRINGLS__COUNT_ABOVE_LIMIT,
    SPRINGLS__COUNT_TURNING,
    SPRINGLS__COUNT_TURNING_ABOVE_LIMIT, /* not used: comes with the one before it */
    SPRINGLS__COUNT_DISPLACEMENT,
    SPRINGLS__COUNT_DISPLACED,
    SPRINGLS__COUNT_OPPOSED,
    SPRINGLS__COUNT_OPPOSED_ASLEEP,
    SPRINGLS__COUNT_RESHAPED,
    SPRINGLS__COUNT_DEPARTED,
    SPRINGLS__COUNT_SPLITS,
    SPRINGLS__COUNTS
} springls__late_count;

typedef struct springls__contract_arguments { float min_angle_cosine, max_angle_cosine; } springls__contract_arguments;

/* split, split_store, insert_seeds, fill: how many springls may be added; the first ones wanted are. */
typedef struct springls__insert_arguments { int count; } springls__insert_arguments;

/* fit_new_springls: the number of the first new springl. */
typedef struct springls__fit_arguments { int first; } springls__fit_arguments;

/* write. first: number of the first springl; vertices, particles: 1 if the caller gives them. */
typedef struct springls__write_arguments { int first, vertices, particles; } springls__write_arguments;

/* cell_key. first: number of the first springl. */
typedef struct springls__cell_key_arguments { int first; } springls__cell_key_arguments;

/* asleep. listed: 1 where the keys of cells are up to date. */
typedef struct springls__asleep_arguments { int listed; } springls__asleep_arguments;

/* stir. first: number of the first springl; which: of those that stir (SPRINGLS__STIR_...). */
typedef struct springls__stir_arguments { int first, which; } springls__stir_arguments;

/* extent. side: 0 for the margin of the window, so many voxels; 1 to 6 for a side (springls__extent_element). */
typedef struct springls__extent_arguments { int side; float margin; } springls__extent_arguments;

/* relax, cover. kept: 1 where relaxed_springls has the springls that are asleep as they are. */
typedef struct springls__relax_arguments { int kept; } springls__relax_arguments;

/* neighbors. missing: 1 finds those of springls alone that slept when lists were built. */
typedef struct springls__neighbors_arguments { int missing; } springls__neighbors_arguments;

/* edge_candidate. search: 1 finds edges by their normals, 0 follows those of the last step. */
typedef struct springls__edge_arguments { int search; } springls__edge_arguments;

/* exposure: distance within which a springl covers a place, elsewhere and on thin sheets. */
typedef struct springls__exposure_arguments { float covered, covered_on_sheets; } springls__exposure_arguments;

/* omega_constant: omega in the two constant bricks. */
typedef struct springls__omega_constant_arguments { float outside, inside; } springls__omega_constant_arguments;

/* omega_forget. all: 1 forgets the omega of every brick. */
typedef struct springls__omega_forget_arguments { int all; } springls__omega_forget_arguments;

/* commit_simple_color: parities of x, y and z as bits 0, 1 and 2. */
typedef struct springls__color_arguments { int color; } springls__color_arguments;

/* overlap. No springl has come further than max_displacement since phi was last synced. */
typedef struct springls__overlap_arguments { float max_displacement; } springls__overlap_arguments;

/* project. carry: 1 moves phi along with the springls, of which none has come further than max_displacement. */
typedef struct springls__project_arguments { int carry; float max_displacement; } springls__project_arguments;

/* resolve_sides. min_sum: the least sum of neighbours' values that counts; first: 1 copies bricks without unknown sides, which
   later rounds find in both fields; last: 1 gives the old value to voxels that are left. */
typedef struct springls__resolve_arguments { float min_sum; int first, last; } springls__resolve_arguments;

/* grow_line: lines along `axis` of blocks of step^3 bricks; the flag of the first line is number `first_flag`. */
typedef struct springls__grow_line_arguments { int axis, step, first_flag; } springls__grow_line_arguments;

/* grow: width of the blocks, 4, 2 or 1. */
typedef struct springls__grow_arguments { int block; } springls__grow_arguments;

/* surface: triangles in all. */
typedef struct springls__surface_arguments { int triangles; } springls__surface_arguments;

/* Collectives over chunks of an array: `size` elements each, `count` in all, `chunks` of them. value: the byte to count; limit:
   floats above it are counted; place: in counts, of the result. */
typedef struct springls__chunk_arguments { int array, size, count, chunks, value, place; float limit; } springls__chunk_arguments;

/* bricks_begin. keep: 1 flags the bricks that are active. */
typedef struct springls__brick_flag_arguments { int keep; } springls__brick_flag_arguments;

/* bricks_add: chunks of the top table, and how many slots are free, and are there, before bricks take some. */
typedef struct springls__brick_add_arguments {
    springls__chunk_arguments chunk;
    int free_count, slot_count;
} springls__brick_add_arguments;

/* brick_lists_count, brick_lists_scatter: how far from a springl bricks list it. */
typedef struct springls__brick_list_arguments { float margin; } springls__brick_list_arguments;

typedef union springls__arguments {
    springls__contract_arguments contract;
    springls__insert_arguments insert;
    springls__fit_arguments fit;
    springls__write_arguments write;
    springls__cell_key_arguments cell_key;
    springls__asleep_arguments asleep;
    springls__stir_arguments stir;
    springls__extent_arguments extent;
    springls__relax_arguments relax;
    springls__neighbors_arguments neighbors;
    springls__edge_arguments edge;
    springls__exposure_arguments exposure;
    springls__omega_constant_arguments omega_constant;
    springls__omega_forget_arguments omega_forget;
    springls__color_arguments commit_simple;
    springls__overlap_arguments overlap;
    springls__project_arguments project;
    springls__resolve_arguments resolve;
    springls__grow_line_arguments grow_line;
    springls__grow_arguments grow;
    springls__surface_arguments surface;
    springls__chunk_arguments chunk;
    springls__brick_flag_arguments brick_flag;
    springls__brick_add_arguments brick_add;
    springls__brick_list_arguments brick_list;
} springls__arguments;

#endif
