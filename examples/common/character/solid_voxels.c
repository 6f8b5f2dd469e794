#include "character/solid_voxels.h"

#include "base/threads.h"
#include "character/voxel_heap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool solid_grid_around(const float lo[3], const float hi[3], int cells, struct solid_grid *grid)
{
    const double longest = (double)fmaxf(hi[0] - lo[0], fmaxf(hi[1] - lo[1], hi[2] - lo[2]));
    if (!(longest > 0.0) || !isfinite(longest)) { return false; }
    grid->spacing = longest / (cells - 2 * SOLID_MARGIN);
    for (int k = 0; k < 3; ++k) {
        grid->size[k] = (int)fmax(8.0, ceil((double)(hi[k] - lo[k]) / grid->spacing) + 2 * SOLID_MARGIN);
        grid->origin[k] = (double)lo[k] - SOLID_MARGIN * grid->spacing;
    }
    return true;
}

/* ---- what is connected ---- */

/* Runs of voxels of one side along x, row by row, and which of them are connected. */
struct runs {
    int *end;    /* of each run: its last voxel's x + 1 */
    int *parent; /* a forest, one tree for what is connected */
    int *row;    /* of each row: its first run; rows + 1 */
    int parts;
};

static int root_of(int *parent, int run)
{
    while (parent[run] != run) { run = parent[run] = parent[parent[run]]; }
    return run;
}

/* Connects runs of two rows that touch by faces. Sides alternate along a row: `same` when both begin on the same side. */
static void connect_rows(struct runs *r, int row_a, int row_b, bool same)
{
    int a = r->row[row_a], b = r->row[row_b];
    while (a < r->row[row_a + 1] && b < r->row[row_b + 1]) {
        if ((((a - r->row[row_a]) ^ (b - r->row[row_b])) & 1) == !same) {
            const int root_a = root_of(r->parent, a), root_b = root_of(r->parent, b);
            r->parent[root_b] = root_a;
            r->parts -= root_a != root_b;
        }
        const int ends[2] = {r->end[a], r->end[b]};
        a += ends[0] <= ends[1];
        b += ends[1] <= ends[0];
    }
}

/* Lists the runs of all rows. Returns false if memory is short. */
static bool find_runs(const int size[3], const float *phi, struct runs *r)
{
    const int rows = size[1] * size[2];
    size_t room = (size_t)rows;
    for (size_t n = 1; n < (size_t)rows * (size_t)size[0]; ++n) { room += (phi[n] < 0.0f) != (phi[n - 1] < 0.0f); }
    r->end = malloc(room * sizeof *r->end);
    r->parent = malloc(room * sizeof *r->parent);
    r->row = malloc(((size_t)rows + 1) * sizeof *r->row);
    r->parts = 0;
    if (!r->end || !r->parent || !r->row) { return false; }
    for (int j = 0; j < rows; ++j) {
        const float *line = phi + (size_t)j * (size_t)size[0];
        r->row[j] = r->parts;
        for (int x = 1; x <= size[0]; ++x) {
            if (x < size[0] && (line[x] < 0.0f) == (line[x - 1] < 0.0f)) { continue; }
            r->parent[r->parts] = r->parts;
            r->end[r->parts++] = x;
        }
    }
    r->row[rows] = r->parts;
    return true;
}

static void free_runs(struct runs *r)
{
    free(r->end);
    free(r->parent);
    free(r->row);
}

/* Finds what is connected by faces. Call free_runs afterwards. Returns false if memory is short. */
static bool connect_runs(const int size[3], const float *phi, struct runs *r)
{
    const bool good = find_runs(size, phi, r);
    for (int j = 1; good && j < size[1] * size[2]; ++j) {
        const int before[2] = {j % size[1] > 0 ? j - 1 : -1, j - size[1]};
        const bool inside = phi[(size_t)j * (size_t)size[0]] < 0.0f;
        for (int k = 0; k < 2; ++k) {
            if (before[k] >= 0) { connect_rows(r, before[k], j, (phi[(size_t)before[k] * (size_t)size[0]] < 0.0f) == inside); }
        }
    }
    return good;
}

