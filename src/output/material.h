/* material.h - computes material coordinates: the place on the original surface, as triangle and barycentric coordinates, of
   springls and of the vertices of extracted meshes.

   Why a texture does not wear off: values stay on the mesh that was set, and each vertex looks its place up there, by the correspondence,
   which no step computes again. A seam needs care, since beside it the values jump: the three corners of a triangle are looked up on one
   side of every seam (springls__closest_in_patch). */
#ifndef SPRINGLS__OUTPUT_MATERIAL_H
#define SPRINGLS__OUTPUT_MATERIAL_H

#include "../runtime/algorithms.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../model/attribute_values.h"
#include "../model/closest_point.h"
#include "../model/host_access.h"
#include "../model/indexed_mesh.h"
#include "../model/transform.h"
#include "query.h"

/* Converts a hit on the original surface to the numbering of the caller's mesh. */
SPRINGLS__FN springls_material springls__material_of(const springls_context *ctx, const springls__surface_hit *h)
{
    springls_material out;
    memset(&out, 0, sizeof out);
    out.triangle = -1;
    if (h->triangle >= 0) springls__source_of(&ctx->original, h, &out.triangle, out.barycentric);
    return out;
}

typedef struct springls__material_job {
    const springls_context *ctx;
    const springls_mesh *mesh; /* NULL: the springls */
    const int *neighbors;  /* [3 * caller's triangle] the triangle across each edge; -1: a seam      */
    const int *inner;      /* [caller's triangle] its number in ctx->original; -1: dropped; NULL: the same numbers */
    springls_material *out;
} springls__material_job;

/* Returns the correspondence of a vertex of the mesh, voxels. */
SPRINGLS__FN springls__v3 springls__mesh_correspondence(const springls__material_job *job, int vertex)
{
    return springls__world_to_original(job->ctx, job->mesh->correspondences + 3 * (size_t)vertex);
}

/* Finds the places of springls, or of vertices. Each search starts from the last hit, since neighbors in number are often neighbors
   in space. */
SPRINGLS__FN void springls__materials_task(void *arg, int begin, int end)
{
    const springls__material_job *job = (const springls__material_job *)arg;
    int guess = -1;
    for (; begin < end; begin++) {
        springls__v3 a = job->mesh ? springls__mesh_correspondence(job, begin) : job->ctx->model.set.a[begin];
        springls__surface_hit h = springls__surface_closest_from(&job->ctx->original, a, FLT_MAX, guess);
        job->out[begin] = springls__material_of(job->ctx, &h);
        guess = h.triangle;
    }
}

SPRINGLS_API springls_status springls_springl_materials(springls_context *ctx, springls_material *out)
{
    springls__material_job job;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(A)));
    if (!out && ctx->model.set.count) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "springl_materials: out is NULL");
    memset(&job, 0, sizeof job);
    job.ctx = ctx;
    job.out = out;
    springls__parallel(ctx, ctx->model.set.count, 64, springls__materials_task, &job);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_mesh_materials(springls_context *ctx, const springls_mesh *mesh, springls_material *out)
{
    springls__material_job job;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_mesh(ctx, mesh, out, "mesh_materials"));
    memset(&job, 0, sizeof job);
    job.ctx = ctx;
    job.mesh = mesh;
    job.out = out;
    springls__parallel(ctx, mesh->vertex_count, 64, springls__materials_task, &job);
    return SPRINGLS_OK;
}

/* ---- on one side of every seam ---- */

enum { SPRINGLS__PATCH = 256 };

/* Finds the closest place to each of three points on the part of the original surface that can be reached from triangle `start`
   without crossing a seam, through triangles within r of x (voxels). Searches breadth first, at most PATCH triangles. */
SPRINGLS__FN void springls__closest_in_patch(const springls__material_job *job, int start, springls__v3 x, float r,
                                             const springls__v3 points[3], springls__surface_hit best[3])
{
    const springls__surface *surface = &job->ctx->original;
    int patch[SPRINGLS__PATCH], count = 1, head, k, m, i;
    patch[0] = start;
    for (k = 0; k < 3; k++) {
        best[k].triangle = -1;
        best[k].hit.d2 = FLT_MAX;
    }
    for (head = 0; head < count; head++) {
        int inner = job->inner ? job->inner[patch[head]] : patch[head];
        if (inner >= 0) {
            springls__tri t = springls__surface_triangle(surface, inner);
            if (head > 0 && springls__tri_closest(t, x).d2 > r * r) continue;
            for (k = 0; k < 3; k++) {
                springls__tri_hit hit = springls__tri_closest(t, points[k]);
                if (hit.d2 >= best[k].hit.d2) continue;
                best[k].hit = hit;
                best[k].triangle = inner;
            }
        }
        for (m = 0; m < 3; m++) {
            int next = job->neighbors[3 * (size_t)patch[head] + (size_t)m];
            for (i = 0; i < count && patch[i] != next; i++) continue;
            if (next >= 0 && i == count && count < SPRINGLS__PATCH) patch[count++] = next;
        }
    }
}

