#include "surface/gltf_accessor.h"

#include "surface/scene.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { FLOAT = 5126 };

/* What a component is: its bytes, and what stands for 1 where it is normalized. */
static const struct component {
    int code;
    size_t bytes;
    double one;
    bool index; /* it may number vertices */
} components[] = {{5120, 1, 127.0, false},       {5121, 1, 255.0, true}, {5122, 2, 32767.0, false}, {5123, 2, 65535.0, true},
                  {5125, 4, 4294967295.0, true}, {FLOAT, 4, 1.0, false}};

static const struct shape {
    const char *name;
    int width;
} shapes[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};

/* Where elements are, and how they lie. */
struct layout {
    const unsigned char *at;
    size_t stride, count;
    const struct component *component;
    int width;
};

static const struct component *find_component(double code)
{
    for (size_t i = 0; i < sizeof components / sizeof *components; ++i) {
        if (components[i].code == code) {
            return &components[i];
        }
    }
    return NULL;
}

static int find_width(const cJSON *type)
{
    for (size_t i = 0; cJSON_IsString(type) && i < sizeof shapes / sizeof *shapes; ++i) {
        if (strcmp(shapes[i].name, type->valuestring) == 0) {
            return shapes[i].width;
        }
    }
    return 0;
}

/* Returns a component, which lies with its lowest byte first. */
static double read_component(const struct component *component, const unsigned char *at)
{
    uint32_t bits = 0;
    float real;
    for (size_t b = 0; b < component->bytes; ++b) {
        bits |= (uint32_t)at[b] << 8 * b;
    }
    switch (component->code) {
    case 5120: return bits < 0x80u ? (double)bits : (double)bits - 256.0;
    case 5122: return bits < 0x8000u ? (double)bits : (double)bits - 65536.0;
    case FLOAT: memcpy(&real, &bits, sizeof real); return (double)real;
    default: return (double)bits;
    }
}

static void read_element(const struct layout *from, size_t element, double *to)
{
    const unsigned char *at = from->at + element * from->stride;
    for (int i = 0; i < from->width; ++i) {
        to[i] = read_component(from->component, at + (size_t)i * from->component->bytes);
    }
}

/* Finds elements in the view that `object` names; false, with one line, where they do not lie within it. found: whether it names one. */
static bool find_elements(struct gltf_file *file, int accessor, const cJSON *object, struct layout *layout, bool *found)
{
    int view;
    if (!gltf_reference(file, object, "bufferView", GLTF_VIEWS, &view)) {
        return false;
    }
    *found = view >= 0;
    const struct gltf_bytes *bytes = view >= 0 ? gltf_view(file, view) : NULL;
    if (!bytes) {
        return view < 0;
    }
    const size_t size = layout->component->bytes * (size_t)layout->width;
    const double offset = gltf_whole(object, "byteOffset", 0.0);
    layout->stride = bytes->stride ? bytes->stride : size;
    if (offset < 0.0 || layout->stride < size
        || offset + ((double)layout->count - 1.0) * (double)layout->stride + (double)size > (double)bytes->size) {
        return gltf_fail(file, GLTF_ACCESSORS, accessor, "its %zu elements do not lie within buffer view %d of %zu bytes",
                         layout->count, view, bytes->size);
    }
    layout->at = bytes->at + (size_t)offset;
    return true;
}

/* Replaces elements of a sparse accessor. */
static bool read_sparse(struct gltf_file *file, int accessor, const cJSON *sparse, const struct layout *whole, double *to)
{
    const cJSON *indices = gltf_member(sparse, "indices"), *values = gltf_member(sparse, "values");
    const double count = gltf_whole(sparse, "count", -1.0);
    struct layout index = {.component = find_component(gltf_whole(indices, "componentType", -1.0)), .width = 1}, value = *whole;
    bool has_indices = false, has_values = false;
    if (count < 1.0 || count > (double)whole->count || !index.component || !index.component->index) {
        return gltf_fail(file, GLTF_ACCESSORS, accessor, "its sparse part has no number of elements, or no whole indices");
    }
    index.count = value.count = (size_t)count;
    if (!find_elements(file, accessor, indices, &index, &has_indices) || !find_elements(file, accessor, values, &value, &has_values)) {
        return false;
    }
    double before = -1.0;
    for (size_t i = 0; has_indices && has_values && i < index.count; ++i) {
        double element;
        read_element(&index, i, &element);
        if (element <= before) { /* accessor.sparse.indices: strictly increasing */
            return gltf_fail(file, GLTF_ACCESSORS, accessor, "its sparse part names element %.0f after %.0f", element, before);
        }
        before = element;
        if (element >= (double)whole->count) {
            return gltf_fail(file, GLTF_ACCESSORS, accessor, "its sparse part names element %.0f of %zu", element, whole->count);
        }
        read_element(&value, i, to + (size_t)element * (size_t)whole->width);
    }
    return (has_indices && has_values) || gltf_fail(file, GLTF_ACCESSORS, accessor, "its sparse part names no buffer view");
}

