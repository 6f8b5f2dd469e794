/* label_components.h - labels the components of phi: bodies, which are what is connected inside, and cavities, which are what
   is connected outside and does not reach the border of the domain. Voxels are connected through their faces, and through a
   triangle of marching cubes, so that a component has the topology of the extracted mesh. In double precision, which not every
   device has: it always runs on the host. */
#ifndef SPRINGLS__STAGES_LABEL_COMPONENTS_H
#define SPRINGLS__STAGES_LABEL_COMPONENTS_H

#include "../../kernels_embed/model/marching_cubes.h"
#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../model/grid.h"
#include "../model/transform.h"

/* A component of phi as it is now. */
typedef struct springls__component_now {
    double volume, area, moment[3];        /* voxel^3, voxel^2; volume times centroid, voxels */
    double world_area;
    uint32_t id;
    int32_t deepest;        /* node of the voxel furthest from the surface                                      */
    float depth, moved;     /* moved: by volume_lock                                                            */
    bool cavity;
} springls__component_now;

/* The components of phi as it is now, and the label of every voxel. */
typedef struct springls__labels {
    springls__component_now *item;
    int count;
    const int32_t *rank;    /* slot -> place in `active`                                                        */
    int32_t *parent;        /* forest of the voxels of active bricks, 512 a place, of all bricks, and the exterior */
    int32_t *label;         /* component of a voxel of active bricks; -1: the exterior                          */
    const int32_t *body;    /* volume_lock: body of a voxel of active bricks, also outside                      */
    int32_t voxels;         /* nodes that are voxels                                                            */
    double area_to_world[9]; /* turns a directed area, voxel^2, into world units                                */
} springls__labels;

/* Returns the node of a voxel of the domain: its own, or that of the constant brick it lies in. */
SPRINGLS__FN int32_t springls__label_node(const springls__grid *g, const springls__labels *l, int x, int y, int z)
{
    int slot = springls__slot_at(g, x, y, z);
    if (slot < SPRINGLS__FIRST_SLOT) return l->voxels + springls__brick_at(g, x, y, z);
    return l->rank[slot] * SPRINGLS__BRICK_VOXELS + springls__voxel_in_brick(x, y, z);
}

/* Finds the voxel of a node that is one. */
SPRINGLS__FN void springls__voxel_of_node(const springls__grid *g, int32_t node, int32_t voxel[3])
{
    int v = node % SPRINGLS__BRICK_VOXELS, origin[3];
    springls__slot_origin(g, g->active[node / SPRINGLS__BRICK_VOXELS], origin);
    voxel[0] = origin[0] + (v & 7);
    voxel[1] = origin[1] + (v >> 3 & 7);
    voxel[2] = origin[2] + (v >> 6);
}

/* Returns the component of a node; -1: the exterior. Precondition: the insides of active bricks are labelled. */
SPRINGLS__FN int32_t springls__label_of_node(const springls__labels *l, int32_t node)
{
    if (node >= l->voxels) node = springls__find_root(l->parent, node);
    return node < l->voxels ? l->label[node] : -1;
}

/* Joins two trees of a forest; the lower root stays a root. */
SPRINGLS__FN void springls__join_trees(int32_t *parent, int32_t a, int32_t b)
{
    a = springls__find_root(parent, a);
    b = springls__find_root(parent, b);
    if (a < b) parent[b] = a;
    else parent[a] = b;
}

/* ---- connection ---- */

/* Joins a row of 8 voxels with the row beside it where the sides agree, once for each run of voxels. a, b: their first nodes. */
SPRINGLS__FN void springls__join_rows(int32_t *parent, int32_t a, const float *phi_a, int32_t b, const float *phi_b, int length)
{
    int x;
    bool joined = false; /* with the voxels before */
    for (x = 0; x < length; x++) {
        bool inside = phi_a[x] < 0.0f, agrees = inside == (phi_b[x] < 0.0f);
        if (x > 0 && inside != (phi_a[x - 1] < 0.0f)) joined = false;
        if (agrees && !joined) springls__join_trees(parent, a + x, b + x);
        joined = agrees;
    }
}

