#include "surface/mesh_local.h"

#include "surface/scene.h"
#include "surface/scene_files.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PROPERTIES = 64 };

/* A file as it is taken apart. What cannot be read is left to mesh_read, which names what is wrong. */
struct local {
    const unsigned char *at, *end;
    double *places; /* 3 a vertex */
    float *colors;  /* 3 a vertex; NULL: none */
    uint32_t *indices;
    size_t vertex_count, triangle_count, vertex_room, triangle_room;
};

static bool room_for(void **array, size_t *room, size_t count, size_t bytes)
{
    if (count <= *room) {
        return true;
    }
    void *grown = realloc(*array, 2 * count * bytes);
    if (grown) {
        *array = grown;
        *room = 2 * count;
    }
    return grown != NULL;
}

/* Adds a face of any number of corners as a fan. */
static bool add_face(struct local *f, const uint32_t *corners, size_t count)
{
    for (size_t k = 2; k < count; ++k) {
        if (!room_for((void **)&f->indices, &f->triangle_room, f->triangle_count + 1, 3 * sizeof *f->indices)) {
            return false;
        }
        const uint32_t triangle[3] = {corners[0], corners[k - 1], corners[k]};
        memcpy(f->indices + 3 * f->triangle_count++, triangle, sizeof triangle);
    }
    return true;
}

/* Copies the next line, without its end. Returns false at the end of the file, or where it does not fit. */
static bool next_line(struct local *f, char *line, size_t size)
{
    size_t n = 0;
    if (f->at >= f->end) {
        return false;
    }
    for (; f->at < f->end && *f->at != '\n'; ++f->at) {
        if (n + 1 >= size) {
            return false;
        }
        line[n++] = (char)*f->at;
    }
    f->at += f->at < f->end;
    line[n] = '\0';
    return true;
}

/* ---- OBJ ---- */

static bool obj_vertex(struct local *f, const char *text)
{
    char *end = (char *)(uintptr_t)text;
    if (!room_for((void **)&f->places, &f->vertex_room, f->vertex_count + 1, 3 * sizeof *f->places)) {
        return false;
    }
    for (size_t k = 0; k < 3; ++k) {
        const char *from = end;
        f->places[3 * f->vertex_count + k] = strtod(from, &end);
        if (end == from) {
            return false;
        }
    }
    ++f->vertex_count;
    return true;
}

static bool obj_face(struct local *f, const char *text)
{
    uint32_t corners[256];
    size_t count = 0;
    for (const char *at = text + strspn(text, " \t\r"); *at; at += strspn(at, " \t\r")) {
        char *end;
        const long number = strtol(at, &end, 10), index = number < 0 ? (long)f->vertex_count + number : number - 1;
        if (end == at || index < 0 || index >= (long)f->vertex_count || count == 256) {
            return false;
        }
        corners[count++] = (uint32_t)index;
        at += strcspn(at, " \t\r");
    }
    return add_face(f, corners, count);
}

static bool read_obj(struct local *f)
{
    char line[4096];
    bool good = true;
    while (good && f->at < f->end) {
        good = next_line(f, line, sizeof line);
        if (good && line[0] == 'v' && (line[1] == ' ' || line[1] == '\t')) {
            good = obj_vertex(f, line + 1);
        } else if (good && line[0] == 'f' && (line[1] == ' ' || line[1] == '\t')) {
            good = obj_face(f, line + 1);
        }
    }
    return good;
}

/* ---- PLY ---- */

enum ply_type { PLY_NONE, PLY_CHAR, PLY_UCHAR, PLY_SHORT, PLY_USHORT, PLY_INT, PLY_UINT, PLY_FLOAT, PLY_DOUBLE };

struct ply_property {
    enum ply_type type, count; /* count: PLY_NONE, or that of a list's length */
    char name[32];
};

struct ply_element {
    char name[32];
    size_t count;
    struct ply_property properties[MOST_PROPERTIES];
    int property_count;
};

struct ply {
    struct local *file;
    bool text, swapped;
    struct ply_element elements[8];
    int element_count;
};

