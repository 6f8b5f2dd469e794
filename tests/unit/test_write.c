/* test_write.c - springls that the caller moves: springls_write, and forces that are evaluated by springl. */
#include "fixtures.h"

enum { VERTICES = 1, PARTICLES = 2, BOTH = 3 };

/* The places of some springls: 9 and 3 floats each, to be freed. */
typedef struct places { float *vertices, *particles; int count; } places;

static places places_of(const springls_context *ctx, int first, int count)
{
    places at;
    int i, m;
    at.count = count;
    at.vertices = (float *)malloc((size_t)count * 9 * sizeof(float));
    at.particles = (float *)malloc((size_t)count * 3 * sizeof(float));
    for (i = 0; i < count; i++) {
        springls__v3 p = fixture_particle(ctx, first + i);
        memcpy(at.particles + 3 * i, &p, sizeof p);
        for (m = 0; m < 3; m++) {
            springls__v3 q = fixture_vertex(ctx, first + i, m);
            memcpy(at.vertices + 9 * i + 3 * m, &q, sizeof q);
        }
    }
    return at;
}

static void places_free(places *at)
{
    free(at->vertices);
    free(at->particles);
}

/* Writes springls first .. first + count - 1, moved by v: all of them, or one part, which the other follows. */
static springls_status shift(springls_context *ctx, int first, int count, float x, float y, float z, int parts)
{
    float v[3];
    places at = places_of(ctx, first, count);
    springls_status status;
    int i;
    v[0] = x;
    v[1] = y;
    v[2] = z;
    for (i = 0; i < 9 * count; i++) at.vertices[i] += v[i % 3];
    for (i = 0; i < 3 * count; i++) at.particles[i] += v[i % 3];
    status = springls_write(ctx, first, count, parts & VERTICES ? at.vertices : NULL, parts & PARTICLES ? at.particles : NULL);
    places_free(&at);
    return status;
}

/* No time passes: phi follows what has been written. */
static springls_status follow(springls_context *ctx)
{
    springls_step_desc step;
    memset(&step, 0, sizeof step);
    return springls_step(ctx, &step);
}

/* The centre of mass of the extracted mesh, and what it encloses. */
static d3 center_of_mass(springls_context *ctx, double *volume)
{
    d3 sum = d3_make(0.0, 0.0, 0.0);
    springls_mesh mesh;
    int t, m;
    *volume = 0.0;
    if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) return sum;
    for (t = 0; t < mesh.triangle_count; t++) {
        d3 q[3];
        double v;
        for (m = 0; m < 3; m++) {
            const float *x = mesh.positions + 3 * mesh.triangles[3 * t + m];
            q[m] = d3_make((double)x[0], (double)x[1], (double)x[2]);
        }
        v = d3_dot(q[0], d3_cross(q[1], q[2])) / 6.0;
        *volume += v;
        sum = d3_mad(sum, d3_add(q[0], d3_add(q[1], q[2])), 0.25 * v);
    }
    springls_mesh_free(ctx, &mesh);
    return d3_scale(sum, 1.0 / *volume);
}

/* ---- springls_write ---- */

