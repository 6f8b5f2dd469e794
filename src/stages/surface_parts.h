/* surface_parts.h - the connected parts of the mesh of what springls hold (surface_table.h), and how they lie in each other. A part bounds
   a component: the inside beside it where it faces outwards, a body, else the outside in it, a cavity. Lines of the grid show
   which lies in which:

        outside |  body A   | cavity B | A again |  outside        Along a line crossings lead from component to component: one of
     -----------A-----------B----------B---------A---------->      the part that has been entered last leads out of it, any other
                                                                   into its own. So what encloses a part is known, exactly. */
#ifndef SPRINGLS__STAGES_SURFACE_PARTS_H
#define SPRINGLS__STAGES_SURFACE_PARTS_H

#include "../runtime/algorithms.h"
#include "../runtime/errors.h"
#include "../model/cell_list.h"
#include "../model/host_access.h"
#include "label_components.h"
#include "surface_table.h"

/* A connected part of the mesh. outer: the part whose component is on its other side, -1: the exterior. */
typedef struct springls__surface_part {
    springls__surface_sums sums;
    int32_t outer, vertices;
    bool cavity, met;
} springls__surface_part;

/* Returns true if components are those of the mesh of what springls hold. */
SPRINGLS__FN bool springls__contours_springls(const springls_context *ctx)
{
    return ctx->model.params.contouring == SPRINGLS_CONTOURING_SPRINGLS;
}

SPRINGLS__FN int32_t *springls__part_of_vertices(const springls_context *ctx)
{
    return (int32_t *)ctx->surface_memory[SPRINGLS__SURFACE_VERTEX_PART].data;
}

SPRINGLS__FN springls__surface_part *springls__surface_parts(const springls_context *ctx)
{
    return (springls__surface_part *)ctx->surface_memory[SPRINGLS__SURFACE_PARTS].data;
}

/* Returns the body and the cavity on the two sides of a part, by their parts; -1: there is none. */
SPRINGLS__FN int32_t springls__body_of_part(const springls__surface_part *parts, int32_t p)
{
    return parts[p].cavity ? parts[p].outer : p;
}

SPRINGLS__FN int32_t springls__cavity_of_part(const springls__surface_part *parts, int32_t p)
{
    return parts[p].cavity ? p : parts[p].outer;
}

/* Numbers the parts in the order of their first vertices. Returns how many there are. */
SPRINGLS__FN int springls__number_parts(const springls_context *ctx, const springls__raw_mesh *mesh)
{
    int32_t *part = springls__part_of_vertices(ctx);
    int i, k, count = 0;
    for (i = 0; i < ctx->surface_vertices; i++) part[i] = i;
    for (i = 0; i < ctx->surface_triangles; i++)
        for (k = 1; k < 3; k++) springls__join_trees(part, mesh->triangles[3 * (size_t)i], mesh->triangles[3 * (size_t)i + (size_t)k]);
    for (i = 0; i < ctx->surface_vertices; i++) part[i] = springls__find_root(part, i);
    for (i = 0; i < ctx->surface_vertices; i++) part[i] = part[i] == i ? ~count++ : part[part[i]]; /* roots come first */
    for (i = 0; i < ctx->surface_vertices; i++) part[i] = ~part[i];
    return count;
}

/* Measures the parts. */
SPRINGLS__FN void springls__measure_parts(const springls_context *ctx, const springls__raw_mesh *mesh)
{
    springls__labels scale;
    int t;
    memset(&scale, 0, sizeof scale);
    springls__area_to_world(ctx, scale.area_to_world);
    for (t = 0; t < ctx->surface_triangles; t++) {
        const int *corner = mesh->triangles + 3 * (size_t)t;
        springls__surface_sums sums;
        springls__tri tri;
        tri.a = mesh->positions[corner[0]];
        tri.b = mesh->positions[corner[1]];
        tri.c = mesh->positions[corner[2]];
        sums = springls__triangle_sums(&scale, tri);
        springls__add_sums(&springls__surface_parts(ctx)[springls__part_of_vertices(ctx)[corner[0]]].sums, &sums, 1.0);
    }
}

