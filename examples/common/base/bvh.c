#include "base/bvh.h"

#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

enum { LEAF_SIZE = 4, BINS = 12, MAX_DEPTH = 80 };

struct box {
    float lo[3], hi[3];
};

struct builder {
    struct bvh *bvh;
    struct box *boxes; /* one a triangle, in input order of `corners` below */
    float *corners;
    uint32_t *order;
};

static struct box box_empty(void)
{
    const struct box box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    return box;
}

/* Grows a box; comparisons are inlined, which fminf with its care for NaN is not. */
static void box_add(struct box *box, const float lo[3], const float hi[3])
{
    for (int i = 0; i < 3; ++i) {
        box->lo[i] = lo[i] < box->lo[i] ? lo[i] : box->lo[i];
        box->hi[i] = hi[i] > box->hi[i] ? hi[i] : box->hi[i];
    }
}

static float box_area(const struct box *box)
{
    const float x = box->hi[0] - box->lo[0], y = box->hi[1] - box->lo[1], z = box->hi[2] - box->lo[2];
    return x >= 0.0f ? x * y + y * z + z * x : 0.0f;
}

static float box_center(const struct box *box, int axis) { return 0.5f * box->lo[axis] + 0.5f * box->hi[axis]; }

static int bin_of(const struct box *box, int axis, float lo, float scale)
{
    const int bin = (int)((box_center(box, axis) - lo) * scale);
    return bin < 0 ? 0 : bin >= BINS ? BINS - 1 : bin;
}

/* Splits order[first .. first+count) by the surface area heuristic over equal bins. Returns the size of the left part after
 * moving it to the front; 0 when no split pays. */
static uint32_t split(struct builder *builder, uint32_t first, uint32_t count, const struct box *centers, int depth)
{
    uint32_t *order = builder->order + first;
    float best_cost = INFINITY, best_lo = 0.0f, best_scale = 0.0f;
    int best_axis = -1, best_bin = 0;
    for (int axis = 0; axis < 3 && depth < MAX_DEPTH; ++axis) {
        struct box bins[BINS];
        uint32_t counts[BINS] = {0};
        float right_area[BINS];
        const float extent = centers->hi[axis] - centers->lo[axis];
        const float scale = (float)BINS / extent;
        if (!(extent > 0.0f) || !isfinite(scale)) {
            continue;
        }
        for (int b = 0; b < BINS; ++b) {
            bins[b] = box_empty();
        }
        for (uint32_t i = 0; i < count; ++i) {
            const struct box *box = &builder->boxes[order[i]];
            const int b = bin_of(box, axis, centers->lo[axis], scale);
            ++counts[b];
            box_add(&bins[b], box->lo, box->hi);
        }
        struct box sum = box_empty();
        for (int b = BINS - 1; b > 0; --b) {
            box_add(&sum, bins[b].lo, bins[b].hi);
            right_area[b] = box_area(&sum);
        }
        sum = box_empty();
        uint32_t left_count = 0;
        for (int b = 1; b < BINS; ++b) {
            box_add(&sum, bins[b - 1].lo, bins[b - 1].hi);
            left_count += counts[b - 1];
            const float cost = box_area(&sum) * (float)left_count + right_area[b] * (float)(count - left_count);
            if (left_count > 0 && left_count < count && cost < best_cost) {
                best_cost = cost;
                best_axis = axis;
                best_bin = b;
                best_lo = centers->lo[axis];
                best_scale = scale;
            }
        }
    }
    if (best_axis < 0) {
        return 0;
    }
    uint32_t left = 0;
    for (uint32_t i = 0; i < count; ++i) {
        if (bin_of(&builder->boxes[order[i]], best_axis, best_lo, best_scale) < best_bin) {
            const uint32_t swap = order[i];
            order[i] = order[left];
            order[left++] = swap;
        }
    }
    return left;
}

