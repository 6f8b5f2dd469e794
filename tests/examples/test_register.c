/* examples/register and what it stands on: registration, landmarks, what is carried along.
 * Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_register_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_register_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "elastix_parameters.h"
#include "made_images.h"

/* ---- registration ---- */

/* Another grid, turned axes, a turn by 12 degrees and a shift: back within a twentieth of a voxel of 1.5 mm; a sheared and
 * scaled one too. */
TEST affine_maps_are_found(void)
{
    const int dims[3] = {32, 30, 28}, other[3] = {36, 36, 24};
    const float spacing[3] = {1.5f, 1.5f, 1.5f}, other_spacing[3] = {1.4f, 1.3f, 2.0f};
    struct volume fixed, moving;
    float center[3];
    ASSERT(make_grid(dims, spacing, true, &fixed));
    ASSERT(make_grid(other, other_spacing, true, &moving));
    middle_of(&fixed, center);
    for (int a = 0; a < 3; ++a) { /* the two boxes have one middle */
        float middle[3];
        middle_of(&moving, middle);
        moving.affine[a][3] += (double)(center[a] - middle[a]);
    }
    paint(&fixed, center, NULL, NULL);
    for (int kind = REGISTER_ALIGN_RIGID; kind <= REGISTER_ALIGN_AFFINE; ++kind) {
        const double c = cos(0.21), s = sin(0.21), bend = kind == REGISTER_ALIGN_AFFINE ? 0.1 : 0.0;
        double back[3][4] = {{c * (1.0 + bend), -s, bend, 0.0}, {s, c, 0.0, 0.0}, {0.0, 0.0, 1.0 - bend, 0.0}};
        double found[3][4], identity[3][4];
        const double shift[3] = {2.0, -1.5, 1.0};
        register_identity(found);
        register_identity(identity);
        for (int r = 0; r < 3; ++r) { /* about the middle, and a shift */
            back[r][3] = (double)center[r] + shift[r];
            for (int a = 0; a < 3; ++a) back[r][3] -= back[r][a] * (double)center[a];
        }
        paint(&moving, center, affine_map, back);
        ASSERT(register_affine(&fixed, &moving, (enum register_align)kind, found));
        /* The phantom's place x is found where back() takes it to x: back after found is the identity. */
        double sum = 0.0, number = 0.0;
        for (size_t n = 0; n < volume_voxels(&fixed); n += 7) {
            float index[3], x[3], r[3];
            place_of(fixed.dims, n, index);
            volume_index_to_world(&fixed, index, x);
            vec3_sub(x, center, r);
            if (vec3_length(r) > 15.0f) continue;
            float y[3];
            volume_apply((const double(*)[4])found, x, y);
            volume_apply((const double(*)[4])back, y, y);
            vec3_sub(y, x, y);
            sum += (double)vec3_length(y);
            number += 1.0;
        }
        ASSERT(sum / number < 0.05 * 1.5);
    }
    volume_free(&fixed);
    volume_free(&moving);
    PASS();
}

struct scene {
    struct volume fixed, moving;
    struct beat beat;
    struct beat_time there;
};

/* The phantom at rest and contracted, on a turned grid of anisotropic voxels. */
static bool make_scene(struct scene *scene)
{
    const int dims[3] = {36, 30, 28};
    const float spacing[3] = {1.2f, 1.4f, 1.6f};
    float center[3];
    if (!make_grid(dims, spacing, true, &scene->fixed) || !make_grid(dims, spacing, true, &scene->moving)) return false;
    middle_of(&scene->fixed, center);
    const double middle[3] = {(double)center[0], (double)center[1], (double)center[2]};
    scene->beat = beat_of(middle, 10.0);
    scene->there = (struct beat_time){&scene->beat, 0.6};
    const struct beat_time back = {&scene->beat, -0.6};
    paint(&scene->fixed, center, NULL, NULL);
    paint(&scene->moving, center, beat_map, &back);
    return true;
}

static void free_scene(struct scene *scene)
{
    volume_free(&scene->fixed);
    volume_free(&scene->moving);
}

/* Motion of 1.9 mm on average comes back within a quarter of a voxel, forward and back are inverse, nothing folds. */
TEST demons_find_a_known_motion(void)
{
    struct scene scene;
    struct registration reg;
    struct register_settings set = register_defaults();
    char error[VOLUME_TEXT];
    size_t folded = 1;
    ASSERT(make_scene(&scene));
    set.align = REGISTER_ALIGN_NONE;
    ASSERTm(error, register_images(&scene.fixed, &scene.moving, &set, NULL, &reg, error));
    const double before = difference(&scene.fixed, 13.0f, stay, NULL, beat_map, &scene.there);
    const double after = difference(&scene.fixed, 13.0f, registration_map, &reg, beat_map, &scene.there);
    ASSERT(before > 1.5);
    ASSERT(after < 0.25 * 1.4);
    ASSERT(after < 0.15 * before);
    struct field forward;
    ASSERT(field_create(&scene.fixed, &forward));
    field_sample(registration_map, &reg, &forward);
    float *determinants = malloc(volume_voxels(&scene.fixed) * sizeof *determinants);
    ASSERT(field_jacobian(&forward, determinants, &folded) > 0.1f);
    for (size_t n = 0; n < volume_voxels(&scene.fixed); ++n) {
        float index[3], x[3], y[3];
        place_of(scene.fixed.dims, n, index);
        if (!inner(scene.fixed.dims, index, 3.0f)) continue;
        volume_index_to_world(&scene.fixed, index, x);
        registration_map(&reg, x, 1, y);
        registration_map_back(&reg, y, 1, y);
        vec3_sub(y, x, y);
        ASSERT(vec3_length(y) < 0.2f);
    }
    /* An eighth of the way, eight times. */
    struct registration part;
    ASSERT(registration_substep(&reg, 8, &part));
    for (size_t n = 0; n < volume_voxels(&scene.fixed); n += 11) {
        float index[3], x[3], y[3];
        place_of(scene.fixed.dims, n, index);
        if (!inner(scene.fixed.dims, index, 3.0f)) continue;
        volume_index_to_world(&scene.fixed, index, x);
        registration_map(&reg, x, 1, y);
        for (int i = 0; i < 8; ++i) registration_map(&part, x, 1, x);
        vec3_sub(y, x, y);
        ASSERT(vec3_length(y) < 0.1f);
    }
    registration_free(&part);
    free(determinants);
    field_free(&forward);
    registration_free(&reg);
    free_scene(&scene);
    PASS();
}

