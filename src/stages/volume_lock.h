/* volume_lock.h - keeps the volume of every component (params.volume_lock) by a tiny offset of its springls and of phi along
   the normals. A component is what is connected inside phi, through faces of voxels or through a triangle of marching cubes;
   its volume is that of its marching cubes surface, as springls_measure gives it. Its target follows the springls: each has the
   number of the component it was in, so that after a split targets are shared out, and after a merger they are summed. It is
   off by default and in double precision, which not every device has: it always runs on the host. */
#ifndef SPRINGLS__STAGES_VOLUME_LOCK_H
#define SPRINGLS__STAGES_VOLUME_LOCK_H

#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "evolve.h"

typedef struct springls__volume_component {
    double volume, area;    /* voxel^3, voxel^2                                                                 */
    float offset, moved;    /* of this iteration, of all; voxels                                                */
    int32_t node;           /* root of its tree among the links                                                 */
    bool speck;
} springls__volume_component;

/* The components of phi as it is now. */
typedef struct springls__volume_components {
    springls__volume_component *item;
    int count;
    int32_t *rank;          /* slot -> place in `active`                                                        */
    int32_t *parent;        /* forest of the voxels of active bricks, 512 a place, and then of all bricks       */
    int32_t *label;         /* component of a voxel of active bricks; -1: too far outside                       */
    int32_t voxels;         /* nodes that are voxels                                                            */
} springls__volume_components;

/* ---- components of phi ---- */

/* Returns the node of an inside voxel: its own, or that of the constant brick it lies in. */
SPRINGLS__FN int32_t springls__component_node(const springls__grid *g, const springls__volume_components *c, int x, int y, int z)
{
    int slot = springls__slot_at(g, x, y, z);
    if (slot < SPRINGLS__FIRST_SLOT) return c->voxels + springls__brick_at(g, x, y, z);
    return c->rank[slot] * SPRINGLS__BRICK_VOXELS + springls__voxel_in_brick(x, y, z);
}

SPRINGLS__FN bool springls__is_inside(const springls__grid *g, int x, int y, int z)
{
    return springls__grid_contains(g, x, y, z) && springls__grid_voxel(g, g->phi, x, y, z) < 0.0f;
}

/* Joins two trees of a forest; the lower root stays a root. */
SPRINGLS__FN void springls__join_trees(int32_t *parent, int32_t a, int32_t b)
{
    a = springls__find_root(parent, a);
    b = springls__find_root(parent, b);
    if (a < b) parent[b] = a;
    else parent[a] = b;
}

/* Finds the voxel next to (x, y, z) in direction d: -x +x -y +y -z +z. */
SPRINGLS__FN void springls__voxel_beside(int x, int y, int z, int d, int out[3])
{
    out[0] = x + (d == 1) - (d == 0);
    out[1] = y + (d == 3) - (d == 2);
    out[2] = z + (d == 5) - (d == 4);
}

/* Joins the inside voxels of active brick i with those beside them. */
SPRINGLS__FN void springls__join_voxels(const springls__grid *g, springls__volume_components *c, int i)
{
    int v, d, o[3], to[3];
    springls__slot_origin(g, g->active[i], o);
    for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
        int x = o[0] + (v & 7), y = o[1] + (v >> 3 & 7), z = o[2] + (v >> 6);
        if (!springls__is_inside(g, x, y, z)) continue;
        for (d = 0; d < 6; d++) {
            springls__voxel_beside(x, y, z, d, to);
            if (!springls__is_inside(g, to[0], to[1], to[2])) continue;
            springls__join_trees(c->parent, i * SPRINGLS__BRICK_VOXELS + v, springls__component_node(g, c, to[0], to[1], to[2]));
        }
    }
}

