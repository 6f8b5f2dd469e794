#include "surface/mesh_check.h"

#include "base/threads.h"
#include "base/vec3.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct edge {
    int low, high, along; /* corners; +1: the triangle runs from low to high */
    int triangle;
};

static int compare_edges(const void *a, const void *b)
{
    const struct edge *e = a, *f = b;
    return e->low != f->low ? (e->low > f->low) - (e->low < f->low) : (e->high > f->high) - (e->high < f->high);
}

static int root_of(int *parent, int v)
{
    while (parent[v] != v) {
        parent[v] = parent[parent[v]];
        v = parent[v];
    }
    return v;
}

/* Returns the three edges of every triangle, equal ones side by side; NULL: memory. */
static struct edge *sort_edges(const int *triangles, int triangle_count)
{
    const int count = 3 * triangle_count;
    struct edge *edges = malloc(((size_t)count + 1) * sizeof *edges);
    for (int i = 0; edges && i < count; ++i) {
        const int a = triangles[i], b = triangles[i % 3 == 2 ? i - 2 : i + 1];
        const struct edge e = {a < b ? a : b, a < b ? b : a, a < b ? 1 : -1, i / 3};
        edges[i] = e;
    }
    if (edges) {
        qsort(edges, (size_t)count, sizeof *edges, compare_edges);
    }
    return edges;
}

static bool check_edges(const int *triangles, int vertex_count, int triangle_count, struct mesh_check *check)
{
    const int count = 3 * triangle_count;
    struct edge *edges = sort_edges(triangles, triangle_count);
    int *parent = malloc(((size_t)vertex_count + 1) * sizeof *parent);
    if (!edges || !parent) {
        free(edges);
        free(parent);
        return false;
    }
    for (int v = 0; v < vertex_count; ++v) {
        parent[v] = -1;
    }
    for (int i = 0; i < count; ++i) {
        parent[triangles[i]] = triangles[i];
    }
    int different = 0, used = 0;
    for (int i = 0, next; i < count; i = next) {
        int balance = 0;
        for (next = i; next < count && compare_edges(&edges[i], &edges[next]) == 0; ++next) {
            balance += edges[next].along;
        }
        check->open_edges += next - i != 2 || balance != 0;
        ++different;
        parent[root_of(parent, edges[i].low)] = root_of(parent, edges[i].high);
    }
    for (int v = 0; v < vertex_count; ++v) {
        used += parent[v] >= 0;
        check->components += parent[v] == v;
    }
    check->euler = used - different + triangle_count;
    free(edges);
    free(parent);
    return true;
}

/* Returns six times the volume of a tetrahedron, in double; its sign is the side of abc on which d lies. */
static double side(const float *a, const float *b, const float *c, const float *d)
{
    double u[3], v[3], w[3];
    for (int i = 0; i < 3; ++i) {
        u[i] = (double)b[i] - (double)a[i];
        v[i] = (double)c[i] - (double)a[i];
        w[i] = (double)d[i] - (double)a[i];
    }
    return u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
}

/* Returns true if the segment pq passes through the inside of abc; touching does not count. */
static bool pierces(const float *p, const float *q, const float *a, const float *b, const float *c)
{
    if (!(side(a, b, c, p) * side(a, b, c, q) < 0.0)) {
        return false;
    }
    const double u = side(p, q, a, b), v = side(p, q, b, c), w = side(p, q, c, a);
    return (u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0);
}

static bool crosses(const float *positions, const int *s, const int *t)
{
    for (int turn = 0; turn < 2; ++turn) {
        const int *from = turn ? t : s, *into = turn ? s : t;
        for (int k = 0; k < 3; ++k) {
            const int p = from[k], q = from[(k + 1) % 3];
            bool shared = false;
            for (int i = 0; i < 3; ++i) {
                shared = shared || into[i] == p || into[i] == q;
            }
            if (!shared && pierces(positions + 3 * p, positions + 3 * q, positions + 3 * into[0], positions + 3 * into[1],
                                   positions + 3 * into[2])) {
                return true;
            }
        }
    }
    return false;
}

struct box {
    float lo[3], hi[3];
    int triangle;
};

static int compare_boxes(const void *a, const void *b)
{
    const struct box *e = a, *f = b;
    return (e->lo[0] > f->lo[0]) - (e->lo[0] < f->lo[0]);
}

struct crossings_loop {
    const float *positions;
    const int *triangles;
    int triangle_count;
    const struct box *boxes;
    int *crossings;
};

static void run_crossings_loop(void *arg, int begin, int end)
{
    const struct crossings_loop *loop = arg;
    const float *positions = loop->positions;
    const int *triangles = loop->triangles;
    const int triangle_count = loop->triangle_count;
    const struct box *boxes = loop->boxes;
    int crossings = 0;
    for (int i = begin; i < end; ++i) {
        for (int j = i + 1; j < triangle_count && boxes[j].lo[0] <= boxes[i].hi[0]; ++j) {
            if (boxes[j].lo[1] <= boxes[i].hi[1] && boxes[i].lo[1] <= boxes[j].hi[1] && boxes[j].lo[2] <= boxes[i].hi[2]
                && boxes[i].lo[2] <= boxes[j].hi[2]) {
                crossings += crosses(positions, triangles + 3 * boxes[i].triangle, triangles + 3 * boxes[j].triangle);
            }
        }
    }
    threads_lock();
    *loop->crossings += crossings;
    threads_unlock();
}

