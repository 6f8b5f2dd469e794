/* greatest.h - a test harness in one header, with the macro names that users of greatest know.
   Written anew for this project from the documented interface of those macros; it has none of greatest's code.

     #include "greatest.h"

     TEST two_and_two(void) { ASSERT_EQ(4, 2 + 2); PASS(); }
     TEST starts_with(int x) { ASSERTm("x is even", x % 2 == 0); PASS(); }

     SUITE(arithmetic) { RUN_TEST(two_and_two); RUN_TESTp(starts_with, 4); }

     GREATEST_MAIN_DEFS();
     int main(int argc, char **argv)
     {
         GREATEST_MAIN_BEGIN();
         RUN_SUITE(arithmetic);
         GREATEST_MAIN_END();
     }

   A test returns PASS(), FAIL() or SKIP(); so do helpers of the same return type, called by CHECK_CALL(helper(x)).
   A failed ASSERT... leaves its test at once. Its arguments may be evaluated twice: give them no side effects.
   Run with -h for the command line. Exit status 0 when nothing failed. The last line is "Pass: N, fail: N, skip: N." */
#ifndef GREATEST_H
#define GREATEST_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#if defined(__GNUC__)
#define GREATEST__FN __attribute__((unused)) static
#else
#define GREATEST__FN static
#endif

/* ---- state: one for the program, defined by GREATEST_MAIN_DEFS ---- */

typedef enum greatest_test_res { GREATEST_TEST_RES_PASS, GREATEST_TEST_RES_FAIL, GREATEST_TEST_RES_SKIP } greatest_test_res;
typedef void greatest_setup_cb(void *user);

typedef struct greatest_run_info {
    unsigned passed, failed, skipped, assertions;
    /* command line */
    int verbosity, first_fail, list_only, exact;
    const char *suite_filter, *test_filter, *test_exclude;
    /* the test that runs: why it did not pass, and where */
    const char *message, *file;
    int line;
    char suffix[64];
    const char *suite;
    int column; /* of the dots */
    clock_t begin, test_begin;
    greatest_setup_cb *setup, *teardown;
    void *setup_user, *teardown_user;
} greatest_run_info;

extern greatest_run_info greatest_info;

#define GREATEST_MAIN_DEFS() greatest_run_info greatest_info

/* ---- what tests are written with ---- */

#define TEST static greatest_test_res
#define SUITE(name) static void name(void)
#define SUITE_EXTERN(name) void name(void)

#define GREATEST__END(result, text) \
    do { \
        greatest_info.message = (text); \
        greatest_info.file = __FILE__; \
        greatest_info.line = __LINE__; \
        return (result); \
    } while (0)

#define PASS() GREATEST__END(GREATEST_TEST_RES_PASS, NULL)
#define PASSm(message) GREATEST__END(GREATEST_TEST_RES_PASS, message)
#define FAIL() GREATEST__END(GREATEST_TEST_RES_FAIL, "FAIL")
#define FAILm(message) GREATEST__END(GREATEST_TEST_RES_FAIL, message)
#define SKIP() GREATEST__END(GREATEST_TEST_RES_SKIP, NULL)
#define SKIPm(message) GREATEST__END(GREATEST_TEST_RES_SKIP, message)

#define ASSERTm(message, condition) \
    do { \
        greatest_info.assertions++; \
        if (!(condition)) FAILm(message); \
    } while (0)

/* Prints what was expected and what came before it fails. */
#define GREATEST__COMPARE(message, condition, report) \
    do { \
        greatest_info.assertions++; \
        if (!(condition)) { \
            greatest__new_line(); \
            report; \
            FAILm(message); \
        } \
    } while (0)

#define ASSERT(condition) ASSERTm(#condition, condition)
#define ASSERT_FALSEm(message, condition) ASSERTm(message, !(condition))
#define ASSERT_FALSE(condition) ASSERT_FALSEm("!(" #condition ")", condition)

