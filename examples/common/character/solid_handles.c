/* Homotopic region growing: from a single voxel a region grows, first along the middles of limbs, then the deepest voxel first, by
 * simple voxels only, those that change neither parts nor handles nor hollows (Bertrand & Malandain 1994). What it cannot take is
 * where its fronts meet: the cuts. The same from the outside gives the films that close tunnels. */
#include "character/solid_handles.h"

#include "character/voxel_heap.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define CUT 0.5f    /* voxel: phi of a voxel that is taken out, and minus that of one of a film */
#define FIRST 1e6f  /* voxels: as so much deeper counts the middle of a limb */

int solid_euler(const struct solid_grid *grid, const float *phi)
{
    const int *size = grid->size;
    const size_t row = (size_t)size[0], layer = row * (size_t)size[1];
    int euler = 0;
    for (int z = 0; z + 1 < size[2]; ++z) {
        for (int y = 0; y + 1 < size[1]; ++y) {
            const float *p = phi + (size_t)z * layer + (size_t)y * row;
            for (int x = 0; x + 1 < size[0]; ++x, ++p) {
                if (*p >= 0.0f) { continue; }
                const int i = p[1] < 0.0f, j = p[row] < 0.0f, k = p[layer] < 0.0f;
                const int ij = i & j & (p[row + 1] < 0.0f), ik = i & k & (p[layer + 1] < 0.0f), jk = j & k & (p[layer + row] < 0.0f);
                euler += 1 - i - j - k + ij + ik + jk - (ij & ik & jk & (p[layer + row + 1] < 0.0f)); /* voxels, faces, edges, corners */
            }
        }
    }
    return euler;
}

/* ---- simple voxels: the 27 around one are bits, x fastest ---- */

#define LOW_X 0x1249249u   /* those with x = 0 */
#define HIGH_X 0x4924924u
#define LOW_Y 0x1c0e07u
#define HIGH_Y 0x70381c0u
#define ALL 0x7ffffffu
#define CENTER 0x2000u
#define FACES 0x415410u   /* those that share a face with the center */
#define EDGES 0x2ebdebau   /* those that share a face or an edge with it */

static uint32_t along_x(uint32_t bits) { return (bits & ~HIGH_X) << 1 | (bits & ~LOW_X) >> 1; }
static uint32_t along_y(uint32_t bits) { return (bits & ~HIGH_Y) << 3 | (bits & ~LOW_Y) >> 3; }
static uint32_t along_z(uint32_t bits) { return (bits << 9 | bits >> 9) & ALL; }

/* Returns what is connected with `from` within `bits`: by faces, or by faces, edges and corners. */
static uint32_t connected(uint32_t from, uint32_t bits, bool corners)
{
    for (uint32_t before = 0; from != before;) {
        before = from;
        if (corners) {
            from |= along_x(from);
            from |= along_y(from);
            from |= along_z(from);
        } else {
            from |= along_x(from) | along_y(from) | along_z(from);
        }
        from &= bits;
    }
    return from;
}

static uint32_t lowest_bit(uint32_t bits) { return bits & (~bits + 1u); }

/* Returns true if the center may change its side: around it, one part inside touches it by a face, and one part is outside. */
static bool is_simple(uint32_t inside)
{
    const uint32_t near = inside & EDGES, faces = inside & FACES, outside = ~inside & ALL & ~CENTER;
    return faces && outside && (faces & ~connected(lowest_bit(faces), near, false)) == 0
        && connected(lowest_bit(outside), outside, true) == outside;
}

/* ---- growing ---- */

/* A region that grows from within (side 1) or from without (side -1). */
struct growth {
    const struct solid_grid *grid;
    const float *phi;
    const unsigned char *limbs; /* NULL: none known */
    float side;
    unsigned char *taken;
    uint32_t *around; /* of each voxel: those of the 27 around it that are taken */
    struct voxel_heap heap;
    int step[27];
};

static bool on_border(const struct solid_grid *grid, int at)
{
    const int *size = grid->size, place[3] = {at % size[0], at / size[0] % size[1], at / (size[0] * size[1])};
    for (int k = 0; k < 3; ++k) {
        if (place[k] < 1 || place[k] > size[k] - 2) { return true; }
    }
    return false;
}

/* Finds whether a voxel may join the region without a change of topology. */
static bool may_join(const struct growth *g, int at)
{
    return is_simple((g->side > 0.0f ? g->around[at] : ~g->around[at]) & ALL & ~CENTER);
}

/* Takes a voxel, and proposes what is around it and on its side. */
static void take(struct growth *g, int at)
{
    g->taken[at] = 1;
    for (int k = 0; k < 27; ++k) {
        const int next = at + g->step[k];
        const bool on_side = (g->phi[next] < 0.0f) == (g->side > 0.0f); /* phi 0 is outside */
        g->around[next] |= 1u << (26 - k);
        if (!g->taken[next] && on_side && g->heap.at[next] < 0 && !on_border(g->grid, next)) {
            voxel_heap_push(&g->heap, next, g->side * g->phi[next] - (g->limbs && g->limbs[next] ? FIRST : 0.0f));
        }
    }
}

/* Takes the grid's border, and proposes what is beside it and outside. */
static void take_border(struct growth *g)
{
    const int count = g->grid->size[0] * g->grid->size[1] * g->grid->size[2];
    for (int n = 0; n < count; ++n) { g->taken[n] = on_border(g->grid, n); }
    for (int n = 0; n < count; ++n) {
        for (int k = 0; k < 27 && !on_border(g->grid, n); ++k) { g->around[n] |= (uint32_t)g->taken[n + g->step[k]] << k; }
        if (g->around[n] && g->phi[n] >= 0.0f) { voxel_heap_push(&g->heap, n, -g->phi[n]); }
    }
}

