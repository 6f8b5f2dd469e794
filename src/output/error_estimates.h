/* error_estimates.h - how far springls and vertices may be from where they should be. */
#ifndef SPRINGLS__OUTPUT_ERROR_ESTIMATES_H
#define SPRINGLS__OUTPUT_ERROR_ESTIMATES_H

#include "../../kernels_embed/model/error_estimates.h"
#include "../runtime/errors.h"
#include "../runtime/parallel.h"
#include "../model/host_access.h"
#include "../model/indexed_mesh.h"
#include "../model/transform.h"
#include "../solver/step.h"

typedef struct springls__error_job {
    const springls_context *ctx;
    const springls_mesh *mesh;
    springls_error_estimate *out;
} springls__error_job;

/* Returns the estimates, world units, that follow from an error on the original surface, voxels, at a place x that faces n. A voxel
   is at most the largest spacing long, whatever the direction of the error. */
SPRINGLS__FN springls_error_estimate springls__estimate_error(const springls_context *ctx, springls__v3 x, springls__v3 n,
                                                              springls__v3 a, float error, bool original)
{
    springls__span span = springls__span_at(&ctx->model, x, n, a, ctx->model.set.count);
    springls_error_estimate estimate;
    estimate.place = SPRINGLS__ERROR_FACTOR * springls__error_at_place(&span, error, original) * ctx->largest_spacing;
    estimate.correspondence = SPRINGLS__ERROR_FACTOR * error * ctx->largest_spacing;
    return estimate;
}

SPRINGLS__FN void springls__springl_errors_task(void *arg, int begin, int end)
{
    const springls__error_job *job = (const springls__error_job *)arg;
    const springls__model *model = &job->ctx->model;
    for (; begin < end; begin++)
        job->out[begin] = springls__estimate_error(job->ctx, model->set.s[begin].p, springls__springl_normal(model->set.s[begin]),
                                                   model->set.a[begin], model->set.error[begin],
                                                   (model->set.birth[begin] & 3u) == SPRINGLS__KIND_ORIGINAL);
}

/* Treats vertices as springls that are born there. */
SPRINGLS__FN void springls__mesh_errors_task(void *arg, int begin, int end)
{
    const springls__error_job *job = (const springls__error_job *)arg;
    const springls_context *ctx = job->ctx;
    float side = springls__is_mirrored(ctx) ? -1.0f : 1.0f; /* the normals of springls point inwards in a mirrored world */
    for (; begin < end; begin++) {
        size_t v = 3 * (size_t)begin;
        springls__v3 x = springls__world_to_voxel(ctx, job->mesh->positions + v);
        springls__v3 a = springls__world_to_original(ctx, job->mesh->correspondences + v);
        springls__v3 n = springls__normalize(springls__grid_gradient(&ctx->model.grid, ctx->model.grid.phi, x));
        if (springls__length2(n) < 0.5f) n = springls__scale(springls__load3(job->mesh->normals + v), side);
        job->out[begin] = springls__estimate_error(ctx, x, n, a,
                                                   springls__error_at_birth(&ctx->model, x, n, a, ctx->model.set.count), false);
    }
}

/* Runs a task with the springls in their cells; no step is in progress. */
SPRINGLS__FN springls_status springls__run_error_estimates(springls_context *ctx, int count, springls_task task,
                                                           springls__error_job *job)
{
    job->ctx = ctx;
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__read_cell_list(ctx));
    springls__parallel(ctx, count, 32, task, job);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_springl_errors(springls_context *ctx, springls_error_estimate *out)
{
    springls__error_job job;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    if (!out && ctx->model.set.count) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "springl_errors: out is NULL");
    job.mesh = NULL;
    job.out = out;
    return springls__run_error_estimates(ctx, ctx->model.set.count, springls__springl_errors_task, &job);
}

SPRINGLS_API springls_status springls_mesh_errors(springls_context *ctx, const springls_mesh *mesh, springls_error_estimate *out)
{
    springls__error_job job;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_mesh(ctx, mesh, out, "mesh_errors"));
    SPRINGLS__TRY(springls__begin_reading(ctx));
    if (mesh->version && mesh->version != ctx->springls_version + 1)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "mesh_errors: springls have changed since the mesh was made");
    job.mesh = mesh;
    job.out = out;
    return springls__run_error_estimates(ctx, mesh->vertex_count, springls__mesh_errors_task, &job);
}

#endif
