/* subject.c - subjects of an atlas: meshes, or label maps turned into surfaces. */
#define _POSIX_C_SOURCE 200809L

#include "atlas/atlas.h"

#include "imaging/segment_image.h"
#include "springls/run_options.h"
#include "springls/segment_model.h"
#include "surface/mesh_check.h"
#include "surface/mesh_io.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { MARGIN = 4 };

/* A part below this share of the volume is none of the bodies; above this share of edges bent by more than 60 degrees a surface is
 * ragged (labels drawn by hand have 0.01 to 0.04, noisy ones 0.25). */
static const double SPECK = 0.01, ROUGHEST = 0.06;
static const float MAX_BLUR = 4.0f;

bool atlas_fail(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    const bool failed = cli_failed("atlas", format, list);
    va_end(list);
    return failed;
}

bool atlas_no_memory(void) { return atlas_fail("not enough memory"); }

bool atlas_check(const springls_context *ctx, springls_status status, const char *doing)
{
    return run_check("atlas", ctx, status, doing);
}

void atlas_mesh_free(struct shape_mesh *mesh)
{
    free(mesh->positions);
    free(mesh->triangles);
    memset(mesh, 0, sizeof *mesh);
}

bool atlas_mesh_copy(const float *positions, int vertex_count, const int *triangles, int triangle_count, struct shape_mesh *mesh)
{
    const size_t points = 3 * (size_t)vertex_count, corners = 3 * (size_t)triangle_count;
    mesh->vertex_count = vertex_count;
    mesh->triangle_count = triangle_count;
    mesh->positions = malloc((points + 1) * sizeof *mesh->positions);
    mesh->triangles = malloc((corners + 1) * sizeof *mesh->triangles);
    if (!mesh->positions || !mesh->triangles) {
        atlas_mesh_free(mesh);
        return atlas_no_memory();
    }
    memcpy(mesh->positions, positions, points * sizeof *positions);
    memcpy(mesh->triangles, triangles, corners * sizeof *triangles);
    return true;
}

struct surface atlas_surface(const struct shape_mesh *mesh, const float *positions)
{
    const struct surface surface = {positions ? positions : mesh->positions, (const uint32_t *)(const void *)mesh->triangles,
                                    (size_t)mesh->triangle_count};
    return surface;
}

/* ---- label maps ---- */

int atlas_read_labels(const char *text, int *labels)
{
    int count = 0;
    do {
        char item[16];
        const size_t length = strcspn(text, "+");
        if (length == 0 || length >= sizeof item || count == ATLAS_MAX_LABELS) {
            return -1;
        }
        memcpy(item, text, length);
        item[length] = '\0';
        if (!cli_read_int(item, &labels[count++])) {
            return -1;
        }
        text += length;
    } while (*text++ == '+');
    return count;
}

static bool is_wanted(float value, const int *labels, int count)
{
    bool wanted = count == 0 && value > 0.5f;
    for (int l = 0; l < count; ++l) {
        wanted = wanted || (int)lrintf(value) == labels[l];
    }
    return wanted;
}

bool atlas_crop(const struct volume *from, const int lo[3], const int dims[3], struct volume *part)
{
    const float origin_index[3] = {(float)lo[0], (float)lo[1], (float)lo[2]};
    if (!volume_create(dims, from->spacing, from->origin, part)) {
        return atlas_no_memory();
    }
    memcpy(part->direction, from->direction, sizeof part->direction);
    memcpy(part->affine, from->affine, sizeof part->affine);
    volume_index_to_world(from, origin_index, part->origin);
    for (int r = 0; r < 3; ++r) {
        part->affine[r][3] = (double)part->origin[r];
    }
    float *out = part->data;
    for (int k = lo[2]; k < lo[2] + dims[2]; ++k) {
        for (int j = lo[1]; j < lo[1] + dims[1]; ++j) {
            for (int i = lo[0]; i < lo[0] + dims[0]; ++i, ++out) {
                const bool in = i >= 0 && j >= 0 && k >= 0 && i < from->dims[0] && j < from->dims[1] && k < from->dims[2];
                *out =
                    in ? from->data[(size_t)i + (size_t)from->dims[0] * ((size_t)j + (size_t)from->dims[1] * (size_t)k)] : 0.0f;
            }
        }
    }
    return true;
}

