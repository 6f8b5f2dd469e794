/* atlas.h - the pieces of examples/atlas.c: point distribution models made and used by springls (paper, sections 5.6, 5.7).
 *
 * Build: subjects are read as surfaces (subject.c); a template's springls are laid on each of them and keep their
 * identity, so that springl i is the same place everywhere (correspond.c); shapes.h makes modes of that
 * (build.c, report.c). The atlas is kept in two files (file.c). Segment: segment.c.
 *
 * What can fail returns false after one line on stderr. Lengths are mm; patients' axes are RAS+. */
#ifndef EXAMPLES_ATLAS_ATLAS_H
#define EXAMPLES_ATLAS_ATLAS_H

#include "base/cli.h"
#include "imaging/overlap.h"
#include "imaging/volume.h"
#include "shapes/shapes.h"
#include "shapes/surface_fit.h"
#include "springls.h"
#include "surface/surface_distances.h"

enum { ATLAS_MAX_SUBJECTS = 256, ATLAS_MAX_MODES = 64, ATLAS_MAX_LANDMARKS = 64 };

struct atlas {
    struct shape_mesh mean;
    struct shape_model model; /* model.mean is mean.positions: borrowed */
    int *regions;             /* label of the region a vertex lies in, 0: none known; never NULL */
    bool oriented;            /* made of label maps: its axes are the patient's, its place is the first subject's */
    double voxel;             /* side of the voxels that its springls were made on */
    double generalization;    /* mean distance of a subject left out from the model of the others; 0: unknown */
    int subjects;
    /* Intensities along the normals, when images were given: `samples` places a vertex, `spacing` apart, the middle one on
     * the surface; means and deviations of intensities scaled to mean 0 and deviation 1 over each image. */
    int samples;
    double spacing;
    float *profiles, *spreads; /* NULL: none */
};

bool atlas_write(const char *folder, const struct atlas *atlas);
bool atlas_read(const char *path, struct atlas *atlas); /* the .json file */
void atlas_free(struct atlas *atlas);

