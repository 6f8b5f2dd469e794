/* fuzz.h - what the fuzzers share: values from bytes, and the invariants of a model.

   A fuzzer is a file fuzz_NAME.c with the function LLVMFuzzerTestOneInput. libFuzzer calls it (make fuzz); linked with replay.c
   it is a test, which runs the inputs of seeds/NAME and some random ones. A failed check ends the program. */
#ifndef FUZZ_H
#define FUZZ_H

#include "fixtures.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Ends the program unless the condition holds. */
#define FUZZ_CHECK(condition) \
    do { \
        if (!(condition)) { \
            fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
            abort(); \
        } \
    } while (0)

/* ---- values from bytes ---- */

/* An input that is read from its start; zeros follow its end. */
typedef struct fuzz_bytes { const uint8_t *at; size_t left; } fuzz_bytes;

FIXTURE unsigned fuzz_byte(fuzz_bytes *b)
{
    if (!b->left) return 0;
    b->left--;
    return *b->at++;
}

FIXTURE uint32_t fuzz_word(fuzz_bytes *b)
{
    uint32_t low = fuzz_byte(b);
    low |= fuzz_byte(b) << 8;
    low |= fuzz_byte(b) << 16;
    return low | (uint32_t)fuzz_byte(b) << 24;
}

/* Returns a number in [0, count). */
FIXTURE int fuzz_choice(fuzz_bytes *b, int count) { return (int)(fuzz_byte(b) % (unsigned)count); }

/* Returns a number in [low, high]. */
FIXTURE float fuzz_between(fuzz_bytes *b, float low, float high)
{
    unsigned fine = fuzz_byte(b);
    fine |= fuzz_byte(b) << 8;
    return low + (high - low) * (float)fine / 65535.0f;
}

/* Returns a number in [low, high] or, one time in sixteen, a critical one such as NaN. */
FIXTURE float fuzz_float(fuzz_bytes *b, float low, float high)
{
    static const float odd[] = { 0.0f, -0.0f, 1.0f, -1.0f, 0.5f, 1e-6f, -1e-6f, FLT_MIN, 1e-45f, 1e6f, -1e6f, 1e12f, FLT_MAX,
                                 -FLT_MAX };
    unsigned kind = fuzz_byte(b);
    if (kind >= 16) return fuzz_between(b, low, high);
    if (kind == 14) return (float)HUGE_VAL;
    if (kind == 15) return (float)(HUGE_VAL - HUGE_VAL);
    return odd[kind];
}

/* ---- invariants ---- */

/* Checks that every springl is finite, and that ids are unique. */
FIXTURE void fuzz_check_springls(springls_context *ctx)
{
    int i, m, n = springls_count(ctx);
    const uint32_t *ids = springls_ids(ctx);
    int *sorted = (int *)malloc(((size_t)n + 1) * sizeof *sorted);
    for (i = 0; i < n; i++) {
        fixture_springl s = fixture_get(ctx, i);
        FUZZ_CHECK(d3_length(d3_of(s.p)) < 1e12 && d3_length(d3_of(s.a)) < 1e12);
        for (m = 0; m < 3; m++) FUZZ_CHECK(d3_length(d3_of(s.q[m])) < 1e12);
        sorted[i] = (int)ids[i];
    }
    qsort(sorted, (size_t)n, sizeof *sorted, fixture_compare_int);
    for (i = 1; i < n; i++) FUZZ_CHECK(sorted[i - 1] != sorted[i]);
    free(sorted);
}

/* Checks that the mesh is closed and finite. Returns whether it has triangles. */
FIXTURE bool fuzz_check_mesh(springls_context *ctx, springls_contouring contouring)
{
    const springls_params before = springls_get_params(ctx);
    springls_params params = before;
    springls__mesh_report report;
    springls_mesh mesh;
    bool any;
    int i;
    params.contouring = contouring;
    FUZZ_CHECK(springls_set_params(ctx, &params) == SPRINGLS_OK && springls_extract_mesh(ctx, &mesh) == SPRINGLS_OK);
    report = fixture_report(&mesh);
    FUZZ_CHECK(report.boundary_edges == 0 && report.nonmanifold_edges == 0 && report.misoriented_edges == 0);
    for (i = 0; i < mesh.vertex_count; i++) FUZZ_CHECK(mesh.springls[i] >= -1 && mesh.springls[i] < springls_count(ctx));
    for (i = 0; i < 3 * mesh.vertex_count; i++)
        FUZZ_CHECK(fabsf(mesh.positions[i]) < 1e12f && fabsf(mesh.normals[i]) < 1.1f && fabsf(mesh.correspondences[i]) < 1e12f);
    any = mesh.triangle_count > 0;
    springls_mesh_free(ctx, &mesh);
    FUZZ_CHECK(springls_set_params(ctx, &before) == SPRINGLS_OK);
    return any;
}

