#include "registration/vgrid.h"

#include "base/threads.h"
#include "imaging/resample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- interpolation ---- */

void vgrid_sample(const int dims[3], int channels, const float *values, const float x[3], float *out)
{
    if (channels == 3) {
        resample_channels(dims, 3, values, x, out);
    } else {
        resample_channels(dims, 1, values, x, out);
    }
}

/* ---- smoothing ---- */

/* Computes out += weight * in. */
static inline void add_row(float *restrict out, const float *restrict in, float weight, size_t count)
{
    for (size_t i = 0; i < count; ++i) {
        out[i] += weight * in[i];
    }
}

static inline int clamp(int i, int n) { return i < 0 ? 0 : i < n ? i : n - 1; }

struct kernel {
    const float *weights; /* half_width + 1 of them, for distances 0, 1, ... */
    int half_width;
};

/* Smooths along x: copies the row with extended ends to a wider one, whose shifted copies are summed. */
static void smooth_row(const struct kernel *kernel, int n, size_t channels, const float *in, float *out, float *wide)
{
    const size_t count = (size_t)n * channels;
    for (int i = -kernel->half_width; i < n + kernel->half_width; ++i) {
        memcpy(wide + (size_t)(i + kernel->half_width) * channels, in + (size_t)clamp(i, n) * channels, channels * sizeof *in);
    }
    memset(out, 0, count * sizeof *out);
    for (int d = -kernel->half_width; d <= kernel->half_width; ++d) {
        add_row(out, wide + (size_t)(d + kernel->half_width) * channels, kernel->weights[abs(d)], count);
    }
}

struct across_loop {
    const struct kernel *kernel;
    const int *dims;
    int axis;
    size_t row;
    size_t slice;
    size_t stride;
    const float *in;
    float *out;
};

static void run_across_loop(void *arg, int begin, int end)
{
    const struct across_loop *loop = arg;
    const struct kernel *kernel = loop->kernel;
    const int *dims = loop->dims;
    const int axis = loop->axis;
    const size_t row = loop->row;
    const size_t slice = loop->slice;
    const size_t stride = loop->stride;
    const float *in = loop->in;
    float *out = loop->out;
    for (int k = begin; k < end; ++k) {
        for (int j = 0; j < dims[1]; ++j) {
            float *to = out + (size_t)k * slice + (size_t)j * row;
            const int place = axis == 1 ? j : k;
            const float *line = in + (size_t)k * slice + (size_t)j * row - (size_t)place * stride;
            memset(to, 0, row * sizeof *to);
            for (int d = -kernel->half_width; d <= kernel->half_width; ++d) {
                add_row(to, line + (size_t)clamp(place + d, dims[axis]) * stride, kernel->weights[abs(d)], row);
            }
        }
    }
}

/* Smooths along y (axis 1) or z (axis 2) by summing whole rows. */
static void smooth_across(const struct kernel *kernel, const int dims[3], int axis, size_t row, const float *in, float *out)
{
    const size_t slice = row * (size_t)dims[1], stride = axis == 1 ? row : slice;
    struct across_loop loop = {kernel, dims, axis, row, slice, stride, in, out};
    threads_for(dims[2], 1, run_across_loop, &loop);
}

struct along_loop {
    const struct kernel *kernel;
    const int *dims;
    size_t channels;
    size_t row;
    const float *in;
    float *out;
    float *wide;
    size_t wide_size;
};

static void run_along_loop(void *arg, int begin, int end)
{
    const struct along_loop *loop = arg;
    const struct kernel *kernel = loop->kernel;
    const int *dims = loop->dims;
    const size_t channels = loop->channels;
    const size_t row = loop->row;
    const float *in = loop->in;
    float *out = loop->out;
    float *wide = loop->wide;
    const size_t wide_size = loop->wide_size;
    for (int k = begin; k < end; ++k) {
        for (int j = 0; j < dims[1]; ++j) {
            const size_t at = row * ((size_t)j + (size_t)dims[1] * (size_t)k);
            smooth_row(kernel, dims[0], channels, in + at, out + at, wide + (size_t)k * wide_size);
        }
    }
}

