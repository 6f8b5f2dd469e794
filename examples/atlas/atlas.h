/* atlas.h - the parts of the program atlas: point distribution models built with springls and fitted to images (paper,
 * sections 5.6 and 5.7).
 *
 * Build: reads subjects as surfaces (subject.c), lays the springls of a template on each of them, where they keep their
 * identity, so that springl i is the same place on every subject (correspond.c), computes the modes (shapes.h) and reports
 * (build.c, report.c). An atlas is stored in two files (file.c). Segment: segment.c.
 *
 * A function that can fail returns false after one line on stderr. Lengths are mm; patients' axes are RAS+. */
#ifndef EXAMPLES_ATLAS_ATLAS_H
#define EXAMPLES_ATLAS_ATLAS_H

#include "atlas/fusion.h"

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
    struct shape_model model; /* model.mean points to mean.positions */
    uint32_t *regions;        /* label of each vertex's region, 0: unknown; never NULL */
    bool oriented;            /* built from label maps: its axes are the patient's and it lies where the first subject lies */
    double voxel;             /* side of the voxels of the model that its springls lived on */
    double generalization;    /* mean distance of a left-out subject from the model of the others; 0: unknown */
    int subjects;
    /* Intensity profiles along the normals, when there were images: `samples` values a vertex, `spacing` mm apart, the middle
     * one on the surface; mean and deviation over the subjects, after each image was scaled to mean 0 and deviation 1. */
    int samples;
    double spacing;
    float *profiles, *spreads; /* NULL: none */
    /* The subjects' images and masks, when there were images of several: see fusion.h. */
    struct fusion_template templates[FUSION_MAX_TEMPLATES];
    int template_count;
    uint32_t label_ids[FUSION_MAX_LABELS]; /* of the templates' labels, number 1 first */
};

bool atlas_write(const char *folder, const struct atlas *atlas);
bool atlas_read(const char *path, struct atlas *atlas); /* reads the .json file and the raw file beside it */
void atlas_free(struct atlas *atlas);

struct atlas_subject {
    const char *name; /* as on the command line */
    struct shape_mesh mesh;
    struct target target;
    struct volume labels; /* cropped to the subject's label; no data when the subject is a mesh */
    uint32_t *label_ids;  /* NULL: `labels` has the labels; else the label of each number from 1 that it has instead */
    struct volume image;  /* no data without --images */
    bool oriented;
    float *landmarks;       /* 3 each, or NULL */
    int landmark_count;
    struct similarity pose; /* template -> subject */
    double cost;            /* of the registration, by warp_cost */
    float *shape;           /* the template's vertices on the subject, in the subject's coordinates */
    float *particles;       /* of the template's springls on the subject; NULL: vertices were given */
    double mean_distance, largest_distance; /* of `shape` from the subject's surface */
    int steps;
};

/* Reads a subject: "FILE" or "FILE:LABEL[+LABEL..]", with "mirror:" before it for its mirror image. images: a folder with
 * images of the same names, or the image itself, or NULL. landmarks: a folder with files NAME.csv of lines x,y,z for a mesh or
 * label map NAME.anything, or NULL. mirror: reflects x about the middle of the label map or of the mesh's box. */
bool atlas_subject_read(const char *name, const char *images, const char *landmarks, bool mirror, struct atlas_subject *subject);
void atlas_subject_free(struct atlas_subject *subject);

/* Removes closed parts and cavities of less than a hundredth of the volume from a mesh: what is scattered about an object
 * corresponds to nothing. Returns how many, -1: memory. */
int atlas_drop_specks(struct shape_mesh *mesh);

/* Copies the `dims` voxels of a volume that begin at voxel `lo`, in the same world places; beyond the volume they are 0. */
bool atlas_crop(const struct volume *from, const int lo[3], const int dims[3], struct volume *part);

/* Returns the label of the voxel of a subject's map that is nearest to a place in mm, 0 outside. */
uint32_t atlas_label_at(const struct atlas_subject *subject, const float place[3]);

/* The springls of a template on a grid around it. */
struct atlas_template {
    struct shape_mesh mesh;
    float *normals;   /* of its vertices */
    bool open;
    double size;      /* shape_size of its vertices */
    double voxel;     /* side, mm */
    int cells;        /* voxels along the longest side */
    springls_context *ctx;
    int *centers, center_count; /* springls at which the warps are centered */
    float *center_points, *center_normals;
    float *landmarks; /* 3 each, or NULL: landmarks that every subject has */
    int landmark_count;
};

