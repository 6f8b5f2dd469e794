/* test_chunks.c - the watertight surface in chunks, by either contouring: what a consumer has put together from changes is the whole
   surface, watertight, near the zero level; only what has changed is listed. */
enum { SIZE = 40, SIDE = 5 };

#include "chunk_store.h"

static springls_contouring contouring; /* of the models that the tests make */

static springls_params chosen_params(void)
{
    springls_params params = springls_default_params();
    params.contouring = contouring;
    return params;
}

static face *mesh_faces(const springls_mesh *mesh)
{
    face *faces = (face *)malloc(((size_t)mesh->triangle_count + 1) * sizeof *faces);
    int t;
    for (t = 0; t < mesh->triangle_count; t++) {
        const int *c = mesh->triangles + 3 * t;
        faces[t] = face_of(mesh->positions + 3 * c[0], mesh->positions + 3 * c[1], mesh->positions + 3 * c[2]);
    }
    qsort(faces, (size_t)mesh->triangle_count, sizeof *faces, compare_faces);
    return faces;
}

/* The same triangles, to the bit. */
static greatest_test_res is_the_mesh(springls_context *ctx, const store *s)
{
    springls_mesh mesh;
    face *ours, *theirs;
    int count;
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    ours = store_faces(s, &count);
    theirs = mesh_faces(&mesh);
    ASSERT_EQ(mesh.triangle_count, count);
    ASSERT(memcmp(ours, theirs, (size_t)count * sizeof *ours) == 0);
    free(ours);
    free(theirs);
    springls_mesh_free(ctx, &mesh);
    PASS();
}

typedef struct scene {
    springls_context *ctx;
    springls_chunks *chunks;
    brush brush;
    springls_forces forces;
    springls_step_desc step;
    store store;
} scene;

static springls_status scene_begin(scene *s, const springls_chunks_desc *desc, int mirrored)
{
    const springls_params params = chosen_params();
    springls_desc d = fixture_desc(SIZE, &params);
    springls_sphere ball = fixture_ball(19.3f, 19.7f, 20.1f, 11.0f);
    memset(s, 0, sizeof *s);
    if (mirrored) {
        d.grid.direction[0] = -1.0;
        d.grid.direction[4] = d.grid.direction[8] = 1.0;
        d.grid.origin[0] = 40.0;
    }
    s->brush.center[0] = 31.0f;
    s->brush.center[1] = s->brush.center[2] = 20.0f;
    s->brush.radius = 5.0f;
    s->brush.velocity[0] = -1.0f;
    s->forces = fixture_forces(push, &s->brush);
    s->forces.voxel_units = true;
    s->step = fixture_step(&s->forces, SPRINGLS_MODE_FLUID, 1.0f);
    s->step.max_displacement = 2.0f;
    SPRINGLS__TRY(springls_create(&d, &s->ctx));
    SPRINGLS__TRY(springls_set_implicit(s->ctx, springls_implicit_sphere, &ball));
    return springls_chunks_create(s->ctx, desc, &s->chunks);
}

static void scene_end(scene *s)
{
    store_free(&s->store);
    springls_chunks_destroy(s->ctx, s->chunks);
    springls_destroy(s->ctx);
}

static springls_status update(scene *s, int *count)
{
    const springls_chunk *changed;
    SPRINGLS__TRY(springls_chunks_update(s->ctx, s->chunks, &changed, count));
    store_put(&s->store, changed, *count);
    return SPRINGLS_OK;
}

/* Without a tolerance they are the mesh. */
TEST exact_chunks_are_the_mesh(int mirrored)
{
    springls_chunks_desc exact = { .tolerance = -1.0f };
    scene s;
    int i, count;
    ASSERT_OK(scene_begin(&s, &exact, mirrored));
    for (i = 0; i < 7; i++) {
        ASSERT_OK(update(&s, &count));
        ASSERT_GT(count, 0);
        CHECK_CALL(is_the_mesh(s.ctx, &s.store));
        ASSERT_OK(update(&s, &count));
        ASSERT_EQ(0, count);
        ASSERT_OK(springls_step(s.ctx, &s.step));
    }
    scene_end(&s);
    PASS();
}

