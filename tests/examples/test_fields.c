/* What examples/register stands on: arrays over grids, displacement fields and their files, the made motion.
 * Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_fields_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_fields_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "made_images.h"

/* ---- arrays over grids ---- */

/* A bright voxel gets the variance sigma^2 along every axis; what three sigma leave out is less than 3 % of it. A constant
 * stays, up to the border. */
TEST smoothing_has_its_variance_and_keeps_constants(void)
{
    enum { N = 31 * 29 * 33 };
    const int dims[3] = {31, 29, 33};
    static float data[3 * N], scratch_data[3 * N];
    const float sigma = 2.5f;
    double sum = 0.0, variance[3] = {0.0, 0.0, 0.0};
    for (size_t n = 0; n < N; ++n) {
        data[3 * n] = n == 15 + 31 * (14 + 29 * 16) ? 1.0f : 0.0f;
        data[3 * n + 1] = 7.0f;
        data[3 * n + 2] = 0.0f;
    }
    ASSERT(vgrid_smooth(dims, 3, sigma, data, scratch_data));
    for (size_t n = 0; n < N; ++n) {
        float x[3];
        place_of(dims, n, x);
        sum += (double)data[3 * n];
        for (int a = 0; a < 3; ++a) {
            const double d = (double)x[a] - (a == 0 ? 15 : a == 1 ? 14 : 16);
            variance[a] += (double)data[3 * n] * d * d;
        }
        ASSERT_IN_RANGE(7.0f, data[3 * n + 1], 1e-4f);
        ASSERT_EQ(0.0f, data[3 * n + 2]);
    }
    ASSERT_IN_RANGE(1.0, sum, 1e-4);
    for (int a = 0; a < 3; ++a) ASSERT_IN_RANGE(6.25, variance[a], 0.03 * 6.25);
    PASS();
}

TEST interpolation_is_exact_for_linear_functions(void)
{
    const int dims[3] = {5, 6, 7};
    float values[3 * 5 * 6 * 7];
    for (size_t n = 0; n < 5 * 6 * 7; ++n) {
        float x[3];
        place_of(dims, n, x);
        for (size_t c = 0; c < 3; ++c) values[3 * n + c] = x[0] - 2.0f * x[1] + 0.5f * x[2] + (float)c;
    }
    const float places[4][3] = {{0.0f, 0.0f, 0.0f}, {4.0f, 5.0f, 6.0f}, {1.25f, 3.5f, 5.75f}, {-3.0f, 9.0f, 2.5f}};
    for (int p = 0; p < 4; ++p) {
        float out[3];
        const float x = fmaxf(0.0f, fminf(4.0f, places[p][0])), y = fmaxf(0.0f, fminf(5.0f, places[p][1]));
        vgrid_sample(dims, 3, values, places[p], out);
        for (int c = 0; c < 3; ++c) ASSERT_IN_RANGE(x - 2.0f * y + 0.5f * places[p][2] + (float)c, out[c], 1e-5f);
    }
    PASS();
}

enum { SIDE = 32, CUBE = SIDE * SIDE * SIDE };
static const int cube[3] = {SIDE, SIDE, SIDE};
static float v[3 * CUBE], u[3 * CUBE], w[3 * CUBE], spare[3 * CUBE];

/* Of a velocity that is linear in x the flow is a matrix exponential: here a turn about the middle and a contraction. */
TEST exponential_of_a_linear_velocity_is_exact(void)
{
    const float turn = 0.7f, shrink = 0.4f, middle = 15.5f;
    for (size_t n = 0; n < CUBE; ++n) {
        float x[3];
        place_of(cube, n, x);
        v[3 * n] = -turn * (x[1] - middle) - shrink * (x[0] - middle);
        v[3 * n + 1] = turn * (x[0] - middle) - shrink * (x[1] - middle);
        v[3 * n + 2] = -shrink * (x[2] - middle);
    }
    vgrid_exp(cube, v, 1.0f, 0.05f, u, spare);
    const float c = expf(-shrink) * cosf(turn), s = expf(-shrink) * sinf(turn);
    for (size_t n = 0; n < CUBE; ++n) {
        float x[3];
        place_of(cube, n, x);
        const float a = x[0] - middle, b = x[1] - middle;
        if (a * a + b * b > 15.0f * 15.0f) continue; /* turned out of the grid on the way */
        ASSERT_IN_RANGE(middle + c * a - s * b, x[0] + u[3 * n], 2e-3f);
        ASSERT_IN_RANGE(middle + s * a + c * b, x[1] + u[3 * n + 1], 2e-3f);
        ASSERT_IN_RANGE(middle + expf(-shrink) * (x[2] - middle), x[2] + u[3 * n + 2], 2e-3f);
    }
    PASS();
}

