/* What examples/segment.c shares in examples/common: grids over an image, blur, thresholds, pressure, parts, distances,
 * the rule by which springls are at rest, and --set. Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_segment_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_segment_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "springls.h"

#include "../../examples/common/imaging/resample.h"
#include "../../examples/common/imaging/segment_image.h"
/* Their inner functions are tested too. */
#include "../../examples/common/springls/run_options.c"
#include "../../examples/common/springls/segment_model.c"

/* An image 12 x 10 x 8 with voxels of 1 x 2 x 3 mm, turned about z and mirrored in z. */
static bool make_image(struct volume *image)
{
    const int dims[3] = {12, 10, 8};
    const float spacing[3] = {1.0f, 2.0f, 3.0f}, origin[3] = {5.0f, -6.0f, 7.0f};
    struct volume turned;
    if (!volume_create(dims, spacing, origin, &turned)) return false;
    turned.affine[0][0] = 0.6, turned.affine[0][1] = -1.6;
    turned.affine[1][0] = 0.8, turned.affine[1][1] = 1.2;
    turned.affine[2][2] = -3.0;
    const bool made = volume_create_padded(&turned, 0, image); /* takes origin and direction from the affine */
    volume_free(&turned);
    return made;
}

static size_t voxel_at(const struct volume *v, int i, int j, int k)
{
    return (size_t)i + (size_t)v->dims[0] * ((size_t)j + (size_t)v->dims[1] * (size_t)k);
}

/* ---- grids ---- */

TEST grids_cover_the_box_of_the_image(void)
{
    struct volume image, cubes, padded;
    ASSERT(make_image(&image));
    ASSERT(volume_create_cubes(&image, 1.5f, 2, &cubes));
    ASSERT(volume_create_padded(&image, 3, &padded));
    for (int a = 0; a < 3; ++a) {
        ASSERT_IN_RANGE(1.5f, cubes.spacing[a], 1e-5f);
        ASSERT_EQ(image.dims[a] + 6, padded.dims[a]);
    }
    for (int corner = 0; corner < 8; ++corner) {
        float index[3], world[3], at[3], in_padded[3];
        for (int a = 0; a < 3; ++a) index[a] = corner >> a & 1 ? (float)image.dims[a] - 0.5f : -0.5f;
        volume_index_to_world(&image, index, world);
        volume_world_to_index(&cubes, world, at);
        volume_world_to_index(&padded, world, in_padded);
        for (int a = 0; a < 3; ++a) { /* two voxels of margin, and less than half a voxel of rounding */
            const float margin = corner >> a & 1 ? (float)cubes.dims[a] - 0.5f - at[a] : at[a] + 0.5f;
            ASSERT(margin > 1.999f && margin < 2.501f);
            ASSERT_IN_RANGE(index[a] + 3.0f, in_padded[a], 1e-4f);
        }
    }
    volume_free(&image);
    volume_free(&cubes);
    volume_free(&padded);
    PASS();
}

static float plane(const struct volume *v, int i, int j, int k)
{
    const float index[3] = {(float)i, (float)j, (float)k};
    float world[3];
    volume_index_to_world(v, index, world);
    return 2.0f * world[0] - 3.0f * world[1] + 0.5f * world[2];
}

