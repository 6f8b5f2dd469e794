/* coverage.c - how much of the zero level lies in springls. */
#include "springls/coverage.h"

#include "base/threads.h"

#include <math.h>
#include <stdlib.h>

/* Springls by the cell of two voxels that their middle lies in; cells `side` cells apart share a list. */
enum { LEAST_SIDE = 64, MOST_SIDE = 256 };

struct cells {
    springls_view springls;
    int side; /* a power of two */
    int *first, *next; /* of every list; of every springl. -1: none */
};

static const float *corners_of(const struct cells *cells, int springl)
{
    return (const float *)(const void *)((const char *)cells->springls.data + (size_t)springl * cells->springls.stride);
}

static int cell_along(double x) { return (int)floor(0.5 * x); }

static int list_at(const struct cells *cells, int x, int y, int z)
{
    const int side = cells->side, mask = side - 1;
    return ((z & mask) * side + (y & mask)) * side + (x & mask);
}

/* Returns a side for which few cells share a list: the springls' largest coordinate in cells, in bounds. */
static int side_for(const struct cells *cells)
{
    float largest = 0.0f;
    int side = LEAST_SIDE;
    for (int i = 0; i < cells->springls.count; ++i) {
        for (int k = 0; k < 3; ++k) {
            largest = fmaxf(largest, corners_of(cells, i)[k]);
        }
    }
    while (side < MOST_SIDE && 2.0f * (float)side < largest) {
        side *= 2;
    }
    return side;
}

static bool sort_into_cells(struct cells *cells)
{
    cells->side = side_for(cells);
    const int lists = cells->side * cells->side * cells->side;
    cells->first = malloc(sizeof(int) * (size_t)lists);
    cells->next = malloc(sizeof(int) * ((size_t)cells->springls.count + 1));
    if (!cells->first || !cells->next) {
        return false;
    }
    for (int list = 0; list < lists; ++list) {
        cells->first[list] = -1;
    }
    for (int i = 0; i < cells->springls.count; ++i) {
        const float *q = corners_of(cells, i);
        int cell[3];
        for (int k = 0; k < 3; ++k) {
            cell[k] = cell_along(((double)q[k] + (double)q[3 + k] + (double)q[6 + k]) / 3.0);
        }
        const int list = list_at(cells, cell[0], cell[1], cell[2]);
        cells->next[i] = cells->first[list];
        cells->first[list] = i;
    }
    return true;
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; ++k) {
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
}

/* Computes the difference of two corners of a triangle. */
static void edge_of(const float *triangle, int from, int to, double edge[3])
{
    for (int k = 0; k < 3; ++k) {
        edge[k] = (double)triangle[3 * to + k] - (double)triangle[3 * from + k];
    }
}

/* Computes a normal as long as twice the area. */
static void area2_of(const float *triangle, double area2[3])
{
    double a[3], b[3];
    edge_of(triangle, 0, 1, a);
    edge_of(triangle, 0, 2, b);
    cross(a, b, area2);
}

/* Returns true when x, on a surface that faces `facing`, lies over a triangle of that side and within a tenth of a voxel of it. */
static bool is_over(const float *triangle, const double x[3], const double facing[3])
{
    const double high = 0.1;
    double n[3], d[3];
    area2_of(triangle, n);
    for (int e = 0; e < 3; ++e) {
        double edge[3], inward[3];
        edge_of(triangle, e, (e + 1) % 3, edge);
        cross(n, edge, inward);
        for (int k = 0; k < 3; ++k) {
            d[k] = x[k] - (double)triangle[3 * e + k];
        }
        if (dot(inward, d) < 0.0) {
            return false;
        }
    }
    return dot(n, facing) > 0.0 && fabs(dot(n, d)) <= high * sqrt(dot(n, n));
}

static int springls_over(const struct cells *cells, const double x[3], const double facing[3])
{
    const int cx = cell_along(x[0]), cy = cell_along(x[1]), cz = cell_along(x[2]);
    int over = 0;
    for (int near = 0; near < 27; ++near) {
        const int list = list_at(cells, cx + near % 3 - 1, cy + near / 3 % 3 - 1, cz + near / 9 - 1);
        for (int i = cells->first[list]; i >= 0; i = cells->next[i]) {
            over += is_over(corners_of(cells, i), x, facing);
        }
    }
    return over;
}

/* Picks a place in the i-th triangle: places of all triangles fill it evenly. */
static void place_in(const float *triangle, int i, double x[3])
{
    double u = fmod(0.7548776662466927 * (i + 1), 1.0), v = fmod(0.5698402909980532 * (i + 1), 1.0), a[3], b[3];
    if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
    }
    edge_of(triangle, 0, 1, a);
    edge_of(triangle, 0, 2, b);
    for (int k = 0; k < 3; ++k) {
        x[k] = (double)triangle[k] + u * a[k] + v * b[k];
    }
}

