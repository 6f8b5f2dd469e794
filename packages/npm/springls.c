/* springls.c - the functions of springls.h that index.js calls, with arguments that JavaScript can pass: numbers and addresses.
 * Coordinates are those of the world. Callbacks are imports: which function of the caller's they run is known there. */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#define JS_EXPORT(name) __attribute__((export_name(#name)))
#define JS_IMPORT(name) __attribute__((import_module("callbacks"), import_name(#name)))

JS_IMPORT(velocity) void js_velocity(const float *points, int count, float time, float *out);
JS_IMPORT(pressure) void js_pressure(const float *points, const float *normals, int count, float time, float *out);
JS_IMPORT(distance) void js_distance(const float *points, int count, float *out);

static void velocity(void *user, const float *points, int count, float time, float *out)
{
    (void)user;
    js_velocity(points, count, time, out);
}

static void pressure(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    (void)user;
    js_pressure(points, normals, count, time, out);
}

static void distance(void *user, const float *points, int count, float *out)
{
    (void)user;
    js_distance(points, count, out);
}

JS_EXPORT(allocate) void *js_allocate(size_t bytes) { return malloc(bytes); }
JS_EXPORT(release) void js_release(void *memory) { free(memory); }
JS_EXPORT(version) const char *js_version(void) { return springls_version_string(); }

/* Describes a model: voxels along each axis; spacing, origin and direction of the grid, 15 numbers. */
static springls_desc describe(const int *size, const double *place, bool follow)
{
    springls_desc desc = springls_default_desc();
    memcpy(desc.grid.size, size, sizeof desc.grid.size);
    memcpy(desc.grid.spacing, place, sizeof desc.grid.spacing);
    memcpy(desc.grid.origin, place + 3, sizeof desc.grid.origin);
    memcpy(desc.grid.direction, place + 6, sizeof desc.grid.direction);
    desc.follow = follow;
    return desc;
}

/* Creates a model, or returns NULL and writes the status. */
JS_EXPORT(create) springls_context *js_create(const int *size, const double *place, bool follow, int *status)
{
    const springls_desc desc = describe(size, place, follow);
    springls_context *ctx;
    *status = springls_create(&desc, &ctx);
    return ctx;
}

/* Returns why a model could not be created. */
JS_EXPORT(create_error) const char *js_create_error(const int *size, const double *place, bool follow)
{
    const springls_desc desc = describe(size, place, follow);
    const char *reason = springls_create_error(&desc);
    return *reason ? reason : "create: out of memory";
}

JS_EXPORT(destroy) void js_destroy(springls_context *ctx) { springls_destroy(ctx); }
JS_EXPORT(last_error) const char *js_last_error(const springls_context *ctx) { return springls_last_error(ctx); }
JS_EXPORT(status_string) const char *js_status_string(int status) { return springls_status_string((springls_status)status); }

/* Begins a change of parameters, which `parameter` makes and set_params takes. */
static springls_params params;
JS_EXPORT(get_params) void js_get_params(const springls_context *ctx, bool paper)
{
    params = paper ? springls_paper_params() : springls_get_params(ctx);
}

static int set_integer(void *member, double value)
{
    const int integer = value >= INT32_MIN && value <= INT32_MAX ? (int)value : 0;
    memcpy(member, &integer, sizeof integer);
    return (double)integer == value ? 1 : 2;
}

/* Changes a parameter; 0: there is none of this name; 2: it is an integer, which the value is not. */
JS_EXPORT(parameter) int js_parameter(const char *name, double value)
{
#define REAL(member, low, high) if (strcmp(name, #member) == 0) return params.member = (float)value, 1;
#define INTEGER(member, low, high) if (strcmp(name, #member) == 0) return set_integer(&params.member, value);
    SPRINGLS__PARAMS(REAL, INTEGER)
    return 0;
}

JS_EXPORT(set_params) int js_set_params(springls_context *ctx) { return springls_set_params(ctx, &params); }

