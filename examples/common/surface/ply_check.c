#define _POSIX_C_SOURCE 200809L
#include "surface/ply_check.h"

#include <ctype.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { LONGEST_LINE = 4096, MOST_LINES = 1000, MOST_PROPERTIES = 256 }; /* of a header */

/* What a value is: bytes in a binary file, and whether it is a whole number, with or without a sign. */
static const struct type {
    const char *name;
    int bytes;
    bool whole, sign;
} types[] = {{"char", 1, true, true},     {"int8", 1, true, true},      {"uchar", 1, true, false},  {"uint8", 1, true, false},
             {"short", 2, true, true},    {"int16", 2, true, true},     {"ushort", 2, true, false}, {"uint16", 2, true, false},
             {"int", 4, true, true},      {"int32", 4, true, true},     {"uint", 4, true, false},   {"uint32", 4, true, false},
             {"float", 4, false, true},   {"float32", 4, false, true},  {"double", 8, false, true}, {"float64", 8, false, true}};

struct property {
    const struct type *type, *count; /* count: of a list, which is preceded by how many there are; NULL: one value */
};

struct element {
    char name[32];
    double count;
    int first, end; /* of the properties */
};

struct ply {
    const char *path;
    FILE *file;
    long size;
    char *error;
    bool has_format, ascii, big_endian;
    struct element elements[MOST_PROPERTIES];
    struct property properties[MOST_PROPERTIES];
    int element_count, property_count;
};

double ply_whole_number(const char *word)
{
    const size_t digits = strspn(word, "0123456789");
    return digits >= 1 && digits <= 15 && word[digits] == '\0' ? strtod(word, NULL) : -1.0;
}

/* ---- the header ---- */

static const struct type *find_type(const char *name)
{
    for (size_t i = 0; i < sizeof types / sizeof *types; ++i) {
        if (strcmp(types[i].name, name) == 0) { return &types[i]; }
    }
    return NULL;
}

static bool read_format(struct ply *p, const char *line)
{
    char word[32] = "";
    sscanf(line, "format %31s", word);
    p->ascii = strcmp(word, "ascii") == 0;
    p->big_endian = strcmp(word, "binary_big_endian") == 0;
    p->has_format = p->ascii || p->big_endian || strcmp(word, "binary_little_endian") == 0;
    return p->has_format;
}

static bool read_element(struct ply *p, const char *line)
{
    char count[32];
    struct element *e = &p->elements[p->element_count];
    if (p->element_count == MOST_PROPERTIES || sscanf(line, "element %31s %31s", e->name, count) != 2) { return false; }
    e->first = e->end = p->property_count;
    e->count = ply_whole_number(count);
    ++p->element_count;
    return e->count >= 0.0;
}

static bool read_property(struct ply *p, const char *line)
{
    char first[32], second[32] = "", third[32] = "";
    struct property *property = &p->properties[p->property_count];
    const int words = sscanf(line, "property %31s %31s %31s", first, second, third);
    const bool list = words >= 1 && strcmp(first, "list") == 0;
    if (p->element_count == 0 || p->property_count == MOST_PROPERTIES || words < (list ? 3 : 2)) { return false; }
    property->count = list ? find_type(second) : NULL;
    property->type = find_type(list ? third : first);
    p->elements[p->element_count - 1].end = ++p->property_count;
    return property->type && (!list || (property->count && property->count->whole));
}

/* Returns whether the line begins with the word alone. */
static bool is_word(const char *line, const char *word)
{
    const size_t length = strlen(word);
    return strncmp(line, word, length) == 0 && (line[length] == '\0' || isspace((unsigned char)line[length]));
}

static bool read_line(struct ply *p, const char *line)
{
    return is_word(line, "comment") || is_word(line, "obj_info") || (is_word(line, "format") && read_format(p, line))
        || (is_word(line, "element") && read_element(p, line)) || (is_word(line, "property") && read_property(p, line));
}

/* Reads the header up to its end, behind which the elements begin. An element takes at least one byte. */
static bool read_header(struct ply *p)
{
    char line[LONGEST_LINE];
    bool ended = false;
    /* assimp takes the first word in capitals too */
    if (!fgets(line, sizeof line, p->file) || strncasecmp(line, "ply", 3) != 0 || !isspace((unsigned char)line[3])) {
        return scene_fail(p->error, p->path, "a PLY file begins with ply");
    }
    for (int row = 2; row < MOST_LINES && !ended && fgets(line, sizeof line, p->file); ++row) {
        ended = is_word(line, "end_header");
        if (!strchr(line, '\n') || (!ended && !read_line(p, line))) {
            return scene_fail(p->error, p->path, "line %d of the PLY header is not valid", row);
        }
    }
    for (int e = 0; e < p->element_count; ++e) {
        const double count = p->elements[e].count;
        if (count > (double)p->size) {
            return scene_fail(p->error, p->path, "the header promises %.0f elements, the file has %ld bytes", count, p->size);
        }
    }
    return (ended || scene_fail(p->error, p->path, "the PLY header has no end"))
        && (p->has_format || scene_fail(p->error, p->path, "the PLY header has no format"));
}

