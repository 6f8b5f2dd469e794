/* keep_edges.h - keeps sharp edges sharp (params.keep_edges): a springl at a crease belongs to one side of it. Places stay
   exact when springls move; what wears off are normals, which neighbors across the crease turn, and whatever is averaged over
   both sides. */
#ifndef SPRINGLS__STAGES_KEEP_EDGES_H
#define SPRINGLS__STAGES_KEEP_EDGES_H

#include "../../kernels_embed/stages/keep_edges.h"
#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/parallel.h"
#include "../runtime/resumable.h"
#include "../model/cell_list.h"

enum {
    SPRINGLS__EDGES_NORMALS,
    SPRINGLS__EDGES_CANDIDATES,
    SPRINGLS__EDGES_SIDES,
    SPRINGLS__EDGES_TURN,
    SPRINGLS__EDGES_TURNED
};

/* Finds the springls at creases (edge), and the normal that each has on its side; with `search` in a model that has just been set
   (springls__edge_arguments), else it turns them, each about its particle, into their sides. */
SPRINGLS__FN springls_status springls__sort_sides(springls_context *ctx, bool search)
{
    const int count = ctx->model.set.count;
    springls__arguments args;
    switch (ctx->work.phase) {
    case SPRINGLS__EDGES_NORMALS:
        SPRINGLS__TRY(springls__cell_list_build(ctx));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, side_normal, count));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, edge_candidate, count));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, was_at_edge, count));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, edge_cells, 2 * (size_t)ctx->model.grid.slot_count));
        springls__loop(ctx, SPRINGLS__KERNEL_edge_normal, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__EDGES_CANDIDATES);
    case SPRINGLS__EDGES_CANDIDATES:
        args.edge.search = search;
        if (!search) springls__run(ctx, SPRINGLS__KERNEL_edge_cells, ctx->model.grid.slot_count, NULL);
        springls__loop(ctx, SPRINGLS__KERNEL_edge_candidate, count, &args);
        return springls__next_phase(ctx, SPRINGLS__EDGES_SIDES);
    case SPRINGLS__EDGES_SIDES:
        springls__loop(ctx, SPRINGLS__KERNEL_edge_side, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__EDGES_TURN);
    case SPRINGLS__EDGES_TURN:
        ctx->model.set.at_edges = springls__count_of(ctx, SPRINGLS__ARRAY_EDGE, count, 1);
        if (search) return SPRINGLS_OK;
        springls__loop(ctx, SPRINGLS__KERNEL_edge_turn, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__EDGES_TURNED);
    case SPRINGLS__EDGES_TURNED:
    default:
        ctx->omega_fresh = false;
        ctx->springl_surface_fresh = false;
        return SPRINGLS_OK;
    }
}

SPRINGLS__FN springls_status springls__sort_new_sides(springls_context *ctx) { return springls__sort_sides(ctx, true); }

/* Finds the edges of a model that has just been set. Later no others are searched for: what bends sharply in motion is no
   edge. */
SPRINGLS__FN springls_status springls__find_edges(springls_context *ctx)
{
    return springls__run_to_completion(ctx, springls__sort_new_sides);
}

/* Turns springls at a crease into their sides. */
SPRINGLS__FN springls_status springls__keep_edges(springls_context *ctx) { return springls__sort_sides(ctx, false); }

/* ---- initial springls ---- */

/* Returns the unit gradient of phi at a voxel: of central differences where those are as long as a distance's, else of the
   one-sided differences that are; 0 where none are. */
SPRINGLS__FN springls__v3 springls__unkinked_gradient(const springls__grid *g, int x, int y, int z)
{
    const float tolerance = 0.02f;
    float c = springls__grid_phi(g, g->phi, x, y, z), beside[6], off, least = tolerance;
    springls__v3 d, best = springls__v3_make(0.0f, 0.0f, 0.0f);
    int k;
    for (k = 0; k < 6; k++)
        beside[k] = springls__grid_phi(g, g->phi, x + (k == 1) - (k == 0), y + (k == 3) - (k == 2), z + (k == 5) - (k == 4));
    d = springls__scale(springls__v3_make(beside[1] - beside[0], beside[3] - beside[2], beside[5] - beside[4]), 0.5f);
    if (springls__fabs(springls__length(d) - 1.0f) < tolerance) return springls__normalize(d);
    for (k = 0; k < 8; k++) {
        d.x = k & 1 ? beside[1] - c : c - beside[0];
        d.y = k & 2 ? beside[3] - c : c - beside[2];
        d.z = k & 4 ? beside[5] - c : c - beside[4];
        off = springls__fabs(springls__length(d) - 1.0f);
        if (off >= least) continue;
        least = off;
        best = springls__normalize(d);
    }
    return best;
}

/* Collects the foot points and normals, on the surface about x, of the voxels on one side of the zero level, and of those close
   to it on the other. Distances inside a convex edge are exact, and those outside a concave one. */
