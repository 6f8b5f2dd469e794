/* remodel.h - changes a whole model in one call: offset, smooth, remesh. */
#ifndef SPRINGLS__TOOLS_REMODEL_H
#define SPRINGLS__TOOLS_REMODEL_H

#include "../runtime/finite.h"
#include "../../kernels_embed/stages/contract.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/resumable.h"
#include "../model/bvh.h"
#include "../model/closest_point.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "../model/host_access.h"
#include "../model/mesh_distance.h"
#include "../model/winding_number.h"
#include "../stages/contract.h"
#include "../stages/inherit.h"
#include "../stages/project.h"
#include "../stages/relax.h"
#include "../stages/resample.h"
#include "../solver/step.h"
#include "../input/set_level_set.h"
#include "../output/isosurface.h"
#include "../output/measure.h"
#include "combine.h"

/* ---- offset ---- */

/* Defines the new surface by the signed distance to the old one less the offset. The old surface is the zero level, and the
   springls at its sharp edges, where marching cubes cut corners off. All in model coordinates (springl_surface.h), which are voxels
   if the spacing is uniform. */
typedef struct springls__parallel_surface {
    const springls_context *ctx;
    springls__mesh_distance distance; /* to zero_level */
    springls__surface zero_level, edges;
    float offset;
} springls__parallel_surface;

/* Converts a place from voxels for a surface that is offset. */
SPRINGLS__FN springls__v3 springls__to_offset(const springls_context *ctx, springls__v3 x)
{
    return springls__is_uniform(ctx->model.grid.metric) ? x : springls__voxel_to_model(ctx, x);
}

/* Computes the signed distance to the new surface (a springls__distance_fn): in voxels, or a lower bound if the spacing is not
   uniform. */
SPRINGLS__FN void springls__parallel_distance(void *arg, const springls__v3 *points, int count, float *out)
{
    springls__parallel_surface *job = (springls__parallel_surface *)arg;
    const float scale = job->ctx->smallest_spacing / job->ctx->largest_spacing;
    springls__v3 at[SPRINGLS__BRICK_VOXELS];
    int i;
    memcpy(at, points, (size_t)count * sizeof *at);
    for (i = 0; i < count; i++) at[i] = springls__to_offset(job->ctx, at[i]);
    springls__mesh_signed_distance(&job->distance, at, count, out);
    for (i = 0; i < count; i++) {
        springls__surface_hit edge = springls__surface_closest(&job->edges, at[i], springls__fabs(out[i]));
        if (edge.triangle >= 0) out[i] = out[i] < 0.0f ? -springls__sqrt(edge.hit.d2) : springls__sqrt(edge.hit.d2);
        out[i] -= job->offset;
        if (!springls__is_uniform(job->ctx->model.grid.metric)) out[i] *= scale;
    }
}

/* Builds the surface of the springls at sharp edges. */
SPRINGLS__FN springls_status springls__edge_surface(springls_context *ctx, springls__surface *surface)
{
    int i, m, count = 0;
    SPRINGLS__TRY(springls__surface_reserve(ctx, surface, springls__imin(ctx->model.set.at_edges, ctx->model.set.count)));
    for (i = 0; i < ctx->model.set.count && count < ctx->model.set.at_edges; i++) {
        if (!springls__at_edge(&ctx->model, i)) continue;
        for (m = 0; m < 3; m++) surface->points[3 * count + m] = springls__to_offset(ctx, ctx->model.set.s[i].q[m]);
        count++;
    }
    return springls__surface_finish(ctx, surface, count);
}

/* Builds the surface of the welded zero level, with each triangle cut into four by the middles of its edges. The middles are
   moved onto the zero level, which reduces the distance of flat triangles from a curved surface. */