/* Springls are where they have been put; the level set stays until the next step, and then is there too. */
TEST the_level_set_follows(int parts)
{
    springls_context *ctx = fixture_of_zero_level(fixture_sphere(32, NULL, 13.3f, 15.2f, 15.6f, 8.0f));
    int i, k, count = springls_count(ctx);
    double volume, before;
    d3 old = center_of_mass(ctx, &before), now;
    for (k = 1; k <= 3; k++) {
        places at = places_of(ctx, 0, count);
        uint32_t id = springls_ids(ctx)[count / 2];
        ASSERT_OK(shift(ctx, 0, count, 1.3f, 0.0f, 0.0f, parts));
        for (i = 0; i < count; i++) {
            springls__v3 p = fixture_particle(ctx, i), q = fixture_vertex(ctx, i, 2);
            ASSERT_IN_RANGE((double)at.particles[3 * i] + 1.3, (double)p.x, 1e-5);
            ASSERT_IN_RANGE((double)at.particles[3 * i + 1], (double)p.y, 1e-5);
            ASSERT_IN_RANGE((double)at.vertices[9 * i + 6] + 1.3, (double)q.x, 1e-5);
        }
        ASSERT_EQ(id, springls_ids(ctx)[count / 2]);
        now = center_of_mass(ctx, &volume);
        ASSERT_IN_RANGE(old.x + 1.3 * (k - 1), now.x, 0.02);
        ASSERT_OK(follow(ctx));
        now = center_of_mass(ctx, &volume);
        ASSERT_IN_RANGE(old.x + 1.3 * k, now.x, 0.02);
        ASSERT_IN_RANGE(old.y, now.y, 0.02);
        ASSERT_IN_RANGE(old.z, now.z, 0.02);
        ASSERT_IN_RANGE(1.0, volume / before, 0.001);
        count = springls_count(ctx);
        places_free(&at);
    }
    ASSERT(springls_time(ctx) == 0.0);
    springls_destroy(ctx);
    PASS();
}

/* What replaces phi as a whole lets it follow first: nothing that has been written is lost. */
TEST tools_follow_first(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 13.3f, 15.2f, 15.6f, 7.0f);
    springls_box corner = { { 13.3f, 15.2f, 15.6f }, { 1.0f, 1.0f, 1.0f } };
    double volume, old;
    d3 before = center_of_mass(ctx, &old), now;
    int tool;
    for (tool = 0; tool < 4; tool++) {
        ASSERT_OK(shift(ctx, 0, springls_count(ctx), 1.2f, 0.0f, 0.0f, BOTH));
        if (tool == 0) ASSERT_OK(springls_remesh(ctx));
        if (tool == 1) ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_UNION, springls_implicit_box, &corner));
        if (tool == 2) ASSERT_OK(springls_offset(ctx, 0.5f));
        if (tool == 3) ASSERT_OK(springls_smooth(ctx, 0.5f, true));
        now = center_of_mass(ctx, &volume);
        ASSERT_IN_RANGE(before.x + 1.2 * (tool + 1), now.x, 0.04);
    }
    springls_destroy(ctx);
    PASS();
}

/* Motion adds up until phi follows; beyond the band phi is made anew. */
TEST motion_adds_up(void)
{
    springls_context *ctx = fixture_of_zero_level(fixture_sphere(32, NULL, 11.0f, 15.5f, 15.5f, 6.0f));
    int count = springls_count(ctx);
    double volume, before;
    d3 old = center_of_mass(ctx, &before), now;
    ASSERT_OK(shift(ctx, 0, count, 0.4f, 0.0f, 0.0f, BOTH));
    ASSERT_OK(fixture_translate(ctx, 0.5f, 0.0f, 0.0f));
    ASSERT_OK(shift(ctx, 0, count, 0.4f, 0.0f, 0.0f, VERTICES));
    ASSERT_OK(follow(ctx));
    now = center_of_mass(ctx, &volume);
    ASSERT_IN_RANGE(old.x + 1.3, now.x, 0.02);
    ASSERT_IN_RANGE(1.0, volume / before, 0.002);
    ASSERT_OK(shift(ctx, 0, springls_count(ctx), 6.5f, 0.0f, 0.0f, PARTICLES));
    ASSERT_OK(follow(ctx));
    now = center_of_mass(ctx, &volume);
    ASSERT_IN_RANGE(old.x + 7.8, now.x, 0.02);
    ASSERT_IN_RANGE(1.0, volume / before, 0.01);
    springls_destroy(ctx);
    PASS();
}

/* The stage that makes phi from springls alone follows too, as far as they have gone. */
TEST unsigned_to_signed_follows(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 11.0f, 15.5f, 15.5f, 6.0f);
    double volume, before;
    d3 old = center_of_mass(ctx, &before), now;
    ASSERT_OK(shift(ctx, 0, springls_count(ctx), 8.0f, 0.0f, 0.0f, BOTH));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    now = center_of_mass(ctx, &volume);
    ASSERT_IN_RANGE(old.x + 8.0, now.x, 0.1);
    springls_destroy(ctx);
    PASS();
}

