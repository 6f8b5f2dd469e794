/* project.h - phi near the springls becomes their oriented distance, which takes the chord error of flat triangles and the lag
   of the moving front out of the level set. With params.predict phi is first carried along: the value at a voxel is that
   of the place it has come from, by the way of the springls around. Else eq. 23 has decided the side before. */

/* Springls in the order of the cells, then the large ones: what a brick reads of them lies side by side. */
typedef struct springls__project_job {
    springls_context *ctx;
    springls__oriented *oriented;
    int in_cells, count;
    float most_moved; /* the longest way of any springl */
    bool carry;
    uint8_t *in_doubt; /* bricks with doubtful voxels */
} springls__project_job;

SPRINGLS__FN void springls__oriented_task(void *arg, int begin, int end)
{
    const springls__project_job *job = (const springls__project_job *)arg;
    const springls_context *ctx = job->ctx;
    for (; begin < end; begin++) {
        uint32_t i = begin < job->in_cells ? ctx->cells.ids[begin] : ctx->cells.large[begin - job->in_cells];
        springls__oriented *o = &job->oriented[begin];
        o->p = ctx->set.s[i].p;
        o->n = springls__springl_normal(&ctx->set.s[i]);
        o->moved = springls__sub(o->p, ctx->set.was[i]);
        o->edge = springls__at_edge(ctx, (int)i);
    }
}

/* Ranges of `oriented` that may come near a brick: the cells of the brick and one around it, rows along x, and the large. */
enum { SPRINGLS__NEAR_RANGES = 6 * 6 * 3 + 1 };

typedef struct springls__near_ranges { int first[SPRINGLS__NEAR_RANGES], end[SPRINGLS__NEAR_RANGES], count; } springls__near_ranges;

SPRINGLS__FN void springls__near_ranges_add(springls__near_ranges *near_by, int first, int end)
{
    if (first == end) return;
    near_by->first[near_by->count] = first;
    near_by->end[near_by->count++] = end;
}

SPRINGLS__FN springls__near_ranges springls__near_brick(const springls__project_job *job, const int origin[3])
{
    const springls__grid *g = &job->ctx->grid;
    springls__near_ranges near_by;
    int x, y, z;
    near_by.count = 0;
    for (z = -SPRINGLS__CELL; z < 8 + SPRINGLS__CELL; z += SPRINGLS__CELL)
        for (y = -SPRINGLS__CELL; y < 8 + SPRINGLS__CELL; y += SPRINGLS__CELL)
            for (x = -8; x <= 8; x += 8) {
                int bx = origin[0] + x, by = origin[1] + y, bz = origin[2] + z, first, last;
                const uint32_t *cell;
                if (bx < 0 || by < 0 || bz < 0 || bx >= 8 * g->bricks[0] || by >= 8 * g->bricks[1] || bz >= 8 * g->bricks[2]) continue;
                cell = g->cell + (size_t)springls__slot_at(g, bx, by, bz) * SPRINGLS__CELLS;
                first = springls__cell_in_brick(x < 0 ? 8 - SPRINGLS__CELL : 0, by, bz);
                last = springls__cell_in_brick(x > 0 ? 0 : 8 - SPRINGLS__CELL, by, bz);
                springls__near_ranges_add(&near_by, (int)cell[first], (int)cell[last + 1]);
            }
    springls__near_ranges_add(&near_by, job->in_cells, job->count);
    return near_by;
}

/* Does a place in a brick's own voxels come near one of them, along one axis? */
SPRINGLS__FN bool springls__near_axis(float x) { return x > -SPRINGLS__PROJECT_RADIUS && x < 7.0f + SPRINGLS__PROJECT_RADIUS; }

/* The first and the last of them that it comes near. */
SPRINGLS__FN int springls__first_near(float x) { return (int)springls__max(x - (SPRINGLS__PROJECT_RADIUS - 1.0f), 0.0f); }
SPRINGLS__FN int springls__last_near(float x) { return (int)springls__min(x + SPRINGLS__PROJECT_RADIUS, 7.0f); }

typedef void (*springls__row_fn)(const springls__oriented *s, springls__v3 offset, springls__brick_sums *sums, int row);