/* A consumer of the zero level has that, whatever the model's meshes are of. */
TEST a_consumer_may_have_the_zero_level(void)
{
    const springls_chunks_desc exact = { .tolerance = -1.0f, .zero_level = true };
    scene s;
    int i, count;
    ASSERT_OK(scene_begin(&s, &exact, 0));
    for (i = 0; i < 4; i++) {
        springls_params params = springls_get_params(s.ctx);
        ASSERT_OK(update(&s, &count));
        ASSERT_GT(count, 0);
        params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
        ASSERT_OK(springls_set_params(s.ctx, &params));
        CHECK_CALL(is_the_mesh(s.ctx, &s.store));
        params.contouring = contouring;
        ASSERT_OK(springls_set_params(s.ctx, &params));
        ASSERT_OK(update(&s, &count));
        ASSERT_EQ(0, count);
        ASSERT_OK(springls_step(s.ctx, &s.step));
    }
    scene_end(&s);
    PASS();
}

/* With one they stay watertight and near, and a push changes few. */
TEST a_push_changes_what_it_touches(void)
{
    scene s;
    const springls_chunk *changed;
    int i, k, v, count, near = 0, far = 0, far_in_all = 0;
    ASSERT_OK(scene_begin(&s, NULL, 0));
    for (i = 0; i < 25; i++) ASSERT_OK(springls_step(s.ctx, &s.step)); /* springls come to rest elsewhere */
    ASSERT_OK(update(&s, &count));
    for (i = 0; i < SIDE * SIDE * SIDE; i++) far_in_all += s.store.chunk[i].triangle_count > 0 && s.store.chunk[i].brick[0] <= 1;
    for (i = 0; i < 6; i++) {
        s.brush.center[1] += 0.7f;
        ASSERT_OK(springls_step(s.ctx, &s.step));
        ASSERT_OK(springls_chunks_update(s.ctx, s.chunks, &changed, &count));
        for (k = 0; k < count; k++) {
            near += changed[k].brick[0] >= 3;
            far += changed[k].brick[0] <= 1;
        }
        store_put(&s.store, changed, count);
        CHECK_CALL(is_watertight(&s.store));
    }
    ASSERT_GT(near, 12);
    ASSERT_LT(far, 6 * far_in_all / 2);
    for (i = 0; i < SIDE * SIDE * SIDE; i++)
        for (v = 0; v < s.store.chunk[i].vertex_count; v++) {
            const float *x = s.store.chunk[i].positions + 3 * v;
            springls_hit hit;
            float distance;
            ASSERT_OK(springls_closest(s.ctx, SPRINGLS_SURFACE_WATERTIGHT, x, 1, &hit));
            ASSERT_LT((double)hit.distance, 0.1);
            ASSERT_OK(springls_sample_distance(s.ctx, x, 1, &distance));
            if (contouring == SPRINGLS_CONTOURING_LEVEL_SET) ASSERT_LT(fabs((double)distance), 0.1);
            for (k = 0; k < 3; k++) {
                double low = 8.0 * s.store.chunk[i].brick[k] - 1.0;
                ASSERT_GTE((double)s.store.chunk[i].positions[3 * v + k], low);
                ASSERT_LTE((double)s.store.chunk[i].positions[3 * v + k], low + 9.0);
            }
        }
    scene_end(&s);
    PASS();
}

/* A model at rest changes no chunk. */
TEST what_rests_stays(void)
{
    scene s;
    int i, count;
    ASSERT_OK(scene_begin(&s, NULL, 0));
    ASSERT_OK(springls_settle(s.ctx, 60));
    ASSERT_OK(update(&s, &count));
    s.step.forces = NULL;
    for (i = 0; i < 3; i++) {
        ASSERT_OK(springls_step(s.ctx, &s.step));
        ASSERT_OK(update(&s, &count));
        ASSERT_EQ(0, count);
    }
    scene_end(&s);
    PASS();
}

/* Another model: chunks that are gone are listed, and afterwards all is the new one; and an empty one at last. */
TEST chunks_come_and_go(void)
{
    springls_chunks_desc exact = { .tolerance = -1.0f };
    springls_sphere small = fixture_ball(10.0f, 11.0f, 12.0f, 6.0f);
    const springls_chunk *changed;
    scene s;
    int i, count, gone = 0;
    ASSERT_OK(scene_begin(&s, &exact, 0));
    ASSERT_OK(update(&s, &count));
    ASSERT_OK(springls_set_implicit(s.ctx, springls_implicit_sphere, &small));
    ASSERT_OK(springls_chunks_update(s.ctx, s.chunks, &changed, &count));
    for (i = 0; i < count; i++) gone += changed[i].triangle_count == 0;
    ASSERT_GT(gone, 10);
    store_put(&s.store, changed, count);
    CHECK_CALL(is_the_mesh(s.ctx, &s.store));
    ASSERT_OK(springls_reset(s.ctx));
    ASSERT_OK(update(&s, &count));
    ASSERT_GT(count, 0);
    for (i = 0; i < SIDE * SIDE * SIDE; i++) ASSERT_EQ(0, s.store.chunk[i].triangle_count);
    ASSERT_OK(update(&s, &count));
    ASSERT_EQ(0, count);
    scene_end(&s);
    PASS();
}

