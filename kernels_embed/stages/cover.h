/* cover.h - every springl becomes a triangle of its own share of the surface (params.cover). Triangles cover the most with the
   centroids, the elongations and the corners of their shares, and halfway up the bend of the surface.

        . ------ .
       /  /\     \         The share of a springl is the part of its tangent plane that is nearer to its particle p than to
      /  /  \     .         those of its neighbours: its Voronoi cell, here of five sides. Its triangle has the cell's area,
     .  /  p \   /          times 1.04, and points to the corners that are furthest out.
      \/______\/
       ' ---- '

   Why: the springs of section 4.3 balance distances of edges, and no area; on a surface that flows they shrink triangles to a
   quarter of it. Renderers and whoever meshes springls need all of the surface, and phi's normals come from triangles of a steady
   size. Particles are where the motion took them: only triangles change. */
#ifndef SPRINGLS__KERNEL_STAGES_COVER_H
#define SPRINGLS__KERNEL_STAGES_COVER_H

#include "../language/simd.h"
#include "../model/model.h"
#include "contract.h"
#include "relax.h"
#include "resample.h"

/* Returns the direction of the first arm of the equilateral triangle that is most like the triangle of s, which faces n. */
SPRINGLS__INNER springls__v3 springls__first_arm(springls__springl s, springls__v3 n)
{
    springls__v3 arm = springls__sub(s.q[0], springls__lerp(s.q[1], s.q[2], 0.5f));
    arm = springls__mad(arm, springls__cross(n, springls__sub(s.q[2], s.q[1])), 0.866025404f);
    arm = springls__normalize(springls__mad(arm, n, -springls__dot(n, arm)));
    return springls__length2(arm) > 0.5f ? arm : springls__any_tangent(n);
}

/* Gives springl i an equilateral triangle about its particle, with short arms, for relax and for finding its neighbors: arms as long as its
   share reach across creases, and turn it too far. A masked one keeps its own. */
SPRINGLS__MATHS void springls__shorten_arms_element(const springls__model *model, springls__arguments args, int i)
{
    const float area = 0.263055214f; /* voxel^2, with arms of 0.45 voxel */
    springls__springl s = model->set.s[i];
    springls__v3 n;
    (void)args;
    if (!model->set.mask[i] && !springls__is_fast_asleep(model, s.p)) {
        n = springls__facing(model, s);
        s = springls__springl_make(springls__equilateral(s.p, n, springls__first_arm(s, n), area), s.p);
    }
    springls__relaxed_springls(model)[i] = s;
}

/* A springl's share of the surface in its tangent plane, as a place x + i y about the particle. */
typedef struct springls__share {
    float area;             /* voxel^2                                                          */
    float x, y;             /* centroid, voxel                                                  */
    float longer, askew;    /* elongation along x, and along the diagonal: at most 1            */
    float cosine, sine;     /* third harmonic about the centroid: the corners                   */
} springls__share;

/* The surface about a particle, as a height over its tangent plane at x, y: slope_x x + slope_y y + bend (x^2 + y^2). */
typedef struct springls__sheet { float slope_x, slope_y, bend; } springls__sheet;

/* Sums of products over the neighbours of a springl, at x, y with the height h, weighted by cosine^2 / r^2, r^2 = x^2 + y^2. */
typedef struct springls__sheet_sums { float xx, xy, yy, xr, yr, rr, xh, yh, rh; } springls__sheet_sums;

SPRINGLS__MATHS void springls__sheet_add(springls__sheet_sums *sum, float x, float y, float h, float cosine2)
{
    float r2 = springls__max(x * x + y * y, 1e-6f), w = cosine2 / r2;
    sum->xx += w * x * x;
    sum->xy += w * x * y;
    sum->yy += w * y * y;
    sum->xr += cosine2 * x;
    sum->yr += cosine2 * y;
    sum->rr += cosine2 * r2;
    sum->xh += w * x * h;
    sum->yh += w * y * h;
    sum->rh += cosine2 * h;
}

/* Returns the sheet of least squares. level: without slopes. Slopes are bounded, because few neighbours, as at the rim of a sheet,
   leave them uncertain. */
