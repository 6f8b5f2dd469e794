/* atlas_fixtures.h - what the tests of examples/atlas share: ellipsoids as meshes and as label maps, settings, numbered files. */
#ifndef ATLAS_FIXTURES_H
#define ATLAS_FIXTURES_H

#include "../../examples/atlas/atlas.h"
#include "../../examples/common/surface/mesh_io.h"
#include "scratch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- files: of each slot the last name stays, for settings that point at it ---- */

static char names[16][512];

SHARED const char *numbered(int slot, const char *format, int number)
{
    char name[128];
    snprintf(name, sizeof name, format, number);
    snprintf(names[slot], sizeof names[slot], "%s/%s", folder, name);
    return names[slot];
}

SHARED bool write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    const bool good = file && fputs(text, file) >= 0;
    return file && fclose(file) == 0 && good;
}

/* ---- shapes ---- */

enum { AROUND = 24, ACROSS = 11, BALL = AROUND * ACROSS + 2, BALL_TRIANGLES = 2 * AROUND * ACROSS };

/* A sphere's points, stretched: vertex v is the same place on each. */
SHARED void make_ellipsoid(const float half[3], float *points)
{
    const float pi = 3.14159265f;
    for (int r = 0; r < ACROSS; ++r) {
        for (int c = 0; c < AROUND; ++c) {
            const float t = pi * (float)(r + 1) / (ACROSS + 1), u = 2.0f * pi * (float)c / AROUND;
            float *x = points + 3 * (r * AROUND + c);
            x[0] = half[0] * sinf(t) * cosf(u), x[1] = half[1] * sinf(t) * sinf(u), x[2] = half[2] * cosf(t);
        }
    }
    for (int pole = 0; pole < 2; ++pole) {
        float *x = points + 3 * (AROUND * ACROSS + pole);
        x[0] = x[1] = 0.0f, x[2] = pole ? -half[2] : half[2];
    }
}

SHARED void make_ball_triangles(uint32_t *triangles)
{
    const uint32_t north = AROUND * ACROSS, south = north + 1, last = AROUND * (ACROSS - 1);
    uint32_t *t = triangles;
    for (uint32_t c = 0; c < AROUND; ++c) {
        const uint32_t d = (c + 1) % AROUND;
        *t++ = north, *t++ = c, *t++ = d;
        *t++ = south, *t++ = last + d, *t++ = last + c;
        for (uint32_t r = 0; r + 1 < ACROSS; ++r) {
            const uint32_t a = r * AROUND, b = a + AROUND;
            *t++ = a + c, *t++ = b + c, *t++ = b + d;
            *t++ = a + c, *t++ = b + d, *t++ = a + d;
        }
    }
}

SHARED struct similarity some_pose(double angle)
{
    struct similarity s = similarity_identity();
    s.scale = 1.0 + 0.1 * angle;
    s.rotation[0][0] = cos(angle), s.rotation[0][1] = -sin(angle);
    s.rotation[1][0] = sin(angle), s.rotation[1][1] = cos(angle);
    s.translation[0] = 3.0 * angle, s.translation[2] = -5.0;
    return s;
}

/* ---- atlases ---- */

/* Settings that make an atlas without a word. */
SHARED struct atlas_build make_build(void)
{
    struct atlas_build build;
    memset(&build, 0, sizeof build);
    build.settings.common = cli_common_defaults();
    build.settings.common.quiet = true;
    build.settings.orientation = "auto";
    build.settings.rounds = 2;
    build.settings.modes = ATLAS_MAX_MODES;
    build.settings.samples = 20;
    build.params = springls_default_params();
    return build;
}

