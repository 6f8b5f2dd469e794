/* patches.h - springl contouring: the surface in each cell of the grid. The arcs on a cell's six faces form cycles, and each cycle is
   filled by triangles: corners of one crease are joined by chords, three or more that are left meet in an apex. Triangles of a cell
   are tested for crossing each other, in whole numbers: so none do, or the cell is reported. */
#ifndef SPRINGLS__KERNEL_OUTPUT_PATCHES_H
#define SPRINGLS__KERNEL_OUTPUT_PATCHES_H

#include "faces.h"

#define SPRINGLS__CELL_ARCS (6 * SPRINGLS__FACE_ARCS)
#define SPRINGLS__CELL_CORNERS (3 * SPRINGLS__CELL_ARCS)    /* of all cycles: an arc has a crossing and up to two corners  */
#define SPRINGLS__CELL_RINGS (2 * SPRINGLS__CELL_CORNERS)   /* corners, with those that chords repeat                      */
#define SPRINGLS__CELL_VERTICES (2 * SPRINGLS__CELL_CORNERS)
#define SPRINGLS__CELL_TRIANGLES (2 * SPRINGLS__CELL_CORNERS)
#define SPRINGLS__RING 32 /* a longer cycle is a fan */

/* A vertex of a cell. id: a crossing; from first_corner on corners of arcs; below 0 a new one. n: of the surface; crosses: 1 for a crossing
   that is supported by springls. */
typedef struct springls__cell_vertex { springls__v3 x, n; int id, crosses, place[3]; } springls__cell_vertex;

/* A corner of a cycle: the normals before and after it, the faces of the cell that it lies on, as bits; sharp: 1 for a corner of an arc. */
typedef struct springls__cycle_corner { springls__v3 before, after; int vertex, faces, sharp; } springls__cycle_corner;

/* An arc as the cell sees it: from one crossing to another; forward: 1 for the face's own way. */
typedef struct springls__link { int from, to, arc, forward, face, used; } springls__link;

/* Working memory of one brick. */
typedef struct springls__cell_work {
    uint8_t sides[512]; /* how many arcs the faces of each cell have */
    springls__link link[SPRINGLS__CELL_ARCS];
    springls__cell_vertex vertex[SPRINGLS__CELL_VERTICES];
    springls__cycle_corner corner[SPRINGLS__CELL_CORNERS + 1]; /* the last: an apex */
    int cycle_end[SPRINGLS__CELL_ARCS];
    int ring_corner[SPRINGLS__CELL_RINGS], ring_next[SPRINGLS__CELL_RINGS], ring_seen[SPRINGLS__CELL_RINGS];
    int ring[SPRINGLS__CELL_RINGS], whole_ring[SPRINGLS__CELL_RINGS], mate[SPRINGLS__CELL_CORNERS], sharp[SPRINGLS__RING];
    float cost[(SPRINGLS__RING + 1) * (SPRINGLS__RING + 1)];
    int cut[(SPRINGLS__RING + 1) * (SPRINGLS__RING + 1)], stack[4 * SPRINGLS__RING];
    int triangle[3 * SPRINGLS__CELL_TRIANGLES];
    int links, cycles, vertices, own_vertices, ring_nodes, triangles, origin[3];
} springls__cell_work;

/* ---- cycles ---- */

/* Lists the arcs on the six faces of a cell, each in the way that has outside on the left as seen from outside the cell. */
SPRINGLS__MATHS void springls__list_links(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                          const int of_node[3], springls__cell_work *work)
{
    int axis, side, k, at[3];
    work->links = 0;
    for (axis = 0; axis < 3; axis++)
        for (side = 0; side < 2; side++) {
            springls__owned owned;
            for (k = 0; k < 3; k++) at[k] = of_node[k] + (k == axis ? side : 0);
            owned = springls__arcs_of_face(contour, brick, at, axis);
            for (k = 0; k < owned.count; k++) {
                springls__link *link = &work->link[work->links++];
                link->arc = owned.first + k;
                link->forward = side;
                link->from = side ? contour->arc[link->arc].from : contour->arc[link->arc].to;
                link->to = side ? contour->arc[link->arc].to : contour->arc[link->arc].from;
                link->face = 1 << (2 * axis + side);
                link->used = 0;
            }
        }
}