SPRINGLS__FN void springls__gather_feet(const springls__grid *g, springls__v3 x, float radius, bool inside,
                                        springls__sample_set *samples)
{
    const float depth = 1.8f, on_surface = 0.25f; /* voxels; on the other side distances are exact so far */
    int lo[3], hi[3], i, j, k;
    lo[0] = (int)springls__floor(x.x - radius);
    lo[1] = (int)springls__floor(x.y - radius);
    lo[2] = (int)springls__floor(x.z - radius);
    for (i = 0; i < 3; i++) hi[i] = lo[i] + (int)(2.0f * radius) + 1;
    samples->count = 0;
    for (k = lo[2]; k <= hi[2]; k++)
        for (j = lo[1]; j <= hi[1]; j++)
            for (i = lo[0]; i <= hi[0]; i++) {
                float phi = springls__grid_phi(g, g->phi, i, j, k), weight;
                springls__v3 n, foot;
                if (springls__fabs(phi) > ((phi < 0.0f) == inside ? depth : on_surface)) continue;
                n = springls__unkinked_gradient(g, i, j, k);
                foot = springls__mad(springls__v3_make((float)i, (float)j, (float)k), n, -phi);
                weight = 1.0f - springls__length2(springls__sub(foot, x)) / (radius * radius);
                if (weight > 0.0f && springls__length2(n) > 0.5f)
                    springls__sample_set_add(samples, foot, n, foot, weight * weight, -2);
            }
}

/* Draws a corner of a triangle that sticks out beyond an edge back towards the particle. */
SPRINGLS__FN springls__v3 springls__draw_back(const springls__grid *g, springls__v3 p, springls__v3 q)
{
    const float out = 0.1f; /* voxel */
    int i;
    for (i = 0; i < 5 && springls__fabs(springls__grid_sample(g, g->phi, q)) > out; i++) q = springls__lerp(p, q, 0.6f);
    return q;
}

/* Moves a springl that cuts across a crease to one side of it; false when there is no crease. */
SPRINGLS__FN bool springls__initial_side(const springls__grid *g, springls__springl *s, uint8_t *edge)
{
    const float radius = 2.5f, slack = 0.4f; /* voxels; marching cubes cuts off no more of a corner */
    springls__v3 n = springls__springl_normal(*s);
    springls__sample_set samples;
    springls__sides sides;
    springls__fit_result fit;
    int outside, m;
    for (outside = 0; outside < 2; outside++) {
        springls__gather_feet(g, s->p, radius, !outside, &samples);
        sides = springls__sample_set_sides(&samples, 0.0f, false);
        if (sides.count < 1 || (outside && sides.count < 2)) continue;
        fit = springls__side_at(&samples, sides, s->p, n, s->p, -1, outside ? SPRINGLS__CONCAVE : SPRINGLS__CONVEX, 1);
        if (!fit.ok || springls__length2(springls__sub(fit.point, s->p)) > slack * slack) continue;
        for (m = 0; m < 3; m++)
            s->q[m] = springls__add(fit.point, springls__turn_to(springls__sub(s->q[m], s->p), n, fit.normal));
        s->p = fit.point;
        for (m = 0; m < 3; m++) s->q[m] = springls__draw_back(g, s->p, s->q[m]);
        *s = springls__springl_finished(*s);
        *edge = sides.count > 1;
        return true;
    }
    return false;
}

/* Returns the gradient of phi at a voxel by central differences. */
SPRINGLS__FN springls__v3 springls__voxel_gradient(const springls__grid *g, int x, int y, int z)
{
    return springls__v3_make(0.5f * (springls__grid_phi(g, g->phi, x + 1, y, z) - springls__grid_phi(g, g->phi, x - 1, y, z)),
                             0.5f * (springls__grid_phi(g, g->phi, x, y + 1, z) - springls__grid_phi(g, g->phi, x, y - 1, z)),
                             0.5f * (springls__grid_phi(g, g->phi, x, y, z + 1) - springls__grid_phi(g, g->phi, x, y, z - 1)));
}

/* Returns true where phi has a kink near one of the eight voxels about x: interpolation of third order is wrong there. The slope is
   less than 1 by a tenth at a crease of 50 degrees, and by less where a smooth surface bends with a radius of three voxels. */
SPRINGLS__FN bool springls__has_kink(const springls__grid *g, springls__v3 x)
{
    const float least = 0.06f;
    int i = (int)springls__floor(x.x), j = (int)springls__floor(x.y), k = (int)springls__floor(x.z), c;
    for (c = 0; c < 8; c++) {
        springls__v3 gradient = springls__voxel_gradient(g, i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
        if (springls__fabs(springls__length(gradient) - 1.0f) > least) return true;
    }
    return false;
}

SPRINGLS__FN void springls__initial_edges_task(void *arg, int begin, int end)
{
    springls_context *ctx = (springls_context *)arg;
    for (; begin < end; begin++) {
        springls__springl *s = &ctx->model.set.s[begin];
        if (springls__has_kink(&ctx->model.grid, s->p)
            && springls__initial_side(&ctx->model.grid, s, &ctx->model.set.edge[begin])) {
            ctx->model.set.a[begin] = s->p;
            ctx->model.set.synced_position[begin] = s->p;
        }
    }
}

/* Moves the initial springls of a level set that cut across a crease to one side of it. */
SPRINGLS__FN void springls__initial_edges(springls_context *ctx)
{
    springls__parallel(ctx, ctx->model.set.count, 64, springls__initial_edges_task, ctx);
    ctx->model.set.at_edges = springls__count_of(ctx, SPRINGLS__ARRAY_EDGE, ctx->model.set.count, 1);
}

#endif
