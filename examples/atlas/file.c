/* file.c - an atlas on disk: atlas.json describes it, atlas.raw holds the numbers (docs/atlas.md).
 *
 * The raw file is a sequence of arrays of 4-byte little-endian words, float32 or int32, in the order and with the lengths that
 * the header lists, and nothing else. */
#define _POSIX_C_SOURCE 200809L

#include "atlas/atlas.h"

#include "base/json.h"
#include "base/write_error.h"
#include "springls/run_options.h"

#include <cjson/cJSON.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char format_name[] = "springls atlas";
enum { FORMAT_VERSION = 2, MAX_VERTICES = 50000000 };

/* One array of the raw file. */
struct raw_array {
    char name[32];
    bool is_float;
    size_t count;
    void *data;
};

enum { SHAPE_ARRAYS = 6, TEMPLATE_ARRAYS = 6, MAX_ARRAYS = SHAPE_ARRAYS + TEMPLATE_ARRAYS * FUSION_MAX_TEMPLATES };

static const char *word_type(const struct raw_array *array) { return array->is_float ? "float32" : "int32"; }

/* Lists what the file holds of a template. Returns how many arrays. */
static int list_template(const struct atlas *atlas, int t, struct raw_array *arrays)
{
    static const char *const names[TEMPLATE_ARRAYS] = {"image", "images", "masks", "places", "correction", "labels"};
    const struct fusion_template *template = &atlas->templates[t];
    const size_t voxels = volume_voxels(&template->image), subjects = (size_t)template->count,
                 counts[TEMPLATE_ARRAYS] = {voxels, subjects * voxels, subjects * voxels,
                                            3 * (size_t)template->vertices,
                                            template->corrected ? (size_t)fusion_terms : 0, subjects * voxels};
    void *const data[TEMPLATE_ARRAYS] = {template->image.data, template->images, template->masks, template->places,
                                         template->correction, template->labels};
    const int count = template->label_count > 0 ? TEMPLATE_ARRAYS : TEMPLATE_ARRAYS - 1;
    for (int a = 0; a < count; ++a) {
        snprintf(arrays[a].name, sizeof arrays[a].name, "template%d_%s", t, names[a]);
        arrays[a].is_float = a < TEMPLATE_ARRAYS - 1; /* labels are not */
        arrays[a].count = counts[a];
        arrays[a].data = data[a];
    }
    return count;
}

static int shape_arrays(const struct atlas *atlas) { return atlas->samples > 0 ? SHAPE_ARRAYS : SHAPE_ARRAYS - 2; }

static int list_arrays(const struct atlas *atlas, struct raw_array *arrays)
{
    const size_t points = 3 * (size_t)atlas->mean.vertex_count,
                 samples = (size_t)atlas->mean.vertex_count * (size_t)atlas->samples;
    const struct raw_array all[SHAPE_ARRAYS] = {
        {"mean", true, points, atlas->mean.positions},
        {"triangles", false, 3 * (size_t)atlas->mean.triangle_count, atlas->mean.triangles},
        {"regions", false, (size_t)atlas->mean.vertex_count, atlas->regions},
        {"modes", true, points * (size_t)atlas->model.modes, atlas->model.mode},
        {"profiles", true, samples, atlas->profiles},
        {"spreads", true, samples, atlas->spreads},
    };
    memcpy(arrays, all, sizeof all);
    int count = shape_arrays(atlas);
    for (int t = 0; t < atlas->template_count; ++t) {
        count += list_template(atlas, t, arrays + count);
    }
    return count;
}

static void swap_words(unsigned char *words, size_t count)
{
    const uint32_t one = 1;
    unsigned char first;
    memcpy(&first, &one, 1);
    for (size_t i = 0; first == 0 && i < count; ++i) { /* this machine is big-endian */
        unsigned char *w = words + 4 * i, a = w[0], b = w[1];
        w[0] = w[3];
        w[1] = w[2];
        w[2] = b;
        w[3] = a;
    }
}

/* ---- out ---- */