/* Makes the template's model. With `cut`, closed surfaces get new triangles from the model's own zero level; open ones keep
 * theirs. cells: voxels along the longest side; 0: 32, or 64 where the zero level would miss more than 0.2 % of the surface's
 * vertices by a voxel or more. */
bool atlas_template_create(const struct shape_mesh *from, bool open, bool cut, int cells, const springls_params *params,
                           springls_backend *backend, struct atlas_template *template);
void atlas_template_free(struct atlas_template *template);

/* Lays the template's springls on the subject and fills in subject->pose, shape and distances. */
bool atlas_correspond(struct atlas_template *template, struct atlas_subject *subject, enum orientation orientation);

/* atlas build */
struct atlas_build_settings {
    struct cli_common common;
    const char *names[ATLAS_MAX_SUBJECTS];
    int count;
    const char *images, *landmarks, *orientation;
    int rounds, modes, samples, vertex_landmarks, templates;
    bool keep_scale, mirror, any_side;
    bool same_vertices;  /* vertex k of each mesh is the same place: nothing is fitted */
    bool folder;         /* subjects are the files of a folder, without mirror:FILE */
    const char *extends; /* atlas add: the atlas.json whose vertices these are */
};

/* Errors of the correspondences where the true ones are known, mm. */
struct atlas_truth {
    bool known;                         /* all subjects are meshes with the same triangles */
    double mean, deviation, p95, worst; /* from the model to each subject */
    double between_mean, between_p95;   /* between two subjects, over all ordered pairs */
    double rigid_mean;                  /* without springls: nearest places after the rigid alignment */
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
/* Returns true if all subjects are meshes with the same triangles, so that vertex k is the same place on each (truth.c). */
bool atlas_same_triangles(const struct atlas_build *build);
bool atlas_truth_measure(struct atlas_build *build);
bool atlas_subjects_read(struct atlas_build *build);
/* Returns false, after one line, where label maps of both sides of the body are subjects, four or more of them (sides.c). */
bool atlas_sides_agree(const struct atlas_build *build);
/* Computes mean, modes, regions and profiles from the subjects' shapes (build.c). */
bool atlas_model_make(struct atlas_build *build);
/* Registers the subjects' images to some of them, without learning a correction (templates.c). */
bool atlas_templates_make(struct atlas_build *build);
/* Chooses templates of different sizes: in order of volume, the subjects in the middle of equal parts. */
void atlas_templates_choose(const struct atlas_build *build, int wanted, int *chosen);

/* ---- correspondences on disk: points.c ---- */

/* Write NAME.ply and NAME.csv: the atlas's vertices on a subject, or the particles of its springls, each with its place on the
 * mean shape. */
bool atlas_write_vertices(const char *folder, const char *name, const struct shape_mesh *mean, const float *shape);
bool atlas_write_particles(const char *folder, const char *name, const struct shape_mesh *mean, const float *particles);
/* Writes weights.csv: a line of mode weights, in deviations, for each aligned shape. */
bool atlas_write_weights(const char *folder, const struct atlas *atlas, const char *const *names, float *const *shapes, int count);
/* Makes a subject's name for files, such as 002_a from "scans/a.nii.gz:3". */
void atlas_short_name(const char *name, int number, char *text, size_t size);

/* ---- atlas add: add.c ---- */

/* Puts the meshes that `atlas build` has written beside an atlas before those of build->settings, and runs: all have the atlas's
 * vertices. Regions, intensities and votes stay those of the atlas. */
bool atlas_add_run(struct atlas_build *build);

/* ---- atlas leave-one-out: leave_one_out.c ---- */

struct atlas_trial_settings {
    struct cli_common common;
    const char *folder; /* with images and labels of the same names */
    int templates, first, every; /* leaves out subjects first, first + every, ... */
    bool profiles;               /* segments also by intensities along the normals */
    bool any_side;               /* takes label maps of both sides of the body */
};

bool atlas_leave_one_out(const struct atlas_trial_settings *settings, const springls_params *params);

/* ---- intensities: image.c ---- */

/* Which intensities belong to the inside: those of a window, or those of the atlas's own profiles. */
struct atlas_view {
    const struct volume *image;
    const struct atlas *atlas;
    bool learned;             /* use profiles; else the window */
    float low, high, ramp;    /* the window: 1 where the intensity is inside by more than `ramp`, -1 outside */
    float mean, deviation;    /* of the image's intensities, by which profiles are scaled to mean 0 and deviation 1 */
};

enum { ATLAS_PROFILE_SAMPLES = 9 }; /* values of a profile, the surface in the middle */

float atlas_intensity(const struct volume *image, const float place[3]); /* trilinear, mm; constant beyond the image */

/* Refuses a constant image. */
bool atlas_image_varies(const struct volume *image, const char *path);

/* Computes mean and deviation of an image's intensities without the lowest and the highest 0.5 %. */
void atlas_contrast(const struct volume *image, float *mean, float *deviation);

/* Learns mean profiles and their deviations from the subjects' images. */
bool atlas_learn(struct atlas_build *build);

/* Rates an intensity at vertex v of the surface from -1 (outside) to 1 (inside). */
float atlas_inside(const struct atlas_view *view, int v, float intensity);

/* Computes how badly the image fits a surface whose vertex v lies at `place`, for the places shifted along the normal by
 * -shifts .. shifts times `spacing` mm: 2 shifts + 1 costs, the smallest is the best. With a window costs are -1 .. 1. */
void atlas_shift_costs(const struct atlas_view *view, int v, const float place[3], const float normal[3], float spacing,
                       int shifts, float *costs);

/* Returns the mean cost of a few vertices of the mean shape (at most ATLAS_MAX_FEW) in a pose. */
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

/* Searches the image coarsely for rotation, translation and scale. */
bool atlas_place_start(const struct atlas_view *view, struct atlas_placing *placing);
/* Refines the pose and the first `modes` weights, in increasing order, by the best shifts of the vertices along their normals. */
bool atlas_place_refine(const struct atlas_view *view, int modes, struct atlas_placing *placing);

/* ---- atlas segment ---- */

struct atlas_segment_settings {
    struct cli_common common;
    const char *image, *series, *atlas, *reference, *label_text, *beside, *fit;
    double level, window[2], ramp, gvf, curvature, leash;
    int frame, modes, steps;
    bool dark, windowed;
    const char *of_profiles; /* an option that was given, which votes have no use for; NULL: none */
};

enum { ATLAS_STAGES = 4 }; /* start, pose, modes, springls; with templates: start, registration, fusion, springls */

struct atlas_stage {
    const char *name;
    double seconds;
    bool compared;
    double dice, mean_distance, hd95; /* mm */
    double volume_ratio;              /* to the reference */
};

/* What speaks against a result. */
enum atlas_doubt {
    ATLAS_TRUSTED,
    ATLAS_DISAGREES, /* the image agrees too little to be of the subjects' kind */
    ATLAS_MIRRORED,  /* it agrees clearly more when left and right change places */
    ATLAS_INVERTED,  /* or bright and dark */
    ATLAS_SIZE       /* what was found is much smaller or larger than the subjects */
};

/* How far the subjects' votes on an image are to be trusted (confidence.c). */
struct atlas_confidence {
    bool known;              /* the subjects have voted */
    bool searched;           /* the place is the best of all in a much larger image */
    double agreement;        /* correlation of the image with what the subjects expect */
    double least, most;      /* of the subjects themselves, each one voted on by the others */
    double dice, dice_error; /* predicted, and how far such predictions are off for the subjects; NaN: it disagrees */
    double label_dice[FUSION_MAX_LABELS], label_deviation[FUSION_MAX_LABELS]; /* of the subjects' labels, voted on by the others */
    enum atlas_doubt doubt;
    double changed;          /* agreement when mirrored or inverted */
    double volume, smallest, largest; /* of what was found, and the limits of what is believed; mm^3 */
};

/* Judges an image by its agreement with a template's subjects. */
bool atlas_judge(const struct fusion_template *template, double agreement, struct atlas_confidence *confidence);
/* Returns true if an agreement is too low for an image of the subjects' kind. */
bool atlas_disagrees(double agreement, const struct atlas_confidence *confidence);

/* One label of the result. */
struct atlas_part {
    uint32_t label;
    double volume; /* ml */
    double dice;   /* with the reference; NaN: there is none, --label leaves it out, or neither has this label */
};

struct atlas_segment {
    struct atlas_segment_settings settings;
    springls_params params;
    struct atlas atlas;
    struct volume image, reference;
    struct volume part; /* of the image, around the object: what atlas_find looks at; else empty */
    struct atlas_view view;
    struct atlas_placing placing;
    springls_backend *backend;
    springls_context *ctx;
    struct fusion_map maps[FUSION_MAX_TEMPLATES]; /* to the atlas's templates */
    float *probabilities[FUSION_MAX_TEMPLATES];   /* on the templates' grids */
    float *shares[FUSION_MAX_TEMPLATES];          /* of the labels there: fusion_votes.shares; NULL: one label */
    struct atlas_part parts[FUSION_MAX_LABELS];
    int part_count;                               /* 0: the subjects have one label, or none vote */
    float trust[FUSION_MAX_TEMPLATES];            /* weights of the templates; their sum is 1 */
    struct atlas_confidence confidence;
    int begin;                                    /* stage from which the springls start: a shape with the atlas's vertices */
    bool fused;
    struct shape_mesh stages[ATLAS_STAGES], truth;
    struct atlas_stage results[ATLAS_STAGES];
    struct atlas_stage without; /* another program's result for the same image; name NULL: none */
    uint32_t *regions; /* labels of the result's vertices, by their correspondences */
    float *vertices; /* the atlas's vertices on the result */
    int steps, springls;
    bool at_rest;
    double seconds;
};

/* Reads the report.json of build/segment, the result without an atlas (file.c). */
bool atlas_read_without(const char *path, struct atlas_stage *without);
bool atlas_segment_run(struct atlas_segment *run);
/* The same with run->atlas already there. */
bool atlas_segment_image(struct atlas_segment *run);

/* Returns true if the image agrees with the first template without any move, and sets run->placing to the atlas as it lies
 * there. */
bool atlas_lies_near(struct atlas_segment *run);
/* Returns true if the image shows much more than the templates' images do, such as a whole head. */
bool atlas_shows_much_more(const struct atlas_segment *run);
/* Finds the object in such an image, and sets run->placing and run->part. Refuses the image where nothing in it looks like a template
 * (segment_find.c). */
bool atlas_find(struct atlas_segment *run);
/* Returns what the subjects vote on: the image, or its part around the object. */
const struct volume *atlas_seen(const struct atlas_segment *run);
/* Registers the image to the templates and lets the subjects vote: fills run->maps and run->probabilities, and gives the
 * atlas's shape in the image (segment_fusion.c). */
bool atlas_fuse(struct atlas_segment *run, float *shape);
/* Chooses the shift from a template to an image: none, or that of the atlas's place in the image. */
void atlas_choose_shift(const struct atlas_segment *run, const struct volume *image, const struct fusion_template *template,
                        float shift[3]);
/* Finds out why an image agrees less with a template's subjects than they do (segment_doubt.c). */
bool atlas_explain(struct atlas_segment *run, const struct fusion_template *template);
/* Compares the size of what was found with the subjects'. */
void atlas_check_size(struct atlas_segment *run);
/* Returns false, after one line, where the result is not to be trusted. */
bool atlas_is_trusted(const struct atlas_segment *run);
/* Returns the probability of being inside minus the level at which volumes are right. */
float atlas_fused_at(const struct atlas_segment *run, const float place[3]);

/* Returns the label that has the largest share of the subjects' votes at a place, 0: they have one label, or nobody has the place. */
uint32_t atlas_voted_label(const struct atlas_segment *run, const float place[3]);
/* Computes the label of each voxel of a grid, 0 outside of the result. */
bool atlas_segment_labels(const struct atlas_segment *run, const struct volume *grid, uint32_t *labels);
/* Measures the parts of the result, where subjects vote on labels: run->parts. */
bool atlas_measure_parts(struct atlas_segment *run);
bool atlas_segment_mask(const struct atlas_segment *run, int stage, const struct volume *grid, uint8_t *mask); /* 1 inside */
bool atlas_segment_output(const struct atlas_segment *run);
void atlas_segment_free(struct atlas_segment *run);

/* Extracts the surface of some labels of a label map (count = 0: all but 0). all: receives the map, cropped to them. */
bool atlas_label_surface(const char *path, const int *labels, int count, const char *name, struct volume *part,
                         struct shape_mesh *mesh);
/* Returns params (NULL: the defaults) with meshes of the zero level, which is as smooth as the labels' surface has been made: springls
 * on it show steps of voxels as edges. */
springls_params atlas_smooth_params(const springls_params *params);
int atlas_read_labels(const char *text, int *labels); /* reads "K[+K..]"; returns how many, or -1 */
enum { ATLAS_MAX_LABELS = 64 };

/* Prints one line on stderr and returns false. */
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
