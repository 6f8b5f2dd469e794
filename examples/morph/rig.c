/* rig.c - bone weights for a body that has none: heat on its own closed surface, from its own skeleton or a donor's. */
#include "morph/morph.h"

#include "base/json.h"
#include "base/progress.h"
#include "base/vec3.h"
#include "character/gltf_character.h"
#include "character/skeleton_align.h"
#include "character/skeleton_fit.h"
#include "character/skeleton_picture.h"
#include "character/skin_weights.h"

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool grid_around(const struct character *body, int cells, springls_grid_desc *grid)
{
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    raycast_grow_box(body->positions, (size_t)body->vertex_count, lo, hi);
    return morph_grid_around(lo, hi, cells, grid);
}

/* Copies the closed surface of the body. */
static bool body_mesh(const struct morph *morph, const char *path, const struct character *body, struct rig_mesh *mesh)
{
    springls_desc desc;
    springls_context *ctx = NULL;
    springls_mesh surface;
    struct morph_solid solid;
    memset(&desc, 0, sizeof desc);
    memset(&surface, 0, sizeof surface);
    desc.params = &morph->params;
    bool good = (grid_around(body, morph->settings.common.grid, &desc.grid) || morph_fail("%s: the body has no size", morph_name(path)))
        && run_create("morph", &desc, &ctx) == CLI_CONTINUE
        && morph_solid_make(morph, ctx, &desc.grid, path, body, &solid)
        && morph_check(ctx, springls_extract_mesh(ctx, &surface), morph_name(path));
    if (good) {
        const size_t points = 3 * (size_t)surface.vertex_count * sizeof(float),
                     corners = 3 * (size_t)surface.triangle_count * sizeof(int);
        mesh->vertex_count = surface.vertex_count;
        mesh->triangle_count = surface.triangle_count;
        mesh->positions = malloc(points + 1);
        mesh->normals = malloc(points + 1);
        mesh->triangles = malloc(corners + 1);
        good = (mesh->positions && mesh->normals && mesh->triangles) || morph_no_memory();
        if (good) {
            memcpy(mesh->positions, surface.positions, points);
            memcpy(mesh->normals, surface.normals, points);
            memcpy(mesh->triangles, surface.triangles, corners);
        }
    }
    springls_mesh_free(ctx, &surface);
    springls_destroy(ctx);
    return good;
}

void morph_rig_free(struct rig_mesh *mesh)
{
    free(mesh->positions);
    free(mesh->normals);
    free(mesh->triangles);
    free(mesh->influences);
    memset(mesh, 0, sizeof *mesh);
}

/* Extends the last bones of hands, feet and heads, which have no joint at their end, four fifths of the way to the surface. */
static bool extend_bones(const struct character *body, const struct rig_mesh *mesh, struct bone *bones, const int *joints,
                         int count)
{
    struct bvh bvh;
    if (!bvh_build(&bvh, mesh->positions, (const uint32_t *)mesh->triangles, (size_t)mesh->triangle_count)) {
        return morph_no_memory();
    }
    for (int b = 0; b < count; ++b) {
        bool last = true;
        for (int j = joints[b] + 1; j < body->joint_count; ++j) {
            last = last && !(body->joints[j].parent == joints[b] && body->joints[j].bone);
        }
        float direction[3];
        struct bvh_hit hit;
        vec3_sub(bones[b].to, bones[b].from, direction);
        if (last && vec3_normalize(direction) > 0.0f && bvh_nearest_hit(&bvh, bones[b].from, direction, 0.0f, INFINITY, &hit)) {
            vec3_add_scaled(bones[b].from, 0.8f * hit.t, direction, bones[b].to);
        }
    }
    bvh_free(&bvh);
    return true;
}

static bool add_weights(const char *path, struct character *body, struct rig_mesh *mesh)
{
    const struct skin_surface surface = {mesh->positions, mesh->triangles, mesh->vertex_count, mesh->triangle_count};
    const size_t capacity = 2 * (size_t)body->joint_count + 1;
    struct bone *bones = malloc(capacity * sizeof *bones);
    int *joints = malloc(capacity * sizeof *joints);
    const int count = bones && joints ? skeleton_bones(body, bones, joints) : 0;
    mesh->influences = malloc(((size_t)mesh->vertex_count + 1) * sizeof *mesh->influences);
    bool good = (bones && joints && mesh->influences) || morph_no_memory();
    good = good && extend_bones(body, mesh, bones, joints, count)
        && (skin_weights_heat(&surface, bones, joints, count, mesh->influences, &mesh->heat)
            || morph_fail("%s: no bone is seen from the body's surface", morph_name(path)))
        && (skin_weights_transfer(&surface, mesh->influences, body) || morph_no_memory());
    free(bones);
    free(joints);
    return good;
}