/* Counts crossings by sorting and sweeping along x. */
static bool count_crossings(const float *positions, const int *triangles, int triangle_count, struct mesh_check *check)
{
    struct box *boxes = malloc(((size_t)triangle_count + 1) * sizeof *boxes);
    if (!boxes) {
        return false;
    }
    for (int t = 0; t < triangle_count; ++t) {
        const float *corner = positions + 3 * triangles[3 * t];
        struct box box = {{corner[0], corner[1], corner[2]}, {corner[0], corner[1], corner[2]}, t};
        for (int k = 1; k < 3; ++k) {
            for (int i = 0; i < 3; ++i) {
                box.lo[i] = fminf(box.lo[i], positions[3 * triangles[3 * t + k] + i]);
                box.hi[i] = fmaxf(box.hi[i], positions[3 * triangles[3 * t + k] + i]);
            }
        }
        boxes[t] = box;
    }
    qsort(boxes, (size_t)triangle_count, sizeof *boxes, compare_boxes);
    int crossings = 0;
    struct crossings_loop loop = {positions, triangles, triangle_count, boxes, &crossings};
    threads_for(triangle_count, 256, run_crossings_loop, &loop);
    check->intersections = crossings;
    free(boxes);
    return true;
}

bool mesh_check(const float *positions, int vertex_count, const int *triangles, int triangle_count, struct mesh_check *check)
{
    memset(check, 0, sizeof *check);
    for (int i = 0; i < 3 * triangle_count; ++i) {
        if (triangles[i] < 0 || triangles[i] >= vertex_count) {
            return false;
        }
    }
    return check_edges(triangles, vertex_count, triangle_count, check)
           && count_crossings(positions, triangles, triangle_count, check);
}

/* Returns a sixth of the determinant of a triangle's corners relative to a vertex of the component (divergence theorem). */
static double signed_volume(const float *origin, const float *a, const float *b, const float *c)
{
    return side(origin, a, b, c) / 6.0;
}

double mesh_volume(const float *positions, const int *triangles, int triangle_count)
{
    double sum = 0.0;
    for (int t = 0; t < triangle_count; ++t) {
        const int *c = triangles + 3 * t;
        sum += signed_volume(positions + 3 * triangles[0], positions + 3 * c[0], positions + 3 * c[1], positions + 3 * c[2]);
    }
    return sum;
}

static void normal_of(const float *positions, const int *corners, float normal[3])
{
    float places[9];
    for (int k = 0; k < 3; ++k) {
        memcpy(places + 3 * k, positions + 3 * corners[k], 3 * sizeof *places);
    }
    vec3_triangle_normal(places, normal);
}

double mesh_bent_edges(const float *positions, const int *triangles, int triangle_count, float cosine)
{
    struct edge *edges = sort_edges(triangles, triangle_count);
    int shared = 0, bent = 0;
    for (int i = 0; edges && i + 1 < 3 * triangle_count; ++i) {
        if (compare_edges(&edges[i], &edges[i + 1]) == 0) {
            float n[3], m[3];
            normal_of(positions, triangles + 3 * edges[i].triangle, n);
            normal_of(positions, triangles + 3 * edges[i + 1].triangle, m);
            bent += vec3_dot(n, m) < cosine;
            ++shared;
        }
    }
    const bool known = edges != NULL;
    free(edges);
    return !known ? -1.0 : shared > 0 ? (double)bent / shared : 0.0;
}

/* Returns for each vertex one that is connected with it, the same for all of a component found by root_of; NULL: memory. */
static int *connect(int vertex_count, const int *triangles, int triangle_count)
{
    int *parent = malloc(((size_t)vertex_count + 1) * sizeof *parent);
    for (int v = 0; parent && v < vertex_count; ++v) {
        parent[v] = v;
    }
    for (int i = 0; parent && i < 3 * triangle_count; ++i) {
        parent[root_of(parent, triangles[i])] = root_of(parent, triangles[i % 3 == 2 ? i - 2 : i + 1]);
    }
    return parent;
}

int mesh_components(int vertex_count, const int *triangles, int triangle_count)
{
    int *parent = connect(vertex_count, triangles, triangle_count), count = parent ? 0 : -1;
    for (int v = 0; parent && v < vertex_count; ++v) {
        count += parent[v] == v;
    }
    free(parent);
    return count;
}

int mesh_drop_specks(const float *positions, int vertex_count, int *triangles, int *triangle_count, double smallest)
{
    int *parent = connect(vertex_count, triangles, *triangle_count), left = 0, dropped = 0;
    double *volume = calloc((size_t)vertex_count + 1, sizeof *volume);
    if (!parent || !volume) {
        free(parent);
        free(volume);
        return -1;
    }
    for (int t = 0; t < *triangle_count; ++t) {
        const int *c = triangles + 3 * t, root = root_of(parent, c[0]);
        volume[root] += signed_volume(positions + 3 * root, positions + 3 * c[0], positions + 3 * c[1], positions + 3 * c[2]);
    }
    for (int t = 0; t < *triangle_count; ++t) {
        const int root = root_of(parent, triangles[3 * t]);
        if (fabs(volume[root]) >= smallest) {
            memmove(triangles + 3 * left++, triangles + 3 * t, 3 * sizeof *triangles);
        } else {
            dropped += !isnan(volume[root]); /* counted once; NaN compares false too */
            volume[root] = (double)NAN;
        }
    }
    *triangle_count = left;
    free(parent);
    free(volume);
    return dropped;
}
