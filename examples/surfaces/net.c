/* net.c - vertices, neighbours and fairing of the net. */
#include "surfaces/net.h"

#include "base/scalar.h"
#include "base/threads.h"

#include <stdlib.h>
#include <string.h>

static const float fairness = 0.36f;  /* c: stable up to 1/2 */
static const float momentum = 0.9f;   /* m: a step counts as ten without it */
static const float rounding = 0.5f;   /* see round_out */
static const float margin = 0.05f;    /* of a cell that its vertex keeps from its sides */

void net_free(struct net *net)
{
    free(net->vertex_of);
    free(net->cells);
    free(net->places);
    free(net->first);
    free(net->labels);
    memset(net, 0, sizeof *net);
}

static void place_of(const int dims[3], uint32_t cell, int place[3])
{
    place[0] = (int)(cell % (uint32_t)dims[0]);
    place[1] = (int)(cell / (uint32_t)dims[0] % (uint32_t)dims[1]);
    place[2] = (int)(cell / ((uint32_t)dims[0] * (uint32_t)dims[1]));
}

/* Looks up a voxel; 0 beyond the map. */
static uint32_t voxel(const int dims[3], const uint32_t *map, int i, int j, int k)
{
    return i < 0 || j < 0 || k < 0 || i >= dims[0] || j >= dims[1] || k >= dims[2]
             ? 0 : map[(size_t)i + (size_t)dims[0] * ((size_t)j + (size_t)dims[1] * (size_t)k)];
}

void net_corners(const int dims[3], const uint32_t *map, const struct net *net, uint32_t cell, uint32_t corners[8])
{
    int at[3];
    place_of(net->dims, cell, at);
    for (int c = 0; c < 8; ++c) {
        corners[c] = voxel(dims, map, at[0] - 1 + (c & 1), at[1] - 1 + (c >> 1 & 1), at[2] - 1 + (c >> 2));
    }
}

/* Keeps each label once; returns how many there are. */
static int distinct(const uint32_t *labels, int count, uint32_t out[8])
{
    int found = 0;
    for (int c = 0; c < count; ++c) {
        int o = 0;
        while (o < found && out[o] != labels[c]) {
            ++o;
        }
        if (o == found) {
            out[found++] = labels[c];
        }
    }
    return found;
}

/* A loop over layers of cells: counts their vertices, or numbers them. */
struct making {
    struct net *net;
    const int *dims;
    const uint32_t *map;
    size_t *vertices, *entries; /* of each layer, and then of those before it */
    bool counts;
};

static void make_layers(void *arg, int begin, int end)
{
    struct making *making = arg;
    struct net *net = making->net;
    const uint32_t layer = (uint32_t)net->dims[0] * (uint32_t)net->dims[1];
    for (int k = begin; k < end; ++k) {
        size_t vertices = making->counts ? 0 : making->vertices[k], entries = making->counts ? 0 : making->entries[k];
        for (uint32_t cell = (uint32_t)k * layer; cell < ((uint32_t)k + 1) * layer; ++cell) {
            uint32_t corners[8], labels[8];
            net_corners(making->dims, making->map, net, cell, corners);
            const int count = distinct(corners, 8, labels);
            if (count < 2) {
                continue;
            }
            if (!making->counts) {
                net->vertex_of[cell] = (int32_t)vertices;
                net->cells[vertices] = cell;
                net->first[vertices] = entries;
                memcpy(net->labels + entries, labels, (size_t)count * sizeof *labels);
            }
            ++vertices;
            entries += (size_t)count;
        }
        if (making->counts) {
            making->vertices[k] = vertices;
            making->entries[k] = entries;
        }
    }
}

/* Replaces numbers by the sums of those before; returns the sum of all. */
static size_t sum_before(size_t *numbers, int count)
{
    size_t sum = 0;
    for (int n = 0; n < count; ++n) {
        const size_t number = numbers[n];
        numbers[n] = sum;
        sum += number;
    }
    return sum;
}

