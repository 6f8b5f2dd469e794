/* gltf_file.h - a glTF 2.0 file that is being read: its JSON, its lists, and the bytes of its buffer views.
 *
 * Bytes are read and decompressed (EXT_meshopt_compression) when they are first wanted. gltf_accessor.h makes numbers of them. */
#ifndef EXAMPLES_SURFACE_GLTF_FILE_H
#define EXAMPLES_SURFACE_GLTF_FILE_H

#include <cjson/cJSON.h>

#include <stdbool.h>
#include <stddef.h>

enum gltf_list {
    GLTF_BUFFERS, GLTF_VIEWS, GLTF_ACCESSORS, GLTF_SCENES, GLTF_NODES, GLTF_MESHES, GLTF_SKINS, GLTF_MATERIALS, GLTF_TEXTURES,
    GLTF_IMAGES, GLTF_ANIMATIONS, GLTF_LISTS
};

struct gltf_bytes {
    const unsigned char *at;
    size_t size, stride; /* stride: of the elements in a view, 0 = as their type needs */
    unsigned char *owned;
    bool read;
};

struct gltf_file {
    const char *path;
    char *error; /* SCENE_TEXT */
    cJSON *root;
    const cJSON **items[GLTF_LISTS]; /* of a list, for access by number */
    int counts[GLTF_LISTS];
    unsigned char *content; /* the whole file */
    size_t size;
    struct gltf_bytes binary;          /* of a GLB file: its binary chunk */
    struct gltf_bytes *buffers, *views; /* one for each of the list */
};

enum gltf_version { GLTF_BROKEN, GLTF_1, GLTF_2 };

/* Opens a file, GLB or JSON. GLTF_BROKEN: with one line in file->error; also where it needs an extension that is not known. To be
 * closed in any case. path, error: kept. */
enum gltf_version gltf_open(const char *path, struct gltf_file *file, char *error);
void gltf_close(struct gltf_file *file);

/* Fails with one line about an item of a list, such as "accessor 3: ..."; returns false. */
bool gltf_fail(struct gltf_file *file, enum gltf_list list, int number, const char *format, ...);

/* Returns a member, NULL where there is none, or no object. */
const cJSON *gltf_member(const cJSON *object, const char *name);

/* Returns the extension of that name. */
const cJSON *gltf_extension(const cJSON *object, const char *name);

/* Returns a member that is a whole number from 0 to 2^53; `otherwise` where there is none, -1 where it is something else. */
double gltf_whole(const cJSON *object, const char *name, double otherwise);

/* Finds the number of an item that a member names: false, with one line, where there is no such item. *number: -1 where `object` has
 * no such member. */
bool gltf_reference(struct gltf_file *file, const cJSON *object, const char *name, enum gltf_list list, int *number);

/* Reads up to `count` numbers of a list, which keep what they are where there are fewer; false if one is not finite. */
bool gltf_read_numbers(const cJSON *list, double *numbers, int count);

/* Returns the bytes of a buffer view; NULL, with one line, where the file does not have them. */
const struct gltf_bytes *gltf_view(struct gltf_file *file, int view);

/* Reads what a URI has or names, to be freed; NULL: it cannot be read. */
unsigned char *gltf_read_uri(const struct gltf_file *file, const char *uri, size_t *size);

#endif