/* Checks that phi is finite and clamped, and that meshes are closed, that of its zero level around what phi has inside. */
FIXTURE void fuzz_check_surface(springls_context *ctx)
{
    const int *size = ctx->desc.grid.size;
    const float limit = springls_get_params(ctx).band_half_width + 1.0f;
    const double unit = ctx->desc.grid.spacing[0] * ctx->desc.grid.spacing[1] * ctx->desc.grid.spacing[2];
    size_t i, voxels = (size_t)size[0] * (size_t)size[1] * (size_t)size[2], inside = 0;
    float *phi = (float *)malloc(voxels * sizeof *phi);
    springls_measures measures;
    bool done = false;
    springls_step_continue(ctx, HUGE_VAL, &done); /* phi of a step in progress may not have followed; the step may fail */
    FUZZ_CHECK(done && springls_measure(ctx, &measures) == SPRINGLS_OK);
    FUZZ_CHECK(phi && springls_copy_level_set(ctx, phi) == SPRINGLS_OK);
    for (i = 0; i < voxels; i++) {
        FUZZ_CHECK(fabsf(phi[i]) <= limit);
        inside += phi[i] < 0.0f;
    }
    free(phi);
    FUZZ_CHECK(fuzz_check_mesh(ctx, SPRINGLS_CONTOURING_LEVEL_SET) == (inside > 0));
    fuzz_check_mesh(ctx, SPRINGLS_CONTOURING_SPRINGLS);
    /* Each voxel of the surface is inside or outside as a whole; a unit of the surface crosses fewer than two. */
    if (unit == 1.0) FUZZ_CHECK(fabs(measures.volume - (double)inside) <= 1.0 + 2.0 * measures.area);
}

/* Checks that a snapshot restores to the same state, whose snapshot has the same bytes. */
FIXTURE void fuzz_check_snapshot(springls_context *ctx)
{
    springls_desc desc = fixture_desc(8, NULL);
    springls_context *other;
    size_t size, again;
    void *bytes, *copy;
    desc.grid = ctx->desc.grid;
    desc.follow = ctx->desc.follow;
    FUZZ_CHECK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size) == SPRINGLS_OK);
    bytes = malloc(size);
    copy = malloc(size);
    FUZZ_CHECK(bytes && copy && springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, bytes, size, &size) == SPRINGLS_OK);
    FUZZ_CHECK(springls_create(&desc, &other) == SPRINGLS_OK);
    FUZZ_CHECK(springls_restore(other, bytes, size) == SPRINGLS_OK);
    FUZZ_CHECK(springls_state_hash(ctx) == springls_state_hash(other));
    FUZZ_CHECK(springls_snapshot(other, SPRINGLS_SNAPSHOT_KIND_ALL, copy, size, &again) == SPRINGLS_OK);
    FUZZ_CHECK(again == size && memcmp(bytes, copy, size) == 0);
    springls_destroy(other);
    free(bytes);
    free(copy);
}

/* Checks all invariants. No allocation may fail meanwhile. */
FIXTURE void fuzz_check_model(springls_context *ctx)
{
    fuzz_check_surface(ctx);
    fuzz_check_springls(ctx);
    fuzz_check_snapshot(ctx);
}

/* Checks that a status is a known one, and that a failure has a sentence of one line. */
FIXTURE void fuzz_check_status(springls_context *ctx, springls_status status)
{
    FUZZ_CHECK(status <= SPRINGLS_OK && status >= SPRINGLS_BAD_SNAPSHOT);
    if (status == SPRINGLS_OK) return;
    FUZZ_CHECK(strlen(springls_last_error(ctx)) > 10 && !strchr(springls_last_error(ctx), '\n'));
}

#endif
