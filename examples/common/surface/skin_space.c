/* skin_space.c - distances by closest points that neighbors hand on (Danielsson 1980), and the widest way from outside to each voxel
 * (Pollack 1960): voxels are reached in falling order of the narrowest place on their way. */
#include "surface/skin_space.h"

#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEVELS = 512, DEPTH = 48 };

static size_t voxel_count(const struct skin_space *s) { return (size_t)s->size[0] * (size_t)s->size[1] * (size_t)s->size[2]; }

static size_t voxel_at(const struct skin_space *s, int x, int y, int z)
{
    return ((size_t)z * (size_t)s->size[1] + (size_t)y) * (size_t)s->size[0] + (size_t)x;
}

/* ---- distances ---- */

/* Takes a point as the closest one of a voxel if it is closer than what the voxel has. */
static void offer(const float at[3], const float point[3], float closest[3], float *distance2)
{
    float d[3];
    vec3_sub(point, at, d);
    const float d2 = vec3_dot(d, d);
    if (d2 < *distance2) {
        *distance2 = d2;
        memcpy(closest, point, 3 * sizeof *closest);
    }
}

/* Returns the point of a triangle closest to p (Ericson 2005, 5.1.5), by the regions of its corners, edges and face. */
static void closest_point(const float p[3], const float *a, const float *b, const float *c, float out[3])
{
    float ab[3], ac[3], ap[3], bp[3], cp[3];
    vec3_sub(b, a, ab);
    vec3_sub(c, a, ac);
    vec3_sub(p, a, ap);
    vec3_sub(p, b, bp);
    vec3_sub(p, c, cp);
    const float d1 = vec3_dot(ab, ap), d2 = vec3_dot(ac, ap), d3 = vec3_dot(ab, bp), d4 = vec3_dot(ac, bp), d5 = vec3_dot(ab, cp),
                d6 = vec3_dot(ac, cp);
    const float va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2, sum = va + vb + vc;
    float v, w;
    if (d1 <= 0.0f && d2 <= 0.0f) {
        v = w = 0.0f;
    } else if (d3 >= 0.0f && d4 <= d3) {
        v = 1.0f, w = 0.0f;
    } else if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f) {
        v = d1 - d3 > 0.0f ? d1 / (d1 - d3) : 0.0f, w = 0.0f;
    } else if (d6 >= 0.0f && d5 <= d6) {
        v = 0.0f, w = 1.0f;
    } else if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f) {
        v = 0.0f, w = d2 - d6 > 0.0f ? d2 / (d2 - d6) : 0.0f;
    } else if (va <= 0.0f && d4 >= d3 && d5 >= d6) {
        w = d4 - d3 + (d5 - d6) > 0.0f ? (d4 - d3) / (d4 - d3 + (d5 - d6)) : 0.0f, v = 1.0f - w;
    } else {
        v = sum > 0.0f ? vb / sum : 0.0f, w = sum > 0.0f ? vc / sum : 0.0f;
    }
    for (int k = 0; k < 3; ++k) {
        out[k] = a[k] + v * ab[k] + w * ac[k];
    }
}

/* Offers the points of a piece of a triangle to the voxels within one and a half of its box. Voxel coordinates. */
static void scan_piece(const struct skin_space *s, float (*q)[3], float *closest, float *distance2)
{
    int lo[3], hi[3];
    for (int k = 0; k < 3; ++k) {
        lo[k] = (int)ceilf(fminf(fminf(q[0][k], q[1][k]), q[2][k]) - 1.5f);
        hi[k] = (int)floorf(fmaxf(fmaxf(q[0][k], q[1][k]), q[2][k]) + 1.5f);
        lo[k] = lo[k] < 0 ? 0 : lo[k];
        hi[k] = hi[k] >= s->size[k] ? s->size[k] - 1 : hi[k];
    }
    for (int z = lo[2]; z <= hi[2]; ++z) {
        for (int y = lo[1]; y <= hi[1]; ++y) {
            for (int x = lo[0]; x <= hi[0]; ++x) {
                const float at[3] = {(float)x, (float)y, (float)z};
                const size_t v = voxel_at(s, x, y, z);
                float point[3];
                closest_point(at, q[0], q[1], q[2], point);
                offer(at, point, closest + 3 * v, distance2 + v);
            }
        }
    }
}

/* Halves a triangle at its longest edge until that is at most four voxels, so that boxes hold little else. */
static void scan_triangle(const struct skin_space *s, float (*corners)[3], float *closest, float *distance2)
{
    const float longest = 4.0f;
    float stack[DEPTH][3][3];
    int top = 1;
    memcpy(stack[0], corners, sizeof stack[0]);
    while (top) {
        float q[3][3], edge2 = -1.0f;
        int e = 0;
        memcpy(q, stack[--top], sizeof q);
        for (int k = 0; k < 3; ++k) {
            float d[3];
            vec3_sub(q[(k + 1) % 3], q[k], d);
            if (vec3_dot(d, d) > edge2) {
                edge2 = vec3_dot(d, d);
                e = k;
            }
        }
        if (edge2 <= longest * longest || top + 2 > DEPTH) {
            scan_piece(s, q, closest, distance2);
            continue;
        }
        memcpy(stack[top], q, sizeof q);
        memcpy(stack[top + 1], q, sizeof q);
        for (int k = 0; k < 3; ++k) {
            stack[top][e][k] = stack[top + 1][(e + 1) % 3][k] = 0.5f * (q[e][k] + q[(e + 1) % 3][k]);
        }
        top += 2;
    }
}

