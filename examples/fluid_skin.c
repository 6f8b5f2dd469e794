/* fluid_skin.c - the skin of docs/recipes.md judged: a dam breaks, a model follows the union of the fluid's particles, and this program
 * measures in every frame what is wrong with it. `fluid_skin [FRAMES [PICTURE.png]]`; 150 frames.
 *
 * The fluid is the recipe's: its particles, its union_of and its flow. Lengths are cells of the fluid; a voxel is a third of one. */
#include "base/cli.h"
#include "springls/model_pictures.h"
#include "springls/run_options.h"

#include <time.h>

/* Its main is another program's. */
#define main recipe_main
#include "recipes/skin.c"
#undef main

enum { ROWS = 10, PICTURES = 6 };

/* What has been found, cells; the worst since the last row. */
struct findings {
    float off_union;      /* of a vertex of the mesh from the union of the particles                  */
    float outside;        /* of a particle from the mesh                                              */
    double volume_error;  /* of the mesh against the union, a part of it                              */
    double drift;         /* in the mean, of a springl from the particle that it began beside          */
    double follow, alone; /* seconds of processor: of the follows; of a model that only takes steps   */
    double step;
};

static double processor_seconds(void) { return (double)clock() / CLOCKS_PER_SEC; }

static int nearest_particle(const float *place)
{
    float least = 1e30f;
    int nearest = 0;
    for (int i = 0; i < particles; i++) {
        const float d[3] = {x[i][0] - place[0], x[i][1] - place[1], x[i][2] - place[2]};
        const float d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if (d2 < least) least = d2, nearest = i;
    }
    return nearest;
}

/* Gives springls of new drops, and all at the start, the number of the particle beside them. */
static void particle_beside(void *user, int attribute, const float *places, int count, float *out)
{
    (void)user, (void)attribute;
    for (int i = 0; i < count; i++) out[i] = (float)nearest_particle(places + 3 * i);
}

static const float *row_of(springls_view view, int i)
{
    return (const float *)(const void *)((const char *)view.data + (size_t)i * view.stride);
}

static void number_springls(springls_context *skin)
{
    const springls_attribute_desc beside = {"particle", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY};
    const springls_view place = springls_view_particles(skin); /* voxels */
    float *values = malloc(((size_t)place.count + 1) * sizeof *values);
    for (int i = 0; values && i < place.count; i++) {
        float at[3];
        springls_to_world(skin, row_of(place, i), 1, at);
        particle_beside(NULL, 0, at, 1, values + i);
    }
    ok(skin, values ? springls_add_attribute(skin, &beside, values, NULL) : SPRINGLS_OUT_OF_MEMORY);
    free(values);
}

/* ---- what is measured ---- */

/* The volume of the union, by samples four times as dense as cells. */
static double union_volume(void)
{
    enum { DENSE = 4 };
    double sum = 0;
    for (int i = 0; i < DENSE * DENSE * NY * NZ; i++) {
        float at[DENSE * NX][3], distance[DENSE * NX];
        for (int k = 0; k < DENSE * NX; k++) {
            at[k][0] = ((float)k + 0.5f) / DENSE;
            at[k][1] = ((float)(i % (DENSE * NY)) + 0.5f) / DENSE;
            at[k][2] = ((float)(i / (DENSE * NY)) + 0.5f) / DENSE;
        }
        union_of(NULL, at[0], DENSE * NX, distance);
        for (int k = 0; k < DENSE * NX; k++) sum += fmin(fmax(0.5 - DENSE * (double)distance[k], 0), 1);
    }
    return sum / (DENSE * DENSE * DENSE);
}

/* The distance of a place from the union, cells. Inside it is that within the nearest ball. */
static float off_union(const float *place)
{
    float off;
    union_of(NULL, place, 1, &off);
    if (off > 0.99f) { /* there union_of is cut short */
        const float *p = x[nearest_particle(place)], d[3] = {p[0] - place[0], p[1] - place[1], p[2] - place[2]};
        off = sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - radius;
    }
    return fabsf(off);
}

