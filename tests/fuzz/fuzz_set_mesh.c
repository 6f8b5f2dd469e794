/* fuzz_set_mesh.c - springls_set_mesh with any arrays: odd numbers, indices and strides, open, flat and tangled meshes. */
#include "fuzz.h"

#ifndef SMALL_MODELS /* fuzz_small_set_mesh.c has them */
enum { MOST_POINTS = 64, MOST_TRIANGLES = 128, MOST_SIDE = 31, MOST_LOW = 20, MOST_SPRINGLS = 2000 };
#endif

/* Writes the triangles of a box whose corners come from the input, so that closed meshes are frequent. */
static int box_triangles(int first, int *triangles)
{
    static const uint8_t corners[36] = { 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                         2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5 };
    int i;
    for (i = 0; i < 36; i++) triangles[i] = first + corners[i];
    return 12;
}

/* Writes corners of a box between two points of the input. */
static void box_corners(fuzz_bytes *b, float high, float *positions)
{
    float low[3], up[3];
    int i, k;
    for (k = 0; k < 3; k++) low[k] = fuzz_float(b, -2.0f, high);
    for (k = 0; k < 3; k++) up[k] = fuzz_float(b, 0.0f, high + 2.0f);
    for (i = 0; i < 8; i++)
        for (k = 0; k < 3; k++) positions[3 * i + k] = i >> k & 1 ? up[k] : low[k];
}

/* A mesh as springls_set_mesh takes it. */
typedef struct any_mesh {
    float positions[3 * MOST_POINTS];
    int triangles[3 * MOST_TRIANGLES], points, count;
} any_mesh;

/* Makes a mesh of boxes, single points and single triangles, until the input or the room ends. */
static void make_mesh(fuzz_bytes *b, any_mesh *mesh)
{
    int k;
    mesh->points = mesh->count = 0;
    while (b->left && mesh->points + 8 <= MOST_POINTS && mesh->count + 12 <= MOST_TRIANGLES) {
        if (fuzz_choice(b, 3) == 0) {
            box_corners(b, MOST_LOW, mesh->positions + 3 * mesh->points);
            mesh->count += box_triangles(mesh->points, mesh->triangles + 3 * mesh->count);
            mesh->points += 8;
        } else if (fuzz_choice(b, 2) == 0) {
            for (k = 0; k < 3; k++) mesh->positions[3 * mesh->points + k] = fuzz_float(b, -2.0f, (float)(MOST_SIDE + 3));
            mesh->points++;
        } else {
            for (k = 0; k < 3; k++) mesh->triangles[3 * mesh->count + k] = (int)(int8_t)fuzz_byte(b) % (mesh->points + 2);
            mesh->count++;
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes b = { data, size };
    springls_params params = fuzz_choice(&b, 4) ? springls_default_params() : springls_paper_params();
    springls_desc desc = fixture_desc(0, &params);
    springls_context *ctx;
    springls_mesh_report report;
    springls_status status;
    fixture_heap heap;
    any_mesh mesh;
    int k;
    for (k = 0; k < 3; k++) desc.grid.size[k] = 4 + fuzz_choice(&b, MOST_SIDE - 3);
    params.split_input = fuzz_choice(&b, 3) != 0;
    desc.allocator = fixture_allocator(&heap);
    desc.max_springls = MOST_SPRINGLS;
    FUZZ_CHECK(springls_create(&desc, &ctx) == SPRINGLS_OK);
    make_mesh(&b, &mesh);
    status = springls_set_mesh(ctx, mesh.positions, mesh.points, 0, mesh.triangles, mesh.count,
                               fuzz_choice(&b, 2) ? &report : NULL);
    fuzz_check_status(ctx, status);
    FUZZ_CHECK(status != SPRINGLS_OUT_OF_MEMORY);
    fuzz_check_model(ctx);
    if (status == SPRINGLS_OK) {
        springls_step_desc step = fixture_step(NULL, fuzz_choice(&b, 2) ? SPRINGLS_MODE_FLUID : SPRINGLS_MODE_ELASTIC, 1.0f);
        status = springls_step(ctx, &step);
        FUZZ_CHECK(status == SPRINGLS_OK || (status == SPRINGLS_EMPTY_MODEL && springls_count(ctx) == 0));
        fuzz_check_model(ctx);
    }
    springls_destroy(ctx);
    FUZZ_CHECK(heap.bytes == 0 && heap.blocks == 0 && heap.wrong_sizes == 0);
    return 0;
}
