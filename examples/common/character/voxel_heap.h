/* voxel_heap.h - a binary heap of voxels by key, the smallest first; a voxel's key can be lowered. */
#ifndef EXAMPLES_CHARACTER_VOXEL_HEAP_H
#define EXAMPLES_CHARACTER_VOXEL_HEAP_H

#include <stdbool.h>
#include <stdlib.h>

struct voxel_heap {
    int count;
    int *voxel; /* in heap order */
    int *at;    /* place of each voxel in the heap, -1: not in it */
    float *key; /* of each voxel */
};

static inline void voxel_heap_free(struct voxel_heap *h)
{
    free(h->voxel);
    free(h->at);
    free(h->key);
}

static inline bool voxel_heap_create(struct voxel_heap *h, int capacity)
{
    const size_t room = (size_t)capacity + 1;
    h->count = 0;
    h->voxel = malloc(room * sizeof *h->voxel);
    h->at = malloc(room * sizeof *h->at);
    h->key = malloc(room * sizeof *h->key);
    if (!h->voxel || !h->at || !h->key) {
        voxel_heap_free(h);
        return false;
    }
    for (int v = 0; v < capacity; ++v) { h->at[v] = -1; }
    return true;
}

static inline void voxel_heap_put(struct voxel_heap *h, int place, int voxel)
{
    h->voxel[place] = voxel;
    h->at[voxel] = place;
}

/* Adds a voxel, or lowers its key. Of equal keys the lower voxel is the smaller, so that results do not depend on history. */
static inline bool voxel_heap_less(const struct voxel_heap *h, int a, int b)
{
    return h->key[a] < h->key[b] || (h->key[a] <= h->key[b] && a < b);
}

static inline void voxel_heap_push(struct voxel_heap *h, int voxel, float key)
{
    int place = h->at[voxel] >= 0 ? h->at[voxel] : h->count++;
    h->key[voxel] = key;
    for (; place > 0 && voxel_heap_less(h, voxel, h->voxel[(place - 1) / 2]); place = (place - 1) / 2) {
        voxel_heap_put(h, place, h->voxel[(place - 1) / 2]);
    }
    voxel_heap_put(h, place, voxel);
}

/* Removes the smallest; returns -1 when the heap is empty. */
static inline int voxel_heap_pop(struct voxel_heap *h)
{
    if (h->count == 0) { return -1; }
    const int top = h->voxel[0], last = h->voxel[--h->count];
    int place = 0;
    h->at[top] = -1;
    for (int child = 1; child < h->count; child = 2 * place + 1) {
        child += child + 1 < h->count && voxel_heap_less(h, h->voxel[child + 1], h->voxel[child]);
        if (!voxel_heap_less(h, h->voxel[child], last)) { break; }
        voxel_heap_put(h, place, h->voxel[child]);
        place = child;
    }
    if (h->count > 0 && last != top) { voxel_heap_put(h, place, last); }
    return top;
}

#endif
