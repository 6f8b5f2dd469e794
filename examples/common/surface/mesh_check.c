#include "surface/mesh_check.h"

#include "base/threads.h"
#include "base/vec3.h"

#include <math.h>
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

/* Returns true if the segment aq lies in the plane of abc and runs from its corner a into its inside. */
static bool runs_into(const float *a, const float *b, const float *c, const float *q)
{
    double u[3], v[3], w[3], n[3], left = 0.0, right = 0.0;
    if (side(a, b, c, q) != 0.0) {
        return false;
    }
    for (int i = 0; i < 3; ++i) {
        u[i] = (double)b[i] - (double)a[i];
        v[i] = (double)c[i] - (double)a[i];
        w[i] = (double)q[i] - (double)a[i];
    }
    for (int i = 0; i < 3; ++i) {
        n[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
    }
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        left += n[i] * (u[j] * w[k] - u[k] * w[j]);
        right += n[i] * (w[j] * v[k] - w[k] * v[j]);
    }
    return left > 0.0 && right > 0.0;
}

static bool has_corner(const int *t, int v) { return t[0] == v || t[1] == v || t[2] == v; }

/* Returns true if the edge from p to q, of which p is a corner of triangle t, runs into its inside. */
static bool runs_into_triangle(const float *positions, int p, int q, const int *t)
{
    const int k = t[0] == p ? 0 : t[1] == p ? 1 : 2;
    return !has_corner(t, q)
           && runs_into(positions + 3 * p, positions + 3 * t[(k + 1) % 3], positions + 3 * t[(k + 2) % 3], positions + 3 * q);
}

static bool crosses(const float *positions, const int *s, const int *t)
{
    for (int turn = 0; turn < 2; ++turn) {
        const int *from = turn ? t : s, *into = turn ? s : t;
        for (int k = 0; k < 3; ++k) {
            const int p = from[k], q = from[(k + 1) % 3];
            const bool at_p = has_corner(into, p), at_q = has_corner(into, q);
            const bool meets = at_p   ? runs_into_triangle(positions, p, q, into)
                               : at_q ? runs_into_triangle(positions, q, p, into)
                                      : pierces(positions + 3 * p, positions + 3 * q, positions + 3 * into[0], positions + 3 * into[1],
                                                positions + 3 * into[2]);
            if (meets) {
                return true;
            }
        }
    }
    return false;
}

/* Boxes of triangles, and a grid whose cells list the triangles whose boxes they meet. */
struct crossings {
    const float *positions;
    const int *triangles;
    int triangle_count, size[3];
    float lower[3], step;
    float *boxes;       /* 6 a triangle: its lower and its upper corner */
    int *first, *listed; /* the triangles of cell c: from first[c] on */
    unsigned char *marks; /* of vertices, NULL: none */
    int count;
};

static void find_boxes(struct crossings *c, float upper[3])
{
    for (int k = 0; k < 3; ++k) {
        c->lower[k] = INFINITY;
        upper[k] = -INFINITY;
    }
    for (int t = 0; t < c->triangle_count; ++t) {
        float *box = c->boxes + 6 * (size_t)t;
        for (int k = 0; k < 3; ++k) {
            const float x = c->positions[3 * c->triangles[3 * t] + k], y = c->positions[3 * c->triangles[3 * t + 1] + k];
            const float z = c->positions[3 * c->triangles[3 * t + 2] + k];
            box[k] = fminf(x, fminf(y, z));
            box[3 + k] = fmaxf(x, fmaxf(y, z));
            c->lower[k] = fminf(c->lower[k], box[k]);
            upper[k] = fmaxf(upper[k], box[3 + k]);
        }
    }
}

/* Returns the cell in which a place lies along an axis. */
static int cell_of(const struct crossings *c, float x, int axis)
{
    const float cell = (x - c->lower[axis]) / c->step;
    return !(cell >= 1.0f) ? 0 : cell < (float)c->size[axis] ? (int)cell : c->size[axis] - 1;
}

/* Finds the first and the last cells that a triangle's box meets. Returns how many it meets. */
static int64_t cells_of(const struct crossings *c, int t, int from[3], int to[3])
{
    const float *box = c->boxes + 6 * (size_t)t;
    int64_t count = 1;
    for (int k = 0; k < 3; ++k) {
        from[k] = cell_of(c, box[k], k);
        to[k] = cell_of(c, box[3 + k], k);
        count *= to[k] - from[k] + 1;
    }
    return count;
}

