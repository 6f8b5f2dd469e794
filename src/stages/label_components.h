/* label_components.h - labels the components of phi: bodies, connected parts of the inside, and cavities, connected parts of the
   outside that do not reach the border of the domain. Voxels are connected through their faces, and through a
   triangle of marching cubes, so that a component has the topology of the extracted mesh. It runs on the
   host, because it needs double precision, which not every device has. */
#ifndef SPRINGLS__STAGES_LABEL_COMPONENTS_H
#define SPRINGLS__STAGES_LABEL_COMPONENTS_H

#include "../../kernels_embed/model/marching_cubes.h"
#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../model/grid.h"
#include "../model/transform.h"

/* Sums over the surface of a part of a component: triangles of marching cubes, with what is under them towards the origin. */
typedef struct springls__surface_sums { double volume, moment[3], area, world_area; } springls__surface_sums;

/* A current component of phi. */
typedef struct springls__current_component {
    springls__surface_sums surface; /* voxel^3, volume times centroid, voxel^2 */
    uint32_t id;
    int32_t deepest;        /* voxel of active bricks furthest from the surface                                 */
    float depth, moved;     /* moved: by volume_lock                                                            */
    bool cavity;
} springls__current_component;

/* The part of a component in one brick: a node of the forest. */
typedef struct springls__node_sums {
    springls__surface_sums surface;
    int32_t deepest; /* voxel of active bricks furthest from the surface; -1: in a constant brick */
    float depth;
    bool outside;
} springls__node_sums;

/* The current components of phi, and which one every voxel belongs to. Nodes are the connected parts within active bricks, then the
   entries of the top table (constant bricks), then the exterior. */
typedef struct springls__labels {
    springls__current_component *item;
    int count;
    const int32_t *rank;     /* slot -> place in `active`                                                       */
    const int32_t *voxel;    /* node of a voxel of active bricks, 512 a place                                   */
    int32_t *node;           /* parent of a node; when all are joined, its component, -1: the exterior          */
    springls__node_sums *sums; /* one a node, while they are joined                                             */
    int32_t first_brick;     /* node of the first entry of the top table                                        */
    double area_to_world[9]; /* turns a directed area, voxel^2, into world units                                */
} springls__labels;

/* Returns the node of the exterior. */
SPRINGLS__FN int32_t springls__exterior_node(const springls__grid *g, const springls__labels *l)
{
    return l->first_brick + (int32_t)springls__entry_count(g);
}

/* Returns the node of a voxel of the domain: its own, or that of the constant brick it lies in. */
SPRINGLS__FN int32_t springls__label_node(const springls__grid *g, const springls__labels *l, int x, int y, int z)
{
    int slot;
    if (!springls__table_contains(g, x, y, z)) return springls__exterior_node(g, l);
    slot = springls__slot_at(g, x, y, z);
    if (slot < SPRINGLS__FIRST_SLOT) return l->first_brick + springls__entry_at(g, x, y, z);
    return l->voxel[l->rank[slot] * SPRINGLS__BRICK_VOXELS + springls__voxel_in_brick(x, y, z)];
}

/* Finds the coordinates of voxel i of active bricks. */
SPRINGLS__FN void springls__labelled_voxel(const springls__grid *g, int32_t i, int32_t voxel[3])
{
    int origin[3];
    springls__slot_origin(g, g->active[i / SPRINGLS__BRICK_VOXELS], origin);
    springls__voxel_of_brick(origin, i % SPRINGLS__BRICK_VOXELS, voxel);
}

/* Returns the component of a voxel of the domain; -1: the exterior. */
SPRINGLS__FN int32_t springls__component_of_voxel(const springls__grid *g, const springls__labels *l, int x, int y, int z)
{
    return l->node[springls__label_node(g, l, x, y, z)];
}

/* ---- connection within a brick ---- */

/* Voxels of a brick, a bit each: a word a layer of z, a byte of it a row of y. */
typedef struct springls__voxel_bits { uint64_t layer[SPRINGLS__BRICK]; } springls__voxel_bits;