/* Crops a label map to the wanted labels, with a margin. */
static bool crop_labels(const struct volume *all, const int *labels, int count, const char *name, struct volume *part)
{
    int lo[3] = {all->dims[0], all->dims[1], all->dims[2]}, hi[3] = {-1, -1, -1}, dims[3];
    const float *value = all->data;
    for (int k = 0; k < all->dims[2]; ++k) {
        for (int j = 0; j < all->dims[1]; ++j) {
            for (int i = 0; i < all->dims[0]; ++i, ++value) {
                if (!is_wanted(*value, labels, count)) {
                    continue;
                }
                const int place[3] = {i, j, k};
                for (int a = 0; a < 3; ++a) {
                    lo[a] = place[a] < lo[a] ? place[a] : lo[a];
                    hi[a] = place[a] > hi[a] ? place[a] : hi[a];
                }
            }
        }
    }
    if (hi[0] < 0) {
        return atlas_fail("%s: no voxel has that label", name);
    }
    for (int a = 0; a < 3; ++a) {
        lo[a] -= MARGIN;
        dims[a] = hi[a] - lo[a] + 1 + MARGIN;
    }
    if (!atlas_crop(all, lo, dims, part)) {
        return false;
    }
    for (size_t n = 0; n < volume_voxels(part); ++n) {
        part->data[n] = is_wanted(part->data[n], labels, count) ? part->data[n] : 0.0f;
    }
    return true;
}

/* ---- surfaces of label maps ---- */

/* Removes the vertices that no triangle has. */
static bool remove_loose_vertices(struct shape_mesh *mesh)
{
    int *numbers = calloc((size_t)mesh->vertex_count + 1, sizeof *numbers), kept = 0;
    if (!numbers) {
        return atlas_no_memory();
    }
    for (int c = 0; c < 3 * mesh->triangle_count; ++c) {
        numbers[mesh->triangles[c]] = 1;
    }
    for (int v = 0; v < mesh->vertex_count; ++v) {
        if (numbers[v]) {
            memmove(mesh->positions + 3 * kept, mesh->positions + 3 * v, 3 * sizeof *mesh->positions);
            numbers[v] = kept++;
        }
    }
    for (int c = 0; c < 3 * mesh->triangle_count; ++c) {
        mesh->triangles[c] = numbers[mesh->triangles[c]];
    }
    mesh->vertex_count = kept;
    free(numbers);
    return true;
}

int atlas_drop_specks(struct shape_mesh *mesh)
{
    const double smallest = SPECK * mesh_volume(mesh->positions, mesh->triangles, mesh->triangle_count);
    const int dropped = mesh_drop_specks(mesh->positions, mesh->vertex_count, mesh->triangles, &mesh->triangle_count, smallest);
    if (dropped < 0) {
        atlas_no_memory();
    }
    return dropped > 0 && !remove_loose_vertices(mesh) ? -1 : dropped;
}

/* Sets the mask to the bodies of the label map and fills it: without parts and cavities of less than a hundredth of its voxels.
 * Returns the number of voxels inside, 0: memory. */
static size_t main_bodies(const struct volume *labels, float *mask)
{
    const size_t voxels = volume_voxels(labels);
    struct segment_parts bodies, cavities;
    size_t inside = 0, left = 0;
    for (size_t n = 0; n < voxels; ++n) {
        inside += labels->data[n] > 0.5f;
        mask[n] = labels->data[n] > 0.5f ? -1.0f : 1.0f;
    }
    const size_t least = (size_t)(SPECK * (double)inside);
    if (!segment_remove_parts(labels->dims, mask, least, false, &bodies)) {
        return 0;
    }
    for (size_t n = 0; n < voxels; ++n) {
        mask[n] = bodies.kept > 0 ? -mask[n] : labels->data[n] > 0.5f ? 1.0f : -1.0f; /* dust alone stays as it is */
    }
    if (!segment_remove_parts(labels->dims, mask, least, false, &cavities)) {
        return 0;
    }
    for (size_t n = 0; n < voxels; ++n) {
        mask[n] = mask[n] > 0.0f ? 1.0f : 0.0f;
        left += mask[n] > 0.5f;
    }
    return left;
}

