/* csg.c - operations on solids: union, intersection and difference of two, and growing, shrinking, smoothing or remeshing one
 * with springls of even size. Solids are mesh files or built-in shapes; the colors of their vertices are carried to the
 * result. */
#include "base/json.h"
#include "base/progress.h"
#include "base/vec3.h"
#include "solids/mesh_followed.h"
#include "solids/solid_grid.h"
#include "solids/solid_mesh.h"
#include "springls/indices.h"
#include "springls/model_pictures.h"
#include "springls/run_options.h"
#include "springls_cl.h"
#include "surface/mesh_local.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_SOLIDS = 2, PICTURE = 480, EXIT_LOSS = 3 };

struct solid {
    const char *text; /* a file, ball:x,y,z,r or box:x,y,z,half */
    bool is_ball, is_box;
    springls_sphere ball;
    springls_box box;
    struct mesh mesh;
    double origin[3]; /* that its places are less by */
    struct mesh_followed followed; /* of a file */
    float lower[3], upper[3];
    springls_context *ctx;
    springls_measures measures;
};

struct csg {
    struct cli_common common;
    const char *operation, *result, *set;
    double amount;
    bool keep_volume, preserve, strict;
    struct solid solids[MAX_SOLIDS];
    int count;
    double spacing;
    springls_params params;
    springls_contouring contouring; /* of results */
    springls_mesh mesh;
    float *colors;
    int springls, dropped; /* dropped: specks of the result */
    springls_stats stats;
    springls_measures measures;
    double seconds;
    struct image pictures[MAX_SOLIDS + 1];
};

static const char *const operations = "union|intersection|difference|offset|smooth|remesh";

/* ---- input ---- */

/* Reads "name:1,2,3" with `count` numbers after the name. Returns 1, 0 for another name, -1 for wrong numbers. */
static int shape_numbers(const char *text, const char *name, int count, double *numbers)
{
    const size_t length = strlen(name);
    if (strncmp(text, name, length) != 0 || text[length] != ':') {
        return 0;
    }
    const char *at = text + length + 1;
    for (int i = 0; i < count; ++i) {
        char one[64];
        const size_t n = strcspn(at, ",");
        if (n == 0 || n >= sizeof one || (at[n] == ',') != (i + 1 < count)) {
            return -1;
        }
        memcpy(one, at, n);
        one[n] = '\0';
        if (!cli_read_double(one, &numbers[i]) || fabs(numbers[i]) > 1e6 || (i >= 3 && numbers[i] <= 0.0)) {
            return -1;
        }
        at += n + 1;
    }
    return 1;
}

static bool read_solid(struct solid *s)
{
    double n[4];
    char error[MESH_TEXT];
    const int ball = shape_numbers(s->text, "ball", 4, n), box = ball ? 0 : shape_numbers(s->text, "box", 4, n);
    if (ball < 0 || box < 0) {
        cli_fail("csg", CLI_EXIT_FAILURE,
                 "%s: wanted are a place, and a positive size, of at most 1e6 each: ball:x,y,z,radius or box:x,y,z,half", s->text);
        return false;
    }
    s->is_ball = ball > 0;
    s->is_box = box > 0;
    if (ball || box) {
        for (int c = 0; c < 3; ++c) {
            s->ball.center[c] = s->box.center[c] = (float)n[c];
            s->box.half[c] = (float)n[3];
            s->lower[c] = (float)(n[c] - n[3]);
            s->upper[c] = (float)(n[c] + n[3]);
        }
        s->ball.radius = (float)n[3];
        return true;
    }
    if (!mesh_read_local(s->text, &s->mesh, s->origin, error)) {
        cli_fail("csg", CLI_EXIT_FAILURE, "%s", error);
        return false;
    }
    mesh_warn_not_finite("csg", s->text, &s->mesh);
    if (s->mesh.vertex_count > 100000000 || s->mesh.triangle_count > 100000000) {
        cli_fail("csg", CLI_EXIT_FAILURE, "%s: more than 100 million vertices or triangles", s->text);
        return false;
    }
    for (int c = 0; c < 3; ++c) {
        s->lower[c] = INFINITY;
        s->upper[c] = -INFINITY;
    }
    raycast_grow_box(s->mesh.positions, s->mesh.vertex_count, s->lower, s->upper);
    return (vec3_within_reach(s->lower) && vec3_within_reach(s->upper))
        || cli_fail("csg", CLI_EXIT_FAILURE, "%s: " VEC3_TOO_FAR, s->text) == CLI_CONTINUE;
}

