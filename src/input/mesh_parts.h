/* mesh_parts.h - turns the parts of a mesh so that they face outwards.

   Files have parts that are inside out: a tool appends or mirrors them, an exporter loses the sign of a scale. A part is a patch of
   triangles that hang together by edges of two triangles, and are made to face alike; each part is judged on its own.

     closed:  by its signed volume, positive when it faces outwards, and by w, the winding number that the parts around it give.
              In empty space (w = 0) it must face outwards. In a solid (w = 1) it may face either way: inwards it is a hollow,
              outwards a solid within a solid, which bounds nothing. So a part is turned where w would fall below 0 in it.
              A part that is turned takes along what lies in it: hollow balls that are inside out as a whole stay hollow.

                 w = 0  | 1 | 0 (hollow) | 1 | 0              both facing outwards:  0 | 1 | 2 | 1 | 0
                        outer    inner, facing inwards

     open:    by sight: from the front of its triangles more rays must get past all others than from their backs. Parts that see no
              difference take the side that the others leave them: their back is where those wind around more. Where that decides nothing
              either, they stay together as they came, turned where their common volume is negative. */
#ifndef SPRINGLS__INPUT_MESH_PARTS_H
#define SPRINGLS__INPUT_MESH_PARTS_H

#include "../model/ray.h"
#include "../model/winding_number.h"
#include "mesh_intake.h"

enum { SPRINGLS__MESH_UNREACHED = 2 }; /* a value of springls__mesh_intake.turn */

typedef struct springls__mesh_part {
    int first, count;         /* its triangles in springls__mesh_intake.queue                        */
    float lower[3], upper[3]; /* voxels                                                              */
    double volume;            /* of a closed part, voxel^3: positive when it faces outwards          */
    bool closed;              /* or nearly: its holes are a small share of its area                  */
    bool seen;                /* open, and one side sees more than the other                         */
    bool turned;              /* before it is judged: its container is                               */
    int around;               /* the sum over the parts around it: 1 facing outwards, -1 inwards     */
    bool nested;              /* there are parts around it                                           */
} springls__mesh_part;

/* Holds the parts of a mesh. outwards: -1 in a mirrored world, whose voxel coordinates turn every triangle round, else 1. */
typedef struct springls__mesh_parts {
    springls__mesh_intake *mesh;
    springls__mesh_part *part;
    springls__surface all, container; /* all triangles; those of one part, or of those that have been judged */
    int count;
    double outwards;
    springls__buffer memory, keys_memory;
} springls__mesh_parts;

/* ---- finding them ---- */

/* Orients the part around `seed` like the seed. Writes it to m->queue from `first` on, m->turn of its triangles, and in area[0] and
   area[1] twice the area not turned and turned, voxel^2. Returns the number of its triangles. */
SPRINGLS__FN int springls__mesh_orient_part(springls__mesh_intake *m, int seed, int first, double area[2])
{
    int head = first, tail = first, k;
    area[0] = area[1] = 0.0;
    m->turn[seed] = 0;
    m->queue[tail++] = seed;
    while (head < tail) {
        int t = m->queue[head++];
        area[m->turn[t]] += springls__mesh_double_area(m, t);
        for (k = 0; k < 3; k++) {
            int h = 3 * t + k, other, same;
            const springls__mesh_edge *edge = &m->edges[m->edge[h]];
            if (edge->count != 2) continue;
            other = edge->half[0] == h ? edge->half[1] : edge->half[0];
            if (m->turn[other / 3] != SPRINGLS__MESH_UNREACHED) continue;
            same = springls__mesh_direction(m, h) == springls__mesh_direction(m, other);
            m->turn[other / 3] = (uint8_t)(m->turn[t] ^ same);
            m->queue[tail++] = other / 3;
        }
    }
    return tail - first;
}

SPRINGLS__FN void springls__mesh_turn_part(springls__mesh_intake *m, const springls__mesh_part *part)
{
    int i;
    for (i = part->first; i < part->first + part->count; i++) m->turn[m->queue[i]] ^= 1;
}