static void smooth_along_x(const struct kernel *kernel, const int dims[3], size_t channels, const float *in, float *out,
                           float *wide, size_t wide_size)
{
    const size_t row = (size_t)dims[0] * channels;
    struct along_loop loop = {kernel, dims, channels, row, in, out, wide, wide_size};
    threads_for(dims[2], 1, run_along_loop, &loop);
}

bool vgrid_smooth(const int dims[3], int channels, float sigma, float *data, float *scratch)
{
    const int half_width = (int)ceilf(3.0f * sigma);
    const size_t row = (size_t)dims[0] * (size_t)channels, wide_size = row + (size_t)(2 * half_width * channels);
    const size_t bytes = vgrid_voxels(dims) * (size_t)channels * sizeof *data;
    float sum = 0.0f;
    if (!(sigma > 0.01f)) {
        return true;
    }
    float *weights = malloc((size_t)(half_width + 1) * sizeof *weights);
    float *wide = malloc(wide_size * (size_t)dims[2] * sizeof *wide); /* a row for each slice, so for each thread */
    if (weights && wide) {
        for (int d = 0; d <= half_width; ++d) {
            weights[d] = expf(-0.5f * (float)(d * d) / (sigma * sigma));
            sum += d > 0 ? 2.0f * weights[d] : weights[d];
        }
        for (int d = 0; d <= half_width; ++d) {
            weights[d] /= sum;
        }
        const struct kernel kernel = {weights, half_width};
        smooth_along_x(&kernel, dims, (size_t)channels, data, scratch, wide, wide_size);
        smooth_across(&kernel, dims, 1, row, scratch, data);
        smooth_across(&kernel, dims, 2, row, data, scratch);
        memcpy(data, scratch, bytes);
    }
    const bool good = weights && wide;
    free(weights);
    free(wide);
    return good;
}

/* ---- maps ---- */

/* Computes x + s u(x) at voxel (i,j,k). */
static inline void target(const float *u, float s, int i, int j, int k, float x[3])
{
    x[0] = (float)i + s * u[0];
    x[1] = (float)j + s * u[1];
    x[2] = (float)k + s * u[2];
}

struct warp_loop {
    const int *dims;
    const float *values;
    const float *u;
    float *out;
    size_t slice;
};

static void run_warp_loop(void *arg, int begin, int end)
{
    const struct warp_loop *loop = arg;
    const int *dims = loop->dims;
    const float *values = loop->values;
    const float *u = loop->u;
    float *out = loop->out;
    const size_t slice = loop->slice;
    for (int k = begin; k < end; ++k) {
        size_t n = (size_t)k * slice;
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                float x[3];
                target(u + 3 * n, 1.0f, i, j, k, x);
                resample_channels(dims, 1, values, x, out + n);
            }
        }
    }
}

void vgrid_warp(const int dims[3], const float *values, const float *u, float *out)
{
    const size_t slice = (size_t)dims[0] * (size_t)dims[1];
    struct warp_loop loop = {dims, values, u, out, slice};
    threads_for(dims[2], 1, run_warp_loop, &loop);
}

struct blend_loop {
    const int *dims;
    float a;
    const float *first;
    float b;
    const float *after;
    float s;
    float *out;
    size_t slice;
};

static void run_blend_loop(void *arg, int begin, int end)
{
    const struct blend_loop *loop = arg;
    const int *dims = loop->dims;
    const float a = loop->a;
    const float *first = loop->first;
    const float b = loop->b;
    const float *after = loop->after;
    const float s = loop->s;
    float *out = loop->out;
    const size_t slice = loop->slice;
    for (int k = begin; k < end; ++k) {
        size_t n = (size_t)k * slice;
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                float x[3], there[3];
                target(first + 3 * n, s, i, j, k, x);
                resample_channels(dims, 3, after, x, there);
                for (size_t c = 0; c < 3; ++c) {
                    out[3 * n + c] = a * first[3 * n + c] + b * there[c];
                }
            }
        }
    }
}

