/* mend.c - makes a solid of a mesh that is none: holes, double shells, fins, junk inside, specks, parts that face the wrong way or overlap.
 * The outer skin is found first (surface/outer_skin.h), and a model is set from it. The result is closed and does not cross itself. */
#include "base/json.h"
#include "base/progress.h"
#include "base/vec3.h"
#include "pictures/raycast.h"
#include "solids/mesh_followed.h"
#include "solids/solid_grid.h"
#include "solids/solid_mesh.h"
#include "springls/indices.h"
#include "springls/run_options.h"
#include "springls_cl.h"
#include "surface/mesh_check.h"
#include "surface/mesh_local.h"
#include "surface/mesh_weld.h"
#include "surface/outer_skin.h"
#include "surface/source_look.h"
#include "surface/textured_mesh.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { PICTURE = 480, EXIT_LOSS = 3, TEXTURE_LEAST = 1024, TEXTURE_MOST = 4096 };

struct mend {
    struct cli_common common;
    const char *input, *out, *picture, *set, *cavities;
    double opening, specks, weld, tolerance; /* voxels */
    int triangles, texture; /* texture: texels a side; 0: none, colors of vertices; -1: found */
    bool strict;
    struct mesh mesh; /* as read, less the origin */
    double origin[3];
    size_t joined; /* pairs of borders */
    struct outer_skin skin;
    struct mesh_followed followed; /* of the skin */
    springls_params params;
    springls_contouring contouring; /* of the result */
    springls_context *ctx;
    springls_mesh result;
    float *colors; /* of the result's vertices */
    struct source_look look; /* of a file with images */
    springls_measures measures;
    double spacing, seconds;
    int dropped; /* specks of the result */
};

/* ---- from the file to the model ---- */

static bool read_mesh(struct mend *m)
{
    char error[MESH_TEXT];
    float lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
    if (!mesh_read_local(m->input, &m->mesh, m->origin, error)) {
        return cli_fail("mend", CLI_EXIT_FAILURE, "%s", error) == CLI_CONTINUE;
    }
    if (m->mesh.vertex_count > 100000000 || m->mesh.triangle_count > 100000000) {
        return cli_fail("mend", CLI_EXIT_FAILURE, "%s: more than 100 million vertices or triangles", m->input) == CLI_CONTINUE;
    }
    mesh_warn_not_finite("mend", m->input, &m->mesh);
    raycast_grow_box(m->mesh.positions, m->mesh.vertex_count, lower, upper);
    return (vec3_within_reach(lower) && vec3_within_reach(upper))
        || cli_fail("mend", CLI_EXIT_FAILURE, "%s: " VEC3_TOO_FAR, m->input) == CLI_CONTINUE;
}

/* Computes the box of some triangles. */
static void box_of(const struct mesh *mesh, const uint32_t *indices, size_t triangle_count, double lower[3], double upper[3])
{
    for (int c = 0; c < 3; ++c) {
        lower[c] = INFINITY;
        upper[c] = -INFINITY;
    }
    for (size_t i = 0; i < 3 * triangle_count; ++i) {
        for (int c = 0; c < 3; ++c) {
            const double x = (double)mesh->positions[3 * (size_t)indices[i] + (size_t)c];
            lower[c] = fmin(lower[c], x);
            upper[c] = fmax(upper[c], x);
        }
    }
}

/* Joins borders and finds the skin, on the voxels of a grid around the whole mesh. */
static bool find_skin(struct mend *m)
{
    double lower[3], upper[3];
    const char *why;
    box_of(&m->mesh, m->mesh.indices, m->mesh.triangle_count, lower, upper);
    m->spacing = solid_grid_of(lower, upper, m->common.grid).spacing[0];
    if (!(m->spacing > 0.0)) {
        return cli_fail("mend", CLI_EXIT_FAILURE, "%s: all of it is one point", m->input) == CLI_CONTINUE;
    }
    if (!mesh_weld(&m->mesh, (float)(m->weld * m->spacing), &m->joined)) {
        return cli_fail("mend", CLI_EXIT_FAILURE, "%s: not enough memory", m->input) == CLI_CONTINUE;
    }
    const struct outer_skin_spec spec = {.spacing = (float)m->spacing,
                                         .opening = (float)m->opening,
                                         .speck = (float)m->specks,
                                         .cavities = strcmp(m->cavities, "keep") == 0};
    if (!outer_skin_find(m->mesh.positions, m->mesh.indices, m->mesh.triangle_count, &spec, &m->skin, &why)) {
        return cli_fail("mend", CLI_EXIT_FAILURE, "%s: %s", m->input, why) == CLI_CONTINUE;
    }
    if (m->skin.triangle_count == 0 && !(m->skin.area > 0.0)) {
        return cli_fail("mend", CLI_EXIT_FAILURE, "%s: no triangle has an area that floats hold; a voxel is %.2g wide: scale the mesh",
                        m->input, m->spacing) == CLI_CONTINUE;
    }
    return true;
}