/* Finds how many voxels of the brick at `origin` lie in the domain, along each axis. */
SPRINGLS__FN void springls__brick_extent(const springls__grid *g, const int origin[3], int extent[3])
{
    int axis;
    for (axis = 0; axis < 3; axis++) extent[axis] = springls__imin(SPRINGLS__BRICK, g->size[axis] - origin[axis]);
}

/* Joins the voxels of active brick i with each other. */
SPRINGLS__FN void springls__join_within_brick(const springls__grid *g, springls__labels *l, int i)
{
    const float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    int32_t first = i * SPRINGLS__BRICK_VOXELS;
    int origin[3], extent[3], x, y, z;
    springls__slot_origin(g, g->active[i], origin);
    springls__brick_extent(g, origin, extent);
    for (z = 0; z < extent[2]; z++)
        for (y = 0; y < extent[1]; y++) {
            int32_t row = 8 * y + 64 * z;
            for (x = 1; x < extent[0]; x++)
                if ((phi[row + x] < 0.0f) == (phi[row + x - 1] < 0.0f))
                    springls__join_trees(l->parent, first + row + x - 1, first + row + x);
            if (y > 0) springls__join_rows(l->parent, first + row, phi + row, first + row - 8, phi + row - 8, extent[0]);
            if (z > 0) springls__join_rows(l->parent, first + row, phi + row, first + row - 64, phi + row - 64, extent[0]);
        }
}

/* Joins voxel (x, y, z) of an active brick with a voxel beside it in another brick; with the exterior at the domain's border. */
SPRINGLS__FN void springls__join_across(const springls__grid *g, springls__labels *l, int32_t node, bool inside, const int to[3])
{
    if (!springls__grid_contains(g, to[0], to[1], to[2])) {
        if (!inside) springls__join_trees(l->parent, node, l->voxels + (int32_t)springls__brick_count(g));
    } else if (inside == (springls__grid_voxel(g, g->phi, to[0], to[1], to[2]) < 0.0f)) {
        springls__join_trees(l->parent, node, springls__label_node(g, l, to[0], to[1], to[2]));
    }
}

/* Joins the voxels at the faces of active brick i with what is beyond; d: the face, -x +x -y +y -z +z. */
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
            springls__join_across(g, l, i * SPRINGLS__BRICK_VOXELS + v, phi[v] < 0.0f, to);
        }
}

/* Joins a constant brick with those beside it of its side, and one outside at the border with the exterior. */
SPRINGLS__FN void springls__join_constant_brick(const springls__grid *g, springls__labels *l, int brick)
{
    const int32_t exterior = l->voxels + (int32_t)springls__brick_count(g);
    int place[3], axis, stride = 1;
    springls__brick_place(g, brick, place);
    for (axis = 0; axis < 3; axis++) {
        bool last = place[axis] == g->bricks[axis] - 1;
        if (g->top[brick] == SPRINGLS__OUTSIDE && (last || place[axis] == 0))
            springls__join_trees(l->parent, l->voxels + brick, exterior);
        if (!last && g->top[brick + stride] == g->top[brick])
            springls__join_trees(l->parent, l->voxels + brick, l->voxels + brick + stride);
        stride *= g->bricks[axis];
    }
}

/* ---- triangles of marching cubes ---- */

/* A triangle, with the nodes at the inner and at the outer ends of the edges of the cube that carry its vertices. */
typedef struct springls__labelled_triangle { springls__tri t; int32_t inner[3], outer[3]; } springls__labelled_triangle;

typedef void (*springls__triangle_visit)(springls__labels *l, const springls__labelled_triangle *triangle);

