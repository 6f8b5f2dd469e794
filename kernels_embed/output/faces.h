/* faces.h - springl contouring: the section of the surface with each face between grid cells. The crossings on a face's border are
   joined by arcs that do not cross; an arc between two sides of a crease, or around the rim of a sheet, gets corners. Both cells
   beside a face see the same arcs: so the surface is closed. */
#ifndef SPRINGLS__KERNEL_OUTPUT_FACES_H
#define SPRINGLS__KERNEL_OUTPUT_FACES_H

#include "crossings.h"

#define SPRINGLS__FACE_CROSSINGS (4 * SPRINGLS__EDGE_CROSSINGS)
#define SPRINGLS__FACE_ARCS (SPRINGLS__FACE_CROSSINGS / 2)
#define SPRINGLS__SHARP_COSINE 0.8f /* of the normals at both ends of an arc: with less it gets a corner             */
#define SPRINGLS__RIM_COSINE (-0.7f) /* with less it goes around a rim                                               */
#define SPRINGLS__FACE_MARGIN (1.0f / 256.0f)
#define SPRINGLS__FACE_REACH 0.03f /* voxels beyond a face in which a corner is still its own */

/* Crossings of an edge, or arcs of a face: the number of the first, and how many. */
typedef struct springls__owned { int first, count; } springls__owned;

/* Returns how many the elements before element k of its row have. */
SPRINGLS__INNER int springls__before_in_row(SPRINGLS__GLOBAL const uint8_t *count, int k)
{
    int sum = 0, i;
    for (i = k & ~7; i < k; i++) sum += count[i];
    return sum;
}

/* Returns the crossings of the edge along an axis that begins at a node, which may be up to 8 beyond a brick's own. */
SPRINGLS__MATHS springls__owned springls__crossings_of_edge(const springls__contour *contour,
                                                            SPRINGLS__GLOBAL const springls__surface_brick *brick, const int at[3],
                                                            int axis)
{
    const int b = springls__axis_after(axis), c = springls__axis_after(b);
    const int line = 64 * axis + (at[b] & 7) + 8 * (at[c] & 7), edge = 8 * line + (at[axis] & 7);
    int node;
    const int other = springls__table_node(brick, at, &node);
    springls__owned owned = { 0, 0 };
    if (other < 0 || contour->brick[other].crossings[edge] == 0) return owned;
    owned.count = contour->brick[other].crossings[edge];
    owned.first = contour->brick[other].begin[SPRINGLS__OF_CROSSINGS][line]
                + springls__before_in_row(contour->brick[other].crossings, edge);
    return owned;
}

/* Returns the arcs of the face across an axis that begins at a node, which may be up to 8 beyond a brick's own. */
SPRINGLS__MATHS springls__owned springls__arcs_of_face(const springls__contour *contour,
                                                       SPRINGLS__GLOBAL const springls__surface_brick *brick, const int at[3], int axis)
{
    int node;
    const int other = springls__table_node(brick, at, &node), face = 512 * axis + node;
    springls__owned owned = { 0, 0 };
    if (other < 0 || contour->brick[other].arcs[face] == 0) return owned;
    owned.count = contour->brick[other].arcs[face];
    owned.first = contour->brick[other].begin[SPRINGLS__OF_ARCS][face >> 3] + springls__before_in_row(contour->brick[other].arcs, face);
    return owned;
}

/* Working memory of one brick. */
typedef struct springls__face_work {
    float cost[(SPRINGLS__FACE_CROSSINGS + 1) * (SPRINGLS__FACE_CROSSINGS + 1)];
    int cut[(SPRINGLS__FACE_CROSSINGS + 1) * (SPRINGLS__FACE_CROSSINGS + 1)];
    int list[SPRINGLS__FACE_CROSSINGS], kind[SPRINGLS__FACE_CROSSINGS], stack[2 * SPRINGLS__FACE_CROSSINGS];
    springls__arc arc[SPRINGLS__FACE_ARCS];
} springls__face_work;

/* A face across `axis`, that begins at node o; b and c: the axes along it. */
typedef struct springls__face { int axis, b, c, o[3]; } springls__face;

