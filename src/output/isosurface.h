/* isosurface.h - extracts the watertight surface as a welded mesh: the zero level, or what springls show (surface_table.h). */
#ifndef SPRINGLS__OUTPUT_ISOSURFACE_H
#define SPRINGLS__OUTPUT_ISOSURFACE_H

#include "../../kernels_embed/stages/fill_gaps.h"
#include "../../kernels_embed/output/isosurface.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/launch.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../runtime/residency.h"
#include "../model/host_access.h"
#include "../model/transform.h"
#include "../solver/step.h"
#include "../stages/surface_table.h"
#include "vertex_material.h"

/* Runs welded marching cubes of phi, on the backend where one is in use; the mesh is then on the host. */
SPRINGLS__FN springls_status springls__isosurface(springls_context *ctx, springls__raw_mesh *mesh)
{
    const int bricks = ctx->model.grid.active_count;
    springls__arguments args;
    size_t corners;
    memset(mesh, 0, sizeof *mesh);
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, cubes, (size_t)bricks * SPRINGLS__CUBES));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, triangles_before, bricks));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, vertices_before, bricks));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, surface_rank, ctx->model.grid.slot_count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, row_triangles, (size_t)bricks * SPRINGLS__CUBE_ROWS));
    springls__run(ctx, SPRINGLS__KERNEL_surface_count, bricks, NULL);
    SPRINGLS__TRY(springls__scan(ctx, SPRINGLS__ROLE_ARRAY(triangles_before), bricks, &mesh->triangle_count));
    SPRINGLS__TRY(springls__scan(ctx, SPRINGLS__ROLE_ARRAY(vertices_before), bricks, &mesh->vertex_count));
    if (mesh->triangle_count > INT32_MAX / 3) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "a mesh has too many triangles");
    corners = 3 * (size_t)mesh->triangle_count;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, surface_positions, mesh->vertex_count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, surface_corners, corners));
    mesh->positions = springls__surface_positions(&ctx->model);
    mesh->triangles = springls__surface_corners(&ctx->model);
    args.surface.triangles = mesh->triangle_count;
    springls__run(ctx, SPRINGLS__KERNEL_surface, bricks, &args);
    SPRINGLS__TRY(springls__fetch(ctx, SPRINGLS__ROLE_ARRAY(surface_positions),
                                  (size_t)mesh->vertex_count * sizeof *mesh->positions));
    return springls__fetch(ctx, SPRINGLS__ROLE_ARRAY(surface_corners), corners * sizeof *mesh->triangles);
}

/* Makes the watertight surface as params.contouring has it. */
SPRINGLS__FN springls_status springls__watertight_mesh(springls_context *ctx, springls__raw_mesh *mesh)
{
    if (ctx->model.params.contouring == SPRINGLS_CONTOURING_LEVEL_SET) return springls__isosurface(ctx, mesh);
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__read_cell_list(ctx));
    return springls__contour_springls(ctx, mesh);
}

/* Allocates the arrays of a mesh in one block, which springls_mesh_free releases; no vertices: no block. */
SPRINGLS__FN springls_status springls__mesh_allocate(springls_context *ctx, int vertices, int triangles, springls_mesh *mesh)
{
    size_t v = (size_t)vertices, t = (size_t)triangles;
    char *block;
    memset(mesh, 0, sizeof *mesh);
    if (v == 0) return SPRINGLS_OK;
    mesh->bytes = v * (9 * sizeof(float) + sizeof(int)) + t * 3 * sizeof(int);
    block = (char *)springls__allocate(ctx, mesh->bytes);
    if (!block) {
        mesh->bytes = 0;
        return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "a mesh of %d vertices does not fit in memory", vertices);
    }
    mesh->positions = (float *)(void *)block;
    mesh->normals = mesh->positions + 3 * v;
    mesh->correspondences = mesh->normals + 3 * v;
    mesh->springls = (int *)(void *)(mesh->correspondences + 3 * v);
    mesh->triangles = mesh->springls + v;
    mesh->vertex_count = vertices;
    mesh->triangle_count = triangles;
    mesh->version = ctx->springls_version + 1;
    return SPRINGLS_OK;
}

/* Turns the triangles in a mirrored world, so that they are counter-clockwise seen from outside. */
SPRINGLS__FN void springls__keep_orientation(const springls_context *ctx, springls_mesh *mesh)
{
    int t;
    if (!springls__is_mirrored(ctx)) return;
    for (t = 0; t < mesh->triangle_count; t++) {
        int corner = mesh->triangles[3 * t + 1];
        mesh->triangles[3 * t + 1] = mesh->triangles[3 * t + 2];
        mesh->triangles[3 * t + 2] = corner;
    }
}

typedef struct springls__vertex_data_job { springls_context *ctx; springls_mesh *mesh; } springls__vertex_data_job;