/* An object that fills the grid: the closing surface at its border is in chunks too. */
TEST the_border_is_closed(void)
{
    static float phi[SIZE * SIZE * SIZE];
    springls_chunks_desc exact = { .tolerance = -1.0f };
    scene s;
    int i, count;
    for (i = 0; i < SIZE * SIZE * SIZE; i++) phi[i] = (float)(i % SIZE) - 21.3f;
    ASSERT_OK(scene_begin(&s, &exact, 0));
    ASSERT_OK(springls_set_level_set(s.ctx, phi));
    ASSERT_OK(update(&s, &count));
    CHECK_CALL(is_the_mesh(s.ctx, &s.store));
    CHECK_CALL(is_watertight(&s.store));
    scene_end(&s);
    PASS();
}

static void turn(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)time;
    for (i = 0; i < count; i++) {
        out[3 * i] = -(points[3 * i + 1] - 19.7f) * 0.02f;
        out[3 * i + 1] = (points[3 * i] - 19.3f) * 0.02f;
        out[3 * i + 2] = 0.0f;
    }
}

/* Every fifth vertex of every seventh chunk has what the same vertex of the mesh has. */
TEST has_material_of(springls_context *ctx, const springls_mesh *mesh, const springls_chunk *chunk, int count)
{
    int i, v, w, found = 0;
    for (i = 0; i < count; i += 7)
        for (v = 0; v < chunk[i].vertex_count; v += 5)
            for (w = 0; w < mesh->vertex_count; w++) {
                if (memcmp(chunk[i].positions + 3 * v, mesh->positions + 3 * w, 12) != 0) continue;
                found++;
                ASSERT(memcmp(chunk[i].normals + 3 * v, mesh->normals + 3 * w, 12) == 0);
                ASSERT(memcmp(chunk[i].correspondences + 3 * v, mesh->correspondences + 3 * w, 12) == 0);
                ASSERT_EQ(chunk[i].ids[v], mesh->springls[w] < 0 ? UINT32_MAX : springls_ids(ctx)[mesh->springls[w]]);
            }
    ASSERT_GT(found, 50);
    PASS();
}

/* Vertices of chunks are looked at several at once, those of a mesh one by one: the bits are the same, also where chunks have to do
   so too: at sharp edges, and for bodies that stay two. */
TEST material_is_that_of_the_mesh(int edges, int separate)
{
    const springls_chunks_desc desc = { .tolerance = -1.0f, .correspondences = true };
    springls_params params = chosen_params();
    const springls_chunk *changed;
    springls_context *ctx;
    springls_chunks *chunks;
    springls_mesh mesh;
    int count;
    if (separate) params.contact = SPRINGLS_CONTACT_SEPARATE;
    ctx = edges ? fixture_box(SIZE, &params, 9.3f) : fixture_sphere(SIZE, &params, 19.3f, 19.7f, 20.1f, 11.0f);
    ASSERT_EQ(edges != 0, ctx->model.set.at_edges > 0);
    ASSERT_OK(springls_chunks_create(ctx, &desc, &chunks));
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &count));
    CHECK_CALL(has_material_of(ctx, &mesh, changed, count));
    springls_mesh_free(ctx, &mesh);
    springls_chunks_destroy(ctx, chunks);
    springls_destroy(ctx);
    PASS();
}

