/* The whole of examples/segment.c on small images made here, and what it stands on: gradient vector flow, the mirror, the
 * forces' sum, the level set without springls. Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_contour_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_contour_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

/* The program, whose inner functions are called here. */
#define main segment_main
#include "../../examples/segment/segment.c"
#undef main
#include "../../examples/segment/cut.c"
#include "../../examples/segment/doubt.c"
#include "../../examples/segment/forces.c"
#include "../../examples/segment/grid.c"
#include "../../examples/segment/input.c"
#include "../../examples/segment/level_set.c"
#include "../../examples/segment/output.c"
#include "../../examples/segment/run.c"

#include "../../examples/common/imaging/level_set.h"
#include "../../examples/common/imaging/mirror.h"

#include <sys/stat.h>
#include <unistd.h>

static char folder[] = "/tmp/springls_contour_XXXXXX";

static const char *in_folder(const char *name)
{
    static char path[8][256];
    static int turn;
    turn = (turn + 1) % 8;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static size_t voxel_at(const struct volume *v, int i, int j, int k)
{
    return (size_t)i + (size_t)v->dims[0] * ((size_t)j + (size_t)v->dims[1] * (size_t)k);
}

static bool make(int nx, int ny, int nz, float spacing, struct volume *v)
{
    const int dims[3] = {nx, ny, nz};
    const float h[3] = {spacing, spacing, spacing}, origin[3] = {0.0f, 0.0f, 0.0f};
    return volume_create(dims, h, origin, v);
}

/* A ball whose border is a ramp of one voxel: `value` within. */
static void add_ball(struct volume *v, float x, float y, float z, float radius, float value)
{
    for (int k = 0; k < v->dims[2]; ++k)
        for (int j = 0; j < v->dims[1]; ++j)
            for (int i = 0; i < v->dims[0]; ++i) {
                const float dx = (float)i - x, dy = (float)j - y, dz = (float)k - z;
                const float inside = radius + 0.5f - sqrtf(dx * dx + dy * dy + dz * dz);
                float *at = &v->data[voxel_at(v, i, j, k)];
                *at += fmaxf(0.0f, fminf(1.0f, inside)) * (value - *at);
            }
}

static bool save(const struct volume *v, const char *path)
{
    char error[VOLUME_TEXT];
    return volume_write(path, v, VOLUME_FLOAT32, v->data, error);
}

/* ---- gradient vector flow ---- */

/* Outside of a ball the flow leads inward from everywhere, inside outward; of length 1 but at the edge. At half resolution
 * it is the same. */
TEST flow_leads_to_edges_from_afar(void)
{
    struct volume image;
    struct gvf flow[2];
    ASSERT(make(48, 44, 40, 1.0f, &image));
    add_ball(&image, 24, 22, 20, 9, 1.0f);
    for (int h = 0; h < 2; ++h) {
        double worst = 1.0;
        ASSERT(gvf_compute(&image, h, 0.2f, 1.0f, &flow[h]));
        ASSERT_EQ((48 + h) / (1 + h), flow[h].grid.dims[0]);
        for (int n = 0; n < 400; ++n) {
            const float turn = 2.4f * (float)n, up = ((float)n + 0.5f) / 200.0f - 1.0f, flat = sqrtf(1.0f - up * up);
            const float radius = n % 3 == 0 ? 17.0f : n % 3 == 1 ? 13.0f : 5.0f;
            const float d[3] = {flat * cosf(turn), flat * sinf(turn), up};
            float world[3], index[3], v[3];
            for (int a = 0; a < 3; ++a) world[a] = (a == 0 ? 24.0f : a == 1 ? 22.0f : 20.0f) + radius * d[a];
            volume_world_to_index(&flow[h].grid, world, index);
            gvf_sample(&flow[h], index, v);
            const float along = v[0] * d[0] + v[1] * d[1] + v[2] * d[2];
            worst = fmin(worst, (double)(radius > 9.0f ? -along : along));
        }
        ASSERT_GT(worst, 0.85);
    }
    for (int k = 0; k < flow[1].grid.dims[2]; ++k) { /* half as fine, nearly the same way, at 4 voxels and more from the edge */
        for (int j = 0; j < flow[1].grid.dims[1]; ++j) {
            for (int i = 0; i < flow[1].grid.dims[0]; ++i) {
                const float index[3] = {(float)i, (float)j, (float)k};
                float world[3], fine[3], a[3], b[3];
                volume_index_to_world(&flow[1].grid, index, world);
                volume_world_to_index(&flow[0].grid, world, fine);
                const float x = world[0] - 24, y = world[1] - 22, z = world[2] - 20, r = sqrtf(x * x + y * y + z * z);
                if (fabsf(r - 9.0f) < 4.0f || r < 3.0f || r > 16.0f) continue;
                gvf_sample(&flow[0], fine, a);
                gvf_sample(&flow[1], index, b);
                ASSERT_GT(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], 0.85f);
            }
        }
    }
    gvf_free(&flow[0]);
    gvf_free(&flow[1]);
    volume_free(&image);
    PASS();
}

TEST flow_of_a_constant_image_is_zero(void)
{
    struct volume image;
    struct gvf flow;
    ASSERT(make(20, 20, 20, 1.0f, &image));
    ASSERT(gvf_compute(&image, 0, 0.2f, 1.0f, &flow));
    for (size_t n = 0; n < 3 * volume_voxels(&image); ++n) ASSERT_EQ(0.0f, flow.field[n]);
    gvf_free(&flow);
    volume_free(&image);
    PASS();
}

