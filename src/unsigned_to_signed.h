/* unsigned_to_signed.h - the level set from springls alone (section 4.5): the background grows from the whole border of
   the volume, coarse to fine, and cannot leak through gaps narrower than the blocks it grows by. What it does not reach
   is the object. With project_level_set the springls then say on which side of them a voxel lies: narrow clefts, pockets
   and hollows that the background cannot reach are outside as well. */

/* Blocks closer than this to a springl stop the background. */
static const float springls__shell = 1.5f;

typedef struct springls__grow_job { springls_context *ctx; int block; uint8_t *grew; } springls__grow_job;

SPRINGLS__FN bool springls__background_at(const springls__grid *g, int x, int y, int z)
{
    return !springls__grid_contains(g, x, y, z) || springls__grid_voxel(g, g->phi, x, y, z) > 0.0f;
}

/* One growth of the background by a block of 4, 2 or 1 voxels, inside active bricks: phi (+1 background, -1 not yet) to
   phi_next. All voxels of a block are alike, so one voxel of a neighbour block speaks for it. */
SPRINGLS__FN void springls__grow_task(void *arg, int begin, int end)
{
    const springls__grow_job *job = (const springls__grow_job *)arg;
    const springls__grid *g = &job->ctx->model.grid;
    const int b = job->block;
    int x, y, z, i, j, k;
    for (; begin < end; begin++) {
        int slot = g->active[begin], o[3];
        const float *omega = g->omega + (size_t)slot * SPRINGLS__BRICK_VOXELS;
        const float *phi = g->phi + (size_t)slot * SPRINGLS__BRICK_VOXELS;
        float *next = g->phi_next + (size_t)slot * SPRINGLS__BRICK_VOXELS;
        springls__slot_origin(g, slot, o);
        job->grew[begin] = 0;
        memcpy(next, phi, SPRINGLS__BRICK_VOXELS * sizeof *next);
        for (z = 0; z < 8; z += b)
            for (y = 0; y < 8; y += b)
                for (x = 0; x < 8; x += b) {
                    float nearest = FLT_MAX;
                    if (phi[x + 8 * y + 64 * z] > 0.0f) continue;
                    if (!springls__background_at(g, o[0] + x - 1, o[1] + y, o[2] + z) && !springls__background_at(g, o[0] + x + b, o[1] + y, o[2] + z)
                        && !springls__background_at(g, o[0] + x, o[1] + y - 1, o[2] + z) && !springls__background_at(g, o[0] + x, o[1] + y + b, o[2] + z)
                        && !springls__background_at(g, o[0] + x, o[1] + y, o[2] + z - 1) && !springls__background_at(g, o[0] + x, o[1] + y, o[2] + z + b))
                        continue;
                    for (k = z; k < z + b; k++)
                        for (j = y; j < y + b; j++)
                            for (i = x; i < x + b; i++) nearest = springls__min(nearest, omega[i + 8 * j + 64 * k]);
                    if (nearest <= springls__shell) continue;
                    job->grew[begin] = 1;
                    for (k = z; k < z + b; k++)
                        for (j = y; j < y + b; j++)
                            for (i = x; i < x + b; i++) next[i + 8 * j + 64 * k] = 1.0f;
                }
    }
}

SPRINGLS__FN springls_status springls__grow_voxels(springls_context *ctx, int block, int iterations)
{
    springls__grow_job job;
    int i;
    bool grew = true;
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)ctx->model.grid.active_count, 1, (void **)&job.grew));
    job.ctx = ctx;
    job.block = block;
    for (; grew && iterations > 0; iterations--) {
        springls__parallel(ctx, ctx->model.grid.active_count, 8, springls__grow_task, &job);
        springls__swap_phi(ctx);
        for (grew = false, i = 0; i < ctx->model.grid.active_count; i++) grew = grew || job.grew[i];
    }
    return SPRINGLS_OK;
}

enum { SPRINGLS__OPEN = 0, SPRINGLS__BLOCKED = 1, SPRINGLS__BACKGROUND = 2 };

