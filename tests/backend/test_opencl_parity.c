/* test_opencl_parity.c - every run of every kernel on the device against the scalar loop over the same memory, bit by bit; whole
   lives of models on the device against the same lives without one. Skipped where there is no OpenCL device that rounds as C
   does. */
#include "springls_under_test.h"
#include "histories.h"
#include "springls_cl.h"

static springls_backend *parity_backend; /* NULL: there is none here */

#define NEEDS_DEVICE() do { if (!parity_backend) SKIPm("there is no exact OpenCL device"); } while (0)

/* ---- one run of one kernel ---- */

/* Stands before the backend's own `run` while a test watches it. */
typedef struct parity_watch {
    springls_status (*run)(springls_context *ctx, int kernel, int count, springls__arguments args);
    int runs[SPRINGLS__KERNEL_COUNT];
    uint64_t changed[SPRINGLS__KERNEL_COUNT]; /* the arrays in which a run has changed a byte */
    char fault[256];                          /* the first one */
} parity_watch;

static parity_watch watch;

FIXTURE const char *parity_array_name(int array)
{
#define PARITY_NAME(name, type, block, owner, member) #name,
    static const char *const names[] = { SPRINGLS__ARRAYS(PARITY_NAME) "" };
#undef PARITY_NAME
    return names[array];
}

FIXTURE void parity_fault(int kernel, int array, size_t byte, const char *what)
{
    if (watch.fault[0]) return;
    snprintf(watch.fault, sizeof watch.fault, "%s, run %d: %s %s, element %lu, byte %lu of it", springls__kernels[kernel].name,
             watch.runs[kernel], parity_array_name(array), what,
             (unsigned long)(byte / springls__element_size((springls__array)array)),
             (unsigned long)(byte % springls__element_size((springls__array)array)));
}

/* What the device has of every array, whole buffers, to be freed; an array that it has not is NULL. */
FIXTURE springls_status parity_download(springls_context *ctx, void *copy[SPRINGLS__ARRAY_COUNT])
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        springls__buffer buffer = ctx->memory[array];
        copy[array] = NULL;
        if (!buffer.device) continue;
        buffer.data = copy[array] = malloc(buffer.device_bytes);
        if (!copy[array]) return SPRINGLS_OUT_OF_MEMORY;
        SPRINGLS__TRY(ctx->backend->transfer(ctx, &buffer, buffer.device_bytes, true));
    }
    return SPRINGLS_OK;
}

/* What is not in use becomes nonsense, the same in every run. */
FIXTURE springls_status parity_poison(springls_context *ctx)
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        springls__buffer buffer = ctx->memory[array];
        size_t used = springls__used(ctx, (springls__array)array) * springls__element_size((springls__array)array);
        springls_status status;
        if (!buffer.device || !buffer.data || used >= buffer.device_bytes) continue; /* no data: an array of the device alone */
        buffer.data = malloc(buffer.device_bytes);
        if (!buffer.data) return SPRINGLS_OUT_OF_MEMORY;
        status = ctx->backend->transfer(ctx, &buffer, used, true);
        memset((char *)buffer.data + used, 0xA5, buffer.device_bytes - used);
        if (status == SPRINGLS_OK) status = ctx->backend->transfer(ctx, &buffer, buffer.device_bytes, false);
        free(buffer.data);
        if (status != SPRINGLS_OK) return status;
    }
    return SPRINGLS_OK;
}

FIXTURE void parity_free(void *copy[SPRINGLS__ARRAY_COUNT])
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) free(copy[array]);
}

FIXTURE void parity_scalar(const springls_context *ctx, void *copy[SPRINGLS__ARRAY_COUNT], int kernel, int count,
                           springls__arguments args)
{
    springls__model model = ctx->model;
    float *lane;
#define PARITY_BIND(name, type, block, owner, member) model.owner.member = (type *)copy[SPRINGLS__ARRAY_##name];
    SPRINGLS__ARRAYS(PARITY_BIND)
#undef PARITY_BIND
    lane = (float *)malloc((size_t)springls__kernels[kernel].floats * sizeof *lane + 1);
    springls__kernels[kernel].range(&model, args, 0, count, lane);
    free(lane);
}

FIXTURE size_t parity_first_difference(const void *a, const void *b, size_t bytes)
{
    size_t i = 0;
    if (memcmp(a, b, bytes) == 0) return bytes;
    while (((const char *)a)[i] == ((const char *)b)[i]) i++;
    return i;
}

/* Whole buffers are compared, not only what is in use: a kernel that writes beyond its elements is found. */
FIXTURE void parity_compare(const springls_context *ctx, int kernel, void *before[], void *scalar[], void *device[])
{
    int array;
    watch.runs[kernel]++;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        size_t bytes = ctx->memory[array].device_bytes, at;
        bool listed = springls__kernels[kernel].writes >> array & 1u;
        if (!device[array]) continue;
        if (memcmp(before[array], device[array], bytes) != 0) watch.changed[kernel] |= (uint64_t)1 << array;
        if ((at = parity_first_difference(scalar[array], device[array], bytes)) < bytes) parity_fault(kernel, array, at, "differs");
        if (listed) continue;
        if ((at = parity_first_difference(before[array], device[array], bytes)) < bytes)
            parity_fault(kernel, array, at, "is written and not listed");
    }
}

