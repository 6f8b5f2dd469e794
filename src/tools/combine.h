/* combine.h - computes the union, intersection or difference of two models. The springls of each that bound the result stay, by
   the side of the other's level set on which they lie. phi is the minimum or maximum of the two; where that has a crease, at
   the seam, the springls correct it (project, keep_edges). A table, like a step, so that it can be left after any entry; until it has
   ended, the model can go back to what it was. */
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
#include "cell_marks.h"
#include "combine_undo.h"
#include "combined_originals.h"
#include "completion.h"

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
    rule.keep_same = !second && !difference; /* if both operands have springls, one of the two is enough */
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

/* Widens a box to a springl, with room for the gaps between triangles. */
SPRINGLS__FN springls__box springls__box_add_springl(springls__box box, const springls__springl *s)
{
    const float r = s->bounding_radius + SPRINGLS__TRIANGLE_GAP;
    box = springls__box_add(box, springls__v3_make(s->p.x - r, s->p.y - r, s->p.z - r));
    return springls__box_add(box, springls__v3_make(s->p.x + r, s->p.y + r, s->p.z + r));
}

SPRINGLS__FN bool springls__reaches_box(const springls__springl *s, const springls__box *box)
{
    const float r = s->bounding_radius;
    return s->p.x + r >= box->lower.x && s->p.y + r >= box->lower.y && s->p.z + r >= box->lower.z && s->p.x - r <= box->upper.x
           && s->p.y - r <= box->upper.y && s->p.z - r <= box->upper.z;
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

/* Returns how a springl lies to the other solid's surface: to the nearest triangle of that solid or, without triangles, to its level set.
   Triangles come first because phi is inexact between voxels at sharp edges. */
SPRINGLS__FN int springls__facing_surface(const springls__side_rule *rule, const springls__springl *s, float phi)
{
    springls__v3 n;
    springls__near_walk walk;
    float cosine, d2, least = FLT_MAX;
    int i, to_triangle, nearest = -1, facing = SPRINGLS__OFF_SURFACE;
    if (springls__fabs(phi) > SPRINGLS__PHI_ERROR) return SPRINGLS__OFF_SURFACE;
    n = springls__springl_normal(*s);
    walk = springls__near_walk_begin(rule->surface, s->p, SPRINGLS__TRIANGLE_GAP);
    while ((i = springls__near_walk_next(&walk)) >= 0) {
        to_triangle = springls__facing_triangle(springls__surface_triangle(rule->surface, i), s->p, n, &d2);
        if (to_triangle == SPRINGLS__OFF_SURFACE || d2 > least || (d2 == least && i > nearest)) continue;
        least = d2;
        nearest = i;
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
    const float phi = springls__sample_other(rule, s->p);
    const int facing = springls__facing_surface(rule, s, phi);
    if (facing == SPRINGLS__FACING_SAME) return rule->keep_same;
    if (facing == SPRINGLS__FACING_OPPOSITE) return rule->keep_opposite;
    return rule->sign * phi > 0.0f;
}

/* Moves the corners of a springl that lie beyond the seam onto it, towards the particle. */
SPRINGLS__FN springls__springl springls__pull_to_surface(const springls__side_rule *rule, springls__springl s)
{
    const float min_distance = 0.1f; /* voxels: nearer to the seam a triangle would have no area left */
    float phi_p;
    int m;
    if (!springls__reaches_box(&s, &rule->box)) return s; /* as most, where the other is a tool */
    phi_p = rule->sign * springls__sample_other(rule, s.p);
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

/* Returns whether an operation leaves phi as it is where the other operand has a slot: no value is beyond those of constant bricks. */
SPRINGLS__FN bool springls__leaves_brick(springls_operation operation, int other_slot)
{
    return other_slot == (operation == SPRINGLS_OPERATION_INTERSECTION ? SPRINGLS__INSIDE : SPRINGLS__OUTSIDE);
}

/* Computes phi of the result in the active brick of an entry, into phi_next; ends the calm of the octants that change. */
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
        if (out[v] != phi[v]) g->calm[slot * SPRINGLS__OCTANTS + springls__octant_of(at)] = 0;
    }
}

/* ---- springls ---- */

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

/* ---- what is in progress ---- */

/* A combination in progress: ctx->step.combination. */
typedef struct springls__combination {
    springls_operation operation;
    springls_context *other;         /* the other model, or a copy                                             */
    uint64_t other_version;          /* its model_version, which has to stay                                   */
    uint64_t other_attributes;       /* its attributes_version, which has to stay                              */
    springls__side_rule rule[2];     /* for the springls of this model and of the other                        */
    springls__surface surfaces[2];   /* of the triangles of both that may touch those of the other             */
    springls__buffer near_memory;    /* the springls of this model that may meet the other, ascending          */
    int near_count;
    springls__box box[2];            /* of these, and of the springls of the other                             */
    springls__cell_marks marks;      /* of the particles of one of them                                        */
    springls__surface *building;     /* the hierarchy that is being built; NULL: none                          */
    springls__bvh_progress progress;
    springls__both_originals originals;
    springls__both_references references;
    springls__buffer kept[2];        /* KEEP or REMOVE, for each springl of both                               */
    int count, staying, added, next; /* springls: before; that stay; that come; of the other that come next    */
    springls__calm_aside aside;
    springls__completion completion;
    springls__undo undo;
} springls__combination;

/* ---- which springls stay ---- */

/* Returns the box beyond which a grid is outside, bricks, and the domain's border widened without end; *uniform: false where it is
   inside somewhere beyond. */
SPRINGLS__FN springls__box springls__box_beyond_which_outside(const springls__grid *g, bool *uniform)
{
    springls__box box = springls__box_of_bricks(g);
    const int entries = (int)springls__entry_count(g);
    int i, o[3];
    if (box.lower.x <= 0.0f) box.lower.x = -FLT_MAX;
    if (box.lower.y <= 0.0f) box.lower.y = -FLT_MAX;
    if (box.lower.z <= 0.0f) box.lower.z = -FLT_MAX;
    if (box.upper.x >= (float)g->size[0]) box.upper.x = FLT_MAX;
    if (box.upper.y >= (float)g->size[1]) box.upper.y = FLT_MAX;
    if (box.upper.z >= (float)g->size[2]) box.upper.z = FLT_MAX;
    *uniform = true;
    for (i = 0; i < entries && *uniform; i++) {
        if (g->top[i] != SPRINGLS__INSIDE) continue;
        springls__entry_origin(g, i, o);
        *uniform = (float)o[0] > box.lower.x && (float)o[1] > box.lower.y && (float)o[2] > box.lower.z && (float)o[0] < box.upper.x
                   && (float)o[1] < box.upper.y && (float)o[2] < box.upper.z;
    }
    return box;
}

SPRINGLS__FN int *springls__near_springls(const springls__combination *c) { return (int *)c->near_memory.data; }

/* Lists the springls that the other model may cut, cover or touch: all others stay, so that an edit costs what it cuts. An intersection
   lists all. */
SPRINGLS__FN springls_status springls__find_near_springls(springls_context *ctx)
{
    springls__combination *c = ctx->step.combination;
    const springls__springl *s = ctx->model.set.s;
    springls__box box;
    bool uniform;
    int i, *near_springls;
    if (springls__contact_bodies_are_new(ctx)) SPRINGLS__TRY(springls__find_contact_bodies(ctx));
    c->count = ctx->model.set.count;
    c->box[0] = c->box[1] = springls__box_empty();
    for (i = 0; i < c->other->model.set.count; i++) c->box[1] = springls__box_add_springl(c->box[1], &c->other->model.set.s[i]);
    box = springls__box_beyond_which_outside(&c->other->model.grid, &uniform);
    box = springls__box_add(springls__box_add(box, c->box[1].lower), c->box[1].upper);
    uniform = uniform && c->operation != SPRINGLS_OPERATION_INTERSECTION;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->near_memory, (size_t)c->count + 1, sizeof(int), 0));
    near_springls = springls__near_springls(c);
    for (i = c->near_count = 0; i < c->count; i++) {
        if (uniform && !springls__reaches_box(&s[i], &box)) continue;
        near_springls[c->near_count++] = i;
        c->box[0] = springls__box_add_springl(c->box[0], &s[i]);
    }
    return SPRINGLS_OK;
}

