/* dirty_memory.h - the allocator of the tests: memory is nonsense until it is written, and again when it is given back, so that
   what reads either does not pass by luck. Two patterns take turns, so that two models that should be equal find different
   nonsense. C99 and C++.
   -DTEST_MEMORY_UNFILLED leaves memory as malloc gives it, for tools that watch which bytes have been written. */
#ifndef DIRTY_MEMORY_H
#define DIRTY_MEMORY_H

#include "springls.h"

#include <stdlib.h>
#include <string.h>

#if defined(__GNUC__)
#define DIRTY __attribute__((unused)) static inline
#else
#define DIRTY static
#endif

enum { DIRTY_HEADER = 16 }; /* bytes before a block: its size; the block is aligned as malloc's */

DIRTY void dirty_fill(void *memory, size_t size, unsigned char pattern)
{
#ifdef TEST_MEMORY_UNFILLED
    (void)memory, (void)size, (void)pattern;
#else
    memset(memory, pattern, size);
#endif
}

/* Returns memory filled with the byte that `pattern` points to, or NULL. */
DIRTY void *dirty_alloc(size_t size, void *pattern)
{
    unsigned char *memory = (unsigned char *)malloc(size + DIRTY_HEADER);
    if (!memory) return NULL;
    memcpy(memory, &size, sizeof size);
    dirty_fill(memory + DIRTY_HEADER, size, *(const unsigned char *)pattern);
    return memory + DIRTY_HEADER;
}

/* Returns how many bytes a block was allocated with. */
DIRTY size_t dirty_size(const void *memory)
{
    size_t size;
    memcpy(&size, (const unsigned char *)memory - DIRTY_HEADER, sizeof size);
    return size;
}

/* Fills a block, and frees it. A size that is not the one allocated ends the program. */
DIRTY void dirty_free(void *memory, size_t size, void *pattern)
{
    if (!memory) return;
    if (size != dirty_size(memory)) abort();
    dirty_fill(memory, size, *(const unsigned char *)pattern);
    free((unsigned char *)memory - DIRTY_HEADER);
}

/* Returns the next pattern: bytes of 0x77 are large numbers, those of 0xff NaN and -1. */
DIRTY unsigned char *dirty_pattern(void)
{
    static unsigned char patterns[2] = { 0x77, 0xff };
    static unsigned turn;
    return &patterns[__atomic_fetch_add(&turn, 1u, __ATOMIC_RELAXED) & 1u]; /* contexts may be made in several threads */
}

DIRTY springls_allocator dirty_allocator(void)
{
    springls_allocator allocator;
    allocator.alloc = dirty_alloc;
    allocator.free = dirty_free;
    allocator.user = dirty_pattern();
    return allocator;
}

#endif