/* Another scale of intensities: found by matching means and deviations, or by local correlation, which bears a sensitivity
 * that changes across the image. A first guess is taken. */
TEST scales_of_intensities_do_not_matter(void)
{
    struct scene scene;
    char error[VOLUME_TEXT];
    ASSERT(make_scene(&scene));
    for (int kind = 0; kind < 2; ++kind) {
        struct registration reg, again;
        struct register_settings set = register_defaults();
        set.similarity = kind == 0 ? REGISTER_SSD : REGISTER_LCC;
        set.align = REGISTER_ALIGN_NONE;
        scene.moving.minimum = INFINITY;
        scene.moving.maximum = -INFINITY;
        for (size_t n = 0; n < volume_voxels(&scene.moving); ++n) {
            const float across = (float)(n % 36) / 36.0f;
            float *value = &scene.moving.data[n];
            *value = kind == 0 ? 0.1f * *value - 7.0f : (*value + 7.0f) * (1.0f + 0.8f * across);
            scene.moving.minimum = fminf(scene.moving.minimum, *value);
            scene.moving.maximum = fmaxf(scene.moving.maximum, *value);
        }
        ASSERTm(error, register_images(&scene.fixed, &scene.moving, &set, NULL, &reg, error));
        ASSERT(reg.relation.kind != RELATION_SAME);
        ASSERT(difference(&scene.fixed, 13.0f, registration_map, &reg, beat_map, &scene.there) < 0.4 * 1.4);
        set.iterations = 1;
        set.levels = 1;
        ASSERTm(error, register_images(&scene.fixed, &scene.moving, &set, &reg, &again, error));
        ASSERT(difference(&scene.fixed, 13.0f, registration_map, &again, beat_map, &scene.there) < 0.45 * 1.4);
        registration_free(&again);
        registration_free(&reg);
    }
    free_scene(&scene);
    PASS();
}

static void set_extremes(struct volume *volume)
{
    volume->minimum = INFINITY;
    volume->maximum = -INFINITY;
    for (size_t n = 0; n < volume_voxels(volume); ++n) {
        if (!isfinite(volume->data[n])) continue;
        volume->minimum = fminf(volume->minimum, volume->data[n]);
        volume->maximum = fmaxf(volume->maximum, volume->data[n]);
    }
}

/* An inverted image, one with a gamma, one with a ramp: the similarity is chosen from the images. */
TEST other_contrasts_are_registered(void)
{
    for (int kind = 0; kind < 3; ++kind) {
        struct scene scene;
        struct registration reg;
        struct register_settings set = register_defaults();
        char error[VOLUME_TEXT];
        ASSERT(make_scene(&scene));
        set.align = REGISTER_ALIGN_NONE;
        set.similarity = REGISTER_AUTO;
        for (size_t n = 0; n < volume_voxels(&scene.moving); ++n) {
            float *value = &scene.moving.data[n];
            const float v = *value / 1000.0f;
            *value = kind == 0   ? 5000.0f - 3.0f * *value
                     : kind == 1 ? 50.0f * v * v * sqrtf(fabsf(v))
                                 : (*value + 1000.0f) * (0.5f + (float)(n % 36) / 36.0f);
        }
        set_extremes(&scene.moving);
        ASSERTm(error, register_images(&scene.fixed, &scene.moving, &set, NULL, &reg, error));
        ASSERT(kind != 0 || (reg.relation.kind == RELATION_LINE && reg.relation.gain < 0.0f));
        ASSERT_EQ(kind == 2, reg.shaded);
        ASSERT(difference(&scene.fixed, 13.0f, registration_map, &reg, beat_map, &scene.there) < 0.4 * 1.4);
        registration_free(&reg);
        free_scene(&scene);
    }
    PASS();
}

/* Gain and offset that change across space are found beside a quarter of pairs that are not in their places, which a motion makes;
 * constant images do not determine them, but no harm is done. */
TEST shading_is_fitted(void)
{
    enum { N = 20 };
    static float a[N * N * N], b[N * N * N], u[3 * N * N * N];
    const int dims[3] = {N, N, N};
    double shading[RELATION_SHADING];
    struct relation line;
    unsigned state = 1;
    for (size_t n = 0; n < N * N * N; ++n) {
        float x[3];
        place_of(dims, n, x);
        b[n] = (float)((state = state * 1664525u + 1013904223u) >> 8) / 16777216.0f;
        u[3 * n] = 1.0f; /* b's values lie a voxel further along x */
        a[n] = (0.7f + 0.03f * (x[0] + 1.0f)) * b[n] + 0.1f - 0.01f * x[1] + 0.0005f * x[2] * x[2];
        a[n] = n % 4 == 0 ? (float)((state = state * 1664525u + 1013904223u) >> 8) / 16777216.0f : a[n];
    }
    a[5] = b[7] = NAN;
    ASSERT(relation_fit(a, b, N * N * N, RELATION_LINE, &line));
    ASSERT(relation_fit_shading(a, b, dims, u, &line, shading));
    for (size_t n = 1; n < N * N * N; n += 4) {
        float x[3];
        place_of(dims, n, x);
        x[0] += 1.0f;
        ASSERT(isnan(b[n]) || isnan(a[n]) || fabsf(relation_unshade(shading, dims, x, b[n]) - a[n]) < 0.02f);
    }
    for (size_t n = 0; n < N * N * N; ++n) b[n] = 0.5f;
    if (relation_fit_shading(a, b, dims, u, &line, shading))
        ASSERT(isfinite(relation_unshade(shading, dims, (const float[3]){1.0f, 2.0f, 3.0f}, 0.5f)));
    PASS();
}

