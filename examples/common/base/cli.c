#include "base/cli.h"

#include "base/same_file.h"
#include "base/write_error.h"

#include <ctype.h>
#include <errno.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COMMON_COUNT = 7, MOST_ARGUMENTS = 64 };

/* A command line that is being read. */
struct line {
    const struct cli_program *program;
    struct cli_option options[MOST_ARGUMENTS]; /* the program's, then the common ones that it has */
    int option_count, positionals;
    const char *given[MOST_ARGUMENTS]; /* values of options, then of positionals; NULL: not given */
};

struct cli_common cli_common_defaults(void)
{
    struct cli_common common = {0, "default", "scalar", 0, NULL, NULL, false};
    return common;
}

/* Returns the next term of "a|b" or "a+b", to be called until NULL. */
static const char *next_term(const char **terms, size_t *length)
{
    const char *term = *terms && **terms ? *terms : NULL;
    *length = term ? strcspn(term, "+|") : 0;
    *terms = term ? term + *length + (term[*length] != '\0') : NULL;
    return term;
}

/* Returns whether a word is one of "a|b|c"; words: NULL has none. */
static bool is_one_of(const char *words, const char *word)
{
    size_t length;
    for (const char *term; (term = next_term(&words, &length)) != NULL;) {
        if (strlen(word) == length && strncmp(word, term, length) == 0) { return true; }
    }
    return false;
}

/* Begins a line: lists the options of the program and those that every program has. */
static void list_options(const struct cli_program *program, struct line *line)
{
    memset(line, 0, sizeof *line);
    line->program = program;
    for (int i = 0; i < program->option_count; ++i) { line->options[line->option_count++] = program->options[i]; }
    struct cli_common *c = program->common;
    if (!c) { return; }
    const struct cli_option common[COMMON_COUNT] = {
        {"grid", CLI_INT, &c->grid, "N", "grid cells along the longest side (0: the program's choice)", 0.0, 4096.0,
         NULL},
        {"params", CLI_CHOICE, &c->params, NULL, "parameter set", 0.0, 0.0, "paper|default"},
        {"backend", CLI_CHOICE, &c->backend, NULL, "where the stages run; without OpenCL: scalar", 0.0, 0.0, "scalar|opencl"},
        {"threads", CLI_INT, &c->threads, "K", "threads (0: all of the machine)", 0.0, 1024.0, NULL},
        {"json", CLI_OUTPUT, &c->json, "FILE", "write the results as JSON; - is standard output", 0.0, 0.0, NULL},
        {"out", CLI_OUTPUT, &c->out, "DIR", "write pictures and meshes into this folder", 0.0, 0.0, NULL},
        {"quiet", CLI_FLAG, &c->quiet, NULL, "no progress bar, no remarks", 0.0, 0.0, NULL},
    };
    for (int i = 0; i < COMMON_COUNT; ++i) {
        if (!is_one_of(program->without, common[i].name)) { line->options[line->option_count++] = common[i]; }
    }
}

int cli_grid(const char *name, struct cli_common *common, int standard, int least, int most)
{
    const int grid = common->grid;
    common->grid = grid ? grid : standard;
    return common->grid >= least && common->grid <= most
        ? CLI_CONTINUE
        : cli_fail(name, CLI_EXIT_USAGE, "--grid %d: expected an integer from %d to %d", grid, least, most);
}

bool cli_failed(const char *name, const char *format, va_list arguments)
{
    fprintf(stderr, "%s: ", name);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    return false;
}

int cli_fail(const char *name, int status, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    cli_failed(name, format, arguments);
    va_end(arguments);
    return status;
}

bool cli_write_failed(const char *name, const char *path)
{
    cli_fail(name, CLI_EXIT_FAILURE, "%s: cannot be written: %s", path, write_reason());
    return false;
}

bool cli_may_print(const struct cli_common *common)
{
    return !common->quiet && !(common->json && strcmp(common->json, "-") == 0);
}

