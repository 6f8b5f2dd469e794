/* test_contact.c - bodies that come closer than a voxel part again as they were. */
#include "fixtures.h"
#include "../../src/stages/contract.h"
#include "../../src/stages/project.h"
#include "../../src/stages/relax.h"

/* ---- two bodies that are carried towards each other along x and away again, by an exact flow ---- */

typedef enum body_shape { BALLS, BALL_AND_PLATE, BOXES, FINGERS } body_shape;

/* The plane x = center parts the two bodies; gap: of the model that is set. */
typedef struct meeting { body_shape shape; double center, gap, speed; } meeting;

static double ball(double x, double y, double z, double r) { return sqrt(x * x + y * y + z * z) - r; }

static double rounded_box(double x, double y, double z, const double half[3], double r)
{
    double qx = fabs(x) - half[0] + r, qy = fabs(y) - half[1] + r, qz = fabs(z) - half[2] + r;
    double inner = fmin(fmax(qx, fmax(qy, qz)), 0.0);
    return ball(fmax(qx, 0.0), fmax(qy, 0.0), fmax(qz, 0.0), r) + inner;
}

/* A finger along y from a base at y = -10. */
static double fingers(double x, double y, double z, double gap)
{
    static const double half[3] = { 12.0, 4.0, 6.0 };
    double up = y > 9.0 ? y - 9.0 : y < -10.0 ? y + 10.0 : 0.0, finger = ball(fabs(x) - 0.5 * gap - 3.5, up, z, 3.5);
    double base = rounded_box(x, y + 10.0, z, half, 3.0), blend = fmax(4.0 - fabs(finger - base), 0.0);
    return fmin(finger, base) - blend * blend / 16.0;
}

static void meeting_distance(void *user, const float *points, int count, float *out)
{
    static const double half[3] = { 4.0, 10.0, 10.0 }, box[3] = { 5.0, 5.0, 5.0 };
    const meeting *m = (const meeting *)user;
    int i;
    for (i = 0; i < count; i++, points += 3) {
        double x = points[0] - m->center, y = points[1] - m->center, z = points[2] - m->center, at = 0.5 * m->gap;
        if (m->shape == BALLS) out[i] = (float)ball(fabs(x) - at - 5.0, y, z, 5.0);
        else if (m->shape == BOXES) out[i] = (float)rounded_box(fabs(x) - at - 5.0, y, z, box, 0.0);
        else if (m->shape == FINGERS) out[i] = (float)fingers(x, y, z, m->gap);
        else out[i] = (float)fmin(ball(x + at + 5.0, y, z, 5.0), rounded_box(x - at - 4.0, y, z, half, 3.0));
    }
}

/* Moves the two sides of the plane apart as rigid bodies; fingers bend, the more the further from their base. */
static void meeting_velocity(void *user, const float *x, int count, float time, float *v)
{
    const meeting *m = (const meeting *)user;
    int i;
    (void)time;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        double bend = m->shape == FINGERS ? fmax((double)x[1] - m->center + 10.0, 0.0) / 20.0 : 1.0;
        v[0] = (float)((x[0] > m->center ? m->speed : -m->speed) * bend * bend);
        v[1] = v[2] = 0.0f;
    }
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Returns the distance that 99 of 100 particles are within, of where they were. */
static double displaced(springls_context *ctx)
{
    int i, count = springls_count(ctx);
    springls_view a = springls_view_correspondences(ctx);
    double *d = (double *)malloc((size_t)count * sizeof *d), p99;
    for (i = 0; i < count; i++) {
        const float *from = (const float *)(const void *)((const char *)a.data + (size_t)i * a.stride);
        d[i] = d3_distance(d3_of(fixture_particle(ctx, i)), d3_make(from[0], from[1], from[2]));
    }
    qsort(d, (size_t)count, sizeof *d, by_size);
    p99 = d[count * 99 / 100];
    free(d);
    return p99;
}

static springls_status steps(springls_context *ctx, const springls_step_desc *step, int count)
{
    springls_status status = SPRINGLS_OK;
    while (count-- > 0 && status == SPRINGLS_OK) status = springls_step(ctx, step);
    return status;
}

