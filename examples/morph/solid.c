/* solid.c - makes a closed body from a character's triangles, even if they are open, doubled or self-intersecting.
 *
 * 1. Inside is where the generalized winding number exceeds one half (springls_set_mesh): overlapping parts are united, open
 *    cuffs are closed by a film.
 * 2. Sheets, which have no inside, become solid: one voxel thick, or by --thicken (character/sheets.h).
 * 3. Cavities, which are not connected with the outside, are filled.
 * 4. Where a limb's parts do not meet, they are joined along its bones. Bodies that still touch nothing are connected with the largest
 *    one by bridges.
 * 5. Limbs too thin for the voxels become thicker (character/thin_places.h).
 * 6. Handles are undone, so that a body stays one however it touches itself in a pose (character/solid_handles.h). */
#include "morph/morph.h"

#include "base/vec3.h"
#include "character/sheets.h"
#include "character/solid_handles.h"
#include "character/thin_places.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FILM = 288 }; /* a tunnel that a film of one in so many voxels of the grid's square closes, 32 on grid 96, is no more than a gap
                      * between parts of a body */

void morph_to_voxel(const springls_grid_desc *grid, const float world[3], float voxel[3])
{
    for (int k = 0; k < 3; ++k) {
        voxel[k] = (float)(((double)world[k] - grid->origin[k]) / grid->spacing[k]);
    }
}

struct solid_grid morph_voxels(const springls_grid_desc *grid)
{
    const struct solid_grid voxels = {{grid->size[0], grid->size[1], grid->size[2]},
                                      {grid->origin[0], grid->origin[1], grid->origin[2]},
                                      grid->spacing[0]};
    return voxels;
}

/* Names the joint that moves the surface nearest to a voxel; both bodies are on the target's skeleton, if there is one. */
static const char *limb_at(const struct morph *morph, const struct character *c, const struct solid_grid *grid, int voxel)
{
    const struct character *skeleton = morph->target.character.joint_count > 0 ? &morph->target.character : c;
    const int at[3] = {voxel % grid->size[0], voxel / grid->size[0] % grid->size[1], voxel / (grid->size[0] * grid->size[1])};
    float best = INFINITY;
    int joint = 0;
    for (int v = 0; v < c->vertex_count; ++v) {
        float d[3];
        for (int k = 0; k < 3; ++k) { d[k] = c->positions[3 * v + k] - (float)(grid->origin[k] + grid->spacing * at[k]); }
        if (vec3_length(d) < best) {
            best = vec3_length(d);
            const struct influences *in = &c->influences[v];
            for (int k = 0, most = 0; k < CHARACTER_BONES; ++k) {
                most = in->weight[k] > in->weight[most] ? k : most;
                joint = in->joint[most];
            }
        }
    }
    return joint < skeleton->joint_count ? skeleton->joints[joint].name : "without a bone";
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
        fprintf(stderr,
                "morph: %s: sheets without an inside (%d, of %d triangles) are made one voxel thick; --thicken X for another "
                "thickness, 0 to leave them out\n",
                name, sheets->found, sheets->triangles);
    } else {
        fprintf(stderr, "morph: %s: sheets without an inside (%d, of %d triangles) are left out; --thicken 1 makes them solid\n",
                name, sheets->found, sheets->triangles);
    }
}

/* Makes sheets solid; fails where there is nothing else and they are to be left out. */
static bool thicken_sheets(const struct morph *morph, const char *name, const struct solid_grid *grid, float *phi,
                           const struct character *character, bool empty, struct morph_solid *solid)
{
    const float thicken = morph->settings.thicken < 0.0f ? 1.0f : morph->settings.thicken;
    unsigned char *sheet = malloc((size_t)character->triangle_count + 1);
    struct sheets found;
    bool good = (sheet && sheets_find(grid, phi, character, sheet, &found)) || morph_no_memory();
    if (good) {
        solid->sheet_triangles = found.triangles;
        solid->thickened = found.triangles > 0 ? thicken : 0.0f;
        good = !empty || (thicken > 0.0f && found.triangles > 0)
            || morph_fail("%s: encloses nothing%s", name, found.triangles > 0 ? ": a sheet; --thicken 1 makes it solid" : "");
    }
    if (good) {
        note_sheets(morph, name, &found);
        good = !(thicken > 0.0f) || sheets_thicken(grid, phi, character, sheet, thicken) || morph_no_memory();
    }
    free(sheet);
    return good;
}

/* Makes thin limbs and sheets thicker, with a note on stderr where that is more than 1/1000 of the body. For bone weights alone they
 * stay as they are. */
