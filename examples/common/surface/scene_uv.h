/* scene_uv.h - an affine map of texture coordinates, as KHR_texture_transform has it, v downwards: scale, then rotation, then offset. */
#ifndef EXAMPLES_SURFACE_SCENE_UV_H
#define EXAMPLES_SURFACE_SCENE_UV_H

#include <math.h>

struct uv_map {
    float offset[2], cosine, sine, scale[2];
};

static inline struct uv_map uv_map_none(void)
{
    const struct uv_map map = {{0.0f, 0.0f}, 1.0f, 0.0f, {1.0f, 1.0f}};
    return map;
}

/* Moves coordinates; those that are not finite become 0. */
static inline void uv_map_apply(const struct uv_map *map, float u, float v, float out[2])
{
    const float x = map->scale[0] * u, y = map->scale[1] * v;
    out[0] = map->offset[0] + map->cosine * x + map->sine * y;
    out[1] = map->offset[1] - map->sine * x + map->cosine * y;
    if (!isfinite(out[0]) || !isfinite(out[1])) {
        out[0] = out[1] = 0.0f;
    }
}

#endif
