/* winding_number.h - computes the generalised winding number of a surface, by directed areas where it is far away. */
#ifndef SPRINGLS__MODEL_WINDING_NUMBER_H
#define SPRINGLS__MODEL_WINDING_NUMBER_H

#include "../../kernels_embed/language/winding.h"
#include "bvh.h"

/* Returns triangle i of a leaf, or child i of another node, as a directed area. */
SPRINGLS__FN springls__dipole springls__dipole_child(const springls__surface *surface, const springls__bvh_node *node, int i)
{
    springls__dipole d;
    springls__tri t;
    if (!node->count) return surface->dipoles[node->first + i];
    memset(&d, 0, sizeof d);
    t = springls__surface_triangle(surface, surface->order[node->first + i]);
    d.center = springls__tri_centroid(t);
    d.area = springls__scale(springls__tri_area2(t), 0.5f);
    d.weight = springls__length(d.area);
    return d;
}

/* Returns the squared distance from a center to the furthest corner of a node's bounds. */
SPRINGLS__FN float springls__dipole_radius2(const springls__bvh_node *node, springls__v3 center)
{
    return springls__length2(springls__v3_make(springls__max(center.x - node->lower[0], node->upper[0] - center.x),
                                               springls__max(center.y - node->lower[1], node->upper[1] - center.y),
                                               springls__max(center.z - node->lower[2], node->upper[2] - center.z)));
}

/* Sums up the directed areas of all nodes, once for each surface, before springls__surface_winding is called. Not for a surface
   with parts (bvh_join.h), where children can come before their parents. */
SPRINGLS__FN springls_status springls__surface_make_dipoles(springls_context *ctx, springls__surface *surface)
{
    int n, i;
    if (surface->dipoles || !surface->count) return SPRINGLS_OK;
    SPRINGLS_ASSERT(!surface->parts);
    SPRINGLS__TRY(springls__buffer_grow(ctx, &surface->dipoles_memory, (size_t)surface->node_count, sizeof(springls__dipole), 0));
    surface->dipoles = (springls__dipole *)surface->dipoles_memory.data;
    for (n = surface->node_count - 1; n >= 0; n--) { /* children first */
        const springls__bvh_node *node = &surface->nodes[n];
        springls__dipole *d = &surface->dipoles[n];
        memset(d, 0, sizeof *d);
        for (i = 0; i < (node->count ? node->count : 2); i++) {
            springls__dipole child = springls__dipole_child(surface, node, i);
            d->area = springls__add(d->area, child.area);
            d->center = springls__mad(d->center, child.center, child.weight);
            d->weight += child.weight;
        }
        if (d->weight > 0.0f) d->center = springls__scale(d->center, 1.0f / d->weight);
        else d->center = springls__v3_make(node->lower[0], node->lower[1], node->lower[2]);
        d->radius2 = springls__dipole_radius2(node, d->center);
    }
    return SPRINGLS_OK;
}

/* Returns how often the surface winds around x: 1 inside and 0 outside a closed surface, between them near the holes of an open
   one. A node further away than `accuracy` times its radius counts as one directed area. */
SPRINGLS__FN float springls__surface_winding(const springls__surface *surface, springls__v3 x, float accuracy)
{
    int stack[SPRINGLS__BVH_STACK], top = 0, i;
    double sum = 0.0;
    if (!surface->count) return 0.0f;
    stack[top++] = 0;
    while (top) {
        int n = stack[--top];
        const springls__bvh_node *node = &surface->nodes[n];
        const springls__dipole *d = &surface->dipoles[n];
        springls__v3 to = springls__sub(d->center, x);
        float d2 = springls__length2(to);
        if (d2 > accuracy * accuracy * d->radius2) {
            if (d2 > 0.0f) sum += (double)(springls__dot(d->area, to) / (d2 * springls__sqrt(d2)));
        } else if (!node->count) {
            stack[top++] = node->first + 1;
            stack[top++] = node->first;
        } else {
            for (i = 0; i < node->count; i++) {
                springls__tri t = springls__surface_triangle(surface, surface->order[node->first + i]);
                sum += (double)springls__solid_angle(t, x);
            }
        }
    }
    return (float)(sum * 0.07957747154594767); /* 1 / 4 pi */
}

#endif
