/* volume_lock.h - the volume of every component is held (params.volume_lock) by a tiny offset of its springls and of phi along
   the normals. A component is what is connected inside phi, through faces of voxels or through a triangle of marching cubes;
   its volume is that of its marching cubes surface, the one springls_measure tells. What it should be goes with the springls:
   each knows the component it was part of, so that after a split or a merger what was known is shared out or summed.
   Off by default, and in double precision, which not every device has: with a backend too it runs here, on the host's copy. */
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

/* A component now. */
typedef struct springls__volume_component {
    double volume, area;
    float offset, moved;
    int32_t kin;
    bool speck;
} springls__volume_component; /* moved: offsets in all */

typedef struct springls__volume_components {
    springls__volume_component *part;
    int count;
    int32_t *rank;          /* slot -> place in `active`                                                        */
    int32_t *parent;        /* forest of the voxels of active bricks, 512 a place, and then of all bricks       */
    int32_t *label;         /* component of a voxel of active bricks, or -1: too far outside                    */
    int32_t voxels;         /* nodes that are voxels                                                            */
} springls__volume_components;

/* The node of an inside voxel: its own, or that of the constant brick it lies in. */
SPRINGLS__FN int32_t springls__component_node(const springls__grid *g, const springls__volume_components *parts, int x, int y, int z)
{
    int slot = springls__slot_at(g, x, y, z);
    if (slot < SPRINGLS__FIRST_SLOT) return parts->voxels + springls__brick_at(g, x, y, z);
    return parts->rank[slot] * SPRINGLS__BRICK_VOXELS + springls__voxel_in_brick(x, y, z);
}

SPRINGLS__FN bool springls__is_inside(const springls__grid *g, int x, int y, int z)
{
    return springls__grid_contains(g, x, y, z) && springls__grid_voxel(g, g->phi, x, y, z) < 0.0f;
}

/* The lower root stays one. */
SPRINGLS__FN void springls__component_join(springls__volume_components *parts, int32_t a, int32_t b)
{
    a = springls__find_root(parts->parent, a);
    b = springls__find_root(parts->parent, b);
    if (a < b) parts->parent[b] = a;
    else parts->parent[a] = b;
}

/* The voxel next to (x, y, z): d counts -x +x -y +y -z +z. */
SPRINGLS__FN void springls__voxel_beside(int x, int y, int z, int d, int out[3])
{
    out[0] = x + (d == 1) - (d == 0);
    out[1] = y + (d == 3) - (d == 2);
    out[2] = z + (d == 5) - (d == 4);
}

SPRINGLS__FN void springls__join_faces(const springls__grid *g, springls__volume_components *parts)
{
    int i, v, d, o[3], to[3], brick, bricks = g->bricks[0] * g->bricks[1] * g->bricks[2];
    for (i = 0; i < g->active_count; i++) {
        springls__slot_origin(g, g->active[i], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            int x = o[0] + (v & 7), y = o[1] + (v >> 3 & 7), z = o[2] + (v >> 6);
            if (!springls__is_inside(g, x, y, z)) continue;
            for (d = 0; d < 6; d++) {
                springls__voxel_beside(x, y, z, d, to);
                if (springls__is_inside(g, to[0], to[1], to[2]))
                    springls__component_join(parts, i * SPRINGLS__BRICK_VOXELS + v,
                                        springls__component_node(g, parts, to[0], to[1], to[2]));
            }
        }
    }
    for (brick = 0; brick < bricks; brick++) { /* constant ones among themselves */
        int x = brick % g->bricks[0], y = brick / g->bricks[0] % g->bricks[1], z = brick / (g->bricks[0] * g->bricks[1]);
        if (g->top[brick] != SPRINGLS__INSIDE) continue;
        for (d = 1; d < 6; d += 2) {
            int beside;
            springls__voxel_beside(x, y, z, d, to);
            if (to[0] == g->bricks[0] || to[1] == g->bricks[1] || to[2] == g->bricks[2]) continue;
            beside = to[0] + g->bricks[0] * (to[1] + g->bricks[1] * to[2]);
            if (g->top[beside] == SPRINGLS__INSIDE) springls__component_join(parts, parts->voxels + brick, parts->voxels + beside);
        }
    }
}

typedef void (*springls__component_triangle)(springls__volume_components *parts, springls__tri t, const int32_t nodes[3]);

