/* json_report.h - reads the files that a program has written: whole, and reports in JSON. */
#ifndef JSON_REPORT_H
#define JSON_REPORT_H

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "scratch.h"

/* Returns the file's bytes, of 16 MiB at most, with a zero after them; none where it cannot be read. length may be NULL. Call
 * free() afterwards. */
SHARED char *whole_file(const char *path, size_t *length)
{
    FILE *file = fopen(path, "rb");
    char *text = calloc(1, 1 << 24);
    const size_t count = file ? fread(text, 1, (1 << 24) - 1, file) : 0;
    if (length) *length = count;
    if (file) fclose(file);
    return text;
}

/* Returns the report, or NULL. Call cJSON_Delete() afterwards. */
SHARED cJSON *read_report(const char *path)
{
    char *text = whole_file(path, NULL);
    cJSON *json = cJSON_Parse(text);
    free(text);
    return json;
}

/* Returns the number of a name, or NAN. */
SHARED double number_of(const cJSON *json, const char *name)
{
    const cJSON *item = cJSON_GetObjectItem(json, name);
    return cJSON_IsNumber(item) ? item->valuedouble : (double)NAN;
}

#endif
