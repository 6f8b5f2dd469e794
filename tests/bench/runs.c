#define _DEFAULT_SOURCE /* wait4 */
#include "runs.h"

#include "examples/common/base/progress.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { PATH_SIZE = 400, MAX_WORDS = 400, MAX_AT_ONCE = 16 };

static void write_words(char *text, size_t size, const char *format, va_list arguments)
{
    if (vsnprintf(text, size, format, arguments) >= (int)size) {
        fprintf(stderr, "too long: %s\n", text);
        exit(1);
    }
}

void run_name(struct run *run, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_words(run->name, sizeof run->name, format, arguments);
    va_end(arguments);
}

void run_command(struct run *run, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_words(run->command, sizeof run->command, format, arguments);
    va_end(arguments);
}

void run_add(struct run *run, const char *format, ...)
{
    const size_t used = strlen(run->command);
    va_list arguments;
    va_start(arguments, format);
    if (used + 2 < sizeof run->command) {
        memcpy(run->command + used, " ", 2);
        write_words(run->command + used + 1, sizeof run->command - used - 1, format, arguments);
    }
    va_end(arguments);
}

const char *run_word(const char *text, char *word, size_t size)
{
    size_t used = 0;
    for (; *text && used + 3 < size; ++text) {
        if (*text == ' ' || *text == '\\') {
            word[used++] = '\\';
        }
        word[used++] = *text;
    }
    word[used] = '\0';
    return word;
}

/* Cuts the next word off, in place; NULL: no more. */
static char *next_word(char **text)
{
    char *word = *text + strspn(*text, " "), *to = word, *from = word;
    if (*word == '\0') {
        return NULL;
    }
    while (*from && *from != ' ') {
        from += *from == '\\' && from[1];
        *to++ = *from++;
    }
    *text = *from ? from + 1 : from;
    *to = '\0';
    return word;
}

bool make_folder(const char *path)
{
    char part[PATH_SIZE];
    snprintf(part, sizeof part, "%s", path);
    for (char *slash = part; slash;) {
        slash = strchr(slash + 1, '/');
        if (slash) {
            *slash = '\0';
        }
        if (mkdir(part, 0777) != 0 && errno != EEXIST) {
            return false;
        }
        if (slash) {
            *slash = '/';
        }
    }
    return true;
}

char *read_whole_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    size_t size = 0, room = 1 << 16;
    char *text = file ? malloc(room) : NULL;
    while (text) {
        size += fread(text + size, 1, room - size - 1, file);
        if (feof(file) || ferror(file)) {
            text[size] = '\0';
            break;
        }
        char *larger = realloc(text, room *= 2);
        if (!larger) {
            free(text);
        }
        text = larger;
    }
    if (file) {
        fclose(file);
    }
    return text;
}

static void file_of(const struct run *run, const struct run_options *options, const char *ending, char path[PATH_SIZE])
{
    snprintf(path, PATH_SIZE, "%s/%s%s", options->folder, run->name, ending);
}

/* ---- starting and waiting ---- */

/* Returns whether the file is of the same command, and the program not younger than the result. */
static bool is_kept(const struct run *run, const struct run_options *options)
{
    char path[PATH_SIZE], program[RUN_COMMAND];
    struct stat of_result, of_program;
    if (!options->keep) {
        return false;
    }
    file_of(run, options, ".command", path);
    char *before = read_whole_file(path);
    const bool same = before && strcmp(before, run->command) == 0;
    free(before);
    file_of(run, options, ".json", path);
    snprintf(program, sizeof program, "%.*s", (int)strcspn(run->command, " "), run->command);
    return same && stat(path, &of_result) == 0 && stat(program, &of_program) == 0
           && of_result.st_mtime >= of_program.st_mtime && of_result.st_size > 0;
}

