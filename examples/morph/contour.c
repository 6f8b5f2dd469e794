/* contour.c - active contours push the model to the shape of a frame (shape.c), and keep it one body without hollows and handles.
 *
 * The pressure is minus the shape's signed distance, at most `pace`. In a crevice or at the tip of a thin limb that is little, and
 * hardly a springl faces the way that a limb grows: its sides are where they should be. So where the model lags behind, and on the
 * way there, the pressure is the full pace, and a velocity leads springls along that way. What is thinner than a voxel tears, and
 * where bodies part drops stay.
 * The shape is one body without hollows and handles, but a contour only moves surfaces: it joins and parts nothing. So where the
 * model is not, its level set is repaired as that of a character is (solid_voxels.h, solid_handles.h), and where the repair has
 * changed its side the contour moves the model there: drops and hollows shrink until they vanish, a larger part grows along the
 * shortest bridge until it meets the rest, and a handle is cut where it is thinnest.
 *
 * A step is the paper's eq. 1 with the pressure rho and, where the model lags, the velocity sigma. */
#include "morph/morph.h"

#include "base/threads.h"
#include "base/vec3.h"
#include "character/solid_handles.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LAG 1.5f     /* voxels: the model lags in a voxel on its other side where the two signed distances differ by more,... */
#define SURE 0.1f    /* voxel: ...and the voxel is at least this deep inside, or outside, the shape */
#define LEAD 0.5f    /* part of the pace: velocity along the way to where the model lags */
#define OUTSIDE 0.5f /* voxel: parts of the model that are this far outside the shape are not joined to the rest, but given up */
#define BARELY 1e-3f /* voxel: phi of what is given up, just outside */

enum { STEPS = 10, LAST_STEPS = 30 }; /* towards the shape of a frame, and of the last one, at most */
enum { FEW = 341 };                   /* one voxel in this many of the grid's square may lag until the next frame: 27 at grid 96 */
enum { PATIENCE = 4 };                /* the last frame's steps in a row by which nothing is gained */
enum { MEND = 30 };                   /* steps that make it whole, at most: a voxel each */

/* way: a velocity beside the pressure, NULL: none. */
static bool contour_step(struct morph *morph, const float *way)
{
    springls_forces forces;
    springls_step_desc step;
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    forces.voxel_units = true;
    forces.pressure_grid.data = morph->pressure;
    forces.velocity_grid.data = way;
    step.forces = &forces;
    step.mode = SPRINGLS_MODE_FLUID;
    step.dt = 1.0f;
    step.stop_at_topology = morph->settings.preserve;
    return morph_check(morph->ctx, springls_step(morph->ctx, &step), "active contour");
}

/* Lists a voxel and the 26 around it. Returns how many there are: none at the grid's border. */
static int voxels_around(const int size[3], size_t voxel, size_t around[27])
{
    const int at = (int)voxel, place[3] = {at % size[0], at / size[0] % size[1], at / (size[0] * size[1])};
    for (int k = 0; k < 3; ++k) {
        if (place[k] < 1 || place[k] > size[k] - 2) { return 0; }
    }
    for (int k = 0; k < 27; ++k) {
        around[k] = (size_t)(at + k % 3 - 1 + size[0] * (k / 3 % 3 - 1 + size[1] * (k / 9 - 1)));
    }
    return 27;
}

/* ---- towards the shape ---- */

/* Return true where the model lags: the voxel is inside the shape and outside the model, or the reverse, and the model's surface is
 * far, or so torn that its phi is small although the voxel is deep in the shape. */
static bool lags_inside(float shape, float model) { return shape < -SURE && model >= 0.0f && model - shape > LAG; }
static bool lags_outside(float shape, float model) { return shape > SURE && model < 0.0f && shape - model > LAG; }

struct press_loop {
    struct morph *morph;
    const float *model;
    const float *shape;
    int *lags;
};

static void run_press_loop(void *arg, int begin, int end)
{
    const struct press_loop *loop = arg;
    struct morph *morph = loop->morph;
    const float *model = loop->model;
    const float *shape = loop->shape;
    int lags = 0;
    for (int n = begin; n < end; ++n) {
        morph->pressure[n] = morph_pressure(morph, shape[n]);
        lags += lags_inside(shape[n], model[n]) || lags_outside(shape[n], model[n]);
    }
    threads_lock();
    *loop->lags += lags;
    threads_unlock();
}

/* Sets the pressure of all voxels; counts those where the model lags. */
static int press_everywhere(struct morph *morph, const float *model)
{
    const int count = (int)morph_voxel_count(morph);
    const float *shape = morph->shape;
    int lags = 0;
    struct press_loop loop = {morph, model, shape, &lags};
    threads_for(count, 4096, run_press_loop, &loop);
    return lags;
}

