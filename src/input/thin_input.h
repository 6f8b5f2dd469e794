/* thin_input.h - thins out parts of an input mesh whose triangles are far below a voxel, before they become springls
   (params.split_input): the time of a search grows with the springls near by. Where a cell of half a voxel has many corners, those that
   lie together in a quarter of a voxel and face alike become one of them: one at a sharp edge if there is any, else the one nearest to
   their middle. Triangles that have collapsed or turned over by this become no springl. Sheets that lie on each other face otherwise, and
   stay apart. Correspondences are found on the mesh as it was given, all of which is the original surface. */
#ifndef SPRINGLS__INPUT_THIN_INPUT_H
#define SPRINGLS__INPUT_THIN_INPUT_H

#include "../runtime/algorithms.h"
#include "../runtime/memory.h"
#include "../model/closest_point.h"
#include "mesh_intake.h"
#include "split_input.h"

#define SPRINGLS__DENSE_CELL 0.5f /* voxel: in which corners are counted                                            */
#define SPRINGLS__DENSE_MOST 32   /* corners of such a cell that are left as they are: 256 triangles a voxel^2          */
#define SPRINGLS__THIN_CELL 0.25f /* voxel: in which corners become one                                             */

/* What is known of a corner, by its number in the mesh. Corners of one cell that face alike are a cluster, led by the first of them. */
typedef struct springls__thin_corner {
    springls__v3 normal, middle;  /* sum of the area normals around; of a leader: the mean place of its cluster         */
    float area, distance2;        /* twice the area around; of a leader: from the middle to the corner that is chosen   */
    int leader, count, chosen;    /* of a leader: corners of the cluster, and which of them stands for all              */
    uint8_t facing, sharp, dense; /* dense: it lies where there are too many                                            */
} springls__thin_corner;

typedef struct springls__thinning { springls__thin_corner *corner; bool any; springls__buffer memory; } springls__thinning;

/* Returns the axis, times 2, plus 1 where it is negative, that a vector is nearest to. */
SPRINGLS__FN int springls__facing_of(springls__v3 n)
{
    const float x = springls__fabs(n.x), y = springls__fabs(n.y), z = springls__fabs(n.z);
    if (x >= y && x >= z) return n.x < 0.0f;
    return y >= z ? 2 + (n.y < 0.0f) : 4 + (n.z < 0.0f);
}

/* Returns the place of a coordinate in cells of some size, which is a power of two. */
SPRINGLS__FN int springls__thin_place(float x, float cell) { return (int)springls__floor(x / cell); }

SPRINGLS__FN bool springls__share_cell(springls__v3 a, springls__v3 b, float cell)
{
    return springls__thin_place(a.x, cell) == springls__thin_place(b.x, cell)
        && springls__thin_place(a.y, cell) == springls__thin_place(b.y, cell)
        && springls__thin_place(a.z, cell) == springls__thin_place(b.z, cell);
}

/* Returns the leader of corner i's cluster, which it becomes itself if there is none. */
SPRINGLS__FN int springls__thin_leader(springls__mesh_intake *m, const springls__thin_corner *corner, int i, float cell)
{
    const springls__v3 x = m->point[i];
    const size_t mask = m->table_size - 1;
    size_t slot = springls__hash3((uint32_t)springls__thin_place(x.x, cell), (uint32_t)springls__thin_place(x.y, cell),
                                  (uint32_t)springls__thin_place(x.z, cell) * 8u + corner[i].facing) & mask;
    for (; m->table[slot] >= 0; slot = (slot + 1) & mask) {
        const int other = m->table[slot];
        if (corner[other].facing == corner[i].facing && springls__share_cell(m->point[other], x, cell)) break;
    }
    if (m->table[slot] < 0) m->table[slot] = i;
    return m->table[slot];
}