SPRINGLS__MATHS int springls__add_cell_vertex(springls__cell_work *work, int id, springls__v3 x, springls__v3 n,
                                              bool crosses)
{
    springls__cell_vertex *v = &work->vertex[work->vertices];
    const float scale = 65536.0f;
    v->id = id;
    v->x = x;
    v->n = n;
    v->crosses = crosses;
    v->place[0] = (int)((x.x - (float)work->origin[0]) * scale);
    v->place[1] = (int)((x.y - (float)work->origin[1]) * scale);
    v->place[2] = (int)((x.z - (float)work->origin[2]) * scale);
    return work->vertices++;
}

/* Adds corners first and last of a link to the cycle: the crossing that it begins at, and those of its arc. */
SPRINGLS__MATHS int springls__add_link(const springls__contour *contour, int first_corner, const springls__link *link, int face_before,
                                       int corners, springls__cell_work *work)
{
    const springls__crossing begin = contour->crossing[link->from];
    const springls__arc arc = contour->arc[link->arc];
    springls__cycle_corner *c = &work->corner[corners++];
    int k;
    c->before = c->after = begin.n;
    c->faces = link->face | face_before;
    c->sharp = 0;
    c->vertex = springls__add_cell_vertex(work, link->from, begin.x, begin.n, springls__length2(begin.n) > 0.0f);
    for (k = 0; k < arc.corners; k++) {
        const int n = link->forward ? k : arc.corners - 1 - k;
        const springls__v3 first = n == 0 ? contour->crossing[arc.from].n : arc.rim;
        const springls__v3 last = n == arc.corners - 1 ? contour->crossing[arc.to].n : arc.rim;
        c = &work->corner[corners++];
        c->before = link->forward ? first : last;
        c->after = link->forward ? last : first;
        c->faces = link->face;
        c->sharp = 1;
        c->vertex = springls__add_cell_vertex(work, first_corner + 2 * link->arc + n, arc.corner[n],
                                              springls__normalize(springls__add(first, last)), false);
    }
    return corners;
}

/* Returns the link that begins where another ends. */
SPRINGLS__MATHS int springls__link_after(const springls__cell_work *work, int to)
{
    int k;
    for (k = 0; k + 1 < work->links && work->link[k].from != to; k++) continue;
    return k;
}

/* Finds the cycles of a cell. */
SPRINGLS__MATHS void springls__find_cycles(const springls__contour *contour, int first_corner,
                                           springls__cell_work *work)
{
    int first, k, corners = 0;
    work->cycles = work->vertices = 0;
    for (first = 0; first < work->links; first++) {
        int face_before = 0;
        if (work->link[first].used) continue;
        for (k = first; work->link[springls__link_after(work, work->link[k].to)].used == 0; ) {
            work->link[k].used = 1;
            k = springls__link_after(work, work->link[k].to);
        }
        face_before = work->link[k].face; /* of the last link, which ends where the first begins */
        work->link[k].used = 1;
        k = first;
        do {
            const springls__link link = work->link[k];
            corners = springls__add_link(contour, first_corner, &link, face_before, corners, work);
            face_before = link.face;
            k = springls__link_after(work, link.to);
        } while (k != first);
        work->cycle_end[work->cycles++] = corners;
    }
    work->own_vertices = work->vertices;
}

/* ---- triangles ---- */

SPRINGLS__INNER void springls__add_triangle(springls__cell_work *work, int a, int b, int c)
{
    int *t = work->triangle + 3 * work->triangles++;
    t[0] = a;
    t[1] = b;
    t[2] = c;
}

/* Returns the vertex of corner k of the ring. */
SPRINGLS__INNER int springls__ring_vertex(const springls__cell_work *work, int k)
{
    return work->corner[work->ring[k]].vertex;
}

/* Returns what a triangle costs: its area, and more where it is off the normals of its corners. */
SPRINGLS__MATHS float springls__triangle_cost(const springls__cell_work *work, int i, int j, int k)
{
    const int v[3] = { springls__ring_vertex(work, i), springls__ring_vertex(work, j), springls__ring_vertex(work, k) };
    const springls__v3 p = work->vertex[v[0]].x;
    const springls__v3 n = springls__cross(springls__sub(work->vertex[v[1]].x, p), springls__sub(work->vertex[v[2]].x, p));
    const float area = springls__length(n);
    float sum = 0.01f;
    int c;
    if (area < 1e-12f) return 1e-3f;
    for (c = 0; c < 3; c++) {
        const float off = 1.0f - springls__dot(n, work->vertex[v[c]].n) / area;
        if (work->vertex[v[c]].crosses) sum += off * off;
    }
    return area * sum + 1e-4f;
}

