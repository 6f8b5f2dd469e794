/* test_csg.c - examples/csg.c as it is run: solids whose combinations are known, read back from the files that it writes; what it
   refuses, in one line. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_csg_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_csg_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#define main csg_main
#include "../../examples/csg.c"
#undef main

#include "base/vec3.h"
#include "gltf_problems.h"
#include "json_report.h"
#include "run_program.h"
#include "surface/mesh_check.h"

#include <sys/stat.h>

#define PI 3.14159265358979

/* ---- running ---- */

/* Returns the program's status; what it prints goes into files. The last argument is NULL. */
static int run_csg(const char *operation, const char *first, const char *second, const char *const *more)
{
    const char *const arguments[] = {"csg", operation, first, second, NULL};
    return run_program(csg_main, arguments, more);
}

/* Runs and expects a failure: this status, and one line with `word` in it. */
static greatest_test_res refused(int status, const char *word, const char *operation, const char *first, const char *second,
                                 const char *const *more)
{
    ASSERT_EQ(status, run_csg(operation, first, second, more));
    const char *text = printed("stderr");
    ASSERTm(text, strstr(text, word) != NULL);
    ASSERTm(text, strncmp(text, "csg: ", 5) == 0 && strchr(text, '\n') == text + strlen(text) - 1);
    PASS();
}

static bool is_there(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0;
}

/* ---- meshes ---- */

struct solid_facts {
    double volume;
    int components, euler, open_edges;
    size_t triangles;
    bool colored;
};

static struct solid_facts facts_of(const char *path)
{
    struct solid_facts facts = {0};
    struct mesh_check check = {0};
    struct mesh mesh;
    char error[MESH_TEXT];
    if (!mesh_read(path, &mesh, error)) return facts;
    for (size_t t = 0; t < mesh.triangle_count; ++t) {
        float cross[3];
        const float *p[3];
        for (int k = 0; k < 3; ++k) p[k] = mesh.positions + 3 * (size_t)mesh.indices[3 * t + (size_t)k];
        vec3_cross(p[1], p[2], cross);
        facts.volume += (double)vec3_dot(p[0], cross) / 6.0;
    }
    if (mesh_check(mesh.positions, (int)mesh.vertex_count, (const int *)mesh.indices, (int)mesh.triangle_count, &check)) {
        facts.components = check.components;
        facts.euler = check.euler;
        facts.open_edges = check.open_edges;
    }
    facts.triangles = mesh.triangle_count;
    facts.colored = mesh.colors != NULL;
    mesh_free(&mesh);
    return facts;
}

