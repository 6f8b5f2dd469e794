#include "imaging/mirror.h"

#include "imaging/resample.h"
#include "imaging/segment_image.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GRIDS = 3, ITERATIONS = 30, MAX_POINTS = 60000, UNKNOWNS = 6 };

struct task {
    const struct volume *image;
    const float *values;
    float (*points)[3]; /* world */
    size_t count;
    double inverse[3][4]; /* world -> index of the image */
};

static void invert(const struct volume *v, double inverse[3][4])
{
    const float origin[3] = {0, 0, 0};
    float base[3];
    volume_world_to_index(v, origin, base);
    for (int c = 0; c < 3; ++c) {
        float world[3] = {0, 0, 0}, index[3];
        world[c] = 1000.0f; /* far away, for precision */
        volume_world_to_index(v, world, index);
        for (int r = 0; r < 3; ++r) {
            inverse[r][c] = ((double)index[r] - (double)base[r]) / 1000.0;
            inverse[r][3] = (double)base[r];
        }
    }
}

static void reflect(const struct mirror *mirror, const float x[3], double y[3])
{
    for (int r = 0; r < 3; ++r) {
        y[r] = mirror->t[r];
        for (int c = 0; c < 3; ++c) {
            y[r] += mirror->m[r][c] * (double)x[c];
        }
    }
}

/* Samples `values` and their gradient at a world point; returns false outside. */
static bool look(const struct task *task, const double y[3], double *value, double slope[3])
{
    const int *dims = task->image->dims;
    const size_t steps[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]};
    size_t base = 0;
    double f[3], along[3] = {0, 0, 0};
    for (int r = 0; r < 3; ++r) {
        const double *m = task->inverse[r], at = m[0] * y[0] + m[1] * y[1] + m[2] * y[2] + m[3];
        if (!(at >= 0.0 && at < (double)(dims[r] - 1))) {
            return false;
        }
        base += steps[r] * (size_t)at;
        f[r] = at - floor(at);
    }
    *value = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        size_t n = base;
        double w[3];
        for (int a = 0; a < 3; ++a) {
            const int high = corner >> a & 1;
            n += high ? steps[a] : 0;
            w[a] = high ? f[a] : 1.0 - f[a];
        }
        const double v = (double)task->values[n];
        *value += w[0] * w[1] * w[2] * v;
        along[0] += (corner & 1 ? 1.0 : -1.0) * w[1] * w[2] * v;
        along[1] += (corner & 2 ? 1.0 : -1.0) * w[0] * w[2] * v;
        along[2] += (corner & 4 ? 1.0 : -1.0) * w[0] * w[1] * v;
    }
    for (int c = 0; c < 3; ++c) {
        slope[c] = along[0] * task->inverse[0][c] + along[1] * task->inverse[1][c] + along[2] * task->inverse[2][c];
    }
    return true;
}

/* Returns the mean square difference, DBL_MAX where less than half of the points fall into the image. With `normal` it also
 * computes the Gauss-Newton equations for a small rotation about `center` and a small shift. */
static double misfit(const struct task *task, const struct mirror *mirror, const double center[3],
                     double normal[UNKNOWNS][UNKNOWNS + 1])
{
    double sum = 0.0;
    size_t inside = 0;
    for (size_t p = 0; p < task->count; ++p) {
        double y[3], here, there, slope[3], none[3];
        const double x[3] = {(double)task->points[p][0], (double)task->points[p][1], (double)task->points[p][2]};
        reflect(mirror, task->points[p], y);
        if (!look(task, y, &there, slope) || !look(task, x, &here, none)) {
            continue;
        }
        const double difference = there - here;
        sum += difference * difference;
        inside++;
        if (normal) {
            const double a[3] = {y[0] - center[0], y[1] - center[1], y[2] - center[2]};
            const double row[UNKNOWNS] = {a[1] * slope[2] - a[2] * slope[1], a[2] * slope[0] - a[0] * slope[2],
                                          a[0] * slope[1] - a[1] * slope[0], slope[0], slope[1], slope[2]};
            for (int r = 0; r < UNKNOWNS; ++r) {
                for (int c = 0; c < UNKNOWNS; ++c) {
                    normal[r][c] += row[r] * row[c];
                }
                normal[r][UNKNOWNS] -= row[r] * difference;
            }
        }
    }
    return 2 * inside >= task->count && inside > 0 ? sum / (double)inside : DBL_MAX;
}

