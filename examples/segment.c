/* segment - finds an object in a medical image with an active contour.
 *
 *   segment scan.nii.gz --level 150 --init threshold --out result
 *   segment scan.nii.gz --window 100,300 --center 20,-35,10 --radius 15 --out result
 *   segment scan.nii.gz --level 150 --reference labels.nii.gz --label 77,78 --out result
 *
 * The contour is pushed outward where the intensity is inside the window and inward elsewhere, and smoothed by its
 * curvature. It may start anywhere, split and merge. All places and lengths are millimetres in the image's RAS+ axes.
 *
 * It stops after --iterations steps, or, looked at every ten steps, when fewer than 1 in 1000 springls still move by
 * more than 1/100 voxel a step ("at rest"), or when the surface moved by less than 1/50 of --speed a step on average,
 * over those ten ("stalled": what is left is springls going to and fro). */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#include "common/cli.h"
#include "common/image.h"
#include "common/json.h"
#include "common/mesh_io.h"
#include "common/metrics.h"
#include "common/progress.h"
#include "common/raycast.h"
#include "common/segment_image.h"
#include "common/slices.h"
#include "common/volume.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#ifdef _OPENMP
#include <omp.h>
#endif

enum { LOOK_EVERY = 10, MAX_LABELS = 256 };
static const double at_rest = 0.001, stalled = 0.02;
static const char program_name[] = "segment";

struct settings {
    struct cli_common common;
    const char *image, *window, *init, *mask, *init_mesh, *reference, *labels;
    double level, smoothing, speed, radius, ramp;
    float center[3];
    int mask_label, iterations;
    bool dark;
};

struct run {
    struct settings set;
    struct volume image, mask, reference;
    size_t voxels;
    float low, high, ramp;
    float *pressure, *phi, *before; /* each `voxels` floats */
    uint8_t *inside, *truth;
    springls_context *ctx, *ref_ctx;
    springls_mesh surface, ref_surface;
    int steps;
    const char *ended;
    double motion, seconds;
    springls_measures measures;
    struct overlap overlap;
    struct surface_distances distances;
    bool has_distances;
};

static bool talks(const struct settings *set)
{
    return !set->common.quiet && !(set->common.json && strcmp(set->common.json, "-") == 0);
}