/* Finds the parts, and writes m->turn so that neighbors agree: what has the smaller area of a part is turned. */
SPRINGLS__FN springls_status springls__mesh_find_parts(springls_context *ctx, springls__mesh_parts *p)
{
    springls__mesh_intake *m = p->mesh;
    double area[2];
    int seed, first = 0;
    memset(m->turn, SPRINGLS__MESH_UNREACHED, (size_t)m->count);
    for (seed = 0; seed < m->count; seed++) {
        springls__mesh_part *part;
        if (m->turn[seed] != SPRINGLS__MESH_UNREACHED) continue;
        SPRINGLS__TRY(springls__buffer_grow(ctx, &p->memory, (size_t)p->count + 1, sizeof *part, (size_t)p->count * sizeof *part));
        p->part = (springls__mesh_part *)p->memory.data;
        part = &p->part[p->count++];
        memset(part, 0, sizeof *part);
        part->first = first;
        part->count = springls__mesh_orient_part(m, seed, first, area);
        if (area[1] > area[0]) springls__mesh_turn_part(m, part);
        first += part->count;
    }
    return SPRINGLS_OK;
}

/* Computes the bounds of a part. */
SPRINGLS__FN void springls__mesh_bound_part(const springls__mesh_intake *m, springls__mesh_part *part)
{
    int i, k;
    for (k = 0; k < 3; k++) { part->lower[k] = FLT_MAX; part->upper[k] = -FLT_MAX; }
    for (i = 3 * part->first; i < 3 * (part->first + part->count); i++) {
        const springls__v3 x = m->point[m->corner[3 * m->queue[i / 3] + i % 3]];
        const float c[3] = { x.x, x.y, x.z };
        for (k = 0; k < 3; k++) {
            part->lower[k] = springls__min(part->lower[k], c[k]);
            part->upper[k] = springls__max(part->upper[k], c[k]);
        }
    }
}

/* Computes the volume of a part, and whether it is closed: then its directed areas add up to nothing. */
SPRINGLS__FN void springls__mesh_measure_part(const springls__mesh_parts *p, springls__mesh_part *part)
{
    const double largest_hole = 0.05; /* share of the area */
    double center[3], sum[3] = { 0.0, 0.0, 0.0 }, area = 0.0;
    int i, k;
    for (k = 0; k < 3; k++) center[k] = 0.5 * ((double)part->lower[k] + (double)part->upper[k]);
    for (i = part->first; i < part->first + part->count; i++) {
        double q[3][3], n[3];
        springls__mesh_triangle_at(p->mesh, p->mesh->queue[i], center, q, n);
        area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (k = 0; k < 3; k++) {
            sum[k] += n[k];
            part->volume += p->outwards * n[k] * q[0][k] / 6.0;
        }
    }
    part->closed = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) <= largest_hole * area;
}

/* ---- closed parts: nesting ---- */

SPRINGLS__FN bool springls__mesh_bounds_contain(const springls__mesh_part *outer, const springls__mesh_part *inner)
{
    int k;
    for (k = 0; k < 3; k++)
        if (inner->lower[k] < outer->lower[k] || inner->upper[k] > outer->upper[k]) return false;
    return true;
}

/* Lists closed parts so that each comes before those that it may contain: by falling size of their bounds. Returns how many. */
SPRINGLS__FN springls_status springls__mesh_sort_parts(springls_context *ctx, springls__mesh_parts *p, uint64_t **keys, int *count)
{
    int i;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &p->keys_memory, (size_t)p->count, sizeof **keys, 0));
    *keys = (uint64_t *)p->keys_memory.data;
    *count = 0;
    for (i = 0; i < p->count; i++) {
        const springls__mesh_part *part = &p->part[i];
        float size = 0.0f;
        int k;
        for (k = 0; k < 3; k++) size += part->upper[k] - part->lower[k];
        if (part->closed) (*keys)[(*count)++] = (uint64_t)~springls__float_bits(size) << 32 | (uint64_t)i;
    }
    springls__sort_keys(*keys, (size_t)*count);
    return SPRINGLS_OK;
}

