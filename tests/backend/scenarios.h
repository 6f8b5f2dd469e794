/* scenarios.h - models for the tests of a device: what a model begins as, what moves it, and for how many steps. Together they run
   every kernel. A test includes springls_under_test.h before. */
#ifndef SCENARIOS_H
#define SCENARIOS_H

#include "histories.h"
#include "springls_cl.h"

static springls_backend *test_device; /* NULL: there is none here that rounds as C does */

#define NEEDS_DEVICE() do { if (!test_device) SKIPm("there is no exact OpenCL device"); } while (0)

enum {
    SCENARIO_FLUID,
    SCENARIO_FLUID_PAPER,
    SCENARIO_ELASTIC,
    SCENARIO_ELASTIC_PAPER,
    SCENARIO_SEGMENT,
    SCENARIO_SEGMENT_PAPER,
    SCENARIO_PRESERVED,
    SCENARIO_BOX,
    SCENARIO_THIN,
    SCENARIO_OPEN_MESH,
    SCENARIO_LABELS,
    SCENARIO_STAGES,
    SCENARIO_HOLLOW,
    SCENARIO_ASLEEP,
    SCENARIO_CARRIED,
    SCENARIOS
};

enum { SCENARIO_SIZE = 32 };

typedef struct scenario {
    int which, steps;
    springls_params params;
    springls_forces forces;
    springls_step_desc step;
    struct exact_flow deformation;
    struct exact_flow rotation;
} scenario;

FIXTURE const char *scenario_name(int which)
{
    static const char *const names[SCENARIOS] = {
        "fluid",     "fluid, paper", "elastic",    "elastic, paper", "segmentation", "segmentation, paper",
        "preserved", "box",          "thin sheet", "open mesh",      "labels",       "stages",
        "hollow",    "asleep",       "carried"};
    return names[which];
}

/* Of an image of two balls that touch, pushes outwards in them and inwards elsewhere. */
static float scenario_pressure[SCENARIO_SIZE * SCENARIO_SIZE * SCENARIO_SIZE];

FIXTURE void scenario_image(void)
{
    int i;
    for (i = 0; i < SCENARIO_SIZE * SCENARIO_SIZE * SCENARIO_SIZE; i++) {
        float point[3], d;
        point[0] = (float)(i % SCENARIO_SIZE);
        point[1] = (float)(i / SCENARIO_SIZE % SCENARIO_SIZE);
        point[2] = (float)(i / (SCENARIO_SIZE * SCENARIO_SIZE));
        history_two_balls(NULL, point, 1, &d);
        scenario_pressure[i] = springls__clamp(-0.5f * d, -1.0f, 1.0f);
    }
}

FIXTURE void scenario_outwards(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)time;
    for (i = 0; i < 3 * count; i++) out[i] = points[i] - 15.5f;
}

