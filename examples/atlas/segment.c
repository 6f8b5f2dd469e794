/* segment.c - finds an atlas's object in an image (paper, section 5.6, Figs. 17 and 18).
 *
 * start    the mean shape, placed by a coarse search
 *
 * With an atlas that has its subjects' images (fusion.h):
 * registration  the atlas's vertices, brought from its templates
 * fusion        where the subjects' votes say so
 * springls      the registered shape becomes springls, which the fused probability moves
 *
 * Else, or with --fit profiles:
 * pose     rotation, translation and scale refined
 * modes    the weights of the first modes refined
 * springls the shape becomes springls: gradient vector flow and intensity pressure move them, within a leash around the shape;
 *          each springl's correspondence is its place on the atlas, which gives the result the atlas's regions */
#include "atlas/atlas.h"

#include "base/bvh.h"
#include "base/progress.h"
#include "base/threads.h"
#include "base/vec3.h"
#include "imaging/gvf.h"
#include "imaging/segment_image.h"
#include "springls/run_options.h"
#include "springls/segment_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_CELLS = 128, LOOK_EVERY = 5, MAX_RESAMPLINGS = 12 };

static const float gvf_mu = 0.2f; /* for clean images, by Xu and Prince */
static const float speed = 0.5f, rest_share = 0.02f, rest_speed = 0.05f; /* the same as in `segment` */

/* ---- forces ---- */

/* The forces on the springls, sampled on cubes around the shape. */
struct push {
    struct volume pressure; /* -1 .. 1, outward positive */
    struct gvf flow;
    float gvf_weight;
};

/* Returns the side of the cubes: a voxel of the image, or larger so that at most MAX_CELLS lie along the shape's longest side.
 * Half a voxel for fused probabilities: they are sampled between voxels, and linear interpolation on cubes of a whole voxel
 * would once more take volume from what is convex. */
static float choose_side(const struct atlas_segment *run, float longest)
{
    const float *spacing = run->image.spacing, voxel = cbrtf(spacing[0] * spacing[1] * spacing[2]);
    return fmaxf(run->fused ? 0.5f * voxel : voxel, longest / (float)MAX_CELLS);
}

static void mesh_box(const struct shape_mesh *mesh, float lo[3], float hi[3])
{
    for (int a = 0; a < 3; ++a) {
        lo[a] = INFINITY;
        hi[a] = -INFINITY;
    }
    for (int i = 0; i < 3 * mesh->vertex_count; ++i) {
        lo[i % 3] = fminf(lo[i % 3], mesh->positions[i]);
        hi[i % 3] = fmaxf(hi[i % 3], mesh->positions[i]);
    }
}

/* Makes cubes around the shape. */
static bool create_cubes(const struct atlas_segment *run, float leash, struct volume *cubes)
{
    float lo[3], hi[3];
    int dims[3];
    mesh_box(&run->stages[run->begin], lo, hi);
    const float longest = fmaxf(hi[0] - lo[0], fmaxf(hi[1] - lo[1], hi[2] - lo[2]));
    const float side = choose_side(run, longest), margin = leash + 4.0f * side;
    const float sides[3] = {side, side, side};
    for (int a = 0; a < 3; ++a) {
        lo[a] -= margin;
        dims[a] = (int)ceilf((hi[a] + margin - lo[a]) / side) + 1;
        dims[a] = dims[a] < 8 ? 8 : dims[a];
    }
    return volume_create(dims, sides, lo, cubes) || atlas_no_memory();
}

/* Returns the pressure at a place, which intensity decides within the leash; q is the distance from the shape in leashes. */
static float pressure_at(const struct atlas_segment *run, const struct target *shape, const float place[3], float leash)
{
    const struct similarity identity = similarity_identity();
    struct target_hit hit;
    target_nearest(shape, &identity, place, &hit);
    const float q = fmaxf(-1.0f, fminf(1.0f, hit.signed_distance / leash));
    const float inside = atlas_inside(&run->view, (int)hit.vertex, atlas_intensity(&run->image, place));
    return inside * (1.0f - q * q) - q * fabsf(q);
}

