/* mesh_weld.c - border edges are looked up by their middles in cubes of space, which a table of lists holds. */
#include "surface/mesh_weld.h"

#include "base/vec3.h"
#include "surface/mesh_patches.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct border {
    uint32_t ends[2];
    float middle[3], length;
    int triangle;
    int best;       /* the nearest border of another triangle, -1: none */
    bool same_way;  /* it runs as this one does, as where one of the triangles is turned */
    int next;       /* of the same list */
};

struct weld {
    struct mesh *mesh;
    struct border *borders;
    int count;
    float most; /* that ends may be apart; and the side of a cube */
    int *lists;
    uint32_t mask;
    uint32_t *root; /* of each vertex: what it is joined with */
};

/* ---- borders ---- */

static bool find_borders(struct weld *w)
{
    const struct mesh *mesh = w->mesh;
    struct mesh_patches patches;
    if (!mesh_patches_find(mesh->indices, mesh->triangle_count, &patches)) {
        return false;
    }
    int count = 0;
    for (size_t h = 0; h < 3 * mesh->triangle_count; ++h) {
        count += patches.across[h] < 0;
    }
    w->borders = malloc(((size_t)count + 1) * sizeof *w->borders);
    for (size_t h = 0; w->borders && h < 3 * mesh->triangle_count; ++h) {
        if (patches.across[h] >= 0) {
            continue;
        }
        struct border *b = &w->borders[w->count++];
        b->ends[0] = mesh->indices[h];
        b->ends[1] = mesh->indices[h % 3 == 2 ? h - 2 : h + 1];
        b->triangle = (int)(h / 3);
        b->best = -1;
        b->same_way = false;
        const float *p = mesh->positions + 3 * (size_t)b->ends[0], *q = mesh->positions + 3 * (size_t)b->ends[1];
        float along[3];
        for (int k = 0; k < 3; ++k) {
            b->middle[k] = 0.5f * (p[k] + q[k]);
            along[k] = q[k] - p[k];
        }
        b->length = sqrtf(vec3_dot(along, along));
    }
    mesh_patches_free(&patches);
    return w->borders != NULL;
}

/* ---- pairs ---- */

static uint32_t cube_of(const struct weld *w, const float place[3], const int off[3])
{
    uint32_t hash = 2166136261u;
    for (int k = 0; k < 3; ++k) {
        const int64_t cell = (int64_t)floor((double)place[k] / (double)w->most) + off[k];
        hash = (hash ^ (uint32_t)cell) * 16777619u;
        hash ^= hash >> 15;
    }
    return hash & w->mask;
}

static bool make_lists(struct weld *w)
{
    static const int here[3] = {0, 0, 0};
    uint32_t size = 64;
    while (size < 2 * (uint32_t)w->count) {
        size *= 2;
    }
    w->mask = size - 1;
    w->lists = malloc(size * sizeof *w->lists);
    for (uint32_t i = 0; w->lists && i < size; ++i) {
        w->lists[i] = -1;
    }
    for (int i = w->count - 1; w->lists && i >= 0; --i) {
        const uint32_t list = cube_of(w, w->borders[i].middle, here);
        w->borders[i].next = w->lists[list];
        w->lists[list] = i;
    }
    return w->lists != NULL;
}

static float apart(const struct weld *w, uint32_t a, uint32_t b)
{
    float d[3];
    for (int k = 0; k < 3; ++k) {
        d[k] = w->mesh->positions[3 * (size_t)a + (size_t)k] - w->mesh->positions[3 * (size_t)b + (size_t)k];
    }
    return sqrtf(vec3_dot(d, d));
}

/* Returns how distant the ends of two borders are, the way round that is nearer: the larger distance of the two. */
static float distance_of(const struct weld *w, const struct border *a, const struct border *b, bool *same_way)
{
    const float against = fmaxf(apart(w, a->ends[0], b->ends[1]), apart(w, a->ends[1], b->ends[0]));
    const float along = fmaxf(apart(w, a->ends[0], b->ends[0]), apart(w, a->ends[1], b->ends[1]));
    *same_way = along < against;
    return fminf(along, against);
}