SPRINGLS__FN springls_status springls__zero_level_surface(springls_context *ctx, springls__surface *surface)
{
    static const int corner[12] = { 0, 3, 5, 3, 1, 4, 5, 4, 2, 3, 4, 5 }; /* 3 + k: the middle of corners k and k + 1 */
    const bool mirrored = !springls__is_uniform(ctx->model.grid.metric) && springls__is_mirrored(ctx); /* turns triangles round */
    springls__raw_mesh raw;
    int t, k;
    SPRINGLS__TRY(springls__isosurface(ctx, &raw));
    if (raw.triangle_count > INT32_MAX / 12) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "offset: too many triangles");
    SPRINGLS__TRY(springls__surface_reserve(ctx, surface, 4 * raw.triangle_count));
    for (t = 0; t < raw.triangle_count; t++) {
        springls__v3 x[6];
        for (k = 0; k < 3; k++) x[k] = raw.positions[raw.triangles[3 * t + k]];
        for (k = 0; k < 3; k++) { /* from the lower index, so that both triangles of an edge have the same middle */
            int a = raw.triangles[3 * t + k], b = raw.triangles[3 * t + (k + 1) % 3];
            x[3 + k] = springls__lerp(raw.positions[springls__imin(a, b)], raw.positions[springls__imax(a, b)], 0.5f);
            x[3 + k] = springls__to_zero_level(&ctx->model.grid, x[3 + k]);
        }
        for (k = 0; k < 12; k++) surface->points[12 * t + k] = springls__to_offset(ctx, x[corner[mirrored ? 11 - k : k]]);
    }
    SPRINGLS__TRY(springls__surface_finish(ctx, surface, 4 * raw.triangle_count));
    return springls__surface_make_dipoles(ctx, surface);
}

/* Moves every springl by the offset along the gradient of phi; along its own normal at a sharp edge, or where they disagree. Along the
   normals of the world, by smallest spacings. */
SPRINGLS__FN void springls__offset_springls(springls_context *ctx, float offset)
{
    const springls__grid *g = &ctx->model.grid;
    int i, m;
    for (i = 0; i < ctx->model.set.count; i++) {
        springls__springl *s = &ctx->model.set.s[i];
        springls__v3 own = springls__springl_normal(*s), n = own;
        for (m = 0; m < 4; m++) {
            springls__v3 *x = m < 3 ? &s->q[m] : &s->p;
            if (!springls__at_edge(&ctx->model, i)) n = springls__normalize(springls__grid_gradient(g, g->phi, *x));
            if (springls__dot(n, own) < 0.5f) n = own;
            *x = springls__mad(*x, springls__along_normal(g->metric, n), offset);
        }
        *s = springls__springl_finished(*s);
    }
    springls__constellation_changed(ctx);
}

/* Keeps the springls that are near the new zero level, and moves them onto it; removes the others, which are behind the new
   surface of another part. */
SPRINGLS__FN springls_status springls__offset_remove(springls_context *ctx)
{
    const springls__grid *g = &ctx->model.grid;
    const float close = 0.15f; /* voxels */
    int i, m, count = ctx->model.set.count;
    uint8_t *action;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, contract_action, count));
    action = springls__contract_action(&ctx->model);
    for (i = 0; i < count; i++) {
        springls__springl *s = &ctx->model.set.s[i];
        springls__v3 moved;
        action[i] = springls__fabs(springls__phi_or_beyond(g, s->p)) < close ? SPRINGLS__KEEP : SPRINGLS__REMOVE;
        if (action[i] == SPRINGLS__REMOVE) continue;
        moved = springls__sub(springls__to_zero_level(g, s->p), s->p);
        s->p = springls__add(s->p, moved);
        for (m = 0; m < 3; m++) s->q[m] = springls__add(s->q[m], moved);
        *s = springls__springl_finished(*s);
    }
    SPRINGLS__TRY(springls__attributes_before_removal(ctx));
    SPRINGLS__TRY(springls__constellation_compact(ctx));
    springls__attributes_after_removal(ctx, count);
    ctx->stats.removed += count - ctx->model.set.count;
    return SPRINGLS_OK;
}

/* Runs resample until no springl is too large, at most 40 times. */
SPRINGLS__FN springls_status springls__split_all(springls_context *ctx)
{
    const int max_passes = 40;
    int i, before = -1;
    SPRINGLS__TRY(springls__run_table(ctx, springls__contract_now));
    for (i = 0; i < max_passes && before != ctx->model.set.count; i++) {
        before = ctx->model.set.count;
        SPRINGLS__TRY(springls__run_table(ctx, springls__resample));
    }
    return SPRINGLS_OK;
}

