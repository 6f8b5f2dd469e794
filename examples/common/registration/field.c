#include "registration/field.h"

#include "base/threads.h"
#include "base/vec3.h"
#include "imaging/resample.h"
#include "registration/vgrid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { INVERSE_ITERATIONS = 60 };

bool field_create(const struct volume *like, struct field *field)
{
    memset(field, 0, sizeof *field);
    if (!volume_create_padded(like, 0, &field->grid)) { /* only the geometry: the header stays with its volume */
        return false;
    }
    free(field->grid.data);
    field->grid.data = NULL;
    field->mm = calloc(3 * volume_voxels(like), sizeof *field->mm);
    if (!field->mm) {
        field_free(field);
    }
    return field->mm != NULL;
}

void field_free(struct field *field)
{
    volume_free(&field->grid);
    free(field->mm);
    field->mm = NULL;
}

void field_map(const struct field *field, const float world[3], float mapped[3])
{
    float index[3], u[3];
    volume_world_to_index(&field->grid, world, index);
    vgrid_sample(field->grid.dims, 3, field->mm, index, u);
    for (int c = 0; c < 3; ++c) {
        mapped[c] = world[c] + u[c];
    }
}

void field_map_points(const void *field, const float *points, size_t count, float *mapped)
{
    for (size_t n = 0; n < count; ++n) {
        field_map(field, points + 3 * n, mapped + 3 * n);
    }
}

static void row_of_places(const struct volume *grid, int j, int k, float *places)
{
    for (int i = 0; i < grid->dims[0]; ++i) {
        const float index[3] = {(float)i, (float)j, (float)k};
        volume_index_to_world(grid, index, places + 3 * i);
    }
}

struct sample_loop {
    field_map_fn map;
    const void *user;
    struct field *field;
    const int *dims;
    size_t row;
};

static void run_sample_loop(void *arg, int begin, int end)
{
    const struct sample_loop *loop = arg;
    const field_map_fn map = loop->map;
    const void *user = loop->user;
    struct field *field = loop->field;
    const int *dims = loop->dims;
    const size_t row = loop->row;
    for (int k = begin; k < end; ++k) {
        for (int j = 0; j < dims[1]; ++j) {
            float *out = field->mm + row * ((size_t)j + (size_t)dims[1] * (size_t)k), place[3];
            row_of_places(&field->grid, j, k, out);
            for (int i = 0; i < dims[0]; ++i, out += 3) {
                memcpy(place, out, sizeof place);
                map(user, place, 1, out);
                for (int c = 0; c < 3; ++c) {
                    out[c] -= place[c];
                }
            }
        }
    }
}

void field_sample(field_map_fn map, const void *user, struct field *field)
{
    const int *dims = field->grid.dims;
    const size_t row = 3 * (size_t)dims[0];
    struct sample_loop loop = {map, user, field, dims, row};
    threads_for(dims[2], 1, run_sample_loop, &loop);
}

/* Inverts x + u(x) = y by fixed-point iteration: x <- y - u(x). */
static void map_back(const void *user, const float *points, size_t count, float *mapped)
{
    const struct field *field = user;
    for (size_t n = 0; n < count; ++n) {
        float x[3], there[3];
        memcpy(x, points + 3 * n, sizeof x);
        for (int i = 0; i < INVERSE_ITERATIONS; ++i) {
            field_map(field, x, there);
            vec3_sub(there, x, there);
            for (int c = 0; c < 3; ++c) {
                x[c] = points[3 * n + (size_t)c] - there[c];
            }
        }
        memcpy(mapped + 3 * n, x, sizeof x);
    }
}

static bool within(const struct volume *grid, const float world[3])
{
    float index[3];
    volume_world_to_index(grid, world, index);
    bool inside = true;
    for (int a = 0; a < 3; ++a) {
        inside = inside && index[a] >= 0.0f && index[a] <= (float)(grid->dims[a] - 1);
    }
    return inside;
}

bool field_invert(const struct field *field, const struct volume *like, struct field *inverse, double *remains)
{
    if (!field_create(like, inverse)) {
        return false;
    }
    field_sample(map_back, field, inverse);
    *remains = 0.0;
    for (size_t n = 0; n < volume_voxels(like); ++n) {
        int place[3];
        volume_place(like->dims, n, place);
        const float index[3] = {(float)place[0], (float)place[1], (float)place[2]};
        float y[3], x[3], again[3];
        volume_index_to_world(like, index, y);
        for (int c = 0; c < 3; ++c) {
            x[c] = y[c] + inverse->mm[3 * n + (size_t)c];
        }
        if (within(&field->grid, x)) {
            field_map(field, x, again);
            vec3_sub(again, y, again);
            *remains = fmax(*remains, (double)vec3_length(again));
        }
    }
    return true;
}