/* Finds the places of the corners of a triangle on the side of every seam on which the place of its centroid lies. */
SPRINGLS__FN void springls__materials_of_corners(const springls__material_job *job, const int triangle[3], springls_material out[3])
{
    springls__surface_hit center, corner[3];
    springls__v3 points[3], x;
    springls_material start;
    float r = 0.0f;
    int k;
    for (k = 0; k < 3; k++) points[k] = springls__mesh_correspondence(job, triangle[k]);
    x = springls__scale(springls__add(springls__add(points[0], points[1]), points[2]), 1.0f / 3.0f);
    center = springls__surface_closest(&job->ctx->original, x, FLT_MAX);
    start = springls__material_of(job->ctx, &center);
    for (k = 0; k < 3; k++) {
        out[k] = start;
        r = springls__max(r, springls__length(springls__sub(points[k], x)));
    }
    if (start.triangle < 0) return;
    r = 1.5f * r + springls__sqrt(center.hit.d2) + 1e-3f;
    springls__closest_in_patch(job, start.triangle, center.hit.point, r, points, corner);
    for (k = 0; k < 3; k++) out[k] = springls__material_of(job->ctx, &corner[k]);
}

SPRINGLS__FN void springls__corner_materials_task(void *arg, int begin, int end)
{
    const springls__material_job *job = (const springls__material_job *)arg;
    for (; begin < end; begin++)
        springls__materials_of_corners(job, job->mesh->triangles + 3 * (size_t)begin, job->out + 3 * (size_t)begin);
}

SPRINGLS_API int springls_material_triangle_count(const springls_context *ctx) { return ctx ? ctx->original.given : 0; }

SPRINGLS_API springls_status springls_corner_materials(springls_context *ctx, const springls_mesh *mesh, const int *neighbors,
                                                       springls_material *out)
{
    springls__material_job job;
    int i, given;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_mesh(ctx, mesh, out, "corner_materials"));
    if (!neighbors) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "corner_materials: neighbors is NULL");
    given = springls_material_triangle_count(ctx);
    for (i = 0; i < 3 * given; i++)
        if (neighbors[i] < -1 || neighbors[i] >= given)
            return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "corner_materials: triangle %d has neighbor %d of %d", i / 3,
                                  neighbors[i], given);
    memset(&job, 0, sizeof job);
    if (ctx->original.source) {
        int *inner;
        SPRINGLS__TRY(springls__attribute_work(ctx, SPRINGLS__MERGE_TARGETS, (size_t)given, sizeof(int)));
        inner = (int *)ctx->attribute_memory[SPRINGLS__MERGE_TARGETS].data;
        for (i = 0; i < given; i++) inner[i] = -1;
        for (i = 0; i < ctx->original.count; i++) inner[ctx->original.source[i] / 2] = i;
        job.inner = inner;
    }
    job.ctx = ctx;
    job.mesh = mesh;
    job.neighbors = neighbors;
    job.out = out;
    springls__parallel(ctx, mesh->triangle_count, 32, springls__corner_materials_task, &job);
    return SPRINGLS_OK;
}

/* ---- seams ---- */

/* Holds a search for corners that agree in position and values. first: [corner] the first corner that agrees with it. */
typedef struct springls__seam_search {
    const float *positions, *values;
    const int *triangles;
    size_t stride;
    int channels, *first;
    springls__buffer memory[2];
} springls__seam_search;

SPRINGLS__FN bool springls__same_corner(const springls__seam_search *s, int a, int b)
{
    const float *p = springls__mesh_position(s->positions, s->stride, s->triangles[a]);
    const float *q = springls__mesh_position(s->positions, s->stride, s->triangles[b]);
    int c;
    if (p[0] != q[0] || p[1] != q[1] || p[2] != q[2]) return false;
    for (c = 0; c < s->channels; c++)
        if (s->values[(size_t)a * (size_t)s->channels + (size_t)c] != s->values[(size_t)b * (size_t)s->channels + (size_t)c])
            return false;
    return true;
}

/* Allocates the search's memory and writes s->first. */
SPRINGLS__FN springls_status springls__seam_corners(springls_context *ctx, springls__seam_search *s, int corners)
{
    size_t size = springls__table_size((size_t)corners), slot;
    int i, *table;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &s->memory[0], (size_t)corners, sizeof(int), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &s->memory[1], size, sizeof(int), 0));
    s->first = (int *)s->memory[0].data;
    table = (int *)s->memory[1].data;
    for (slot = 0; slot < size; slot++) table[slot] = -1;
    for (i = 0; i < corners; i++) {
        const float *p = springls__mesh_position(s->positions, s->stride, s->triangles[i]);
        slot = springls__hash3(springls__float_bits(p[0] + 0.0f), springls__float_bits(p[1] + 0.0f),
                               springls__float_bits(p[2] + 0.0f)) & (size - 1); /* + 0: -0 and 0 agree */
        while (table[slot] >= 0 && !springls__same_corner(s, table[slot], i)) slot = (slot + 1) & (size - 1);
        if (table[slot] < 0) table[slot] = i;
        s->first[i] = table[slot];
    }
    return SPRINGLS_OK;
}

