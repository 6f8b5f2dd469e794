/* Rays through a model's volume: capsules and surfels against exact hits, and a walk through bricks that misses nothing. */
#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_volume_raycast_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_volume_raycast_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "base/vec3.h"
#include "springls/volume_raycast.h"

#include <stdlib.h>
#include <string.h>

enum { RAYS = 400 };

static const float center[3] = {16.0f, 16.5f, 15.5f};
static const float ball_radius = 8.0f;

static springls_context *make_ball(void)
{
    springls_desc desc = springls_default_desc();
    springls_sphere ball = {{center[0], center[1], center[2]}, ball_radius};
    springls_context *ctx;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 32;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) {
        return NULL;
    }
    if (springls_set_implicit(ctx, springls_implicit_sphere, &ball) != SPRINGLS_OK) {
        springls_destroy(ctx);
        return NULL;
    }
    return ctx;
}

/* Number i of rays from all around, some past the ball, from `away` radii. */
static void make_test_ray(int i, float away, float origin[3], float direction[3])
{
    const float z = 1.0f - (2.0f * (float)i + 1.0f) / RAYS, turn = 2.3999632f * (float)i, ring = sqrtf(1.0f - z * z);
    const float from[3] = {ring * cosf(turn), ring * sinf(turn), z};
    const float aside[3] = {0.95f * cosf(3.1f * (float)i), 0.95f * sinf(5.3f * (float)i), 0.95f * cosf(7.7f * (float)i)};
    for (int k = 0; k < 3; ++k) {
        origin[k] = center[k] + away * ball_radius * from[k];
        direction[k] = center[k] + ball_radius * aside[k] - origin[k];
    }
    vec3_normalize(direction);
}

/* Returns the distance to the nearest triangle of the springls, by the library's own search. */
static float distance_to(springls_context *ctx, const float x[3])
{
    springls_hit hit;
    return springls_closest(ctx, SPRINGLS_SURFACE_SOUP, x, 1, &hit) == SPRINGLS_OK ? hit.distance : NAN;
}

/* One triangle's capsule: corner, edge and face are entered where geometry has it, and a ray from within hits at once. */
TEST a_capsule_is_met_at_its_face_edge_and_corner(void)
{
    static const float triangle[9] = {0.0f, 0.0f, 0.0f, 4.0f, 0.0f, 0.0f, 0.0f, 4.0f, 0.0f};
    static const struct {
        float origin[3], direction[3], distance, normal[3];
    } rays[] = {
        {{1.0f, 1.0f, 9.0f}, {0.0f, 0.0f, -1.0f}, 8.5f, {0.0f, 0.0f, 1.0f}},   /* face */
        {{1.0f, 1.0f, -9.0f}, {0.0f, 0.0f, 1.0f}, 8.5f, {0.0f, 0.0f, -1.0f}},  /* its other side */
        {{2.0f, -9.0f, 0.3f}, {0.0f, 1.0f, 0.0f}, 8.6f, {0.0f, -0.8f, 0.6f}},  /* edge */
        {{-9.0f, -0.3f, 0.0f}, {1.0f, 0.0f, 0.0f}, 8.6f, {-0.8f, -0.6f, 0.0f}}, /* corner */
        {{1.0f, 1.0f, 0.25f}, {1.0f, 0.0f, 0.0f}, 0.0f, {0.0f, 0.0f, 1.0f}},   /* from within */
    };
    struct volume_scene scene;
    struct volume_hit hit;
    ASSERT(volume_scene_capsules(triangle, 1, 0.5f, 1.0f, &scene));
    for (size_t i = 0; i < sizeof rays / sizeof *rays; ++i) {
        ASSERT(volume_raycast(&scene, rays[i].origin, rays[i].direction, &hit));
        ASSERT_IN_RANGE(rays[i].distance, hit.distance, 1e-5f);
        for (int k = 0; k < 3; ++k) {
            ASSERT_IN_RANGE(rays[i].normal[k], hit.normal[k], 1e-5f);
        }
    }
    const float away[3] = {1.0f, 1.0f, 0.6f}, up[3] = {0.0f, 0.0f, 1.0f};
    const float beside[3] = {-0.6f, 9.0f, 0.0f}, back[3] = {0.0f, -1.0f, 0.0f};
    ASSERT_FALSE(volume_raycast(&scene, away, up, &hit));
    ASSERT_FALSE(volume_raycast(&scene, beside, back, &hit));
    volume_scene_free(&scene);
    PASS();
}