/* Moves the second solid to the origin of the first one. */
static void share_origin(struct csg *csg)
{
    struct solid *a = &csg->solids[0], *b = &csg->solids[1];
    for (int c = 0; c < 3 && csg->count == 2; ++c) {
        const double move = b->origin[c] - a->origin[c];
        for (size_t v = 0; move != 0.0 && v < b->mesh.vertex_count; ++v) {
            b->mesh.positions[3 * v + (size_t)c] = (float)((double)b->mesh.positions[3 * v + (size_t)c] + move);
        }
        if (move != 0.0) {
            b->lower[c] = (float)((double)b->lower[c] + move);
            b->upper[c] = (float)((double)b->upper[c] + move);
            b->ball.center[c] = b->box.center[c] = (float)((double)b->ball.center[c] + move);
        }
        b->origin[c] = a->origin[c];
    }
}

/* Refuses two solids so distant that a grid around both cannot resolve them, nor floats their places beside each other. */
static bool lie_together(const struct csg *csg)
{
    const double most = 512.0; /* times the larger one's size */
    double size = 0.0, extent = 0.0;
    for (int c = 0; c < 3; ++c) {
        double lower = INFINITY, upper = -INFINITY;
        for (int i = 0; i < csg->count; ++i) {
            const struct solid *s = &csg->solids[i];
            size = fmax(size, (double)s->upper[c] - (double)s->lower[c]);
            lower = fmin(lower, (double)s->lower[c]);
            upper = fmax(upper, (double)s->upper[c]);
        }
        extent = fmax(extent, upper - lower);
    }
    return csg->count < 2 || extent <= most * size
        || cli_fail("csg", CLI_EXIT_FAILURE, "%s and %s lie %.4g apart, %.0f times their size: too much for one grid (512)",
                    csg->solids[0].text, csg->solids[1].text, extent - size, extent / size)
        == CLI_CONTINUE;
}

/* Makes a grid of cubes around all solids, with a margin for the result. */
static springls_grid_desc make_grid(struct csg *csg)
{
    const double grow = strcmp(csg->operation, "offset") == 0 ? fmax(csg->amount, 0.0) : 0.0;
    double lower[3], upper[3];
    for (int c = 0; c < 3; ++c) {
        upper[c] = -INFINITY;
        lower[c] = INFINITY;
        for (int i = 0; i < csg->count; ++i) {
            lower[c] = fmin(lower[c], (double)csg->solids[i].lower[c] - grow);
            upper[c] = fmax(upper[c], (double)csg->solids[i].upper[c] + grow);
        }
    }
    const springls_grid_desc grid = solid_grid_of(lower, upper, csg->common.grid);
    csg->spacing = grid.spacing[0];
    return grid;
}

/* ---- springls with colours ---- */

/* Sets each vertex's color from the file; without colors the first solid is sand, the second blue. */
static bool paint(struct solid *s, int number, int *triangles)
{
    const int n = springls_count(s->ctx);
    const springls_attribute_desc desc = {"colour", 3, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_COPY};
    static const float plain[MAX_SOLIDS][3] = {{0.85f, 0.70f, 0.45f}, {0.35f, 0.55f, 0.85f}};
    float *colors = malloc(((size_t)n + 1) * 3 * sizeof *colors);
    springls_material *places = malloc(((size_t)n + 1) * sizeof *places);
    bool fine = colors && places;
    for (int i = 0; fine && i < n; ++i) {
        memcpy(colors + 3 * i, plain[number], sizeof plain[number]);
    }
    if (fine && s->mesh.colors) {
        fine = springls_springl_materials(s->ctx, places) == SPRINGLS_OK
               && springls_interpolate_material(places, n, s->mesh.colors, 3, triangles, (int)s->mesh.triangle_count, colors)
                      == SPRINGLS_OK;
    }
    fine = fine && springls_add_attribute(s->ctx, &desc, colors, NULL) == SPRINGLS_OK;
    free(colors);
    free(places);
    return fine;
}

