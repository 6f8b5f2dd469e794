/* combine.h - computes the union, intersection or difference of two models. The springls of each that bound the result stay, by
   the side of the other's level set on which they lie. phi is the minimum or maximum of the two; where that has a crease, at
   the seam, the springls correct it (project, keep_edges). */
#ifndef SPRINGLS__TOOLS_COMBINE_H
#define SPRINGLS__TOOLS_COMBINE_H

#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/resumable.h"
#include "../model/attribute_values.h"
#include "../model/bvh.h"
#include "../model/closest_point.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "../model/host_access.h"
#include "../stages/contact_bodies.h"
#include "../stages/fill_gaps.h"
#include "../stages/inherit.h"
#include "../stages/keep_edges.h"
#include "../stages/project.h"
#include "../stages/rebuild.h"
#include "../stages/sleep.h"
#include "../stages/window.h"
#include "../solver/step.h"
#include "../lifecycle/create.h"
#include "../output/restore.h"

/* Decides which springls of one operand stay: where sign * phi > 0 in the other operand's level set; and, where they lie on its
   surface, by the direction they face. */
typedef struct springls__side_rule {
    const springls__grid *grid;      /* of the other operand                                                       */
    const springls__surface *surface; /* of its springls                                                           */
    float sign;
    bool keep_same, keep_opposite;   /* of springls on its surface: facing like it, or against it                  */
    springls__box box;               /* of the grid's active bricks, with a voxel around: beyond it phi is constant */
} springls__side_rule;

/* Returns a box of the active bricks of a grid, voxels, with room for the voxels that a sample beside them takes. */
SPRINGLS__FN springls__box springls__box_of_bricks(const springls__grid *g)
{
    springls__box box = springls__box_empty();
    int i, o[3];
    for (i = 0; i < g->active_count; i++) {
        springls__slot_origin(g, g->active[i], o);
        box = springls__box_add(box, springls__v3_make((float)o[0] - 1.0f, (float)o[1] - 1.0f, (float)o[2] - 1.0f));
        box = springls__box_add(box, springls__v3_make((float)o[0] + 8.0f, (float)o[1] + 8.0f, (float)o[2] + 8.0f));
    }
    return box;
}

/* Returns the rule for the springls of the first operand, or of the second. grid, surface: of the other one. */
SPRINGLS__FN springls__side_rule springls__rule_of(const springls__grid *grid, const springls__surface *surface,
                                                   springls_operation operation, bool second)
{
    const bool difference = operation == SPRINGLS_OPERATION_DIFFERENCE;
    springls__side_rule rule;
    rule.grid = grid;
    rule.surface = surface;
    rule.sign = operation == SPRINGLS_OPERATION_INTERSECTION || (difference && second) ? -1.0f : 1.0f;
    rule.keep_same = !second && !difference; /* where both operands have springls, one of the two is enough */
    rule.keep_opposite = !second && difference;
    rule.box = springls__box_of_bricks(grid);
    return rule;
}

/* Names how a springl lies to the other operand's surface: off it, or on it and facing the same or the opposite way. */
enum { SPRINGLS__OFF_SURFACE, SPRINGLS__FACING_SAME, SPRINGLS__FACING_OPPOSITE };

#define SPRINGLS__ON_SURFACE 0.05f  /* voxel: what is nearer lies on a surface      */
#define SPRINGLS__TRIANGLE_GAP 0.3f /* voxel: between triangles that bound a solid  */
#define SPRINGLS__PHI_ERROR 1.0f    /* voxel: of phi between voxels                 */
#define SPRINGLS__PARALLEL 0.7f     /* cosine between normals that face alike       */

/* Returns a box of all springls, voxels, with room for the gaps between triangles. */
SPRINGLS__FN springls__box springls__box_of_springls(const springls_context *ctx)
{
    springls__box box = springls__box_empty();
    int i;
    for (i = 0; i < ctx->model.set.count; i++) {
        const springls__v3 p = ctx->model.set.s[i].p;
        const float r = ctx->model.set.s[i].bounding_radius + SPRINGLS__TRIANGLE_GAP;
        box = springls__box_add(box, springls__v3_make(p.x - r, p.y - r, p.z - r));
        box = springls__box_add(box, springls__v3_make(p.x + r, p.y + r, p.z + r));
    }
    return box;
}

SPRINGLS__FN bool springls__reaches_box(const springls__springl *s, const springls__box *box)
{
    const float r = s->bounding_radius;
    return s->p.x + r >= box->lower.x && s->p.y + r >= box->lower.y && s->p.z + r >= box->lower.z && s->p.x - r <= box->upper.x
           && s->p.y - r <= box->upper.y && s->p.z - r <= box->upper.z;
}

/* Makes the surface of those springls of a model that reach a box. */
SPRINGLS__FN springls_status springls__surface_in_box(springls_context *ctx, springls__surface *surface,
                                                      const springls_context *model, const springls__box *box)
{
    const springls__springl *s = model->model.set.s;
    int i, m, count = 0;
    for (i = 0; i < model->model.set.count; i++) count += springls__reaches_box(&s[i], box);
    SPRINGLS__TRY(springls__surface_reserve(ctx, surface, count));
    for (i = count = 0; i < model->model.set.count; i++) {
        if (!springls__reaches_box(&s[i], box)) continue;
        for (m = 0; m < 3; m++) surface->points[3 * count + m] = s[i].q[m];
        count++;
    }
    return springls__surface_finish(ctx, surface, count);
}

/* Returns how a springl with normal n at p lies to a triangle of the other's surface, and their squared distance. Gaps between
   triangles count as surface for a springl that faces the opposite way only: one that faces the same way, in the plane of a face
   but beyond its edge, may bound the result. */
SPRINGLS__FN int springls__facing_triangle(springls__tri t, springls__v3 p, springls__v3 n, float *d2)
{
    springls__v3 m = springls__tri_normal(t);
    float cosine = springls__dot(n, m), height = springls__dot(springls__sub(p, t.a), m);
    *d2 = springls__tri_closest(t, p).d2;
    if (cosine > SPRINGLS__PARALLEL && *d2 < SPRINGLS__ON_SURFACE * SPRINGLS__ON_SURFACE) return SPRINGLS__FACING_SAME;
    if (cosine < -SPRINGLS__PARALLEL && *d2 < SPRINGLS__TRIANGLE_GAP * SPRINGLS__TRIANGLE_GAP
        && springls__fabs(height) < SPRINGLS__ON_SURFACE) return SPRINGLS__FACING_OPPOSITE;
    return SPRINGLS__OFF_SURFACE;
}

