/* morph.h - one animated character becomes another (paper, section 5.8).
 *
 *   read      reads two characters and rescales the source onto the target's skeleton (read.c, skeleton_align.h)
 *   rig       gives a body without bones a donor's skeleton and weights by heat (rig.c)
 *   prepare   makes each a closed body (solid.c) on one grid (prepare.c)
 *   run       runs all frames (run.c), each in three parts:
 *             shape     the level set between the two bodies in the frame's pose (shape.c), along the middles of limbs (rods.c)
 *             skin      a step of linear blend skinning and of the push to that shape (skinning.c), with weights of weights.c
 *             contour   active contours where the model lags (contour.c)
 *   measure   compares frame and end with the target (measure.c)
 *   look      colors and weights that fade into the target's, and textures of them (look.c)
 *   output    writes glTF (gltf.c), pictures and report (output.c) */
#ifndef EXAMPLES_MORPH_MORPH_H
#define EXAMPLES_MORPH_MORPH_H

#include "character/heat_weights.h"
#include "character/skeleton_align.h"
#include "character/solid_voxels.h"
#include "character/surface_place.h"
#include "pictures/raycast.h"
#include "springls/run_options.h"
#include "surface/textured_mesh.h"
#include "surface/mesh_check.h"
#include "surface/surface_distances.h"

/* Parameters that differ from the default. Edges of the source are not kept, since they are not the target's; springls are
 * resampled every second step: after five, those of a growing limb are so far apart that it tears. */
#define MORPH_SET "keep_edges=0,resample_period=2,contouring=0"

enum { MORPH_MAX_FRAMES = 1000, MORPH_SPECK = 27 };

struct morph_settings {
    struct cli_common common;
    const char *source, *target, *animation, *map, *props, *donor, *overrides;
    int frames;      /* at most */
    int fps;
    int iterations;  /* of the active contour a frame, at least */
    float pace;      /* motion of the contour by pressure in an iteration, voxels, at most */
    int blend;       /* frames in which the source becomes the target */
    float thicken;   /* voxels: sheets become solids of this thickness; 0: they are left out; negative: 1, with a note */
    float limbs;     /* voxels: thickness that thin limbs and sheets get; 0: they stay as they are */
    int reach;       /* voxels: longest bridge to a body of a character that touches nothing */
    int size;        /* pixels of a picture's height */
    int texture;     /* texels of a frame's texture a side; 0: colors at vertices */
    float view[3];   /* from the body to the eye */
    bool list, preserve, weights;
    bool channel;    /* bone weights are an attribute channel too, to compare it with their look-up */
};

/* Figures of making a closed body from a character's triangles. */
struct morph_solid {
    int boundary_edges, nonmanifold_edges, input_components; /* of the triangles, with equal points joined */
    int sheet_triangles; /* without an inside */
    float thickened;     /* voxels: their thickness now, 0: left out or none */
    int thin;            /* voxels by which thin limbs and sheets have become thicker */
    int filled;          /* voxels of closed cavities, which become inside */
    int found, joined;   /* separate bodies, and those that a bridge connects with the largest one */
    int tunnels, cut;    /* voxels that close small tunnels, and those that are taken out of other handles */
    int dropped_voxels;  /* of bodies left out: less than 1/1000 of the volume each */
};

struct morph_body {
    struct character character;
    struct places places;
    struct morph_solid solid;
    springls_mesh mesh;            /* the closed body in the neutral pose */
    struct mesh_check check;       /* of that mesh */
    struct influences *influences; /* one a vertex of it */
    float *pulls;                  /* of the character's vertices: where limbs shrink that the other lacks */
    float *mesh_pulls;             /* of the mesh's vertices */
    bool has_alone;                /* it has limbs that the other lacks */
    float *posed;                  /* its vertices in the present pose */
};

/* Returns how many handles the surface has that was checked. */
static inline int morph_handles(const struct mesh_check *check) { return check->components - check->euler / 2; }

/* The model after one frame. */
struct morph_frame {
    springls_mesh mesh;
    struct mesh_check check;
    int specks;           /* components of less than MORPH_SPECK voxels, left out of the mesh */
    float share;          /* of the target in colors and weights, 0..1 */
    float *colors;        /* by vertex */
    float *targets;       /* by vertex: the nearest place of the target, in its neutral pose */
    double weight_error;  /* largest |sum of bone weights - 1| of its vertices */
    double volume;        /* of the mesh, voxels */
    double distance;      /* mean |target's signed distance| of particles, voxels */
    double stray;         /* largest of these, voxels */
    double missing;       /* mean |model's signed distance| of vertices of the target's zero level, voxels */
    double worst;         /* largest of those, voxels; at most the narrow band */
    double far;           /* share of the target's vertices that are more than a voxel from the model */
    double limb;          /* thickness of the limb that is thinnest beside the thinner of both bodies, as a share of that one's */
    int limb_joint;       /* the joint that moves it, -1: none is thinner */
    double seconds, seconds_skinning, seconds_contour, seconds_target; /* skinning: with the first iteration of the contour */
    int springls, steps; /* steps: of the model, sub-steps counted */
    int64_t split, added, removed;
};

