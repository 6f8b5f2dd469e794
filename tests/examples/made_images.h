/* made_images.h - images and motions that tests of registration make, and a folder for their files. */
#ifndef MADE_IMAGES_H
#define MADE_IMAGES_H

#include "scratch.h"

#include "../../examples/common/registration/beat.h"
#include "../../examples/common/imaging/overlap.h"
#include "../../examples/common/registration/field.h"
#include "../../examples/common/registration/points.h"
#include "../../examples/common/registration/register.h"
#include "../../examples/common/surface/mesh_io.h"
#include "../../examples/register/run.h"
#include "../../examples/common/base/vec3.h"
#include "../../examples/common/registration/vgrid.h"

#include <math.h>
#include <nifti2_io.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* A test need not use all of them. */
#define MADE __attribute__((unused)) static

MADE void place_of(const int dims[3], size_t n, float x[3])
{
    x[0] = (float)(n % (size_t)dims[0]);
    x[1] = (float)(n / (size_t)dims[0] % (size_t)dims[1]);
    x[2] = (float)(n / ((size_t)dims[0] * (size_t)dims[1]));
}

MADE bool inner(const int dims[3], const float x[3], float margin)
{
    bool inside = true;
    for (int a = 0; a < 3; ++a) inside = inside && x[a] >= margin && x[a] <= (float)(dims[a] - 1) - margin;
    return inside;
}

/* ---- images and motions made here ---- */

/* An empty volume whose axes are turned about z and one of them mirrored, as scanners give them. */
MADE bool make_grid(const int dims[3], const float spacing[3], bool turned, struct volume *volume)
{
    const float origin[3] = {-20.0f, 35.0f, 100.0f};
    struct volume straight;
    if (!volume_create(dims, spacing, origin, &straight)) return false;
    if (turned) {
        const double c = 0.8, s = 0.6;
        straight.affine[0][0] = -c * (double)spacing[0], straight.affine[0][1] = s * (double)spacing[1];
        straight.affine[1][0] = s * (double)spacing[0], straight.affine[1][1] = c * (double)spacing[1];
    }
    const bool made = volume_create_padded(&straight, 0, volume);
    volume_free(&straight);
    return made;
}

MADE void middle_of(const struct volume *volume, float center[3])
{
    const float index[3] = {0.5f * (float)(volume->dims[0] - 1), 0.5f * (float)(volume->dims[1] - 1),
                            0.5f * (float)(volume->dims[2] - 1)};
    volume_index_to_world(volume, index, center);
}

/* A ball of 13 mm about the centre with a texture of waves some millimetres long, in air. */
MADE float phantom(const float center[3], const float x[3])
{
    float r[3];
    vec3_sub(x, center, r);
    const float ball = 1.0f / (1.0f + expf(1.5f * (vec3_length(r) - 13.0f)));
    return 1000.0f * ball * (1.0f + 0.35f * sinf(0.75f * r[0] + 0.5f) * cosf(0.6f * r[1]) * cosf(0.65f * r[2] + 0.3f));
}

/* fixed(x) = phantom(x), moving(y) = phantom(back(y)), so the map takes x to back^-1(x). */
MADE void paint(struct volume *volume, const float center[3], field_map_fn back, const void *user)
{
    volume->minimum = INFINITY;
    volume->maximum = -INFINITY;
    for (size_t n = 0; n < volume_voxels(volume); ++n) {
        float index[3], x[3];
        place_of(volume->dims, n, index);
        volume_index_to_world(volume, index, x);
        if (back) back(user, x, 1, x);
        volume->data[n] = phantom(center, x);
        volume->minimum = fminf(volume->minimum, volume->data[n]);
        volume->maximum = fmaxf(volume->maximum, volume->data[n]);
    }
}

MADE void affine_map(const void *map, const float *points, size_t count, float *mapped)
{
    for (size_t n = 0; n < count; ++n) volume_apply((const double(*)[4])map, points + 3 * n, mapped + 3 * n);
}

/* Mean distance, mm, between two maps at voxels of the fixed image within `radius` mm of its middle. */
MADE double difference(const struct volume *grid, float radius, field_map_fn a, const void *a_user, field_map_fn b,
                         const void *b_user)
{
    float center[3];
    double sum = 0.0, number = 0.0;
    middle_of(grid, center);
    for (size_t n = 0; n < volume_voxels(grid); ++n) {
        float index[3], x[3], r[3], p[3], q[3];
        place_of(grid->dims, n, index);
        volume_index_to_world(grid, index, x);
        vec3_sub(x, center, r);
        if (vec3_length(r) < radius) {
            a(a_user, x, 1, p);
            b(b_user, x, 1, q);
            vec3_sub(p, q, p);
            sum += (double)vec3_length(p);
            number += 1.0;
        }
    }
    return sum / number;
}

MADE void stay(const void *user, const float *points, size_t count, float *mapped)
{
    (void)user;
    memcpy(mapped, points, 3 * count * sizeof *points);
}

MADE bool run_command(const char *format, const char *a, const char *b)
{
    char command[2048];
    snprintf(command, sizeof command, format, a, b);
    return system(command) == 0;
}

#endif