/* Returns how many springls of this model (of: 0) or of the other (1) may meet the second of the two; their numbers: springls__meeting. */
SPRINGLS__FN int springls__meeting_count(const springls__combination *c, int of)
{
    return of ? c->other->model.set.count : c->near_count;
}

SPRINGLS__FN const springls__springl *springls__meeting(const springls_context *ctx, const springls__combination *c, int of, int i)
{
    return of ? &c->other->model.set.s[i] : &ctx->model.set.s[springls__near_springls(c)[i]];
}

/* Marks the cells with particles of this model (of: 0) or of the other (1), in a box around the springls of the second of the two. */
SPRINGLS__FN springls_status springls__mark_particles(springls_context *ctx, springls__combination *c, int of)
{
    const springls__box a = c->box[0], b = c->box[1];
    const int count = springls__meeting_count(c, of);
    int i;
    SPRINGLS__TRY(springls__cell_marks_begin(ctx, &c->marks,
                                             springls__v3_make(springls__max(a.lower.x, b.lower.x), springls__max(a.lower.y, b.lower.y),
                                                               springls__max(a.lower.z, b.lower.z)),
                                             springls__v3_make(springls__min(a.upper.x, b.upper.x), springls__min(a.upper.y, b.upper.y),
                                                               springls__min(a.upper.z, b.upper.z)), 1.0f));
    for (i = 0; i < count; i++) {
        const springls__springl *s = springls__meeting(ctx, c, of, i);
        if (springls__reaches_box(s, &c->box[1 - of])) springls__mark_cells_around(&c->marks, s->p, SPRINGLS__TRIANGLE_GAP);
    }
    return SPRINGLS_OK;
}

