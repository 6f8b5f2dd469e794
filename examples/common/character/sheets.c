#include "character/sheets.h"

#include "base/bvh.h"
#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double SMALLEST = 16.0; /* voxels^2 */
static const float TIE = 0.02f;      /* voxels: a sheet half way between voxels takes one of them */

/* Converts the corners of a triangle to voxels. */
static void corners_in_voxels(const struct solid_grid *grid, const struct character *c, int triangle, float corners[9])
{
    for (int k = 0; k < 9; ++k) {
        const float world = c->positions[3 * c->triangles[3 * triangle + k / 3] + k % 3];
        corners[k] = (float)(((double)world - grid->origin[k % 3]) / grid->spacing);
    }
}

/* ---- finding ---- */

/* Returns true if a voxel around a point is inside; of a face on a plane of voxels, those on both sides are looked at. */
static bool touches_inside(const struct solid_grid *grid, const float *phi, const float point[3])
{
    int lo[3], hi[3];
    for (int k = 0; k < 3; ++k) {
        lo[k] = (int)fmaxf(0.0f, floorf(point[k] - 0.25f));
        hi[k] = (int)fminf((float)grid->size[k] - 1.0f, floorf(point[k] + 0.25f) + 1.0f);
    }
    for (int z = lo[2]; z <= hi[2]; ++z) {
        for (int y = lo[1]; y <= hi[1]; ++y) {
            for (int x = lo[0]; x <= hi[0]; ++x) {
                if (phi[((size_t)z * (size_t)grid->size[1] + (size_t)y) * (size_t)grid->size[0] + (size_t)x] < 0.0f) {
                    return true;
                }
            }
        }
    }
    return false;
}

/* Returns the area of a triangle, and whether its middle and the points half way to its corners are all away from the inside. */
static double bare_area(const struct solid_grid *grid, const float *phi, const struct character *c, int triangle, bool *bare)
{
    float corners[9], middle[3] = {0.0f, 0.0f, 0.0f}, e[3], f[3], n[3];
    corners_in_voxels(grid, c, triangle, corners);
    for (int k = 0; k < 3; ++k) {
        vec3_add_scaled(middle, 1.0f / 3.0f, corners + 3 * k, middle);
    }
    *bare = !touches_inside(grid, phi, middle);
    for (int k = 0; *bare && k < 3; ++k) {
        float half[3];
        vec3_sub(corners + 3 * k, middle, e);
        vec3_add_scaled(middle, 0.5f, e, half);
        *bare = !touches_inside(grid, phi, half);
    }
    vec3_sub(corners + 3, corners, e);
    vec3_sub(corners + 6, corners, f);
    vec3_cross(e, f, n);
    return 0.5 * (double)vec3_length(n);
}

struct corner {
    float place[3];
    int triangle;
};

static int compare_corners(const void *a, const void *b)
{
    const struct corner *s = a, *t = b;
    for (int i = 0; i < 3; ++i) {
        if (s->place[i] != t->place[i]) {
            return s->place[i] < t->place[i] ? -1 : 1;
        }
    }
    return (s->triangle > t->triangle) - (s->triangle < t->triangle);
}

static int root_of(int *parent, int t)
{
    while (parent[t] != t) {
        t = parent[t] = parent[parent[t]];
    }
    return t;
}

/* Joins marked triangles that have a corner's place in common. */
static bool join_patches(const struct character *c, const unsigned char *sheet, int *parent)
{
    struct corner *corners = malloc(3 * ((size_t)c->triangle_count + 1) * sizeof *corners);
    size_t count = 0;
    for (int i = 0; corners && i < 3 * c->triangle_count; ++i) {
        parent[i / 3] = i / 3;
        if (sheet[i / 3]) {
            memcpy(corners[count].place, c->positions + 3 * c->triangles[i], sizeof corners->place);
            corners[count++].triangle = i / 3;
        }
    }
    if (!corners) {
        return false;
    }
    qsort(corners, count, sizeof *corners, compare_corners);
    for (size_t i = 1; i < count; ++i) {
        if (memcmp(corners[i].place, corners[i - 1].place, sizeof corners->place) == 0) {
            parent[root_of(parent, corners[i].triangle)] = root_of(parent, corners[i - 1].triangle);
        }
    }
    free(corners);
    return true;
}

bool sheets_find(const struct solid_grid *grid, const float *phi, const struct character *c, unsigned char *sheet,
                 struct sheets *found)
{
    const size_t count = (size_t)c->triangle_count + 1;
    double *area = malloc(count * sizeof *area), *sum = calloc(count, sizeof *sum);
    int *parent = malloc(count * sizeof *parent);
    memset(found, 0, sizeof *found);
    bool good = area && sum && parent;
    for (int t = 0; good && t < c->triangle_count; ++t) {
        bool bare;
        area[t] = bare_area(grid, phi, c, t, &bare);
        sheet[t] = bare;
    }
    good = good && join_patches(c, sheet, parent);
    for (int t = 0; good && t < c->triangle_count; ++t) {
        sum[root_of(parent, t)] += sheet[t] ? area[t] : 0.0;
    }
    for (int t = 0; good && t < c->triangle_count; ++t) {
        sheet[t] = sheet[t] && sum[root_of(parent, t)] >= SMALLEST;
        found->triangles += sheet[t];
        found->area += sheet[t] ? area[t] : 0.0;
        found->found += sheet[t] && root_of(parent, t) == t;
    }
    free(area);
    free(sum);
    free(parent);
    return good;
}

/* ---- thickening ---- */

/* Lowers phi in the box around a triangle. */
static bool thicken_triangle(const struct solid_grid *grid, float *phi, const float corners[9], float thickness)
{
    const float reach = thickness + 2.0f;
    struct bvh one;
    int lo[3], hi[3];
    for (int i = 0; i < 3; ++i) {
        lo[i] = (int)fmaxf(1.0f, floorf(fminf(corners[i], fminf(corners[3 + i], corners[6 + i])) - reach));
        hi[i] = (int)fminf((float)grid->size[i] - 2.0f, ceilf(fmaxf(corners[i], fmaxf(corners[3 + i], corners[6 + i])) + reach));
    }
    if (!bvh_build(&one, corners, NULL, 1)) {
        return false;
    }
    for (int z = lo[2]; z <= hi[2]; ++z) {
        for (int y = lo[1]; y <= hi[1]; ++y) {
            for (int x = lo[0]; x <= hi[0]; ++x) {
                const float p[3] = {(float)x, (float)y, (float)z};
                const size_t at = ((size_t)z * (size_t)grid->size[1] + (size_t)y) * (size_t)grid->size[0] + (size_t)x;
                float near[3], d[3];
                const float distance = bvh_distance(&one, p, near, NULL);
                vec3_sub(p, near, d);
                const float axes = vec3_normalize(d) > 0.0f ? fabsf(d[0]) + fabsf(d[1]) + fabsf(d[2]) : 1.0f;
                phi[at] = fminf(phi[at], distance - 0.5f * thickness * axes - TIE);
            }
        }
    }
    bvh_free(&one);
    return true;
}

bool sheets_thicken(const struct solid_grid *grid, float *phi, const struct character *c, const unsigned char *sheet,
                    float thickness)
{
    for (int t = 0; t < c->triangle_count; ++t) {
        float corners[9];
        corners_in_voxels(grid, c, t, corners);
        if (sheet[t] && !thicken_triangle(grid, phi, corners, thickness)) {
            return false;
        }
    }
    return true;
}
