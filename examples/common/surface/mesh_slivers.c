/* mesh_slivers.c - in each pass, changes that do not touch each other: what one of them reads no other has changed. So lists of triangles
 * around vertices are made once a pass. A change has to make the worst angle around it better, which ends the passes. */
#include "surface/mesh_slivers.h"

#include "surface/mesh_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RING = 32, PASSES = 12, TRIES = 8 };

#define COSINE_THIN 0.96592582628906829      /* of 15 degrees: triangles with a sharper angle are thin */
#define COSINE_VERY_THIN 0.99619469809174553 /* of 5 degrees */

struct work {
    const float *positions;
    int *corners; /* 3 a triangle; a removed one begins with -1 */
    int vertex_count, triangle_count;
    int *first, *around;       /* triangles around vertices: those of v from first[v] on */
    unsigned char *changed;    /* of vertices, in this pass */
    unsigned char *frozen;     /* of vertices: what lies there crosses when it is changed */
    double tolerance;
};

/* A change that makes triangles less thin. */
struct change {
    int from, to;       /* vertices: merge `from` into `to`; or the edge that is flipped */
    int left, right;    /* flip: the vertices opposite to the edge; merge: -1 */
    int thinner;        /* how many more thin triangles there are then: less than 0 */
    double cosine;      /* of the sharpest angle then; 2: the change cannot be made */
};

/* ---- geometry, in double precision ---- */

static void edge_of(const struct work *w, int a, int b, double d[3])
{
    for (int k = 0; k < 3; ++k) {
        d[k] = (double)w->positions[3 * (size_t)b + (size_t)k] - (double)w->positions[3 * (size_t)a + (size_t)k];
    }
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int k = 0; k < 3; ++k) {
        c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
}

/* Computes the normal of a triangle, as long as twice its area. */
static void normal_of(const struct work *w, const int t[3], double n[3])
{
    double a[3], b[3];
    edge_of(w, t[0], t[1], a);
    edge_of(w, t[0], t[2], b);
    cross(a, b, n);
}

/* Returns the cosine of a triangle's sharpest angle; 1: it has no area. */
static double sharpest_cosine(const struct work *w, const int t[3])
{
    double most = -1.0;
    for (int k = 0; k < 3; ++k) {
        double a[3], b[3];
        edge_of(w, t[k], t[(k + 1) % 3], a);
        edge_of(w, t[k], t[(k + 2) % 3], b);
        const double both = sqrt(dot(a, a) * dot(b, b)), cosine = both > 0.0 ? dot(a, b) / both : 1.0;
        most = cosine > most ? cosine : most;
    }
    return most;
}

/* How thin some triangles are. */
struct shape {
    int thin;      /* of them with an angle below 15 degrees */
    double cosine; /* of the sharpest angle */
};

static void add_shape(const struct work *w, const int t[3], struct shape *s)
{
    const double cosine = sharpest_cosine(w, t);
    s->thin += cosine > COSINE_THIN;
    s->cosine = fmax(s->cosine, cosine);
}

/* Returns the squared distance of vertex v from a triangle. */
static double distance2(const struct work *w, int v, const int t[3])
{
    double n[3], best = INFINITY, d[3];
    bool within = true;
    normal_of(w, t, n);
    edge_of(w, t[0], v, d);
    const double height = dot(d, n), nn = dot(n, n);
    for (int k = 0; k < 3; ++k) {
        double e[3], side[3];
        edge_of(w, t[k], t[(k + 1) % 3], e);
        edge_of(w, t[k], v, d);
        cross(e, d, side);
        within = within && dot(side, n) >= 0.0;
        const double ee = dot(e, e), s = ee > 0.0 ? fmin(fmax(dot(d, e) / ee, 0.0), 1.0) : 0.0;
        for (int i = 0; i < 3; ++i) {
            d[i] -= s * e[i];
        }
        best = fmin(best, dot(d, d));
    }
    return within && nn > 0.0 ? height * height / nn : best;
}

/* ---- what lies around ---- */

static bool has(const int t[3], int v) { return t[0] == v || t[1] == v || t[2] == v; }

static int ring_count(const struct work *w, int v) { return w->first[v + 1] - w->first[v]; }