static bool complain(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
static bool complain(const char *format, ...)
{
    char text[512];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    cli_fail(program_name, CLI_EXIT_FAILURE, "%s", text);
    return false;
}

static bool good(const springls_context *ctx, springls_status status, const char *doing)
{
    if (status == SPRINGLS_OK) return true;
    const char *why = ctx ? springls_last_error(ctx) : "";
    return complain("%s: %s", doing, why[0] ? why : springls_status_string(status));
}

/* "a,b" with a < b. */
static bool read_window(const char *text, double *low, double *high)
{
    char first[64];
    const char *comma = strchr(text, ',');
    if (!comma || (size_t)(comma - text) >= sizeof first) return false;
    memcpy(first, text, (size_t)(comma - text));
    first[comma - text] = '\0';
    return cli_read_double(first, low) && cli_read_double(comma + 1, high) && *low < *high;
}

/* "a,b,c": the count, or -1. */
static int read_labels(const char *text, int *labels)
{
    int count = 0;
    while (*text) {
        char one[16];
        const size_t length = strcspn(text, ",");
        if (length == 0 || length >= sizeof one || count == MAX_LABELS) return -1;
        memcpy(one, text, length);
        one[length] = '\0';
        if (!cli_read_int(one, &labels[count++])) return -1;
        text += length;
        if (*text == ',' && !*++text) return -1;
    }
    return count > 0 ? count : -1;
}

static bool read_on_grid(const char *path, const struct volume *image, struct volume *labels)
{
    char error[VOLUME_TEXT];
    if (!volume_read(path, 0, labels, error)) return complain("%s", error);
    if (!volume_same_grid(image, labels)) return complain("%.200s: not on the grid of the image", path);
    return true;
}

static springls_grid_desc grid_of(const struct volume *image)
{
    springls_grid_desc grid;
    memset(&grid, 0, sizeof grid);
    for (int r = 0; r < 3; r++) {
        grid.size[r] = image->dims[r];
        grid.spacing[r] = (double)image->spacing[r];
        grid.origin[r] = (double)image->origin[r];
        for (int c = 0; c < 3; c++) grid.direction[3 * r + c] = (double)image->direction[r][c];
    }
    return grid;
}

static bool make_context(const struct run *run, springls_context **ctx)
{
    const springls_params params =
        strcmp(run->set.common.params, "paper") == 0 ? springls_paper_params() : springls_default_params();
    springls_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.grid = grid_of(&run->image);
    desc.params = &params;
    const springls_status status = springls_create(&desc, ctx);
    if (status != SPRINGLS_OK)
        return complain("%.200s: no model on this grid (%d x %d x %d voxels): %s", run->set.image, run->image.dims[0],
                        run->image.dims[1], run->image.dims[2], springls_status_string(status));
    return true;
}

/* ---- >>start ---- */

static bool set_mask(springls_context *ctx, const uint8_t *mask, size_t count)
{
    int32_t *labels = malloc(count * sizeof *labels);
    if (!labels) return complain("not enough memory");
    for (size_t n = 0; n < count; n++) labels[n] = mask[n];
    const springls_status status = springls_set_labels(ctx, labels, 1);
    free(labels);
    return good(ctx, status, "label map");
}

static bool start_from_mesh(struct run *run)
{
    char error[MESH_TEXT];
    struct mesh mesh;
    springls_mesh_report report;
    if (!mesh_read(run->set.init_mesh, &mesh, error)) return complain("%s", error);
    const springls_status status =
        springls_set_mesh(run->ctx, mesh.positions, (int)mesh.vertex_count, 0, (const int *)(const void *)mesh.indices,
                          (int)mesh.triangle_count, &report);
    mesh_free(&mesh);
    return good(run->ctx, status, run->set.init_mesh);
}

static bool start_from_shape(struct run *run)
{
    const struct volume *image = &run->image;
    float center[3], middle[3], extent = INFINITY, radius = (float)run->set.radius;
    for (int a = 0; a < 3; a++) {
        middle[a] = 0.5f * (float)(image->dims[a] - 1);
        extent = fminf(extent, image->spacing[a] * (float)image->dims[a]);
    }
    volume_index_to_world(image, middle, center);
    if (!isnan(run->set.center[0])) memcpy(center, run->set.center, sizeof center);
    if (!(radius > 0)) radius = extent / 3;

    springls_sphere spheres[7] = {{{center[0], center[1], center[2]}, radius}};
    springls_box box = {{center[0], center[1], center[2]}, {radius, radius, radius}};
    springls_torus torus = {{center[0], center[1], center[2]}, {0, 0, 1}, 0.7f * radius, 0.3f * radius};
    springls_metasphere meta = {spheres, 7};
    springls_implicit_fn shape = springls_implicit_sphere;
    void *user = &spheres[0];
    if (strcmp(run->set.init, "cube") == 0) {
        shape = springls_implicit_box;
        user = &box;
    } else if (strcmp(run->set.init, "torus") == 0) {
        shape = springls_implicit_torus;
        user = &torus;
    } else if (strcmp(run->set.init, "metasphere") == 0) { /* a middle one and six around it */
        for (int s = 1; s < 7; s++) {
            spheres[s] = spheres[0];
            spheres[s].center[(s - 1) / 2] += s % 2 ? 0.6f * radius : -0.6f * radius;
            spheres[s].radius = 0.4f * radius;
        }
        spheres[0].radius = 0.5f * radius;
        shape = springls_implicit_metasphere;
        user = &meta;
    }
    return good(run->ctx, springls_set_implicit(run->ctx, shape, user), "start");
}

static bool start(struct run *run)
{
    const struct settings *set = &run->set;
    bool done;
    if (strcmp(set->init, "threshold") == 0) {
        done = good(run->ctx, springls_set_threshold(run->ctx, run->image.data, run->low, run->high), "start");
    } else if (strcmp(set->init, "mask") == 0) {
        done = read_on_grid(set->mask, &run->image, &run->mask);
        if (done) segment_mask(&run->mask, &set->mask_label, set->mask_label < 0 ? 0 : 1, run->inside);
        done = done && set_mask(run->ctx, run->inside, run->voxels);
    } else {
        done = strcmp(set->init, "mesh") == 0 ? start_from_mesh(run) : start_from_shape(run);
    }
    if (done && springls_count(run->ctx) == 0) return complain("the start (--init %s) has no surface", set->init);
    return done;
}

/* ---- >>run ---- */

static bool evolve(struct run *run)
{
    const struct settings *set = &run->set;
    springls_forces forces;
    springls_step_desc step;
    struct progress bar;
    bool fine = true;
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    forces.pressure_grid.data = run->pressure;
    forces.curvature_weight = (float)set->smoothing;
    step.forces = &forces;
    step.mode = SPRINGLS_FLUID;
    step.dt = (float)set->speed; /* a pressure of 1 moves by this many voxels */
    step.max_displacement = 0.75f; /* only a high --speed or a sharp corner is cut into sub-steps */

    run->ended = "iterations used up";
    fine = good(run->ctx, springls_copy_level_set(run->ctx, run->before), "level set");
    const double begin = elapsed_seconds();
    progress_begin(&bar, program_name, (size_t)set->iterations, !talks(set));
    while (fine && run->steps < set->iterations) {
        fine = good(run->ctx, springls_step(run->ctx, &step), "step");
        run->steps++;
        progress_update(&bar, (size_t)run->steps, NULL);
        if (fine && springls_count(run->ctx) == 0) {
            progress_end(&bar);
            return complain("the contour vanished after %d steps: start closer to the object", run->steps);
        }
        if (!fine || run->steps % LOOK_EVERY != 0) continue;
        fine = good(run->ctx, springls_copy_level_set(run->ctx, run->phi), "level set");
        run->motion = segment_motion(run->before, run->phi, run->voxels) / LOOK_EVERY;
        memcpy(run->before, run->phi, run->voxels * sizeof *run->phi);
        if ((double)springls_get_stats(run->ctx).moving < at_rest) {
            run->ended = "at rest";
            break;
        }
        if (run->motion < stalled * set->speed) {
            run->ended = "stalled";
            break;
        }
    }
    progress_end(&bar);
    run->seconds = elapsed_seconds() - begin;
    fine = fine && good(run->ctx, springls_copy_level_set(run->ctx, run->phi), "level set")
        && good(run->ctx, springls_extract_mesh(run->ctx, &run->surface), "surface")
        && good(run->ctx, springls_measure(run->ctx, &run->measures), "measures");
    for (size_t n = 0; fine && n < run->voxels; n++) run->inside[n] = run->phi[n] < 0;
    return fine;
}

static struct surface as_surface(const springls_mesh *mesh)
{
    const struct surface surface = {mesh->positions, (const uint32_t *)(const void *)mesh->triangles,
                                    (size_t)mesh->triangle_count};
    return surface;
}

static bool compare(struct run *run)
{
    const struct surface found = as_surface(&run->surface);
    const float *spacing = run->image.spacing;
    run->overlap = metrics_overlap_masks(run->inside, run->truth, run->voxels);
    if (!make_context(run, &run->ref_ctx) || !set_mask(run->ref_ctx, run->truth, run->voxels)
        || !good(run->ref_ctx, springls_extract_mesh(run->ref_ctx, &run->ref_surface), "reference surface"))
        return false;
    const struct surface truth = as_surface(&run->ref_surface);
    const double tolerance = (double)fmaxf(spacing[0], fmaxf(spacing[1], spacing[2]));
    run->has_distances = metrics_surface_distances(&found, &truth, 0, tolerance, &run->distances);
    return true;
}

/* ---- >>write ---- */

static bool draw(const struct run *run, const char *slices_path, const char *surface_path)
{
    const struct slices_contour contours[2] = {
        {.data = run->phi, .color = {1.0f, 0.35f, 0.2f}, .name = "springls"},
        {.data = run->reference.data, .any_label = true, .width = 1.2f, .color = {0.2f, 0.85f, 1.0f},
         .name = "reference"}};
    const struct slices_view view = {.volume = &run->image, .contours = contours,
                                     .contour_count = run->truth ? 2 : 1, .center = {-1, -1, -1}};
    const float direction[3] = {0.35f, 1.0f, 0.25f}, up[3] = {0, 0, 1}; /* from the front, a little left and above */
    struct raycast_scene scene = {.positions = run->surface.positions, .normals = run->surface.normals,
                                  .vertex_count = (size_t)run->surface.vertex_count,
                                  .indices = (const uint32_t *)(const void *)run->surface.triangles,
                                  .triangle_count = (size_t)run->surface.triangle_count,
                                  .base_color = {0.87f, 0.8f, 0.68f}};
    struct image picture;
    if (!slices_render(&view, &picture)) return complain("not enough memory for %s", slices_path);
    bool written = image_write_png(&picture, slices_path);
    image_free(&picture);
    if (!written) return complain("%s: cannot write there", slices_path);
    scene.camera = raycast_frame_points(scene.positions, scene.vertex_count, direction, up, 30, 1);
    if (!raycast_render(&scene, 900, 900, &picture)) return complain("%s: nothing to draw", surface_path);
    written = image_write_png(&picture, surface_path);
    image_free(&picture);
    return written || complain("%s: cannot write there", surface_path);
}

static bool report(const struct run *run, const char *path)
{
    const struct settings *set = &run->set;
    struct json_writer json;
    if (!json_open(&json, path)) return complain("%s: cannot write there", path);
    json_object_begin(&json, NULL);
    json_string(&json, "program", program_name);
    json_string(&json, "image", set->image);
    json_string(&json, "init", set->init);
    json_number(&json, "window_low", (double)run->low);
    json_number(&json, "window_high", (double)run->high);
    json_number(&json, "ramp", (double)run->ramp);
    json_number(&json, "smoothing", set->smoothing);
    json_number(&json, "speed", set->speed);
    json_string(&json, "params", set->common.params);
    json_integer(&json, "steps", run->steps);
    json_string(&json, "ended", run->ended);
    json_number(&json, "mean_motion", run->motion);
    json_integer(&json, "springls", springls_count(run->ctx));
    json_number(&json, "volume_ml", run->measures.volume / 1000);
    json_number(&json, "area_mm2", run->measures.area);
    json_integer(&json, "components", run->measures.components);
    json_integer(&json, "euler", run->measures.euler);
    json_number(&json, "seconds_steps", run->seconds);
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    if (run->truth) {
        const struct surface_distances *d = &run->distances;
        const double none = (double)NAN;
        json_object_begin(&json, "against_reference");
        json_string(&json, "reference", set->reference);
        json_string(&json, "label", set->labels);
        json_number(&json, "dice", run->overlap.dice);
        json_number(&json, "jaccard", run->overlap.jaccard);
        json_number(&json, "reference_ml", metrics_millilitres(run->overlap.b, run->image.spacing));
        json_number(&json, "mean_distance_mm", run->has_distances ? d->assd : none);
        json_number(&json, "mean_to_reference_mm", run->has_distances ? d->mean_ab : none);
        json_number(&json, "mean_from_reference_mm", run->has_distances ? d->mean_ba : none);
        json_number(&json, "hd95_mm", run->has_distances ? d->hd95 : none);
        json_number(&json, "surface_dice", run->has_distances ? d->surface_dice : none);
        json_number(&json, "tolerance_mm", run->has_distances ? d->tolerance : none);
        json_object_end(&json);
    }
    json_object_end(&json);
    return json_close(&json) || complain("%s: writing failed", path);
}

static bool write_all(const struct run *run, float *scratch)
{
    const char *out = run->set.common.out;
    const char *const names[] = {"labels.nii.gz", "distance.nii.gz", "surface.ply", "slices.png", "surface.png", "report.json"};
    char path[6][1024], error[VOLUME_TEXT];
    struct mesh_ply ply = {.positions = run->surface.positions, .normals = run->surface.normals,
                           .vertex_count = (size_t)run->surface.vertex_count,
                           .indices = (const uint32_t *)(const void *)run->surface.triangles,
                           .triangle_count = (size_t)run->surface.triangle_count, .comment = "millimetres, RAS+"};
    if (mkdir(out, 0777) != 0 && errno != EEXIST) return complain("%s: cannot make this folder", out);
    for (int f = 0; f < 6; f++)
        if (snprintf(path[f], sizeof path[f], "%s/%s", out, names[f]) >= (int)sizeof path[f])
            return complain("--out: the name is too long");
    segment_distance(&run->image, run->phi, scratch);
    if (!volume_write(path[0], &run->image, VOLUME_UINT8, run->inside, error)
        || !volume_write(path[1], &run->image, VOLUME_FLOAT32, scratch, error)
        || !mesh_write_ply(path[2], &ply, error))
        return complain("%s", error);
    return draw(run, path[3], path[4]) && report(run, path[5]);
}

static void say_results(const struct run *run)
{
    printf("%s after %d steps, %.1f s: volume %.2f ml, area %.1f cm2, components %d, %d springls\n", run->ended,
           run->steps, run->seconds, run->measures.volume / 1000, run->measures.area / 100, run->measures.components,
           springls_count(run->ctx));
    if (!run->truth) return;
    printf("reference %.2f ml: Dice %.4f, Jaccard %.4f", metrics_millilitres(run->overlap.b, run->image.spacing),
           run->overlap.dice, run->overlap.jaccard);
    if (run->has_distances)
        printf(", mean surface distance %.3f mm, HD95 %.3f mm", run->distances.assd, run->distances.hd95);
    putchar('\n');
}

/* ---- >>main ---- */

static int check_usage(struct settings *set, int *labels, int *label_count, double window[2])
{
    const bool has_level = !isnan(set->level);
    const char *wrong = NULL;
    *label_count = 0;
    if (set->window && (has_level || set->dark)) wrong = "--window goes without --level and --dark";
    else if (set->window && !read_window(set->window, &window[0], &window[1])) wrong = "--window wants LO,HI with LO < HI";
    else if ((strcmp(set->init, "mask") == 0) != (set->mask != NULL)) wrong = "--init mask and --mask FILE go together";
    else if ((strcmp(set->init, "mesh") == 0) != (set->init_mesh != NULL)) wrong = "--init mesh and --init-mesh FILE go together";
    else if (set->labels && !set->reference) wrong = "--label goes with --reference FILE";
    else if (set->labels && (*label_count = read_labels(set->labels, labels)) < 0) wrong = "--label wants whole numbers: K or K1,K2,...";
    return wrong ? cli_fail(program_name, CLI_EXIT_USAGE, "%s", wrong) : CLI_GO_ON;
}

/* Reads everything, allocates, and chooses the window. */
static bool prepare(struct run *run, const double window[2], const int *labels, int label_count)
{
    const struct settings *set = &run->set;
    char error[VOLUME_TEXT];
    if (!volume_read(set->image, 0, &run->image, error)) return complain("%s", error);
    if (run->image.note[0] && talks(set)) printf("note: %s\n", run->image.note);
    if (!(run->image.maximum > run->image.minimum)) return complain("%.200s: all voxels are equal", set->image);
    const float range = run->image.maximum - run->image.minimum;
    run->voxels = volume_voxels(&run->image);
    run->pressure = malloc(run->voxels * sizeof(float));
    run->phi = malloc(run->voxels * sizeof(float));
    run->before = malloc(run->voxels * sizeof(float));
    run->inside = malloc(run->voxels);
    if (!run->pressure || !run->phi || !run->before || !run->inside) return complain("not enough memory");

    if (set->window) {
        run->low = (float)window[0];
        run->high = (float)window[1];
    } else {
        const float level = isnan(set->level) ? segment_otsu(&run->image) : (float)set->level;
        if (level <= run->image.minimum || level >= run->image.maximum)
            return complain("level %g is not between the image's %g and %g", (double)level,
                            (double)run->image.minimum, (double)run->image.maximum);
        run->low = set->dark ? run->image.minimum - range : level; /* an open end: the ramp never gets there */
        run->high = set->dark ? level : run->image.maximum + range;
        if (isnan(set->level) && talks(set)) printf("level %.6g (Otsu's threshold)\n", (double)level);
    }
    run->ramp = (float)set->ramp;
    if (!(run->ramp > 0))
        run->ramp = 0.1f * (segment_percentile(&run->image, 0.995) - segment_percentile(&run->image, 0.005));
    if (!(run->ramp > 0)) run->ramp = 0.1f * range;
    run->ramp = fminf(run->ramp, 0.5f * (run->high - run->low)); /* the middle of a window pushes fully */
    segment_pressure(&run->image, run->low, run->high, run->ramp, run->pressure);

    if (!set->reference) return true;
    if (!read_on_grid(set->reference, &run->image, &run->reference)) return false;
    run->truth = malloc(run->voxels);
    if (!run->truth) return complain("not enough memory");
    if (segment_mask(&run->reference, labels, label_count, run->truth) == 0)
        return complain("%.200s: no voxel has the label asked for", set->reference);
    for (size_t n = 0; n < run->voxels; n++) run->reference.data[n] = run->truth[n];
    return true;
}

static void clean_up(struct run *run)
{
    if (run->ref_ctx) springls_mesh_free(run->ref_ctx, &run->ref_surface);
    if (run->ctx) springls_mesh_free(run->ctx, &run->surface);
    springls_destroy(run->ref_ctx);
    springls_destroy(run->ctx);
    volume_free(&run->image);
    volume_free(&run->mask);
    volume_free(&run->reference);
    free(run->pressure);
    free(run->phi);
    free(run->before);
    free(run->inside);
    free(run->truth);
}

int main(int argc, char **argv)
{
    static struct run run; /* zero-initialised */
    struct settings *set = &run.set;
    int labels[MAX_LABELS], label_count = 0;
    double window[2] = {0, 0};
    set->common = cli_common_defaults();
    set->init = "sphere";
    set->level = (double)NAN;
    set->smoothing = 0.1;
    set->speed = 0.5;
    set->iterations = 200;
    set->mask_label = -1;
    set->center[0] = set->center[1] = set->center[2] = NAN;
    const struct cli_option options[] = {
        {.name = "level", .type = CLI_DOUBLE, .destination = &set->level, .value = "L", .help = "the object is brighter than L; without: Otsu's threshold"},
        {.name = "dark", .type = CLI_FLAG, .destination = &set->dark, .help = "the object is darker than the level"},
        {.name = "window", .type = CLI_STRING, .destination = &set->window, .value = "LO,HI", .help = "the object lies between LO and HI"},
        {.name = "ramp", .type = CLI_DOUBLE, .destination = &set->ramp, .value = "R", .help = "full pressure this far from the level; 0: a tenth of the image's range", .minimum = 0, .maximum = 1e9},
        {.name = "init", .type = CLI_CHOICE, .destination = &set->init, .choices = "sphere|cube|torus|metasphere|mask|threshold|mesh", .help = "where the contour starts"},
        {.name = "center", .type = CLI_FLOAT3, .destination = set->center, .value = "X,Y,Z", .help = "centre of the starting shape, mm; without: of the image"},
        {.name = "radius", .type = CLI_DOUBLE, .destination = &set->radius, .value = "MM", .help = "its radius or half side; 0: a third of the image's shortest side", .minimum = 0, .maximum = 1e6},
        {.name = "mask", .type = CLI_STRING, .destination = &set->mask, .value = "FILE", .help = "label map to start from"},
        {.name = "mask-label", .type = CLI_INT, .destination = &set->mask_label, .value = "K", .help = "its label; -1: all but 0", .minimum = -1, .maximum = 1e9},
        {.name = "init-mesh", .type = CLI_STRING, .destination = &set->init_mesh, .value = "FILE", .help = "mesh to start from, mm"},
        {.name = "iterations", .type = CLI_INT, .destination = &set->iterations, .value = "N", .help = "steps at most", .minimum = 0, .maximum = 1000000},
        {.name = "speed", .type = CLI_DOUBLE, .destination = &set->speed, .value = "V", .help = "voxels a step at full pressure", .minimum = 0.001, .maximum = 2},
        {.name = "smoothing", .type = CLI_DOUBLE, .destination = &set->smoothing, .value = "W", .help = "weight of the curvature against the pressure", .minimum = 0, .maximum = 1},
        {.name = "reference", .type = CLI_STRING, .destination = &set->reference, .value = "FILE", .help = "label map to compare with"},
        {.name = "label", .type = CLI_STRING, .destination = &set->labels, .value = "K[,K2..]", .help = "its labels; without: all but 0"},
    };
    const struct cli_positional image = {"IMAGE", &set->image, "NIfTI image", true};
    const struct cli_program program = {.name = program_name, .summary = "finds an object in an image with an active contour",
                                        .common = &set->common, .common_without = CLI_WITHOUT_GRID | CLI_WITHOUT_BACKEND | CLI_WITHOUT_SEED,
                                        .options = options, .option_count = (int)(sizeof options / sizeof options[0]),
                                        .positionals = &image, .positional_count = 1};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_GO_ON) status = check_usage(set, labels, &label_count, window);
    if (status != CLI_GO_ON) return status;
#ifdef _OPENMP
    if (set->common.threads > 0) omp_set_num_threads(set->common.threads);
#endif
    bool done = prepare(&run, window, labels, label_count) && make_context(&run, &run.ctx) && start(&run)
             && evolve(&run) && (!run.truth || compare(&run));
    if (done && talks(set)) say_results(&run);
    done = done && (!set->common.out || write_all(&run, run.before)) && (!set->common.json || report(&run, set->common.json));
    clean_up(&run);
    return done ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
}
