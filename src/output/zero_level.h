/* zero_level.h - finds where a ray meets the zero level, and the point of it closest to a place. The triangles have the bits of
   those of springls_extract_mesh, and are made cube by cube where they are needed: so nothing is built before, and no ray slips
   between two of them. */
#ifndef SPRINGLS__OUTPUT_ZERO_LEVEL_H
#define SPRINGLS__OUTPUT_ZERO_LEVEL_H

#include "../../kernels_embed/model/marching_cubes.h"
#include "../../kernels_embed/output/isosurface.h"
#include "../model/ray.h"
#include "../model/transform.h"

/* A place on a triangle of the zero level, voxels; n: its normal, of any length. */
typedef struct springls__level_hit {
    bool found;
    springls__v3 place, n;
} springls__level_hit;

/* Returns the k-th triangle of the cube whose corner 0 is voxel `at`. */
SPRINGLS__FN springls__tri springls__level_triangle(springls__mc_cell cell, int mask, const int at[3], int k)
{
    springls__cube_range range;
    memset(&range, 0, sizeof range);
    return springls__cube_triangle(&range, cell, mask, at[0], at[1], at[2], k);
}

/* ---- rays ---- */

/* A ray through the voxels, slab by slab across its main axis: between two planes of voxel centers the
   ray moves at most one voxel aside, so it meets few cubes of a slab. */
typedef struct springls__level_ray {
    const springls__grid *g;
    springls__ray_frame frame;
    int step, last;  /* to the next slab: 1 or -1; the last slab of the domain */
    double t_max;    /* nothing better is further along the ray                */
    springls__level_hit best;
} springls__level_ray;

/* Finds the cubes [span[0], span[1]] along an axis that the ray meets between two planes of its main axis, with a margin for
   rounding errors. */
SPRINGLS__FN void springls__level_ray_span(const springls__level_ray *ray, int axis, double begin, double end, int span[2])
{
    const springls__ray_frame *f = &ray->frame;
    const double slack = 1e-6, slope = axis == f->kx ? f->sx : f->sy;
    double a = f->origin[axis] + (begin - f->origin[f->kz]) * slope, b = f->origin[axis] + (end - f->origin[f->kz]) * slope;
    span[0] = springls__imax((int)((a < b ? a : b) - slack + 1.0) - 1, -1); /* above -1 the cast rounds down */
    span[1] = springls__imin((int)((a < b ? b : a) + slack + 1.0) - 1, ray->g->size[axis] - 1);
}

/* Returns whether the ray meets an active brick between two planes of its main axis. */
SPRINGLS__FN bool springls__level_ray_active(const springls__level_ray *ray, int begin, int end)
{
    const int kx = ray->frame.kx, ky = ray->frame.ky;
    int u[2], v[2], at[3];
    springls__level_ray_span(ray, kx, (double)begin, (double)end, u);
    springls__level_ray_span(ray, ky, (double)begin, (double)end, v);
    if (u[0] > u[1] || v[0] > v[1]) return false;
    at[ray->frame.kz] = springls__imax(begin, 0); /* cubes that begin before the domain belong to its first bricks */
    for (at[ky] = springls__imax(v[0], 0) & ~7; at[ky] <= springls__imax(v[1], 0); at[ky] += SPRINGLS__BRICK)
        for (at[kx] = springls__imax(u[0], 0) & ~7; at[kx] <= springls__imax(u[1], 0); at[kx] += SPRINGLS__BRICK)
            if (springls__slot_of_voxel(ray->g, at[0], at[1], at[2]) >= SPRINGLS__FIRST_SLOT) return true;
    return false;
}

