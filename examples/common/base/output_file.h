/* output_file.h - a file that keeps its old content until all of the new is written, where its folder takes new files. */
#ifndef EXAMPLES_BASE_OUTPUT_FILE_H
#define EXAMPLES_BASE_OUTPUT_FILE_H

#include <stdbool.h>
#include <stdio.h>

enum { OUTPUT_FILE_PATH = 4096 };

struct output_file {
    FILE *file;
    char place[OUTPUT_FILE_PATH]; /* what is replaced; "": the file is new, or a device or a pipe */
    char path[OUTPUT_FILE_PATH];  /* what is written: beside the place, or the path itself */
};

/* Opens it for bytes; false with the reason in errno. */
bool output_file_open(struct output_file *output, const char *path);

/* Closes it, and puts it in its place. Where `good` is false or that fails, what was written is removed: false with the reason in
 * errno. */
bool output_file_close(struct output_file *output, bool good);

#endif
