/* edges.h - sharp edges stay sharp (params.keep_edges): springls at a crease belong to one side of it. Their places are exact
   where they were carried; what wears off are normals, which neighbours across the crease turn, and whatever is averaged over
   both sides. */

/* The springls about a place. */
typedef struct springls__crowd {
    springls__v3 p[SPRINGLS__CROWD], n[SPRINGLS__CROWD], a[SPRINGLS__CROWD];
    float weight[SPRINGLS__CROWD];
    int id[SPRINGLS__CROWD], count;
} springls__crowd;

/* False when it is full. */
SPRINGLS__FN bool springls__join(springls__crowd *crowd, springls__v3 p, springls__v3 n, springls__v3 a, float weight, int id)
{
    int i = crowd->count;
    if (i == SPRINGLS__CROWD) return false;
    crowd->p[i] = p;
    crowd->n[i] = n;
    crowd->a[i] = a;
    crowd->weight[i] = weight;
    crowd->id[i] = id;
    crowd->count++;
    return true;
}

/* narrow, certain: see springls__find_sides. */
SPRINGLS__FN springls__sides springls__crowd_sides(const springls__crowd *crowd, float narrow, bool certain)
{
    return springls__find_sides(crowd->p, crowd->n, crowd->weight, crowd->count, narrow, certain);
}

/* Those with particles within the radius, or as much of it as SPRINGLS__CROWD of them fill; before `known` only. */
SPRINGLS__FN void springls__gather_crowd(const springls_context *ctx, springls__v3 x, float radius, int known, springls__crowd *crowd)
{
    springls__cell_walk walk = springls__cell_walk_begin(ctx, springls__v3_make(x.x - radius, x.y - radius, x.z - radius),
                                                         springls__v3_make(x.x + radius, x.y + radius, x.z + radius));
    const float least = 0.3f;
    int i;
    crowd->count = 0;
    while ((i = springls__cell_walk_next(&walk)) >= 0) {
        const springls__springl *s = &ctx->set.s[i];
        float weight = 1.0f - springls__length2(springls__sub(s->p, x)) / (radius * radius);
        if (i >= known || weight <= 0.0f) continue;
        if (springls__join(crowd, s->p, springls__springl_normal(s), ctx->set.a[i], weight * weight, i)) continue;
        if (radius < least) return; /* they lie on each other: these will do */
        radius *= 0.8f;             /* too many: begin again */
        walk = springls__cell_walk_begin(ctx, springls__v3_make(x.x - radius, x.y - radius, x.z - radius),
                                         springls__v3_make(x.x + radius, x.y + radius, x.z + radius));
        crowd->count = 0;
    }
}

/* One side's surface about x; springl `self` is not asked. */
SPRINGLS__FN springls__fit_result springls__fit_side(const springls__crowd *crowd, springls__sides sides, int side, springls__v3 x, springls__v3 a0,
                                                     int self)
{
    springls__fit fit = springls__fit_begin(x, sides.normal[side], a0);
    springls__fit_result result;
    int i;
    for (i = 0; i < crowd->count; i++)
        if (crowd->id[i] != self && springls__side_of(sides, crowd->n[i]) == side)
            fit = springls__fit_add(fit, crowd->p[i], crowd->n[i], crowd->a[i]);
    result = springls__fit_solve(fit, fit.count >= 10 ? 6 : fit.count >= 4 ? 3 : 0);
    if (!result.ok && fit.count >= 10) result = springls__fit_solve(fit, 3);
    if (fit.count < 4 || springls__length2(springls__sub(result.point, x)) > 1.0f
        || springls__dot(result.normal, sides.normal[side]) < 0.7f)
        result.ok = 0;
    return result;
}

/* What a place near a crease belongs to: the side whose surface it is nearest to, or of two as near the one that its normal
   is nearer to; then on from there to where the sides meet, if that is beyond it. Not ok unless `at_least` sides are.
   ways: 1 when only a convex edge will do, 2 only a concave one, 3 either. */
