/* packet.h - eight places close to each other go down a hierarchy together: their distances, and their winding numbers. What is far from
   one of them is far from all. */
#ifndef SPRINGLS__MODEL_PACKET_H
#define SPRINGLS__MODEL_PACKET_H

#include "closest_point.h"
#include "winding_number.h"

enum { SPRINGLS__PACKET = 8 };

/* Places, their bounds, the middle of these, and how far the corners are from it. */
typedef struct springls__packet {
    float x[SPRINGLS__PACKET], y[SPRINGLS__PACKET], z[SPRINGLS__PACKET];
    springls__bvh_node bounds;
    springls__v3 middle;
    float radius;
} springls__packet;

/* Finds the middle of the bounds. */
SPRINGLS__FN void springls__packet_center(springls__packet *packet)
{
    const springls__v3 lower = springls__v3_make(packet->bounds.lower[0], packet->bounds.lower[1], packet->bounds.lower[2]);
    const springls__v3 upper = springls__v3_make(packet->bounds.upper[0], packet->bounds.upper[1], packet->bounds.upper[2]);
    packet->middle = springls__lerp(lower, upper, 0.5f);
    packet->radius = 0.5f * springls__length(springls__sub(upper, lower));
}

/* Finds the bounds of the places of a packet. */
SPRINGLS__FN void springls__packet_bound(springls__packet *packet)
{
    springls__bvh_node *b = &packet->bounds;
    int i;
    b->lower[0] = b->upper[0] = packet->x[0];
    b->lower[1] = b->upper[1] = packet->y[0];
    b->lower[2] = b->upper[2] = packet->z[0];
    for (i = 1; i < SPRINGLS__PACKET; i++) {
        b->lower[0] = springls__min(b->lower[0], packet->x[i]); b->upper[0] = springls__max(b->upper[0], packet->x[i]);
        b->lower[1] = springls__min(b->lower[1], packet->y[i]); b->upper[1] = springls__max(b->upper[1], packet->y[i]);
        b->lower[2] = springls__min(b->lower[2], packet->z[i]); b->upper[2] = springls__max(b->upper[2], packet->z[i]);
    }
    springls__packet_center(packet);
}

SPRINGLS__VEC_MATHS springls__vec3 springls__packet_places(const springls__packet *packet, int first)
{
    return springls__vec_load_v3(packet->x + first, packet->y + first, packet->z + first);
}

/* ---- distances ---- */

/* A search for the closest triangles of a packet; limit2: the squared distance beyond which no box can hold one that is closer to any
   place. See springls__closest_search. */
typedef struct springls__packet_search {
    const springls__surface *surface;
    const springls__packet *packet;
    float slack, limit2, *d2;
    int triangle; /* the last that was closer to one of the places */
    struct { float d2; int node; } stack[SPRINGLS__BVH_STACK];
    int top;
} springls__packet_search;

/* Returns the squared distance between the bounds of a packet and a box. */
SPRINGLS__FN float springls__packet_apart2(const springls__packet *packet, const float lower[3], const float upper[3])
{
    const springls__bvh_node *b = &packet->bounds;
    const float dx = springls__max(springls__max(lower[0] - b->upper[0], b->lower[0] - upper[0]), 0.0f);
    const float dy = springls__max(springls__max(lower[1] - b->upper[1], b->lower[1] - upper[1]), 0.0f);
    const float dz = springls__max(springls__max(lower[2] - b->upper[2], b->lower[2] - upper[2]), 0.0f);
    return dx * dx + dy * dy + dz * dz;
}

/* Returns true if a triangle's box is further from place i than what has been found, by more than all rounding errors: without SIMD,
   where a place alone is worth it. (d + slack)^2 is at most 1.01 d^2 + 101 slack^2. */
SPRINGLS__FN bool springls__packet_passes(const springls__packet_search *search, int triangle, int i)
{
#if SPRINGLS__LANES == 1
    const springls__v3 x = springls__v3_make(search->packet->x[i], search->packet->y[i], search->packet->z[i]);
    return springls__bvh_triangle_distance2(search->surface->points + 3 * triangle, x)
           > 1.01f * search->d2[i] + 102.0f * search->slack * search->slack;
#else
    (void)search;
    (void)triangle;
    (void)i;
    return false;
#endif
}