/* A smooth bump of velocity: exp(v) and exp(-v) are inverse, exp(v/2) twice is exp(v), and iteration finds the same inverse. */
TEST exponentials_compose(void)
{
    for (size_t n = 0; n < CUBE; ++n) {
        float x[3];
        place_of(cube, n, x);
        const float r2 = (x[0] - 15) * (x[0] - 15) + (x[1] - 16) * (x[1] - 16) + (x[2] - 15) * (x[2] - 15);
        const float bump = 3.0f * expf(-r2 / 50.0f);
        v[3 * n] = bump;
        v[3 * n + 1] = -0.5f * bump;
        v[3 * n + 2] = 0.02f * bump * (x[0] - 15);
    }
    vgrid_exp(cube, v, 1.0f, 0.05f, u, spare);
    vgrid_exp(cube, v, -1.0f, 0.05f, w, spare);
    ASSERT(vgrid_longest(cube, u) > 2.5f);
    vgrid_compose(cube, w, u, spare);
    ASSERT(vgrid_longest(cube, spare) < 0.05f);
    static float inverse[3 * CUBE];
    ASSERT(vgrid_invert(cube, u, 50, inverse, spare) < 1e-3f);
    for (size_t n = 0; n < 3 * CUBE; ++n) ASSERT_IN_RANGE(w[n], inverse[n], 0.05f);
    vgrid_exp(cube, v, 0.5f, 0.05f, w, spare);
    vgrid_compose(cube, w, w, spare);
    for (size_t n = 0; n < 3 * CUBE; ++n) ASSERT_IN_RANGE(u[n], spare[n], 0.02f);
    vgrid_jacobian(cube, u, spare);
    for (size_t n = 0; n < CUBE; ++n) ASSERT(spare[n] > 0.0f);
    PASS();
}

TEST jacobian_of_an_affine_map(void)
{
    for (size_t n = 0; n < CUBE; ++n) {
        float x[3];
        place_of(cube, n, x);
        u[3 * n] = 0.5f * x[0] + 0.2f * x[1];
        u[3 * n + 1] = -0.1f * x[0];
        u[3 * n + 2] = -0.25f * x[2] + 3.0f;
    }
    vgrid_jacobian(cube, u, spare);
    for (size_t n = 0; n < CUBE; ++n) ASSERT_IN_RANGE((1.5f * 1.0f + 0.02f) * 0.75f, spare[n], 1e-4f);
    PASS();
}

/* ---- fields and their files ---- */

/* What ITK reads: 5 dimensions, intent 1007, and vectors along LPS: a push to the patient's right, to the front and upwards,
 * (3, 4, 5) in RAS, is (-3, -4, 5) in the file. */
TEST field_files_are_itk_s(void)
{
    const int dims[3] = {7, 6, 5};
    const float spacing[3] = {1.0f, 2.0f, 3.0f};
    char error[VOLUME_TEXT];
    struct volume grid;
    struct field field, again;
    ASSERT(make_grid(dims, spacing, true, &grid));
    ASSERT(field_create(&grid, &field));
    for (size_t n = 0; n < volume_voxels(&grid); ++n) {
        field.mm[3 * n] = 3.0f + (float)n;
        field.mm[3 * n + 1] = 4.0f;
        field.mm[3 * n + 2] = 5.0f;
    }
    const char *const names[2] = {"field.nii", "field.nii.gz"};
    for (int f = 0; f < 2; ++f) {
        ASSERTm(error, field_write(scratch(names[f]), &field, error));
        nifti_image *image = nifti_image_read(scratch(names[f]), 1);
        ASSERT(image != NULL);
        ASSERT_EQ(5, image->dim[0]);
        ASSERT_EQ(1, image->dim[4]);
        ASSERT_EQ(3, image->dim[5]);
        ASSERT_EQ(1007, image->intent_code);
        const float *data = image->data;
        for (size_t n = 0; n < volume_voxels(&grid); ++n) {
            ASSERT_EQ(-3.0f - (float)n, data[n]);
            ASSERT_EQ(-4.0f, data[n + 7 * 6 * 5]);
            ASSERT_EQ(5.0f, data[n + 2 * 7 * 6 * 5]);
        }
        for (int r = 0; r < 3; ++r) /* both forms place the voxels alike */
            for (int c = 0; c < 4; ++c) {
                ASSERT_IN_RANGE(grid.affine[r][c], image->sto_xyz.m[r][c], 1e-4);
                ASSERT_IN_RANGE(grid.affine[r][c], image->qto_xyz.m[r][c], 1e-3);
            }
        nifti_image_free(image);
        ASSERTm(error, field_read(scratch(names[f]), &again, error));
        ASSERT(volume_same_grid(&grid, &again.grid));
        for (size_t n = 0; n < 3 * volume_voxels(&grid); ++n) ASSERT_EQ(field.mm[n], again.mm[n]);
        field_free(&again);
    }
    field_free(&field);
    volume_free(&grid);
    PASS();
}

