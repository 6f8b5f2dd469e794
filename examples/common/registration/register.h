/* register.h - deformable registration of two images: an affine map by Gauss-Newton, then symmetric log-domain diffeomorphic
 * demons on a pyramid of grids.
 *
 *   T. Vercauteren, X. Pennec, A. Perchant, N. Ayache: Diffeomorphic demons: efficient non-parametric image registration,
 *   NeuroImage 45, 2009; and Symmetric log-domain diffeomorphic registration: a demons-based approach, MICCAI 2008.
 *
 * The result maps points of the fixed image to the moving one: x -> A(exp(v)(x)) with a stationary velocity v. Its inverse is
 * x -> exp(-v)(A^-1(x)), and exp(v/K) applied K times is exp(v), so a motion can be divided into steps. */
#ifndef EXAMPLES_REGISTRATION_REGISTER_H
#define EXAMPLES_REGISTRATION_REGISTER_H

#include "imaging/volume.h"
#include "registration/field.h"
#include "registration/relation.h"

enum register_align { REGISTER_ALIGN_NONE, REGISTER_ALIGN_TRANSLATION, REGISTER_ALIGN_RIGID, REGISTER_ALIGN_AFFINE };
enum register_similarity {
    REGISTER_SSD,  /* sum of squared differences, of intensities that are brought to one scale (relation.h) */
    REGISTER_LCC,  /* local correlation: SSD after subtracting the local mean and dividing by the local deviation */
    REGISTER_MIND, /* SSD of self-similarity descriptors: M. P. Heinrich et al., MIND: modality independent neighbourhood
                      descriptor, Medical Image Analysis 16, 2012 */
    REGISTER_AUTO  /* SSD; without the shading of one image where there is some; MIND where intensities do not go together */
};

/* Where the alignment begins. The candidates are improved on the coarsest grid; the one of the highest correlation is taken, and
 * another than the world coordinates only where its correlation is higher by .02. */
enum register_start {
    REGISTER_START_CENTERS, /* the world coordinates of the files, or the centres of mass laid on each other */
    REGISTER_START_HEADERS, /* the world coordinates alone */
    REGISTER_START_SEARCH   /* also the principal axes laid on each other, and the 24 rotations of a cube: any position */
};

enum { REGISTER_MAX_LEVELS = 6, REGISTER_MIN_CELLS = 16 };

struct register_settings {
    enum register_align align;
    enum register_start start; /* not for REGISTER_ALIGN_NONE; rotations not for REGISTER_ALIGN_TRANSLATION */
    enum register_similarity similarity;
    bool one_scale;        /* equal tissue has equal intensity in both; false: detected, or scales are matched */
    bool one_sided;        /* forces of the fixed image's side only: half the time, but not symmetric */
    int levels;            /* grids, each twice as fine as the one before; 0: as many as leave REGISTER_MIN_CELLS voxels a side */
    int iterations;        /* maximum on each grid */
    float update_sigma;    /* Gaussian of the update ("fluid") and of the velocity ("elastic"), voxels of the grid */
    float velocity_sigma;
    float longest_update;  /* voxels an iteration */
};

struct register_settings register_defaults(void);

struct register_level {
    float side; /* mm */
    int iterations;
    double start, end; /* mean squared difference of the normalized images */
};

struct registration {
    struct volume grid;                  /* cubes over the fixed image; no data */
    float *velocity, *forward, *inverse; /* v, exp(v), exp(-v): 3 a voxel, in voxels of the grid */
    double affine[3][4];                 /* A, world mm */
    double affine_inverse[3][4];
    struct register_level levels[REGISTER_MAX_LEVELS];
    enum register_similarity similarity; /* what was used: never REGISTER_AUTO */
    struct relation relation;            /* of the intensities, on the finest grid of REGISTER_SSD */
    bool shaded;                         /* REGISTER_SSD compared the images after removing the shading of one of them */
    bool headers_apart;                  /* the images do not overlap where their headers place them */
    int mirrored;                        /* REGISTER_AUTO: 1 + the world axis along which the moving image fits clearly better when
                                            it is mirrored; 0: as it is */
    double as_it_is, in_mirror;          /* how well: the root of the share of variance that goes together */
    int level_count;                     /* levels[0] is the finest */
};

/* Registers two images. A voxel that is NaN has no data: it takes no part. start: a registration of the same fixed image whose velocity is
 * the first guess, or NULL. Returns false with an empty *result if memory is short, an image is constant or flat, or the two do not
 * overlap, with the reason in `error`. */
bool register_images(const struct volume *fixed, const struct volume *moving, const struct register_settings *settings,
                     const struct registration *start, struct registration *result, char error[VOLUME_TEXT]);
void registration_free(struct registration *registration);

/* Divides a motion into equal substeps: applying *substep `substeps` times gives the whole map. Only for a registration
 * without an affine map; free *substep like any other. Returns false if memory is short. */
bool registration_substep(const struct registration *registration, int substeps, struct registration *substep);

/* The map and its inverse as field_map_fn. */
void registration_map(const void *registration, const float *points, size_t count, float *mapped);
void registration_map_back(const void *registration, const float *points, size_t count, float *mapped);

/* ---- building blocks ---- */

/* Finds the intensities that become 0 and 1, the 0.5th and the 99.5th percentile. Returns false if the image is constant. */
struct register_window {
    float low, high;
};
bool register_window_of(const struct volume *image, struct register_window *window);

/* Finds the map from the world of `fixed` to that of `moving` at which the alignment begins (register_start.c): affine, relation,
 * headers_apart and mirrored of *result. *overlap: false where no candidate lays enough of the images on each other. Values as for
 * register_affine. Returns false if memory is short. */
bool register_find_start(const struct volume *fixed, const struct volume *moving, const struct register_settings *settings,
                         struct registration *result, bool *overlap);

/* Returns the number of the fixed image's voxels that have to lie in the moving one: .3 of the smaller of the two boxes. */
double register_min_voxels(const struct volume *fixed, const struct volume *moving);

/* Samples the moving image at the voxels of the fixed one through a map; NaN beyond it and where it has no data. */
void register_through(const struct volume *moving, const double map[3][4], const struct volume *fixed, float *values);

/* Improves the map A from the world of `fixed` to that of `moving` for the sum of squared differences, up to a gain and an offset
 * of the values, which are about 0..1 (register_affine.c). */
bool register_affine(const struct volume *fixed, const struct volume *moving, enum register_align align, double map[3][4]);

/* Does the same up to a line or a curve of the values, whichever clearly explains more. *relation: what it was. */
bool register_affine_related(const struct volume *fixed, const struct volume *moving, enum register_align align, double map[3][4],
                             struct relation *relation);

void register_identity(double map[3][4]);

#endif
