/* make imaging: commands with blanks in their words, pages whose text is no markup, steps that fail, the plans. */
#ifdef TEST_EXAMPLES_COMMON
#include "bench/runs.c" /* first: it defines the standard that it needs */
#endif

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_imaging_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_imaging_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "bench/imaging_page.c"
#include "bench/imaging_markdown.c"
#include "bench/imaging_plan.c"
#include "bench/imaging_tables.c"
#include "bench/table.c"

static char folder[64] = "/tmp/springls_imaging_XXXXXX";
const char *const imaging_folder = folder;

static struct imaging imaging;

/* What a step called `name` is given comes from a program that does something else. */
static void plan_one(enum imaging_kind kind, const char *name, const char *title, const char *command)
{
    add(&imaging, kind, name, title, "-");
    run_command(&imaging.runs[imaging.count - 1], "%s", command);
}

static int do_all(void)
{
    char runs[100];
    snprintf(runs, sizeof runs, "%s/runs", folder);
    const struct run_options options = {.folder = runs, .at_once = 1};
    imaging.failures = runs_do(imaging.runs, imaging.count, &options);
    return imaging.failures;
}

static void begin(void)
{
    runs_free(imaging.runs, imaging.count);
    memset(&imaging, 0, sizeof imaging);
    imaging.settings.backend = "scalar";
    imaging.about = "a & b";
}

static char *written(const char *name)
{
    char path[PAGE_PATH];
    file_path(name, path);
    return read_whole_file(path);
}

TEST words_may_hold_blanks(void)
{
    char word[64], command[200];
    begin();
    snprintf(command, sizeof command, "/usr/bin/printf {\"%%s\":\"%%s\"} a%s b", run_word(" \\c d", word, sizeof word));
    plan_one(IMAGING_SEGMENT, "words", "words", command);
    ASSERT_EQ(0, do_all());
    ASSERT_STR_EQ("{\"a \\c d\":\"b\"}", imaging.runs[0].json);
    ASSERT_EQ(0, imaging.runs[0].exit_status);
    PASS();
}

TEST a_step_that_fails_is_shown_and_the_others_are_too(void)
{
    char path[PAGE_PATH];
    begin();
    plan_one(IMAGING_SEGMENT, "good", "<i>good</i>",
             "/usr/bin/printf {\"steps\":7,\"seconds\":1.5,\"against_reference\":{\"dice\":0.9125}}");
    plan_one(IMAGING_SEGMENT, "bad", "bad one", "/bin/sh -c echo\\ first>&2;echo\\ the\\ '\"<reason>\"'>&2;exit\\ 3");
    plan_one(IMAGING_SEGMENT, "nothing", "says nothing", "/bin/true");
    ASSERT_EQ(2, do_all());
    ASSERT_EQ(3, imaging.runs[1].exit_status);
    file_path("good", path);
    ASSERT(make_folder(path));
    file_path("good/film.png", path);
    FILE *file = fopen(path, "w");
    ASSERT(file && fclose(file) == 0);
    ASSERT(imaging_write_page(&imaging));
    ASSERT(imaging_write_report(&imaging));
    char *page = written("index.html"), *report = written("report.json");
    ASSERT(page && report);
    ASSERT(strstr(page, "a &amp; b"));
    ASSERT(strstr(page, "&lt;i&gt;good&lt;/i&gt;") && !strstr(page, "<i>"));
    ASSERT(strstr(page, "<td>0.912</td>") || strstr(page, "<td>0.913</td>"));
    ASSERT(strstr(page, "<img src=\"good/film.png\"") && !strstr(page, "slices.png"));
    ASSERT(strstr(page, "2 of 3 steps failed."));
    ASSERT(strstr(page, "Failed (exit status 3): the &quot;&lt;reason&gt;&quot;") && !strstr(page, "first\n"));
    ASSERT(strstr(page, "</body></html>"));
    cJSON *parsed = cJSON_Parse(report);
    const cJSON *steps = cJSON_GetObjectItem(parsed, "steps");
    ASSERT_EQ(3, cJSON_GetArraySize(steps));
    ASSERT_EQ(2, cJSON_GetObjectItem(parsed, "failures")->valueint);
    ASSERT_EQ(7, cJSON_GetObjectItem(cJSON_GetObjectItem(cJSON_GetArrayItem(steps, 0), "report"), "steps")->valueint);
    ASSERT(cJSON_IsNull(cJSON_GetObjectItem(cJSON_GetArrayItem(steps, 1), "report")));
    ASSERT_STR_EQ("the \"<reason>\"", cJSON_GetObjectItem(cJSON_GetArrayItem(steps, 1), "said")->valuestring);
    cJSON_Delete(parsed);
    free(page);
    free(report);
    PASS();
}

