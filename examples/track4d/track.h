/* track.h - the parts of the program track4d: springls follow a body through a sequence of images (paper, section 5.7). A
 * function that can fail returns false after one line on stderr. Order: track_read, track_run or track_large_steps,
 * track_print, track_write, track_report. */
#ifndef EXAMPLES_TRACK4D_TRACK_H
#define EXAMPLES_TRACK4D_TRACK_H

#include "base/cli.h"
#include "imaging/volume.h"
#include "registration/beat.h"
#include "registration/field.h"
#include "registration/register.h"
#include "shapes/shapes.h"
#include "springls.h"
#include "springls/model_pictures.h"

enum { TRACK_MAX_FRAMES = 1000, TRACK_STEP_RUNS = 4 };

struct track_settings {
    struct cli_common common;
    const char *image, *labels, *landmarks, *fields;
    const char *second, *second_labels; /* two files are two frames, each on its own grid */
    const char *overrides; /* --set */
    int label, reference;  /* label -1: all but 0; reference: the frame in which the model is made */
    int steps;             /* number of steps for every frame's motion */
    int beat;              /* frames of a synthetic motion of the reference image; 0: use the image's own frames */
    bool true_field;       /* use the exact field of that motion; else register */
    bool large_steps;      /* study step sizes instead of a sequence, for the motion to this frame, -1: half the sequence */
    int frame;
};

struct track_error {
    double mean, max; /* mm */
};

/* Results of a frame. */
struct track_frame {
    char warning[VOLUME_TEXT]; /* about its image; empty: none */
    bool done, has_label;
    double registration_seconds, model_seconds;
    double jacobian_min;
    size_t folded;             /* voxels at which the frame's map folds */
    double volume_ml, area_cm2, label_ml;
    int components, euler;
    int kept;                /* springls that still exist with the reference's identity, at their index */
    double off_surface;      /* share of springls whose particle is more than half a voxel from the zero level */
    double dice, field_dice; /* against the frame's label: of the zero level; of the reference's label moved by the field */
    struct track_error landmarks_before, landmarks, field_landmarks; /* unmoved; carried by springls; moved by the field */
    struct track_error particles; /* synthetic motion: particles against their correspondences moved by it */
    float *vertices;              /* of the mesh, 3 each, mm */
};

/* A method and a number of steps in the study of step sizes. */
struct track_step_run {
    const char *method;
    int steps;
    double longest;                 /* motion in one step, voxels */
    double mean, hd95, max;         /* zero level against the exact surface, voxels; NaN: the surface has disappeared */
    double volume_error;            /* percent */
    double tracking_mean, tracking_max; /* voxels; NaN: the method does not track */
    double seconds;
};

struct track {
    struct track_settings settings;
    struct register_settings registration;
    springls_params params;
    struct volume image;           /* of the reference; with a second file on a grid that covers both */
    float *mask;                   /* its label: 1 or 0 */
    int frame_count, labelled;     /* images; label maps */
    struct beat beat;
    struct volume grid;            /* of the model: cubes */
    springls_backend *backend;
    springls_context *ctx;
    springls_mesh mesh;            /* the reference's surface: triangle i is springl i, */
    int corner[3];                 /* and its corner k is the triangle's corner[k]: mirrored grids reverse triangles */
    float *landmarks;              /* of all frames, or NULL */
    size_t landmark_count;
    springls_hit *anchors;         /* the places on springls to which landmarks are attached */
    struct track_frame *frames;
    struct shape_model motion;     /* principal modes of the meshes after rigid alignment */
    float *aligned_mean;
    struct track_step_run runs[3 * TRACK_STEP_RUNS];
    int run_count;
    struct model_frame pictures[8];
    int picture_count;
    double seconds;
};

/* input.c */
bool track_read(struct track *track);
bool track_frame_image(const struct track *track, int frame, struct volume *image);
bool track_frame_mask(const struct track *track, int frame, float **mask); /* *mask NULL: the frame has none */
struct beat_time track_beat(const struct track *track, int frame);

/* The displacement from the reference to a frame. */
struct track_motion {
    struct registration registration;  /* empty when the field is exact or from a file */
    struct field substep, forward, back;  /* one substep; the whole motion; and from the frame to the reference */
    double seconds;
};

/* motion.c */
bool track_field_read(const struct track *track, int frame, struct field *field); /* of --fields; freed by field_free */
bool track_motion_make(const struct track *track, int frame, int steps, const struct registration *start,
                       struct track_motion *motion);
void track_motion_free(struct track_motion *motion);
/* Converts a field to velocities of the model. values: 3 floats a voxel of the field's grid, filled here. */
springls_sampled_field track_velocity(const struct track *track, const struct field *field, float *values);

/* run.c */
bool track_run(struct track *track);
bool track_reference(struct track *track); /* makes the model at the reference */
/* Moves the model to a frame by Algorithm 3, one to one, in so many steps. */
bool track_move(struct track *track, int frame, const struct track_motion *motion, int steps);
bool track_vertices(const struct track *track, float *vertices); /* of the mesh, from the springls' corners */

/* steps.c */
bool track_large_steps(struct track *track);

/* output.c */
void track_print(const struct track *track);
bool track_write_frame(struct track *track, int frame, const float *distance); /* meshes and slices of the present model */
bool track_write(struct track *track);
bool track_report(const struct track *track, const char *path);

void track_free(struct track *track);

/* Prints one line on stderr and returns false. */
bool track_fail(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
bool track_no_memory(void);
bool track_check(const springls_context *ctx, springls_status status, const char *doing);

#endif