/* Returns the place of an element in the file; that of the end if there is none. */
static int find_element(const struct ply *p, const char *name)
{
    int e = 0;
    while (e < p->element_count && strcmp(p->elements[e].name, name) != 0) { ++e; }
    return e;
}

static bool has_list(const struct ply *p, const struct element *e)
{
    bool list = false;
    for (int i = e->first; i < e->end; ++i) { list = list || p->properties[i].count; }
    return list;
}

/* Refuses elements that assimp does not know where it loses its place in the file: before the vertices, and with a list before the
 * faces. */
static bool check_order(const struct ply *p)
{
    static const char known[] = "vertex face tristrips edge material texture";
    const int vertex = find_element(p, "vertex"), face = find_element(p, "face");
    for (int e = 0; e < p->element_count; ++e) {
        const struct element *element = &p->elements[e];
        if (strstr(known, element->name) || !(element->count > 0.0)) { continue; }
        if (e < vertex || (e < face && has_list(p, element))) {
            return scene_fail(p->error, p->path, "elements '%s' before those of '%s' are not read: put them behind, or leave them out",
                              element->name, e < vertex ? "vertex" : "face");
        }
    }
    return true;
}

/* ---- the elements ---- */

/* Reads the next word of the line, cut to `room`. Returns false at the end of the line, of which the line end is not read. */
static bool next_word(FILE *file, char *word, size_t room)
{
    size_t length = 0;
    int c = getc(file);
    while (c != '\n' && c != EOF && isspace(c)) { c = getc(file); }
    for (; c != EOF && !isspace(c); c = getc(file)) {
        word[length] = (char)c;
        length += length + 1 < room;
    }
    word[length] = '\0';
    ungetc(c, file);
    return length > 0;
}

/* Reads how many values of a property follow: 1, or that number of a list. Returns -1 where there is none, or it is no such number. */
static double read_count(const struct ply *p, const struct property *property)
{
    char word[32];
    unsigned char bytes[8];
    double value = 0.0;
    if (!property->count) { return 1.0; }
    if (p->ascii) {
        const double read = next_word(p->file, word, sizeof word) ? ply_whole_number(word) : -1.0;
        return read <= 4294967295.0 ? read : -1.0;
    }
    const int count = property->count->bytes;
    if (fread(bytes, 1, (size_t)count, p->file) != (size_t)count) { return -1.0; }
    for (int i = 0; i < count; ++i) { value = 256.0 * value + bytes[p->big_endian ? i : count - 1 - i]; }
    return property->count->sign && bytes[p->big_endian ? 0 : count - 1] > 127 ? -1.0 : value;
}

/* Passes over values. Returns whether they are there. */
static bool skip_values(const struct ply *p, const struct property *property, double count)
{
    char word[32], few[256];
    const double bytes = count * property->type->bytes;
    for (double i = 0.0; p->ascii && i < count; ++i) {
        if (!next_word(p->file, word, sizeof word)) { return false; }
    }
    if (p->ascii || bytes <= sizeof few) { /* seeking takes longer */
        return p->ascii || fread(few, 1, (size_t)bytes, p->file) == (size_t)bytes;
    }
    return bytes <= (double)(p->size - ftell(p->file)) && fseek(p->file, (long)bytes, SEEK_CUR) == 0;
}

/* Passes over the white space before an element of an ASCII file, which may be blank lines. */
static void skip_space(FILE *file)
{
    int c = getc(file);
    while (c != EOF && isspace(c)) { c = getc(file); }
    ungetc(c, file);
}

/* Passes over one element: in an ASCII file a line. */
static bool skip_element(const struct ply *p, const struct element *e, double number)
{
    char word[32];
    if (p->ascii) { skip_space(p->file); }
    for (int i = e->first; i < e->end; ++i) {
        const double count = read_count(p, &p->properties[i]);
        const bool whole = count >= 0.0 && skip_values(p, &p->properties[i], count);
        if (!whole && (feof(p->file) || (!p->ascii && count >= 0.0))) {
            return scene_fail(p->error, p->path, "the file ends in %s %.0f", e->name, number);
        }
        if (!whole) {
            return scene_fail(p->error, p->path, count < 0.0 ? "%s %.0f: its list has no length, or a negative one"
                                                             : "%s %.0f has fewer values than it should", e->name, number);
        }
    }
    if (p->ascii && next_word(p->file, word, sizeof word)) {
        return scene_fail(p->error, p->path, "%s %.0f has more values than it should", e->name, number);
    }
    return true;
}

bool ply_check(FILE *file, const char *path, long size, char error[SCENE_TEXT])
{
    struct ply *p = calloc(1, sizeof *p);
    if (!p) { return scene_fail(error, path, "not enough memory"); }
    p->path = path, p->file = file, p->size = size, p->error = error;
    bool good = read_header(p) && check_order(p);
    for (int e = 0; good && e < p->element_count; ++e) {
        for (double n = 0.0; good && n < p->elements[e].count; ++n) { good = skip_element(p, &p->elements[e], n); }
    }
    free(p);
    return good;
}

long ply_binary_elements(FILE *file)
{
    char error[SCENE_TEXT];
    struct ply p = {.path = "", .file = file, .size = LONG_MAX, .error = error};
    return read_header(&p) && !p.ascii ? ftell(file) : 0;
}
