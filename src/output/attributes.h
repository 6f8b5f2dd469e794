/* attributes.h - adds, sets and reads attributes, and the provenance of springls. */
#ifndef SPRINGLS__OUTPUT_ATTRIBUTES_H
#define SPRINGLS__OUTPUT_ATTRIBUTES_H

#include "../runtime/finite.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../model/attribute_values.h"
#include "../model/host_access.h"
#include "../model/interpolation.h"
#include "../model/springl_surface.h"
#include "../model/transform.h"
#include "../solver/step.h"

/* Returns an attribute by its number; NULL, after reporting the error, when there is none. */
SPRINGLS__FN springls__attribute *springls__attribute_at(springls_context *ctx, int index, const char *call)
{
    if (index >= 0 && index < ctx->attribute_count) return &ctx->attributes[index];
    springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: there is no attribute %d among %d", call, index, ctx->attribute_count);
    return NULL;
}

/* Fails, and reports why, when an attribute cannot be added. */
SPRINGLS__FN springls_status springls__check_attribute(springls_context *ctx, const springls_attribute_desc *desc)
{
    const char *call = "add_attribute";
    size_t length = desc && desc->name ? strlen(desc->name) : 0;
    if (length == 0 || length > SPRINGLS_MAX_NAME_LENGTH)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: the name must have 1 to %d characters", call,
                              SPRINGLS_MAX_NAME_LENGTH);
    if (springls_find_attribute(ctx, desc->name) >= 0)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: there is already one named %s", call, desc->name);
    if (desc->channels < 1 || desc->channels > SPRINGLS_MAX_CHANNELS)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: %d channels, not 1 to %d", call, desc->channels,
                              SPRINGLS_MAX_CHANNELS);
    if (!springls__policy_known(desc->split) || !springls__policy_known(desc->fill) || !springls__policy_known(desc->merge))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: the policies %d, %d, %d are not each 0 to 2", call, (int)desc->split,
                              (int)desc->fill, (int)desc->merge);
    if (ctx->attribute_count == SPRINGLS_MAX_ATTRIBUTES)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: more than %d attributes", call, SPRINGLS_MAX_ATTRIBUTES);
    return SPRINGLS_OK;
}

/* Copies the values of all springls into an attribute; NULL: zeros. */
SPRINGLS__FN void springls__attribute_fill(springls_context *ctx, springls__attribute *attribute, const float *values)
{
    size_t bytes = (size_t)ctx->model.set.count * (size_t)attribute->channels * sizeof *values;
    if (values) memcpy(attribute->values.data, values, bytes);
    else memset(attribute->values.data, 0, bytes);
}

/* Fails when one of `count` values is not finite; NULL is accepted. */
SPRINGLS__FN springls_status springls__finite_values(springls_context *ctx, const float *values, size_t count, const char *call)
{
    size_t i;
    for (i = 0; values && i < count; i++)
        if (!springls__finite_float(values[i]))
            return springls__fail(ctx, SPRINGLS_NON_FINITE, "%s: value %lu is not finite", call, (unsigned long)i);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_add_attribute(springls_context *ctx, const springls_attribute_desc *desc,
                                                    const float *values, int *index)
{
    springls__attribute *attribute;
    if (index) *index = -1;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    SPRINGLS__TRY(springls__check_attribute(ctx, desc));
    SPRINGLS__TRY(springls__finite_values(ctx, values, (size_t)ctx->model.set.count * (size_t)desc->channels, "add_attribute"));
    attribute = &ctx->attributes[ctx->attribute_count];
    attribute->channels = desc->channels;
    SPRINGLS__TRY(springls__values_reserve(ctx, attribute, ctx->model.set.count, 0));
    memcpy(attribute->name, desc->name, strlen(desc->name) + 1);
    attribute->split = desc->split;
    attribute->fill = desc->fill;
    attribute->merge = desc->merge;
    springls__attribute_fill(ctx, attribute, values);
    if (index) *index = ctx->attribute_count;
    ctx->attribute_count++;
    ctx->attributes_version++;
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_remove_attribute(springls_context *ctx, int index)
{
    springls__attribute *attribute;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    attribute = springls__attribute_at(ctx, index, "remove_attribute");
    if (!attribute) return SPRINGLS_INVALID_ARGUMENT;
    springls__buffer_free(ctx, &attribute->values);
    ctx->attribute_count--;
    ctx->attributes_version++;
    for (; index < ctx->attribute_count; index++) ctx->attributes[index] = ctx->attributes[index + 1];
    memset(&ctx->attributes[index].values, 0, sizeof ctx->attributes[index].values);
    return SPRINGLS_OK;
}

SPRINGLS_API int springls_attribute_count(const springls_context *ctx) { return ctx ? ctx->attribute_count : 0; }

SPRINGLS_API springls_status springls_describe_attribute(springls_context *ctx, int index, springls_attribute_desc *out)
{
    const springls__attribute *attribute;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    attribute = springls__attribute_at(ctx, index, "describe_attribute");
    if (!attribute) return SPRINGLS_INVALID_ARGUMENT;
    if (!out) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "describe_attribute: out is NULL");
    out->name = attribute->name;
    out->channels = attribute->channels;
    out->split = attribute->split;
    out->fill = attribute->fill;
    out->merge = attribute->merge;
    return SPRINGLS_OK;
}

SPRINGLS_API int springls_find_attribute(const springls_context *ctx, const char *name)
{
    int i;
    for (i = 0; ctx && name && i < ctx->attribute_count; i++)
        if (strcmp(ctx->attributes[i].name, name) == 0) return i;
    return -1;
}

SPRINGLS_API springls_status springls_set_attribute(springls_context *ctx, int index, const float *values)
{
    springls__attribute *attribute;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    attribute = springls__attribute_at(ctx, index, "set_attribute");
    if (!attribute) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finite_values(ctx, values, (size_t)ctx->model.set.count * (size_t)attribute->channels,
                                          "set_attribute"));
    springls__attribute_fill(ctx, attribute, values);
    ctx->attributes_version++;
    return SPRINGLS_OK;
}

