#include "character/solid_voxels.h"

#include "character/voxel_heap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- one body of a level set ---- */

struct repair {
    const struct solid_grid *grid;
    size_t count;
    float *phi;
    int *label; /* 0: not labeled yet */
    int *queue, *before;
};

/* Calls for each face neighbor within the grid. */
static int face_neighbors(const int size[3], int at, int neighbors[6])
{
    const int step[3] = {1, size[0], size[0] * size[1]},
              place[3] = {at % size[0], at / size[0] % size[1], at / step[2]};
    int count = 0;
    for (int k = 0; k < 6; ++k) {
        const int axis = k / 2, sign = k % 2 ? 1 : -1;
        if (place[axis] + sign >= 0 && place[axis] + sign < size[axis]) {
            neighbors[count++] = at + sign * step[axis];
        }
    }
    return count;
}

/* Labels all voxels on the side of voxel `first` that are connected with it by faces; returns how many. */
static int flood(struct repair *r, int first, int label)
{
    const bool inside = r->phi[first] < 0.0f;
    int done = 0, end = 0, neighbors[6];
    r->queue[end++] = first;
    r->label[first] = label;
    while (done < end) {
        const int around = face_neighbors(r->grid->size, r->queue[done++], neighbors);
        for (int k = 0; k < around; ++k) {
            const int next = neighbors[k];
            if (r->label[next] == 0 && (r->phi[next] < 0.0f) == inside) {
                r->label[next] = label;
                r->queue[end++] = next;
            }
        }
    }
    return end;
}

/* Fills what is not connected with voxel 0: the grid's border is outside. */
static void fill_hollows(struct repair *r, struct solid_repair *report)
{
    flood(r, 0, 1);
    for (size_t n = 0; n < r->count; ++n) {
        if (r->phi[n] >= 0.0f && r->label[n] == 0) {
            r->phi[n] = -fmaxf(r->phi[n], 1e-3f);
            ++report->filled;
        }
    }
    memset(r->label, 0, r->count * sizeof *r->label);
}

/* Makes a ball of 1.5 voxels inside. */
static void carve(struct repair *r, int at)
{
    const int *size = r->grid->size, place[3] = {at % size[0], at / size[0] % size[1], at / (size[0] * size[1])};
    for (int k = 0; k < 27; ++k) {
        const int d[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
        const int x = place[0] + d[0], y = place[1] + d[1], z = place[2] + d[2];
        if (x > 0 && y > 0 && z > 0 && x < size[0] - 1 && y < size[1] - 1 && z < size[2] - 1) {
            float *phi = &r->phi[(z * size[1] + y) * size[0] + x];
            *phi = fminf(*phi, sqrtf((float)(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])) - 1.5f);
        }
    }
}

/* Searches from the body with label 1 for the nearest voxel of another one that is kept, and builds a bridge. Returns the
 * other's label, 0: none within reach. */
static int bridge(struct repair *r, const bool *kept, int reach)
{
    int done = 0, end = 0, ring = 0, ring_end, neighbors[6];
    memset(r->before, -1, r->count * sizeof *r->before);
    for (size_t n = 0; n < r->count; ++n) {
        if (r->label[n] == 1) {
            r->before[n] = (int)n;
            r->queue[end++] = (int)n;
        }
    }
    for (ring_end = end; done < end; ++done) {
        if (done == ring_end) {
            ring_end = end;
            if (++ring > reach) { return 0; }
        }
        const int at = r->queue[done], around = face_neighbors(r->grid->size, at, neighbors);
        for (int k = 0; k < around; ++k) {
            const int next = neighbors[k], label = r->label[next];
            if (label > 1 && kept[label]) {
                for (int back = at; r->before[back] != back; back = r->before[back]) {
                    carve(r, back);
                    r->label[back] = 1;
                }
                return label;
            }
            if (r->before[next] < 0 && label == 0) {
                r->before[next] = at;
                r->queue[end++] = next;
            }
        }
    }
    return 0;
}