static enum ply_type ply_type_of(const char *name)
{
    static const char *const names[2][9] = {{"", "char", "uchar", "short", "ushort", "int", "uint", "float", "double"},
                                            {"", "int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"}};
    for (int i = 1; i < 9; ++i) {
        if (strcmp(name, names[0][i]) == 0 || strcmp(name, names[1][i]) == 0) {
            return (enum ply_type)i;
        }
    }
    return PLY_NONE;
}

static bool ply_property_line(struct ply *ply, const char *line)
{
    char a[16], b[16], name[32] = "";
    struct ply_element *e = ply->element_count ? &ply->elements[ply->element_count - 1] : NULL;
    if (!e || e->property_count == MOST_PROPERTIES) {
        return false;
    }
    struct ply_property *p = &e->properties[e->property_count++];
    memset(p, 0, sizeof *p);
    if (sscanf(line, "property list %15s %15s %31s", a, b, name) == 3) {
        p->count = ply_type_of(a);
        p->type = p->count != PLY_NONE ? ply_type_of(b) : PLY_NONE;
    } else if (sscanf(line, "property %15s %31s", b, name) == 2) {
        p->type = ply_type_of(b);
    }
    memcpy(p->name, name, sizeof p->name);
    return p->type != PLY_NONE;
}

static bool ply_header(struct ply *ply)
{
    const uint16_t one = 1;
    const bool little = *(const unsigned char *)&one == 1;
    char line[512], format[32];
    unsigned long long count;
    bool good = next_line(ply->file, line, sizeof line) && strncmp(line, "ply", 3) == 0;
    while (good && next_line(ply->file, line, sizeof line)) {
        struct ply_element *e = &ply->elements[ply->element_count];
        if (strncmp(line, "end_header", 10) == 0) {
            return true;
        }
        if (sscanf(line, "format %31s", format) == 1) {
            ply->text = strcmp(format, "ascii") == 0;
            ply->swapped = strcmp(format, little ? "binary_big_endian" : "binary_little_endian") == 0;
        } else if (ply->element_count < 8 && sscanf(line, "element %31s %llu", e->name, &count) == 2) {
            e->count = (size_t)count;
            ++ply->element_count;
        } else if (strncmp(line, "property", 8) == 0) {
            good = ply_property_line(ply, line);
        } else {
            good = strncmp(line, "comment", 7) == 0 || strncmp(line, "obj_info", 8) == 0;
        }
    }
    return false;
}

static double ply_value_of(const unsigned char bytes[8], enum ply_type type)
{
    switch (type) {
    case PLY_CHAR: return (double)(signed char)bytes[0];
    case PLY_UCHAR: return (double)bytes[0];
#define CASE(name, c_type) \
    case name: { \
        c_type value; \
        memcpy(&value, bytes, sizeof value); \
        return (double)value; \
    }
        CASE(PLY_SHORT, int16_t)
        CASE(PLY_USHORT, uint16_t)
        CASE(PLY_INT, int32_t)
        CASE(PLY_UINT, uint32_t)
        CASE(PLY_FLOAT, float)
        CASE(PLY_DOUBLE, double)
#undef CASE
    case PLY_NONE: break;
    }
    return 0.0;
}

static bool ply_number(struct ply *ply, enum ply_type type, double *value)
{
    static const size_t sizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
    struct local *f = ply->file;
    unsigned char bytes[8];
    if (ply->text) {
        char *end; /* the file ends with a zero */
        *value = strtod((const char *)f->at, &end);
        const bool any = (const unsigned char *)end > f->at;
        f->at = (const unsigned char *)end;
        return any && f->at <= f->end;
    }
    if ((size_t)(f->end - f->at) < sizes[type]) {
        return false;
    }
    for (size_t i = 0; i < sizes[type]; ++i) {
        bytes[ply->swapped ? sizes[type] - 1 - i : i] = *f->at++;
    }
    *value = ply_value_of(bytes, type);
    return true;
}