/* Equal content on two scales stays where it is: neither flat ground nor the matching of scales moves anything. */
TEST another_scale_moves_nothing(void)
{
    struct scene scene;
    struct registration reg;
    struct register_settings set = register_defaults();
    char error[VOLUME_TEXT];
    ASSERT(make_scene(&scene));
    for (size_t n = 0; n < volume_voxels(&scene.fixed); ++n) scene.moving.data[n] = 2.0f * scene.fixed.data[n] + 10.0f;
    set_extremes(&scene.moving);
    ASSERTm(error, register_images(&scene.fixed, &scene.moving, &set, NULL, &reg, error));
    ASSERT(difference(&scene.fixed, 100.0f, registration_map, &reg, stay, NULL) < 0.01);
    registration_free(&reg);
    free_scene(&scene);
    PASS();
}

/* A voxel that is NaN takes no part: garbage in a corner that is marked so changes little, and an image fits itself. */
TEST gaps_take_no_part(void)
{
    struct scene scene;
    struct registration reg;
    struct register_settings set = register_defaults();
    char error[VOLUME_TEXT];
    ASSERT(make_scene(&scene));
    set.align = REGISTER_ALIGN_NONE;
    for (int side = 0; side < 2; ++side) {
        struct volume *image = side ? &scene.moving : &scene.fixed;
        for (size_t n = 0; n < volume_voxels(image); ++n) {
            if (n % 36 < 6) image->data[n] = NAN;
        }
        set_extremes(image);
    }
    ASSERTm(error, register_images(&scene.fixed, &scene.moving, &set, NULL, &reg, error));
    ASSERT(difference(&scene.fixed, 11.0f, registration_map, &reg, beat_map, &scene.there) < 0.35 * 1.4);
    registration_free(&reg);
    ASSERTm(error, register_images(&scene.fixed, &scene.fixed, &set, NULL, &reg, error));
    ASSERT(difference(&scene.fixed, 100.0f, registration_map, &reg, stay, NULL) < 1e-3);
    registration_free(&reg);
    free_scene(&scene);
    PASS();
}

/* A header in cm is named. */
TEST wrong_units_are_named(void)
{
    struct scene scene;
    struct registration reg;
    const struct register_settings set = register_defaults();
    struct volume small;
    char error[VOLUME_TEXT];
    ASSERT(make_scene(&scene));
    const float spacing[3] = {0.12f, 0.14f, 0.16f};
    ASSERT(make_grid(scene.moving.dims, spacing, true, &small));
    memcpy(small.data, scene.moving.data, volume_voxels(&small) * sizeof(float));
    set_extremes(&small);
    ASSERT(!register_images(&scene.fixed, &small, &set, NULL, &reg, error));
    ASSERT(strstr(error, "0.1 times as large") != NULL);
    volume_free(&small);
    free_scene(&scene);
    PASS();
}

TEST constant_images_are_refused(void)
{
    struct scene scene;
    struct registration reg;
    const struct register_settings set = register_defaults();
    char error[VOLUME_TEXT];
    ASSERT(make_scene(&scene));
    for (size_t n = 0; n < volume_voxels(&scene.moving); ++n) scene.moving.data[n] = 5.0f;
    scene.moving.minimum = scene.moving.maximum = 5.0f;
    ASSERT(!register_images(&scene.fixed, &scene.moving, &set, NULL, &reg, error));
    ASSERT(strstr(error, "the moving image is constant") != NULL);
    ASSERT(reg.velocity == NULL);
    free_scene(&scene);
    PASS();
}

TEST flat_images_are_refused(void)
{
    const int dims[3] = {20, 20, 1};
    const float spacing[3] = {1.2f, 1.4f, 1.6f};
    struct scene scene;
    struct volume flat;
    struct registration reg;
    const struct register_settings set = register_defaults();
    char error[VOLUME_TEXT];
    ASSERT(make_scene(&scene));
    ASSERT(make_grid(dims, spacing, true, &flat));
    flat.data[7] = flat.maximum = 1.0f;
    ASSERT(!register_images(&scene.fixed, &flat, &set, NULL, &reg, error));
    ASSERT(strstr(error, "the moving image is flat") != NULL);
    ASSERT(!register_images(&flat, &scene.moving, &set, NULL, &reg, error));
    ASSERT(strstr(error, "the fixed image is flat") != NULL);
    volume_free(&flat);
    free_scene(&scene);
    PASS();
}

/* ---- where the alignment begins ---- */

