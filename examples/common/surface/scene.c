#include "surface/scene.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool scene_fail(char error[SCENE_TEXT], const char *path, const char *format, ...)
{
    const size_t length = strlen(path);
    const int used =
        snprintf(error, SCENE_TEXT, "%s%s: ", length > 100 ? "..." : "", length > 100 ? path + length - 97 : path);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error + used, SCENE_TEXT - (size_t)used, format, arguments);
    va_end(arguments);
    for (char *c = error; *c; ++c) { /* texts of libraries, and names in files, may contain line ends */
        *c = *c == '\n' || *c == '\r' ? ' ' : *c;
    }
    return false;
}

static void free_part(struct scene_part *part)
{
    free(part->positions);
    free(part->normals);
    free(part->uvs);
    free(part->colors);
    free(part->triangles);
    free(part->bones);
    free(part->weights);
}

void scene_free(struct scene *scene)
{
    for (int p = 0; p < scene->part_count; ++p) {
        free_part(&scene->parts[p]);
    }
    for (int p = 0; p < scene->picture_count; ++p) {
        picture_free(&scene->pictures[p]);
    }
    for (int a = 0; a < scene->animation_count; ++a) {
        animation_free(&scene->animations[a]);
    }
    free(scene->nodes);
    free(scene->parts);
    free(scene->materials);
    free(scene->pictures);
    free(scene->animations);
    memset(scene, 0, sizeof *scene);
}

void scene_turn(int triangle[3])
{
    const int second = triangle[1];
    triangle[1] = triangle[2];
    triangle[2] = second;
}

/* Moves a vertex by the mean of its bones. sums: x, y, z, weight, and weight less that of bones that mirror. */
static void add_moved(const struct affine *bone, const float place[3], double weight, double sums[5])
{
    const double mirrors = affine_determinant(bone) < 0.0 ? -1.0 : 1.0;
    for (int i = 0; i < 3; ++i) {
        const double *row = bone->m + 4 * i;
        sums[i] += weight * (row[0] * (double)place[0] + row[1] * (double)place[1] + row[2] * (double)place[2] + row[3]);
    }
    sums[3] += weight;
    sums[4] += mirrors * weight;
}

static bool move_part(struct scene_part *part, const struct affine *places)
{
    double(*sums)[5] = calloc((size_t)part->vertex_count + 1, sizeof *sums);
    if (!sums) {
        return false;
    }
    for (int w = 0; w < part->weight_count; ++w) {
        const struct scene_weight *weight = &part->weights[w];
        const struct scene_bone *bone = &part->bones[weight->bone];
        const struct affine moved = affine_after(&places[bone->node], &bone->offset);
        add_moved(&moved, part->positions + 3 * (size_t)weight->vertex, (double)weight->weight, sums[weight->vertex]);
    }
    for (int v = 0; v < part->vertex_count; ++v) {
        if (!(sums[v][3] > 0.0)) {
            add_moved(&places[part->node], part->positions + 3 * (size_t)v, 1.0, sums[v]);
        }
        for (int i = 0; i < 3; ++i) {
            part->positions[3 * (size_t)v + (size_t)i] = (float)(sums[v][i] / sums[v][3]);
        }
    }
    for (int t = 0; t < part->triangle_count; ++t) {
        if (sums[part->triangles[3 * t]][4] < 0.0) {
            scene_turn(part->triangles + 3 * t);
        }
    }
    free(sums);
    return true;
}

bool scene_rest(struct scene *scene)
{
    struct affine *places = malloc(((size_t)scene->node_count + 1) * sizeof *places);
    bool good = places != NULL;
    for (int n = 0; good && n < scene->node_count; ++n) {
        const struct scene_node *node = &scene->nodes[n];
        places[n] = node->parent >= 0 ? affine_after(&places[node->parent], &node->local) : node->local;
    }
    for (int p = 0; good && p < scene->part_count; ++p) {
        good = move_part(&scene->parts[p], places);
    }
    free(places);
    return good;
}
