/* test_combine.c - union, intersection, difference, offset, smooth, remesh: volumes and topology against exact answers, attributes
   and places on the original surfaces kept, combinations in pieces, refusals, memory that runs out. */
#include "fixtures.h"
#include "../../src/model/closest_point.h"
#include "../../src/tools/combine.h"

enum { SIZE = 40 };

static springls_context *ball_at(float x, float radius) { return fixture_sphere(SIZE, NULL, x, 19.7f, 19.4f, radius); }

static springls_box box_at(float x, float y, float half)
{
    springls_box box;
    box.center[0] = x;
    box.center[1] = y;
    box.center[2] = 19.6f;
    box.half[0] = box.half[1] = box.half[2] = half;
    return box;
}

/* The part that two balls of radius r have in common, d between their centres. */
static double lens(double r, double d) { return fixture_pi * (4.0 * r + d) * (2.0 * r - d) * (2.0 * r - d) / 12.0; }
/* The part in common of a ball of radius r and one of radius s whose centre lies on the first. */
static double bite(double r, double s) { return fixture_pi * s * s * s * (2.0 / 3.0 - s / (4.0 * r)); }
static double ball(double r) { return 4.0 / 3.0 * fixture_pi * r * r * r; }

/* As good as marching cubes are at showing it: chords of curved parts and bevelled edges lie inside, by `tolerance` voxels in
   the mean. */
static greatest_test_res check(springls_context *ctx, double volume, double tolerance, int components, int euler)
{
    springls_measures m;
    springls_mesh mesh;
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_IN_RANGE(volume, m.volume, tolerance * m.area);
    ASSERT_EQ(components, m.components);
    ASSERT_EQ(euler, m.euler);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    ASSERT_EQ(0, fixture_report(&mesh).boundary_edges + fixture_report(&mesh).unbalanced_edges);
    springls_mesh_free(ctx, &mesh);
    PASS();
}

TEST balls_have_the_exact_volume(int operation)
{
    const double exact[3] = { 2.0 * ball(8.0) - lens(8.0, 8.0), lens(8.0, 8.0), ball(8.0) - lens(8.0, 8.0) };
    springls_context *a = ball_at(15.3f, 8.0f), *b = ball_at(23.3f, 8.0f);
    int i;
    ASSERT_OK(springls_combine(a, (springls_operation)operation, b));
    CHECK_CALL(check(a, exact[operation], 0.05, 1, 2));
    ASSERT_GT(springls_get_stats(a).at_edges, 100);
    for (i = 0; i < springls_count(a); i++) { /* every springl lies on one of the two balls and in neither, or in both, ... */
        d3 p = d3_of(fixture_particle(a, i));
        double of_a = d3_distance(p, d3_make(15.3, 19.7, 19.4)) - 8.0, of_b = d3_distance(p, d3_make(23.3, 19.7, 19.4)) - 8.0;
        double side = operation == SPRINGLS_OPERATION_UNION ? fmin(of_a, of_b)
                                                            : fmax(of_a, operation == SPRINGLS_OPERATION_DIFFERENCE ? -of_b : of_b);
        ASSERT_IN_RANGE(0.0, side, 0.35);
    }
    springls_destroy(a);
    springls_destroy(b);
    PASS();
}

TEST boxes_have_the_exact_volume(int operation)
{
    const double whole = pow(15.0, 3.0), part = 8.0 * 8.0 * 15.0, exact[3] = { 2.0 * whole - part, part, whole - part };
    springls_box x = box_at(16.2f, 16.3f, 7.5f), y = box_at(23.2f, 23.3f, 7.5f);
    springls_context *a = fixture_context(SIZE, NULL);
    ASSERT_OK(springls_set_implicit(a, springls_implicit_box, &x));
    ASSERT_OK(springls_combine_implicit(a, (springls_operation)operation, springls_implicit_box, &y));
    CHECK_CALL(check(a, exact[operation], 0.05, 1, 2));
    springls_destroy(a);
    PASS();
}

/* What does not touch: two parts, a hollow, nothing. Faces in common: one of them is left, or none. */
TEST surfaces_may_not_meet_or_share_faces(void)
{
    springls_context *a = ball_at(10.0f, 5.0f);
    springls_sphere far = fixture_ball(28.0f, 19.7f, 19.4f, 5.0f), inner = fixture_ball(10.0f, 19.7f, 19.4f, 3.0f),
        same = fixture_ball(10.0f, 19.7f, 19.4f, 5.0f);
    springls_box left = box_at(12.25f, 19.7f, 5.0f), right = box_at(22.25f, 19.7f, 5.0f);
    ASSERT_OK(springls_combine_implicit(a, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &far));
    CHECK_CALL(check(a, 2.0 * ball(5.0), 0.05, 2, 4));
    ASSERT_OK(springls_combine_implicit(a, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &inner));
    CHECK_CALL(check(a, 2.0 * ball(5.0) - ball(3.0), 0.05, 3, 6));
    ASSERT_STATUS(SPRINGLS_OK, springls_set_implicit(a, springls_implicit_sphere, &same));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL,
                  springls_combine_implicit(a, SPRINGLS_OPERATION_INTERSECTION, springls_implicit_sphere, &far));
    ASSERT_EQ(0, springls_count(a));
    ASSERT_OK(springls_set_implicit(a, springls_implicit_sphere, &same));
    ASSERT_OK(springls_combine_implicit(a, SPRINGLS_OPERATION_INTERSECTION, springls_implicit_sphere, &same));
    CHECK_CALL(check(a, ball(5.0), 0.05, 1, 2));
    ASSERT_OK(springls_set_implicit(a, springls_implicit_box, &left));
    ASSERT_OK(springls_combine_implicit(a, SPRINGLS_OPERATION_UNION, springls_implicit_box, &right));
    CHECK_CALL(check(a, 2000.0, 0.05, 1, 2));
    ASSERT_OK(springls_set_implicit(a, springls_implicit_box, &left));
    ASSERT_OK(springls_combine_implicit(a, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_box, &right));
    CHECK_CALL(check(a, 1000.0, 0.05, 1, 2));
    springls_destroy(a);
    PASS();
}

/* A box of twelve triangles: its corners are center + directions times half. */
static springls_context *mesh_box(d3 center, const d3 direction[3], d3 half)
{
    static const int face[36] = { 0,2,3, 0,3,1, 4,5,7, 4,7,6, 0,1,5, 0,5,4, 2,6,7, 2,7,3, 0,4,6, 0,6,2, 1,3,7, 1,7,5 };
    springls_context *ctx = fixture_context(SIZE, NULL);
    float positions[24];
    int i;
    for (i = 0; i < 8; i++) {
        d3 x = d3_mad(center, direction[0], i & 1 ? half.x : -half.x);
        x = d3_mad(d3_mad(x, direction[1], i & 2 ? half.y : -half.y), direction[2], i & 4 ? half.z : -half.z);
        positions[3 * i] = (float)x.x;
        positions[3 * i + 1] = (float)x.y;
        positions[3 * i + 2] = (float)x.z;
    }
    if (springls_set_mesh(ctx, positions, 8, 0, face, 12, NULL) != SPRINGLS_OK) springls_reset(ctx);
    return ctx;
}

/* A box from a mesh or, along the axes, from a function. */
static springls_context *solid_box(d3 center, const d3 direction[3], double half, bool from_mesh)
{
    springls_context *ctx;
    springls_box box;
    if (from_mesh) return mesh_box(center, direction, d3_make(half, half, half));
    ctx = fixture_context(SIZE, NULL);
    box.center[0] = (float)center.x;
    box.center[1] = (float)center.y;
    box.center[2] = (float)center.z;
    box.half[0] = box.half[1] = box.half[2] = (float)half;
    if (springls_set_implicit(ctx, springls_implicit_box, &box) != SPRINGLS_OK) springls_reset(ctx);
    return ctx;
}

static const d3 along_axes[3] = { { 1.0, 0.0, 0.0 }, { 0.0, 1.0, 0.0 }, { 0.0, 0.0, 1.0 } };

/* Nothing is left of a box less itself, or less itself moved by very little; faces on voxel planes or between them, the one from
   a mesh, the other from a function, or both. */
TEST box_less_itself(int place)
{
    static const double offset[3] = { 0.0, 0.3, 0.5 };
    const d3 center = d3_make(19.0 + offset[place], 20.0 + offset[place], 19.0 + offset[place]);
    int kinds;
    for (kinds = 0; kinds < 8; kinds++) {
        d3 moved = d3_add(center, kinds & 4 ? d3_make(1e-5, -1e-5, 1e-5) : d3_make(0.0, 0.0, 0.0));
        springls_context *a = solid_box(center, along_axes, 7.0, kinds & 1);
        springls_context *b = solid_box(moved, along_axes, 7.0, (kinds & 2) != 0);
        ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_combine(a, SPRINGLS_OPERATION_DIFFERENCE, b));
        ASSERT_EQ(0, springls_count(a));
        springls_destroy(a);
        springls_destroy(b);
    }
    PASS();
}