/* Marching cubes: every triangle with the nodes inside the three edges that it hangs on. */
SPRINGLS__FN void springls__component_triangles(const springls__grid *g, springls__volume_components *parts, springls__component_triangle visit)
{
    float tile[SPRINGLS__TILE_VOXELS];
    int32_t nodes[3];
    int i, x, y, z, k, m;
    for (i = 0; i < g->active_count; i++) {
        springls__cube_range range = springls__brick_cubes(g, g->active[i]);
        springls__load_tile(g, g->phi, g->active[i], springls__alone(), tile);
        for (z = range.lo[2]; z <= range.hi[2]; z++)
            for (y = range.lo[1]; y <= range.hi[1]; y++)
                for (x = range.lo[0]; x <= range.hi[0]; x++) {
                    springls__mc_cell cell = springls__tile_cube(tile, x, y, z);
                    int mask = springls__mc_case(cell);
                    for (k = 0; k < springls__mc_count(mask); k++) {
                        for (m = 0; m < 3; m++) {
                            int edge = springls__mc_edge(mask, k, m), c = springls__mc_edge_corner(edge);
                            if (!springls__mc_inside(cell.phi[c])) c |= 1 << springls__mc_edge_axis(edge);
                            nodes[m] = springls__component_node(g, parts, range.origin[0] + x + (c & 1),
                                                           range.origin[1] + y + (c >> 1 & 1), range.origin[2] + z + (c >> 2));
                        }
                        visit(parts, springls__cube_triangle(&range, cell, mask, x, y, z, k), nodes);
                    }
                }
    }
}

SPRINGLS__FN void springls__join_triangle(springls__volume_components *parts, springls__tri t, const int32_t nodes[3])
{
    (void)t;
    springls__component_join(parts, nodes[0], nodes[1]);
    springls__component_join(parts, nodes[0], nodes[2]);
}

/* Area, and the volume under the triangle, for the component that it bounds. */
SPRINGLS__FN void springls__measure_triangle(springls__volume_components *parts, springls__tri t, const int32_t nodes[3])
{
    springls__v3 area2 = springls__tri_area2(t);
    springls__volume_component *part;
    int32_t label = nodes[0] < parts->voxels ? parts->label[nodes[0]] : -1;
    if (label < 0) return;
    part = &parts->part[label];
    part->area += 0.5 * (double)springls__length(area2);
    part->volume += ((double)t.a.x * (double)area2.x + (double)t.a.y * (double)area2.y + (double)t.a.z * (double)area2.z)
                    * (1.0 / 6.0);
}

SPRINGLS__FN void springls__measure_components(const springls__grid *g, springls__volume_components *parts)
{
    int i;
    for (i = 0; i < parts->count; i++) parts->part[i].volume = parts->part[i].area = 0.0;
    springls__component_triangles(g, parts, springls__measure_triangle);
}

/* An outside voxel belongs to the component that the way down phi leads to. -1 where phi is flat. */
SPRINGLS__FN int32_t springls__label_outside(const springls__grid *g, const springls__volume_components *parts, int x, int y, int z)
{
    const int longest = 32; /* voxels: more than any band is wide */
    int step, d, to[3];
    for (step = 0; step < longest; step++) {
        float least = springls__grid_voxel(g, g->phi, x, y, z);
        int best = -1;
        if (least < 0.0f) {
            int32_t node = springls__component_node(g, parts, x, y, z);
            return node < parts->voxels ? parts->label[node] : -1;
        }
        for (d = 0; d < 6; d++) {
            float phi;
            springls__voxel_beside(x, y, z, d, to);
            if (!springls__grid_contains(g, to[0], to[1], to[2])) continue;
            phi = springls__grid_voxel(g, g->phi, to[0], to[1], to[2]);
            if (phi >= least) continue;
            least = phi;
            best = d;
        }
        if (best < 0) return -1;
        springls__voxel_beside(x, y, z, best, to);
        x = to[0];
        y = to[1];
        z = to[2];
    }
    return -1;
}

