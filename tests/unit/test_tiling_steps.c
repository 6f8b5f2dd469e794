/* test_tiling_steps.c - many bodies that move: walls that stay closed in a flow, bodies that meet and vanish, surface tension, what callers
   do meanwhile, rest, and the same bits for any threads. */
#include "fixtures.h"
#include "tilings.h"

/* ---- motion ---- */

/* How far the wall is from its plane: half the difference of the distances of both bodies, and their sum, the gap. */
static void wall_error(springls_tiling *tiling, float radius, double *error, double *gap)
{
    const part p = part_at(12.4f, 13.7f, 13.1f, radius, 0);
    const d3 n = d3_make((double)p.normal[0], (double)p.normal[1], (double)p.normal[2]), u = d3_make(-0.36, 0.8, 0.0);
    const d3 across = d3_scale(u, 1.0 / d3_length(u)), up = d3_cross(n, across);
    float point[3], a, b;
    int i, k, count = 0;
    *error = *gap = 0.0;
    for (i = -6; i <= 6; i++) {
        for (k = -6; k <= 6; k++) {
            d3 x = d3_make(12.4, 13.7, 13.1);
            if (i * i + k * k > 36) continue;
            x = d3_mad(d3_mad(x, across, (double)i * (double)radius / 7.0), up, (double)k * (double)radius / 7.0);
            point[0] = (float)x.x, point[1] = (float)x.y, point[2] = (float)x.z;
            springls_sample_distance(springls_tiling_body(tiling, 4), point, 1, &a);
            springls_sample_distance(springls_tiling_body(tiling, 9), point, 1, &b);
            *error += fabs((double)a - (double)b) / 2.0;
            *gap += fabs((double)a + (double)b);
            count++;
        }
    }
    *error /= count;
    *gap /= count;
}

/* Two halves of a ball in a flow that comes back: their wall comes back too, closed, and volumes stay. The bits are the same however
   the work is divided. */
TEST walls_stay_closed(void)
{
    uint64_t hash = 0;
    int run;
    for (run = 0; run < 3; run++) {
        fixture_workers workers;
        springls_threads *threads = run == 2 ? springls_threads_create(3) : NULL;
        springls_desc desc = fixture_desc(BALL + 4, NULL);
        springls_tiling *tiling;
        springls_tiling_step_desc step = springls_default_tiling_step_desc();
        springls_tiling_measures before[2], after[2];
        springls_tiling_report report;
        double error, gap;
        int i, faced = 0;
        if (run) desc.tasks = run == 1 ? fixture_tasks(&workers, 3, 0) : springls_threads_tasks(threads);
        ASSERT_OK(springls_tiling_create(&desc, &tiling));
        ASSERT_OK(set_two_halves(tiling, 7.0f));
        ASSERT_OK(springls_tiling_measure(tiling, before));
        step.velocity = swirl;
        step.dt = 0.0625f;
        for (i = 0; i < 32; i++) {
            ASSERT_OK(springls_tiling_step(tiling, &step, &report));
            ASSERT_EQ(0, report.vanished_count);
            faced += report.faced;
        }
        ASSERT_GT(faced, 1000);
        ASSERT_IN_RANGE(2.0, springls_time(springls_tiling_body(tiling, 4)), 1e-5);
        ASSERT_OK(springls_tiling_measure(tiling, after));
        for (i = 0; i < 2; i++) ASSERT_IN_RANGE(before[i].volume, after[i].volume, 0.005 * before[i].volume);
        wall_error(tiling, 7.0f, &error, &gap);
        if (GREATEST_IS_VERBOSE()) printf("  wall %.4f, gap %.4f\n", error, gap);
        ASSERT_LT(error, 0.02);
        ASSERT_LT(gap, 0.06);
        if (run) ASSERT(hash == springls_tiling_state_hash(tiling));
        hash = springls_tiling_state_hash(tiling);
        springls_tiling_destroy(tiling);
        springls_threads_destroy(threads);
    }
    PASS();
}

/* Moves the halves of a ball far in one step, zeroed but for velocity, dt and max_displacement. *sub_steps: of each body. */
static springls_status swirl_once(float max_displacement, uint64_t *hash, int *sub_steps)
{
    springls_tiling *tiling = tiling_of_size(BALL + 4, NULL);
    springls_tiling_step_desc step;
    springls_status status = set_two_halves(tiling, 7.0f);
    memset(&step, 0, sizeof step);
    step.velocity = swirl;
    step.dt = 1.0f;
    step.max_displacement = max_displacement;
    if (status == SPRINGLS_OK) status = springls_tiling_step(tiling, &step, NULL);
    *hash = springls_tiling_state_hash(tiling);
    *sub_steps = springls_get_stats(springls_tiling_body(tiling, 4)).steps;
    springls_tiling_destroy(tiling);
    return status;
}

/* Zero divides dt by two voxels, to the same bits; a negative number never divides it; what is no number is refused. */
TEST zeroed_steps_are_divided(void)
{
    uint64_t zeroed, given, undivided, none;
    int parts, given_parts, whole;
    ASSERT_OK(swirl_once(0.0f, &zeroed, &parts));
    ASSERT_OK(swirl_once(2.0f, &given, &given_parts));
    ASSERT_OK(swirl_once(-1.0f, &undivided, &whole));
    ASSERT_GT(parts, 1);
    ASSERT_EQ(given_parts, parts);
    ASSERT(zeroed == given);
    ASSERT_EQ(1, whole);
    ASSERT(undivided != zeroed);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, swirl_once((float)NAN, &none, &parts));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, swirl_once(-INFINITY, &none, &parts));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, swirl_once(1e-4f, &none, &parts));
    PASS();
}

/* Pushes outwards what faces label 0. */
static void grow(void *user, const springls_tiling_batch *batch, float *out)
{
    const float *speed = (const float *)user;
    int i;
    for (i = 0; i < batch->batch.count; i++)
        out[i] = batch->label == 0 ? -speed[0] : batch->facing[i] == 0 ? speed[0] : 0.0f;
}

/* Two balls that grow meet in the middle and face each other there; no voxel is between them, and none is in both. */
TEST bodies_meet(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(8.2f, 13.6f, 13.3f, 3.5f, 0), second = part_at(18.9f, 13.6f, 13.3f, 3.5f, 0);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    static int32_t labels[VOXELS], facing[20000];
    float speed = 0.2f;
    int i, wrong = 0, met = 0;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, part_of_ball, &first));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &second));
    ASSERT_OK(springls_tiling_facing(tiling, 1, facing));
    for (i = 0; i < springls_count(springls_tiling_body(tiling, 1)); i++) ASSERT_EQ(0, facing[i]);
    step.pressure = grow;
    step.user = &speed;
    step.dt = 1.0f;
    for (i = 0; i < 15; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_OK(springls_tiling_copy_labels(tiling, labels));
    for (i = 0; i < VOXELS; i++) {
        const d3 x = d3_make(i % SIZE, i / SIZE % SIZE, i / (SIZE * SIZE));
        const double a = d3_distance(x, d3_make(8.2, 13.6, 13.3)) - 6.5, b = d3_distance(x, d3_make(18.9, 13.6, 13.3)) - 6.5;
        const double sure = 0.35;
        if (a < -sure && a < b - sure) wrong += labels[i] != 1;
        else if (b < -sure && b < a - sure) wrong += labels[i] != 2;
        else if (a > sure && b > sure) wrong += labels[i] != 0;
    }
    if (GREATEST_IS_VERBOSE()) printf("  wrong voxels %d\n", wrong);
    ASSERT_LT(wrong, 6);
    ASSERT_OK(springls_tiling_facing(tiling, 1, facing));
    for (i = 0; i < springls_count(springls_tiling_body(tiling, 1)); i++) met += facing[i] == 2;
    if (GREATEST_IS_VERBOSE()) printf("  met %d\n", met);
    ASSERT_GT(met, 30);
    springls_tiling_destroy(tiling);
    PASS();
}

/* Four balls that grow into each other until they meet askew, with no void between them: each voxel is that of the nearest ball, or of one
   that is hardly further. */