/* Makes shares of 1 of integers, 3.6.2.2: the lowest signed one is -1 too. */
static void normalize(const struct component *component, struct gltf_values *values)
{
    const size_t count = component->code == FLOAT ? 0 : values->count * (size_t)values->width;
    for (size_t i = 0; i < count; ++i) {
        values->at[i] = fmax(values->at[i] / component->one, -1.0);
    }
}

/* Reads what an accessor says of its elements. */
static bool read_layout(struct gltf_file *file, int accessor, int least, int most, struct layout *layout)
{
    const cJSON *item = file->items[GLTF_ACCESSORS][accessor], *type = gltf_member(item, "type");
    const double code = gltf_whole(item, "componentType", -1.0), count = gltf_whole(item, "count", -1.0);
    layout->component = find_component(code);
    layout->width = find_width(type);
    if (!layout->component) {
        return gltf_fail(file, GLTF_ACCESSORS, accessor, "componentType %.0f is none of glTF's", code);
    }
    if (layout->width < least || layout->width > most) {
        return gltf_fail(file, GLTF_ACCESSORS, accessor, "type %.20s is not what it is used for",
                         cJSON_IsString(type) ? type->valuestring : "?");
    }
    if (count < 1.0 || count > INT32_MAX / 16) {
        return gltf_fail(file, GLTF_ACCESSORS, accessor, "its count is no whole number above 0, or too large");
    }
    layout->count = (size_t)count;
    return true;
}

static bool is_normalized(const struct gltf_file *file, int accessor)
{
    return cJSON_IsTrue(gltf_member(file->items[GLTF_ACCESSORS][accessor], "normalized"));
}

/* Allocates values, all 0. */
static bool make_values(struct gltf_file *file, size_t count, int width, struct gltf_values *values)
{
    values->count = count;
    values->width = width;
    values->at = calloc(count * (size_t)width, sizeof *values->at);
    return values->at || scene_fail(file->error, file->path, "not enough memory");
}

/* Elements without a view are 0, so that their number is no matter of the file's size: it may not reserve all memory. */
bool gltf_read_accessor(struct gltf_file *file, int accessor, int least, int most, struct gltf_values *values)
{
    enum { FEW = 1 << 16 };
    struct layout layout = {0};
    bool found = false;
    values->at = NULL;
    if (!read_layout(file, accessor, least, most, &layout)
        || !find_elements(file, accessor, file->items[GLTF_ACCESSORS][accessor], &layout, &found)) {
        return false;
    }
    if (!found && layout.count > FEW && layout.count > file->size) {
        return gltf_fail(file, GLTF_ACCESSORS, accessor, "it promises %zu elements without bytes for them", layout.count);
    }
    if (!make_values(file, layout.count, layout.width, values)) {
        return false;
    }
    for (size_t e = 0; found && e < layout.count; ++e) {
        read_element(&layout, e, values->at + e * (size_t)layout.width);
    }
    const cJSON *sparse = gltf_member(file->items[GLTF_ACCESSORS][accessor], "sparse");
    if (sparse && !read_sparse(file, accessor, sparse, &layout, values->at)) {
        free(values->at);
        values->at = NULL;
        return false;
    }
    if (is_normalized(file, accessor)) {
        normalize(layout.component, values);
    }
    return true;
}

/* Copies an attribute out of a Draco mesh; the accessor has its type. */
static bool read_draco(struct gltf_file *file, int accessor, int least, int most, const struct gltf_draco *draco, unsigned id,
                       struct gltf_values *values)
{
    struct layout layout = {0};
    if (!read_layout(file, accessor, least, most, &layout)) {
        return false;
    }
    if (gltf_draco_width(draco, id) != layout.width || gltf_draco_vertices(draco) != layout.count) {
        return gltf_fail(file, GLTF_ACCESSORS, accessor, "KHR_draco_mesh_compression has %zu elements of %d numbers for it",
                         gltf_draco_vertices(draco), gltf_draco_width(draco, id));
    }
    if (!make_values(file, layout.count, layout.width, values)) {
        return false;
    }
    if (!gltf_draco_values(draco, id, values->at)) {
        free(values->at);
        values->at = NULL;
        return gltf_fail(file, GLTF_ACCESSORS, accessor, "its KHR_draco_mesh_compression cannot be decoded");
    }
    if (is_normalized(file, accessor)) {
        normalize(layout.component, values);
    }
    return true;
}

bool gltf_read_attribute(struct gltf_file *file, const cJSON *attributes, const char *name, int least, int most,
                         const struct gltf_draco *draco, const cJSON *ids, struct gltf_values *values)
{
    int accessor;
    memset(values, 0, sizeof *values);
    if (!gltf_reference(file, attributes, name, GLTF_ACCESSORS, &accessor)) {
        return false;
    }
    if (accessor < 0) {
        return true;
    }
    const double id = draco ? gltf_whole(ids, name, -1.0) : -1.0;
    return id >= 0.0 && id < 4294967296.0 ? read_draco(file, accessor, least, most, draco, (unsigned)id, values)
                                          : gltf_read_accessor(file, accessor, least, most, values);
}
