/* test_mend.c - examples/mend.c as it is run: balls and rings with each kind of damage become what they were; what it refuses and what it
   warns of, in one line. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_mend_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_mend_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#define main mend_main
#include "../../examples/mend.c"
#undef main

#include "mesh_damage.h"
#include "run_program.h"
#include "surface/mesh_slivers.h"
#include "surface/mesh_uncross.h"

#include <sys/stat.h>

#define PI 3.14159265358979

/* Returns the program's status; what it prints goes into files. The last argument is NULL. */
static int run_mend(const char *input, const char *const *more)
{
    const char *const arguments[] = {"mend", input, NULL};
    return run_program(mend_main, arguments, more);
}

/* ---- meshes ---- */

enum { ROUND = 96, ACROSS = 48 };

struct shape {
    float positions[3 * ROUND * ACROSS];
    uint32_t indices[6 * ROUND * ACROSS];
};

/* Makes a ring of radii 1 and .45 about the origin. */
static void make_ring(struct shape *ring)
{
    for (int i = 0; i < ROUND * ACROSS; ++i) {
        const double a = 2.0 * PI * (i / ACROSS) / ROUND, b = 2.0 * PI * (i % ACROSS) / ACROSS;
        const int down = (i / ACROSS + 1) % ROUND * ACROSS + i % ACROSS;
        const int right = i / ACROSS * ACROSS + (i % ACROSS + 1) % ACROSS, both = down / ACROSS * ACROSS + right % ACROSS;
        const int faces[6] = {i, down, both, i, both, right};
        ring->positions[3 * i] = (float)((1.0 + 0.45 * cos(b)) * cos(a));
        ring->positions[3 * i + 1] = (float)((1.0 + 0.45 * cos(b)) * sin(a));
        ring->positions[3 * i + 2] = (float)(0.45 * sin(b));
        for (int k = 0; k < 6; ++k) ring->indices[6 * i + k] = (uint32_t)faces[k];
    }
}

static bool write_damaged(const char *path, const struct damaged *m, const float *colors)
{
    char error[MESH_TEXT];
    const struct mesh_arrays arrays = {.positions = m->positions,
                                       .vertex_count = m->vertex_count,
                                       .indices = m->indices,
                                       .triangle_count = m->triangle_count,
                                       .colors = colors};
    return mesh_write(path, &arrays, error);
}

struct facts {
    double volume;
    struct mesh_check check;
    struct mesh mesh; /* to be freed */
};

static bool read_facts(const char *path, struct facts *facts)
{
    char error[MESH_TEXT];
    memset(facts, 0, sizeof *facts);
    if (!mesh_read(path, &facts->mesh, error)) return false;
    facts->volume = mesh_volume(facts->mesh.positions, (const int *)facts->mesh.indices, (int)facts->mesh.triangle_count);
    return mesh_check(facts->mesh.positions, (int)facts->mesh.vertex_count, (const int *)facts->mesh.indices,
                      (int)facts->mesh.triangle_count, &facts->check);
}

static struct shape ring;

/* ---- tests ---- */

/* Each kind of damage, in one strength: closed, without crossings, one part, one hole through it, the volume of the whole ring, few thin
 * triangles. */
TEST damage_is_mended(void)
{
    make_ring(&ring);
    const double volume = 2.0 * PI * PI * 0.45 * 0.45;
    for (int kind = 0; kind < DAMAGE_KINDS; ++kind) {
        struct damaged m;
        struct facts facts;
        char path[512];
        snprintf(path, sizeof path, "%s", scratch("damaged.ply"));
        ASSERT(damage_begin(&m, ring.positions, ROUND * ACROSS, ring.indices, 2 * ROUND * ACROSS, 7u));
        ASSERT(damage_do(&m, (enum damage_kind)kind, kind % 3) && write_damaged(path, &m, NULL));
        damage_end(&m);
        const char *const more[] = {"--grid", "64", "--out", scratch("mended.ply"), "--strict", NULL};
        ASSERT_EQm(damage_names[kind], 0, run_mend(path, more));
        ASSERT(read_facts(more[3], &facts));
        const double sharp = mesh_sharp_angles(facts.mesh.positions, (const int *)facts.mesh.indices, (int)facts.mesh.triangle_count, 10.0);
        mesh_free(&facts.mesh);
        ASSERTm(damage_names[kind], sharp < 0.005);
        ASSERT_EQm(damage_names[kind], 0, facts.check.open_edges);
        ASSERT_EQm(damage_names[kind], 0, facts.check.intersections);
        ASSERT_EQm(damage_names[kind], 1, facts.check.components);
        ASSERT_EQm(damage_names[kind], 0, facts.check.euler);
        ASSERT_IN_RANGEm(damage_names[kind], volume, facts.volume, 0.015 * volume);
    }
    PASS();
}

/* A hollow ring with punctures that are much narrower than the hollow. With walls of two voxels it is taken as a solid; with walls of six
 * it stays hollow, which is said, and ends with status 3 on request; the ball that is named then fills it. */
TEST punctured_shells_are_filled_or_named(void)
{
    static const struct {
        float wall, hole;
        const char *grid, *opening;
        int status;
        bool full;
    } cases[] = {{0.1f, 0.12f, "64", NULL, 0, true}, {0.2f, 0.12f, "96", NULL, EXIT_LOSS, false}, {0.2f, 0.12f, "96", "4", 0, true}};
    const double volume = 2.0 * PI * PI * 0.45 * 0.45;
    make_ring(&ring);
    for (int i = 0; i < 3; ++i) {
        struct damaged m;
        struct facts facts;
        float outer[3], inner[3];
        char path[512];
        snprintf(path, sizeof path, "%s", scratch("shell.ply"));
        ASSERT(damage_begin(&m, ring.positions, ROUND * ACROSS, ring.indices, 2 * ROUND * ACROSS, 7u));
        damage_center(&m, 1000, outer);
        ASSERT(damage_copy(&m, outer, -1.0f, cases[i].wall, true));
        damage_center(&m, 2 * ROUND * ACROSS + 1000, inner);
        damage_hole(&m, outer, cases[i].hole);
        damage_hole(&m, inner, cases[i].hole);
        ASSERT(write_damaged(path, &m, NULL));
        damage_end(&m);
        const char *const more[] = {"--grid", cases[i].grid, "--out", scratch("mended.ply"), "--strict",
                                    cases[i].opening ? "--opening" : NULL, cases[i].opening, NULL};
        ASSERT_EQ(cases[i].status, run_mend(path, more));
        ASSERT(read_facts(more[3], &facts));
        mesh_free(&facts.mesh);
        ASSERT_EQ(0, facts.check.open_edges + facts.check.intersections);
        if (cases[i].full) {
            ASSERT_IN_RANGE(volume, facts.volume, 0.015 * volume);
            ASSERT_EQ(0, facts.check.euler);
        } else {
            ASSERT(facts.volume < 0.8 * volume);
            ASSERT(strstr(printed("stderr"), "stays hollow through narrow openings"));
        }
    }
    PASS();
}

static double area_of(const struct mesh *mesh)
{
    double sum = 0.0;
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        const uint32_t *i = mesh->indices + 3 * t;
        sum += vec3_triangle_area(mesh->positions + 3 * i[0], mesh->positions + 3 * i[1], mesh->positions + 3 * i[2]);
    }
    return sum;
}