/* Computes a value from `image` at the place, in voxels, to which a voxel of the field is mapped. */
typedef float (*take_fn)(const struct volume *image, const float index[3], float outside);

struct pull_loop {
    const struct field *field;
    const struct volume *image;
    take_fn take;
    float outside;
    float *out;
    const int *dims;
};

static void run_pull_loop(void *arg, int begin, int end)
{
    const struct pull_loop *loop = arg;
    const struct field *field = loop->field;
    const struct volume *image = loop->image;
    const take_fn take = loop->take;
    const float outside = loop->outside;
    float *out = loop->out;
    const int *dims = loop->dims;
    for (int k = begin; k < end; ++k) {
        size_t n = (size_t)k * (size_t)dims[0] * (size_t)dims[1];
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                float index[3] = {(float)i, (float)j, (float)k}, world[3];
                volume_index_to_world(&field->grid, index, world);
                for (size_t c = 0; c < 3; ++c) {
                    world[c] += field->mm[3 * n + c];
                }
                volume_world_to_index(image, world, index);
                out[n] = take(image, index, outside);
            }
        }
    }
}

static void pull(const struct field *field, const struct volume *image, take_fn take, float outside, float *out)
{
    const int *dims = field->grid.dims;
    struct pull_loop loop = {field, image, take, outside, out, dims};
    threads_for(dims[2], 1, run_pull_loop, &loop);
}

static float take_linear(const struct volume *image, const float index[3], float outside)
{
    float value = outside;
    if (resample_in_box(image->dims, index)) {
        vgrid_sample(image->dims, 1, image->data, index, &value);
    }
    return value;
}

static float take_nearest(const struct volume *image, const float index[3], float outside)
{
    size_t at = 0;
    if (!resample_in_box(image->dims, index)) {
        return outside;
    }
    for (int a = 2; a >= 0; --a) {
        const int place = (int)floorf(index[a] + 0.5f);
        at = at * (size_t)image->dims[a] + (size_t)(place < 0 ? 0 : place < image->dims[a] ? place : image->dims[a] - 1);
    }
    return image->data[at];
}

void field_warp(const struct field *field, const struct volume *moving, float outside, float *warped)
{
    pull(field, moving, take_linear, outside, warped);
}

void field_warp_labels(const struct field *field, const struct volume *labels, float *warped)
{
    pull(field, labels, take_nearest, 0.0f, warped);
}

bool field_warp_ids(const struct field *field, const struct volume *labels, uint32_t *warped)
{
    const size_t from = volume_voxels(labels), to = volume_voxels(&field->grid);
    struct volume half = *labels;
    float *pulled = malloc(to * sizeof *pulled);
    half.data = malloc(from * sizeof *half.data);
    const bool good = pulled && half.data;
    memset(warped, 0, to * sizeof *warped);
    for (int shift = 0; good && shift < 32; shift += 16) { /* a float holds 24 bits */
        for (size_t n = 0; n < from; ++n) {
            half.data[n] = (float)(labels->ids[n] >> shift & 0xFFFF);
        }
        field_warp_labels(field, &half, pulled);
        for (size_t n = 0; n < to; ++n) {
            warped[n] |= (uint32_t)pulled[n] << shift;
        }
    }
    free(pulled);
    free(half.data);
    return good;
}

float field_jacobian(const struct field *field, float *determinants, size_t *folded)
{
    const struct volume *grid = &field->grid;
    const size_t total = volume_voxels(grid);
    const float zero[3] = {0.0f, 0.0f, 0.0f};
    float *u = malloc(3 * total * sizeof *u), minimum = INFINITY, origin[3];
    *folded = 0;
    if (!u) {
        return NAN;
    }
    volume_world_to_index(grid, zero, origin);
    for (size_t n = 0; n < total; ++n) { /* convert the vectors to voxels */
        volume_world_to_index(grid, field->mm + 3 * n, u + 3 * n);
        vec3_sub(u + 3 * n, origin, u + 3 * n);
    }
    vgrid_jacobian(grid->dims, u, determinants);
    for (size_t n = 0; n < total; ++n) {
        minimum = fminf(minimum, determinants[n]);
        *folded += !(determinants[n] > 0.0f);
    }
    free(u);
    return minimum;
}
