/* test_lives.c - random lives: models go through random calls of every function that changes a model. Beside each lives a twin that
   is restored from its snapshots and read in every way, while the model itself is never read:
   - a snapshot restores to the same state, whose snapshot has the same bytes;
   - model and twin go on with the same calls to the same states, however steps are divided and whatever memory holds;
   - reading leaves the twin's state and snapshot as they were;
   - a fresh context that restores the model answers every query as the twin does;
   - the mesh is closed, measures are the mesh's, and components are its connected parts, those of phi where it is that of phi;
   - springls are finite, their ids unique, and not more than two a voxel.
   test_lives SEED... lives the lives of these seeds, and prints their calls. LIVES_MINUTES=m lives new ones for m minutes. */
#include "histories.h"

#include <time.h>

#ifndef MORE_LIVES /* test_more_lives.c leads those */
enum { FIRST_LIFE = 1, LIVES = 60 };
#endif
enum { CALLS = 200, LARGEST_GRID = 32, POINTS = 6, LEAST_SPRINGLS = 12 };

/* The life that is led, and what its calls work on. */
typedef struct random_life {
    uint32_t seed;
    int call;
    const char *name;               /* of the call */
    const char *fault;              /* what does not hold; NULL: all does */
    springls_desc desc;
    springls_context *model, *twin;
    springls_context *quiet;        /* has the model's calls, and nobody reads it; NULL in most lives */
    springls_context *other;        /* to combine with */
    springls_chunks *chunks;        /* of the twin */
    fixture_workers workers;        /* of the twin */
    void *block, *again, *saved;    /* snapshots: of the model, of the twin, of an earlier state */
    size_t size, saved_size;
    float scale;                    /* of bodies */
    int most_springls, voxels, verbose;
} random_life;

/* Notes the first condition of a life that does not hold, and returns. */
#define LIFE_CHECK(l, condition)                     \
    do {                                             \
        if (!(condition)) {                          \
            (l)->fault = #condition;                 \
            return;                                  \
        }                                            \
    } while (0)

/* One of the two models while a call is made on it. */
typedef struct life_side { springls_context *ctx; random_life *life; int is_twin; } life_side;

/* ---- random choices: of a call, the same for both sides ---- */

static int choice(int count) { return (int)(fixture_bits() % (uint32_t)count); }
static bool one_in(int count) { return choice(count) == 0; }

/* A place in voxels, in the middle of the grid. */
static void middle_point(const random_life *l, float spread, float voxel[3])
{
    int k;
    for (k = 0; k < 3; k++) voxel[k] = 0.5f * (float)(l->desc.grid.size[k] - 1) + fixture_between(-spread, spread);
}

static void world_point(const random_life *l, float spread, float world[3])
{
    float voxel[3];
    middle_point(l, spread, voxel);
    springls_to_world(l->other, voxel, 1, world); /* the window of the other model never moves */
}

static float unit(const random_life *l) { return (float)l->desc.grid.spacing[0]; }

static springls_sphere any_ball(const random_life *l, float low, float high)
{
    springls_sphere ball;
    world_point(l, 3.0f * l->scale, ball.center);
    ball.radius = unit(l) * l->scale * fixture_between(low, high);
    return ball;
}

/* ---- inputs ---- */

static springls_status set_shape(life_side *s)
{
    springls_sphere ball = any_ball(s->life, 2.5f, 4.5f);
    springls_box box;
    springls_torus torus;
    int k, kind = choice(4);
    if (kind == 0) {
        for (k = 0; k < 3; k++) {
            box.center[k] = ball.center[k];
            box.half[k] = unit(s->life) * s->life->scale * fixture_between(1.5f, 4.0f);
        }
        return springls_set_implicit(s->ctx, springls_implicit_box, &box);
    }
    if (kind == 1) {
        for (k = 0; k < 3; k++) {
            torus.center[k] = ball.center[k];
            torus.axis[k] = fixture_between(0.1f, 1.0f);
        }
        torus.major = 1.1f * ball.radius;
        torus.minor = 0.4f * ball.radius;
        return springls_set_implicit(s->ctx, springls_implicit_torus, &torus);
    }
    return springls_set_implicit(s->ctx, springls_implicit_sphere, &ball);
}

/* Two balls as a level set, as labels or as intensities. */
static springls_status set_volume(life_side *s)
{
    static float phi[LARGEST_GRID * LARGEST_GRID * LARGEST_GRID];
    static int32_t labels[LARGEST_GRID * LARGEST_GRID * LARGEST_GRID];
    const int *size = s->life->desc.grid.size, kind = choice(3);
    float center[2][3], radius[2];
    int i, k;
    for (k = 0; k < 2; k++) {
        middle_point(s->life, 4.0f * s->life->scale, center[k]);
        radius[k] = s->life->scale * fixture_between(2.0f, 4.0f);
    }
    for (i = 0; i < s->life->voxels; i++) {
        const d3 x = d3_make(i % size[0], i / size[0] % size[1], i / (size[0] * size[1]));
        double d[2];
        for (k = 0; k < 2; k++)
            d[k] = d3_distance(x, d3_make((double)center[k][0], (double)center[k][1], (double)center[k][2])) - (double)radius[k];
        phi[i] = (float)fmin(d[0], d[1]);
        labels[i] = phi[i] < 0.0f ? 3 : 0;
    }
    if (kind == 0) return springls_set_level_set(s->ctx, phi);
    if (kind == 1) return springls_set_labels(s->ctx, labels, one_in(2) ? 3 : -1);
    return springls_set_threshold(s->ctx, phi, -100.0f, 0.1f);
}

/* Makes the mesh of a ball, to be freed by springls_mesh_free(l->other, mesh). */
static springls_status ball_mesh(const random_life *l, springls_mesh *mesh)
{
    springls_sphere ball = any_ball(l, 2.5f, 4.0f);
    springls_status status = springls_set_implicit(l->other, springls_implicit_sphere, &ball);
    return status == SPRINGLS_OK ? springls_extract_mesh(l->other, mesh) : status;
}

/* Every second mesh is open. */
static springls_status set_mesh(life_side *s)
{
    springls_mesh mesh;
    springls_mesh_report report;
    springls_status status = ball_mesh(s->life, &mesh);
    if (status != SPRINGLS_OK) return status;
    status = springls_set_mesh(s->ctx, mesh.positions, mesh.vertex_count, 0, mesh.triangles,
                               mesh.triangle_count - choice(2) * choice(30), &report);
    springls_mesh_free(s->life->other, &mesh);
    return status;
}

static springls_status set_springls(life_side *s)
{
    const springls_view vertices = springls_view_vertices(s->ctx);
    float *copy = (float *)malloc(((size_t)vertices.count + 1) * 9 * sizeof *copy);
    springls_status status;
    int i;
    for (i = 0; i < vertices.count; i++)
        memcpy(copy + 9 * i, (const char *)(const void *)vertices.data + (size_t)i * vertices.stride, 9 * sizeof *copy);
    status = springls_set_springls(s->ctx, copy, NULL, NULL, vertices.count);
    free(copy);
    return status;
}