TEST bodies_meet_askew(void)
{
    enum { FOUR = 4 };
    static const float place[FOUR][3]
        = { { 10.1f, 10.3f, 10.2f }, { 17.4f, 16.8f, 10.6f }, { 10.4f, 17.1f, 17.3f }, { 16.9f, 10.2f, 16.7f } };
    static int32_t labels[VOXELS];
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    float speed = 0.25f;
    int i, k, wrong = 0;
    for (k = 0; k < FOUR; k++) {
        part ball = part_at(place[k][0], place[k][1], place[k][2], 2.5f, 0);
        ASSERT_OK(springls_tiling_add_implicit(tiling, k + 1, part_of_ball, &ball));
    }
    step.pressure = grow;
    step.user = &speed;
    step.dt = 1.0f;
    for (i = 0; i < 20; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_OK(springls_tiling_copy_labels(tiling, labels));
    for (i = 0; i < VOXELS; i++) {
        const d3 x = d3_make(i % SIZE, i / SIZE % SIZE, i / (SIZE * SIZE));
        double least = 1e9, own = 1e9;
        for (k = 0; k < FOUR; k++) {
            const double d = d3_distance(x, d3_make(place[k][0], place[k][1], place[k][2]));
            if (d < least) least = d;
            if (labels[i] == k + 1) own = d;
        }
        if (labels[i]) wrong += own > least + 0.75;
        else wrong += least < 7.0;
    }
    if (GREATEST_IS_VERBOSE()) printf("  wrong voxels %d\n", wrong);
    ASSERT_LT(wrong, 3);
    springls_tiling_destroy(tiling);
    PASS();
}

/* ---- films ---- */

typedef struct rule { float speed; springls_film film; float thickness; } rule;

static springls_film film_of(void *user, int32_t low, int32_t high, float *rupture_thickness)
{
    const rule *r = (const rule *)user;
    if (low == 1 && high == 2) *rupture_thickness = r->thickness;
    return r->film;
}

/* Two balls grow until they meet: when they are as near as the caller says they share a wall, which is reported once, or become one body,
   of both volumes, without a sheet within. */
TEST films_part_or_join(springls_film film, float thickness, int steps)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(8.2f, 13.6f, 13.3f, 3.5f, 0), second = part_at(18.9f, 13.6f, 13.3f, 3.5f, 0);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    springls_tiling_measures measures[2];
    springls_context *body;
    rule r;
    double sum, point[3];
    int i, k, met = 0, parted = 0, joined = 0, when = 0, within = 0;
    r.speed = 0.2f;
    r.film = film;
    r.thickness = thickness;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, part_of_ball, &first));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &second));
    step.pressure = grow;
    step.user = &r;
    step.film = film_of;
    step.dt = 1.0f;
    for (i = 0; i < 20; i++) {
        if (i == 15) r.speed = 0.0f; /* what is left of the film goes */
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        if (report.met_count) {
            ASSERT(report.met[0] == 1 && report.met[1] == 2);
            when = i;
        }
        if (report.joined_count) ASSERT(report.joined[0] == 1 && report.joined[1] == 2);
        met += report.met_count;
        parted += report.parted_count;
        joined += report.joined_count;
    }
    if (GREATEST_IS_VERBOSE()) printf("  met %d in step %d, joined %d\n", met, when, joined);
    ASSERT_EQ(1, met);
    ASSERT_EQ(0, parted);
    ASSERT_EQ(film == SPRINGLS_FILM_JOIN, joined);
    ASSERT_EQ(steps, when);
    ASSERT_EQ(joined ? 1 : 2, springls_tiling_count(tiling));
    ASSERT_OK(springls_tiling_measure(tiling, measures));
    sum = measures[0].volume + (joined ? 0.0 : measures[1].volume);
    ASSERT_IN_RANGE(2.0 * 4.18879 * 274.625 - 54.98, sum, 0.03 * sum); /* two balls of 6.5 less their lens */
    body = springls_tiling_body(tiling, 1);
    for (i = 0; i < springls_count(body) && joined; i++) {
        const springls_view view = springls_view_particles(body);
        for (k = 0; k < 3; k++)
            point[k] = (double)*(const float *)(const void *)((const char *)view.data + (size_t)i * view.stride + 4u * (unsigned)k);
        within += fabs(point[0] - 13.55) < 1.5 && (point[1] - 13.6) * (point[1] - 13.6) + (point[2] - 13.3) * (point[2] - 13.3) < 6.0;
    }
    ASSERT_EQ(0, within);
    springls_tiling_destroy(tiling);
    PASS();
}

/* What the callback must not give is refused before bodies touch, and nothing has changed. */
TEST wrong_films_are_refused(void)
{
    static const rule wrong[3] = {{0.0f, SPRINGLS_FILM_PART, -0.1f}, {0.0f, SPRINGLS_FILM_JOIN, 0.95f}, {0.0f, (springls_film)2, 0.3f}};
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(8.2f, 13.6f, 13.3f, 5.1f, 0), second = part_at(18.9f, 13.6f, 13.3f, 5.1f, 0);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    rule r = wrong[0];
    uint64_t before;
    int i;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, part_of_ball, &first));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &second));
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    before = springls_tiling_state_hash(tiling);
    step.film = film_of;
    step.user = &r;
    for (i = 0; i < 4; i++) {
        r = wrong[i % 3];
        if (i == 3) r.thickness = (float)NAN;
        ASSERT_STATUS(i < 3 ? SPRINGLS_INVALID_ARGUMENT : SPRINGLS_NON_FINITE, springls_tiling_step(tiling, &step, NULL));
        ASSERT(error_has(tiling, "labels 1 and 2"));
        ASSERT(before == springls_tiling_state_hash(tiling));
    }
    r.film = SPRINGLS_FILM_PART;
    r.thickness = 0.06f;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    springls_tiling_destroy(tiling);
    PASS();
}

