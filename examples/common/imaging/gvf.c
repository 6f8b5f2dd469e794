#include "imaging/gvf.h"

#include "base/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SWEEPS = 12, COARSE_SWEEPS = 60, MIN_SIDE = 8 };

/* |v|, as a fraction of its largest, at which the field is scaled to half length, so that it falls to 0 at edges. */
static const float half_length = 0.01f;

struct strides {
    size_t step[3];
};

static struct strides strides_of(const int dims[3])
{
    const struct strides s = {{1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]}};
    return s;
}

/* Averages 2 x 2 x 2 voxels; the last voxel of an odd side counts twice. */
static bool halve(const struct volume *fine, struct volume *half)
{
    const float spacing[3] = {1.0f, 1.0f, 1.0f}, origin[3] = {0.0f, 0.0f, 0.0f};
    const int dims[3] = {(fine->dims[0] + 1) / 2, (fine->dims[1] + 1) / 2, (fine->dims[2] + 1) / 2};
    if (!volume_create(dims, spacing, origin, half)) {
        return false;
    }
    memcpy(half->affine, fine->affine, sizeof half->affine);
    for (int a = 0; a < 3; ++a) {
        half->spacing[a] = 2.0f * fine->spacing[a];
        for (int r = 0; r < 3; ++r) {
            half->affine[r][3] += 0.5 * fine->affine[r][a];
            half->affine[r][a] = 2.0 * fine->affine[r][a];
            half->direction[r][a] = fine->direction[r][a];
        }
    }
    for (int r = 0; r < 3; ++r) {
        half->origin[r] = (float)half->affine[r][3];
    }
    const struct strides s = strides_of(fine->dims);
    for (int k = 0, n = 0; k < dims[2]; ++k) {
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                const int place[3] = {i, j, k};
                float sum = 0.0f;
                for (int corner = 0; corner < 8; ++corner) {
                    size_t at = 0;
                    for (int a = 0; a < 3; ++a) {
                        const int index = 2 * place[a] + (corner >> a & 1);
                        at += s.step[a] * (size_t)(index < fine->dims[a] ? index : index - 1);
                    }
                    sum += fine->data[at];
                }
                half->data[n] = 0.125f * sum;
            }
        }
    }
    return true;
}

/* Computes central differences in a unit of length, one-sided at the border. */
static void gradient(const struct volume *v, const float *values, const int place[3], size_t at, float unit, float out[3])
{
    const struct strides s = strides_of(v->dims);
    for (int a = 0; a < 3; ++a) {
        const bool up = place[a] + 1 < v->dims[a], down = place[a] > 0;
        const float span = (float)(up + down) * v->spacing[a] / unit;
        out[a] = span > 0.0f ? (values[up ? at + s.step[a] : at] - values[down ? at - s.step[a] : at]) / span : 0.0f;
    }
}