/* Writes a block of this size with its lowest corner at `at`, in one color. */
static void put_block(const float at[3], const float size[3], uint32_t number, float corners[24], uint32_t faces[36])
{
    static const uint32_t face[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                      2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    for (int i = 0; i < 24; ++i) corners[i] = at[i % 3] + (i / 3 >> i % 3 & 1 ? size[i % 3] : 0.0f);
    for (int i = 0; i < 36; ++i) faces[i] = face[i] + 8 * number;
}

static bool write_block(const char *path, const float at[3], const float size[3], const float color[3])
{
    uint32_t faces[36];
    float corners[24], colors[24];
    char error[MESH_TEXT];
    put_block(at, size, 0, corners, faces);
    for (int i = 0; i < 24; ++i) colors[i] = color ? color[i % 3] : 0.0f;
    const struct mesh_arrays block = {
        .positions = corners, .vertex_count = 8, .indices = faces, .triangle_count = 12, .colors = color ? colors : NULL};
    return mesh_write(path, &block, error);
}

static bool write_two_blocks(const char *path, const float at[3], const float size[3], const float other[3], const float its_size[3])
{
    uint32_t faces[72];
    float corners[48];
    char error[MESH_TEXT];
    put_block(at, size, 0, corners, faces);
    put_block(other, its_size, 1, corners + 24, faces + 36);
    const struct mesh_arrays blocks = {.positions = corners, .vertex_count = 16, .indices = faces, .triangle_count = 24};
    return mesh_write(path, &blocks, error);
}

/* Writes a ring around z: radius 2, thickness 1.4. */
static bool write_ring(const char *path)
{
    enum { ROUND = 48, ACROSS = 24 };
    static float places[3 * ROUND * ACROSS];
    static uint32_t faces[6 * ROUND * ACROSS];
    char error[MESH_TEXT];
    uint32_t *f = faces;
    for (uint32_t i = 0; i < ROUND; ++i) {
        for (uint32_t j = 0; j < ACROSS; ++j) {
            const double u = 2.0 * PI * i / ROUND, v = 2.0 * PI * j / ACROSS, r = 2.0 + 0.7 * cos(v);
            const uint32_t ni = (i + 1) % ROUND, nj = (j + 1) % ACROSS;
            const uint32_t quad[6] = {i * ACROSS + j, ni * ACROSS + j, ni * ACROSS + nj,
                                      i * ACROSS + j, ni * ACROSS + nj, i * ACROSS + nj};
            const float place[3] = {(float)(r * cos(u)), (float)(r * sin(u)), (float)(0.7 * sin(v))};
            memcpy(places + 3 * (i * ACROSS + j), place, sizeof place);
            memcpy(f, quad, sizeof quad);
            f += 6;
        }
    }
    const struct mesh_arrays ring = {
        .positions = places, .vertex_count = ROUND * ACROSS, .indices = faces, .triangle_count = 2 * ROUND * ACROSS};
    return mesh_write(path, &ring, error);
}

static const float red[3] = {1.0f, 0.0f, 0.0f}, blue[3] = {0.0f, 0.0f, 1.0f};

/* ---- tests ---- */

/* Two cubes of side 2 that share a corner of side 1, by every operation, in each of the formats. */
TEST cubes_have_the_volumes_of_arithmetic(void)
{
    static const struct {
        const char *operation, *result;
        double volume;
        bool colored;
    } cases[] = {{"union", "cubes.ply", 15.0, true}, {"intersection", "cubes.obj", 1.0, true},
                 {"difference", "cubes.stl", 7.0, false}, {"union", "cubes.glb", 15.0, true}};
    const float zero[3] = {0.0f, 0.0f, 0.0f}, one[3] = {1.0f, 1.0f, 1.0f}, two[3] = {2.0f, 2.0f, 2.0f};
    char first[512], second[512];
    snprintf(first, sizeof first, "%s", scratch("first.ply"));
    snprintf(second, sizeof second, "%s", scratch("second.obj"));
    ASSERT(write_block(first, zero, two, red) && write_block(second, one, two, blue));
    for (int c = 0; c < 4; ++c) {
        const char *const more[] = {"--grid", "48", "--result", scratch(cases[c].result), "--quiet", NULL};
        ASSERT_EQm(cases[c].result, CLI_EXIT_OK, run_csg(cases[c].operation, first, second, more));
        const struct solid_facts facts = facts_of(more[3]);
        ASSERT_IN_RANGE(cases[c].volume, facts.volume, 0.001 * cases[c].volume); /* edges are kept */
        ASSERT_EQ(1, facts.components);
        ASSERT_EQ(2, facts.euler);
        ASSERT_EQ(0, facts.open_edges);
        ASSERT_EQ(cases[c].colored, facts.colored);
    }
    ASSERT(gltf_problems(scratch("cubes.glb")) <= 0);
    PASS();
}

/* A ring keeps its hole, a block through it closes it, a ball that is drilled gets one, a shell has two surfaces. */
TEST holes_shells_and_parts_are_counted(void)
{
    const double ring = 2.0 * PI * PI * 2.0 * 0.49 * 0.98582; /* of polygons: n / 2 pi sin(2 pi / n) for 24 and 48 sides */
    const struct {
        const char *operation, *first, *second;
        double volume;
        int components, euler;
    } cases[] = {
        {"remesh", "ring.stl", NULL, ring, 1, 0},
        {"union", "ring.stl", "ball:0,0,0,1.6", ring + 15.243, 1, 2},
        {"difference", "ball:0,0,0,1", "bar.ply", 4.0 / 3.0 * PI - 0.698, 1, 0},
        {"difference", "ball:0,0,0,1", "ball:0,0,0,0.5", 7.0 / 6.0 * PI, 2, 4},
        {"union", "ball:0,0,0,1", "ball:3,0,0,1", 8.0 / 3.0 * PI, 2, 4},
        {"difference", "ball:0,0,0,1", "ball:3,0,0,1", 4.0 / 3.0 * PI, 1, 2},
        {"offset", "ball:0,0,0,1", NULL, 4.0 / 3.0 * PI * 1.728, 1, 2},
    };
    const float corner[3] = {-0.3f, -0.3f, -2.0f}, size[3] = {0.6f, 0.6f, 4.0f};
    ASSERT(write_ring(scratch("ring.stl")) && write_block(scratch("bar.ply"), corner, size, NULL));
    for (size_t c = 0; c < sizeof cases / sizeof *cases; ++c) {
        const char *const b = cases[c].second;
        char first[512], second[512] = "";
        const bool grows = strcmp(cases[c].operation, "offset") == 0;
        const char *const more[] = {"--grid", "48", "--result", scratch("part.ply"), "--quiet", grows ? "--amount" : NULL, "0.2", NULL};
        snprintf(first, sizeof first, "%s", strchr(cases[c].first, ':') ? cases[c].first : scratch(cases[c].first));
        if (b) snprintf(second, sizeof second, "%s", strchr(b, ':') ? b : scratch(b));
        ASSERT_EQm(cases[c].operation, CLI_EXIT_OK, run_csg(cases[c].operation, first, b ? second : NULL, more));
        const struct solid_facts facts = facts_of(more[3]);
        ASSERT_IN_RANGE(cases[c].volume, facts.volume, 0.01 * cases[c].volume);
        ASSERT_EQm(cases[c].operation, cases[c].components, facts.components);
        ASSERT_EQm(cases[c].operation, cases[c].euler, facts.euler);
        ASSERT_EQ(0, facts.open_edges);
    }
    PASS();
}

/* A block with a floor half a voxel thin below it loses the floor: a warning, and exit status 3 with --strict. Where a part lies inside
 * another nothing is lost. */
TEST what_is_lost_is_named(void)
{
    const float zero[3] = {0.0f, 0.0f, 0.0f}, one[3] = {1.0f, 1.0f, 1.0f}, below[3] = {0.0f, 0.0f, -0.5f}, flat[3] = {1.0f, 1.0f, 0.01f};
    const float inner[3] = {0.4f, 0.4f, 0.4f}, small[3] = {0.2f, 0.2f, 0.2f};
    char lossy[512], fine[512], kept[512];
    snprintf(kept, sizeof kept, "%s", scratch("kept.ply"));
    snprintf(lossy, sizeof lossy, "%s", scratch("lossy.obj"));
    snprintf(fine, sizeof fine, "%s", scratch("fine.obj"));
    ASSERT(write_two_blocks(lossy, zero, one, below, flat) && write_two_blocks(fine, zero, one, inner, small));
    const char *const strict[] = {"--grid", "48", "--result", kept, "--quiet", "--strict", NULL};
    const char *const lax[] = {"--grid", "48", "--result", kept, "--quiet", NULL};
    ASSERT_EQ(3, run_csg("remesh", lossy, NULL, strict));
    ASSERT(strstr(printed("stderr"), "try a finer --grid"));
    ASSERT(is_there(kept));
    ASSERT_EQ(CLI_EXIT_OK, run_csg("remesh", lossy, NULL, lax));
    ASSERT_EQ(CLI_EXIT_OK, run_csg("remesh", fine, NULL, strict));
    PASS();
}

/* The same file twice: A or A, A and A are A; A without A is nothing. A result may replace its own input. */
TEST a_file_with_itself(void)
{
    const float zero[3] = {0.0f, 0.0f, 0.0f}, two[3] = {2.0f, 2.0f, 2.0f};
    char self[512];
    snprintf(self, sizeof self, "%s", scratch("self.ply"));
    ASSERT(write_block(self, zero, two, blue));
    const char *const more[] = {"--grid", "32", "--result", scratch("twice.ply"), "--quiet", NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_csg("union", self, self, more));
    ASSERT_IN_RANGE(8.0, facts_of(more[3]).volume, 0.1);
    ASSERT_EQ(2, facts_of(more[3]).euler);
    ASSERT_EQ(CLI_EXIT_OK, run_csg("intersection", self, self, more));
    ASSERT_IN_RANGE(8.0, facts_of(more[3]).volume, 0.1);
    remove(more[3]);
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "nothing is left", "difference", self, self, more));
    ASSERT_FALSE(is_there(more[3]));
    const char *const replace[] = {"--grid", "32", "--result", self, "--quiet", NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_csg("union", self, self, replace));
    ASSERT_IN_RANGE(8.0, facts_of(self).volume, 0.1);
    ASSERT(facts_of(self).triangles > 12);
    PASS();
}

