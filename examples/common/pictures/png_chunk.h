/* png_chunk.h - the chunks that a PNG file consists of. Uses zlib. */
#ifndef EXAMPLES_PICTURES_PNG_CHUNK_H
#define EXAMPLES_PICTURES_PNG_CHUNK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* Stores a number in four bytes, the highest first. */
void png_put32(unsigned char *out, uint32_t value);

bool png_write_signature(FILE *file);

/* Writes a chunk: length, name, data, CRC of name and data (PNG specification, section 5.3). */
bool png_write_chunk(FILE *file, const char *name, const unsigned char *data, size_t length);

#endif
