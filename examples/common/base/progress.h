/* progress.h - progress bar, clock and memory use for long runs.
 *
 * The bar goes to stderr, only when stderr is a terminal and the program is not quiet, so logs stay clean. It is redrawn at
 * most ten times a second, so progress_update may be called as often as convenient. */
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
void progress_end(struct progress *progress);                                   /* erases the bar */

double elapsed_seconds(void); /* monotonic clock; only differences have a meaning */
double processor_seconds(void); /* of all threads of this process since it began */
double peak_rss_mib(void);    /* peak resident memory of this process */
double free_memory_mib(void); /* memory that the machine has to give; 0: unknown */

#endif
