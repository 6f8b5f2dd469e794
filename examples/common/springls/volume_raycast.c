#include "springls/volume_raycast.h"

#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BRICK = 8, BRICK_CELLS = BRICK * BRICK * BRICK, MAX_BRICKS = 1 << 27 };

static int element_floats(const struct volume_scene *scene) { return scene->shape == VOLUME_CAPSULES ? 9 : 7; }

static const float *element_at(const struct volume_scene *scene, int i)
{
    return scene->elements + (size_t)i * (size_t)element_floats(scene);
}

/* ---- exact hits; `origin` is near the element, so that no digit is lost ---- */

/* Enters the ball |x - center| <= r; returns the distance, or INFINITY. */
static float enter_ball(const float origin[3], const float d[3], const float center[3], float r)
{
    float m[3];
    vec3_sub(origin, center, m);
    const float b = vec3_dot(m, d), c = vec3_dot(m, m) - r * r, disc = b * b - c;
    return disc >= 0.0f ? -b - sqrtf(disc) : INFINITY;
}

/* Enters the side of the cylinder of radius r about the segment a b; its ends belong to the balls about a and b. */
static float enter_cylinder(const float origin[3], const float d[3], const float a[3], const float b[3], float r)
{
    float axis[3], m[3];
    vec3_sub(b, a, axis);
    vec3_sub(origin, a, m);
    const float length = vec3_normalize(axis);
    const float md = vec3_dot(m, axis), dd = vec3_dot(d, axis);
    const float k = 1.0f - dd * dd; /* d without its part along the axis, squared */
    const float half_b = vec3_dot(m, d) - md * dd, c = vec3_dot(m, m) - md * md - r * r, disc = half_b * half_b - k * c;
    if (!(k > 1e-12f) || disc < 0.0f) {
        return INFINITY;
    }
    const float t = (-half_b - sqrtf(disc)) / k, along = md + t * dd;
    return along >= 0.0f && along <= length ? t : INFINITY;
}

/* Enters the triangle, moved by r to the side that the ray comes from. */
static float enter_face(const float origin[3], const float d[3], const float *q, float r)
{
    float n[3], m[3];
    vec3_triangle_normal(q, n);
    const float toward = vec3_dot(n, d), side = toward > 0.0f ? -r : r;
    if (!(fabsf(toward) > 1e-12f)) {
        return INFINITY;
    }
    vec3_sub(q, origin, m);
    const float t = (vec3_dot(m, n) + side) / toward;
    for (int k = 0; k < 3; ++k) { /* on the inner side of each edge? */
        float edge[3], to[3], across[3];
        const float *a = q + 3 * k, *b = q + 3 * ((k + 1) % 3);
        vec3_sub(b, a, edge);
        for (int i = 0; i < 3; ++i) {
            to[i] = origin[i] + t * d[i] - a[i];
        }
        vec3_cross(edge, to, across);
        if (!(vec3_dot(across, n) >= 0.0f)) {
            return INFINITY;
        }
    }
    return t;
}

/* Finds the point of a triangle that is closest to x (Ericson, Real-Time Collision Detection, 5.1.5). */
static void closest_of_triangle(const float *q, const float x[3], float out[3])
{
    const float *a = q, *b = q + 3, *c = q + 6;
    float ab[3], ac[3], ap[3], bp[3], cp[3];
    vec3_sub(b, a, ab), vec3_sub(c, a, ac), vec3_sub(x, a, ap), vec3_sub(x, b, bp), vec3_sub(x, c, cp);
    const float d1 = vec3_dot(ab, ap), d2 = vec3_dot(ac, ap), d3 = vec3_dot(ab, bp), d4 = vec3_dot(ac, bp), d5 = vec3_dot(ab, cp),
                d6 = vec3_dot(ac, cp), va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    float v = 0.0f, w = 0.0f;
    if (d1 <= 0.0f && d2 <= 0.0f) {
        v = w = 0.0f;
    } else if (d3 >= 0.0f && d4 <= d3) {
        v = 1.0f;
    } else if (d6 >= 0.0f && d5 <= d6) {
        w = 1.0f;
    } else if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f) {
        v = d1 / (d1 - d3);
    } else if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f) {
        w = d2 / (d2 - d6);
    } else if (va <= 0.0f && d4 - d3 >= 0.0f && d5 - d6 >= 0.0f) {
        w = (d4 - d3) / (d4 - d3 + d5 - d6);
        v = 1.0f - w;
    } else {
        v = vb / (va + vb + vc);
        w = vc / (va + vb + vc);
    }
    for (int i = 0; i < 3; ++i) {
        out[i] = a[i] + v * ab[i] + w * ac[i];
    }
}