struct atlas_subject {
    const char *name; /* as on the command line */
    struct shape_mesh mesh;
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

/* "FILE" or "FILE:LABEL[+LABEL..]", "mirror:" before it for its mirror image. images: folder with images of the same names,
 * or the image itself, or NULL. landmarks: folder with files NAME.csv of lines x,y,z, where the mesh or label map is called
 * NAME.anything, or NULL. mirror: x -> -x about the middle of the label map, or of the mesh's box. */
bool atlas_subject_read(const char *name, const char *images, const char *landmarks, bool mirror, struct atlas_subject *subject);
void atlas_subject_free(struct atlas_subject *subject);

/* The label of a place, mm: of the nearest voxel; 0 outside. */
int atlas_label_at(const struct volume *labels, const float place[3]);

/* The springls of a template on a grid about it. */
struct atlas_template {
    struct shape_mesh mesh;
    float *normals;   /* of its vertices */
    bool open;
    double size;      /* shape_size of its vertices */
    double voxel;     /* side, mm */
    int cells;        /* voxels along the longest side */
    springls_context *ctx;
    int *centers, center_count; /* springls that the warps stand on */
    float *center_points, *center_normals;
    float *landmarks; /* 3 each, or NULL: places that all subjects have given */
    int landmark_count;
};

/* With `cut`, closed surfaces are cut afresh by the model's own zero level; open ones keep their triangles. cells: voxels
 * along the longest side; 0: 32, or 64 where the zero level would be a voxel off at more than 0.2 % of the surface's vertices. */
bool atlas_template_create(const struct shape_mesh *from, bool open, bool cut, int cells, const springls_params *params,
                           springls_backend *backend, struct atlas_template *template);
void atlas_template_free(struct atlas_template *template);

/* Lays the template's springls on the subject: subject->pose, shape, distances. */
bool atlas_correspond(struct atlas_template *template, struct atlas_subject *subject, enum orientation orientation);

/* atlas build */
struct atlas_build_settings {
    struct cli_common common;
    const char *names[ATLAS_MAX_SUBJECTS];
    int count;
    const char *images, *landmarks, *orientation;
    int rounds, modes, samples, vertex_landmarks;
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
    springls_backend *backend;
    double seconds, correspond_seconds;
};

bool atlas_build_run(struct atlas_build *build);
bool atlas_build_output(const struct atlas_build *build);
void atlas_build_free(struct atlas_build *build);
/* truth.c. Are all subjects meshes of the same triangles, so that vertex k is the same place on each? */
bool atlas_same_triangles(const struct atlas_build *build);
bool atlas_truth_measure(struct atlas_build *build);

/* ---- intensities: image.c ---- */

/* What of the image lies inside: by a window of intensities, or by the atlas's own profiles. */
struct atlas_view {
    const struct volume *image;
    const struct atlas *atlas;
    bool learned;             /* by profiles; else by the window */
    float low, high, ramp;    /* of the window: 1 where the intensity is inside by more than `ramp`, -1 outside */
    float mean, deviation;    /* of the image's intensities: profiles are compared after scaling these to 0 and 1 */
};

enum { ATLAS_PROFILE_SAMPLES = 9 }; /* a profile: the surface in the middle */

float atlas_intensity(const struct volume *image, const float place[3]); /* trilinear, mm; constant beyond the image */

/* Mean and deviation of an image's intensities, without the lowest and highest 0.5 %. */
void atlas_contrast(const struct volume *image, float *mean, float *deviation);

/* Mean profiles and their deviations, of the subjects' images at their shapes. */
bool atlas_learn(struct atlas_build *build);

/* -1 .. 1: is the intensity at a place, `along` mm outward of the surface at vertex v, that of the inside? */
float atlas_inside(const struct atlas_view *view, int v, float intensity);

/* How badly the image fits a surface with vertex v at `place`, shifted by `shifts` places (`spacing` mm apart) inward to
 * as many outward: costs, 2 shifts + 1 of them; the least one is best. Windows: -1 .. 1. */
void atlas_shift_costs(const struct atlas_view *view, int v, const float place[3], const float normal[3], float spacing,
                       int shifts, float *costs);

/* Mean cost of the mean shape's vertices (at most ATLAS_MAX_FEW) as they lie in a pose. */
enum { ATLAS_MAX_FEW = 200 };
double atlas_surface_cost(const struct atlas_view *view, const struct similarity *pose, const int *vertices, int count,
                          const float *normals, float spacing);

/* ---- laying an atlas on an image: place.c ---- */

struct atlas_placing {
    struct similarity pose;
    double weights[ATLAS_MAX_MODES];
    int modes;
    float *shape; /* the atlas's vertices in the image, mm */
};

/* Rotation, translation and scale from a coarse search over the image. */
bool atlas_place_start(const struct atlas_view *view, struct atlas_placing *placing);
/* Pose, and the first `modes` weights in increasing order, by the best shifts of the vertices along their normals. */
bool atlas_place_refine(const struct atlas_view *view, int modes, struct atlas_placing *placing);

/* ---- atlas segment ---- */

struct atlas_segment_settings {
    struct cli_common common;
    const char *image, *atlas, *reference, *label_text, *beside;
    double level, window[2], ramp, gvf, curvature, leash;
    int frame, modes, steps;
    bool dark, windowed;
};

enum { ATLAS_STAGES = 4 }; /* start, pose, modes, springls */

struct atlas_stage {
    const char *name;
    double seconds;
    bool compared;
    double dice, mean_distance, hd95; /* mm */
};

struct atlas_segment {
    struct atlas_segment_settings settings;
    springls_params params;
    struct atlas atlas;
    struct volume image, reference;
    struct atlas_view view;
    struct atlas_placing placing;
    springls_backend *backend;
    springls_context *ctx;
    struct shape_mesh stages[ATLAS_STAGES], truth;
    struct atlas_stage results[ATLAS_STAGES];
    struct atlas_stage without; /* another program's segmentation of the same image; name NULL: none */
    int *regions; /* of the result's vertices, by their correspondences */
    int steps, springls;
    bool at_rest;
    double seconds;
};

/* file.c. The report.json of build/segment: what one has without an atlas. */
bool atlas_read_without(const char *path, struct atlas_stage *without);
bool atlas_segment_run(struct atlas_segment *run);
bool atlas_segment_mask(const struct atlas_segment *run, int stage, const struct volume *grid, uint8_t *mask); /* 1 inside */
bool atlas_segment_output(const struct atlas_segment *run);
void atlas_segment_free(struct atlas_segment *run);

/* Surface of the labels (count = 0: all but 0) of a label map. all: the map, cropped to them. */
bool atlas_label_surface(const char *path, const int *labels, int count, const char *name, struct volume *part,
                         struct shape_mesh *mesh);
int atlas_read_labels(const char *text, int *labels); /* "K[+K..]": how many, or -1 */
enum { ATLAS_MAX_LABELS = 64 };

/* One line on stderr; false, so that callers can return it. */
bool atlas_fail(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
bool atlas_no_memory(void);
bool atlas_check(const springls_context *ctx, springls_status status, const char *doing);

void atlas_mesh_free(struct shape_mesh *mesh);
bool atlas_mesh_copy(const float *positions, int vertex_count, const int *triangles, int triangle_count, struct shape_mesh *mesh);
struct surface atlas_surface(const struct shape_mesh *mesh, const float *positions); /* positions NULL: the mesh's own */

#endif
