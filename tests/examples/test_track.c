/* examples/track4d.c from the command line to its report: a made motion followed exactly and by registration, steps of any
 * size, two files on grids of their own, fields of files, wrong usage; and the beating heart of SPRINGLS_DATA, where that is
 * set. Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_track_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_track_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

/* The program, whose inner functions are called here. */
#define main track4d_main
#include "../../examples/track4d/track4d.c"
#undef main
#include "../../examples/track4d/input.c"
#include "../../examples/track4d/motion.c"
#include "../../examples/track4d/output.c"
#include "../../examples/track4d/run.c"
#define compare compare_step
#include "../../examples/track4d/steps.c"
#undef compare

#include <sys/stat.h>
#include <unistd.h>

#include "scratch.h"

static struct volume image;  /* a ball with a texture, and its label: image.nii, label.nii */
static float center[3];

static void describe(const struct volume *grid, const float about[3], float radius, float *intensity, uint8_t *label)
{
    for (size_t n = 0; n < volume_voxels(grid); ++n) {
        const size_t row = (size_t)grid->dims[0], slice = row * (size_t)grid->dims[1];
        const float index[3] = {(float)(n % row), (float)(n % slice / row), (float)(n / slice)};
        float x[3], r[3];
        volume_index_to_world(grid, index, x);
        vec3_sub(x, about, r);
        const float scale = 8.0f / radius; /* the texture grows with the ball */
        const float wave = sinf(0.9f * scale * r[0] + 0.5f) * cosf(0.8f * scale * r[1]) * cosf(0.85f * scale * r[2] + 0.3f);
        intensity[n] = 1000.0f / (1.0f + expf(1.5f * (vec3_length(r) - radius))) * (1.0f + 0.35f * wave);
        label[n] = vec3_length(r) < radius ? 3 : 0;
    }
}

static bool write_ball(const char *image_name, const char *label_name, const struct volume *grid, const float about[3],
                       float radius)
{
    char error[VOLUME_TEXT];
    float *intensity = malloc(volume_voxels(grid) * sizeof *intensity);
    uint8_t *label = malloc(volume_voxels(grid));
    describe(grid, about, radius, intensity, label);
    const bool good = volume_write(scratch(image_name), grid, VOLUME_FLOAT32, intensity, error)
                      && volume_write(scratch(label_name), grid, VOLUME_UINT8, label, error);
    free(intensity);
    free(label);
    return good;
}

static bool make_files(void)
{
    const int dims[3] = {30, 30, 28};
    const float spacing[3] = {1.0f, 1.0f, 1.0f}, origin[3] = {-10.0f, 20.0f, 5.0f}, middle[3] = {14.5f, 14.5f, 13.5f};
    if (!volume_create(dims, spacing, origin, &image)) return false;
    image.affine[0][0] = -1.0; /* x runs to the left */
    struct volume turned;
    if (!volume_create_padded(&image, 0, &turned)) return false;
    volume_free(&image);
    image = turned;
    volume_index_to_world(&image, middle, center);
    return write_ball("image.nii", "label.nii", &image, center, 8.0f);
}

/* The program's status; its output goes into files. */
static int run_program(int argc, const char *const *argv)
{
    fflush(stdout);
    fflush(stderr);
    const int keep_error = dup(STDERR_FILENO), keep_output = dup(STDOUT_FILENO);
    char said[2][512]; /* not scratch(): it forgets old names, and argv holds some */
    snprintf(said[0], sizeof said[0], "%s/stderr", folder);
    snprintf(said[1], sizeof said[1], "%s/stdout", folder);
    if (!freopen(said[0], "w", stderr) || !freopen(said[1], "w", stdout)) return -99;
    const int status = track4d_main(argc, (char **)(uintptr_t)argv);
    fflush(stderr);
    fflush(stdout);
    dup2(keep_error, STDERR_FILENO);
    dup2(keep_output, STDOUT_FILENO);
    close(keep_error);
    close(keep_output);
    return status;
}

static size_t read_file(const char *name, char *text, size_t size)
{
    FILE *file = fopen(scratch(name), "rb");
    const size_t length = file ? fread(text, 1, size - 1, file) : 0;
    text[length] = '\0';
    if (file) fclose(file);
    return length;
}

