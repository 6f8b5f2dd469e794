/* output.c - pictures, report and summary of a morph. */
#include "morph/morph.h"

#include "base/json.h"
#include "base/progress.h"
#include "base/threads.h"
#include "base/vec3.h"
#include "morph/apng.h"
#include "pictures/raycast.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STRIP = 6 };

/* ---- pictures ---- */

static bool draw_mesh(const springls_mesh *mesh, const float *positions, const float *colors, int width,
                      int height, const struct raycast_camera *camera, struct image *image)
{
    struct raycast_scene scene;
    memset(&scene, 0, sizeof scene);
    scene.positions = positions;
    scene.vertex_count = (size_t)mesh->vertex_count;
    scene.indices = (const uint32_t *)mesh->triangles;
    scene.triangle_count = (size_t)mesh->triangle_count;
    scene.vertex_colors = colors;
    scene.camera = *camera;
    scene.plain = true;
    return raycast_render(&scene, width, height, image);
}

/* Computes one camera for all frames. */
static struct raycast_camera film_camera(const struct morph *morph, float aspect)
{
    static const float upwards[3] = {0.0f, 1.0f, 0.0f};
    float corners[24];
    for (int k = 0; k < 8; ++k) { /* of the box around all frames */
        for (int i = 0; i < 3; ++i) {
            float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
            for (int f = 0; f < morph->frame_count; ++f) {
                raycast_grow_box(morph->frames[f].mesh.positions, (size_t)morph->frames[f].mesh.vertex_count, lo, hi);
            }
            corners[3 * k + i] = (k >> i) & 1 ? hi[i] : lo[i];
        }
    }
    return raycast_frame_points(corners, 8, morph->settings.view, upwards, 25.0f, aspect);
}

static bool write_strip(const struct morph *morph, const struct image *film, const char *path)
{
    struct image strip, pictures[STRIP];
    const char *captions[STRIP];
    char names[STRIP][32];
    const int count = morph->frame_count < STRIP ? morph->frame_count : STRIP;
    for (int i = 0; i < count; ++i) {
        const int f = count > 1 ? i * (morph->frame_count - 1) / (count - 1) : 0;
        pictures[i] = film[f];
        snprintf(names[i], sizeof names[i], "FRAME %d", f);
        captions[i] = names[i];
    }
    const bool good = image_strip(pictures, captions, count, count, color_rgb(1.0f, 1.0f, 1.0f), &strip)
                      && image_write_png(&strip, path);
    image_free(&strip);
    return good;
}

static bool write_film(const struct morph *morph, const char *out)
{
    const int height = morph->settings.size, width = height * 4 / 5;
    const struct raycast_camera camera = film_camera(morph, (float)width / (float)height);
    struct image *film = calloc((size_t)morph->frame_count, sizeof *film);
    struct progress bar;
    char path[1200] = "", name[48];
    bool good = film != NULL || morph_no_memory();
    progress_begin(&bar, "pictures", (size_t)morph->frame_count, morph->settings.common.quiet);
    for (int f = 0; good && f < morph->frame_count; ++f) {
        const struct morph_frame *frame = &morph->frames[f];
        snprintf(name, sizeof name, "frame%03d.png", f);
        run_path(out, name, path, sizeof path);
        errno = 0; /* not every failure below sets it */
        good = (draw_mesh(&frame->mesh, frame->mesh.positions, frame->colors, width, height, &camera, &film[f])
                && image_write_png(&film[f], path))
            || cli_write_failed("morph", path);
        progress_update(&bar, (size_t)f + 1, NULL);
    }
    progress_end(&bar);
    errno = 0;
    good = good
        && ((apng_write(run_path(out, "morph.png", path, sizeof path), film, morph->frame_count, morph->settings.fps)
             && write_strip(morph, film, run_path(out, "strip.png", path, sizeof path)))
            || cli_write_failed("morph", path));
    for (int f = 0; film && f < morph->frame_count; ++f) {
        image_free(&film[f]);
    }
    free(film);
    return good;
}

bool morph_write(const struct morph *morph)
{
    return morph_write_gltf(morph) && write_film(morph, morph->settings.common.out);
}

/* ---- report ---- */

static void report_body(struct json_writer *json, const char *name, const char *path, const struct morph_body *body)
{
    const struct character *c = &body->character;
    json_object_begin(json, name);
    json_string(json, "file", morph_name(path));
    json_integer(json, "joints", c->joint_count);
    json_integer(json, "parts", c->part_count);
    json_integer(json, "vertices", c->vertex_count);
    json_integer(json, "triangles", c->triangle_count);
    json_integer(json, "vertices_with_weights_not_summing_to_1", c->unnormal);
    json_integer(json, "vertices_without_weights", c->unweighted);
    json_integer(json, "boundary_edges", body->solid.boundary_edges);
    json_integer(json, "nonmanifold_edges", body->solid.nonmanifold_edges);
    json_integer(json, "input_components", body->solid.input_components);
    json_integer(json, "cavity_voxels_filled", body->solid.filled);
    json_integer(json, "sheet_triangles", body->solid.sheet_triangles);
    json_number(json, "sheets_thickened_voxels", (double)body->solid.thickened);
    json_integer(json, "bodies_found", body->solid.found);
    json_integer(json, "bodies_bridged", body->solid.joined);
    json_integer(json, "voxels_left_out", body->solid.dropped_voxels);
    json_integer(json, "thin_voxels_added", body->solid.thin);
    json_integer(json, "tunnel_voxels_closed", body->solid.tunnels);
    json_integer(json, "handle_voxels_cut", body->solid.cut);
    json_integer(json, "components", body->check.components);
    json_integer(json, "handles", morph_handles(&body->check));
    json_object_end(json);
}