/* A capsule is convex and consists of balls about the corners, cylinders about the edges and a plate about the triangle, so the ray
 * enters it where it first enters one of them. */
static bool hit_capsule(const float *q, float radius, const float origin[3], const float d[3], float *distance, float normal[3])
{
    float near[3], from[3], closest[3], first = INFINITY;
    const float center[3] = {(q[0] + q[3] + q[6]) / 3.0f, (q[1] + q[4] + q[7]) / 3.0f, (q[2] + q[5] + q[8]) / 3.0f};
    vec3_sub(center, origin, from);
    const float ahead = vec3_dot(from, d);
    vec3_add_scaled(origin, ahead, d, near);
    for (int k = 0; k < 3; ++k) {
        first = fminf(first, enter_ball(near, d, q + 3 * k, radius));
        first = fminf(first, enter_cylinder(near, d, q + 3 * k, q + 3 * ((k + 1) % 3), radius));
    }
    first = fminf(first, enter_face(near, d, q, radius));
    if (first == INFINITY) {
        return false;
    }
    if (ahead + first < 0.0f) { /* behind; or the ray begins within, then it hits at once */
        closest_of_triangle(q, origin, closest);
        vec3_sub(origin, closest, normal);
        if (vec3_length(normal) > radius) {
            return false;
        }
        first = -ahead;
    }
    vec3_add_scaled(near, first, d, from);
    closest_of_triangle(q, from, closest);
    vec3_sub(from, closest, normal);
    if (!(vec3_normalize(normal) > 0.0f)) { /* radius 0 */
        vec3_triangle_normal(q, normal);
    }
    *distance = ahead + first;
    return true;
}

static bool hit_surfel(const float *surfel, const float origin[3], const float d[3], float *distance, float normal[3])
{
    float m[3], from[3];
    const float toward = vec3_dot(surfel + 3, d);
    vec3_sub(surfel, origin, m);
    if (!(fabsf(toward) > 1e-12f)) {
        return false;
    }
    *distance = vec3_dot(m, surfel + 3) / toward;
    vec3_add_scaled(m, -*distance, d, from);
    memcpy(normal, surfel + 3, 3 * sizeof *normal);
    return *distance >= 0.0f && vec3_dot(from, from) <= surfel[6] * surfel[6];
}

static bool hit_element(const struct volume_scene *scene, int i, const float origin[3], const float d[3], struct volume_hit *hit)
{
    hit->element = i;
    return scene->shape == VOLUME_CAPSULES
               ? hit_capsule(element_at(scene, i), scene->radius, origin, d, &hit->distance, hit->normal)
               : hit_surfel(element_at(scene, i), origin, d, &hit->distance, hit->normal);
}

/* ---- filing ---- */

/* Computes the box of an element, a little larger: a hit on the border of two voxels is found in either. */
static void element_box(const struct volume_scene *scene, int i, float lo[3], float hi[3])
{
    const float *e = element_at(scene, i), margin = (scene->shape == VOLUME_CAPSULES ? scene->radius : e[6]) + 0.01f * scene->voxel;
    for (int k = 0; k < 3; ++k) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
    }
    raycast_grow_box(e, scene->shape == VOLUME_CAPSULES ? 3 : 1, lo, hi);
    for (int k = 0; k < 3; ++k) {
        lo[k] -= margin;
        hi[k] += margin;
    }
}