/* A turned box without one of its triangles, and with another one turned: the edges are sharp, as area and volume show, which lose 1 % and
 * more where edges are cut by a voxel of 54. The zero level, and the paper's set, do so. */
TEST edges_stay_sharp(void)
{
    static const uint32_t faces[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    const double side[3] = {2.0, 1.5, 1.0}, axis[3][3] = {{0.8, 0.6, 0.0}, {-0.48, 0.64, 0.6}, {0.36, -0.48, 0.8}};
    const double volume = side[0] * side[1] * side[2], area = 2.0 * (side[0] * side[1] + side[1] * side[2] + side[2] * side[0]);
    struct damaged m;
    float corners[24];
    char path[512];
    for (int i = 0; i < 24; ++i) {
        double x = 0.0;
        for (int k = 0; k < 3; ++k) x += (i / 3 >> k & 1 ? side[k] : 0.0) * axis[k][i % 3];
        corners[i] = (float)x;
    }
    snprintf(path, sizeof path, "%s", scratch("box.ply"));
    ASSERT(damage_begin(&m, corners, 8, faces, 11, 7u));
    const uint32_t first = m.indices[0];
    m.indices[0] = m.indices[1];
    m.indices[1] = first;
    ASSERT(write_damaged(path, &m, NULL));
    damage_end(&m);
    for (int i = 0; i < 3; ++i) {
        const char *const more[] = {"--grid", "64", "--out", scratch("mended.ply"), i == 0 ? NULL : i == 1 ? "--set" : "--params",
                                    i == 1 ? "contouring=0" : "paper", NULL};
        struct facts facts;
        ASSERT_EQ(0, run_mend(path, more));
        ASSERT(read_facts(more[3], &facts));
        const double left = area_of(&facts.mesh) / area;
        mesh_free(&facts.mesh);
        ASSERT_EQ(0, facts.check.open_edges + facts.check.intersections);
        ASSERT_EQ(2, facts.check.euler);
        ASSERT_IN_RANGE(volume, facts.volume, (i == 0 ? 0.002 : 0.02) * volume);
        ASSERT(i == 0 ? fabs(left - 1.0) < 0.002 : left < 0.998);
    }
    PASS();
}

/* Pairs of triangles that cross, apart from each other in a row, under one that is as large as all: as many crossings, and their
   corners. */
TEST crossings_are_counted_and_marked(void)
{
    enum { PAIRS = 50 };
    static const float pair[18] = {0.0f, 0.0f, 0.0f,  1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f,
                                   0.2f, 0.2f, -1.0f, 0.3f, 0.2f, 1.0f, 0.2f, 0.3f, 1.0f};
    float places[3 * (6 * PAIRS + 6)];
    int triangles[6 * PAIRS + 6];
    unsigned char marks[6 * PAIRS + 6] = {0};
    for (int i = 0; i < 6 * PAIRS + 6; ++i) {
        triangles[i] = i;
        for (int k = 0; k < 3; ++k) places[3 * i + k] = pair[3 * (i % 6) + k] + (k == 0 ? 3.0f * (float)(i / 6) : 0.0f);
    }
    for (int i = 6 * PAIRS; i < 6 * PAIRS + 6; ++i) { /* the last two do not cross */
        for (int k = 0; k < 3; ++k) places[3 * i + k] = k == 2 ? 2.0f + (float)(i / 3) : (float)(i % 3 == k) * 200.0f - 20.0f;
    }
    ASSERT_EQ(PAIRS, mesh_mark_crossings(places, triangles, 2 * PAIRS + 2, marks));
    for (int i = 0; i < 6 * PAIRS + 6; ++i) ASSERT_EQ(i < 6 * PAIRS, marks[i]);
    ASSERT_EQ(0, mesh_mark_crossings(places, triangles, 0, NULL));
    PASS();
}

static int flat_triangles(const struct shape *s)
{
    int count = 0;
    for (const uint32_t *t = s->indices; t < s->indices + 6 * ROUND * ACROSS; t += 3)
        count += !(vec3_triangle_area(s->positions + 3 * t[0], s->positions + 3 * t[1], s->positions + 3 * t[2]) > 0.0);
    return count;
}

/* A ring of which a vertex lies behind its neighbors, and another one on the edge between two: both are moved away, no other one far. */
TEST crossings_are_taken_apart(void)
{
    enum { PUSHED = 20 * ACROSS + 10, FLAT = 50 * ACROSS + 10, COUNT = ROUND * ACROSS, TRIANGLES = 2 * ROUND * ACROSS };
    static struct shape truth;
    const float furthest = 0.2f;
    make_ring(&ring);
    memcpy(&truth, &ring, sizeof ring);
    for (int k = 0; k < 3; ++k) {
        const float *p = truth.positions + k;
        ring.positions[3 * PUSHED + k] = p[3 * (PUSHED + 2)] + 0.03f * (p[3 * (PUSHED + 2)] - p[3 * (PUSHED + ACROSS)]);
        ring.positions[3 * FLAT + k] = p[3 * (FLAT + 1)];
    }
    ASSERT(mesh_mark_crossings(ring.positions, (const int *)ring.indices, TRIANGLES, NULL) > 0);
    ASSERT(flat_triangles(&ring) > 0);
    ASSERT(mesh_uncross(ring.positions, COUNT, (const int *)ring.indices, TRIANGLES, (double)furthest));
    ASSERT_EQ(0, mesh_mark_crossings(ring.positions, (const int *)ring.indices, TRIANGLES, NULL));
    ASSERT_EQ(0, flat_triangles(&ring));
    for (int v = 0; v < COUNT; ++v) {
        const double moved = (double)damage_apart(ring.positions + 3 * v, truth.positions + 3 * v);
        ASSERT(moved < (v == PUSHED || v == FLAT ? 0.4 : 0.2001));
    }
    ASSERT(mesh_uncross(NULL, 0, NULL, 0, 1.0));
    PASS();
}

/* A ring with a rough surface, every triangle on its own with cracks of a five-hundredth around it: all borders find each other, so that
 * the ring is the rough one again, with one hole. */
TEST cracks_of_rough_surfaces_are_joined(void)
{
    struct damaged m;
    struct facts facts;
    char path[512];
    make_ring(&ring);
    for (int i = 0; i < 3 * ROUND * ACROSS; ++i) ring.positions[i] += 0.012f * sinf(37.0f * (float)i);
    const double volume = mesh_volume(ring.positions, (const int *)ring.indices, 2 * ROUND * ACROSS);
    snprintf(path, sizeof path, "%s", scratch("cracked.ply"));
    ASSERT(damage_begin(&m, ring.positions, ROUND * ACROSS, ring.indices, 2 * ROUND * ACROSS, 7u));
    ASSERT(damage_do(&m, DAMAGE_CRACKS, 2) && write_damaged(path, &m, NULL));
    damage_end(&m);
    const char *const more[] = {"--grid", "48", "--out", scratch("mended.ply"), "--strict", NULL};
    ASSERT_EQ(0, run_mend(path, more));
    ASSERTm(printed("stdout"), strstr(printed("stdout"), "13824 pairs of borders are joined; 1 patch")); /* 3 * 9216 / 2 */
    ASSERT(read_facts(more[3], &facts));
    mesh_free(&facts.mesh);
    ASSERT_EQ(0, facts.check.open_edges);
    ASSERT_EQ(0, facts.check.intersections);
    ASSERT_EQ(1, facts.check.components);
    ASSERT_EQ(0, facts.check.euler);
    ASSERT_IN_RANGE(volume, facts.volume, 0.015 * volume);
    PASS();
}

/* Three triangles on one edge have nothing to join; a crack is joined whatever else there is, as 2,000 tiny triangles. */
TEST borders_are_joined_by_their_own_lengths(void)
{
    enum { TINY = 2000 };
    static const float crack[18] = {0.0f, 0.0f,  0.0f, 3.0f, 0.0f,  0.0f, 1.0f, 3.0f,  0.0f,
                                    0.0f, -0.5f, 0.0f, 1.0f, -4.0f, 0.0f, 3.0f, -0.5f, 0.0f};
    static float positions[18 + 9 * TINY];
    static uint32_t indices[6 + 3 * TINY];
    float fan[15] = {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.5f, 1.0f, 0.0f, 0.5f, -1.0f, 0.0f, 0.5f, 0.0f, 1.0f};
    uint32_t leaves[9] = {0, 1, 2, 1, 0, 3, 0, 1, 4};
    size_t joined;
    struct mesh mesh = {.positions = fan, .vertex_count = 5, .indices = leaves, .triangle_count = 3};
    ASSERT(mesh_weld(&mesh, 0.3f, &joined));
    ASSERT_EQ(0u, joined);
    ASSERT_EQ(3u, mesh.triangle_count);
    for (int tiny = 0; tiny <= TINY; tiny += TINY) {
        memcpy(positions, crack, sizeof crack);
        for (int i = 0; i < 6 + 3 * tiny; ++i) indices[i] = (uint32_t)i;
        for (int i = 0; i < 9 * tiny; ++i) positions[18 + i] = 10.0f + (float)(i / 9) + 0.01f * (float)(i % 9 == 3 || i % 9 == 7);
        mesh = (struct mesh){
            .positions = positions, .vertex_count = 6 + 3 * (size_t)tiny, .indices = indices, .triangle_count = 2 + (size_t)tiny};
        ASSERT(mesh_weld(&mesh, 1.0f, &joined));
        ASSERT_EQ(1u, joined);
        ASSERT_EQ(-0.25f, positions[1]);
    }
    PASS();
}

/* A hollow ring: filled, and kept on request. */
TEST hollows_go_or_stay(void)
{
    struct damaged m;
    struct facts facts;
    char path[512];
    make_ring(&ring);
    snprintf(path, sizeof path, "%s", scratch("hollow.ply"));
    ASSERT(damage_begin(&m, ring.positions, ROUND * ACROSS, ring.indices, 2 * ROUND * ACROSS, 7u));
    ASSERT(damage_copy(&m, ring.positions, -1.0f, 0.2f, true) && write_damaged(path, &m, NULL));
    damage_end(&m);
    for (int keep = 0; keep < 2; ++keep) {
        const char *const more[] = {"--grid", "64", "--out", scratch("mended.ply"), "--cavities", keep ? "keep" : "fill", NULL};
        const double volume = 2.0 * PI * PI * (0.45 * 0.45 - (keep ? 0.25 * 0.25 : 0.0));
        ASSERT_EQ(0, run_mend(path, more));
        ASSERT(strstr(printed("stdout"), keep ? "1 hollow kept" : "1 hollow filled"));
        ASSERT(read_facts(more[3], &facts));
        mesh_free(&facts.mesh);
        ASSERT_IN_RANGE(volume, facts.volume, 0.015 * volume);
        ASSERT_EQ(1 + keep, facts.check.components);
    }
    PASS();
}

/* Adds a ball about a place on the x axis, or turns it inwards. */
static bool add_ball(struct damaged *m, double x, double radius, bool inwards)
{
    enum { ROWS = 24, AROUND = 48 };
    const uint32_t first = (uint32_t)m->vertex_count, last = first + 1 + (ROWS - 1) * AROUND; /* the poles */
    if (!damage_room(m, 2 + (ROWS - 1) * AROUND, 2 * (ROWS - 1) * AROUND)) return false;
    for (int i = 0; i < 2 + (ROWS - 1) * AROUND; ++i) {
        const double down = PI * (i == 0 ? 0 : 1 + (i - 1) / AROUND) / ROWS, around = 2.0 * PI * ((i + AROUND - 1) % AROUND) / AROUND;
        float *place = m->positions + 3 * m->vertex_count++;
        place[0] = (float)(x + radius * sin(down) * cos(around));
        place[1] = (float)(radius * sin(down) * sin(around));
        place[2] = (float)(radius * cos(down));
    }
    for (uint32_t i = 0; i < ROWS * AROUND; ++i) { /* a face between two meridians, of two triangles, at poles of one */
        const uint32_t row = i / AROUND, lower = first + 1 + i, right = i % AROUND == AROUND - 1 ? lower + 1 - AROUND : lower + 1;
        const uint32_t faces[6] = {lower - AROUND, lower, right, lower - AROUND, right, right - AROUND};
        const uint32_t cap[3] = {first, lower, right}, bottom[3] = {lower - AROUND, last, right - AROUND};
        const uint32_t *from = row == 0 ? cap : row == ROWS - 1 ? bottom : faces;
        for (int k = 0; k < (from == faces ? 6 : 3); ++k) {
            m->indices[3 * m->triangle_count + (size_t)k] = from[inwards && k % 3 ? k + 3 - 2 * (k % 3) : k];
        }
        m->triangle_count += from == faces ? 2 : 1;
    }
    return true;
}

/* A ball, another one of 1/1166 of its volume beside it, and a hollow as little in it: they enclose 30 voxels^3 and more, which by default
 * is more than a speck. */
TEST little_parts_and_hollows_are_no_specks(void)
{
    static const struct {
        const char *specks, *cavities;
        int components, parts;
    } cases[] = {{"8", "keep", 3, 2}, {"8", "fill", 2, 2}, {"100", "keep", 1, 1}};
    const double radius[2] = {1.0, 0.095}, unit = 4.0 / 3.0 * PI;
    struct damaged m = {.size = 2.4f};
    char path[512];
    snprintf(path, sizeof path, "%s", scratch("balls.ply"));
    ASSERT(add_ball(&m, 0.0, radius[0], false) && add_ball(&m, 1.3, radius[1], false) && add_ball(&m, 0.3, radius[1], true));
    ASSERT(write_damaged(path, &m, NULL));
    damage_end(&m);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        const char *const more[] = {"--grid", "64", "--out", scratch("mended.ply"), "--cavities", cases[i].cavities,
                                    "--specks", cases[i].specks, NULL};
        struct facts facts;
        ASSERT_EQ(0, run_mend(path, more));
        ASSERTm(printed("stdout"), (strstr(printed("stdout"), ", 1 speck") != NULL) == (cases[i].parts == 1));
        ASSERT(read_facts(more[3], &facts));
        mesh_free(&facts.mesh);
        ASSERT_EQ(0, facts.check.open_edges + facts.check.intersections);
        ASSERT_EQ(cases[i].components, facts.check.components);
        ASSERT_IN_RANGE(unit, facts.volume, 0.01 * unit);
    }
    PASS();
}