struct summary {
    int watertight, intersections, min_components, max_components, specks;
    int with_handles; /* frames with more handles than both bodies have in the neutral pose */
    double limb;      /* the thinnest, as a share of the thinner body's */
    int limb_joint;   /* the joint that moves it, -1: none */
    double weight_error, off_monotone, seconds, skinning, contour, target, steps;
};

/* Returns by how much the volume goes back on its way from the first frame's to the last one's, percent of the larger. */
static double off_monotone(const struct morph *morph)
{
    const struct morph_frame *frames = morph->frames;
    const double first = frames[0].volume, last = frames[morph->frame_count - 1].volume, sign = last < first ? -1.0 : 1.0;
    double most = sign * first, worst = 0.0;
    for (int f = 0; f < morph->frame_count; ++f) {
        worst = fmax(worst, most - sign * frames[f].volume);
        worst = fmax(worst, sign * (frames[f].volume - last));
        most = fmax(most, sign * frames[f].volume);
    }
    return 100.0 * worst / fmax(first, last);
}

static struct summary summarize(const struct morph *morph)
{
    struct summary s;
    memset(&s, 0, sizeof s);
    const int ours = morph_handles(&morph->source.check), theirs = morph_handles(&morph->target.check);
    const int own_handles = ours > theirs ? ours : theirs;
    s.off_monotone = off_monotone(morph);
    for (int f = 0; f < morph->frame_count; ++f) {
        const struct morph_frame *frame = &morph->frames[f];
        s.watertight += frame->check.open_edges == 0;
        s.intersections += frame->check.intersections;
        s.with_handles += morph_handles(&frame->check) > own_handles;
        s.min_components = f == 0 || frame->check.components < s.min_components ? frame->check.components : s.min_components;
        s.max_components = frame->check.components > s.max_components ? frame->check.components : s.max_components;
        if (f == 0 || frame->limb < s.limb) {
            s.limb = frame->limb;
            s.limb_joint = frame->limb_joint;
        }
        s.specks = frame->specks > s.specks ? frame->specks : s.specks;
        s.weight_error = fmax(s.weight_error, frame->weight_error);
        if (f > 0) { /* the first has no active contour */
            s.seconds += frame->seconds / (morph->frame_count - 1);
            s.skinning += frame->seconds_skinning / (morph->frame_count - 1);
            s.contour += frame->seconds_contour / (morph->frame_count - 1);
            s.target += frame->seconds_target / (morph->frame_count - 1);
            s.steps += (double)frame->steps / (morph->frame_count - 1);
        }
    }
    return s;
}

static void report_joints(struct json_writer *json, const struct morph *morph)
{
    const struct character *source = &morph->source.character, *target = &morph->target.character;
    json_string(json, "joints_paired_by", morph->alignment.how);
    json_integer(json, "joints_paired", morph->alignment.pairs);
    json_object_begin(json, "joints");
    for (int j = 0; j < source->joint_count; ++j) {
        if (morph->alignment.map[j] >= 0) {
            json_string(json, source->joints[j].name, target->joints[morph->alignment.map[j]].name);
        }
    }
    json_object_end(json);
}

static void report_settings(struct json_writer *json, const struct morph *morph)
{
    const struct morph_settings *set = &morph->settings;
    json_array_begin(json, "grid");
    for (int k = 0; k < 3; ++k) {
        json_integer(json, NULL, morph->grid.size[k]);
    }
    json_array_end(json);
    json_number(json, "voxel", morph->grid.spacing[0]);
    json_string(json, "params", set->common.params);
    json_string(json, "backend", run_backend_name(morph->backend));
    json_integer(json, "threads", threads_count());
    json_integer(json, "iterations", set->iterations);
    json_number(json, "pace_voxels", (double)set->pace);
    json_integer(json, "blend_frames", set->blend);
    json_integer(json, "reach_voxels", set->reach);
}

