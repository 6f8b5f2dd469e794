/* character.c - poses of a character, and bone weights. */
#include "character/character.h"

#include "base/cli.h"
#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

void character_free_rig(struct character *character)
{
    for (int a = 0; a < character->animation_count; ++a) {
        animation_free(&character->animations[a]);
    }
    free(character->joints);
    free(character->animations);
    character->joints = NULL;
    character->animations = NULL;
    character->joint_count = character->animation_count = 0;
}

void character_free(struct character *character)
{
    character_free_rig(character);
    for (int i = 0; i < character->picture_count; ++i) {
        picture_free(&character->pictures[i]);
    }
    free(character->positions);
    free(character->uvs);
    free(character->colors);
    free(character->influences);
    free(character->triangles);
    free(character->materials_of);
    free(character->materials);
    free(character->pictures);
    free(character->normals);
    free(character->props);
    memset(character, 0, sizeof *character);
}

bool character_has_colors(const struct character *character)
{
    for (int i = 0; i < 3 * character->vertex_count; ++i) {
        if (character->colors[i] != 1.0f) {
            return true;
        }
    }
    return false;
}

int character_animation(const struct character *character, const char *name)
{
    int number = -1;
    for (int a = 0; name && a < character->animation_count; ++a) {
        if (strcmp(character->animations[a].name, name) == 0) {
            return a;
        }
    }
    if (!name) {
        return character->animation_count > 0 ? 0 : -1;
    }
    return cli_read_int(name, &number) && number >= 0 && number < character->animation_count ? number : -1;
}

int character_joint(const struct character *character, const char *name)
{
    for (int j = 0; j < character->joint_count; ++j) {
        if (strcmp(character->joints[j].name, name) == 0) {
            return j;
        }
    }
    return -1;
}

/* ---- normals ---- */

struct spot {
    float place[3];
    int vertex;
};

static int compare_spots(const void *a, const void *b)
{
    const struct spot *s = a, *t = b;
    for (int i = 0; i < 3; ++i) {
        if (s->place[i] != t->place[i]) {
            return s->place[i] < t->place[i] ? -1 : 1;
        }
    }
    return (s->vertex > t->vertex) - (s->vertex < t->vertex);
}

static bool same_place(const struct spot *a, const struct spot *b)
{
    return a->place[0] == b->place[0] && a->place[1] == b->place[1] && a->place[2] == b->place[2];
}

bool character_smooth(struct character *c, int first_vertex, int first_triangle)
{
    const int count = c->vertex_count - first_vertex;
    struct spot *spots = malloc(((size_t)count + 1) * sizeof *spots);
    if (!spots) {
        return false;
    }
    for (int s = 0; s < count; ++s) {
        spots[s].vertex = first_vertex + s;
        memcpy(spots[s].place, c->positions + 3 * (first_vertex + s), sizeof spots[s].place);
        memset(c->normals + 3 * (first_vertex + s), 0, 3 * sizeof *c->normals);
    }
    for (int t = first_triangle; t < c->triangle_count; ++t) { /* weighted by area */
        const int *corner = c->triangles + 3 * t;
        float u[3], v[3], n[3];
        vec3_sub(c->positions + 3 * corner[1], c->positions + 3 * corner[0], u);
        vec3_sub(c->positions + 3 * corner[2], c->positions + 3 * corner[0], v);
        vec3_cross(u, v, n);
        for (int k = 0; k < 3; ++k) {
            vec3_add_scaled(c->normals + 3 * corner[k], 1.0f, n, c->normals + 3 * corner[k]);
        }
    }
    qsort(spots, (size_t)count, sizeof *spots, compare_spots);
    for (int s = 0, next; s < count; s = next) {
        const struct affine one = affine_identity();
        float sum[3] = {0.0f, 0.0f, 0.0f};
        for (next = s; next < count && same_place(&spots[s], &spots[next]); ++next) {
            vec3_add_scaled(sum, 1.0f, c->normals + 3 * spots[next].vertex, sum);
        }
        for (int k = s; k < next; ++k) {
            affine_normal(&one, sum, c->normals + 3 * spots[k].vertex);
        }
    }
    free(spots);
    return true;
}

/* ---- poses ---- */

static struct placement animated(const struct character *character, const struct animation *animation, int joint, double time)
{
    struct placement p = character->joints[joint].rest;
    for (int c = 0; animation && c < animation->channel_count; ++c) {
        const struct channel *channel = &animation->channels[c];
        if (channel->joint == joint) {
            keys_sample(&channel->translation, 3, time, p.translation);
            keys_sample(&channel->rotation, 4, time, p.rotation);
            keys_sample(&channel->scale, 3, time, p.scale);
        }
    }
    return p;
}

static struct affine local_neutral(const struct character *character, int joint)
{
    const struct joint *j = &character->joints[joint];
    if (j->parent < 0) {
        return j->neutral;
    }
    const struct affine up = affine_inverse(&character->joints[j->parent].neutral);
    return affine_after(&up, &j->neutral);
}

void character_pose(const struct character *character, int animation, double time, double blend, struct affine *skin,
                    struct affine *places)
{
    const struct animation *moving = animation >= 0 ? &character->animations[animation] : NULL;
    const double loop = moving && moving->duration > 0.0 ? fmod(time, moving->duration) : 0.0;
    for (int j = 0; j < character->joint_count; ++j) {
        struct affine local = local_neutral(character, j);
        if (moving && blend > 0.0) {
            const struct placement still = placement_of(&local), there = animated(character, moving, j, loop);
            const struct placement p = blend < 1.0 ? placement_between(&still, &there, blend) : there;
            local = placement_matrix(&p);
        }
        const int parent = character->joints[j].parent;
        const struct affine back = affine_inverse(&character->joints[j].neutral);
        places[j] = parent >= 0 ? affine_after(&places[parent], &local) : local;
        skin[j] = affine_after(&places[j], &back);
    }
}

struct affine influences_blend(const struct influences *influences, const struct affine *skin)
{
    struct affine blend = {{0}};
    for (int k = 0; k < CHARACTER_BONES; ++k) {
        if (influences->weight[k] > 0.0f) {
            affine_add(&blend, (double)influences->weight[k], &skin[influences->joint[k]]);
        }
    }
    return blend;
}

void character_skin(const struct character *character, const struct affine *skin, float *positions)
{
    for (int v = 0; v < character->vertex_count; ++v) {
        const struct affine blend = influences_blend(&character->influences[v], skin);
        affine_apply(&blend, character->positions + 3 * v, positions + 3 * v);
    }
}

/* ---- weights ---- */

void influences_add(struct influences *influences, int joint, float weight)
{
    int minimum = 0;
    for (int k = 0; k < CHARACTER_BONES; ++k) {
        if (influences->weight[k] > 0.0f && influences->joint[k] == joint) {
            influences->weight[k] += weight;
            return;
        }
        minimum = influences->weight[k] < influences->weight[minimum] ? k : minimum;
    }
    if (weight > influences->weight[minimum]) {
        influences->joint[minimum] = joint;
        influences->weight[minimum] = weight;
    }
}

float influences_normalize(struct influences *influences, int otherwise)
{
    float sum = 0.0f;
    for (int k = 0; k < CHARACTER_BONES; ++k) {
        sum += influences->weight[k];
    }
    if (!(sum > 0.0f)) {
        influences->joint[0] = otherwise;
        influences->weight[0] = 1.0f;
        return 0.0f;
    }
    for (int k = 0; k < CHARACTER_BONES; ++k) {
        influences->weight[k] /= sum;
    }
    return sum;
}