static springls_status set_reference(life_side *s)
{
    springls_mesh mesh;
    springls_status status;
    if (one_in(2)) return springls_set_reference(s->ctx);
    status = ball_mesh(s->life, &mesh);
    if (status != SPRINGLS_OK) return status;
    status = springls_set_reference_mesh(s->ctx, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL);
    springls_mesh_free(s->life->other, &mesh);
    return status;
}

static springls_status any_input(life_side *s)
{
    static springls_status (*const inputs[])(life_side *) = { set_shape, set_shape, set_volume, set_mesh };
    return inputs[choice(4)](s);
}

/* ---- motion ---- */

enum { FLOW_WIND, FLOW_TURN, FLOW_SHEAR, FLOW_PINCH, FLOW_SWELL, FLOWS };

/* A flow about a place; forces on a part of the springls, and in a grid. */
typedef struct life_flow {
    float center[3], vector[3], speed, radius;
    int kind;
    float samples[3 * 4 * 4 * 4];
} life_flow;

static void flow_velocity(void *user, const float *points, int count, float time, float *out)
{
    const life_flow *f = (const life_flow *)user;
    int i, k;
    (void)time;
    for (i = 0; i < count; i++, points += 3, out += 3) {
        float x[3];
        for (k = 0; k < 3; k++) x[k] = (points[k] - f->center[k]) * 0.2f;
        for (k = 0; k < 3; k++) {
            const float turned = f->vector[(k + 1) % 3] * x[(k + 2) % 3] - f->vector[(k + 2) % 3] * x[(k + 1) % 3];
            switch (f->kind) {
            case FLOW_WIND: out[k] = f->speed * f->vector[k]; break;
            case FLOW_TURN: out[k] = f->speed * turned; break;
            case FLOW_SHEAR: out[k] = k == 0 ? f->speed * x[1] : 0.0f; break;
            case FLOW_PINCH: out[k] = k == 0 ? -f->speed * x[0] : 0.5f * f->speed * x[k]; break;
            default: out[k] = f->speed * x[k];
            }
        }
    }
}

static void flow_pressure(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    const life_flow *f = (const life_flow *)user;
    int i, k;
    (void)normals, (void)time;
    for (i = 0; i < count; i++, points += 3) {
        float r2 = 0.0f;
        for (k = 0; k < 3; k++) r2 += (points[k] - f->center[k]) * (points[k] - f->center[k]);
        out[i] = r2 < f->radius * f->radius ? f->speed : 0.0f;
    }
}

static void flow_affine(void *user, const float *points, const float *correspondences, int count, float time, float *out)
{
    const life_flow *f = (const life_flow *)user;
    int i;
    (void)points, (void)correspondences, (void)time;
    memset(out, 0, 12 * (size_t)count * sizeof *out);
    for (i = 0; i < count; i++, out += 12) {
        out[0] = 0.1f * f->speed;
        out[3] = -out[0] * f->center[0];
    }
}

static void flow_batch(void *user, const springls_batch *batch, float *out)
{
    const life_flow *f = (const life_flow *)user;
    int i, k;
    for (i = 0; i < batch->count; i++)
        for (k = 0; k < 3; k++) out[3 * i + k] = batch->ids[i] % 7u == 0u ? 0.3f * f->vector[k] : 0.0f;
}

static springls_forces any_forces(const random_life *l, life_flow *f)
{
    springls_forces forces = fixture_forces(flow_velocity, f);
    int k, kind = choice(10);
    const bool world = one_in(6);
    for (k = 0; k < 3; k++) f->vector[k] = fixture_between(-1.0f, 1.0f);
    for (k = 0; k < 3 * 64; k++) f->samples[k] = fixture_between(-0.5f, 0.5f);
    if (world) world_point(l, 2.0f, f->center);
    else middle_point(l, 2.0f, f->center);
    f->kind = choice(FLOWS);
    f->speed = fixture_between(-1.0f, 1.0f) * (one_in(12) ? 6.0f : 1.0f);
    f->radius = fixture_between(2.0f, 6.0f);
    forces.voxel_units = !world;
    if (one_in(5)) forces.curvature_weight = fixture_between(0.0f, 0.3f);
    if (one_in(4)) forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    if (one_in(4)) {
        float middle[3];
        if (world) world_point(l, 0.0f, middle);
        else middle_point(l, 0.0f, middle);
        for (k = 0; k < 3; k++) {
            forces.region_lower[k] = middle[k] - fixture_between(0.0f, 5.0f);
            forces.region_upper[k] = middle[k] + fixture_between(0.0f, 5.0f);
        }
    }
    if (kind < 2) {
        forces.velocity = NULL;
        forces.pressure = flow_pressure;
    } else if (kind == 2) {
        forces.velocity = NULL;
        forces.affine = flow_affine;
    } else if (kind == 3) {
        forces.velocity = NULL;
        forces.velocity_batch = flow_batch;
    } else if (kind == 4) {
        forces.velocity = NULL;
        forces.velocity_grid.data = f->samples;
        for (k = 0; k < 3; k++) {
            forces.velocity_grid.grid.size[k] = 4;
            forces.velocity_grid.grid.spacing[k] = 8.0 * l->desc.grid.spacing[k];
            forces.velocity_grid.grid.origin[k] = l->desc.grid.origin[k];
        }
    } else if (kind == 5) {
        forces.velocity = NULL; /* rest */
    }
    return forces;
}

static springls_step_desc any_step(const springls_forces *forces)
{
    static const springls_mode modes[] = { SPRINGLS_MODE_FLUID, SPRINGLS_MODE_FLUID, SPRINGLS_MODE_FLUID, SPRINGLS_MODE_FLUID,
                                           SPRINGLS_MODE_ELASTIC, SPRINGLS_MODE_ADVECT_ONLY };
    springls_step_desc step = fixture_step(forces, modes[choice(6)], fixture_between(0.1f, 1.0f));
    step.max_displacement = one_in(6) ? 0.7f : 2.0f;
    step.one_to_one = one_in(8);
    step.stop_at_topology = one_in(8);
    step.stop_at_rest = one_in(8);
    return step;
}

static springls_status take_step(life_side *s)
{
    life_flow flow;
    springls_forces forces = any_forces(s->life, &flow);
    springls_step_desc step = any_step(&forces);
    return springls_step(s->ctx, &step);
}

