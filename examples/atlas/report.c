/* report.c - output of `atlas build`. */
#include "atlas/atlas.h"

#include "base/json.h"
#include "base/progress.h"
#include "base/threads.h"
#include "pictures/plot.h"
#include "shapes/shape_pictures.h"
#include "springls/run_options.h"
#include "surface/mesh_io.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DRAWN_MODES = 3, DRAWN_SUBJECTS = 8 };

/* Returns the mean distance of the model's vertices from the subjects' surfaces. */
static double mean_distance(const struct atlas_build *build)
{
    double sum = 0.0;
    for (int s = 0; s < build->settings.count; ++s) {
        sum += build->subjects[s].mean_distance / build->settings.count;
    }
    return sum;
}

static void print_summary(const struct atlas_build *build)
{
    const struct atlas *atlas = &build->atlas;
    const struct atlas_truth *truth = &build->truth;
    printf("%d subjects, %d vertices, %d modes, voxels of %.3g mm, %.1f s\n", build->settings.count, atlas->mean.vertex_count,
           atlas->model.modes, atlas->voxel, build->seconds);
    if (!build->settings.same_vertices) {
        printf("model to subjects' surfaces: %.3f mm\n", mean_distance(build));
    }
    if (build->curves.modes > 0) {
        printf("first mode holds %.1f %% of the variance; left out subjects are met within %.3f mm\n",
               100.0 * build->curves.compactness[0], build->curves.generalization[build->curves.modes - 1]);
    }
    if (truth->known) {
        printf("correspondences: %.2f +- %.2f mm (%.2f voxels) from the true ones; subject to subject %.2f mm; "
               "aligned and nearest place %.2f mm\n",
               truth->mean, truth->deviation, truth->mean / atlas->voxel, truth->between_mean, truth->rigid_mean);
    }
}

/* ---- JSON ---- */

static void report_subjects(struct json_writer *json, const struct atlas_build *build)
{
    json_array_begin(json, "subjects");
    for (int s = 0; s < build->settings.count; ++s) {
        const struct atlas_subject *subject = &build->subjects[s];
        json_object_begin(json, NULL);
        json_string(json, "name", subject->name);
        json_number(json, "scale", subject->pose.scale);
        json_number(json, "cost", subject->cost);
        json_number(json, "mean_distance_mm", subject->mean_distance);
        json_number(json, "max_distance_mm", subject->largest_distance);
        json_integer(json, "steps", subject->steps);
        json_object_end(json);
    }
    json_array_end(json);
}

static void report_truth(struct json_writer *json, const struct atlas_build *build)
{
    const struct atlas_truth *truth = &build->truth;
    const double voxel = build->atlas.voxel;
    json_object_begin(json, "against_true_correspondences");
    json_number(json, "mean_mm", truth->mean);
    json_number(json, "std_mm", truth->deviation);
    json_number(json, "p95_mm", truth->p95);
    json_number(json, "max_mm", truth->worst);
    json_number(json, "mean_voxels", truth->mean / voxel);
    json_number(json, "subject_to_subject_mean_mm", truth->between_mean);
    json_number(json, "subject_to_subject_p95_mm", truth->between_p95);
    json_number(json, "subject_to_subject_mean_voxels", truth->between_mean / voxel);
    json_number(json, "aligned_nearest_mean_mm", truth->rigid_mean);
    json_object_end(json);
}

static bool report(const struct atlas_build *build, const char *path)
{
    const struct atlas *atlas = &build->atlas;
    struct json_writer json;
    if (!json_open(&json, path)) {
        return cli_write_failed("atlas", path);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "program", "atlas build");
    json_string(&json, "params", build->settings.common.params);
    json_integer(&json, "vertices", atlas->mean.vertex_count);
    json_integer(&json, "springls", atlas->mean.triangle_count);
    json_integer(&json, "modes", atlas->model.modes);
    json_number(&json, "voxel_mm", atlas->voxel);
    json_integer(&json, "landmarks", build->template.landmark_count);
    json_bool(&json, "scale_removed", !build->settings.keep_scale);
    json_bool(&json, "open", build->template.open);
    json_number(&json, "mean_distance_mm", build->settings.same_vertices ? (double)NAN : mean_distance(build));
    json_numbers(&json, "deviations_mm", atlas->model.deviation, (size_t)atlas->model.modes);
    if (build->curves.modes > 0) {
        const size_t modes = (size_t)build->curves.modes;
        json_numbers(&json, "compactness", build->curves.compactness, modes);
        json_numbers(&json, "generalisation_mm", build->curves.generalization, modes);
        json_numbers(&json, "specificity_mm", build->curves.specificity, modes);
    }
    if (build->truth.known) {
        report_truth(&json, build);
    }
    report_subjects(&json, build);
    json_number(&json, "seconds_correspond", build->correspond_seconds);
    json_number(&json, "seconds", build->seconds);
    json_string(&json, "backend", run_backend_name(build->backend));
    json_integer(&json, "threads", threads_count());
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("atlas", path);
}

