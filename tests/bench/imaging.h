/* imaging.h - the pieces of make imaging: which steps are run on which data, and the page about them. */
#ifndef BENCH_IMAGING_H
#define BENCH_IMAGING_H

#include "runs.h"
#include "table.h"

enum imaging_kind { IMAGING_PREPARE, IMAGING_SEGMENT, IMAGING_REGISTER, IMAGING_TRACK, IMAGING_LARGE_STEPS, IMAGING_BUILD,
                    IMAGING_ATLAS, IMAGING_KINDS };
enum { IMAGING_STEPS = 48, IMAGING_PICTURES = 5 };

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

/* One section of the page for each kind of step. */
struct imaging_section {
    const char *heading, *text;
    const char *paper; /* what sections 5.6 and 5.7 have of it, or NULL */
    const char *columns;
    struct {
        const char *file, *caption;
    } pictures[IMAGING_PICTURES]; /* in each step's folder; up to the first NULL */
};

extern const char *const imaging_folder;
extern const struct imaging_section imaging_sections[IMAGING_KINDS];

void imaging_plan(struct imaging *imaging);
void imaging_table(const struct imaging *imaging, enum imaging_kind kind, struct table *table); /* a row for each step */
bool imaging_write_page(const struct imaging *imaging);   /* index.html */
bool imaging_write_report(const struct imaging *imaging); /* report.json */
bool imaging_write_markdown(const struct imaging *imaging, const char *path); /* the tables, beside what the
                                                                                        * paper has; small pictures beside it */

#endif