/* ---- forces ---- */

TEST forces_add_up_as_written(void)
{
    struct volume image, padded;
    ASSERT(make(16, 16, 16, 2.0f, &image)); /* values 0, 10, 20, ... along x */
    for (size_t n = 0; n < volume_voxels(&image); ++n) image.data[n] = 10.0f * (float)(n % 16);
    ASSERT(volume_create_padded(&image, 1, &padded));
    const size_t total = volume_voxels(&padded);
    float *zero = calloc(total, sizeof *zero), *some = calloc(total, sizeof *some), *away = calloc(total, sizeof *away);
    ASSERT(zero && some && away);
    for (size_t n = 0; n < total; ++n) some[n] = 0.5f;
    for (int k = 0; k < 18; ++k)
        for (int j = 0; j < 18; ++j)
            for (int i = 0; i < 18; ++i) away[voxel_at(&padded, i, j, k)] = 2.0f * ((float)i - 9.0f); /* mm */
    struct segment_push push = {.pressure = zero, .image = image.data, .region_weight = 0.5f, .inside = 100.0f, .outside = 40.0f,
                                .ramp = 10.0f, .size = 2.0f};
    segment_combine(&image, &push, &padded);
    for (int i = 2; i < 14; ++i) { /* half of (2u - c1 - c2) / (c1 - c2), cut at 1 */
        const float u = 10.0f * (float)i, expected = 0.5f * fmaxf(-1.0f, fminf(1.0f, (2.0f * u - 140.0f) / 60.0f));
        ASSERT_IN_RANGE(expected, padded.data[voxel_at(&padded, i + 1, 9, 9)], 1e-5f);
    }
    push.region_weight = 0.0f;
    push.pressure = some;
    push.pressure_weight = 1.0f;
    push.edge_weight = 1.0f; /* the image changes by 10 = ramp over `size`: half of the push is left */
    segment_combine(&image, &push, &padded);
    ASSERT_IN_RANGE(0.25f, padded.data[voxel_at(&padded, 9, 9, 9)], 1e-5f);
    push.edge_weight = 0.0f;
    push.away = away;
    push.stay = 3.0f;
    segment_combine(&image, &push, &padded);
    ASSERT_IN_RANGE(0.5f, padded.data[voxel_at(&padded, 9, 9, 9)], 1e-5f);   /* at the start the pressure alone */
    ASSERT_IN_RANGE(0.5f, padded.data[voxel_at(&padded, 10, 9, 9)], 1e-5f);  /* 2 mm: (3 - 2) / 2 is as much */
    ASSERT_IN_RANGE(-0.5f, padded.data[voxel_at(&padded, 11, 9, 9)], 1e-5f); /* 4 mm: back */
    ASSERT_IN_RANGE(1.0f, padded.data[voxel_at(&padded, 5, 9, 9)], 1e-5f);   /* 8 mm inside: out again */
    free(zero);
    free(some);
    free(away);
    volume_free(&image);
    volume_free(&padded);
    PASS();
}

/* ---- mirror ---- */

/* A body of three balls a side, one side turned and shifted after the reflection: the motion is found again. */
TEST mirror_is_found(void)
{
    struct volume image;
    ASSERT(make(64, 40, 40, 1.0f, &image));
    static const float balls[3][4] = {{14, 16, 14, 6}, {18, 26, 20, 5}, {11, 20, 27, 4}};
    const float angle = 0.08f, c = cosf(angle), s = sinf(angle);
    uint8_t *mask = calloc(volume_voxels(&image), 1);
    ASSERT(mask);
    for (int b = 0; b < 3; ++b) add_ball(&image, balls[b][0], balls[b][1], balls[b][2], balls[b][3], 1.0f);
    for (size_t n = 0; n < volume_voxels(&image); ++n) mask[n] = image.data[n] > 0.5f;
    for (int b = 0; b < 3; ++b) { /* x -> 65.5 - x, then turned about z around (50, 20) and shifted along z by 1.7 */
        const float x = 65.5f - balls[b][0] - 50.0f, y = balls[b][1] - 20.0f;
        add_ball(&image, 50.0f + c * x - s * y, 20.0f + s * x + c * y, balls[b][2] + 1.7f, balls[b][3], 1.0f);
    }
    struct mirror mirror;
    ASSERT(mirror_find(&image, image.data, mask, 3.0f, &mirror));
    for (int b = 0; b < 3; ++b) {
        double y[3];
        const float x = 65.5f - balls[b][0] - 50.0f, z = balls[b][1] - 20.0f;
        for (int r = 0; r < 3; ++r) {
            y[r] = mirror.t[r];
            for (int a = 0; a < 3; ++a) y[r] += mirror.m[r][a] * (double)balls[b][a];
        }
        ASSERT_IN_RANGE(50.0 + (double)(c * x - s * z), y[0], 0.15);
        ASSERT_IN_RANGE(20.0 + (double)(s * x + c * z), y[1], 0.15);
        ASSERT_IN_RANGE((double)balls[b][2] + 1.7, y[2], 0.15);
    }
    struct volume mask_there, placed;
    ASSERT(volume_create_padded(&image, 0, &mask_there) && volume_create_padded(&image, 0, &placed));
    for (size_t n = 0; n < volume_voxels(&image); ++n) mask_there.data[n] = mask[n] ? -0.5f : 0.5f;
    mirror_apply(&mirror, &mask_there, &placed, placed.data);
    size_t wrong = 0, right = 0;
    for (int k = 0; k < 40; ++k)
        for (int j = 0; j < 40; ++j)
            for (int i = 32; i < 64; ++i) {
                const size_t n = voxel_at(&image, i, j, k);
                const bool in = placed.data[n] < 0.0f, there = image.data[n] > 0.5f;
                wrong += in != there;
                right += in && there;
            }
    ASSERT_GT(right, 1300u);
    ASSERT_LT(wrong, right / 8); /* borders of small balls, cut into voxels twice */
    free(mask);
    volume_free(&image);
    volume_free(&mask_there);
    volume_free(&placed);
    PASS();
}

