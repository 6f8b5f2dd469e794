#define _POSIX_C_SOURCE 200809L

#include "viewer/script.h"

#include "base/cli.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

enum { MAX_WORDS = 5, MAX_FRAMES = 100000 };
#define FRAME_SECONDS (1.0 / 60.0)

struct run {
    struct viewer_app *app;
    viewer_show_fn show;
    void *user;
    const char *words[MAX_WORDS + 1];
    int count;
};

static bool frame(struct run *run, const char *picture)
{
    viewer_app_work(run->app, FRAME_SECONDS);
    return !run->show || run->show(run->user, picture);
}

static bool frames(struct run *run, int count)
{
    for (int i = 0; i < count && !run->app->quit; ++i) {
        if (!frame(run, NULL)) {
            return false;
        }
    }
    return true;
}

/* Runs frames until the model is at rest, up to a limit, since a pressed button may keep it busy. */
static bool rest(struct run *run)
{
    for (int i = 0; i < MAX_FRAMES && viewer_app_busy(run->app); ++i) {
        if (!frame(run, NULL)) {
            return false;
        }
    }
    return true;
}

static bool number(const char *word, double minimum, double maximum, double *value)
{
    return cli_read_double(word, value) && *value >= minimum && *value <= maximum;
}

/* Reads "shift" and "ctrl" from word `first` on. */
static bool modifiers(const struct run *run, int first, int *result)
{
    *result = 0;
    for (int i = first; i < run->count; ++i) {
        const int bit = strcmp(run->words[i], "shift") == 0 ? VIEWER_SHIFT : strcmp(run->words[i], "ctrl") == 0 ? VIEWER_CTRL : 0;
        if (!bit) {
            return false;
        }
        *result |= bit;
    }
    return true;
}

static int button(const char *word)
{
    return strcmp(word, "left") == 0     ? VIEWER_LEFT
           : strcmp(word, "right") == 0  ? VIEWER_RIGHT
           : strcmp(word, "middle") == 0 ? VIEWER_MIDDLE
                                         : -1;
}

static int key(const char *word)
{
    return strcmp(word, "enter") == 0     ? VIEWER_ENTER
           : strcmp(word, "escape") == 0  ? VIEWER_ESCAPE
           : word[0] && !word[1]          ? toupper((unsigned char)word[0])
                                          : -1;
}

static bool move(struct run *run, double x, double y, int count)
{
    const float from[2] = {run->app->pointer[0], run->app->pointer[1]};
    for (int i = 1; i <= count; ++i) {
        const float share = (float)i / (float)count;
        viewer_app_move(run->app, from[0] + share * ((float)x - from[0]), from[1] + share * ((float)y - from[1]));
        if (!frame(run, NULL)) {
            return false;
        }
    }
    return true;
}

enum result { DONE, WRONG, FAILED };

/* Executes a line. Returns DONE, WRONG for words that are no event, or FAILED when a file or the picture could not be read, written or
   shown. */
static enum result obey(struct run *run)
{
    const char *verb = run->words[0], *first = run->count > 1 ? run->words[1] : "";
    double x = 0.0, y = 0.0, n = 1.0;
    int bits = 0;
    if (strcmp(verb, "move") == 0 && (run->count == 3 || run->count == 4)) {
        const bool good = number(first, -1e5, 1e5, &x) && number(run->words[2], -1e5, 1e5, &y)
                          && (run->count == 3 || number(run->words[3], 1.0, MAX_FRAMES, &n));
        return !good ? WRONG : move(run, x, y, (int)n) ? DONE : FAILED;
    }
    if (strcmp(verb, "press") == 0 && run->count > 1 && button(first) >= 0 && modifiers(run, 2, &bits)) {
        viewer_app_button(run->app, button(first), true, bits);
        return DONE;
    }
    if (strcmp(verb, "release") == 0 && run->count == 2 && button(first) >= 0) {
        viewer_app_button(run->app, button(first), false, 0);
        return DONE;
    }
    if (strcmp(verb, "scroll") == 0 && run->count > 1 && number(first, -1000.0, 1000.0, &n) && modifiers(run, 2, &bits)) {
        viewer_app_scroll(run->app, (float)n, bits);
        return DONE;
    }
    if (strcmp(verb, "key") == 0 && run->count > 1 && key(first) >= 0 && modifiers(run, 2, &bits)) {
        run->app->save_failed = false;
        viewer_app_key(run->app, key(first), bits);
        return run->app->save_failed ? FAILED : DONE;
    }
    if (strcmp(verb, "drop") == 0 && run->count == 2) {
        return viewer_app_drop(run->app, first) ? DONE : FAILED;
    }
    if (strcmp(verb, "save") == 0 && run->count == 2) {
        return viewer_app_save(run->app, first) ? DONE : FAILED;
    }
    if (strcmp(verb, "frames") == 0 && run->count == 2 && number(first, 1.0, MAX_FRAMES, &n)) {
        return frames(run, (int)n) ? DONE : FAILED;
    }
    if (strcmp(verb, "rest") == 0 && run->count == 1) {
        return rest(run) ? DONE : FAILED;
    }
    if (strcmp(verb, "screenshot") == 0 && run->count == 2) {
        return frame(run, first) ? DONE : FAILED;
    }
    return WRONG;
}

static void cut_into_words(struct run *run, char *line, size_t length)
{
    static const char blanks[] = " \t\r\n";
    if (strlen(line) < length) {
        run->words[0] = "a byte of 0"; /* which no event is called */
        run->count = 1;
        return;
    }
    line[strcspn(line, "#")] = '\0';
    run->count = 0;
    for (char *word = strtok(line, blanks); word && run->count <= MAX_WORDS; word = strtok(NULL, blanks)) {
        run->words[run->count++] = word;
    }
}

bool viewer_script_run(const char *path, struct viewer_app *app, viewer_show_fn show, void *user, char error[VIEWER_TEXT])
{
    struct run run = {.app = app, .show = show, .user = user};
    char *line = NULL;
    size_t room = 0;
    ssize_t length;
    enum result result = DONE;
    FILE *file = fopen(path, "r");
    if (!file) {
        snprintf(error, VIEWER_TEXT, "%.200s: cannot open", path);
        return false;
    }
    for (int row = 1; result == DONE && !app->quit && (length = getline(&line, &room, file)) >= 0; ++row) {
        cut_into_words(&run, line, (size_t)length);
        result = run.count > 0 ? obey(&run) : DONE;
        if (result == WRONG) {
            snprintf(error, VIEWER_TEXT, "%.200s: line %d: no such event, or not with these arguments: %.40s", path, row,
                     run.words[0]);
        } else if (result == FAILED) {
            snprintf(error, VIEWER_TEXT, "%s", app->message);
        }
    }
    free(line);
    if (ferror(file)) {
        snprintf(error, VIEWER_TEXT, "%.200s: cannot be read", path);
        result = FAILED;
    }
    fclose(file);
    return result == DONE;
}