JS_EXPORT(set_mesh) int js_set_mesh(springls_context *ctx, const float *positions, int points, const int *triangles, int count)
{
    return springls_set_mesh(ctx, positions, points, 0, triangles, count, NULL);
}

JS_EXPORT(set_level_set) int js_set_level_set(springls_context *ctx, const float *phi) { return springls_set_level_set(ctx, phi); }
JS_EXPORT(set_implicit) int js_set_implicit(springls_context *ctx) { return springls_set_implicit(ctx, distance, NULL); }

/* Advances the model; `forces` are those of velocity (1) and pressure (2) that there are. */
JS_EXPORT(step) int js_step(springls_context *ctx, int mode, int forces, float curvature, float dt, float max_displacement)
{
    const springls_forces all = {
        .velocity = forces & 1 ? velocity : NULL, .pressure = forces & 2 ? pressure : NULL, .curvature_weight = curvature};
    const springls_step_desc step = {.forces = &all, .mode = (springls_mode)mode, .dt = dt, .max_displacement = max_displacement};
    return springls_step(ctx, &step);
}

JS_EXPORT(settle) int js_settle(springls_context *ctx, int steps) { return springls_settle(ctx, steps); }

JS_EXPORT(combine) int js_combine(springls_context *ctx, int operation, springls_context *other)
{
    return springls_combine(ctx, (springls_operation)operation, other);
}

JS_EXPORT(combine_implicit) int js_combine_implicit(springls_context *ctx, int operation)
{
    return springls_combine_implicit(ctx, (springls_operation)operation, distance, NULL);
}

/* Writes the numbers of vertices and triangles, and the addresses of positions, normals, correspondences, springls and triangles. */
static springls_mesh mesh;
JS_EXPORT(extract_mesh) int js_extract_mesh(springls_context *ctx, uintptr_t out[7])
{
    const springls_status status = springls_extract_mesh(ctx, &mesh);
    const uintptr_t found[7] = {(uintptr_t)mesh.vertex_count, (uintptr_t)mesh.triangle_count, (uintptr_t)mesh.positions,
        (uintptr_t)mesh.normals, (uintptr_t)mesh.correspondences, (uintptr_t)mesh.springls, (uintptr_t)mesh.triangles};
    memcpy(out, found, sizeof found);
    return status;
}

JS_EXPORT(free_mesh) void js_free_mesh(springls_context *ctx) { springls_mesh_free(ctx, &mesh); }

/* Writes volume, area, lower and upper corner, components, Euler's number. */
JS_EXPORT(measure) int js_measure(springls_context *ctx, double out[10])
{
    springls_measures m;
    const springls_status status = springls_measure(ctx, &m);
    if (status == SPRINGLS_OK) {
        const double found[10] = {m.volume, m.area, m.lower[0], m.lower[1], m.lower[2], m.upper[0], m.upper[1], m.upper[2], m.components, m.euler};
        memcpy(out, found, sizeof found);
    }
    return status;
}

/* `capacity` 0: the size only. */
JS_EXPORT(snapshot) int js_snapshot(springls_context *ctx, int kind, void *out, size_t capacity, size_t *size)
{
    return springls_snapshot(ctx, (springls_snapshot_kind)kind, capacity ? out : NULL, capacity, size);
}

JS_EXPORT(restore) int js_restore(springls_context *ctx, const void *snapshot, size_t size) { return springls_restore(ctx, snapshot, size); }
JS_EXPORT(voxels) double js_voxels(const springls_context *ctx)
{
    const int *size = ctx->model.grid.size;
    return (double)size[0] * size[1] * size[2];
}

JS_EXPORT(count) int js_count(const springls_context *ctx) { return springls_count(ctx); }
JS_EXPORT(time) double js_time(const springls_context *ctx) { return springls_time(ctx); }
JS_EXPORT(set_time) void js_set_time(springls_context *ctx, double time) { springls_set_time(ctx, time); }

JS_EXPORT(state_hash) const char *js_state_hash(const springls_context *ctx)
{
    static char hash[17];
    snprintf(hash, sizeof hash, "%016" PRIx64, springls_state_hash(ctx));
    return hash;
}
