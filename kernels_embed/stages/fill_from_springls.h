/* fill_from_springls.h - fills holes among springls (params.fill_from_springls). */
#ifndef SPRINGLS__KERNEL_STAGES_FILL_FROM_SPRINGLS_H
#define SPRINGLS__KERNEL_STAGES_FILL_FROM_SPRINGLS_H

#include "../model/angular_gaps.h"
#include "../model/cell_list.h"
#include "../model/error_estimates.h"
#include "../model/fit.h"
#include "../model/model.h"
#include "../model/neighborhood.h"
#include "contract.h"
#include "project.h"
#include "track.h"

/* A springl to add; a: its correspondence, which insert_seeds puts on the original surface where the seed is kept. */
typedef struct springls__seed { springls__v3 p, n, toward, a; int ok, pad[3]; } springls__seed;

/* Voxels: least distance of a seed from springls of its side; more than merge_distance, or contract would remove it again. */
#define SPRINGLS__SEED_DISTANCE 0.7f
/* Voxels: largest distance of a seed from its springl: 0.85 aside, and the fit moves it by at most 1. */
#define SPRINGLS__SEED_RANGE 1.85f

SPRINGLS__MATHS bool springls__too_close(springls__v3 p, springls__v3 n, springls__v3 p_other, springls__v3 n_other)
{
    const float r = SPRINGLS__SEED_DISTANCE;
    return springls__length2(springls__sub(p, p_other)) < r * r && springls__dot(n, n_other) > SPRINGLS__SAME_SIDE;
}

SPRINGLS__MATHS bool springls__has_room(const springls__model *model, int of, springls__v3 x, springls__v3 n)
{
    const float r = SPRINGLS__SEED_DISTANCE;
    springls__cell_walk walk = springls__cell_walk_near(model, x, r);
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *o = &model->set.s[other];
        if (springls__length2(springls__sub(o->p, x)) >= r * r) continue;
        if (springls__of_two_contact_bodies(model, of, other)) continue;
        if (springls__too_close(x, n, o->p, springls__springl_normal(*o))) return false;
    }
    return true;
}

/* Returns the mean square distance (voxel^2) of p, facing n, from the surfaces that the springls around it span, those of
   the body of springl `of`. */
SPRINGLS__MATHS float springls__disagreement2(const springls__model *model, int of, springls__v3 p, springls__v3 n)
{
    const float r = SPRINGLS__PROJECT_RADIUS;
    springls__cell_walk walk = springls__cell_walk_near(model, p, r);
    float weight = 0.0f, value = 0.0f;
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *o = &model->set.s[other];
        springls__estimate estimate = springls__oriented_distance(p, n, o->p, springls__springl_normal(*o));
        if (springls__of_two_contact_bodies(model, of, other)) continue;
        weight += estimate.weight;
        value += estimate.weight * estimate.distance * estimate.distance;
    }
    return weight > 0.0f ? value / weight : FLT_MAX;
}

/* Finds the springl missing beside springl i: in the middle of the widest angular gap between its neighbors, on the surface
   that the springls around that place span. Springls must lie around it on all sides: beyond a rim that surface is a guess. */
SPRINGLS__MATHS springls__seed springls__seed_beside(const springls__model *model, int i)
{
    const float widest = 110.0f * SPRINGLS__DEGREE, enclosed = 165.0f * SPRINGLS__DEGREE;
    const float range = 1.3f, away = SPRINGLS__SEED_RANGE - 1.0f, worst = 0.15f;
    SPRINGLS__GLOBAL const springls__springl *s = &model->set.s[i];
    springls__v3 n = springls__springl_normal(*s), x;
    springls__widest_gap gap;
    springls__fit_result fit;
    springls__seed seed;
    seed.p = seed.n = seed.toward = seed.a = springls__v3_make(0.0f, 0.0f, 0.0f);
    seed.ok = seed.pad[0] = seed.pad[1] = seed.pad[2] = 0;
    if (springls__is_surrounded(model, i, s->p, n, range, 1.0f)) return seed;
    gap = springls__widest_gap_at(model, i, s->p, n, range, 1.0f);
    if (gap.angle <= widest || springls__at_edge(model, i)) return seed; /* at an edge a side ends */
    x = springls__mad(s->p, gap.middle, away);
    if (!springls__has_room(model, i, x, n)) return seed;
    fit = springls__fit_at(model, i, x, n, model->set.a[i], model->set.count);
    if (!fit.ok || !springls__has_room(model, i, fit.point, fit.normal)) return seed;
    if (!springls__is_surrounded(model, i, fit.point, fit.normal, SPRINGLS__FIT_RADIUS, 1.0f)
        && springls__widest_gap_at(model, i, fit.point, fit.normal, SPRINGLS__FIT_RADIUS, 1.0f).angle >= enclosed) return seed;
    if (springls__disagreement2(model, i, fit.point, fit.normal) > worst * worst) return seed;
    seed.p = fit.point;
    seed.n = fit.normal;
    seed.toward = springls__sub(s->p, fit.point);
    seed.a = fit.a;
    seed.ok = 1;
    return seed;
}

