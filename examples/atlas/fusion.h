/* fusion.h - an atlas's subjects, registered to the images of some of them, and what they agree on in a new image.
 *
 * A template is the image of one subject. All subjects' images and masks are sampled once on its grid, through a registration.
 * A new image needs one registration to each template; then everything happens on the template's grid:
 *
 *   votes       every subject's mask votes at every voxel, weighted by how well its image agrees there: local weighted voting
 *               (Artaechevarria et al. 2009) with the correlation of patches (fusion_votes.c)
 *   correction  what votes get wrong is learned from the subjects themselves, each one voted on by the others: corrective
 *               learning (Wang et al. 2011), here a regression on random features (fusion_correction.c)
 *
 * The probabilities of all templates are averaged, with weights by how well the image agrees with the subjects there. */
#ifndef EXAMPLES_ATLAS_FUSION_H
#define EXAMPLES_ATLAS_FUSION_H

#include "imaging/volume.h"
#include "registration/register.h"

enum { FUSION_MAX_TEMPLATES = 4, FUSION_MIN_SUBJECTS = 4, FUSION_MIN_LEARNED = 10, FUSION_MAX_LABELS = 64 };

struct fusion_template {
    struct volume image; /* of the subject that is the template, around its mask */
    int self;            /* that subject */
    int count;           /* subjects */
    int vertices;        /* of the atlas */
    float *images;       /* [subject][voxel]: intensities at the template's places, scaled by fusion_normalize */
    float *masks;        /* [subject][voxel]: 0 outside, 1 inside */
    int *labels;         /* [subject][voxel]: number from 1 of the nearest label, 0 outside; NULL: the subjects have one label */
    int label_count;     /* 0: one label */
    float *means, *deviations; /* [subject][voxel]: of the images' patches */
    float *places;       /* the atlas's vertices on the subject that is the template, mm */
    float *correction;   /* weights of the regression, fusion_terms; NULL: not learned */
    bool corrected;      /* there is one */
    float level;         /* of the corrected probability, at which volumes are right on average */
};

/* A registration to an image that was moved by `shift` first. */
struct fusion_map {
    struct registration registration; /* template -> moved image */
    float shift[3];                   /* from the moved image's places to the image's, mm */
};

/* Registers a template to an image whose places are about `shift` away from the template's. */
bool fusion_register(const struct volume *template, const struct volume *image, const float shift[3], struct fusion_map *map,
                     char error[VOLUME_TEXT]);
void fusion_forward(const struct fusion_map *map, const float *places, size_t count, float *mapped); /* template -> image */
void fusion_back(const struct fusion_map *map, const float *places, size_t count, float *mapped);

/* Computes the place in the image of a voxel of the template's grid. */
void fusion_place(const struct fusion_map *map, const struct volume *grid, size_t n, float place[3]);

/* Samples an image at the places of the template's voxels. */
void fusion_sample(const struct fusion_map *map, const struct volume *grid, const struct volume *image, float *values);

/* Returns the correlation of an image with the template at an offset, before any registration. */
double fusion_agreement(const struct volume *template, const struct volume *image, const float shift[3]);

/* Scales intensities on the template's grid to mean 0 and deviation 1 in and around the template's own mask. Returns false if memory is
 * short. */
bool fusion_normalize(const struct fusion_template *template, float *values);

/* Computes means and deviations of the patches of template->images. Returns false if memory is short. */
bool fusion_prepare(struct fusion_template *template);

/* What the subjects with include[s] say about an image on the template's grid: volume_voxels numbers each. */
struct fusion_votes {
    float *mean;     /* share of the subjects that have the voxel */
    float *voted;    /* the same, weighted */
    float *expected; /* the weighted mean of their images */
    float *target;   /* the image itself, normalized */
    float *shares;   /* [label][voxel]: weighted share of the subjects that have the label there; NULL: not asked for */
};

/* Returns the correlation of the image with what the template's subjects expect, where they have the object and around. */
double fusion_correlation(const struct fusion_template *template, const struct fusion_votes *votes);

/* Returns the weight of a template's answer: how well the image agrees with what its subjects expect. */
float fusion_trust(const struct fusion_template *template, const struct fusion_votes *votes);

bool fusion_vote(const struct fusion_template *template, const float *image, const bool *include, bool by_label,
                 struct fusion_votes *votes);
void fusion_votes_free(struct fusion_votes *votes);

/* Learns the correction and the level from the subjects with include[s], each one voted on by the others. From fewer than
 * FUSION_MIN_LEARNED only the level. */
bool fusion_learn(struct fusion_template *template, const bool *include);
/* Computes the probability of being inside, from votes. Without a correction: the votes. */
bool fusion_correct(const struct fusion_template *template, const struct fusion_votes *votes, float *probability);

extern const int fusion_terms; /* numbers of a correction */

void fusion_template_free(struct fusion_template *template);

#endif