static void push_free(struct push *field)
{
    volume_free(&field->pressure);
    gvf_free(&field->flow);
}

/* Returns the leash in mm: twice what the modes cannot represent, but at least a part of the shape's size. Fused probabilities
 * need no leash, only cubes that are large enough. */
static double choose_leash(const struct atlas_segment *run, double radius)
{
    return fmax(2.0 * run->placing.pose.scale * run->atlas.generalization, (run->fused ? 0.25 : 0.05) * radius);
}

/* Returns the fused probability as a pressure: full from a quarter above or below the level. */
static float fused_pressure(const struct atlas_segment *run, const float place[3])
{
    return fmaxf(-1.0f, fminf(1.0f, 4.0f * atlas_fused_at(run, place)));
}

struct push_loop {
    const struct atlas_segment *run;
    const struct target *shape;
    float leash;
    const struct volume *cubes;
};

static void run_push_loop(void *arg, int begin, int end)
{
    const struct push_loop *loop = arg;
    const struct atlas_segment *run = loop->run;
    const struct target *shape = loop->shape;
    const float leash = loop->leash;
    const struct volume *cubes = loop->cubes;
    for (int k = begin; k < end; ++k) {
        float *out = cubes->data + (size_t)k * (size_t)cubes->dims[0] * (size_t)cubes->dims[1];
        for (int j = 0; j < cubes->dims[1]; ++j) {
            for (int i = 0; i < cubes->dims[0]; ++i) {
                const float index[3] = {(float)i, (float)j, (float)k};
                float place[3];
                volume_index_to_world(cubes, index, place);
                *out++ = run->fused ? fused_pressure(run, place) : pressure_at(run, shape, place, leash);
            }
        }
    }
}

static bool push_create(const struct atlas_segment *run, struct push *field)
{
    const struct shape_mesh *mesh = &run->stages[run->begin];
    const size_t vertices = (size_t)mesh->vertex_count;
    struct target shape;
    memset(field, 0, sizeof *field);
    if (!target_create(mesh->positions, vertices, mesh->triangles, (size_t)mesh->triangle_count, &shape)) {
        return atlas_no_memory();
    }
    const float leash = (float)(run->settings.leash > 0.0 ? run->settings.leash : choose_leash(run, shape.radius));
    bool good = create_cubes(run, leash, &field->pressure);
    const struct volume *cubes = &field->pressure;
    struct push_loop loop = {run, &shape, leash, cubes};
    threads_for((good ? cubes->dims[2] : 0), 1, run_push_loop, &loop);
    field->gvf_weight = run->fused ? 0.0f : (float)run->settings.gvf;
    good = good &&
           (field->gvf_weight <= 0.0f || gvf_compute(cubes, 0, gvf_mu, cubes->spacing[0], &field->flow) || atlas_no_memory());
    target_free(&shape);
    return good;
}

/* Takes the flow's component along the normal: the tangential one would carry springls away from their places. */
static void flow_along_normal(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    const struct push *field = user;
    (void)time;
    for (int i = 0; i < count; ++i) { /* model and flow have the same grid */
        float v[3];
        gvf_sample(&field->flow, points + 3 * i, v);
        out[i] = field->gvf_weight * vec3_dot(v, normals + 3 * i);
    }
}

/* ---- springls ---- */

