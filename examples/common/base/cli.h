/* cli.h - command lines of the example programs, described by a table.
 *
 *   struct cli_common common = cli_common_defaults();
 *   double period = 3.0;
 *   const struct cli_option options[] = {
 *       {.name = "period", .type = CLI_DOUBLE, .destination = &period, .value = "T",
 *        .help = "period of the flow", .minimum = 0.01, .maximum = 100.0},
 *   };
 *   const struct cli_program program = {.name = "leveque", .summary = "...", .common = &common,
 *                                       .options = options, .option_count = 1};
 *   int status = cli_parse(&program, argc, argv);
 *   if (status != CLI_CONTINUE) return status;
 *
 * Accepted: `--name value`, `--name=value`, flags without a value, `--` (everything after it is positional). Numbers
 * must be the whole token, finite and in range. A value may begin with '-' (negative numbers, "-" for stdout). */
#ifndef EXAMPLES_BASE_CLI_H
#define EXAMPLES_BASE_CLI_H

#include <stdarg.h>
#include <stdbool.h>

enum cli_type {
    CLI_FLAG,   /* bool *          no value: sets true */
    CLI_INT,    /* int *           decimal integer */
    CLI_FLOAT,  /* float * */
    CLI_DOUBLE, /* double * */
    CLI_FLOAT3, /* float[3]        "x,y,z" in one token; the range holds for each */
    CLI_STRING, /* const char **   points into argv; an empty string is refused */
    CLI_OUTPUT, /* const char **   the same for a file that is written, "-" for standard output */
    CLI_RESULT, /* const char **   the same for an output that may replace an input */
    CLI_CHOICE  /* const char **   one of `choices`, "a|b|c"; points into argv */
};

struct cli_option {
    const char *name; /* without the two dashes */
    enum cli_type type;
    void *destination; /* of the type listed above; its value at the start is the default shown by --help, if in range */
    const char *value; /* placeholder in the help text, for example "N"; may be NULL */
    const char *help;  /* one line */
    double minimum;    /* the range counts only where minimum < maximum */
    double maximum;
    const char *choices; /* CLI_CHOICE only */
};

struct cli_positional {
    const char *name; /* shown in the usage line */
    const char **destination;
    const char *help;
    bool required; /* required ones come first */
};

/* The options that every program has. */
struct cli_common {
    int grid;            /* --grid N: voxels along the longest side; 0 = the program's choice */
    const char *params;  /* --params paper|default */
    const char *backend; /* --backend scalar|opencl */
    int threads;         /* --threads K; 0 = as many as the machine offers */
    const char *json;    /* --json FILE, "-" = standard output; NULL = none */
    const char *out;     /* --out DIR for pictures and meshes; NULL = none */
    bool quiet;          /* --quiet */
};

/* A rule that refuses arguments without effect, in one line on stderr. It applies if all arguments of `given` are given. Then, with
 * `only`, any argument besides those of `given` and `only` is refused; with `needs`, one of its arguments has to be given too; with
 * neither, those of `given` exclude each other. An argument is the name of an option, or of a positional (in capitals); "name=end"
 * stands for it only where its value ends in `end`. */
struct cli_rule {
    const char *given; /* "a+b" */
    const char *needs; /* "a|b", or NULL */
    const char *only;  /* "a|b", or NULL */
};

/* Files that a program writes into the folder of --out, if all arguments of `with` and none of `without` are given. */
struct cli_writes {
    const char *files;   /* patterns, see file_fits */
    const char *with;    /* "a+b", as in a rule; NULL: none */
    const char *without; /* "a|b"; NULL: none */
};

struct cli_program {
    const char *name;
    const char *summary;
    struct cli_common *common; /* NULL = no common options but --help */
    const struct cli_option *options;
    int option_count;
    const struct cli_positional *positionals;
    int positional_count;
    int *repeated;     /* not NULL: the last positional may be given `max_repeated` times, into an array */
    int max_repeated; /* *repeated, 0 at the start, becomes the number given */
    const char *without; /* common options that the program does not have, "a|b"; NULL: it has all */
    const struct cli_rule *rules;
    int rule_count;
    const struct cli_writes *writes;
    int writes_count;
};

enum { CLI_CONTINUE = -1, CLI_EXIT_OK = 0, CLI_EXIT_FAILURE = 1, CLI_EXIT_USAGE = 2 };

struct cli_common cli_common_defaults(void);

/* Parses the command line. Returns CLI_CONTINUE, or the status for main to return: CLI_EXIT_OK after --help (usage on stdout),
 * CLI_EXIT_USAGE after one line on stderr, when some destinations may already be written. An output that would overwrite a file named
 * by another argument is refused too, or a result another output, or an output that has a folder in its place. From then on a write
 * beyond the limit of a file's size fails, and exit() fails with a line on stderr when standard output could not be written. */
int cli_parse(const struct cli_program *program, int argc, char **argv);

/* Sets --grid to `standard` where it is not given. Returns CLI_CONTINUE, or CLI_EXIT_USAGE after one line on stderr when it is out of
 * the program's range. */
int cli_grid(const char *name, struct cli_common *common, int standard, int least, int most);

/* Prints "name: message" as one line on stderr and returns `status`, so that main can `return cli_fail(...)`. */
int cli_fail(const char *name, int status, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;

/* Prints the same line for wrappers with a fixed program name; returns false, so that callers can return it. */
bool cli_failed(const char *name, const char *format, va_list arguments);

/* Prints that a file cannot be written, with the reason in errno; returns false. */
bool cli_write_failed(const char *name, const char *path);

/* Returns false if --quiet was given or --json goes to standard output. */
bool cli_may_print(const struct cli_common *common);

/* Read a number strictly: the whole text, finite, no blanks. */
bool cli_read_double(const char *text, double *value);
bool cli_read_int(const char *text, int *value);

#endif