/* A mesh with creases of every angle and thin places, a star of eight rays, less itself. */
TEST mesh_less_itself(void)
{
    springls_context *a, *b;
    springls_context *models[2];
    int k, i, j;
    for (k = 0; k < 2; k++) {
        float positions[3 * 26];
        static int face[3 * 48];
        int count = 0, vertex[27];
        models[k] = fixture_context(SIZE, NULL);
        for (i = j = 0; i < 27; i++) {
            int x = i % 3 - 1, y = i / 3 % 3 - 1, z = i / 9 - 1, order = x * x + y * y + z * z;
            float r = order == 3 ? 9.0f : order == 2 ? 3.0f : 6.0f;
            if (order == 0) continue;
            vertex[i] = j;
            positions[3 * j] = 19.4f + r * (float)x;
            positions[3 * j + 1] = 19.7f + r * (float)y;
            positions[3 * j++ + 2] = 19.1f + r * (float)z;
        }
        for (i = 0; i < 24; i++) { /* a quarter of a side of the cube of 26 points: two triangles */
            int axis = i / 8, side = (i / 4 % 2) * 2, u = i % 2, v = i / 2 % 2, step[3], c[4], m;
            step[axis % 3] = axis == 0 ? 1 : axis == 1 ? 3 : 9;
            step[0] = axis == 0 ? 1 : axis == 1 ? 3 : 9;
            step[1] = axis == 0 ? 3 : axis == 1 ? 9 : 1;
            step[2] = axis == 0 ? 9 : axis == 1 ? 1 : 3;
            for (m = 0; m < 4; m++)
                c[m] = vertex[side * step[0] + (u + (m == 1 || m == 2)) * step[1] + (v + (m >= 2)) * step[2]];
            for (m = 0; m < 2; m++) {
                face[3 * count] = c[0];
                face[3 * count + 1] = side ? c[1 + m] : c[2 + m];
                face[3 * count++ + 2] = side ? c[2 + m] : c[1 + m];
            }
        }
        ASSERT_OK(springls_set_mesh(models[k], positions, 26, 0, face, count, NULL));
    }
    a = models[0];
    b = models[1];
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_combine(a, SPRINGLS_OPERATION_DIFFERENCE, b));
    ASSERT_EQ(0, springls_count(a));
    springls_destroy(a);
    springls_destroy(b);
    PASS();
}

/* Boxes that share a face, exactly or but for very little: they have nothing in common, and together they are one box. */
TEST boxes_that_share_a_face(int place)
{
    static const double offset[4] = { 0.0, 0.3, 0.5, 0.0 };
    const d3 center = d3_make(20.0 + offset[place], 19.0 + offset[place], 20.0 + offset[place]), turn = d3_make(0.2, 0.3, 0.25);
    d3 direction[3];
    int kind, near_by, operation, k;
    for (k = 0; k < 3; k++) direction[k] = place == 3 ? d3_rotate(along_axes[k], turn) : along_axes[k];
    for (kind = place == 3; kind < 2; kind++)
        for (near_by = -1; near_by < 2; near_by++)
            for (operation = 0; operation < 2; operation++) {
                springls_context *a = solid_box(d3_mad(center, direction[0], -5.0), direction, 5.0, kind);
                springls_context *b = solid_box(d3_mad(center, direction[0], 5.0 + 1e-5 * near_by), direction, 5.0, kind);
                if (operation == SPRINGLS_OPERATION_INTERSECTION) {
                    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_combine(a, SPRINGLS_OPERATION_INTERSECTION, b));
                } else {
                    ASSERT_OK(springls_combine(a, SPRINGLS_OPERATION_UNION, b));
                    CHECK_CALL(check(a, 2000.0, place ? 0.05 : 0.1, 1, 2)); /* on voxel planes marching cubes cut off most */
                }
                springls_destroy(a);
                springls_destroy(b);
            }
    PASS();
}