#define ASSERT_EQm(message, expected, got) ASSERTm(message, (expected) == (got))
#define ASSERT_NEQm(message, expected, got) ASSERTm(message, (expected) != (got))
#define ASSERT_GTm(message, expected, got) ASSERTm(message, (expected) > (got))
#define ASSERT_GTEm(message, expected, got) ASSERTm(message, (expected) >= (got))
#define ASSERT_LTm(message, expected, got) ASSERTm(message, (expected) < (got))
#define ASSERT_LTEm(message, expected, got) ASSERTm(message, (expected) <= (got))
#define ASSERT_EQ(expected, got) ASSERT_EQm(#expected " == " #got, expected, got)
#define ASSERT_NEQ(expected, got) ASSERT_NEQm(#expected " != " #got, expected, got)
#define ASSERT_GT(expected, got) ASSERT_GTm(#expected " > " #got, expected, got)
#define ASSERT_GTE(expected, got) ASSERT_GTEm(#expected " >= " #got, expected, got)
#define ASSERT_LT(expected, got) ASSERT_LTm(#expected " < " #got, expected, got)
#define ASSERT_LTE(expected, got) ASSERT_LTEm(#expected " <= " #got, expected, got)

/* As ASSERT_EQ, and prints both values by a printf format such as "%d". */
#define ASSERT_EQ_FMTm(message, expected, got, format) \
    GREATEST__COMPARE(message, (expected) == (got), \
                      printf("  expected " format ", got " format "\n", expected, got))
#define ASSERT_EQ_FMT(expected, got, format) ASSERT_EQ_FMTm(#expected " == " #got, expected, got, format)

/* |expected - got| <= tolerance. NaN is in no range. */
#define ASSERT_IN_RANGEm(message, expected, got, tolerance) \
    GREATEST__COMPARE(message, greatest__in_range((double)(expected), (double)(got), (double)(tolerance)), \
                      printf("  expected %.9g +- %.3g, got %.9g\n", (double)(expected), (double)(tolerance), (double)(got)))
