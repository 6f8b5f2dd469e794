/* extract_soup.h - the triangles of the springls as a mesh. */
#ifndef SPRINGLS__OUTPUT_EXTRACT_SOUP_H
#define SPRINGLS__OUTPUT_EXTRACT_SOUP_H

#include "isosurface.h"
#include "query.h"

typedef struct springls__soup_job { const springls_context *ctx; springls_mesh *mesh; } springls__soup_job;

/* Writes the vertices of springls. A corner without an original surface has the correspondence of the springl. */
SPRINGLS__FN void springls__soup_task(void *arg, int begin, int end)
{
    const springls__soup_job *job = (const springls__soup_job *)arg;
    const springls_context *ctx = job->ctx;
    int i, m;
    for (i = begin; i < end; i++) {
        const springls__springl *s = &ctx->model.set.s[i];
        springls__v3 n = springls__normal_to_world(ctx, springls__springl_normal(*s));
        springls_to_world(ctx, &s->q[0].x, 3, job->mesh->positions + 9 * (size_t)i);
        for (m = 0; m < 3; m++) {
            const size_t vertex = 3 * (size_t)i + (size_t)m;
            springls__surface_hit material = springls__material_at(ctx, i, s->q[m], false);
            springls__original_to_world(ctx, material.triangle < 0 ? ctx->model.set.a[i] : material.hit.point,
                                        job->mesh->correspondences + 3 * vertex);
            memcpy(job->mesh->normals + 3 * vertex, &n.x, 3 * sizeof(float));
            job->mesh->springls[vertex] = i;
            job->mesh->triangles[vertex] = (int)vertex;
        }
    }
}

SPRINGLS_API springls_status springls_extract_soup(springls_context *ctx, springls_mesh *out)
{
    springls__soup_job job;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__use_host(ctx, false));
    if (!out) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "extract_soup: out is NULL");
    memset(out, 0, sizeof *out);
    if (ctx->model.set.count > INT32_MAX / 3)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "extract_soup: too many springls for int indices");
    SPRINGLS__TRY(springls__springl_surface_refresh(ctx));
    SPRINGLS__TRY(springls__mesh_allocate(ctx, 3 * ctx->model.set.count, ctx->model.set.count, out));
    job.ctx = ctx;
    job.mesh = out;
    springls__parallel(ctx, ctx->model.set.count, 64, springls__soup_task, &job);
    springls__keep_orientation(ctx, out);
    return SPRINGLS_OK;
}

#endif
