/* walls.c - all walls of a layer as one mesh with two labels a triangle, of which no triangle crosses another: what mesh generators take.
 *
 * Two triangles on both sides of a wall's diagonal may cross those of another wall where labels are thin. A vertex lies inside its cell,
 * so the line between those of two cells that share a face passes through that face. The pair of voxels p, q of a wall and two
 * neighbouring vertices of it make a tetrahedron; those of all pairs fill space without overlap (Ju and Udeshi 2006). Triangles within the
 * four tetrahedra of their wall cross no others: the two at a diagonal mostly do, four to a point between p and q always. */
#include "surfaces/surfaces.h"

#include "base/output_file.h"
#include "base/scalar.h"
#include "springls/run_options.h"
#include "surfaces/net.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A wall about its pair of voxels: two coordinates across the pair, from its line, and the height above the first voxel. */
struct quad {
    double u[4], v[4], h[4];
    uint32_t corner[4];
};

static double square(double x) { return x * x; }

/* Finds where the diagonal from corner a passes the plane of the pair's line and another corner: how far out, in that corner's distance
 * from the line, negative behind the line; and how high. */
static double pass_corner(const struct quad *q, int a, int corner, double *height)
{
    const int c = (a + 2) % 4;
    const double u = q->u[corner], v = q->v[corner];
    const double at_a = u * q->v[a] - v * q->u[a], at_c = u * q->v[c] - v * q->u[c], t = at_a / (at_a - at_c);
    *height = q->h[a] + t * (q->h[c] - q->h[a]);
    return ((q->u[a] + t * (q->u[c] - q->u[a])) * u + (q->v[a] + t * (q->v[c] - q->v[a])) * v) / (u * u + v * v);
}

/* Returns whether both triangles at the diagonal from corner a lie in the wall's tetrahedra. */
static bool is_safe(const struct quad *q, int a)
{
    const double least = 1e-3; /* voxel */
    double r, h;
    const int beside = pass_corner(q, a, (a + 1) % 4, &h) < 0.0 ? (a + 3) % 4 : (a + 1) % 4, other = (beside + 2) % 4;
    r = pass_corner(q, a, beside, &h);
    if (r > 1.0 - least || h < r * q->h[beside] + least || h > r * q->h[beside] + 1.0 - r - least) {
        return false;
    }
    r = -pass_corner(q, a, other, &h); /* the line pierces the triangle with the other corner */
    h = (r * q->h[other] + h) / (1.0 + r);
    return r >= 0.0 && h > least && h < 1.0 - least;
}

/* Returns where the diagonal begins, the shorter one if that is safe; -1: neither is. */
static int diagonal_of(const struct quad *q)
{
    double length[2];
    for (int a = 0; a < 2; ++a) {
        length[a] = square(q->u[a] - q->u[a + 2]) + square(q->v[a] - q->v[a + 2]) + square(q->h[a] - q->h[a + 2]);
    }
    const int shorter = length[1] < length[0];
    return is_safe(q, shorter) ? shorter : is_safe(q, 1 - shorter) ? 1 - shorter : -1;
}

static void add_triangle(struct surfaces_walls *walls, uint32_t a, uint32_t b, uint32_t c, const uint32_t labels[2])
{
    memcpy(walls->triangles + 3 * walls->triangle_count, (const uint32_t[3]){a, b, c}, 3 * sizeof a);
    memcpy(walls->labels + 2 * walls->triangle_count, labels, 2 * sizeof *labels);
    ++walls->triangle_count;
}

/* Adds the wall across the edge of a cell from its first corner along an axis: counts it where there is no room yet. */
static void add_wall(struct surfaces_walls *walls, const struct net *net, uint32_t cell, int axis, const uint32_t labels[2])
{
    static const int back[4][2] = {{1, 1}, {0, 1}, {0, 0}, {1, 0}}; /* counter-clockwise seen along the axis */
    const size_t stride[3] = {1, (size_t)net->dims[0], (size_t)net->dims[0] * (size_t)net->dims[1]};
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    const int place[3] = {(int)(cell % stride[1]) - 1, (int)(cell / stride[1] % (size_t)net->dims[1]) - 1, (int)(cell / stride[2]) - 1};
    struct quad quad;
    double height = 0.0;
    for (int q = 0; q < 4; ++q) {
        quad.corner[q] = (uint32_t)net->vertex_of[cell - (size_t)back[q][0] * stride[b] - (size_t)back[q][1] * stride[c]];
        const float *x = net->places + 3 * (size_t)quad.corner[q];
        quad.u[q] = (double)x[b] - place[b];
        quad.v[q] = (double)x[c] - place[c];
        quad.h[q] = (double)x[axis] - place[axis];
        height += 0.25 * quad.h[q];
    }
    const int first = diagonal_of(&quad);
    if (!walls->triangles) {
        walls->triangle_count += first < 0 ? 4 : 2;
        walls->vertex_count += first < 0;
        return;
    }
    const uint32_t *v = quad.corner, middle = (uint32_t)walls->vertex_count;
    if (first < 0) {
        float *x = walls->places + 3 * walls->vertex_count++;
        x[axis] = (float)place[axis] + scalar_clamp((float)height, 0.02f, 0.98f);
        x[b] = (float)place[b];
        x[c] = (float)place[c];
    } else {
        add_triangle(walls, v[first], v[first + 1], v[first + 2], labels);
        add_triangle(walls, v[first], v[first + 2], v[(first + 3) % 4], labels);
    }
    for (int q = 0; q < 4 && first < 0; ++q) {
        add_triangle(walls, v[q], v[(q + 1) % 4], middle, labels);
    }
}