/* Two halves become the ball that they are parts of: that of label 0's model. */
TEST halves_join(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_measures measures;
    springls_measures outer;
    springls_walls walls;
    static float ones[2000];
    const springls_attribute_desc attribute = { "A", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    uint64_t before;
    int i, k;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_join(NULL, 4, 9));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_join(tiling, 4, 9));
    ASSERT_OK(set_two_halves(tiling, 7.0f));
    before = springls_tiling_state_hash(tiling);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_join(tiling, 4, 4));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_join(tiling, 0, 4));
    ASSERT(error_has(tiling, "no two bodies"));
    ASSERT(before == springls_tiling_state_hash(tiling));
    step.velocity = swirl;
    step.dt = 0.0625f;
    for (i = 0; i < 8; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    for (i = 0; i < 2; i++) {
        springls_context *body = springls_tiling_body(tiling, i ? 4 : 9);
        for (k = 0; k < 2000; k++) ones[k] = 1.0f;
        ASSERT_LT(springls_count(body), 2000);
        ASSERT_OK(springls_add_attribute(body, &attribute, ones, NULL));
    }
    ASSERT_OK(springls_tiling_join(tiling, 9, 4));
    ASSERT_EQ(1, springls_tiling_count(tiling));
    ASSERT_EQ(9, springls_tiling_label(tiling, 0));
    for (i = 0; i < 24; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_OK(springls_tiling_measure(tiling, &measures));
    for (i = 0; i < 2; i++) { /* attributes pass through, and may be set */
        springls_context *body = springls_tiling_body(tiling, 9);
        const int number = springls_find_attribute(body, "A");
        const float *values = springls_view_attribute(body, number).data;
        for (k = 0; k < springls_count(body); k++) ASSERT_IN_RANGE(i ? 3.0 : 1.0, values[k], 1e-6);
        for (k = 0; k < 2000; k++) ones[k] = 3.0f;
        ASSERT_OK(springls_set_attribute(body, number, ones));
    }
    ASSERT_OK(springls_measure(springls_tiling_body(tiling, 0), &outer));
    if (GREATEST_IS_VERBOSE())
        printf("  volume %.2f of %.2f, area %.2f of %.2f\n", measures.volume, outer.volume, measures.area, outer.area);
    ASSERT_IN_RANGE(outer.volume, measures.volume, 0.003 * outer.volume);
    ASSERT_IN_RANGE(outer.area, measures.area, 0.005 * outer.area);
    ASSERT_IN_RANGE(4.0 * fixture_pi * 49.0, measures.area, 0.02 * 4.0 * fixture_pi * 49.0);
    ASSERT_OK(springls_tiling_extract(tiling, &walls));
    for (i = 0; i < walls.triangle_count; i++) ASSERT_EQ(9, walls.labels[2 * i] + walls.labels[2 * i + 1]);
    springls_walls_free(tiling, &walls);
    springls_tiling_destroy(tiling);
    PASS();
}

/* ---- surface tension and volumes that are held ---- */

static float stronger_inside(void *user, int32_t low, int32_t high)
{
    const float *factor = (const float *)user;
    return low == 4 && high == 9 ? *factor : 1.0f;
}

static double area_of(const springls_tiling *tiling, bool inside)
{
    springls_walls walls;
    double area = 0.0;
    int i, k;
    if (springls_tiling_extract((springls_tiling *)(uintptr_t)tiling, &walls) != SPRINGLS_OK) return 0.0;
    for (i = 0; i < walls.triangle_count; i++) {
        d3 p[3];
        if (inside != (walls.labels[2 * i] != 0 && walls.labels[2 * i + 1] != 0)) continue;
        for (k = 0; k < 3; k++) {
            const float *x = walls.positions + 3 * walls.triangles[3 * i + k];
            p[k] = d3_make((double)x[0], (double)x[1], (double)x[2]);
        }
        area += 0.5 * d3_length(d3_cross(d3_sub(p[1], p[0]), d3_sub(p[2], p[0])));
    }
    springls_walls_free((springls_tiling *)(uintptr_t)tiling, &walls);
    return area;
}

/* Two halves of a ball become a double bubble: their volumes stay, areas fall, pressures are those of Laplace's law, 2 / R. A stronger
   tension of the wall between them makes it smaller. A third body that is held is not there. */
TEST bubbles_keep_their_volumes(float factor)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_hold held[3];
    double before, inside;
    int i;
    ASSERT_OK(set_two_halves(tiling, 7.0f));
    memset(held, 0, sizeof held);
    held[0].label = 9;
    held[1].label = 4;
    held[2].label = 5;
    inside = area_of(tiling, true);
    before = area_of(tiling, false) + (double)factor * inside;
    step.tension = 1.0f;
    step.tension_of = stronger_inside;
    step.user = &factor;
    step.held = held;
    step.held_count = 3;
    step.integrator = SPRINGLS_INTEGRATOR_EULER;
    step.dt = 0.5f;
    for (i = 0; i < 16; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    if (GREATEST_IS_VERBOSE())
        printf("  volumes %.2f %.2f of %.2f %.2f, pressures %.4f %.4f, areas %.1f (%.1f) of %.1f (%.1f)\n", held[0].volume, held[1].volume,
               held[0].target, held[1].target, held[0].pressure, held[1].pressure, area_of(tiling, false), area_of(tiling, true), before,
               inside);
    for (i = 0; i < 2; i++) {
        ASSERT_IN_RANGE(718.4, held[i].target, 3.0);
        ASSERT_IN_RANGE(held[i].target, held[i].volume, 0.0015 * held[i].target);
        ASSERT_IN_RANGE(factor > 1.0f ? 0.36 : 0.33, held[i].pressure, 0.03);
    }
    ASSERT(held[2].volume == 0.0 && held[2].pressure == 0.0 && held[2].target == 0.0);
    ASSERT_LT(area_of(tiling, false) + (double)factor * area_of(tiling, true), 0.985 * before);
    ASSERT_LT(area_of(tiling, true), (factor > 1.0f ? 0.84 : 0.89) * inside);
    springls_tiling_destroy(tiling);
    PASS();
}

enum { ABOUT_A_LINE = 6 };

/* Four cells about a line, and two that cover its ends, 5 and 6: a ball in four by two planes that form wedges of 28 and 152 degrees. The
   two thin ones, 1 and 3, touch in a wall some voxels wide. */
static void four_about_a_line(int32_t *labels)
{
    const double slope = tan(14.0 * fixture_pi / 180.0), half_wall = 0.8, end = 5.0;
    int i;
    for (i = 0; i < VOXELS; i++) {
        const double x = i % SIZE - 13.3, y = i / SIZE % SIZE - 13.4, z = i / (SIZE * SIZE) - 13.6;
        const int about = fabs(y) > slope * fabs(x) + half_wall ? (y > 0.0 ? 2 : 4) : x > 0.0 ? 1 : 3;
        labels[i] = x * x + y * y + z * z >= 100.0 ? 0 : z > end ? 5 : z < -end ? 6 : about;
    }
}

static int count_pair(const int32_t *pairs, int count, int32_t low, int32_t high)
{
    int i, found = 0;
    for (i = 0; i < count; i++) found += pairs[2 * i] == low && pairs[2 * i + 1] == high;
    return found;
}

/* Returns how many voxels of label 0 lie within a radius of the middle. */
static int holes(springls_tiling *tiling, double radius)
{
    static int32_t labels[VOXELS];
    int i, found = 0;
    if (springls_tiling_copy_labels(tiling, labels) != SPRINGLS_OK) return -1;
    for (i = 0; i < VOXELS; i++) {
        const double x = i % SIZE - 13.3, y = i / SIZE % SIZE - 13.4, z = i / (SIZE * SIZE) - 13.6;
        found += labels[i] == 0 && x * x + y * y + z * z < radius * radius;
    }
    return found;
}

/* A foam that is not minimal: the wall between two of four cells shrinks to a line, and the two others meet in its place (T1). Either
   change is reported once, and no other; volumes stay, and no gap opens. */
TEST neighbors_change(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    springls_tiling_hold held[ABOUT_A_LINE];
    static int32_t labels[VOXELS];
    int i, k, met = 0, parted = 0, others = 0, after = 0;
    double worst = 0.0, last = 0.0, sum = 0.0, wanted = 0.0;
    four_about_a_line(labels);
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 2));
    memset(held, 0, sizeof held);
    for (k = 0; k < ABOUT_A_LINE; k++) held[k].label = k + 1;
    step.tension = 1.0f;
    step.held = held;
    step.held_count = ABOUT_A_LINE;
    step.integrator = SPRINGLS_INTEGRATOR_EULER;
    step.dt = 0.5f;
    for (i = 0; i < 120 && after < 10; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        met += count_pair(report.met, report.met_count, 2, 4);
        parted += count_pair(report.parted, report.parted_count, 1, 3);
        others += report.met_count + report.parted_count;
        after += met > 0 && parted > 0;
        ASSERT_EQ(0, holes(tiling, 7.0));
        for (k = 0, last = sum = wanted = 0.0; k < ABOUT_A_LINE; k++) {
            last = fmax(last, fabs(held[k].volume / held[k].target - 1.0));
            sum += held[k].volume;
            wanted += held[k].target;
        }
        worst = fmax(worst, last);
    }
    if (GREATEST_IS_VERBOSE())
        printf("  %d steps; volumes within %.2f %%, in the end %.2f %%, all together %+.3f %%\n", i, 100.0 * worst, 100.0 * last,
               100.0 * (sum / wanted - 1.0));
    ASSERT_EQ(1, parted);
    ASSERT_EQ(1, met);
    ASSERT_EQ(2, others);
    ASSERT_LT(worst, 0.02);
    ASSERT_LT(last, 0.01);
    ASSERT_IN_RANGE(wanted, sum, 0.001 * wanted);
    springls_tiling_destroy(tiling);
    PASS();
}

/* A body grows to a target that the caller sets, and its neighbour makes room. */
TEST targets_are_reached(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_hold held[2];
    int i;
    ASSERT_OK(set_two_halves(tiling, 7.0f));
    memset(held, 0, sizeof held);
    held[0].label = 4;
    held[0].target = 760.0;
    held[1].label = 9;
    step.held = held;
    step.held_count = 2;
    step.dt = 0.5f;
    for (i = 0; i < 4; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    if (GREATEST_IS_VERBOSE()) printf("  %.2f %.2f\n", held[0].volume, held[1].volume);
    ASSERT_IN_RANGE(760.0, held[0].volume, 2.0);
    ASSERT_IN_RANGE(held[1].target, held[1].volume, 2.0);
    springls_tiling_destroy(tiling);
    PASS();
}

static float bad_factor(void *user, int32_t low, int32_t high)
{
    (void)low;
    (void)high;
    return *(const float *)user;
}

/* The pressure in a ball is twice the tension over the radius, in world units, whatever the spacing. */
TEST tension_is_in_world_units(double spacing)
{
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_tiling *tiling = NULL;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_hold held;
    const double radius = 8.0 * spacing;
    springls_sphere ball;
    int i;
    for (i = 0; i < 3; i++) {
        desc.grid.spacing[i] = spacing;
        ball.center[i] = (float)(desc.grid.origin[i] + spacing * 0.5 * (SIZE - 1));
    }
    ball.radius = (float)radius;
    ASSERT_OK(springls_tiling_create(&desc, &tiling));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, springls_implicit_sphere, &ball));
    memset(&held, 0, sizeof held);
    held.label = 1;
    step.tension = 1.0f;
    step.held = &held;
    step.held_count = 1;
    step.dt = (float)(0.5 * spacing * spacing);
    for (i = 0; i < 4; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_IN_RANGE(2.0 / radius, held.pressure, 0.1 / radius);
    ASSERT_IN_RANGE(4.18879 * radius * radius * radius, held.volume, 0.02 * 4.18879 * radius * radius * radius);
    springls_tiling_destroy(tiling);
    PASS();
}