/* Joins the constant bricks that are inside among themselves. */
SPRINGLS__FN void springls__join_bricks(const springls__grid *g, springls__volume_components *c)
{
    int brick, bricks = (int)springls__brick_count(g), d, to[3];
    for (brick = 0; brick < bricks; brick++) {
        int place[3];
        if (g->top[brick] != SPRINGLS__INSIDE) continue;
        springls__brick_place(g, brick, place);
        for (d = 1; d < 6; d += 2) {
            int beside;
            springls__voxel_beside(place[0], place[1], place[2], d, to);
            if (to[0] == g->bricks[0] || to[1] == g->bricks[1] || to[2] == g->bricks[2]) continue;
            beside = to[0] + g->bricks[0] * (to[1] + g->bricks[1] * to[2]);
            if (g->top[beside] == SPRINGLS__INSIDE) springls__join_trees(c->parent, c->voxels + brick, c->voxels + beside);
        }
    }
}

/* ---- triangles of marching cubes ---- */

typedef void (*springls__component_triangle)(springls__volume_components *c, springls__tri t, const int32_t nodes[3]);

/* Finds the nodes of a triangle: those at the inner ends of the three edges of the cube at voxel `at` that carry its vertices. */
SPRINGLS__FN void springls__triangle_nodes(const springls__grid *g, const springls__volume_components *c, springls__mc_cell cell,
                                           int triangle, const int at[3], int32_t nodes[3])
{
    int mask = springls__mc_case(cell), m;
    for (m = 0; m < 3; m++) {
        int edge = springls__mc_edge(mask, triangle, m), corner = springls__mc_edge_corner(edge);
        if (!springls__mc_inside(cell.phi[corner])) corner |= 1 << springls__mc_edge_axis(edge);
        nodes[m] = springls__component_node(g, c, at[0] + (corner & 1), at[1] + (corner >> 1 & 1), at[2] + (corner >> 2));
    }
}

/* Visits the triangles of one cube of a brick. */
SPRINGLS__FN void springls__visit_cube(const springls__grid *g, springls__volume_components *c, const springls__cube_range *range,
                                       springls__mc_cell cell, int x, int y, int z, springls__component_triangle visit)
{
    int mask = springls__mc_case(cell), count = springls__mc_count(mask), k, at[3];
    int32_t nodes[3];
    if (count == 0) return;
    at[0] = range->origin[0] + x;
    at[1] = range->origin[1] + y;
    at[2] = range->origin[2] + z;
    for (k = 0; k < count; k++) {
        springls__triangle_nodes(g, c, cell, k, at, nodes);
        visit(c, springls__cube_triangle(range, cell, mask, x, y, z, k), nodes);
    }
}

/* Visits all triangles of the zero level. */
SPRINGLS__FN void springls__visit_triangles(const springls__grid *g, springls__volume_components *c,
                                            springls__component_triangle visit)
{
    float tile[SPRINGLS__TILE_VOXELS];
    int i, x, y, z;
    for (i = 0; i < g->active_count; i++) {
        springls__cube_range range = springls__brick_cubes(g, g->active[i]);
        springls__load_tile(g, g->phi, g->active[i], springls__alone(), tile);
        for (z = range.lo[2]; z <= range.hi[2]; z++)
            for (y = range.lo[1]; y <= range.hi[1]; y++)
                for (x = range.lo[0]; x <= range.hi[0]; x++)
                    springls__visit_cube(g, c, &range, springls__tile_cube(tile, x, y, z), x, y, z, visit);
    }
}

SPRINGLS__FN void springls__join_triangle(springls__volume_components *c, springls__tri t, const int32_t nodes[3])
{
    (void)t;
    springls__join_trees(c->parent, nodes[0], nodes[1]);
    springls__join_trees(c->parent, nodes[0], nodes[2]);
}

/* Adds the triangle's area, and the volume under it, to the component that it bounds. */
SPRINGLS__FN void springls__measure_triangle(springls__volume_components *c, springls__tri t, const int32_t nodes[3])
{
    springls__v3 area2 = springls__tri_area2(t);
    springls__volume_component *item;
    int32_t label = nodes[0] < c->voxels ? c->label[nodes[0]] : -1;
    if (label < 0) return;
    item = &c->item[label];
    item->area += 0.5 * (double)springls__length(area2);
    item->volume += ((double)t.a.x * (double)area2.x + (double)t.a.y * (double)area2.y + (double)t.a.z * (double)area2.z)
                    * (1.0 / 6.0);
}

