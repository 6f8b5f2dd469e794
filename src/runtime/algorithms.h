/* algorithms.h - sorts, joins and hashes plain numbers. */
#ifndef SPRINGLS__RUNTIME_ALGORITHMS_H
#define SPRINGLS__RUNTIME_ALGORITHMS_H

#include "base.h"

/* Compares two ints for qsort. */
SPRINGLS__FN int springls__compare_int(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

/* Sorts keys ascending, in place, in time proportional to their number: by radix exchange from the highest bit in use, and by
   insertion where at most 16 are left. */
SPRINGLS__FN void springls__sort_keys(uint64_t *keys, size_t count)
{
    struct { size_t first, end; int bit; } range[65];
    int depth = 1;
    size_t i, j;
    uint64_t any = 0;
    for (i = 0; i < count; ++i) any |= keys[i];
    range[0].first = 0;
    range[0].end = count;
    for (range[0].bit = -1; any; any >>= 1) ++range[0].bit;
    while (depth > 0) {
        size_t first = range[--depth].first, end = range[depth].end;
        int bit = range[depth].bit;
        while (bit >= 0 && end - first > 16) {
            i = first;
            j = end;
            while (i < j) {
                uint64_t key = keys[i];
                if (!(key >> bit & 1)) { ++i; continue; }
                keys[i] = keys[--j];
                keys[j] = key;
            }
            --bit;
            range[depth].first = i;
            range[depth].end = end;
            range[depth++].bit = bit;
            end = i;
        }
        if (bit < 0) continue;
        for (i = first + 1; i < end; ++i) {
            uint64_t key = keys[i];
            for (j = i; j > first && keys[j - 1] > key; --j) keys[j] = keys[j - 1];
            keys[j] = key;
        }
    }
}

/* Returns the first of `count` elements whose number is at least `sought`, or count; numbers ascend. number: that of the first
   element; stride: bytes from one element to the next. */
SPRINGLS__FN int springls__lower_bound(const void *number, size_t stride, int count, uint32_t sought)
{
    int low = 0, high = count;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (*(const uint32_t *)(const void *)((const char *)number + (size_t)middle * stride) < sought) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* Returns the root of i's tree in a forest, and shortens the paths on the way. */
SPRINGLS__FN int32_t springls__find_root(int32_t *parent, int32_t i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* Joins two trees of a forest; the lower root stays a root. Returns false if they are one tree already. */
SPRINGLS__FN bool springls__join_trees(int32_t *parent, int32_t a, int32_t b)
{
    a = springls__find_root(parent, a);
    b = springls__find_root(parent, b);
    if (a < b) parent[b] = a;
    else parent[a] = b;
    return a != b;
}

#define SPRINGLS__HASH_BEGIN 14695981039346656037u /* a hash of nothing (FNV-1a, 64 bits) */

/* Continues a hash over an array of 32-bit words (FNV-1a). */
SPRINGLS__FN uint64_t springls__hash(uint64_t hash, const void *data, size_t bytes)
{
    const unsigned char *p = (const unsigned char *)data;
    size_t i;
    for (i = 0; i + 4 <= bytes; i += 4) {
        uint32_t word;
        memcpy(&word, p + i, 4);
        hash = (hash ^ word) * 1099511628211u;
    }
    return hash;
}

/* Returns a hash of three words, for tables whose size is a power of two. */
SPRINGLS__FN size_t springls__hash3(uint32_t a, uint32_t b, uint32_t c)
{
    uint64_t h = ((uint64_t)a << 32 | b) * 0x9E3779B97F4A7C15u;
    h ^= h >> 29;
    h = (h ^ c) * 0xBF58476D1CE4E5B9u;
    h ^= h >> 32;
    return (size_t)h;
}

/* Returns the size of a hash table for that many entries: a power of two. */
SPRINGLS__FN size_t springls__table_size(size_t entries)
{
    size_t size = 16;
    while (size < 2 * entries) size *= 2;
    return size;
}

#endif
