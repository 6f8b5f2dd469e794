/* cells.h - the hash grid (section 4.8): springls by the cell of their particle, by counting sort. Deterministic: ids ascend
   within a cell, and no cell overflows. A springl whose reach exceeds the cap is kept in `large` instead,
   so that one huge triangle does not widen every search. */

SPRINGLS__FN int springls__cell_coordinate(float x, int size)
{
    return springls__iclamp((int)springls__floor(springls__clamp(x, 0.0f, (float)size)), 0, size - 1);
}

/* The cell of a voxel within its brick. */
SPRINGLS__FN int springls__cell_in_brick(int x, int y, int z)
{
    return (x & 7) / SPRINGLS__CELL + 4 * ((y & 7) / SPRINGLS__CELL) + 16 * ((z & 7) / SPRINGLS__CELL);
}

/* The range of bricks within `margin` of p, as far as there are any. */
SPRINGLS__FN void springls__box_bricks(const springls__grid *g, springls__v3 p, float margin, int lo[3], int hi[3])
{
    lo[0] = springls__cell_coordinate(p.x - margin, g->size[0]) >> 3;
    lo[1] = springls__cell_coordinate(p.y - margin, g->size[1]) >> 3;
    lo[2] = springls__cell_coordinate(p.z - margin, g->size[2]) >> 3;
    hi[0] = springls__cell_coordinate(p.x + margin, g->size[0]) >> 3;
    hi[1] = springls__cell_coordinate(p.y + margin, g->size[1]) >> 3;
    hi[2] = springls__cell_coordinate(p.z + margin, g->size[2]) >> 3;
}

/* Which cell a particle is in, counted through all slots; or that its springl is large, or its brick not active yet. */
static const size_t springls__large_key = SIZE_MAX, springls__missing_key = SIZE_MAX - 1;

SPRINGLS__FN void springls__keys_task(void *arg, int begin, int end)
{
    const float reach_cap = 2.5f; /* twice that of a springl about to be split */
    const springls_context *ctx = (const springls_context *)arg;
    const springls__grid *g = &ctx->grid;
    size_t *key = (size_t *)ctx->cells.key_memory.data;
    for (; begin < end; begin++) {
        const springls__springl *s = &ctx->set.s[begin];
        int x = springls__cell_coordinate(s->p.x, g->size[0]), y = springls__cell_coordinate(s->p.y, g->size[1]);
        int z = springls__cell_coordinate(s->p.z, g->size[2]), slot = springls__slot_at(g, x, y, z);
        key[begin] = slot < SPRINGLS__FIRST_SLOT ? springls__missing_key : s->reach > reach_cap ? springls__large_key
                   : (size_t)slot * SPRINGLS__CELLS + (size_t)springls__cell_in_brick(x, y, z) + 1;
    }
}

