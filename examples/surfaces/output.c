/* output.c - one GLB with all labels, a mesh a label, the table, the picture, the report. */
#include "surfaces/surfaces.h"

#include "base/json.h"
#include "base/output_file.h"
#include "base/threads.h"
#include "base/write_error.h"
#include "pictures/raycast.h"
#include "springls/run_options.h"
#include "surface/gltf_builder.h"
#include "surface/mesh_io.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- meshes ---- */

/* Returns the label's name, or "label 7" without one. */
static const char *name_of(const struct surfaces_label *label, char text[LABEL_NAME])
{
    if (label->name[0]) {
        return label->name;
    }
    snprintf(text, LABEL_NAME, "label %lu", (unsigned long)label->id);
    return text;
}

/* Adds a node with the mesh and material of a label. */
static void add_label(struct gltf *g, const struct surfaces_label *label, int number)
{
    struct material material = material_plain();
    char text[LABEL_NAME];
    const char *name = name_of(label, text);
    for (int c = 0; c < 3; ++c) {
        material.base[c] = color_linear(label->color[c]);
    }
    snprintf(material.name, sizeof material.name, "%s", name);
    const struct gltf_look look = {.materials = &material, .material_count = 1};
    const struct gltf_mesh mesh = {.positions = label->mesh.places, .normals = label->normals,
                                   .triangles = (const int *)(const void *)label->mesh.triangles,
                                   .vertex_count = (int)label->mesh.vertex_count, .triangle_count = (int)label->mesh.triangle_count};
    gltf_mesh(g, &mesh, &look, gltf_materials(g, &look));
    cJSON *node = gltf_add(g, "nodes", NULL), *extras = cJSON_AddObjectToObject(node, "extras");
    cJSON_AddStringToObject(node, "name", name);
    gltf_number(node, "mesh", number);
    gltf_number(extras, "label", (double)label->id);
    gltf_number(extras, "volume_mm3", label->volume);
    gltf_number(extras, "area_mm2", label->area);
}

static bool write_all(const struct surfaces *run, const char *path)
{
    struct gltf g;
    int *roots = malloc((run->chosen + 1) * sizeof *roots), count = 0;
    if (!roots) {
        return surfaces_no_memory();
    }
    gltf_begin(&g);
    for (size_t l = 0; l < run->count; ++l) {
        if (run->labels[l].chosen) {
            add_label(&g, &run->labels[l], count);
            roots[count] = count;
            ++count;
        }
    }
    gltf_scene(&g, roots, count);
    free(roots);
    errno = 0;
    return gltf_finish(&g, path) || cli_write_failed("surfaces", path);
}

/* Writes label_7_NAME.ply, or layer_1_label_7_NAME.ply of a file with several layers. */
static bool write_one(const struct surfaces *run, const struct surfaces_label *label)
{
    char path[1024], error[MESH_TEXT], file[160], layer[24] = "", name[LABEL_NAME + 1] = "";
    if (run->layers > 1) {
        snprintf(layer, sizeof layer, "layer_%d_", label->layer);
    }
    snprintf(name, sizeof name, "%s%s", label->name[0] ? "_" : "", label->name);
    for (char *c = name; *c; ++c) {
        *c = isalnum((unsigned char)*c) || *c == '-' || *c == '.' ? *c : '_';
    }
    snprintf(file, sizeof file, "%slabel_%lu%s.%s", layer, (unsigned long)label->id, name, run->settings.format);
    const struct mesh_arrays mesh = {.positions = label->mesh.places, .normals = label->normals,
                                     .vertex_count = label->mesh.vertex_count, .indices = label->mesh.triangles,
                                     .triangle_count = label->mesh.triangle_count, .comment = "millimetres, RAS+"};
    return mesh_write(run_path(run->settings.common.out, file, path, sizeof path), &mesh, error) || surfaces_fail("%s", error);
}

/* ---- table ---- */