/* Lists a triangle in its cells, or counts it there where there is no list yet. */
static void list_triangle(struct crossings *c, int t)
{
    int from[3], to[3];
    cells_of(c, t, from, to);
    for (int z = from[2]; z <= to[2]; ++z) {
        for (int y = from[1]; y <= to[1]; ++y) {
            for (int x = from[0]; x <= to[0]; ++x) {
                int *first = c->first + (z * c->size[1] + y) * c->size[0] + x;
                if (c->listed) {
                    c->listed[first[1]++] = t;
                } else {
                    ++first[2];
                }
            }
        }
    }
}

/* Returns how many entries the lists of all cells have. */
static int64_t count_entries(const struct crossings *c)
{
    int from[3], to[3];
    int64_t entries = 0;
    for (int t = 0; t < c->triangle_count; ++t) {
        entries += cells_of(c, t, from, to);
    }
    return entries;
}

/* Chooses cells as wide as triangles are in the mean, or wider: few triangles are then in many. */
static void choose_cells(struct crossings *c, const float upper[3])
{
    double sum = 0.0;
    for (int t = 0; t < c->triangle_count; ++t) {
        const float *box = c->boxes + 6 * (size_t)t;
        sum += (double)fmaxf(box[3] - box[0], fmaxf(box[4] - box[1], box[5] - box[2]));
    }
    c->step = (float)(sum / c->triangle_count);
    for (int k = 0; k < 3; ++k) {
        c->step = fmaxf(c->step, (upper[k] - c->lower[k]) / 1000.0f);
    }
    for (bool fits = false; !fits; c->step *= fits ? 1.0f : 1.5f) {
        int64_t cells = 1;
        for (int k = 0; k < 3; ++k) {
            c->size[k] = c->step > 0.0f ? 1 + (int)((upper[k] - c->lower[k]) / c->step) : 1;
            cells *= c->size[k];
        }
        const int64_t most = 64 + 16 * (int64_t)c->triangle_count;
        fits = cells == 1 || (cells <= most && count_entries(c) <= most);
    }
}

/* Lists the triangles of all cells. Returns false if memory is short. */
static bool list_all(struct crossings *c)
{
    const int64_t cells = (int64_t)c->size[0] * c->size[1] * c->size[2];
    c->first = calloc((size_t)cells + 2, sizeof *c->first);
    for (int t = 0; c->first && t < c->triangle_count; ++t) {
        list_triangle(c, t);
    }
    for (int64_t i = 0; c->first && i < cells; ++i) {
        c->first[i + 2] += c->first[i + 1];
    }
    c->listed = c->first ? malloc(((size_t)count_entries(c) + 1) * sizeof *c->listed) : NULL;
    for (int t = 0; c->listed && t < c->triangle_count; ++t) {
        list_triangle(c, t);
    }
    return c->listed != NULL;
}

/* Returns whether the boxes of two triangles meet, and whether this cell is the one of theirs where it counts. */
static bool meet_in_cell(const struct crossings *c, int s, int t, const int cell[3])
{
    const float *p = c->boxes + 6 * (size_t)s, *q = c->boxes + 6 * (size_t)t;
    for (int k = 0; k < 3; ++k) {
        if (p[3 + k] < q[k] || q[3 + k] < p[k]) {
            return false;
        }
    }
    for (int k = 0; k < 3; ++k) {
        if (cell_of(c, fmaxf(p[k], q[k]), k) != cell[k]) {
            return false;
        }
    }
    return true;
}

static void run_crossings_loop(void *arg, int begin, int end)
{
    struct crossings *c = arg;
    for (int i = begin; i < end; ++i) {
        const int cell[3] = {i % c->size[0], i / c->size[0] % c->size[1], i / c->size[0] / c->size[1]};
        for (int m = c->first[i]; m < c->first[i + 1]; ++m) {
            for (int n = m + 1; n < c->first[i + 1]; ++n) {
                const int *s = c->triangles + 3 * (size_t)c->listed[m], *t = c->triangles + 3 * (size_t)c->listed[n];
                if (!meet_in_cell(c, c->listed[m], c->listed[n], cell) || !crosses(c->positions, s, t)) {
                    continue;
                }
                threads_lock();
                ++c->count;
                for (int k = 0; c->marks && k < 3; ++k) {
                    c->marks[s[k]] = c->marks[t[k]] = 1;
                }
                threads_unlock();
            }
        }
    }
}