/* Trilinear interpolation gives a linear function exactly, wherever the voxels lie. */
TEST resampling_keeps_a_linear_function(void)
{
    struct volume image, fine;
    ASSERT(make_image(&image));
    ASSERT(volume_create_cubes(&image, 0.7f, 0, &fine));
    for (int k = 0; k < image.dims[2]; ++k)
        for (int j = 0; j < image.dims[1]; ++j)
            for (int i = 0; i < image.dims[0]; ++i) image.data[voxel_at(&image, i, j, k)] = plane(&image, i, j, k);
    resample_volume(&image, image.data, NULL, &fine, fine.data, NULL);
    int inner = 0;
    for (int k = 0; k < fine.dims[2]; ++k)
        for (int j = 0; j < fine.dims[1]; ++j)
            for (int i = 0; i < fine.dims[0]; ++i) {
                const float index[3] = {(float)i, (float)j, (float)k};
                float world[3], at[3];
                volume_index_to_world(&fine, index, world);
                volume_world_to_index(&image, world, at);
                bool inside = true;
                for (int a = 0; a < 3; ++a) inside = inside && at[a] >= 0.0f && at[a] <= (float)(image.dims[a] - 1);
                inner += inside;
                if (inside) ASSERT_IN_RANGE(plane(&fine, i, j, k), fine.data[voxel_at(&fine, i, j, k)], 1e-3f);
            }
    ASSERT(inner > 1000);
    volume_free(&image);
    volume_free(&fine);
    PASS();
}

/* ---- intensities ---- */

/* The blur of a single bright voxel has the variance (size^2 - spacing^2) / 4 along each axis with voxels below `size`;
 * cutting the Gaussian off at three deviations or more takes less than 3 % of it. */
TEST blur_has_the_variance_promised(void)
{
    const int dims[3] = {41, 31, 11};
    const float spacing[3] = {1.0f, 2.0f, 5.0f}, origin[3] = {0.0f, 0.0f, 0.0f}, size = 4.0f;
    struct volume image;
    ASSERT(volume_create(dims, spacing, origin, &image));
    image.data[voxel_at(&image, 20, 15, 5)] = 1.0f;
    ASSERT(segment_blur(&image, size, image.data));
    double sum = 0.0, variance[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < dims[2]; ++k)
        for (int j = 0; j < dims[1]; ++j)
            for (int i = 0; i < dims[0]; ++i) {
                const double v = (double)image.data[voxel_at(&image, i, j, k)];
                sum += v;
                variance[0] += v * (i - 20) * (i - 20);
                variance[1] += v * (j - 15) * (j - 15) * 4.0;
                variance[2] += v * (k - 5) * (k - 5) * 25.0;
            }
    ASSERT_IN_RANGE(1.0, sum, 1e-5);
    ASSERT_IN_RANGE(3.75, variance[0], 0.03 * 3.75);
    ASSERT_IN_RANGE(3.0, variance[1], 0.03 * 3.0);
    ASSERT_EQ(0.0, variance[2]);
    volume_free(&image);
    PASS();
}

TEST blur_keeps_a_constant_up_to_the_border(void)
{
    struct volume image;
    ASSERT(make_image(&image));
    for (size_t n = 0; n < volume_voxels(&image); ++n) image.data[n] = 7.0f;
    ASSERT(segment_blur(&image, 9.0f, image.data));
    for (size_t n = 0; n < volume_voxels(&image); ++n) ASSERT_IN_RANGE(7.0f, image.data[n], 1e-5f);
    volume_free(&image);
    PASS();
}

/* One voxel of 3e38, as damaged files have, leaves the threshold between the two heaps. */
TEST otsu_bears_a_voxel_far_away(void)
{
    enum { N = 20 };
    float data[N * N * N];
    struct volume image = {.dims = {N, N, N}, .data = data, .minimum = 0.0f, .maximum = 3e38f};
    for (int n = 0; n < N * N * N; ++n) data[n] = n % 3 == 0 ? 100.0f + (float)(n % 7) : (float)(n % 11);
    data[17] = 3e38f;
    ASSERT_IN_RANGE(55.0f, segment_otsu(&image), 44.0f);
    ASSERT_IN_RANGE(10.0f, segment_percentile(&image, 0.66), 1.0f);
    PASS();
}

