/* label_names.c - tables of labels, and Slicer's segments. */
#include "imaging/label_names.h"

#include "imaging/volume_format.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <teem/nrrd.h>

void label_names_free(struct label_names *names)
{
    free(names->items);
    memset(names, 0, sizeof *names);
}

const struct label_name *label_names_find(const struct label_names *names, uint32_t id, int layer)
{
    for (size_t n = 0; n < names->count; ++n) {
        if (names->items[n].id == id && names->items[n].layer == layer) {
            return &names->items[n];
        }
    }
    return NULL;
}

bool label_read(const char *text, uint32_t *id)
{
    char *end = NULL;
    if (!isdigit((unsigned char)text[0])) {
        return false;
    }
    errno = 0;
    const unsigned long long value = strtoull(text, &end, 10);
    *id = (uint32_t)value;
    return *end == '\0' && errno == 0 && value <= UINT32_MAX;
}

/* Adds a label; returns NULL if memory is short. */
static struct label_name *add(struct label_names *names)
{
    struct label_name *grown = realloc(names->items, (names->count + 1) * sizeof *grown);
    if (!grown) {
        return NULL;
    }
    names->items = grown;
    struct label_name *made = &grown[names->count++];
    memset(made, 0, sizeof *made);
    made->color[0] = -1.0f;
    return made;
}

/* Copies a name, cut to what fits at the begin of a UTF-8 character. */
static void set_name(struct label_name *label, const char *name, size_t length)
{
    if (length >= LABEL_NAME) {
        length = LABEL_NAME - 1;
        while (length > 0 && ((unsigned char)name[length] & 0xC0) == 0x80) {
            --length;
        }
    }
    memcpy(label->name, name, length);
    label->name[length] = '\0';
}

/* ---- tables ---- */

/* Reads `count` numbers between blanks; returns where they end, NULL if one is missing. */
static const char *read_numbers(const char *text, int count, double *numbers)
{
    for (int n = 0; n < count; ++n) {
        char *end = NULL;
        numbers[n] = strtod(text, &end);
        if (end == text || !isfinite(numbers[n])) {
            return NULL;
        }
        text = end;
    }
    return text;
}

/* Reads a line of a table into a label. */
static bool read_line(const char *line, struct label_name *label)
{
    double id, numbers[6];
    const char *rest = read_numbers(line, 1, &id);
    if (!rest || !(id >= 0.0 && id <= (double)UINT32_MAX && id == floor(id))) {
        return false;
    }
    label->id = (uint32_t)id;
    const char *name = read_numbers(rest, 6, numbers), *after = NULL;
    if (name) { /* ITK-SNAP */
        name = strchr(name, '"');
        after = name ? strrchr(name + 1, '"') : NULL;
        if (!after) {
            return false;
        }
        set_name(label, name + 1, (size_t)(after - name - 1));
    } else {
        name = rest + strspn(rest, " \t");
        const size_t length = strcspn(name, " \t");
        if (length == 0 || isdigit((unsigned char)name[0])) {
            return false;
        }
        set_name(label, name, strcspn(name, " \t\r\n"));
        if (!read_numbers(name + length, 3, numbers)) {
            return true; /* without a color */
        }
    }
    for (int c = 0; c < 3; ++c) {
        label->color[c] = (float)fmax(0.0, fmin(1.0, numbers[c] / 255.0));
    }
    return true;
}

static bool read_table(FILE *file, struct label_names *names, char error[VOLUME_TEXT])
{
    char line[1024];
    for (int number = 1; fgets(line, sizeof line, file); ++number) {
        const char *begin = line + strspn(line, " \t\xEF\xBB\xBF"); /* and the mark of UTF-8 */
        if (*begin == '#' || *begin == '\n' || *begin == '\r' || *begin == '\0') {
            continue;
        }
        struct label_name label = {.layer = 0}, *made;
        if (!read_line(begin, &label)) {
            return volume_error(error, "line %d is not of a table of labels: id R G B A VIS MSH \"name\", or id name R G B A", number);
        }
        if (label_names_find(names, label.id, 0)) {
            return volume_error(error, "line %d: label %lu has a line already", number, (unsigned long)label.id);
        }
        if (!(made = add(names))) {
            return volume_error(error, "not enough memory");
        }
        *made = label;
    }
    return names->count > 0 || volume_error(error, "a table without labels");
}

bool label_names_read(const char *path, struct label_names *names, char error[VOLUME_TEXT])
{
    char reason[VOLUME_TEXT] = "not readable";
    memset(names, 0, sizeof *names);
    FILE *file = volume_file_size(path) >= 0 ? fopen(path, "r") : NULL;
    const bool good = file && read_table(file, names, reason);
    if (file) {
        fclose(file);
    }
    if (!good) {
        label_names_free(names);
        volume_error(error, "%.100s: %.200s", path, reason);
    }
    return good;
}

/* ---- segments ---- */

/* Returns the value of the key SegmentN_NAME, NULL if there is none; to be freed by free(). */
static char *segment_value(const Nrrd *nrrd, int number, const char *name)
{
    char key[64];
    snprintf(key, sizeof key, "Segment%d_%s", number, name);
    return nrrdKeyValueGet(nrrd, key);
}

/* Reads one segment; false with *more: memory is short, without: there is none of this number. */
static bool read_segment(const Nrrd *nrrd, int number, struct label_names *names, bool *more)
{
    char *value = segment_value(nrrd, number, "LabelValue"), *name = segment_value(nrrd, number, "Name");
    char *layer = segment_value(nrrd, number, "Layer"), *color = segment_value(nrrd, number, "Color");
    uint32_t id = 1;
    double numbers[3];
    struct label_name *made = NULL;
    *more = value ? label_read(value, &id) : name != NULL; /* older files have a layer for each segment, with label 1 */
    if (*more && (made = add(names)) != NULL) {
        made->id = id;
        made->layer = layer ? atoi(layer) : value ? 0 : number;
        set_name(made, name ? name : "", name ? strlen(name) : 0);
        if (color && read_numbers(color, 3, numbers)) {
            for (int c = 0; c < 3; ++c) {
                made->color[c] = (float)fmax(0.0, fmin(1.0, numbers[c]));
            }
        }
    }
    free(value);
    free(name);
    free(layer);
    free(color);
    return made != NULL;
}

bool label_names_of_segments(const char *path, struct label_names *names, char error[VOLUME_TEXT])
{
    memset(names, 0, sizeof *names);
    if (!volume_ends_with(path, ".nrrd") && !volume_ends_with(path, ".nhdr")) {
        return true;
    }
    Nrrd *nrrd = nrrdNew();
    NrrdIoState *io = nrrdIoStateNew();
    bool more = nrrd && io, good = more;
    if (good) {
        io->skipData = 1;
        if (nrrdLoad(nrrd, path, io) != 0) { /* whoever reads the image says why */
            free(biffGetDone(NRRD));
            more = false;
        }
    }
    for (int s = 0; more; ++s) {
        good = read_segment(nrrd, s, names, &more) || !more;
    }
    nrrdIoStateNix(io);
    nrrdNuke(nrrd);
    if (!good) {
        label_names_free(names);
        volume_error(error, "%.200s: not enough memory", path);
    }
    return good;
}