SPRINGLS__INNER springls__v3 springls__in_face(const springls__face *face, float b, float c)
{
    springls__v3 v = springls__with_along(springls__zero3(), face->axis, 0.0f);
    return springls__with_along(springls__with_along(v, face->b, b), face->c, c);
}

/* Returns the way along the section of a plane with a face, such that outside is on the left. */
SPRINGLS__INNER springls__v3 springls__face_tangent(const springls__face *face, springls__v3 n)
{
    return springls__in_face(face, springls__along(n, face->c), -springls__along(n, face->b));
}

SPRINGLS__INNER bool springls__is_in_face(const springls__face *face, springls__v3 x)
{
    const float e = SPRINGLS__FACE_MARGIN, b = springls__along(x, face->b) - (float)face->o[face->b];
    const float c = springls__along(x, face->c) - (float)face->o[face->c];
    return b > e && b < 1.0f - e && c > e && c < 1.0f - e;
}

SPRINGLS__INNER bool springls__is_supported(const springls__crossing *c) { return springls__length2(c->n) > 0.0f; }

/* ---- arcs ---- */

/* Lists the crossings on the border of a face, counter-clockwise as seen against the axis; kind: -1 enters the body there, 1 leaves.
   Returns how many. */
SPRINGLS__MATHS int springls__face_border(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                          const springls__face *face, const int of_node[3], springls__face_work *work)
{
    int side, k, n = 0;
    for (side = 0; side < 4; side++) {
        const int axis = side & 1 ? face->c : face->b;
        const bool back = side >= 2;
        springls__owned owned;
        int at[3];
        for (k = 0; k < 3; k++) at[k] = of_node[k];
        if (side == 1) at[face->b]++;
        if (side == 2) at[face->c]++;
        owned = springls__crossings_of_edge(contour, brick, at, axis);
        for (k = 0; k < owned.count; k++, n++) {
            const int id = owned.first + (back ? owned.count - 1 - k : k);
            work->list[n] = id;
            work->kind[n] = back ? -contour->crossing[id].side : contour->crossing[id].side;
        }
    }
    return n;
}

/* Returns what it costs to join crossing p, which enters, to q, which leaves: little where the way lies in the planes of both. */
SPRINGLS__MATHS float springls__pair_cost(const springls__face *face, const springls__crossing *p, const springls__crossing *q)
{
    const springls__v3 d = springls__sub(q->x, p->x);
    const float length = springls__length(d);
    const springls__v3 left = springls__scale(springls__in_face(face, -springls__along(d, face->c), springls__along(d, face->b)),
                                              1.0f / (length + 1e-9f));
    const bool one = springls__is_supported(p), other = springls__is_supported(q);
    float sum = 0.0f;
    if (one) sum += springls__fabs(springls__dot(p->n, d)) + 0.5f * springls__max(0.0f, -springls__dot(p->n, left));
    if (other) sum += springls__fabs(springls__dot(q->n, d)) + 0.5f * springls__max(0.0f, -springls__dot(q->n, left));
    return sum + (one && other ? 0.5f * (1.0f - springls__dot(p->n, q->n)) : 0.1f * length);
}

/* Joins crossings i and j of the border by an arc. */
SPRINGLS__INNER springls__arc springls__arc_between(const springls__face_work *work, int i, int j)
{
    springls__arc arc;
    arc.from = work->list[work->kind[i] < 0 ? i : j];
    arc.to = work->list[work->kind[i] < 0 ? j : i];
    arc.corners = 0;
    arc.corner[0] = arc.corner[1] = arc.rim = springls__zero3();
    return arc;
}