/* The n-th number after "key": in a report; NAN: there is none. */
static double number_in(const char *text, const char *key, int n)
{
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    for (const char *at = text; (at = strstr(at, quoted)) != NULL; at += 1)
        if (n-- == 0) return strtod(at + strlen(quoted), NULL);
    return (double)NAN;
}

/* Reads the numbers of the array "key" in a report, at most room. Returns how many. */
static int array_in(const char *text, const char *key, double *out, int room)
{
    char quoted[64];
    int count = 0;
    snprintf(quoted, sizeof quoted, "\"%s\": [", key);
    const char *at = strstr(text, quoted);
    for (at = at ? at + strlen(quoted) : ""; count < room; ++count) {
        char *end;
        at += strspn(at, ", \n");
        out[count] = strtod(at, &end);
        if (end == at) break;
        at = end;
    }
    return count;
}

/* Did the program end well? Evaluated once by ASSERT. */
#define RUN(...) \
    (run_program((int)(sizeof (const char *[]){__VA_ARGS__} / sizeof(char *)), (const char *const[]){__VA_ARGS__, NULL}) == 0)

/* The made motion's own field: springls follow within a fiftieth of a voxel, half way and back, one to one; the volume falls
 * and comes back. Everything is written. */
TEST true_fields_are_followed_exactly(void)
{
    static char text[65536];
    static const char *const files[] = {"film.png", "volume.png", "particles.png", "modes.png", "report.json", "slices_002.png",
                                        "tracked_002.ply", "surface_002.ply", "mode_1_plus.ply"};
    ASSERT(RUN("track4d", scratch("image.nii"), "--labels", scratch("label.nii"), "--beat", "4", "--true-field", "--json",
                     scratch("true.json"), "--out", scratch("out"), "--quiet"));
    ASSERT(read_file("true.json", text, sizeof text) > 1000);
    const double springls = number_in(text, "springls", 0);
    ASSERT(springls > 800.0);
    ASSERT(number_in(text, "particles_mean_voxels", 0) < 0.02);
    for (int f = 0; f < 4; ++f) {
        ASSERT_EQ(springls, number_in(text, "springls_kept", f));
        ASSERT_EQ(1.0, number_in(text, "components", f));
        ASSERT_EQ(2.0, number_in(text, "euler", f));
        ASSERT(number_in(text, "off_surface", f) < 0.01);
        ASSERT(number_in(text, "dice", f) > 0.9);
    }
    const double start = number_in(text, "volume_ml", 0), least = number_in(text, "volume_ml", 2);
    ASSERT_IN_RANGE(4.0 / 3.0 * 3.14159265 * 0.512, start, 0.03 * start);
    ASSERT(least < 0.5 * start);
    ASSERT_IN_RANGE(number_in(text, "volume_ml", 1), number_in(text, "volume_ml", 3), 1e-3);
    double share[8], all = 0.0;
    const int modes = array_in(text, "variance_of_modes", share, 8);
    ASSERT(modes > 0 && modes < 4); /* of four frames about their mean */
    for (int m = 0; m < modes; ++m) {
        ASSERT(share[m] >= 0.0 && (m == 0 || share[m] <= share[m - 1]));
        all += share[m];
    }
    ASSERT(share[0] > 0.99); /* out and back along one line */
    ASSERT_IN_RANGE(1.0, all, 1e-5);
    for (size_t i = 0; i < sizeof files / sizeof *files; ++i) {
        char name[64];
        struct stat info;
        snprintf(name, sizeof name, "out/%s", files[i]);
        ASSERTm(name, stat(scratch(name), &info) == 0 && info.st_size > 500);
    }
    PASS();
}