/* Components in the order of their first voxel. */
SPRINGLS__FN springls_status springls__find_components(springls_context *ctx, springls__volume_components *parts)
{
    const springls__grid *g = &ctx->model.grid;
    int64_t bricks = (int64_t)g->bricks[0] * g->bricks[1] * g->bricks[2],
            nodes = (int64_t)g->active_count * SPRINGLS__BRICK_VOXELS + bricks;
    int32_t i, o[3];
    int v;
    if (nodes > INT32_MAX) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "volume lock: the surface is too large");
    parts->voxels = g->active_count * SPRINGLS__BRICK_VOXELS;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_rank, g->slot_count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_parent, nodes));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_label, parts->voxels));
    parts->rank = springls__component_rank(&ctx->model);
    parts->parent = springls__component_parent(&ctx->model);
    parts->label = springls__component_label(&ctx->model);
    for (i = 0; i < g->active_count; i++) parts->rank[g->active[i]] = i;
    for (i = 0; i < (int32_t)nodes; i++) parts->parent[i] = i;
    springls__join_faces(g, parts);
    springls__component_triangles(g, parts, springls__join_triangle);
    parts->count = 0;
    for (i = 0; i < parts->voxels; i++) parts->label[i] = -1;
    for (i = 0; i < g->active_count; i++) { /* a component has a surface, so its first voxel that is active tells */
        springls__slot_origin(g, g->active[i], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            int32_t node = i * SPRINGLS__BRICK_VOXELS + v, root;
            if (!springls__is_inside(g, o[0] + (v & 7), o[1] + (v >> 3 & 7), o[2] + (v >> 6))) continue;
            root = springls__find_root(parts->parent, node);
            parts->label[node] = root == node ? parts->count++ : parts->label[root]; /* a root is the lowest of its tree */
        }
    }
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, components, parts->count));
    parts->part = springls__components(&ctx->model);
    memset(parts->part, 0, (size_t)parts->count * sizeof *parts->part);
    for (i = 0; i < g->active_count; i++) {
        springls__slot_origin(g, g->active[i], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            int x = o[0] + (v & 7), y = o[1] + (v >> 3 & 7), z = o[2] + (v >> 6);
            if (springls__grid_contains(g, x, y, z) && !springls__is_inside(g, x, y, z))
                parts->label[i * SPRINGLS__BRICK_VOXELS + v] = springls__label_outside(g, parts, x, y, z);
        }
    }
    springls__measure_components(g, parts);
    return SPRINGLS_OK;
}

/* The component of a springl: that of the deepest labelled voxel of the eight about its particle. */
SPRINGLS__FN int32_t springls__component_of_springl(const springls__grid *g, const springls__volume_components *parts, springls__v3 p)
{
    int i, j, k, c;
    int32_t label = -1;
    float least = FLT_MAX;
    i = (int)springls__floor(springls__clamp(p.x, -1.0f, (float)g->size[0]));
    j = (int)springls__floor(springls__clamp(p.y, -1.0f, (float)g->size[1]));
    k = (int)springls__floor(springls__clamp(p.z, -1.0f, (float)g->size[2]));
    for (c = 0; c < 8; c++) {
        int x = i + (c & 1), y = j + (c >> 1 & 1), z = k + (c >> 2), slot;
        int32_t here;
        float phi;
        if (!springls__grid_contains(g, x, y, z)) continue;
        slot = springls__slot_at(g, x, y, z);
        if (slot < SPRINGLS__FIRST_SLOT) continue;
        here = parts->label[springls__component_node(g, parts, x, y, z)];
        phi = springls__grid_voxel(g, g->phi, x, y, z);
        if (here < 0 || phi >= least) continue;
        least = phi;
        label = here;
    }
    return label;
}

/* ---- what a volume should be ---- */

/* What is known before and what there is now, as nodes of one forest: components before come first. */
typedef struct springls__component_link { double target, volume, area; int64_t votes; } springls__component_link; /* of a root: of all its tree */

typedef struct springls__component_links {
    springls__component_link *kin;
    int32_t *parent;
    uint64_t *votes;
    size_t vote_count;
    int before;
} springls__component_links;

SPRINGLS__FN springls_status springls__component_links_begin(springls_context *ctx, const springls__volume_components *parts, springls__component_links *k)
{
    const double *known = (const double *)ctx->locked_memory.data;
    size_t nodes;
    int i;
    k->before = ctx->locked_count;
    nodes = (size_t)k->before + (size_t)parts->count;
    k->vote_count = 0;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, link_votes, ctx->model.set.count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, links, nodes));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, link_parent, nodes));
    k->votes = springls__link_votes(&ctx->model);
    k->kin = springls__links(&ctx->model);
    k->parent = springls__link_parent(&ctx->model);
    for (i = 0; i < (int)nodes; i++) {
        k->parent[i] = i;
        k->kin[i].votes = 0;
        k->kin[i].target = i < k->before ? known[i] : 0.0;
        k->kin[i].volume = i < k->before ? 0.0 : parts->part[i - k->before].volume;
    }
    return SPRINGLS_OK;
}

