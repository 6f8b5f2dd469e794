/* chunk_store.h - what an engine keeps of chunks, and whether it is closed; a brush that moves a model. SIDE: chunks along a side of the
   grid, defined before. */
#ifndef SPRINGLS_TESTS_CHUNK_STORE_H
#define SPRINGLS_TESTS_CHUNK_STORE_H

#include "fixtures.h"

/* What an engine keeps: the latest chunk of every brick. */
typedef struct store { springls_chunk chunk[SIDE * SIDE * SIDE]; } store;

FIXTURE void store_put(store *s, const springls_chunk *changed, int count)
{
    int i;
    for (i = 0; i < count; i++) {
        springls_chunk *to = &s->chunk[changed[i].brick[0] + SIDE * (changed[i].brick[1] + SIDE * changed[i].brick[2])];
        size_t floats = 3 * (size_t)changed[i].vertex_count * sizeof(float),
               corners = 3 * (size_t)changed[i].triangle_count * sizeof(uint16_t);
        free(to->positions);
        free(to->triangles);
        memset(to, 0, sizeof *to);
        if (changed[i].triangle_count == 0) continue;
        *to = changed[i];
        to->positions = (float *)malloc(floats);
        memcpy(to->positions, changed[i].positions, floats);
        to->triangles = (uint16_t *)malloc(corners);
        memcpy(to->triangles, changed[i].triangles, corners);
    }
}

FIXTURE void store_free(store *s)
{
    int i;
    for (i = 0; i < SIDE * SIDE * SIDE; i++) {
        free(s->chunk[i].positions);
        free(s->chunk[i].triangles);
    }
}

/* A triangle by its corners' places, the least first; and an edge. */
typedef struct face { float x[9]; } face;
typedef struct side { float x[6]; } side;

FIXTURE int compare_faces(const void *a, const void *b) { return memcmp(a, b, sizeof(face)); }
FIXTURE int compare_sides(const void *a, const void *b) { return memcmp(a, b, sizeof(side)); }

FIXTURE face face_of(const float *a, const float *b, const float *c)
{
    const float *p[3];
    face f;
    int first, k;
    p[0] = a; p[1] = b; p[2] = c;
    first = memcmp(a, b, 12) < 0 ? (memcmp(a, c, 12) < 0 ? 0 : 2) : (memcmp(b, c, 12) < 0 ? 1 : 2);
    for (k = 0; k < 3; k++) memcpy(f.x + 3 * k, p[(first + k) % 3], 12);
    return f;
}

/* All triangles, sorted; to be freed. */
FIXTURE face *store_faces(const store *s, int *count)
{
    face *faces;
    int i, t, n = 0;
    for (i = 0; i < SIDE * SIDE * SIDE; i++) n += s->chunk[i].triangle_count;
    faces = (face *)malloc(((size_t)n + 1) * sizeof *faces);
    for (i = n = 0; i < SIDE * SIDE * SIDE; i++)
        for (t = 0; t < s->chunk[i].triangle_count; t++) {
            const uint16_t *c = s->chunk[i].triangles + 3 * t;
            const float *p = s->chunk[i].positions;
            faces[n++] = face_of(p + 3 * c[0], p + 3 * c[1], p + 3 * c[2]);
        }
    qsort(faces, (size_t)n, sizeof *faces, compare_faces);
    *count = n;
    return faces;
}

/* Every side of a triangle is met by one the other way round, bit by bit. */
FIXTURE greatest_test_res is_watertight(const store *s)
{
    int count, i, k;
    face *faces = store_faces(s, &count);
    side *there = (side *)malloc(3 * (size_t)count * sizeof *there), *back = (side *)malloc(3 * (size_t)count * sizeof *back);
    ASSERT_GT(count, 0);
    for (i = 0; i < count; i++)
        for (k = 0; k < 3; k++) {
            memcpy(there[3 * i + k].x, faces[i].x + 3 * k, 12);
            memcpy(there[3 * i + k].x + 3, faces[i].x + 3 * ((k + 1) % 3), 12);
            memcpy(back[3 * i + k].x, faces[i].x + 3 * ((k + 1) % 3), 12);
            memcpy(back[3 * i + k].x + 3, faces[i].x + 3 * k, 12);
        }
    qsort(there, 3 * (size_t)count, sizeof *there, compare_sides);
    qsort(back, 3 * (size_t)count, sizeof *back, compare_sides);
    ASSERT(memcmp(there, back, 3 * (size_t)count * sizeof *there) == 0);
    for (i = 1; i < 3 * count; i++) ASSERT(memcmp(&there[i - 1], &there[i], sizeof *there) != 0);
    free(faces);
    free(there);
    free(back);
    PASS();
}

/* A brush: moves what is within its radius. */
typedef struct brush { float center[3], radius, velocity[3]; } brush;

FIXTURE void push(void *user, const float *points, int count, float time, float *out)
{
    const brush *b = (const brush *)user;
    int i, k;
    (void)time;
    for (i = 0; i < count; i++) {
        float d2 = 0.0f, weight;
        for (k = 0; k < 3; k++) d2 += (points[3 * i + k] - b->center[k]) * (points[3 * i + k] - b->center[k]);
        weight = springls__max(1.0f - d2 / (b->radius * b->radius), 0.0f);
        for (k = 0; k < 3; k++) out[3 * i + k] = weight * weight * b->velocity[k];
    }
}

/* Bytes of all that a list of chunks holds. */
FIXTURE uint64_t hash_of(const springls_chunk *chunk, int count)
{
    uint64_t hash = 14695981039346656037u;
    int i;
    for (i = 0; i < count; i++, chunk++) {
        size_t floats = 3 * (size_t)chunk->vertex_count * sizeof(float);
        hash = springls__hash(hash, chunk->brick, sizeof chunk->brick);
        hash = springls__hash(hash, &chunk->vertex_count, sizeof chunk->vertex_count);
        if (chunk->triangle_count == 0) continue;
        hash = springls__hash(hash, chunk->positions, floats);
        hash = springls__hash(hash, chunk->normals, floats);
        if (chunk->correspondences) hash = springls__hash(hash, chunk->correspondences, floats);
        if (chunk->ids) hash = springls__hash(hash, chunk->ids, (size_t)chunk->vertex_count * sizeof *chunk->ids);
        hash = springls__hash(hash, chunk->triangles, 3 * (size_t)chunk->triangle_count * sizeof *chunk->triangles);
    }
    return hash;
}

#endif
