/* gltf.c - writes a morph as glTF: all frames as a sequence, and the last one as a skinned body. */
#include "morph/morph.h"

#include "base/vec3.h"
#include "character/gltf_character.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SEAM 0.02f /* of the texture: a corner's UV this far from the triangle's map means that the corner lies beyond a seam */

/* Computes the UV of a point in the plane of a place's triangle by the triangle's affine map, also slightly beyond its edges. */
static void extend_uv(const struct character *c, int triangle, const float point[3], float uv[2])
{
    const int *corner = c->triangles + 3 * triangle;
    const float *a = c->positions + 3 * corner[0];
    float u[3], v[3], w[3];
    vec3_sub(c->positions + 3 * corner[1], a, u);
    vec3_sub(c->positions + 3 * corner[2], a, v);
    vec3_sub(point, a, w);
    const float uu = vec3_dot(u, u), cross = vec3_dot(u, v), vv = vec3_dot(v, v), wu = vec3_dot(w, u), wv = vec3_dot(w, v);
    const float d = uu * vv - cross * cross;
    const float s = d > 0.0f ? fmaxf(-1.0f, fminf(2.0f, (vv * wu - cross * wv) / d)) : 0.0f;
    const float t = d > 0.0f ? fmaxf(-1.0f, fminf(2.0f, (uu * wv - cross * wu) / d)) : 0.0f;
    for (int k = 0; k < 2; ++k) {
        uv[k] = (1.0f - s - t) * c->uvs[2 * corner[0] + k] + s * c->uvs[2 * corner[1] + k] + t * c->uvs[2 * corner[2] + k];
    }
}

/* A frame whose vertices are doubled along seams of the texture. */
struct seamed {
    float *positions, *normals, *uvs, *colors;
    int *triangles, vertex_count;
};

static void seamed_free(struct seamed *s)
{
    free(s->positions);
    free(s->normals);
    free(s->uvs);
    free(s->colors);
    free(s->triangles);
}

static void add_corner(struct seamed *s, const struct morph_frame *frame, int vertex, const float uv[2], int *corner)
{
    const size_t at = (size_t)s->vertex_count++;
    memcpy(s->positions + 3 * at, frame->mesh.positions + 3 * vertex, 3 * sizeof(float));
    memcpy(s->normals + 3 * at, frame->mesh.normals + 3 * vertex, 3 * sizeof(float));
    memcpy(s->colors + 3 * at, frame->colors + 3 * vertex, 3 * sizeof(float));
    memcpy(s->uvs + 2 * at, uv, 2 * sizeof(float));
    *corner = (int)at;
}

/* Splits vertices along seams; the middle of a triangle determines its side of a seam. */
static bool split_seams(const struct morph *morph, const struct morph_frame *frame, struct seamed *s)
{
    const springls_mesh *mesh = &frame->mesh;
    const size_t capacity = (size_t)mesh->vertex_count + 3 * (size_t)mesh->triangle_count;
    memset(s, 0, sizeof *s);
    s->positions = malloc(3 * capacity * sizeof(float));
    s->normals = malloc(3 * capacity * sizeof(float));
    s->colors = malloc(3 * capacity * sizeof(float));
    s->uvs = malloc(2 * capacity * sizeof(float));
    s->triangles = malloc((3 * (size_t)mesh->triangle_count + 1) * sizeof(int));
    if (!s->positions || !s->normals || !s->colors || !s->uvs || !s->triangles) {
        return morph_no_memory();
    }
    int corner;
    for (int v = 0; v < mesh->vertex_count; ++v) {
        add_corner(s, frame, v, frame->uvs + 2 * v, &corner);
    }
    memcpy(s->triangles, mesh->triangles, 3 * (size_t)mesh->triangle_count * sizeof(int));
    for (int t = 0; t < mesh->triangle_count; ++t) {
        float middle[3] = {0.0f, 0.0f, 0.0f}, uv[3][2];
        struct place place;
        bool beyond = false;
        for (int k = 0; k < 3; ++k) {
            vec3_add_scaled(middle, 1.0f / 3.0f, mesh->correspondences + 3 * mesh->triangles[3 * t + k], middle);
        }
        places_find(&morph->source.places, middle, &place);
        for (int k = 0; k < 3; ++k) {
            const int v = mesh->triangles[3 * t + k];
            extend_uv(&morph->source.character, place.triangle, mesh->correspondences + 3 * v, uv[k]);
            beyond = beyond || fabsf(uv[k][0] - frame->uvs[2 * v]) > SEAM || fabsf(uv[k][1] - frame->uvs[2 * v + 1]) > SEAM;
        }
        for (int k = 0; beyond && k < 3; ++k) {
            add_corner(s, frame, mesh->triangles[3 * t + k], uv[k], &s->triangles[3 * t + k]);
        }
    }
    return true;
}

static bool write_sequence(const struct morph *morph, const char *path)
{
    const size_t count = (size_t)morph->frame_count;
    struct gltf_mesh *meshes = calloc(count, sizeof *meshes);
    struct seamed *seamed = calloc(count, sizeof *seamed);
    bool good = (meshes && seamed) || morph_no_memory();
    for (size_t f = 0; good && f < count; ++f) {
        struct seamed *s = &seamed[f];
        good = split_seams(morph, &morph->frames[f], s);
        const struct gltf_mesh made = {.positions = s->positions,
                                       .normals = s->normals,
                                       .colors = s->colors,
                                       .triangles = s->triangles,
                                       .vertex_count = s->vertex_count,
                                       .triangle_count = morph->frames[f].mesh.triangle_count};
        meshes[f] = made;
    }
    good = good
        && (gltf_write_sequence(path, meshes, morph->frame_count, morph->settings.fps, NULL)
            || morph_fail("%s cannot be written", path));
    for (size_t f = 0; seamed && f < count; ++f) {
        seamed_free(&seamed[f]);
    }
    free(seamed);
    free(meshes);
    return good;
}

/* Writes the end in the neutral pose with its bone weights: a body that any engine can animate. */
static bool write_skinned(const struct morph *morph, const char *path)
{
    const struct morph_frame *rest = &morph->rest;
    struct influences *influences = malloc(((size_t)rest->mesh.vertex_count + 1) * sizeof *influences);
    bool good = influences || morph_no_memory();
    for (int v = 0; good && v < rest->mesh.vertex_count; ++v) {
        struct place place;
        places_find(&morph->source.places, rest->mesh.correspondences + 3 * v, &place);
        influences[v] = place_influences(&morph->source.character, &place);
    }
    const struct gltf_mesh mesh = {.positions = rest->mesh.positions,
                                   .normals = rest->mesh.normals,
                                   .colors = rest->colors,
                                   .triangles = rest->mesh.triangles,
                                   .vertex_count = rest->mesh.vertex_count,
                                   .triangle_count = rest->mesh.triangle_count};
    good = good
        && (gltf_write_skinned(path, &mesh, influences, NULL, &morph->target.character)
            || morph_fail("%s cannot be written", path));
    free(influences);
    return good;
}

bool morph_write_gltf(const struct morph *morph)
{
    char sequence[1200], skinned[1200];
    run_path(morph->settings.common.out, "morph.glb", sequence, sizeof sequence);
    run_path(morph->settings.common.out, "skinned.glb", skinned, sizeof skinned);
    return write_sequence(morph, sequence) && write_skinned(morph, skinned);
}