/* A small atlas of two modes that nothing was measured for. */
SHARED bool make_atlas(struct atlas *atlas)
{
    static float points[3 * BALL];
    static uint32_t triangles[3 * BALL_TRIANGLES];
    const float half[3] = {3.0f, 2.0f, 1.0f};
    memset(atlas, 0, sizeof *atlas);
    make_ellipsoid(half, points);
    make_ball_triangles(triangles);
    if (!atlas_mesh_copy(points, BALL, (const int *)(const void *)triangles, BALL_TRIANGLES, &atlas->mean)) return false;
    atlas->model.vertices = BALL;
    atlas->model.mean = atlas->mean.positions;
    atlas->model.modes = 2;
    atlas->model.mode = malloc(2 * sizeof points);
    atlas->model.deviation = malloc(2 * sizeof(double));
    atlas->regions = malloc(BALL * sizeof *atlas->regions);
    if (!atlas->model.mode || !atlas->model.deviation || !atlas->regions) return false;
    for (int i = 0; i < 6 * BALL; ++i) atlas->model.mode[i] = 0.001f * (float)i;
    for (int v = 0; v < BALL; ++v) atlas->regions[v] = (uint32_t)v % 3u;
    atlas->model.deviation[0] = 2.5, atlas->model.deviation[1] = 0.5;
    atlas->oriented = true;
    atlas->voxel = 0.25;
    atlas->generalization = 0.125;
    atlas->subjects = 7;
    return true;
}

/* ---- images ---- */

/* An ellipsoid about `center`: labels 1 and 2 for x below and above it, intensities 200 within and 100 without, with a
 * pattern of 20 over all. */
SHARED bool write_subject(const char *labels, const char *image, const float center[3], const float half[3])
{
    const int dims[3] = {56, 48, 40};
    const float spacing[3] = {1.0f, 1.0f, 1.2f}, origin[3] = {-20.0f, 5.0f, 3.0f};
    struct volume volume;
    char error[VOLUME_TEXT];
    if (!volume_create(dims, spacing, origin, &volume)) return false;
    const size_t voxels = volume_voxels(&volume);
    uint8_t *mask = malloc(voxels);
    size_t n = 0;
    for (int k = 0; mask && k < dims[2]; ++k)
        for (int j = 0; j < dims[1]; ++j)
            for (int i = 0; i < dims[0]; ++i, ++n) {
                const float index[3] = {(float)i, (float)j, (float)k};
                float x[3], square = 0.0f;
                volume_index_to_world(&volume, index, x);
                for (int a = 0; a < 3; ++a) square += (x[a] - center[a]) * (x[a] - center[a]) / (half[a] * half[a]);
                mask[n] = (uint8_t)(square > 1.0f ? 0 : x[0] < center[0] ? 1 : 2);
                volume.data[n] = (square > 1.0f ? 100.0f : 200.0f) + 20.0f * sinf(0.9f * x[0]) * sinf(0.8f * x[1]);
            }
    const bool good = mask && volume_write(labels, &volume, VOLUME_UINT8, mask, error)
                   && (!image || volume_write(image, &volume, VOLUME_FLOAT32, volume.data, error));
    free(mask);
    volume_free(&volume);
    return good;
}

/* Makes a series of two equal images out of one: NIfTI has its sizes, 16 bits each, from byte 40 on. */
SHARED bool write_series(const char *path, const struct volume *image)
{
    const int16_t four = 4, two = 2;
    char error[VOLUME_TEXT];
    FILE *file = volume_write(path, image, VOLUME_FLOAT32, image->data, error) ? fopen(path, "r+b") : NULL;
    bool good = file && fseek(file, 40, SEEK_SET) == 0 && fwrite(&four, sizeof four, 1, file) == 1
             && fseek(file, 48, SEEK_SET) == 0 && fwrite(&two, sizeof two, 1, file) == 1 && fseek(file, 0, SEEK_END) == 0
             && fwrite(image->data, sizeof *image->data, volume_voxels(image), file) == volume_voxels(image);
    return file && fclose(file) == 0 && good;
}

/* A random number in -0.5..0.5. */
SHARED float noise(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (float)(*state >> 40) / 16777216.0f - 0.5f;
}

#endif