/* Builds p->container, the surface of a part. */
SPRINGLS__FN springls_status springls__mesh_part_surface(springls_context *ctx, springls__mesh_parts *p,
                                                         const springls__mesh_part *part)
{
    int i;
    SPRINGLS__TRY(springls__surface_reserve(ctx, &p->container, part->count));
    for (i = 0; i < part->count; i++)
        springls__mesh_corners(p->mesh, p->mesh->queue[part->first + i], p->container.points + 3 * i);
    SPRINGLS__TRY(springls__surface_finish(ctx, &p->container, part->count));
    return springls__surface_make_dipoles(ctx, &p->container);
}

/* Returns whether two of three triangles of a part lie in p->container. */
SPRINGLS__FN bool springls__mesh_part_inside(const springls__mesh_parts *p, const springls__mesh_part *part)
{
    int inside = 0, i;
    for (i = 0; i < 3; i++) {
        springls__v3 q[3];
        springls__tri t;
        springls__mesh_corners(p->mesh, p->mesh->queue[part->first + (int)((int64_t)part->count * (2 * i + 1) / 6)], q);
        t.a = q[0]; t.b = q[1]; t.c = q[2];
        inside += springls__fabs(springls__surface_winding(&p->container, springls__tri_centroid(t), 2.5f)) > 0.5f;
    }
    return inside >= 2;
}

/* Adds a part that has been judged to what lies in it: keys[0 .. count) are the parts that come after it. */
SPRINGLS__FN springls_status springls__mesh_contain(springls_context *ctx, springls__mesh_parts *p, const springls__mesh_part *outer,
                                                    int facing, const uint64_t *keys, int count)
{
    bool ready = false;
    int i;
    for (i = 0; i < count; i++) {
        springls__mesh_part *inner = &p->part[(int)(keys[i] & 0x7fffffffu)];
        if (!springls__mesh_bounds_contain(outer, inner)) continue;
        if (!ready) SPRINGLS__TRY(springls__mesh_part_surface(ctx, p, outer));
        ready = true;
        if (!springls__mesh_part_inside(p, inner)) continue;
        inner->nested = true;
        inner->around += facing;
        inner->turned = outer->turned;
    }
    return SPRINGLS_OK;
}

/* Decides which closed parts are turned. */
SPRINGLS__FN springls_status springls__mesh_judge_closed(springls_context *ctx, springls__mesh_parts *p)
{
    uint64_t *keys;
    int i, count;
    SPRINGLS__TRY(springls__mesh_sort_parts(ctx, p, &keys, &count));
    for (i = 0; i < count; i++) {
        springls__mesh_part *part = &p->part[(int)(keys[i] & 0x7fffffffu)];
        int facing = (part->volume < 0.0) != part->turned ? -1 : 1;
        if (part->around + facing < 0) {
            part->turned = !part->turned;
            facing = -facing;
        }
        SPRINGLS__TRY(springls__mesh_contain(ctx, p, part, facing, keys + i + 1, count - i - 1));
    }
    return SPRINGLS_OK;
}

/* ---- open parts: sight ---- */

/* Returns direction i of 24 that spread over the sphere along no axis, plane or diagonal. */
SPRINGLS__FN springls__v3 springls__sight_direction(int i)
{
    float c[3] = { 0.2031f, 0.4729f, 0.8574f }, d[3];
    int k;
    for (k = 0; k < 3; k++) d[k] = (i / 3) >> k & 1 ? -c[(i + k) % 3] : c[(i + k) % 3];
    return springls__v3_make(d[0], d[1], d[2]);
}

/* Counts the rays from a triangle that get past all others: seen[0] from its front, seen[1] from its back. */
SPRINGLS__FN void springls__mesh_look(const springls__mesh_parts *p, int triangle, int seen[2])
{
    const float off = 1e-3f, furthest = 4e6f, grazing = 0.1f; /* of the triangle's size; voxels; cosine */
    springls__v3 q[3], center, normal;
    springls__tri t;
    float size;
    int i;
    springls__mesh_corners(p->mesh, triangle, q);
    t.a = q[0]; t.b = q[1]; t.c = q[2];
    center = springls__tri_centroid(t);
    normal = springls__scale(springls__tri_normal(t), (float)p->outwards);
    size = springls__sqrt(springls__length(springls__tri_area2(t)));
    for (i = 0; i < 24; i++) {
        const springls__v3 d = springls__sight_direction(i);
        const float along = springls__dot(d, normal);
        if (springls__fabs(along) < grazing) continue;
        if (springls__surface_ray(&p->all, springls__mad(center, d, off * size), d, furthest).triangle < 0) seen[along < 0.0f]++;
    }
}