/* What a velocity callback has been asked: between which places. */
typedef struct push_seen { float velocity[3], lower[3], upper[3]; } push_seen;

static void push_and_see(void *user, const springls_tiling_batch *batch, float *out)
{
    push_seen *seen = (push_seen *)user;
    int i;
    for (i = 0; i < 3 * batch->batch.count; i++) {
        const float x = batch->batch.points[i];
        if (x < seen->lower[i % 3]) seen->lower[i % 3] = x;
        if (x > seen->upper[i % 3]) seen->upper[i % 3] = x;
        out[i] = seen->velocity[i % 3];
    }
}

static void count_warnings(void *user, int level, const char *message)
{
    (void)message;
    *(int *)user += level == 2;
}

/* Writes the middle of all vertices of both bodies' surfaces, in the world; returns whether both have some. */
static bool middle_of_bodies(const springls_tiling *tiling, double middle[3])
{
    springls_measures m[2];
    int i, k;
    memset(m, 0, sizeof m);
    for (i = 0; i < 2; i++) {
        if (springls_measure(springls_tiling_body(tiling, i ? 9 : 4), &m[i]) != SPRINGLS_OK || m[i].volume <= 0.0) return false;
    }
    for (k = 0; k < 3; k++)
        middle[k] = 0.5 * (double)(fminf(m[0].lower[k], m[1].lower[k]) + fmaxf(m[0].upper[k], m[1].upper[k]));
    return true;
}

/* Places, velocities and regions are of the world, on a grid that lies elsewhere, with voxels of other sizes; or of the lattice. A region
   outside the grid moves nothing and is warned of, once a step. */
TEST flows_are_of_the_world(double along_xy, double along_z, bool voxel_units)
{
    const double spacing[3] = { along_xy, along_xy, along_z }, radius = 9.0 * along_xy;
    const float world_velocity[3] = { 1.0f, 0.5f, -0.25f };
    springls_desc desc = fixture_desc(32, NULL);
    springls_tiling *tiling = NULL;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    part half = part_at(0.0f, 0.0f, 0.0f, (float)radius, 1);
    push_seen seen;
    double before[3], after[3];
    int k, warned = 0;
    desc.logger.log = count_warnings;
    desc.logger.user = &warned;
    for (k = 0; k < 3; k++) {
        desc.grid.spacing[k] = spacing[k];
        desc.grid.origin[k] = k == 1 ? -55.0 : 100.0;
        half.center[k] = (float)(desc.grid.origin[k] + 15.3 * spacing[k]);
        seen.velocity[k] = world_velocity[k] / (voxel_units ? (float)spacing[k] : 1.0f);
        seen.lower[k] = 1e9f;
        seen.upper[k] = -1e9f;
    }
    ASSERT_OK(springls_tiling_create(&desc, &tiling));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 4, part_of_ball, &half));
    half.side = -1;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 9, part_of_ball, &half));
    ASSERT(middle_of_bodies(tiling, before));
    step.velocity = push_and_see;
    step.user = &seen;
    step.dt = 1.0f;
    step.voxel_units = voxel_units;
    for (k = 0; k < 3; k++) { /* all of the grid */
        step.region_lower[k] = voxel_units ? -1.0f : (float)(desc.grid.origin[k] - spacing[k]);
        step.region_upper[k] = voxel_units ? 32.0f : (float)(desc.grid.origin[k] + 32.0 * spacing[k]);
    }
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT(middle_of_bodies(tiling, after));
    for (k = 0; k < 3; k++) {
        const double unit = voxel_units ? 1.0 : spacing[k];
        const double middle = voxel_units ? 15.3 : desc.grid.origin[k] + 15.3 * spacing[k], extent = radius / spacing[k] * unit;
        const double way = (double)seen.velocity[k];
        ASSERT_IN_RANGE(before[k] + (double)world_velocity[k], after[k], 0.05 * spacing[k]);
        ASSERT_IN_RANGE(middle - extent + (way < 0.0 ? way : 0.0), seen.lower[k], 1.5 * unit);
        ASSERT_IN_RANGE(middle + extent + (way > 0.0 ? way : 0.0), seen.upper[k], 1.5 * unit);
    }
    ASSERT_EQ(0, warned);
    for (k = 0; k < 3; k++) step.region_lower[k] = 1e5f, step.region_upper[k] = 2e5f;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_EQ(1, warned);
    ASSERT(middle_of_bodies(tiling, before));
    for (k = 0; k < 3; k++) ASSERT_IN_RANGE(after[k], before[k], 0.05 * spacing[k]);
    springls_tiling_destroy(tiling);
    PASS();
}

static void to_the_border(void *user, const springls_tiling_batch *batch, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < 3 * batch->batch.count; i++) out[i] = i % 3 == 0 ? -1.0f : 0.0f;
}

/* What cannot be held, and factors that are none, are refused, and nothing moves. */
TEST what_cannot_be_held_is_refused(void)
{
    part ball = part_at(7.2f, 13.6f, 13.3f, 5.0f, 0);
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_hold held[2];
    float factor = -1.0f;
    uint64_t hash;
    int i;
    memset(held, 0, sizeof held);
    held[0].label = held[1].label = 5;
    step.tension = 1.0f;
    step.held = held;
    step.dt = 0.5f;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 5, part_of_ball, &ball));
    step.velocity = to_the_border;
    step.dt = 1.0f;
    step.tension = 0.0f;
    for (i = 0; i < 5; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    step.velocity = NULL;
    step.tension = 1.0f;
    hash = springls_tiling_state_hash(tiling);
    step.held_count = 1;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    ASSERT(strstr(springls_tiling_last_error(tiling), "border"));
    step.held_count = 2;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    ASSERT(strstr(springls_tiling_last_error(tiling), "twice"));
    step.held_count = 0;
    step.tension_of = bad_factor;
    step.user = &factor;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    factor = NAN;
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_tiling_step(tiling, &step, NULL));
    ASSERT(strstr(springls_tiling_last_error(tiling), "tension_of"));
    ASSERT(hash == springls_tiling_state_hash(tiling) && held[0].target == 0.0);
    springls_tiling_destroy(tiling);
    PASS();
}

/* ---- bodies that vanish ---- */

/* Shrinks label 2, and lets label 1 be. */
static void shrink_second(void *user, const springls_tiling_batch *batch, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < batch->batch.count; i++)
        out[i] = batch->label == 2 ? -0.5f : batch->label == 0 && batch->facing[i] == 2 ? 0.5f : 0.0f;
}

/* A body that vanishes is reported once, and the other stays. */
TEST bodies_vanish(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(8.2f, 13.6f, 13.3f, 4.5f, 0), second = part_at(19.0f, 13.6f, 13.3f, 3.0f, 0);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    springls_tiling_measures measures[2];
    double before;
    int i, vanished = 0;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, part_of_ball, &first));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &second));
    ASSERT_OK(springls_tiling_measure(tiling, measures));
    before = measures[0].volume;
    step.pressure = shrink_second;
    step.dt = 1.0f;
    for (i = 0; i < 12; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        if (report.vanished_count) ASSERT_EQ(2, report.vanished[0]);
        vanished += report.vanished_count;
    }
    ASSERT_EQ(1, vanished);
    ASSERT_EQ(1, springls_tiling_count(tiling));
    ASSERT(!springls_tiling_body(tiling, 2));
    ASSERT_OK(springls_tiling_measure(tiling, measures));
    ASSERT_IN_RANGE(before, measures[0].volume, 0.01 * before);
    springls_tiling_destroy(tiling);
    PASS();
}

/* Presses label 2 together from all sides. */
static void press_second(void *user, const springls_tiling_batch *batch, float *out)
{
    const float *speed = (const float *)user;
    int i;
    for (i = 0; i < batch->batch.count; i++)
        out[i] = batch->label == 2 ? -*speed : batch->facing[i] == 2 ? *speed : 0.0f;
}

/* A body that shares a wall and is pressed to nothing vanishes when it has no voxel left. Nothing faces it from then on, and the other body
   stays as it is, without more springls than before. That sheets are not looked at in every step (period) makes no difference. */
