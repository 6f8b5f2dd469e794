/* fan.h - the directions in which a place has neighbours, by angle in its tangent plane: where the largest angle between
   two of them opens, springls are missing or the surface ends. */
#ifndef SPRINGLS__KERNEL_MODEL_ANGULAR_GAPS_H
#define SPRINGLS__KERNEL_MODEL_ANGULAR_GAPS_H

#include "../language/winding.h"

#define SPRINGLS__ANGULAR_GAPS_SIZE 64 /* more neighbours than that leave no angle of interest open */

typedef struct springls__angular_gaps {
    springls__v3 e1, e2;             /* the tangent frame */
    float angle[SPRINGLS__ANGULAR_GAPS_SIZE]; /* ascending, radians */
    int count;
} springls__angular_gaps;

SPRINGLS__MATHS springls__angular_gaps springls__angular_gaps_begin(springls__v3 n)
{
    springls__angular_gaps fan;
    fan.e1 = springls__any_tangent(n);
    fan.e2 = springls__cross(n, fan.e1);
    fan.count = 0;
    return fan;
}

/* Adds a neighbour at d from the place; one straight above or below has no direction. */
SPRINGLS__MATHS springls__angular_gaps springls__angular_gaps_add(springls__angular_gaps fan, springls__v3 d)
{
    float u = springls__dot(d, fan.e1), v = springls__dot(d, fan.e2), angle;
    int i;
    if (u * u + v * v < 1e-6f || fan.count == SPRINGLS__ANGULAR_GAPS_SIZE) return fan;
    angle = springls__atan2(v, u);
    for (i = fan.count; i > 0 && fan.angle[i - 1] > angle; i--) fan.angle[i] = fan.angle[i - 1];
    fan.angle[i] = angle;
    fan.count++;
    return fan;
}

/* The two largest angles without a neighbour, and the direction that halves the largest. */
typedef struct springls__widest_gap { float angle, second; springls__v3 middle; } springls__widest_gap;

SPRINGLS__MATHS springls__widest_gap springls__angular_gaps_widest(springls__angular_gaps fan)
{
    const float turn = 6.28318531f, over_pi = 0.318309886f;
    springls__widest_gap opening;
    float from, middle;
    int i;
    opening.angle = turn;
    opening.second = 0.0f;
    opening.middle = fan.e1;
    if (fan.count == 0) return opening;
    from = fan.angle[fan.count - 1];
    opening.angle = fan.angle[0] + turn - from; /* across the cut at pi */
    for (i = 1; i < fan.count; i++) {
        float angle = fan.angle[i] - fan.angle[i - 1];
        opening.second = springls__max(opening.second, springls__min(angle, opening.angle));
        if (angle <= opening.angle) continue;
        opening.angle = angle;
        from = fan.angle[i - 1];
    }
    middle = (from + 0.5f * opening.angle) * over_pi;
    opening.middle = springls__add(springls__scale(fan.e1, springls__cospi(middle)), springls__scale(fan.e2, springls__sinpi(middle)));
    return opening;
}

/* 1 when the neighbours lie around the place as a sheet does: on all sides, or on all but one at its rim. A thread leaves
   two sides open, its end and a drop nearly all. */
SPRINGLS__MATHS int springls__spans_sheet(springls__angular_gaps fan)
{
    const float degree = 0.0174532925f;
    springls__widest_gap opening = springls__angular_gaps_widest(fan);
    return fan.count >= 8 && opening.angle <= 210.0f * degree && opening.second <= 80.0f * degree;
}

#endif