static const int *ring_triangle(const struct work *w, int v, int i) { return w->corners + 3 * (size_t)w->around[w->first[v] + i]; }

static bool are_joined(const struct work *w, int a, int b)
{
    for (int i = 0; i < ring_count(w, a); ++i) {
        if (has(ring_triangle(w, a, i), b)) {
            return true;
        }
    }
    return false;
}

/* Finds the vertices opposite to the edge from a to b: of the triangle that runs along it, and of the one that runs against it. False:
 * there are not just these two. */
static bool opposite(const struct work *w, int a, int b, int *left, int *right)
{
    int lefts = 0, rights = 0;
    for (int i = 0; i < ring_count(w, a); ++i) {
        const int *t = ring_triangle(w, a, i);
        for (int k = 0; k < 3; ++k) {
            if (t[k] == a && t[(k + 1) % 3] == b) {
                *left = t[(k + 2) % 3];
                ++lefts;
            } else if (t[k] == b && t[(k + 1) % 3] == a) {
                *right = t[(k + 2) % 3];
                ++rights;
            }
        }
    }
    return lefts == 1 && rights == 1 && *left != *right;
}

/* Returns how many neighbours of a are neighbours of b too. */
static int common_neighbours(const struct work *w, int a, int b)
{
    int count = 0;
    for (int i = 0; i < ring_count(w, a); ++i) { /* in a closed fan each neighbour comes next to a once */
        const int *t = ring_triangle(w, a, i);
        const int next = t[0] == a ? t[1] : t[1] == a ? t[2] : t[0];
        count += next != b && are_joined(w, b, next);
    }
    return count;
}

/* ---- changes ---- */

/* Finds how thin triangles are around `from` once it is merged into `to`. False: it cannot be. */
static bool after_merge(const struct work *w, int from, int to, struct shape *shape)
{
    const double least = 0.85, least_of_all = 0.5;
    double sum[3] = {0.0, 0.0, 0.0}, moved = INFINITY;
    int left, right;
    if (ring_count(w, from) > RING || ring_count(w, to) > RING || !opposite(w, from, to, &left, &right) || ring_count(w, left) < 4
        || ring_count(w, right) < 4 || w->changed[left] || w->changed[right] || common_neighbours(w, from, to) != 2) {
        return false;
    }
    for (int i = 0; i < ring_count(w, from); ++i) {
        double n[3];
        normal_of(w, ring_triangle(w, from, i), n);
        for (int k = 0; k < 3; ++k) {
            sum[k] += n[k];
        }
    }
    for (int i = 0; i < ring_count(w, from); ++i) {
        const int *t = ring_triangle(w, from, i);
        double before[3], after[3];
        if (has(t, to)) {
            continue;
        }
        const int then[3] = {t[0] == from ? to : t[0], t[1] == from ? to : t[1], t[2] == from ? to : t[2]};
        normal_of(w, t, before);
        normal_of(w, then, after);
        const bool is_thin = sharpest_cosine(w, t) > COSINE_VERY_THIN;
        const double *beside = is_thin ? sum : before; /* so thin a triangle's own normal is little to go by */
        if (dot(after, beside) < (is_thin ? least_of_all : least) * sqrt(dot(after, after) * dot(beside, beside))) {
            return false;
        }
        add_shape(w, then, shape);
        moved = fmin(moved, distance2(w, from, then));
    }
    return moved <= w->tolerance * w->tolerance;
}

/* Finds how thin both triangles are once the edge from a to b joins left and right. False: it cannot. */
static bool after_flip(const struct work *w, int a, int b, int left, int right, struct shape *shape)
{
    const double least = 0.5;
    const int before[2][3] = {{a, b, left}, {b, a, right}}, after[2][3] = {{left, right, b}, {right, left, a}};
    double n[2][3], sum[3], along[3], across[3], normal[3], from[3];
    if (w->changed[left] || w->changed[right] || ring_count(w, a) < 4 || ring_count(w, b) < 4 || are_joined(w, left, right)) {
        return false;
    }
    normal_of(w, before[0], n[0]);
    normal_of(w, before[1], n[1]);
    for (int k = 0; k < 3; ++k) {
        sum[k] = n[0][k] + n[1][k];
    }
    for (int i = 0; i < 2; ++i) {
        normal_of(w, after[i], n[i]);
        if (dot(n[i], sum) < least * sqrt(dot(n[i], n[i]) * dot(sum, sum))) {
            return false;
        }
        add_shape(w, after[i], shape);
    }
    edge_of(w, a, b, along);
    edge_of(w, left, right, across);
    edge_of(w, a, left, from);
    cross(along, across, normal);
    const double height = dot(from, normal), nn = dot(normal, normal);
    return height * height <= w->tolerance * w->tolerance * nn;
}

