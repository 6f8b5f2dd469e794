/* register_affine.c - register_affine by Levenberg-Marquardt on the sum of squared differences. */
#include "registration/register.h"

#include "base/threads.h"
#include "registration/vgrid.h"

#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PARAMETERS = 12, ITERATIONS = 40 };

/* Normal equations of one slice or of all slices. */
struct normal {
    double a[MAX_PARAMETERS][MAX_PARAMETERS], b[MAX_PARAMETERS], squares, number;
};

struct problem {
    const struct volume *fixed, *moving;
    int parameters; /* 3, 6, 12 */
    double center[3], radius; /* of the fixed image, mm: a parameter's unit is a displacement at about this radius */
    struct normal *slices;
};

static int parameters_of(enum register_align align)
{
    return align == REGISTER_ALIGN_TRANSLATION ? 3 : align == REGISTER_ALIGN_RIGID ? 6 : 12;
}

/* Computes the derivative of the mapped point by each parameter: translations, then rotations about the mapped center or a
 * matrix. */
static void motions(const struct problem *p, const double map[3][4], const float world[3], double m[MAX_PARAMETERS][3])
{
    double x[3], turned[3];
    memset(m, 0, MAX_PARAMETERS * sizeof *m);
    for (int a = 0; a < 3; ++a) {
        x[a] = ((double)world[a] - p->center[a]) / p->radius;
        m[a][a] = 1.0;
    }
    for (int r = 0; r < 3; ++r) {
        turned[r] = map[r][0] * x[0] + map[r][1] * x[1] + map[r][2] * x[2];
    }
    for (int a = 0; a < 3 && p->parameters == 6; ++a) { /* e_a x turned */
        m[3 + a][(a + 1) % 3] = -turned[(a + 2) % 3];
        m[3 + a][(a + 2) % 3] = turned[(a + 1) % 3];
    }
    for (int n = 0; n < 9 && p->parameters == 12; ++n) {
        m[3 + n][n / 3] = x[n % 3];
    }
}

/* Samples the moving image and its gradient per mm of the world. Returns false beyond the image, which ends half a voxel
 * beyond the outermost centers, so that a small motion from an identical grid leaves no voxel out. */
static bool look(const struct volume *moving, const float world[3], float *value, double gradient[3])
{
    float x[3];
    volume_world_to_index(moving, world, x);
    for (int a = 0; a < 3; ++a) {
        if (!(x[a] >= -0.5f && x[a] <= (float)moving->dims[a] - 0.5f)) {
            return false;
        }
    }
    vgrid_sample(moving->dims, 1, moving->data, x, value);
    memset(gradient, 0, 3 * sizeof *gradient);
    for (int a = 0; a < 3; ++a) {
        float up[3] = {x[0], x[1], x[2]}, down[3] = {x[0], x[1], x[2]}, after, before;
        up[a] += 0.5f;
        down[a] -= 0.5f;
        vgrid_sample(moving->dims, 1, moving->data, up, &after);
        vgrid_sample(moving->dims, 1, moving->data, down, &before);
        for (int r = 0; r < 3; ++r) { /* assumes perpendicular axes, which is accurate enough for others */
            gradient[r] += (double)(after - before) * (double)(moving->direction[r][a] / moving->spacing[a]);
        }
    }
    return true;
}

static void add_voxel(const struct problem *p, const double map[3][4], const float world[3], float wanted, struct normal *out)
{
    double gradient[3], m[MAX_PARAMETERS][3], jacobian[MAX_PARAMETERS];
    float mapped[3], value;
    volume_apply(map, world, mapped);
    if (!look(p->moving, mapped, &value, gradient)) {
        return;
    }
    const double residual = (double)(wanted - value);
    motions(p, map, world, m);
    for (int i = 0; i < p->parameters; ++i) {
        jacobian[i] = gradient[0] * m[i][0] + gradient[1] * m[i][1] + gradient[2] * m[i][2];
    }
    for (int i = 0; i < p->parameters; ++i) {
        out->b[i] += jacobian[i] * residual;
        for (int j = 0; j <= i; ++j) {
            out->a[i][j] += jacobian[i] * jacobian[j];
        }
    }
    out->squares += residual * residual;
    out->number += 1.0;
}

struct equations_loop {
    const struct problem *p;
    const double (*map)[4];
    const int *dims;
};

static void run_equations_loop(void *arg, int begin, int end)
{
    const struct equations_loop *loop = arg;
    const struct problem *p = loop->p;
    const double (*map)[4] = loop->map;
    const int *dims = loop->dims;
    for (int k = begin; k < end; ++k) {
        const float *values = p->fixed->data + (size_t)k * (size_t)dims[0] * (size_t)dims[1];
        memset(&p->slices[k], 0, sizeof *p->slices);
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i) {
                const float index[3] = {(float)i, (float)j, (float)k};
                float world[3];
                volume_index_to_world(p->fixed, index, world);
                add_voxel(p, map, world, *values++, &p->slices[k]);
            }
        }
    }
}