/* Converts what the kernel attach_vertex_data has computed to the world, and copies it to the mesh. */
SPRINGLS__FN void springls__attach_vertex_data_task(void *arg, int begin, int end)
{
    const springls__vertex_data_job *job = (const springls__vertex_data_job *)arg;
    const springls__model *model = &job->ctx->model;
    for (; begin < end; begin++) {
        const int springl = springls__vertex_springl(model)[begin]; /* without one the vertex is its own correspondence */
        springls__v3 n = springls__normal_to_world(job->ctx, springls__vertex_gradient(model)[begin]);
        springls__voxel_to_world(job->ctx, springls__surface_positions(model)[begin], job->mesh->positions + 3 * begin);
        springls__window_to_world(springl < 0 ? &job->ctx->window : &job->ctx->original_window,
                                  springls__vertex_correspondence(model)[begin], job->mesh->correspondences + 3 * begin);
        memcpy(job->mesh->normals + 3 * begin, &n.x, 3 * sizeof(float));
        job->mesh->springls[begin] = springl;
    }
}

/* Finds the correspondences of vertices of what springls hold, and the springls of those that have none: the nearest ones that face the
   same way. memory: springls__candidates. */
SPRINGLS__FN void springls__contour_material_work(void *arg, int begin, int end, float *memory)
{
    const springls__model *model = (const springls__model *)arg;
    const springls__v3 *x = springls__surface_positions(model), *n = springls__vertex_gradient(model);
    int *springl = springls__vertex_springl(model), i;
    for (i = begin; i < end; i++) springl[i] = springls__springl_of_place(model, x[i], n[i], springl[i]);
    springls__correspond(model, (springls__candidates *)(void *)memory, x + begin, springl + begin, end - begin,
                         springls__vertex_correspondence(model) + begin);
}

/* Finds the material of all vertices of what springls hold: springls__contour_material_work. */
SPRINGLS__FN springls_status springls__contour_material(springls_context *ctx, int vertices)
{
    const size_t floats = sizeof(springls__candidates) / sizeof(float);
    const int grain = 4 * SPRINGLS__CLOSE_VERTICES;
    SPRINGLS__TRY(springls__reserve_lanes(ctx, floats, vertices, grain));
    springls__do_work(ctx, springls__contour_material_work, &ctx->model, floats, 0, vertices, grain);
    return SPRINGLS_OK;
}

/* Extracts the zero level with normals, correspondences and springls in a mesh of its own. On failure the caller frees it. */
SPRINGLS__FN springls_status springls__isosurface_with_data(springls_context *ctx, springls_mesh *out)
{
    springls__raw_mesh raw;
    springls__vertex_data_job job;
    size_t vertices;
    SPRINGLS__TRY(springls__read_cell_list(ctx));
    SPRINGLS__TRY(springls__watertight_mesh(ctx, &raw));
    vertices = (size_t)raw.vertex_count;
    SPRINGLS__TRY(springls__mesh_allocate(ctx, raw.vertex_count, raw.triangle_count, out));
    if (raw.vertex_count == 0) return SPRINGLS_OK;
    memcpy(out->triangles, raw.triangles, (size_t)raw.triangle_count * 3 * sizeof *raw.triangles); /* before lanes use their memory */
    springls__keep_orientation(ctx, out);
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, vertex_gradient, vertices));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, vertex_correspondence, vertices));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, vertex_springl, vertices));
    if (raw.normals) SPRINGLS__TRY(springls__contour_material(ctx, raw.vertex_count));
    else springls__run(ctx, SPRINGLS__KERNEL_attach_vertex_data, raw.vertex_count, NULL);
    SPRINGLS__TRY(springls__fetch(ctx, SPRINGLS__ROLE_ARRAY(vertex_gradient), vertices * sizeof(springls__v3)));
    SPRINGLS__TRY(springls__fetch(ctx, SPRINGLS__ROLE_ARRAY(vertex_correspondence), vertices * sizeof(springls__v3)));
    SPRINGLS__TRY(springls__fetch(ctx, SPRINGLS__ROLE_ARRAY(vertex_springl), vertices * sizeof(int)));
    job.ctx = ctx;
    job.mesh = out;
    springls__parallel(ctx, raw.vertex_count, 1024, springls__attach_vertex_data_task, &job);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_extract_mesh(springls_context *ctx, springls_mesh *out)
{
    springls_status status;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!out) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "extract_mesh: out is NULL");
    memset(out, 0, sizeof *out);
    SPRINGLS__TRY(springls__begin_reading(ctx));
    springls__use_device(ctx);
    status = springls__report_device_failure(ctx, springls__isosurface_with_data(ctx, out));
    if (status != SPRINGLS_OK) springls_mesh_free(ctx, out); /* a device failure may come after the mesh is allocated */
    return status;
}

SPRINGLS_API void springls_mesh_free(springls_context *ctx, springls_mesh *mesh)
{
    if (!ctx || !mesh) return;
    springls__release(ctx, mesh->positions, mesh->bytes);
    memset(mesh, 0, sizeof *mesh);
}

#endif