/* Follows one line through a brick: from component *at, -1: the exterior. */
SPRINGLS__FN void springls__follow_line(const springls_context *ctx, const springls__surface_brick *brick, int row, int32_t *at)
{
    const springls__crossing *crossing = (const springls__crossing *)ctx->surface_memory[SPRINGLS__SURFACE_CROSSING].data;
    const int *rank = (const int *)ctx->surface_memory[SPRINGLS__SURFACE_RANK].data;
    const int first = brick->begin[SPRINGLS__OF_CROSSINGS][row];
    const int end = first + springls__count_of_row(brick, SPRINGLS__OF_CROSSINGS, row);
    int k;
    for (k = first; k < end; k++) {
        const int32_t p = springls__part_of_vertices(ctx)[rank[k] - 1];
        springls__surface_part *part = springls__surface_parts(ctx) + p;
        if (!part->met) {
            part->met = true;
            part->outer = *at;
            part->cavity = crossing[k].side > 0;
        }
        *at = *at == p ? part->outer : p;
    }
}

/* Returns where a brick is along an axis, behind the line of bricks that it is in, and its number. */
SPRINGLS__FN uint64_t springls__brick_key(const springls__surface_brick *brick, int axis, int number)
{
    const int b = springls__axis_after(axis), c = springls__axis_after(b);
    uint64_t key = (uint64_t)(brick->origin[c] / SPRINGLS__BRICK + 1);
    key = key << 10 | (uint64_t)(brick->origin[b] / SPRINGLS__BRICK + 1);
    key = key << 10 | (uint64_t)(brick->origin[axis] / SPRINGLS__BRICK + 1);
    return key << 32 | (uint64_t)number;
}

/* Finds what lies in what, along all lines of an axis. key: room for one a brick. */
SPRINGLS__FN void springls__follow_lines(const springls_context *ctx, int axis, uint64_t *key)
{
    const springls__surface_brick *bricks = (const springls__surface_brick *)ctx->surface_memory[SPRINGLS__SURFACE_BRICK_LIST].data;
    int32_t at[64];
    int i, row;
    for (i = 0; i < ctx->surface_bricks; i++) key[i] = springls__brick_key(&bricks[i], axis, i);
    springls__sort_keys(key, (size_t)ctx->surface_bricks);
    for (i = 0; i < ctx->surface_bricks; i++) {
        const springls__surface_brick *brick = bricks + (key[i] & 0xffffffffu);
        for (row = 0; row < 64; row++) {
            if (i == 0 || key[i] >> 42 != key[i - 1] >> 42) at[row] = -1;
            springls__follow_line(ctx, brick, 64 * axis + row, &at[row]);
        }
    }
}

/* Finds the parts of springls: those of the vertices at which they count most. Where these are of several parts it is the one with the
   fewest vertices, so that a speck has springls, which keep its id. */
SPRINGLS__FN void springls__find_springl_parts(const springls_context *ctx, const springls__raw_mesh *mesh)
{
    const int32_t *part = springls__part_of_vertices(ctx);
    springls__surface_part *parts = springls__surface_parts(ctx);
    int32_t *found = (int32_t *)ctx->surface_memory[SPRINGLS__SURFACE_SPRINGL_PART].data;
    int i;
    for (i = 0; i < ctx->model.set.count; i++) found[i] = -1;
    for (i = 0; i < ctx->surface_vertices; i++) parts[part[i]].vertices++;
    for (i = 0; i < ctx->surface_vertices; i++) {
        int32_t *of_springl;
        if (mesh->springls[i] < 0) continue;
        of_springl = found + mesh->springls[i];
        if (*of_springl < 0 || parts[part[i]].vertices < parts[*of_springl].vertices) *of_springl = part[i];
    }
}

/* Finds the parts of the mesh, which is made where the model has changed. The cell list must be fresh. */
SPRINGLS__FN springls_status springls__refresh_surface_parts(springls_context *ctx)
{
    const size_t springls = (size_t)ctx->model.set.count;
    springls__raw_mesh mesh;
    int axis, count;
    SPRINGLS__TRY(springls__refresh_surface_mesh(ctx));
    if (ctx->parts_version == ctx->surface_version) return SPRINGLS_OK;
    ctx->parts_version = 0;
    springls__use_surface_mesh(ctx, &mesh);
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_VERTEX_PART, (size_t)ctx->surface_vertices, sizeof(int32_t)));
    count = springls__number_parts(ctx, &mesh);
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_PARTS, (size_t)count, sizeof(springls__surface_part)));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_SPRINGL_PART, springls, sizeof(int32_t)));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_HASH, (size_t)ctx->surface_bricks, sizeof(uint64_t)));
    memset(springls__surface_parts(ctx), 0, (size_t)count * sizeof(springls__surface_part));
    springls__measure_parts(ctx, &mesh);
    for (axis = 0; axis < 3; axis++)
        springls__follow_lines(ctx, axis, (uint64_t *)ctx->surface_memory[SPRINGLS__SURFACE_HASH].data);
    springls__find_springl_parts(ctx, &mesh);
    ctx->part_count = count;
    ctx->parts_version = ctx->surface_version;
    return SPRINGLS_OK;
}