static springls_status paint(springls_context *ctx, const char *name, float value)
{
    springls_attribute_desc desc = { NULL, 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    float *values = (float *)malloc((size_t)springls_count(ctx) * sizeof *values);
    springls_status status;
    int i;
    desc.name = name;
    for (i = 0; i < springls_count(ctx); i++) values[i] = value;
    status = springls_add_attribute(ctx, &desc, values, NULL);
    free(values);
    return status;
}

/* After many operations, whose original surfaces join one hierarchy, each springl has the place on them that a restored model finds,
   which builds its hierarchy at once. */
TEST places_on_many_originals_survive_a_restore(void)
{
    const int times = 60;
    springls_context *a = ball_at(19.5f, 9.0f), *restored = fixture_context(SIZE, NULL);
    springls_material *places, *again;
    void *block;
    size_t size;
    int i, triangles = 0, given;
    for (i = 0; i < times; i++) {
        const float angle = 0.7f * (float)i;
        springls_sphere tool = fixture_ball(19.5f + 9.0f * cosf(angle), 19.7f + 9.0f * sinf(angle), 14.0f + 0.2f * (float)i, 1.6f);
        ASSERT_OK(springls_combine_implicit(a, i % 3 ? SPRINGLS_OPERATION_DIFFERENCE : SPRINGLS_OPERATION_UNION,
                                            springls_implicit_sphere, &tool));
        given = springls_material_triangle_count(a);
        ASSERT_GT(given, triangles);
        triangles = given;
    }
    ASSERT_OK(springls_snapshot(a, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    block = malloc(size);
    ASSERT_OK(springls_snapshot(a, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    ASSERT_OK(springls_restore(restored, block, size));
    ASSERT_EQ(triangles, springls_material_triangle_count(restored));
    places = (springls_material *)malloc((size_t)springls_count(a) * sizeof *places);
    again = (springls_material *)malloc((size_t)springls_count(a) * sizeof *again);
    ASSERT_OK(springls_springl_materials(a, places));
    ASSERT_OK(springls_springl_materials(restored, again));
    ASSERT_EQ(0, memcmp(places, again, (size_t)springls_count(a) * sizeof *places));
    free(places);
    free(again);
    free(block);
    springls_destroy(a);
    springls_destroy(restored);
    PASS();
}

/* The same when the model so far is always the second operand. */
TEST originals_of_second_operands(void)
{
    springls_context *model = ball_at(19.5f, 6.0f), *next;
    springls_material *places;
    int i, given;
    for (i = 0; i < 80; i++) {
        const float angle = 0.9f * (float)i;
        next = fixture_sphere(SIZE, NULL, 19.5f + 6.0f * cosf(angle), 19.7f + 6.0f * sinf(angle), 15.0f + 0.1f * (float)i, 2.0f);
        ASSERT_OK(springls_combine(next, SPRINGLS_OPERATION_UNION, model));
        springls_destroy(model);
        model = next;
    }
    given = springls_material_triangle_count(model);
    places = (springls_material *)malloc((size_t)springls_count(model) * sizeof *places);
    ASSERT_OK(springls_springl_materials(model, places));
    for (i = 0; i < springls_count(model); i++) ASSERT(places[i].triangle >= 0 && places[i].triangle < given);
    free(places);
    springls_destroy(model);
    PASS();
}

/* Of what tools have brought, the original surface keeps what springls come from: it does not grow with each edit for good. Each
   springl's place stays on it, with the number that it had. */
TEST originals_that_nothing_comes_from_go(void)
{
    springls_context *a = ball_at(19.5f, 9.0f);
    springls_material *places;
    int i, most = 0;
    for (i = 0; i < 44; i++) {
        const float angle = 1.5707963f * (float)(i / 2 % 4);
        springls_sphere tool = fixture_ball(19.5f + 9.0f * cosf(angle), 19.7f + 9.0f * sinf(angle), 19.4f,
                                            (i % 2 ? 4.5f : 4.0f) + 0.9f * (float)(i / 8)); /* deeper each time around */
        ASSERT_OK(springls_combine_implicit(a, i % 2 ? SPRINGLS_OPERATION_DIFFERENCE : SPRINGLS_OPERATION_UNION,
                                            springls_implicit_sphere, &tool));
        most = most < a->original.count ? a->original.count : most;
    }
    ASSERT_GT(springls_material_triangle_count(a), 2 * 16384);
    ASSERT_LT(5 * most, 3 * springls_material_triangle_count(a));
    ASSERT_LT(a->original.count, springls_material_triangle_count(a) / 2);
    places = (springls_material *)malloc((size_t)springls_count(a) * sizeof *places);
    ASSERT_OK(springls_springl_materials(a, places));
    for (i = 0; i < springls_count(a); i++) {
        const springls_material *at = &places[i];
        d3 place = d3_make(0.0, 0.0, 0.0);
        int t, k;
        for (t = 0; a->original.source[t] / 2 != at->triangle; t++) continue;
        for (k = 0; k < 3; k++) /* a turned triangle has its last two corners exchanged */
            place = d3_mad(place, d3_of(a->original.points[3 * t + (a->original.source[t] % 2 && k ? 3 - k : k)]),
                           (double)at->barycentric[k]);
        ASSERT_LT(d3_distance(place, d3_of(a->model.set.a[i])), 0.05);
    }
    free(places);
    springls_destroy(a);
    PASS();
}

/* Edits i = begin, ..., end - 1: digs in one place of a ball of 9 voxels, and balls that fill it again. */
static springls_status edit_one_place(springls_context *ctx, int begin, int end)
{
    springls_status status = SPRINGLS_OK;
    int i;
    for (i = begin; i < end && status == SPRINGLS_OK; i++) {
        springls_sphere tool = fixture_ball(19.5f + 1.5f * sinf(2.4f * (float)i), 19.7f + 1.5f * cosf(3.1f * (float)i), 28.0f, 3.0f);
        status = springls_combine_implicit(ctx, i % 2 ? SPRINGLS_OPERATION_UNION : SPRINGLS_OPERATION_DIFFERENCE,
                                           springls_implicit_sphere, &tool);
    }
    return status;
}

/* However many edits there have been in one place, the original surface has no more than lies near correspondences, and what waits to be
   dropped. After a restore the same goes. */
TEST edits_in_one_place_keep_their_memory(void)
{
    springls_context *a = ball_at(19.5f, 9.0f), *restored = fixture_context(SIZE, NULL);
    springls_params params = springls_get_params(a);
    void *block = NULL;
    size_t size = 0, early = 0;
    int i;
    params.keep_edges = 0; /* saves time */
    ASSERT_OK(springls_set_params(a, &params));
    for (i = 0; i < 400; i += 50) {
        ASSERT_OK(edit_one_place(a, i, i + 50));
        ASSERT_LT(a->original.count, 8 * springls_count(a) + 16384);
        ASSERT_LTE(a->original.joints, a->original.parts);
        early = i < 250 && early < springls_memory_used(a) ? springls_memory_used(a) : early;
        if (i >= 250) ASSERT_LT(springls_memory_used(a), early + early / 10);
        if (i != 250) continue;
        ASSERT_OK(springls_snapshot(a, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
        block = malloc(size);
        ASSERT_OK(springls_snapshot(a, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    }
    ASSERT_GT(springls_material_triangle_count(a), 4 * 16384);
    ASSERT_OK(springls_restore(restored, block, size));
    ASSERT_OK(edit_one_place(restored, 300, 400));
    ASSERT_EQ(springls_state_hash(a), springls_state_hash(restored));
    ASSERT_EQ(a->original.joints, restored->original.joints);
    ASSERT_EQ(a->original.count, restored->original.count);
    ASSERT_EQ(0, memcmp(a->original.source, restored->original.source, (size_t)a->original.count * sizeof(int)));
    free(block);
    springls_destroy(a);
    springls_destroy(restored);
    PASS();
}

/* Every springl has the colour of the body it was on, and its material triangle is one of that body's. */
TEST springls_have_the_attributes_of_their_body(void)
{
    springls_context *a = ball_at(15.3f, 8.0f), *b = ball_at(23.3f, 7.0f);
    springls_material *places;
    springls_view colour, other;
    int i, first, red = 0, blue = 0;
    ASSERT_OK(paint(a, "colour", 1.0f));
    ASSERT_OK(paint(a, "only here", 5.0f));
    ASSERT_OK(paint(b, "colour", 2.0f));
    ASSERT_OK(paint(b, "only there", 6.0f));
    first = springls_material_triangle_count(a);
    ASSERT_OK(springls_combine(a, SPRINGLS_OPERATION_DIFFERENCE, b));
    ASSERT_EQ(2, springls_attribute_count(a));
    ASSERT_EQ(first + springls_material_triangle_count(b), springls_material_triangle_count(a));
    colour = springls_view_attribute(a, 0);
    other = springls_view_attribute(a, 1);
    ASSERT_EQ(springls_count(a), colour.count);
    places = (springls_material *)malloc((size_t)springls_count(a) * sizeof *places);
    ASSERT_OK(springls_springl_materials(a, places));
    for (i = 0; i < colour.count; i++) {
        d3 p = d3_of(fixture_particle(a, i));
        double of_a = fabs(d3_distance(p, d3_make(15.3, 19.7, 19.4)) - 8.0),
            of_b = fabs(d3_distance(p, d3_make(23.3, 19.7, 19.4)) - 7.0);
        float expected = of_a < of_b ? 1.0f : 2.0f;
        if (fabs(of_a - of_b) < 0.5) continue; /* at the seam */
        ASSERT_EQ(expected, colour.data[i]);
        if (springls_generations(a)[i] == 0) ASSERT_EQ(of_a < of_b ? 5.0f : 0.0f, other.data[i]);
        ASSERT_EQ(of_a < of_b, places[i].triangle < first);
        red += expected == 1.0f;
        blue += expected == 2.0f;
    }
    ASSERT_GT(red, 300);
    ASSERT_GT(blue, 100);
    free(places);
    springls_destroy(a);
    springls_destroy(b);
    PASS();
}

/* An edit leaves as they are the bricks that an earlier one elsewhere has left awake: it costs what it cuts. The next step finds both. */
TEST edits_complete_what_they_change(void)
{
    enum { POINTS = 500 };
    springls_context *a = ball_at(19.5f, 15.0f);
    const springls_step_desc rest = { 0 };
    springls_sphere left = fixture_ball(4.5f, 19.7f, 19.4f, 3.0f), right = fixture_ball(34.5f, 19.7f, 19.4f, 3.0f);
    float points[3 * POINTS], before[POINTS], after[POINTS];
    uint32_t seed = 7u;
    int i, k, steps;
    ASSERT_OK(springls_settle(a, 60));
    for (i = 0; i < POINTS; i++)
        for (k = 0; k < 3; k++) {
            seed = seed * 1664525u + 1013904223u;
            points[3 * i + k] = left.center[k] + 8.0f * ((float)(seed >> 8) / 16777216.0f - 0.5f);
        }
    ASSERT_OK(springls_combine_implicit(a, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &left));
    ASSERT(!springls_at_rest(a));
    ASSERT_OK(springls_sample_distance(a, points, POINTS, before));
    ASSERT_OK(springls_combine_implicit(a, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &right));
    ASSERT_OK(springls_sample_distance(a, points, POINTS, after));
    ASSERT_EQ(0, memcmp(before, after, sizeof before));
    ASSERT_OK(springls_step(a, &rest));
    ASSERT_OK(springls_sample_distance(a, points, POINTS, after));
    ASSERT(memcmp(before, after, sizeof before) != 0); /* both cuts were awake still */
    for (steps = 0; steps < 60 && !springls_at_rest(a); steps++) ASSERT_OK(springls_step(a, &rest));
    CHECK_CALL(check(a, ball(15.0) - 2.0 * bite(15.0, 3.0), 0.05, 1, 2));
    springls_destroy(a);
    PASS();
}

/* The result moves on as any model does. */
TEST the_result_can_move_on(void)
{
    springls_context *a = ball_at(13.3f, 7.0f), *b = ball_at(20.3f, 7.0f);
    float wind[3] = { 0.7f, 0.1f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    ASSERT_OK(paint(a, "colour", 1.0f));
    ASSERT_OK(springls_combine(a, SPRINGLS_OPERATION_UNION, b));
    ASSERT_OK(springls_run(a, &step, 8));
    CHECK_CALL(check(a, 2.0 * ball(7.0) - lens(7.0, 7.0), 0.05, 1, 2));
    ASSERT_EQ(springls_count(a), springls_view_attribute(a, 0).count);
    springls_destroy(a);
    springls_destroy(b);
    PASS();
}

TEST offsets_have_the_exact_volume(void)
{
    const double s = 10.6, d = 4.0;
    springls_box box = box_at(19.7f, 19.8f, 5.3f);
    springls_context *a = ball_at(19.3f, 8.0f);
    springls_measures m;
    ASSERT_OK(paint(a, "colour", 3.0f));
    ASSERT_OK(springls_offset(a, 3.5f));
    CHECK_CALL(check(a, ball(11.5), 0.05, 1, 2));
    ASSERT_OK(springls_offset(a, -5.0f));
    CHECK_CALL(check(a, ball(6.5), 0.05, 1, 2));
    ASSERT_EQ(3.0f, springls_view_attribute(a, 0).data[0]);
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_offset(a, -7.5f));
    ASSERT_EQ(0, springls_count(a));
    ASSERT_OK(springls_measure(a, &m));
    ASSERT_EQ(0, m.components);
    ASSERT_OK(springls_set_implicit(a, springls_implicit_box, &box)); /* Steiner's formula: edges and corners become round */
    ASSERT_OK(springls_offset(a, (float)d));
    CHECK_CALL(check(a, s * s * s + 6.0 * s * s * d + 3.0 * fixture_pi * d * d * s + ball(d), 0.1, 1, 2));
    ASSERT_OK(springls_set_implicit(a, springls_implicit_box, &box));
    ASSERT_OK(springls_offset(a, -2.0f));
    CHECK_CALL(check(a, pow(s - 4.0, 3.0), 0.1, 1, 2));
    springls_destroy(a);
    PASS();
}

/* Two balls three voxels apart meet when they grow by 1.8, and part again. */
TEST offsets_change_topology(void)
{
    springls_context *a = ball_at(11.3f, 6.0f);
    springls_sphere second = fixture_ball(26.3f, 19.7f, 19.4f, 6.0f);
    springls_measures m;
    ASSERT_OK(springls_combine_implicit(a, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &second));
    CHECK_CALL(check(a, 2.0 * ball(6.0), 0.05, 2, 4));
    ASSERT_OK(springls_offset(a, 1.8f));
    CHECK_CALL(check(a, 2.0 * ball(7.8) - lens(7.8, 15.0), 0.05, 1, 2));
    ASSERT_OK(springls_offset(a, -3.2f));
    ASSERT_OK(springls_measure(a, &m));
    ASSERT_EQ(2, m.components);
    ASSERT_EQ(4, m.euler);
    ASSERT_GT(m.volume, 2.0 * ball(4.4));
    ASSERT_LT(m.volume, 2.0 * ball(5.0));
    springls_destroy(a);
    PASS();
}

/* A box loses its edges; with its volume kept it is on its way to the ball of that volume. */
TEST smoothing_rounds_a_box(void)
{
    springls_box box = box_at(19.7f, 19.8f, 6.3f);
    springls_context *a = fixture_context(SIZE, NULL);
    springls_measures before, after;
    springls_params params;
    ASSERT_OK(springls_set_implicit(a, springls_implicit_box, &box));
    ASSERT_OK(springls_measure(a, &before));
    ASSERT_OK(springls_smooth(a, 4.0f, true));
    ASSERT_OK(springls_measure(a, &after));
    ASSERT_IN_RANGE(before.volume, after.volume, 0.001 * before.volume);
    ASSERT_LT(after.area, 0.95 * before.area);
    ASSERT_EQ(2, after.euler);
    params = springls_get_params(a);
    ASSERT_EQ(1, params.keep_edges);
    ASSERT_EQ(0, params.volume_lock);
    ASSERT_EQ(0.0, springls_time(a));
    ASSERT_OK(springls_smooth(a, 4.0f, false));
    ASSERT_OK(springls_measure(a, &before));
    ASSERT_LT(before.volume, 0.9 * after.volume);
    springls_destroy(a);
    PASS();
}

/* A ball of radius R that is smoothed by a length L has the radius sqrt(R^2 - L^2), after few steps. */
TEST smoothing_has_its_length(float radius, float length, double tolerance)
{
    d3 center = d3_make(19.7, 19.8, 20.1);
    springls_context *a = fixture_sphere(40, NULL, 19.7f, 19.8f, 20.1f, radius);
    double sum = 0.0;
    int i;
    ASSERT_OK(springls_smooth(a, length, false));
    for (i = 0; i < springls_count(a); i++) sum += d3_distance(d3_of(fixture_particle(a, i)), center);
    ASSERT_IN_RANGE(sqrt((double)(radius * radius - length * length)), sum / springls_count(a), tolerance);
    ASSERT_GT(50, springls_get_stats(a).steps);
    springls_destroy(a);
    PASS();
}

/* Two balls apart, with the radii 9 and 3. */
static void two_balls(void *user, const float *points, int count, float *out)
{
    (void)user;
    for (; count-- > 0; points += 3) {
        double x = (double)points[0], y = (double)points[1] - 19.6, z = (double)points[2] - 19.3;
        *out++ = (float)fmin(sqrt((x - 14.2) * (x - 14.2) + y * y + z * z) - 9.0,
                             sqrt((x - 32.1) * (x - 32.1) + y * y + z * z) - 3.0);
    }
}

/* What is smaller than the length vanishes, with its springls; what is larger stays. Nothing is left in the end. */
TEST small_features_vanish(void)
{
    springls_context *a = fixture_context(SIZE, NULL);
    springls_measures m;
    int i;
    ASSERT_OK(springls_set_implicit(a, two_balls, NULL));
    ASSERT_OK(springls_smooth(a, 4.0f, false));
    ASSERT_OK(springls_measure(a, &m));
    ASSERT_EQ(1, m.components);
    for (i = 0; i < springls_count(a); i++) ASSERT_LT(fixture_particle(a, i).x, 24.0f);
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_smooth(a, 10.0f, false));
    springls_destroy(a);
    PASS();
}

/* A long length with the volume kept makes a ball of a box, and takes no more steps than a few hundred. */
TEST long_lengths_take_few_steps(void)
{
    springls_box box = box_at(19.7f, 19.8f, 6.3f);
    springls_context *a = fixture_context(SIZE, NULL);
    springls_measures before, after;
    ASSERT_OK(springls_set_implicit(a, springls_implicit_box, &box));
    ASSERT_OK(springls_measure(a, &before));
    ASSERT_OK(springls_smooth(a, 300.0f, true));
    ASSERT_OK(springls_measure(a, &after));
    ASSERT_IN_RANGE(before.volume, after.volume, 0.001 * before.volume);
    ASSERT_IN_RANGE(pow(36.0 * fixture_pi * after.volume * after.volume, 1.0 / 3.0), after.area, 0.004 * after.area);
    ASSERT_GT(200, springls_get_stats(a).steps);
    springls_destroy(a);
    PASS();
}

/* A cube of 12 triangles becomes a cube of springls about as large as a voxel, with what it carries, and its edges stay. */
TEST remesh_makes_springls_of_a_voxel(void)
{
    static const float corner[24] = { 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1 };
    static const int triangles[36] = { 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2,
                                       1, 3, 7, 1, 7, 5 };
    springls_attribute_desc desc = { "face", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    springls_params params = springls_default_params();
    springls_context *a;
    springls_measures before, after;
    float positions[24], face[12];
    springls_material *places;
    springls_view v;
    int i, wrong = 0;
    params.split_input = 0;
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET; /* remesh leaves phi as it is */
    a = fixture_context(SIZE, &params);
    for (i = 0; i < 24; i++) positions[i] = 12.3f + 14.0f * corner[i];
    for (i = 0; i < 12; i++) face[i] = (float)(i / 2);
    ASSERT_OK(springls_set_mesh(a, positions, 8, 0, triangles, 12, NULL));
    ASSERT_OK(springls_add_attribute(a, &desc, face, NULL));
    ASSERT_OK(springls_measure(a, &before));
    ASSERT_OK(springls_remesh(a));
    ASSERT_OK(springls_measure(a, &after));
    ASSERT_EQ(before.volume, after.volume);
    CHECK_CALL(check(a, 14.0 * 14.0 * 14.0, 0.05, 1, 2));
    ASSERT_GT(springls_count(a), 600);
    places = (springls_material *)malloc((size_t)springls_count(a) * sizeof *places);
    ASSERT_OK(springls_springl_materials(a, places));
    v = springls_view_attribute(a, 0);
    for (i = 0; i < springls_count(a); i++) {
        fixture_springl s = fixture_get(a, i);
        ASSERT_LT(fixture_area(&s), 4.0);
        wrong += v.data[i] != (float)(places[i].triangle / 2);
    }
    ASSERT_LT(wrong, springls_count(a) / 50); /* at the edges the nearest triangle is anybody's guess */
    free(places);
    springls_destroy(a);
    PASS();
}

/* An octahedron of 8 triangles, or of these divided `depth` times and pushed out onto a ball: remesh moves no surface. */
TEST remesh_keeps_the_volume(int depth)
{
    enum { MOST = 8 << 10 };
    static const int octant[8][3] = { { 1, 1, 1 }, { -1, 1, 1 }, { 1, -1, 1 }, { 1, 1, -1 }, { -1, -1, 1 }, { -1, 1, -1 },
                                      { 1, -1, -1 }, { -1, -1, -1 } };
    static float positions[9 * MOST];
    static int index[3 * MOST];
    springls_context *a = fixture_of_zero_level(fixture_context(SIZE, NULL));
    springls_measures before, after;
    int n = 1 << depth, count = 0, o, i, j, k, up, m;
    for (o = 0; o < 8; o++)
        for (i = 0; i < n; i++)
            for (j = 0; j < n - i; j++)
                for (up = 0; up < (j < n - i - 1 ? 2 : 1); up++) {
                    bool turned = octant[o][0] * octant[o][1] * octant[o][2] < 0;
                    for (m = 0; m < 3; m++) {
                        int c = turned && m ? 3 - m : m;
                        int u = i + (up ? c != 2 : c == 1), v = j + (up ? c != 0 : c == 2);
                        double at[3], length = 0.0;
                        at[0] = u; at[1] = v; at[2] = n - u - v;
                        for (k = 0; k < 3; k++) length += at[k] * at[k];
                        length = depth ? sqrt(length) : n;
                        for (k = 0; k < 3; k++)
                            positions[9 * count + 3 * m + k] = (float)(19.6 + 12.0 * octant[o][k] * at[k] / length);
                    }
                    count++;
                }
    for (i = 0; i < 3 * count; i++) index[i] = i;
    ASSERT_OK(springls_set_mesh(a, positions, 3 * count, 0, index, count, NULL));
    ASSERT_OK(springls_measure(a, &before));
    ASSERT_OK(springls_remesh(a));
    ASSERT_OK(springls_measure(a, &after));
    ASSERT_IN_RANGE(before.volume, after.volume, 0.0002 * before.volume);
    ASSERT_EQ(1, after.components);
    ASSERT_EQ(2, after.euler);
    springls_destroy(a);
    PASS();
}

/* Pushes one side of a model's springls in by half a voxel, without a step: phi has yet to follow. */
static void push_side(springls_context *ctx)
{
    const int count = springls_count(ctx);
    float *q = (float *)malloc((size_t)count * 9 * sizeof *q);
    int i, k;
    for (i = 0; q && i < count; i++) {
        const fixture_springl s = fixture_get(ctx, i);
        for (k = 0; k < 3; k++) {
            q[9 * i + 3 * k] = s.q[k].x + (s.p.x > 19.0f ? -0.5f : 0.0f);
            q[9 * i + 3 * k + 1] = s.q[k].y;
            q[9 * i + 3 * k + 2] = s.q[k].z;
        }
    }
    if (q) springls_write(ctx, 0, count, q, NULL);
    free(q);
}

static springls_status not_a_number(springls_context *ctx)
{
    springls_sphere strange = fixture_ball(NAN, 19.0f, 19.0f, 3.0f);
    return springls_combine_implicit(ctx, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &strange);
}

static springls_status nowhere(springls_context *ctx)
{
    springls_sphere gone = fixture_ball(500.0f, 0.0f, 0.0f, 3.0f);
    return springls_combine_implicit(ctx, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &gone);
}

static springls_status no_operation(springls_context *ctx)
{
    springls_sphere ball = fixture_ball(19.0f, 19.0f, 19.0f, 3.0f);
    return springls_combine_implicit(ctx, (springls_operation)3, springls_implicit_sphere, &ball);
}

static springls_status endless_advect(springls_context *ctx)
{
    springls_forces forces;
    memset(&forces, 0, sizeof forces);
    return springls_advect(ctx, &forces, 0.0f, NAN);
}

/* Springls that the caller has moved wait for the next step, in a second operand and in a model whose call is refused. */
TEST springls_that_wait(void)
{
    static springls_status (*const refused[])(springls_context *) = { not_a_number, nowhere, no_operation, endless_advect };
    springls_context *a = ball_at(24.0f, 6.0f), *b = ball_at(17.0f, 6.0f), *twin = ball_at(17.0f, 6.0f);
    springls_measures early, late;
    uint64_t hash;
    size_t i;
    push_side(b);
    push_side(twin);
    hash = springls_state_hash(b);
    for (i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        ASSERT(refused[i](b) != SPRINGLS_OK);
        ASSERT_EQ(hash, springls_state_hash(b));
    }
    ASSERT_OK(springls_combine(a, SPRINGLS_OPERATION_UNION, b));
    ASSERT_EQ(hash, springls_state_hash(b));
    ASSERT_OK(springls_measure(a, &early));
    springls_destroy(a);
    a = ball_at(24.0f, 6.0f);
    ASSERT_OK(springls_step(twin, &(springls_step_desc){ 0 })); /* follows before */
    ASSERT_OK(springls_combine(a, SPRINGLS_OPERATION_UNION, twin));
    ASSERT_OK(springls_measure(a, &late));
    ASSERT_IN_RANGE(late.volume, early.volume, 1e-9 * late.volume);
    springls_destroy(a);
    springls_destroy(b);
    springls_destroy(twin);
    PASS();
}

TEST wrong_calls_are_refused(void)
{
    springls_context *a = ball_at(19.0f, 6.0f), *b = ball_at(19.0f, 6.0f),
        *small = fixture_sphere(32, NULL, 15.0f, 15.0f, 15.0f, 5.0f);
    springls_context *wide, *empty = fixture_context(SIZE, NULL);
    springls_params params = springls_default_params();
    springls_sphere gone = fixture_ball(500.0f, 0.0f, 0.0f, 3.0f);
    uint64_t hash = springls_state_hash(a);
    params.band_half_width = 4.0f;
    wide = fixture_sphere(SIZE, &params, 19.0f, 19.0f, 19.0f, 6.0f);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine(NULL, SPRINGLS_OPERATION_UNION, a));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine(a, SPRINGLS_OPERATION_UNION, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine(a, SPRINGLS_OPERATION_UNION, a));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine(a, (springls_operation)3, b));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine(a, SPRINGLS_OPERATION_UNION, small));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine(a, SPRINGLS_OPERATION_UNION, wide));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_combine(a, SPRINGLS_OPERATION_UNION, empty));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_combine(empty, SPRINGLS_OPERATION_UNION, a));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_implicit(a, SPRINGLS_OPERATION_UNION, NULL, NULL));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_combine_implicit(a, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &gone));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_offset(a, NAN));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_offset(NULL, 1.0f));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_offset(empty, 1.0f));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_smooth(a, -1.0f, false));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_smooth(a, INFINITY, false));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_smooth(empty, 2.0f, false));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_remesh(empty));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_remesh(NULL));
    ASSERT_OK(springls_offset(a, 0.0f));
    ASSERT_EQ(hash, springls_state_hash(a));
    springls_destroy(a);
    springls_destroy(b);
    springls_destroy(small);
    springls_destroy(wide);
    springls_destroy(empty);
    PASS();
}