/* Runs over the rows of a brick that a springl reaches. */
SPRINGLS__FN void springls__reached_rows(const springls__oriented *s, const int origin[3], springls__row_fn run, springls__brick_sums *sums)
{
    springls__v3 p = springls__v3_make(s->p.x - (float)origin[0], s->p.y - (float)origin[1], s->p.z - (float)origin[2]), offset;
    int y0, y1, z0, z1, y, z;
    if (!springls__near_axis(p.x) || !springls__near_axis(p.y) || !springls__near_axis(p.z)) return;
    y0 = springls__first_near(p.y);
    y1 = springls__last_near(p.y);
    z0 = springls__first_near(p.z);
    z1 = springls__last_near(p.z);
    offset.x = -p.x;
    for (z = z0; z <= z1; z++) {
        offset.z = (float)z - p.z;
        for (y = y0; y <= y1; y++) {
            offset.y = (float)y - p.y;
            if (offset.y * offset.y + offset.z * offset.z >= SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS) continue;
            run(s, offset, sums, 8 * y + 64 * z);
        }
    }
}

/* The nearest springl of every voxel, then the sums over those that face the same way. */
SPRINGLS__FN void springls__brick_sums_take(const springls__project_job *job, const springls__near_ranges *near_by, const int origin[3],
                                            springls__brick_sums *sums)
{
    int r, k, v;
    for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) sums->nearest2[v] = SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS;
    memset(sums->facing, 0, sizeof sums->facing);
    memset(sums->sum, 0, sizeof sums->sum);
    for (r = 0; r < near_by->count; r++)
        for (k = near_by->first[r]; k < near_by->end[r]; k++) springls__reached_rows(&job->oriented[k], origin, springls__nearest_row, sums);
    for (r = 0; r < near_by->count; r++)
        for (k = near_by->first[r]; k < near_by->end[r]; k++) springls__reached_rows(&job->oriented[k], origin, springls__moments_row, sums);
}

SPRINGLS__FN bool springls__near_edge(const springls__project_job *job, const springls__near_ranges *near_by)
{
    int r, k;
    if (!job->ctx->params.keep_edges || job->ctx->stats.at_edges == 0) return false;
    for (r = 0; r < near_by->count; r++)
        for (k = near_by->first[r]; k < near_by->end[r]; k++)
            if (job->oriented[k].edge) return true;
    return false;
}

/* phi at voxel x by the sides of the crease that springls about it lie at; false where there is none. */
SPRINGLS__FN bool springls__project_at_edge(const springls__project_job *job, const springls__near_ranges *near_by, springls__v3 x, float *phi)
{
    const float radius2 = SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS;
    springls__crowd crowd;
    springls__say say;
    int r, k, edges = 0;
    crowd.count = 0;
    for (r = 0; r < near_by->count; r++)
        for (k = near_by->first[r]; k < near_by->end[r]; k++) {
            const springls__oriented *s = &job->oriented[k];
            float weight = 1.0f - springls__length2(springls__sub(s->p, x)) / radius2;
            if (weight <= 0.0f) continue;
            edges += s->edge;
            springls__join(&crowd, s->p, s->n, s->p, weight * weight, k);
        }
    if (edges == 0) return false;
    say = springls__edge_distance(&crowd, x);
    if (say.weight <= 0.0f) return false;
    *phi = springls__edge_phi(*phi, say.distance);
    return true;
}

/* Is there a springl that faces against the mean normal of the sums at voxel x, and has x behind it too? */
SPRINGLS__FN bool springls__between_sides(const springls__project_job *job, const springls__near_ranges *near_by, springls__v3 x, springls__v3 normal)
{
    int r, k;
    for (r = 0; r < near_by->count; r++)
        for (k = near_by->first[r]; k < near_by->end[r]; k++) {
            const springls__oriented *s = &job->oriented[k];
            springls__v3 d = springls__sub(x, s->p);
            if (springls__length2(d) >= SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS) continue;
            if (springls__dot(s->n, normal) < -0.5f && springls__claims_inside(d, s->n, SPRINGLS__PROJECT_RADIUS, 0.6f)) return true;
        }
    return false;
}

