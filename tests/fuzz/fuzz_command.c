/* fuzz_command.c - command lines: options of every type in any order, with odd values. */
#include "fuzz.h"
#include "../../examples/common/base/cli.h"

enum { MOST_WORDS = 12, WORD = 24 };

/* Writes a word of the command line: a likely one, or any characters. */
static void any_word(fuzz_bytes *b, char word[WORD])
{
    static const char *const words[] = {
        "--flag", "--int", "--float", "--double", "--place", "--text", "--choice", "--grid", "--json", "--help", "--", "-",
        "--int=3", "--int=", "--choice=one", "--place=1,2,3", "1,2", "nan", "inf", "-1", "1e400", "0x10", "9999999999", "two",
        "--flag=1", "--params=paper", "--backend", "--threads=0", "--out"
    };
    int i, length;
    if (fuzz_choice(b, 4)) {
        snprintf(word, WORD, "%s", words[fuzz_choice(b, (int)(sizeof words / sizeof *words))]);
        return;
    }
    length = fuzz_choice(b, WORD);
    for (i = 0; i < length; i++) word[i] = (char)fuzz_byte(b);
    word[length] = '\0';
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes b = { data, size };
    struct cli_common common = cli_common_defaults();
    bool flag = false;
    int whole = 1, files = 0, words, i, k;
    float number = 0.5f, place[3] = { 0.0f, 0.0f, 0.0f };
    double fine = 0.5;
    const char *text = NULL, *choice = "one", *first = NULL, *more[4] = { NULL, NULL, NULL, NULL };
    const struct cli_option options[] = {
        { "flag", CLI_FLAG, &flag, NULL, "a flag", 0.0, 0.0, NULL },
        { "int", CLI_INT, &whole, "N", "a whole number", -5.0, 5.0, NULL },
        { "float", CLI_FLOAT, &number, "X", "a number", 0.0, 1.0, NULL },
        { "double", CLI_DOUBLE, &fine, "X", "any number", 0.0, 0.0, NULL },
        { "place", CLI_FLOAT3, place, "X,Y,Z", "a place", -10.0, 10.0, NULL },
        { "text", CLI_STRING, &text, "TEXT", "a text", 0.0, 0.0, NULL },
        { "choice", CLI_CHOICE, &choice, NULL, "one or two", 0.0, 0.0, "one|two" },
    };
    const struct cli_positional positionals[] = {
        { "FIRST", &first, "what is needed", true },
        { "MORE", more, "what is not", false },
    };
    const struct cli_rule rules[] = {
        { "flag+text=a", NULL, NULL },
        { "int", "float|MORE=b", "flag|FIRST|MORE|float|place" },
        { "choice=two", NULL, "FIRST|text" },
    };
    const struct cli_program program = { .name = "fuzz", .summary = "takes any command line", .common = &common,
                                         .options = options, .option_count = 7, .positionals = positionals, .positional_count = 2,
                                         .repeated = &files, .max_repeated = 4, .without = "backend|out",
                                         .rules = rules, .rule_count = 3 };
    char word[MOST_WORDS][WORD], name[] = "fuzz", *argv[MOST_WORDS + 2];
    int status;
    argv[0] = name;
    for (words = 0; words < MOST_WORDS && b.left; words++) {
        any_word(&b, word[words]);
        argv[words + 1] = word[words];
    }
    argv[words + 1] = NULL;
    status = cli_parse(&program, words + 1, argv);
    FUZZ_CHECK(status == CLI_CONTINUE || status == CLI_EXIT_OK || status == CLI_EXIT_USAGE);
    if (status != CLI_CONTINUE) return 0;
    FUZZ_CHECK(first && files >= 0 && files <= 4 && fine - fine == 0.0);
    FUZZ_CHECK(whole >= -5 && whole <= 5 && number >= 0.0f && number <= 1.0f);
    FUZZ_CHECK(strcmp(choice, "one") == 0 || strcmp(choice, "two") == 0);
    for (k = 0; k < 3; k++) FUZZ_CHECK(place[k] >= -10.0f && place[k] <= 10.0f);
    for (i = 0; i < files; i++) FUZZ_CHECK(more[i]);
    return 0;
}