static bool make_solid(struct solid *s, int number, double spacing)
{
    if (s->is_ball || s->is_box) {
        return (s->is_ball ? springls_set_implicit(s->ctx, springls_implicit_sphere, &s->ball)
                           : springls_set_implicit(s->ctx, springls_implicit_box, &s->box)) == SPRINGLS_OK
               && paint(s, number, NULL);
    }
    int *triangles = signed_indices(s->mesh.indices, s->mesh.triangle_count);
    const bool fine = triangles
                      && mesh_followed(s->ctx, s->mesh.positions, (int)s->mesh.vertex_count, triangles, (int)s->mesh.triangle_count,
                                       (float)spacing, &s->followed)
                             == SPRINGLS_OK
                      && paint(s, number, triangles);
    free(triangles);
    return fine;
}

static springls_status operate(struct csg *csg)
{
    springls_context *a = csg->solids[0].ctx, *b = csg->solids[1].ctx;
    if (strcmp(csg->operation, "union") == 0) {
        return springls_combine(a, SPRINGLS_OPERATION_UNION, b);
    }
    if (strcmp(csg->operation, "intersection") == 0) {
        return springls_combine(a, SPRINGLS_OPERATION_INTERSECTION, b);
    }
    if (strcmp(csg->operation, "difference") == 0) {
        return springls_combine(a, SPRINGLS_OPERATION_DIFFERENCE, b);
    }
    if (strcmp(csg->operation, "offset") == 0) {
        return springls_offset(a, (float)csg->amount);
    }
    if (strcmp(csg->operation, "smooth") == 0) {
        return springls_smooth(a, (float)csg->amount, csg->keep_volume);
    }
    return springls_remesh(a);
}

/* ---- output ---- */

/* Extracts the surface of a solid, or of the result, with its colours. dropped: how many specks are left out (NULL: not wanted). */
static bool extract(const struct csg *csg, springls_context *ctx, springls_mesh *mesh, float **colors, springls_measures *measures,
                    int *dropped)
{
    const double speck = 8.0; /* voxels^3, as mend's --specks */
    *colors = NULL;
    if (!solid_extract(ctx, csg->contouring, speck * csg->spacing * csg->spacing * csg->spacing, mesh, dropped)) {
        return false;
    }
    *colors = malloc(((size_t)mesh->vertex_count + 1) * 3 * sizeof **colors);
    return *colors && springls_mesh_attribute(ctx, mesh, springls_find_attribute(ctx, "colour"), *colors) == SPRINGLS_OK
           && solid_remove_slivers(mesh, csg->spacing, *colors) && solid_measure(mesh, measures);
}

static bool draw(const springls_mesh *mesh, const float *colors, const struct raycast_camera *camera, struct image *picture)
{
    uint32_t *indices = unsigned_indices(mesh);
    const struct raycast_scene scene = {.positions = mesh->positions,
                                        .vertex_count = (size_t)mesh->vertex_count,
                                        .indices = indices,
                                        .triangle_count = (size_t)mesh->triangle_count,
                                        .normals = mesh->normals,
                                        .vertex_colors = colors,
                                        .background_top = {1.0f, 1.0f, 1.0f},
                                        .background_bottom = {1.0f, 1.0f, 1.0f},
                                        .camera = *camera};
    const bool fine = indices && raycast_render(&scene, PICTURE, PICTURE, picture);
    free(indices);
    return fine;
}

/* Computes one camera for all pictures, from the corners of the grid's content. */
static struct raycast_camera camera_of(const struct csg *csg)
{
    const float direction[3] = {0.75f, -1.0f, 0.7f}, up[3] = {0.0f, 0.0f, 1.0f};
    float lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY}, corners[24];
    for (int i = 0; i < csg->count; ++i) {
        raycast_grow_box(csg->solids[i].lower, 1, lower, upper);
        raycast_grow_box(csg->solids[i].upper, 1, lower, upper);
    }
    for (int i = 0; i < 24; ++i) {
        corners[i] = i / 3 >> i % 3 & 1 ? upper[i % 3] : lower[i % 3];
    }
    return raycast_frame_points(corners, 8, direction, up, 0.0f, 1.0f);
}