TEST bad_field_files_are_refused(void)
{
    const int dims[3] = {7, 6, 5};
    const float spacing[3] = {1.0f, 2.0f, 3.0f};
    char error[VOLUME_TEXT] = "", bytes[352 + 7 * 6 * 5 * 3 * 4];
    struct volume grid;
    struct field field;
    ASSERT(make_grid(dims, spacing, false, &grid));
    ASSERT(volume_write(scratch("image.nii"), &grid, VOLUME_FLOAT32, grid.data, error));
    ASSERT(!field_read(scratch("image.nii"), &field, error));
    ASSERT(strstr(error, "no displacement field") != NULL);
    ASSERT(field.mm == NULL);
    ASSERT(!field_read(scratch("nothing.nii"), &field, error));
    ASSERT(strlen(error) > 10);
    ASSERT(field_create(&grid, &field));
    ASSERT(field_write(scratch("field.nii"), &field, error));
    field_free(&field);
    FILE *file = fopen(scratch("field.nii"), "rb");
    ASSERT(file != NULL);
    ASSERT_EQ(sizeof bytes, fread(bytes, 1, sizeof bytes, file));
    fclose(file);
    for (int kind = 0; kind < 3; ++kind) { /* cut off; another intent; a NaN */
        const float nan_value = NAN;
        char copy[sizeof bytes];
        memcpy(copy, bytes, sizeof bytes);
        if (kind == 1) copy[68] = 5, copy[69] = 0;
        if (kind == 2) memcpy(copy + 352 + 7 * 6 * 5 * 4, &nan_value, 4);
        file = fopen(scratch("bad.nii"), "wb");
        ASSERT(file != NULL);
        fwrite(copy, 1, kind == 0 ? sizeof bytes - 1000 : sizeof bytes, file);
        fclose(file);
        ASSERT(!field_read(scratch("bad.nii"), &field, error));
        ASSERT(strlen(error) > 10 && strchr(error, '\n') == NULL);
        ASSERT(field.mm == NULL);
    }
    ASSERT(field_create(&grid, &field));
    ASSERT(!field_write(scratch("no/such/folder.nii"), &field, error));
    field_free(&field);
    volume_free(&grid);
    PASS();
}

/* The inverse of a field of another program, on the same grid: back where it came from. */
TEST fields_are_inverted(void)
{
    const int dims[3] = {30, 28, 26};
    const float spacing[3] = {1.0f, 1.5f, 1.2f};
    float center[3];
    double remains = 1.0;
    size_t folded = 1;
    struct volume grid;
    struct field field, inverse;
    ASSERT(make_grid(dims, spacing, true, &grid));
    middle_of(&grid, center);
    const double middle[3] = {(double)center[0], (double)center[1], (double)center[2]};
    const struct beat beat = beat_of(middle, 7.0);
    const struct beat_time half = {&beat, 0.5}, back = {&beat, -0.5};
    ASSERT(field_create(&grid, &field));
    field_sample(beat_map, &half, &field);
    ASSERT(field_invert(&field, &grid, &inverse, &remains));
    ASSERT(remains < 1e-3);
    ASSERT(difference(&grid, 10.0f, field_map_points, &inverse, beat_map, &back) < 0.05); /* trilinear between voxels */
    float *determinants = malloc(volume_voxels(&grid) * sizeof *determinants);
    const float least = field_jacobian(&field, determinants, &folded);
    ASSERT_IN_RANGE(expf(-1.5f * 0.55f), least, 0.05f);
    ASSERT_EQ(0u, folded);
    free(determinants);
    field_free(&field);
    field_free(&inverse);
    volume_free(&grid);
    PASS();
}

/* ---- the made motion ---- */

TEST beat_is_a_flow(void)
{
    const double center[3] = {1.0, 2.0, 3.0}, h = 1e-3;
    const struct beat beat = beat_of(center, 20.0);
    ASSERT_EQ(0.0, beat_phase(0, 10));
    ASSERT_IN_RANGE(1.0, beat_phase(5, 10), 1e-12);
    for (int n = 0; n < 20; ++n) {
        const double x[3] = {-20.0 + 2.0 * n, 15.0 - n, 1.5 * n - 10.0};
        double half[3], whole[3], twice[3], back[3];
        beat_flow(&beat, 0.5, x, half);
        beat_flow(&beat, 0.5, half, twice);
        beat_flow(&beat, 1.0, x, whole);
        beat_flow(&beat, -1.0, whole, back);
        for (int a = 0; a < 3; ++a) {
            ASSERT_IN_RANGE(whole[a], twice[a], 1e-4);
            ASSERT_IN_RANGE(x[a], back[a], 1e-4);
        }
    }
    double scale = 1.0; /* at the centre it shrinks alike along all axes */
    for (int a = 0; a < 3; ++a) {
        double x[3] = {center[0], center[1], center[2]}, there[3];
        x[a] += h;
        beat_flow(&beat, 1.0, x, there);
        scale *= (there[a] - center[a]) / h;
    }
    ASSERT_IN_RANGE(exp(-3.0 * 0.55), scale, 1e-3);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(smoothing_has_its_variance_and_keeps_constants);
    RUN_TEST(interpolation_is_exact_for_linear_functions);
    RUN_TEST(exponential_of_a_linear_velocity_is_exact);
    RUN_TEST(exponentials_compose);
    RUN_TEST(jacobian_of_an_affine_map);
    RUN_TEST(field_files_are_itk_s);
    RUN_TEST(bad_field_files_are_refused);
    RUN_TEST(fields_are_inverted);
    RUN_TEST(beat_is_a_flow);
    run_command("rm -rf %s%s", folder, "");
    GREATEST_MAIN_END();
}

#endif
