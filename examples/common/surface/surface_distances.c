#include "surface/surface_distances.h"

#include "base/bvh.h"
#include "base/threads.h"
#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

static double triangle_area(const struct surface *surface, size_t t, float corners[9])
{
    float normal[3];
    for (size_t k = 0; k < 3; ++k) {
        const size_t v = surface->indices ? surface->indices[3 * t + k] : 3 * t + k;
        memcpy(corners + 3 * k, surface->positions + 3 * v, 3 * sizeof *corners);
    }
    const double area = (double)vec3_triangle_normal(corners, normal);
    return isfinite(area) ? area : 0.0;
}

/* Places points by equal steps along the surface's accumulated area, and within a triangle by the R2 sequence (multiples of
 * the plastic number's powers), which fills the unit square evenly. Returns the area. */
static double spread_points(const struct surface *surface, size_t count, float *points)
{
    double total = 0.0, sum = 0.0, u = 0.5, v = 0.5;
    float c[9];
    size_t done = 0;
    for (size_t t = 0; t < surface->triangle_count; ++t) {
        total += triangle_area(surface, t, c);
    }
    if (!(total > 0.0)) {
        return 0.0;
    }
    for (size_t t = 0; t < surface->triangle_count && done < count; ++t) {
        sum += triangle_area(surface, t, c);
        while (done < count && ((double)done + 0.5) * total < sum * (double)count) {
            u += 0.7548776662466927;
            v += 0.5698402909980532;
            u -= floor(u);
            v -= floor(v);
            const float x = (float)(u + v > 1.0 ? 1.0 - u : u), y = (float)(u + v > 1.0 ? 1.0 - v : v);
            for (size_t i = 0; i < 3; ++i) {
                points[3 * done + i] = c[i] + x * (c[3 + i] - c[i]) + y * (c[6 + i] - c[i]);
            }
            ++done;
        }
    }
    for (; done > 0 && done < count; ++done) { /* rounding of the sums may leave the last points out */
        memcpy(points + 3 * done, points + 3 * (done - 1), 3 * sizeof *points);
    }
    return done ? total : 0.0;
}

struct one_way {
    double mean, p95, max, within;
};

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

struct distances_loop {
    const struct bvh *target;
    const float *points;
    float *distances;
};

static void run_distances_loop(void *arg, int begin, int end)
{
    const struct distances_loop *loop = arg;
    const struct bvh *target = loop->target;
    const float *points = loop->points;
    float *distances = loop->distances;
    for (long i = (long)begin; i < (long)end; ++i) {
        distances[i] = bvh_distance(target, points + 3 * i, NULL, NULL);
    }
}

static struct one_way measure(const struct bvh *target, const float *points, size_t count, double tolerance,
                              float *distances)
{
    struct one_way result = {0.0, 0.0, 0.0, 0.0};
    const long n = (long)count;
    struct distances_loop loop = {target, points, distances};
    threads_for((int)n, 1024, run_distances_loop, &loop);
    qsort(distances, count, sizeof *distances, compare_floats);
    for (size_t i = 0; i < count; ++i) { /* in sorted order, so that sums are equal for any number of threads */
        const double d = (double)distances[i];
        result.mean += d / (double)count;
        result.within += d <= tolerance ? 1.0 / (double)count : 0.0;
    }
    const size_t rank = (95 * count + 99) / 100; /* nearest rank */
    result.p95 = (double)distances[rank > 0 ? rank - 1 : 0];
    result.max = (double)distances[count - 1];
    return result;
}

bool surface_distances_measure(const struct surface *a, const struct surface *b, size_t samples, double tolerance,
                               struct surface_distances *result)
{
    struct bvh tree_a, tree_b;
    memset(result, 0, sizeof *result);
    memset(&tree_a, 0, sizeof tree_a);
    memset(&tree_b, 0, sizeof tree_b);
    samples = samples ? samples : 100000;
    float *points = malloc(3 * samples * sizeof *points), *distances = malloc(samples * sizeof *distances);
    bool good = points && distances && bvh_build(&tree_a, a->positions, a->indices, a->triangle_count)
                && bvh_build(&tree_b, b->positions, b->indices, b->triangle_count);
    if (good) {
        struct one_way ab = {0.0, 0.0, 0.0, 0.0}, ba = ab;
        result->area_a = spread_points(a, samples, points);
        if (result->area_a > 0.0) {
            ab = measure(&tree_b, points, samples, tolerance, distances);
        }
        result->area_b = spread_points(b, samples, points);
        if (result->area_b > 0.0) {
            ba = measure(&tree_a, points, samples, tolerance, distances);
        }
        good = result->area_a > 0.0 && result->area_b > 0.0;
        const double wa = result->area_a / (result->area_a + result->area_b), wb = 1.0 - wa;
        if (good) {
            result->mean_ab = ab.mean;
            result->mean_ba = ba.mean;
            result->assd = wa * ab.mean + wb * ba.mean;
            result->hd95_ab = ab.p95;
            result->hd95_ba = ba.p95;
            result->hd95 = fmax(ab.p95, ba.p95);
            result->max = fmax(ab.max, ba.max);
            result->surface_dice = wa * ab.within + wb * ba.within;
            result->tolerance = tolerance;
            result->samples = samples;
        }
    }
    bvh_free(&tree_a);
    bvh_free(&tree_b);
    free(points);
    free(distances);
    return good;
}