/* Two balls and a bridge of five between them, each added to the file of the last union: nothing wears off. Smoothing parts the bridge,
   which is said, or keeps it where it is asked to. */
TEST unions_of_unions_keep_their_genus(void)
{
    static const char *const beads[] = {"ball:-.5,0,0,.25", "ball:-.25,0,0,.25", "ball:0,0,0,.25", "ball:.25,0,0,.25", "ball:.5,0,0,.25"};
    char solid[1024], smooth[1024];
    snprintf(solid, sizeof solid, "%s", scratch("beads.ply"));
    snprintf(smooth, sizeof smooth, "%s", scratch("smooth.ply"));
    const char *const more[] = {"--grid", "96", "--result", solid, "--quiet", NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_csg("union", "ball:-1.5,0,0,1", "ball:1.5,0,0,1", more));
    for (int i = 0; i < 5; ++i) {
        ASSERT_EQ(CLI_EXIT_OK, run_csg("union", solid, beads[i], more));
        const struct solid_facts facts = facts_of(solid);
        ASSERT_EQ(i < 4 ? 2 : 1, facts.components);
        ASSERT_EQ(2 * facts.components, facts.euler);
        ASSERT_EQ(0, facts.open_edges);
    }
    const char *const parted[] = {"--grid", "48", "--amount", "0.5", "--result", smooth, "--quiet", NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_csg("smooth", solid, NULL, parted));
    ASSERT_EQ(2, facts_of(smooth).components);
    ASSERTm(printed("stderr"), strstr(printed("stderr"), "components 1, genus 0 before, 2 and 0 after: --preserve") != NULL);
    const char *const kept[] = {"--grid", "48", "--amount", "0.5", "--preserve", "--result", smooth, "--quiet", NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_csg("smooth", solid, NULL, kept));
    ASSERT_EQ(1, facts_of(smooth).components);
    ASSERT_EQ(2, facts_of(smooth).euler);
    ASSERT_STR_EQ("", printed("stderr"));
    PASS();
}

