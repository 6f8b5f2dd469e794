/* shapes.h - ready-made implicit functions for springls_set_implicit: exact signed distances, negative inside.
   The one exception is the inside of merged spheres near a point that three of them share: there it is a lower bound. */
#ifndef SPRINGLS__INPUT_SHAPES_H
#define SPRINGLS__INPUT_SHAPES_H

#include "../model/transform.h"

SPRINGLS_API void springls_implicit_sphere(void *sphere, const float *points, int count, float *out)
{
    const springls_sphere *s = (const springls_sphere *)sphere;
    int i;
    for (i = 0; i < count; i++)
        out[i] = springls__length(springls__sub(springls__load3(points + 3 * i), springls__load3(s->center))) - s->radius;
}

SPRINGLS_API void springls_implicit_box(void *box, const float *points, int count, float *out)
{
    const springls_box *b = (const springls_box *)box;
    int i, k;
    for (i = 0; i < count; i++) {
        float beyond[3], inside = -FLT_MAX;
        for (k = 0; k < 3; k++) {
            float d = springls__fabs(points[3 * i + k] - b->center[k]) - b->half[k];
            inside = springls__max(inside, d);
            beyond[k] = springls__max(d, 0.0f);
        }
        out[i] = inside <= 0.0f ? inside : springls__length(springls__load3(beyond));
    }
}

/* The axis need not be a unit vector; a zero axis is z. */
SPRINGLS_API void springls_implicit_torus(void *torus, const float *points, int count, float *out)
{
    const springls_torus *t = (const springls_torus *)torus;
    springls__v3 axis = springls__normalize(springls__load3(t->axis));
    int i;
    if (!(springls__length2(axis) > 0.0f)) axis = springls__v3_make(0.0f, 0.0f, 1.0f);
    for (i = 0; i < count; i++) {
        springls__v3 x = springls__sub(springls__load3(points + 3 * i), springls__load3(t->center));
        float height = springls__dot(x, axis);
        float ring = springls__length(springls__mad(x, axis, -height)) - t->major;
        out[i] = springls__sqrt(ring * ring + height * height) - t->minor;
    }
}

/* Is x deeper than eps inside a sphere other than i and j? */
SPRINGLS__FN int springls__in_other_sphere(const springls_metasphere *m, springls__v3 x, int i, int j, float eps)
{
    int k;
    for (k = 0; k < m->count; k++)
        if (k != i && k != j
            && springls__length(springls__sub(x, springls__load3(m->spheres[k].center))) < m->spheres[k].radius - eps) return 1;
    return 0;
}

/* Distance from x, inside the union, to its surface: the nearest bare place of a sphere or of a circle where two meet. */
SPRINGLS__FN float springls__metasphere_depth(const springls_metasphere *m, springls__v3 x, float bound)
{
    float best = FLT_MAX;
    int i, j;
    for (i = 0; i < m->count; i++) {
        const springls_sphere *s = &m->spheres[i];
        springls__v3 c = springls__load3(s->center), away = springls__sub(x, c), place;
        float r = springls__length(away), depth = s->radius - r, eps = 1e-6f * s->radius;
        if (depth < 0.0f || depth >= best) continue;
        place = r > 0.0f ? springls__mad(c, away, s->radius / r) : springls__v3_make(c.x + s->radius, c.y, c.z);
        if (!springls__in_other_sphere(m, place, i, i, eps)) best = depth;
    }
    for (i = 0; i < m->count; i++) {
        springls__v3 ci = springls__load3(m->spheres[i].center);
        float ri = m->spheres[i].radius;
        for (j = i + 1; j < m->count; j++) {
            springls__v3 axis = springls__sub(springls__load3(m->spheres[j].center), ci), to = springls__sub(x, ci), place;
            float rj = m->spheres[j].radius, d2 = springls__length2(axis), d, at, r2, height, ring, distance;
            if (!(d2 > 0.0f)) continue;
            d = springls__sqrt(d2);
            at = 0.5f * (d2 + ri * ri - rj * rj) / d; /* the circle's plane along the axis from ci */
            r2 = ri * ri - at * at;
            if (r2 <= 0.0f) continue;
            axis = springls__scale(axis, 1.0f / d);
            height = springls__dot(to, axis);
            to = springls__mad(to, axis, -height); /* from the axis to x */
            ring = springls__length(to);
            distance = springls__sqrt((ring - springls__sqrt(r2)) * (ring - springls__sqrt(r2)) + (height - at) * (height - at));
            if (distance >= best) continue;
            if (ring > 0.0f) {
                place = springls__mad(springls__mad(ci, axis, at), to, springls__sqrt(r2) / ring);
                if (springls__in_other_sphere(m, place, i, j, 1e-6f * ri)) continue;
            }
            best = distance;
        }
    }
    return best < FLT_MAX ? best : bound;
}

