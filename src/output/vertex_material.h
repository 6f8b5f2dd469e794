/* vertex_material.h - finds the correspondences of vertices that lie close to each other, with the bits of springls__correspondence_at, and
   their nearest springls, with those of springls__nearest_springl, unless they are known: several vertices at once, over one list of
   springls. */
#ifndef SPRINGLS__OUTPUT_VERTEX_MATERIAL_H
#define SPRINGLS__OUTPUT_VERTEX_MATERIAL_H

#include "../../kernels_embed/output/isosurface.h"
#include "../runtime/context.h"
#include "../model/transform.h"

enum { SPRINGLS__VERTEX_CANDIDATES = 1024 }; /* a multiple of SPRINGLS__LANES */

enum { SPRINGLS__CLOSE = 11 }; /* voxels: how far vertices that share a list may lie from each other along an axis */

/* The springls that may count for some of the vertices, in the order of the cells, and in `list` the numbers of those that may
   count for a group of its vertices. reach: voxels from a springl's particle within which it may count. */
typedef struct springls__candidates {
    float x[SPRINGLS__VERTEX_CANDIDATES], y[SPRINGLS__VERTEX_CANDIDATES], z[SPRINGLS__VERTEX_CANDIDATES]; /* particles */
    float reach[SPRINGLS__VERTEX_CANDIDATES], bounding_radius[SPRINGLS__VERTEX_CANDIDATES];
    float height[SPRINGLS__VERTEX_CANDIDATES]; /* of the triangle's plane above the particle */
    springls__v3 n[SPRINGLS__VERTEX_CANDIDATES], a[SPRINGLS__VERTEX_CANDIDATES];
    int springl[SPRINGLS__VERTEX_CANDIDATES], list[SPRINGLS__VERTEX_CANDIDATES];
    int count, listed;
    float sample[3 * SPRINGLS__LANES * SPRINGLS__VERTEX_CANDIDATES]; /* of those that are listed, as the fits take them */
    uint16_t order[3 * SPRINGLS__TILE_VOXELS]; /* numbers of the vertices, group by group: those of a group lie close together */
} springls__candidates;

/* A few vertices, one a lane; nearest: the candidates nearest to them, or -1. */
typedef struct springls__vertex_group {
    springls__vec3 x;
    springls__box box;
    int nearest[SPRINGLS__LANES];
} springls__vertex_group;

/* Returns the distance from its particle within which a springl may be nearest to a vertex, or take part in a fit. */
SPRINGLS__FN float springls__reach_of(float bounding_radius)
{
    return springls__max(SPRINGLS__CORRESPONDENCE_RADIUS, SPRINGLS__MATERIAL_RADIUS + bounding_radius);
}

/* Lists the candidates of a box. Returns false if each vertex needs a search of its own: there are too many, some at a sharp
   edge, or of bodies that stay apart. */
SPRINGLS__FN bool springls__find_candidates(const springls__model *model, springls__box box, springls__candidates *c)
{
    const springls__box around = springls__box_widened(box, springls__reach_of(model->cells.bounding_radius));
    springls__cell_walk walk = springls__cell_walk_begin(model, around.lower, around.upper);
    int i;
    c->count = 0;
    if (model->params.contact == SPRINGLS_CONTACT_SEPARATE) return false;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0) {
        const springls__springl *s = &model->set.s[i];
        if (!springls__box_contains(springls__box_widened(box, springls__reach_of(s->bounding_radius)), s->p)) continue;
        if (c->count == SPRINGLS__VERTEX_CANDIDATES || springls__at_edge(model, i)) return false;
        c->x[c->count] = s->p.x;
        c->y[c->count] = s->p.y;
        c->z[c->count] = s->p.z;
        c->reach[c->count] = springls__reach_of(s->bounding_radius);
        c->n[c->count] = springls__springl_normal(*s);
        c->a[c->count] = model->set.a[i];
        c->bounding_radius[c->count] = s->bounding_radius;
        c->height[c->count] = springls__dot(c->n[c->count], springls__sub(springls__springl_tri(*s).a, s->p));
        c->springl[c->count++] = i;
    }
    for (i = c->count; i % SPRINGLS__LANES; i++) c->x[i] = c->y[i] = c->z[i] = c->reach[i] = 0.0f; /* lanes that are not taken */
    return true;
}

