/* contract.h - finds poor springls (section 4.6), and makes good triangles of poor ones. */
#ifndef SPRINGLS__KERNEL_STAGES_CONTRACT_H
#define SPRINGLS__KERNEL_STAGES_CONTRACT_H

#include "../model/cell_list.h"
#include "../model/grid.h"
#include "../model/model.h"
#include "../model/neighborhood.h"

/* Two springls lie on one side of the surface when the cosine of the angle between their normals is larger than this. */
#define SPRINGLS__SAME_SIDE 0.3f

/* Returns the cosine of the angle at a between b and c; 1 (angle 0) where a side has no length. */
SPRINGLS__MATHS float springls__corner_cosine(springls__v3 a, springls__v3 b, springls__v3 c)
{
    springls__v3 ab = springls__sub(b, a), ac = springls__sub(c, a);
    float l2 = springls__length2(ab) * springls__length2(ac);
    return l2 > 1e-12f ? springls__dot(ab, ac) / springls__sqrt(l2) : 1.0f;
}

/* Returns true when an angle lies outside [min, max], given by their cosines, or the area (voxel^2) is too small. */
SPRINGLS__MATHS bool springls__bad_shape(springls__tri t, float cos_min_angle, float cos_max_angle, float min_area)
{
    float a = springls__corner_cosine(t.a, t.b, t.c), b = springls__corner_cosine(t.b, t.c, t.a);
    float c = springls__corner_cosine(t.c, t.a, t.b);
    float largest = springls__max(a, springls__max(b, c)), smallest = springls__min(a, springls__min(b, c));
    float area2 = springls__length2(springls__tri_area2(t));
    return largest > cos_min_angle || smallest < cos_max_angle || area2 < 4.0f * min_area * min_area || area2 < 1e-12f;
}

/* The square of an equilateral triangle's radius over its area, 4 / (3 sqrt 3). */
#define SPRINGLS__RADIUS2_BY_AREA 0.769800359f

/* Returns an equilateral triangle about p, facing n, of the given area (voxel^2); its first vertex lies in the direction
   `toward`. */
SPRINGLS__MATHS springls__tri springls__equilateral(springls__v3 p, springls__v3 n, springls__v3 toward, float area)
{
    float radius = springls__sqrt(area * SPRINGLS__RADIUS2_BY_AREA);
    springls__v3 u = springls__sub(toward, springls__scale(n, springls__dot(toward, n))), v;
    springls__tri t;
    u = springls__length2(u) < 1e-8f ? springls__any_tangent(n) : springls__normalize(u);
    v = springls__cross(n, u);
    t.a = springls__mad(p, u, radius);
    t.b = springls__mad(springls__mad(p, u, -0.5f * radius), v, 0.866025404f * radius);
    t.c = springls__mad(springls__mad(p, u, -0.5f * radius), v, -0.866025404f * radius);
    return t;
}

/* Returns the direction that springl s faces: its normal or, where its triangle has no area, that of phi. */
SPRINGLS__MATHS springls__v3 springls__facing(const springls__model *model, springls__springl s)
{
    springls__v3 area2 = springls__tri_area2(springls__springl_tri(s)), n;
    n = springls__normalize(springls__length(area2) > 2e-4f ? area2
                                                            : springls__grid_gradient(&model->grid, model->grid.phi, s.p));
    return springls__length2(n) < 0.5f ? springls__v3_make(0.0f, 0.0f, 1.0f) : n;
}

/* Returns true when a neighbor at d from a springl, facing n_other, lies behind it on the other side of the same thin sheet: phi
   cannot represent a sheet thinner than a voxel, so a springl there may be far from the zero level and yet be right. */
SPRINGLS__MATHS bool springls__is_far_side(springls__v3 d, springls__v3 n, springls__v3 n_other)
{
    const float range = 1.6f, aside = 1.0f; /* voxels */
    float depth = -springls__dot(d, n), d2 = springls__length2(d);
    return springls__dot(n, n_other) < -0.5f && depth > -0.1f && d2 < range * range && d2 - depth * depth < aside * aside;
}

/* Returns true when a neighbor at d from a springl, facing n_other, lies beside it, on the same side or round the sheet's rim. */
SPRINGLS__MATHS bool springls__is_beside(springls__v3 d, springls__v3 n, springls__v3 n_other)
{
    const float range = 1.5f; /* voxels */
    return springls__dot(n, n_other) > -0.2f && springls__length2(d) < range * range;
}

/* Returns phi at x. Beyond the domain samples are constant, so the distance to it is added: springls pushed out of the grid are
   far from the zero level. */
