/* exact_flows.h - the two flows with exact answers (paper, section 5.2), written as a user of the library writes a flow: a velocity
 * callback and, for OpenCL devices, the same functions as text. Coordinates are voxels. */
#ifndef EXAMPLES_SPRINGLS_EXACT_FLOWS_H
#define EXAMPLES_SPRINGLS_EXACT_FLOWS_H

#include <math.h>
#include <stddef.h>

/* Results are the same bits on every machine only where each operation is rounded as it is written. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off", "excess-precision=fast", "no-unsafe-math-optimizations", "no-associative-math")
#pragma GCC optimize("no-reciprocal-math", "no-finite-math-only", "signed-zeros")
#endif

/* A flow, `user` of exact_flow_velocity: LeVeque's deformation of the domain [0, size]^3, which time reverses at half of the
 * period; where the period is 0, a rotation about the axis through the center, in radians a unit of time. The axis needs no
 * length. A device reads the members as an array of floats. */
struct exact_flow {
    float size, period;
    float center[3], axis[3], angular_velocity;
};

/* Initialise one. */
#define EXACT_DEFORMATION(size, period) {(size), (period), {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, 0.0f}
#define EXACT_ROTATION(x, y, z, axis_x, axis_y, axis_z, angular_velocity) \
    {0.0f, 0.0f, {(x), (y), (z)}, {(axis_x), (axis_y), (axis_z)}, (angular_velocity)}

/* What a device calls. */
#define EXACT_FLOW_ENTRY                                                                            \
    "float3 springls_velocity(float3 x, float t, __global const float *flow) {\n"                                       \
    "    const float size = flow[0], period = flow[1], angular_velocity = flow[8];\n"                                   \
    "    const float3 center = (float3)(flow[2], flow[3], flow[4]), axis = (float3)(flow[5], flow[6], flow[7]);\n"      \
    "    if (period != 0.0f) {\n"                                                                                       \
    "        const float scale = 1.0f / size;\n"                                                                        \
    "        float u[3];\n"                                                                                             \
    "        exact_deformation(x.x * scale, x.y * scale, x.z * scale, exact_amplitude(size, period, t), u);\n"          \
    "        return (float3)(u[0], u[1], u[2]);\n"                                                                      \
    "    }\n"                                                                                                           \
    "    const float3 a = axis * exact_inverse_length(axis.x, axis.y, axis.z), arm = x - center;\n"                     \
    "    return (float3)(a.y * arm.z - a.z * arm.y, a.z * arm.x - a.x * arm.z, a.x * arm.y - a.y * arm.x) * angular_velocity;\n"\
    "}\n"

/* The functions that C and OpenCL share, once as they are and once as a string, springls_cl_desc.velocity_source of
 * exact_flow_velocity; velocity_user_bytes is the size of a struct exact_flow. No division and no branch, so that compilers do
 * several points at once. exact_sinpi returns sin(pi x) for |x| < 2^31 by an odd polynomial, because the sines of C libraries
 * differ in their last bits. */
#define EXACT_FLOW_FUNCTIONS(...) \
    __VA_ARGS__                   \
    static inline const char *exact_flow_source(void) { return #__VA_ARGS__ "\n" EXACT_FLOW_ENTRY; }

EXACT_FLOW_FUNCTIONS(
static inline float exact_sinpi(float x)
{
    const float shifted = x + 0.5f;
    const int towards_zero = (int)shifted;
    const int k = towards_zero - ((float)towards_zero > shifted ? 1 : 0);
    const float r = x - (float)k;
    const float r2 = r * r;
    const float s = r * (3.14159265f + r2 * (-5.16771278f + r2 * (2.55016404f + r2 * (-0.599264529f
                    + r2 * (0.0821458866f + r2 * -0.00737043094f)))));
    return s * (1.0f - 2.0f * (float)(k & 1));
}

static inline float exact_amplitude(float size, float period, float time)
{
    return size * exact_sinpi(time / period + 0.5f);
}

static inline void exact_deformation(float x, float y, float z, float amplitude, float *u)
{
    const float sx = exact_sinpi(x);
    const float sy = exact_sinpi(y);
    const float sz = exact_sinpi(z);
    const float s2x = exact_sinpi(2.0f * x);
    const float s2y = exact_sinpi(2.0f * y);
    const float s2z = exact_sinpi(2.0f * z);
    u[0] = 2.0f * sx * sx * s2y * s2z * amplitude;
    u[1] = -s2x * sy * sy * s2z * amplitude;
    u[2] = -s2x * s2y * sz * sz * amplitude;
}

static inline float exact_inverse_length(float x, float y, float z)
{
    const float length2 = x * x + y * y + z * z;
    return length2 > 1e-30f ? 1.0f / (float)sqrt(length2) : 0.0f;
}
)

enum { EXACT_FLOW_POINTS = 64 };

/* Writes velocities of the deformation at up to EXACT_FLOW_POINTS points. Coordinates are sorted first, for loops over each. */
static inline void exact_deformation_of(const struct exact_flow *flow, const float *points, int count, float amplitude, float *out)
{
    const float scale = 1.0f / flow->size;
    float x[EXACT_FLOW_POINTS], y[EXACT_FLOW_POINTS], z[EXACT_FLOW_POINTS];
    for (int i = 0; i < count; ++i) {
        x[i] = points[3 * i] * scale;
        y[i] = points[3 * i + 1] * scale;
        z[i] = points[3 * i + 2] * scale;
    }
    for (int i = 0; i < count; ++i) {
        float u[3];
        exact_deformation(x[i], y[i], z[i], amplitude, u);
        x[i] = u[0];
        y[i] = u[1];
        z[i] = u[2];
    }
    for (int i = 0; i < count; ++i) {
        out[3 * i] = x[i];
        out[3 * i + 1] = y[i];
        out[3 * i + 2] = z[i];
    }
}

static inline void exact_rotation_of(const struct exact_flow *flow, const float *points, int count, float *out)
{
    const float *axis = flow->axis, *center = flow->center;
    const float unit = exact_inverse_length(axis[0], axis[1], axis[2]);
    const float a[3] = {axis[0] * unit, axis[1] * unit, axis[2] * unit};
    for (int i = 0; i < count; ++i) {
        const float x = points[3 * i] - center[0], y = points[3 * i + 1] - center[1], z = points[3 * i + 2] - center[2];
        out[3 * i] = (a[1] * z - a[2] * y) * flow->angular_velocity;
        out[3 * i + 1] = (a[2] * x - a[0] * z) * flow->angular_velocity;
        out[3 * i + 2] = (a[0] * y - a[1] * x) * flow->angular_velocity;
    }
}

/* A springls_velocity_fn. user: a struct exact_flow. */
static inline void exact_flow_velocity(void *user, const float *points, int count, float time, float *out)
{
    const struct exact_flow *flow = (const struct exact_flow *)user;
    if (flow->period == 0.0f) {
        exact_rotation_of(flow, points, count, out);
        return;
    }
    const float amplitude = exact_amplitude(flow->size, flow->period, time);
    for (int first = 0; first < count; first += EXACT_FLOW_POINTS) {
        const int some = count - first < EXACT_FLOW_POINTS ? count - first : EXACT_FLOW_POINTS;
        exact_deformation_of(flow, points + (ptrdiff_t)3 * first, some, amplitude, out + (ptrdiff_t)3 * first);
    }
}

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif

#endif