TEST empty_results_leave_no_file(void)
{
    const char *const more[] = {"--grid", "32", "--result", scratch("nothing.ply"), NULL};
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "intersection: nothing is left", "intersection", "ball:0,0,0,1", "ball:3,0,0,1", more));
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "difference: nothing is left", "difference", "ball:0,0,0,1", "ball:0,0,0,2", more));
    const char *const smooth[] = {"--amount", "5", "--grid", "512", "--result", scratch("nothing.ply"), NULL}; /* too large for the work */
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "smooth: nothing is left", "smooth", "ball:0,0,0,1", NULL, smooth));
    const char *const apart[] = {"--result", scratch("nothing.ply"), NULL};
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "lie 2998 apart, 1500 times their size", "union", "ball:0,0,0,1", "ball:2998,0,0,1", apart));
    const char *const shrink[] = {"--amount", "-2", "--result", scratch("nothing.ply"), NULL};
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "nothing is left", "offset", "ball:0,0,0,1", NULL, shrink));
    ASSERT_FALSE(is_there(scratch("nothing.ply")));
    PASS();
}

TEST bad_files_are_named(void)
{
    static const char *const texts[] = {"", "ply\nformat ascii 1.0\nelement vertex 900000000\n",
                                        "solid nothing\nendsolid nothing\n", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
                                        "not a mesh at all"};
    static const char *const names[] = {"empty.ply", "greedy.ply", "hollow.stl", "wild.obj", "text.txt"};
    const char *const more[] = {"--grid", "32", NULL};
    for (int i = 0; i < 5; ++i) {
        FILE *file = fopen(scratch(names[i]), "w");
        ASSERT(file);
        fputs(texts[i], file);
        ASSERT_EQ(0, fclose(file));
        char path[512];
        snprintf(path, sizeof path, "%s", scratch(names[i]));
        CHECK_CALL(refused(CLI_EXIT_FAILURE, names[i], "remesh", path, NULL, more));
        CHECK_CALL(refused(CLI_EXIT_FAILURE, names[i], "union", "ball:0,0,0,1", path, more));
    }
    const float zero[3] = {0.0f, 0.0f, 0.0f}, far[3] = {1e38f, 1.0f, 1.0f};
    char path[512];
    snprintf(path, sizeof path, "%s", scratch("far.ply"));
    ASSERT(write_block(path, zero, far, NULL));
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "far.ply", "remesh", path, NULL, more));
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "nowhere.ply", "remesh", "/nowhere.ply", NULL, more));
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "ball:x,y,z,radius", "remesh", "ball:0,0,0,-1", NULL, more));
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "ball:x,y,z,radius", "remesh", "box:0,0,0", NULL, more));
    PASS();
}

