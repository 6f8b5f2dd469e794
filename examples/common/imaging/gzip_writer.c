#include "imaging/gzip_writer.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { BLOCK = 1 << 20, BLOCKS = 16, DICTIONARY = 1 << 15, LEVEL = 6, RAW = -15, MEMORY = 8 };

/* A compressed block, with the few bytes that a flush adds. */
static size_t room(void) { return compressBound(BLOCK) + 64; }

static void write_bytes(struct gzip_writer *writer, const void *bytes, size_t count)
{
    if (writer->reason == 0 && fwrite(bytes, 1, count, writer->file) != count) {
        writer->reason = errno;
    }
}

static void write_word(struct gzip_writer *writer, uint32_t word)
{
    const unsigned char bytes[4] = {(unsigned char)word, (unsigned char)(word >> 8), (unsigned char)(word >> 16),
                                    (unsigned char)(word >> 24)};
    write_bytes(writer, bytes, sizeof bytes);
}

bool gzip_writer_open(struct gzip_writer *writer, const char *path)
{
    static const unsigned char head[10] = {0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 0, 3}; /* deflate, no name, no time, Unix */
    const size_t length = strlen(path);
    memset(writer, 0, sizeof *writer);
    writer->compressed = length > 3 && strcmp(path + length - 3, ".gz") == 0;
    if (writer->compressed) {
        writer->bytes = malloc(DICTIONARY + (size_t)BLOCK * BLOCKS);
        writer->packed = malloc(BLOCKS * room());
    }
    if (!writer->compressed || (writer->bytes && writer->packed)) {
        writer->file = fopen(path, "wb");
    }
    if (!writer->file) {
        free(writer->bytes);
        free(writer->packed);
        return false;
    }
    if (writer->compressed) {
        write_bytes(writer, head, sizeof head);
    }
    return true;
}

/* Compresses a block, which the dictionary lies before. Returns its length, 0 on failure. */
static size_t pack(const unsigned char *block, size_t count, size_t dictionary, bool last, unsigned char *packed)
{
    z_stream z;
    memset(&z, 0, sizeof z);
    if (deflateInit2(&z, LEVEL, Z_DEFLATED, RAW, MEMORY, Z_DEFAULT_STRATEGY) != Z_OK) {
        return 0;
    }
    if (dictionary > 0) {
        deflateSetDictionary(&z, block - dictionary, (uInt)dictionary);
    }
    z.next_in = (unsigned char *)(uintptr_t)block; /* only read */
    z.avail_in = (uInt)count;
    z.next_out = packed;
    z.avail_out = (uInt)room();
    const int code = deflate(&z, last ? Z_FINISH : Z_SYNC_FLUSH); /* a flush ends with a whole byte */
    const size_t length = room() - z.avail_out;
    deflateEnd(&z);
    return code == (last ? Z_STREAM_END : Z_OK) && z.avail_out > 0 ? length : 0;
}

/* Compresses and writes what waits. last: the stream ends with it. */
static void flush(struct gzip_writer *writer, bool last)
{
    const unsigned char *waiting = writer->bytes + DICTIONARY;
    const int blocks = writer->waiting > 0 ? (int)((writer->waiting - 1) / BLOCK + 1) : 1;
    size_t lengths[BLOCKS];
#if defined(_OPENMP)
    #pragma omp parallel for schedule(dynamic)
#endif
    for (int b = 0; b < blocks; ++b) {
        const size_t start = (size_t)b * BLOCK, rest = writer->waiting - start;
        lengths[b] = pack(waiting + start, rest < BLOCK ? rest : BLOCK, b > 0 ? DICTIONARY : writer->known, last && b == blocks - 1,
                          writer->packed + (size_t)b * room());
    }
    for (int b = 0; b < blocks; ++b) {
        if (lengths[b] == 0 && writer->reason == 0) {
            writer->reason = ENOMEM;
        }
        write_bytes(writer, writer->packed + (size_t)b * room(), lengths[b]);
    }
    writer->sum = (uint32_t)crc32(writer->sum, waiting, (uInt)writer->waiting);
    writer->total += (uint32_t)writer->waiting;
    if (!last) { /* all blocks are full */
        memcpy(writer->bytes, waiting + writer->waiting - DICTIONARY, DICTIONARY);
        writer->known = DICTIONARY;
    }
    writer->waiting = 0;
}

void gzip_writer_put(struct gzip_writer *writer, const void *data, size_t count)
{
    const unsigned char *from = data;
    if (!writer->compressed) {
        write_bytes(writer, data, count);
        return;
    }
    while (count > 0 && writer->reason == 0) {
        const size_t free_room = (size_t)BLOCK * BLOCKS - writer->waiting, part = count < free_room ? count : free_room;
        memcpy(writer->bytes + DICTIONARY + writer->waiting, from, part);
        writer->waiting += part;
        from += part;
        count -= part;
        if (writer->waiting == (size_t)BLOCK * BLOCKS) {
            flush(writer, false);
        }
    }
}

bool gzip_writer_close(struct gzip_writer *writer)
{
    if (writer->compressed) {
        flush(writer, true);
        write_word(writer, writer->sum);
        write_word(writer, writer->total);
    }
    if (fclose(writer->file) != 0 && writer->reason == 0) {
        writer->reason = errno;
    }
    free(writer->bytes);
    free(writer->packed);
    errno = writer->reason;
    return writer->reason == 0;
}