/* Takes the deepest voxel. */
static void take_deepest(struct growth *g)
{
    const int *size = g->grid->size;
    int deepest = -1;
    for (int z = 1; z + 1 < size[2]; ++z) {
        for (int y = 1; y + 1 < size[1]; ++y) {
            const int row = (z * size[1] + y) * size[0];
            for (int n = row + 1; n < row + size[0] - 1; ++n) {
                if (g->phi[n] < 0.0f && (deepest < 0 || g->phi[n] < g->phi[deepest])) { deepest = n; }
            }
        }
    }
    if (deepest >= 0) { take(g, deepest); }
}

/* Grows the region as far as its topology lets it: from the deepest voxel, or from the grid's border. */
static void grow(struct growth *g)
{
    if (g->side > 0.0f) {
        take_deepest(g);
    } else {
        take_border(g);
    }
    for (int at; (at = voxel_heap_pop(&g->heap)) >= 0;) {
        if (may_join(g, at)) { take(g, at); }
    }
}

static bool start_growth(struct growth *g, const struct solid_grid *grid, const float *phi, const unsigned char *limbs, float side)
{
    const int *size = grid->size, count = size[0] * size[1] * size[2];
    g->grid = grid;
    g->phi = phi;
    g->limbs = limbs;
    g->side = side;
    for (int k = 0; k < 27; ++k) { g->step[k] = k % 3 - 1 + size[0] * (k / 3 % 3 - 1 + size[1] * (k / 9 - 1)); }
    g->taken = calloc((size_t)count, 1);
    g->around = calloc((size_t)count, sizeof *g->around);
    if (!g->taken || !g->around || !voxel_heap_create(&g->heap, count)) {
        free(g->taken);
        free(g->around);
        return false;
    }
    grow(g);
    return true;
}

static void end_growth(struct growth *g)
{
    voxel_heap_free(&g->heap);
    free(g->taken);
    free(g->around);
}

/* ---- films and cuts ---- */

/* Lists a film: voxels outside, not taken, connected with one of them by faces, edges or corners. Returns how many. Takes them. */
static int list_film(struct growth *g, int at, int *list)
{
    int end = 0;
    g->taken[at] = 1;
    list[end++] = at;
    for (int done = 0; done < end; ++done) {
        for (int k = 0; k < 27; ++k) {
            const int next = list[done] + g->step[k];
            if (!g->taken[next] && g->phi[next] >= 0.0f) {
                g->taken[next] = 1;
                list[end++] = next;
            }
        }
    }
    return end;
}

static bool close_tunnels(const struct solid_grid *grid, float *phi, int film, struct solid_handles *report)
{
    const int count = grid->size[0] * grid->size[1] * grid->size[2];
    struct growth g;
    if (!start_growth(&g, grid, phi, NULL, -1.0f)) { return false; }
    int *list = malloc((size_t)count * sizeof *list);
    for (int n = 0; list && n < count; ++n) {
        if (g.taken[n] || phi[n] < 0.0f) { continue; }
        const int found = list_film(&g, n, list);
        for (int i = 0; found <= film && i < found; ++i) { phi[list[i]] = -CUT; }
        report->filled += found <= film ? found : 0;
    }
    const bool good = list != NULL;
    free(list);
    end_growth(&g);
    return good;
}

/* Takes out what a region from within cannot take. The surface is half a voxel from there. */
static bool cut_rest(const struct solid_grid *grid, float *phi, const unsigned char *limbs, struct solid_handles *report)
{
    const int *size = grid->size, count = size[0] * size[1] * size[2], face[6] = {4, 10, 12, 14, 16, 22};
    struct growth g;
    if (!start_growth(&g, grid, phi, limbs, 1.0f)) { return false; }
    for (int n = 0; n < count; ++n) {
        if (g.taken[n] || phi[n] >= 0.0f) { continue; }
        phi[n] = CUT;
        ++report->cut;
        for (int k = 0; k < 6 && !on_border(grid, n); ++k) {
            float *beside = phi + n + g.step[face[k]];
            if (*beside < -CUT) { *beside = -CUT; }
        }
    }
    end_growth(&g);
    return true;
}

bool solid_cut_handles(const struct solid_grid *grid, float *phi, const unsigned char *limbs, int film, struct solid_handles *report)
{
    memset(report, 0, sizeof *report);
    if (solid_euler(grid, phi) == 1) { return true; }
    return (film == 0 || close_tunnels(grid, phi, film, report))
        && (solid_euler(grid, phi) == 1 || cut_rest(grid, phi, limbs, report));
}

void solid_mark_way(const struct solid_grid *grid, const float from[3], const float to[3], unsigned char *limbs)
{
    const int *size = grid->size;
    const float longest = fmaxf(fabsf(to[0] - from[0]), fmaxf(fabsf(to[1] - from[1]), fabsf(to[2] - from[2])));
    const int steps = (int)fminf(1000.0f, 4.0f * longest) + 1;
    for (int s = 0; s <= steps; ++s) {
        int at[3];
        bool within = true;
        for (int k = 0; k < 3; ++k) {
            const float place = from[k] + (to[k] - from[k]) * (float)s / (float)steps;
            within = within && place >= 0.0f && place < (float)size[k] - 1.0f;
            at[k] = within ? (int)place : 0;
        }
        for (int k = 0; within && k < 8; ++k) { /* all around the place, so that they are connected by faces */
            limbs[((at[2] + (k >> 2)) * size[1] + at[1] + (k >> 1 & 1)) * size[0] + at[0] + (k & 1)] = 1;
        }
    }
}