/* Looks for mesh without particles, and particles without mesh. */
static void look_at_frame(springls_context *skin, struct findings *found)
{
    static float distance[MOST];
    springls_mesh mesh;
    ok(skin, springls_sample_distance(skin, x[0], particles, distance));
    for (int i = 0; i < particles; i++) found->outside = fmaxf(found->outside, distance[i]);
    ok(skin, springls_extract_mesh(skin, &mesh));
    for (int i = 0; i < mesh.vertex_count; i++) found->off_union = fmaxf(found->off_union, off_union(mesh.positions + 3 * i));
    springls_mesh_free(skin, &mesh);
}

/* Measures what takes longer: the volume, and how far springls are from the particles that they began beside. */
static void look_closely(springls_context *skin, struct findings *found)
{
    const springls_view place = springls_view_particles(skin), number = springls_view_attribute(skin, 0);
    springls_measures m;
    ok(skin, springls_measure(skin, &m));
    found->volume_error = fabs(m.volume / union_volume() - 1);
    found->drift = 0;
    for (int i = 0; i < place.count; i++) {
        const float *own = x[(int)*row_of(number, i)];
        float at[3];
        springls_to_world(skin, row_of(place, i), 1, at);
        const float d[3] = {at[0] - own[0], at[1] - own[1], at[2] - own[2]};
        found->drift += (double)sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / place.count;
    }
}

/* ---- the run ---- */

static springls_context *skin_of_particles(void)
{
    springls_desc desc = springls_default_desc();
    springls_params params = springls_default_params();
    springls_context *skin;
    params.keep_edges = 0;
    desc.params = &params;
    for (int k = 0; k < 3; k++) desc.grid.size[k] = 3 * size[k], desc.grid.spacing[k] = 1.0 / 3;
    if (springls_create(&desc, &skin) != SPRINGLS_OK) puts(springls_create_error(&desc)), exit(1);
    ok(skin, springls_set_implicit(skin, union_of, NULL));
    return skin;
}

static void fill_tank(int columns)
{
    particles = 0;
    for (int i = 0; i < MOST; i++) { /* two a cell along each axis, a little off their places */
        const int at[3] = {i % columns, i / columns % (2 * NY - 4), i / (columns * (2 * NY - 4))};
        if (at[2] >= (columns > 16 ? 5 : 20)) break;
        for (int k = 0; k < 3; k++)
            x[i][k] = 1.25f + 0.5f * (float)at[k] + 0.1f * ((float)((i * (7 + 4 * k)) % 13) / 13 - 0.5f);
        particles++;
    }
    memset(v, 0, sizeof v);
    bin_again();
}

/* A pool that is still: prints how far its mesh moves from one of the last frames to the next. */
static void look_at_still_pool(int frames)
{
    const springls_step_desc still = {0};
    const springls_follow_desc follow = {.fn = union_of};
    float most = 0;
    double replaced = 0;
    fill_tank(2 * NX - 4);
    springls_context *skin = skin_of_particles();
    for (int frame = 0; frame < 2 * frames; frame++) {
        const int64_t added = springls_get_stats(skin).added;
        springls_mesh mesh;
        ok(skin, springls_extract_mesh(skin, &mesh));
        ok(skin, springls_step(skin, &still));
        ok(skin, springls_follow_level_set(skin, &follow));
        for (int i = 0; frame >= frames && i < mesh.vertex_count; i++) {
            float moved;
            ok(skin, springls_sample_distance(skin, mesh.positions + 3 * i, 1, &moved));
            most = fmaxf(most, fabsf(moved));
        }
        replaced += frame >= frames ? (double)(springls_get_stats(skin).added - added) : 0;
        springls_mesh_free(skin, &mesh);
    }
    printf("A still pool: between two of %d frames its mesh moves by at most %.4f cells; %.1f of %d springls are replaced.\n", frames,
           (double)most, replaced / frames, springls_count(skin));
    springls_destroy(skin);
}