/* Keeps a change if it is the best so far: one after which fewer triangles are thin or, where they are as many, the sharpest angle is less
 * sharp. So passes end. */
static void consider(struct change *best, struct change other, const struct shape *before, const struct shape *after)
{
    const double better = 1e-4;
    other.thinner = after->thin - before->thin;
    other.cosine = after->cosine;
    if ((other.thinner < 0 || (other.thinner == 0 && after->cosine < before->cosine - better))
        && (other.thinner < best->thinner || (other.thinner == best->thinner && other.cosine < best->cosine))) {
        *best = other;
    }
}

/* Finds the best change at a thin triangle. False: there is none. */
static bool find_change(const struct work *w, const int t[3], struct change *best)
{
    *best = (struct change){-1, -1, -1, -1, 1, 2.0};
    for (int k = 0; k < 3; ++k) {
        const int a = t[k], b = t[(k + 1) % 3];
        if (w->changed[a] || w->changed[b]) {
            continue;
        }
        for (int turn = 0; turn < 2; ++turn) {
            const int from = turn ? b : a, to = turn ? a : b;
            struct shape before = {0, -1.0}, after = {0, -1.0};
            if (!after_merge(w, from, to, &after)) {
                continue;
            }
            for (int i = 0; i < ring_count(w, from); ++i) {
                add_shape(w, ring_triangle(w, from, i), &before);
            }
            consider(best, (struct change){.from = from, .to = to, .left = -1, .right = -1}, &before, &after);
        }
        int left, right;
        struct shape before = {0, -1.0}, after = {0, -1.0};
        if (opposite(w, a, b, &left, &right) && after_flip(w, a, b, left, right, &after)) {
            const int other[3] = {b, a, right};
            add_shape(w, t, &before);
            add_shape(w, other, &before);
            consider(best, (struct change){.from = a, .to = b, .left = left, .right = right}, &before, &after);
        }
    }
    return best->cosine < 2.0;
}

/* Notes that the triangles around a vertex are no longer those listed. */
static void mark_ring(const struct work *w, int v)
{
    for (int i = 0; i < ring_count(w, v); ++i) {
        const int *t = ring_triangle(w, v, i);
        for (int k = 0; t[0] >= 0 && k < 3; ++k) {
            w->changed[t[k]] = 1;
        }
    }
}

static void merge(const struct work *w, int from, int to)
{
    mark_ring(w, from);
    for (int i = 0; i < ring_count(w, from); ++i) {
        int *t = w->corners + 3 * (size_t)w->around[w->first[from] + i];
        if (has(t, to)) {
            t[0] = -1;
            continue;
        }
        for (int k = 0; k < 3; ++k) {
            t[k] = t[k] == from ? to : t[k];
        }
    }
}

static void flip(const struct work *w, const struct change *c)
{
    for (int i = 0; i < ring_count(w, c->from); ++i) {
        int *t = w->corners + 3 * (size_t)w->around[w->first[c->from] + i];
        if (t[0] < 0 || !has(t, c->to)) {
            continue;
        }
        const bool is_left = has(t, c->left);
        t[0] = is_left ? c->left : c->right;
        t[1] = is_left ? c->right : c->left;
        t[2] = is_left ? c->to : c->from;
    }
    w->changed[c->from] = w->changed[c->to] = w->changed[c->left] = w->changed[c->right] = 1;
}

/* ---- passes ---- */

