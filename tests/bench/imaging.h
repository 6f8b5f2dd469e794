/* imaging.h - the pieces of make imaging: which steps are run on which data, and the page about them. */
#ifndef BENCH_IMAGING_H
#define BENCH_IMAGING_H

#include "runs.h"

enum imaging_kind { IMAGING_PREPARE, IMAGING_SEGMENT, IMAGING_REGISTER, IMAGING_TRACK, IMAGING_LARGE_STEPS, IMAGING_BUILD,
                    IMAGING_ATLAS, IMAGING_KINDS };
enum { IMAGING_STEPS = 48 };

/* The options; NULL: not given. */
struct imaging_settings {
    const char *templates;             /* folder of mricron's images */
    const char *collection;            /* SPRINGLS_DATA */
    const char *image, *labels, *label, *level; /* the user's */
    const char *series, *series_labels, *landmarks, *subjects;
    const char *backend;
    const char *page;                  /* Markdown */
    bool keep;
};

struct imaging_step {
    enum imaging_kind kind;
    const char *title;
};

struct imaging {
    struct imaging_settings settings;
    struct imaging_step steps[IMAGING_STEPS];
    struct run runs[IMAGING_STEPS]; /* of the same number; each writes into imaging_folder/NAME */
    int count, failures;
    const char *about; /* the data */
};

extern const char *const imaging_folder;

void imaging_plan(struct imaging *imaging);
bool imaging_write_page(const struct imaging *imaging);   /* index.html */
bool imaging_write_report(const struct imaging *imaging); /* report.json */
bool imaging_write_markdown(const struct imaging *imaging, const char *path); /* the tables, beside what the paper has */

#endif
