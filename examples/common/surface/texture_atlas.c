#include "surface/texture_atlas.h"

#include "base/vec3.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { GUTTER = 2, MAX_TRIES = 60 }; /* texels around a chart; scales that are tried */

static const float LEAN = 0.5f;      /* cosine: triangles of a chart lean no further from its axis */
static const double FILL = 0.6;      /* share of the image that charts fill at first */
static const double SMALLER = 0.94;  /* scale of the next try */

struct chart {
    int side;            /* 0..5: +x -x +y -y +z -z */
    int first, count;    /* triangles in `order` */
    float lo[2], hi[2];  /* projected */
    int x, y;            /* upper left texel, with the gutter */
};

/* A triangle in the image; texels have their centers at whole numbers. */
struct raster {
    float p[3][2];
    int lo[2], hi[2];
};

struct unwrapping {
    const float *positions;
    const int *triangles;
    int vertex_count, triangle_count, size;
    float *normals;   /* of triangles */
    int *neighbors;   /* triangle across each edge, or -1 */
    int *chart_of;    /* of each triangle, -1: none yet */
    int *order;       /* triangles by chart */
    int *claims;      /* chart + 1 by texel, of the last chart that has covered it */
    struct chart *charts;
    int chart_count;
    float lowest[2];    /* of all projected points along any axis */
    double area, scale; /* scale: texels a unit */
    bool full;          /* charts do not fit at any scale */
};

/* ---- texels in a triangle ---- */

static struct raster make_raster(const float a[2], const float b[2], const float c[2])
{
    const struct raster r = {
        {{a[0], a[1]}, {b[0], b[1]}, {c[0], c[1]}},
        {(int)ceilf(fminf(a[0], fminf(b[0], c[0]))), (int)ceilf(fminf(a[1], fminf(b[1], c[1])))},
        {(int)floorf(fmaxf(a[0], fmaxf(b[0], c[0]))), (int)floorf(fmaxf(a[1], fmaxf(b[1], c[1])))}};
    return r;
}

/* Computes the weights of corners at a texel; returns true if it lies in the triangle made larger by `margin`, a share of it. */
static bool in_triangle(const struct raster *r, int x, int y, float margin, float weight[3])
{
    const float ux = r->p[1][0] - r->p[0][0], uy = r->p[1][1] - r->p[0][1], vx = r->p[2][0] - r->p[0][0],
                vy = r->p[2][1] - r->p[0][1], wx = (float)x - r->p[0][0], wy = (float)y - r->p[0][1], d = ux * vy - uy * vx;
    if (!(fabsf(d) > 0.0f)) {
        return false;
    }
    weight[1] = (wx * vy - wy * vx) / d;
    weight[2] = (ux * wy - uy * wx) / d;
    weight[0] = 1.0f - weight[1] - weight[2];
    return weight[0] >= -margin && weight[1] >= -margin && weight[2] >= -margin;
}

/* ---- neighbors ---- */

struct edge {
    int low, high, half; /* half: 3 * triangle + edge */
};

static int compare_edges(const void *a, const void *b)
{
    const struct edge *e = a, *f = b;
    if (e->low != f->low) {
        return e->low < f->low ? -1 : 1;
    }
    return e->high != f->high ? (e->high < f->high ? -1 : 1) : (e->half > f->half) - (e->half < f->half);
}

/* Joins triangles whose edge two of them have. */
static bool find_neighbors(struct unwrapping *u)
{
    const int count = 3 * u->triangle_count;
    struct edge *edges = malloc(((size_t)count + 1) * sizeof *edges);
    if (!edges) {
        return false;
    }
    for (int i = 0; i < count; ++i) {
        const int a = u->triangles[i], b = u->triangles[i % 3 == 2 ? i - 2 : i + 1];
        const struct edge e = {a < b ? a : b, a < b ? b : a, i};
        edges[i] = e;
        u->neighbors[i] = -1;
    }
    qsort(edges, (size_t)count, sizeof *edges, compare_edges);
    for (int i = 0, next; i < count; i = next) {
        for (next = i + 1; next < count && edges[next].low == edges[i].low && edges[next].high == edges[i].high; ++next) {}
        if (next == i + 2) {
            u->neighbors[edges[i].half] = edges[i + 1].half / 3;
            u->neighbors[edges[i + 1].half] = edges[i].half / 3;
        }
    }
    free(edges);
    return true;
}