#define ASSERT_IN_RANGE(expected, got, tolerance) \
    ASSERT_IN_RANGEm(#got " is " #expected " +- " #tolerance, expected, got, tolerance)

#define ASSERT_STR_EQm(message, expected, got) \
    GREATEST__COMPARE(message, strcmp(expected, got) == 0, printf("  expected \"%s\",\n       got \"%s\"\n", expected, got))
#define ASSERT_STR_EQ(expected, got) ASSERT_STR_EQm(#expected " equals " #got, expected, got)
#define ASSERT_STRN_EQm(message, expected, got, size) \
    GREATEST__COMPARE(message, strncmp(expected, got, size) == 0, \
                      printf("  expected \"%.*s\",\n       got \"%.*s\"\n", (int)(size), expected, (int)(size), got))
#define ASSERT_STRN_EQ(expected, got, size) ASSERT_STRN_EQm(#expected " begins as " #got, expected, got, size)

#define ASSERT_MEM_EQm(message, expected, got, size) \
    GREATEST__COMPARE(message, memcmp(expected, got, size) == 0, greatest__memory_differs(expected, got, size))
#define ASSERT_MEM_EQ(expected, got, size) ASSERT_MEM_EQm(#expected " has the bytes of " #got, expected, got, size)

#define ASSERT_ENUM_EQm(message, expected, got, name_of) \
    GREATEST__COMPARE(message, (expected) == (got), \
                      printf("  expected %s, got %s\n", name_of(expected), name_of(got)))
#define ASSERT_ENUM_EQ(expected, got, name_of) ASSERT_ENUM_EQm(#expected " == " #got, expected, got, name_of)

/* Leaves this test with the result of a helper, unless it passed. */
#define CHECK_CALL(call) \
    do { \
        greatest_test_res greatest__result = (call); \
        if (greatest__result != GREATEST_TEST_RES_PASS) return greatest__result; \
    } while (0)

/* ---- what tests are run with ---- */

#define GREATEST__RUN(test, call) \
    do { \
        if (greatest__begin_test(#test)) greatest__end_test(#test, call); \
    } while (0)

#define RUN_TEST(test) GREATEST__RUN(test, test())
#define RUN_TEST1(test, environment) GREATEST__RUN(test, test(environment))
#define RUN_TESTp(test, ...) GREATEST__RUN(test, test(__VA_ARGS__))
#define RUN_SUITE(suite) greatest__run_suite(suite, #suite)

/* Called before and after every test of the suite; a suite begins with none. */
#define SET_SETUP(callback, user) (greatest_info.setup = (callback), greatest_info.setup_user = (user))
#define SET_TEARDOWN(callback, user) (greatest_info.teardown = (callback), greatest_info.teardown_user = (user))

#define GREATEST_MAIN_BEGIN() greatest__parse(argc, argv)
#define GREATEST_MAIN_END() return greatest__report()
#define GREATEST_PRINT_REPORT() ((void)greatest__report())
#define GREATEST_IS_VERBOSE() (greatest_info.verbosity > 0)

#define GREATEST_TEST TEST
#define GREATEST_SUITE SUITE
#define GREATEST_SUITE_EXTERN SUITE_EXTERN
#define GREATEST_RUN_TEST RUN_TEST
#define GREATEST_RUN_TEST1 RUN_TEST1
#define GREATEST_RUN_TESTp RUN_TESTp
#define GREATEST_RUN_SUITE RUN_SUITE
#define GREATEST_ASSERT ASSERT
#define GREATEST_ASSERTm ASSERTm
#define GREATEST_ASSERT_EQ ASSERT_EQ
#define GREATEST_PASS PASS
#define GREATEST_FAIL FAIL
#define GREATEST_FAILm FAILm
#define GREATEST_SKIP SKIP
#define GREATEST_SKIPm SKIPm
#define GREATEST_CHECK_CALL CHECK_CALL
#define GREATEST_SET_SETUP_CB SET_SETUP
#define GREATEST_SET_TEARDOWN_CB SET_TEARDOWN

/* ---- the works ---- */

/* Names the next RUN_TEST's test NAME_suffix: for one test run with several parameters. */
GREATEST__FN void greatest_set_test_suffix(const char *suffix)
{
    greatest_info.suffix[0] = 0;
    strncat(greatest_info.suffix, suffix, sizeof greatest_info.suffix - 1);
}

GREATEST__FN void greatest__new_line(void)
{
    if (greatest_info.column) putchar('\n');
    greatest_info.column = 0;
}

GREATEST__FN int greatest__in_range(double expected, double got, double tolerance)
{
    return expected - got <= tolerance && got - expected <= tolerance;
}

GREATEST__FN void greatest__memory_differs(const void *expected, const void *got, size_t size)
{
    const unsigned char *a = (const unsigned char *)expected, *b = (const unsigned char *)got;
    size_t i, different = 0, first = size;
    for (i = 0; i < size; i++) {
        if (a[i] == b[i]) continue;
        if (first == size) first = i;
        different++;
    }
    printf("  %lu of %lu bytes differ, first byte %lu: expected %02x, got %02x\n", (unsigned long)different,
           (unsigned long)size, (unsigned long)first, (unsigned)a[first], (unsigned)b[first]);
}

GREATEST__FN void greatest__full_name(const char *name, char *out, size_t size)
{
    snprintf(out, size, "%s%s%s", name, greatest_info.suffix[0] ? "_" : "", greatest_info.suffix);
}

GREATEST__FN int greatest__matches(const char *name, const char *filter)
{
    return greatest_info.exact ? strcmp(name, filter) == 0 : strstr(name, filter) != NULL;
}

GREATEST__FN int greatest__begin_test(const char *test)
{
    greatest_run_info *g = &greatest_info;
    char name[256];
    greatest__full_name(test, name, sizeof name);
    if ((g->first_fail && g->failed) || (g->test_filter && !greatest__matches(name, g->test_filter))
        || (g->test_exclude && greatest__matches(name, g->test_exclude))) {
        g->suffix[0] = 0;
        return 0;
    }
    if (g->list_only) {
        printf("  %s\n", name);
        g->suffix[0] = 0;
        return 0;
    }
    if (g->verbosity > 1) printf("RUN  %s\n", name);
    fflush(stdout); /* should the test crash, what was printed before it is still seen */
    g->message = NULL;
    if (g->setup) g->setup(g->setup_user);
    g->test_begin = clock();
    return 1;
}

GREATEST__FN void greatest__end_test(const char *test, greatest_test_res result)
{
    greatest_run_info *g = &greatest_info;
    double seconds = (double)(clock() - g->test_begin) / CLOCKS_PER_SEC;
    const char *why = g->message ? g->message : "";
    char name[256];
    greatest__full_name(test, name, sizeof name);
    if (g->teardown) g->teardown(g->teardown_user);
    if (result == GREATEST_TEST_RES_FAIL) {
        g->failed++;
        greatest__new_line();
        printf("FAIL %s: %s (%s:%d)\n", name, why, g->file, g->line);
    } else {
        int skipped = result == GREATEST_TEST_RES_SKIP;
        if (skipped) g->skipped++;
        else g->passed++;
        if (g->verbosity || (skipped && *why)) {
            greatest__new_line();
            printf("%s %s%s%s (%.2f s)\n", skipped ? "SKIP" : "PASS", name, *why ? ": " : "", why, seconds);
        } else {
            putchar(skipped ? 's' : '.');
            if (++g->column == 80) greatest__new_line();
        }
    }
    g->suffix[0] = 0;
}

GREATEST__FN void greatest__run_suite(void (*suite)(void), const char *name)
{
    greatest_run_info *g = &greatest_info;
    if (g->suite_filter && !greatest__matches(name, g->suite_filter)) return;
    if (g->first_fail && g->failed) return;
    g->setup = g->teardown = NULL;
    greatest__new_line();
    printf("* Suite %s:\n", name);
    g->suite = name;
    suite();
    greatest__new_line();
    g->setup = g->teardown = NULL;
}

GREATEST__FN void greatest__usage(const char *program, FILE *out)
{
    fprintf(out,
            "usage: %s [options]\n"
            "  -t TEXT   only tests with TEXT in their name    -x TEXT   no tests with TEXT in their name\n"
            "  -s TEXT   only suites with TEXT in their name   -e        TEXT must be the whole name\n"
            "  -f        stop at the first failure             -l        list the tests, run none\n"
            "  -v        a line for each test (-v -v: also before it begins)   -h   this text\n",
            program);
}

GREATEST__FN void greatest__parse(int argc, char **argv)
{
    greatest_run_info *g = &greatest_info;
    int i;
    memset(g, 0, sizeof *g);
    for (i = 1; i < argc; i++) {
        const char *option = argv[i];
        const char **text = strcmp(option, "-t") == 0   ? &g->test_filter
                            : strcmp(option, "-x") == 0 ? &g->test_exclude
                            : strcmp(option, "-s") == 0 ? &g->suite_filter
                                                        : NULL;
        if (text && i + 1 < argc) *text = argv[++i];
        else if (strcmp(option, "-v") == 0) g->verbosity++;
        else if (strcmp(option, "-f") == 0) g->first_fail = 1;
        else if (strcmp(option, "-l") == 0) g->list_only = 1;
        else if (strcmp(option, "-e") == 0) g->exact = 1;
        else if (strcmp(option, "-h") == 0 || strcmp(option, "--help") == 0) {
            greatest__usage(argv[0], stdout);
            exit(EXIT_SUCCESS);
        } else {
            fprintf(stderr, "%s: %s is no option, or its text is missing\n", argv[0], option);
            greatest__usage(argv[0], stderr);
            exit(2);
        }
    }
    g->begin = clock();
}

GREATEST__FN int greatest__report(void)
{
    greatest_run_info *g = &greatest_info;
    unsigned total = g->passed + g->failed + g->skipped;
    greatest__new_line();
    if (!g->list_only)
        printf("Total: %u test%s (%.2f s), %u assertion%s\nPass: %u, fail: %u, skip: %u.\n", total, total == 1 ? "" : "s",
               (double)(clock() - g->begin) / CLOCKS_PER_SEC, g->assertions, g->assertions == 1 ? "" : "s", g->passed,
               g->failed, g->skipped);
    return g->failed ? EXIT_FAILURE : EXIT_SUCCESS;
}

#endif