SPRINGLS__FN void springls__measure_components(const springls__grid *g, springls__volume_components *c)
{
    int i;
    for (i = 0; i < c->count; i++) c->item[i].volume = c->item[i].area = 0.0;
    springls__visit_triangles(g, c, springls__measure_triangle);
}

/* ---- labels ---- */

/* Returns the direction of the neighbor with the lowest phi, if that is less than `least`; -1 if none is. */
SPRINGLS__FN int springls__steepest_descent(const springls__grid *g, int x, int y, int z, float least)
{
    float phi;
    int d, best = -1, to[3];
    for (d = 0; d < 6; d++) {
        springls__voxel_beside(x, y, z, d, to);
        if (!springls__grid_contains(g, to[0], to[1], to[2])) continue;
        phi = springls__grid_voxel(g, g->phi, to[0], to[1], to[2]);
        if (phi >= least) continue;
        least = phi;
        best = d;
    }
    return best;
}

/* Returns the component of an outside voxel: the one that steepest descent of phi leads to; -1 where phi is flat. */
SPRINGLS__FN int32_t springls__label_outside(const springls__grid *g, const springls__volume_components *c, int x, int y, int z)
{
    const int longest = 32; /* voxels: more than any band is wide */
    int step, d, to[3];
    for (step = 0; step < longest; step++) {
        float phi = springls__grid_voxel(g, g->phi, x, y, z);
        if (phi < 0.0f) {
            int32_t node = springls__component_node(g, c, x, y, z);
            return node < c->voxels ? c->label[node] : -1;
        }
        d = springls__steepest_descent(g, x, y, z, phi);
        if (d < 0) return -1;
        springls__voxel_beside(x, y, z, d, to);
        x = to[0];
        y = to[1];
        z = to[2];
    }
    return -1;
}

/* Numbers the components in the order of their first voxel, and labels their inside voxels. A component has a surface, so some
   voxel of it is in an active brick; roots are the lowest of their trees, so they come first. */
SPRINGLS__FN void springls__label_insides(const springls__grid *g, springls__volume_components *c)
{
    int i, v, o[3];
    c->count = 0;
    for (i = 0; i < c->voxels; i++) c->label[i] = -1;
    for (i = 0; i < g->active_count; i++) {
        springls__slot_origin(g, g->active[i], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            int32_t node = i * SPRINGLS__BRICK_VOXELS + v, root;
            if (!springls__is_inside(g, o[0] + (v & 7), o[1] + (v >> 3 & 7), o[2] + (v >> 6))) continue;
            root = springls__find_root(c->parent, node);
            c->label[node] = root == node ? c->count++ : c->label[root];
        }
    }
}

SPRINGLS__FN void springls__label_outsides(const springls__grid *g, springls__volume_components *c)
{
    int i, v, o[3];
    for (i = 0; i < g->active_count; i++) {
        springls__slot_origin(g, g->active[i], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            int x = o[0] + (v & 7), y = o[1] + (v >> 3 & 7), z = o[2] + (v >> 6);
            if (springls__grid_contains(g, x, y, z) && !springls__is_inside(g, x, y, z))
                c->label[i * SPRINGLS__BRICK_VOXELS + v] = springls__label_outside(g, c, x, y, z);
        }
    }
}

/* Finds the forest of what is connected inside phi. */
SPRINGLS__FN springls_status springls__connect_inside(springls_context *ctx, springls__volume_components *c)
{
    const springls__grid *g = &ctx->model.grid;
    int64_t nodes = (int64_t)g->active_count * SPRINGLS__BRICK_VOXELS + (int64_t)springls__brick_count(g);
    int32_t i;
    if (nodes > INT32_MAX) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "volume lock: the surface is too large");
    c->voxels = g->active_count * SPRINGLS__BRICK_VOXELS;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_rank, g->slot_count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_parent, nodes));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_label, c->voxels));
    c->rank = springls__component_rank(&ctx->model);
    c->parent = springls__component_parent(&ctx->model);
    c->label = springls__component_label(&ctx->model);
    for (i = 0; i < g->active_count; i++) c->rank[g->active[i]] = i;
    for (i = 0; i < (int32_t)nodes; i++) c->parent[i] = i;
    for (i = 0; i < g->active_count; i++) springls__join_voxels(g, c, i);
    springls__join_bricks(g, c);
    springls__visit_triangles(g, c, springls__join_triangle);
    return SPRINGLS_OK;
}