static void build_node(struct builder *builder, uint32_t node_index, uint32_t first, uint32_t count, int depth)
{
    struct bvh_node *node = &builder->bvh->nodes[node_index];
    struct box bounds = box_empty(), centers = box_empty();
    for (uint32_t i = first; i < first + count; ++i) {
        const struct box *box = &builder->boxes[builder->order[i]];
        const float center[3] = {box_center(box, 0), box_center(box, 1), box_center(box, 2)};
        box_add(&bounds, box->lo, box->hi);
        box_add(&centers, center, center);
    }
    memcpy(node->lo, bounds.lo, sizeof node->lo);
    memcpy(node->hi, bounds.hi, sizeof node->hi);
    uint32_t left = 0;
    if (count > LEAF_SIZE) {
        left = split(builder, first, count, &centers, depth);
        if (left == 0) {
            left = count / 2; /* all centers coincide, or the tree is too deep: halve by count */
        }
    }
    if (left == 0) {
        node->first = first;
        node->count = count;
        return;
    }
    const uint32_t child = builder->bvh->node_count;
    builder->bvh->node_count += 2;
    node->first = child;
    node->count = 0;
    build_node(builder, child, first, left, depth + 1);
    build_node(builder, child + 1, first + left, count - left, depth + 1);
}

bool bvh_build(struct bvh *bvh, const float *positions, const uint32_t *indices, size_t triangle_count)
{
    struct builder builder;
    memset(bvh, 0, sizeof *bvh);
    memset(&builder, 0, sizeof builder);
    if (triangle_count == 0 || triangle_count > UINT32_MAX / 4) {
        return false;
    }
    builder.bvh = bvh;
    builder.boxes = malloc(triangle_count * sizeof *builder.boxes);
    builder.order = malloc(triangle_count * sizeof *builder.order);
    builder.corners = malloc(triangle_count * 9 * sizeof *builder.corners);
    bvh->nodes = malloc(2 * triangle_count * sizeof *bvh->nodes);
    bvh->corners = malloc(triangle_count * 9 * sizeof *bvh->corners);
    bvh->triangles = malloc(triangle_count * sizeof *bvh->triangles);
    uint32_t count = 0;
    if (builder.boxes && builder.order && builder.corners && bvh->nodes && bvh->corners && bvh->triangles) {
        for (size_t t = 0; t < triangle_count; ++t) {
            float *c = builder.corners + 9 * t;
            bool finite = true;
            builder.boxes[t] = box_empty();
            for (size_t k = 0; k < 3; ++k) {
                const size_t vertex = indices ? indices[3 * t + k] : 3 * t + k;
                memcpy(c + 3 * k, positions + 3 * vertex, 3 * sizeof *c);
                finite = finite && isfinite(c[3 * k]) && isfinite(c[3 * k + 1]) && isfinite(c[3 * k + 2]);
                box_add(&builder.boxes[t], c + 3 * k, c + 3 * k);
            }
            if (finite) {
                builder.order[count++] = (uint32_t)t;
            }
        }
    }
    if (count > 0) {
        bvh->triangle_count = count;
        bvh->node_count = 1;
        build_node(&builder, 0, 0, count, 0);
        for (uint32_t i = 0; i < count; ++i) {
            bvh->triangles[i] = builder.order[i];
            memcpy(bvh->corners + 9 * (size_t)i, builder.corners + 9 * (size_t)builder.order[i], 9 * sizeof(float));
        }
    }
    free(builder.boxes);
    free(builder.order);
    free(builder.corners);
    if (count == 0) {
        bvh_free(bvh);
    }
    return count > 0;
}

void bvh_free(struct bvh *bvh)
{
    free(bvh->nodes);
    free(bvh->corners);
    free(bvh->triangles);
    memset(bvh, 0, sizeof *bvh);
}

struct ray {
    float origin[3], direction[3], inverse[3];
};