/* Finds the voxels of the domain in the brick at `origin`, and those of them that are inside. */
SPRINGLS__FN void springls__find_inside_bits(const springls__grid *g, int slot, springls__voxel_bits *domain,
                                             springls__voxel_bits *inside)
{
    const float *phi = g->phi + (size_t)slot * SPRINGLS__BRICK_VOXELS;
    int origin[3], v, z;
    springls__slot_origin(g, slot, origin);
    for (z = 0; z < SPRINGLS__BRICK; z++) {
        uint64_t in = 0, valid = 0;
        for (v = 0; v < 64; v++) {
            in |= (uint64_t)(phi[64 * z + v] < 0.0f) << v;
            valid |= (uint64_t)(origin[0] + (v & 7) < g->size[0] && origin[1] + (v >> 3) < g->size[1]) << v;
        }
        domain->layer[z] = origin[2] + z < g->size[2] ? valid : 0;
        inside->layer[z] = in & domain->layer[z];
    }
}

/* Grows a set of voxels of a layer by one through faces. */
SPRINGLS__FN uint64_t springls__grow_layer(uint64_t bits)
{
    const uint64_t low = 0x0101010101010101u, high = 0x8080808080808080u;
    return bits | (bits & ~high) << 1 | (bits & ~low) >> 1 | bits << 8 | bits >> 8;
}

/* Grows a set of voxels through faces as far as `within` goes. */
SPRINGLS__FN void springls__flood(const springls__voxel_bits *within, springls__voxel_bits *set)
{
    bool grows = true;
    while (grows) {
        int k;
        grows = false;
        for (k = 0; k < 2 * SPRINGLS__BRICK; k++) { /* upwards, then downwards */
            int z = k < SPRINGLS__BRICK ? k : 2 * SPRINGLS__BRICK - 1 - k;
            uint64_t before = set->layer[z], bits = before, grown;
            if (z > 0) bits |= set->layer[z - 1];
            if (z < SPRINGLS__BRICK - 1) bits |= set->layer[z + 1];
            bits &= within->layer[z];
            while ((grown = springls__grow_layer(bits) & within->layer[z]) != bits) bits = grown;
            set->layer[z] = bits;
            grows = grows || bits != before;
        }
    }
}

/* Moves the first voxel of `left`, and those connected with it, from there to `set`; false when none is left. */
SPRINGLS__FN bool springls__take_connected(const springls__voxel_bits *inside, springls__voxel_bits *left,
                                           springls__voxel_bits *set)
{
    springls__voxel_bits within;
    uint64_t first;
    int z = 0, k;
    while (z < SPRINGLS__BRICK && !left->layer[z]) z++;
    if (z == SPRINGLS__BRICK) return false;
    first = left->layer[z] & (~left->layer[z] + 1);
    for (k = 0; k < SPRINGLS__BRICK; k++) {
        within.layer[k] = left->layer[k] & (inside->layer[z] & first ? inside->layer[k] : ~inside->layer[k]);
        set->layer[k] = k == z ? first : 0;
    }
    springls__flood(&within, set);
    for (k = 0; k < SPRINGLS__BRICK; k++) left->layer[k] &= ~set->layer[k];
    return true;
}

typedef struct springls__label_job {
    const springls__grid *g;
    const springls__labels *l;
    int32_t *voxel;     /* those of l                               */
    int32_t *nodes;     /* of an active brick; scanned: before it   */
} springls__label_job;

/* Numbers the connected parts within each brick, in the order of first voxels; -1: beyond the domain. */
SPRINGLS__FN void springls__label_bricks_task(void *arg, int begin, int end)
{
    const springls__label_job *job = (const springls__label_job *)arg;
    for (; begin < end; begin++) {
        int32_t *voxel = job->voxel + (size_t)begin * SPRINGLS__BRICK_VOXELS, n = 0;
        springls__voxel_bits left, inside, set;
        int v;
        springls__find_inside_bits(job->g, job->g->active[begin], &left, &inside);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) voxel[v] = -1;
        for (; springls__take_connected(&inside, &left, &set); n++)
            for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++)
                if (set.layer[v >> 6] >> (v & 63) & 1u) voxel[v] = n;
        job->nodes[begin] = n;
    }
}