/* Measures a solid, and draws it where pictures are wanted. */
static bool look_at(struct csg *csg, int number, const struct raycast_camera *camera)
{
    struct solid *s = &csg->solids[number];
    springls_mesh mesh;
    float *colors;
    const bool fine = extract(csg, s->ctx, &mesh, &colors, &s->measures, NULL)
                      && (!csg->common.out || draw(&mesh, colors, camera, &csg->pictures[number]));
    springls_mesh_free(s->ctx, &mesh);
    free(colors);
    return fine;
}

static bool write_result(struct csg *csg)
{
    char error[MESH_TEXT] = "not enough memory";
    uint32_t *indices = unsigned_indices(&csg->mesh);
    const double *origin = csg->solids[0].origin;
    const struct mesh_arrays arrays = {.positions = csg->mesh.positions,
                                       .vertex_count = (size_t)csg->mesh.vertex_count,
                                       .indices = indices,
                                       .triangle_count = (size_t)csg->mesh.triangle_count,
                                       .normals = csg->mesh.normals,
                                       .colors = csg->colors,
                                       .originals = csg->mesh.correspondences,
                                       .comment = "a_x a_y a_z: place on the solids that were given",
                                       .origin = origin[0] != 0.0 || origin[1] != 0.0 || origin[2] != 0.0 ? origin : NULL};
    const bool fine = indices && mesh_write(csg->result, &arrays, error);
    free(indices);
    return fine || cli_fail("csg", CLI_EXIT_FAILURE, "%s", error) == CLI_CONTINUE;
}

static bool write_picture(struct csg *csg)
{
    char path[1024];
    const char *captions[MAX_SOLIDS + 1] = {"the first", "the second", csg->operation};
    struct image strip;
    captions[csg->count] = csg->operation;
    if (!image_strip(csg->pictures, captions, csg->count + 1, csg->count + 1, color_rgb(1.0f, 1.0f, 1.0f), &strip)) {
        return false;
    }
    const bool fine = image_write_png(&strip, run_path(csg->common.out, "csg.png", path, sizeof path));
    image_free(&strip);
    if (!fine) {
        cli_write_failed("csg", path);
    }
    return fine;
}

static void json_measures(struct json_writer *json, const char *key, const springls_measures *m)
{
    json_object_begin(json, key);
    json_number(json, "volume", m->volume);
    json_number(json, "area", m->area);
    json_integer(json, "components", m->components);
    json_integer(json, "euler", m->euler);
    json_object_end(json);
}

static void json_followed(struct json_writer *json, const struct mesh_followed *f)
{
    json_object_begin(json, "file");
    json_integer(json, "parts", f->report.components);
    json_bool(json, "closed", f->report.closed);
    json_integer(json, "parts_turned", f->report.parts_turned);
    json_integer(json, "parts_nested", f->report.parts_nested);
    json_integer(json, "triangles_dropped", f->report.triangles_dropped);
    json_integer(json, "bodies", f->bodies);
    json_number(json, "area_followed", f->area);
    json_number(json, "area_covered", f->within);
    json_number(json, "volume_followed", f->volume);
    json_object_end(json);
}

