/* sheets.h - keeps the two sheets of a wall together. Each springl faces a label: the body whose opposed sheet lies in front of it. That is
   an attribute, so that it comes along when springls split and fill; it changes where bodies meet or part. Sheets that have come
   apart, or passed through each other, by more than a dead band go half way to each other.

   Why a dead band: a sheet is known to a hundredth of a voxel, and the mean of two sheets is smoother than either. Drawn together in every
   step they would be smoothed in every step; left alone they drift. */
#ifndef SPRINGLS__TILING_SHEETS_H
#define SPRINGLS__TILING_SHEETS_H

#include "../../kernels_embed/stages/project.h"
#include "../runtime/parallel.h"
#include "../input/write.h"
#include "bodies.h"

#define SPRINGLS__WALL_REACH 0.9f   /* voxel: sheets further from each other are no wall                             */
#define SPRINGLS__WALL_SLACK 0.15f  /* voxel: the dead band                                                          */
#define SPRINGLS__WALL_STILL 0.004f /* voxel: beyond the dead band nothing goes for less                              */
#define SPRINGLS__WALL_TOUCH 0.06f  /* voxel: bodies this near to each other have met                                */
#define SPRINGLS__FILM_REFUSED (-FLT_MAX) /* a gap where the callback of films gives what it must not     */
#define SPRINGLS__WALL_ALIKE 0.8f    /* cosine: more, of normals of two bodies where one surface goes on in the other     */
#define SPRINGLS__WALL_OPPOSED 0.4f /* cosine: at least, of a sheet's normal and the way against the springl's       */

/* Finds the signed distance of x from the sheet of a body whose normals face along n: positive outside the body. False: there is none
   within reach, or the body's nearest springl faces the other way. Then x is at the body's other side, which is thin there, and the sheet
   behind it belongs to a wall with a third body. */
SPRINGLS__FN bool springls__sheet_distance(const springls__tiling_body *body, springls__v3 x, springls__v3 n, float *distance)
{
    const springls__model *model = &body->ctx->model;
    springls__cell_walk walk = springls__cell_walk_near(model, x, SPRINGLS__PROJECT_RADIUS);
    springls__moments sum;
    springls__projection found;
    float nearest = FLT_MAX, nearest_cosine = 0.0f;
    int i;
    memset(&sum, 0, sizeof sum);
    while ((i = springls__cell_walk_next(model, &walk)) >= 0) {
        const springls__v3 m = springls__scale(springls__springl_normal(model->set.s[i]), body->sign);
        const springls__v3 d = springls__sub(x, model->set.s[i].p);
        const float d2 = springls__length2(d), cosine = springls__dot(m, n), weight = springls__project_weight(d2);
        if (d2 < nearest) {
            nearest = d2;
            nearest_cosine = cosine;
        }
        if (cosine < SPRINGLS__WALL_OPPOSED) continue;
        sum.offset = springls__mad(sum.offset, d, weight);
        sum.normal = springls__mad(sum.normal, m, weight);
        sum.height += weight * springls__dot(d, m);
        sum.weight += weight;
    }
    if (sum.weight < 1e-3f || nearest_cosine < 0.0f) return false;
    found = springls__moments_distance(sum);
    *distance = found.distance;
    return found.trust > 0.05f && springls__fabs(found.distance) <= SPRINGLS__WALL_REACH;
}

/* ---- what lies where ---- */

/* Finds the box of a body's particles, where they may have changed since it was found, and lists them in cells. */
SPRINGLS__FN springls_status springls__look_at_body(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    SPRINGLS__TRY(springls__body_to_host(tiling, body, arg));
    if (body->boxed != body->ctx->springls_version) body->box = springls__particle_box(body->ctx);
    body->boxed = body->ctx->springls_version;
    return springls__read_cell_list(body->ctx);
}