/* A place in the middle of a limb, in the neutral pose, and the rod that ends there. */
struct rod_place {
    int joint;          /* which moves it */
    int before;         /* the place where the rod begins, -1: none ends here */
    int root;           /* the joint out of which its limb grows, -1: both bodies have it */
    float middle[2][3]; /* of the source's limb and of the target's, voxels */
    float radius[2];    /* voxels, 0: the body is not there */
    float depth[2];     /* voxels: how deep its cross-section is, at most half the narrow band; 0: at a joint, or the body is not there */
};

struct rods {
    struct rod_place *places; /* first those of the target's joints */
    int place_count, place_room;
};

/* Bone weights of the source's surface at a correspondence. */
struct cached_weights {
    float correspondence[3];
    bool used;
    struct influences influences;
};

struct morph {
    struct morph_settings settings;
    springls_params params;
    struct morph_body source, target;
    int animation; /* of the target's skeleton */
    struct alignment alignment;
    struct rods rods;
    springls_grid_desc grid;
    springls_context *ctx, *other; /* the model; the posed target */
    springls_backend *backend;
    float *pressure, *shape, *source_phi, *target_phi; /* dense volumes, voxels; shape: the level set wanted in this frame */
    unsigned char *limbs; /* of each voxel: 1 where the middle of a limb is in the present pose */
    float *way; /* of each voxel, 3: the velocity to where the model lags */
    int *source_nearest, *target_nearest; /* triangle of the posed body nearest to each voxel, -1: none near */
    int *nearest_before;                  /* target_nearest in the pose before */
    struct cached_weights *cache; /* a hash table by correspondence, of cache_room places; `cached` are used */
    size_t cache_room;
    int cached;
    struct affine *skin, *skin_before, *skin_places;
    struct morph_frame *frames, rest; /* rest: the end in the neutral pose, for --out */
    int frame_count;
    int coincided; /* the first frame in which the two coincide, -1: never */
    springls_mesh target_mesh; /* zero level of the target in the last frame's pose, without self-intersections */
    struct surface_distances end; /* from the last frame to the target, world units */
    double channel_sum_error;     /* bone weights carried as a channel: largest |sum - 1| at the end */
    double channel_difference;    /* mean L1 distance of these from the weights looked up by correspondence */
    double weight_difference;     /* mean L1 distance of the last frame's bone weights from the target's at the nearest place */
};

/* Returns the pressure of the active contour where the shape's signed distance is phi: minus that, at most the pace. */
static inline float morph_pressure(const struct morph *morph, float phi)
{
    const float pace = morph->settings.pace;
    return phi > pace ? -pace : phi < -pace ? pace : -phi;
}

/* The closed surface of a body and weights on it. */
struct rig_mesh {
    float *positions, *normals;
    int *triangles;
    int vertex_count, triangle_count;
    struct influences *influences;
    struct heat_report heat;
    double fit_distance; /* of the donor's surface from the body's, mean */
};

/* ---- messages.c: each prints one line on stderr and returns false; morph_check only where status is bad ---- */

