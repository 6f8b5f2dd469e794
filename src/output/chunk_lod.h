/* chunk_lod.h - triangles of a chunk at a lower level of detail, between vertices that the chunk has: so normals, correspondences, ids and
   attributes of vertices serve all levels.

   A border between two chunks is a set of chains of edges. It is thinned out by itself, from the places of its vertices alone and by the
   finer one of both levels: so both sides find the same edges, and no strip or skirt is needed.

       kept           kept            kept: it lies on another border too, or where chains branch
        o--.--.--o--.--o--.--.--o     o   stays: split_chain divides until the rest is within the tolerance
           |     |     |              .   goes onto the next o along the chain
        ---+-----+-----+---

   Then inner vertices are collapsed onto neighbors, as long as quadrics (Garland and Heckbert 1997) allow, no triangle turns over, and
   edges do not get too long. A collapse onto a vertex takes triangles to triangles: with the same edges at the borders on both sides, what
   was closed stays closed, at any levels; where a part is thinner than a level shows, two triangles may lie back to back. At last each
   vertex that there was has to be within the tolerance of a triangle around the vertex that it has become; where one is not, it stays, and
   all is done again. */
#ifndef SPRINGLS__OUTPUT_CHUNK_LOD_H
#define SPRINGLS__OUTPUT_CHUNK_LOD_H

#include "../../kernels_embed/language/triangle.h"
#include "../runtime/errors.h"
#include "../runtime/finite.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../model/top_table.h"
#include "../model/transform.h"

enum {
    SPRINGLS__LOD_LEVELS = 4,
    SPRINGLS__LOD_RING = 24,    /* more neighbors, and a vertex stays                               */
    SPRINGLS__LOD_BATCH = 64,   /* chunks that memory is taken for at a time                        */
    SPRINGLS__LOD_ROUNDS = 4,   /* of quadrics, each with four times the square of the last         */
    SPRINGLS__LOD_TRIES = 12,   /* after these, only borders are thinned out                        */
    SPRINGLS__LOD_NO_FACE = 6
};

/* Sums the squares of distances to planes. */
typedef struct springls__quadric { float xx, xy, xz, yy, yz, zz, x, y, z, one; } springls__quadric;

/* What may become of a vertex: inner ones go onto any neighbor, those of a border along it. */
typedef enum springls__lod_role { SPRINGLS__LOD_INNER, SPRINGLS__LOD_ON_BORDER, SPRINGLS__LOD_KEPT } springls__lod_role;

typedef struct springls__lod_vertex {
    springls__v3 x;            /* smallest spacings from the chunk's first vertex                     */
    springls__quadric quadric;
    springls__lod_role role;
    int first_corner;          /* of the list of its corners; -1: none                                */
    int to;                    /* what it has been collapsed onto; itself: it is there                */
    int along[2];              /* its neighbors on the border                                         */
    int degree, face;          /* edges at the border, and on which one they lie                      */
    int mark, tried, moved;    /* by find_common; the round in which it was tried; the pass in which something beside it went */
    bool visited, locked;
} springls__lod_vertex;

/* A chunk while triangles of a level are found. corner, next: of triangle t at 3 t; -1: the triangle is gone, or the list ends. */
typedef struct springls__lod_work {
    const springls_chunk *chunk;
    const double *to_lattice;
    springls__lod_vertex *vertex;
    int *corner, *next, *chain;
    int level, face_level[6], mark;
    float unit;                 /* world units: the smallest spacing */
    float stretch;              /* largest spacing over smallest     */
} springls__lod_work;

/* Returns how far from the surface a level may be, and how long its edges may become, in smallest spacings. */
SPRINGLS__FN float springls__lod_tolerance(int level) { return 0.125f * (float)(1 << level); }
SPRINGLS__FN float springls__lod_length(const springls__lod_work *w, int level) { return 1.5f * (float)(1 << level) * w->stretch; }

/* ---- corners ---- */

SPRINGLS__FN int springls__next_of_triangle(int corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

/* Returns the first corner from `corner` on, in the list of its vertex, whose triangle is there; -1: none. */
SPRINGLS__FN int springls__living_corner(const springls__lod_work *w, int corner)
{
    while (corner >= 0 && w->corner[corner] < 0) corner = w->next[corner];
    return corner;
}

SPRINGLS__FN void springls__kill_triangle(springls__lod_work *w, int t)
{
    w->corner[3 * t] = w->corner[3 * t + 1] = w->corner[3 * t + 2] = -1;
}

/* Lists the corners of each vertex, of triangles that have three. */
SPRINGLS__FN void springls__link_corners(springls__lod_work *w)
{
    int i, t;
    for (i = 0; i < w->chunk->vertex_count; i++) w->vertex[i].first_corner = -1;
    for (t = 0; t < w->chunk->triangle_count; t++) {
        int *c = w->corner + 3 * t;
        if (c[0] < 0) continue;
        if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) {
            springls__kill_triangle(w, t);
            continue;
        }
        for (i = 3 * t; i < 3 * t + 3; i++) {
            w->next[i] = w->vertex[w->corner[i]].first_corner;
            w->vertex[w->corner[i]].first_corner = i;
        }
    }
}