/* One sweep of the background by blocks of `step` bricks; a block with a blocked brick stays. Returns whether it grew. */
SPRINGLS__FN bool springls__grow_bricks(const springls__grid *g, uint8_t *state, int step)
{
    const int *n = g->bricks;
    int x, y, z, i, j, k, d;
    bool grew = false;
    for (z = 0; z < n[2]; z += step)
        for (y = 0; y < n[1]; y += step)
            for (x = 0; x < n[0]; x += step) {
                int hi[3];
                bool open = true, touches = x == 0 || y == 0 || z == 0 || x + step >= n[0] || y + step >= n[1] || z + step >= n[2];
                hi[0] = springls__imin(x + step, n[0]);
                hi[1] = springls__imin(y + step, n[1]);
                hi[2] = springls__imin(z + step, n[2]);
                if (state[x + n[0] * (y + n[1] * z)] == SPRINGLS__BACKGROUND) continue;
                for (d = 0; d < 6 && !touches; d++) { /* blocks are uniform: one brick of the neighbour block speaks */
                    int nx = x + (d == 0 ? -1 : d == 1 ? step : 0), ny = y + (d == 2 ? -1 : d == 3 ? step : 0), nz = z + (d == 4 ? -1 : d == 5 ? step : 0);
                    touches = state[nx + n[0] * (ny + n[1] * nz)] == SPRINGLS__BACKGROUND;
                }
                for (k = z; k < hi[2] && open && touches; k++)
                    for (j = y; j < hi[1] && open; j++)
                        for (i = x; i < hi[0] && open; i++) open = state[i + n[0] * (j + n[1] * k)] != SPRINGLS__BLOCKED;
                if (!open || !touches) continue;
                grew = true;
                for (k = z; k < hi[2]; k++)
                    for (j = y; j < hi[1]; j++)
                        for (i = x; i < hi[0]; i++) state[i + n[0] * (j + n[1] * k)] = SPRINGLS__BACKGROUND;
            }
    return grew;
}

/* Bricks within the band of any springl; everything else is dropped first. */
SPRINGLS__FN springls_status springls__bricks_around_springls(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int i, x, y, z, lo[3], hi[3], pass, *list = NULL;
    size_t total = 0;
    springls__grid_clear(ctx, g);
    springls__constellation_changed(ctx);
    for (pass = 0; pass < 2; pass++) {
        if (pass) SPRINGLS__TRY(springls__scratch(ctx, 1, total, sizeof(int), (void **)&list));
        for (total = 0, i = 0; i < ctx->model.set.count; i++) {
            springls__springl_bricks(g, &ctx->model.set.s[i], ctx->model.params.band_half_width + 1.0f, lo, hi);
            for (z = lo[2]; z <= hi[2]; z++)
                for (y = lo[1]; y <= hi[1]; y++)
                    for (x = lo[0]; x <= hi[0]; x++, total++)
                        if (pass) list[total] = x + g->bricks[0] * (y + g->bricks[1] * z);
        }
        if (total > (size_t)INT32_MAX) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "the springls are too large for the grid");
    }
    return springls__grid_add_bricks(ctx, list, (int)total);
}

/* Voxels that springls are near take the side of the nearest ones. */
SPRINGLS__FN void springls__sides_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    const springls__grid *g = &ctx->model.grid;
    const float capture = ctx->model.params.capture;
    float side[SPRINGLS__BRICK_VOXELS];
    int y, z, v, o[3];
    uint32_t k;
    for (; begin < end; begin++) {
        float *phi = g->phi + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        const float *omega = g->omega + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        springls__slot_origin(g, g->active[begin], o);
        memset(side, 0, sizeof side);
        for (k = ctx->model.cells.near_first[begin]; k < ctx->model.cells.near_first[begin + 1]; k++) {
            const springls__springl *s = &ctx->model.set.s[ctx->model.cells.near_ids[k]];
            springls__tri_plan plan = springls__tri_plan_make(springls__springl_tri(*s));
            float r = s->reach + capture, py = s->p.y - (float)o[1], pz = s->p.z - (float)o[2];
            int y0 = (int)springls__clamp(py - r, 0.0f, 7.0f), y1 = (int)springls__clamp(py + r, 0.0f, 7.0f);
            int z0 = (int)springls__clamp(pz - r, 0.0f, 7.0f), z1 = (int)springls__clamp(pz + r, 0.0f, 7.0f);
            for (z = z0; z <= z1; z++)
                for (y = y0; y <= y1; y++) {
                    int row = 8 * y + 64 * z;
                    springls__side_row(&plan, s->p, s->reach, capture, o[0], o[1] + y, o[2] + z, omega + row, side + row);
                }
        }
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++)
            if (omega[v] < capture && side[v] != 0.0f) phi[v] = side[v] > 0.0f ? 1.0f : -1.0f;
    }
}