/* Returns the node of a corner of the cube at voxel `at`; voxels beyond the domain belong to the exterior. */
SPRINGLS__FN int32_t springls__corner_node(const springls__grid *g, const springls__labels *l, const int at[3], int corner)
{
    int x = at[0] + (corner & 1), y = at[1] + (corner >> 1 & 1), z = at[2] + (corner >> 2);
    if (!springls__grid_contains(g, x, y, z)) return l->voxels + (int32_t)springls__brick_count(g);
    return springls__label_node(g, l, x, y, z);
}

/* Visits the triangles of the cube at (x, y, z) of a brick. */
SPRINGLS__FN void springls__visit_cube(const springls__grid *g, springls__labels *l, const springls__cube_range *range,
                                       springls__mc_cell cell, int x, int y, int z, springls__triangle_visit visit)
{
    int mask = springls__mc_case(cell), count = springls__mc_count(mask), k, m, at[3];
    springls__labelled_triangle triangle;
    if (count == 0) return;
    at[0] = range->origin[0] + x;
    at[1] = range->origin[1] + y;
    at[2] = range->origin[2] + z;
    for (k = 0; k < count; k++) {
        for (m = 0; m < 3; m++) {
            int edge = springls__mc_edge(mask, k, m), corner = springls__mc_edge_corner(edge);
            int other = corner | 1 << springls__mc_edge_axis(edge);
            bool inside = springls__mc_inside(cell.phi[corner]) != 0;
            triangle.inner[m] = springls__corner_node(g, l, at, inside ? corner : other);
            triangle.outer[m] = springls__corner_node(g, l, at, inside ? other : corner);
        }
        triangle.t = springls__cube_triangle(range, cell, mask, x, y, z, k);
        visit(l, &triangle);
    }
}

/* Visits all triangles of the zero level. */
SPRINGLS__FN void springls__visit_triangles(const springls__grid *g, springls__labels *l, springls__triangle_visit visit)
{
    float tile[SPRINGLS__TILE_VOXELS];
    int i, x, y, z;
    for (i = 0; i < g->active_count; i++) {
        springls__cube_range range = springls__brick_cubes(g, g->active[i]);
        springls__load_tile(g, g->phi, g->active[i], springls__alone(), tile);
        for (z = range.lo[2]; z <= range.hi[2]; z++)
            for (y = range.lo[1]; y <= range.hi[1]; y++)
                for (x = range.lo[0]; x <= range.hi[0]; x++)
                    springls__visit_cube(g, l, &range, springls__tile_cube(tile, x, y, z), x, y, z, visit);
    }
}

SPRINGLS__FN void springls__join_triangle(springls__labels *l, const springls__labelled_triangle *triangle)
{
    int m;
    for (m = 1; m < 3; m++) {
        springls__join_trees(l->parent, triangle->inner[0], triangle->inner[m]);
        springls__join_trees(l->parent, triangle->outer[0], triangle->outer[m]);
    }
}

/* ---- labels ---- */

/* Numbers the components in the order of their first voxel. A component has a surface, so some voxel of it is in an active brick;
   roots are the lowest of their trees, so they come first. */
SPRINGLS__FN void springls__number_components(const springls__grid *g, springls__labels *l)
{
    int32_t i, exterior = springls__find_root(l->parent, l->voxels + (int32_t)springls__brick_count(g));
    l->count = 0;
    for (i = 0; i < l->voxels; i++) {
        int32_t root = springls__find_root(l->parent, i);
        int origin[3], v = i % SPRINGLS__BRICK_VOXELS;
        if (root != i) {
            l->label[i] = root < l->voxels ? l->label[root] : -1;
            continue;
        }
        springls__slot_origin(g, g->active[i / SPRINGLS__BRICK_VOXELS], origin);
        l->label[i] = root != exterior && springls__grid_contains(g, origin[0] + (v & 7), origin[1] + (v >> 3 & 7),
                                                                  origin[2] + (v >> 6)) ? l->count++ : -1;
    }
}