/* Hands closest points on, there and back, until all voxels within a reach have one, but those at the border of the grid. */
static void sweep(const struct skin_space *s, float reach, float *closest, float *distance2)
{
    const float beside = 2.0f, furthest2 = (reach + beside) * (reach + beside); /* the neighbors of a voxel within reach are within that */
    ptrdiff_t back[13]; /* the neighbors before the middle one of 27 */
    for (int i = 0; i < 13; ++i) {
        back[i] = ((ptrdiff_t)(i / 9 - 1) * s->size[1] + i / 3 % 3 - 1) * s->size[0] + i % 3 - 1;
    }
    for (int pass = 0; pass < 2; ++pass) {
        const ptrdiff_t way = pass ? -1 : 1;
        for (int i = 0; i < (s->size[2] - 2) * (s->size[1] - 2); ++i) {
            const int j = pass ? (s->size[2] - 2) * (s->size[1] - 2) - 1 - i : i;
            const int y = 1 + j % (s->size[1] - 2), z = 1 + j / (s->size[1] - 2);
            for (int x = pass ? s->size[0] - 2 : 1; x > 0 && x < s->size[0] - 1; x += (int)way) {
                const ptrdiff_t me = (ptrdiff_t)voxel_at(s, x, y, z);
                const float at[3] = {(float)x, (float)y, (float)z};
                for (int k = 0; k < 13 && distance2[me] > 0.0f; ++k) {
                    const ptrdiff_t other = me + way * back[k];
                    if (distance2[other] < furthest2) {
                        offer(at, closest + 3 * other, closest + 3 * me, distance2 + me);
                    }
                }
            }
        }
    }
}

static bool measure_distances(struct skin_space *s, const float *positions, const uint32_t *indices, size_t triangle_count)
{
    const size_t n = voxel_count(s);
    float *closest = malloc(3 * n * sizeof *closest);
    if (!closest) {
        return false;
    }
    for (size_t v = 0; v < n; ++v) {
        s->distance[v] = INFINITY;
    }
    for (size_t t = 0; t < triangle_count; ++t) {
        float q[3][3];
        for (int i = 0; i < 9; ++i) {
            q[i / 3][i % 3] = (positions[3 * (size_t)indices[3 * t + (size_t)(i / 3)] + (size_t)(i % 3)] - s->origin[i % 3]) / s->spacing;
        }
        scan_triangle(s, q, closest, s->distance);
    }
    sweep(s, s->limit, closest, s->distance);
    for (size_t v = 0; v < n; ++v) {
        s->distance[v] = sqrtf(s->distance[v]);
    }
    free(closest);
    return true;
}

/* ---- the widest way ---- */

/* Voxels that are reached, listed by the level of their width. */
struct frontier {
    int *next, head[LEVELS + 1], level;
};

static void reach(const struct skin_space *s, struct frontier *f, size_t v, float from)
{
    s->width[v] = fminf(fminf(from, s->distance[v]), s->limit);
    const int level = (int)(s->width[v] / s->limit * LEVELS);
    f->next[v] = f->head[level];
    f->head[level] = (int)v;
}

/* Reaches the neighbors of a voxel by faces. */
static void reach_around(const struct skin_space *s, struct frontier *f, int v)
{
    const int at[3] = {v % s->size[0], v / s->size[0] % s->size[1], v / s->size[0] / s->size[1]};
    const int step[3] = {1, s->size[0], s->size[0] * s->size[1]};
    for (int i = 0; i < 6; ++i) {
        const int k = i / 2, way = i % 2 ? 1 : -1;
        const size_t other = (size_t)(v + way * step[k]);
        if (at[k] + way >= 0 && at[k] + way < s->size[k] && s->width[other] < 0.0f) {
            reach(s, f, other, s->width[v]);
        }
    }
}

static bool measure_widths(struct skin_space *s)
{
    const size_t n = voxel_count(s);
    struct frontier f = {.next = malloc(n * sizeof *f.next)};
    if (!f.next) {
        return false;
    }
    for (size_t v = 0; v < n; ++v) {
        s->width[v] = -1.0f;
    }
    for (int i = 0; i <= LEVELS; ++i) {
        f.head[i] = -1;
    }
    reach(s, &f, 0, s->limit); /* a corner of the grid: all that lies outside is connected with it */
    for (f.level = LEVELS; f.level >= 0;) {
        const int v = f.head[f.level];
        if (v < 0) {
            --f.level;
            continue;
        }
        f.head[f.level] = f.next[v];
        reach_around(s, &f, v); /* into this level or a lower one */
    }
    free(f.next);
    return true;
}

