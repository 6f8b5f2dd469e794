/* fields.c - the two images, and the fields between them: found, or read from a file. */
#include "register/run.h"

#include "imaging/segment_image.h"
#include "registration/points.h"
#include "surface/mesh_io.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool register_fail(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    cli_failed("register", format, arguments);
    va_end(arguments);
    return false;
}

bool register_no_memory(void) { return register_fail("not enough memory"); }

bool register_read_labels(const struct run *run, bool of_moving, const char *path, struct volume *labels)
{
    char error[VOLUME_TEXT];
    const struct volume *image = of_moving ? &run->moving : &run->fixed;
    const int frame = of_moving ? run->moving_frame : run->fixed_frame;
    return volume_read_like(image, of_moving ? "the moving image" : "the fixed image", path, frame, labels, error)
           || register_fail("%s", error);
}

/* Returns whether a label map, if there is one, can be read and lies on the grid of its image. */
static bool labels_fit(const struct run *run, bool of_moving, const char *path)
{
    struct volume labels;
    if (!path) {
        return true;
    }
    const bool fit = register_read_labels(run, of_moving, path, &labels);
    volume_print_warning(&labels, "register", path);
    volume_free(&labels);
    return fit;
}

bool register_mark_label(const struct run *run, struct volume *labels)
{
    const size_t total = volume_voxels(labels);
    const uint32_t wanted = (uint32_t)run->label;
    uint8_t *mask = malloc(total);
    if (!mask) {
        return register_no_memory();
    }
    segment_mask(labels, &wanted, run->label >= 0, mask);
    for (size_t n = 0; n < total; ++n) {
        labels->data[n] = mask[n];
    }
    free(mask);
    return true;
}

static bool has_label(const struct run *run, const struct volume *labels)
{
    bool found = false;
    for (size_t n = 0; !found && n < volume_voxels(labels); ++n) {
        const uint32_t id = labels->ids ? labels->ids[n] : 0;
        found = labels->ids ? (run->label < 0 ? id != 0 : id == (uint32_t)run->label)
                            : (run->label < 0 ? labels->data[n] != 0.0f : labels->data[n] == (float)run->label);
    }
    return found;
}

/* The same of a label map that is to be compared: two empty objects would overlap perfectly. */
static bool labels_compare(const struct run *run, bool of_moving, const char *path)
{
    struct volume labels;
    if (!path) {
        return true;
    }
    char error[VOLUME_TEXT];
    bool good = register_read_labels(run, of_moving, path, &labels);
    volume_print_warning(&labels, "register", path);
    good = good && (volume_check_labels(&labels, path, error) || register_fail("%s", error));
    if (good && !has_label(run, &labels)) {
        good = run->label < 0 ? register_fail("%s: no voxel has a label", path)
                              : register_fail("%s: no voxel has the label %d", path, run->label);
    }
    volume_free(&labels);
    return good;
}

bool register_read_landmarks(const struct run *run, float **fixed, float **moving, size_t *count)
{
    char error[VOLUME_TEXT];
    size_t moving_count = 0;
    *fixed = *moving = NULL;
    *count = 0;
    const bool read = points_read(run->fixed_points_path, &run->fixed, fixed, count, error)
        && points_read(run->moving_points_path, &run->moving, moving, &moving_count, error);
    if (read && *count == moving_count) {
        return true;
    }
    free(*fixed);
    free(*moving);
    *fixed = *moving = NULL;
    if (!read) {
        return register_fail("%s", error);
    }
    return register_fail("%s has %zu points, %s has %zu", run->fixed_points_path, *count, run->moving_points_path, moving_count);
}

static bool landmarks_readable(const struct run *run)
{
    float *fixed, *moving;
    size_t count;
    if (!run->fixed_points_path) {
        return true;
    }
    const bool good = register_read_landmarks(run, &fixed, &moving, &count);
    free(fixed);
    free(moving);
    return good;
}