static bool thicken_limbs(const struct morph *morph, const char *name, const struct solid_grid *grid, float *phi,
                          struct morph_solid *solid)
{
    const size_t count = (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2];
    const float limbs = morph->settings.weights ? 0.0f : morph->settings.limbs;
    size_t inside = 0;
    solid->thin = limbs > 0.0f ? thin_places_thicken(grid, phi, limbs) : 0;
    for (size_t n = 0; n < count; ++n) { inside += phi[n] < 0.0f; }
    if (solid->thin > 0 && 1000 * (size_t)solid->thin > inside && !morph->settings.common.quiet) {
        fprintf(stderr,
                "morph: %s: what is thinner than %g voxels is made as thick, by %.1f %% of the volume; a finer --grid needs that less, "
                "--limbs 0 does not do it\n",
                name, (double)limbs, 100.0 * (double)solid->thin / (double)inside);
    }
    return solid->thin >= 0 || morph_no_memory();
}

/* Marks the bones of the skeleton that both bodies are on. Returns NULL if memory is short. */
static unsigned char *mark_bones(const struct morph *morph, const struct solid_grid *grid)
{
    const struct character *c = &morph->target.character;
    unsigned char *limbs = calloc((size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2], 1);
    for (int j = 0; limbs && j < c->joint_count; ++j) {
        float from[3], to[3];
        if (c->joints[j].parent < 0 || !c->joints[c->joints[j].parent].bone) { continue; }
        joint_place(&c->joints[c->joints[j].parent], from);
        joint_place(&c->joints[j], to);
        morph_to_voxel(&morph->grid, from, from);
        morph_to_voxel(&morph->grid, to, to);
        solid_mark_way(grid, from, to, limbs);
    }
    return limbs;
}

/* ---- gaps ---- */

#define GAP 1.5f        /* voxels: a bone that is outside for longer leaves the body... */
#define DETOUR 4.0f     /* ...and what it enters then is another part of the limb if the body leads there by a way so many times as long */
#define GAP_RADIUS 1.0f /* voxel */

/* What a search within the body needs; a gap's search leaves it as it was. */
struct search {
    int *queue;          /* a voxel each */
    unsigned char *seen; /* 0 */
};

/* Adds the neighbours of a voxel that are inside and not seen yet. Returns how many voxels the queue has. */
static int add_neighbors(const struct solid_grid *grid, const float *phi, int voxel, const struct search *search, int end)
{
    const int *size = grid->size, at[3] = {voxel % size[0], voxel / size[0] % size[1], voxel / (size[0] * size[1])};
    int lo[3], hi[3];
    for (int k = 0; k < 3; ++k) {
        lo[k] = at[k] > 0 ? at[k] - 1 : 0;
        hi[k] = at[k] + 1 < size[k] ? at[k] + 1 : at[k];
    }
    for (int z = lo[2]; z <= hi[2]; ++z) {
        for (int y = lo[1]; y <= hi[1]; ++y) {
            for (int x = lo[0]; x <= hi[0]; ++x) {
                const int next = (z * size[1] + y) * size[0] + x;
                if (!search->seen[next] && phi[next] < 0.0f) {
                    search->seen[next] = 1;
                    search->queue[end++] = next;
                }
            }
        }
    }
    return end;
}

/* Finds whether a voxel is reached from another one within the body in so many steps. */
static bool is_reached(const struct solid_grid *grid, const float *phi, int from, int to, int steps, const struct search *search)
{
    int end = 0;
    search->queue[end++] = from;
    search->seen[from] = 1;
    for (int done = 0, ring_end = 1; done < end && steps > 0 && !search->seen[to]; ++done) {
        if (done == ring_end) {
            ring_end = end;
            if (--steps == 0) { break; }
        }
        end = add_neighbors(grid, phi, search->queue[done], search, end);
    }
    const bool found = search->seen[to] != 0;
    for (int n = 0; n < end; ++n) { search->seen[search->queue[n]] = 0; }
    return found;
}

static int voxel_at(const int size[3], const float place[3])
{
    return ((int)(place[2] + 0.5f) * size[1] + (int)(place[1] + 0.5f)) * size[0] + (int)(place[0] + 0.5f);
}

/* Where a walk along bones was inside last. */
struct inside {
    bool known;
    float place[3];
};

/* Walks along a bone and joins what it leaves with what it enters, unless the body itself leads there by no great detour. above: of the
 * walk down to its joint; where that was never inside, the first place inside on this bone, for others that begin there. */
static void join_along(const struct solid_grid *grid, float *phi, const float from[3], const float to[3], const struct search *search,
                       struct inside *above, struct inside *below)
{
    float way[3], gap[3], place[3];
    *below = *above;
    vec3_sub(to, from, way);
    const int steps = (int)ceilf(2.0f * vec3_length(way)) + 1;
    for (int s = 0; s <= steps; ++s) {
        bool within = true;
        vec3_add_scaled(from, (float)s / (float)steps, way, place);
        for (int k = 0; k < 3; ++k) { within = within && place[k] >= 1.0f && place[k] < (float)grid->size[k] - 2.0f; }
        if (!within || phi[voxel_at(grid->size, place)] >= 0.0f) { continue; }
        vec3_sub(place, below->place, gap);
        if (below->known && vec3_length(gap) > GAP) {
            const int detour = (int)(DETOUR * vec3_length(gap)), before = voxel_at(grid->size, below->place);
            if (!is_reached(grid, phi, before, voxel_at(grid->size, place), detour, search)) {
                morph_add_rod(grid->size, phi, below->place, place, GAP_RADIUS, GAP_RADIUS);
            }
        }
        below->known = true;
        memcpy(below->place, place, sizeof place);
        if (!above->known) { *above = *below; }
    }
}