/* Lists the triangles around vertices, after those removed are left out. */
static void begin_pass(struct work *w)
{
    int left = 0;
    for (int t = 0; t < w->triangle_count; ++t) {
        if (w->corners[3 * (size_t)t] >= 0) {
            memmove(w->corners + 3 * (size_t)left++, w->corners + 3 * (size_t)t, 3 * sizeof *w->corners);
        }
    }
    w->triangle_count = left;
    memcpy(w->changed, w->frozen, (size_t)w->vertex_count);
    memset(w->first, 0, ((size_t)w->vertex_count + 2) * sizeof *w->first);
    for (int i = 0; i < 3 * left; ++i) {
        ++w->first[w->corners[i] + 2];
    }
    for (int v = 0; v < w->vertex_count; ++v) {
        w->first[v + 2] += w->first[v + 1];
    }
    for (int i = 0; i < 3 * left; ++i) {
        w->around[w->first[w->corners[i] + 1]++] = i / 3;
    }
}

/* Returns how many changes it has made. */
static int run_pass(struct work *w)
{
    int changes = 0;
    begin_pass(w);
    for (int i = 0; i < w->triangle_count; ++i) {
        const int *t = w->corners + 3 * (size_t)i;
        struct change change;
        if (t[0] < 0 || sharpest_cosine(w, t) < COSINE_THIN || !find_change(w, t, &change)) {
            continue;
        }
        if (change.left < 0) {
            merge(w, change.from, change.to);
        } else {
            flip(w, &change);
        }
        ++changes;
    }
    return changes;
}

static bool allocate(struct work *w)
{
    const size_t vertices = (size_t)w->vertex_count + 2, corners = 3 * (size_t)w->triangle_count + 1;
    w->corners = malloc(corners * sizeof *w->corners);
    w->first = malloc(vertices * sizeof *w->first);
    w->around = malloc(corners * sizeof *w->around);
    w->changed = malloc(vertices);
    w->frozen = calloc(vertices, 1);
    return w->corners && w->first && w->around && w->changed && w->frozen;
}

/* Numbers the vertices left anew. */
static void compact(struct work *w, float *positions, int *vertex_count, int *triangle_indices, int *triangle_count, int *kept)
{
    int *number = w->first, count = 0;
    memset(number, 0, (size_t)w->vertex_count * sizeof *number);
    for (int i = 0; i < 3 * w->triangle_count; ++i) {
        number[w->corners[i]] = 1;
    }
    for (int v = 0; v < w->vertex_count; ++v) {
        if (number[v]) {
            memmove(positions + 3 * (size_t)count, positions + 3 * (size_t)v, 3 * sizeof *positions);
            kept[count] = v;
            number[v] = count++;
        }
    }
    for (int i = 0; i < 3 * w->triangle_count; ++i) {
        triangle_indices[i] = number[w->corners[i]];
    }
    *vertex_count = count;
    *triangle_count = w->triangle_count;
}

bool mesh_remove_slivers(float *positions, int *vertex_count, int *triangle_indices, int *triangle_count, double tolerance, int *kept)
{
    struct work w = {.positions = positions, .vertex_count = *vertex_count, .triangle_count = *triangle_count, .tolerance = tolerance};
    bool fine = allocate(&w);
    /* what crosses already is frozen, so that more crossings are new ones */
    const int before = fine ? mesh_mark_crossings(positions, triangle_indices, *triangle_count, w.frozen) : 0;
    int crossings = before + 1;
    fine = fine && before >= 0;
    for (int i = 0; fine && i < TRIES && crossings > before; ++i) {
        w.triangle_count = *triangle_count;
        memcpy(w.corners, triangle_indices, 3 * (size_t)w.triangle_count * sizeof *w.corners);
        for (int pass = 0; pass < PASSES && run_pass(&w) > 0; ++pass) {
            continue;
        }
        begin_pass(&w);
        crossings = mesh_mark_crossings(positions, w.corners, w.triangle_count, w.frozen);
        fine = crossings >= 0;
    }
    if (fine && crossings > before) {
        w.triangle_count = *triangle_count;
        memcpy(w.corners, triangle_indices, 3 * (size_t)w.triangle_count * sizeof *w.corners);
    }
    if (fine) {
        compact(&w, positions, vertex_count, triangle_indices, triangle_count, kept);
    }
    free(w.corners);
    free(w.first);
    free(w.around);
    free(w.changed);
    free(w.frozen);
    return fine;
}