SPRINGLS__FN springls__fit_result springls__side_at(const springls__crowd *crowd, springls__sides sides, springls__v3 x, springls__v3 n,
                                                   springls__v3 a0, int self, int ways, int at_least)
{
    const float doubt = 0.1f; /* voxel: what a normal counts against a distance */
    springls__fit_result fit[SPRINGLS__SIDES], result;
    float least = FLT_MAX;
    int side, best = -1, good = 0;
    for (side = 0; side < sides.count; side++) {
        float off;
        fit[side] = springls__fit_side(crowd, sides, side, x, a0, self);
        if (!fit[side].ok) continue;
        good++;
        off = springls__length(springls__sub(fit[side].point, x)) + doubt * (1.0f - springls__dot(n, fit[side].normal));
        if (off >= least) continue;
        least = off;
        best = side;
    }
    result.ok = good >= at_least;
    result.point = x;
    result.normal = n;
    result.a = a0;
    if (!result.ok) return result;
    result = fit[best];
    for (side = 0; side < sides.count; side++) {
        int convex;
        float beyond;
        if (side == best || !fit[side].ok) continue;
        convex = springls__is_convex(sides.middle[best], sides.normal[best], sides.middle[side], sides.normal[side]);
        if (!(ways & (convex ? 1 : 2))) result.ok = 0;
        beyond = springls__dot(springls__sub(result.point, fit[side].point), fit[side].normal);
        if ((beyond > 0.0f) == (convex != 0)) result.point = springls__mad(result.point, fit[side].normal, -beyond);
    }
    return result;
}

/* Place and correspondence of a new springl near a crease, from one side of it only; false where there is no crease. */
SPRINGLS__FN bool springls__place_at_edge(const springls_context *ctx, springls__v3 x, springls__v3 n, springls__v3 a0, int known,
                                          springls__fit_result *result)
{
    springls__crowd crowd;
    springls__sides sides;
    int i, edges = 0;
    if (ctx->stats.at_edges == 0) return false;
    springls__gather_crowd(ctx, x, SPRINGLS__FIT_RADIUS, known, &crowd);
    for (i = 0; i < crowd.count; i++) edges += ctx->set.edge[crowd.id[i]];
    if (edges == 0) return false;
    sides = springls__crowd_sides(&crowd, SPRINGLS__NARROW, false);
    if (sides.count < 2) return false;
    *result = springls__side_at(&crowd, sides, x, n, a0, -1, 3, 2);
    return result->ok != 0;
}

/* ---- springls at a crease, before the level set follows ---- */

typedef struct springls__sharpen_job {
    springls_context *ctx;
    springls__v3 *normal, *point; /* to be; edge tells where */
    uint8_t *suspect;             /* 1: a neighbour faces elsewhere */
    const uint8_t *was;           /* edge, before                                                            */
    bool anew;                    /* edges are looked for everywhere */
} springls__sharpen_job;

/* Which springls may lie at a crease: with neighbours that face elsewhere when edges are looked for anew, later those beside
   the ones known. */
SPRINGLS__FN void springls__suspect_task(void *arg, int begin, int end)
{
    const float radius = 1.5f, turned = 0.77f; /* cosine of 40 degrees */
    const springls__sharpen_job *job = (const springls__sharpen_job *)arg;
    const springls_context *ctx = job->ctx;
    for (; begin < end; begin++) {
        springls__v3 p = ctx->set.s[begin].p;
        springls__cell_walk walk = springls__cell_walk_near(ctx, p, radius);
        int other;
        job->suspect[begin] = 0;
        while ((other = springls__cell_walk_next(&walk)) >= 0 && !job->suspect[begin]) {
            float along = springls__dot(job->normal[begin], job->normal[other]);
            if (job->anew ? along < turned && along > SPRINGLS__AWAY : job->was[other])
                job->suspect[begin] = springls__length2(springls__sub(p, ctx->set.s[other].p)) < radius * radius;
        }
    }
}

SPRINGLS__FN void springls__normals_task(void *arg, int begin, int end)
{
    const springls__sharpen_job *job = (const springls__sharpen_job *)arg;
    for (; begin < end; begin++) job->normal[begin] = springls__springl_normal(&job->ctx->set.s[begin]);
}

