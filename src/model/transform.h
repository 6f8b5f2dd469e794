/* transform.h - conversions between voxels, world coordinates and model coordinates (springl_surface.h). */
#ifndef SPRINGLS__MODEL_TRANSFORM_H
#define SPRINGLS__MODEL_TRANSFORM_H

#include "../runtime/finite.h"
#include "../runtime/base.h"
#include "../runtime/context.h"

SPRINGLS__FN springls__v3 springls__load3(const float *p) { return springls__v3_make(p[0], p[1], p[2]); }

SPRINGLS__FN bool springls__valid_coordinate(float x) { return springls__finite_float(x) && springls__fabs(x) < 1e6f; }

/* Returns whether three coordinates, voxels, are finite and not far outside of any grid; true for NULL. */
SPRINGLS__FN bool springls__valid_point(const float *x)
{
    return !x || (springls__valid_coordinate(x[0]) && springls__valid_coordinate(x[1]) && springls__valid_coordinate(x[2]));
}

/* Multiplies a row-major 3x4 matrix and a point. */
SPRINGLS__FN void springls__transform(const double *m, double x, double y, double z, double out[3])
{
    int k;
    for (k = 0; k < 3; k++) out[k] = m[4 * k] * x + m[4 * k + 1] * y + m[4 * k + 2] * z + m[4 * k + 3];
}

/* Multiplies the left 3x3 part of a row-major 3x4 matrix and a vector, such as a velocity. */
SPRINGLS__FN springls__v3 springls__transform_vector(const double *m, springls__v3 v)
{
    const double x = (double)v.x, y = (double)v.y, z = (double)v.z;
    return springls__v3_make((float)(m[0] * x + m[1] * y + m[2] * z), (float)(m[4] * x + m[5] * y + m[6] * z),
                             (float)(m[8] * x + m[9] * y + m[10] * z));
}

/* Returns the determinant of the left 3x3 part of a row-major 3x4 matrix. */
SPRINGLS__FN double springls__determinant(const double *m)
{
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
}

/* Completes the inverse of the 3x4 matrix m; its left 3x3 part is already there. */
SPRINGLS__FN void springls__invert_translation(const double *m, double *inverse)
{
    int row;
    for (row = 0; row < 3; row++)
        inverse[4 * row + 3] = -(inverse[4 * row] * m[3] + inverse[4 * row + 1] * m[7] + inverse[4 * row + 2] * m[11]);
}

/* Returns why the numbers of a grid cannot be used, each alone; NULL when they can. */
SPRINGLS__FN const char *springls__grid_fault(const springls_grid_desc *grid)
{
    int k;
    for (k = 0; k < 3; k++) {
        if (grid->size[k] < 1) return "grid.size is not positive";
        if (grid->size[k] > 4096) return "grid.size is more than 4096 voxels a side";
        if (springls__is_nan(grid->spacing[k])) return "grid.spacing is not positive along all axes, or 0 along all";
        if (!springls__finite(grid->origin[k])) return "grid.origin is no number between -1e15 and 1e15";
    }
    for (k = 0; k < 12; k++)
        if (!springls__finite(k < 9 ? grid->direction[k] : grid->spacing[k - 9]))
            return "grid.spacing times grid.direction is no number between -1e15 and 1e15";
    return NULL;
}

/* Computes the row-major 3x4 matrices voxel -> world (forward, may be NULL) and world -> voxel. Returns NULL, or why there are
   none. */
SPRINGLS__FN const char *springls__grid_transform(const springls_grid_desc *grid, double *forward, double *inverse)
{
    double m[12], det, size = 1.0;
    int row, column;
    bool no_spacing = grid->spacing[0] == 0.0 && grid->spacing[1] == 0.0 && grid->spacing[2] == 0.0, no_direction = true;
    const char *fault = springls__grid_fault(grid);
    if (fault) return fault;
    for (row = 0; row < 9; row++) no_direction = no_direction && grid->direction[row] == 0.0;
    for (row = 0; row < 3; row++) {
        for (column = 0; column < 3; column++) {
            double direction = no_direction ? (double)(row == column) : grid->direction[3 * row + column];
            m[4 * row + column] = direction * (no_spacing ? 1.0 : grid->spacing[column]);
            if (!no_spacing && grid->spacing[column] <= 0.0) return "grid.spacing is not positive along all axes, or 0 along all";
        }
        m[4 * row + 3] = grid->origin[row];
        for (column = 0; column < 4; column++)
            if (!springls__finite(m[4 * row + column]) || fabs(m[4 * row + column]) >= 1e15)
                return column == 3 ? "grid.origin is no number between -1e15 and 1e15"
                                   : "grid.spacing times grid.direction is no number between -1e15 and 1e15";
    }
    det = springls__determinant(m);
    for (column = 0; column < 3; column++) {
        const double length = sqrt(m[column] * m[column] + m[4 + column] * m[4 + column] + m[8 + column] * m[8 + column]);
        if (length <= 1e-15 && length > 0.0) return "grid.spacing times grid.direction is less than 1e-15";
        size *= length;
    }
    if (fabs(det) <= 1e-9 * size) return "the axes of grid.direction lie in one plane";
    if (forward) memcpy(forward, m, sizeof m);
    inverse[0] = (m[5] * m[10] - m[6] * m[9]) / det;
    inverse[1] = (m[2] * m[9] - m[1] * m[10]) / det;
    inverse[2] = (m[1] * m[6] - m[2] * m[5]) / det;
    inverse[4] = (m[6] * m[8] - m[4] * m[10]) / det;
    inverse[5] = (m[0] * m[10] - m[2] * m[8]) / det;
    inverse[6] = (m[2] * m[4] - m[0] * m[6]) / det;
    inverse[8] = (m[4] * m[9] - m[5] * m[8]) / det;
    inverse[9] = (m[1] * m[8] - m[0] * m[9]) / det;
    inverse[10] = (m[0] * m[5] - m[1] * m[4]) / det;
    springls__invert_translation(m, inverse);
    return NULL;
}

