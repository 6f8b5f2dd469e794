/* neighbors.h - the nearest edges of every springl vertex (section 4.8): at most max_neighbors springls within R, the
   closest edge of each, nearest first, ties by index. */
#ifndef SPRINGLS__KERNEL_MODEL_NEIGHBORS_H
#define SPRINGLS__KERNEL_MODEL_NEIGHBORS_H

#include "cell_list.h"
#include "model.h"
#include "neighborhood.h"

/* Inserts (d2, code) into a list of at most `room`, ascending by d2, equal ones by code; returns the new length. */
SPRINGLS__MATHS int springls__insert_nearest(float *d2s, SPRINGLS__GLOBAL int *codes, int length, int room, float d2, int code)
{
    int i = length < room ? length : room - 1;
    if (length == room && (d2s[i] < d2 || (d2s[i] == d2 && codes[i] < code))) return length;
    for (; i > 0 && (d2s[i - 1] > d2 || (d2s[i - 1] == d2 && codes[i - 1] > code)); i--) {
        d2s[i] = d2s[i - 1];
        codes[i] = codes[i - 1];
    }
    d2s[i] = d2;
    codes[i] = code;
    return length < room ? length + 1 : room;
}

/* Finds the edge of springl o nearest to each of three points (x, y, z) within the radius, one point a lane: its number (-1: none)
   and its squared distance. */
SPRINGLS__MATHS void springls__nearest_edges(SPRINGLS__GLOBAL const springls__springl *o, const float x[8], const float y[8],
                                             const float z[8], float radius2, float d2[8], float edge[8])
{
    int e, m;
    for (m = 0; m < 3; m += SPRINGLS__LANES) {
        springls__vec3 at = springls__vec_load_v3(x + m, y + m, z + m);
        springls__vec best = springls__vec_broadcast(radius2), found = springls__vec_broadcast(-1.0f);
        for (e = 0; e < 3; e++) {
            springls__v3 a = o->q[e], ab = springls__sub(o->q[e == 2 ? 0 : e + 1], a);
            springls__vec d = springls__vec_segment_distance2(at, a, ab, o->inverse_edge2[e]);
            springls__vmask nearer = d < best;
            best = springls__vec_select(nearer, d, best);
            found = springls__vec_select(nearer, springls__vec_broadcast((float)e), found);
        }
        springls__vec_store(d2 + m, best);
        springls__vec_store(edge + m, found);
    }
}

/* Returns true when springl `other` is of another sheet, side or body than springl i with normal n. */
SPRINGLS__MATHS bool springls__is_other_sheet(const springls__model *model, int i, springls__v3 n, int other)
{
    springls__springl o = model->set.s[other];
    if (springls__of_two_contact_bodies(model, i, other)) return true;
    if (springls__dot(n, springls__tri_area2(springls__springl_tri(o))) > 0.0f) return false;
    if (model->params.relax_same_side) return true;
    return model->params.keep_thin
        && springls__across_gap(springls__sub(o.p, model->set.s[i].p), n, springls__springl_normal(o));
}

/* Writes row[MAX_NEIGHBORS m + k] = 3 * springl + edge of the k-th nearest neighbour of vertex m of springl n; -1 after the
   last. */
SPRINGLS__MATHS void springls__find_neighbors(const springls__model *model, int n, SPRINGLS__GLOBAL int *row)
{
    SPRINGLS__GLOBAL const springls__springl *all = model->set.s, *self = &all[n];
    const float radius = model->params.neighbor_radius, radius2 = radius * radius;
    const int room = model->params.max_neighbors;
    SPRINGLS__GLOBAL const springls__v3 *q = self->q;
    springls__v3 normal = springls__springl_normal(*self);
    springls__cell_walk walk = springls__cell_walk_around(model, self->p, radius + self->bounding_radius);
    float x[8], y[8], z[8], d2s[SPRINGLS__NEIGHBOR_ROW], d2[8], edge[8];
    int length[3] = { 0, 0, 0 }, other, m;
    for (m = 0; m < 8; m++) {
        x[m] = m < 3 ? q[m].x : 0.0f;
        y[m] = m < 3 ? q[m].y : 0.0f;
        z[m] = m < 3 ? q[m].z : 0.0f;
    }
    for (m = 0; m < SPRINGLS__NEIGHBOR_ROW; m++) row[m] = -1;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *o = &all[other];
        float within = radius + o->bounding_radius + self->bounding_radius;
        if (other == n) continue;
        if (springls__length2(springls__sub(o->p, self->p)) > within * within) continue;
        within = radius + o->bounding_radius;
        if (springls__length2(springls__sub(o->p, q[0])) > within * within
            && springls__length2(springls__sub(o->p, q[1])) > within * within
            && springls__length2(springls__sub(o->p, q[2])) > within * within) continue;
        if (springls__is_other_sheet(model, n, normal, other)) continue;
        springls__nearest_edges(o, x, y, z, radius2, d2, edge);
        for (m = 0; m < 3; m++)
            if (edge[m] >= 0.0f)
                length[m] = springls__insert_nearest(d2s + SPRINGLS__MAX_NEIGHBORS * m, row + SPRINGLS__MAX_NEIGHBORS * m,
                                                     length[m], room, d2[m], 3 * other + (int)edge[m]);
    }
}

/* The first edge of a springl whose neighbors have not been found: it was asleep. */
#define SPRINGLS__NOT_FOUND (-2)

/* Writes a row of a springl whose neighbors are not found: all of it, since rows are copied whole. */
SPRINGLS__MATHS void springls__no_neighbors_yet(SPRINGLS__GLOBAL int *row)
{
    int m;
    row[0] = SPRINGLS__NOT_FOUND;
    for (m = 1; m < SPRINGLS__NEIGHBOR_ROW; m++) row[m] = -1;
}

/* Finds the neighbors of springl i unless it is asleep; with args.neighbors.missing, unless they have been found. */
SPRINGLS__MATHS void springls__neighbors_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL int *row = model->cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW;
    if (args.neighbors.missing && row[0] != SPRINGLS__NOT_FOUND) return;
    if (springls__is_asleep(model, i)) springls__no_neighbors_yet(row);
    else springls__find_neighbors(model, i, row);
}

#endif
