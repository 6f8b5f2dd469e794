/* output.c - glTF, pictures, report. */
#include "rig/rig.h"

#include "base/json.h"
#include "base/vec3.h"
#include "character/gltf_character.h"
#include "character/skeleton_picture.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FILM = 4 };

/* ---- pictures ---- */

struct drawing {
    const struct rig *rig;
    struct raycast_camera camera;
    int width, height;
    const float *colors;
};

/* Draws the closed surface at `positions` and the skeleton over it. */
static bool draw(const struct drawing *d, const float *positions, const struct affine *joints, struct image *image)
{
    const struct rig *rig = d->rig;
    const int count = rig->body.character.joint_count;
    struct raycast_scene scene;
    float *places = malloc(3 * ((size_t)count + 1) * sizeof *places);
    memset(&scene, 0, sizeof scene);
    scene.positions = positions;
    scene.vertex_count = (size_t)rig->surface.vertex_count;
    scene.indices = (const uint32_t *)rig->surface.triangles;
    scene.triangle_count = (size_t)rig->surface.triangle_count;
    scene.vertex_colors = d->colors;
    scene.plain = true;
    scene.camera = d->camera;
    for (int i = 0; places && i < 3 * count; ++i) { places[i] = (float)joints[i / 3].m[4 * (i % 3) + 3]; }
    const bool good = places && skeleton_picture(&scene, &rig->body.character, places, false, d->width, d->height, image);
    free(places);
    return good;
}

static bool draw_all(const struct rig *rig, struct drawing *d, float *posed, struct image *pictures, int count)
{
    const struct character *c = &rig->body.character;
    const struct skeleton_embedding *e = &rig->body.embedding;
    const size_t joints = (size_t)c->joint_count + 1;
    struct affine *skin = malloc(joints * sizeof *skin), *places = malloc(joints * sizeof *places);
    float direction[3] = {0.0f, 0.0f, 0.0f};
    bool good = (skin && places) || rig_fail("not enough memory");
    vec3_add_scaled(direction, rig->settings.view[0], e->forward, direction);
    vec3_add_scaled(direction, rig->settings.view[1], e->left, direction);
    vec3_add_scaled(direction, rig->settings.view[2], e->up, direction);
    for (int pass = 0; pass < 2; ++pass) { /* first the place of all frames, for one camera */
        for (int p = 0; good && p < count; ++p) {
            float *frame = posed + 3 * (size_t)p * (size_t)rig->surface.vertex_count;
            const double time = p > 0 ? c->animations[0].duration * (p - 1) / (count - 1) : 0.0;
            character_pose(c, p > 0 ? 0 : -1, time, 1.0, skin, places);
            for (int v = 0; pass == 0 && v < rig->surface.vertex_count; ++v) {
                const struct affine blend = influences_blend(&rig->influences[v], skin);
                affine_apply(&blend, rig->surface.positions + 3 * v, frame + 3 * v);
            }
            good = pass == 0 || draw(d, frame, places, &pictures[p]) || rig_fail("a picture cannot be drawn");
        }
        if (pass == 0) {
            d->camera = raycast_frame_points(posed, (size_t)count * (size_t)rig->surface.vertex_count, direction,
                                             e->up, 25.0f, (float)d->width / (float)d->height);
        }
    }
    free(skin);
    free(places);
    return good;
}

/* Describes what a picture shows: the joints, or a pose of the animation. */
static void caption_of(const struct rig *rig, int picture, int count, char text[64])
{
    const struct character *c = &rig->body.character;
    if (picture == 0) {
        snprintf(text, 64, "joints; left: red");
    } else {
        snprintf(text, 64, "%.2f s", c->animations[0].duration * (picture - 1) / (count - 1));
    }
}

/* Writes the body with its weights as colors and its skeleton, left joints red; and poses of the animation. */
static bool write_picture(const struct rig *rig, const char *path)
{
    const int count = rig->body.character.animation_count > 0 ? 1 + FILM : 1;
    const size_t vertices = (size_t)rig->surface.vertex_count;
    float *colors = malloc(3 * vertices * sizeof *colors),
          *posed = malloc(3 * vertices * (size_t)count * sizeof *posed);
    struct drawing d = {
        .rig = rig, .width = rig->settings.size * 4 / 5, .height = rig->settings.size, .colors = colors};
    struct image pictures[1 + FILM], strip;
    char captions[1 + FILM][64];
    const char *list[1 + FILM];
    memset(pictures, 0, sizeof pictures);
    memset(&strip, 0, sizeof strip);
    bool good = (colors && posed) || rig_fail("not enough memory");
    for (size_t v = 0; good && v < vertices; ++v) { influences_color(&rig->influences[v], colors + 3 * v); }
    for (int p = 0; p < count; ++p) {
        caption_of(rig, p, count, captions[p]);
        list[p] = captions[p];
    }
    good = good && draw_all(rig, &d, posed, pictures, count)
        && ((image_strip(pictures, list, count, count, color_rgb(1.0f, 1.0f, 1.0f), &strip)
             && image_write_png(&strip, path))
            || cli_write_failed("rig", path));
    for (int p = 0; p < count; ++p) { image_free(&pictures[p]); }
    image_free(&strip);
    free(colors);
    free(posed);
    return good;
}

