/* project_body.h - the weight of a springl at a squared distance, the distance of a voxel from the sums over the springls around
   it, and what phi takes of it; for one voxel and for several. */

/* Weighted sums over the springls around a voxel: offset is from particle to voxel, height its part along the normal. */
typedef struct SPRINGLS__W(moments) { SPRINGLS__NUM3 offset, normal, moved; SPRINGLS__NUM weight, height; } SPRINGLS__W(moments);

/* Reads the sums of a voxel of a row, or of several side by side. */
SPRINGLS__W_MATHS SPRINGLS__W(moments) SPRINGLS__W(moments_load)(SPRINGLS__LOCAL const float *sums)
{
    SPRINGLS__NUM v[SPRINGLS__SUMS];
    SPRINGLS__W(moments) m;
    int k;
    for (k = 0; k < SPRINGLS__SUMS; k++) v[k] = SPRINGLS__W(load)(sums + 8 * k);
    m.offset = SPRINGLS__W(v3_make)(v[0], v[1], v[2]);
    m.normal = SPRINGLS__W(v3_make)(v[3], v[4], v[5]);
    m.moved = SPRINGLS__W(v3_make)(v[6], v[7], v[8]);
    m.weight = v[SPRINGLS__SUM_WEIGHT];
    m.height = v[SPRINGLS__SUM_HEIGHT];
    return m;
}

/* A signed distance from sums, and its trust: by how much it may differ from phi, in voxels. */
typedef struct SPRINGLS__W(projection) { SPRINGLS__NUM distance, trust; } SPRINGLS__W(projection);

/* Returns a weight that falls smoothly from 1 to 0 at PROJECT_RADIUS. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(project_weight)(SPRINGLS__NUM d2)
{
    SPRINGLS__NUM t = 1.0f - d2 * (1.0f / (SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS));
    t = SPRINGLS__W(max)(t, SPRINGLS__W(broadcast)(0.0f));
    t = t * t;
    return t * t;
}

/* Returns the distance of a voxel from its sums. One springl stands for the circle arc through its particle p with normal n
   that meets the voxel x in the mean direction g: (g + n).(x - p) / (1 + g.n), exact on spheres and planes, where the plane
   of the springl alone would be biased outwards. 1 / (1 + g.n) is taken at the mean of g.n and to first order about 1, so
   that sums do. The further the springls lie to one side of the voxel, the less certain is the bend of the surface in
   between. */
SPRINGLS__W_MATHS SPRINGLS__W(projection) SPRINGLS__W(moments_distance)(SPRINGLS__W(moments) sum)
{
    SPRINGLS__NUM inverse = 1.0f / sum.weight, bend = 1.0f - SPRINGLS__W(length)(sum.normal) * inverse;
    SPRINGLS__NUM3 g = SPRINGLS__W(normalize)(sum.normal), offset = SPRINGLS__W(scale)(sum.offset, inverse);
    SPRINGLS__NUM along = SPRINGLS__W(dot)(g, offset);
    SPRINGLS__NUM aside2 = SPRINGLS__W(max)(SPRINGLS__W(length2)(offset) - along * along, SPRINGLS__W(broadcast)(0.0f));
    SPRINGLS__W(projection) f;
    f.distance = 0.5f * (along + sum.height * inverse) * (1.0f + 0.5f * bend);
    f.trust = 0.5f - aside2;
    return f;
}

/* Returns whether a voxel is on one side by the springls and on the other by phi. */
SPRINGLS__W_MATHS SPRINGLS__COND SPRINGLS__W(other_side)(SPRINGLS__NUM distance, SPRINGLS__NUM phi)
{
    return (distance < 0.0f) != (phi < 0.0f);
}

/* Returns the springls' distance where it is close to phi, or on phi's side and shorter, since phi may have lost a sheet there;
   elsewhere phi. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(corrected_phi)(SPRINGLS__NUM phi, SPRINGLS__W(projection) f)
{
    SPRINGLS__NUM change = SPRINGLS__W(fabs)(f.distance - phi);
    SPRINGLS__COND same_side = SPRINGLS__W(not)(SPRINGLS__W(other_side)(f.distance, phi));
    SPRINGLS__COND closer = (f.trust > 0.2f) & (SPRINGLS__W(fabs)(f.distance) < SPRINGLS__W(fabs)(phi));
    return SPRINGLS__W(select)((change < f.trust) | (same_side & (closer | (change < 1.5f * f.trust))), f.distance, phi);
}

/* Returns whether phi may have lost a voxel of a sheet or gap: springls have it on the other side, no deeper than a sheet that phi
   could lose is thick, and are not all to one side of it. */
SPRINGLS__W_MATHS SPRINGLS__COND SPRINGLS__W(can_nucleate)(SPRINGLS__NUM phi, SPRINGLS__W(projection) f)
{
    return SPRINGLS__W(other_side)(f.distance, phi) & (SPRINGLS__W(fabs)(f.distance) < 0.8f) & (f.trust > 0.1f);
}

/* Returns the distance that springls give a voxel. The voxel stays on its side by phi until springls show it clearly on the other side:
   else voxels on the faces of a box that lies on voxel planes would change sides with every error of springls. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(on_known_side)(SPRINGLS__NUM distance, SPRINGLS__NUM phi)
{
    const float clearly = 0.02f, beside = 1e-6f; /* voxel */
    SPRINGLS__COND stays = SPRINGLS__W(other_side)(distance, phi) & (SPRINGLS__W(fabs)(distance) < clearly);
    SPRINGLS__NUM known = SPRINGLS__W(select)(phi < 0.0f, SPRINGLS__W(broadcast)(-beside), SPRINGLS__W(broadcast)(beside));
    return SPRINGLS__W(select)(stays, known, distance);
}