/* Returns what a diagonal costs: none may lie in a face of the cell. */
SPRINGLS__INNER float springls__diagonal_cost(const springls__cell_work *work, int n, int i, int j)
{
    if (j == i + 1 || (i == 0 && j == n - 1)) return 0.0f;
    return work->corner[work->ring[i]].faces & work->corner[work->ring[j]].faces ? 1e6f : 0.0f;
}

/* Fills the ring of n corners by the cheapest triangles between them; false: there is no way without diagonals in a face. */
SPRINGLS__MATHS bool springls__triangulate(int n, springls__cell_work *work)
{
    const int row = SPRINGLS__RING;
    int width, i, k, top = 0;
    if (n < 3 || n > SPRINGLS__RING) return false;
    for (i = 0; i + 1 < n; i++) work->cost[row * i + i + 1] = 0.0f;
    for (width = 2; width < n; width++)
        for (i = 0; i + width < n; i++) {
            const int j = i + width;
            float best = 1e30f;
            for (k = i + 1; k < j; k++) {
                const float cost = work->cost[row * i + k] + work->cost[row * k + j] + springls__triangle_cost(work, i, k, j)
                                 + springls__diagonal_cost(work, n, i, k) + springls__diagonal_cost(work, n, k, j);
                if (cost >= best) continue;
                best = cost;
                work->cut[row * i + j] = k;
            }
            work->cost[row * i + j] = best;
        }
    if (work->cost[n - 1] >= 1e6f) return false;
    work->stack[top++] = 0;
    work->stack[top++] = n - 1;
    while (top > 0) {
        const int j = work->stack[--top];
        i = work->stack[--top];
        if (j - i < 2) continue;
        k = work->cut[row * i + j];
        springls__add_triangle(work, springls__ring_vertex(work, i), springls__ring_vertex(work, k), springls__ring_vertex(work, j));
        work->stack[top++] = i;
        work->stack[top++] = k;
        work->stack[top++] = k;
        work->stack[top++] = j;
    }
    return true;
}

/* Returns the middle of the ring's n corners. */
SPRINGLS__MATHS springls__v3 springls__ring_middle(int n, const springls__cell_work *work)
{
    springls__v3 sum = springls__zero3();
    int k;
    for (k = 0; k < n; k++) sum = springls__add(sum, work->vertex[springls__ring_vertex(work, k)].x);
    return springls__scale(sum, 1.0f / (float)n);
}

/* Returns the place in the cell nearest to the planes at all crossings of the ring, by least squares about its middle. */
SPRINGLS__MATHS springls__v3 springls__ring_apex(int n, const springls__cell_work *work)
{
    const springls__v3 middle = springls__ring_middle(n, work);
    float m[3][4], x[3], c[3];
    int k, i, j, r;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 4; j++) m[i][j] = i == j ? 0.05f : 0.0f;
    for (k = 0; k < n; k++) {
        const springls__v3 p = work->vertex[springls__ring_vertex(work, k)].x, q = work->vertex[springls__ring_vertex(work, k)].n;
        const float height = springls__dot(q, springls__sub(p, middle));
        if (!work->vertex[springls__ring_vertex(work, k)].crosses) continue;
        for (i = 0; i < 3; i++) {
            for (j = 0; j < 3; j++) m[i][j] += springls__along(q, i) * springls__along(q, j);
            m[i][3] += springls__along(q, i) * height;
        }
    }
    for (i = 0; i < 3; i++)
        for (r = i + 1; r < 3; r++) {
            const float f = m[r][i] / m[i][i];
            for (j = i; j < 4; j++) m[r][j] -= f * m[i][j];
        }
    for (i = 2; i >= 0; i--) {
        const float low = (float)work->origin[i] + 1.0f / 128.0f;
        x[i] = m[i][3];
        for (j = i + 1; j < 3; j++) x[i] -= m[i][j] * x[j];
        x[i] /= m[i][i];
        c[i] = springls__clamp(springls__along(middle, i) + x[i], low, low + 126.0f / 128.0f);
    }
    return springls__snapped3(springls__v3_make(c[0], c[1], c[2]));
}