static bool is_moved(const struct mend *m) { return m->origin[0] != 0.0 || m->origin[1] != 0.0 || m->origin[2] != 0.0; }

/* Reads the images of the file and where they lie on the skin; where it has none, there is nothing to do. */
static bool read_look(struct mend *m)
{
    static const char *const plain[] = {".ply", ".stl", ".off"};
    const char *dot = strrchr(m->input, '.');
    bool skip = !m->out || is_moved(m) || !m->mesh.source;
    for (size_t i = 0; dot && i < sizeof plain / sizeof *plain; ++i) {
        skip = skip || strcasecmp(dot, plain[i]) == 0;
    }
    if (skip) {
        return true;
    }
    uint32_t *numbers = malloc((m->skin.triangle_count + 1) * sizeof *numbers);
    char error[SCENE_TEXT] = "not enough memory";
    enum source_look_status status = SOURCE_LOOK_FAILED;
    for (size_t t = 0; numbers && t < m->skin.triangle_count; ++t) {
        numbers[t] = m->mesh.source[m->skin.source[t]];
    }
    if (numbers) {
        status = source_look_make(m->input, numbers, m->skin.triangle_count, &m->look, error);
    }
    free(numbers);
    if (status != SOURCE_LOOK_FAILED && m->look.missing > 0) {
        fprintf(stderr, "mend: warning: %s: %d image%s cannot be read\n", m->input, m->look.missing, m->look.missing == 1 ? "" : "s");
    }
    return status != SOURCE_LOOK_FAILED || cli_fail("mend", CLI_EXIT_FAILURE, "%s", error) == CLI_CONTINUE;
}

/* Takes the colors at the result's vertices from the images. */
static bool color_by_look(struct mend *m)
{
    const size_t n = (size_t)m->result.vertex_count;
    if (!m->look.triangles) {
        return true;
    }
    free(m->colors);
    m->colors = malloc((n + 1) * 3 * sizeof *m->colors);
    for (size_t v = 0; m->colors && v < n; ++v) {
        source_look_color(&m->look, m->result.positions + 3 * v, m->colors + 3 * v);
    }
    return m->colors != NULL;
}

/* Takes the colors of the mesh's vertices to those of the result, by the places that they come from. */
static bool carry_colors(struct mend *m, const int *triangles)
{
    if (!m->mesh.colors || m->look.triangles) {
        return true;
    }
    const int n = m->result.vertex_count;
    springls_material *places = malloc(((size_t)n + 1) * sizeof *places);
    m->colors = malloc(((size_t)n + 1) * 3 * sizeof *m->colors);
    const bool fine = places && m->colors && springls_mesh_materials(m->ctx, &m->result, places) == SPRINGLS_OK
                      && springls_interpolate_material(places, n, m->mesh.colors, 3, triangles, (int)m->skin.triangle_count, m->colors)
                             == SPRINGLS_OK;
    free(places);
    return fine;
}

/* Leaves as many triangles as asked for. */
static bool thin_out(struct mend *m)
{
    return (m->triangles == 0 && m->tolerance == 0.0) || solid_thin_out(&m->result, m->triangles, m->tolerance * m->spacing, m->colors);
}

/* Prints why a call failed. */
static bool report_failure(const struct mend *m)
{
    const char *why = m->ctx ? springls_last_error(m->ctx) : "";
    return cli_fail("mend", CLI_EXIT_FAILURE, "%s: %s", m->input, *why ? why : "not enough memory") == CLI_CONTINUE;
}

