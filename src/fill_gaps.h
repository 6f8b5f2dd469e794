/* fill_gaps.h - springls for exposed zero crossings of the signed level set (section 4.4). */

/* Marching cubes of an active brick: cells from -1 where the brick is at the lower border of the domain, so that the
   closing surface half a voxel outside is met too. */
typedef struct springls__cube_range { int lo[3], hi[3], origin[3]; } springls__cube_range;

SPRINGLS__FN springls__cube_range springls__brick_cubes(const springls__grid *g, int slot)
{
    springls__cube_range range;
    int axis;
    springls__slot_origin(g, slot, range.origin);
    for (axis = 0; axis < 3; axis++) {
        range.lo[axis] = range.origin[axis] == 0 ? -1 : 0;
        range.hi[axis] = springls__imin(7, g->size[axis] - 1 - range.origin[axis]);
    }
    return range;
}

SPRINGLS__FN springls__mc_cell springls__tile_cube(const float *tile, int x, int y, int z)
{
    springls__mc_cell cell;
    int c;
    for (c = 0; c < 8; c++) cell.phi[c] = tile[springls__tile_index(x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2))];
    return cell;
}

SPRINGLS__FN springls__v3 springls__cube_vertex(const springls__cube_range *range, springls__mc_cell cell, int x, int y, int z, int edge)
{
    return springls__mc_point(range->origin[0] + x, range->origin[1] + y, range->origin[2] + z, edge, springls__mc_edge_crossing(cell, edge));
}

SPRINGLS__FN springls__tri springls__cube_triangle(const springls__cube_range *range, springls__mc_cell cell, int mask, int x, int y, int z, int triangle)
{
    springls__tri t;
    t.a = springls__cube_vertex(range, cell, x, y, z, springls__mc_edge(mask, triangle, 0));
    t.b = springls__cube_vertex(range, cell, x, y, z, springls__mc_edge(mask, triangle, 1));
    t.c = springls__cube_vertex(range, cell, x, y, z, springls__mc_edge(mask, triangle, 2));
    return t;
}

/* True when a place x of the zero level, facing n, is bare: no springl comes within `covered`. Beside thin sheets the zero level
   is no guide, as it comes and goes with the voxels inside: there none must come within `on_sheets`. */
SPRINGLS__FN bool springls__is_exposed(const springls_context *ctx, springls__v3 x, springls__v3 n, float covered, float on_sheets)
{
    const float r = springls__max(on_sheets, covered);
    springls__cell_walk walk = springls__cell_walk_around(ctx, x, x, r);
    float nearest2 = FLT_MAX;
    bool sheet = false;
    int i;
    while ((i = springls__cell_walk_next(&walk)) >= 0) {
        const springls__springl *s = &ctx->set.s[i];
        float reach = r + s->reach;
        if (springls__length2(springls__sub(s->p, x)) > reach * reach) continue;
        nearest2 = springls__min(nearest2, springls__tri_distance2(springls__tri_plan_make(springls__springl_tri(s)), x));
        if (nearest2 <= covered * covered) return false;
        sheet = sheet || springls__dot(springls__springl_normal(s), n) < -0.5f;
    }
    return sheet ? nearest2 > r * r : nearest2 > covered * covered;
}

enum { SPRINGLS__CUBES = 9 * 9 * 9 };

typedef struct springls__exposure_job { springls_context *ctx; uint8_t *exposed; int *count; float covered, on_sheets; } springls__exposure_job;

/* One bit a triangle in exposed[CUBES * brick + cube]. */
SPRINGLS__FN void springls__exposure_task(void *arg, int begin, int end)
{
    const springls__exposure_job *job = (const springls__exposure_job *)arg;
    const springls__grid *g = &job->ctx->grid;
    float tile[SPRINGLS__TILE_VOXELS];
    int x, y, z, k;
    for (; begin < end; begin++) {
        uint8_t *exposed = job->exposed + (size_t)begin * SPRINGLS__CUBES;
        springls__cube_range range = springls__brick_cubes(g, g->active[begin]);
        springls__load_tile(g, g->phi, g->active[begin], tile);
        memset(exposed, 0, SPRINGLS__CUBES);
        job->count[begin] = 0;
        for (z = range.lo[2]; z <= range.hi[2]; z++)
            for (y = range.lo[1]; y <= range.hi[1]; y++)
                for (x = range.lo[0]; x <= range.hi[0]; x++) {
                    springls__mc_cell cell = springls__tile_cube(tile, x, y, z);
                    int mask = springls__mc_case(cell);
                    for (k = 0; k < springls__mc_count(mask); k++) {
                        springls__tri t = springls__cube_triangle(&range, cell, mask, x, y, z, k);
                        springls__v3 at = springls__tri_centroid(t), n = springls__tri_normal(t);
                        if (!springls__is_exposed(job->ctx, at, n, job->covered, job->on_sheets)) continue;
                        exposed[x + 1 + 9 * (y + 1 + 9 * (z + 1))] |= (uint8_t)(1 << k);
                        job->count[begin]++;
                    }
                }
    }
}