/* Starts springls of about a cube from the fitted shape. */
static bool start_springls(struct atlas_segment *run, const struct push *field)
{
    const struct shape_mesh *mesh = &run->stages[run->begin];
    springls_desc desc;
    memset(&desc, 0, sizeof desc);
    const struct volume *cubes = &field->pressure;
    desc.grid = segment_model_grid(cubes->dims, cubes->spacing, cubes->origin, cubes->direction[0]);
    const springls_params smooth = atlas_smooth_params(&run->params);
    desc.params = &smooth;
    desc.tasks = run_tasks();
    desc.backend = run->backend = run_backend("atlas segment", &run->settings.common);
    if (springls_create(&desc, &run->ctx) != SPRINGLS_OK) {
        return atlas_fail("no model of this size");
    }
    bool good = atlas_check(run->ctx, springls_set_mesh(run->ctx, mesh->positions, mesh->vertex_count, 0, mesh->triangles,
                                                        mesh->triangle_count, NULL), "springls");
    int before = 0;
    for (int i = 0; good && i < MAX_RESAMPLINGS && springls_count(run->ctx) != before; ++i) {
        before = springls_count(run->ctx);
        good = atlas_check(run->ctx, springls_run_stage(run->ctx, SPRINGLS_STAGE_RESAMPLE), "resample");
    }
    return good;
}

static bool run_to_rest(struct atlas_segment *run, struct push *field)
{
    const struct atlas_segment_settings *set = &run->settings;
    springls_forces forces = {.curvature_weight = (float)set->curvature, .integrator = SPRINGLS_INTEGRATOR_EULER, .user = field};
    const springls_step_desc step = {
        .forces = &forces, .mode = SPRINGLS_MODE_FLUID, .dt = speed, .max_displacement = 0.75f, .stop_at_topology = true};
    struct segment_watch watch;
    struct progress bar;
    float moving = 1.0f;
    const struct volume *cubes = &field->pressure;
    forces.voxel_units = true;
    forces.pressure_grid.data = cubes->data;
    forces.pressure_grid.grid = segment_model_grid(cubes->dims, cubes->spacing, cubes->origin, cubes->direction[0]);
    if (field->flow.field) {
        forces.pressure = flow_along_normal;
    }
    memset(&watch, 0, sizeof watch);
    progress_begin(&bar, "springls", (size_t)set->steps, !cli_may_print(&set->common));
    bool good = segment_watch_look(&watch, run->ctx, 0.0f, &moving) || atlas_no_memory();
    for (int s = 1; good && s <= set->steps && !run->at_rest; ++s) {
        good = atlas_check(run->ctx, springls_step(run->ctx, &step), "step");
        run->steps = s;
        if (good && s % LOOK_EVERY == 0) {
            good = segment_watch_look(&watch, run->ctx, rest_speed * speed * LOOK_EVERY, &moving) || atlas_no_memory();
            run->at_rest = moving < rest_share;
        }
        progress_update(&bar, (size_t)s, NULL);
    }
    progress_end(&bar);
    segment_watch_free(&watch);
    return good;
}

/* Takes the atlas's vertices from the shape that the springls started from to the surface: to the place whose correspondence is
 * nearest. */
static bool carry_vertices(struct atlas_segment *run, const springls_mesh *surface)
{
    const struct shape_mesh *shape = &run->stages[run->begin];
    struct bvh bvh;
    run->vertices = malloc((3 * (size_t)shape->vertex_count + 1) * sizeof *run->vertices);
    if (!run->vertices || !bvh_build(&bvh, surface->correspondences, (const uint32_t *)(const void *)surface->triangles,
                                     (size_t)surface->triangle_count)) {
        return atlas_no_memory();
    }
    for (int v = 0; v < shape->vertex_count; ++v) {
        float closest[3] = {0.0f, 0.0f, 0.0f}, weight[3];
        uint32_t triangle = 0;
        bvh_distance(&bvh, shape->positions + 3 * v, closest, &triangle);
        const int *corner = surface->triangles + 3 * (size_t)triangle;
        const float *a = surface->correspondences;
        mesh_barycentric(a + 3 * corner[0], a + 3 * corner[1], a + 3 * corner[2], closest, weight);
        for (int k = 0; k < 3; ++k) {
            run->vertices[3 * v + k] = weight[0] * surface->positions[3 * corner[0] + k]
                                     + weight[1] * surface->positions[3 * corner[1] + k]
                                     + weight[2] * surface->positions[3 * corner[2] + k];
        }
    }
    bvh_free(&bvh);
    return true;
}

