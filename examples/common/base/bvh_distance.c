/* bvh_distance.c - bvh_distance of bvh.h: the closest point of a set of triangles. */
#include "base/bvh.h"

#include "base/vec3.h"

#include <string.h>

static void closest_on_segment(const float p[3], const float a[3], const float b[3], float out[3])
{
    float ab[3], ap[3];
    vec3_sub(b, a, ab);
    vec3_sub(p, a, ap);
    const float length2 = vec3_dot(ab, ab);
    const float t = length2 > 0.0f ? vec3_dot(ap, ab) / length2 : 0.0f;
    vec3_add_scaled(a, t < 0.0f ? 0.0f : t > 1.0f ? 1.0f : t, ab, out);
}

static float distance_squared(const float a[3], const float b[3])
{
    float d[3];
    vec3_sub(a, b, d);
    return vec3_dot(d, d);
}

/* Returns the foot of the perpendicular if it lies in the triangle, else the nearest point of the three sides, which also
 * holds for slivers and degenerate triangles. */
static float closest_on_triangle(const float p[3], const float *c, float out[3])
{
    float ab[3], ac[3], ap[3], n[3], w[3];
    vec3_sub(c + 3, c, ab);
    vec3_sub(c + 6, c, ac);
    vec3_sub(p, c, ap);
    vec3_cross(ab, ac, n);
    const float n2 = vec3_dot(n, n);
    if (n2 > 0.0f) {
        vec3_cross(ap, ac, w);
        const float u = vec3_dot(w, n) / n2;
        vec3_cross(ab, ap, w);
        const float v = vec3_dot(w, n) / n2;
        if (u >= 0.0f && v >= 0.0f && u + v <= 1.0f) {
            for (int i = 0; i < 3; ++i) {
                out[i] = c[i] + u * ab[i] + v * ac[i];
            }
            return distance_squared(p, out);
        }
    }
    float best = INFINITY;
    for (int k = 0; k < 3; ++k) {
        float q[3];
        closest_on_segment(p, c + 3 * k, c + 3 * ((k + 1) % 3), q);
        const float d2 = distance_squared(p, q);
        if (d2 < best) {
            best = d2;
            memcpy(out, q, sizeof q);
        }
    }
    return best;
}

static float box_distance_squared(const struct bvh_node *node, const float p[3])
{
    float sum = 0.0f;
    for (int i = 0; i < 3; ++i) {
        const float d = fmaxf(fmaxf(node->lo[i] - p[i], p[i] - node->hi[i]), 0.0f);
        sum += d * d;
    }
    return sum;
}

float bvh_distance(const struct bvh *bvh, const float point[3], float closest[3], uint32_t *triangle)
{
    uint32_t stack[BVH_STACK_SIZE];
    float entry[BVH_STACK_SIZE];
    int top = 0;
    float best = INFINITY;
    if (bvh->node_count == 0) {
        return best;
    }
    stack[top] = 0;
    entry[top++] = box_distance_squared(&bvh->nodes[0], point);
    while (top > 0) {
        --top;
        if (!(entry[top] < best)) {
            continue;
        }
        const struct bvh_node *node = &bvh->nodes[stack[top]];
        if (node->count > 0) {
            for (uint32_t i = node->first; i < node->first + node->count; ++i) {
                float q[3];
                const float d2 = closest_on_triangle(point, bvh->corners + 9 * (size_t)i, q);
                if (d2 < best) {
                    best = d2;
                    if (closest) {
                        memcpy(closest, q, sizeof q);
                    }
                    if (triangle) {
                        *triangle = bvh->triangles[i];
                    }
                }
            }
            continue;
        }
        const float left = box_distance_squared(&bvh->nodes[node->first], point);
        const float right = box_distance_squared(&bvh->nodes[node->first + 1], point);
        const uint32_t far_side = left < right ? 1 : 0;
        for (uint32_t k = 0; k < 2; ++k) {
            const uint32_t side = k == 0 ? far_side : 1 - far_side;
            stack[top] = node->first + side;
            entry[top++] = side ? right : left;
        }
    }
    return sqrtf(best);
}