/* Finds where all bodies are, and numbers their springls through. Returns how many there are. */
SPRINGLS__FN springls_status springls__look_at_bodies(springls_tiling *tiling, const char *call, int *springls)
{
    int i;
    SPRINGLS__TRY(springls__for_bodies(tiling, call, springls__look_at_body, NULL));
    for (i = *springls = 0; i < tiling->count; i++) {
        tiling->body[i].first = *springls;
        *springls += tiling->body[i].ctx->model.set.count;
    }
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__in_reach(const springls__box *box, springls__v3 x, float reach)
{
    return x.x >= box->lower.x - reach && x.y >= box->lower.y - reach && x.z >= box->lower.z - reach && x.x <= box->upper.x + reach
           && x.y <= box->upper.y + reach && x.z <= box->upper.z + reach;
}

SPRINGLS__FN bool springls__boxes_meet(const springls__box *a, const springls__box *b, float reach)
{
    return a->lower.x <= b->upper.x + reach && a->lower.y <= b->upper.y + reach && a->lower.z <= b->upper.z + reach
           && b->lower.x <= a->upper.x + reach && b->lower.y <= a->upper.y + reach && b->lower.z <= a->upper.z + reach;
}

/* ---- what a springl faces ---- */

/* Returns phi of a body at place p, FLT_MAX where no springl of it is near. phi may be behind the springls: it is read where p was before
   the nearest of them moved. */
SPRINGLS__FN float springls__phi_beside(const springls__tiling_body *body, springls__v3 p)
{
    const springls__model *model = &body->ctx->model;
    const int i = springls__nearest_springl(model, p, SPRINGLS__PROJECT_RADIUS);
    springls__v3 moved;
    if (i < 0) return FLT_MAX;
    moved = springls__sub(model->set.s[i].p, model->set.synced_position[i]);
    return body->sign * springls__grid_sample(&model->grid, model->grid.phi, springls__sub(p, moved));
}

/* Returns whether phi of a body agrees that place p is at the signed distance d from its opposed sheet. Where a thin body lies between, p
   is outside by phi. */
SPRINGLS__FN bool springls__phi_agrees(const springls__tiling_body *body, springls__v3 p, float d)
{
    const float error = 0.3f; /* voxel */
    return springls__phi_beside(body, p) < d + error;
}

/* Returns whether the surface of another body goes on beside place p in the surface that has normal n there: one does not run into the
   other, though p may be in both. */
SPRINGLS__FN bool springls__goes_on_in(const springls__tiling_body *other, springls__v3 p, springls__v3 n)
{
    const springls__model *model = &other->ctx->model;
    springls__cell_walk walk = springls__cell_walk_near(model, p, SPRINGLS__PROJECT_RADIUS);
    int i;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0)
        if (springls__dot(springls__springl_normal(model->set.s[i]), n) > SPRINGLS__WALL_ALIKE) return true;
    return false;
}

/* Finds the body that place p of another one, with normal n, lies in, though none of its sheets is opposed: at the rim of a wall that
   grows, bodies run into each other askew. Returns its number, and phi there, -1: there is none. */
SPRINGLS__FN int springls__body_around(const springls_tiling *tiling, int own, springls__v3 p, springls__v3 n, float *phi)
{
    int i, found = -1;
    *phi = 0.0f;
    for (i = 1; i < tiling->count; i++) {
        float at;
        if (i == own || !springls__in_reach(&tiling->body[i].box, p, 0.0f)) continue;
        at = springls__phi_beside(&tiling->body[i], p);
        if (at >= *phi || springls__goes_on_in(&tiling->body[i], p, n)) continue;
        *phi = at;
        found = i;
    }
    return found;
}

/* Finds the nearest opposed sheet before place p of a body with normal n, among those of the bodies from `first` on, but for two of them.
   Returns the body's number, -1: there is none within reach. */
SPRINGLS__FN int springls__nearest_sheet(const springls_tiling *tiling, int first, int own, int faced, springls__v3 p, springls__v3 n,
                                         float *distance)
{
    const springls__v3 back = springls__scale(n, -1.0f);
    float d;
    int i, found = -1;
    for (i = first; i < tiling->count; i++) {
        if (i == own || i == faced || !springls__in_reach(&tiling->body[i].box, p, 1.0f)) continue;
        if (!springls__sheet_distance(&tiling->body[i], p, back, &d)) continue;
        if (found >= 0 && springls__fabs(d) >= springls__fabs(*distance)) continue;
        *distance = d;
        found = i;
    }
    return found;
}

/* Returns the body that place p of a body with normal n faces by the level sets: a little before it the lowest phi of another one. */
SPRINGLS__FN int springls__faced_by_phi(const springls_tiling *tiling, int own, springls__v3 p, springls__v3 n)
{
    const springls__v3 x = springls__mad(p, n, 0.6f);
    float least = FLT_MAX;
    int i, found = own == 0 ? -1 : 0;
    for (i = 0; i < tiling->count; i++) {
        const springls__grid *g = &tiling->body[i].ctx->model.grid;
        float phi;
        if (i == own || !springls__in_reach(&tiling->body[i].box, x, 2.0f)) continue;
        phi = tiling->body[i].sign * springls__grid_sample(g, g->phi, x);
        if (phi >= least) continue;
        least = phi;
        found = i;
    }
    return found;
}