/* Takes the triangles of a cube that the ray meets earlier than the best. */
SPRINGLS__FN void springls__level_ray_cube(springls__level_ray *ray, const int at[3])
{
    const springls__grid *g = ray->g;
    springls__mc_cell cell;
    int mask, k;
    if (springls__slot_of_voxel(g, springls__imax(at[0], 0), springls__imax(at[1], 0), springls__imax(at[2], 0))
        < SPRINGLS__FIRST_SLOT) return;
    cell = springls__grid_cube(g, at[0], at[1], at[2]);
    mask = springls__mc_case(cell);
    for (k = 0; k < springls__mc_count(mask); k++) {
        springls__tri t = springls__level_triangle(cell, mask, at, k);
        float weight[3];
        double along;
        if (!springls__ray_meets(&ray->frame, t, ray->t_max, &along, weight)) continue;
        if (ray->best.found && along == ray->t_max) continue;
        ray->t_max = along;
        ray->best.found = true;
        ray->best.place = springls__tri_point(t, weight);
        ray->best.n = springls__tri_area2(t);
    }
}

/* Visits the cubes of one slab. */
SPRINGLS__FN void springls__level_ray_slab(springls__level_ray *ray, int slab)
{
    const int kx = ray->frame.kx, ky = ray->frame.ky;
    int u[2], v[2], at[3];
    springls__level_ray_span(ray, kx, (double)slab, (double)slab + 1.0, u);
    springls__level_ray_span(ray, ky, (double)slab, (double)slab + 1.0, v);
    at[ray->frame.kz] = slab;
    for (at[ky] = v[0]; at[ky] <= v[1]; at[ky]++)
        for (at[kx] = u[0]; at[kx] <= u[1]; at[kx]++) springls__level_ray_cube(ray, at);
}

/* Returns the last slab, the way the ray goes, of the layer of bricks that slab `slab` is in. */
SPRINGLS__FN int springls__level_ray_layer_end(const springls__level_ray *ray, int slab)
{
    const int first = springls__imax(slab, 0) & ~7;
    if (ray->step > 0) return springls__imin(first + 7, ray->last);
    return first > 0 ? first : -1;
}

/* Visits the slabs from `slab` to `end`, in one layer of bricks, until the ray has met a triangle. */
SPRINGLS__FN void springls__level_ray_layer(springls__level_ray *ray, int slab, int end)
{
    if (!springls__level_ray_active(ray, springls__imin(slab, end), springls__imax(slab, end) + 1)) return;
    for (; (end - slab) * ray->step >= 0 && !ray->best.found; slab += ray->step) springls__level_ray_slab(ray, slab);
}

/* Returns whether the ray, which has length t_end, comes to a slab of the domain. */
SPRINGLS__FN bool springls__level_ray_reaches(const springls__level_ray *ray, int slab, double t_end)
{
    const springls__ray_frame *f = &ray->frame;
    const double plane = (double)(ray->step > 0 ? slab : slab + 1);
    return (ray->last - slab) * ray->step >= 0 && !(f->sz * (plane - f->origin[f->kz]) > t_end + 1e-6 * fabs(f->sz));
}

/* Clips the ray to the cubes of the domain, [*t_in, *t_out], and finds where it begins there. */
SPRINGLS__FN bool springls__level_ray_clip(const springls__grid *g, const double origin[3], const double direction[3],
                                           double *t_in, double *t_out, double from[3])
{
    int k, entry = -1;
    for (k = 0; k < 3; k++) {
        double lower = -1.0 - origin[k], upper = (double)g->size[k] - origin[k];
        if (direction[k] != 0.0) {
            double a = lower / direction[k], b = upper / direction[k];
            if ((a < b ? a : b) > *t_in) {
                *t_in = a < b ? a : b;
                entry = k;
            }
            if ((a < b ? b : a) < *t_out) *t_out = a < b ? b : a;
        } else if (lower > 0.0 || upper < 0.0) {
            return false;
        }
    }
    for (k = 0; k < 3; k++) { /* at the border of the domain to the bit: a far origin costs no digits */
        const double lower = -1.0, upper = (double)g->size[k];
        from[k] = k != entry ? origin[k] + *t_in * direction[k] : direction[k] > 0.0 ? lower : upper;
        from[k] = from[k] < lower ? lower : from[k] > upper ? upper : from[k];
    }
    return *t_in <= *t_out;
}

