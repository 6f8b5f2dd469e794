/* seed_cut.c - Y. Boykov, M.-P. Jolly, "Interactive graph cuts", ICCV 2001: a voxel's intensity speaks for the object or against it, by
 * histograms of both, and neighbours of like intensities stay together. What is as bright as the object, and touches it, is told from it by
 * the way there: paths from the marks through the image that cross as few edges as possible (A. Criminisi, T. Sharp, A. Blake, "GeoS:
 * geodesic image segmentation", ECCV 2008; B. Price, B. Morse, S. Cohen, "Geodesic graph cut", CVPR 2010). */
#include "imaging/seed_cut.h"

#include "imaging/max_flow.h"
#include "imaging/segment_image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Chosen on a hip bone, a bladder, a hippocampus, the tumour of brain1 and a frame of a heart, each with one to six seeds. The rows of
 * tumour and heart in docs/segment.md are thus of images that these were chosen on. */
enum { CLASSES = 64, ROUNDS = 2, SWEEPS = 8, BLURS = 3 };

static const float smoothness = 3.0f;  /* of a wall between like neighbours, against intensities */
static const float surest = 2.0f;      /* what an intensity says at most, the logarithm of a ratio */
static const float way_weight = 4.0f;  /* what the ways say at most */
static const float edge_length = 3.0f; /* of an edge of the usual height, voxels */
static const float certain = 1e6f;     /* what a mark says */
static const double rare = 0.02;       /* share of all intensities alike that a histogram holds besides */

struct cut {
    const struct volume *image;
    const uint8_t *marks;
    uint8_t *inside;
    size_t voxels;
    float low, high;        /* of the intensities that matter */
    float usual;            /* root mean square of the differences of neighbours */
    float side;             /* of a cube as large as a voxel, mm */
    float *values, *gain, *walls, *ways[2];
};

static void cut_free(struct cut *c)
{
    free(c->values);
    free(c->gain);
    free(c->walls);
    free(c->ways[0]);
    free(c->ways[1]);
}

static bool cut_make(struct cut *c)
{
    const float *spacing = c->image->spacing;
    c->voxels = volume_voxels(c->image);
    c->low = segment_percentile(c->image, 0.005);
    c->high = segment_percentile(c->image, 0.995);
    if (!(c->high > c->low)) {
        c->low = c->image->minimum;
        c->high = c->image->maximum;
    }
    c->side = cbrtf(spacing[0] * spacing[1] * spacing[2]);
    c->values = malloc(c->voxels * sizeof *c->values);
    c->gain = malloc(c->voxels * sizeof *c->gain);
    c->walls = calloc(3 * c->voxels, sizeof *c->walls);
    c->ways[0] = malloc(c->voxels * sizeof *c->ways[0]);
    c->ways[1] = malloc(c->voxels * sizeof *c->ways[1]);
    for (size_t n = 0; c->values && n < c->voxels; ++n) {
        c->values[n] = fmaxf(c->low, fminf(c->high, c->image->data[n]));
    }
    return c->values && c->gain && c->walls && c->ways[0] && c->ways[1];
}

/* Fills the walls with squared differences of neighbours. */
static void find_differences(struct cut *c)
{
    const int *dims = c->image->dims;
    const size_t strides[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]};
    double sum = 0.0, number = 0.0;
    for (size_t n = 0; n < c->voxels; ++n) {
        int at[3];
        volume_place(dims, n, at);
        for (size_t a = 0; a < 3; ++a) {
            if (at[a] + 1 < dims[a]) {
                const float d = c->values[n + strides[a]] - c->values[n];
                const bool open = c->marks[n] != SEED_OUTSIDE || c->marks[n + strides[a]] != SEED_OUTSIDE;
                c->walls[3 * n + a] = d * d;
                sum += open ? (double)(d * d) : 0.0;
                number += open ? 1.0 : 0.0;
            }
        }
    }
    c->usual = fmaxf((float)sqrt(sum / fmax(number, 1.0)), 1e-6f * (c->high - c->low));
}

/* A wall of a mm2 weighs the same along all axes. */
static void build_walls(struct cut *c)
{
    const float *spacing = c->image->spacing, scale = -0.5f / (c->usual * c->usual);
    for (size_t n = 0; n < c->voxels; ++n) {
        for (size_t a = 0; a < 3; ++a) {
            c->walls[3 * n + a] = smoothness * expf(scale * c->walls[3 * n + a]) * c->side / spacing[a];
        }
    }
}

/* Shortens the way of a voxel by one over a neighbour. Returns true if it did. */
static bool shorten(const struct cut *c, float *way, size_t n, size_t from, float step)
{
    const float longer = way[from] + step + edge_length * c->side * fabsf(c->values[n] - c->values[from]) / c->usual;
    const bool shorter = longer < way[n];
    way[n] = shorter ? longer : way[n];
    return shorter;
}

/* Passes once through the image, from its first voxel or from its last, over the neighbours that come before. */
static bool sweep(const struct cut *c, float *way, bool back)
{
    const int *dims = c->image->dims;
    const float *s = c->image->spacing;
    const int sign = back ? -1 : 1;
    bool changed = false;
    for (size_t m = 0; m < c->voxels; ++m) {
        const size_t n = back ? c->voxels - 1 - m : m;
        int at[3];
        volume_place(dims, n, at);
        for (int before = 0; before < 13; ++before) {
            const int d[3] = {sign * (before % 3 - 1), sign * (before / 3 % 3 - 1), sign * (before / 9 - 1)};
            const int x = at[0] + d[0], y = at[1] + d[1], z = at[2] + d[2];
            if (x >= 0 && y >= 0 && z >= 0 && x < dims[0] && y < dims[1] && z < dims[2]) {
                const float l[3] = {s[0] * (float)d[0], s[1] * (float)d[1], s[2] * (float)d[2]};
                changed |= shorten(c, way, n, (size_t)x + (size_t)dims[0] * ((size_t)y + (size_t)dims[1] * (size_t)z),
                                   sqrtf(l[0] * l[0] + l[1] * l[1] + l[2] * l[2]));
            }
        }
    }
    return changed;
}