/* Returns a vector in each lane. */
SPRINGLS__FN springls__vec3 springls__vectors_of(const springls__v3 v[SPRINGLS__LANES])
{
    float x[3][SPRINGLS__LANES];
    int lane;
    for (lane = 0; lane < SPRINGLS__LANES; lane++) {
        x[0][lane] = v[lane].x;
        x[1][lane] = v[lane].y;
        x[2][lane] = v[lane].z;
    }
    return springls__vec_load_v3(x[0], x[1], x[2]);
}

/* Makes a group of vertices of the given numbers; the last one fills the lanes that are left. */
SPRINGLS__FN springls__vertex_group springls__vertex_group_of(const springls__v3 *vertex, const uint16_t *number, int count)
{
    springls__vertex_group group;
    springls__v3 v[SPRINGLS__LANES];
    int lane;
    group.box = springls__box_empty();
    for (lane = 0; lane < SPRINGLS__LANES; lane++) {
        v[lane] = vertex[number[springls__imin(lane, count - 1)]];
        group.box = springls__box_add(group.box, v[lane]);
        group.nearest[lane] = -1;
    }
    group.x = springls__vectors_of(v);
    return group;
}

/* Orders vertices by cells of two voxels, by counting, so that groups have short lists. lower: of their box. */
SPRINGLS__FN void springls__order_vertices(const springls__v3 *vertex, int count, springls__v3 lower, uint16_t *order)
{
    enum { SIDE = SPRINGLS__CLOSE / 2 + 1, CELLS = SIDE * SIDE * SIDE };
    int first[CELLS + 1], pass, i; /* first: place in the order of a cell's next vertex */
    memset(first, 0, sizeof first);
    for (pass = 0; pass < 2; pass++) {
        for (i = 0; i < count; i++) {
            const springls__v3 d = springls__sub(vertex[i], lower);
            int *cell = first + (int)(0.5f * d.x) + SIDE * ((int)(0.5f * d.y) + SIDE * (int)(0.5f * d.z));
            if (pass) order[(*cell)++] = (uint16_t)i;
            else cell[1]++;
        }
        for (i = 0; pass == 0 && i < CELLS; i++) first[i + 1] += first[i];
    }
}

/* Returns the squares of how far numbers are beyond the interval from lower to upper. */
SPRINGLS__FN springls__vec springls__beyond2(springls__vec x, float lower, float upper)
{
    const springls__vec beyond = springls__vec_max(springls__vec_max(lower - x, x - upper), springls__vec_broadcast(0.0f));
    return beyond * beyond;
}

/* Lists the candidates whose reach the group's box is in. */
SPRINGLS__FN void springls__list_candidates(const springls__vertex_group *group, springls__candidates *c)
{
    const float slack = 1e-3f; /* more than all rounding errors */
    const springls__v3 lo = group->box.lower, hi = group->box.upper;
    float within[SPRINGLS__LANES];
    int k, lane;
    c->listed = 0;
    for (k = 0; k < c->count; k += SPRINGLS__LANES) {
        springls__vec d2 = springls__beyond2(springls__vec_load(c->x + k), lo.x, hi.x)
                         + springls__beyond2(springls__vec_load(c->y + k), lo.y, hi.y)
                         + springls__beyond2(springls__vec_load(c->z + k), lo.z, hi.z);
        springls__vec reach = springls__vec_load(c->reach + k) + slack;
        if (!springls__vec_any(d2 <= reach * reach)) continue;
        springls__vec_store(within, reach * reach - d2);
        for (lane = 0; lane < SPRINGLS__LANES; lane++) {
            c->list[c->listed] = k + lane;
            c->listed += (k + lane < c->count) & (within[lane] >= 0.0f);
        }
    }
}

/* Returns the particle of candidate k, in every lane. */
SPRINGLS__FN springls__vec3 springls__particle_of(const springls__candidates *c, int k)
{
    return springls__vec_broadcast3(springls__v3_make(c->x[k], c->y[k], c->z[k]));
}

/* Squared distances to the nearest springls so far, and the distances beyond which none can be nearer. */
typedef struct springls__nearest_search { float best[SPRINGLS__LANES], limit[SPRINGLS__LANES]; } springls__nearest_search;