/* A flat ring, which has thin triangles, beside two tetrahedra that cross: fewer are thin, and what crosses stays as it is. */
TEST slivers_go_where_others_cross(void)
{
    static const float corners[12] = {0.0f, 0.0f, 0.0f, 0.5f, 0.0f, 0.0f, 0.0f, 0.5f, 0.0f, 0.0f, 0.0f, 0.5f};
    static const int faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    enum { RING_VERTICES = ROUND * ACROSS, RING_INDICES = 6 * ROUND * ACROSS };
    static float positions[3 * RING_VERTICES + 24];
    static int triangles[RING_INDICES + 24], kept[RING_VERTICES + 8];
    int vertex_count = RING_VERTICES + 8, triangle_count = RING_INDICES / 3 + 8;
    make_ring(&ring);
    for (int i = 0; i < 3 * RING_VERTICES; ++i) positions[i] = ring.positions[i] * (i % 3 == 2 ? 0.1f : 1.0f);
    for (int i = 0; i < RING_INDICES; ++i) triangles[i] = (int)ring.indices[i];
    for (int i = 0; i < 24; ++i) positions[3 * RING_VERTICES + i] = corners[i % 12] + (i < 12 ? 3.0f : 3.1f);
    for (int i = 0; i < 24; ++i) triangles[RING_INDICES + i] = RING_VERTICES + faces[i % 12] + i / 12 * 4;
    const int crossings = mesh_mark_crossings(positions, triangles, triangle_count, NULL);
    const double sharp = mesh_sharp_angles(positions, triangles, triangle_count, 15.0);
    ASSERT(crossings > 0 && sharp > 0.05);
    ASSERT(mesh_remove_slivers(positions, &vertex_count, triangles, &triangle_count, 0.01, kept));
    ASSERT_EQ(crossings, mesh_mark_crossings(positions, triangles, triangle_count, NULL));
    ASSERT(mesh_sharp_angles(positions, triangles, triangle_count, 15.0) < 0.3 * sharp);
    struct mesh_check check;
    ASSERT(mesh_check(positions, vertex_count, triangles, triangle_count, &check));
    ASSERT(check.open_edges == 0 && check.components == 3 && check.euler == 4);
    PASS();
}

