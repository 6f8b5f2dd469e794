/* combined_originals.h - makes the original surface, and the reference level set, of two models that are combined. */
#ifndef SPRINGLS__TOOLS_COMBINED_ORIGINALS_H
#define SPRINGLS__TOOLS_COMBINED_ORIGINALS_H

#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../model/bvh_join.h"
#include "../model/closest_point.h"
#include "../model/grid.h"
#include "cell_marks.h"

/* ---- reference level sets ---- */

/* Returns the values of a grid in the brick that another grid, of the same domain, has an entry for. */
SPRINGLS__FN const float *springls__phi_of_entry(const springls__grid *grid, const springls__grid *g, int entry)
{
    return grid->phi + (size_t)springls__slot_of_brick(grid, springls__brick_of_entry(g, entry)) * SPRINGLS__BRICK_VOXELS;
}

/* Two references, and the one that is made of both: its grid has its own planes, top table and phi. */
typedef struct springls__both_references {
    const springls__grid *first, *second;
    springls__grid grid;
    springls__buffer plane, top, phi;
    bool taken;             /* the model has it, and these buffers are what it had before */
} springls__both_references;

/* Gives the bricks with voxels of either reference new slots, and the constant ones the side of the first. Returns the number of
   slots. */
SPRINGLS__FN int springls__number_references(springls__both_references *both)
{
    int slot_count = SPRINGLS__FIRST_SLOT, i, entries = (int)springls__entry_count(&both->grid);
    for (i = 0; i < entries; i++) {
        const int brick = springls__brick_of_entry(&both->grid, i);
        const int a = springls__slot_of_brick(both->first, brick), b = springls__slot_of_brick(both->second, brick);
        both->grid.top[i] = a < SPRINGLS__FIRST_SLOT && b < SPRINGLS__FIRST_SLOT ? a : slot_count++;
    }
    return slot_count;
}

/* Writes the reference level set of the result at the entries begin <= i < end. Of the two originals' values takes that of smaller size,
   because tracking uses phi_ref as a distance and not its sign; within a voxel of where the originals cross it is less exact. */
SPRINGLS__FN void springls__merge_references_work(void *arg, int begin, int end, float *memory)
{
    const springls__both_references *both = (const springls__both_references *)arg;
    const springls__grid *g = &both->grid;
    const bool far_alike = both->first->far_value == both->second->far_value;
    int v;
    (void)memory;
    for (; begin < end; begin++) {
        const float *a = springls__phi_of_entry(both->first, g, begin), *b = springls__phi_of_entry(both->second, g, begin);
        float *out = g->phi + (size_t)g->top[begin] * SPRINGLS__BRICK_VOXELS;
        if (g->top[begin] < SPRINGLS__FIRST_SLOT) continue;
        if (far_alike && springls__slot_of_brick(both->second, springls__brick_of_entry(g, begin)) < SPRINGLS__FIRST_SLOT) {
            memcpy(out, a, SPRINGLS__BRICK_VOXELS * sizeof *out); /* the second is as far away as can be: mostly, where it is a tool */
            continue;
        }
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) out[v] = springls__fabs(a[v]) <= springls__fabs(b[v]) ? a[v] : b[v];
    }
}

/* Exchanges a buffer of the model with another. */
SPRINGLS__FN void springls__exchange_memory(springls_context *ctx, springls__array array, springls__buffer *with)
{
    springls__buffer *memory = &ctx->memory[array];
    const springls__buffer before = *memory;
    memory->data = with->data;
    memory->bytes = with->bytes;
    with->data = before.data;
    with->bytes = before.bytes;
}

/* Makes the memory of the reference that is made of both, and numbers its bricks. */
SPRINGLS__FN springls_status springls__reserve_references(springls_context *ctx, springls__both_references *both)
{
    springls__grid *g = &both->grid;
    springls__brick_groups groups = springls__no_groups();
    springls__table table;
    springls__keep_grid(both->first, &groups, springls__unmoved);
    springls__keep_grid(both->second, &groups, springls__unmoved);
    table = springls__table_of(both->first, &groups);
    SPRINGLS__TRY(springls__buffer_grow(ctx, &both->plane, 6 * SPRINGLS__MOST_PLANES, sizeof *g->plane, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &both->top, springls__entries_of(&table), sizeof *g->top, 0));
    g->plane = (int *)both->plane.data;
    g->top = (int *)both->top.data;
    springls__take_table(g, &table);
    g->slot_count = springls__number_references(both);
    SPRINGLS__TRY(springls__buffer_grow(ctx, &both->phi, (size_t)g->slot_count * SPRINGLS__BRICK_VOXELS, sizeof(float), 0));
    g->phi = (float *)both->phi.data;
    return SPRINGLS_OK;
}