/* Appends the exposed triangles of one brick as springls that belong where they are. */
SPRINGLS__FN void springls__fill_brick(springls_context *ctx, int index, const uint8_t *exposed, int *room)
{
    const springls__grid *g = &ctx->grid;
    springls__cube_range range = springls__brick_cubes(g, g->active[index]);
    float tile[SPRINGLS__TILE_VOXELS];
    int cube, k;
    springls__load_tile(g, g->phi, g->active[index], tile);
    for (cube = 0; cube < SPRINGLS__CUBES; cube++) {
        int x = cube % 9 - 1, y = cube / 9 % 9 - 1, z = cube / 81 - 1, mask;
        springls__mc_cell cell;
        if (!exposed[cube]) continue;
        cell = springls__tile_cube(tile, x, y, z);
        mask = springls__mc_case(cell);
        for (k = 0; k < 8; k++) {
            springls__springl s;
            springls__tri t;
            if (!(exposed[cube] >> k & 1)) continue;
            if (*room == 0) {
                ctx->stats.refused++;
                continue;
            }
            t = springls__cube_triangle(&range, cell, mask, x, y, z, k);
            s.q[0] = t.a;
            s.q[1] = t.b;
            s.q[2] = t.c;
            s.p = springls__tri_centroid(t);
            springls__constellation_append(ctx, &s, s.p, 1, 0);
            (*room)--;
        }
    }
}

typedef struct springls__adopt_job { springls_context *ctx; int first; } springls__adopt_job;

/* Correspondence, and with the quadratic rule the place, of the springls from `first` on. */
SPRINGLS__FN void springls__adopt_task(void *arg, int begin, int end)
{
    const springls__adopt_job *job = (const springls__adopt_job *)arg;
    springls_context *ctx = job->ctx;
    for (; begin < end; begin++) {
        int i = job->first + begin, m;
        springls__springl *s = &ctx->set.s[i];
        springls__v3 a = springls__adopt_correspondence(ctx, s, job->first);
        if (ctx->params.placement == SPRINGLS_PLACE_QUADRATIC) {
            springls__fit_result fit = springls__fit_at(ctx, s->p, springls__springl_normal(s), a, job->first);
            if (fit.ok) {
                for (m = 0; m < 3; m++) s->q[m] = springls__add(s->q[m], springls__sub(fit.point, s->p));
                s->p = fit.point;
                a = fit.a;
            }
        }
        ctx->set.a[i] = springls__project_on_original(ctx, a);
        ctx->set.was[i] = s->p; /* it has been placed, not moved */
    }
}

/* Springls for the bare triangles of the zero level: see springls__is_exposed. */
SPRINGLS__FN springls_status springls__fill_from_level_set(springls_context *ctx, float covered, float on_sheets)
{
    springls__exposure_job job;
    int i, total = 0, room, bricks;
    SPRINGLS__TRY(springls__cells_build(ctx));
    bricks = ctx->grid.active_count;
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)bricks, SPRINGLS__CUBES, (void **)&job.exposed));
    SPRINGLS__TRY(springls__scratch(ctx, 2, (size_t)bricks, sizeof(int), (void **)&job.count));
    job.ctx = ctx;
    job.covered = covered;
    job.on_sheets = on_sheets;
    springls__parallel(ctx, bricks, 4, springls__exposure_task, &job);
    for (i = 0; i < bricks; i++) total += job.count[i];
    room = springls__imin(total, springls__imax(ctx->desc.max_springls - ctx->set.count, 0));
    SPRINGLS__TRY(springls__constellation_reserve(ctx, ctx->set.count + room));
    for (i = 0; i < bricks; i++)
        if (job.count[i]) springls__fill_brick(ctx, i, job.exposed + (size_t)i * SPRINGLS__CUBES, &room);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__fill_gaps(springls_context *ctx)
{
    const float covered = 0.75f, on_sheets = 1.5f; /* what springls have left bare is filled more sparingly */
    const float d_max = ctx->params.d_max;
    const bool springls_first = ctx->params.fill_from_springls != 0;
    springls__adopt_job adopt;
    double started;
    if (springls_first) SPRINGLS__TRY(springls__fill_from_springls(ctx));
    adopt.ctx = ctx;
    adopt.first = ctx->set.count;
    SPRINGLS__TRY(springls_first ? springls__fill_from_level_set(ctx, springls__max(covered, d_max), on_sheets)
                                 : springls__fill_from_level_set(ctx, d_max, d_max));
    if (ctx->set.count == adopt.first) return SPRINGLS_OK;
    started = springls__stage_begin(ctx, SPRINGLS_STAGE_TRACK);
    springls__parallel(ctx, ctx->set.count - adopt.first, 16, springls__adopt_task, &adopt); /* the cells still hold the known ones only */
    springls__stage_end(ctx, SPRINGLS_STAGE_TRACK, started);
    ctx->stats.added += ctx->set.count - adopt.first;
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_fill_gaps(springls_context *ctx)
{
    return springls__staged(ctx, SPRINGLS_STAGE_FILL_GAPS, springls__fill_gaps);
}
