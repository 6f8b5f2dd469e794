/* every_call.h - each public call that returns a status, by its name, and models in several states to make it on: for tests that
   make something fail inside each call. */
#ifndef EVERY_CALL_H
#define EVERY_CALL_H

#include "fixtures.h"

enum { CALL_SIZE = 16, CALL_VOXELS = CALL_SIZE * CALL_SIZE * CALL_SIZE, CALL_POINTS = 4, CALL_SPRINGLS = 2000 };

/* The states: FRESH from an input; MOVED by so little that phi lags behind, with an attribute, components that keep their volume,
   kept springls and a window that has moved; MOVED with a step in progress; MOVED with an update of chunks in progress. */
enum { CALL_STATE_FRESH, CALL_STATE_MOVED, CALL_STATE_IN_STEP, CALL_STATE_IN_CHUNKS, CALL_STATES };

/* One ball as every kind of input, and memory that calls write to. */
typedef struct call_bench {
    springls_context *ctx, *other;
    springls_chunks *chunks;
    springls_desc desc;
    springls_sphere ball;
    springls_context *maker;        /* of the mesh */
    springls_mesh mesh;             /* of the ball */
    float *vertices;                /* of its triangles, as springls */
    float phi[CALL_VOXELS], values[CALL_VOXELS];
    int32_t labels[CALL_VOXELS];
    float points[3 * CALL_POINTS];
    uint8_t mask[CALL_SPRINGLS];
    void *snapshots[2];             /* of models that are fresh and that have moved */
    size_t sizes[2];
    float output[CALL_SPRINGLS * 16]; /* of a call, for each springl or vertex */
    springls_forces forces;
    springls_step_desc step;
    float wind[3];
} call_bench;

/* ---- the calls ---- */

#define CALL_OF(name, arguments) FIXTURE springls_status call_##name(call_bench *b) { return springls_##name arguments; }
#define STAGE_OF(name, stage) FIXTURE springls_status call_##name(call_bench *b) { return springls_run_stage(b->ctx, stage); }
/* A call that takes a mesh of the model as it is. */
#define CALL_OF_MESH(name, arguments)                                    \
    FIXTURE springls_status call_##name(call_bench *b)                   \
    {                                                                    \
        springls_mesh mesh;                                              \
        springls_status status = springls_extract_mesh(b->ctx, &mesh);   \
        if (status != SPRINGLS_OK) return status;                        \
        status = springls_##name arguments;                              \
        springls_mesh_free(b->ctx, &mesh);                               \
        return status;                                                   \
    }

FIXTURE springls_status call_create(call_bench *b)
{
    springls_context *ctx;
    springls_status status = springls_create(&b->desc, &ctx);
    springls_destroy(ctx);
    return status;
}

FIXTURE springls_status call_set_params(call_bench *b)
{
    springls_params params = springls_get_params(b->ctx);
    params.components = !params.components;
    return springls_set_params(b->ctx, &params);
}

CALL_OF(reset, (b->ctx))
/* An open mesh. */
CALL_OF(set_mesh, (b->ctx, b->mesh.positions, b->mesh.vertex_count, 0, b->mesh.triangles, b->mesh.triangle_count / 2, NULL))
CALL_OF(set_level_set, (b->ctx, b->phi))
CALL_OF(set_labels, (b->ctx, b->labels, 2))
CALL_OF(set_threshold, (b->ctx, b->phi, -100.0f, -1.0f))
CALL_OF(set_implicit, (b->ctx, springls_implicit_sphere, &b->ball))
CALL_OF(set_springls, (b->ctx, b->vertices, NULL, b->vertices, b->mesh.triangle_count))
CALL_OF(set_reference, (b->ctx))
CALL_OF(set_reference_mesh, (b->ctx, b->mesh.positions, b->mesh.vertex_count, 0, b->mesh.triangles, b->mesh.triangle_count, NULL))
CALL_OF(write, (b->ctx, 0, 1, b->vertices, NULL))
CALL_OF(set_keep_mask, (b->ctx, b->mask))
CALL_OF(max_speed, (b->ctx, &b->forces, 0.0f, b->output))
CALL_OF(advect, (b->ctx, &b->forces, 0.0f, 1.0f))
CALL_OF(run_stage, (b->ctx, SPRINGLS_STAGE_RELAX))
STAGE_OF(contract, SPRINGLS_STAGE_CONTRACT)
STAGE_OF(resample, SPRINGLS_STAGE_RESAMPLE)
STAGE_OF(evolve, SPRINGLS_STAGE_EVOLVE)
STAGE_OF(rebuild, SPRINGLS_STAGE_REBUILD)
STAGE_OF(fill_gaps, SPRINGLS_STAGE_FILL_GAPS)
STAGE_OF(unsigned_to_signed, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED)
STAGE_OF(track, SPRINGLS_STAGE_TRACK)
CALL_OF(step, (b->ctx, &b->step))
CALL_OF(step_begin, (b->ctx, &b->step))