/* Pressed together to a gap, held, and drawn apart, bodies are what they were. */
TEST bodies_part(body_shape shape, double center, double gap)
{
    meeting flow = { shape, center, 3.0 + gap, 0.0 };
    springls_context *ctx = fixture_context(48, NULL);
    springls_forces forces = fixture_forces(meeting_velocity, &flow);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.05f);
    springls_measures first, m;
    ASSERT_OK(springls_set_implicit(ctx, meeting_distance, &flow));
    ASSERT_OK(steps(ctx, &step, 5)); /* at rest: the first resampling */
    ASSERT_OK(springls_measure(ctx, &first));
    flow.speed = -1.5;
    ASSERT_OK(steps(ctx, &step, 20));
    flow.speed = 0.0;
    ASSERT_OK(steps(ctx, &step, 50));
    flow.speed = 1.5;
    ASSERT_OK(steps(ctx, &step, 20));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(shape == FINGERS ? 1 : 2, m.components);
    ASSERT_EQ(shape == FINGERS ? 2 : 4, m.euler);
    ASSERT_IN_RANGE(first.volume, m.volume, 1e-3 * first.volume);
    ASSERT_LT(displaced(ctx), 0.1);
    springls_destroy(ctx);
    PASS();
}

/* A ball far above a ball and a plate, which are moved apart as meeting_velocity does. */
typedef struct company { meeting pair; double height, speed; } company;

static void company_distance(void *user, const float *points, int count, float *out)
{
    company *c = (company *)user;
    int i;
    meeting_distance(&c->pair, points, count, out);
    for (i = 0; i < count; i++, points += 3) {
        double x = points[0] - c->pair.center, y = points[1] - c->height, z = points[2] - c->pair.center;
        out[i] = (float)fmin((double)out[i], ball(x, y, z, 4.0));
    }
}

static void company_velocity(void *user, const float *x, int count, float time, float *v)
{
    company *c = (company *)user;
    int i;
    meeting_velocity(&c->pair, x, count, time, v);
    for (i = 0; i < count; i++)
        if ((double)x[3 * i + 1] > c->height - 8.0) {
            v[3 * i] = 0.0f;
            v[3 * i + 2] = (float)c->speed;
        }
}

/* Bodies at a gap that have fallen asleep, while something else moves, part without anything left between them. */
TEST a_gap_may_sleep(double center, double gap)
{
    company flow = { { BALL_AND_PLATE, center, 3.0 + gap, 0.0 }, 44.0, 0.0 };
    springls_context *ctx = fixture_context(56, NULL);
    springls_forces forces = fixture_forces(company_velocity, &flow);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.05f);
    springls_measures first, m;
    int i;
    ASSERT_OK(springls_set_implicit(ctx, company_distance, &flow));
    ASSERT_OK(steps(ctx, &step, 5)); /* at rest: the first resampling */
    ASSERT_OK(springls_measure(ctx, &first));
    flow.pair.speed = -1.5;
    ASSERT_OK(steps(ctx, &step, 20));
    flow.pair.speed = 0.0;
    flow.speed = 1.5;
    ASSERT_OK(steps(ctx, &step, 40));
    flow.speed = 0.0;
    flow.pair.speed = 1.5;
    for (i = 0; i < 27; i++) {
        ASSERT_OK(steps(ctx, &step, 1));
        ASSERT_OK(springls_measure(ctx, &m));
        if (gap + 0.15 * i < 1.5) continue;
        ASSERT_EQ(3, m.components);
        ASSERT_EQ(6, m.euler);
    }
    ASSERT_IN_RANGE(first.volume, m.volume, 1e-3 * first.volume);
    springls_destroy(ctx);
    PASS();
}

/* Moves springls with the body that they are of by their correspondences, wherever that is. */
static void meeting_map(void *user, const float *x, const float *a, int count, float time, float *map)
{
    const meeting *m = (const meeting *)user;
    int i;
    (void)x;
    (void)time;
    memset(map, 0, 12 * (size_t)count * sizeof *map);
    for (i = 0; i < count; i++) map[12 * i + 3] = (float)((double)a[3 * i] > m->center ? m->speed : -m->speed);
}

/* Replaces a context by another one that its snapshot is restored to. */
static springls_status pass_on(springls_context **ctx)
{
    springls_context *next = fixture_context(48, NULL);
    size_t size = 0;
    void *bytes;
    springls_status status = springls_snapshot(*ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size);
    if (status != SPRINGLS_OK) return status;
    bytes = malloc(size);
    status = springls_snapshot(*ctx, SPRINGLS_SNAPSHOT_KIND_ALL, bytes, size, &size);
    if (status == SPRINGLS_OK) status = springls_restore(next, bytes, size);
    free(bytes);
    springls_destroy(*ctx);
    *ctx = next;
    return status;
}

