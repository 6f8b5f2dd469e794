/* label.c - the surface of one label, as part of the net. */
#include "surfaces/net.h"

#include <stdlib.h>
#include <string.h>

/* The twelve edges of a cell: e / 4 is the axis; the other two axes, in cyclic order, have bits e & 1 and e >> 1 & 1. */
enum { EDGES = 12 };

static void edge_ends(int e, int ends[2])
{
    const int a = e / 4, b = (a + 1) % 3, c = (a + 2) % 3;
    ends[0] = (e & 1) << b | (e >> 1 & 1) << c;
    ends[1] = ends[0] | 1 << a;
}

static int edge_between(int p, int q)
{
    for (int e = 0; e < EDGES; ++e) {
        int ends[2];
        edge_ends(e, ends);
        if ((ends[0] == p && ends[1] == q) || (ends[0] == q && ends[1] == p)) {
            return e;
        }
    }
    return -1;
}

/* How the wall of a label passes through a cell, for each set of corners (bits) that have the label: loops of edges, each of which is a
 * sheet with a vertex of its own. */
struct passage {
    int8_t loop[EDGES]; /* -1: no wall crosses this edge */
    int8_t count;
};

static void join(int8_t loop[EDGES], int a, int b)
{
    const int8_t from = loop[a], to = loop[b];
    for (int e = 0; e < EDGES; ++e) {
        loop[e] = loop[e] == from ? to : loop[e];
    }
}

/* Joins edges across the faces of a cell. On a face with the label at two opposite corners the walls go around each of the two: such
 * voxels are not connected. */
static void join_across_faces(unsigned bits, int8_t loop[EDGES])
{
    for (int a = 0; a < 3; ++a) {
        const int b = 1 << (a + 1) % 3, c = 1 << (a + 2) % 3;
        for (int high = 0; high < 2; ++high) {
            const int start = high << a, ring[4] = {start, start | b, start | b | c, start | c};
            int crossed[4], count = 0;
            for (int i = 0; i < 4; ++i) {
                const int p = ring[i], q = ring[(i + 1) % 4];
                if ((bits >> p & 1) != (bits >> q & 1)) {
                    crossed[count++] = edge_between(p, q);
                }
            }
            if (count == 2) {
                join(loop, crossed[0], crossed[1]);
            } else if (count == 4) { /* edge i joins corners i and i + 1: two edges with one corner go together */
                const int shift = bits >> ring[0] & 1 ? 3 : 0;
                join(loop, crossed[shift], crossed[(shift + 1) % 4]);
                join(loop, crossed[(shift + 2) % 4], crossed[(shift + 3) % 4]);
            }
        }
    }
}

static struct passage make_passage(unsigned bits)
{
    struct passage passage;
    int8_t loop[EDGES], renamed[EDGES];
    for (int e = 0; e < EDGES; ++e) {
        loop[e] = (int8_t)e;
        renamed[e] = -1;
    }
    join_across_faces(bits, loop);
    passage.count = 0;
    for (int e = 0; e < EDGES; ++e) {
        int ends[2];
        edge_ends(e, ends);
        const bool crossed = (bits >> ends[0] & 1) != (bits >> ends[1] & 1);
        if (crossed && renamed[loop[e]] < 0) {
            renamed[loop[e]] = passage.count++;
        }
        passage.loop[e] = crossed ? renamed[loop[e]] : -1;
    }
    return passage;
}

/* What the surface of a label is made from. */
struct label_making {
    const struct net *net;
    const uint32_t *vertices;
    size_t count;
    uint8_t *bits;        /* corners with the label */
    uint32_t *first;      /* vertex of the surface that is the first one of a vertex of the net */
    struct passage passages[256];
    struct label_surface *surface;
};