FIXTURE springls_status call_step_continue(call_bench *b)
{
    bool done = false;
    springls_status status = SPRINGLS_OK;
    while (status == SPRINGLS_OK && !done) status = springls_step_continue(b->ctx, 0.0, &done);
    return status;
}

CALL_OF(run, (b->ctx, &b->step, 2))

FIXTURE springls_status call_snapshot(call_bench *b)
{
    size_t size;
    return springls_snapshot(b->ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size);
}

FIXTURE springls_status call_snapshot_delta(call_bench *b)
{
    size_t size;
    return springls_snapshot_delta(b->ctx, b->snapshots[0], b->sizes[0], b->snapshots[0], b->sizes[0], NULL, 0, &size);
}

FIXTURE springls_status call_snapshot_patch(call_bench *b)
{
    char delta[128];
    size_t size;
    SPRINGLS__TRY(springls_snapshot_delta(b->ctx, b->snapshots[0], b->sizes[0], b->snapshots[0], b->sizes[0], delta, sizeof delta, &size));
    return springls_snapshot_patch(b->ctx, b->snapshots[0], b->sizes[0], delta, size, NULL, 0, &size);
}

FIXTURE springls_status call_restore(call_bench *b) { return springls_restore(b->ctx, b->snapshots[0], b->sizes[0]); }

CALL_OF(pack_matrix, (b->ctx, b->output))
CALL_OF(extract_surfels, (b->ctx, b->output))

FIXTURE springls_status call_components(call_bench *b)
{
    const springls_component *components;
    int count;
    return springls_components(b->ctx, &components, &count);
}

CALL_OF(component_of, (b->ctx, b->points, CALL_POINTS, (uint32_t *)(void *)b->output))

FIXTURE springls_status call_events(call_bench *b)
{
    const springls_event *events;
    int count;
    return springls_events(b->ctx, &events, &count);
}

FIXTURE springls_status call_extract_mesh(call_bench *b)
{
    springls_mesh mesh;
    springls_status status = springls_extract_mesh(b->ctx, &mesh);
    springls_mesh_free(b->ctx, &mesh);
    return status;
}

FIXTURE springls_status call_extract_soup(call_bench *b)
{
    springls_mesh mesh;
    springls_status status = springls_extract_soup(b->ctx, &mesh);
    springls_mesh_free(b->ctx, &mesh);
    return status;
}

FIXTURE springls_status call_chunks_create(call_bench *b)
{
    springls_chunks *chunks;
    springls_status status = springls_chunks_create(b->ctx, NULL, &chunks);
    springls_chunks_destroy(b->ctx, chunks);
    return status;
}

/* Creates the bench's chunks, if they do not exist. */
FIXTURE springls_status call_need_chunks(call_bench *b)
{
    springls_chunks_desc desc = { .correspondences = true };
    return b->chunks ? SPRINGLS_OK : springls_chunks_create(b->ctx, &desc, &b->chunks);
}

FIXTURE springls_status call_chunks_update(call_bench *b)
{
    const springls_chunk *changed;
    int count;
    springls_status status = call_need_chunks(b);
    return status == SPRINGLS_OK ? springls_chunks_update(b->ctx, b->chunks, &changed, &count) : status;
}