SPRINGLS__INNER float springls__phi_or_beyond(const springls__grid *g, springls__v3 x)
{
    springls__v3 border = springls__v3_make(springls__clamp(x.x, -1.0f, (float)g->size[0]),
                                            springls__clamp(x.y, -1.0f, (float)g->size[1]),
                                            springls__clamp(x.z, -1.0f, (float)g->size[2]));
    return springls__grid_sample(g, g->phi, x) + springls__length(springls__sub(x, border));
}

SPRINGLS__MATHS void springls__sample_phi_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    if (!springls__is_asleep(model, i)) model->set.phi[i] = springls__phi_or_beyond(&model->grid, model->set.s[i].p);
}

/* Returns true if springl i, far from the zero level, belongs to a sheet too thin for phi: if the sheet's other side is behind the
   springl or, at the rim and where the other side has no springls, if enough neighbors are beside it. phi is outside in front of such a
   springl; in front of springls left over where two bodies have merged, phi is inside. */
SPRINGLS__MATHS bool springls__on_thin_sheet(const springls__model *model, int i)
{
    const float r = 1.6f, ahead = 1.5f;
    const int enough = 3;
    SPRINGLS__GLOBAL const springls__springl *s = &model->set.s[i];
    springls__v3 n = springls__springl_normal(*s);
    springls__cell_walk walk;
    int other, beside = 0;
    bool edge = false;
    if (model->set.phi[i] > model->grid.far_value) return false; /* pushed out of the grid */
    if (springls__phi_or_beyond(&model->grid, springls__mad(s->p, n, ahead)) <= 0.0f) return false;
    walk = springls__cell_walk_near(model, s->p, r);
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        springls__v3 d = springls__sub(model->set.s[other].p, s->p), m;
        if (other == i || springls__length2(d) > r * r) continue;
        m = springls__springl_normal(model->set.s[other]);
        if (springls__is_far_side(d, n, m)) return true;
        edge = edge || springls__at_edge(model, other);
        beside += springls__is_beside(d, n, m);
    }
    return !edge && beside >= enough && model->set.phi[i] > 0.0f; /* beyond a sharp edge the neighbors look the same */
}

/* Returns true when springl i, of a sheet, faces others across a gap narrower than phi can represent: phi may be inside in front
   of both, but the bodies have not met, and part again as they were. Where they have met, most springls that oppose it are behind
   it. */
SPRINGLS__MATHS bool springls__at_gap(const springls__model *model, int i)
{
    const float r = 2.0f, aside = 1.3f; /* voxels */
    const int enough = 2, enough_beside = 3;
    springls__springl s = model->set.s[i];
    springls__v3 n = springls__springl_normal(s);
    springls__cell_walk walk = springls__cell_walk_near(model, s.p, r);
    int other, across = 0, facing = 0, beside = 0;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        springls__v3 d = springls__sub(model->set.s[other].p, s.p), m = springls__springl_normal(model->set.s[other]);
        float d2 = springls__length2(d), ahead = springls__dot(d, n);
        if (other == i || d2 > r * r) continue;
        beside += springls__dot(n, m) > 0.5f;
        if (d2 - ahead * ahead > aside * aside || springls__dot(n, m) >= SPRINGLS__FACING_AGAINST) continue;
        across += springls__across_gap(d, n, m);
        facing++;
    }
    return beside >= enough_beside && across >= enough && 2 * across >= facing;
}

/* Returns true when phi is inside in front of a springl: bodies have met there, and only springls left between them keep phi near
   zero in the projection. */
SPRINGLS__MATHS bool springls__is_buried(const springls__model *model, springls__springl s)
{
    const float ahead = 0.75f, deep = -0.2f;
    return springls__phi_or_beyond(&model->grid, springls__mad(s.p, springls__springl_normal(s), ahead)) < deep;
}

/* Returns true when what lies over a springl is another body: each of the two keeps its surface. */
SPRINGLS__MATHS bool springls__in_another_body(const springls__model *model, int i)
{
    const float ahead = 0.75f, radius = 1.6f; /* voxels */
    springls__springl s = model->set.s[i];
    if (model->params.contact != SPRINGLS_CONTACT_SEPARATE) return false;
    if (model->set.overlapped[i]) return true;
    return springls__side_of_springls(model, springls__mad(s.p, springls__springl_normal(s), ahead), i, radius) < 0;
}

/* ---- parts that phi has lost ---- */

#define SPRINGLS__MOST_LINKED 128 /* springls of a part: larger ones are not looked for */