/* Exchanges the reference level set of the model with that which is made of both, or back. */
SPRINGLS__FN void springls__exchange_references(springls_context *ctx, springls__both_references *both)
{
    springls__grid *g = &ctx->model.reference;
    const springls__grid before = *g;
    g->table = both->grid.table;
    g->slot_count = both->grid.slot_count;
    both->grid.table = before.table;
    both->grid.slot_count = before.slot_count;
    springls__exchange_memory(ctx, SPRINGLS__ARRAY_REFERENCE_PLANE, &both->plane);
    springls__exchange_memory(ctx, SPRINGLS__ARRAY_REFERENCE_TOP, &both->top);
    springls__exchange_memory(ctx, SPRINGLS__ARRAY_REFERENCE_PHI, &both->phi);
    both->taken = !both->taken;
    springls__bind(ctx);
}

SPRINGLS__FN void springls__references_free(springls_context *ctx, springls__both_references *both)
{
    springls__buffer_free(ctx, &both->plane);
    springls__buffer_free(ctx, &both->top);
    springls__buffer_free(ctx, &both->phi);
}

/* ---- original surfaces ---- */

/* The original surface of both models: that of the other is joined to the first. Now and then it is made anew, without the triangles that
   no springl has its correspondence on or near, among those of the same tool: of parts that combinations have cut away. So it has at most
   so many triangles as lie near the correspondences of the springls that there are, however many tools there have been. The others keep
   their numbers in the caller's meshes. */
typedef struct springls__both_originals {
    const springls_context *model; /* that of the first                                                */
    const springls__surface *other;
    springls__surface before;      /* the first, as it was                                             */
    springls__surface made;        /* made anew; where the model has taken it, what it had before      */
    springls__surface *to;         /* the one that triangles are copied to: made, or the model's own   */
    springls__cell_marks marks;    /* where triangles may go: where correspondences on a tool are      */
    springls__buffer first, beside; /* the first springl of each tool, and of each springl the next: -1: none */
    int tool;                      /* how many tools have been begun                                   */
    springls__buffer items;        /* of the builders                                                  */
    springls__buffer number;       /* where it is made anew: the new number of each triangle of the first; -1: it goes */
    int next, count;               /* the triangle, of both together, to be copied next; those that are there */
    springls__bvh_copy copy[2];    /* of the hierarchies of the first, where it is made anew, and of the other */
    int copying;                   /* which of them; 2: both are there                                 */
    bool turn;                     /* the triangles of the other                                       */
    bool drops, joined, taken;
} springls__both_originals;

/* After every so many triangles that combinations have added, or about as many as there are springls, those without use are dropped: what
   that costs goes with the model, and many combinations share it. */
enum { SPRINGLS__ORIGINALS_PERIOD = 16384 };

/* Returns true when unused triangles of the original surface of so many springls are to be dropped as another one is added. */
SPRINGLS__FN bool springls__drops_originals(const springls__surface *own, const springls__surface *other, int springls)
{
    int period = SPRINGLS__ORIGINALS_PERIOD;
    while (period <= springls / 2) period *= 2;
    return own->count > 0 && own->given / period < (own->given + other->given) / period;
}

/* Begins to add the other model's original surface to this model's. turn: turns its triangles. */
SPRINGLS__FN springls_status springls__originals_begin(springls_context *ctx, springls__both_originals *both,
                                                       const springls__surface *other, bool turn)
{
    springls__surface *own = &ctx->original;
    if ((int64_t)own->given + other->given > INT32_MAX / 6) /* a source is 2 * triangle + turned */
        return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "combine: the original surfaces have too many triangles");
    both->model = ctx;
    both->other = other;
    both->turn = turn;
    both->drops = springls__drops_originals(own, other, ctx->model.set.count);
    both->to = both->drops ? &both->made : own;
    both->next = both->count = both->to == own ? own->count : 0;
    if (!both->drops) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &both->first, (size_t)own->joints + 1, sizeof(int), 0));
    return springls__buffer_grow(ctx, &both->beside, (size_t)ctx->model.set.count + 1, sizeof(int), 0);
}