bool cli_read_double(const char *text, double *value)
{
    char *end = NULL;
    /* Reject what strtod would take: leading blanks, "inf", "nan" and hexadecimal floats. */
    for (const char *c = text; *c; ++c) {
        if (!isdigit((unsigned char)*c) && !strchr("+-.eE", *c)) {
            return false;
        }
    }
    const double read = strtod(text, &end);
    if (end == text || *end != '\0' || !isfinite(read)) {
        return false;
    }
    *value = read;
    return true;
}

bool cli_read_int(const char *text, int *value)
{
    char *end = NULL;
    if (!isdigit((unsigned char)*text) && *text != '-' && *text != '+') {
        return false;
    }
    errno = 0;
    const long read = strtol(text, &end, 10);
    if (end == text || *end != '\0' || errno == ERANGE || read < INT_MIN || read > INT_MAX) {
        return false;
    }
    *value = (int)read;
    return true;
}

static bool in_range(const struct cli_option *option, double value)
{
    return !(option->minimum < option->maximum) || (value >= option->minimum && value <= option->maximum);
}

static int bad_value(const struct cli_program *program, const struct cli_option *option, const char *text,
                     const char *wanted)
{
    if (option->minimum < option->maximum) {
        return cli_fail(program->name, CLI_EXIT_USAGE, "--%s %s: expected %s from %g to %g", option->name, text,
                        wanted, option->minimum, option->maximum);
    }
    return cli_fail(program->name, CLI_EXIT_USAGE, "--%s %s: expected %s", option->name, text, wanted);
}

static bool read_triple(const struct cli_option *option, const char *text, float triple[3])
{
    char token[64];
    for (int i = 0; i < 3; ++i) {
        const size_t length = strcspn(text, ",");
        double value = 0.0;
        if (length >= sizeof token || (text[length] == ',') != (i < 2)) {
            return false;
        }
        memcpy(token, text, length);
        token[length] = '\0';
        if (!cli_read_double(token, &value) || fabs(value) > FLT_MAX || !in_range(option, value)) {
            return false;
        }
        triple[i] = (float)value;
        text += length + (i < 2 ? 1 : 0);
    }
    return true;
}

static int store(const struct cli_program *program, const struct cli_option *option, const char *text)
{
    double real = 0.0;
    int integer = 0;
    float triple[3];
    switch (option->type) {
    case CLI_FLAG:
        *(bool *)option->destination = true;
        return CLI_CONTINUE;
    case CLI_INT:
        if (!cli_read_int(text, &integer) || !in_range(option, integer)) {
            return bad_value(program, option, text, "an integer");
        }
        *(int *)option->destination = integer;
        return CLI_CONTINUE;
    case CLI_FLOAT:
    case CLI_DOUBLE:
        if (!cli_read_double(text, &real) || !in_range(option, real)
            || (option->type == CLI_FLOAT && fabs(real) > FLT_MAX)) {
            return bad_value(program, option, text, "a number");
        }
        if (option->type == CLI_FLOAT) {
            *(float *)option->destination = (float)real;
        } else {
            *(double *)option->destination = real;
        }
        return CLI_CONTINUE;
    case CLI_FLOAT3:
        if (!read_triple(option, text, triple)) {
            return bad_value(program, option, text, "three numbers x,y,z");
        }
        memcpy(option->destination, triple, sizeof triple);
        return CLI_CONTINUE;
    case CLI_CHOICE:
        if (!is_one_of(option->choices, text)) {
            return bad_value(program, option, text, option->choices);
        }
        *(const char **)option->destination = text;
        return CLI_CONTINUE;
    case CLI_STRING:
    case CLI_OUTPUT:
    case CLI_RESULT:
        if (!*text) {
            return cli_fail(program->name, CLI_EXIT_USAGE, "--%s: expected a value that is not empty", option->name);
        }
        *(const char **)option->destination = text;
        return CLI_CONTINUE;
    }
    return cli_fail(program->name, CLI_EXIT_USAGE, "--%s: unknown option type", option->name);
}