FIXTURE springls_status parity_run(springls_context *ctx, int kernel, int count, springls__arguments args)
{
    void *before[SPRINGLS__ARRAY_COUNT] = {NULL}, *scalar[SPRINGLS__ARRAY_COUNT] = {NULL}, *device[SPRINGLS__ARRAY_COUNT] = {NULL};
    springls_status status = parity_poison(ctx);
    if (status == SPRINGLS_OK) status = parity_download(ctx, before);
    if (status == SPRINGLS_OK) status = parity_download(ctx, scalar);
    if (status == SPRINGLS_OK) {
        parity_scalar(ctx, scalar, kernel, count, args);
        status = watch.run(ctx, kernel, count, args);
    }
    if (status == SPRINGLS_OK) status = parity_download(ctx, device);
    if (status == SPRINGLS_OK) parity_compare(ctx, kernel, before, scalar, device);
    parity_free(before);
    parity_free(scalar);
    parity_free(device);
    return status;
}

/* ---- lives ---- */

enum {
    LIFE_FLUID,
    LIFE_FLUID_PAPER,
    LIFE_ELASTIC,
    LIFE_ELASTIC_PAPER,
    LIFE_SEGMENT,
    LIFE_SEGMENT_PAPER,
    LIFE_PRESERVED,
    LIFE_BOX,
    LIFE_THIN,
    LIFE_OPEN_MESH,
    LIFE_LABELS,
    LIFE_STAGES,
    LIFE_HOLLOW,
    LIFE_ASLEEP,
    LIFE_CARRIED,
    LIVES
};

enum { LIFE_SIZE = 32 };

typedef struct life {
    int which, steps;
    springls_params params;
    springls_forces forces;
    springls_step_desc step;
    springls_deformation_flow deformation;
    springls_rotation_flow rotation;
} life;

FIXTURE const char *life_name(int which)
{
    static const char *const names[LIVES] = {
        "fluid",     "fluid, paper", "elastic",    "elastic, paper", "segmentation", "segmentation, paper",
        "preserved", "box",          "thin sheet", "open mesh",      "labels",       "stages",
        "hollow",    "asleep",       "carried"};
    return names[which];
}

/* Of an image of two balls that touch, pushes outwards in them and inwards elsewhere. */
static float life_pressure[LIFE_SIZE * LIFE_SIZE * LIFE_SIZE];

FIXTURE void life_image(void)
{
    int i;
    for (i = 0; i < LIFE_SIZE * LIFE_SIZE * LIFE_SIZE; i++) {
        float x = (float)(i % LIFE_SIZE), y = (float)(i / LIFE_SIZE % LIFE_SIZE), z = (float)(i / (LIFE_SIZE * LIFE_SIZE)), d,
              point[3];
        point[0] = x; point[1] = y; point[2] = z;
        history_two_balls(NULL, point, 1, &d);
        life_pressure[i] = springls__clamp(-0.5f * d, -1.0f, 1.0f);
    }
}

FIXTURE void life_outwards(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)time;
    for (i = 0; i < 3 * count; i++) out[i] = points[i] - 15.5f;
}

