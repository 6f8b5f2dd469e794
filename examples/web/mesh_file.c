/* mesh_file.c - mesh_io.h for the page: reads OBJ and binary STL without a library; and textured_mesh.h, without images. */
#include "surface/mesh_io.h"
#include "surface/textured_mesh.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool refuse(char error[MESH_TEXT], const char *path, const char *reason)
{
    snprintf(error, MESH_TEXT, "%.200s: %s", path, reason);
    return false;
}

/* Reads the whole file, with a zero after its end; to be freed. NULL: it cannot be read, or there is no memory. */
static char *read_file(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    long length = -1;
    if (file && fseek(file, 0, SEEK_END) == 0 && (length = ftell(file)) >= 0 && fseek(file, 0, SEEK_SET) == 0) {
        text = malloc((size_t)length + 1);
    }
    if (text && fread(text, 1, (size_t)length, file) != (size_t)length) {
        free(text);
        text = NULL;
    }
    if (file) {
        fclose(file);
    }
    if (text) {
        text[length] = '\0';
        *size = (size_t)length;
    }
    return text;
}

/* Makes room for one more vertex or triangle; capacity doubles. */
static bool grow(void **memory, size_t count, size_t size)
{
    if (count & (count - 1)) {
        return true;
    }
    void *more = realloc(*memory, (count ? 2 * count : 1) * size);
    *memory = more ? more : *memory;
    return more != NULL;
}

static bool add_vertex(struct mesh *mesh, const float place[3])
{
    void *memory = mesh->positions;
    if (!isfinite(place[0]) || !isfinite(place[1]) || !isfinite(place[2]) || !grow(&memory, mesh->vertex_count, 3 * sizeof(float))) {
        return false;
    }
    mesh->positions = memory;
    memcpy(mesh->positions + 3 * mesh->vertex_count++, place, 3 * sizeof(float));
    return true;
}

static bool add_triangle(struct mesh *mesh, uint32_t a, uint32_t b, uint32_t c)
{
    const uint32_t corners[3] = {a, b, c};
    void *memory = mesh->indices;
    if (a == b || b == c || c == a) {
        ++mesh->dropped;
        return true;
    }
    if (!grow(&memory, mesh->triangle_count, sizeof corners)) {
        return false;
    }
    mesh->indices = memory;
    memcpy(mesh->indices + 3 * mesh->triangle_count++, corners, sizeof corners);
    return true;
}

/* ---- OBJ ---- */

/* Reads "v x y z". */
static bool read_vertex(struct mesh *mesh, char *at)
{
    float place[3];
    for (int k = 0; k < 3; ++k) {
        char *end;
        place[k] = strtof(at, &end);
        if (end == at) {
            return false;
        }
        at = end;
    }
    return add_vertex(mesh, place);
}

/* Reads "f a b c ...", each corner as v, v/t, v//n or v/t/n, counted from 1, or backward from -1: as a fan of triangles. */
static bool read_face(struct mesh *mesh, char *at)
{
    uint32_t corner[3] = {0, 0, 0};
    int count = 0;
    for (char *end;; at = end) {
        const long number = strtol(at, &end, 10), all = (long)mesh->vertex_count;
        if (end == at) {
            return count >= 3;
        }
        if (number == 0 || number > all || number < -all) {
            return false;
        }
        corner[count < 2 ? count : 2] = (uint32_t)(number > 0 ? number - 1 : all + number);
        if (++count >= 3) {
            if (!add_triangle(mesh, corner[0], corner[1], corner[2])) {
                return false;
            }
            corner[1] = corner[2];
        }
        while (*end && !isspace((unsigned char)*end)) {
            ++end;
        }
    }
}

static bool read_obj(char *text, struct mesh *mesh)
{
    for (char *line = strtok(text, "\r\n"); line; line = strtok(NULL, "\r\n")) {
        if (line[0] == 'v' && isspace((unsigned char)line[1]) && !read_vertex(mesh, line + 2)) {
            return false;
        }
        if (line[0] == 'f' && isspace((unsigned char)line[1]) && !read_face(mesh, line + 2)) {
            return false;
        }
    }
    return true;
}

/* ---- binary STL: a header of 80 bytes, the number of triangles, for each a normal, three places and two bytes more ---- */

enum { STL_HEADER = 84, STL_TRIANGLE = 50 };

static uint32_t stl_count(const char *data)
{
    const unsigned char *b = (const unsigned char *)data + 80;
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static bool read_stl(const char *data, size_t size, struct mesh *mesh)
{
    if (size < STL_HEADER || (size - STL_HEADER) / STL_TRIANGLE < stl_count(data)) {
        return false;
    }
    const uint32_t count = stl_count(data);
    for (uint32_t t = 0; t < count; ++t) {
        float place[9];
        memcpy(place, data + STL_HEADER + (size_t)t * STL_TRIANGLE + 12, sizeof place); /* WebAssembly is little-endian */
        for (int k = 0; k < 3; ++k) {
            if (!add_vertex(mesh, place + 3 * k)) {
                return false;
            }
        }
        if (!add_triangle(mesh, 3 * t, 3 * t + 1, 3 * t + 2)) {
            return false;
        }
    }
    return true;
}

/* ---- the calls ---- */

static bool ends_with(const char *path, const char *ending)
{
    const size_t length = strlen(path), tail = strlen(ending);
    return length > tail && strcmp(path + length - tail, ending) == 0;
}

bool mesh_read(const char *path, struct mesh *mesh, char error[MESH_TEXT])
{
    const bool obj = ends_with(path, ".obj");
    size_t size = 0;
    memset(mesh, 0, sizeof *mesh);
    if (!obj && !ends_with(path, ".stl")) {
        return refuse(error, path, "the page reads OBJ and binary STL");
    }
    char *data = read_file(path, &size);
    if (!data) {
        return refuse(error, path, "cannot be read");
    }
    const bool good = (obj ? read_obj(data, mesh) : read_stl(data, size, mesh)) && mesh->triangle_count > 0;
    free(data);
    if (!good) {
        mesh_free(mesh);
        return refuse(error, path, "is no such mesh, or has no triangles");
    }
    return true;
}

void mesh_free(struct mesh *mesh)
{
    free(mesh->positions);
    free(mesh->indices);
    memset(mesh, 0, sizeof *mesh);
}

/* Refuses: a PNG wants a library, and the page has no option for a texture. */
bool textured_mesh_write(const char *path, const struct gltf_mesh *surface, int size)
{
    (void)path, (void)surface, (void)size;
    return false;
}