/* Reports the figures of all frames together. */
static void report_totals(struct json_writer *json, const struct morph *morph)
{
    const struct summary s = summarize(morph);
    const double voxel = morph->grid.spacing[0];
    json_integer(json, "frames", morph->frame_count);
    json_integer(json, "coincided_in_frame", morph->coincided);
    json_integer(json, "watertight_frames", s.watertight);
    json_integer(json, "self_intersections", s.intersections);
    json_integer(json, "components_fewest", s.min_components);
    json_integer(json, "components_most", s.max_components);
    json_integer(json, "specks_left_out_most", s.specks);
    json_integer(json, "frames_with_more_handles", s.with_handles);
    json_number(json, "thinnest_limb", s.limb);
    json_string(json, "thinnest_limb_at", s.limb_joint >= 0 ? morph->target.character.joints[s.limb_joint].name : "");
    json_number(json, "weight_sum_error_max", s.weight_error);
    json_number(json, "distance_to_target_mean_voxels", morph->end.mean_ab / voxel);
    json_number(json, "distance_from_target_mean_voxels", morph->end.mean_ba / voxel);
    json_number(json, "distance_max_voxels", morph->end.max / voxel);
    json_number(json, "volume_off_monotone_percent", s.off_monotone);
    json_number(json, "weights_from_targets_own_mean_l1", morph->weight_difference);
    if (morph->settings.channel) {
        json_number(json, "channel_weight_sum_error_max", morph->channel_sum_error);
        json_number(json, "channel_weights_from_looked_up_mean_l1", morph->channel_difference);
    }
    json_number(json, "seconds_a_frame", s.seconds);
    json_number(json, "seconds_a_frame_skinning", s.skinning);
    json_number(json, "seconds_a_frame_contour", s.contour);
    json_number(json, "seconds_a_frame_target", s.target);
    json_number(json, "steps_a_frame", s.steps);
    json_number(json, "peak_rss_mib", peak_rss_mib());
}

static void report_frame(struct json_writer *json, const struct morph *morph, const struct morph_frame *frame)
{
    json_object_begin(json, NULL);
    json_integer(json, "springls", frame->springls);
    json_integer(json, "steps", frame->steps);
    json_integer(json, "split", frame->split);
    json_integer(json, "added", frame->added);
    json_integer(json, "removed", frame->removed);
    json_integer(json, "triangles", frame->mesh.triangle_count);
    json_bool(json, "watertight", frame->check.open_edges == 0);
    json_integer(json, "self_intersections", frame->check.intersections);
    json_integer(json, "components", frame->check.components);
    json_integer(json, "specks_left_out", frame->specks);
    json_integer(json, "handles", morph_handles(&frame->check));
    json_number(json, "thinnest_limb", frame->limb);
    json_string(json, "thinnest_limb_at", frame->limb_joint >= 0 ? morph->target.character.joints[frame->limb_joint].name : "");
    json_number(json, "volume_voxels", frame->volume);
    json_number(json, "distance_voxels", frame->distance);
    json_number(json, "distance_worst_voxels", frame->stray);
    json_number(json, "missing_voxels", frame->missing);
    json_number(json, "missing_worst_voxels", frame->worst);
    json_number(json, "share_beyond_a_voxel", frame->far);
    json_number(json, "seconds", frame->seconds);
    json_object_end(json);
}

bool morph_report(const struct morph *morph, const char *path)
{
    struct json_writer json;
    if (!json_open(&json, path)) {
        return cli_write_failed("morph", path);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "problem", "morph");
    report_body(&json, "source", morph->settings.source, &morph->source);
    report_body(&json, "target", morph->settings.target, &morph->target);
    json_string(&json, "animation", morph->target.character.animations[morph->animation].name);
    report_joints(&json, morph);
    report_settings(&json, morph);
    report_totals(&json, morph);
    json_array_begin(&json, "by_frame");
    for (int f = 0; f < morph->frame_count; ++f) {
        report_frame(&json, morph, &morph->frames[f]);
    }
    json_array_end(&json);
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("morph", path);
}

void morph_print(const struct morph *morph)
{
    const struct summary s = summarize(morph);
    const double voxel = morph->grid.spacing[0];
    if (!cli_may_print(&morph->settings.common)) {
        return;
    }
    printf("%d joints paired by %s; grid %d x %d x %d\n", morph->alignment.pairs, morph->alignment.how, morph->grid.size[0],
           morph->grid.size[1], morph->grid.size[2]);
    const int left_out = morph->source.solid.dropped_voxels + morph->target.solid.dropped_voxels;
    if (left_out > 0) {
        printf("%d voxels of bodies below 1/1000 of the volume are left out\n", left_out);
    }
    printf("%d frames, %s; %d watertight, %d self-intersections, %d to %d components beside up to %d specks\n",
           morph->frame_count, morph->coincided >= 0 ? "the last is the target" : "the target is not reached", s.watertight,
           s.intersections, s.min_components, s.max_components, s.specks);
    printf("%d frames have more handles than both bodies in the neutral pose\n", s.with_handles);
    printf("the thinnest limb has %.0f %% of the thinner body's thickness%s%s\n", 100.0 * s.limb, s.limb_joint >= 0 ? ", at " : "",
           s.limb_joint >= 0 ? morph->target.character.joints[s.limb_joint].name : "");
    printf("distance to the target: mean %.3f, from it %.3f, largest %.2f voxels; weights sum to 1 within %.1g\n",
           morph->end.mean_ab / voxel, morph->end.mean_ba / voxel, morph->end.max / voxel, s.weight_error);
    printf("%.2f s a frame: skinning %.2f, target %.2f, contour %.2f\n", s.seconds, s.skinning, s.target, s.contour);
}
