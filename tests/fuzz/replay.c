/* replay.c - a fuzzer as a test: runs its seeds, and random inputs that are the same everywhere; or the files that are its
   arguments. A failed check ends the program. FUZZ_NAME: the fuzzer. */
#define _POSIX_C_SOURCE 200809L
#include "fuzz.h"
#include <dirent.h>

GREATEST_MAIN_DEFS();

enum { LONGEST = 1 << 20, RANDOM_INPUTS = 40, RANDOM_BYTES = 400 };

/* Runs a file; returns whether it could be read. */
static int run_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    uint8_t *bytes = (uint8_t *)malloc(LONGEST);
    size_t size;
    if (!file || !bytes) return 0;
    size = fread(bytes, 1, LONGEST, file);
    fclose(file);
    LLVMFuzzerTestOneInput(bytes, size);
    free(bytes);
    return 1;
}

TEST seeds_pass(void)
{
    static const char folder[] = "tests/fuzz/seeds/" FUZZ_NAME;
    struct dirent *entry;
    DIR *dir = opendir(folder);
    char path[512];
    int runs = 0;
    ASSERTm("run in the folder of the Makefile", dir);
    while ((entry = readdir(dir)) != NULL) {
        if (entry->d_name[0] == '.') continue;
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        ASSERT(run_file(path));
        runs++;
    }
    closedir(dir);
    ASSERT_GT(runs, 0);
    PASS();
}

TEST random_inputs_pass(void)
{
    uint8_t bytes[RANDOM_BYTES];
    int i, k;
    fixture_seed(18);
    for (i = 0; i < RANDOM_INPUTS; i++) {
        for (k = 0; k < RANDOM_BYTES; k++) bytes[k] = (uint8_t)fixture_bits();
        ASSERT_EQ(0, LLVMFuzzerTestOneInput(bytes, (size_t)(RANDOM_BYTES * (i + 1) / RANDOM_INPUTS)));
    }
    PASS();
}

int main(int argc, char **argv)
{
    int i;
    if (argc > 1 && argv[1][0] != '-') {
        for (i = 1; i < argc; i++)
            if (!run_file(argv[i])) return EXIT_FAILURE;
        return EXIT_SUCCESS;
    }
    GREATEST_MAIN_BEGIN();
    RUN_TEST(seeds_pass);
    RUN_TEST(random_inputs_pass);
    GREATEST_MAIN_END();
}
