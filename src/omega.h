/* omega.h - the unsigned level set omega (eq. 21) in every active brick: exact distance to the springls, clamped. */

/* Clips the bricks that come within `margin` of a springl to those of the top table. */
SPRINGLS__FN void springls__springl_bricks(const springls__grid *g, const springls__springl *s, float margin, int lo[3], int hi[3])
{
    springls__v3 lower, upper;
    lower.x = springls__min(s->q[0].x, springls__min(s->q[1].x, s->q[2].x)) - margin;
    lower.y = springls__min(s->q[0].y, springls__min(s->q[1].y, s->q[2].y)) - margin;
    lower.z = springls__min(s->q[0].z, springls__min(s->q[1].z, s->q[2].z)) - margin;
    upper.x = springls__max(s->q[0].x, springls__max(s->q[1].x, s->q[2].x)) + margin;
    upper.y = springls__max(s->q[0].y, springls__max(s->q[1].y, s->q[2].y)) + margin;
    upper.z = springls__max(s->q[0].z, springls__max(s->q[1].z, s->q[2].z)) + margin;
    lo[0] = springls__cell_coordinate(lower.x, g->size[0]) >> 3;
    lo[1] = springls__cell_coordinate(lower.y, g->size[1]) >> 3;
    lo[2] = springls__cell_coordinate(lower.z, g->size[2]) >> 3;
    hi[0] = springls__cell_coordinate(upper.x, g->size[0]) >> 3;
    hi[1] = springls__cell_coordinate(upper.y, g->size[1]) >> 3;
    hi[2] = springls__cell_coordinate(upper.z, g->size[2]) >> 3;
}

/* Springls near each active brick, by counting sort; ids ascend within a brick. Two passes over the same walk. */
SPRINGLS__FN springls_status springls__near_build(springls_context *ctx, float margin)
{
    springls__grid *g = &ctx->grid;
    springls__cells *cells = &ctx->cells;
    int *rank, i, pass, total = 0;
    SPRINGLS__TRY(springls__scratch(ctx, 0, (size_t)g->slot_count, sizeof(int), (void **)&rank));
    SPRINGLS__TRY(springls__grow(ctx, &cells->near_first_memory, (size_t)g->active_count + 2, sizeof(uint32_t), 0));
    cells->near_first = (uint32_t *)cells->near_first_memory.data;
    memset(cells->near_first, 0, ((size_t)g->active_count + 2) * sizeof(uint32_t));
    for (i = 0; i < g->active_count; i++) rank[g->active[i]] = i;
    for (pass = 0; pass < 2; pass++) {
        for (i = 0; i < ctx->set.count; i++) {
            int lo[3], hi[3], x, y, z;
            springls__springl_bricks(g, &ctx->set.s[i], margin, lo, hi);
            for (z = lo[2]; z <= hi[2]; z++)
                for (y = lo[1]; y <= hi[1]; y++)
                    for (x = lo[0]; x <= hi[0]; x++) {
                        int slot = g->top[x + g->bricks[0] * (y + g->bricks[1] * z)];
                        if (slot < SPRINGLS__FIRST_SLOT) continue;
                        if (pass == 0) cells->near_first[rank[slot] + 2]++;
                        else cells->near_ids[cells->near_first[rank[slot] + 1]++] = (uint32_t)i;
                    }
        }
        if (pass == 1) break;
        for (i = 0; i < g->active_count; i++) { /* entry i+1 becomes the start of brick i; the second pass moves it on */
            cells->near_first[i + 2] += cells->near_first[i + 1];
        }
        total = (int)cells->near_first[g->active_count + 1];
        SPRINGLS__TRY(springls__grow(ctx, &cells->near_memory, (size_t)total + 1, sizeof(uint32_t), 0));
        cells->near_ids = (uint32_t *)cells->near_memory.data;
    }
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__omega_brick(const springls_context *ctx, int index)
{
    const springls__grid *g = &ctx->grid;
    const float capture = ctx->params.capture;
    float *omega = g->omega + (size_t)g->active[index] * SPRINGLS__BRICK_VOXELS;
    int origin[3], i, y, z;
    uint32_t k;
    springls__slot_origin(g, g->active[index], origin);
    for (i = 0; i < SPRINGLS__BRICK_VOXELS; i++) omega[i] = capture;
    for (k = ctx->cells.near_first[index]; k < ctx->cells.near_first[index + 1]; k++) {
        const springls__springl *s = &ctx->set.s[ctx->cells.near_ids[k]];
        springls__tri_plan plan = springls__tri_plan_make(springls__springl_tri(s));
        float ylo = springls__min(s->q[0].y, springls__min(s->q[1].y, s->q[2].y)) - capture - (float)origin[1];
        float yhi = springls__max(s->q[0].y, springls__max(s->q[1].y, s->q[2].y)) + capture - (float)origin[1];
        float zlo = springls__min(s->q[0].z, springls__min(s->q[1].z, s->q[2].z)) - capture - (float)origin[2];
        float zhi = springls__max(s->q[0].z, springls__max(s->q[1].z, s->q[2].z)) + capture - (float)origin[2];
        int y0 = (int)springls__clamp(ylo, 0.0f, 7.0f), y1 = (int)springls__clamp(yhi, 0.0f, 7.0f);
        float reach = s->reach * 1.0001f + 1e-3f; /* no rounding may turn away a springl that is nearer */
        int z0 = (int)springls__clamp(zlo, 0.0f, 7.0f), z1 = (int)springls__clamp(zhi, 0.0f, 7.0f);
        for (z = z0; z <= z1; z++)
            for (y = y0; y <= y1; y++)
                springls__omega_row(&plan, s->p, reach, origin[0], origin[1] + y, origin[2] + z, omega + 8 * y + 64 * z);
    }
}

/* omega's first voxel below zero: the brick is new, or its springls have moved. */
SPRINGLS__FN bool springls__omega_unknown(const springls__grid *g, int slot)
{
    return g->omega[(size_t)slot * SPRINGLS__BRICK_VOXELS] < 0.0f;
}

SPRINGLS__FN void springls__omega_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    for (; begin < end; begin++)
        if (springls__omega_unknown(&ctx->grid, ctx->grid.active[begin])) springls__omega_brick(ctx, begin);
}

/* omega where it is unknown: everywhere after springls have moved, else in the bricks that the band has reached since. */
SPRINGLS__FN springls_status springls__omega_build(springls_context *ctx)
{
    springls__grid *g = &ctx->grid;
    bool unknown = false;
    int i;
    for (i = 0; i < g->active_count; i++) {
        if (!ctx->omega_fresh) g->omega[(size_t)g->active[i] * SPRINGLS__BRICK_VOXELS] = -1.0f;
        unknown = unknown || springls__omega_unknown(g, g->active[i]);
    }
    if (unknown) {
        SPRINGLS__TRY(springls__near_build(ctx, ctx->params.capture));
        springls__parallel(ctx, g->active_count, 4, springls__omega_task, ctx);
    }
    ctx->omega_fresh = true;
    return SPRINGLS_OK;
}