/* A range moves, the others stay; ranges one after the other are one write. */
TEST ranges_are_parts_of_one_write(void)
{
    springls_context *whole = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    springls_context *pieces = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    int count = springls_count(whole), first, i;
    fixture_springl *before = fixture_copy(pieces);
    ASSERT_OK(shift(pieces, 100, 37, 0.5f, -0.25f, 0.75f, BOTH));
    for (i = 0; i < count; i++) {
        fixture_springl now = fixture_get(pieces, i);
        if (i < 100 || i >= 137) ASSERT_MEM_EQ(&before[i], &now, sizeof now);
        else ASSERT_EQ(before[i].p.x + 0.5f, now.p.x);
    }
    ASSERT_OK(shift(pieces, 0, 100, 0.5f, -0.25f, 0.75f, BOTH));
    for (first = 137; first < count; first += 50)
        ASSERT_OK(shift(pieces, first, springls__imin(50, count - first), 0.5f, -0.25f, 0.75f, BOTH));
    ASSERT_OK(shift(whole, 0, count, 0.5f, -0.25f, 0.75f, BOTH));
    ASSERT(springls_state_hash(whole) == springls_state_hash(pieces));
    for (i = 0; i < 6; i++) {
        ASSERT_OK(follow(whole));
        ASSERT_OK(follow(pieces));
    }
    ASSERT(springls_state_hash(whole) == springls_state_hash(pieces));
    free(before);
    springls_destroy(whole);
    springls_destroy(pieces);
    PASS();
}

/* What is not given follows what is: the triangle without turning, the particle at its place in the triangle. */
TEST a_missing_part_follows(void)
{
    const double weight[3] = { 0.5, 0.3, 0.2 };
    springls_context *ctx = fixture_context(32, NULL);
    springls__v3 q[3], to[3], p;
    d3 at = d3_make(0.0, 0.0, 0.0), off;
    float vertices[9], particle[3];
    int m;
    q[0] = springls__v3_make(10.0f, 10.0f, 10.0f);
    q[1] = springls__v3_make(12.0f, 10.0f, 10.0f);
    q[2] = springls__v3_make(10.0f, 12.0f, 10.0f);
    to[0] = springls__v3_make(11.0f, 9.0f, 13.0f);
    to[1] = springls__v3_make(11.0f, 12.0f, 13.5f);
    to[2] = springls__v3_make(8.0f, 9.0f, 12.0f);
    p = springls__v3_make(10.6f, 10.4f, 10.125f); /* an eighth above the place with those weights */
    fixture_add_at(ctx, q[0], q[1], q[2], p, p);
    for (m = 0; m < 3; m++) {
        memcpy(vertices + 3 * m, &to[m], sizeof to[m]);
        at = d3_mad(at, d3_of(to[m]), weight[m]);
    }
    ASSERT_OK(springls_write(ctx, 0, 1, vertices, NULL));
    off = d3_sub(d3_of(fixture_particle(ctx, 0)), at);
    ASSERT_LT(d3_distance(off, d3_make(0.0, 0.0, 0.125)), 1e-5);
    p = fixture_origin(ctx, 0);
    ASSERT_EQ(10.6f, p.x); /* the correspondence stays */
    p = fixture_particle(ctx, 0);
    particle[0] = p.x - 2.0f;
    particle[1] = p.y + 1.0f;
    particle[2] = p.z + 0.5f;
    ASSERT_OK(springls_write(ctx, 0, 1, NULL, particle));
    for (m = 0; m < 3; m++)
        ASSERT_LT(d3_distance(d3_of(fixture_vertex(ctx, 0, m)), d3_add(d3_of(to[m]), d3_make(-2.0, 1.0, 0.5))), 1e-5);
    memset(vertices, 0, sizeof vertices); /* a triangle without area goes and comes back */
    ASSERT_OK(springls_write(ctx, 0, 1, vertices, NULL));
    for (m = 0; m < 3; m++) memcpy(vertices + 3 * m, &q[m], sizeof q[m]);
    ASSERT_OK(springls_write(ctx, 0, 1, vertices, NULL));
    ASSERT_LT(d3_distance(d3_of(fixture_particle(ctx, 0)), d3_make(10.5, 10.5, 10.0)), 1.0);
    springls_destroy(ctx);
    PASS();
}

