/* volume_lock.h - keeps the volume of every body (params.volume_lock) by a tiny offset of its springls and of phi along the
   normals. A body's volume is that of the watertight surface, as springls_measure computes it: marching cubes, or the mesh of what
   springls hold (params.contouring), which is made anew after every offset. Target volumes follow the links of components: a split
   shares them out, a merger sums them up. The stage runs on the host, because it needs double precision, which not every device has. */
#ifndef SPRINGLS__STAGES_VOLUME_LOCK_H
#define SPRINGLS__STAGES_VOLUME_LOCK_H

#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "events.h"
#include "evolve.h"

/* What the lock keeps of a current component. */
typedef struct springls__locked_component {
    float offset, moved;    /* of this iteration, of all; smallest spacings */
    int32_t node;           /* root of its tree among the links     */
    uint32_t id;
    bool tiny;
} springls__locked_component;

/* A previous or current component as a node of the links; the numbers are those of all its tree when it is a root. */
typedef struct springls__lock_node {
    double target, volume;
    double area;            /* volume that a small offset gains, for each smallest spacing       */
    double rate;            /* the same of the next offset                                       */
    double volume_before, offset; /* volume before the last offset; that offset, 0 before the first */
} springls__lock_node;

typedef struct springls__lock {
    springls__component_graph graph;
    springls__locked_component *item; /* one a current component              */
    springls__lock_node *node;        /* previous components, then current    */
    int32_t *parent;                  /* their forest                         */
    int32_t *body;                    /* of every voxel of active bricks      */
    double rate_of_area;              /* voxel^3 that an offset gains for an area of the world; 0: a uniform spacing, voxel^2 are that */
} springls__lock;

/* The body that most springls of something belong to (Boyer and Moore's vote): the one that leads so far, and by how many. */
typedef struct springls__body_vote { int32_t body, lead; } springls__body_vote;

SPRINGLS__FN void springls__vote_for_body(springls__body_vote *votes, int32_t body)
{
    if (body < 0) return;
    if (votes->lead == 0) votes->body = body;
    votes->lead += votes->body == body ? 1 : -1;
}

SPRINGLS__FN springls_status springls__clear_votes(springls_context *ctx, int count, springls__body_vote **votes)
{
    int i;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, body_votes, count + 1));
    *votes = springls__body_votes(&ctx->model);
    for (i = 0; i < count; i++) {
        (*votes)[i].body = -1;
        (*votes)[i].lead = 0;
    }
    return SPRINGLS_OK;
}

/* ---- target volumes: previous and current components that are linked have one target together ---- */

SPRINGLS__FN springls_status springls__lock_begin(springls_context *ctx, springls__lock *lock)
{
    const springls__component_graph *graph = &lock->graph;
    size_t current = (size_t)graph->labels.count, nodes = (size_t)graph->previous_count + current, i;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->lock_item_memory, current + 1, sizeof *lock->item, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->lock_node_memory, nodes + 1, sizeof *lock->node, 0));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, lock_parent, nodes + 1));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, body_labels, (size_t)ctx->model.grid.active_count * SPRINGLS__BRICK_VOXELS + 1));
    lock->item = (springls__locked_component *)ctx->lock_item_memory.data;
    lock->node = (springls__lock_node *)ctx->lock_node_memory.data;
    lock->parent = springls__lock_parent(&ctx->model);
    lock->body = springls__body_labels(&ctx->model);
    lock->rate_of_area = springls__is_uniform(ctx->model.grid.metric) ? 0.0
                       : (double)ctx->smallest_spacing / fabs(springls__determinant(ctx->window.to_world));
    memset(lock->item, 0, current * sizeof *lock->item);
    memset(lock->node, 0, nodes * sizeof *lock->node);
    for (i = 0; i < current; i++) lock->item[i].id = graph->labels.item[i].id;
    for (i = 0; i < nodes; i++) {
        lock->parent[i] = (int32_t)i;
        if (i < (size_t)graph->previous_count) lock->node[i].target = graph->previous[i].target;
        else if (!graph->labels.item[i - (size_t)graph->previous_count].cavity)
            lock->node[i].volume = graph->labels.item[i - (size_t)graph->previous_count].surface.volume;
    }
    return SPRINGLS_OK;
}

