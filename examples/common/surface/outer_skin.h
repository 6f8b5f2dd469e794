/* outer_skin.h - the triangles of a damaged mesh that bound it from outside, each facing there: what a ball that rolls in from infinity
 * touches. What it cannot get to (inner shells, junk, hollows), and what it touches from both sides (fins), bounds nothing. */
#ifndef EXAMPLES_SURFACE_OUTER_SKIN_H
#define EXAMPLES_SURFACE_OUTER_SKIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define OUTER_SKIN_SPECK_SHARE 1e-3 /* of the largest part's volume: what has as much is no speck */

struct outer_skin_spec {
    float spacing;  /* of the voxels in which lengths are given; the ball is followed on voxels of this size, or larger ones */
    float opening;  /* radius of the ball, voxels; 0: found from the mesh */
    float speck;    /* closed parts below this volume, voxels^3, and a thousandth of the largest one's are left out */
    bool cavities;  /* hollows stay */
};

struct outer_skin {
    uint32_t *indices; /* 3 a triangle, counter-clockwise from outside */
    uint32_t *source;  /* of each, its number in the mesh */
    size_t triangle_count;
    float opening;     /* that was taken, voxels */
    int patches;       /* triangles that hang together by edges of two */
    int turned;        /* patches that faced inwards */
    int cavities;      /* closed patches that bound hollows: they stay, or are filled */
    int specks;        /* closed patches left out for their size */
    bool open;         /* most of it is seen from both sides: it is kept as it is */
    double hollow;     /* share of what is enclosed that stays empty though only narrow openings lead there; 0: less than .1 */
    float fills;       /* the opening that would fill it, voxels */
    double area;       /* of the mesh; of it: */
    double sheets;     /* seen from both sides, left out */
    double hidden;     /* not seen, left out; hollows too */
};

/* Finds the skin. Returns false, with nothing to free and a reason in *why, where memory is short. */
bool outer_skin_find(const float *positions, const uint32_t *indices, size_t triangle_count, const struct outer_skin_spec *spec,
                     struct outer_skin *skin, const char **why);
void outer_skin_free(struct outer_skin *skin);

#endif