/* Pushed into each other and drawn apart, balls are two again with all their springls where they were; bodies that merge are one
   in between and have lost what lay inside. */
TEST balls_pass(springls_contact contact, springls_mode mode)
{
    meeting flow = { BALLS, 23.7, 2.0, 0.0 };
    springls_params p = springls_default_params();
    springls_context *ctx;
    springls_forces forces = { 0 };
    springls_step_desc step = fixture_step(&forces, mode, 0.05f);
    springls_measures first, m;
    forces.affine = meeting_map;
    forces.user = &flow;
    ctx = fixture_context(48, NULL);
    ASSERT_OK(springls_set_implicit(ctx, meeting_distance, &flow));
    p.contact = contact;
    ASSERT_OK(springls_set_params(ctx, &p));
    ASSERT_OK(steps(ctx, &step, 5)); /* at rest: the first resampling */
    ASSERT_OK(springls_measure(ctx, &first));
    flow.speed = -2.0;
    ASSERT_OK(steps(ctx, &step, 20)); /* two voxels deep */
    flow.speed = 0.0;
    ASSERT_OK(steps(ctx, &step, 10));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(1, m.components);
    ASSERT_LT(m.volume, 0.99 * first.volume);
    if (contact == SPRINGLS_CONTACT_SEPARATE) ASSERT_OK(pass_on(&ctx));
    flow.speed = 2.0;
    ASSERT_OK(steps(ctx, &step, 20));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(contact == SPRINGLS_CONTACT_SEPARATE ? 2 : 1, m.components);
    if (contact == SPRINGLS_CONTACT_SEPARATE) {
        ASSERT_EQ(4, m.euler);
        ASSERT_IN_RANGE(first.volume, m.volume, 2e-3 * first.volume);
        ASSERT_LT(displaced(ctx), 0.05);
    }
    springls_destroy(ctx);
    PASS();
}

/* Balls that move by up to two voxels a step each way overlap by the volume of their lens, and are two again when they part. */
TEST balls_pass_in_long_steps(float pressed, int in, float drawn, int out)
{
    meeting flow = { BALLS, 23.7, 2.0, 0.0 };
    springls_params p = springls_default_params();
    springls_context *ctx = fixture_context(48, NULL);
    springls_forces forces = { 0 };
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_measures first, m;
    double deep = (double)pressed * in - 0.5 * flow.gap, lens = fixture_pi * 2.0 / 3.0 * deep * deep * (15.0 - deep);
    forces.affine = meeting_map;
    forces.user = &flow;
    ASSERT_OK(springls_set_implicit(ctx, meeting_distance, &flow));
    p.contact = SPRINGLS_CONTACT_SEPARATE;
    ASSERT_OK(springls_set_params(ctx, &p));
    ASSERT_OK(steps(ctx, &step, 5)); /* at rest: the first resampling */
    ASSERT_OK(springls_measure(ctx, &first));
    flow.speed = -(double)pressed;
    ASSERT_OK(steps(ctx, &step, in));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(1, m.components);
    ASSERT_EQ(2, m.euler);
    ASSERT_IN_RANGE(first.volume - lens, m.volume, 0.012 * first.volume); /* meshes round the crease */
    flow.speed = (double)drawn;
    ASSERT_OK(steps(ctx, &step, out));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(2, m.components);
    ASSERT_EQ(4, m.euler);
    ASSERT_IN_RANGE(first.volume, m.volume, 5e-3 * first.volume);
    ASSERT_LT(displaced(ctx), 0.1);
    springls_destroy(ctx);
    PASS();
}

