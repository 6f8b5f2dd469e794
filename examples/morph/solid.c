/* solid.c - makes a closed body from a character's triangles, even if they are open, doubled or self-intersecting.
 *
 * 1. Inside is where the generalized winding number exceeds one half (springls_set_mesh): overlapping parts are united, open
 *    cuffs are closed by a film.
 * 2. With thicken > 0 everything within half that distance of a triangle is inside too: capes and hems become solid sheets.
 * 3. Cavities, which are not connected with the outside, are filled.
 * 4. Bodies that touch nothing are connected with the largest one by bridges. */
#include "morph/morph.h"

#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

void morph_to_voxel(const springls_grid_desc *grid, const float world[3], float voxel[3])
{
    for (int k = 0; k < 3; ++k) {
        voxel[k] = (float)(((double)world[k] - grid->origin[k]) / grid->spacing[k]);
    }
}

/* Sets phi = min(phi, distance to the triangle - half the thickness) in the box around each triangle. */
static bool thicken_sheets(const springls_grid_desc *grid, float *level_set, const struct character *character, float thickness)
{
    const int *size = grid->size;
    for (int t = 0; t < character->triangle_count; ++t) {
        float corners[9];
        struct bvh one;
        int lo[3], hi[3];
        for (int k = 0; k < 3; ++k) {
            morph_to_voxel(grid, character->positions + 3 * character->triangles[3 * t + k], corners + 3 * k);
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
                    float *phi = level_set + ((size_t)z * (size_t)size[1] + (size_t)y) * (size_t)size[0] + (size_t)x;
                    *phi = fminf(*phi, bvh_distance(&one, p, NULL, NULL) - 0.5f * thickness);
                }
            }
        }
        bvh_free(&one);
    }
    return true;
}

struct solid_grid morph_voxels(const springls_grid_desc *grid)
{
    const struct solid_grid voxels = {{grid->size[0], grid->size[1], grid->size[2]},
                                      {grid->origin[0], grid->origin[1], grid->origin[2]},
                                      grid->spacing[0]};
    return voxels;
}

/* Names the joint that moves the surface nearest to a voxel. */
static const char *limb_at(const struct character *c, const struct solid_grid *grid, int voxel)
{
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
    return c->joint_count > 0 ? c->joints[joint].name : "without a bone";
}

bool morph_solid_make(springls_context *ctx, const springls_grid_desc *grid, const struct character *character, float thicken,
                      int reach, struct morph_solid *solid)
{
    const struct solid_grid voxels = morph_voxels(grid);
    struct solid_repair repair;
    springls_mesh_report report;
    float *phi = malloc((size_t)grid->size[0] * (size_t)grid->size[1] * (size_t)grid->size[2] * sizeof *phi);
    memset(solid, 0, sizeof *solid);
    bool good = phi || morph_no_memory();
    good = good
           && morph_check(ctx,
                          springls_set_mesh(ctx, character->positions, character->vertex_count, 0, character->triangles,
                                            character->triangle_count, &report),
                          "character")
           && morph_check(ctx, springls_copy_level_set(ctx, phi), "character");
    good = good && (!(thicken > 0.0f) || thicken_sheets(grid, phi, character, thicken) || morph_no_memory())
        && (solid_repair(&voxels, phi, reach, &repair) || morph_no_memory());
    if (good) {
        solid->boundary_edges = report.boundary_edges;
        solid->nonmanifold_edges = report.nonmanifold_edges;
        solid->input_components = report.components;
        solid->filled = repair.filled;
        solid->found = repair.parts;
        solid->joined = repair.joined;
        solid->dropped_voxels = repair.dropped;
        good = repair.out_of_reach == 0
            || morph_fail("a body of %d voxels at joint %s touches nothing within %d voxels (see --reach)", repair.out_of_reach,
                          limb_at(character, &voxels, repair.out_of_reach_at), reach);
    }
    good = good && morph_check(ctx, springls_set_level_set(ctx, phi), "character");
    free(phi);
    return good;
}