/* A search through voxels where the model is not yet on the shape's side, from those where it is. */
struct search {
    int *queue, count; /* from the model on */
    int *before;       /* of each voxel: the one before it on its way, -1: not found yet */
    bool *leads;       /* of each voxel: it is on the way to where the model lags */
};

/* Appends to the search what is beside a voxel and not yet in it. */
static void search_around(const struct morph *morph, const float *model, int from, struct search *s)
{
    const bool inside = morph->shape[from] < 0.0f;
    size_t around[27];
    for (int k = voxels_around(morph->grid.size, (size_t)from, around) - 1; k >= 0; --k) {
        const size_t next = around[k];
        if (s->before[next] < 0 && (morph->shape[next] < 0.0f) == inside && (model[next] < 0.0f) != inside) {
            s->before[next] = from;
            s->queue[s->count++] = (int)next;
        }
    }
}

/* Searches from all voxels that the model has reached. */
static void search_ways(const struct morph *morph, const float *model, struct search *s)
{
    const int count = (int)morph_voxel_count(morph);
    const float *shape = morph->shape;
    size_t around[27];
    for (int n = 0; n < count; ++n) { s->before[n] = -1; }
    for (int n = 0; n < count; ++n) {
        if ((shape[n] < 0.0f) == (model[n] < 0.0f)) { continue; }
        for (int k = voxels_around(morph->grid.size, (size_t)n, around) - 1; k >= 0 && s->before[n] < 0; --k) {
            const size_t next = around[k];
            if ((shape[next] < 0.0f) != (shape[n] < 0.0f) || (model[next] < 0.0f) != (shape[n] < 0.0f)) { continue; }
            s->before[n] = (int)next;
            s->queue[s->count++] = n;
        }
    }
    for (int done = 0; done < s->count; ++done) { search_around(morph, model, s->queue[done], s); }
}

/* Sets the full pace at a voxel and at those around it of its side, and adds the direction that leads there. */
static void lead_to(struct morph *morph, int voxel, int before)
{
    const int *size = morph->grid.size, direction[3] = {voxel % size[0] - before % size[0],
                                                        voxel / size[0] % size[1] - before / size[0] % size[1],
                                                        voxel / (size[0] * size[1]) - before / (size[0] * size[1])};
    const bool inside = morph->shape[voxel] < 0.0f;
    const float pace = morph->settings.pace;
    size_t around[27];
    for (int k = voxels_around(size, (size_t)voxel, around) - 1; k >= 0; --k) {
        if ((morph->shape[around[k]] < 0.0f) == inside) { morph->pressure[around[k]] = inside ? pace : -pace; }
        for (int i = 0; i < 3; ++i) { morph->way[3 * around[k] + (size_t)i] += (float)direction[i]; }
    }
}

/* Leads springls along the ways to all voxels where the model lags, and to those beside them. */
static void lead_along(struct morph *morph, const float *model, struct search *s)
{
    const float *shape = morph->shape;
    size_t around[27];
    for (int i = 0; i < s->count; ++i) {
        const int n = s->queue[i];
        if (!lags_inside(shape[n], model[n]) && !lags_outside(shape[n], model[n])) { continue; }
        for (int k = voxels_around(morph->grid.size, (size_t)n, around) - 1; k >= 0; --k) { s->leads[around[k]] = true; }
    }
    for (int i = s->count - 1; i >= 0; --i) {
        const int n = s->queue[i];
        if (s->leads[n]) {
            s->leads[s->before[n]] = true;
            lead_to(morph, n, s->before[n]);
        }
    }
}

/* Sets the full pace and the velocity where the model lags and on the way there. Returns false if memory is short. */
static bool lead_where_it_lags(struct morph *morph, const float *model)
{
    const size_t count = morph_voxel_count(morph);
    const float speed = LEAD * morph->settings.pace;
    struct search s = {malloc(count * sizeof *s.queue), 0, malloc(count * sizeof *s.before), calloc(count, sizeof *s.leads)};
    const bool good = s.queue && s.before && s.leads;
    if (good) {
        memset(morph->way, 0, 3 * count * sizeof *morph->way);
        search_ways(morph, model, &s);
        lead_along(morph, model, &s);
    }
    for (size_t n = 0; good && n < count; ++n) {
        float *way = morph->way + 3 * n;
        const float length = vec3_length(way);
        for (int i = 0; length > 0.0f && i < 3; ++i) { way[i] *= speed / length; }
    }
    free(s.queue);
    free(s.before);
    free(s.leads);
    return good;
}

/* Returns how many voxels may lag until the next frame. */
static int few_voxels(const struct morph *morph)
{
    const int grid = morph->settings.common.grid;
    return grid * grid / FEW;
}

