/* imaging_page.c - make imaging's page, with the pictures of all steps, and its report. */
#include "imaging.h"

#include "examples/common/base/page.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PAGE_PATH = 300 };

static void show_table(struct page *page, const struct table *table)
{
    page_table_begin(page);
    for (int r = 0; r < table->rows; ++r) {
        const char *cells[TABLE_COLUMNS];
        for (int c = 0; c < table->columns; ++c) {
            cells[c] = table->cells[r][c];
        }
        page_row(page, r == 0, cells, table->columns);
    }
    page_table_end(page);
}

/* What the program said last: one line. */
static void last_line(const struct run *run, char *line, size_t size)
{
    char path[PAGE_PATH];
    snprintf(path, sizeof path, "%s/runs/%s.log", imaging_folder, run->name);
    char *text = read_whole_file(path), *end = text ? text + strlen(text) : NULL;
    while (end && end > text && end[-1] == '\n') {
        *--end = '\0';
    }
    const char *begin = text ? strrchr(text, '\n') : NULL;
    snprintf(line, size, "%s", begin ? begin + 1 : text ? text : "");
    free(text);
}

static void show_failure(struct page *page, const struct run *run)
{
    char line[400], text[500];
    last_line(run, line, sizeof line);
    snprintf(text, sizeof text, "Failed (exit status %d): %s", run->exit_status, line);
    page_failure(page, text);
}

static void show_pictures(struct page *page, const struct run *run, enum imaging_kind kind)
{
    char path[2 * PAGE_PATH], source[PAGE_PATH];
    for (int p = 0; p < IMAGING_PICTURES && imaging_sections[kind].pictures[p].file; ++p) {
        snprintf(source, sizeof source, "%s/%s", run->name, imaging_sections[kind].pictures[p].file);
        snprintf(path, sizeof path, "%s/%s", imaging_folder, source);
        if (access(path, R_OK) == 0) {
            page_picture(page, source, imaging_sections[kind].pictures[p].caption);
        }
    }
}

static void show_section(struct page *page, const struct imaging *imaging, enum imaging_kind kind)
{
    static struct table table;
    int here = 0;
    for (int s = 0; s < imaging->count; ++s) {
        here += imaging->steps[s].kind == kind;
    }
    if (here == 0) {
        return;
    }
    page_heading(page, 2, imaging_sections[kind].heading);
    page_text(page, imaging_sections[kind].text);
    imaging_table(imaging, kind, &table);
    if (table.rows > 1) {
        show_table(page, &table);
    }
    for (int s = 0; s < imaging->count; ++s) {
        const struct run *run = &imaging->runs[s];
        if (imaging->steps[s].kind == kind) {
            page_heading(page, 3, imaging->steps[s].title);
            page_code(page, run->command);
            if (run->json) {
                show_pictures(page, run, kind);
            } else {
                show_failure(page, run);
            }
        }
    }
}

static void file_path(const char *name, char path[PAGE_PATH])
{
    snprintf(path, PAGE_PATH, "%s/%s", imaging_folder, name);
}

bool imaging_write_page(const struct imaging *imaging)
{
    struct page page;
    char path[PAGE_PATH], text[200];
    file_path("index.html", path);
    if (!page_open(&page, path, "springls: an imaging pipeline")) {
        return false;
    }
    page_text(&page, imaging->about);
    if (imaging->failures > 0) {
        snprintf(text, sizeof text, "%d of %d steps failed.", imaging->failures, imaging->count);
        page_failure(&page, text);
    }
    for (enum imaging_kind kind = IMAGING_SEGMENT; kind < IMAGING_KINDS; ++kind) {
        show_section(&page, imaging, kind);
    }
    show_section(&page, imaging, IMAGING_PREPARE);
    return page_close(&page);
}

bool imaging_write_report(const struct imaging *imaging)
{
    static struct table table;
    struct json_writer json;
    char path[PAGE_PATH], line[400];
    file_path("report.json", path);
    if (!json_open(&json, path)) {
        return false;
    }
    json_object_begin(&json, NULL);
    json_string(&json, "program", "imaging");
    json_string(&json, "data", imaging->about);
    json_integer(&json, "failures", imaging->failures);
    json_array_begin(&json, "steps");
    for (int s = 0; s < imaging->count; ++s) {
        const struct run *run = &imaging->runs[s];
        json_object_begin(&json, NULL);
        json_string(&json, "name", run->name);
        json_string(&json, "title", imaging->steps[s].title);
        json_string(&json, "command", run->command);
        json_integer(&json, "exit_status", run->exit_status);
        json_number(&json, "wall_seconds", run->wall);
        json_ready(&json, "report", run->json);
        if (!run->json) {
            last_line(run, line, sizeof line);
            json_string(&json, "said", line);
        }
        json_object_end(&json);
    }
    json_array_end(&json);
    json_array_begin(&json, "tables");
    for (enum imaging_kind kind = IMAGING_SEGMENT; kind < IMAGING_KINDS; ++kind) {
        imaging_table(imaging, kind, &table);
        if (table.rows > 1) {
            table_json(&table, &json, imaging_sections[kind].heading);
        }
    }
    json_array_end(&json);
    json_object_end(&json);
    return json_close(&json);
}
