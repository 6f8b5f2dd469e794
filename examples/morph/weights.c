/* weights.c - bone weights of springls: those of the source's surface at the place that a springl came from, its correspondence. */
#include "morph/morph.h"

#include "base/threads.h"

#include <stdlib.h>
#include <string.h>

/* Computes the bone weights at a place on the source's surface. */
static struct influences compute_weights(const struct morph *morph, const float correspondence[3])
{
    float world[3];
    struct place place;
    for (int k = 0; k < 3; ++k) {
        world[k] = (float)(morph->grid.origin[k] + morph->grid.spacing[k] * (double)correspondence[k]);
    }
    places_find(&morph->source.places, world, &place);
    return place_influences(&morph->source.character, &place);
}

/* Returns the place of a correspondence in the cache, a hash table that has free ones: its own, or a free one. */
static struct cached_weights *cache_slot(const struct morph *morph, const float correspondence[3])
{
    uint32_t bits[3], hash = 0;
    memcpy(bits, correspondence, sizeof bits);
    for (int k = 0; k < 3; ++k) { hash = (hash ^ bits[k]) * 0x9e3779b1u; hash ^= hash >> 15; }
    size_t at = hash % morph->cache_room;
    while (morph->cache[at].used && memcmp(morph->cache[at].correspondence, correspondence, 3 * sizeof *correspondence) != 0) {
        at = (at + 1) % morph->cache_room;
    }
    return &morph->cache[at];
}

struct weights_loop {
    const struct morph *morph;
    struct cached_weights **fresh;
};

static void run_weights_loop(void *arg, int begin, int end)
{
    const struct weights_loop *loop = arg;
    const struct morph *morph = loop->morph;
    struct cached_weights **fresh = loop->fresh;
    for (int i = begin; i < end; ++i) {
        fresh[i]->influences = compute_weights(morph, fresh[i]->correspondence);
    }
}

bool morph_cache_weights(struct morph *morph)
{
    const springls_view places = springls_view_correspondences(morph->ctx);
    struct cached_weights **fresh = malloc(((size_t)places.count + 1) * sizeof *fresh);
    int fresh_count = 0;
    if (!fresh) {
        return morph_no_memory();
    }
    if (morph->cache_room < 4 * ((size_t)places.count + (size_t)morph->cached)) {
        free(morph->cache);
        morph->cache_room = 16 * ((size_t)places.count + 1);
        morph->cached = 0;
        morph->cache = calloc(morph->cache_room, sizeof *morph->cache);
        if (!morph->cache) {
            free(fresh);
            return morph_no_memory();
        }
    }
    for (int i = 0; i < places.count; ++i) {
        const float *correspondence = morph_springl_item(places, i);
        struct cached_weights *slot = cache_slot(morph, correspondence);
        if (!slot->used) {
            memcpy(slot->correspondence, correspondence, sizeof slot->correspondence);
            slot->used = true;
            fresh[fresh_count++] = slot;
        }
    }
    morph->cached += fresh_count;
    struct weights_loop loop = {morph, fresh};
    threads_for(fresh_count, 16, run_weights_loop, &loop);
    free(fresh);
    return true;
}

struct influences morph_springl_weights(const struct morph *morph, const float correspondence[3])
{
    const struct cached_weights *slot = cache_slot(morph, correspondence);
    return slot->used ? slot->influences : compute_weights(morph, correspondence);
}

/* ---- comparisons ---- */

/* Computes the weights of all springls, one channel a joint. */
static float *channel_values(const struct morph *morph)
{
    const springls_view places = springls_view_correspondences(morph->ctx);
    const size_t joints = (size_t)morph->target.character.joint_count;
    float *values = calloc((size_t)places.count * joints + 1, sizeof *values);
    for (int i = 0; values && i < places.count; ++i) {
        const struct influences in = compute_weights(morph, morph_springl_item(places, i));
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            values[(size_t)i * joints + (size_t)in.joint[k]] += in.weight[k];
        }
    }
    return values;
}

bool morph_add_channels(struct morph *morph)
{
    const springls_attribute_desc desc = {"bone weights", morph->target.character.joint_count, SPRINGLS_POLICY_BLEND,
                                          SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND};
    float *values = channel_values(morph);
    const bool good = values ? morph_check(morph->ctx, springls_add_attribute(morph->ctx, &desc, values, NULL), "bone weights")
                             : morph_no_memory();
    free(values);
    return good;
}

bool morph_compare_channels(struct morph *morph)
{
    const springls_view channel = springls_view_attribute(morph->ctx, springls_find_attribute(morph->ctx, "bone weights"));
    const int joints = morph->target.character.joint_count;
    float *values = channel_values(morph);
    if (!values || !channel.data) {
        free(values);
        return morph_no_memory();
    }
    for (int i = 0; i < channel.count; ++i) {
        const float *carried = morph_springl_item(channel, i);
        double sum = 0.0;
        for (int j = 0; j < joints; ++j) {
            sum += (double)carried[j];
            morph->channel_difference +=
                fabs((double)carried[j] - (double)values[(size_t)i * (size_t)joints + (size_t)j]) / channel.count;
        }
        morph->channel_sum_error = fmax(morph->channel_sum_error, fabs(sum - 1.0));
    }
    free(values);
    return true;
}

void morph_compare_weights(struct morph *morph)
{
    const struct morph_frame *last = &morph->frames[morph->frame_count - 1];
    const struct character *target = &morph->target.character;
    struct bvh bvh;
    double sum = 0.0;
    if (!bvh_build(&bvh, morph->target.posed, (const uint32_t *)morph->target.mesh.triangles,
                   (size_t)morph->target.mesh.triangle_count)) {
        return;
    }
    for (int v = 0; v < last->mesh.vertex_count; ++v) {
        struct place place;
        uint32_t triangle = 0;
        places_find(&morph->source.places, last->mesh.correspondences + 3 * v, &place);
        const struct influences mine = place_influences(&morph->source.character, &place);
        bvh_distance(&bvh, last->mesh.positions + 3 * v, NULL, &triangle);
        const struct influences *theirs = &morph->target.influences[morph->target.mesh.triangles[3 * triangle]];
        for (int j = 0; j < target->joint_count; ++j) {
            float a = 0.0f, b = 0.0f;
            for (int k = 0; k < CHARACTER_BONES; ++k) {
                a += mine.joint[k] == j ? mine.weight[k] : 0.0f;
                b += theirs->joint[k] == j ? theirs->weight[k] : 0.0f;
            }
            sum += fabs((double)a - (double)b) / last->mesh.vertex_count;
        }
    }
    morph->weight_difference = sum;
    bvh_free(&bvh);
}
