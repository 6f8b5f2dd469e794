/* measure.c - how well the fields bring the two images together, and the labels and landmarks that are given. */
#include "register/run.h"

#include "base/vec3.h"
#include "imaging/overlap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double unrelated = 0.06;   /* share of the variance that goes together, below which two images have nothing in common */
static const double most_folded = 1e-4, most_extreme = 0.02; /* share of the voxels */
static const double tolerated = 0.01; /* loss of correlation that local similarity or another scale may bring */

/* Measures mean and maximum of the inverse's error over the fixed image's voxels that stay inside both images; a root mean
 * square would not show where the inverse fails. */
static void compare_inverse(struct run *run)
{
    const struct volume *grid = &run->fixed;
    size_t number = 0;
    double sum = 0.0;
    for (size_t n = 0; n < volume_voxels(grid); ++n) {
        int place[3];
        float x[3], there[3], at[3], back[3];
        bool inside = true;
        volume_place(grid->dims, n, place);
        const float index[3] = {(float)place[0], (float)place[1], (float)place[2]};
        volume_index_to_world(grid, index, x);
        vec3_add_scaled(x, 1.0f, run->forward.mm + 3 * n, there);
        volume_world_to_index(&run->moving, there, at);
        for (int a = 0; a < 3; ++a) {
            inside = inside && at[a] >= 0.0f && at[a] <= (float)(run->moving.dims[a] - 1);
        }
        if (inside) {
            field_map(&run->inverse, there, back);
            vec3_sub(back, x, back);
            const double error = (double)vec3_length(back);
            sum += error;
            run->inverse_error.max = fmax(run->inverse_error.max, error);
            ++number;
        }
    }
    run->inverse_error.mean = number > 0 ? sum / (double)number : (double)NAN;
}

void register_on_one_scale(const struct run *run, float *fixed, float *moving)
{
    relation_apply(&run->relation, relation_of_fixed(&run->relation) ? fixed : moving, 1);
}

float register_difference(const struct run *run, float f, struct register_window fixed, float m, struct register_window moving)
{
    if (isnan(f) || isnan(m)) {
        return NAN;
    }
    f = register_normalized(f, fixed);
    m = register_normalized(m, moving);
    register_on_one_scale(run, &f, &m);
    return f - m;
}

float register_normalized(float value, struct register_window window)
{
    return fmaxf(0.0f, fminf(1.0f, (value - window.low) / (window.high - window.low)));
}

/* Values on the fixed image's grid, normalized, over the voxels that the map brings into the moving image, and with_before those that the
 * headers alone bring there too; NaN elsewhere. */
struct compared {
    float *fixed, *before, *after;
};

static void compared_free(struct compared *c)
{
    free(c->fixed);
    free(c->before);
    free(c->after);
}

static bool compared_make(const struct run *run, bool with_before, struct compared *c)
{
    const size_t total = volume_voxels(&run->fixed);
    struct register_window fixed, moving;
    c->fixed = malloc(total * sizeof *c->fixed);
    c->before = malloc(total * sizeof *c->before);
    c->after = malloc(total * sizeof *c->after);
    if (!c->fixed || !c->before || !c->after) {
        compared_free(c);
        return register_no_memory();
    }
    register_windows(run, &fixed, &moving);
    for (size_t n = 0; n < total; ++n) {
        const bool known = isfinite(run->fixed.data[n]) && isfinite(run->warped[n]) && (!with_before || isfinite(run->unmoved[n]));
        c->fixed[n] = known ? register_normalized(run->fixed.data[n], fixed) : NAN;
        c->before[n] = known ? register_normalized(run->unmoved[n], moving) : NAN;
        c->after[n] = known ? register_normalized(run->warped[n], moving) : NAN;
    }
    return true;
}

/* Measures how far the images agree over the voxels of a comparison; NaN where they are few. */
static void measure_agreement(const struct run *run, const float *fixed, const float *moved, double *correlation, double *information)
{
    const size_t total = volume_voxels(&run->fixed);
    size_t common = 0;
    *correlation = relation_correlation(fixed, moved, total, &common);
    *information = relation_mutual_information(fixed, moved, total);
    if ((double)common < register_min_voxels(&run->fixed, &run->moving)) {
        *correlation = *information = (double)NAN;
    }
}