/* ---- combinations in pieces ---- */

/* A box with a colour that has come some steps, and a tool at its corner. */
static springls_status make_pair(springls_context *pair[2])
{
    const springls_box body = box_at(15.2f, 19.7f, 6.3f);
    const springls_step_desc rest = springls_default_step_desc();
    pair[0] = fixture_context(SIZE, NULL);
    pair[1] = ball_at(21.0f, 5.0f);
    SPRINGLS__TRY(springls_set_implicit(pair[0], springls_implicit_box, (void *)(uintptr_t)&body));
    SPRINGLS__TRY(paint(pair[0], "colour", 1.0f));
    SPRINGLS__TRY(paint(pair[1], "colour", 2.0f));
    return springls_step(pair[0], &rest);
}

static void free_pair(springls_context *pair[2])
{
    springls_destroy(pair[0]);
    springls_destroy(pair[1]);
}

/* Runs at most `most` pieces of a combination. */
static springls_status run_pieces(springls_context *ctx, double seconds, int most, int *pieces, bool *done)
{
    springls_status status = SPRINGLS_OK;
    for (*done = false, *pieces = 0; status == SPRINGLS_OK && !*done && *pieces < most; ++*pieces)
        status = springls_combine_continue(ctx, seconds, done);
    return status;
}

