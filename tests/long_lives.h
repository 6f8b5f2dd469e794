/* long_lives.h - models that live as long as a test wishes: in a flow that reverses, and under random edits; and what is measured
   of them. C99 and C++. */
#ifndef LONG_LIVES_H
#define LONG_LIVES_H

#include "springls.h"
#include "../examples/common/springls/exact_flows.h"
#include "dirty_memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LIFE_FLOW, LIFE_EDITS, LIVES };

/* A life; with the model's state, these numbers decide how it goes on. */
typedef struct life {
    int kind, done;       /* done: steps or edits so far                      */
    int restarts;         /* how often edits had left nothing: a ball followed */
    uint32_t random;
    springls_context *ctx;
} life;

static uint32_t life_bits(life *l)
{
    l->random = l->random * 1664525u + 1013904223u;
    return l->random >> 8;
}

static float life_between(life *l, float low, float high) { return low + (high - low) * (float)life_bits(l) / 16777216.0f; }

static float life_size(const life *l) { return l->kind == LIFE_FLOW ? 64.0f : 96.0f; }

static springls_status life_set_ball(life *l)
{
    springls_sphere ball;
    int k;
    for (k = 0; k < 3; k++) ball.center[k] = l->kind == LIFE_FLOW ? 0.35f * 64.0f : 48.0f;
    ball.radius = l->kind == LIFE_FLOW ? 0.15f * 64.0f : 12.0f;
    return springls_set_implicit(l->ctx, springls_implicit_sphere, &ball);
}

/* Creates the context of a life, without a model. */
static springls_status life_create(life *l, int kind)
{
    springls_desc desc = springls_default_desc();
    springls_params params = springls_default_params();
    memset(l, 0, sizeof *l);
    l->kind = kind;
    l->random = 1u;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = (int)life_size(l);
    params.components = kind == LIFE_EDITS;
    desc.params = &params;
    desc.allocator = dirty_allocator();
    return springls_create(&desc, &l->ctx);
}

static springls_status life_begin(life *l, int kind)
{
    springls_status status = life_create(l, kind);
    return status == SPRINGLS_OK ? life_set_ball(l) : status;
}

static void life_end(life *l)
{
    springls_destroy(l->ctx);
    l->ctx = NULL;
}

/* Takes a step of LeVeque's flow: a period of 1 has a hundred. */
static springls_status life_flow_step(life *l)
{
    struct exact_flow flow = EXACT_DEFORMATION(64.0f, 1.0f);
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    forces.velocity = exact_flow_velocity;
    forces.user = &flow;
    step.forces = &forces;
    step.dt = 0.01f;
    springls_set_time(l->ctx, (double)(l->done % 100) * 0.01);
    return springls_step(l->ctx, &step);
}

/* A brush: moves what is within its radius, at its center by `displacement`, towards the rim by less. */
typedef struct life_brush { float center[3], radius, displacement[3]; } life_brush;

static void life_brush_velocity(void *user, const float *points, int count, float time, float *out)
{
    const life_brush *brush = (const life_brush *)user;
    int i, k;
    (void)time;
    for (i = 0; i < count; i++, points += 3, out += 3) {
        float r2 = 0.0f, share;
        for (k = 0; k < 3; k++) r2 += (points[k] - brush->center[k]) * (points[k] - brush->center[k]);
        share = 1.0f - r2 / (brush->radius * brush->radius);
        share = share > 0.0f ? share * share : 0.0f;
        for (k = 0; k < 3; k++) out[k] = share * brush->displacement[k];
    }
}

/* Pulls the surface at a hit outward by a height in voxels; pushes it in where that is negative. */
static springls_status life_stroke(life *l, const springls_hit *hit, float height)
{
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    life_brush brush;
    int k;
    brush.radius = life_between(l, 5.0f, 10.0f);
    for (k = 0; k < 3; k++) {
        brush.center[k] = hit->point[k];
        brush.displacement[k] = height * hit->normal[k];
        forces.region_lower[k] = hit->point[k] - brush.radius;
        forces.region_upper[k] = hit->point[k] + brush.radius;
    }
    forces.velocity = life_brush_velocity;
    forces.user = &brush;
    step.forces = &forces;
    step.dt = 1.0f;
    return springls_step(l->ctx, &step);
}