/* Finds the first point in which the ray origin + t direction (voxels) meets the zero level, 0 <= t <= *t; sets *t to its t. */
SPRINGLS__FN springls__level_hit springls__level_ray_first(const springls__grid *g, const double origin[3],
                                                           const double direction[3], double *t)
{
    springls__level_ray ray;
    double from[3], t_in = 0.0, t_out = *t;
    int k, slab, end;
    memset(&ray, 0, sizeof ray);
    if (!springls__level_ray_clip(g, origin, direction, &t_in, &t_out, from)) return ray.best;
    ray.g = g;
    ray.frame = springls__ray_frame_make(from, direction);
    ray.t_max = *t - t_in;
    k = ray.frame.kz;
    ray.step = direction[k] > 0.0 ? 1 : -1;
    ray.last = ray.step > 0 ? g->size[k] - 1 : -1;
    slab = springls__iclamp((int)(from[k] - ray.step * 1e-6 + 1.0) - 1, -1, g->size[k] - 1);
    for (; !ray.best.found && springls__level_ray_reaches(&ray, slab, t_out - t_in); slab = end + ray.step) {
        end = springls__level_ray_layer_end(&ray, slab);
        springls__level_ray_layer(&ray, slab, end);
    }
    if (ray.best.found) *t = t_in + ray.t_max;
    return ray.best;
}

/* ---- the closest point ---- */

/* A search for the closest triangle. Distances to triangles are those of model coordinates (springl_surface.h); distances to
   boxes of voxels are lower bounds of them. */
typedef struct springls__level_search {
    const springls_context *ctx;
    float weight[3];            /* least length in model units of a voxel along each axis                       */
    springls__v3 x;             /* the place, model coordinates                                                 */
    float at[3];                /* the place, voxels                                                            */
    float slack, limit2;        /* slack: exceeds rounding errors; limit2: nothing better has a larger distance */
    float d2;
    int brick, order;           /* of the best: the lowest among equals                                         */
    springls__level_hit best;
} springls__level_search;

/* Begins a sequence of searches, for springls__level_closest; finds the weights. */
SPRINGLS__FN void springls__level_search_begin(const springls_context *ctx, springls__level_search *search)
{
    const double *m = ctx->window.to_world, *inverse = ctx->window.to_voxel;
    bool oblique = false;
    int k;
    search->ctx = ctx;
    search->best.found = false;
    for (k = 0; k < 3; k++) {
        const double *row = inverse + 4 * k;
        const int next = (k + 1) % 3;
        double across = m[k] * m[next] + m[4 + k] * m[4 + next] + m[8 + k] * m[8 + next];
        double unit = (double)ctx->smallest_spacing;
        search->weight[k] = (float)(1.0 / unit) / springls__sqrt((float)(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]));
        oblique = oblique || fabs(across) > 1e-6 * (double)(ctx->largest_spacing * ctx->largest_spacing);
    }
    /* the distance is at least the largest of those along the axes, and the root of their squares where these are orthogonal */
    for (k = 0; k < 3; k++) search->weight[k] *= oblique ? 0.577f : 0.99999f;
}

/* Returns a lower bound of the squared distance to a box of voxels. */
SPRINGLS__FN float springls__level_box2(const springls__level_search *search, const int lower[3], const int upper[3])
{
    float sum = 0.0f;
    int k;
    for (k = 0; k < 3; k++) {
        float d = springls__max(springls__max((float)lower[k] - search->at[k], search->at[k] - (float)upper[k]), 0.0f);
        sum += d * d * (search->weight[k] * search->weight[k]);
    }
    return sum;
}

SPRINGLS__FN bool springls__level_is_better(const springls__level_search *search, float d2, int brick, int order)
{
    if (d2 != search->d2) return d2 < search->d2;
    return brick != search->brick ? brick < search->brick : order < search->order;
}