SPRINGLS_API void springls_implicit_metasphere(void *metasphere, const float *points, int count, float *out)
{
    const springls_metasphere *m = (const springls_metasphere *)metasphere;
    int i, k;
    for (i = 0; i < count; i++) {
        springls__v3 x = springls__load3(points + 3 * i);
        float nearest = FLT_MAX;
        for (k = 0; k < m->count; k++)
            nearest = springls__min(nearest, springls__length(springls__sub(x, springls__load3(m->spheres[k].center)))
                                                 - m->spheres[k].radius);
        out[i] = nearest < 0.0f ? -springls__metasphere_depth(m, x, -nearest) : nearest;
    }
}

/* The boundary of the notched sphere has three kinds of faces (sphere, two walls, roof), which meet in lines and arcs: the
   least distance over all of them, each where it is part of the boundary. x is relative to the centre, mirrored into
   x, z >= 0; half is half the slot's width, roof its upper end. A slot that misses a face, or cuts the sphere in two, has
   pieces without points, and they drop out by their own conditions. */
SPRINGLS__FN float springls__notched_sphere_distance(springls__v3 x, float radius, float half, float roof)
{
    float r2 = radius * radius, wall2 = r2 - half * half, roof2 = r2 - roof * roof, corner2 = wall2 - roof * roof;
    float r = springls__length(x), best = FLT_MAX, u, v, d, scale;
    scale = r > 0.0f ? radius / r : 0.0f; /* sphere; at its centre every direction is as good: take +y */
    if (r > 0.0f ? x.x * scale >= half || x.y * scale >= roof : radius >= roof) best = springls__fabs(r - radius);
    if (wall2 > 0.0f) {
        u = springls__fabs(x.x - half);
        d = springls__sqrt(x.y * x.y + x.z * x.z);
        if (x.y <= roof && d * d <= wall2) best = springls__min(best, u); /* wall */
        v = d > 0.0f ? x.y * springls__sqrt(wall2) / d : -springls__sqrt(wall2); /* arc between wall and sphere */
        if (v <= roof) best = springls__min(best, springls__sqrt(u * u + (d - springls__sqrt(wall2)) * (d - springls__sqrt(wall2))));
    }
    if (roof2 > 0.0f) {
        u = springls__fabs(x.y - roof);
        d = springls__sqrt(x.x * x.x + x.z * x.z);
        if (x.x <= half && d * d <= roof2) best = springls__min(best, u); /* roof */
        v = d > 0.0f ? x.x * springls__sqrt(roof2) / d : 0.0f; /* arc between roof and sphere */
        if (v <= half) best = springls__min(best, springls__sqrt(u * u + (d - springls__sqrt(roof2)) * (d - springls__sqrt(roof2))));
    }
    if (corner2 >= 0.0f) { /* line between wall and roof, with the corners at its ends */
        float past = springls__max(x.z - springls__sqrt(corner2), 0.0f);
        best = springls__min(best, springls__sqrt((x.x - half) * (x.x - half) + (x.y - roof) * (x.y - roof) + past * past));
    }
    return best;
}

/* Zalesak's body: the slot is |x - cx| < width/2, from below the sphere up to cy - radius + depth, through all z. */
SPRINGLS_API void springls_implicit_notched_sphere(void *notched_sphere, const float *points, int count, float *out)
{
    const springls_notched_sphere *n = (const springls_notched_sphere *)notched_sphere;
    float half = 0.5f * n->slot_width, roof = n->slot_depth - n->radius;
    int i;
    for (i = 0; i < count; i++) {
        springls__v3 x = springls__sub(springls__load3(points + 3 * i), springls__load3(n->center));
        float distance, r = springls__length(x);
        int inside;
        x.x = springls__fabs(x.x);
        x.z = springls__fabs(x.z);
        inside = r < n->radius && !(x.x < half && x.y < roof);
        if (half <= 0.0f || n->slot_depth <= 0.0f) {
            out[i] = r - n->radius;
            continue;
        }
        distance = springls__notched_sphere_distance(x, n->radius, half, roof);
        out[i] = inside ? -distance : distance;
    }
}

#endif