TEST walls_vanish(int period)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(13.2f, 13.6f, 13.3f, 7.0f, 1), second = part_at(13.2f, 13.6f, 13.3f, 7.0f, -1);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    springls_tiling_measures now[2];
    static int32_t facing[20000];
    float speed = 0.4f;
    double volume = 0.0;
    int i, k, springls, after = 0, facing_it = 0;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, part_of_ball, &first));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &second));
    ASSERT_OK(springls_tiling_measure(tiling, now));
    springls = now[0].springls;
    step.pressure = press_second;
    step.user = &speed;
    step.dt = 1.0f;
    step.wall_period = period;
    for (i = 0; i < 30 && after < 17; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        ASSERT_OK(springls_tiling_measure(tiling, now));
        if (report.vanished_count) {
            ASSERT_EQ(2, report.vanished[0]);
            volume = now[0].volume;
        } else if (!after) {
            ASSERT(now[1].voxels > 0);
            continue;
        }
        after++;
        ASSERT_OK(springls_tiling_facing(tiling, 1, facing));
        for (k = 0; k < springls_count(springls_tiling_body(tiling, 1)); k++) facing_it += facing[k] == 2;
    }
    if (GREATEST_IS_VERBOSE()) printf("  %d steps, %d springls, volume %.1f\n", i, now[0].springls, now[0].volume);
    ASSERT_EQ(17, after);
    ASSERT_EQ(1, springls_tiling_count(tiling));
    ASSERT_EQ(0, facing_it);
    ASSERT_IN_RANGE(volume, now[0].volume, 0.05 * volume);
    ASSERT_LT(now[0].springls, springls);
    springls_tiling_destroy(tiling);
    PASS();
}

/* Where all bodies have vanished there are none: nothing has a label or a wall, until one is added. */
TEST all_vanish(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part ball = part_at(13.2f, 13.6f, 13.3f, 2.5f, 0);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_measures measures[1];
    springls_walls walls;
    static int32_t labels[VOXELS];
    float speed = 0.5f, point[3] = { 3.0f, 3.0f, 3.0f };
    int i;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &ball));
    step.pressure = press_second;
    step.user = &speed;
    step.dt = 1.0f;
    for (i = 0; i < 12 && springls_tiling_count(tiling); i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_EQ(0, springls_tiling_count(tiling));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_step(tiling, &step, NULL));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_copy_labels(tiling, labels));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_sample_labels(tiling, point, 1, labels));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_measure(tiling, measures));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_extract(tiling, &walls));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 3, part_of_ball, &ball));
    ASSERT_IN_RANGE((double)i, springls_time(springls_tiling_body(tiling, 3)), 1e-4);
    ASSERT_IN_RANGE((double)i, springls_time(springls_tiling_body(tiling, 0)), 1e-4);
    ASSERT_EQ(springls_count(springls_tiling_body(tiling, 3)), springls_count(springls_tiling_body(tiling, 0)));
    ASSERT_OK(springls_tiling_copy_labels(tiling, labels));
    springls_tiling_destroy(tiling);
    PASS();
}

/* ---- what callers do meanwhile ---- */

/* A model that a caller has replaced has lost what its springls face: a step finds it again. Its original surface, and with it the wall,
   are where they were. */
TEST models_may_be_replaced(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(12.4f, 13.7f, 13.1f, 7.0f, 1);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_context *body;
    uint64_t before;
    static int32_t facing[20000];
    int i, k, faced = 0;
    ASSERT_OK(set_two_halves(tiling, 7.0f));
    body = springls_tiling_body(tiling, 4);
    step.velocity = swirl;
    step.dt = 0.0f;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    for (k = 0; k < 2; k++) {
        if (k == 0) ASSERT_OK(springls_set_implicit(body, part_of_ball, &first));
        else ASSERT_OK(springls_remove_attribute(body, springls_find_attribute(body, "tiling.facing")));
        before = springls_tiling_state_hash(tiling);
        ASSERT_OK(springls_tiling_facing(tiling, 4, facing));
        ASSERT(before == springls_tiling_state_hash(tiling));
        ASSERT_EQ(-1, springls_find_attribute(body, "tiling.facing"));
        step.dt = 0.0625f;
        for (i = 0; i < 9; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    }
    ASSERT_OK(springls_tiling_facing(tiling, 4, facing));
    for (i = 0; i < springls_count(body); i++) faced += facing[i] == 9;
    ASSERT_GT(faced, 60);
    ASSERT_OK(springls_reset(springls_tiling_body(tiling, 0)));
    first.center[0] = 24.0f;
    first.radius = 2.0f;
    first.side = 0;
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_add_implicit(tiling, 5, part_of_ball, &first));
    ASSERT(error_has(tiling, "label 0"));
    springls_tiling_destroy(tiling);
    PASS();
}

/* A body that comes later has the time of the others. */
TEST later_bodies_have_the_time(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(8.2f, 13.6f, 13.3f, 4.5f, 0), second = part_at(19.0f, 13.6f, 13.3f, 3.0f, 0);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, part_of_ball, &first));
    step.dt = 0.75f;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &second));
    ASSERT_IN_RANGE(0.75, springls_time(springls_tiling_body(tiling, 0)), 1e-6);
    ASSERT_IN_RANGE(0.75, springls_time(springls_tiling_body(tiling, 2)), 1e-6);
    springls_tiling_destroy(tiling);
    PASS();
}