/* Extracts the springls' surface and the atlas region of each of its vertices. */
static bool take_surface(struct atlas_segment *run)
{
    const struct shape_mesh *shape = &run->stages[run->begin];
    const struct similarity identity = similarity_identity();
    struct target origin;
    springls_mesh surface;
    if (!target_create(shape->positions, (size_t)shape->vertex_count, shape->triangles, (size_t)shape->triangle_count, &origin)) {
        return atlas_no_memory();
    }
    memset(&surface, 0, sizeof surface);
    bool good = atlas_check(run->ctx, springls_extract_mesh(run->ctx, &surface), "surface")
             && (surface.triangle_count > 0 || atlas_fail("the springls vanished"))
             && atlas_mesh_copy(surface.positions, surface.vertex_count, surface.triangles, surface.triangle_count,
                                &run->stages[ATLAS_STAGES - 1]);
    run->regions = good ? calloc((size_t)surface.vertex_count, sizeof *run->regions) : NULL;
    for (int v = 0; run->regions && v < surface.vertex_count; ++v) {
        struct target_hit hit;
        target_nearest(&origin, &identity, surface.correspondences + 3 * v, &hit);
        const uint32_t voted = atlas_voted_label(run, surface.positions + 3 * v);
        run->regions[v] = voted != 0 ? voted : run->atlas.regions[hit.vertex];
    }
    good = good && (run->regions || atlas_no_memory()) && carry_vertices(run, &surface);
    run->springls = springls_count(run->ctx);
    springls_mesh_free(run->ctx, &surface);
    target_free(&origin);
    return good;
}

/* ---- stages ---- */

static bool end_stage(struct atlas_segment *run, int stage, const char *name, double begin)
{
    run->results[stage].name = name;
    run->results[stage].seconds = elapsed_seconds() - begin;
    return true;
}

/* Ends a stage whose result is a shape of the atlas. */
static bool keep_stage(struct atlas_segment *run, int stage, const char *name, double begin)
{
    const struct shape_mesh *mean = &run->atlas.mean;
    return atlas_mesh_copy(run->placing.shape, mean->vertex_count, mean->triangles, mean->triangle_count, &run->stages[stage])
        && end_stage(run, stage, name, begin);
}

/* Fits pose and modes by the intensities along the normals. */
static bool fit_profiles(struct atlas_segment *run, double begin)
{
    run->begin = 2;
    return atlas_place_refine(&run->view, 0, &run->placing) && keep_stage(run, 1, "pose", begin)
        && atlas_place_refine(&run->view, run->settings.modes, &run->placing) && keep_stage(run, 2, "modes", begin);
}

/* Extracts the surface where the fused probability is at its level. */
static bool fused_surface(const struct push *field, struct shape_mesh *mesh)
{
    springls_context *ctx = NULL;
    springls_mesh surface;
    springls_desc desc;
    const springls_params smooth = atlas_smooth_params(NULL);
    memset(&surface, 0, sizeof surface);
    memset(&desc, 0, sizeof desc);
    desc.params = &smooth;
    const struct volume *cubes = &field->pressure;
    desc.grid = segment_model_grid(cubes->dims, cubes->spacing, cubes->origin, cubes->direction[0]);
    desc.tasks = run_tasks();
    bool good = springls_create(&desc, &ctx) == SPRINGLS_OK || atlas_fail("no grid of this size");
    if (good) {
        good = atlas_check(ctx, springls_set_threshold(ctx, cubes->data, 0.0f, 2.0f), "fusion")
            && atlas_check(ctx, springls_extract_mesh(ctx, &surface), "fusion")
            && atlas_mesh_copy(surface.positions, surface.vertex_count, surface.triangles, surface.triangle_count, mesh);
        springls_mesh_free(ctx, &surface);
    }
    springls_destroy(ctx);
    return good;
}

