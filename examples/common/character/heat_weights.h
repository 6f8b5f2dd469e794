/* heat_weights.h - bone weights as heat in equilibrium: Baran & Popovic, "Automatic rigging and animation of 3D characters"
 * (Pinocchio, SIGGRAPH 2007), reference [59] of the paper.
 *
 * The weight w of bone i solves -Laplace w + H w = H p: the surface conducts heat from the bones nearest to it. p = 1 at
 * vertices whose nearest bone is i; H = 1/d^2 where the line from the vertex to that bone stays inside the body, else 0. */
#ifndef EXAMPLES_CHARACTER_HEAT_WEIGHTS_H
#define EXAMPLES_CHARACTER_HEAT_WEIGHTS_H

#include <stdbool.h>
#include <stddef.h>

struct bone {
    float from[3], to[3];
};

struct heat_report {
    int visible;           /* vertices from which the nearest bone is visible */
    int iterations;     /* of conjugate gradients, for all bones together */
    double sum_error;   /* largest |sum of weights - 1| before normalization */
};

/* Computes weights on a closed surface with triangles counter-clockwise from outside. weights: [vertex * bone_count + bone].
 * Returns false if there are no bones, no vertex has a visible bone, or memory is short. */
bool heat_weights(const float *positions, int vertex_count, const int *triangles, int triangle_count, const struct bone *bones,
                  int bone_count, float *weights, struct heat_report *report);

#endif