/* A voxel that springls are near: its value carried along, made exact by them, and put back inside where phi has lost a sheet
   thinner than a voxel: both of its sides say that the voxel lies between them. The two sides of a gap both say outside; a
   thread may break. */
SPRINGLS__FN float springls__project_voxel(const springls__project_job *job, const springls__near_ranges *near_by, const springls__wide_tile *tile,
                                           const int origin[3], int v, springls__moments sum, bool at_edge, float phi)
{
    const float width = 1.2f; /* no voxel beyond it is next to the zero level */
    springls__v3 at = springls__v3_make((float)(v & 7), (float)(v >> 3 & 7), (float)(v >> 6));
    springls__v3 x = springls__add(at, springls__v3_make((float)origin[0], (float)origin[1], (float)origin[2]));
    springls__projection f;
    if (job->carry) phi = springls__wide_tile_sample(tile, springls__mad(at, sum.moved, -1.0f / sum.weight));
    if (!job->ctx->params.project_level_set) return phi;
    if (at_edge && springls__fabs(phi) < width && springls__project_at_edge(job, near_by, x, &phi)) return phi;
    f = springls__moments_distance(sum);
    if (job->ctx->params.nucleate && phi >= 0.0f && springls__may_nucleate(f) && springls__between_sides(job, near_by, x, springls__normalize(sum.normal))
        && springls__in_sheet(job->ctx, x, springls__normalize(sum.normal)))
        return f.distance;
    return springls__corrected_phi(phi, f);
}

SPRINGLS__FN void springls__project_task(void *arg, int begin, int end)
{
    const springls__project_job *job = (const springls__project_job *)arg;
    const springls__grid *g = &job->ctx->grid;
    springls__brick_sums sums;
    springls__wide_tile tile;
    springls__near_ranges near_by;
    int v, o[3];
    for (; begin < end; begin++) {
        const float *phi = g->phi + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        bool some, at_edge;
        job->in_doubt[begin] = 0;
        springls__slot_origin(g, g->active[begin], o);
        near_by = springls__near_brick(job, o);
        some = near_by.count > 0;
        at_edge = some && springls__near_edge(job, &near_by);
        if (some) springls__brick_sums_take(job, &near_by, o, &sums);
        if (some && job->carry) springls__load_wide_tile(g, g->phi, o, &tile);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            out[v] = phi[v];
            if (some && sums.sum[SPRINGLS__SUM_WEIGHT][v] > SPRINGLS__HEARD) {
                out[v] = springls__project_voxel(job, &near_by, &tile, o, v, springls__moments_load(&sums, v), at_edge, phi[v]);
            } else if (job->carry && springls__fabs(phi[v]) < job->most_moved) {
                out[v] = springls__doubtful(phi[v], g->far_value);
                job->in_doubt[begin] = 1;
            }
        }
    }
}

/* phi_next to omega, or back: doubtful voxels ask their neighbours. */
typedef struct springls__settle_job {
    const springls__grid *g;
    const uint8_t *in_doubt;
    const float *from;
    float *to;
    float enough;
    bool last;
} springls__settle_job;

SPRINGLS__FN void springls__settle_task(void *arg, int begin, int end)
{
    const springls__settle_job *job = (const springls__settle_job *)arg;
    const springls__grid *g = job->g;
    float tile[SPRINGLS__TILE_VOXELS];
    int y, z, v;
    for (; begin < end; begin++) {
        float *out = job->to + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        if (!job->in_doubt[begin]) {
            memcpy(out, job->from + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS, SPRINGLS__BRICK_VOXELS * sizeof *out);
            continue;
        }
        springls__load_tile(g, job->from, g->active[begin], tile);
        for (z = 0; z < 8; z++)
            for (y = 0; y < 8; y++) springls__settle_row(tile + springls__tile_index(0, y, z), g->far_value, job->enough, out + 8 * y + 64 * z);
        if (!job->last) continue;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) out[v] = springls__undoubted(out[v], g->far_value);
    }
}