FIXTURE void life_make(life *l, int which)
{
    const float middle = 0.5f * (float)(LIFE_SIZE - 1);
    bool paper = which == LIFE_FLUID_PAPER || which == LIFE_ELASTIC_PAPER || which == LIFE_SEGMENT_PAPER;
    int axis;
    memset(l, 0, sizeof *l);
    l->which = which;
    l->params = paper ? springls_paper_params() : springls_default_params();
    l->deformation.grid_size = (float)LIFE_SIZE;
    l->deformation.period = 2.5f;
    for (axis = 0; axis < 3; axis++) l->rotation.center[axis] = middle;
    l->rotation.axis[0] = 0.3f;
    l->rotation.axis[2] = 1.0f;
    l->rotation.angular_velocity = 0.1f;
    l->forces = fixture_forces(springls_velocity_deformation, &l->deformation);
    l->step = fixture_step(&l->forces, SPRINGLS_MODE_FLUID, 0.03f);
    l->steps = paper ? 11 : 7;
    switch (which) {
    case LIFE_FLUID:
        l->params.volume_lock = 1;
        l->step.dt = 0.3f;
        l->step.max_displacement = 2.0f;
        l->steps = 3;
        break;
    case LIFE_ELASTIC: case LIFE_ELASTIC_PAPER:
        l->step.mode = SPRINGLS_MODE_ELASTIC;
        l->step.dt = 0.1f;
        l->steps = 4;
        break;
    case LIFE_SEGMENT: case LIFE_SEGMENT_PAPER:
        l->forces = fixture_forces(NULL, NULL);
        l->forces.pressure_grid.data = life_pressure;
        l->forces.curvature_weight = 0.2f;
        l->params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        l->params.curvature = 0.1f;
        l->step.stop_at_topology = true;
        l->step.dt = 0.0f;
        break;
    case LIFE_PRESERVED: /* two balls that want to merge */
        l->forces = fixture_forces(history_inwards, NULL);
        l->params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        l->params.contact = SPRINGLS_CONTACT_SEPARATE;
        l->step.dt = 1.0f;
        break;
    case LIFE_BOX:
        l->forces = fixture_forces(springls_velocity_rotation, &l->rotation);
        l->step.dt = 1.0f;
        l->steps = 4;
        break;
    case LIFE_THIN:
        l->forces = fixture_forces(history_inwards, NULL);
        l->step.dt = 1.5f;
        break;
    case LIFE_OPEN_MESH:
        l->forces = fixture_forces(NULL, NULL);
        l->forces.affine = history_affine;
        l->forces.integrator = SPRINGLS_INTEGRATOR_EULER;
        l->step.mode = SPRINGLS_MODE_ELASTIC;
        l->step.dt = 1.0f;
        l->steps = 3;
        break;
    case LIFE_ASLEEP: /* at rest, then turned at one end */
        l->forces = fixture_forces(springls_velocity_rotation, &l->rotation);
        l->forces.region_upper[0] = 6.0f;
        l->forces.region_upper[1] = l->forces.region_upper[2] = (float)LIFE_SIZE;
        l->params.resample_period = 2;
        l->params.lazy_distance = 0.0f;
        l->step.dt = 1.0f;
        l->steps = 32;
        break;
    case LIFE_CARRIED: /* round a far place, in a window that follows */
        l->forces = fixture_forces(springls_velocity_rotation, &l->rotation);
        l->rotation.center[1] = 150.0f;
        l->rotation.angular_velocity = 0.02f;
        l->step.dt = 1.0f;
        l->step.max_displacement = 2.0f;
        break;
    case LIFE_LABELS:
        l->forces = fixture_forces(history_inwards, NULL);
        l->params.contact = SPRINGLS_CONTACT_SEPARATE;
        l->step.dt = 1.0f;
        l->step.max_displacement = 0.3f;
        l->steps = 3;
        break;
    case LIFE_STAGES: /* a cube grows until bricks lie in it that were on its border; holes are filled from the level set, by springls
                         that find their place among the others */
        l->forces = fixture_forces(life_outwards, NULL);
        l->forces.integrator = SPRINGLS_INTEGRATOR_EULER;
        l->params.fill_from_springls = 0;
        l->step.dt = 0.86f;
        l->steps = 1;
        break;
    case LIFE_HOLLOW: /* the same with a cavity, components and bodies that new springls belong to */
        l->forces = fixture_forces(life_outwards, NULL);
        l->params.fill_from_springls = 0;
        l->params.components = 1;
        l->params.contact = SPRINGLS_CONTACT_SEPARATE;
        l->step.dt = 0.86f;
        l->steps = 1;
        break;
    default: break;
    }
}

/* A cube with a cavity. */
FIXTURE void life_hollow_cube(void *user, const float *points, int count, float *out)
{
    const springls_box *cube = (const springls_box *)user;
    int i;
    springls_implicit_box(user, points, count, out);
    for (i = 0; i < count; i++) {
        float r = springls__length(springls__sub(springls__load3(points + 3 * i), springls__load3(cube->center)));
        out[i] = springls__max(out[i], 0.5f * cube->half[0] - r);
    }
}

FIXTURE springls_status life_begin(const life *l, springls_context *ctx)
{
    springls_sphere ball =
        fixture_ball(11.2f, 11.2f, 11.2f, l->which == LIFE_SEGMENT || l->which == LIFE_SEGMENT_PAPER ? 3.5f : 5.0f);
    springls_box box = { { 15.5f, 15.5f, 15.5f }, { 6.3f, 5.0f, 4.2f } }, cube = { { 15.5f, 15.5f, 15.5f }, { 7.0f, 7.0f, 7.0f } };
    switch (l->which) {
    case LIFE_PRESERVED: return springls_set_implicit(ctx, history_two_balls, NULL);
    case LIFE_BOX: return springls_set_implicit(ctx, springls_implicit_box, &box);
    case LIFE_THIN: box.half[0] = 4.0f; return springls_set_implicit(ctx, springls_implicit_box, &box);
    case LIFE_STAGES: return springls_set_implicit(ctx, springls_implicit_box, &cube);
    case LIFE_HOLLOW: return springls_set_implicit(ctx, life_hollow_cube, &cube);
    case LIFE_OPEN_MESH: return history_open_mesh(ctx);
    case LIFE_LABELS: return history_blobs(ctx);
    case LIFE_ASLEEP:
        ball = fixture_ball(15.5f, 15.5f, 15.5f, 12.0f);
        return springls_set_implicit(ctx, springls_implicit_sphere, &ball);
    default: return springls_set_implicit(ctx, springls_implicit_sphere, &ball);
    }
}

/* Every third springl keeps its shape. */
FIXTURE springls_status life_mask(springls_context *ctx)
{
    static uint8_t mask[20000];
    int i;
    if (springls_count(ctx) > 20000) return SPRINGLS_INVALID_ARGUMENT;
    for (i = 0; i < springls_count(ctx); i++) mask[i] = i % 3 == 0;
    return springls_set_keep_mask(ctx, mask);
}

