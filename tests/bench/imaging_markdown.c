/* imaging_markdown.c - make imaging's tables as Markdown, with a few small pictures: docs/imaging-results.md. */
#include "imaging.h"

#include "examples/common/pictures/image.h"

#include <stdio.h>
#include <string.h>

enum { MARKDOWN_PATH = 300, PICTURES_SHOWN = 2, PICTURE_WIDTH = 720, PICTURE_COLORS = 64 };

/* Writes a command with the collection's folder as $SPRINGLS_DATA: a page that is kept names no folder of one machine. */
static void write_command(FILE *file, const struct imaging *imaging, const char *command)
{
    char data[MARKDOWN_PATH];
    const char *folder = imaging->settings.collection;
    run_word(folder ? folder : "", data, sizeof data);
    const size_t length = folder ? strlen(data) : 0;
    for (const char *c = command; *c;) {
        const bool here = length > 0 && strncmp(c, data, length) == 0;
        fputs(here ? "$SPRINGLS_DATA" : "", file);
        if (!here) {
            fputc(*c, file);
        }
        c += here ? length : 1;
    }
    fputc('\n', file);
}

/* Writes a small copy of a step's picture into the folder `pictures` beside the page. Returns false where the step has none. */
static bool write_picture(FILE *file, const char *folder, const struct run *run, const char *picture, const char *caption)
{
    char path[3 * MARKDOWN_PATH], name[MARKDOWN_PATH];
    struct image image = {0};
    snprintf(path, sizeof path, "%s/%s/%s", imaging_folder, run->name, picture);
    if (!run->json || !image_read_file(path, &image)) {
        return false;
    }
    snprintf(name, sizeof name, "pictures/imaging_%s_%s", run->name, picture);
    snprintf(path, sizeof path, "%spictures", folder);
    bool good = make_folder(path);
    snprintf(path, sizeof path, "%s%s", folder, name);
    good = good && image_shrink(&image, PICTURE_WIDTH) && image_write_small_png(&image, PICTURE_COLORS, path);
    image_free(&image);
    if (good) {
        fprintf(file, "\n%s\n\n![%s](%s)\n", caption, caption, name);
    }
    return good;
}

/* Each kind of picture once, of the first step that has it. */
static void write_pictures(FILE *file, const char *folder, const struct imaging *imaging, enum imaging_kind kind)
{
    const struct imaging_section *section = &imaging_sections[kind];
    for (int p = 0; p < PICTURES_SHOWN && section->pictures[p].file; ++p) {
        for (int s = 0; s < imaging->count; ++s) {
            if (imaging->steps[s].kind == kind
                && write_picture(file, folder, &imaging->runs[s], section->pictures[p].file, section->pictures[p].caption)) {
                break;
            }
        }
    }
}

static void write_section(FILE *file, const char *folder, const struct imaging *imaging, enum imaging_kind kind)
{
    static struct table table;
    imaging_table(imaging, kind, &table);
    if (table.rows < 2) {
        return;
    }
    fprintf(file, "\n## %s\n\n%s\n\n", imaging_sections[kind].heading, imaging_sections[kind].text);
    if (imaging_sections[kind].paper) {
        fprintf(file, "The paper: %s\n\n", imaging_sections[kind].paper);
    }
    table_print(&table, file);
    write_pictures(file, folder, imaging, kind);
    fputs("\n<details><summary>Commands</summary>\n\n```\n", file);
    for (int s = 0; s < imaging->count; ++s) {
        if (imaging->steps[s].kind == kind) {
            write_command(file, imaging, imaging->runs[s].command);
        }
    }
    fputs("```\n\n</details>\n", file);
}

bool imaging_write_markdown(const struct imaging *imaging, const char *path)
{
    char folder[MARKDOWN_PATH];
    const char *name = strrchr(path, '/');
    snprintf(folder, sizeof folder, "%.*s", name ? (int)(name + 1 - path) : 0, path);
    FILE *file = fopen(path, "w");
    if (!file) {
        return false;
    }
    fprintf(file, "<!-- written by: make imaging PAGE=docs/imaging-results.md -->\n\n# The imaging pipeline: results\n\n"
                  "[imaging](imaging.md) has the commands in short; [data](data.md) has where the images come from. Times are of "
                  "the machine that ran it.\n\n%s\n", imaging->about);
    for (int s = 0; s < imaging->count; ++s) {
        if (!imaging->runs[s].json && imaging->steps[s].kind != IMAGING_PREPARE) {
            fprintf(file, "\nFailed: %s (exit status %d).\n", imaging->steps[s].title, imaging->runs[s].exit_status);
        }
    }
    for (enum imaging_kind kind = IMAGING_SEGMENT; kind < IMAGING_KINDS; ++kind) {
        write_section(file, folder, imaging, kind);
    }
    const bool good = !ferror(file);
    return fclose(file) == 0 && good;
}