/* A ball's capsules: a hit lies at the radius from the nearest triangle, no place before it is nearer, and a ray without a hit
   comes near none. From afar, too. */
TEST rays_meet_the_capsules_of_a_ball_exactly(void)
{
    static const float radii[2] = {0.05f, 0.5f};
    springls_context *ctx = make_ball();
    ASSERT(ctx);
    const springls_view view = springls_view_vertices(ctx);
    float *triangles = malloc((size_t)view.count * 9 * sizeof *triangles);
    ASSERT(triangles);
    for (int i = 0; i < view.count; ++i) {
        memcpy(triangles + 9 * i, (const char *)view.data + (size_t)i * view.stride, 9 * sizeof *triangles);
    }
    for (int r = 0; r < 2; ++r) {
        struct volume_scene scene;
        int met = 0, missed = 0;
        ASSERT(volume_scene_capsules(triangles, view.count, radii[r], 1.0f, &scene));
        for (int i = 0; i < RAYS; ++i) {
            float origin[3], d[3], x[3];
            struct volume_hit hit;
            const float away = i % 2 ? 40.0f : 2.0f;
            make_test_ray(i, away, origin, d);
            const bool found = volume_raycast(&scene, origin, d, &hit);
            const float end = found ? hit.distance - 0.02f : (away + 2.0f) * ball_radius, begin = (away - 1.7f) * ball_radius;
            for (int k = 0; k < 24; ++k) { /* nowhere on the way to it */
                vec3_add_scaled(origin, begin + (end - begin) * (float)k / 23.0f, d, x);
                ASSERT(distance_to(ctx, x) > radii[r]);
            }
            if (found) {
                vec3_add_scaled(origin, hit.distance, d, x);
                ASSERT_IN_RANGE(radii[r], distance_to(ctx, x), 1e-4f);
                ASSERT(vec3_dot(hit.normal, d) < 0.05f);
                ASSERT_IN_RANGE(1.0f, vec3_length(hit.normal), 1e-4f);
            }
            met += found;
            missed += !found;
        }
        ASSERT(met > RAYS / 2 && missed > RAYS / 20);
        volume_scene_free(&scene);
    }
    free(triangles);
    springls_destroy(ctx);
    PASS();
}

/* Looks at all surfels one by one. Returns the first that the ray meets, or -1. */
static int first_disk(const float *surfels, int count, const float origin[3], const float d[3])
{
    float least = INFINITY;
    int first = -1;
    for (int s = 0; s < count; ++s) {
        const float *disk = surfels + 7 * s;
        float m[3], x[3];
        vec3_sub(disk, origin, m);
        const float t = vec3_dot(m, disk + 3) / vec3_dot(d, disk + 3);
        vec3_add_scaled(m, -t, d, x);
        if (t >= 0.0f && t < least && vec3_length(x) <= disk[6]) {
            least = t;
            first = s;
        }
    }
    return first;
}

