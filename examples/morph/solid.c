/* solid.c - makes a closed body from a character's triangles, even if they are open, doubled or self-intersecting.
 *
 * 1. Inside is where the generalized winding number exceeds one half (springls_set_mesh): overlapping parts are united, open
 *    cuffs are closed by a film.
 * 2. With thicken > 0 everything within half that distance of a triangle is inside too: capes and hems become solid sheets.
 * 3. Cavities, which are not connected with the outside, are filled.
 * 4. The largest connected bodies are kept. */
#include "morph/morph.h"

#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

struct voxels {
    const springls_grid_desc *grid;
    size_t count;
    float *phi;
    int *label; /* 0: not labeled yet */
    int *queue;
};

static bool voxels_create(const springls_grid_desc *grid, struct voxels *v)
{
    v->grid = grid;
    v->count = (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2];
    v->phi = malloc(v->count * sizeof *v->phi);
    v->label = calloc(v->count, sizeof *v->label);
    v->queue = malloc(v->count * sizeof *v->queue);
    return v->phi && v->label && v->queue;
}

static void voxels_free(struct voxels *v)
{
    free(v->phi);
    free(v->label);
    free(v->queue);
}

/* Labels all voxels that are connected by faces with voxel `first` on its side; returns how many. */
static int flood(struct voxels *v, int first, int label)
{
    const int *size = v->grid->size, step[3] = {1, size[0], size[0] * size[1]};
    const bool inside = v->phi[first] < 0.0f;
    int done = 0, end = 0;
    v->queue[end++] = first;
    v->label[first] = label;
    while (done < end) {
        const int at = v->queue[done++], place[3] = {at % size[0], at / size[0] % size[1], at / step[2]};
        for (int k = 0; k < 6; ++k) {
            const int axis = k / 2, sign = k % 2 ? 1 : -1, next = at + sign * step[axis];
            if (place[axis] + sign >= 0 && place[axis] + sign < size[axis] && v->label[next] == 0
                && (v->phi[next] < 0.0f) == inside) {
                v->label[next] = label;
                v->queue[end++] = next;
            }
        }
    }
    return end;
}

/* Fills cavities: what is not connected with voxel 0, since the grid's border is outside. */
static void fill_cavities(struct voxels *v, struct morph_solid *solid)
{
    memset(v->label, 0, v->count * sizeof *v->label);
    flood(v, 0, 1);
    for (size_t n = 0; n < v->count; ++n) {
        if (v->phi[n] >= 0.0f && v->label[n] == 0) {
            v->phi[n] = -v->phi[n] - 1e-3f;
            ++solid->filled;
        }
    }
}

struct body {
    int label, voxels;
};

static int compare_bodies(const void *a, const void *b)
{
    const struct body *e = a, *f = b;
    return e->voxels != f->voxels ? (e->voxels < f->voxels) - (e->voxels > f->voxels)
                                  : (e->label > f->label) - (e->label < f->label);
}

static bool keep_bodies(struct voxels *v, int parts, struct morph_solid *solid)
{
    int room = 64;
    struct body *bodies = malloc((size_t)room * sizeof *bodies);
    memset(v->label, 0, v->count * sizeof *v->label);
    for (size_t n = 0; bodies && n < v->count; ++n) {
        if (v->phi[n] < 0.0f && v->label[n] == 0) {
            if (solid->found == room) {
                struct body *grown = realloc(bodies, (size_t)(room *= 2) * sizeof *bodies);
                if (!grown) {
                    free(bodies);
                    return false;
                }
                bodies = grown;
            }
            const int label = solid->found + 1;
            bodies[solid->found].label = label;
            bodies[solid->found++].voxels = flood(v, (int)n, label);
        }
    }
    if (!bodies) {
        return false;
    }
    qsort(bodies, (size_t)solid->found, sizeof *bodies, compare_bodies);
    solid->kept = parts > 0 && parts < solid->found ? parts : solid->found;
    for (int b = solid->kept; b < solid->found; ++b) {
        solid->dropped_voxels += bodies[b].voxels;
        for (size_t n = 0; n < v->count; ++n) {
            if (v->label[n] == bodies[b].label) {
                v->phi[n] = -v->phi[n] + 1e-3f;
            }
        }
    }
    free(bodies);
    return true;
}

/* Converts a world position to voxel coordinates. */
static void to_voxel(const springls_grid_desc *grid, const float world[3], float voxel[3])
{
    for (int k = 0; k < 3; ++k) {
        voxel[k] = (float)(((double)world[k] - grid->origin[k]) / grid->spacing[k]);
    }
}

/* Sets phi = min(phi, distance to the triangle - half the thickness) in the box around each triangle. */
static bool thicken_sheets(struct voxels *v, const struct character *character, float thickness)
{
    const int *size = v->grid->size;
    for (int t = 0; t < character->triangle_count; ++t) {
        float corners[9];
        struct bvh one;
        int lo[3], hi[3];
        for (int k = 0; k < 3; ++k) {
            to_voxel(v->grid, character->positions + 3 * character->triangles[3 * t + k], corners + 3 * k);
        }
        for (int i = 0; i < 3; ++i) {
            const float low = fminf(corners[i], fminf(corners[3 + i], corners[6 + i])) - thickness;
            const float high = fmaxf(corners[i], fmaxf(corners[3 + i], corners[6 + i])) + thickness;
            lo[i] = (int)fmaxf(1.0f, floorf(low));
            hi[i] = (int)fminf((float)size[i] - 2.0f, ceilf(high));
        }
        if (!bvh_build(&one, corners, NULL, 1)) {
            return false;
        }
        for (int z = lo[2]; z <= hi[2]; ++z) {
            for (int y = lo[1]; y <= hi[1]; ++y) {
                for (int x = lo[0]; x <= hi[0]; ++x) {
                    const float p[3] = {(float)x, (float)y, (float)z};
                    float *phi = v->phi + ((size_t)z * (size_t)size[1] + (size_t)y) * (size_t)size[0] + (size_t)x;
                    *phi = fminf(*phi, bvh_distance(&one, p, NULL, NULL) - 0.5f * thickness);
                }
            }
        }
        bvh_free(&one);
    }
    return true;
}

bool morph_solid_make(springls_context *ctx, const springls_grid_desc *grid, const struct character *character, float thicken,
                      int parts, struct morph_solid *solid)
{
    struct voxels v;
    springls_mesh_report report;
    memset(solid, 0, sizeof *solid);
    bool good = voxels_create(grid, &v) || morph_no_memory();
    good = good
           && morph_check(ctx,
                          springls_set_mesh(ctx, character->positions, character->vertex_count, 0, character->triangles,
                                            character->triangle_count, &report),
                          "character")
           && morph_check(ctx, springls_copy_level_set(ctx, v.phi), "character");
    if (good) {
        solid->boundary_edges = report.boundary_edges;
        solid->nonmanifold_edges = report.nonmanifold_edges;
        solid->input_components = report.components;
        good = !(thicken > 0.0f) || thicken_sheets(&v, character, thicken) || morph_no_memory();
    }
    if (good) {
        fill_cavities(&v, solid);
        good = keep_bodies(&v, parts, solid) || morph_no_memory();
    }
    good = good && morph_check(ctx, springls_set_level_set(ctx, v.phi), "character");
    voxels_free(&v);
    return good;
}
