/* rows.h - the loops that src/lanes_*.h run several elements at a time, one after the other. */

#ifndef SPRINGLS__LANES

SPRINGLS__MATHS void springls__nearest_edges(SPRINGLS__GLOBAL const springls__springl *o,
                                             SPRINGLS__GLOBAL const springls__v3 *q, float radius2, float d2[3], int edge[3])
{
    int e, m;
    for (m = 0; m < 3; m++) {
        d2[m] = radius2;
        edge[m] = -1;
        for (e = 0; e < 3; e++) {
            springls__v3 a = o->q[e], ab = springls__sub(o->q[e == 2 ? 0 : e + 1], a);
            float d = springls__segment_distance2(q[m], a, ab, o->inverse_edge2[e]);
            if (d >= d2[m]) continue;
            d2[m] = d;
            edge[m] = e;
        }
    }
}

SPRINGLS__MATHS void springls__omega_row(const springls__tri_plan *plan, springls__v3 center, float reach, int x, int y, int z,
                                         SPRINGLS__GLOBAL float *row)
{
    int i;
    for (i = 0; i < 8; i++) {
        springls__v3 at = springls__v3_make((float)(x + i), (float)y, (float)z);
        float within = row[i] + reach;
        if (springls__length2(springls__sub(at, center)) >= within * within) continue;
        row[i] = springls__min(row[i], springls__sqrt(springls__tri_distance2(*plan, at)));
    }
}

SPRINGLS__MATHS void springls__side_row(const springls__tri_plan *plan, springls__v3 center, float reach, float capture, int x,
                                        int y, int z, SPRINGLS__GLOBAL const float *omega, SPRINGLS__LOCAL float *side)
{
    int i;
    for (i = 0; i < 8; i++) {
        springls__v3 at = springls__v3_make((float)(x + i), (float)y, (float)z);
        float within = omega[i] + 0.5f + reach;
        if (omega[i] < capture && springls__length2(springls__sub(at, center)) < within * within)
            side[i] += springls__side(*plan, at);
    }
}

SPRINGLS__MATHS void springls__evolve_row(SPRINGLS__LOCAL const float *phi, SPRINGLS__LOCAL const float *omega, float width,
                                          float step, SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i++) {
        float moved = springls__evolve_voxel(springls__tile_cross(phi + i), springls__tile_cross(omega + i), step);
        out[i] = springls__fabs(phi[i]) <= width ? moved : phi[i];
    }
}

/* Is one of the 26 neighbours on the other side? */
SPRINGLS__MATHS bool springls__touches(SPRINGLS__LOCAL const float *t)
{
    int i;
    for (i = 0; i < 27; i++)
        if ((t[i % 3 - 1 + SPRINGLS__TILE * (i / 3 % 3 - 1 + SPRINGLS__TILE * (i / 9 - 1))] < 0.0f) != (t[0] < 0.0f)) return true;
    return false;
}

SPRINGLS__MATHS void springls__interface_row(SPRINGLS__LOCAL const float *phi, float far_value, SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i++) {
        springls__cross7 v = springls__tile_cross(phi + i);
        float d = springls__interface_distance(v);
        bool own = springls__at_interface(v) || (springls__at_sharp_edge(v.c, d) && springls__touches(phi + i));
        out[i] = own ? d : springls__distance_guess(v.c, far_value);
    }
}

SPRINGLS__MATHS void springls__redistance_row(SPRINGLS__LOCAL const float *phi, float far_value, SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i++) out[i] = springls__redistance(springls__tile_cross(phi + i), springls__touches(phi + i), far_value);
}

SPRINGLS__MATHS bool springls__specks_row(SPRINGLS__LOCAL const float *phi, SPRINGLS__GLOBAL float *out)
{
    bool some = false;
    int i;
    for (i = 0; i < 8; i++) {
        out[i] = springls__remove_speck(springls__tile_cross(phi + i));
        some = some || (out[i] < 0.0f) != (phi[i] < 0.0f);
    }
    return some;
}

SPRINGLS__MATHS void springls__nearest_row(springls__oriented s, springls__v3 offset, SPRINGLS__LOCAL float *sums, int row)
{
    float yz2 = offset.y * offset.y + offset.z * offset.z;
    int i;
    for (i = row; i < row + 8; i++) {
        float d2 = springls__row_distance2(offset.x + (float)(i - row), yz2);
        if (d2 >= sums[springls__sum_at(SPRINGLS__NEAREST2, i)]) continue;
        sums[springls__sum_at(SPRINGLS__NEAREST2, i)] = d2;
        sums[springls__sum_at(SPRINGLS__FACING, i)] = s.n.x;
        sums[springls__sum_at(SPRINGLS__FACING + 1, i)] = s.n.y;
        sums[springls__sum_at(SPRINGLS__FACING + 2, i)] = s.n.z;
    }
}

SPRINGLS__MATHS void springls__moments_store(SPRINGLS__LOCAL float *sums, int i, springls__moments m)
{
    const springls__v3 *from[3];
    int k;
    from[0] = &m.offset;
    from[1] = &m.normal;
    from[2] = &m.moved;
    for (k = 0; k < 3; k++) {
        sums[springls__sum_at(3 * k, i)] = from[k]->x;
        sums[springls__sum_at(3 * k + 1, i)] = from[k]->y;
        sums[springls__sum_at(3 * k + 2, i)] = from[k]->z;
    }
    sums[springls__sum_at(SPRINGLS__SUM_WEIGHT, i)] = m.weight;
    sums[springls__sum_at(SPRINGLS__SUM_HEIGHT, i)] = m.height;
}

SPRINGLS__MATHS void springls__moments_row(springls__oriented s, springls__v3 offset, SPRINGLS__LOCAL float *sums, int row)
{
    int i;
    for (i = row; i < row + 8; i++) {
        springls__v3 facing = springls__v3_make(sums[springls__sum_at(SPRINGLS__FACING, i)],
                                                sums[springls__sum_at(SPRINGLS__FACING + 1, i)],
                                                sums[springls__sum_at(SPRINGLS__FACING + 2, i)]);
        springls__v3 at = springls__v3_make(offset.x + (float)(i - row), offset.y, offset.z);
        springls__moments_store(sums, i, springls__moments_add(springls__moments_load(sums, i), s, at, facing));
    }
}

SPRINGLS__MATHS void springls__resolve_side_row(SPRINGLS__LOCAL const float *phi, float far_value, float enough,
                                          SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i++) out[i] = springls__resolved_side(springls__tile_cross(phi + i), far_value, enough);
}

#endif