static bool join_parts(struct repair *r, int reach, struct solid_repair *report)
{
    size_t inside = 0;
    int largest = 0, most = 0, room = 0;
    int *voxels = NULL;
    for (size_t n = 0; n < r->count; ++n) {
        if (r->phi[n] < 0.0f && r->label[n] == 0) {
            if (report->parts + 2 >= room) {
                room = 2 * room + 64;
                int *grown = realloc(voxels, (size_t)room * sizeof *voxels);
                if (!grown) {
                    free(voxels);
                    return false;
                }
                voxels = grown;
            }
            const int label = ++report->parts, size = flood(r, (int)n, label);
            voxels[label] = size;
            inside += (size_t)size;
            if (size > most) {
                most = size;
                largest = label;
            }
        }
    }
    bool *kept = calloc((size_t)report->parts + 2, sizeof *kept);
    if (!kept) {
        free(voxels);
        return false;
    }
    for (size_t n = 0; n < r->count; ++n) { /* the largest becomes number 1 */
        r->label[n] = r->label[n] == largest ? 1 : r->label[n] == 1 ? largest : r->label[n];
    }
    for (int p = 1; p <= report->parts; ++p) {
        kept[p == 1 ? largest : p == largest ? 1 : p] = 1000 * (size_t)voxels[p] >= inside;
    }
    for (int other; report->parts > 1 && (other = bridge(r, kept, reach)) > 0; ++report->joined) {
        for (size_t n = 0; n < r->count; ++n) { r->label[n] = r->label[n] == other ? 1 : r->label[n]; }
    }
    for (size_t n = 0; n < r->count; ++n) {
        if (r->label[n] > 1 && r->phi[n] < 0.0f) {
            r->phi[n] = fmaxf(-r->phi[n], 1e-3f);
            ++report->dropped;
            if (kept[r->label[n]]) {
                ++report->out_of_reach;
                report->out_of_reach_at = (int)n;
            }
        }
    }
    free(voxels);
    free(kept);
    return true;
}

bool solid_repair(const struct solid_grid *grid, float *phi, int reach, struct solid_repair *report)
{
    struct repair r = {grid, (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2], phi, NULL, NULL,
                       NULL};
    memset(report, 0, sizeof *report);
    r.label = calloc(r.count, sizeof *r.label);
    r.queue = malloc(r.count * sizeof *r.queue);
    r.before = malloc(r.count * sizeof *r.before);
    bool good = r.label && r.queue && r.before;
    if (good) {
        fill_hollows(&r, report);
        good = join_parts(&r, reach, report);
    }
    free(r.label);
    free(r.queue);
    free(r.before);
    return good;
}

bool solid_is_whole(const struct solid_grid *grid, float *phi, bool *whole)
{
    struct repair r = {grid, (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2], phi, NULL, NULL, NULL};
    size_t first = 0;
    r.label = calloc(r.count, sizeof *r.label);
    r.queue = malloc(r.count * sizeof *r.queue);
    const bool good = r.label && r.queue;
    while (good && first < r.count && phi[first] >= 0.0f) { ++first; }
    *whole = good && first < r.count && (size_t)flood(&r, 0, 1) + (size_t)flood(&r, (int)first, 2) == r.count;
    free(r.label);
    free(r.queue);
    return good;
}

/* ---- depth ---- */

/* Returns where the parabolas q and v cross. */
static float crossing(const float *f, int q, int v)
{
    return ((f[q] + (float)(q * q)) - (f[v] + (float)(v * v))) / (float)(2 * (q - v));
}

#define FAR 1e12f /* squared distance where none is known yet */

/* Transforms squared distances along a line in place: the lower envelope of parabolas (Felzenszwalb & Huttenlocher 2012). f, vertex
 * and from are of n + 1. */