/* Moves every third of the springls a little: by both parts, by particles alone, by vertices alone. */
FIXTURE springls_status life_write(springls_context *ctx)
{
    static float vertices[9 * 20000], particles[3 * 20000];
    int third = springls_count(ctx) / 3, part, i, m;
    if (3 * third > 20000) return SPRINGLS_INVALID_ARGUMENT;
    for (i = 0; i < 3 * third; i++) {
        springls__v3 p = fixture_particle(ctx, i), off = springls__v3_make(0.2f, 0.01f * (float)(i % 7), -0.1f);
        p = springls__add(p, off);
        memcpy(particles + 3 * i, &p, sizeof p);
        for (m = 0; m < 3; m++) {
            springls__v3 q = springls__add(fixture_vertex(ctx, i, m), off);
            memcpy(vertices + 9 * i + 3 * m, &q, sizeof q);
        }
    }
    for (part = 0; part < 3; part++)
        SPRINGLS__TRY(springls_write(ctx, part * third, third, part == 1 ? NULL : vertices + 9 * part * third,
                                     part == 2 ? NULL : particles + 3 * part * third));
    return SPRINGLS_OK;
}

/* Stages in an order that no step has. */
FIXTURE springls_status life_stages(springls_context *ctx, const life *l)
{
    static springls_status (*const stages[])(springls_context *) = {springls_unsigned_to_signed,
                                                                    springls_track,
                                                                    springls_relax,
                                                                    springls_evolve,
                                                                    springls_rebuild,
                                                                    springls_fill_gaps,
                                                                    springls_contract,
                                                                    springls_resample,
                                                                    springls_unsigned_to_signed,
                                                                    springls_evolve,
                                                                    springls_relax,
                                                                    springls_fill_gaps,
                                                                    springls_track};
    size_t i;
    if (l->which == LIFE_HOLLOW) SPRINGLS__TRY(springls_step(ctx, &l->step)); /* which finds components and bodies */
    SPRINGLS__TRY(springls_advect(ctx, &l->forces, 0.1f, l->step.dt));
    SPRINGLS__TRY(life_write(ctx));
    for (i = 0; i < sizeof stages / sizeof *stages; i++) SPRINGLS__TRY(stages[i](ctx));
    return SPRINGLS_OK;
}

/* Nothing moves until the model is at rest; at last a stage wakes all of it. */
FIXTURE springls_status life_asleep(springls_context *ctx, const life *l)
{
    const int at_rest = 24, steps = springls_get_stats(ctx).steps;
    springls_step_desc step = l->step;
    if (steps < at_rest) step.forces = NULL;
    else if (steps == at_rest && !ctx->at_rest) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls_step(ctx, &step));
    return steps == l->steps - 1 ? springls_relax(ctx) : SPRINGLS_OK;
}

FIXTURE springls_status life_step(springls_context *ctx, const life *l)
{
    if (l->which == LIFE_ASLEEP) return life_asleep(ctx, l);
    return l->which == LIFE_STAGES || l->which == LIFE_HOLLOW ? life_stages(ctx, l) : springls_step(ctx, &l->step);
}

FIXTURE springls_context *life_context(const life *l, springls_backend *backend)
{
    springls_desc desc = fixture_desc(LIFE_SIZE, &l->params);
    springls_context *ctx = NULL;
    desc.backend = backend;
    desc.follow = l->which == LIFE_CARRIED;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return NULL;
    if (life_begin(l, ctx) == SPRINGLS_OK && (l->which != LIFE_FLUID || life_mask(ctx) == SPRINGLS_OK)) return ctx;
    springls_destroy(ctx);
    return NULL;
}

/* The mesh at the end of a life, mixed into the hash of its state. */
FIXTURE uint64_t life_mesh(springls_context *ctx)
{
    uint64_t hash = springls_state_hash(ctx);
    springls_mesh mesh;
    if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) return 0;
    hash = history_mix(hash, mesh.positions, (size_t)mesh.vertex_count * 3 * sizeof(float));
    hash = history_mix(hash, mesh.normals, (size_t)mesh.vertex_count * 3 * sizeof(float));
    hash = history_mix(hash, mesh.correspondences, (size_t)mesh.vertex_count * 3 * sizeof(float));
    hash = history_mix(hash, mesh.springls, (size_t)mesh.vertex_count * sizeof(int));
    hash = history_mix(hash, mesh.triangles, (size_t)mesh.triangle_count * 3 * sizeof(int));
    springls_mesh_free(ctx, &mesh);
    return hash;
}

/* State and mesh at the end; 0 on failure. */
FIXTURE uint64_t life_hash(int which, springls_backend *backend)
{
    life l;
    springls_context *ctx;
    uint64_t hash;
    int i, ok;
    life_make(&l, which);
    ctx = life_context(&l, backend);
    for (i = 0, ok = ctx != NULL; ok && i < l.steps; i++) ok = life_step(ctx, &l) == SPRINGLS_OK;
    hash = ok ? life_mesh(ctx) : 0;
    springls_destroy(ctx);
    return hash;
}

