/* file.h - the model's surface into a file: PLY, or OBJ, by the file's name. */
#ifndef EXAMPLES_VIEWER_FILE_H
#define EXAMPLES_VIEWER_FILE_H

#include "viewer/model.h"

/* The watertight surface with its normals and correspondences: a_x a_y a_z in PLY, three-dimensional texture coordinates in
 * OBJ. False: one line in model->error. */
bool viewer_save(struct viewer_model *model, const char *path);

#endif