/* ---- the level set alone ---- */

static void constant_speed(void *user, const float *points, const float *normals, int count, float *out)
{
    (void)points, (void)normals;
    for (int i = 0; i < count; ++i) out[i] = *(const float *)user;
}

static bool ball_level_set(float radius, struct level_set *set)
{
    const int dims[3] = {40, 40, 40};
    struct volume v;
    if (!make(40, 40, 40, 1.0f, &v)) return false;
    for (int k = 0; k < 40; ++k)
        for (int j = 0; j < 40; ++j)
            for (int i = 0; i < 40; ++i) {
                const float x = (float)i - 19.5f, y = (float)j - 19.5f, z = (float)k - 19.5f;
                v.data[voxel_at(&v, i, j, k)] = sqrtf(x * x + y * y + z * z) - radius;
            }
    const bool made = level_set_create(set, dims, v.data);
    volume_free(&v);
    return made;
}

/* The radius that the zero level has along the axes, and the largest error of phi as a distance within 2 voxels of it. */
static float radius_of(const struct level_set *set, float *error)
{
    float sum = 0.0f;
    for (int a = 0; a < 3; ++a) {
        size_t step = 1;
        for (int b = 0; b < a; ++b) step *= 40;
        for (int i = 20; i < 39; ++i) {
            const size_t at = 20 + 40 * (20 + 40 * (size_t)20) + (size_t)(i - 20) * step;
            if (set->phi[at] <= 0.0f && set->phi[at + step] > 0.0f) {
                const float x = (float)i + set->phi[at] / (set->phi[at] - set->phi[at + step]) - 19.5f;
                sum += sqrtf(x * x + 0.5f); /* the row passes half a voxel beside the middle, twice */
            }
        }
    }
    *error = 0.0f;
    for (int k = 0; k < 40; ++k)
        for (int j = 0; j < 40; ++j)
            for (int i = 0; i < 40; ++i) {
                const float x = (float)i - 19.5f, y = (float)j - 19.5f, z = (float)k - 19.5f;
                const float exact = sqrtf(x * x + y * y + z * z) - sum / 3.0f;
                if (fabsf(exact) < 2.0f) *error = fmaxf(*error, fabsf(exact - set->phi[i + 40 * (j + 40 * k)]));
            }
    return sum / 3.0f;
}

TEST level_set_alone_grows_shrinks_and_rests(void)
{
    struct level_set set;
    float speed = 1.0f, error;
    ASSERT(ball_level_set(9.0f, &set));
    set.speed = constant_speed;
    set.user = &speed;
    set.fastest = 1.0f;
    ASSERT_EQ(1.0f, level_set_moving(&set, 0.1f));
    for (int s = 0; s < 10; ++s) level_set_step(&set, 0.5f);
    ASSERT_IN_RANGE(14.0f, radius_of(&set, &error), 0.15f);
    ASSERT_LT(error, 0.5f);
    ASSERT_EQ(1.0f, level_set_moving(&set, 0.1f));
    speed = 0.0f;
    for (int s = 0; s < 10; ++s) level_set_step(&set, 0.5f);
    ASSERT_EQ(0.0f, level_set_moving(&set, 0.05f));
    speed = -1.0f;
    for (int s = 0; s < 16; ++s) level_set_step(&set, 0.5f);
    ASSERT_IN_RANGE(6.0f, radius_of(&set, &error), 0.4f); /* of first order: 5 % of the way */
    level_set_free(&set);
    PASS();
}

/* Motion by curvature takes a sphere from r0 to sqrt(r0^2 - 4 w t). */
TEST level_set_alone_shrinks_by_curvature(void)
{
    struct level_set set;
    float speed = 0.0f, error;
    ASSERT(ball_level_set(9.0f, &set));
    set.speed = constant_speed;
    set.user = &speed;
    set.fastest = 1.0f;
    set.curvature = 0.1f;
    for (int s = 0; s < 160; ++s) level_set_step(&set, 0.5f);
    ASSERT_IN_RANGE(sqrtf(81.0f - 4.0f * 0.1f * 80.0f), radius_of(&set, &error), 0.2f);
    level_set_free(&set);
    PASS();
}

/* ---- the whole program ---- */

/* Words between blanks; quiet. */
static int call(const char *words)
{
    static char text[2048];
    char *argv[64] = {NULL};
    int argc = 0;
    snprintf(text, sizeof text, "segment --quiet %s", words);
    for (char *word = strtok(text, " "); word && argc < 63; word = strtok(NULL, " ")) argv[argc++] = word;
    return segment_main(argc, argv);
}