/* Decides by the view from sixteen places of equal shares of its area whether an open part is turned. */
SPRINGLS__FN void springls__mesh_judge_open(const springls__mesh_parts *p, springls__mesh_part *part)
{
    const int clear = 8; /* rays; and one side must have half as many again as the other */
    double area = 0.0, sum = 0.0, next = 0.5; /* sixteenths of the area: where the next place is */
    int i, seen[2] = { 0, 0 };
    for (i = part->first; i < part->first + part->count; i++) area += springls__mesh_double_area(p->mesh, p->mesh->queue[i]);
    for (i = part->first; i < part->first + part->count; i++) {
        sum += springls__mesh_double_area(p->mesh, p->mesh->queue[i]);
        if (!(16.0 * sum >= next * area) || !(area > 0.0)) continue;
        springls__mesh_look(p, p->mesh->queue[i], seen);
        while (16.0 * sum >= next * area && next < 16.0) next += 1.0;
    }
    part->turned = 2 * seen[1] > 3 * seen[0];
    part->seen = seen[0] + seen[1] >= clear && (part->turned || 2 * seen[0] > 3 * seen[1]);
    part->turned = part->turned && part->seen;
}

/* Builds p->all, the surface of all triangles. */
SPRINGLS__FN springls_status springls__mesh_all_surface(springls_context *ctx, springls__mesh_parts *p)
{
    int t;
    SPRINGLS__TRY(springls__surface_reserve(ctx, &p->all, p->mesh->count));
    for (t = 0; t < p->mesh->count; t++) springls__mesh_corners(p->mesh, t, p->all.points + 3 * t);
    return springls__surface_finish(ctx, &p->all, p->mesh->count);
}

/* Returns the volume of the open parts without a view about their common center, voxel^3: positive when they face outwards. */
SPRINGLS__FN double springls__mesh_blind_volume(const springls__mesh_parts *p)
{
    double center[3] = { 0.0, 0.0, 0.0 }, weight = 0.0, volume = 0.0, q[3][3], n[3];
    int pass, i, j, k;
    for (pass = 0; pass < 2; pass++) {
        const double middle[3] = { center[0], center[1], center[2] };
        for (i = 0; i < p->count; i++) {
            const springls__mesh_part *part = &p->part[i];
            for (j = part->first; !part->closed && !part->seen && j < part->first + part->count; j++) {
                double area = springls__mesh_double_area(p->mesh, p->mesh->queue[j]);
                springls__mesh_triangle_at(p->mesh, p->mesh->queue[j], middle, q, n);
                for (k = 0; k < 3; k++) {
                    if (pass == 0) center[k] += area * (q[0][k] + q[1][k] + q[2][k]) / 3.0;
                    else volume += p->outwards * n[k] * q[0][k] / 6.0;
                }
                weight += area;
            }
        }
        for (k = 0; pass == 0 && k < 3; k++) center[k] = weight > 0.0 ? center[k] / weight : 0.0;
    }
    return volume;
}

/* Builds p->container, the surface of all parts that have been judged, as they face. Returns how many triangles it has in *count. */
SPRINGLS__FN springls_status springls__mesh_judged_surface(springls_context *ctx, springls__mesh_parts *p, int *count)
{
    int i, j;
    *count = 0;
    SPRINGLS__TRY(springls__surface_reserve(ctx, &p->container, p->mesh->count));
    for (i = 0; i < p->count; i++) {
        const springls__mesh_part *part = &p->part[i];
        for (j = part->first; (part->closed || part->seen) && j < part->first + part->count; j++) {
            springls__v3 *q = p->container.points + 3 * (*count)++, second;
            springls__mesh_corners(p->mesh, p->mesh->queue[j], q);
            if (!part->turned) continue;
            second = q[1]; q[1] = q[2]; q[2] = second;
        }
    }
    if (!*count) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__surface_finish(ctx, &p->container, *count));
    return springls__surface_make_dipoles(ctx, &p->container);
}