/* Builds the equations; returns the mean squared difference where the images overlap, INFINITY where they hardly do. */
static double equations(const struct problem *p, const double map[3][4], struct normal *sum)
{
    const int *dims = p->fixed->dims;
    struct equations_loop loop = {p, map, dims};
    threads_for(dims[2], 1, run_equations_loop, &loop);
    memset(sum, 0, sizeof *sum);
    for (int k = 0; k < dims[2]; ++k) {
        const double *slice = (const double *)(const void *)&p->slices[k];
        for (size_t n = 0; n < sizeof *sum / sizeof(double); ++n) {
            ((double *)(void *)sum)[n] += slice[n];
        }
    }
    return sum->number >= register_min_voxels(p->fixed, p->moving) ? sum->squares / sum->number : INFINITY;
}

/* Computes the matrix of a rotation about `axis` by its length (Rodrigues). */
static void rotation(const double axis[3], double r[3][3])
{
    const double angle = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    const double s = angle > 1e-12 ? sin(angle) / angle : 1.0, c = angle > 1e-12 ? (1.0 - cos(angle)) / (angle * angle) : 0.5;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            r[i][j] = c * axis[i] * axis[j] + (i == j ? cos(angle) : 0.0);
        }
        r[(i + 2) % 3][(i + 1) % 3] += s * axis[i];
        r[(i + 1) % 3][(i + 2) % 3] -= s * axis[i];
    }
}

/* Updates the map x -> M (x - center) + t by a step of the parameters. */
static void move(const struct problem *p, const double map[3][4], const double *step, double out[3][4])
{
    double matrix[3][3], r[3][3], at_center[3];
    for (int i = 0; i < 3; ++i) {
        at_center[i] = map[i][3] + step[i];
        for (int j = 0; j < 3; ++j) {
            at_center[i] += map[i][j] * p->center[j];
            matrix[i][j] = map[i][j] + (p->parameters == 12 ? step[3 + 3 * i + j] / p->radius : 0.0);
        }
    }
    if (p->parameters == 6) {
        const double axis[3] = {step[3] / p->radius, step[4] / p->radius, step[5] / p->radius};
        rotation(axis, r);
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                matrix[i][j] = r[i][0] * map[0][j] + r[i][1] * map[1][j] + r[i][2] * map[2][j];
            }
        }
    }
    for (int i = 0; i < 3; ++i) {
        out[i][3] = at_center[i];
        for (int j = 0; j < 3; ++j) {
            out[i][j] = matrix[i][j];
            out[i][3] -= matrix[i][j] * p->center[j];
        }
    }
}

/* Solves (A + damping diag A) step = b. */
static bool solve(const struct problem *p, const struct normal *sum, double damping, double step[MAX_PARAMETERS])
{
    double a[MAX_PARAMETERS * MAX_PARAMETERS];
    const int n = p->parameters;
    double trace = 0.0;
    for (int i = 0; i < n; ++i) {
        trace += sum->a[i][i];
    }
    for (int i = 0; i < n; ++i) {
        step[i] = sum->b[i];
        for (int j = 0; j <= i; ++j) {
            a[i * n + j] = sum->a[i][j];
        }
        a[i * n + i] += damping * sum->a[i][i] + 1e-9 * trace;
    }
    return trace > 0.0 && LAPACKE_dposv(LAPACK_ROW_MAJOR, 'L', n, 1, a, n, step, 1) == 0;
}

static void improve(const struct problem *p, double map[3][4])
{
    struct normal sum, tried;
    double damping = 1e-3, now = equations(p, (const double(*)[4])map, &sum);
    for (int i = 0; i < ITERATIONS && isfinite(now) && damping < 1e6; ++i) {
        double step[MAX_PARAMETERS], next[3][4];
        if (!solve(p, &sum, damping, step)) {
            return;
        }
        move(p, (const double(*)[4])map, step, next);
        const double then = equations(p, (const double(*)[4])next, &tried);
        if (then < now) {
            const bool settled = then > 0.9999 * now;
            memcpy(map, next, sizeof next);
            now = then;
            sum = tried;
            damping *= 0.3;
            if (settled) {
                return;
            }
        } else {
            damping *= 10.0;
        }
    }
}

bool register_affine(const struct volume *fixed, const struct volume *moving, enum register_align align, double map[3][4])
{
    struct problem p = {.fixed = fixed, .moving = moving, .parameters = parameters_of(align)};
    const float middle[3] = {0.5f * (float)(fixed->dims[0] - 1), 0.5f * (float)(fixed->dims[1] - 1),
                             0.5f * (float)(fixed->dims[2] - 1)};
    float center[3];
    p.slices = malloc((size_t)fixed->dims[2] * sizeof *p.slices);
    if (!p.slices) {
        return false;
    }
    volume_index_to_world(fixed, middle, center);
    for (int a = 0; a < 3; ++a) {
        const double half = 0.5 * (double)fixed->spacing[a] * fixed->dims[a];
        p.center[a] = (double)center[a];
        p.radius += half * half;
    }
    p.radius = sqrt(p.radius);
    improve(&p, map);
    free(p.slices);
    return true;
}
