/* contour.c - active contours push the model to the shape of a frame (run.c), and keep it in one piece.
 *
 * The pressure is minus the shape's signed distance, at most `pace`. In a crevice or at the tip of a thin limb that is little, so
 * where the model lags behind, and on the way there, the pressure is the full pace. What is thinner than a voxel tears, and where
 * bodies part drops stay.
 * The shape is one body without hollows, but a contour only moves surfaces: it joins nothing. So where the model is in parts its
 * level set is repaired as that of a character is (solid_voxels.h), and where the repair has changed its side the contour moves the
 * model there: drops and hollows shrink until they vanish, and a larger part grows along the shortest bridge until it meets the
 * rest.
 *
 * A step is the paper's eq. 1 with the pressure rho alone. */
#include "morph/morph.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LAG 1.0f     /* voxel: a model further than this from a voxel of the shape's other side lags... */
#define SURE 0.1f    /* ...if that lies this deep inside or outside the shape */
#define OUTSIDE 0.5f /* voxel: parts of the model that are this far outside the shape are not joined to the rest, but given up */
#define BARELY 1e-3f /* voxel: phi of what is given up, just outside */

enum { STEPS = 10, LAST_STEPS = 30 }; /* towards the shape of a frame, and of the last one, at most */
enum { PATIENCE = 4 };                /* the last frame's steps in a row by which nothing is gained */
enum { MEND = 30 };                   /* steps that mend parts, at most: a voxel each */

static bool contour_step(struct morph *morph)
{
    springls_forces forces;
    springls_step_desc step;
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    forces.pressure_grid.data = morph->pressure;
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

/* Return true when a voxel is inside the shape, or outside, and the model's surface still far from it. */
static bool lags_inside(float shape, float model) { return shape < -SURE && model > LAG; }
static bool lags_outside(float shape, float model) { return shape > SURE && model < -LAG; }

/* Sets the pressure of all voxels; counts those where the model lags. */
static int press_everywhere(struct morph *morph, const float *model)
{
    const int count = (int)morph_voxel_count(morph);
    const float pace = morph->settings.pace, *shape = morph->shape;
    int lags = 0;
#if defined(_OPENMP)
    #pragma omp parallel for reduction(+ : lags)
#endif
    for (int n = 0; n < count; ++n) {
        morph->pressure[n] = shape[n] > pace ? -pace : shape[n] < -pace ? pace : -shape[n];
        lags += lags_inside(shape[n], model[n]) || lags_outside(shape[n], model[n]);
    }
    return lags;
}

/* Sets the full pace where the model lags and on the way there: through voxels of the shape's side that the model has not
 * reached. Returns false if memory is short. */
static bool press_where_it_lags(struct morph *morph, const float *model)
{
    const int count = (int)morph_voxel_count(morph);
    const float pace = morph->settings.pace, *shape = morph->shape;
    unsigned char *found = calloc((size_t)count, 1);
    int *queue = malloc((size_t)count * sizeof *queue), end = 0;
    for (int n = 0; found && queue && n < count; ++n) {
        found[n] = lags_inside(shape[n], model[n]) || lags_outside(shape[n], model[n]);
        if (found[n]) { queue[end++] = n; }
    }
    for (int done = 0; done < end; ++done) {
        const bool grow = shape[queue[done]] < 0.0f;
        size_t around[27];
        for (int k = voxels_around(morph->grid.size, (size_t)queue[done], around) - 1; k >= 0; --k) {
            const size_t next = around[k];
            if ((shape[next] < 0.0f) != grow) { continue; }
            morph->pressure[next] = grow ? pace : -pace;
            if (!found[next] && (model[next] < 0.0f) != grow) {
                found[next] = 1;
                queue[end++] = (int)next;
            }
        }
    }
    const bool good = found && queue;
    free(found);
    free(queue);
    return good;
}

/* Steps `iterations` times, and more for as long as the model lags in fewer voxels than a step before: limbs have to grow, or
 * crevices to deepen. Those that are thinner than a voxel never end. The last frame is to be the target: there steps go on
 * until some in a row have gained nothing. */
static bool approach_shape(struct morph *morph, float *model, bool last)
{
    const int most = last ? LAST_STEPS : STEPS, patience = last ? PATIENCE : 1;
    bool good = true;
    for (int step = 0, before = 0, vain = 0; good && (step < most || step < morph->settings.iterations); ++step) {
        good = morph_check(morph->ctx, springls_copy_level_set(morph->ctx, model), "level set");
        const int lags = good ? press_everywhere(morph, model) : 0;
        vain = lags < before ? 0 : vain + 1;
        before = lags;
        if (step >= morph->settings.iterations && (lags == 0 || vain >= patience)) { break; }
        good = good && (lags == 0 || press_where_it_lags(morph, model) || morph_no_memory()) && contour_step(morph);
    }
    return good;
}

/* ---- one piece ---- */

/* Finds whether the model's surface is not that of one body without hollows; sets `model` to its level set. Voxels that touch at
 * edges only may be connected or not: then the components of the mesh decide. */
static bool is_in_parts(struct morph *morph, float *model, bool *parts)
{
    const struct solid_grid voxels = morph_voxels(&morph->grid);
    springls_measures measures;
    bool whole = true;
    const bool good = morph_check(morph->ctx, springls_copy_level_set(morph->ctx, model), "level set")
        && (solid_is_whole(&voxels, model, &whole) || morph_no_memory())
        && (whole || morph_check(morph->ctx, springls_measure(morph->ctx, &measures), "components"));
    *parts = good && !whole && measures.components > 1;
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
        for (int k = voxels_around(morph->grid.size, n, around) - 1; k >= 0; --k) {
            if (repaired[n] < 0.0f) {
                pressure[around[k]] = 1.0f;
            } else if (repaired[around[k]] >= 0.0f) { /* not the rest of the body beside a drop */
                pressure[around[k]] = -1.0f;
            }
        }
    }
}

/* Joins parts, as far as some steps of an active contour can. */
static bool make_whole(struct morph *morph, float *model)
{
    const struct solid_grid voxels = morph_voxels(&morph->grid);
    const size_t count = morph_voxel_count(morph);
    float *repaired = NULL;
    struct solid_repair repair;
    bool parts, good = is_in_parts(morph, model, &parts);
    if (good && parts) {
        repaired = malloc(count * sizeof *repaired);
        good = repaired || morph_no_memory();
    }
    for (int step = 0; good && parts && step < MEND; ++step) {
        for (size_t n = 0; n < count; ++n) { repaired[n] = morph->shape[n] > OUTSIDE ? fmaxf(model[n], BARELY) : model[n]; }
        good = solid_repair(&voxels, repaired, morph->settings.reach, &repair) || morph_no_memory();
        if (good) {
            press_changes(morph, model, repaired);
            good = contour_step(morph) && is_in_parts(morph, model, &parts);
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
