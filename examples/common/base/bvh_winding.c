#include "base/bvh_winding.h"

#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Adds the directed area and the center, weighted by `weight`, of a part of a node. */
static void add(struct bvh_dipole *sum, const float area[3], const float center[3], float weight)
{
    for (int k = 0; k < 3; ++k) {
        sum->area[k] += area[k];
        sum->center[k] += weight * center[k];
    }
    sum->radius += weight; /* the sum of weights, until all parts are added */
}

static void add_triangle(struct bvh_dipole *sum, const float *c)
{
    float ab[3], ac[3], area[3], center[3];
    vec3_sub(c + 3, c, ab);
    vec3_sub(c + 6, c, ac);
    vec3_cross(ab, ac, area);
    for (int k = 0; k < 3; ++k) {
        area[k] *= 0.5f;
        center[k] = (c[k] + c[3 + k] + c[6 + k]) / 3.0f;
    }
    add(sum, area, center, vec3_length(area));
}

/* Ends a sum: the center becomes one, and the radius that of a ball about it around the node's box. */
static void finish(struct bvh_dipole *d, const struct bvh_node *node)
{
    float corner[3];
    for (int k = 0; k < 3; ++k) {
        d->center[k] = d->radius > 0.0f ? d->center[k] / d->radius : node->lo[k];
        corner[k] = fmaxf(d->center[k] - node->lo[k], node->hi[k] - d->center[k]);
    }
    d->radius = vec3_length(corner);
}

bool bvh_winding_make(const struct bvh *bvh, struct bvh_winding *winding)
{
    winding->bvh = bvh;
    winding->dipoles = calloc((size_t)bvh->node_count + 1, sizeof *winding->dipoles);
    float *weights = calloc((size_t)bvh->node_count + 1, sizeof *weights);
    if (!winding->dipoles || !weights) {
        free(winding->dipoles);
        free(weights);
        winding->dipoles = NULL;
        return false;
    }
    for (uint32_t n = bvh->node_count; n-- > 0;) { /* children come after their parents */
        const struct bvh_node *node = &bvh->nodes[n];
        struct bvh_dipole *d = &winding->dipoles[n];
        for (uint32_t i = 0; i < (node->count ? node->count : 2); ++i) {
            if (node->count) {
                add_triangle(d, bvh->corners + 9 * (size_t)(node->first + i));
            } else {
                const struct bvh_dipole *child = &winding->dipoles[node->first + i];
                add(d, child->area, child->center, weights[node->first + i]);
            }
        }
        weights[n] = d->radius;
        finish(d, node);
    }
    free(weights);
    return true;
}

void bvh_winding_free(struct bvh_winding *winding)
{
    free(winding->dipoles);
    memset(winding, 0, sizeof *winding);
}

/* Returns the solid angle of a triangle seen from p (Van Oosterom and Strackee 1983). */
static double solid_angle(const float *c, const float p[3])
{
    double q[3][3], length[3];
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) {
            q[i][k] = (double)c[3 * i + k] - (double)p[k];
        }
        length[i] = sqrt(q[i][0] * q[i][0] + q[i][1] * q[i][1] + q[i][2] * q[i][2]);
    }
    const double volume = q[0][0] * (q[1][1] * q[2][2] - q[1][2] * q[2][1]) + q[0][1] * (q[1][2] * q[2][0] - q[1][0] * q[2][2])
                          + q[0][2] * (q[1][0] * q[2][1] - q[1][1] * q[2][0]);
    double base = length[0] * length[1] * length[2];
    for (int i = 0; i < 3; ++i) {
        const double *a = q[i], *b = q[(i + 1) % 3];
        base += (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) * length[(i + 2) % 3];
    }
    return 2.0 * atan2(volume, base);
}

double bvh_winding_at(const struct bvh_winding *winding, const float point[3])
{
    const float accuracy = 2.5f; /* radii from which a node is one directed area */
    uint32_t stack[BVH_STACK_SIZE];
    double sum = 0.0;
    int top = 0;
    if (winding->bvh->node_count) {
        stack[top++] = 0;
    }
    while (top) {
        const uint32_t n = stack[--top];
        const struct bvh_node *node = &winding->bvh->nodes[n];
        const struct bvh_dipole *d = &winding->dipoles[n];
        float to[3];
        vec3_sub(d->center, point, to);
        const float length = vec3_length(to);
        if (length > accuracy * d->radius) {
            sum += (double)(vec3_dot(d->area, to) / (length * length * length));
        } else if (node->count) {
            for (uint32_t i = 0; i < node->count; ++i) {
                sum += solid_angle(winding->bvh->corners + 9 * (size_t)(node->first + i), point);
            }
        } else {
            stack[top++] = node->first;
            stack[top++] = node->first + 1;
        }
    }
    return sum * 0.07957747154594767; /* 1 / 4 pi */
}
