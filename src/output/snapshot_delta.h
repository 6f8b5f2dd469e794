/* snapshot_delta.h - the difference between two snapshots, for undo: what a stroke has not changed is copied from the other one. A block
   is taken as words of four bytes. Rows that are removed or added move all that follows, so equal runs are looked for at any place: by
   the hash of eight words, which every eighth place of the base is listed under.

     base       | aaaa bbbb cccc dddd eeee |         a difference is a list of parts: words that are copied from a place of the
     snapshot   | aaaa cccc XX dd eeee     |         base, then words of its own. */
#ifndef SPRINGLS__OUTPUT_SNAPSHOT_DELTA_H
#define SPRINGLS__OUTPUT_SNAPSHOT_DELTA_H

#include "snapshot_check.h"

enum {
    SPRINGLS__DELTA_HEAD_BYTES = 48,
    SPRINGLS__DELTA_PART_BYTES = 12,
    SPRINGLS__DELTA_WINDOW = 8, /* words that a hash is of                                       */
    SPRINGLS__DELTA_LEAST = 4   /* words of a copy: its part takes fewer bytes than its words    */
};

static const char springls__delta_magic[8] = { 's', 'p', 'r', 'd', 'e', 'l', 't', 'a' };

/* Two blocks, the places of the base by hash, and the difference as it grows. */
typedef struct springls__delta {
    const char *base, *block;
    size_t base_words, words;
    uint32_t *table;        /* a place of the base over WINDOW, and 1; 0: none      */
    int bits;               /* of its numbers                                       */
    char *out;              /* NULL: only the size is found                         */
    size_t size;
    size_t from, copied;    /* the part that grows: words copied from the base      */
    size_t own;             /* the first word of its own                            */
} springls__delta;

SPRINGLS__FN uint32_t springls__delta_hash(const char *words, int bits)
{
    uint32_t hash = 2166136261u;
    size_t i;
    for (i = 0; i < SPRINGLS__DELTA_WINDOW; i++) hash = (hash ^ (uint32_t)springls__int_at(words, i)) * 0x9e3779b1u;
    return (hash ^ hash >> 15) * 0x85ebca6bu >> (32 - bits);
}

/* Returns how many words agree from a place of the base and of the snapshot on. */
SPRINGLS__FN size_t springls__delta_agree(const springls__delta *d, size_t from, size_t at)
{
    size_t n = 0;
    while (from + n < d->base_words && at + n < d->words && memcmp(d->base + 4 * (from + n), d->block + 4 * (at + n), 4) == 0) n++;
    return n;
}

/* Ends the part that grows, before word `end` of the snapshot. */
SPRINGLS__FN void springls__delta_end_part(springls__delta *d, size_t end)
{
    uint32_t from = (uint32_t)d->from, copied = (uint32_t)d->copied, own = (uint32_t)(end - d->own);
    springls__coder c;
    if (d->out) {
        c = springls__writer(d->out + d->size);
        SPRINGLS__CODE(&c, from);
        SPRINGLS__CODE(&c, copied);
        SPRINGLS__CODE(&c, own);
        memcpy(c.out, d->block + 4 * d->own, 4 * (size_t)own);
    }
    d->size += SPRINGLS__DELTA_PART_BYTES + 4 * (size_t)own;
}

/* Finds words of the base that agree with those of the snapshot at `at`: *from. Returns how many, 0 when too few. Looks first where the
   words go on that were copied last. */
SPRINGLS__FN size_t springls__delta_find(const springls__delta *d, size_t at, size_t *from)
{
    size_t n;
    uint32_t place;
    *from = d->from + d->copied + (at - d->own);
    n = springls__delta_agree(d, *from, at);
    if (n >= SPRINGLS__DELTA_LEAST || at + SPRINGLS__DELTA_WINDOW > d->words) return n >= SPRINGLS__DELTA_LEAST ? n : 0;
    place = d->table[springls__delta_hash(d->block + 4 * at, d->bits)];
    if (!place) return 0;
    *from = (size_t)(place - 1u) * SPRINGLS__DELTA_WINDOW;
    n = springls__delta_agree(d, *from, at);
    return n >= SPRINGLS__DELTA_WINDOW ? n : 0;
}

