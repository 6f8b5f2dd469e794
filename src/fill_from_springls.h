/* fill_from_springls.h - springls for holes among springls (params.fill_from_springls). Where a sheet is thin the zero level
   comes and goes with the voxels that happen to lie inside; the springls beside a hole know better where it lies. */

/* A springl to be. */
typedef struct springls__seed { springls__v3 p, n, toward, a; int ok; } springls__seed;

/* Two springls of one side nearer than this would be one too many. Beyond merge_distance, or contract would take it again. */
#define SPRINGLS__SEED_DISTANCE 0.7f

SPRINGLS__FN bool springls__too_close(springls__v3 p, springls__v3 n, springls__v3 p_other, springls__v3 n_other)
{
    const float r = SPRINGLS__SEED_DISTANCE;
    return springls__length2(springls__sub(p, p_other)) < r * r && springls__dot(n, n_other) > 0.3f;
}

SPRINGLS__FN bool springls__has_room(const springls_context *ctx, springls__v3 x, springls__v3 n)
{
    const float r = SPRINGLS__SEED_DISTANCE;
    springls__cell_walk walk = springls__cell_walk_near(ctx, x, r);
    int other;
    while ((other = springls__cell_walk_next(&walk)) >= 0) {
        const springls__springl *o = &ctx->set.s[other];
        if (springls__length2(springls__sub(o->p, x)) >= r * r) continue;
        if (springls__too_close(x, n, o->p, springls__springl_normal(o))) return false;
    }
    return true;
}

/* How far, in the mean square, the springls around are from having p, facing n, on the surface that each of them spans. */
SPRINGLS__FN float springls__disagreement2(const springls_context *ctx, springls__v3 p, springls__v3 n)
{
    const float r = SPRINGLS__PROJECT_RADIUS;
    springls__cell_walk walk = springls__cell_walk_near(ctx, p, r);
    float weight = 0.0f, value = 0.0f;
    int other;
    while ((other = springls__cell_walk_next(&walk)) >= 0) {
        const springls__springl *o = &ctx->set.s[other];
        springls__say say = springls__oriented_distance(p, n, o->p, springls__springl_normal(o));
        weight += say.weight;
        value += say.weight * say.distance * say.distance;
    }
    return weight > 0.0f ? value / weight : FLT_MAX;
}

/* What springl i misses beside it: a springl in the middle of the widest opening between its neighbours, on the surface
   that those around the place span. It must be enclosed: beyond the rim of the springls that surface is a guess. */
SPRINGLS__FN springls__seed springls__seed_beside(const springls_context *ctx, int i)
{
    const float degree = 0.0174532925f, widest = 110.0f * degree, enclosed = 165.0f * degree;
    const float range = 1.3f, away = 0.85f, worst = 0.15f;
    const springls__springl *s = &ctx->set.s[i];
    springls__v3 n = springls__springl_normal(s), x;
    springls__opening opening = springls__opening_at(ctx, s->p, n, range, 1.0f);
    springls__fit_result fit;
    springls__seed seed;
    memset(&seed, 0, sizeof seed);
    if (opening.angle <= widest || springls__at_edge(ctx, i)) return seed; /* a side opens at its edge */
    x = springls__mad(s->p, opening.middle, away);
    if (!springls__has_room(ctx, x, n)) return seed;
    fit = springls__fit_at(ctx, x, n, ctx->set.a[i], ctx->set.count);
    if (!fit.ok || !springls__has_room(ctx, fit.point, fit.normal)) return seed;
    if (springls__opening_at(ctx, fit.point, fit.normal, SPRINGLS__FIT_RADIUS, 1.0f).angle >= enclosed) return seed;
    if (springls__disagreement2(ctx, fit.point, fit.normal) > worst * worst) return seed;
    seed.p = fit.point;
    seed.n = fit.normal;
    seed.toward = springls__sub(s->p, fit.point);
    seed.a = springls__project_on_original(ctx, fit.a);
    seed.ok = 1;
    return seed;
}

