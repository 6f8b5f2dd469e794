/* The pieces that the example programs share: examples/common.
 *
 * They need libraries that springls.h does not (PNG, NIfTI, mesh import), so this file tests them only when it is
 * compiled with -DTEST_EXAMPLES_COMMON together with all of examples/common; else it reports itself skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_common_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_common_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "../../examples/common/base/bvh.h"
#include "../../examples/common/base/cli.h"
#include "../../examples/common/base/json.h"
#include "../../examples/common/base/output_file.h"
#include "../../examples/common/base/page.h"
#include "../../examples/common/surface/mesh_io.h"
#include "../../examples/common/surface/scene_files.h"
#include "../../examples/common/surface/surface_distances.h"
#include "../../examples/common/imaging/overlap.h"
#include "../../examples/common/pictures/plot.h"
#include "../../examples/common/base/progress.h"
#include "../../examples/common/pictures/raycast.h"
#include "../../examples/common/pictures/raycast_rows.h"
#include "../../examples/common/imaging/slices.h"
#include "../../examples/common/springls/run_options.h"
#include "../../examples/common/imaging/volume.h"
#include "scratch.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* assimp 5.2 loses memory of its own on some broken PLY files; LeakSanitizer calls this function for what to ignore. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libassimp\n"; }

static float uniform(uint32_t *state) /* 0..1 */
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / 16777216.0f;
}

static size_t read_text(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "rb");
    const size_t length = file ? fread(text, 1, size - 1, file) : 0;
    text[length] = '\0';
    if (file) { fclose(file); }
    return length;
}

/* ---- command line ---- */

struct parsed {
    struct cli_common common;
    double period;
    float center[3];
    float weight;
    const char *input, *mode;
    char error[512]; /* what went to stderr */
};

/* Parses a line of a program; error: receives what went to stderr. */
static int parse_quietly(const struct cli_program *program, int argc, const char *const *argv, char error[512])
{
    fflush(stderr);
    fflush(stdout);
    const int keep_error = dup(STDERR_FILENO), keep_output = dup(STDOUT_FILENO);
    const char *path = scratch("stderr");
    if (!freopen(path, "w", stderr) || !freopen(scratch("stdout"), "w", stdout)) { return -99; }
    const int status = cli_parse(program, argc, (char **)(uintptr_t)argv);
    fflush(stderr);
    fflush(stdout);
    dup2(keep_error, STDERR_FILENO);
    dup2(keep_output, STDOUT_FILENO);
    close(keep_error);
    close(keep_output);
    read_text(scratch("stderr"), error, 512);
    return status;
}

static int parse(struct parsed *p, int argc, const char *const *argv)
{
    memset(p, 0, sizeof *p);
    p->common = cli_common_defaults();
    p->period = 3.0;
    p->mode = "slow";
    const struct cli_option options[] = {
        {"period", CLI_DOUBLE, &p->period, "T", "period", 0.5, 10.0, NULL},
        {"center", CLI_FLOAT3, p->center, "X,Y,Z", "centre", 0.0, 0.0, NULL},
        {"weight", CLI_FLOAT, &p->weight, NULL, "weight", 0.0, 0.0, NULL},
        {"mode", CLI_CHOICE, &p->mode, NULL, "mode", 0.0, 0.0, "slow|fast"},
    };
    const struct cli_positional positionals[] = {{"INPUT", &p->input, "a file", true}};
    const struct cli_rule rules[] = {{.given = "weight", .needs = "mode=st|center"},
                                     {.given = "out=.glb+center"},
                                     {.given = "json+center", .needs = "weight"},
                                     {.given = "INPUT=.mesh+period"},
                                     {.given = "INPUT=.list", .only = "quiet|mode"}};
    const struct cli_program program = {.name = "probe", .summary = "Tests.", .common = &p->common,
                                        .options = options, .option_count = 4, .positionals = positionals, .positional_count = 1,
                                        .without = "threads", .rules = rules, .rule_count = 5};
    return parse_quietly(&program, argc, argv, p->error);
}

TEST cli_reads_every_type(void)
{
    struct parsed p;
    const char *const argv[] = {"probe", "--period=2.5", "--center", "-1,0.5,2e1", "scan.nii", "--grid", "64", "--quiet",
                                "--json", "-", "--mode", "fast", "--weight", "-.5", "--backend", "opencl", NULL};
    ASSERT_EQ(CLI_CONTINUE, parse(&p, 16, argv));
    ASSERT_STR_EQ("opencl", p.common.backend);
    ASSERT_IN_RANGE(2.5, p.period, 0.0);
    ASSERT_IN_RANGE(-1.0f, p.center[0], 0.0f);
    ASSERT_IN_RANGE(20.0f, p.center[2], 0.0f);
    ASSERT_IN_RANGE(-0.5f, p.weight, 0.0f);
    ASSERT_EQ(64, p.common.grid);
    ASSERT(p.common.quiet);
    ASSERT_STR_EQ("-", p.common.json);
    ASSERT_STR_EQ("fast", p.mode);
    ASSERT_STR_EQ("scan.nii", p.input);
    PASS();
}