/* Assigns candidate k to the vertices that have none nearer; of two as near they keep the springl of the lower index. */
SPRINGLS__FN void springls__try_candidate(const springls__model *model, const springls__candidates *c, int k,
                                          springls__vertex_group *group, springls__nearest_search *search)
{
    const springls__tri_plan plan = springls__tri_plan_make(springls__springl_tri(model->set.s[c->springl[k]]));
    float d2[SPRINGLS__LANES];
    int lane;
    springls__vec_store(d2, springls__vec_tri_distance2(&plan, group->x));
    for (lane = 0; lane < SPRINGLS__LANES; lane++) {
        const int nearest = group->nearest[lane];
        if (d2[lane] > search->best[lane]) continue;
        if (d2[lane] == search->best[lane] && (nearest < 0 || c->springl[k] >= c->springl[nearest])) continue;
        group->nearest[lane] = k;
        search->best[lane] = d2[lane];
        search->limit[lane] = springls__nearest_limit(d2[lane], SPRINGLS__MATERIAL_RADIUS);
    }
}

/* Returns the candidates whose particles are nearest to the vertices, as floats, which numbers as small fit in; at least one is
   listed. Leaves the squared distances to all that are listed in c->sample. */
SPRINGLS__FN springls__vec springls__nearest_particles(springls__candidates *c, springls__vec3 x)
{
    springls__vec best = springls__vec_broadcast(FLT_MAX), nearest = springls__vec_broadcast(0.0f);
    int i;
    for (i = 0; i < c->listed; i++) {
        const springls__vec d2 = springls__vec_length2(springls__vec_sub(springls__particle_of(c, c->list[i]), x));
        springls__vec_store(c->sample + SPRINGLS__LANES * i, d2);
        nearest = springls__vec_select(d2 < best, springls__vec_broadcast((float)c->list[i]), nearest);
        best = springls__vec_min(d2, best);
    }
    return nearest;
}

/* Returns where vertices are within the limit of the plane of candidate k's triangle. */
SPRINGLS__FN springls__vmask springls__reaches_plane(const springls__candidates *c, int k, springls__vec3 x, springls__vec limit)
{
    const springls__vec3 d = springls__vec_sub(x, springls__particle_of(c, k));
    return springls__vec_fabs(springls__vec_dot(d, springls__vec_broadcast3(c->n[k])) - c->height[k]) <= limit;
}

/* Finds the candidates nearest to the vertices. Those whose particles are nearest come first: after them few others can be
   nearer. */
SPRINGLS__FN void springls__find_nearest(const springls__model *model, springls__candidates *c, springls__vertex_group *group)
{
    springls__nearest_search search;
    springls__vec guess;
    float first[SPRINGLS__LANES];
    int i;
    for (i = 0; i < SPRINGLS__LANES; i++) {
        search.best[i] = SPRINGLS__MATERIAL_RADIUS * SPRINGLS__MATERIAL_RADIUS;
        search.limit[i] = SPRINGLS__MATERIAL_RADIUS;
    }
    if (c->listed == 0) return;
    guess = springls__nearest_particles(c, group->x);
    springls__vec_store(first, guess);
    for (i = 0; i < SPRINGLS__LANES; i++)
        if (i == 0 || first[i] != first[i - 1]) /* neighbors often share it */
            springls__try_candidate(model, c, (int)first[i], group, &search);
    for (i = 0; i < c->listed; i++) {
        const int k = c->list[i];
        const springls__vec limit = springls__vec_load(search.limit), within = limit + c->bounding_radius[k];
        const springls__vmask reaches = springls__vec_load(c->sample + SPRINGLS__LANES * i) <= within * within;
        if (springls__vec_any(reaches) && springls__vec_any(reaches & springls__reaches_plane(c, k, group->x, limit))
            && !springls__vec_any(guess == (float)k))
            springls__try_candidate(model, c, k, group, &search);
    }
}

/* Returns elements of an array; zeros for index -1. */
SPRINGLS__FN springls__vec3 springls__vectors_at(const springls__v3 *row, const int index[SPRINGLS__LANES])
{
    springls__v3 v[SPRINGLS__LANES];
    int lane;
    for (lane = 0; lane < SPRINGLS__LANES; lane++)
        v[lane] = index[lane] < 0 ? springls__v3_make(0.0f, 0.0f, 0.0f) : row[index[lane]];
    return springls__vectors_of(v);
}