static bool write_raw(const char *path, const struct raw_array *arrays, int count)
{
    FILE *file = fopen(path, "wb");
    bool good = file != NULL;
    for (int p = 0; good && p < count; ++p) {
        if (arrays[p].count == 0) {
            continue;
        }
        unsigned char *words = malloc(4 * arrays[p].count + 1);
        good = words != NULL;
        if (good) {
            memcpy(words, arrays[p].data, 4 * arrays[p].count);
            swap_words(words, arrays[p].count);
            good = fwrite(words, 4, arrays[p].count, file) == arrays[p].count;
        }
        free(words);
    }
    good = file && fclose(file) == 0 && good;
    if (file && !good) { partial_file_remove(path); }
    return good || cli_write_failed("atlas", path);
}

static void write_template(struct json_writer *json, const struct fusion_template *template)
{
    const double dims[3] = {template->image.dims[0], template->image.dims[1], template->image.dims[2]};
    json_object_begin(json, NULL);
    json_integer(json, "subject", template->self);
    json_numbers(json, "dims", dims, 3);
    json_numbers(json, "affine_mm", &template->image.affine[0][0], 12);
    json_number(json, "level", (double)template->level);
    json_bool(json, "corrected", template->corrected);
    json_object_end(json);
}

bool atlas_write(const char *folder, const struct atlas *atlas)
{
    char header[1024], raw[1024];
    struct raw_array arrays[MAX_ARRAYS];
    struct json_writer json;
    const int count = list_arrays(atlas, arrays);
    run_path(folder, "atlas.json", header, sizeof header);
    run_path(folder, "atlas.raw", raw, sizeof raw);
    if (!write_raw(raw, arrays, count)) {
        return false;
    }
    if (!json_open(&json, header)) {
        return cli_write_failed("atlas", header);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "format", format_name);
    json_integer(&json, "version", FORMAT_VERSION);
    json_string(&json, "raw", "atlas.raw");
    json_string(&json, "byte_order", "little");
    json_string(&json, "unit", "mm");
    json_bool(&json, "patient_axes", atlas->oriented);
    json_integer(&json, "subjects", atlas->subjects);
    json_number(&json, "voxel_mm", atlas->voxel);
    json_number(&json, "generalisation_mm", atlas->generalization);
    json_integer(&json, "vertices", atlas->mean.vertex_count);
    json_integer(&json, "triangles", atlas->mean.triangle_count);
    json_integer(&json, "modes", atlas->model.modes);
    json_numbers(&json, "deviations_mm", atlas->model.deviation, (size_t)atlas->model.modes);
    json_integer(&json, "profile_samples", atlas->samples);
    json_number(&json, "profile_spacing_mm", atlas->spacing);
    json_array_begin(&json, "templates");
    for (int t = 0; t < atlas->template_count; ++t) {
        write_template(&json, &atlas->templates[t]);
    }
    json_array_end(&json);
    json_array_begin(&json, "labels");
    for (int l = 0; atlas->template_count > 0 && l < atlas->templates[0].label_count; ++l) {
        json_integer(&json, NULL, (int64_t)atlas->label_ids[l]);
    }
    json_array_end(&json);
    json_array_begin(&json, "arrays");
    for (int p = 0; p < count; ++p) {
        json_object_begin(&json, NULL);
        json_string(&json, "name", arrays[p].name);
        json_string(&json, "type", word_type(&arrays[p]));
        json_integer(&json, "count", (int64_t)arrays[p].count);
        json_object_end(&json);
    }
    json_array_end(&json);
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("atlas", header);
}

/* ---- in ---- */

static bool real(const cJSON *header, const char *key, double minimum, double maximum, double *value)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(header, key);
    *value = cJSON_IsNumber(item) ? item->valuedouble : (double)NAN;
    return *value >= minimum && *value <= maximum;
}

static bool whole(const cJSON *header, const char *key, int minimum, int maximum, int *value)
{
    double number;
    const bool good = real(header, key, (double)minimum, (double)maximum, &number) && number == floor(number);
    *value = good ? (int)number : 0;
    return good;
}

