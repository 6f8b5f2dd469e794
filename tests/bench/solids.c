/* solids - damaged solids whose truth is known, mended by build/mend, by CGAL's Alpha_wrap_3 and by OpenVDB: what comes out.
 *
 * Shapes (solids_shapes.h, and closed meshes of SPRINGLS_DATA) are damaged in ten ways and three strengths (tests/mesh_damage.h). What is
 * measured of each goes into build/solids/results.txt, a line for each solid and program; with --keep lines of before stay, so that a long
 * run can be done in parts. */
#include "runs.h"
#include "solids_shapes.h"
#include "table.h"

#include "examples/common/base/cli.h"
#include "examples/common/pictures/raycast.h"
#include "examples/common/surface/mesh_check.h"
#include "examples/common/surface/mesh_io.h"
#include "examples/common/surface/surface_distances.h"
#include "tests/mesh_damage.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { GRID = 128, MARGIN = 10, STRENGTHS = 3, SAMPLES = 30000, SHAPES = 14, MOST = SHAPES * DAMAGE_KINDS * STRENGTHS, PICTURE = 300 };
enum { OURS, WRAP, OPENVDB, TOOLS };

static const char folder[] = "build/solids", wrapper[] = "build/bench/solids_cgal", voxels[] = "build/bench/solids_openvdb";
static const char *const tool_names[TOOLS] = {"mend", "Alpha_wrap_3", "OpenVDB"};
static const char *const collection[] = {"spot.obj",      "femur.off",     "knot1.off", "rocker-arm.obj",
                                         "armadillo.off", "lucy_100k.ply", "igea.ply"};

struct shape {
    char name[32];
    struct mesh mesh;
    struct mesh_check truth;
    double volume;
};

struct outcome {
    int made, closed, crossings, components, genus; /* made: 0, there is no mesh; -1: was not tried */
    double volume, mean, largest, slivers, seconds; /* volume: over the truth's; voxels; share of the angles; of processor */
    int triangles;
};

struct solid {
    int shape, kind, strength;
    struct outcome outcomes[TOOLS];
};

struct bench {
    struct shape shapes[SHAPES];
    int shape_count, count, wanted;
    struct solid solids[MOST];
    bool keep, alone, judge, there[TOOLS];
    const char *page, *picture;
};

static bool failed(const char *message)
{
    fprintf(stderr, "solids: %s\n", message);
    return false;
}

/* ---- shapes ---- */

/* Takes a mesh for a shape: one that is closed and does not cross itself. */
static bool add_shape(struct bench *b, const char *name, struct mesh *mesh)
{
    struct shape *s = &b->shapes[b->shape_count];
    const int *triangles = (const int *)mesh->indices;
    if (!mesh_check(mesh->positions, (int)mesh->vertex_count, triangles, (int)mesh->triangle_count, &s->truth)) {
        return failed("not enough memory");
    }
    if (s->truth.open_edges > 0 || s->truth.intersections > 0) {
        fprintf(stderr, "solids: %s is open or crosses itself: left out\n", name);
        return false;
    }
    snprintf(s->name, sizeof s->name, "%.*s", (int)strcspn(name, "."), name);
    s->mesh = *mesh;
    s->volume = mesh_volume(mesh->positions, triangles, (int)mesh->triangle_count);
    ++b->shape_count;
    return true;
}

static bool find_shapes(struct bench *b)
{
    const char *data = getenv("SPRINGLS_DATA");
    for (int i = 0; i < SOLIDS_GENERATED; ++i) {
        struct mesh mesh;
        const char *name;
        if (!solids_shape(i, &mesh, &name)) {
            return failed("not enough memory");
        }
        if (!add_shape(b, name, &mesh)) {
            return false;
        }
    }
    for (size_t i = 0; data && *data && i < sizeof collection / sizeof *collection; ++i) {
        char path[1024], error[MESH_TEXT];
        struct mesh mesh;
        snprintf(path, sizeof path, "%s/meshes/%s", data, collection[i]);
        if (!mesh_read(path, &mesh, error)) {
            failed(error);
        } else if (!add_shape(b, collection[i], &mesh)) {
            mesh_free(&mesh);
        }
    }
    return true;
}

