#include "character/mesh_voxels.h"

#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>

static size_t voxel_at(const int size[3], int x, int y, int z)
{
    return ((size_t)z * (size_t)size[1] + (size_t)y) * (size_t)size[0] + (size_t)x;
}

/* ---- distance ---- */

struct flat { /* a triangle with what its distance needs */
    const float *corners[3];
    float edges[3][3], inverse[3]; /* from each corner to the next; 1 / their squared lengths */
    float normal[3];               /* of unit length */
};

static void flatten(const float *positions, const int *triangle, struct flat *f)
{
    for (int k = 0; k < 3; ++k) { f->corners[k] = positions + 3 * triangle[k]; }
    for (int k = 0; k < 3; ++k) {
        vec3_sub(f->corners[(k + 1) % 3], f->corners[k], f->edges[k]);
        const float square = vec3_dot(f->edges[k], f->edges[k]);
        f->inverse[k] = square > 0.0f ? 1.0f / square : 0.0f;
    }
    vec3_cross(f->edges[0], f->edges[1], f->normal);
    vec3_normalize(f->normal);
}

/* Returns the squared distance of a point from a triangle; height: of the point above its plane. */
static float square_distance(const struct flat *f, const float p[3], float height)
{
    float best = INFINITY;
    bool within = true;
    for (int k = 0; k < 3; ++k) {
        float d[3], side[3];
        vec3_sub(p, f->corners[k], d);
        vec3_cross(f->edges[k], d, side);
        if (vec3_dot(side, f->normal) >= 0.0f) { continue; }
        within = false; /* beyond this edge */
        vec3_add_scaled(d, -fmaxf(0.0f, fminf(1.0f, vec3_dot(d, f->edges[k]) * f->inverse[k])), f->edges[k], d);
        best = fminf(best, vec3_dot(d, d));
    }
    return within ? height * height : best;
}

/* Lowers squared distances near triangle `number`. */
static void spread_distance(const struct flat *f, const int size[3], float band, int number, float *square, int *nearest)
{
    int lo[3], hi[3];
    for (int i = 0; i < 3; ++i) {
        const float a = f->corners[0][i], b = f->corners[1][i], c = f->corners[2][i];
        lo[i] = (int)fmaxf(0.0f, ceilf(fminf(a, fminf(b, c)) - band));
        hi[i] = (int)fminf((float)size[i] - 1.0f, floorf(fmaxf(a, fmaxf(b, c)) + band));
    }
    for (int z = lo[2]; z <= hi[2]; ++z) {
        for (int y = lo[1]; y <= hi[1]; ++y) {
            for (int x = lo[0]; x <= hi[0]; ++x) {
                const float p[3] = {(float)x, (float)y, (float)z};
                const size_t at = voxel_at(size, x, y, z);
                float d[3];
                vec3_sub(p, f->corners[0], d);
                const float height = vec3_dot(d, f->normal);
                const float found = height * height < square[at] ? square_distance(f, p, height) : INFINITY;
                if (found < square[at]) {
                    square[at] = found;
                    if (nearest) { nearest[at] = number; }
                }
            }
        }
    }
}

/* ---- winding number ---- */

/* Returns on which side of the edge from a to b a column is, the same with either order of the two. */
static double edge_side(const float *positions, int a, int b, double x, double y)
{
    const float *p = positions + 3 * (a < b ? a : b), *q = positions + 3 * (a < b ? b : a);
    const double side = ((double)q[0] - (double)p[0]) * (y - (double)p[1]) - ((double)q[1] - (double)p[1]) * (x - (double)p[0]);
    return a < b ? side : -side;
}

/* Counts where columns along z cross a triangle: the winding number changes there. Columns are beside the voxels by a little, so
 * that none goes through a corner. */
static void cross_columns(const float *positions, const int *t, const int size[3], signed char *change)
{
    const double beside[2] = {1.234e-4, 3.217e-4};
    int lo[2], hi[2];
    for (int i = 0; i < 2; ++i) {
        const float a = positions[3 * t[0] + i], b = positions[3 * t[1] + i], c = positions[3 * t[2] + i];
        lo[i] = (int)fmaxf(0.0f, floorf(fminf(a, fminf(b, c))));
        hi[i] = (int)fminf((float)size[i] - 1.0f, ceilf(fmaxf(a, fmaxf(b, c))));
    }
    for (int y = lo[1]; y <= hi[1]; ++y) {
        for (int x = lo[0]; x <= hi[0]; ++x) {
            double sides[3], sum = 0.0, z = 0.0;
            for (int k = 0; k < 3; ++k) {
                sides[k] = edge_side(positions, t[(k + 1) % 3], t[(k + 2) % 3], x + beside[0], y + beside[1]);
                sum += sides[k];
            }
            const bool up = sides[0] > 0.0 && sides[1] > 0.0 && sides[2] > 0.0;
            if (!up && !(sides[0] < 0.0 && sides[1] < 0.0 && sides[2] < 0.0)) { continue; }
            for (int k = 0; k < 3; ++k) { z += sides[k] / sum * (double)positions[3 * t[k] + 2]; }
            const int first = (int)fmax(0.0, ceil(z));
            signed char *here = change + voxel_at(size, x, y, first < size[2] ? first : 0);
            if (first < size[2]) { *here = (signed char)(up ? *here - 1 : *here + 1); }
        }
    }
}

/* ---- both ---- */

bool mesh_voxels(const struct solid_grid *grid, const float *positions, const int *triangles, int triangle_count, float band,
                 float *phi, int *nearest)
{
    const int *size = grid->size;
    const size_t layer = (size_t)size[0] * (size_t)size[1], count = layer * (size_t)size[2];
    signed char *winding = calloc(count, 1);
    if (!winding) { return false; }
    for (size_t n = 0; n < count; ++n) {
        phi[n] = band * band;
        if (nearest) { nearest[n] = -1; }
    }
    for (int t = 0; t < triangle_count; ++t) {
        struct flat flat;
        flatten(positions, triangles + 3 * t, &flat);
        spread_distance(&flat, size, band, t, phi, nearest);
        cross_columns(positions, triangles + 3 * t, size, winding);
    }
    for (size_t n = layer; n < count; ++n) { winding[n] = (signed char)(winding[n] + winding[n - layer]); }
    for (size_t n = 0; n < count; ++n) { phi[n] = winding[n] > 0 ? -fmaxf(1e-4f, sqrtf(phi[n])) : sqrtf(phi[n]); }
    free(winding);
    return solid_extend(grid, phi, band);
}
