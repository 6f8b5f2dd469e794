/* segment.h - the parts of the program segment: input, run, output. A function that can fail returns false after one line on
 * stderr. Order: segment_read; for every object segment_begin, segment_run, segment_compare, segment_keep; then segment_write
 * and segment_report. */
#ifndef EXAMPLES_SEGMENT_SEGMENT_H
#define EXAMPLES_SEGMENT_SEGMENT_H

#include "base/cli.h"
#include "imaging/gvf.h"
#include "imaging/overlap.h"
#include "imaging/volume.h"
#include "springls.h"
#include "springls/coverage.h"
#include "springls/model_pictures.h"
#include "surface/surface_distances.h"

enum { SEGMENT_MAX_LEVELS = 4, SEGMENT_MAX_LABELS = 64, SEGMENT_MAX_OBJECTS = 32, SEGMENT_MAX_SEEDS = 32 };

/* An object to find, with a contour of its own. */
struct segment_object {
    double window[2];                           /* low < high: used instead of the level */
    uint32_t mask_label;                        /* label to start from */
    bool any_label;                             /* start from all but 0 instead */
    uint32_t labels[SEGMENT_MAX_LABELS];        /* of the reference */
    int label_count;                            /* none: all but 0 */
    uint32_t written;                           /* label in the result */
};

/* Settings from the command line. */
struct segment_settings {
    struct cli_common common;
    const char *image, *init, *mask, *init_mesh, *reference;
    const char *series;                         /* of a folder of DICOM files */
    const char *overrides;                      /* --set */
    const char *window_text, *mask_label_text, *label_text; /* from the command line, for `objects` and the report */
    const char *region_means;                   /* band or image */
    struct segment_object objects[SEGMENT_MAX_OBJECTS];
    int object_count;
    double level;                               /* NaN: use Otsu's threshold */
    double pressure, region, edge, gvf, curvature; /* weights of the forces */
    double speed, radius, ramp, stay;           /* stay NaN: depends on the kind of start */
    float center[3];
    const char *seed_text;
    const char *outside_text;
    float seeds[SEGMENT_MAX_SEEDS][3], outside_seeds[SEGMENT_MAX_SEEDS][3]; /* mm; the latter of --cut */
    int seed_count, outside_count;
    double min_volume;                          /* mm^3 of a part that stays; NaN: more than a voxel */
    int frame, steps, levels, gvf_halvings;
    bool dark, solid, largest, clear_edges, keep_largest, keep_topology, mirror, cut, compare_level_set, no_pictures;
    bool refines_by_region; /* of cut: nothing else says which intensities are the object's */
};

/* Result of one contour. */
struct segment_result {
    const struct segment_object *object;
    float low, high, ramp;   /* of the pressure */
    float voxel;             /* of the finest grid, mm */
    double start_mean;       /* intensity where it started on the object, with a region force; else NaN */
    double start_dice;       /* of the starting mask or cut against the reference; NaN: there is none */
    int steps, levels, springls;
    double springls_mean;    /* over the steps */
    bool at_rest;            /* false: the run ended at the limit of steps */
    float moving;            /* share of springls that still moved at the end */
    double seconds;
    double share;            /* of the image that is inside */
    bool trusted;            /* it agrees with its start */
    int islands;             /* parts that were removed at the end */
    int label_components;    /* of the label map, connected through faces */
    springls_measures measures;
    struct coverage_range coverage; /* at the end of every grid */
    struct overlap overlap;
    struct surface_distances distances;
    bool has_distances;
    /* --compare-level-set: distances of the surface's vertices from the level set's surface, mm */
    double level_set_mean, level_set_deviation, level_set_dice, level_set_seconds;
};

