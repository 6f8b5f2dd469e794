/* histories.h - runs of models that together go through every stage, rule and input, and a hash of each: equal for every number of
   threads (test_determinism.c), every compiler and every optimisation level (portability/hashes.c). */
#ifndef HISTORIES_H
#define HISTORIES_H

#include "fixtures.h"

enum { HISTORY_FLUID, HISTORY_FLUID_PAPER, HISTORY_ELASTIC, HISTORY_ELASTIC_PAPER, HISTORY_MERGE, HISTORY_PRESERVED,
       HISTORY_OPEN_MESH, HISTORY_LABELS, HISTORIES };

FIXTURE const char *history_name(int history)
{
    static const char *const names[HISTORIES] = { "fluid", "fluid, paper", "elastic", "elastic, paper", "merge", "preserved, paper",
                                                  "open mesh", "labels" };
    return names[history];
}

FIXTURE uint64_t history_mix(uint64_t hash, const void *data, size_t bytes)
{
    const unsigned char *p = (const unsigned char *)data;
    for (; bytes > 0; bytes--) hash = (hash ^ *p++) * 1099511628211u;
    return hash;
}

FIXTURE uint64_t history_mix_mesh(uint64_t hash, const springls_mesh *mesh)
{
    const size_t vertices = (size_t)mesh->vertex_count;
    hash = history_mix(hash, mesh->positions, vertices * 3 * sizeof(float));
    hash = history_mix(hash, mesh->normals, vertices * 3 * sizeof(float));
    hash = history_mix(hash, mesh->correspondences, vertices * 3 * sizeof(float));
    hash = history_mix(hash, mesh->springls, vertices * sizeof(int));
    return history_mix(hash, mesh->triangles, (size_t)mesh->triangle_count * 3 * sizeof(int));
}

/* Returns a hash of the state, the mesh and the results of queries. */
FIXTURE uint64_t history_digest(springls_context *ctx)
{
    uint64_t hash = springls_state_hash(ctx);
    springls_mesh mesh;
    springls_measures measures;
    springls_params params;
    springls_hit hits[64];
    float points[3 * 64], distances[64];
    int i;
    fixture_seed(17);
    for (i = 0; i < 3 * 64; i++) points[i] = fixture_between(2.0f, 30.0f);
    if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) return 0;
    hash = history_mix_mesh(hash, &mesh);
    springls_mesh_free(ctx, &mesh);
    params = springls_get_params(ctx);
    params.contouring = SPRINGLS_CONTOURING_SPRINGLS;
    if (springls_set_params(ctx, &params) != SPRINGLS_OK || springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) return 0;
    hash = history_mix_mesh(hash, &mesh);
    springls_mesh_free(ctx, &mesh);
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    if (springls_set_params(ctx, &params) != SPRINGLS_OK) return 0;
    for (i = 0; i < 2; i++) {
        const springls_surface surface = i ? SPRINGLS_SURFACE_SOUP : SPRINGLS_SURFACE_WATERTIGHT;
        if (springls_closest(ctx, surface, points, 64, hits) != SPRINGLS_OK) return 0;
        hash = history_mix(hash, hits, sizeof hits);
        if (springls_raycast(ctx, surface, points, points + 3, 63, 0.0f, hits) != SPRINGLS_OK) return 0;
        hash = history_mix(hash, hits, 63 * sizeof *hits);
    }
    if (springls_sample_distance(ctx, points, 64, distances) != SPRINGLS_OK) return 0;
    hash = history_mix(hash, distances, sizeof distances);
    if (springls_measure(ctx, &measures) != SPRINGLS_OK) return 0;
    hash = history_mix(hash, &measures.volume, sizeof measures.volume);
    return history_mix(hash, &measures.euler, sizeof measures.euler);
}

/* ---- what moves the models ---- */

FIXTURE void history_inwards(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < count; i++) {
        out[3 * i] = points[3 * i] < 15.5f ? 0.45f : -0.45f;
        out[3 * i + 1] = 0.02f * (points[3 * i + 2] - 15.5f) * time;
        out[3 * i + 2] = 0.0f;
    }
}

/* Grows by a tenth a unit of time, and turns where it came from low x. */
FIXTURE void history_affine(void *user, const float *points, const float *correspondences, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)points;
    (void)time;
    memset(out, 0, (size_t)count * 12 * sizeof *out);
    for (i = 0; i < count; i++, out += 12) {
        float turn = correspondences[3 * i] < 14.0f ? 0.15f : 0.0f;
        out[0] = out[5] = out[10] = 0.1f;
        out[1] = -turn;
        out[4] = turn;
        out[3] = -1.55f + 15.5f * turn;
        out[7] = -1.55f - 15.5f * turn;
        out[11] = -1.55f;
    }
}

static float history_pressure_grid[32 * 32 * 32];

FIXTURE void history_two_balls(void *user, const float *points, int count, float *out)
{
    springls_sphere ball[2];
    springls_metasphere both;
    (void)user;
    ball[0] = fixture_ball(9.5f, 15.5f, 15.5f, 5.5f);
    ball[1] = fixture_ball(21.7f, 16.5f, 15.0f, 5.0f);
    both.spheres = ball;
    both.count = 2;
    springls_implicit_metasphere(&both, points, count, out);
}

