/* fuzz_calls.c - any public calls in any order, with numbers and sizes in and out of range, and allocations that fail now and then:
   each returns a status, and after a failure a sentence, the model keeps its invariants, and nothing leaks. */
#include "fuzz.h"

#ifndef SMALL_MODELS /* fuzz_small_calls.c has them */
enum { MOST_CALLS = 24, MOST_SUB_STEPS = 8, MOST_CHANGES = 4, MOST_SIDE = 24, MOST_SPRINGLS = 2000 };
#endif

/* What the calls work on. */
typedef struct bench {
    fuzz_bytes b;
    springls_context *ctx, *other; /* the model, and one to combine it with */
    springls_chunks *chunks;
    fixture_heap heap, other_heap;
    fixture_workers workers;
    springls_grid_desc grid;
    float voxels[MOST_SIDE * MOST_SIDE * MOST_SIDE];
    int reports_left;              /* progress is cancelled after these */
    int memory_fails;              /* an allocation of this call may fail */
    float wind[3];
} bench;

static int report_progress(void *user, float fraction)
{
    bench *t = (bench *)user;
    FUZZ_CHECK(fraction >= 0.0f && fraction <= 1.0f);
    return t->reports_left-- <= 0;
}

static int voxel_count(const bench *t) { return t->grid.size[0] * t->grid.size[1] * t->grid.size[2]; }

/* ---- inputs ---- */

static springls_sphere any_ball(bench *t)
{
    float side = (float)t->grid.size[0];
    float x = fuzz_float(&t->b, 0.0f, side), y = fuzz_float(&t->b, 0.0f, side), z = fuzz_float(&t->b, 0.0f, side);
    return fixture_ball(x, y, z, fuzz_float(&t->b, 0.0f, 0.5f * side));
}

static springls_status set_shape(bench *t)
{
    springls_sphere ball = any_ball(t);
    springls_box box;
    springls_torus torus;
    int k;
    switch (fuzz_choice(&t->b, 3)) {
    case 0: return springls_set_implicit(t->ctx, springls_implicit_sphere, &ball);
    case 1:
        for (k = 0; k < 3; k++) {
            box.center[k] = ball.center[k];
            box.half[k] = fuzz_float(&t->b, 0.0f, 8.0f);
        }
        return springls_set_implicit(t->ctx, springls_implicit_box, &box);
    default:
        for (k = 0; k < 3; k++) {
            torus.center[k] = ball.center[k];
            torus.axis[k] = fuzz_float(&t->b, -1.0f, 1.0f);
        }
        torus.major = ball.radius;
        torus.minor = fuzz_float(&t->b, 0.0f, 4.0f);
        return springls_set_implicit(t->ctx, springls_implicit_torus, &torus);
    }
}

/* Fills the volume with 32 values of the input, each in a run of voxels, repeated. */
static void fill_voxels(bench *t)
{
    float values[32];
    int i, n = voxel_count(t), repeat = 1 + fuzz_choice(&t->b, 200);
    for (i = 0; i < 32; i++) values[i] = fuzz_float(&t->b, -4.0f, 4.0f);
    for (i = 0; i < n; i++) t->voxels[i] = values[i / repeat % 32];
}

static springls_status set_volume(bench *t)
{
    int32_t labels[MOST_SIDE * MOST_SIDE * MOST_SIDE];
    int i, n = voxel_count(t), kind = fuzz_choice(&t->b, 3);
    float low = fuzz_float(&t->b, -4.0f, 4.0f), high = fuzz_float(&t->b, -4.0f, 4.0f);
    fill_voxels(t);
    if (kind == 0) return springls_set_level_set(t->ctx, t->voxels);
    if (kind == 1) return springls_set_threshold(t->ctx, t->voxels, low, high);
    for (i = 0; i < n; i++) labels[i] = t->voxels[i] > 0.0f && t->voxels[i] < 100.0f ? (int32_t)t->voxels[i] : 0;
    return springls_set_labels(t->ctx, labels, fuzz_choice(&t->b, 5) - 1);
}