/* ---- components ---- */

/* Copies to the host what the mesh of springls is made of, and builds the cell list. */
SPRINGLS__FN springls_status springls__surface_parts_to_host(springls_context *ctx)
{
    SPRINGLS__TRY(springls__use_host_calmly(ctx, false));
    return springls__cell_list_build(ctx);
}

/* Finds and measures the components that parts bound: component i is that of part i. A body's volume is without its cavities, a
   cavity's without the bodies in it. */
SPRINGLS__FN void springls__measure_part_components(const springls_context *ctx, springls__current_component *item)
{
    const springls__surface_part *parts = springls__surface_parts(ctx);
    int i;
    memset(item, 0, (size_t)ctx->part_count * sizeof *item);
    for (i = 0; i < ctx->part_count; i++) {
        const int32_t outer = parts[i].outer;
        item[i].cavity = parts[i].cavity;
        item[i].deepest = i;
        springls__add_sums(&item[i].surface, &parts[i].sums, parts[i].cavity ? -1.0 : 1.0);
        if (outer >= 0) springls__add_sums(&item[outer].surface, &parts[i].sums, parts[outer].cavity ? -1.0 : 1.0);
    }
}

/* Returns the part with vertices at which a springl counts most; -1: none. */
SPRINGLS__FN int32_t springls__own_part(const springls_context *ctx, int i)
{
    return ((const int32_t *)ctx->surface_memory[SPRINGLS__SURFACE_SPRINGL_PART].data)[i];
}

/* Returns the part of a springl: its own or, without one, the part of the nearest springl that faces the same way; -1: none. */
SPRINGLS__FN int32_t springls__part_of_springl(const springls_context *ctx, int i)
{
    const springls__springl *s = ctx->model.set.s;
    const float radius = 2.5f; /* voxels */
    const springls__v3 n = springls__springl_normal(s[i]);
    springls__cell_walk walk;
    float best = radius * radius;
    int32_t found = springls__own_part(ctx, i);
    int other;
    if (found >= 0) return found;
    walk = springls__cell_walk_near(&ctx->model, s[i].p, radius);
    while ((other = springls__cell_walk_next(&ctx->model, &walk)) >= 0) {
        const float d2 = springls__length2(springls__sub(s[other].p, s[i].p));
        if (springls__own_part(ctx, other) < 0 || d2 >= best) continue;
        if (springls__dot(n, springls__springl_normal(s[other])) <= 0.0f) continue;
        best = d2;
        found = springls__own_part(ctx, other);
    }
    return found;
}

/* Finds and measures the components of what springls hold. */
SPRINGLS__FN springls_status springls__find_part_components(springls_context *ctx, springls__labels *l)
{
    SPRINGLS__TRY(springls__surface_parts_to_host(ctx));
    SPRINGLS__TRY(springls__refresh_surface_parts(ctx));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, current_components, ctx->part_count + 1));
    memset(l, 0, sizeof *l);
    l->item = springls__current_components(&ctx->model);
    l->count = ctx->part_count;
    springls__measure_part_components(ctx, l->item);
    return SPRINGLS_OK;
}

/* The voxel that stands for the number of a component where voxels show none: a snapshot has a voxel for each (components.h). */
SPRINGLS__FN void springls__voxel_of_number(const springls__grid *g, int number, int32_t voxel[3])
{
    voxel[0] = number % g->size[0];
    voxel[1] = number / g->size[0] % g->size[1];
    voxel[2] = springls__imin(number / g->size[0] / g->size[1], g->size[2] - 1);
}

SPRINGLS__FN int springls__number_of_voxel(const springls__grid *g, const int32_t voxel[3])
{
    return voxel[0] + g->size[0] * (voxel[1] + g->size[1] * voxel[2]);
}

#endif