/* Adds a vertex inside the cell, with the mean normal of the ring. */
SPRINGLS__MATHS int springls__add_inner_vertex(int n, springls__v3 x, springls__cell_work *work)
{
    springls__v3 sum = springls__zero3();
    int k;
    for (k = 0; k < n; k++) sum = springls__add(sum, work->vertex[springls__ring_vertex(work, k)].n);
    return springls__add_cell_vertex(work, -1, x, springls__normalize(sum), false);
}

/* Fills the ring by a fan around x. */
SPRINGLS__MATHS void springls__add_fan(int n, springls__v3 x, springls__cell_work *work)
{
    const int v = springls__add_inner_vertex(n, x, work);
    int k;
    for (k = 0; k < n; k++)
        springls__add_triangle(work, springls__ring_vertex(work, k), springls__ring_vertex(work, k + 1 < n ? k + 1 : 0), v);
}

/* ---- creases: chords and apexes ---- */

/* Returns what it costs to join corners p and q of two faces as ends of one crease: little where the sides are the same. */
SPRINGLS__MATHS float springls__chord_cost(const springls__cycle_corner *p, const springls__cycle_corner *q)
{
    if (p->faces & q->faces) return 9.0f;
    return (1.0f - springls__dot(p->before, q->after)) + (1.0f - springls__dot(p->after, q->before));
}

/* Joins sharp corners of a cycle in pairs that do not cross, the cheapest together; one alone costs `alone`. work->mate of a corner: its
   mate, or -1. Returns how many have none. */
SPRINGLS__MATHS int springls__pair_corners(int n, springls__cell_work *work)
{
    const float alone = 0.3f;
    const int row = SPRINGLS__RING + 1;
    int width, i, j, top = 0, lone = 0;
    for (i = 0; i <= n; i++) work->cost[row * i + i] = 0.0f;
    for (width = 1; width <= n; width++)
        for (i = 0; i + width <= n; i++) {
            const int end = i + width;
            float best = work->cost[row * (i + 1) + end] + alone;
            work->cut[row * i + end] = -1;
            for (j = i + 1; j < end; j++) {
                const springls__cycle_corner p = work->corner[work->sharp[i]], q = work->corner[work->sharp[j]];
                const float cost = springls__chord_cost(&p, &q) + work->cost[row * (i + 1) + j] + work->cost[row * (j + 1) + end];
                if (cost >= best) continue;
                best = cost;
                work->cut[row * i + end] = j;
            }
            work->cost[row * i + end] = best;
        }
    for (i = 0; i < n; i++) work->mate[work->sharp[i]] = -1;
    work->stack[top++] = 0;
    work->stack[top++] = n;
    while (top > 0) {
        const int end = work->stack[--top];
        i = work->stack[--top];
        if (i >= end) continue;
        j = work->cut[row * i + end];
        lone += j < 0;
        if (j >= 0) {
            work->mate[work->sharp[i]] = work->sharp[j];
            work->mate[work->sharp[j]] = work->sharp[i];
        }
        work->stack[top++] = i + 1;
        work->stack[top++] = j < 0 ? end : j;
        if (j < 0) continue;
        work->stack[top++] = j + 1;
        work->stack[top++] = end;
    }
    return lone;
}

/* Joins the two sharp corners that were left, if they lie on two faces and no chord is between. Returns how many are left then. */
SPRINGLS__MATHS int springls__pair_last(int n, springls__cell_work *work)
{
    int i, first = -1, last = -1;
    for (i = 0; i < n; i++) {
        if (work->mate[work->sharp[i]] >= 0) continue;
        if (first < 0) first = i;
        last = i;
    }
    if (work->corner[work->sharp[first]].faces & work->corner[work->sharp[last]].faces) return 2;
    for (i = first + 1; i < last; i++) {
        const int mate = work->mate[work->sharp[i]];
        if (mate < work->sharp[first] || mate > work->sharp[last]) return 2;
    }
    work->mate[work->sharp[first]] = work->sharp[last];
    work->mate[work->sharp[last]] = work->sharp[first];
    return 0;
}