FIXTURE springls_status call_chunks_begin(call_bench *b)
{
    springls_status status = call_need_chunks(b);
    return status == SPRINGLS_OK ? springls_chunks_begin(b->ctx, b->chunks) : status;
}

FIXTURE springls_status call_chunks_continue(call_bench *b)
{
    const springls_chunk *changed;
    int count;
    bool done = false;
    springls_status status = call_chunks_begin(b);
    while (status == SPRINGLS_OK && !done) status = springls_chunks_continue(b->ctx, b->chunks, 0.0, &changed, &count, &done);
    return status;
}

CALL_OF(copy_level_set, (b->ctx, b->values))
CALL_OF(sample_distance, (b->ctx, b->points, CALL_POINTS, b->output))
CALL_OF(sample_gradient, (b->ctx, b->points, CALL_POINTS, b->output))
CALL_OF(sample_inside, (b->ctx, b->points, CALL_POINTS, (uint8_t *)(void *)b->output))

FIXTURE springls_status call_closest(call_bench *b)
{
    springls_hit hits[CALL_POINTS];
    springls_status status = springls_closest(b->ctx, SPRINGLS_SURFACE_WATERTIGHT, b->points, CALL_POINTS, hits);
    return status == SPRINGLS_OK ? springls_closest(b->ctx, SPRINGLS_SURFACE_SOUP, b->points, CALL_POINTS, hits) : status;
}

FIXTURE springls_status call_raycast(call_bench *b)
{
    springls_hit hits[CALL_POINTS];
    springls_status status = springls_raycast(b->ctx, SPRINGLS_SURFACE_WATERTIGHT, b->points, b->points, CALL_POINTS, 0.0f, hits);
    if (status != SPRINGLS_OK) return status;
    return springls_raycast(b->ctx, SPRINGLS_SURFACE_SOUP, b->points, b->points, CALL_POINTS, 0.0f, hits);
}

FIXTURE springls_status call_add_attribute(call_bench *b)
{
    springls_attribute_desc desc = { "heat", 2, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_SHARE };
    return springls_add_attribute(b->ctx, &desc, b->vertices, NULL);
}

FIXTURE springls_status call_describe_attribute(call_bench *b)
{
    springls_attribute_desc desc;
    return springls_describe_attribute(b->ctx, 0, &desc);
}

CALL_OF(remove_attribute, (b->ctx, 0))
CALL_OF(set_attribute, (b->ctx, 0, b->vertices))
CALL_OF_MESH(mesh_attribute, (b->ctx, &mesh, 0, b->output))

FIXTURE springls_status call_chunks_lod(call_bench *b)
{
    const springls_chunk *changed;
    springls_lod lod;
    int count;
    springls_status status = call_need_chunks(b);
    if (status == SPRINGLS_OK) status = springls_chunks_update(b->ctx, b->chunks, &changed, &count);
    if (status != SPRINGLS_OK || count == 0 || changed[0].triangle_count == 0) return status;
    memset(&lod, 0, sizeof lod);
    lod.chunk = &changed[0];
    lod.level = 2;
    lod.neighbors[1] = 3;
    lod.triangles = (uint16_t *)(void *)b->output;
    return springls_chunks_lod(b->ctx, &lod, 1);
}

FIXTURE springls_status call_chunk_attribute(call_bench *b)
{
    const springls_chunk *changed;
    int count;
    springls_status status = call_need_chunks(b);
    if (status == SPRINGLS_OK) status = springls_chunks_update(b->ctx, b->chunks, &changed, &count);
    if (status != SPRINGLS_OK || count == 0) return status;
    return springls_chunk_attribute(b->ctx, changed, 0, b->output);
}

CALL_OF(get_provenance, (b->ctx, (springls_provenance *)(void *)b->output))
CALL_OF(springl_errors, (b->ctx, (springls_error_estimate *)(void *)b->output))
CALL_OF_MESH(mesh_errors, (b->ctx, &mesh, (springls_error_estimate *)(void *)b->output))
CALL_OF(springl_materials, (b->ctx, (springls_material *)(void *)b->output))
CALL_OF_MESH(mesh_materials, (b->ctx, &mesh, (springls_material *)(void *)b->output))