/* Takes a frame: the fluid, the skin, and the model that only takes steps. */
static void run_frame(springls_context *skin, springls_context *alone, const springls_step_desc *step, struct findings *found)
{
    const springls_follow_desc follow = {.fn = union_of, .values = particle_beside};
    double begun;
    advance(step->dt);
    bin_again();
    begun = processor_seconds();
    ok(skin, springls_step(skin, step));
    found->step += processor_seconds() - begun;
    begun = processor_seconds();
    ok(skin, springls_follow_level_set(skin, &follow));
    found->follow += processor_seconds() - begun;
    begun = processor_seconds();
    ok(alone, springls_step(alone, step));
    found->alone += processor_seconds() - begun;
    look_at_frame(skin, found);
}

static void write_film(struct model_frame *frames, int count, const char *path)
{
    const struct model_view view = {
        .direction = {0.5f, -1.0f, 0.6f}, .up = {0, 0, 1}, .width = 300, .height = 210, .by_correspondence = true};
    if (!model_film_write(frames, count, &view, path)) cli_write_failed("fluid_skin", path), exit(1);
}

/* Reads the command line. Returns CLI_CONTINUE, or what main returns. */
static int read_arguments(int argc, char **argv, int *frames, const char **picture)
{
    const char *number = "150";
    const struct cli_positional positionals[] = {{"FRAMES", &number, "how many frames, 1 to 100000 (150)", false},
                                                 {"PICTURE", picture, "a PNG of six of them", false}};
    const struct cli_program program = {.name = "fluid_skin", .summary = "a dam breaks, and the skin of its particles is measured",
                                        .positionals = positionals, .positional_count = 2};
    const int status = cli_parse(&program, argc, argv);
    if (status != CLI_CONTINUE) return status;
    if (!cli_read_int(number, frames) || *frames < 1 || *frames > 100000)
        return cli_fail("fluid_skin", CLI_EXIT_USAGE, "FRAMES %s: expected an integer from 1 to 100000", number);
    return *picture ? run_check_output("fluid_skin", *picture) : CLI_CONTINUE;
}

int main(int argc, char **argv)
{
    int frames = 0;
    const char *picture = NULL;
    const int status = read_arguments(argc, argv, &frames, &picture);
    if (status != CLI_CONTINUE) return status;
    const int period = frames < ROWS ? 1 : frames / ROWS;
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    struct findings found = {0};
    struct model_frame drawn[PICTURES];
    springls_context *skin, *alone;
    int taken = 0;

    fill_tank(16);
    skin = skin_of_particles();
    alone = skin_of_particles();
    number_springls(skin);
    forces.velocity = flow;
    step.forces = &forces;
    step.dt = 0.25f;
    puts("| Frame | Parts | Volume off, % | Mesh off particles | Particles outside | Springls from their particles |");
    puts("|---|---|---|---|---|---|");
    for (int frame = 1; frame <= frames; frame++) {
        run_frame(skin, alone, &step, &found);
        if (picture && taken < PICTURES && frame > taken * frames / PICTURES) {
            char caption[48];
            snprintf(caption, sizeof caption, "frame %d", frame);
            if (model_frame_take(skin, caption, &drawn[taken])) taken++;
        }
        if (frame % period != 0) continue;
        springls_measures m;
        ok(skin, springls_measure(skin, &m));
        look_closely(skin, &found);
        printf("| %d | %d | %.2f | %.2f | %.2f | %.1f |\n", frame, m.components, 100 * found.volume_error, (double)found.off_union,
               (double)fmaxf(found.outside, 0), found.drift);
        found.off_union = 0;
        found.outside = -1;
    }
    if (picture) write_film(drawn, taken, picture);
    for (int i = 0; i < taken; i++) model_frame_free(skin, &drawn[i]);
    printf("\nProcessor, ms a frame: steps alone %.0f; with the skin: step %.0f, follow %.0f.\n", 1e3 * found.alone / frames,
           1e3 * found.step / frames, 1e3 * found.follow / frames);
    springls_destroy(alone);
    springls_destroy(skin);
    look_at_still_pool(10);
    return 0;
}