/* A map makes the same tiling wherever it is set, and reading leaves it so; before the first step too. */
TEST the_past_does_not_matter(void)
{
    static int32_t labels[BALL_VOXELS], facing[20000];
    springls_tiling *used = tiling_of_size(BALL, NULL), *fresh = tiling_of_size(BALL, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    int i;
    three_labels(labels, BALL, 7.0f);
    step.velocity = swirl;
    step.dt = 0.0625f;
    ASSERT_OK(springls_tiling_set_labels(used, labels, 1));
    for (i = 0; i < 3; i++) ASSERT_OK(springls_tiling_step(used, &step, NULL));
    ASSERT_OK(springls_tiling_set_labels(used, labels, 1));
    ASSERT_OK(springls_tiling_set_labels(fresh, labels, 1));
    ASSERT_OK(springls_tiling_facing(used, 70, facing));
    ASSERT_OK(springls_tiling_facing(used, 0, facing));
    ASSERT(springls_tiling_state_hash(used) == springls_tiling_state_hash(fresh));
    for (i = 0; i < 8; i++) {
        ASSERT_OK(springls_tiling_step(used, &step, NULL));
        ASSERT_OK(springls_tiling_step(fresh, &step, NULL));
        ASSERT(springls_tiling_state_hash(used) == springls_tiling_state_hash(fresh));
    }
    springls_tiling_destroy(used);
    springls_tiling_destroy(fresh);
    PASS();
}

/* Springls that a wall gets from its other side inherit the attributes of the caller, who may have all but one. */
TEST mirrored_springls_inherit(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    springls_attribute_desc attribute = { "A", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    static const int32_t label[3] = { 0, 4, 9 };
    static float ones[20000];
    char name[2] = "A";
    int i, k, mirrored = 0;
    for (i = 0; i < 20000; i++) ones[i] = 1.0f;
    ASSERT_OK(set_two_halves(tiling, 7.0f));
    attribute.name = name;
    for (k = 0; k < 3; k++) {
        springls_context *body = springls_tiling_body(tiling, label[k]);
        for (name[0] = 'A'; springls_attribute_count(body) < SPRINGLS_MAX_ATTRIBUTES; name[0]++)
            ASSERT_OK(springls_add_attribute(body, &attribute, ones, NULL));
    }
    step.velocity = swirl;
    step.dt = 0.0625f;
    for (i = 0; i < 24; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        mirrored += report.mirrored;
    }
    ASSERT_GT(mirrored, 0);
    for (k = 0; k < 3; k++) {
        springls_context *body = springls_tiling_body(tiling, label[k]);
        const float *values = springls_view_attribute(body, springls_find_attribute(body, "A")).data;
        for (i = 0; i < springls_count(body); i++) ASSERT_IN_RANGE(1.0, values[i], 1e-6);
    }
    springls_tiling_destroy(tiling);
    PASS();
}

/* Those for which max_springls has no room are refused, and not counted as mirrored. */
TEST mirrored_springls_are_counted(void)
{
    springls_desc desc = fixture_desc(BALL, NULL);
    springls_tiling *tiling;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    static int32_t labels[BALL_VOXELS];
    static const int32_t label[4] = { 0, 3, 70, 65535 };
    int64_t refused = 0, added = 0;
    int i, k, run, largest = 0;
    three_labels(labels, BALL, 7.0f);
    for (run = 0; run < 2; run++) {
        if (run) desc.max_springls = largest;
        ASSERT_OK(springls_tiling_create(&desc, &tiling));
        ASSERT_OK(springls_tiling_set_labels(tiling, labels, 0));
        for (k = 0; k < 4; k++) {
            const int springls = springls_count(springls_tiling_body(tiling, label[k]));
            if (springls > largest) largest = springls;
        }
        step.velocity = swirl;
        step.dt = 0.0625f;
        for (i = 0; i < 8; i++) {
            added = 0;
            for (k = 0; k < 4; k++) added -= springls_get_stats(springls_tiling_body(tiling, label[k])).added;
            ASSERT_OK(springls_tiling_step(tiling, &step, &report));
            for (k = 0; k < 4; k++) added += springls_get_stats(springls_tiling_body(tiling, label[k])).added;
        }
        for (k = 0; k < 4; k++) refused += springls_get_stats(springls_tiling_body(tiling, label[k])).refused;
        ASSERT_GT(report.mirrored, 0);
        ASSERT(report.mirrored <= (int)added);
        springls_tiling_destroy(tiling);
    }
    ASSERT(refused > 0);
    PASS();
}

/* ---- rest ---- */

static int resting_bodies(const springls_tiling *tiling)
{
    int i, count = springls_at_rest(springls_tiling_body(tiling, 0));
    for (i = 0; i < springls_tiling_count(tiling); i++)
        count += springls_at_rest(springls_tiling_body(tiling, springls_tiling_label(tiling, i)));
    return count;
}

/* Runs a parallel loop in this thread, and counts it. */
static void count_loop(void *user, int count, int grain, springls_task task, void *arg)
{
    (void)grain;
    ++*(int *)user;
    (task)(arg, 0, count);
}

/* A tiling that comes to rest has the bits of one that is restored, which looks at everything again. Its steps only go over its bodies;
   what is pushed moves. */
TEST bodies_rest(void)
{
    static int32_t labels[BALL_VOXELS];
    springls_desc desc = fixture_desc(BALL, NULL);
    springls_tiling *tiling = NULL, *other = tiling_of_size(BALL, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report, again;
    char *block;
    size_t size;
    int i, k, loops = 0;
    desc.backend = NULL; /* whose work is no loop */
    desc.tasks.parallel_for = count_loop;
    desc.tasks.user = &loops;
    ASSERT_OK(springls_tiling_create(&desc, &tiling));
    three_labels(labels, BALL, 6.0f);
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 2));
    step.dt = 0.125f;
    for (i = 0; i < 40; i++) ASSERT_OK(springls_tiling_step(tiling, &step, &report));
    if (GREATEST_IS_VERBOSE()) printf("  %d loops\n", loops);
    ASSERT_GT(loops, 40 * 20);
    for (k = resting_bodies(tiling); k < 4 && i < 400; k = resting_bodies(tiling), i++)
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
    if (GREATEST_IS_VERBOSE()) printf("  at rest after %d steps\n", i);
    ASSERT_EQ(4, k);
    for (i = 0; i < 250; i++) ASSERT_OK(springls_tiling_step(tiling, &step, &report));
    block = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    ASSERT_OK(springls_tiling_restore(other, block, size));
    loops = 0;
    for (i = 0; i < 40; i++) ASSERT_OK(springls_tiling_step(tiling, &step, &report));
    ASSERT_EQ(40, loops);
    for (i = 0; i < 40; i++) ASSERT_OK(springls_tiling_step(other, &step, &again));
    ASSERT_EQ(report.faced, again.faced);
    ASSERT(report.rms_gap == again.rms_gap);
    free(block);
    block = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    ASSERT(springls_tiling_state_hash(tiling) == springls_tiling_state_hash(other));
    step.velocity = swirl;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT(springls_tiling_state_hash(tiling) != springls_tiling_state_hash(other));
    ASSERT_OK(springls_tiling_step(other, &step, NULL));
    ASSERT(springls_tiling_state_hash(tiling) == springls_tiling_state_hash(other));
    free(block);
    springls_tiling_destroy(tiling);
    springls_tiling_destroy(other);
    PASS();
}

/* Five bodies about the middle of a ball, voxel by voxel. */
static void five_labels(int32_t *labels, int size, double radius)
{
    const d3 way[5] = { d3_make(1.0, 0.2, 0.1), d3_make(-0.5, 0.9, 0.1), d3_make(-0.5, -0.8, 0.3), d3_make(0.1, 0.2, 1.1),
                        d3_make(0.2, 0.1, -1.0) };
    const d3 middle = d3_make(size / 2.0 - 0.4, size / 2.0 - 0.3, size / 2.0 - 0.6);
    int i, k;
    for (i = 0; i < size * size * size; i++) {
        const d3 x = d3_sub(d3_make(i % size, i / size % size, i / (size * size)), middle);
        int best = 0;
        for (k = 1; k < 5; k++)
            if (d3_dot(x, way[k]) > d3_dot(x, way[best])) best = k;
        labels[i] = d3_length(x) < radius ? best + 1 : 0;
    }
}

/* A tiling in which springls would be filled in and removed again for ever comes to rest all the same, with the same bits after it
   has been restored, and read, in between; and wakes where it is touched. */
TEST all_come_to_rest(void)
{
    static int32_t labels[BALL_VOXELS];
    springls_tiling *tiling = tiling_of_size(BALL, NULL), *other = tiling_of_size(BALL, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_context *body;
    float places[9];
    char *block = NULL;
    size_t size;
    int i, resting;
    five_labels(labels, BALL, 5.3);
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 1));
    step.dt = 0.125f;
    for (i = 0; i < 280; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
        if (i == 200) ASSERT_LT(resting_bodies(tiling), 6);
        if (i == 200) block = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    }
    ASSERT_EQ(6, resting_bodies(tiling));
    ASSERT_OK(springls_tiling_restore(other, block, size));
    free(block);
    for (i = 201; i < 280; i++) {
        ASSERT_OK(springls_tiling_step(other, &step, NULL));
        if (i % 16 == 0) ASSERT_OK(springls_tiling_copy_labels(other, labels));
    }
    ASSERT_EQ(6, resting_bodies(other));
    ASSERT(springls_tiling_state_hash(tiling) == springls_tiling_state_hash(other));
    body = springls_tiling_body(tiling, 2);
    memcpy(places, springls_view_vertices(body).data, sizeof places);
    for (i = 0; i < 9; i++) places[i] += 0.3f;
    ASSERT_OK(springls_write(body, 0, 1, places, NULL));
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_FALSE(springls_at_rest(body));
    for (i = 0; i < 280; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    resting = resting_bodies(tiling);
    springls_tiling_destroy(tiling);
    springls_tiling_destroy(other);
    ASSERT_EQ(6, resting);
    PASS();
}

/* Moves all springls of a body along the axes from `axis` on. */
static springls_status shift_along(springls_context *body, int axis, float by)
{
    const springls_view view = springls_view_vertices(body);
    const int count = springls_count(body);
    float *places = (float *)malloc(sizeof(float) * 9u * (size_t)count);
    springls_status status;
    int i;
    for (i = 0; i < 9 * count; i++) places[i] = ((const float *)view.data)[i] + (i % 3 >= axis ? by : 0.0f);
    status = springls_write(body, 0, count, places, NULL);
    free(places);
    return status;
}

static springls_status shift_body(springls_context *body, float by) { return shift_along(body, 0, by); }

/* What is changed by hand shortly before a tiling would be put to rest has as many steps to settle; also where it is restored in
   between. */
TEST edits_begin_the_count_anew(void)
{
    static int32_t labels[BALL_VOXELS];
    springls_tiling *tiling = tiling_of_size(BALL, NULL), *other = tiling_of_size(BALL, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    float gap = 0.0f, shifted = 0.0f, closed = 0.0f; /* as of looks at the sheets: one in 8 steps */
    char *block;
    size_t size;
    int i;
    five_labels(labels, BALL, 5.3);
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 1));
    step.dt = 0.125f;
    for (i = 0; i < 254; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        if (report.faced) gap = report.rms_gap;
    }
    ASSERT_OK(shift_body(springls_tiling_body(tiling, 2), 0.3f));
    block = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    ASSERT_OK(springls_tiling_restore(other, block, size));
    free(block);
    for (i = 0; i < 100; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        if (report.faced) closed = report.rms_gap;
        if (i < 8) shifted = report.rms_gap > shifted ? report.rms_gap : shifted;
        ASSERT_LT(resting_bodies(tiling), 6);
        ASSERT_OK(springls_tiling_step(other, &step, NULL));
    }
    if (GREATEST_IS_VERBOSE()) printf("  gaps %g, shifted %g, closed %g\n", (double)gap, (double)shifted, (double)closed);
    ASSERT_GT(shifted, 1.5f * gap);
    ASSERT_LT(closed, 1.2f * gap);
    ASSERT(springls_tiling_state_hash(tiling) == springls_tiling_state_hash(other));
    springls_tiling_destroy(tiling);
    springls_tiling_destroy(other);
    PASS();
}