SPRINGLS__FN void springls__side_task(void *arg, int begin, int end)
{
    const float radius = 2.5f, beside = 0.7f; /* a weight: within a voxel */
    const float slack = 0.05f; /* voxel: springls were put on a side and carried, they lie on it */
    const springls__sharpen_job *job = (const springls__sharpen_job *)arg;
    springls_context *ctx = job->ctx;
    springls__crowd crowd;
    for (; begin < end; begin++) {
        const springls__springl *s = &ctx->set.s[begin];
        springls__fit_result fit;
        springls__sides sides;
        bool was_edge = false; /* what was one may have worn a little, and a new springl may have come to it */
        int i;
        ctx->set.edge[begin] = 0;
        if (!job->suspect[begin]) continue;
        springls__gather_crowd(ctx, s->p, radius, ctx->set.count, &crowd);
        for (i = 0; i < crowd.count; i++) was_edge = was_edge || (crowd.weight[i] > beside && job->was[crowd.id[i]]);
        sides = springls__crowd_sides(&crowd, SPRINGLS__NARROW, !was_edge);
        if (sides.count < 2) continue;
        fit = springls__side_at(&crowd, sides, s->p, springls__springl_normal(s), ctx->set.a[begin], begin, 3, 2);
        if (!fit.ok || springls__length2(springls__sub(fit.point, s->p)) > slack * slack) continue;
        ctx->set.edge[begin] = 1;
        job->normal[begin] = fit.normal;
        job->point[begin] = fit.point;
    }
}

SPRINGLS__FN void springls__turn_task(void *arg, int begin, int end)
{
    const springls__sharpen_job *job = (const springls__sharpen_job *)arg;
    springls_context *ctx = job->ctx;
    int m;
    for (; begin < end; begin++) {
        springls__springl *s = &ctx->set.s[begin];
        springls__v3 n = springls__springl_normal(s);
        if (!ctx->set.edge[begin] || ctx->set.mask[begin]) continue;
        for (m = 0; m < 3; m++) s->q[m] = springls__add(s->p, springls__turn_to(springls__sub(s->q[m], s->p), n, job->normal[begin]));
        springls__springl_finish(s);
    }
}

SPRINGLS__FN void springls__count_edges(springls_context *ctx)
{
    int i;
    ctx->stats.at_edges = 0;
    for (i = 0; i < ctx->set.count; i++) ctx->stats.at_edges += ctx->set.edge[i];
}

/* Finds the springls at creases (edge), and the normal and place that each has on its side. */
SPRINGLS__FN springls_status springls__sort_sides(springls_context *ctx, springls__sharpen_job *job, bool anew)
{
    size_t n = (size_t)ctx->set.count;
    uint8_t *was;
    job->ctx = ctx;
    job->anew = anew;
    SPRINGLS__TRY(springls__cells_build(ctx));
    SPRINGLS__TRY(springls__scratch(ctx, 4, n, sizeof *job->normal, (void **)&job->normal));
    SPRINGLS__TRY(springls__scratch(ctx, 5, n, sizeof *job->point, (void **)&job->point));
    SPRINGLS__TRY(springls__scratch(ctx, 6, n, 1, (void **)&job->suspect));
    SPRINGLS__TRY(springls__scratch(ctx, 7, n, 1, (void **)&was));
    memcpy(was, ctx->set.edge, n);
    job->was = was;
    springls__parallel(ctx, ctx->set.count, 512, springls__normals_task, job);
    springls__parallel(ctx, ctx->set.count, 512, springls__suspect_task, job);
    springls__parallel(ctx, ctx->set.count, 64, springls__side_task, job);
    springls__count_edges(ctx);
    return SPRINGLS_OK;
}

/* Edges of a model that has just been set. Others are not looked for later: what bends sharply in motion is no edge. */
SPRINGLS__FN springls_status springls__find_edges(springls_context *ctx)
{
    springls__sharpen_job job;
    return springls__sort_sides(ctx, &job, true);
}

/* Springls at a crease are turned, each about its particle, into their own side. */
SPRINGLS__FN springls_status springls__keep_edges(springls_context *ctx)
{
    springls__sharpen_job job;
    SPRINGLS__TRY(springls__sort_sides(ctx, &job, false));
    springls__parallel(ctx, ctx->set.count, 256, springls__turn_task, &job);
    ctx->omega_fresh = false;
    ctx->model_fresh = false;
    return SPRINGLS_OK;
}

/* ---- initial springls ---- */

/* phi's gradient at a voxel, as a unit vector: central where that is as long as a distance's should be, else of the differences
   to either side those that are. Zero where none are. */