/* Points at the labels that the context keeps, and at the list of components. */
SPRINGLS__FN springls__labels springls__kept_labels(const springls_context *ctx)
{
    springls__labels l;
    memset(&l, 0, sizeof l);
    l.rank = (const int32_t *)ctx->label_rank.data;
    l.parent = (int32_t *)ctx->label_parent.data;
    l.label = (int32_t *)ctx->label_memory.data;
    l.voxels = ctx->labelled_bricks * SPRINGLS__BRICK_VOXELS;
    l.count = ctx->label_count;
    return l;
}

/* Labels all voxels; the labels stay in the context until bricks come or go, or phi changes. Works on the host. */
SPRINGLS__FN springls_status springls__label_voxels(springls_context *ctx, springls__labels *l)
{
    const springls__grid *g = &ctx->model.grid;
    const int bricks = (int)springls__brick_count(g);
    int64_t nodes = (int64_t)g->active_count * SPRINGLS__BRICK_VOXELS + bricks + 1;
    int32_t i;
    int d;
    ctx->labels_fresh = false;
    if (nodes > INT32_MAX) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "components: the surface is too large");
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->label_rank, (size_t)g->slot_count, sizeof(int32_t), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->label_parent, (size_t)nodes, sizeof(int32_t), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->label_memory, (size_t)g->active_count * SPRINGLS__BRICK_VOXELS + 1, sizeof(int32_t), 0));
    ctx->labelled_bricks = g->active_count;
    *l = springls__kept_labels(ctx);
    for (i = 0; i < g->active_count; i++) ((int32_t *)ctx->label_rank.data)[g->active[i]] = i;
    for (i = 0; i < (int32_t)nodes; i++) l->parent[i] = i;
    for (i = 0; i < bricks; i++)
        if (g->top[i] < SPRINGLS__FIRST_SLOT) springls__join_constant_brick(g, l, i);
    for (i = 0; i < g->active_count; i++) {
        springls__join_within_brick(g, l, i);
        for (d = 0; d < 6; d++) springls__join_face(g, l, i, d);
    }
    springls__visit_triangles(g, l, springls__join_triangle);
    springls__number_components(g, l);
    ctx->label_count = l->count;
    ctx->labels_fresh = true;
    return SPRINGLS_OK;
}

/* ---- measures ---- */

/* Adds a triangle's area, and the volume under it, to a component; the volume of a cavity is on the triangle's other side. */
SPRINGLS__FN void springls__add_triangle(const springls__labels *l, springls__component_now *item, springls__tri t)
{
    springls__v3 area2 = springls__tri_area2(t);
    const double n[3] = { (double)area2.x, (double)area2.y, (double)area2.z }, *m = l->area_to_world;
    const double sum[3] = { (double)t.a.x + (double)t.b.x + (double)t.c.x, (double)t.a.y + (double)t.b.y + (double)t.c.y,
                            (double)t.a.z + (double)t.b.z + (double)t.c.z };
    double volume = ((double)t.a.x * n[0] + (double)t.a.y * n[1] + (double)t.a.z * n[2]) * (item->cavity ? -1.0 / 6.0 : 1.0 / 6.0);
    double world2 = 0.0;
    int c;
    for (c = 0; c < 3; c++) {
        double w = m[3 * c] * n[0] + m[3 * c + 1] * n[1] + m[3 * c + 2] * n[2];
        world2 += w * w;
        item->moment[c] += 0.25 * volume * sum[c]; /* of the tetrahedron with the origin */
    }
    item->area += 0.5 * (double)springls__length(area2);
    item->world_area += 0.5 * sqrt(world2);
    item->volume += volume;
}