/* Does the work of springls_offset. On failure the model is left unfinished. */
SPRINGLS__FN springls_status springls__offset(springls_context *ctx, springls__parallel_surface *job)
{
    const float stretch = ctx->largest_spacing / ctx->smallest_spacing, size = springls__fabs(job->offset);
    SPRINGLS__TRY(springls__zero_level_surface(ctx, &job->zero_level));
    SPRINGLS__TRY(springls__edge_surface(ctx, &job->edges));
    if (job->zero_level.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "offset: there is no surface");
    springls__offset_springls(ctx, job->offset);
    job->distance.surface = job->distance.nearest = &job->zero_level;
    job->distance.balanced = true;
    job->distance.band = (ctx->model.params.band_half_width + 1.0f) * stretch + 8.0f * (stretch - 1.0f) + size;
    springls__grid_clear(ctx, &ctx->model.grid);
    SPRINGLS__TRY(springls__set_from_distance(ctx, springls__parallel_distance, job,
                                              springls__is_uniform(ctx->model.grid.metric) ? &job->zero_level : NULL, 64.0f + size));
    SPRINGLS__TRY(springls__redistance_in_voxels(ctx));
    if (!springls__has_inside(&ctx->model.grid)) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "offset: nothing is left");
    SPRINGLS__TRY(springls__offset_remove(ctx));
    SPRINGLS__TRY(springls__split_all(ctx));
    return springls__run_completion(ctx, springls__complete); /* phi is exact already */
}

SPRINGLS__TOOLS_API springls_status springls_offset(springls_context *ctx, float distance)
{
    springls__parallel_surface job;
    springls_status status;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    memset(&job, 0, sizeof job);
    job.ctx = ctx;
    job.offset = distance / ctx->smallest_spacing;
    if (!springls__finite_float(job.offset) || springls__fabs(job.offset) >= 1e4f)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "offset: a distance of %g voxels, not between -10^4 and 10^4",
                              (double)job.offset);
    if (ctx->model.set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "offset: there are no springls");
    if (job.offset == 0.0f) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__follow_all(ctx));
    SPRINGLS__TRY(springls__use_host(ctx, true));
    status = springls__offset(ctx, &job);
    springls__surface_free(ctx, &job.zero_level);
    springls__surface_free(ctx, &job.edges);
    return springls__clear_on_failure(ctx, status);
}

/* ---- smooth ---- */

/* Returns how far along tangents curvature is measured in the next step, smallest spacings: the further the smoother the surface is, so
   that steps may be longer. It is limited by the smallest radius of curvature, and by how far beside the surface phi is a distance: a voxel
   from it phi is 0.02 too large. Radii so small that they should have vanished by now are errors of single springls, and do not shorten
   steps. */
SPRINGLS__FN float springls__smoothing_span(float largest_curvature, float elapsed, float last)
{
    float radius = 1.0f / springls__max(largest_curvature, 1e-3f);
    float span = springls__min(radius, springls__sqrt(1.5f * radius));
    span = springls__min(springls__max(span, 0.15f * springls__sqrt(elapsed)), 1.4f * last);
    return springls__max(span, SPRINGLS__CURVATURE_SPAN);
}

/* The area when it was last measured, and that time, voxel^2. */
typedef struct springls__smooth_rest { double area; float measured_at; } springls__smooth_rest;

/* Finds whether the area has become steady, as that of balls is. Measures it only when 1.5 times the time has passed. */
SPRINGLS__FN springls_status springls__smooth_at_rest(springls_context *ctx, springls__smooth_rest *rest, float elapsed,
                                                      bool *at_rest)
{
    springls_measures measures;
    *at_rest = false;
    if (elapsed < 1.5f * rest->measured_at) return SPRINGLS_OK;
    SPRINGLS__TRY(springls_measure(ctx, &measures));
    *at_rest = measures.area > 0.999 * rest->area;
    rest->area = measures.area;
    rest->measured_at = elapsed;
    return SPRINGLS_OK;
}

/* Runs motion by curvature for a time, voxel^2, in steps as long as their spans permit. With volumes that are kept it ends early
   when the model is at rest. */