static void add_all(struct surfaces_walls *walls, const struct net *net, const struct volume *map)
{
    walls->vertex_count = net->count;
    walls->triangle_count = 0;
    for (size_t n = 0; n < net->count; ++n) {
        uint32_t corners[8];
        net_corners(map->dims, map->ids, net, net->cells[n], corners);
        for (int axis = 0; axis < 3; ++axis) {
            const uint32_t labels[2] = {corners[0], corners[1 << axis]};
            if (labels[0] != labels[1]) {
                add_wall(walls, net, net->cells[n], axis, labels);
            }
        }
    }
}

bool surfaces_make_walls(struct surfaces *run, const struct net *net, bool mirrored)
{
    struct surfaces_walls *grown = realloc(run->walls, (run->wall_count + 1) * sizeof *grown), *walls;
    if (!grown) {
        return false;
    }
    run->walls = grown;
    walls = &run->walls[run->wall_count++];
    memset(walls, 0, sizeof *walls);
    walls->layer = run->map.frame;
    add_all(walls, net, &run->map);
    walls->places = malloc((3 * walls->vertex_count + 1) * sizeof *walls->places);
    walls->labels = malloc((2 * walls->triangle_count + 1) * sizeof *walls->labels);
    walls->triangles = malloc((3 * walls->triangle_count + 1) * sizeof *walls->triangles);
    if (!walls->places || !walls->triangles || !walls->labels) {
        return false;
    }
    memcpy(walls->places, net->places, 3 * net->count * sizeof *walls->places);
    add_all(walls, net, &run->map);
    for (size_t v = 0; v < walls->vertex_count; ++v) {
        volume_index_to_world(&run->map, walls->places + 3 * v, walls->places + 3 * v);
    }
    for (size_t t = 0; mirrored && t < walls->triangle_count; ++t) {
        uint32_t *corner = walls->triangles + 3 * t;
        const uint32_t kept = corner[0];
        corner[0] = corner[1];
        corner[1] = kept;
    }
    return true;
}

/* Writes a legacy VTK file. */
static bool write_vtk(const struct surfaces_walls *walls, const char *path)
{
    struct output_file output;
    errno = 0;
    if (!output_file_open(&output, path)) {
        return cli_write_failed("surfaces", path);
    }
    FILE *file = output.file;
    fprintf(file, "# vtk DataFile Version 3.0\nwalls, millimetres, RAS+\nASCII\nDATASET POLYDATA\nPOINTS %zu float\n", walls->vertex_count);
    for (size_t v = 0; v < walls->vertex_count; ++v) {
        const float *x = walls->places + 3 * v;
        fprintf(file, "%.9g %.9g %.9g\n", (double)x[0], (double)x[1], (double)x[2]);
    }
    fprintf(file, "POLYGONS %zu %zu\n", walls->triangle_count, 4 * walls->triangle_count);
    for (size_t t = 0; t < walls->triangle_count; ++t) {
        const uint32_t *v = walls->triangles + 3 * t;
        fprintf(file, "3 %lu %lu %lu\n", (unsigned long)v[0], (unsigned long)v[1], (unsigned long)v[2]);
    }
    fprintf(file, "CELL_DATA %zu\nSCALARS labels unsigned_int 2\nLOOKUP_TABLE default\n", walls->triangle_count);
    for (size_t t = 0; t < walls->triangle_count; ++t) {
        fprintf(file, "%lu %lu\n", (unsigned long)walls->labels[2 * t], (unsigned long)walls->labels[2 * t + 1]);
    }
    return output_file_close(&output, ferror(file) == 0) || cli_write_failed("surfaces", path);
}

bool surfaces_write_walls(const struct surfaces *run)
{
    bool good = true;
    for (size_t n = 0; good && n < run->wall_count; ++n) {
        char file[40] = "walls.vtk", path[1024];
        if (run->layers > 1) {
            snprintf(file, sizeof file, "layer_%d_walls.vtk", run->walls[n].layer);
        }
        good = write_vtk(&run->walls[n], run_path(run->settings.common.out, file, path, sizeof path));
    }
    return good;
}

void surfaces_free_walls(struct surfaces *run)
{
    for (size_t n = 0; n < run->wall_count; ++n) {
        free(run->walls[n].places);
        free(run->walls[n].triangles);
        free(run->walls[n].labels);
    }
    free(run->walls);
}
