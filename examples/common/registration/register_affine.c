/* register_affine.c - affine maps by Levenberg-Marquardt on the sum of squared differences, between the fixed image and a gain and
 * an offset of the moving one that are found with the map, so that neither scale nor sign of the intensities matters. */
#include "registration/register.h"

#include "base/threads.h"
#include "registration/vgrid.h"

#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_MOTION = 12, MAX_PARAMETERS = MAX_MOTION + 2, ITERATIONS = 40, CURVE_ROUNDS = 3 };

/* Normal equations of one slice or of all slices. */
struct normal {
    double a[MAX_PARAMETERS][MAX_PARAMETERS], b[MAX_PARAMETERS], squares, number;
};

struct problem {
    const struct volume *fixed, *moving;
    int parameters; /* of the motion: 3, 6, 12; gain and offset follow */
    double least;   /* voxels that have to lie in the moving image */
    double center[3], radius; /* of the fixed image, mm: a parameter's unit is a displacement at about this radius */
    struct normal *slices;
};

static int parameters_of(enum register_align align)
{
    return align == REGISTER_ALIGN_TRANSLATION ? 3 : align == REGISTER_ALIGN_RIGID ? 6 : 12;
}

/* Computes the derivative of the mapped point by each parameter: translations, then rotations about the mapped center or a
 * matrix. */
static void motions(const struct problem *p, const double map[3][4], const float world[3], double m[MAX_MOTION][3])
{
    double x[3], turned[3];
    memset(m, 0, MAX_MOTION * sizeof *m);
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

/* A place of the search. */
struct state {
    double map[3][4], gain, offset;
};

/* Samples the moving image and its gradient per mm of the world. Returns false where it has no data (NaN) and beyond it; it ends
 * half a voxel beyond the outermost centers, so that a small motion from an identical grid leaves no voxel out. */
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
    return isfinite(gradient[0] + gradient[1] + gradient[2]) && isfinite(*value);
}

static void add_voxel(const struct problem *p, const struct state *at, const float world[3], float wanted, struct normal *out)
{
    double gradient[3], m[MAX_MOTION][3], jacobian[MAX_PARAMETERS];
    float mapped[3], value;
    volume_apply((const double(*)[4])at->map, world, mapped);
    if (!isfinite(wanted) || !look(p->moving, mapped, &value, gradient)) {
        return;
    }
    const double residual = (double)wanted - at->gain * (double)value - at->offset;
    motions(p, (const double(*)[4])at->map, world, m);
    for (int i = 0; i < p->parameters; ++i) {
        jacobian[i] = at->gain * (gradient[0] * m[i][0] + gradient[1] * m[i][1] + gradient[2] * m[i][2]);
    }
    jacobian[p->parameters] = (double)value;
    jacobian[p->parameters + 1] = 1.0;
    for (int i = 0; i < p->parameters + 2; ++i) {
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
    const struct state *at;
    const int *dims;
};

static void run_equations_loop(void *arg, int begin, int end)
{
    const struct equations_loop *loop = arg;
    const struct problem *p = loop->p;
    const int *dims = loop->dims;
    for (int k = begin; k < end; ++k) {
        const float *values = p->fixed->data + (size_t)k * (size_t)dims[0] * (size_t)dims[1];
        memset(&p->slices[k], 0, sizeof *p->slices);
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i) {
                const float index[3] = {(float)i, (float)j, (float)k};
                float world[3];
                volume_index_to_world(p->fixed, index, world);
                add_voxel(p, loop->at, world, *values++, &p->slices[k]);
            }
        }
    }
}

/* Builds the equations; returns the mean squared difference where the images overlap, INFINITY where they hardly do. */
static double equations(const struct problem *p, const struct state *at, struct normal *sum)
{
    const int *dims = p->fixed->dims;
    struct equations_loop loop = {p, at, dims};
    threads_for(dims[2], 1, run_equations_loop, &loop);
    memset(sum, 0, sizeof *sum);
    for (int k = 0; k < dims[2]; ++k) {
        const double *slice = (const double *)(const void *)&p->slices[k];
        for (size_t n = 0; n < sizeof *sum / sizeof(double); ++n) {
            ((double *)(void *)sum)[n] += slice[n];
        }
    }
    return sum->number >= p->least ? sum->squares / sum->number : INFINITY;
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

/* Updates the map x -> M (x - center) + t, gain and offset by a step of the parameters. */
static void move(const struct problem *p, const struct state *from, const double *step, struct state *out)
{
    const double(*map)[4] = (const double(*)[4])from->map;
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
        out->map[i][3] = at_center[i];
        for (int j = 0; j < 3; ++j) {
            out->map[i][j] = matrix[i][j];
            out->map[i][3] -= matrix[i][j] * p->center[j];
        }
    }
    out->gain = from->gain + step[p->parameters];
    out->offset = from->offset + step[p->parameters + 1];
}