/* Correspondences and ids are the mesh's; and a ball that turns in its place changes them, though not its shape. */
TEST material_comes_along(void)
{
    springls_chunks_desc desc = { .tolerance = -1.0f, .correspondences = true }, coarse = { .tolerance = 0.05f, .correspondences = true };
    const springls_chunk *changed;
    springls_mesh mesh;
    scene s;
    int count, i, all;
    ASSERT_OK(scene_begin(&s, &desc, 0));
    ASSERT_OK(springls_extract_mesh(s.ctx, &mesh));
    ASSERT_OK(springls_chunks_update(s.ctx, s.chunks, &changed, &all));
    CHECK_CALL(has_material_of(s.ctx, &mesh, changed, all));
    springls_mesh_free(s.ctx, &mesh);
    springls_chunks_destroy(s.ctx, s.chunks);
    ASSERT_OK(springls_chunks_create(s.ctx, &coarse, &s.chunks));
    s.forces.velocity = turn;
    for (i = 0; i < 6; i++) ASSERT_OK(springls_step(s.ctx, &s.step));
    ASSERT_OK(springls_chunks_update(s.ctx, s.chunks, &changed, &all));
    ASSERT_OK(springls_step(s.ctx, &s.step));
    ASSERT_OK(springls_chunks_update(s.ctx, s.chunks, &changed, &count));
    ASSERT_GT(count, all / 2);
    scene_end(&s);
    PASS();
}

/* A failed update loses nothing: the next one lists all. */
TEST memory_may_run_out(void)
{
    fixture_heap heap;
    springls_chunks_desc exact = { .tolerance = -1.0f, .correspondences = true };
    int k, failed = 0;
    for (k = 0; k < 40; k++) {
        const springls_params params = chosen_params();
        springls_desc d = fixture_desc(SIZE, &params);
        springls_sphere ball = fixture_ball(19.3f, 19.7f, 20.1f, 7.0f), larger = fixture_ball(19.3f, 19.7f, 20.1f, 11.0f);
        const springls_chunk *changed;
        springls_status status;
        scene s;
        int count;
        memset(&s, 0, sizeof s);
        d.allocator = fixture_allocator(&heap);
        ASSERT_OK(springls_create(&d, &s.ctx));
        ASSERT_OK(springls_set_implicit(s.ctx, springls_implicit_sphere, &ball));
        heap.fail_at = heap.calls + k;
        status = springls_chunks_create(s.ctx, &exact, &s.chunks);
        if (status == SPRINGLS_OK) status = springls_chunks_update(s.ctx, s.chunks, &changed, &count);
        if (status == SPRINGLS_OK) store_put(&s.store, changed, count);
        if (s.chunks && status == SPRINGLS_OK && springls_set_implicit(s.ctx, springls_implicit_sphere, &larger) == SPRINGLS_OK) {
            status = springls_chunks_update(s.ctx, s.chunks, &changed, &count);
            if (status == SPRINGLS_OK) store_put(&s.store, changed, count);
        }
        failed += status != SPRINGLS_OK;
        if (status != SPRINGLS_OK) {
            ASSERT_STATUS(SPRINGLS_OUT_OF_MEMORY, status);
            if (s.chunks) ASSERT_EQ(0, count);
        }
        heap.fail_at = -1;
        if (!s.chunks) ASSERT_OK(springls_chunks_create(s.ctx, &exact, &s.chunks));
        ASSERT_OK(update(&s, &count));
        if (springls_count(s.ctx) > 0) CHECK_CALL(is_the_mesh(s.ctx, &s.store));
        scene_end(&s);
        ASSERT_EQ(0, heap.blocks);
        ASSERT_EQ(0, heap.wrong_sizes);
    }
    ASSERT_GT(failed, 10);
    PASS();
}

TEST wrong_arguments_are_told(void)
{
    springls_chunks_desc bad = { .tolerance = 0.6f };
    const springls_chunk *changed;
    springls_chunks *chunks;
    scene s;
    int count;
    ASSERT_OK(scene_begin(&s, NULL, 0));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_create(s.ctx, &bad, &chunks));
    ASSERT_EQ(NULL, chunks);
    bad.tolerance = (float)NAN;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_create(s.ctx, &bad, &chunks));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_create(NULL, NULL, &chunks));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_create(s.ctx, NULL, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_update(s.ctx, NULL, &changed, &count));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_update(s.ctx, s.chunks, NULL, &count));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_update(s.ctx, s.chunks, &changed, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_update(NULL, s.chunks, &changed, &count));
    springls_chunks_destroy(s.ctx, NULL);
    scene_end(&s);
    PASS();
}