/* Every particle's cell, its brick being made active if need be. */
SPRINGLS__FN springls_status springls__cell_keys(springls_context *ctx, size_t **key)
{
    springls__grid *g = &ctx->grid;
    int i, n = 0, *missing;
    SPRINGLS__TRY(springls__grow(ctx, &ctx->cells.key_memory, (size_t)ctx->set.count + 1, sizeof(size_t), 0));
    SPRINGLS__TRY(springls__scratch(ctx, 0, (size_t)ctx->set.count, sizeof(int), (void **)&missing));
    *key = (size_t *)ctx->cells.key_memory.data;
    springls__parallel(ctx, ctx->set.count, 1024, springls__keys_task, ctx);
    for (i = 0; i < ctx->set.count; i++) {
        springls__v3 p = ctx->set.s[i].p;
        if ((*key)[i] == springls__missing_key)
            missing[n++] = springls__brick_at(g, springls__cell_coordinate(p.x, g->size[0]), springls__cell_coordinate(p.y, g->size[1]),
                                              springls__cell_coordinate(p.z, g->size[2]));
    }
    if (n == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grid_add_bricks(ctx, g, missing, n));
    springls__parallel(ctx, ctx->set.count, 1024, springls__keys_task, ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__cells_build(springls_context *ctx)
{
    springls__grid *g = &ctx->grid;
    springls__cells *cells = &ctx->cells;
    const springls__springl *s = ctx->set.s;
    size_t n = (size_t)ctx->set.count;
    size_t *key;
    uint32_t running = 0;
    int i, c;
    if (ctx->cells_fresh) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__cell_keys(ctx, &key));
    SPRINGLS__TRY(springls__grow(ctx, &cells->ids_memory, n + 1, sizeof(uint32_t), 0));
    SPRINGLS__TRY(springls__grow(ctx, &cells->large_memory, n + 1, sizeof(uint32_t), 0));
    cells->ids = (uint32_t *)cells->ids_memory.data;
    cells->large = (uint32_t *)cells->large_memory.data;
    cells->reach = 0.0f;
    cells->large_count = 0;
    for (i = 0; i < g->active_count; i++)
        memset(g->cell + (size_t)g->active[i] * SPRINGLS__CELLS, 0, SPRINGLS__CELLS * sizeof *g->cell);
    for (i = 0; i < ctx->set.count; i++) { /* count, one place late: see the scan */
        if (key[i] == springls__large_key) {
            cells->large[cells->large_count++] = (uint32_t)i;
            continue;
        }
        cells->reach = springls__max(cells->reach, s[i].reach);
        g->cell[key[i]]++;
    }
    for (i = 0; i < g->active_count; i++) { /* scan: entry c+1 becomes where cell c starts */
        uint32_t *cell = g->cell + (size_t)g->active[i] * SPRINGLS__CELLS;
        cell[0] = running;
        for (c = 1; c < SPRINGLS__CELLS; c++) {
            uint32_t count = cell[c];
            cell[c] = running;
            running += count;
        }
    }
    for (i = 0; i < ctx->set.count; i++) /* scatter: entry c+1 moves on to where cell c ends */
        if (key[i] != springls__large_key) cells->ids[g->cell[key[i]]++] = (uint32_t)i;
    ctx->cells_fresh = true;
    return SPRINGLS_OK;
}

/* The bricks that the particles of an active brick are within one cell of: see springls__reach_of_row. */
SPRINGLS__FN uint32_t springls__cells_reach(const uint32_t *cell)
{
    uint32_t reach = 0;
    int y, z;
    for (z = 0; z < 4; z++)
        for (y = 0; y < 4; y++, cell += 4)
            if (cell[4] > cell[0]) reach |= springls__reach_of_row(cell[1] > cell[0], cell[4] > cell[3], y == 0, y == 3, z == 0, z == 3);
    return reach;
}

/* Bricks within one cell of any particle; those of the large springls too, which are in no cell. */
SPRINGLS__FN springls_status springls__cells_cover_around(springls_context *ctx)
{
    springls__grid *g = &ctx->grid;
    int i, d, n = 0, *missing;
    SPRINGLS__TRY(springls__cells_build(ctx));
    SPRINGLS__TRY(springls__scratch(ctx, 0, 26 * ((size_t)g->active_count + (size_t)ctx->cells.large_count), sizeof(int), (void **)&missing));
    for (i = 0; i < g->active_count + ctx->cells.large_count; i++) {
        uint32_t reach = ~0u;
        int o[3];
        if (i < g->active_count) {
            springls__slot_origin(g, g->active[i], o);
            reach = springls__cells_reach(g->cell + (size_t)g->active[i] * SPRINGLS__CELLS);
        } else {
            springls__v3 p = ctx->set.s[ctx->cells.large[i - g->active_count]].p;
            o[0] = springls__cell_coordinate(p.x, g->size[0]) & ~7;
            o[1] = springls__cell_coordinate(p.y, g->size[1]) & ~7;
            o[2] = springls__cell_coordinate(p.z, g->size[2]) & ~7;
        }
        for (d = 0; d < 27 && reach; d++) {
            int x = o[0] + 8 * (d % 3 - 1), y = o[1] + 8 * (d / 3 % 3 - 1), z = o[2] + 8 * (d / 9 - 1);
            if (!(reach >> d & 1u) || !springls__grid_contains(g, x, y, z)) continue;
            if (springls__slot_at(g, x, y, z) < SPRINGLS__FIRST_SLOT) missing[n++] = springls__brick_at(g, x, y, z);
        }
    }
    return springls__grid_add_bricks(ctx, g, missing, n);
}

/* A walk over all springls whose particle lies in a box of cells, row by row; then over the large ones. */
typedef struct springls__cell_walk {
    const springls__grid *g;
    const springls__cells *cells;
    int lo[3], hi[3], x, y, z;
    uint32_t next, end;
    int large;
} springls__cell_walk;

SPRINGLS__FN springls__cell_walk springls__cell_walk_begin(const springls_context *ctx, springls__v3 lower, springls__v3 upper)
{
    springls__cell_walk walk;
    const springls__grid *g = &ctx->grid;
    walk.g = g;
    walk.cells = &ctx->cells;
    walk.lo[0] = springls__cell_coordinate(lower.x, g->size[0]) & -SPRINGLS__CELL;
    walk.lo[1] = springls__cell_coordinate(lower.y, g->size[1]) & -SPRINGLS__CELL;
    walk.lo[2] = springls__cell_coordinate(lower.z, g->size[2]) & -SPRINGLS__CELL;
    walk.hi[0] = springls__cell_coordinate(upper.x, g->size[0]);
    walk.hi[1] = springls__cell_coordinate(upper.y, g->size[1]);
    walk.hi[2] = springls__cell_coordinate(upper.z, g->size[2]);
    walk.x = walk.lo[0];
    walk.y = walk.lo[1];
    walk.z = walk.lo[2];
    walk.next = walk.end = 0;
    walk.large = 0;
    return walk;
}

/* The next springl, or -1 at the end. */
SPRINGLS__FN int springls__cell_walk_next(springls__cell_walk *walk)
{
    while (walk->next == walk->end) {
        const springls__grid *g = walk->g;
        const uint32_t *cell;
        int last;
        if (walk->z > walk->hi[2]) {
            return walk->large < walk->cells->large_count ? (int)walk->cells->large[walk->large++] : -1;
        }
        last = springls__imin(walk->x | 7, walk->hi[0]);
        cell = g->cell + (size_t)springls__slot_at(g, walk->x, walk->y, walk->z) * SPRINGLS__CELLS;
        walk->next = cell[springls__cell_in_brick(walk->x, walk->y, walk->z)];
        walk->end = cell[springls__cell_in_brick(last, walk->y, walk->z) + 1];
        walk->x = last + 1;
        if (walk->x > walk->hi[0]) {
            walk->x = walk->lo[0];
            walk->y += SPRINGLS__CELL;
            if (walk->y > walk->hi[1]) {
                walk->y = walk->lo[1];
                walk->z += SPRINGLS__CELL;
            }
        }
    }
    return (int)walk->cells->ids[walk->next++];
}

/* All springls whose particle may lie within r of x, and some more. */
SPRINGLS__FN springls__cell_walk springls__cell_walk_near(const springls_context *ctx, springls__v3 x, float r)
{
    return springls__cell_walk_begin(ctx, springls__v3_make(x.x - r, x.y - r, x.z - r), springls__v3_make(x.x + r, x.y + r, x.z + r));
}

/* All springls of which some point may lie within `radius` of the box. */
SPRINGLS__FN springls__cell_walk springls__cell_walk_around(const springls_context *ctx, springls__v3 lower, springls__v3 upper,
                                                            float radius)
{
    float r = radius + ctx->cells.reach;
    return springls__cell_walk_begin(ctx, springls__v3_make(lower.x - r, lower.y - r, lower.z - r),
                                     springls__v3_make(upper.x + r, upper.y + r, upper.z + r));
}
