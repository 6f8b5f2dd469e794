/* ray.h - finds the first point in which a ray meets a surface. */
#ifndef SPRINGLS__MODEL_RAY_H
#define SPRINGLS__MODEL_RAY_H

#include "bvh.h"

/* A ray from an origin, and the shear to a frame where its direction is (0, 0, 1): two triangles that share an
   edge compute the edge alike in this frame, to the bit: so a ray cannot slip between the triangles. */
typedef struct springls__ray_frame {
    double origin[3], sx, sy, sz;
    int kx, ky, kz;
} springls__ray_frame;

/* The direction must not be zero. */
SPRINGLS__FN springls__ray_frame springls__ray_frame_make(const double origin[3], const double direction[3])
{
    springls__ray_frame f;
    int k;
    f.kz = 0;
    for (k = 0; k < 3; k++) {
        f.origin[k] = origin[k];
        if (fabs(direction[k]) > fabs(direction[f.kz])) f.kz = k;
    }
    f.kx = (f.kz + 1) % 3;
    f.ky = (f.kz + 2) % 3;
    f.sz = 1.0 / direction[f.kz];
    f.sx = direction[f.kx] * f.sz;
    f.sy = direction[f.ky] * f.sz;
    return f;
}

/* Returns whether the ray meets a triangle, from either side, and where: t in [0, t_max], and weights of its corners. */
SPRINGLS__FN bool springls__ray_meets(const springls__ray_frame *f, springls__tri tri, double t_max, double *t, float weight[3])
{
    double p[3][3], u, v, w, det;
    int m;
    for (m = 0; m < 3; m++) {
        springls__v3 q = m == 0 ? tri.a : m == 1 ? tri.b : tri.c;
        double d[3];
        d[0] = (double)q.x - f->origin[0];
        d[1] = (double)q.y - f->origin[1];
        d[2] = (double)q.z - f->origin[2];
        p[m][0] = d[f->kx] - f->sx * d[f->kz];
        p[m][1] = d[f->ky] - f->sy * d[f->kz];
        p[m][2] = f->sz * d[f->kz];
    }
    u = p[2][0] * p[1][1] - p[2][1] * p[1][0];
    v = p[0][0] * p[2][1] - p[0][1] * p[2][0];
    w = p[1][0] * p[0][1] - p[1][1] * p[0][0];
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) return false;
    det = u + v + w;
    if (det == 0.0) return false;
    *t = (u * p[0][2] + v * p[1][2] + w * p[2][2]) / det;
    if (!(*t >= 0.0 && *t <= t_max)) return false;
    weight[0] = (float)(u / det);
    weight[1] = (float)(v / det);
    weight[2] = 1.0f - weight[0] - weight[1];
    return true;
}

/* ---- through a hierarchy ---- */

typedef struct springls__ray {
    springls__ray_frame frame;
    float origin[3], inverse[3];
} springls__ray;

SPRINGLS__FN springls__ray springls__ray_make(springls__v3 origin, springls__v3 direction)
{
    springls__ray r;
    double from[3], along[3];
    int k;
    r.origin[0] = origin.x; r.origin[1] = origin.y; r.origin[2] = origin.z;
    along[0] = (double)direction.x; along[1] = (double)direction.y; along[2] = (double)direction.z;
    for (k = 0; k < 3; k++) {
        float d = (float)along[k];
        from[k] = (double)r.origin[k];
        r.inverse[k] = springls__fabs(d) > 1e-30f ? 1.0f / d : d < 0.0f ? -1e30f : 1e30f;
    }
    r.frame = springls__ray_frame_make(from, along);
    return r;
}

/* Returns whether the ray enters a node's bounds before t_max, and where; the bounds are widened by the slack, so that no hit is
   missed by rounding. */
SPRINGLS__FN bool springls__ray_box(const springls__ray *r, const springls__bvh_node *node, float slack, float t_max, float *t)
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