static int falling(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x < y) - (x > y);
}

/* Returns the level that `inside` of the values lie above; NaN: memory. */
static float level_of(const float *values, size_t count, size_t inside)
{
    float *sorted = malloc(count * sizeof *sorted);
    if (!sorted) {
        return NAN;
    }
    memcpy(sorted, values, count * sizeof *sorted);
    qsort(sorted, count, sizeof *sorted, falling);
    const float level = 0.5f * (sorted[inside - 1] + sorted[inside < count ? inside : count - 1]);
    free(sorted);
    return level;
}

springls_params atlas_smooth_params(const springls_params *params)
{
    springls_params smooth = params ? *params : springls_default_params();
    smooth.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    return smooth;
}

/* Extracts the surface where the values are `level`. */
static bool level_surface(const struct volume *labels, const float *values, float level, const char *name,
                          struct shape_mesh *mesh)
{
    springls_context *ctx = NULL;
    springls_mesh surface;
    springls_desc desc;
    const springls_params smooth = atlas_smooth_params(NULL);
    memset(&surface, 0, sizeof surface);
    memset(&desc, 0, sizeof desc);
    desc.params = &smooth;
    desc.grid = segment_model_grid(labels->dims, labels->spacing, labels->origin, labels->direction[0]);
    desc.tasks = run_tasks();
    const bool made = springls_create(&desc, &ctx) == SPRINGLS_OK;
    const bool good = (made || atlas_fail("%s: grids of this size are not supported", name))
                   && atlas_check(ctx, springls_set_threshold(ctx, values, level, 2.0f), name)
                   && atlas_check(ctx, springls_extract_mesh(ctx, &surface), name)
                   && atlas_mesh_copy(surface.positions, surface.vertex_count, surface.triangles, surface.triangle_count, mesh);
    if (made) {
        springls_mesh_free(ctx, &surface);
    }
    springls_destroy(ctx);
    return good;
}

/* Extracts the surface of the label map's main bodies, blurred like voxels of `size` mm, at the level that keeps their volume. */
static bool body_surface(const struct volume *labels, float size, float *mask, const char *name, struct shape_mesh *mesh)
{
    const size_t inside = main_bodies(labels, mask);
    const bool blurred = inside > 0 && segment_blur(labels, size, mask);
    const float level = blurred ? level_of(mask, volume_voxels(labels), inside) : NAN;
    return (!isnan(level) || atlas_no_memory()) && level_surface(labels, mask, level, name, mesh)
        && atlas_drop_specks(mesh) >= 0;
}

static bool is_ragged(const struct shape_mesh *mesh)
{
    return mesh_bent_edges(mesh->positions, mesh->triangles, mesh->triangle_count, 0.5f) > ROUGHEST;
}

/* Extracts the surface where the mask, blurred by half its thickest voxel side, is one half: without voxel stairs and
 * specks. Where that is ragged, it is the surface of the main bodies, blurred until it is not, at most MAX_BLUR times as much. */
static bool mask_surface(const struct volume *labels, const char *name, struct shape_mesh *mesh)
{
    const float thickest = fmaxf(labels->spacing[0], fmaxf(labels->spacing[1], labels->spacing[2]));
    const float first = sqrtf(2.0f) * thickest;
    const size_t voxels = volume_voxels(labels);
    float *mask = malloc(voxels * sizeof *mask);
    for (size_t n = 0; mask && n < voxels; ++n) {
        mask[n] = labels->data[n] > 0.5f ? 1.0f : 0.0f;
    }
    bool good = ((mask && segment_blur(labels, first, mask)) || atlas_no_memory())
             && level_surface(labels, mask, 0.5f, name, mesh) && atlas_drop_specks(mesh) >= 0;
    for (float size = first; good && size <= MAX_BLUR * first && is_ragged(mesh); size *= sqrtf(2.0f)) {
        atlas_mesh_free(mesh);
        good = body_surface(labels, size, mask, name, mesh);
    }
    free(mask);
    return good && (mesh->triangle_count > 0 || atlas_fail("%s: no part has a hundredth of the volume", name));
}