/* ---- kernel by kernel ---- */

TEST every_run_has_the_scalar_bits(int which)
{
    uint64_t hash;
    NEEDS_DEVICE();
    watch.fault[0] = 0;
    watch.run = parity_backend->run;
    parity_backend->run = parity_run;
    hash = life_hash(which, parity_backend);
    parity_backend->run = watch.run;
    if (watch.fault[0]) FAILm(watch.fault);
    ASSERT(hash != 0);
    ASSERT(hash == life_hash(which, NULL));
    PASS();
}

/* After the lives above: no kernel has been left out, and none lists an array that it never writes, which would only cost
   transfers. */
TEST every_kernel_was_seen_to_write_what_it_lists(int kernel)
{
    static char message[256];
    uint64_t missing;
    int array;
    NEEDS_DEVICE();
    snprintf(message, sizeof message, "%s has run", springls__kernels[kernel].name);
    ASSERTm(message, watch.runs[kernel] > 0);
    missing = springls__kernels[kernel].writes & ~watch.changed[kernel];
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++)
        if (missing >> array & 1u) {
            snprintf(message, sizeof message, "%s has changed %s", springls__kernels[kernel].name, parity_array_name(array));
            FAILm(message);
        }
    PASS();
}

/* ---- whole lives ---- */

TEST same_bits_from_run_to_run(int which)
{
    uint64_t hash;
    NEEDS_DEVICE();
    hash = life_hash(which, parity_backend);
    ASSERT(hash != 0);
    ASSERT(hash == life_hash(which, parity_backend));
    ASSERT(hash == life_hash(which, NULL));
    PASS();
}

/* A backend serves several contexts; here they take turns. */
TEST two_contexts_on_one_backend(void)
{
    springls_context *ctx[2];
    life l[2];
    int i, k;
    NEEDS_DEVICE();
    for (k = 0; k < 2; k++) {
        life_make(&l[k], k ? LIFE_ELASTIC : LIFE_THIN);
        ctx[k] = life_context(&l[k], parity_backend);
        ASSERT(ctx[k] != NULL);
    }
    for (i = 0; i < 7; i++)
        for (k = 0; k < 2; k++)
            if (i < l[k].steps) ASSERT_OK(springls_step(ctx[k], &l[k].step));
    for (k = 0; k < 2; k++) {
        ASSERT(life_mesh(ctx[k]) == life_hash(l[k].which, NULL));
        springls_destroy(ctx[k]);
    }
    PASS();
}

/* A life with all that may happen between its steps; `disturb` does it. */
FIXTURE uint64_t life_disturbed(int which, springls_backend *backend,
                                springls_status (*disturb)(springls_context *ctx, life *l, int step))
{
    life l;
    springls_context *ctx;
    uint64_t hash;
    int i, ok;
    life_make(&l, which);
    ctx = life_context(&l, backend);
    for (i = 0, ok = ctx != NULL; ok && i < l.steps; i++)
        ok = springls_step(ctx, &l.step) == SPRINGLS_OK && disturb(ctx, &l, i) == SPRINGLS_OK;
    hash = ok ? life_mesh(ctx) : 0;
    springls_destroy(ctx);
    return hash;
}

FIXTURE springls_status disturb_with_questions(springls_context *ctx, life *l, int step)
{
    (void)l;
    (void)step;
    return history_digest(ctx) ? SPRINGLS_OK : SPRINGLS_INVALID_ARGUMENT;
}

FIXTURE springls_status disturb_with_views(springls_context *ctx, life *l, int step)
{
    static float phi[LIFE_SIZE * LIFE_SIZE * LIFE_SIZE];
    springls_view vertices = springls_view_vertices(ctx), particles = springls_view_particles(ctx),
                  origins = springls_view_correspondences(ctx);
    float sum = 0.0f;
    int i;
    (void)l;
    (void)step;
    for (i = 0; i < springls_count(ctx); i++) {
        springls__v3 p = fixture_at(particles, i, 0);
        float furthest = springls__length(springls__sub(fixture_at(vertices, i, 1), p));
        if (!(furthest > 0.0f && furthest < 5.0f)) return SPRINGLS_INVALID_ARGUMENT;
        sum += fixture_at(origins, i, 0).x + (float)springls_ids(ctx)[i] + (float)springls_generations(ctx)[i];
    }
    SPRINGLS__TRY(springls_copy_level_set(ctx, phi));
    return sum > 0.0f && phi[0] > 0.0f ? SPRINGLS_OK : SPRINGLS_INVALID_ARGUMENT;
}

FIXTURE springls_status disturb_with_parameters(springls_context *ctx, life *l, int step)
{
    springls_params p = springls_get_params(ctx);
    (void)l;
    p.capture_range = step % 2 ? 2.0f : 2.5f;
    p.relax_iterations = 1 + step % 3;
    p.neighbor_radius = 0.6f + 0.1f * (float)(step % 2);
    p.evolve_iterations = step % 2 ? 4 : p.evolve_iterations;
    p.resample_period = 1 + step % 2;
    return springls_set_params(ctx, &p);
}