/* Cuts the ring between corners a and b along their chord: two more nodes of rings. */
SPRINGLS__MATHS void springls__cut_ring(int a, int b, springls__cell_work *work)
{
    const int again_a = work->ring_nodes, again_b = again_a + 1;
    if (work->ring_next[a] == b || work->ring_next[b] == a) return;
    work->ring_corner[again_a] = work->ring_corner[a];
    work->ring_corner[again_b] = work->ring_corner[b];
    work->ring_next[again_a] = work->ring_next[a];
    work->ring_next[again_b] = work->ring_next[b];
    work->ring_next[a] = again_b;
    work->ring_next[b] = again_a;
    work->ring_seen[again_a] = work->ring_seen[again_b] = 0;
    work->ring_nodes += 2;
}

/* Collects the ring that a node is in. Returns its length. */
SPRINGLS__MATHS int springls__collect_ring(int node, springls__cell_work *work)
{
    int n = 0, k = node;
    do {
        work->ring[n++] = work->ring_corner[k];
        work->ring_seen[k] = 1;
        k = work->ring_next[k];
    } while (k != node);
    return n;
}

SPRINGLS__INNER bool springls__is_spoke(const springls__cell_work *work, int corner)
{
    return work->corner[corner].sharp && work->mate[corner] < 0;
}

/* Fills a ring around an apex, where its lone corners meet: sector by sector between those. */
SPRINGLS__MATHS void springls__fill_sectors(int n, springls__cell_work *work)
{
    springls__cycle_corner *corner = &work->corner[SPRINGLS__CELL_CORNERS];
    const int apex = springls__add_inner_vertex(n, springls__ring_apex(n, work), work);
    int first, k, c, length;
    corner->vertex = apex;
    corner->faces = corner->sharp = 0;
    corner->before = corner->after = springls__zero3();
    for (k = 0; k < n; k++) work->whole_ring[k] = work->ring[k];
    for (first = 0; first < n; first++) {
        if (!springls__is_spoke(work, work->whole_ring[first])) continue;
        work->ring[0] = SPRINGLS__CELL_CORNERS;
        length = 1;
        k = first;
        do {
            work->ring[length++] = work->whole_ring[k];
            k = k + 1 < n ? k + 1 : 0;
        } while (!springls__is_spoke(work, work->whole_ring[k]));
        work->ring[length++] = work->whole_ring[k];
        if (springls__triangulate(length, work)) continue;
        for (c = 1; c + 1 < length; c++)
            springls__add_triangle(work, apex, springls__ring_vertex(work, c), springls__ring_vertex(work, c + 1));
    }
}

/* Fills the cycle of corners [first, end). */
SPRINGLS__MATHS void springls__fill_cycle(int first, int end, springls__cell_work *work)
{
    int k, n = 0, lone = 0;
    work->ring_nodes = end;
    for (k = first; k < end; k++) {
        work->ring_corner[k] = k;
        work->ring_next[k] = k + 1 < end ? k + 1 : first;
        work->ring_seen[k] = 0;
        work->mate[k] = -1;
        if (work->corner[k].sharp && n < SPRINGLS__RING) work->sharp[n++] = k;
    }
    if (n >= 2 && end - first <= SPRINGLS__RING) {
        lone = springls__pair_corners(n, work);
        if (lone == 2) lone = springls__pair_last(n, work);
        for (k = 0; k < n; k++)
            if (work->mate[work->sharp[k]] > work->sharp[k]) springls__cut_ring(work->sharp[k], work->mate[work->sharp[k]], work);
    }
    for (k = first; k < work->ring_nodes; k++) {
        int length, c, spokes = 0;
        if (work->ring_seen[k]) continue;
        length = springls__collect_ring(k, work);
        for (c = 0; c < length; c++) spokes += springls__is_spoke(work, work->ring[c]);
        if (lone >= 3 && spokes >= 3) springls__fill_sectors(length, work);
        else if (!springls__triangulate(length, work)) springls__add_fan(length, springls__ring_apex(length, work), work);
    }
}

/* ---- triangles that cross ---- */