/* Lowers the distances of a packet to those from a triangle. */
SPRINGLS__FN void springls__packet_try(springls__packet_search *search, int triangle)
{
    const springls__tri t = springls__surface_triangle(search->surface, triangle);
    bool closer = false;
    float most = 0.0f;
    int i;
    for (i = 0; i < SPRINGLS__PACKET; i += SPRINGLS__LANES) {
        springls__vec best, d2;
        if (springls__packet_passes(search, triangle, i)) continue;
        best = springls__vec_load(search->d2 + i);
        d2 = springls__vec_tri_closest2(t, springls__packet_places(search->packet, i));
        closer = closer || springls__vec_any(d2 < best);
        springls__vec_store(search->d2 + i, springls__vec_min(d2, best));
    }
    if (!closer) return;
    for (i = 0; i < SPRINGLS__PACKET; i++) most = springls__max(most, search->d2[i]);
    most = springls__sqrt(most) + search->slack;
    search->limit2 = most * most;
    search->triangle = triangle;
}

/* Lowers the distances of a packet to those from the triangles of a leaf that are near. */
SPRINGLS__FN void springls__packet_leaf(springls__packet_search *search, const springls__bvh_node *leaf)
{
    int i;
    for (i = 0; i < leaf->count; i++) {
        const int triangle = search->surface->order[leaf->first + i];
        const springls__v3 *p = search->surface->points + 3 * triangle;
        float lower[3], upper[3];
        lower[0] = springls__min(springls__min(p[0].x, p[1].x), p[2].x); upper[0] = springls__max(springls__max(p[0].x, p[1].x), p[2].x);
        lower[1] = springls__min(springls__min(p[0].y, p[1].y), p[2].y); upper[1] = springls__max(springls__max(p[0].y, p[1].y), p[2].y);
        lower[2] = springls__min(springls__min(p[0].z, p[1].z), p[2].z); upper[2] = springls__max(springls__max(p[0].z, p[1].z), p[2].z);
        if (springls__packet_apart2(search->packet, lower, upper) <= search->limit2) springls__packet_try(search, triangle);
    }
}

/* Goes down from a node to the leaf that is nearest; others wait on the stack. */
SPRINGLS__FN void springls__packet_descend(springls__packet_search *search, const springls__bvh_node *node)
{
    while (!node->count) {
        const springls__bvh_node *child = &search->surface->nodes[node->first];
        const float d0 = springls__packet_apart2(search->packet, child[0].lower, child[0].upper);
        const float d1 = springls__packet_apart2(search->packet, child[1].lower, child[1].upper);
        const int further = d0 <= d1;
        if ((further ? d0 : d1) > search->limit2) return;
        if ((further ? d1 : d0) <= search->limit2) {
            search->stack[search->top].d2 = further ? d1 : d0;
            search->stack[search->top++].node = node->first + further;
        }
        node = &child[!further];
    }
    springls__packet_leaf(search, node);
}

/* Finds the squared distances of a packet's places to a surface, reach^2 where it is further: the bits of
   springls__surface_closest_from. Returns a triangle that is near, or -1, which may be the next guess. */
SPRINGLS__FN int springls__packet_closest(const springls__surface *surface, const springls__packet *packet, float reach, int guess,
                                          float d2[SPRINGLS__PACKET])
{
    const springls__bvh_node *b = &packet->bounds;
    springls__packet_search search;
    int i;
    for (i = 0; i < SPRINGLS__PACKET; i++) d2[i] = reach * reach;
    if (!surface->count) return -1;
    search.surface = surface;
    search.packet = packet;
    search.slack = surface->magnitude;
    for (i = 0; i < 3; i++)
        search.slack = springls__max(search.slack, springls__max(springls__fabs(b->lower[i]), springls__fabs(b->upper[i])));
    search.slack *= 8e-6f;
    search.limit2 = (reach + search.slack) * (reach + search.slack);
    search.d2 = d2;
    search.triangle = -1;
    if (guess >= 0) springls__packet_try(&search, guess);
    search.stack[0].d2 = springls__packet_apart2(packet, surface->nodes[0].lower, surface->nodes[0].upper);
    search.stack[0].node = 0;
    search.top = 1;
    while (search.top) {
        search.top--;
        if (search.stack[search.top].d2 <= search.limit2)
            springls__packet_descend(&search, &surface->nodes[search.stack[search.top].node]);
    }
    return search.triangle;
}