/* Finds the components and measures them. */
SPRINGLS__FN springls_status springls__find_components(springls_context *ctx, springls__volume_components *c)
{
    const springls__grid *g = &ctx->model.grid;
    SPRINGLS__TRY(springls__connect_inside(ctx, c));
    springls__label_insides(g, c);
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, components, c->count));
    c->item = springls__components(&ctx->model);
    memset(c->item, 0, (size_t)c->count * sizeof *c->item);
    springls__label_outsides(g, c);
    springls__measure_components(g, c);
    return SPRINGLS_OK;
}

/* Returns the component of a springl: that of the deepest labelled voxel of the eight about its particle. */
SPRINGLS__FN int32_t springls__component_of_springl(const springls__grid *g, const springls__volume_components *c, springls__v3 p)
{
    int i, j, k, corner;
    int32_t label = -1;
    float least = FLT_MAX;
    i = (int)springls__floor(springls__clamp(p.x, -1.0f, (float)g->size[0]));
    j = (int)springls__floor(springls__clamp(p.y, -1.0f, (float)g->size[1]));
    k = (int)springls__floor(springls__clamp(p.z, -1.0f, (float)g->size[2]));
    for (corner = 0; corner < 8; corner++) {
        int x = i + (corner & 1), y = j + (corner >> 1 & 1), z = k + (corner >> 2), slot;
        int32_t here;
        float phi;
        if (!springls__grid_contains(g, x, y, z)) continue;
        slot = springls__slot_at(g, x, y, z);
        if (slot < SPRINGLS__FIRST_SLOT) continue;
        here = c->label[springls__component_node(g, c, x, y, z)];
        phi = springls__grid_voxel(g, g->phi, x, y, z);
        if (here < 0 || phi >= least) continue;
        least = phi;
        label = here;
    }
    return label;
}

/* ---- target volumes: components before and now that springls link have one target together ---- */

/* A component as a node of the links; target, volume and area are those of all its tree when it is a root. */
typedef struct springls__component_link { double target, volume, area; int64_t votes; } springls__component_link;

typedef struct springls__component_links {
    springls__component_link *node; /* components before, then those of now      */
    int32_t *parent;                /* their forest                              */
    uint64_t *votes;                /* before << 32 | now, one a springl         */
    size_t vote_count;
    int before;                     /* how many components there were before     */
} springls__component_links;

SPRINGLS__FN springls_status springls__component_links_begin(springls_context *ctx, const springls__volume_components *c,
                                                             springls__component_links *links)
{
    const double *locked = (const double *)ctx->locked_memory.data;
    size_t nodes;
    int i;
    links->before = ctx->locked_count;
    nodes = (size_t)links->before + (size_t)c->count;
    links->vote_count = 0;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, link_votes, ctx->model.set.count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, links, nodes));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, link_parent, nodes));
    links->votes = springls__link_votes(&ctx->model);
    links->node = springls__links(&ctx->model);
    links->parent = springls__link_parent(&ctx->model);
    for (i = 0; i < (int)nodes; i++) {
        links->parent[i] = i;
        links->node[i].votes = 0;
        links->node[i].target = i < links->before ? locked[i] : 0.0;
        links->node[i].volume = i < links->before ? 0.0 : c->item[i - links->before].volume;
    }
    return SPRINGLS_OK;
}