/* ---- all ---- */

/* Lays the grid around the mesh. Returns false if it has no triangle or too many voxels. */
static bool lay_grid(struct skin_space *s, const float *positions, const uint32_t *indices, size_t triangle_count)
{
    const float margin = s->limit + 2.0f;
    float lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
    double voxels = 1.0;
    for (size_t i = 0; i < 3 * triangle_count; ++i) {
        for (int k = 0; k < 3; ++k) {
            lower[k] = fminf(lower[k], positions[3 * (size_t)indices[i] + (size_t)k]);
            upper[k] = fmaxf(upper[k], positions[3 * (size_t)indices[i] + (size_t)k]);
        }
    }
    for (int k = 0; k < 3 && triangle_count; ++k) {
        voxels *= ceil((double)(upper[k] - lower[k]) / (double)s->spacing) + 2.0 * (double)margin + 1.0;
    }
    for (int k = 0; k < 3 && triangle_count && voxels < 1e9; ++k) {
        s->size[k] = (int)ceilf((upper[k] - lower[k]) / s->spacing + 2.0f * margin) + 1;
        s->origin[k] = lower[k] - margin * s->spacing;
    }
    return triangle_count && voxels < 1e9;
}

bool skin_space_make(const float *positions, const uint32_t *indices, size_t triangle_count, float spacing, float limit,
                     struct skin_space *space)
{
    memset(space, 0, sizeof *space);
    space->spacing = spacing;
    space->limit = limit;
    if (!lay_grid(space, positions, indices, triangle_count)) {
        return false;
    }
    space->distance = malloc(voxel_count(space) * sizeof *space->distance);
    space->width = malloc(voxel_count(space) * sizeof *space->width);
    if (!space->distance || !space->width || !measure_distances(space, positions, indices, triangle_count) || !measure_widths(space)) {
        skin_space_free(space);
        return false;
    }
    return true;
}

void skin_space_free(struct skin_space *space)
{
    free(space->distance);
    free(space->width);
    memset(space, 0, sizeof *space);
}

float skin_space_width(const struct skin_space *space, const float place[3])
{
    float most = 0.0f;
    int cell[3];
    for (int k = 0; k < 3; ++k) {
        const float x = (place[k] - space->origin[k]) / space->spacing;
        if (!(x > 0.0f) || !(x < (float)(space->size[k] - 1))) {
            return space->limit;
        }
        cell[k] = (int)x;
    }
    for (int i = 0; i < 8; ++i) {
        most = fmaxf(most, space->width[voxel_at(space, cell[0] + (i & 1), cell[1] + (i >> 1 & 1), cell[2] + (i >> 2))]);
    }
    return most;
}

static bool is_chamber(const struct skin_space *s, size_t v, float radius, float fitting)
{
    return s->distance[v] >= fitting && s->width[v] >= radius && s->width[v] < fitting;
}

size_t skin_space_chambers(const struct skin_space *space, float radius, float fitting)
{
    size_t count = 0;
    for (size_t v = 0; v < voxel_count(space); ++v) {
        count += is_chamber(space, v, radius, fitting);
    }
    return count;
}

size_t skin_space_places_in_chambers(const struct skin_space *space, float radius, float fitting, size_t step, size_t most,
                                     float (*places)[3])
{
    const size_t row = (size_t)space->size[0], plane = row * (size_t)space->size[1];
    size_t count = 0, number = 0;
    for (size_t v = 0; v < voxel_count(space) && number < most; ++v) {
        if (is_chamber(space, v, radius, fitting) && count++ % step == 0) {
            const size_t at[3] = {v % row, v % plane / row, v / plane};
            for (int k = 0; k < 3; ++k) {
                places[number][k] = space->origin[k] + (float)at[k] * space->spacing;
            }
            ++number;
        }
    }
    return number;
}

double skin_space_closed(const struct skin_space *space, float radius)
{
    const size_t n = voxel_count(space);
    float *closest = malloc(3 * n * sizeof *closest), *distance2 = malloc(n * sizeof *distance2);
    double count = -1.0;
    if (closest && distance2) {
        for (size_t v = 0; v < n; ++v) {
            const bool reached = space->width[v] >= radius;
            const size_t row = (size_t)space->size[0], plane = row * (size_t)space->size[1];
            distance2[v] = reached ? 0.0f : INFINITY;
            closest[3 * v] = (float)(v % row);
            closest[3 * v + 1] = (float)(v % plane / row);
            closest[3 * v + 2] = (float)(v / plane);
        }
        sweep(space, radius, closest, distance2);
        count = 0.0;
        for (size_t v = 0; v < n; ++v) {
            count += distance2[v] > radius * radius;
        }
        count *= pow((double)space->spacing, 3.0);
    }
    free(closest);
    free(distance2);
    return count;
}