/* Prints a default, but for NaN and numbers out of range: these mean that the program chooses. */
static void print_default(const struct cli_option *option, int digits, double value)
{
    if (!isnan(value) && in_range(option, value)) {
        printf(" [%.*g]", digits, value);
    }
}

static void print_option(const struct cli_option *o)
{
    char left[96];
    const char *value = o->type == CLI_FLAG ? "" : o->choices ? o->choices : o->value ? o->value : "VALUE";
    snprintf(left, sizeof left, "--%s %s", o->name, value);
    printf(strlen(left) > 28 ? "  %s\n  %-28s %s" : "  %-28s%s %s", left, "", o->help ? o->help : "");
    switch (o->type) {
    case CLI_INT:
        print_default(o, 10, (double)*(const int *)o->destination);
        break;
    case CLI_FLOAT:
        print_default(o, 6, (double)*(const float *)o->destination);
        break;
    case CLI_DOUBLE:
        print_default(o, 6, *(const double *)o->destination);
        break;
    case CLI_FLOAT3: {
        const float *v = (const float *)o->destination;
        if (!isnan(v[0])) {
            printf(" [%g,%g,%g]", (double)v[0], (double)v[1], (double)v[2]);
        }
        break;
    }
    case CLI_STRING:
    case CLI_OUTPUT:
    case CLI_RESULT:
    case CLI_CHOICE: {
        const char *text = *(const char *const *)o->destination;
        if (text) {
            printf(" [%s]", text);
        }
        break;
    }
    case CLI_FLAG:
        break;
    }
    putchar('\n');
}

static void print_usage(const struct line *line)
{
    const struct cli_program *program = line->program;
    printf("usage: %s [options]", program->name);
    for (int i = 0; i < program->positional_count; ++i) {
        const struct cli_positional *p = &program->positionals[i];
        printf(p->required ? " %s" : " [%s]", p->name);
    }
    printf("\n%s\n\n", program->summary ? program->summary : "");
    for (int i = 0; i < program->positional_count; ++i) {
        const struct cli_positional *p = &program->positionals[i];
        printf("  %-28s %s\n", p->name, p->help ? p->help : "");
    }
    for (int i = 0; i < line->option_count; ++i) {
        print_option(&line->options[i]);
    }
    printf("  %-28s %s\n", "--help", "show this text");
}

/* Returns the number of the option with this name, -1: there is none. */
static int find_option(const struct line *line, const char *name, size_t length)
{
    for (int i = 0; i < line->option_count; ++i) {
        if (strlen(line->options[i].name) == length && strncmp(line->options[i].name, name, length) == 0) {
            return i;
        }
    }
    return -1;
}

/* Looks for --help before anything else, because it takes precedence over a mistake in the line. */
static bool wants_help(int argc, char **argv)
{
    for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; ++i) {
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            return true;
        }
    }
    return false;
}

/* Stores the next positional argument. */
static int take_positional(struct line *line, const char *token)
{
    const struct cli_program *program = line->program;
    const int last = program->positional_count - 1;
    const bool repeats = program->repeated && line->positionals >= last;
    if (repeats ? *program->repeated == program->max_repeated : line->positionals > last) {
        return cli_fail(program->name, CLI_EXIT_USAGE, "unexpected argument '%s' (see --help)", token);
    }
    const int number = repeats ? last : line->positionals;
    program->positionals[number].destination[repeats ? (*program->repeated)++ : 0] = token;
    line->given[line->option_count + number] = token;
    line->positionals = number + 1;
    return CLI_CONTINUE;
}