/* Divides a step on one side only: into a few calls, and what is left is for the next call to complete. */
static springls_status divide_step(life_side *s)
{
    life_flow flow;
    springls_forces forces = any_forces(s->life, &flow);
    springls_step_desc step = any_step(&forces);
    springls_status status;
    const int calls = choice(60);
    bool done = false;
    int i;
    if (s->is_twin) return springls_step(s->ctx, &step);
    status = springls_step_begin(s->ctx, &step);
    for (i = 0; i < calls && status == SPRINGLS_OK && !done; i++) status = springls_step_continue(s->ctx, 0.0, &done);
    while (status == SPRINGLS_OK && !done) status = springls_step_continue(s->ctx, HUGE_VAL, &done);
    return status;
}

static springls_status run_steps(life_side *s)
{
    life_flow flow;
    springls_forces forces = any_forces(s->life, &flow);
    springls_step_desc step = any_step(&forces);
    return springls_run(s->ctx, &step, 2 + choice(2));
}

/* Lets the model rest, sometimes until it sleeps. */
static springls_status rest(life_side *s)
{
    springls_step_desc step = fixture_step(NULL, SPRINGLS_MODE_FLUID, 0.1f);
    return springls_run(s->ctx, &step, one_in(4) ? 4 + choice(6) : 1);
}

static springls_status advect(life_side *s)
{
    life_flow flow;
    springls_forces forces = any_forces(s->life, &flow);
    float speed, time = fixture_between(0.0f, 1.0f);
    springls_status status = springls_max_speed(s->ctx, &forces, time, &speed);
    return status == SPRINGLS_OK ? springls_advect(s->ctx, &forces, time, speed > 2.0f ? 2.0f / speed : 1.0f) : status;
}

static springls_status stage(life_side *s)
{
    static const springls_stage stages[] = { SPRINGLS_STAGE_RELAX, SPRINGLS_STAGE_CONTRACT, SPRINGLS_STAGE_RESAMPLE,
                                             SPRINGLS_STAGE_EVOLVE, SPRINGLS_STAGE_REBUILD, SPRINGLS_STAGE_FILL_GAPS,
                                             SPRINGLS_STAGE_UNSIGNED_TO_SIGNED, SPRINGLS_STAGE_TRACK };
    const int count = (int)(sizeof stages / sizeof *stages), i = choice(count + 1);
    return i < count ? springls_run_stage(s->ctx, stages[i]) : springls_remesh(s->ctx);
}

static springls_status write_springls(life_side *s)
{
    enum { MOST = 8 };
    float particles[3 * MOST];
    const int n = springls_count(s->ctx), count = 1 + choice(MOST), first = n > 0 ? choice(n) : 0;
    int i, k;
    for (i = 0; i < MOST && first + i < n; i++) {
        const springls__v3 p = fixture_particle(s->ctx, first + i);
        memcpy(particles + 3 * i, &p, sizeof p);
        for (k = 0; k < 3; k++) particles[3 * i + k] += fixture_between(-0.5f, 0.5f);
    }
    return springls_write(s->ctx, first, first + count <= n ? count : n - first, NULL, particles);
}

static springls_status set_time(life_side *s)
{
    springls_set_time(s->ctx, (double)fixture_between(0.0f, 10.0f));
    return SPRINGLS_OK;
}

/* ---- settings ---- */

static springls_status set_params(life_side *s)
{
    const float width = springls_get_params(s->ctx).band_half_width;
    springls_params p = one_in(3) ? springls_paper_params() : springls_default_params();
    p.band_half_width = width; /* stays while there is a model */
    if (one_in(3)) p.components = 1;
    if (one_in(8)) p.contouring = SPRINGLS_CONTOURING_SPRINGLS;
    if (one_in(4)) p.volume_lock = 1;
    if (one_in(3)) p.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    if (one_in(3)) p.contact = SPRINGLS_CONTACT_SEPARATE;
    if (one_in(3)) p.keep_edges = !p.keep_edges;
    if (one_in(4)) p.lazy_distance = p.lazy_distance > 0.0f ? 0.0f : 3.5f;
    if (one_in(6)) p.curvature = 0.1f;
    if (one_in(6)) p.resample_period = 1 + choice(4);
    if (one_in(6)) p.vertex_velocity = !p.vertex_velocity;
    if (one_in(6)) p.evolve_iterations = choice(4);
    if (one_in(6)) p.min_component = fixture_between(0.0f, 4.0f);
    return springls_set_params(s->ctx, &p);
}

static springls_status set_keep_mask(life_side *s)
{
    const int n = springls_count(s->ctx), every = 1 + choice(6);
    uint8_t *mask = (uint8_t *)malloc((size_t)n + 1);
    springls_status status;
    int i;
    for (i = 0; i < n; i++) mask[i] = i % every == 0;
    status = springls_set_keep_mask(s->ctx, one_in(2) ? mask : NULL);
    free(mask);
    return status;
}

static springls_status attribute(life_side *s)
{
    static const char *const names[] = { "a", "color", "mass" };
    const int n = springls_count(s->ctx), have = springls_attribute_count(s->ctx), what = choice(4);
    springls_attribute_desc desc;
    springls_status status;
    float *values;
    int i, at;
    if (have > 0 && what == 0) return springls_remove_attribute(s->ctx, choice(have));
    desc.name = names[choice(3)];
    desc.channels = 1 + choice(3);
    desc.split = (springls_policy)choice(3);
    desc.fill = (springls_policy)choice(3);
    desc.merge = (springls_policy)choice(3);
    at = springls_find_attribute(s->ctx, desc.name);
    if (at >= 0) springls_describe_attribute(s->ctx, at, &desc);
    values = (float *)malloc(((size_t)n * 3 + 1) * sizeof *values);
    for (i = 0; i < 3 * n; i++) values[i] = fixture_between(0.0f, 1.0f);
    status = at >= 0 ? springls_set_attribute(s->ctx, at, values)
                     : springls_add_attribute(s->ctx, &desc, one_in(2) ? values : NULL, NULL);
    free(values);
    return status;
}

/* ---- tools ---- */

static springls_status combine(life_side *s)
{
    const springls_operation operation = (springls_operation)choice(3);
    springls_sphere ball = any_ball(s->life, 2.0f, 3.5f);
    springls_status status;
    if (one_in(2)) return springls_combine_implicit(s->ctx, operation, springls_implicit_sphere, &ball);
    status = springls_set_implicit(s->life->other, springls_implicit_sphere, &ball);
    return status == SPRINGLS_OK ? springls_combine(s->ctx, operation, s->life->other) : status;
}

static springls_status remodel(life_side *s)
{
    const bool keep_volume = one_in(2);
    if (one_in(2)) return springls_offset(s->ctx, unit(s->life) * fixture_between(-0.8f, 0.8f));
    return springls_smooth(s->ctx, unit(s->life) * fixture_between(0.3f, 1.0f), keep_volume);
}

/* Goes back to an earlier state. */
static springls_status undo(life_side *s)
{
    return s->life->saved ? springls_restore(s->ctx, s->life->saved, s->life->saved_size) : SPRINGLS_OK;
}

