/* beat.h - a synthetic motion with an exact answer, to test tracking: a body contracts and twists like a heart, and returns.
 *
 * It is the flow of a stationary velocity, smooth and near zero away from the body, so it is a diffeomorphism:
 *   v(x) = exp(-|r|^2 / (2 sigma^2)) * (-contraction r + twist (r . axis) / sigma (axis x r)),   r = x - center
 * At phase s every point has moved with the flow for the time s. */
#ifndef EXAMPLES_REGISTRATION_BEAT_H
#define EXAMPLES_REGISTRATION_BEAT_H

#include <stddef.h>

struct beat {
    double center[3], axis[3]; /* mm; unit vector */
    double sigma;              /* mm */
    double contraction, twist; /* at the center the Jacobian is exp(-3 contraction); radians */
};

/* Makes a beat around a body with this center and root mean square radius in mm: the Jacobian falls to 0.19, the body's volume
 * to about a half. */
struct beat beat_of(const double center[3], double radius);

/* Returns the phase sin^2: 0 at the first of `frames` frames, 1 at half time, then back. */
double beat_phase(int frame, int frames);

/* Moves x by the flow for the time s (negative: backwards). Runge-Kutta in double precision, exact to 1e-5 mm. */
void beat_flow(const struct beat *beat, double s, const double x[3], double there[3]);

/* The same map in the form that field_sample of field.h takes. */
struct beat_time {
    const struct beat *beat;
    double s;
};
void beat_map(const void *beat_time, const float *points, size_t count, float *mapped);

#endif