/* The flood needs a third field: omega lends its memory, which is taken afresh when it is next asked for. */
SPRINGLS__FN void springls__settle(springls_context *ctx, const uint8_t *in_doubt)
{
    const int voxels = 3; /* from what a springl reaches to what it may have passed; it goes no further than far_value */
    const float sure = 0.5f; /* first those speak that are not next to the surface themselves */
    springls__grid *g = &ctx->grid;
    springls__settle_job job;
    int i, some = 0;
    for (i = 0; i < g->active_count; i++) some += in_doubt[i];
    if (some == 0) return;
    springls__fill(g->omega, SPRINGLS__OUTSIDE, g->far_value);
    springls__fill(g->omega, SPRINGLS__INSIDE, -g->far_value);
    for (i = 0; i < voxels; i++) {
        job.g = g;
        job.in_doubt = in_doubt;
        job.from = g->phi_next;
        job.to = g->omega;
        job.last = i == voxels - 1;
        job.enough = job.last ? 0.0f : sure;
        springls__parallel(ctx, g->active_count, 8, springls__settle_task, &job);
        springls__swap_fields(&g->phi_next, &g->next_memory, &g->omega, &g->omega_memory);
    }
    springls__fill(g->omega, SPRINGLS__OUTSIDE, ctx->params.capture);
    springls__fill(g->omega, SPRINGLS__INSIDE, ctx->params.capture);
    ctx->omega_fresh = false;
}

/* Single voxels of the other side go, but those that a thin sheet has inside. */
SPRINGLS__FN void springls__specks_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    const springls__grid *g = &ctx->grid;
    float tile[SPRINGLS__TILE_VOXELS];
    int x, y, z, o[3];
    for (; begin < end; begin++) {
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        springls__slot_origin(g, g->active[begin], o);
        springls__load_tile(g, g->phi, g->active[begin], tile);
        for (z = 0; z < 8; z++)
            for (y = 0; y < 8; y++) {
                const float *phi = tile + springls__tile_index(0, y, z);
                float *row = out + 8 * y + 64 * z;
                if (!springls__specks_row(phi, row) || !ctx->params.nucleate) continue;
                for (x = 0; x < 8; x++) {
                    springls__v3 at = springls__v3_make((float)(o[0] + x), (float)(o[1] + y), (float)(o[2] + z));
                    int i = phi[x] < 0.0f && row[x] >= 0.0f ? springls__nearest_springl(ctx, at, SPRINGLS__PROJECT_RADIUS) : -1;
                    if (i >= 0 && springls__in_sheet(ctx, at, springls__springl_normal(&ctx->set.s[i]))) row[x] = phi[x];
                }
            }
    }
}

SPRINGLS__FN springls_status springls__project(springls_context *ctx, bool carry)
{
    springls__project_job job;
    SPRINGLS__TRY(springls__cells_cover_around(ctx));
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)ctx->grid.active_count, 1, (void **)&job.in_doubt));
    SPRINGLS__TRY(springls__scratch(ctx, 0, (size_t)ctx->set.count, sizeof *job.oriented, (void **)&job.oriented));
    job.ctx = ctx;
    job.count = ctx->set.count;
    job.in_cells = job.count - ctx->cells.large_count;
    job.carry = carry;
    springls__parallel(ctx, job.count, 256, springls__oriented_task, &job);
    job.most_moved = springls__way_since_phi(ctx);
    springls__parallel(ctx, ctx->grid.active_count, 4, springls__project_task, &job);
    if (carry) {
        springls__settle(ctx, job.in_doubt);
        springls__phi_in_step(ctx);
    }
    springls__commit_phi(ctx, carry ? 1 + (int)springls__min(job.most_moved, ctx->grid.far_value) : 1);
    if (carry && ctx->params.topology == SPRINGLS_TOPOLOGY_FREE) {
        springls__parallel(ctx, ctx->grid.active_count, 8, springls__specks_task, ctx);
        springls__swap_phi(&ctx->grid);
    }
    springls__redistance_sweeps(ctx, 2);
    return carry ? springls__band_move(ctx) : SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__carry_level_set(springls_context *ctx) { return springls__project(ctx, true); }
SPRINGLS__FN springls_status springls__project_level_set(springls_context *ctx) { return springls__project(ctx, false); }