/* Two combinations at once, and in pieces between which somebody looks. */
TEST the_same_bits_in_pieces(int operation, double seconds)
{
    springls_context *whole[2], *cut[2];
    springls_sphere hole = fixture_ball(12.0f, 13.4f, 19.0f, 3.1f);
    const springls_step_desc rest = springls_default_step_desc();
    springls_hit hit;
    float point[3] = { 20.0f, 19.0f, 18.0f };
    int pieces, all = 0, k;
    bool done = false;
    ASSERT_OK(make_pair(whole));
    ASSERT_OK(make_pair(cut));
    ASSERT_OK(springls_combine(whole[0], (springls_operation)operation, whole[1]));
    ASSERT_OK(springls_combine_begin(cut[0], (springls_operation)operation, cut[1]));
    while (!done) {
        ASSERT(!springls_step_in_progress(cut[0]));
        ASSERT(springls_combine_in_progress(cut[0]));
        ASSERT_OK(run_pieces(cut[0], seconds, 7, &pieces, &done));
        ASSERT_EQ(!done, springls_combine_in_progress(cut[0]));
        ASSERT_OK(springls_closest(cut[0], SPRINGLS_SURFACE_SOUP, point, 1, &hit));
        ASSERT_OK(springls_closest(cut[1], SPRINGLS_SURFACE_WATERTIGHT, point, 1, &hit)); /* the other may be read */
        all += pieces;
    }
    if (seconds == 0.0) ASSERT_GT(all, 100);
    if (seconds > 1e9) ASSERT_EQ(1, all);
    ASSERT_EQ(springls_state_hash(whole[0]), springls_state_hash(cut[0]));
    ASSERT_OK(springls_combine_implicit(whole[0], SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &hole));
    ASSERT_OK(springls_combine_implicit_begin(cut[0], SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &hole));
    for (done = false; !done;) ASSERT_OK(run_pieces(cut[0], seconds, 100, &pieces, &done));
    for (k = 0; k < 2; k++) {
        ASSERT_EQ(springls_state_hash(whole[0]), springls_state_hash(cut[0]));
        ASSERT_EQ(springls_material_triangle_count(whole[0]), springls_material_triangle_count(cut[0]));
        ASSERT_EQ(0, memcmp(springls_view_attribute(whole[0], 0).data, springls_view_attribute(cut[0], 0).data,
                            (size_t)springls_count(cut[0]) * sizeof(float)));
        ASSERT_OK(springls_step(whole[0], &rest));
        ASSERT_OK(springls_step(cut[0], &rest));
    }
    free_pair(whole);
    free_pair(cut);
    PASS();
}

