/* project.h - phi near the springls becomes their oriented distance: eq. 23 decides the side, the springls the value.
   It takes the chord error of flat triangles and the lag of the moving front out of the level set. */

SPRINGLS__FN void springls__project_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    const springls__grid *g = &ctx->grid;
    const float width = 1.2f, reach = SPRINGLS__PROJECT_RADIUS; /* width: no voxel beyond it is next to the zero level */
    float tile[SPRINGLS__TILE_VOXELS], weight[SPRINGLS__BRICK_VOXELS], value[SPRINGLS__BRICK_VOXELS];
    springls__v3 direction[SPRINGLS__BRICK_VOXELS];
    int x, y, z, v, o[3];
    uint32_t k;
    for (; begin < end; begin++) {
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        springls__slot_origin(g, g->active[begin], o);
        springls__load_tile(g, g->phi, g->active[begin], tile);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            springls__cross7 c = springls__tile_cross(tile + springls__tile_index(v & 7, v >> 3 & 7, v >> 6));
            out[v] = c.c;
            weight[v] = value[v] = 0.0f;
            direction[v] = springls__fabs(c.c) < width
                ? springls__normalize(springls__v3_make(c.xp - c.xm, c.yp - c.ym, c.zp - c.zm)) : springls__v3_make(0.0f, 0.0f, 0.0f);
        }
        for (k = ctx->cells.near_first[begin]; k < ctx->cells.near_first[begin + 1]; k++) {
            const springls__springl *s = &ctx->set.s[ctx->cells.near_ids[k]];
            springls__v3 n = springls__springl_normal(s), p = s->p;
            int lo[3], hi[3];
            lo[0] = springls__imax((int)springls__floor(p.x - reach) + 1 - o[0], 0);
            lo[1] = springls__imax((int)springls__floor(p.y - reach) + 1 - o[1], 0);
            lo[2] = springls__imax((int)springls__floor(p.z - reach) + 1 - o[2], 0);
            hi[0] = springls__imin((int)springls__floor(p.x + reach) - o[0], 7);
            hi[1] = springls__imin((int)springls__floor(p.y + reach) - o[1], 7);
            hi[2] = springls__imin((int)springls__floor(p.z + reach) - o[2], 7);
            for (z = lo[2]; z <= hi[2]; z++)
                for (y = lo[1]; y <= hi[1]; y++)
                    for (x = lo[0]; x <= hi[0]; x++) {
                        springls__say say;
                        v = x + 8 * y + 64 * z;
                        say = springls__oriented_distance(springls__v3_make((float)(o[0] + x), (float)(o[1] + y), (float)(o[2] + z)),
                                                          direction[v], p, n);
                        weight[v] += say.weight;
                        value[v] += say.value;
                    }
        }
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) out[v] = springls__corrected_phi(out[v], weight[v], value[v]);
    }
}

/* ---- nucleation: a sheet thinner than a voxel slips between the voxels that phi knows to be inside. Its springls are
   still there, and put such voxels back. ---- */

/* phi at x when both sides of a thin sheet say that it lies between them: the nearest springl in front of it, seen straight
   on, and an opposed one. 0 otherwise; the two sides of a gap between bodies both say outside. */
SPRINGLS__FN float springls__nucleus(const springls_context *ctx, springls__v3 x)
{
    const float r = SPRINGLS__PROJECT_RADIUS, deepest = 0.8f, straight = 0.7f;
    springls__tri nearest;
    springls__v3 n, toward;
    springls__cell_walk walk;
    float weight = 0.0f, value = 0.0f;
    int opposed = 0, i = springls__nearest_springl(ctx, x, deepest);
    if (i < 0) return 0.0f;
    nearest = springls__springl_tri(&ctx->set.s[i]);
    n = springls__tri_normal(nearest);
    toward = springls__sub(springls__tri_closest(nearest, x).point, x);
    if (springls__dot(toward, n) <= straight * springls__length(toward)) return 0.0f;
    walk = springls__cell_walk_near(ctx, x, r);
    while ((i = springls__cell_walk_next(&walk)) >= 0) {
        const springls__springl *s = &ctx->set.s[i];
        springls__v3 d = springls__sub(x, s->p), m;
        springls__say say;
        if (springls__length2(d) >= r * r) continue;
        m = springls__springl_normal(s);
        say = springls__oriented_distance(x, n, s->p, m);
        weight += say.weight;
        value += say.value;
        if (springls__dot(n, m) < -0.5f) opposed |= springls__claims_inside(d, m, r, 0.6f);
    }
    value /= springls__max(weight, 1e-6f);
    return opposed && value < 0.0f && value > -deepest && springls__in_sheet(ctx, x, n) ? value : 0.0f;
}