/* Extracts the surface without what encloses so little that the skin would have left it out: hollows that were kept enclose more. */
static bool extract(struct mend *m)
{
    return solid_extract(m->ctx, m->contouring, m->specks * m->spacing * m->spacing * m->spacing, &m->result, &m->dropped);
}

/* Finds how much of the skin the result follows. */
static bool follow_skin(struct mend *m, const int *triangles)
{
    return mesh_followed_by_mesh(m->ctx, m->mesh.positions, triangles, (int)m->skin.triangle_count, (float)m->spacing, &m->result,
                                 &m->followed)
           == SPRINGLS_OK;
}

static bool make_solid(struct mend *m, springls_backend *backend)
{
    double lower[3], upper[3];
    box_of(&m->mesh, m->skin.indices, m->skin.triangle_count, lower, upper);
    const springls_grid_desc grid = solid_grid_of(lower, upper, m->common.grid);
    springls_desc desc = {.grid = grid, .params = &m->params, .backend = backend};
    int *triangles = signed_indices(m->skin.indices, m->skin.triangle_count);
    m->spacing = grid.spacing[0];
    if (!triangles || run_create("mend", &desc, &m->ctx) != CLI_CONTINUE) {
        free(triangles);
        return false;
    }
    const bool fine = springls_set_mesh(m->ctx, m->mesh.positions, (int)m->mesh.vertex_count, 0, triangles, (int)m->skin.triangle_count,
                                        &m->followed.report)
            == SPRINGLS_OK
        && extract(m) && carry_colors(m, triangles) && solid_remove_slivers(&m->result, m->spacing, m->colors)
        && follow_skin(m, triangles) && thin_out(m) && color_by_look(m) && solid_measure(&m->result, &m->measures);
    free(triangles);
    if (!fine) {
        return report_failure(m);
    }
    return m->result.triangle_count > 0
        || cli_fail("mend", CLI_EXIT_FAILURE, "%s: thinner than the voxels, of %.4g: nothing is left", m->input, m->spacing)
        == CLI_CONTINUE;
}

/* ---- output ---- */

/* Names what floats lose of places that are distant from the origin. */
static void warn_of_floats(const struct mend *m)
{
    const double step = mesh_float_step(&m->mesh), much = 0.01; /* voxels */
    const char *dot = m->out ? strrchr(m->out, '.') : NULL;
    if (!is_moved(m) && step > much * m->spacing) {
        fprintf(stderr, "mend: warning: %s: coordinates are read as floats, in steps of %.2g (%.2g voxels): PLY and OBJ are read in double "
                        "precision\n", m->input, step, step / m->spacing);
    } else if (is_moved(m) && dot && strcasecmp(dot, ".stl") == 0) {
        const double furthest = fmax(fabs(m->origin[0]), fmax(fabs(m->origin[1]), fabs(m->origin[2])));
        fprintf(stderr, "mend: warning: %s: STL has floats only, in steps of %.2g (%.2g voxels): PLY, OBJ and GLB keep all digits\n",
                m->out, furthest * 1.2e-7, furthest * 1.2e-7 / m->spacing);
    }
}

static void color_of_texel(const void *user, int triangle, const float weight[3], float color[3])
{
    const struct mend *m = user;
    float place[3] = {0.0f, 0.0f, 0.0f};
    for (int k = 0; k < 3; ++k) {
        vec3_add_scaled(place, weight[k], m->result.positions + 3 * (size_t)m->result.triangles[3 * triangle + k], place);
    }
    source_look_color(&m->look, place, color);
}

/* Returns a side of the result's image: a power of two with at least four texels for each of the file's images. */
static int texture_size(const struct mend *m)
{
    int size = TEXTURE_LEAST;
    while (size < TEXTURE_MOST && (double)size * (double)size < 4.0 * m->look.texels) {
        size *= 2;
    }
    return size;
}

/* Cuts the solid into charts and bakes an image: of the size asked for, or of the least size that charts fit in. textured->atlas.full: they
 * do not. */
