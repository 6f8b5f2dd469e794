/* segment.h - the pieces of examples/segment.c: input, the contour's run, output. What can fail returns
 * false after one line on stderr. Order: segment_read; for every object segment_begin, segment_run, segment_compare,
 * segment_keep; then segment_write and segment_report. */
#ifndef EXAMPLES_SEGMENT_SEGMENT_H
#define EXAMPLES_SEGMENT_SEGMENT_H

#include "base/cli.h"
#include "imaging/gvf.h"
#include "imaging/overlap.h"
#include "imaging/volume.h"
#include "springls.h"
#include "springls/model_pictures.h"
#include "surface/surface_distances.h"

enum { SEGMENT_MAX_LEVELS = 4, SEGMENT_LOOK_EVERY = 10, SEGMENT_MAX_LABELS = 64, SEGMENT_MAX_OBJECTS = 32 };

/* One contour of a run. */
struct segment_object {
    double window[2];                           /* low < high: used instead of the level */
    int mask_label;                             /* to start from; -1: all but 0 */
    int labels[SEGMENT_MAX_LABELS], label_count; /* of the reference; none: all but 0 */
    int written;                                /* its label in the result */
};

/* What the command line says. */
struct segment_settings {
    struct cli_common common;
    const char *image, *init, *mask, *init_mesh, *reference;
    const char *overrides;                      /* --set */
    const char *window_text, *mask_label_text, *label_text; /* as written: read into `objects`, named in the report */
    const char *region_means;                   /* band or image */
    struct segment_object objects[SEGMENT_MAX_OBJECTS];
    int object_count;
    double level;                               /* NaN: Otsu's threshold */
    double pressure, region, edge, gvf, curvature; /* weights of the forces */
    double speed, radius, ramp, stay;           /* stay NaN: by the kind of start */
    float center[3];
    int frame, steps, levels, gvf_halvings;
    bool dark, solid, largest, keep_topology, mirror, compare_level_set;
};

/* What one contour came to. */
struct segment_result {
    const struct segment_object *object;
    float low, high, ramp;   /* of the pressure */
    float voxel;             /* of the finest grid, mm */
    double start_dice;       /* of the mask started from, against the reference; NaN: no such thing */
    int steps, levels, springls;
    double springls_mean;    /* over the steps */
    bool at_rest;            /* else the limit of steps ended the run */
    float moving;            /* share of springls that still moved then */
    double seconds;
    springls_measures measures;
    struct overlap overlap;
    struct surface_distances distances;
    bool has_distances;
    /* --compare-level-set: of the surface's vertices from that of the level set, mm */
    double level_set_mean, level_set_deviation, level_set_dice, level_set_seconds;
};

struct segment {
    struct segment_settings settings;
    springls_params params;
    struct volume image, reference;
    size_t voxels;           /* of the image */
    struct segment_result results[SEGMENT_MAX_OBJECTS];
    struct volume labels;    /* of all objects; data: the label, and beside it how deep inside it is */
    float *depth;
    /* of the present object */
    struct segment_result *result;
    struct volume grid;      /* of the model; data: its level set, voxels */
    springls_backend *backend; /* of ctx, for all objects */
    struct volume start;     /* where it started, as far as it matters: a distance in mm */
    struct volume pressure;  /* of the window alone, on the image's grid with a margin */
    float *blurred;             /* the image, blurred to the present grid */
    float *away;             /* distance from the start at the pressure's voxels, mm; NULL: it does not matter */
    struct volume push;      /* pressure and all the other forces along the normal, on the same voxels */
    struct gvf flow;
    float flow_map[3][4], push_map[3][4]; /* from the model's voxels to those of flow and push */
    springls_context *ctx, *truth_ctx;
    struct model_frame frames[SEGMENT_MAX_LEVELS + 1];
    int frame_count;
    float *distance;         /* the result on the image's grid, mm */
    uint8_t *inside, *truth; /* the result and the reference as masks */
    springls_mesh surface, truth_surface;
};

/* input.c: image, reference and window; and the first surface on the present grid. */
bool segment_read(struct segment *run);
bool segment_begin(struct segment *run, int object);
bool segment_start(struct segment *run);
bool segment_start_from(struct segment *run, const struct volume *from, const char *doing); /* from a level set elsewhere */
bool segment_starts_far(const struct segment *run); /* does it start from a shape? */

/* forces.c: what pushes the contour on the present grid. */
bool segment_forces_enter(struct segment *run, float side);
bool segment_forces_update(struct segment *run); /* the region's means follow the contour: grid.data */
springls_forces segment_forces(struct segment *run); /* with curvature */
/* The same, without curvature, at points in the model's voxels; after segment_forces. */
void segment_speed(struct segment *run, const float *points, const float *normals, int count, float *out);
void segment_forces_free(struct segment *run);

/* run.c */
bool segment_run(struct segment *run);
bool segment_compare(struct segment *run); /* with the reference, if there is one */
void segment_keep(struct segment *run);    /* into the map of labels */
int segment_choose_levels(const struct segment *run);
float segment_choose_side(const struct segment *run); /* of the finest grid's voxels, mm */
void segment_map_back(struct segment *run); /* distances in mm and the mask on the image's grid */
float segment_fastest(const struct segment *run); /* voxels a unit of time */
float segment_still(const struct segment *run); /* what has moved less in SEGMENT_LOOK_EVERY steps is at rest, voxels */
bool segment_enter_level(struct segment *run, float side, struct volume *coarse); /* `coarse` receives the grid before */

/* level_set.c: the same segmentation by a level set alone. */
bool segment_compare_level_set(struct segment *run);

/* output.c */
void segment_print_summary(const struct segment *run);
bool segment_write_object(const struct segment *run);             /* into --out: surface and pictures */
bool segment_write(const struct segment *run);                    /* what all objects share */
bool segment_report(const struct segment *run, const char *path); /* JSON */

void segment_end_object(struct segment *run);
void segment_free(struct segment *run);

/* One line on stderr; false, so that callers can return it. */
bool segment_fail(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
bool segment_no_memory(void);
/* Fails unless `status` is good; the line begins with `doing`. */
bool segment_check(const springls_context *ctx, springls_status status, const char *doing);

#endif