/* Returns true when a window lies where springls_desc.grid places it. */
SPRINGLS__FN bool springls__is_unmoved(const springls__window *window)
{
    return window->offset[0] == 0 && window->offset[1] == 0 && window->offset[2] == 0;
}

/* Returns true when two windows lie at one place. */
SPRINGLS__FN bool springls__same_place(const springls__window *a, const springls__window *b)
{
    return memcmp(a->offset, b->offset, sizeof a->offset) == 0;
}

/* Places a window. Its matrices follow from the offset alone: no error adds up from move to move. */
SPRINGLS__FN void springls__place_window(const springls_context *ctx, springls__window *window, const int offset[3])
{
    const double *m = ctx->lattice_to_world;
    int row;
    memmove(window->offset, offset, sizeof window->offset);
    memcpy(window->to_world, m, sizeof window->to_world);
    if (!springls__is_unmoved(window))
        for (row = 0; row < 3; row++)
            window->to_world[4 * row + 3] += m[4 * row] * (double)offset[0] + m[4 * row + 1] * (double)offset[1]
                                           + m[4 * row + 2] * (double)offset[2];
    springls__invert_translation(window->to_world, window->to_voxel);
}

/* Puts the windows where they are after an input. */
SPRINGLS__FN void springls__windows_reset(springls_context *ctx)
{
    springls__place_window(ctx, &ctx->window, ctx->home);
    springls__place_window(ctx, &ctx->original_window, ctx->home);
}

/* Returns true when the direction matrix has a negative determinant: triangles then change their orientation in the world. */
SPRINGLS__FN bool springls__is_mirrored(const springls_context *ctx)
{
    return springls__determinant(ctx->window.to_world) < 0.0;
}

/* Returns the unit normal in the world of a surface with normal n in voxels: by the transpose of world -> voxel. */
SPRINGLS__FN springls__v3 springls__normal_to_world(const springls_context *ctx, springls__v3 n)
{
    const double *m = ctx->window.to_voxel;
    float unit = ctx->smallest_spacing;
    return springls__normalize(springls__v3_make(
        unit * (float)(m[0] * (double)n.x + m[4] * (double)n.y + m[8] * (double)n.z),
        unit * (float)(m[1] * (double)n.x + m[5] * (double)n.y + m[9] * (double)n.z),
        unit * (float)(m[2] * (double)n.x + m[6] * (double)n.y + m[10] * (double)n.z)));
}

/* Converts the gradient of a field, a covector, by the transpose of world -> voxel, and scales it. */
SPRINGLS__FN void springls__covector_to_world(const springls_context *ctx, springls__v3 g, double scale, float out[3])
{
    const double *m = ctx->window.to_voxel;
    int k;
    for (k = 0; k < 3; k++)
        out[k] = (float)(scale * (m[k] * (double)g.x + m[4 + k] * (double)g.y + m[8 + k] * (double)g.z));
}

/* Converts a world point to the voxel coordinates of a window. */
SPRINGLS__FN springls__v3 springls__world_to_window(const springls__window *window, const float *world)
{
    double x[3];
    springls__transform(window->to_voxel, (double)world[0], (double)world[1], (double)world[2], x);
    return springls__v3_make((float)x[0], (float)x[1], (float)x[2]);
}

/* Converts voxel coordinates of a window to the world. */
SPRINGLS__FN void springls__window_to_world(const springls__window *window, springls__v3 voxel, float world[3])
{
    double x[3];
    springls__transform(window->to_world, (double)voxel.x, (double)voxel.y, (double)voxel.z, x);
    world[0] = (float)x[0];
    world[1] = (float)x[1];
    world[2] = (float)x[2];
}