/* Returns whether the ray meets a triangle within t_max, as floats compare, and where. So which of two that are equally far is found does
   not depend on which is tried first. */
SPRINGLS__FN bool springls__ray_triangle(const springls__ray *r, springls__tri tri, float t_max, springls__surface_hit *out)
{
    double t;
    float b[3];
    if (!springls__ray_meets(&r->frame, tri, DBL_MAX, &t, b) || (float)t > t_max) return false;
    out->t = (float)t;
    memcpy(out->hit.bary, b, sizeof b);
    out->hit.point = springls__tri_point(tri, b);
    return true;
}

/* A search for the first triangle that a ray meets, in [0, best.t]. */
typedef struct springls__ray_search {
    const springls__surface *surface;
    springls__ray ray;
    float slack;
    springls__surface_hit best;
    struct { float t; int node; } stack[SPRINGLS__BVH_STACK];
    int top;
} springls__ray_search;

/* Puts the children that the ray enters on the stack: the child that the ray enters first comes on top. */
SPRINGLS__FN void springls__ray_descend(springls__ray_search *search, const springls__bvh_node *node)
{
    const springls__bvh_node *child = &search->surface->nodes[node->first];
    float t0 = 0.0f, t1 = 0.0f;
    bool hit0 = springls__ray_box(&search->ray, &child[0], search->slack, search->best.t, &t0);
    bool hit1 = springls__ray_box(&search->ray, &child[1], search->slack, search->best.t, &t1);
    int nearer = hit1 && (!hit0 || t1 < t0);
    if (hit0 && hit1) {
        search->stack[search->top].t = nearer ? t0 : t1;
        search->stack[search->top++].node = node->first + !nearer;
    }
    if (hit0 || hit1) {
        search->stack[search->top].t = nearer ? t1 : t0;
        search->stack[search->top++].node = node->first + nearer;
    }
}

/* Takes the triangles of a leaf that the ray meets earlier than the best, or as early and of a lower index. */
SPRINGLS__FN void springls__ray_try_leaf(springls__ray_search *search, const springls__bvh_node *leaf)
{
    springls__surface_hit h = search->best;
    int i;
    for (i = 0; i < leaf->count; i++) {
        int triangle = search->surface->order[leaf->first + i];
        springls__tri t = springls__surface_triangle(search->surface, triangle);
        if (!springls__ray_triangle(&search->ray, t, search->best.t, &h)) continue;
        if (h.t < search->best.t || search->best.triangle < 0 || triangle < search->best.triangle) {
            search->best = h;
            search->best.triangle = triangle;
        }
    }
}

/* Returns the first point in which the ray x + t direction meets the surface with 0 <= t <= t_max, the lowest index among equals.
   The direction need not be a unit vector; one of no length meets nothing. */
SPRINGLS__FN springls__surface_hit springls__surface_ray(const springls__surface *surface, springls__v3 x,
                                                         springls__v3 direction, float t_max)
{
    springls__ray_search search;
    search.surface = surface;
    search.slack = 2e-6f * (surface->magnitude + springls__max_coordinate(x));
    memset(&search.best, 0, sizeof search.best);
    search.best.triangle = -1;
    search.best.t = t_max;
    if (!surface->count || !(springls__max_coordinate(direction) > 1e-30f)) return search.best;
    search.ray = springls__ray_make(x, direction);
    search.top = springls__ray_box(&search.ray, &surface->nodes[0], search.slack, t_max, &search.stack[0].t) ? 1 : 0;
    search.stack[0].node = 0;
    while (search.top) {
        const springls__bvh_node *node;
        search.top--;
        if (search.stack[search.top].t > search.best.t * 1.000002f) continue;
        node = &surface->nodes[search.stack[search.top].node];
        if (node->count) springls__ray_try_leaf(&search, node);
        else springls__ray_descend(&search, node);
    }
    return search.best;
}

#endif
