/* set_mesh.h - builds the springls and the level set from an indexed triangle mesh.

   The sign of phi comes from the generalized winding number w, for clean and for damaged meshes alike. An edge is balanced
   when as many triangles run along it in one direction as in the other.
     Every edge balanced: w is a whole number that changes only at the surface. Two overlapping balls free of surface lie on
     one side, so most voxels take the sign of a neighbor and w is computed for few.
     Some edge unbalanced: the surface is open. The level w = 1/2 closes its holes like a soap film, and phi is the distance
     to the triangles times |1 - 2 w|, then re-distanced: its zero level is the triangles and the film together. The holes
     are filled with springls here, because the first fill_gaps would give them correspondences at the rims.

   Bad input leaves the model unchanged; when memory runs out, or nothing is inside, the model is empty. */
#ifndef SPRINGLS__INPUT_SET_MESH_H
#define SPRINGLS__INPUT_SET_MESH_H

#include "../runtime/errors.h"
#include "../runtime/resumable.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "../model/mesh_distance.h"
#include "../model/winding_number.h"
#include "../stages/fill_gaps.h"
#include "../stages/keep_edges.h"
#include "../stages/project.h"
#include "../stages/rebuild.h"
#include "../stages/sleep.h"
#include "../stages/surface_table.h"
#include "mesh_intake.h"
#include "mesh_parts.h"
#include "set_level_set.h"
#include "thin_input.h"

/* Logs what was repaired. repaired: the triangles' orientation was. */
SPRINGLS__FN void springls__mesh_log(const springls_context *ctx, const springls_mesh_report *r, bool repaired)
{
    if (!r->closed)
        springls__log(ctx, 2, "mesh not closed (%d boundary, %d non-manifold, %d misoriented edges): inside is where the "
                      "winding number exceeds one half; %d triangles dropped%s", r->boundary_edges,
                      r->nonmanifold_edges, r->misoriented_edges, r->triangles_dropped, repaired ? ", orientation repaired" : "");
    else if (r->flipped || r->triangles_dropped)
        springls__log(ctx, 2, "mesh%s, %d triangles dropped", r->flipped ? " was inside out and has been turned"
                      : " is closed", r->triangles_dropped);
    if (r->parts_turned && !r->flipped) springls__log(ctx, 2, "%d parts of the mesh were inside out and have been turned", r->parts_turned);
}

/* Removes the triangles without an area from the list, which may be empty then. */
SPRINGLS__FN void springls__mesh_drop_flat(springls__mesh_intake *m)
{
    int t, k, n = 0;
    for (t = 0; t < m->count; t++) {
        if (!(springls__mesh_double_area(m, t) > 1e-10)) continue; /* the limit of springls__tri_closest */
        for (k = 0; k < 3; k++) m->corner[3 * n + k] = m->corner[3 * t + k];
        m->triangle[n] = m->triangle[t];
        m->turn[n++] = m->turn[t];
    }
    m->count = n;
}

/* Sets the original surface to the listed triangles. In a mirrored world all are turned once more. */
SPRINGLS__FN springls_status springls__mesh_make_original(springls_context *ctx, springls__mesh_intake *m)
{
    const uint8_t mirrored = springls__is_mirrored(ctx);
    int t;
    SPRINGLS__TRY(springls__surface_reserve(ctx, &ctx->original, m->count));
    for (t = 0; t < m->count; t++) {
        m->turn[t] ^= mirrored;
        springls__mesh_corners(m, t, ctx->original.points + 3 * t);
    }
    SPRINGLS__TRY(springls__surface_finish(ctx, &ctx->original, m->count));
    return springls__surface_make_dipoles(ctx, &ctx->original);
}

/* Returns whether some place is inside: only places right behind triangles have to be tried. Behind a flat patch the winding
   number is one half, and between two sheets that lie on each other it is 0. */
SPRINGLS__FN bool springls__surface_has_inside(const springls__surface *surface)
{
    const float depth = 1e-3f, share = 0.01f, more_than_flat = 0.51f; /* voxel; of a triangle's size; winding number */
    int i;
    for (i = 0; i < surface->count; i++) {
        springls__tri t = springls__surface_triangle(surface, i);
        float size = springls__sqrt(springls__length(springls__tri_area2(t)));
        springls__v3 x = springls__mad(springls__tri_centroid(t), springls__tri_normal(t), -springls__min(depth, share * size));
        if (springls__surface_winding(surface, x, 2.5f) > more_than_flat) return true;
    }
    return false;
}

