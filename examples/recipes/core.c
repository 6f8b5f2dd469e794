/* core.c - the twenty functions that most programs are made of, each once: a cube's mesh, with a corner cut off, turned about. */
#include "springls.h"
#include <stdio.h>
#include <stdlib.h>

static void ok(springls_context *model, springls_status status)
{
    if (status != SPRINGLS_OK) puts(springls_last_error(model)), exit(1);
}

/* Turns about the middle of the grid, once in the time 2 pi. */
static void turn(void *user, const float *x, int count, float time, float *v)
{
    (void)user, (void)time;
    for (int i = 0; i < count; i++, x += 3, v += 3) v[0] = 24 - x[1], v[1] = x[0] - 24, v[2] = 0;
}

/* Makes a model of a grid of 48 x 48 x 48 voxels. */
static springls_context *create(void)
{
    springls_desc desc = springls_default_desc();
    springls_context *model;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 48;
    if (springls_create(&desc, &model) != SPRINGLS_OK) puts(springls_create_error(&desc)), exit(1);
    springls_params params = springls_get_params(model);
    params.contouring = SPRINGLS_CONTOURING_SPRINGLS; /* meshes have the edges and thin sheets that springls hold */
    ok(model, springls_set_params(model, &params));
    return model;
}

/* Sets a surface in one of three ways. */
static void set(springls_context *model, int way)
{
    static const float corner[8][3] = {{14, 14, 14}, {34, 14, 14}, {14, 34, 14}, {34, 34, 14},
                                       {14, 14, 34}, {34, 14, 34}, {14, 34, 34}, {34, 34, 34}};
    static const int triangle[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                        {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    static float phi[48 * 48 * 48]; /* below 0 inside, x fastest */
    springls_sphere ball = {{24, 24, 24}, 12};
    if (way == 0) ok(model, springls_set_mesh(model, corner[0], 8, sizeof corner[0], triangle[0], 12, NULL));
    if (way == 1) ok(model, springls_set_implicit(model, springls_implicit_sphere, &ball));
    if (way == 2) {
        for (int i = 0; i < 48 * 48 * 48; i++) phi[i] = abs(i / 2304 - 24) - 10.25f; /* a slab */
        ok(model, springls_set_level_set(model, phi));
    }
}

/* Prints what can be asked of a surface. */
static void describe(springls_context *model, const char *name)
{
    const float below[3] = {24, 24, 2}, up[3] = {0, 0, 1};
    float distance;
    springls_hit hit;
    springls_mesh mesh;
    springls_measures measures;
    ok(model, springls_measure(model, &measures));
    ok(model, springls_sample_distance(model, below, 1, &distance));
    ok(model, springls_raycast(model, SPRINGLS_SURFACE_WATERTIGHT, below, up, 1, 48, &hit));
    ok(model, springls_extract_mesh(model, &mesh));
    printf("%-14s volume %5.0f, a ray meets it at z = %5.2f, %s, mesh of %d triangles\n", name, measures.volume, hit.point[2],
           distance > 0 ? "outside here" : "inside here", mesh.triangle_count);
    springls_mesh_free(model, &mesh);
}

int main(void)
{
    springls_context *model = create();
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc(); /* divides dt so that no springl moves by over two voxels at once */
    springls_sphere tool = {{34, 34, 34}, 10};
    size_t size;
    void *saved;

    set(model, 1);
    describe(model, "ball");
    set(model, 2);
    describe(model, "slab");
    set(model, 0);
    describe(model, "cube");

    ok(model, springls_combine_implicit(model, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &tool));
    describe(model, "corner cut off");

    ok(model, springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    if ((saved = malloc(size)) == NULL) return puts("out of memory"), 1;
    ok(model, springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_ALL, saved, size, &size));
    forces.velocity = turn;
    step.forces = &forces;
    step.dt = 0.5f;
    ok(model, springls_step(model, &step));
    describe(model, "turned");

    ok(model, springls_restore(model, saved, size));
    describe(model, "as it was");
    free(saved);
    springls_destroy(model);
    return 0;
}