FIXTURE springls_status call_corner_materials(call_bench *b)
{
    size_t n = (size_t)springls_material_triangle_count(b->ctx);
    int *neighbors = (int *)malloc((3 * n + 1) * sizeof *neighbors);
    springls_mesh mesh;
    springls_status status;
    memset(neighbors, -1, 3 * n * sizeof *neighbors);
    status = springls_extract_mesh(b->ctx, &mesh);
    if (status == SPRINGLS_OK) status = springls_corner_materials(b->ctx, &mesh, neighbors, (springls_material *)(void *)b->output);
    springls_mesh_free(b->ctx, &mesh);
    free(neighbors);
    return status;
}

CALL_OF(find_seams, (b->ctx, b->mesh.positions, b->mesh.vertex_count, 0, b->mesh.triangles, b->mesh.triangle_count, NULL, 0,
                     (int *)(void *)b->output))

FIXTURE springls_status call_interpolate_material(call_bench *b)
{
    springls_material place = { 0, { 0.2f, 0.3f, 0.5f } };
    return springls_interpolate_material(&place, 1, b->vertices, 3, NULL, b->mesh.triangle_count, b->output);
}

CALL_OF(combine, (b->ctx, SPRINGLS_OPERATION_UNION, b->other))
CALL_OF(combine_implicit, (b->ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &b->ball))
CALL_OF(combine_begin, (b->ctx, SPRINGLS_OPERATION_UNION, b->other))
CALL_OF(combine_implicit_begin, (b->ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &b->ball))

FIXTURE springls_status call_combine_continue(call_bench *b)
{
    bool done = false;
    springls_status status = springls_combine_begin(b->ctx, SPRINGLS_OPERATION_UNION, b->other);
    while (status == SPRINGLS_OK && !done) status = springls_combine_continue(b->ctx, 0.0, &done);
    return status;
}
FIXTURE springls_status call_follow_level_set(call_bench *b)
{
    springls_follow_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.fn = springls_implicit_sphere;
    desc.user = &b->ball;
    return springls_follow_level_set(b->ctx, &desc);
}

CALL_OF(offset, (b->ctx, 0.7f))
CALL_OF(smooth, (b->ctx, 0.7f, true))
CALL_OF(remesh, (b->ctx))

FIXTURE springls_status call_measure(call_bench *b)
{
    springls_measures measures;
    return springls_measure(b->ctx, &measures);
}

CALL_OF(settle, (b->ctx, 1))

FIXTURE springls_status call_place_now(call_bench *b)
{
    springls_material_place places[CALL_POINTS];
    return springls_place_now(b->ctx, b->points, CALL_POINTS, places);
}

FIXTURE springls_status call_index_of(call_bench *b)
{
    const uint32_t ids[2] = { 0u, 3u };
    int index[2];
    return springls_index_of(b->ctx, ids, 2, index);
}