/* The corners of a triangle of the mesh. */
static void corners_in(const springls_mesh *mesh, int triangle, float corners[9])
{
    for (int k = 0; k < 9; ++k) {
        corners[k] = mesh->positions[3 * (size_t)mesh->triangles[3 * triangle + k / 3] + (size_t)(k % 3)];
    }
}

/* Returns 1 where the triangles of a closed mesh face outwards, else -1: voxels may be a mirror image of the world. */
static double side_faced(const springls_mesh *closed)
{
    double volume = 0.0;
    for (int t = 0; t < closed->triangle_count; ++t) {
        float triangle[9];
        double area2[3];
        corners_in(closed, t, triangle);
        area2_of(triangle, area2);
        for (int k = 0; k < 3; ++k) {
            volume += area2[k] * (double)triangle[k];
        }
    }
    return volume < 0.0 ? -1.0 : 1.0;
}

/* A triangle of the zero level: its area, and the springls over a place in it. */
struct sample {
    double area;
    int over;
};

static void take_sample(const struct cells *cells, const springls_mesh *zero_level, double side, int t, struct sample *sample)
{
    float triangle[9];
    double facing[3], x[3];
    corners_in(zero_level, t, triangle);
    area2_of(triangle, facing);
    for (int k = 0; k < 3; ++k) {
        facing[k] *= side;
    }
    place_in(triangle, t, x);
    sample->area = sqrt(dot(facing, facing));
    sample->over = springls_over(cells, x, facing);
}

struct sample_loop {
    const struct cells *cells;
    const springls_mesh *zero_level;
    double side;
    struct sample *samples;
};

static void run_sample_loop(void *arg, int begin, int end)
{
    const struct sample_loop *loop = arg;
    const struct cells *cells = loop->cells;
    const springls_mesh *zero_level = loop->zero_level;
    const double side = loop->side;
    struct sample *samples = loop->samples;
    for (int t = begin; t < end; ++t) {
        take_sample(cells, zero_level, side, t, &samples[t]);
    }
}

static bool measure(const struct cells *cells, const springls_mesh *zero_level, struct coverage *out)
{
    const double side = side_faced(zero_level);
    double area = 0.0, covered = 0.0, twice = 0.0;
    struct sample *samples = malloc(((size_t)zero_level->triangle_count + 1) * sizeof *samples);
    if (!samples) {
        return false;
    }
    struct sample_loop loop = {cells, zero_level, side, samples};
    threads_for(zero_level->triangle_count, 1024, run_sample_loop, &loop);
    for (int t = 0; t < zero_level->triangle_count; ++t) { /* in one order for any number of threads */
        area += samples[t].area;
        covered += samples[t].over >= 1 ? samples[t].area : 0.0;
        twice += samples[t].over >= 2 ? samples[t].area : 0.0;
    }
    free(samples);
    out->covered = area > 0.0 ? covered / area : 0.0;
    out->covered_twice = area > 0.0 ? twice / area : 0.0;
    return true;
}

bool coverage_measure(springls_context *ctx, struct coverage *out)
{
    struct cells cells = {{NULL, 0, 0}, 0, NULL, NULL};
    springls_measures measures;
    springls_mesh zero_level;
    if (springls_measure(ctx, &measures) != SPRINGLS_OK || springls_extract_mesh(ctx, &zero_level) != SPRINGLS_OK) {
        return false;
    }
    springls_to_voxel(ctx, zero_level.positions, zero_level.vertex_count, zero_level.positions);
    cells.springls = springls_view_vertices(ctx);
    const bool good = sort_into_cells(&cells) && measure(&cells, &zero_level, out);
    out->area = measures.coverage;
    springls_mesh_free(ctx, &zero_level);
    free(cells.first);
    free(cells.next);
    return good;
}

/* Adds the last of `count` values to their range and mean. */
static void add(int count, double value, double *least, double *mean, double *most)
{
    *least = count > 1 ? fmin(*least, value) : value;
    *most = count > 1 ? fmax(*most, value) : value;
    *mean += (value - *mean) / count;
}

bool coverage_add(springls_context *ctx, struct coverage_range *range)
{
    struct coverage now;
    if (springls_get_stats(ctx).steps < springls_get_params(ctx).resample_period) {
        return true;
    }
    if (!coverage_measure(ctx, &now)) {
        return false;
    }
    const int count = ++range->count;
    add(count, now.area, &range->least.area, &range->mean.area, &range->most.area);
    add(count, now.covered, &range->least.covered, &range->mean.covered, &range->most.covered);
    add(count, now.covered_twice, &range->least.covered_twice, &range->mean.covered_twice, &range->most.covered_twice);
    return true;
}