FIXTURE springls_status disturb_with_modes(springls_context *ctx, life *l, int step)
{
    static const springls_mode modes[3] = { SPRINGLS_MODE_ADVECT_ONLY, SPRINGLS_MODE_ELASTIC, SPRINGLS_MODE_FLUID };
    (void)ctx;
    l->step.mode = modes[step % 3];
    l->step.one_to_one = step % 4 == 3;
    return SPRINGLS_OK;
}

FIXTURE springls_status disturb_with_inputs(springls_context *ctx, life *l, int step)
{
    if (step == 1) return springls_set_reference(ctx);
    if (step == 2) return springls_reset(ctx) == SPRINGLS_OK ? life_begin(l, ctx) : SPRINGLS_INVALID_ARGUMENT;
    if (step == 3) return history_blobs(ctx);
    if (step == 4) return life_mask(ctx);
    return SPRINGLS_OK;
}

/* Pressure along the normal and affine maps, by host code, asked for by every block of springls between kernels. */
FIXTURE void life_breath(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)normals;
    for (i = 0; i < count; i++) out[i] = 0.3f * (points[3 * i] > 15.0f ? 1.0f : -1.0f) + 0.1f * time;
}

FIXTURE springls_status disturb_with_writes(springls_context *ctx, life *l, int step)
{
    (void)l;
    (void)step;
    return life_write(ctx);
}

/* A velocity by index and id of springls. */
FIXTURE void life_by_springl(void *user, const springls_batch *batch, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < batch->count; i++) {
        out[3 * i] = 0.1f * (float)(batch->springls[i] % 3);
        out[3 * i + 1] = 0.05f * (float)(batch->ids[i] % 5);
        out[3 * i + 2] = 0.02f * batch->correspondences[3 * i] - 0.3f;
    }
}

FIXTURE springls_status disturb_with_callbacks(springls_context *ctx, life *l, int step)
{
    float speed;
    l->forces.pressure = step % 2 ? life_breath : NULL;
    l->forces.affine = step % 3 ? history_affine : NULL;
    l->forces.velocity = step % 4 ? history_inwards : NULL;
    l->forces.velocity_batch = step % 4 == 1 ? life_by_springl : NULL;
    l->step.dt = 0.2f;
    return springls_max_speed(ctx, &l->forces, 0.0f, &speed);
}

/* What an engine draws from is what a view shows. */
TEST the_device_hands_out_its_springls(void)
{
    springls_context *ctx;
    springls__springl *there;
    springls__cl *cl;
    springls_view view;
    void *memory;
    life l;
    size_t bytes;
    int i, k;
    NEEDS_DEVICE();
    ASSERT(springls_cl_springl_buffer(NULL) == NULL);
    life_make(&l, LIFE_THIN);
    ctx = life_context(&l, parity_backend);
    ASSERT(ctx != NULL);
    ASSERT_OK(springls_step(ctx, &l.step));
    memory = springls_cl_springl_buffer(ctx);
    ASSERT(memory != NULL);
    bytes = (size_t)springls_count(ctx) * sizeof *there;
    there = (springls__springl *)malloc(bytes);
    ASSERT(there != NULL);
    cl = (springls__cl *)(void *)parity_backend;
    ASSERT_EQ(CL_SUCCESS, cl->EnqueueReadBuffer(cl->queue, (cl_mem)memory, CL_TRUE, 0, bytes, there, 0, NULL, NULL));
    view = springls_view_vertices(ctx);
    for (i = 0; i < view.count; i++)
        for (k = 0; k < 9; k++)
            ASSERT_EQ(((const float *)(const void *)((const char *)view.data + (size_t)i * view.stride))[k], (&there[i].q[0].x)[k]);
    free(there);
    springls_reset(ctx);
    ASSERT(springls_cl_springl_buffer(ctx) == NULL);
    springls_destroy(ctx);
    PASS();
}

TEST what_happens_between_steps(springls_status (*disturb)(springls_context *ctx, life *l, int step), bool changes_nothing)
{
    static const int lives[] = { LIFE_THIN, LIFE_FLUID_PAPER, LIFE_SEGMENT };
    size_t i;
    NEEDS_DEVICE();
    for (i = 0; i < sizeof lives / sizeof *lives; i++) {
        uint64_t hash = life_disturbed(lives[i], parity_backend, disturb);
        ASSERT(hash != 0);
        ASSERT(hash == life_disturbed(lives[i], NULL, disturb));
        ASSERT(changes_nothing == (hash == life_hash(lives[i], NULL)));
    }
    PASS();
}