/* A connected part of the foreground that no springl is near: the inside of the object, a hollow in it, a pocket with a
   narrow entrance. It is on one side as a whole: that of most voxels around it. */
typedef struct springls__region {
    springls_context *ctx;
    uint8_t *state;       /* of the bricks                                              */
    int64_t *member;      /* a voxel's place in phi, or -1 - brick for a constant brick */
    int64_t count, votes; /* votes: voxels around it that are outside less those inside */
} springls__region;

enum { SPRINGLS__COUNTED = 3 };              /* a brick that is in a region */
static const float springls__counted = -2.0f; /* a voxel that is            */

/* The place in phi of the i-th voxel of the active bricks. */
SPRINGLS__FN int64_t springls__active_voxel(const springls__grid *g, int64_t i)
{
    return (int64_t)g->active[i / SPRINGLS__BRICK_VOXELS] * SPRINGLS__BRICK_VOXELS + i % SPRINGLS__BRICK_VOXELS;
}

SPRINGLS__FN bool springls__unsettled(const springls__region *r, int64_t v)
{
    const springls__grid *g = &r->ctx->model.grid;
    return g->omega[v] >= r->ctx->model.params.capture && g->phi[v] < 0.0f && g->phi[v] != springls__counted;
}

SPRINGLS__FN void springls__region_reach(springls__region *r, int x, int y, int z)
{
    springls__grid *g = &r->ctx->model.grid;
    int slot;
    int64_t v;
    if (!springls__grid_contains(g, x, y, z)) return;
    slot = springls__slot_at(g, x, y, z);
    if (slot < SPRINGLS__FIRST_SLOT) {
        int brick = springls__brick_at(g, x, y, z);
        if (r->state[brick] != SPRINGLS__OPEN) return;
        r->state[brick] = SPRINGLS__COUNTED;
        r->member[r->count++] = -1 - (int64_t)brick;
        return;
    }
    v = (int64_t)slot * SPRINGLS__BRICK_VOXELS + springls__voxel_in_brick(x, y, z);
    if (g->omega[v] < r->ctx->model.params.capture) r->votes += g->phi[v] > 0.0f ? 1 : -1;
    if (!springls__unsettled(r, v)) return;
    g->phi[v] = springls__counted;
    r->member[r->count++] = v;
}

/* From a voxel, or from the faces of a constant brick, to what lies beside it. */
SPRINGLS__FN void springls__region_step(springls__region *r, int64_t member)
{
    const springls__grid *g = &r->ctx->model.grid;
    int brick = member < 0 ? (int)(-1 - member) : g->slot_brick[member / SPRINGLS__BRICK_VOXELS];
    int v = member < 0 ? 0 : (int)(member % SPRINGLS__BRICK_VOXELS), n = member < 0 ? 8 : 1, d, i, j;
    int at[3];
    at[0] = 8 * (brick % g->bricks[0]) + (v & 7);
    at[1] = 8 * (brick / g->bricks[0] % g->bricks[1]) + (v >> 3 & 7);
    at[2] = 8 * (brick / (g->bricks[0] * g->bricks[1])) + (v >> 6);
    for (d = 0; d < 6; d++)
        for (j = 0; j < n; j++)
            for (i = 0; i < n; i++) {
                int to[3], axis = d >> 1;
                to[axis] = at[axis] + (d & 1 ? n : -1);
                to[(axis + 1) % 3] = at[(axis + 1) % 3] + i;
                to[(axis + 2) % 3] = at[(axis + 2) % 3] + j;
                springls__region_reach(r, to[0], to[1], to[2]);
            }
}

