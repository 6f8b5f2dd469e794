/* angular_gaps.h - the directions in which a place has neighbors, by angle in its tangent plane. Where the largest gap between
   two of them is wide, springls are missing or the surface ends. */
#ifndef SPRINGLS__KERNEL_MODEL_ANGULAR_GAPS_H
#define SPRINGLS__KERNEL_MODEL_ANGULAR_GAPS_H

#include "../language/winding.h"

#define SPRINGLS__ANGULAR_GAPS_SIZE 64 /* directions: more than that leave no wide gap */

typedef struct springls__angular_gaps {
    springls__v3 e1, e2;                      /* the tangent frame  */
    float angle[SPRINGLS__ANGULAR_GAPS_SIZE]; /* ascending, radians */
    int count;
} springls__angular_gaps;

SPRINGLS__MATHS springls__angular_gaps springls__angular_gaps_begin(springls__v3 n)
{
    springls__angular_gaps gaps;
    gaps.e1 = springls__any_tangent(n);
    gaps.e2 = springls__cross(n, gaps.e1);
    gaps.count = 0;
    return gaps;
}

/* Adds a neighbor at d from the place; one straight above or below has no direction. */
SPRINGLS__MATHS void springls__angular_gaps_add(springls__angular_gaps *gaps, springls__v3 d)
{
    float u = springls__dot(d, gaps->e1), v = springls__dot(d, gaps->e2), angle;
    int i;
    if (u * u + v * v < 1e-6f || gaps->count == SPRINGLS__ANGULAR_GAPS_SIZE) return;
    angle = springls__atan2(v, u);
    for (i = gaps->count; i > 0 && gaps->angle[i - 1] > angle; i--) gaps->angle[i] = gaps->angle[i - 1];
    gaps->angle[i] = angle;
    gaps->count++;
}

/* Returns which of 32 equal sectors of the tangent plane a direction lies in, as a bit, counted by angle. */
SPRINGLS__MATHS uint32_t springls__sector(float u, float v)
{
    const float one = 0.198912367f, two = 0.414213562f, three = 0.668178638f; /* tan(k pi / 16) */
    float a = springls__fabs(u), b = springls__fabs(v), high = springls__max(a, b), low = springls__min(a, b);
    int k = (low > one * high) + (low > two * high) + (low > three * high);
    if (b > a) k = 7 - k;
    if (v >= 0.0f) return 1u << (u >= 0.0f ? k : 15 - k);
    return 1u << (u < 0.0f ? 16 + k : 31 - k);
}

/* Returns true when no eight sectors in a row are empty: no gap between directions in the others is 102 degrees wide. */
SPRINGLS__MATHS bool springls__sectors_close(uint32_t sectors)
{
    uint32_t empty = ~sectors;
    empty &= empty << 1 | empty >> 31;
    empty &= empty << 2 | empty >> 30;
    return (empty & (empty << 4 | empty >> 28)) == 0u;
}

/* The two widest gaps (radians), and the direction that halves the widest. */
typedef struct springls__widest_gap { float angle, second; springls__v3 middle; } springls__widest_gap;

SPRINGLS__MATHS springls__widest_gap springls__angular_gaps_widest(const springls__angular_gaps *gaps)
{
    const float turn = 6.28318531f;
    springls__widest_gap widest;
    float from, middle;
    int i;
    widest.angle = turn;
    widest.second = 0.0f;
    widest.middle = gaps->e1;
    if (gaps->count == 0) return widest;
    from = gaps->angle[gaps->count - 1];
    widest.angle = gaps->angle[0] + turn - from; /* across the cut at pi */
    for (i = 1; i < gaps->count; i++) {
        float angle = gaps->angle[i] - gaps->angle[i - 1];
        widest.second = springls__max(widest.second, springls__min(angle, widest.angle));
        if (angle <= widest.angle) continue;
        widest.angle = angle;
        from = gaps->angle[i - 1];
    }
    middle = (from + 0.5f * widest.angle) * SPRINGLS__OVER_PI;
    widest.middle = springls__add(springls__scale(gaps->e1, springls__cospi(middle)),
                                  springls__scale(gaps->e2, springls__sinpi(middle)));
    return widest;
}

/* Returns true when the neighbors lie around the place as in a sheet: on all sides, or on all but one at its rim. A thread leaves
   two wide gaps; its end and a drop leave nearly all open. */
SPRINGLS__MATHS bool springls__spans_sheet(const springls__angular_gaps *gaps)
{
    springls__widest_gap widest = springls__angular_gaps_widest(gaps);
    return gaps->count >= 8 && widest.angle <= 210.0f * SPRINGLS__DEGREE && widest.second <= 80.0f * SPRINGLS__DEGREE;
}

#endif