static int common_factor(int a, int b) { return b ? common_factor(b, a % b) : a; }

/* Lists the solids: as many as are wanted, or all, in an order whose beginning is spread over all shapes and damages: steps of the golden
 * section. */
static void plan(struct bench *b)
{
    const int all = b->shape_count * DAMAGE_KINDS * STRENGTHS;
    int step = (int)(0.6180339887 * all + 0.5);
    while (common_factor(all, step) > 1) {
        ++step;
    }
    b->count = b->wanted > 0 && b->wanted < all ? b->wanted : all;
    for (int i = 0; i < b->count; ++i) {
        const int number = (int)((long)i * step % all), damage = number / b->shape_count;
        struct solid *s = &b->solids[i];
        s->shape = number % b->shape_count;
        s->kind = damage % DAMAGE_KINDS;
        s->strength = damage / DAMAGE_KINDS;
        for (int t = 0; t < TOOLS; ++t) {
            s->outcomes[t].made = -1;
        }
    }
}

/* ---- results of before ---- */

static void write_line(FILE *file, const struct bench *b, const struct solid *s, int tool)
{
    const struct outcome *o = &s->outcomes[tool];
    fprintf(file, "%s %d %d %d %d %d %d %d %d %.6g %.6g %.6g %.6g %.3f %d\n", b->shapes[s->shape].name, s->kind, s->strength, tool, o->made,
            o->closed, o->crossings, o->components, o->genus, o->volume, o->mean, o->largest, o->slivers, o->seconds, o->triangles);
}

static void read_line(struct bench *b, const char *line)
{
    char name[32];
    int kind, strength, tool;
    struct outcome o;
    if (sscanf(line, "%31s %d %d %d %d %d %d %d %d %lf %lf %lf %lf %lf %d", name, &kind, &strength, &tool, &o.made, &o.closed, &o.crossings,
               &o.components, &o.genus, &o.volume, &o.mean, &o.largest, &o.slivers, &o.seconds, &o.triangles) != 15
        || tool < 0 || tool >= TOOLS) {
        return;
    }
    for (int i = 0; i < b->count; ++i) {
        struct solid *s = &b->solids[i];
        if (s->kind == kind && s->strength == strength && strcmp(b->shapes[s->shape].name, name) == 0) {
            s->outcomes[tool] = o;
        }
    }
}

static void read_results(struct bench *b, const char *path)
{
    char line[400];
    FILE *file = fopen(path, "r");
    while (file && fgets(line, sizeof line, file)) {
        read_line(b, line);
    }
    if (file) {
        fclose(file);
    }
}

/* ---- one solid ---- */

static void path_of(const char *name, char path[200]) { snprintf(path, 200, "%s/%s", folder, name); }

static const char *const files[TOOLS] = {"mend.ply", "wrap.off", "openvdb.off"};

static bool write_damaged(const struct bench *b, const struct solid *s, struct damaged *m, double *voxel)
{
    const struct mesh *mesh = &b->shapes[s->shape].mesh;
    char error[MESH_TEXT] = "not enough memory", path[200];
    float lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY}, longest = 0.0f;
    const uint64_t seed = (uint64_t)(1 + s->kind + 100 * s->strength + 1000 * s->shape);
    path_of("damaged.ply", path);
    bool fine = damage_begin(m, mesh->positions, mesh->vertex_count, mesh->indices, mesh->triangle_count, seed)
                && damage_do(m, (enum damage_kind)s->kind, s->strength);
    if (fine) {
        const struct mesh_arrays arrays = {.positions = m->positions,
                                           .vertex_count = m->vertex_count,
                                           .indices = m->indices,
                                           .triangle_count = m->triangle_count};
        raycast_grow_box(m->positions, m->vertex_count, lower, upper);
        for (int c = 0; c < 3; ++c) {
            longest = fmaxf(longest, upper[c] - lower[c]);
        }
        *voxel = (double)longest / (GRID - MARGIN); /* as mend's grid has them */
        fine = mesh_write(path, &arrays, error);
    }
    return fine || failed(error);
}