TEST wrong_writes_change_nothing(void)
{
    springls_context *ctx = fixture_sphere(24, NULL, 11.5f, 11.5f, 11.5f, 5.0f), *empty = fixture_context(24, NULL);
    int count = springls_count(ctx);
    places at = places_of(ctx, 0, count);
    const float bad[4] = { (float)NAN, (float)INFINITY, -(float)INFINITY, 2e6f };
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    uint64_t before = springls_state_hash(ctx);
    bool done;
    int i;
    for (i = 0; i < 9 * count; i++) at.vertices[i] += 0.25f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_write(NULL, 0, 1, at.vertices, at.particles));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_write(ctx, -1, 1, at.vertices, at.particles));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_write(ctx, 0, -1, at.vertices, at.particles));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_write(ctx, 0, count + 1, at.vertices, at.particles));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_write(ctx, count, 1, at.vertices, at.particles));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_write(ctx, INT32_MAX, INT32_MAX, at.vertices, at.particles));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_write(ctx, 0, count, NULL, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_write(empty, 0, 1, at.vertices, NULL));
    ASSERT_OK(springls_write(ctx, count, 0, NULL, NULL));
    ASSERT_OK(springls_write(empty, 0, 0, NULL, NULL));
    for (i = 0; i < 4; i++) {
        float good = at.vertices[9 * (count - 1) + 4];
        at.vertices[9 * (count - 1) + 4] = bad[i];
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_write(ctx, 0, count, at.vertices, NULL));
        at.vertices[9 * (count - 1) + 4] = good;
        good = at.particles[3 * 17 + 2];
        at.particles[3 * 17 + 2] = bad[i];
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_write(ctx, 3, 20, at.vertices, at.particles));
        ASSERT(strstr(springls_last_error(ctx), "springl 20") != NULL);
        at.particles[3 * 17 + 2] = good;
    }
    ASSERT(before == springls_state_hash(ctx));
    ASSERT_OK(springls_step_begin(ctx, &step));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_write(ctx, 0, count, at.vertices, NULL));
    ASSERT(springls_step_in_progress(ctx));
    for (done = false; !done;) ASSERT_OK(springls_step_continue(ctx, 1.0, &done));
    ASSERT_OK(springls_write(ctx, 0, 1, at.vertices, NULL));
    places_free(&at);
    springls_destroy(empty);
    springls_destroy(ctx);
    PASS();
}

/* Springls may leave the grid, and the model ends at its border, as when they are advected there. */
TEST springls_may_leave_the_grid(void)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    springls_measures measures;
    int k;
    p.resample_period = 1;
    ctx = fixture_sphere(24, &p, 18.0f, 11.5f, 11.5f, 4.0f);
    for (k = 0; k < 5; k++) {
        ASSERT_OK(shift(ctx, 0, springls_count(ctx), 1.5f, 0.0f, 0.0f, BOTH));
        ASSERT_OK(follow(ctx));
    }
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_EQ(1, measures.components);
    ASSERT_LT((double)measures.upper[0], 24.0);
    ASSERT_LT(measures.volume, 0.5 * 268.0);
    springls_destroy(ctx);
    PASS();
}