/* Completes `iterations`, of which the step of skinning was the first, and goes on while the model lags in more than few voxels and
 * each step leaves less than two thirds of them: limbs have to grow, or crevices to deepen; where they are thinner than a voxel that
 * never ends. The last frame is to be the target: there steps go on until none lags, or PATIENCE in a row have gained nothing. */
static bool approach_shape(struct morph *morph, float *model, bool last)
{
    const int most = last ? LAST_STEPS : STEPS, patience = last ? PATIENCE : 1, few = last ? 0 : few_voxels(morph);
    const float enough = last ? 1.0f : 2.0f / 3.0f;
    bool good = true;
    for (int step = 1, before = INT_MAX, vain = 0; good && (step < most || step < morph->settings.iterations); ++step) {
        good = morph_check(morph->ctx, springls_copy_level_set(morph->ctx, model), "level set");
        const int lags = good ? press_everywhere(morph, model) : 0;
        vain = (float)lags < enough * (float)before ? 0 : vain + 1;
        before = lags;
        if (step >= morph->settings.iterations && (lags <= few || vain >= patience)) { break; }
        good = good && (lags == 0 || lead_where_it_lags(morph, model) || morph_no_memory())
            && contour_step(morph, lags > 0 ? morph->way : NULL);
    }
    return good;
}

/* ---- one piece ---- */

/* Finds whether the model's surface is not that of one body without hollows and handles; sets `model` to its level set. solid_is_whole
 * takes outside voxels that hang on the rest by an edge for a hollow, which they are not: then the components of the mesh decide. */
static bool is_damaged(struct morph *morph, float *model, bool *damaged)
{
    const struct solid_grid voxels = morph_voxels(&morph->grid);
    springls_measures measures = {0};
    bool whole = true;
    const bool good = morph_check(morph->ctx, springls_copy_level_set(morph->ctx, model), "level set")
        && (solid_is_whole(&voxels, model, &whole) || morph_no_memory())
        && (whole || morph_check(morph->ctx, springls_measure(morph->ctx, &measures), "components"));
    *damaged = good && (measures.components > 1 || solid_euler(&voxels, model) < 1);
    return good;
}

/* Sets the pressure to a voxel a step where the model's side is to change, and beside, elsewhere to 0. */
static void press_changes(struct morph *morph, const float *model, const float *repaired)
{
    const size_t count = morph_voxel_count(morph);
    float *pressure = morph->pressure;
    size_t around[27];
    memset(pressure, 0, count * sizeof *pressure);
    for (size_t n = 0; n < count; ++n) {
        if ((model[n] < 0.0f) == (repaired[n] < 0.0f)) { continue; }
        pressure[n] = repaired[n] < 0.0f ? 1.0f : -1.0f; /* also at the grid's border, where none is around: a drop there is pushed out */
        for (int k = voxels_around(morph->grid.size, n, around) - 1; k >= 0; --k) {
            if (repaired[n] < 0.0f) {
                pressure[around[k]] = 1.0f;
            } else if (repaired[around[k]] >= 0.0f) { /* not the rest of the body beside a drop */
                pressure[around[k]] = -1.0f;
            }
        }
    }
}

/* Repairs a copy of the model: joins parts, fills hollows and cuts handles. What is outside the shape is given up. */
static bool repair_copy(const struct morph *morph, const float *model, float *repaired)
{
    const struct solid_grid voxels = morph_voxels(&morph->grid);
    const size_t count = morph_voxel_count(morph);
    struct solid_repair repair;
    struct solid_handles handles;
    for (size_t n = 0; n < count; ++n) { repaired[n] = morph->shape[n] > OUTSIDE ? fmaxf(model[n], BARELY) : model[n]; }
    return (solid_repair(&voxels, repaired, morph->limbs, morph->settings.reach, false, &repair)
            && solid_cut_handles(&voxels, repaired, morph->limbs, 0, &handles))
        || morph_no_memory();
}

/* Makes the model one body without hollows and handles, as far as some steps of an active contour can. */
static bool make_whole(struct morph *morph, float *model)
{
    float *repaired = NULL;
    bool damaged, good = is_damaged(morph, model, &damaged);
    if (good && damaged) {
        repaired = malloc(morph_voxel_count(morph) * sizeof *repaired);
        good = repaired || morph_no_memory();
    }
    for (int step = 0; good && damaged && step < MEND; ++step) {
        good = repair_copy(morph, model, repaired);
        if (good) {
            press_changes(morph, model, repaired);
            good = contour_step(morph, NULL) && is_damaged(morph, model, &damaged);
        }
    }
    free(repaired);
    return good;
}

bool morph_contour(struct morph *morph, bool last)
{
    float *model = malloc(morph_voxel_count(morph) * sizeof *model);
    const bool good = (model || morph_no_memory()) && approach_shape(morph, model, last)
        && (morph->settings.preserve || make_whole(morph, model));
    free(model);
    return good;
}