/* Returns the entry distance of the box, or infinity. The comparisons let a NaN pass (0 * inf on a slab's face). */
static float enter_box(const struct bvh_node *node, const struct ray *ray, float t_min, float t_max)
{
    for (int i = 0; i < 3; ++i) {
        const float a = (node->lo[i] - ray->origin[i]) * ray->inverse[i];
        const float b = (node->hi[i] - ray->origin[i]) * ray->inverse[i];
        const float enter = a < b ? a : b, leave = (a < b ? b : a) * 1.0000004f;
        t_min = enter > t_min ? enter : t_min;
        t_max = leave < t_max ? leave : t_max;
    }
    return t_min <= t_max ? t_min : INFINITY;
}

/* Tests a ray against a triangle (Moeller and Trumbore), with a small tolerance so that rays do not slip through shared edges. */
bool bvh_hit_triangle(const float *c, const float origin[3], const float direction[3], float t_min, float t_max,
                      struct bvh_hit *hit)
{
    const float slack = 1e-6f;
    float e1[3], e2[3], p[3], q[3], s[3];
    vec3_sub(c + 3, c, e1);
    vec3_sub(c + 6, c, e2);
    vec3_cross(direction, e2, p);
    const float determinant = vec3_dot(e1, p);
    if (determinant == 0.0f) {
        return false;
    }
    const float inverse = 1.0f / determinant;
    vec3_sub(origin, c, s);
    const float u = vec3_dot(s, p) * inverse;
    if (!(u >= -slack && u <= 1.0f + slack)) {
        return false;
    }
    vec3_cross(s, e1, q);
    const float v = vec3_dot(direction, q) * inverse;
    const float t = vec3_dot(e2, q) * inverse;
    if (!(v >= -slack && u + v <= 1.0f + slack && t > t_min && t < t_max)) {
        return false;
    }
    hit->t = t;
    hit->u = u;
    hit->v = v;
    return true;
}

static bool traverse(const struct bvh *bvh, const float origin[3], const float direction[3], float t_min, float t_max,
                     bool any, struct bvh_hit *hit)
{
    struct ray ray;
    uint32_t stack[BVH_STACK_SIZE];
    float entry[BVH_STACK_SIZE];
    int top = 0;
    bool found = false;
    if (bvh->node_count == 0) {
        return false;
    }
    for (int i = 0; i < 3; ++i) {
        ray.origin[i] = origin[i];
        ray.direction[i] = direction[i];
        ray.inverse[i] = 1.0f / direction[i];
    }
    entry[0] = enter_box(&bvh->nodes[0], &ray, t_min, t_max);
    stack[top++] = 0;
    while (top > 0) {
        --top;
        if (!(entry[top] < t_max)) {
            continue;
        }
        const struct bvh_node *node = &bvh->nodes[stack[top]];
        if (node->count > 0) {
            for (uint32_t i = node->first; i < node->first + node->count; ++i) {
                if (bvh_hit_triangle(bvh->corners + 9 * (size_t)i, origin, direction, t_min, t_max, hit)) {
                    hit->triangle = bvh->triangles[i];
                    t_max = hit->t;
                    found = true;
                    if (any) {
                        return true;
                    }
                }
            }
            continue;
        }
        const float left = enter_box(&bvh->nodes[node->first], &ray, t_min, t_max);
        const float right = enter_box(&bvh->nodes[node->first + 1], &ray, t_min, t_max);
        const uint32_t far_side = left < right ? 1 : 0; /* the nearer child is pushed last, so visited first */
        for (uint32_t k = 0; k < 2; ++k) {
            const uint32_t side = k == 0 ? far_side : 1 - far_side;
            const float t = side ? right : left;
            if (t < t_max) {
                stack[top] = node->first + side;
                entry[top++] = t;
            }
        }
    }
    return found;
}

bool bvh_nearest_hit(const struct bvh *bvh, const float origin[3], const float direction[3], float t_min, float t_max,
                     struct bvh_hit *hit)
{
    return traverse(bvh, origin, direction, t_min, t_max, false, hit);
}

bool bvh_any_hit(const struct bvh *bvh, const float origin[3], const float direction[3], float t_min, float t_max)
{
    struct bvh_hit hit;
    return traverse(bvh, origin, direction, t_min, t_max, true, &hit);
}
