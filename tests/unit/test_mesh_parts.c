/* test_mesh_parts.c - meshes of several parts, some of them inside out: what springls_set_mesh takes for their inside. */
#include "set_mesh.h"

enum { SIDE = 56 };

static double ball(double r) { return 4.0 / 3.0 * fixture_pi * r * r * r; }

/* Adds a ball that faces outwards, or inwards, without the rings above `share`. */
static void add_ball(double x, double y, double z, double r, bool outwards, double share)
{
    const int first = triangles;
    int t;
    add_sphere(x, y, z, r, 60, 30, share);
    for (t = first; t < triangles && !outwards; t++) turn_triangle(t);
}

/* Checks the volume of the model that the mesh becomes, and what the report counts. */
TEST becomes(double volume, double tolerance, int turned, int nested)
{
    springls_desc desc = cube(SIDE);
    springls_measures m;
    ASSERT_OK(set_mesh(&desc));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_IN_RANGE(volume, m.volume, tolerance * volume);
    ASSERT_EQ(turned, report.parts_turned);
    ASSERT_EQ(nested, report.parts_nested);
    springls_destroy(ctx);
    PASS();
}

/* Beside each other, and overlapping: a part alone must face outwards. */
TEST side_by_side(void)
{
    int facing;
    for (facing = 0; facing < 4; facing++) {
        const bool first = facing & 1, second = facing >> 1;
        clear_mesh();
        add_ball(14.3, 15.1, 16.2, 8.0, first, 1.0);
        add_ball(38.2, 37.4, 36.3, 11.0, second, 1.0);
        CHECK_CALL(becomes(ball(8.0) + ball(11.0), 0.015, !first + !second, 0));
        ASSERT_EQ(facing == 0, report.flipped);
    }
    PASS();
}

TEST overlapping(void)
{
    const double r = 10.0, apart = 9.0, lens = fixture_pi * (4.0 * r + apart) * (2.0 * r - apart) * (2.0 * r - apart) / 12.0;
    int facing;
    for (facing = 0; facing < 4; facing++) {
        clear_mesh();
        add_ball(20.3, 27.1, 28.2, r, facing & 1, 1.0);
        add_ball(20.3 + apart, 27.1, 28.2, r, facing >> 1, 1.0);
        CHECK_CALL(becomes(2.0 * ball(r) - lens, 0.01, !(facing & 1) + !(facing >> 1), 0));
    }
    PASS();
}

/* A hollow faces inwards; a ball in it is a solid whichever way it came; and a ball in the solid is nothing. */
TEST within_each_other(void)
{
    int inner;
    for (inner = 0; inner < 2; inner++) {
        clear_mesh();
        add_ball(27.3, 27.1, 28.2, 24.0, true, 1.0);
        add_ball(27.3, 27.1, 28.2, 16.0, false, 1.0);
        add_ball(27.3, 27.1, 29.2, 8.0, inner, 1.0);
        CHECK_CALL(becomes(ball(24.0) - ball(16.0) + ball(8.0), 0.01, !inner, 2));
    }
    clear_mesh();
    add_ball(27.3, 27.1, 28.2, 24.0, true, 1.0);
    add_ball(27.3, 27.1, 28.2, 16.0, true, 1.0);
    CHECK_CALL(becomes(ball(24.0), 0.01, 0, 1));
    PASS();
}

/* Hollow balls, one of them inside out as a whole: it stays hollow, and the other as it is. */
TEST hollow_ones_turned_as_a_whole(void)
{
    clear_mesh();
    add_ball(16.3, 15.1, 16.2, 12.0, true, 1.0);
    add_ball(16.3, 15.1, 16.2, 7.0, false, 1.0);
    add_ball(38.2, 39.4, 38.3, 14.0, false, 1.0);
    add_ball(38.2, 39.4, 38.3, 8.0, true, 1.0);
    CHECK_CALL(becomes(ball(12.0) - ball(7.0) + ball(14.0) - ball(8.0), 0.01, 2, 2));
    PASS();
}

/* Of two open bowls that are one body with a film each, one came inside out; a third is a hollow with a hole. */
TEST open_parts(void)
{
    const double pi = fixture_pi, share = 0.8, rim = cos(pi * (1.0 - share)); /* add_sphere leaves the top out */
    const double cap = pi * (2.0 - 3.0 * rim + rim * rim * rim) / 3.0, open = ball(1.0) - cap;
    int first;
    for (first = 0; first < 2; first++) {
        clear_mesh();
        add_ball(14.3, 15.1, 16.2, 10.0, first, share);
        add_ball(38.2, 38.4, 36.3, 12.0, false, share);
        CHECK_CALL(becomes(open * (1000.0 + 1728.0), 0.03, 2 - first, 0));
    }
    PASS();
}