/* Sets a new model from the present springls, some numbers of which are changed. */
static springls_status set_springls(bench *t)
{
    int i, k, n = springls_count(t->ctx);
    springls_view vertices = springls_view_vertices(t->ctx);
    float *copy = (float *)malloc(((size_t)n * 9 + 9) * sizeof *copy);
    springls_status status;
    for (i = 0; i < n; i++) memcpy(copy + 9 * i, (const char *)vertices.data + (size_t)i * vertices.stride, 9 * sizeof *copy);
    for (k = 0; n && k < MOST_CHANGES; k++) {
        uint32_t at = fuzz_word(&t->b) % ((uint32_t)n * 9u);
        copy[at] = fuzz_float(&t->b, -2.0f, (float)MOST_SIDE);
    }
    status = springls_set_springls(t->ctx, copy, NULL, NULL, n - fuzz_choice(&t->b, 2));
    free(copy);
    return status;
}

static springls_status write_springls(bench *t)
{
    float values[16 * 12];
    int i, first = (int)(fuzz_word(&t->b) % (uint32_t)(springls_count(t->ctx) + 2)), count = fuzz_choice(&t->b, 16);
    int which = fuzz_choice(&t->b, 4);
    for (i = 0; i < 16 * 12; i++) values[i] = fuzz_float(&t->b, -2.0f, (float)MOST_SIDE);
    return springls_write(t->ctx, first, count, which & 1 ? NULL : values, which & 2 ? NULL : values + 16 * 9);
}

static springls_status set_reference(bench *t)
{
    springls_mesh mesh;
    springls_status status;
    if (fuzz_choice(&t->b, 2)) return springls_set_reference(t->ctx);
    status = springls_extract_mesh(t->ctx, &mesh);
    if (status != SPRINGLS_OK) return status;
    status = springls_set_reference_mesh(t->ctx, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL);
    springls_mesh_free(t->ctx, &mesh);
    return status;
}

/* ---- motion ---- */

static springls_forces any_forces(bench *t)
{
    springls_forces forces = fixture_forces(fuzz_choice(&t->b, 4) ? fixture_wind : NULL, t->wind);
    int k;
    for (k = 0; k < 3; k++) t->wind[k] = fuzz_float(&t->b, -2.0f, 2.0f);
    if (fuzz_choice(&t->b, 4) == 0) forces.curvature_weight = fuzz_float(&t->b, -0.2f, 0.5f);
    if (fuzz_choice(&t->b, 4) == 0) forces.velocity_weight = fuzz_float(&t->b, -2.0f, 2.0f);
    forces.integrator = fuzz_choice(&t->b, 4) ? SPRINGLS_INTEGRATOR_RK4 : SPRINGLS_INTEGRATOR_EULER;
    forces.voxel_units = fuzz_choice(&t->b, 8) != 0;
    if (fuzz_choice(&t->b, 4) == 0)
        for (k = 0; k < 3; k++) {
            forces.region_lower[k] = fuzz_float(&t->b, 0.0f, (float)MOST_SIDE);
            forces.region_upper[k] = fuzz_float(&t->b, 0.0f, (float)MOST_SIDE);
        }
    return forces;
}

/* Returns a step of at most MOST_SUB_STEPS sub-steps, unless a number is critical (fuzz_float). */
static springls_step_desc any_step(bench *t, const springls_forces *forces)
{
    springls_mode mode = (springls_mode)fuzz_choice(&t->b, 3);
    springls_step_desc step = fixture_step(forces, mode, fuzz_float(&t->b, 0.0f, 2.0f));
    float displacement = fabsf(step.dt) * 2.0f * sqrtf(3.0f) * 2.0f; /* the largest that any_forces can make */
    step.max_displacement = fuzz_choice(&t->b, 4) ? displacement / MOST_SUB_STEPS + 0.5f : -1.0f;
    if (fuzz_choice(&t->b, 16) == 0) step.max_displacement = fuzz_float(&t->b, 0.3f, 3.0f);
    step.one_to_one = fuzz_choice(&t->b, 6) == 0;
    step.stop_at_topology = fuzz_choice(&t->b, 6) == 0;
    step.stop_at_rest = fuzz_choice(&t->b, 6) == 0;
    return step;
}