/* Appends the springls of the listed triangles, which are the original surface's, in their order. */
SPRINGLS__FN springls_status springls__mesh_append_springls(springls_context *ctx, springls__mesh_intake *m)
{
    SPRINGLS__TRY(springls__constellation_reserve(ctx, m->count));
    SPRINGLS__TRY(springls__append_input(ctx, m));
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

/* Returns true when a springl lies inside the solid. corners: they must too, so that no seam cuts it. */
SPRINGLS__FN bool springls__springl_in_solid(const springls__surface *surface, springls__springl s, bool corners)
{
    const float largest = 3.0f, to_corner = 0.97f; /* voxels; share of the way */
    const springls__v3 n = springls__springl_normal(s);
    int m;
    if (springls__longest_edge2(springls__springl_tri(s)) > largest * largest) return false;
    if (!springls__both_sides_inside(surface, s.p, n)) return false;
    for (m = 0; corners && m < 3; m++)
        if (!springls__both_sides_inside(surface, springls__lerp(s.p, s.q[m], to_corner), n)) return false;
    return true;
}

typedef struct springls__in_solid_job { springls_context *ctx; bool corners; } springls__in_solid_job;

SPRINGLS__FN void springls__in_solid_task(void *arg, int begin, int end)
{
    const springls__in_solid_job *job = (const springls__in_solid_job *)arg;
    springls__model *model = &job->ctx->model;
    for (; begin < end; begin++)
        springls__contract_action(model)[begin] =
            springls__springl_in_solid(&job->ctx->original, model->set.s[begin], job->corners) ? SPRINGLS__REMOVE
                                                                                              : SPRINGLS__KEEP;
}

/* Removes the springls inside the solid, as where closed parts of a mesh overlap: they bound nothing. corners: only those that no
   seam cuts. */
SPRINGLS__FN springls_status springls__mesh_drop_inner(springls_context *ctx, bool corners)
{
    const int count = ctx->model.set.count;
    springls__in_solid_job job;
    job.ctx = ctx;
    job.corners = corners;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, contract_action, count));
    springls__parallel(ctx, count, 64, springls__in_solid_task, &job);
    SPRINGLS__TRY(springls__constellation_compact(ctx));
    if (ctx->model.set.count == count) return SPRINGLS_OK;
    springls__constellation_changed(ctx);
    springls__log(ctx, 2, "the mesh overlaps itself: %d springls inside of it are not set", count - ctx->model.set.count);
    return SPRINGLS_OK;
}

/* Fills phi. outer: an empty surface for what bounds a mesh that overlaps itself. */
SPRINGLS__FN springls_status springls__mesh_fill_grid(springls_context *ctx, bool balanced, bool overlaps,
                                                      springls__surface *outer)
{
    springls__mesh_distance distance;
    distance.surface = distance.nearest = &ctx->original;
    distance.balanced = balanced;
    distance.band = ctx->model.params.band_half_width + 1.0f;
    if (overlaps) {
        SPRINGLS__TRY(springls__surface_build(ctx, outer, ctx->model.set.s, ctx->model.set.count));
        distance.nearest = outer;
    }
    return springls__set_from_distance(ctx, springls__mesh_signed_distance, &distance, &ctx->original, 64.0f);
}

/* Makes the springls and the level set from the original surface. may_overlap: the mesh is balanced, and may overlap itself. */
SPRINGLS__FN springls_status springls__mesh_make_model(springls_context *ctx, springls__mesh_intake *m, bool balanced,
                                                       bool may_overlap)
{
    springls__surface outer;
    springls_status status;
    bool overlaps;
    int count;
    memset(&outer, 0, sizeof outer);
    SPRINGLS__TRY(springls__mesh_append_springls(ctx, m));
    count = ctx->model.set.count;
    if (may_overlap) SPRINGLS__TRY(springls__mesh_drop_inner(ctx, true));
    overlaps = ctx->model.set.count < count;
    status = springls__mesh_fill_grid(ctx, balanced, overlaps, &outer);
    springls__surface_free(ctx, &outer);
    SPRINGLS__TRY(status);
    return overlaps ? springls__mesh_drop_inner(ctx, false) : SPRINGLS_OK;
}