/* A snapshot between a write and the step that follows it holds what has been written. */
TEST snapshots_hold_what_is_written(void)
{
    springls_context *ctx = fixture_sphere(24, NULL, 11.5f, 11.5f, 11.5f, 5.0f), *other = fixture_context(24, NULL);
    size_t size;
    void *block;
    ASSERT_OK(follow(ctx));
    ASSERT_OK(shift(ctx, 0, springls_count(ctx) / 2, 0.6f, 0.3f, 0.0f, VERTICES));
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    block = malloc(size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    ASSERT_OK(springls_restore(other, block, size));
    ASSERT_OK(follow(ctx));
    ASSERT_OK(follow(other));
    ASSERT(springls_state_hash(ctx) == springls_state_hash(other));
    free(block);
    springls_destroy(other);
    springls_destroy(ctx);
    PASS();
}

/* ---- forces by springl ---- */

enum { MOST = 4000 };

/* What callbacks have been given. */
typedef struct witness {
    const springls_context *ctx;
    uint32_t ids[MOST];
    springls__v3 particle[MOST], origin[MOST], target[MOST];
    int velocities[MOST][4], pressures[MOST], affines[MOST], wrong[MOST];
    float dt;
} witness;

static void witness_see(witness *w, const springls_batch *batch, bool at_begin)
{
    int i;
    for (i = 0; i < batch->count; i++) {
        int n = batch->springls[i];
        const float *x = batch->points + 3 * i, *a = batch->correspondences + 3 * i;
        springls__v3 normal = springls__v3_make(batch->normals[3 * i], batch->normals[3 * i + 1], batch->normals[3 * i + 2]);
        w->wrong[n] += batch->ids[i] != w->ids[n];
        w->wrong[n] += memcmp(a, &w->origin[n], 3 * sizeof *a) != 0;
        w->wrong[n] += batch->vertex < 0 && at_begin && memcmp(x, &w->particle[n], 3 * sizeof *x) != 0;
        w->wrong[n] += fabs((double)springls__length(normal) - 1.0) > 1e-4;
    }
}

/* Moves every point by what its springl lacks to its target: the springl as a whole. */
static void witness_velocity(void *user, const springls_batch *batch, float *out)
{
    witness *w = (witness *)user;
    int i;
    witness_see(w, batch, batch->time == 0.0f);
    for (i = 0; i < batch->count; i++) {
        int n = batch->springls[i];
        springls__v3 v = springls__scale(springls__sub(w->target[n], w->particle[n]), 1.0f / w->dt);
        w->velocities[n][batch->vertex + 1]++;
        memcpy(out + 3 * i, &v, sizeof v);
    }
}

static void witness_pressure(void *user, const springls_batch *batch, float *out)
{
    witness *w = (witness *)user;
    int i;
    witness_see(w, batch, batch->time == 0.0f);
    for (i = 0; i < batch->count; i++) {
        w->pressures[batch->springls[i]]++;
        w->wrong[batch->springls[i]] += batch->vertex != -1;
        out[i] = 0.0f;
    }
}

static void witness_affine(void *user, const springls_batch *batch, float *out)
{
    witness *w = (witness *)user;
    int i;
    witness_see(w, batch, batch->time == 0.0f);
    memset(out, 0, 12 * (size_t)batch->count * sizeof *out);
    for (i = 0; i < batch->count; i++) {
        w->affines[batch->springls[i]]++;
        w->wrong[batch->springls[i]] += batch->vertex != -1;
        out[12 * i + 7] = 0.125f; /* along y */
    }
}

/* Every springl comes once a stage, with its index and id, for any number of threads; it goes where its index sends it. */
TEST callbacks_are_given_springls(int own, int threads)
{
    static witness w;
    fixture_workers workers;
    springls_params p = springls_default_params();
    springls_desc desc = fixture_desc(32, &p);
    springls_sphere ball = fixture_ball(15.5f, 15.5f, 15.5f, 8.0f);
    springls_forces forces = fixture_forces(NULL, &w);
    springls_context *ctx = NULL;
    float speed;
    int i, k, m, count;
    p.vertex_velocity = own;
    desc.tasks = fixture_tasks(&workers, threads, 1);
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    for (k = 0; k < 5; k++) ASSERT_OK(follow(ctx)); /* resampled: ids are no indices any more */
    count = springls_count(ctx);
    ASSERT_LT(count, MOST);
    memset(&w, 0, sizeof w);
    w.ctx = ctx;
    w.dt = 0.5f;
    fixture_seed(5);
    for (i = 0; i < count; i++) {
        w.ids[i] = springls_ids(ctx)[i];
        w.particle[i] = fixture_particle(ctx, i);
        w.origin[i] = fixture_origin(ctx, i);
        w.target[i] = springls__add(w.particle[i], springls__scale(fixture_direction(), 0.5f));
    }
    forces.velocity_batch = witness_velocity;
    forces.pressure_batch = witness_pressure;
    forces.affine_batch = witness_affine;
    ASSERT_OK(springls_max_speed(ctx, &forces, 0.0f, &speed));
    ASSERT_GT(speed, 1.0f);
    memset(w.velocities, 0, sizeof w.velocities);
    memset(w.pressures, 0, sizeof w.pressures);
    memset(w.affines, 0, sizeof w.affines);
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, w.dt));
    for (i = 0; i < count; i++) {
        d3 to = d3_add(d3_of(w.target[i]), d3_make(0.0, 0.0625, 0.0));
        ASSERT_EQ(0, w.wrong[i]);
        ASSERT_EQ(4, w.pressures[i]);
        ASSERT_EQ(4, w.affines[i]);
        for (m = 0; m < 4; m++) ASSERT_EQ(m == 0 ? 6 : own ? 4 : 0, w.velocities[i][m]);
        ASSERT_LT(d3_distance(to, d3_of(fixture_particle(ctx, i))), 1e-4);
    }
    springls_destroy(ctx);
    PASS();
}

