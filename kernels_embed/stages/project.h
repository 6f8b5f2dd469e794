/* project.h - the level set from oriented springls: its value to second order, its side carried along with them. It takes the place
   of the paper's evolution (eq. 23, evolve.h), whose steps are half a voxel. */
#ifndef SPRINGLS__KERNEL_STAGES_PROJECT_H
#define SPRINGLS__KERNEL_STAGES_PROJECT_H

#include "../model/grid.h"

/* Voxels: springls whose particles are further away do not count. A few springls are to average at every voxel. */
#define SPRINGLS__PROJECT_RADIUS 1.6f

/* Two normals are of the same sheet where the cosine of the angle between them is larger. */
#define SPRINGLS__SAME_SHEET 0.4f

/* What the level set takes from a springl: particle, unit normal, displacement since phi was last synced; edge: 1 at a crease. */
typedef struct springls__oriented { springls__v3 p, n, moved; int edge; } springls__oriented;

/* Sums of a brick's voxels, eight floats a row of voxels each: the members of springls__moments, the squared distance to the
   nearest particle, and its normal (0: none is near). */
#define SPRINGLS__SUM_OFFSET 0
#define SPRINGLS__SUM_NORMAL 3
#define SPRINGLS__SUM_MOVED 6
#define SPRINGLS__SUM_WEIGHT 9
#define SPRINGLS__SUM_HEIGHT 10
#define SPRINGLS__SUMS 11
#define SPRINGLS__NEAREST2 11
#define SPRINGLS__FACING 12
#define SPRINGLS__SUM_MEMBERS (SPRINGLS__FACING + 3)
#define SPRINGLS__SUMS_FLOATS (SPRINGLS__SUM_MEMBERS * SPRINGLS__BRICK_VOXELS) /* of all of them */

#include "../language/width_float.h"
#include "project_body.h"
#include "../language/width_simd.h"
#include "project_body.h"

/* The distance of a place by one springl, by the arc of springls__moments_distance, and its weight. */
typedef struct springls__estimate { float weight, distance; } springls__estimate;

SPRINGLS__MATHS springls__estimate springls__oriented_distance(springls__v3 x, springls__v3 direction, springls__v3 p,
                                                               springls__v3 n)
{
    springls__v3 d = springls__sub(x, p);
    float along = springls__dot(direction, n);
    springls__estimate estimate;
    estimate.weight = along > SPRINGLS__SAME_SHEET ? springls__project_weight(springls__length2(d)) : 0.0f;
    estimate.distance = springls__dot(springls__add(direction, n), d) / (1.0f + springls__max(along, 0.0f));
    return estimate;
}

/* The least weight of sums that count. */
#define SPRINGLS__MIN_WEIGHT 1e-3f

/* Returns phi of a voxel; one that the surface passes through, but for rounding, is outside. */
SPRINGLS__MATHS float springls__outside_on_surface(float phi)
{
    const float rounding = 1e-3f; /* voxel */
    return springls__fabs(phi) < rounding ? springls__fabs(phi) : phi;
}

/* Returns phi with the mark of an unknown side, for a voxel that the surface may have passed: a value beyond every distance, the
   old one plus or minus twice far_value. */
SPRINGLS__MATHS float springls__side_unknown(float phi, float far_value)
{
    return phi < 0.0f ? phi - 2.0f * far_value : phi + 2.0f * far_value;
}

/* Returns where phi bears the mark of an unknown side. */
SPRINGLS__VEC_MATHS springls__vmask springls__is_side_unknown(springls__vec phi, float far_value)
{
    return springls__vec_fabs(phi) > 1.5f * far_value;
}

/* Returns phi without the mark of an unknown side. */
SPRINGLS__VEC_MATHS springls__vec springls__restored_side(springls__vec phi, float far_value)
{
    springls__vec old = springls__vec_select(phi < 0.0f, phi + 2.0f * far_value, phi - 2.0f * far_value);
    return springls__vec_select(springls__is_side_unknown(phi, far_value), old, phi);
}

/* Returns phi where the side is known, else 0. */
SPRINGLS__VEC_MATHS springls__vec springls__known_side(springls__vec phi, float far_value)
{
    return springls__vec_select(springls__is_side_unknown(phi, far_value), springls__vec_broadcast(0.0f), phi);
}

/* Returns the value of voxels whose side is unknown: on the side of their neighbours, which count the more the further they are
   from the surface, a voxel further than the nearest of them. Where their sum is no more than min_sum the side stays
   unknown. */
SPRINGLS__VEC_MATHS springls__vec springls__resolved_side(springls__cross7 v, float far_value, float min_sum)
{
    springls__vec sum = springls__known_side(v.xm, far_value) + springls__known_side(v.xp, far_value)
                      + springls__known_side(v.ym, far_value) + springls__known_side(v.yp, far_value)
                      + springls__known_side(v.zm, far_value) + springls__known_side(v.zp, far_value);
    springls__vec3 n = springls__nearer_of_pairs(v);
    springls__vec nearest = springls__vec_min(springls__vec_min(n.x, n.y), n.z);
    springls__vec d = springls__vec_min(nearest + 1.0f, springls__vec_broadcast(far_value));
    d = springls__vec_select(sum < 0.0f, -d, d);
    return springls__vec_select(springls__vec_fabs(sum) > min_sum, d, v.c);
}

/* Returns whether the springl at a particle with normal n votes the voxel at d from it inside: behind it by less than `depth`,
   and not far aside. */
SPRINGLS__MATHS bool springls__votes_inside(springls__v3 d, springls__v3 n, float depth, float aside2)
{
    float h = springls__dot(d, n);
    return h < 0.0f && h > -depth && springls__length2(d) - h * h < aside2;
}

#endif