static double number_in(const char *file, const char *key)
{
    char text[8192] = "", name[64];
    FILE *f = fopen(in_folder(file), "r");
    if (!f) return (double)NAN;
    text[fread(text, 1, sizeof text - 1, f)] = '\0';
    fclose(f);
    snprintf(name, sizeof name, "\"%s\":", key);
    const char *at = strstr(text, name);
    return at ? strtod(at + strlen(name), NULL) : (double)NAN;
}

static bool text_in(const char *file, const char *wanted)
{
    char text[8192] = "";
    FILE *f = fopen(in_folder(file), "r");
    if (!f) return false;
    text[fread(text, 1, sizeof text - 1, f)] = '\0';
    fclose(f);
    return strstr(text, wanted) != NULL;
}

/* Two balls, 100 and 200, on 0. */
static bool two_balls(struct volume *v)
{
    if (!make(40, 24, 24, 1.5f, v)) return false;
    add_ball(v, 11, 12, 12, 7, 100.0f);
    add_ball(v, 29, 12, 12, 6, 200.0f);
    return true;
}

TEST two_windows_make_one_map_in_the_format_of_the_input(void)
{
    struct volume v, found[2];
    char words[1024], error[VOLUME_TEXT];
    ASSERT(two_balls(&v) && save(&v, in_folder("two.mha")));
    snprintf(words, sizeof words, "%s --window 60,140;160,300 --init threshold --out %s", in_folder("two.mha"), in_folder("two"));
    ASSERT_EQ(0, call(words));
    ASSERT(volume_read(in_folder("two/labels.nii.gz"), 0, &found[0], error));
    ASSERT(volume_read(in_folder("two/labels.mha"), 0, &found[1], error));
    for (int f = 0; f < 2; ++f) {
        size_t counts[3] = {0, 0, 0};
        ASSERT(volume_same_grid(&v, &found[f]));
        for (size_t n = 0; n < volume_voxels(&v); ++n) {
            const float label = found[f].data[n];
            ASSERT(label == 0.0f || label == 1.0f || label == 2.0f);
            counts[(int)label]++;
        }
        ASSERT_EQ(1.0f, found[f].data[voxel_at(&v, 11, 12, 12)]);
        ASSERT_EQ(2.0f, found[f].data[voxel_at(&v, 29, 12, 12)]);
        ASSERT_IN_RANGE(1376.0, (double)counts[1], 110.0); /* where the first reaches 60, the radius is 6.9; */
        ASSERT_IN_RANGE(776.0, (double)counts[2], 70.0);   /* where the second reaches 160, 5.7 */
        volume_free(&found[f]);
    }
    ASSERT_EQ(0, access(in_folder("two/surface_1.ply"), R_OK));
    ASSERT_EQ(0, access(in_folder("two/film_2.png"), R_OK));
    ASSERT_EQ(0, access(in_folder("two/slices.png"), R_OK));
    volume_free(&v);
    PASS();
}

/* Labels are written as they are asked for, up to 32 bits; without pictures the other files are there, and no older pictures. */
TEST labels_of_32_bits_are_written_without_pictures(void)
{
    struct volume v, mask, found;
    char words[1024], error[VOLUME_TEXT];
    uint32_t ids[40 * 24 * 24];
    ASSERT(two_balls(&v) && save(&v, in_folder("two.nii")));
    for (size_t n = 0; n < volume_voxels(&v); ++n) ids[n] = v.data[n] > 50.0f ? v.data[n] > 150.0f ? 4000000001u : 4000000000u : 0;
    ASSERTm(error, volume_write(in_folder("ids.nii.gz"), &v, VOLUME_UINT32, ids, error));
    static const char *const earlier[] = {"slices.png", "surface_4000000000.png", "film_4000000000.png", "surface_4000000001.png",
                                          "film_4000000001.png"};
    char picture[256];
    ASSERT_EQ(0, mkdir(in_folder("ids"), 0777)); /* an earlier run's, and one by somebody else */
    for (size_t p = 0; p < 6; ++p) {
        snprintf(picture, sizeof picture, "ids/%s", p < 5 ? earlier[p] : "film_mine.png");
        FILE *file = fopen(in_folder(picture), "w");
        ASSERT(file != NULL && fclose(file) == 0);
    }
    snprintf(words, sizeof words, "%s --level 50 --init mask --mask %s --mask-label 4000000000;4000000001 --steps 5 --no-pictures --out %s",
             in_folder("two.nii"), in_folder("ids.nii.gz"), in_folder("ids"));
    ASSERT_EQ(0, call(words));
    ASSERTm(error, volume_read_labels(in_folder("ids/labels.nii.gz"), 0, NULL, &found, error));
    ASSERT_EQ(4000000000u, found.ids[voxel_at(&v, 11, 12, 12)]);
    ASSERT_EQ(4000000001u, found.ids[voxel_at(&v, 29, 12, 12)]);
    ASSERT_EQ(0, access(in_folder("ids/surface_4000000001.ply"), R_OK));
    for (size_t p = 0; p < 5; ++p) {
        snprintf(picture, sizeof picture, "ids/%s", earlier[p]);
        ASSERTm(picture, access(in_folder(picture), F_OK) != 0);
    }
    ASSERT_EQ(0, access(in_folder("ids/film_mine.png"), F_OK));
    ASSERTm(error, volume_read_labels(in_folder("ids.nii.gz"), 0, NULL, &mask, error));
    volume_free(&mask);
    volume_free(&found);
    volume_free(&v);
    PASS();
}

