/* project.h - the level set from oriented springls: its value to second order, its side carried along with them. */
#ifndef SPRINGLS__KERNEL_STAGES_PROJECT_H
#define SPRINGLS__KERNEL_STAGES_PROJECT_H

#include "../model/grid.h"

/* Voxels: springls whose particles are further away say nothing. Wide enough for a few springls to average at every voxel. */
#define SPRINGLS__PROJECT_RADIUS 1.6f

/* A springl as the level set sees it: particle, unit normal, and the way the particle has come since phi was last in step
   with it. edge: 1 at a crease. */
typedef struct springls__oriented { springls__v3 p, n, moved; int edge; } springls__oriented;

/* Weighted sums over the springls around a voxel: offset is from particle to voxel, height its part along the normal. */
typedef struct springls__moments { springls__v3 offset, normal, moved; float weight, height; } springls__moments;

/* Squared distance of voxels in a row along x from what lies yz2 beside that row. */
SPRINGLS__MATHS float springls__row_distance2(float x, float yz2) { return x * x + yz2; }

/* Falls smoothly to 0 at the radius. */
SPRINGLS__MATHS float springls__project_weight(float d2)
{
    float t = springls__max(1.0f - d2 * (1.0f / (SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS)), 0.0f);
    t = t * t;
    return t * t;
}

/* Adds springl s, at `offset` from the voxel, unless it faces another way than `facing`, the normal of the nearest springl:
   then it is of another sheet. */
SPRINGLS__MATHS springls__moments springls__moments_add(springls__moments sum, springls__oriented s, springls__v3 offset,
                                                        springls__v3 facing)
{
    float w = springls__project_weight(springls__row_distance2(offset.x, offset.y * offset.y + offset.z * offset.z));
    if (springls__dot(facing, s.n) <= 0.4f) return sum;
    sum.weight += w;
    sum.height += w * (s.n.x * offset.x + (s.n.y * offset.y + s.n.z * offset.z));
    sum.offset = springls__mad(sum.offset, offset, w);
    sum.normal = springls__mad(sum.normal, s.n, w);
    sum.moved = springls__mad(sum.moved, s.moved, w);
    return sum;
}

/* What one springl says of a place x whose normal is known: its weight, and the distance by the arc explained below. */
typedef struct springls__estimate { float weight, distance; } springls__estimate;

SPRINGLS__MATHS springls__estimate springls__oriented_distance(springls__v3 x, springls__v3 direction, springls__v3 p, springls__v3 n)
{
    springls__v3 d = springls__sub(x, p);
    float along = springls__dot(direction, n);
    springls__estimate say;
    say.weight = along > 0.4f ? springls__project_weight(springls__length2(d)) : 0.0f;
    say.distance = springls__dot(springls__add(direction, n), d) / (1.0f + springls__max(along, 0.0f));
    return say;
}

/* Sums of less weight say nothing. */
#define SPRINGLS__MIN_WEIGHT 1e-3f

/* What the sums tell: a signed distance, and how far it may be trusted: by how much it may differ from phi. */
typedef struct springls__projection { float distance, trust; } springls__projection;

/* One springl means the circle arc through its particle p with normal n that meets the voxel x in the mean direction g:
   (g + n).(x - p) / (1 + g.n), exact on spheres and planes, where the plane of the springl alone would be biased outwards.
   1 / (1 + g.n) is taken at the mean of g.n and to first order about 1, so that sums do. The further the springls lie to one
   side of the voxel, the less they know of the surface's bend in between. */
SPRINGLS__MATHS springls__projection springls__moments_distance(springls__moments sum)
{
    float inverse = 1.0f / sum.weight, bend = 1.0f - springls__length(sum.normal) * inverse;
    springls__v3 g = springls__normalize(sum.normal), offset = springls__scale(sum.offset, inverse);
    float along = springls__dot(g, offset), aside2 = springls__max(springls__length2(offset) - along * along, 0.0f);
    springls__projection f;
    f.distance = 0.5f * (along + sum.height * inverse) * (1.0f + 0.5f * bend);
    f.trust = 0.5f - aside2;
    return f;
}