static bool write_json(const struct csg *csg, const springls_backend *backend)
{
    struct json_writer json;
    if (!json_open(&json, csg->common.json)) {
        return cli_write_failed("csg", csg->common.json);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "operation", csg->operation);
    json_number(&json, "amount", csg->amount);
    json_integer(&json, "grid", csg->common.grid);
    json_number(&json, "spacing", csg->spacing);
    json_string(&json, "params", csg->common.params);
    json_string(&json, "backend", run_backend_name(backend));
    json_array_begin(&json, "solids");
    for (int i = 0; i < csg->count; ++i) {
        json_object_begin(&json, NULL);
        json_string(&json, "name", csg->solids[i].text);
        json_measures(&json, "measures", &csg->solids[i].measures);
        if (!csg->solids[i].is_ball && !csg->solids[i].is_box) {
            json_followed(&json, &csg->solids[i].followed);
        }
        json_object_end(&json);
    }
    json_array_end(&json);
    json_measures(&json, "result", &csg->measures);
    json_integer(&json, "specks_of_result", csg->dropped);
    json_integer(&json, "springls", csg->springls);
    json_integer(&json, "at_edges", csg->stats.at_edges);
    json_integer(&json, "triangles", csg->mesh.triangle_count);
    json_number(&json, "seconds_operation", csg->seconds);
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("csg", csg->common.json);
}

/* ---- the run ---- */

/* Prints why a call failed. */
static bool report_failure(const char *subject, springls_context *ctx)
{
    const char *why = springls_last_error(ctx);
    return cli_fail("csg", CLI_EXIT_FAILURE, "%s: %s", subject, *why ? why : "not enough memory") == CLI_CONTINUE;
}

/* Returns whether smoothing leaves nothing for certain: a ball vanishes when the length reaches its radius, and a solid inside of it
 * no later. */
static bool vanishes(const struct csg *csg)
{
    const struct solid *s = &csg->solids[0];
    double square = 0.0; /* of the diagonal of the box */
    for (int c = 0; c < 3; ++c) {
        square += pow((double)s->upper[c] - (double)s->lower[c], 2.0);
    }
    return strcmp(csg->operation, "smooth") == 0 && !csg->keep_volume && csg->amount > 0.5 * sqrt(square);
}

static bool nothing_left(const struct csg *csg)
{
    return cli_fail("csg", CLI_EXIT_FAILURE, "%s: nothing is left", csg->operation) == CLI_CONTINUE;
}

static bool run(struct csg *csg, springls_backend *backend)
{
    if (vanishes(csg)) {
        return nothing_left(csg);
    }
    share_origin(csg);
    if (!lie_together(csg)) {
        return false;
    }
    const springls_grid_desc grid = make_grid(csg);
    const struct raycast_camera camera = camera_of(csg);
    for (int i = 0; i < csg->count; ++i) {
        struct solid *s = &csg->solids[i];
        springls_desc desc = {.grid = grid, .params = &csg->params, .backend = backend};
        if (run_create("csg", &desc, &s->ctx) != CLI_CONTINUE) {
            return false;
        }
        if (!make_solid(s, i, csg->spacing) || !look_at(csg, i, &camera)) {
            return report_failure(s->text, s->ctx);
        }
    }
    const double begin = elapsed_seconds();
    const springls_status status = operate(csg);
    if (status == SPRINGLS_EMPTY_MODEL) {
        return nothing_left(csg);
    }
    if (status != SPRINGLS_OK) {
        return report_failure("the result", csg->solids[0].ctx);
    }
    csg->seconds = elapsed_seconds() - begin;
    springls_context *ctx = csg->solids[0].ctx;
    csg->springls = springls_count(ctx);
    csg->stats = springls_get_stats(ctx);
    if (!extract(csg, ctx, &csg->mesh, &csg->colors, &csg->measures, &csg->dropped)
        || (csg->common.out && !draw(&csg->mesh, csg->colors, &camera, &csg->pictures[csg->count]))) {
        return report_failure("the result", ctx);
    }
    if (csg->mesh.triangle_count == 0) {
        cli_fail("csg", CLI_EXIT_FAILURE, "the result is thinner than the voxels, of %.4g, and has no surface on them",
                 csg->spacing);
        return false;
    }
    return true;
}

/* Names the files of which the model follows little. Returns whether there are any. */
static bool warn_of_losses(const struct csg *csg)
{
    bool any = false;
    for (int i = 0; i < csg->count; ++i) {
        const struct solid *s = &csg->solids[i];
        char text[256];
        if (!s->followed.little) {
            continue;
        }
        mesh_followed_text(&s->followed, text, sizeof text);
        fprintf(stderr, "csg: warning: %s: %s: %s\n", s->text, text, mesh_followed_advice(&s->followed));
        any = true;
    }
    return any;
}