uint32_t atlas_label_at(const struct atlas_subject *subject, const float place[3])
{
    const struct volume *labels = &subject->labels;
    float index[3];
    int at[3];
    volume_world_to_index(labels, place, index);
    for (int a = 0; a < 3; ++a) {
        at[a] = (int)floorf(index[a] + 0.5f);
        if (at[a] < 0 || at[a] >= labels->dims[a]) {
            return 0;
        }
    }
    const size_t n = (size_t)at[0] + (size_t)labels->dims[0] * ((size_t)at[1] + (size_t)labels->dims[1] * (size_t)at[2]);
    const long label = lrintf(labels->data[n]);
    return label > 0 && subject->label_ids ? subject->label_ids[label - 1] : (uint32_t)label;
}

/* ---- mirror images ---- */

static void mirror_volume(struct volume *volume, float about)
{
    for (int c = 0; c < 4; ++c) {
        volume->affine[0][c] = c == 3 ? 2.0 * (double)about - volume->affine[0][3] : -volume->affine[0][c];
    }
    volume->origin[0] = 2.0f * about - volume->origin[0];
    for (int c = 0; c < 3; ++c) {
        volume->direction[0][c] = -volume->direction[0][c];
    }
}

static void mirror_mesh(struct shape_mesh *mesh, float about)
{
    for (int v = 0; v < mesh->vertex_count; ++v) {
        mesh->positions[3 * v] = 2.0f * about - mesh->positions[3 * v];
    }
    for (int t = 0; t < mesh->triangle_count; ++t) { /* reverse the corners so that outward stays outward */
        const int second = mesh->triangles[3 * t + 1];
        mesh->triangles[3 * t + 1] = mesh->triangles[3 * t + 2];
        mesh->triangles[3 * t + 2] = second;
    }
}