/* Every springl votes for a tie between the component it was part of and the one it is part of now. */
SPRINGLS__FN void springls__vote(springls_context *ctx, const springls__volume_components *parts, springls__component_links *k)
{
    int i;
    for (i = 0; i < ctx->model.set.count; i++) {
        int32_t was = ctx->model.set.component[i], is = springls__component_of_springl(&ctx->model.grid, parts, ctx->model.set.s[i].p);
        ctx->model.set.component[i] = is;
        if (was < 0 || is < 0) continue;
        k->kin[was].votes++;
        k->kin[k->before + is].votes++;
        k->votes[k->vote_count++] = (uint64_t)was << 32 | (uint64_t)is;
    }
    springls__sort_keys(k->votes, k->vote_count);
}

SPRINGLS__FN void springls__vote_for_links(springls__component_links *k, int32_t a, int32_t b)
{
    a = springls__find_root(k->parent, a);
    b = springls__find_root(k->parent, b);
    if (a < b) k->parent[b] = a;
    else k->parent[a] = b;
}

/* Ties with a tenth of either one's votes count: where two components come close, single springls may be mistaken. */
SPRINGLS__FN void springls__tie(springls__component_links *k)
{
    size_t i = 0, first;
    while (i < k->vote_count) {
        int32_t was = (int32_t)(k->votes[i] >> 32), is = k->before + (int32_t)(k->votes[i] & 0xffffffffu);
        int64_t votes;
        for (first = i; i < k->vote_count && k->votes[i] == k->votes[first]; i++) continue;
        votes = 10 * (int64_t)(i - first);
        if (votes >= k->kin[was].votes || votes >= k->kin[is].votes) springls__vote_for_links(k, was, is);
    }
}

/* A part of a few voxels has no surface to speak of, and an offset would join it to anything: it belongs to the largest. */
SPRINGLS__FN bool springls__is_speck(double volume) { return volume < 10.0; }

SPRINGLS__FN void springls__tie_specks(const springls__volume_components *parts, springls__component_links *k)
{
    int i, largest = 0;
    for (i = 1; i < parts->count; i++)
        if (parts->part[i].volume > parts->part[largest].volume) largest = i;
    for (i = 0; i < k->before + parts->count && parts->count > 0; i++)
        if (springls__is_speck(i < k->before ? k->kin[i].target : k->kin[i].volume))
            springls__vote_for_links(k, i, k->before + largest);
}

/* Kin have together what they had before. Who has no kin is to have what there is. */
SPRINGLS__FN void springls__inherit(springls__volume_components *parts, springls__component_links *k)
{
    int i, nodes = k->before + parts->count;
    for (i = 0; i < nodes; i++) {
        int32_t root = springls__find_root(k->parent, i);
        if (root == i) continue;
        k->kin[root].target += k->kin[i].target;
        k->kin[root].volume += k->kin[i].volume;
    }
    for (i = 0; i < parts->count; i++) {
        springls__component_link *all = &k->kin[parts->part[i].kin = springls__find_root(k->parent, k->before + i)];
        if (!(all->target > 0.0)) all->target = all->volume;
    }
}

/* Remembers what every component is to have: of several kin, by the volumes they have now. */
SPRINGLS__FN springls_status springls__lock_components(springls_context *ctx, const springls__volume_components *parts, const springls__component_links *k)
{
    double *known;
    int i;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->locked_memory, (size_t)parts->count + 1, sizeof *known, 0));
    known = (double *)ctx->locked_memory.data;
    for (i = 0; i < parts->count; i++) {
        const springls__component_link *all = &k->kin[parts->part[i].kin];
        known[i] = all->volume > 0.0 ? all->target * (parts->part[i].volume / all->volume) : 0.0;
    }
    ctx->locked_count = parts->count;
    return SPRINGLS_OK;
}

/* ---- the offset ---- */

typedef struct springls__offset_job { springls_context *ctx; const springls__volume_components *parts; } springls__offset_job;

/* phi_next: phi less its component's offset, where it is a distance. */
SPRINGLS__FN void springls__offset_phi_task(void *arg, int begin, int end)
{
    const springls__offset_job *job = (const springls__offset_job *)arg;
    const springls__grid *g = &job->ctx->model.grid;
    int v;
    for (; begin < end; begin++) {
        const float *phi = g->phi + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            int32_t label = job->parts->label[begin * SPRINGLS__BRICK_VOXELS + v];
            out[v] = phi[v];
            if (label >= 0 && springls__fabs(phi[v]) < g->far_value)
                out[v] = springls__clamp(phi[v] - job->parts->part[label].offset, -g->far_value, g->far_value);
        }
    }
}