static bool bake(const struct mend *m, struct textured_mesh *textured)
{
    const struct gltf_mesh surface = {.positions = m->result.positions,
                                      .normals = m->result.normals,
                                      .triangles = m->result.triangles,
                                      .vertex_count = m->result.vertex_count,
                                      .triangle_count = m->result.triangle_count};
    bool fine = false;
    for (int size = m->texture > 0 ? m->texture : texture_size(m), more = 1; more; size *= 2) {
        fine = textured_mesh_make(&surface, size, 0, color_of_texel, m, textured);
        more = !fine && textured->atlas.full && m->texture < 0 && size < TEXTURE_MOST;
    }
    return fine;
}

/* Writes GLB with the image. */
static bool write_textured(const struct mend *m, struct textured_mesh *textured)
{
    struct material material = material_plain();
    const struct material plain = material;
    for (int i = m->look.scene.material_count - 1; i >= 0; --i) { /* the first with an image */
        material = m->look.scene.materials[i].image >= 0 ? m->look.scene.materials[i] : material;
    }
    memcpy(material.base, plain.base, sizeof material.base);
    material.image = 0;
    material.alpha = MATERIAL_OPAQUE;
    material.two_sided = false;
    const struct gltf_look look = {&material, &textured->picture, 1, 1};
    return gltf_write_mesh(m->out, &textured->mesh, &look) || cli_write_failed("mend", m->out);
}

static bool is_glb(const char *path)
{
    const char *dot = strrchr(path, '.');
    return dot && strcasecmp(dot, ".glb") == 0;
}

/* Names why there is no image though --texture asks for one. */
static void warn_of_texture(const struct mend *m)
{
    const char *why = !m->out ? "there is no --out"
                      : !is_glb(m->out) ? "only GLB gets an image"
                      : is_moved(m) ? "images of meshes far from the origin are left behind"
                      : !m->look.triangles ? "the mesh has no images"
                                           : NULL;
    if (m->texture > 0 && why) {
        fprintf(stderr, "mend: warning: %s: --texture has no effect: %s\n", m->input, why);
    }
}

/* Writes what has colors at vertices, or none. */
static bool write_plain(const struct mend *m)
{
    char error[MESH_TEXT] = "not enough memory";
    uint32_t *indices = unsigned_indices(&m->result);
    const struct mesh_arrays arrays = {.positions = m->result.positions,
                                       .vertex_count = (size_t)m->result.vertex_count,
                                       .indices = indices,
                                       .triangle_count = (size_t)m->result.triangle_count,
                                       .normals = m->result.normals,
                                       .colors = m->colors,
                                       .origin = is_moved(m) ? m->origin : NULL};
    const bool fine = indices && mesh_write(m->out, &arrays, error);
    free(indices);
    return fine || cli_fail("mend", CLI_EXIT_FAILURE, "%s", error) == CLI_CONTINUE;
}

static bool write_solid(const struct mend *m)
{
    struct textured_mesh textured;
    if (!m->look.triangles || m->texture == 0 || !is_glb(m->out)) {
        return write_plain(m);
    }
    if (bake(m, &textured)) {
        const bool fine = write_textured(m, &textured);
        textured_mesh_free(&textured);
        return fine;
    }
    if (!textured.atlas.full) {
        return cli_fail("mend", CLI_EXIT_FAILURE, "%s: not enough memory for an image", m->out) == CLI_CONTINUE;
    }
    if (m->texture > 0) {
        return cli_fail("mend", CLI_EXIT_FAILURE, "%s: --texture %d: too few texels for the charts of the solid", m->input, m->texture)
            == CLI_CONTINUE;
    }
    fprintf(stderr, "mend: warning: %s: the charts of the solid do not fit in %d texels a side: vertices have its colors\n", m->input,
            TEXTURE_MOST);
    return write_plain(m);
}

/* Draws triangles from the front, in two colors: their fronts, and their backs, as where one looks into a hole. */
static bool draw(const float *positions, size_t vertex_count, const uint32_t *indices, size_t triangle_count,
                 const struct raycast_camera *camera, struct image *picture)
{
    const struct raycast_scene scene = {.positions = positions,
                                        .vertex_count = vertex_count,
                                        .indices = indices,
                                        .triangle_count = triangle_count,
                                        .background_top = {1.0f, 1.0f, 1.0f},
                                        .background_bottom = {1.0f, 1.0f, 1.0f},
                                        .camera = *camera};
    return raycast_render(&scene, PICTURE, PICTURE, picture);
}