/* Returns tangents to normals, as springls__fit_begin takes them; zeros for index -1. */
SPRINGLS__FN springls__vec3 springls__tangents_of(const springls__candidates *c, const int index[SPRINGLS__LANES])
{
    springls__v3 v[SPRINGLS__LANES];
    int lane;
    for (lane = 0; lane < SPRINGLS__LANES; lane++)
        v[lane] = index[lane] < 0 ? springls__v3_make(0.0f, 0.0f, 0.0f) : springls__any_tangent(c->n[index[lane]]);
    return springls__vectors_of(v);
}

/* Begins the fits of a group, lists the candidates that count for one of them, instead of all, and adds them. */
SPRINGLS__FN springls__vec_correspondence_fit springls__fit_group(springls__candidates *c, const springls__vertex_group *group)
{
    springls__vec_correspondence_fit fit = springls__vec_correspondence_fit_begin(
        group->x, springls__vectors_at(c->n, group->nearest), springls__tangents_of(c, group->nearest));
    int i, count = 0;
    for (i = 0; i < c->listed; i++) {
        const int k = c->list[i];
        float *to = c->sample + 3 * SPRINGLS__LANES * count;
        const springls__vec_fit_sample sample = springls__vec_fit_sample_of(&fit, springls__particle_of(c, k),
                                                                            springls__vec_broadcast3(c->n[k]));
        if (!springls__vec_any(sample.weight > 0.0f)) continue;
        springls__vec_correspondence_fit_add(&fit, sample);
        springls__vec_store(to, sample.weight);
        springls__vec_store(to + SPRINGLS__LANES, sample.u);
        springls__vec_store(to + 2 * SPRINGLS__LANES, sample.v);
        c->list[count++] = k;
    }
    c->listed = count;
    return fit;
}

/* Returns the correspondences of the vertices: by the fits around them, or else those of their springls. */
SPRINGLS__FN springls__vec3 springls__group_correspondences(springls__candidates *c, const springls__vertex_group *group)
{
    const springls__vec_correspondence_fit fit = springls__fit_group(c, group);
    const springls__vec_fit_shares shares = springls__vec_fit_shares_of(&fit);
    const springls__vec3 a = springls__vectors_at(c->a, group->nearest);
    springls__vec3 sum = springls__vec_broadcast3(springls__v3_make(0.0f, 0.0f, 0.0f));
    int i;
    for (i = 0; i < c->listed; i++) {
        const float *from = c->sample + 3 * SPRINGLS__LANES * i;
        springls__vec_fit_sample sample;
        sample.weight = springls__vec_load(from);
        sample.u = springls__vec_load(from + SPRINGLS__LANES);
        sample.v = springls__vec_load(from + 2 * SPRINGLS__LANES);
        sum = springls__vec_mad(sum, springls__vec_sub(springls__vec_broadcast3(c->a[c->list[i]]), a),
                                springls__vec_fit_share(&shares, sample));
    }
    return springls__vec_add(a, sum);
}

/* Finds the correspondences of the vertices of a group; those of vertices without a springl mean nothing. */
SPRINGLS__FN void springls__write_group(springls__candidates *c, const springls__vertex_group *group, springls__v3 a[SPRINGLS__LANES])
{
    const springls__vec3 found = springls__group_correspondences(c, group);
    float x[3][SPRINGLS__LANES];
    int lane;
    springls__vec_store(x[0], found.x);
    springls__vec_store(x[1], found.y);
    springls__vec_store(x[2], found.z);
    for (lane = 0; lane < SPRINGLS__LANES; lane++) a[lane] = springls__v3_make(x[0][lane], x[1][lane], x[2][lane]);
}

/* Finds the springls nearest to up to LANES vertices, -1: none, and the correspondences of those that have one. */
SPRINGLS__FN void springls__group_material(const springls__model *model, springls__candidates *c, const springls__v3 *vertex,
                                           const uint16_t *number, int count, int *springl, springls__v3 a[SPRINGLS__LANES])
{
    springls__vertex_group group = springls__vertex_group_of(vertex, number, count);
    int lane;
    springls__list_candidates(&group, c);
    springls__find_nearest(model, c, &group);
    springls__write_group(c, &group, a);
    for (lane = 0; lane < count; lane++) springl[lane] = group.nearest[lane] < 0 ? -1 : c->springl[group.nearest[lane]];
}

/* ---- vertices whose springls are known ---- */

/* Returns the springl of a vertex with normal n: the one it has, or the nearest that faces the same way; -1: none. */
SPRINGLS__FN int springls__springl_of_place(const springls__model *model, springls__v3 x, springls__v3 n, int springl)
{
    return springl >= 0 ? springl : springls__nearest_springl_facing(model, x, n, SPRINGLS__MATERIAL_RADIUS);
}