SPRINGLS__FN springls_status springls__smooth(springls_context *ctx, float duration, bool keep_volume)
{
    springls_forces forces;
    springls_step_desc step;
    springls__smooth_rest rest = { DBL_MAX, 4.0f };
    float left = duration, curvature = 0.0f;
    bool at_rest = false;
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    forces.voxel_units = true;
    forces.curvature_weight = 1.0f;
    step.forces = &forces;
    step.mode = SPRINGLS_MODE_FLUID;
    step.max_displacement = -1.0f; /* dt is short enough */
    ctx->curvature_span = SPRINGLS__CURVATURE_SPAN;
    while (left > 0.0f && !at_rest) {
        SPRINGLS__TRY(springls__max_speed(ctx, "smooth", &forces, 0.0f, &curvature));
        curvature *= ctx->largest_spacing / ctx->smallest_spacing; /* a speed is of voxels, which may be long ones */
        ctx->curvature_span = springls__smoothing_span(curvature, duration - left, ctx->curvature_span);
        step.dt = 0.125f * ctx->curvature_span * ctx->curvature_span; /* half of the way to the mean of the ring: stable */
        step.dt = left / (springls__floor(left / step.dt) + 1.0f);
        SPRINGLS__TRY(springls_step(ctx, &step));
        left = left > 1.5f * step.dt ? left - step.dt : 0.0f;
        if (keep_volume) SPRINGLS__TRY(springls__smooth_at_rest(ctx, &rest, duration - left, &at_rest));
        if (springls__cancelled(ctx, 1.0f - left / duration))
            return springls__fail(ctx, SPRINGLS_CANCELLED, "smooth: cancelled with %g voxel^2 left", (double)left);
    }
    SPRINGLS__TRY(springls__run_table(ctx, springls__contract_now)); /* removes springls of what phi has lost since */
    return ctx->model.set.count > 0 ? SPRINGLS_OK : springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "smooth: nothing is left");
}

SPRINGLS__TOOLS_API springls_status springls_smooth(springls_context *ctx, float length, bool keep_volume)
{
    springls_params params;
    springls_status status;
    float voxels;
    double time;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    voxels = length / ctx->smallest_spacing;
    if (!springls__finite_float(voxels) || voxels < 0.0f || voxels >= 1e3f)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "smooth: a length of %g voxels, not from 0 to below 1000",
                              (double)voxels);
    if (voxels == 0.0f) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__follow_all(ctx));
    params = ctx->model.params;
    time = ctx->time;
    if (!params.volume_lock) springls__clear_target_volumes(ctx); /* the volumes locked by an earlier call may have changed */
    ctx->model.params.keep_edges = ctx->model.params.keep_thin = 0;
    ctx->model.params.curvature = 0.0f;
    ctx->model.params.volume_lock = keep_volume;
    status = springls__smooth(ctx, 0.25f * voxels * voxels, keep_volume); /* dr/dt = -2/r ends at r^2/4 */
    ctx->curvature_span = 0.0f;
    ctx->model.params.keep_edges = params.keep_edges;
    ctx->model.params.keep_thin = params.keep_thin;
    ctx->model.params.curvature = params.curvature;
    ctx->model.params.volume_lock = params.volume_lock;
    if (!springls__components_enabled(ctx)) springls__clear_components(ctx);
    ctx->time = time;
    return status;
}

/* ---- remesh ---- */

/* Contracts, so that a dense mesh becomes a few springls before all else. Then repeats split, relax, contract and fill until their
   number stays the same, at most four times. Keeps phi, which is the surface that the springls sample: a projection would round it
   off. */
SPRINGLS__FN springls_status springls__remesh(springls_context *ctx)
{
    const int max_passes = 4;
    int i, before = -1;
    SPRINGLS__TRY(springls__run_table(ctx, springls__contract_now));
    for (i = 0; i < max_passes && before != ctx->model.set.count; i++) {
        before = ctx->model.set.count;
        SPRINGLS__TRY(springls__split_all(ctx));
        SPRINGLS__TRY(springls__run_table(ctx, springls__relax));
        SPRINGLS__TRY(springls__run_table(ctx, springls__contract_now));
        SPRINGLS__TRY(springls__run_completion(ctx, springls__fill_every_gap));
    }
    springls__mark_phi_synced(ctx);
    return SPRINGLS_OK;
}

SPRINGLS__TOOLS_API springls_status springls_remesh(springls_context *ctx)
{
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (ctx->model.set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "remesh: there are no springls");
    SPRINGLS__TRY(springls__follow_all(ctx));
    SPRINGLS__TRY(springls__use_host(ctx, true));
    return springls__remesh(ctx);
}

#endif