bool morph_rig(const struct morph *morph, const char *path, struct character *body, const struct character *donor,
               struct rig_mesh *mesh)
{
    memset(mesh, 0, sizeof *mesh);
    bool good = body_mesh(morph, path, body, mesh);
    if (good && donor) {
        good = skeleton_fit(donor, mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count, body,
                            &mesh->fit_distance)
               || morph_fail("%s: the donor's skeleton cannot be fitted into this body", morph_name(path));
    }
    return good && add_weights(path, body, mesh);
}

/* ---- --weights ---- */

/* Returns the mean L1 distance of the weights from the artist's over the closed surface; map: our joints to the artist's. */
static double compare(const struct rig_mesh *mesh, const struct character *body, const struct places *truth, const int *map)
{
    double sum = 0.0;
    const int joints = truth->character->joint_count;
    float *difference = malloc(((size_t)joints + 1) * sizeof *difference);
    for (int v = 0; difference && v < mesh->vertex_count; ++v) {
        struct place place;
        memset(difference, 0, (size_t)joints * sizeof *difference);
        places_find(truth, mesh->positions + 3 * v, &place);
        const struct influences theirs = place_influences(truth->character, &place), *ours = &mesh->influences[v];
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            if (ours->weight[k] > 0.0f) {
                int j = ours->joint[k];
                while (map[j] < 0 && body->joints[j].parent >= 0) {
                    j = body->joints[j].parent;
                }
                difference[map[j] >= 0 ? map[j] : 0] += ours->weight[k];
            }
            difference[theirs.joint[k]] -= theirs.weight[k];
        }
        for (int j = 0; j < joints; ++j) {
            sum += fabs((double)difference[j]) / mesh->vertex_count;
        }
    }
    free(difference);
    return sum;
}

/* Returns the mean distance of joints from the artist's over the body's height. */
static double joint_distance(const struct character *body, const struct character *truth, const int *map)
{
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    double sum = 0.0;
    int count = 0;
    raycast_grow_box(truth->positions, (size_t)truth->vertex_count, lo, hi);
    for (int j = 0; j < body->joint_count; ++j) {
        if (map[j] >= 0) {
            float a[3], b[3];
            joint_place(&body->joints[j], a);
            joint_place(&truth->joints[map[j]], b);
            vec3_sub(a, b, a);
            sum += (double)(vec3_length(a) / (hi[1] - lo[1]));
            ++count;
        }
    }
    return count > 0 ? sum / count : 0.0;
}

static bool draw_weights(const struct morph *morph, const struct rig_mesh *mesh, const float *colors,
                         const struct character *skeleton, struct image *image)
{
    static const float upwards[3] = {0.0f, 1.0f, 0.0f};
    const int height = morph->settings.size, width = height * 4 / 5;
    struct raycast_scene scene;
    float *places = malloc(3 * ((size_t)skeleton->joint_count + 1) * sizeof *places);
    memset(&scene, 0, sizeof scene);
    scene.positions = mesh->positions;
    scene.vertex_count = (size_t)mesh->vertex_count;
    scene.indices = (const uint32_t *)mesh->triangles;
    scene.triangle_count = (size_t)mesh->triangle_count;
    scene.vertex_colors = colors;
    scene.plain = true;
    scene.camera = raycast_frame_points(mesh->positions, scene.vertex_count, morph->settings.view, upwards, 25.0f,
                                        (float)width / (float)height);
    for (int j = 0; places && j < skeleton->joint_count; ++j) { joint_place(&skeleton->joints[j], places + 3 * j); }
    const bool good = places && skeleton_picture(&scene, skeleton, places, true, width, height, image);
    free(places);
    return good;
}

static bool write_pictures(const struct morph *morph, const struct rig_mesh *mesh, const struct character *body,
                           const struct places *truth)
{
    char path[1200];
    const char *const captions[2] = {"HEAT", "THE ARTIST'S"};
    struct image pictures[2], strip;
    float *colors = malloc(3 * (size_t)mesh->vertex_count * sizeof *colors);
    bool good = colors != NULL;
    memset(pictures, 0, sizeof pictures);
    memset(&strip, 0, sizeof strip);
    run_path(morph->settings.common.out, "weights.png", path, sizeof path);
    errno = 0; /* not every failure below sets it */
    for (int p = 0; good && p < (truth ? 2 : 1); ++p) {
        for (int v = 0; v < mesh->vertex_count; ++v) {
            struct influences in = mesh->influences[v];
            if (p == 1) {
                struct place place;
                places_find(truth, mesh->positions + 3 * v, &place);
                in = place_influences(truth->character, &place);
            }
            influences_color(&in, colors + 3 * v);
        }
        good = draw_weights(morph, mesh, colors, p ? truth->character : body, &pictures[p]);
    }
    good = good && image_strip(pictures, captions, truth ? 2 : 1, 2, color_rgb(1.0f, 1.0f, 1.0f), &strip)
           && image_write_png(&strip, path);
    image_free(&pictures[0]);
    image_free(&pictures[1]);
    image_free(&strip);
    free(colors);
    return good || cli_write_failed("morph", path);
}

