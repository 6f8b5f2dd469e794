#include "character/medial_tree.h"

#include "character/voxel_heap.h"

#include <math.h>
#include <string.h>

static int deepest(const struct solid *solid)
{
    int best = 0;
    for (int n = 1; n < solid->count; ++n) { best = solid->depth[n] > solid->depth[best] ? n : best; }
    return best;
}

/* Returns the farthest voxel of those that are not near the tree, -1: none. */
static int farthest(const struct solid *solid, const float *distance, const bool *near)
{
    int best = -1;
    for (int n = 0; n < solid->count; ++n) {
        if (!near[n] && isfinite(distance[n]) && (best < 0 || distance[n] > distance[best])) { best = n; }
    }
    return best;
}

struct build {
    const struct solid *solid;
    struct medial_tree *tree;
    float *distance; /* from the first tip */
    float *centered; /* cost from the first tip; later what is left of the reach of the tree at each voxel */
    bool *near;
    int *added;
    struct voxel_heap heap;
};

/* Marks what is nearer to the new voxels of the tree than their depth and some more. */
static void mark_near(struct build *b, int count, float margin)
{
    float *left = b->centered;
    for (int n = 0; n < b->solid->count; ++n) { left[n] = 0.0f; }
    for (int i = 0; i < count; ++i) {
        left[b->added[i]] = 1.25f * b->solid->depth[b->added[i]] + margin;
        voxel_heap_push(&b->heap, b->added[i], -left[b->added[i]]);
    }
    for (int at; (at = voxel_heap_pop(&b->heap)) >= 0;) {
        int neighbors[26];
        const int around = solid_neighbors(b->solid, at, neighbors);
        b->near[at] = true;
        for (int k = 0; k < around; ++k) {
            const float there = left[at] - solid_step(b->solid, at, neighbors[k]);
            if (there > left[neighbors[k]]) {
                left[neighbors[k]] = there;
                voxel_heap_push(&b->heap, neighbors[k], -there);
            }
        }
    }
}

/* Adds the path from a tip to the tree. Returns by how much it stands out of the branch that it leaves. */
static float add_branch(struct build *b, int tip, const int *way, float margin)
{
    struct medial_tree *tree = b->tree;
    int count = 0, at = tip;
    float length = 0.0f;
    for (; at >= 0 && tree->along[at] < 0.0f; at = way[at]) {
        b->added[count++] = at;
        tree->before[at] = way[at];
        length += way[at] >= 0 ? solid_step(b->solid, at, way[at]) : 0.0f;
    }
    const float from = at >= 0 ? tree->along[at] : 0.0f, out = at >= 0 ? length - b->solid->depth[at] : length;
    float along = from + length;
    for (int i = 0; i < count; ++i) {
        tree->along[b->added[i]] = along;
        along -= tree->before[b->added[i]] >= 0 ? solid_step(b->solid, b->added[i], tree->before[b->added[i]]) : 0.0f;
    }
    mark_near(b, count, margin);
    return out;
}

/* Keeps the longest branches, in order of their lengths. */
static void add_tip(struct medial_tree *tree, int tip, float length)
{
    int place = tree->tip_count < MEDIAL_TIPS ? tree->tip_count++ : MEDIAL_TIPS;
    for (; place > 0 && tree->length[place - 1] < length; --place) {
        if (place < MEDIAL_TIPS) {
            tree->tip[place] = tree->tip[place - 1];
            tree->length[place] = tree->length[place - 1];
        }
    }
    if (place < MEDIAL_TIPS) {
        tree->tip[place] = tip;
        tree->length[place] = length;
    }
}

static void grow(struct build *b, int first, const int *way, float shortest)
{
    const float margin = 0.5f * shortest;
    add_branch(b, first, way, margin);
    for (int tip; (tip = farthest(b->solid, b->distance, b->near)) >= 0;) {
        const float out = add_branch(b, tip, way, margin);
        if (b->tree->tip_count == 0) { /* the first branch has two ends */
            add_tip(b->tree, first, out);
        }
        if (out >= shortest) { add_tip(b->tree, tip, out); }
    }
}

bool medial_tree_create(const struct solid *solid, float shortest, struct medial_tree *tree)
{
    const size_t count = (size_t)solid->count + 1;
    struct build b = {.solid = solid, .tree = tree};
    int *way = malloc(count * sizeof *way);
    memset(tree, 0, sizeof *tree);
    tree->before = malloc(count * sizeof *tree->before);
    tree->along = malloc(count * sizeof *tree->along);
    b.distance = malloc(count * sizeof *b.distance);
    b.centered = malloc(count * sizeof *b.centered);
    b.near = calloc(count, sizeof *b.near);
    b.added = malloc(count * sizeof *b.added);
    const bool heap = voxel_heap_create(&b.heap, solid->count);
    int first = deepest(solid);
    bool good = way && tree->before && tree->along && b.distance && b.centered && b.near && b.added && heap
        && solid_distances(solid, &first, 1, false, b.distance, NULL);
    if (good) {
        first = farthest(solid, b.distance, b.near);
        good = solid_distances(solid, &first, 1, false, b.distance, NULL)
            && solid_distances(solid, &first, 1, true, b.centered, way);
    }
    if (good) {
        for (int n = 0; n < solid->count; ++n) {
            tree->before[n] = -1;
            tree->along[n] = -1.0f;
        }
        grow(&b, first, way, shortest);
    }
    free(way);
    free(b.distance);
    free(b.centered);
    free(b.near);
    free(b.added);
    if (heap) { voxel_heap_free(&b.heap); }
    if (!good) { medial_tree_free(tree); }
    return good;
}

void medial_tree_free(struct medial_tree *tree)
{
    free(tree->before);
    free(tree->along);
    memset(tree, 0, sizeof *tree);
}

int medial_tree_meet(const struct medial_tree *tree, int a, int b)
{
    while (a != b) {
        int *far = tree->along[a] >= tree->along[b] ? &a : &b;
        *far = tree->before[*far];
    }
    return a;
}

float medial_tree_distance(const struct medial_tree *tree, int a, int b)
{
    return tree->along[a] + tree->along[b] - 2.0f * tree->along[medial_tree_meet(tree, a, b)];
}

int medial_tree_path(const struct medial_tree *tree, int a, int b, int *path, int room)
{
    const int meet = medial_tree_meet(tree, a, b);
    int count = 0, back = 0;
    for (int at = a; count < room; at = tree->before[at]) {
        path[count++] = at;
        if (at == meet) { break; }
    }
    for (int at = b; at != meet; at = tree->before[at]) { ++back; }
    int last = count + back;
    for (int at = b; at != meet; at = tree->before[at]) {
        if (--last < room) { path[last] = at; }
    }
    return count + back < room ? count + back : room;
}