/* A ball that a model is united with is another body, though the level set joins the two; and they come apart. */
TEST united_balls_stay_two(void)
{
    meeting flow = { BALLS, 23.7, 0.0, 2.0 };
    springls_params p = springls_default_params();
    springls_context *ctx, *other;
    springls_forces forces = { 0 };
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.05f);
    springls_sphere left = fixture_ball(18.5f, 23.7f, 23.7f, 5.0f), right = fixture_ball(28.9f, 23.7f, 23.7f, 5.0f);
    springls_measures m;
    forces.affine = meeting_map;
    forces.user = &flow;
    p.contact = SPRINGLS_CONTACT_SEPARATE;
    ctx = fixture_context(48, &p);
    other = fixture_context(48, &p);
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &left));
    ASSERT_OK(springls_set_implicit(other, springls_implicit_sphere, &right));
    ASSERT_OK(springls_combine(ctx, SPRINGLS_OPERATION_UNION, other));
    ASSERT(fixture_here(ctx)->set.contact_body[0] != 0);
    ASSERT(fixture_here(ctx)->set.contact_body[0] != fixture_here(ctx)->set.contact_body[springls_count(ctx) - 1]);
    ASSERT_OK(steps(ctx, &step, 20));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(2, m.components);
    ASSERT_EQ(4, m.euler);
    ASSERT_IN_RANGE(1047.2, m.volume, 0.03 * 1047.2);
    springls_destroy(other);
    springls_destroy(ctx);
    PASS();
}

/* ---- the rules, alone ---- */

/* Springls side by side in a square across z, at height z, facing up (1) or down (-1). */
static void lay_side(springls_context *ctx, float z, int facing)
{
    float x, y;
    for (y = 13.0f; y < 19.0f; y += 0.7f)
        for (x = 13.0f; x < 19.0f; x += 0.7f) {
            float up = 0.433f * (float)facing;
            fixture_add(ctx, springls__v3_make(x + 0.5f, y, z), springls__v3_make(x - 0.25f, y + up, z),
                        springls__v3_make(x - 0.25f, y - up, z));
        }
}

/* The two sides of a gap stay though phi is inside all around; those of bodies that have passed through each other go, and so do
   both with the switch off. */
TEST contract_keeps_a_gap(float gap, int keep_thin)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    int count;
    p.keep_thin = keep_thin;
    ctx = fixture_sphere(32, &p, 16.0f, 16.0f, 16.0f, 10.0f);
    fixture_clear(ctx);
    lay_side(ctx, 16.0f - 0.5f * gap, 1);
    lay_side(ctx, 16.0f + 0.5f * gap, -1);
    count = springls_count(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_EQ(gap > 0.0f && keep_thin ? count : 0, springls_count(ctx));
    springls_destroy(ctx);
    PASS();
}

/* Without the switch too, springls stay where the surface of another body is over them. */
TEST contract_keeps_what_another_body_covers(void)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    int side, i;
    p.keep_thin = 0;
    p.contact = SPRINGLS_CONTACT_SEPARATE;
    ctx = fixture_sphere(32, &p, 16.0f, 16.0f, 16.0f, 10.0f);
    fixture_clear(ctx);
    lay_side(ctx, 16.0f, 1);
    side = springls_count(ctx);
    lay_side(ctx, 17.0f, 1);
    for (i = 0; i < springls_count(ctx); i++) fixture_here(ctx)->set.contact_body[i] = i < side ? 1u : 2u;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_EQ(side, springls_count(ctx));
    for (i = 0; i < side; i++) ASSERT_LT(fixture_particle(ctx, i).z, 16.5f);
    springls_destroy(ctx);
    PASS();
}

/* A springl outside all bricks gets one whenever phi evolves, whether or not omega is known already: a restored model, which does
   not know it, goes on to the same bits. */
TEST bricks_for_overlaps_come_again(void)
{
    springls_params p = springls_default_params();
    springls_context *ctx, *other;
    size_t size;
    void *block;
    p.contact = SPRINGLS_CONTACT_SEPARATE;
    ctx = fixture_sphere(32, &p, 20.0f, 20.0f, 20.0f, 5.0f);
    other = fixture_context(32, &p);
    fixture_add(ctx, springls__v3_make(3.0f, 3.0f, 3.0f), springls__v3_make(3.4f, 3.0f, 3.0f), springls__v3_make(3.0f, 3.4f, 3.0f));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    block = malloc(size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    ASSERT_OK(springls_restore(other, block, size));
    ASSERT_EQ(springls_state_hash(ctx), springls_state_hash(other));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE));
    ASSERT_OK(springls_run_stage(other, SPRINGLS_STAGE_EVOLVE));
    ASSERT_EQ(springls_state_hash(ctx), springls_state_hash(other));
    free(block);
    springls_destroy(ctx);
    springls_destroy(other);
    PASS();
}

/* How often one of the first `side` springls has a neighbor that comes after them. */
static int neighbors_across(springls_context *ctx, int side)
{
    int k, across = 0;
    for (k = 0; k < side * SPRINGLS__NEIGHBOR_ROW; k++) across += fixture_here(ctx)->cells.neighbors[k] >= 3 * side;
    return across;
}