static springls_status reset_and_set(life_side *s)
{
    springls_status status = springls_reset(s->ctx);
    return status == SPRINGLS_OK ? any_input(s) : status;
}

/* ---- the calls, with their shares ---- */

static const struct { const char *name; springls_status (*run)(life_side *); int share; } calls[] = {
    { "step", take_step, 30 }, { "divided step", divide_step, 12 }, { "run", run_steps, 5 }, { "rest", rest, 5 },
    { "advect", advect, 5 }, { "stage", stage, 14 }, { "write", write_springls, 4 }, { "set_time", set_time, 1 },
    { "set_params", set_params, 6 }, { "set_keep_mask", set_keep_mask, 2 }, { "attribute", attribute, 4 },
    { "combine", combine, 5 }, { "offset or smooth", remodel, 3 }, { "undo", undo, 3 }, { "input", any_input, 2 },
    { "set_springls", set_springls, 1 }, { "set_reference", set_reference, 2 }, { "reset", reset_and_set, 1 }
};

enum { KINDS = sizeof calls / sizeof *calls };

/* Chooses a call; with too few springls, or too many, a new model. */
static int any_call(const random_life *l)
{
    const int n = springls_count(l->model);
    int i, left = 0;
    for (i = 0; i < KINDS; i++) left += calls[i].share;
    left = choice(left);
    for (i = 0; left >= calls[i].share; i++) left -= calls[i].share;
    return n >= LEAST_SPRINGLS && n <= l->most_springls ? i : KINDS - 1;
}

/* ---- readers: each adds what it has read to a hash ---- */

static uint64_t mix_hits(uint64_t hash, const springls_hit *hits, int count)
{
    return history_mix(hash, hits, (size_t)count * sizeof *hits);
}

/* Places on the mesh's vertices, near to them, and anywhere. */
static void query_points(const random_life *l, const springls_mesh *mesh, float points[3 * POINTS])
{
    int i, k;
    for (i = 0; i < POINTS; i++) {
        world_point(l, 9.0f, points + 3 * i);
        if (i % 3 == 0 || mesh->vertex_count == 0) continue;
        for (k = 0; k < 3; k++)
            points[3 * i + k] = mesh->positions[3 * (i * 37 % mesh->vertex_count) + k] + (i % 3 == 1 ? 0.0f : 0.3f * unit(l));
    }
}

static uint64_t read_samples(random_life *l, springls_context *ctx, const springls_mesh *mesh, uint64_t hash)
{
    float points[3 * POINTS], values[3 * POINTS];
    uint8_t inside[POINTS];
    query_points(l, mesh, points);
    if (springls_sample_distance(ctx, points, POINTS, values) != SPRINGLS_OK) l->fault = "sample_distance";
    hash = history_mix(hash, values, POINTS * sizeof *values);
    if (springls_sample_gradient(ctx, points, POINTS, values) != SPRINGLS_OK) l->fault = "sample_gradient";
    hash = history_mix(hash, values, sizeof values);
    if (springls_sample_inside(ctx, points, POINTS, inside) != SPRINGLS_OK) l->fault = "sample_inside";
    return history_mix(hash, inside, sizeof inside);
}

static uint64_t read_closest(random_life *l, springls_context *ctx, const springls_mesh *mesh, uint64_t hash)
{
    float points[3 * POINTS];
    springls_hit hits[POINTS];
    int surface;
    query_points(l, mesh, points);
    memset(hits, 0, sizeof hits);
    for (surface = 0; surface < 2; surface++) {
        if (springls_closest(ctx, (springls_surface)surface, points, POINTS, hits) != SPRINGLS_OK) l->fault = "closest";
        hash = mix_hits(hash, hits, POINTS);
    }
    return hash;
}

static uint64_t read_rays(random_life *l, springls_context *ctx, const springls_mesh *mesh, uint64_t hash)
{
    float origins[3 * POINTS], directions[3 * POINTS];
    springls_hit hits[POINTS];
    int surface, i;
    query_points(l, mesh, origins);
    for (i = 0; i < 3 * POINTS; i++) directions[i] = fixture_between(-1.0f, 1.0f);
    memset(hits, 0, sizeof hits);
    for (surface = 0; surface < 2; surface++) {
        if (springls_raycast(ctx, (springls_surface)surface, origins, directions, POINTS, 0.0f, hits) != SPRINGLS_OK)
            l->fault = "raycast";
        hash = mix_hits(hash, hits, POINTS);
    }
    return hash;
}

static uint64_t read_level_set(random_life *l, springls_context *ctx, const springls_mesh *mesh, uint64_t hash)
{
    float *phi = (float *)malloc((size_t)l->voxels * sizeof *phi);
    (void)mesh;
    if (springls_copy_level_set(ctx, phi) != SPRINGLS_OK) l->fault = "copy_level_set";
    hash = history_mix(hash, phi, (size_t)l->voxels * sizeof *phi);
    free(phi);
    return hash;
}

static uint64_t read_springls(random_life *l, springls_context *ctx, const springls_mesh *mesh, uint64_t hash)
{
    const int n = springls_count(ctx);
    float *out = (float *)malloc(((size_t)n + 1) * 16 * sizeof *out);
    const uint32_t *bodies = springls_component_ids(ctx);
    springls_mesh soup;
    int i;
    (void)mesh;
    for (i = 0; i < n; i++) {
        const fixture_springl one = fixture_get(ctx, i);
        hash = history_mix(hash, &one, sizeof one);
    }
    if (springls_pack_matrix(ctx, out) != SPRINGLS_OK) l->fault = "pack_matrix";
    hash = history_mix(hash, out, (size_t)n * 16 * sizeof *out);
    if (springls_extract_surfels(ctx, out) != SPRINGLS_OK) l->fault = "extract_surfels";
    hash = history_mix(hash, out, (size_t)n * 7 * sizeof *out);
    if (springls_extract_soup(ctx, &soup) != SPRINGLS_OK) l->fault = "extract_soup";
    else hash = history_mix_mesh(hash, &soup);
    springls_mesh_free(ctx, &soup);
    free(out);
    return bodies ? history_mix(hash, bodies, (size_t)n * sizeof *bodies) : hash;
}

static uint64_t read_histories(random_life *l, springls_context *ctx, const springls_mesh *mesh, uint64_t hash)
{
    const size_t n = (size_t)springls_count(ctx) + 1, vertices = (size_t)mesh->vertex_count + 1;
    springls_provenance *histories = (springls_provenance *)calloc(n, sizeof *histories);
    springls_error_estimate *errors = (springls_error_estimate *)calloc(n + vertices, sizeof *errors);
    springls_material *places = (springls_material *)calloc(n + vertices, sizeof *places);
    if (springls_get_provenance(ctx, histories) != SPRINGLS_OK) l->fault = "get_provenance";
    if (springls_springl_errors(ctx, errors) != SPRINGLS_OK) l->fault = "springl_errors";
    if (springls_mesh_errors(ctx, mesh, errors + n) != SPRINGLS_OK) l->fault = "mesh_errors";
    if (springls_springl_materials(ctx, places) != SPRINGLS_OK) l->fault = "springl_materials";
    if (springls_mesh_materials(ctx, mesh, places + n) != SPRINGLS_OK) l->fault = "mesh_materials";
    hash = history_mix(hash, histories, n * sizeof *histories);
    hash = history_mix(hash, errors, (n + vertices) * sizeof *errors);
    hash = history_mix(hash, places, (n + vertices) * sizeof *places);
    free(histories);
    free(errors);
    free(places);
    return hash;
}