/* Computes out(x) = a * first(x) + b * after(x + s first(x)). */
static void blend(const int dims[3], float a, const float *first, float b, const float *after, float s, float *out)
{
    const size_t slice = (size_t)dims[0] * (size_t)dims[1];
    struct blend_loop loop = {dims, a, first, b, after, s, out, slice};
    threads_for(dims[2], 1, run_blend_loop, &loop);
}

void vgrid_compose(const int dims[3], const float *after, const float *first, float *out)
{
    blend(dims, 1.0f, first, 1.0f, after, 1.0f, out);
}

void vgrid_exp(const int dims[3], const float *v, float scale, float longest, float *out, float *scratch)
{
    const float length = fabsf(scale) * vgrid_longest(dims, v);
    int squarings = 0;
    while (squarings < 30 && ldexpf(length, -squarings) > longest) {
        ++squarings;
    }
    const float step = ldexpf(scale, -squarings);
    float *now = squarings % 2 ? scratch : out, *next = squarings % 2 ? out : scratch; /* the last one is `out` */
    blend(dims, 0.0f, v, step, v, 0.5f * step, now); /* midpoint rule: h v(x + h/2 v(x)) */
    for (int s = 0; s < squarings; ++s) {
        float *before = now;
        vgrid_compose(dims, now, now, next);
        now = next;
        next = before;
    }
}

float vgrid_invert(const int dims[3], const float *u, int iterations, float *inverse, float *scratch)
{
    const size_t count = 3 * vgrid_voxels(dims);
    memset(inverse, 0, count * sizeof *inverse);
    for (int i = 0; i < iterations; ++i) {
        blend(dims, 0.0f, inverse, -1.0f, u, 1.0f, scratch);
        memcpy(inverse, scratch, count * sizeof *inverse);
    }
    vgrid_compose(dims, u, inverse, scratch);
    return vgrid_longest(dims, scratch);
}

float vgrid_longest(const int dims[3], const float *u)
{
    float longest = 0.0f;
    for (size_t n = 0; n < vgrid_voxels(dims); ++n) {
        const float length = u[3 * n] * u[3 * n] + u[3 * n + 1] * u[3 * n + 1] + u[3 * n + 2] * u[3 * n + 2];
        longest = fmaxf(longest, length);
    }
    return sqrtf(longest);
}

struct jacobian_loop {
    const int *dims;
    const float *u;
    float *determinants;
    const size_t *strides;
};

static void run_jacobian_loop(void *arg, int begin, int end)
{
    const struct jacobian_loop *loop = arg;
    const int *dims = loop->dims;
    const float *u = loop->u;
    float *determinants = loop->determinants;
    const size_t *strides = loop->strides;
    for (int k = begin; k < end; ++k) {
        size_t n = (size_t)k * (size_t)dims[0] * (size_t)dims[1];
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                const int place[3] = {i, j, k};
                float d[3][3]; /* d[a] = column a of I + du/dx */
                for (int a = 0; a < 3; ++a) {
                    const size_t up = place[a] + 1 < dims[a] ? strides[a] : 0, down = place[a] > 0 ? strides[a] : 0;
                    const float h = up && down ? 0.5f : up || down ? 1.0f : 0.0f;
                    for (size_t c = 0; c < 3; ++c) {
                        d[a][c] = (c == (size_t)a ? 1.0f : 0.0f) + h * (u[3 * n + c + up] - u[3 * n + c - down]);
                    }
                }
                determinants[n] = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1])
                                  - d[1][0] * (d[0][1] * d[2][2] - d[0][2] * d[2][1])
                                  + d[2][0] * (d[0][1] * d[1][2] - d[0][2] * d[1][1]);
            }
        }
    }
}

void vgrid_jacobian(const int dims[3], const float *u, float *determinants)
{
    const size_t strides[3] = {3, 3 * (size_t)dims[0], 3 * (size_t)dims[0] * (size_t)dims[1]};
    struct jacobian_loop loop = {dims, u, determinants, strides};
    threads_for(dims[2], 1, run_jacobian_loop, &loop);
}
