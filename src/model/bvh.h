/* bvh.h - a bounding volume hierarchy over triangles: closest point, nearest ray hit, generalised winding number.
   Built by median splits along the longest axis of the triangles' centroids, ties broken by index: the tree depends on the
   triangles alone, and it is never deeper than log2(count). All queries are iterative and answer the same whatever was
   known before. Scratch buffer 7 is the builder's. */
#ifndef SPRINGLS__MODEL_BVH_H
#define SPRINGLS__MODEL_BVH_H

#include "../../kernels_embed/language/winding.h"
#include "../runtime/arrays.h"
#include "../runtime/memory.h"

enum { SPRINGLS__BVH_LEAF = 4, SPRINGLS__BVH_STACK = 64, SPRINGLS__BVH_SCRATCH = 7 };

/* triangle is -1 when nothing was found. t is the parameter along the ray, for ray queries only. */
typedef struct springls__surface_hit { int triangle; float t; springls__tri_hit hit; } springls__surface_hit;

typedef struct springls__bvh_item { float center[3]; int triangle; } springls__bvh_item;

SPRINGLS__FN springls__tri springls__surface_triangle(const springls__surface *surface, int triangle)
{
    springls__tri t;
    t.a = surface->points[3 * triangle];
    t.b = surface->points[3 * triangle + 1];
    t.c = surface->points[3 * triangle + 2];
    return t;
}

SPRINGLS__FN void springls__surface_free(springls_context *ctx, springls__surface *surface)
{
    springls__buffer_free(ctx, &surface->points_memory);
    springls__buffer_free(ctx, &surface->order_memory);
    springls__buffer_free(ctx, &surface->nodes_memory);
    springls__buffer_free(ctx, &surface->dipoles_memory);
    springls__buffer_free(ctx, &surface->source_memory);
    memset(surface, 0, sizeof *surface);
}

/* No triangles: keeps memory. */
SPRINGLS__FN void springls__surface_forget(springls__surface *surface)
{
    surface->count = surface->given = surface->node_count = 0;
    surface->dipoles = NULL;
    surface->source = NULL;
}

SPRINGLS__FN int springls__bvh_before(springls__bvh_item a, springls__bvh_item b, int axis)
{
    if (a.center[axis] != b.center[axis]) return a.center[axis] < b.center[axis];
    return a.triangle < b.triangle;
}

/* Moves the items so that item `middle` is the one that a full sort would put there, smaller ones before it. */
SPRINGLS__FN void springls__bvh_select(springls__bvh_item *items, int low, int high, int middle, int axis)
{
    while (low < high) {
        springls__bvh_item a = items[low], b = items[low + (high - low) / 2], c = items[high], pivot, t;
        int i = low, j = high;
        if (springls__bvh_before(b, a, axis)) { t = a; a = b; b = t; }
        pivot = springls__bvh_before(c, a, axis) ? a : springls__bvh_before(c, b, axis) ? c : b;
        while (i <= j) {
            while (springls__bvh_before(items[i], pivot, axis)) i++;
            while (springls__bvh_before(pivot, items[j], axis)) j--;
            if (i <= j) {
                t = items[i];
                items[i++] = items[j];
                items[j--] = t;
            }
        }
        if (middle <= j) high = j;
        else if (middle >= i) low = i;
        else return;
    }
}

/* The axis along which the centroids of items [first, first+count) spread most. */
SPRINGLS__FN int springls__bvh_axis(const springls__bvh_item *items, int first, int count)
{
    float lower[3], upper[3];
    int i, k, axis = 0;
    for (k = 0; k < 3; k++) lower[k] = upper[k] = items[first].center[k];
    for (i = first + 1; i < first + count; i++)
        for (k = 0; k < 3; k++) {
            lower[k] = springls__min(lower[k], items[i].center[k]);
            upper[k] = springls__max(upper[k], items[i].center[k]);
        }
    for (k = 1; k < 3; k++)
        if (upper[k] - lower[k] > upper[axis] - lower[axis]) axis = k;
    return axis;
}

