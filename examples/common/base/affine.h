/* affine.h - rigid and affine maps: 3x4 matrices, and translation, rotation, scale. */
#ifndef EXAMPLES_BASE_AFFINE_H
#define EXAMPLES_BASE_AFFINE_H

#include "base/vec3.h"

#include <math.h>
#include <stdbool.h>

/* The map x -> A x + b as a row-major matrix [A b]. */
struct affine {
    double m[12];
};

/* Translation * rotation * scale; the rotation is a unit quaternion w, x, y, z. */
struct placement {
    double translation[3], rotation[4], scale[3];
};

static inline struct affine affine_identity(void)
{
    const struct affine one = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    return one;
}

/* Returns the composition a o b. */
static inline struct affine affine_after(const struct affine *a, const struct affine *b)
{
    struct affine c;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 4; ++j) {
            c.m[4 * i + j] = a->m[4 * i] * b->m[j] + a->m[4 * i + 1] * b->m[4 + j] + a->m[4 * i + 2] * b->m[8 + j]
                             + (j == 3 ? a->m[4 * i + 3] : 0.0);
        }
    }
    return c;
}

static inline double affine_determinant(const struct affine *a)
{
    const double *m = a->m;
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
}

/* Inverts a map by cofactors; the determinant must not be 0. */
static inline struct affine affine_inverse(const struct affine *a)
{
    const double *m = a->m, d = 1.0 / affine_determinant(a);
    struct affine r = {{d * (m[5] * m[10] - m[6] * m[9]), d * (m[2] * m[9] - m[1] * m[10]), d * (m[1] * m[6] - m[2] * m[5]), 0,
                        d * (m[6] * m[8] - m[4] * m[10]), d * (m[0] * m[10] - m[2] * m[8]), d * (m[2] * m[4] - m[0] * m[6]), 0,
                        d * (m[4] * m[9] - m[5] * m[8]), d * (m[1] * m[8] - m[0] * m[9]), d * (m[0] * m[5] - m[1] * m[4]), 0}};
    for (int i = 0; i < 3; ++i) {
        r.m[4 * i + 3] = -(r.m[4 * i] * m[3] + r.m[4 * i + 1] * m[7] + r.m[4 * i + 2] * m[11]);
    }
    return r;
}

static inline void affine_apply(const struct affine *a, const float in[3], float out[3])
{
    const double x = (double)in[0], y = (double)in[1], z = (double)in[2];
    for (int i = 0; i < 3; ++i) {
        const double *row = a->m + 4 * i;
        out[i] = (float)(row[0] * x + row[1] * y + row[2] * z + row[3]);
    }
}

/* Transforms a normal by the inverse transpose, to length 1; returns false, with +z, where nothing is left of it. */
static inline bool affine_normal(const struct affine *a, const float n[3], float out[3])
{
    const double *m = a->m, x = (double)n[0], y = (double)n[1], z = (double)n[2], sign = affine_determinant(a) < 0.0 ? -1.0 : 1.0;
    double sum[3], length = 0.0;
    for (int i = 0; i < 3; ++i) { /* rows of cofactors */
        const double *p = m + 4 * ((i + 1) % 3), *q = m + 4 * ((i + 2) % 3);
        sum[i] = sign * (x * (p[1] * q[2] - p[2] * q[1]) + y * (p[2] * q[0] - p[0] * q[2]) + z * (p[0] * q[1] - p[1] * q[0]));
        length += sum[i] * sum[i];
    }
    const bool good = isfinite(length) && length > 0.0;
    for (int i = 0; i < 3; ++i) {
        out[i] = good ? (float)(sum[i] / sqrt(length)) : i == 2 ? 1.0f : 0.0f;
    }
    return good;
}

static inline void affine_add(struct affine *sum, double weight, const struct affine *a)
{
    for (int i = 0; i < 12; ++i) {
        sum->m[i] += weight * a->m[i];
    }
}

/* Returns the smallest rotation from the direction of a to the direction of b (Rodrigues). */
static inline struct affine affine_turn(const float a[3], const float b[3])
{
    float u[3] = {a[0], a[1], a[2]}, v[3] = {b[0], b[1], b[2]}, axis[3];
    struct affine r = affine_identity();
    vec3_normalize(u);
    vec3_normalize(v);
    vec3_cross(u, v, axis);
    const double cosine = (double)vec3_dot(u, v);
    double x = (double)axis[0], y = (double)axis[1], z = (double)axis[2], k = 1.0 / (1.0 + cosine);
    if (cosine < -0.9999) { /* half a turn about any perpendicular axis */
        const float other[3] = {fabsf(u[0]) < 0.5f ? 1.0f : 0.0f, fabsf(u[0]) < 0.5f ? 0.0f : 1.0f, 0.0f};
        vec3_cross(u, other, axis);
        vec3_normalize(axis);
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                r.m[4 * i + j] = 2.0 * (double)axis[i] * (double)axis[j] - (i == j);
            }
        }
        return r;
    }
    const double m[9] = {cosine + k * x * x, k * x * y - z, k * x * z + y, k * x * y + z, cosine + k * y * y,
                         k * y * z - x,      k * x * z - y, k * y * z + x, cosine + k * z * z};
    for (int i = 0; i < 9; ++i) {
        r.m[4 * (i / 3) + i % 3] = m[i];
    }
    return r;
}

