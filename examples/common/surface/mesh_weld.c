/* mesh_weld.c - border edges are looked up by their middles in cubes of space, which a table of lists holds.
 *
 * What joins is apart by less than a third of the shorter length l, so that the longer one is shorter than 5/3 l. Cubes are as large as
 * edges of a length need, for each power of two: a few lists hold all that may join, however the lengths of a mesh differ. */
#include "surface/mesh_weld.h"

#include "base/vec3.h"
#include "surface/mesh_patches.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct border {
    uint32_t ends[2];
    double middle[3];
    float length;
    int triangle;
    int best;       /* the nearest border of another triangle, -1: none */
    bool same_way;  /* it runs as this one does, as where one of the triangles is turned */
    int next;       /* of the same list */
};

struct weld {
    struct mesh *mesh;
    struct border *borders;
    int count;
    float most; /* that ends may be apart */
    int *lists;
    uint32_t mask;
    uint32_t *root; /* of each vertex: what it is joined with */
};

static const double SHARE = 1.0 / 3.0; /* of the shorter length */

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
            b->middle[k] = 0.5 * ((double)p[k] + (double)q[k]);
            along[k] = q[k] - p[k];
        }
        b->length = sqrtf(vec3_dot(along, along));
    }
    mesh_patches_free(&patches);
    return w->borders != NULL;
}

/* ---- pairs ---- */

static int power_of(double length)
{
    int power;
    frexp(length, &power);
    return power;
}

/* Returns the side of the cubes for edges shorter than 2^power: nothing that joins is further apart. */
static double side_of(const struct weld *w, int power) { return fmin((double)w->most, SHARE * ldexp(1.0, power)); }

/* Returns the number of a cube along an axis. It repeats at a distance where floats do not tell cubes apart. */
static int64_t cell_of(double place, double side) { return (int64_t)fmod(floor(place / side), 1e15); }

static uint32_t list_of(const struct weld *w, int power, const int64_t cell[3])
{
    uint32_t hash = 2166136261u ^ (uint32_t)power;
    for (int k = 0; k < 3; ++k) {
        hash = (hash ^ (uint32_t)cell[k]) * 16777619u;
        hash ^= hash >> 15;
    }
    return hash & w->mask;
}

static bool make_lists(struct weld *w)
{
    size_t size = 64;
    while (size < 2 * (size_t)w->count) {
        size *= 2;
    }
    w->mask = (uint32_t)(size - 1);
    w->lists = malloc(size * sizeof *w->lists);
    for (size_t i = 0; w->lists && i < size; ++i) {
        w->lists[i] = -1;
    }
    for (int i = w->count - 1; w->lists && i >= 0; --i) {
        const struct border *b = &w->borders[i];
        const int power = power_of((double)b->length);
        int64_t cell[3];
        for (int k = 0; k < 3; ++k) {
            cell[k] = cell_of(b->middle[k], side_of(w, power));
        }
        const uint32_t list = list_of(w, power, cell);
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

/* Tells whether two borders have the same vertices, as three triangles on one edge do. */
static bool is_joined(const struct border *a, const struct border *b)
{
    return (a->ends[0] == b->ends[0] && a->ends[1] == b->ends[1]) || (a->ends[0] == b->ends[1] && a->ends[1] == b->ends[0]);
}

/* Finds the nearest border of a list; of two that are alike, the first. */
static void search_list(struct weld *w, struct border *a, uint32_t list, float *least)
{
    for (int j = w->lists[list]; j >= 0; j = w->borders[j].next) {
        const struct border *b = &w->borders[j];
        bool same_way;
        if (b->triangle == a->triangle || is_joined(a, b)) {
            continue;
        }
        const float distance = distance_of(w, a, b, &same_way);
        if (distance <= w->most && (double)distance < SHARE * (double)fminf(a->length, b->length)
            && (distance < *least || (distance == *least && j < a->best))) {
            *least = distance;
            a->best = j;
            a->same_way = same_way;
        }
    }
}

/* Searches the cubes of borders shorter than 2^power, and at least half as long. */
static void search_cubes(struct weld *w, struct border *a, int power, float *least)
{
    const double side = side_of(w, power), reach = 1.000001 * fmin(side, SHARE * (double)a->length);
    int64_t lower[3], upper[3], cell[3];
    for (int k = 0; k < 3; ++k) {
        lower[k] = cell_of(a->middle[k] - reach, side);
        upper[k] = cell_of(a->middle[k] + reach, side);
    }
    for (cell[2] = lower[2]; cell[2] <= upper[2]; ++cell[2]) {
        for (cell[1] = lower[1]; cell[1] <= upper[1]; ++cell[1]) {
            for (cell[0] = lower[0]; cell[0] <= upper[0]; ++cell[0]) {
                search_list(w, a, list_of(w, power, cell), least);
            }
        }
    }
}

static void find_best(struct weld *w, struct border *a)
{
    float least = INFINITY;
    if (a->length > 0.0f) {
        const int last = power_of(1.67 * (double)a->length);
        for (int power = power_of(0.59 * (double)a->length); power <= last; ++power) {
            search_cubes(w, a, power, &least);
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
    const bool fine = sums != NULL;
    free(sums);
    return fine;
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
    if (fine && w.count && most > 0.0f) {
        fine = make_lists(&w);
        for (int i = 0; fine && i < w.count; ++i) {
            find_best(&w, &w.borders[i]);
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