/* Takes the triangles of a cube that are closer than the best, or as close and of a lower order. */
SPRINGLS__FN void springls__level_try_cube(springls__level_search *search, int brick, int cube, const int at[3], int mask,
                                           springls__mc_cell cell)
{
    int k;
    for (k = 0; k < springls__mc_count(mask); k++) {
        springls__tri voxels = springls__level_triangle(cell, mask, at, k), t;
        springls__tri_hit h;
        int order = 8 * cube + k;
        float d;
        t.a = springls__voxel_to_model(search->ctx, voxels.a);
        t.b = springls__voxel_to_model(search->ctx, voxels.b);
        t.c = springls__voxel_to_model(search->ctx, voxels.c);
        h = springls__tri_closest(t, search->x);
        if (search->best.found && !springls__level_is_better(search, h.d2, brick, order)) continue;
        d = springls__sqrt(h.d2) + search->slack;
        search->best.found = true;
        search->best.place = springls__tri_point(voxels, h.bary);
        search->best.n = springls__tri_area2(voxels);
        search->d2 = h.d2;
        search->brick = brick;
        search->order = order;
        search->limit2 = springls__min(search->limit2, d * d);
    }
}

/* Returns the cubes [span[0], span[1]] along an axis that come within `radius`, of those of a brick. */
SPRINGLS__FN void springls__level_span(const springls__level_search *search, const springls__cube_range *range, int axis,
                                       float radius, int span[2])
{
    const int first = range->origin[axis] + range->lo[axis], last = range->origin[axis] + range->hi[axis];
    float r = radius / search->weight[axis];
    span[0] = (int)springls__clamp(search->at[axis] - r - 1.0f, (float)first, (float)last + 1.0f);
    span[1] = (int)springls__clamp(search->at[axis] + r, (float)first - 1.0f, (float)last);
}

/* Searches a row of cubes, from x = span[0] to span[1], of the brick at `origin`. */
SPRINGLS__FN void springls__level_try_row(springls__level_search *search, int brick, const int origin[3], bool border,
                                          const int span[2], int y, int z)
{
    const springls__grid *g = &search->ctx->model.grid;
    const int entry = springls__entry_at(g, origin[0], origin[1], origin[2]);
    float phi[4][SPRINGLS__TILE];
    uint32_t row[4], some = 0u, all = (1u << SPRINGLS__TILE) - 1u;
    int k, c, at[3], end[3];
    for (k = 0; k < 4; k++) {
        springls__load_tile_row(g, g->phi, origin, entry, border, 1, y - origin[1] + (k & 1), z - origin[2] + (k >> 1), phi[k]);
        row[k] = springls__signs_of_row(phi[k]);
        some |= row[k];
        all &= row[k];
    }
    if (some == 0u || all == (1u << SPRINGLS__TILE) - 1u) return;
    at[1] = y;
    at[2] = z;
    for (at[0] = span[0]; at[0] <= span[1]; at[0]++) {
        const int x = at[0] - origin[0], mask = springls__case_between(row, x);
        springls__mc_cell cell;
        if (springls__mc_count(mask) == 0) continue;
        for (c = 0; c < 3; c++) end[c] = at[c] + 1;
        if (springls__level_box2(search, at, end) > search->limit2) continue;
        for (c = 0; c < 8; c++) cell.phi[c] = phi[c >> 1][x + 1 + (c & 1)];
        springls__level_try_cube(search, brick, springls__cube_index(x, y - origin[1], z - origin[2]), at, mask, cell);
    }
}

/* Returns a lower bound of the squared distance to the cubes of a brick; FLT_MAX when it is not active. */
SPRINGLS__FN float springls__level_brick2(const springls__level_search *search, int brick)
{
    const springls__grid *g = &search->ctx->model.grid;
    int lower[3], upper[3], k;
    if (springls__slot_of_brick(g, brick) < SPRINGLS__FIRST_SLOT) return FLT_MAX;
    springls__brick_origin(g, brick, lower);
    for (k = 0; k < 3; k++) {
        upper[k] = lower[k] + SPRINGLS__BRICK;
        lower[k] -= lower[k] == 0;
    }
    return springls__level_box2(search, lower, upper);
}

