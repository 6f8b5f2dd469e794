/* mesh_damage.h - what happens to meshes on their way: ten kinds of damage in three strengths, done to a closed mesh that is the truth.
 * Random places are of a generator of its own, so that damage is the same everywhere. Lengths are shares of the mesh's size. */
#ifndef MESH_DAMAGE_H
#define MESH_DAMAGE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum damage_kind {
    DAMAGE_TURNED,   /* patches of triangles that face inwards                             */
    DAMAGE_HOLES,    /* four gaps of 1, 2, 3 %                                             */
    DAMAGE_SHELL,    /* a second shell 1, 1.5, 2 % below, and three punctures through both */
    DAMAGE_JUNK,     /* pyramids inside: 5, 10, 20                                         */
    DAMAGE_FINS,     /* sheets that stick out by 4, 8, 12 %                                */
    DAMAGE_SPECKS,   /* pyramids of .6 % floating outside: 10, 20, 40                      */
    DAMAGE_CRACKS,   /* every triangle on its own, .05, .1, .2 % smaller on all sides      */
    DAMAGE_DOUBLED,  /* a patch a second time, .1, .2, .4 % below                          */
    DAMAGE_SOUP,     /* no common vertices, 10, 25, 50 % of the triangles turned           */
    DAMAGE_PIECES,   /* cut in eight, each piece moved by up to .1, .2, .3 %               */
    DAMAGE_KINDS
};

static const char *const damage_names[DAMAGE_KINDS] = {"turned patches", "holes", "punctured double shell", "junk inside", "fins", "specks",
                                                       "cracks", "doubled patch", "turned soup", "shifted pieces"};

struct damaged {
    float *positions;
    uint32_t *indices;
    size_t vertex_count, triangle_count, vertex_room, triangle_room;
    uint64_t seed;
    float size;
};

static inline double damage_random(struct damaged *m)
{
    m->seed = m->seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(m->seed >> 11) / 9007199254740992.0;
}

static inline bool damage_room(struct damaged *m, size_t vertices, size_t triangles)
{
    if (m->vertex_count + vertices > m->vertex_room) {
        m->vertex_room = 2 * (m->vertex_count + vertices);
        float *grown = (float *)realloc(m->positions, 3 * m->vertex_room * sizeof *grown);
        if (!grown) return false;
        m->positions = grown;
    }
    if (m->triangle_count + triangles > m->triangle_room) {
        m->triangle_room = 2 * (m->triangle_count + triangles);
        uint32_t *grown = (uint32_t *)realloc(m->indices, 3 * m->triangle_room * sizeof *grown);
        if (!grown) return false;
        m->indices = grown;
    }
    return true;
}

/* Copies a mesh. Returns false if memory is short. */
static inline bool damage_begin(struct damaged *m, const float *positions, size_t vertex_count, const uint32_t *indices,
                                size_t triangle_count, uint64_t seed)
{
    float lower[3] = {1e30f, 1e30f, 1e30f}, upper[3] = {-1e30f, -1e30f, -1e30f};
    memset(m, 0, sizeof *m);
    if (!damage_room(m, vertex_count, triangle_count)) return false;
    memcpy(m->positions, positions, 3 * vertex_count * sizeof *positions);
    memcpy(m->indices, indices, 3 * triangle_count * sizeof *indices);
    m->vertex_count = vertex_count;
    m->triangle_count = triangle_count;
    m->seed = seed;
    for (size_t i = 0; i < 3 * vertex_count; ++i) {
        lower[i % 3] = fminf(lower[i % 3], positions[i]);
        upper[i % 3] = fmaxf(upper[i % 3], positions[i]);
    }
    for (int k = 0; k < 3; ++k) m->size = fmaxf(m->size, upper[k] - lower[k]);
    return true;
}

static inline void damage_end(struct damaged *m)
{
    free(m->positions);
    free(m->indices);
    memset(m, 0, sizeof *m);
}