/* A ball whose mesh has many more triangles than it has springls. */
static springls_context *fine_ball(float x, float radius)
{
    enum { ROWS = 48, COLUMNS = 96, VERTICES = 2 + (ROWS - 1) * COLUMNS, TRIANGLES = 2 * COLUMNS * (ROWS - 1) };
    static float positions[3 * VERTICES];
    static int corners[3 * TRIANGLES];
    springls_context *ctx = fixture_context(SIZE, NULL);
    int v, row, column, count = 0;
    for (v = 0; v < VERTICES; v++) { /* the poles are the last two */
        const double up = v == VERTICES - 2 ? 0.0 : v == VERTICES - 1 ? fixture_pi : fixture_pi * (v / COLUMNS + 1) / ROWS;
        const double round = 2.0 * fixture_pi * (v % COLUMNS) / COLUMNS;
        positions[3 * v] = x + radius * (float)(sin(up) * cos(round));
        positions[3 * v + 1] = 19.7f + radius * (float)(sin(up) * sin(round));
        positions[3 * v + 2] = 19.4f + radius * (float)cos(up);
    }
    for (row = -1; row < ROWS - 1; row++)
        for (column = 0; column < COLUMNS; column++) {
            const int next = (column + 1) % COLUMNS, north = VERTICES - 2, south = VERTICES - 1;
            const int a = row < 0 ? north : row * COLUMNS + column, b = row < 0 ? north : row * COLUMNS + next;
            const int c = row == ROWS - 2 ? south : (row + 1) * COLUMNS + column, d = row == ROWS - 2 ? south : (row + 1) * COLUMNS + next;
            if (c != d) { corners[3 * count] = a; corners[3 * count + 1] = c; corners[3 * count++ + 2] = d; }
            if (a != b) { corners[3 * count] = a; corners[3 * count + 1] = d; corners[3 * count++ + 2] = b; }
        }
    if (springls_set_mesh(ctx, positions, VERTICES, 0, corners, count, NULL) == SPRINGLS_OK) return ctx;
    springls_destroy(ctx);
    return NULL;
}

/* Returns the original triangle closest to a point. */
static int closest_original(const springls_context *ctx, int i)
{
    const springls__v3 x = springls__v3_make((float)(i % 7) * 6.0f, (float)(i % 5) * 9.0f, (float)i);
    return springls__surface_closest(&ctx->original, x, FLT_MAX).triangle;
}

/* Hierarchies of many nodes are copied in pieces, between which places on the original surface are found as before: where they are joined
   (drops = 0), and where the original surface is made anew without what is unused. */
TEST hierarchies_are_copied_in_pieces(int drops)
{
    enum { POINTS = 40, LEAST_PIECES = 3 };
    springls_context *ctx = ball_at(15.3f, 8.0f), *tool = fine_ball(23.3f, 7.0f), *whole = ball_at(15.3f, 8.0f);
    int before[POINTS], placed = 0, pieces = 0, k, i;
    bool done = false, stop;
    ASSERT(tool);
    for (k = 0; k < drops; k++) {
        ASSERT_OK(springls_combine(ctx, SPRINGLS_OPERATION_UNION, tool));
        ASSERT_OK(springls_combine(whole, SPRINGLS_OPERATION_UNION, tool));
    }
    for (i = 0; i < POINTS; i++) before[i] = closest_original(ctx, i);
    ASSERT_OK(springls_combine(whole, SPRINGLS_OPERATION_DIFFERENCE, tool));
    for (stop = true;; stop = false) { /* the first is given up in the middle, and leaves no trace */
        ASSERT_OK(springls_combine_begin(ctx, SPRINGLS_OPERATION_DIFFERENCE, tool));
        for (done = false, pieces = placed = 0; !done && !(stop && pieces == 2);) {
            const springls__both_originals *both = &ctx->step.combination->originals;
            if (both->copy[1].to && both->copying < 2) {
                const int now = both->copy[both->copying].placed;
                ASSERT_EQ(drops != 0, both->drops);
                ASSERT_LTE(now - placed, SPRINGLS__BVH_LEAF * 4096 + ctx->original.count * !pieces);
                placed = now;
                pieces++;
                for (i = 0; i < POINTS; i++) ASSERT_EQ(before[i], closest_original(ctx, i));
            }
            ASSERT_OK(springls_combine_continue(ctx, 0.0, &done));
        }
        if (!stop) break;
        ctx->step.combination->other->model_version++; /* of the tool, or of a copy */
        ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_continue(ctx, 0.0, &done));
        for (i = 0; i < POINTS; i++) ASSERT_EQ(before[i], closest_original(ctx, i));
    }
    ASSERT_GTE(pieces, LEAST_PIECES);
    ASSERT_EQ(springls_state_hash(whole), springls_state_hash(ctx));
    for (i = 0; i < POINTS; i++) ASSERT_EQ(closest_original(whole, i), closest_original(ctx, i));
    springls_destroy(ctx);
    springls_destroy(tool);
    springls_destroy(whole);
    PASS();
}

/* A model is as one that has never been combined: also in later bits. */
static greatest_test_res is_untouched(springls_context *ctx, springls_context *twin)
{
    const springls_step_desc rest = springls_default_step_desc();
    springls_sphere hole = fixture_ball(12.0f, 13.4f, 19.0f, 3.1f);
    size_t size[2];
    void *block[2];
    int k, i;
    for (k = 0; k < 2; k++) {
        for (i = 0; i < 2; i++) {
            ASSERT_OK(springls_snapshot(i ? twin : ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size[i]));
            block[i] = malloc(size[i]);
            ASSERT_OK(springls_snapshot(i ? twin : ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block[i], size[i], &size[i]));
        }
        ASSERT_EQ(size[1], size[0]);
        ASSERT_EQ(0, memcmp(block[0], block[1], size[0]));
        free(block[0]);
        free(block[1]);
        if (k) break;
        for (i = 0; i < 2; i++) {
            ASSERT_OK(springls_combine_implicit(i ? twin : ctx, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &hole));
            ASSERT_OK(springls_step(i ? twin : ctx, &rest));
        }
    }
    PASS();
}

enum { BY_CHANGED_TOOL, BY_FRAME, BY_STEP, BY_SNAPSHOT, BY_RESET, BY_DESTROY, STOPS };

