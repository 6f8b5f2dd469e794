/* material.h - how a surface looks, as glTF 2.0 describes it: a base color, perhaps an image of it, metal and roughness. */
#ifndef EXAMPLES_SURFACE_MATERIAL_H
#define EXAMPLES_SURFACE_MATERIAL_H

#include "pictures/image.h"

#include <math.h>
#include <stdlib.h>

enum { MATERIAL_NAME = 64 };

enum material_alpha { MATERIAL_OPAQUE, MATERIAL_MASK, MATERIAL_BLEND };

struct material {
    char name[MATERIAL_NAME];
    float base[4]; /* linear red, green, blue, and opacity: they multiply the image and the colors of vertices */
    float metallic, roughness, cutoff; /* cutoff: opacity below which MATERIAL_MASK shows nothing */
    enum material_alpha alpha;
    bool two_sided;
    int image; /* of the base color, or -1 */
};

/* An image as it was in its file, and decoded. */
struct picture {
    unsigned char *bytes; /* PNG, JPEG, ...; owned */
    size_t size;
    struct byte_image image;
};

static inline void picture_free(struct picture *picture)
{
    byte_image_free(&picture->image);
    free(picture->bytes);
}

static inline struct material material_plain(void)
{
    const struct material plain = {"", {1.0f, 1.0f, 1.0f, 1.0f}, 0.0f, 0.9f, 0.5f, MATERIAL_OPAQUE, false, -1};
    return plain;
}

/* Converts between linear light and display values. */
static inline float color_display(float linear) { return powf(fmaxf(0.0f, fminf(1.0f, linear)), 1.0f / 2.2f); }
static inline float color_linear(float display) { return powf(fmaxf(0.0f, fminf(1.0f, display)), 2.2f); }

/* Computes the color of a place, as display values: of the image (NULL: none) at its texture coordinates, times the base color and the
 * color of the vertices around. */
static inline void material_color(const struct material *material, const struct byte_image *image, const float uv[2],
                                  const float vertices[3], float color[3])
{
    float texture[3] = {1.0f, 1.0f, 1.0f};
    if (image && image->rgb) {
        byte_image_sample(image, uv, texture);
    }
    for (int k = 0; k < 3; ++k) {
        color[k] = vertices[k] * texture[k] * color_display(material->base[k]);
    }
}

#endif
