/* initial_edges.h - moves the initial springls of a level set that cut across a crease to one side of it: marching cubes cuts sharp
   edges off. */
#ifndef SPRINGLS__INPUT_INITIAL_EDGES_H
#define SPRINGLS__INPUT_INITIAL_EDGES_H

#include "../../kernels_embed/stages/keep_edges.h"
#include "../runtime/launch.h"
#include "../runtime/parallel.h"
#include "../model/grid.h"

/* Returns the unit gradient of phi at a voxel: by central differences if their length is about 1, as a distance's is; else by one-sided
   differences whose length is; 0 if there are none. */
SPRINGLS__FN springls__v3 springls__unkinked_gradient(const springls__grid *g, int x, int y, int z)
{
    const float tolerance = 0.02f;
    const int at[3] = { x, y, z };
    float c = springls__grid_phi(g, g->phi, x, y, z), beside[6], off, least = tolerance;
    springls__v3 d, best = springls__v3_make(0.0f, 0.0f, 0.0f);
    int k, to[3];
    for (k = 0; k < 6; k++) {
        springls__neighbor_voxel(at, k, to);
        beside[k] = springls__grid_phi(g, g->phi, to[0], to[1], to[2]);
    }
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

/* Pulls a corner of a triangle back towards the particle if the corner sticks out beyond an edge. */
SPRINGLS__FN springls__v3 springls__draw_back(const springls__grid *g, springls__v3 p, springls__v3 q)
{
    const float out = 0.1f; /* voxel */
    int i;
    for (i = 0; i < 5 && springls__fabs(springls__grid_sample(g, g->phi, q)) > out; i++) q = springls__lerp(p, q, 0.6f);
    return q;
}

/* Returns whether a foot near a springl, which faces n, is turned from it in the world by half of what sides are apart. Voxels that are
   longer along one axis draw a ball out until it has kinks. */
SPRINGLS__FN bool springls__feet_turn(springls__metric metric, const springls__sample_set *samples, springls__v3 n)
{
    const float near_by = 0.25f, alike = 0.906f; /* within 1.8 voxels; cosine of 25 degrees */
    int i;
    if (springls__is_uniform(metric)) return true;
    for (i = 0; i < samples->count; i++)
        if (samples->weight[i] > near_by && springls__turned_in_world(metric, n, samples->n[i], alike)) return true;
    return false;
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
        if (!springls__feet_turn(g->metric, &samples, n)) continue;
        sides = springls__sample_set_sides(&samples, g->metric, 0.0f, false);
        if (sides.count < 1 || (outside && sides.count < 2)) continue;
        fit = springls__side_at(&samples, &sides, s->p, n, s->p, -1, outside ? SPRINGLS__CONCAVE : SPRINGLS__CONVEX, 1);
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

/* Returns true if phi has a kink near one of the eight voxels about x: interpolation of third order is wrong there. The slope is
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