static bool write_rigged(const struct morph *morph, const struct rig_mesh *mesh, const struct character *body)
{
    char path[1200];
    struct places places;
    float *colors = malloc(3 * (size_t)mesh->vertex_count * sizeof *colors);
    const struct gltf_mesh out = {.positions = mesh->positions,
                                  .normals = mesh->normals,
                                  .colors = colors,
                                  .triangles = mesh->triangles,
                                  .vertex_count = mesh->vertex_count,
                                  .triangle_count = mesh->triangle_count};
    bool good = (colors && places_create(body, &places)) || morph_no_memory();
    for (int v = 0; good && v < mesh->vertex_count; ++v) {
        struct place place;
        places_find(&places, mesh->positions + 3 * v, &place);
        place_color(body, &place, colors + 3 * v);
    }
    if (good) {
        places_free(&places);
        good = gltf_write_skinned(run_path(morph->settings.common.out, "rigged.glb", path, sizeof path), &out, mesh->influences,
                                  NULL, body)
            || cli_write_failed("morph", path);
    }
    free(colors);
    return good;
}

static bool write_report(const struct morph *morph, const struct rig_mesh *mesh, const struct character *body, double seconds,
                         double difference, double joints)
{
    struct json_writer json;
    if (!json_open(&json, morph->settings.common.json)) {
        return cli_write_failed("morph", morph->settings.common.json);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "problem", "weights");
    json_string(&json, "file", morph_name(morph->settings.source));
    json_string(&json, "donor", morph->settings.donor);
    json_integer(&json, "vertices", mesh->vertex_count);
    json_integer(&json, "vertices_that_see_their_bone", mesh->heat.visible);
    json_integer(&json, "joints", body->joint_count);
    json_integer(&json, "iterations", mesh->heat.iterations);
    json_number(&json, "weight_sum_error_max", mesh->heat.sum_error);
    json_number(&json, "fit_distance_mean", morph->settings.donor ? mesh->fit_distance : (double)NAN);
    json_number(&json, "joint_distance_of_height_mean", joints);
    json_number(&json, "weights_from_artists_mean_l1", difference);
    json_number(&json, "seconds", seconds);
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("morph", morph->settings.common.json);
}

bool morph_weights(const struct morph *morph)
{
    const struct morph_settings *set = &morph->settings;
    struct character body, artist, donor;
    struct places truth;
    struct rig_mesh mesh;
    struct alignment alignment;
    char error[CHARACTER_TEXT];
    double difference = (double)NAN, joints = (double)NAN;
    memset(&artist, 0, sizeof artist);
    memset(&donor, 0, sizeof donor);
    memset(&truth, 0, sizeof truth);
    memset(&mesh, 0, sizeof mesh);
    const double start = elapsed_seconds();
    bool good = set->source ? character_read(set->source, set->props, &body, error) : character_build(0, &body, error);
    if (!good) {
        return morph_fail("%s", error);
    }
    good = (set->source ? character_read(set->source, set->props, &artist, error) : character_build(0, &artist, error))
        || morph_fail("%s", error);
    good = good && morph_check_props(set->props, &body, &body) && (!set->donor || morph_read_donor(set->donor, &donor));
    if (good && !set->donor && !body.skinned) {
        good = morph_fail("%s: no part has bones; --donor FILE lends a skeleton", set->source);
    }
    good = good && morph_rig(morph, set->source, &body, set->donor ? &donor : NULL, &mesh);
    const double seconds = elapsed_seconds() - start;
    if (good && artist.skinned) {
        good = places_create(&artist, &truth) || morph_no_memory();
        if (good && skeleton_align(&body, &artist, set->map, &alignment, error)) {
            difference = compare(&mesh, &body, &truth, alignment.map);
            joints = joint_distance(&body, &artist, alignment.map);
            alignment_free(&alignment);
        } else if (good && set->map) {
            good = morph_fail("%s", error);
        }
    }
    if (good && cli_may_print(&set->common)) {
        printf("%d of %d vertices see their bone; weights sum to 1 within %.1g", mesh.heat.visible, mesh.vertex_count,
               mesh.heat.sum_error);
        if (!isnan(difference)) { printf("; from the artist's: mean L1 %.3f", difference); }
        printf("\n");
    }
    good = good
        && (!set->common.out
            || (write_pictures(morph, &mesh, &body, artist.skinned ? &truth : NULL) && write_rigged(morph, &mesh, &body)))
        && (!set->common.json || write_report(morph, &mesh, &body, seconds, difference, joints));
    morph_rig_free(&mesh);
    places_free(&truth);
    character_free(&body);
    character_free(&artist);
    character_free(&donor);
    return good;
}