bool rig_write(struct rig *rig)
{
    char path[1200];
    const char *glb = rig->settings.glb;
    const bool folder = !glb;
    if (folder) { glb = run_path(rig->settings.common.out, "rigged.glb", path, sizeof path); }
    return (gltf_write_character(glb, &rig->body.character) || cli_write_failed("rig", glb))
        && (!folder || write_picture(rig, run_path(rig->settings.common.out, "rigged.png", path, sizeof path)));
}

/* ---- report ---- */

/* Names the limb of a role by the template's joint where it begins, or which ends the trunk; returns false where the body has none. */
static bool role_name(const struct rig *rig, int role, char name[CHARACTER_NAME])
{
    const struct skeleton_template *s = &rig->skeleton;
    const bool pair = role >= SKELETON_FIRST_PAIR;
    int joint = pair ? s->limb_root[role - SKELETON_FIRST_PAIR][0] : role < s->trunk_ends ? s->joints[s->trunk_end[role]].parent : -1;
    while (!pair && joint > 0 && s->joints[s->joints[joint].parent].optional) { joint = s->joints[joint].parent; }
    if (joint < 0 || (!pair && rig->body.embedding.roles.trunk[role] < 0)) { return false; }
    const int length = (int)strcspn(s->joints[joint].name, pair ? "." : "");
    snprintf(name, CHARACTER_NAME, "%.*s", length, s->joints[joint].name);
    return true;
}

static void report_vector(struct json_writer *json, const char *key, const float v[3])
{
    const double values[3] = {(double)v[0], (double)v[1], (double)v[2]};
    json_numbers(json, key, values, 3);
}

bool rig_report(const struct rig *rig, const char *path)
{
    const struct skeleton_embedding *e = &rig->body.embedding;
    struct json_writer json;
    if (!json_open(&json, path)) { return cli_write_failed("rig", path); }
    json_object_begin(&json, NULL);
    json_string(&json, "problem", "rig");
    json_string(&json, "file", rig->settings.mesh);
    json_string(&json, "template", rig->skeleton.name);
    json_integer(&json, "grid", rig->settings.common.grid);
    json_integer(&json, "parts", rig->body.repair.parts);
    json_integer(&json, "parts_joined", rig->body.repair.joined);
    json_integer(&json, "boundary_edges", rig->body.boundary_edges);
    json_number(&json, "role_cost", (double)e->roles.cost);
    json_object_begin(&json, "confidence");
    for (int role = 0; role < SKELETON_ROLES; ++role) {
        char name[CHARACTER_NAME];
        if (role_name(rig, role, name)) { json_number(&json, name, (double)e->roles.confidence[role]); }
    }
    json_object_end(&json);
    json_number(&json, "height", (double)e->height);
    json_number(&json, "asymmetry", (double)e->asymmetry);
    json_number(&json, "facing_margin", (double)e->facing);
    report_vector(&json, "left", e->left);
    report_vector(&json, "up", e->up);
    report_vector(&json, "forward", e->forward);
    json_object_begin(&json, "joints");
    for (int t = 0; t < rig->skeleton.count; ++t) {
        if (e->present[t]) { report_vector(&json, rig->skeleton.joints[t].name, e->place[t]); }
    }
    json_object_end(&json);
    json_object_begin(&json, "joints_of_the_file");
    for (int j = 0; j < rig->body.their_count; ++j) { report_vector(&json, rig->body.theirs[j].name, rig->body.theirs[j].place); }
    json_object_end(&json);
    if (rig->pairs > 0) {
        json_object_begin(&json, "pairs");
        for (int t = 0; t < rig->skeleton.count; ++t) {
            if (rig->pair[t] >= 0) {
                json_string(&json, rig->skeleton.joints[t].name, rig->other.joints[rig->pair[t]].name);
            }
        }
        json_object_end(&json);
    }
    json_integer(&json, "surface_vertices", rig->surface.vertex_count);
    json_integer(&json, "vertices_that_see_their_bone", rig->heat.visible);
    json_integer(&json, "vertices_on_both_sides_by_heat", rig->on_both_sides[0]);
    json_integer(&json, "vertices_on_both_sides", rig->on_both_sides[1]);
    json_number(&json, "weight_sum_error_max", rig->heat.sum_error);
    json_number(&json, "seconds", rig->seconds);
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("rig", path);
}

void rig_print(const struct rig *rig)
{
    const struct skeleton_embedding *e = &rig->body.embedding;
    printf("%d joints in %s, %.3g high; faces %.2f %.2f %.2f, up %.2f %.2f %.2f; %d of %d vertices see their bone\n",
           rig->body.character.joint_count, rig->settings.mesh, (double)e->height, (double)e->forward[0],
           (double)e->forward[1], (double)e->forward[2], (double)e->up[0], (double)e->up[1], (double)e->up[2],
           rig->heat.visible, rig->surface.vertex_count);
    printf("confidence:");
    for (int role = 0; role < SKELETON_ROLES; ++role) {
        char name[CHARACTER_NAME];
        if (role_name(rig, role, name)) { printf(" %s %.2f", name, (double)e->roles.confidence[role]); }
    }
    printf("\n");
    if (rig->pairs > 0) {
        printf("moves as %s: %s, %d joints paired\n", rig->settings.animation, rig->body.character.animations[0].name,
               rig->pairs);
    }
}