/* Computes the range of voxels that an element's box touches. */
static void element_cells(const struct volume_scene *scene, int i, int from[3], int to[3])
{
    float lo[3], hi[3];
    element_box(scene, i, lo, hi);
    for (int k = 0; k < 3; ++k) {
        const int last = scene->bricks[k] * BRICK - 1;
        const int a = (int)floorf((lo[k] - scene->low[k]) / scene->voxel), b = (int)floorf((hi[k] - scene->low[k]) / scene->voxel);
        from[k] = a < 0 ? 0 : a;
        to[k] = b > last ? last : b;
    }
}

static size_t brick_of(const struct volume_scene *scene, const int cell[3])
{
    return (size_t)(cell[0] / BRICK)
         + (size_t)scene->bricks[0] * ((size_t)(cell[1] / BRICK) + (size_t)scene->bricks[1] * (size_t)(cell[2] / BRICK));
}

static int cell_in_brick(const int cell[3]) { return cell[0] % BRICK + BRICK * (cell[1] % BRICK + BRICK * (cell[2] % BRICK)); }

typedef void (*cell_fn)(struct volume_scene *scene, const int cell[3], int element);

static void for_each_cell(struct volume_scene *scene, cell_fn act)
{
    for (int i = 0; i < scene->count; ++i) {
        int from[3], to[3], cell[3];
        element_cells(scene, i, from, to);
        for (cell[2] = from[2]; cell[2] <= to[2]; ++cell[2]) {
            for (cell[1] = from[1]; cell[1] <= to[1]; ++cell[1]) {
                for (cell[0] = from[0]; cell[0] <= to[0]; ++cell[0]) {
                    act(scene, cell, i);
                }
            }
        }
    }
}

static void mark_brick(struct volume_scene *scene, const int cell[3], int element)
{
    (void)element;
    scene->brick_cells[brick_of(scene, cell)] = 0;
}

static int *begin_of(struct volume_scene *scene, const int cell[3])
{
    return scene->cell_begin + scene->brick_cells[brick_of(scene, cell)] + cell_in_brick(cell);
}

static void count_in_cell(struct volume_scene *scene, const int cell[3], int element)
{
    (void)element;
    ++*begin_of(scene, cell);
}

/* Fills lists from their ends, so that a list's end becomes its begin. */
static void put_into_cell(struct volume_scene *scene, const int cell[3], int element)
{
    scene->ids[--*begin_of(scene, cell)] = element;
}

static bool make_bricks(struct volume_scene *scene)
{
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    double bricks = 1.0;
    for (int i = 0; i < scene->count; ++i) {
        float a[3], b[3];
        element_box(scene, i, a, b);
        raycast_grow_box(a, 1, lo, hi);
        raycast_grow_box(b, 1, lo, hi);
    }
    for (int k = 0; k < 3; ++k) {
        const float side = (float)BRICK * scene->voxel;
        const double wanted = lo[k] <= hi[k] ? floor((double)(hi[k] - lo[k]) / (double)side) + 1.0 : 0.0;
        scene->low[k] = lo[k];
        bricks *= wanted;
        if (!(bricks <= (double)MAX_BRICKS)) {
            return false;
        }
        scene->bricks[k] = (int)wanted;
    }
    scene->brick_cells = malloc(((size_t)bricks + 1) * sizeof *scene->brick_cells);
    return scene->brick_cells != NULL;
}