/* Voxels that were NaN are not a third heap: with the minimum's value they are most of the image here. */
TEST otsu_takes_the_finite_voxels(void)
{
    enum { N = 20 };
    float data[N * N * N];
    struct volume image = {.dims = {N, N, N}, .data = data, .minimum = 0.0f, .maximum = 320.0f};
    for (int n = 0; n < N * N * N; ++n) {
        data[n] = n % 4 > 0 ? 0.0f : n % 8 == 0 ? 200.0f + (float)(n % 11) : 300.0f + (float)(n % 21);
        image.replaced += n % 4 > 0;
    }
    data[4] = 0.0f; /* the minimum itself */
    ASSERT_IN_RANGE(255.0f, segment_otsu(&image), 50.0f);
    ASSERT_IN_RANGE(205.0f, segment_percentile(&image, 0.25), 6.0f);
    image.replaced = 0;
    ASSERT(segment_otsu(&image) < 200.0f);
    PASS();
}

TEST otsu_parts_two_heaps(void)
{
    struct volume image;
    ASSERT(make_image(&image));
    image.minimum = -5.0f;
    image.maximum = 105.0f;
    for (size_t n = 0; n < volume_voxels(&image); ++n)
        image.data[n] = (n % 3 == 0 ? 100.0f : 0.0f) + (float)((int)(n * 7 % 11) - 5);
    const float level = segment_otsu(&image);
    ASSERT(level > 5.0f && level < 95.0f);
    ASSERT(segment_percentile(&image, 0.5) <= 5.1f);  /* two thirds lie in the lower heap, */
    ASSERT(segment_percentile(&image, 0.75) >= 94.9f); /* one third in the upper one */
    volume_free(&image);
    PASS();
}

/* Where the image is a ramp the pressure is the distance to the level over the larger of `ramp` and what the image changes
 * by over `size` mm; beyond the image it is the distance to its face over `size`. */
TEST pressure_is_a_distance_where_the_image_is_steep(void)
{
    const int dims[3] = {20, 20, 20};
    const float spacing[3] = {1.0f, 1.0f, 1.0f}, origin[3] = {0.0f, 0.0f, 0.0f}, size = 4.0f;
    static const float slopes[2] = {50.0f, 10.0f}; /* a mm; with ramp = 100 the first one is steep */
    struct volume image, pressure;
    ASSERT(volume_create(dims, spacing, origin, &image));
    ASSERT(volume_create_padded(&image, 4, &pressure));
    for (int s = 0; s < 2; ++s) {
        for (size_t n = 0; n < volume_voxels(&image); ++n) image.data[n] = slopes[s] * (9.5f - (float)(n % 20));
        segment_pressure(&image, image.data, 0.0f, 1e6f, 100.0f, size, &pressure);
        const float divisor = s == 0 ? 4.0f : 10.0f; /* mm */
        for (int i = 4; i < 16; ++i)
            ASSERT_IN_RANGE(fmaxf(-1.0f, fminf(1.0f, (9.5f - (float)i) / divisor)),
                            pressure.data[voxel_at(&pressure, i + 4, 14, 14)], 1e-5f);
        for (int d = 0; d < 4; ++d) /* the object ends at the face, half a voxel before the first voxel beyond it */
            ASSERT_IN_RANGE(-((float)d + 0.5f) / size, pressure.data[voxel_at(&pressure, 3 - d, 14, 14)], 1e-5f);
        ASSERT(pressure.data[voxel_at(&pressure, 4, 14, 14)] > 0.0f);
    }
    volume_free(&image);
    volume_free(&pressure);
    PASS();
}

TEST pressure_of_a_window_has_two_sides(void)
{
    const int dims[3] = {30, 8, 8};
    const float spacing[3] = {1.0f, 1.0f, 1.0f}, origin[3] = {0.0f, 0.0f, 0.0f};
    struct volume image, pressure;
    ASSERT(volume_create(dims, spacing, origin, &image));
    ASSERT(volume_create_padded(&image, 1, &pressure));
    for (size_t n = 0; n < volume_voxels(&image); ++n) image.data[n] = 10.0f * (float)(n % 30);
    segment_pressure(&image, image.data, 95.0f, 205.0f, 20.0f, 1.0f, &pressure);
    for (int i = 1; i < 29; ++i) {
        const float p = pressure.data[voxel_at(&pressure, i + 1, 4, 4)];
        ASSERT_EQ(i >= 10 && i <= 20, p > 0.0f);
        ASSERT(p >= -1.0f && p <= 1.0f);
    }
    volume_free(&image);
    volume_free(&pressure);
    PASS();
}

