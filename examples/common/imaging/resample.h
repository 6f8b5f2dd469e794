/* resample.h - values of one grid at the places of another: maps between voxels, trilinear interpolation. */
#ifndef EXAMPLES_IMAGING_RESAMPLE_H
#define EXAMPLES_IMAGING_RESAMPLE_H

#include "base/scalar.h"
#include "imaging/volume.h"

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

/* Interpolates `channels` floats a voxel trilinearly at a place in voxels; beyond the outermost voxels values are constant. With a
 * constant number of channels the loop over them unrolls. */
static inline void resample_channels(const int dims[3], size_t channels, const float *values, const float x[3], float *out)
{
    float t[3];
    size_t step[3], low[3];
    for (int a = 0; a < 3; ++a) {
        low[a] = resample_corner(x[a], dims[a], &t[a], &step[a]);
    }
    const size_t row = (size_t)dims[0] * channels, slice = row * (size_t)dims[1];
    const float *at = values + low[0] * channels + low[1] * row + low[2] * slice;
    const size_t dx = step[0] * channels, dy = step[1] * row, dz = step[2] * slice;
    for (size_t c = 0; c < channels; ++c, ++at) {
        const float a = at[0] + t[0] * (at[dx] - at[0]), b = at[dy] + t[0] * (at[dy + dx] - at[dy]);
        const float d = at[dz] + t[0] * (at[dz + dx] - at[dz]), e = at[dz + dy] + t[0] * (at[dz + dy + dx] - at[dz + dy]);
        const float front = a + t[1] * (b - a), back = d + t[1] * (e - d);
        out[c] = front + t[2] * (back - front);
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
