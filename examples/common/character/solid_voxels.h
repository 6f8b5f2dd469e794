/* solid_voxels.h - the inside of a body as voxels: depth below the surface, distances within the body.
 *
 * Neighbors are the 26 voxels around; distances are in voxels. */
#ifndef EXAMPLES_CHARACTER_SOLID_VOXELS_H
#define EXAMPLES_CHARACTER_SOLID_VOXELS_H

#include <stdbool.h>

struct solid_grid {
    int size[3];
    double origin[3], spacing; /* world place of voxel 0; size of a voxel */
};

struct solid {
    struct solid_grid grid;
    int count;    /* inside voxels */
    int *index;   /* of each in the grid, x fastest */
    int *number;  /* of each voxel of the grid among the inside ones, -1: outside */
    float *depth; /* of each below the surface */
};

enum { SOLID_MARGIN = 5 }; /* voxels between the box and each end of the grid */

/* Makes a grid around the box lo..hi with `cells` voxels along its longest side, of which SOLID_MARGIN are beyond each end. Returns
 * false if the box has no size, or is not finite. */
bool solid_grid_around(const float lo[3], const float hi[3], int cells, struct solid_grid *grid);

/* What solid_repair did. */
struct solid_repair {
    int filled;  /* voxels of hollows, which become inside */
    int parts;   /* separate bodies */
    int joined;  /* of these, connected with the largest one by a bridge */
    int dropped; /* voxels of bodies left out: too small or too far away */
    int out_of_reach, out_of_reach_at; /* voxels of one that is only too far away, and a voxel of it; 0: none */
};

/* Makes one body of a level set (negative inside, voxels): fills hollows, and connects separate bodies of at least 1/1000 of the
 * volume by bridges, if these are at most `reach` voxels long: along the middles of limbs where one leads to another body, else the
 * shortest. limbs: of each voxel, not 0 where the middle of a limb is, as solid_mark_way (solid_handles.h) marks it; NULL: none known.
 * open: crevices that a film of one voxel closes are opened instead. Returns false if memory is short. */
bool solid_repair(const struct solid_grid *grid, float *phi, const unsigned char *limbs, int reach, bool open, struct solid_repair *report);

/* Finds whether the inside is one body, connected by faces of voxels, and so is the outside. Returns false if memory is short. */
bool solid_is_whole(const struct solid_grid *grid, const float *phi, bool *whole);

/* Continues a level set that is clamped at `band` voxels: farther away, and where it is the distance to something inside, |phi|
 * becomes the distance to where the sign changes, within a voxel. Returns false if memory is short. */
bool solid_extend(const struct solid_grid *grid, float *phi, float band);

/* Collects the inside voxels of a level set. Depths are -phi where that is less than `band` voxels, and below that distances
 * to the nearest voxel outside. Returns false if memory is short or nothing is inside. */
bool solid_create(const struct solid_grid *grid, const float *phi, float band, struct solid *solid);
void solid_free(struct solid *solid);

void solid_place(const struct solid *solid, int number, float place[3]); /* world place of an inside voxel */
int solid_nearest(const struct solid *solid, const float place[3]);      /* inside voxel nearest to a world place */
int solid_neighbors(const struct solid *solid, int number, int neighbors[26]); /* returns how many are inside */
float solid_step(const struct solid *solid, int from, int to);                 /* distance of two neighbors */

/* Computes distances within the body from seeds. centered: each step costs its length over the square of the depth, so that
 * shortest paths keep to the middle of the body. before: the voxel before each on its shortest path, -1: seed or out of reach
 * (may be NULL). Distances out of reach are infinite. Returns false if memory is short. */
bool solid_distances(const struct solid *solid, const int *seeds, int seed_count, bool centered, float *distance,
                     int *before);

#endif