TEST masks_take_the_labels_asked_for(void)
{
    struct volume labels;
    uint8_t mask[12 * 10 * 8];
    const uint32_t wanted[2] = {2, 5};
    ASSERT(make_image(&labels));
    for (size_t n = 0; n < volume_voxels(&labels); ++n) labels.data[n] = (float)(n % 6);
    ASSERT_EQ(320u, segment_mask(&labels, wanted, 2, mask)); /* 960 voxels, 160 of each label */
    ASSERT(mask[2] && mask[5] && !mask[0] && !mask[3]);
    ASSERT_EQ(800u, segment_mask(&labels, NULL, 0, mask));
    volume_free(&labels);
    PASS();
}

/* ---- parts and distances ---- */

static void add_box(float *phi, const int dims[3], int lo, int hi, float value)
{
    for (int k = lo; k <= hi; ++k)
        for (int j = lo; j <= hi; ++j)
            for (int i = lo; i <= hi; ++i) phi[i + dims[0] * (j + dims[1] * k)] = value;
}

TEST largest_part_stays_and_is_filled(void)
{
    const int dims[3] = {24, 24, 24};
    static float phi[24 * 24 * 24];
    for (size_t n = 0; n < sizeof phi / sizeof *phi; ++n) phi[n] = 2.0f;
    add_box(phi, dims, 2, 11, -1.0f);
    add_box(phi, dims, 5, 7, 1.0f);     /* a cavity */
    add_box(phi, dims, 14, 18, -1.0f);  /* a smaller part */
    phi[20 + 24 * (20 + 24 * 20)] = -1.0f;
    ASSERT(segment_keep_largest(dims, phi));
    for (int k = 0; k < 24; ++k)
        for (int j = 0; j < 24; ++j)
            for (int i = 0; i < 24; ++i) {
                const bool inside = i >= 2 && i <= 11 && j >= 2 && j <= 11 && k >= 2 && k <= 11;
                ASSERT_EQ(inside, phi[i + 24 * (j + 24 * k)] < 0.0f);
            }
    PASS();
}

TEST small_parts_go_and_what_is_left_is_counted(void)
{
    const int dims[3] = {24, 24, 24};
    static float phi[24 * 24 * 24], same[24 * 24 * 24];
    struct segment_parts parts;
    for (size_t n = 0; n < sizeof phi / sizeof *phi; ++n) phi[n] = 2.0f;
    add_box(phi, dims, 2, 11, -1.0f);
    add_box(phi, dims, 5, 7, 1.0f); /* a cavity stays */
    add_box(phi, dims, 14, 18, -1.0f);
    phi[20 + 24 * (20 + 24 * 20)] = -1.0f;
    memcpy(same, phi, sizeof phi);
    ASSERT(segment_remove_parts(dims, phi, 1, false, &parts));
    ASSERT_EQ(3, parts.kept);
    ASSERT_EQ(0, memcmp(same, phi, sizeof phi));
    ASSERT(segment_remove_parts(dims, phi, 2, false, &parts));
    ASSERT(parts.kept == 2 && parts.removed == 1 && parts.voxels == 1000 - 27 + 125);
    same[20 + 24 * (20 + 24 * 20)] = 1.0f;
    ASSERT_EQ(0, memcmp(same, phi, sizeof phi));
    ASSERT(segment_remove_parts(dims, phi, 2, true, &parts));
    ASSERT(parts.kept == 1 && parts.removed == 1 && parts.voxels == 1000 - 27);
    ASSERT(phi[6 + 24 * (6 + 24 * 6)] > 0.0f && phi[16 + 24 * (16 + 24 * 16)] == 1.0f);
    PASS();
}