/* Returns how a springl lies to the other's surface: to the nearest of its triangles, and to its level set where there are none.
   Triangles come first because phi is inexact between voxels at sharp edges. */
SPRINGLS__FN int springls__facing_surface(const springls__side_rule *rule, const springls__springl *s, float phi)
{
    springls__v3 n = springls__springl_normal(*s);
    springls__near_walk walk;
    float cosine, d2, least = FLT_MAX;
    int i, to_triangle, facing = SPRINGLS__OFF_SURFACE;
    if (springls__fabs(phi) > SPRINGLS__PHI_ERROR) return SPRINGLS__OFF_SURFACE;
    walk = springls__near_walk_begin(rule->surface, s->p, SPRINGLS__TRIANGLE_GAP);
    while ((i = springls__near_walk_next(&walk)) >= 0) {
        to_triangle = springls__facing_triangle(springls__surface_triangle(rule->surface, i), s->p, n, &d2);
        if (to_triangle == SPRINGLS__OFF_SURFACE || d2 >= least) continue;
        least = d2;
        facing = to_triangle;
    }
    if (facing != SPRINGLS__OFF_SURFACE || springls__fabs(phi) >= SPRINGLS__ON_SURFACE) return facing;
    cosine = springls__dot(n, springls__grid_gradient(rule->grid, rule->grid->phi, s->p));
    if (cosine > SPRINGLS__PARALLEL) return SPRINGLS__FACING_SAME;
    return cosine < -SPRINGLS__PARALLEL ? SPRINGLS__FACING_OPPOSITE : SPRINGLS__OFF_SURFACE;
}

/* Samples phi of the other operand. Beyond its bricks, where most springls are when that is a tool, it is the same to the bit without
   interpolating. */
SPRINGLS__FN float springls__sample_other(const springls__side_rule *rule, springls__v3 p)
{
    const springls__grid *g = rule->grid;
    const springls__v3 lower = rule->box.lower, upper = rule->box.upper;
    if (p.x >= lower.x && p.y >= lower.y && p.z >= lower.z && p.x <= upper.x && p.y <= upper.y && p.z <= upper.z)
        return springls__grid_sample(g, g->phi, p);
    return g->phi[(size_t)springls__slot_of_place(g, p) * SPRINGLS__BRICK_VOXELS];
}

SPRINGLS__FN bool springls__is_kept(const springls__side_rule *rule, const springls__springl *s)
{
    float phi = springls__sample_other(rule, s->p);
    int facing = springls__facing_surface(rule, s, phi);
    if (facing == SPRINGLS__FACING_SAME) return rule->keep_same;
    if (facing == SPRINGLS__FACING_OPPOSITE) return rule->keep_opposite;
    return rule->sign * phi > 0.0f;
}

/* Moves the corners of a springl that lie beyond the seam onto it, towards the particle. */
SPRINGLS__FN springls__springl springls__pull_to_surface(const springls__side_rule *rule, springls__springl s)
{
    const float min_distance = 0.1f; /* voxels: nearer to the seam a triangle would have no area left */
    float phi_p = rule->sign * springls__sample_other(rule, s.p);
    int m;
    if (phi_p > s.bounding_radius + SPRINGLS__PHI_ERROR) return s; /* all corners lie on this side */
    for (m = 0; m < 3 && phi_p > min_distance; m++) {
        float phi_q = rule->sign * springls__grid_sample(rule->grid, rule->grid->phi, s.q[m]);
        if (phi_q < 0.0f) s.q[m] = springls__lerp(s.p, s.q[m], phi_p / (phi_p - phi_q));
    }
    return springls__springl_finished(s);
}

SPRINGLS__FN float springls__combined_phi(springls_operation operation, float a, float b)
{
    if (operation == SPRINGLS_OPERATION_UNION) return springls__min(a, b);
    return springls__max(a, operation == SPRINGLS_OPERATION_DIFFERENCE ? -b : b);
}

/* ---- level sets ---- */

/* Activates the bricks that are active in either, in a top table that has those of both. */
SPRINGLS__FN springls_status springls__bricks_of_both(springls_context *ctx, const springls__grid *other)
{
    springls__brick_groups groups = springls__no_groups();
    int i, *list;
    springls__keep_grid(other, &groups, springls__unmoved);
    SPRINGLS__TRY(springls__table_cover(ctx, groups));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_list, other->active_count));
    list = springls__brick_list(&ctx->model);
    for (i = 0; i < other->active_count; i++) list[i] = other->slot_brick[other->active[i]];
    return springls__grid_add_bricks(ctx, list, other->active_count);
}

/* Returns true at a voxel where the surfaces of both operands lie on each other and face opposite ways; that of a subtracted
   operand counts as turned round. No boundary is left there. a, b: phi of the operands. */
SPRINGLS__FN bool springls__surfaces_cancel(springls_operation operation, const springls__grid *g, const springls__grid *other,
                                            float a, float b, const int at[3])
{
    const float touching = 1e-3f, opposite = -0.5f; /* voxels; cosine */
    springls__v3 n, m;
    float cosine;
    if (springls__fabs(a) > touching || springls__fabs(b) > touching) return false;
    n = springls__normalize(springls__voxel_gradient(g, at[0], at[1], at[2]));
    m = springls__normalize(springls__voxel_gradient(other, at[0], at[1], at[2]));
    cosine = springls__dot(n, m);
    return (operation == SPRINGLS_OPERATION_DIFFERENCE ? -cosine : cosine) < opposite;
}

/* Returns the values of a grid in the brick that another grid, of the same domain, has an entry for. */
SPRINGLS__FN const float *springls__phi_of_entry(const springls__grid *grid, const springls__grid *g, int entry)
{
    return grid->phi + (size_t)springls__slot_of_brick(grid, springls__brick_of_entry(g, entry)) * SPRINGLS__BRICK_VOXELS;
}