/* A bar of six bodies, one behind the other along z. */
enum { BAR_SIDE = 16, BAR_LENGTH = 56 };

static springls_status set_bar(springls_tiling **tiling, const springls_tasks *tasks)
{
    static int32_t labels[BAR_SIDE * BAR_SIDE * BAR_LENGTH];
    springls_desc desc = fixture_desc(BAR_SIDE, NULL);
    springls_status status;
    int i;
    desc.grid.size[2] = BAR_LENGTH;
    if (tasks) {
        desc.tasks = *tasks;
        desc.backend = NULL; /* whose work is no loop */
    }
    for (i = 0; i < BAR_SIDE * BAR_SIDE * BAR_LENGTH; i++) {
        const int x = i % BAR_SIDE - 8, y = i / BAR_SIDE % BAR_SIDE - 8, z = i / (BAR_SIDE * BAR_SIDE) - 4;
        labels[i] = x * x + y * y < 20 && z >= 0 && z < 48 ? 1 + z / 8 : 0;
    }
    status = springls_tiling_create(&desc, tiling);
    return status == SPRINGLS_OK ? springls_tiling_set_labels(*tiling, labels, 2) : status;
}

/* Counts the elements of parallel loops. */
static void count_elements(void *user, int count, int grain, springls_task task, void *arg)
{
    (void)grain;
    *(int *)user += count;
    (task)(arg, 0, count);
}

/* Brings a tiling to the state of another one by a block, so that it looks at everything again. */
static springls_status bring_to(springls_tiling *other, springls_tiling *tiling)
{
    size_t size;
    char *block = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    const springls_status status = springls_tiling_restore(other, block, size);
    free(block);
    return status;
}

/* Where only the first of six bodies is moved, by hand or by a force in its place, the others cost nothing, and bits are those of a tiling
   that looks at all of them in every step. */
