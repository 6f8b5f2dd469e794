/* create.h - the life cycle of a context, its parameters, and texts about the library. */
#ifndef SPRINGLS__LIFECYCLE_CREATE_H
#define SPRINGLS__LIFECYCLE_CREATE_H

#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../model/bvh.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "../model/host_access.h"
#include "../model/parameter_sets.h"
#include "../model/transform.h"
#include "../solver/step.h"

enum { SPRINGLS__DEFAULT_MAX_SPRINGLS = 64 * 1000 * 1000 };

SPRINGLS__FN void springls__free_all(springls_context *ctx)
{
    int i;
    if (ctx->step.ended) springls__abandon_step(ctx);
    springls__surface_free(ctx, &ctx->original);
    springls__surface_free(ctx, &ctx->springl_surface);
    springls__surface_free(ctx, &ctx->correspondences);
    springls__surface_free(ctx, &ctx->contour_surface);
    springls__buffer_free(ctx, &ctx->bvh_memory);
    springls__buffer_free(ctx, &ctx->id_memory);
    springls__buffer_free(ctx, &ctx->component_memory);
    springls__buffer_free(ctx, &ctx->next_component_memory);
    springls__buffer_free(ctx, &ctx->lock_item_memory);
    springls__buffer_free(ctx, &ctx->lock_node_memory);
    springls__buffer_free(ctx, &ctx->label_rank);
    springls__buffer_free(ctx, &ctx->label_voxel);
    springls__buffer_free(ctx, &ctx->label_node);
    springls__buffer_free(ctx, &ctx->label_id_memory);
    springls__buffer_free(ctx, &ctx->saved.memory);
    springls__buffer_free(ctx, &ctx->undo_memory);
    springls__buffer_free(ctx, &ctx->event_memory);
    springls__buffer_free(ctx, &ctx->event_part_memory);
    for (i = 0; i < SPRINGLS__SURFACE_BUFFERS; i++) springls__buffer_free(ctx, &ctx->surface_memory[i]);
    for (i = 0; i < SPRINGLS_MAX_ATTRIBUTES; i++) springls__buffer_free(ctx, &ctx->attributes[i].values);
    for (i = 0; i < SPRINGLS__ATTRIBUTE_BUFFERS; i++) springls__buffer_free(ctx, &ctx->attribute_memory[i]);
    for (i = 0; i < SPRINGLS__ARRAY_COUNT; i++) springls__buffer_free(ctx, &ctx->memory[i]);
    if (ctx->backend) (ctx->backend->release)(ctx);
}

/* Reports a failure that happens before there is a context. */
SPRINGLS__FN springls_status springls__create_fail(const springls_desc *desc, springls_status status, const char *reason)
{
    char message[128];
    if (!desc || !desc->logger.log) return status;
    snprintf(message, sizeof message, "create: %s", reason);
    (desc->logger.log)(desc->logger.user, 1, message);
    return status;
}

/* Returns what is wrong with a description, or NULL; fills in the grid's matrices and the parameters. */
SPRINGLS__FN const char *springls__desc_fault(const springls_desc *desc, double *to_world, double *to_voxel,
                                              springls_params *params)
{
    const char *fault = springls__grid_transform(&desc->grid, to_world, to_voxel);
    int axis;
    for (axis = 0; axis < 3; axis++)
        if (desc->grid.size[axis] < 4) return "grid.size is less than 4 voxels a side: it may be 4 to 4096";
    if (fault) return fault;
    for (axis = 0; axis < 3; axis++)
        if (desc->follow && desc->grid.size[axis] % SPRINGLS__BRICK) return "grid.size is no multiple of 8, but follow is set";
    for (axis = 0; axis < 3; axis++) {
        if (desc->window[axis] % SPRINGLS__BRICK) return "window is no multiple of 8";
        if (desc->window[axis] > 1 << 30 || desc->window[axis] < -(1 << 30))
            return "window is out of range: it may be -2^30 to 2^30";
        if (desc->window[axis] && (desc->grid.size[0] | desc->grid.size[1] | desc->grid.size[2]) % SPRINGLS__BRICK)
            return "grid.size is no multiple of 8, but window is set";
    }
    *params = desc->params ? *desc->params : springls_default_params();
    fault = springls__params_fault(params);
    if (fault) return fault;
    if (desc->max_springls < 0) return "max_springls is negative: it may be 1 to 2147483647, or 0 for the default of 64000000";
    if (desc->allocator.alloc && !desc->allocator.free) return "allocator.free is NULL, but alloc is not";
    if (desc->allocator.free && !desc->allocator.alloc) return "allocator.alloc is NULL, but free is not";
    return NULL;
}