/* All four shapes, with every force, find the brighter ball; and a level set alone comes to rest at the same place. */
TEST every_start_and_every_force_find_the_ball(void)
{
    static const char *const starts[] = {"sphere", "cube", "torus", "metasphere"};
    static const char *const forces[] = {"", "--pressure 0.5 --region 0.5", "--gvf 0.5 --edge 0.5",
                                         "--pressure 0 --region 1 --region-means image"};
    static const double least[] = {0.99, 0.99, 0.93, 0.97}; /* the flow's voxels are 4 mm, the ball's radius 16 */
    struct volume v, truth;
    char words[1024];
    ASSERT(make(32, 32, 32, 2.0f, &v) && make(32, 32, 32, 2.0f, &truth));
    add_ball(&v, 16, 15, 16, 8, 100.0f);
    add_ball(&truth, 16, 15, 16, 8, 1.0f);
    for (size_t n = 0; n < volume_voxels(&truth); ++n) truth.data[n] = roundf(truth.data[n]);
    ASSERT(save(&v, in_folder("ball.nrrd")) && save(&truth, in_folder("truth.nii")));
    for (int t = 0; t < 4; ++t) {
        snprintf(words, sizeof words, "%s --level 50 --init %s --radius 24 --levels 1 --reference %s --json %s %s%s",
                 in_folder("ball.nrrd"), starts[t], in_folder("truth.nii"), in_folder("ball.json"), forces[t],
                 t % 2 == 0 ? " --compare-level-set" : "");
        ASSERT_EQm(starts[t], 0, call(words));
        ASSERT_GTm(starts[t], number_in("ball.json", "dice"), least[t]);
        ASSERT_LT(number_in("ball.json", "hd95_mm"), 1.5); /* three quarters of a voxel */
        if (t % 2 == 0) ASSERT_LT(number_in("ball.json", "deviation_mm"), 0.3);
    }
    volume_free(&v);
    volume_free(&truth);
    PASS();
}

/* The mask of one side finds the other one; --stay keeps it from running over into a neighbour that is as bright. */
TEST mirrored_mask_finds_the_other_side(void)
{
    struct volume v, left, right;
    char words[1024];
    ASSERT(make(56, 32, 32, 1.0f, &v) && make(56, 32, 32, 1.0f, &left) && make(56, 32, 32, 1.0f, &right));
    for (int side = 0; side < 2; ++side) {
        const float m = side ? -1.0f : 1.0f, x0 = side ? 56.0f : 0.0f;
        struct volume *mask = side ? &right : &left;
        add_ball(&v, x0 + m * 15, 14, 16, 8, 100.0f);
        add_ball(&v, x0 + m * 15, 26, 16, 5, 100.0f); /* the neighbour touches it */
        add_ball(&v, x0 + m * 22, 10, 9, 4, 100.0f);
        add_ball(mask, x0 + m * 15, 14, 16, 8, 1.0f);
        for (size_t n = 0; n < volume_voxels(mask); ++n) mask->data[n] = roundf(mask->data[n]);
    }
    ASSERT(save(&v, in_folder("body.nii.gz")));
    ASSERT(save(&left, in_folder("left.nii.gz")) && save(&right, in_folder("right.nii.gz")));
    double dice[2];
    for (int free_to_go = 0; free_to_go < 2; ++free_to_go) {
        snprintf(words, sizeof words, "%s --level 50 --init mask --mask %s --mirror --reference %s --json %s%s",
                 in_folder("body.nii.gz"), in_folder("left.nii.gz"), in_folder("right.nii.gz"), in_folder("body.json"),
                 free_to_go ? " --stay 0" : "");
        ASSERT_EQ(0, call(words));
        dice[free_to_go] = number_in("body.json", "dice");
        ASSERT_GT(number_in("body.json", "start_dice"), 0.95);
    }
    ASSERT_GT(dice[0], 0.95);
    ASSERT_LT(dice[1], dice[0] - 0.03);
    volume_free(&v);
    volume_free(&left);
    volume_free(&right);
    PASS();
}

/* Without --grid the cells are the image's voxels, also for more than 128 of them. */
TEST grid_is_the_images_own(void)
{
    struct volume v;
    char words[1024];
    ASSERT(make(160, 16, 16, 0.9f, &v));
    add_ball(&v, 40, 8, 8, 5, 100.0f);
    ASSERT(save(&v, in_folder("long.nii")));
    for (int grid = 0; grid < 2; ++grid) {
        snprintf(words, sizeof words, "%s --level 50 --init threshold --json %s%s", in_folder("long.nii"), in_folder("long.json"),
                 grid ? " --grid 80" : "");
        ASSERT_EQ(0, call(words));
        ASSERT_IN_RANGE(grid ? 1.8 : 0.9, number_in("long.json", "voxel_mm"), 1e-5);
    }
    volume_free(&v);
    PASS();
}

/* Runs the program; what it prints on stderr goes into stderr.txt. Returns its status, or -1 where that cannot be opened. */
static int call_with_errors(const char *words)
{
    fflush(stderr);
    const int kept = dup(2);
    if (kept < 0 || !freopen(in_folder("stderr.txt"), "w", stderr)) return -1;
    const int status = call(words);
    fflush(stderr);
    dup2(kept, 2);
    close(kept);
    return status;
}

