/* fill_from_springls.h - springls for holes among springls (params.fill_from_springls). */
#ifndef SPRINGLS__KERNEL_STAGES_FILL_FROM_SPRINGLS_H
#define SPRINGLS__KERNEL_STAGES_FILL_FROM_SPRINGLS_H

#include "../model/angular_gaps.h"
#include "../model/cell_list.h"
#include "../model/fit.h"
#include "../model/model.h"
#include "../model/neighborhood.h"
#include "contract.h"
#include "project.h"
#include "track.h"

/* A springl to be. */
typedef struct springls__seed { springls__v3 p, n, toward, a; int ok, pad[3]; } springls__seed;

/* Two springls of one side nearer than this would be one too many. Beyond merge_distance, or contract would take it again. */
#define SPRINGLS__SEED_DISTANCE 0.7f
#define SPRINGLS__SEED_REACH 1.85f /* no seed is further from its springl: .85 aside, and a fit moves it by 1 at most */

SPRINGLS__MATHS bool springls__too_close(springls__v3 p, springls__v3 n, springls__v3 p_other, springls__v3 n_other)
{
    const float r = SPRINGLS__SEED_DISTANCE;
    return springls__length2(springls__sub(p, p_other)) < r * r && springls__dot(n, n_other) > 0.3f;
}

SPRINGLS__MATHS bool springls__has_room(const springls__model *model, springls__v3 x, springls__v3 n)
{
    const float r = SPRINGLS__SEED_DISTANCE;
    springls__cell_walk walk = springls__cell_walk_near(model, x, r);
    int other;
    while ((other = springls__cell_walk_next(&walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *o = &model->set.s[other];
        if (springls__length2(springls__sub(o->p, x)) >= r * r) continue;
        if (springls__too_close(x, n, o->p, springls__springl_normal(*o))) return false;
    }
    return true;
}

/* How far, in the mean square, the springls around are from having p, facing n, on the surface that each of them spans. */
SPRINGLS__MATHS float springls__disagreement2(const springls__model *model, springls__v3 p, springls__v3 n)
{
    const float r = SPRINGLS__PROJECT_RADIUS;
    springls__cell_walk walk = springls__cell_walk_near(model, p, r);
    float weight = 0.0f, value = 0.0f;
    int other;
    while ((other = springls__cell_walk_next(&walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *o = &model->set.s[other];
        springls__estimate say = springls__oriented_distance(p, n, o->p, springls__springl_normal(*o));
        weight += say.weight;
        value += say.weight * say.distance * say.distance;
    }
    return weight > 0.0f ? value / weight : FLT_MAX;
}

/* What springl i misses beside it: a springl in the middle of the widest opening between its neighbours, on the surface
   that those around the place span. It must be enclosed: beyond the rim of the springls that surface is a guess. */
SPRINGLS__MATHS springls__seed springls__seed_beside(const springls__model *model, int i)
{
    const float degree = 0.0174532925f, widest = 110.0f * degree, enclosed = 165.0f * degree;
    const float range = 1.3f, away = SPRINGLS__SEED_REACH - 1.0f, worst = 0.15f;
    SPRINGLS__GLOBAL const springls__springl *s = &model->set.s[i];
    springls__v3 n = springls__springl_normal(*s), x;
    springls__widest_gap opening = springls__widest_gap_at(model, s->p, n, range, 1.0f);
    springls__fit_result fit;
    springls__seed seed;
    seed.p = seed.n = seed.toward = seed.a = springls__v3_make(0.0f, 0.0f, 0.0f);
    seed.ok = seed.pad[0] = seed.pad[1] = seed.pad[2] = 0;
    if (opening.angle <= widest || springls__at_edge(model, i)) return seed; /* a side opens at its edge */
    x = springls__mad(s->p, opening.middle, away);
    if (!springls__has_room(model, x, n)) return seed;
    fit = springls__fit_at(model, x, n, model->set.a[i], model->set.count);
    if (!fit.ok || !springls__has_room(model, fit.point, fit.normal)) return seed;
    if (springls__widest_gap_at(model, fit.point, fit.normal, SPRINGLS__FIT_RADIUS, 1.0f).angle >= enclosed) return seed;
    if (springls__disagreement2(model, fit.point, fit.normal) > worst * worst) return seed;
    seed.p = fit.point;
    seed.n = fit.normal;
    seed.toward = springls__sub(s->p, fit.point);
    seed.a = springls__project_on_original(model, fit.a);
    seed.ok = 1;
    return seed;
}

/* To SCRATCH1, and its fate to SCRATCH2. */
SPRINGLS__MATHS void springls__seed_element(const springls__model *model, springls__arguments args, int i)
{
    springls__seed seed = springls__seed_beside(model, i);
    (void)args;
    springls__seeds(model)[i] = seed;
    springls__seed_action(model)[i] = seed.ok ? SPRINGLS__UNDECIDED : SPRINGLS__REMOVE;
}

/* Seeds are accepted in springl order, none close to an accepted one. Round after round those are decided whose predecessors
   are, from fate (SCRATCH2) to the next fate (SCRATCH3). */
SPRINGLS__MATHS uint8_t springls__decide_seed(const springls__model *model, int i)
{
    SPRINGLS__GLOBAL const springls__seed *seeds = springls__seeds(model);
    SPRINGLS__GLOBAL const uint8_t *fate = springls__seed_action(model);
    springls__seed seed = seeds[i];
    springls__cell_walk walk = springls__cell_walk_near(model, seed.p, SPRINGLS__SEED_REACH + SPRINGLS__SEED_DISTANCE + 0.01f);
    uint8_t decided = SPRINGLS__KEEP;
    int other;
    while ((other = springls__cell_walk_next(&walk)) >= 0) {
        if (other >= i || fate[other] == SPRINGLS__REMOVE
            || !springls__too_close(seed.p, seed.n, seeds[other].p, seeds[other].n)) continue;
        if (fate[other] == SPRINGLS__KEEP) return SPRINGLS__REMOVE;
        decided = SPRINGLS__UNDECIDED;
    }
    return decided;
}

SPRINGLS__MATHS void springls__seed_choose_element(const springls__model *model, springls__arguments args, int i)
{
    uint8_t now = springls__seed_action(model)[i];
    (void)args;
    springls__next_seed_action(model)[i] = now == SPRINGLS__UNDECIDED ? springls__decide_seed(model, i) : now;
}

/* To SCRATCH4: 1 for an accepted seed; a scan makes it the seed's number. */
SPRINGLS__MATHS void springls__seed_count_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__seed_number(model)[i] =
        springls__seed_action(model)[i] == SPRINGLS__KEEP ? 1u : 0u;
}

/* The first job.i[0] accepted seeds become springls. */
SPRINGLS__MATHS void springls__insert_seeds_element(const springls__model *model, springls__arguments args, int i)
{
    const float area = 0.324759526f; /* of an equilateral triangle with circumradius 0.5 */
    springls__seed seed = springls__seeds(model)[i];
    uint32_t at = springls__seed_number(model)[i];
    int n = model->set.count + (int)at;
    springls__tri t;
    if (springls__seed_action(model)[i] != SPRINGLS__KEEP || at >= (uint32_t)args.insert.count) return;
    t = springls__equilateral(seed.p, seed.n, seed.toward, area);
    springls__springl_add(model, n, springls__springl_make(t, seed.p), seed.a, model->set.generation[i] + 1u, 0);
    model->set.parent[n] = model->set.id[i];
}

#endif