/* Replaces numbers within bricks by nodes, and finds the voxel of each node that is furthest from the surface. */
SPRINGLS__FN void springls__number_nodes_task(void *arg, int begin, int end)
{
    const springls__label_job *job = (const springls__label_job *)arg;
    const int32_t exterior = springls__exterior_node(job->g, job->l);
    for (; begin < end; begin++) {
        const float *phi = job->g->phi + (size_t)job->g->active[begin] * SPRINGLS__BRICK_VOXELS;
        int32_t first = begin * SPRINGLS__BRICK_VOXELS;
        int v;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            bool valid = job->voxel[first + v] >= 0;
            int32_t node = job->voxel[first + v] = valid ? job->nodes[begin] + job->voxel[first + v] : exterior;
            springls__node_sums *sums = &job->l->sums[node];
            float depth = springls__fabs(phi[v]);
            if (!valid || (sums->deepest >= 0 && depth <= sums->depth)) continue;
            sums->deepest = first + v;
            sums->depth = depth;
            sums->outside = !(phi[v] < 0.0f);
        }
    }
}

/* ---- connection of bricks ---- */

/* Finds how many voxels of the brick at `origin` lie in the domain, along each axis. */
SPRINGLS__FN void springls__brick_extent(const springls__grid *g, const int origin[3], int extent[3])
{
    int axis;
    for (axis = 0; axis < 3; axis++) extent[axis] = springls__imin(SPRINGLS__BRICK, g->size[axis] - origin[axis]);
}

/* Joins voxel (x, y, z) of an active brick with a voxel beside it in another brick; with the exterior at the domain's border. */
SPRINGLS__FN void springls__join_across(const springls__grid *g, springls__labels *l, int32_t node, bool inside, const int to[3])
{
    int32_t other;
    if (!springls__grid_contains(g, to[0], to[1], to[2])) {
        if (inside) return;
        other = springls__exterior_node(g, l);
    } else {
        if (inside != (springls__grid_voxel(g, g->phi, to[0], to[1], to[2]) < 0.0f)) return;
        other = springls__label_node(g, l, to[0], to[1], to[2]);
    }
    if (l->node[node] != other && l->node[other] != node) springls__join_trees(l->node, node, other);
}

/* Joins the voxels at face d (-x +x -y +y -z +z) of active brick i with those beyond it. */
SPRINGLS__FN void springls__join_face(const springls__grid *g, springls__labels *l, int i, int d)
{
    const float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    const int axis = d >> 1;
    int origin[3], extent[3], at[3], to[3], j, k;
    springls__slot_origin(g, g->active[i], origin);
    springls__brick_extent(g, origin, extent);
    at[axis] = d & 1 ? extent[axis] - 1 : 0;
    for (k = 0; k < extent[(axis + 2) % 3]; k++)
        for (j = 0; j < extent[(axis + 1) % 3]; j++) {
            int v, c;
            at[(axis + 1) % 3] = j;
            at[(axis + 2) % 3] = k;
            v = springls__voxel_in_brick(at[0], at[1], at[2]);
            for (c = 0; c < 3; c++) to[c] = origin[c] + at[c];
            to[axis] += d & 1 ? 1 : -1;
            springls__join_across(g, l, l->voxel[i * SPRINGLS__BRICK_VOXELS + v], phi[v] < 0.0f, to);
        }
}

/* Joins active brick i with those beside it. Between two active bricks the lower one does it. */
SPRINGLS__FN void springls__join_active_brick(const springls__grid *g, springls__labels *l, int i)
{
    int origin[3], d;
    springls__slot_origin(g, g->active[i], origin);
    for (d = 0; d < 6; d++) {
        int x = origin[0] - 8 * (d == 0), y = origin[1] - 8 * (d == 2), z = origin[2] - 8 * (d == 4);
        if (!(d & 1) && springls__grid_contains(g, x, y, z) && springls__slot_at(g, x, y, z) >= SPRINGLS__FIRST_SLOT) continue;
        springls__join_face(g, l, i, d);
    }
}