/* Returns how many triangles have the edge from a to b, in that direction. */
SPRINGLS__FN int springls__count_edge(const springls__lod_work *w, int a, int b)
{
    int n = 0, c = springls__living_corner(w, w->vertex[a].first_corner);
    for (; c >= 0; c = springls__living_corner(w, w->next[c])) n += w->corner[springls__next_of_triangle(c)] == b;
    return n;
}

/* ---- the border ---- */

/* Returns the border on which an edge of the border lies, 2 axis + side; NO_FACE: on none, or it may be on two. */
SPRINGLS__FN int springls__face_of_edge(const springls__lod_work *w, int a, int b)
{
    const float within = 0.05f; /* voxels */
    const float *ends[2];
    float away[6];
    double place[3];
    int face, best = 0, end, found = 0;
    ends[0] = w->chunk->positions + 3 * a;
    ends[1] = w->chunk->positions + 3 * b;
    for (face = 0; face < 6; face++) away[face] = 0.0f;
    for (end = 0; end < 2; end++) {
        springls__transform(w->to_lattice, (double)ends[end][0], (double)ends[end][1], (double)ends[end][2], place);
        for (face = 0; face < 6; face++)
            away[face] = springls__max(away[face], springls__fabs((float)(place[face / 2]
                                                                          - 8.0 * ((double)w->chunk->brick[face / 2] + face % 2))));
    }
    for (face = 0; face < 6; face++) {
        found += away[face] <= within;
        if (away[face] < away[best]) best = face;
    }
    return found == 1 ? best : SPRINGLS__LOD_NO_FACE;
}

SPRINGLS__FN void springls__add_border_edge(springls__lod_vertex *v, int other, int face)
{
    if (v->degree < 2) v->along[v->degree] = other;
    if (v->degree > 0 && v->face != face) face = SPRINGLS__LOD_NO_FACE;
    v->face = face;
    v->degree++;
}

/* Finds the edges at the border: of one triangle. */
SPRINGLS__FN void springls__find_border(springls__lod_work *w)
{
    int c, i;
    for (c = 0; c < 3 * w->chunk->triangle_count; c++) {
        const int a = w->corner[c], b = a < 0 ? -1 : w->corner[springls__next_of_triangle(c)];
        int there, back, face;
        if (a < 0) continue;
        there = springls__count_edge(w, a, b);
        back = springls__count_edge(w, b, a);
        if (there == 1 && back == 1) continue;
        face = there == 1 && back == 0 ? springls__face_of_edge(w, a, b) : SPRINGLS__LOD_NO_FACE;
        springls__add_border_edge(&w->vertex[a], b, face);
        springls__add_border_edge(&w->vertex[b], a, face);
    }
    for (i = 0; i < w->chunk->vertex_count; i++) {
        springls__lod_vertex *v = &w->vertex[i];
        v->role = v->degree == 0 ? SPRINGLS__LOD_INNER
                : v->degree == 2 && v->face != SPRINGLS__LOD_NO_FACE && w->face_level[v->face] > 0 ? SPRINGLS__LOD_ON_BORDER
                : SPRINGLS__LOD_KEPT;
    }
}

/* Returns the world place of a vertex: borders are thinned out by these alone, which both sides have. */
SPRINGLS__FN springls__v3 springls__lod_place(const springls__lod_work *w, int i) { return springls__load3(w->chunk->positions + 3 * i); }