/* Returns how much more p->container winds around the backs of a part's triangles than around their fronts, in the mean of up to
   sixteen. */
SPRINGLS__FN float springls__mesh_lean(const springls__mesh_parts *p, const springls__mesh_part *part)
{
    const float off = 0.3f; /* of the triangle's size */
    const int step = part->count / 16 + 1;
    float sum = 0.0f;
    int i, n = 0;
    for (i = part->first; i < part->first + part->count; i += step) {
        springls__v3 q[3], center, normal;
        springls__tri t;
        float size;
        springls__mesh_corners(p->mesh, p->mesh->queue[i], q);
        t.a = q[0]; t.b = q[1]; t.c = q[2];
        center = springls__tri_centroid(t);
        size = springls__sqrt(springls__length(springls__tri_area2(t)));
        normal = springls__scale(springls__tri_normal(t), (float)p->outwards * off * size);
        sum += springls__surface_winding(&p->container, springls__sub(center, normal), 2.5f)
               - springls__surface_winding(&p->container, springls__add(center, normal), 2.5f);
        n++;
    }
    return (float)p->outwards * sum / (float)n;
}

/* Judges open parts without a view: by the winding number of those that have been judged, else by their common volume. */
SPRINGLS__FN springls_status springls__mesh_judge_blind(springls_context *ctx, springls__mesh_parts *p)
{
    const float clear = 0.05f; /* winding number */
    const bool turn_rest = springls__mesh_blind_volume(p) < 0.0;
    int i, judged, blind = 0;
    for (i = 0; i < p->count; i++) blind += !p->part[i].closed && !p->part[i].seen;
    if (!blind) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__mesh_judged_surface(ctx, p, &judged));
    for (i = 0; i < p->count; i++) {
        springls__mesh_part *part = &p->part[i];
        float lean;
        if (part->closed || part->seen) continue;
        lean = judged ? springls__mesh_lean(p, part) : 0.0f;
        part->turned = springls__fabs(lean) > clear ? lean < 0.0f : turn_rest;
    }
    return SPRINGLS_OK;
}

/* ---- all ---- */

/* Decides for each part whether it is turned. */
SPRINGLS__FN springls_status springls__mesh_judge_parts(springls_context *ctx, springls__mesh_parts *p)
{
    int i, open = 0;
    SPRINGLS__TRY(springls__mesh_find_parts(ctx, p));
    for (i = 0; i < p->count; i++) {
        springls__mesh_bound_part(p->mesh, &p->part[i]);
        springls__mesh_measure_part(p, &p->part[i]);
        open += !p->part[i].closed;
    }
    SPRINGLS__TRY(springls__mesh_judge_closed(ctx, p));
    if (!open) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__mesh_all_surface(ctx, p));
    for (i = 0; i < p->count; i++)
        if (!p->part[i].closed) springls__mesh_judge_open(p, &p->part[i]);
    return springls__mesh_judge_blind(ctx, p);
}

/* Writes m->turn so that neighbors agree and every part faces outwards, and the report's numbers of parts. */
SPRINGLS__FN springls_status springls__mesh_face_outwards(springls_context *ctx, springls__mesh_intake *m, bool mirrored,
                                                          springls_mesh_report *report)
{
    springls__mesh_parts p;
    springls_status status;
    int i;
    memset(&p, 0, sizeof p);
    p.mesh = m;
    p.outwards = mirrored ? -1.0 : 1.0;
    status = springls__mesh_judge_parts(ctx, &p);
    for (i = 0; status == SPRINGLS_OK && i < p.count; i++) {
        if (p.part[i].turned) springls__mesh_turn_part(m, &p.part[i]);
        report->parts_turned += p.part[i].turned;
        report->parts_nested += p.part[i].nested;
    }
    report->flipped = status == SPRINGLS_OK && p.count > 0 && report->parts_turned == p.count;
    springls__surface_free(ctx, &p.all);
    springls__surface_free(ctx, &p.container);
    springls__buffer_free(ctx, &p.memory);
    springls__buffer_free(ctx, &p.keys_memory);
    return status;
}

#endif
