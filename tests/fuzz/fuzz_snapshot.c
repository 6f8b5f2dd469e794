/* fuzz_snapshot.c - snapshots with some bytes changed and the checksum made right again: refused, or a model that lives. */
#include "fuzz.h"
#include "snapshot_seal.h"

#ifndef SMALL_MODELS /* fuzz_small_snapshot.c has them */
enum { SIZE = 16, MOST_SPRINGLS = 3000 };
#endif
enum { MODELS = 3, MOST_BYTES = 1 << 22 };

typedef struct original { uint8_t *bytes; size_t size; } original;

/* Makes one of three snapshots: of a ball; of one with the paper's parameters and an attribute; of one with components, in a window
   that follows it. */
static void make_original(int which, original *out)
{
    springls_params params = which == 1 ? springls_paper_params() : springls_default_params();
    springls_desc desc = fixture_desc(SIZE, &params);
    springls_sphere ball = fixture_ball(0.5f * SIZE - 1.0f, 0.5f * SIZE - 0.5f, 0.5f * SIZE, 0.2f * SIZE);
    springls_attribute_desc color = { "color", 3, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_COPY };
    float wind[3] = { 0.9f, 0.2f, 0.1f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_context *ctx;
    desc.backend = NULL;
    desc.follow = which == 2;
    params.components = which == 2;
    FUZZ_CHECK(springls_create(&desc, &ctx) == SPRINGLS_OK);
    FUZZ_CHECK(springls_set_implicit(ctx, springls_implicit_sphere, &ball) == SPRINGLS_OK);
    if (which == 1) FUZZ_CHECK(springls_add_attribute(ctx, &color, NULL, NULL) == SPRINGLS_OK);
    FUZZ_CHECK(springls_run(ctx, &step, 3) == SPRINGLS_OK);
    FUZZ_CHECK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &out->size) == SPRINGLS_OK && out->size <= MOST_BYTES);
    out->bytes = (uint8_t *)malloc(out->size);
    FUZZ_CHECK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, out->bytes, out->size, &out->size) == SPRINGLS_OK);
    springls_destroy(ctx);
}

/* Changes a word near the start, where counts and parameters are, or anywhere; or cuts the block short. */
static void change(fuzz_bytes *b, uint8_t *bytes, size_t *size)
{
    static const uint32_t odd[] = { 0u, 1u, 0x7fffffffu, 0x80000000u, 0xffffffffu, 0x7fc00000u, 0x7f800000u, 0x10000u };
    size_t at = fuzz_word(b);
    uint32_t value;
    if (fuzz_choice(b, 16) == 0) {
        *size = SPRINGLS__HEAD_BYTES + at % (*size - SPRINGLS__HEAD_BYTES + 1);
        return;
    }
    if (fuzz_choice(b, 2)) at %= 8192;
    at = SPRINGLS__HEAD_BYTES + at % (*size - SPRINGLS__HEAD_BYTES - 3) / 4 * 4;
    value = fuzz_choice(b, 2) ? odd[fuzz_choice(b, 8)] : fuzz_word(b);
    if (at + 4 <= *size) memcpy(bytes + at, &value, 4);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static original originals[MODELS];
    fuzz_bytes b = { data, size };
    int which = fuzz_choice(&b, MODELS);
    original *from = originals + which;
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_context *ctx;
    springls_status status;
    fixture_heap heap;
    uint8_t *bytes;
    size_t length;
    if (!from->bytes) make_original(which, from);
    bytes = (uint8_t *)malloc(from->size);
    memcpy(bytes, from->bytes, from->size);
    length = from->size;
    while (b.left && length > SPRINGLS__HEAD_BYTES + 8) change(&b, bytes, &length);
    fixture_seal(bytes, length);
    desc.backend = NULL;
    desc.follow = which == 2;
    desc.max_springls = MOST_SPRINGLS; /* edges may be so short that remeshing takes minutes */
    desc.allocator = fixture_allocator(&heap);
    FUZZ_CHECK(springls_create(&desc, &ctx) == SPRINGLS_OK);
    status = springls_restore(ctx, bytes, length);
    fuzz_check_status(ctx, status);
    FUZZ_CHECK(status == SPRINGLS_OK || status == SPRINGLS_BAD_SNAPSHOT || status == SPRINGLS_OUT_OF_MEMORY);
    free(bytes);
    if (status == SPRINGLS_OK) {
        springls_step_desc step = fixture_step(NULL, SPRINGLS_MODE_FLUID, 0.5f);
        springls_mesh mesh;
        fuzz_check_status(ctx, springls_step(ctx, &step));
        if (springls_extract_mesh(ctx, &mesh) == SPRINGLS_OK) springls_mesh_free(ctx, &mesh);
        fuzz_check_status(ctx, springls_remesh(ctx));
    } else {
        FUZZ_CHECK(springls_count(ctx) == 0);
    }
    springls_destroy(ctx);
    FUZZ_CHECK(heap.bytes == 0 && heap.blocks == 0 && heap.wrong_sizes == 0);
    return 0;
}