/* Joins the constant brick of an entry with those beside it of its side, and one outside at the end of the top table with the
   exterior. */
SPRINGLS__FN void springls__join_constant_brick(const springls__grid *g, springls__labels *l, int entry)
{
    int axis, stride = 1;
    for (axis = 0; axis < 3; axis++) {
        const int place = entry / stride % g->table.bricks[axis];
        bool last = place == g->table.bricks[axis] - 1;
        if (g->top[entry] == SPRINGLS__OUTSIDE && (last || place == 0))
            springls__join_trees(l->node, l->first_brick + entry, springls__exterior_node(g, l));
        if (!last && g->top[entry + stride] == g->top[entry])
            springls__join_trees(l->node, l->first_brick + entry, l->first_brick + entry + stride);
        stride *= g->table.bricks[axis];
    }
}

/* ---- triangles of marching cubes ---- */

/* A triangle, with the nodes at the inner and at the outer ends of the edges of the cube that carry its vertices. */
typedef struct springls__labelled_triangle { springls__tri t; int32_t inner[3], outer[3]; } springls__labelled_triangle;

typedef void (*springls__triangle_visit)(springls__labels *l, const springls__labelled_triangle *triangle);

/* Active brick `rank`, whose cubes are visited. */
typedef struct springls__cube_walk {
    springls__cube_range range;
    int rank;
    float tile[SPRINGLS__TILE_VOXELS];
} springls__cube_walk;

/* Returns the node of a corner of the cube at (x, y, z) of the brick; voxels beyond the domain belong to the exterior. */
SPRINGLS__FN int32_t springls__corner_node(const springls__grid *g, const springls__labels *l, const springls__cube_walk *walk,
                                           int x, int y, int z, int corner)
{
    x += corner & 1;
    y += corner >> 1 & 1;
    z += corner >> 2;
    if (!((x | y | z) & ~7)) return l->voxel[walk->rank * SPRINGLS__BRICK_VOXELS + x + 8 * y + 64 * z];
    x += walk->range.origin[0];
    y += walk->range.origin[1];
    z += walk->range.origin[2];
    return springls__label_node(g, l, x, y, z);
}

/* Visits the triangles of the cube at (x, y, z) of a brick. */
SPRINGLS__FN void springls__visit_cube(const springls__grid *g, springls__labels *l, const springls__cube_walk *walk, int x,
                                       int y, int z, springls__triangle_visit visit)
{
    springls__mc_cell cell = springls__tile_cube(walk->tile, x, y, z);
    int mask = springls__mc_case(cell), count = springls__mc_count(mask), k, m;
    springls__labelled_triangle triangle;
    for (k = 0; k < count; k++) {
        for (m = 0; m < 3; m++) {
            int edge = springls__mc_edge(mask, k, m), corner = springls__mc_edge_corner(edge);
            int other = corner | 1 << springls__mc_edge_axis(edge);
            bool inside = springls__mc_inside(cell.phi[corner]);
            triangle.inner[m] = springls__corner_node(g, l, walk, x, y, z, inside ? corner : other);
            triangle.outer[m] = springls__corner_node(g, l, walk, x, y, z, inside ? other : corner);
        }
        triangle.t = springls__cube_triangle(&walk->range, cell, mask, x, y, z, k);
        (visit)(l, &triangle);
    }
}