/* What is left at the end: the label map, the surface and their numbers agree. */
TEST islands_are_kept_or_removed(void)
{
    static const char *const words_of[] = {"", " --keep-largest", " --min-volume 700", " --min-volume 400", " --min-volume 1e6"};
    static const int left[] = {2, 1, 1, 2, -1};
    struct volume v, found;
    char words[1024], error[VOLUME_TEXT];
    ASSERT(make(40, 24, 24, 1.0f, &v));
    add_ball(&v, 11, 12, 12, 7, 100.0f);
    add_ball(&v, 29, 12, 12, 5, 100.0f); /* 524 mm^3 */
    v.data[voxel_at(&v, 36, 3, 3)] = 100.0f; /* a single voxel always goes */
    ASSERT(save(&v, in_folder("islands.nii")));
    for (int w = 0; w < 5; ++w) {
        snprintf(words, sizeof words, "%s --level 50 --init threshold --out %s%s", in_folder("islands.nii"), in_folder("islands"),
                 words_of[w]);
        if (left[w] < 0) {
            ASSERT_EQ(1, call_with_errors(words));
            continue;
        }
        ASSERT_EQm(words_of[w], 0, call(words));
        ASSERT_EQm(words_of[w], left[w], (int)number_in("islands/report.json", "components"));
        ASSERT_EQm(words_of[w], left[w], (int)number_in("islands/report.json", "label_components"));
        ASSERT(volume_read(in_folder("islands/labels.nii.gz"), 0, &found, error));
        ASSERT_EQ(1.0f, found.data[voxel_at(&found, 11, 12, 12)]);
        ASSERT_EQ(left[w] == 2 ? 1.0f : 0.0f, found.data[voxel_at(&found, 29, 12, 12)]);
        ASSERT_EQ(0.0f, found.data[voxel_at(&found, 36, 3, 3)]);
        volume_free(&found);
    }
    volume_free(&v);
    PASS();
}

/* From a seed grows the part that it is in, from two seeds both. */
TEST seeds_grow_into_their_parts(void)
{
    struct volume v, found;
    char words[1024], error[VOLUME_TEXT];
    ASSERT(two_balls(&v) && save(&v, in_folder("seeds.nii"))); /* voxels of 1.5 mm */
    for (int both = 0; both < 2; ++both) {
        snprintf(words, sizeof words, "%s --level 50 --seed 16,18,18%s --out %s", in_folder("seeds.nii"), both ? ";43.5,18,18" : "",
                 in_folder("seeds"));
        ASSERT_EQ(0, call(words));
        ASSERT_EQ(1 + both, (int)number_in("seeds/report.json", "label_components"));
        ASSERT(volume_read(in_folder("seeds/labels.nii.gz"), 0, &found, error));
        ASSERT_EQ(1.0f, found.data[voxel_at(&found, 11, 7, 12)]);
        ASSERT_EQ((float)both, found.data[voxel_at(&found, 29, 12, 12)]);
        volume_free(&found);
    }
    volume_free(&v);
    PASS();
}

/* Two balls of one brightness that touch are told apart by seeds alone, on the image's voxels and on coarser ones; with a line where
 * there is no libmaxflow. */
TEST cut_parts_what_is_as_bright(void)
{
    struct volume v, found;
    char words[1024], error[VOLUME_TEXT];
    ASSERT(make(40, 24, 24, 1.5f, &v));
    add_ball(&v, 13, 12, 12, 7, 200.0f);
    add_ball(&v, 26, 12, 12, 7, 200.0f);
    ASSERT(save(&v, in_folder("pair.nii")));
    for (int outside = 0; outside < 2; ++outside) {
        snprintf(words, sizeof words, "%s --cut --seed 19.5,18,18 %s --no-pictures --out %s", in_folder("pair.nii"),
                 outside ? "--outside-seed 39,18,18" : "", in_folder("cut"));
        ASSERT_EQ(max_flow_is_there() ? 0 : 2, call(words));
        if (!max_flow_is_there()) continue;
        ASSERT(volume_read(in_folder("cut/labels.nii.gz"), 0, &found, error));
        ASSERT_EQ(1.0f, found.data[voxel_at(&found, 8, 12, 12)]);
        ASSERT_EQ(1.0f - (float)outside, found.data[voxel_at(&found, 30, 12, 12)]);
        ASSERT_EQ(0.0f, found.data[voxel_at(&found, 13, 2, 12)]);
        ASSERT_IN_RANGE(outside ? 4.85 : 9.7, number_in("cut/report.json", "volume_ml"), outside ? 0.5 : 1.0); /* 4/3 pi 7^3 voxels each */
        ASSERT_IN_RANGE(0.75, number_in("cut/report.json", "stay_mm"), 1e-6);
        volume_free(&found);
    }
    const int there = max_flow_is_there();
    snprintf(words, sizeof words, "%s --cut --seed 19.5,18,18 --region 0 --no-pictures --out %s", in_folder("pair.nii"), in_folder("cut"));
    ASSERT_EQ(there ? 0 : 2, call(words));
    if (there) {
        ASSERT_EQ(0.0, number_in("cut/report.json", "region"));
        ASSERT_EQ(1.0, number_in("cut/report.json", "pressure"));
    }
    static const char *const refused[] = {"2--window 50,150;150,250", "1--outside-seed 19.6,18,18", "1--radius 500"};
    for (size_t r = 0; r < sizeof refused / sizeof *refused; ++r) {
        snprintf(words, sizeof words, "%s --cut --seed 19.5,18,18 %s", in_folder("pair.nii"), refused[r] + 1);
        ASSERT_EQ(there ? refused[r][0] - '0' : 2, call(words));
    }
    struct volume large = v; /* more voxels than a cut may have, by its sizes alone */
    large.dims[0] *= 400;
    ASSERT_IN_RANGE(1.5f * cbrtf(400.0f * 40.0f * 24.0f * 24.0f / 4e6f), segment_cut_side(&large), 1e-4f);
    ASSERT_IN_RANGE(1.5f, segment_cut_side(&v), 1e-5f);
    volume_free(&v);
    PASS();
}