SPRINGLS__FN springls__v3 springls__unkinked_gradient(const springls__grid *g, int x, int y, int z)
{
    const float tolerance = 0.02f;
    float c = springls__grid_phi(g, g->phi, x, y, z), beside[6], off, least = tolerance;
    springls__v3 d, best = springls__v3_make(0.0f, 0.0f, 0.0f);
    int k;
    for (k = 0; k < 6; k++)
        beside[k] = springls__grid_phi(g, g->phi, x + (k == 1) - (k == 0), y + (k == 3) - (k == 2), z + (k == 5) - (k == 4));
    d = springls__scale(springls__v3_make(beside[1] - beside[0], beside[3] - beside[2], beside[5] - beside[4]), 0.5f);
    if (springls__fabs(springls__length(d) - 1.0f) < tolerance) return springls__normalize(d);
    for (k = 0; k < 8; k++) {
        d.x = k & 1 ? beside[1] - c : c - beside[0];
        d.y = k & 2 ? beside[3] - c : c - beside[2];
        d.z = k & 4 ? beside[5] - c : c - beside[4];
        off = springls__fabs(springls__length(d) - 1.0f);
        if (off >= least) continue;
        least = off;
        best = springls__normalize(d);
    }
    return best;
}

/* What the voxels on one side of the zero level say about the surface about x: each its foot point and normal. A convex edge
   leaves the distances inside it unrounded, a concave one those outside. */
SPRINGLS__FN void springls__gather_feet(const springls__grid *g, springls__v3 x, float radius, bool inside, springls__crowd *crowd)
{
    const float depth = 1.8f;
    int lo[3], hi[3], i, j, k;
    lo[0] = (int)springls__floor(x.x - radius);
    lo[1] = (int)springls__floor(x.y - radius);
    lo[2] = (int)springls__floor(x.z - radius);
    for (i = 0; i < 3; i++) hi[i] = lo[i] + (int)(2.0f * radius) + 1;
    crowd->count = 0;
    for (k = lo[2]; k <= hi[2]; k++)
        for (j = lo[1]; j <= hi[1]; j++)
            for (i = lo[0]; i <= hi[0]; i++) {
                float phi = springls__grid_phi(g, g->phi, i, j, k), weight;
                springls__v3 n, foot;
                if ((phi < 0.0f) != inside || springls__fabs(phi) > depth) continue;
                n = springls__unkinked_gradient(g, i, j, k);
                foot = springls__mad(springls__v3_make((float)i, (float)j, (float)k), n, -phi);
                weight = 1.0f - springls__length2(springls__sub(foot, x)) / (radius * radius);
                if (weight > 0.0f && springls__length2(n) > 0.5f) springls__join(crowd, foot, n, foot, weight * weight, -2);
            }
}

/* A corner of a triangle that sticks out beyond an edge, drawn back towards the particle. */
SPRINGLS__FN springls__v3 springls__draw_back(const springls__grid *g, springls__v3 p, springls__v3 q)
{
    const float out = 0.1f; /* voxel */
    int i;
    for (i = 0; i < 5 && springls__fabs(springls__grid_sample(g, g->phi, q)) > out; i++) q = springls__lerp(p, q, 0.6f);
    return q;
}

/* The springl on one side of a crease that it cut across. */
SPRINGLS__FN bool springls__initial_side(const springls__grid *g, springls__springl *s, uint8_t *edge)
{
    const float radius = 2.5f, slack = 0.4f; /* as far as marching cubes cuts a corner off */
    springls__v3 n = springls__springl_normal(s);
    springls__crowd crowd;
    springls__sides sides;
    springls__fit_result fit;
    int outside, m;
    for (outside = 0; outside < 2; outside++) {
        springls__gather_feet(g, s->p, radius, !outside, &crowd);
        sides = springls__crowd_sides(&crowd, 0.0f, false);
        if (sides.count < 1 || (outside && sides.count < 2)) continue;
        fit = springls__side_at(&crowd, sides, s->p, n, s->p, -1, outside ? 2 : 1, 1);
        if (!fit.ok || springls__length2(springls__sub(fit.point, s->p)) > slack * slack) continue;
        for (m = 0; m < 3; m++) s->q[m] = springls__add(fit.point, springls__turn_to(springls__sub(s->q[m], s->p), n, fit.normal));
        s->p = fit.point;
        for (m = 0; m < 3; m++) s->q[m] = springls__draw_back(g, s->p, s->q[m]);
        springls__springl_finish(s);
        *edge = sides.count > 1;
        return true;
    }
    return false;
}