/* What has been asked for once is not fetched again before the model changes, and asking uploads nothing. */
TEST questions_fetch_once(void)
{
    springls_cl_counts before, after;
    springls_context *ctx;
    springls_hit first[8], second[8];
    float points[3 * 8];
    int i;
    life l;
    NEEDS_DEVICE();
    for (i = 0; i < 3 * 8; i++) points[i] = 2.0f * (float)(i % 13);
    life_make(&l, LIFE_THIN);
    ctx = life_context(&l, parity_backend);
    ASSERT(ctx != NULL);
    ASSERT_OK(springls_step(ctx, &l.step));
    before = springls_cl_get_counts(parity_backend);
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 8, first));
    after = springls_cl_get_counts(parity_backend);
    ASSERT_GT(after.downloads, before.downloads);
    ASSERT(after.uploads == before.uploads);
    before = after;
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 8, second));
    ASSERT_MEM_EQ(first, second, sizeof first);
    ASSERT(springls_state_hash(ctx) != 0);
    after = springls_cl_get_counts(parity_backend);
    ASSERT(after.downloads == before.downloads);
    ASSERT(after.kernels == before.kernels);
    springls_destroy(ctx);
    PASS();
}

/* Advect waits for the device once: one reading finds the largest displacement and how many springls move. */
TEST advect_reads_once(void)
{
    springls_deformation_flow flow = { 32.0f, 1.5f };
    springls_forces forces = fixture_forces(springls_velocity_deformation, &flow);
    springls_cl_counts before, after;
    springls_context *ctx;
    life l;
    NEEDS_DEVICE();
    life_make(&l, LIFE_THIN);
    ctx = life_context(&l, parity_backend);
    ASSERT(ctx != NULL);
    ASSERT_OK(springls_advect(ctx, &forces, 0.3f, 0.01f));
    before = springls_cl_get_counts(parity_backend);
    ASSERT_OK(springls_advect(ctx, &forces, 0.31f, 0.01f));
    after = springls_cl_get_counts(parity_backend);
    ASSERT_EQ(1, (int)(after.downloads - before.downloads));
    springls_destroy(ctx);
    PASS();
}

/* Steps wait for the device a few times each: what several stages count is read together. */
TEST steps_read_little(void)
{
    enum { LAZY, WHOLE, RESAMPLING, KINDS, FIRST = 16 }; /* before FIRST half of the springls merge, in many rounds */
    /* a whole step has 51 to 58 kernels, and 5 more where it lists springls larger than a cell */
    static const struct { int downloads, kernels; } most[KINDS] = { { 1, 5 }, { 4, 63 }, { 17, 190 } };
    springls_context *ctx;
    int i, seen[KINDS] = { 0, 0, 0 };
    life l;
    NEEDS_DEVICE();
    life_make(&l, LIFE_ELASTIC);
    l.step.mode = SPRINGLS_MODE_FLUID;
    ctx = life_context(&l, parity_backend);
    ASSERT(ctx != NULL);
    for (i = 0; i < 48; i++) {
        springls_cl_counts before = springls_cl_get_counts(parity_backend), after;
        int kind;
        l.step.dt = i % 2 ? 0.001f : 0.04f;
        ASSERT_OK(springls_step(ctx, &l.step));
        after = springls_cl_get_counts(parity_backend);
        kind = springls__phi_lags(ctx) ? LAZY : ctx->step.resamples ? RESAMPLING : WHOLE;
        if (i < FIRST) continue;
        ASSERT_LTE((int)(after.downloads - before.downloads), most[kind].downloads);
        ASSERT_LTE((int)(after.kernels - before.kernels), most[kind].kernels);
        seen[kind]++;
    }
    for (i = 0; i < KINDS; i++) ASSERT_GT(seen[i], 1);
    springls_destroy(ctx);
    PASS();
}

/* Rays and closest points of either surface have the same bits after the same steps. */
TEST queries_are_equal(void)
{
    enum { COUNT = 200 };
    static springls_hit hits[2][COUNT];
    float points[3 * COUNT], directions[3 * COUNT];
    springls_context *ctx[2];
    int i, b, surface, found = 0;
    life l;
    NEEDS_DEVICE();
    life_make(&l, LIFE_THIN);
    for (b = 0; b < 2; b++) {
        ctx[b] = life_context(&l, b ? parity_backend : NULL);
        ASSERT(ctx[b] != NULL);
        ASSERT_OK(springls_run(ctx[b], &l.step, 2));
    }
    fixture_seed(23);
    for (i = 0; i < 3 * COUNT; i++) {
        points[i] = fixture_between(0.0f, 30.0f);
        directions[i] = fixture_between(8.0f, 22.0f) - points[i];
    }
    for (surface = 0; surface < 2; surface++) {
        for (b = 0; b < 2; b++)
            ASSERT_OK(springls_raycast(ctx[b], (springls_surface)surface, points, directions, COUNT, 0.0f, hits[b]));
        ASSERT_MEM_EQ(hits[0], hits[1], sizeof hits[0]);
        for (i = 0; i < COUNT; i++) found += hits[0][i].springl >= 0;
        for (b = 0; b < 2; b++) ASSERT_OK(springls_closest(ctx[b], (springls_surface)surface, points, COUNT, hits[b]));
        ASSERT_MEM_EQ(hits[0], hits[1], sizeof hits[0]);
    }
    ASSERT_GT(found, 20);
    for (b = 0; b < 2; b++) springls_destroy(ctx[b]);
    PASS();
}

