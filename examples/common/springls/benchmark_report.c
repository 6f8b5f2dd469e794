/* benchmark_report.c - JSON output, and the table with the paper's figures. */
#include "springls/benchmark.h"

#include "base/json.h"
#include "base/progress.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static void json_error(struct json_writer *json, const char *name, const struct benchmark_error *error, bool with_std)
{
    char key[48];
    snprintf(key, sizeof key, "%s_mean", name);
    json_number(json, key, error->mean);
    if (with_std) {
        snprintf(key, sizeof key, "%s_std", name);
        json_number(json, key, error->std);
    }
    snprintf(key, sizeof key, "%s_max", name);
    json_number(json, key, error->max);
}

static void json_problem(struct json_writer *json, const struct benchmark *b, const struct benchmark_options *o)
{
    json_string(json, "problem", b->name);
    json_integer(json, "grid", b->grid);
    json_number(json, "period", b->period);
    json_number(json, "duration", b->duration);
    json_string(json, "params", o->common.params);
    json_string(json, "set", o->set ? o->set : "");
    json_string(json, "topology", o->topology);
}

static void json_topology(struct json_writer *json, const struct benchmark_options *o, const struct benchmark_result *r)
{
    json_integer(json, "components", r->components);
    json_integer(json, "euler", r->euler);
    if (o->every_step) {
        json_integer(json, "components_least", r->components_min);
        json_integer(json, "components_most", r->components_max);
        json_integer(json, "euler_least", r->euler_min);
        json_integer(json, "euler_most", r->euler_max);
    }
}

static void json_work(struct json_writer *json, const struct benchmark_result *r)
{
    char hash[24];
    json_integer(json, "added", r->stats.added);
    json_integer(json, "split", r->stats.split);
    json_integer(json, "removed", r->stats.removed);
    json_integer(json, "reshaped", r->stats.reshaped);
    json_integer(json, "refused", r->stats.refused);
    json_number(json, "seconds_total", r->seconds_total);
    json_object_begin(json, "seconds_stage");
    for (int s = 0; s < SPRINGLS_STAGE_COUNT; ++s) {
        json_number(json, springls_stage_name((springls_stage)s), r->seconds_stage[s]);
    }
    json_object_end(json);
    json_number(json, "model_mib", (double)r->model_bytes / 1048576.0);
    json_number(json, "peak_rss_mib", peak_rss_mib());
    snprintf(hash, sizeof hash, "%016" PRIx64, r->state_hash);
    json_string(json, "state_hash", hash);
}

static void json_coverage(struct json_writer *json, const struct benchmark_result *r)
{
    json_number(json, "coverage_min", r->coverage.least.area);
    json_number(json, "coverage_mean", r->coverage.mean.area);
    json_number(json, "coverage_max", r->coverage.most.area);
    json_number(json, "covered_min", r->coverage.least.covered);
    json_number(json, "covered_mean", r->coverage.mean.covered);
    json_number(json, "covered_twice_mean", r->coverage.mean.covered_twice);
    json_number(json, "covered_twice_max", r->coverage.most.covered_twice);
}

bool benchmark_write_json(const struct benchmark *b, const struct benchmark_options *o, const struct benchmark_result *r)
{
    struct json_writer json;
    if (!json_open(&json, o->common.json)) {
        return false;
    }
    json_object_begin(&json, NULL);
    json_problem(&json, b, o);
    json_string(&json, "backend", r->backend);
    json_number(&json, "kernels_per_step", r->kernels_per_step);
    json_number(&json, "downloads_per_step", r->downloads_per_step);
    json_number(&json, "bytes_down_per_step", r->bytes_down_per_step);
    json_integer(&json, "threads", r->threads);
    json_integer(&json, "steps", r->steps);
    json_integer(&json, "springls_initial", r->springls_initial);
    json_number(&json, "springls_mean", r->springls_mean);
    json_coverage(&json, r);
    json_integer(&json, "springls_final", r->springls_final);
    json_error(&json, "deformation", &r->deformation, true);
    json_error(&json, "tracking", &r->tracking, true);
    json_error(&json, "halfway", &r->halfway, true);
    json_error(&json, "surface", &r->surface, false);
    json_number(&json, "volume_change_percent", r->volume_change_percent);
    json_number(&json, "volume_error_percent", r->volume_error_percent);
    json_topology(&json, o, r);
    json_work(&json, r);
    json_object_end(&json);
    return json_close(&json);
}