/* The phantom's ball is longer along one axis and has a handle, so that only one position fits. */
static void paint_handle(struct volume *volume, const float center[3], const double back[3][4])
{
    volume->minimum = INFINITY;
    volume->maximum = -INFINITY;
    for (size_t n = 0; n < volume_voxels(volume); ++n) {
        float index[3], x[3], r[3];
        place_of(volume->dims, n, index);
        volume_index_to_world(volume, index, x);
        volume_apply(back, x, x);
        vec3_sub(x, center, r);
        const float body = sqrtf(r[0] * r[0] / 2.2f + r[1] * r[1] + 1.5f * r[2] * r[2]) - 8.0f;
        const float handle =
            sqrtf((r[0] - 8.0f) * (r[0] - 8.0f) + (r[1] - 7.0f) * (r[1] - 7.0f) + (r[2] - 3.0f) * (r[2] - 3.0f)) - 4.0f;
        volume->data[n] = 900.0f / (1.0f + expf(fminf(body, handle)));
        volume->minimum = fminf(volume->minimum, volume->data[n]);
        volume->maximum = fmaxf(volume->maximum, volume->data[n]);
    }
}

/* Returns the mean error, mm, of a rigid registration of the phantom to itself, moved with its header by `there`. */
static double error_of_start(const double there[3][4], enum register_start start, bool *done)
{
    const int dims[3] = {40, 36, 34};
    const float spacing[3] = {1.2f, 1.2f, 1.2f};
    double identity[3][4];
    float center[3];
    struct volume fixed, moving;
    struct registration reg;
    struct register_settings set = register_defaults();
    char error[VOLUME_TEXT];
    register_identity(identity);
    *done = make_grid(dims, spacing, false, &fixed) && make_grid(dims, spacing, false, &moving);
    if (!*done) return INFINITY;
    middle_of(&fixed, center);
    paint_handle(&fixed, center, (const double(*)[4])identity);
    memcpy(moving.data, fixed.data, volume_voxels(&fixed) * sizeof(float));
    moving.minimum = fixed.minimum;
    moving.maximum = fixed.maximum;
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 4; ++c) {
            moving.affine[r][c] = c == 3 ? there[r][3] : 0.0;
            for (int k = 0; k < 3; ++k) moving.affine[r][c] += there[r][k] * fixed.affine[k][c];
        }
    }
    struct volume placed; /* derives origin and axes from the affine map */
    *done = volume_create_padded(&moving, 0, &placed);
    memcpy(placed.data, moving.data, volume_voxels(&fixed) * sizeof(float));
    placed.minimum = moving.minimum;
    placed.maximum = moving.maximum;
    set.start = start;
    set.iterations = 0; /* the alignment alone */
    *done = *done && register_images(&fixed, &placed, &set, NULL, &reg, error);
    const double away = *done ? difference(&fixed, 12.0f, registration_map, &reg, affine_map, there) : INFINITY;
    if (*done) registration_free(&reg);
    volume_free(&fixed);
    volume_free(&moving);
    volume_free(&placed);
    return away;
}

/* Headers that are 80 and 400 mm off: the centres of mass bring the images together; without them the failure has a reason. */
TEST wrong_headers_do_not_matter(void)
{
    static const double shifts[2] = {80.0, 400.0};
    bool done;
    for (int s = 0; s < 2; ++s) {
        const double there[3][4] = {{1.0, 0.0, 0.0, shifts[s]}, {0.0, 1.0, 0.0, -shifts[s]}, {0.0, 0.0, 1.0, 30.0}};
        ASSERT(error_of_start(there, REGISTER_START_CENTERS, &done) < 0.05);
        ASSERT(done);
        error_of_start(there, REGISTER_START_HEADERS, &done);
        ASSERT(!done);
    }
    PASS();
}

/* Any rotation: a quarter turn, and 126 degrees about an oblique axis. */
TEST a_search_finds_any_rotation(void)
{
    const double c = cos(2.2), s = sin(2.2);
    const double turns[2][3][4] = {{{0.0, -1.0, 0.0, 10.0}, {1.0, 0.0, 0.0, 20.0}, {0.0, 0.0, 1.0, 5.0}},
                                   {{0.0, -1.0, 0.0, 30.0}, {c, 0.0, -s, -60.0}, {s, 0.0, c, 5.0}}};
    bool done;
    for (int t = 0; t < 2; ++t) {
        ASSERT(error_of_start(turns[t], REGISTER_START_CENTERS, &done) > 1.0);
        ASSERT(error_of_start(turns[t], REGISTER_START_SEARCH, &done) < 0.05);
        ASSERT(done);
    }
    PASS();
}

/* ---- the program's parts ---- */

/* Writes the two images of a scene and a labelled ball in each of them, and reads them as the program does. */
static bool begin_run(const struct scene *scene, struct run *run)
{
    static char paths[4][512];
    static const char *const names[4] = {"fixed.nii.gz", "moving.nii.gz", "fixed_label.nii.gz", "moving_label.nii.gz"};
    char error[VOLUME_TEXT];
    bool good = true;
    for (int f = 0; f < 4; ++f) {
        const struct volume *volume = f % 2 ? &scene->moving : &scene->fixed;
        float *values = malloc(volume_voxels(volume) * sizeof *values);
        for (size_t n = 0; values && n < volume_voxels(volume); ++n) {
            values[n] = f < 2 ? volume->data[n] : volume->data[n] > 300.0f ? 7.0f : 0.0f;
        }
        snprintf(paths[f], sizeof paths[f], "%s/%s", folder, names[f]);
        good = good && values && volume_write(paths[f], volume, VOLUME_FLOAT32, values, error);
        free(values);
    }
    memset(run, 0, sizeof *run);
    run->common = cli_common_defaults();
    run->common.out = folder;
    run->settings = register_defaults();
    run->settings.align = REGISTER_ALIGN_NONE;
    run->label = 7;
    run->fixed_path = paths[0];
    run->moving_path = paths[1];
    run->fixed_labels_path = paths[2];
    run->moving_labels_path = paths[3];
    return good && register_read(run);
}

