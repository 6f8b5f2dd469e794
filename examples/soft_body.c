/* soft_body.c - a solver of its own drives springls: a bar of dough is held at both ends and drawn out until it tears.
 *
 * The solver has masses on springs, and no surface. Each springl has the number of its mass point in an attribute; springls
 * that are split or filled in take theirs from the springl that they come from. Every frame springls_write puts the springls
 * where the masses have gone, and a step without forces makes the level set follow, which parts when the neck is too thin. */
#include "base/json.h"
#include "base/progress.h"
#include "base/threads.h"
#include "base/vec3.h"
#include "springls/model_pictures.h"
#include "springls/run_options.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- the solver: masses on a chain of springs that yield, harden and tear; each mass is a slice of the bar ---- */

enum { MASSES = 33, HELD = 4, SUBSTEPS = 40, NEVER = -1 };

struct bar {
    float length, radius, pull; /* voxels: at the start; how far each end is pulled in a frame */
    float x[MASSES][3], v[MASSES][3], volume[MASSES], thickness[MASSES]; /* thickness: radius of the slice */
    float x_before[MASSES][3], thickness_before[MASSES];                 /* one frame earlier */
    float rest[MASSES], flow[MASSES]; /* of the spring from mass i to the next: its rest length, its plastic strain */
    bool weak[MASSES], torn[MASSES];  /* weak: the slice gives way; torn: the spring is */
    int frame, tear_frame;
};

static float radius_at(const struct bar *bar, float x, float center)
{
    const float off = (x - center) / (0.2f * bar->length);
    return bar->radius * (1.0f - 0.2f * expf(-off * off));
}

static float spring_vector(const struct bar *bar, int i, float d[3])
{
    vec3_sub(bar->x[i + 1], bar->x[i], d);
    return sqrtf(vec3_dot(d, d));
}

/* Returns the length of the slice around a mass: half of each spring that holds it. */
static float slice_length(const struct bar *bar, int i)
{
    float d[3], length = 0.0f;
    for (int s = i - 1; s <= i; ++s) {
        length += s >= 0 && s < MASSES - 1 && !bar->torn[s] ? 0.5f * spring_vector(bar, s, d) : 0.0f;
    }
    return fmaxf(length, 0.5f * bar->length / MASSES);
}

/* Returns the volume of the bar as the solver has it: cones between the masses, and half a ball at either end. */
static double bar_volume(const struct bar *bar)
{
    const double pi = 3.14159265358979323846, a = (double)bar->thickness[0], b = (double)bar->thickness[MASSES - 1];
    double sum = 2.0 * (a * a * a + b * b * b);
    float d[3];
    for (int i = 0; i < MASSES - 1; ++i) {
        const double r = (double)bar->thickness[i], s = (double)bar->thickness[i + 1];
        sum += bar->torn[i] ? 0.0 : (double)spring_vector(bar, i, d) * (r * r + r * s + s * s);
    }
    return pi / 3.0 * sum;
}

static void bar_begin(struct bar *bar, const float center[3])
{
    bar->tear_frame = NEVER;
    for (int i = 0; i < MASSES; ++i) {
        memcpy(bar->x[i], center, sizeof bar->x[i]);
        bar->x[i][0] += bar->length * ((float)i / (MASSES - 1) - 0.5f);
        bar->rest[i] = bar->length / (MASSES - 1);
        bar->thickness[i] = radius_at(bar, bar->x[i][0], center[0]);
    }
    for (int i = 0; i < MASSES; ++i) {
        bar->volume[i] = bar->thickness[i] * bar->thickness[i] * slice_length(bar, i);
    }
}

/* Pulls two masses together by the tension of their spring; one that is stretched too far flows, and is stronger then. */
static void pull_together(struct bar *bar, int i, float dt)
{
    const float stiffness = 60.0f, yield = 0.08f, hardening = 1.5f, damping = 4.0f;
    float d[3], dv[3];
    const float length = spring_vector(bar, i, d), limit = yield * (1.0f + hardening * bar->flow[i]);
    float strain = length / bar->rest[i] - 1.0f;
    if (strain > limit) {
        bar->flow[i] += strain - limit;
        bar->rest[i] = length / (1.0f + limit);
        strain = limit;
    }
    const float a = bar->thickness[i], b = bar->thickness[i + 1], area = 0.5f * (a * a + b * b) / (bar->radius * bar->radius);
    vec3_sub(bar->v[i + 1], bar->v[i], dv);
    const float impulse = dt * area * (stiffness * strain + damping * vec3_dot(dv, d) / length);
    vec3_add_scaled(bar->v[i], impulse / length, d, bar->v[i]);
    vec3_add_scaled(bar->v[i + 1], -impulse / length, d, bar->v[i + 1]);
}