SPRINGLS_API const char *springls_create_error(const springls_desc *desc)
{
    double to_world[12], to_voxel[12];
    springls_params params;
    const char *fault = desc ? springls__desc_fault(desc, to_world, to_voxel, &params) : "desc is NULL";
    return fault ? fault : "";
}

SPRINGLS_API springls_desc springls_default_desc(void)
{
    springls_desc desc;
    int k;
    memset(&desc, 0, sizeof desc);
    for (k = 0; k < 3; k++) desc.grid.spacing[k] = desc.grid.direction[4 * k] = 1.0;
    desc.max_springls = SPRINGLS__DEFAULT_MAX_SPRINGLS;
    return desc;
}

SPRINGLS_API springls_step_desc springls_default_step_desc(void)
{
    springls_step_desc step;
    memset(&step, 0, sizeof step);
    return step;
}

SPRINGLS_API springls_forces springls_default_forces(void)
{
    springls_forces forces;
    memset(&forces, 0, sizeof forces);
    forces.pressure_weight = forces.velocity_weight = forces.affine_weight = 1.0f;
    return forces;
}

/* Returns the product of two columns of the left part of a row-major 3x4 matrix. */
SPRINGLS__FN double springls__column_product(const double *m, int a, int b)
{
    return m[a] * m[b] + m[4 + a] * m[4 + b] + m[8 + a] * m[8 + b];
}

/* Finds the grid's metric, if its spacing is not uniform or its axes are not orthogonal by more than rounding; then the longest
   spacing becomes an upper bound of the length of a unit vector of voxels, by the row sums of J'J. */
SPRINGLS__FN void springls__find_metric(springls_context *ctx)
{
    const double *m = ctx->lattice_to_world, *inverse = ctx->window.to_voxel;
    const double unit2 = (double)ctx->smallest_spacing * (double)ctx->smallest_spacing;
    double longest2 = 0.0, product[9];
    float *metric = &ctx->model.grid.metric.xx;
    bool uniform = true;
    int a, b;
    for (a = 0; a < 3; a++) {
        double sum = 0.0;
        for (b = 0; b < 3; b++) {
            const double lengths = springls__column_product(m, a, b);
            uniform = uniform && fabs(lengths - (a == b ? unit2 : 0.0)) < 1e-4 * unit2;
            sum += fabs(lengths);
            product[3 * a + b] = unit2
                * (inverse[4 * a] * inverse[4 * b] + inverse[4 * a + 1] * inverse[4 * b + 1] + inverse[4 * a + 2] * inverse[4 * b + 2]);
        }
        if (sum > longest2) longest2 = sum;
    }
    if (uniform) return;
    for (a = 0; a < 3; a++) metric[a] = (float)product[4 * a];
    metric[3] = (float)product[1];
    metric[4] = (float)product[2];
    metric[5] = (float)product[5];
    ctx->largest_spacing = (float)sqrt(longest2);
}

/* Returns whether lattice coordinates are those of the world. */
SPRINGLS__FN bool springls__is_identity(const double *m)
{
    int row, column;
    for (row = 0; row < 3; row++)
        for (column = 0; column < 4; column++)
            if (m[4 * row + column] != (row == column ? 1.0 : 0.0)) return false;
    return true;
}

