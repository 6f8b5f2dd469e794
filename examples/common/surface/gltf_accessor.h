/* gltf_accessor.h - numbers of a glTF file: accessors of every type, normalized, sparse, interleaved or without a buffer view (glTF 2.0,
 * 3.6.2), and attributes compressed by Draco. */
#ifndef EXAMPLES_SURFACE_GLTF_ACCESSOR_H
#define EXAMPLES_SURFACE_GLTF_ACCESSOR_H

#include "surface/gltf_draco.h"
#include "surface/gltf_file.h"

/* Numbers of an accessor, element by element: integers as they are or, where they are normalized, as shares of 1. */
struct gltf_values {
    double *at;
    size_t count;
    int width; /* numbers an element */
};

/* Reads an accessor, whose elements have `least` to `most` numbers. Returns false with one line. values->at: to be freed. */
bool gltf_read_accessor(struct gltf_file *file, int accessor, int least, int most, struct gltf_values *values);

/* Reads the member `name` of a list of attributes in the same way; values->at is NULL where there is none. draco: what the
 * primitive's attributes were compressed into, or NULL; ids: the numbers that they have there. */
bool gltf_read_attribute(struct gltf_file *file, const cJSON *attributes, const char *name, int least, int most,
                         const struct gltf_draco *draco, const cJSON *ids, struct gltf_values *values);

#endif