/* Across a gap springls do not pull each other; the sides of a sheet do. */
TEST neighbors_are_of_one_body(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 16.0f, 16.0f, 16.0f, 10.0f);
    int side;
    fixture_clear(ctx);
    lay_side(ctx, 15.9f, 1);
    side = springls_count(ctx);
    lay_side(ctx, 16.1f, -1);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
    ASSERT_EQ(0, neighbors_across(ctx, side));
    springls_destroy(ctx);
    PASS();
}

/* Springls of two bodies in one place do not pull each other. */
TEST neighbors_are_of_their_body(void)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    int side, i;
    p.contact = SPRINGLS_CONTACT_SEPARATE;
    ctx = fixture_sphere(32, &p, 16.0f, 16.0f, 16.0f, 10.0f);
    fixture_clear(ctx);
    lay_side(ctx, 15.9f, 1);
    side = springls_count(ctx);
    lay_side(ctx, 16.1f, 1);
    for (i = 0; i < springls_count(ctx); i++) fixture_here(ctx)->set.contact_body[i] = i < side ? 1u : 2u;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
    ASSERT_EQ(0, neighbors_across(ctx, side));
    springls_destroy(ctx);
    PASS();
}

/* Springls that face against phi are turned, but not beside another body: phi is of both. */
TEST orient_keeps_what_is_beside_another_body(uint32_t other)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    int side, i, turned = 0;
    p.contact = SPRINGLS_CONTACT_SEPARATE;
    ctx = fixture_sphere(32, &p, 16.0f, 16.0f, 16.0f, 10.0f);
    fixture_clear(ctx);
    lay_side(ctx, 25.9f, -1);
    side = springls_count(ctx);
    lay_side(ctx, 26.1f, 1);
    for (i = 0; i < springls_count(ctx); i++) fixture_here(ctx)->set.contact_body[i] = i < side ? 1u : other;
    ASSERT_OK(fixture_table(ctx, springls__orient));
    for (i = 0; i < side; i++) turned += springls__springl_normal(fixture_here(ctx)->set.s[i]).z > 0.0f;
    if (other == 1u) ASSERT_GT(turned, side / 2);
    else ASSERT_EQ(0, turned);
    springls_destroy(ctx);
    PASS();
}

/* Between two sides that face each other phi opens, where it had closed. */
TEST a_gap_opens(int nucleate)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    const springls__grid *g;
    p.nucleate = nucleate;
    ctx = fixture_sphere(32, &p, 16.0f, 16.0f, 16.0f, 10.0f);
    fixture_clear(ctx);
    lay_side(ctx, 15.6f, 1);
    lay_side(ctx, 16.4f, -1);
    ASSERT_OK(fixture_table(ctx, springls__project_level_set));
    g = &fixture_here(ctx)->grid;
    if (nucleate) ASSERT_IN_RANGE(0.4f, springls__grid_phi(g, g->phi, 16, 16, 16), 0.05f);
    else ASSERT_LT(springls__grid_phi(g, g->phi, 16, 16, 16), 0.0f);
    springls_destroy(ctx);
    PASS();
}

/* ---- specks ---- */

/* Sets a spindle that is half a voxel thin at its ends and runs diagonally between voxels: a closed mesh of one component. */
static springls_status set_spindle(springls_context *ctx, float across, float along)
{
    enum { ROUND = 12, LENGTH = 40 };
    static const float u[3] = { 0.70710678f, 0.70710678f, 0.0f }, v[3] = { -0.70710678f, 0.70710678f, 0.0f };
    static const float w[3] = { 0.0f, 0.0f, 1.0f };
    float points[3 * (ROUND * (LENGTH - 1) + 2)];
    int triangles[3 * 2 * ROUND * (LENGTH - 1)], i, j, k, n = 0, last = ROUND * (LENGTH - 1) + 1;
    for (i = 0; i <= last; i++) {
        double t = i == 0 ? 0.0 : i == last ? 1.0 : (1 + (i - 1) / ROUND) / (double)LENGTH;
        double angle = 2.0 * fixture_pi * ((i + ROUND - 1) % ROUND) / ROUND;
        double x = (2.0 * t - 1.0) * along, r = across * sin(fixture_pi * t), y = r * cos(angle), z = r * sin(angle);
        for (k = 0; k < 3; k++) points[3 * i + k] = (float)(15.75 + 0.2 * k + x * u[k] + y * v[k] + z * w[k]);
    }
    for (i = 0; i < LENGTH; i++)
        for (j = 0; j < ROUND; j++) {
            int a = 1 + (i - 1) * ROUND + j, b = 1 + (i - 1) * ROUND + (j + 1) % ROUND, c = a + ROUND, d = b + ROUND;
            if (i > 0 && i < LENGTH - 1) {
                const int two[6] = { a, c, b, b, c, d };
                for (k = 0; k < 6; k++) triangles[n++] = two[k];
            } else {
                triangles[n++] = i ? a : 0;
                triangles[n++] = i ? last : c;
                triangles[n++] = i ? b : d;
            }
        }
    return springls_set_mesh(ctx, points, last + 1, 0, triangles, n / 3, NULL);
}

