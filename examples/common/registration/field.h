/* field.h - displacement fields in the world: a vector in mm at every voxel of a grid.
 *
 * In memory vectors have the axes of volume.h, RAS+. A field moves points: x -> x + u(x). The field that a registration of
 * "fixed" and "moving" gives lies on the fixed image's grid and takes a point of the fixed image to the same anatomical point
 * of the moving one; so warped(x) = moving(x + u(x)) looks like the fixed image. That is also ITK's and elastix's direction.
 *
 * Files are NIfTI as ITK writes them: 5 dimensions (nx, ny, nz, 1, 3), intent code 1007 (vector), components in mm along
 * ITK's LPS+ axes (x left, y posterior, z superior): the first two have the other sign than in RAS+.
 * NRRD and MetaImage files of three components are read too. */
#ifndef EXAMPLES_REGISTRATION_FIELD_H
#define EXAMPLES_REGISTRATION_FIELD_H

#include "imaging/volume.h"

struct field {
    struct volume grid; /* geometry; its data are not used */
    float *mm;          /* 3 a voxel, x fastest, RAS+ */
};

/* Zeros on the grid of `like`. False: memory is short. */
bool field_create(const struct volume *like, struct field *field);
void field_free(struct field *field);

/* On failure returns false, leaves an empty field and says why in `error`. */
bool field_read(const char *path, struct field *field, char error[VOLUME_TEXT]);
bool field_write(const char *path, const struct field *field, char error[VOLUME_TEXT]);

/* x + u(x): trilinear, beyond the outermost voxels constant. */
void field_map(const struct field *field, const float world[3], float mapped[3]);

/* A map of points of the world, asked in batches from several threads at once. */
typedef void (*field_map_fn)(const void *user, const float *points, size_t count, float *mapped);
/* u(x) = map(x) - x at every voxel. */
void field_sample(field_map_fn map, const void *user, struct field *field);
void field_map_points(const void *field, const float *points, size_t count, float *mapped); /* field_map as such a map */

/* The inverse of a field on the grid of `like`, by fixed-point iteration; *remains: the largest |x - map(inverse(x))| at voxels
 * whose image lies inside both grids, mm. */
bool field_invert(const struct field *field, const struct volume *like, struct field *inverse, double *remains);

/* moving(x + u(x)) on the field's grid, trilinear; what lies beyond the moving image is `outside`. */
void field_warp(const struct field *field, const struct volume *moving, float outside, float *warped);
/* The same with the label of the nearest voxel. */
void field_warp_labels(const struct field *field, const struct volume *labels, float *warped);

/* Determinants of the map's Jacobian at every voxel; the smallest of them. Below zero the map folds. */
float field_jacobian(const struct field *field, float *determinants);

#endif