/* Finds the border that is nearest to one; of two that are alike, the first. */
static void find_best(struct weld *w, int number)
{
    const float share = 1.0f / 3.0f;
    struct border *a = &w->borders[number];
    float least = INFINITY;
    for (int i = 0; i < 27; ++i) {
        const int off[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
        for (int j = w->lists[cube_of(w, a->middle, off)]; j >= 0; j = w->borders[j].next) {
            const struct border *b = &w->borders[j];
            bool same_way;
            if (b->triangle == a->triangle) {
                continue;
            }
            const float distance = distance_of(w, a, b, &same_way);
            if (distance <= w->most && distance < share * fminf(a->length, b->length)
                && (distance < least || (distance == least && j < a->best))) {
                least = distance;
                a->best = j;
                a->same_way = same_way;
            }
        }
    }
}

/* ---- joining ---- */

static uint32_t root_of(struct weld *w, uint32_t v)
{
    while (w->root[v] != v) {
        v = w->root[v] = w->root[w->root[v]];
    }
    return v;
}

static void join(struct weld *w, uint32_t a, uint32_t b)
{
    const uint32_t x = root_of(w, a), y = root_of(w, b);
    w->root[x > y ? x : y] = x > y ? y : x;
}

static bool join_pairs(struct weld *w, size_t *joined)
{
    const size_t n = w->mesh->vertex_count;
    w->root = malloc((n + 1) * sizeof *w->root);
    for (size_t v = 0; w->root && v < n; ++v) {
        w->root[v] = (uint32_t)v;
    }
    for (int i = 0; w->root && i < w->count; ++i) {
        const struct border *a = &w->borders[i], *b = a->best > i ? &w->borders[a->best] : NULL;
        if (b && b->best == i) {
            join(w, a->ends[0], b->ends[!a->same_way]);
            join(w, a->ends[1], b->ends[a->same_way]);
            ++*joined;
        }
    }
    return w->root != NULL;
}

/* Puts the means of three numbers a vertex where vertices are joined. */
static bool take_means(struct weld *w, float *values)
{
    const size_t n = w->mesh->vertex_count;
    double *sums = calloc(4 * n + 1, sizeof *sums);
    for (size_t v = 0; sums && v < n; ++v) {
        double *sum = sums + 4 * (size_t)root_of(w, (uint32_t)v);
        for (int k = 0; k < 3; ++k) {
            sum[k] += (double)values[3 * v + (size_t)k];
        }
        sum[3] += 1.0;
    }
    for (size_t v = 0; sums && v < n; ++v) {
        const double *sum = sums + 4 * v;
        for (int k = 0; sum[3] > 1.0 && k < 3; ++k) {
            values[3 * v + (size_t)k] = (float)(sum[k] / sum[3]);
        }
    }
    free(sums);
    return sums != NULL;
}

/* Replaces vertices by what they are joined with. */
static void renumber(struct weld *w)
{
    struct mesh *mesh = w->mesh;
    size_t n = 0;
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        uint32_t c[3];
        for (size_t k = 0; k < 3; ++k) {
            c[k] = root_of(w, mesh->indices[3 * t + k]);
        }
        if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) {
            ++mesh->dropped;
            continue;
        }
        if (mesh->source) {
            mesh->source[n] = mesh->source[t];
        }
        memcpy(mesh->indices + 3 * n++, c, sizeof c);
    }
    mesh->triangle_count = n;
}

bool mesh_weld(struct mesh *mesh, float most, size_t *joined)
{
    struct weld w = {.mesh = mesh, .most = most};
    *joined = 0;
    bool fine = find_borders(&w);
    double sum = 0.0;
    for (int i = 0; fine && i < w.count; ++i) {
        sum += (double)w.borders[i].length;
    }
    /* few edges in a cube, however fine the mesh */
    w.most = w.count ? fminf(most, (float)(0.7 * sum / w.count)) : most;
    if (fine && w.count && w.most > 0.0f) {
        fine = make_lists(&w);
        for (int i = 0; fine && i < w.count; ++i) {
            find_best(&w, i);
        }
        fine = fine && join_pairs(&w, joined) && take_means(&w, mesh->positions) && (!mesh->colors || take_means(&w, mesh->colors));
        if (fine) {
            renumber(&w);
        }
    }
    free(w.borders);
    free(w.lists);
    free(w.root);
    return fine;
}