/* Finds the paper's row for this period and grid, else the nearest of both. */
static const struct benchmark_published *published(const struct benchmark *b)
{
    const struct benchmark_published *best = NULL;
    double best_distance = INFINITY;
    for (int i = 0; i < b->published_count; ++i) {
        const double distance = 10.0 * fabs(log(b->published[i].period / b->period))
                                + fabs(log((double)b->published[i].grid / b->grid));
        if (distance < best_distance) {
            best_distance = distance;
            best = &b->published[i];
        }
    }
    return best;
}

static const char *text(const char *t) { return t ? t : "-"; }

static void spread(const struct benchmark_error *e, char out[32])
{
    snprintf(out, 32, "%.3f +- %.3f", e->mean, e->std);
}

#define ROW "  %-24s %9s  %-16s  %-16s  %-16s  %8s  %8s  %9s\n"

static void print_ours(const struct benchmark *b, const struct benchmark_result *r)
{
    char label[40], springls[16], deformation[32], tracking[32], halfway[32], surface[16], volume[16], seconds[24];
    snprintf(label, sizeof label, "springls, %d^3", b->grid);
    snprintf(springls, sizeof springls, "%.0f", r->springls_mean);
    spread(&r->deformation, deformation);
    spread(&r->tracking, tracking);
    spread(&r->halfway, halfway);
    snprintf(surface, sizeof surface, "%.3f", r->surface.mean);
    snprintf(volume, sizeof volume, "%+.3f %%", r->volume_change_percent);
    snprintf(seconds, sizeof seconds, "%.1f s", r->seconds_total);
    printf(ROW, label, springls, deformation, tracking, halfway, surface, volume, seconds);
}

static void print_paper(const struct benchmark *b)
{
    char label[48];
    const struct benchmark_published *p = published(b);
    if (p) {
        snprintf(label, sizeof label, "%s, %d^3", p->source, p->grid);
        printf(ROW, label, text(p->springls), text(p->deformation), text(p->tracking), "-", "-", text(p->volume),
               text(p->time));
    }
}

void benchmark_print_table(const struct benchmark *b, const struct benchmark_options *o, const struct benchmark_result *r)
{
    printf("%s, grid %d^3, %d steps, %s parameters%s%s, %s, %d thread%s; errors in voxels, mean +- deviation\n", b->title,
           b->grid, r->steps, o->common.params, o->set ? " with " : "", o->set ? o->set : "", r->backend, r->threads,
           r->threads == 1 ? "" : "s");
    printf(ROW, "", "springls", "deformation", "tracking", "at half time", "surface", "volume", "time");
    print_ours(b, r);
    print_paper(b);
    printf("  springls lie over %.0f %% of the zero level (at least %.0f %%), two over %.0f %%; their area is %.2f to %.2f of its\n",
           100.0 * r->coverage.mean.covered, 100.0 * r->coverage.least.covered, 100.0 * r->coverage.mean.covered_twice,
           r->coverage.least.area, r->coverage.most.area);
    printf("  %d component%s, Euler number %d, %.1f steps a second, peak memory %.0f MiB\n", r->components,
           r->components == 1 ? "" : "s", r->euler, r->seconds_total > 0.0 ? r->steps / r->seconds_total : 0.0,
           peak_rss_mib());
    if (o->every_step) {
        printf("  over all steps: %d to %d components, Euler number %d to %d\n", r->components_min, r->components_max,
               r->euler_min, r->euler_max);
    }
}