static bool write_picture(const struct mend *m)
{
    static const char *const captions[2] = {"the mesh", "the solid"};
    const float direction[3] = {0.75f, -1.0f, 0.7f}, up[3] = {0.0f, 0.0f, 1.0f};
    const struct raycast_camera camera = raycast_frame_points(m->mesh.positions, m->mesh.vertex_count, direction, up, 0.0f, 1.0f);
    const size_t n = 3 * (size_t)m->result.triangle_count;
    uint32_t *indices = unsigned_indices(&m->result);
    struct image pictures[2], strip;
    memset(pictures, 0, sizeof pictures);
    bool fine = indices
                && draw(m->mesh.positions, m->mesh.vertex_count, m->mesh.indices, m->mesh.triangle_count, &camera, &pictures[0])
                && draw(m->result.positions, (size_t)m->result.vertex_count, indices, n / 3, &camera, &pictures[1])
                && image_strip(pictures, captions, 2, 2, color_rgb(1.0f, 1.0f, 1.0f), &strip);
    if (fine) {
        fine = image_write_png(&strip, m->picture) || cli_write_failed("mend", m->picture);
        image_free(&strip);
    } else {
        cli_fail("mend", CLI_EXIT_FAILURE, "not enough memory for a picture");
    }
    image_free(&pictures[0]);
    image_free(&pictures[1]);
    free(indices);
    return fine;
}

static int genus(const struct mend *m) { return m->measures.components - m->measures.euler / 2; }

static double share(const struct mend *m, double area) { return m->skin.area > 0.0 ? area / m->skin.area : 0.0; }

/* Returns the share of the mesh's area, without what cannot be seen, that the solid follows or covers. */
static double followed_area(const struct mend *m)
{
    const double seen = m->skin.area - m->skin.hidden;
    const double kept = seen - m->skin.sheets;
    return seen > 0.0 ? (m->followed.area + m->followed.within) * kept / seen : 0.0;
}

/* An open sheet encloses nothing: all that the winding number makes of it is rubble beside its border. */
static bool refuse_sheet(const struct mend *m)
{
    const double most = 0.5;
    return !(m->skin.open && followed_area(m) < most)
        || cli_fail("mend", CLI_EXIT_FAILURE, "%s: an open sheet, which encloses nothing: a solid would follow %.0f %% of it; close it, "
                    "or give it a thickness", m->input, 100.0 * followed_area(m)) == CLI_CONTINUE;
}

static bool lost_much(const struct mend *m) { return m->followed.little || followed_area(m) < 0.9; }

static bool write_json(const struct mend *m, const springls_backend *backend)
{
    struct json_writer json;
    if (!json_open(&json, m->common.json)) {
        return cli_write_failed("mend", m->common.json);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "input", m->input);
    json_integer(&json, "grid", m->common.grid);
    json_number(&json, "spacing", m->spacing);
    json_string(&json, "params", m->common.params);
    json_string(&json, "backend", run_backend_name(backend));
    json_number(&json, "opening", (double)m->skin.opening);
    json_integer(&json, "borders_joined", (int64_t)m->joined);
    json_integer(&json, "patches", m->skin.patches);
    json_integer(&json, "patches_turned", m->skin.turned);
    json_array_begin(&json, "origin");
    for (int c = 0; c < 3; ++c) {
        json_number(&json, NULL, m->origin[c]);
    }
    json_array_end(&json);
    json_bool(&json, "open", m->skin.open);
    json_number(&json, "hollow", m->skin.hollow);
    json_integer(&json, "cavities", m->skin.cavities);
    json_integer(&json, "specks", m->skin.specks);
    json_integer(&json, "specks_of_result", m->dropped);
    json_number(&json, "area_sheets", share(m, m->skin.sheets));
    json_number(&json, "area_hidden", share(m, m->skin.hidden));
    json_number(&json, "area_followed", followed_area(m));
    json_bool(&json, "little", lost_much(m));
    json_number(&json, "volume", m->measures.volume);
    json_integer(&json, "components", m->measures.components);
    json_integer(&json, "genus", genus(m));
    json_integer(&json, "triangles", m->result.triangle_count);
    json_number(&json, "seconds", m->seconds);
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("mend", m->common.json);
}

