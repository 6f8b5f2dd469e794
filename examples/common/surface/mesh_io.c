#include "surface/mesh_io.h"

#include "surface/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t hash_position(const float p[3])
{
    uint32_t word[3];
    memcpy(word, p, sizeof word);
    uint32_t h = word[0] * 0x9E3779B1u ^ word[1] * 0x85EBCA77u ^ word[2] * 0xC2B2AE3Du;
    h ^= h >> 15;
    h *= 0x2C1B3C6Du;
    return h ^ h >> 13;
}

static bool has_colors(const struct scene *scene)
{
    for (int p = 0; p < scene->part_count; ++p) {
        if (scene->parts[p].colors || scene->parts[p].material != scene->parts[0].material) {
            return true;
        }
    }
    return false;
}

/* Returns the color of a vertex of a part: its own, or the part's material's. */
static const float *color_of(const struct scene *scene, const struct scene_part *part, int vertex)
{
    static const float grey[3] = {0.8f, 0.8f, 0.8f};
    return part->colors ? part->colors + 3 * (size_t)vertex : part->material >= 0 ? scene->materials[part->material].base : grey;
}

/* Stores a vertex's color; of vertices that become one the first one's is kept. */
static void take_color(struct mesh *mesh, uint32_t vertex, const float rgb[3])
{
    for (int i = 0; i < 3; ++i) {
        mesh->colors[3 * (size_t)vertex + (size_t)i] = rgb[i] > 0.0f ? fminf(rgb[i], 1.0f) : 0.0f;
    }
}

/* A file that is being turned into a mesh. */
struct builder {
    const char *path;
    const struct scene *scene;
    struct mesh *mesh;
    uint32_t *table; /* open addressing: numbers of vertices + 1, 0 = free */
    size_t mask;     /* slots - 1, where the slots are a power of two */
    uint32_t number; /* of the next triangle of the file */
    char *error;
};

/* Allocates for all triangles of the file, as if they had no vertex in common. */
static bool allocate(struct builder *b)
{
    size_t triangles = 0, slots = 16;
    for (int p = 0; p < b->scene->part_count; ++p) {
        triangles += (size_t)b->scene->parts[p].triangle_count;
    }
    if (triangles == 0) {
        return scene_fail(b->error, b->path, "no triangles");
    }
    if (triangles > UINT32_MAX / 8) {
        return scene_fail(b->error, b->path, "too many triangles: %zu", triangles);
    }
    while (slots < 6 * triangles) {
        slots *= 2;
    }
    const bool colored = has_colors(b->scene);
    b->mask = slots - 1;
    b->table = calloc(slots, sizeof *b->table);
    b->mesh->positions = malloc(9 * triangles * sizeof *b->mesh->positions);
    b->mesh->indices = malloc(3 * triangles * sizeof *b->mesh->indices);
    b->mesh->source = malloc(triangles * sizeof *b->mesh->source);
    b->mesh->colors = colored ? malloc(9 * triangles * sizeof *b->mesh->colors) : NULL;
    if (!b->table || !b->mesh->positions || !b->mesh->indices || !b->mesh->source || (colored && !b->mesh->colors)) {
        return scene_fail(b->error, b->path, "not enough memory for %zu triangles", triangles);
    }
    return true;
}

/* Adds a vertex at p unless there is one; returns its number. */
static uint32_t weld(struct builder *b, const float p[3])
{
    struct mesh *mesh = b->mesh;
    size_t slot = hash_position(p) & b->mask;
    while (b->table[slot] != 0) {
        if (memcmp(mesh->positions + 3 * (size_t)(b->table[slot] - 1), p, 3 * sizeof *p) == 0) {
            return b->table[slot] - 1;
        }
        slot = (slot + 1) & b->mask;
    }
    memcpy(mesh->positions + 3 * mesh->vertex_count, p, 3 * sizeof *p);
    b->table[slot] = (uint32_t)++mesh->vertex_count;
    return b->table[slot] - 1;
}

/* Adds a vertex of a part of the file unless there is one at its place. */
static bool add_corner(struct builder *b, const struct scene_part *part, int vertex, uint32_t *corner)
{
    const float *v = part->positions + 3 * (size_t)vertex;
    const float p[3] = {v[0] + 0.0f, v[1] + 0.0f, v[2] + 0.0f}; /* -0 and 0 are the same place */
    if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) {
        return scene_fail(b->error, b->path, "a vertex is not finite");
    }
    const size_t before = b->mesh->vertex_count;
    *corner = weld(b, p);
    if (b->mesh->colors && b->mesh->vertex_count > before) {
        take_color(b->mesh, *corner, color_of(b->scene, part, vertex));
    }
    return true;
}

/* Adds a triangle unless two of its corners coincide. */
static bool add_triangle(struct builder *b, const struct scene_part *part, const int from[3])
{
    uint32_t *corner = b->mesh->indices + 3 * b->mesh->triangle_count;
    const uint32_t number = b->number++;
    for (int k = 0; k < 3; ++k) {
        if (!add_corner(b, part, from[k], &corner[k])) {
            return false;
        }
    }
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) {
        ++b->mesh->dropped;
    } else {
        b->mesh->source[b->mesh->triangle_count++] = number;
    }
    return true;
}

/* Builds the mesh from all parts of the file. */
static bool build(struct builder *b)
{
    bool good = allocate(b);
    for (int p = 0; good && p < b->scene->part_count; ++p) {
        const struct scene_part *part = &b->scene->parts[p];
        for (int t = 0; good && t < part->triangle_count; ++t) {
            good = add_triangle(b, part, part->triangles + 3 * (size_t)t);
        }
    }
    free(b->table);
    if (good && b->mesh->triangle_count == 0) {
        good = scene_fail(b->error, b->path, "no triangles%s", b->mesh->dropped ? ": all of them are degenerate" : "");
    }
    return good;
}

bool mesh_read(const char *path, struct mesh *mesh, char error[MESH_TEXT])
{
    struct scene scene;
    memset(mesh, 0, sizeof *mesh);
    if (!scene_read(path, SCENE_SHAPE, &scene, error)) {
        return false;
    }
    struct builder builder = {.path = path, .scene = &scene, .mesh = mesh, .error = error};
    const bool good = (scene_rest(&scene) || scene_fail(error, path, "not enough memory")) && build(&builder);
    scene_free(&scene);
    if (!good) {
        mesh_free(mesh);
    }
    return good;
}

void mesh_free(struct mesh *mesh)
{
    free(mesh->positions);
    free(mesh->indices);
    free(mesh->colors);
    free(mesh->source);
    memset(mesh, 0, sizeof *mesh);
}