/* Visits all triangles of the zero level. */
SPRINGLS__FN void springls__visit_triangles(const springls__grid *g, springls__labels *l, springls__triangle_visit visit)
{
    const int across = SPRINGLS__TILE;
    springls__cube_walk walk;
    uint32_t inside[SPRINGLS__TILE * SPRINGLS__TILE];
    int x, y, z, row;
    for (walk.rank = 0; walk.rank < g->active_count; walk.rank++) {
        walk.range = springls__brick_cubes(g, g->active[walk.rank]);
        springls__load_tile(g, g->phi, g->active[walk.rank], springls__alone(), walk.tile);
        for (row = 0; row < across * across; row++) inside[row] = springls__signs_of_row(walk.tile + across * row);
        for (z = walk.range.lo[2]; z <= walk.range.hi[2]; z++)
            for (y = walk.range.lo[1]; y <= walk.range.hi[1]; y++) {
                const uint32_t *bits = inside + (y + 1) + across * (z + 1);
                uint32_t some = bits[0] | bits[1] | bits[across] | bits[across + 1];
                uint32_t all = bits[0] & bits[1] & bits[across] & bits[across + 1];
                uint32_t mixed = (some | some >> 1) & ~(all & all >> 1); /* corners of either side */
                for (x = walk.range.lo[0]; mixed && x <= walk.range.hi[0]; x++)
                    if (mixed >> (x + 1) & 1u) springls__visit_cube(g, l, &walk, x, y, z, visit);
            }
    }
}

/* ---- measures ---- */

/* Finds the area of a triangle, and the tetrahedron that it makes with the origin. */
SPRINGLS__FN springls__surface_sums springls__triangle_sums(const springls__labels *l, springls__tri t)
{
    springls__v3 area2 = springls__tri_area2(t);
    const double n[3] = { (double)area2.x, (double)area2.y, (double)area2.z }, *m = l->area_to_world;
    const double sum[3] = { (double)t.a.x + (double)t.b.x + (double)t.c.x, (double)t.a.y + (double)t.b.y + (double)t.c.y,
                            (double)t.a.z + (double)t.b.z + (double)t.c.z };
    springls__surface_sums out;
    double world2 = 0.0;
    int c;
    out.volume = ((double)t.a.x * n[0] + (double)t.a.y * n[1] + (double)t.a.z * n[2]) * (1.0 / 6.0);
    for (c = 0; c < 3; c++) {
        double w = m[3 * c] * n[0] + m[3 * c + 1] * n[1] + m[3 * c + 2] * n[2];
        world2 += w * w;
        out.moment[c] = 0.25 * out.volume * sum[c];
    }
    out.area = 0.5 * (double)springls__length(area2);
    out.world_area = 0.5 * sqrt(world2);
    return out;
}

SPRINGLS__FN void springls__add_sums(springls__surface_sums *to, const springls__surface_sums *by, double sign)
{
    int c;
    to->volume += sign * by->volume;
    for (c = 0; c < 3; c++) to->moment[c] += sign * by->moment[c];
    to->area += by->area;
    to->world_area += by->world_area;
}

/* Joins what a triangle connects on either side, and measures it. */
SPRINGLS__FN void springls__join_triangle(springls__labels *l, const springls__labelled_triangle *triangle)
{
    springls__surface_sums sums = springls__triangle_sums(l, triangle->t);
    int m;
    springls__add_sums(&l->sums[triangle->inner[0]].surface, &sums, 1.0);
    springls__add_sums(&l->sums[triangle->outer[0]].surface, &sums, -1.0);
    for (m = 1; m < 3; m++) {
        if (triangle->inner[m] != triangle->inner[0]) springls__join_trees(l->node, triangle->inner[0], triangle->inner[m]);
        if (triangle->outer[m] != triangle->outer[0]) springls__join_trees(l->node, triangle->outer[0], triangle->outer[m]);
    }
}

/* Finds the matrix of directed areas: the cofactors of voxel -> world. */
SPRINGLS__FN void springls__area_to_world(const springls_context *ctx, double out[9])
{
    const double *m = ctx->window.to_world;
    int i, j;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++) {
            int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
            out[3 * i + j] = m[4 * a + c] * m[4 * b + d] - m[4 * a + d] * m[4 * b + c];
        }
}

/* ---- labels ---- */

/* Replaces the parents of nodes by components, which are numbered in the order of their first voxel. A component has a surface,
   so some voxel of it is in an active brick; roots are the lowest of their trees, so they come first. */
