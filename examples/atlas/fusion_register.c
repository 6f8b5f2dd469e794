/* fusion_register.c - maps between a template and an image. */
#include "atlas/fusion.h"

#include "base/threads.h"
#include "base/vec3.h"
#include "imaging/resample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Returns the volume moved by -shift; it shares the data. */
static struct volume moved(const struct volume *image, const float shift[3])
{
    struct volume copy = *image;
    for (int a = 0; a < 3; ++a) {
        copy.origin[a] -= shift[a];
        copy.affine[a][3] -= (double)shift[a];
    }
    return copy;
}

bool fusion_register(const struct volume *template, const struct volume *image, const float shift[3], struct fusion_map *map,
                     char error[VOLUME_TEXT])
{
    struct register_settings set = register_defaults();
    const struct volume near = moved(image, shift);
    set.similarity = REGISTER_LCC; /* scanners have their own scales and shading */
    set.levels = 2;
    set.iterations = 40;
    memcpy(map->shift, shift, sizeof map->shift);
    return register_images(template, &near, &set, NULL, &map->registration, error);
}

void fusion_forward(const struct fusion_map *map, const float *places, size_t count, float *mapped)
{
    registration_map(&map->registration, places, count, mapped);
    for (size_t n = 0; n < count; ++n) {
        vec3_add_scaled(mapped + 3 * n, 1.0f, map->shift, mapped + 3 * n);
    }
}

void fusion_back(const struct fusion_map *map, const float *places, size_t count, float *mapped)
{
    for (size_t n = 0; n < count; ++n) {
        vec3_add_scaled(places + 3 * n, -1.0f, map->shift, mapped + 3 * n);
    }
    registration_map_back(&map->registration, mapped, count, mapped);
}

static float value_at(const struct volume *image, const float place[3])
{
    float index[3];
    volume_world_to_index(image, place, index);
    return resample_at(image->dims, image->data, index);
}

static void voxel_place(const struct volume *grid, size_t n, float place[3])
{
    int at[3];
    volume_place(grid->dims, n, at);
    const float index[3] = {(float)at[0], (float)at[1], (float)at[2]};
    volume_index_to_world(grid, index, place);
}

void fusion_place(const struct fusion_map *map, const struct volume *grid, size_t n, float place[3])
{
    voxel_place(grid, n, place);
    fusion_forward(map, place, 1, place);
}

struct sample_loop {
    const struct fusion_map *map;
    const struct volume *grid, *image;
    float *values;
};

static void run_sample_loop(void *arg, int begin, int end)
{
    const struct sample_loop *loop = arg;
    for (size_t n = (size_t)begin; n < (size_t)end; ++n) {
        float place[3];
        fusion_place(loop->map, loop->grid, n, place);
        loop->values[n] = value_at(loop->image, place);
    }
}

void fusion_sample(const struct fusion_map *map, const struct volume *grid, const struct volume *image, float *values)
{
    struct sample_loop loop = {map, grid, image, values};
    threads_for((int)volume_voxels(grid), 1024, run_sample_loop, &loop);
}

double fusion_agreement(const struct volume *template, const struct volume *image, const float shift[3])
{
    const size_t voxels = volume_voxels(template);
    double a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
    for (size_t n = 0; n < voxels; ++n) {
        float place[3];
        voxel_place(template, n, place);
        vec3_add_scaled(place, 1.0f, shift, place);
        const double x = (double)template->data[n], y = (double)value_at(image, place);
        a += x, b += y, aa += x * x, bb += y * y, ab += x * y;
    }
    const double count = (double)voxels, spread = (aa - a * a / count) * (bb - b * b / count);
    return spread > 0.0 ? (ab - a * b / count) / sqrt(spread) : 0.0;
}

void fusion_template_free(struct fusion_template *template)
{
    volume_free(&template->image);
    free(template->images);
    free(template->masks);
    free(template->labels);
    free(template->means);
    free(template->deviations);
    free(template->places);
    free(template->correction);
    memset(template, 0, sizeof *template);
}