/* Stores the option of argv[*i], "--name", "--name=value" or "--name" and the next word, to which *i then points. */
static int take_option(struct line *line, int argc, char **argv, int *i)
{
    const char *program = line->program->name, *token = argv[*i], *name = token + 2;
    const size_t length = token[1] == '-' ? strcspn(name, "=") : 0;
    const int number = length ? find_option(line, name, length) : -1;
    if (number < 0) {
        return cli_fail(program, CLI_EXIT_USAGE, "unknown option '%s' (see --help)", token);
    }
    const struct cli_option *option = &line->options[number];
    const char *value = name[length] == '=' ? name + length + 1 : NULL;
    if (option->type == CLI_FLAG && value) {
        return cli_fail(program, CLI_EXIT_USAGE, "--%s takes no value", option->name);
    }
    if (option->type != CLI_FLAG && !value) {
        if (*i + 1 >= argc) {
            return cli_fail(program, CLI_EXIT_USAGE, "--%s needs a value", option->name);
        }
        value = argv[++*i];
    }
    line->given[number] = value ? value : "";
    return store(line->program, option, value);
}

/* ---- rules ---- */

/* Returns the name of an argument: of an option, or after these of a positional. */
static const char *argument_name(const struct line *line, int number)
{
    return number < line->option_count ? line->options[number].name : line->program->positionals[number - line->option_count].name;
}

static int argument_count(const struct line *line) { return line->option_count + line->program->positional_count; }

static bool ends_with(const char *text, const char *end, size_t length)
{
    return strlen(text) >= length && strncmp(text + strlen(text) - length, end, length) == 0;
}

/* Returns the length of the name of a term, "name" or "name=end". */
static size_t name_length(const char *term, size_t length)
{
    const char *equals = memchr(term, '=', length);
    return equals ? (size_t)(equals - term) : length;
}

/* Returns whether a term, "name" or "name=end" of `length` characters, is this argument, and it is given. */
static bool term_fits(const struct line *line, const char *term, size_t length, int number)
{
    const char *name = argument_name(line, number);
    const size_t named = name_length(term, length);
    return line->given[number] && strlen(name) == named && strncmp(name, term, named) == 0
        && (named == length || ends_with(line->given[number], term + named + 1, length - named - 1));
}

/* Returns whether an argument that is given is a term of a list. */
static bool is_listed(const struct line *line, const char *terms, int number)
{
    size_t length;
    for (const char *term; (term = next_term(&terms, &length)) != NULL;) {
        if (term_fits(line, term, length, number)) { return true; }
    }
    return false;
}

/* Returns whether at least one of the terms is given, or with `all` each. */
static bool are_given(const struct line *line, const char *terms, bool all)
{
    size_t length;
    for (const char *term; (term = next_term(&terms, &length)) != NULL;) {
        bool given = false;
        for (int n = 0; n < argument_count(line); ++n) { given = given || term_fits(line, term, length, n); }
        if (given != all) { return given; }
    }
    return all;
}

/* Returns whether a term "name=end" has all of a choice as its end. */
static bool is_choice(const struct line *line, const char *term, size_t length)
{
    char end[64] = "";
    const size_t named = name_length(term, length);
    const int number = find_option(line, term, named);
    if (named < length) { snprintf(end, sizeof end, "%.*s", (int)(length - named) - 1, term + named + 1); }
    return number >= 0 && line->options[number].type == CLI_CHOICE && is_one_of(line->options[number].choices, end);
}

/* Appends a term to a text as it is typed, with a word before it: --name, --name choice, --name *end, NAME, or the end alone for
 * NAME=end. */
static void append_term(const struct line *line, char *text, size_t size, const char *word, const char *term, size_t length)
{
    const size_t used = strlen(text), named = name_length(term, length), end = length - named;
    const char *dashes = isupper((unsigned char)*term) ? "" : "--", *star = is_choice(line, term, length) ? "" : "*";
    if (end == 0) {
        snprintf(text + used, size - used, "%s%s%.*s", word, dashes, (int)named, term);
    } else if (*dashes) {
        snprintf(text + used, size - used, "%s%s%.*s %s%.*s", word, dashes, (int)named, term, star, (int)end - 1, term + named + 1);
    } else {
        snprintf(text + used, size - used, "%s%.*s", word, (int)end - 1, term + named + 1);
    }
}

