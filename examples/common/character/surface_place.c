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

void place_barycentric(const float *a, const float *b, const float *c, const float *p, float weight[3])
{
    float u[3], v[3], w[3];
    vec3_sub(b, a, u);
    vec3_sub(c, a, v);
    vec3_sub(p, a, w);
    const float uu = vec3_dot(u, u), uv = vec3_dot(u, v), vv = vec3_dot(v, v), wu = vec3_dot(w, u), wv = vec3_dot(w, v);
    const float d = uu * vv - uv * uv;
    float s = d > 0.0f ? (vv * wu - uv * wv) / d : 0.0f, t = d > 0.0f ? (uu * wv - uv * wu) / d : 0.0f;
    s = fminf(1.0f, fmaxf(0.0f, s));
    t = fminf(1.0f - s, fmaxf(0.0f, t));
    weight[0] = 1.0f - s - t;
    weight[1] = s;
    weight[2] = t;
}

float places_find(const struct places *places, const float point[3], struct place *place)
{
    const struct character *c = places->character;
    float closest[3] = {0.0f, 0.0f, 0.0f};
    uint32_t triangle = 0;
    const float distance = bvh_distance(&places->bvh, point, closest, &triangle);
    const int *v = c->triangles + 3 * triangle;
    place->triangle = (int)triangle;
    place_barycentric(c->positions + 3 * v[0], c->positions + 3 * v[1], c->positions + 3 * v[2], closest, place->weight);
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

/* Returns a texel index; pixel centers are at half integers and the image repeats. */
static int texel(float u, int size, float *part)
{
    const float x = (u - floorf(u)) * (float)size - 0.5f, whole = floorf(x);
    *part = x - whole;
    return ((int)whole + size) % size;
}

/* Samples an image bilinearly; it repeats. */
static void image_sample(const struct byte_image *image, const float uv[2], float color[3])
{
    float s, t;
    const int x = texel(uv[0], image->width, &s), y = texel(uv[1], image->height, &t);
    const int x1 = (x + 1) % image->width, y1 = (y + 1) % image->height;
    const unsigned char *row = image->rgb + 3 * (size_t)y * (size_t)image->width, *row1 = image->rgb + 3 * (size_t)y1 * (size_t)image->width;
    for (int k = 0; k < 3; ++k) {
        const float top = (1.0f - s) * ((float)row[3 * x + k] / 255.0f) + s * ((float)row[3 * x1 + k] / 255.0f);
        const float bottom = (1.0f - s) * ((float)row1[3 * x + k] / 255.0f) + s * ((float)row1[3 * x1 + k] / 255.0f);
        color[k] = (1.0f - t) * top + t * bottom;
    }
}

void place_color(const struct character *character, const struct place *place, float color[3])
{
    const int *corner = character->triangles + 3 * place->triangle;
    const struct material *material = &character->materials[character->materials_of[place->triangle]];
    float texture[3] = {1.0f, 1.0f, 1.0f}, uv[2], sum[3] = {0.0f, 0.0f, 0.0f};
    if (material->image >= 0) {
        place_uv(character, place, uv);
        image_sample(&character->pictures[material->image].image, uv, texture);
    }
    for (int k = 0; k < 3; ++k) {
        vec3_add_scaled(sum, place->weight[k], character->colors + 3 * corner[k], sum);
    }
    for (int k = 0; k < 3; ++k) {
        color[k] = sum[k] * texture[k] * color_display(material->base[k]);
    }
}
