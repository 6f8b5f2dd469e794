/* file.h - writes the model's surface to a file. */
#ifndef EXAMPLES_VIEWER_FILE_H
#define EXAMPLES_VIEWER_FILE_H

#include "viewer/model.h"

/* Writes the watertight surface with normals, correspondences and colors, as mesh_write. texture: texels a side of an image that has
 * the colors, of a GLB; 0: vertices have them. Returns false with one line in model->error. */
bool viewer_save(struct viewer_model *model, const char *path, int texture);

#endif