static springls_status move(bench *t)
{
    springls_forces forces = any_forces(t);
    springls_step_desc step = any_step(t, &forces);
    springls_status status = SPRINGLS_OK;
    bool done = false;
    int k, pieces;
    float speed;
    switch (fuzz_choice(&t->b, 5)) {
    case 0: return springls_run(t->ctx, &step, fuzz_choice(&t->b, 4));
    case 1: return springls_advect(t->ctx, &forces, fuzz_float(&t->b, 0.0f, 1.0f), step.dt);
    case 2: return springls_max_speed(t->ctx, &forces, fuzz_float(&t->b, 0.0f, 1.0f), &speed);
    case 3:
        status = springls_step_begin(t->ctx, &step);
        pieces = fuzz_choice(&t->b, 256);
        for (k = 0; k < pieces && status == SPRINGLS_OK && !done; k++) status = springls_step_continue(t->ctx, 0.0, &done);
        return status;
    default: return springls_step(t->ctx, &step);
    }
}

static springls_status stage(bench *t)
{
    const int stage = fuzz_choice(&t->b, SPRINGLS_STAGE_COUNT + 2);
    if (stage == SPRINGLS_STAGE_COUNT) return springls_remesh(t->ctx);
    if (stage > SPRINGLS_STAGE_COUNT) return springls_reset(t->ctx);
    return springls_run_stage(t->ctx, (springls_stage)stage);
}

/* ---- settings ---- */

/* Changes members of the parameters, which have four bytes each. Numbers of iterations stay small. */
static springls_status set_params(bench *t)
{
    springls_params params = springls_get_params(t->ctx);
    int k, from = fuzz_choice(&t->b, 4), changes = fuzz_choice(&t->b, MOST_CHANGES);
    if (from == 2) params = springls_default_params();
    if (from == 3) params = springls_paper_params();
    for (k = 0; k < changes; k++) {
        size_t at = 4 * (size_t)fuzz_choice(&t->b, (int)(sizeof params / 4));
        float number = fuzz_float(&t->b, -1.0f, 8.0f);
        int32_t whole = fuzz_choice(&t->b, 16) - 1;
        if (fuzz_choice(&t->b, 2)) memcpy((char *)&params + at, &number, 4);
        else memcpy((char *)&params + at, &whole, 4);
    }
    if (params.relax_iterations > 20) params.relax_iterations = 20;
    if (params.track_iterations > 20) params.track_iterations = 20;
    if (params.evolve_iterations > 10) params.evolve_iterations = 10;
    return springls_set_params(t->ctx, &params);
}

static springls_status set_keep_mask(bench *t)
{
    int i, n = springls_count(t->ctx), every = 1 + fuzz_choice(&t->b, 5);
    uint8_t *mask = (uint8_t *)malloc((size_t)n + 1);
    springls_status status;
    for (i = 0; i < n; i++) mask[i] = i % every == 0;
    status = springls_set_keep_mask(t->ctx, fuzz_choice(&t->b, 4) ? mask : NULL);
    free(mask);
    return status;
}

static springls_status attribute(bench *t)
{
    static const char *const names[] = { "a", "color", "mass", "", "a name that is longer than names can be" };
    springls_attribute_desc desc;
    int index = fuzz_choice(&t->b, 4) - 1;
    desc.name = names[fuzz_choice(&t->b, 5)];
    desc.channels = fuzz_choice(&t->b, 6);
    desc.split = (springls_policy)fuzz_choice(&t->b, 4);
    desc.fill = (springls_policy)fuzz_choice(&t->b, 3);
    desc.merge = (springls_policy)fuzz_choice(&t->b, 3);
    switch (fuzz_choice(&t->b, 5)) {
    case 0: return springls_remove_attribute(t->ctx, index);
    case 1: return springls_set_attribute(t->ctx, index, NULL);
    case 2: return springls_describe_attribute(t->ctx, index, &desc);
    default:
        FUZZ_CHECK(springls_find_attribute(t->ctx, desc.name) < springls_attribute_count(t->ctx));
        return springls_add_attribute(t->ctx, &desc, NULL, &index);
    }
}

/* ---- tools ---- */

static springls_status combine(bench *t)
{
    springls_operation operation = (springls_operation)fuzz_choice(&t->b, 4);
    springls_sphere ball = any_ball(t);
    springls_status status;
    if (fuzz_choice(&t->b, 2)) return springls_combine_implicit(t->ctx, operation, springls_implicit_sphere, &ball);
    status = springls_set_implicit(t->other, springls_implicit_sphere, &ball);
    if (status != SPRINGLS_OK) return SPRINGLS_OK;
    status = springls_combine(t->ctx, operation, t->other);
    fuzz_check_springls(t->other);
    return status;
}