/* Finds the triangles of this model (of: 0) or of the other (1) that come near marked cells, and begins to build their hierarchy: no
   other triangle is ever asked for. */
SPRINGLS__FN springls_status springls__gather_meeting(springls_context *ctx, springls__combination *c, int of)
{
    const int meeting = springls__meeting_count(c, of);
    springls__surface *surface = &c->surfaces[of];
    int i, m, count = 0;
    for (i = 0; i < meeting; i++) count += springls__reaches_box(springls__meeting(ctx, c, of, i), &c->box[1 - of]);
    SPRINGLS__TRY(springls__surface_reserve(ctx, surface, count));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->originals.items, (size_t)count + 1, sizeof(springls__bvh_item), 0));
    for (i = count = 0; i < meeting; i++) {
        const springls__springl *s = springls__meeting(ctx, c, of, i);
        const float r = s->bounding_radius;
        const springls__v3 p = s->p;
        if (!springls__reaches_box(s, &c->box[1 - of])
            || !springls__visit_cells(&c->marks, springls__v3_make(p.x - r, p.y - r, p.z - r),
                                      springls__v3_make(p.x + r, p.y + r, p.z + r), false)) continue;
        for (m = 0; m < 3; m++) surface->points[3 * count + m] = s->q[m];
        count++;
    }
    if (count == 0) return SPRINGLS_OK;
    c->building = surface;
    springls__surface_build_begin(surface, count, (springls__bvh_item *)c->originals.items.data, &c->progress);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__mark_other_particles(springls_context *ctx)
{
    return springls__mark_particles(ctx, ctx->step.combination, 1);
}

SPRINGLS__FN springls_status springls__gather_own(springls_context *ctx)
{
    return springls__gather_meeting(ctx, ctx->step.combination, 0);
}

SPRINGLS__FN springls_status springls__mark_own_particles(springls_context *ctx)
{
    return springls__mark_particles(ctx, ctx->step.combination, 0);
}

SPRINGLS__FN springls_status springls__gather_other(springls_context *ctx)
{
    return springls__gather_meeting(ctx, ctx->step.combination, 1);
}

SPRINGLS__FN bool springls__builds_hierarchy(const springls_context *ctx) { return ctx->step.combination->building != NULL; }

/* Goes on with the hierarchy, for a fraction of a millisecond. */
SPRINGLS__FN springls_status springls__build_hierarchy(springls_context *ctx)
{
    springls__combination *c = ctx->step.combination;
    const int most = 4096;
    if (!springls__surface_build_more(c->building, (springls__bvh_item *)c->originals.items.data, &c->progress, most)) c->building = NULL;
    return SPRINGLS_OK;
}

static const springls__entry springls__build[] = {
    SPRINGLS__REPEAT_WHILE(springls__builds_hierarchy)
        SPRINGLS__DO(springls__build_hierarchy)
    SPRINGLS__END
SPRINGLS__END };

/* Decides which springls of this model stay, of those listed. */
SPRINGLS__FN void springls__mark_own_work(void *arg, int begin, int end, float *memory)
{
    const springls_context *ctx = (const springls_context *)arg;
    const springls__combination *c = ctx->step.combination;
    const int *near_springls = springls__near_springls(c);
    uint8_t *kept = (uint8_t *)c->kept[0].data;
    (void)memory;
    for (; begin < end; begin++)
        kept[near_springls[begin]] = springls__is_kept(&c->rule[0], &ctx->model.set.s[near_springls[begin]]) ? SPRINGLS__KEEP
                                                                                                             : SPRINGLS__REMOVE;
}

