#include "registration/beat.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

struct beat beat_of(const double center[3], double radius)
{
    struct beat beat = {.axis = {0.3, -0.2, 0.0}, .sigma = radius, .contraction = 0.55, .twist = 0.5};
    memcpy(beat.center, center, sizeof beat.center);
    beat.axis[2] = sqrt(1.0 - 0.3 * 0.3 - 0.2 * 0.2);
    return beat;
}

double beat_phase(int frame, int frames)
{
    const double sine = sin(pi * frame / frames);
    return sine * sine;
}

static void velocity(const struct beat *b, const double x[3], double v[3])
{
    const double r[3] = {x[0] - b->center[0], x[1] - b->center[1], x[2] - b->center[2]};
    const double *n = b->axis;
    const double square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2], along = r[0] * n[0] + r[1] * n[1] + r[2] * n[2];
    const double envelope = exp(-0.5 * square / (b->sigma * b->sigma)), turn = b->twist * along / b->sigma;
    for (int a = 0; a < 3; ++a) {
        const int c = (a + 1) % 3, d = (a + 2) % 3;
        v[a] = envelope * (-b->contraction * r[a] + turn * (n[c] * r[d] - n[d] * r[c]));
    }
}

/* Computes a + h b. */
static void along(const double a[3], double h, const double b[3], double out[3])
{
    for (int i = 0; i < 3; ++i) {
        out[i] = a[i] + h * b[i];
    }
}

void beat_flow(const struct beat *beat, double s, const double x[3], double there[3])
{
    enum { STEPS = 12 };
    const double h = s / STEPS;
    double y[3] = {x[0], x[1], x[2]}, k[4][3], at[3];
    for (int n = 0; n < STEPS; ++n) {
        velocity(beat, y, k[0]);
        along(y, 0.5 * h, k[0], at);
        velocity(beat, at, k[1]);
        along(y, 0.5 * h, k[1], at);
        velocity(beat, at, k[2]);
        along(y, h, k[2], at);
        velocity(beat, at, k[3]);
        for (int a = 0; a < 3; ++a) {
            y[a] += h / 6.0 * (k[0][a] + 2.0 * k[1][a] + 2.0 * k[2][a] + k[3][a]);
        }
    }
    memcpy(there, y, sizeof y);
}

void beat_map(const void *beat_time, const float *points, size_t count, float *mapped)
{
    const struct beat_time *t = beat_time;
    for (size_t n = 0; n < 3 * count; n += 3) {
        const double x[3] = {(double)points[n], (double)points[n + 1], (double)points[n + 2]};
        double there[3];
        beat_flow(t->beat, t->s, x, there);
        for (size_t a = 0; a < 3; ++a) {
            mapped[n + a] = (float)there[a];
        }
    }
}