/* A contour that lets go of its seed, beside a ball, or ends with what was around its start, is no success. */
TEST results_agree_with_their_start(void)
{
    struct segment run;
    char words[1024];
    memset(&run, 0, sizeof run);
    ASSERT(two_balls(&run.image) && save(&run.image, in_folder("start.nii")));
    const char *file = in_folder("start.nii");
    snprintf(words, sizeof words, "%s --level 50 --seed 29,18,18 --radius 5 --steps 40 --out %s --no-pictures", file, in_folder("start"));
    ASSERT_EQ(1, call(words));
    ASSERT(number_in("start/report.json", "volume_ml") > 3.0); /* it is there all the same */
    ASSERT(text_in("start/report.json", "\"trusted\": false"));
    snprintf(words, sizeof words, "%s --pressure 0 --region 1 --center 16,18,18 --radius 7 --steps 20 --json %s", file,
             in_folder("start.json"));
    ASSERT_EQ(0, call(words));
    ASSERT_IN_RANGE(100.0, number_in("start.json", "start_intensity"), 15.0);
    ASSERT(text_in("start.json", "\"trusted\": true"));
    run.voxels = volume_voxels(&run.image);
    run.inside = malloc(run.voxels);
    run.result = run.results;
    run.settings.image = file;
    ASSERT(run.inside);
    for (int bright = 0; bright < 2; ++bright) {
        for (size_t n = 0; n < run.voxels; ++n) run.inside[n] = (run.image.data[n] > 50.0f) == bright;
        run.result->start_mean = 90.0;
        ASSERT_EQ(bright == 1, segment_agrees_with_start(&run));
        run.result->start_mean = (double)NAN; /* without a region force */
        ASSERT(segment_agrees_with_start(&run));
    }
    free(run.inside);
    volume_free(&run.image);
    PASS();
}

TEST share_of_the_image_is_reported(void)
{
    struct volume v;
    char words[1024];
    ASSERT(two_balls(&v) && save(&v, in_folder("share.nii")));
    snprintf(words, sizeof words, "%s --dark --level 50 --init threshold --json %s", in_folder("share.nii"),
             in_folder("share.json"));
    ASSERT_EQ(0, call(words));
    ASSERT_IN_RANGE(1.0 - 2300.0 / (40.0 * 24.0 * 24.0), number_in("share.json", "image_share"), 0.02);
    volume_free(&v);
    PASS();
}

/* A picture that cannot be written ends the program as failed, and costs nothing else. */
TEST a_picture_may_fail(void)
{
    struct volume v, found;
    char words[1024], error[VOLUME_TEXT];
    ASSERT(two_balls(&v) && save(&v, in_folder("picture.nii")));
    ASSERT_EQ(0, mkdir(in_folder("picture"), 0777));
    ASSERT_EQ(0, symlink("no_folder/film.png", in_folder("picture/film.png")));
    snprintf(words, sizeof words, "%s --level 50 --init threshold --steps 1 --out %s", in_folder("picture.nii"), in_folder("picture"));
    ASSERT_EQ(1, call(words));
    ASSERT(volume_read(in_folder("picture/labels.nii.gz"), 0, &found, error));
    ASSERT_EQ(2, (int)number_in("picture/report.json", "label_components"));
    volume_free(&found);
    volume_free(&v);
    PASS();
}

/* Saves the image with slices that are `factor` times as thick. */
static bool save_stretched(const struct volume *v, double factor, const char *path)
{
    struct volume thick = *v;
    for (int r = 0; r < 3; ++r) thick.affine[r][2] *= factor;
    thick.spacing[2] *= (float)factor;
    return save(&thick, path);
}

/* A warning on stderr, also with --quiet, and the report have the number of voxels without a value. */
TEST voxels_without_a_value_are_warned_of(void)
{
    static char text[8192];
    struct volume v;
    char words[1024];
    ASSERT(two_balls(&v));
    for (int i = 0; i < 11520; ++i) v.data[2 * i] = NAN;
    ASSERT(save(&v, in_folder("half.nii")));
    snprintf(words, sizeof words, "%s --level 50 --init threshold --steps 1 --json %s", in_folder("half.nii"),
             in_folder("half.json"));
    ASSERT_EQ(0, call_with_errors(words));
    for (int f = 0; f < 2; ++f) {
        FILE *file = fopen(in_folder(f == 0 ? "stderr.txt" : "half.json"), "r");
        ASSERT(file);
        text[fread(text, 1, sizeof text - 1, file)] = '\0';
        fclose(file);
        ASSERTm(text, strstr(text, f == 0 ? "segment: warning: 11520 of 23040 voxels are NaN or infinite"
                                          : "\"image_warning\": \"11520 of 23040 voxels are NaN or infinite"));
    }
    volume_free(&v);
    PASS();
}

