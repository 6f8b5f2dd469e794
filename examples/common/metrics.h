/* metrics.h - how well two segmentations agree. Every number's definition stands here, because tools differ.
 *
 * Overlap, on two label maps of the same grid (A and B = sets of voxels with the label):
 *   Dice    = 2 |A and B| / (|A| + |B|)      Jaccard = |A and B| / |A or B|      both 1 when A and B are both empty
 *
 * Surface distances, in mm (the unit of the vertex positions: give world coordinates, then spacing and direction are
 * accounted for; never compute them on voxel indices of an anisotropic image). For each surface, points are spread over
 * it evenly by area; d(A->B) is the set of distances from A's points to the nearest point of B's triangles (exact: not
 * to B's vertices, not to voxel centres).
 *   mean_ab, mean_ba  mean of d(A->B), of d(B->A)
 *   assd              average symmetric surface distance: (mean_ab * area(A) + mean_ba * area(B)) / (area(A) + area(B))
 *   hd95              the larger of the two 95th percentiles (each direction on its own, not pooled)
 *   max               the larger of the two maxima (Hausdorff distance, over the sample points)
 *   surface_dice      area-weighted share of both surfaces that lies within `tolerance` of the other one */
#ifndef EXAMPLES_COMMON_METRICS_H
#define EXAMPLES_COMMON_METRICS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct overlap {
    size_t a, b, both; /* voxel counts */
    double dice, jaccard;
};

/* `label`: the value to compare; negative = any value but 0. */
struct overlap metrics_overlap(const float *a, const float *b, size_t count, float label);
struct overlap metrics_overlap_masks(const uint8_t *a, const uint8_t *b, size_t count); /* not 0 = inside */

/* Volume of `voxels` voxels in millilitres. The affine's determinant would also be right for sheared grids; this is for
 * the usual ones. */
double metrics_millilitres(size_t voxels, const float spacing[3]);

struct surface {
    const float *positions;
    const uint32_t *indices; /* NULL = soup */
    size_t triangle_count;
};

struct surface_distances {
    double area_a, area_b;
    double mean_ab, mean_ba, assd, hd95, max;
    double surface_dice, tolerance;
    size_t samples; /* on each surface */
};

/* `samples` points on each surface (0 = 100000), placed by rule, so that the result is repeatable. False: a surface is
 * empty, has no area or memory is short. */
bool metrics_surface_distances(const struct surface *a, const struct surface *b, size_t samples, double tolerance,
                               struct surface_distances *result);

#endif