/* Finds the shortest and the longest step between voxels, in world units, and the metric. */
SPRINGLS__FN void springls__measure_spacing(springls_context *ctx)
{
    const double *m = ctx->lattice_to_world;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        float spacing = springls__length(springls__v3_make((float)m[axis], (float)m[4 + axis], (float)m[8 + axis]));
        if (axis == 0 || spacing < ctx->smallest_spacing) ctx->smallest_spacing = spacing;
        if (axis == 0 || spacing > ctx->largest_spacing) ctx->largest_spacing = spacing;
    }
    ctx->lattice_is_world = springls__is_identity(m);
    springls__find_metric(ctx);
}

/* Copies a checked description, with its defaults filled in. */
SPRINGLS__FN void springls__copy_desc(springls_context *ctx, const springls_desc *desc)
{
    ctx->desc = *desc;
    ctx->desc.params = NULL;
    ctx->backend = desc->backend;
    if (!ctx->desc.allocator.alloc) {
        ctx->desc.allocator.alloc = springls__malloc;
        ctx->desc.allocator.free = springls__free;
    }
    if (ctx->desc.max_springls == 0) ctx->desc.max_springls = SPRINGLS__DEFAULT_MAX_SPRINGLS;
    springls__measure_spacing(ctx);
}

SPRINGLS_API springls_status springls_create(const springls_desc *desc, springls_context **out)
{
    springls_context *ctx, made;
    const char *fault;
    springls_status status;
    if (out) *out = NULL;
    if (!desc) return SPRINGLS_INVALID_ARGUMENT;
    if (!out) return springls__create_fail(desc, SPRINGLS_INVALID_ARGUMENT, "out is NULL");
    memset(&made, 0, sizeof made);
    fault = springls__desc_fault(desc, made.lattice_to_world, made.window.to_voxel, &made.model.params);
    if (fault) return springls__create_fail(desc, SPRINGLS_INVALID_ARGUMENT, fault);
    made.original_window = made.window;
    memcpy(made.home, desc->window, sizeof made.home);
    springls__windows_reset(&made);
    springls__copy_desc(&made, desc);
    ctx = (springls_context *)springls__allocate(&made, sizeof *ctx);
    if (!ctx) return springls__create_fail(desc, SPRINGLS_OUT_OF_MEMORY, "out of memory");
    *ctx = made;
    status = springls__grids_create(ctx);
    if (status != SPRINGLS_OK) {
        springls_destroy(ctx);
        return status;
    }
    *out = ctx;
    return SPRINGLS_OK;
}

/* Creates an empty model with the grid, the parameters and the allocator of this one, on the given backend. call: for the error. */
SPRINGLS__FN springls_status springls__create_alike_on(springls_context *ctx, const char *call, springls_backend *backend,
                                                       springls_context **out)
{
    springls_desc desc = ctx->desc;
    springls_status status;
    desc.params = &ctx->model.params;
    desc.backend = backend;
    status = springls_create(&desc, out);
    return status == SPRINGLS_OK ? SPRINGLS_OK : springls__fail(ctx, status, "%s: %s", call, springls_status_string(status));
}

/* The same without a device. */
SPRINGLS__FN springls_status springls__create_alike(springls_context *ctx, const char *call, springls_context **out)
{
    return springls__create_alike_on(ctx, call, NULL, out);
}

SPRINGLS_API void springls_destroy(springls_context *ctx)
{
    springls_allocator allocator;
    if (!ctx) return;
    springls__free_all(ctx);
    allocator = ctx->desc.allocator;
    (allocator.free)(ctx, sizeof *ctx, allocator.user);
}

