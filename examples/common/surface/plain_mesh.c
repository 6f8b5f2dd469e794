#define _POSIX_C_SOURCE 200809L
#include "surface/plain_mesh.h"

#include "surface/polygon.h"
#include "surface/scene_files.h"

#include <ctype.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { MOST_PROPERTIES = 64 };

/* A file as it is taken apart. */
struct source {
    const unsigned char *at, *end; /* a zero follows, for numbers of text */
    unsigned char line_end;
    struct plain_mesh *mesh;
    char *line; /* text and a zero */
    size_t line_length, line_room;
    uint32_t *corners; /* of a face: those that are finite, with their places */
    double *corner_places;
    size_t corner_count, corner_room, place_room;
    size_t lost_corners; /* of the same face: those that are not */
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

/* Adds a corner, a vertex that is read, to the face. One that is not finite as a float is left out of it: of a large polygon all but a
 * triangle stays. */
static bool add_corner(struct source *f, uint32_t vertex)
{
    const double *place = f->mesh->places + 3 * (size_t)vertex, most = (double)FLT_MAX;
    if (!(fabs(place[0]) <= most && fabs(place[1]) <= most && fabs(place[2]) <= most)) {
        ++f->lost_corners;
        return true;
    }
    if (!room_for((void **)&f->corners, &f->corner_room, f->corner_count + 1, sizeof *f->corners)
        || !room_for((void **)&f->corner_places, &f->place_room, f->corner_count + 1, 3 * sizeof *f->corner_places)) {
        return false;
    }
    memcpy(f->corner_places + 3 * f->corner_count, place, 3 * sizeof *place);
    f->corners[f->corner_count++] = vertex;
    return true;
}

/* Adds the triangles of the face to the mesh, and begins another. */
static bool end_face(struct source *f)
{
    struct plain_mesh *mesh = f->mesh;
    const size_t count = f->corner_count, triangles = count > 2 ? count - 2 : 0, all = count + f->lost_corners;
    mesh->not_finite += all > 2 ? all - 2 - triangles : 0;
    f->corner_count = f->lost_corners = 0;
    if (triangles == 0) {
        return true;
    }
    if (!room_for((void **)&mesh->indices, &mesh->triangle_room, mesh->triangle_count + triangles, 3 * sizeof *mesh->indices)) {
        return false;
    }
    uint32_t *indices = mesh->indices + 3 * mesh->triangle_count;
    if (!polygon_cut(f->corner_places, count, (int *)indices)) {
        return false;
    }
    for (size_t i = 0; i < 3 * triangles; ++i) {
        indices[i] = f->corners[indices[i]];
    }
    mesh->triangle_count += triangles;
    return true;
}

static bool add_place(struct plain_mesh *mesh, const double place[3])
{
    if (mesh->vertex_count >= UINT32_MAX / 4
        || !room_for((void **)&mesh->places, &mesh->vertex_room, mesh->vertex_count + 1, 3 * sizeof *mesh->places)) {
        return false;
    }
    memcpy(mesh->places + 3 * mesh->vertex_count++, place, 3 * sizeof *place);
    return true;
}

/* Reads three numbers. Returns what follows, NULL where there are fewer. */
static const char *read_place(const char *text, double place[3])
{
    for (int k = 0; text && k < 3; ++k) {
        char *end;
        place[k] = strtod(text, &end);
        text = end > text ? end : NULL;
    }
    return text;
}

/* Appends the next line, without its end, to the line. Returns false at the end of the file, or where memory is short. */
static bool append_line(struct source *f)
{
    if (f->at >= f->end) {
        return false;
    }
    const unsigned char *end = memchr(f->at, f->line_end, (size_t)(f->end - f->at));
    const size_t length = (size_t)((end ? end : f->end) - f->at);
    if (!room_for((void **)&f->line, &f->line_room, f->line_length + length + 1, 1)) {
        return false;
    }
    memcpy(f->line + f->line_length, f->at, length);
    f->line_length += length;
    f->line[f->line_length] = '\0';
    f->at += length + (end ? 1 : 0);
    return true;
}

static bool next_line(struct source *f)
{
    f->line_length = 0;
    return append_line(f);
}

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

static const char *skip_blanks(const char *text) { return text + strspn(text, " \t\r"); }

/* ---- OBJ ---- */

static bool obj_face(struct source *f, const char *text)
{
    for (const char *at = skip_blanks(text); *at && *at != '#'; at = skip_blanks(at)) {
        char *end;
        const long vertices = (long)f->mesh->vertex_count, number = strtol(at, &end, 10);
        const long index = number < 0 ? vertices + number : number - 1;
        if (end == at || index < 0 || index >= vertices || !add_corner(f, (uint32_t)index)) {
            return false;
        }
        at += strcspn(at, " \t\r");
    }
    return end_face(f);
}

/* Reads the next line, with those that a backslash at its end joins to it. */
static bool obj_line(struct source *f)
{
    f->line_length = 0;
    while (append_line(f)) {
        size_t end = f->line_length;
        while (end > 0 && is_blank(f->line[end - 1])) {
            --end;
        }
        if (end == 0 || f->line[end - 1] != '\\') {
            return true;
        }
        f->line[end - 1] = ' ';
        f->line[end] = '\0';
        f->line_length = end;
    }
    return f->at == f->end; /* behind a last backslash */
}

static bool read_obj(struct source *f)
{
    static const unsigned char mark[] = {0xEF, 0xBB, 0xBF};
    bool good = true;
    if (f->end - f->at > 3 && memcmp(f->at, mark, sizeof mark) == 0) {
        f->at += sizeof mark;
    }
    while (good && f->at < f->end && (good = obj_line(f))) {
        const char *word = skip_blanks(f->line);
        double place[3];
        if (word[0] == 'v' && is_blank(word[1])) {
            good = read_place(word + 1, place) && add_place(f->mesh, place);
        } else if (word[0] == 'f' && is_blank(word[1])) {
            good = obj_face(f, word + 1);
        }
    }
    return good;
}

/* ---- STL ---- */

/* Returns whether a text begins with a word, in small letters or capitals. */
static bool begins_with(const unsigned char *at, const unsigned char *end, const char *word)
{
    while (*word && at < end && tolower(*at) == *word) {
        ++at, ++word;
    }
    return *word == '\0';
}

/* Returns whether a word of a text is this one. */
static bool is_word(const unsigned char *at, const unsigned char *end, const char *word)
{
    return begins_with(at, end, word) && (at + strlen(word) == end || isspace(at[strlen(word)]));
}

/* Moves on to the next word. */
static void next_word(struct source *f)
{
    while (f->at < f->end && !isspace(*f->at)) {
        ++f->at;
    }
    while (f->at < f->end && isspace(*f->at)) {
        ++f->at;
    }
}

/* Returns whether a file that begins with "solid" is a text: the header of a binary one may begin so too, but no facet follows, and soon a
 * zero does. */
static bool is_stl_text(struct source f)
{
    const unsigned char *zero = memchr(f.at, '\0', (size_t)(f.end - f.at));
    f.end = zero ? zero : f.end;
    for (; f.at < f.end; next_word(&f)) {
        if (is_word(f.at, f.end, "facet") || is_word(f.at, f.end, "endsolid")) {
            return true;
        }
    }
    return false;
}

/* Reads facets of all solids of a text. Their names are any words: a vertex stands in a loop. */
static bool read_stl_text(struct source *f)
{
    bool good = true, in_loop = false;
    for (; good && f->at < f->end; next_word(f)) {
        double place[3];
        if (is_word(f->at, f->end, "loop")) {
            in_loop = true;
        } else if (in_loop && is_word(f->at, f->end, "vertex")) {
            good = read_place((const char *)f->at + 6, place) && add_place(f->mesh, place)
                && add_corner(f, (uint32_t)(f->mesh->vertex_count - 1));
        } else if (in_loop && is_word(f->at, f->end, "endloop")) {
            good = end_face(f);
            in_loop = false;
        }
    }
    return good && !in_loop;
}

static uint32_t little_endian(const unsigned char *b)
{
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static bool read_stl_binary(struct source *f, size_t count)
{
    bool good = true;
    f->mesh->single = true;
    for (f->at += 84; good && count > 0; --count, f->at += 50) {
        for (int k = 0; good && k < 3; ++k) {
            double place[3];
            for (int c = 0; c < 3; ++c) {
                const uint32_t bits = little_endian(f->at + 12 * (k + 1) + 4 * c);
                float number;
                memcpy(&number, &bits, sizeof number);
                place[c] = (double)number;
            }
            good = add_place(f->mesh, place) && add_corner(f, (uint32_t)(f->mesh->vertex_count - 1));
        }
        good = good && end_face(f);
    }
    return good;
}

/* A binary file is told by its size, or by not being a text. Programs that write as they go leave its count at none or all
 * bits. */
static bool read_stl(struct source *f)
{
    const size_t size = (size_t)(f->end - f->at), room = size >= 84 ? (size - 84) / 50 : 0;
    const size_t count = size >= 84 ? little_endian(f->at + 80) : 0;
    if (size >= 84 && count == room && 84 + 50 * room == size) {
        return read_stl_binary(f, count);
    }
    if (begins_with(f->at, f->end, "solid") && is_stl_text(*f)) {
        return read_stl_text(f);
    }
    if ((count == 0 || count == UINT32_MAX) && 84 + 50 * room == size) {
        return read_stl_binary(f, room);
    }
    return count > 0 && count <= room && read_stl_binary(f, count);
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
    struct source *file;
    size_t vertices; /* that the header promises */
    bool takes_vertices, takes_faces;
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
    char format[32];
    unsigned long long count;
    struct source *f = ply->file;
    if (f->end - f->at > 4 && f->at[3] == '\r' && f->at[4] != '\n') {
        f->line_end = '\r';
    }
    bool good = next_line(f) && strncmp(f->line, "ply", 3) == 0;
    while (good && next_line(f)) {
        const char *line = f->line;
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
    struct source *f = ply->file;
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
static void ply_take(struct plain_mesh *mesh, const struct ply_property *p, double value)
{
    static const char *const places[3] = {"x", "y", "z"}, *const colors[3] = {"red", "green", "blue"};
    for (size_t k = 0; k < 3; ++k) {
        if (strcmp(p->name, places[k]) == 0) {
            mesh->places[3 * mesh->vertex_count + k] = value;
        } else if (strcmp(p->name, colors[k]) == 0 && mesh->colors) {
            mesh->colors[3 * mesh->vertex_count + k] = (float)(p->type == PLY_UCHAR        ? value / 255.0
                                                             : p->type == PLY_USHORT ? value / 65535.0
                                                                                     : value);
        }
    }
}

static bool ply_list(struct ply *ply, const struct ply_property *p, bool faces)
{
    double count, value = 0.0;
    bool good = ply_number(ply, p->count, &count) && count >= 0.0;
    for (double i = 0.0; good && i < count; ++i) {
        good = ply_number(ply, p->type, &value)
            && (!faces || (value >= 0.0 && value < (double)ply->vertices && add_corner(ply->file, (uint32_t)value)));
    }
    return good && (!faces || end_face(ply->file));
}

/* Passes over the end of a line of text. Returns whether nothing is left of it. */
static bool ply_line_end(struct source *f)
{
    while (f->at < f->end && *f->at != f->line_end && isspace(*f->at)) {
        ++f->at;
    }
    return f->at == f->end || *f->at == f->line_end;
}

static bool ply_row(struct ply *ply, const struct ply_element *e)
{
    const bool vertex = ply->takes_vertices && strcmp(e->name, "vertex") == 0;
    const bool face = ply->takes_faces && strcmp(e->name, "face") == 0;
    bool good = true;
    for (int i = 0; good && i < e->property_count; ++i) {
        const struct ply_property *p = &e->properties[i];
        double value;
        if (p->count != PLY_NONE) {
            good = ply_list(ply, p, face && strncmp(p->name, "vertex_ind", 10) == 0);
        } else if ((good = ply_number(ply, p->type, &value)) && vertex) {
            ply_take(ply->file->mesh, p, value);
        }
    }
    ply->file->mesh->vertex_count += vertex;
    return good && (!ply->text || ply_line_end(ply->file));
}

static bool ply_has(const struct ply_element *e, const char *name)
{
    bool any = false;
    for (int i = 0; i < e->property_count; ++i) {
        any = any || strcmp(e->properties[i].name, name) == 0;
    }
    return any;
}

/* Makes room for the vertices, of which there is one element. */
static bool ply_vertices(struct ply *ply, const struct ply_element *e)
{
    struct plain_mesh *mesh = ply->file->mesh;
    if (mesh->places) {
        return false;
    }
    mesh->places = calloc(e->count + 1, 3 * sizeof *mesh->places);
    mesh->colors = ply_has(e, "red") ? calloc(e->count + 1, 3 * sizeof *mesh->colors) : NULL;
    return mesh->places != NULL;
}

static bool ply_elements(struct ply *ply)
{
    bool good = true;
    for (int e = 0; good && e < ply->element_count; ++e) {
        for (size_t i = 0; good && i < ply->elements[e].count; ++i) {
            good = ply_row(ply, &ply->elements[e]);
        }
    }
    return good;
}

/* Reads elements in any order: twice where faces stand before the vertices, by whose places they are cut. */
static bool read_ply(struct source *f)
{
    struct ply ply = {.file = f, .takes_vertices = true};
    bool good = ply_header(&ply), faces_first = false;
    for (int e = 0; good && e < ply.element_count; ++e) {
        const struct ply_element *element = &ply.elements[e];
        good = element->count <= (size_t)(f->end - f->at); /* each takes a byte or more */
        faces_first = faces_first || (strcmp(element->name, "face") == 0 && !f->mesh->places);
        if (good && strcmp(element->name, "vertex") == 0) {
            ply.vertices = element->count;
            good = ply_vertices(&ply, element);
        }
    }
    const unsigned char *elements = f->at;
    ply.takes_faces = !faces_first;
    good = good && ply_elements(&ply);
    if (good && faces_first) {
        f->at = elements;
        ply.takes_vertices = false;
        ply.takes_faces = true;
        good = f->mesh->places && ply_elements(&ply);
    }
    return good;
}

/* ---- all ---- */

static bool ends_with(const char *path, const char *end)
{
    const char *dot = strrchr(path, '.');
    return dot && strcasecmp(dot, end) == 0;
}

bool plain_mesh_read(const char *path, struct plain_mesh *mesh)
{
    const bool ply = ends_with(path, ".ply"), obj = ends_with(path, ".obj"), stl = ends_with(path, ".stl");
    size_t size = 0;
    unsigned char *bytes = ply || obj || stl ? scene_read_file(path, &size) : NULL;
    unsigned char *grown = bytes ? realloc(bytes, size + 1) : NULL;
    bool good = false;
    memset(mesh, 0, sizeof *mesh);
    if (grown) {
        bytes = grown;
        bytes[size] = '\0';
        struct source f = {.at = bytes, .end = bytes + size, .line_end = '\n', .mesh = mesh};
        good = ply ? read_ply(&f) : obj ? read_obj(&f) : read_stl(&f);
        free(f.line);
        free(f.corners);
        free(f.corner_places);
    }
    free(bytes);
    if (!good) {
        plain_mesh_free(mesh);
    }
    return good;
}

void plain_mesh_free(struct plain_mesh *mesh)
{
    free(mesh->places);
    free(mesh->colors);
    free(mesh->indices);
    memset(mesh, 0, sizeof *mesh);
}