/* Joins the n crossings of the border by arcs that do not cross, the cheapest ones together. */
SPRINGLS__MATHS void springls__join_border(const springls__contour *contour, const springls__face *face, int n,
                                           springls__face_work *work)
{
    const int row = SPRINGLS__FACE_CROSSINGS + 1;
    int width, i, j, arcs = 0, top = 0;
    if (n == 2) {
        work->arc[0] = springls__arc_between(work, 0, 1);
        return;
    }
    for (i = 0; i <= n; i++) work->cost[row * i + i] = 0.0f;
    for (width = 2; width <= n; width += 2)
        for (i = 0; i + width <= n; i++) {
            float best = 1e30f;
            for (j = i + 1; j < i + width; j += 2) {
                springls__arc arc;
                springls__crossing p, q;
                float cost;
                if (work->kind[i] == work->kind[j]) continue;
                arc = springls__arc_between(work, i, j);
                p = contour->crossing[arc.from];
                q = contour->crossing[arc.to];
                cost = springls__pair_cost(face, &p, &q) + work->cost[row * (i + 1) + j] + work->cost[row * (j + 1) + i + width];
                if (cost >= best) continue;
                best = cost;
                work->cut[row * i + i + width] = j;
            }
            work->cost[row * i + i + width] = best;
        }
    work->stack[top++] = 0;
    work->stack[top++] = n;
    while (top > 0) {
        const int end = work->stack[--top], begin = work->stack[--top];
        if (begin >= end) continue;
        j = work->cut[row * begin + end];
        work->arc[arcs++] = springls__arc_between(work, begin, j);
        work->stack[top++] = begin + 1;
        work->stack[top++] = j;
        work->stack[top++] = j + 1;
        work->stack[top++] = end;
    }
}

/* ---- corners ---- */

/* An arc on its face: its ends, its directions there, and whether both ends lie on one edge of the face. */
typedef struct springls__arc_section {
    springls__crossing p, q;
    springls__v3 leaving, arriving; /* along the arc at p and q, in the planes of the surface */
    float cosine;
    int along_edge, across_edge;    /* both ends on one edge: its axis and the other one; else -1 */
} springls__arc_section;

SPRINGLS__MATHS springls__arc_section springls__section_of_arc(const springls__contour *contour, const springls__face *face,
                                                       const springls__arc *arc)
{
    springls__arc_section s;
    int k;
    s.p = contour->crossing[arc->from];
    s.q = contour->crossing[arc->to];
    s.leaving = springls__face_tangent(face, s.p.n);
    s.arriving = springls__face_tangent(face, s.q.n);
    s.cosine = springls__is_supported(&s.p) && springls__is_supported(&s.q) ? springls__dot(s.p.n, s.q.n) : 1.0f;
    s.along_edge = s.across_edge = -1;
    for (k = 0; k < 2; k++) {
        const int axis = k ? face->b : face->c, across = k ? face->c : face->b;
        const float at = springls__along(s.p.x, across);
        if (at != springls__along(s.q.x, across)) continue;
        if (at != (float)face->o[across] && at != (float)face->o[across] + 1.0f) continue;
        if (at != springls__floor(at)) continue;
        s.along_edge = axis;
        s.across_edge = across;
    }
    return s;
}

/* Returns the direction from the edge that both ends lie on into the face, 1 or -1 along its other axis. */
SPRINGLS__INNER float springls__into_face(const springls__face *face, const springls__arc_section *s)
{
    return springls__along(s->p.x, s->across_edge) == (float)face->o[s->across_edge] ? 1.0f : -1.0f;
}

/* Finds where the planes through p and q, with normals n and m, and a face meet; false: they are nearly parallel. */
SPRINGLS__MATHS bool springls__planes_meet(const springls__face *face, springls__v3 p, springls__v3 n, springls__v3 q,
                                           springls__v3 m, springls__v3 *x)
{
    const float nb = springls__along(n, face->b), nc = springls__along(n, face->c);
    const float mb = springls__along(m, face->b), mc = springls__along(m, face->c), det = nb * mc - nc * mb;
    const float ob = (float)face->o[face->b], oc = (float)face->o[face->c];
    const float dp = nb * (springls__along(p, face->b) - ob) + nc * (springls__along(p, face->c) - oc);
    const float dq = mb * (springls__along(q, face->b) - ob) + mc * (springls__along(q, face->c) - oc);
    if (springls__fabs(det) < 0.15f * springls__sqrt((nb * nb + nc * nc) * (mb * mb + mc * mc)) + 1e-6f) return false;
    *x = springls__in_face(face, ob + (dp * mc - nc * dq) / det, oc + (nb * dq - dp * mb) / det);
    *x = springls__with_along(*x, face->axis, (float)face->o[face->axis]);
    return true;
}

/* Moves a place that lies a little beyond the border of a face into it: of an edge along the grid the corners do. Returns whether it is in
   the face then. */