/* Returns whether an operation leaves phi as it is where the other operand has a slot: no value is beyond those of constant bricks. */
SPRINGLS__FN bool springls__leaves_brick(springls_operation operation, int other_slot)
{
    return other_slot == (operation == SPRINGLS_OPERATION_INTERSECTION ? SPRINGLS__INSIDE : SPRINGLS__OUTSIDE);
}

/* Computes phi of the result in the active brick of an entry, into phi_next; ends the brick's calm if that changes it. */
SPRINGLS__FN void springls__combine_brick(springls__grid *g, springls_operation operation, const springls__grid *other, int entry)
{
    const int slot = g->top[entry];
    const float *phi = g->phi + (size_t)slot * SPRINGLS__BRICK_VOXELS;
    const float *other_phi = springls__phi_of_entry(other, g, entry);
    const float between = operation == SPRINGLS_OPERATION_UNION ? -0.5f : 0.5f; /* voxel */
    float *out = g->phi_next + (size_t)slot * SPRINGLS__BRICK_VOXELS;
    int o[3], at[3], v;
    springls__slot_origin(g, slot, o);
    if (springls__leaves_brick(operation, springls__slot_of_brick(other, g->slot_brick[slot]))) {
        memcpy(out, phi, SPRINGLS__BRICK_VOXELS * sizeof *out);
        return;
    }
    for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
        springls__voxel_of_brick(o, v, at);
        out[v] = springls__surfaces_cancel(operation, g, other, phi[v], other_phi[v], at)
               ? between : springls__combined_phi(operation, phi[v], other_phi[v]);
        if (out[v] != phi[v]) springls__end_calm(g, slot);
    }
}

/* Computes phi of the result in every brick. The bricks of both are active. */
SPRINGLS__FN void springls__combine_level_sets(springls_context *ctx, springls_operation operation, const springls__grid *other)
{
    springls__grid *g = &ctx->model.grid;
    int i, entries = (int)springls__entry_count(g);
    for (i = 0; i < entries; i++)
        if (g->top[i] >= SPRINGLS__FIRST_SLOT) springls__combine_brick(g, operation, other, i);
    for (i = 0; i < entries; i++)
        if (g->top[i] < SPRINGLS__FIRST_SLOT)
            g->top[i] = springls__combined_phi(operation, g->phi[(size_t)g->top[i] * SPRINGLS__BRICK_VOXELS],
                                               *springls__phi_of_entry(other, g, i)) < 0.0f
                      ? SPRINGLS__INSIDE : SPRINGLS__OUTSIDE;
    springls__swap_phi(ctx);
    ctx->omega_fresh = false;
}

/* Two references, and the one that is made of both: its grid has its own planes, top table and phi. */
typedef struct springls__both_references {
    const springls__grid *first, *second;
    springls__grid grid;
    springls__buffer plane, top, phi;
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

/* Writes the reference level set of the result. Of the two originals' values takes that of smaller size, because tracking uses
   phi_ref as a distance and not its sign; within a voxel of where the originals cross it is less exact. */
SPRINGLS__FN void springls__merge_references(springls__both_references *both)
{
    springls__grid *g = &both->grid;
    int i, v, entries = (int)springls__entry_count(g);
    springls__fill(g->phi, SPRINGLS__OUTSIDE, both->first->far_value);
    springls__fill(g->phi, SPRINGLS__INSIDE, -both->first->far_value);
    for (i = 0; i < entries; i++) {
        const float *a = springls__phi_of_entry(both->first, g, i), *b = springls__phi_of_entry(both->second, g, i);
        float *out = g->phi + (size_t)g->top[i] * SPRINGLS__BRICK_VOXELS;
        if (g->top[i] < SPRINGLS__FIRST_SLOT) continue;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) out[v] = springls__fabs(a[v]) <= springls__fabs(b[v]) ? a[v] : b[v];
    }
}