static uint64_t read_attributes(random_life *l, springls_context *ctx, const springls_mesh *mesh, uint64_t hash)
{
    const int n = springls_count(ctx), count = springls_attribute_count(ctx);
    float *values = (float *)malloc(((size_t)mesh->vertex_count + 1) * 3 * sizeof *values);
    int i, k;
    for (i = 0; i < count; i++) {
        const springls_view view = springls_view_attribute(ctx, i);
        springls_attribute_desc desc;
        if (springls_describe_attribute(ctx, i, &desc) != SPRINGLS_OK) l->fault = "describe_attribute";
        for (k = 0; k < n; k++)
            hash = history_mix(hash, (const char *)(const void *)view.data + (size_t)k * view.stride,
                               (size_t)desc.channels * sizeof *values);
        if (springls_mesh_attribute(ctx, mesh, i, values) != SPRINGLS_OK) l->fault = "mesh_attribute";
        hash = history_mix(hash, values, (size_t)mesh->vertex_count * (size_t)desc.channels * sizeof *values);
    }
    free(values);
    return hash;
}

/* The readers; what takes long is read in fewer of the calls. */
static const struct {
    uint64_t (*run)(random_life *, springls_context *, const springls_mesh *, uint64_t);
    int every;
} readers[] = { { read_samples, 2 },  { read_closest, 4 },   { read_rays, 3 },      { read_level_set, 3 },
                { read_springls, 2 }, { read_histories, 8 }, { read_attributes, 6 } };

enum { READERS = sizeof readers / sizeof *readers };

/* Chooses some readers, as a mask; with `seldom` 0 those that take long are as frequent as the others. */
static int any_readers(int seldom)
{
    int i, mask = 0;
    for (i = 0; i < READERS; i++) mask |= one_in(seldom ? readers[i].every : 2) << i;
    return mask;
}

/* ---- oracles ---- */

static bool is_near(double a, double b, double share, double least) { return fabs(a - b) <= least + share * fmax(fabs(a), fabs(b)); }

/* A connected part of a mesh. */
typedef struct mesh_part { double volume, area; } mesh_part;