/* ---- pictures and meshes ---- */

static bool write_mesh(const char *folder, const char *name, const struct shape_mesh *mesh, const float *shape,
                       const float *colors) {
    char path[1024], error[MESH_TEXT];
    const struct mesh_arrays ply = {.positions = shape, .vertex_count = (size_t)mesh->vertex_count,
                                 .indices = (const uint32_t *)(const void *)mesh->triangles,
                                 .triangle_count = (size_t)mesh->triangle_count, .colors = colors,
                                 .originals = mesh->positions, .comment = "millimetres; a: the place on the mean shape"};
    run_path(folder, name, path, sizeof path);
    return mesh_write_ply(path, &ply, error) || atlas_fail("%s", error);
}

/* Computes the mean shape, moved by twice the deviation of a mode; side: -1, 0 or 1. */
static void mode_shape(const struct atlas *atlas, int mode, int side, int modes, float *shape)
{
    double weights[DRAWN_MODES] = {0.0};
    weights[mode] = 2.0 * side;
    shape_model_shape(&atlas->model, weights, modes, shape);
}

/* Draws rows of mean - 2 deviations, mean, mean + 2 deviations, colored by the outward displacement (paper, Fig. 20). */
static bool draw_modes(const struct atlas_build *build, const char *folder)
{
    const struct atlas *atlas = &build->atlas;
    const struct shape_mesh *mean = &atlas->mean;
    const int modes = atlas->model.modes < DRAWN_MODES ? atlas->model.modes : DRAWN_MODES;
    struct image pictures[3 * DRAWN_MODES] = {{0, 0, NULL}};
    char captions[3 * DRAWN_MODES][64], path[1024], name[64];
    const char *list[3 * DRAWN_MODES];
    const size_t coordinates = 3 * (size_t)mean->vertex_count;
    float *shape = malloc(coordinates * sizeof *shape), *colors = malloc(coordinates * sizeof *colors);
    struct shape_view view = shape_view_make(mean, 340, 300);
    bool good = (shape && colors) || atlas_no_memory();
    for (int at = 0; good && at < 3 * modes; ++at) {
        mode_shape(atlas, at / 3, at % 3 - 1, modes, shape);
        shape_view_include(&view, shape, mean->vertex_count);
    }
    for (int m = 0; good && m < modes; ++m) {
        const float full = (float)(3.0 * atlas->model.deviation[m] / sqrt((double)mean->vertex_count));
        for (int side = -1; good && side <= 1; ++side) {
            const int at = 3 * m + side + 1;
            mode_shape(atlas, m, side, modes, shape);
            colors_by_offset(mean, shape, full, colors);
            snprintf(captions[at], sizeof captions[at], side == 0 ? "mean" : "mode %d, %+d deviations", m + 1, 2 * side);
            list[at] = captions[at];
            snprintf(name, sizeof name, "mode%d_%s.ply", m + 1, side < 0 ? "minus2" : "plus2");
            good = (shape_picture(mean, shape, colors, NULL, &view, &pictures[at]) || atlas_no_memory())
                && (side == 0 || write_mesh(folder, name, mean, shape, colors));
        }
    }
    free(shape);
    free(colors);
    run_path(folder, "modes.png", path, sizeof path);
    return good && (modes == 0 || pictures_write(pictures, list, 3 * modes, 3, path) || cli_write_failed("atlas", path));
}

