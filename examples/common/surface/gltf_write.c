#include "surface/gltf_builder.h"

#include <stdio.h>

bool gltf_write_mesh(const char *path, const struct gltf_mesh *mesh, const struct gltf_look *look)
{
    static const int root = 0;
    struct gltf g;
    gltf_begin(&g);
    gltf_mesh(&g, mesh, look, gltf_materials(&g, look));
    cJSON *node = gltf_add(&g, "nodes", NULL);
    gltf_number(node, "mesh", 0);
    if (mesh->origin) {
        gltf_numbers(node, "translation", mesh->origin, 3);
    }
    gltf_scene(&g, &root, 1);
    return gltf_finish(&g, path);
}

/* Adds a frame's node, and the channel that shows it in its time: hidden, shown, hidden; the first frame has no time before and
 * the last none after. */
static void add_frame(struct gltf *g, cJSON *animation, int frame, int count, int fps)
{
    const float start = (float)frame / (float)fps, end = (float)(frame + 1) / (float)fps, after = frame == count - 1 ? 1.0f : 0.0f;
    const float times[3] = {0.0f, start, end}, scales[9] = {0, 0, 0, 1, 1, 1, after, after, after};
    const int skip = frame == 0;
    char name[32];
    cJSON *node = gltf_add(g, "nodes", NULL);
    snprintf(name, sizeof name, "frame %d", frame);
    cJSON_AddStringToObject(node, "name", name);
    gltf_number(node, "mesh", frame);
    if (frame > 0) {
        gltf_numbers(node, "scale", (const double[3]){0, 0, 0}, 3);
    }
    gltf_channel(g, animation, frame, "scale", gltf_floats(g, times + skip, 3 - skip, 1, GLTF_NO_TARGET, true), scales + 3 * skip,
                 3 - skip, 3, "STEP");
}

bool gltf_write_sequence(const char *path, const struct gltf_mesh *frames, int count, int fps, const struct gltf_look *look)
{
    struct gltf g;
    gltf_begin(&g);
    const int material = gltf_materials(&g, look);
    cJSON *animation = gltf_animation(&g, "morph");
    for (int f = 0; f < count; ++f) {
        gltf_mesh(&g, &frames[f], look, material);
        add_frame(&g, animation, f, count, fps);
    }
    cJSON *children = cJSON_AddArrayToObject(gltf_add(&g, "nodes", NULL), "children");
    for (int f = 0; f < count; ++f) {
        cJSON_AddItemToArray(children, cJSON_CreateNumber(f));
    }
    gltf_scene(&g, &count, 1);
    return gltf_finish(&g, path);
}