static int mesh_root(int *parent, int i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* Measures the parts of a mesh; returns their number. parts: room for one a vertex. */
static int measure_parts(const springls_mesh *mesh, mesh_part *parts)
{
    int *parent = (int *)malloc(((size_t)mesh->vertex_count + 1) * sizeof *parent), i, k, count = 0;
    const float *at = mesh->positions;
    for (i = 0; i < mesh->vertex_count; i++) parent[i] = i;
    for (i = 0; i < mesh->triangle_count; i++)
        for (k = 1; k < 3; k++) {
            const int a = mesh_root(parent, mesh->triangles[3 * i]), b = mesh_root(parent, mesh->triangles[3 * i + k]);
            parent[a > b ? a : b] = a > b ? b : a;
        }
    memset(parts, 0, (size_t)mesh->vertex_count * sizeof *parts);
    for (i = 0; i < mesh->triangle_count; i++) {
        mesh_part *part = &parts[mesh_root(parent, mesh->triangles[3 * i])];
        d3 x[3], n;
        for (k = 0; k < 3; k++) {
            const float *v = at + 3 * mesh->triangles[3 * i + k];
            x[k] = d3_make((double)v[0] - (double)at[0], (double)v[1] - (double)at[1], (double)v[2] - (double)at[2]);
        }
        n = d3_cross(d3_sub(x[1], x[0]), d3_sub(x[2], x[0]));
        part->area += 0.5 * d3_length(n);
        part->volume += d3_dot(x[0], n) / 6.0;
    }
    for (i = 0; i < mesh->vertex_count; i++)
        if (parent[i] == i) parts[count++] = parts[i];
    free(parent);
    return count;
}

/* Checks that a mesh is closed and that measures are its own. */
static void check_mesh(random_life *l, springls_context *ctx, const springls_mesh *mesh, const mesh_part *parts, int count)
{
    const springls__mesh_report report = fixture_report(mesh);
    springls_measures measures;
    double volume = 0.0, area = 0.0;
    int i;
    for (i = 0; i < count; i++) {
        volume += parts[i].volume;
        area += parts[i].area;
    }
    LIFE_CHECK(l, report.boundary_edges == 0 && report.nonmanifold_edges == 0 && report.misoriented_edges == 0);
    LIFE_CHECK(l, springls_measure(ctx, &measures) == SPRINGLS_OK);
    LIFE_CHECK(l, is_near(measures.area, area, 1e-4, 1e-9));
    LIFE_CHECK(l, is_near(measures.volume, volume, 1e-4, 1e-5 * area));
    LIFE_CHECK(l, measures.components == count);
}

/* Numbers the parts of the inside of phi, connected through faces; returns how many there are. label: 0 outside. */
static int flood(const random_life *l, const float *phi, int *label)
{
    const int *size = l->desc.grid.size, step[3] = { 1, size[0], size[0] * size[1] };
    int *stack = (int *)malloc((size_t)l->voxels * sizeof *stack), i, k, count = 0;
    memset(label, 0, (size_t)l->voxels * sizeof *label);
    for (i = 0; i < l->voxels; i++) {
        int depth = 0;
        if (phi[i] >= 0.0f || label[i]) continue;
        label[i] = ++count;
        stack[depth++] = i;
        while (depth > 0) {
            const int v = stack[--depth], at[3] = { v % size[0], v / step[1] % size[1], v / step[2] };
            for (k = 0; k < 6; k++) {
                const int axis = k / 2, u = v + (k % 2 ? step[axis] : -step[axis]);
                if (at[axis] == (k % 2 ? size[axis] - 1 : 0) || phi[u] >= 0.0f || label[u]) continue;
                label[u] = count;
                stack[depth++] = u;
            }
        }
    }
    free(stack);
    return count;
}

/* Returns whether all voxels about voxel v that have a label have its own: springls_component_of looks at the eight about a point. */
static bool is_alone(const random_life *l, const int *label, int v)
{
    const int *size = l->desc.grid.size, at[3] = { v % size[0], v / size[0] % size[1], v / (size[0] * size[1]) };
    int d, k;
    for (d = 0; d < 27; d++) {
        const int to[3] = { at[0] + d % 3 - 1, at[1] + d / 3 % 3 - 1, at[2] + d / 9 - 1 };
        bool within = true;
        for (k = 0; k < 3; k++) within = within && to[k] >= 0 && to[k] < size[k];
        if (!within) continue;
        k = label[to[0] + size[0] * (to[1] + size[1] * to[2])];
        if (k && k != label[v]) return false;
    }
    return true;
}

/* Checks that the voxels of each part of phi are of one body, and that these are the bodies of the list. */
static void check_bodies(random_life *l, springls_context *ctx, const springls_component *list, int count)
{
    const int *size = l->desc.grid.size;
    float *phi = (float *)malloc((size_t)l->voxels * sizeof *phi), (*points)[3];
    int *label = (int *)malloc(2 * (size_t)l->voxels * sizeof *label), *part = label + l->voxels;
    int i, k, parts, inside = 0, bodies = 0, found = 0, unknown = 0;
    uint32_t *ids, *of_part;
    springls_copy_level_set(ctx, phi);
    parts = flood(l, phi, label);
    points = (float (*)[3])malloc(((size_t)l->voxels + 1) * sizeof *points);
    ids = (uint32_t *)malloc(((size_t)l->voxels + 1) * sizeof *ids);
    of_part = (uint32_t *)calloc((size_t)parts + 1, sizeof *of_part);
    for (i = 0; i < l->voxels; i++) {
        if (!label[i] || !is_alone(l, label, i)) continue;
        points[inside][0] = (float)(i % size[0]);
        points[inside][1] = (float)(i / size[0] % size[1]);
        points[inside][2] = (float)(i / (size[0] * size[1]));
        part[inside++] = label[i];
    }
    springls_to_world(ctx, points[0], inside, points[0]);
    if (springls_component_of(ctx, points[0], inside, ids) != SPRINGLS_OK) l->fault = "component_of";
    for (i = 0; i < inside && !l->fault; i++) {
        if (ids[i] == 0u) l->fault = "component_of finds a body inside";
        if (of_part[part[i]] && of_part[part[i]] != ids[i]) l->fault = "component_of is the same in a connected part of phi";
        of_part[part[i]] = ids[i];
    }
    for (k = 1; k <= parts; k++) unknown += of_part[k] == 0u;
    for (i = 0; i < count && !l->fault; i++) {
        int seen = 0;
        for (k = 1; k <= parts; k++) seen += of_part[k] == list[i].id;
        bodies += !list[i].cavity;
        found += seen > 0;
        if (list[i].cavity && seen) l->fault = "component_of is a body";
    }
    if (!l->fault && (found > bodies || found + unknown < bodies)) l->fault = "each body of the list has voxels";
    free(phi);
    free(label);
    free(points);
    free(ids);
    free(of_part);
}

/* Checks that places inside the mesh lie in bodies of the list. */
static void check_places(random_life *l, springls_context *ctx, const springls_component *list, int count)
{
    enum { PLACES = 32 };
    float points[3 * PLACES];
    uint8_t inside[PLACES];
    uint32_t ids[PLACES];
    int i, k;
    for (i = 0; i < PLACES; i++) world_point(l, 5.0f * l->scale, points + 3 * i);
    LIFE_CHECK(l, springls_sample_inside(ctx, points, PLACES, inside) == SPRINGLS_OK);
    LIFE_CHECK(l, springls_component_of(ctx, points, PLACES, ids) == SPRINGLS_OK);
    for (i = 0; i < PLACES; i++) {
        for (k = 0; k < count && list[k].id != ids[i]; k++) continue;
        LIFE_CHECK(l, !(inside[i] || ids[i]) || (k < count && !list[k].cavity));
    }
}

/* Checks components: a body for each part of the mesh that has an inside, a cavity for each other, and together the volume and the
   area of the mesh. They are switched on where they are off. */
static void check_components(random_life *l, springls_context *ctx)
{
    springls_params p = springls_get_params(ctx);
    const springls_component *list;
    const springls_event *events;
    mesh_part *parts, body = { 0.0, 0.0 }, mesh_body = { 0.0, 0.0 };
    springls_mesh mesh;
    int i, count, part_count, bodies[2] = { 0, 0 };
    if (!p.components && !p.volume_lock) {
        p.components = 1;
        LIFE_CHECK(l, springls_set_params(ctx, &p) == SPRINGLS_OK);
    }
    LIFE_CHECK(l, springls_events(ctx, &events, &count) == SPRINGLS_OK);
    LIFE_CHECK(l, springls_components(ctx, &list, &count) == SPRINGLS_OK);
    for (i = 0; i < count; i++) {
        if (list[i].cavity) continue;
        bodies[0]++;
        body.volume += list[i].volume;
        body.area += list[i].area;
    }
    LIFE_CHECK(l, springls_extract_mesh(ctx, &mesh) == SPRINGLS_OK);
    parts = (mesh_part *)malloc(((size_t)mesh.vertex_count + 1) * sizeof *parts);
    part_count = measure_parts(&mesh, parts);
    for (i = 0; i < part_count; i++) {
        bodies[1] += parts[i].volume > 0.0;
        mesh_body.volume += parts[i].volume;
        mesh_body.area += parts[i].area;
    }
    free(parts);
    springls_mesh_free(ctx, &mesh);
    LIFE_CHECK(l, count == part_count);
    LIFE_CHECK(l, bodies[0] == bodies[1]);
    LIFE_CHECK(l, is_near(body.area, mesh_body.area, 1e-3, 1e-6));
    LIFE_CHECK(l, is_near(body.volume, mesh_body.volume, 1e-3, 1e-4 * mesh_body.area));
    if (p.contouring == SPRINGLS_CONTOURING_LEVEL_SET) check_bodies(l, ctx, list, count);
    else check_places(l, ctx, list, count);
}

/* Checks that springls are finite, ids unique, and that there are no more of them than the manual says (MEMORY). */
static void check_springls(random_life *l, springls_context *ctx)
{
    const int n = springls_count(ctx), *size = l->desc.grid.size;
    int *ids = (int *)malloc(((size_t)n + 1) * sizeof *ids), i, m;
    for (i = 0; i < n; i++) {
        const fixture_springl s = fixture_get(ctx, i);
        bool finite = d3_length(d3_of(s.p)) < 1e6 && d3_length(d3_of(s.a)) < 1e6;
        for (m = 0; m < 3; m++) finite = finite && d3_length(d3_of(s.q[m])) < 1e6;
        if (!finite) l->fault = "springls are finite";
        ids[i] = (int)s.id;
    }
    if (n > 2 * size[0] * size[1] * size[2]) l->fault = "springls are not more than two a voxel";
    qsort(ids, (size_t)n, sizeof *ids, fixture_compare_int);
    for (i = 1; i < n; i++)
        if (ids[i - 1] == ids[i]) l->fault = "ids are unique";
    free(ids);
}

/* Reads a model by the readers of a mask, and returns a hash of what they found. */
static uint64_t read_model(random_life *l, springls_context *ctx, int mask, bool check)
{
    uint64_t hash = 0xcbf29ce484222325u;
    const uint32_t random = fixture_state;
    springls_mesh mesh;
    mesh_part *parts;
    int i, count;
    if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) {
        l->fault = "extract_mesh";
        return 0;
    }
    hash = history_mix_mesh(hash, &mesh);
    for (i = 0; i < READERS; i++)
        if (mask >> i & 1) {
            fixture_state = random + (uint32_t)i;
            hash = readers[i].run(l, ctx, &mesh, hash);
        }
    parts = (mesh_part *)malloc(((size_t)mesh.vertex_count + 1) * sizeof *parts);
    count = measure_parts(&mesh, parts);
    if (check && !l->fault) check_mesh(l, ctx, &mesh, parts, count);
    if (check && !l->fault) check_springls(l, ctx);
    free(parts);
    springls_mesh_free(ctx, &mesh);
    fixture_state = random;
    return hash;
}

