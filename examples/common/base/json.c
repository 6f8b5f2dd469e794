#include "base/json.h"

#include "base/write_error.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

void json_open_stream(struct json_writer *json, FILE *file)
{
    memset(json, 0, sizeof *json);
    json->file = file;
}

bool json_open(struct json_writer *json, const char *path)
{
    const bool to_stdout = strcmp(path, "-") == 0;
    json_open_stream(json, to_stdout ? stdout : fopen(path, "w"));
    json->path = to_stdout ? NULL : path;
    return json->file != NULL;
}

/* Returns the length of the valid UTF-8 sequence at `text`, 0 if there is none. */
static size_t utf8_length(const unsigned char *text)
{
    const unsigned char c = text[0];
    const size_t length = c < 0x80                ? 1
                          : c >= 0xC2 && c < 0xE0 ? 2
                          : c >= 0xE0 && c < 0xF0 ? 3
                          : c >= 0xF0 && c < 0xF5 ? 4
                                                  : 0;
    for (size_t i = 1; i < length; ++i) {
        if ((text[i] & 0xC0) != 0x80) {
            return 0;
        }
    }
    /* Refuse overlong forms, surrogates and values above U+10FFFF. */
    if ((c == 0xE0 && text[1] < 0xA0) || (c == 0xED && text[1] > 0x9F) || (c == 0xF0 && text[1] < 0x90)
        || (c == 0xF4 && text[1] > 0x8F)) {
        return 0;
    }
    return length;
}

static void write_text(FILE *file, const char *text)
{
    const unsigned char *c = (const unsigned char *)text;
    fputc('"', file);
    while (*c) {
        const size_t length = utf8_length(c);
        if (length == 0) {
            fputs("\\ufffd", file);
            ++c;
            continue;
        }
        switch (*c) {
        case '"':
            fputs("\\\"", file);
            break;
        case '\\':
            fputs("\\\\", file);
            break;
        case '\n':
            fputs("\\n", file);
            break;
        case '\r':
            fputs("\\r", file);
            break;
        case '\t':
            fputs("\\t", file);
            break;
        default:
            if (*c < 0x20 || *c == 0x7F) {
                fprintf(file, "\\u%04x", (unsigned)*c);
            } else {
                fwrite(c, 1, length, file);
            }
        }
        c += length;
    }
    fputc('"', file);
}

static void indent(struct json_writer *json)
{
    fputc('\n', json->file);
    for (int i = 0; i < json->depth; ++i) {
        fputs("  ", json->file);
    }
}

/* Writes comma, line break and key before a value; scalars in an array stay on one line. */
static void before(struct json_writer *json, const char *key, bool is_container)
{
    if (json->depth == 0) {
        json->failed = json->failed || key != NULL;
        return;
    }
    const int level = json->depth - 1;
    if (json->is_array[level] ? key != NULL : key == NULL) {
        json->failed = true;
    }
    if (json->has_items[level]) {
        fputc(',', json->file);
    }
    if (!json->is_array[level] || is_container) {
        indent(json);
    } else if (json->has_items[level]) {
        fputc(' ', json->file);
    }
    json->has_items[level] = true;
    if (!json->is_array[level]) {
        write_text(json->file, key ? key : "");
        fputs(": ", json->file);
    }
}

static void begin(struct json_writer *json, const char *key, bool is_array)
{
    before(json, key, true);
    if (json->depth >= JSON_DEPTH) {
        json->failed = true;
        return;
    }
    fputc(is_array ? '[' : '{', json->file);
    json->is_array[json->depth] = is_array;
    json->has_items[json->depth] = false;
    ++json->depth;
}

static void end(struct json_writer *json, bool is_array)
{
    if (json->depth == 0 || json->is_array[json->depth - 1] != is_array) {
        json->failed = true;
        return;
    }
    --json->depth;
    if (json->has_items[json->depth] && !is_array) {
        indent(json);
    }
    fputc(is_array ? ']' : '}', json->file);
}

void json_object_begin(struct json_writer *json, const char *key) { begin(json, key, false); }
void json_object_end(struct json_writer *json) { end(json, false); }
void json_array_begin(struct json_writer *json, const char *key) { begin(json, key, true); }
void json_array_end(struct json_writer *json) { end(json, true); }

void json_number(struct json_writer *json, const char *key, double value)
{
    char text[40];
    before(json, key, false);
    if (!isfinite(value)) {
        fputs("null", json->file);
        return;
    }
    snprintf(text, sizeof text, "%.9g", value);
    char *comma = strchr(text, ','); /* a window toolkit may have set a locale with a decimal comma */
    if (comma) {
        *comma = '.';
    }
    fputs(text, json->file);
}

void json_integer(struct json_writer *json, const char *key, int64_t value)
{
    before(json, key, false);
    fprintf(json->file, "%" PRId64, value);
}

void json_string(struct json_writer *json, const char *key, const char *text)
{
    before(json, key, false);
    if (text) {
        write_text(json->file, text);
    } else {
        fputs("null", json->file);
    }
}

void json_bool(struct json_writer *json, const char *key, bool value)
{
    before(json, key, false);
    fputs(value ? "true" : "false", json->file);
}

void json_ready(struct json_writer *json, const char *key, const char *value)
{
    size_t length = value ? strlen(value) : 0;
    while (length > 0 && value[length - 1] == '\n') {
        --length;
    }
    before(json, key, false);
    if (length > 0) {
        fwrite(value, 1, length, json->file);
    } else {
        fputs("null", json->file);
    }
}

void json_numbers(struct json_writer *json, const char *key, const double *values, size_t count)
{
    json_array_begin(json, key);
    for (size_t i = 0; i < count; ++i) {
        json_number(json, NULL, values[i]);
    }
    json_array_end(json);
}

bool json_close(struct json_writer *json)
{
    while (json->depth > 0) {
        end(json, json->is_array[json->depth - 1]);
    }
    fputc('\n', json->file);
    bool good = !json->failed && fflush(json->file) == 0 && !ferror(json->file);
    if (json->path) {
        good = fclose(json->file) == 0 && good;
        if (!good) { partial_file_remove(json->path); }
    }
    json->file = NULL;
    return good;
}