SPRINGLS__MATHS springls__sheet springls__fitted_sheet(springls__sheet_sums sum, bool level)
{
    const float flat = 0.5f, steepest = 0.15f; /* flat: damps the slopes of few neighbours */
    springls__sheet sheet;
    float inverse = 1.0f / (sum.rr + 1e-6f), xx, xy, yy, xh, yh, scale, steep2;
    sheet.slope_x = sheet.slope_y = 0.0f;
    if (!level) {
        xx = sum.xx - sum.xr * sum.xr * inverse + flat;
        xy = sum.xy - sum.xr * sum.yr * inverse;
        yy = sum.yy - sum.yr * sum.yr * inverse + flat;
        xh = sum.xh - sum.xr * sum.rh * inverse;
        yh = sum.yh - sum.yr * sum.rh * inverse;
        scale = 1.0f / (xx * yy - xy * xy);
        sheet.slope_x = (yy * xh - xy * yh) * scale;
        sheet.slope_y = (xx * yh - xy * xh) * scale;
        steep2 = sheet.slope_x * sheet.slope_x + sheet.slope_y * sheet.slope_y;
        scale = steep2 > steepest * steepest ? steepest / springls__sqrt(steep2) : 1.0f;
        sheet.slope_x *= scale;
        sheet.slope_y *= scale;
    }
    sheet.bend = (sum.rh - sheet.slope_x * sum.xr - sheet.slope_y * sum.yr) * inverse;
    return sheet;
}

/* A springl's cell in six directions of half a turn, 30 degrees apart, and in the opposite ones: 1 / distance to the nearest
   side, 1 / voxel. The last two of eight are padding. */
typedef struct springls__cell_sides {
    springls__vec ahead[8 / SPRINGLS__LANES], behind[8 / SPRINGLS__LANES];
} springls__cell_sides;

/* cos(k a), sin(k a) of the six directions a for k = 1, 2, 3, after a row of ones. */
SPRINGLS__CONST float springls__share_harmonics[7][8] = {
    { 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 0.0f, 0.0f },
    { 1.0f, 0.866025404f, 0.5f, 0.0f, -0.5f, -0.866025404f, 0.0f, 0.0f },
    { 0.0f, 0.5f, 0.866025404f, 1.0f, 0.866025404f, 0.5f, 0.0f, 0.0f },
    { 1.0f, 0.5f, -0.5f, -1.0f, -0.5f, 0.5f, 0.0f, 0.0f },
    { 0.0f, 0.866025404f, 0.866025404f, 0.0f, -0.866025404f, -0.866025404f, 0.0f, 0.0f },
    { 1.0f, 0.0f, -1.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f },
    { 0.0f, 1.0f, 0.0f, -1.0f, 0.0f, 1.0f, 0.0f, 0.0f }
};

/* Cuts off what lies beyond the line x X + y Y = 1. */
SPRINGLS__VEC_MATHS springls__cell_sides springls__cut_cell(springls__cell_sides sides, float x, float y)
{
    int j;
    for (j = 0; j < 8 / SPRINGLS__LANES; j++) {
        springls__vec cosine = springls__vec_load(springls__share_harmonics[1] + j * SPRINGLS__LANES);
        springls__vec sine = springls__vec_load(springls__share_harmonics[2] + j * SPRINGLS__LANES);
        springls__vec line = cosine * x + sine * y;
        sides.ahead[j] = springls__vec_max(sides.ahead[j], line);
        sides.behind[j] = springls__vec_max(sides.behind[j], -line);
    }
    return sides;
}

/* A power of the cell's width in six directions. */
typedef struct springls__cell_power { springls__vec of[8 / SPRINGLS__LANES]; } springls__cell_power;

/* Sums one over the directions, times a row of the harmonics. */
SPRINGLS__VEC_MATHS float springls__sum_directions(springls__cell_power power, int row)
{
    float product[8];
    int j;
    for (j = 0; j < 8 / SPRINGLS__LANES; j++)
        springls__vec_store(product + j * SPRINGLS__LANES,
                            power.of[j] * springls__vec_load(springls__share_harmonics[row] + j * SPRINGLS__LANES));
    return ((product[0] + product[1]) + (product[2] + product[3])) + (product[4] + product[5]);
}