/* Vertices are red to the left and blue to the right, with a blend between. */
TEST colors_come_along(void)
{
    static float colors[3 * ROUND * ACROSS];
    struct damaged m;
    struct facts facts;
    char path[512];
    int wrong = 0;
    make_ring(&ring);
    for (int i = 0; i < ROUND * ACROSS; ++i) {
        colors[3 * i] = 0.5f + 0.3f * ring.positions[3 * i];
        colors[3 * i + 1] = 0.25f;
        colors[3 * i + 2] = 0.5f - 0.3f * ring.positions[3 * i];
    }
    snprintf(path, sizeof path, "%s", scratch("colored.ply"));
    ASSERT(damage_begin(&m, ring.positions, ROUND * ACROSS, ring.indices, 2 * ROUND * ACROSS, 7u));
    ASSERT(write_damaged(path, &m, colors));
    damage_end(&m);
    const char *const more[] = {"--grid", "64", "--out", scratch("mended.ply"), "--picture", scratch("mended.png"), NULL};
    ASSERT_EQ(0, run_mend(path, more));
    ASSERT(read_facts(more[3], &facts) && facts.mesh.colors);
    for (size_t i = 0; i < facts.mesh.vertex_count; ++i) {
        const float x = facts.mesh.positions[3 * i], *c = facts.mesh.colors + 3 * i;
        wrong += fabsf(c[0] - 0.5f - 0.3f * x) > 2.6f / 255.0f || fabsf(c[1] - 0.25f) > 2.6f / 255.0f
                 || fabsf(c[2] - 0.5f + 0.3f * x) > 2.6f / 255.0f;
    }
    mesh_free(&facts.mesh);
    struct stat status;
    ASSERT_EQ(0, stat(more[5], &status));
    ASSERT(status.st_size > 1000);
    ASSERT_EQ(0, wrong);
    PASS();
}

/* Red, green and blue by the place. */
static void color_at(const float place[3], float color[3])
{
    color[0] = 0.5f + 0.3f * place[0];
    color[1] = 0.5f + 0.3f * place[1];
    color[2] = 0.5f + 0.8f * place[2];
}

/* Writes the ring as GLB with an image, in charts. */
static bool write_textured_ring(const char *path, int size)
{
    static float colors[3 * ROUND * ACROSS], normals[3 * ROUND * ACROSS];
    make_ring(&ring);
    for (int i = 0; i < ROUND * ACROSS; ++i) color_at(ring.positions + 3 * i, colors + 3 * i);
    for (int i = 0; i < ROUND * ACROSS; ++i) normals[3 * i + 2] = 1.0f; /* nobody looks at them */
    const struct gltf_mesh surface = {.positions = ring.positions,
                                      .normals = normals,
                                      .colors = colors,
                                      .triangles = (const int *)ring.indices,
                                      .vertex_count = ROUND * ACROSS,
                                      .triangle_count = 2 * ROUND * ACROSS};
    return textured_mesh_write(path, &surface, size);
}

/* Images come along: the solid has one of its own, with the colors of the mesh at their places; without one, vertices have them. */
TEST images_come_along(void)
{
    char path[512], error[SCENE_TEXT];
    struct scene scene;
    struct facts facts;
    int wrong = 0;
    snprintf(path, sizeof path, "%s", scratch("textured.glb"));
    ASSERT(write_textured_ring(path, 256));
    const char *const more[] = {"--grid", "48", "--out", scratch("mended.glb"), "--quiet", NULL};
    ASSERT_EQ(0, run_mend(path, more));
    ASSERT(scene_read(more[3], SCENE_ALL, &scene, error));
    ASSERT_EQ(1, scene.part_count);
    ASSERT_EQ(1, scene.picture_count);
    const struct scene_part *part = &scene.parts[0];
    ASSERT_EQ(1024, scene.pictures[0].image.width);
    ASSERT(part->uvs && part->normals);
    for (int i = 0; i < part->triangle_count; ++i) { /* at the triangles' centers, in steps of 1/255 */
        float place[3] = {0.0f, 0.0f, 0.0f}, uv[2] = {0.0f, 0.0f}, is[3], ought[3];
        for (int k = 0; k < 3; ++k) {
            const size_t v = (size_t)part->triangles[3 * i + k];
            vec3_add_scaled(place, 1.0f / 3.0f, part->positions + 3 * v, place);
            uv[0] += part->uvs[2 * v] / 3.0f;
            uv[1] += part->uvs[2 * v + 1] / 3.0f;
        }
        byte_image_sample(&scene.pictures[0].image, uv, is);
        color_at(place, ought);
        wrong +=
            fabsf(is[0] - ought[0]) > 2.6f / 255.0f || fabsf(is[1] - ought[1]) > 2.6f / 255.0f || fabsf(is[2] - ought[2]) > 2.6f / 255.0f;
    }
    ASSERT_IN_RANGE(0, wrong, part->triangle_count / 100);
    scene_free(&scene);
    const char *const vertices[] = {"--grid", "48", "--out", scratch("mended.ply"), "--quiet", NULL};
    ASSERT_EQ(0, run_mend(path, vertices));
    ASSERT(read_facts(vertices[3], &facts) && facts.mesh.colors);
    for (size_t v = 0; v < facts.mesh.vertex_count; ++v) {
        float ought[3];
        color_at(facts.mesh.positions + 3 * v, ought);
        for (size_t k = 0; k < 3; ++k) ASSERT_IN_RANGE(ought[k], facts.mesh.colors[3 * v + k], 5.0f / 255.0f);
    }
    mesh_free(&facts.mesh);
    PASS();
}