/* ---- winding numbers ---- */

/* Adds the solid angle of a directed area under which each place sees it. */
SPRINGLS__FN void springls__packet_add_dipole(const springls__packet *packet, const springls__dipole *d, float sum[SPRINGLS__PACKET])
{
    int i;
    for (i = 0; i < SPRINGLS__PACKET; i += SPRINGLS__LANES) {
        const springls__vec3 to = springls__vec_sub(springls__vec_broadcast3(d->center), springls__packet_places(packet, i));
        const springls__vec d2 = springls__vec_length2(to);
        const springls__vec angle = springls__vec_dot(springls__vec_broadcast3(d->area), to) / (d2 * springls__vec_sqrt(d2));
        springls__vec_store(sum + i, springls__vec_load(sum + i) + angle);
    }
}

SPRINGLS__FN void springls__packet_add_triangle(const springls__packet *packet, springls__tri t, float sum[SPRINGLS__PACKET])
{
    int i;
    for (i = 0; i < SPRINGLS__PACKET; i += SPRINGLS__LANES)
        springls__vec_store(sum + i, springls__vec_load(sum + i) + springls__vec_solid_angle(t, springls__packet_places(packet, i)));
}

/* Returns whether a node is so far from all places within `radius` of a middle that it counts as one directed area. */
SPRINGLS__FN bool springls__dipole_is_far(const springls__dipole *d, float accuracy, springls__v3 middle, float radius)
{
    const float reach = accuracy * springls__sqrt(d->radius2) + 1.001f * radius + 1e-3f;
    return springls__length2(springls__sub(d->center, middle)) > reach * reach;
}

/* Adds a leaf: as one directed area, or triangle by triangle. */
SPRINGLS__FN void springls__packet_add_leaf(const springls__surface *surface, const springls__packet *packet, int leaf, float accuracy,
                                            float sum[SPRINGLS__PACKET])
{
    const springls__bvh_node *node = &surface->nodes[leaf];
    int i;
    if (springls__dipole_is_far(&surface->dipoles[leaf], accuracy, packet->middle, packet->radius)) {
        springls__packet_add_dipole(packet, &surface->dipoles[leaf], sum);
        return;
    }
    for (i = 0; i < node->count; i++)
        springls__packet_add_triangle(packet, springls__surface_triangle(surface, surface->order[node->first + i]), sum);
}

/* Returns a packet with the bounds of several; its places are those of the first. */
SPRINGLS__FN springls__packet springls__packets_bound(const springls__packet *packets, int count)
{
    springls__packet all = packets[0];
    int p, k;
    for (p = 1; p < count; p++)
        for (k = 0; k < 3; k++) {
            all.bounds.lower[k] = springls__min(all.bounds.lower[k], packets[p].bounds.lower[k]);
            all.bounds.upper[k] = springls__max(all.bounds.upper[k], packets[p].bounds.upper[k]);
        }
    springls__packet_center(&all);
    return all;
}

/* Computes how often the surface winds around each place of packets near each other: springls__surface_winding, where a node counts as one
   directed area only if it is so far from all of them, or is a leaf so far from all places of a packet. */
SPRINGLS__FN void springls__packets_winding(const springls__surface *surface, const springls__packet *packets, int count, float accuracy,
                                            float (*winding)[SPRINGLS__PACKET])
{
    const springls__packet all = springls__packets_bound(packets, count);
    int stack[SPRINGLS__BVH_STACK], top = 0, i, p;
    memset(winding, 0, (size_t)count * sizeof *winding);
    if (surface->count) stack[top++] = 0;
    while (top) {
        const int n = stack[--top];
        const springls__bvh_node *node = &surface->nodes[n];
        if (springls__dipole_is_far(&surface->dipoles[n], accuracy, all.middle, all.radius)) {
            for (p = 0; p < count; p++) springls__packet_add_dipole(&packets[p], &surface->dipoles[n], winding[p]);
        } else if (!node->count) {
            stack[top++] = node->first + 1;
            stack[top++] = node->first;
        } else {
            for (p = 0; p < count; p++) springls__packet_add_leaf(surface, &packets[p], n, accuracy, winding[p]);
        }
    }
    for (p = 0; p < count; p++)
        for (i = 0; i < SPRINGLS__PACKET; i++) winding[p][i] *= 0.0795774715f; /* 1 / 4 pi */
}

#endif