/* Finds whether the model has more volume than its first ball. */
static springls_status life_is_large(const life *l, bool *large)
{
    springls_measures measures;
    const springls_status status = springls_measure(l->ctx, &measures);
    *large = status == SPRINGLS_OK && measures.volume > 4.19 * 12.0 * 12.0 * 12.0;
    return status;
}

/* Pulls the surface out or adds a ball where it is closest to a random place; pushes it in or cuts a ball out when the model is
   large. */
static springls_status life_edit(life *l)
{
    springls_sphere ball;
    springls_hit hit;
    float place[3];
    const bool stroke = (life_bits(l) & 1u) != 0u;
    bool large;
    springls_status status = life_is_large(l, &large);
    int k;
    if (status != SPRINGLS_OK) return status;
    for (k = 0; k < 3; k++) place[k] = life_between(l, 34.0f, 62.0f);
    status = springls_closest(l->ctx, SPRINGLS_SURFACE_WATERTIGHT, place, 1, &hit);
    if (status != SPRINGLS_OK || hit.springl < 0) return status;
    if (stroke) return life_stroke(l, &hit, (large ? -1.0f : 1.0f) * life_between(l, 1.0f, 5.0f));
    for (k = 0; k < 3; k++) ball.center[k] = 0.5f * (hit.point[k] + place[k]); /* within the middle of the grid */
    ball.radius = life_between(l, 3.0f, 8.0f);
    return springls_combine_implicit(l->ctx, large ? SPRINGLS_OPERATION_DIFFERENCE : SPRINGLS_OPERATION_UNION,
                                     springls_implicit_sphere, &ball);
}

/* Edits; every hundredth time the present surface becomes the original one, which each ball makes larger. */
static springls_status life_edit_and_set_reference(life *l)
{
    const springls_status status = life_edit(l);
    return status == SPRINGLS_OK && l->done % 100 == 99 && springls_count(l->ctx) > 0 ? springls_set_reference(l->ctx) : status;
}

/* Takes `count` steps or edits. */
static springls_status life_advance(life *l, int count)
{
    springls_status status = SPRINGLS_OK;
    for (; count > 0 && status == SPRINGLS_OK; count--, l->done++) {
        status = l->kind == LIFE_FLOW ? life_flow_step(l) : life_edit_and_set_reference(l);
        if (l->kind == LIFE_EDITS && (status == SPRINGLS_EMPTY_MODEL || (status == SPRINGLS_OK && springls_count(l->ctx) == 0))) {
            l->restarts++;
            status = life_set_ball(l);
        }
    }
    return status;
}

/* What is measured. */
typedef struct life_state {
    double volume, smallest; /* voxels; smallest: of the bodies and cavities, HUGE_VAL in LIFE_FLOW */
    int components, euler, springls;
    size_t memory;
    uint64_t hash;
} life_state;

static springls_status life_measure(life *l, life_state *s)
{
    springls_measures measures;
    const springls_component *components;
    int i, count = 0;
    springls_status status = springls_measure(l->ctx, &measures);
    memset(s, 0, sizeof *s);
    s->smallest = HUGE_VAL;
    if (status != SPRINGLS_OK) return status;
    if (l->kind == LIFE_EDITS) status = springls_components(l->ctx, &components, &count);
    for (i = 0; i < count && status == SPRINGLS_OK; i++)
        s->smallest = fmin(s->smallest, fabs(components[i].volume));
    s->volume = measures.volume;
    s->components = measures.components;
    s->euler = measures.euler;
    s->springls = springls_count(l->ctx);
    s->memory = springls_memory_used(l->ctx);
    s->hash = springls_state_hash(l->ctx);
    return status;
}

#endif