/* Draws subjects with one color for each place of the mean shape: equal colors correspond. */
static bool draw_subjects(const struct atlas_build *build, const char *folder)
{
    const struct shape_mesh *mean = &build->atlas.mean;
    const int count = build->settings.count < DRAWN_SUBJECTS ? build->settings.count : DRAWN_SUBJECTS;
    struct shape_view view = shape_view_make(mean, 300, 270);
    struct image pictures[DRAWN_SUBJECTS + 1] = {{0, 0, NULL}};
    const char *captions[DRAWN_SUBJECTS + 1];
    char path[1024];
    bool good = true;
    for (int s = 0; s < count; ++s) {
        shape_view_include(&view, build->shapes[s], mean->vertex_count);
    }
    for (int s = 0; good && s <= count; ++s) {
        const char *name = s > 0 ? build->subjects[s - 1].name : "mean", *slash = strrchr(name, '/');
        captions[s] = slash ? slash + 1 : name;
        good = shape_picture(mean, s > 0 ? build->shapes[s - 1] : mean->positions, NULL, mean->positions, &view, &pictures[s])
            || atlas_no_memory();
    }
    run_path(folder, "subjects.png", path, sizeof path);
    const int columns = count < 5 ? count + 1 : (count + 2) / 2;
    return good && (pictures_write(pictures, captions, count + 1, columns, path) || cli_write_failed("atlas", path));
}

static bool draw_curves(const struct atlas_build *build, const char *folder)
{
    const struct shape_curves *curves = &build->curves;
    const double *values[3] = {curves->compactness, curves->generalization, curves->specificity};
    static const char *const titles[3] = {"compactness", "generalisation, mm", "specificity, mm"};
    struct image pictures[3] = {{0, 0, NULL}};
    const char *const captions[3] = {NULL, NULL, NULL};
    double *x = malloc(((size_t)curves->modes + 1) * sizeof *x);
    char path[1024];
    bool good = x != NULL || atlas_no_memory();
    for (int m = 0; good && m < curves->modes; ++m) {
        x[m] = m + 1;
    }
    for (int p = 0; good && p < 3; ++p) {
        const struct plot_series series = {.x = x, .y = values[p], .count = (size_t)curves->modes, .style = p, .marks = true};
        const struct plot plot = {
            .title = titles[p], .x_label = "modes", .y_from_zero = true, .series = &series, .series_count = 1};
        good = plot_render(&plot, 420, 320, &pictures[p]) || atlas_no_memory();
    }
    free(x);
    run_path(folder, "curves.png", path, sizeof path);
    return good && (pictures_write(pictures, captions, 3, 3, path) || cli_write_failed("atlas", path));
}

/* Writes the corresponding points of all subjects: subjects/NNN_name, particles/NNN_name; and weights.csv. */
static bool write_points(const struct atlas_build *build, const char *folder)
{
    const struct shape_mesh *mean = &build->atlas.mean;
    char subjects[1024], particles[1024], name[150];
    run_path(folder, "subjects", subjects, sizeof subjects);
    run_path(folder, "particles", particles, sizeof particles);
    bool good = run_make_folder("atlas", subjects) == CLI_CONTINUE
             && (build->settings.same_vertices || run_make_folder("atlas", particles) == CLI_CONTINUE);
    for (int s = 0; good && s < build->settings.count; ++s) {
        const struct atlas_subject *subject = &build->subjects[s];
        atlas_short_name(subject->name, s, name, sizeof name);
        good = atlas_write_vertices(subjects, name, mean, subject->shape)
            && (!subject->particles || atlas_write_particles(particles, name, mean, subject->particles));
    }
    return good && atlas_write_weights(folder, &build->atlas, build->settings.names, build->shapes, build->settings.count);
}

static bool write_all(const struct atlas_build *build)
{
    const char *folder = build->settings.common.out;
    const struct shape_mesh *mean = &build->atlas.mean;
    float *colors = malloc(3 * (size_t)mean->vertex_count * sizeof *colors);
    char path[1024];
    if (!colors) {
        return atlas_no_memory();
    }
    colors_by_region(build->atlas.regions, mean->vertex_count, colors);
    const bool meshes = atlas_write(folder, &build->atlas) && write_mesh(folder, "mean.ply", mean, mean->positions, colors);
    free(colors);
    run_path(folder, "report.json", path, sizeof path);
    return meshes && write_points(build, folder) && draw_modes(build, folder) && draw_subjects(build, folder)
        && (build->curves.modes == 0 || draw_curves(build, folder)) && report(build, path);
}

bool atlas_build_output(const struct atlas_build *build)
{
    const struct cli_common *common = &build->settings.common;
    if (cli_may_print(common)) {
        print_summary(build);
    }
    return (!common->out || write_all(build)) && (!common->json || report(build, common->json));
}