/* Groups the dense corners of the listed triangles into clusters. */
SPRINGLS__FN void springls__thin_group(springls__mesh_intake *m, springls__thin_corner *corner, float cell)
{
    size_t slot;
    int h;
    for (slot = 0; slot < m->table_size; slot++) m->table[slot] = -1;
    for (h = 0; h < 3 * m->count; h++) corner[m->corner[h]].leader = -1;
    for (h = 0; h < 3 * m->count; h++) {
        springls__thin_corner *c = &corner[m->corner[h]];
        if (!c->dense || c->leader >= 0) continue;
        c->count = 0;
        c->leader = springls__thin_leader(m, corner, m->corner[h], cell);
        corner[c->leader].count++;
    }
}

/* Finds the corners that lie where there are too many. Returns whether any do. */
SPRINGLS__FN bool springls__find_dense(springls__mesh_intake *m, springls__thin_corner *corner)
{
    bool any = false;
    int i;
    for (i = 0; i < m->positions; i++) {
        corner[i].leader = -1;
        corner[i].facing = 0;
        corner[i].dense = 1;
    }
    springls__thin_group(m, corner, SPRINGLS__DENSE_CELL);
    for (i = 0; i < m->positions; i++) {
        corner[i].dense = corner[i].leader >= 0 && corner[corner[i].leader].count > SPRINGLS__DENSE_MOST;
        any = any || corner[i].dense;
    }
    return any;
}

/* Finds which way the corners face, and which of them lie at sharp edges. */
SPRINGLS__FN void springls__thin_face(const springls__mesh_intake *m, springls__thin_corner *corner)
{
    const float blunt = 0.9f; /* of the areas around, the part that the sum of the normals has */
    int h, k;
    for (h = 0; h < 3 * m->count; h++) {
        springls__thin_corner *c = &corner[m->corner[h]];
        c->normal = springls__v3_make(0.0f, 0.0f, 0.0f);
        c->area = 0.0f;
    }
    for (h = 0; h < m->count; h++) {
        springls__v3 q[3], n;
        springls__mesh_corners(m, h, q);
        n = springls__cross(springls__sub(q[1], q[0]), springls__sub(q[2], q[0]));
        for (k = 0; k < 3; k++) {
            springls__thin_corner *c = &corner[m->corner[3 * h + k]];
            c->normal = springls__add(c->normal, n);
            c->area += springls__length(n);
        }
    }
    for (h = 0; h < 3 * m->count; h++) {
        springls__thin_corner *c = &corner[m->corner[h]];
        c->facing = (uint8_t)springls__facing_of(c->normal);
        c->sharp = springls__length(c->normal) < blunt * c->area;
    }
}

/* Returns whether corner i is a better one for its cluster than the one chosen. */
SPRINGLS__FN bool springls__thin_is_better(const springls__thin_corner *corner, int i, float distance2)
{
    const springls__thin_corner *leader = &corner[corner[i].leader];
    if (leader->chosen < 0 || corner[i].sharp != corner[leader->chosen].sharp) return leader->chosen < 0 || corner[i].sharp;
    return distance2 < leader->distance2;
}

/* Chooses the corner that stands for each cluster. */
SPRINGLS__FN void springls__thin_choose(const springls__mesh_intake *m, springls__thin_corner *corner)
{
    int i;
    for (i = 0; i < m->positions; i++) {
        corner[i].middle = springls__v3_make(0.0f, 0.0f, 0.0f);
        corner[i].chosen = -1;
    }
    for (i = 0; i < m->positions; i++) {
        springls__thin_corner *leader = &corner[springls__imax(corner[i].leader, 0)];
        if (corner[i].leader >= 0) leader->middle = springls__mad(leader->middle, m->point[i], 1.0f / (float)leader->count);
    }
    for (i = 0; i < m->positions; i++) {
        springls__thin_corner *leader = &corner[springls__imax(corner[i].leader, 0)];
        const float distance2 = corner[i].leader < 0 ? 0.0f : springls__length2(springls__sub(m->point[i], leader->middle));
        if (corner[i].leader < 0 || !springls__thin_is_better(corner, i, distance2)) continue;
        leader->chosen = i;
        leader->distance2 = distance2;
    }
}