SPRINGLS_API springls_status springls_reset(springls_context *ctx)
{
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    springls__clear_model(ctx);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_params springls_get_params(const springls_context *ctx)
{
    return ctx ? ctx->model.params : springls_default_params();
}

/* Returns whether parameters differ from those in use in `contouring` alone, which changes no bit of the model. */
SPRINGLS__FN bool springls__differs_in_contouring(const springls_context *ctx, const springls_params *params)
{
    springls_params same = ctx->model.params;
    same.contouring = params->contouring;
    return params->contouring != ctx->model.params.contouring && memcmp(&same, params, sizeof same) == 0;
}

SPRINGLS_API springls_status springls_set_params(springls_context *ctx, const springls_params *params)
{
    const char *fault;
    char value[32];
    bool band_changed;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!params) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_params: params is NULL");
    fault = springls__params_fault(params);
    springls__params_bad_value(params, value);
    if (fault) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_params: %s%s", fault, value);
    if (params->band_half_width != ctx->model.params.band_half_width && ctx->model.set.count > 0)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_params: band_half_width is fixed while there is a model");
    if (ctx->step.chunks) SPRINGLS__TRY(springls__finish_step(ctx)); /* an update of chunks keeps to its contouring */
    if (springls__differs_in_contouring(ctx, params) && !springls__components_enabled(ctx)) {
        ctx->model.params.contouring = params->contouring;
        return SPRINGLS_OK;
    }
    SPRINGLS__TRY(springls__finish_step(ctx));
    SPRINGLS__TRY(springls__settle_components(ctx));
    if (params->contouring != ctx->model.params.contouring) ctx->components_version = 0; /* they are those of another surface */
    if (springls__differs_in_contouring(ctx, params)) {
        ctx->model.params.contouring = params->contouring;
        return SPRINGLS_OK;
    }
    band_changed = params->band_half_width != ctx->model.params.band_half_width;
    ctx->model.params = *params;
    if (params->contact == SPRINGLS_CONTACT_MERGE) ctx->last_contact_body = 0;
    if (!springls__components_enabled(ctx)) springls__clear_components(ctx);
    springls__wake_all(ctx);
    springls__constellation_changed(ctx); /* cells and neighbour lists depend on the old radii */
    springls__omega_constant(ctx, params->capture_range, params->capture_range);
    if (band_changed) springls__grids_clear(ctx); /* no model: constant bricks only, of another distance */
    return springls__report_device_failure(ctx, SPRINGLS_OK);
}

SPRINGLS_API const char *springls_last_error(const springls_context *ctx) { return ctx ? ctx->error : "no context"; }

SPRINGLS_API size_t springls_memory_used(const springls_context *ctx)
{
    return ctx ? ctx->memory_used + springls_memory_used(ctx->step.owned) : 0;
}

SPRINGLS_API int springls_version(void) { return SPRINGLS_VERSION; }

SPRINGLS_API const char *springls_version_string(void)
{
    return SPRINGLS__TEXT(SPRINGLS_VERSION_MAJOR) "." SPRINGLS__TEXT(SPRINGLS_VERSION_MINOR) "."
           SPRINGLS__TEXT(SPRINGLS_VERSION_PATCH);
}

SPRINGLS_API const char *springls_status_string(springls_status status)
{
    switch (status) {
    case SPRINGLS_OK: return "ok";
    case SPRINGLS_INVALID_ARGUMENT: return "invalid argument";
    case SPRINGLS_OUT_OF_MEMORY: return "out of memory";
    case SPRINGLS_BAD_MESH: return "bad mesh";
    case SPRINGLS_NON_FINITE: return "not finite";
    case SPRINGLS_EMPTY_MODEL: return "empty model";
    case SPRINGLS_CANCELLED: return "cancelled";
    case SPRINGLS_DEVICE_FAILED: return "device failure";
    case SPRINGLS_BAD_SNAPSHOT: return "bad snapshot";
    default: return "unknown status";
    }
}

/* Computes a*a + c, which is 0 when a*a is rounded and 2^-24 when it is not, and (c + b) - b, which is 0 unless sums are
   reordered. Volatile operands keep the compiler from computing either by itself. With -ffast-math clang still computes square roots
   by estimates, in spite of float_control. */
SPRINGLS_API bool springls_fp_contract_detected(void)
{
#if defined(__clang__) && defined(__FAST_MATH__)
    return true;
#else
    volatile float operands[3] = { 1.0f + 1.0f / 4096.0f, -(1.0f + 1.0f / 2048.0f), 1073741824.0f };
    float a = operands[0], c = operands[1], b = operands[2];
    float product = a * a, sum = c + b;
    return product + c != 0.0f || sum - b != 0.0f;
#endif
}

#endif
