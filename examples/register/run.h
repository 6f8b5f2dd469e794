/* run.h - the parts of the program register. A function that can fail returns false after one line on stderr. Order:
 * register_read, register_fields, register_measure, register_write. */
#ifndef EXAMPLES_REGISTER_RUN_H
#define EXAMPLES_REGISTER_RUN_H

#include "base/cli.h"
#include "registration/field.h"
#include "registration/register.h"

struct pair {
    double mean, max;
};

/* Files to carry from one image to the other; NULL: none. */
struct carried {
    const char *labels, *points, *mesh;
};

struct run {
    struct cli_common common;
    struct register_settings settings;
    const char *fixed_path, *moving_path, *field_path, *align, *start, *similarity;
    const char *fixed_mask_path, *moving_mask_path;
    const char *fixed_labels_path, *moving_labels_path, *fixed_points_path, *moving_points_path;
    struct carried warp, inverse_warp; /* of the moving image to the fixed one; of the fixed one to the moving one */
    const char *fixed_series, *moving_series;
    int fixed_frame, moving_frame, label;
    struct volume fixed, moving;
    struct registration registration;
    struct field forward, inverse; /* on the fixed image's grid; on the moving one's */
    float *unmoved, *warped;       /* the moving image on the fixed one's grid, without and with the field */
    float *jacobian;
    float min_jacobian, max_jacobian;
    double extreme;                /* share of the voxels at which the volume changes by more than a factor of 10 */
    size_t folded;                 /* voxels at which the map folds */
    double correlation_before, correlation_after; /* over the voxels that both maps bring into the moving image */
    double information_before, information_after; /* mutual information over the same voxels, bits */
    struct relation relation;      /* of the intensities after */
    struct pair inverse_error;     /* |inverse(forward(x)) - x|, mm */
    double rms_before, rms_after;  /* of the normalised images */
    bool has_labels, has_points;
    double dice_before, dice_after;
    struct pair points_before, points_after;
    size_t point_count;
    double seconds;
};

bool register_fail(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
bool register_no_memory(void);

/* Reads the two images. What does not fit them, has not the label or cannot be read is refused here, before the work: label maps,
 * points and meshes. */
bool register_read(struct run *run);
/* Reads a label map of the moving image, or of the fixed one. */
bool register_read_labels(const struct run *run, bool of_moving, const char *path, struct volume *labels);
/* Sets the data of a label map to 1 where it has the label to compare, else to 0. */
bool register_mark_label(const struct run *run, struct volume *labels);
/* Reads the landmarks of both images, of which there are to be as many in one as in the other. *fixed, *moving: 3 floats each, mm,
 * RAS+, to be freed; NULL on failure. Both paths are to be given. */
bool register_read_landmarks(const struct run *run, float **fixed, float **moving, size_t *count);
bool register_fields(struct run *run);
void register_free(struct run *run);

/* Compares images, labels and landmarks before and after. */
bool register_measure(struct run *run);
/* Returns false, after one line, where the result is not to be trusted. */
bool register_is_trusted(const struct run *run);
/* Sets what has no data in the two images to NaN: padding, and what masks leave out. */
bool register_drop_gaps(struct run *run);
/* The windows of intensities that the registration takes: a common one if both images have one scale. */
void register_windows(const struct run *run, struct register_window *fixed, struct register_window *moving);
float register_normalized(float value, struct register_window window);
/* Brings two normalized values of one place to one scale. */
void register_on_one_scale(const struct run *run, float *fixed, float *moving);
/* The difference of two intensities of one place on one scale; NaN where one has no data. */
float register_difference(const struct run *run, float f, struct register_window fixed, float m, struct register_window moving);

bool register_carry(const struct run *run);                      /* labels, points and meshes through the maps, into --out */
bool register_write(const struct run *run);                      /* the other files of --out */
bool register_report(const struct run *run, const char *path);   /* JSON */

#endif