/* What a combination in progress meets, after so many pieces. */
TEST stopped_in_the_middle(int how, int most)
{
    const springls_step_desc rest = springls_default_step_desc();
    springls_context *cut[2], *twin[2];
    size_t size;
    void *frame;
    int pieces;
    bool done;
    ASSERT_OK(make_pair(cut));
    ASSERT_OK(make_pair(twin));
    ASSERT_OK(springls_snapshot(cut[0], SPRINGLS_SNAPSHOT_KIND_FRAME, NULL, 0, &size));
    frame = malloc(size);
    ASSERT_OK(springls_snapshot(cut[0], SPRINGLS_SNAPSHOT_KIND_FRAME, frame, size, &size));
    ASSERT_OK(springls_combine_begin(cut[0], SPRINGLS_OPERATION_DIFFERENCE, cut[1]));
    ASSERT_OK(run_pieces(cut[0], 0.0, most, &pieces, &done));
    ASSERT(!done);
    switch (how) {
    case BY_CHANGED_TOOL:
        ASSERT_OK(springls_step(cut[1], &rest));
        ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_continue(cut[0], 0.0, &done));
        ASSERT(done);
        ASSERT(strstr(springls_last_error(cut[0]), "has changed"));
        ASSERT_OK(springls_combine_continue(cut[0], 0.0, &done)); /* nothing to do */
        CHECK_CALL(is_untouched(cut[0], twin[0]));
        break;
    case BY_FRAME:
        ASSERT_OK(springls_restore(cut[0], frame, size));
        ASSERT_OK(springls_restore(twin[0], frame, size));
        CHECK_CALL(is_untouched(cut[0], twin[0]));
        break;
    case BY_STEP: /* completes it */
        ASSERT_OK(springls_combine(twin[0], SPRINGLS_OPERATION_DIFFERENCE, twin[1]));
        ASSERT_OK(springls_step(twin[0], &rest));
        ASSERT_OK(springls_step(cut[0], &rest));
        ASSERT_EQ(springls_state_hash(twin[0]), springls_state_hash(cut[0]));
        break;
    case BY_SNAPSHOT:
        ASSERT_OK(springls_combine(twin[0], SPRINGLS_OPERATION_DIFFERENCE, twin[1]));
        CHECK_CALL(is_untouched(cut[0], twin[0]));
        break;
    case BY_RESET:
        ASSERT_OK(springls_reset(cut[0]));
        ASSERT_EQ(0, springls_count(cut[0]));
        ASSERT_OK(springls_combine_continue(cut[0], 0.0, &done));
        ASSERT(done);
        break;
    default: break; /* the fixtures look for leaks */
    }
    free(frame);
    free_pair(cut);
    free_pair(twin);
    PASS();
}

/* The attributes of the other model may not change either: of some pieces springls would have those of before. */
TEST attributes_of_the_tool_stay(int change)
{
    static const springls_attribute_desc more = { "more", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    springls_context *cut[2], *twin[2];
    bool done;
    int pieces;
    ASSERT_OK(make_pair(cut));
    ASSERT_OK(make_pair(twin));
    ASSERT_OK(springls_combine_begin(cut[0], SPRINGLS_OPERATION_DIFFERENCE, cut[1]));
    ASSERT_OK(run_pieces(cut[0], 0.0, 4, &pieces, &done));
    ASSERT(!done);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_attribute(cut[1], 7, NULL)); /* changes nothing */
    ASSERT_OK(run_pieces(cut[0], 0.0, 1, &pieces, &done));
    ASSERT_OK(change == 0 ? springls_set_attribute(cut[1], 0, NULL) : change == 1 ? springls_add_attribute(cut[1], &more, NULL, NULL)
                                                                                 : springls_remove_attribute(cut[1], 0));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_continue(cut[0], 0.0, &done));
    ASSERT(done);
    ASSERT(strstr(springls_last_error(cut[0]), "has changed"));
    CHECK_CALL(is_untouched(cut[0], twin[0]));
    free_pair(cut);
    free_pair(twin);
    PASS();
}

/* A combination of which nothing is left ends with an empty model; wrong arguments leave one in progress. */
TEST pieces_end(void)
{
    springls_context *pair[2], *inner = ball_at(15.2f, 3.0f), *outer = ball_at(15.2f, 12.0f);
    bool done = true;
    int pieces;
    ASSERT_OK(make_pair(pair));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_begin(NULL, SPRINGLS_OPERATION_UNION, inner));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_begin(pair[0], SPRINGLS_OPERATION_UNION, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT,
                  springls_combine_implicit_begin(NULL, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_implicit_begin(pair[0], SPRINGLS_OPERATION_UNION, NULL, NULL));
    ASSERT_OK(springls_combine_begin(inner, SPRINGLS_OPERATION_DIFFERENCE, outer));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_continue(NULL, 0.0, &done));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_continue(inner, 0.0, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_continue(inner, (double)NAN, &done));
    ASSERT(!done); /* it goes on */
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, run_pieces(inner, -1.0, 1 << 20, &pieces, &done));
    ASSERT(done);
    ASSERT_EQ(0, springls_count(inner));
    ASSERT_OK(springls_combine_continue(pair[0], 0.0, &done)); /* nothing to do */
    ASSERT(done);
    ASSERT(!springls_combine_in_progress(pair[0]) && !springls_combine_in_progress(NULL));
    springls_destroy(inner);
    springls_destroy(outer);
    free_pair(pair);
    PASS();
}

/* One allocation fails: the model is empty, or as good as before or after; after a combination as before to the bit. Nothing is lost, and
   the context serves again. */
static greatest_test_res starve(int call, int fail_at, int *failed)
{
    springls_sphere one = fixture_ball(6.5f, 8.5f, 8.5f, 3.2f), two = fixture_ball(9.3f, 8.5f, 8.5f, 3.2f);
    springls_desc desc = fixture_desc(18, NULL);
    springls_context *ctx;
    springls_status status;
    fixture_heap heap;
    uint64_t before;
    desc.allocator = fixture_allocator(&heap);
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &one));
    ASSERT_OK(paint(ctx, "colour", 1.0f));
    before = springls_state_hash(ctx);
    heap.fail_at = heap.calls + fail_at;
    status = call == 0 ? springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &two)
           : call == 1 ? springls_offset(ctx, 2.0f) : call == 2 ? springls_smooth(ctx, 1.0f, false) : springls_remesh(ctx);
    *failed = heap.calls > heap.fail_at;
    if (*failed)
        ASSERT(status == SPRINGLS_OUT_OF_MEMORY || (desc.backend && status == SPRINGLS_DEVICE_FAILED)); /* goes on without it */
    else ASSERT_OK(status);
    if (springls_count(ctx) > 0) ASSERT_EQ(springls_count(ctx), springls_view_attribute(ctx, 0).count);
    heap.fail_at = -1;
    ASSERT_EQ(heap.bytes, springls_memory_used(ctx));
    if (call == 0 && status != SPRINGLS_OK) ASSERT_EQ(before, springls_state_hash(ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &one));
    ASSERT_GT(springls_count(ctx), 50);
    springls_destroy(ctx);
    ASSERT_EQ(0, heap.blocks);
    ASSERT_EQ(0, heap.wrong_sizes);
    PASS();
}

TEST every_allocation_may_fail(int call)
{
    int fail_at, failed = 1;
    for (fail_at = 0; failed; fail_at++) CHECK_CALL(starve(call, fail_at, &failed));
    ASSERT_GT(fail_at, call < 2 ? 10 : 2);
    PASS();
}

/* ---- combinations that drop unused triangles ---- */

/* A small ball with a hole and a knob, so that its original surface has three tools, about to drop those without use; and one that has
   tools itself. */
static springls_status make_dropping(const springls_allocator *allocator, springls_context *pair[2])
{
    static const float place[2][3] = { { 6.5f, 9.5f, 8.0f }, { 10.5f, 8.5f, 11.5f } };
    springls_status status = SPRINGLS_OK;
    int k, i;
    for (k = 0; k < 2 && status == SPRINGLS_OK; k++) {
        springls_desc desc = fixture_desc(18, NULL);
        springls_sphere tool = fixture_ball(place[k][0], 8.5f, 8.5f, 3.2f);
        if (allocator && k == 0) desc.allocator = *allocator;
        status = springls_create(&desc, &pair[k]);
        if (status == SPRINGLS_OK) status = springls_set_implicit(pair[k], springls_implicit_sphere, &tool);
        for (i = 1; i < 3 && status == SPRINGLS_OK; i++) {
            tool = fixture_ball(place[k][i], 8.5f, 8.5f, 2.0f);
            status = springls_combine_implicit(pair[k], i == 1 ? SPRINGLS_OPERATION_DIFFERENCE : SPRINGLS_OPERATION_UNION,
                                               springls_implicit_sphere, &tool);
        }
    }
    if (status == SPRINGLS_OK) pair[0]->original.given = SPRINGLS__ORIGINALS_PERIOD - 1; /* as if others had been dropped before */
    return status;
}