/* Lists every WINDOW-th place of the base; of places with the same hash the first. */
SPRINGLS__FN void springls__delta_list_base(springls__delta *d)
{
    size_t i;
    for (i = 0; i + SPRINGLS__DELTA_WINDOW <= d->base_words; i += SPRINGLS__DELTA_WINDOW) {
        uint32_t *place = &d->table[springls__delta_hash(d->base + 4 * i, d->bits)];
        if (!*place) *place = (uint32_t)(i / SPRINGLS__DELTA_WINDOW + 1);
    }
}

/* Writes the parts of the difference. */
SPRINGLS__FN void springls__delta_parts(springls__delta *d)
{
    size_t at = 0, from, n;
    d->from = d->copied = d->own = 0;
    while (at < d->words) {
        n = springls__delta_find(d, at, &from);
        if (n == 0) {
            at++;
            continue;
        }
        while (from > 0 && at > d->own && memcmp(d->base + 4 * (from - 1), d->block + 4 * (at - 1), 4) == 0) {
            from--; /* the words before agree too */
            at--;
            n++;
        }
        springls__delta_end_part(d, at);
        d->from = from;
        d->copied = n;
        at += n;
        d->own = at;
    }
    springls__delta_end_part(d, at);
}

/* The numbers in the head of a block: its size and its checksum. */
typedef struct springls__block_name { uint64_t size, checksum; } springls__block_name;

/* Reads the head of a block. Fails when it is none, or another number of bytes. call: for the error. */
SPRINGLS__FN springls_status springls__name_block(springls_context *ctx, const char *call, const void *block, size_t size,
                                                  springls__block_name *name)
{
    springls__coder c;
    if (!block) return springls__fail_null(ctx, call, "a block");
    if (size >= SPRINGLS__HEAD_BYTES && (memcmp(block, springls__snapshot_magic, sizeof springls__snapshot_magic) == 0
                                         || memcmp(block, springls__tiling_magic, sizeof springls__tiling_magic) == 0)) {
        c = springls__reader((const char *)block + 16);
        SPRINGLS__CODE(&c, name->size);
        SPRINGLS__CODE(&c, name->checksum);
        if (name->size == size && size % 4 == 0 && size / 4 < UINT32_MAX) return SPRINGLS_OK;
    }
    return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "%s: a block is no snapshot, or cut short", call);
}

/* Writes the head of a difference, or reads it: both blocks' names. Returns whether it is one. */
SPRINGLS__FN bool springls__code_delta_head(springls__coder *c, springls__block_name *base, springls__block_name *block)
{
    char magic[8];
    uint32_t version = 1, none = 0;
    memcpy(magic, springls__delta_magic, sizeof magic);
    springls__code(c, magic, sizeof magic, 1);
    SPRINGLS__CODE(c, version);
    SPRINGLS__CODE(c, none);
    SPRINGLS__CODE(c, base->size);
    SPRINGLS__CODE(c, base->checksum);
    SPRINGLS__CODE(c, block->size);
    SPRINGLS__CODE(c, block->checksum);
    return memcmp(magic, springls__delta_magic, sizeof magic) == 0 && version == 1u;
}

/* Finds the difference, or its size only (out NULL); the table is empty. */
SPRINGLS__FN void springls__delta_write(springls__delta *d, springls__block_name *base, springls__block_name *block)
{
    springls__coder c;
    d->size = SPRINGLS__DELTA_HEAD_BYTES;
    if (d->out) {
        c = springls__writer(d->out);
        springls__code_delta_head(&c, base, block);
    }
    springls__delta_parts(d);
}

