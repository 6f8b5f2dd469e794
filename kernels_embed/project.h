/* project.h - the level set's value from oriented springls, to second order. */

/* Voxels: springls whose particles are further away say nothing. Wide enough for a few springls to average at every voxel. */
#define SPRINGLS__PROJECT_RADIUS 1.6f

/* One springl's say at a voxel: weight, and weight times the signed distance of the voxel to the circle arc through the
   particle with normal n that meets the voxel's own direction (exact on spheres and planes, where the plane of the
   springl alone is biased outwards). No say for springls that face elsewhere: the other sheet of a thin object. */
typedef struct springls__say { float weight, value; } springls__say;

SPRINGLS__MATHS springls__say springls__oriented_distance(springls__v3 x, springls__v3 direction, springls__v3 p, springls__v3 n)
{
    const float radius2 = SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS, variance = 0.6f;
    springls__v3 d = springls__sub(x, p);
    float d2 = springls__length2(d), along = springls__dot(direction, n);
    springls__say say;
    say.weight = say.value = 0.0f;
    if (d2 >= radius2 || along <= 0.4f) return say;
    say.weight = springls__exp(-d2 / variance);
    say.value = say.weight * springls__dot(springls__add(direction, n), d) / (1.0f + along);
    return say;
}

/* The value to take: the springls' where it is close to the evolved one, which decides the side in doubt. */
SPRINGLS__MATHS float springls__corrected_phi(float phi, float weight, float value)
{
    float f = value / springls__max(weight, 1e-6f), change = springls__fabs(f - phi);
    int same_side = (f < 0.0f) == (phi < 0.0f);
    if (weight < 1e-3f) return phi;
    return change < 0.5f || (same_side && change < 0.75f) ? f : phi;
}

/* 1 when the voxel at d from a particle with normal n is inside by this springl's word: behind it by less than `depth`, and
   not far aside. */
SPRINGLS__MATHS int springls__claims_inside(springls__v3 d, springls__v3 n, float depth, float aside2)
{
    float h = springls__dot(d, n);
    return h < 0.0f && h > -depth && springls__length2(d) - h * h < aside2;
}

/* phi is a distance: it differs by no more than 1 between neighbours. A voxel outside with more than 1 has a neighbour inside
   only where that is new; it gets what the smallest, `inner`, allows it. */
SPRINGLS__MATHS float springls__beside_inside(float phi, float inner)
{
    return phi > 1.0f && inner < 0.0f ? springls__min(phi, springls__max(inner + 1.0f, 0.0f)) : phi;
}
