/* fuzz_file.h - the bytes of an input as a file, for readers that take a path. */
#ifndef FUZZ_FILE_H
#define FUZZ_FILE_H

#include "fuzz.h"
#include <unistd.h>

/* Writes the bytes to a file of this process whose name ends as given, in memory where there is a file system for that. */
FIXTURE void fuzz_file_write(char path[256], const char *extension, const uint8_t *data, size_t size)
{
    const char *folder = getenv("TMPDIR");
    FILE *file;
    if (!folder || strlen(folder) >= 128) folder = access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp";
    snprintf(path, 256, "%s/springls-fuzz-%ld%s", folder, (long)getpid(), extension);
    file = fopen(path, "wb");
    FUZZ_CHECK(file && fwrite(data, 1, size, file) == size);
    fclose(file);
}

/* Checks that a reader that failed has given its reason in one line. */
FIXTURE void fuzz_check_reason(const char *error) { FUZZ_CHECK(strlen(error) > 5 && !strchr(error, '\n')); }

#endif