/* Files the elements: which bricks there are, how many each voxel has, then which. */
static bool file_elements(struct volume_scene *scene)
{
    if (!make_bricks(scene)) {
        return false;
    }
    const size_t bricks = (size_t)scene->bricks[0] * (size_t)scene->bricks[1] * (size_t)scene->bricks[2];
    int cells = 0, total = 0;
    memset(scene->brick_cells, 0xff, bricks * sizeof *scene->brick_cells); /* -1 */
    for_each_cell(scene, mark_brick);
    for (size_t b = 0; b < bricks; ++b) {
        if (scene->brick_cells[b] == 0) {
            scene->brick_cells[b] = cells;
            cells += BRICK_CELLS;
        }
    }
    scene->cell_begin = calloc((size_t)cells + 1, sizeof *scene->cell_begin);
    if (!scene->cell_begin) {
        return false;
    }
    for_each_cell(scene, count_in_cell);
    for (int c = 0; c <= cells; ++c) {
        total += scene->cell_begin[c];
        scene->cell_begin[c] = total;
    }
    scene->ids = malloc(((size_t)total + 1) * sizeof *scene->ids);
    if (!scene->ids) {
        return false;
    }
    for_each_cell(scene, put_into_cell);
    return true;
}

/* Copies the finite elements. */
static bool copy_elements(const float *elements, int count, struct volume_scene *scene)
{
    const int floats = element_floats(scene);
    scene->elements = malloc(((size_t)count + 1) * (size_t)floats * sizeof *scene->elements);
    for (int i = 0; i < count && scene->elements; ++i) {
        const float *from = elements + (size_t)i * (size_t)floats;
        bool finite = true;
        for (int k = 0; k < floats; ++k) {
            finite = finite && isfinite(from[k]);
        }
        if (finite) {
            memcpy(scene->elements + (size_t)floats * (size_t)scene->count++, from, (size_t)floats * sizeof *from);
        }
    }
    return scene->elements && file_elements(scene);
}

bool volume_scene_capsules(const float *triangles, int count, float radius, float voxel, struct volume_scene *scene)
{
    *scene = (struct volume_scene){.shape = VOLUME_CAPSULES, .radius = radius, .voxel = voxel};
    if (copy_elements(triangles, count, scene)) {
        return true;
    }
    volume_scene_free(scene);
    return false;
}

bool volume_scene_surfels(const float *surfels, int count, float voxel, struct volume_scene *scene)
{
    *scene = (struct volume_scene){.shape = VOLUME_SURFELS, .voxel = voxel};
    if (copy_elements(surfels, count, scene)) {
        return true;
    }
    volume_scene_free(scene);
    return false;
}

void volume_scene_free(struct volume_scene *scene)
{
    free(scene->elements);
    free(scene->brick_cells);
    free(scene->cell_begin);
    free(scene->ids);
    memset(scene, 0, sizeof *scene);
}

/* ---- rays ---- */

/* A walk through cubes of a side along a ray (Amanatides & Woo 1987). */
struct walk {
    int cell[3], step[3];
    float next[3], delta[3]; /* distances along the ray at which it leaves the cube across each axis, and from border to border */
};

static float walk_exit(const struct walk *walk) { return fminf(walk->next[0], fminf(walk->next[1], walk->next[2])); }

/* Begins in the cube that has the ray's point at `distance`, within from .. to. */
static void walk_begin(const float low[3], float side, const float origin[3], const float d[3], float distance, const int from[3],
                       const int to[3], struct walk *walk)
{
    for (int k = 0; k < 3; ++k) {
        const int at = (int)floorf((origin[k] + distance * d[k] - low[k]) / side);
        walk->cell[k] = at < from[k] ? from[k] : at > to[k] ? to[k] : at;
        walk->step[k] = d[k] > 0.0f ? 1 : -1;
        walk->delta[k] = d[k] != 0.0f ? side / fabsf(d[k]) : INFINITY;
        const float border = low[k] + side * (float)(walk->cell[k] + (d[k] > 0.0f));
        walk->next[k] = d[k] != 0.0f ? (border - origin[k]) / d[k] : INFINITY;
    }
}

