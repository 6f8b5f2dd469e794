#include "pictures/png_chunk.h"

#include <string.h>
#include <zlib.h>

void png_put32(unsigned char *out, uint32_t value)
{
    for (int i = 0; i < 4; ++i) {
        out[i] = (unsigned char)(value >> (24 - 8 * i));
    }
}

bool png_write_signature(FILE *file)
{
    static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    return fwrite(signature, 1, 8, file) == 8;
}

bool png_write_chunk(FILE *file, const char *name, const unsigned char *data, size_t length)
{
    unsigned char head[8], tail[4];
    png_put32(head, (uint32_t)length);
    memcpy(head + 4, name, 4);
    uLong crc = crc32(0, head + 4, 4);
    crc = length > 0 ? crc32(crc, data, (uInt)length) : crc;
    png_put32(tail, (uint32_t)crc);
    return fwrite(head, 1, 8, file) == 8 && fwrite(data, 1, length, file) == length && fwrite(tail, 1, 4, file) == 4;
}