SPRINGLS__FN bool springls__place_before(springls__v3 a, springls__v3 b)
{
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

/* Returns the squared distance of x from the segment between a and b, the same bits for b and a. */
SPRINGLS__FN float springls__chord_distance2(springls__v3 x, springls__v3 a, springls__v3 b)
{
    const springls__v3 from = springls__place_before(a, b) ? a : b, to = springls__place_before(a, b) ? b : a;
    const springls__v3 along = springls__sub(to, from), d = springls__sub(x, from);
    const float l2 = springls__length2(along);
    const float s = l2 > 0.0f ? springls__clamp(springls__dot(d, along) / l2, 0.0f, 1.0f) : 0.0f;
    return springls__length2(springls__sub(d, springls__scale(along, s)));
}

/* Returns which vertex of a chain between its members i and j should stay, the same from both ends; -1: none. */
SPRINGLS__FN int springls__chain_split(const springls__lod_work *w, int i, int j, float tolerance, float length)
{
    const springls__v3 a = springls__lod_place(w, w->chain[i]), b = springls__lod_place(w, w->chain[j]);
    const bool too_long = springls__length2(springls__sub(a, b)) > length * length;
    float most = -1.0f, middle = FLT_MAX;
    int k, outermost = -1, central = -1;
    for (k = i + 1; k < j; k++) {
        const springls__v3 x = springls__lod_place(w, w->chain[k]);
        const float d2 = springls__chord_distance2(x, a, b);
        const float off = springls__fabs(springls__length2(springls__sub(x, a)) - springls__length2(springls__sub(x, b)));
        if (d2 > most || (d2 == most && springls__place_before(x, springls__lod_place(w, w->chain[outermost])))) {
            most = d2;
            outermost = k;
        }
        if (off < middle || (off == middle && springls__place_before(x, springls__lod_place(w, w->chain[central])))) {
            middle = off;
            central = k;
        }
    }
    return most > tolerance * tolerance ? outermost : too_long ? central : -1;
}

/* Sends what lies between members i and j of a chain onto the nearer end along it. */
SPRINGLS__FN void springls__send_to_ends(springls__lod_work *w, int i, int j)
{
    const springls__v3 a = springls__lod_place(w, w->chain[i]), b = springls__lod_place(w, w->chain[j]);
    int m, to = w->chain[i];
    for (m = i + 1; m < j; m++) {
        const springls__v3 x = springls__lod_place(w, w->chain[m]);
        if (springls__length2(springls__sub(x, b)) < springls__length2(springls__sub(x, a))) to = w->chain[j];
        w->vertex[w->chain[m]].to = to;
    }
}

/* Keeps what a chain between its members i and j needs, and sends the rest onto those. */
SPRINGLS__FN void springls__split_chain(springls__lod_work *w, int i, int j, float tolerance, float length)
{
    int *end = w->chain + w->chunk->vertex_count + 2; /* a stack: later parts, behind the chain */
    int count = 0;
    for (;;) {
        const int k = springls__chain_split(w, i, j, tolerance, length);
        if (k >= 0) {
            w->vertex[w->chain[k]].role = SPRINGLS__LOD_KEPT;
            end[count++] = j;
            j = k;
            continue;
        }
        springls__send_to_ends(w, i, j);
        if (count == 0) return;
        i = j;
        j = end[--count];
    }
}

/* Follows a border from vertex i, by its neighbor `side`, as far as it may be thinned out. Returns how many vertices are in the chain then:
   it had `count`. */
SPRINGLS__FN int springls__follow_border(springls__lod_work *w, int i, int side, int count)
{
    int before = i, now = w->vertex[i].along[side];
    while (now != i && w->vertex[now].role == SPRINGLS__LOD_ON_BORDER && !w->vertex[now].visited) {
        const int *along = w->vertex[now].along;
        const int then = along[0] == before ? along[1] : along[0];
        w->vertex[now].visited = true;
        w->chain[count++] = now;
        before = now;
        now = then;
    }
    w->chain[count++] = now;
    return count;
}

/* Returns the member of a closed chain of `count` that is furthest from x; the least of those. */
SPRINGLS__FN int springls__furthest_member(const springls__lod_work *w, int count, springls__v3 x)
{
    float most = -1.0f;
    int k, best = 0;
    for (k = 0; k < count; k++) {
        const springls__v3 y = springls__lod_place(w, w->chain[k]);
        const float d2 = springls__length2(springls__sub(y, x));
        if (d2 < most || (d2 == most && !springls__place_before(y, springls__lod_place(w, w->chain[best])))) continue;
        most = d2;
        best = k;
    }
    return best;
}

/* Begins a closed chain at its least member; the last one is the first again. */
SPRINGLS__FN void springls__rotate_loop(springls__lod_work *w, int count)
{
    int k, first = 0, *copy = w->chain + count + 1;
    for (k = 1; k < count; k++)
        if (springls__place_before(springls__lod_place(w, w->chain[k]), springls__lod_place(w, w->chain[first]))) first = k;
    memcpy(copy, w->chain, (size_t)count * sizeof *copy);
    for (k = 0; k <= count; k++) w->chain[k] = copy[(first + k) % count];
}

/* Thins out a closed chain of `count` vertices: three stay at least, which the places determine. */
SPRINGLS__FN void springls__thin_loop(springls__lod_work *w, int count, float tolerance, float length)
{
    int stays[3], k;
    float most = -1.0f;
    springls__rotate_loop(w, count);
    stays[0] = 0;
    stays[1] = springls__furthest_member(w, count, springls__lod_place(w, w->chain[0]));
    stays[2] = 0;
    for (k = 1; k < count; k++) {
        const springls__v3 x = springls__lod_place(w, w->chain[k]);
        const float d2 = springls__chord_distance2(x, springls__lod_place(w, w->chain[0]), springls__lod_place(w, w->chain[stays[1]]));
        if (k == stays[1] || d2 < most
            || (d2 == most && !springls__place_before(x, springls__lod_place(w, w->chain[stays[2]])))) continue;
        most = d2;
        stays[2] = k;
    }
    for (k = 0; k < 3; k++) w->vertex[w->chain[stays[k]]].role = SPRINGLS__LOD_KEPT;
    if (stays[1] > stays[2]) {
        k = stays[1];
        stays[1] = stays[2];
        stays[2] = k;
    }
    for (k = 0; k < 3; k++) springls__split_chain(w, stays[k], k < 2 ? stays[k + 1] : count, tolerance, length);
}

/* Thins out the chain of the border that vertex i lies on. */
SPRINGLS__FN void springls__thin_chain(springls__lod_work *w, int i)
{
    const int level = w->face_level[w->vertex[i].face];
    const float tolerance = springls__lod_tolerance(level) * w->unit, length = springls__lod_length(w, level) * w->unit;
    int count, k;
    w->vertex[i].visited = true;
    count = springls__follow_border(w, i, 0, 0);
    if (w->chain[count - 1] == i) { /* all the way round */
        springls__thin_loop(w, count, tolerance, length);
        return;
    }
    for (k = 0; k < count / 2; k++) {
        const int other = w->chain[count - 1 - k];
        w->chain[count - 1 - k] = w->chain[k];
        w->chain[k] = other;
    }
    w->chain[count++] = i;
    count = springls__follow_border(w, i, 1, count);
    springls__split_chain(w, 0, count - 1, tolerance, length);
}

/* Thins out all borders, whatever becomes of the triangles: the other side does the same. */
SPRINGLS__FN void springls__thin_borders(springls__lod_work *w)
{
    int i, c;
    for (i = 0; i < w->chunk->vertex_count; i++)
        if (w->vertex[i].role == SPRINGLS__LOD_ON_BORDER && !w->vertex[i].visited) springls__thin_chain(w, i);
    for (c = 0; c < 3 * w->chunk->triangle_count; c++)
        if (w->corner[c] >= 0) w->corner[c] = w->vertex[w->corner[c]].to;
}

/* ---- quadrics ---- */

SPRINGLS__FN void springls__add_plane(springls__quadric *q, springls__v3 n, float d)
{
    q->xx += n.x * n.x;
    q->xy += n.x * n.y;
    q->xz += n.x * n.z;
    q->yy += n.y * n.y;
    q->yz += n.y * n.z;
    q->zz += n.z * n.z;
    q->x += n.x * d;
    q->y += n.y * d;
    q->z += n.z * d;
    q->one += d * d;
}

SPRINGLS__FN void springls__add_quadric(springls__quadric *q, const springls__quadric *other)
{
    q->xx += other->xx;
    q->xy += other->xy;
    q->xz += other->xz;
    q->yy += other->yy;
    q->yz += other->yz;
    q->zz += other->zz;
    q->x += other->x;
    q->y += other->y;
    q->z += other->z;
    q->one += other->one;
}

/* Returns the sum of squared distances of x. */
SPRINGLS__FN float springls__quadric_at(const springls__quadric *q, springls__v3 x)
{
    return q->xx * x.x * x.x + q->yy * x.y * x.y + q->zz * x.z * x.z + q->one
         + 2.0f * (q->xy * x.x * x.y + q->xz * x.x * x.z + q->yz * x.y * x.z + q->x * x.x + q->y * x.y + q->z * x.z);
}

SPRINGLS__FN springls__tri springls__lod_triangle(const springls__lod_work *w, int a, int b, int c)
{
    springls__tri t;
    t.a = w->vertex[a].x;
    t.b = w->vertex[b].x;
    t.c = w->vertex[c].x;
    return t;
}

/* Gives each vertex the planes of its triangles, of the chunk as it is. */
SPRINGLS__FN void springls__find_quadrics(springls__lod_work *w)
{
    int t, k;
    for (t = 0; t < w->chunk->triangle_count; t++) {
        const uint16_t *c = w->chunk->triangles + 3 * t;
        const springls__v3 n = springls__tri_normal(springls__lod_triangle(w, c[0], c[1], c[2]));
        const float d = -springls__dot(n, w->vertex[c[0]].x);
        for (k = 0; k < 3; k++) springls__add_plane(&w->vertex[w->vertex[c[k]].to].quadric, n, d);
    }
}

/* ---- collapses of inner vertices ---- */

/* Writes the neighbors of a vertex, the next of each triangle. Returns how many; 0: they are no single fan, or too many. */
SPRINGLS__FN int springls__ring_of(springls__lod_work *w, int v, int ring[SPRINGLS__LOD_RING])
{
    const int mark = ++w->mark;
    int n = 0, k, c = springls__living_corner(w, w->vertex[v].first_corner);
    for (; c >= 0; c = springls__living_corner(w, w->next[c])) {
        const int next = w->corner[springls__next_of_triangle(c)];
        if (n == SPRINGLS__LOD_RING || w->vertex[next].mark == mark) return 0;
        w->vertex[next].mark = mark;
        ring[n++] = next;
    }
    c = springls__living_corner(w, w->vertex[v].first_corner);
    for (k = 0; c >= 0; c = springls__living_corner(w, w->next[c]), k++) /* every neighbor is a last one too */
        if (w->vertex[w->corner[springls__next_of_triangle(springls__next_of_triangle(c))]].mark != mark) return 0;
    return n < 3 ? 0 : n;
}

/* Returns how many neighbors u has in common with the vertex whose ring springls__ring_of has just written. */
SPRINGLS__FN int springls__count_common(springls__lod_work *w, int u)
{
    const int mark = w->mark, counted = w->mark + 1;
    int n = 0, k, c, other[2 * SPRINGLS__LOD_RING];
    for (c = springls__living_corner(w, w->vertex[u].first_corner); c >= 0; c = springls__living_corner(w, w->next[c])) {
        const int next = springls__next_of_triangle(c);
        int m;
        for (m = 0; m < 2; m++) {
            const int x = w->corner[m ? springls__next_of_triangle(next) : next];
            if (w->vertex[x].mark != mark) continue;
            if (n < 2 * SPRINGLS__LOD_RING) other[n++] = x;
            w->vertex[x].mark = counted;
        }
    }
    for (k = 0; k < n; k++) w->vertex[other[k]].mark = mark;
    return n;
}

/* Returns whether v may go onto u: the surface stays one, no triangle turns over or becomes a needle, and no edge is too long. */
SPRINGLS__FN bool springls__may_collapse(springls__lod_work *w, int v, int u, const int *ring, int count)
{
    const float length = springls__lod_length(w, w->level);
    int k, c;
    for (k = 0; k < count; k++)
        if (springls__length2(springls__sub(w->vertex[ring[k]].x, w->vertex[u].x)) > length * length) return false;
    for (c = springls__living_corner(w, w->vertex[v].first_corner); c >= 0; c = springls__living_corner(w, w->next[c])) {
        const int a = w->corner[springls__next_of_triangle(c)], b = w->corner[springls__next_of_triangle(springls__next_of_triangle(c))];
        springls__v3 before, after;
        float cosine, scale;
        if (a == u || b == u) continue;
        before = springls__tri_area2(springls__lod_triangle(w, v, a, b));
        after = springls__tri_area2(springls__lod_triangle(w, u, a, b));
        cosine = springls__dot(before, after);
        scale = springls__length2(before) * springls__length2(after);
        if (!(cosine > 0.0f && cosine * cosine > 0.1f * scale)) return false;
    }
    return springls__count_common(w, u) == 2;
}

/* Moves the corners of v to u. */
SPRINGLS__FN void springls__collapse(springls__lod_work *w, int v, int u)
{
    int c = w->vertex[v].first_corner, next;
    for (; c >= 0; c = next) {
        const int a = springls__next_of_triangle(c), b = springls__next_of_triangle(a);
        next = w->next[c];
        if (w->corner[c] < 0) continue;
        if (w->corner[a] == u || w->corner[b] == u) {
            springls__kill_triangle(w, c / 3);
            continue;
        }
        w->corner[c] = u;
        w->next[c] = w->vertex[u].first_corner;
        w->vertex[u].first_corner = c;
    }
    w->vertex[v].first_corner = -1;
    w->vertex[v].to = u;
    springls__add_quadric(&w->vertex[u].quadric, &w->vertex[v].quadric);
}

/* Returns the neighbor of v onto which it may go at the least sum of squares, at most `limit`; -1: none. */
SPRINGLS__FN int springls__find_target(springls__lod_work *w, int v, const int *ring, int count, float limit)
{
    float cost[SPRINGLS__LOD_RING];
    int k, best;
    for (k = 0; k < count; k++)
        cost[k] = springls__quadric_at(&w->vertex[v].quadric, w->vertex[ring[k]].x)
                + springls__quadric_at(&w->vertex[ring[k]].quadric, w->vertex[ring[k]].x);
    for (;;) {
        for (best = -1, k = 0; k < count; k++)
            if (cost[k] <= limit && (best < 0 || cost[k] < cost[best])) best = k;
        if (best < 0) return -1;
        if (springls__may_collapse(w, v, ring[best], ring, count)) return ring[best];
        cost[best] = FLT_MAX;
    }
}

/* Collapses inner vertices apart from each other, once over all. Returns whether there was one. */
SPRINGLS__FN bool springls__collapse_pass(springls__lod_work *w, int round, int pass, float limit)
{
    int ring[SPRINGLS__LOD_RING], i, k;
    bool some = false;
    for (i = 0; i < w->chunk->vertex_count; i++) {
        springls__lod_vertex *v = &w->vertex[i];
        int count, u;
        if (v->role != SPRINGLS__LOD_INNER || v->to != i || v->locked || v->tried == round || v->moved == pass) continue;
        v->tried = round;
        count = springls__ring_of(w, i, ring);
        if (count == 0 || (u = springls__find_target(w, i, ring, count, limit)) < 0) continue;
        springls__collapse(w, i, u);
        for (k = 0; k < count; k++) {
            w->vertex[ring[k]].tried = -1;
            w->vertex[ring[k]].moved = pass;
        }
        some = true;
    }
    return some;
}

SPRINGLS__FN void springls__collapse_inner(springls__lod_work *w)
{
    const float tolerance = springls__lod_tolerance(w->level);
    float limit = 8.0f * tolerance * tolerance; /* of sums over planes, many of which are nearly the same */
    int round, pass = 0;
    for (round = 1; round < SPRINGLS__LOD_ROUNDS; round++) limit *= 0.25f;
    for (round = 0; round < SPRINGLS__LOD_ROUNDS; round++, limit *= 4.0f)
        while (springls__collapse_pass(w, round, pass, limit)) pass++;
}

/* ---- errors ---- */

SPRINGLS__FN int springls__lod_root(const springls__lod_work *w, int i)
{
    while (w->vertex[i].to != i) i = w->vertex[i].to;
    return i;
}

/* The place on the new triangles that is closest to a vertex: its squared distance, corners and weights. */
typedef struct springls__lod_hit { float d2, bary[3]; int corner[3]; } springls__lod_hit;

/* Tries the triangles around vertex i. */
SPRINGLS__FN void springls__closest_around(const springls__lod_work *w, int i, springls__v3 x, springls__lod_hit *best)
{
    int c = springls__living_corner(w, w->vertex[i].first_corner);
    for (; c >= 0; c = springls__living_corner(w, w->next[c])) {
        const int *corner = w->corner + c / 3 * 3;
        const springls__tri_hit hit = springls__tri_closest(springls__lod_triangle(w, corner[0], corner[1], corner[2]), x);
        if (hit.d2 >= best->d2) continue;
        best->d2 = hit.d2;
        memcpy(best->bary, hit.bary, sizeof best->bary);
        memcpy(best->corner, corner, sizeof best->corner);
    }
}

/* Finds the closest place to a vertex of the chunk: around what it has become, or around the neighbors of that. */
SPRINGLS__FN springls__lod_hit springls__closest_to_vertex(springls__lod_work *w, int i, float tolerance)
{
    const int root = springls__lod_root(w, i);
    springls__lod_hit best;
    int c;
    memset(&best, 0, sizeof best);
    best.d2 = FLT_MAX;
    springls__closest_around(w, root, w->vertex[i].x, &best);
    if (best.d2 <= tolerance * tolerance) return best;
    for (c = springls__living_corner(w, w->vertex[root].first_corner); c >= 0; c = springls__living_corner(w, w->next[c]))
        springls__closest_around(w, w->corner[springls__next_of_triangle(c)], w->vertex[i].x, &best);
    return best;
}

/* Takes the edge between vertices a and b as the closest place to vertex i, where it is closer. */
SPRINGLS__FN void springls__closest_on_edge(const springls__lod_work *w, int i, int a, int b, springls__lod_hit *best)
{
    const springls__v3 x = w->vertex[i].x, from = w->vertex[a].x, along = springls__sub(w->vertex[b].x, from);
    const float d2 = springls__chord_distance2(x, from, w->vertex[b].x), l2 = springls__length2(along);
    if (d2 >= best->d2) return;
    best->d2 = d2;
    best->bary[1] = l2 > 0.0f ? springls__clamp(springls__dot(springls__sub(x, from), along) / l2, 0.0f, 1.0f) : 0.0f;
    best->bary[0] = 1.0f - best->bary[1];
    best->bary[2] = 0.0f;
    best->corner[0] = best->corner[2] = a;
    best->corner[1] = b;
}

/* Tries the edges that borders have kept: where the part of the chunk around a vertex has become flat, the surface goes on there beyond
   the border. */
SPRINGLS__FN void springls__closest_on_border(const springls__lod_work *w, int i, springls__lod_hit *best)
{
    int k, side;
    for (k = 0; k < w->chunk->vertex_count; k++)
        for (side = 0; side < springls__imin(w->vertex[k].degree, 2); side++)
            springls__closest_on_edge(w, i, w->vertex[k].to, w->vertex[w->vertex[k].along[side]].to, best);
}

/* Returns how far the correspondence that is interpolated at a place is from that of vertex i, world units. */
SPRINGLS__FN float springls__lod_material_error(const springls__lod_work *w, int i, const springls__lod_hit *hit)
{
    const float *a = w->chunk->correspondences;
    springls__v3 sum = springls__scale(springls__load3(a + 3 * i), -1.0f);
    int k;
    for (k = 0; k < 3; k++) sum = springls__mad(sum, springls__load3(a + 3 * hit->corner[k]), hit->bary[k]);
    return springls__length(sum);
}

/* Measures the errors. Inner vertices that are beyond the tolerance are locked; returns whether there were some. */
SPRINGLS__FN bool springls__measure_lod(springls__lod_work *w, springls_lod *lod)
{
    const float tolerance = springls__lod_tolerance(w->level);
    bool beyond = false;
    int i;
    lod->error = lod->material_error = 0.0f;
    for (i = 0; i < w->chunk->vertex_count; i++) {
        springls__lod_vertex *v = &w->vertex[i];
        springls__lod_hit hit;
        if (v->to == i && springls__living_corner(w, v->first_corner) >= 0) continue;
        hit = springls__closest_to_vertex(w, i, tolerance);
        if (hit.d2 > tolerance * tolerance) springls__closest_on_border(w, i, &hit);
        if (hit.d2 > tolerance * tolerance && v->role == SPRINGLS__LOD_INNER && !v->locked) v->locked = beyond = true;
        if (hit.d2 == FLT_MAX) continue;
        lod->error = springls__max(lod->error, springls__sqrt(hit.d2) * w->unit);
        if (w->chunk->correspondences)
            lod->material_error = springls__max(lod->material_error, springls__lod_material_error(w, i, &hit));
    }
    return beyond;
}

/* ---- a chunk ---- */

SPRINGLS__FN void springls__begin_lod(springls__lod_work *w)
{
    const springls__v3 origin = springls__lod_place(w, 0);
    int i, c;
    for (i = 0; i < w->chunk->vertex_count; i++) {
        springls__lod_vertex *v = &w->vertex[i];
        const bool locked = v->locked;
        memset(v, 0, sizeof *v);
        v->x = springls__scale(springls__sub(springls__lod_place(w, i), origin), 1.0f / w->unit);
        v->to = i;
        v->tried = v->moved = -1;
        v->locked = locked;
    }
    for (c = 0; c < 3 * w->chunk->triangle_count; c++) w->corner[c] = w->chunk->triangles[c];
    w->mark = 0;
    springls__link_corners(w);
}

/* Finds the triangles of a level once, with the vertices that are locked. */
SPRINGLS__FN void springls__try_lod(springls__lod_work *w, bool inner)
{
    springls__begin_lod(w);
    springls__find_border(w);
    springls__thin_borders(w);
    springls__link_corners(w);
    springls__find_quadrics(w);
    if (inner) springls__collapse_inner(w);
}

SPRINGLS__FN void springls__find_lod(springls__lod_work *w, springls_lod *lod)
{
    int i, t, k, n = 0, tries = 0;
    for (i = 0; i < w->chunk->vertex_count; i++) w->vertex[i].locked = false;
    do springls__try_lod(w, tries++ < SPRINGLS__LOD_TRIES);
    while (springls__measure_lod(w, lod) && tries <= SPRINGLS__LOD_TRIES);
    for (t = 0; t < w->chunk->triangle_count; t++)
        for (k = 0; k < 3 && w->corner[3 * t] >= 0; k++) lod->triangles[n++] = (uint16_t)w->corner[3 * t + k];
    lod->triangle_count = n / 3;
}

/* ---- the call ---- */

/* What a batch of chunks is worked on with. memory: of chunk i from start[i] on. */
typedef struct springls__lod_job {
    const springls_context *ctx;
    springls_lod *lod;
    const double *to_lattice;
    char *memory;
    size_t start[SPRINGLS__LOD_BATCH + 1];
} springls__lod_job;

SPRINGLS__FN size_t springls__lod_bytes(const springls_lod *lod)
{
    const size_t vertices = (size_t)lod->chunk->vertex_count, corners = 3 * (size_t)lod->chunk->triangle_count;
    return lod->level == 0 ? 0 : vertices * sizeof(springls__lod_vertex) + (2 * corners + 2 * vertices + 4) * sizeof(int);
}

SPRINGLS__FN void springls__lod_of_chunk(const springls__lod_job *job, springls_lod *lod, char *memory)
{
    springls__lod_work w;
    const size_t vertices = (size_t)lod->chunk->vertex_count, corners = 3 * (size_t)lod->chunk->triangle_count;
    int face;
    memset(&w, 0, sizeof w);
    w.chunk = lod->chunk;
    w.to_lattice = job->to_lattice;
    w.level = lod->level;
    w.unit = job->ctx->smallest_spacing;
    w.stretch = job->ctx->largest_spacing / job->ctx->smallest_spacing;
    for (face = 0; face < 6; face++) w.face_level[face] = springls__imin(lod->level, lod->neighbors[face]);
    w.vertex = (springls__lod_vertex *)(void *)memory;
    w.corner = (int *)(void *)(w.vertex + vertices);
    w.next = w.corner + corners;
    w.chain = w.next + corners;
    springls__find_lod(&w, lod);
}

SPRINGLS__FN void springls__lod_task(void *arg, int begin, int end)
{
    const springls__lod_job *job = (const springls__lod_job *)arg;
    for (; begin < end; begin++) {
        springls_lod *lod = job->lod + begin;
        lod->error = lod->material_error = 0.0f;
        lod->triangle_count = lod->chunk->triangle_count;
        if (lod->chunk->triangle_count == 0) continue;
        if (lod->level > 0) springls__lod_of_chunk(job, lod, job->memory + job->start[begin]);
        else memcpy(lod->triangles, lod->chunk->triangles, 3 * (size_t)lod->chunk->triangle_count * sizeof(uint16_t));
    }
}

/* Returns why a request is refused; NULL: it is not. */
SPRINGLS__FN const char *springls__lod_fault(const springls_lod *lod)
{
    const springls_chunk *chunk = lod->chunk;
    int i;
    if (!chunk || chunk->vertex_count < 0 || chunk->triangle_count < 0) return "there is no chunk";
    if (chunk->vertex_count > 65536 || chunk->triangle_count > INT32_MAX / 3) return "there are too many vertices or triangles";
    if (lod->level < 0 || lod->level >= SPRINGLS__LOD_LEVELS) return "the level is not 0, 1, 2 or 3";
    for (i = 0; i < 6; i++)
        if (lod->neighbors[i] < 0 || lod->neighbors[i] >= SPRINGLS__LOD_LEVELS) return "the level of a neighbor is not 0, 1, 2 or 3";
    if (chunk->triangle_count == 0) return NULL;
    if (!chunk->positions || !chunk->triangles || !lod->triangles) return "an array is NULL";
    for (i = 0; i < 3 * chunk->triangle_count; i++)
        if (chunk->triangles[i] >= chunk->vertex_count) return "an index is out of range";
    for (i = 0; i < 3 * chunk->vertex_count; i++)
        if (!springls__finite_float(chunk->positions[i])) return "a position is not finite";
    for (i = 0; chunk->correspondences && i < 3 * chunk->vertex_count; i++)
        if (!springls__finite_float(chunk->correspondences[i])) return "a correspondence is not finite";
    return NULL;
}

/* Finds where the memory of each chunk of a batch starts. Returns how much all need. */
SPRINGLS__FN size_t springls__lod_starts(springls__lod_job *job, int count)
{
    int i;
    job->start[0] = 0;
    for (i = 0; i < count; i++) job->start[i + 1] = job->start[i] + ((springls__lod_bytes(&job->lod[i]) + 15u) & ~(size_t)15u);
    return job->start[count];
}

/* Works on all chunks, in memory for the largest batch: if there is none, nothing has been written. */
SPRINGLS__FN springls_status springls__lod_batches(springls_context *ctx, springls__lod_job *job, springls_lod *lod, int count)
{
    size_t most = 0, bytes;
    int i;
    for (i = 0; i < count; i += springls__imin(SPRINGLS__LOD_BATCH, count - i)) {
        job->lod = lod + i;
        bytes = springls__lod_starts(job, springls__imin(SPRINGLS__LOD_BATCH, count - i));
        if (bytes > most) most = bytes;
    }
    job->memory = (char *)springls__allocate(ctx, most + 1);
    if (!job->memory) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "chunks_lod: out of memory");
    for (i = 0; i < count; i += springls__imin(SPRINGLS__LOD_BATCH, count - i)) {
        const int batch = springls__imin(SPRINGLS__LOD_BATCH, count - i);
        job->lod = lod + i;
        springls__lod_starts(job, batch);
        springls__parallel(ctx, batch, 1, springls__lod_task, job);
    }
    springls__release(ctx, job->memory, most + 1);
    return SPRINGLS_OK;
}

SPRINGLS__CHUNKS_API springls_status springls_chunks_lod(springls_context *ctx, springls_lod *lod, int count)
{
    springls__lod_job job;
    springls__window lattice;
    int i;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (count < 0 || (!lod && count > 0)) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "chunks_lod: a NULL or a negative count");
    for (i = 0; i < count; i++) {
        const char *fault = springls__lod_fault(&lod[i]);
        if (fault) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "chunks_lod: chunk %d of the list: %s", i, fault);
    }
    memset(&job, 0, sizeof job);
    job.ctx = ctx;
    lattice = ctx->window;
    springls__place_window(ctx, &lattice, springls__unmoved);
    job.to_lattice = lattice.to_voxel;
    return springls__lod_batches(ctx, &job, lod, count);
}

#endif