/* Goes on to the next cube. */
static void walk_on(struct walk *walk)
{
    const int first = walk->next[0] <= walk->next[1] ? 0 : 1, k = walk->next[first] <= walk->next[2] ? first : 2;
    walk->cell[k] += walk->step[k];
    walk->next[k] += walk->delta[k];
}

static bool walk_within(const struct walk *walk, const int from[3], const int to[3])
{
    bool within = true;
    for (int k = 0; k < 3; ++k) {
        within = within && walk->cell[k] >= from[k] && walk->cell[k] <= to[k];
    }
    return within;
}

/* Computes where the ray is in the box of all bricks. */
static bool clip(const struct volume_scene *scene, const float origin[3], const float d[3], float *enter, float *leave)
{
    *enter = 0.0f;
    *leave = INFINITY;
    for (int k = 0; k < 3; ++k) {
        const float high = scene->low[k] + (float)(BRICK * scene->bricks[k]) * scene->voxel;
        const float a = (scene->low[k] - origin[k]) / d[k], b = (high - origin[k]) / d[k];
        if (d[k] != 0.0f) {
            *enter = fmaxf(*enter, fminf(a, b));
            *leave = fminf(*leave, fmaxf(a, b));
        } else if (origin[k] < scene->low[k] || origin[k] > high) {
            return false;
        }
    }
    return *enter <= *leave;
}

/* Looks for hits in a voxel's list; keeps the nearest. */
static void look_into_cell(const struct volume_scene *scene, int cell, const float origin[3], const float d[3],
                           struct volume_hit *best)
{
    for (int n = scene->cell_begin[cell]; n < scene->cell_begin[cell + 1]; ++n) {
        struct volume_hit hit;
        if (hit_element(scene, scene->ids[n], origin, d, &hit)
            && (hit.distance < best->distance || (hit.distance == best->distance && hit.element < best->element))) {
            *best = hit;
        }
    }
}

/* Walks through the voxels of a brick until the nearest hit is in a voxel that was looked into. */
static bool cross_brick(const struct volume_scene *scene, const int brick[3], float enter, const float origin[3], const float d[3],
                        struct volume_hit *best)
{
    const int from[3] = {BRICK * brick[0], BRICK * brick[1], BRICK * brick[2]},
              to[3] = {from[0] + BRICK - 1, from[1] + BRICK - 1, from[2] + BRICK - 1};
    const int first = scene->brick_cells[brick_of(scene, from)];
    struct walk walk;
    for (walk_begin(scene->low, scene->voxel, origin, d, enter, from, to, &walk); walk_within(&walk, from, to); walk_on(&walk)) {
        look_into_cell(scene, first + cell_in_brick(walk.cell), origin, d, best);
        if (best->distance <= walk_exit(&walk)) {
            return true;
        }
    }
    return false;
}

bool volume_raycast(const struct volume_scene *scene, const float origin[3], const float direction[3], struct volume_hit *hit)
{
    static const int first[3] = {0, 0, 0};
    const int last[3] = {scene->bricks[0] - 1, scene->bricks[1] - 1, scene->bricks[2] - 1};
    const float side = (float)BRICK * scene->voxel;
    float enter, leave;
    struct walk walk;
    *hit = (struct volume_hit){.distance = INFINITY, .element = -1};
    if (!scene->brick_cells || scene->count == 0 || !clip(scene, origin, direction, &enter, &leave)) {
        return false;
    }
    walk_begin(scene->low, side, origin, direction, enter, first, last, &walk);
    for (; walk_within(&walk, first, last); walk_on(&walk)) {
        const int corner[3] = {BRICK * walk.cell[0], BRICK * walk.cell[1], BRICK * walk.cell[2]};
        if (scene->brick_cells[brick_of(scene, corner)] >= 0
            && cross_brick(scene, walk.cell, enter, origin, direction, hit)) {
            break;
        }
        enter = walk_exit(&walk);
    }
    return hit->element >= 0;
}