static int compare_ids(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Returns the number from 1 of an id in an increasing list, 0: it is not there. */
static int number_of_id(uint32_t id, const uint32_t *ids, size_t count)
{
    const uint32_t *found = count > 0 ? bsearch(&id, ids, count, sizeof *ids, compare_ids) : NULL;
    return found ? (int)(found - ids) + 1 : 0;
}

/* Adds an id to an increasing list that has not got it; returns false if memory is short. */
static bool add_id(uint32_t id, uint32_t **ids, size_t *count)
{
    uint32_t *more = realloc(*ids, (*count + 1) * sizeof *more);
    if (!more) {
        return false;
    }
    size_t at = (*count)++;
    for (; at > 0 && more[at - 1] > id; --at) {
        more[at] = more[at - 1];
    }
    more[at] = id;
    *ids = more;
    return true;
}

/* Replaces the values of a label map, of which a float does not hold all, by places from 1 in the list of its ids. */
static bool number_labels(struct volume *all, uint32_t **ids, size_t *count)
{
    const size_t voxels = volume_voxels(all);
    for (size_t n = 0; n < voxels; ++n) {
        const uint32_t id = all->ids[n];
        const bool known = id == 0 || (n > 0 && id == all->ids[n - 1]) || number_of_id(id, *ids, *count) > 0;
        if (!known && !add_id(id, ids, count)) {
            return atlas_no_memory();
        }
    }
    for (size_t n = 0; n < voxels; ++n) {
        const bool same = n > 0 && all->ids[n] == all->ids[n - 1];
        all->data[n] = same ? all->data[n - 1] : (float)number_of_id(all->ids[n], *ids, *count);
    }
    return true;
}

/* Reads a label map. Where a float does not hold all its labels, voxels and `numbers`, of the labels wanted, are places from 1 in *ids. */
static bool read_map(const char *path, const int *labels, int count, struct volume *all, int numbers[ATLAS_MAX_LABELS], uint32_t **ids)
{
    char error[VOLUME_TEXT];
    size_t id_count = 0;
    *ids = NULL;
    if (!volume_read_companion(path, -1, all, error) || !volume_check_labels(all, path, error)) { /* so its labels are few */
        return atlas_fail("%s", error);
    }
    if (count > 0) {
        memcpy(numbers, labels, (size_t)count * sizeof *labels);
    }
    if (!all->ids || all->maximum <= 16777216.0f) {
        return true;
    }
    if (!number_labels(all, ids, &id_count)) {
        return false;
    }
    for (int l = 0; l < count; ++l) {
        const int number = number_of_id((uint32_t)labels[l], *ids, id_count);
        numbers[l] = number > 0 ? number : -1; /* no voxel has it */
    }
    return true;
}

bool atlas_label_surface(const char *path, const int *labels, int count, const char *name, struct volume *part,
                         struct shape_mesh *mesh) {
    struct volume all;
    int numbers[ATLAS_MAX_LABELS];
    uint32_t *ids;
    const bool good = read_map(path, labels, count, &all, numbers, &ids) && crop_labels(&all, numbers, count, name, part)
        && mask_surface(part, name, mesh);
    free(ids);
    volume_free(&all);
    return good;
}

/* ---- subjects ---- */

static const char *const mirror_prefix = "mirror:";

static bool ends_with(const char *text, const char *end)
{
    const size_t length = strlen(text), tail = strlen(end);
    return length >= tail && strcmp(text + length - tail, end) == 0;
}

static bool is_mesh_name(const char *path)
{
    static const char *const ends[] = {".stl", ".ply", ".obj", ".off", ".glb", ".gltf"};
    for (size_t e = 0; e < sizeof ends / sizeof *ends; ++e) {
        if (ends_with(path, ends[e])) {
            return true;
        }
    }
    return false;
}

static bool read_mesh(const char *path, bool mirror, float *middle, struct atlas_subject *subject)
{
    struct mesh mesh;
    char error[MESH_TEXT];
    if (!mesh_read(path, &mesh, error)) {
        return atlas_fail("%s", error);
    }
    const bool good = atlas_mesh_copy(mesh.positions, (int)mesh.vertex_count, (const int *)(const void *)mesh.indices,
                                      (int)mesh.triangle_count, &subject->mesh);
    mesh_free(&mesh);
    if (good && mirror) {
        float lo = INFINITY, hi = -INFINITY;
        for (int v = 0; v < subject->mesh.vertex_count; ++v) {
            lo = fminf(lo, subject->mesh.positions[3 * v]);
            hi = fmaxf(hi, subject->mesh.positions[3 * v]);
        }
        *middle = 0.5f * (lo + hi);
        mirror_mesh(&subject->mesh, *middle);
    }
    return good;
}

static bool is_file(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISREG(status.st_mode);
}

/* Returns true if every vertex lies in the image, or at most a voxel outside. */
static bool image_covers(const struct volume *image, const struct shape_mesh *mesh)
{
    bool covers = true;
    for (int v = 0; covers && v < mesh->vertex_count; ++v) {
        float index[3];
        volume_world_to_index(image, mesh->positions + 3 * v, index);
        for (int a = 0; a < 3; ++a) {
            covers = covers && index[a] >= -1.0f && index[a] <= (float)image->dims[a];
        }
    }
    return covers;
}

static bool read_image(const char *folder, const char *path, struct atlas_subject *subject)
{
    char image[4096], error[VOLUME_TEXT];
    const char *slash = strrchr(path, '/');
    snprintf(image, sizeof image, "%s/%s", folder, slash ? slash + 1 : path);
    if (is_file(folder)) {
        snprintf(image, sizeof image, "%s", folder);
    }
    if (!volume_read_one(image, -1, NULL, &subject->image, error)) {
        return atlas_fail("%s", error);
    }
    return atlas_image_varies(&subject->image, image)
        && (image_covers(&subject->image, &subject->mesh)
            || atlas_fail("%s: the subject %s lies outside this image", image, subject->name));
}

static bool read_label_map(const char *path, const int *labels, int count, const char *images, bool mirror, float *about,
                           struct atlas_subject *subject)
{
    struct volume all;
    int numbers[ATLAS_MAX_LABELS];
    if (!read_map(path, labels, count, &all, numbers, &subject->label_ids)) {
        volume_free(&all);
        return false;
    }
    const float middle_index[3] = {0.5f * (float)(all.dims[0] - 1), 0.5f * (float)(all.dims[1] - 1),
                                   0.5f * (float)(all.dims[2] - 1)};
    float middle[3];
    volume_index_to_world(&all, middle_index, middle);
    bool good = crop_labels(&all, numbers, count, subject->name, &subject->labels)
             && mask_surface(&subject->labels, subject->name, &subject->mesh)
             && (!images || read_image(images, path, subject));
    volume_free(&all);
    *about = middle[0];
    if (good && mirror) {
        mirror_volume(&subject->labels, middle[0]);
        mirror_mesh(&subject->mesh, middle[0]);
        if (subject->image.data) {
            mirror_volume(&subject->image, middle[0]);
        }
    }
    subject->oriented = true;
    return good;
}

/* Reads the lines x,y,z of FOLDER/NAME.csv for a file .../NAME.anything, and reflects them with their subject. */
static bool read_landmarks(const char *folder, const char *path, bool mirror, float middle, struct atlas_subject *subject)
{
    char name[4096], line[256];
    const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path;
    snprintf(name, sizeof name, "%s/%.*s.csv", folder, (int)strcspn(base, "."), base);
    FILE *file = fopen(name, "r");
    if (!file) {
        return atlas_fail("%s: %s", name, strerror(errno));
    }
    subject->landmarks = malloc(3 * ATLAS_MAX_LANDMARKS * sizeof *subject->landmarks);
    bool good = subject->landmarks != NULL;
    while (good && fgets(line, sizeof line, file)) {
        float *x = subject->landmarks + 3 * subject->landmark_count;
        char rest;
        good = subject->landmark_count < ATLAS_MAX_LANDMARKS && sscanf(line, "%f,%f,%f %c", &x[0], &x[1], &x[2], &rest) == 3
            && isfinite(x[0]) && isfinite(x[1]) && isfinite(x[2]);
        x[0] = mirror ? 2.0f * middle - x[0] : x[0];
        subject->landmark_count += good;
    }
    fclose(file);
    return (good && subject->landmark_count >= 3) || atlas_fail("%s: expected 3 to %d lines x,y,z", name, ATLAS_MAX_LANDMARKS);
}

bool atlas_subject_read(const char *name, const char *images, const char *landmarks, bool mirror, struct atlas_subject *subject)
{
    char path[1024];
    int labels[ATLAS_MAX_LABELS], count = 0;
    float middle = 0.0f; /* of what is mirrored */
    memset(subject, 0, sizeof *subject);
    subject->name = name;
    if (strncmp(name, mirror_prefix, strlen(mirror_prefix)) == 0) {
        name += strlen(mirror_prefix);
        mirror = !mirror;
    }
    const char *colon = strrchr(name, ':');
    const size_t length = colon ? (size_t)(colon - name) : strlen(name);
    if (length >= sizeof path || (colon && (count = atlas_read_labels(colon + 1, labels)) < 0)) {
        return atlas_fail("%s: expected FILE or FILE:LABEL[+LABEL..]", name);
    }
    memcpy(path, name, length);
    path[length] = '\0';
    const bool is_mesh = is_mesh_name(path);
    if (is_mesh && colon) {
        return atlas_fail("%s: a mesh has no labels", name);
    }
    const bool good = is_mesh ? read_mesh(path, mirror, &middle, subject)
                              : read_label_map(path, labels, count, images, mirror, &middle, subject);
    const struct shape_mesh *mesh = &subject->mesh;
    return good && (!landmarks || read_landmarks(landmarks, path, mirror, middle, subject)) &&
           (target_create(mesh->positions, (size_t)mesh->vertex_count, mesh->triangles, (size_t)mesh->triangle_count,
                          &subject->target) ||
            atlas_fail("%s: no triangle has an area, or memory is short", name));
}

void atlas_subject_free(struct atlas_subject *subject)
{
    target_free(&subject->target);
    atlas_mesh_free(&subject->mesh);
    volume_free(&subject->labels);
    volume_free(&subject->image);
    free(subject->label_ids);
    free(subject->landmarks);
    free(subject->shape);
    free(subject->particles);
    memset(subject, 0, sizeof *subject);
}