static void measure(const struct shape *truth, const struct mesh *mesh, double voxel, struct outcome *o)
{
    const struct surface a = {mesh->positions, mesh->indices, mesh->triangle_count};
    const struct surface c = {truth->mesh.positions, truth->mesh.indices, truth->mesh.triangle_count};
    const int *triangles = (const int *)mesh->indices;
    struct surface_distances d;
    struct mesh_check check;
    o->made = mesh_check(mesh->positions, (int)mesh->vertex_count, triangles, (int)mesh->triangle_count, &check)
              && surface_distances_measure(&a, &c, SAMPLES, voxel, &d);
    if (!o->made) {
        return;
    }
    o->closed = check.open_edges == 0;
    o->crossings = check.intersections;
    o->components = check.components;
    o->genus = check.components - check.euler / 2;
    o->volume = mesh_volume(mesh->positions, triangles, (int)mesh->triangle_count) / truth->volume;
    o->mean = d.assd / voxel;
    o->largest = d.max / voxel;
    o->slivers = mesh_sharp_angles(mesh->positions, triangles, (int)mesh->triangle_count, 10.0);
    o->triangles = (int)mesh->triangle_count;
}

static void command_of(int tool, double voxel, struct run *run)
{
    const double alpha = 2.0, offset = 0.1; /* voxels */
    char result[200], input[200];
    path_of(files[tool], result);
    path_of("damaged.ply", input);
    run_name(run, "%s", tool_names[tool]);
    if (tool == OURS) {
        run_command(run, "build/mend %s --grid %d --out %s --json -", input, GRID, result);
    } else if (tool == WRAP) {
        run_command(run, "%s wrap %s %s %.9g %.9g", wrapper, input, result, alpha * voxel, offset * voxel);
    } else {
        run_command(run, "%s %s %s %.9g", voxels, input, result, voxel);
    }
}

/* Counts the crossings by CGAL where it is there; else they are those of mesh_check. */
static void judge_crossings(const struct bench *b, const char *path, struct outcome *o)
{
    const struct run_options options = {.folder = folder, .at_once = 1};
    struct run run = {.name = "crossings"};
    if (!b->judge) {
        return;
    }
    run_command(&run, "%s crossings %s", wrapper, path);
    runs_do(&run, 1, &options);
    const double crossings = run_number(&run, "crossings");
    o->crossings = isfinite(crossings) ? (int)crossings : o->crossings;
    runs_free(&run, 1);
}

static void try_tool(const struct bench *b, struct solid *s, int tool, double voxel)
{
    const struct run_options options = {.folder = folder, .at_once = 1};
    struct outcome *o = &s->outcomes[tool];
    struct run run;
    struct mesh mesh;
    char path[200], error[MESH_TEXT];
    memset(&run, 0, sizeof run);
    memset(o, 0, sizeof *o);
    path_of(files[tool], path);
    remove(path);
    command_of(tool, voxel, &run);
    runs_do(&run, 1, &options);
    o->seconds = run.cpu;
    if (run.json && mesh_read(path, &mesh, error)) {
        measure(&b->shapes[s->shape], &mesh, voxel, o);
        mesh_free(&mesh);
        judge_crossings(b, path, o);
    }
    runs_free(&run, 1);
}

static bool do_solid(const struct bench *b, struct solid *s, FILE *results)
{
    struct damaged m;
    double voxel;
    bool missing = false;
    for (int t = 0; t < TOOLS; ++t) {
        missing = missing || (b->there[t] && s->outcomes[t].made < 0);
    }
    if (!missing) {
        return true;
    }
    const bool fine = write_damaged(b, s, &m, &voxel);
    damage_end(&m);
    for (int t = 0; fine && t < TOOLS; ++t) {
        if (b->there[t] && s->outcomes[t].made < 0) {
            try_tool(b, s, t, voxel);
            write_line(results, b, s, t);
        }
    }
    fflush(results);
    return fine;
}

/* ---- tables ---- */

static bool genus_right(const struct bench *b, const struct solid *s, const struct outcome *o)
{
    const struct mesh_check *truth = &b->shapes[s->shape].truth;
    return o->closed && o->components == truth->components && o->genus == truth->components - truth->euler / 2;
}

static bool volume_right(const struct outcome *o) { return o->closed && fabs(o->volume - 1.0) < 0.01; }