bool morph_fail(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;
bool morph_no_memory(void);
bool morph_check(springls_context *ctx, springls_status status, const char *what);

/* Returns what messages and reports call a character: its file, if it has one. */
static inline const char *morph_name(const char *path) { return path ? path : "built in"; }

/* ---- read.c ---- */

/* Reads both characters of the settings, and aligns the source with the target's skeleton. */
bool morph_read(struct morph *morph);
bool morph_read_donor(const char *path, struct character *donor); /* fails where no part has bones */
/* Checks that each name of --props is part of that of a rigid part of either character. */
bool morph_check_props(const char *names, const struct character *one, const struct character *other);

/* ---- prepare.c ---- */

bool morph_prepare(struct morph *morph); /* makes all that a run needs of what morph_read has read */
void morph_free(struct morph *morph);
size_t morph_voxel_count(const struct morph *morph);
void morph_pose(struct morph *morph, int frame, double blend); /* sets morph->skin; blend: 0 the neutral pose, 1 the frame's */
/* Makes a grid around a box by solid_grid_around. */
bool morph_grid_around(const float lo[3], const float hi[3], int cells, springls_grid_desc *grid);
/* Returns true if a triangle of a body belongs to a limb that the other lacks. */
bool morph_is_alone(const struct morph *morph, const struct morph_body *body, int triangle);

/* ---- solid.c ---- */

void morph_to_voxel(const springls_grid_desc *grid, const float world[3], float voxel[3]); /* world = voxel is allowed */
struct solid_grid morph_voxels(const springls_grid_desc *grid);
/* Makes a closed body of the character on the context's grid and sets the model to its level set. path: its file, for messages. */
bool morph_solid_make(const struct morph *morph, springls_context *ctx, const springls_grid_desc *grid, const char *path,
                      const struct character *character, struct morph_solid *solid);

/* ---- rig.c ---- */

/* Computes bone weights for a body without any, from its own skeleton or a donor's that is fitted into it. path: the body's file,
 * for messages. Call morph_rig_free(mesh) afterwards. */
bool morph_rig(const struct morph *morph, const char *path, struct character *body, const struct character *donor,
               struct rig_mesh *mesh);
void morph_rig_free(struct rig_mesh *mesh);
bool morph_weights(const struct morph *morph); /* runs --weights: computes them and writes pictures, glTF and report */

/* ---- rods.c ---- */

bool morph_make_rods(struct morph *morph); /* of both bodies, while the contexts have their level sets in the neutral pose */
/* Unites a level set with balls along a way in voxels, whose radius changes evenly. */
void morph_add_rod(const int size[3], float *phi, const float from[3], const float to[3], float radius, float radius_to);
/* Unites a level set with the rods in the present pose. part: 0 the source, 1 the target. */
void morph_add_rods(const struct morph *morph, float part, float *phi);
void morph_mark_limbs(struct morph *morph, float part); /* sets morph->limbs along them */
/* Compares the model's limbs in the present pose, by its level set, with those of both bodies in the neutral pose, place by place along
 * the bones that both have. Returns the least share of the thinner body's thickness, at most 1. *joint: the bone's, -1: none. */
float morph_thinnest_limb(const struct morph *morph, float part, const float *model, int *joint);

/* ---- run.c, shape.c, skinning.c, contour.c ---- */

bool morph_run(struct morph *morph); /* all frames, and for --out the neutral pose at the end */
/* Computes morph->shape, the signed distance of the body between the two in the present pose. part: 0 the source, 1 the target. */
bool morph_shape(struct morph *morph, float part);
/* Samples a dense level set at a place in voxel coordinates, trilinearly. */
float morph_sample(const int size[3], const float *phi, const float place[3]);
/* Moves the model from the pose before to the present one, and towards morph->shape. part: of the target in the shape before. */
bool morph_skin(struct morph *morph, float part);
/* Pushes the model to morph->shape by active contours, and joins its parts. last: as long as that gains anything. */
bool morph_contour(struct morph *morph, bool last);

/* ---- weights.c ---- */

/* Computes the weights of those springls that are new: few in a frame, and a step looks each up several times. */
bool morph_cache_weights(struct morph *morph);
struct influences morph_springl_weights(const struct morph *morph, const float correspondence[3]);
/* Adds the same weights as an attribute channel, which is blended where springls split and fill; compares it with the look-up. */
bool morph_add_channels(struct morph *morph);
bool morph_compare_channels(struct morph *morph);
/* Compares the final bone weights with those of the target's artist at the same place. */
void morph_compare_weights(struct morph *morph);

/* Returns the values of a springl in a view. */
static inline const float *morph_springl_item(springls_view view, int index)
{
    return (const float *)(const void *)((const char *)view.data + (size_t)index * view.stride);
}

/* ---- measure.c ---- */

bool morph_measure(const struct morph *morph, struct morph_frame *frame); /* extracts the frame's mesh too */
bool morph_compare_ends(struct morph *morph); /* the last frame's mesh with the target's */

/* ---- look.c ---- */

/* Checks the sums of bone weights; for --out computes colors and places of a frame's mesh, whose pose the target has. */
bool morph_look(const struct morph *morph, struct morph_frame *frame);
/* Checks that both bodies' charts fit into an image of --texture texels a side, before the work. */
bool morph_texture_suffices(const struct morph *morph);
struct influences morph_mixed_influences(const struct morph *morph, const struct morph_frame *frame, int vertex);
/* Cuts a frame's mesh into charts and bakes its colors, by textured_mesh_make. */
bool morph_bake(const struct morph *morph, const struct morph_frame *frame, const struct gltf_mesh *surface, int size, int material,
                struct textured_mesh *textured);

/* ---- output.c, gltf.c ---- */

bool morph_write(const struct morph *morph); /* writes all files of --out */
bool morph_write_gltf(const struct morph *morph);
bool morph_report(const struct morph *morph, const char *path);
void morph_print(const struct morph *morph);

#endif
