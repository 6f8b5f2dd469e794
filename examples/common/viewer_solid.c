#include "viewer_solid.h"

#include "vec3.h"

#include <stdlib.h>
#include <string.h>

bool viewer_cut_between(const struct viewer_ray *from, const struct viewer_ray *to, float width, bool side, struct viewer_cut *cut)
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

/* Its signed distance near its faces; never more than the distance. */
static void cut_distance(void *user, const float *points, int count, float *out)
{
    const struct viewer_cut *cut = user;
    float from_eye[3];
    for (int i = 0; i < count; ++i) {
        vec3_sub(points + 3 * i, cut->eye, from_eye);
        const float height = vec3_dot(from_eye, cut->normal);
        const float ends = fmaxf(-vec3_dot(from_eye, cut->after), -vec3_dot(from_eye, cut->before));
        out[i] = cut->side ? -height : fmaxf(fabsf(height) - cut->half_width, ends);
    }
}

/* The second body's distance where it has been moved to. */
struct moved {
    struct viewer_model *body;
    const float *offset;
    bool failed;
};

static void moved_distance(void *user, const float *points, int count, float *out)
{
    struct moved *moved = user;
    for (int i = 0; i < count; ++i) {
        float x[3];
        vec3_sub(points + 3 * i, moved->offset, x);
        moved->failed |= springls_sample_distance(moved->body->ctx, x, 1, &out[i]) != SPRINGLS_OK;
    }
}

/* min(phi, other), or max(phi, -other), at every voxel; the body becomes its own reference. */
static bool combine(struct viewer_model *model, springls_implicit_fn other, void *user, bool subtract)
{
    const size_t side = (size_t)model->grid, count = side * side * side;
    float *phi = malloc(count * sizeof *phi), *row = malloc(4 * side * sizeof *row);
    bool good = phi && row ? viewer_model_check(model, springls_copy_level_set(model->ctx, phi))
                           : viewer_model_check(model, SPRINGLS_OUT_OF_MEMORY);
    for (size_t n = 0; good && n < count; n += side) {
        for (size_t i = 0; i < side; ++i) {
            const float voxel[3] = {(float)i, (float)(n / side % side), (float)(n / (side * side))};
            memcpy(row + side + 3 * i, voxel, sizeof voxel);
        }
        springls_to_world(model->ctx, row + side, (int)side, row + side);
        other(user, row + side, (int)side, row);
        for (size_t i = 0; i < side; ++i) {
            const float distance = row[i] / model->voxel;
            phi[n + i] = subtract ? fmaxf(phi[n + i], -distance) : fminf(phi[n + i], distance);
        }
    }
    good = good && viewer_model_check(model, springls_set_level_set(model->ctx, phi));
    free(phi);
    free(row);
    ++model->version;
    return good;
}

bool viewer_subtract(struct viewer_model *model, const struct viewer_cut *cut)
{
    struct viewer_cut copy = *cut;
    return combine(model, cut_distance, &copy, true);
}

bool viewer_merge(struct viewer_model *model, struct viewer_model *second, const float offset[3])
{
    struct moved moved = {second, offset, false};
    return combine(model, moved_distance, &moved, false)
           && viewer_model_check(model, moved.failed ? SPRINGLS_INVALID_ARGUMENT : SPRINGLS_OK);
}
