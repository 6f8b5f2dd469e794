/* neighbors.h - the nearest edges of every springl vertex (section 4.8): at most max_neighbors springls within R, the
   closest edge of each, nearest first, ties by index. */

enum { SPRINGLS__NEIGHBOR_ROW = 3 * SPRINGLS__MAX_NEIGHBORS };

/* Inserts (d2, code) into an ascending list of at most `room`; returns the new length. */
SPRINGLS__FN int springls__insert_nearest(float *d2s, int *codes, int length, int room, float d2, int code)
{
    int i = length < room ? length : room - 1;
    if (length == room && (d2s[i] < d2 || (d2s[i] == d2 && codes[i] < code))) return length;
    for (; i > 0 && (d2s[i - 1] > d2 || (d2s[i - 1] == d2 && codes[i - 1] > code)); i--) {
        d2s[i] = d2s[i - 1];
        codes[i] = codes[i - 1];
    }
    d2s[i] = d2;
    codes[i] = code;
    return length < room ? length + 1 : room;
}

/* row[MAX_NEIGHBORS m + k]: 3 * springl + edge of the k-th nearest neighbour of vertex m; -1 after the last. */
SPRINGLS__FN void springls__find_neighbors(const springls_context *ctx, int n, int *row)
{
    const springls__springl *all = ctx->set.s, *self = &all[n];
    const float radius = ctx->params.neighbor_radius, radius2 = radius * radius;
    const int room = ctx->params.max_neighbors;
    springls__v3 lower, upper, normal = springls__springl_normal(self);
    springls__cell_walk walk;
    float d2s[SPRINGLS__NEIGHBOR_ROW], d2[3];
    int length[3] = { 0, 0, 0 }, edge[3], other, m;
    for (m = 0; m < SPRINGLS__NEIGHBOR_ROW; m++) row[m] = -1;
    lower.x = springls__min(self->q[0].x, springls__min(self->q[1].x, self->q[2].x));
    lower.y = springls__min(self->q[0].y, springls__min(self->q[1].y, self->q[2].y));
    lower.z = springls__min(self->q[0].z, springls__min(self->q[1].z, self->q[2].z));
    upper.x = springls__max(self->q[0].x, springls__max(self->q[1].x, self->q[2].x));
    upper.y = springls__max(self->q[0].y, springls__max(self->q[1].y, self->q[2].y));
    upper.z = springls__max(self->q[0].z, springls__max(self->q[1].z, self->q[2].z));
    walk = springls__cell_walk_around(ctx, lower, upper, radius);
    while ((other = springls__cell_walk_next(&walk)) >= 0) {
        const springls__springl *o = &all[other];
        float within = radius + o->reach + self->reach;
        if (other == n) continue;
        if (springls__length2(springls__sub(o->p, self->p)) > within * within) continue;
        within = radius + o->reach;
        if (springls__length2(springls__sub(o->p, self->q[0])) > within * within && springls__length2(springls__sub(o->p, self->q[1])) > within * within
            && springls__length2(springls__sub(o->p, self->q[2])) > within * within) continue;
        if (ctx->params.relax_same_side && springls__dot(normal, springls__springl_normal(o)) <= 0.0f) continue;
        springls__nearest_edges(o, self->q, radius2, d2, edge);
        for (m = 0; m < 3; m++)
            if (edge[m] >= 0)
                length[m] = springls__insert_nearest(d2s + SPRINGLS__MAX_NEIGHBORS * m, row + SPRINGLS__MAX_NEIGHBORS * m, length[m], room,
                                                     d2[m], 3 * other + edge[m]);
    }
}

SPRINGLS__FN void springls__neighbors_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    int *rows = (int *)ctx->neighbors.data;
    for (; begin < end; begin++) springls__find_neighbors(ctx, begin, rows + (size_t)begin * SPRINGLS__NEIGHBOR_ROW);
}

/* Neighbours move together, so the lists serve until the next resampling (section 4.3.1 keeps them during a relaxation
   for the same reason); the closest points slide along their edges meanwhile. */
SPRINGLS__FN springls_status springls__neighbors_build(springls_context *ctx)
{
    if (ctx->neighbors_age >= 0 && ctx->neighbors_age <= ctx->params.resample_period) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__cells_build(ctx));
    SPRINGLS__TRY(springls__grow(ctx, &ctx->neighbors, (size_t)ctx->set.count + 1, SPRINGLS__NEIGHBOR_ROW * sizeof(int), 0));
    springls__parallel(ctx, ctx->set.count, 64, springls__neighbors_task, ctx);
    ctx->neighbors_age = 0;
    return SPRINGLS_OK;
}