SPRINGLS__FN void springls__number_components(const springls__grid *g, springls__labels *l)
{
    int32_t i, exterior = springls__exterior_node(g, l), root = springls__find_root(l->node, exterior);
    l->count = 0;
    for (i = 0; i <= exterior; i++) {
        if (l->node[i] != i) l->node[i] = l->node[l->node[i]];
        else l->node[i] = i != root && i < l->first_brick ? l->count++ : -1;
    }
}

/* Points at the labels that the context keeps. */
SPRINGLS__FN springls__labels springls__kept_labels(const springls_context *ctx)
{
    springls__labels l;
    memset(&l, 0, sizeof l);
    l.rank = (const int32_t *)ctx->label_rank.data;
    l.voxel = (const int32_t *)ctx->label_voxel.data;
    l.node = (int32_t *)ctx->label_node.data;
    l.first_brick = ctx->label_first_brick;
    l.count = ctx->label_count;
    return l;
}

/* Numbers the nodes of active bricks, and makes each a tree of its own. */
SPRINGLS__FN springls_status springls__label_bricks(springls_context *ctx, springls__labels *l)
{
    const springls__grid *g = &ctx->model.grid;
    const size_t entries = springls__entry_count(g);
    springls__label_job job;
    int32_t i, n = 0, count;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->label_rank, (size_t)g->slot_count, sizeof(int32_t), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->label_voxel, (size_t)g->active_count * SPRINGLS__BRICK_VOXELS + 1,
                                        sizeof(int32_t), 0));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_nodes, g->active_count + 1));
    job.g = g;
    job.l = l;
    job.voxel = (int32_t *)ctx->label_voxel.data;
    job.nodes = springls__brick_nodes(&ctx->model);
    springls__parallel(ctx, g->active_count, 16, springls__label_bricks_task, &job);
    for (i = 0; i < g->active_count; i++) {
        ((int32_t *)ctx->label_rank.data)[g->active[i]] = i;
        count = job.nodes[i];
        job.nodes[i] = n;
        n += count;
    }
    ctx->label_first_brick = n;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->label_node, (size_t)n + entries + 1, sizeof(int32_t), 0));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, node_sums_list, (size_t)n + entries + 1));
    *l = springls__kept_labels(ctx);
    l->sums = springls__node_sums_list(&ctx->model);
    for (i = 0; i <= springls__exterior_node(g, l); i++) {
        l->node[i] = i;
        memset(&l->sums[i], 0, sizeof l->sums[i]);
        l->sums[i].deepest = -1;
    }
    springls__parallel(ctx, g->active_count, 16, springls__number_nodes_task, &job);
    return SPRINGLS_OK;
}

/* Labels all voxels, and measures the nodes; the labels stay in the context until bricks come or go, or phi changes. Works on the
   host. */
SPRINGLS__FN springls_status springls__label_voxels(springls_context *ctx, springls__labels *l)
{
    const springls__grid *g = &ctx->model.grid;
    const int entries = (int)springls__entry_count(g);
    int i;
    ctx->labels_version = 0; /* until all are found */
    if ((int64_t)g->active_count * SPRINGLS__BRICK_VOXELS + entries + 1 > INT32_MAX)
        return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "components: the surface is too large");
    SPRINGLS__TRY(springls__label_bricks(ctx, l));
    for (i = 0; i < entries; i++)
        if (g->top[i] < SPRINGLS__FIRST_SLOT) springls__join_constant_brick(g, l, i);
    for (i = 0; i < g->active_count; i++) springls__join_active_brick(g, l, i);
    springls__area_to_world(ctx, l->area_to_world);
    springls__visit_triangles(g, l, springls__join_triangle);
    springls__number_components(g, l);
    ctx->label_count = l->count;
    ctx->labels_version = ctx->phi_version;
    return SPRINGLS_OK;
}