/* What --series says is passed on to what reads the image, of which a file has none. */
TEST series_is_for_folders(void)
{
    struct volume v;
    char words[1024];
    ASSERT(two_balls(&v) && save(&v, in_folder("two.nii")));
    volume_free(&v);
    snprintf(words, sizeof words, "%s --level 50 --series 3", in_folder("two.nii"));
    ASSERT_EQ(1, call_with_errors(words));
    ASSERT(text_in("stderr.txt", "--series is for folders of DICOM files"));
    PASS();
}

TEST wrong_words_and_bad_images_are_refused(void)
{
    static const char *const usage[] = {
        "--window 5,3",
        "--window 1,2;",
        "--window 1,2;3",
        "--label 1",
        "--mirror",
        "--mask-label 3",
        "--pressure 0",
        "--window 1,2;3,4 --init mask --mask m --mask-label 1;2;3",
        "--init mask",
        "--region-means all",
        "--gvf-halvings 9",
        "--edge 2",
        "--pressure 1e38",
        "--region 1e38",
        "--gvf 1e38",
        "--curvature 1e38",
        "--compare-level-set --topology preserved",
        "--seed 1,2",
        "--cut",
        "--seed 1,2,3 --outside-seed 4,5,6",
        "--cut --seed 1,2,3 --outside-seed 4,5",
        "--seed 1,2,3; --init cube",
        "--seed 1,2,3 --init cube",
        "--seed 1,2,3 --center 1,2,3",
        "--init threshold --radius 3",
        "--init threshold --center 1,2,3",
        "--region-means image",
        "--gvf-halvings 0",
        "--mask m",
        "--init cube --init-mesh m",
        "--window 1,2 --dark",
        "--window 1,2 --level 1",
        "--no-pictures",
        "--init mask --mask m --mask-label 1;2;3;4;5;6;7;8;9;1;2;3;4;5;6;7;8;9;1;2;3;4;5;6;7;8;9;1;2;3;4;5;6",
        "--window 1,2;3,4 --reference r --label 5"};
    struct volume v;
    char words[1024];
    ASSERT(two_balls(&v) && save(&v, in_folder("two.nii")));
    ASSERT(save_stretched(&v, 200.0, in_folder("two.nii.flat")));
    fflush(stderr);
    const int kept = dup(2);
    ASSERT(kept >= 0 && freopen(in_folder("stderr.txt"), "w", stderr) != NULL);
    int lines = 0, wrong = 0, calls = 0;
    for (size_t u = 0; u < sizeof usage / sizeof *usage; ++u, ++calls) {
        snprintf(words, sizeof words, "%s %s", in_folder("two.nii"), usage[u]);
        wrong += call(words) != 2;
    }
    static const char *const failing[] = {" --level 900", " --mask nothing.mha --init mask", ".none", " --level 50 --frame 3x",
                                          " --level 50 --init sphere --radius 2 --levels 1 --center 0,0,0",
                                          " --level 50 --radius 0.5 --levels 1", " --level 50 --seed 1,2,300",
                                          " --level 50 --seed 1,2,30", " --level 50 --frame 3",
                                          " --level 50 --json /nothing/there.json", " --level 50 --out /dev/null",
                                          ".flat --level 50"};
    for (size_t u = 0; u < sizeof failing / sizeof *failing; ++u, ++calls) {
        snprintf(words, sizeof words, "%s%s", in_folder("two.nii"), failing[u]);
        wrong += call(words) != (strstr(failing[u], "3x") ? 2 : 1);
    }
    fflush(stderr);
    dup2(kept, 2);
    close(kept);
    FILE *f = fopen(in_folder("stderr.txt"), "r");
    ASSERT(f);
    for (int c = fgetc(f); c != EOF; c = fgetc(f)) lines += c == '\n';
    fclose(f);
    ASSERT_EQ(0, wrong);
    ASSERT_EQ(calls, lines); /* one clear line each */
    volume_free(&v);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!mkdtemp(folder)) return 1;
    RUN_TEST(flow_leads_to_edges_from_afar);
    RUN_TEST(flow_of_a_constant_image_is_zero);
    RUN_TEST(forces_add_up_as_written);
    RUN_TEST(mirror_is_found);
    RUN_TEST(level_set_alone_grows_shrinks_and_rests);
    RUN_TEST(level_set_alone_shrinks_by_curvature);
    RUN_TEST(labels_of_32_bits_are_written_without_pictures);
    RUN_TEST(two_windows_make_one_map_in_the_format_of_the_input);
    RUN_TEST(every_start_and_every_force_find_the_ball);
    RUN_TEST(mirrored_mask_finds_the_other_side);
    RUN_TEST(grid_is_the_images_own);
    RUN_TEST(islands_are_kept_or_removed);
    RUN_TEST(seeds_grow_into_their_parts);
    RUN_TEST(cut_parts_what_is_as_bright);
    RUN_TEST(results_agree_with_their_start);
    RUN_TEST(share_of_the_image_is_reported);
    RUN_TEST(a_picture_may_fail);
    RUN_TEST(voxels_without_a_value_are_warned_of);
    RUN_TEST(series_is_for_folders);
    RUN_TEST(wrong_words_and_bad_images_are_refused);
    char command[300];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0) return 1;
    GREATEST_MAIN_END();
}

#endif