SPRINGLS__FN void springls__bvh_split(springls__surface *surface, springls__bvh_item *items)
{
    int stack[SPRINGLS__BVH_STACK], top = 0;
    surface->nodes[0].first = 0;
    surface->nodes[0].count = surface->count;
    surface->node_count = 1;
    stack[top++] = 0;
    while (top) {
        springls__bvh_node *node = &surface->nodes[stack[--top]], *child = &surface->nodes[surface->node_count];
        int first = node->first, count = node->count, half = count / 2;
        if (count <= SPRINGLS__BVH_LEAF) continue;
        springls__bvh_select(items, first, first + count - 1, first + half, springls__bvh_axis(items, first, count));
        node->first = surface->node_count;
        node->count = 0;
        child[0].first = first;
        child[0].count = half;
        child[1].first = first + half;
        child[1].count = count - half;
        stack[top++] = surface->node_count + 1;
        stack[top++] = surface->node_count;
        surface->node_count += 2;
    }
}

SPRINGLS__FN void springls__bvh_bound(springls__surface *surface)
{
    int n, i, k;
    for (n = surface->node_count - 1; n >= 0; n--) {
        springls__bvh_node *node = &surface->nodes[n];
        for (k = 0; k < 3; k++) { node->lower[k] = FLT_MAX; node->upper[k] = -FLT_MAX; }
        if (!node->count) {
            const springls__bvh_node *child = &surface->nodes[node->first];
            for (k = 0; k < 3; k++) {
                node->lower[k] = springls__min(child[0].lower[k], child[1].lower[k]);
                node->upper[k] = springls__max(child[0].upper[k], child[1].upper[k]);
            }
            continue;
        }
        for (i = 0; i < 3 * node->count; i++) {
            springls__v3 p = surface->points[3 * surface->order[node->first + i / 3] + i % 3];
            node->lower[0] = springls__min(node->lower[0], p.x); node->upper[0] = springls__max(node->upper[0], p.x);
            node->lower[1] = springls__min(node->lower[1], p.y); node->upper[1] = springls__max(node->upper[1], p.y);
            node->lower[2] = springls__min(node->lower[2], p.z); node->upper[2] = springls__max(node->upper[2], p.z);
        }
    }
    surface->magnitude = 0.0f;
    for (k = 0; k < 3; k++) {
        surface->magnitude = springls__max(surface->magnitude, springls__fabs(surface->nodes[0].lower[k]));
        surface->magnitude = springls__max(surface->magnitude, springls__fabs(surface->nodes[0].upper[k]));
    }
}

/* Memory for n triangles; the first `keep` and their nodes stay. */
SPRINGLS__FN springls_status springls__surface_room(springls_context *ctx, springls__surface *surface, size_t n, size_t keep)
{
    size_t nodes = keep ? (size_t)surface->node_count * sizeof(springls__bvh_node) : 0;
    springls_status status = springls__buffer_grow(ctx, &surface->points_memory, 3 * n, sizeof(springls__v3),
                                                   3 * keep * sizeof(springls__v3));
    if (status == SPRINGLS_OK) status = springls__buffer_grow(ctx, &surface->order_memory, n, sizeof(int), keep * sizeof(int));
    if (status == SPRINGLS_OK) status = springls__buffer_grow(ctx, &surface->nodes_memory, n, sizeof(springls__bvh_node), nodes);
    surface->points = (springls__v3 *)surface->points_memory.data;
    surface->order = (int *)surface->order_memory.data;
    surface->nodes = (springls__bvh_node *)surface->nodes_memory.data;
    return status;
}

/* Makes room for count triangles; the caller writes surface->points (3 a triangle), then calls springls__surface_finish.
   On failure the surface is empty and can be freed. */
SPRINGLS__FN springls_status springls__surface_reserve(springls_context *ctx, springls__surface *surface, int count)
{
    size_t n = count > 0 ? (size_t)count : 1;
    springls__surface_forget(surface);
    return springls__surface_room(ctx, surface, n, 0);
}