/* Finds where the atlas lies: nearly where it lies on a template, as in images of one protocol, or by a search. */
static bool place(struct atlas_segment *run)
{
    if (run->fused && atlas_lies_near(run)) {
        return true;
    }
    return run->fused && atlas_shows_much_more(run) ? atlas_find(run) : atlas_place_start(&run->view, &run->placing);
}

static bool start(struct atlas_segment *run, double begin) { return place(run) && keep_stage(run, 0, "start", begin); }

/* Registers the image to the templates and lets the atlas's subjects vote. */
static bool fit_subjects(struct atlas_segment *run, double begin)
{
    run->begin = 1;
    return atlas_fuse(run, run->placing.shape) && keep_stage(run, 1, "registration", begin);
}

/* Samples the forces, from which fusion's surface follows too, and runs the springls from the shape that was fitted. */
static bool run_springls(struct atlas_segment *run, double begin)
{
    struct push field;
    const bool good = push_create(run, &field)
                   && (!run->fused || (fused_surface(&field, &run->stages[2]) && end_stage(run, 2, "fusion", begin)))
                   && start_springls(run, &field) && run_to_rest(run, &field) && take_surface(run)
                   && end_stage(run, 3, "springls", begin);
    push_free(&field);
    return good;
}

static void choose_window(struct atlas_segment *run)
{
    const struct atlas_segment_settings *set = &run->settings;
    struct atlas_view *view = &run->view;
    const float level = isnan(set->level) ? segment_otsu(&run->image) : (float)set->level;
    view->image = &run->image;
    view->atlas = &run->atlas;
    view->learned = run->atlas.samples > 0 && isnan(set->level) && !set->windowed;
    view->low = set->windowed ? (float)set->window[0] : set->dark ? -INFINITY : level;
    view->high = set->windowed ? (float)set->window[1] : set->dark ? level : INFINITY;
    const float range = segment_percentile(&run->image, 0.995) - segment_percentile(&run->image, 0.005);
    atlas_contrast(&run->image, &view->mean, &view->deviation);
    view->ramp = set->ramp > 0.0 ? (float)set->ramp : fmaxf(0.1f * range, 1e-6f);
}

/* Marks the reference's voxels inside a surface. */
static bool fill_mask(const struct volume *grid, const springls_params *params, const struct shape_mesh *mesh, uint8_t *mask)
{
    springls_context *ctx = NULL;
    springls_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.grid = segment_model_grid(grid->dims, grid->spacing, grid->origin, grid->direction[0]);
    const springls_params smooth = atlas_smooth_params(params);
    desc.params = &smooth;
    desc.tasks = run_tasks();
    const size_t row = (size_t)grid->dims[0];
    float *points = malloc(3 * row * sizeof *points);
    bool good =
        (points || atlas_no_memory()) && (springls_create(&desc, &ctx) == SPRINGLS_OK || atlas_fail("no grid of this size")) &&
        atlas_check(ctx,
                    springls_set_mesh(ctx, mesh->positions, mesh->vertex_count, 0, mesh->triangles, mesh->triangle_count, NULL),
                    "mask");
    for (int k = 0; good && k < grid->dims[2]; ++k) {
        for (int j = 0; good && j < grid->dims[1]; ++j) {
            for (int i = 0; i < grid->dims[0]; ++i) {
                const float index[3] = {(float)i, (float)j, (float)k};
                volume_index_to_world(grid, index, points + 3 * i);
            }
            good = atlas_check(ctx, springls_sample_inside(ctx, points, grid->dims[0],
                                                           mask + row * ((size_t)j + (size_t)grid->dims[1] * (size_t)k)), "mask");
        }
    }
    springls_destroy(ctx);
    free(points);
    return good;
}