/* Returns true for a body of a few voxels: it has too little surface for an offset, and counts as part of the largest body. */
SPRINGLS__FN bool springls__is_tiny_body(double volume) { return volume < 10.0; }

/* Joins the trees of linked components, and those of tiny bodies with that of the largest one. */
SPRINGLS__FN void springls__join_linked(springls__lock *lock)
{
    const springls__component_graph *graph = &lock->graph;
    const springls__current_component *current = graph->labels.item;
    int i, largest = -1;
    for (i = 0; i < graph->link_count; i++)
        springls__join_trees(lock->parent, graph->link[i].previous, graph->previous_count + graph->link[i].current);
    for (i = 0; i < graph->labels.count; i++)
        if (!current[i].cavity && (largest < 0 || current[i].surface.volume > current[largest].surface.volume)) largest = i;
    for (i = 0; i < graph->previous_count && largest >= 0; i++)
        if (!graph->previous[i].view.cavity && springls__is_tiny_body(lock->node[i].target))
            springls__join_trees(lock->parent, i, graph->previous_count + largest);
    for (i = 0; i < graph->labels.count; i++) {
        lock->item[i].tiny = !current[i].cavity && springls__is_tiny_body(current[i].surface.volume);
        if (lock->item[i].tiny) springls__join_trees(lock->parent, graph->previous_count + i, graph->previous_count + largest);
    }
}

/* Sums targets and volumes of linked components; a component without a previous one takes its present volume as
   its target. */
SPRINGLS__FN void springls__sum_targets(springls__lock *lock)
{
    const springls__component_graph *graph = &lock->graph;
    int i, nodes = graph->previous_count + graph->labels.count;
    for (i = 0; i < nodes; i++) {
        int32_t root = springls__find_root(lock->parent, i);
        if (root == i) continue;
        lock->node[root].target += lock->node[i].target;
        lock->node[root].volume += lock->node[i].volume;
    }
    for (i = 0; i < graph->labels.count; i++) {
        springls__lock_node *all;
        lock->item[i].node = springls__find_root(lock->parent, graph->previous_count + i);
        all = &lock->node[lock->item[i].node];
        if (!(all->target > 0.0)) all->target = all->volume;
    }
}

/* Finds the body of phi of every voxel of active bricks: outside, the one that steepest descent of phi leads to. */
SPRINGLS__FN void springls__label_bodies(const springls__grid *g, const springls__labels *l, springls__lock *lock)
{
    int i, v, o[3], at[3];
    for (i = 0; i < g->active_count; i++) {
        springls__slot_origin(g, g->active[i], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            springls__voxel_of_brick(o, v, at);
            lock->body[i * SPRINGLS__BRICK_VOXELS + v]
                = springls__grid_contains(g, at[0], at[1], at[2]) ? springls__body_of_voxel(g, l, at) : -1;
        }
    }
}

/* Finds the body of every voxel where bodies are those of what springls hold: the one of most springls about its body of phi. */
SPRINGLS__FN springls_status springls__label_contoured_bodies(springls_context *ctx, springls__lock *lock)
{
    const springls__grid *g = &ctx->model.grid;
    springls__labels phi;
    springls__body_vote *votes;
    int32_t body, cavity;
    int i;
    SPRINGLS__TRY(springls__label_voxels(ctx, &phi));
    SPRINGLS__TRY(springls__clear_votes(ctx, phi.count, &votes));
    springls__label_bodies(g, &phi, lock);
    for (i = 0; i < ctx->model.set.count; i++) {
        springls__components_at(g, &phi, ctx->model.set.s[i].p, &body, &cavity);
        if (body >= 0) springls__vote_for_body(&votes[body], lock->graph.place[i].body);
    }
    for (i = 0; i < g->active_count * SPRINGLS__BRICK_VOXELS; i++)
        if (lock->body[i] >= 0) lock->body[i] = votes[lock->body[i]].body;
    return SPRINGLS_OK;
}

/* ---- the offset ---- */

typedef struct springls__offset_job {
    springls_context *ctx;
    const springls__lock *lock;
    bool keeps_sides;
} springls__offset_job;