/* Reads sizes and scalars. Returns NULL, or what is wrong. */
static const char *read_scalars(const cJSON *header, struct atlas *atlas)
{
    const cJSON *deviations = cJSON_GetObjectItemCaseSensitive(header, "deviations_mm");
    const char *format = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(header, "format"));
    int version = 0;
    if (!format || strcmp(format, format_name) != 0) {
        return "not an atlas: \"format\"";
    }
    if (!whole(header, "version", FORMAT_VERSION, FORMAT_VERSION, &version)) {
        return "another version of the format";
    }
    if (!whole(header, "vertices", 3, MAX_VERTICES, &atlas->mean.vertex_count) ||
        !whole(header, "triangles", 1, MAX_VERTICES, &atlas->mean.triangle_count) ||
        !whole(header, "modes", 0, ATLAS_MAX_MODES, &atlas->model.modes) ||
        !whole(header, "profile_samples", 0, 1000, &atlas->samples) ||
        !whole(header, "subjects", 1, 1 << 30, &atlas->subjects) || !real(header, "voxel_mm", 0.0, 1e9, &atlas->voxel) ||
        !real(header, "generalisation_mm", 0.0, 1e9, &atlas->generalization) ||
        !real(header, "profile_spacing_mm", 0.0, 1e9, &atlas->spacing)) {
        return "a size is missing or out of range";
    }
    atlas->oriented = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(header, "patient_axes"));
    if (!cJSON_IsArray(deviations) || cJSON_GetArraySize(deviations) != atlas->model.modes) {
        return "\"deviations_mm\" has another length than \"modes\"";
    }
    atlas->model.deviation = calloc((size_t)atlas->model.modes + 1, sizeof *atlas->model.deviation);
    if (!atlas->model.deviation) {
        return "not enough memory";
    }
    for (int m = 0; m < atlas->model.modes; ++m) {
        const cJSON *item = cJSON_GetArrayItem(deviations, m);
        atlas->model.deviation[m] = cJSON_IsNumber(item) ? item->valuedouble : 0.0;
        if (!(atlas->model.deviation[m] > 0.0 && atlas->model.deviation[m] < 1e9)) {
            return "a deviation is not positive";
        }
    }
    return NULL;
}

static bool read_numbers(const cJSON *item, const char *key, int count, double *numbers)
{
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(item, key);
    bool good = cJSON_IsArray(list) && cJSON_GetArraySize(list) == count;
    for (int i = 0; good && i < count; ++i) {
        const cJSON *number = cJSON_GetArrayItem(list, i);
        numbers[i] = cJSON_IsNumber(number) ? number->valuedouble : (double)NAN;
        good = fabs(numbers[i]) < 1e9;
    }
    return good;
}

/* Reads a template's grid. Returns false if something is missing or out of range. */
static bool read_template(const cJSON *item, const struct atlas *atlas, struct fusion_template *template)
{
    struct volume *image = &template->image;
    double dims[3], affine[12], level;
    if (!read_numbers(item, "dims", 3, dims) || !read_numbers(item, "affine_mm", 12, affine)
        || !real(item, "level", 0.0, 1.0, &level) || !whole(item, "subject", 0, atlas->subjects - 1, &template->self)) {
        return false;
    }
    for (int a = 0; a < 3; ++a) {
        if (!(dims[a] >= 1.0 && dims[a] <= 2048.0)) {
            return false;
        }
        image->dims[a] = (int)dims[a];
        image->origin[a] = (float)affine[4 * a + 3];
        image->spacing[a] = (float)sqrt(affine[a] * affine[a] + affine[4 + a] * affine[4 + a] + affine[8 + a] * affine[8 + a]);
        if (!(image->spacing[a] > 0.0f)) {
            return false;
        }
        for (int r = 0; r < 3; ++r) {
            image->affine[r][a] = affine[4 * r + a];
            image->direction[r][a] = (float)affine[4 * r + a] / image->spacing[a];
        }
        image->affine[a][3] = affine[4 * a + 3];
    }
    image->affine[3][3] = 1.0;
    template->count = atlas->subjects;
    template->vertices = atlas->mean.vertex_count;
    template->level = (float)level;
    template->corrected = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(item, "corrected"));
    return true;
}

/* Reads the list of labels, which files of before do not have. Returns how many, -1: wrong. */
static int read_labels(const cJSON *header, struct atlas *atlas)
{
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(header, "labels");
    const int count = cJSON_IsArray(list) ? cJSON_GetArraySize(list) : 0;
    for (int l = 0; l < count; ++l) {
        const cJSON *item = l < FUSION_MAX_LABELS ? cJSON_GetArrayItem(list, l) : NULL;
        const double id = cJSON_IsNumber(item) ? item->valuedouble : 0.0;
        if (!(id >= 1.0 && id <= 4294967295.0 && id == floor(id))) {
            return -1;
        }
        atlas->label_ids[l] = (uint32_t)id;
    }
    return count;
}

