/* component_views.h - shows components, their events, and the component of any place. */
#ifndef SPRINGLS__OUTPUT_COMPONENT_VIEWS_H
#define SPRINGLS__OUTPUT_COMPONENT_VIEWS_H

#include "../runtime/errors.h"
#include "../model/host_access.h"
#include "../model/transform.h"
#include "../solver/step.h"
#include "../stages/events.h"
#include "query.h"

/* Completes a step in progress, and finds the components of a model that has changed since: the next call that changes it would do the
   same first. */
SPRINGLS__FN springls_status springls__refresh_components(springls_context *ctx, const char *call)
{
    if (!springls__components_enabled(ctx))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: params.components is 0", call);
    SPRINGLS__TRY(springls__begin_reading(ctx));
    return springls__update_outdated_components(ctx);
}

SPRINGLS__EVENTS_API springls_status springls_components(springls_context *ctx, const springls_component **components, int *count)
{
    int i;
    springls_component *shown;
    if (components) *components = NULL;
    if (count) *count = 0;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!components || !count)
        return springls__fail_null(ctx, "components", components ? "count" : "components");
    SPRINGLS__TRY(springls__refresh_components(ctx, "components"));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->next_component_memory, (size_t)ctx->component_count + 1,
                                        sizeof(springls__component), 0));
    shown = (springls_component *)ctx->next_component_memory.data;
    for (i = 0; i < ctx->component_count; i++) memcpy(&shown[i], &springls__component_list(ctx)[i].view, sizeof *shown);
    *components = shown;
    *count = ctx->component_count;
    return SPRINGLS_OK;
}

SPRINGLS__EVENTS_API const uint32_t *springls_component_ids(const springls_context *ctx)
{
    if (!ctx || ctx->model.set.count == 0 || !springls__components_enabled(ctx)) return NULL;
    return springls__ensure_on_host(ctx, SPRINGLS__BIT(COMPONENT)) == SPRINGLS_OK ? ctx->model.set.component : NULL;
}

/* Returns the label of the body that a place lies in or descent of phi leads to; -1: none. The voxel that it is in comes first: of the
   eight around it one of another body may be deeper. */
SPRINGLS__FN int32_t springls__body_at(const springls__grid *g, const springls__labels *labels, springls__v3 x)
{
    int32_t body, cavity;
    int voxel[3];
    springls__voxel_of_place(g, springls__v3_make(x.x + 0.5f, x.y + 0.5f, x.z + 0.5f), voxel);
    if (springls__grid_phi(g, g->phi, voxel[0], voxel[1], voxel[2]) < 0.0f) return springls__body_of_voxel(g, labels, voxel);
    springls__components_at(g, labels, x, &body, &cavity);
    return body;
}

/* Returns the label of the body that a place (model coordinates) lies in, or whose surface is nearest within the band; -1: none. */
SPRINGLS__FN int32_t springls__contoured_body_at(const springls_context *ctx, springls__v3 x)
{
    springls__surface_hit h = springls__contour_exit(ctx, x);
    springls__raw_mesh mesh;
    if (h.triangle < 0) h = springls__surface_closest(&ctx->contour_surface, x, ctx->model.grid.far_value);
    if (h.triangle < 0) return -1;
    springls__use_surface_mesh(ctx, &mesh);
    return springls__body_of_part(springls__surface_parts(ctx),
                                  springls__part_of_vertices(ctx)[mesh.triangles[3 * (size_t)h.triangle]]);
}

/* Prepares labels and, where components are those of the mesh of springls, the hierarchy of its triangles. */
SPRINGLS__FN springls_status springls__prepare_labels(springls_context *ctx, springls__labels *labels)
{
    SPRINGLS__TRY(springls__components_to_host(ctx, 0));
    if (springls__contours_springls(ctx)) SPRINGLS__TRY(springls__contour_surface_refresh(ctx));
    return springls__label_ids(ctx, labels);
}

SPRINGLS__EVENTS_API springls_status springls_component_of(springls_context *ctx, const float *points, int count, uint32_t *out)
{
    springls__labels labels;
    int i;
    SPRINGLS__TRY(springls__check_points(ctx, points, count, out, "component_of"));
    SPRINGLS__TRY(springls__refresh_components(ctx, "component_of"));
    SPRINGLS__TRY(springls__report_device_failure(ctx, springls__prepare_labels(ctx, &labels)));
    for (i = 0; i < count; i++) {
        const float *x = points + 3 * (size_t)i;
        const int32_t body = springls__contours_springls(ctx)
                               ? springls__contoured_body_at(ctx, springls__world_to_model(ctx, x))
                               : springls__body_at(&ctx->model.grid, &labels, springls__world_to_voxel(ctx, x));
        out[i] = body >= 0 ? ((const uint32_t *)ctx->label_id_memory.data)[body] : 0u;
    }
    return SPRINGLS_OK;
}

SPRINGLS__EVENTS_API springls_status springls_events(springls_context *ctx, const springls_event **events, int *count)
{
    springls_event *event;
    const springls_component *part;
    int i;
    if (events) *events = NULL;
    if (count) *count = 0;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!events || !count) return springls__fail_null(ctx, "events", events ? "count" : "events");
    SPRINGLS__TRY(springls__refresh_components(ctx, "events"));
    event = (springls_event *)ctx->event_memory.data;
    part = (const springls_component *)ctx->event_part_memory.data;
    for (i = 0; i < ctx->event_count; i++) {
        event[i].before = event[i].before_count ? part : NULL;
        part += event[i].before_count;
        event[i].after = event[i].after_count ? part : NULL;
        part += event[i].after_count;
    }
    *events = event;
    *count = ctx->event_count;
    return SPRINGLS_OK;
}

#endif