static int components(springls_context *ctx)
{
    springls_measures m;
    return springls_measure(ctx, &m) == SPRINGLS_OK ? m.components : -1;
}

/* A mesh of one component is one: as it is set, after remesh, and after steps at rest. With min_component = 0 nothing is joined
   and nothing goes. */
TEST a_limb_is_one_component(float across, float min_component)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    springls_forces forces = { 0 };
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    p.min_component = min_component;
    ctx = fixture_context(32, &p);
    ASSERT_OK(set_spindle(ctx, across, 15.0f));
    if (min_component > 0.0f) {
        ASSERT_EQ(1, components(ctx));
        ASSERT_OK(springls_remesh(ctx));
        ASSERT_EQ(1, components(ctx));
        ASSERT_OK(steps(ctx, &step, 20));
        ASSERT_EQ(1, components(ctx));
    } else {
        ASSERT_GT(components(ctx), 1);
    }
    springls_destroy(ctx);
    PASS();
}

static void drift(void *user, const float *x, int count, float time, float *v)
{
    int i;
    (void)x;
    (void)time;
    for (i = 0; i < 3 * count; i++) v[i] = *(const float *)user;
}

/* A closed mesh stays what it is, to the last bit, until something moves; then it is followed. */
TEST a_mesh_at_rest_stays(void)
{
    float speed = 0.0f;
    springls_context *ctx = fixture_context(32, NULL);
    springls_forces forces = fixture_forces(drift, &speed);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    springls_measures first, m;
    ASSERT_OK(set_spindle(ctx, 2.2f, 13.0f));
    ASSERT_OK(springls_measure(ctx, &first));
    ASSERT_OK(steps(ctx, &step, 20));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(first.volume, m.volume);
    ASSERT_EQ(first.area, m.area);
    speed = 1.0f;
    ASSERT_OK(steps(ctx, &step, 10));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_IN_RANGE((double)first.lower[2] + 1.0, (double)m.lower[2], 0.1);
    ASSERT_IN_RANGE(first.volume, m.volume, 0.03 * first.volume); /* its ends are thinner than a voxel */
    springls_destroy(ctx);
    PASS();
}

/* A ball with a hollow, which a bore less than a voxel wide leads to from outside, along voxel centres. */
static void bored_ball(void *user, const float *points, int count, float *out)
{
    const float *radius = (const float *)user;
    int i;
    for (i = 0; i < count; i++, points += 3) {
        double x = points[0] - 16.0, y = points[1] - 16.0, z = points[2] - 16.0;
        double bore = x < 0.0 ? ball(x, y, z, (double)*radius) : ball(0.0, y, z, (double)*radius);
        out[i] = (float)fmax(ball(x, y, z, 10.0), -fmin(bore, ball(x, y, z, 2.2)));
    }
}

/* The way into a hollow is no puncture: filled, it would leave a bubble. */
TEST a_bore_stays_open(float radius)
{
    springls_context *ctx = fixture_context(32, NULL);
    springls_forces forces = { 0 };
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    springls_measures m;
    ASSERT_OK(springls_set_implicit(ctx, bored_ball, &radius));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(1, m.components);
    ASSERT_EQ(2, m.euler);
    ASSERT_OK(steps(ctx, &step, 20));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_EQ(1, m.components);
    ASSERT_EQ(2, m.euler);
    springls_destroy(ctx);
    PASS();
}