/* Stores a number of a vertex where it is a place or a color. */
static void ply_take(struct local *f, const struct ply_property *p, double value)
{
    static const char *const places[3] = {"x", "y", "z"}, *const colors[3] = {"red", "green", "blue"};
    for (size_t k = 0; k < 3; ++k) {
        if (strcmp(p->name, places[k]) == 0) {
            f->places[3 * f->vertex_count + k] = value;
        } else if (strcmp(p->name, colors[k]) == 0 && f->colors) {
            f->colors[3 * f->vertex_count + k] = (float)(p->type == PLY_UCHAR        ? value / 255.0
                                                             : p->type == PLY_USHORT ? value / 65535.0
                                                                                     : value);
        }
    }
}

static bool ply_list(struct ply *ply, const struct ply_property *p, bool faces)
{
    uint32_t corners[256];
    double count, value = 0.0;
    bool good = ply_number(ply, p->count, &count) && count >= 0.0 && count <= 256.0;
    for (int i = 0; good && i < (int)count; ++i) {
        good = ply_number(ply, p->type, &value) && value >= 0.0 && (!faces || value < (double)ply->file->vertex_count);
        corners[i] = good && faces ? (uint32_t)value : 0;
    }
    return good && (!faces || add_face(ply->file, corners, (size_t)count));
}

static bool ply_row(struct ply *ply, const struct ply_element *e)
{
    const bool vertex = strcmp(e->name, "vertex") == 0, face = strcmp(e->name, "face") == 0;
    bool good = true;
    for (int i = 0; good && i < e->property_count; ++i) {
        const struct ply_property *p = &e->properties[i];
        double value;
        if (p->count != PLY_NONE) {
            good = ply_list(ply, p, face && strncmp(p->name, "vertex_ind", 10) == 0);
        } else if ((good = ply_number(ply, p->type, &value)) && vertex) {
            ply_take(ply->file, p, value);
        }
    }
    ply->file->vertex_count += vertex;
    return good;
}

static bool ply_has(const struct ply_element *e, const char *name)
{
    bool any = false;
    for (int i = 0; i < e->property_count; ++i) {
        any = any || strcmp(e->properties[i].name, name) == 0;
    }
    return any;
}

static bool read_ply(struct local *f)
{
    struct ply ply = {.file = f};
    bool good = ply_header(&ply);
    for (int e = 0; good && e < ply.element_count; ++e) {
        const struct ply_element *element = &ply.elements[e];
        if (strcmp(element->name, "vertex") == 0) {
            good = element->count <= (size_t)(f->end - f->at) && !f->places; /* each takes a byte or more */
            if (good) {
                f->places = calloc(element->count + 1, 3 * sizeof *f->places);
                f->colors = ply_has(element, "red") ? calloc(element->count + 1, 3 * sizeof *f->colors) : NULL;
                good = f->places != NULL;
            }
        }
        for (size_t i = 0; good && i < element->count; ++i) {
            good = ply_row(&ply, element);
        }
    }
    return good;
}

/* ---- all ---- */

/* Finds whether floats resolve a mesh's places badly, and an origin of whole numbers in its middle. */
static bool is_distant(const struct local *f, double origin[3])
{
    const double least = 512.0; /* sizes: a hundredth of a voxel of 128 along the mesh */
    double size = 0.0, furthest = 0.0;
    for (size_t k = 0; k < 3; ++k) {
        double lower = DBL_MAX, upper = -DBL_MAX;
        for (size_t i = 0; i < 3 * f->triangle_count; ++i) {
            const double x = f->places[3 * (size_t)f->indices[i] + k];
            lower = fmin(lower, x);
            upper = fmax(upper, x);
            furthest = isfinite(x) ? fmax(furthest, fabs(x)) : INFINITY;
        }
        size = fmax(size, upper - lower);
        origin[k] = floor(0.5 * lower + 0.5 * upper);
    }
    return size > 0.0 && furthest < 1e15 && furthest > least * size;
}

static const double *sort_places; /* of compare_places */