/* A ball's surfels, as the library gives them, against all of them one by one; they lie near the ball. */
TEST rays_meet_the_surfels_of_a_ball_exactly(void)
{
    springls_context *ctx = make_ball();
    ASSERT(ctx);
    const int count = springls_count(ctx);
    float *surfels = malloc((size_t)count * 7 * sizeof *surfels);
    struct volume_scene scene;
    int met = 0;
    ASSERT(surfels);
    ASSERT_EQ(SPRINGLS_OK, springls_extract_surfels(ctx, surfels));
    ASSERT(volume_scene_surfels(surfels, count, 1.0f, &scene));
    for (int i = 0; i < RAYS; ++i) {
        float origin[3], d[3], x[3];
        struct volume_hit hit;
        make_test_ray(i, 2.0f, origin, d);
        const int first = first_disk(surfels, count, origin, d);
        ASSERT_EQ(first >= 0, volume_raycast(&scene, origin, d, &hit));
        ASSERT_EQ(first, hit.element);
        if (hit.element >= 0) {
            const float *surfel = surfels + 7 * hit.element;
            vec3_add_scaled(origin, hit.distance, d, x);
            vec3_sub(x, surfel, x);
            ASSERT_IN_RANGE(0.0f, vec3_dot(x, surfel + 3), 1e-4f); /* in its plane, within its radius */
            ASSERT(vec3_length(x) <= surfel[6] + 1e-4f);
            vec3_add_scaled(origin, hit.distance, d, x);
            vec3_sub(x, center, x);
            ASSERT_IN_RANGE(ball_radius, vec3_length(x), 0.5f);
            ++met;
        }
    }
    ASSERT(met > RAYS / 2);
    volume_scene_free(&scene);
    free(surfels);
    springls_destroy(ctx);
    PASS();
}

/* Nothing to meet, and elements that are no numbers. */
TEST scenes_without_elements_are_met_nowhere(void)
{
    static const float origin[3] = {0.0f, 0.0f, 9.0f}, down[3] = {0.0f, 0.0f, -1.0f};
    const float broken[9] = {0.0f, 0.0f, NAN, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f};
    const float distant[18] = {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f,
                               1e9f, 1e9f, 1e9f, 1e9f, 1e9f, 1e9f, 1e9f, 1e9f, 1e9f};
    struct volume_scene scene;
    struct volume_hit hit;
    if (volume_scene_capsules(broken, 1, 0.1f, 1.0f, &scene)) {
        ASSERT_FALSE(volume_raycast(&scene, origin, down, &hit));
        volume_scene_free(&scene);
    }
    ASSERT_FALSE(volume_scene_capsules(distant, 2, 0.1f, 1.0f, &scene));
    ASSERT_FALSE(volume_raycast(&scene, origin, down, &hit));
    PASS();
}

/* A picture of each kind shows a ball in the middle and nothing in the corners. */
TEST pictures_show_the_ball(void)
{
    enum { SIZE = 24 };
    springls_context *ctx = make_ball();
    ASSERT(ctx);
    const int count = springls_count(ctx);
    float *surfels = malloc((size_t)count * 7 * sizeof *surfels);
    struct volume_scene scene;
    ASSERT(surfels);
    ASSERT_EQ(SPRINGLS_OK, springls_extract_surfels(ctx, surfels));
    ASSERT(volume_scene_surfels(surfels, count, 1.0f, &scene));
    const struct raycast_camera camera = {{16.0f, 16.5f, 80.0f}, {16.0f, 16.5f, 15.5f}, {0.0f, 1.0f, 0.0f}, 0.0f, 24.0f};
    for (int k = 0; k < 2; ++k) {
        struct image picture;
        ASSERT(volume_picture(ctx, k ? &scene : NULL, 1.0f, &camera, SIZE, SIZE, &picture));
        ASSERT(picture.rgb[0] > 0.999f);
        ASSERT(picture.rgb[3 * (SIZE * SIZE / 2 + SIZE / 2)] < 0.95f);
        ASSERT(picture.rgb[3 * (SIZE * SIZE / 2 + SIZE / 2)] > 0.3f);
        image_free(&picture);
    }
    volume_scene_free(&scene);
    free(surfels);
    springls_destroy(ctx);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(a_capsule_is_met_at_its_face_edge_and_corner);
    RUN_TEST(rays_meet_the_capsules_of_a_ball_exactly);
    RUN_TEST(rays_meet_the_surfels_of_a_ball_exactly);
    RUN_TEST(scenes_without_elements_are_met_nowhere);
    RUN_TEST(pictures_show_the_ball);
    GREATEST_MAIN_END();
}

#endif