static void find_normals(struct unwrapping *u)
{
    for (int t = 0; t < u->triangle_count; ++t) {
        const int *corner = u->triangles + 3 * t;
        float e[3], f[3], *n = u->normals + 3 * t;
        vec3_sub(u->positions + 3 * corner[1], u->positions + 3 * corner[0], e);
        vec3_sub(u->positions + 3 * corner[2], u->positions + 3 * corner[0], f);
        vec3_cross(e, f, n);
        u->area += 0.5 * (double)vec3_length(n);
        vec3_normalize(n);
    }
}

/* ---- charts ---- */

static float along(const float *normal, int side) { return side % 2 ? -normal[side / 2] : normal[side / 2]; }

/* Projects a point along a side's axis; seen from outside, triangles keep their turn. */
static void project(int side, const float *p, float out[2])
{
    const int axis = side / 2;
    out[0] = p[(axis + 1) % 3];
    out[1] = p[(axis + 2) % 3];
    out[0] = side % 2 ? -out[0] : out[0];
}

static int dominant_side(const float *normal)
{
    int best = 0;
    for (int side = 1; side < 6; ++side) {
        best = along(normal, side) > along(normal, best) ? side : best;
    }
    return best;
}

static void grow_box(struct unwrapping *u, struct chart *chart, int triangle)
{
    for (int k = 0; k < 3; ++k) {
        float p[2];
        project(chart->side, u->positions + 3 * u->triangles[3 * triangle + k], p);
        for (int i = 0; i < 2; ++i) {
            chart->lo[i] = fminf(chart->lo[i], p[i]);
            chart->hi[i] = fmaxf(chart->hi[i], p[i]);
        }
    }
}

/* Claims the texels of a triangle for the chart that grows; returns false if it has one of them already, where the surface winds
 * over itself. Texels repeat, since the chart has no place yet. */
static bool claim(struct unwrapping *u, int triangle)
{
    const struct chart *chart = &u->charts[u->chart_count];
    float p[3][2], weight[3];
    for (int k = 0; k < 3; ++k) {
        project(chart->side, u->positions + 3 * u->triangles[3 * triangle + k], p[k]);
        p[k][0] = (float)((double)(p[k][0] - u->lowest[0]) * u->scale);
        p[k][1] = (float)((double)(p[k][1] - u->lowest[1]) * u->scale);
    }
    const struct raster r = make_raster(p[0], p[1], p[2]);
    for (int pass = 0; pass < 2; ++pass) {
        for (int y = r.lo[1]; y <= r.hi[1]; ++y) {
            for (int x = r.lo[0]; x <= r.hi[0]; ++x) {
                int *owner = &u->claims[(size_t)(y % u->size) * (size_t)u->size + (size_t)(x % u->size)];
                if (in_triangle(&r, x, y, -1e-3f, weight)) {
                    if (pass == 0 && *owner == u->chart_count + 1) {
                        return false;
                    }
                    *owner = pass == 1 ? u->chart_count + 1 : *owner;
                }
            }
        }
    }
    return true;
}

/* Makes a chart of the triangle and all that are connected with it and face the same side. */
static void grow_chart(struct unwrapping *u, int seed, int first)
{
    struct chart *chart = &u->charts[u->chart_count];
    const struct chart empty = {dominant_side(u->normals + 3 * seed), first, 1, {INFINITY, INFINITY}, {-INFINITY, -INFINITY}, 0, 0};
    *chart = empty;
    u->order[first] = seed;
    u->chart_of[seed] = u->chart_count;
    claim(u, seed);
    for (int done = first; done < first + chart->count; ++done) {
        const int t = u->order[done];
        grow_box(u, chart, t);
        for (int k = 0; k < 3; ++k) {
            const int next = u->neighbors[3 * t + k];
            if (next >= 0 && u->chart_of[next] < 0 && along(u->normals + 3 * next, chart->side) > LEAN && claim(u, next)) {
                u->chart_of[next] = u->chart_count;
                u->order[first + chart->count++] = next;
            }
        }
    }
    ++u->chart_count;
}

static void grow_charts(struct unwrapping *u)
{
    int used = 0;
    for (int t = 0; t < u->triangle_count; ++t) {
        u->chart_of[t] = -1;
    }
    for (int t = 0; t < u->triangle_count; ++t) {
        if (u->chart_of[t] < 0) {
            grow_chart(u, t, used);
            used += u->charts[u->chart_count - 1].count;
        }
    }
}