/* Appends the terms of a list, with `first` before the first and `next` before the others. */
static void append_terms(const struct line *line, char *text, size_t size, const char *terms, const char *first, const char *next)
{
    size_t length;
    for (const char *term, *word = first; (term = next_term(&terms, &length)) != NULL; word = next) {
        append_term(line, text, size, word, term, length);
    }
}

/* Returns the first argument that is given and that a rule with `only` does not allow, -1: there is none. */
static int find_excluded(const struct line *line, const struct cli_rule *rule)
{
    for (int n = 0; rule->only && n < argument_count(line); ++n) {
        if (line->given[n] && !is_listed(line, rule->given, n) && !is_listed(line, rule->only, n)) { return n; }
    }
    return -1;
}

/* Refuses what has no effect by a rule. */
static int check_rule(const struct line *line, const struct cli_rule *rule)
{
    char what[64] = "", beside[256] = "";
    size_t length;
    const char *rest = rule->given, *term = next_term(&rest, &length);
    if (!are_given(line, rule->given, true)) { return CLI_CONTINUE; }
    const int excluded = find_excluded(line, rule);
    if (excluded >= 0) {
        append_term(line, what, sizeof what, "", argument_name(line, excluded), strlen(argument_name(line, excluded)));
        append_terms(line, beside, sizeof beside, rule->given, " with ", " and ");
    } else if ((rule->needs || !rule->only) && !are_given(line, rule->needs, false)) {
        append_term(line, what, sizeof what, "", term, length);
        append_terms(line, beside, sizeof beside, rest, " with ", " and ");
        append_terms(line, beside, sizeof beside, rule->needs, *rest ? " and without " : " without ", " or ");
    }
    return *what ? cli_fail(line->program->name, CLI_EXIT_USAGE, "%s has no effect%s", what, beside) : CLI_CONTINUE;
}

/* ---- outputs ---- */

static bool has_type(const struct line *line, int number, enum cli_type type)
{
    return number < line->option_count && line->options[number].type == type;
}

static bool is_output(const struct line *line, int number)
{
    return has_type(line, number, CLI_OUTPUT) || has_type(line, number, CLI_RESULT);
}

/* Returns the k-th text of an argument that may be the name of a file, NULL: there is none. */
static const char *file_name(const struct line *line, int number, int k)
{
    const struct cli_program *program = line->program;
    const int positional = number - line->option_count;
    if (!line->given[number] || (positional < 0 && !is_output(line, number) && !has_type(line, number, CLI_STRING))) {
        return NULL;
    }
    if (program->repeated && positional == program->positional_count - 1) {
        return k < *program->repeated ? program->positionals[positional].destination[k] : NULL;
    }
    return k == 0 ? line->given[number] : NULL;
}

/* Returns the patterns of the files that row w of the program's table has for an output, "": none. */
static const char *written_files(const struct line *line, int output, int w)
{
    const struct cli_writes *writes = &line->program->writes[w];
    const bool applies = strcmp(argument_name(line, output), "out") == 0 && (!writes->with || are_given(line, writes->with, true))
        && !are_given(line, writes->without, false);
    return applies ? writes->files : "";
}

/* Returns whether a file is written by an output of that value, or into the folder of --out. */
static bool is_written(const struct line *line, int output, const char *file)
{
    bool written = same_file(line->given[output], file);
    for (int w = 0; w < line->program->writes_count && !written; ++w) {
        written = file_fits(file, line->given[output], written_files(line, output, w));
    }
    return written;
}

/* Returns whether a text names a file that is written: another output, or an input that is there, as it is or between colons
 * ("mirror:labels.nii:1+2"). */
