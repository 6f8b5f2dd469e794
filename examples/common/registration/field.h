/* field.h - displacement fields in the world: a vector in mm at every voxel of a grid.
 *
 * In memory vectors have the axes of volume.h, RAS+. A field moves points: x -> x + u(x). Registering "fixed" and "moving"
 * gives a field on the fixed image's grid that maps a point of the fixed image to the same anatomical point of the moving one;
 * so warped(x) = moving(x + u(x)) looks like the fixed image. ITK and elastix use the same direction.
 *
 * Files are NIfTI as written by ITK: 5 dimensions (nx, ny, nz, 1, 3), intent code 1007 (vector), components in mm along ITK's
 * LPS+ axes (x left, y posterior, z superior), whose first two have the opposite sign of RAS+. NRRD and MetaImage files of
 * three components can be read too. */
#ifndef EXAMPLES_REGISTRATION_FIELD_H
#define EXAMPLES_REGISTRATION_FIELD_H

#include "imaging/volume.h"

struct field {
    struct volume grid; /* geometry; its data are not used */
    float *mm;          /* 3 a voxel, x fastest, RAS+ */
};

/* Makes a field of zeros on the grid of `like`. Returns false if memory is short. */
bool field_create(const struct volume *like, struct field *field);
void field_free(struct field *field);

/* Reads a field. On failure returns false, leaves an empty field and puts the reason in `error`. */
bool field_read(const char *path, struct field *field, char error[VOLUME_TEXT]);
bool field_write(const char *path, const struct field *field, char error[VOLUME_TEXT]);

/* Computes x + u(x), trilinear, constant beyond the outermost voxels. */
void field_map(const struct field *field, const float world[3], float mapped[3]);

/* Maps points of the world; called with batches from several threads at once. */
typedef void (*field_map_fn)(const void *user, const float *points, size_t count, float *mapped);
/* Samples u(x) = map(x) - x at every voxel. */
void field_sample(field_map_fn map, const void *user, struct field *field);
void field_map_points(const void *field, const float *points, size_t count, float *mapped); /* field_map as a field_map_fn */

/* Computes the inverse of a field on the grid of `like` by fixed-point iteration. *remains: the largest |x - map(inverse(x))|
 * in mm over the voxels that stay inside both grids. */
bool field_invert(const struct field *field, const struct volume *like, struct field *inverse, double *remains);

/* Samples moving(x + u(x)) on the field's grid, trilinear; places beyond the moving image get `outside`. */
void field_warp(const struct field *field, const struct volume *moving, float outside, float *warped);
/* Samples the label of the nearest voxel instead. */
void field_warp_labels(const struct field *field, const struct volume *labels, float *warped);
/* Does the same with the ids. Returns false if memory is short. */
bool field_warp_ids(const struct field *field, const struct volume *labels, uint32_t *warped);

/* Computes the determinants of the map's Jacobian at every voxel; returns the smallest, NaN if memory is short. *folded: the number
 * of voxels at which the map folds, where it is not positive. */
float field_jacobian(const struct field *field, float *determinants, size_t *folded);

#endif