static double dice_of_files(const char *a, const char *b)
{
    char error[VOLUME_TEXT];
    struct volume x, y;
    double dice = -1.0;
    if (!volume_read(a, 0, &x, error)) return dice;
    if (volume_read(b, 0, &y, error)) {
        if (volume_same_grid(&x, &y)) dice = overlap_labels(x.data, y.data, volume_voxels(&x), 7.0f).dice;
        volume_free(&y);
    }
    volume_free(&x);
    return dice;
}

/* Padding and masks become gaps; the ground of an image is no padding. */
TEST padding_and_masks_become_gaps(void)
{
    struct scene scene;
    struct run run;
    size_t gaps[2] = {0, 0};
    ASSERT(make_scene(&scene));
    for (size_t n = 0; n < volume_voxels(&scene.moving); ++n) {
        if (n % 36 < 4) scene.moving.data[n] = -3024.0f;
    }
    set_extremes(&scene.moving);
    ASSERT(begin_run(&scene, &run));
    for (size_t n = 0; n < volume_voxels(&run.fixed); ++n) {
        gaps[0] += isnan(run.fixed.data[n]) ? 1 : 0;
        gaps[1] += isnan(run.moving.data[n]) ? 1 : 0;
    }
    ASSERT_EQ(0u, gaps[0]);
    ASSERT_EQ(volume_voxels(&scene.moving) / 9, gaps[1]);
    ASSERT(run.moving.minimum > -1.0f);
    run.fixed_mask_path = run.fixed_labels_path;
    ASSERT(register_drop_gaps(&run));
    for (size_t n = 0; n < volume_voxels(&run.fixed); ++n) {
        ASSERT(isnan(run.fixed.data[n]) == !(scene.fixed.data[n] > 300.0f));
    }
    register_free(&run);
    free_scene(&scene);
    PASS();
}

/* A label map beside a scan is refused, a mirrored image is named; two images with nothing in common are not trusted. */
TEST what_cannot_fit_is_named(void)
{
    struct scene scene;
    struct run run;
    ASSERT(make_scene(&scene));
    ASSERT(begin_run(&scene, &run));
    run.settings.similarity = REGISTER_AUTO;
    volume_free(&run.fixed);
    volume_free(&run.moving);
    run.moving_path = run.moving_labels_path;
    ASSERT(!register_read(&run));
    register_free(&run);
    for (int which = 0; which < 3; ++which) { /* files have no series, of either image */
        ASSERT(begin_run(&scene, &run));
        run.fixed_series = which == 0 ? "1" : NULL;
        run.moving_series = which == 1 ? "1" : NULL;
        register_free(&run);
        ASSERT_EQ(which == 2, register_read(&run));
        register_free(&run);
    }
    srand(5);
    for (size_t n = 0; n < volume_voxels(&scene.moving); ++n) scene.moving.data[n] = (float)(rand() % 1000);
    set_extremes(&scene.moving);
    ASSERT(begin_run(&scene, &run));
    run.settings.similarity = REGISTER_AUTO;
    run.settings.iterations = 0;
    ASSERT(register_fields(&run));
    ASSERT(register_measure(&run));
    ASSERT(!register_is_trusted(&run));
    register_free(&run);
    free_scene(&scene);
    PASS();
}

TEST mirrored_images_are_named(void)
{
    const int dims[3] = {40, 36, 34};
    const float spacing[3] = {1.2f, 1.2f, 1.2f};
    double map[3][4];
    float center[3];
    struct volume fixed, moving;
    struct registration reg;
    struct register_settings set = register_defaults();
    char error[VOLUME_TEXT];
    ASSERT(make_grid(dims, spacing, false, &fixed) && make_grid(dims, spacing, false, &moving));
    middle_of(&fixed, center);
    register_identity(map);
    paint_handle(&fixed, center, (const double(*)[4])map);
    set.similarity = REGISTER_AUTO;
    set.iterations = 0;
    for (int way = 0; way < 6; ++way) { /* also where the images are not aligned, and begun by their headers alone */
        const int mirrored = way % 2;
        set.align = way < 2 ? REGISTER_ALIGN_NONE : REGISTER_ALIGN_RIGID;
        set.start = way < 4 ? REGISTER_START_CENTERS : REGISTER_START_HEADERS;
        map[1][1] = mirrored ? -1.0 : 1.0;
        map[1][3] = mirrored ? 2.0 * (double)center[1] : 3.0;
        paint_handle(&moving, center, (const double(*)[4])map);
        ASSERTm(error, register_images(&fixed, &moving, &set, NULL, &reg, error));
        ASSERT((reg.mirrored != 0) == mirrored);
        registration_free(&reg);
    }
    volume_free(&fixed);
    volume_free(&moving);
    PASS();
}

