/* surface_distances.h - how far two surfaces are from each other.
 *
 * Distances are in the unit of the vertex positions: pass millimetres in world coordinates, never the voxel indices of an
 * anisotropic image. Points are spread evenly by area over each surface; d(A->B) is the set of distances from A's points to
 * the nearest point of B's triangles (exact, not to vertices or voxel centres).
 *   mean_ab, mean_ba  mean of d(A->B), of d(B->A)
 *   assd              average symmetric surface distance: (mean_ab * area(A) + mean_ba * area(B)) / (area(A) + area(B))
 *   hd95_ab, hd95_ba  the 95th percentile of d(A->B), of d(B->A)
 *   hd95              the larger of the two (each direction on its own, not pooled)
 *   max               the larger of the two maxima (Hausdorff distance, over the sample points)
 *   surface_dice      area-weighted share of both surfaces that lies within `tolerance` of the other one */
#ifndef EXAMPLES_SURFACE_SURFACE_DISTANCES_H
#define EXAMPLES_SURFACE_SURFACE_DISTANCES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct surface {
    const float *positions;
    const uint32_t *indices; /* NULL = soup */
    size_t triangle_count;
};

struct surface_distances {
    double area_a, area_b;
    double mean_ab, mean_ba, assd, hd95_ab, hd95_ba, hd95, max;
    double surface_dice, tolerance;
    size_t samples; /* on each surface */
};

/* Places `samples` points on each surface (0 = 100000) by a fixed rule, so that the result is repeatable. Returns false if
 * a surface is empty, has no area or memory is short. */
bool surface_distances_measure(const struct surface *a, const struct surface *b, size_t samples, double tolerance,
                               struct surface_distances *result);

#endif
