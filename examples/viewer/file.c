#define _POSIX_C_SOURCE 200809L
#include "viewer/file.h"

#include "base/write_error.h"
#include "surface/textured_mesh.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool refuse(struct viewer_model *model, const char *path, const char *reason)
{
    snprintf(model->error, sizeof model->error, "%.200s: %s", path, reason);
    return false;
}

/* Writes a GLB whose colors are in an image. */
static bool save_textured(struct viewer_model *model, const char *path, const struct mesh_arrays *mesh, int texture)
{
    const struct gltf_mesh surface = {.positions = mesh->positions,
                                      .normals = mesh->normals,
                                      .colors = mesh->colors,
                                      .triangles = (const int *)mesh->indices,
                                      .vertex_count = (int)mesh->vertex_count,
                                      .triangle_count = (int)mesh->triangle_count};
    const char *end = strrchr(path, '.');
    if (strcasecmp(end, ".glb") != 0) {
        return refuse(model, path, "a texture (--texture) is saved in GLB only");
    }
    if (!mesh->colors) {
        return refuse(model, path, "the body has no colours for a texture (--texture)");
    }
    errno = 0; /* a failure that leaves it 0 is one of the texture's size */
    return textured_mesh_write(path, &surface, texture)
        || (errno ? write_error(model->error, sizeof model->error, path)
                  : refuse(model, path, "the image of that --texture is too small for the mesh"));
}

bool viewer_save(struct viewer_model *model, const char *path, int texture)
{
    springls_mesh mesh;
    if (!mesh_can_write(path, model->error) || !viewer_model_finish(model)
        || !viewer_model_check(model, springls_extract_mesh(model->ctx, &mesh))) {
        return false;
    }
    float *colors = viewer_model_colors(model, &mesh);
    const struct mesh_arrays arrays = {.positions = mesh.positions,
                                       .vertex_count = (size_t)mesh.vertex_count,
                                       .indices = (const uint32_t *)mesh.triangles,
                                       .triangle_count = (size_t)mesh.triangle_count,
                                       .normals = mesh.normals,
                                       .colors = colors,
                                       .originals = mesh.correspondences,
                                       .comment = "a_x a_y a_z: where each point was at the start"};
    const bool good = texture > 0 ? save_textured(model, path, &arrays, texture) : mesh_write(path, &arrays, model->error);
    free(colors);
    springls_mesh_free(model->ctx, &mesh);
    return good;
}