/* The mesh that is written has the same triangles in every frame, and its vertices are where the motion takes them. */
TEST written_meshes_keep_their_identity(void)
{
    struct mesh start, there;
    char error[MESH_TEXT];
    ASSERTm(error, mesh_read(scratch("out/tracked_000.ply"), &start, error));
    ASSERTm(error, mesh_read(scratch("out/tracked_002.ply"), &there, error));
    ASSERT_EQ(start.vertex_count, there.vertex_count);
    ASSERT_EQ(start.triangle_count, there.triangle_count);
    ASSERT_EQ(0, memcmp(start.indices, there.indices, 3 * start.triangle_count * sizeof *start.indices));
    double sum[3] = {0.0, 0.0, 0.0}, square = 0.0, number = 0.0, worst = 0.0; /* the label's voxels say what the beat is */
    for (size_t n = 0; n < volume_voxels(&image); ++n) {
        const size_t row = (size_t)image.dims[0], slice = row * (size_t)image.dims[1];
        const float index[3] = {(float)(n % row), (float)(n % slice / row), (float)(n / slice)};
        float x[3], r[3];
        volume_index_to_world(&image, index, x);
        vec3_sub(x, center, r);
        if (vec3_length(r) < 8.0f) {
            for (int a = 0; a < 3; ++a) sum[a] += (double)x[a];
            square += (double)vec3_dot(r, r);
            number += 1.0;
        }
    }
    for (int a = 0; a < 3; ++a) sum[a] /= number;
    const struct beat beat = beat_of(sum, sqrt(square / number));
    const struct beat_time t = {&beat, 1.0};
    for (size_t n = 0; n < start.vertex_count; ++n) {
        float exact[3];
        beat_map(&t, start.positions + 3 * n, 1, exact);
        vec3_sub(exact, there.positions + 3 * n, exact);
        worst = fmax(worst, (double)vec3_length(exact));
    }
    ASSERT(worst < 0.1);
    mesh_free(&start);
    mesh_free(&there);
    PASS();
}

/* The same without knowing the motion: with noise in every frame, the registered field is right within a quarter of a voxel. */
TEST registered_motion_is_followed(void)
{
    static char text[65536];
    ASSERT(RUN("track4d", scratch("image.nii"), "--labels", scratch("label.nii"), "--beat", "4", "--json", scratch("reg.json"),
                     "--quiet"));
    ASSERT(read_file("reg.json", text, sizeof text) > 1000);
    ASSERT(number_in(text, "particles_mean_voxels", 0) < 0.25);
    for (int f = 0; f < 4; ++f) ASSERT_EQ(number_in(text, "springls", 0), number_in(text, "springls_kept", f));
    /* In five steps each: exp(v/5) five times is exp(v). */
    static char steps[65536];
    ASSERT(RUN("track4d", scratch("image.nii"), "--labels", scratch("label.nii"), "--beat", "4", "--steps", "5", "--json",
                     scratch("steps.json"), "--quiet"));
    ASSERT(read_file("steps.json", steps, sizeof steps) > 1000);
    for (int f = 0; f < 4; ++f) {
        const double volume = number_in(text, "volume_ml", f);
        ASSERT_IN_RANGE(volume, number_in(steps, "volume_ml", f), 0.02 * volume);
    }
    PASS();
}

/* Algorithm 3 has no CFL limit: one step of some voxels is as good as twenty. A level set alone needs short steps and loses to
 * springls at any. */
TEST steps_may_be_large(void)
{
    static char text[65536];
    ASSERT(RUN("track4d", scratch("image.nii"), "--labels", scratch("label.nii"), "--beat", "4", "--true-field", "--large-steps",
                     "--json", scratch("large.json"), "--out", scratch("out"), "--quiet"));
    ASSERT(read_file("large.json", text, sizeof text) > 1000);
    const double one = number_in(text, "surface_mean_voxels", 0), twenty = number_in(text, "surface_mean_voxels", 9);
    ASSERT(number_in(text, "longest_step_voxels", 0) > 2.0);
    ASSERT_EQ(20.0, number_in(text, "steps", 9));
    ASSERT(one < 0.1);
    ASSERT_IN_RANGE(twenty, one, 0.02);
    for (int i = 0; i < 4; ++i) {
        const double springls = number_in(text, "surface_mean_voxels", 3 * i);
        const double lagrangian = number_in(text, "surface_mean_voxels", 3 * i + 1);
        const double upwind_error = number_in(text, "surface_mean_voxels", 3 * i + 2);
        ASSERT(number_in(text, "tracking_mean_voxels", 3 * i) < 0.02);
        ASSERT(springls < lagrangian); /* "gone" is null, which strtod reads as 0: none may be gone here */
        ASSERT(springls < upwind_error);
    }
    PASS();
}