TEST results_that_cannot_be_written_end_with_one_line(void)
{
    char there[512];
    snprintf(there, sizeof there, "%s", folder);
    const char *const nowhere[] = {"--grid", "24", "--result", "/nowhere/a.stl", "--quiet", NULL};
    const char *const no_glb[] = {"--grid", "24", "--result", "/nowhere/a.glb", "--quiet", NULL};
    const char *const full[] = {"--grid", "24", "--json", "/dev/full", "--quiet", NULL};
    const char *const directory[] = {"--grid", "24", "--json", there, "--quiet", NULL};
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "/nowhere/a.stl", "remesh", "ball:0,0,0,1", NULL, nowhere));
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "/nowhere/a.glb", "remesh", "ball:0,0,0,1", NULL, no_glb));
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "/dev/full", "remesh", "ball:0,0,0,1", NULL, full));
    CHECK_CALL(refused(CLI_EXIT_FAILURE, there, "remesh", "ball:0,0,0,1", NULL, directory));
    /* before the work, so that no other file is written */
    const char *const half[] = {"--grid", "24", "--result", scratch("half.ply"), "--json", "/nowhere/a.json", "--quiet", NULL};
    CHECK_CALL(refused(CLI_EXIT_FAILURE, "/nowhere/a.json", "remesh", "ball:0,0,0,1", NULL, half));
    ASSERT_FALSE(is_there(half[3]));
    char made[512], inside[600]; /* a folder that is not there yet */
    snprintf(made, sizeof made, "%s", scratch("made"));
    snprintf(inside, sizeof inside, "%s/a.json", made);
    const char *const both[] = {"--grid", "24", "--out", made, "--json", inside, "--quiet", NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_csg("remesh", "ball:0,0,0,1", NULL, both));
    ASSERT(is_there(inside));
    cJSON *json = read_report(inside);
    ASSERT_EQ(0.0, number_of(json, "specks_of_result"));
    cJSON_Delete(json);
    PASS();
}

/* An output is no other output, and but for --result no input. */
TEST nothing_is_overwritten(void)
{
    char ball[512];
    snprintf(ball, sizeof ball, "%s", scratch("csg.ply"));
    const char *const make[] = {"--grid", "24", "--result", ball, "--quiet", NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_csg("remesh", "ball:0,0,0,1", NULL, make));
    const double volume = facts_of(ball).volume;
    const char *const report[] = {"--json", ball, NULL};
    const char *const twice[] = {"--json", scratch("one.ply"), "--result", scratch("one.ply"), NULL};
    const char *const folders[] = {"--out", folder, NULL};
    CHECK_CALL(refused(CLI_EXIT_USAGE, "would be overwritten by --json", "remesh", ball, NULL, report));
    CHECK_CALL(refused(CLI_EXIT_USAGE, "would be overwritten by --result", "remesh", ball, NULL, twice));
    CHECK_CALL(refused(CLI_EXIT_USAGE, "would be overwritten by --out", "remesh", ball, NULL, folders)); /* as csg.ply */
    ASSERT_EQ(volume, facts_of(ball).volume);
    const char *const beside[] = {"--grid", "24", "--out", folder, "--result", scratch("two.ply"), "--quiet", NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_csg("remesh", ball, NULL, beside));
    PASS();
}