/* Looks at the springls of one body: what they face, their gap to it, and how far they go. */
typedef struct springls__sheets_job {
    const springls_tiling *tiling;
    int own;
    float *facing, *gap;   /* a springl of the body; gap FLT_MAX: no sheet is in front                                */
    springls__v3 *shift;   /* NULL: they only look                                                                    */
    bool known;            /* facing is that of before                                                                */
    bool stays;            /* facing stays as it is                                                                   */
    const springls_tiling_step_desc *desc; /* whose films part; NULL: no step is made                                 */
} springls__sheets_job;

/* Returns how far a springl goes along its normal at a gap: half of what exceeds the dead band. Ever smaller ways, which would keep models
   awake, are not gone. */
SPRINGLS__FN float springls__way_to_middle(float gap)
{
    if (springls__fabs(gap) <= SPRINGLS__WALL_SLACK + SPRINGLS__WALL_STILL) return 0.0f;
    return 0.5f * (gap - (gap > 0.0f ? SPRINGLS__WALL_SLACK : -SPRINGLS__WALL_SLACK));
}

/* Asks what becomes of the film between two bodies; *thickness: voxels. */
SPRINGLS__FN springls_film springls__film_between(const springls_tiling_step_desc *desc, int32_t one, int32_t other, float *thickness)
{
    *thickness = SPRINGLS__WALL_TOUCH;
    return desc && desc->film ? (desc->film)(desc->user, one < other ? one : other, one < other ? other : one, thickness)
                              : SPRINGLS_FILM_PART;
}

SPRINGLS__FN bool springls__film_is_valid(springls_film film, float thickness)
{
    return (film == SPRINGLS_FILM_PART || film == SPRINGLS_FILM_JOIN) && thickness >= 0.0f && thickness <= SPRINGLS__WALL_REACH;
}

/* Fails with what the callback of films gives between two labels. */
SPRINGLS__FN springls_status springls__refuse_film(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc,
                                                   int32_t low, int32_t high)
{
    float thickness;
    const springls_film film = springls__film_between(desc, low, high, &thickness);
    return springls__fail(tiling->host, springls__finite_float(thickness) ? SPRINGLS_INVALID_ARGUMENT : SPRINGLS_NON_FINITE,
                          "%s: film gives %d and the thickness %g between labels %ld and %ld: PART or JOIN, and 0 to %g voxels", call,
                          (int)film, (double)thickness, (long)low, (long)high, (double)SPRINGLS__WALL_REACH);
}

/* Returns how near two bodies come before what is between them parts; FILM_REFUSED: the callback gives what it must not. */
SPRINGLS__FN float springls__touching(const springls__sheets_job *job, int other)
{
    const int32_t own = job->tiling->body[job->own].label, label = job->tiling->body[other].label;
    float thickness = SPRINGLS__WALL_TOUCH;
    springls_film film = SPRINGLS_FILM_PART;
    if (own > 0 && label > 0) film = springls__film_between(job->desc, own, label, &thickness);
    return springls__film_is_valid(film, thickness) ? thickness : SPRINGLS__FILM_REFUSED;
}

/* Returns whether walls move by surface tension, or to hold volumes. */
SPRINGLS__FN bool springls__has_films(const springls_tiling_step_desc *desc)
{
    return desc->dt > 0.0f && (desc->tension != 0.0f || desc->held_count > 0);
}

/* Returns the gap of a springl at p with normal n to the sheet of a body; FLT_MAX: there is none, as for a body -1. */
SPRINGLS__FN float springls__gap_to(const springls_tiling *tiling, int faced, springls__v3 p, springls__v3 n)
{
    float gap;
    const bool there = faced >= 0 && springls__in_reach(&tiling->body[faced].box, p, 1.0f)
                       && springls__sheet_distance(&tiling->body[faced], p, springls__scale(n, -1.0f), &gap);
    return there ? gap : FLT_MAX;
}

/* Finds the body that a springl at p with normal n faces, and its gap; faced: the one that it has faced, -1: not known.
   - It goes on to face a body, though that has no sheet there: the wall is to be closed (mirror.h). It is given up where another sheet
     lies in its place. Among films it is given up, too, where by phi a third body is in front, which has come between (a T1 change); in
     a flow that thins bodies phi knows less than springls do.
   - From label 0 it turns to a body that it touches and, where pressures move each body by itself, to one that it has run into. */
