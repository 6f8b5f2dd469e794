/* vec3.h - three-vectors. */
#ifndef EXAMPLES_BASE_VEC3_H
#define EXAMPLES_BASE_VEC3_H

#include <math.h>
#include <stdbool.h>

#define VEC3_FARTHEST 1e18f /* of coordinates that are read: squares of lengths are finite */
#define VEC3_TOO_FAR "a vertex is not finite, or has a coordinate beyond 1e18"

static inline float vec3_dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline float vec3_length(const float a[3]) { return sqrtf(vec3_dot(a, a)); }

/* Returns whether all coordinates are finite and at most VEC3_FARTHEST. */
static inline bool vec3_within_reach(const float a[3])
{
    return fabsf(a[0]) <= VEC3_FARTHEST && fabsf(a[1]) <= VEC3_FARTHEST && fabsf(a[2]) <= VEC3_FARTHEST;
}

static inline void vec3_sub(const float a[3], const float b[3], float out[3])
{
    for (int i = 0; i < 3; ++i) {
        out[i] = a[i] - b[i];
    }
}

/* Computes a + s * b. */
static inline void vec3_add_scaled(const float a[3], float s, const float b[3], float out[3])
{
    for (int i = 0; i < 3; ++i) {
        out[i] = a[i] + s * b[i];
    }
}

static inline void vec3_cross(const float a[3], const float b[3], float out[3])
{
    const float x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/* Scales to length 1 and returns the old length; a zero vector becomes (0, 0, 1). */
static inline float vec3_normalize(float a[3])
{
    const float length = vec3_length(a);
    for (int i = 0; i < 3; ++i) {
        a[i] = length > 0.0f ? a[i] / length : i == 2 ? 1.0f : 0.0f;
    }
    return length;
}

/* Computes the unit normal of a triangle of nine floats; returns the triangle's area. */
static inline float vec3_triangle_normal(const float c[9], float normal[3])
{
    float a[3], b[3];
    vec3_sub(c + 3, c, a);
    vec3_sub(c + 6, c, b);
    vec3_cross(a, b, normal);
    return 0.5f * vec3_normalize(normal);
}

/* Computes barycentric weights by least squares in the triangle's plane; p lies in the triangle. */
static inline void vec3_barycentric(const float *a, const float *b, const float *c, const float *p, float weight[3])
{
    float u[3], v[3], w[3];
    vec3_sub(b, a, u);
    vec3_sub(c, a, v);
    vec3_sub(p, a, w);
    const float uu = vec3_dot(u, u), uv = vec3_dot(u, v), vv = vec3_dot(v, v), wu = vec3_dot(w, u), wv = vec3_dot(w, v);
    const float d = uu * vv - uv * uv;
    float s = d > 0.0f ? (vv * wu - uv * wv) / d : 0.0f, t = d > 0.0f ? (uu * wv - uv * wu) / d : 0.0f;
    s = fminf(1.0f, fmaxf(0.0f, s));
    t = fminf(1.0f - s, fmaxf(0.0f, t));
    weight[0] = 1.0f - s - t;
    weight[1] = s;
    weight[2] = t;
}

/* Returns a triangle's area. */
static inline double vec3_triangle_area(const float a[3], const float b[3], const float c[3])
{
    double u[3], v[3];
    for (int k = 0; k < 3; ++k) {
        u[k] = (double)b[k] - (double)a[k];
        v[k] = (double)c[k] - (double)a[k];
    }
    const double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
    return 0.5 * sqrt(x * x + y * y + z * z);
}

#endif
