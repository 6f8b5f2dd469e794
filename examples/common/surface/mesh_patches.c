#include "surface/mesh_patches.h"

#include <stdlib.h>
#include <string.h>

struct half_edge {
    uint32_t low, high;
    int number; /* 3 * triangle + corner that it begins at */
};

static int by_ends(const void *a, const void *b)
{
    const struct half_edge *x = a, *y = b;
    if (x->low != y->low) {
        return x->low < y->low ? -1 : 1;
    }
    if (x->high != y->high) {
        return x->high < y->high ? -1 : 1;
    }
    return x->number < y->number ? -1 : 1;
}

/* Finds the triangle beyond each edge of two. */
static bool find_neighbors(const uint32_t *indices, int triangle_count, int *across)
{
    struct half_edge *edges = malloc(3 * (size_t)triangle_count * sizeof *edges);
    if (!edges) {
        return false;
    }
    for (int h = 0; h < 3 * triangle_count; ++h) {
        const uint32_t a = indices[h], b = indices[h % 3 == 2 ? h - 2 : h + 1];
        edges[h].low = a < b ? a : b;
        edges[h].high = a < b ? b : a;
        edges[h].number = h;
        across[h] = -1;
    }
    qsort(edges, 3 * (size_t)triangle_count, sizeof *edges, by_ends);
    for (int i = 0, next; i < 3 * triangle_count; i = next) {
        for (next = i + 1; next < 3 * triangle_count && edges[next].low == edges[i].low && edges[next].high == edges[i].high;) {
            ++next;
        }
        if (next == i + 2) {
            across[edges[i].number] = edges[i + 1].number;
            across[edges[i + 1].number] = edges[i].number;
        }
    }
    free(edges);
    return true;
}

/* Lists the patch of a triangle, and finds which of its triangles run against it. across: half-edges. */
static int spread(const uint32_t *indices, const int *across, int seed, int *list, unsigned char *turned, unsigned char *closed)
{
    int count = 0;
    list[count++] = seed;
    turned[seed] = 0;
    *closed = 1;
    for (int i = 0; i < count; ++i) {
        for (int k = 0; k < 3; ++k) {
            const int h = 3 * list[i] + k, other = across[h];
            if (other < 0) {
                *closed = 0;
            } else if (turned[other / 3] > 1) {
                const int same = indices[h] == indices[other]; /* both begin at the same vertex */
                turned[other / 3] = (unsigned char)(turned[list[i]] ^ same);
                list[count++] = other / 3;
            }
        }
    }
    return count;
}

bool mesh_patches_find(const uint32_t *indices, size_t triangle_count, struct mesh_patches *patches)
{
    memset(patches, 0, sizeof *patches);
    const int n = (int)triangle_count;
    if (triangle_count > INT32_MAX / 3) {
        return false;
    }
    patches->first = malloc((triangle_count + 1) * sizeof *patches->first);
    patches->triangles = malloc((triangle_count + 1) * sizeof *patches->triangles);
    patches->across = malloc((3 * triangle_count + 1) * sizeof *patches->across);
    patches->turned = malloc(triangle_count + 1);
    patches->closed = malloc(triangle_count + 1);
    if (!patches->first || !patches->triangles || !patches->across || !patches->turned || !patches->closed
        || !find_neighbors(indices, n, patches->across)) {
        mesh_patches_free(patches);
        return false;
    }
    memset(patches->turned, 2, triangle_count); /* not reached */
    int listed = 0;
    for (int t = 0; t < n; ++t) {
        if (patches->turned[t] == 2) {
            patches->first[patches->count] = listed;
            listed += spread(indices, patches->across, t, patches->triangles + listed, patches->turned, &patches->closed[patches->count]);
            ++patches->count;
        }
    }
    patches->first[patches->count] = listed;
    for (int h = 0; h < 3 * n; ++h) {
        patches->across[h] = patches->across[h] < 0 ? -1 : patches->across[h] / 3;
    }
    return true;
}

void mesh_patches_free(struct mesh_patches *patches)
{
    free(patches->first);
    free(patches->triangles);
    free(patches->across);
    free(patches->turned);
    free(patches->closed);
    memset(patches, 0, sizeof *patches);
}