TEST parts_on_edges_of_the_box_go(void)
{
    const int dims[3] = {24, 24, 24};
    const float spacing[3] = {1.0f, 1.0f, 1.0f}, origin[3] = {0.0f, 0.0f, 0.0f};
    struct volume image, phi;
    ASSERT(volume_create(dims, spacing, origin, &image) && volume_create_padded(&image, 2, &phi));
    for (size_t n = 0; n < volume_voxels(&phi); ++n) phi.data[n] = 2.0f;
    add_box(phi.data, phi.dims, 2, 5, -1.0f);   /* from a corner of the image */
    add_box(phi.data, phi.dims, 10, 14, -1.0f); /* inside */
    phi.data[2 + 28 * (12 + 28 * 20)] = -1.0f;  /* on a face, not on an edge, as a windpipe that the image cuts */
    ASSERT(segment_clear_edges(&image, &phi));
    ASSERT(phi.data[4 + 28 * (4 + 28 * 4)] == 1.0f && phi.data[2 + 28 * (2 + 28 * 2)] == 1.0f);
    ASSERT(phi.data[12 + 28 * (12 + 28 * 12)] == -1.0f && phi.data[2 + 28 * (12 + 28 * 20)] == -1.0f);
    volume_free(&image);
    volume_free(&phi);
    PASS();
}

/* Of a plane the scheme is exact. Of a sphere it is of first order: along a diagonal it errs by a part of the largest
 * spacing that grows with the logarithm of the distance; what was known stays to the last bit. */
TEST distances_go_on_beyond_the_known(void)
{
    const int dims[3] = {40, 30, 20};
    const float spacing[3] = {1.0f, 1.5f, 2.5f}, origin[3] = {0.0f, 0.0f, 0.0f}, known = 4.0f;
    struct volume image;
    ASSERT(volume_create(dims, spacing, origin, &image));
    for (int shape = 0; shape < 2; ++shape) {
        for (int pass = 0; pass < 2; ++pass)
            for (int k = 0; k < dims[2]; ++k)
                for (int j = 0; j < dims[1]; ++j)
                    for (int i = 0; i < dims[0]; ++i) {
                        const float x = (float)i - 19.5f, y = 1.5f * ((float)j - 14.5f), z = 2.5f * ((float)k - 9.5f);
                        const float exact = shape == 0 ? z - 3.0f : sqrtf(x * x + y * y + z * z) - 12.0f;
                        float *d = &image.data[voxel_at(&image, i, j, k)];
                        if (pass == 0) {
                            *d = fmaxf(-known, fminf(known, exact));
                        } else if (fabsf(exact) < known) {
                            ASSERT_EQ(exact, *d);
                        } else {
                            ASSERT((exact < 0.0f) == (*d < 0.0f));
                            ASSERT_IN_RANGE(exact, *d, shape == 0 ? 1e-4f : 0.5f * spacing[2]);
                        }
                        if (pass == 0 && k == dims[2] - 1 && j == dims[1] - 1 && i == dims[0] - 1)
                            segment_extend_distance(&image, known, image.data);
                    }
    }
    volume_free(&image);
    PASS();
}

/* A bone: a box's wall of one voxel from (5,5,low) to (14,14,14), with a hole of side x side voxels in the face k = 14. The
 * pressure in its marrow and beside it, after what it shuts in has become its own. */
