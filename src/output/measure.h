/* measure.h - measures volume, area and topology of the zero level; returns the statistics and the state hash. */
#ifndef SPRINGLS__OUTPUT_MEASURE_H
#define SPRINGLS__OUTPUT_MEASURE_H

#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/residency.h"
#include "../model/host_access.h"
#include "../model/mesh_measure.h"
#include "../model/transform.h"
#include "../solver/step.h"
#include "isosurface.h"

/* Converts voxels to the world as if the window had not moved: far away a float has too few digits for an area or a volume. */
SPRINGLS__FN void springls__to_near_world(const springls_context *ctx, const float *voxel, int count, float *world)
{
    double x[3];
    int i, k;
    for (i = 0; i < count; i++, voxel += 3, world += 3) {
        springls__transform(ctx->lattice_to_world, (double)voxel[0], (double)voxel[1], (double)voxel[2], x);
        for (k = 0; k < 3; k++) world[k] = (float)x[k];
    }
}

/* Sums the areas of all springls, world units. */
SPRINGLS__FN double springls__springls_area(const springls_context *ctx)
{
    double sum = 0.0;
    float q[9];
    int i, k;
    for (i = 0; i < ctx->model.set.count; i++) {
        double u[3], v[3], n2 = 0.0;
        springls__to_near_world(ctx, &ctx->model.set.s[i].q[0].x, 3, q);
        for (k = 0; k < 3; k++) {
            u[k] = (double)q[3 + k] - (double)q[k];
            v[k] = (double)q[6 + k] - (double)q[k];
        }
        for (k = 0; k < 3; k++) {
            const double n = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
            n2 += n * n;
        }
        sum += 0.5 * sqrt(n2);
    }
    return sum;
}

SPRINGLS_API springls_status springls_measure(springls_context *ctx, springls_measures *out)
{
    springls__raw_mesh raw;
    springls__mesh_report report;
    int k;
    if (out) memset(out, 0, sizeof *out);
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!out) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "measure: out is NULL");
    SPRINGLS__TRY(springls__begin_reading(ctx));
    springls__use_device(ctx);
    SPRINGLS__TRY(springls__report_device_failure(ctx, springls__watertight_mesh(ctx, &raw)));
    if (raw.vertex_count == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, mesh_half_edges, (size_t)raw.triangle_count * 3));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, mesh_parent, raw.vertex_count));
    springls__to_near_world(ctx, &raw.positions[0].x, raw.vertex_count, &raw.positions[0].x);
    springls__mesh_measure(&raw.positions[0].x, raw.vertex_count, raw.triangles, raw.triangle_count,
                           springls__mesh_parent(&ctx->model), springls__mesh_half_edges(&ctx->model), &report);
    out->volume = springls__is_mirrored(ctx) ? -report.volume : report.volume;
    out->area = report.area;
    for (k = 0; k < 3; k++) {
        double moved = ctx->window.to_world[4 * k + 3] - ctx->lattice_to_world[4 * k + 3];
        out->lower[k] = (float)((double)report.lo[k] + moved);
        out->upper[k] = (float)((double)report.hi[k] + moved);
    }
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(S)));
    out->coverage = report.area > 0.0 ? springls__springls_area(ctx) / report.area : 0.0;
    out->components = report.components;
    out->euler = report.euler;
    return SPRINGLS_OK;
}

SPRINGLS_API springls_stats springls_get_stats(const springls_context *ctx)
{
    springls_stats stats;
    memset(&stats, 0, sizeof stats);
    if (!ctx) return stats;
    stats = ctx->stats;
    stats.springls = ctx->model.set.count;
    stats.at_edges = ctx->model.set.at_edges;
    stats.bricks = ctx->model.grid.active_count;
    return stats;
}

SPRINGLS_API uint64_t springls_state_hash(const springls_context *ctx)
{
    uint64_t hash = SPRINGLS__HASH_BEGIN;
    int i, v;
    if (!ctx) return 0;
    if (ctx->step.chunks) springls__finish_step((springls_context *)ctx); /* phi has followed in part */
    springls__end_reading((springls_context *)ctx);
    springls__ensure_on_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | SPRINGLS__BIT(ID) | SPRINGLS__BIT(ACTIVE)
                             | SPRINGLS__BIT(SLOT_BRICK) | SPRINGLS__BIT(PHI));
    if (!springls__is_unmoved(&ctx->window)) hash = springls__hash(hash, ctx->window.offset, sizeof ctx->window.offset);
    for (i = 0; i < ctx->model.set.count; i++) hash = springls__hash(hash, &ctx->model.set.s[i], sizeof ctx->model.set.s[i]);
    hash = springls__hash(hash, ctx->model.set.a, (size_t)ctx->model.set.count * sizeof *ctx->model.set.a);
    hash = springls__hash(hash, ctx->model.set.id, (size_t)ctx->model.set.count * sizeof *ctx->model.set.id);
    for (i = 0; i < ctx->model.grid.active_count; i++) { /* in brick order; voxels of the domain only */
        int slot = ctx->model.grid.active[i], o[3], at[3];
        springls__slot_origin(&ctx->model.grid, slot, o);
        hash = springls__hash(hash, &ctx->model.grid.slot_brick[slot], sizeof(int));
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            springls__voxel_of_brick(o, v, at);
            if (springls__grid_contains(&ctx->model.grid, at[0], at[1], at[2]))
                hash = springls__hash(hash, &ctx->model.grid.phi[(size_t)slot * SPRINGLS__BRICK_VOXELS + (size_t)v],
                                      sizeof(float));
        }
    }
    return hash;
}

#endif