/* Finds the component of every springl; each votes for a link between the one it was in and the one it is in now. */
SPRINGLS__FN void springls__collect_votes(springls_context *ctx, const springls__volume_components *c,
                                          springls__component_links *links)
{
    int i;
    for (i = 0; i < ctx->model.set.count; i++) {
        int32_t before = ctx->model.set.component[i];
        int32_t now = springls__component_of_springl(&ctx->model.grid, c, ctx->model.set.s[i].p);
        ctx->model.set.component[i] = now;
        if (before < 0 || now < 0) continue;
        links->node[before].votes++;
        links->node[links->before + now].votes++;
        links->votes[links->vote_count++] = (uint64_t)before << 32 | (uint64_t)now;
    }
    springls__sort_keys(links->votes, links->vote_count);
}

/* Links components with a tenth of the votes of either one: where two come close, single springls may vote for the wrong one. */
SPRINGLS__FN void springls__link_by_votes(springls__component_links *links)
{
    size_t i = 0, first;
    while (i < links->vote_count) {
        int32_t before = (int32_t)(links->votes[i] >> 32), now = links->before + (int32_t)(links->votes[i] & 0xffffffffu);
        int64_t votes;
        for (first = i; i < links->vote_count && links->votes[i] == links->votes[first]; i++) continue;
        votes = 10 * (int64_t)(i - first);
        if (votes >= links->node[before].votes || votes >= links->node[now].votes)
            springls__join_trees(links->parent, before, now);
    }
}

/* Returns true for a component of a few voxels, which has too little surface for an offset; it is linked to the largest one. */
SPRINGLS__FN bool springls__is_speck(double volume) { return volume < 10.0; }

SPRINGLS__FN void springls__link_specks(const springls__volume_components *c, springls__component_links *links)
{
    int i, largest = 0;
    for (i = 1; i < c->count; i++)
        if (c->item[i].volume > c->item[largest].volume) largest = i;
    for (i = 0; i < links->before + c->count && c->count > 0; i++)
        if (springls__is_speck(i < links->before ? links->node[i].target : links->node[i].volume))
            springls__join_trees(links->parent, i, links->before + largest);
}

/* Sums targets and volumes of linked components; a new component that is linked to none before has its volume as its target. */
SPRINGLS__FN void springls__sum_targets(springls__volume_components *c, springls__component_links *links)
{
    int i, nodes = links->before + c->count;
    for (i = 0; i < nodes; i++) {
        int32_t root = springls__find_root(links->parent, i);
        if (root == i) continue;
        links->node[root].target += links->node[i].target;
        links->node[root].volume += links->node[i].volume;
    }
    for (i = 0; i < c->count; i++) {
        springls__component_link *all;
        c->item[i].node = springls__find_root(links->parent, links->before + i);
        all = &links->node[c->item[i].node];
        if (!(all->target > 0.0)) all->target = all->volume;
    }
}

/* Stores the target of every component for the next step; linked ones share theirs by their volumes. */
SPRINGLS__FN springls_status springls__lock_components(springls_context *ctx, const springls__volume_components *c,
                                                       const springls__component_links *links)
{
    double *locked;
    int i;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->locked_memory, (size_t)c->count + 1, sizeof *locked, 0));
    locked = (double *)ctx->locked_memory.data;
    for (i = 0; i < c->count; i++) {
        const springls__component_link *all = &links->node[c->item[i].node];
        locked[i] = all->volume > 0.0 ? all->target * (c->item[i].volume / all->volume) : 0.0;
    }
    ctx->locked_count = c->count;
    return SPRINGLS_OK;
}

/* ---- the offset ---- */

typedef struct springls__offset_job {
    springls_context *ctx;
    const springls__volume_components *components;
} springls__offset_job;

/* Writes phi_next: phi less its component's offset, where phi is a distance. */
SPRINGLS__FN void springls__offset_phi_task(void *arg, int begin, int end)
{
    const springls__offset_job *job = (const springls__offset_job *)arg;
    const springls__volume_components *c = job->components;
    const springls__grid *g = &job->ctx->model.grid;
    int v;
    for (; begin < end; begin++) {
        const float *phi = g->phi + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            int32_t label = c->label[begin * SPRINGLS__BRICK_VOXELS + v];
            out[v] = phi[v];
            if (label >= 0 && springls__fabs(phi[v]) < g->far_value)
                out[v] = springls__clamp(phi[v] - c->item[label].offset, -g->far_value, g->far_value);
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
        springls__v3 by;
        if (ctx->model.set.component[begin] < 0) continue;
        by = springls__scale(springls__springl_normal(*s), job->components->item[ctx->model.set.component[begin]].offset);
        for (m = 0; m < 3; m++) s->q[m] = springls__add(s->q[m], by);
        s->p = springls__add(s->p, by);
        *s = springls__springl_finished(*s);
    }
}

