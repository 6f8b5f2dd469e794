/* follow_level_set.h - replaces the level set by another one, and keeps the springls that lie near it: a skin for particles, whose union is
   known anew in each frame. Springls that the motion has brought within reach are drawn onto the new zero level, with their
   identity, correspondence and attributes; the others go. Where the zero level is bare near them, gaps are filled as after motion;
   where it is bare and none is near, as on a drop that has come off, springls are made as an input makes them.

   Bricks in which the two level sets agree to a tolerance stay as they are, springls and all: so what rests sleeps, and does not
   flicker. */
#ifndef SPRINGLS__TOOLS_FOLLOW_LEVEL_SET_H
#define SPRINGLS__TOOLS_FOLLOW_LEVEL_SET_H

#include "../input/set_level_set.h"
#include "../output/attributes.h"
#include "combine.h"

/* The numbers of a follow, voxels, and the model that holds the new level set. */
typedef struct springls__follow_job {
    springls_context *ctx, *other;
    float reach, tolerance;
    uint8_t *action; /* KEEP or REMOVE, a springl */
} springls__follow_job;

#define SPRINGLS__ISOLATED 3.0f /* voxels: a springl further from all that face like it is a part of its own */

/* Draws a springl onto the new zero level. Returns false if the zero level is out of reach, or faces another way. */
SPRINGLS__FN bool springls__draw_to_level_set(const springls__follow_job *job, springls__springl *s)
{
    const springls__grid *g = &job->other->model.grid;
    const float facing = 0.2f, off = 0.1f, arrived = 1e-3f; /* cosine; voxels */
    const springls__v3 n = springls__springl_normal(*s);
    const int max_steps = 6;
    springls__v3 x = s->p, before, gradient, moved;
    int i;
    if (springls__fabs(springls__grid_sample(g, g->phi, x)) > job->reach) return false;
    for (i = 0; i < max_steps; i++) {
        before = x;
        x = springls__newton_step(g, x);
        if (springls__length2(springls__sub(x, before)) < arrived * arrived) break;
    }
    gradient = springls__normalize(springls__grid_gradient(g, g->phi, x));
    moved = springls__sub(x, s->p);
    if (springls__fabs(springls__grid_sample(g, g->phi, x)) > off || springls__dot(gradient, n) < facing
        || springls__length2(moved) > 4.0f * job->reach * job->reach) return false;
    s->p = x;
    for (i = 0; i < 3; i++) s->q[i] = springls__add(s->q[i], moved);
    *s = springls__springl_finished(*s);
    return true;
}

/* Decides which springls stay, and draws those to the new level set that it has left. A springl in a brick that stays (awake = 0) stays
   as it is. */
SPRINGLS__FN void springls__follow_springl_task(void *arg, int begin, int end)
{
    const springls__follow_job *job = (const springls__follow_job *)arg;
    springls__model *model = &job->ctx->model;
    for (; begin < end; begin++) {
        springls__springl *s = &model->set.s[begin];
        const int slot = springls__slot_of_place(&model->grid, s->p);
        bool stays = slot >= SPRINGLS__FIRST_SLOT && !model->grid.awake[slot];
        if (!stays) stays = springls__draw_to_level_set(job, s);
        job->action[begin] = (uint8_t)(stays ? SPRINGLS__KEEP : SPRINGLS__REMOVE);
    }
}

/* Takes the new values of the active brick of an entry into phi_next, and marks in `awake` whether they differ from the old ones. */
SPRINGLS__FN void springls__take_brick(const springls__follow_job *job, int entry)
{
    springls__grid *g = &job->ctx->model.grid;
    const int slot = g->top[entry];
    const float *phi = g->phi + (size_t)slot * SPRINGLS__BRICK_VOXELS;
    const float *taken = springls__phi_of_entry(&job->other->model.grid, g, entry);
    float *out = g->phi_next + (size_t)slot * SPRINGLS__BRICK_VOXELS;
    const float band = 1.0f; /* voxel: beyond it no surface is */
    bool differs = false;
    int v;
    for (v = 0; v < SPRINGLS__BRICK_VOXELS && !differs; v++)
        differs = springls__fabs(taken[v] - phi[v]) > job->tolerance
            && springls__min(springls__fabs(taken[v]), springls__fabs(phi[v])) < band;
    memcpy(out, differs ? taken : phi, SPRINGLS__BRICK_VOXELS * sizeof *out);
    g->awake[slot] = differs;
}

