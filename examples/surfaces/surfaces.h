/* surfaces.h - the parts of the program surfaces: labels, their surfaces, files. A function that can fail returns false after one line on
 * stderr. */
#ifndef EXAMPLES_SURFACES_SURFACES_H
#define EXAMPLES_SURFACES_SURFACES_H

#include "base/cli.h"
#include "imaging/label_names.h"
#include "imaging/volume.h"
#include "surfaces/net.h"

enum { SURFACES_MAX_LABELS = 65535 };

struct surfaces_settings {
    struct cli_common common;
    const char *labels, *table;  /* files; table NULL: none */
    const char *chosen, *named;  /* lists of --label and --name; NULL: all */
    const char *format;          /* of the single meshes: ply, obj, stl or none */
    int layer, smooth;           /* layer -1: all */
    bool no_pictures;
};

/* A label of a layer, and its surface in mm. */
struct surfaces_label {
    uint32_t id;
    int layer;
    char name[LABEL_NAME];
    float color[3];       /* display values */
    bool chosen;
    size_t voxels;
    size_t first, count;  /* its vertices of the net */
    struct label_surface mesh;
    float *normals;       /* 3 a vertex */
    double volume, area;  /* mm^3, mm^2 */
};

/* All walls of a layer as one mesh, mm; labels: 2 a triangle, what is behind it, and what is before it. */
struct surfaces_walls {
    int layer;
    float *places;
    uint32_t *triangles, *labels;
    size_t vertex_count, triangle_count;
};

struct surfaces {
    struct surfaces_settings settings;
    struct label_names names;
    struct volume map;          /* the present layer */
    char warning[VOLUME_TEXT];  /* of the file */
    int layers;                 /* of the file */
    float voxel_mm3;
    struct surfaces_label *labels;
    size_t count, chosen;
    struct surfaces_walls *walls; /* one a layer that was read */
    size_t wall_count;
    double seconds;
};

/* labels.c: reads names and the map, and finds the labels. */
bool surfaces_read_names(struct surfaces *run);
bool surfaces_read_layer(struct surfaces *run, int layer);

/* meshes.c: makes the surfaces of the layer's labels, which are labels[from] and those after. */
bool surfaces_make(struct surfaces *run, size_t from);

/* walls.c: makes the walls of a layer, of its net; mirrored: the axes of the voxels are left-handed. False: memory is short. */
bool surfaces_make_walls(struct surfaces *run, const struct net *net, bool mirrored);
bool surfaces_write_walls(const struct surfaces *run);
void surfaces_free_walls(struct surfaces *run);

/* output.c */
bool surfaces_write(const struct surfaces *run);
bool surfaces_report(const struct surfaces *run, const char *path);
void surfaces_print(const struct surfaces *run);

bool surfaces_fail(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
bool surfaces_no_memory(void);

#endif