SPRINGLS__FN springls_status springls__surface_finish(springls_context *ctx, springls__surface *surface, int count)
{
    springls__bvh_item *items;
    void *memory;
    int i;
    if (count <= 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__scratch(ctx, SPRINGLS__BVH_SCRATCH, (size_t)count, sizeof *items, &memory));
    items = (springls__bvh_item *)memory;
    for (i = 0; i < count; i++) {
        const springls__v3 *p = surface->points + 3 * i;
        items[i].center[0] = p[0].x + p[1].x + p[2].x;
        items[i].center[1] = p[0].y + p[1].y + p[2].y;
        items[i].center[2] = p[0].z + p[1].z + p[2].z;
        items[i].triangle = i;
    }
    surface->count = surface->given = count;
    springls__bvh_split(surface, items);
    for (i = 0; i < count; i++) surface->order[i] = items[i].triangle;
    springls__bvh_bound(surface);
    return SPRINGLS_OK;
}

/* The triangles of springls, which must be finite. */
SPRINGLS__FN springls_status springls__surface_build(springls_context *ctx, springls__surface *surface,
                                                     const springls__springl *s, int count)
{
    int i, m;
    SPRINGLS__TRY(springls__surface_reserve(ctx, surface, count));
    for (i = 0; i < count; i++)
        for (m = 0; m < 3; m++) surface->points[3 * i + m] = s[i].q[m];
    return springls__surface_finish(ctx, surface, count);
}

/* ---- closest point ---- */

SPRINGLS__FN float springls__bvh_box_distance2(const springls__bvh_node *node, springls__v3 x)
{
    float dx = springls__max(springls__max(node->lower[0] - x.x, x.x - node->upper[0]), 0.0f);
    float dy = springls__max(springls__max(node->lower[1] - x.y, x.y - node->upper[1]), 0.0f);
    float dz = springls__max(springls__max(node->lower[2] - x.z, x.z - node->upper[2]), 0.0f);
    return dx * dx + dy * dy + dz * dz;
}

/* To the bounds of one triangle. */
SPRINGLS__FN float springls__bvh_triangle_distance2(const springls__v3 *p, springls__v3 x)
{
    float dx = springls__max(springls__max(springls__min(springls__min(p[0].x, p[1].x), p[2].x) - x.x,
                                           x.x - springls__max(springls__max(p[0].x, p[1].x), p[2].x)), 0.0f);
    float dy = springls__max(springls__max(springls__min(springls__min(p[0].y, p[1].y), p[2].y) - x.y,
                                           x.y - springls__max(springls__max(p[0].y, p[1].y), p[2].y)), 0.0f);
    float dz = springls__max(springls__max(springls__min(springls__min(p[0].z, p[1].z), p[2].z) - x.z,
                                           x.z - springls__max(springls__max(p[0].z, p[1].z), p[2].z)), 0.0f);
    return dx * dx + dy * dy + dz * dz;
}

SPRINGLS__FN float springls__max_coordinate(springls__v3 x)
{
    return springls__max(springls__max(springls__fabs(x.x), springls__fabs(x.y)), springls__fabs(x.z));
}

/* The triangle closest to x, the lowest index among equals, if it is not further than max_distance. `guess` is a triangle
   that is probably close, or -1: it saves time and cannot change the answer, because boxes are only left out when they are
   further than the best so far by more than all rounding errors. */