TEST others_rest(bool by_hand)
{
    springls_tiling *tiling = NULL, *other = NULL;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report, again;
    springls_tasks tasks;
    float places[9];
    int i, k, work = 0, all, one = 0, disturbed = 0, resting = 0;
    memset(&tasks, 0, sizeof tasks);
    tasks.parallel_for = count_elements;
    tasks.user = &work;
    ASSERT_OK(set_bar(&tiling, &tasks));
    ASSERT_OK(set_bar(&other, NULL));
    step.dt = 0.125f;
    for (i = 0; i < 256; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    all = work;
    for (; i < 280; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    work = 0;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_EQ(7, work); /* it counts for each body */
    if (by_hand) {
        memcpy(places, springls_view_vertices(springls_tiling_body(tiling, 1)).data, sizeof places);
        for (i = 0; i < 9; i++) places[i] -= 0.3f;
        ASSERT_OK(springls_write(springls_tiling_body(tiling, 1), 0, 1, places, NULL));
    } else {
        step.velocity = swirl;
        for (k = 0; k < 3; k++) step.region_upper[k] = k < 2 ? (float)BAR_SIDE : 6.0f;
    }
    for (i = 0; i < 64; i++) {
        if (i == 4) step.velocity = NULL;
        ASSERT_OK(bring_to(other, tiling));
        work = 0;
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        one += work;
        ASSERT_OK(springls_tiling_step(other, &step, &again));
        ASSERT(springls_tiling_state_hash(tiling) == springls_tiling_state_hash(other));
        ASSERT_EQ(again.faced, report.faced);
        ASSERT(again.rms_gap == report.rms_gap);
        disturbed += !springls_at_rest(springls_tiling_body(tiling, 1));
        for (k = 3; k <= 6; k++) resting += springls_at_rest(springls_tiling_body(tiling, k));
    }
    if (GREATEST_IS_VERBOSE()) printf("  %.1f elements a step of all, %.1f of one\n", (double)all / 256.0, (double)one / 64.0);
    ASSERT(disturbed > 4);
    ASSERT_EQ(4 * 64, resting);
    ASSERT_LT((double)one / 64.0, 0.7 * (double)all / 256.0);
    springls_tiling_destroy(tiling);
    springls_tiling_destroy(other);
    PASS();
}

/* Returns how many steps without forces a block has of a label (tiling_snapshot.h), -1: it has no such body. */
static int idle_in(springls_tiling *tiling, int32_t label)
{
    size_t size, at;
    char *block = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_FRAME, &size);
    int32_t found[2] = { -1, -1 };
    for (at = 0; at + 24 <= size && found[0] != label; at += 8)
        if (memcmp(block + at, "BODY", 4) == 0) memcpy(found, block + at + 16, sizeof found);
    free(block);
    return found[0] == label ? (int)found[1] : -1;
}

/* Makes a bar, and steps until all of it rests. */
static springls_status set_resting_bar(springls_tiling **tiling, const springls_tiling_step_desc *step)
{
    springls_status status = set_bar(tiling, NULL);
    int i;
    for (i = 0; i < 280 && status == SPRINGLS_OK; i++) status = springls_tiling_step(*tiling, step, NULL);
    return status;
}

/* Where a body that rests is moved away, with its level set, the one that it leaves behind begins its count anew; also in a tiling that has
   been restored, whose bodies were elsewhere, or were none. What a caller only wakes begins anew, too. */
TEST the_left_begin_anew(void)
{
    springls_tiling *tiling = NULL, *other = NULL;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    int i;
    step.dt = 0.125f;
    ASSERT_OK(set_resting_bar(&tiling, &step));
    ASSERT_EQ(7, resting_bodies(tiling));
    ASSERT_OK(set_bar(&other, NULL));
    ASSERT_OK(bring_to(other, tiling));
    for (i = 1; i <= 6; i++) ASSERT_EQ(256, idle_in(tiling, i));
    for (i = 0; i < 2; i++) {
        springls_context *body = springls_tiling_body(i ? other : tiling, 1);
        ASSERT_OK(shift_along(body, 2, 36.0f));
        ASSERT_OK(springls_set_reference(body));
    }
    for (i = 0; i <= 6; i++) ASSERT_EQ(idle_in(other, i), idle_in(tiling, i));
    ASSERT_EQ(0, idle_in(tiling, 2));
    ASSERT_EQ(256, idle_in(tiling, 3));
    for (i = 0; i < 16; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
        ASSERT_OK(springls_tiling_step(other, &step, NULL));
        ASSERT(springls_tiling_state_hash(tiling) == springls_tiling_state_hash(other));
    }
    ASSERT_EQ(256, idle_in(tiling, 3));
    ASSERT(springls_at_rest(springls_tiling_body(tiling, 3)));
    ASSERT_OK(springls_set_reference(springls_tiling_body(tiling, 3)));
    ASSERT_FALSE(springls_at_rest(springls_tiling_body(tiling, 3)));
    ASSERT_EQ(0, idle_in(tiling, 3));
    springls_tiling_destroy(tiling);
    springls_tiling_destroy(other);
    PASS();
}

/* Where a body that rests cannot count, no other does. */
TEST times_are_checked_first(void)
{
    springls_tiling *tiling = NULL;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    uint64_t before;
    int i;
    step.dt = 0.125f;
    ASSERT_OK(set_resting_bar(&tiling, &step));
    springls_set_time(springls_tiling_body(tiling, 3), 1e15);
    before = springls_tiling_state_hash(tiling);
    step.dt = 1e-3f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    ASSERT(error_has(tiling, "label 3"));
    for (i = 0; i <= 6; i++) if (i != 3) ASSERT(springls_time(springls_tiling_body(tiling, i)) == 280 * 0.125);
    ASSERT(springls_tiling_state_hash(tiling) == before);
    ASSERT_EQ(7, resting_bodies(tiling));
    springls_tiling_destroy(tiling);
    PASS();
}

/* A body that is added to others at rest, and touches one, can be joined with it before a step. */
TEST the_added_join_what_rests(void)
{
    static const int triangles[36] = { 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5 };
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    float corner[24];
    int i, body;
    step.dt = 0.125f;
    for (body = 0; body < 3; body++) { /* one behind the other along x; the last one is added to two that rest */
        for (i = 0; i < 8; i++) {
            corner[3 * i] = 4.0f + 5.0f * (float)(body + (i & 1));
            corner[3 * i + 1] = i & 2 ? 16.0f : 8.0f;
            corner[3 * i + 2] = i & 4 ? 16.0f : 8.0f;
        }
        ASSERT_OK(springls_tiling_add_mesh(tiling, body + 1, corner, 8, 0, triangles, 12, NULL));
        for (i = 0; i < 260 && body == 1; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    }
    ASSERT_OK(springls_tiling_join(tiling, 2, 3));
    ASSERT_EQ(2, springls_tiling_count(tiling));
    springls_tiling_destroy(tiling);
    PASS();
}

/* Where the model of a body at rest is replaced, the gaps of the others stay reported. */
TEST gaps_at_rest_stay_known(void)
{
    springls_tiling *tiling = NULL;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report before, after;
    springls_context *body;
    springls_mesh mesh;
    ASSERT_OK(set_resting_bar(&tiling, &step));
    ASSERT_OK(springls_tiling_step(tiling, &step, &before));
    body = springls_tiling_body(tiling, 1);
    memset(&mesh, 0, sizeof mesh);
    ASSERT_OK(springls_extract_mesh(body, &mesh));
    ASSERT_OK(springls_set_mesh(body, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL));
    springls_mesh_free(body, &mesh);
    ASSERT_OK(springls_tiling_step(tiling, &step, &after));
    if (GREATEST_IS_VERBOSE()) printf("  faced: %d before, %d after\n", before.faced, after.faced);
    ASSERT_GT(after.faced, before.faced * 9 / 10);
    springls_tiling_destroy(tiling);
    PASS();
}

/* A region of forces has to be one, and surface tension has none. */
TEST wrong_regions_are_refused(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    ASSERT_OK(set_two_halves(tiling, 6.0f));
    step.dt = 0.1f;
    step.region_lower[0] = 3.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    ASSERT(error_has(tiling, "region"));
    step.region_upper[0] = (float)NAN;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    step.region_upper[0] = step.region_upper[1] = step.region_upper[2] = 20.0f;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    step.tension = 1.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    ASSERT(error_has(tiling, "tension"));
    springls_tiling_destroy(tiling);
    PASS();
}

/* A tiling with a model that may not sleep is not put to rest: others move with it. */
TEST what_may_not_sleep_is_not_put_to_rest(void)
{
    static int32_t labels[BALL_VOXELS];
    springls_tiling *tiling = tiling_of_size(BALL, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_params params;
    int i;
    five_labels(labels, BALL, 5.3);
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 1));
    params = springls_get_params(springls_tiling_body(tiling, 0));
    params.evolve_iterations = 1;
    ASSERT_OK(springls_set_params(springls_tiling_body(tiling, 0), &params));
    step.dt = 0.125f;
    for (i = 0; i < 260; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
        if (i >= 250) ASSERT_LT(resting_bodies(tiling), 5);
    }
    springls_tiling_destroy(tiling);
    PASS();
}

/* A tiling on the device that is asked for has the bits of a scalar one: as bodies flow, are pushed, have surface tension, are measured
   between steps or moved by themselves, join, and come to rest; so have their snapshots. */
TEST backends_have_the_same_bits(void)
{
    static int32_t labels[BALL_VOXELS];
    springls_tiling *tiling[2] = { NULL, NULL };
    springls_desc desc = fixture_desc(BALL, NULL);
    const uint64_t kernels = fixture_kernels();
    springls_tiling_hold held[2][3];
    float speed = 0.1f;
    size_t size[2];
    char *block[2];
    int i, t;
    ASSERT_OK(springls_tiling_create(&desc, &tiling[0]));
    desc.backend = NULL;
    ASSERT_OK(springls_tiling_create(&desc, &tiling[1]));
    three_labels(labels, BALL, 6.0f);
    memset(held, 0, sizeof held);
    for (t = 0; t < 2; t++) ASSERT_OK(springls_tiling_set_labels(tiling[t], labels, 2));
    for (i = 0; i < 44; i++) {
        for (t = 0; t < 2; t++) {
            springls_tiling_step_desc step = springls_default_tiling_step_desc();
            springls_tiling_measures measures[3];
            step.dt = 0.125f;
            step.user = &speed;
            if (i < 16) step.velocity = swirl;
            else if (i < 24) step.pressure = grow;
            else if (i < 32) {
                held[t][0].label = 3, held[t][1].label = 70, held[t][2].label = 65535;
                step.tension = 1.0f;
                step.held = held[t];
                step.held_count = 3;
            }
            ASSERT_OK(springls_tiling_step(tiling[t], &step, NULL));
            if (i % 4 == 0) ASSERT_OK(springls_tiling_measure(tiling[t], measures));
            if (i == 20) ASSERT_OK(springls_run_stage(springls_tiling_body(tiling[t], 70), SPRINGLS_STAGE_RESAMPLE));
            if (i == 36) ASSERT_OK(springls_tiling_join(tiling[t], 70, 3));
        }
        ASSERT(springls_tiling_state_hash(tiling[0]) == springls_tiling_state_hash(tiling[1]));
    }
    for (t = 0; t < 2; t++) block[t] = block_of(tiling[t], SPRINGLS_SNAPSHOT_KIND_ALL, &size[t]);
    ASSERT_EQ(size[0], size[1]);
    ASSERT_EQ(0, memcmp(block[0], block[1], size[0]));
    ASSERT_OK(springls_tiling_restore(tiling[0], block[1], size[1]));
    ASSERT(springls_tiling_state_hash(tiling[0]) == springls_tiling_state_hash(tiling[1]));
    ASSERT(!fixture_backend() || fixture_kernels() > kernels + 1000);
    for (t = 0; t < 2; t++) {
        free(block[t]);
        springls_tiling_destroy(tiling[t]);
    }
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(walls_stay_closed);
    RUN_TEST(zeroed_steps_are_divided);
    RUN_TEST(backends_have_the_same_bits);
    RUN_TEST(bodies_meet);
    RUN_TEST(bodies_meet_askew);
    RUN_TESTp(films_part_or_join, SPRINGLS_FILM_PART, 0.06f, 9);
    RUN_TESTp(films_part_or_join, SPRINGLS_FILM_PART, 0.6f, 8);
    RUN_TESTp(films_part_or_join, SPRINGLS_FILM_JOIN, 0.3f, 9);
    RUN_TEST(wrong_films_are_refused);
    RUN_TEST(halves_join);
    RUN_TESTp(bubbles_keep_their_volumes, 1.0f);
    RUN_TESTp(bubbles_keep_their_volumes, 1.4f);
    RUN_TESTp(tension_is_in_world_units, 1.0);
    RUN_TESTp(tension_is_in_world_units, 0.5);
    RUN_TESTp(flows_are_of_the_world, 0.5, 0.5, false);
    RUN_TESTp(flows_are_of_the_world, 0.5, 1.0, false);
    RUN_TESTp(flows_are_of_the_world, 0.5, 0.5, true);
    RUN_TESTp(flows_are_of_the_world, 0.5, 1.0, true);
    RUN_TEST(neighbors_change);
    RUN_TEST(what_cannot_be_held_is_refused);
    RUN_TEST(targets_are_reached);
    RUN_TEST(bodies_vanish);
    RUN_TESTp(walls_vanish, 1);
    RUN_TESTp(walls_vanish, 8);
    RUN_TEST(all_vanish);
    RUN_TEST(models_may_be_replaced);
    RUN_TEST(later_bodies_have_the_time);
    RUN_TEST(the_past_does_not_matter);
    RUN_TEST(mirrored_springls_inherit);
    RUN_TEST(mirrored_springls_are_counted);
    RUN_TEST(bodies_rest);
    RUN_TEST(all_come_to_rest);
    RUN_TEST(edits_begin_the_count_anew);
    RUN_TEST(what_may_not_sleep_is_not_put_to_rest);
    RUN_TESTp(others_rest, true);
    RUN_TESTp(others_rest, false);
    RUN_TEST(the_left_begin_anew);
    RUN_TEST(times_are_checked_first);
    RUN_TEST(the_added_join_what_rests);
    RUN_TEST(gaps_at_rest_stay_known);
    RUN_TEST(wrong_regions_are_refused);
    GREATEST_MAIN_END();
}