/* Writes a field of a CSV file in quotes, which are doubled inside. */
static void write_quoted(FILE *file, const char *text)
{
    fputc('"', file);
    for (; *text; ++text) {
        if (*text == '"') {
            fputc('"', file);
        }
        fputc(*text, file);
    }
    fputc('"', file);
}

static bool write_table(const struct surfaces *run, const char *path)
{
    struct output_file output;
    errno = 0;
    if (!output_file_open(&output, path)) {
        return cli_write_failed("surfaces", path);
    }
    fputs("label,name,layer,voxels,voxels_ml,volume_ml,area_cm2,triangles\n", output.file);
    for (size_t l = 0; l < run->count; ++l) {
        const struct surfaces_label *label = &run->labels[l];
        if (!label->chosen) {
            continue;
        }
        fprintf(output.file, "%lu,", (unsigned long)label->id);
        write_quoted(output.file, label->name);
        fprintf(output.file, ",%d,%zu,%.6g,%.6g,%.6g,%zu\n", label->layer, label->voxels,
                (double)label->voxels * (double)run->voxel_mm3 / 1000.0, label->volume / 1000.0, label->area / 100.0,
                label->mesh.triangle_count);
    }
    return output_file_close(&output, ferror(output.file) == 0) || cli_write_failed("surfaces", path);
}

/* ---- picture ---- */

/* All labels in one mesh with colors. */
struct whole {
    float *places, *normals, *colors;
    uint32_t *triangles;
    size_t vertices, triangle_count;
};

static bool gather(const struct surfaces *run, struct whole *whole)
{
    size_t vertices = 0, triangles = 0;
    for (size_t l = 0; l < run->count; ++l) {
        vertices += run->labels[l].mesh.vertex_count;
        triangles += run->labels[l].mesh.triangle_count;
    }
    memset(whole, 0, sizeof *whole);
    whole->places = malloc((3 * vertices + 1) * sizeof *whole->places);
    whole->normals = malloc((3 * vertices + 1) * sizeof *whole->normals);
    whole->colors = malloc((3 * vertices + 1) * sizeof *whole->colors);
    whole->triangles = malloc((3 * triangles + 1) * sizeof *whole->triangles);
    if (!whole->places || !whole->normals || !whole->colors || !whole->triangles) {
        return false;
    }
    for (size_t l = 0; l < run->count; ++l) {
        const struct surfaces_label *label = &run->labels[l];
        const struct label_surface *mesh = &label->mesh;
        if (mesh->vertex_count == 0) {
            continue;
        }
        memcpy(whole->places + 3 * whole->vertices, mesh->places, 3 * mesh->vertex_count * sizeof *mesh->places);
        memcpy(whole->normals + 3 * whole->vertices, label->normals, 3 * mesh->vertex_count * sizeof *label->normals);
        for (size_t v = 0; v < mesh->vertex_count; ++v) {
            memcpy(whole->colors + 3 * (whole->vertices + v), label->color, sizeof label->color);
        }
        for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
            whole->triangles[3 * whole->triangle_count + i] = (uint32_t)whole->vertices + mesh->triangles[i];
        }
        whole->vertices += mesh->vertex_count;
        whole->triangle_count += mesh->triangle_count;
    }
    return true;
}

static void whole_free(struct whole *whole)
{
    free(whole->places);
    free(whole->normals);
    free(whole->colors);
    free(whole->triangles);
}