/* Finds a vertex of the net among those of the label. */
static size_t find(const struct label_making *making, uint32_t vertex)
{
    size_t low = 0, high = making->count - 1;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (making->vertices[middle] < vertex) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

static float squared(const float *places, uint32_t a, uint32_t b)
{
    float sum = 0.0f;
    for (int i = 0; i < 3; ++i) {
        const float d = places[3 * (size_t)a + (size_t)i] - places[3 * (size_t)b + (size_t)i];
        sum += d * d;
    }
    return sum;
}

/* Adds the wall across the edge of a cell from its first corner along axis a, of which `inside` is the end with the label: two triangles
 * that share the shorter diagonal, for both labels the same. */
static void add_wall(struct label_making *making, size_t n, int a, int inside)
{
    static const int around[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}; /* cells back along the other two axes */
    const struct net *net = making->net;
    const size_t stride[3] = {1, (size_t)net->dims[0], (size_t)net->dims[0] * (size_t)net->dims[1]};
    const size_t b = stride[(a + 1) % 3], c = stride[(a + 2) % 3];
    struct label_surface *surface = making->surface;
    uint32_t corner[4];
    for (int q = 0; q < 4; ++q) {
        const size_t cell = net->cells[making->vertices[n]] - (size_t)around[q][0] * b - (size_t)around[q][1] * c;
        const size_t at = find(making, (uint32_t)net->vertex_of[cell]);
        const struct passage *passage = &making->passages[making->bits[at]];
        corner[q] = making->first[at] + (uint32_t)(unsigned char)passage->loop[4 * a + (around[q][0] | around[q][1] << 1)];
    }
    const bool second = squared(surface->places, corner[1], corner[3]) < squared(surface->places, corner[0], corner[2]);
    const int order[2][6] = {{0, 1, 2, 0, 2, 3}, {0, 1, 3, 1, 2, 3}};
    uint32_t *out = surface->triangles + 3 * surface->triangle_count;
    for (int t = 0; t < 6; ++t) { /* the cells go backwards, so the ring turns about the axis as the axes do */
        out[t] = corner[order[second][t]];
    }
    if (inside == 1) {
        for (int t = 0; t < 6; t += 3) {
            const uint32_t swapped = out[t];
            out[t] = out[t + 1];
            out[t + 1] = swapped;
        }
    }
    surface->triangle_count += 2;
}

/* Returns bits of the axes along which a wall crosses the edge from the first corner. */
static unsigned walls_from(unsigned bits)
{
    const unsigned first = bits & 1;
    return ((bits >> 1 & 1) ^ first) | ((bits >> 2 & 1) ^ first) << 1 | ((bits >> 4 & 1) ^ first) << 2;
}

static bool make_vertices(struct label_making *making, const int dims[3], const uint32_t *map, uint32_t label)
{
    struct label_surface *surface = making->surface;
    size_t walls = 0;
    for (size_t n = 0; n < making->count; ++n) {
        uint32_t corners[8];
        unsigned bits = 0;
        net_corners(dims, map, making->net, making->net->cells[making->vertices[n]], corners);
        for (int c = 0; c < 8; ++c) {
            bits |= (unsigned)(corners[c] == label) << c;
        }
        making->bits[n] = (uint8_t)bits;
        making->first[n] = (uint32_t)surface->vertex_count;
        surface->vertex_count += (size_t)making->passages[bits].count;
        const unsigned crossed = walls_from(bits);
        walls += (crossed & 1) + (crossed >> 1 & 1) + (crossed >> 2);
    }
    surface->places = malloc((3 * surface->vertex_count + 1) * sizeof *surface->places);
    surface->vertices = malloc((surface->vertex_count + 1) * sizeof *surface->vertices);
    surface->triangles = malloc((6 * walls + 1) * sizeof *surface->triangles);
    if (!surface->places || !surface->vertices || !surface->triangles || surface->vertex_count > INT32_MAX) {
        return false;
    }
    for (size_t n = 0; n < making->count; ++n) {
        for (int l = 0; l < making->passages[making->bits[n]].count; ++l) {
            const size_t v = making->first[n] + (size_t)l;
            surface->vertices[v] = making->vertices[n];
            memcpy(surface->places + 3 * v, making->net->places + 3 * (size_t)making->vertices[n], 3 * sizeof *surface->places);
        }
    }
    return true;
}

bool net_label(const struct net *net, const int dims[3], const uint32_t *map, uint32_t label, const uint32_t *vertices, size_t count,
               struct label_surface *surface)
{
    struct label_making making = {.net = net, .vertices = vertices, .count = count, .surface = surface};
    memset(surface, 0, sizeof *surface);
    making.bits = malloc(count + 1);
    making.first = malloc((count + 1) * sizeof *making.first);
    for (unsigned bits = 0; bits < 256; ++bits) {
        making.passages[bits] = make_passage(bits);
    }
    const bool good = making.bits && making.first && make_vertices(&making, dims, map, label);
    for (size_t n = 0; good && n < count; ++n) {
        const unsigned crossed = walls_from(making.bits[n]);
        for (int a = 0; a < 3; ++a) {
            if (crossed >> a & 1) {
                add_wall(&making, n, a, making.bits[n] & 1 ? 0 : 1);
            }
        }
    }
    free(making.bits);
    free(making.first);
    if (!good) {
        label_surface_free(surface);
    }
    return good;
}

void label_surface_free(struct label_surface *surface)
{
    free(surface->places);
    free(surface->vertices);
    free(surface->triangles);
    memset(surface, 0, sizeof *surface);
}