/* Stores for each triangle of the original surface its number in the caller's mesh, times 2, plus 1 if it was turned. */
SPRINGLS__FN springls_status springls__mesh_store_sources(springls_context *ctx, const springls__mesh_intake *m, int given)
{
    int t;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->original.source_memory, (size_t)m->count, sizeof(int), 0));
    ctx->original.source = (int *)ctx->original.source_memory.data;
    ctx->original.given = given;
    for (t = 0; t < m->count; t++) ctx->original.source[t] = 2 * m->triangle[t] + m->turn[t];
    return SPRINGLS_OK;
}

/* Covers the film that closes the holes of an open mesh with springls. */
SPRINGLS__FN springls_status springls__mesh_fill_holes(springls_context *ctx)
{
    SPRINGLS__TRY(springls__find_exposed(ctx, ctx->model.params.d_max, ctx->model.params.d_max));
    springls__finish_loop(ctx);
    SPRINGLS__TRY(springls__fill_exposed(ctx));
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__mesh_no_inside(springls_context *ctx)
{
    return springls__fail(ctx, SPRINGLS_BAD_MESH, "the mesh has no inside: it is flat, its triangles lie on each other, or it is "
                          "smaller than a voxel or than min_component");
}

/* Fails if the mesh has no inside: no voxel's centre is, and springls do not show any either, as they do of thin plates. */
SPRINGLS__FN springls_status springls__mesh_find_inside(springls_context *ctx)
{
    if (springls__has_inside(&ctx->model.grid)) return SPRINGLS_OK;
    if (ctx->model.params.contouring == SPRINGLS_CONTOURING_LEVEL_SET) return springls__mesh_no_inside(ctx);
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    SPRINGLS__TRY(springls__refresh_surface_mesh(ctx));
    if (ctx->surface_triangles == 0) return springls__mesh_no_inside(ctx);
    springls__forget_surface(ctx); /* edges are still to be found */
    return SPRINGLS_OK;
}

/* Replaces the model by the listed triangles. given: triangles in the caller's mesh; balanced: every edge is. On failure the model is
   left unfinished. */
SPRINGLS__FN springls_status springls__mesh_replace_model(springls_context *ctx, springls__mesh_intake *m, int given,
                                                          bool balanced, bool may_overlap)
{
    springls__clear_model(ctx);
    SPRINGLS__TRY(springls__mesh_make_original(ctx, m));
    if (!springls__surface_has_inside(&ctx->original)) return springls__mesh_no_inside(ctx);
    SPRINGLS__TRY(springls__mesh_make_model(ctx, m, balanced, balanced && may_overlap));
    if (!balanced) SPRINGLS__TRY(springls__run_table(ctx, springls__rebuild));
    SPRINGLS__TRY(springls__run_table(ctx, springls__tidy));
    SPRINGLS__TRY(springls__mesh_find_inside(ctx));
    if (ctx->model.params.keep_edges) SPRINGLS__TRY(springls__run_table(ctx, springls__find_edges));
    SPRINGLS__TRY(springls__make_reference(ctx));
    SPRINGLS__TRY(springls__mesh_store_sources(ctx, m, given));
    if (!balanced) return springls__mesh_fill_holes(ctx);
    springls__rest_all(ctx);
    return SPRINGLS_OK;
}

/* Compares the mesh's bounds with the grid's, in voxels. Fails when they do not meet. *beyond: a part lies outside. */
SPRINGLS__FN springls_status springls__mesh_check_bounds(springls_context *ctx, const float lower[3], const float upper[3],
                                                         bool *beyond)
{
    bool outside = false;
    int k;
    *beyond = false;
    for (k = 0; k < 3; k++) {
        float last = (float)ctx->desc.grid.size[k] - 0.5f;
        *beyond = *beyond || lower[k] < -0.5f || upper[k] > last;
        outside = outside || upper[k] < -0.5f || lower[k] > last;
    }
    if (outside) return springls__fail(ctx, SPRINGLS_BAD_MESH, "the mesh lies outside the grid: voxels (%g %g %g) to (%g %g %g)",
                                       (double)lower[0], (double)lower[1], (double)lower[2], (double)upper[0],
                                       (double)upper[1], (double)upper[2]);
    return SPRINGLS_OK;
}

/* Writes the report's counts of edges and components. Overwrites m->weld. */
SPRINGLS__FN void springls__mesh_report_topology(springls__mesh_intake *m, springls_mesh_report *report)
{
    int e;
    for (e = 0; e < m->edge_count; e++) {
        const springls__mesh_edge *edge = &m->edges[e];
        report->boundary_edges += edge->count == 1;
        report->nonmanifold_edges += edge->count > 2;
        report->misoriented_edges += edge->count == 2 && springls__mesh_direction(m, edge->half[0])
                                                             == springls__mesh_direction(m, edge->half[1]);
    }
    report->closed = !report->boundary_edges && !report->nonmanifold_edges && !report->misoriented_edges;
    report->used_winding = !report->closed;
    report->components = springls__mesh_components(m);
}

/* Does the work of springls_set_mesh on arguments that have been checked and a report of zeros. */
SPRINGLS__FN springls_status springls__mesh_take(springls_context *ctx, springls__mesh_intake *m, const float *positions,
                                                 int position_count, size_t stride, const int *triangles, int triangle_count,
                                                 springls_mesh_report *report)
{
    float lower[3], upper[3];
    double center[3];
    bool beyond;
    int unbalanced;
    springls_status status;
    SPRINGLS__TRY(springls__mesh_intake_reserve(ctx, m, position_count, triangle_count));
    SPRINGLS__TRY(springls__mesh_weld(ctx, m, positions, position_count, stride, triangles, triangle_count, lower, upper));
    springls__mesh_list_triangles(m, triangles, triangle_count);
    SPRINGLS__TRY(springls__mesh_check_bounds(ctx, lower, upper, &beyond));
    springls__mesh_drop_repeated(m);
    springls__mesh_edges(m);
    springls__mesh_report_topology(m, report);
    report->area = springls__mesh_area(m, positions, stride, center);
    report->volume = springls__mesh_volume(m, positions, stride, center);
    SPRINGLS__TRY(springls__mesh_face_outwards(ctx, m, springls__is_mirrored(ctx), report));
    unbalanced = springls__mesh_balance(m);
    springls__mesh_drop_flat(m);
    report->triangles_dropped = triangle_count - m->count;
    if (!m->count) return springls__fail(ctx, SPRINGLS_BAD_MESH, "no triangle of %d has an area", triangle_count);
    status = springls__mesh_replace_model(ctx, m, triangle_count, unbalanced == 0,
                                          report->components > 1 || report->nonmanifold_edges > 0);
    SPRINGLS__TRY(springls__clear_on_failure(ctx, status));
    report->springls = ctx->model.set.count;
    springls__mesh_log(ctx, report, !unbalanced && report->misoriented_edges);
    if (beyond) springls__log(ctx, 2, "the mesh reaches beyond the grid: its level set ends at the grid's border");
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_set_mesh(springls_context *ctx, const float *positions, int position_count,
                                               size_t stride, const int *triangles, int triangle_count,
                                               springls_mesh_report *report)
{
    springls__mesh_intake intake;
    springls_mesh_report own;
    springls_status status;
    if (!report) report = &own;
    memset(report, 0, sizeof *report);
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (stride == 0) stride = 3 * sizeof(float);
    if (position_count < 0 || triangle_count < 0 || triangle_count > INT32_MAX / 6)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_mesh: %d positions and %d triangles: there may be 0 to %d, and 0 to %d",
                              position_count, triangle_count, INT32_MAX, INT32_MAX / 6);
    if (stride < 3 * sizeof(float) || stride % sizeof(float))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_mesh: a stride of %lu bytes, not 0 or a multiple of 4 from 12 on",
                              (unsigned long)stride);
    if ((!positions && position_count) || (!triangles && triangle_count))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_mesh: NULL array");
    if (!triangle_count) return springls__fail(ctx, SPRINGLS_BAD_MESH, "the mesh has no triangles");
    memset(&intake, 0, sizeof intake);
    status = springls__mesh_take(ctx, &intake, positions, position_count, stride, triangles, triangle_count, report);
    springls__mesh_intake_free(ctx, &intake);
    return status;
}

#endif