struct segment {
    struct segment_settings settings;
    springls_params params;
    struct volume image, reference;
    size_t voxels;           /* of the image */
    float side;              /* of the finest grid's voxels, mm */
    struct segment_result results[SEGMENT_MAX_OBJECTS];
    /* Of several objects: the object's number from 1, and in another map how deep inside the voxel is. One has `inside`. */
    struct volume labels;
    float *depth;
    /* The present object: */
    struct segment_result *result;
    struct volume grid;      /* of the model; data: its level set, voxels */
    bool refitted;           /* made again without islands: correspondences are not on the start any more */
    springls_backend *backend; /* of ctx, for all objects */
    struct volume start;     /* the starting surface, as a distance in mm; empty if not needed */
    struct volume pressure;  /* of the window alone, on the image's grid with a margin; becomes `push` where that is made once */
    float *blurred;             /* the image, blurred to the present grid */
    float *away;             /* distance from the start at the pressure's voxels, mm; NULL: not needed */
    struct volume push;      /* sum of the pressure and all other forces along the normal, on the same voxels */
    struct gvf flow;
    float flow_map[3][4], push_map[3][4]; /* from the model's voxels to those of flow and push */
    springls_context *ctx, *truth_ctx;
    struct model_frame frames[SEGMENT_MAX_LEVELS + 1];
    int frame_count;
    float *distance;         /* the result on the image's grid, mm */
    uint8_t *inside, *truth; /* the result and the reference as masks */
    bool doubtful;           /* an object does not agree with its start */
    bool lacks_files;        /* one of an object could not be written; the rest still is */
    const springls_mesh *surface; /* of the last frame, which owns it; NULL before segment_take_surface */
    springls_mesh truth_surface;
};

/* input.c: reads image, reference and window, and makes the first surface on the present grid. */
bool segment_read(struct segment *run);
bool segment_begin(struct segment *run, int object);
bool segment_start(struct segment *run);
bool segment_start_from(struct segment *run, const struct volume *from, const char *doing); /* from a level set on another grid */
bool segment_starts_far(const struct segment *run); /* true if it starts from a shape */

/* cut.c: a start from a graph cut between seeds. */
extern const float segment_seed_cells; /* default radius of the ball around a seed, in cells of the grid */
const char *segment_cut_lacks(void);                         /* NULL, or why there is no cut */
float segment_cut_side(const struct volume *image);          /* of its voxels, mm: the image's, or larger */
bool segment_cut(struct segment *run, struct volume *start); /* -0.5 inside, 0.5 outside, on a grid of its own */

/* forces.c: the forces on the contour on the present grid. */
bool segment_forces_enter(struct segment *run, float side);
/* Updates the region's means from the contour in grid.data. Without a region force: once a grid. */
bool segment_forces_update(struct segment *run);
springls_forces segment_forces(struct segment *run); /* with curvature */
/* Computes the same forces without curvature at points in the model's voxels; call segment_forces first. */
void segment_speed(struct segment *run, const float *points, const float *normals, int count, float *out);
void segment_forces_free(struct segment *run);

/* grid.c: the finest grid, and the end of a run. */
void segment_choose_side(struct segment *run); /* by --grid, or the image's voxels and the machine's memory */
int segment_choose_levels(const struct segment *run);
bool segment_remove_islands(struct segment *run); /* from grid.data and the model */
bool segment_map_back(struct segment *run); /* computes distances in mm and the mask on the image's grid, without islands */

/* run.c: runs and measures a contour. */
bool segment_run(struct segment *run);
/* Sets run->surface; without a film extracts it into frames[0]. Prints one line on failure. */
bool segment_take_surface(struct segment *run);
bool segment_compare(struct segment *run); /* with the reference, if there is one */
void segment_keep(struct segment *run);    /* adds the result to the map of labels */
float segment_fastest(const struct segment *run); /* voxels a unit of time */
int segment_look_every(const struct segment *run); /* steps from one look at what moves to the next */
float segment_still(const struct segment *run); /* voxels from look to look that count as rest */
bool segment_enter_level(struct segment *run, float side, struct volume *coarse); /* `coarse` receives the previous grid */

/* doubt.c: does the result agree with its start? */
bool segment_look_at_start(struct segment *run);           /* when the model has it */
bool segment_agrees_with_start(const struct segment *run); /* else prints one line */

/* level_set.c: the same segmentation by a level set alone. */
bool segment_compare_level_set(struct segment *run);

/* output.c */
void segment_print_summary(const struct segment *run);
bool segment_write_object(const struct segment *run);             /* writes surface and pictures into --out */
bool segment_write(const struct segment *run);                    /* writes the files common to all objects */
bool segment_report(const struct segment *run, const char *path); /* JSON */

void segment_end_object(struct segment *run);
void segment_free(struct segment *run);

/* Prints one line on stderr and returns false. */
bool segment_fail(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
bool segment_no_memory(void);
/* Returns true if `status` is good; else prints one line that begins with `doing`. */
bool segment_check(const springls_context *ctx, springls_status status, const char *doing);

#endif