/* A write sends its range to the device and nothing more, and fetches nothing. */
TEST writes_send_their_range(void)
{
    springls_cl_counts before, after;
    springls_context *ctx;
    float vertices[9 * 10], particles[3 * 10];
    int i, m;
    life l;
    NEEDS_DEVICE();
    life_make(&l, LIFE_THIN);
    ctx = life_context(&l, parity_backend);
    ASSERT(ctx != NULL);
    ASSERT_OK(springls_step(ctx, &l.step));
    for (i = 0; i < 10; i++) {
        springls__v3 p = fixture_particle(ctx, 20 + i);
        memcpy(particles + 3 * i, &p, sizeof p);
        for (m = 0; m < 3; m++) {
            springls__v3 q = fixture_vertex(ctx, 20 + i, m);
            memcpy(vertices + 9 * i + 3 * m, &q, sizeof q);
        }
        particles[3 * i] += 0.5f;
    }
    before = springls_cl_get_counts(parity_backend);
    ASSERT_OK(springls_write(ctx, 20, 10, vertices, particles));
    after = springls_cl_get_counts(parity_backend);
    ASSERT_EQ(sizeof vertices + sizeof particles, after.bytes_up - before.bytes_up);
    ASSERT_EQ(0u, after.bytes_down - before.bytes_down);
    for (i = 0; i < 10; i++) ASSERT_EQ(particles[3 * i], fixture_particle(ctx, 20 + i).x);
    springls_destroy(ctx);
    PASS();
}

/* A context that has worked on the device takes springls with correspondences of their own, and works on. */
FIXTURE uint64_t life_of_springls(springls_backend *backend)
{
    static float vertices[9 * 20000], origins[3 * 20000];
    springls_context *ctx;
    uint64_t hash = 0;
    int i, m, count;
    life l;
    life_make(&l, LIFE_ELASTIC);
    ctx = life_context(&l, backend);
    if (!ctx) return 0;
    if (springls_step(ctx, &l.step) == SPRINGLS_OK && springls_count(ctx) <= 20000) {
        count = springls_count(ctx);
        for (i = 0; i < count; i++) {
            springls__v3 a = fixture_origin(ctx, i);
            for (m = 0; m < 3; m++) {
                springls__v3 q = fixture_vertex(ctx, i, m);
                memcpy(vertices + 9 * i + 3 * m, &q.x, sizeof q);
            }
            origins[3 * i] = a.x + 0.25f;
            origins[3 * i + 1] = a.y;
            origins[3 * i + 2] = a.z;
        }
        if (springls_set_springls(ctx, vertices, NULL, origins, count) == SPRINGLS_OK && springls_step(ctx, &l.step) == SPRINGLS_OK)
            hash = life_mesh(ctx);
    }
    springls_destroy(ctx);
    return hash;
}

TEST springls_are_taken_afresh(void)
{
    uint64_t hash;
    NEEDS_DEVICE();
    hash = life_of_springls(parity_backend);
    ASSERT(hash != 0);
    ASSERT(hash == life_of_springls(NULL));
    PASS();
}

SUITE(lives)
{
    static const struct {
        const char *name;
        springls_status (*disturb)(springls_context *ctx, life *l, int step);
        bool changes_nothing;
    } between[] = {{"questions", disturb_with_questions, true},    {"views", disturb_with_views, true},
                   {"parameters", disturb_with_parameters, false}, {"modes", disturb_with_modes, false},
                   {"inputs", disturb_with_inputs, false},         {"callbacks", disturb_with_callbacks, false},
                   {"writes", disturb_with_writes, false}};
    size_t i;
    for (i = 0; i < LIVES; i++) {
        greatest_set_test_suffix(life_name((int)i));
        RUN_TESTp(same_bits_from_run_to_run, (int)i);
    }
    RUN_TEST(two_contexts_on_one_backend);
    RUN_TEST(the_device_hands_out_its_springls);
    for (i = 0; i < sizeof between / sizeof *between; i++) {
        greatest_set_test_suffix(between[i].name);
        RUN_TESTp(what_happens_between_steps, between[i].disturb, between[i].changes_nothing);
    }
    RUN_TEST(questions_fetch_once);
    RUN_TEST(advect_reads_once);
    RUN_TEST(steps_read_little);
    RUN_TEST(queries_are_equal);
    RUN_TEST(writes_send_their_range);
    RUN_TEST(springls_are_taken_afresh);
}

SUITE(kernels)
{
    int i;
    memset(&watch, 0, sizeof watch);
    for (i = 0; i < LIVES; i++) {
        greatest_set_test_suffix(life_name(i));
        RUN_TESTp(every_run_has_the_scalar_bits, i);
    }
    for (i = 0; i < SPRINGLS__KERNEL_COUNT; i++) {
        greatest_set_test_suffix(springls__kernels[i].name);
        RUN_TESTp(every_kernel_was_seen_to_write_what_it_lists, i);
    }
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    life_image();
    if (springls_cl_create(NULL, &parity_backend) != SPRINGLS_OK || !springls_cl_exact(parity_backend)) {
        springls_cl_destroy(parity_backend);
        parity_backend = NULL;
    }
    RUN_SUITE(kernels);
    RUN_SUITE(lives);
    springls_cl_destroy(parity_backend);
    GREATEST_MAIN_END();
}