static bool all_right(const struct bench *b, const struct solid *s, const struct outcome *o)
{
    return o->made > 0 && o->crossings == 0 && genus_right(b, s, o) && volume_right(o) && o->mean < 0.05;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Returns a quantile of a number of the outcomes, by its place in them. */
static double quantile(const struct bench *b, int tool, size_t member, double share)
{
    static double values[MOST];
    int n = 0;
    for (int i = 0; i < b->count; ++i) {
        const struct outcome *o = &b->solids[i].outcomes[tool];
        if (o->made > 0) {
            memcpy(&values[n++], (const char *)o + member, sizeof *values);
        }
    }
    qsort(values, (size_t)n, sizeof *values, compare_doubles);
    return n ? values[(int)(share * (n - 1) + 0.5)] : NAN;
}

static double mean_triangles(const struct bench *b, int tool)
{
    double sum = 0.0, n = 0.0;
    for (int i = 0; i < b->count; ++i) {
        const struct outcome *o = &b->solids[i].outcomes[tool];
        sum += o->made > 0 ? (double)o->triangles : 0.0;
        n += o->made > 0;
    }
    return sum / n;
}

/* Alpha_wrap_3 lies outside by its offset, which is more than the limit of the distance. */
static bool is_judged(int tool) { return tool != WRAP; }

static void print_programs(const struct bench *b, FILE *file)
{
    static struct table table;
    table_begin(&table);
    table_row(&table,
              "Of %d solids|Closed|Without crossings|Genus and parts right|Volume within 1 %%|Mean distance < .05 voxel|All of these",
              b->count);
    for (int t = 0; t < TOOLS; ++t) {
        int n[6] = {0};
        for (int i = 0; b->there[t] && i < b->count; ++i) {
            const struct outcome *o = &b->solids[i].outcomes[t];
            const bool made = o->made > 0;
            n[0] += made && o->closed;
            n[1] += made && o->crossings == 0;
            n[2] += made && genus_right(b, &b->solids[i], o);
            n[3] += made && volume_right(o);
            n[4] += made && o->mean < 0.05;
            n[5] += all_right(b, &b->solids[i], o);
        }
        if (b->there[t]) {
            table_row(&table, "%s|%d|%d|%d|%d|%s|%s", tool_names[t], n[0], n[1], n[2], n[3], is_judged(t) ? cell("%.0f", n[4]) : "-",
                      is_judged(t) ? cell("%.0f", n[5]) : "-");
        }
    }
    table_print(&table, file);
    fputc('\n', file);
    table_begin(&table);
    table_row(&table,
              "Median (95 of 100 are below)|Mean distance, voxels|Largest distance, voxels|Angles < 10 degrees, %%|Seconds of processor|"
              "Triangles, mean");
    for (int t = 0; t < TOOLS; ++t) {
        if (b->there[t]) {
#define QUANTILES(format, member, factor) \
    cell(format, factor * quantile(b, t, offsetof(struct outcome, member), 0.5)), \
        cell(format, factor * quantile(b, t, offsetof(struct outcome, member), 0.95))
            table_row(&table, "%s|%s (%s)|%s (%s)|%s (%s)|%s (%s)|%.0f", tool_names[t], QUANTILES("%.3f", mean, 1.0),
                      QUANTILES("%.2f", largest, 1.0), QUANTILES("%.1f", slivers, 100.0), QUANTILES("%.1f", seconds, 1.0),
                      mean_triangles(b, t));
#undef QUANTILES
        }
    }
    table_print(&table, file);
}

/* Writes "right of all" of the solids of a kind and strength, and a shape; -1: of all. */
static const char *right_of(const struct bench *b, int tool, int shape, int kind, int strength, char text[32])
{
    int right = 0, all = 0;
    for (int i = 0; i < b->count; ++i) {
        const struct solid *s = &b->solids[i];
        if ((shape < 0 || s->shape == shape) && (kind < 0 || s->kind == kind) && (strength < 0 || s->strength == strength)) {
            right += all_right(b, s, &s->outcomes[tool]);
            ++all;
        }
    }
    snprintf(text, 32, b->there[tool] ? "%d of %d" : "-", right, all);
    return text;
}

static void print_kinds(const struct bench *b, FILE *file)
{
    static struct table table;
    char text[4][32];
    table_begin(&table);
    table_row(&table, "All right, by damage|mend, little|more|most|OpenVDB");
    for (int k = 0; k < DAMAGE_KINDS; ++k) {
        table_row(&table, "%s|%s|%s|%s|%s", damage_names[k], right_of(b, OURS, -1, k, 0, text[0]), right_of(b, OURS, -1, k, 1, text[1]),
                  right_of(b, OURS, -1, k, 2, text[2]), right_of(b, OPENVDB, -1, k, -1, text[3]));
    }
    table_print(&table, file);
    fputc('\n', file);
    table_begin(&table);
    table_row(&table, "All right, by shape|mend|OpenVDB");
    for (int s = 0; s < b->shape_count; ++s) {
        table_row(&table, "%s|%s|%s", b->shapes[s].name, right_of(b, OURS, s, -1, -1, text[0]), right_of(b, OPENVDB, s, -1, -1, text[1]));
    }
    table_print(&table, file);
}

/* Names what mend has wrong. */
static void print_wrong(const struct bench *b, FILE *file)
{
    for (int i = 0; i < b->count; ++i) {
        const struct solid *s = &b->solids[i];
        const struct outcome *o = &s->outcomes[OURS];
        const struct mesh_check *truth = &b->shapes[s->shape].truth;
        if (all_right(b, s, o)) {
            continue;
        }
        fprintf(file, "- %s, %s, strength %d:", b->shapes[s->shape].name, damage_names[s->kind], s->strength + 1);
        if (o->made <= 0) {
            fprintf(file, " nothing is made");
        } else {
            fprintf(file, "%s%s", o->closed ? "" : " open;", o->crossings ? " crosses itself;" : "");
            if (!genus_right(b, s, o)) {
                fprintf(file, " genus %d of %d, parts %d of %d;", o->genus, truth->components - truth->euler / 2, o->components,
                        truth->components);
            }
            fprintf(file, " volume %+.2f %%, mean distance %.3f voxels", 100.0 * (o->volume - 1.0), o->mean);
        }
        fputc('\n', file);
    }
}

/* ---- a picture ---- */

/* Draws a damaged solid and what each program makes of it. */
static bool draw(const struct bench *b)
{
    const struct solid s = {.shape = 5, .kind = DAMAGE_SHELL, .strength = 2};
    const float direction[3] = {0.9f, -1.0f, 0.8f}, up[3] = {0.0f, 0.0f, 1.0f};
    const char *captions[TOOLS + 1] = {"damaged"};
    struct image pictures[TOOLS + 1], strip;
    struct bench shown = *b;
    struct damaged m;
    double voxel;
    int count = 0;
    memset(pictures, 0, sizeof pictures);
    memset(&strip, 0, sizeof strip);
    bool fine = write_damaged(&shown, &s, &m, &voxel);
    damage_end(&m);
    struct raycast_camera camera = {.field_of_view = 0.0f};
    for (int t = -1; fine && t < TOOLS; ++t) {
        struct solid again = s;
        struct mesh mesh;
        char path[200], error[MESH_TEXT];
        if (t >= 0 && !b->there[t]) {
            continue;
        }
        path_of(t < 0 ? "damaged.ply" : files[t], path);
        if (t >= 0) {
            try_tool(b, &again, t, voxel);
        }
        if (!mesh_read(path, &mesh, error)) {
            continue;
        }
        if (t < 0) {
            camera = raycast_frame_points(mesh.positions, mesh.vertex_count, direction, up, 0.0f, 1.0f);
        }
        const struct raycast_scene scene = {.positions = mesh.positions,
                                            .vertex_count = mesh.vertex_count,
                                            .indices = mesh.indices,
                                            .triangle_count = mesh.triangle_count,
                                            .style = RAYCAST_SPRINGL,
                                            .edged = 1, /* flat */
                                            .background_top = {1.0f, 1.0f, 1.0f},
                                            .background_bottom = {1.0f, 1.0f, 1.0f},
                                            .camera = camera};
        captions[count] = t < 0 ? "damaged" : tool_names[t];
        fine = raycast_render(&scene, PICTURE, PICTURE, &pictures[count++]);
        mesh_free(&mesh);
    }
    fine = fine && image_strip(pictures, captions, count, count, color_rgb(1.0f, 1.0f, 1.0f), &strip)
           && image_write_small_png(&strip, 64, b->picture);
    for (int i = 0; i < count; ++i) {
        image_free(&pictures[i]);
    }
    image_free(&strip);
    return fine || failed("a picture cannot be drawn or written");
}

/* ---- all ---- */

static void print_tables(const struct bench *b, FILE *file)
{
    print_programs(b, file);
    fputc('\n', file);
    print_kinds(b, file);
}

static bool write_page(const struct bench *b)
{
    static const char template_path[] = "tests/bench/solids_page.md";
    char *text = read_whole_file(template_path), *cut = text ? strstr(text, "<!-- tables -->\n") : NULL;
    char *wrong = text ? strstr(text, "<!-- wrong -->\n") : NULL;
    if (!cut || !wrong) {
        fprintf(stderr, "solids: %s: cannot be read, or has no places for tables\n", template_path);
        free(text);
        return false;
    }
    FILE *file = fopen(b->page, "w");
    if (!file) {
        free(text);
        return cli_write_failed("solids", b->page);
    }
    *cut = *wrong = '\0';
    fputs("<!-- written by: make solids", file);
    if (b->wanted > 0) {
        fprintf(file, " SOLIDS=%d", b->wanted);
    }
    fprintf(file, "%s PAGE=%s -->\n\n%s", b->alone ? " ALONE=1" : "", b->page, text);
    print_tables(b, file);
    fputs(strchr(cut + 1, '\n') + 1, file);
    print_wrong(b, file);
    fputs(strchr(wrong + 1, '\n') + 1, file);
    free(text);
    return fclose(file) == 0 || cli_write_failed("solids", b->page);
}

static bool run(struct bench *b)
{
    char path[200];
    if (!make_folder(folder)) {
        return cli_write_failed("solids", folder);
    }
    if (!find_shapes(b)) {
        return false;
    }
    b->there[OURS] = true;
    b->judge = access(wrapper, X_OK) == 0;
    b->there[WRAP] = b->judge && !b->alone;
    b->there[OPENVDB] = access(voxels, X_OK) == 0 && !b->alone;
    plan(b);
    path_of("results.txt", path);
    if (b->keep) {
        read_results(b, path);
    }
    FILE *results = fopen(path, b->keep ? "a" : "w");
    if (!results) {
        return cli_write_failed("solids", path);
    }
    bool fine = true;
    for (int i = 0; fine && i < b->count; ++i) {
        fprintf(stderr, "\rsolids: %d of %d", i + 1, b->count);
        fine = do_solid(b, &b->solids[i], results);
    }
    fputc('\n', stderr);
    if (fclose(results) != 0) {
        fine = cli_write_failed("solids", path);
    }
    if (fine) {
        print_tables(b, stdout);
        fputs("\nWrong:\n\n", stdout);
        print_wrong(b, stdout);
    }
    return fine && (!b->picture || draw(b)) && (!b->page || write_page(b));
}

int main(int argc, char **argv)
{
    static struct bench b;
    struct cli_common common = cli_common_defaults();
    const struct cli_option table[] = {
        {"solids", CLI_INT, &b.wanted, "N", "so many of them, spread over all kinds (default: all)", 1.0, 1e6, NULL},
        {"keep", CLI_FLAG, &b.keep, NULL, "what has been measured before stays", 0.0, 0.0, NULL},
        {"alone", CLI_FLAG, &b.alone, NULL, "mend without the others", 0.0, 0.0, NULL},
        {"page", CLI_OUTPUT, &b.page, "FILE", "write the page too", 0.0, 0.0, NULL},
        {"picture", CLI_OUTPUT, &b.picture, "FILE", "a PNG of one of them", 0.0, 0.0, NULL},
    };
    const struct cli_program program = {.name = "solids",
                                        .summary = "damaged solids, mended by several programs",
                                        .common = &common,
                                        .options = table,
                                        .option_count = (int)(sizeof table / sizeof *table)};
    const int status = cli_parse(&program, argc, argv);
    if (status != CLI_CONTINUE) {
        return status;
    }
    const bool fine = run(&b);
    for (int i = 0; i < b.shape_count; ++i) {
        mesh_free(&b.shapes[i].mesh);
    }
    return fine ? 0 : 1;
}