/* Every public call that returns a status: X(name, 1 if it never changes the model, even when phi lags behind). */
#define EVERY_CALL(X) \
    X(create, 1) X(reset, 0) X(set_params, 1) X(set_mesh, 0) X(set_level_set, 0) X(set_labels, 0) X(set_threshold, 0) X(set_implicit, 0) \
    X(set_springls, 0) X(set_reference, 0) X(set_reference_mesh, 0) X(write, 0) X(set_keep_mask, 0) X(max_speed, 1) X(advect, 0) \
    X(run_stage, 0) X(contract, 0) X(resample, 0) X(evolve, 0) X(rebuild, 0) X(fill_gaps, 0) X(unsigned_to_signed, 0) X(track, 0) \
    X(step, 0) X(step_begin, 0) X(step_continue, 0) X(run, 0) X(snapshot, 1) X(restore, 0) X(snapshot_delta, 1) X(snapshot_patch, 1) \
    X(index_of, 1) X(place_now, 1) X(settle, 0) X(pack_matrix, 1) X(extract_surfels, 1) X(components, 0) X(component_of, 0) X(events, 0) \
    X(extract_mesh, 1) X(extract_soup, 1) X(chunks_create, 1) X(chunks_update, 1) X(chunks_begin, 1) X(chunks_continue, 1) \
    X(chunks_lod, 1) X(copy_level_set, 1) X(sample_distance, 1) X(sample_gradient, 1) X(sample_inside, 1) X(closest, 1) X(raycast, 1) \
    X(add_attribute, 1) X(describe_attribute, 1) X(remove_attribute, 1) X(set_attribute, 1) X(mesh_attribute, 1) X(chunk_attribute, 1) \
    X(get_provenance, 1) X(springl_errors, 1) X(mesh_errors, 1) X(springl_materials, 1) X(mesh_materials, 1) X(corner_materials, 1) \
    X(find_seams, 1) X(interpolate_material, 1) X(combine, 0) X(combine_implicit, 0) X(combine_begin, 0) X(combine_implicit_begin, 0) \
    X(combine_continue, 0) X(follow_level_set, 0) X(offset, 0) X(smooth, 0) X(remesh, 0) X(measure, 1)

#define CALL_NUMBER(name, reads) CALL_##name,
enum { EVERY_CALL(CALL_NUMBER) CALLS };
#define CALL_ROW(name, reads) { "springls_" #name, call_##name, reads },
typedef struct call_row { const char *name; springls_status (*run)(call_bench *b); int reads; } call_row;
static const call_row every_call[CALLS] = { EVERY_CALL(CALL_ROW) };

/* ---- the states ---- */

FIXTURE springls_status call_make_contexts(call_bench *b)
{
    springls_status status = springls_create(&b->desc, &b->ctx);
    b->chunks = NULL;
    b->other = NULL;
    return status == SPRINGLS_OK ? springls_create(&b->desc, &b->other) : status;
}

FIXTURE void call_end(call_bench *b)
{
    springls_chunks_destroy(b->ctx, b->chunks);
    springls_destroy(b->ctx);
    springls_destroy(b->other);
    b->chunks = NULL;
    b->ctx = b->other = NULL;
}

/* Makes the model of CALL_STATE_MOVED: moves it by a brick, and then by a step that phi does not follow. */
FIXTURE springls_status call_move(call_bench *b)
{
    springls_attribute_desc desc = { "mass", 1, SPRINGLS_POLICY_SHARE, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_COPY };
    springls_step_desc long_step = b->step, lazy_step = b->step;
    springls_params params = springls_get_params(b->ctx);
    springls_status status;
    long_step.dt = 8.0f;
    long_step.max_displacement = 2.0f;
    lazy_step.dt = 0.3f;
    params.volume_lock = 1;
    params.components = 1;
    status = springls_set_implicit(b->ctx, springls_implicit_sphere, &b->ball);
    if (status == SPRINGLS_OK) status = springls_step(b->ctx, &long_step);
    if (status == SPRINGLS_OK) status = springls_step(b->ctx, &lazy_step);
    if (status == SPRINGLS_OK) status = springls_set_params(b->ctx, &params);
    if (status == SPRINGLS_OK) status = springls_add_attribute(b->ctx, &desc, NULL, NULL);
    if (status == SPRINGLS_OK) status = springls_set_keep_mask(b->ctx, b->mask);
    return status;
}

FIXTURE springls_status call_take_snapshot(call_bench *b, int which)
{
    springls_status status = springls_snapshot(b->ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &b->sizes[which]);
    if (status != SPRINGLS_OK) return status;
    b->snapshots[which] = malloc(b->sizes[which]);
    return springls_snapshot(b->ctx, SPRINGLS_SNAPSHOT_KIND_ALL, b->snapshots[which], b->sizes[which], &b->sizes[which]);
}

