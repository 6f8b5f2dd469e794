/* test_mesh_measure.c - mesh reports against known shapes and against brute force. */
#include <float.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "greatest.h"
#include "../../src/model/mesh_measure.h"

GREATEST_MAIN_DEFS();

enum { MAX_VERTICES = 9000, MAX_FACES = 18000 };

static float position[3 * MAX_VERTICES];
static int32_t triangle[3 * MAX_FACES], parent[MAX_VERTICES];
static uint64_t sides[3 * MAX_FACES];
static int n, m;
static springls__mesh_report report;

static void measure(void) { springls__mesh_measure(position, n, triangle, m, parent, sides, &report); }

static int clean(void)
{
    return !report.boundary_edges && !report.misoriented_edges && !report.nonmanifold_edges && !report.unbalanced_edges
           && !report.degenerate_triangles && !report.invalid_triangles;
}

static uint32_t random_state = 1u;
static uint32_t random_bits(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}

static int add_vertex(double x, double y, double z)
{
    position[3 * n] = (float)x; position[3 * n + 1] = (float)y; position[3 * n + 2] = (float)z;
    return n++;
}

static void add_triangle(int a, int b, int c)
{
    triangle[3 * m] = a; triangle[3 * m + 1] = b; triangle[3 * m + 2] = c;
    ++m;
}

static void add_quad(int a, int b, int c, int d) { add_triangle(a, b, c); add_triangle(a, c, d); }

static void add_box(double x0, double y0, double z0, double x1, double y1, double z1)
{
    int b = n, c;
    for (c = 0; c < 8; ++c) add_vertex(c & 1 ? x1 : x0, c & 2 ? y1 : y0, c & 4 ? z1 : z0);
    add_quad(b, b + 2, b + 3, b + 1); add_quad(b + 4, b + 5, b + 7, b + 6);
    add_quad(b, b + 1, b + 5, b + 4); add_quad(b + 2, b + 6, b + 7, b + 3);
    add_quad(b, b + 4, b + 6, b + 2); add_quad(b + 1, b + 3, b + 7, b + 5);
}

/* A tube of radius r around a circle of radius R, both in `steps` steps. */
static void add_torus(double R, double r, int steps)
{
    const double turn = 6.283185307179586;
    int b = n, i, j;
    for (i = 0; i < steps; ++i)
        for (j = 0; j < steps; ++j) {
            double u = turn * i / steps, v = turn * j / steps, d = R + r * cos(v);
            add_vertex(d * cos(u), d * sin(u), r * sin(v));
        }
    for (i = 0; i < steps; ++i)
        for (j = 0; j < steps; ++j) {
            int i1 = (i + 1) % steps, j1 = (j + 1) % steps;
            add_quad(b + i * steps + j, b + i1 * steps + j, b + i1 * steps + j1, b + i * steps + j1);
        }
}

static void add_sphere(double r, int steps)
{
    const double turn = 6.283185307179586;
    int b = n, i, j, north = add_vertex(0.0, 0.0, r), south = add_vertex(0.0, 0.0, -r);
    b += 2;
    for (i = 1; i < steps; ++i)
        for (j = 0; j < 2 * steps; ++j) {
            double u = 0.5 * turn * i / steps, v = 0.5 * turn * j / steps;
            add_vertex(r * sin(u) * cos(v), r * sin(u) * sin(v), r * cos(u));
        }
    for (j = 0; j < 2 * steps; ++j) {
        int j1 = (j + 1) % (2 * steps), last = b + (steps - 2) * 2 * steps;
        add_triangle(north, b + j, b + j1);
        add_triangle(south, last + j1, last + j);
        for (i = 0; i + 2 < steps; ++i)
            add_quad(b + i * 2 * steps + j, b + (i + 1) * 2 * steps + j, b + (i + 1) * 2 * steps + j1, b + i * 2 * steps + j1);
    }
}

static void clear(void) { n = m = 0; }