/* Returns phi less an offset, on its own side if it is to keep it. */
SPRINGLS__FN float springls__offset_phi(float phi, float offset, float far_value, bool keeps_side)
{
    const float beside = 1e-6f; /* voxel */
    float moved = springls__clamp(phi - offset, -far_value, far_value);
    if (!keeps_side || (moved < 0.0f) == (phi < 0.0f)) return moved;
    return phi < 0.0f ? -beside : beside;
}

/* Returns by how much phi changes at voxel v of active brick i along one smallest spacing of the world. */
SPRINGLS__FN float springls__slope_of_voxel(const springls__grid *g, int i, int v)
{
    int o[3], at[3];
    springls__v3 n;
    if (springls__is_uniform(g->metric)) return 1.0f;
    springls__slot_origin(g, g->active[i], o);
    springls__voxel_of_brick(o, v, at);
    n = springls__normalize(springls__voxel_gradient(g, at[0], at[1], at[2]));
    return springls__length2(n) > 0.0f ? springls__world_slope(g->metric, n) : 1.0f;
}

/* Writes phi_next: phi less its component's offset, where phi is a distance. */
SPRINGLS__FN void springls__offset_phi_task(void *arg, int begin, int end)
{
    const springls__offset_job *job = (const springls__offset_job *)arg;
    const springls__lock *lock = job->lock;
    const springls__grid *g = &job->ctx->model.grid;
    int v;
    for (; begin < end; begin++) {
        const float *phi = g->phi + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            int32_t label = lock->body[begin * SPRINGLS__BRICK_VOXELS + v];
            out[v] = phi[v];
            if (label >= 0 && springls__fabs(phi[v]) < g->far_value)
                out[v] = springls__offset_phi(phi[v], lock->item[label].offset * springls__slope_of_voxel(g, begin, v), g->far_value,
                                              job->keeps_sides);
        }
    }
}

/* Moves springls along their normals by their component's offset. */
SPRINGLS__FN void springls__offset_springls_task(void *arg, int begin, int end)
{
    const springls__offset_job *job = (const springls__offset_job *)arg;
    springls_context *ctx = job->ctx;
    int m;
    for (; begin < end; begin++) {
        springls__springl *s = &ctx->model.set.s[begin];
        int32_t body = job->lock->graph.place[begin].body;
        springls__v3 by;
        if (body < 0) continue;
        by = springls__scale(springls__along_normal(ctx->model.grid.metric, springls__springl_normal(*s)),
                             job->lock->item[body].offset);
        for (m = 0; m < 3; m++) s->q[m] = springls__add(s->q[m], by);
        s->p = springls__add(s->p, by);
        *s = springls__springl_finished(*s);
    }
}

/* Adds a triangle to the body that it bounds. */
SPRINGLS__FN void springls__measure_body(springls__labels *l, const springls__labelled_triangle *triangle)
{
    springls__surface_sums sums = springls__triangle_sums(l, triangle->t);
    int32_t body = triangle->inner[0]; /* a node from label_bodies, or of a constant brick, from first_brick on */
    if (body >= 0 && body < l->count) springls__add_sums(&l->item[body].surface, &sums, 1.0);
}

/* Adds the parts of a new mesh to the bodies that most of their springls bounded. */
SPRINGLS__FN springls_status springls__measure_parts_of_bodies(springls_context *ctx, springls__lock *lock)
{
    springls__body_vote *votes;
    int i;
    springls__constellation_moved(ctx);
    SPRINGLS__TRY(springls__surface_parts_to_host(ctx));
    SPRINGLS__TRY(springls__refresh_surface_parts(ctx));
    SPRINGLS__TRY(springls__clear_votes(ctx, ctx->part_count, &votes));
    for (i = 0; i < ctx->model.set.count; i++) {
        const int32_t part = springls__own_part(ctx, i);
        if (part >= 0) springls__vote_for_body(&votes[part], lock->graph.place[i].body);
    }
    for (i = 0; i < ctx->part_count; i++)
        if (votes[i].body >= 0)
            springls__add_sums(&lock->graph.labels.item[votes[i].body].surface, &springls__surface_parts(ctx)[i].sums, 1.0);
    return SPRINGLS_OK;
}