/* Finds the tools that the correspondences of springls lie on: `beside` has them. */
SPRINGLS__FN void springls__find_tools_work(void *arg, int begin, int end, float *memory)
{
    const springls__both_originals *both = (const springls__both_originals *)arg;
    const float on_surface = 0.05f; /* voxel: most are nearer, and are found faster so */
    const springls__surface *own = &both->model->original;
    int *tool = (int *)both->beside.data, triangle;
    (void)memory;
    for (; begin < end; begin++) {
        const springls__v3 a = both->model->model.set.a[begin];
        triangle = springls__surface_closest(own, a, on_surface).triangle;
        if (triangle < 0) triangle = springls__surface_closest(own, a, FLT_MAX).triangle;
        tool[begin] = springls__tool_of(own, triangle);
    }
}

/* Chains the springls of each tool. */
SPRINGLS__FN void springls__chain_tools(springls__both_originals *both)
{
    int *first = (int *)both->first.data, *beside = (int *)both->beside.data, i;
    for (i = 0; i <= both->model->original.joints; i++) first[i] = -1;
    for (i = 0; i < both->model->model.set.count; i++) {
        const int tool = beside[i];
        beside[i] = first[tool];
        first[tool] = i;
    }
}

/* Begins with the triangles of the next tool: marks the cells that correspondences on it are near. */
SPRINGLS__FN springls_status springls__begin_tool(springls_context *ctx, springls__both_originals *both)
{
    const float margin = 1.0f; /* voxel: a new springl's correspondence lies between those around it */
    const springls__surface *own = &ctx->original;
    const int end = springls__tool_begin(own, both->tool + 1);
    springls__box box = springls__box_empty();
    int i;
    for (i = 3 * both->next; i < 3 * end; i++) box = springls__box_add(box, own->points[i]);
    SPRINGLS__TRY(springls__cell_marks_begin(ctx, &both->marks, box.lower, box.upper, 1.0f));
    for (i = ((const int *)both->first.data)[both->tool]; i >= 0; i = ((const int *)both->beside.data)[i])
        springls__mark_cells_around(&both->marks, ctx->model.set.a[i], margin);
    both->tool++;
    return SPRINGLS_OK;
}

/* Notes that the triangles from `first` on are of another tool than those before, if there are any. */
SPRINGLS__FN void springls__add_joint(springls__surface *to, int first)
{
    if (first > (to->joints ? to->joint[to->joints - 1] : 0)) to->joint[to->joints++] = first;
}

/* Makes room for where the triangles of both come from. */
SPRINGLS__FN springls_status springls__sources_room(springls_context *ctx, springls__both_originals *both)
{
    springls__surface *to = both->to;
    const size_t count = (size_t)both->count, all = (size_t)ctx->original.count + (size_t)both->other->count + 1;
    int i;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &to->source_memory, all, sizeof(int), to->source ? count * sizeof(int) : 0));
    if (to->source) to->source = (int *)to->source_memory.data;
    else
        for (i = 0; i < both->count; i++) ((int *)to->source_memory.data)[i] = 2 * i;
    SPRINGLS__TRY(springls__joints_room(ctx, to, ctx->original.joints + 1 + both->other->joints));
    return springls__buffer_grow(ctx, &both->number, both->drops ? all : 1, sizeof(int), 0);
}

/* Makes room for the hierarchy of both. */
SPRINGLS__FN springls_status springls__hierarchy_room(springls_context *ctx, springls__both_originals *both)
{
    const springls__bvh_node *root;
    const size_t all = (size_t)ctx->original.count + (size_t)both->other->count + 1;
    const size_t parts = (size_t)springls__bvh_parts(&ctx->original, &root) + (size_t)springls__bvh_parts(both->other, &root);
    SPRINGLS__TRY(springls__buffer_grow(ctx, &both->items, parts + 1, sizeof(springls__bvh_item), 0));
    return springls__parts_room(ctx, both->to, &ctx->original, both->other, all, (size_t)both->count);
}

/* Copies triangle i of `from`, which were given after so many others. */
SPRINGLS__FN void springls__copy_original(springls__both_originals *both, const springls__surface *from, int i, int given_before, bool turn)
{
    springls__v3 *points = both->to->points + 3 * both->count;
    int k;
    for (k = 0; k < 3; k++) points[k] = from->points[3 * i + (turn && k ? 3 - k : k)];
    ((int *)both->to->source_memory.data)[both->count++] = ((from->source ? from->source[i] : 2 * i) ^ (int)turn) + 2 * given_before;
}

/* Returns whether a correspondence may be on triangle i of this model's original surface. */
SPRINGLS__FN bool springls__is_original_used(const springls__both_originals *both, const springls__surface *own, int i)
{
    springls__box box = springls__box_empty();
    int k;
    for (k = 0; k < 3; k++) box = springls__box_add(box, own->points[3 * i + k]);
    return springls__visit_cells(&both->marks, box.lower, box.upper, false);
}