static void move_masses(struct bar *bar, float dt)
{
    for (int i = 0; i < MASSES; ++i) {
        const bool left = i < HELD, right = i >= MASSES - HELD;
        const float hand[3] = {bar->tear_frame == NEVER ? (left ? -bar->pull : bar->pull) : 0.0f, 0.0f, 0.0f};
        bar->v[i][2] -= 0.02f * dt; /* weight */
        vec3_add_scaled(bar->v[i], -0.4f * dt, bar->v[i], bar->v[i]);
        if (left || right) {
            memcpy(bar->v[i], hand, sizeof hand);
        }
        vec3_add_scaled(bar->x[i], dt, bar->v[i], bar->x[i]);
    }
}

/* Lets slices that have become much thinner than at the start give way, the thinner the faster: their dough flows to the others.
 * Where a thread is left, its spring tears. */
static void give_way(struct bar *bar)
{
    const float weak = 0.6f * bar->radius, thread = 0.4f, least = 1e-6f /* voxels */, rate = 0.15f;
    float lost = 0.0f, others = 0.0f;
    for (int i = HELD; i < MASSES - HELD; ++i) {
        bar->weak[i] = bar->weak[i] || bar->thickness[i] < weak;
        if (bar->weak[i] && bar->thickness[i] > least) {
            const float share = rate * bar->volume[i] * fmaxf(1.2f - bar->thickness[i] / weak, 0.0f);
            bar->volume[i] -= share;
            lost += share;
        }
        others += bar->weak[i] ? 0.0f : bar->volume[i];
        if (bar->tear_frame == NEVER && bar->thickness[i] < thread) {
            bar->torn[i] = true;
            bar->tear_frame = bar->frame;
        }
    }
    for (int i = HELD; i < MASSES - HELD; ++i) {
        bar->volume[i] *= bar->weak[i] ? 1.0f : 1.0f + lost / others;
    }
}

static void bar_advance(struct bar *bar)
{
    const float dt = 1.0f / SUBSTEPS;
    memcpy(bar->x_before, bar->x, sizeof bar->x);
    memcpy(bar->thickness_before, bar->thickness, sizeof bar->thickness);
    bar->frame++;
    for (int s = 0; s < SUBSTEPS; ++s) {
        for (int i = 0; i < MASSES - 1; ++i) {
            if (!bar->torn[i]) {
                pull_together(bar, i, dt);
            }
        }
        move_masses(bar, dt);
    }
    give_way(bar);
    for (int i = HELD; i < MASSES - HELD; ++i) {
        bar->thickness[i] = sqrtf(bar->volume[i] / slice_length(bar, i));
    }
}

/* ---- the springls ---- */

/* Returns the spring that place x of a springl of a mass hangs on: before or behind the mass, whichever is not torn. */
static int spring_of(const struct bar *bar, int mass, const float x[3])
{
    float along[3], off[3];
    vec3_sub(bar->x_before[mass < MASSES - 1 ? mass + 1 : mass], bar->x_before[mass > 0 ? mass - 1 : mass], along);
    vec3_sub(x, bar->x_before[mass], off);
    const bool behind = mass == MASSES - 1
                     || (mass > 0 && !bar->torn[mass - 1] && (bar->torn[mass] || vec3_dot(along, off) < 0.0f));
    return behind ? mass - 1 : mass;
}

/* Moves a place of a springl of a mass as the masses have moved: along with its spring, and towards its axis as that thins. */
static void carry(const struct bar *bar, int mass, float x[3])
{
    const int i = spring_of(bar, mass, x);
    float d[3], now[3], off[3], before = bar->thickness_before[i], after = bar->thickness[i];
    vec3_sub(bar->x_before[i + 1], bar->x_before[i], d);
    vec3_sub(bar->x[i + 1], bar->x[i], now);
    vec3_sub(x, bar->x_before[i], off);
    const float u = fminf(fmaxf(vec3_dot(off, d) / vec3_dot(d, d), 0.0f), 1.0f);
    before += u * (bar->thickness_before[i + 1] - before);
    after += u * (bar->thickness[i + 1] - after);
    vec3_add_scaled(off, -u, d, off);
    vec3_add_scaled(bar->x[i], u, now, x);
    vec3_add_scaled(x, after / before, off, x);
}