SPRINGLS__FN void springls__measure_triangle(springls__labels *l, const springls__labelled_triangle *triangle)
{
    int32_t body = springls__label_of_node(l, triangle->inner[0]), cavity = springls__label_of_node(l, triangle->outer[0]);
    if (body >= 0) springls__add_triangle(l, &l->item[body], triangle->t);
    if (cavity >= 0) springls__add_triangle(l, &l->item[cavity], triangle->t);
}


/* Finds the matrix of directed areas: the cofactors of voxel -> world. */
SPRINGLS__FN void springls__area_to_world(const springls_context *ctx, double out[9])
{
    const double *m = ctx->to_world;
    int i, j;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++) {
            int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
            out[3 * i + j] = m[4 * a + c] * m[4 * b + d] - m[4 * a + d] * m[4 * b + c];
        }
}

/* Notes the side of a component, and its voxel furthest from the surface. */
SPRINGLS__FN void springls__note_voxel(springls__component_now *item, int32_t node, float phi)
{
    item->cavity = !(phi < 0.0f);
    if (springls__fabs(phi) <= item->depth && item->depth > 0.0f) return;
    item->depth = springls__fabs(phi);
    item->deepest = node;
}

/* Finds and measures the components of phi. */
SPRINGLS__FN springls_status springls__find_components(springls_context *ctx, springls__labels *l)
{
    const springls__grid *g = &ctx->model.grid;
    int32_t i;
    SPRINGLS__TRY(springls__label_voxels(ctx, l));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, components_now, l->count + 1));
    l->item = springls__components_now(&ctx->model);
    memset(l->item, 0, (size_t)l->count * sizeof *l->item);
    for (i = 0; i < l->voxels; i++)
        if (l->label[i] >= 0)
            springls__note_voxel(&l->item[l->label[i]], i,
                                 g->phi[(size_t)g->active[i / SPRINGLS__BRICK_VOXELS] * SPRINGLS__BRICK_VOXELS
                                        + (size_t)(i % SPRINGLS__BRICK_VOXELS)]);
    springls__area_to_world(ctx, l->area_to_world);
    springls__visit_triangles(g, l, springls__measure_triangle);
    return SPRINGLS_OK;
}

/* ---- places ---- */

/* Finds the voxel next to (x, y, z) in direction d: -x +x -y +y -z +z. */
SPRINGLS__FN void springls__voxel_beside(int x, int y, int z, int d, int out[3])
{
    out[0] = x + (d == 1) - (d == 0);
    out[1] = y + (d == 3) - (d == 2);
    out[2] = z + (d == 5) - (d == 4);
}

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

/* Returns the body of a voxel: its own, or outside the one that steepest descent of phi leads to; -1 where phi is flat. */
SPRINGLS__FN int32_t springls__body_of_voxel(const springls__grid *g, const springls__labels *l, int x, int y, int z)
{
    const int longest = 32; /* voxels: more than any band is wide */
    int step, d, to[3];
    for (step = 0; step < longest; step++) {
        float phi = springls__grid_voxel(g, g->phi, x, y, z);
        if (phi < 0.0f) return springls__label_of_node(l, springls__label_node(g, l, x, y, z));
        d = springls__steepest_descent(g, x, y, z, phi);
        if (d < 0) return -1;
        springls__voxel_beside(x, y, z, d, to);
        x = to[0];
        y = to[1];
        z = to[2];
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
        if (!springls__grid_contains(g, at[0], at[1], at[2])) continue;
        phi = springls__grid_voxel(g, g->phi, at[0], at[1], at[2]);
        if (phi < least) memcpy(lowest, at, sizeof lowest);
        least = springls__min(least, phi);
        if (phi < 0.0f || phi <= most) continue;
        most = phi;
        high = springls__label_node(g, l, at[0], at[1], at[2]);
    }
    if (lowest[0] >= 0) *body = springls__body_of_voxel(g, l, lowest[0], lowest[1], lowest[2]);
    if (high >= 0) *cavity = springls__label_of_node(l, high);
}

#endif