/* The six faces of a box, apart from each other by cracks, each facing any way. */
TEST faces_with_cracks(void)
{
    static const double half = 12.0;
    int facing, axis, side, k;
    for (facing = 0; facing < 64; facing += 7) {
        int turned = 0;
        clear_mesh();
        for (axis = 0; axis < 3; axis++)
            for (side = 0; side < 2; side++) {
                const bool out = facing >> (2 * axis + side) & 1;
                const int base = positions;
                for (k = 0; k < 4; k++) {
                    double x[3];
                    x[axis] = side ? half : -half;
                    x[(axis + 1) % 3] = (k & 1 ? half : -half) * 0.99;
                    x[(axis + 2) % 3] = (k & 2 ? half : -half) * 0.99;
                    add_position(27.3 + x[0], 27.1 + x[1], 28.2 + x[2]);
                }
                add_triangle(base, base + (out == (side == 1) ? 1 : 3), base + (out == (side == 1) ? 3 : 1));
                add_triangle(base, base + (out == (side == 1) ? 3 : 2), base + (out == (side == 1) ? 2 : 3));
                turned += !out;
            }
        CHECK_CALL(becomes(8.0 * half * half * half, 0.02, turned, 0));
    }
    PASS();
}

/* Triangles that no edge holds together, each drawn in from its corners and facing any way. */
TEST loose_triangles(void)
{
    int t, k, m, turned = 0, given;
    clear_mesh();
    random_state = 5u;
    add_ball(27.3, 27.1, 28.2, 15.0, true, 1.0);
    given = triangles;
    for (t = 0; t < given; t++) {
        float q[3][3], middle;
        for (m = 0; m < 3; m++) memcpy(q[m], position + 3 * triangle[3 * t + m], sizeof q[m]);
        for (k = 0; k < 3; k++) {
            middle = (q[0][k] + q[1][k] + q[2][k]) / 3.0f;
            for (m = 0; m < 3; m++) q[m][k] = middle + 0.98f * (q[m][k] - middle);
        }
        for (m = 0; m < 3; m++) {
            triangle[3 * t + m] = positions;
            add_position((double)q[m][0], (double)q[m][1], (double)q[m][2]);
        }
        if (random_unit() < 0.5) continue;
        turn_triangle(t);
        turned++;
    }
    CHECK_CALL(becomes(ball(15.0), 0.02, turned, 0));
    PASS();
}

/* A grid whose axes are mirrored in the world turns nothing by itself. */
TEST mirrored_world(void)
{
    springls_desc desc = cube(SIDE);
    springls_measures m;
    int i;
    clear_mesh();
    add_ball(14.3, 15.1, 16.2, 8.0, true, 1.0);
    add_ball(38.2, 37.4, 36.3, 11.0, false, 1.0);
    add_ball(38.2, 37.4, 36.3, 5.0, true, 1.0); /* a hollow of the one that is inside out */
    for (i = 0; i < positions; i++) position[3 * i] = -position[3 * i];
    for (i = 0; i < triangles; i++) turn_triangle(i);
    desc.grid.direction[0] = -1.0f;
    desc.grid.direction[4] = desc.grid.direction[8] = 1.0f;
    ASSERT_OK(set_mesh(&desc));
    ASSERT_OK(springls_measure(ctx, &m));
    ASSERT_IN_RANGE(ball(8.0) + ball(11.0) - ball(5.0), m.volume, 0.015 * m.volume);
    ASSERT_EQ(2, report.parts_turned);
    ASSERT_EQ(1, report.parts_nested);
    springls_destroy(ctx);
    PASS();
}

/* Every allocation may fail: an error, and no model that is half set. */
TEST without_memory(void)
{
    springls_desc desc = cube(24);
    fixture_heap heap;
    int call, failures = 0;
    springls_status status = SPRINGLS_OUT_OF_MEMORY;
    clear_mesh();
    add_ball(13.3, 13.1, 13.2, 8.0, false, 1.0);
    add_ball(13.3, 13.1, 13.2, 4.0, true, 1.0);
    add_ball(3.3, 3.1, 3.2, 2.5, false, 0.8);
    desc.allocator = fixture_allocator(&heap);
    for (call = 0; status == SPRINGLS_OUT_OF_MEMORY; call++) {
        ASSERT_OK(springls_create(&desc, &ctx));
        heap.calls = 0;
        heap.fail_at = call;
        status = springls_set_mesh(ctx, position, positions, 0, triangle, triangles, &report);
        heap.fail_at = -1;
        failures += status == SPRINGLS_OUT_OF_MEMORY;
        if (status == SPRINGLS_OUT_OF_MEMORY) ASSERT_EQ(0, springls_count(ctx));
        else ASSERT_STATUS(SPRINGLS_OK, status);
        springls_destroy(ctx);
        ASSERT_EQ(0, heap.blocks);
        ASSERT_EQ(0, heap.wrong_sizes);
    }
    ASSERT_GT(failures, 20);
    PASS();
}

GREATEST_MAIN_DEFS();
int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(side_by_side);
    RUN_TEST(overlapping);
    RUN_TEST(within_each_other);
    RUN_TEST(hollow_ones_turned_as_a_whole);
    RUN_TEST(open_parts);
    RUN_TEST(faces_with_cracks);
    RUN_TEST(loose_triangles);
    RUN_TEST(mirrored_world);
    RUN_TEST(without_memory);
    GREATEST_MAIN_END();
}