/* Finds the seed beside springl i, if any. */
SPRINGLS__MATHS void springls__seed_element(const springls__model *model, springls__arguments args, int i)
{
    springls__seed seed;
    (void)args;
    springls__seed_action(model)[i] = SPRINGLS__REMOVE;
    if (springls__is_asleep(model, i)) return;
    seed = springls__seed_beside(model, i);
    springls__seeds(model)[i] = seed;
    springls__seed_action(model)[i] = seed.ok ? SPRINGLS__UNDECIDED : SPRINGLS__REMOVE;
}

/* Decides about seed i in a round of choosing: it is kept unless an earlier kept seed is too close. It stays undecided until all
   earlier seeds near it are decided. */
SPRINGLS__MATHS uint8_t springls__decide_seed(const springls__model *model, int i)
{
    SPRINGLS__GLOBAL const springls__seed *seeds = springls__seeds(model);
    SPRINGLS__GLOBAL const uint8_t *action = springls__seed_action(model);
    springls__seed seed = seeds[i];
    springls__cell_walk walk = springls__cell_walk_near(model, seed.p, SPRINGLS__SEED_RANGE + SPRINGLS__SEED_DISTANCE + 0.01f);
    uint8_t decided = SPRINGLS__KEEP;
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        if (other >= i || action[other] == SPRINGLS__REMOVE
            || !springls__too_close(seed.p, seed.n, seeds[other].p, seeds[other].n)
            || springls__of_two_contact_bodies(model, i, other)) continue;
        if (action[other] == SPRINGLS__KEEP) return SPRINGLS__REMOVE;
        decided = SPRINGLS__UNDECIDED;
    }
    return decided;
}

SPRINGLS__MATHS void springls__seed_choose_element(const springls__model *model, springls__arguments args, int i)
{
    uint8_t current = springls__seed_action(model)[i];
    (void)args;
    springls__next_seed_action(model)[i] = current == SPRINGLS__UNDECIDED ? springls__decide_seed(model, i) : current;
}

/* Flags seed i in seed_number when it is kept. */
SPRINGLS__MATHS void springls__seed_count_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__seed_number(model)[i] = springls__seed_action(model)[i] == SPRINGLS__KEEP ? 1u : 0u;
}

/* Makes a springl of seed i, if it is among the first args.insert.count that are kept. */
SPRINGLS__MATHS void springls__insert_seeds_element(const springls__model *model, springls__arguments args, int i)
{
    const float area = 0.324759526f; /* of an equilateral triangle with circumradius 0.5 */
    springls__seed seed = springls__seeds(model)[i];
    uint32_t at = springls__seed_number(model)[i];
    int n = model->set.count + (int)at;
    springls__tri t;
    if (springls__seed_action(model)[i] != SPRINGLS__KEEP || at >= (uint32_t)args.insert.count) return;
    seed.a = springls__project_on_original(model, seed.a);
    t = springls__equilateral(seed.p, seed.n, seed.toward, area);
    springls__springl_add(model, n, springls__springl_make(t, seed.p), seed.a, model->set.generation[i] + 1u, 0);
    model->set.parent[n] = model->set.id[i];
    model->set.error[n] = springls__error_at_birth(model, seed.p, seed.n, seed.a, model->set.count);
    springls__inherit_components(model, n, i);
    model->set.overlapped[n] = model->set.overlapped[i];
}

#endif