TEST cli_refuses_in_one_line_with_status_2(void)
{
    static const char *const bad[][3] = {
        {"--period", "fast", "x"}, {"--period", "nan", "x"},   {"--period", "1e999", "x"}, {"--period", "0x10", "x"},
        {"--period", "11", "x"},   {"--period", "", "x"},      {"--period", "2 ", "x"},    {"--grid", "12.5", "x"},
        {"--grid", "-1", "x"},     {"--grid", "99999999999999999999", "x"},                {"--threads", "1", "x"},
        {"--center", "1,2", "x"},  {"--center", "1,2,3,4", "x"}, {"--center", "1,,3", "x"}, {"--mode", "slo", "x"},
        {"--mode", "slow|fast", "x"}, {"--params", "", "x"},   {"--nothing", "1", "x"},    {"--quiet=1", "x", NULL},
        {"-q", "x", NULL},         {"x", "y", NULL},           {"x", "--json", NULL},      {"--quiet", NULL, NULL},
        {"--weight", "1e300", "x"}, {"--backend", "gpu", "x"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        struct parsed p;
        const char *argv[5] = {"probe", bad[i][0], bad[i][1], bad[i][2], NULL};
        int argc = 1;
        while (argv[argc]) { ++argc; }
        ASSERT_EQm(bad[i][0], CLI_EXIT_USAGE, parse(&p, argc, argv));
        const char *end = strchr(p.error, '\n');
        ASSERTm(bad[i][0], strncmp(p.error, "probe: ", 7) == 0 && end && end[1] == '\0');
    }
    PASS();
}

TEST cli_refuses_what_has_no_effect(void)
{
    static const struct {
        const char *const line[8];
        const char *error; /* "": it is good */
    } cases[] = {
        {{"x", "--weight", "1"}, "probe: --weight has no effect without --mode *st or --center\n"},
        {{"x", "--weight", "1", "--mode", "slow"}, "probe: --weight has no effect without --mode *st or --center\n"},
        {{"x", "--weight", "1", "--mode", "fast"}, ""},
        {{"x", "--weight", "1", "--center=1,2,3"}, ""},
        {{"x", "--center", "1,2,3", "--out", "a.glb"}, "probe: --out *.glb has no effect with --center\n"},
        {{"x", "--center", "1,2,3", "--out", "a.glb/"}, ""},
        {{"x", "--center", "1,2,3", "--json", "-"}, "probe: --json has no effect with --center and without --weight\n"},
        {{"--quiet", "--mode", "fast", "a.list"}, ""},
        {{"--period", "3", "a.mesh"}, "probe: .mesh has no effect with --period\n"},
        {{"--quiet", "--grid", "9", "a.list"}, "probe: --grid has no effect with .list\n"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        struct parsed p;
        const char *argv[9] = {"probe"};
        int argc = 1;
        for (; cases[i].line[argc - 1]; ++argc) { argv[argc] = cases[i].line[argc - 1]; }
        ASSERT_EQm(cases[i].error, *cases[i].error ? CLI_EXIT_USAGE : CLI_CONTINUE, parse(&p, argc, argv));
        ASSERT_STR_EQ(cases[i].error, p.error);
    }
    PASS();
}

/* Parses a line with files in the folder of the test: a word "@name" is the file `name` there, "x:@name" has more before it. */
static int parse_files(const char *const *line, char error[512])
{
    static char words[9][600];
    struct cli_common common = cli_common_defaults();
    const char *inputs[4], *mask = NULL, *result = NULL, *picture = NULL, *mode = "slow", *argv[10] = {"probe"};
    int count = 0, argc = 1;
    const struct cli_option options[] = {
        {"mask", CLI_STRING, &mask, "FILE", "mask", 0.0, 0.0, NULL},
        {"mode", CLI_CHOICE, &mode, NULL, "mode", 0.0, 0.0, "slow|fast"},
        {"result", CLI_RESULT, &result, "FILE", "result", 0.0, 0.0, NULL},
        {"picture", CLI_OUTPUT, &picture, "FILE", "picture", 0.0, 0.0, NULL},
    };
    const struct cli_positional positionals[] = {{"INPUT", inputs, "files", true}};
    const struct cli_writes writes[] = {{.files = "labels.*|deep/[0-9]*.ply"},
                                        {.files = "fast.ply", .with = "mode=fast"},
                                        {.files = "alone.ply", .without = "result"}};
    const struct cli_program program = {.name = "probe", .summary = "Tests.", .common = &common, .options = options,
                                        .option_count = 4, .positionals = positionals, .positional_count = 1, .repeated = &count,
                                        .max_repeated = 4, .writes = writes, .writes_count = 3};
    for (; line[argc - 1]; ++argc) {
        const char *word = line[argc - 1], *at = strchr(word, '@');
        snprintf(words[argc - 1], sizeof words[0], at ? "%.*s%s/%s" : "%.*s", at ? (int)(at - word) : (int)strlen(word), word, folder,
                 at ? at + 1 : "");
        argv[argc] = words[argc - 1];
    }
    return parse_quietly(&program, argc, argv, error);
}

TEST cli_refuses_to_overwrite(void)
{
    static const char *const there[] = {"scan.nii", "labels.nii", "deep/1.ply", "deep/one.ply", "fast.ply", "alone.ply"};
    static const struct {
        const char *const line[9];
        const char *error; /* without the folder's name; "": it is good */
    } cases[] = {
        {{"@scan.nii", "--json", "@scan.nii"}, "INPUT @scan.nii would be overwritten by --json\n"},
        {{"@scan.nii", "--json", "@deep/../scan.nii"}, "INPUT @scan.nii would be overwritten by --json\n"},
        {{"@scan.nii", "--json", "@link.nii"}, "INPUT @scan.nii would be overwritten by --json\n"},
        {{"@fast.ply", "mirror:@scan.nii:1+2", "--json", "@scan.nii"}, "INPUT mirror:@scan.nii:1+2 would be overwritten by --json\n"},
        {{"@scan.nii", "--mask", "@labels.nii", "--picture", "@labels.nii"}, "--mask @labels.nii would be overwritten by --picture\n"},
        {{"@scan.nii", "--mask", "@labels.nii", "--result", "@labels.nii"}, ""},
        {{"@scan.nii", "--json", "@new", "--result", "@./new"}, "--json @new would be overwritten by --result\n"},
        {{"@scan.nii", "--json", "-", "--result", "-"}, ""},
        {{"@scan.nii", "--json", "/dev/null", "--result", "/dev/null"}, ""},
        {{"@scan.nii", "--json", "@new", "--result", "@other"}, ""},
        {{"@none.nii", "--json", "@none.nii"}, ""}, /* what is not there cannot be overwritten: reading it fails */
        {{"@scan.nii", "--json", "@folder", "--out", "@folder"}, "--out @folder would be overwritten by --json\n"},
        {{"@scan.nii", "--out", "@"}, ""},
        {{"@scan.nii", "--mask", "@labels.nii", "--out", "@"}, "--mask @labels.nii would be overwritten by --out\n"},
        {{"@scan.nii", "--mask", "@labels.nii", "--out", "@deep"}, ""},
        {{"@scan.nii", "--json", "@deep/labels.json", "--out", "@deep"}, "--json @deep/labels.json would be overwritten by --out\n"},
        {{"@deep/1.ply", "--out", "@"}, "INPUT @deep/1.ply would be overwritten by --out\n"},
        {{"@deep/one.ply", "--out", "@"}, ""},
        {{"@fast.ply", "--out", "@"}, ""},
        {{"@fast.ply", "--out", "@", "--mode", "fast"}, "INPUT @fast.ply would be overwritten by --out\n"},
        {{"@alone.ply", "--out", "@"}, "INPUT @alone.ply would be overwritten by --out\n"},
        {{"@alone.ply", "--out", "@", "--result", "@new"}, ""},
        {{"@scan.nii", "--out", "@linked"}, "INPUT @scan.nii would be overwritten by --out\n"},
        {{"@scan.nii", "--out", "@one[1]"}, "INPUT @scan.nii would be overwritten by --out\n"},
        {{"@linked/labels.nii", "--out", "@"}, ""},
        {{"@to_labels.nii", "--out", "@"}, "INPUT @to_labels.nii would be overwritten by --out\n"},
        {{"@scan.nii", "--out", "@none", "--json", "@./none//labels.json"},
         "--json @./none//labels.json would be overwritten by --out\n"},
        {{"@scan.nii", "--out", "@none", "--json", "@to_none.json"}, "--json @to_none.json would be overwritten by --out\n"},
        {{"@scan.nii", "--out", "@none", "--json", "@no/labels.json"}, ""},
        {{"@scan.nii", "--out", "@taken"}, "@taken/labels.ply: cannot be written: it is a folder\n"},
    };
    ASSERT_EQ(0, mkdir(scratch("deep"), 0777));
    for (size_t f = 0; f < sizeof there / sizeof *there; ++f) {
        FILE *file = fopen(scratch(there[f]), "w");
        ASSERT(file && fclose(file) == 0);
    }
    ASSERT(mkdir(scratch("linked"), 0777) == 0 && mkdir(scratch("taken"), 0777) == 0 && mkdir(scratch("taken/labels.ply"), 0777) == 0);
    ASSERT_EQ(0, symlink("scan.nii", scratch("link.nii")));
    ASSERT_EQ(0, symlink("../scan.nii", scratch("linked/labels.nii")));
    ASSERT(mkdir(scratch("one[1]"), 0777) == 0 && symlink("../scan.nii", scratch("one[1]/labels.nii")) == 0);
    ASSERT_EQ(0, symlink("labels.nii", scratch("to_labels.nii")));
    ASSERT_EQ(0, symlink("none/labels.json", scratch("to_none.json")));
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        char error[512], expected[1200] = "";
        const int status = parse_files(cases[i].line, error);
        const char *at = strchr(cases[i].error, '@');
        if (at) {
            snprintf(expected, sizeof expected, "probe: %.*s%s/%s", (int)(at - cases[i].error), cases[i].error, folder, at + 1);
        }
        ASSERT_STR_EQ(expected, error);
        ASSERT_EQ(at ? CLI_EXIT_USAGE : CLI_CONTINUE, status);
    }
    PASS();
}

TEST cli_help_ends_well_and_names_defaults(void)
{
    struct parsed p;
    char text[4096];
    const char *const argv[] = {"probe", "--period", "bad", "--help", NULL};
    ASSERT_EQ(CLI_EXIT_OK, parse(&p, 4, argv));
    ASSERT_STR_EQ("", p.error);
    read_text(scratch("stdout"), text, sizeof text);
    ASSERT(strstr(text, "usage: probe [options] INPUT") && strstr(text, "--params paper|default") && strstr(text, "[3]"));
    ASSERT(strstr(text, "--backend scalar|opencl") && !strstr(text, "--threads"));
    ASSERT_STR_EQ("scalar", p.common.backend);
    PASS();
}

TEST a_full_disk_is_a_failure(void)
{
    struct parsed p;
    const char *const argv[] = {"probe", "x", NULL};
    int status = 0;
    if (access("/dev/full", W_OK) != 0) SKIPm("there is no /dev/full");
    ASSERT_EQ(CLI_CONTINUE, parse(&p, 2, argv));
    const pid_t program = fork();
    if (program == 0) {
        if (!freopen("/dev/full", "w", stdout) || !freopen(scratch("stderr"), "w", stderr)) _exit(99);
        printf("a table\n");
        exit(0);
    }
    ASSERT_EQ(program, waitpid(program, &status, 0));
    ASSERT(WIFEXITED(status));
    ASSERT_EQ(CLI_EXIT_FAILURE, WEXITSTATUS(status));
    read_text(scratch("stderr"), p.error, sizeof p.error);
    ASSERT(strncmp(p.error, "standard output: ", 17) == 0);
    PASS();
}

/* ---- JSON, progress ---- */

TEST json_is_exact_and_always_valid(void)
{
    struct json_writer json;
    char text[1024];
    const double numbers[] = {1.0, 0.1, -2.5e-20};
    ASSERT(json_open(&json, scratch("a.json")));
    json_object_begin(&json, NULL);
    json_string(&json, "name", "a\"b\\c\n\x01\xff\xc3\xa9");
    json_number(&json, "nan", NAN);
    json_number(&json, "third", 1.0 / 3.0);
    json_integer(&json, "big", INT64_MIN);
    json_bool(&json, "yes", true);
    json_numbers(&json, "list", numbers, 3);
    json_object_begin(&json, "empty");
    json_object_end(&json);
    json_ready(&json, "ready", "[1, {}]\n");
    json_ready(&json, "none", NULL);
    ASSERT(json_close(&json));
    read_text(scratch("a.json"), text, sizeof text);
    ASSERT_STR_EQ("{\n  \"name\": \"a\\\"b\\\\c\\n\\u0001\\ufffd\xc3\xa9\",\n  \"nan\": null,\n  \"third\": 0.333333333,\n"
                  "  \"big\": -9223372036854775808,\n  \"yes\": true,\n  \"list\": [1, 0.1, -2.5e-20],\n  \"empty\": {},\n"
                  "  \"ready\": [1, {}],\n  \"none\": null\n}\n",
                  text);
    ASSERT_FALSE(json_open(&json, "/nonexistent/folder/x.json"));
    PASS();
}

TEST json_misuse_is_a_failure(void)
{
    struct json_writer json;
    ASSERT(json_open(&json, scratch("b.json")));
    json_object_begin(&json, NULL);
    json_number(&json, NULL, 1.0); /* no key */
    ASSERT_FALSE(json_close(&json));
    ASSERTm("no part of the file stays", access(scratch("b.json"), F_OK) != 0);
    PASS();
}

/* Limits the size of files to 100 bytes, or ends the limit. */
static bool limit_files(bool limited)
{
    static struct rlimit before;
    struct rlimit few;
    if (!limited) {
        return setrlimit(RLIMIT_FSIZE, &before) == 0;
    }
    signal(SIGXFSZ, SIG_IGN);
    if (getrlimit(RLIMIT_FSIZE, &before) != 0) { return false; }
    few = before;
    few.rlim_cur = 100;
    return setrlimit(RLIMIT_FSIZE, &few) == 0;
}

/* A file that cannot be written whole keeps what it had; a link stays a link. */
TEST failed_files_keep_what_they_had(void)
{
    static char more[4096];
    struct output_file output;
    char path[512], text[64];
    snprintf(path, sizeof path, "%s", scratch("link.bin"));
    ASSERT_EQ(0, symlink("kept.bin", path));
    ASSERT(output_file_open(&output, scratch("kept.bin")) && fputs("old", output.file) >= 0 && output_file_close(&output, true));
    ASSERT(limit_files(true));
    const bool opened = output_file_open(&output, path);
    const bool good = opened && output_file_close(&output, fwrite(more, 1, sizeof more, output.file) == sizeof more);
    ASSERT(limit_files(false));
    ASSERT(opened && !good);
    read_text(path, text, sizeof text);
    ASSERT_STR_EQ("old", text);
    ASSERT(access(scratch("kept.bin.part"), F_OK) != 0);
    ASSERT(output_file_open(&output, path) && fputs("new", output.file) >= 0 && output_file_close(&output, true));
    read_text(scratch("kept.bin"), text, sizeof text);
    ASSERT_STR_EQ("new", text);
    ASSERT(readlink(path, text, sizeof text) > 0);
    PASS();
}

/* A page that cannot be written whole, here for a limit on the size of files, leaves no part. */
TEST failed_pages_leave_no_file(void)
{
    struct page page;
    char path[512];
    snprintf(path, sizeof path, "%s", scratch("index.html"));
    ASSERT(limit_files(true));
    const bool opened = page_open(&page, path, "a & b");
    const bool good = opened && page_close(&page);
    ASSERT(limit_files(false));
    ASSERT(opened && !good);
    ASSERT(access(path, F_OK) != 0);
    ASSERT(page_open(&page, path, "a & b") && page_close(&page));
    ASSERT_EQ(0, access(path, F_OK));
    PASS();
}

TEST clock_and_memory_are_plausible(void)
{
    const double before = elapsed_seconds();
    ASSERT(elapsed_seconds() >= before);
    ASSERT(peak_rss_mib() > 0.5 && peak_rss_mib() < 1e6);
    PASS();
}

/* ---- pictures ---- */

TEST drawing_is_clipped_and_png_is_written(void)
{
    struct image image;
    char text[64];
    ASSERT(image_create(&image, 40, 30, color_rgb(1.0f, 1.0f, 1.0f)));
    image_line(&image, -1e6f, -1e6f, 1e6f, 1e6f, 3.0f, color_rgb(0.0f, 0.0f, 0.0f));
    image_disc(&image, NAN, 5.0f, 4.0f, color_rgb(0.0f, 0.0f, 0.0f));
    image_rect(&image, -1e30f, 3.0f, 1e30f, 4.0f, color_rgb(1.0f, 0.0f, 0.0f), 1.0f);
    image_text(&image, -500.0f, 20.0f, 30.0f, 0.0f, color_rgb(0.0f, 0.0f, 0.0f), "clipped \xff text");
    const float *p = image.rgb + 3 * (3 * 40 + 39);
    ASSERT_IN_RANGE(1.0f, p[0], 1e-6f);
    ASSERT_IN_RANGE(0.0f, p[1], 1e-6f);
    ASSERT(image_write_png(&image, scratch("a.png")));
    ASSERT(read_text(scratch("a.png"), text, sizeof text) > 20);
    ASSERT_MEM_EQ("\x89PNG", text, 4);
    ASSERT_FALSE(image_write_png(&image, "/nonexistent/folder/x.png"));
    ASSERT_FALSE(image_write_png(&image, "/dev/full"));
    image_free(&image);
    ASSERT_FALSE(image_create(&image, 0, 10, color_rgb(0.0f, 0.0f, 0.0f)));
    PASS();
}

TEST color_maps_rise_in_lightness(void)
{
    float last = -1.0f;
    for (int i = 0; i <= 50; ++i) {
        const struct color c = colormap_sequential((float)i / 50.0f);
        const float lightness = 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b;
        ASSERT(lightness > last);
        last = lightness;
    }
    PASS();
}

/* Lines fill all four corners: the picture grows upwards, and every column still shows the upper line. */
TEST legends_hide_no_line(void)
{
    const double x[2] = {0.0, 1.0}, low[2] = {0.05, 0.05}, high[2] = {0.95, 0.95};
    const struct plot_series series[] = {{"high", x, high, 2, 0, false, false}, {"low", x, low, 2, 1, false, false}};
    const struct plot plot = {NULL, NULL, NULL, false, false, false, series, 2};
    const struct color line = color_category(0);
    struct image image;
    ASSERT(plot_render(&plot, 400, 300, &image));
    for (int column = 100; column < 360; ++column) { /* well inside the axes */
        bool seen = false;
        for (int row = 0; row < image.height; ++row) {
            const float *rgb = image.rgb + 3 * (row * image.width + column);
            seen = seen || fabsf(rgb[0] - line.r) + fabsf(rgb[1] - line.g) + fabsf(rgb[2] - line.b) < 0.02f;
        }
        ASSERT(seen);
    }
    image_free(&image);
    PASS();
}

TEST plots_survive_awkward_data(void)
{
    const double x[4] = {0.0, 1.0, NAN, 3.0}, zero[4] = {0.0, 0.0, 0.0, 0.0}, big[4] = {1e-300, 1e300, INFINITY, 1.0};
    const struct plot_series series[] = {{"flat", x, zero, 4, 0, true, false}, {"huge", x, big, 4, 1, false, false}};
    struct plot plot = {"t", "x", "y", false, false, true, series, 1};
    struct image image;
    ASSERT(plot_render(&plot, 300, 200, &image)); /* one value only */
    image_free(&image);
    plot.log_y = true;
    ASSERT_FALSE(plot_render(&plot, 300, 200, &image)); /* nothing positive */
    plot.series = series + 1;
    ASSERT(plot_render(&plot, 300, 200, &image)); /* 600 decades */
    image_free(&image);
    const double none[4] = {NAN, INFINITY, -INFINITY, NAN};
    struct heat_map map = {"t", "r", "c", "v", 2, 2, NULL, NULL, zero, NULL, NULL, true};
    ASSERT(heat_map_render(&map, 30, &image));
    image_free(&image);
    map.values = none;
    ASSERT_FALSE(heat_map_render(&map, 30, &image));
    PASS();
}

/* ---- triangles ---- */

/* A sphere as latitude-longitude mesh; the caller frees both arrays. */
static void make_sphere(float radius, int n, float **positions, uint32_t **indices, size_t *vertices, size_t *triangles)
{
    const int rings = n + 1, columns = 2 * n;
    *vertices = (size_t)(rings * columns);
    *triangles = (size_t)(2 * n * columns);
    *positions = malloc(*vertices * 3 * sizeof(float));
    *indices = malloc(*triangles * 3 * sizeof(uint32_t));
    uint32_t *out = *indices;
    for (int r = 0; r < rings; ++r) {
        for (int c = 0; c < columns; ++c) {
            const float a = 3.14159265f * (float)r / (float)n, b = 6.2831853f * (float)c / (float)columns;
            float *p = *positions + 3 * (r * columns + c);
            p[0] = radius * sinf(a) * cosf(b);
            p[1] = radius * sinf(a) * sinf(b);
            p[2] = radius * cosf(a);
            if (r < n) {
                const uint32_t i = (uint32_t)(r * columns + c), j = (uint32_t)(r * columns + (c + 1) % columns);
                const uint32_t k = i + (uint32_t)columns, l = j + (uint32_t)columns;
                const uint32_t quad[6] = {i, k, j, j, k, l};
                memcpy(out, quad, sizeof quad);
                out += 6;
            }
        }
    }
}

TEST hierarchy_agrees_with_trying_every_triangle(void)
{
    enum { COUNT = 300 };
    float soup[9 * COUNT];
    struct bvh all, one;
    uint32_t state = 7;
    for (int i = 0; i < 9 * COUNT; ++i) {
        soup[i] = uniform(&state) * 0.3f + (float)(i / 9 % 5) * 0.2f;
    }
    memcpy(soup + 9, soup, 9 * sizeof *soup); /* a double, */
    memcpy(soup + 21, soup + 18, 3 * sizeof *soup); /* one without area */
    soup[30] = NAN;                                 /* and one to be left out */
    ASSERT(bvh_build(&all, soup, NULL, COUNT));
    ASSERT_EQ(COUNT - 1u, all.triangle_count);
    for (int q = 0; q < 200; ++q) {
        float p[3], d[3], nearest = INFINITY, first = INFINITY, closest[3];
        struct bvh_hit hit = {INFINITY, 0.0f, 0.0f, 0};
        for (int i = 0; i < 3; ++i) {
            p[i] = uniform(&state) * 2.0f - 0.5f;
            d[i] = q % 4 == i ? 0.0f : uniform(&state) - 0.5f;
        }
        for (int t = 0; t < COUNT; ++t) {
            if (t != 3 && bvh_build(&one, soup + 9 * t, NULL, 1)) {
                struct bvh_hit single;
                nearest = fminf(nearest, bvh_distance(&one, p, NULL, NULL));
                if (bvh_nearest_hit(&one, p, d, 0.0f, INFINITY, &single)) { first = fminf(first, single.t); }
                bvh_free(&one);
            }
        }
        const float distance = bvh_distance(&all, p, closest, NULL);
        ASSERT_IN_RANGE(nearest, distance, 0.0f);
        ASSERT_IN_RANGE(distance, hypotf(hypotf(closest[0] - p[0], closest[1] - p[1]), closest[2] - p[2]), 1e-5f);
        ASSERT_EQ(isfinite(first) != 0, bvh_nearest_hit(&all, p, d, 0.0f, INFINITY, &hit));
        ASSERT(hit.t == first);
        ASSERT_EQ(isfinite(first) != 0, bvh_any_hit(&all, p, d, 0.0f, INFINITY));
    }
    bvh_free(&all);
    ASSERT_FALSE(bvh_build(&all, soup + 27, NULL, 1));
    PASS();
}

TEST hierarchy_of_identical_triangles_stays_shallow(void)
{
    enum { COUNT = 5000 };
    float *soup = malloc(9 * COUNT * sizeof *soup);
    struct bvh bvh;
    for (int i = 0; i < 9 * COUNT; ++i) {
        soup[i] = (float)(i % 9 % 4);
    }
    const float p[3] = {5.0f, 5.0f, 5.0f};
    ASSERT(bvh_build(&bvh, soup, NULL, COUNT));
    ASSERT(bvh_distance(&bvh, p, NULL, NULL) > 0.0f);
    bvh_free(&bvh);
    free(soup);
    PASS();
}

/* Triangles about the eye too, needles and slivers, against a search for each ray. */
TEST rows_of_a_picture_miss_no_triangle(void)
{
    enum { COUNT = 400, WIDTH = 45, HEIGHT = 30, SAMPLES = 3 };
    static float soup[9 * COUNT];
    static struct raycast_ray rays[RAYCAST_BAND * SAMPLES * WIDTH * SAMPLES];
    uint32_t state = 3;
    for (int t = 0; t < COUNT; ++t) {
        const float size = t % 3 == 0 ? 4.0f : 0.2f, center[3] = {uniform(&state), uniform(&state), uniform(&state)};
        for (int i = 0; i < 9; ++i) {
            soup[9 * t + i] = 3.0f * (center[i % 3] - 0.5f) + size * (uniform(&state) - 0.5f) * (t % 3 == 0 && i >= 6 ? 1e-3f : 1.0f);
        }
    }
    soup[30] = NAN;
    for (int lens = 0; lens < 2; ++lens) {
        const struct raycast_camera camera = {.eye = {0.3f, -1.2f, 0.4f}, .target = {0.0f, 0.0f, 0.1f}, .up = {0.0f, 0.0f, 1.0f},
                                              .field_of_view = lens == 0 ? 50.0f : 0.0f, .ortho_height = 2.0f};
        struct raycast_rows rows = {.camera = &camera, .frame = raycast_camera_frame(&camera, (float)WIDTH / (float)HEIGHT),
                                    .corners = soup, .width = WIDTH, .height = HEIGHT, .samples = SAMPLES};
        struct bvh bvh;
        int hits = 0;
        ASSERT(bvh_build(&bvh, soup, NULL, COUNT) && raycast_rows_create(&rows, COUNT));
        for (int band = 0; band < raycast_band_count(&rows); ++band) {
            raycast_band_trace(&rows, band, rays);
            const int lines = SAMPLES * (HEIGHT - band * RAYCAST_BAND < RAYCAST_BAND ? HEIGHT - band * RAYCAST_BAND : RAYCAST_BAND);
            for (int i = 0; i < lines * WIDTH * SAMPLES; ++i) {
                struct bvh_hit hit = {.t = INFINITY};
                hits += bvh_nearest_hit(&bvh, rays[i].origin, rays[i].direction, 0.0f, INFINITY, &hit);
                ASSERT(hit.t == rays[i].hit.t);
            }
        }
        ASSERT(hits > WIDTH * HEIGHT);
        raycast_rows_free(&rows);
        bvh_free(&bvh);
    }
    PASS();
}

/* A picture of one color is read however small its file is; a header alone that promises a large one is not. */
TEST pictures_have_no_more_pixels_than_their_files_can_have(void)
{
    static const unsigned char header[26] = {0,  0, 10, 0,  0, 0,   0, 0, 0, 0,   0, 0, 0,
                                             32, 0, 32, 24, 0, 255, 0, 0, 0, 255, 0, 0, 0}; /* TGA, 8192^2 */
    struct image white, again;
    ASSERT_FALSE(image_read(header, sizeof header, &again));
    ASSERT(image_create(&white, 2048, 2048, color_rgb(1.0f, 1.0f, 1.0f)));
    ASSERT(image_write_small_png(&white, 2, scratch("white.png")));
    ASSERT(image_read_file(scratch("white.png"), &again));
    ASSERT_EQ(2048, again.width);
    ASSERT_MEM_EQ(white.rgb, again.rgb, 3 * 2048 * 2048 * sizeof(float));
    image_free(&white);
    image_free(&again);
    PASS();
}

/* Returns the squared distance of two colours. */
static float color_distance2(const float *a, const float *b)
{
    float d2 = 0.0f;
    for (int c = 0; c < 3; ++c) d2 += (a[c] - b[c]) * (a[c] - b[c]);
    return d2;
}

/* Few greys among many yellows: no pixel has a colour of the palette while another is much nearer to it. */
TEST small_pictures_have_no_specks(void)
{
    enum { SIDE = 128, COLORS = 24 };
    struct image image, again;
    float palette[COLORS][3];
    int colors = 0;
    ASSERT(image_create(&image, SIDE, SIDE, color_rgb(1.0f, 1.0f, 1.0f)));
    for (int i = 0; i < SIDE * SIDE; ++i) {
        const float shade = (float)(i * 7 % 101) / 101.0f, grey = (float)(i / 37 % 16) / 16.0f;
        const float yellow[3] = {0.6f + 0.4f * shade, 0.5f + 0.4f * shade, 0.3f * shade}, rare[3] = {grey, grey, grey};
        memcpy(image.rgb + 3 * i, i % 37 == 0 ? rare : yellow, sizeof rare);
    }
    ASSERT(image_write_small_png(&image, COLORS, scratch("specks.png")));
    ASSERT(image_read_file(scratch("specks.png"), &again));
    for (int i = 0; i < SIDE * SIDE; ++i) {
        int k = 0;
        while (k < colors && color_distance2(palette[k], again.rgb + 3 * i) > 0.0f) k++;
        ASSERT_LT(k, COLORS);
        if (k == colors) memcpy(palette[colors++], again.rgb + 3 * i, sizeof palette[k]);
    }
    for (int i = 0; i < SIDE * SIDE; ++i)
        for (int k = 0; k < colors; ++k)
            ASSERT_LT(sqrtf(color_distance2(image.rgb + 3 * i, again.rgb + 3 * i)),
                      sqrtf(color_distance2(image.rgb + 3 * i, palette[k])) + 0.03f); /* 0.03: two cells of 6 bits */
    image_free(&image);
    image_free(&again);
    PASS();
}

/* A caption stands under what its picture shows, not under the middle of the picture. */
TEST captions_stand_under_what_they_name(void)
{
    enum { SIDE = 200 };
    const struct color white = {1.0f, 1.0f, 1.0f}, ink = {0.0f, 0.0f, 0.0f};
    const char *const captions[] = {"left", "right"};
    struct image bodies[2], strip;
    for (int b = 0; b < 2; ++b) {
        ASSERT(image_create(&bodies[b], SIDE, 40, white));
        image_disc(&bodies[b], b == 0 ? 50.0f : 150.0f, 20.0f, 10.0f, ink);
    }
    ASSERT(image_strip(bodies, captions, 2, 2, white, &strip));
    for (int b = 0; b < 2; ++b) {
        const int from = b * strip.width / 2;
        int first = strip.width, last = 0;
        for (int y = strip.height - 34; y < strip.height; ++y)
            for (int x = from; x < from + strip.width / 2; ++x)
                if (strip.rgb[3 * (y * strip.width + x)] < 0.5f) first = x < first ? x : first, last = x > last ? x : last;
        ASSERT_IN_RANGE(b == 0 ? 62.0f : 374.0f, 0.5f * (float)(first + last), 3.0f);
        image_free(&bodies[b]);
    }
    image_free(&strip);
    PASS();
}

TEST pictures_of_a_sphere(void)
{
    struct raycast_scene scene;
    struct image image, again;
    float *positions;
    uint32_t *indices;
    const float direction[3] = {0.3f, 0.4f, 1.0f}, up[3] = {0.0f, 0.0f, 1.0f};
    memset(&scene, 0, sizeof scene);
    make_sphere(2.0f, 24, &positions, &indices, &scene.vertex_count, &scene.triangle_count);
    scene.positions = positions;
    scene.indices = indices;
    scene.vertex_originals = positions;
    scene.camera = raycast_frame_points(positions, scene.vertex_count, direction, up, 30.0f, 1.0f);
    for (int style = RAYCAST_SMOOTH; style <= RAYCAST_SPRINGL; ++style) {
        scene.style = (enum raycast_style)style;
        scene.particles = positions;
        scene.particle_count = style == RAYCAST_SPRINGL ? scene.vertex_count : 0;
        ASSERT(raycast_render(&scene, 64, 64, &image));
        ASSERT(raycast_render(&scene, 64, 64, &again));
        ASSERT_MEM_EQ(image.rgb, again.rgb, 3 * 64 * 64 * sizeof(float));
        int covered = 0;
        for (int i = 0; i < 64 * 64; ++i) {
            covered += fabsf(image.rgb[3 * i] - image.rgb[3 * i + 1]) > 0.03f; /* the pattern is coloured, the ground is not */
        }
        ASSERT(covered > 1600 && covered < 3400);
        image_free(&image);
        image_free(&again);
    }
    indices[5] = 1000000;
    ASSERT_FALSE(raycast_render(&scene, 16, 16, &image));
    image_free(&image);
    scene.triangle_count = 0;
    ASSERT(raycast_render(&scene, 16, 16, &image));
    image_free(&image);
    free(positions);
    free(indices);
    PASS();
}

TEST concentric_spheres_are_their_gap_apart(void)
{
    struct surface a, b;
    struct surface_distances d;
    float *pa, *pb;
    uint32_t *ia, *ib;
    size_t vertices;
    make_sphere(10.0f, 60, &pa, &ia, &vertices, &a.triangle_count);
    make_sphere(12.0f, 60, &pb, &ib, &vertices, &b.triangle_count);
    a.positions = pa;
    a.indices = ia;
    b.positions = pb;
    b.indices = ib;
    ASSERT(surface_distances_measure(&a, &b, 5000, 1.9, &d));
    ASSERT_IN_RANGE(2.0, d.assd, 0.02);
    ASSERT_IN_RANGE(2.0, d.hd95, 0.03);
    ASSERT_IN_RANGE(2.0, d.max, 0.03);
    ASSERT_IN_RANGE(0.0, d.surface_dice, 0.0);
    ASSERT_IN_RANGE(4.0 * 3.14159 * 100.0, d.area_a, 5.0);
    ASSERT(surface_distances_measure(&a, &a, 1000, 0.001, &d));
    ASSERT_IN_RANGE(0.0, d.max, 1e-5);
    ASSERT_IN_RANGE(1.0, d.surface_dice, 1e-9);
    a.triangle_count = 0;
    ASSERT_FALSE(surface_distances_measure(&a, &b, 100, 1.0, &d));
    free(pa);
    free(ia);
    free(pb);
    free(ib);
    PASS();
}

TEST overlap_by_hand(void)
{
    const float a[6] = {0, 1, 1, 2, 2, 0}, b[6] = {0, 1, 2, 2, 0, 0};
    const struct overlap two = overlap_labels(a, b, 6, 2.0f), any = overlap_labels(a, b, 6, -1.0f);
    const struct overlap none = overlap_labels(a, b, 6, 9.0f);
    ASSERT_IN_RANGE(0.5, two.dice, 1e-12);
    ASSERT_IN_RANGE(1.0 / 3.0, two.jaccard, 1e-12);
    ASSERT_IN_RANGE(6.0 / 7.0, any.dice, 1e-12);
    ASSERT_IN_RANGE(1.0, none.dice, 0.0);
    PASS();
}

TEST ply_comes_back_welded(void)
{
    struct mesh mesh;
    char error[MESH_TEXT];
    const float soup[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}; /* a square of two loose triangles */
    const struct mesh_arrays ply = {.positions = soup, .vertex_count = 6, .triangle_count = 2, .normals = soup, .colors = soup,
                                    .originals = soup, .comment = "two triangles"};
    ASSERT(mesh_write_ply(scratch("a.ply"), &ply, error));
    ASSERTm(error, mesh_read(scratch("a.ply"), &mesh, error));
    ASSERT_EQ(4u, mesh.vertex_count);
    ASSERT_EQ(2u, mesh.triangle_count);
    mesh_free(&mesh);
    ASSERT_FALSE(mesh_read("/nonexistent.ply", &mesh, error));
    ASSERT(error[0] && !strchr(error, '\n'));
    ASSERT_FALSE(mesh_write_ply("/nonexistent/a.ply", &ply, error));
    PASS();
}

/* Writes a PLY file of mesh_write_ply anew, its header with this first word, and this behind its last one. */
static bool change_header(const char *path, const char *first, const char *behind)
{
    size_t size;
    unsigned char *bytes = scene_read_file(path, &size);
    const char *end = bytes ? strstr((const char *)bytes, "end_header\n") : NULL;
    FILE *file = end ? fopen(path, "wb") : NULL;
    bool good = file != NULL;
    if (file) {
        const size_t header = (size_t)(end - (const char *)bytes) + strlen("end_header");
        good = fprintf(file, "%s%.*s%s", first, (int)(header - 3), (const char *)bytes + 3, behind) > 0
            && fwrite(bytes + header + 1, 1, size - header - 1, file) == size - header - 1;
        good = fclose(file) == 0 && good;
    }
    free(bytes);
    return good;
}

/* Numbers of a binary file may begin with the byte of a line end, or of other white space, behind any header that is valid. */
TEST ply_may_begin_with_any_byte(void)
{
    static const unsigned char bytes[] = {'\0', '\t', '\n', '\f', '\r', ' '};
    static const char *const headers[][2] = {{"ply", "\n"},  {"PLY", "\n"},    {"ply", " \n"},
                                             {"ply", "\t\n"}, {"ply", "\r\n"}, {"Ply", "\r \f\n"}};
    for (size_t n = 0; n < 6 * sizeof bytes; ++n) {
        const char *const *header = headers[n / sizeof bytes];
        float soup[9] = {1.8f, 0, 0, 0, 1, 0, 0, 0, 1};
        uint32_t bits;
        struct mesh mesh;
        char error[MESH_TEXT];
        memcpy(&bits, soup, sizeof bits);
        bits = (bits & 0xFFFFFF00u) | bytes[n % sizeof bytes];
        memcpy(soup, &bits, sizeof bits);
        const struct mesh_arrays ply = {.positions = soup, .vertex_count = 3, .triangle_count = 1};
        ASSERT(mesh_write_ply(scratch("a.ply"), &ply, error) && change_header(scratch("a.ply"), header[0], header[1]));
        ASSERTm(error, mesh_read(scratch("a.ply"), &mesh, error));
        ASSERT_EQ(1u, mesh.triangle_count);
        ASSERT_MEM_EQ(soup, mesh.positions, sizeof soup);
        mesh_free(&mesh);
    }
    PASS();
}

/* ---- volumes ---- */

TEST volume_comes_back_in_its_geometry(void)
{
    const int dims[3] = {5, 4, 3};
    const float spacing[3] = {1.0f, 2.0f, 3.5f}, origin[3] = {-7.0f, 8.0f, 9.0f};
    static const char *const names[] = {"v.nii", "v.nii.gz"};
    struct volume made, back, again;
    char error[VOLUME_TEXT];
    ASSERT(volume_create(dims, spacing, origin, &made));
    for (int i = 0; i < 60; ++i) {
        made.data[i] = (float)i * 0.5f;
    }
    for (int n = 0; n < 2; ++n) {
        const char *path = scratch(names[n]);
        ASSERTm(error, volume_write(path, &made, VOLUME_FLOAT32, made.data, error));
        ASSERTm(error, volume_read(path, 0, &back, error));
        ASSERT(volume_same_grid(&made, &back));
        ASSERT_MEM_EQ(made.data, back.data, 60 * sizeof(float));
        const short labels[60] = {1, -2, 300};
        ASSERTm(error, volume_write(path, &back, VOLUME_INT16, labels, error));
        ASSERTm(error, volume_read(path, 0, &again, error));
        ASSERT(volume_same_grid(&made, &again));
        ASSERT_IN_RANGE(300.0f, again.data[2], 0.0f);
        volume_free(&again);
        ASSERT_FALSE(volume_read(path, 1, &again, error));
        volume_free(&back);
    }
    const float index[3] = {1.0f, 2.0f, 0.5f};
    float world[3], round_trip[3];
    volume_index_to_world(&made, index, world);
    volume_world_to_index(&made, world, round_trip);
    ASSERT_IN_RANGE(-6.0f, world[0], 1e-6f);
    ASSERT_IN_RANGE(12.0f, world[1], 1e-6f);
    for (int i = 0; i < 3; ++i) {
        ASSERT_IN_RANGE(index[i], round_trip[i], 1e-6f);
    }
    volume_free(&made);
    PASS();
}

/* Compiled kernels are kept in the user's folder for such files, or in SPRINGLS_CACHE; nowhere when that is empty. */
TEST the_cache_has_its_folder(void)
{
    static const char *const names[] = {"HOME", "LOCALAPPDATA", "XDG_CACHE_HOME", "SPRINGLS_CACHE"};
    static const char *const folders[] = {"/home/of/.cache/springls", "/local/springls", "/cache/springls", "/own"};
    static const char *const values[] = {"/home/of", "/local", "/cache", "/own"};
    char before[4][512], path[512];
    bool had[4];
    for (int i = 0; i < 4; ++i) {
        const char *value = getenv(names[i]);
        had[i] = value != NULL;
        snprintf(before[i], sizeof before[i], "%s", value ? value : "");
        unsetenv(names[i]);
    }
    ASSERT_FALSE(run_cache_folder(path, sizeof path));
    for (int i = 0; i < 4; ++i) {
        setenv(names[i], values[i], 1);
        ASSERT(run_cache_folder(path, sizeof path));
        ASSERT_STR_EQ(folders[i], path);
        ASSERT_FALSE(run_cache_folder(path, strlen(folders[i])));
    }
    setenv("SPRINGLS_CACHE", "", 1);
    ASSERT_FALSE(run_cache_folder(path, sizeof path));
    for (int i = 0; i < 4; ++i) {
        if (had[i]) {
            setenv(names[i], before[i], 1);
        } else {
            unsetenv(names[i]);
        }
    }
    PASS();
}

TEST contours_are_drawn_where_they_are(void)
{
    const int dims[3] = {20, 20, 20};
    const float spacing[3] = {1.0f, 1.0f, 2.0f}, origin[3] = {0.0f, 0.0f, 0.0f};
    struct volume volume;
    struct image image;
    ASSERT(volume_create(dims, spacing, origin, &volume));
    for (int i = 0; i < 8000; ++i) {
        const float x = (float)(i % 20) - 9.5f, y = (float)(i / 20 % 20) - 9.5f, z = 2.0f * ((float)(i / 400) - 9.5f);
        volume.data[i] = sqrtf(x * x + y * y + z * z) - 6.0f;
    }
    const struct slices_contour contour = {volume.data, 0.0f, 0.0f, false, 2.0f, {1.0f, 0.0f, 0.0f}, "sphere"};
    const struct slices_view view = {&volume, &contour, 1, {-1, -1, -1}, 0.0f, 0.0f, 200, "a sphere"};
    ASSERT(slices_render(&view, &image));
    int red = 0;
    for (int i = 0; i < image.width * image.height; ++i) {
        red += image.rgb[3 * i] > 0.8f && image.rgb[3 * i + 1] < 0.2f;
    }
    /* three circles of radius 6 mm at 5 pixels a millimetre, two pixels wide; and the legend */
    ASSERT_IN_RANGE(3.0f * 6.2832f * 30.0f * 2.0f, (float)red, 300.0f);
    image_free(&image);
    volume_free(&volume);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) { return 1; }
    RUN_TEST(cli_reads_every_type);
    RUN_TEST(cli_refuses_in_one_line_with_status_2);
    RUN_TEST(cli_refuses_what_has_no_effect);
    RUN_TEST(cli_refuses_to_overwrite);
    RUN_TEST(cli_help_ends_well_and_names_defaults);
    RUN_TEST(a_full_disk_is_a_failure);
    RUN_TEST(json_is_exact_and_always_valid);
    RUN_TEST(json_misuse_is_a_failure);
    RUN_TEST(failed_files_keep_what_they_had);
    RUN_TEST(failed_pages_leave_no_file);
    RUN_TEST(clock_and_memory_are_plausible);
    RUN_TEST(drawing_is_clipped_and_png_is_written);
    RUN_TEST(color_maps_rise_in_lightness);
    RUN_TEST(legends_hide_no_line);
    RUN_TEST(plots_survive_awkward_data);
    RUN_TEST(hierarchy_agrees_with_trying_every_triangle);
    RUN_TEST(hierarchy_of_identical_triangles_stays_shallow);
    RUN_TEST(rows_of_a_picture_miss_no_triangle);
    RUN_TEST(small_pictures_have_no_specks);
    RUN_TEST(captions_stand_under_what_they_name);
    RUN_TEST(pictures_of_a_sphere);
    RUN_TEST(pictures_have_no_more_pixels_than_their_files_can_have);
    RUN_TEST(concentric_spheres_are_their_gap_apart);
    RUN_TEST(overlap_by_hand);
    RUN_TEST(ply_comes_back_welded);
    RUN_TEST(ply_may_begin_with_any_byte);
    RUN_TEST(volume_comes_back_in_its_geometry);
    RUN_TEST(contours_are_drawn_where_they_are);
    RUN_TEST(the_cache_has_its_folder);
    remove_folder();
    GREATEST_MAIN_END();
}

#endif