int mesh_mark_crossings(const float *positions, const int *triangles, int triangle_count, unsigned char *marks)
{
    struct crossings c = {.positions = positions, .triangles = triangles, .triangle_count = triangle_count, .marks = marks};
    float upper[3];
    if (triangle_count == 0) {
        return 0;
    }
    c.boxes = malloc(6 * (size_t)triangle_count * sizeof *c.boxes);
    bool fine = c.boxes != NULL;
    if (fine) {
        find_boxes(&c, upper);
        choose_cells(&c, upper);
        fine = list_all(&c);
    }
    if (fine) {
        threads_for(c.size[0] * c.size[1] * c.size[2], 1024, run_crossings_loop, &c);
    }
    free(c.boxes);
    free(c.first);
    free(c.listed);
    return fine ? c.count : -1;
}

bool mesh_check(const float *positions, int vertex_count, const int *triangles, int triangle_count, struct mesh_check *check)
{
    memset(check, 0, sizeof *check);
    for (int i = 0; i < 3 * triangle_count; ++i) {
        if (triangles[i] < 0 || triangles[i] >= vertex_count) {
            return false;
        }
    }
    check->intersections = mesh_mark_crossings(positions, triangles, triangle_count, NULL);
    return check->intersections >= 0 && check_edges(triangles, vertex_count, triangle_count, check);
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

/* Returns what each component encloses, at the vertex that connect() has for it, cavities below 0; NULL: memory, also that of parent. */
static double *component_volumes(const float *positions, int vertex_count, const int *triangles, int triangle_count, int *parent)
{
    double *volume = parent ? calloc((size_t)vertex_count + 1, sizeof *volume) : NULL;
    for (int t = 0; volume && t < triangle_count; ++t) {
        const int *c = triangles + 3 * t, root = root_of(parent, c[0]);
        volume[root] += signed_volume(positions + 3 * root, positions + 3 * c[0], positions + 3 * c[1], positions + 3 * c[2]);
    }
    return volume;
}

double mesh_largest_volume(const float *positions, int vertex_count, const int *triangles, int triangle_count)
{
    int *parent = connect(vertex_count, triangles, triangle_count);
    double *volume = component_volumes(positions, vertex_count, triangles, triangle_count, parent), largest = volume ? 0.0 : -1.0;
    for (int v = 0; volume && v < vertex_count; ++v) {
        largest = fmax(largest, fabs(volume[v]));
    }
    free(parent);
    free(volume);
    return largest;
}

int mesh_drop_specks(const float *positions, int vertex_count, int *triangles, int *triangle_count, double smallest)
{
    int *parent = connect(vertex_count, triangles, *triangle_count), left = 0, dropped = 0;
    double *volume = component_volumes(positions, vertex_count, triangles, *triangle_count, parent);
    if (!volume) {
        free(parent);
        return -1;
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

/* Finds the boxes of components, 6 numbers a root: lower corner, upper corner. */
static float *component_boxes(const float *positions, int vertex_count, const int *triangles, int triangle_count, int *parent)
{
    float *box = malloc(6 * ((size_t)vertex_count + 1) * sizeof *box);
    for (int i = 0; box && i < 6 * vertex_count; ++i) { box[i] = i % 6 < 3 ? INFINITY : -INFINITY; }
    for (int i = 0; box && i < 9 * triangle_count; ++i) {
        const int v = triangles[i / 3], k = i % 3;
        float *of = box + 6 * root_of(parent, v);
        of[k] = fminf(of[k], positions[3 * v + k]);
        of[3 + k] = fmaxf(of[3 + k], positions[3 * v + k]);
    }
    return box;
}

static bool lies_within(const float inner[6], const float outer[6])
{
    bool within = true;
    for (int k = 0; k < 3; ++k) { within = within && inner[k] >= outer[k] && inner[3 + k] <= outer[3 + k]; }
    return within;
}

/* A vertex, and its place with one zero only. */
struct placed {
    float place[3];
    int vertex;
};

static int compare_places(const void *a, const void *b)
{
    const struct placed *p = a, *q = b;
    const int order = memcmp(p->place, q->place, sizeof p->place);
    return order != 0 ? order : (p->vertex > q->vertex) - (p->vertex < q->vertex);
}

/* Returns the triangles with one vertex for each place, as those of a mesh without seams; NULL: memory. */
static int *join_seams(const float *positions, int vertex_count, const int *triangles, int triangle_count)
{
    struct placed *placed = malloc(((size_t)vertex_count + 1) * sizeof *placed);
    int *first = malloc(((size_t)vertex_count + 1) * sizeof *first); /* of each vertex: the first one at its place */
    int *joined = malloc((3 * (size_t)triangle_count + 1) * sizeof *joined);
    const bool good = placed && first && joined;
    for (int v = 0; good && v < vertex_count; ++v) {
        for (int k = 0; k < 3; ++k) { placed[v].place[k] = positions[3 * v + k] + 0.0f; } /* -0 becomes 0 */
        placed[v].vertex = v;
    }
    if (good) { qsort(placed, (size_t)vertex_count, sizeof *placed, compare_places); }
    for (int i = 0; good && i < vertex_count; ++i) {
        const bool same = i > 0 && memcmp(placed[i].place, placed[i - 1].place, sizeof placed[i].place) == 0;
        first[placed[i].vertex] = same ? first[placed[i - 1].vertex] : placed[i].vertex;
    }
    for (int i = 0; good && i < 3 * triangle_count; ++i) { joined[i] = first[triangles[i]]; }
    free(placed);
    free(first);
    if (!good) {
        free(joined);
        return NULL;
    }
    return joined;
}

/* Marks the roots of components that have a border. Returns false if memory is short. */
static bool mark_open(const int *triangles, int triangle_count, int *parent, bool *open)
{
    struct edge *edges = sort_edges(triangles, triangle_count);
    for (int i = 0, next; edges && i < 3 * triangle_count; i = next) {
        int balance = 0;
        for (next = i; next < 3 * triangle_count && compare_edges(&edges[i], &edges[next]) == 0; ++next) {
            balance += edges[next].low == edges[next].high ? 0 : edges[next].along;
        }
        if (balance != 0) { open[root_of(parent, edges[i].low)] = true; }
    }
    free(edges);
    return edges != NULL;
}

int mesh_drop_inner_skins(const float *positions, int vertex_count, int *triangles, int *triangle_count)
{
    int *joined = join_seams(positions, vertex_count, triangles, *triangle_count), left = 0, dropped = 0, outer = 0;
    int *parent = joined ? connect(vertex_count, joined, *triangle_count) : NULL;
    double *volume = component_volumes(positions, vertex_count, joined, *triangle_count, parent);
    float *box = volume ? component_boxes(positions, vertex_count, joined, *triangle_count, parent) : NULL;
    bool *open = calloc((size_t)vertex_count + 1, sizeof *open), *inner = calloc((size_t)vertex_count + 1, sizeof *inner); /* of roots */
    const bool good = box && open && inner && mark_open(joined, *triangle_count, parent, open);
    for (int v = 0; good && v < vertex_count; ++v) { outer = volume[v] > volume[outer] ? v : outer; }
    for (int v = 0; good && v < vertex_count; ++v) {
        inner[v] = !open[v] && -volume[v] > 0.5 * volume[outer] && -volume[v] < volume[outer] && lies_within(box + 6 * v, box + 6 * outer);
        dropped += inner[v];
    }
    for (int t = 0; good && t < *triangle_count; ++t) {
        if (!inner[root_of(parent, joined[3 * t])]) { memmove(triangles + 3 * left++, triangles + 3 * t, 3 * sizeof *triangles); }
    }
    if (good) { *triangle_count = left; }
    free(joined);
    free(parent);
    free(volume);
    free(box);
    free(open);
    free(inner);
    return good ? dropped : -1;
}

double mesh_sharp_angles(const float *positions, const int *triangles, int triangle_count, double degrees)
{
    const double limit = cos(degrees * 3.14159265358979 / 180.0);
    int sharp = 0;
    for (int i = 0; i < 3 * triangle_count; ++i) {
        const int t = i / 3 * 3;
        const float *a = positions + 3 * triangles[i], *p = positions + 3 * triangles[t + (i + 1) % 3];
        const float *q = positions + 3 * triangles[t + (i + 2) % 3];
        double up = 0.0, uu = 0.0, vv = 0.0;
        for (int k = 0; k < 3; ++k) {
            const double u = (double)p[k] - (double)a[k], v = (double)q[k] - (double)a[k];
            up += u * v;
            uu += u * u;
            vv += v * v;
        }
        sharp += up > limit * sqrt(uu * vv);
    }
    return triangle_count ? sharp / (3.0 * triangle_count) : 0.0;
}