/* Draws all labels from the front and from behind. */
static bool draw(const struct surfaces *run, const char *path)
{
    static const float directions[2][3] = {{0.35f, 1.0f, 0.25f}, {-0.35f, -1.0f, 0.25f}}, up[3] = {0.0f, 0.0f, 1.0f};
    enum { SIZE = 520 };
    struct whole whole;
    struct image views[2] = {{0}}, picture = {0};
    bool drawn = gather(run, &whole);
    for (int v = 0; drawn && v < 2; ++v) {
        const struct raycast_scene scene = {.positions = whole.places, .vertex_count = whole.vertices, .indices = whole.triangles,
                                            .triangle_count = whole.triangle_count, .normals = whole.normals,
                                            .vertex_colors = whole.colors,
                                            .camera = raycast_frame_points(whole.places, whole.vertices, directions[v], up, 0.0f, 1.0f)};
        drawn = raycast_render(&scene, SIZE, SIZE, &views[v]);
    }
    drawn = drawn && image_strip(views, NULL, 2, 2, color_rgb(1.0f, 1.0f, 1.0f), &picture);
    const bool good = drawn ? image_write_small_png(&picture, 256, path) || cli_write_failed("surfaces", path) : surfaces_no_memory();
    image_free(&views[0]);
    image_free(&views[1]);
    image_free(&picture);
    whole_free(&whole);
    return good;
}

/* Without pictures: that of an earlier run would show another result than the files beside it. */
static bool remove_picture(const char *path)
{
    return earlier_file_remove(path) || surfaces_fail("%s: an earlier run's picture cannot be removed: %s", path, write_reason());
}

/* ---- all ---- */

bool surfaces_write(const struct surfaces *run)
{
    const char *out = run->settings.common.out;
    char path[1024];
    bool good = write_all(run, run_path(out, "surfaces.glb", path, sizeof path))
        && surfaces_write_walls(run) && write_table(run, run_path(out, "table.csv", path, sizeof path));
    for (size_t l = 0; good && strcmp(run->settings.format, "none") != 0 && l < run->count; ++l) {
        good = !run->labels[l].chosen || write_one(run, &run->labels[l]);
    }
    good = good && surfaces_report(run, run_path(out, "report.json", path, sizeof path));
    run_path(out, "surfaces.png", path, sizeof path);
    return good && (run->settings.no_pictures ? remove_picture(path) : draw(run, path));
}

bool surfaces_report(const struct surfaces *run, const char *path)
{
    struct json_writer json;
    if (!json_open(&json, path)) {
        return cli_write_failed("surfaces", path);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "program", "surfaces");
    json_string(&json, "labels_file", run->settings.labels);
    json_string(&json, "image_warning", run->warning[0] ? run->warning : NULL);
    json_integer(&json, "layers", run->layers);
    json_integer(&json, "smooth", run->settings.smooth);
    json_integer(&json, "threads", threads_count());
    json_number(&json, "seconds", run->seconds);
    json_array_begin(&json, "labels");
    for (size_t l = 0; l < run->count; ++l) {
        const struct surfaces_label *label = &run->labels[l];
        if (!label->chosen) {
            continue;
        }
        json_object_begin(&json, NULL);
        json_integer(&json, "label", (int64_t)label->id);
        json_string(&json, "name", label->name[0] ? label->name : NULL);
        json_integer(&json, "layer", label->layer);
        json_integer(&json, "voxels", (int64_t)label->voxels);
        json_number(&json, "voxels_ml", (double)label->voxels * (double)run->voxel_mm3 / 1000.0);
        json_number(&json, "volume_ml", label->volume / 1000.0);
        json_number(&json, "area_cm2", label->area / 100.0);
        json_integer(&json, "vertices", (int64_t)label->mesh.vertex_count);
        json_integer(&json, "triangles", (int64_t)label->mesh.triangle_count);
        json_object_end(&json);
    }
    json_array_end(&json);
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("surfaces", path);
}

void surfaces_print(const struct surfaces *run)
{
    double volume = 0.0;
    size_t triangles = 0;
    if (run->warning[0]) {
        fprintf(stderr, "surfaces: warning: %s\n", run->warning);
    }
    if (!cli_may_print(&run->settings.common)) {
        return;
    }
    for (size_t l = 0; l < run->count; ++l) {
        volume += run->labels[l].volume / 1000.0;
        triangles += run->labels[l].mesh.triangle_count;
    }
    printf("%zu of %zu labels, %zu triangles, %.2f ml, %.1f s\n", run->chosen, run->count, triangles, volume, run->seconds);
}
