#include "viewer/file.h"

#include <stdint.h>
#include <stdlib.h>

bool viewer_save(struct viewer_model *model, const char *path)
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
    const bool good = mesh_write(path, &arrays, model->error);
    free(colors);
    springls_mesh_free(model->ctx, &mesh);
    return good;
}