SPRINGLS__MATHS bool springls__bring_into_face(const springls__face *face, springls__v3 *x)
{
    const float e = 2.0f * SPRINGLS__FACE_MARGIN;
    int k;
    for (k = 0; k < 2; k++) {
        const int axis = k ? face->c : face->b;
        const float o = (float)face->o[axis], at = springls__along(*x, axis), in = springls__clamp(at, o + e, o + 1.0f - e);
        if (springls__fabs(in - at) > SPRINGLS__FACE_REACH) return false;
        *x = springls__with_along(*x, axis, in);
    }
    return true;
}

/* Finds the corner where the tangents at both ends meet; false: not between them in the face. */
SPRINGLS__MATHS bool springls__tangents_meet(const springls__face *face, const springls__arc_section *s, springls__v3 *x)
{
    return springls__planes_meet(face, s->p.x, s->p.n, s->q.x, s->q.n, x) && springls__bring_into_face(face, x)
        && springls__dot(springls__sub(*x, s->p.x), s->leaving) > 0.0f && springls__dot(springls__sub(s->q.x, *x), s->arriving) > 0.0f;
}

/* Returns the cosine of half the angle between the ways at both ends. */
SPRINGLS__INNER float springls__half_cosine(const springls__arc_section *s)
{
    const float both = springls__length(s->leaving) * springls__length(s->arriving) + 1e-9f;
    const float cosine = springls__clamp(springls__dot(s->leaving, s->arriving) / both, -1.0f, 1.0f);
    return springls__sqrt(0.5f * (1.0f + cosine));
}

/* Returns whether a corner at x is sharp: a springl there lies at an edge, or few springls have normals between the two. */
SPRINGLS__MATHS bool springls__is_sharp_corner(const springls__model *model, const springls__contour *contour,
                                               const springls__arc_section *s, springls__v3 x)
{
    const float between = 0.94f, share = 0.15f;
    const springls__v3 middle_normal = springls__normalize(springls__add(s->p.n, s->q.n));
    springls__cell_walk walk;
    float all = 0.0f, some = 0.0f;
    int i;
    if (s->p.springl >= 0 && springls__at_edge(model, s->p.springl)) return true;
    if (s->q.springl >= 0 && springls__at_edge(model, s->q.springl)) return true;
    walk = springls__cell_walk_near(model, x, 1.0f);
    while ((i = springls__cell_walk_next(model, &walk)) >= 0) {
        const springls__v3 n = contour->surfel[i].n;
        const float w = 1.0f - springls__length2(springls__sub(contour->surfel[i].p, x));
        const float cp = springls__dot(n, s->p.n), cq = springls__dot(n, s->q.n);
        if (w <= 0.0f || (cp < -0.3f && cq < -0.3f)) continue;
        all += w;
        if (cp < between && cq < between && springls__dot(n, middle_normal) > 0.0f) some += w;
    }
    return some < share * all;
}

/* Returns the corner itself where it is sharp, else the point of the arc of a circle about there: (1 - tan^2(theta/4)) / 2 of the way from
   the middle, which is c / (1 + c) for c = cos(theta/2). */
SPRINGLS__MATHS springls__v3 springls__rounded_corner(const springls__model *model, const springls__contour *contour,
                                                      const springls__arc_section *s, springls__v3 x)
{
    const springls__v3 middle = springls__lerp(s->p.x, s->q.x, 0.5f);
    const float c = springls__half_cosine(s);
    return springls__is_sharp_corner(model, contour, s, x) ? x : springls__lerp(middle, x, c / (1.0f + c));
}

/* What springls before the middle of an arc say about a rim: the plane of those that face forward, and how far others reach. */
typedef struct springls__rim { springls__v3 place, normal; float weight, reach; } springls__rim;