/* Replaces a buffer of the model by another. */
SPRINGLS__FN void springls__replace_memory(springls_context *ctx, springls__array array, const springls__buffer *by)
{
    springls__buffer *memory = &ctx->memory[array];
    springls__release(ctx, memory->data, memory->bytes);
    memory->data = by->data;
    memory->bytes = by->bytes;
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

/* Replaces the reference level set by that of both originals. */
SPRINGLS__FN springls_status springls__combine_references(springls_context *ctx, const springls__grid *other)
{
    springls__grid *g = &ctx->model.reference;
    springls__both_references both;
    springls_status status;
    memset(&both, 0, sizeof both);
    both.first = g;
    both.second = other;
    both.grid = *g;
    status = springls__reserve_references(ctx, &both);
    if (status != SPRINGLS_OK) {
        springls__buffer_free(ctx, &both.top);
        springls__buffer_free(ctx, &both.plane);
        return status;
    }
    springls__merge_references(&both);
    g->table = both.grid.table;
    g->slot_count = both.grid.slot_count;
    springls__replace_memory(ctx, SPRINGLS__ARRAY_REFERENCE_PLANE, &both.plane);
    springls__replace_memory(ctx, SPRINGLS__ARRAY_REFERENCE_TOP, &both.top);
    springls__replace_memory(ctx, SPRINGLS__ARRAY_REFERENCE_PHI, &both.phi);
    springls__bind(ctx);
    return SPRINGLS_OK;
}

/* ---- original surfaces ---- */

/* Copies the triangles of one surface into another, from index `at` on. turn: reverses them; given_before: triangles of the
   caller's meshes that come before those of `from`. */
SPRINGLS__FN void springls__copy_triangles(springls__surface *to, int at, const springls__surface *from, int given_before,
                                           bool turn)
{
    int i, k;
    for (i = 0; i < from->count; i++) {
        for (k = 0; k < 3; k++) to->points[3 * (at + i) + k] = from->points[3 * i + (turn && k ? 3 - k : k)];
        to->source[at + i] = ((from->source ? from->source[i] : 2 * i) ^ (int)turn) + 2 * given_before;
    }
}

/* Where correspondences are: a bit for each cell of a box around a surface. */
typedef struct springls__cell_marks {
    springls__v3 lower;
    float scale; /* cells a voxel */
    int size[3];
    uint32_t *bits;
    springls__buffer memory;
} springls__cell_marks;

/* Finds the cells from place `lower` to place `upper`: those at the border stand for what lies beyond. */
SPRINGLS__FN void springls__cells_between(const springls__cell_marks *marks, springls__v3 lower, springls__v3 upper, int first[3],
                                          int last[3])
{
    const springls__v3 from = springls__scale(springls__sub(lower, marks->lower), marks->scale);
    const springls__v3 to = springls__scale(springls__sub(upper, marks->lower), marks->scale);
    first[0] = springls__cell_coordinate(from.x, 0, marks->size[0]);
    first[1] = springls__cell_coordinate(from.y, 0, marks->size[1]);
    first[2] = springls__cell_coordinate(from.z, 0, marks->size[2]);
    last[0] = springls__cell_coordinate(to.x, 0, marks->size[0]);
    last[1] = springls__cell_coordinate(to.y, 0, marks->size[1]);
    last[2] = springls__cell_coordinate(to.z, 0, marks->size[2]);
}

/* Marks the cells of a box, or (mark false) finds whether one of them is marked. */
SPRINGLS__FN bool springls__visit_cells(const springls__cell_marks *marks, springls__v3 lower, springls__v3 upper, bool mark)
{
    int first[3], last[3], x, y, z;
    springls__cells_between(marks, lower, upper, first, last);
    for (z = first[2]; z <= last[2]; z++)
        for (y = first[1]; y <= last[1]; y++)
            for (x = first[0]; x <= last[0]; x++) {
                const size_t cell = (size_t)x + (size_t)marks->size[0] * ((size_t)y + (size_t)marks->size[1] * (size_t)z);
                const uint32_t bit = 1u << (cell & 31u);
                if (mark) marks->bits[cell >> 5] |= bit;
                else if (marks->bits[cell >> 5] & bit) return true;
            }
    return false;
}

/* Makes cells of a voxel, or of more where those would be too many, around the original surface, and marks those that a
   correspondence is near. */
SPRINGLS__FN springls_status springls__mark_correspondences(springls_context *ctx, springls__cell_marks *marks)
{
    const float margin = 1.0f;             /* voxel: a new springl's correspondence lies between those around it */
    const double most = (double)(1 << 24); /* cells */
    const springls__bvh_node *bounds = &ctx->original.nodes[0];
    double cells = most + 1.0;
    int axis, i;
    memset(marks, 0, sizeof *marks);
    marks->lower = springls__v3_make(bounds->lower[0], bounds->lower[1], bounds->lower[2]);
    for (marks->scale = 1.0f; cells > most; marks->scale *= 0.5f)
        for (axis = 0, cells = 1.0; axis < 3; axis++) {
            marks->size[axis] = 1 + (int)springls__min((bounds->upper[axis] - bounds->lower[axis]) * marks->scale, (float)most);
            cells *= (double)marks->size[axis];
        }
    marks->scale *= 2.0f; /* as that which fits */
    SPRINGLS__TRY(springls__buffer_grow(ctx, &marks->memory, (size_t)cells / 32 + 1, sizeof(uint32_t), 0));
    marks->bits = (uint32_t *)marks->memory.data;
    memset(marks->bits, 0, ((size_t)cells / 32 + 1) * sizeof(uint32_t));
    for (i = 0; i < ctx->model.set.count; i++) {
        const springls__v3 a = ctx->model.set.a[i];
        springls__visit_cells(marks, springls__v3_make(a.x - margin, a.y - margin, a.z - margin),
                              springls__v3_make(a.x + margin, a.y + margin, a.z + margin), true);
    }
    return SPRINGLS_OK;
}

/* Drops the triangles of the original surface that no springl has its correspondence on or near: of parts that later combinations have cut
   away. The others keep their numbers in the caller's meshes, and wait for the hierarchy to be built. */
SPRINGLS__FN springls_status springls__drop_unused_originals(springls_context *ctx)
{
    springls__surface *own = &ctx->original;
    int *source = (int *)own->source_memory.data;
    springls__cell_marks marks;
    int i, k, n = 0;
    if (own->count == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__mark_correspondences(ctx, &marks));
    for (i = 0; i < own->count; i++) {
        springls__box box = springls__box_empty();
        for (k = 0; k < 3; k++) box = springls__box_add(box, own->points[3 * i + k]);
        if (!springls__visit_cells(&marks, box.lower, box.upper, false)) continue;
        for (k = 0; k < 3; k++) own->points[3 * n + k] = own->points[3 * i + k];
        source[n++] = source[i];
    }
    own->count = n;
    own->joins = SPRINGLS__BVH_JOINS;
    springls__buffer_free(ctx, &marks.memory);
    return SPRINGLS_OK;
}

/* After every so many triangles that combinations have added, those without use are dropped: that takes as long as a combination, which
   many then share. */
enum { SPRINGLS__ORIGINALS_PERIOD = 16384 };

/* Adds the triangles of the other model's original surface to this model's. turn: turns them. */
SPRINGLS__FN springls_status springls__combine_originals(springls_context *ctx, const springls__surface *other, bool turn)
{
    springls__surface *own = &ctx->original;
    const size_t count = (size_t)own->count;
    int i;
    if ((int64_t)own->given + other->given > INT32_MAX / 6) /* a source is 2 * triangle + turned */
        return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "combine: the original surfaces have too many triangles");
    SPRINGLS__TRY(springls__buffer_grow(ctx, &own->source_memory, count + (size_t)other->count + 1, sizeof(int),
                                        own->source ? count * sizeof(int) : 0));
    if (!own->source)
        for (i = 0; i < own->count; i++) ((int *)own->source_memory.data)[i] = 2 * i;
    own->source = (int *)own->source_memory.data;
    if (own->given / SPRINGLS__ORIGINALS_PERIOD < (own->given + other->given) / SPRINGLS__ORIGINALS_PERIOD)
        SPRINGLS__TRY(springls__drop_unused_originals(ctx));
    SPRINGLS__TRY(springls__surface_room(ctx, own, (size_t)own->count + (size_t)other->count + 1, (size_t)own->count));
    springls__copy_triangles(own, own->count, other, own->given, turn);
    return springls__surface_join(ctx, own, other);
}

/* ---- springls ---- */