/* ---- a life ---- */

/* Chooses the grid and the parameters, and creates the contexts. Small bodies take a quarter of the time. */
static bool life_begin(random_life *l, uint32_t seed)
{
    static const int sides[] = { 12, 12, 16, 16, 19, 24, LARGEST_GRID };
    springls_params params;
    springls_desc twin;
    const bool large = seed % 16 == 0;
    const int side = large ? sides[2 + seed / 16 % 5] : sides[seed % 7];
    int k;
    memset(l, 0, sizeof *l);
    l->seed = seed;
    fixture_seed(seed);
    l->scale = large ? 1.0f : 0.4f;
    l->most_springls = large ? 2500 : 300;
    params = one_in(3) ? springls_paper_params() : springls_default_params();
    if (one_in(4)) params.band_half_width = 2.5f;
    l->desc = fixture_desc(side, &params);
    l->desc.follow = side % 8 == 0 && one_in(4);
    for (k = 0; k < 3; k++) l->desc.grid.spacing[k] = side <= 16 && seed % 2 ? 0.5 : 1.0;
    for (k = 0; k < 3; k++) l->desc.grid.origin[k] = side <= 16 ? 2.5 * k - 1.0 : 0.0;
    l->voxels = side * side * side;
    if (springls_create(&l->desc, &l->model) != SPRINGLS_OK || springls_create(&l->desc, &l->other) != SPRINGLS_OK) return false;
    if (seed % 6 == 1 && springls_create(&l->desc, &l->quiet) != SPRINGLS_OK) return false;
    l->desc.params = NULL; /* of the twin: they come with the snapshot */
    twin = l->desc;
    twin.params = &params;
    twin.allocator = dirty_allocator();
    twin.tasks = fixture_tasks(&l->workers, 3, 0);
    return springls_create(&twin, &l->twin) == SPRINGLS_OK;
}

static void life_end(random_life *l)
{
    springls_chunks_destroy(l->twin, l->chunks);
    springls_destroy(l->model);
    springls_destroy(l->twin);
    springls_destroy(l->quiet);
    springls_destroy(l->other);
    free(l->block);
    free(l->again);
    free(l->saved);
}

/* Makes a snapshot in *block, which is freed before. */
static bool take_snapshot(springls_context *ctx, springls_snapshot_kind kind, void **block, size_t *size)
{
    free(*block);
    *block = NULL;
    if (springls_snapshot(ctx, kind, NULL, 0, size) != SPRINGLS_OK) return false;
    *block = malloc(*size);
    return *block && springls_snapshot(ctx, kind, *block, *size, size) == SPRINGLS_OK;
}

/* Checks that a context has the model's state and snapshot. */
static void check_equal(random_life *l, springls_context *ctx, const char *hash_differs, const char *bytes_differ)
{
    size_t size;
    if (l->fault) return;
    if (springls_state_hash(ctx) != springls_state_hash(l->model)) l->fault = hash_differs;
    else if (!take_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &l->again, &size)) l->fault = "snapshot";
    else if (size != l->size || memcmp(l->again, l->block, size) != 0) l->fault = bytes_differ;
}

static void restore_block(random_life *l, springls_context *ctx)
{
    if (l->fault) return;
    if (springls_restore(ctx, l->block, l->size) != SPRINGLS_OK) {
        l->fault = "restore takes what snapshot has made";
        if (l->verbose) printf("  %s\n", springls_last_error(ctx));
    }
    check_equal(l, ctx, "a restored model has the hash", "a restored model has the snapshot");
}

/* Brings the twin's chunks up to date in pieces; its hash stays that of the model. */
static void update_chunks(random_life *l, const springls_chunk **changed, int *n)
{
    bool done = false;
    LIFE_CHECK(l, springls_chunks_begin(l->twin, l->chunks) == SPRINGLS_OK);
    while (!done) {
        LIFE_CHECK(l, !one_in(20) || springls_state_hash(l->twin) == springls_state_hash(l->model));
        LIFE_CHECK(l, springls_chunks_continue(l->twin, l->chunks, 0.0, changed, n, &done) == SPRINGLS_OK);
    }
}

/* Checks that the twin's chunks together are the mesh. */
static void check_chunks(random_life *l)
{
    static struct { int brick[3], triangles; } known[4096];
    static int count;
    const springls_chunks_desc desc = { .tolerance = -1.0f, .correspondences = true };
    const springls_chunk *changed;
    springls_mesh mesh;
    int i, k, n, triangles = 0;
    if (!l->chunks) {
        count = 0;
        LIFE_CHECK(l, springls_chunks_create(l->twin, &desc, &l->chunks) == SPRINGLS_OK);
    }
    update_chunks(l, &changed, &n);
    if (l->fault) return;
    for (i = 0; i < n; i++) {
        for (k = 0; k < count && memcmp(known[k].brick, changed[i].brick, sizeof known[k].brick) != 0; k++) {}
        LIFE_CHECK(l, k < 4096);
        if (k == count) memcpy(known[count++].brick, changed[i].brick, sizeof known[k].brick);
        known[k].triangles = changed[i].triangle_count;
    }
    for (k = 0; k < count; k++) triangles += known[k].triangles;
    LIFE_CHECK(l, springls_extract_mesh(l->twin, &mesh) == SPRINGLS_OK);
    n = mesh.triangle_count;
    springls_mesh_free(l->twin, &mesh);
    LIFE_CHECK(l, triangles == n);
}