/* Compares before and after over the same voxels; where those are few, after alone over its own: before is NaN then. */
static bool compare_images(struct run *run)
{
    const size_t total = volume_voxels(&run->fixed);
    struct compared c;
    if (!compared_make(run, true, &c)) {
        return false;
    }
    measure_agreement(run, c.fixed, c.before, &run->correlation_before, &run->information_before);
    if (isnan(run->correlation_before)) {
        compared_free(&c);
        if (!compared_make(run, false, &c)) {
            return false;
        }
    }
    measure_agreement(run, c.fixed, c.after, &run->correlation_after, &run->information_after);
    if (run->registration.relation.kind != RELATION_SAME || run->field_path) {
        relation_choose(c.fixed, c.after, total, &run->relation);
    }
    compared_free(&c);
    return true;
}

/* Computes the range of the Jacobian and the share of the voxels where the volume changes beyond belief. */
static void measure_jacobian(struct run *run)
{
    const size_t total = volume_voxels(&run->fixed);
    const float most = 10.0f;
    size_t count = 0;
    run->min_jacobian = field_jacobian(&run->forward, run->jacobian, &run->folded);
    run->max_jacobian = -INFINITY;
    for (size_t n = 0; n < total; ++n) {
        run->max_jacobian = fmaxf(run->max_jacobian, run->jacobian[n]);
        count += !(run->jacobian[n] * most > 1.0f && run->jacobian[n] < most);
    }
    run->extreme = (double)count / (double)total;
}

/* Returns the share of the fixed image's voxels that are mapped into the moving one, of those that have to be. */
static double overlap_after(const struct run *run)
{
    size_t inside = 0;
    relation_correlation(run->fixed.data, run->warped, volume_voxels(&run->fixed), &inside);
    return (double)inside / register_min_voxels(&run->fixed, &run->moving);
}

/* Returns the root mean square difference where the moving image is defined; elsewhere `moved` is NaN. */
static double rms(const struct run *run, const float *moved, struct register_window fixed, struct register_window moving)
{
    const size_t total = volume_voxels(&run->fixed);
    double sum = 0.0, number = 0.0;
    for (size_t n = 0; n < total; ++n) {
        const double d = (double)register_difference(run, run->fixed.data[n], fixed, moved[n], moving);
        if (!isnan(d)) {
            sum += d * d;
            number += 1.0;
        }
    }
    return number > 0.0 ? sqrt(sum / number) : (double)NAN;
}

static bool compare_labels(struct run *run)
{
    struct volume fixed, moving;
    struct field still;
    if (!register_read_labels(run, false, run->fixed_labels_path, &fixed)) {
        return false;
    }
    if (!register_read_labels(run, true, run->moving_labels_path, &moving)) {
        volume_free(&fixed);
        return false;
    }
    float *moved = malloc(volume_voxels(&run->fixed) * sizeof *moved);
    bool good = true;
    if (!register_mark_label(run, &fixed) || !register_mark_label(run, &moving)) {
        good = false;
    } else if (!moved || !field_create(&run->fixed, &still)) {
        good = register_no_memory();
    } else {
        field_warp_labels(&still, &moving, moved);
        run->dice_before = overlap_labels(fixed.data, moved, volume_voxels(&fixed), 1.0f).dice;
        field_warp_labels(&run->forward, &moving, moved);
        run->dice_after = overlap_labels(fixed.data, moved, volume_voxels(&fixed), 1.0f).dice;
        run->has_labels = true;
        field_free(&still);
    }
    volume_free(&fixed);
    volume_free(&moving);
    free(moved);
    return good;
}

static bool compare_points(struct run *run)
{
    float *fixed, *moving;
    size_t count;
    if (!register_read_landmarks(run, &fixed, &moving, &count)) {
        return false;
    }
    for (size_t n = 0; n < count; ++n) {
        float mapped[3], before[3], after[3];
        field_map(&run->forward, fixed + 3 * n, mapped);
        vec3_sub(fixed + 3 * n, moving + 3 * n, before);
        vec3_sub(mapped, moving + 3 * n, after);
        run->points_before.mean += (double)vec3_length(before) / (double)count;
        run->points_before.max = fmax(run->points_before.max, (double)vec3_length(before));
        run->points_after.mean += (double)vec3_length(after) / (double)count;
        run->points_after.max = fmax(run->points_after.max, (double)vec3_length(after));
    }
    run->has_points = true;
    run->point_count = count;
    free(fixed);
    free(moving);
    return true;
}