bool solid_is_whole(const struct solid_grid *grid, const float *phi, bool *whole)
{
    struct runs runs;
    const bool good = connect_runs(grid->size, phi, &runs);
    *whole = good && runs.parts == 2;
    free_runs(&runs);
    return good;
}

/* ---- one body of a level set ---- */

#define NARROW 1.0f  /* voxel: a hollow that is nowhere this deep is a crevice */
#define OPENING 0.5f /* voxel: phi of the voxel that is taken out of a film */

enum { HOLLOW = -1, CAVITY = -2 }; /* labels of voxels in hollows; CAVITY: known to be no crevice */

struct repair {
    const struct solid_grid *grid;
    size_t count;
    float *phi;
    const unsigned char *limbs; /* NULL: none known */
    int *label; /* of voxels inside: their part's, from 1; outside 0, in a hollow HOLLOW or CAVITY */
    int *queue, *before;
};

/* Lists the face neighbors within the grid; returns how many. */
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

/* Labels all voxels; returns how many parts there are inside, -1 if memory is short. The grid's border is outside. */
static int label_parts(struct repair *r)
{
    const int *size = r->grid->size;
    struct runs runs;
    int parts = 0;
    bool good = connect_runs(size, r->phi, &runs);
    int *labels = good ? malloc((size_t)runs.row[size[1] * size[2]] * sizeof *labels) : NULL; /* by root */
    for (int run = 0; labels && run < runs.row[size[1] * size[2]]; ++run) { labels[run] = 0; }
    for (int j = 0; labels && j < size[1] * size[2]; ++j) {
        const size_t row = (size_t)j * (size_t)size[0];
        for (int run = runs.row[j], x = 0; run < runs.row[j + 1]; ++run) {
            const int root = root_of(runs.parent, run);
            if (r->phi[row + (size_t)x] >= 0.0f) {
                labels[root] = root == root_of(runs.parent, 0) ? 0 : HOLLOW;
            } else if (labels[root] == 0) {
                labels[root] = ++parts;
            }
            for (; x < runs.end[run]; ++x) { r->label[row + (size_t)x] = labels[root]; }
        }
    }
    good = labels != NULL;
    free(labels);
    free_runs(&runs);
    return good ? parts : -1;
}

/* Labels the hollow around a voxel anew: as outside where it is a crevice, else as a cavity. Returns true for a crevice. */
static bool label_hollow(struct repair *r, int from)
{
    float deepest = 0.0f;
    int end = 0, neighbors[6];
    r->queue[end++] = from;
    r->label[from] = CAVITY;
    for (int done = 0; done < end; ++done) {
        deepest = fmaxf(deepest, r->phi[r->queue[done]]);
        for (int k = face_neighbors(r->grid->size, r->queue[done], neighbors) - 1; k >= 0; --k) {
            if (r->label[neighbors[k]] == HOLLOW) {
                r->label[neighbors[k]] = CAVITY;
                r->queue[end++] = neighbors[k];
            }
        }
    }
    for (int k = 0; deepest < NARROW && k < end; ++k) { r->label[r->queue[k]] = 0; }
    return deepest < NARROW;
}

/* Returns an inside voxel between a voxel of a hollow and the outside, -1: none. */
static int film_beside(const struct repair *r, int at)
{
    int neighbors[6], beyond[6];
    for (int k = face_neighbors(r->grid->size, at, neighbors) - 1; k >= 0; --k) {
        if (r->label[neighbors[k]] <= 0) { continue; }
        for (int i = face_neighbors(r->grid->size, neighbors[k], beyond) - 1; i >= 0; --i) {
            if (r->label[beyond[i]] == 0) { return neighbors[k]; }
        }
    }
    return -1;
}