SPRINGLS__MATHS springls__rim springls__find_rim(const springls__model *model, const springls__contour *contour,
                                                 const springls__arc_section *s, springls__v3 middle, springls__v3 forward)
{
    const springls__v3 center = springls__mad(middle, forward, 0.4f);
    const float radius = 1.3f;
    springls__cell_walk walk = springls__cell_walk_near(model, center, radius);
    springls__rim rim;
    int i;
    rim.place = rim.normal = springls__zero3();
    rim.weight = rim.reach = 0.0f;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0) {
        const springls__v3 p = contour->surfel[i].p, n = contour->surfel[i].n, d = springls__sub(p, middle);
        const float ahead = springls__dot(d, forward), facing = springls__dot(n, forward);
        const float aside2 = springls__length2(springls__mad(d, forward, -ahead));
        if (springls__is_overlapped(model, i) || springls__length2(springls__sub(p, center)) > radius * radius) continue;
        if (aside2 > 1.0f || ahead < -0.6f || ahead > 1.4f) continue;
        if (facing > 0.5f && springls__dot(n, s->p.n) < 0.8f && springls__dot(n, s->q.n) < 0.8f) {
            const float w = (1.0f - aside2) * (1.0f - aside2) * facing;
            rim.weight += w;
            rim.place = springls__mad(rim.place, p, w);
            rim.normal = springls__mad(rim.normal, n, w);
        }
        if (aside2 < 0.36f && springls__dot(springls__sub(p, s->p.x), s->p.n) < 0.1f
            && springls__dot(springls__sub(p, s->q.x), s->q.n) < 0.1f) rim.reach = springls__max(rim.reach, ahead);
    }
    if (rim.weight <= 0.0f) return rim;
    rim.place = springls__scale(rim.place, 1.0f / rim.weight);
    rim.normal = springls__normalize(rim.normal);
    return rim;
}

/* Returns how far one can go from x in a direction within a face. */
SPRINGLS__MATHS float springls__room_in_face(const springls__face *face, springls__v3 x, springls__v3 direction)
{
    float room = 2.0f;
    int k;
    for (k = 0; k < 2; k++) {
        const int axis = k ? face->c : face->b;
        const float d = springls__along(direction, axis), at = springls__along(x, axis) - (float)face->o[axis];
        if (d > 1e-6f) room = springls__min(room, (1.0f - SPRINGLS__FACE_MARGIN - at) / d);
        if (d < -1e-6f) room = springls__min(room, (SPRINGLS__FACE_MARGIN - at) / d);
    }
    return room;
}

/* Gives an arc around a rim two corners, where the planes of its ends meet that of the rim through x; false: not in the face. */
SPRINGLS__MATHS bool springls__square_rim(const springls__face *face, const springls__arc_section *s, springls__v3 x, springls__v3 n,
                                          springls__arc *arc)
{
    const springls__v3 along = springls__face_tangent(face, n);
    springls__v3 one, two;
    if (!springls__planes_meet(face, s->p.x, s->p.n, x, n, &one) || !springls__planes_meet(face, s->q.x, s->q.n, x, n, &two)) return false;
    if (!springls__is_in_face(face, one) || !springls__is_in_face(face, two)) return false;
    if (springls__dot(springls__sub(one, s->p.x), s->leaving) <= 0.0f || springls__dot(springls__sub(s->q.x, two), s->arriving) <= 0.0f
        || springls__dot(springls__sub(two, one), along) <= 0.0f) return false;
    if (springls__length2(springls__sub(two, one)) <= 0.06f * 0.06f) return false;
    arc->corner[0] = one;
    arc->corner[1] = two;
    arc->rim = n;
    arc->corners = 2;
    return true;
}

/* Gives an arc between opposed sides its corners at the rim ahead. */
SPRINGLS__MATHS void springls__round_rim(const springls__model *model, const springls__contour *contour, const springls__face *face,
                                         const springls__arc_section *s, springls__arc *arc)
{
    const springls__v3 middle = springls__lerp(s->p.x, s->q.x, 0.5f);
    springls__v3 forward = springls__sub(springls__scale(s->leaving, 1.0f / (springls__length(s->leaving) + 1e-6f)),
                                         springls__scale(s->arriving, 1.0f / (springls__length(s->arriving) + 1e-6f)));
    springls__rim rim;
    float room, ahead;
    if (s->along_edge >= 0) {
        const springls__v3 in = springls__with_along(springls__zero3(), s->across_edge, springls__into_face(face, s));
        if (springls__length(forward) < 0.2f || springls__dot(forward, in) <= 0.05f) forward = in;
    }
    if (springls__length(forward) < 0.2f) return;
    forward = springls__normalize(forward);
    room = springls__room_in_face(face, middle, forward);
    if (room <= 0.0f) return;
    rim = springls__find_rim(model, contour, s, middle, forward);
    arc->corners = 1;
    if (rim.weight > 0.05f) {
        const float slope = springls__dot(rim.normal, forward);
        ahead = slope > 0.2f ? springls__dot(rim.normal, springls__sub(rim.place, middle)) / slope : -1.0f;
        if (ahead > 0.02f) {
            arc->corner[0] = springls__mad(middle, forward, springls__min(ahead, room));
            springls__square_rim(face, s, arc->corner[0], rim.normal, arc);
            return;
        }
    }
    ahead = springls__min(rim.reach, room);
    if (ahead < 0.02f) ahead = springls__min(0.02f, 0.5f * room);
    arc->corner[0] = springls__mad(middle, forward, ahead);
}