/* Two files, on grids that lie elsewhere: the second ball is larger and moved by more than its radius. */
TEST two_files_are_two_frames(void)
{
    static char text[65536];
    const int dims[3] = {32, 28, 30};
    const float spacing[3] = {1.2f, 1.1f, 1.3f}, moved[3] = {center[0] + 9.0f, center[1] - 4.0f, center[2] + 2.0f};
    float origin[3] = {moved[0] - 18.0f, moved[1] - 15.0f, moved[2] - 20.0f};
    struct volume second;
    ASSERT(volume_create(dims, spacing, origin, &second));
    ASSERT(write_ball("second.nii", "second_label.nii", &second, moved, 9.0f));
    volume_free(&second);
    ASSERT(RUN("track4d", scratch("image.nii"), scratch("second.nii"), "--labels", scratch("label.nii"), "--second-labels",
                     scratch("second_label.nii"), "--json", scratch("two.json"), "--quiet"));
    ASSERT(read_file("two.json", text, sizeof text) > 500);
    ASSERT(number_in(text, "dice", 1) > 0.93);
    ASSERT_IN_RANGE(729.0 / 512.0, number_in(text, "volume_ml", 1) / number_in(text, "volume_ml", 0), 0.08);
    ASSERT_EQ(number_in(text, "springls", 0), number_in(text, "springls_kept", 1));
    PASS();
}

/* A header that places the second image elsewhere does not matter, unless no grid can cover both; a flat image is refused. */
TEST second_files_are_where_they_are(void)
{
    static const float shifts[] = {80.0f, 4000.0f, 0.0f};
    static const char *const reasons[] = {NULL, "too far from each other", "is flat"};
    static char text[65536];
    const float spacing[3] = {1.2f, 1.1f, 1.3f};
    for (int c = 0; c < 3; ++c) {
        const int dims[3] = {32, 28, c < 2 ? 30 : 1};
        const float moved[3] = {center[0] + shifts[c], center[1] - shifts[c], center[2] + shifts[c]};
        float origin[3] = {moved[0] - 18.0f, moved[1] - 15.0f, moved[2] - (c < 2 ? 20.0f : 0.0f)};
        struct volume second;
        ASSERT(volume_create(dims, spacing, origin, &second));
        ASSERT(write_ball("far.nii", "far_label.nii", &second, moved, 9.0f));
        volume_free(&second);
        const char *const words[] = {"track4d", scratch("image.nii"), scratch("far.nii"), "--labels", scratch("label.nii"),
                                     "--json", scratch("far.json"), "--quiet", NULL};
        ASSERT_EQ(reasons[c] ? 1 : 0, run_program(8, words));
        if (reasons[c]) {
            ASSERT(read_file("stderr", text, sizeof text) > 10);
            ASSERT(strstr(text, reasons[c]));
        }
    }
    ASSERT(read_file("far.json", text, sizeof text) > 500);
    ASSERT_IN_RANGE(729.0 / 512.0, number_in(text, "volume_ml", 1) / number_in(text, "volume_ml", 0), 0.08);
    PASS();
}

/* Voxels that are not numbers are replaced; a warning and the report count them, in the reference too. */
TEST replaced_voxels_are_warned_of(void)
{
    static char text[65536];
    char error[VOLUME_TEXT];
    struct volume broken;
    ASSERT(volume_read(scratch("image.nii"), 0, &broken, error));
    broken.data[5] = NAN;
    ASSERT(volume_write(scratch("broken.nii"), &broken, VOLUME_FLOAT32, broken.data, error));
    volume_free(&broken);
    const char *const words[] = {"track4d", scratch("broken.nii"), scratch("image.nii"), "--labels", scratch("label.nii"),
                                 "--quiet", "--json", scratch("broken.json"), NULL};
    ASSERT_EQ(0, run_program(8, words));
    ASSERT(read_file("stderr", text, sizeof text) > 10);
    ASSERT(strstr(text, "track4d: warning: frame 0: 1 of 25200 voxels are NaN or infinite"));
    ASSERT(read_file("broken.json", text, sizeof text) > 10);
    ASSERT(strstr(text, "\"image_warning\": \"1 of 25200 voxels are NaN or infinite"));
    PASS();
}