SPRINGLS__FN springls__surface_hit springls__surface_closest_from(const springls__surface *surface, springls__v3 x,
                                                                  float max_distance, int guess)
{
    struct { float d2; int node; } stack[SPRINGLS__BVH_STACK];
    springls__surface_hit best;
    float slack = 4e-6f * (surface->magnitude + springls__max_coordinate(x)), limit2;
    int top = 0, i;
    memset(&best, 0, sizeof best);
    best.triangle = -1;
    best.hit.d2 = max_distance < 1e18f ? max_distance * max_distance : FLT_MAX;
    limit2 = max_distance < 1e18f ? (max_distance + slack) * (max_distance + slack) : FLT_MAX;
    if (!surface->count) return best;
    if (guess >= 0) {
        springls__tri_hit h = springls__tri_closest(springls__surface_triangle(surface, guess), x);
        if (h.d2 <= best.hit.d2) {
            float d = springls__sqrt(h.d2) + slack;
            best.triangle = guess;
            best.hit = h;
            limit2 = d * d;
        }
    }
    stack[top].d2 = springls__bvh_box_distance2(&surface->nodes[0], x);
    stack[top++].node = 0;
    while (top) {
        const springls__bvh_node *node = &surface->nodes[stack[--top].node];
        if (stack[top].d2 > limit2) continue;
        while (!node->count) { /* down to a leaf by the nearer child */
            const springls__bvh_node *child = &surface->nodes[node->first];
            float d0 = springls__bvh_box_distance2(&child[0], x), d1 = springls__bvh_box_distance2(&child[1], x);
            int second = d0 <= d1; /* the one to be looked at later */
            if ((second ? d1 : d0) <= limit2) {
                stack[top].d2 = second ? d1 : d0;
                stack[top++].node = node->first + second;
            }
            node = &child[!second];
            if ((second ? d0 : d1) > limit2) break;
        }
        for (i = 0; i < node->count; i++) {
            int triangle = surface->order[node->first + i];
            springls__tri_hit h;
            if (springls__bvh_triangle_distance2(surface->points + 3 * triangle, x) > limit2) continue;
            h = springls__tri_closest(springls__surface_triangle(surface, triangle), x);
            if (h.d2 < best.hit.d2 || (h.d2 == best.hit.d2 && (best.triangle < 0 || triangle < best.triangle))) {
                float d = springls__sqrt(h.d2) + slack;
                best.triangle = triangle;
                best.hit = h;
                limit2 = d * d;
            }
        }
    }
    return best;
}

SPRINGLS__FN springls__surface_hit springls__surface_closest(const springls__surface *surface, springls__v3 x,
                                                             float max_distance)
{
    return springls__surface_closest_from(surface, x, max_distance, -1);
}

/* ---- all that are near ---- */

/* A walk over the triangles of all leaves whose box comes within r of x. */
typedef struct springls__near_walk {
    const springls__surface *surface;
    springls__v3 x;
    float r;
    int stack[SPRINGLS__BVH_STACK], top, next, end;
} springls__near_walk;

SPRINGLS__FN springls__near_walk springls__near_walk_begin(const springls__surface *surface, springls__v3 x, float r)
{
    springls__near_walk walk;
    walk.surface = surface;
    walk.x = x;
    walk.r = r;
    walk.top = walk.next = walk.end = 0;
    if (surface->count) walk.stack[walk.top++] = 0;
    return walk;
}

/* The next triangle, or -1 at the end. */
SPRINGLS__FN int springls__near_walk_next(springls__near_walk *walk)
{
    while (walk->next == walk->end) {
        const springls__bvh_node *node;
        if (!walk->top) return -1;
        node = &walk->surface->nodes[walk->stack[--walk->top]];
        if (springls__bvh_box_distance2(node, walk->x) > walk->r * walk->r) continue;
        if (node->count) {
            walk->next = node->first;
            walk->end = node->first + node->count;
        } else {
            walk->stack[walk->top++] = node->first + 1;
            walk->stack[walk->top++] = node->first;
        }
    }
    return walk->surface->order[walk->next++];
}

/* ---- rays ---- */

/* A ray in the frame where its direction is (0, 0, 1): shearing keeps shared edges shared bit by bit, so that a ray
   cannot slip between two triangles. */
typedef struct springls__ray {
    float origin[3], direction[3], inverse[3];
    int kx, ky, kz;
    float sx, sy, sz;
} springls__ray;