/* Another extension is refused before the work, with those that there are. */
TEST other_formats_are_refused(void)
{
    static const char *const names[] = {"a.off", "a", "a.ply.gz", ".ply/a", "a.PLYX"};
    for (int i = 0; i < 5; ++i) {
        const char *const more[] = {"--result", names[i], NULL};
        CHECK_CALL(refused(CLI_EXIT_USAGE, ".ply, .obj, .stl or .glb", "remesh", "/nowhere.ply", NULL, more));
    }
    const char *const capitals[] = {"--grid", "24", "--result", scratch("LOUD.STL"), NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_csg("remesh", "ball:0,0,0,1", NULL, capitals));
    ASSERT_IN_RANGE(4.0 / 3.0 * PI, facts_of(capitals[3]).volume, 0.15);
    CHECK_CALL(refused(CLI_EXIT_USAGE, "two solids", "union", "ball:0,0,0,1", NULL, NULL));
    CHECK_CALL(refused(CLI_EXIT_USAGE, "one solid", "remesh", "ball:0,0,0,1", "ball:0,0,0,1", NULL));
    const char *const amount[] = {"--amount", "2", NULL}, *const keep[] = {"--keep-volume", "--amount", "2", NULL},
                      *const coarse[] = {"--grid", "23", NULL};
    CHECK_CALL(refused(CLI_EXIT_USAGE, "--amount", "remesh", "ball:0,0,0,1", NULL, amount));
    const char *const negative[] = {"--amount", "-2", NULL};
    CHECK_CALL(refused(CLI_EXIT_USAGE, "--amount -2", "smooth", "/nowhere.ply", NULL, negative)); /* before files are read */
    CHECK_CALL(refused(CLI_EXIT_USAGE, "--keep-volume", "offset", "ball:0,0,0,1", NULL, keep));
    static const char *const chosen[] = {"contouring=1", "topology=0", "d_max=3,contouring=0"};
    for (int i = 0; i < 3; ++i) {
        const char *const both[] = {"--amount", "2", "--preserve", "--set", chosen[i], NULL};
        CHECK_CALL(refused(CLI_EXIT_USAGE, "leave them out of --set", "smooth", "ball:0,0,0,1", NULL, both));
    }
    CHECK_CALL(refused(CLI_EXIT_USAGE, "from 24 to 4096", "remesh", "ball:0,0,0,1", NULL, coarse));
    CHECK_CALL(refused(CLI_EXIT_USAGE, "union|intersection", "uni", "ball:0,0,0,1", "ball:0,0,0,1", NULL));
    PASS();
}

int main(int argc, char **argv)
{
    char command[300];
    GREATEST_MAIN_BEGIN();
    snprintf(folder, sizeof folder, "%s/springls_csg_XXXXXX", getenv("TMPDIR") ? getenv("TMPDIR") : "/tmp");
    if (!mkdtemp(folder)) return 1;
    RUN_TEST(cubes_have_the_volumes_of_arithmetic);
    RUN_TEST(holes_shells_and_parts_are_counted);
    RUN_TEST(what_is_lost_is_named);
    RUN_TEST(a_file_with_itself);
    RUN_TEST(unions_of_unions_keep_their_genus);
    RUN_TEST(empty_results_leave_no_file);
    RUN_TEST(bad_files_are_named);
    RUN_TEST(results_that_cannot_be_written_end_with_one_line);
    RUN_TEST(nothing_is_overwritten);
    RUN_TEST(other_formats_are_refused);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0) return 1;
    GREATEST_MAIN_END();
}

#endif