static springls_status remodel(bench *t)
{
    bool keep_volume = fuzz_choice(&t->b, 2) != 0;
    if (fuzz_choice(&t->b, 2)) return springls_offset(t->ctx, fuzz_float(&t->b, -3.0f, 3.0f));
    return springls_smooth(t->ctx, fuzz_float(&t->b, 0.0f, 2.0f), keep_volume);
}

/* Restores the model from its own snapshot; one in sixteen is cut short. */
static springls_status restore(bench *t)
{
    springls_snapshot_kind kind = (springls_snapshot_kind)fuzz_choice(&t->b, 3);
    size_t size;
    void *bytes;
    uint64_t hash;
    springls_status status = springls_snapshot(t->ctx, kind, NULL, 0, &size);
    if (status != SPRINGLS_OK) return status;
    bytes = malloc(size);
    status = springls_snapshot(t->ctx, kind, bytes, size, &size);
    hash = springls_state_hash(t->ctx);
    if (status == SPRINGLS_OK) status = springls_restore(t->ctx, bytes, size - (fuzz_choice(&t->b, 16) == 0));
    FUZZ_CHECK(springls_state_hash(t->ctx) == hash);
    free(bytes);
    return status;
}

/* ---- queries ---- */

static springls_status query(bench *t)
{
    float points[3 * 8], directions[3 * 8], values[3 * 8];
    uint8_t inside[8];
    uint32_t ids[8];
    springls_hit hits[8];
    springls_surface surface = (springls_surface)fuzz_choice(&t->b, 3);
    int i, k, count = fuzz_choice(&t->b, 9);
    for (i = 0; i < 3 * 8; i++) points[i] = fuzz_float(&t->b, -4.0f, (float)MOST_SIDE + 4.0f);
    for (i = 0; i < 3 * 8; i++) directions[i] = fuzz_float(&t->b, -1.0f, 1.0f);
    switch (fuzz_choice(&t->b, 6)) {
    case 0: return springls_sample_distance(t->ctx, points, count, values);
    case 1: return springls_sample_gradient(t->ctx, points, count, values);
    case 2: return springls_sample_inside(t->ctx, points, count, inside);
    case 3: return springls_component_of(t->ctx, points, count, ids);
    case 4: {
        springls_status status = springls_closest(t->ctx, surface, points, count, hits);
        for (i = 0; status == SPRINGLS_OK && i < count; i++)
            FUZZ_CHECK(hits[i].springl < springls_count(t->ctx) && hits[i].distance >= 0.0f);
        return status;
    }
    default: {
        float reach = fuzz_float(&t->b, 0.0f, 40.0f);
        springls_status status = springls_raycast(t->ctx, surface, points, directions, count, reach, hits);
        for (i = 0; status == SPRINGLS_OK && i < count; i++)
            for (k = 0; hits[i].springl >= 0 && k < 3; k++) FUZZ_CHECK(fabsf(hits[i].normal[k]) < 1.1f);
        return status;
    }
    }
}

static springls_status chunks(bench *t)
{
    const springls_chunk *changed;
    springls_chunks_desc desc;
    springls_status status;
    int k, count;
    bool done = false;
    if (!t->chunks) {
        desc.tolerance = fuzz_float(&t->b, -0.1f, 0.5f);
        desc.correspondences = fuzz_choice(&t->b, 2);
        desc.zero_level = false;
        return springls_chunks_create(t->ctx, &desc, &t->chunks);
    }
    switch (fuzz_choice(&t->b, 4)) {
    case 0:
        springls_chunks_destroy(t->ctx, t->chunks);
        t->chunks = NULL;
        return SPRINGLS_OK;
    case 1: return springls_chunks_update(t->ctx, t->chunks, &changed, &count);
    case 2: return springls_chunks_begin(t->ctx, t->chunks);
    default:
        status = SPRINGLS_OK;
        for (k = fuzz_choice(&t->b, 20); k >= 0 && status == SPRINGLS_OK && !done; k--)
            status = springls_chunks_continue(t->ctx, t->chunks, 0.0, &changed, &count, &done);
        return status;
    }
}

static springls_status events(bench *t)
{
    const springls_component *components;
    const springls_event *list;
    springls_status status;
    int count, i, k;
    status = springls_components(t->ctx, &components, &count);
    for (i = 1; status == SPRINGLS_OK && i < count; i++) FUZZ_CHECK(components[i - 1].id < components[i].id);
    if (status != SPRINGLS_OK) return status;
    status = springls_events(t->ctx, &list, &count);
    for (i = 0; status == SPRINGLS_OK && i < count; i++)
        for (k = 0; k < 3; k++) FUZZ_CHECK(fabsf(list[i].place[k]) < 1e12f);
    return status;
}