SPRINGLS__FN springls__ray springls__ray_make(springls__v3 origin, springls__v3 direction)
{
    springls__ray r;
    int k;
    r.origin[0] = origin.x; r.origin[1] = origin.y; r.origin[2] = origin.z;
    r.direction[0] = direction.x; r.direction[1] = direction.y; r.direction[2] = direction.z;
    for (k = 0; k < 3; k++) {
        float d = r.direction[k];
        r.inverse[k] = springls__fabs(d) > 1e-30f ? 1.0f / d : d < 0.0f ? -1e30f : 1e30f;
    }
    r.kz = 0;
    for (k = 1; k < 3; k++)
        if (springls__fabs(r.direction[k]) > springls__fabs(r.direction[r.kz])) r.kz = k;
    r.kx = (r.kz + 1) % 3;
    r.ky = (r.kz + 2) % 3;
    if (r.direction[r.kz] < 0.0f) { k = r.kx; r.kx = r.ky; r.ky = k; }
    r.sz = 1.0f / r.direction[r.kz];
    r.sx = r.direction[r.kx] * r.sz;
    r.sy = r.direction[r.ky] * r.sz;
    return r;
}

/* Does the ray enter the box before t_max? The box is widened by what rounding can do, so that no hit is missed. */
SPRINGLS__FN int springls__ray_box(const springls__ray *r, const springls__bvh_node *node, float slack, float t_max, float *t)
{
    float t_in = 0.0f, t_out = t_max;
    int k;
    for (k = 0; k < 3; k++) {
        float t0 = (node->lower[k] - slack - r->origin[k]) * r->inverse[k];
        float t1 = (node->upper[k] + slack - r->origin[k]) * r->inverse[k];
        if (t0 > t1) { float swap = t0; t0 = t1; t1 = swap; }
        t_in = springls__max(t_in, t0);
        t_out = springls__min(t_out, t1);
    }
    *t = t_in;
    return t_in <= t_out * 1.000002f;
}

/* Where the ray meets a triangle, from either side: t in [0, t_max], and the point by barycentric weights. */
SPRINGLS__FN int springls__ray_triangle(const springls__ray *r, springls__tri tri, float t_max, springls__surface_hit *out)
{
    double p[3][3], u, v, w, det, t;
    int m;
    for (m = 0; m < 3; m++) {
        springls__v3 q = m == 0 ? tri.a : m == 1 ? tri.b : tri.c;
        double d[3];
        d[0] = (double)q.x - (double)r->origin[0];
        d[1] = (double)q.y - (double)r->origin[1];
        d[2] = (double)q.z - (double)r->origin[2];
        p[m][0] = d[r->kx] - (double)r->sx * d[r->kz];
        p[m][1] = d[r->ky] - (double)r->sy * d[r->kz];
        p[m][2] = (double)r->sz * d[r->kz];
    }
    u = p[2][0] * p[1][1] - p[2][1] * p[1][0];
    v = p[0][0] * p[2][1] - p[0][1] * p[2][0];
    w = p[1][0] * p[0][1] - p[1][1] * p[0][0];
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) return 0;
    det = u + v + w;
    if (det == 0.0) return 0;
    t = (u * p[0][2] + v * p[1][2] + w * p[2][2]) / det;
    if (!(t >= 0.0 && t <= (double)t_max)) return 0;
    out->t = (float)t;
    out->hit.bary[0] = (float)(u / det);
    out->hit.bary[1] = (float)(v / det);
    out->hit.bary[2] = 1.0f - out->hit.bary[0] - out->hit.bary[1];
    out->hit.point = springls__v3_make(
        tri.a.x * out->hit.bary[0] + tri.b.x * out->hit.bary[1] + tri.c.x * out->hit.bary[2],
        tri.a.y * out->hit.bary[0] + tri.b.y * out->hit.bary[1] + tri.c.y * out->hit.bary[2],
        tri.a.z * out->hit.bary[0] + tri.b.z * out->hit.bary[1] + tri.c.z * out->hit.bary[2]);
    return 1;
}

/* The first triangle that the ray x + t direction meets with 0 <= t <= t_max, the lowest index among equals. The direction
   need not be a unit vector; a direction of no length meets nothing. */
