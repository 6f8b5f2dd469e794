/* Atlases of label maps with noisy borders, specks and holes (examples/atlas/subject.c). Compiled like test_common.c, else
 * skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_atlas_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_atlas_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "../../examples/atlas/atlas.h"
#include "../../examples/common/base/vec3.h"
#include "../../examples/common/surface/mesh_check.h"
#include "scratch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SUBJECTS = 3, SIDE = 44 };

static const float pi = 3.14159265f;

/* Equally distributed in 0..1. */
static float chance(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / 16777216.0f;
}

/* Writes an ellipsoid about the middle of a grid of voxels of 1 mm. noise: how often a voxel within 1.5 mm of the border is on the
 * wrong side; within 6 mm an eighth as often. */
static bool write_ellipsoid(const char *path, const float half[3], float noise, uint32_t seed)
{
    const int dims[3] = {SIDE, SIDE, SIDE};
    const float spacing[3] = {1.0f, 1.0f, 1.0f}, origin[3] = {0.0f, 0.0f, 0.0f};
    struct volume volume;
    char error[VOLUME_TEXT];
    if (!volume_create(dims, spacing, origin, &volume)) return false;
    uint8_t *mask = malloc(volume_voxels(&volume));
    for (size_t n = 0; mask && n < volume_voxels(&volume); ++n) {
        const size_t at[3] = {n % SIDE, n / SIDE % SIDE, n / (SIDE * SIDE)};
        float square = 0.0f;
        for (int a = 0; a < 3; ++a) square += powf(((float)at[a] - 0.5f * (SIDE - 1)) / half[a], 2.0f);
        const float depth = (1.0f - sqrtf(square)) * half[1]; /* mm, about */
        const bool wrong = chance(&seed) < (fabsf(depth) < 1.5f ? noise : fabsf(depth) < 6.0f ? 0.125f * noise : 0.0f);
        mask[n] = (depth > 0.0f) != wrong;
    }
    const bool good = mask && volume_write(path, &volume, VOLUME_UINT8, mask, error);
    free(mask);
    volume_free(&volume);
    return good;
}

static const float halves[SUBJECTS][3] = {{13.0f, 10.0f, 9.0f}, {14.0f, 10.0f, 9.0f}, {15.0f, 10.5f, 9.0f}};

/* Returns how many triangles of a mesh face against the target's surface where they lie. */
static int facing_against(const struct target *target, const float *points, const struct shape_mesh *mesh)
{
    const struct similarity identity = similarity_identity();
    int against = 0;
    for (int t = 0; t < mesh->triangle_count; ++t) {
        struct target_hit hit;
        float corners[9], middle[3] = {0.0f, 0.0f, 0.0f}, normal[3];
        for (int k = 0; k < 3; ++k) {
            memcpy(corners + 3 * k, points + 3 * mesh->triangles[3 * t + k], 3 * sizeof *corners);
            vec3_add_scaled(middle, 1.0f / 3.0f, corners + 3 * k, middle);
        }
        vec3_triangle_normal(corners, normal);
        target_nearest(target, &identity, middle, &hit);
        against += vec3_dot(hit.normal, normal) < 0.0f;
    }
    return against;
}

/* Near the border three voxels in ten are on the wrong side, with specks and holes further away: the subjects' surfaces are one
 * smooth body of the ellipsoid's volume, and the corresponding meshes have no folds. */
TEST ragged_subjects_correspond_without_folds(void)
{
    struct atlas_build build;
    memset(&build, 0, sizeof build);
    build.settings = (struct atlas_build_settings){.common = cli_common_defaults(), .orientation = "auto", .rounds = 2,
                                                   .modes = ATLAS_MAX_MODES, .count = SUBJECTS};
    build.settings.common.quiet = true;
    build.params = springls_default_params();
    for (int s = 0; s < SUBJECTS; ++s) {
        char name[32];
        snprintf(name, sizeof name, "ragged%d.nii", s);
        build.settings.names[s] = scratch(name);
        ASSERT(write_ellipsoid(build.settings.names[s], halves[s], 0.3f, 7u + (uint32_t)s));
    }
    ASSERT(atlas_build_run(&build));
    const struct shape_mesh *mesh = &build.template.mesh;
    ASSERT_EQ(1, mesh_components(mesh->vertex_count, mesh->triangles, mesh->triangle_count));
    for (int s = 0; s < SUBJECTS; ++s) {
        const struct atlas_subject *subject = &build.subjects[s];
        const struct shape_mesh *own = &subject->mesh;
        const double volume = 4.0 / 3.0 * (double)(pi * halves[s][0] * halves[s][1] * halves[s][2]);
        ASSERT_EQ(1, mesh_components(own->vertex_count, own->triangles, own->triangle_count));
        ASSERT_IN_RANGE(volume, mesh_volume(own->positions, own->triangles, own->triangle_count), 0.05 * volume);
        ASSERT_IN_RANGE(volume, mesh_volume(subject->shape, mesh->triangles, mesh->triangle_count), 0.05 * volume);
        ASSERT_EQ(0.0, mesh_bent_edges(subject->shape, mesh->triangles, mesh->triangle_count, -0.5f));
        ASSERT_EQ(0, facing_against(&subject->target, subject->shape, mesh));
        ASSERT(subject->mean_distance < 0.1 * build.atlas.voxel);
    }
    atlas_build_free(&build);
    PASS();
}

/* Noise moves the surface by a third of a voxel on average. */
TEST ragged_and_clean_maps_have_the_same_surface(void)
{
    struct atlas_subject clean, ragged;
    const char *names[2] = {scratch("clean.nii"), scratch("noisy.nii")};
    for (int n = 0; n < 2; ++n) ASSERT(write_ellipsoid(names[n], halves[0], 0.3f * (float)n, 3));
    ASSERT(atlas_subject_read(names[0], NULL, NULL, false, &clean));
    ASSERT(atlas_subject_read(names[1], NULL, NULL, false, &ragged));
    const struct similarity identity = similarity_identity();
    double sum = 0.0, worst = 0.0;
    for (int v = 0; v < ragged.mesh.vertex_count; ++v) {
        struct target_hit hit;
        target_nearest(&clean.target, &identity, ragged.mesh.positions + 3 * v, &hit);
        sum += fabs((double)hit.signed_distance) / ragged.mesh.vertex_count;
        worst = fmax(worst, fabs((double)hit.signed_distance));
    }
    ASSERT(sum < 0.5);
    ASSERT(worst < 2.0);
    atlas_subject_free(&clean);
    atlas_subject_free(&ragged);
    PASS();
}

TEST folds_bend_edges(void)
{
    const float flat[12] = {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f, 1.0f, 0.0f, 0.0f, 1.0f, 0.0f};
    float folded[12];
    const int triangles[6] = {0, 1, 2, 0, 2, 3};
    memcpy(folded, flat, sizeof flat);
    folded[9] = 1.0f, folded[10] = 0.1f; /* the fourth corner over the other triangle */
    ASSERT_EQ(0.0, mesh_bent_edges(flat, triangles, 2, 0.5f));
    ASSERT_EQ(1.0, mesh_bent_edges(folded, triangles, 2, -0.5f));
    PASS();
}

int main(int argc, char **argv)
{
    char command[600];
    if (!make_folder()) return 1;
    GREATEST_MAIN_BEGIN();
    RUN_TEST(folds_bend_edges);
    RUN_TEST(ragged_and_clean_maps_have_the_same_surface);
    RUN_TEST(ragged_subjects_correspond_without_folds);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0) perror(folder);
    GREATEST_MAIN_END();
}

#endif