/* Searches the cubes of a brick, row by row, if it is active. */
SPRINGLS__FN void springls__level_try_brick(springls__level_search *search, int brick)
{
    const springls__grid *g = &search->ctx->model.grid;
    const int slot = springls__slot_of_brick(g, brick);
    springls__cube_range range;
    float radius;
    bool border;
    int u[2], v[2], w[2], y, z;
    if (slot < SPRINGLS__FIRST_SLOT || springls__level_brick2(search, brick) > search->limit2) return;
    radius = springls__sqrt(search->limit2);
    range = springls__brick_cubes(g, slot);
    border = springls__tile_at_border(g, range.origin);
    springls__level_span(search, &range, 0, radius, u);
    springls__level_span(search, &range, 1, radius, v);
    springls__level_span(search, &range, 2, radius, w);
    for (z = w[0]; z <= w[1]; z++)
        for (y = v[0]; y <= v[1]; y++) {
            int at[3], end[3];
            at[0] = u[0]; at[1] = y; at[2] = z;
            end[0] = u[1] + 1; end[1] = y + 1; end[2] = z + 1;
            if (springls__level_box2(search, at, end) <= search->limit2)
                springls__level_try_row(search, brick, range.origin, border, u, y, z);
        }
}

/* Returns a lower bound of the distance to the bricks that are r or more away from brick `center`; FLT_MAX where there are
   none. */
SPRINGLS__FN float springls__level_ring_distance(const springls__level_search *search, const int center[3], int r)
{
    const springls__grid *g = &search->ctx->model.grid;
    float bound = FLT_MAX;
    int k;
    if (r == 0) return 0.0f;
    for (k = 0; k < 3; k++) {
        int lower = center[k] - r + 1, upper = center[k] + r; /* bricks before and from here on are left */
        if (lower > 0)
            bound = springls__min(bound, search->weight[k]
                                             * springls__max(search->at[k] - (float)(SPRINGLS__BRICK * lower), 0.0f));
        if (upper < g->bricks[k])
            bound = springls__min(bound, search->weight[k]
                                             * springls__max((float)(SPRINGLS__BRICK * upper) - search->at[k], 0.0f));
    }
    return bound;
}

/* A walk over the bricks that are r away from brick `center`; over all active ones when r is negative. */
typedef struct springls__ring_walk {
    const springls__grid *g;
    int center[3], r, at[3], next;
} springls__ring_walk;

SPRINGLS__FN springls__ring_walk springls__ring_walk_begin(const springls__grid *g, const int center[3], int r)
{
    springls__ring_walk walk;
    int k;
    walk.g = g;
    walk.r = r;
    walk.next = 0;
    for (k = 0; k < 3; k++) {
        walk.center[k] = center[k];
        walk.at[k] = -r;
    }
    return walk;
}

/* Returns the next brick; -1 at the end. */
SPRINGLS__FN int springls__ring_walk_next(springls__ring_walk *walk)
{
    const springls__grid *g = walk->g;
    const int r = walk->r;
    if (r < 0) return walk->next < g->active_count ? g->slot_brick[g->active[walk->next++]] : -1;
    while (walk->at[2] <= r) {
        int x = walk->center[0] + walk->at[0], y = walk->center[1] + walk->at[1], z = walk->center[2] + walk->at[2];
        bool side = walk->at[1] == -r || walk->at[1] == r || walk->at[2] == -r || walk->at[2] == r;
        walk->at[0] += side || r == 0 ? 1 : 2 * r;
        if (walk->at[0] > r) {
            walk->at[0] = -r;
            walk->at[1]++;
        }
        if (walk->at[1] > r) {
            walk->at[1] = -r;
            walk->at[2]++;
        }
        if (x >= 0 && y >= 0 && z >= 0 && x < g->bricks[0] && y < g->bricks[1] && z < g->bricks[2])
            return x + g->bricks[0] * (y + g->bricks[1] * z);
    }
    return -1;
}

