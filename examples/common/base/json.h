/* json.h - a small streaming JSON writer.
 *
 * Inside an object every call takes a key; inside an array and for the outermost value the key is NULL. Numbers are printed
 * with %.9g, NaN and infinities as null; text is escaped and made valid UTF-8 (bad bytes become U+FFFD). So the output always
 * parses. Errors are collected: json_close returns whether everything was written. */
#ifndef EXAMPLES_BASE_JSON_H
#define EXAMPLES_BASE_JSON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { JSON_DEPTH = 32 };

struct json_writer {
    FILE *file;
    const char *path; /* of a file that it owns and closes; NULL: a stream */
    bool failed;
    int depth;
    bool is_array[JSON_DEPTH];
    bool has_items[JSON_DEPTH];
};

/* Opens `path` for writing ("-" = stdout), which has to stay until json_close. Returns false on failure; call json_close only after
   true. */
bool json_open(struct json_writer *json, const char *path);
void json_open_stream(struct json_writer *json, FILE *file); /* the caller keeps the stream */
/* Closes open objects and adds a line end. Returns false after any write error or misuse, which leaves no file at `path`. */
bool json_close(struct json_writer *json);

void json_object_begin(struct json_writer *json, const char *key);
void json_object_end(struct json_writer *json);
void json_array_begin(struct json_writer *json, const char *key);
void json_array_end(struct json_writer *json);
void json_number(struct json_writer *json, const char *key, double value);
void json_integer(struct json_writer *json, const char *key, int64_t value);
void json_string(struct json_writer *json, const char *key, const char *text); /* NULL is written as null */
void json_bool(struct json_writer *json, const char *key, bool value);
void json_ready(struct json_writer *json, const char *key, const char *value); /* `value` is JSON; NULL: null */
void json_numbers(struct json_writer *json, const char *key, const double *values, size_t count);

#endif