/* Gives an arc a corner as high in the face as `slope` times the distance of its ends, which lie on one edge. */
SPRINGLS__MATHS void springls__low_corner(const springls__face *face, const springls__arc_section *s, float height, springls__arc *arc)
{
    const springls__v3 x = springls__lerp(s->p.x, s->q.x, 0.5f);
    const float up = springls__max(height, 2.0f / 65536.0f) * springls__into_face(face, s);
    arc->corner[0] = springls__with_along(x, s->across_edge, springls__along(x, s->across_edge) + up);
    arc->corners = 1;
}

SPRINGLS__INNER float springls__ends_distance(const springls__arc_section *s)
{
    return springls__fabs(springls__along(s->p.x, s->along_edge) - springls__along(s->q.x, s->along_edge));
}

/* Takes the corners of an arc away, but for a low one where both ends lie on one edge. */
SPRINGLS__MATHS void springls__make_plain(const springls__face *face, const springls__arc_section *s, float slope, springls__arc *arc)
{
    arc->corners = 0;
    if (s->along_edge >= 0) springls__low_corner(face, s, slope * springls__ends_distance(s), arc);
}

/* Gives an arc its corners. */
SPRINGLS__MATHS void springls__find_corners(const springls__model *model, const springls__contour *contour,
                                            const springls__face *face, const springls__arc_section *s, springls__arc *arc)
{
    const bool rim = s->cosine < SPRINGLS__RIM_COSINE || s->along_edge >= 0;
    springls__v3 x;
    if (!rim && s->cosine > SPRINGLS__SHARP_COSINE) return;
    if (!(s->cosine < SPRINGLS__RIM_COSINE) && !(s->along_edge >= 0 && s->cosine >= 0.9f) && springls__tangents_meet(face, s, &x)) {
        arc->corner[0] = springls__rounded_corner(model, contour, s, x);
        arc->corners = 1;
        return;
    }
    if (!rim && s->cosine > 0.0f) return;
    if (s->along_edge >= 0 && s->cosine > 0.5f && springls__is_supported(&s->p) && springls__is_supported(&s->q)) {
        const float c = springls__half_cosine(s); /* a cap that comes over the edge: an arc, tan(theta/4) high */
        const float height = springls__sqrt(springls__max(1.0f - c, 0.0f) / (1.0f + c)) + 0.02f;
        springls__low_corner(face, s, springls__min(0.5f * springls__ends_distance(s) * height, 0.5f), arc);
        return;
    }
    springls__round_rim(model, contour, face, s, arc);
}

/* ---- arcs that cross ---- */

/* Returns twice the area of a triangle in a face, exactly, in units of 2^-32 voxel^2. */
SPRINGLS__MATHS int64_t springls__face_area(const springls__face *face, springls__v3 x, springls__v3 y, springls__v3 z)
{
    const float s = 65536.0f, ob = springls__along(x, face->b), oc = springls__along(x, face->c);
    const int64_t yb = (int64_t)((springls__along(y, face->b) - ob) * s), yc = (int64_t)((springls__along(y, face->c) - oc) * s);
    const int64_t zb = (int64_t)((springls__along(z, face->b) - ob) * s), zc = (int64_t)((springls__along(z, face->c) - oc) * s);
    return yb * zc - yc * zb;
}

SPRINGLS__INNER bool springls__opposite(int64_t a, int64_t b) { return (a <= 0 && b >= 0) || (a >= 0 && b <= 0); }