/* An update in pieces lists the same bytes as a whole one, and leaves the same state; also when phi has to follow lazy steps. */
TEST an_update_in_pieces(int material)
{
    springls_chunks_desc desc = { .correspondences = material != 0 };
    const springls_chunk *changed, *expected;
    scene whole, cut;
    int i, count, expected_count, calls = 0;
    bool done;
    ASSERT_OK(scene_begin(&whole, &desc, 0));
    ASSERT_OK(scene_begin(&cut, &desc, 0));
    for (i = 0; i < 4; i++) {
        whole.step.dt = cut.step.dt = i % 2 ? 0.1f : 1.0f; /* the short ones are lazy */
        ASSERT_OK(springls_step(whole.ctx, &whole.step));
        ASSERT_OK(springls_step(cut.ctx, &cut.step));
        ASSERT_OK(springls_chunks_update(whole.ctx, whole.chunks, &expected, &expected_count));
        ASSERT_OK(springls_chunks_begin(cut.ctx, cut.chunks));
        ASSERT(!springls_step_in_progress(cut.ctx));
        for (done = false; !done; calls++) {
            ASSERT_OK(springls_chunks_continue(cut.ctx, cut.chunks, 0.0, &changed, &count, &done));
            ASSERT(done || (!changed && count == 0));
        }
        ASSERT_EQ(expected_count, count);
        ASSERT_EQ(hash_of(expected, expected_count), hash_of(changed, count));
        ASSERT_EQ(springls_state_hash(whole.ctx), springls_state_hash(cut.ctx));
        ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_continue(cut.ctx, cut.chunks, 0.0, &changed, &count, &done));
    }
    ASSERT_GT(calls, 40);
    ASSERT_OK(springls_chunks_begin(cut.ctx, cut.chunks));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_continue(cut.ctx, NULL, 0.0, &changed, &count, &done));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_continue(cut.ctx, cut.chunks, 0.0, NULL, &count, &done));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_continue(cut.ctx, cut.chunks, 0.0, &changed, NULL, &done));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_continue(cut.ctx, cut.chunks, 0.0, &changed, &count, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_continue(cut.ctx, cut.chunks, (double)NAN, &changed, &count, &done));
    ASSERT(!done); /* it goes on */
    scene_end(&whole);
    scene_end(&cut);
    PASS();
}

/* The hash of a model whose chunks are half made is that of the model, and it goes on as one that was not hashed. */
TEST hashing_halfway_changes_nothing(int calls)
{
    springls_chunks_desc desc = { .correspondences = true };
    const springls_chunk *changed, *expected;
    scene whole, cut;
    int i, count, expected_count;
    bool done = false;
    ASSERT_OK(scene_begin(&whole, &desc, 0));
    ASSERT_OK(scene_begin(&cut, &desc, 0));
    whole.step.dt = cut.step.dt = 0.1f; /* lazy: phi follows for the chunks alone */
    ASSERT_OK(springls_run(whole.ctx, &whole.step, 3));
    ASSERT_OK(springls_run(cut.ctx, &cut.step, 3));
    ASSERT_OK(springls_chunks_update(whole.ctx, whole.chunks, &expected, &expected_count));
    ASSERT_OK(springls_chunks_begin(cut.ctx, cut.chunks));
    for (i = 0; i < calls; i++) {
        ASSERT_OK(springls_chunks_continue(cut.ctx, cut.chunks, 0.0, &changed, &count, &done));
        ASSERT(!done);
    }
    ASSERT_EQ(springls_state_hash(whole.ctx), springls_state_hash(cut.ctx));
    while (!done) ASSERT_OK(springls_chunks_continue(cut.ctx, cut.chunks, 0.0, &changed, &count, &done));
    ASSERT_EQ(hash_of(expected, expected_count), hash_of(changed, count));
    ASSERT_OK(springls_run(whole.ctx, &whole.step, 3));
    ASSERT_OK(springls_run(cut.ctx, &cut.step, 3));
    ASSERT_EQ(springls_state_hash(whole.ctx), springls_state_hash(cut.ctx));
    scene_end(&whole);
    scene_end(&cut);
    PASS();
}