/* Searches the bricks of a walk, the nearest one first: it leaves little to do in the others. */
SPRINGLS__FN void springls__level_try_bricks(springls__level_search *search, springls__ring_walk walk)
{
    springls__ring_walk again = walk;
    float nearest2 = search->limit2;
    int brick, nearest = -1;
    while ((brick = springls__ring_walk_next(&walk)) >= 0) {
        float d2 = springls__level_brick2(search, brick);
        if (d2 < nearest2) {
            nearest2 = d2;
            nearest = brick;
        }
    }
    if (nearest < 0) return;
    springls__level_try_brick(search, nearest);
    while ((brick = springls__ring_walk_next(&again)) >= 0)
        if (brick != nearest) springls__level_try_brick(search, brick);
}

/* Searches all bricks within the limit, ring by ring around brick `center`. */
SPRINGLS__FN void springls__level_try_rings(springls__level_search *search, const int center[3])
{
    const springls__grid *g = &search->ctx->model.grid;
    int r;
    for (r = 0; ; r++) {
        const float bound = springls__level_ring_distance(search, center, r), side = (float)(2 * r + 1);
        if (bound == FLT_MAX || bound * bound > search->limit2) return;
        if (side * side * side > (float)g->active_count + 27.0f) break;
        springls__level_try_bricks(search, springls__ring_walk_begin(g, center, r));
    }
    springls__level_try_bricks(search, springls__ring_walk_begin(g, center, -1)); /* the rings have more bricks than are active */
}

/* Sets the place of a search, and finds the brick nearest to it. */
SPRINGLS__FN void springls__level_search_place(springls__level_search *search, const float *world, int center[3])
{
    const springls_context *ctx = search->ctx;
    const int *size = ctx->model.grid.size;
    const springls__v3 corner = springls__v3_make((float)size[0], (float)size[1], (float)size[2]);
    double x[3];
    int k;
    springls__transform(ctx->window.to_voxel, (double)world[0], (double)world[1], (double)world[2], x);
    search->x = springls__world_to_model(ctx, world);
    for (k = 0; k < 3; k++) {
        search->at[k] = (float)(x[k] < -1e15 ? -1e15 : x[k] > 1e15 ? 1e15 : x[k]);
        center[k] = springls__cell_coordinate(search->at[k], 0, size[k]) / SPRINGLS__BRICK;
    }
    search->slack = 4e-6f * (springls__max_coordinate(search->x)
                             + springls__max_coordinate(springls__voxel_to_model(ctx, corner)));
}

/* Finds the point of the zero level closest to a place of the world, and sets search->d2 to its squared distance, model units. The
   last result bounds the distance of the next one: that saves time and cannot change it. */
SPRINGLS__FN springls__level_hit springls__level_closest(springls__level_search *search, const float *world)
{
    const springls_context *ctx = search->ctx;
    const springls__grid *g = &ctx->model.grid;
    float phi, short_range, last = FLT_MAX;
    int center[3];
    springls__level_search_place(search, world, center);
    if (search->best.found) /* the last answer is on the surface too */
        last = springls__length(springls__sub(search->x, springls__voxel_to_model(ctx, search->best.place))) + search->slack;
    search->best.found = false;
    phi = springls__fabs(springls__grid_sample(g, g->phi, springls__v3_make(search->at[0], search->at[1], search->at[2])));
    short_range = (1.1f * phi + 0.5f) * ctx->largest_spacing / ctx->smallest_spacing;
    if (phi < g->far_value && short_range < last) { /* phi is nearly the distance: a short search may be enough */
        search->limit2 = short_range * short_range;
        springls__level_try_rings(search, center);
        if (search->best.found && search->d2 <= short_range * short_range) return search->best;
        search->best.found = false;
    }
    search->limit2 = last < 1e18f ? last * last : FLT_MAX;
    springls__level_try_rings(search, center);
    return search->best;
}

#endif