/* Finds the lengths of the shortest ways from marks of a kind. */
static void find_ways(const struct cut *c, uint8_t kind, float *way)
{
    for (size_t n = 0; n < c->voxels; ++n) {
        way[n] = c->marks[n] == kind ? 0.0f : INFINITY;
    }
    bool changed = true;
    for (int s = 0; changed && s < SWEEPS; ++s) {
        changed = sweep(c, way, false);
        changed = sweep(c, way, true) || changed;
    }
}

static int class_of(const struct cut *c, size_t n)
{
    const int class = (int)((c->values[n] - c->low) / (c->high - c->low) * (float)CLASSES);
    return class < CLASSES ? class : CLASSES - 1;
}

/* Smooths a histogram by (1 2 1) / 4 and makes its sum 1. */
static void finish_histogram(double histogram[CLASSES])
{
    double sum = 0.0;
    for (int b = 0; b < 2 * BLURS; ++b) {
        double before = histogram[0];
        for (int i = 0; i < CLASSES; ++i) {
            const double here = histogram[i], after = histogram[i + 1 < CLASSES ? i + 1 : i];
            histogram[i] = 0.25 * before + 0.5 * here + 0.25 * after;
            before = here;
        }
    }
    for (int i = 0; i < CLASSES; ++i) {
        sum += histogram[i];
    }
    for (int i = 0; i < CLASSES; ++i) {
        histogram[i] = (1.0 - rare) * histogram[i] / fmax(sum, 1.0) + rare / CLASSES;
    }
}

/* Sums what intensities and ways say. first: the histograms are those of the marks, else of the present division. */
static void weigh(struct cut *c, bool first)
{
    double histograms[2][CLASSES] = {{0.0}};
    float says[CLASSES];
    for (size_t n = 0; n < c->voxels; ++n) {
        if (!first || c->marks[n] != SEED_NONE) {
            histograms[first ? c->marks[n] == SEED_INSIDE : c->inside[n]][class_of(c, n)] += 1.0;
        }
    }
    finish_histogram(histograms[0]);
    finish_histogram(histograms[1]);
    for (int i = 0; i < CLASSES; ++i) {
        says[i] = fmaxf(-surest, fminf(surest, (float)log(histograms[1][i] / histograms[0][i])));
    }
    for (size_t n = 0; n < c->voxels; ++n) {
        const float in = c->ways[0][n], out = c->ways[1][n];
        const float way = way_weight * (out - in) / fmaxf(out + in, 1e-6f * c->side);
        c->gain[n] = c->marks[n] == SEED_INSIDE ? certain : c->marks[n] == SEED_OUTSIDE ? -certain : says[class_of(c, n)] + way;
    }
}

/* Walks from the voxels of the queue over voxels with `inside` = value, which become `to`. */
static void flood(const struct cut *c, uint8_t value, uint8_t to, size_t *queue, size_t count)
{
    const int *dims = c->image->dims;
    const size_t strides[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]};
    while (count > 0) {
        const size_t n = queue[--count];
        int at[3];
        volume_place(dims, n, at);
        for (int side = 0; side < 6; ++side) {
            const int a = side / 2;
            if (side % 2 ? at[a] + 1 < dims[a] : at[a] > 0) {
                const size_t next = side % 2 ? n + strides[a] : n - strides[a];
                if (c->inside[next] == value) {
                    c->inside[next] = to;
                    queue[count++] = next;
                }
            }
        }
    }
}

/* Leaves the parts of the object that have a mark, and of its surroundings those that have one. */
static bool keep_marked(const struct cut *c)
{
    size_t *queue = malloc(c->voxels * sizeof *queue);
    for (uint8_t side = 0; queue && side < 2; ++side) {
        const uint8_t value = side == 0 ? 1 : 0, to = (uint8_t)(2 + value);
        const uint8_t kind = side == 0 ? SEED_INSIDE : SEED_OUTSIDE;
        size_t count = 0;
        for (size_t n = 0; n < c->voxels; ++n) {
            if (c->marks[n] == kind) {
                c->inside[n] = to;
                queue[count++] = n;
            }
        }
        flood(c, value, to, queue, count);
        for (size_t n = 0; n < c->voxels; ++n) { /* what was not reached changes sides */
            c->inside[n] = c->inside[n] == to ? value : c->inside[n] == value ? (uint8_t)(1 - value) : c->inside[n];
        }
    }
    free(queue);
    return queue != NULL;
}

bool seed_cut(const struct volume *image, const uint8_t *marks, uint8_t *inside)
{
    struct cut c = {.image = image, .marks = marks, .inside = inside};
    bool good = cut_make(&c);
    if (good) {
        find_differences(&c);
        build_walls(&c);
        find_ways(&c, SEED_INSIDE, c.ways[0]);
        find_ways(&c, SEED_OUTSIDE, c.ways[1]);
    }
    for (int round = 0; good && round < ROUNDS; ++round) {
        weigh(&c, round == 0);
        good = max_flow_cut(image->dims, c.gain, c.walls, inside) && keep_marked(&c);
    }
    cut_free(&c);
    return good;
}
