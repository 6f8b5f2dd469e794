#define _POSIX_C_SOURCE 200809L

#include "surface/mesh_io.h"

#include "base/output_file.h"
#include "base/vec3.h"
#include "base/write_error.h"
#include "surface/gltf_write.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

typedef void (*write_fn)(FILE *file, const struct mesh_arrays *mesh);

static bool refuse(char error[MESH_TEXT], const char *path, const char *reason)
{
    snprintf(error, MESH_TEXT, "%.200s: %s", path, reason);
    return false;
}

/* Writes a file by one of the functions below, or none. */
static bool write_file(const char *path, write_fn write, const struct mesh_arrays *mesh, char error[MESH_TEXT])
{
    struct output_file output;
    error[0] = '\0';
    if (!output_file_open(&output, path)) {
        return write_error(error, MESH_TEXT, path);
    }
    write(output.file, mesh);
    return output_file_close(&output, ferror(output.file) == 0) || write_error(error, MESH_TEXT, path);
}

/* Returns vertex k of a triangle. */
static uint32_t corner(const struct mesh_arrays *mesh, size_t triangle, size_t k)
{
    return mesh->indices ? mesh->indices[3 * triangle + k] : (uint32_t)(3 * triangle + k);
}

static unsigned char *put_word(unsigned char *out, uint32_t word) /* little endian on every machine */
{
    for (int i = 0; i < 4; ++i) {
        *out++ = (unsigned char)(word >> (8 * i));
    }
    return out;
}

static unsigned char *put_vector(unsigned char *out, const float v[3])
{
    for (int i = 0; i < 3; ++i) {
        uint32_t word;
        memcpy(&word, &v[i], sizeof word);
        out = put_word(out, word);
    }
    return out;
}

/* Writes a place in double precision, with the origin added, where the mesh has one. */
static unsigned char *put_place(unsigned char *out, const struct mesh_arrays *mesh, const float v[3])
{
    for (int i = 0; mesh->origin && i < 3; ++i) {
        const double x = mesh->origin[i] + (double)v[i];
        uint64_t word;
        memcpy(&word, &x, sizeof word);
        out = put_word(put_word(out, (uint32_t)word), (uint32_t)(word >> 32));
    }
    return mesh->origin ? out : put_vector(out, v);
}

/* ---- PLY ---- */

static void write_ply_header(FILE *file, const struct mesh_arrays *mesh)
{
    fputs("ply\nformat binary_little_endian 1.0\n", file);
    if (mesh->comment) {
        fprintf(file, "comment %.200s\n", mesh->comment);
    }
    const char *place = mesh->origin ? "double" : "float";
    fprintf(file, "element vertex %zu\nproperty %s x\nproperty %s y\nproperty %s z\n", mesh->vertex_count, place, place, place);
    if (mesh->normals) {
        fputs("property float nx\nproperty float ny\nproperty float nz\n", file);
    }
    if (mesh->colors) {
        fputs("property uchar red\nproperty uchar green\nproperty uchar blue\n", file);
    }
    if (mesh->originals) {
        fprintf(file, "property %s a_x\nproperty %s a_y\nproperty %s a_z\n", place, place, place);
    }
    if (mesh->triangle_count > 0) {
        fprintf(file, "element face %zu\nproperty list uchar int vertex_indices\n", mesh->triangle_count);
    }
    fputs("end_header\n", file);
}

static void write_ply(FILE *file, const struct mesh_arrays *mesh)
{
    unsigned char row[64];
    write_ply_header(file, mesh);
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        unsigned char *out = put_place(row, mesh, mesh->positions + 3 * v);
        if (mesh->normals) {
            out = put_vector(out, mesh->normals + 3 * v);
        }
        for (int i = 0; mesh->colors && i < 3; ++i) {
            const float c = mesh->colors[3 * v + (size_t)i];
            *out++ = (unsigned char)(c > 0.0f ? fminf(c, 1.0f) * 255.0f + 0.5f : 0.0f);
        }
        if (mesh->originals) {
            out = put_place(out, mesh, mesh->originals + 3 * v);
        }
        fwrite(row, 1, (size_t)(out - row), file);
    }
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        unsigned char *out = row;
        *out++ = 3;
        for (size_t k = 0; k < 3; ++k) {
            out = put_word(out, corner(mesh, t, k));
        }
        fwrite(row, 1, (size_t)(out - row), file);
    }
}

bool mesh_write_ply(const char *path, const struct mesh_arrays *mesh, char error[MESH_TEXT])
{
    return write_file(path, write_ply, mesh, error);
}

/* ---- OBJ ---- */