/* Computes f = |grad image|, scaled to a maximum of 1, into grid.data, which holds the image. */
static bool make_edge_map(struct volume *grid, float unit)
{
    const size_t total = volume_voxels(grid);
    float *edges = malloc(total * sizeof *edges), largest = 0.0f;
    if (!edges) {
        return false;
    }
    size_t n = 0;
    for (int k = 0; k < grid->dims[2]; ++k) {
        for (int j = 0; j < grid->dims[1]; ++j) {
            for (int i = 0; i < grid->dims[0]; ++i, ++n) {
                const int place[3] = {i, j, k};
                float g[3];
                gradient(grid, grid->data, place, n, unit, g);
                edges[n] = sqrtf(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
                largest = fmaxf(largest, edges[n]);
            }
        }
    }
    for (n = 0; n < total; ++n) {
        grid->data[n] = largest > 0.0f ? edges[n] / largest : 0.0f;
    }
    free(edges);
    return true;
}

/* Solves eq. 12, mu laplace v = |grad f|^2 (v - grad f), for v at each voxel of one color of a slice's checkerboard. */
static void relax_slice(const struct gvf *gvf, int k, int color, float mu, float unit)
{
    const int *dims = gvf->grid.dims;
    const struct strides s = strides_of(dims);
    for (int j = 0; j < dims[1]; ++j) {
        for (int i = (j + k + color) & 1; i < dims[0]; i += 2) {
            const int place[3] = {i, j, k};
            const size_t at = (size_t)i + s.step[1] * (size_t)j + s.step[2] * (size_t)k;
            float g[3];
            gradient(&gvf->grid, gvf->grid.data, place, at, unit, g);
            const float b = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
            float sum[3] = {b * g[0], b * g[1], b * g[2]}, weights = b;
            for (int a = 0; a < 3; ++a) {
                const float h = gvf->grid.spacing[a] / unit, w = mu / (h * h);
                for (int side = -1; side <= 1; side += 2) {
                    if (place[a] + side >= 0 && place[a] + side < dims[a]) {
                        const float *v = gvf->field + 3 * (side < 0 ? at - s.step[a] : at + s.step[a]);
                        for (int c = 0; c < 3; ++c) {
                            sum[c] += w * v[c];
                        }
                        weights += w;
                    }
                }
            }
            for (int c = 0; c < 3; ++c) {
                gvf->field[3 * at + (size_t)c] = weights > 0.0f ? sum[c] / weights : 0.0f;
            }
        }
    }
}

struct relax_loop {
    const struct gvf *gvf;
    int sweep;
    float mu;
    float unit;
};

static void run_relax_loop(void *arg, int begin, int end)
{
    const struct relax_loop *loop = arg;
    const struct gvf *gvf = loop->gvf;
    const int sweep = loop->sweep;
    const float mu = loop->mu;
    const float unit = loop->unit;
    for (int k = begin; k < end; ++k) {
        relax_slice(gvf, k, sweep & 1, mu, unit);
    }
}

static void relax(const struct gvf *gvf, int sweeps, float mu, float unit)
{
    for (int sweep = 0; sweep < 2 * sweeps; ++sweep) {
        struct relax_loop loop = {gvf, sweep, mu, unit};
        threads_for(gvf->grid.dims[2], 1, run_relax_loop, &loop);
    }
}

/* Computes the field on gvf->grid, whose data are the image, from the coarser grid's field by sweeps. */
static bool solve(struct gvf *gvf, float mu, float unit)
{
    const int *dims = gvf->grid.dims;
    struct gvf half;
    memset(&half, 0, sizeof half);
    gvf->field = calloc(3 * volume_voxels(&gvf->grid), sizeof *gvf->field);
    bool good = gvf->field != NULL;
    const bool coarsest = dims[0] < 2 * MIN_SIDE || dims[1] < 2 * MIN_SIDE || dims[2] < 2 * MIN_SIDE;
    if (good && !coarsest) {
        good = halve(&gvf->grid, &half.grid) && solve(&half, mu, unit);
        size_t n = 0;
        for (int k = 0; good && k < dims[2]; ++k) {
            for (int j = 0; j < dims[1]; ++j) {
                for (int i = 0; i < dims[0]; ++i, ++n) {
                    const size_t from = (size_t)(i / 2) + (size_t)half.grid.dims[0]
                                                            * ((size_t)(j / 2) + (size_t)half.grid.dims[1] * (size_t)(k / 2));
                    memcpy(gvf->field + 3 * n, half.field + 3 * from, 3 * sizeof(float));
                }
            }
        }
    }
    gvf_free(&half);
    good = good && make_edge_map(&gvf->grid, unit);
    if (good) {
        relax(gvf, coarsest ? COARSE_SWEEPS : SWEEPS, mu, unit);
    }
    return good;
}

static void normalize(struct gvf *gvf)
{
    const size_t total = volume_voxels(&gvf->grid);
    float largest = 0.0f;
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t n = 0; n < total; ++n) {
            float *v = gvf->field + 3 * n;
            const float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
            largest = pass == 0 ? fmaxf(largest, length) : largest;
            for (int c = 0; pass == 1 && largest > 0.0f && c < 3; ++c) {
                v[c] /= length + half_length * largest;
            }
        }
    }
}

bool gvf_compute(const struct volume *image, int halvings, float mu, float unit, struct gvf *gvf)
{
    memset(gvf, 0, sizeof *gvf);
    bool good = volume_create_padded(image, 0, &gvf->grid);
    if (good) {
        memcpy(gvf->grid.data, image->data, volume_voxels(image) * sizeof *image->data);
    }
    for (int h = 0; good && h < halvings; ++h) {
        struct volume half;
        good = halve(&gvf->grid, &half);
        volume_free(&gvf->grid);
        gvf->grid = half;
    }
    good = good && solve(gvf, mu, unit);
    if (good) {
        normalize(gvf);
    } else {
        gvf_free(gvf);
    }
    return good;
}

void gvf_sample(const struct gvf *gvf, const float index[3], float v[3])
{
    const struct strides s = strides_of(gvf->grid.dims);
    size_t base = 0, next[3];
    float t[3];
    for (int a = 0; a < 3; ++a) {
        const float x = fmaxf(0.0f, fminf((float)(gvf->grid.dims[a] - 1), index[a]));
        base += s.step[a] * (size_t)x;
        next[a] = (size_t)x + 1 < (size_t)gvf->grid.dims[a] ? s.step[a] : 0;
        t[a] = x - floorf(x);
    }
    v[0] = v[1] = v[2] = 0.0f;
    for (int corner = 0; corner < 8; ++corner) {
        size_t at = base;
        float weight = 1.0f;
        for (int a = 0; a < 3; ++a) {
            at += corner >> a & 1 ? next[a] : 0;
            weight *= corner >> a & 1 ? t[a] : 1.0f - t[a];
        }
        for (int c = 0; c < 3; ++c) {
            v[c] += weight * gvf->field[3 * at + (size_t)c];
        }
    }
}

void gvf_free(struct gvf *gvf)
{
    volume_free(&gvf->grid);
    free(gvf->field);
    memset(gvf, 0, sizeof *gvf);
}
