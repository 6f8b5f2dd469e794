/* shapes.h - computes the signed distances of simple shapes, for springls_set_implicit. They are exact, except inside of merged
   spheres near a point that three of them share: there the value is a lower bound. */
#ifndef SPRINGLS__INPUT_SHAPES_H
#define SPRINGLS__INPUT_SHAPES_H

#include "../model/transform.h"
#include "../runtime/finite.h"

/* Sets all distances to NaN if one of the floats of a shape is not finite, so that inputs refuse it: comparisons lose a NaN. */
SPRINGLS__FN void springls__spoil_unless_finite(const void *shape, size_t bytes, float *out, int count)
{
    const float *numbers = (const float *)shape;
    size_t k;
    int i;
    for (k = 0; k < bytes / sizeof *numbers; k++)
        for (i = 0; !springls__finite_float(numbers[k]) && i < count; i++) out[i] = springls__float_of_bits(0x7fc00000);
}

SPRINGLS_API void springls_implicit_sphere(void *sphere, const float *points, int count, float *out)
{
    const springls_sphere *s = (const springls_sphere *)sphere;
    int i;
    for (i = 0; i < count; i++)
        out[i] = springls__length(springls__sub(springls__load3(points + 3 * i), springls__load3(s->center))) - s->radius;
    springls__spoil_unless_finite(s, sizeof *s, out, count);
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
    springls__spoil_unless_finite(b, sizeof *b, out, count);
}

/* Accepts an axis of any length; a zero axis is z. */
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
    springls__spoil_unless_finite(t, sizeof *t, out, count);
}

/* Returns true when x is deeper than eps inside a sphere other than i and j. */
SPRINGLS__FN bool springls__in_other_sphere(const springls_metasphere *m, springls__v3 x, int i, int j, float eps)
{
    int k;
    for (k = 0; k < m->count; k++)
        if (k != i && k != j
            && springls__length(springls__sub(x, springls__load3(m->spheres[k].center))) < m->spheres[k].radius - eps) return true;
    return false;
}

/* Returns the distance from x to sphere i, or `best` when it is not smaller, x is outside, or the nearest place of the sphere
   lies inside another one. */
SPRINGLS__FN float springls__nearer_sphere(const springls_metasphere *m, springls__v3 x, int i, float best)
{
    const springls_sphere *s = &m->spheres[i];
    springls__v3 c = springls__load3(s->center), away = springls__sub(x, c), place;
    float r = springls__length(away), depth = s->radius - r, eps = 1e-6f * s->radius;
    if (depth < 0.0f || depth >= best) return best;
    place = r > 0.0f ? springls__mad(c, away, s->radius / r) : springls__v3_make(c.x + s->radius, c.y, c.z);
    return springls__in_other_sphere(m, place, i, i, eps) ? best : depth;
}

/* Returns the distance from x to the circle in which spheres i and j meet, or `best` when it is not smaller, there is no such
   circle, or its nearest place lies inside another sphere. */
SPRINGLS__FN float springls__nearer_circle(const springls_metasphere *m, springls__v3 x, int i, int j, float best)
{
    springls__v3 ci = springls__load3(m->spheres[i].center), to = springls__sub(x, ci);
    springls__v3 axis = springls__sub(springls__load3(m->spheres[j].center), ci), place;
    float ri = m->spheres[i].radius, rj = m->spheres[j].radius, d2 = springls__length2(axis);
    float d, plane, r2, height, ring, distance; /* plane: of the circle, along the axis from ci; r2: its squared radius */
    if (!(d2 > 0.0f)) return best;
    d = springls__sqrt(d2);
    plane = 0.5f * (d2 + ri * ri - rj * rj) / d;
    r2 = ri * ri - plane * plane;
    if (r2 <= 0.0f) return best;
    axis = springls__scale(axis, 1.0f / d);
    height = springls__dot(to, axis);
    to = springls__mad(to, axis, -height); /* from the axis to x */
    ring = springls__length(to);
    distance = springls__sqrt((ring - springls__sqrt(r2)) * (ring - springls__sqrt(r2)) + (height - plane) * (height - plane));
    if (distance >= best) return best;
    if (!(ring > 0.0f)) return distance;
    place = springls__mad(springls__mad(ci, axis, plane), to, springls__sqrt(r2) / ring);
    return springls__in_other_sphere(m, place, i, j, 1e-6f * ri) ? best : distance;
}

/* Returns the distance from x, inside the union, to its surface: to the nearest place of a sphere, or of a circle in which two
   meet, that no other sphere covers; `bound` when there is none. */
SPRINGLS__FN float springls__metasphere_depth(const springls_metasphere *m, springls__v3 x, float bound)
{
    float best = FLT_MAX;
    int i, j;
    for (i = 0; i < m->count; i++) best = springls__nearer_sphere(m, x, i, best);
    for (i = 0; i < m->count; i++)
        for (j = i + 1; j < m->count; j++) best = springls__nearer_circle(m, x, i, j, best);
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
    for (k = 0; k < m->count; k++) springls__spoil_unless_finite(&m->spheres[k], sizeof m->spheres[k], out, count);
}

/* Returns the smaller of `best` and the distances to a flat face of the notched sphere and to the arc in which it meets the
   sphere. The face lies in the plane a = a_face and is the part b <= b_end of a disk of squared radius disk2 > 0 around
   (b, z) = 0. */
SPRINGLS__FN float springls__notch_face_distance(float a, float b, float z, float a_face, float b_end, float disk2,
                                                 float b_center, float best)
{
    float height = springls__fabs(a - a_face), d = springls__sqrt(b * b + z * z), r = springls__sqrt(disk2);
    float b_arc = d > 0.0f ? b * r / d : b_center; /* of the nearest place on the arc */
    if (b <= b_end && d * d <= disk2) best = springls__min(best, height);
    if (b_arc <= b_end) best = springls__min(best, springls__sqrt(height * height + (d - r) * (d - r)));
    return best;
}

/* Returns the distance to the boundary of the notched sphere, the least over its faces (sphere, wall, roof), the arcs in which
   two of them meet, and the line between wall and roof. x: relative to the center, mirrored into x, z >= 0; half: half the
   slot's width; roof: its upper end. A face that the slot misses has no points, and its conditions fail. */
SPRINGLS__FN float springls__notched_sphere_distance(springls__v3 x, float radius, float half, float roof)
{
    float r2 = radius * radius, wall2 = r2 - half * half, roof2 = r2 - roof * roof, corner2 = wall2 - roof * roof;
    float r = springls__length(x), best = FLT_MAX, scale = r > 0.0f ? radius / r : 0.0f;
    bool on_sphere = r > 0.0f ? x.x * scale >= half || x.y * scale >= roof : radius >= roof; /* at the center: towards +y */
    if (on_sphere) best = springls__fabs(r - radius);
    if (wall2 > 0.0f)
        best = springls__notch_face_distance(x.x, x.y, x.z, half, roof, wall2, -springls__sqrt(wall2), best);
    if (roof2 > 0.0f) best = springls__notch_face_distance(x.y, x.x, x.z, roof, half, roof2, 0.0f, best);
    if (corner2 >= 0.0f) { /* line between wall and roof, with its ends */
        float past = springls__max(x.z - springls__sqrt(corner2), 0.0f);
        best = springls__min(best, springls__sqrt((x.x - half) * (x.x - half) + (x.y - roof) * (x.y - roof) + past * past));
    }
    return best;
}

/* Computes Zalesak's sphere: the slot is |x - cx| < width/2, y < cy - radius + depth, for all z. */
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
    springls__spoil_unless_finite(n, sizeof *n, out, count);
}

#endif