/* Puts a vertex into the middle of the places where its cell's edges cross walls. */
static void begin_place(const uint32_t corners[8], const int at[3], float place[3])
{
    int sum[3] = {0, 0, 0}, crossings = 0;
    for (int c = 0; c < 8; ++c) {
        for (int a = 0; a < 3; ++a) {
            const int other = c | 1 << a;
            if (other != c && corners[c] != corners[other]) {
                for (int b = 0; b < 3; ++b) {
                    sum[b] += (c >> b & 1) + (other >> b & 1);
                }
                ++crossings;
            }
        }
    }
    for (int b = 0; b < 3; ++b) {
        place[b] = (float)(at[b] - 1) + 0.5f * (float)sum[b] / (float)crossings;
    }
}

static void begin_places(void *arg, int begin, int end)
{
    struct making *making = arg;
    struct net *net = making->net;
    for (int v = begin; v < end; ++v) {
        uint32_t corners[8];
        int at[3];
        place_of(net->dims, net->cells[v], at);
        net_corners(making->dims, making->map, net, net->cells[v], corners);
        begin_place(corners, at, net->places + 3 * (size_t)v);
    }
}

static bool number_vertices(struct making *making)
{
    struct net *net = making->net;
    const size_t cells = (size_t)net->dims[0] * (size_t)net->dims[1] * (size_t)net->dims[2];
    making->counts = true;
    threads_for(net->dims[2], 1, make_layers, making);
    net->count = sum_before(making->vertices, net->dims[2]);
    const size_t entries = sum_before(making->entries, net->dims[2]);
    net->vertex_of = malloc(cells * sizeof *net->vertex_of);
    net->cells = malloc((net->count + 1) * sizeof *net->cells);
    net->places = malloc((3 * net->count + 1) * sizeof *net->places);
    net->first = malloc((net->count + 1) * sizeof *net->first);
    net->labels = malloc((entries + 1) * sizeof *net->labels);
    if (!net->vertex_of || !net->cells || !net->places || !net->first || !net->labels || net->count > INT32_MAX) {
        return false;
    }
    memset(net->vertex_of, 0xFF, cells * sizeof *net->vertex_of); /* NET_NONE */
    making->counts = false;
    threads_for(net->dims[2], 1, make_layers, making);
    net->first[net->count] = entries;
    threads_for((int)net->count, 4096, begin_places, making);
    return true;
}

bool net_create(const int dims[3], const uint32_t *map, struct net *net)
{
    memset(net, 0, sizeof *net);
    double cells = 1.0;
    for (int a = 0; a < 3; ++a) {
        net->dims[a] = dims[a] + 1;
        cells *= (double)net->dims[a];
    }
    struct making making = {.net = net, .dims = dims, .map = map};
    making.vertices = malloc((size_t)net->dims[2] * sizeof *making.vertices);
    making.entries = malloc((size_t)net->dims[2] * sizeof *making.entries);
    const bool good = cells <= (double)UINT32_MAX && making.vertices && making.entries && number_vertices(&making);
    free(making.vertices);
    free(making.entries);
    if (!good) {
        net_free(net);
    }
    return good;
}

/* ---- fairing ---- */

/* The neighbours of a vertex, across the faces of its cell that a wall crosses. */
struct fairing {
    struct net *net;
    int32_t (*neighbours)[6]; /* NET_NONE: none */
    float *steps;             /* -L x */
    float *moved;             /* in the last step */
    const int *dims;
    const uint32_t *map;
};

/* Counts the labels at the corners of a cell's face, which lies across axis a, at its low or high end. */
static int face_labels(const uint32_t corners[8], int a, int high)
{
    uint32_t labels[4], found[8];
    int count = 0;
    for (int c = 0; c < 8; ++c) {
        if ((c >> a & 1) == high) {
            labels[count++] = corners[c];
        }
    }
    return distinct(labels, 4, found);
}

/* Finds the neighbours of a vertex: where at least three labels meet, those across faces where three do, if there are two such. */
static void find_neighbours(void *arg, int begin, int end)
{
    const struct fairing *fairing = arg;
    const struct net *net = fairing->net;
    const size_t stride[3] = {1, (size_t)net->dims[0], (size_t)net->dims[0] * (size_t)net->dims[1]};
    for (int v = begin; v < end; ++v) {
        uint32_t corners[8];
        int labels[6], lines = 0;
        net_corners(fairing->dims, fairing->map, net, net->cells[v], corners);
        for (int f = 0; f < 6; ++f) {
            labels[f] = face_labels(corners, f / 2, f & 1);
            lines += labels[f] >= 3;
        }
        const bool on_line = net->first[v + 1] - net->first[v] >= 3;
        for (int f = 0; f < 6; ++f) {
            const bool is_neighbour = labels[f] >= (on_line && lines >= 2 ? 3 : 2);
            const size_t cell = net->cells[v] + (f & 1 ? stride[f / 2] : 0 - stride[f / 2]);
            fairing->neighbours[v][f] = is_neighbour ? net->vertex_of[cell] : NET_NONE;
        }
    }
}