SPRINGLS__SNAPSHOTS_API springls_status springls_snapshot_delta(springls_context *ctx, const void *base, size_t base_size,
                                                                const void *snapshot, size_t snapshot_size, void *out, size_t capacity,
                                                                size_t *size)
{
    springls__block_name names[2];
    springls__delta d;
    size_t bytes;
    char *result = NULL;
    if (size) *size = 0;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!size) return springls__fail_null(ctx, "snapshot_delta", "size");
    SPRINGLS__TRY(springls__name_block(ctx, "snapshot_delta", base, base_size, &names[0]));
    SPRINGLS__TRY(springls__name_block(ctx, "snapshot_delta", snapshot, snapshot_size, &names[1]));
    memset(&d, 0, sizeof d);
    d.base = (const char *)base;
    d.block = (const char *)snapshot;
    d.base_words = base_size / 4;
    d.words = snapshot_size / 4;
    for (d.bits = 10; d.bits < 28 && (size_t)1 << d.bits < d.base_words / SPRINGLS__DELTA_WINDOW; d.bits++) continue;
    bytes = sizeof *d.table << d.bits;
    d.table = (uint32_t *)springls__allocate(ctx, bytes);
    if (!d.table) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "snapshot_delta: out of memory");
    memset(d.table, 0, bytes);
    springls__delta_list_base(&d);
    if (out && capacity >= snapshot_size + SPRINGLS__DELTA_HEAD_BYTES + SPRINGLS__DELTA_PART_BYTES) result = (char *)out;
    d.out = result;
    springls__delta_write(&d, &names[0], &names[1]);
    if (out && !result && capacity >= d.size) { /* it fits, though not whatever it had been */
        d.out = (char *)out;
        springls__delta_write(&d, &names[0], &names[1]);
    }
    springls__release(ctx, d.table, bytes);
    *size = d.size;
    if (!out || d.out) return SPRINGLS_OK;
    return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "snapshot_delta: %lu bytes are needed, not %lu", (unsigned long)d.size,
                          (unsigned long)capacity);
}

/* Makes the words of the snapshot from those of the base and of the difference. Returns false if the difference is damaged. */
SPRINGLS__FN bool springls__delta_apply(const char *base, size_t base_words, const char *delta, size_t bytes, char *out, size_t words)
{
    size_t at = 0, place = SPRINGLS__DELTA_HEAD_BYTES;
    while (place + SPRINGLS__DELTA_PART_BYTES <= bytes) {
        uint32_t from = 0, copied = 0, own = 0;
        springls__coder c = springls__reader(delta + place);
        SPRINGLS__CODE(&c, from);
        SPRINGLS__CODE(&c, copied);
        SPRINGLS__CODE(&c, own);
        place += SPRINGLS__DELTA_PART_BYTES;
        if (copied > base_words || from > base_words - copied || copied > words - at || own > words - at - copied
            || own > (bytes - place) / 4) return false;
        memcpy(out + 4 * at, base + 4 * (size_t)from, 4 * (size_t)copied);
        memcpy(out + 4 * (at + copied), delta + place, 4 * (size_t)own);
        at += (size_t)copied + own;
        place += 4 * (size_t)own;
    }
    return place == bytes && at == words;
}

SPRINGLS__SNAPSHOTS_API springls_status springls_snapshot_patch(springls_context *ctx, const void *base, size_t base_size,
                                                                const void *delta, size_t delta_size, void *out, size_t capacity,
                                                                size_t *size)
{
    springls__block_name name, from, to;
    springls__coder c;
    if (size) *size = 0;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!delta || !size) return springls__fail_null(ctx, "snapshot_patch", delta ? "size" : "the difference");
    SPRINGLS__TRY(springls__name_block(ctx, "snapshot_patch", base, base_size, &name));
    c = springls__reader((const char *)delta);
    if (delta_size < SPRINGLS__DELTA_HEAD_BYTES || !springls__code_delta_head(&c, &from, &to) || to.size % 4 != 0)
        return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "snapshot_patch: the difference is none of springls_snapshot_delta");
    if (from.size != name.size || from.checksum != name.checksum)
        return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "snapshot_patch: the difference is from another snapshot");
    if (to.size > SIZE_MAX) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "snapshot_patch: a size overflows");
    *size = (size_t)to.size;
    if (!out) return SPRINGLS_OK;
    if (capacity < *size)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "snapshot_patch: %lu bytes are needed, not %lu", (unsigned long)*size,
                              (unsigned long)capacity);
    if (springls__delta_apply((const char *)base, base_size / 4, (const char *)delta, delta_size, (char *)out, *size / 4))
        return SPRINGLS_OK;
    return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "snapshot_patch: the difference is cut short or altered");
}

#endif
