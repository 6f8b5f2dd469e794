/* progress.h - progress bar, clock and memory use for long runs.
 *
 * The bar goes to stderr, and only when stderr is a terminal and the program is not quiet, so logs stay clean. It is
 * redrawn at most ten times a second: call progress_update as often as you like. */
#ifndef EXAMPLES_BASE_PROGRESS_H
#define EXAMPLES_BASE_PROGRESS_H

#include <stdbool.h>
#include <stddef.h>

struct progress {
    const char *label;
    size_t total;
    double start, last_draw;
    bool shown;
};

void progress_begin(struct progress *progress, const char *label, size_t total, bool quiet);
void progress_update(struct progress *progress, size_t done, const char *note); /* note: short text or NULL */
void progress_end(struct progress *progress);                                   /* wipes the bar */

double elapsed_seconds(void); /* monotonic; only differences mean anything */
double peak_rss_mib(void);    /* largest resident memory of this process so far */

#endif