static int genus(const springls_measures *m) { return m->components - m->euler / 2; }

/* Says where smoothing has changed how many parts and handles there are. */
static void note_topology(const struct csg *csg)
{
    const springls_measures *before = &csg->solids[0].measures, *after = &csg->measures;
    if (strcmp(csg->operation, "smooth") == 0 && (before->components != after->components || before->euler != after->euler)) {
        fprintf(stderr, "csg: note: smooth: components %d, genus %d before, %d and %d after%s\n", before->components, genus(before),
                after->components, genus(after), csg->preserve ? "" : ": --preserve keeps both");
    }
}

static void print(const struct csg *csg)
{
    for (int i = 0; i < csg->count; ++i) {
        char text[256];
        if (csg->solids[i].followed.report.springls) {
            mesh_followed_text(&csg->solids[i].followed, text, sizeof text);
            printf("%-14s %s\n", csg->solids[i].text, text);
        }
    }
    for (int i = 0; i < csg->count; ++i) {
        const springls_measures *m = &csg->solids[i].measures;
        printf("%-14s volume %.6g, area %.6g, components %d, Euler number %d\n", i == 0 ? "first" : "second", m->volume, m->area,
               m->components, m->euler);
    }
    printf("%-14s volume %.6g, area %.6g, components %d, Euler number %d\n", csg->operation, csg->measures.volume,
           csg->measures.area,
           csg->measures.components, csg->measures.euler);
    if (csg->dropped > 0) {
        printf("%-14s %d speck%s left out\n", "", csg->dropped, csg->dropped == 1 ? "" : "s");
    }
    printf("%d springls on voxels of %.4g, %.2f s\n", csg->springls, csg->spacing, csg->seconds);
}

static void free_all(struct csg *csg)
{
    if (csg->solids[0].ctx) {
        springls_mesh_free(csg->solids[0].ctx, &csg->mesh);
    }
    free(csg->colors);
    for (int i = 0; i < MAX_SOLIDS; ++i) {
        springls_destroy(csg->solids[i].ctx);
        mesh_free(&csg->solids[i].mesh);
    }
    for (int i = 0; i < MAX_SOLIDS + 1; ++i) {
        image_free(&csg->pictures[i]);
    }
}

static int check_usage(struct csg *csg)
{
    const bool two = strcmp(csg->operation, "union") == 0 || strcmp(csg->operation, "intersection") == 0
        || strcmp(csg->operation, "difference") == 0;
    const bool measured = strcmp(csg->operation, "offset") == 0 || strcmp(csg->operation, "smooth") == 0;
    char error[MESH_TEXT];
    bool known = false;
    for (const char *o = operations; o && !known; o = strchr(o, '|') ? strchr(o, '|') + 1 : NULL) {
        known = strncmp(o, csg->operation, strlen(csg->operation)) == 0 && strchr("|", o[strlen(csg->operation)]) != NULL;
    }
    if (!known) {
        return cli_fail("csg", CLI_EXIT_USAGE, "OPERATION is one of %s, not %s", operations, csg->operation);
    }
    csg->count = two ? 2 : 1;
    if (two != (csg->solids[1].text != NULL)) {
        return cli_fail("csg", CLI_EXIT_USAGE, "%s is of %s", csg->operation, two ? "two solids" : "one solid");
    }
    if (measured && csg->amount == 0.0) {
        return cli_fail("csg", CLI_EXIT_USAGE, "%s needs --amount", csg->operation);
    }
    if (strcmp(csg->operation, "smooth") == 0 && csg->amount < 0.0) {
        return cli_fail("csg", CLI_EXIT_USAGE, "--amount %g: the length of smooth is positive", csg->amount);
    }
    if (csg->preserve && csg->set && (strstr(csg->set, "contouring=") || strstr(csg->set, "topology="))) {
        return cli_fail("csg", CLI_EXIT_USAGE, "--preserve chooses contouring and topology: leave them out of --set");
    }
    if (csg->result && !mesh_can_write(csg->result, error)) {
        return cli_fail("csg", CLI_EXIT_USAGE, "--result: %s", error);
    }
    return cli_grid("csg", &csg->common, 96, 24, 4096);
}