/* Measures the bodies, with the labels from before they moved. */
SPRINGLS__FN springls_status springls__measure_bodies(springls_context *ctx, springls__lock *lock)
{
    springls__labels *l = &lock->graph.labels;
    int i;
    for (i = 0; i < l->count; i++) memset(&l->item[i].surface, 0, sizeof l->item[i].surface);
    if (springls__contours_springls(ctx)) return springls__measure_parts_of_bodies(ctx, lock);
    springls__visit_triangles(&ctx->model.grid, l, springls__measure_body);
    return SPRINGLS_OK;
}

/* Sums volumes and areas of linked bodies; tiny bodies have no area that could move. */
SPRINGLS__FN void springls__sum_linked(springls__lock *lock)
{
    const springls__labels *l = &lock->graph.labels;
    int i;
    for (i = 0; i < l->count; i++) lock->node[lock->item[i].node].volume = lock->node[lock->item[i].node].area = 0.0;
    for (i = 0; i < l->count; i++) {
        springls__lock_node *all = &lock->node[lock->item[i].node];
        if (l->item[i].cavity) continue;
        all->volume += l->item[i].surface.volume;
        if (lock->item[i].tiny) continue;
        all->area += lock->rate_of_area > 0.0 ? lock->rate_of_area * l->item[i].surface.world_area : l->item[i].surface.area;
    }
}

/* Estimates the volume that an offset gains for each smallest spacing: the area or, after a first offset, the secant, within half and four
   times the area. */
SPRINGLS__FN void springls__find_rates(springls__lock *lock)
{
    const springls__component_graph *graph = &lock->graph;
    int i;
    for (i = 0; i < graph->previous_count + graph->labels.count; i++) {
        springls__lock_node *all = &lock->node[i];
        double secant = all->offset != 0.0 ? (all->volume - all->volume_before) / all->offset : all->area;
        all->rate = secant < 0.5 * all->area ? 0.5 * all->area : secant > 4.0 * all->area ? 4.0 * all->area : secant;
        all->volume_before = all->volume;
        all->offset = 0.0;
    }
}

/* Chooses offsets by Newton's method, where volumes are not within a share `close` of their targets. False when no component has to
   move. */
SPRINGLS__FN bool springls__choose_offsets(springls__lock *lock, double close)
{
    const springls__labels *l = &lock->graph.labels;
    const double max_offset = 0.25; /* voxels, at once */
    bool any = false;
    int i;
    springls__sum_linked(lock);
    springls__find_rates(lock);
    for (i = 0; i < l->count; i++) {
        springls__locked_component *item = &lock->item[i];
        springls__lock_node *all = &lock->node[item->node];
        double missing = all->target - all->volume, by;
        item->offset = 0.0f;
        if (l->item[i].cavity || item->tiny || fabs(missing) <= close * all->target || !(all->rate > 0.0)) continue;
        by = missing / all->rate;
        item->offset = (float)(by < -max_offset ? -max_offset : by > max_offset ? max_offset : by);
        all->offset = (double)item->offset;
        item->moved += item->offset;
        any = true;
    }
    return any;
}

/* Moves bodies until their volumes are right. *moved: whether any has moved. A voxel that changes sides may open or close a passage,
   and the volume jumps past its target: so only the first offsets, the large ones, may change sides. */
SPRINGLS__FN springls_status springls__correct_volumes(springls_context *ctx, springls__lock *lock, bool *moved)
{
    const bool contoured = springls__contours_springls(ctx); /* each iteration makes a mesh, whose volume may jump a little */
    const int iterations = contoured ? 4 : 12, large = 2;
    const double close = contoured ? 1e-6 : 1e-7;
    springls__offset_job job;
    int i;
    job.ctx = ctx;
    job.lock = lock;
    ctx->stats.volume_correction = 0.0f;
    *moved = springls__choose_offsets(lock, close);
    if (!*moved) return SPRINGLS_OK;
    if (contoured) SPRINGLS__TRY(springls__label_contoured_bodies(ctx, lock));
    else springls__label_bodies(&ctx->model.grid, &lock->graph.labels, lock);
    lock->graph.labels.voxel = lock->body;
    for (i = 0; i < iterations && (i == 0 || springls__choose_offsets(lock, close)); i++) {
        job.keeps_sides = i >= large;
        springls__parallel(ctx, ctx->model.grid.active_count, 16, springls__offset_phi_task, &job);
        springls__commit_phi(ctx, 1);
        springls__parallel(ctx, ctx->model.set.count, 512, springls__offset_springls_task, &job);
        SPRINGLS__TRY(springls__measure_bodies(ctx, lock));
    }
    if (!contoured) springls__constellation_moved(ctx); /* or the last mesh has been made of what moved */
    springls__mark_phi_synced(ctx);
    for (i = 0; i < lock->graph.labels.count; i++)
        ctx->stats.volume_correction = springls__max(ctx->stats.volume_correction, springls__fabs(lock->item[i].moved));
    return SPRINGLS_OK;
}