/* Returns point k of an arc: its ends and the corners between. */
SPRINGLS__INNER springls__v3 springls__arc_point(const springls__contour *contour, const springls__arc *arc, int k)
{
    if (k == 0) return contour->crossing[arc->from].x;
    return k <= arc->corners ? arc->corner[k - 1] : contour->crossing[arc->to].x;
}

/* Returns whether two arcs meet. */
SPRINGLS__MATHS bool springls__arcs_meet(const springls__contour *contour, const springls__face *face, const springls__arc *one,
                                         const springls__arc *two)
{
    int i, j;
    for (i = 0; i <= one->corners; i++)
        for (j = 0; j <= two->corners; j++) {
            const springls__v3 p = springls__arc_point(contour, one, i), q = springls__arc_point(contour, one, i + 1);
            const springls__v3 r = springls__arc_point(contour, two, j), s = springls__arc_point(contour, two, j + 1);
            if (springls__opposite(springls__face_area(face, p, q, r), springls__face_area(face, p, q, s))
                && springls__opposite(springls__face_area(face, r, s, p), springls__face_area(face, r, s, q))) return true;
        }
    return false;
}

/* Takes corners away from arcs that meet, until none do. */
SPRINGLS__MATHS void springls__part_arcs(const springls__contour *contour, const springls__face *face, int arcs,
                                         springls__face_work *work)
{
    float slope = 0.05f;
    int round, i, j;
    bool some = true;
    for (round = 0; round < 12 && some; round++) {
        some = false;
        for (i = 0; i < arcs; i++)
            for (j = i + 1; j < arcs; j++) {
                springls__arc_section one, two;
                if (!springls__arcs_meet(contour, face, &work->arc[i], &work->arc[j])) continue;
                some = true;
                one = springls__section_of_arc(contour, face, &work->arc[i]);
                two = springls__section_of_arc(contour, face, &work->arc[j]);
                springls__make_plain(face, &one, slope, &work->arc[i]);
                springls__make_plain(face, &two, slope, &work->arc[j]);
            }
        if (round > 1) slope *= 0.3f;
    }
}

/* ---- the kernels ---- */

/* Adds the crossings of the edge along an axis that begins at a node to the ends of arcs on the brick's own faces beside it. */
SPRINGLS__MATHS void springls__add_ends(const int at[3], int axis, int crossings, SPRINGLS__GLOBAL uint8_t *ends)
{
    int k, before;
    for (k = 0; k < 2; k++) {
        const int across = k ? springls__axis_after(axis) : springls__axis_after(springls__axis_after(axis)), beside = 3 - axis - across;
        int node[3];
        for (before = 0; before < 2; before++) {
            node[axis] = at[axis];
            node[across] = at[across];
            node[beside] = at[beside] - before;
            if (node[across] < 8 && node[beside] >= 0 && node[beside] < 8)
                ends[512 * across + springls__voxel_in_brick(node[0], node[1], node[2])] += (uint8_t)crossings;
        }
    }
}

/* Returns whether a brick, or any that shares the upper borders of its cells, has crossings or arcs. */
SPRINGLS__MATHS bool springls__has_some_beside(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                              int of)
{
    int d;
    for (d = 0; d < 8; d++)
        if (springls__has_some(contour, brick->around[13 + (d & 1) + 3 * (d >> 1 & 1) + 9 * (d >> 2)], of, 0, SPRINGLS__TABLE_ROWS))
            return true;
    return false;
}

/* Takes the arcs from the faces of a brick in a margin, but from its lowest ones beside a brick of the region. */
SPRINGLS__MATHS void springls__keep_shared_faces(SPRINGLS__GLOBAL springls__surface_brick *brick)
{
    int axis, k, at[3];
    for (axis = 0; axis < 3; axis++) {
        for (k = 0; k < 512; k++) {
            springls__node_of_brick(k, at);
            if (at[axis] > 0 || !springls__is_beside_region(brick, axis, -1)) brick->arcs[512 * axis + k] = 0;
        }
    }
}

