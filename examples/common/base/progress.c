#define _POSIX_C_SOURCE 200809L

#include "base/progress.h"

#include <stdio.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

enum { BAR_WIDTH = 30 };

static double seconds_of(clockid_t clock)
{
    struct timespec now;
    return clock_gettime(clock, &now) == 0 ? (double)now.tv_sec + 1e-9 * (double)now.tv_nsec : 0.0;
}

double elapsed_seconds(void) { return seconds_of(CLOCK_MONOTONIC); }
double processor_seconds(void) { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }

double peak_rss_mib(void)
{
    struct rusage usage;
    if (getrusage(RUSAGE_SELF, &usage) != 0) {
        return 0.0;
    }
#if defined(__APPLE__)
    return (double)usage.ru_maxrss / (1024.0 * 1024.0); /* bytes there */
#else
    return (double)usage.ru_maxrss / 1024.0; /* KiB */
#endif
}

double free_memory_mib(void)
{
    char line[128];
    double kib = 0.0;
    FILE *file = fopen("/proc/meminfo", "r");
    while (file && kib == 0.0 && fgets(line, sizeof line, file)) {
        if (sscanf(line, "MemAvailable: %lf", &kib) != 1) {
            kib = 0.0;
        }
    }
    if (file) {
        fclose(file);
    }
    if (kib > 0.0) {
        return kib / 1024.0;
    }
    /* Elsewhere: half of all there is. */
    const double pages = (double)sysconf(_SC_PHYS_PAGES), bytes = (double)sysconf(_SC_PAGESIZE);
    return pages > 0.0 && bytes > 0.0 ? 0.5 * pages * bytes / (1024.0 * 1024.0) : 0.0;
}

void progress_begin(struct progress *progress, const char *label, size_t total, bool quiet)
{
    progress->label = label ? label : "";
    progress->total = total ? total : 1;
    progress->start = elapsed_seconds();
    progress->last_draw = progress->start - 1.0;
    progress->shown = !quiet && isatty(STDERR_FILENO);
}

static void print_span(double seconds)
{
    const long s = (long)(seconds + 0.5);
    if (s >= 3600) {
        fprintf(stderr, "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
    } else {
        fprintf(stderr, "%ld:%02ld", s / 60, s % 60);
    }
}

void progress_update(struct progress *progress, size_t done, const char *note)
{
    if (!progress->shown) {
        return;
    }
    const double now = elapsed_seconds();
    if (done > progress->total) {
        done = progress->total;
    }
    if (now - progress->last_draw < 0.1 && done != progress->total) {
        return;
    }
    progress->last_draw = now;
    const double share = (double)done / (double)progress->total;
    const int filled = (int)(share * BAR_WIDTH);
    fprintf(stderr, "\r\033[K%s [", progress->label);
    for (int i = 0; i < BAR_WIDTH; ++i) {
        fputc(i < filled ? '#' : '.', stderr);
    }
    fprintf(stderr, "] %3d%% ", (int)(share * 100.0));
    print_span(now - progress->start);
    if (done > 0 && done < progress->total) {
        fputs(" left ", stderr);
        print_span((now - progress->start) * (1.0 - share) / share);
    }
    if (note) {
        fprintf(stderr, "  %s", note);
    }
    fflush(stderr);
}

void progress_end(struct progress *progress)
{
    if (progress->shown) {
        fputs("\r\033[K", stderr);
        fflush(stderr);
        progress->shown = false;
    }
}