SPRINGLS__FN void springls__mark_other_work(void *arg, int begin, int end, float *memory)
{
    const springls__combination *c = ((const springls_context *)arg)->step.combination;
    uint8_t *kept = (uint8_t *)c->kept[1].data;
    (void)memory;
    for (; begin < end; begin++)
        kept[begin] = springls__is_kept(&c->rule[1], &c->other->model.set.s[begin]) ? SPRINGLS__KEEP : SPRINGLS__REMOVE;
}

/* Both level sets are as they were. Ends with a loop. */
SPRINGLS__FN springls_status springls__mark_own(springls_context *ctx)
{
    springls__combination *c = ctx->step.combination;
    c->rule[0] = springls__rule_of(&c->other->model.grid, &c->surfaces[1], c->operation, false);
    c->rule[1] = springls__rule_of(&ctx->model.grid, &c->surfaces[0], c->operation, true);
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->kept[0], (size_t)c->count, 1, 0));
    memset(c->kept[0].data, SPRINGLS__KEEP, (size_t)c->count);
    springls__loop_over(ctx, c->near_count, 64, 0, springls__mark_own_work, ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__mark_other(springls_context *ctx)
{
    springls__combination *c = ctx->step.combination;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->kept[1], (size_t)c->other->model.set.count, 1, 0));
    springls__loop_over(ctx, c->other->model.set.count, 64, 0, springls__mark_other_work, ctx);
    return SPRINGLS_OK;
}

/* Counts the springls that are not kept, of `count` listed ones; NULL: of the first ones. */
SPRINGLS__FN int springls__count_removed(const springls__buffer *kept, const int *listed, int count)
{
    const uint8_t *action = (const uint8_t *)kept->data;
    int i, n = 0;
    for (i = 0; i < count; i++) n += action[listed ? listed[i] : i] == SPRINGLS__REMOVE;
    return n;
}

/* Counts the springls that stay, and makes room for them. Fails when none do, or more than max_springls. */
SPRINGLS__FN springls_status springls__room_for_both(springls_context *ctx)
{
    springls__combination *c = ctx->step.combination;
    int i, sum;
    c->staying = c->count - springls__count_removed(&c->kept[0], springls__near_springls(c), c->near_count);
    c->added = c->other->model.set.count - springls__count_removed(&c->kept[1], NULL, c->other->model.set.count);
    sum = c->staying + c->added;
    if (sum == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "combine: nothing is left");
    if (sum > ctx->desc.max_springls)
        return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "combine: more than %d springls", ctx->desc.max_springls);
    SPRINGLS__TRY(springls__constellation_reserve(ctx, springls__imax(c->count, sum)));
    for (i = 0; i < ctx->attribute_count; i++)
        SPRINGLS__TRY(springls__values_reserve(ctx, &ctx->attributes[i], sum, c->count));
    return SPRINGLS_OK;
}

/* ---- what has been, to go back to ---- */

enum { SPRINGLS__SAVED_PIECE = 16384 }; /* bytes */

SPRINGLS__FN void springls__save_work(void *arg, int begin, int end, float *memory)
{
    springls_context *ctx = (springls_context *)arg;
    const springls__undo *undo = &ctx->step.combination->undo;
    const size_t last = (size_t)SPRINGLS__SAVED_PIECE * (size_t)end;
    (void)memory;
    springls__undo_copy(ctx, undo, (size_t)SPRINGLS__SAVED_PIECE * (size_t)begin, last < undo->all ? last : undo->all, false);
}