static int compare_keys(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

TEST keys_are_sorted(void)
{
    static uint64_t mine[5000], known[5000];
    int round, i;
    random_state = 3u;
    for (round = 0; round < 300; ++round) {
        int count = round < 40 ? round : (int)(random_bits() % 5000u);
        for (i = 0; i < count; ++i) {
            uint64_t wide = (uint64_t)random_bits() << 32 | random_bits();
            switch (round % 6) {
            case 0: mine[i] = wide; break;
            case 1: mine[i] = wide & 7u; break;
            case 2: mine[i] = (uint64_t)i; break;
            case 3: mine[i] = (uint64_t)(count - i) << 40; break;
            case 4: mine[i] = wide & 1u ? ~(uint64_t)0 : (uint64_t)1 << (wide >> 1 & 63u); break;
            default: mine[i] = 42u; break;
            }
            known[i] = mine[i];
        }
        springls__sort_keys(mine, (size_t)count);
        qsort(known, (size_t)count, sizeof known[0], compare_keys);
        ASSERT(memcmp(mine, known, (size_t)count * sizeof mine[0]) == 0);
    }
    PASS();
}

TEST a_box(void)
{
    clear();
    add_box(100.0, 200.0, 300.0, 102.0, 203.0, 304.0);
    measure();
    ASSERT(clean());
    ASSERT(report.volume == 24.0);
    ASSERT(report.area == 52.0);
    ASSERT(report.lo[0] == 100.0f && report.lo[1] == 200.0f && report.lo[2] == 300.0f);
    ASSERT(report.hi[0] == 102.0f && report.hi[1] == 203.0f && report.hi[2] == 304.0f);
    ASSERT_EQ(8, report.vertices);
    ASSERT_EQ(18, report.edges);
    ASSERT_EQ(12, report.triangles);
    ASSERT_EQ(2, report.euler);
    ASSERT_EQ(1, report.components);
    PASS();
}

TEST a_sphere_and_a_torus(void)
{
    const double pi = 3.141592653589793;
    clear();
    add_sphere(10.0, 60);
    measure();
    ASSERT(clean());
    ASSERT_EQ(2, report.euler);
    ASSERT_EQ(1, report.components);
    ASSERT_IN_RANGE(4.0 / 3.0 * pi * 1000.0, report.volume, 12.0);
    ASSERT_IN_RANGE(4.0 * pi * 100.0, report.area, 2.0);
    add_torus(30.0, 5.0, 40);
    add_vertex(1e6, 0.0, 0.0); /* not in use: counts nowhere */
    measure();
    ASSERT(clean());
    ASSERT_EQ(2 + 0, report.euler);
    ASSERT_EQ(2, report.components);
    ASSERT_EQ(n - 1, report.vertices);
    ASSERT(report.hi[0] == 35.0f);
    ASSERT_IN_RANGE(4.0 / 3.0 * pi * 1000.0 + 2.0 * pi * pi * 30.0 * 25.0, report.volume, 130.0);
    PASS();
}

TEST a_box_in_a_box_wound_inwards_is_a_cavity(void)
{
    int i, first;
    clear();
    add_box(0.0, 0.0, 0.0, 4.0, 4.0, 4.0);
    first = m;
    add_box(1.0, 1.0, 1.0, 2.0, 2.0, 2.0);
    for (i = first; i < m; ++i) { int32_t a = triangle[3 * i]; triangle[3 * i] = triangle[3 * i + 1]; triangle[3 * i + 1] = a; }
    measure();
    ASSERT(clean());
    ASSERT(report.volume == 63.0);
    ASSERT_EQ(2, report.components);
    ASSERT_EQ(4, report.euler);
    PASS();
}

TEST an_open_box(void)
{
    clear();
    add_box(0.0, 0.0, 0.0, 1.0, 1.0, 1.0);
    --m;
    measure();
    ASSERT_EQ(3, report.boundary_edges);
    ASSERT_EQ(3, report.unbalanced_edges);
    ASSERT_EQ(0, report.nonmanifold_edges + report.misoriented_edges);
    ASSERT_EQ(1, report.euler);
    PASS();
}

TEST a_face_twice_and_a_face_turned(void)
{
    int32_t a;
    clear();
    add_box(0.0, 0.0, 0.0, 1.0, 1.0, 1.0);
    add_triangle(triangle[0], triangle[1], triangle[2]);
    measure();
    ASSERT_EQ(3, report.nonmanifold_edges);
    ASSERT_EQ(3, report.unbalanced_edges);
    ASSERT_EQ(0, report.boundary_edges + report.misoriented_edges);
    --m;
    a = triangle[0]; triangle[0] = triangle[1]; triangle[1] = a;
    measure();
    ASSERT_EQ(3, report.misoriented_edges);
    ASSERT_EQ(3, report.unbalanced_edges);
    ASSERT_EQ(0, report.boundary_edges + report.nonmanifold_edges);
    ASSERT_EQ(2, report.euler);
    PASS();
}

TEST two_boxes_on_one_edge_still_have_an_inside(void)
{
    int i;
    clear();
    add_box(0.0, 0.0, 0.0, 1.0, 1.0, 1.0);
    add_box(1.0, 1.0, 0.0, 2.0, 2.0, 1.0);
    for (i = 36; i < 72; ++i) triangle[i] = triangle[i] == 8 ? 3 : triangle[i] == 12 ? 7 : triangle[i];
    measure();
    ASSERT_EQ(1, report.nonmanifold_edges);
    ASSERT_EQ(0, report.unbalanced_edges + report.boundary_edges + report.misoriented_edges);
    ASSERT_EQ(1, report.components);
    ASSERT(report.volume == 2.0);
    PASS();
}

TEST bad_triangles_are_counted_and_left_out(void)
{
    float zero = 0.0f;
    int line;
    clear();
    measure();
    ASSERT(clean());
    ASSERT_EQ(0, report.vertices + report.edges + report.components + report.euler);
    add_box(0.0, 0.0, 0.0, 1.0, 1.0, 1.0);
    add_vertex(0.0, 0.0, 0.0);
    position[3 * (n - 1) + 1] = zero / zero;
    add_vertex(0.0, 0.0, 0.0);
    position[3 * (n - 1)] = 1.0f / zero;
    add_triangle(0, 1, 8);
    add_triangle(9, 1, 2);
    add_triangle(0, -1, 2);
    add_triangle(0, 1, n);
    add_triangle(INT32_MAX, INT32_MIN, 2);
    add_triangle(4, 4, 5);
    add_triangle(6, 5, 6);
    measure();
    ASSERT_EQ(5, report.invalid_triangles);
    ASSERT_EQ(2, report.degenerate_triangles);
    ASSERT_EQ(12, report.triangles);
    ASSERT_EQ(2, report.euler);
    ASSERT_EQ(0, report.unbalanced_edges);
    ASSERT(report.volume == 1.0);
    clear();
    line = add_vertex(5.1, 5.1, 5.1);
    add_vertex(5.2, 5.2, 5.2);
    add_vertex(5.3, 5.3, 5.3);
    add_triangle(line, line + 1, line + 2);
    measure();
    ASSERT_EQ(1, report.degenerate_triangles);
    ASSERT_EQ(1, report.triangles);
    ASSERT_EQ(3, report.boundary_edges);
    PASS();
}

/* Counts by looking at everything for everything. */
static int brute_components(void)
{
    int label[32], i, t, pass, count = 0;
    for (i = 0; i < n; ++i) label[i] = -1;
    for (i = 0; i < 3 * m; ++i) label[triangle[i]] = triangle[i];
    for (pass = 0; pass < n; ++pass)
        for (t = 0; t < m; ++t)
            for (i = 0; i < 9; ++i) {
                int *a = &label[triangle[3 * t + i / 3]], *b = &label[triangle[3 * t + i % 3]];
                if (*a < *b) *b = *a;
            }
    for (i = 0; i < n; ++i) count += label[i] == i;
    return count;
}

TEST random_soups_against_brute_force(void)
{
    int round, i, t, a, b;
    random_state = 5u;
    for (round = 0; round < 3000; ++round) {
        int way[32][32], used = 0, edges = 0, boundary = 0, misoriented = 0, nonmanifold = 0, unbalanced = 0, seen[32];
        double volume = 0.0, area = 0.0;
        clear();
        memset(way, 0, sizeof way);
        memset(seen, 0, sizeof seen);
        while (n < 3 + round % 20) add_vertex(random_bits() % 64u, random_bits() % 64u, random_bits() % 64u);
        for (t = 1 + (int)(random_bits() % 24u); t > 0; --t) {
            int first = (int)(random_bits() % (uint32_t)n), second, third;
            do second = (int)(random_bits() % (uint32_t)n); while (second == first);
            do third = (int)(random_bits() % (uint32_t)n); while (third == first || third == second);
            add_triangle(first, second, third);
            /* often a whole tetrahedron: closed, so that its volume has an independent meaning */
            if (round % 3 == 0 && n > 3) {
                int top;
                do top = (int)(random_bits() % (uint32_t)n); while (top == first || top == second || top == third);
                add_triangle(second, first, top);
                add_triangle(third, second, top);
                add_triangle(first, third, top);
            }
        }
        for (t = 0; t < m; ++t) {
            springls__v3 p[3], x;
            for (i = 0; i < 3; ++i) {
                int v = triangle[3 * t + i];
                seen[v] = 1;
                ++way[v][triangle[3 * t + (i + 1) % 3]];
                p[i] = springls__v3_make(position[3 * v], position[3 * v + 1], position[3 * v + 2]);
            }
            x = springls__cross(springls__sub(p[1], p[0]), springls__sub(p[2], p[0])); /* whole numbers: exact */
            area += 0.5 * sqrt((double)x.x * x.x + (double)x.y * x.y + (double)x.z * x.z);
            volume += (double)springls__dot(p[0], x) / 6.0;
        }
        for (a = 0; a < n; ++a) {
            used += seen[a];
            for (b = 0; b < a; ++b) {
                int all = way[a][b] + way[b][a];
                edges += all > 0;
                boundary += all == 1;
                misoriented += all == 2 && way[a][b] != 1;
                nonmanifold += all > 2;
                unbalanced += way[a][b] != way[b][a];
            }
        }
        measure();
        ASSERT_EQ(used, report.vertices);
        ASSERT_EQ(edges, report.edges);
        ASSERT_EQ(m, report.triangles);
        ASSERT_EQ(used - edges + m, report.euler);
        ASSERT_EQ(boundary, report.boundary_edges);
        ASSERT_EQ(misoriented, report.misoriented_edges);
        ASSERT_EQ(nonmanifold, report.nonmanifold_edges);
        ASSERT_EQ(unbalanced, report.unbalanced_edges);
        ASSERT_EQ(brute_components(), report.components);
        ASSERT_IN_RANGE(area, report.area, 1e-9 * area);
        if (unbalanced == 0) ASSERT_IN_RANGE(volume, report.volume, 1e-6);
    }
    PASS();
}

SUITE(mesh_measure)
{
    RUN_TEST(keys_are_sorted);
    RUN_TEST(a_box);
    RUN_TEST(a_sphere_and_a_torus);
    RUN_TEST(a_box_in_a_box_wound_inwards_is_a_cavity);
    RUN_TEST(an_open_box);
    RUN_TEST(a_face_twice_and_a_face_turned);
    RUN_TEST(two_boxes_on_one_edge_still_have_an_inside);
    RUN_TEST(bad_triangles_are_counted_and_left_out);
    RUN_TEST(random_soups_against_brute_force);
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(mesh_measure);
    GREATEST_MAIN_END();
}