/* The page that is kept has the tables, the paper's figures and the commands, but no folder of this machine. */
TEST tables_become_markdown(void)
{
    char path[PAGE_PATH];
    begin();
    imaging.settings.collection = "/some where/data";
    plan_one(IMAGING_SEGMENT, "good", "good", "/usr/bin/printf {\"steps\":7,\"against_reference\":{\"dice\":0.9125}}");
    plan_one(IMAGING_SEGMENT, "bad", "bad one", "/bin/false /some\\ where/data/a.nii.gz");
    ASSERT_EQ(1, do_all());
    file_path("results.md", path);
    ASSERT(imaging_write_markdown(&imaging, path));
    char *page = written("results.md");
    ASSERT(page);
    ASSERT(strstr(page, "\n## Segmentation: active contours") && !strstr(page, "## Tracking"));
    ASSERT(strstr(page, "The paper: A pelvis in CT, 400 steps"));
    ASSERT(strstr(page, "| good ") && strstr(page, "| 7 ") && strstr(page, "|------"));
    ASSERT(strstr(page, "Failed: bad one (exit status 1)."));
    ASSERT(strstr(page, "/bin/false $SPRINGLS_DATA/a.nii.gz") && !strstr(page, "some"));
    free(page);
    PASS();
}

/* Rows of stages and steps come from arrays of objects. */
TEST rows_are_taken_from_the_reports(void)
{
    static struct table table;
    begin();
    plan_one(IMAGING_ATLAS, "atlas", "hip",
             "/usr/bin/printf {\"stages\":[{\"name\":\"start\",\"dice\":0.5},{\"name\":\"springls\",\"dice\":0.75}],"
             "\"without_atlas\":{\"name\":\"without\\ atlas\",\"dice\":0.25}}");
    plan_one(IMAGING_TRACK, "track", "heart",
             "/usr/bin/printf {\"springls\":9,\"variance_of_modes\":[0.98],\"frames\":[{\"volume_ml\":20,\"springls_kept\":9},"
             "{\"volume_ml\":10,\"springls_kept\":8}]}");
    ASSERT_EQ(0, do_all());
    imaging_table(&imaging, IMAGING_ATLAS, &table);
    ASSERT_EQ(4, table.rows);
    ASSERT_STR_EQ("hip: start", table.cells[1][0]);
    ASSERT_STR_EQ("0.750", table.cells[2][2]);
    ASSERT_STR_EQ("hip: without atlas", table.cells[3][0]);
    ASSERT_STR_EQ("-", table.cells[3][3]);
    imaging_table(&imaging, IMAGING_TRACK, &table);
    ASSERT_EQ(2, table.rows);
    ASSERT_STR_EQ("2", table.cells[1][1]);
    ASSERT_STR_EQ("8", table.cells[1][3]);
    ASSERT_STR_EQ("10 to 20", table.cells[1][4]);
    ASSERT_STR_EQ("98 %", table.cells[1][10]);
    PASS();
}

/* No name twice: a step's folder is its own. */
static bool names_differ(void)
{
    bool differ = imaging.count > 0;
    for (int s = 0; s < imaging.count; ++s) {
        for (int o = 0; o < s; ++o) {
            differ = differ && strcmp(imaging.runs[s].name, imaging.runs[o].name) != 0;
        }
    }
    return differ;
}

static bool some_command_has(const char *text)
{
    bool has = false;
    for (int s = 0; s < imaging.count; ++s) {
        has = has || strstr(imaging.runs[s].command, text) != NULL;
    }
    return has;
}

TEST plans_follow_the_data_that_there_is(void)
{
    begin();
    imaging.settings.templates = "/the head";
    imaging_plan(&imaging);
    ASSERT(names_differ());
    ASSERT(some_command_has("/the\\ head/ch2bet.nii.gz"));
    begin();
    imaging.settings.collection = "/coll";
    imaging_plan(&imaging);
    ASSERT(names_differ());
    ASSERT(some_command_has("/coll/ct/ct_pelvis_TS.nii.gz"));
    begin();
    imaging.settings.collection = "/coll"; /* what the user names comes first */
    imaging.settings.series = "my series.nii";
    imaging.settings.series_labels = "first.nii";
    imaging_plan(&imaging);
    ASSERT(names_differ());
    ASSERT_EQ(3, imaging.count);
    ASSERT(some_command_has("my\\ series.nii --labels first.nii --"));
    ASSERT_FALSE(some_command_has("/coll"));
    begin();
    imaging.settings.image = "ct.nii";
    imaging.settings.labels = "labels.nii";
    imaging.settings.label = "3";
    imaging.settings.subjects = "a.nii b.nii:2";
    imaging_plan(&imaging);
    ASSERT_EQ(6, imaging.count);
    ASSERT(some_command_has("ct.nii --reference labels.nii --label 3 --init torus"));
    ASSERT(some_command_has("build/atlas build a.nii b.nii:2 "));
    ASSERT(some_command_has("ct.nii --atlas"));
    begin();
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!mkdtemp(folder)) return 1;
    RUN_TEST(words_may_hold_blanks);
    RUN_TEST(a_step_that_fails_is_shown_and_the_others_are_too);
    RUN_TEST(tables_become_markdown);
    RUN_TEST(rows_are_taken_from_the_reports);
    RUN_TEST(plans_follow_the_data_that_there_is);
    char command[100];
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (system(command) != 0) return 1;
    GREATEST_MAIN_END();
}

#endif