/* Saves the model. Ends with a loop. */
SPRINGLS__FN springls_status springls__save_model(springls_context *ctx)
{
    springls__undo *undo = &ctx->step.combination->undo;
    SPRINGLS__TRY(springls__undo_begin(ctx, undo));
    springls__loop_over(ctx, (int)(undo->all / SPRINGLS__SAVED_PIECE) + 1, 4, 0, springls__save_work, ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__model_saved(springls_context *ctx)
{
    ctx->step.combination->undo.whole = true;
    return springls__put_calm_aside(ctx, &ctx->step.combination->aside);
}

/* ---- originals ---- */

SPRINGLS__FN springls_status springls__combine_grids(springls_context *ctx)
{
    ctx->reference_stamp = 0;
    SPRINGLS__TRY(springls__bricks_of_both(ctx, &ctx->step.combination->other->model.grid));
    if (springls__may_sleep(ctx)) springls__rest_all(ctx); /* the new bricks too, which wake where phi changes */
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__add_originals(springls_context *ctx)
{
    springls__combination *c = ctx->step.combination;
    return springls__originals_begin(ctx, &c->originals, &c->other->original, c->operation == SPRINGLS_OPERATION_DIFFERENCE);
}

SPRINGLS__FN bool springls__drops(const springls_context *ctx) { return ctx->step.combination->originals.drops; }

/* Finds the tools that springls come from. Ends with a loop. */
SPRINGLS__FN springls_status springls__find_tools(springls_context *ctx)
{
    springls__loop_over(ctx, ctx->model.set.count, 64, 0, springls__find_tools_work, &ctx->step.combination->originals);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__tools_found(springls_context *ctx)
{
    springls__chain_tools(&ctx->step.combination->originals);
    return SPRINGLS_OK;
}

/* Room for originals: in parts, because memory that has never been touched takes its time. */
SPRINGLS__FN springls_status springls__room_for_sources(springls_context *ctx)
{
    return springls__sources_room(ctx, &ctx->step.combination->originals);
}

SPRINGLS__FN springls_status springls__room_for_points(springls_context *ctx)
{
    const springls__both_originals *both = &ctx->step.combination->originals;
    return springls__points_room(ctx, both->to, (size_t)ctx->original.count + (size_t)both->other->count + 1, (size_t)both->count);
}

SPRINGLS__FN springls_status springls__room_for_nodes(springls_context *ctx)
{
    return springls__hierarchy_room(ctx, &ctx->step.combination->originals);
}

SPRINGLS__FN bool springls__copies_originals(const springls_context *ctx)
{
    const springls__both_originals *both = &ctx->step.combination->originals;
    return both->next < ctx->original.count + both->other->count;
}

SPRINGLS__FN springls_status springls__copy_originals(springls_context *ctx)
{
    return springls__copy_some_originals(ctx, &ctx->step.combination->originals, 4096);
}

SPRINGLS__FN springls_status springls__begin_parts(springls_context *ctx)
{
    springls__hierarchy_begin(ctx, &ctx->step.combination->originals);
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__copies_parts(const springls_context *ctx)
{
    return springls__has_part_to_copy(&ctx->step.combination->originals);
}

SPRINGLS__FN springls_status springls__copy_parts(springls_context *ctx)
{
    springls__copy_some_parts(&ctx->step.combination->originals, 4096);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__take_originals(springls_context *ctx)
{
    springls__both_originals *both = &ctx->step.combination->originals;
    springls__hierarchy_end(ctx, both);
    if (!both->joined) springls__exchange_originals(ctx, both);
    return SPRINGLS_OK;
}

/* Makes the reference level set of both originals. Ends with a loop. */
SPRINGLS__FN springls_status springls__add_references(springls_context *ctx)
{
    springls__both_references *both = &ctx->step.combination->references;
    both->first = &ctx->model.reference;
    both->second = &ctx->step.combination->other->model.reference;
    both->grid = *both->first;
    SPRINGLS__TRY(springls__reserve_references(ctx, both));
    springls__fill(both->grid.phi, SPRINGLS__OUTSIDE, both->first->far_value);
    springls__fill(both->grid.phi, SPRINGLS__INSIDE, -both->first->far_value);
    springls__loop_over(ctx, (int)springls__entry_count(&both->grid), 64, 0, springls__merge_references_work, both);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__take_references(springls_context *ctx)
{
    springls__exchange_references(ctx, &ctx->step.combination->references);
    return SPRINGLS_OK;
}

/* ---- springls ---- */

/* Marks what is near springls of this model that do not stay. They lie in the box of the other model, or no springl stays. */
SPRINGLS__FN springls_status springls__mark_cut(springls_context *ctx)
{
    springls__combination *c = ctx->step.combination;
    const uint8_t *kept = (const uint8_t *)c->kept[0].data;
    const int *near_springls = springls__near_springls(c);
    int k;
    SPRINGLS__TRY(springls__change_marks_begin(ctx, &c->completion.change, c->box[1]));
    for (k = 0; k < c->near_count; k++)
        if (kept[near_springls[k]] == SPRINGLS__REMOVE) springls__mark_change(&c->completion.change, ctx->model.set.s[near_springls[k]].p);
    return SPRINGLS_OK;
}

/* Lists those of the near springls that stay, by the numbers that they have when the others are gone. */
SPRINGLS__FN void springls__renumber_near_springls(springls__combination *c)
{
    const uint8_t *kept = (const uint8_t *)c->kept[0].data;
    int *near_springls = springls__near_springls(c);
    int k, removed = 0;
    for (k = 0; k < c->near_count; k++) {
        if (kept[near_springls[k]] == SPRINGLS__REMOVE) removed++;
        else near_springls[k - removed] = near_springls[k] - removed;
    }
    c->near_count -= removed;
}

/* Removes the springls of this model that do not stay. */
SPRINGLS__FN springls_status springls__remove_cut(springls_context *ctx)
{
    const springls__combination *c = ctx->step.combination;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, contract_action, c->count));
    memcpy(springls__contract_action(&ctx->model), c->kept[0].data, (size_t)c->count);
    ctx->model.grid.some_asleep = 0; /* or compacting would find who sleeps in vain: find_awake does, and nothing asks before */
    SPRINGLS__TRY(springls__attributes_before_removal(ctx));
    springls__stir(ctx, SPRINGLS__STIR_CONTRACTED, 0, c->count);
    SPRINGLS__TRY(springls__constellation_compact(ctx));
    springls__attributes_after_removal(ctx, c->count);
    springls__renumber_near_springls(ctx->step.combination);
    springls__constellation_changed_behind(ctx, ctx->keyed);
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__pull_work(void *arg, int begin, int end, float *memory)
{
    const springls_context *ctx = (const springls_context *)arg;
    const int *near_springls = springls__near_springls(ctx->step.combination);
    springls__springl *s = ctx->model.set.s;
    (void)memory;
    for (; begin < end; begin++)
        s[near_springls[begin]] = springls__pull_to_surface(&ctx->step.combination->rule[0], s[near_springls[begin]]);
}

/* Pulls the springls that stay to the seam; phi is still as it was. Ends with a loop. */
SPRINGLS__FN springls_status springls__pull_own(springls_context *ctx)
{
    springls__loop_over(ctx, ctx->step.combination->near_count, 64, 0, springls__pull_work, ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__takes_more(const springls_context *ctx)
{
    return ctx->step.combination->next < ctx->step.combination->other->model.set.count;
}

/* Takes springls of the other model, some at a time. */
SPRINGLS__FN springls_status springls__take_some(springls_context *ctx)
{
    springls__combination *c = ctx->step.combination;
    const bool turn = c->operation == SPRINGLS_OPERATION_DIFFERENCE;
    const uint8_t *kept = (const uint8_t *)c->kept[1].data;
    const int end = springls__imin(c->next + 1024, c->other->model.set.count);
    for (; c->next < end; c->next++)
        if (kept[c->next] == SPRINGLS__KEEP) springls__copy_other_springl(ctx, c->other, c->next, &c->rule[1], turn);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__springls_taken(springls_context *ctx)
{
    const springls__combination *c = ctx->step.combination;
    const int keyed = ctx->keyed ? c->near_count : 0;
    springls__arguments args;
    int i;
    for (i = 0; i < keyed; i++) { /* a triangle that was pulled may no longer be too large for a cell */
        args.cell_key.first = springls__near_springls(c)[i];
        springls__cell_key_element(&ctx->model, args, 0);
    }
    for (i = c->staying; i < ctx->model.set.count; i++) springls__mark_change(&c->completion.change, ctx->model.set.s[i].p);
    springls__stir(ctx, SPRINGLS__STIR_ALL, c->staying, c->added);
    if (ctx->last_contact_body) ctx->last_contact_body += c->other->last_contact_body + 1u;
    if (c->operation != SPRINGLS_OPERATION_UNION) ctx->last_contact_body = 0; /* bodies consist of springls of both */
    ctx->stats.removed += c->count - c->staying;
    ctx->stats.added += c->added;
    springls__constellation_changed_behind(ctx, springls__imin(ctx->keyed, c->staying));
    return SPRINGLS_OK;
}

/* ---- phi ---- */

SPRINGLS__FN void springls__combine_bricks_work(void *arg, int begin, int end, float *memory)
{
    springls_context *ctx = (springls_context *)arg;
    const springls__combination *c = ctx->step.combination;
    springls__grid *g = &ctx->model.grid;
    (void)memory;
    for (; begin < end; begin++)
        springls__combine_brick(g, c->operation, &c->other->model.grid, springls__entry_of_brick(g, g->slot_brick[g->active[begin]]));
}

/* Computes phi of the result. The bricks of both are active. Ends with a loop. */
SPRINGLS__FN springls_status springls__combine_bricks(springls_context *ctx)
{
    springls__loop_over(ctx, ctx->model.grid.active_count, 4, 0, springls__combine_bricks_work, ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__level_sets_combined(springls_context *ctx)
{
    const springls__combination *c = ctx->step.combination;
    springls__grid *g = &ctx->model.grid;
    int i, entries = (int)springls__entry_count(g);
    for (i = 0; i < entries; i++)
        if (g->top[i] < SPRINGLS__FIRST_SLOT)
            g->top[i] = springls__combined_phi(c->operation, g->phi[(size_t)g->top[i] * SPRINGLS__BRICK_VOXELS],
                                               *springls__phi_of_entry(&c->other->model.grid, g, i)) < 0.0f
                      ? SPRINGLS__INSIDE : SPRINGLS__OUTSIDE;
    springls__swap_phi(ctx);
    ctx->omega_fresh = false;
    return SPRINGLS_OK;
}

/* Goes back to what was awake before, where it has not changed. */
SPRINGLS__FN springls_status springls__combination_end(springls_context *ctx)
{
    const springls__calm_aside *aside = &ctx->step.combination->aside;
    if (!springls__has_inside(&ctx->model.grid)) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "combine: nothing is left");
    springls__put_calm_back(ctx, aside);
    return aside->slot_count ? springls__find_awake(ctx) : SPRINGLS_OK;
}

/* Until the model is saved it does not change. What costs most is the completion of what is cut. */
static const springls__entry springls__combine[] = {
    SPRINGLS__DO(springls__find_near_springls)
    SPRINGLS__DO(springls__mark_other_particles)
    SPRINGLS__DO(springls__gather_own)
    SPRINGLS__CALL(springls__build)
    SPRINGLS__DO(springls__mark_own_particles)
    SPRINGLS__DO(springls__gather_other)
    SPRINGLS__CALL(springls__build)
    SPRINGLS__DO(springls__mark_own)
    SPRINGLS__DO(springls__mark_other)
    SPRINGLS__DO(springls__room_for_both)
    SPRINGLS__DO(springls__save_model)
    SPRINGLS__DO(springls__model_saved)
    SPRINGLS__DO(springls__combine_grids)
    SPRINGLS__DO(springls__add_originals)
    SPRINGLS__IF(springls__drops)
        SPRINGLS__DO(springls__find_tools)
        SPRINGLS__DO(springls__tools_found)
    SPRINGLS__END
    SPRINGLS__DO(springls__room_for_sources)
    SPRINGLS__DO(springls__room_for_points)
    SPRINGLS__DO(springls__room_for_nodes)
    SPRINGLS__REPEAT_WHILE(springls__copies_originals) SPRINGLS__DO(springls__copy_originals) SPRINGLS__END
    SPRINGLS__DO(springls__begin_parts)
    SPRINGLS__REPEAT_WHILE(springls__copies_parts) SPRINGLS__DO(springls__copy_parts) SPRINGLS__END
    SPRINGLS__DO(springls__take_originals)
    SPRINGLS__DO(springls__add_references)
    SPRINGLS__DO(springls__take_references)
    SPRINGLS__DO(springls__mark_cut)
    SPRINGLS__DO(springls__remove_cut)
    SPRINGLS__DO(springls__pull_own)
    SPRINGLS__REPEAT_WHILE(springls__takes_more) SPRINGLS__DO(springls__take_some) SPRINGLS__END
    SPRINGLS__DO(springls__springls_taken)
    SPRINGLS__DO(springls__combine_bricks)
    SPRINGLS__DO(springls__level_sets_combined)
    SPRINGLS__DO(springls__cell_list_build)
    SPRINGLS__DO(springls__find_awake)
    SPRINGLS__CALL(springls__complete)
    SPRINGLS__DO(springls__combination_end)
SPRINGLS__END };

/* ---- begin and end ---- */

/* Fails if the other model has changed; brings all arrays to the host, which has no kernel for most of the work. */
SPRINGLS__FN springls_status springls__combination_go_on(springls_context *ctx)
{
    const springls__combination *c = ctx->step.combination;
    if (c->other->model_version != c->other_version || c->other->attributes_version != c->other_attributes)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "combine: the other model has changed since combine_begin");
    return springls__to_host(ctx, SPRINGLS__ALL_BITS, SPRINGLS__ALL_BITS & ~SPRINGLS__WORK_BITS);
}

/* Frees what a combination had. On failure the model is as it was before; empty where nothing is left. */
SPRINGLS__FN void springls__combination_ended(springls_context *ctx, springls_status status)
{
    springls__combination *c = ctx->step.combination;
    ctx->step.combination = NULL;
    ctx->step.go_on = NULL;
    ctx->completion = NULL;
    if (status != SPRINGLS_OK) {
        springls__undo_originals(ctx, &c->originals);
        if (c->references.taken) springls__exchange_references(ctx, &c->references);
        if (c->undo.whole) springls__undo_back(ctx, &c->undo);
    }
    springls__surface_free(ctx, &c->surfaces[0]);
    springls__surface_free(ctx, &c->surfaces[1]);
    springls__buffer_free(ctx, &c->marks.memory);
    springls__both_originals_free(ctx, &c->originals);
    springls__references_free(ctx, &c->references);
    springls__buffer_free(ctx, &c->near_memory);
    springls__buffer_free(ctx, &c->kept[0]);
    springls__buffer_free(ctx, &c->kept[1]);
    springls__calm_aside_free(ctx, &c->aside);
    springls__completion_free(ctx, &c->completion);
    springls_destroy(ctx->step.owned);
    ctx->step.owned = NULL;
    springls__release(ctx, c, sizeof *c);
    if (status == SPRINGLS_EMPTY_MODEL) springls__clear_model(ctx);
}

/* Begins to combine a model with another one in the same window; owned: the same, to be destroyed at the end; a caller
   destroys it if none begins. */
SPRINGLS__FN springls_status springls__combination_begin(springls_context *ctx, springls_operation operation, springls_context *other,
                                                         springls_context *owned)
{
    springls__combination *c = (springls__combination *)springls__allocate(ctx, sizeof *c);
    if (!c) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "combine: out of memory");
    memset(c, 0, sizeof *c);
    c->operation = operation;
    c->other = other;
    c->other_version = other->model_version;
    c->other_attributes = other->attributes_version;
    c->completion.project = true;
    memset(&ctx->step, 0, sizeof ctx->step);
    ctx->step.combination = c;
    ctx->step.owned = owned;
    ctx->step.go_on = springls__combination_go_on;
    ctx->step.ended = springls__combination_ended;
    ctx->completion = &c->completion;
    springls__begin_step(ctx, springls__combine);
    ctx->work.on_device = false;
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

/* Begins to combine checked operands. The other operand is copied first if it lies in another window, or if its phi lags behind its
   springls. owned: the other operand if the combination is to destroy it, or NULL. */
SPRINGLS__FN springls_status springls__combine_begin(springls_context *ctx, springls_operation operation, springls_context *other,
                                                     springls_context *owned)
{
    springls_status status;
    springls_context *copy = NULL;
    int bricks[3];
    bool apart, moved = false;
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
    if (!apart && !moved) return springls__combination_begin(ctx, operation, other, owned);
    status = springls__copy_into_window(ctx, other, &copy);
    if (status == SPRINGLS_OK) status = springls__combination_begin(ctx, operation, copy, copy);
    if (status != SPRINGLS_OK) springls_destroy(copy);
    return status;
}

SPRINGLS__TOOLS_API springls_status springls_combine_begin(springls_context *ctx, springls_operation operation, springls_context *other)
{
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_operands(ctx, operation, other));
    SPRINGLS__TRY(springls__begin_change(ctx));
    return springls__combine_begin(ctx, operation, other, NULL);
}

SPRINGLS__TOOLS_API bool springls_combine_in_progress(const springls_context *ctx)
{
    return ctx && ctx->step.active && ctx->step.combination;
}

SPRINGLS__TOOLS_API springls_status springls_combine_continue(springls_context *ctx, double seconds, bool *done)
{
    const bool in_progress = springls_combine_in_progress(ctx);
    springls_status status;
    double until;
    if (done) *done = !in_progress;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!done) return springls__fail_null(ctx, "combine_continue", "done");
    if (springls__is_nan(seconds)) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "combine_continue: the seconds are NaN");
    if (!in_progress) return SPRINGLS_OK;
    until = springls__now(ctx) + (seconds > 0.0 ? seconds : 0.0);
    status = springls__resume_step(ctx, &until);
    *done = !ctx->step.active;
    return status;
}

SPRINGLS__TOOLS_API springls_status springls_combine(springls_context *ctx, springls_operation operation, springls_context *other)
{
    SPRINGLS__TRY(springls_combine_begin(ctx, operation, other));
    return springls__finish_step(ctx);
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

SPRINGLS__TOOLS_API springls_status springls_combine_implicit_begin(springls_context *ctx, springls_operation operation,
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
    if (status == SPRINGLS_OK) status = springls__check_operands(ctx, operation, other);
    if (status == SPRINGLS_OK) status = springls__combine_begin(ctx, operation, other, other);
    if (ctx->step.owned != other) springls_destroy(other);
    return status;
}

SPRINGLS__TOOLS_API springls_status springls_combine_implicit(springls_context *ctx, springls_operation operation,
                                                              springls_implicit_fn fn, void *user)
{
    SPRINGLS__TRY(springls_combine_implicit_begin(ctx, operation, fn, user));
    return springls__finish_step(ctx);
}

#endif