struct run {
    struct cli_common common;
    const char *set;
    struct bar bar;
    springls_context *ctx;
    bool tells_events;
    int mass_attribute, frames, events;
    float *vertices;
    struct model_frame pictures[5];
    int pictures_taken, springls_at_start;
    int parted_frame; /* since when the body has more components than at the start; NEVER: it has not */
    springls_measures start, end; /* end: of the last frame */
    double solver_start;
    double seconds;
};

/* Evaluates the shape of the bar. */
static void bar_shape(void *user, const float *points, int count, float *out)
{
    const struct bar *bar = user;
    const float *first = bar->x[0], *last = bar->x[MASSES - 1], center = 0.5f * (first[0] + last[0]);
    for (int i = 0; i < count; ++i, points += 3) {
        const float axis[3] = {fminf(fmaxf(points[0], first[0]), last[0]), first[1], first[2]};
        float d[3];
        vec3_sub(points, axis, d);
        out[i] = 0.9f * (sqrtf(vec3_dot(d, d)) - radius_at(bar, axis[0], center));
    }
}

/* Gives every springl the mass point that it is nearest to. */
static springls_status find_masses(struct run *run)
{
    const springls_attribute_desc mass = {"mass point", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY};
    const springls_view particles = springls_view_particles(run->ctx);
    float *values = malloc(((size_t)particles.count + 1) * sizeof *values);
    for (int i = 0; values && i < particles.count; ++i) {
        const float *p = (const float *)(const void *)((const char *)particles.data + (size_t)i * particles.stride);
        const float place = (p[0] - run->bar.x[0][0]) / run->bar.rest[0];
        values[i] = roundf(fminf(fmaxf(place, 0.0f), MASSES - 1.0f));
    }
    const springls_status status =
        values ? springls_add_attribute(run->ctx, &mass, values, &run->mass_attribute) : SPRINGLS_OUT_OF_MEMORY;
    free(values);
    return status;
}

/* Puts the springls where the masses have gone, and lets the level set follow. */
static springls_status drive(struct run *run)
{
    const springls_step_desc follow = {.mode = SPRINGLS_MODE_FLUID};
    const springls_view vertices = springls_view_vertices(run->ctx);
    const springls_view masses = springls_view_attribute(run->ctx, run->mass_attribute);
    float *grown = realloc(run->vertices, 9 * (size_t)vertices.count * sizeof *grown);
    if (!grown) {
        return SPRINGLS_OUT_OF_MEMORY;
    }
    run->vertices = grown;
    for (int i = 0; i < vertices.count; ++i) {
        const float *q = (const float *)(const void *)((const char *)vertices.data + (size_t)i * vertices.stride);
        const float *mass = (const float *)(const void *)((const char *)masses.data + (size_t)i * masses.stride);
        memcpy(grown + 9 * (size_t)i, q, 9 * sizeof *q);
        for (int m = 0; m < 3; ++m) {
            carry(&run->bar, (int)*mass, grown + 9 * (size_t)i + 3 * m);
        }
    }
    const springls_status status = springls_write(run->ctx, 0, vertices.count, grown, NULL);
    return status == SPRINGLS_OK ? springls_step(run->ctx, &follow) : status;
}

/* Counts the events of the last frame, and prints a line for each. */
static springls_status tell_events(struct run *run)
{
    static const char *const names[] = {"birth", "split", "merge", "death"};
    const springls_event *events;
    int count;
    const springls_status status = springls_events(run->ctx, &events, &count);
    run->events += status == SPRINGLS_OK ? count : 0;
    for (int i = 0; status == SPRINGLS_OK && cli_may_print(&run->common) && i < count; ++i) {
        const springls_event *e = &events[i];
        printf("frame %d: %s at (%.1f, %.1f, %.1f)", run->bar.frame, names[e->kind], (double)e->place[0], (double)e->place[1],
               (double)e->place[2]);
        for (int k = 0; k < e->before_count + e->after_count; ++k) {
            const springls_component *part = k < e->before_count ? &e->before[k] : &e->after[k - e->before_count];
            printf("%s component %u of volume %.1f", k == 0 ? ":" : k == e->before_count ? " ->" : ",", (unsigned)part->id,
                   part->volume);
        }
        printf("\n");
    }
    return status;
}