SPRINGLS__FN int springls__faced_by(const springls__sheets_job *job, springls__v3 p, springls__v3 n, int faced, float *gap)
{
    const springls_tiling *tiling = job->tiling;
    const int own = job->own;
    const bool there = (*gap = springls__gap_to(tiling, faced, p, n)) < FLT_MAX;
    const bool films = job->desc && springls__has_films(job->desc), pushed = job->desc && job->desc->dt > 0.0f && job->desc->pressure;
    float d = 0.0f, touching;
    int other, around;
    if (there && faced > 0) return faced;
    other = springls__nearest_sheet(tiling, faced == 0 ? 1 : 0, own, faced, p, n, &d);
    touching = faced == 0 && other >= 0 ? springls__touching(job, other) : 0.0f;
    if (faced < 0) *gap = other >= 0 ? d : FLT_MAX;
    else if (touching < 0.0f) *gap = touching;
    else if (faced == 0 && other >= 0 && d < touching && springls__phi_agrees(&tiling->body[other], p, d)) *gap = d;
    else if (faced > 0 && other >= 0 && springls__fabs(d) < SPRINGLS__WALL_TOUCH) *gap = d;
    else if (films && own > 0 && faced > 0 && other > 0 && springls__faced_by_phi(tiling, own, p, n) == other) *gap = d;
    else if (faced == 0 && own > 0 && pushed && (around = springls__body_around(tiling, own, p, n, &d)) >= 0) {
        other = around;
        *gap = d;
    } else other = faced;
    if (!there && other == faced) *gap = FLT_MAX;
    return other >= 0 ? other : springls__faced_by_phi(tiling, own, p, n);
}

/* Returns whether a springl is drawn to the sheet that it faces. The model of label 0, which faces most bodies, is not to those that have
   been put to rest. */
SPRINGLS__FN bool springls__is_drawn(const springls__sheets_job *job, int faced, float gap)
{
    return gap < FLT_MAX && (job->own > 0 || springls__settles(&job->tiling->body[faced]));
}

SPRINGLS__FN void springls__sheets_task(void *arg, int begin, int end)
{
    const springls__sheets_job *job = (const springls__sheets_job *)arg;
    const springls__tiling_body *body = &job->tiling->body[job->own];
    for (; begin < end; begin++) {
        const springls__springl *s = &body->ctx->model.set.s[begin];
        const springls__v3 n = springls__scale(springls__springl_normal(*s), body->sign);
        int faced = job->known ? springls__body_number(job->tiling, (int32_t)job->facing[begin]) : -1;
        float gap = FLT_MAX;
        if (faced == job->own) faced = -1;
        if (job->stays) {
            job->gap[begin] = springls__gap_to(job->tiling, faced, s->p, n);
            continue;
        }
        faced = springls__faced_by(job, s->p, n, faced, &gap);
        job->facing[begin] = (float)(faced < 0 ? SPRINGLS__NO_LABEL : job->tiling->body[faced].label);
        job->gap[begin] = gap;
        if (job->shift) job->shift[begin] = springls__scale(n, springls__is_drawn(job, faced, gap) ? springls__way_to_middle(gap) : 0.0f);
    }
}

/* Sums up the gaps of a body's springls that have a sheet before them. */
SPRINGLS__FN springls__gaps springls__sum_gaps(const float *gap, int count)
{
    springls__gaps sum;
    int i;
    memset(&sum, 0, sizeof sum);
    for (i = 0; i < count; i++) {
        if (gap[i] == FLT_MAX) continue;
        sum.springls++;
        sum.sum += fabs((double)gap[i]);
        sum.sum2 += (double)gap[i] * (double)gap[i];
        sum.largest = springls__max(sum.largest, springls__fabs(gap[i]));
    }
    return sum;
}

/* Fails if the callback of films gave what it must not, for the least such pair of labels. */
SPRINGLS__FN springls_status springls__check_films(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc)
{
    int32_t low = 0, high = 0;
    int i, k;
    for (i = 0; i < tiling->count; i++) {
        const springls__tiling_body *body = &tiling->body[i];
        const float *gap = (const float *)tiling->gap.data + body->first, *facing = springls__facing_values(body);
        if (!body->rest.awake) continue;
        for (k = 0; k < body->ctx->model.set.count; k++) {
            const int32_t label = (int32_t)facing[k];
            const int32_t a = label < body->label ? label : body->label, b = label < body->label ? body->label : label;
            if (gap[k] > SPRINGLS__FILM_REFUSED || (low > 0 && (a > low || (a == low && b >= high)))) continue;
            low = a;
            high = b;
        }
    }
    return low > 0 ? springls__refuse_film(tiling, call, desc, low, high) : SPRINGLS_OK;
}

