#include "surface/source_look.h"

#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

struct look_triangle {
    float corners[9], uvs[6], colors[9]; /* colors: display values */
    int material;                        /* -1: none */
};

static void take_triangle(const struct scene_part *part, const int vertices[3], bool linear, struct look_triangle *t)
{
    t->material = part->material;
    for (int k = 0; k < 3; ++k) {
        const size_t v = (size_t)vertices[k];
        memcpy(t->corners + 3 * k, part->positions + 3 * v, 3 * sizeof(float));
        t->uvs[2 * k] = part->uvs ? part->uvs[2 * v] : 0.0f;
        t->uvs[2 * k + 1] = part->uvs ? part->uvs[2 * v + 1] : 0.0f;
        for (size_t c = 0; c < 3; ++c) {
            const float value = part->colors ? part->colors[3 * v + c] : 1.0f;
            t->colors[3 * (size_t)k + c] = linear ? color_display(value) : fmaxf(0.0f, fminf(1.0f, value));
        }
    }
}

/* Takes the triangles with these numbers, which rise, over all parts. Returns how many there are. */
static size_t take_triangles(struct source_look *look, const uint32_t *numbers, size_t count)
{
    size_t before = 0, n = 0;
    for (int p = 0; p < look->scene.part_count; ++p) {
        const struct scene_part *part = &look->scene.parts[p];
        const size_t beyond = before + (size_t)part->triangle_count;
        for (; n < count && numbers[n] < beyond; ++n) {
            take_triangle(part, part->triangles + 3 * (numbers[n] - before), look->scene.linear, &look->triangles[n]);
        }
        before = beyond;
    }
    return n;
}

static bool build(struct source_look *look, const uint32_t *numbers, size_t count)
{
    look->triangles = malloc((count + 1) * sizeof *look->triangles);
    float *corners = malloc((count + 1) * 9 * sizeof *corners);
    bool fine = look->triangles && corners && scene_rest(&look->scene);
    const size_t n = fine ? take_triangles(look, numbers, count) : 0;
    for (size_t t = 0; t < n; ++t) {
        memcpy(corners + 9 * t, look->triangles[t].corners, sizeof look->triangles[t].corners);
    }
    fine = fine && n > 0 && bvh_build(&look->bvh, corners, NULL, n);
    free(corners);
    return fine;
}

/* Counts the texels of the images that materials have, each image once. */
static double count_texels(const struct scene *scene)
{
    double texels = 0.0;
    for (int i = 0; i < scene->picture_count; ++i) {
        const struct byte_image *pixels = &scene->pictures[i].image;
        bool used = false;
        for (int m = 0; m < scene->material_count; ++m) {
            used = used || scene->materials[m].image == i;
        }
        texels += used && pixels->rgb ? (double)pixels->width * (double)pixels->height : 0.0;
    }
    return texels;
}

enum source_look_status source_look_make(const char *path, const uint32_t *numbers, size_t count, struct source_look *look,
                                         char error[SCENE_TEXT])
{
    memset(look, 0, sizeof *look);
    if (!scene_read(path, SCENE_ALL, &look->scene, error)) {
        return SOURCE_LOOK_FAILED;
    }
    const int missing = look->scene.missing_pictures;
    look->missing = missing;
    look->texels = count_texels(&look->scene);
    if (!(look->texels > 0.0)) {
        source_look_free(look);
        look->missing = missing;
        return SOURCE_LOOK_NONE;
    }
    if (!build(look, numbers, count)) {
        source_look_free(look);
        scene_fail(error, path, "not enough memory for its images");
        return SOURCE_LOOK_FAILED;
    }
    return SOURCE_LOOK_FINE;
}

void source_look_free(struct source_look *look)
{
    scene_free(&look->scene);
    free(look->triangles);
    bvh_free(&look->bvh);
    memset(look, 0, sizeof *look);
}

void source_look_color(const struct source_look *look, const float point[3], float color[3])
{
    float closest[3] = {0.0f, 0.0f, 0.0f}, weight[3], uv[2] = {0.0f, 0.0f}, sum[3] = {0.0f, 0.0f, 0.0f};
    uint32_t number = 0;
    bvh_distance(&look->bvh, point, closest, &number);
    const struct look_triangle *t = &look->triangles[number];
    const struct material plain = material_plain(), *material = t->material >= 0 ? &look->scene.materials[t->material] : &plain;
    vec3_barycentric(t->corners, t->corners + 3, t->corners + 6, closest, weight);
    for (int k = 0; k < 3; ++k) {
        uv[0] += weight[k] * t->uvs[2 * k];
        uv[1] += weight[k] * t->uvs[2 * k + 1];
        vec3_add_scaled(sum, weight[k], t->colors + 3 * k, sum);
    }
    material_color(material, material->image >= 0 ? &look->scene.pictures[material->image].image : NULL, uv, sum, color);
}
