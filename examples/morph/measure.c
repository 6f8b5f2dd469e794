/* measure.c - how near the model is to the target, in a frame and at the end, and whether its surface is closed. */
#include "morph/morph.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Measures |phi| of the target at the model's particles. */
static void measure_stray(const struct morph *morph, struct morph_frame *frame)
{
    const springls_view particles = springls_view_particles(morph->ctx);
    frame->distance = frame->stray = 0.0;
    for (int i = 0; i < particles.count; ++i) {
        const double voxels = fabs((double)morph_sample(morph->grid.size, morph->target_phi, morph_springl_item(particles, i)));
        frame->distance += voxels / particles.count;
        frame->stray = fmax(frame->stray, voxels);
    }
}

/* Measures |phi| of the model at vertices of the target, except those inside it, where it overlaps itself. */
static bool measure_missing(const struct morph *morph, struct morph_frame *frame)
{
    const struct morph_body *target = &morph->target;
    const size_t vertices = (size_t)target->mesh.vertex_count + 1;
    float *world = malloc(3 * vertices * sizeof *world), *distance = malloc(vertices * sizeof *distance);
    int count = 0;
    for (int v = 0; world && v < target->mesh.vertex_count; ++v) {
        float place[3];
        morph_to_voxel(&morph->grid, target->posed + 3 * v, place);
        if (fabsf(morph_sample(morph->grid.size, morph->target_phi, place)) < 0.5f) {
            memcpy(world + 3 * count++, target->posed + 3 * v, sizeof place);
        }
    }
    bool good = (world && distance) || morph_no_memory();
    good = good && morph_check(morph->ctx, springls_sample_distance(morph->ctx, world, count, distance), "distance");
    frame->missing = frame->far = frame->worst = 0.0;
    for (int i = 0; good && i < count; ++i) {
        const double voxels = fabs((double)distance[i]) / morph->grid.spacing[0];
        frame->missing += voxels / count;
        frame->far += voxels > 1.0 ? 1.0 / count : 0.0;
        frame->worst = fmax(frame->worst, voxels);
    }
    free(world);
    free(distance);
    return good;
}

/* Measures the model's limbs. */
static bool measure_limbs(const struct morph *morph, struct morph_frame *frame)
{
    float *model = malloc(morph_voxel_count(morph) * sizeof *model);
    const bool good = (model || morph_no_memory()) && morph_check(morph->ctx, springls_copy_level_set(morph->ctx, model), "level set");
    if (good) { frame->limb = (double)morph_thinnest_limb(morph, frame->share, model, &frame->limb_joint); }
    free(model);
    return good;
}

/* Leaves specks out of a mesh. Returns how many, -1: memory. */
static int drop_specks(const struct morph *morph, springls_mesh *mesh)
{
    const double voxel = morph->grid.spacing[0];
    return mesh_drop_specks(mesh->positions, mesh->vertex_count, mesh->triangles, &mesh->triangle_count,
                            MORPH_SPECK * voxel * voxel * voxel);
}

/* Counts what the last steps have done, and checks the mesh. */
static bool measure_mesh(const struct morph *morph, struct morph_frame *frame)
{
    const springls_mesh *mesh = &frame->mesh;
    const springls_stats stats = springls_get_stats(morph->ctx);
    const double voxel = morph->grid.spacing[0];
    frame->springls = stats.springls;
    frame->split = stats.split;
    frame->added = stats.added;
    frame->removed = stats.removed;
    frame->volume = mesh_volume(mesh->positions, mesh->triangles, mesh->triangle_count) / (voxel * voxel * voxel);
    return mesh_check(mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count, &frame->check) || morph_no_memory();
}

bool morph_measure(const struct morph *morph, struct morph_frame *frame)
{
    measure_stray(morph, frame);
    if (!measure_missing(morph, frame) || !measure_limbs(morph, frame)
        || !morph_check(morph->ctx, springls_extract_mesh(morph->ctx, &frame->mesh), "mesh")
        || !morph_look(morph, frame)) {
        return false;
    }
    frame->specks = drop_specks(morph, &frame->mesh);
    return frame->specks < 0 ? morph_no_memory() : measure_mesh(morph, frame);
}

bool morph_compare_ends(struct morph *morph)
{
    const struct morph_frame *last = &morph->frames[morph->frame_count - 1];
    const struct surface mine = {last->mesh.positions, (const uint32_t *)last->mesh.triangles, (size_t)last->mesh.triangle_count};
    const double voxel = morph->grid.spacing[0];
    springls_mesh *mesh = &morph->target_mesh;
    if (!morph_check(morph->other,
                     springls_set_mesh(morph->other, morph->target.posed, morph->target.mesh.vertex_count, 0,
                                       morph->target.mesh.triangles, morph->target.mesh.triangle_count, NULL),
                     "target")
        || !morph_check(morph->other, springls_extract_mesh(morph->other, mesh), "target")) {
        return false;
    }
    if (drop_specks(morph, mesh) < 0) {
        return morph_no_memory();
    }
    if (mine.triangle_count == 0 || mesh->triangle_count == 0) {
        return morph_fail("%s has no part of %d voxels: take a finer --grid", mesh->triangle_count == 0 ? "the target" : "the model",
                          MORPH_SPECK);
    }
    const struct surface target = {mesh->positions, (const uint32_t *)mesh->triangles, (size_t)mesh->triangle_count};
    return surface_distances_measure(&mine, &target, 20000, voxel, &morph->end) || morph_no_memory();
}