/* Counts the arcs of the faces of brick b. Each joins two crossings. */
SPRINGLS__MATHS void springls__count_arcs(const springls__contour *contour, int b)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    int axis, u, v, k, at[3];
    for (k = 0; k < 1536; k++) brick->arcs[k] = 0;
    if (!springls__has_shared_nodes(brick) || !springls__has_some_beside(contour, brick, SPRINGLS__OF_CROSSINGS)) return;
    for (axis = 0; axis < 3; axis++)
        for (v = 0; v < 9; v++)
            for (u = 0; u < 9; u++) {
                const int p = springls__axis_after(axis), q = springls__axis_after(p), line = 64 * axis + (u & 7) + 8 * (v & 7);
                int node, owner;
                at[axis] = 0;
                at[p] = u;
                at[q] = v;
                owner = springls__table_node(brick, at, &node);
                if (owner < 0) continue;
                if (contour->brick[owner].begin[SPRINGLS__OF_CROSSINGS][line]
                    == contour->brick[owner].begin[SPRINGLS__OF_CROSSINGS][line + 1]) continue;
                for (; at[axis] < 8; at[axis]++) {
                    const int crossings = contour->brick[owner].crossings[8 * line + at[axis]];
                    if (crossings) springls__add_ends(at, axis, crossings, brick->arcs);
                }
            }
    for (k = 0; k < 1536; k++) brick->arcs[k] /= 2;
    if (brick->margin) springls__keep_shared_faces(brick);
}

/* Returns whether a cell on either side of a face of a brick is to have no more corners than it needs. */
SPRINGLS__MATHS bool springls__is_plain_face(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                             const int of_node[3], int axis)
{
    int before[3], node, b, k;
    for (k = 0; k < 3; k++) before[k] = of_node[k] - (k == axis);
    if (brick->plain[springls__voxel_in_brick(of_node[0], of_node[1], of_node[2])]) return true;
    b = springls__table_node(brick, before, &node);
    return b >= 0 && contour->brick[b].plain[node];
}

/* Finds the arcs of a face. */
SPRINGLS__MATHS void springls__find_face_arcs(const springls__model *model, const springls__contour *contour,
                                              SPRINGLS__GLOBAL const springls__surface_brick *brick, const springls__face *face,
                                              const int of_node[3], springls__owned owned, springls__face_work *work)
{
    const bool plain = springls__is_plain_face(contour, brick, of_node, face->axis);
    int i;
    springls__join_border(contour, face, springls__face_border(contour, brick, face, of_node, work), work);
    for (i = 0; i < owned.count; i++) {
        const springls__arc_section section = springls__section_of_arc(contour, face, &work->arc[i]);
        if (!plain) springls__find_corners(model, contour, face, &section, &work->arc[i]);
        if (plain || (section.along_edge >= 0 && work->arc[i].corners == 0)) springls__make_plain(face, &section, 0.05f, &work->arc[i]);
        work->arc[i].corner[0] = springls__snapped3(work->arc[i].corner[0]);
        work->arc[i].corner[1] = springls__snapped3(work->arc[i].corner[1]);
    }
    springls__part_arcs(contour, face, owned.count, work);
    for (i = 0; i < owned.count; i++) {
        springls__arc arc = work->arc[i];
        arc.corner[0] = springls__snapped3(arc.corner[0]);
        arc.corner[1] = springls__snapped3(arc.corner[1]);
        contour->arc[owned.first + i] = arc;
    }
}

/* Finds the arcs of the faces of brick b. */
SPRINGLS__MATHS void springls__find_arcs(const springls__model *model, const springls__contour *contour, int b,
                                         springls__face_work *work)
{
    SPRINGLS__GLOBAL const springls__surface_brick *brick = contour->brick + b;
    SPRINGLS__GLOBAL const int *begin = brick->begin[SPRINGLS__OF_ARCS];
    int k;
    for (k = 0; k < 1536 && begin[0] != begin[SPRINGLS__TABLE_ROWS]; k++) {
        springls__owned owned;
        springls__face face;
        int of_node[3];
        if ((k & 7) == 0 && begin[k >> 3] == begin[(k >> 3) + 1]) {
            k += 7;
            continue;
        }
        if (brick->arcs[k] == 0) continue;
        face.axis = k >> 9;
        face.b = springls__axis_after(face.axis);
        face.c = springls__axis_after(face.b);
        springls__node_of_brick(k & 511, of_node);
        springls__place_of_node(brick, k & 511, face.o);
        owned = springls__arcs_of_face(contour, brick, of_node, face.axis);
        springls__find_face_arcs(model, contour, brick, &face, of_node, owned, work);
    }
}

#endif