/* Labels, points and a mesh, from the moving image to the fixed one and back. */
TEST labels_points_and_meshes_are_carried(void)
{
    struct scene scene;
    struct run run;
    char error[VOLUME_TEXT];
    float center[3], points[2][3][3], *read = NULL;
    const uint32_t triangle[3] = {0, 1, 2};
    size_t count = 0;
    ASSERT(make_scene(&scene));
    middle_of(&scene.fixed, center);
    ASSERT(begin_run(&scene, &run));
    ASSERT(register_fields(&run));
    ASSERT(register_measure(&run));
    ASSERT(register_is_trusted(&run));
    ASSERT(run.dice_after > 0.95 && run.dice_after > run.dice_before);
    ASSERT(run.correlation_after > run.correlation_before);
    ASSERT_EQ(0u, run.folded);
    for (int p = 0; p < 3; ++p) { /* of the fixed image; where the motion takes them, of the moving one */
        for (int a = 0; a < 3; ++a) points[0][p][a] = center[a] + (a == p ? 7.0f : -2.0f);
    }
    beat_map(&scene.there, points[0][0], 3, points[1][0]);
    for (int side = 0; side < 2; ++side) {
        const struct mesh_arrays ply = {.positions = points[side][0], .vertex_count = 3, .indices = triangle, .triangle_count = 1};
        ASSERT(points_write(scratch(side ? "moving.txt" : "fixed.txt"), points[side][0], 3, error));
        ASSERT(mesh_write_ply(scratch(side ? "moving.ply" : "fixed.ply"), &ply, error));
    }
    char files[4][512];
    static const char *const names[4] = {"moving.txt", "moving.ply", "fixed.txt", "fixed.ply"};
    for (int f = 0; f < 4; ++f) snprintf(files[f], sizeof files[f], "%s/%s", folder, names[f]);
    run.warp = (struct carried){run.moving_labels_path, files[0], files[1]};
    run.inverse_warp = (struct carried){run.fixed_labels_path, files[2], files[3]};
    ASSERT(register_carry(&run));
    ASSERT_IN_RANGE(run.dice_after, dice_of_files(run.fixed_labels_path, scratch("warped_labels.nii.gz")), 1e-12);
    ASSERT(dice_of_files(run.moving_labels_path, scratch("inverse_labels.nii.gz")) > 0.95);
    for (int side = 0; side < 2; ++side) {
        struct mesh mesh;
        ASSERTm(error, points_read(scratch(side ? "inverse_points.txt" : "warped_points.txt"), &scene.fixed, &read, &count, error));
        ASSERTm(error, mesh_read(scratch(side ? "inverse_mesh.ply" : "warped_mesh.ply"), &mesh, error));
        ASSERT_EQ(3u, count);
        ASSERT_EQ(3u, mesh.vertex_count);
        for (int p = 0; p < 3; ++p) {
            float away[3];
            vec3_sub(read + 3 * p, points[side][p], away);
            ASSERT(vec3_length(away) < 0.5f); /* a third of a voxel; they moved by 2 mm */
            vec3_sub(mesh.positions + 3 * p, read + 3 * p, away);
            ASSERT(vec3_length(away) < 1e-3f);
        }
        mesh_free(&mesh);
        free(read);
    }
    run.warp.labels = scratch("nothing.nii.gz");
    ASSERT(!register_carry(&run));
    register_free(&run);
    free_scene(&scene);
    PASS();
}

/* Label maps that do not lie on the grid of their image are refused before the work. */
TEST labels_of_other_grids_are_refused(void)
{
    const int dims[3] = {9, 9, 9};
    const float spacing[3] = {2.0f, 2.0f, 2.0f}, origin[3] = {0.0f, 0.0f, 0.0f};
    struct scene scene;
    struct volume other;
    struct run run;
    char error[VOLUME_TEXT], path[512];
    ASSERT(make_scene(&scene));
    ASSERT(volume_create(dims, spacing, origin, &other));
    snprintf(path, sizeof path, "%s/other.nii.gz", folder);
    ASSERT(volume_write(path, &other, VOLUME_FLOAT32, other.data, error));
    volume_free(&other);
    for (int which = 0; which < 4; ++which) {
        ASSERT(begin_run(&scene, &run));
        const char **const labels[4] = {&run.fixed_labels_path, &run.moving_labels_path, &run.warp.labels,
                                        &run.inverse_warp.labels};
        *labels[which] = path;
        register_free(&run);
        ASSERT(!register_read(&run));
        register_free(&run);
    }
    free_scene(&scene);
    PASS();
}

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    if (file) {
        fputs(text, file);
        fclose(file);
    }
}

/* Points and meshes that cannot be read, and landmarks of which one image has more, are refused before the work. */
TEST unreadable_points_and_meshes_are_refused(void)
{
    struct scene scene;
    struct run run;
    char one[96], two[96];
    ASSERT(make_scene(&scene));
    snprintf(one, sizeof one, "%s", scratch("one.txt"));
    snprintf(two, sizeof two, "%s", scratch("two.txt"));
    write_text(one, "point\n1\n1 2 3\n");
    write_text(two, "point\n2\n1 2 3\n4 5 6\n");
    for (int which = 0; which < 6; ++which) {
        ASSERT(begin_run(&scene, &run));
        run.fixed_points_path = run.moving_points_path = one;
        const char **const files[6] = {&run.fixed_points_path,   &run.moving_points_path, &run.warp.points,
                                       &run.inverse_warp.points, &run.warp.mesh,          &run.inverse_warp.mesh};
        *files[which] = run.fixed_path; /* an image */
        register_free(&run);
        ASSERT(!register_read(&run));
        register_free(&run);
    }
    for (int which = 0; which < 2; ++which) {
        ASSERT(begin_run(&scene, &run));
        run.fixed_points_path = one;
        run.moving_points_path = which ? one : two;
        register_free(&run);
        ASSERT_EQ(which == 1, register_read(&run));
        register_free(&run);
    }
    free_scene(&scene);
    PASS();
}

/* Begins a run on the images of a scene, and makes a field of zero on the fixed one. */
static bool begin_with_field(struct scene *scene, struct run *run, struct field *field)
{
    return make_scene(scene) && begin_run(scene, run) && field_create(&scene->fixed, field);
}

/* Writes the field, frees it, and lets the run take it from the file. */
static bool take_field(struct run *run, struct field *field, const char *name)
{
    static char path[512];
    char error[VOLUME_TEXT];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    const bool written = field_write(path, field, error);
    field_free(field);
    run->field_path = path;
    return written && register_fields(run);
}