/* Finds out where the listed triangles are far below a voxel, and which corners stand for others there. thinning: zeros; the caller frees
   its memory, also on failure. */
SPRINGLS__FN springls_status springls__thin_input(springls_context *ctx, springls__mesh_intake *m, springls__thinning *thinning)
{
    if (!ctx->model.params.split_input) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &thinning->memory, (size_t)m->positions, sizeof *thinning->corner, 0));
    thinning->corner = (springls__thin_corner *)thinning->memory.data;
    thinning->any = springls__find_dense(m, thinning->corner);
    if (!thinning->any) return SPRINGLS_OK;
    springls__thin_face(m, thinning->corner);
    springls__thin_group(m, thinning->corner, SPRINGLS__THIN_CELL);
    springls__thin_choose(m, thinning->corner);
    return SPRINGLS_OK;
}

/* Returns the corner that stands for corner i. */
SPRINGLS__FN int springls__thin_stand_in(const springls__thinning *thinning, int i)
{
    return thinning->corner[i].dense ? thinning->corner[thinning->corner[i].leader].chosen : i;
}

/* Gives the springls from `first` on, of triangle t, their correspondences on the original surface. */
SPRINGLS__FN void springls__thin_correspond(springls_context *ctx, int first, int t)
{
    int i;
    for (i = first; i < ctx->model.set.count; i++) {
        const springls__surface_hit h = springls__surface_closest_from(&ctx->original, ctx->model.set.s[i].p, FLT_MAX, t);
        ctx->model.set.a[i] = springls__tri_point(springls__surface_triangle(&ctx->original, h.triangle), h.hit.bary);
    }
}

/* Returns whether a triangle has an area still, and faces as it did. */
SPRINGLS__FN bool springls__thin_keeps(const springls__v3 before[3], const springls__v3 after[3])
{
    const springls__v3 n = springls__cross(springls__sub(before[1], before[0]), springls__sub(before[2], before[0]));
    const springls__v3 m = springls__cross(springls__sub(after[1], after[0]), springls__sub(after[2], after[0]));
    return springls__length(m) > 1e-10f && springls__dot(n, m) > 0.0f;
}

/* Appends the springls of listed triangle t, thinned out. */
SPRINGLS__FN springls_status springls__append_thinned(springls_context *ctx, springls__split_rule *rule, const springls__mesh_intake *m,
                                                      const springls__thinning *thinning, int t)
{
    const int first = ctx->model.set.count;
    springls__v3 given[3], q[3];
    bool moved = false;
    int k;
    springls__mesh_corners(m, t, given);
    for (k = 0; k < 3 && thinning->any; k++) {
        const int i = m->corner[3 * t + (m->turn[t] && k ? 3 - k : k)], stand_in = springls__thin_stand_in(thinning, i);
        moved = moved || stand_in != i;
        q[k] = m->point[stand_in];
    }
    if (!moved) return springls__append_divided(ctx, rule, given);
    if (!springls__thin_keeps(given, q)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__append_divided(ctx, rule, q));
    springls__thin_correspond(ctx, first, t);
    return SPRINGLS_OK;
}

/* Appends the springls of the listed triangles, in their order; those of the original surface are the same. */
SPRINGLS__FN springls_status springls__append_input(springls_context *ctx, springls__mesh_intake *m)
{
    springls__split_rule rule = springls__split_rule_of(ctx, m->count);
    springls__thinning thinning;
    springls_status status;
    int t;
    memset(&thinning, 0, sizeof thinning);
    status = springls__thin_input(ctx, m, &thinning);
    for (t = 0; status == SPRINGLS_OK && t < m->count; t++) status = springls__append_thinned(ctx, &rule, m, &thinning, t);
    springls__buffer_free(ctx, &thinning.memory);
    return status;
}

#endif