/* Chooses the windows as the registration does: a common one if both images have one scale. */
void register_windows(const struct run *run, struct register_window *fixed, struct register_window *moving)
{
    *fixed = *moving = (struct register_window){0.0f, 1.0f};
    register_window_of(&run->fixed, fixed);
    register_window_of(&run->moving, moving);
    if ((run->registration.relation.kind == RELATION_SAME)) {
        moving->low = fixed->low = fminf(fixed->low, moving->low);
        moving->high = fixed->high = fmaxf(fixed->high, moving->high);
    }
}

bool register_measure(struct run *run)
{
    struct register_window fixed, moving;
    struct field still;
    const size_t total = volume_voxels(&run->fixed);
    run->unmoved = malloc(total * sizeof *run->unmoved);
    run->warped = malloc(total * sizeof *run->warped);
    run->jacobian = malloc(total * sizeof *run->jacobian);
    if (!run->unmoved || !run->warped || !run->jacobian || !field_create(&run->fixed, &still)) {
        return register_no_memory();
    }
    field_warp(&still, &run->moving, NAN, run->unmoved);
    field_warp(&run->forward, &run->moving, NAN, run->warped);
    field_free(&still);
    if (!compare_images(run)) {
        return false;
    }
    measure_jacobian(run);
    register_windows(run, &fixed, &moving);
    if (overlap_after(run) < 1.0) {
        return register_fail("the map takes most of the fixed image out of the moving one");
    }
    run->rms_before = rms(run, run->unmoved, fixed, moving);
    run->rms_after = rms(run, run->warped, fixed, moving);
    for (size_t n = 0; n < total; ++n) {
        run->fixed.data[n] = isnan(run->fixed.data[n]) ? run->fixed.minimum : run->fixed.data[n];
        run->unmoved[n] = isnan(run->unmoved[n]) ? run->moving.minimum : run->unmoved[n];
        run->warped[n] = isnan(run->warped[n]) ? run->moving.minimum : run->warped[n];
    }
    compare_inverse(run);
    return (!run->fixed_labels_path || compare_labels(run)) && (!run->fixed_points_path || compare_points(run));
}

static bool is_mirrored(const struct run *run)
{
    static const char *const axes[] = {"left-right", "front-back", "head-foot"};
    const struct registration *reg = &run->registration;
    if (reg->mirrored == 0) {
        return false;
    }
    register_fail("the moving image looks mirrored: with its %s axis reversed it fits better (%.3f, %.3f as it is)",
                  axes[reg->mirrored - 1], reg->in_mirror, reg->as_it_is);
    return true;
}

/* Returns true if the images fit less than before: on one scale by correlation, else by mutual information. */
static bool is_worse(const struct run *run)
{
    const struct relation *relation = &run->relation;
    const bool alike = relation->kind == RELATION_SAME || (relation->kind == RELATION_LINE && relation->gain > 0.0f);
    if (alike && run->registration.similarity == REGISTER_SSD) {
        return run->correlation_after < run->correlation_before - tolerated
               && !register_fail("the result fits less than the start: correlation %.3f, before %.3f", run->correlation_after,
                                 run->correlation_before);
    }
    if (run->information_after < (1.0 - tolerated) * run->information_before) {
        register_fail("the result fits less than the start: mutual information %.3f bits, before %.3f (correlation %.3f, before %.3f)",
                      run->information_after, run->information_before, run->correlation_after, run->correlation_before);
        return true;
    }
    return false;
}

bool register_is_trusted(const struct run *run)
{
    const size_t total = volume_voxels(&run->fixed);
    const double explained = run->relation.kind == RELATION_SAME ? run->correlation_after * run->correlation_after
                                                                 : run->relation.explained;
    if (is_mirrored(run) || is_worse(run)) {
        return false;
    }
    if (!run->field_path && isnan(run->correlation_after)) {
        return register_fail("the result is not to be trusted: it brings too few voxels into the moving image to compare the two");
    }
    if (!run->field_path && explained < unrelated) {
        return register_fail("the result is not to be trusted: the images have hardly anything in common (correlation %.3f, mutual "
                             "information %.3f bits)", run->correlation_after, run->information_after);
    }
    if (!run->field_path && ((double)run->folded > most_folded * (double)total || run->extreme > most_extreme)) {
        return register_fail("the result is not to be trusted: the volume changes by factors of %.3g to %.3g, beyond 1/10 to 10 in %.1f "
                             "%% of the image", (double)run->min_jacobian, (double)run->max_jacobian, 100.0 * run->extreme);
    }
    return true;
}
