/* set_mesh.h - a mesh that tests of springls_set_mesh build up, the model that comes of it, and how far that is from what it
   should be. */
#ifndef SET_MESH_H
#define SET_MESH_H

#include "../fixtures.h"
#include "../../src/model/winding_number.h"

/* ---- meshes ---- */

enum { MAX_POSITIONS = 400000, MAX_TRIANGLES = 800000 };
static float position[3 * MAX_POSITIONS];
static int triangle[3 * MAX_TRIANGLES];
static int positions, triangles;

FIXTURE void add_position(double x, double y, double z)
{
    position[3 * positions] = (float)x;
    position[3 * positions + 1] = (float)y;
    position[3 * positions + 2] = (float)z;
    positions++;
}

FIXTURE void add_triangle(int a, int b, int c)
{
    triangle[3 * triangles] = a;
    triangle[3 * triangles + 1] = b;
    triangle[3 * triangles + 2] = c;
    triangles++;
}

FIXTURE void turn_triangle(int t)
{
    int swap = triangle[3 * t + 1];
    triangle[3 * t + 1] = triangle[3 * t + 2];
    triangle[3 * t + 2] = swap;
}

FIXTURE void clear_mesh(void) { positions = triangles = 0; }

/* Rings of latitude from pole to pole; rings above `rings` * share are left out when share < 1: an open bowl. */
FIXTURE void add_sphere(double cx, double cy, double cz, double r, int around, int rings, double share)
{
    const double pi = 3.14159265358979;
    int south = positions, i, j, kept = (int)(rings * share);
    add_position(cx, cy, cz - r);
    for (j = 1; j < rings; j++)
        for (i = 0; i < around; i++)
            add_position(cx + r * sin(pi * j / rings) * cos(2 * pi * i / around),
                         cy + r * sin(pi * j / rings) * sin(2 * pi * i / around), cz - r * cos(pi * j / rings));
    add_position(cx, cy, cz + r);
    for (i = 0; i < around; i++) add_triangle(south, south + 1 + (i + 1) % around, south + 1 + i);
    for (j = 1; j < rings - 1 && j < kept; j++)
        for (i = 0; i < around; i++) {
            int a = south + 1 + (j - 1) * around + i, b = south + 1 + (j - 1) * around + (i + 1) % around;
            add_triangle(a, b, b + around);
            add_triangle(a, b + around, a + around);
        }
    for (i = 0; i < around && kept >= rings; i++)
        add_triangle(positions - 1, positions - 1 - around + i, positions - 1 - around + (i + 1) % around);
}

FIXTURE void add_torus(double c, double major, double minor, int around, int rings)
{
    const double pi = 3.14159265358979;
    int base = positions, i, j;
    for (j = 0; j < rings; j++)
        for (i = 0; i < around; i++) {
            double r = major + minor * cos(2 * pi * j / rings);
            add_position(c + r * cos(2 * pi * i / around), c + r * sin(2 * pi * i / around), c + minor * sin(2 * pi * j / rings));
        }
    for (j = 0; j < rings; j++)
        for (i = 0; i < around; i++) {
            int a = base + j * around + i, b = base + j * around + (i + 1) % around;
            int d = base + (j + 1) % rings * around + i, e = base + (j + 1) % rings * around + (i + 1) % around;
            add_triangle(a, b, e);
            add_triangle(a, e, d);
        }
}

/* A box of twelve triangles, turned about its center by |turn| radians. */
FIXTURE void add_box(d3 center, d3 half, d3 turn)
{
    static const int face[36] = { 0,2,3, 0,3,1, 4,5,7, 4,7,6, 0,1,5, 0,5,4, 2,6,7, 2,7,3, 0,4,6, 0,6,2, 1,3,7, 1,7,5 };
    int base = positions, i;
    for (i = 0; i < 8; i++) {
        d3 x = d3_add(center, d3_rotate(d3_make(i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z),
                                        turn));
        add_position(x.x, x.y, x.z);
    }
    for (i = 0; i < 12; i++) add_triangle(base + face[3 * i], base + face[3 * i + 1], base + face[3 * i + 2]);
}

FIXTURE double mesh_volume(void)
{
    double v = 0.0;
    int t;
    for (t = 0; t < triangles; t++) {
        const float *a = position + 3 * triangle[3 * t], *b = position + 3 * triangle[3 * t + 1],
                    *c = position + 3 * triangle[3 * t + 2];
        v += (double)a[0] * ((double)b[1] * (double)c[2] - (double)b[2] * (double)c[1])
             + (double)a[1] * ((double)b[2] * (double)c[0] - (double)b[0] * (double)c[2])
             + (double)a[2] * ((double)b[0] * (double)c[1] - (double)b[1] * (double)c[0]);
    }
    return v / 6.0;
}

/* ---- contexts ---- */

static springls_context *ctx;
static springls_mesh_report report;
static char warning[256];

FIXTURE void keep_warning(void *user, int level, const char *message)
{
    (void)user;
    if (level == 2) snprintf(warning, sizeof warning, "%s", message);
}

FIXTURE springls_desc cube(int size)
{
    springls_desc desc = fixture_desc(size, NULL);
    desc.logger.log = keep_warning;
    warning[0] = 0;
    return desc;
}

FIXTURE springls_status set_mesh(const springls_desc *desc)
{
    springls_status status = springls_create(desc, &ctx);
    if (status != SPRINGLS_OK) return status;
    status = springls_set_mesh(ctx, position, positions, 0, triangle, triangles, &report);
    fixture_here(ctx); /* to be looked at */
    return status;
}

FIXTURE float *level_set(void)
{
    const int *size = ctx->model.grid.size;
    float *phi = (float *)malloc((size_t)size[0] * (size_t)size[1] * (size_t)size[2] * sizeof *phi);
    if (phi && springls_copy_level_set(ctx, phi) != SPRINGLS_OK) { free(phi); phi = NULL; }
    return phi;
}

/* Voxels inside, those at the surface by the share that a plane at distance phi leaves. */
FIXTURE double inside_volume(const float *phi)
{
    size_t i, n = (size_t)ctx->model.grid.size[0] * (size_t)ctx->model.grid.size[1] * (size_t)ctx->model.grid.size[2];
    double v = 0.0;
    for (i = 0; i < n; i++) {
        double x = 0.5 - (double)phi[i];
        v += x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x;
    }
    return v;
}

/* Largest difference from a sphere's distance, both clamped at `clamp`. */
FIXTURE double sphere_error(const float *phi, double c, double r, double clamp)
{
    int x, y, z, n = ctx->model.grid.size[0];
    double worst = 0.0;
    for (z = 0; z < n; z++)
        for (y = 0; y < n; y++)
            for (x = 0; x < n; x++) {
                double d = sqrt((x - c) * (x - c) + (y - c) * (y - c) + (z - c) * (z - c)) - r;
                double p = (double)phi[x + n * (y + n * z)];
                d = d > clamp ? clamp : d < -clamp ? -clamp : d;
                p = p > clamp ? clamp : p < -clamp ? -clamp : p;
                if (fabs(p - d) > worst) worst = fabs(p - d);
            }
    return worst;
}

static uint32_t random_state = 1u;
FIXTURE double random_unit(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (double)(random_state >> 8) / 16777216.0;
}

#endif