/* Reads the list of templates, which files of before do not have. */
static const char *read_templates(const cJSON *header, struct atlas *atlas)
{
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(header, "templates");
    const int count = cJSON_IsArray(list) ? cJSON_GetArraySize(list) : 0, labels = read_labels(header, atlas);
    if (labels < 0) {
        return "\"labels\" is not a short list of whole numbers";
    }
    if (count > FUSION_MAX_TEMPLATES || (count > 0 && atlas->subjects > ATLAS_MAX_SUBJECTS)) {
        return "too many templates";
    }
    for (int t = 0; t < count; ++t) {
        if (!read_template(cJSON_GetArrayItem(list, t), atlas, &atlas->templates[t])) {
            return "a template's grid is missing or out of range";
        }
        atlas->templates[t].label_count = labels;
        atlas->template_count = t + 1;
    }
    return NULL;
}

/* Compares the list of arrays with what the sizes give. */
static const char *check_arrays(const cJSON *header, const struct atlas *atlas)
{
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(header, "arrays");
    struct raw_array arrays[MAX_ARRAYS];
    const int count = list_arrays(atlas, arrays);
    bool good = cJSON_IsArray(list) && cJSON_GetArraySize(list) == count;
    for (int p = 0; good && p < count; ++p) {
        const cJSON *item = cJSON_GetArrayItem(list, p);
        const char *name = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, "name"));
        const char *type = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, "type"));
        const double words = (double)arrays[p].count;
        double number;
        good = name && strcmp(name, arrays[p].name) == 0 && type && strcmp(type, word_type(&arrays[p])) == 0
            && real(item, "count", words, words, &number);
    }
    return good ? NULL : "\"arrays\" does not fit the sizes";
}

static const char *check_values(const struct raw_array *array, int vertices, int labels)
{
    const bool numbers = strstr(array->name, "_labels") != NULL;
    for (size_t i = 0; i < array->count; ++i) {
        if (array->is_float && !isfinite(((const float *)array->data)[i])) {
            return "a number is not finite";
        }
        const int value = array->is_float ? 0 : ((const int *)array->data)[i];
        if (strcmp(array->name, "triangles") == 0 && (value < 0 || value >= vertices)) {
            return "a triangle has a vertex that is not there";
        }
        if (numbers && (value < 0 || value > labels)) {
            return "a label is not in the list";
        }
    }
    return NULL;
}

static void set_range(struct volume *image)
{
    image->minimum = INFINITY;
    image->maximum = -INFINITY;
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        image->minimum = fminf(image->minimum, image->data[n]);
        image->maximum = fmaxf(image->maximum, image->data[n]);
    }
}

/* Reads the raw file after comparing its size with the header's sizes. Returns NULL, or what is wrong. */
static const char *read_raw(FILE *file, struct atlas *atlas)
{
    struct raw_array arrays[MAX_ARRAYS];
    const int count = list_arrays(atlas, arrays);
    void **places[MAX_ARRAYS] = {(void **)&atlas->mean.positions, (void **)&atlas->mean.triangles, (void **)&atlas->regions,
                                 (void **)&atlas->model.mode, (void **)&atlas->profiles, (void **)&atlas->spreads};
    size_t words = 0;
    for (int t = 0, p = shape_arrays(atlas); t < atlas->template_count; ++t) {
        struct fusion_template *template = &atlas->templates[t];
        places[p++] = (void **)&template->image.data;
        places[p++] = (void **)&template->images;
        places[p++] = (void **)&template->masks;
        places[p++] = (void **)&template->places;
        places[p++] = (void **)&template->correction;
        if (template->label_count > 0) {
            places[p++] = (void **)&template->labels;
        }
    }
    for (int p = 0; p < count; ++p) {
        words += arrays[p].count;
    }
    if (fseek(file, 0, SEEK_END) != 0 || ftell(file) != (long)(4 * words) || fseek(file, 0, SEEK_SET) != 0) {
        return "its size is not that of its header";
    }
    for (int p = 0; p < count; ++p) {
        arrays[p].data = *places[p] = malloc(4 * arrays[p].count + 4);
        if (!arrays[p].data) {
            return "not enough memory";
        }
        if (fread(arrays[p].data, 4, arrays[p].count, file) != arrays[p].count) {
            return "cannot be read";
        }
        swap_words(arrays[p].data, arrays[p].count);
        const char *wrong = check_values(&arrays[p], atlas->mean.vertex_count, atlas->templates[0].label_count);
        if (wrong) {
            return wrong;
        }
    }
    for (int t = 0; t < atlas->template_count; ++t) {
        set_range(&atlas->templates[t].image);
        if (!atlas->templates[t].corrected) {
            free(atlas->templates[t].correction);
            atlas->templates[t].correction = NULL;
        }
        if (!fusion_prepare(&atlas->templates[t])) {
            return "not enough memory";
        }
    }
    return NULL;
}

