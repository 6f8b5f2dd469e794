/* file.h - writes the model's surface as PLY or OBJ, by the file's name. */
#ifndef EXAMPLES_VIEWER_FILE_H
#define EXAMPLES_VIEWER_FILE_H

#include "viewer/model.h"

/* Writes the watertight surface with normals and correspondences: a_x a_y a_z in PLY, three-dimensional texture coordinates in
 * OBJ. Returns false with one line in model->error. */
bool viewer_save(struct viewer_model *model, const char *path);

#endif