/* Returns whether the points, or the mesh below, if there are any, can be read. */
static bool points_readable(const struct volume *image, const char *path)
{
    char error[VOLUME_TEXT];
    float *points = NULL;
    size_t count;
    const bool good = !path || points_read(path, image, &points, &count, error) || register_fail("%s", error);
    free(points);
    return good;
}

static bool mesh_readable(const char *path)
{
    char error[MESH_TEXT];
    struct mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    const bool good = !path || mesh_read(path, &mesh, error) || register_fail("%s", error);
    mesh_free(&mesh);
    return good;
}

static bool carried_readable(const struct run *run, bool of_moving, const struct carried *files)
{
    return labels_fit(run, of_moving, files->labels) && points_readable(of_moving ? &run->moving : &run->fixed, files->points)
        && mesh_readable(files->mesh);
}

/* Returns false after a line where one image is a label map and the other is none: nothing goes together. */
static bool kinds_fit(const struct run *run)
{
    const bool fixed = volume_is_label_map(&run->fixed), moving = volume_is_label_map(&run->moving);
    if (fixed == moving || run->settings.similarity != REGISTER_AUTO || run->field_path) {
        return true;
    }
    return register_fail("%s is a label map, %s is a scan: register two scans or two label maps (--similarity makes it go on)",
                         fixed ? run->fixed_path : run->moving_path, fixed ? run->moving_path : run->fixed_path);
}

static bool read_images(struct run *run, char error[VOLUME_TEXT])
{
    volume_choose_series(run->fixed_series, "--fixed-series");
    bool read = volume_read_gaps(run->fixed_path, run->fixed_frame, "--fixed-frame", &run->fixed, error);
    volume_choose_series(run->moving_series, "--moving-series");
    read = read && volume_read_gaps(run->moving_path, run->moving_frame, "--moving-frame", &run->moving, error);
    volume_choose_series(NULL, NULL);
    return read;
}

bool register_read(struct run *run)
{
    char error[VOLUME_TEXT];
    if (!read_images(run, error)) {
        return register_fail("%s", error);
    }
    volume_print_warning(&run->fixed, "register", "fixed image");
    volume_print_warning(&run->moving, "register", "moving image");
    return kinds_fit(run) && register_drop_gaps(run) && labels_compare(run, false, run->fixed_labels_path)
        && labels_compare(run, true, run->moving_labels_path) && landmarks_readable(run) && carried_readable(run, true, &run->warp)
        && carried_readable(run, false, &run->inverse_warp);
}

bool register_fields(struct run *run)
{
    char error[VOLUME_TEXT];
    double remains = 0.0;
    if (run->field_path) {
        struct field read;
        if (!field_read(run->field_path, &read, error)) {
            return register_fail("%s", error);
        }
        const bool good = field_create(&run->fixed, &run->forward);
        if (good) {
            field_sample(field_map_points, &read, &run->forward);
        }
        field_free(&read);
        return (good && field_invert(&run->forward, &run->moving, &run->inverse, &remains)) || register_no_memory();
    }
    if (!register_images(&run->fixed, &run->moving, &run->settings, NULL, &run->registration, error)) {
        return register_fail("%s", error);
    }
    if (run->registration.headers_apart && !run->common.quiet) {
        fprintf(stderr, "register: note: the images do not overlap where their headers place them: begun with their centres of mass "
                        "laid on each other\n");
    }
    if (!field_create(&run->fixed, &run->forward) || !field_create(&run->moving, &run->inverse)) {
        return register_no_memory();
    }
    field_sample(registration_map, &run->registration, &run->forward);
    field_sample(registration_map_back, &run->registration, &run->inverse);
    return true;
}

void register_free(struct run *run)
{
    volume_free(&run->fixed);
    volume_free(&run->moving);
    registration_free(&run->registration);
    field_free(&run->forward);
    field_free(&run->inverse);
    free(run->unmoved);
    free(run->warped);
    free(run->jacobian);
}