/* Measures the body, and notes since when it is in parts: a thread thinner than a voxel may part and join again. */
static springls_status look_at_body(struct run *run)
{
    const springls_status status = springls_measure(run->ctx, &run->end);
    if (run->end.components <= run->start.components) {
        run->parted_frame = NEVER;
    } else if (run->parted_frame == NEVER) {
        run->parted_frame = run->bar.frame;
    }
    return status;
}

static bool take_picture(struct run *run)
{
    char caption[48];
    const int parts = run->end.components;
    if (!run->common.out) {
        return true;
    }
    snprintf(caption, sizeof caption, "frame %d: %s%d component%s", run->bar.frame,
             run->bar.frame == run->bar.tear_frame ? "spring tears, " : "", parts, parts == 1 ? "" : "s");
    return model_frame_take(run->ctx, caption, &run->pictures[run->pictures_taken++]);
}

/* Returns true in the frames that are drawn: while the bar is whole, when it gives way, when a spring tears, when the body parts, and
 * at the end. */
static bool is_drawn(const struct run *run)
{
    const struct bar *bar = &run->bar;
    bool weak = false;
    for (int i = 0; i < MASSES; ++i) {
        weak = weak || bar->weak[i];
    }
    switch (run->pictures_taken) {
    case 0: return true;
    case 1: return weak;
    case 2: return bar->tear_frame != NEVER;
    case 3: return run->parted_frame != NEVER;
    default: return run->pictures_taken == 4 && bar->frame >= bar->tear_frame + run->frames;
    }
}

/* Runs until some frames after the bar has torn. */
static springls_status run_frames(struct run *run)
{
    enum { MAX_FRAMES = 2000 };
    struct bar *bar = &run->bar;
    struct progress progress;
    springls_status status = springls_set_implicit(run->ctx, bar_shape, bar);
    status = status == SPRINGLS_OK ? find_masses(run) : status;
    status = status == SPRINGLS_OK ? springls_measure(run->ctx, &run->start) : status;
    run->end = run->start;
    run->parted_frame = NEVER;
    run->springls_at_start = springls_count(run->ctx);
    run->solver_start = bar_volume(bar);
    progress_begin(&progress, "drawing out", (size_t)run->frames, !cli_may_print(&run->common));
    while (status == SPRINGLS_OK && bar->frame < MAX_FRAMES
           && (bar->tear_frame == NEVER || bar->frame < bar->tear_frame + run->frames)) {
        if (is_drawn(run) && !take_picture(run)) {
            status = SPRINGLS_OUT_OF_MEMORY;
            break;
        }
        bar_advance(bar);
        status = drive(run);
        status = status == SPRINGLS_OK && run->tells_events ? tell_events(run) : status;
        status = status == SPRINGLS_OK ? look_at_body(run) : status;
        progress_update(&progress, bar->tear_frame == NEVER ? 0 : (size_t)(bar->frame - bar->tear_frame), NULL);
    }
    progress_end(&progress);
    if (status == SPRINGLS_OK && is_drawn(run) && !take_picture(run)) {
        status = SPRINGLS_OUT_OF_MEMORY;
    }
    return status;
}

/* Writes the line of the report on a terminal. */
static void tell_result(const struct run *run, double change, int springls)
{
    char parted[48] = "the body is whole";
    if (run->parted_frame != NEVER) {
        snprintf(parted, sizeof parted, "the body parts in frame %d", run->parted_frame);
    }
    printf("grid %d: a spring tears in frame %d, %s; %d components after %d, volume %+.2f %%, %d springls\n", run->common.grid,
           run->bar.tear_frame, parted, run->end.components, run->bar.frame, change, springls);
}

