#include "springls/segment_model.h"

#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

springls_grid_desc segment_model_grid(const int dims[3], const float spacing[3], const float origin[3], const float *direction)
{
    springls_grid_desc desc;
    memset(&desc, 0, sizeof desc);
    for (int r = 0; r < 3; ++r) {
        desc.size[r] = dims[r];
        desc.spacing[r] = (double)spacing[r];
        desc.origin[r] = (double)origin[r];
        for (int c = 0; c < 3; ++c) {
            desc.direction[3 * r + c] = (double)direction[3 * r + c];
        }
    }
    return desc;
}

springls_status segment_model_shape(springls_context *ctx, const char *shape, const float center[3], float radius)
{
    const float x = center[0], y = center[1], z = center[2];
    if (strcmp(shape, "cube") == 0) {
        springls_box box = {{x, y, z}, {radius, radius, radius}};
        return springls_set_implicit(ctx, springls_implicit_box, &box);
    }
    if (strcmp(shape, "torus") == 0) {
        springls_torus torus = {{x, y, z}, {0.0f, 0.0f, 1.0f}, 0.7f * radius, 0.3f * radius};
        return springls_set_implicit(ctx, springls_implicit_torus, &torus);
    }
    springls_sphere spheres[7];
    for (int s = 0; s < 7; ++s) {
        spheres[s] = (springls_sphere){{x, y, z}, radius};
    }
    if (strcmp(shape, "metasphere") == 0) { /* one in the middle, six around it */
        for (int s = 0; s < 6; ++s) {
            spheres[s].center[s / 2] += s % 2 ? 0.6f * radius : -0.6f * radius;
            spheres[s].radius = 0.4f * radius;
        }
        spheres[6].radius = 0.5f * radius;
        springls_metasphere metasphere = {spheres, 7};
        return springls_set_implicit(ctx, springls_implicit_metasphere, &metasphere);
    }
    return springls_set_implicit(ctx, springls_implicit_sphere, &spheres[0]);
}

springls_status segment_model_mask(springls_context *ctx, const uint8_t *mask, size_t count)
{
    int32_t *labels = malloc(count * sizeof *labels);
    if (!labels) {
        return SPRINGLS_OUT_OF_MEMORY;
    }
    for (size_t n = 0; n < count; ++n) {
        labels[n] = mask[n];
    }
    const springls_status status = springls_set_labels(ctx, labels, 1);
    free(labels);
    return status;
}

static const float *item(springls_view view, int index)
{
    return (const float *)(const void *)((const char *)view.data + (size_t)index * view.stride);
}

static bool remember(struct segment_watch *watch, const uint32_t *ids, springls_view particles)
{
    if (particles.count > watch->room) {
        const size_t room = (size_t)particles.count + (size_t)particles.count / 4;
        segment_watch_free(watch);
        watch->ids = malloc(room * sizeof *watch->ids);
        watch->particles = malloc(room * 3 * sizeof *watch->particles);
        watch->room = watch->ids && watch->particles ? (int)room : 0;
    }
    watch->count = particles.count <= watch->room ? particles.count : 0;
    for (int i = 0; i < watch->count; ++i) {
        watch->ids[i] = ids[i];
        memcpy(watch->particles + 3 * i, item(particles, i), 3 * sizeof(float));
    }
    return watch->count == particles.count;
}

bool segment_watch_look(struct segment_watch *watch, const springls_context *ctx, float still, float *moving)
{
    const springls_view particles = springls_view_particles(ctx), vertices = springls_view_vertices(ctx);
    const uint32_t *ids = springls_ids(ctx);
    int known = 0, moved = 0;
    for (int i = 0, j = 0; i < particles.count; ++i) { /* ids ascend in both lists */
        while (j < watch->count && watch->ids[j] < ids[i]) {
            ++j;
        }
        if (j == watch->count || watch->ids[j] != ids[i]) {
            continue;
        }
        const float *q = item(vertices, i);
        float e[3], f[3], normal[3], motion[3];
        vec3_sub(q + 3, q, e);
        vec3_sub(q + 6, q, f);
        vec3_cross(e, f, normal);
        vec3_sub(item(particles, i), watch->particles + 3 * j, motion);
        const float along = vec3_dot(motion, normal);
        moved += along * along > still * still * vec3_dot(normal, normal);
        ++known;
    }
    *moving = known > 0 ? (float)moved / (float)known : 1.0f;
    return remember(watch, ids, particles);
}

void segment_watch_free(struct segment_watch *watch)
{
    free(watch->ids);
    free(watch->particles);
    memset(watch, 0, sizeof *watch);
}

bool segment_at_rest(float moving, double volume, int steps, double *before)
{
    const double change = fabs(volume - *before);
    *before = volume;
    return moving < 0.02f && change < 0.0002 * steps * volume;
}