/* The value to take: the springls' where it is close to phi, which decides the side in doubt. Springls also know when they are
   closer than phi says: it may have lost a sheet here. */
SPRINGLS__MATHS float springls__corrected_phi(float phi, springls__projection f)
{
    float change = springls__fabs(f.distance - phi);
    int same_side = (f.distance < 0.0f) == (phi < 0.0f);
    int closer = f.trust > 0.2f && springls__fabs(f.distance) < springls__fabs(phi);
    return change < f.trust || (same_side && (closer || change < 1.5f * f.trust)) ? f.distance : phi;
}

/* May a voxel outside be one that phi has lost? It is behind springls, not deep and not aside. */
SPRINGLS__MATHS int springls__can_nucleate(springls__projection f)
{
    return f.distance < 0.0f && f.distance > -0.8f && f.trust > 0.1f;
}

/* A voxel that does not know its side any more, because the surface may have passed it: beyond every distance, but with
   its old value in it. */
SPRINGLS__MATHS float springls__side_unknown(float phi, float far_value)
{
    return phi < 0.0f ? phi - 2.0f * far_value : phi + 2.0f * far_value;
}

SPRINGLS__MATHS int springls__is_side_unknown(float phi, float far_value) { return springls__fabs(phi) > 1.5f * far_value; }

/* The old value again, where nobody could help. */
SPRINGLS__MATHS float springls__restore_side(float phi, float far_value)
{
    if (!springls__is_side_unknown(phi, far_value)) return phi;
    return phi < 0.0f ? phi + 2.0f * far_value : phi - 2.0f * far_value;
}

/* What a neighbour knows of a doubtful voxel's side: its value, nothing when it is in doubt itself. */
SPRINGLS__MATHS float springls__known_side(float phi, float far_value) { return springls__is_side_unknown(phi, far_value) ? 0.0f : phi; }

/* A doubtful voxel takes the side of its neighbours; the further one is from the surface the surer it is, and counts for so
   much. Where they say no more than `enough` the voxel stays in doubt. */
SPRINGLS__MATHS float springls__resolved_side(springls__cross7 v, float far_value, float enough)
{
    float sum, nearest;
    if (!springls__is_side_unknown(v.c, far_value)) return v.c;
    sum = springls__known_side(v.xm, far_value) + springls__known_side(v.xp, far_value) + springls__known_side(v.ym, far_value)
        + springls__known_side(v.yp, far_value) + springls__known_side(v.zm, far_value) + springls__known_side(v.zp, far_value);
    if (springls__fabs(sum) <= enough) return v.c;
    nearest = springls__min(springls__min(springls__fabs(v.xm), springls__fabs(v.xp)),
                            springls__min(springls__min(springls__fabs(v.ym), springls__fabs(v.yp)),
                                          springls__min(springls__fabs(v.zm), springls__fabs(v.zp))));
    nearest = springls__min(nearest + 1.0f, far_value);
    return sum < 0.0f ? -nearest : nearest;
}

/* 1 when the voxel at d from a particle with normal n is inside by this springl's word: behind it by less than `depth`, and
   not far aside. */
SPRINGLS__MATHS int springls__votes_inside(springls__v3 d, springls__v3 n, float depth, float aside2)
{
    float h = springls__dot(d, n);
    return h < 0.0f && h > -depth && springls__length2(d) - h * h < aside2;
}

/* A voxel alone among neighbours of the other side: a bubble or a crumb that is less than the grid can tell. Returns what it
   becomes there, else itself. */
SPRINGLS__MATHS float springls__remove_speck(springls__cross7 v)
{
    float lo = springls__least(v), hi = springls__most(v);
    if (v.c >= 0.0f && hi < 0.0f) return hi;
    return v.c < 0.0f && lo >= 0.0f ? lo : v.c;
}

#endif
