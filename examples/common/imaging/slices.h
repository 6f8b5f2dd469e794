/* slices.h - pictures of three orthogonal slices of a volume, with contours drawn over them.
 *
 * Radiological convention: the patient's right is on the left of axial and coronal slices; anterior is up in axial slices,
 * superior is up in the others; anterior is on the left of sagittal slices. Letters at the rim mark the directions. Slices
 * follow the voxel axes nearest to the patient's (oblique scans are not resampled). */
#ifndef EXAMPLES_IMAGING_SLICES_H
#define EXAMPLES_IMAGING_SLICES_H

#include "imaging/volume.h"
#include "pictures/image.h"

struct slices_contour {
    const float *data; /* same grid as the volume; see volume_voxels */
    float level;       /* the contour runs where data = level: 0 for signed distances */
    float label;       /* > 0: data are labels; the contour is the border of this one, `level` is not used */
    bool any_label;    /* data are labels; the contour is the border of everything not 0 */
    float width;       /* pixels; 0 = 1.6 */
    struct color color;
    const char *name; /* for the legend; NULL = none */
};

struct slices_view {
    const struct volume *volume;
    const struct slices_contour *contours;
    int contour_count;
    int center[3]; /* voxel through which the slices go; negative = where the first contour has the largest area */
    float window_lo, window_hi; /* grey range; equal = from the 1st to the 99.5th percentile of what is shown */
    int height;                 /* pixels of the tallest slice; 0 = 420 */
    const char *title;
};

/* Draws axial, coronal and sagittal slices side by side. Returns false if memory is short. */
bool slices_render(const struct slices_view *view, struct image *result);

#endif