static void become(const struct run *run, const struct run_options *options)
{
    char path[PATH_SIZE], words[RUN_COMMAND];
    char *argv[MAX_WORDS + 1];
    int count = 0;
    memcpy(words, run->command, sizeof words);
    char *rest = words;
    for (char *word = next_word(&rest); word && count < MAX_WORDS; word = next_word(&rest)) {
        argv[count++] = word;
    }
    argv[count] = NULL;
    file_of(run, options, ".json", path);
    const int out = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    file_of(run, options, ".log", path);
    const int log = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (out < 0 || log < 0 || dup2(out, 1) < 0 || dup2(log, 2) < 0) {
        _exit(126);
    }
    execvp(argv[0], argv);
    fprintf(stderr, "cannot start %s: %s\n", argv[0], strerror(errno));
    _exit(127);
}

static bool note_command(const struct run *run, const struct run_options *options)
{
    char path[PATH_SIZE];
    file_of(run, options, ".command", path);
    FILE *file = fopen(path, "w");
    const bool good = file && fputs(run->command, file) >= 0;
    return file && fclose(file) == 0 && good;
}

static void finish(struct run *run, const struct run_options *options, int status, int *failures)
{
    char path[PATH_SIZE];
    file_of(run, options, ".json", path);
    run->exit_status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    if (status == 0) {
        run->json = read_whole_file(path);
    } else {
        remove(path); /* not to be kept */
    }
    if (!run->json || run->json[strspn(run->json, " \n")] != '{') {
        free(run->json);
        run->json = NULL;
        ++*failures;
        fprintf(stderr, "failed: %s\n        see %s/%s.log\n", run->command, options->folder, run->name);
    } else if (options->label && run->wall > 0.0) {
        fprintf(stderr, "  %s: %s, %.1f s\n", options->label, run->name, run->wall);
    }
}

int runs_do(struct run *runs, int count, const struct run_options *options)
{
    pid_t children[MAX_AT_ONCE];
    int which[MAX_AT_ONCE], running = 0, next = 0, failures = 0;
    const int wanted = options->at_once > 0 ? options->at_once : (int)sysconf(_SC_NPROCESSORS_ONLN);
    const int at_once = wanted < 1 ? 1 : wanted > MAX_AT_ONCE ? MAX_AT_ONCE : wanted;
    if (!make_folder(options->folder)) {
        fprintf(stderr, "cannot make the folder %s\n", options->folder);
        return count;
    }
    while (next < count || running > 0) {
        if (next < count && running < at_once) {
            struct run *run = &runs[next++];
            free(run->json);
            run->json = NULL;
            run->wall = run->cpu = 0.0;
            if (is_kept(run, options)) {
                finish(run, options, 0, &failures);
                continue;
            }
            fflush(NULL);
            run->wall = -elapsed_seconds();
            const pid_t child = note_command(run, options) ? fork() : -1;
            if (child == 0) {
                become(run, options);
            } else if (child < 0) {
                finish(run, options, -1, &failures);
            } else {
                children[running] = child;
                which[running++] = next - 1;
            }
            continue;
        }
        struct rusage usage;
        int status;
        const pid_t ended = wait4(-1, &status, 0, &usage);
        for (int i = 0; i < running; ++i) {
            if (children[i] == ended) {
                struct run *run = &runs[which[i]];
                run->wall += elapsed_seconds();
                run->cpu = (double)usage.ru_utime.tv_sec + (double)usage.ru_stime.tv_sec
                           + 1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
                finish(run, options, status, &failures);
                children[i] = children[--running];
                which[i] = which[running];
                break;
            }
        }
    }
    return failures;
}

void runs_free(struct run *runs, int count)
{
    for (int i = 0; i < count; ++i) {
        free(runs[i].json);
        runs[i].json = NULL;
    }
}

void runs_json(const struct run *runs, int count, struct json_writer *json)
{
    json_object_begin(json, "runs");
    for (int i = 0; i < count; ++i) {
        json_ready(json, runs[i].name, runs[i].json);
    }
    json_object_end(json);
}

/* ---- reading ---- */

static const char *skip_text(const char *at) /* from the opening quote to behind the closing one */
{
    for (++at; *at && *at != '"'; ++at) {
        at += *at == '\\' && at[1];
    }
    return *at ? at + 1 : at;
}