/* Returns six times the volume of a tetrahedron, exactly. */
SPRINGLS__MATHS int64_t springls__place_volume(const springls__cell_work *work, int a, int b, int c, int d)
{
    const int *o = work->vertex[a].place;
    int64_t x[3], y[3], z[3];
    int k;
    for (k = 0; k < 3; k++) {
        x[k] = work->vertex[b].place[k] - o[k];
        y[k] = work->vertex[c].place[k] - o[k];
        z[k] = work->vertex[d].place[k] - o[k];
    }
    return x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0]) + x[2] * (y[0] * z[1] - y[1] * z[0]);
}

/* Returns whether segment pq meets triangle t, which it does not lie in the plane of. */
SPRINGLS__MATHS bool springls__pierces(const springls__cell_work *work, int p, int q, const int *t)
{
    const int64_t s = springls__place_volume(work, t[0], t[1], t[2], p), e = springls__place_volume(work, t[0], t[1], t[2], q);
    int64_t u, v, w;
    if (!springls__opposite(s, e) || (s == 0 && e == 0)) return false;
    u = springls__place_volume(work, p, q, t[0], t[1]);
    v = springls__place_volume(work, p, q, t[1], t[2]);
    w = springls__place_volume(work, p, q, t[2], t[0]);
    return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

/* Returns whether two triangles with one side in common lie folded on each other; a, b: the corners apart from it. */
SPRINGLS__MATHS bool springls__is_folded(const springls__cell_work *work, int p, int q, int a, int b)
{
    const springls__v3 o = work->vertex[p].x, side = springls__normalize(springls__sub(work->vertex[q].x, o));
    springls__v3 u = springls__sub(work->vertex[a].x, o), v = springls__sub(work->vertex[b].x, o);
    u = springls__mad(u, side, -springls__dot(u, side));
    v = springls__mad(v, side, -springls__dot(v, side));
    return springls__dot(u, v) > 0.99999f * springls__length(u) * springls__length(v);
}

/* Returns whether two triangles of a cell meet but in the corners that they share. */
SPRINGLS__MATHS bool springls__triangles_meet(const springls__cell_work *work, const int *s,
                                              const int *t)
{
    int at_s[3], at_t[3], shared = 0, i, j;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            if (s[i] == t[j] && shared < 3) {
                at_s[shared] = i;
                at_t[shared++] = j;
            }
    if (shared == 3) return true;
    if (shared == 2) return springls__is_folded(work, s[at_s[0]], s[at_s[1]], s[3 - at_s[0] - at_s[1]], t[3 - at_t[0] - at_t[1]]);
    for (i = 0; i < 3; i++) {
        const int next = i < 2 ? i + 1 : 0; /* with a corner shared, the side across from it alone */
        if ((shared == 0 || (i != at_s[0] && next != at_s[0])) && springls__pierces(work, s[i], s[next], t)) return true;
        if ((shared == 0 || (i != at_t[0] && next != at_t[0])) && springls__pierces(work, t[i], t[next], s)) return true;
    }
    return false;
}

SPRINGLS__MATHS bool springls__any_meet(const springls__cell_work *work)
{
    int i, j;
    for (i = 0; i < work->triangles; i++)
        for (j = i + 1; j < work->triangles; j++)
            if (springls__triangles_meet(work, work->triangle + 3 * i, work->triangle + 3 * j)) return true;
    return false;
}

/* ---- the cell ---- */

/* Fills all cycles by fans: about their apex, their middle, or a place between that and the middle of the cell. */
SPRINGLS__MATHS void springls__fill_by_fans(int way, springls__cell_work *work)
{
    const springls__v3 o = springls__v3_make((float)work->origin[0], (float)work->origin[1], (float)work->origin[2]);
    int cycle, k, begin = 0;
    work->vertices = work->own_vertices;
    work->triangles = 0;
    for (cycle = 0; cycle < work->cycles; cycle++) {
        const int n = work->cycle_end[cycle] - begin;
        springls__v3 x;
        for (k = 0; k < n; k++) work->ring[k] = begin + k;
        x = way == 0 ? springls__ring_apex(n, work) : springls__ring_middle(n, work);
        if (way == 2) x = springls__lerp(x, springls__add(o, springls__v3_make(0.5f, 0.5f, 0.5f)), 0.02f);
        springls__add_fan(n, springls__snapped3(x), work);
        begin = work->cycle_end[cycle];
    }
}

/* Finds the triangles of the cell that begins at a node. Returns false if some cross. */
SPRINGLS__MATHS bool springls__fill_cell(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                         const int of_node[3], springls__cell_work *work)
{
    const int few = 5; /* corners: the side of a triangle across from a corner that it shares with another is then in a face */
    int cycle, way, k, begin = 0;
    bool plain;
    springls__list_links(contour, brick, of_node, work);
    work->triangles = work->cycles = work->vertices = work->own_vertices = 0;
    springls__find_cycles(contour, contour->first_corner, work);
    plain = work->cycles == 1 && work->cycle_end[0] <= few;
    for (cycle = 0; cycle < work->cycles; cycle++) {
        springls__fill_cycle(begin, work->cycle_end[cycle], work);
        for (k = begin; k < work->cycle_end[cycle]; k++) plain = plain && !work->corner[k].sharp;
        begin = work->cycle_end[cycle];
    }
    if (plain || !springls__any_meet(work)) return true;
    for (way = 0; way < 3; way++) {
        springls__fill_by_fans(way, work);
        if (!springls__any_meet(work)) return true;
    }
    return false;
}

/* Counts the arcs on the faces of each cell of brick b. Returns their sum. */
SPRINGLS__MATHS int springls__count_links(const springls__contour *contour, int b, springls__cell_work *work)
{
    SPRINGLS__GLOBAL const springls__surface_brick *brick = contour->brick + b;
    int k, axis, sum = 0, at[3];
    if (brick->margin || !springls__has_some_beside(contour, brick, SPRINGLS__OF_ARCS)) return 0;
    for (k = 0; k < 512; k++) work->sides[k] = 0;
    for (axis = 0; axis < 3; axis++) {
        const int next = brick->around[axis == 0 ? 14 : axis == 1 ? 16 : 22];
        const bool some = brick->begin[SPRINGLS__OF_ARCS][64 * axis] != brick->begin[SPRINGLS__OF_ARCS][64 * axis + 64];
        for (k = 0; k < 512 && some; k++) { /* each is a side of two cells */
            const int arcs = brick->arcs[512 * axis + k];
            if (arcs == 0) continue;
            springls__node_of_brick(k, at);
            work->sides[k] += (uint8_t)arcs;
            if (at[axis] > 0) work->sides[k - (1 << 3 * axis)] += (uint8_t)arcs;
        }
        for (k = 0; k < 64 && springls__has_some(contour, next, SPRINGLS__OF_ARCS, 64 * axis, 64 * axis + 64); k++)
            work->sides[springls__line_node(axis, 7, k)] += contour->brick[next].arcs[512 * axis + springls__line_node(axis, 0, k)];
    }
    for (k = 0; k < 512; k++) sum += work->sides[k];
    return sum;
}

/* Writes the triangles of the cells of brick b, three numbers of vertices each, and the vertices in cells. Marks the cells in which
   triangles cross. */
SPRINGLS__MATHS void springls__find_patches(const springls__contour *contour, int b, springls__cell_work *work)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    int node, k;
    brick->triangles = brick->inner = 0;
    for (k = 0; k < 16; k++) brick->conflict[k] = 0u;
    if (springls__count_links(contour, b, work) == 0) return;
    for (node = 0; node < 512; node++) {
        SPRINGLS__GLOBAL int *corners = contour->corners + 3 * (size_t)(brick->first_triangle + brick->triangles);
        int of_node[3];
        if (work->sides[node] == 0) continue;
        springls__node_of_brick(node, of_node);
        for (k = 0; k < 3; k++) work->origin[k] = brick->origin[k] + of_node[k];
        if (!springls__fill_cell(contour, brick, of_node, work)) brick->conflict[node >> 5] |= 1u << (node & 31);
        for (k = work->own_vertices; k < work->vertices; k++) {
            springls__crossing v;
            v.x = work->vertex[k].x;
            v.n = work->vertex[k].n;
            v.side = 0;
            v.springl = -1;
            work->vertex[k].id = contour->first_inner + brick->first_inner + brick->inner;
            contour->inner[brick->first_inner + brick->inner++] = v;
        }
        for (k = 0; k < 3 * work->triangles; k++) corners[k] = work->vertex[work->triangle[k]].id;
        brick->triangles += work->triangles;
    }
}

#endif