static void print(const struct mend *m)
{
    char text[256];
    printf("%-9s ", "the mesh");
    if (m->joined) {
        printf("%zu pairs of borders are joined; ", m->joined);
    }
    printf("%d patches, %d turned; a ball of radius %.3g voxels %s\n", m->skin.patches, m->skin.turned,
           (double)m->skin.opening, m->opening > 0.0 ? "as asked" : "(--opening) fits it");
    printf("%-9s %.1f %% of the area is hidden, %.1f %% is sheets that bound nothing", "left out", 100.0 * share(m, m->skin.hidden),
           100.0 * share(m, m->skin.sheets));
    if (m->skin.specks) {
        printf(", %d speck%s", m->skin.specks, m->skin.specks == 1 ? "" : "s");
    }
    if (m->dropped) {
        printf(", %d speck%s of the result", m->dropped, m->dropped == 1 ? "" : "s");
    }
    if (m->skin.cavities) {
        printf("; %d hollow%s %s", m->skin.cavities, m->skin.cavities == 1 ? "" : "s",
               strcmp(m->cavities, "keep") == 0 ? "kept" : "filled (--cavities keep keeps them)");
    }
    if (m->skin.open) {
        printf("; it is open wide, and taken as it is");
    }
    if (is_moved(m)) {
        printf("; coordinates are those beyond (%.0f, %.0f, %.0f)", m->origin[0], m->origin[1], m->origin[2]);
    }
    mesh_followed_text(&m->followed, text, sizeof text);
    printf("\n%-9s %s\n", "its skin", text);
    printf("%-9s volume %.6g, components %d, genus %d; follows %.1f %% of what is seen of the mesh; %d triangles, %.2f s\n", "the solid",
           m->measures.volume, m->measures.components, genus(m), 100.0 * followed_area(m), m->result.triangle_count, m->seconds);
}

/* ---- the run ---- */

/* Prints what is lost: of the area, of the volume, or that parts fall apart. */
static void losses_text(const struct mend *m, char *text, size_t room)
{
    if (followed_area(m) < 0.9) {
        snprintf(text, room, "follows %.1f %% of what is seen of the mesh", 100.0 * followed_area(m));
    } else if (m->followed.bodies > m->followed.report.components) {
        snprintf(text, room, "falls apart: it has %d bodies, the mesh %d part%s", m->followed.bodies, m->followed.report.components,
                 m->followed.report.components == 1 ? "" : "s");
    } else {
        snprintf(text, room, "has %.1f %% of the mesh's volume", 100.0 * m->followed.volume);
    }
}

static bool warn_of_losses(const struct mend *m)
{
    char text[160];
    if (!lost_much(m)) {
        return false;
    }
    const double seen = m->skin.area - m->skin.hidden;
    const char *advice = m->skin.sheets > 0.1 * seen || m->skin.open ? "sheets that enclose nothing are left out: try a larger --opening"
                                                                     : mesh_followed_advice(&m->followed);
    losses_text(m, text, sizeof text);
    fprintf(stderr, "mend: warning: %s: the solid %s: %s\n", m->input, text, advice);
    return true;
}

static bool warn_of_hollow(const struct mend *m)
{
    if (!(m->skin.hollow > 0.0)) {
        return false;
    }
    const double fills = ceil(10.0 * (double)m->skin.fills) / 10.0, most = 64.0; /* that --opening takes */
    fprintf(stderr, "mend: warning: %s: it stays hollow through narrow openings, which leaves %.0f %% or more of what it encloses empty: "
                    "--opening %.1f %s, %.1f is what was taken\n",
            m->input, 100.0 * m->skin.hollow, fmin(fills, most), fills > most ? "fills more of it" : "fills it",
            (double)m->skin.opening);
    return true;
}

static int check_usage(struct mend *m)
{
    char error[MESH_TEXT];
    if (m->out && !mesh_can_write(m->out, error)) {
        return cli_fail("mend", CLI_EXIT_USAGE, "--out: %s", error);
    }
    return cli_grid("mend", &m->common, 128, 24, 4096);
}

static void free_all(struct mend *m)
{
    if (m->ctx) {
        springls_mesh_free(m->ctx, &m->result);
    }
    springls_destroy(m->ctx);
    outer_skin_free(&m->skin);
    mesh_free(&m->mesh);
    source_look_free(&m->look);
    free(m->colors);
}