/* Two balls, one of them with the volume of a few voxels. */
static void ball_and_drop(void *user, const float *points, int count, float *out)
{
    const float *radius = (const float *)user;
    int i;
    for (i = 0; i < count; i++, points += 3)
        out[i] = (float)fmin(ball((double)points[0] - 12.0, (double)points[1] - 16.0, (double)points[2] - 16.0, 6.0),
                             ball((double)points[0] - 24.0, (double)points[1] - 16.0, (double)points[2] - 16.0, (double)*radius));
}

/* A drop goes at the first step when it is smaller than min_component; one of 5.6 voxels only with a larger one. */
TEST a_drop_goes(float radius, float min_component, int left)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    springls_forces forces = { 0 };
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    p.min_component = min_component;
    ctx = fixture_context(32, &p);
    ASSERT_OK(springls_set_implicit(ctx, ball_and_drop, &radius));
    ASSERT_EQ(2, components(ctx));
    ASSERT_OK(steps(ctx, &step, 1));
    ASSERT_EQ(left, components(ctx));
    springls_destroy(ctx);
    PASS();
}

SUITE(contact)
{
    RUN_TESTp(a_limb_is_one_component, 0.7f, 1.0f);
    RUN_TESTp(a_limb_is_one_component, 0.7f, 0.0f);
    RUN_TESTp(a_limb_is_one_component, 1.2f, 1.0f);
    RUN_TEST(a_mesh_at_rest_stays);
    RUN_TESTp(a_bore_stays_open, 0.35f);
    RUN_TESTp(a_bore_stays_open, 0.45f);
    RUN_TESTp(a_drop_goes, 0.5f, 1.0f, 1);
    RUN_TESTp(a_drop_goes, 0.5f, 0.0f, 2);
    RUN_TESTp(a_drop_goes, 1.1f, 1.0f, 2);
    RUN_TESTp(a_drop_goes, 1.1f, 8.0f, 1);
    RUN_TESTp(bodies_part, BALLS, 23.7, 0.25);
    RUN_TESTp(bodies_part, BALL_AND_PLATE, 23.7, 0.5);
    RUN_TESTp(bodies_part, BOXES, 23.5, 1.0);
    RUN_TESTp(bodies_part, BOXES, 23.5, 0.5);
    RUN_TESTp(bodies_part, BOXES, 23.7, 0.5);
    RUN_TESTp(bodies_part, BOXES, 23.7, 0.25);
    RUN_TESTp(bodies_part, BOXES, 23.3, 0.25);
    RUN_TESTp(bodies_part, FINGERS, 23.7, 0.25);
    RUN_TESTp(a_gap_may_sleep, 20.25, 0.25);
    RUN_TESTp(a_gap_may_sleep, 20.5, 0.5);
    RUN_TESTp(a_gap_may_sleep, 20.75, 1.0);
    RUN_TESTp(balls_pass, SPRINGLS_CONTACT_SEPARATE, SPRINGLS_MODE_FLUID);
    RUN_TESTp(balls_pass, SPRINGLS_CONTACT_SEPARATE, SPRINGLS_MODE_ELASTIC);
    RUN_TESTp(balls_pass, SPRINGLS_CONTACT_MERGE, SPRINGLS_MODE_FLUID);
    RUN_TESTp(balls_pass_in_long_steps, 0.5f, 6, 0.5f, 6);
    RUN_TESTp(balls_pass_in_long_steps, 0.2f, 15, 1.0f, 3);
    RUN_TESTp(balls_pass_in_long_steps, 1.0f, 4, 0.5f, 8);
    RUN_TESTp(balls_pass_in_long_steps, 2.0f, 2, 2.0f, 2);
    RUN_TEST(united_balls_stay_two);
    RUN_TESTp(contract_keeps_a_gap, 0.4f, 1);
    RUN_TESTp(contract_keeps_a_gap, 0.4f, 0);
    RUN_TESTp(contract_keeps_a_gap, -0.4f, 1);
    RUN_TEST(contract_keeps_what_another_body_covers);
    RUN_TEST(bricks_for_overlaps_come_again);
    RUN_TEST(neighbors_are_of_one_body);
    RUN_TEST(neighbors_are_of_their_body);
    RUN_TESTp(orient_keeps_what_is_beside_another_body, 1u);
    RUN_TESTp(orient_keeps_what_is_beside_another_body, 2u);
    RUN_TESTp(a_gap_opens, 1);
    RUN_TESTp(a_gap_opens, 0);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(contact);
    GREATEST_MAIN_END();
}