/* Restores the model in a fresh context, compares what both answer, and makes that the twin. */
static void replace_twin(random_life *l)
{
    springls_desc desc = l->desc;
    springls_context *fresh;
    uint64_t answers;
    desc.allocator = dirty_allocator();
    desc.tasks = fixture_tasks(&l->workers, 3, 0);
    LIFE_CHECK(l, springls_create(&desc, &fresh) == SPRINGLS_OK);
    restore_block(l, fresh);
    if (!l->fault) {
        const int mask = any_readers(0);
        answers = read_model(l, l->twin, mask, true);
        if (!l->fault && read_model(l, fresh, mask, true) != answers) l->fault = "a fresh model answers as the twin";
    }
    check_equal(l, l->twin, "reading keeps the hash", "reading keeps the snapshot");
    check_equal(l, fresh, "reading a fresh model keeps the hash", "reading a fresh model keeps the snapshot");
    if (!l->fault) check_components(l, fresh);
    restore_block(l, fresh);
    springls_chunks_destroy(l->twin, l->chunks);
    l->chunks = NULL;
    springls_destroy(l->twin);
    l->twin = fresh;
}

/* Reads the twin in some ways: it stays as it was. */
static void read_twin(random_life *l)
{
    const springls_params p = springls_get_params(l->twin);
    if (l->fault) return;
    if (one_in(2)) read_model(l, l->twin, any_readers(1), one_in(2));
    if (!l->fault && one_in(6)) check_chunks(l);
    if (!l->fault && (p.components || p.volume_lock) && one_in(4)) check_components(l, l->twin);
    check_equal(l, l->twin, "reading keeps the hash", "reading keeps the snapshot");
}

/* Makes the model's last call, an input, on a new context: what was there before does not matter. random: of the call. */
static void repeat_input(random_life *l, uint32_t random)
{
    const springls_params params = springls_get_params(l->model);
    springls_desc desc = l->desc;
    life_side side;
    desc.params = &params;
    side.life = l;
    side.is_twin = 0;
    LIFE_CHECK(l, springls_create(&desc, &side.ctx) == SPRINGLS_OK);
    fixture_seed(random);
    if (any_input(&side) != SPRINGLS_OK || springls_state_hash(side.ctx) != springls_state_hash(l->model))
        l->fault = "an input is that of a new model";
    springls_destroy(side.ctx);
}

/* Makes the same call on all sides, and checks all. */
static void life_call(random_life *l)
{
    life_side sides[3];
    springls_status status[3];
    const int side_count = l->quiet ? 3 : 2;
    const int which = any_call(l);
    uint32_t next, state;
    int k;
    l->name = calls[which].name;
    next = fixture_bits();
    state = fixture_state;
    for (k = 0; k < side_count; k++) {
        sides[k].ctx = k == 2 ? l->quiet : k ? l->twin : l->model;
        sides[k].life = l;
        sides[k].is_twin = k == 1;
        fixture_seed(next);
        status[k] = calls[which].run(&sides[k]);
    }
    if (status[0] == SPRINGLS_OK && calls[which].run == any_input) repeat_input(l, next);
    fixture_state = state;
    if (l->quiet && status[0] != status[2]) l->fault = "a call ends as that of a model that nobody reads";
    if (status[0] != status[1]) l->fault = "the twin's call ends as the model's";
    if (!l->fault && !take_snapshot(l->model, SPRINGLS_SNAPSHOT_KIND_ALL, &l->block, &l->size)) l->fault = "snapshot";
    if (l->verbose)
        printf("  %3d %-16s %-20s %5d springls, %zu bytes\n", l->call, l->name, springls_status_string(status[0]),
               springls_count(l->model), l->size);
    if (l->verbose && status[0] != SPRINGLS_OK) printf("      %s\n", springls_last_error(l->model));
    if (l->verbose && status[0] != status[1]) printf("      twin: %s\n", springls_last_error(l->twin));
    check_equal(l, l->twin, "the twin goes on to the hash", "the twin goes on to the snapshot");
    if (one_in(3)) restore_block(l, l->twin);
    read_twin(l);
    if (l->call % 10 == 9 && !l->fault) replace_twin(l);
    if (!l->fault && one_in(15)
        && !take_snapshot(l->model, one_in(2) ? SPRINGLS_SNAPSHOT_KIND_ALL : SPRINGLS_SNAPSHOT_KIND_FRAME, &l->saved,
                          &l->saved_size))
        l->fault = "snapshot";
}

/* Leads a life; returns whether all held. */
static bool live(uint32_t seed, int verbose, random_life *l)
{
    bool good = life_begin(l, seed);
    l->verbose = verbose;
    if (!good) l->fault = "create";
    for (l->call = 0; l->call < CALLS && !l->fault; l->call++) life_call(l);
    if (l->quiet)
        check_equal(l, l->quiet, "a model that nobody has read has the hash", "a model that nobody has read has the snapshot");
    good = !l->fault;
    if (!good)
        printf("\n  life %lu, call %d, %s: does not hold: %s\n", (unsigned long)seed, l->call - 1, l->name ? l->name : "create",
               l->fault);
    life_end(l);
    return good;
}

/* Returns how many lives are led: a device, and what watches threads or each value, takes ten times the time and more; what watches
   memory takes four times as long. */
static int life_count(void)
{
#if defined(__SANITIZE_THREAD__) || defined(TEST_MEMORY_UNFILLED)
    return LIVES / 10;
#elif defined(__SANITIZE_ADDRESS__)
    return fixture_backend() ? LIVES / 10 : LIVES / 3;
#elif defined(SPRINGLS_NO_SIMD)
    return LIVES / 3; /* what differs there are bits, which other tests compare */
#else
    return fixture_backend() ? LIVES / 10 : LIVES;
#endif
}

TEST lives_hold(uint32_t first, int count)
{
    static random_life life;
    int i;
    for (i = 0; i < count; i++) ASSERT(live(first + (uint32_t)i, 0, &life));
    PASS();
}

/* Leads new lives until the minutes are over, and returns how many had a fault. */
static int live_for(double minutes)
{
    static random_life life;
    const time_t end = time(NULL) + (time_t)(60.0 * minutes);
    uint32_t seed = (uint32_t)time(NULL);
    long count = 0, lives = 0;
    int faults = 0;
    for (; time(NULL) < end; seed++, lives++) {
        faults += !live(seed, 0, &life);
        count += life.call;
        fflush(stdout);
    }
    printf("%ld calls in %ld random lives, %d findings\n", count, lives, faults);
    return faults;
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    static random_life life;
    const char *minutes = getenv("LIVES_MINUTES");
    int i, faults = 0;
    if (minutes && minutes[0]) return live_for(atof(minutes)) > 0;
    if (argc > 1 && argv[1][0] >= '0' && argv[1][0] <= '9') {
        for (i = 1; i < argc; i++) faults += !live((uint32_t)strtoul(argv[i], NULL, 10), 1, &life);
        return faults > 0;
    }
    GREATEST_MAIN_BEGIN();
    for (i = 0; i < 3; i++) RUN_TESTp(lives_hold, (uint32_t)(FIRST_LIFE + i * life_count() / 3), life_count() / 3);
    GREATEST_MAIN_END();
}