SPRINGLS__FN void springls__offset_springls_task(void *arg, int begin, int end)
{
    const springls__offset_job *job = (const springls__offset_job *)arg;
    springls_context *ctx = job->ctx;
    int m;
    for (; begin < end; begin++) {
        springls__springl *s = &ctx->model.set.s[begin];
        springls__v3 by;
        if (ctx->model.set.component[begin] < 0) continue;
        by = springls__scale(springls__springl_normal(*s), job->parts->part[ctx->model.set.component[begin]].offset);
        for (m = 0; m < 3; m++) s->q[m] = springls__add(s->q[m], by);
        s->p = springls__add(s->p, by);
        *s = springls__springl_finished(*s);
    }
}

SPRINGLS__FN void springls__sum_linked(const springls__volume_components *parts, springls__component_links *k)
{
    int i;
    for (i = 0; i < parts->count; i++) k->kin[parts->part[i].kin].volume = k->kin[parts->part[i].kin].area = 0.0;
    for (i = 0; i < parts->count; i++) {
        springls__component_link *all = &k->kin[parts->part[i].kin];
        all->volume += parts->part[i].volume;
        if (!parts->part[i].speck) all->area += parts->part[i].area;
    }
}

/* Newton's method: a surface of area A that moves out by d gains d A. False when no component has to move. */
SPRINGLS__FN bool springls__choose_offsets(springls__volume_components *parts, springls__component_links *k)
{
    const double close = 1e-7, longest = 0.25; /* of the volume; voxels, at once */
    bool any = false;
    int i;
    springls__sum_linked(parts, k);
    for (i = 0; i < parts->count; i++) {
        springls__volume_component *part = &parts->part[i];
        const springls__component_link *all = &k->kin[part->kin];
        double missing = all->target - all->volume, by;
        part->offset = 0.0f;
        if (part->speck || fabs(missing) <= close * all->target || !(all->area > 0.0)) continue;
        by = missing / all->area;
        part->offset = (float)(by < -longest ? -longest : by > longest ? longest : by);
        part->moved += part->offset;
        any = true;
    }
    return any;
}

SPRINGLS__FN void springls__correct_volumes(springls_context *ctx, springls__volume_components *parts, springls__component_links *k)
{
    const int iterations = 6;
    springls__offset_job job;
    int i;
    job.ctx = ctx;
    job.parts = parts;
    for (i = 0; i < iterations && springls__choose_offsets(parts, k); i++) {
        springls__parallel(ctx, ctx->model.grid.active_count, 16, springls__offset_phi_task, &job);
        springls__commit_phi(ctx, 1);
        springls__parallel(ctx, ctx->model.set.count, 512, springls__offset_springls_task, &job);
        springls__measure_components(&ctx->model.grid, parts);
    }
    springls__sum_linked(parts, k);
    springls__constellation_moved(ctx);
    springls__mark_phi_synced(ctx);
    ctx->stats.volume_correction = 0.0f;
    for (i = 0; i < parts->count; i++)
        ctx->stats.volume_correction = springls__max(ctx->stats.volume_correction, springls__fabs(parts->part[i].moved));
}

/* After a step; before the first one with the lock, when nothing is known, it only takes note. */
SPRINGLS__FN springls_status springls__volume_lock(springls_context *ctx)
{
    springls__volume_components parts;
    springls__component_links kinship;
    int i, known = ctx->locked_count;
    SPRINGLS__TRY(springls__use_host(ctx, true));
    SPRINGLS__TRY(springls__find_components(ctx, &parts));
    for (i = 0; i < parts.count; i++) parts.part[i].speck = springls__is_speck(parts.part[i].volume);
    SPRINGLS__TRY(springls__component_links_begin(ctx, &parts, &kinship));
    for (i = 0; i < ctx->model.set.count && known == 0; i++) ctx->model.set.component[i] = -1; /* of another time */
    springls__vote(ctx, &parts, &kinship);
    springls__tie(&kinship);
    springls__tie_specks(&parts, &kinship);
    springls__inherit(&parts, &kinship);
    if (known > 0) springls__correct_volumes(ctx, &parts, &kinship);
    return springls__lock_components(ctx, &parts, &kinship);
}

#endif
