#include "surface/textured_mesh.h"

#include <stdlib.h>
#include <string.h>

/* Copies the vertices of the charts. */
static bool cut_charts(const struct gltf_mesh *surface, int material, struct textured_mesh *t)
{
    const struct texture_atlas *a = &t->atlas;
    t->positions = malloc(3 * (size_t)a->vertex_count * sizeof *t->positions);
    t->normals = malloc(3 * (size_t)a->vertex_count * sizeof *t->normals);
    t->materials_of = malloc((size_t)a->triangle_count * sizeof *t->materials_of);
    if (!t->positions || !t->normals || !t->materials_of) {
        return false;
    }
    for (int v = 0; v < a->vertex_count; ++v) {
        memcpy(t->positions + 3 * v, surface->positions + 3 * a->vertex_of[v], 3 * sizeof(float));
        memcpy(t->normals + 3 * v, surface->normals + 3 * a->vertex_of[v], 3 * sizeof(float));
    }
    for (int i = 0; i < a->triangle_count; ++i) {
        t->materials_of[i] = material;
    }
    const struct gltf_mesh mesh = {.positions = t->positions,
                                   .normals = t->normals,
                                   .uvs = a->uvs,
                                   .triangles = a->triangles,
                                   .materials_of = t->materials_of,
                                   .vertex_count = a->vertex_count,
                                   .triangle_count = a->triangle_count};
    t->mesh = mesh;
    return true;
}

bool textured_mesh_make(const struct gltf_mesh *surface, int size, int material, texture_atlas_color *color, const void *user,
                        struct textured_mesh *textured)
{
    struct image image = {0};
    memset(textured, 0, sizeof *textured);
    const bool good = texture_atlas_unwrap(surface->positions, surface->vertex_count, surface->triangles, surface->triangle_count,
                                           size, &textured->atlas)
        && texture_atlas_bake(&textured->atlas, color, user, &image)
        && image_encode_png(&image, &textured->picture.bytes, &textured->picture.size)
        && cut_charts(surface, material, textured);
    image_free(&image);
    if (!good) {
        const bool full = textured->atlas.full;
        textured_mesh_free(textured);
        textured->atlas.full = full;
    }
    return good;
}

void textured_mesh_free(struct textured_mesh *textured)
{
    texture_atlas_free(&textured->atlas);
    picture_free(&textured->picture);
    free(textured->positions);
    free(textured->normals);
    free(textured->materials_of);
    memset(textured, 0, sizeof *textured);
}

/* Interpolates the colors of a triangle's corners. */
static void color_within(const void *user, int triangle, const float weight[3], float color[3])
{
    const struct gltf_mesh *surface = user;
    for (int c = 0; c < 3; ++c) {
        color[c] = 0.0f;
        for (int k = 0; k < 3; ++k) {
            color[c] += weight[k] * surface->colors[3 * surface->triangles[3 * triangle + k] + c];
        }
    }
}

bool textured_mesh_write(const char *path, const struct gltf_mesh *surface, int size)
{
    struct textured_mesh textured;
    struct material material = material_plain();
    material.image = 0;
    if (!textured_mesh_make(surface, size, 0, color_within, surface, &textured)) {
        return false;
    }
    const struct gltf_look look = {&material, &textured.picture, 1, 1};
    const bool good = gltf_write_mesh(path, &textured.mesh, &look);
    textured_mesh_free(&textured);
    return good;
}