static bool marrow(int low, int side, float *within, float *beside)
{
    const int dims[3] = {20, 20, 20};
    const float ones[3] = {1.0f, 1.0f, 1.0f}, none[3] = {0.0f, 0.0f, 0.0f};
    struct volume image, padded;
    if (!volume_create(dims, ones, none, &image)) return false;
    bool good = volume_create_padded(&image, 2, &padded);
    for (int k = 0; good && k < 24; ++k)
        for (int j = 0; j < 24; ++j)
            for (int i = 0; i < 24; ++i) {
                const int p[3] = {i - 2, j - 2, k - 2};
                bool box = true, wall = false;
                for (int a = 0; a < 3; ++a) {
                    box = box && p[a] >= (a == 2 ? low : 5) && p[a] <= 14;
                    wall = wall || p[a] == (a == 2 ? low : 5) || p[a] == 14;
                }
                const bool hole = p[2] == 14 && abs(p[0] - 9) <= side / 2 && abs(p[1] - 9) <= side / 2;
                padded.data[voxel_at(&padded, i, j, k)] = box && wall && !hole ? 1.0f : -1.0f;
            }
    good = good && segment_pressure_solid(&image, 1.0f, &padded);
    *within = good ? padded.data[voxel_at(&padded, 11, 11, 11)] : 0.0f;
    *beside = good ? padded.data[voxel_at(&padded, 4, 11, 11)] : 0.0f;
    volume_free(&image);
    volume_free(&padded);
    return good;
}

TEST what_a_wall_shuts_in_is_inside(void)
{
    float within, beside;
    ASSERT(marrow(5, 0, &within, &beside)); /* a hole of one voxel */
    ASSERT_EQ(1.0f, within);
    ASSERT_EQ(-1.0f, beside);
    ASSERT(marrow(5, 4, &within, &beside)); /* of five: the ball comes in */
    ASSERT_EQ(-1.0f, within);
    ASSERT(marrow(-1, 0, &within, &beside)); /* cut by the border of the image, which lets nothing in */
    ASSERT_EQ(1.0f, within);
    ASSERT_EQ(-1.0f, beside);
    PASS();
}

/* ---- at rest? ---- */

static void drift(void *user, const float *points, int count, float time, float *out)
{
    (void)points, (void)time;
    for (int i = 0; i < count; ++i, out += 3) {
        out[0] = *(const float *)user;
        out[1] = out[2] = 0.0f;
    }
}

static springls_context *ball(float radius)
{
    springls_desc desc;
    springls_sphere sphere = {{20.0f, 20.0f, 20.0f}, radius};
    springls_context *ctx = NULL;
    memset(&desc, 0, sizeof desc);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 40;
    if (springls_create(&desc, &ctx) == SPRINGLS_OK) springls_set_implicit(ctx, springls_implicit_sphere, &sphere);
    return ctx;
}

/* A sphere moved by 0.5 voxel moves by more than 0.25 along the normal where |n.x| > 0.5: on half of its area. */
TEST watch_sees_motion_along_the_normal(void)
{
    springls_context *ctx = ball(12.0f);
    struct segment_watch watch;
    springls_forces forces;
    float speed = 0.5f, moving = 0.0f;
    memset(&watch, 0, sizeof watch);
    memset(&forces, 0, sizeof forces);
    forces.velocity = drift;
    forces.user = &speed;
    ASSERT(springls_count(ctx) > 1000);
    ASSERT(segment_watch_look(&watch, ctx, 0.25f, &moving));
    ASSERT_EQ(1.0f, moving); /* nothing to compare with */
    ASSERT(segment_watch_look(&watch, ctx, 0.25f, &moving));
    ASSERT_EQ(0.0f, moving);
    ASSERT_EQ(SPRINGLS_OK, springls_advect(ctx, &forces, 0.0f, 1.0f));
    ASSERT(segment_watch_look(&watch, ctx, 0.25f, &moving));
    ASSERT_IN_RANGE(0.5f, moving, 0.05f);
    segment_watch_free(&watch);
    springls_destroy(ctx);
    PASS();
}

/* A front that climbs a spine moves few springls, yet adds to the volume. */
TEST rest_wants_few_springls_moving_and_a_volume_that_stays(void)
{
    double before = 1000.0;
    ASSERT_FALSE(segment_at_rest(1.0f, 1000.0, 10, &before));
    ASSERT_FALSE(segment_at_rest(0.01f, 1010.0, 10, &before));
    ASSERT_EQ(1010.0, before);
    ASSERT_FALSE(segment_at_rest(0.03f, 1010.5, 10, &before));
    ASSERT(segment_at_rest(0.01f, 1010.0, 10, &before));
    PASS();
}