static springls_status read_out(bench *t)
{
    size_t n = (size_t)springls_count(t->ctx) + 1;
    void *memory = malloc(64 * n);
    springls_mesh mesh;
    springls_status status;
    memset(&mesh, 0, sizeof mesh);
    switch (fuzz_choice(&t->b, 7)) {
    case 0: status = springls_extract_soup(t->ctx, &mesh); break;
    case 1: status = springls_extract_mesh(t->ctx, &mesh); break;
    case 2: status = springls_extract_surfels(t->ctx, (float *)memory); break;
    case 3: status = springls_pack_matrix(t->ctx, (float *)memory); break;
    case 4: status = springls_springl_materials(t->ctx, (springls_material *)memory); break;
    case 5: status = springls_get_provenance(t->ctx, (springls_provenance *)memory); break;
    default: status = springls_springl_errors(t->ctx, (springls_error_estimate *)memory); break;
    }
    if (status == SPRINGLS_OK && mesh.vertex_count) {
        void *places = malloc((size_t)mesh.vertex_count * sizeof(springls_material));
        fuzz_check_status(t->ctx, springls_mesh_materials(t->ctx, &mesh, (springls_material *)places));
        fuzz_check_status(t->ctx, springls_mesh_errors(t->ctx, &mesh, (springls_error_estimate *)places));
        free(places);
    }
    springls_mesh_free(t->ctx, &mesh);
    free(memory);
    return status;
}

/* Writes any neighbours of the original surface's triangles; one may be out of range. */
static void any_neighbors(bench *t, int *neighbors, int given)
{
    int i, stride = 1 + fuzz_choice(&t->b, 200);
    for (i = 0; i < 3 * given; i++) neighbors[i] = i % 5 == 0 ? -1 : (int)((int64_t)i * stride % given);
    if (given == 0 || fuzz_choice(&t->b, 8)) return;
    i = (int)(fuzz_word(&t->b) % (3u * (uint32_t)given));
    neighbors[i] = fuzz_choice(&t->b, 2) ? given : -2;
}

/* Finds seams of the mesh, whose corners have values that repeat, then the corners' places on the original surface, and values
   there. */
static springls_status seams(bench *t)
{
    int i, given = springls_material_triangle_count(t->ctx), corners, channels = fuzz_choice(&t->b, 3), repeat;
    size_t room;
    springls_mesh mesh;
    springls_material *places;
    float *values;
    int *neighbors;
    springls_status status = springls_extract_mesh(t->ctx, &mesh);
    if (status != SPRINGLS_OK) return status;
    corners = 3 * mesh.triangle_count;
    room = 3 * (size_t)given + (size_t)corners + 1;
    neighbors = (int *)malloc(room * sizeof *neighbors);
    values = (float *)malloc(2 * room * sizeof *values);
    places = (springls_material *)malloc(room * sizeof *places);
    repeat = 1 + fuzz_choice(&t->b, 64);
    for (i = 0; i < 2 * (int)room; i++) values[i] = (float)(i % repeat);
    status = springls_find_seams(t->ctx, mesh.positions, mesh.vertex_count - fuzz_choice(&t->b, 2), 0, mesh.triangles,
                                 mesh.triangle_count, channels ? values : NULL, channels, neighbors);
    for (i = 0; status == SPRINGLS_OK && i < corners; i++) FUZZ_CHECK(neighbors[i] >= -1 && neighbors[i] < mesh.triangle_count);
    if (status == SPRINGLS_OK) {
        any_neighbors(t, neighbors, given);
        status = springls_corner_materials(t->ctx, &mesh, neighbors, places);
    }
    if (status == SPRINGLS_OK) {
        float *out = values + room;
        FUZZ_CHECK(springls_interpolate_material(places, corners, values, 1, NULL, given, out) == SPRINGLS_OK);
        for (i = 0; i < corners; i++) FUZZ_CHECK(out[i] > -1.0f && out[i] < (float)repeat);
    }
    springls_mesh_free(t->ctx, &mesh);
    free(neighbors);
    free(values);
    free(places);
    return status;
}