/* Makes what the calls work on; to be freed by call_bench_free. */
FIXTURE springls_status call_bench_make(call_bench *b)
{
    springls_status status;
    int i, k;
    memset(b, 0, sizeof *b);
    b->desc = fixture_desc(CALL_SIZE, NULL);
    b->desc.follow = true;
    b->ball = fixture_ball(6.5f, 7.5f, 7.5f, 2.8f);
    b->wind[0] = 0.6f;
    b->wind[1] = 0.2f;
    b->forces = fixture_forces(fixture_wind, b->wind);
    b->step = fixture_step(&b->forces, SPRINGLS_MODE_FLUID, 1.0f);
    for (i = 0; i < CALL_SPRINGLS; i++) b->mask[i] = i % 16 == 0;
    for (i = 0; i < 3 * CALL_POINTS; i++) b->points[i] = (float)(3 + i);
    for (i = 0; i < CALL_VOXELS; i++) {
        d3 x = d3_make(i % CALL_SIZE, i / CALL_SIZE % CALL_SIZE, i / (CALL_SIZE * CALL_SIZE));
        b->phi[i] = (float)(d3_distance(x, d3_make(6.5, 7.5, 7.5)) - 2.8);
        b->labels[i] = b->phi[i] < 0.0f ? 2 : 0;
    }
    status = springls_create(&b->desc, &b->maker);
    if (status == SPRINGLS_OK) status = springls_set_implicit(b->maker, springls_implicit_sphere, &b->ball);
    if (status == SPRINGLS_OK) status = springls_extract_mesh(b->maker, &b->mesh);
    if (status != SPRINGLS_OK) return status;
    b->vertices = (float *)malloc((size_t)b->mesh.triangle_count * 9 * sizeof *b->vertices);
    for (i = 0; i < 3 * b->mesh.triangle_count; i++)
        for (k = 0; k < 3; k++) b->vertices[3 * i + k] = b->mesh.positions[3 * b->mesh.triangles[i] + k];
    b->ctx = b->maker;
    status = call_take_snapshot(b, 0);
    if (status == SPRINGLS_OK) status = call_move(b);
    if (status == SPRINGLS_OK) status = call_take_snapshot(b, 1);
    b->ctx = NULL;
    return status;
}

FIXTURE void call_bench_free(call_bench *b)
{
    springls_mesh_free(b->maker, &b->mesh);
    springls_destroy(b->maker);
    free(b->vertices);
    free(b->snapshots[0]);
    free(b->snapshots[1]);
}

/* Brings a new context into a state. */
FIXTURE springls_status call_begin(call_bench *b, int state)
{
    const int which = state != CALL_STATE_FRESH;
    springls_status status = call_make_contexts(b);
    bool done = false;
    const springls_chunk *changed;
    int i, count;
    if (status == SPRINGLS_OK) status = springls_restore(b->ctx, b->snapshots[which], b->sizes[which]);
    if (status == SPRINGLS_OK) status = springls_restore(b->other, b->snapshots[1], b->sizes[1]);
    if (state == CALL_STATE_IN_STEP && status == SPRINGLS_OK) {
        springls_step_desc step = b->step;
        step.dt = 4.0f; /* phi follows */
        status = springls_step_begin(b->ctx, &step);
        for (i = 0; i < 5 && status == SPRINGLS_OK; i++) status = springls_step_continue(b->ctx, 0.0, &done);
    }
    if (state == CALL_STATE_IN_CHUNKS && status == SPRINGLS_OK) {
        status = call_chunks_begin(b);
        for (i = 0; i < 2 && status == SPRINGLS_OK; i++)
            status = springls_chunks_continue(b->ctx, b->chunks, 0.0, &changed, &count, &done);
    }
    return status;
}

/* Runs a test for every call; the test gets the row of the call and the bench. */
#define RUN_EVERY_CALL(test)                                          \
    do {                                                              \
        static call_bench bench;                                      \
        int call;                                                     \
        if (call_bench_make(&bench) != SPRINGLS_OK) abort();          \
        for (call = 0; call < CALLS; call++) {                        \
            greatest_set_test_suffix(every_call[call].name);          \
            RUN_TESTp(test, &every_call[call], &bench);               \
        }                                                             \
        call_bench_free(&bench);                                      \
    } while (0)

#endif
