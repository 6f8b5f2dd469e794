#include "character/mesh_voxels.h"

#include "base/threads.h"
#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>

static size_t voxel_at(const int size[3], int x, int y, int z)
{
    return ((size_t)z * (size_t)size[1] + (size_t)y) * (size_t)size[0] + (size_t)x;
}

/* Layers along z that are computed at a time. */
struct slab {
    int begin, end;
};

enum { SLAB = 12 };

/* Finds the least and the largest coordinate of three corners. */
static void span(const float *const corners[3], int axis, float *least, float *most)
{
    const float a = corners[0][axis], b = corners[1][axis], c = corners[2][axis];
    *least = a < b ? (a < c ? a : c) : (b < c ? b : c);
    *most = a > b ? (a > c ? a : c) : (b > c ? b : c);
}

/* Finds the voxels first..last that are among the corners, or up to `margin` beyond. */
static void range_of(const float *const corners[3], int axis, float margin, int first, int last, int *lo, int *hi)
{
    float least, most;
    span(corners, axis, &least, &most);
    *lo = least - margin > (float)first ? (int)ceilf(least - margin) : first;
    *hi = most + margin < (float)last ? (int)floorf(most + margin) : last;
}

/* ---- distance ---- */

struct flat { /* a triangle with what its distance needs */
    const float *corners[3];
    float edges[3][3], inverse[3]; /* from each corner to the next; 1 / their squared lengths */
    float normal[3];               /* of unit length */
    float inwards[3][3];           /* from each edge to the inside, in the triangle's plane */
};

static void flatten(struct flat *f)
{
    for (int k = 0; k < 3; ++k) {
        vec3_sub(f->corners[(k + 1) % 3], f->corners[k], f->edges[k]);
        const float square = vec3_dot(f->edges[k], f->edges[k]);
        f->inverse[k] = square > 0.0f ? 1.0f / square : 0.0f;
    }
    vec3_cross(f->edges[0], f->edges[1], f->normal);
    vec3_normalize(f->normal);
    for (int k = 0; k < 3; ++k) { vec3_cross(f->normal, f->edges[k], f->inwards[k]); }
}

/* Returns the squared distance of a point from a triangle; height: of the point above its plane. */
static float square_distance(const struct flat *f, const float p[3], float height)
{
    float best = INFINITY;
    bool within = true;
    for (int k = 0; k < 3; ++k) {
        float d[3];
        vec3_sub(p, f->corners[k], d);
        if (vec3_dot(d, f->inwards[k]) >= 0.0f) { continue; }
        within = false; /* beyond this edge */
        const float along = vec3_dot(d, f->edges[k]) * f->inverse[k];
        vec3_add_scaled(d, along < 0.0f ? 0.0f : along > 1.0f ? -1.0f : -along, f->edges[k], d);
        const float square = vec3_dot(d, d);
        best = square < best ? square : best;
    }
    return within ? height * height : best;
}

/* Lowers squared distances near triangle `number`. */
static void spread_distance(struct flat *f, const int size[3], const struct slab *slab, float band, int number, float *square,
                            int *nearest)
{
    int lo[3], hi[3];
    range_of(f->corners, 2, band, slab->begin, slab->end - 1, &lo[2], &hi[2]);
    if (lo[2] > hi[2]) { return; }
    for (int i = 0; i < 2; ++i) { range_of(f->corners, i, band, 0, size[i] - 1, &lo[i], &hi[i]); }
    flatten(f);
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
                    nearest[at] = number;
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

/* Counts where columns along z cross a triangle: the winding number changes in the layer above, or in the first one. Columns are
 * beside the voxels by a little, so that none goes through a corner. */
static void cross_columns(const float *positions, const int *t, const struct flat *f, const int size[3], const struct slab *slab,
                          signed char *change)
{
    const double beside[2] = {1.234e-4, 3.217e-4};
    int lo[2], hi[2];
    float bottom, top;
    span(f->corners, 2, &bottom, &top);
    if ((slab->begin > 0 && top <= (float)(slab->begin - 1)) || bottom > (float)(slab->end - 1)) { return; }
    for (int i = 0; i < 2; ++i) { range_of(f->corners, i, 0.01f, 0, size[i] - 1, &lo[i], &hi[i]); }
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
            const int first = z > 0.0 ? (int)ceil(z) : 0;
            if (first < slab->begin || first >= slab->end) { continue; }
            signed char *here = change + voxel_at(size, x, y, first);
            *here = (signed char)(up ? *here - 1 : *here + 1);
        }
    }
}