/* The value of `key` (length characters) in the object that begins at `object`, or NULL. */
static const char *member(const char *object, const char *key, size_t length)
{
    int depth = 0;
    for (const char *at = object; *at;) {
        if (*at == '"') {
            const char *end = skip_text(at);
            const char *after = end + strspn(end, " \t\r\n");
            if (depth == 1 && *after == ':' && (size_t)(end - at) == length + 2 && strncmp(at + 1, key, length) == 0) {
                return after + 1 + strspn(after + 1, " \t\r\n");
            }
            at = end;
            continue;
        }
        depth += (*at == '{' || *at == '[') - (*at == '}' || *at == ']');
        if (depth == 0 && (*at == '}' || *at == ']')) {
            return NULL;
        }
        ++at;
    }
    return NULL;
}

static const char *value_of(const struct run *run, const char *key)
{
    const char *at = run->json ? run->json + strspn(run->json, " \t\r\n") : NULL;
    while (at && *at == '{') {
        const size_t length = strcspn(key, ".");
        at = member(at, key, length);
        if (key[length] == '\0') {
            return at;
        }
        key += length + 1;
    }
    return NULL;
}

double run_number(const struct run *run, const char *key)
{
    const char *at = value_of(run, key);
    char *end;
    if (at && (strncmp(at, "true", 4) == 0 || strncmp(at, "false", 5) == 0)) {
        return *at == 't';
    }
    const double number = at ? strtod(at, &end) : NAN;
    return at && end != at ? number : NAN;
}

int run_numbers(const struct run *run, const char *key, double *values, int most)
{
    const char *at = value_of(run, key);
    int count = 0;
    for (at = at && *at == '[' ? at + 1 : NULL; at && count < most; ++count) {
        char *end;
        at += strspn(at, " \t\r\n");
        values[count] = strncmp(at, "null", 4) == 0 ? NAN : strtod(at, &end);
        if (isfinite(values[count]) && end == at) {
            break;
        }
        at += strcspn(at, ",]");
        at = *at == ',' ? at + 1 : NULL;
    }
    return count;
}

bool run_text(const struct run *run, const char *key, char *text, size_t size)
{
    const char *at = value_of(run, key);
    text[0] = '\0';
    if (!at || *at != '"') {
        return false;
    }
    snprintf(text, size, "%.*s", (int)(skip_text(at) - at - 2), at + 1);
    return true;
}

bool csv_read(const char *path, struct csv *csv)
{
    memset(csv, 0, sizeof *csv);
    char *text = read_whole_file(path), *line = text;
    for (int row = -1; line && *line; ++row) {
        char *end = line + strcspn(line, "\n"), *cell = line;
        const bool last = *end == '\0';
        *end = '\0';
        if (row >= 0 && line[0] == '\0') {
            break;
        }
        if (row >= 0 && (row & (row - 1)) == 0) { /* room for twice as many */
            double *larger = realloc(csv->values, sizeof(double) * (size_t)(2 * row + 1) * (size_t)csv->columns);
            if (!larger) {
                break;
            }
            csv->values = larger;
        }
        for (int column = 0; cell && column < 40 && (row < 0 || column < csv->columns); ++column) {
            const size_t length = strcspn(cell, ",\r");
            if (row < 0) {
                snprintf(csv->names[column], sizeof csv->names[column], "%.*s", (int)length, cell);
                csv->columns = column + 1;
            } else {
                char *behind;
                const double number = strtod(cell, &behind);
                csv->values[row * csv->columns + column] = behind == cell ? NAN : number;
            }
            cell = cell[length] == ',' ? cell + length + 1 : NULL;
        }
        csv->rows = row + 1;
        line = last ? end : end + 1;
    }
    free(text);
    return csv->rows > 0;
}

int csv_column(const struct csv *csv, const char *name)
{
    for (int i = 0; i < csv->columns; ++i) {
        if (strcmp(csv->names[i], name) == 0) {
            return i;
        }
    }
    return -1;
}

double csv_at(const struct csv *csv, int row, int column)
{
    return column < 0 ? NAN : csv->values[row * csv->columns + column];
}

void csv_free(struct csv *csv)
{
    free(csv->values);
    memset(csv, 0, sizeof *csv);
}