static int compare_places(const void *a, const void *b)
{
    const uint32_t i = *(const uint32_t *)a, j = *(const uint32_t *)b;
    const double *x = sort_places + 3 * (size_t)i, *y = sort_places + 3 * (size_t)j;
    for (int k = 0; k < 3; ++k) {
        if (x[k] != y[k]) {
            return x[k] < y[k] ? -1 : 1;
        }
    }
    return i < j ? -1 : i > j;
}

/* Joins vertices at the same place: writes the first of them for each. */
static bool join(const struct local *f, uint32_t *first)
{
    uint32_t *order = malloc((f->vertex_count + 1) * sizeof *order);
    if (!order) {
        return false;
    }
    for (size_t v = 0; v < f->vertex_count; ++v) {
        order[v] = (uint32_t)v;
    }
    sort_places = f->places;
    qsort(order, f->vertex_count, sizeof *order, compare_places);
    for (size_t i = 0; i < f->vertex_count; ++i) {
        const bool same =
            i > 0 && memcmp(f->places + 3 * (size_t)order[i], f->places + 3 * (size_t)order[i - 1], 3 * sizeof *f->places) == 0;
        first[order[i]] = same ? first[order[i - 1]] : order[i];
    }
    free(order);
    return true;
}

/* Makes the mesh, less the origin; it takes over the indices and colors. */
static bool make_mesh(struct local *f, const double origin[3], struct mesh *mesh)
{
    uint32_t *first = malloc((f->vertex_count + 1) * sizeof *first);
    memset(mesh, 0, sizeof *mesh);
    mesh->positions = malloc((f->vertex_count + 1) * 3 * sizeof *mesh->positions);
    if (!first || !mesh->positions || !join(f, first)) {
        free(first);
        mesh_free(mesh);
        return false;
    }
    for (size_t i = 0; i < 3 * f->vertex_count; ++i) {
        mesh->positions[i] = (float)(f->places[i] - origin[i % 3]);
    }
    for (size_t t = 0; t < f->triangle_count; ++t) {
        const uint32_t *from = f->indices + 3 * t;
        const uint32_t corner[3] = {first[from[0]], first[from[1]], first[from[2]]};
        if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) {
            ++mesh->dropped;
        } else {
            memcpy(f->indices + 3 * mesh->triangle_count++, corner, sizeof corner);
        }
    }
    mesh->vertex_count = f->vertex_count;
    mesh->indices = f->indices;
    mesh->colors = f->colors;
    f->indices = NULL;
    f->colors = NULL;
    free(first);
    return true;
}

static bool ends_with(const char *path, const char *end)
{
    const char *dot = strrchr(path, '.');
    char lower[8] = "";
    for (size_t i = 0; dot && dot[i] && i + 1 < sizeof lower; ++i) {
        lower[i] = (char)(dot[i] >= 'A' && dot[i] <= 'Z' ? dot[i] + 32 : dot[i]);
    }
    return strcmp(lower, end) == 0;
}

bool mesh_read_local(const char *path, struct mesh *mesh, double origin[3], char error[MESH_TEXT])
{
    const bool ply = ends_with(path, ".ply"), obj = ends_with(path, ".obj");
    size_t size = 0;
    unsigned char *bytes = ply || obj ? scene_read_file(path, &size) : NULL;
    unsigned char *grown = bytes ? realloc(bytes, size + 1) : NULL;
    bool taken = false;
    if (grown) {
        bytes = grown;
        bytes[size] = '\0'; /* for numbers of text */
        struct local f = {.at = bytes, .end = bytes + size};
        taken = (ply ? read_ply(&f) : read_obj(&f)) && f.triangle_count > 0 && is_distant(&f, origin) && make_mesh(&f, origin, mesh);
        free(f.places);
        free(f.colors);
        free(f.indices);
    }
    free(bytes);
    if (!taken) {
        origin[0] = origin[1] = origin[2] = 0.0;
    }
    return taken || mesh_read(path, mesh, error);
}

double mesh_float_step(const struct mesh *mesh)
{
    double furthest = 0.0;
    for (size_t i = 0; i < 3 * mesh->vertex_count; ++i) {
        furthest = fmax(furthest, fabs((double)mesh->positions[i]));
    }
    return furthest * (double)FLT_EPSILON;
}
