/* docs/results.md: it is its text with its sections, the library still gives its figures, and the README has the same ones. */
#ifdef TEST_EXAMPLES_COMMON
#include "bench/runs.c" /* first: it defines the standard that it needs */
#endif

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_results_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_results_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "bench/paper_page.c"

/* Returns a copy of a part's section of the page in `user`, or NULL. */
static char *section_of(void *user, const char *part)
{
    const char *section;
    const size_t length = paper_section_find(user, part, &section);
    char *copy = length > 0 ? calloc(1, length + 1) : NULL;
    return copy ? memcpy(copy, section, length) : NULL;
}

/* A line for a part becomes its section, other lines stay, and a part without a section is named. */
TEST a_page_is_put_together(void)
{
    char old[] = "old text\n<!-- one: stamp 1 -->\n\nfigures\n\n<!-- end of one -->\nold text\n", stamp[PAPER_STAMP];
    char *page = paper_page("a\n<!-- part one -->\nb\n<!-- part two -->\n<!-- note -->", section_of, old);
    ASSERT(page);
    ASSERT_STR_EQ("a\n<!-- one: stamp 1 -->\n\nfigures\n\n<!-- end of one -->\nb\n"
                  "(Not run yet: `make paper PAPER=two`.)\n<!-- note -->", page);
    char *section = section_of(page, "one");
    ASSERT(section && paper_section_stamp(section, stamp));
    ASSERT_STR_EQ("stamp 1", stamp);
    ASSERT_FALSE(section_of(page, "two"));
    free(section);
    free(page);
    PASS();
}

/* A stamp changes with each value, and not with a member that is 0. */
TEST a_stamp_is_of_the_values(void)
{
    springls_params params = springls_default_params();
    const uint32_t hash = run_params_hash(&params);
    ASSERT_EQ(hash, run_params_hash(&params));
    params.d_max += 0.01f;
    ASSERT(hash != run_params_hash(&params));
    params.d_max = 0.0f;
    const uint32_t without = run_params_hash(&params);
    params.d_max = -0.0f;
    ASSERT(without != run_params_hash(&params));
    PASS();
}

/* Sections that another library has made are named, and the test counts as skipped, not as failed: a change of parameters may come
   long before the half an hour that the page takes. */
TEST the_page_is_of_this_library(void)
{
    char now[PAPER_STAMP];
    char *page = read_whole_file("docs/results.md");
    int sections = 0, older = 0;
    ASSERT(page);
    paper_stamp(now);
    ASSERT(now[0]);
    for (const char *end = strstr(page, "\n<!-- end of "); end; end = strstr(end + 1, "\n<!-- end of ")) {
        char part[40] = "", stamp[PAPER_STAMP];
        ASSERT_EQ(1, sscanf(end, "\n<!-- end of %39[a-z0-9] -->", part));
        char *section = section_of(page, part);
        ASSERT(section && paper_section_stamp(section, stamp));
        if (strcmp(stamp, now) != 0) {
            printf("docs/results.md: %s is older than the library\n", part);
            ++older;
        }
        free(section);
        ++sections;
    }
    free(page);
    ASSERT(sections > 0);
    if (older > 0) {
        SKIPm("sections of docs/results.md are older than the library: make paper PAPER=stale");
    }
    PASS();
}

/* The page is its text with its sections: an edit of one without the other shows. */
TEST the_page_has_its_text(void)
{
    char *page = read_whole_file("docs/results.md"), *text = read_whole_file("tests/bench/paper_page.md");
    ASSERT(page && text);
    char *made = paper_page(text, section_of, page);
    ASSERT(made);
    ASSERT_STR_EQ(made, page);
    free(made);
    free(text);
    free(page);
    PASS();
}

/* Copies the n-th cell of a row of a table, without blanks around it. */
static void copy_cell(const char *row, int n, char cell[100])
{
    const char *line_end = row + strcspn(row, "\n");
    for (; n > 0 && row < line_end; --n) {
        row += strcspn(row + 1, "|\n") + 1;
    }
    row += *row == '|';
    row += strspn(row, " ");
    size_t length = strcspn(row, "|\n");
    while (length > 0 && row[length - 1] == ' ') {
        --length;
    }
    snprintf(cell, 100, "%.*s", (int)length, row);
}

/* The README's three results are rows of the page: tracking, surface and volume are those of the same command. */
TEST the_readme_has_the_same_results(void)
{
    enum { README_COMMAND, README_TEST, README_TRACKING, README_SURFACE, README_VOLUME };
    static const int of_page[] = {0, 0, 4, 6, 7}; /* the columns of the page's first table */
    char *page = read_whole_file("docs/results.md"), *readme = read_whole_file("README.md");
    ASSERT(page && readme);
    const char *row = strstr(readme, "## Three results");
    int rows = 0;
    while (row && (row = strstr(row + 1, "\n| `build/")) != NULL && rows < 3) {
        char command[100], start[110];
        copy_cell(row + 1, README_COMMAND, command);
        snprintf(start, sizeof start, "\n| %s ", command);
        const char *same = strstr(page, start);
        ASSERT(same);
        for (int c = README_TRACKING; c <= README_VOLUME; ++c) {
            char ours[100], theirs[100];
            copy_cell(row + 1, c, ours);
            copy_cell(same + 1, of_page[c], theirs);
            ASSERT_STR_EQ(theirs, ours);
        }
        ++rows;
    }
    free(page);
    free(readme);
    ASSERT_EQ(3, rows);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(a_page_is_put_together);
    RUN_TEST(a_stamp_is_of_the_values);
    RUN_TEST(the_page_is_of_this_library);
    RUN_TEST(the_page_has_its_text);
    RUN_TEST(the_readme_has_the_same_results);
    GREATEST_MAIN_END();
}

#endif
