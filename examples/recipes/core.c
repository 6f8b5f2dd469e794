/* core.c - the twenty-one functions that most programs are made of. It sets a ball, a slab and a cube, each in a way of its own, and prints
   what can be asked of them; then it cuts a corner off the cube, keeps a snapshot, turns the cube, and restores it. */
#include "springls.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SIZE = 48, MIDDLE = 24 }; /* of the grid, which is a cube of voxels */

static void ok(springls_context *model, springls_status status)
{
    if (status != SPRINGLS_OK) puts(springls_last_error(model)), exit(1);
}

/* A velocity that turns about the middle of the grid, round the z axis, by one radian in a time of 1. */
static void turn(void *user, const float *x, int count, float time, float *v)
{
    (void)user, (void)time;
    for (int i = 0; i < count; i++, x += 3, v += 3) v[0] = MIDDLE - x[1], v[1] = x[0] - MIDDLE, v[2] = 0;
}

static springls_context *create(void)
{
    springls_desc desc = springls_default_desc();
    springls_context *model;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = SIZE;
    if (springls_create(&desc, &model) != SPRINGLS_OK) puts(springls_create_error(&desc)), exit(1);
    springls_params params = springls_get_params(model);
    params.contouring = SPRINGLS_CONTOURING_SPRINGLS; /* meshes have the edges and thin sheets that springls hold */
    ok(model, springls_set_params(model, &params));
    return model;
}

/* By a function of the distance. */
static void set_ball(springls_context *model)
{
    springls_sphere ball = {{MIDDLE, MIDDLE, MIDDLE}, 12};
    ok(model, springls_set_implicit(model, springls_implicit_sphere, &ball));
}

/* By a volume of distances, x fastest, below 0 inside. The slab is square to x and 20.5 voxels thick. */
static void set_slab(springls_context *model)
{
    static float phi[SIZE * SIZE * SIZE];
    for (int i = 0; i < SIZE * SIZE * SIZE; i++) phi[i] = fabsf((float)(i % SIZE - MIDDLE)) - 10.25f;
    ok(model, springls_set_level_set(model, phi));
}

/* By a mesh. */
static void set_cube(springls_context *model)
{
    static const float corner[8][3] = {{14, 14, 14}, {34, 14, 14}, {14, 34, 14}, {34, 34, 14},
                                       {14, 14, 34}, {34, 14, 34}, {14, 34, 34}, {34, 34, 34}};
    static const int triangle[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                        {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    ok(model, springls_set_mesh(model, corner[0], 8, sizeof corner[0], triangle[0], 12, NULL));
}

/* Prints the volume, where a ray along x meets the surface, whether a place is inside, and how large the mesh is. */
static void describe(springls_context *model, const char *name)
{
    const float left[3] = {2, MIDDLE, MIDDLE}, along_x[3] = {1, 0, 0}, place[3] = {32, 32, 32};
    float distance;
    springls_hit hit;
    springls_mesh mesh;
    springls_measures measures;
    ok(model, springls_measure(model, &measures));
    ok(model, springls_raycast(model, SPRINGLS_SURFACE_WATERTIGHT, left, along_x, 1, SIZE, &hit)); /* at most SIZE far */
    ok(model, springls_sample_distance(model, place, 1, &distance));
    ok(model, springls_extract_mesh(model, &mesh));
    printf("%-14s volume %5.0f, the ray meets it at x = %5.2f, (32, 32, 32) is %s, mesh of %d triangles\n", name, measures.volume,
           hit.point[0], distance > 0 ? "outside" : "inside", mesh.triangle_count);
    springls_mesh_free(model, &mesh);
}

int main(void)
{
    springls_context *model = create();
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc(); /* divides dt so that no springl moves by over two voxels at once */
    springls_sphere tool = {{34, 34, 34}, 10}; /* around a corner of the cube */
    size_t size;
    void *saved;

    set_ball(model);
    describe(model, "ball");
    set_slab(model);
    describe(model, "slab");
    set_cube(model);
    describe(model, "cube");

    ok(model, springls_combine_implicit(model, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &tool));
    describe(model, "corner cut off");

    ok(model, springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size)); /* the size alone */
    if ((saved = malloc(size)) == NULL) return puts("out of memory"), 1;
    ok(model, springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_ALL, saved, size, &size));
    forces.velocity = turn;
    step.forces = &forces;
    step.dt = 0.5f; /* turns by half a radian, 29 degrees */
    ok(model, springls_step(model, &step));
    describe(model, "turned");

    ok(model, springls_restore(model, saved, size));
    describe(model, "as it was");
    free(saved);
    springls_destroy(model);
    return 0;
}