bool atlas_segment_mask(const struct atlas_segment *run, int stage, const struct volume *grid, uint8_t *mask)
{
    return fill_mask(grid, &run->params, &run->stages[stage], mask);
}

/* Reads the reference before the run: what does not fit is refused at once. Its other labels become 0. */
static bool read_reference(struct atlas_segment *run)
{
    const struct atlas_segment_settings *set = &run->settings;
    struct volume *reference = &run->reference;
    char error[VOLUME_TEXT];
    int labels[ATLAS_MAX_LABELS];
    const int count = set->label_text ? atlas_read_labels(set->label_text, labels) : 0;
    if (!volume_read_like(&run->image, "the image", set->reference, set->frame, reference, error)
        || !volume_check_labels(reference, set->reference, error)) {
        return atlas_fail("%s", error);
    }
    volume_print_warning(reference, "atlas", set->reference);
    const size_t voxels = volume_voxels(reference);
    uint8_t *mask = malloc(voxels);
    if (!mask) {
        return atlas_no_memory();
    }
    uint32_t wanted[ATLAS_MAX_LABELS];
    for (int l = 0; l < count; ++l) {
        wanted[l] = (uint32_t)labels[l];
    }
    const bool found = segment_mask(reference, wanted, count, mask) > 0;
    for (size_t n = 0; n < voxels; ++n) {
        reference->data[n] = mask[n];
    }
    free(mask);
    return found || atlas_fail("%.200s: no voxel has the label asked for%s", set->reference, count > 0 ? " (--label)" : "");
}

static bool compare(struct atlas_segment *run)
{
    const struct atlas_segment_settings *set = &run->settings;
    int labels[ATLAS_MAX_LABELS];
    struct volume part;
    const int count = set->label_text ? atlas_read_labels(set->label_text, labels) : 0;
    memset(&part, 0, sizeof part);
    bool good = atlas_label_surface(set->reference, labels, count, set->reference, &part, &run->truth);
    volume_free(&part);
    const size_t voxels = volume_voxels(&run->reference);
    uint8_t *truth = malloc(voxels), *mask = malloc(voxels);
    good = good && ((truth && mask) || atlas_no_memory());
    for (size_t n = 0; good && n < voxels; ++n) {
        truth[n] = run->reference.data[n] > 0.0f;
    }
    const struct surface reference = atlas_surface(&run->truth, NULL);
    for (int s = 0; good && s < ATLAS_STAGES; ++s) {
        struct atlas_stage *result = &run->results[s];
        struct surface_distances distances;
        const struct surface found = atlas_surface(&run->stages[s], NULL);
        good = fill_mask(&run->reference, &run->params, &run->stages[s], mask);
        const struct overlap overlap = overlap_masks(mask, truth, voxels);
        result->dice = overlap.dice;
        result->volume_ratio = (double)overlap.a / (double)overlap.b;
        result->compared = good && surface_distances_measure(&found, &reference, 20000, 1.0, &distances);
        if (result->compared) {
            result->mean_distance = distances.assd;
            result->hd95 = distances.hd95;
        }
    }
    free(truth);
    free(mask);
    return good;
}

/* Refuses an image at a scale at which the atlas's object cannot be found: its longest side is less than half of the object's, a voxel
 * is more than a third of the object's shortest side, or its longest edge more than half of the object's longest. */
