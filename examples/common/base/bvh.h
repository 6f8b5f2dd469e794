/* bvh.h - bounding volume hierarchy over triangles: nearest ray hit, any ray hit, closest point.
 *
 * Built from a mesh (indices) or a soup (no indices: corners 3t, 3t+1, 3t+2), whose corners it copies, so the input may be
 * freed. Queries are read-only and safe from any number of threads. */
#ifndef EXAMPLES_BASE_BVH_H
#define EXAMPLES_BASE_BVH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { BVH_STACK_SIZE = 128 }; /* depth that bvh_build allows, with a margin */

struct bvh_node {
    float lo[3], hi[3];
    uint32_t first; /* leaf: first triangle; inner: left child, the right one follows it */
    uint32_t count; /* 0 = inner */
};

struct bvh {
    struct bvh_node *nodes;
    float *corners;      /* 9 floats a triangle, in leaf order */
    uint32_t *triangles; /* leaf order -> triangle number */
    uint32_t node_count, triangle_count;
};

struct bvh_hit {
    float t;           /* ray parameter (distance when the direction has length 1) */
    float u, v;        /* barycentric weights of corners 1 and 2 */
    uint32_t triangle; /* number in the input */
};

/* Builds the tree without triangles that have a coordinate that is not finite. Returns false if none is left or memory is
 * short. */
bool bvh_build(struct bvh *bvh, const float *positions, const uint32_t *indices, size_t triangle_count);
void bvh_free(struct bvh *bvh);

bool bvh_nearest_hit(const struct bvh *bvh, const float origin[3], const float direction[3], float t_min, float t_max,
                     struct bvh_hit *hit);
bool bvh_any_hit(const struct bvh *bvh, const float origin[3], const float direction[3], float t_min, float t_max);

/* Tests a ray against one triangle (9 floats); sets all of the hit but the triangle's number. */
bool bvh_hit_triangle(const float *corners, const float origin[3], const float direction[3], float t_min, float t_max,
                      struct bvh_hit *hit);

/* Returns the distance from `point` to the nearest triangle, exact on faces, edges and corners; `closest` and `triangle` may
 * be NULL. */
float bvh_distance(const struct bvh *bvh, const float point[3], float closest[3], uint32_t *triangle);

#endif
