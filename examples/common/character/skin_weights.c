#include "character/skin_weights.h"

#include "base/bvh.h"
#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

/* Converts weights of bones to the largest weights of the joints at which they begin. */
static struct influences of_bones(const float *weights, int count, const int *joints)
{
    struct influences in;
    memset(&in, 0, sizeof in);
    for (int b = 0; b < count; ++b) {
        if (weights[b] > 1e-4f) { influences_add(&in, joints[b], weights[b]); }
    }
    influences_normalize(&in, joints[0]);
    return in;
}

bool skin_weights_heat(const struct skin_surface *s, const struct bone *bones, const int *joints, int bone_count,
                       struct influences *influences, struct heat_report *report)
{
    float *weights = malloc(((size_t)s->vertex_count * (size_t)bone_count + 1) * sizeof *weights);
    const bool good = weights
        && heat_weights(s->positions, s->vertex_count, s->triangles, s->triangle_count, bones, bone_count, weights,
                        report);
    for (int v = 0; good && v < s->vertex_count; ++v) {
        influences[v] = of_bones(weights + (size_t)v * (size_t)bone_count, bone_count, joints);
    }
    free(weights);
    return good;
}

bool skin_weights_transfer(const struct skin_surface *s, const struct influences *influences, struct character *body)
{
    struct bvh bvh;
    if (!bvh_build(&bvh, s->positions, (const uint32_t *)s->triangles, (size_t)s->triangle_count)) { return false; }
    for (int j = 0; j < body->joint_count; ++j) { body->joints[j].bone = false; }
    for (int v = 0; v < body->vertex_count; ++v) {
        uint32_t triangle = 0;
        bvh_distance(&bvh, body->positions + 3 * v, NULL, &triangle);
        float best = INFINITY;
        for (int k = 0; k < 3; ++k) {
            float d[3];
            const int corner = s->triangles[3 * triangle + (uint32_t)k];
            vec3_sub(body->positions + 3 * v, s->positions + 3 * corner, d);
            if (vec3_length(d) < best) {
                best = vec3_length(d);
                body->influences[v] = influences[corner];
            }
        }
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            body->joints[body->influences[v].joint[k]].bone |= body->influences[v].weight[k] > 0.0f;
        }
    }
    bvh_free(&bvh);
    return true;
}