/* A ball of which the image's border cuts off half: the half that is there is the body. */
TEST cut_bodies_end_at_the_border(void)
{
    static char text[65536];
    char error[VOLUME_TEXT];
    uint8_t *label = calloc(volume_voxels(&image), 1);
    ASSERT(label);
    for (int n = 0; n < (int)volume_voxels(&image); ++n) {
        const int x = n % image.dims[0], y = n / image.dims[0] % image.dims[1] - image.dims[1] / 2;
        const int z = n / image.dims[0] / image.dims[1] - image.dims[2] / 2;
        label[n] = x * x + y * y + z * z < 64;
    }
    ASSERT(volume_write(scratch("cut.nii"), &image, VOLUME_UINT8, label, error));
    free(label);
    const char *const words[] = {"track4d", scratch("image.nii"), scratch("image.nii"), "--labels", scratch("cut.nii"),
                                 "--quiet", "--json", scratch("cut.json"), NULL};
    ASSERT_EQ(0, run_program(8, words));
    ASSERT(read_file("cut.json", text, sizeof text) > 10);
    const char *const volume = strstr(text, "\"volume_ml\": "), *const of_label = strstr(text, "\"label_ml\": ");
    ASSERT(volume && of_label);
    const double labelled = atof(of_label + strlen("\"label_ml\": "));
    ASSERT(labelled > 0.0);
    ASSERT_IN_RANGE(labelled, atof(volume + strlen("\"volume_ml\": ")), 0.1 * labelled);
    PASS();
}

/* Makes a sequence of `frames` images in a file: one tall volume whose header is changed. later: value of the last frame. */
static bool write_sequence(const char *path, int frames, float later)
{
    char error[VOLUME_TEXT];
    struct volume tall;
    const int dims[3] = {image.dims[0], image.dims[1], frames * image.dims[2]};
    const short header[5] = {4, (short)image.dims[0], (short)image.dims[1], (short)image.dims[2], (short)frames};
    const size_t one = volume_voxels(&image);
    if (!volume_create(dims, image.spacing, image.origin, &tall)) return false;
    for (size_t n = 0; n < volume_voxels(&tall); ++n) {
        tall.data[n] = n < one * (size_t)(frames - 1) ? (float)(n % one % 7) : later;
    }
    bool good = volume_write(path, &tall, VOLUME_FLOAT32, tall.data, error);
    volume_free(&tall);
    FILE *file = good ? fopen(path, "r+b") : NULL;
    good = file && fseek(file, 40, SEEK_SET) == 0 && fwrite(header, sizeof *header, 5, file) == 5;
    return file && fclose(file) == 0 && good;
}

/* What is wrong with a later frame is found before the work on the first one. */
TEST all_frames_are_checked_first(void)
{
    static char text[4096];
    char sequence[512], moving[512], missing[512];
    struct volume straight;
    uint8_t *label = calloc(volume_voxels(&image), 1);
    char error[VOLUME_TEXT];
    snprintf(sequence, sizeof sequence, "%s", scratch("sequence.nii"));
    snprintf(moving, sizeof moving, "%s", scratch("straight.nii"));
    snprintf(missing, sizeof missing, "%s", scratch("no_%d.nii"));
    ASSERT(label && volume_create(image.dims, image.spacing, image.origin, &straight));
    for (size_t n = 9000; n < 9010; ++n) label[n] = 1;
    ASSERT(volume_write(moving, &straight, VOLUME_UINT8, label, error));
    volume_free(&straight);
    free(label);
    const struct {
        float later;
        bool cut;
        const char *fields, *reason;
    } cases[] = {{NAN, false, NULL, "frame 2: "}, {5.0f, false, NULL, "sequence.nii: frame 2: all voxels are equal"},
                 {5.0f, true, NULL, "frame 2: "}, {5.0f, false, missing, "no_1.nii: "}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        const char *const words[] = {"track4d", sequence, "--labels", moving, "--out", scratch("checked"),
                                     cases[i].fields ? "--fields" : "--quiet", cases[i].fields, NULL};
        ASSERT(write_sequence(sequence, 3, cases[i].later));
        ASSERT(!cases[i].cut || truncate(sequence, 290000) == 0);
        ASSERT_EQ(1, run_program(cases[i].fields ? 8 : 7, words));
        const size_t length = read_file("stderr", text, sizeof text);
        ASSERTm(text, strncmp(text, "track4d: ", 9) == 0 && strstr(text, cases[i].reason));
        ASSERT(strchr(text, '\n') == text + length - 1);
        ASSERT(access(scratch("checked/tracked_000.ply"), F_OK) != 0);
    }
    PASS();
}