/* Writes floats with all their bits. */
static void write_three(FILE *file, const char *key, const float v[3])
{
    fprintf(file, "%s %.9g %.9g %.9g", key, (double)v[0], (double)v[1], (double)v[2]);
}

/* Writes a place, with the origin added; then with fifteen digits. */
static void write_place(FILE *file, const char *key, const struct mesh_arrays *mesh, const float v[3])
{
    if (mesh->origin) {
        fprintf(file, "%s %.15g %.15g %.15g", key, mesh->origin[0] + (double)v[0], mesh->origin[1] + (double)v[1],
                mesh->origin[2] + (double)v[2]);
    } else {
        write_three(file, key, v);
    }
}

static void write_obj(FILE *file, const struct mesh_arrays *mesh)
{
    fputs("# v: the surface, and its color; vt: the place on the original; vn: normals\n", file);
    for (size_t v = 0; v < mesh->vertex_count; ++v) { /* a color behind the place is a common extension */
        write_place(file, "v", mesh, mesh->positions + 3 * v);
        if (mesh->colors) {
            write_three(file, "", mesh->colors + 3 * v);
        }
        fputc('\n', file);
    }
    for (size_t v = 0; mesh->originals && v < mesh->vertex_count; ++v) {
        write_place(file, "vt", mesh, mesh->originals + 3 * v);
        fputc('\n', file);
    }
    for (size_t v = 0; mesh->normals && v < mesh->vertex_count; ++v) {
        write_three(file, "vn", mesh->normals + 3 * v);
        fputc('\n', file);
    }
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        fputc('f', file);
        for (size_t k = 0; k < 3; ++k) {
            const unsigned long i = (unsigned long)corner(mesh, t, k) + 1;
            fprintf(file, " %lu", i);
            if (mesh->originals && mesh->normals) {
                fprintf(file, "/%lu/%lu", i, i);
            } else if (mesh->originals || mesh->normals) {
                fprintf(file, mesh->normals ? "//%lu" : "/%lu", i);
            }
        }
        fputc('\n', file);
    }
}

/* ---- STL ---- */

static void write_stl(FILE *file, const struct mesh_arrays *mesh)
{
    unsigned char row[80] = {0}; /* a header without a meaning, and then 50 bytes a triangle */
    fwrite(row, 1, 80, file);
    fwrite(row, 1, (size_t)(put_word(row, (uint32_t)mesh->triangle_count) - row), file);
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        float corners[9], normal[3];
        for (size_t k = 0; k < 3; ++k) {
            memcpy(corners + 3 * k, mesh->positions + 3 * (size_t)corner(mesh, t, k), 3 * sizeof *corners);
        }
        vec3_triangle_normal(corners, normal); /* before the origin, which floats do not resolve */
        for (int i = 0; mesh->origin && i < 9; ++i) {
            corners[i] = (float)(mesh->origin[i % 3] + (double)corners[i]);
        }
        unsigned char *out = put_vector(row, normal);
        for (size_t k = 0; k < 3; ++k) {
            out = put_vector(out, corners + 3 * k);
        }
        memset(out, 0, 2);
        fwrite(row, 1, 50, file);
    }
}

/* ---- GLB ---- */

static bool write_glb(const char *path, const struct mesh_arrays *mesh, char error[MESH_TEXT])
{
    const struct gltf_mesh glb = {.positions = mesh->positions,
                                  .normals = mesh->normals,
                                  .colors = mesh->colors,
                                  .origin = mesh->origin,
                                  .triangles = (const int *)mesh->indices,
                                  .vertex_count = (int)mesh->vertex_count,
                                  .triangle_count = (int)mesh->triangle_count};
    return gltf_write_mesh(path, &glb, NULL) || write_error(error, MESH_TEXT, path);
}

/* ---- by the name ---- */

static const struct format {
    const char *extension;
    write_fn write; /* NULL: write_glb */
} formats[] = {{".ply", write_ply}, {".obj", write_obj}, {".stl", write_stl}, {".glb", NULL}};

static const struct format *format_of(const char *path, char error[MESH_TEXT])
{
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < sizeof formats / sizeof *formats; ++i) {
        if (strcasecmp(dot, formats[i].extension) == 0) {
            return &formats[i];
        }
    }
    refuse(error, path, "the name of a mesh ends with .ply, .obj, .stl or .glb");
    return NULL;
}

bool mesh_can_write(const char *path, char error[MESH_TEXT]) { return format_of(path, error) != NULL; }

bool mesh_write(const char *path, const struct mesh_arrays *mesh, char error[MESH_TEXT])
{
    const struct format *format = format_of(path, error);
    if (!format) {
        return false;
    }
    return format->write ? write_file(path, format->write, mesh, error) : write_glb(path, mesh, error);
}