SPRINGLS_API springls_view springls_view_attribute(const springls_context *ctx, int index)
{
    springls_view view;
    memset(&view, 0, sizeof view);
    if (!ctx || index < 0 || index >= ctx->attribute_count) return view;
    view.count = ctx->model.set.count;
    view.data = view.count ? (const float *)ctx->attributes[index].values.data : NULL;
    view.stride = (size_t)ctx->attributes[index].channels * sizeof(float);
    return view;
}

typedef struct springls__mesh_attribute_job {
    springls__interpolation_search search;
    const float *positions, *normals, *correspondences; /* of the vertices, world */
    const springls__attribute *attribute;
    float *out;
} springls__mesh_attribute_job;

/* Interpolates the attribute at vertices. */
SPRINGLS__FN void springls__mesh_attribute_task(void *arg, int begin, int end)
{
    const springls__mesh_attribute_job *job = (const springls__mesh_attribute_job *)arg;
    const springls_context *ctx = job->search.ctx;
    float side = springls__is_mirrored(ctx) ? -1.0f : 1.0f; /* the normals of springls point inwards in a mirrored world */
    for (; begin < end; begin++) {
        size_t v = 3 * (size_t)begin;
        springls__v3 n = springls__scale(springls__load3(job->normals + v), side);
        springls__v3 x = springls__world_to_model(ctx, job->positions + v);
        springls__v3 a = springls__world_to_original(ctx, job->correspondences + v);
        springls__interpolation_sources sources = springls__interpolation_sources_at(&job->search, x, n, a, 1.0f);
        springls__interpolate_value(job->attribute, &sources, job->attribute->fill == SPRINGLS_POLICY_BLEND,
                                    job->out + (size_t)begin * (size_t)job->attribute->channels);
    }
}

/* Interpolates an attribute at `count` vertices, whose arrays the job has. */
SPRINGLS__FN springls_status springls__attribute_at_vertices(springls_context *ctx, springls__mesh_attribute_job *job, int count)
{
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__springl_surface_refresh(ctx));
    job->search.ctx = ctx;
    job->search.a = ctx->model.set.a;
    job->search.known = ctx->model.set.count;
    springls__parallel(ctx, count, 32, springls__mesh_attribute_task, job);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_mesh_attribute(springls_context *ctx, const springls_mesh *mesh, int index, float *out)
{
    springls__mesh_attribute_job job;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    job.attribute = springls__attribute_at(ctx, index, "mesh_attribute");
    if (!job.attribute) return SPRINGLS_INVALID_ARGUMENT;
    if (!mesh || (mesh->vertex_count > 0 && !out))
        return springls__fail_null(ctx, "mesh_attribute", mesh ? "out" : "mesh");
    job.positions = mesh->positions;
    job.normals = mesh->normals;
    job.correspondences = mesh->correspondences;
    job.out = out;
    return springls__attribute_at_vertices(ctx, &job, mesh->vertex_count);
}

SPRINGLS__CHUNKS_API springls_status springls_chunk_attribute(springls_context *ctx, const springls_chunk *chunk, int index, float *out)
{
    springls__mesh_attribute_job job;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    job.attribute = springls__attribute_at(ctx, index, "chunk_attribute");
    if (!job.attribute) return SPRINGLS_INVALID_ARGUMENT;
    if (!chunk || (chunk->vertex_count > 0 && !out)) return springls__fail_null(ctx, "chunk_attribute", chunk ? "out" : "chunk");
    if (chunk->vertex_count == 0) return SPRINGLS_OK;
    if (!chunk->correspondences)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT,
                              "chunk_attribute: the chunk has no correspondences: see springls_chunks_desc");
    job.positions = chunk->positions;
    job.normals = chunk->normals;
    job.correspondences = chunk->correspondences;
    job.out = out;
    return springls__attribute_at_vertices(ctx, &job, chunk->vertex_count);
}

SPRINGLS_API springls_status springls_get_provenance(springls_context *ctx, springls_provenance *out)
{
    int i;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(BIRTH) | SPRINGLS__BIT(GENERATION) | SPRINGLS__BIT(PARENT)));
    if (!out && ctx->model.set.count) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "get_provenance: out is NULL");
    for (i = 0; i < ctx->model.set.count; i++) {
        uint32_t birth = ctx->model.set.birth[i];
        out[i].kind = (springls_kind)(birth & 3u);
        out[i].age = (int)((ctx->model.set.step - (birth >> 2)) & 0x3fffffffu);
        out[i].generation = ctx->model.set.generation[i];
        out[i].parent = ctx->model.set.parent[i];
    }
    return SPRINGLS_OK;
}

#endif