/* --texture 0 leaves colors of vertices; too few texels are named. */
TEST sizes_of_images_are_heeded(void)
{
    static const struct {
        int status;
        const char *texture, *word;
    } cases[] = {{0, "0", ""}, {1, "16", "textured.glb: --texture 16: too few texels"}};
    char path[512], error[SCENE_TEXT];
    snprintf(path, sizeof path, "%s", scratch("textured.glb")); /* of the test before */
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        struct scene scene;
        const char *const more[] = {"--grid", "24", "--out", scratch("mended.glb"), "--quiet", "--texture", cases[i].texture, NULL};
        ASSERT_EQm(cases[i].texture, cases[i].status, run_mend(path, more));
        ASSERTm(printed("stderr"), strstr(printed("stderr"), cases[i].word) && (*cases[i].word || !*printed("stderr")));
        if (cases[i].status != 0) continue;
        ASSERT(scene_read(more[3], SCENE_ALL, &scene, error));
        ASSERT_EQ(0, scene.picture_count);
        ASSERT(scene.parts[0].colors);
        scene_free(&scene);
    }
    PASS();
}

/* Writes a grey tetrahedron as GLB with a white image, or a broken one. */
static bool write_grey(const char *path, bool broken)
{
    static const float positions[12] = {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f}, uvs[8];
    static const int triangles[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    static unsigned char bad[] = "\x89PNG, and no more";
    float colors[12];
    struct image white;
    struct picture picture = {.bytes = bad, .size = sizeof bad};
    struct material material = material_plain();
    for (int i = 0; i < 12; ++i) colors[i] = 0.5f;
    material.image = 0;
    if (!broken) {
        if (!image_create(&white, 4, 4, color_rgb(1.0f, 1.0f, 1.0f)) || !image_encode_png(&white, &picture.bytes, &picture.size))
            return false;
        image_free(&white);
    }
    const struct gltf_mesh mesh = {.positions = positions,
                                   .normals = positions,
                                   .uvs = uvs,
                                   .colors = colors,
                                   .triangles = triangles,
                                   .vertex_count = 4,
                                   .triangle_count = 4};
    const struct gltf_look look = {&material, &picture, 1, 1};
    const bool fine = gltf_write_mesh(path, &mesh, &look);
    if (!broken) free(picture.bytes);
    return fine;
}

/* A broken image is named, though there is no other, and so is an option without effect; colors of glTF are linear whatever the file's
   name. */
TEST looks_are_read_by_what_is_in_the_file(void)
{
    char path[512];
    struct facts facts;
    snprintf(path, sizeof path, "%s", scratch("grey.model"));
    for (int broken = 0; broken < 2; ++broken) {
        const char *const more[] = {"--grid", "24", "--out", scratch("mended.ply"), "--quiet", "--texture", "64", NULL};
        ASSERT(write_grey(path, broken));
        ASSERT_EQ(0, run_mend(path, more));
        ASSERTm(printed("stderr"), broken == (strstr(printed("stderr"), "1 image cannot be read") != NULL));
        ASSERT(strstr(printed("stderr"), "--texture has no effect: only GLB"));
        ASSERT(read_facts(more[3], &facts) && facts.mesh.colors);
        if (!broken) ASSERT_IN_RANGE(0.5, (double)facts.mesh.colors[0], 0.005);
        mesh_free(&facts.mesh);
    }
    PASS();
}

/* Fewer triangles, by number and by tolerance: closed, without crossings, of one part and one hole, the volume to 1.8 %. */
TEST triangles_are_as_many_as_asked_for(void)
{
    const double volume = 2.0 * PI * PI * 0.45 * 0.45;
    struct damaged m;
    char path[512];
    make_ring(&ring);
    snprintf(path, sizeof path, "%s", scratch("ring.ply"));
    ASSERT(damage_begin(&m, ring.positions, ROUND * ACROSS, ring.indices, 2 * ROUND * ACROSS, 7u) && write_damaged(path, &m, m.positions));
    damage_end(&m);
    for (int i = 0; i < 2; ++i) {
        struct facts facts;
        const char *const more[] = {"--grid", "64", "--out", scratch("thin.ply"), i ? "--tolerance" : "--triangles", i ? "0.1" : "2000",
                                    NULL};
        ASSERT_EQ(0, run_mend(path, more));
        ASSERT(read_facts(more[3], &facts));
        ASSERT(facts.mesh.triangle_count < 9000 && (i || facts.mesh.triangle_count <= 2000));
        for (size_t v = 0; v < facts.mesh.vertex_count; ++v) { /* colors, which are places above 0, belong to their vertices */
            ASSERT_IN_RANGE((double)fmaxf(0.0f, fminf(1.0f, facts.mesh.positions[3 * v])), (double)facts.mesh.colors[3 * v], 0.03);
        }
        mesh_free(&facts.mesh);
        ASSERT_EQ(0, facts.check.open_edges);
        ASSERT_EQ(0, facts.check.intersections);
        ASSERT_EQ(1, facts.check.components);
        ASSERT_EQ(0, facts.check.euler);
        ASSERT_IN_RANGE(volume, facts.volume, 0.018 * volume);
    }
    PASS();
}

/* A sheet beside the ring bounds nothing: a warning, and exit status 3 with --strict. */
TEST what_is_lost_is_named(void)
{
    const float sheet[12] = {2.0f, -2.0f, -1.0f, 2.0f, 2.0f, -1.0f, 2.0f, 2.0f, 1.0f, 2.0f, -2.0f, 1.0f};
    const uint32_t faces[6] = {0, 1, 2, 0, 2, 3};
    struct damaged m;
    char path[512];
    make_ring(&ring);
    snprintf(path, sizeof path, "%s", scratch("sheet.ply"));
    ASSERT(damage_begin(&m, ring.positions, ROUND * ACROSS, ring.indices, 2 * ROUND * ACROSS, 7u) && damage_room(&m, 4, 2));
    memcpy(m.positions + 3 * m.vertex_count, sheet, sizeof sheet);
    for (int i = 0; i < 6; ++i) m.indices[3 * m.triangle_count + (size_t)i] = (uint32_t)m.vertex_count + faces[i];
    m.vertex_count += 4;
    m.triangle_count += 2;
    ASSERT(write_damaged(path, &m, NULL));
    damage_end(&m);
    const char *const strict[] = {"--grid", "48", "--out", scratch("kept.ply"), "--quiet", "--strict", NULL};
    ASSERT_EQ(3, run_mend(path, strict));
    ASSERT(strstr(printed("stderr"), "try a larger --opening"));
    const char *const lax[] = {"--grid", "48", "--out", scratch("kept.ply"), "--quiet", NULL};
    ASSERT_EQ(0, run_mend(path, lax));
    PASS();
}

/* A wavy sheet, open on all sides, and the ring so small that floats have no areas: one line says what is wrong. */
TEST what_has_no_solid_is_refused(void)
{
    struct damaged m;
    char sheet[512], tiny[512];
    size_t count = 0;
    make_ring(&ring);
    snprintf(sheet, sizeof sheet, "%s", scratch("sheet.ply"));
    snprintf(tiny, sizeof tiny, "%s", scratch("tiny.ply"));
    ASSERT(damage_begin(&m, ring.positions, ROUND * ACROSS, ring.indices, 2 * ROUND * ACROSS, 7u));
    for (int i = 0; i < ROUND * ACROSS; ++i) {
        const double x = 2.0 * (i / ACROSS) / ROUND, y = 1.0 * (i % ACROSS) / ACROSS;
        m.positions[3 * i] = (float)x;
        m.positions[3 * i + 1] = (float)y;
        m.positions[3 * i + 2] = (float)(0.1 * sin(6.0 * x) * cos(6.0 * y));
    }
    for (size_t t = 0; t < m.triangle_count; ++t) {
        const uint32_t *corners = m.indices + 3 * t;
        const bool within = t / 2 % ACROSS < ACROSS - 1 && t / 2 / ACROSS < ROUND - 1;
        if (within) memmove(m.indices + 3 * count++, corners, 3 * sizeof *corners);
    }
    m.triangle_count = count;
    ASSERT(write_damaged(sheet, &m, NULL));
    damage_end(&m);
    const char *const quiet[] = {"--grid", "48", "--quiet", NULL};
    ASSERT_EQ(1, run_mend(sheet, quiet));
    ASSERT(strstr(printed("stderr"), "an open sheet"));
    for (int i = 0; i < 3 * ROUND * ACROSS; ++i) ring.positions[i] *= 1e-15f;
    ASSERT(damage_begin(&m, ring.positions, ROUND * ACROSS, ring.indices, 2 * ROUND * ACROSS, 7u));
    ASSERT(write_damaged(tiny, &m, NULL));
    damage_end(&m);
    ASSERT_EQ(1, run_mend(tiny, quiet));
    ASSERT(strstr(printed("stderr"), "no triangle has an area that floats hold"));
    PASS();
}

/* The ring at coordinates of a national grid, in which floats have steps of half a unit: read and written in double precision. */
TEST distant_meshes_keep_their_digits(void)
{
    static const char *const names[2] = {"utm.ply", "utm.obj"}, *const results[3] = {"there.ply", "there.obj", "there.stl"};
    const double origin[3] = {482316.25, 5433218.5, 271.0}, volume = 2.0 * PI * PI * 0.45 * 0.45;
    char error[MESH_TEXT], path[512];
    make_ring(&ring);
    const struct mesh_arrays arrays = {.positions = ring.positions,
                                       .vertex_count = ROUND * ACROSS,
                                       .indices = ring.indices,
                                       .triangle_count = 2 * ROUND * ACROSS,
                                       .origin = origin};
    for (int i = 0; i < 3; ++i) {
        struct mesh mesh;
        double moved[3];
        float worst = 0.0f;
        snprintf(path, sizeof path, "%s", scratch(names[i % 2]));
        ASSERT(mesh_write(path, &arrays, error));
        const char *const more[] = {"--grid", "48", "--out", scratch(results[i]), "--quiet", NULL};
        ASSERT_EQ(0, run_mend(path, more));
        ASSERT_EQ(i == 2, strstr(printed("stderr"), "STL has floats only") != NULL);
        if (i == 2) continue;
        ASSERT(mesh_read_local(more[3], &mesh, moved, error));
        ASSERT_EQ(5433218.0, moved[1]);
        ASSERT_IN_RANGE(volume, mesh_volume(mesh.positions, (const int *)mesh.indices, (int)mesh.triangle_count), 0.015 * volume);
        for (size_t v = 0; v < mesh.vertex_count; ++v) { /* on the ring, to a twentieth of a voxel of .077 */
            const double x = (double)mesh.positions[3 * v] + moved[0] - origin[0],
                         y = (double)mesh.positions[3 * v + 1] + moved[1] - origin[1];
            const double z = (double)mesh.positions[3 * v + 2] + moved[2] - origin[2];
            worst = fmaxf(worst, (float)fabs(hypot(hypot(x, y) - 1.0, z) - 0.45));
        }
        mesh_free(&mesh);
        ASSERT_IN_RANGE(0.0, (double)worst, 0.01);
    }
    PASS();
}

/* Writes a prism whose ends are an angle with a corner in a line, of area 1.36 and length 2. In the text, @ stands for its vertices, each
 * behind `before`, and $ for its faces, each behind `behind`; base: number of the first vertex. */
static bool write_prism(const char *path, const char *text, const char *before, const char *behind, int base, const char *end)
{
    FILE *file = fopen(path, "wb");
    for (; file && *text; ++text) {
        if (*text == '@') {
            for (int i = 0; i < 14; ++i) {
                const double x[7] = {3.0, 3.0, 1.0, 0.2, 0.2, 0.0, 0.0}, y[7] = {0.0, 0.2, 0.2, 0.2, 4.0, 4.0, 0.0};
                fprintf(file, "%s%g %g %d%s", before, x[i % 7], y[i % 7], i < 7 ? 0 : 2, end);
            }
        } else if (*text == '$') {
            fprintf(file, "%s", behind);
            for (int i = 6; i >= 0; --i) fprintf(file, " %d", base + i);
            fprintf(file, "%s%s", end, behind);
            for (int i = 0; i < 7; ++i) fprintf(file, " %d", base + 7 + i);
            for (int i = 0; i < 7; ++i) {
                fprintf(file, "%s%s %d %d %d %d", end, *behind == '7' ? "4" : behind, base + i, base + (i + 1) % 7, base + 7 + (i + 1) % 7,
                        base + 7 + i);
            }
            fprintf(file, "%s", end);
        } else {
            fputc(*text, file);
        }
    }
    return file && fclose(file) == 0;
}

/* Nothing is lost of two rings through each other, whose volumes overlap, and of a rod of two thirds of a voxel, of which phi has a
 * part. */
TEST what_is_whole_gives_no_warning(void)
{
    const float rod[24] = {0, 0, 0, 57, 0, 0, 57, 1, 0, 0, 1, 0, 0, 0, 1, 57, 0, 1, 57, 1, 1, 0, 1, 1};
    const uint32_t sides[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
    const char *const more[] = {"--grid", "48", "--out", scratch("whole-solid.ply"), "--quiet", "--strict", NULL};
    const size_t vertices = ROUND * ACROSS, triangles = 2 * vertices;
    struct damaged m;
    char error[MESH_TEXT], path[512];
    snprintf(path, sizeof path, "%s", scratch("whole.ply"));
    make_ring(&ring);
    ASSERT(damage_begin(&m, ring.positions, vertices, ring.indices, triangles, 7u) && damage_room(&m, vertices, triangles));
    for (size_t i = 0; i < 3 * vertices; ++i) m.positions[3 * vertices + i] = ring.positions[i] + (i % 3 == 0 ? 0.4f : 0.0f);
    for (size_t i = 0; i < 3 * triangles; ++i) m.indices[3 * triangles + i] = ring.indices[i] + (uint32_t)vertices;
    m.vertex_count *= 2;
    m.triangle_count *= 2;
    ASSERT(write_damaged(path, &m, NULL));
    damage_end(&m);
    ASSERT_EQ(0, run_mend(path, more));
    const struct mesh_arrays arrays = {.positions = rod, .vertex_count = 8, .indices = sides, .triangle_count = 12};
    ASSERT(mesh_write(path, &arrays, error));
    ASSERT_EQ(0, run_mend(path, more));
    PASS();
}

/* Files that not every reader takes: each is the prism. */
TEST odd_files_are_read(void)
{
    static const struct {
        const char *name, *text, *before, *behind, *end;
        int base;
    } files[] = {
        {"plain.obj", "@$", "v ", "f", "\n", 1},
        {"mark.obj", "\xEF\xBB\xBF@$", "v ", "f", "\n", 1},
        {"blanks.obj", "# blanks\r\n@o a\r\n$", " \tv\t", "  f ", " \t\r\n", 1},
        {"below.obj", "@$", "v ", "f", "\n", -14},
        {"broken.obj", "@$", "v \\\n ", "f \\\n", "\n", 1},
        {"empty.obj", "@$", "v ", "f", "\\\n\n", 1},
        {"remarks.obj", "@$", "v ", "f", " # 1\n", -14},
        {"curves.obj", "cstype bezier\ndeg 3\n@vp 1 2\ncurv 0 1 1 2 3 4\nend\nl 1 2\np 3\n$", "v ", "f", " \n", 1},
        {"faces.ply",
         "ply\nformat ascii 1.0\nelement face 9\nproperty list uint16 uint vertex_index\nelement vertex 14\nproperty float x\n"
         "property float y\nproperty float z\nend_header\n$@",
         "", "7", "\n", 0},
        {"between.ply",
         "ply\nformat ascii 1.0\ncomment\nobj_info a b\nelement vertex 14\nproperty double x\nproperty double y\nproperty double z\n"
         "element other 2\nproperty list uchar double any\nelement face 9\nproperty list short int vertex_indices\nend_header\n"
         "@0\n2 5 6\n$",
         "", "7", "\n", 0},
        {"old.ply",
         "ply\rformat ascii 1.0\relement vertex 14\rproperty float x\rproperty float y\rproperty float z\relement face 9\r"
         "property list uchar int vertex_indices\rend_header\r@$",
         "", "7", "\r", 0},
    };
    for (size_t i = 0; i < sizeof files / sizeof *files; ++i) {
        struct mesh mesh;
        double origin[3];
        char error[MESH_TEXT] = "";
        const char *path = scratch(files[i].name);
        ASSERT(write_prism(path, files[i].text, files[i].before, files[i].behind, files[i].base, files[i].end));
        ASSERTm(error, mesh_read_local(path, &mesh, origin, error));
        ASSERT_EQm(files[i].name, 14, mesh.vertex_count);
        ASSERT_EQm(files[i].name, 24, mesh.triangle_count);
        ASSERT_IN_RANGEm(files[i].name, 2.72, mesh_volume(mesh.positions, (const int *)mesh.indices, 24), 1e-5);
        double area = 0.0;
        for (int t = 0; t < 24; ++t) {
            const uint32_t *c = mesh.indices + 3 * t;
            area += vec3_triangle_area(mesh.positions + 3 * c[0], mesh.positions + 3 * c[1], mesh.positions + 3 * c[2]);
        }
        ASSERT_IN_RANGEm(files[i].name, 2.0 * 1.36 + 2.0 * 14.0, area, 1e-4); /* no triangle lies outside, no other turned against it */
        mesh_free(&mesh);
    }
    PASS();
}

/* Writes a drum of `sides` sides, of radius 10 and height 5, about (place place place): after a mark and a long comment, its ends in lines
 * that go on; `bad` stands for the x of the first corner of the lower end, NULL: what it is. A last triangle has `bad_last` in a corner. */
static bool write_drum(const char *path, int sides, double place, const char *bad, const char *bad_last)
{
    FILE *file = fopen(path, "wb");
    if (!file) {
        return false;
    }
    fprintf(file, "\xEF\xBB\xBF# %09999d\n", 0);
    for (int i = 0; i < 2 * sides; ++i) {
        const double a = 2.0 * PI * (i % sides) / sides, y = place + 10.0 * sin(a), z = place + (i < sides ? 0.0 : 5.0);
        if (i == 0 && bad) {
            fprintf(file, "v %s %.9f %.9f\n", bad, y, z);
        } else {
            fprintf(file, "v %.9f %.9f %.9f\n", place + 10.0 * cos(a), y, z);
        }
    }
    for (int end = 0; end < 2; ++end) {
        fprintf(file, "f");
        for (int i = 0; i < sides; ++i) fprintf(file, " \\\n %d/1/1", end == 0 ? sides - i : sides + 1 + i);
        fprintf(file, "\n");
    }
    for (int i = 0; i < sides; ++i) {
        const int j = (i + 1) % sides;
        fprintf(file, "f %d %d %d %d\n", i + 1, j + 1, sides + j + 1, sides + i + 1);
    }
    if (bad_last) {
        fprintf(file, "v 0 0 %s\nf 1 2 -1\n", bad_last);
    }
    return fclose(file) == 0;
}

/* Faces of any number of corners in lines of any length; a corner that is not finite takes one triangle from each of its faces, near the
 * origin and far from it. */
TEST large_faces_lose_bad_corners_alone(void)
{
    static const struct {
        int sides;
        double place;
        const char *bad, *bad_last;
        size_t lost;
    } drums[] = {{257, 0.0, NULL, NULL, 0},   {1000, 0.0, NULL, NULL, 0},    {1000, 5e6, NULL, NULL, 0}, {200, 5e6, NULL, "nan", 1},
                 {200, 0.0, NULL, "-inf", 1}, {200, 0.0, NULL, "3.5e38", 1}, {200, 0.0, "nan", NULL, 3}, {200, 5e6, "1e308", NULL, 3}};
    struct mesh mesh;
    double origin[3];
    char error[MESH_TEXT] = "";
    for (size_t i = 0; i < sizeof drums / sizeof *drums; ++i) {
        const size_t sides = (size_t)drums[i].sides, triangles = 4 * sides - 4 - (drums[i].bad ? 3 : 0);
        ASSERT(write_drum(scratch("drum.obj"), drums[i].sides, drums[i].place, drums[i].bad, drums[i].bad_last));
        ASSERTm(error, mesh_read_local(scratch("drum.obj"), &mesh, origin, error));
        ASSERT_EQ_FMT(triangles, mesh.triangle_count, "%zu");
        ASSERT_EQ(drums[i].lost, mesh.not_finite);
        ASSERT_EQ(2 * sides - (drums[i].bad ? 1 : 0), mesh.vertex_count);
        ASSERT_EQ(drums[i].place > 0.0, origin[0] > 0.0);
        double area = 0.0;
        for (size_t t = 0; t < triangles; ++t) {
            const uint32_t *c = mesh.indices + 3 * t;
            area += vec3_triangle_area(mesh.positions + 3 * c[0], mesh.positions + 3 * c[1], mesh.positions + 3 * c[2]);
        }
        const double angle = 2.0 * PI / drums[i].sides, side = 2.0 * 10.0 * sin(0.5 * angle), n = drums[i].sides;
        const double lost = drums[i].bad ? 100.0 * sin(angle) * (1.0 - cos(angle)) + 5.0 * side : 0.0; /* an ear, halves of two walls */
        ASSERT_IN_RANGE(n * (100.0 * sin(angle) + 5.0 * side) - lost, area, 1e-2);
        mesh_free(&mesh);
    }
    PASS();
}

TEST distant_degenerate_triangles_are_named(void)
{
    struct mesh mesh;
    double origin[3];
    char error[MESH_TEXT] = "";
    FILE *file = fopen(scratch("lines.obj"), "wb");
    ASSERT(file && fputs("v 5000000 0 0\nv 5000001 0 0\nf 1 2 2\nf 1 1 2\n", file) >= 0 && fclose(file) == 0);
    ASSERT_FALSE(mesh_read_local(scratch("lines.obj"), &mesh, origin, error));
    ASSERTm(error, strstr(error, "degenerate") != NULL);
    PASS();
}

static void put_little_endian(unsigned char *at, uint32_t bits)
{
    for (int i = 0; i < 4; ++i) {
        at[i] = (unsigned char)(bits >> 8 * i);
    }
}

/* Binary STL of one triangle with any count and rest; capitals; corners that are not finite. */
TEST odd_triangles_are_read_or_named(void)
{
    static const struct {
        uint32_t count;
        size_t rest;
        const char *first, *problem;
    } files[] = {{1, 0, "solid by name", NULL}, {1, 7, "by name", NULL},          {0, 0, "by name", NULL},
                 {1, 7, "solid by name", NULL}, {0, 0, "solid by name", NULL},    {UINT32_MAX, 0, "stream", NULL},
                 {2, 0, "by name", "promises 2"}, {2, 0, "solid by name", "promises 2"}};
    static const char *const names[] = {"vertex", "vertex_1", "facet"};
    struct mesh mesh;
    double origin[3];
    char error[MESH_TEXT] = "";
    for (size_t i = 0; i < sizeof files / sizeof *files; ++i) {
        unsigned char bytes[84 + 50 + 7] = {0};
        const float one = 1.0f;
        uint32_t bits;
        memcpy(&bits, &one, sizeof bits);
        memset(bytes, ' ', 80);
        memcpy(bytes, files[i].first, strlen(files[i].first));
        put_little_endian(bytes + 80, files[i].count);
        put_little_endian(bytes + 84 + 24, bits); /* (0 0 0), (1 0 0), (0 1 0) */
        put_little_endian(bytes + 84 + 40, bits);
        FILE *file = fopen(scratch("odd.stl"), "wb");
        ASSERT(file && fwrite(bytes, 1, 134 + files[i].rest, file) == 134 + files[i].rest && fclose(file) == 0);
        const bool read = mesh_read_local(scratch("odd.stl"), &mesh, origin, error);
        ASSERT_EQm(error, !files[i].problem, read);
        if (read) {
            ASSERT_EQ(1, mesh.triangle_count);
            mesh_free(&mesh);
        } else {
            ASSERTm(error, strstr(error, files[i].problem) != NULL);
        }
    }
    FILE *file = fopen(scratch("odd.stl"), "wb");
    ASSERT(file);
    for (int i = 0; i < 3; ++i) {
        fprintf(file, "SOLID %s\n FACET NORMAL 0 0 1\n OUTER LOOP\n VERTEX %s 0 %d\n VERTEX 1 0 %d\n VERTEX 0 1 %d\n ENDLOOP\n "
                      "ENDFACET\nENDSOLID %s\n", names[i], i == 1 ? "NaN" : "0", i, i, i, names[i]);
    }
    ASSERT(fclose(file) == 0 && mesh_read_local(scratch("odd.stl"), &mesh, origin, error));
    ASSERT_EQ(2, mesh.triangle_count);
    ASSERT_EQ(1, mesh.not_finite);
    ASSERT_EQ(6, mesh.vertex_count);
    mesh_free(&mesh);
    file = fopen(scratch("odd.stl"), "wb");
    ASSERT(file && fputs("solid nothing\nendsolid nothing\n", file) >= 0 && fclose(file) == 0);
    ASSERT_FALSE(mesh_read_local(scratch("odd.stl"), &mesh, origin, error));
    ASSERTm(error, strstr(error, "no triangles") != NULL);
    PASS();
}

TEST bad_arguments_are_refused_in_one_line(void)
{
    static const struct {
        int status;
        const char *word, *more[4];
    } cases[] = {{2, "--opening", {"--opening", "0", NULL}},
                 {2, "--cavities", {"--cavities", "some", NULL}},
                 {2, "--out", {"--out", "solid.txt", NULL}},
                 {2, "--grid", {"--grid", "7", NULL}},
                 {2, "--triangles", {"--triangles", "3", NULL}},
                 {2, "--tolerance", {"--tolerance", "0", NULL}},
                 {1, "nowhere.ply", {NULL}}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        ASSERT_EQm(cases[i].word, cases[i].status, run_mend("/nowhere.ply", cases[i].more));
        const char *text = printed("stderr");
        ASSERTm(text, strstr(text, cases[i].word) != NULL);
        ASSERTm(text, strncmp(text, "mend: ", 6) == 0 && strchr(text, '\n') == text + strlen(text) - 1);
    }
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(damage_is_mended);
    RUN_TEST(punctured_shells_are_filled_or_named);
    RUN_TEST(edges_stay_sharp);
    RUN_TEST(crossings_are_counted_and_marked);
    RUN_TEST(crossings_are_taken_apart);
    RUN_TEST(cracks_of_rough_surfaces_are_joined);
    RUN_TEST(borders_are_joined_by_their_own_lengths);
    RUN_TEST(hollows_go_or_stay);
    RUN_TEST(little_parts_and_hollows_are_no_specks);
    RUN_TEST(slivers_go_where_others_cross);
    RUN_TEST(colors_come_along);
    RUN_TEST(images_come_along);
    RUN_TEST(sizes_of_images_are_heeded);
    RUN_TEST(looks_are_read_by_what_is_in_the_file);
    RUN_TEST(triangles_are_as_many_as_asked_for);
    RUN_TEST(what_is_lost_is_named);
    RUN_TEST(what_has_no_solid_is_refused);
    RUN_TEST(distant_meshes_keep_their_digits);
    RUN_TEST(what_is_whole_gives_no_warning);
    RUN_TEST(odd_files_are_read);
    RUN_TEST(large_faces_lose_bad_corners_alone);
    RUN_TEST(distant_degenerate_triangles_are_named);
    RUN_TEST(odd_triangles_are_read_or_named);
    RUN_TEST(bad_arguments_are_refused_in_one_line);
    if (!remove_folder()) return 1;
    GREATEST_MAIN_END();
}

#endif