/* Copies some triangles. */
SPRINGLS__FN springls_status springls__copy_some_originals(springls_context *ctx, springls__both_originals *both, int most)
{
    const springls__surface *own = &ctx->original;
    const int count = own->count, end = springls__imin(both->next + most, count + both->other->count);
    int *number = (int *)both->number.data;
    for (; both->next < end; both->next++)
        if (both->next >= count) {
            springls__copy_original(both, both->other, both->next - count, own->given, both->turn);
        } else {
            if (both->next == springls__tool_begin(own, both->tool)) {
                SPRINGLS__TRY(springls__begin_tool(ctx, both));
                springls__add_joint(both->to, both->count);
            }
            number[both->next] = -1;
            if (!springls__is_original_used(both, own, both->next)) continue;
            number[both->next] = both->count;
            springls__copy_original(both, own, both->next, 0, false);
        }
    return SPRINGLS_OK;
}

/* Begins to copy the hierarchies. To those of the model itself they are added behind the rest, in which meanwhile all is found as before:
   so the nodes that join the parts make way. */
SPRINGLS__FN void springls__hierarchy_begin(springls_context *ctx, springls__both_originals *both)
{
    springls__surface *to = both->to;
    both->before = ctx->original;
    both->joined = !both->drops;
    both->copying = both->drops ? 0 : 1;
    memset(both->copy, 0, sizeof both->copy);
    both->copy[0].from = &ctx->original;
    both->copy[1].from = both->other;
    both->copy[0].to = both->copy[1].to = to;
    both->copy[0].number = (const int *)both->number.data;
    both->copy[1].shift = both->count - both->other->count;
    both->copy[1].placed = to->count;
    springls__bvh_make_parts(to);
    if (both->joined) springls__bvh_hang(to, (springls__bvh_item *)both->items.data, to->node_count + both->other->node_count);
}

/* Returns true while hierarchies are to be copied. */
SPRINGLS__FN bool springls__has_part_to_copy(const springls__both_originals *both) { return both->copying < 2; }

/* Copies some nodes of them. */
SPRINGLS__FN void springls__copy_some_parts(springls__both_originals *both, int most)
{
    if (springls__bvh_copy_some(&both->copy[both->copying], most)) return;
    if (both->copying == 0) both->copy[1].placed = both->copy[0].placed;
    both->copying++;
}

/* Hangs the parts of both below one root. */
SPRINGLS__FN void springls__hierarchy_end(springls_context *ctx, springls__both_originals *both)
{
    springls__surface *to = both->to;
    const int first = both->count - both->other->count;
    int i;
    springls__add_joint(to, first);
    for (i = 0; i < both->other->joints; i++) springls__add_joint(to, first + both->other->joint[i]);
    to->source = (int *)to->source_memory.data;
    to->given = ctx->original.given + both->other->given;
    to->count = both->count;
    if (to->joints && to->joint[to->joints - 1] == to->count) to->joints--; /* none of that tool are there */
    to->dipoles = NULL;
    springls__bvh_hang(to, (springls__bvh_item *)both->items.data, to->node_count);
}

/* Exchanges the original surface of the model with that which was made anew, or back. */
SPRINGLS__FN void springls__exchange_originals(springls_context *ctx, springls__both_originals *both)
{
    const springls__surface before = ctx->original;
    ctx->original = both->made;
    both->made = before;
    both->taken = !both->taken;
}

/* Goes back to the original surface before. A join has hung its parts anew, and added behind the rest. */
SPRINGLS__FN void springls__undo_originals(springls_context *ctx, springls__both_originals *both)
{
    const springls__bvh_node *root;
    springls__surface *own = &ctx->original;
    if (both->taken) springls__exchange_originals(ctx, both);
    if (!both->joined) return;
    own->count = both->before.count;
    own->given = both->before.given;
    own->node_count = both->before.node_count;
    own->parts = springls__bvh_parts(&both->before, &root);
    springls__bvh_hang(own, (springls__bvh_item *)both->items.data, own->node_count);
    own->parts = both->before.parts;
    own->joints = both->before.joints;
    own->dipoles = both->before.dipoles;
    own->source = both->before.source;
    both->joined = false;
}

SPRINGLS__FN void springls__both_originals_free(springls_context *ctx, springls__both_originals *both)
{
    springls__surface_free(ctx, &both->made);
    springls__buffer_free(ctx, &both->items);
    springls__buffer_free(ctx, &both->number);
    springls__buffer_free(ctx, &both->first);
    springls__buffer_free(ctx, &both->beside);
    springls__buffer_free(ctx, &both->marks.memory);
}

#endif
