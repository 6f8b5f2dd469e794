/* metric_grids.h - grids whose lengths are not those of voxels, and balls on them. */
#ifndef METRIC_GRIDS_H
#define METRIC_GRIDS_H

#include "fixtures.h"

enum { CUBES, FLAT, OBLIQUE, LEFT_HANDED, GRIDS };

#define CENTER 30.0f

/* Returns the default parameters, with the zero level as mesh. */
FIXTURE springls_params level_set_params(void)
{
    springls_params params = springls_default_params();
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    return params;
}

/* Describes a model about the place (30, 30, 30) of the world: on cubes of 1, on voxels of 1 x 1 x 3, with axes that are oblique by
   20 degrees, or turned and mirrored with three spacings. params NULL: level_set_params(). */
FIXTURE springls_desc desc_on(int grid, const springls_params *params)
{
    static const double direction[GRIDS][9] = { { 1, 0, 0, 0, 1, 0, 0, 0, 1 },
                                                { 1, 0, 0, 0, 1, 0, 0, 0, 1 },
                                                { 1, 0.34202014, 0, 0, 0.93969262, 0.34202014, 0, 0, 0.93969262 },
                                                { 0.8, -0.36, -0.48, 0.6, 0.48, 0.64, 0, 0.8, -0.6 } };
    static const double spacing[GRIDS][3] = { { 1, 1, 1 }, { 1, 1, 3 }, { 1, 1.2, 1.5 }, { 1, 1.5, 2.4 } };
    static springls_params usual;
    springls_desc desc;
    int k, c;
    usual = level_set_params();
    desc = fixture_desc(48, params ? params : &usual);
    for (k = 0; k < 3; k++) {
        desc.grid.spacing[k] = spacing[grid][k];
        desc.grid.origin[k] = (double)CENTER;
        for (c = 0; c < 3; c++) desc.grid.direction[3 * k + c] = direction[grid][3 * k + c];
    }
    for (k = 0; k < 3; k++)
        for (c = 0; c < 3; c++) desc.grid.origin[k] -= 23.5 * desc.grid.direction[3 * k + c] * desc.grid.spacing[c];
    return desc;
}

FIXTURE springls_context *context_on(int grid, const springls_params *params)
{
    const springls_desc desc = desc_on(grid, params);
    springls_context *ctx = NULL;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return NULL;
    return ctx;
}

FIXTURE springls_context *ball_on(int grid, const springls_params *params, float radius)
{
    springls_sphere ball = { { CENTER, CENTER, CENTER }, 0.0f };
    springls_context *ctx = context_on(grid, params);
    ball.radius = radius;
    if (ctx && springls_set_implicit(ctx, springls_implicit_sphere, &ball) != SPRINGLS_OK) {
        springls_destroy(ctx);
        ctx = NULL;
    }
    return ctx;
}

/* Returns row i of a view in the world. */
FIXTURE springls__v3 world_of(springls_context *ctx, springls_view view, int i)
{
    springls__v3 x;
    springls_to_world(ctx, (const float *)(const void *)((const char *)view.data + (size_t)i * view.stride), 1, &x.x);
    return x;
}

/* Fails unless the zero level is a ball of the radius, and the springls are on it; corners of triangles are not. */
FIXTURE enum greatest_test_res check_ball(springls_context *ctx, double radius)
{
    const d3 middle = d3_make((double)CENTER, (double)CENTER, (double)CENTER);
    springls_mesh mesh;
    double sum = 0.0, sum2 = 0.0, particles = 0.0;
    int i;
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    ASSERT_GT(mesh.vertex_count, 0);
    for (i = 0; i < mesh.vertex_count; i++) {
        const double off = d3_distance(d3_of(springls__load3(mesh.positions + 3 * i)), middle) - radius;
        sum += off;
        sum2 += off * off;
    }
    for (i = 0; i < springls_count(ctx); i++)
        particles += d3_distance(d3_of(world_of(ctx, springls_view_particles(ctx), i)), middle) - radius;
    ASSERT_IN_RANGE(0.0, sum / mesh.vertex_count, 0.05);
    ASSERT_IN_RANGE(0.0, particles / springls_count(ctx), 0.06);
    ASSERT_IN_RANGE(0.0, sqrt(sum2 / mesh.vertex_count), 0.07);
    springls_mesh_free(ctx, &mesh);
    PASS();
}

/* Turns the ball about the z axis, each height at its own speed. */
FIXTURE void swirl(void *user, const float *points, int count, float time, float *out)
{
    (void)user, (void)time;
    for (; count-- > 0; points += 3, out += 3) {
        const float z = (points[2] - CENTER) * 0.1f;
        out[0] = -(points[1] - CENTER) * z * 0.1f;
        out[1] = (points[0] - CENTER) * z * 0.1f;
        out[2] = 0.0f;
    }
}

/* Writes how far inside the ball of 16 each voxel's centre is, world units. */
FIXTURE float *depths_on(springls_context *ctx)
{
    const int n = 48;
    float *depth = (float *)malloc(sizeof *depth * (size_t)(n * n * n));
    int i;
    for (i = 0; i < n * n * n; i++) {
        float voxel[3], world[3];
        voxel[0] = (float)(i % n);
        voxel[1] = (float)(i / n % n);
        voxel[2] = (float)(i / n / n);
        springls_to_world(ctx, voxel, 1, world);
        depth[i] = 16.0f - (float)d3_distance(d3_of(springls__load3(world)), d3_make((double)CENTER, (double)CENTER, (double)CENTER));
    }
    return depth;
}

/* Bits are the same in every build: without SIMD, and on a device, one grid is enough, the one that has all that is odd. */
FIXTURE int first_grid(void)
{
#ifdef SPRINGLS_NO_SIMD
    return LEFT_HANDED;
#else
    return fixture_backend() ? LEFT_HANDED : CUBES;
#endif
}

#endif