/* Springls that hang together: the neighbors of the first `expanded` of them are there too. */
typedef struct springls__linked_part {
    int at[SPRINGLS__MOST_LINKED], count, expanded;
} springls__linked_part;

/* Adds a springl, unless it is there; returns false when there is no room. */
SPRINGLS__MATHS bool springls__link_springl(springls__linked_part *part, int i)
{
    int k;
    for (k = 0; k < part->count; k++)
        if (part->at[k] == i) return true;
    if (part->count == SPRINGLS__MOST_LINKED) return false;
    part->at[part->count++] = i;
    return true;
}

/* Adds the springls beside the last one and behind it, but not those across a gap; returns false when there is no room. From the last
   one a part grows straight on: a large one has no more room soon. */
SPRINGLS__MATHS bool springls__link_neighbors(const springls__model *model, springls__linked_part *part)
{
    const float r = 1.6f; /* voxels */
    const int i = part->at[part->count - 1];
    const springls__springl s = model->set.s[i];
    const springls__v3 n = springls__springl_normal(s);
    springls__cell_walk walk = springls__cell_walk_near(model, s.p, r);
    int other;
    part->at[part->count - 1] = part->at[part->expanded];
    part->at[part->expanded++] = i;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        springls__v3 d = springls__sub(model->set.s[other].p, s.p);
        if (springls__length2(d) > r * r || springls__across_gap(d, n, springls__springl_normal(model->set.s[other]))) continue;
        if (!springls__link_springl(part, other)) return false;
    }
    return true;
}

/* Returns true when phi has no surface where springl i is: it has one sign before and behind it. model->set.phi is not read: springls
   that are asleep have an older one there, and snapshots have none. */
SPRINGLS__MATHS bool springls__has_lost_surface(const springls__model *model, int i)
{
    const float near_enough = 0.1f, step = 0.25f; /* voxels */
    const springls__springl s = model->set.s[i];
    const springls__v3 n = springls__springl_normal(s);
    if (springls__fabs(springls__phi_or_beyond(&model->grid, s.p)) < near_enough) return false;
    return (springls__phi_or_beyond(&model->grid, springls__mad(s.p, n, step)) < 0.0f)
        == (springls__phi_or_beyond(&model->grid, springls__mad(s.p, n, -step)) < 0.0f);
}

/* Returns true when a whole part is closed, phi has lost all of it, and it is smaller than min_component: by the volume behind its
   triangles, or by that of a ball as wide less half a voxel on each side, to which samples know a surface. */
SPRINGLS__MATHS bool springls__is_small_lost_part(const springls__model *model, const springls__linked_part *part)
{
    const float ball = 0.523598776f, open = 0.5f; /* pi / 6; share of the area that faces one way */
    const springls__v3 tip = model->set.s[part->at[0]].p;
    springls__box box = springls__box_empty();
    springls__v3 size, facing = springls__v3_make(0.0f, 0.0f, 0.0f);
    float volume = 0.0f, area = 0.0f, width;
    int k;
    for (k = 0; k < part->count; k++) {
        const springls__springl s = model->set.s[part->at[k]];
        const springls__v3 area2 = springls__tri_area2(springls__springl_tri(s));
        box = springls__box_add(box, s.p);
        if (!springls__has_lost_surface(model, part->at[k])) return false;
        facing = springls__add(facing, area2);
        area += springls__length(area2);
        volume += springls__dot(springls__sub(s.p, tip), area2) / 6.0f;
    }
    if (springls__length(facing) > open * area) return false;
    size = springls__sub(box.upper, box.lower);
    width = springls__max(springls__max(size.x, springls__max(size.y, size.z)) - 1.0f, 0.0f);
    return springls__min(springls__fabs(volume), ball * width * width * width) < model->params.min_component;
}

/* Returns true when springl i is of a drop or bubble of less than min_component that phi has lost. */
SPRINGLS__MATHS bool springls__of_lost_part(const springls__model *model, int i)
{
    springls__linked_part part;
    if (model->params.min_component <= 0.0f || model->params.topology != SPRINGLS_TOPOLOGY_FREE) return false;
    if (!springls__has_lost_surface(model, i)) return false;
    part.at[0] = i;
    part.count = 1;
    part.expanded = 0;
    while (part.expanded < part.count)
        if (!springls__link_neighbors(model, &part)) return false;
    return springls__is_small_lost_part(model, &part);
}

/* Returns true when springl i, far from the zero level or buried, is of a sheet or gap that phi cannot represent. */
SPRINGLS__MATHS bool springls__stays_thin(const springls__model *model, int i, bool buried)
{
    return model->params.keep_thin && ((!buried && springls__on_thin_sheet(model, i)) || springls__at_gap(model, i));
}