/* Solves a symmetric positive system by Gaussian elimination, which then needs no pivots. */
static bool solve(double m[UNKNOWNS][UNKNOWNS + 1], double x[UNKNOWNS])
{
    for (int r = 0; r < UNKNOWNS; ++r) {
        if (!(m[r][r] > 0.0)) {
            return false;
        }
        for (int s = r + 1; s < UNKNOWNS; ++s) {
            const double factor = m[s][r] / m[r][r];
            for (int c = r; c <= UNKNOWNS; ++c) {
                m[s][c] -= factor * m[r][c];
            }
        }
    }
    for (int r = UNKNOWNS - 1; r >= 0; --r) {
        x[r] = m[r][UNKNOWNS];
        for (int c = r + 1; c < UNKNOWNS; ++c) {
            x[r] -= m[r][c] * x[c];
        }
        x[r] /= m[r][r];
    }
    return true;
}

/* Composes `mirror` with a rotation by the vector `turn` (Rodrigues) about `center` and a shift. */
static struct mirror moved(const struct mirror *mirror, const double center[3], const double turn[3], const double shift[3])
{
    struct mirror out = *mirror;
    const double angle = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
    double q[3][3], axis[3] = {0, 0, 1};
    for (int a = 0; a < 3 && angle > 0.0; ++a) {
        axis[a] = turn[a] / angle;
    }
    const double s = sin(angle), c1 = 1.0 - cos(angle);
    const double cross[3][3] = {{0, -axis[2], axis[1]}, {axis[2], 0, -axis[0]}, {-axis[1], axis[0], 0}};
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
            q[r][c] = (r == c) + s * cross[r][c] + c1 * (axis[r] * axis[c] - (r == c));
        }
    }
    for (int r = 0; r < 3; ++r) {
        out.t[r] = center[r] + shift[r];
        for (int c = 0; c < 3; ++c) {
            out.m[r][c] = q[r][0] * mirror->m[0][c] + q[r][1] * mirror->m[1][c] + q[r][2] * mirror->m[2][c];
            out.t[r] += q[r][c] * (mirror->t[c] - center[c]);
        }
    }
    return out;
}

static void gauss_newton(const struct task *task, struct mirror *mirror)
{
    double damping = 1e-3;
    double best = misfit(task, mirror, mirror->t, NULL);
    for (int i = 0; i < ITERATIONS && best < DBL_MAX; ++i) {
        double normal[UNKNOWNS][UNKNOWNS + 1] = {{0}}, x[UNKNOWNS], center[3] = {0, 0, 0};
        for (size_t p = 0; p < task->count; ++p) {
            double y[3];
            reflect(mirror, task->points[p], y);
            for (int a = 0; a < 3; ++a) {
                center[a] += y[a] / (double)task->count;
            }
        }
        misfit(task, mirror, center, normal);
        for (int r = 0; r < UNKNOWNS; ++r) {
            normal[r][r] *= 1.0 + damping;
        }
        if (!solve(normal, x)) {
            break;
        }
        const struct mirror next = moved(mirror, center, x, x + 3);
        const double now = misfit(task, &next, center, NULL);
        if (now < best) { /* Levenberg's rule: towards Newton after a success, else towards small steps */
            const bool done = now > 0.9999 * best;
            *mirror = next;
            best = now;
            damping *= 0.3;
            if (done) {
                break;
            }
        } else if ((damping *= 10.0) > 1e6) {
            break;
        }
    }
    mirror->misfit = best < DBL_MAX ? sqrt(best) : HUGE_VAL;
}

