/* resample.h - values of one grid at the places of another: maps between voxels, trilinear interpolation. */
#ifndef EXAMPLES_IMAGING_RESAMPLE_H
#define EXAMPLES_IMAGING_RESAMPLE_H

#include "base/scalar.h"
#include "imaging/volume.h"

#include <string.h>

/* Returns the place that a map, the rows of a 3x4 matrix, takes a voxel to. */
static inline void resample_place(const float map[3][4], int i, int j, int k, float x[3])
{
    for (int r = 0; r < 3; ++r) {
        x[r] = map[r][0] * (float)i + map[r][1] * (float)j + map[r][2] * (float)k + map[r][3];
    }
}

/* Returns whether a place in voxels lies in the box of a grid, which ends half a voxel beyond its outermost centers. */
static inline bool resample_in_box(const int dims[3], const float x[3])
{
    return x[0] >= -0.5f && x[1] >= -0.5f && x[2] >= -0.5f && x[0] <= (float)dims[0] - 0.5f && x[1] <= (float)dims[1] - 0.5f
           && x[2] <= (float)dims[2] - 0.5f;
}

/* Finds the sample before x on an axis of n samples, the weight of the next one, and the offset to it, 0 at the end. */
static inline size_t resample_corner(float x, int n, float *t, size_t *step)
{
    const float inside = scalar_clamp(x, 0.0f, (float)(n - 1));
    const size_t low = (size_t)inside;
    *t = inside - (float)low;
    *step = low + 1 < (size_t)n ? 1 : 0;
    return low;
}

/* A cell of voxels around a place: where its first value lies, the offsets to the neighbours (0 at the end), and the place in it. */
struct resample_cell {
    size_t first, step[3];
    float t[3];
};

static inline struct resample_cell resample_cell_at(const int dims[3], size_t channels, const float x[3])
{
    struct resample_cell cell = {.first = 0};
    size_t stride = channels;
    for (int a = 0; a < 3; ++a) {
        cell.first += resample_corner(x[a], dims[a], &cell.t[a], &cell.step[a]) * stride;
        cell.step[a] *= stride;
        stride *= (size_t)dims[a];
    }
    return cell;
}

/* Interpolates the first `lanes` values of a cell trilinearly. With a constant number of lanes the loop over them unrolls. */
static inline void resample_lanes(const struct resample_cell *cell, size_t lanes, const float *values, float *out)
{
    const float *at = values + cell->first, *t = cell->t;
    const size_t dx = cell->step[0], dy = cell->step[1], dz = cell->step[2];
    for (size_t c = 0; c < lanes; ++c, ++at) {
        const float a = at[0] + t[0] * (at[dx] - at[0]), b = at[dy] + t[0] * (at[dy + dx] - at[dy]);
        const float d = at[dz] + t[0] * (at[dz + dx] - at[dz]), e = at[dz + dy] + t[0] * (at[dz + dy + dx] - at[dz + dy]);
        const float front = a + t[1] * (b - a), back = d + t[1] * (e - d);
        out[c] = front + t[2] * (back - front);
    }
}

/* Interpolates `channels` floats a voxel trilinearly at a place in voxels; beyond the outermost voxels values are constant. */
static inline void resample_channels(const int dims[3], size_t channels, const float *values, const float x[3], float *out)
{
    const struct resample_cell cell = resample_cell_at(dims, channels, x);
    resample_lanes(&cell, channels, values, out);
}

/* The same for three channels. Four lanes are one vector of the processor and faster than three; the fourth is not used, and is read only
 * where the array goes on. */
static inline void resample_three(const int dims[3], const float *values, const float x[3], float out[3])
{
    const struct resample_cell cell = resample_cell_at(dims, 3, x);
    const size_t last = cell.first + cell.step[0] + cell.step[1] + cell.step[2];
    if (last + 4 > 3 * (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2]) {
        resample_lanes(&cell, 3, values, out);
    } else {
        float lanes[4];
        resample_lanes(&cell, 4, values, lanes);
        memcpy(out, lanes, 3 * sizeof *out);
    }
}

/* Interpolates one float a voxel. */
static inline float resample_at(const int dims[3], const float *values, const float x[3])
{
    float value;
    resample_channels(dims, 1, values, x, &value);
    return value;
}

/* Computes the map from voxels of `to` to voxels of `from`: rows of a 3x4 matrix. world: the map from the world of `to` to that of
 * `from`; NULL: they are the same. */
void resample_map(const struct volume *to, const double world[3][4], const struct volume *from, float map[3][4]);

/* Samples values of `from` trilinearly at the voxels of `to`, constant beyond the outermost voxels. world: as for resample_map.
 * valid (may be NULL): 1 where a voxel lies inside the box of `from`. */
void resample_volume(const struct volume *from, const float *values, const double world[3][4], const struct volume *to, float *result,
                     unsigned char *valid);

#endif