/* ---- both ---- */

/* Computes squared distances, at most band * band, and changes of the winding number in the layers of a slab. */
static void scan_slab(const int size[3], const struct slab *slab, const float *positions, const int *triangles,
                      int triangle_count, float band, float *square, int *nearest, signed char *change)
{
    for (size_t n = voxel_at(size, 0, 0, slab->begin); n < voxel_at(size, 0, 0, slab->end); ++n) {
        square[n] = band * band;
        nearest[n] = -1;
    }
    for (int t = 0; t < triangle_count; ++t) {
        struct flat flat;
        for (int k = 0; k < 3; ++k) { flat.corners[k] = positions + 3 * triangles[3 * t + k]; }
        spread_distance(&flat, size, slab, band, t, square, nearest);
        cross_columns(positions, triangles + 3 * t, &flat, size, slab, change);
    }
}

struct slab_loop {
    const int *size;
    const float *positions;
    const int *triangles;
    int triangle_count;
    float band;
    float *phi;
    int *nearest;
    signed char *winding;
};

static void run_slab_loop(void *arg, int begin, int end)
{
    const struct slab_loop *loop = arg;
    const int *size = loop->size;
    const float *positions = loop->positions;
    const int *triangles = loop->triangles;
    const int triangle_count = loop->triangle_count;
    const float band = loop->band;
    float *phi = loop->phi;
    int *nearest = loop->nearest;
    signed char *winding = loop->winding;
    for (int z = begin * SLAB; z < size[2] && z < end * SLAB; z += SLAB) {
        const struct slab slab = {z, z + SLAB < size[2] ? z + SLAB : size[2]};
        scan_slab(size, &slab, positions, triangles, triangle_count, band, phi, nearest, winding);
    }
}

struct column_loop {
    const int *size;
    size_t layer;
    float *phi;
    signed char *winding;
};

static void run_column_loop(void *arg, int begin, int end)
{
    const struct column_loop *loop = arg;
    const int *size = loop->size;
    const size_t layer = loop->layer;
    float *phi = loop->phi;
    signed char *winding = loop->winding;
    for (int y = begin; y < end; ++y) {
        for (int z = 0; z < size[2]; ++z) {
            const size_t row = voxel_at(size, 0, y, z);
            for (size_t n = row; n < row + (size_t)size[0]; ++n) {
                const float far = sqrtf(phi[n]);
                winding[n] = (signed char)(winding[n] + (z > 0 ? winding[n - layer] : 0));
                phi[n] = winding[n] > 0 ? -(far > 1e-4f ? far : 1e-4f) : far;
            }
        }
    }
}

bool mesh_voxels(const struct solid_grid *grid, const float *positions, const int *triangles, int triangle_count, float band,
                 float *phi, int *nearest)
{
    const int *size = grid->size;
    const size_t layer = (size_t)size[0] * (size_t)size[1];
    signed char *winding = calloc(layer * (size_t)size[2], 1);
    if (!winding) { return false; }
    struct slab_loop slabs = {size, positions, triangles, triangle_count, band, phi, nearest, winding};
    threads_for((size[2] + SLAB - 1) / SLAB, 1, run_slab_loop, &slabs);
    struct column_loop columns = {size, layer, phi, winding};
    threads_for(size[1], 1, run_column_loop, &columns);
    free(winding);
    return solid_extend(grid, phi, band);
}