/* Sums volumes and areas of linked components; specks have no area that could move. */
SPRINGLS__FN void springls__sum_linked(const springls__volume_components *c, springls__component_links *links)
{
    int i;
    for (i = 0; i < c->count; i++) links->node[c->item[i].node].volume = links->node[c->item[i].node].area = 0.0;
    for (i = 0; i < c->count; i++) {
        springls__component_link *all = &links->node[c->item[i].node];
        all->volume += c->item[i].volume;
        if (!c->item[i].speck) all->area += c->item[i].area;
    }
}

/* Chooses offsets by Newton's method: a surface of area A that moves out by d gains d A. False when no component has to move. */
SPRINGLS__FN bool springls__choose_offsets(springls__volume_components *c, springls__component_links *links)
{
    const double close = 1e-7, longest = 0.25; /* of the target; voxels, at once */
    bool any = false;
    int i;
    springls__sum_linked(c, links);
    for (i = 0; i < c->count; i++) {
        springls__volume_component *item = &c->item[i];
        const springls__component_link *all = &links->node[item->node];
        double missing = all->target - all->volume, by;
        item->offset = 0.0f;
        if (item->speck || fabs(missing) <= close * all->target || !(all->area > 0.0)) continue;
        by = missing / all->area;
        item->offset = (float)(by < -longest ? -longest : by > longest ? longest : by);
        item->moved += item->offset;
        any = true;
    }
    return any;
}

SPRINGLS__FN void springls__correct_volumes(springls_context *ctx, springls__volume_components *c,
                                            springls__component_links *links)
{
    const int iterations = 6;
    springls__offset_job job;
    int i;
    job.ctx = ctx;
    job.components = c;
    for (i = 0; i < iterations && springls__choose_offsets(c, links); i++) {
        springls__parallel(ctx, ctx->model.grid.active_count, 16, springls__offset_phi_task, &job);
        springls__commit_phi(ctx, 1);
        springls__parallel(ctx, ctx->model.set.count, 512, springls__offset_springls_task, &job);
        springls__measure_components(&ctx->model.grid, c);
    }
    springls__sum_linked(c, links);
    springls__constellation_moved(ctx);
    springls__mark_phi_synced(ctx);
    ctx->stats.volume_correction = 0.0f;
    for (i = 0; i < c->count; i++)
        ctx->stats.volume_correction = springls__max(ctx->stats.volume_correction, springls__fabs(c->item[i].moved));
}

/* Corrects the volumes after a step. The first time, when there are no targets yet, it only stores them. */
SPRINGLS__FN springls_status springls__volume_lock(springls_context *ctx)
{
    springls__volume_components components;
    springls__component_links links;
    int i;
    bool first = ctx->locked_count == 0;
    SPRINGLS__TRY(springls__use_host(ctx, true));
    SPRINGLS__TRY(springls__find_components(ctx, &components));
    for (i = 0; i < components.count; i++) components.item[i].speck = springls__is_speck(components.item[i].volume);
    SPRINGLS__TRY(springls__component_links_begin(ctx, &components, &links));
    for (i = 0; i < ctx->model.set.count && first; i++) ctx->model.set.component[i] = -1; /* numbers of an earlier lock */
    springls__collect_votes(ctx, &components, &links);
    springls__link_by_votes(&links);
    springls__link_specks(&components, &links);
    springls__sum_targets(&components, &links);
    if (!first) springls__correct_volumes(ctx, &components, &links);
    return springls__lock_components(ctx, &components, &links);
}

#endif
