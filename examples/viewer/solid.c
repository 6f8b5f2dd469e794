#include "viewer/solid.h"

#include "base/vec3.h"

#include <stdio.h>
#include <string.h>

bool viewer_cut_between(const struct viewer_ray *from, const struct viewer_ray *to, float width, bool side,
                        struct viewer_cut *cut)
{
    const float along = vec3_dot(from->direction, to->direction);
    memcpy(cut->eye, from->origin, sizeof cut->eye);
    vec3_cross(from->direction, to->direction, cut->normal);
    vec3_add_scaled(to->direction, -along, from->direction, cut->after);
    vec3_add_scaled(from->direction, -along, to->direction, cut->before);
    vec3_normalize(cut->after);
    vec3_normalize(cut->before);
    cut->half_width = 0.5f * width;
    cut->side = side;
    return vec3_normalize(cut->normal) > 0.01f;
}

/* Computes a lower bound of the signed distance, exact near the faces. */
static void cut_distance(void *user, const float *points, int count, float *out)
{
    const struct viewer_cut *cut = user;
    float from_eye[3];
    for (int i = 0; i < count; ++i) {
        vec3_sub(points + 3 * i, cut->eye, from_eye);
        const float height = vec3_dot(from_eye, cut->normal);
        const float ends = fmaxf(-vec3_dot(from_eye, cut->after), -vec3_dot(from_eye, cut->before));
        float beyond = -INFINITY;
        for (int a = 0; a < 3; ++a) {
            beyond = fmaxf(beyond, fabsf(points[3 * i + a] - cut->middle[a]) - cut->reach);
        }
        out[i] = fmaxf(beyond, cut->side ? -height : fmaxf(fabsf(height) - cut->half_width, ends));
    }
}

bool viewer_subtract(struct viewer_model *model, const struct viewer_cut *cut)
{
    struct viewer_cut copy = *cut;
    struct viewer_model knife = {0}; /* a body instead of a function: its springls bring the color of the cut's faces */
    float lower[3], upper[3];
    if (!viewer_model_finish(model) || !viewer_model_box(model, lower, upper)) {
        return false;
    }
    copy.reach = 0.0f;
    for (int a = 0; a < 3; ++a) { /* around the body only, and not in all the room there is */
        copy.middle[a] = 0.5f * (lower[a] + upper[a]);
        copy.reach = fmaxf(copy.reach, 0.5f * (upper[a] - lower[a]) + 6.0f * model->voxel);
    }
    bool good = viewer_model_second(&knife, model, cut_distance, &copy);
    if (!good) {
        snprintf(model->error, sizeof model->error, "the cut misses the body: %.200s", knife.error);
    }
    good = good && viewer_model_combine(model, SPRINGLS_OPERATION_DIFFERENCE, &knife);
    viewer_model_free(&knife);
    return good;
}

bool viewer_merge(struct viewer_model *model, struct viewer_model *second)
{
    return viewer_model_combine(model, SPRINGLS_OPERATION_UNION, second);
}