/* A map that makes the fit worse, or folds, is no success. */
TEST poor_results_are_reported(void)
{
    struct scene scene;
    struct run run;
    struct field field;
    ASSERT(begin_with_field(&scene, &run, &field));
    const struct beat_time wrong = {&scene.beat, -0.6};
    field_sample(beat_map, &wrong, &field);
    for (size_t n = 0; n < volume_voxels(&scene.fixed); ++n) field.mm[3 * n] *= n % 36 > 17 ? 4.0f : 1.0f; /* tears, and folds */
    ASSERT(take_field(&run, &field, "wrong.nii.gz"));
    ASSERT(register_measure(&run));
    ASSERT(!register_is_trusted(&run));
    ASSERT(run.folded > 0);
    register_free(&run);
    free_scene(&scene);
    PASS();
}

/* Compares two images whose headers place them far from each other, over the voxels that a map brings together. Returns whether that is
 * trusted. */
static bool is_trusted_from_afar(const struct scene *scene, bool related, struct run *run)
{
    const double there[3][4] = {{1.0, 0.0, 0.0, 1e4}, {0.0, 1.0, 0.0, 0.0}, {0.0, 0.0, 1.0, 0.0}};
    struct volume far_away = scene->fixed, placed;
    struct field field;
    memcpy(far_away.affine, scene->fixed.affine, sizeof far_away.affine);
    far_away.affine[0][3] += there[0][3];
    if (!begin_run(scene, run) || !volume_create_padded(&far_away, 0, &placed) || !field_create(&scene->fixed, &field)) return false;
    for (size_t n = 0; n < volume_voxels(&placed); ++n)
        placed.data[n] = related ? scene->fixed.data[n] : (float)((n * 2654435761u >> 8) % 1000);
    placed.minimum = 0.0f;
    placed.maximum = 1000.0f;
    volume_free(&run->moving);
    run->moving = placed;
    run->fixed_labels_path = run->moving_labels_path = NULL;
    field_sample(affine_map, there, &field);
    if (!take_field(run, &field, "far.nii.gz") || !register_measure(run)) return false;
    run->field_path = NULL; /* fields of files are not judged */
    return register_is_trusted(run);
}

/* Where the headers let the images lie apart there is nothing to compare before; after is compared all the same. */
TEST images_from_afar_are_compared_after(void)
{
    struct scene scene;
    struct run run;
    ASSERT(make_scene(&scene));
    ASSERT(is_trusted_from_afar(&scene, true, &run));
    ASSERT(isnan(run.correlation_before));
    ASSERT(run.correlation_after > 0.999);
    register_free(&run);
    ASSERT(!is_trusted_from_afar(&scene, false, &run));
    ASSERT(run.correlation_after < 0.1);
    register_free(&run);
    free_scene(&scene);
    PASS();
}

/* A map that leads out of the moving image is refused before anything is compared or printed. */
TEST maps_to_nowhere_are_refused(void)
{
    struct scene scene;
    struct run run;
    struct field field;
    ASSERT(begin_with_field(&scene, &run, &field));
    for (size_t n = 0; n < 3 * volume_voxels(&scene.fixed); ++n) field.mm[n] = 1e4f;
    ASSERT(take_field(&run, &field, "nowhere.nii.gz"));
    ASSERT(!register_measure(&run));
    register_free(&run);
    free_scene(&scene);
    PASS();
}

/* Of labels that are not there the overlap would be perfect. */
TEST missing_labels_are_refused_before_the_work(void)
{
    struct scene scene;
    struct run run;
    ASSERT(make_scene(&scene));
    ASSERT(begin_run(&scene, &run));
    volume_free(&run.fixed);
    volume_free(&run.moving);
    run.label = 8;
    ASSERT(!register_read(&run));
    register_free(&run);
    free_scene(&scene);
    PASS();
}

/* ---- landmarks ---- */

TEST landmarks_are_read_or_refused(void)
{
    const int dims[3] = {10, 10, 10};
    const float spacing[3] = {1.0f, 2.0f, 3.0f};
    static const char *const bad_sets[] = {"", "points 2\n1 2 3\n", "index\n0\n", "index\n2\n1 2 3\n4 5\n", "point 1\n1 2 nan\n",
                                           "index -3\n1 2 3\n"};
    static const char *const bad_tables[] = {"", "landmark,frame,x_mm,y_mm\n0,0,1,2\n", "landmark,frame,x_mm,y_mm,z_mm\n",
                                             "landmark,frame,x_mm,y_mm,z_mm\n0,0,1,2,three\n",
                                             "landmark,frame,x_mm,y_mm,z_mm\n0,0,1,2\n",
                                             "landmark,frame,x_mm,y_mm,z_mm\n0,0,1,2,3\n1,1,1,2,3\n",
                                             "landmark,frame,x_mm,y_mm,z_mm\n0,0,1,2,3\n0,0,1,2,3\n",
                                             "landmark,frame,x_mm,y_mm,z_mm\n-1,0,1,2,3\n"};
    struct volume grid;
    char error[VOLUME_TEXT];
    float *points = NULL;
    size_t count = 0, frames = 0;
    ASSERT(make_grid(dims, spacing, false, &grid)); /* the origin is (-20, 35, 100) */
    write_text(scratch("set.txt"), "index\n2\n1 2 3\n0 0 0\n");
    ASSERTm(error, points_read(scratch("set.txt"), &grid, &points, &count, error));
    ASSERT_EQ(2u, count);
    ASSERT_IN_RANGE(-19.0f, points[0], 1e-4f);
    ASSERT_IN_RANGE(39.0f, points[1], 1e-4f);
    ASSERT_IN_RANGE(109.0f, points[2], 1e-4f);
    free(points);
    write_text(scratch("set.txt"), "point\n1\n1.5 -2 3\n");
    ASSERTm(error, points_read(scratch("set.txt"), &grid, &points, &count, error));
    ASSERT(points[0] == -1.5f && points[1] == 2.0f && points[2] == 3.0f);
    free(points);
    write_text(scratch("table.csv"),
               "frame,landmark,i,z_mm,y_mm,x_mm\r\n1,0,9,3,2,1\r\n0,0,9,6,5,4\r\n\r\n0,1,9,1,1,1\n1,1,9,2,2,2\n");
    ASSERTm(error, points_read_frames(scratch("table.csv"), &points, &count, &frames, error));
    ASSERT_EQ(2u, count);
    ASSERT_EQ(2u, frames);
    ASSERT(points[0] == 4.0f && points[1] == 5.0f && points[2] == 6.0f); /* frame 0, landmark 0 */
    ASSERT(points[6] == 1.0f && points[8] == 3.0f);
    free(points);
    for (size_t i = 0; i < sizeof bad_sets / sizeof *bad_sets; ++i) {
        write_text(scratch("set.txt"), bad_sets[i]);
        ASSERT(!points_read(scratch("set.txt"), &grid, &points, &count, error));
        ASSERT(points == NULL && strlen(error) > 10 && strchr(error, '\n') == NULL);
    }
    for (size_t i = 0; i < sizeof bad_tables / sizeof *bad_tables; ++i) {
        write_text(scratch("table.csv"), bad_tables[i]);
        ASSERT(!points_read_frames(scratch("table.csv"), &points, &count, &frames, error));
        ASSERT(points == NULL && strlen(error) > 10 && strchr(error, '\n') == NULL);
    }
    volume_free(&grid);
    PASS();
}