static inline float *damage_corner(const struct damaged *m, size_t triangle, size_t k)
{
    return m->positions + 3 * (size_t)m->indices[3 * triangle + k];
}

static inline void damage_turn(struct damaged *m, size_t t)
{
    const uint32_t keep = m->indices[3 * t + 1];
    m->indices[3 * t + 1] = m->indices[3 * t + 2];
    m->indices[3 * t + 2] = keep;
}

static inline void damage_center(const struct damaged *m, size_t t, float center[3])
{
    for (size_t k = 0; k < 3; ++k)
        center[k] = (damage_corner(m, t, 0)[k] + damage_corner(m, t, 1)[k] + damage_corner(m, t, 2)[k]) / 3.0f;
}

/* Computes a triangle's unit normal. */
static inline void damage_normal(const struct damaged *m, size_t t, float n[3])
{
    const float *a = damage_corner(m, t, 0), *b = damage_corner(m, t, 1), *c = damage_corner(m, t, 2);
    float u[3], v[3], length;
    for (int k = 0; k < 3; ++k) {
        u[k] = b[k] - a[k];
        v[k] = c[k] - a[k];
    }
    for (int k = 0; k < 3; ++k) n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
    length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; ++k) n[k] = length > 0.0f ? n[k] / length : 0.0f;
}

static inline size_t damage_any_triangle(struct damaged *m) { return (size_t)(damage_random(m) * (double)m->triangle_count); }