/* Reads a whole short text file into memory from malloc. Returns NULL if it is long or cannot be read. */
static char *read_text(const char *path)
{
    enum { MAX_BYTES = 1 << 20 };
    FILE *file = fopen(path, "rb");
    char *text = malloc(MAX_BYTES);
    const size_t length = file && text ? fread(text, 1, MAX_BYTES, file) : 0;
    if (file) {
        fclose(file);
    }
    if (length == 0 || length == MAX_BYTES) {
        free(text);
        return NULL;
    }
    text[length] = '\0';
    return text;
}

/* Reads the header. raw: receives the path of the raw file beside it. Returns NULL, or what is wrong. */
static const char *read_header(const char *path, struct atlas *atlas, char *raw, size_t size)
{
    char *text = read_text(path);
    const char *slash = strrchr(path, '/');
    cJSON *header = text ? cJSON_Parse(text) : NULL;
    const char *wrong = !text ? "cannot be read" : !header ? "not a JSON file" : read_scalars(header, atlas);
    wrong = wrong ? wrong : read_templates(header, atlas);
    wrong = wrong ? wrong : check_arrays(header, atlas);
    const char *name = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(header, "raw"));
    if (!wrong && (!name || strchr(name, '/'))) {
        wrong = "\"raw\" is not the name of a file beside it";
    }
    snprintf(raw, size, "%.*s%s", slash ? (int)(slash - path + 1) : 0, path, name ? name : "");
    cJSON_Delete(header);
    free(text);
    return wrong;
}

bool atlas_read(const char *path, struct atlas *atlas)
{
    char raw[1024];
    memset(atlas, 0, sizeof *atlas);
    const char *wrong = read_header(path, atlas, raw, sizeof raw);
    if (wrong) {
        atlas_free(atlas);
        return atlas_fail("%s: %s", path, wrong);
    }
    FILE *file = fopen(raw, "rb");
    wrong = file ? read_raw(file, atlas) : "cannot be read";
    if (file) {
        fclose(file);
    }
    if (wrong) {
        atlas_free(atlas);
        return atlas_fail("%s: %s", raw, wrong);
    }
    atlas->model.vertices = (size_t)atlas->mean.vertex_count;
    atlas->model.mean = atlas->mean.positions;
    return true;
}

void atlas_free(struct atlas *atlas)
{
    if (atlas->model.mean == atlas->mean.positions) { /* points to mean.positions */
        atlas->model.mean = NULL;
    }
    shape_model_free(&atlas->model);
    atlas_mesh_free(&atlas->mean);
    free(atlas->regions);
    free(atlas->profiles);
    free(atlas->spreads);
    for (int t = 0; t < FUSION_MAX_TEMPLATES; ++t) {
        fusion_template_free(&atlas->templates[t]);
    }
    memset(atlas, 0, sizeof *atlas);
}

bool atlas_read_without(const char *path, struct atlas_stage *without)
{
    char *text = read_text(path);
    cJSON *report = text ? cJSON_Parse(text) : NULL;
    const cJSON *compared = cJSON_GetObjectItemCaseSensitive(report, "against_reference");
    const char *program = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(report, "program"));
    const bool good = program && strcmp(program, "segment") == 0 && real(report, "seconds", 0.0, 1e9, &without->seconds);
    without->name = "without atlas";
    without->compared = good && real(compared, "dice", 0.0, 1.0, &without->dice)
                     && real(compared, "mean_distance_mm", 0.0, 1e9, &without->mean_distance)
                     && real(compared, "hd95_mm", 0.0, 1e9, &without->hd95);
    cJSON_Delete(report);
    free(text);
    return good || atlas_fail("%s: not a report of segment on one object", path);
}