/* ---- beside another program ---- */

/* elastix sees the same images in the same places as we do: its field, which we read, and ours are both near the truth, and
 * near each other. The grid's axes are turned and mirrored: a wrong sign or order anywhere would show. */
TEST fields_agree_with_elastix(void)
{
    if (system("elastix --version > /dev/null 2>&1") != 0 || system("transformix --version > /dev/null 2>&1") != 0)
        SKIPm("there is no elastix");
    struct scene scene;
    struct registration reg;
    struct field theirs;
    struct register_settings set = register_defaults();
    char error[VOLUME_TEXT];
    ASSERT(make_scene(&scene));
    set.align = REGISTER_ALIGN_NONE;
    ASSERT(volume_write(scratch("fixed.nii"), &scene.fixed, VOLUME_FLOAT32, scene.fixed.data, error));
    ASSERT(volume_write(scratch("moving.nii"), &scene.moving, VOLUME_FLOAT32, scene.moving.data, error));
    char parameters[sizeof elastix_parameters + 64];
    snprintf(parameters, sizeof parameters, "%s(FinalGridSpacingInPhysicalUnits 6)\n", elastix_parameters);
    write_text(scratch("parameters.txt"), parameters);
    ASSERT(run_command("cd %s && elastix -threads 2 -f fixed.nii -m moving.nii -p parameters.txt -out %s > /dev/null", folder,
                       folder));
    ASSERT(run_command("cd %s && transformix -threads 2 -def all -tp TransformParameters.0.txt -out %s > /dev/null", folder,
                       folder));
    ASSERTm(error, field_read(scratch("deformationField.nii"), &theirs, error));
    ASSERT(volume_same_grid(&scene.fixed, &theirs.grid));
    ASSERTm(error, register_images(&scene.fixed, &scene.moving, &set, NULL, &reg, error));
    const double before = difference(&scene.fixed, 13.0f, stay, NULL, beat_map, &scene.there);
    const double elastix = difference(&scene.fixed, 13.0f, field_map_points, &theirs, beat_map, &scene.there);
    const double ours = difference(&scene.fixed, 13.0f, registration_map, &reg, beat_map, &scene.there);
    const double between = difference(&scene.fixed, 13.0f, registration_map, &reg, field_map_points, &theirs);
    printf("  mean error, mm: %.2f without, %.2f elastix, %.2f ours; %.2f between the two\n", before, elastix, ours, between);
    ASSERT(elastix < 0.15 * before);
    ASSERT(ours < 0.15 * before);
    ASSERT(between < 0.15 * before);
    field_free(&theirs);
    registration_free(&reg);
    free_scene(&scene);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(affine_maps_are_found);
    RUN_TEST(demons_find_a_known_motion);
    RUN_TEST(scales_of_intensities_do_not_matter);
    RUN_TEST(other_contrasts_are_registered);
    RUN_TEST(shading_is_fitted);
    RUN_TEST(another_scale_moves_nothing);
    RUN_TEST(gaps_take_no_part);
    RUN_TEST(wrong_units_are_named);
    RUN_TEST(padding_and_masks_become_gaps);
    RUN_TEST(what_cannot_fit_is_named);
    RUN_TEST(mirrored_images_are_named);
    RUN_TEST(constant_images_are_refused);
    RUN_TEST(flat_images_are_refused);
    RUN_TEST(wrong_headers_do_not_matter);
    RUN_TEST(a_search_finds_any_rotation);
    RUN_TEST(labels_points_and_meshes_are_carried);
    RUN_TEST(labels_of_other_grids_are_refused);
    RUN_TEST(unreadable_points_and_meshes_are_refused);
    RUN_TEST(poor_results_are_reported);
    RUN_TEST(images_from_afar_are_compared_after);
    RUN_TEST(maps_to_nowhere_are_refused);
    RUN_TEST(missing_labels_are_refused_before_the_work);
    RUN_TEST(landmarks_are_read_or_refused);
    RUN_TEST(fields_agree_with_elastix);
    run_command("rm -rf %s%s", folder, "");
    GREATEST_MAIN_END();
}

#endif
