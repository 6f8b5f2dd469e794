/* atlas.h - the pieces of examples/atlas.c: point distribution models made and used by springls (paper, sections 5.6, 5.7).
 *
 * Build: subjects are read as surfaces (atlas_subject.c); a template's springls are laid on each of them and keep their
 * identity, so that springl i is the same place everywhere (atlas_correspond.c); shapes.h makes modes of that
 * (atlas_build.c, atlas_report.c). The atlas is kept in two files (atlas_file.c). Segment: atlas_segment.c.
 *
 * What can fail returns false after one line on stderr. Lengths are mm; patients' axes are RAS+. */
#ifndef EXAMPLES_COMMON_ATLAS_H
#define EXAMPLES_COMMON_ATLAS_H

#include "cli.h"
#include "metrics.h"
#include "shapes.h"
#include "springls.h"
#include "surface_fit.h"
#include "volume.h"

enum { ATLAS_MOST_SUBJECTS = 256, ATLAS_MOST_MODES = 64 };

/* A triangle mesh; arrays from malloc. */
struct atlas_mesh {
    float *positions;
    int *triangles;
    int vertex_count, triangle_count;
};

struct atlas {
    struct atlas_mesh mean;
    struct shape_model model; /* model.mean is mean.positions: borrowed */
    int *regions;             /* label of the region a vertex lies in, 0: none known; never NULL */
    bool oriented;            /* made of label maps: its axes are the patient's, its place is the first subject's */
    double voxel;             /* side of the voxels that its springls were made on */
    int subjects;
    /* Intensities along the normals, when images were given: `samples` places a vertex, `spacing` apart, the middle one on
     * the surface; means and deviations of intensities scaled to mean 0 and deviation 1 over each profile's own surface. */
    int samples;
    double spacing;
    float *profiles, *spreads; /* NULL: none */
};

bool atlas_write(const char *folder, const struct atlas *atlas);
bool atlas_read(const char *path, struct atlas *atlas); /* the .json file */
void atlas_free(struct atlas *atlas);

struct atlas_subject {
    const char *name; /* as on the command line */
    struct atlas_mesh mesh;
    struct target target;
    struct volume labels; /* the part with the label; no data when it was a mesh */
    struct volume image;  /* data: none without --images */
    bool oriented;
    float *landmarks;       /* 3 each, or NULL */
    int landmark_count;
    struct similarity pose; /* template -> subject */
    double cost;            /* of the registration: warp_cost */
    float *shape;           /* the template's vertices on the subject, its own coordinates */
    double mean_distance, largest_distance; /* of these from the surface */
    int steps;
};

/* "FILE" or "FILE:LABEL[+LABEL..]". images: folder with images of the same names, or NULL. landmarks: folder with files
 * NAME.csv of lines x,y,z, where the mesh or label map is called NAME.anything, or NULL. mirror: x -> -x about the middle
 * of the label map, or of the mesh's box. */
bool atlas_subject_read(const char *name, const char *images, const char *landmarks, bool mirror, struct atlas_subject *subject);
void atlas_subject_free(struct atlas_subject *subject);

/* The label of a place, mm: of the nearest voxel; 0 outside. */
int atlas_label_at(const struct volume *labels, const float place[3]);

/* The springls of a template on a grid about it. */
struct atlas_template {
    struct atlas_mesh mesh;
    float *normals;   /* of its vertices */
    bool open;
    double size;      /* shape_size of its vertices */
    double voxel;
    springls_context *ctx;
    int *centers, center_count; /* springls that the warps stand on */
    float *center_points, *center_normals;
    float *landmarks; /* 3 each, or NULL: places that all subjects have given */
    int landmark_count;
};

/* closed surfaces are cut afresh by the model's own zero level on `cells` voxels along the longest side; open ones keep
 * their triangles. */
bool atlas_template_create(const struct atlas_mesh *from, bool open, bool cut, int cells, const springls_params *params,
                           struct atlas_template *template);
void atlas_template_free(struct atlas_template *template);

/* Lays the template's springls on the subject: subject->pose, shape, distances. */
bool atlas_correspond(struct atlas_template *template, struct atlas_subject *subject, enum orientation orientation);

/* atlas build */
struct atlas_build_settings {
    struct cli_common common;
    const char *names[ATLAS_MOST_SUBJECTS];
    int count;
    const char *images, *landmarks, *orientation;
    int rounds, modes, samples;
    bool keep_scale, mirror;
};

/* How far true corresponding points are from where the correspondences take them. */
struct atlas_truth {
    bool known;                         /* all subjects are meshes of the same triangles */
    double mean, deviation, p95, worst; /* model -> subject */
    double between_mean, between_p95;   /* subject -> subject, all ordered pairs */
    double rigid_mean;                  /* without the springls: nearest places after the alignment */
};

struct atlas_build {
    struct atlas_build_settings settings;
    springls_params params;
    struct atlas_subject *subjects;
    float **shapes; /* aligned */
    struct atlas_template template;
    struct atlas atlas;
    struct shape_curves curves;
    struct atlas_truth truth;
    double seconds, correspond_seconds;
};

bool atlas_build_run(struct atlas_build *build);
bool atlas_build_output(const struct atlas_build *build);
void atlas_build_free(struct atlas_build *build);
bool atlas_truth_measure(struct atlas_build *build); /* atlas_truth.c */

/* One line on stderr; false, so that callers can return it. */
bool atlas_fail(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
bool atlas_no_memory(void);
bool atlas_check(const springls_context *ctx, springls_status status, const char *doing);
bool atlas_may_print(const struct cli_common *common);

void atlas_mesh_free(struct atlas_mesh *mesh);
bool atlas_mesh_copy(const float *positions, int vertex_count, const int *triangles, int triangle_count, struct atlas_mesh *mesh);
struct surface atlas_surface(const struct atlas_mesh *mesh, const float *positions); /* positions NULL: the mesh's own */

#endif