/* Returns the moments of a cell, about its centroid. With z = x + i y, the mean of z^k is the sum of width^(k + 2) e^(i k a) over the
   directions a, times 30 degrees / (k + 2) / area. */
SPRINGLS__VEC_MATHS springls__share springls__share_of_cell(springls__cell_sides sides)
{
    const float angle = 0.523598776f;
    springls__cell_power second, third, fourth, fifth;
    springls__share share;
    float mean, x, y, xx, xy, spread, scale;
    int j;
    for (j = 0; j < 8 / SPRINGLS__LANES; j++) {
        springls__vec a = 1.0f / sides.ahead[j], a2 = a * a, b = 1.0f / sides.behind[j], b2 = b * b;
        second.of[j] = a2 + b2;
        third.of[j] = a2 * a - b2 * b;
        fourth.of[j] = a2 * a2 + b2 * b2;
        fifth.of[j] = a2 * a2 * a - b2 * b2 * b;
    }
    share.area = angle / 2.0f * springls__sum_directions(second, 0);
    mean = angle / share.area;
    x = share.x = mean / 3.0f * springls__sum_directions(third, 1);
    y = share.y = mean / 3.0f * springls__sum_directions(third, 2);
    spread = mean / 4.0f * springls__sum_directions(fourth, 0) - (x * x + y * y);
    xx = mean / 4.0f * springls__sum_directions(fourth, 3) - (x * x - y * y);
    xy = mean / 4.0f * springls__sum_directions(fourth, 4) - 2.0f * x * y;
    share.longer = xx / spread;
    share.askew = xy / spread;
    /* The mean of z^3 about the centroid c is less by 3 c times the second moment about c, and by c^3. */
    scale = 1.0f / (spread * springls__sqrt(spread));
    share.cosine = mean / 5.0f * springls__sum_directions(fifth, 5) - 3.0f * (x * xx - y * xy) - x * (x * x - 3.0f * y * y);
    share.sine = mean / 5.0f * springls__sum_directions(fifth, 6) - 3.0f * (x * xy + y * xx) - y * (3.0f * x * x - y * y);
    share.cosine *= scale;
    share.sine *= scale;
    return share;
}

/* Measures the part of the tangent plane of springl i, with tangents u and v, that is nearer to it than to its neighbors: its
   Voronoi cell. Those on the other side of a thin sheet do not count; those beyond a crease do, but not in the bend. Fits the
   sheet to them, too: at a sharp edge it has no slopes, since each side has its own. */
SPRINGLS__MATHS springls__share springls__share_of(const springls__model *model, int i, springls__v3 u, springls__v3 v,
                                                   springls__sheet *sheet)
{
    const float opposite2 = 0.09f, widest = 0.75f; /* cosine^2; voxel */
    SPRINGLS__GLOBAL const int *codes = model->cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW;
    springls__v3 p = model->set.s[i].p, n = springls__cross(u, v);
    springls__cell_sides sides;
    springls__sheet_sums sums = { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f };
    bool level = springls__at_edge(model, i);
    int k, j;
    for (j = 0; j < 8 / SPRINGLS__LANES; j++) sides.ahead[j] = sides.behind[j] = springls__vec_broadcast(1.0f / widest);
    for (k = 0; k < SPRINGLS__NEIGHBOR_ROW; k++) {
        SPRINGLS__GLOBAL const springls__springl *o;
        springls__v3 d, area2;
        float facing, cosine2, x, y, d2;
        if (codes[k] < 0) { /* skips the rest of a vertex's list */
            k |= SPRINGLS__MAX_NEIGHBORS - 1;
            continue;
        }
        o = &model->set.s[codes[k] / 3];
        area2 = springls__tri_area2(springls__springl_tri(*o));
        facing = springls__dot(area2, n);
        cosine2 = facing * facing / springls__max(springls__length2(area2), 1e-12f);
        if (facing < 0.0f && cosine2 >= opposite2) continue;
        d = springls__sub(o->p, p);
        d2 = springls__max(springls__length2(d), 1e-6f);
        x = springls__dot(d, u);
        y = springls__dot(d, v);
        if (facing > 0.0f) springls__sheet_add(&sums, x, y, springls__dot(d, n), cosine2);
        level = level || springls__at_edge(model, codes[k] / 3);
        sides = springls__cut_cell(sides, x * (2.0f / d2), y * (2.0f / d2));
    }
    *sheet = springls__fitted_sheet(sums, level);
    return springls__share_of_cell(sides);
}