static void outward(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    (void)user, (void)points, (void)normals, (void)time;
    for (int i = 0; i < count; ++i) out[i] = 0.5f;
}

/* What the watch stands on: springls stay in the order of their ids while some are split, added and removed. */
TEST ids_ascend_while_springls_come_and_go(void)
{
    springls_context *ctx = ball(6.0f);
    springls_forces forces;
    springls_step_desc step;
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    springls_params params = springls_get_params(ctx);
    params.split_edge = 1.4f; /* the usual set fills where the surface grows; here some are to be split as well */
    params.cover = 0;
    ASSERT_EQ(SPRINGLS_OK, springls_set_params(ctx, &params));
    forces.pressure = outward;
    step.forces = &forces;
    step.dt = 0.8f;
    for (int s = 0; s < 20; ++s) {
        ASSERT_EQ(SPRINGLS_OK, springls_step(ctx, &step));
        const uint32_t *ids = springls_ids(ctx);
        for (int i = 1; i < springls_count(ctx); ++i) ASSERT(ids[i - 1] < ids[i]);
    }
    const springls_stats stats = springls_get_stats(ctx);
    ASSERT(stats.split > 0 && stats.added > 0);
    springls_destroy(ctx);
    PASS();
}

/* ---- --set ---- */

TEST every_parameter_can_be_set(void)
{
    enum { WORD = sizeof(uint32_t), WORDS = sizeof(springls_params) / WORD, MEMBERS = sizeof members / sizeof *members };
    const springls_params usual = springls_default_params();
    springls_params params;
    uint32_t words[WORDS];
    ASSERT_EQ(sizeof(springls_params), MEMBERS * WORD + sizeof params.cookie);
    memset(&params, 0xff, sizeof params);
    for (size_t m = 0; m < MEMBERS; ++m) {
        char text[64];
        snprintf(text, sizeof text, "%s=7", members[m].name);
        ASSERT_EQm(text, CLI_CONTINUE, run_set_members("test", text, &params));
        /* A number taken for the other kind shows: small integers are denormal floats, and floats are huge integers. */
        float real;
        int whole;
        memcpy(&real, (const char *)&usual + members[m].offset, WORD);
        memcpy(&whole, (const char *)&usual + members[m].offset, WORD);
        ASSERTm(text, whole == 0 || (isnormal(real) != 0) == members[m].is_float);
    }
    memcpy(words, &params, sizeof words);
    for (size_t w = 0; w < WORDS; ++w) { /* each word by one member, and the cookie by none */
        ASSERT_EQ(w == offsetof(springls_params, cookie) / WORD, words[w] == UINT32_MAX);
    }
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(grids_cover_the_box_of_the_image);
    RUN_TEST(resampling_keeps_a_linear_function);
    RUN_TEST(blur_has_the_variance_promised);
    RUN_TEST(blur_keeps_a_constant_up_to_the_border);
    RUN_TEST(otsu_parts_two_heaps);
    RUN_TEST(otsu_bears_a_voxel_far_away);
    RUN_TEST(otsu_takes_the_finite_voxels);
    RUN_TEST(pressure_is_a_distance_where_the_image_is_steep);
    RUN_TEST(pressure_of_a_window_has_two_sides);
    RUN_TEST(masks_take_the_labels_asked_for);
    RUN_TEST(largest_part_stays_and_is_filled);
    RUN_TEST(small_parts_go_and_what_is_left_is_counted);
    RUN_TEST(parts_on_edges_of_the_box_go);
    RUN_TEST(distances_go_on_beyond_the_known);
    RUN_TEST(what_a_wall_shuts_in_is_inside);
    RUN_TEST(watch_sees_motion_along_the_normal);
    RUN_TEST(rest_wants_few_springls_moving_and_a_volume_that_stays);
    RUN_TEST(ids_ascend_while_springls_come_and_go);
    RUN_TEST(every_parameter_can_be_set);
    GREATEST_MAIN_END();
}

#endif