static bool report(const struct run *run, springls_backend *backend)
{
    struct json_writer json;
    const springls_stats stats = springls_get_stats(run->ctx);
    const double change = 100.0 * (run->end.volume / run->start.volume - 1.0);
    if (cli_may_print(&run->common)) {
        tell_result(run, change, stats.springls);
    }
    if (!run->common.json) {
        return true;
    }
    if (!json_open(&json, run->common.json)) {
        return cli_write_failed("soft_body", run->common.json);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "problem", "soft_body");
    json_integer(&json, "grid", run->common.grid);
    json_string(&json, "params", run->common.params);
    json_string(&json, "backend", run_backend_name(backend));
    json_integer(&json, "threads", threads_count());
    json_integer(&json, "frames", run->bar.frame);
    json_integer(&json, "tear_frame", run->bar.tear_frame);
    json_integer(&json, "parted_frame", run->parted_frame);
    json_integer(&json, "components_initial", run->start.components);
    json_integer(&json, "components", run->end.components);
    if (run->tells_events) {
        json_integer(&json, "events", run->events);
    }
    json_integer(&json, "euler", run->end.euler);
    json_number(&json, "volume_initial", run->start.volume);
    json_number(&json, "volume", run->end.volume);
    json_number(&json, "volume_change_percent", change);
    json_number(&json, "solver_volume_change_percent", 100.0 * (bar_volume(&run->bar) / run->solver_start - 1.0));
    json_integer(&json, "springls_initial", run->springls_at_start);
    json_integer(&json, "springls_final", stats.springls);
    json_integer(&json, "split", stats.split);
    json_integer(&json, "added", stats.added);
    json_number(&json, "seconds_total", run->seconds);
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("soft_body", run->common.json);
}

static bool write_pictures(const struct run *run)
{
    const struct model_view view = {.direction = {0.3f, -1.0f, 0.35f}, .up = {0.0f, 0.0f, 1.0f}, .width = 320, .height = 180,
                                    .by_correspondence = true};
    char path[512];
    return !run->common.out
        || model_film_write(run->pictures, run->pictures_taken, &view,
                            run_path(run->common.out, "soft_body.png", path, sizeof path))
        || cli_write_failed("soft_body", path);
}

/* Makes the model and the bar in the middle of it, half as long as the grid. */
static int set_up(struct run *run, const springls_params *params, springls_backend *backend)
{
    const int n = run->common.grid;
    springls_desc desc = {.grid = {.size = {n, n / 2, n / 2}}, .params = params, .backend = backend};
    const float center[3] = {0.5f * (float)(n - 1), 0.25f * (float)n, 0.3f * (float)n};
    run->bar.length = 0.4f * (float)n;
    run->bar.radius = 0.09f * (float)n;
    run->bar.pull = 0.2f;
    run->frames = 40;
    bar_begin(&run->bar, center);
    return run_create("soft_body", &desc, &run->ctx);
}

int main(int argc, char **argv)
{
    struct run run = {.common = cli_common_defaults()};
    springls_params params;
    const struct cli_option table[] = {
        {"set", CLI_STRING, &run.set, "LIST", RUN_OPTIONS_SET_HELP, 0.0, 0.0, NULL},
        {"events", CLI_FLAG, &run.tells_events, NULL, "a line for each birth, split, merger and death of a component", 0.0, 0.0,
         NULL},
    };
    static const struct cli_writes writes[] = {{.files = "soft_body.png"}};
    const struct cli_program program = {.name = "soft_body",
                                        .summary = "a mass-spring solver draws a bar of springls out until it tears",
                                        .common = &run.common,
                                        .options = table,
                                        .option_count = 2,
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_CONTINUE) {
        status = run_options("soft_body", &run.common, run.set, &params);
    }
    if (status != CLI_CONTINUE) {
        return status;
    }
    params.components = run.tells_events ? 1 : params.components;
    run.common.grid = run.common.grid > 0 ? run.common.grid : 96;
    springls_backend *backend = run_backend("soft_body", &run.common);
    status = set_up(&run, &params, backend);
    if (status == CLI_CONTINUE) {
        const double begin = elapsed_seconds();
        const springls_status result = run_frames(&run);
        run.seconds = elapsed_seconds() - begin;
        status = run_check("soft_body", run.ctx, result, "frames") && report(&run, backend) && write_pictures(&run)
            ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
    }
    for (int i = 0; i < run.pictures_taken; ++i) {
        model_frame_free(run.ctx, &run.pictures[i]);
    }
    free(run.vertices);
    springls_destroy(run.ctx);
    springls_cl_destroy(backend);
    return status;
}