/* A sphere's mesh of 8 n^2 triangles with every eleventh left out. */
FIXTURE springls_status history_open_mesh(springls_context *ctx)
{
    enum { N = 10 };
    static const float corner[6][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { -1, 0, 0 }, { 0, -1, 0 }, { 0, 0, 1 }, { 0, 0, -1 } };
    float positions[8 * N * N * 9];
    int triangles[8 * N * N * 3], face, i, j, k, c, count = 0;
    for (face = 0; face < 8; face++)
        for (i = 0; i < N; i++)
            for (j = 0; j < 2 * i + 1; j++) {
                int even = j % 2 == 0, at[3][2];
                if ((i * i + j + face) % 11 == 0) continue;
                at[0][0] = even ? i : i + 1; at[0][1] = even ? j / 2 : j / 2 + 1;
                at[1][0] = even ? i + 1 : i; at[1][1] = even ? j / 2 : j / 2 + 1;
                at[2][0] = even ? i + 1 : i; at[2][1] = even ? j / 2 + 1 : j / 2;
                for (k = 0; k < 3; k++) {
                    const float *a = corner[face & 4 ? 5 : 4], *b = corner[face & 3], *d = corner[((face & 3) + 1) & 3];
                    int turned = face & 4 ? 2 - k : k;
                    float u = (float)(N - at[turned][0]), w = (float)at[turned][1], v = (float)at[turned][0] - w, length, x[3];
                    for (c = 0; c < 3; c++) x[c] = u * a[c] + v * b[c] + w * d[c];
                    length = springls__sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
                    for (c = 0; c < 3; c++) positions[9 * count + 3 * k + c] = 15.5f + 8.0f * x[c] / length;
                    triangles[3 * count + k] = 3 * count + k;
                }
                count++;
            }
    return springls_set_mesh(ctx, positions, 3 * count, 0, triangles, count, NULL);
}

FIXTURE springls_status history_blobs(springls_context *ctx)
{
    static int32_t labels[32 * 32 * 32];
    int i;
    for (i = 0; i < 32 * 32 * 32; i++) {
        int x = i % 32 - 13, y = i / 32 % 32 - 15, z = i / 1024 - 16;
        labels[i] = x * x + 2 * y * y + z * z < 64 || (abs(x - 10) < 4 && abs(y) < 3 && abs(z) < 3) ? 7 : 3;
    }
    return springls_set_labels(ctx, labels, 7);
}

/* ---- their lives ---- */

FIXTURE springls_status history_begin(springls_context *ctx, int history, springls_sphere *ball)
{
    if (history == HISTORY_OPEN_MESH) return history_open_mesh(ctx);
    if (history == HISTORY_LABELS) return history_blobs(ctx);
    if (history == HISTORY_MERGE || history == HISTORY_PRESERVED) return springls_set_implicit(ctx, history_two_balls, NULL);
    return springls_set_implicit(ctx, springls_implicit_sphere, ball);
}

/* The digest of a model at the end of its life; 0 on failure. tasks NULL: no job system; backend NULL: scalar. */
FIXTURE uint64_t history_run(int history, const springls_tasks *tasks, springls_backend *backend)
{
    int paper = history == HISTORY_FLUID_PAPER || history == HISTORY_ELASTIC_PAPER || history == HISTORY_PRESERVED, i;
    springls_params p = paper ? springls_paper_params() : springls_default_params();
    springls_desc desc = fixture_desc(32, &p);
    springls_sphere ball = fixture_ball(12.0f, 12.0f, 12.0f, 6.0f);
    struct exact_flow whirl = EXACT_DEFORMATION(32.0f, 3.0f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &whirl);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.03f);
    springls_context *ctx = NULL;
    springls_status status;
    uint64_t digest;
    if (tasks) desc.tasks = *tasks;
    desc.backend = backend;
    if (history == HISTORY_ELASTIC || history == HISTORY_ELASTIC_PAPER) {
        step.mode = SPRINGLS_MODE_ELASTIC;
        step.dt = 0.1f;
    }
    if (history >= HISTORY_MERGE) {
        forces.velocity = history_inwards;
        step.dt = 1.0f;
    }
    if (history == HISTORY_MERGE) {
        for (i = 0; i < 32 * 32 * 32; i++) history_pressure_grid[i] = 0.002f * (float)(i % 32 + i / 1024 - 31);
        forces.pressure_grid.data = history_pressure_grid;
        forces.curvature_weight = 0.3f;
    }
    if (history == HISTORY_PRESERVED) {
        p.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        p.curvature = 0.1f;
        p.vertex_velocity = 1;
        step.stop_at_topology = true;
    }
    if (history == HISTORY_OPEN_MESH) {
        forces.velocity = NULL;
        forces.affine = history_affine;
        forces.integrator = SPRINGLS_INTEGRATOR_EULER;
        step.mode = SPRINGLS_MODE_ELASTIC;
    }
    if (history == HISTORY_LABELS) step.max_displacement = 0.3f;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return 0;
    status = history_begin(ctx, history, &ball);
    for (i = 0; i < (step.mode == SPRINGLS_MODE_ELASTIC ? 4 : 11) && status == SPRINGLS_OK; i++) status = springls_step(ctx, &step);
    digest = status == SPRINGLS_OK ? history_digest(ctx) : 0;
    springls_destroy(ctx);
    return digest;
}

#endif