static void breeze(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < count; i++) {
        out[3 * i] = 0.3f + 0.01f * points[3 * i + 1];
        out[3 * i + 1] = 0.02f * (points[3 * i + 2] - 11.5f) * time;
        out[3 * i + 2] = -0.1f;
    }
}

static void breeze_batch(void *user, const springls_batch *batch, float *out)
{
    breeze(user, batch->points, batch->count, batch->time, out);
}

/* A field has the same bits from a batch callback as from a plain one. */
TEST batches_are_points_too(void)
{
    springls_context *plain = fixture_sphere(24, NULL, 10.5f, 11.5f, 11.5f, 5.0f);
    springls_context *batch = fixture_sphere(24, NULL, 10.5f, 11.5f, 11.5f, 5.0f);
    springls_forces forces = fixture_forces(breeze, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    int i;
    for (i = 0; i < 6; i++) {
        forces.velocity = breeze;
        forces.velocity_batch = NULL;
        ASSERT_OK(springls_step(plain, &step));
        forces.velocity = NULL;
        forces.velocity_batch = breeze_batch;
        ASSERT_OK(springls_step(batch, &step));
        ASSERT(springls_state_hash(plain) == springls_state_hash(batch));
    }
    springls_destroy(plain);
    springls_destroy(batch);
    PASS();
}

SUITE(writing)
{
    int parts;
    for (parts = VERTICES; parts <= BOTH; parts++) RUN_TESTp(the_level_set_follows, parts);
    RUN_TEST(tools_follow_first);
    RUN_TEST(motion_adds_up);
    RUN_TEST(unsigned_to_signed_follows);
    RUN_TEST(ranges_are_parts_of_one_write);
    RUN_TEST(a_missing_part_follows);
    RUN_TEST(wrong_writes_change_nothing);
    RUN_TEST(springls_may_leave_the_grid);
    RUN_TEST(snapshots_hold_what_is_written);
}

SUITE(batches)
{
    RUN_TESTp(callbacks_are_given_springls, 0, 1);
    RUN_TESTp(callbacks_are_given_springls, 1, 1);
    RUN_TESTp(callbacks_are_given_springls, 1, 4);
    RUN_TEST(batches_are_points_too);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(writing);
    RUN_SUITE(batches);
    GREATEST_MAIN_END();
}