static void envelope(float *line, size_t step, int n, float *f, int *vertex, float *from)
{
    int k = -1;
    for (int q = 0; q < n; ++q) {
        float s = -INFINITY;
        f[q] = line[(size_t)q * step];
        if (f[q] >= FAR) { continue; }
        while (k >= 0 && (s = crossing(f, q, vertex[k])) <= from[k]) { --k; }
        vertex[++k] = q;
        from[k] = k > 0 ? s : -INFINITY;
    }
    if (k < 0) { return; }
    from[k + 1] = INFINITY;
    k = 0;
    for (int q = 0; q < n; ++q) {
        while (from[k + 1] < (float)q) { ++k; }
        line[(size_t)q * step] = (float)((q - vertex[k]) * (q - vertex[k])) + f[vertex[k]];
    }
}

/* Computes squared distances to the nearest voxel where `square` is 0; elsewhere it is FAR. */
static bool square_distances(const struct solid_grid *grid, float *square)
{
    const int *size = grid->size, longest = size[0] > size[1] ? size[0] : size[1];
    const size_t room = (size_t)(longest > size[2] ? longest : size[2]) + 1,
                 step[3] = {1, (size_t)size[0], (size_t)size[0] * (size_t)size[1]};
    float *f = malloc(room * sizeof *f), *from = malloc(room * sizeof *from);
    int *vertex = malloc(room * sizeof *vertex);
    const bool good = f && from && vertex;
    for (int axis = 0; good && axis < 3; ++axis) {
        const int u = axis == 0, v = axis == 2 ? 1 : 2; /* the other axes */
        for (int j = 0; j < size[v]; ++j) {
            for (int i = 0; i < size[u]; ++i) {
                envelope(square + (size_t)i * step[u] + (size_t)j * step[v], step[axis], size[axis], f, vertex, from);
            }
        }
    }
    free(f);
    free(from);
    free(vertex);
    return good;
}

bool solid_extend(const struct solid_grid *grid, float *phi, float band)
{
    const int *size = grid->size, step[3] = {1, size[0], size[0] * size[1]};
    const size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    float *square = malloc(count * sizeof *square);
    for (size_t n = 0; square && n < count; ++n) { square[n] = FAR; }
    for (int axis = 0; square && axis < 3; ++axis) { /* voxels with neighbors on the other side */
        for (size_t n = (size_t)step[axis]; n < count; ++n) {
            if ((phi[n] < 0.0f) != (phi[n - (size_t)step[axis]] < 0.0f)) {
                square[n] = square[n - (size_t)step[axis]] = 0.0f;
            }
        }
    }
    const bool good = square && square_distances(grid, square);
    for (size_t n = 0; good && n < count; ++n) {
        const float far = sqrtf(square[n]) + 0.5f;
        if (fabsf(phi[n]) >= band) {
            phi[n] = copysignf(fmaxf(band, far), phi[n]);
        } else if (far > fabsf(phi[n]) + 1.2f) { /* near a wall inside, where the surface overlaps itself */
            phi[n] = copysignf(far, phi[n]);
        }
    }
    free(square);
    return good;
}

bool solid_create(const struct solid_grid *grid, const float *phi, float band, struct solid *solid)
{
    const size_t count = (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2];
    float *square = malloc(count * sizeof *square);
    memset(solid, 0, sizeof *solid);
    solid->grid = *grid;
    for (size_t n = 0; n < count; ++n) { solid->count += phi[n] < 0.0f; }
    solid->index = malloc(((size_t)solid->count + 1) * sizeof *solid->index);
    solid->number = malloc(count * sizeof *solid->number);
    solid->depth = malloc(((size_t)solid->count + 1) * sizeof *solid->depth);
    bool good = square && solid->index && solid->number && solid->depth && solid->count > 0;
    for (size_t n = 0; good && n < count; ++n) { square[n] = phi[n] < 0.0f ? FAR : 0.0f; }
    good = good && square_distances(grid, square);
    for (size_t n = 0, next = 0; good && n < count; ++n) {
        solid->number[n] = phi[n] < 0.0f ? (int)next : -1;
        if (phi[n] < 0.0f) {
            const float far = sqrtf(square[n]) - 0.5f;
            solid->index[next] = (int)n;
            solid->depth[next++] = fmaxf(0.1f, -phi[n] < band ? -phi[n] : far);
        }
    }
    free(square);
    if (!good) { solid_free(solid); }
    return good;
}