/* ---- packing ---- */

static int extent(const struct unwrapping *u, const struct chart *c, int axis)
{
    return (int)ceil((double)(c->hi[axis] - c->lo[axis]) * u->scale) + 1 + 2 * GUTTER;
}

static int compare_heights(const void *a, const void *b)
{
    const struct chart *c = *(const struct chart *const *)a, *d = *(const struct chart *const *)b;
    const float one = c->hi[1] - c->lo[1], other = d->hi[1] - d->lo[1];
    return one != other ? (one < other ? 1 : -1) : (c > d) - (c < d);
}

/* Places charts, the highest first, in rows from left to right; returns false if the last row is beyond the image. */
static bool pack_rows(struct unwrapping *u, struct chart **sorted)
{
    int x = 0, y = 0, row = 0;
    for (int c = 0; c < u->chart_count; ++c) {
        const int width = extent(u, sorted[c], 0), height = extent(u, sorted[c], 1);
        if (x + width > u->size) {
            x = 0;
            y += row;
            row = 0;
        }
        if (width > u->size || y + height > u->size) {
            return false;
        }
        sorted[c]->x = x;
        sorted[c]->y = y;
        x += width;
        row = height > row ? height : row;
    }
    return true;
}

static bool pack(struct unwrapping *u)
{
    struct chart **sorted = malloc(((size_t)u->chart_count + 1) * sizeof *sorted);
    bool good = false;
    for (int c = 0; sorted && c < u->chart_count; ++c) {
        sorted[c] = &u->charts[c];
    }
    if (sorted) {
        qsort(sorted, (size_t)u->chart_count, sizeof *sorted, compare_heights);
        for (int n = 0; n < MAX_TRIES && !good; ++n, u->scale *= good ? 1.0 : SMALLER) {
            good = pack_rows(u, sorted);
        }
        u->full = !good;
    }
    free(sorted);
    return good;
}

/* ---- vertices ---- */

/* Adds a vertex for each chart that a vertex of the surface is in. */
static bool make_vertices(struct unwrapping *u, struct texture_atlas *atlas)
{
    int *made = malloc(((size_t)u->vertex_count + 1) * sizeof *made),
        *chart_of = malloc(((size_t)u->vertex_count + 1) * sizeof *chart_of);
    const size_t capacity = 3 * (size_t)u->triangle_count;
    atlas->vertex_of = malloc(capacity * sizeof *atlas->vertex_of);
    atlas->uvs = malloc(2 * capacity * sizeof *atlas->uvs);
    atlas->triangles = malloc(capacity * sizeof *atlas->triangles);
    const bool good = made && chart_of && atlas->vertex_of && atlas->uvs && atlas->triangles;
    for (int v = 0; good && v < u->vertex_count; ++v) {
        chart_of[v] = -1;
    }
    for (int i = 0; good && i < u->triangle_count; ++i) {
        const int t = u->order[i], number = u->chart_of[t];
        const struct chart *c = &u->charts[number];
        for (int k = 0; k < 3; ++k) {
            const int v = u->triangles[3 * t + k];
            if (chart_of[v] != number) {
                const int n = made[v] = atlas->vertex_count++;
                float p[2];
                chart_of[v] = number;
                atlas->vertex_of[n] = v;
                project(c->side, u->positions + 3 * v, p);
                atlas->uvs[2 * n] = (float)((c->x + GUTTER + 0.5 + (double)(p[0] - c->lo[0]) * u->scale) / u->size);
                atlas->uvs[2 * n + 1] = (float)((c->y + GUTTER + 0.5 + (double)(p[1] - c->lo[1]) * u->scale) / u->size);
            }
            atlas->triangles[3 * t + k] = made[v];
        }
    }
    free(made);
    free(chart_of);
    return good;
}