FIXTURE void scenario_make(scenario *s, int which)
{
    const float middle = 0.5f * (float)(SCENARIO_SIZE - 1);
    bool paper = which == SCENARIO_FLUID_PAPER || which == SCENARIO_ELASTIC_PAPER || which == SCENARIO_SEGMENT_PAPER;
    int axis;
    memset(s, 0, sizeof *s);
    s->which = which;
    s->params = paper ? springls_paper_params() : springls_default_params();
    s->deformation.size = (float)SCENARIO_SIZE;
    s->deformation.period = 2.5f;
    for (axis = 0; axis < 3; axis++) s->rotation.center[axis] = middle;
    s->rotation.axis[0] = 0.3f;
    s->rotation.axis[2] = 1.0f;
    s->rotation.angular_velocity = 0.1f;
    s->forces = fixture_forces(exact_flow_velocity, &s->deformation);
    s->step = fixture_step(&s->forces, SPRINGLS_MODE_FLUID, 0.03f);
    s->steps = paper ? 11 : 7;
    switch (which) {
    case SCENARIO_FLUID:
        s->params.volume_lock = 1;
        s->step.dt = 0.3f;
        s->step.max_displacement = 0.0f; /* divided as suits the parameters */
        s->steps = 3;
        break;
    case SCENARIO_ELASTIC: case SCENARIO_ELASTIC_PAPER:
        s->step.mode = SPRINGLS_MODE_ELASTIC;
        s->step.dt = 0.1f;
        s->steps = 4;
        break;
    case SCENARIO_SEGMENT: case SCENARIO_SEGMENT_PAPER:
        s->forces = fixture_forces(NULL, NULL);
        s->forces.pressure_grid.data = scenario_pressure;
        s->forces.curvature_weight = 0.2f;
        s->params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        s->params.curvature = 0.1f;
        s->step.stop_at_topology = true;
        s->step.dt = 0.0f;
        break;
    case SCENARIO_PRESERVED: /* two balls that would merge */
        s->forces = fixture_forces(history_inwards, NULL);
        s->params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        s->params.contact = SPRINGLS_CONTACT_SEPARATE;
        s->step.dt = 1.0f;
        break;
    case SCENARIO_BOX:
        s->forces = fixture_forces(exact_flow_velocity, &s->rotation);
        s->step.dt = 1.0f;
        s->steps = 4;
        break;
    case SCENARIO_THIN:
        s->forces = fixture_forces(history_inwards, NULL);
        s->step.dt = 1.5f;
        break;
    case SCENARIO_OPEN_MESH:
        s->forces = fixture_forces(NULL, NULL);
        s->forces.affine = history_affine;
        s->forces.integrator = SPRINGLS_INTEGRATOR_EULER;
        s->step.mode = SPRINGLS_MODE_ELASTIC;
        s->step.dt = 1.0f;
        s->steps = 3;
        break;
    case SCENARIO_ASLEEP: /* at rest, then turned at one end */
        s->forces = fixture_forces(exact_flow_velocity, &s->rotation);
        s->forces.region_upper[0] = 6.0f;
        s->forces.region_upper[1] = s->forces.region_upper[2] = (float)SCENARIO_SIZE;
        s->params.resample_period = 2;
        s->params.lazy_distance = 0.0f;
        s->step.dt = 1.0f;
        s->steps = 32;
        break;
    case SCENARIO_CARRIED: /* round a far place, in a window that follows */
        s->forces = fixture_forces(exact_flow_velocity, &s->rotation);
        s->rotation.center[1] = 150.0f;
        s->rotation.angular_velocity = 0.02f;
        s->step.dt = 1.0f;
        s->step.max_displacement = 2.0f;
        break;
    case SCENARIO_LABELS:
        s->forces = fixture_forces(history_inwards, NULL);
        s->params.contact = SPRINGLS_CONTACT_SEPARATE;
        s->step.dt = 1.0f;
        s->step.max_displacement = 0.3f;
        s->steps = 3;
        break;
    case SCENARIO_STAGES: /* a cube grows until bricks lie in it that were on its border; holes are filled from the level set, by
                             springls that find their place among the others */
        s->forces = fixture_forces(scenario_outwards, NULL);
        s->forces.integrator = SPRINGLS_INTEGRATOR_EULER;
        s->params.fill_from_springls = 0;
        s->step.dt = 0.86f;
        s->steps = 1;
        break;
    case SCENARIO_HOLLOW: /* the same with a cavity, components and bodies that new springls belong to */
        s->forces = fixture_forces(scenario_outwards, NULL);
        s->params.fill_from_springls = 0;
        s->params.components = 1;
        s->params.contact = SPRINGLS_CONTACT_SEPARATE;
        s->step.dt = 0.86f;
        s->steps = 1;
        break;
    default: break;
    }
}

/* A cube with a cavity. */
FIXTURE void scenario_hollow_cube(void *user, const float *points, int count, float *out)
{
    const springls_box *cube = (const springls_box *)user;
    int i;
    springls_implicit_box(user, points, count, out);
    for (i = 0; i < count; i++) {
        float r = springls__length(springls__sub(springls__load3(points + 3 * i), springls__load3(cube->center)));
        out[i] = springls__max(out[i], 0.5f * cube->half[0] - r);
    }
}

FIXTURE springls_status scenario_begin(const scenario *s, springls_context *ctx)
{
    springls_sphere ball =
        fixture_ball(11.2f, 11.2f, 11.2f, s->which == SCENARIO_SEGMENT || s->which == SCENARIO_SEGMENT_PAPER ? 3.5f : 5.0f);
    springls_box box = { { 15.5f, 15.5f, 15.5f }, { 6.3f, 5.0f, 4.2f } }, cube = { { 15.5f, 15.5f, 15.5f }, { 7.0f, 7.0f, 7.0f } };
    switch (s->which) {
    case SCENARIO_PRESERVED: return springls_set_implicit(ctx, history_two_balls, NULL);
    case SCENARIO_BOX: return springls_set_implicit(ctx, springls_implicit_box, &box);
    case SCENARIO_THIN: box.half[0] = 4.0f; return springls_set_implicit(ctx, springls_implicit_box, &box);
    case SCENARIO_STAGES: return springls_set_implicit(ctx, springls_implicit_box, &cube);
    case SCENARIO_HOLLOW: return springls_set_implicit(ctx, scenario_hollow_cube, &cube);
    case SCENARIO_OPEN_MESH: return history_open_mesh(ctx);
    case SCENARIO_LABELS: return history_blobs(ctx);
    case SCENARIO_ASLEEP:
        ball = fixture_ball(15.5f, 15.5f, 15.5f, 12.0f);
        return springls_set_implicit(ctx, springls_implicit_sphere, &ball);
    default: return springls_set_implicit(ctx, springls_implicit_sphere, &ball);
    }
}

/* Every third springl keeps its shape. */
FIXTURE springls_status scenario_mask(springls_context *ctx)
{
    static uint8_t mask[20000];
    int i;
    if (springls_count(ctx) > 20000) return SPRINGLS_INVALID_ARGUMENT;
    for (i = 0; i < springls_count(ctx); i++) mask[i] = i % 3 == 0;
    return springls_set_keep_mask(ctx, mask);
}