/* Finds which of a model's springls stay (its contract_action), and how many. */
SPRINGLS__FN springls_status springls__mark_kept_springls(springls_context *ctx, const springls__side_rule *rule, int *staying)
{
    uint8_t *action;
    int i;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, contract_action, ctx->model.set.count));
    action = springls__contract_action(&ctx->model);
    for (i = *staying = 0; i < ctx->model.set.count; i++) {
        action[i] = springls__is_kept(rule, &ctx->model.set.s[i]) ? SPRINGLS__KEEP : SPRINGLS__REMOVE;
        *staying += action[i] == SPRINGLS__KEEP;
    }
    return SPRINGLS_OK;
}

/* Copies the values of springl j for the attributes that both models have; others are 0. */
SPRINGLS__FN void springls__copy_other_values(springls_context *ctx, int n, const springls_context *other, int j)
{
    int i, k;
    for (i = 0; i < ctx->attribute_count; i++) {
        const springls__attribute *attribute = &ctx->attributes[i];
        size_t bytes = (size_t)attribute->channels * sizeof(float);
        k = springls_find_attribute(other, attribute->name);
        if (k >= 0 && other->attributes[k].channels == attribute->channels)
            memcpy(springls__values_of(attribute, n), springls__values_of(&other->attributes[k], j), bytes);
        else
            memset(springls__values_of(attribute, n), 0, bytes);
    }
}

/* Returns the body that springl j of the other model is of in this one; 0 when bodies are not found yet. */
SPRINGLS__FN uint32_t springls__contact_body_beside(const springls_context *ctx, const springls_context *other, int j)
{
    uint32_t body = other->model.set.contact_body[j];
    return ctx->last_contact_body ? ctx->last_contact_body + (body ? body : 1u) : 0u;
}

/* Appends springl j of the other model. It keeps its age, and becomes new in all else that refers to one model. */
SPRINGLS__FN void springls__copy_other_springl(springls_context *ctx, const springls_context *other, int j,
                                               const springls__side_rule *rule, bool turn)
{
    springls__record record = springls__record_load(&other->model, j);
    uint32_t age = other->model.set.step - (record.birth >> 2);
    int n = ctx->model.set.count;
    record.s = springls__pull_to_surface(rule, record.s);
    if (turn) record.s = springls__reversed(record.s);
    record.birth = 4u * ((ctx->model.set.step - age) & 0x3fffffffu) + (record.birth & 3u);
    springls__record_renew(&ctx->model, n, &record);
    record.contact_body = springls__contact_body_beside(ctx, other, j);
    springls__record_store(&ctx->model, n, record);
    springls__constellation_added(ctx, 1);
    springls__copy_other_values(ctx, n, other, j);
}

/* Reports a failure of the other model as one of this call. */
SPRINGLS__FN springls_status springls__other_failed(springls_context *ctx, springls_status status, const springls_context *other)
{
    return springls__fail(ctx, status, "combine: the other model: %.180s", other->error);
}

/* Finds which springls of both models stay, and makes room for them in this one. Fails when none do, or more than max_springls. */
SPRINGLS__FN springls_status springls__mark_both(springls_context *ctx, const springls__side_rule *rule, int *staying,
                                                 springls_context *other, const springls__side_rule *other_rule, int *added)
{
    const int count = ctx->model.set.count;
    springls_status status;
    int i;
    SPRINGLS__TRY(springls__mark_kept_springls(ctx, rule, staying));
    status = springls__mark_kept_springls(other, other_rule, added);
    if (status != SPRINGLS_OK) return springls__other_failed(ctx, status, other);
    if (*staying + *added == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "combine: nothing is left");
    if (*staying + *added > ctx->desc.max_springls)
        return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "combine: more than %d springls", ctx->desc.max_springls);
    SPRINGLS__TRY(springls__constellation_reserve(ctx, springls__imax(count, *staying + *added)));
    for (i = 0; i < ctx->attribute_count; i++)
        SPRINGLS__TRY(springls__values_reserve(ctx, &ctx->attributes[i], *staying + *added, count));
    return SPRINGLS_OK;
}

/* Keeps the springls of both models that bound the result. Both level sets must be as they were. surfaces: of this model's springls
   that reach the other's box, and of the other's that reach this one's. */
SPRINGLS__FN springls_status springls__combine_springls(springls_context *ctx, springls_operation operation,
                                                        springls_context *other, const springls__surface surfaces[2])
{
    const bool turn = operation == SPRINGLS_OPERATION_DIFFERENCE;
    const springls__side_rule rule = springls__rule_of(&other->model.grid, &surfaces[1], operation, false);
    const springls__side_rule other_rule = springls__rule_of(&ctx->model.grid, &surfaces[0], operation, true);
    int i, count = ctx->model.set.count, staying, added;
    SPRINGLS__TRY(springls__mark_both(ctx, &rule, &staying, other, &other_rule, &added));
    SPRINGLS__TRY(springls__attributes_before_removal(ctx));
    springls__stir(ctx, SPRINGLS__STIR_CONTRACTED, 0, count);
    SPRINGLS__TRY(springls__constellation_compact(ctx));
    springls__attributes_after_removal(ctx, count);
    for (i = 0; i < staying; i++) ctx->model.set.s[i] = springls__pull_to_surface(&rule, ctx->model.set.s[i]);
    for (i = 0; i < other->model.set.count; i++)
        if (springls__contract_action(&other->model)[i] == SPRINGLS__KEEP)
            springls__copy_other_springl(ctx, other, i, &other_rule, turn);
    springls__stir(ctx, SPRINGLS__STIR_ALL, staying, added);
    if (ctx->last_contact_body) ctx->last_contact_body += other->last_contact_body + 1u;
    if (operation != SPRINGLS_OPERATION_UNION) ctx->last_contact_body = 0; /* bodies consist of springls of both */
    ctx->stats.removed += count - staying;
    ctx->stats.added += added;
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

/* ---- windows ---- */

/* Widens [lower, upper], voxels of a window at `offset`, to the particles of a model along an axis. */
SPRINGLS__FN void springls__widen_range(const springls_context *ctx, const int *offset, int axis, double *lower, double *upper)
{
    const double moved = (double)ctx->window.offset[axis] - (double)offset[axis];
    int i;
    for (i = 0; i < ctx->model.set.count; i++) {
        const springls__v3 p = ctx->model.set.s[i].p;
        double x = (double)(axis == 0 ? p.x : axis == 1 ? p.y : p.z) + moved;
        if (x < *lower) *lower = x;
        if (x > *upper) *upper = x;
    }
}

/* Finds by how many bricks the window of a model, if it follows, moves to the middle of both models. Fails when both do not lie in
   one window. */
SPRINGLS__FN springls_status springls__window_of_both(springls_context *ctx, springls_context *other, int bricks[3])
{
    int axis;
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(S)));
    SPRINGLS__TRY(springls__ensure_on_host(other, SPRINGLS__BIT(S)));
    for (axis = 0; axis < 3; axis++) {
        const double last = (double)ctx->model.grid.size[axis] - 0.5; /* voxel: the border of the domain */
        double lower = DBL_MAX, upper = -DBL_MAX, moved;
        springls__widen_range(ctx, ctx->window.offset, axis, &lower, &upper);
        springls__widen_range(other, ctx->window.offset, axis, &lower, &upper);
        bricks[axis] = ctx->desc.follow ? springls__bricks_to_middle(ctx, axis, lower, upper) : 0;
        moved = (double)SPRINGLS__BRICK * (double)bricks[axis];
        if (lower - moved < -0.5 || upper - moved > last)
            return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT,
                                  "combine: along axis %d both models reach from voxel %.0f to %.0f: a window has %d", axis, lower,
                                  upper, ctx->model.grid.size[axis]);
    }
    return SPRINGLS_OK;
}