/* Decides whether to keep, remove or reshape springl i (contract_action). Springls that are masked or asleep are kept. */
SPRINGLS__MATHS void springls__contract_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL uint8_t *action = springls__contract_action(model) + i;
    springls__springl s = model->set.s[i];
    springls__tri t = springls__springl_tri(s);
    bool buried, distant;
    *action = SPRINGLS__KEEP;
    if (model->set.mask[i] || springls__is_asleep(model, i)) return;
    buried = model->params.project_level_set && springls__is_buried(model, s);
    distant = springls__fabs(model->set.phi[i]) > model->params.contract_distance;
    if ((((buried || distant) && !springls__stays_thin(model, i, buried)) || springls__of_lost_part(model, i))
        && !springls__in_another_body(model, i))
        *action = SPRINGLS__REMOVE;
    else if (springls__bad_shape(t, args.contract.min_angle_cosine, args.contract.max_angle_cosine, model->params.min_area))
        *action = model->params.reshape ? SPRINGLS__RESHAPE : SPRINGLS__REMOVE;
}

/* Gives springl i a good shape about the same particle, which keeps its exact path and correspondence. */
SPRINGLS__MATHS void springls__reshape_element(const springls__model *model, springls__arguments args, int i)
{
    const float smallest = 0.15f; /* voxel^2: a collapsed triangle must come near its neighbors again */
    springls__springl s = model->set.s[i];
    springls__tri t = springls__springl_tri(s);
    float area = 0.5f * springls__length(springls__tri_area2(t));
    (void)args;
    if (springls__contract_action(model)[i] != SPRINGLS__RESHAPE) return;
    t = springls__equilateral(s.p, springls__facing(model, s), springls__sub(t.a, s.p), springls__max(area, smallest));
    model->set.s[i] = springls__springl_make(t, s.p);
}

/* Returns true when springl `other` outranks springl i in a merger: those of the mask come first, then the older. */
SPRINGLS__MATHS bool springls__outranks(const springls__model *model, int other, int i)
{
    if (model->set.mask[other] || model->set.generation[other] < model->set.generation[i]) return true;
    return model->set.generation[other] == model->set.generation[i] && other < i;
}

/* Returns true when springls i, with normal n, and `other` are of one side and body and closer than merge_distance: the one of
   lower rank is removed. */
SPRINGLS__MATHS bool springls__merges(const springls__model *model, int i, springls__v3 n, int other)
{
    const float r = model->params.merge_distance;
    SPRINGLS__GLOBAL const springls__springl *s = &model->set.s[i], *o = &model->set.s[other];
    return springls__length2(springls__sub(o->p, s->p)) < r * r
        && springls__dot(springls__springl_normal(*o), n) > SPRINGLS__SAME_SIDE
        && !springls__of_two_contact_bodies(model, i, other);
}

/* Returns the action for undecided springl i after a round of merging. The springl stays undecided until every partner of higher rank
   is decided: so only springls that are kept remove others. */
SPRINGLS__MATHS uint8_t springls__resolve_merge(const springls__model *model, SPRINGLS__GLOBAL const uint8_t *action, int i)
{
    springls__v3 n = springls__springl_normal(model->set.s[i]);
    springls__cell_walk walk = springls__cell_walk_near(model, model->set.s[i].p, model->params.merge_distance);
    uint8_t decided = SPRINGLS__KEEP;
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        if (action[other] == SPRINGLS__REMOVE || !springls__outranks(model, other, i)) continue;
        if (!springls__merges(model, i, n, other)) continue;
        if (action[other] == SPRINGLS__KEEP) return SPRINGLS__REMOVE;
        decided = SPRINGLS__UNDECIDED;
    }
    return decided;
}

SPRINGLS__MATHS void springls__merge_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL const uint8_t *action = springls__contract_action(model);
    uint8_t current = action[i];
    (void)args;
    if (current == SPRINGLS__UNDECIDED) current = springls__resolve_merge(model, action, i);
    springls__next_contract_action(model)[i] = current;
}

/* Marks springl i as undecided unless it is removed already, masked or asleep. */
SPRINGLS__MATHS void springls__merge_begin_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL uint8_t *action = springls__contract_action(model) + i;
    (void)args;
    if (*action != SPRINGLS__REMOVE && !model->set.mask[i] && !springls__is_asleep(model, i)) *action = SPRINGLS__UNDECIDED;
}

#endif