/* What else is called halfway loses nothing: the consumer's chunks are the zero level at last. */
TEST an_update_that_is_interrupted(int calls)
{
    springls_chunks_desc exact = { .tolerance = -1.0f };
    springls_sphere small = fixture_ball(10.0f, 11.0f, 12.0f, 6.0f);
    const springls_chunk *changed;
    springls_chunks *other;
    scene s;
    int i, k, count;
    bool done;
    ASSERT_OK(scene_begin(&s, &exact, 0));
    ASSERT_OK(springls_chunks_create(s.ctx, &exact, &other));
    for (i = 0; i < 4; i++) {
        ASSERT_OK(springls_chunks_begin(s.ctx, s.chunks));
        for (k = 0; k < calls; k++) {
            ASSERT_OK(springls_chunks_continue(s.ctx, s.chunks, 0.0, &changed, &count, &done));
            if (!done) continue;
            store_put(&s.store, changed, count);
            ASSERT_OK(springls_chunks_begin(s.ctx, s.chunks));
        }
        if (i == 0) ASSERT_OK(springls_step(s.ctx, &s.step));
        if (i == 1) ASSERT_OK(springls_chunks_update(s.ctx, other, &changed, &count));
        if (i == 2) ASSERT_OK(springls_set_implicit(s.ctx, springls_implicit_sphere, &small));
        if (i == 3) ASSERT_OK(springls_chunks_begin(s.ctx, other));
    }
    springls_chunks_destroy(s.ctx, other); /* with an update in progress */
    ASSERT_OK(update(&s, &count));
    CHECK_CALL(is_the_mesh(s.ctx, &s.store));
    ASSERT_OK(update(&s, &count));
    ASSERT_EQ(0, count);
    scene_end(&s);
    PASS();
}

/* A consumer that goes on while contouring changes has the mesh of either, and none of the other is left. */
TEST contouring_may_change(void)
{
    springls_chunks_desc exact = { .tolerance = -1.0f };
    springls_params params = chosen_params();
    springls_sphere small = fixture_ball(10.0f, 11.0f, 12.0f, 6.0f);
    scene s;
    int i, count;
    ASSERT_OK(scene_begin(&s, &exact, 0));
    for (i = 0; i < 6; i++) {
        ASSERT_OK(update(&s, &count));
        ASSERT_GT(count, 7);
        CHECK_CALL(is_the_mesh(s.ctx, &s.store));
        ASSERT_OK(update(&s, &count));
        ASSERT_EQ(0, count);
        params.contouring =
            params.contouring == SPRINGLS_CONTOURING_SPRINGLS ? SPRINGLS_CONTOURING_LEVEL_SET : SPRINGLS_CONTOURING_SPRINGLS;
        ASSERT_OK(springls_set_params(s.ctx, &params));
        if (i == 1 || i == 2) ASSERT_OK(springls_set_implicit(s.ctx, springls_implicit_sphere, &small)); /* chunks vanish with either */
        if (i == 3) ASSERT_OK(springls_reset(s.ctx));
        if (i == 3) break;
    }
    ASSERT_OK(update(&s, &count));
    for (i = 0; i < SIDE * SIDE * SIDE; i++) ASSERT_EQ(0, s.store.chunk[i].triangle_count);
    scene_end(&s);
    PASS();
}

/* Contouring may change halfway through an update, after any call: what that lists stays until the next one, and then the consumer has the
   mesh of the other contouring. */
TEST contouring_may_change_halfway(void)
{
    springls_chunks_desc exact = { .tolerance = -1.0f };
    springls_params params = chosen_params();
    const springls_contouring other =
        contouring == SPRINGLS_CONTOURING_SPRINGLS ? SPRINGLS_CONTOURING_LEVEL_SET : SPRINGLS_CONTOURING_SPRINGLS;
    const springls_chunk *changed;
    springls_mesh mesh;
    scene s;
    int calls, k, count;
    bool halfway = true;
    ASSERT_OK(scene_begin(&s, &exact, 0));
    s.step.dt = 0.1f; /* lazy: phi follows for the chunks alone */
    ASSERT_OK(springls_run(s.ctx, &s.step, 3));
    for (calls = 1; halfway; calls++) {
        bool done = false;
        uint64_t hash;
        ASSERT_OK(springls_chunks_begin(s.ctx, s.chunks));
        for (k = 0; k < calls && !done; k++) ASSERT_OK(springls_chunks_continue(s.ctx, s.chunks, 0.0, &changed, &count, &done));
        halfway = !done;
        params.contouring = other;
        ASSERT_OK(springls_set_params(s.ctx, &params));
        while (!done) ASSERT_OK(springls_chunks_continue(s.ctx, s.chunks, 0.0, &changed, &count, &done));
        hash = hash_of(changed, count);
        ASSERT_OK(springls_extract_mesh(s.ctx, &mesh)); /* it ends what may be in progress */
        springls_mesh_free(s.ctx, &mesh);
        ASSERT_EQ(hash, hash_of(changed, count));
        store_put(&s.store, changed, count);
        ASSERT_OK(update(&s, &count));
        CHECK_CALL(is_the_mesh(s.ctx, &s.store));
        params.contouring = contouring;
        ASSERT_OK(springls_set_params(s.ctx, &params));
    }
    ASSERT_GT(calls, 6);
    scene_end(&s);
    PASS();
}