/* Computes what a value lacks to the mean of its neighbours. */
static void lack(const int32_t neighbours[6], const float *values, const float own[3], float out[3])
{
    float sum[3] = {0.0f, 0.0f, 0.0f}, count = 0.0f;
    for (int f = 0; f < 6; ++f) {
        if (neighbours[f] != NET_NONE) {
            const float *other = values + 3 * (size_t)neighbours[f];
            for (int a = 0; a < 3; ++a) {
                sum[a] += other[a];
            }
            count += 1.0f;
        }
    }
    for (int a = 0; a < 3; ++a) {
        out[a] = count > 0.0f ? sum[a] / count - own[a] : 0.0f;
    }
}

static void first_order(void *arg, int begin, int end)
{
    const struct fairing *fairing = arg;
    const float *places = fairing->net->places;
    for (int v = begin; v < end; ++v) {
        lack(fairing->neighbours[v], places, places + 3 * (size_t)v, fairing->steps + 3 * (size_t)v);
    }
}

static void second_order(void *arg, int begin, int end)
{
    const struct fairing *fairing = arg;
    struct net *net = fairing->net;
    for (int v = begin; v < end; ++v) {
        const float *step = fairing->steps + 3 * (size_t)v;
        float second[3];
        int at[3];
        lack(fairing->neighbours[v], fairing->steps, step, second);
        place_of(net->dims, net->cells[v], at);
        for (int a = 0; a < 3; ++a) {
            float *place = net->places + 3 * (size_t)v + a, *moved = fairing->moved + 3 * (size_t)v + a;
            const float before = *place, low = (float)(at[a] - 1);
            *place = scalar_clamp(before - fairness * second[a] + momentum * *moved, low + margin, low + 1.0f - margin);
            *moved = *place - before;
        }
    }
}

/* Moves each vertex away from the mean of its neighbours by half of L x. Triangles whose corners lie on a round surface lie within it:
 * on a sphere of radius r with neighbours at a distance h by h^2 / (6 r) on the mean, a third of L x, and a vertex that is a mean of places
 * on the sphere lies about as deep. */
static void round_out(void *arg, int begin, int end)
{
    const struct fairing *fairing = arg;
    struct net *net = fairing->net;
    for (int v = begin; v < end; ++v) {
        int at[3];
        place_of(net->dims, net->cells[v], at);
        for (int a = 0; a < 3; ++a) {
            float *place = net->places + 3 * (size_t)v + a;
            const float low = (float)(at[a] - 1);
            *place = scalar_clamp(*place - rounding * fairing->steps[3 * (size_t)v + (size_t)a], low + margin, low + 1.0f - margin);
        }
    }
}

bool net_smooth(struct net *net, const int dims[3], const uint32_t *map, int steps)
{
    struct fairing fairing = {.net = net, .dims = dims, .map = map};
    fairing.neighbours = malloc((net->count + 1) * sizeof *fairing.neighbours);
    fairing.steps = malloc((3 * net->count + 1) * sizeof *fairing.steps);
    fairing.moved = calloc(3 * net->count + 1, sizeof *fairing.moved);
    const bool good = fairing.neighbours && fairing.steps && fairing.moved;
    if (good) {
        threads_for((int)net->count, 4096, find_neighbours, &fairing);
    }
    for (int s = 0; good && s < steps; ++s) {
        threads_for((int)net->count, 4096, first_order, &fairing);
        threads_for((int)net->count, 4096, second_order, &fairing);
    }
    if (good && steps > 0) {
        threads_for((int)net->count, 4096, first_order, &fairing);
        threads_for((int)net->count, 4096, round_out, &fairing);
    }
    free(fairing.neighbours);
    free(fairing.steps);
    free(fairing.moved);
    return good;
}