TEST wrong_usage_and_bad_files_end_in_one_line(void)
{
    char text[4096], image_file[512], labels[512], second[512], single[512], error[VOLUME_TEXT];
    snprintf(image_file, sizeof image_file, "%s", scratch("image.nii"));
    snprintf(labels, sizeof labels, "%s", scratch("label.nii"));
    snprintf(second, sizeof second, "%s", scratch("second_label.nii"));
    snprintf(single, sizeof single, "%s", scratch("single.nii"));
    uint8_t *label = calloc(volume_voxels(&image), 1);
    ASSERT(label);
    label[5000] = 1;
    ASSERT(volume_write(single, &image, VOLUME_UINT8, label, error));
    free(label);
    const struct {
        int status;
        const char *const argv[9];
    } cases[] = {
        {2, {"track4d", image_file}},
        {2, {"track4d", image_file, "--labels", labels, "--fields", "no_frame.nii"}},
        {2, {"track4d", image_file, "--labels", labels, "--fields", "%d%s.nii"}},
        {2, {"track4d", image_file, "--labels", labels, "--true-field"}},
        {2, {"track4d", image_file, "--labels", labels, "--beat", "4", "--reference", "1"}},
        {2, {"track4d", image_file, image_file, "--labels", labels, "--large-steps"}},
        {2, {"track4d", image_file, image_file, "--labels", labels, "--landmarks", "marks.csv"}},
        {2, {"track4d", image_file, "--labels", labels, "--frame", "1"}},
        {2, {"track4d", image_file, "--labels", labels, "--fields", "to_%d.nii", "--similarity", "lcc"}},
        {2, {"track4d", image_file, "--labels", labels, "--true-field", "--beat=4", "--similarity", "lcc"}},
        {2, {"track4d", image_file, "--labels", labels, "--beat=4", "--large-steps", "--steps", "5"}},
        {2, {"track4d", image_file, "--labels", labels, "--second-labels", labels}},
        {2, {"track4d", image_file, "--labels", labels, "--beat", "4", "--json", image_file}},
        {1, {"track4d", image_file, "--labels", labels}}, /* one frame */
        {1, {"track4d", "/nothing/there.nii", "--labels", labels, "--beat", "4"}},
        {1, {"track4d", image_file, "--labels", labels, "--label", "9", "--beat", "4"}},
        {1, {"track4d", image_file, "--labels", image_file, "--beat", "4"}}, /* a scan for labels */
        {1, {"track4d", image_file, "--labels", labels, "--beat", "4", "--frame", "7", "--large-steps"}},
        {1, {"track4d", image_file, "--labels", "/nothing/there.nii", "--beat", "4"}},
        {1, {"track4d", image_file, "--labels", labels, "--beat", "4", "--json", "/nothing/there.json"}},
        {1, {"track4d", image_file, "--labels", single, "--beat", "4", "--true-field"}},
        {1, {"track4d", image_file, "--labels", second, "--beat", "4"}}, /* another grid */
        {1, {"track4d", image_file, second, "--labels", second}},
        {1, {"track4d", image_file, second, "--labels", labels, "--second-labels", labels}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        int argc = 0;
        while (argc < 9 && cases[i].argv[argc]) ++argc;
        const int status = run_program(argc, cases[i].argv);
        ASSERT_EQ(cases[i].status, status);
        const size_t length = read_file("stderr", text, sizeof text);
        ASSERT(length > 10 && strncmp(text, "track4d: ", 9) == 0);
        ASSERT(strchr(text, '\n') == text + length - 1);
        ASSERT_EQ(i >= sizeof cases / sizeof *cases - 3, strstr(text, ": not on the grid of its image") != NULL);
    }
    PASS();
}

/* The beating heart, half of its frames' worth of motion: landmarks carried by springls, labels, identities. And the field of
 * a file, in the convention of ITK, gives the same as the registration that it was made from. */
TEST beating_heart_is_tracked(void)
{
    const char *data = getenv("SPRINGLS_DATA");
    static char names[3][1024], error[VOLUME_TEXT];
    struct track track = {.settings = {.label = -1, .steps = 1, .frame = -1}};
    struct track_motion motion, read;
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    for (int i = 0; i < 3; ++i) {
        static const char *const ends[3] = {".nii.gz", "_label.nii.gz", "_landmarks.csv"};
        snprintf(names[i], sizeof names[i], "%s/4d/ct4d_synthbeat_A%s", data, ends[i]);
    }
    track.settings.common = cli_common_defaults();
    track.settings.common.quiet = true;
    track.settings.image = names[0];
    track.settings.labels = names[1];
    track.settings.landmarks = names[2];
    track.registration = register_defaults();
    track.registration.align = REGISTER_ALIGN_NONE;
    track.registration.one_scale = true;
    ASSERT_EQ(CLI_CONTINUE, run_options("track4d", &track.settings.common, TRACKING_PARAMETERS, &track.params));
    ASSERT(track_read(&track));
    ASSERT_EQ(150u, track.landmark_count);
    ASSERT(track_motion_make(&track, 5, 1, NULL, &motion));
    ASSERT(do_frame(&track, 5, &motion));
    const struct track_frame registered = track.frames[5];
    const double voxel = (double)track.grid.spacing[0];
    ASSERT(registered.landmarks_before.mean > 4.0 * voxel);
    ASSERT(registered.landmarks.mean < 0.25 * voxel);
    ASSERT(registered.field_landmarks.mean < 0.25 * voxel);
    ASSERT_EQ(track.mesh.triangle_count, registered.kept);
    ASSERT(registered.dice > 0.95);
    ASSERT(registered.jacobian_min > 0.1);
    ASSERT_IN_RANGE(registered.label_ml, registered.volume_ml, 0.03 * registered.label_ml);
    ASSERT(field_write(scratch("to_5.nii"), &motion.forward, error));
    track.settings.fields = scratch("to_%d.nii");
    ASSERT(track_motion_make(&track, 5, 1, NULL, &read));
    memset(&track.frames[5], 0, sizeof *track.frames);
    ASSERT(do_frame(&track, 5, &read));
    ASSERT_IN_RANGE(registered.landmarks.mean, track.frames[5].landmarks.mean, 1e-3);
    ASSERT_IN_RANGE(registered.dice, track.frames[5].dice, 1e-3);
    free(registered.vertices);
    track_motion_free(&read);
    track_motion_free(&motion);
    track_free(&track);
    PASS();
}

int main(int argc, char **argv)
{
    const char *temporary = getenv("TMPDIR");
    char command[600];
    GREATEST_MAIN_BEGIN();
    snprintf(folder, sizeof folder, "%s/springls_test_XXXXXX", temporary && *temporary ? temporary : "/tmp");
    if (!mkdtemp(folder) || !make_files()) {
        perror(folder);
        return 1;
    }
    RUN_TEST(true_fields_are_followed_exactly);
    RUN_TEST(written_meshes_keep_their_identity);
    RUN_TEST(registered_motion_is_followed);
    RUN_TEST(steps_may_be_large);
    RUN_TEST(two_files_are_two_frames);
    RUN_TEST(second_files_are_where_they_are);
    RUN_TEST(replaced_voxels_are_warned_of);
    RUN_TEST(cut_bodies_end_at_the_border);
    RUN_TEST(all_frames_are_checked_first);
    RUN_TEST(wrong_usage_and_bad_files_end_in_one_line);
    RUN_TEST(beating_heart_is_tracked);
    volume_free(&image);
    snprintf(command, sizeof command, "rm -rf %s", folder);
    if (system(command) != 0) perror(folder);
    GREATEST_MAIN_END();
}

#endif