static bool shows(const springls_chunk *chunk, uint32_t id)
{
    int v;
    for (v = 0; v < chunk->vertex_count; v++)
        if (chunk->ids[v] == id) return true;
    return false;
}

/* Another id of a springl is told to every chunk that shows it, not to that of its particle alone. */
TEST ids_reach_across_borders(void)
{
    springls_chunks_desc desc = { .correspondences = true };
    const springls_chunk *changed;
    scene s;
    int i, k, count, showing, now, across = 0;
    contouring = SPRINGLS_CONTOURING_SPRINGLS;
    ASSERT_OK(scene_begin(&s, &desc, 0));
    ASSERT_OK(springls_chunks_update(s.ctx, s.chunks, &changed, &count));
    for (i = 0; i < 200; i++) {
        uint32_t *id = s.ctx->model.set.id + i, before = *id;
        springls_chunks_destroy(s.ctx, s.chunks);
        ASSERT_OK(springls_chunks_create(s.ctx, &desc, &s.chunks));
        ASSERT_OK(springls_chunks_update(s.ctx, s.chunks, &changed, &count));
        for (k = showing = 0; k < count; k++) showing += shows(&changed[k], before);
        if (showing < 2) continue;
        *id = 1000000;
        ASSERT_OK(springls_chunks_update(s.ctx, s.chunks, &changed, &count));
        for (k = now = 0; k < count; k++) now += shows(&changed[k], *id);
        *id = before;
        ASSERT_EQ(showing, now);
        if (++across == 5) break;
    }
    ASSERT_EQ(5, across);
    scene_end(&s);
    PASS();
}

/* Names the next test after the contouring, and what else tells its runs apart. */
static void name_run(const char *what)
{
    char suffix[48];
    snprintf(suffix, sizeof suffix, "%s%s%s", contouring == SPRINGLS_CONTOURING_SPRINGLS ? "springls" : "zero_level", *what ? "_" : "",
             what);
    greatest_set_test_suffix(suffix);
}

#define RUN(test) do { name_run(""); RUN_TEST(test); } while (0)
#define RUN_AS(what, test, ...) do { name_run(what); RUN_TESTp(test, __VA_ARGS__); } while (0)

static void run_all(springls_contouring of)
{
    contouring = of;
    RUN_AS("upright", exact_chunks_are_the_mesh, 0);
    RUN_AS("mirrored", exact_chunks_are_the_mesh, 1);
    RUN(a_consumer_may_have_the_zero_level);
    RUN(a_push_changes_what_it_touches);
    RUN(what_rests_stays);
    RUN(chunks_come_and_go);
    RUN(the_border_is_closed);
    RUN_AS("ball", material_is_that_of_the_mesh, 0, 0);
    RUN_AS("edges", material_is_that_of_the_mesh, 1, 0);
    RUN_AS("separate", material_is_that_of_the_mesh, 0, 1);
    RUN(material_comes_along);
    RUN_AS("bare", an_update_in_pieces, 0);
    RUN_AS("material", an_update_in_pieces, 1);
    RUN_AS("begun", hashing_halfway_changes_nothing, 0);
    RUN_AS("5_calls", hashing_halfway_changes_nothing, 5);
    RUN_AS("13_calls", hashing_halfway_changes_nothing, 13);
    RUN_AS("1_call", an_update_that_is_interrupted, 1);
    RUN_AS("3_calls", an_update_that_is_interrupted, 3);
    RUN_AS("9_calls", an_update_that_is_interrupted, 9);
    RUN(memory_may_run_out);
    RUN(contouring_may_change);
    RUN(contouring_may_change_halfway);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    run_all(SPRINGLS_CONTOURING_LEVEL_SET);
    run_all(SPRINGLS_CONTOURING_SPRINGLS);
    RUN_TEST(ids_reach_across_borders);
    RUN_TEST(wrong_arguments_are_told);
    GREATEST_MAIN_END();
}
