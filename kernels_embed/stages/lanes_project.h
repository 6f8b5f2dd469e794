/* lanes_project.h - a row of eight voxels and one springl (kernels_embed/project.h), for a few voxels at a time.
   offset: from the particle to the row's first voxel. */

#ifdef SPRINGLS__LANES

SPRINGLS__CONST float springls__ramp[8] = { 0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f };

SPRINGLS__LANE void springls__vec_put(SPRINGLS__LOCAL float *at, springls__vmask where, float x)
{
    springls__vec_store(at, springls__vec_select(where, springls__vec_all(x), springls__vec_load(at)));
}

SPRINGLS__MATHS void springls__nearest_row(springls__oriented s, springls__v3 offset, SPRINGLS__LOCAL float *sums, int row)
{
    float yz2 = offset.y * offset.y + offset.z * offset.z;
    int i;
    for (i = row; i < row + 8; i += SPRINGLS__LANES) {
        springls__vec x = offset.x + springls__vec_load(springls__ramp + (i - row)), d2 = x * x + yz2;
        springls__vec best = springls__vec_load(sums + springls__sum_at(SPRINGLS__NEAREST2, i));
        springls__vmask nearer = d2 < best;
        if (!springls__vmask_any(nearer)) continue;
        springls__vec_store(sums + springls__sum_at(SPRINGLS__NEAREST2, i), springls__vec_select(nearer, d2, best));
        springls__vec_put(sums + springls__sum_at(SPRINGLS__FACING, i), nearer, s.n.x);
        springls__vec_put(sums + springls__sum_at(SPRINGLS__FACING + 1, i), nearer, s.n.y);
        springls__vec_put(sums + springls__sum_at(SPRINGLS__FACING + 2, i), nearer, s.n.z);
    }
}

SPRINGLS__LANE void springls__sum_add(SPRINGLS__LOCAL float *sums, int member, int i, springls__vec value)
{
    SPRINGLS__LOCAL float *at = sums + springls__sum_at(member, i);
    springls__vec_store(at, springls__vec_load(at) + value);
}

SPRINGLS__MATHS void springls__moments_row(springls__oriented s, springls__v3 offset, SPRINGLS__LOCAL float *sums, int row)
{
    const float inverse = 1.0f / (SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS);
    float yz2 = offset.y * offset.y + offset.z * offset.z, yz = s.n.y * offset.y + s.n.z * offset.z;
    springls__vec zero = springls__vec_all(0.0f);
    int i;
    for (i = row; i < row + 8; i += SPRINGLS__LANES) {
        springls__vec x = offset.x + springls__vec_load(springls__ramp + (i - row)), d2 = x * x + yz2;
        springls__vec w = springls__vec_max(1.0f - d2 * inverse, zero), along;
        if (!springls__vmask_any(w > zero)) continue;
        along = springls__vec_load(sums + springls__sum_at(SPRINGLS__FACING, i)) * s.n.x
                + springls__vec_load(sums + springls__sum_at(SPRINGLS__FACING + 1, i)) * s.n.y
                + springls__vec_load(sums + springls__sum_at(SPRINGLS__FACING + 2, i)) * s.n.z;
        w = w * w;
        w = springls__vec_select(along > 0.4f, w * w, zero);
        springls__sum_add(sums, SPRINGLS__SUM_WEIGHT, i, w);
        springls__sum_add(sums, SPRINGLS__SUM_HEIGHT, i, w * (s.n.x * x + yz));
        springls__sum_add(sums, SPRINGLS__SUM_OFFSET, i, x * w);
        springls__sum_add(sums, SPRINGLS__SUM_OFFSET + 1, i, offset.y * w);
        springls__sum_add(sums, SPRINGLS__SUM_OFFSET + 2, i, offset.z * w);
        springls__sum_add(sums, SPRINGLS__SUM_NORMAL, i, s.n.x * w);
        springls__sum_add(sums, SPRINGLS__SUM_NORMAL + 1, i, s.n.y * w);
        springls__sum_add(sums, SPRINGLS__SUM_NORMAL + 2, i, s.n.z * w);
        springls__sum_add(sums, SPRINGLS__SUM_MOVED, i, s.moved.x * w);
        springls__sum_add(sums, SPRINGLS__SUM_MOVED + 1, i, s.moved.y * w);
        springls__sum_add(sums, SPRINGLS__SUM_MOVED + 2, i, s.moved.z * w);
    }
}

SPRINGLS__LANE springls__vec springls__known_lanes(springls__vec phi, float far_value)
{
    return springls__vec_select(springls__vec_abs(phi) > 1.5f * far_value, springls__vec_all(0.0f), phi);
}

/* springls__resolved_side; phi points into a tile. */
SPRINGLS__MATHS void springls__resolve_side_row(SPRINGLS__LOCAL const float *phi, float far_value, float enough,
                                          SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec_cross7 v;
        springls__vec sum, nearest;
        springls__vmask doubtful = springls__vec_abs(springls__vec_load(phi + i)) > 1.5f * far_value;
        if (!springls__vmask_any(doubtful)) {
            springls__vec_store(out + i, springls__vec_load(phi + i));
            continue;
        }
        v = springls__tile_cross_lanes(phi + i);
        sum = springls__known_lanes(v.xm, far_value) + springls__known_lanes(v.xp, far_value)
              + springls__known_lanes(v.ym, far_value) + springls__known_lanes(v.yp, far_value)
              + springls__known_lanes(v.zm, far_value) + springls__known_lanes(v.zp, far_value);
        nearest = springls__vec_min(springls__vec_min(springls__vec_min(springls__vec_abs(v.xm), springls__vec_abs(v.xp)),
                                                      springls__vec_min(springls__vec_abs(v.ym), springls__vec_abs(v.yp))),
                                    springls__vec_min(springls__vec_abs(v.zm), springls__vec_abs(v.zp)));
        nearest = springls__vec_min(nearest + 1.0f, springls__vec_all(far_value));
        nearest = springls__vec_select(sum < 0.0f, -nearest, nearest);
        springls__vec_store(out + i, springls__vec_select(doubtful & (springls__vec_abs(sum) > enough), nearest, v.c));
    }
}

/* springls__remove_speck; true when there was one. */
SPRINGLS__MATHS bool springls__specks_row(SPRINGLS__LOCAL const float *phi, SPRINGLS__GLOBAL float *out)
{
    bool some = false;
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec_cross7 v = springls__tile_cross_lanes(phi + i);
        springls__vec lo = springls__least_lanes(v), hi = springls__most_lanes(v);
        springls__vmask bubble = (v.c >= 0.0f) & (hi < 0.0f), crumb = (v.c < 0.0f) & (lo >= 0.0f);
        some = some || springls__vmask_any(bubble | crumb);
        springls__vec_store(out + i, springls__vec_select(bubble, hi, springls__vec_select(crumb, lo, v.c)));
    }
    return some;
}

#endif