static springls_status set_time(bench *t)
{
    springls_set_time(t->ctx, (double)fuzz_float(&t->b, -10.0f, 10.0f));
    FUZZ_CHECK(fabs(springls_time(t->ctx)) < 1e39);
    return SPRINGLS_OK;
}

/* ---- the run ---- */

/* Creates the contexts, and sets a ball in the middle so that most calls have a model. */
static bool begin(bench *t)
{
    springls_params params = springls_default_params();
    springls_desc desc = fixture_desc(0, &params);
    springls_sphere ball;
    int k;
#ifdef SMALL_MODELS
    params.keep_edges = fuzz_choice(&t->b, 8) == 0; /* all of a small ball is an edge, which takes half of the time */
#endif
    for (k = 0; k < 3; k++) desc.grid.size[k] = 8 * (1 + fuzz_choice(&t->b, MOST_SIDE / 8));
    desc.follow = fuzz_choice(&t->b, 4) == 0;
    if (!desc.follow) desc.grid.size[1] -= fuzz_choice(&t->b, 4);
    if (fuzz_choice(&t->b, 8) == 0) desc.grid.spacing[0] = desc.grid.spacing[1] = desc.grid.spacing[2] = 0.5;
    desc.max_springls = fuzz_choice(&t->b, 4) ? MOST_SPRINGLS : fuzz_choice(&t->b, 256);
    desc.progress.report = report_progress;
    desc.progress.user = t;
    if (fuzz_choice(&t->b, 2)) desc.tasks = fixture_tasks(&t->workers, 3, 0);
    desc.backend = NULL;
    t->grid = desc.grid;
    t->reports_left = 1 << 20;
    desc.allocator = fixture_allocator(&t->other_heap);
    if (springls_create(&desc, &t->other) != SPRINGLS_OK) return false;
    desc.allocator = fixture_allocator(&t->heap);
    if (springls_create(&desc, &t->ctx) != SPRINGLS_OK) return false;
    ball = fixture_ball(0.5f * (float)t->grid.size[0], 0.5f * (float)t->grid.size[1], 0.5f * (float)t->grid.size[2],
                        fuzz_between(&t->b, 1.0f, 0.25f * (float)MOST_SIDE));
    fuzz_check_status(t->ctx, springls_set_implicit(t->ctx, springls_implicit_sphere, &ball));
    return true;
}

/* Makes a call. The seeds are from when there were nineteen: bytes from 247 on choose a later one. */
static springls_status any_call(bench *t)
{
    static springls_status (*const calls[])(bench *) = {
        set_shape, set_volume, set_springls, write_springls, set_reference, move, move, stage, set_params, set_keep_mask, attribute,
        combine, remodel, restore, query, chunks, events, read_out, set_time
    };
    const unsigned count = sizeof calls / sizeof *calls, byte = fuzz_byte(&t->b);
    return byte < 255u / count * count ? calls[byte % count](t) : seams(t);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static bench t;
    int call;
    memset(&t, 0, sizeof t);
    t.b.at = data;
    t.b.left = size;
    FUZZ_CHECK(begin(&t));
    for (call = 0; call < MOST_CALLS && t.b.left; call++) {
        springls_status status;
        t.reports_left = fuzz_choice(&t.b, 8) ? 1 << 20 : fuzz_choice(&t.b, 4);
        t.memory_fails = fuzz_choice(&t.b, 8) == 0;
        t.heap.fail_at = t.memory_fails ? t.heap.calls + fuzz_choice(&t.b, 64) : -1;
        status = any_call(&t);
        fuzz_check_status(t.ctx, status);
        FUZZ_CHECK(t.memory_fails || status != SPRINGLS_OUT_OF_MEMORY || strstr(springls_last_error(t.ctx), "more than"));
        t.heap.fail_at = -1;
        t.reports_left = 1 << 20;
        if (fuzz_choice(&t.b, 4) == 0) fuzz_check_model(t.ctx);
    }
    fuzz_check_model(t.ctx);
    springls_chunks_destroy(t.ctx, t.chunks);
    springls_destroy(t.ctx);
    springls_destroy(t.other);
    FUZZ_CHECK(t.heap.bytes == 0 && t.heap.blocks == 0 && t.heap.wrong_sizes == 0);
    FUZZ_CHECK(t.other_heap.bytes == 0 && t.other_heap.blocks == 0 && t.other_heap.wrong_sizes == 0);
    return 0;
}