int main(int argc, char **argv)
{
    struct csg csg = {.common = cli_common_defaults()};
    const struct cli_option table[] = {
        {"amount", CLI_DOUBLE, &csg.amount, "X", "offset: distance, negative to shrink; smooth: length; unit of the solids", -1e6,
         1e6, NULL},
        {"strict", CLI_FLAG, &csg.strict, NULL, "exit status 3 where a file falls apart, or a tenth of its area or volume is lost", 0.0,
         0.0, NULL},
        {"keep-volume", CLI_FLAG, &csg.keep_volume, NULL, "smooth: every component keeps its volume", 0.0, 0.0, NULL},
        {"preserve", CLI_FLAG, &csg.preserve, NULL, "smooth: parts and handles stay as many; writes the zero level of phi", 0.0, 0.0, NULL},
        {"result", CLI_RESULT, &csg.result, "FILE", "PLY, OBJ, STL or GLB, by its extension (default: csg.ply in --out)", 0.0, 0.0,
         NULL},
        {"set", CLI_STRING, &csg.set, "LIST", RUN_OPTIONS_SET_HELP, 0.0, 0.0, NULL},
    };
    const struct cli_positional positionals[] = {
        {"OPERATION", &csg.operation, "union, intersection, difference, offset, smooth or remesh", true},
        {"FIRST", &csg.solids[0].text, "a mesh file, ball:x,y,z,radius or box:x,y,z,half", true},
        {"SECOND", &csg.solids[1].text, "the same, for the first three operations", false},
    };
    const struct cli_rule rules[] = {
        {.given = "amount", .needs = "OPERATION=offset|OPERATION=smooth"},
        {.given = "keep-volume", .needs = "OPERATION=smooth"},
        {.given = "preserve", .needs = "OPERATION=smooth"},
    };
    static const struct cli_writes writes[] = {{.files = "csg.png"}, {.files = "csg.ply", .without = "result"}};
    const struct cli_program program = {.name = "csg",
                                        .summary = "union, intersection, difference, offset, smooth, remesh, with colours kept",
                                        .common = &csg.common,
                                        .options = table,
                                        .option_count = (int)(sizeof table / sizeof *table),
                                        .positionals = positionals,
                                        .positional_count = (int)(sizeof positionals / sizeof *positionals),
                                        .rules = rules,
                                        .rule_count = (int)(sizeof rules / sizeof *rules),
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_CONTINUE) {
        status = check_usage(&csg);
    }
    if (status == CLI_CONTINUE) {
        status = run_options("csg", &csg.common, csg.set, &csg.params);
    }
    if (status == CLI_CONTINUE) {
        status = solid_contouring("csg", csg.common.params, csg.set, &csg.params, &csg.contouring);
    }
    if (status == CLI_CONTINUE && csg.preserve) { /* it is phi whose topology is preserved */
        csg.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        csg.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    }
    if (status == CLI_CONTINUE && csg.result) {
        status = run_check_output("csg", csg.result);
    }
    if (status != CLI_CONTINUE) {
        return status;
    }
    char path[1024];
    if (!csg.result && csg.common.out) {
        csg.result = run_path(csg.common.out, "csg.ply", path, sizeof path);
    }
    springls_backend *backend = NULL;
    bool fine = true;
    for (int i = 0; fine && i < csg.count; ++i) {
        fine = read_solid(&csg.solids[i]);
    }
    if (fine) {
        backend = run_backend("csg", &csg.common);
        fine = run(&csg, backend);
    }
    if (fine && cli_may_print(&csg.common)) {
        print(&csg);
    }
    if (fine) {
        note_topology(&csg);
    }
    fine = fine && (!csg.result || write_result(&csg)) && (!csg.common.out || write_picture(&csg))
           && (!csg.common.json || write_json(&csg, backend));
    const int end = !fine ? CLI_EXIT_FAILURE : warn_of_losses(&csg) && csg.strict ? EXIT_LOSS : CLI_EXIT_OK;
    free_all(&csg);
    springls_cl_destroy(backend);
    return end;
}