/* Does all work after the command line is read; returns the exit status. */
static int run(struct mend *m)
{
    const double begin = elapsed_seconds();
    springls_backend *backend = NULL;
    bool fine = read_mesh(m) && find_skin(m) && read_look(m);
    if (fine) {
        backend = run_backend("mend", &m->common);
        fine = make_solid(m, backend) && refuse_sheet(m);
        m->seconds = elapsed_seconds() - begin;
    }
    if (fine && cli_may_print(&m->common)) {
        print(m);
    }
    if (fine) {
        warn_of_floats(m);
        warn_of_texture(m);
    }
    fine = fine && (!m->out || write_solid(m)) && (!m->picture || write_picture(m)) && (!m->common.json || write_json(m, backend));
    const bool lost = fine && warn_of_losses(m);
    const bool doubtful = (fine && warn_of_hollow(m)) || lost;
    const int end = !fine ? CLI_EXIT_FAILURE : doubtful && m->strict ? EXIT_LOSS : CLI_EXIT_OK;
    free_all(m);
    springls_cl_destroy(backend);
    return end;
}

int main(int argc, char **argv)
{
    struct mend m = {.common = cli_common_defaults(), .cavities = "fill", .specks = 8.0, .weld = 0.75, .texture = -1};
    const struct cli_option table[] = {
        {"out", CLI_RESULT, &m.out, "SOLID", "PLY, OBJ, STL or GLB, by its extension", 0.0, 0.0, NULL},
        {"picture", CLI_OUTPUT, &m.picture, "FILE", "a PNG of the mesh and the solid", 0.0, 0.0, NULL},
        {"opening", CLI_DOUBLE, &m.opening, "VOXELS", "what a ball of this radius cannot get into is inside (default: found, and printed)",
         1.0, 64.0, NULL},
        {"cavities", CLI_CHOICE, &m.cavities, NULL, "hollows that are shut", 0.0, 0.0, "fill|keep"},
        {"specks", CLI_DOUBLE, &m.specks, "VOXELS", "closed parts of a smaller volume are left out, voxels^3", 0.0, 1e6, NULL},
        {"weld", CLI_DOUBLE, &m.weld, "VOXELS", "borders that run along each other, no further apart, are joined", 0.0, 64.0, NULL},
        {"triangles", CLI_INT, &m.triangles, "N", "at most so many triangles, the topology permitting", 4.0, 1e8, NULL},
        {"tolerance", CLI_DOUBLE, &m.tolerance, "VOXELS", "fewer triangles, as long as the surface moves by no more", 0.001, 64.0, NULL},
        {"texture", CLI_INT, &m.texture, "N",
         "texels a side of the image in GLB, for files with images (default: 1024 or more, found; 0: colors of vertices)", 0.0, 8192.0,
         NULL},
        {"strict", CLI_FLAG, &m.strict, NULL,
         "exit status 3 where a tenth of what is seen of the mesh or of the volume is lost, or stays hollow", 0.0, 0.0, NULL},
        {"set", CLI_STRING, &m.set, "LIST", RUN_OPTIONS_SET_HELP, 0.0, 0.0, NULL},
    };
    const struct cli_positional positionals[] = {{"MESH", &m.input, "OBJ, PLY, STL, OFF, glTF or what assimp reads", true}};
    const struct cli_program program = {.name = "mend",
                                        .summary = "makes a closed solid of any mesh",
                                        .common = &m.common,
                                        .options = table,
                                        .option_count = (int)(sizeof table / sizeof *table),
                                        .positionals = positionals,
                                        .positional_count = 1,
                                        .without = "out"};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_CONTINUE) {
        status = check_usage(&m);
    }
    if (status == CLI_CONTINUE) {
        status = run_options("mend", &m.common, m.set, &m.params);
    }
    if (status == CLI_CONTINUE) {
        status = solid_contouring("mend", m.common.params, m.set, &m.params, &m.contouring);
    }
    if (status == CLI_CONTINUE && m.out) {
        status = run_check_output("mend", m.out);
    }
    return status == CLI_CONTINUE ? run(&m) : status;
}
