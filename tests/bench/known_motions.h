/* known_motions.h - the motions that are measured: bodies in flows whose answer is known. */
#ifndef BENCH_KNOWN_MOTIONS_H
#define BENCH_KNOWN_MOTIONS_H

#include "motion.h"

enum known_motion {
    TWIST, SHEAR, GROW, TOUCH, PRESS, SCREW, SWIRL, TURN, WIND,
    MOTIONS, /* those of `make motions` come before */
    LEVEQUE_SHORT = MOTIONS, LEVEQUE_MIDDLE, LEVEQUE, /* periods 1.25, 2 and 2.5 */
    ZALESAK,
    BREATHE, /* a pressure callback moves a ball beside a velocity callback */
    ABC, GYRE, /* unsteady, and do not go back */
    KNOWN_MOTIONS
};

/* A flow: x - the middle, in units of the grid, goes in; grids a unit of time come out. */
struct known_flow {
    double grid, middle;
    void (*field)(const double x[3], double v[3]);
    void (*unsteady)(const double x[3], double time, double v[3]); /* instead of the field */
    double period; /* of LeVeque's flow */
    double back;   /* the field times a cosine of time, as many times as far back as there; 0: on and on */
    int part_cells; /* of the longest side of the part with edges */
};

struct known_motions {
    struct motion motions[KNOWN_MOTIONS];
    struct known_flow flows[KNOWN_MOTIONS];
    const char *names[KNOWN_MOTIONS];
    struct mesh meshes[KNOWN_MOTIONS];
    springls_box bar, box;
    springls_notched_sphere notched, zalesak;
    springls_torus torus;
    springls_sphere near[2], far[2], ball, still, leveque, breathing, carried, stirred;
    springls_metasphere two_near, two_far;
};

/* Places the motions in a grid. scans: TWIST and GROW move scanned bodies where SPRINGLS_DATA has them, and a line on stdout
   names those that are missing; else other bodies stand in for them. The motions point into *all. */
void known_motions_make(int grid, bool scans, struct known_motions *all);
void known_motions_free(struct known_motions *all);

/* Numbers of components at the start, at half time and at the end. */
extern const int known_components[KNOWN_MOTIONS][3];

#endif