/* Copies `from` to `to`; both have grids of the same lattice. On failure the reason is in the error of one of them. */
SPRINGLS__FN springls_status springls__copy_model(springls_context *to, springls_context *from)
{
    springls_status status;
    size_t size;
    void *block;
    SPRINGLS__TRY(springls_snapshot(from, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    block = springls__allocate(to, size);
    if (!block) return springls__fail(to, SPRINGLS_OUT_OF_MEMORY, "out of memory");
    status = springls_snapshot(from, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size);
    if (status == SPRINGLS_OK) status = springls_restore(to, block, size);
    springls__release(to, block, size);
    return status;
}

/* Makes a copy of the other model in the window of this one, whose phi has followed its springls: what lies beyond that is left out. */
SPRINGLS__FN springls_status springls__copy_into_window(springls_context *ctx, springls_context *other, springls_context **copy)
{
    springls_status status;
    int bricks[3], axis;
    SPRINGLS__TRY(springls__create_alike(ctx, "combine", copy));
    status = springls__copy_model(*copy, other);
    if (status == SPRINGLS_OK) status = springls__follow_written(*copy);
    if (status == SPRINGLS_OK) status = springls__change_level_set(*copy); /* a snapshot has phi as the steps have left it */
    for (axis = 0; axis < 3; axis++) /* where windows are further apart, nothing is in both */
        bricks[axis] = springls__iclamp(ctx->window.offset[axis] / SPRINGLS__BRICK - other->window.offset[axis] / SPRINGLS__BRICK,
                                        -SPRINGLS__FURTHEST_MOVE, SPRINGLS__FURTHEST_MOVE);
    if (status == SPRINGLS_OK) status = springls__move_window(*copy, bricks);
    return status == SPRINGLS_OK ? status : springls__fail(ctx, status, "combine: the other model could not be copied");
}

/* ---- what is awake already ---- */

/* Each edit completes the bricks that it changes itself, and leaves to the next step what earlier ones have left awake: so it costs what
   it cuts, however many came before it without a step between. */

/* The calm of all slots while a combination, or a pass over its gaps, has its own, and the bricks that they had. */
typedef struct springls__calm_aside { springls__buffer calm, bricks; int slot_count; } springls__calm_aside;

/* Puts the calm of the model aside: all of it is asleep, until what follows ends the calm of what it changes. Where nothing may sleep it
   does nothing. */
SPRINGLS__FN springls_status springls__put_calm_aside(springls_context *ctx, springls__calm_aside *aside)
{
    const springls__grid *g = &ctx->model.grid;
    const size_t slot_count = (size_t)g->slot_count;
    if (!springls__may_sleep(ctx)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->calm, slot_count * SPRINGLS__OCTANTS, 1, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->bricks, slot_count, sizeof(int), 0));
    memcpy(aside->calm.data, g->calm, slot_count * SPRINGLS__OCTANTS);
    memcpy(aside->bricks.data, g->slot_brick, slot_count * sizeof(int));
    aside->slot_count = g->slot_count;
    springls__rest_all(ctx);
    return SPRINGLS_OK;
}

/* Goes back to the calm that was put aside, where it has not been ended since. */
SPRINGLS__FN void springls__put_calm_back(springls_context *ctx, const springls__calm_aside *aside)
{
    springls__grid *g = &ctx->model.grid;
    const uint8_t *before = (const uint8_t *)aside->calm.data;
    const int *brick = (const int *)aside->bricks.data;
    int i, o;
    for (i = SPRINGLS__FIRST_SLOT; i < aside->slot_count; i++)
        for (o = SPRINGLS__OCTANTS * i; g->slot_brick[i] == brick[i] && o < SPRINGLS__OCTANTS * (i + 1); o++)
            if (before[o] < g->calm[o]) g->calm[o] = before[o];
}

SPRINGLS__FN void springls__calm_aside_free(springls_context *ctx, springls__calm_aside *aside)
{
    springls__buffer_free(ctx, &aside->calm);
    springls__buffer_free(ctx, &aside->bricks);
}

/* ---- gaps ---- */

/* Which bricks are awake, put aside while fewer of them are to be. */
typedef struct springls__awake_aside {
    springls__calm_aside calm;
    springls__buffer awake, bricks; /* awake and near_awake of each slot; the bricks that they had */
    int slot_count, asleep_count, some_asleep;
    bool at_rest;
} springls__awake_aside;

SPRINGLS__FN springls_status springls__put_awake_aside(springls_context *ctx, springls__awake_aside *aside)
{
    const springls__grid *g = &ctx->model.grid;
    const size_t slot_count = (size_t)g->slot_count;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->awake, 2 * slot_count, 1, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->bricks, slot_count, sizeof(int), 0));
    memcpy(aside->awake.data, g->awake, slot_count);
    memcpy((uint8_t *)aside->awake.data + slot_count, g->near_awake, slot_count);
    memcpy(aside->bricks.data, g->slot_brick, slot_count * sizeof(int));
    aside->slot_count = g->slot_count;
    aside->asleep_count = ctx->model.cells.asleep_count;
    aside->some_asleep = g->some_asleep;
    aside->at_rest = ctx->at_rest;
    return SPRINGLS_OK;
}