/* Joins the parts of limbs along the bones of the skeleton that both bodies are on, however far apart: a bone says what belongs
 * together, so that --reach does not limit it. */
static bool join_gaps(const struct morph *morph, const struct solid_grid *grid, float *phi)
{
    const struct character *c = &morph->target.character;
    const size_t count = (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2];
    struct inside *inside = calloc((size_t)c->joint_count + 1, sizeof *inside);
    const struct search search = {malloc(count * sizeof *search.queue), calloc(count, 1)};
    const bool good = inside && search.queue && search.seen;
    for (int j = 0; good && j < c->joint_count; ++j) { /* parents first */
        const int up = c->joints[j].parent;
        float from[3], to[3];
        if (up < 0 || !c->joints[up].bone) { continue; }
        joint_place(&c->joints[up], from);
        joint_place(&c->joints[j], to);
        morph_to_voxel(&morph->grid, from, from);
        morph_to_voxel(&morph->grid, to, to);
        join_along(grid, phi, from, to, &search, &inside[up], &inside[j]);
    }
    free(inside);
    free(search.queue);
    free(search.seen);
    return good || morph_no_memory();
}

/* ---- handles ---- */

/* Closes small tunnels and cuts handles. For bone weights alone they stay. */
static bool cut_handles(const struct morph *morph, const char *name, const struct solid_grid *grid, const unsigned char *limbs,
                        float *phi, struct morph_solid *solid)
{
    struct solid_handles handles = {0, 0};
    const int cells = morph->settings.common.grid;
    if (morph->settings.weights) { return true; }
    if (!solid_cut_handles(grid, phi, limbs, cells * cells / FILM, &handles)) { return morph_no_memory(); }
    solid->tunnels = handles.filled;
    solid->cut = handles.cut;
    if (solid->cut > 0 && !morph->settings.common.quiet) {
        fprintf(stderr, "morph: %s: handles, such as an arm's that touches the hip, are cut by a crevice, of %d voxels in all\n", name,
                solid->cut);
    }
    return true;
}

/* Computes phi of the triangles; `empty`: they enclose nothing. */
static bool sample_phi(springls_context *ctx, const char *name, const struct character *character, size_t voxels, float *phi,
                       bool *empty, struct morph_solid *solid)
{
    springls_mesh_report report;
    memset(&report, 0, sizeof report);
    const springls_status status = springls_set_mesh(ctx, character->positions, character->vertex_count, 0, character->triangles,
                                                     character->triangle_count, &report);
    *empty = status == SPRINGLS_BAD_MESH;
    solid->boundary_edges = report.boundary_edges;
    solid->nonmanifold_edges = report.nonmanifold_edges;
    solid->input_components = report.components;
    for (size_t n = 0; *empty && n < voxels; ++n) {
        phi[n] = springls_get_params(ctx).band_half_width;
    }
    return *empty || (morph_check(ctx, status, name) && morph_check(ctx, springls_copy_level_set(ctx, phi), name));
}

bool morph_solid_make(const struct morph *morph, springls_context *ctx, const springls_grid_desc *grid, const char *path,
                      const struct character *character, struct morph_solid *solid)
{
    const struct solid_grid voxels = morph_voxels(grid);
    const size_t count = (size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2];
    const char *name = morph_name(path);
    const int reach = morph->settings.reach;
    struct solid_repair repair;
    bool empty = false;
    float *phi = malloc(count * sizeof *phi);
    unsigned char *limbs = mark_bones(morph, &voxels);
    memset(solid, 0, sizeof *solid);
    bool good = ((phi && limbs) || morph_no_memory()) && sample_phi(ctx, name, character, count, phi, &empty, solid)
        && thicken_sheets(morph, name, &voxels, phi, character, empty, solid)
        && (morph->settings.weights || join_gaps(morph, &voxels, phi))
        && (solid_repair(&voxels, phi, limbs, reach, false, &repair) || morph_no_memory());
    if (good) {
        solid->filled = repair.filled;
        solid->found = repair.parts;
        solid->joined = repair.joined;
        solid->dropped_voxels = repair.dropped;
        good = repair.out_of_reach == 0
            || morph_fail("%s: a body of %d voxels at joint %s touches nothing within %d voxels (see --reach)", name,
                          repair.out_of_reach, limb_at(morph, character, &voxels, repair.out_of_reach_at), reach);
    }
    good = good && thicken_limbs(morph, name, &voxels, phi, solid) && cut_handles(morph, name, &voxels, limbs, phi, solid)
        && morph_check(ctx, springls_set_level_set(ctx, phi), name);
    free(phi);
    free(limbs);
    return good;
}
