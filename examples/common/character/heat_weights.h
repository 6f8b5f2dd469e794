/* heat_weights.h - bone weights as heat in equilibrium: Baran & Popovic, "Automatic rigging and animation of 3D characters"
 * (Pinocchio, SIGGRAPH 2007), reference [59] of the paper.
 *
 * Weight w of bone i solves -Laplace w + H w = H p: the surface conducts heat and the bone warms what it is nearest to, with
 * p = 1 at vertices whose nearest bone it is and H = 1/d^2 where that bone is seen from the vertex without leaving the body,
 * else 0. */
#ifndef EXAMPLES_CHARACTER_HEAT_WEIGHTS_H
#define EXAMPLES_CHARACTER_HEAT_WEIGHTS_H

#include <stdbool.h>
#include <stddef.h>

struct bone {
    float from[3], to[3];
};

struct heat_report {
    int visible;           /* vertices that see their nearest bone */
    int iterations;     /* of conjugate gradients, all bones together */
    double sum_error;   /* largest |sum of weights - 1| before they were made to sum to 1 */
};

/* A closed surface with triangles counter-clockwise from outside. weights: [vertex * bone_count + bone]. False: no bones, no
 * vertex that sees one, or memory. */
bool heat_weights(const float *positions, int vertex_count, const int *triangles, int triangle_count, const struct bone *bones,
                  int bone_count, float *weights, struct heat_report *report);

#endif
