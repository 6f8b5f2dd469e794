/* gzip_writer.h - files of plain bytes, or compressed with all threads.
 *
 * Blocks are compressed on their own, each with what is before it as its dictionary, and make one gzip stream. The bytes of the
 * file depend on the data alone, not on the number of threads. */
#ifndef EXAMPLES_IMAGING_GZIP_WRITER_H
#define EXAMPLES_IMAGING_GZIP_WRITER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

struct gzip_writer {
    FILE *file;
    bool compressed;
    int reason;            /* errno of the first failure; 0: none */
    unsigned char *bytes;  /* the dictionary of the first block, then what waits to be compressed */
    unsigned char *packed; /* room for all blocks */
    size_t known, waiting; /* bytes of either */
    uint32_t sum, total;   /* of what was compressed: CRC-32, and bytes modulo 2^32 */
};

/* Opens the file; a compressed one if its name ends in ".gz". Returns false with the reason in errno. */
bool gzip_writer_open(struct gzip_writer *writer, const char *path);
void gzip_writer_put(struct gzip_writer *writer, const void *data, size_t count);
/* Writes what waits and closes the file. Returns false with the reason in errno if anything could not be written; the file is the
 * caller's to remove. */
bool gzip_writer_close(struct gzip_writer *writer);

#endif