/* Central differences. */
SPRINGLS__FN springls__v3 springls__voxel_gradient(const springls__grid *g, int x, int y, int z)
{
    return springls__v3_make(0.5f * (springls__grid_phi(g, g->phi, x + 1, y, z) - springls__grid_phi(g, g->phi, x - 1, y, z)),
                             0.5f * (springls__grid_phi(g, g->phi, x, y + 1, z) - springls__grid_phi(g, g->phi, x, y - 1, z)),
                             0.5f * (springls__grid_phi(g, g->phi, x, y, z + 1) - springls__grid_phi(g, g->phi, x, y, z - 1)));
}

/* True where phi has a kink near one of the eight voxels about x: what is read there to third order is off. */
SPRINGLS__FN bool springls__has_kink(const springls__grid *g, springls__v3 x)
{
    int i = (int)springls__floor(x.x), j = (int)springls__floor(x.y), k = (int)springls__floor(x.z), c;
    for (c = 0; c < 8; c++) {
        springls__v3 gradient = springls__voxel_gradient(g, i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
        if (springls__fabs(springls__length(gradient) - 1.0f) > 0.02f) return true;
    }
    return false;
}

SPRINGLS__FN void springls__initial_edges_task(void *arg, int begin, int end)
{
    springls_context *ctx = (springls_context *)arg;
    for (; begin < end; begin++) {
        springls__springl *s = &ctx->set.s[begin];
        if (springls__has_kink(&ctx->grid, s->p) && springls__initial_side(&ctx->grid, s, &ctx->set.edge[begin])) {
            ctx->set.a[begin] = s->p;
            ctx->set.was[begin] = s->p;
        }
    }
}

/* Initial springls of a level set that cut across a crease are moved to one side of it. */
SPRINGLS__FN void springls__initial_edges(springls_context *ctx)
{
    springls__parallel(ctx, ctx->set.count, 64, springls__initial_edges_task, ctx);
    springls__count_edges(ctx);
}

/* ---- the level set near a crease ---- */

/* Signed height of x over the sides about it; no weight where it is not clear what the sides are. */
SPRINGLS__FN springls__say springls__edge_distance(const springls__crowd *crowd, springls__v3 x)
{
    springls__sides sides = springls__crowd_sides(crowd, 0.0f, false), known;
    springls__v3 p[SPRINGLS__SIDES];
    float height[SPRINGLS__SIDES];
    springls__say all;
    int convex[SPRINGLS__SIDES] = { 0, 0, 0 }, side, i;
    all.weight = all.distance = 0.0f;
    if (sides.count == 0) return all;
    known.count = 0;
    for (side = 0; side < sides.count; side++) {
        springls__v3 middle = springls__v3_make(0.0f, 0.0f, 0.0f);
        float weight = 0.0f, value = 0.0f;
        for (i = 0; i < crowd->count; i++) {
            springls__say say;
            if (springls__side_of(sides, crowd->n[i]) != side) continue;
            say = springls__oriented_distance(x, sides.normal[side], crowd->p[i], crowd->n[i]);
            weight += say.weight;
            value += say.weight * say.distance;
            middle = springls__mad(middle, crowd->p[i], say.weight);
        }
        if (weight < 1e-3f) continue;
        p[known.count] = springls__scale(middle, 1.0f / weight);
        height[known.count] = value / weight;
        known.normal[known.count++] = sides.normal[side];
        all.weight += weight;
    }
    if (known.count == 0) return all;
    if (known.count > 1) convex[0] = springls__is_convex(p[0], known.normal[0], p[1], known.normal[1]);
    if (known.count > 2) {
        convex[1] = springls__is_convex(p[0], known.normal[0], p[2], known.normal[2]);
        convex[2] = springls__is_convex(p[1], known.normal[1], p[2], known.normal[2]);
    }
    all.distance = springls__height_over_sides(height, known.count, convex);
    return all;
}