/* Moves every third of the springls a little: by both parts, by particles alone, by vertices alone. */
FIXTURE springls_status scenario_write(springls_context *ctx)
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
FIXTURE springls_status scenario_stages(springls_context *ctx, const scenario *s)
{
    static const springls_stage stages[] = {SPRINGLS_STAGE_UNSIGNED_TO_SIGNED,
                                            SPRINGLS_STAGE_TRACK,
                                            SPRINGLS_STAGE_RELAX,
                                            SPRINGLS_STAGE_EVOLVE,
                                            SPRINGLS_STAGE_REBUILD,
                                            SPRINGLS_STAGE_FILL_GAPS,
                                            SPRINGLS_STAGE_CONTRACT,
                                            SPRINGLS_STAGE_RESAMPLE,
                                            SPRINGLS_STAGE_UNSIGNED_TO_SIGNED,
                                            SPRINGLS_STAGE_EVOLVE,
                                            SPRINGLS_STAGE_RELAX,
                                            SPRINGLS_STAGE_FILL_GAPS,
                                            SPRINGLS_STAGE_TRACK};
    size_t i;
    if (s->which == SCENARIO_HOLLOW) SPRINGLS__TRY(springls_step(ctx, &s->step)); /* which finds components and bodies */
    SPRINGLS__TRY(springls_advect(ctx, &s->forces, 0.1f, s->step.dt));
    SPRINGLS__TRY(scenario_write(ctx));
    for (i = 0; i < sizeof stages / sizeof *stages; i++) SPRINGLS__TRY(springls_run_stage(ctx, stages[i]));
    return SPRINGLS_OK;
}

/* Nothing moves until the model is at rest; at last a stage wakes all of it. */
FIXTURE springls_status scenario_asleep(springls_context *ctx, const scenario *s)
{
    const int at_rest = 24, steps = springls_get_stats(ctx).steps;
    springls_step_desc step = s->step;
    if (steps < at_rest) step.forces = NULL;
    else if (steps == at_rest && !ctx->at_rest) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls_step(ctx, &step));
    return steps == s->steps - 1 ? springls_run_stage(ctx, SPRINGLS_STAGE_RELAX) : SPRINGLS_OK;
}

FIXTURE springls_status scenario_step(springls_context *ctx, const scenario *s)
{
    if (s->which == SCENARIO_ASLEEP) return scenario_asleep(ctx, s);
    return s->which == SCENARIO_STAGES || s->which == SCENARIO_HOLLOW ? scenario_stages(ctx, s) : springls_step(ctx, &s->step);
}

FIXTURE springls_context *scenario_context(const scenario *s, springls_backend *backend)
{
    springls_desc desc = fixture_desc(SCENARIO_SIZE, &s->params);
    springls_context *ctx = NULL;
    desc.backend = backend;
    desc.follow = s->which == SCENARIO_CARRIED;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return NULL;
    if (scenario_begin(s, ctx) == SPRINGLS_OK && (s->which != SCENARIO_FLUID || scenario_mask(ctx) == SPRINGLS_OK)) return ctx;
    springls_destroy(ctx);
    return NULL;
}

/* Returns a hash of the state and the mesh of a model; 0 on failure. */
FIXTURE uint64_t scenario_mesh(springls_context *ctx)
{
    uint64_t hash = springls_state_hash(ctx);
    springls_mesh mesh;
    if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) return 0;
    hash = history_mix_mesh(hash, &mesh);
    springls_mesh_free(ctx, &mesh);
    return hash;
}

/* Does to a model, or to the steps that follow, what may happen after a step. */
typedef springls_status (*scenario_disturb)(springls_context *ctx, scenario *s, int step);

/* Runs a scenario; returns the hash of its end, 0 on failure. backend NULL: scalar. disturb: may be NULL. */
FIXTURE uint64_t scenario_disturbed(int which, springls_backend *backend, scenario_disturb disturb)
{
    scenario s;
    springls_context *ctx;
    uint64_t hash;
    int i, ok;
    scenario_make(&s, which);
    ctx = scenario_context(&s, backend);
    for (i = 0, ok = ctx != NULL; ok && i < s.steps; i++)
        ok = scenario_step(ctx, &s) == SPRINGLS_OK && (!disturb || disturb(ctx, &s, i) == SPRINGLS_OK);
    hash = ok ? scenario_mesh(ctx) : 0;
    springls_destroy(ctx);
    return hash;
}

/* Without a backend a scenario runs once, and many tests compare with it. */
FIXTURE uint64_t scenario_hash(int which, springls_backend *backend)
{
    static uint64_t scalar[SCENARIOS];
    if (backend) return scenario_disturbed(which, backend, NULL);
    if (!scalar[which]) scalar[which] = scenario_disturbed(which, NULL, NULL);
    return scalar[which];
}

/* Finds the device, to be destroyed after the tests, and makes the scenarios' image. */
FIXTURE void scenarios_begin(void)
{
    springls_cl_desc desc = fixture_device_desc();
    scenario_image();
    if (springls_cl_create(&desc, &test_device) == SPRINGLS_OK && springls_cl_exact(test_device)) return;
    springls_cl_destroy(test_device);
    if (desc.library) exit(EXIT_FAILURE); /* that one is no device that a machine may lack */
    test_device = NULL;
}

#endif