/* The original surface of a model, to be compared later. */
typedef struct originals { springls__surface surface; int *source, *joint; springls__v3 *points; uint64_t hash; } originals;

static originals originals_of(const springls_context *ctx)
{
    originals o;
    o.surface = ctx->original;
    o.hash = springls_state_hash(ctx);
    o.source = (int *)malloc(((size_t)o.surface.count + 1) * sizeof(int));
    o.joint = (int *)malloc(((size_t)o.surface.joints + 1) * sizeof(int));
    o.points = (springls__v3 *)malloc(3 * ((size_t)o.surface.count + 1) * sizeof *o.points);
    memcpy(o.source, o.surface.source, (size_t)o.surface.count * sizeof(int));
    memcpy(o.joint, o.surface.joint, (size_t)o.surface.joints * sizeof(int));
    memcpy(o.points, o.surface.points, 3 * (size_t)o.surface.count * sizeof *o.points);
    return o;
}

static void originals_free(originals *o)
{
    free(o->source);
    free(o->joint);
    free(o->points);
}

static greatest_test_res are_originals(const springls_context *ctx, const originals *o)
{
    ASSERT_EQ(o->hash, springls_state_hash(ctx));
    ASSERT_EQ(o->surface.count, ctx->original.count);
    ASSERT_EQ(o->surface.given, ctx->original.given);
    ASSERT_EQ(o->surface.joints, ctx->original.joints);
    ASSERT_EQ(0, memcmp(o->source, ctx->original.source, (size_t)o->surface.count * sizeof(int)));
    ASSERT_EQ(0, memcmp(o->joint, ctx->original.joint, (size_t)o->surface.joints * sizeof(int)));
    ASSERT_EQ(0, memcmp(o->points, ctx->original.points, 3 * (size_t)o->surface.count * sizeof *o->points));
    PASS();
}

/* The tools of both are there in the result, in ascending order. */
static greatest_test_res has_tools_of_both(const springls_context *ctx)
{
    int i;
    ASSERT_GTE(ctx->original.joints, 4);
    for (i = 0; i < ctx->original.joints; i++) {
        ASSERT_GT(ctx->original.joint[i], i ? ctx->original.joint[i - 1] : 0);
        ASSERT_LT(ctx->original.joint[i], ctx->original.count);
    }
    PASS();
}

/* Memory runs out at each allocation: the model and its original surface are as before, and combine then as if nothing had been. */
TEST dropping_may_fail_at_every_allocation(void)
{
    springls_context *pair[2], *twin[2];
    fixture_heap heap;
    const springls_allocator allocator = fixture_allocator(&heap);
    springls_status status = SPRINGLS_OUT_OF_MEMORY;
    originals before;
    int fail_at;
    ASSERT_OK(make_dropping(NULL, twin));
    ASSERT_OK(springls_combine(twin[0], SPRINGLS_OPERATION_UNION, twin[1]));
    CHECK_CALL(has_tools_of_both(twin[0]));
    for (fail_at = 0; status != SPRINGLS_OK; fail_at++) {
        ASSERT_OK(make_dropping(&allocator, pair));
        before = originals_of(pair[0]);
        heap.fail_at = heap.calls + fail_at;
        status = springls_combine(pair[0], SPRINGLS_OPERATION_UNION, pair[1]);
        ASSERT(status == SPRINGLS_OK || status == SPRINGLS_OUT_OF_MEMORY);
        ASSERT_EQ(status == SPRINGLS_OUT_OF_MEMORY, heap.calls > heap.fail_at);
        heap.fail_at = -1;
        ASSERT_EQ(heap.bytes, springls_memory_used(pair[0]));
        if (status != SPRINGLS_OK) {
            CHECK_CALL(are_originals(pair[0], &before));
            if (fail_at % 4 == 0) ASSERT_OK(springls_combine(pair[0], SPRINGLS_OPERATION_UNION, pair[1]));
        }
        if (status == SPRINGLS_OK || fail_at % 4 == 0) ASSERT_EQ(springls_state_hash(twin[0]), springls_state_hash(pair[0]));
        originals_free(&before);
        free_pair(pair);
        ASSERT_EQ(0, heap.blocks);
        ASSERT_EQ(0, heap.wrong_sizes);
    }
    ASSERT_GT(fail_at, 10);
    free_pair(twin);
    PASS();
}

/* Given up after any number of pieces, too. */
TEST dropping_is_given_up_anywhere(void)
{
    springls_context *pair[2], *twin[2];
    originals before;
    bool done = false, dropped = false;
    int most, pieces;
    ASSERT_OK(make_dropping(NULL, pair));
    ASSERT_OK(make_dropping(NULL, twin));
    ASSERT_OK(springls_combine(twin[0], SPRINGLS_OPERATION_UNION, twin[1]));
    before = originals_of(pair[0]);
    for (most = 0;; most++) {
        ASSERT_OK(springls_combine_begin(pair[0], SPRINGLS_OPERATION_UNION, pair[1]));
        ASSERT_OK(run_pieces(pair[0], 0.0, most, &pieces, &done));
        if (done) break;
        dropped = dropped || pair[0]->step.combination->originals.taken;
        pair[0]->step.combination->other->model_version++; /* of the tool, or of a copy */
        ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_combine_continue(pair[0], 0.0, &done));
        CHECK_CALL(are_originals(pair[0], &before));
    }
    ASSERT(dropped);
    ASSERT_GT(most, 20);
    CHECK_CALL(has_tools_of_both(pair[0]));
    ASSERT_EQ(springls_state_hash(twin[0]), springls_state_hash(pair[0]));
    originals_free(&before);
    free_pair(pair);
    free_pair(twin);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    int i;
    GREATEST_MAIN_BEGIN();
    for (i = 0; i < 3; i++) {
        RUN_TESTp(balls_have_the_exact_volume, i);
        RUN_TESTp(boxes_have_the_exact_volume, i);
    }
    RUN_TEST(surfaces_may_not_meet_or_share_faces);
    for (i = 0; i < 3; i++) RUN_TESTp(box_less_itself, i);
    RUN_TEST(mesh_less_itself);
    for (i = 0; i < 4; i++) RUN_TESTp(boxes_that_share_a_face, i);
    RUN_TEST(springls_have_the_attributes_of_their_body);
    RUN_TEST(places_on_many_originals_survive_a_restore);
    RUN_TEST(originals_of_second_operands);
    RUN_TEST(originals_that_nothing_comes_from_go);
    RUN_TEST(edits_in_one_place_keep_their_memory);
    RUN_TEST(edits_complete_what_they_change);
    RUN_TEST(the_result_can_move_on);
    RUN_TEST(offsets_have_the_exact_volume);
    RUN_TEST(offsets_change_topology);
    RUN_TEST(smoothing_rounds_a_box);
    RUN_TESTp(smoothing_has_its_length, 16.0f, 12.0f, 0.02);
    RUN_TESTp(smoothing_has_its_length, 10.0f, 1.5f, 0.002);
    RUN_TEST(small_features_vanish);
    RUN_TEST(long_lengths_take_few_steps);
    RUN_TEST(remesh_makes_springls_of_a_voxel);
    for (i = 0; i < 6; i++) RUN_TESTp(remesh_keeps_the_volume, i);
    RUN_TEST(springls_that_wait);
    RUN_TEST(wrong_calls_are_refused);
    for (i = 0; i < 3; i++) RUN_TESTp(the_same_bits_in_pieces, i, 0.0);
    RUN_TESTp(the_same_bits_in_pieces, 0, 0.001);
    RUN_TESTp(the_same_bits_in_pieces, 2, 1e10);
    for (i = 0; i < 2; i++) RUN_TESTp(hierarchies_are_copied_in_pieces, i);
    for (i = 0; i < 6 * STOPS; i++) RUN_TESTp(stopped_in_the_middle, i % STOPS, 4 + 40 * (i / STOPS));
    for (i = 0; i < 3; i++) RUN_TESTp(attributes_of_the_tool_stay, i);
    RUN_TEST(pieces_end);
    for (i = 0; i < 4; i++) RUN_TESTp(every_allocation_may_fail, i);
    RUN_TEST(dropping_may_fail_at_every_allocation);
    RUN_TEST(dropping_is_given_up_anywhere);
    GREATEST_MAIN_END();
}
