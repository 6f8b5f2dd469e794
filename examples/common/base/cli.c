#include "base/cli.h"

#include <ctype.h>
#include <errno.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COMMON_COUNT 7

struct cli_common cli_common_defaults(void)
{
    struct cli_common common = {0, "default", "scalar", 0, NULL, NULL, false};
    return common;
}

/* Writes the options that every program has; returns how many. */
static int common_options(const struct cli_program *program, struct cli_option out[COMMON_COUNT])
{
    struct cli_common *c = program->common;
    if (!c) {
        return 0;
    }
    const struct cli_option all[COMMON_COUNT] = {
        {"grid", CLI_INT, &c->grid, "N", "grid cells along the longest side (0: the program's choice)", 0.0, 4096.0,
         NULL},
        {"params", CLI_CHOICE, &c->params, NULL, "parameter set", 0.0, 0.0, "paper|default"},
        {"backend", CLI_CHOICE, &c->backend, NULL, "where the stages run; without OpenCL: scalar", 0.0, 0.0, "scalar|opencl"},
        {"threads", CLI_INT, &c->threads, "K", "threads (0: all of the machine)", 0.0, 1024.0, NULL},
        {"json", CLI_STRING, &c->json, "FILE", "write the results as JSON; - is standard output", 0.0, 0.0, NULL},
        {"out", CLI_STRING, &c->out, "DIR", "write pictures and meshes into this folder", 0.0, 0.0, NULL},
        {"quiet", CLI_FLAG, &c->quiet, NULL, "no progress bar, no remarks", 0.0, 0.0, NULL},
    };
    memcpy(out, all, sizeof all);
    return COMMON_COUNT;
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
    const int reason = errno;
    return cli_fail(name, CLI_EXIT_FAILURE, "%s: cannot be written: %s", path,
                    reason ? strerror(reason) : "no reason given") == CLI_CONTINUE;
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

static bool is_choice(const char *choices, const char *text)
{
    const size_t length = strlen(text);
    for (const char *c = choices; c; c = strchr(c, '|') ? strchr(c, '|') + 1 : NULL) {
        if (length > 0 && strncmp(c, text, length) == 0 && (c[length] == '|' || c[length] == '\0')) {
            return true;
        }
    }
    return false;
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
        if (!is_choice(option->choices, text) || strchr(text, '|')) {
            return bad_value(program, option, text, option->choices);
        }
        *(const char **)option->destination = text;
        return CLI_CONTINUE;
    case CLI_STRING:
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

static void print_usage(const struct cli_program *program, const struct cli_option *common, int common_count)
{
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
    for (int i = 0; i < program->option_count; ++i) {
        print_option(&program->options[i]);
    }
    for (int i = 0; i < common_count; ++i) {
        print_option(&common[i]);
    }
    printf("  %-28s %s\n", "--help", "show this text");
}

static const struct cli_option *find_option(const struct cli_option *options, int count, const char *name,
                                            size_t length)
{
    for (int i = 0; i < count; ++i) {
        if (strlen(options[i].name) == length && strncmp(options[i].name, name, length) == 0) {
            return &options[i];
        }
    }
    return NULL;
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

/* Stores the next positional argument, of which `*count` were stored before. */
static int take_positional(const struct cli_program *program, const char *token, int *count)
{
    const int last = program->positional_count - 1;
    const bool repeats = program->repeated && *count >= last;
    if (repeats ? *program->repeated == program->max_repeated : *count > last) {
        return cli_fail(program->name, CLI_EXIT_USAGE, "unexpected argument '%s' (see --help)", token);
    }
    if (repeats) {
        program->positionals[last].destination[(*program->repeated)++] = token;
        *count = program->positional_count;
    } else {
        *program->positionals[(*count)++].destination = token;
    }
    return CLI_CONTINUE;
}

/* Stores the option of argv[*i], "--name", "--name=value" or "--name" and the next word, to which *i then points. */
static int take_option(const struct cli_program *program, const struct cli_option *common, int common_count, int argc,
                       char **argv, int *i)
{
    const char *token = argv[*i], *name = token + 2;
    const size_t length = token[1] == '-' ? strcspn(name, "=") : 0;
    const struct cli_option *option = length ? find_option(program->options, program->option_count, name, length) : NULL;
    if (!option && length) {
        option = find_option(common, common_count, name, length);
    }
    if (!option) {
        return cli_fail(program->name, CLI_EXIT_USAGE, "unknown option '%s' (see --help)", token);
    }
    const char *value = name[length] == '=' ? name + length + 1 : NULL;
    if (option->type == CLI_FLAG && value) {
        return cli_fail(program->name, CLI_EXIT_USAGE, "--%s takes no value", option->name);
    }
    if (option->type != CLI_FLAG && !value) {
        if (*i + 1 >= argc) {
            return cli_fail(program->name, CLI_EXIT_USAGE, "--%s needs a value", option->name);
        }
        value = argv[++*i];
    }
    return store(program, option, value);
}

/* Ends the program as failed if what it has printed did not all arrive, as on a full disk. */
static void check_output(void)
{
    if (fflush(stdout) != 0 || ferror(stdout)) {
        perror("standard output");
        fflush(stderr);
        _Exit(CLI_EXIT_FAILURE);
    }
}

static void check_output_at_exit(void)
{
    static bool registered;
    registered = registered || atexit(check_output) == 0;
}

int cli_parse(const struct cli_program *program, int argc, char **argv)
{
    check_output_at_exit();
    struct cli_option common[COMMON_COUNT];
    const int common_count = common_options(program, common);
    int positionals = 0, status = CLI_CONTINUE;
    bool options_over = false;
    if (wants_help(argc, argv)) {
        print_usage(program, common, common_count);
        return CLI_EXIT_OK;
    }
    for (int i = 1; i < argc && status == CLI_CONTINUE; ++i) {
        const char *token = argv[i];
        if (!options_over && strcmp(token, "--") == 0) {
            options_over = true;
        } else if (options_over || token[0] != '-' || token[1] == '\0') {
            status = take_positional(program, token, &positionals);
        } else {
            status = take_option(program, common, common_count, argc, argv, &i);
        }
    }
    if (status == CLI_CONTINUE && positionals < program->positional_count && program->positionals[positionals].required) {
        return cli_fail(program->name, CLI_EXIT_USAGE, "missing argument %s (see --help)",
                        program->positionals[positionals].name);
    }
    return status;
}