static bool is_overwritten(const struct line *line, int output, int number, const char *text)
{
    char part[1024];
    if (is_output(line, number)) {
        return strcmp(text, "-") != 0 && is_written(line, output, text);
    }
    if (has_type(line, output, CLI_RESULT)) {
        return false;
    }
    if (file_exists(text)) {
        return is_written(line, output, text);
    }
    for (size_t length; *text; text += length + (text[length] == ':')) {
        length = strcspn(text, ":");
        snprintf(part, sizeof part, "%.*s", (int)length, text);
        if (file_exists(part) && is_written(line, output, part)) { return true; }
    }
    return false;
}

/* Refuses an output that would overwrite an input or another output, or that has a folder in its place. */
static int check_output(const struct line *line, int output)
{
    const char *text;
    char path[1024];
    if (strlen(line->given[output]) >= sizeof path) {
        return cli_fail(line->program->name, CLI_EXIT_USAGE, "--%s: the path is too long", argument_name(line, output));
    }
    for (int w = 0; w < line->program->writes_count; ++w) {
        if (folder_fits(line->given[output], written_files(line, output, w), path, sizeof path)) {
            return cli_fail(line->program->name, CLI_EXIT_USAGE, "%s: cannot be written: it is a folder", path);
        }
    }
    for (int n = 0; n < argument_count(line); ++n) {
        for (int k = 0; n != output && (text = file_name(line, n, k)) != NULL; ++k) {
            if (is_overwritten(line, output, n, text)) {
                const char *name = argument_name(line, n), *dashes = n < line->option_count ? "--" : "";
                return cli_fail(line->program->name, CLI_EXIT_USAGE, "%s%s %s would be overwritten by --%s", dashes, name, text,
                                argument_name(line, output));
            }
        }
    }
    return CLI_CONTINUE;
}

static int check_outputs(const struct line *line)
{
    int status = CLI_CONTINUE;
    for (int n = 0; n < line->option_count && status == CLI_CONTINUE; ++n) {
        status = is_output(line, n) && line->given[n] && strcmp(line->given[n], "-") != 0 ? check_output(line, n) : status;
    }
    return status;
}

/* Ends the program as failed if what it has printed did not all arrive, as on a full disk. */
static void check_printed(void)
{
    if (fflush(stdout) != 0 || ferror(stdout)) {
        perror("standard output");
        fflush(stderr);
        _Exit(CLI_EXIT_FAILURE);
    }
}

static void check_printed_at_exit(void)
{
    static bool registered;
    registered = registered || atexit(check_printed) == 0;
}

/* Lets a write beyond the limit of a file's size fail, as on a full disk, where it would end the program. */
static void let_writes_fail(void)
{
#if defined(SIGXFSZ)
    signal(SIGXFSZ, SIG_IGN);
#endif
}

int cli_parse(const struct cli_program *program, int argc, char **argv)
{
    check_printed_at_exit();
    let_writes_fail();
    struct line line;
    int status = CLI_CONTINUE;
    bool options_over = false;
    if (program->option_count + COMMON_COUNT + program->positional_count > MOST_ARGUMENTS) {
        return cli_fail(program->name, CLI_EXIT_FAILURE, "more than %d options", MOST_ARGUMENTS);
    }
    list_options(program, &line);
    if (wants_help(argc, argv)) {
        print_usage(&line);
        return CLI_EXIT_OK;
    }
    for (int i = 1; i < argc && status == CLI_CONTINUE; ++i) {
        const char *token = argv[i];
        if (!options_over && strcmp(token, "--") == 0) {
            options_over = true;
        } else if (options_over || token[0] != '-' || token[1] == '\0') {
            status = take_positional(&line, token);
        } else {
            status = take_option(&line, argc, argv, &i);
        }
    }
    if (status == CLI_CONTINUE && line.positionals < program->positional_count && program->positionals[line.positionals].required) {
        return cli_fail(program->name, CLI_EXIT_USAGE, "missing argument %s (see --help)",
                        program->positionals[line.positionals].name);
    }
    for (int r = 0; r < program->rule_count && status == CLI_CONTINUE; ++r) { status = check_rule(&line, &program->rules[r]); }
    return status == CLI_CONTINUE ? check_outputs(&line) : status;
}