/* Writes the neighbors: pairs half-edges with the same two ends, in either direction; a third one has no neighbor. */
SPRINGLS__FN void springls__seam_edges(springls__seam_search *s, int corners, int *neighbors)
{
    size_t size = springls__table_size((size_t)corners), slot;
    int i, *table = (int *)s->memory[1].data;
    for (slot = 0; slot < size; slot++) table[slot] = -1;
    for (i = 0; i < corners; i++) neighbors[i] = -1;
    for (i = 0; i < corners; i++) {
        int a = s->first[i], b = s->first[springls__mesh_next(i)], low = a < b ? a : b, high = a < b ? b : a;
        slot = springls__hash3((uint32_t)low, (uint32_t)high, 1u) & (size - 1);
        for (; table[slot] >= 0; slot = (slot + 1) & (size - 1)) {
            int c = s->first[table[slot]], d = s->first[springls__mesh_next(table[slot])];
            if ((c == a && d == b) || (c == b && d == a)) break;
        }
        if (table[slot] < 0) {
            table[slot] = i;
        } else if (neighbors[table[slot]] < 0) {
            neighbors[table[slot]] = i / 3;
            neighbors[i] = table[slot] / 3;
        }
    }
}

SPRINGLS__FN springls_status springls__find_seams(springls_context *ctx, springls__seam_search *s, int corners, int *neighbors)
{
    SPRINGLS__TRY(springls__seam_corners(ctx, s, corners));
    springls__seam_edges(s, corners, neighbors);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_find_seams(springls_context *ctx, const float *positions, int position_count, size_t stride,
                                                 const int *triangles, int triangle_count, const float *values, int channels,
                                                 int *neighbors)
{
    springls__seam_search search;
    springls_status status;
    int i;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (triangle_count < 0 || triangle_count > INT32_MAX / 6)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "find_seams: triangle_count %d is not in 0 to %d", triangle_count,
                              INT32_MAX / 6);
    if (channels < 0 || channels > SPRINGLS_MAX_CHANNELS)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "find_seams: channels %d is not in 0 to %d", channels,
                              SPRINGLS_MAX_CHANNELS);
    if (channels > 0 && !values) return springls__fail_null(ctx, "find_seams", "values");
    if (triangle_count > 0 && (!positions || !triangles || !neighbors))
        return springls__fail_null(ctx, "find_seams", !positions ? "positions" : !triangles ? "triangles" : "neighbors");
    if (stride == 0) stride = 3 * sizeof(float);
    if (stride < 3 * sizeof(float) || stride % sizeof(float))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "find_seams: a stride of %lu bytes, not 0 or a multiple of 4 from 12 on",
                              (unsigned long)stride);
    for (i = 0; i < 3 * triangle_count; i++)
        if (triangles[i] < 0 || triangles[i] >= position_count)
            return springls__fail(ctx, SPRINGLS_BAD_MESH, "triangle %d uses position %d of %d", i / 3, triangles[i],
                                  position_count);
    if (triangle_count == 0) return SPRINGLS_OK;
    memset(&search, 0, sizeof search);
    search.positions = positions;
    search.stride = stride;
    search.triangles = triangles;
    search.values = values;
    search.channels = channels;
    status = springls__find_seams(ctx, &search, 3 * triangle_count, neighbors);
    for (i = 0; i < 2; i++) springls__buffer_free(ctx, &search.memory[i]);
    return status;
}

/* ---- values at material coordinates ---- */

SPRINGLS_API springls_status springls_interpolate_material(const springls_material *places, int count, const float *values,
                                                           int channels, const int *triangles, int triangle_count, float *out)
{
    int i, k, c;
    if (count < 0 || channels < 1 || triangle_count < 0
        || (count > 0 && (!places || !values || !out))) return SPRINGLS_INVALID_ARGUMENT;
    for (i = 0; i < count; i++)
        if (places[i].triangle < -1 || places[i].triangle >= triangle_count) return SPRINGLS_INVALID_ARGUMENT;
    for (i = 0; i < count; i++, out += channels) {
        for (c = 0; c < channels; c++) out[c] = 0.0f;
        for (k = 0; k < 3 && places[i].triangle >= 0; k++) {
            size_t corner = 3 * (size_t)places[i].triangle + (size_t)k;
            const float *row = values + (triangles ? (size_t)triangles[corner] : corner) * (size_t)channels;
            for (c = 0; c < channels; c++) out[c] += places[i].barycentric[k] * row[c];
        }
    }
    return SPRINGLS_OK;
}

#endif