/* Takes the new level set, where it differs: phi_next; `awake` marks these bricks. The bricks of both are active. */
SPRINGLS__FN void springls__take_level_set(const springls__follow_job *job)
{
    springls__grid *g = &job->ctx->model.grid;
    int i, entries = (int)springls__entry_count(g);
    for (i = 0; i < entries; i++)
        if (g->top[i] >= SPRINGLS__FIRST_SLOT) springls__take_brick(job, i);
    for (i = 0; i < entries; i++)
        if (g->top[i] < SPRINGLS__FIRST_SLOT)
            g->top[i] = *springls__phi_of_entry(&job->other->model.grid, g, i) < 0.0f ? SPRINGLS__INSIDE : SPRINGLS__OUTSIDE;
}

/* Ends the calm of the bricks that `awake` marks; the others sleep. */
SPRINGLS__FN void springls__calm_of_taken(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int i;
    for (i = 0; i < g->active_count; i++)
        if (g->awake[g->active[i]]) springls__end_calm(g, g->active[i]);
}

/* Removes the springls that have not been kept. */
SPRINGLS__FN springls_status springls__drop_left_behind(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    SPRINGLS__TRY(springls__attributes_before_removal(ctx));
    springls__stir(ctx, SPRINGLS__STIR_CONTRACTED, 0, count);
    SPRINGLS__TRY(springls__constellation_compact(ctx));
    springls__attributes_after_removal(ctx, count);
    ctx->stats.removed += count - ctx->model.set.count;
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

/* Returns whether a springl that has been kept lies within a radius of x and faces as n does. Looks right beside x first, where there is
   one at most places. */
SPRINGLS__FN bool springls__is_beside_kept(const springls__follow_job *job, springls__v3 x, springls__v3 n, float radius)
{
    const springls__model *model = &job->ctx->model;
    springls__cell_walk walk = springls__cell_walk_near(model, x, springls__min(0.75f, radius));
    int i;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0)
        if (springls__length2(springls__sub(model->set.s[i].p, x)) <= walk.r2
            && springls__dot(springls__tri_area2(springls__springl_tri(model->set.s[i])), n) >= 0.0f) return true;
    return springls__nearest_springl_facing(model, x, n, radius) >= 0;
}

/* Returns whether active brick i of the new level set has a triangle beside which no springl has been kept. */
SPRINGLS__FN bool springls__has_isolated(const springls__follow_job *job, int i)
{
    const float beside = SPRINGLS__ISOLATED - 1.5f; /* springls move from their triangles by three Newton steps of at most half a voxel */
    const springls__initial_cubes cubes = springls__initial_cubes_of(job->other, i);
    int at[3], k;
    memcpy(at, cubes.lo, sizeof at);
    do {
        const springls__mc_cell cell = springls__initial_cell(&job->other->model.grid, at, cubes.stride);
        const int mask = springls__mc_case(cell), triangles = springls__mc_count(mask);
        for (k = 0; k < triangles; k++) {
            springls__tri t;
            t.a = springls__initial_crossing(&cubes, cell, at, springls__mc_edge(mask, k, 0));
            t.b = springls__initial_crossing(&cubes, cell, at, springls__mc_edge(mask, k, 1));
            t.c = springls__initial_crossing(&cubes, cell, at, springls__mc_edge(mask, k, 2));
            if (!springls__is_beside_kept(job, springls__tri_centroid(t), springls__tri_normal(t), beside)) return true;
        }
    } while (springls__next_initial_cube(&cubes, at));
    return false;
}

/* Forgets the springls of bricks that have none to be copied: initial_before counts them. */
SPRINGLS__FN void springls__pass_over_task(void *arg, int begin, int end)
{
    const springls__follow_job *job = (const springls__follow_job *)arg;
    int *before = springls__initial_before(&job->other->model);
    for (; begin < end; begin++)
        if (before[begin] > 0 && !springls__has_isolated(job, begin)) before[begin] = 0;
}

