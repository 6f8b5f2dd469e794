/* test_foam.c - examples/foam.c as it is run: three bubbles in three steps, what it prints and writes, and what it refuses. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_foam_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_foam_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#define main foam_main
#include "../../examples/foam.c"
#undef main

#include "run_program.h"
#include "surface/mesh_check.h"

#include <sys/stat.h>

static long bytes_of(const char *name)
{
    char path[300];
    struct stat status;
    snprintf(path, sizeof path, "%s/%s", scratch("foam"), name);
    return stat(path, &status) == 0 ? (long)status.st_size : 0;
}

static int ascending(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Returns whether as many triangles use each edge in one direction as in the other: a bubble may touch itself along an edge. */
static bool is_closed(const struct look *look)
{
    const size_t count = 3 * look->triangles;
    uint64_t *edges = malloc((2 * count + 1) * sizeof *edges), *back = edges + count;
    for (size_t i = 0; edges && i < count; i++) {
        const uint64_t from = look->indices[i], to = look->indices[i % 3 == 2 ? i - 2 : i + 1];
        edges[i] = from << 32 | to;
        back[i] = to << 32 | from;
    }
    if (edges) {
        qsort(edges, count, sizeof *edges, ascending);
        qsort(back, count, sizeof *back, ascending);
    }
    const bool closed = edges && memcmp(edges, back, count * sizeof *edges) == 0;
    free(edges);
    return closed;
}

/* In the mesh each bubble is one closed surface with vertices of its own; a picture has a sheet for each film. */
TEST bubbles_are_closed_in_the_mesh(void)
{
    static struct foam foam;
    springls_walls walls;
    struct look whole, cut_open;
    foam.common = cli_common_defaults();
    foam.cells = 3;
    ASSERT(prepare(&foam) && set_cells(&foam));
    ASSERT_EQ(SPRINGLS_OK, springls_tiling_extract(foam.tiling, &walls));
    ASSERT(make_look(&foam, &walls, false, &whole) && make_look(&foam, &walls, true, &cut_open));
    ASSERT(is_closed(&whole));
    ASSERT_EQ(3, mesh_components((int)whole.vertices, (const int *)whole.indices, (int)whole.triangles));
    ASSERT_FALSE(is_closed(&cut_open));
    free_look(&whole);
    free_look(&cut_open);
    springls_walls_free(foam.tiling, &walls);
    springls_tiling_destroy(foam.tiling);
    free(foam.faces);
    free(foam.touch);
    PASS();
}

/* All bubbles stay, and a picture and a mesh are written. */
TEST three_bubbles(void)
{
    const char *const arguments[] = {"foam", "--cells", "3", "--steps", "3", "--out", scratch("foam"), NULL};
    ASSERT_EQ(0, run_program(foam_main, arguments, NULL));
    ASSERT(strstr(printed("stdout"), "bubbles: 3 of 3"));
    ASSERT(strstr(printed("stdout"), "angles where three films meet: mean"));
    ASSERT_GT(bytes_of("foam.png"), 5000);
    ASSERT_GT(bytes_of("foam.glb"), 5000);
    PASS();
}

TEST one_bubble_is_refused(void)
{
    const char *const arguments[] = {"foam", "--cells", "1", NULL};
    ASSERT_EQ(2, run_program(foam_main, arguments, NULL));
    ASSERT(strstr(printed("stderr"), "--cells"));
    PASS();
}

/* Grids without a ball, and those with more voxels than an int counts; options without effect. */
TEST what_has_no_effect_is_refused(void)
{
    static const char *const options[][2] = {{"--grid", "12"}, {"--grid", "513"}, {"--params", "paper"}, {"--backend", "opencl"},
                                             {"--json", "-"}, {"--quiet", NULL}};
    for (int i = 0; i < 6; i++) {
        const char *const arguments[] = {"foam", "--steps", "3", options[i][0], options[i][1], NULL};
        ASSERT_EQ(2, run_program(foam_main, arguments, NULL));
        ASSERT(strstr(printed("stderr"), options[i][0]));
    }
    PASS();
}

/* Before the work: a folder lies where the mesh goes. */
TEST a_mesh_that_cannot_be_written_is_named(void)
{
    char mesh[300];
    snprintf(mesh, sizeof mesh, "%s/foam.glb", scratch("foam"));
    ASSERT_EQ(0, remove(mesh));
    ASSERT_EQ(0, mkdir(mesh, 0700));
    const char *const arguments[] = {"foam", "--cells", "3", "--steps", "3", "--out", scratch("foam"), NULL};
    ASSERT_EQ(2, run_program(foam_main, arguments, NULL));
    ASSERT(strstr(printed("stderr"), "foam.glb: cannot be written: it is a folder"));
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) {
        return EXIT_FAILURE;
    }
    RUN_TEST(three_bubbles);
    RUN_TEST(bubbles_are_closed_in_the_mesh);
    RUN_TEST(one_bubble_is_refused);
    RUN_TEST(what_has_no_effect_is_refused);
    RUN_TEST(a_mesh_that_cannot_be_written_is_named);
    remove_folder();
    GREATEST_MAIN_END();
}

#endif