/* Solves (A + damping diag A) step = b. */
static bool solve(const struct problem *p, const struct normal *sum, double damping, double step[MAX_PARAMETERS])
{
    double a[MAX_PARAMETERS * MAX_PARAMETERS];
    const int n = p->parameters + 2;
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

/* Improves a map. The search begins at the gain and the offset that fit best there. */
static void improve(const struct problem *p, double map[3][4])
{
    struct state at = {.gain = 0.0, .offset = 0.0};
    struct normal sum, tried;
    memcpy(at.map, map, sizeof at.map);
    equations(p, &at, &sum);
    const int g = p->parameters, o = g + 1;
    const double number = fmax(sum.number, 1.0), spread = sum.a[g][g] - sum.a[o][g] * sum.a[o][g] / number;
    at.gain = spread > 0.0 ? (sum.b[g] - sum.a[o][g] * sum.b[o] / number) / spread : 1.0;
    at.offset = (sum.b[o] - at.gain * sum.a[o][g]) / number;
    double damping = 1e-3, now = equations(p, &at, &sum);
    for (int i = 0; i < ITERATIONS && isfinite(now) && damping < 1e6; ++i) {
        double step[MAX_PARAMETERS];
        struct state next;
        if (!solve(p, &sum, damping, step)) {
            return;
        }
        move(p, &at, step, &next);
        const double then = equations(p, &next, &tried);
        if (then < now) {
            const bool settled = then > 0.9999 * now;
            at = next;
            memcpy(map, at.map, sizeof at.map);
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
    struct problem p = {.fixed = fixed, .moving = moving, .parameters = parameters_of(align),
                        .least = register_min_voxels(fixed, moving)};
    const float middle[3] = {0.5f * (float)(fixed->dims[0] - 1), 0.5f * (float)(fixed->dims[1] - 1),
                             0.5f * (float)(fixed->dims[2] - 1)};
    float center[3];
    if (align == REGISTER_ALIGN_NONE) {
        return true;
    }
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

/* ---- by a curve of intensities ---- */

/* Improves the map in rounds: the curve of the present map is applied to the image that it is for, then the map is improved. */
static bool follow_curve(const struct volume *fixed, const struct volume *moving, enum register_align align, double map[3][4],
                         struct relation *relation)
{
    struct volume f, m; /* copies that curves may change */
    float *pairs = malloc(volume_voxels(fixed) * sizeof *pairs);
    bool good = volume_create_padded(fixed, 0, &f);
    const bool second = volume_create_padded(moving, 0, &m);
    good = good && second && pairs;
    for (int round = 0; good && round <= CURVE_ROUNDS; ++round) {
        struct relation other;
        register_through(moving, (const double(*)[4])map, fixed, pairs);
        good = relation_fit(fixed->data, pairs, volume_voxels(fixed), RELATION_CURVE, relation)
               && relation_fit(fixed->data, pairs, volume_voxels(fixed), RELATION_FIXED_CURVE, &other);
        if (good && other.explained > relation->explained) {
            *relation = other;
        }
        if (good && round < CURVE_ROUNDS && align != REGISTER_ALIGN_NONE) {
            memcpy(f.data, fixed->data, volume_voxels(fixed) * sizeof *f.data);
            memcpy(m.data, moving->data, volume_voxels(moving) * sizeof *m.data);
            struct volume *curved = relation_of_fixed(relation) ? &f : &m;
            relation_apply(relation, curved->data, volume_voxels(curved));
            good = register_affine(&f, &m, align, map);
        }
    }
    volume_free(&f);
    volume_free(&m);
    free(pairs);
    return good;
}

bool register_affine_related(const struct volume *fixed, const struct volume *moving, enum register_align align, double map[3][4],
                             struct relation *relation)
{
    struct relation curve;
    double curved[3][4];
    float *pairs = malloc(volume_voxels(fixed) * sizeof *pairs);
    bool good = pairs != NULL;
    memcpy(curved, map, sizeof curved);
    good = good && register_affine(fixed, moving, align, map);
    if (good) {
        register_through(moving, (const double(*)[4])map, fixed, pairs);
        if (!relation_fit(fixed->data, pairs, volume_voxels(fixed), RELATION_LINE, relation)) {
            relation->kind = RELATION_LINE; /* they do not overlap: the caller will see it */
        } else if (follow_curve(fixed, moving, align, curved, &curve) && relation_clearly_better(&curve, relation)) {
            *relation = curve;
            memcpy(map, curved, sizeof curved);
        }
    }
    free(pairs);
    return good;
}
