#include "character/surface_place.h"

#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

bool places_create(const struct character *character, struct places *places)
{
    const size_t corners = 3 * (size_t)character->triangle_count;
    uint32_t *indices = malloc(corners * sizeof *indices);
    memset(places, 0, sizeof *places);
    places->character = character;
    if (!indices) {
        return false;
    }
    for (size_t i = 0; i < corners; ++i) {
        indices[i] = (uint32_t)character->triangles[i];
    }
    const bool good = bvh_build(&places->bvh, character->positions, indices, (size_t)character->triangle_count);
    free(indices);
    return good;
}

void places_free(struct places *places)
{
    bvh_free(&places->bvh);
    memset(places, 0, sizeof *places);
}

float places_find(const struct places *places, const float point[3], struct place *place)
{
    const struct character *c = places->character;
    float closest[3] = {0.0f, 0.0f, 0.0f};
    uint32_t triangle = 0;
    const float distance = bvh_distance(&places->bvh, point, closest, &triangle);
    const int *v = c->triangles + 3 * triangle;
    place->triangle = (int)triangle;
    vec3_barycentric(c->positions + 3 * v[0], c->positions + 3 * v[1], c->positions + 3 * v[2], closest, place->weight);
    return distance;
}

struct influences place_influences(const struct character *character, const struct place *place)
{
    struct influences sum;
    memset(&sum, 0, sizeof sum);
    const int *corner = character->triangles + 3 * place->triangle;
    for (int k = 0; k < 3; ++k) {
        const struct influences *in = &character->influences[corner[k]];
        for (int b = 0; b < CHARACTER_BONES; ++b) {
            if (in->weight[b] * place->weight[k] > 0.0f) {
                influences_add(&sum, in->joint[b], in->weight[b] * place->weight[k]);
            }
        }
    }
    influences_normalize(&sum, 0);
    return sum;
}

void place_uv(const struct character *character, const struct place *place, float uv[2])
{
    const int *corner = character->triangles + 3 * place->triangle;
    uv[0] = uv[1] = 0.0f;
    for (int k = 0; k < 3; ++k) {
        uv[0] += place->weight[k] * character->uvs[2 * corner[k]];
        uv[1] += place->weight[k] * character->uvs[2 * corner[k] + 1];
    }
}

void place_color(const struct character *character, const struct place *place, float color[3])
{
    const int *corner = character->triangles + 3 * place->triangle;
    const struct material *material = &character->materials[character->materials_of[place->triangle]];
    float uv[2] = {0.0f, 0.0f}, sum[3] = {0.0f, 0.0f, 0.0f};
    if (material->image >= 0) {
        place_uv(character, place, uv);
    }
    for (int k = 0; k < 3; ++k) {
        vec3_add_scaled(sum, place->weight[k], character->colors + 3 * corner[k], sum);
    }
    material_color(material, material->image >= 0 ? &character->pictures[material->image].image : NULL, uv, sum, color);
}