static inline struct placement placement_identity(void)
{
    const struct placement one = {{0, 0, 0}, {1, 0, 0, 0}, {1, 1, 1}};
    return one;
}

static inline struct affine placement_matrix(const struct placement *p)
{
    const double w = p->rotation[0], x = p->rotation[1], y = p->rotation[2], z = p->rotation[3];
    const double r[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                         2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
    struct affine a;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            a.m[4 * i + j] = r[3 * i + j] * p->scale[j];
        }
        a.m[4 * i + 3] = p->translation[i];
    }
    return a;
}

/* Converts a row-major rotation matrix (Shepperd 1978: the largest component first). */
static inline void rotation_quaternion(const double r[9], double q[4])
{
    const double trace = r[0] + r[4] + r[8];
    const double square[4] = {trace, 2 * r[0] - trace, 2 * r[4] - trace, 2 * r[8] - trace};
    int k = 0;
    for (int i = 1; i < 4; ++i) {
        k = square[i] > square[k] ? i : k;
    }
    const double big = sqrt(1 + square[k]), s = 0.5 / big;
    q[k] = 0.5 * big;
    if (k == 0) {
        q[1] = s * (r[7] - r[5]), q[2] = s * (r[2] - r[6]), q[3] = s * (r[3] - r[1]);
    } else if (k == 1) {
        q[0] = s * (r[7] - r[5]), q[2] = s * (r[1] + r[3]), q[3] = s * (r[2] + r[6]);
    } else if (k == 2) {
        q[0] = s * (r[2] - r[6]), q[1] = s * (r[1] + r[3]), q[3] = s * (r[5] + r[7]);
    } else {
        q[0] = s * (r[3] - r[1]), q[1] = s * (r[2] + r[6]), q[2] = s * (r[5] + r[7]);
    }
}

/* Decomposes a matrix without shear; a mirrored one gets a negative first scale. */
static inline struct placement placement_of(const struct affine *a)
{
    struct placement p;
    double r[9];
    for (int j = 0; j < 3; ++j) {
        p.scale[j] = sqrt(a->m[j] * a->m[j] + a->m[4 + j] * a->m[4 + j] + a->m[8 + j] * a->m[8 + j]);
        p.scale[j] *= j == 0 && affine_determinant(a) < 0.0 ? -1.0 : 1.0;
        for (int i = 0; i < 3; ++i) {
            r[3 * i + j] = p.scale[j] != 0.0 ? a->m[4 * i + j] / p.scale[j] : i == j ? 1.0 : 0.0;
        }
        p.translation[j] = a->m[4 * j + 3];
    }
    rotation_quaternion(r, p.rotation);
    return p;
}

/* Returns the rotation of a map, without translation and scale. */
static inline struct affine affine_rotation(const struct affine *a)
{
    struct placement p = placement_of(a);
    for (int i = 0; i < 3; ++i) {
        p.translation[i] = 0.0;
        p.scale[i] = 1.0;
    }
    return placement_matrix(&p);
}

/* Interpolates along the shortest arc between two unit quaternions (Shoemake 1985); the result has length 1 and may be a or b. */
static inline void quaternion_slerp(const double a[4], const double b[4], double t, double result[4])
{
    double cosine = 0.0, out[4], length = 0.0;
    for (int i = 0; i < 4; ++i) {
        cosine += a[i] * b[i];
    }
    const double sign = cosine < 0.0 ? -1.0 : 1.0, angle = acos(fmin(1.0, fabs(cosine)));
    const double s = angle > 1e-4 ? sin((1.0 - t) * angle) / sin(angle) : 1.0 - t;
    const double u = sign * (angle > 1e-4 ? sin(t * angle) / sin(angle) : t);
    for (int i = 0; i < 4; ++i) {
        out[i] = s * a[i] + u * b[i];
        length += out[i] * out[i];
    }
    for (int i = 0; i < 4; ++i) {
        result[i] = length > 0.0 ? out[i] / sqrt(length) : i == 0 ? 1.0 : 0.0;
    }
}

static inline struct placement placement_between(const struct placement *a, const struct placement *b, double t)
{
    struct placement p;
    for (int i = 0; i < 3; ++i) {
        p.translation[i] = a->translation[i] + t * (b->translation[i] - a->translation[i]);
        p.scale[i] = a->scale[i] + t * (b->scale[i] - a->scale[i]);
    }
    quaternion_slerp(a->rotation, b->rotation, t, p.rotation);
    return p;
}

#endif