void solid_free(struct solid *solid)
{
    free(solid->index);
    free(solid->number);
    free(solid->depth);
    memset(solid, 0, sizeof *solid);
}

/* ---- places and distances ---- */

static void voxel_of(const struct solid *solid, int number, int voxel[3])
{
    const int *size = solid->grid.size, at = solid->index[number];
    voxel[0] = at % size[0], voxel[1] = at / size[0] % size[1], voxel[2] = at / (size[0] * size[1]);
}

void solid_place(const struct solid *solid, int number, float place[3])
{
    int voxel[3];
    voxel_of(solid, number, voxel);
    for (int i = 0; i < 3; ++i) { place[i] = (float)(solid->grid.origin[i] + solid->grid.spacing * voxel[i]); }
}

int solid_nearest(const struct solid *solid, const float place[3])
{
    int best = 0, voxel[3];
    double least = INFINITY;
    for (int n = 0; n < solid->count; ++n) {
        double square = 0.0;
        voxel_of(solid, n, voxel);
        for (int i = 0; i < 3; ++i) {
            const double d = solid->grid.origin[i] + solid->grid.spacing * voxel[i] - (double)place[i];
            square += d * d;
        }
        if (square < least) {
            least = square;
            best = n;
        }
    }
    return best;
}

int solid_neighbors(const struct solid *solid, int number, int neighbors[26])
{
    const int *size = solid->grid.size;
    int voxel[3], count = 0;
    voxel_of(solid, number, voxel);
    for (int k = 0; k < 27; ++k) {
        const int x = voxel[0] + k % 3 - 1, y = voxel[1] + k / 3 % 3 - 1, z = voxel[2] + k / 9 - 1;
        if (k != 13 && x >= 0 && y >= 0 && z >= 0 && x < size[0] && y < size[1] && z < size[2]) {
            const int next = solid->number[(z * size[1] + y) * size[0] + x];
            if (next >= 0) { neighbors[count++] = next; }
        }
    }
    return count;
}

float solid_step(const struct solid *solid, int from, int to)
{
    static const float length[4] = {0.0f, 1.0f, 1.41421356f, 1.73205081f};
    int a[3], b[3];
    voxel_of(solid, from, a);
    voxel_of(solid, to, b);
    return length[abs(a[0] - b[0]) + abs(a[1] - b[1]) + abs(a[2] - b[2])];
}

bool solid_distances(const struct solid *solid, const int *seeds, int seed_count, bool centered, float *distance,
                     int *before)
{
    struct voxel_heap heap;
    if (!voxel_heap_create(&heap, solid->count)) { return false; }
    for (int n = 0; n < solid->count; ++n) {
        distance[n] = INFINITY;
        if (before) { before[n] = -1; }
    }
    for (int s = 0; s < seed_count; ++s) {
        distance[seeds[s]] = 0.0f;
        voxel_heap_push(&heap, seeds[s], 0.0f);
    }
    for (int at; (at = voxel_heap_pop(&heap)) >= 0;) {
        int neighbors[26];
        const int around = solid_neighbors(solid, at, neighbors);
        for (int k = 0; k < around; ++k) {
            const int next = neighbors[k];
            const float depth = 0.5f * (solid->depth[at] + solid->depth[next]);
            const float there = distance[at] + solid_step(solid, at, next) / (centered ? depth * depth : 1.0f);
            if (there < distance[next]) {
                distance[next] = there;
                if (before) { before[next] = at; }
                voxel_heap_push(&heap, next, there);
            }
        }
    }
    voxel_heap_free(&heap);
    return true;
}