/* Adds a node to its component. */
SPRINGLS__FN void springls__add_node(springls__current_component *item, const springls__node_sums *node)
{
    springls__add_sums(&item->surface, &node->surface, 1.0);
    if (node->deepest < 0) return;
    item->cavity = node->outside;
    if (node->depth <= item->depth && item->depth > 0.0f) return;
    item->depth = node->depth;
    item->deepest = node->deepest;
}

/* Finds and measures the components of phi. */
SPRINGLS__FN springls_status springls__find_components(springls_context *ctx, springls__labels *l)
{
    int32_t i;
    SPRINGLS__TRY(springls__label_voxels(ctx, l));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, current_components, l->count + 1));
    l->item = springls__current_components(&ctx->model);
    memset(l->item, 0, (size_t)l->count * sizeof *l->item);
    for (i = 0; i < springls__exterior_node(&ctx->model.grid, l); i++)
        if (l->node[i] >= 0) springls__add_node(&l->item[l->node[i]], &l->sums[i]);
    return SPRINGLS_OK;
}

/* ---- places ---- */

/* Returns the direction of the neighbor with the lowest phi, if that is less than `least`; -1 if none is. */
SPRINGLS__FN int springls__steepest_descent(const springls__grid *g, const int at[3], float least)
{
    float phi;
    int d, best = -1, to[3];
    for (d = 0; d < 6; d++) {
        springls__neighbor_voxel(at, d, to);
        if (!springls__table_contains(g, to[0], to[1], to[2])) continue;
        phi = springls__grid_voxel(g, g->phi, to[0], to[1], to[2]);
        if (phi >= least) continue;
        least = phi;
        best = d;
    }
    return best;
}

/* Returns the body of a voxel: its own, or outside the one that steepest descent of phi leads to; -1 if phi is flat. */
SPRINGLS__FN int32_t springls__body_of_voxel(const springls__grid *g, const springls__labels *l, const int voxel[3])
{
    const int longest = 32; /* voxels: more than any band is wide */
    int at[3] = { voxel[0], voxel[1], voxel[2] }, step, d;
    for (step = 0; step < longest; step++) {
        float phi = springls__grid_voxel(g, g->phi, at[0], at[1], at[2]);
        if (phi < 0.0f) return springls__component_of_voxel(g, l, at[0], at[1], at[2]);
        d = springls__steepest_descent(g, at, phi);
        if (d < 0) return -1;
        springls__neighbor_voxel(at, d, at);
    }
    return -1;
}

/* Finds the body and the cavity that the surface near x bounds, -1 for none: those of the deepest and of the highest of the eight
   voxels about x. */
SPRINGLS__FN void springls__components_at(const springls__grid *g, const springls__labels *l, springls__v3 x, int32_t *body,
                                          int32_t *cavity)
{
    int first[3], lowest[3] = { -1, -1, -1 }, corner;
    int32_t high = -1;
    float least = FLT_MAX, most = -FLT_MAX;
    first[0] = (int)springls__floor(springls__clamp(x.x, -1.0f, (float)g->size[0]));
    first[1] = (int)springls__floor(springls__clamp(x.y, -1.0f, (float)g->size[1]));
    first[2] = (int)springls__floor(springls__clamp(x.z, -1.0f, (float)g->size[2]));
    *body = *cavity = -1;
    for (corner = 0; corner < 8; corner++) {
        int at[3] = { first[0] + (corner & 1), first[1] + (corner >> 1 & 1), first[2] + (corner >> 2) };
        float phi;
        if (!springls__table_contains(g, at[0], at[1], at[2])) continue;
        phi = springls__grid_voxel(g, g->phi, at[0], at[1], at[2]);
        if (phi < least) memcpy(lowest, at, sizeof lowest);
        least = springls__min(least, phi);
        if (phi < 0.0f || phi <= most) continue;
        most = phi;
        high = springls__label_node(g, l, at[0], at[1], at[2]);
    }
    if (lowest[0] >= 0) *body = springls__body_of_voxel(g, l, lowest);
    if (high >= 0) *cavity = l->node[high];
}

#endif