SPRINGLS__FN springls__surface_hit springls__surface_ray(const springls__surface *surface, springls__v3 x,
                                                         springls__v3 direction, float t_max)
{
    struct { float t; int node; } stack[SPRINGLS__BVH_STACK];
    springls__surface_hit best, h;
    springls__ray r;
    float slack = 2e-6f * (surface->magnitude + springls__max_coordinate(x)), t;
    int top = 0, i;
    memset(&best, 0, sizeof best);
    best.triangle = -1;
    best.t = t_max;
    h = best;
    if (!surface->count || !(springls__max_coordinate(direction) > 1e-30f)) return best;
    r = springls__ray_make(x, direction);
    if (springls__ray_box(&r, &surface->nodes[0], slack, t_max, &t)) {
        stack[top].t = t;
        stack[top++].node = 0;
    }
    while (top) {
        const springls__bvh_node *node = &surface->nodes[stack[--top].node];
        if (stack[top].t > best.t * 1.000002f) continue;
        if (!node->count) {
            float t0 = 0.0f, t1 = 0.0f;
            int hit0 = springls__ray_box(&r, &surface->nodes[node->first], slack, best.t, &t0);
            int hit1 = springls__ray_box(&r, &surface->nodes[node->first + 1], slack, best.t, &t1);
            int nearer = hit1 && (!hit0 || t1 < t0); /* pushed last, popped first */
            if (hit0 && hit1) {
                stack[top].t = nearer ? t0 : t1;
                stack[top++].node = node->first + !nearer;
            }
            if (hit0 || hit1) {
                stack[top].t = nearer ? t1 : t0;
                stack[top++].node = node->first + nearer;
            }
            continue;
        }
        for (i = 0; i < node->count; i++) {
            int triangle = surface->order[node->first + i];
            if (!springls__ray_triangle(&r, springls__surface_triangle(surface, triangle), best.t, &h)) continue;
            if (h.t < best.t || best.triangle < 0 || triangle < best.triangle) {
                best = h;
                best.triangle = triangle;
            }
        }
    }
    return best;
}

/* ---- generalised winding number ---- */

/* Sums up the directed areas of the nodes, once a surface; needed before springls__surface_winding. */
SPRINGLS__FN springls_status springls__surface_make_dipoles(springls_context *ctx, springls__surface *surface)
{
    int n, i, k;
    if (surface->dipoles || !surface->count) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &surface->dipoles_memory, (size_t)surface->node_count, sizeof(springls__dipole), 0));
    surface->dipoles = (springls__dipole *)surface->dipoles_memory.data;
    for (n = surface->node_count - 1; n >= 0; n--) {
        const springls__bvh_node *node = &surface->nodes[n];
        springls__dipole *d = &surface->dipoles[n];
        springls__v3 extent = springls__v3_make(0.0f, 0.0f, 0.0f);
        float weight = 0.0f;
        int parts = node->count ? node->count : 2;
        memset(d, 0, sizeof *d);
        for (i = 0; i < parts; i++) {
            springls__v3 center, area;
            float w;
            if (node->count) {
                springls__tri t = springls__surface_triangle(surface, surface->order[node->first + i]);
                center = springls__tri_centroid(t);
                area = springls__scale(springls__tri_area2(t), 0.5f);
                w = springls__length(area);
            } else {
                center = surface->dipoles[node->first + i].center;
                area = surface->dipoles[node->first + i].area;
                w = surface->dipoles[node->first + i].weight;
            }
            d->area = springls__add(d->area, area);
            d->center = springls__mad(d->center, center, w);
            weight += w;
        }
        if (weight > 0.0f) d->center = springls__scale(d->center, 1.0f / weight);
        else d->center = springls__v3_make(node->lower[0], node->lower[1], node->lower[2]);
        d->weight = weight;
        for (k = 0; k < 3; k++) {
            float c = k == 0 ? d->center.x : k == 1 ? d->center.y : d->center.z;
            float e = springls__max(c - node->lower[k], node->upper[k] - c);
            if (k == 0) extent.x = e;
            else if (k == 1) extent.y = e;
            else extent.z = e;
        }
        d->radius2 = springls__length2(extent);
    }
    return SPRINGLS_OK;
}

/* How often the surface winds around x: 1 inside and 0 outside a closed surface, between them near the holes of an open one.
   A node further away than `accuracy` times its radius counts as one directed area. */
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