/* Which voxels outside does any springl claim to be inside? Few: elsewhere phi and springls agree. */
SPRINGLS__FN void springls__mark_claims(const springls_context *ctx, int brick, const int o[3], const float *phi, uint8_t *claimed)
{
    const float reach = 1.2f;
    uint32_t k;
    int x, y, z, a;
    memset(claimed, 0, SPRINGLS__BRICK_VOXELS);
    for (k = ctx->cells.near_first[brick]; k < ctx->cells.near_first[brick + 1]; k++) {
        const springls__springl *s = &ctx->set.s[ctx->cells.near_ids[k]];
        springls__v3 n = springls__springl_normal(s), p = s->p;
        int lo[3], hi[3];
        lo[0] = (int)springls__floor(p.x - reach) + 1 - o[0];
        lo[1] = (int)springls__floor(p.y - reach) + 1 - o[1];
        lo[2] = (int)springls__floor(p.z - reach) + 1 - o[2];
        hi[0] = (int)springls__floor(p.x + reach) - o[0];
        hi[1] = (int)springls__floor(p.y + reach) - o[1];
        hi[2] = (int)springls__floor(p.z + reach) - o[2];
        for (a = 0; a < 3; a++) {
            lo[a] = springls__imax(lo[a], 0);
            hi[a] = springls__imin(hi[a], 7);
        }
        for (z = lo[2]; z <= hi[2]; z++)
            for (y = lo[1]; y <= hi[1]; y++)
                for (x = lo[0]; x <= hi[0]; x++) {
                    int v = x + 8 * y + 64 * z;
                    springls__v3 d = springls__v3_make((float)(o[0] + x) - p.x, (float)(o[1] + y) - p.y, (float)(o[2] + z) - p.z);
                    if (phi[v] >= 0.0f && springls__claims_inside(d, n, 0.8f, 1.0f)) claimed[v] = 1;
                }
    }
}

SPRINGLS__FN void springls__nucleate_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    const springls__grid *g = &ctx->grid;
    uint8_t claimed[SPRINGLS__BRICK_VOXELS];
    int v, o[3];
    for (; begin < end; begin++) {
        const float *phi = g->phi + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        springls__slot_origin(g, g->active[begin], o);
        springls__mark_claims(ctx, begin, o, phi, claimed);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            int x = o[0] + (v & 7), y = o[1] + (v >> 3 & 7), z = o[2] + (v >> 6);
            float f = claimed[v] && springls__grid_contains(g, x, y, z)
                    ? springls__nucleus(ctx, springls__v3_make((float)x, (float)y, (float)z)) : 0.0f;
            out[v] = f < 0.0f ? f : phi[v];
        }
    }
}

/* The voxels around a new one learn that the zero level is near, even where they were far from it. */
SPRINGLS__FN void springls__around_nuclei_task(void *arg, int begin, int end)
{
    const springls__grid *g = &((const springls_context *)arg)->grid;
    float tile[SPRINGLS__TILE_VOXELS];
    int v;
    for (; begin < end; begin++) {
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        springls__load_tile(g, g->phi, g->active[begin], tile);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            springls__cross7 c = springls__tile_cross(tile + springls__tile_index(v & 7, v >> 3 & 7, v >> 6));
            out[v] = springls__beside_inside(c.c, springls__min(springls__min(springls__min(c.xm, c.xp), springls__min(c.ym, c.yp)),
                                                                springls__min(c.zm, c.zp)));
        }
    }
}

/* Bricks within two voxels of the particles: where phi has lost a sheet they may be missing, with all their neighbours. */
SPRINGLS__FN springls_status springls__cover_springls(springls_context *ctx)
{
    const float margin = 2.0f;
    springls__grid *g = &ctx->grid;
    int i, pass, n = 0, *missing = NULL;
    for (pass = 0; pass < 2; pass++) {
        if (pass == 1 && n == 0) return SPRINGLS_OK;
        if (pass == 1) SPRINGLS__TRY(springls__scratch(ctx, 0, (size_t)n, sizeof(int), (void **)&missing));
        n = 0;
        for (i = 0; i < ctx->set.count; i++) {
            int lo[3], hi[3], x, y, z;
            springls__box_bricks(g, ctx->set.s[i].p, margin, lo, hi);
            for (z = lo[2]; z <= hi[2]; z++)
                for (y = lo[1]; y <= hi[1]; y++)
                    for (x = lo[0]; x <= hi[0]; x++) {
                        int brick = x + g->bricks[0] * (y + g->bricks[1] * z);
                        if (g->top[brick] >= SPRINGLS__FIRST_SLOT) continue;
                        if (pass == 1) missing[n] = brick;
                        n++;
                    }
        }
    }
    return springls__grid_add_bricks(ctx, g, missing, n);
}

/* With fresh cells and the springls near each brick found. */
SPRINGLS__FN void springls__nucleate(springls_context *ctx)
{
    springls__parallel(ctx, ctx->grid.active_count, 4, springls__nucleate_task, ctx);
    springls__commit_phi(ctx);
    springls__parallel(ctx, ctx->grid.active_count, 8, springls__around_nuclei_task, ctx);
    springls__swap_phi(&ctx->grid);
}

SPRINGLS__FN springls_status springls__project_level_set(springls_context *ctx)
{
    if (ctx->params.nucleate) {
        SPRINGLS__TRY(springls__cover_springls(ctx));
        SPRINGLS__TRY(springls__cells_build(ctx));
    }
    SPRINGLS__TRY(springls__near_build(ctx, SPRINGLS__PROJECT_RADIUS)); /* the band has moved: lists follow its bricks */
    springls__parallel(ctx, ctx->grid.active_count, 4, springls__project_task, ctx);
    springls__commit_phi(ctx);
    if (ctx->params.nucleate) springls__nucleate(ctx);
    springls__redistance_sweeps(ctx, 2);
    return SPRINGLS_OK;
}