SPRINGLS__FN springls__v3 springls__world_to_voxel(const springls_context *ctx, const float *world)
{
    return springls__world_to_window(&ctx->window, world);
}

SPRINGLS__FN void springls__voxel_to_world(const springls_context *ctx, springls__v3 voxel, float world[3])
{
    springls__window_to_world(&ctx->window, voxel, world);
}

/* Converts a correspondence, or another place on the original surface. */
SPRINGLS__FN void springls__original_to_world(const springls_context *ctx, springls__v3 a, float world[3])
{
    springls__window_to_world(&ctx->original_window, a, world);
}

SPRINGLS__FN springls__v3 springls__world_to_original(const springls_context *ctx, const float *world)
{
    return springls__world_to_window(&ctx->original_window, world);
}

/* Converts a voxel coordinate to the lattice, where callbacks get it. */
SPRINGLS__FN springls__v3 springls__to_lattice(const springls__window *window, springls__v3 x)
{
    const int *o = window->offset;
    return springls__v3_make(x.x + (float)o[0], x.y + (float)o[1], x.z + (float)o[2]);
}

/* Returns a voxel coordinate after the window has moved by so many voxels. */
SPRINGLS__FN springls__v3 springls__after_move(springls__v3 x, const int voxels[3])
{
    return springls__v3_make(x.x - (float)voxels[0], x.y - (float)voxels[1], x.z - (float)voxels[2]);
}

/* Converts a place of the lattice to voxel coordinates: a move from offset 0. */
SPRINGLS__FN springls__v3 springls__from_lattice(const springls__window *window, springls__v3 x)
{
    return springls__after_move(x, window->offset);
}

/* Converts a place or a difference of places: voxels and model coordinates have one origin. */
SPRINGLS__FN springls__v3 springls__voxel_to_model(const springls_context *ctx, springls__v3 x)
{
    const double *m = ctx->window.to_world;
    double s = 1.0 / (double)ctx->smallest_spacing, v[3] = { 0.0, 0.0, 0.0 };
    int k;
    for (k = 0; k < 3; k++) v[k] = s * (m[4 * k] * (double)x.x + m[4 * k + 1] * (double)x.y + m[4 * k + 2] * (double)x.z);
    return springls__v3_make((float)v[0], (float)v[1], (float)v[2]);
}

/* Converts a place or a direction: both have the grid's origin at zero. */
SPRINGLS__FN void springls__model_to_voxel(const springls_context *ctx, springls__v3 x, double voxel[3])
{
    const double *m = ctx->window.to_voxel, unit = (double)ctx->smallest_spacing;
    int k;
    for (k = 0; k < 3; k++)
        voxel[k] = unit * (m[4 * k] * (double)x.x + m[4 * k + 1] * (double)x.y + m[4 * k + 2] * (double)x.z);
}

/* Converts a place, clamped far outside any model, so that squares of distances stay finite. */
SPRINGLS__FN springls__v3 springls__place_to_model(const springls_context *ctx, const double world[3])
{
    double s = 1.0 / (double)ctx->smallest_spacing, v[3];
    int k;
    for (k = 0; k < 3; k++) {
        v[k] = s * (world[k] - ctx->window.to_world[4 * k + 3]);
        v[k] = v[k] < -1e15 ? -1e15 : v[k] > 1e15 ? 1e15 : v[k];
    }
    return springls__v3_make((float)v[0], (float)v[1], (float)v[2]);
}

SPRINGLS__FN springls__v3 springls__world_to_model(const springls_context *ctx, const float *world)
{
    const double x[3] = { (double)world[0], (double)world[1], (double)world[2] };
    return springls__place_to_model(ctx, x);
}

SPRINGLS_API void springls_window_offset(const springls_context *ctx, int offset[3])
{
    if (offset) memset(offset, 0, 3 * sizeof *offset);
    if (ctx && offset) memcpy(offset, ctx->window.offset, sizeof ctx->window.offset);
}

SPRINGLS_API void springls_to_voxel(const springls_context *ctx, const float *world, int count, float *voxel)
{
    int i;
    if (!ctx || !world || !voxel) return;
    for (i = 0; i < count; i++) {
        springls__v3 x = springls__world_to_voxel(ctx, world + 3 * (size_t)i);
        voxel[3 * (size_t)i] = x.x;
        voxel[3 * (size_t)i + 1] = x.y;
        voxel[3 * (size_t)i + 2] = x.z;
    }
}

SPRINGLS_API void springls_to_world(const springls_context *ctx, const float *voxel, int count, float *world)
{
    int i;
    if (!ctx || !world || !voxel) return;
    for (i = 0; i < count; i++)
        springls__voxel_to_world(ctx, springls__load3(voxel + 3 * (size_t)i), world + 3 * (size_t)i);
}

#endif