/* Makes the springls of the new level set in the bricks where some are isolated. */
SPRINGLS__FN springls_status springls__make_isolated(springls__follow_job *job)
{
    springls_context *ctx = job->ctx, *other = job->other;
    springls_status status;
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    springls__parallel(ctx, other->model.grid.active_count, 2, springls__pass_over_task, job);
    status = springls__make_counted_springls(other, springls__scan_initial_counts(other));
    return status == SPRINGLS_OK ? status : springls__fail(ctx, status, "follow_level_set: %.200s", other->error);
}

/* Marks the springls of the new level set that no kept one is near, to be copied. */
SPRINGLS__FN void springls__isolated_task(void *arg, int begin, int end)
{
    const springls__follow_job *job = (const springls__follow_job *)arg;
    const springls__model *from = &job->other->model;
    for (; begin < end; begin++) {
        const springls__springl *s = &from->set.s[begin];
        const bool beside = springls__is_beside_kept(job, s->p, springls__springl_normal(*s), SPRINGLS__ISOLATED);
        springls__contract_action(from)[begin] = (uint8_t)(beside ? SPRINGLS__REMOVE : SPRINGLS__KEEP);
    }
}

/* Sets the correspondence of springl i to its own place. */
SPRINGLS__FN void springls__correspond_to_place(springls_context *ctx, int i)
{
    const springls__v3 lattice = springls__to_lattice(&ctx->window, ctx->model.set.s[i].p);
    ctx->model.set.a[i] = springls__from_lattice(&ctx->original_window, lattice);
}

/* Copies the springls on parts that have come without any: their correspondences are the places where they come. Returns how many. */
SPRINGLS__FN springls_status springls__add_isolated(springls__follow_job *job, int *added)
{
    springls_context *ctx = job->ctx, *other = job->other;
    const int count = ctx->model.set.count;
    const springls__side_rule none = springls__rule_of(&other->model.grid, NULL, SPRINGLS_OPERATION_UNION, true);
    int i;
    SPRINGLS__TRY(springls__make_isolated(job));
    if (SPRINGLS__RESERVE(other, contract_action, other->model.set.count) != SPRINGLS_OK)
        return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "follow_level_set: out of memory");
    springls__parallel(ctx, other->model.set.count, 64, springls__isolated_task, job);
    for (i = *added = 0; i < other->model.set.count; i++)
        *added += springls__contract_action(&other->model)[i] == SPRINGLS__KEEP;
    if (count + *added > ctx->desc.max_springls)
        return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "follow_level_set: more than %d springls", ctx->desc.max_springls);
    SPRINGLS__TRY(springls__constellation_reserve(ctx, count + *added));
    for (i = 0; i < ctx->attribute_count; i++)
        SPRINGLS__TRY(springls__values_reserve(ctx, &ctx->attributes[i], count + *added, count));
    for (i = 0; i < other->model.set.count; i++) {
        if (springls__contract_action(&other->model)[i] != SPRINGLS__KEEP) continue;
        springls__copy_other_springl(ctx, other, i, &none, false);
        springls__correspond_to_place(ctx, ctx->model.set.count - 1);
    }
    springls__stir(ctx, SPRINGLS__STIR_ALL, count, *added);
    ctx->stats.added += *added;
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

/* Calls the callback for the attributes of the springls from number `first` on. */
SPRINGLS__FN springls_status springls__fill_new_values(springls_context *ctx, const springls_follow_desc *desc, int first)
{
    const int count = ctx->model.set.count - first;
    springls_status status = SPRINGLS_OK;
    springls__buffer places;
    int i, k;
    if (!desc->values || !count || !ctx->attribute_count) return SPRINGLS_OK;
    memset(&places, 0, sizeof places);
    SPRINGLS__TRY(springls__buffer_grow(ctx, &places, 3 * (size_t)count, sizeof(float), 0));
    for (i = 0; i < count; i++)
        springls__voxel_to_world(ctx, ctx->model.set.s[first + i].p, (float *)places.data + 3 * (size_t)i);
    for (k = 0; k < ctx->attribute_count && status == SPRINGLS_OK; k++) {
        float *values = springls__values_of(&ctx->attributes[k], first);
        (desc->values)(desc->user, k, (const float *)places.data, count, values);
        status = springls__finite_values(ctx, values, (size_t)count * (size_t)ctx->attributes[k].channels, "follow_level_set");
    }
    springls__buffer_free(ctx, &places);
    return status;
}

