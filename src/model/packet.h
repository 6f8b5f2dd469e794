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
    packet->middle = springls__v3_make(0.5f * (b->lower[0] + b->upper[0]), 0.5f * (b->lower[1] + b->upper[1]),
                                       0.5f * (b->lower[2] + b->upper[2]));
    packet->radius = 0.5f * springls__length(springls__v3_make(b->upper[0] - b->lower[0], b->upper[1] - b->lower[1],
                                                               b->upper[2] - b->lower[2]));
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

/* Lowers the distances of a packet to those from a triangle. */
SPRINGLS__FN void springls__packet_try(springls__packet_search *search, int triangle)
{
    const springls__tri t = springls__surface_triangle(search->surface, triangle);
    bool closer = false;
    float most = 0.0f;
    int i;
    for (i = 0; i < SPRINGLS__PACKET; i += SPRINGLS__LANES) {
        const springls__vec best = springls__vec_load(search->d2 + i);
        const springls__vec d2 = springls__vec_tri_closest2(t, springls__packet_places(search->packet, i));
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

/* Computes how often the surface winds around each place: springls__surface_winding, where a node counts as one directed area only if it
   is so far from all of them. */
SPRINGLS__FN void springls__packet_winding(const springls__surface *surface, const springls__packet *packet, float accuracy,
                                           float winding[SPRINGLS__PACKET])
{
    int stack[SPRINGLS__BVH_STACK], top = 0, i;
    memset(winding, 0, SPRINGLS__PACKET * sizeof *winding);
    if (!surface->count) return;
    stack[top++] = 0;
    while (top) {
        const int n = stack[--top];
        const springls__bvh_node *node = &surface->nodes[n];
        const springls__dipole *d = &surface->dipoles[n];
        const float reach = accuracy * springls__sqrt(d->radius2) + 1.001f * packet->radius + 1e-3f;
        if (springls__length2(springls__sub(d->center, packet->middle)) > reach * reach) springls__packet_add_dipole(packet, d, winding);
        else if (!node->count) {
            stack[top++] = node->first + 1;
            stack[top++] = node->first;
        } else {
            for (i = 0; i < node->count; i++)
                springls__packet_add_triangle(packet, springls__surface_triangle(surface, surface->order[node->first + i]), winding);
        }
    }
    for (i = 0; i < SPRINGLS__PACKET; i++) winding[i] *= 0.0795774715f; /* 1 / 4 pi */
}

#endif