/* Links components, and finds what volumes they are to have. */
SPRINGLS__FN springls_status springls__find_targets(springls_context *ctx, springls__lock *lock)
{
    SPRINGLS__TRY(springls__lock_begin(ctx, lock));
    springls__join_linked(lock);
    springls__sum_targets(lock);
    return SPRINGLS_OK;
}

/* Returns the place among `count` bodies from before they moved of a current component: that of its deepest voxel or, of what springls
   hold, of its id; -1: none. */
SPRINGLS__FN int32_t springls__body_before(const springls_context *ctx, const springls__lock *lock, int count,
                                           const springls__current_component *item)
{
    int i;
    if (!springls__contours_springls(ctx)) return lock->body[item->deepest];
    for (i = 0; i < count; i++)
        if (lock->item[i].id == item->id) return i;
    return -1;
}

/* Finds the components again, now that they have moved: each by as much as its body has. */
SPRINGLS__FN springls_status springls__find_corrected(springls_context *ctx, springls__lock *lock)
{
    springls__labels *l = &lock->graph.labels;
    const int count = l->count;
    int i;
    SPRINGLS__TRY(springls__identify_components(ctx, &lock->graph));
    for (i = 0; i < l->count; i++) {
        const int32_t body = springls__body_before(ctx, lock, count, &l->item[i]);
        if (body >= 0) l->item[i].moved = lock->item[body].moved;
    }
    return springls__find_targets(ctx, lock);
}

/* Stores the target of every body for the next step; linked ones share theirs by their volumes. */
SPRINGLS__FN void springls__lock_components(springls_context *ctx, const springls__lock *lock)
{
    const springls__labels *l = &lock->graph.labels;
    int i;
    for (i = 0; i < l->count; i++) {
        const springls__lock_node *all = &lock->node[lock->item[i].node];
        int32_t at = springls__find_component(springls__component_list(ctx), ctx->component_count, l->item[i].id);
        springls__component *kept = springls__component_list(ctx) + at;
        if (!l->item[i].cavity && all->volume > 0.0) kept->target = all->target * (l->item[i].surface.volume / all->volume);
    }
    ctx->volumes_locked = true;
}

/* Follows the components, and corrects their volumes after a step. The first time, when there are no targets yet, it only stores
   them. */
SPRINGLS__FN springls_status springls__volume_lock(springls_context *ctx)
{
    springls__lock lock;
    bool moved = false;
    SPRINGLS__TRY(springls__use_host(ctx, true));
    if (springls__contours_springls(ctx)) SPRINGLS__TRY(springls__cell_list_cover(ctx)); /* a reader's mesh has these bricks, too */
    SPRINGLS__TRY(springls__identify_components(ctx, &lock.graph));
    SPRINGLS__TRY(springls__find_targets(ctx, &lock));
    if (ctx->volumes_locked) SPRINGLS__TRY(springls__correct_volumes(ctx, &lock, &moved));
    if (moved) SPRINGLS__TRY(springls__find_corrected(ctx, &lock));
    SPRINGLS__TRY(springls__commit_components(ctx, &lock.graph));
    springls__lock_components(ctx, &lock);
    if (springls__contours_springls(ctx) && ctx->particles_outside > 0) ctx->components_version = 0; /* they have left those bricks */
    return SPRINGLS_OK;
}

static const springls__entry springls__lock_volumes[] = { SPRINGLS__DO(springls__volume_lock) SPRINGLS__END };

#endif
