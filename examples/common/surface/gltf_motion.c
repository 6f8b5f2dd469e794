/* gltf_motion.c - clips of a glTF file: places, rotations and scales of nodes (glTF 2.0, 3.11). */
#include "surface/gltf_accessor.h"
#include "surface/gltf_scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name;
    enum keys_interpolation kind;
} interpolations[] = {{"LINEAR", KEYS_LINEAR}, {"STEP", KEYS_STEP}, {"CUBICSPLINE", KEYS_CUBIC}};

static bool read_interpolation(struct gltf_scene *g, int animation, const cJSON *sampler, enum keys_interpolation *kind)
{
    const cJSON *item = gltf_member(sampler, "interpolation");
    *kind = KEYS_LINEAR;
    for (size_t i = 0; item && i < sizeof interpolations / sizeof *interpolations; ++i) {
        if (cJSON_IsString(item) && strcmp(item->valuestring, interpolations[i].name) == 0) {
            *kind = interpolations[i].kind;
            return true;
        }
    }
    return !item
        || gltf_fail(&g->file, GLTF_ANIMATIONS, animation, "interpolation %.30s is none of glTF's",
                     cJSON_IsString(item) ? item->valuestring : "?");
}

/* Takes times over that rise and are finite. */
static bool take_times(struct gltf_scene *g, int animation, const struct gltf_values *times, struct keys *keys)
{
    for (size_t k = 0; k < times->count; ++k) {
        if (!isfinite(times->at[k])) {
            return gltf_fail(&g->file, GLTF_ANIMATIONS, animation, "a key is not finite");
        }
        if (k > 0 && times->at[k] < times->at[k - 1]) {
            return gltf_fail(&g->file, GLTF_ANIMATIONS, animation, "the times of its keys do not rise");
        }
    }
    keys->times = times->at;
    return true;
}

/* Takes values over: rotations as w, x, y, z, and of length 1 where they are no tangents. */
static bool take_values(struct gltf_scene *g, int animation, const struct gltf_values *values, int count, struct keys *keys)
{
    const int width = values->width;
    for (size_t i = 0; i < values->count * (size_t)width; ++i) {
        if (!isfinite(values->at[i])) {
            return gltf_fail(&g->file, GLTF_ANIMATIONS, animation, "a key is not finite");
        }
    }
    for (size_t k = 0; width == 4 && k < values->count; ++k) {
        double *q = values->at + 4 * k, w = q[3];
        memmove(q + 1, q, 3 * sizeof *q);
        q[0] = w;
    }
    keys->values = values->at;
    keys->count = count;
    for (int k = 0; width == 4 && k < count; ++k) {
        double *q = keys_value(keys, 4, k);
        quaternion_slerp(q, q, 0.0, q);
    }
    return true;
}

/* Reads the keys of a sampler, `width` numbers each. */
static bool read_keys(struct gltf_scene *g, int animation, const cJSON *sampler, int width, struct keys *keys)
{
    struct gltf_values times = {0}, values = {0};
    int input, output;
    if (!gltf_reference(&g->file, sampler, "input", GLTF_ACCESSORS, &input)
        || !gltf_reference(&g->file, sampler, "output", GLTF_ACCESSORS, &output)
        || !read_interpolation(g, animation, sampler, &keys->interpolation)) {
        return false;
    }
    if (input < 0 || output < 0) {
        return gltf_fail(&g->file, GLTF_ANIMATIONS, animation, "a sampler has no input or no output");
    }
    bool good = gltf_read_accessor(&g->file, input, 1, 1, &times) && gltf_read_accessor(&g->file, output, width, width, &values);
    if (good && values.count != times.count * (size_t)keys_width(keys, 1)) {
        good = gltf_fail(&g->file, GLTF_ANIMATIONS, animation, "%zu values for %zu keys", values.count, times.count);
    }
    good = good && take_times(g, animation, &times, keys) && take_values(g, animation, &values, (int)times.count, keys);
    if (!keys->times) { free(times.at); }
    if (!keys->values) { free(values.at); }
    return good;
}

/* Finds what a channel moves: *node -1 where that is nothing of a skeleton. */
static struct keys *find_keys(struct channel *channel, const char *path, int *width)
{
    *width = strcmp(path, "rotation") == 0 ? 4 : 3;
    return strcmp(path, "translation") == 0 ? &channel->translation
        : *width == 4                       ? &channel->rotation
        : strcmp(path, "scale") == 0        ? &channel->scale
                                            : NULL;
}

/* Reads a channel into that of its node, or a new one; channel_of: the number of each node's channel, -1: it has none. */
static bool read_channel(struct gltf_scene *g, int number, const cJSON *item, struct animation *to, int *channel_of)
{
    const cJSON *target = gltf_member(item, "target"), *path = gltf_member(target, "path"),
                *samplers = gltf_member(g->file.items[GLTF_ANIMATIONS][number], "samplers");
    const double sampler = gltf_whole(item, "sampler", -1.0);
    struct channel none = {0};
    int node, width;
    if (!gltf_reference(&g->file, target, "node", GLTF_NODES, &node)) {
        return false;
    }
    if (node < 0 || g->node_of[node] < 0 || !cJSON_IsString(path) || !find_keys(&none, path->valuestring, &width)) {
        return true; /* moves nothing that is read */
    }
    if (sampler < 0.0 || sampler >= cJSON_GetArraySize(samplers)) {
        return gltf_fail(&g->file, GLTF_ANIMATIONS, number, "a channel names a sampler that there is not");
    }
    if (channel_of[node] < 0) {
        channel_of[node] = to->channel_count;
        to->channels[to->channel_count++].joint = g->node_of[node];
    }
    struct keys *keys = find_keys(&to->channels[channel_of[node]], path->valuestring, &width);
    if (keys->count > 0) {
        return gltf_fail(&g->file, GLTF_ANIMATIONS, number, "two channels move the same of node %d", node);
    }
    if (!read_keys(g, number, cJSON_GetArrayItem(samplers, (int)sampler), width, keys)) {
        return false;
    }
    to->duration = fmax(to->duration, keys->times[keys->count - 1]);
    return true;
}

static bool read_animation(struct gltf_scene *g, int number, struct animation *to)
{
    const cJSON *item = g->file.items[GLTF_ANIMATIONS][number], *channels = gltf_member(item, "channels"),
                *name = gltf_member(item, "name"), *channel;
    int *channel_of = malloc(((size_t)g->file.counts[GLTF_NODES] + 1) * sizeof *channel_of);
    to->channels = calloc((size_t)cJSON_GetArraySize(channels) + 1, sizeof *to->channels);
    bool good = (channel_of && to->channels) || gltf_no_memory(g);
    snprintf(to->name, sizeof to->name, "%.*s", ANIMATION_NAME - 1, cJSON_IsString(name) ? name->valuestring : "");
    for (int n = 0; good && n < g->file.counts[GLTF_NODES]; ++n) {
        channel_of[n] = -1;
    }
    cJSON_ArrayForEach(channel, channels) { good = good && read_channel(g, number, channel, to, channel_of); }
    free(channel_of);
    return good;
}

bool gltf_read_animations(struct gltf_scene *g)
{
    const int count = g->file.counts[GLTF_ANIMATIONS];
    g->to->animations = calloc((size_t)count + 1, sizeof *g->to->animations);
    bool good = g->to->animations || gltf_no_memory(g);
    for (int a = 0; good && a < count; ++a) {
        good = read_animation(g, a, &g->to->animations[g->to->animation_count++]);
    }
    return good;
}