typedef struct springls__seed_job { const springls_context *ctx; springls__seed *seeds; } springls__seed_job;

SPRINGLS__FN void springls__seed_task(void *arg, int begin, int end)
{
    const springls__seed_job *job = (const springls__seed_job *)arg;
    for (; begin < end; begin++) job->seeds[begin] = springls__seed_beside(job->ctx, begin);
}

/* The accepted seeds, chained by slot: last[slot] and before[seed] are seeds or -1. */
typedef struct springls__accepted { const springls__seed *seeds; int *last, *before; } springls__accepted;

SPRINGLS__FN bool springls__seed_has_room(const springls_context *ctx, const springls__accepted *accepted, int i)
{
    const float r = SPRINGLS__SEED_DISTANCE;
    const springls__grid *g = &ctx->grid;
    const springls__seed *seed = &accepted->seeds[i];
    int lo[3], hi[3], x, y, z, other;
    springls__box_bricks(g, seed->p, r, lo, hi);
    for (z = lo[2]; z <= hi[2]; z++)
        for (y = lo[1]; y <= hi[1]; y++)
            for (x = lo[0]; x <= hi[0]; x++)
                for (other = accepted->last[g->top[x + g->bricks[0] * (y + g->bricks[1] * z)]]; other >= 0; other = accepted->before[other])
                    if (springls__too_close(seed->p, seed->n, accepted->seeds[other].p, accepted->seeds[other].n)) return false;
    return true;
}

SPRINGLS__FN void springls__plant(springls_context *ctx, const springls__seed *seed, uint32_t generation)
{
    const float area = 0.324759526f; /* of an equilateral triangle with circumradius 0.5 */
    springls__springl s;
    springls__tri t = springls__equilateral(seed->p, seed->n, seed->toward, area);
    s.q[0] = t.a;
    s.q[1] = t.b;
    s.q[2] = t.c;
    s.p = seed->p;
    springls__constellation_append(ctx, &s, seed->a, generation, 0);
}

/* Seeds are found for all springls at once, then accepted in springl order, none close to an accepted one. */
SPRINGLS__FN springls_status springls__fill_from_springls(springls_context *ctx)
{
    const springls__grid *g = &ctx->grid;
    springls__seed_job job;
    springls__accepted accepted;
    int i, count = ctx->set.count, n = 0, room, lo[3], hi[3];
    SPRINGLS__TRY(springls__cells_build(ctx));
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)count, sizeof *job.seeds, (void **)&job.seeds));
    SPRINGLS__TRY(springls__scratch(ctx, 2, (size_t)g->slot_count, sizeof(int), (void **)&accepted.last));
    SPRINGLS__TRY(springls__scratch(ctx, 3, (size_t)count, sizeof(int), (void **)&accepted.before));
    job.ctx = ctx;
    springls__parallel(ctx, count, 64, springls__seed_task, &job);
    for (i = 0; i < g->slot_count; i++) accepted.last[i] = -1;
    accepted.seeds = job.seeds;
    for (i = 0; i < count; i++) {
        int *last;
        if (!job.seeds[i].ok) continue;
        job.seeds[i].ok = springls__seed_has_room(ctx, &accepted, i);
        if (!job.seeds[i].ok) continue;
        springls__box_bricks(g, job.seeds[i].p, 0.0f, lo, hi);
        last = &accepted.last[g->top[lo[0] + g->bricks[0] * (lo[1] + g->bricks[1] * lo[2])]];
        accepted.before[i] = *last;
        *last = i;
        n++;
    }
    if (n == 0) return SPRINGLS_OK;
    room = springls__imin(n, springls__imax(ctx->desc.max_springls - count, 0));
    ctx->stats.refused += n - room;
    ctx->stats.added += room;
    SPRINGLS__TRY(springls__constellation_reserve(ctx, count + room));
    for (i = 0; i < count && room > 0; i++) {
        if (!job.seeds[i].ok) continue;
        springls__plant(ctx, &job.seeds[i], ctx->set.generation[i] + 1);
        room--;
    }
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}
