/* segment.h - the pieces of examples/segment.c: input, the contour's run, output. What can fail returns
 * false after one line on stderr. Order: segment_read, segment_run, segment_compare (with a reference),
 * segment_print_summary, segment_write. */
#ifndef EXAMPLES_COMMON_SEGMENT_H
#define EXAMPLES_COMMON_SEGMENT_H

#include "cli.h"
#include "metrics.h"
#include "model_pictures.h"
#include "springls.h"
#include "volume.h"

enum { SEGMENT_MOST_LEVELS = 4, SEGMENT_MOST_LABELS = 256 };

/* What the command line says. */
struct segment_settings {
    struct cli_common common;
    const char *image, *init, *mask, *init_mesh, *reference;
    const char *overrides;  /* --set */
    const char *label_text; /* --label as written: read into `labels`, and named in the report */
    double level;           /* NaN: Otsu's threshold */
    double window[2];       /* low < high: used instead of the level */
    double curvature, speed, radius, ramp;
    float center[3];
    int frame, mask_label, steps, levels, label_count, labels[SEGMENT_MOST_LABELS];
    bool dark, largest, keep_topology;
};

struct segment {
    struct segment_settings settings;
    springls_params params;
    struct volume image, reference;
    size_t voxels;           /* of the image */
    float low, high, ramp;   /* of the pressure */
    struct volume grid;      /* of the model; data: its level set, voxels */
    struct volume pressure;  /* on the image's grid with a margin */
    springls_backend *backend; /* of ctx */
    springls_context *ctx, *truth_ctx;
    struct model_frame frames[SEGMENT_MOST_LEVELS + 1];
    int frame_count;
    int steps, levels;
    bool at_rest;            /* else the limit of steps ended the run */
    float moving;            /* share of springls that still moved then */
    double seconds;
    float *distance;         /* the result on the image's grid, mm */
    uint8_t *inside, *truth; /* the result and the reference as masks */
    springls_mesh surface, truth_surface;
    springls_measures measures;
    struct overlap overlap;
    struct surface_distances distances;
    bool has_distances;
};

/* segment_input.c: image, reference and window; and the first surface on the present grid. */
bool segment_read(struct segment *run);
bool segment_start(struct segment *run);
bool segment_start_from(struct segment *run, const struct volume *from, const char *doing); /* from a level set elsewhere */
bool segment_starts_far(const struct segment *run); /* does it start from a shape? */

/* segment_run.c */
bool segment_run(struct segment *run);
bool segment_compare(struct segment *run);

/* segment_output.c */
void segment_print_summary(const struct segment *run);
bool segment_write(const struct segment *run);                    /* everything into --out */
bool segment_report(const struct segment *run, const char *path); /* JSON */

void segment_free(struct segment *run);

/* May it print on standard output? */
bool segment_may_print(const struct segment *run);

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