/* Does the work on checked arguments. On failure the model is left unfinished. */
SPRINGLS__FN springls_status springls__follow_other(springls__follow_job *job, const springls_follow_desc *desc)
{
    springls_context *ctx = job->ctx;
    int first, added;
    SPRINGLS__TRY(springls__bricks_of_both(ctx, &job->other->model.grid));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, contract_action, ctx->model.set.count));
    job->action = springls__contract_action(&ctx->model);
    if (springls__may_sleep(ctx)) springls__rest_all(ctx);
    springls__take_level_set(job);
    springls__calm_of_taken(ctx);
    springls__parallel(ctx, ctx->model.set.count, 64, springls__follow_springl_task, job);
    SPRINGLS__TRY(springls__drop_left_behind(ctx));
    springls__swap_phi(ctx);
    ctx->omega_fresh = false;
    first = ctx->model.set.count;
    SPRINGLS__TRY(springls__add_isolated(job, &added));
    SPRINGLS__TRY(springls__fill_new_values(ctx, desc, first));
    springls__find_awake(ctx);
    return springls__run_completion(ctx, springls__complete);
}

/* Makes the model that holds the new level set, and counts the triangles of its zero. */
SPRINGLS__FN springls_status springls__make_followed(springls_context *ctx, const springls_follow_desc *desc, springls_context **other)
{
    const springls__brick_box all = springls__all_bricks(&ctx->model.grid);
    springls__implicit_job job;
    springls_context *made;
    springls_status status;
    SPRINGLS__TRY(springls__create_alike(ctx, "follow_level_set", other));
    made = *other;
    made->model.params.keep_edges = 0;
    memcpy(made->home, ctx->window.offset, sizeof made->home);
    springls__clear_model(made);
    job.ctx = made;
    job.fn = desc->fn;
    job.user = desc->user;
    if (desc->phi) status = springls__set_from_voxels(made, springls__level_set_value, desc->phi, &all);
    else status = springls__set_from_distance(made, springls__implicit_distance, &job, NULL, 0.0f);
    if (status == SPRINGLS_OK && !desc->phi) status = springls__redistance_in_voxels(made);
    if (status == SPRINGLS_OK) status = springls__count_initial(made);
    return status == SPRINGLS_OK ? status : springls__fail(ctx, status, "follow_level_set: %.200s", made->error);
}

SPRINGLS__FN springls_status springls__check_follow(springls_context *ctx, const springls_follow_desc *desc)
{
    if (!desc) return springls__fail_null(ctx, "follow_level_set", "the description");
    if (!desc->fn == !desc->phi)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "follow_level_set: either fn or phi has to be given, and not both");
    SPRINGLS__TRY(springls__check_amount(ctx, "follow_level_set", "reach", (double)desc->reach));
    if (desc->reach > ctx->model.params.band_half_width)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "follow_level_set: reach is %g, more than band_half_width",
                              (double)desc->reach);
    return springls__check_amount(ctx, "follow_level_set", "tolerance", (double)desc->tolerance);
}

SPRINGLS__TOOLS_API springls_status springls_follow_level_set(springls_context *ctx, const springls_follow_desc *desc)
{
    springls__follow_job job;
    springls_status status;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_follow(ctx, desc));
    if (ctx->model.set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "follow_level_set: there are no springls");
    SPRINGLS__TRY(springls__follow_all(ctx));
    memset(&job, 0, sizeof job);
    job.ctx = ctx;
    job.reach = desc->reach > 0.0f ? desc->reach : 1.5f;
    job.tolerance = desc->tolerance > 0.0f ? desc->tolerance : 0.05f;
    status = springls__make_followed(ctx, desc, &job.other);
    if (status == SPRINGLS_OK) {
        status = springls__use_host_calmly(ctx, true);
        if (status == SPRINGLS_OK) status = springls__follow_other(&job, desc);
        springls__clear_on_failure(ctx, status);
    }
    springls_destroy(job.other);
    return status;
}

#endif