/* Returns u, turned towards v by a third of the angle of (c, s), accurate to two degrees. */
SPRINGLS__MATHS springls__v3 springls__turn_by_third(springls__v3 u, springls__v3 v, float c, float s)
{
    float along = springls__sqrt(c * c + s * s) + c;
    return springls__mad(springls__scale(u, springls__sqrt(along * along + s * s * (4.0f / 27.0f))), v, s * (2.0f / 3.0f));
}

/* Returns q, stretched about the center as the share is, at the same area. */
SPRINGLS__INNER springls__v3 springls__stretched(springls__v3 q, springls__v3 center, springls__v3 u, springls__v3 v,
                                                 springls__share share)
{
    float c = 0.5f * share.longer, s = 0.5f * share.askew, scale = 1.0f / springls__sqrt(1.0f - (c * c + s * s));
    springls__v3 e = springls__scale(springls__sub(q, center), scale);
    float x = springls__dot(e, u), y = springls__dot(e, v);
    return springls__mad(springls__mad(center, u, x + c * x + s * y), v, y + s * x - c * y);
}

/* Returns t, shrunk about its center until its edges are no longer than `longest`. */
SPRINGLS__MATHS springls__tri springls__with_edges_below(springls__tri t, springls__v3 center, float longest)
{
    float l2 = springls__longest_edge2(t), size = longest / springls__sqrt(springls__max(l2, 1e-12f));
    if (l2 <= longest * longest) return t;
    t.a = springls__lerp(center, t.a, size);
    t.b = springls__lerp(center, t.b, size);
    t.c = springls__lerp(center, t.c, size);
    return t;
}

/* Returns the triangle of a share, with tangents u and v, that faces n and is most like one whose first arm is u. Its center is
   as far below the surface's corners as above its particle. */
SPRINGLS__MATHS springls__tri springls__triangle_of_share(springls__v3 p, springls__v3 n, springls__v3 u, springls__v3 v,
                                                          springls__share share, float bend, float longest_edge)
{
    const float overlap = 1.04f; /* area of the triangle over that of the share */
    const float steady = 0.2f;  /* keeps triangles from turning where their shares have no corners */
    const float highest = 0.1f;  /* voxel */
    float area = overlap * share.area, corner2 = SPRINGLS__RADIUS2_BY_AREA * area;
    float height = springls__clamp(0.5f * bend * corner2, -highest, highest);
    springls__v3 center = springls__mad(springls__mad(springls__mad(p, u, share.x), v, share.y), n, height);
    springls__tri t = springls__equilateral(center, n, springls__turn_by_third(u, v, share.cosine + steady, share.sine), area);
    t.a = springls__stretched(t.a, center, u, v, share);
    t.b = springls__stretched(t.b, center, u, v, share);
    t.c = springls__stretched(t.c, center, u, v, share);
    return springls__with_edges_below(t, center, longest_edge);
}

/* Gives springl i, from S to relaxed_springls, the triangle of its share. Springls that are masked or asleep stay as they are. */
SPRINGLS__MATHS void springls__cover_element(const springls__model *model, springls__arguments args, int i)
{
    const float longest = 0.985f * model->params.split_edge; /* else it would be split for its shape */
    springls__springl s = model->set.s[i];
    springls__share share;
    springls__sheet sheet;
    springls__v3 n, u, v;
    if (springls__is_asleep(model, i)) {
        springls__keep_asleep(model, args, i);
        return;
    }
    if (!model->set.mask[i]) {
        n = springls__facing(model, s);
        u = springls__first_arm(s, n);
        v = springls__cross(n, u);
        share = springls__share_of(model, i, u, v, &sheet);
        n = springls__normalize(springls__mad(springls__mad(n, u, -sheet.slope_x), v, -sheet.slope_y));
        u = springls__normalize(springls__mad(u, n, -springls__dot(u, n)));
        v = springls__cross(n, u);
        s = springls__springl_make(springls__triangle_of_share(s.p, n, u, v, share, sheet.bend, longest), s.p);
    }
    springls__relaxed_springls(model)[i] = s;
}

#endif