/* Wakes what was awake; bricks that have come since are new, and so awake. */
SPRINGLS__FN void springls__put_awake_back(springls_context *ctx, const springls__awake_aside *aside)
{
    springls__grid *g = &ctx->model.grid;
    const uint8_t *awake = (const uint8_t *)aside->awake.data;
    const int *brick = (const int *)aside->bricks.data;
    int i;
    for (i = SPRINGLS__FIRST_SLOT; i < g->slot_count; i++) {
        const bool was_there = i < aside->slot_count && g->slot_brick[i] == brick[i];
        if (g->slot_brick[i] < 0) continue;
        g->awake[i] = was_there ? awake[i] : 1;
        g->near_awake[i] = was_there ? awake[aside->slot_count + i] : 1;
    }
    springls__find_sleepers(ctx);
    ctx->model.cells.asleep_count = aside->asleep_count;
    g->some_asleep = aside->some_asleep;
    ctx->at_rest = aside->at_rest;
}

/* Wakes the bricks beside the springls from number `first` on, of those that were awake, and lets the others sleep. */
SPRINGLS__FN springls_status springls__wake_beside(springls_context *ctx, int first, springls__awake_aside *aside)
{
    springls__grid *g = &ctx->model.grid;
    const uint8_t *awake = (const uint8_t *)aside->awake.data;
    const int *brick = (const int *)aside->bricks.data;
    int i;
    if (!springls__may_sleep(ctx)) return SPRINGLS_OK;
    springls__put_calm_back(ctx, &aside->calm);
    SPRINGLS__TRY(springls__put_calm_aside(ctx, &aside->calm));
    springls__stir(ctx, SPRINGLS__STIR_ALL, first, ctx->model.set.count - first);
    SPRINGLS__TRY(springls__find_awake(ctx));
    for (i = SPRINGLS__FIRST_SLOT; i < aside->slot_count; i++)
        if (g->slot_brick[i] == brick[i]) g->awake[i] &= awake[i];
    springls__find_sleepers(ctx);
    g->some_asleep = 1;
    return SPRINGLS_OK;
}

/* Runs fill_gaps again where it has added the springls from number `first` on, until it adds none, at most five times. */
SPRINGLS__FN springls_status springls__fill_again(springls_context *ctx, int first, springls__awake_aside *aside)
{
    const int max_passes = 5;
    int i;
    SPRINGLS__TRY(springls__put_awake_aside(ctx, aside));
    for (i = 0; i < max_passes && first != ctx->model.set.count; i++) {
        SPRINGLS__TRY(springls__wake_beside(ctx, first, aside));
        first = ctx->model.set.count;
        SPRINGLS__TRY(springls__run_table(ctx, springls__fill_gaps));
    }
    springls__put_calm_back(ctx, &aside->calm);
    if (springls__may_sleep(ctx)) springls__put_awake_back(ctx, aside);
    return SPRINGLS_OK;
}

/* Runs fill_gaps until it adds no springl, at most six times: a wide gap takes more than one. From the second time on only bricks beside
   new springls are awake: elsewhere it would find what it has found. */
SPRINGLS__FN springls_status springls__fill_all_gaps(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    springls__awake_aside aside;
    springls_status status;
    SPRINGLS__TRY(springls__run_table(ctx, springls__fill_gaps));
    if (count == ctx->model.set.count) return SPRINGLS_OK;
    memset(&aside, 0, sizeof aside);
    status = springls__fill_again(ctx, count, &aside);
    springls__calm_aside_free(ctx, &aside.calm);
    springls__buffer_free(ctx, &aside.awake);
    springls__buffer_free(ctx, &aside.bricks);
    return status;
}

/* ---- the call ---- */

/* Completes a model whose springls and phi were changed, where it is awake: finds its edges, and fills its gaps. project: projects phi onto
   the springls too, if params.project_level_set is set. */
SPRINGLS__FN springls_status springls__complete_model(springls_context *ctx, bool project)
{
    springls__constellation_changed(ctx);
    springls__clear_target_volumes(ctx);
    springls__redistance_sweeps(ctx, (int)ctx->model.params.band_half_width);
    SPRINGLS__TRY(springls__run_table(ctx, springls__band_follow));
    if (ctx->model.params.keep_edges) SPRINGLS__TRY(springls__run_table(ctx, springls__find_edges));
    SPRINGLS__TRY(springls__fill_all_gaps(ctx));
    if (ctx->model.params.keep_edges) SPRINGLS__TRY(springls__run_table(ctx, springls__find_edges));
    if (project && ctx->model.params.project_level_set)
        SPRINGLS__TRY(springls__run_table(ctx, springls__project_level_set));
    springls__mark_phi_synced(ctx);
    return SPRINGLS_OK;
}

/* Does the work of springls_combine on checked operands. surfaces: empty. On failure the model is left unfinished. */
SPRINGLS__FN springls_status springls__combine(springls_context *ctx, springls_operation operation, springls_context *other,
                                               springls__surface surfaces[2])
{
    const springls__box own_box = springls__box_of_springls(ctx), other_box = springls__box_of_springls(other);
    if (springls__contact_bodies_are_new(ctx)) SPRINGLS__TRY(springls__find_contact_bodies(ctx));
    SPRINGLS__TRY(springls__surface_in_box(ctx, &surfaces[0], ctx, &other_box));
    SPRINGLS__TRY(springls__surface_in_box(ctx, &surfaces[1], other, &own_box));
    SPRINGLS__TRY(springls__bricks_of_both(ctx, &other->model.grid));
    ctx->reference_stamp = 0;
    SPRINGLS__TRY(springls__combine_originals(ctx, &other->original, operation == SPRINGLS_OPERATION_DIFFERENCE));
    SPRINGLS__TRY(springls__combine_references(ctx, &other->model.reference));
    SPRINGLS__TRY(springls__combine_springls(ctx, operation, other, surfaces)); /* before phi changes */
    springls__combine_level_sets(ctx, operation, &other->model.grid);
    springls__find_awake(ctx);
    SPRINGLS__TRY(springls__complete_model(ctx, true));
    if (!springls__has_inside(&ctx->model.grid)) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "combine: nothing is left");
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__check_operation(springls_context *ctx, springls_operation operation)
{
    if (operation == SPRINGLS_OPERATION_UNION || operation == SPRINGLS_OPERATION_INTERSECTION
        || operation == SPRINGLS_OPERATION_DIFFERENCE) return SPRINGLS_OK;
    return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "combine: there is no operation %d: it may be 0 to 2", (int)operation);
}