/* Collects world places of at most MAX_POINTS voxels near the mask. */
static bool take_points(const struct volume *image, const uint8_t *mask, float around, struct task *task)
{
    const size_t total = volume_voxels(image);
    float *distance = malloc(total * sizeof *distance);
    size_t near = 0, counted = 0;
    if (!distance) {
        return false;
    }
    for (size_t n = 0; n < total; ++n) {
        distance[n] = mask[n] ? -0.1f : INFINITY; /* only the inside is known */
    }
    segment_extend_distance(image, 0.2f, distance);
    for (size_t n = 0; n < total; ++n) {
        near += distance[n] <= around;
    }
    const size_t every = near / MAX_POINTS + 1;
    task->count = 0;
    task->points = malloc((near / every + 1) * sizeof *task->points);
    for (size_t n = 0; task->points && n < total; ++n) {
        if (distance[n] <= around && counted++ % every == 0) {
            const size_t nx = (size_t)image->dims[0], ny = (size_t)image->dims[1];
            const float index[3] = {(float)(n % nx), (float)(n / nx % ny), (float)(n / (nx * ny))};
            volume_index_to_world(image, index, task->points[task->count++]);
        }
    }
    free(distance);
    return task->points != NULL;
}

/* Finds the plane x = c with the smallest misfit. */
static bool find_plane(const struct task *task, float step, struct mirror *mirror)
{
    double best = DBL_MAX, lo = INFINITY, hi = -INFINITY;
    for (int corner = 0; corner < 8; ++corner) {
        float index[3], world[3];
        for (int a = 0; a < 3; ++a) {
            index[a] = corner >> a & 1 ? (float)(task->image->dims[a] - 1) : 0.0f;
        }
        volume_index_to_world(task->image, index, world);
        lo = fmin(lo, (double)world[0]);
        hi = fmax(hi, (double)world[0]);
    }
    struct mirror tried = {.m = {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (double plane = lo; plane <= hi; plane += 0.5 * (double)step) {
        tried.t[0] = 2.0 * plane;
        const double now = misfit(task, &tried, tried.t, NULL);
        if (now < best) {
            best = now;
            *mirror = tried;
        }
    }
    return best < DBL_MAX;
}

bool mirror_find(const struct volume *image, const float *values, const uint8_t *mask, float around, struct mirror *mirror)
{
    const size_t total = volume_voxels(image);
    const float voxel = fmaxf(image->spacing[0], fmaxf(image->spacing[1], image->spacing[2]));
    struct task task = {.image = image};
    float *blurred = malloc(total * sizeof *blurred);
    bool good = blurred && take_points(image, mask, around, &task);
    invert(image, task.inverse);
    task.values = blurred;
    for (int grid = GRIDS - 1; good && grid >= 0; --grid) {
        const float size = ldexpf(voxel, grid + 1);
        memcpy(blurred, values, total * sizeof *blurred);
        good = segment_blur(image, size, blurred) && (grid < GRIDS - 1 || find_plane(&task, size, mirror));
        if (good) {
            gauss_newton(&task, mirror);
        }
    }
    free(task.points);
    free(blurred);
    return good;
}

void mirror_apply(const struct mirror *mirror, const struct volume *from, const struct volume *to, float *result)
{
    /* The mirror's matrix is orthogonal, so the inverse is m^T (x - t): a grid placed there samples the reflection. */
    struct volume moved_to = *to;
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 4; ++c) {
            moved_to.affine[r][c] = 0.0;
            for (int i = 0; i < 3; ++i) {
                moved_to.affine[r][c] += mirror->m[i][r] * (to->affine[i][c] - (c == 3 ? mirror->t[i] : 0.0));
            }
        }
    }
    resample_volume(from, from->data, NULL, &moved_to, result, NULL);
}