/* Opens crevices that a film one voxel thick closes, by one voxel of it: so thin a film is only an effect of the grid. */
static void open_crevices(struct repair *r)
{
    bool opened = true;
    while (opened) {
        opened = false;
        for (size_t n = 0; n < r->count; ++n) {
            const int film = r->label[n] == HOLLOW ? film_beside(r, (int)n) : -1;
            if (film >= 0 && label_hollow(r, (int)n)) {
                r->phi[film] = OPENING;
                r->label[film] = 0;
                opened = true;
            }
        }
    }
}

/* Fills what is not connected with voxel 0. */
static void fill_hollows(struct repair *r, struct solid_repair *report)
{
    for (size_t n = 0; n < r->count; ++n) {
        if (r->label[n] < 0) {
            r->phi[n] = -fmaxf(r->phi[n], 1e-3f);
            ++report->filled;
        }
    }
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

/* Searches from the body with label 1 for the nearest voxel of another one that is kept, and builds a bridge. limbs: through these
 * voxels only, NULL: through all. Returns the other's label, 0: none within reach. */
static int bridge(struct repair *r, const bool *kept, const unsigned char *limbs, int reach)
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
            if (r->before[next] < 0 && label == 0 && (!limbs || limbs[next])) {
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
    int largest = 0, apart = 0;
    int *voxels = calloc((size_t)report->parts + 2, sizeof *voxels);
    if (!voxels) { return false; }
    for (size_t n = 0; n < r->count; ++n) {
        ++voxels[r->label[n]];
        inside += r->label[n] > 0;
    }
    for (int p = report->parts; p > 0; --p) { largest = largest == 0 || voxels[p] >= voxels[largest] ? p : largest; }
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
        apart += p != largest && 1000 * (size_t)voxels[p] >= inside;
    }
    for (; report->joined < apart; ++report->joined) {
        int other = r->limbs ? bridge(r, kept, r->limbs, reach) : 0;
        other = other > 0 ? other : bridge(r, kept, NULL, reach);
        if (other == 0) { break; }
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

bool solid_repair(const struct solid_grid *grid, float *phi, const unsigned char *limbs, int reach, bool open, struct solid_repair *report)
{
    struct repair r = {.grid = grid, .count = (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2], .phi = phi,
                       .limbs = limbs};
    bool whole;
    memset(report, 0, sizeof *report);
    report->parts = 1;
    if (!solid_is_whole(grid, phi, &whole)) { return false; }
    if (whole) { return true; }
    r.label = malloc(r.count * sizeof *r.label);
    r.queue = malloc(r.count * sizeof *r.queue);
    r.before = malloc(r.count * sizeof *r.before);
    bool good = r.label && r.queue && r.before && label_parts(&r) >= 0;
    if (good) {
        if (open) { open_crevices(&r); }
        fill_hollows(&r, report);
        report->parts = label_parts(&r);
        good = report->parts >= 0 && join_parts(&r, reach, report);
    }
    free(r.label);
    free(r.queue);
    free(r.before);
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

struct envelope_loop {
    const int *size;
    float *square;
    const size_t *step;
    size_t room;
    int axis;
    int u;
    int v;
    float *f;
    int *vertex;
    float *from;
};

static void run_envelope_loop(void *arg, int begin, int end)
{
    const struct envelope_loop *loop = arg;
    const int *size = loop->size;
    float *square = loop->square;
    const size_t *step = loop->step;
    const size_t room = loop->room;
    const int axis = loop->axis;
    const int u = loop->u;
    const int v = loop->v;
    float *f = loop->f;
    int *vertex = loop->vertex;
    float *from = loop->from;
    for (int j = begin; j < end; ++j) {
        const size_t own = (size_t)j * room;
        for (int i = 0; i < size[u]; ++i) {
            envelope(square + (size_t)i * step[u] + (size_t)j * step[v], step[axis], size[axis], f + own, vertex + own,
                     from + own);
        }
    }
}

/* Computes squared distances to the nearest voxel where `square` is 0; elsewhere it is FAR. */
static bool square_distances(const struct solid_grid *grid, float *square)
{
    const int *size = grid->size, longest = size[0] > size[1] ? size[0] : size[1];
    const size_t room = (size_t)(longest > size[2] ? longest : size[2]) + 1,
                 step[3] = {1, (size_t)size[0], (size_t)size[0] * (size_t)size[1]};
    float *f = malloc(room * room * sizeof *f), *from = malloc(room * room * sizeof *from); /* a row for each plane of lines */
    int *vertex = malloc(room * room * sizeof *vertex);
    const bool good = f && from && vertex;
    for (int axis = 0; good && axis < 3; ++axis) {
        const int u = axis == 0, v = axis == 2 ? 1 : 2; /* the other axes */
        struct envelope_loop loop = {size, square, step, room, axis, u, v, f, vertex, from};
        threads_for(size[v], 1, run_envelope_loop, &loop);
    }
    free(f);
    free(from);
    free(vertex);
    return good;
}

/* Marks the voxels of a row that have a neighbor on the other side: 0, else FAR. The grid's border is outside. */
static void mark_row(const int size[3], const float *phi, int y, int z, float *square)
{
    const size_t width = (size_t)size[0], layer = width * (size_t)size[1];
    const float *below = phi - (y > 0 ? width : 0), *above = phi + (y < size[1] - 1 ? width : 0),
                *behind = phi - (z > 0 ? layer : 0), *before = phi + (z < size[2] - 1 ? layer : 0);
    for (size_t x = 0; x < width; ++x) {
        const int inside = phi[x] < 0.0f; /* without branches: a compiler then takes several voxels at a time */
        const int across = (inside ^ (below[x] < 0.0f)) | (inside ^ (above[x] < 0.0f)) | (inside ^ (behind[x] < 0.0f))
            | (inside ^ (before[x] < 0.0f));
        square[x] = across ? 0.0f : FAR;
    }
    for (size_t x = 1; x < width; ++x) {
        if ((phi[x] < 0.0f) != (phi[x - 1] < 0.0f)) { square[x - 1] = square[x] = 0.0f; }
    }
}

/* Returns what phi becomes; square: of the distance to voxels beside the surface. */
static float extended(float phi, float square, float band)
{
    const float far = sqrtf(square) + 0.5f, near = fabsf(phi);
    const float distance = near >= band ? (far > band ? far : band)
        : far > near + 1.2f ? far : near; /* near a wall inside, where the surface overlaps itself */
    return copysignf(distance, phi);
}

struct mark_loop {
    const int *size;
    size_t width;
    size_t layer;
    const float *phi;
    float *square;
};

static void run_mark_loop(void *arg, int begin, int end)
{
    const struct mark_loop *loop = arg;
    const int *size = loop->size;
    const size_t width = loop->width;
    const size_t layer = loop->layer;
    const float *phi = loop->phi;
    float *square = loop->square;
    for (int z = begin; z < end; ++z) {
        for (int y = 0; y < size[1]; ++y) {
            const size_t row = (size_t)z * layer + (size_t)y * width;
            mark_row(size, phi + row, y, z, square + row);
        }
    }
}

struct extend_loop {
    size_t layer;
    float *phi;
    const float *square;
    float band;
};

static void run_extend_loop(void *arg, int begin, int end)
{
    const struct extend_loop *loop = arg;
    const size_t layer = loop->layer;
    float *phi = loop->phi;
    const float *square = loop->square;
    const float band = loop->band;
    for (int z = begin; z < end; ++z) {
        for (size_t n = (size_t)z * layer; n < (size_t)(z + 1) * layer; ++n) { phi[n] = extended(phi[n], square[n], band); }
    }
}

bool solid_extend(const struct solid_grid *grid, float *phi, float band)
{
    const int *size = grid->size;
    const size_t width = (size_t)size[0], layer = width * (size_t)size[1];
    float *square = malloc(layer * (size_t)size[2] * sizeof *square);
    if (!square) { return false; }
    struct mark_loop marking = {size, width, layer, phi, square};
    threads_for(size[2], 1, run_mark_loop, &marking);
    const bool good = square_distances(grid, square);
    struct extend_loop extension = {layer, phi, square, band};
    threads_for((good ? size[2] : 0), 1, run_extend_loop, &extension);
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