SPRINGLS__FN springls_status springls__check_operands(springls_context *ctx, springls_operation operation,
                                                      const springls_context *other)
{
    SPRINGLS__TRY(springls__check_operation(ctx, operation));
    if (!other) return springls__fail_null(ctx, "combine", "the other model");
    if (other == ctx) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "combine: the other model is this one");
    if (memcmp(ctx->desc.grid.size, other->desc.grid.size, sizeof ctx->desc.grid.size) != 0
        || memcmp(ctx->lattice_to_world, other->lattice_to_world, sizeof ctx->lattice_to_world) != 0)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "combine: the other model lies on another grid");
    if (ctx->model.params.band_half_width != other->model.params.band_half_width)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "combine: the other model has another band_half_width");
    if (ctx->model.set.count == 0 || other->model.set.count == 0)
        return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "combine: %s model has no springls",
                              ctx->model.set.count ? "the other" : "this");
    return SPRINGLS_OK;
}

/* Combines a model with another one in the same window, and empties it on failure. */
SPRINGLS__FN springls_status springls__combine_in_window(springls_context *ctx, springls_operation operation,
                                                         springls_context *other)
{
    springls__surface surfaces[2];
    springls__calm_aside aside;
    springls_status status;
    memset(surfaces, 0, sizeof surfaces);
    memset(&aside, 0, sizeof aside);
    status = springls__put_calm_aside(ctx, &aside);
    if (status == SPRINGLS_OK) status = springls__combine(ctx, operation, other, surfaces);
    if (status == SPRINGLS_OK) {
        springls__put_calm_back(ctx, &aside);
        if (aside.slot_count) springls__find_awake(ctx);
    }
    springls__calm_aside_free(ctx, &aside);
    springls__surface_free(ctx, &surfaces[0]);
    springls__surface_free(ctx, &surfaces[1]);
    return springls__clear_on_failure(ctx, status);
}

/* Combines a model with a copy of another one, which has another window, or springls that its phi has not followed. */
SPRINGLS__FN springls_status springls__combine_copy(springls_context *ctx, springls_operation operation, springls_context *other)
{
    springls_context *copy = NULL;
    springls_status status = springls__copy_into_window(ctx, other, &copy);
    if (status == SPRINGLS_OK) status = springls__combine_in_window(ctx, operation, copy);
    springls_destroy(copy);
    return status;
}

SPRINGLS_API springls_status springls_combine(springls_context *ctx, springls_operation operation, springls_context *other)
{
    springls_status status;
    int bricks[3];
    bool apart, moved = false;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_operands(ctx, operation, other));
    SPRINGLS__TRY(springls__begin_change(ctx));
    status = springls__begin_reading(other);
    if (status == SPRINGLS_OK) status = springls__moved_since_phi(other, &moved);
    if (status == SPRINGLS_OK) status = springls__use_host(other, false);
    if (status != SPRINGLS_OK) return springls__other_failed(ctx, status, other);
    apart = !springls__same_place(&ctx->window, &other->window);
    if (operation == SPRINGLS_OPERATION_UNION && apart) SPRINGLS__TRY(springls__window_of_both(ctx, other, bricks)); /* or refuse */
    SPRINGLS__TRY(springls__follow_written(ctx));
    SPRINGLS__TRY(springls__use_host_calmly(ctx, true));
    apart = !springls__same_place(&ctx->window, &other->window);
    if (operation == SPRINGLS_OPERATION_UNION && apart) {
        SPRINGLS__TRY(springls__window_of_both(ctx, other, bricks));
        if (ctx->desc.follow) SPRINGLS__TRY(springls__move_window(ctx, bricks));
    }
    return apart || moved ? springls__combine_copy(ctx, operation, other) : springls__combine_in_window(ctx, operation, other);
}

/* Samples the function in the window of the model into a new one. */
SPRINGLS__FN springls_status springls__implicit_alike(springls_context *ctx, springls_implicit_fn fn, void *user,
                                                      springls_context **other)
{
    springls_status status;
    SPRINGLS__TRY(springls__create_alike(ctx, "combine_implicit", other));
    memcpy((*other)->home, ctx->window.offset, sizeof (*other)->home);
    status = springls_set_implicit(*other, fn, user);
    if (status == SPRINGLS_OK) return SPRINGLS_OK;
    springls__fail(ctx, status, "combine_implicit: %.200s", (*other)->error);
    springls_destroy(*other);
    *other = NULL;
    return status;
}

SPRINGLS_API springls_status springls_combine_implicit(springls_context *ctx, springls_operation operation,
                                                       springls_implicit_fn fn, void *user)
{
    springls_context *other = NULL;
    springls_status status;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!fn) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "combine_implicit: the function is NULL");
    SPRINGLS__TRY(springls__check_operation(ctx, operation));
    SPRINGLS__TRY(springls__begin_change(ctx));
    SPRINGLS__TRY(springls__implicit_alike(ctx, fn, user, &other));
    status = springls__follow_written(ctx);
    if (status == SPRINGLS_OK && !springls__same_place(&ctx->window, &other->window)) { /* the model followed out of it */
        springls_destroy(other);
        status = springls__implicit_alike(ctx, fn, user, &other);
    }
    if (status == SPRINGLS_OK) status = springls_combine(ctx, operation, other);
    springls_destroy(other);
    return status;
}

#endif