SPRINGLS__FN void springls__region_settle(springls__region *r, int64_t first)
{
    springls__grid *g = &r->ctx->model.grid;
    int64_t i;
    r->count = r->votes = 0;
    g->phi[first] = springls__counted;
    r->member[r->count++] = first;
    for (i = 0; i < r->count; i++) springls__region_step(r, r->member[i]);
    if (r->votes <= 0) return;
    for (i = 0; i < r->count; i++) {
        if (r->member[i] < 0) g->top[-1 - r->member[i]] = SPRINGLS__OUTSIDE;
        else g->phi[r->member[i]] = 1.0f;
    }
}

SPRINGLS__FN springls_status springls__sides_of_springls(springls_context *ctx, uint8_t *state, size_t bricks)
{
    const springls__grid *g = &ctx->model.grid;
    const int64_t voxels = (int64_t)g->active_count * SPRINGLS__BRICK_VOXELS;
    springls__region region;
    void *memory;
    size_t room = bricks;
    int64_t v;
    springls__parallel(ctx, g->active_count, 4, springls__sides_task, ctx);
    region.ctx = ctx;
    region.state = state;
    for (v = 0; v < voxels; v++) room += springls__unsettled(&region, springls__active_voxel(g, v));
    SPRINGLS__TRY(springls__scratch(ctx, 1, room, sizeof *region.member, &memory));
    region.member = (int64_t *)memory;
    for (v = 0; v < voxels; v++)
        if (springls__unsettled(&region, springls__active_voxel(g, v))) springls__region_settle(&region, springls__active_voxel(g, v));
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__unsigned_to_signed(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    size_t bricks = (size_t)g->bricks[0] * (size_t)g->bricks[1] * (size_t)g->bricks[2], b;
    uint8_t *state;
    int i, v, step = 1;
    SPRINGLS__TRY(springls__use_host(ctx, true));
    if (ctx->model.set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "unsigned_to_signed: there are no springls");
    SPRINGLS__TRY(springls__bricks_around_springls(ctx));
    SPRINGLS__TRY(springls__omega_build(ctx));
    SPRINGLS__TRY(springls__scratch(ctx, 2, bricks, 1, (void **)&state));
    memset(state, SPRINGLS__OPEN, bricks);
    for (i = 0; i < g->active_count; i++) {
        const float *omega = g->omega + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
        float nearest = FLT_MAX;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) nearest = springls__min(nearest, omega[v]);
        if (nearest <= springls__shell) state[g->slot_brick[g->active[i]]] = SPRINGLS__BLOCKED;
    }
    while (16 * 8 * step * 2 <= springls__imax(g->size[0], springls__imax(g->size[1], g->size[2]))) step *= 2;
    for (; step >= 1; step /= 2) /* the paper's coarse levels, each to its end */
        while (springls__grow_bricks(g, state, step)) continue;
    for (b = 0; b < bricks; b++)
        if (g->top[b] < SPRINGLS__FIRST_SLOT) g->top[b] = state[b] == SPRINGLS__BACKGROUND ? SPRINGLS__OUTSIDE : SPRINGLS__INSIDE;
    for (i = 0; i < g->active_count; i++)
        springls__fill(g->phi, g->active[i], state[g->slot_brick[g->active[i]]] == SPRINGLS__BACKGROUND ? 1.0f : -1.0f);
    SPRINGLS__TRY(springls__grow_voxels(ctx, 4, INT32_MAX));
    SPRINGLS__TRY(springls__grow_voxels(ctx, 2, 2));
    SPRINGLS__TRY(springls__grow_voxels(ctx, 1, 2));
    if (ctx->model.params.project_level_set) SPRINGLS__TRY(springls__sides_of_springls(ctx, state, bricks));
    for (i = 0; i < g->active_count; i++) {
        float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
        const float *omega = g->omega + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) phi[v] = phi[v] < 0.0f ? -omega[v] : omega[v];
    }
    springls__phi_in_step(ctx);
    return springls__rebuild(ctx);
}

SPRINGLS_API springls_status springls_unsigned_to_signed(springls_context *ctx)
{
    return springls__staged(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED, springls__unsigned_to_signed);
}