static inline float damage_apart(const float a[3], const float b[3])
{
    return sqrtf((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

/* Removes triangles [from, to) with a corner within a distance of a place and none beyond half as much again. */
static inline void damage_hole(struct damaged *m, const float place[3], float distance)
{
    size_t n = 0;
    for (size_t t = 0; t < m->triangle_count; ++t) {
        float center[3], furthest = 0.0f;
        damage_center(m, t, center);
        for (size_t k = 0; k < 3; ++k) furthest = fmaxf(furthest, damage_apart(damage_corner(m, t, k), place));
        if (damage_apart(center, place) < distance && furthest < 1.5f * distance) continue;
        memmove(m->indices + 3 * n++, m->indices + 3 * t, 3 * sizeof *m->indices);
    }
    m->triangle_count = n;
}

/* Gives every triangle corners of its own. */
static inline bool damage_separate(struct damaged *m)
{
    float *positions = (float *)malloc((9 * m->triangle_count + 1) * sizeof *positions);
    if (!positions) return false;
    for (size_t i = 0; i < 3 * m->triangle_count; ++i) {
        memcpy(positions + 3 * i, m->positions + 3 * (size_t)m->indices[i], 3 * sizeof *positions);
        m->indices[i] = (uint32_t)i;
    }
    free(m->positions);
    m->positions = positions;
    m->vertex_count = m->vertex_room = 3 * m->triangle_count;
    return true;
}

/* Adds a pyramid that faces outwards. */
static inline bool damage_pyramid(struct damaged *m, const float at[3], float size)
{
    static const float corner[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    static const uint32_t face[12] = {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2};
    if (!damage_room(m, 4, 4)) return false;
    for (int i = 0; i < 12; ++i) {
        m->positions[3 * m->vertex_count + (size_t)i] = at[i % 3] + 0.5f * size * corner[i / 3][i % 3];
        m->indices[3 * m->triangle_count + (size_t)i] = (uint32_t)m->vertex_count + face[i];
    }
    m->vertex_count += 4;
    m->triangle_count += 4;
    return true;
}

/* Adds the triangles around a place (all: distance < 0) a second time, moved against their vertices' normals. turned: facing inwards. */
static inline bool damage_copy(struct damaged *m, const float place[3], float distance, float below, bool turned)
{
    const size_t triangles = m->triangle_count, vertices = m->vertex_count;
    float *normals = (float *)calloc(3 * vertices + 1, sizeof *normals);
    if (!normals || !damage_room(m, vertices, triangles)) return free(normals), false;
    for (size_t t = 0; t < triangles; ++t) {
        float n[3];
        damage_normal(m, t, n);
        for (size_t k = 0; k < 9; ++k) normals[3 * (size_t)m->indices[3 * t + k / 3] + k % 3] += n[k % 3];
    }
    for (size_t v = 0; v < vertices; ++v) {
        const float *n = normals + 3 * v;
        const float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (size_t k = 0; k < 3; ++k)
            m->positions[3 * (vertices + v) + k] = m->positions[3 * v + k] - (length > 0.0f ? below * n[k] / length : 0.0f);
    }
    free(normals);
    m->vertex_count = 2 * vertices;
    for (size_t t = 0; t < triangles; ++t) {
        float center[3];
        damage_center(m, t, center);
        if (distance >= 0.0f && damage_apart(center, place) > distance) continue;
        for (size_t k = 0; k < 3; ++k) m->indices[3 * m->triangle_count + k] = m->indices[3 * t + k] + (uint32_t)vertices;
        if (turned) damage_turn(m, m->triangle_count);
        ++m->triangle_count;
    }
    return true;
}

static inline bool damage_add_fin(struct damaged *m, size_t t, float length, float width)
{
    float at[3], n[3], side[3];
    if (!damage_room(m, 4, 2)) return false;
    damage_center(m, t, at);
    damage_normal(m, t, n);
    const float *a = damage_corner(m, t, 0);
    const float out = damage_apart(a, at) > 0.0f ? 1.0f / damage_apart(a, at) : 0.0f;
    for (int k = 0; k < 3; ++k) side[k] = (a[k] - at[k]) * out;
    for (int i = 0; i < 12; ++i) {
        const float along = i / 3 == 0 || i / 3 == 3 ? -0.02f * m->size : length, across = i / 3 < 2 ? -0.5f * width : 0.5f * width;
        m->positions[3 * m->vertex_count + (size_t)i] = at[i % 3] + along * n[i % 3] + across * side[i % 3];
    }
    static const uint32_t face[6] = {0, 1, 2, 0, 2, 3};
    for (int i = 0; i < 6; ++i) m->indices[3 * m->triangle_count + (size_t)i] = (uint32_t)m->vertex_count + face[i];
    m->vertex_count += 4;
    m->triangle_count += 2;
    return true;
}

/* Puts a place at a distance before a triangle of the first `count` (behind it: negative), with no vertex within two thirds of that.
 * Returns false where forty tries find none. */
static inline bool damage_place(struct damaged *m, size_t count, float distance, float place[3])
{
    const size_t vertices = m->vertex_count;
    for (int tries = 0; tries < 40; ++tries) {
        float n[3];
        const size_t t = (size_t)(damage_random(m) * (double)count);
        bool free_there = true;
        damage_center(m, t, place);
        damage_normal(m, t, n);
        for (int k = 0; k < 3; ++k) place[k] += distance * n[k];
        for (size_t v = 0; v < vertices && free_there; ++v)
            free_there = damage_apart(place, m->positions + 3 * v) > 0.66f * fabsf(distance);
        if (free_there) return true;
    }
    return false;
}

/* Cuts the mesh in eight by its middle, and moves each piece. */
static inline bool damage_pieces(struct damaged *m, float by)
{
    float middle[3] = {0, 0, 0}, moves[8][3];
    if (!damage_separate(m)) return false;
    for (size_t i = 0; i < 3 * m->vertex_count; ++i) middle[i % 3] += m->positions[i] / (float)m->vertex_count;
    for (int i = 0; i < 24; ++i) moves[i / 3][i % 3] = by * (float)(2.0 * damage_random(m) - 1.0);
    for (size_t t = 0; t < m->triangle_count; ++t) {
        float c[3];
        damage_center(m, t, c);
        const int piece = (c[0] > middle[0]) + 2 * (c[1] > middle[1]) + 4 * (c[2] > middle[2]);
        for (size_t i = 0; i < 9; ++i) m->positions[9 * t + i] += moves[piece][i % 3];
    }
    return true;
}

/* Does one kind of damage, of strength 0 to 2. Returns false if memory is short. */
static inline bool damage_do(struct damaged *m, enum damage_kind kind, int strength)
{
    static const float holes[3] = {0.01f, 0.02f, 0.03f}, walls[3] = {0.01f, 0.015f, 0.02f}, cracks[3] = {0.0005f, 0.001f, 0.002f};
    static const float doubled[3] = {0.001f, 0.002f, 0.004f}, pieces[3] = {0.001f, 0.002f, 0.003f}, turned[3] = {0.1f, 0.25f, 0.5f};
    static const int counts[3] = {5, 10, 20};
    const size_t triangles = m->triangle_count;
    const float s = m->size;
    float place[3];
    bool fine = true;
    switch (kind) {
    case DAMAGE_TURNED:
        for (int i = 0; i < 3; ++i) {
            float center[3];
            damage_center(m, damage_any_triangle(m), place);
            for (size_t t = 0; t < triangles; ++t) {
                damage_center(m, t, center);
                if (damage_apart(center, place) < 0.1f * s * (float)(1 + strength)) damage_turn(m, t);
            }
        }
        break;
    case DAMAGE_HOLES:
        for (int i = 0; i < 4; ++i) {
            damage_center(m, damage_any_triangle(m), place);
            damage_hole(m, place, 0.5f * holes[strength] * s);
        }
        break;
    case DAMAGE_SHELL: {
        float places[3][3];
        for (int i = 0; i < 3; ++i) damage_center(m, damage_any_triangle(m), places[i]);
        fine = damage_copy(m, s > 0.0f ? places[0] : NULL, -1.0f, walls[strength] * s, strength != 1);
        for (int i = 0; i < 3; ++i) damage_hole(m, places[i], 0.01f * s);
        for (int i = 0; i < 3; ++i) damage_hole(m, places[i], walls[strength] * s * 1.3f);
        break;
    }
    case DAMAGE_JUNK:
        for (int i = 0; i < counts[strength] && fine; ++i)
            if (damage_place(m, triangles, -0.04f * s, place)) fine = damage_pyramid(m, place, 0.02f * s);
        break;
    case DAMAGE_FINS:
        for (int i = 0; i < 4 && fine; ++i)
            fine = damage_add_fin(m, (size_t)(damage_random(m) * (double)triangles), 0.04f * s * (float)(1 + strength), 0.04f * s);
        break;
    case DAMAGE_SPECKS:
        for (int i = 0; i < 2 * counts[strength] && fine; ++i)
            if (damage_place(m, triangles, 0.06f * s, place)) fine = damage_pyramid(m, place, 0.006f * s);
        break;
    case DAMAGE_CRACKS:
        fine = damage_separate(m);
        for (size_t t = 0; fine && t < triangles; ++t) {
            float center[3];
            damage_center(m, t, center);
            for (size_t i = 0; i < 9; ++i) {
                float *x = damage_corner(m, t, i / 3) + i % 3;
                const float shrink = fminf(cracks[strength] * s / (damage_apart(damage_corner(m, t, 0), center) + 1e-30f), 0.1f);
                if (i % 3 == 0) memcpy(place, damage_corner(m, t, i / 3), sizeof place);
                *x = place[i % 3] + shrink * (center[i % 3] - place[i % 3]);
            }
        }
        break;
    case DAMAGE_DOUBLED:
        damage_center(m, damage_any_triangle(m), place);
        fine = damage_copy(m, place, 0.3f * s, doubled[strength] * s, false);
        break;
    case DAMAGE_SOUP:
        fine = damage_separate(m);
        for (size_t t = 0; t < triangles; ++t)
            if (damage_random(m) < (double)turned[strength]) damage_turn(m, t);
        break;
    case DAMAGE_PIECES: fine = damage_pieces(m, pieces[strength] * s); break;
    case DAMAGE_KINDS: break;
    }
    return fine;
}

#endif
