/* constellation.h - the arrays of springls: room, finishing touches, stable compaction. */

/* Fills what follows from q and p. */
SPRINGLS__FN void springls__springl_finish(springls__springl *s)
{
    float reach2 = 0.0f;
    int m;
    for (m = 0; m < 3; m++) {
        s->inverse_edge2[m] = springls__inverse_length2(s->q[m], s->q[m == 2 ? 0 : m + 1]);
        reach2 = springls__max(reach2, springls__length2(springls__sub(s->q[m], s->p)));
    }
    s->reach = springls__sqrt(reach2);
}

SPRINGLS__FN springls__tri springls__springl_tri(const springls__springl *s)
{
    springls__tri t;
    t.a = s->q[0]; t.b = s->q[1]; t.c = s->q[2];
    return t;
}

SPRINGLS__FN springls__v3 springls__springl_normal(const springls__springl *s)
{
    return springls__tri_normal(springls__springl_tri(s));
}

/* Room for count springls, keeping those that are there. */
SPRINGLS__FN springls_status springls__constellation_reserve(springls_context *ctx, int count)
{
    springls__constellation *set = &ctx->set;
    size_t n = (size_t)count, kept = (size_t)set->count;
    SPRINGLS__TRY(springls__grow(ctx, &set->s_memory, n, sizeof *set->s, kept * sizeof *set->s));
    set->s = (springls__springl *)set->s_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &set->a_memory, n, sizeof *set->a, kept * sizeof *set->a));
    set->a = (springls__v3 *)set->a_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &set->id_memory, n, sizeof *set->id, kept * sizeof *set->id));
    set->id = (uint32_t *)set->id_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &set->generation_memory, n, sizeof *set->generation, kept * sizeof *set->generation));
    set->generation = (uint32_t *)set->generation_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &set->mask_memory, n, sizeof *set->mask, kept * sizeof *set->mask));
    set->mask = (uint8_t *)set->mask_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &set->part_memory, n, sizeof *set->part, kept * sizeof *set->part));
    set->part = (int32_t *)set->part_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &set->edge_memory, n, sizeof *set->edge, kept * sizeof *set->edge));
    set->edge = (uint8_t *)set->edge_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &set->phi_memory, n, sizeof *set->phi, kept * sizeof *set->phi));
    set->phi = (float *)set->phi_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &set->was_memory, n, sizeof *set->was, kept * sizeof *set->was));
    set->was = (springls__v3 *)set->was_memory.data;
    return SPRINGLS_OK;
}

/* Appends one springl with a fresh id; room must have been reserved. */
SPRINGLS__FN int springls__constellation_append(springls_context *ctx, const springls__springl *s, springls__v3 a,
                                                uint32_t generation, uint8_t mask)
{
    springls__constellation *set = &ctx->set;
    int i = set->count++;
    SPRINGLS_ASSERT((size_t)i < set->was_memory.bytes / sizeof *set->was); /* the last array to be grown */
    set->s[i] = *s;
    springls__springl_finish(&set->s[i]);
    set->a[i] = a;
    set->id[i] = set->next_id++;
    set->generation[i] = generation;
    set->mask[i] = mask;
    set->part[i] = -1;
    set->edge[i] = 0;
    set->phi[i] = 0.0f;
    set->was[i] = s->p;
    return i;
}

/* Drops every springl with keep[i] == 0; the others stay in order. Returns how many went. */
SPRINGLS__FN int springls__constellation_compact(springls_context *ctx, const uint8_t *keep)
{
    springls__constellation *set = &ctx->set;
    int i, n = 0, count = set->count;
    for (i = 0; i < count; i++) {
        if (!keep[i]) continue;
        if (n != i) {
            set->s[n] = set->s[i];
            set->a[n] = set->a[i];
            set->id[n] = set->id[i];
            set->generation[n] = set->generation[i];
            set->mask[n] = set->mask[i];
            set->part[n] = set->part[i];
            set->edge[n] = set->edge[i];
            set->phi[n] = set->phi[i];
            set->was[n] = set->was[i];
        }
        n++;
    }
    set->count = n;
    return count - n;
}

/* Does springl i lie at a sharp edge that is to be kept? */
SPRINGLS__FN bool springls__at_edge(const springls_context *ctx, int i) { return ctx->params.keep_edges && ctx->set.edge[i]; }

/* To be called when the level set has been made to follow the springls: what moves them from now on, predict will carry. */
SPRINGLS__FN void springls__phi_in_step(springls_context *ctx)
{
    int i;
    for (i = 0; i < ctx->set.count; i++) ctx->set.was[i] = ctx->set.s[i].p;
}

/* The longest way of any particle since then, voxels. */
SPRINGLS__FN float springls__way_since_phi(const springls_context *ctx)
{
    float way2 = 0.0f;
    int i;
    for (i = 0; i < ctx->set.count; i++) way2 = springls__max(way2, springls__length2(springls__sub(ctx->set.s[i].p, ctx->set.was[i])));
    return springls__sqrt(way2);
}

/* To be called after anything that moves springls. */
SPRINGLS__FN void springls__constellation_moved(springls_context *ctx)
{
    ctx->cells_fresh = false;
    ctx->omega_fresh = false;
    ctx->model_fresh = false;
}

/* To be called after anything that adds, removes or replaces springls. */
SPRINGLS__FN void springls__constellation_changed(springls_context *ctx)
{
    springls__constellation_moved(ctx);
    ctx->neighbors_age = -1;
}

SPRINGLS__FN void springls__constellation_free(springls_context *ctx)
{
    springls__constellation *set = &ctx->set;
    springls__buffer_free(ctx, &set->s_memory);
    springls__buffer_free(ctx, &set->a_memory);
    springls__buffer_free(ctx, &set->id_memory);
    springls__buffer_free(ctx, &set->generation_memory);
    springls__buffer_free(ctx, &set->mask_memory);
    springls__buffer_free(ctx, &set->part_memory);
    springls__buffer_free(ctx, &set->edge_memory);
    springls__buffer_free(ctx, &set->phi_memory);
    springls__buffer_free(ctx, &set->was_memory);
    memset(set, 0, sizeof *set);
}