/* Gives up to LANES vertices the candidates that are their springls; -1: none. Returns whether all are listed. */
SPRINGLS__FN bool springls__match_springls(const springls__candidates *c, const int *springl, const uint16_t *number, int count,
                                          springls__vertex_group *group)
{
    int lane, i;
    for (lane = 0; lane < count; lane++) {
        const int wanted = springl[number[lane]];
        if (wanted < 0) continue;
        for (i = 0; i < c->listed && c->springl[c->list[i]] != wanted; i++) continue;
        if (i == c->listed) return false;
        group->nearest[lane] = c->list[i];
    }
    return true;
}

/* Returns the correspondence of a vertex; springl -1: it has none, and is its own correspondence. */
SPRINGLS__FN springls__v3 springls__vertex_correspondence_at(const springls__model *model, springls__v3 x, int springl)
{
    return springl < 0 ? x : springls__correspondence_at(model, springl, x);
}

/* Finds the correspondences of up to LANES vertices of the given numbers. */
SPRINGLS__FN void springls__group_correspond(const springls__model *model, springls__candidates *c, const springls__v3 *x,
                                             const int *springl, const uint16_t *number, int count, springls__v3 *a)
{
    springls__vertex_group group = springls__vertex_group_of(x, number, count);
    springls__v3 found[SPRINGLS__LANES];
    bool known;
    int k;
    springls__list_candidates(&group, c);
    known = springls__match_springls(c, springl, number, count, &group);
    if (known) springls__write_group(c, &group, found);
    for (k = 0; k < count; k++) {
        const int i = number[k];
        a[i] = known && springl[i] >= 0 ? found[k] : springls__vertex_correspondence_at(model, x[i], springl[i]);
    }
}

/* Finds the correspondences of vertices, which lie close to each other, given their springls; -1: none. */
SPRINGLS__FN void springls__correspond_close(const springls__model *model, springls__candidates *c, const springls__v3 *x,
                                             const int *springl, int count, springls__v3 *a)
{
    springls__box box = springls__box_empty();
    int i;
    for (i = 0; i < count; i++) box = springls__box_add(box, x[i]);
    if (!springls__find_candidates(model, box, c)) {
        for (i = 0; i < count; i++) a[i] = springls__vertex_correspondence_at(model, x[i], springl[i]);
        return;
    }
    springls__order_vertices(x, count, box.lower, c->order);
    for (i = 0; i < count; i += SPRINGLS__LANES)
        springls__group_correspond(model, c, x, springl, c->order + i, springls__imin(SPRINGLS__LANES, count - i), a);
}

enum { SPRINGLS__CLOSE_VERTICES = 256 };

/* Returns how many of the first `count` vertices share a list. */
SPRINGLS__FN int springls__count_close(const springls__v3 *x, int count)
{
    springls__box box = springls__box_empty();
    int i;
    for (i = 0; i < count && i < SPRINGLS__CLOSE_VERTICES; i++) {
        springls__v3 size;
        box = springls__box_add(box, x[i]);
        size = springls__sub(box.upper, box.lower);
        if (springls__max(springls__max(size.x, size.y), size.z) > (float)SPRINGLS__CLOSE) break;
    }
    return i;
}

/* Finds the correspondences of vertices, of which those that follow each other often lie close, given their springls; -1: none. */
SPRINGLS__FN void springls__correspond(const springls__model *model, springls__candidates *c, const springls__v3 *x, const int *springl,
                                       int count, springls__v3 *a)
{
    int i, close;
    for (i = 0; i < count; i += close) {
        close = springls__count_close(x + i, count - i);
        springls__correspond_close(model, c, x + i, springl + i, close, a + i);
    }
}

/* Writes the id of a vertex x (voxels) and its correspondence a, given its springl; -1: there is none near. */
SPRINGLS__FN void springls__write_chunk_material(const springls_context *ctx, springls_chunk *chunk, int vertex, springls__v3 x,
                                                 int springl, springls__v3 a)
{
    float *out = chunk->correspondences + 3 * vertex;
    if (springl >= 0) springls__original_to_world(ctx, a, out);
    else springls__voxel_to_world(ctx, x, out);
    chunk->ids[vertex] = springl >= 0 ? ctx->model.set.id[springl] : UINT32_MAX;
}

#endif