bool texture_atlas_unwrap(const float *positions, int vertex_count, const int *triangles, int triangle_count, int size,
                          struct texture_atlas *atlas)
{
    const size_t count = (size_t)triangle_count + 1;
    struct unwrapping u;
    memset(&u, 0, sizeof u);
    memset(atlas, 0, sizeof *atlas);
    u.positions = positions, u.vertex_count = vertex_count, u.size = size;
    u.triangles = triangles, u.triangle_count = triangle_count;
    u.normals = malloc(3 * count * sizeof *u.normals);
    u.neighbors = malloc(3 * count * sizeof *u.neighbors);
    u.chart_of = malloc(count * sizeof *u.chart_of);
    u.order = malloc(count * sizeof *u.order);
    u.charts = malloc(count * sizeof *u.charts);
    u.claims = calloc((size_t)size * (size_t)size + 1, sizeof *u.claims);
    bool good = u.claims && u.normals && u.neighbors && u.chart_of && u.order && u.charts && find_neighbors(&u);
    if (good) {
        find_normals(&u);
        good = u.area > 0.0 && isfinite(u.area);
        u.scale = size * sqrt(FILL / u.area);
    }
    for (int i = 0; good && i < 3 * vertex_count; ++i) {
        u.lowest[0] = u.lowest[1] = fminf(u.lowest[0], -fabsf(positions[i]));
    }
    if (good) {
        grow_charts(&u);
        good = pack(&u) && make_vertices(&u, atlas);
    }
    atlas->size = size;
    atlas->triangle_count = triangle_count;
    free(u.normals);
    free(u.neighbors);
    free(u.chart_of);
    free(u.order);
    free(u.charts);
    free(u.claims);
    if (!good) {
        texture_atlas_free(atlas);
        atlas->full = u.full;
    }
    return good;
}

void texture_atlas_free(struct texture_atlas *atlas)
{
    free(atlas->vertex_of);
    free(atlas->triangles);
    free(atlas->uvs);
    memset(atlas, 0, sizeof *atlas);
}

/* ---- baking ---- */

/* Colors the texels of a triangle, a little beyond its edges lest there are gaps; `set` marks them. */
static void bake_triangle(const struct texture_atlas *atlas, int t, texture_atlas_color *color, const void *user,
                          struct image *image, unsigned char *set)
{
    float p[3][2], weight[3];
    for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < 2; ++i) {
            p[k][i] = atlas->uvs[2 * atlas->triangles[3 * t + k] + i] * (float)atlas->size - 0.5f;
        }
    }
    const struct raster r = make_raster(p[0], p[1], p[2]);
    for (int y = r.lo[1]; y <= r.hi[1]; ++y) {
        for (int x = r.lo[0]; x <= r.hi[0]; ++x) {
            const size_t at = (size_t)y * (size_t)atlas->size + (size_t)x;
            if (in_triangle(&r, x, y, 1e-4f, weight)) {
                color(user, t, weight, image->rgb + 3 * at);
                set[at] = 1;
            }
        }
    }
}

/* Colors texels beside colored ones by the mean of these. */
static void spread(int size, struct image *image, unsigned char *set, unsigned char pass)
{
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const size_t at = (size_t)y * (size_t)size + (size_t)x;
            float sum[3] = {0.0f, 0.0f, 0.0f}, count = 0.0f;
            for (int n = 0; set[at] == 0 && n < 9; ++n) {
                const int i = x + n % 3 - 1, j = y + n / 3 - 1;
                const size_t other = (size_t)j * (size_t)size + (size_t)i;
                if (i >= 0 && j >= 0 && i < size && j < size && set[other] != 0 && set[other] < pass) {
                    vec3_add_scaled(sum, 1.0f, image->rgb + 3 * other, sum);
                    count += 1.0f;
                }
            }
            for (int k = 0; count > 0.0f && k < 3; ++k) {
                image->rgb[3 * at + (size_t)k] = sum[k] / count;
            }
            set[at] = count > 0.0f ? pass : set[at];
        }
    }
}

bool texture_atlas_bake(const struct texture_atlas *atlas, texture_atlas_color *color, const void *user, struct image *image)
{
    const size_t count = (size_t)atlas->size * (size_t)atlas->size;
    unsigned char *set = calloc(count + 1, 1);
    const bool good = set && image_create(image, atlas->size, atlas->size, color_rgb(0.5f, 0.5f, 0.5f));
    for (int t = 0; good && t < atlas->triangle_count; ++t) {
        bake_triangle(atlas, t, color, user, image, set);
    }
    for (int pass = 2; good && pass <= GUTTER + 2; ++pass) {
        spread(atlas->size, image, set, (unsigned char)pass);
    }
    free(set);
    return good;
}