/* Finds what the springls of the bodies that are awake, which have the attribute for it, face, and their gaps; with move also how far they
   go, but for bodies without forces for so long that they are to come to rest. Of others that look, the gaps alone. */
SPRINGLS__FN springls_status springls__look_at_sheets(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc,
                                                      bool move)
{
    springls__sheets_job job;
    int springls, i;
    SPRINGLS__TRY(springls__look_at_bodies(tiling, call, &springls));
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->gap, (size_t)springls + 1, sizeof(float), 0));
    if (move) SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->shift, (size_t)springls + 1, sizeof(springls__v3), 0));
    job.tiling = tiling;
    job.desc = desc;
    job.known = tiling->facing_known;
    for (i = 0; i < tiling->count; i++) {
        springls__tiling_body *body = &tiling->body[i];
        const int count = body->ctx->model.set.count;
        if (!body->rest.looks) continue;
        job.own = i;
        job.stays = job.known && body->rest.put;
        job.facing = springls__facing_values(body);
        job.gap = (float *)tiling->gap.data + body->first;
        job.shift = move && springls__settles(body) ? (springls__v3 *)tiling->shift.data + body->first : NULL;
        springls__parallel(tiling->host, count, 64, springls__sheets_task, &job);
        body->gaps = springls__sum_gaps(job.gap, count);
    }
    tiling->facing_known = true;
    return springls__check_films(tiling, call, desc);
}

/* Gives all springls what they face, where that is not known of some. */
SPRINGLS__FN springls_status springls__find_facing(springls_tiling *tiling, const char *call)
{
    int i;
    if (springls__facing_is_known(tiling)) return SPRINGLS_OK;
    for (i = 0; i < tiling->count; i++) {
        const springls_status status = springls__make_facing(&tiling->body[i]);
        if (status != SPRINGLS_OK) return springls__body_failed(tiling, status, call, tiling->body[i].label, tiling->body[i].ctx);
    }
    tiling->facing_known = false;
    for (i = 0; i < tiling->count; i++) tiling->body[i].rest.awake = tiling->body[i].rest.looks = true;
    return springls__look_at_sheets(tiling, call, NULL, false);
}

/* ---- half way ---- */

/* Moves the springls of a body by their shifts. Nothing is written if none moves, so that phi may stay behind. */
SPRINGLS__FN springls_status springls__shift_body(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    const springls__v3 *shift = (const springls__v3 *)tiling->shift.data + body->first;
    const springls__constellation *set = &body->ctx->model.set;
    springls__buffer moved;
    springls_status status;
    springls__v3 *q;
    int first = 0, end = set->count, i, m;
    (void)arg;
    if (!springls__settles(body)) return SPRINGLS_OK;
    while (first < end && springls__length2(shift[first]) == 0.0f) first++;
    while (end > first && springls__length2(shift[end - 1]) == 0.0f) end--;
    if (first == end) return SPRINGLS_OK;
    memset(&moved, 0, sizeof moved);
    SPRINGLS__TRY(springls__buffer_grow(body->ctx, &moved, (size_t)(end - first), 4 * sizeof *q, 0));
    q = (springls__v3 *)moved.data;
    for (i = first; i < end; i++)
        for (m = 0; m < 3; m++) *q++ = springls__add(set->s[i].q[m], shift[i]);
    for (i = first; i < end; i++) *q++ = springls__add(set->s[i].p, shift[i]);
    q = (springls__v3 *)moved.data;
    status = springls_write(body->ctx, first, end - first, &q->x, &q[3 * (end - first)].x);
    springls__buffer_free(body->ctx, &moved);
    return status == SPRINGLS_OK ? springls__body_to_host(tiling, body, NULL) : status;
}

/* Finds what all springls face, and draws the two sheets of each wall together. */
SPRINGLS__FN springls_status springls__draw_sheets(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc)
{
    SPRINGLS__TRY(springls__look_at_sheets(tiling, call, desc, true));
    return springls__for_some(tiling, call, SPRINGLS__AWAKE_BODIES, springls__shift_body, NULL);
}

#endif