static bool sizes_fit(const struct atlas_segment *run)
{
    const struct volume *image = &run->image;
    const float *spacing = image->spacing, voxel = cbrtf(spacing[0] * spacing[1] * spacing[2]);
    float lo[3], hi[3], object[3], shortest = INFINITY, longest = 0.0f, longest_edge = 0.0f, extent = 0.0f;
    mesh_box(&run->atlas.mean, lo, hi);
    for (int a = 0; a < 3; ++a) {
        object[a] = hi[a] - lo[a];
        shortest = fminf(shortest, object[a]);
        longest = fmaxf(longest, object[a]);
        longest_edge = fmaxf(longest_edge, spacing[a]);
        extent = fmaxf(extent, spacing[a] * (float)image->dims[a]);
    }
    const bool too_small = extent < 0.5f * longest, too_coarse = 3.0f * voxel > shortest || longest_edge > 0.5f * longest;
    return (!too_small && !too_coarse)
        || atlas_fail("%.200s: %s for the atlas's object of %.3g x %.3g x %.3g mm, with voxels of %.3g x %.3g x %.3g mm",
                      run->settings.image, too_small ? "too small" : "too coarse", (double)object[0], (double)object[1],
                      (double)object[2], (double)spacing[0], (double)spacing[1], (double)spacing[2]);
}

/* Refuses options without effect on this atlas. */
static bool options_fit(const struct atlas_segment *run)
{
    const struct atlas_segment_settings *set = &run->settings;
    if (run->fused && set->of_profiles) {
        return atlas_fail("%s has no effect where the atlas's subjects vote: see --fit profiles", set->of_profiles);
    }
    return !(run->view.learned && (set->dark || set->ramp > 0.0))
        || atlas_fail("%s has no effect without --level: the atlas has learned intensities", set->dark ? "--dark" : "--ramp");
}

/* Refuses a label map where intensities were learned from scans. */
static bool is_scan(const struct atlas_segment *run)
{
    return !run->view.learned || !volume_is_label_map(&run->image)
        || atlas_fail("%.200s: a scan is wanted, this looks like a label map (--level makes it go on)", run->settings.image);
}

bool atlas_segment_image(struct atlas_segment *run)
{
    const struct atlas_segment_settings *set = &run->settings;
    char error[VOLUME_TEXT];
    volume_choose_series(set->series, "--series");
    const bool read = volume_read_one(set->image, set->frame, "--frame", &run->image, error);
    volume_choose_series(NULL, NULL);
    if (!read) {
        return atlas_fail("%s", error);
    }
    volume_print_warning(&run->image, "atlas", NULL);
    if (!atlas_image_varies(&run->image, set->image) || !sizes_fit(run) || (set->reference && !read_reference(run))) {
        return false;
    }
    choose_window(run);
    run->fused = run->atlas.template_count > 0 && isnan(set->level) && !set->windowed
              && !(set->fit && strcmp(set->fit, "profiles") == 0);
    if (!options_fit(run) || !is_scan(run)) {
        return false;
    }
    const double begin = elapsed_seconds();
    const bool good = start(run, begin) && (run->fused ? fit_subjects(run, begin) : fit_profiles(run, begin))
                   && run_springls(run, begin);
    if (good) {
        atlas_check_size(run);
    }
    run->seconds = elapsed_seconds() - begin;
    return good && (!set->reference || compare(run)) && atlas_measure_parts(run);
}

bool atlas_segment_run(struct atlas_segment *run)
{
    const struct atlas_segment_settings *set = &run->settings;
    return atlas_read(set->atlas, &run->atlas) && (!set->beside || atlas_read_without(set->beside, &run->without))
        && atlas_segment_image(run);
}

void atlas_segment_free(struct atlas_segment *run)
{
    for (int s = 0; s < ATLAS_STAGES; ++s) {
        atlas_mesh_free(&run->stages[s]);
    }
    for (int t = 0; t < FUSION_MAX_TEMPLATES; ++t) {
        registration_free(&run->maps[t].registration);
        free(run->probabilities[t]);
        free(run->shares[t]);
    }
    atlas_mesh_free(&run->truth);
    atlas_free(&run->atlas);
    volume_free(&run->image);
    volume_free(&run->part);
    volume_free(&run->reference);
    springls_destroy(run->ctx);
    springls_cl_destroy(run->backend);
    free(run->placing.shape);
    free(run->regions);
    free(run->vertices);
}
