/* solid.c - makes a closed body from a character's triangles, even if they are open, doubled or self-intersecting.
 *
 * 1. Inside is where the generalized winding number exceeds one half (springls_set_mesh): overlapping parts are united, open
 *    cuffs are closed by a film.
 * 2. Sheets, which have no inside, become solid: one voxel thick, or as --thicken says (character/sheets.h).
 * 3. Cavities, which are not connected with the outside, are filled.
 * 4. The largest connected bodies are kept. */
#include "morph/morph.h"

#include "character/sheets.h"

#include <stdio.h>
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

/* ---- sheets ---- */

/* Prints on stderr what happens to sheets. */
static void note_sheets(const struct morph *morph, const char *name, const struct sheets *sheets)
{
    const float thicken = morph->settings.thicken;
    if (sheets->triangles == 0 || thicken > 0.0f || morph->settings.common.quiet) {
        return;
    }
    if (thicken < 0.0f) {
        fprintf(stderr, "morph: %s: sheets without an inside (%d, of %d triangles) are made one voxel thick; --thicken X for another thickness, "
                "0 to leave them out\n", name, sheets->found, sheets->triangles);
    } else {
        fprintf(stderr, "morph: %s: sheets without an inside (%d, of %d triangles) are left out; --thicken 1 makes them solid\n", name,
                sheets->found, sheets->triangles);
    }
}

/* Makes sheets solid; fails where there is nothing else and they are to be left out. */
static bool thicken_sheets(const struct morph *morph, const char *name, struct voxels *v, const struct character *character, bool empty,
                           struct morph_solid *solid)
{
    const springls_grid_desc *grid = v->grid;
    const struct solid_grid g = {{grid->size[0], grid->size[1], grid->size[2]}, {grid->origin[0], grid->origin[1], grid->origin[2]},
                                 grid->spacing[0]};
    const float thicken = morph->settings.thicken < 0.0f ? 1.0f : morph->settings.thicken;
    unsigned char *sheet = malloc((size_t)character->triangle_count + 1);
    struct sheets found;
    bool good = (sheet && sheets_find(&g, v->phi, character, sheet, &found)) || morph_no_memory();
    if (good) {
        solid->sheet_triangles = found.triangles;
        solid->thickened = found.triangles > 0 ? thicken : 0.0f;
        good = !empty || (thicken > 0.0f && found.triangles > 0)
            || morph_fail("%s: encloses nothing%s", name, found.triangles > 0 ? ": a sheet; --thicken 1 makes it solid" : "");
    }
    if (good) {
        note_sheets(morph, name, &found);
        good = !(thicken > 0.0f) || sheets_thicken(&g, v->phi, character, sheet, thicken) || morph_no_memory();
    }
    free(sheet);
    return good;
}

/* Computes phi of the triangles; `empty`: they enclose nothing. */
static bool sample_phi(springls_context *ctx, const char *name, const struct character *character, struct voxels *v, bool *empty,
                       struct morph_solid *solid)
{
    springls_mesh_report report;
    memset(&report, 0, sizeof report);
    const springls_status status = springls_set_mesh(ctx, character->positions, character->vertex_count, 0, character->triangles,
                                                     character->triangle_count, &report);
    *empty = status == SPRINGLS_BAD_MESH;
    solid->boundary_edges = report.boundary_edges;
    solid->nonmanifold_edges = report.nonmanifold_edges;
    solid->input_components = report.components;
    for (size_t n = 0; *empty && n < v->count; ++n) {
        v->phi[n] = springls_get_params(ctx).band_half_width;
    }
    return *empty || (morph_check(ctx, status, name) && morph_check(ctx, springls_copy_level_set(ctx, v->phi), name));
}

bool morph_solid_make(const struct morph *morph, springls_context *ctx, const springls_grid_desc *grid, const char *path,
                      const struct character *character, struct morph_solid *solid)
{
    struct voxels v;
    bool empty = false;
    const char *name = path ? path : "built in";
    memset(solid, 0, sizeof *solid);
    bool good = (voxels_create(grid, &v) || morph_no_memory()) && sample_phi(ctx, name, character, &v, &empty, solid)
        && thicken_sheets(morph, name, &v, character, empty, solid);
    if (good) {
        fill_cavities(&v, solid);
        good = keep_bodies(&v, morph->settings.parts, solid) || morph_no_memory();
    }
    good = good && morph_check(ctx, springls_set_level_set(ctx, v.phi), name);
    voxels_free(&v);
    return good;
}
