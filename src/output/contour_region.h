/* contour_region.h - where the mesh of what springls hold has to be made again for chunks: around what has changed since it was published.

     springls and voxels of phi that  -->  the bricks that  -->  their table  -->  closed with the bricks around?
     are not as the published ones         they reach                ^                         |
                                                                     `-- one brick more ------ no

   What has changed by less than half the tolerance is as published: so a model that is only relaxed, far less than a voxel, costs nothing.
   A brick that is made again keeps the vertices that have moved by less than the other half.
   A springl's hits lie within 2 voxels of it (springls__disc_of), those of springls that it creases within 5.2. How far a line's sides may
   follow is not bounded: so the new triangles are taken only where their border is that of the triangles which they replace. */
#ifndef SPRINGLS__OUTPUT_CONTOUR_REGION_H
#define SPRINGLS__OUTPUT_CONTOUR_REGION_H

#include "contour_chunks.h"

#define SPRINGLS__REGION_REACH 3.0f        /* voxels, of a springl: where it may change the mesh                                  */
#define SPRINGLS__CREASED_REGION_REACH 6.2f /* of one beside a crease                                                             */
#define SPRINGLS__LARGEST_SLIDE 0.25f      /* voxels along its plane that a springl may move and be as published                  */
#define SPRINGLS__LARGEST_REGION_SHARE 3   /* a region of more than this part of the bricks costs, with its margin, what all would */

/* What a published springl was: flags of springls__seen_flags. */
enum { SPRINGLS__SEEN_OVERLAPPED = 1, SPRINGLS__SEEN_AT_EDGE = 2, SPRINGLS__SEEN_CREASED = 4 };

/* ---- published springls ---- */

SPRINGLS__FN size_t springls__seen_slot(const springls__contour_store *store, uint32_t id)
{
    size_t slot = springls__hash3(id, 0u, 0u) & (store->seen_size - 1);
    while (store->seen_table[slot] >= 0 && store->seen[store->seen_table[slot]].id != id) slot = (slot + 1) & (store->seen_size - 1);
    return slot;
}

/* Returns the number of a published springl by its id, which most often is `likely`; -1: there is none. */
SPRINGLS__FN int springls__find_seen(const springls__contour_store *store, uint32_t id, int likely)
{
    if (likely < store->springls && store->seen[likely].id == id) return likely;
    return store->springls == 0 ? -1 : store->seen_table[springls__seen_slot(store, id)];
}

/* Returns springl i as it is, but whether it is creased. */
SPRINGLS__FN springls__seen_springl springls__see_springl(const springls__model *model, int i)
{
    springls__seen_springl seen;
    seen.p = model->set.s[i].p;
    seen.n = springls__springl_normal(model->set.s[i]);
    seen.id = model->set.id[i];
    seen.flags = (springls__is_overlapped(model, i) ? (uint32_t)SPRINGLS__SEEN_OVERLAPPED : 0u)
               | (springls__at_edge(model, i) ? (uint32_t)SPRINGLS__SEEN_AT_EDGE : 0u);
    return seen;
}

/* Returns whether a springl is as published within a tolerance, voxels: its plane is, and it has not slid far along it. */
SPRINGLS__FN bool springls__is_as_seen(const springls__seen_springl *now, const springls__seen_springl *before, float tolerance)
{
    const springls__v3 d = springls__sub(now->p, before->p);
    return now->flags == (before->flags & ~(uint32_t)SPRINGLS__SEEN_CREASED)
        && springls__fabs(springls__dot(d, now->n)) <= tolerance && springls__fabs(springls__dot(d, before->n)) <= tolerance
        && springls__length2(springls__sub(now->n, before->n)) <= tolerance * tolerance
        && springls__length2(d) <= SPRINGLS__LARGEST_SLIDE * SPRINGLS__LARGEST_SLIDE;
}

/* Returns whether some springls near a place face different ways, so that they may be creased. */
SPRINGLS__FN bool springls__may_be_creased(const springls__model *model, springls__v3 p, springls__v3 n)
{
    springls__cell_walk walk = springls__cell_walk_near(model, p, SPRINGLS__TRIM_RADIUS);
    int i;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0)
        if (springls__fabs(springls__dot(springls__springl_normal(model->set.s[i]), n)) < springls__least_uncreased_cosine()) return true;
    return false;
}

/* Finds which springls are not as published: how far each of those reaches. */
SPRINGLS__FN void springls__find_moved_work(void *arg, int begin, int end, float *memory)
{
    const springls__contour_chunks *c = (const springls__contour_chunks *)arg;
    const springls__contour_store *before = &c->store[c->now];
    const springls__model *model = &c->ctx->model;
    (void)memory;
    for (; begin < end; begin++) {
        const springls__seen_springl now = springls__see_springl(model, begin);
        const int seen = springls__find_seen(before, now.id, begin);
        bool creased;
        c->reach[begin] = 0.0f;
        c->seen_as[begin] = seen;
        if (seen >= 0) c->is_left[seen] = 1;
        if (seen >= 0 && springls__is_as_seen(&now, &before->seen[seen], 0.5f * c->tolerance)) continue;
        creased = (seen >= 0 && (before->seen[seen].flags & SPRINGLS__SEEN_CREASED)) || springls__may_be_creased(model, now.p, now.n);
        c->reach[begin] = creased ? SPRINGLS__CREASED_REGION_REACH : SPRINGLS__REGION_REACH;
    }
}

/* Makes room for what an update has of each springl, of each published one, and of each published brick. */
SPRINGLS__FN springls_status springls__reserve_moved(springls_context *ctx, springls__contour_chunks *c)
{
    const springls__contour_store *before = &c->store[c->now];
    const size_t count = (size_t)ctx->model.set.count + 1;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->reach_memory, count, sizeof *c->reach, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->seen_as_memory, count, sizeof *c->seen_as, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->is_left_memory, (size_t)before->springls + 1, 1, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->moved_phi_memory, (size_t)before->bricks + 1, 1, 0));
    c->reach = (float *)c->reach_memory.data;
    c->seen_as = (int *)c->seen_as_memory.data;
    c->is_left = (uint8_t *)c->is_left_memory.data;
    c->moved_phi = (uint8_t *)c->moved_phi_memory.data;
    return SPRINGLS_OK;
}

/* ---- published phi ---- */

/* Returns the evidence of phi as it is published: up to a voxel from the surface, in 127ths of one. */
SPRINGLS__FN int springls__evidence_of(float phi) { return (int)(springls__clamp(phi, -1.0f, 1.0f) * 127.0f); }

/* Finds the place in the window of a brick of a contour. */
SPRINGLS__FN void springls__place_of_contour_brick(const springls_context *ctx, const springls__contour_brick *brick, int place[3])
{
    int axis;
    for (axis = 0; axis < 3; axis++) place[axis] = brick->at.at[axis] - ctx->window.offset[axis] / SPRINGLS__BRICK;
}

/* Returns the slot of the grid's brick of a contour's: SPRINGLS__OUTSIDE beyond the domain. */
SPRINGLS__FN int springls__slot_of_contour_brick(const springls_context *ctx, const springls__contour_brick *brick)
{
    int place[3];
    springls__place_of_contour_brick(ctx, brick, place);
    return springls__slot_of_brick_place(&ctx->model.grid, place);
}

SPRINGLS__FN const float *springls__phi_of_slot(const springls_context *ctx, int slot)
{
    return ctx->model.grid.phi + (size_t)slot * SPRINGLS__BRICK_VOXELS;
}

/* Finds, as bits, in which eighths of a brick phi is further than `most` from the evidence that is published. */
SPRINGLS__FN uint32_t springls__moved_eighths(const int8_t evidence[SPRINGLS__BRICK_VOXELS], const float *phi, int most)
{
    uint32_t moved = 0;
    int row, k;
    for (row = 0; row < 64; row++) {
        uint32_t half[2] = { 0u, 0u };
        for (k = 0; k < 8; k++)
            half[k >> 2] |= (uint32_t)(springls__evidence_of(phi[8 * row + k]) - evidence[8 * row + k] + most) > 2u * (uint32_t)most;
        moved |= (half[0] | half[1] << 1) << (2 * (row >> 2 & 1) + 4 * (row >> 5));
    }
    return moved;
}

/* Finds in which eighths of published bricks phi is not as published. */
SPRINGLS__FN void springls__find_moved_phi_work(void *arg, int begin, int end, float *memory)
{
    const springls__contour_chunks *c = (const springls__contour_chunks *)arg;
    const int most = springls__imax((int)(0.5f * c->tolerance * 127.0f), 1);
    (void)memory;
    for (; begin < end; begin++) {
        const springls__contour_brick *brick = &c->store[c->now].brick[begin];
        const int slot = springls__slot_of_contour_brick(c->ctx, brick);
        const bool same = slot < SPRINGLS__FIRST_SLOT && slot == brick->constant;
        c->moved_phi[begin] = (uint8_t)(same ? 0u : springls__moved_eighths(brick->evidence, springls__phi_of_slot(c->ctx, slot), most));
    }
}

/* ---- the region ---- */

/* Makes room for `more` keys of the region. */
SPRINGLS__FN springls_status springls__reserve_region(springls_context *ctx, springls__contour_chunks *c, size_t more)
{
    const size_t bricks = (size_t)c->region_bricks;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->region_memory, bricks + more + 1, sizeof *c->region, bricks * sizeof *c->region));
    c->region = (uint64_t *)c->region_memory.data;
    return SPRINGLS_OK;
}

/* Adds the bricks from `lower` to `upper` to the region: the table has none before the last one beyond the border. Neighboring springls
   often have the same box. */
SPRINGLS__FN void springls__add_box_to_region(springls__contour_chunks *c, const int lower[3], const int upper[3])
{
    const int box[6] = { lower[0], lower[1], lower[2], upper[0], upper[1], upper[2] };
    int at[3];
    if (c->region_bricks > 0 && memcmp(box, c->last_box, sizeof box) == 0) return;
    memcpy(c->last_box, box, sizeof box);
    for (at[2] = springls__imax(lower[2], -1); at[2] <= upper[2]; at[2]++)
        for (at[1] = springls__imax(lower[1], -1); at[1] <= upper[1]; at[1]++)
            for (at[0] = springls__imax(lower[0], -1); at[0] <= upper[0]; at[0]++) c->region[c->region_bricks++] = springls__place_key(at);
}

/* Finds the bricks within reach of a place, in each direction two at most, or three where the reach is over half a brick. */
SPRINGLS__FN void springls__box_of_bricks_within(springls__v3 p, float reach, int lower[3], int upper[3])
{
    int axis;
    for (axis = 0; axis < 3; axis++) {
        lower[axis] = (int)springls__floor((springls__along(p, axis) - reach) * 0.125f);
        upper[axis] = (int)springls__floor((springls__along(p, axis) + reach) * 0.125f);
    }
}

SPRINGLS__FN void springls__add_place_to_region(springls__contour_chunks *c, springls__v3 p, float reach)
{
    int lower[3], upper[3];
    springls__box_of_bricks_within(p, reach, lower, upper);
    springls__add_box_to_region(c, lower, upper);
}

/* Adds the bricks within four voxels of eighths of a brick. */
SPRINGLS__FN void springls__add_eighths_to_region(springls__contour_chunks *c, const int place[3], uint32_t eighths)
{
    int k, axis, lower[3], upper[3];
    for (k = 0; k < 8; k++) {
        if (!(eighths >> k & 1u)) continue;
        for (axis = 0; axis < 3; axis++) {
            lower[axis] = place[axis] - (k >> axis & 1 ? 0 : 1);
            upper[axis] = place[axis] + (k >> axis & 1 ? 1 : 0);
        }
        springls__add_box_to_region(c, lower, upper);
    }
}

/* Sorts the region's keys, each once, and gives the table those of its bricks that the table of all would have, unless there is one. A
   region of many bricks is the whole. */
SPRINGLS__FN springls_status springls__take_region(springls_context *ctx, springls__contour_chunks *c)
{
    int *places, i, axis, n = 0, place[3];
    springls__sort_keys(c->region, (size_t)c->region_bricks);
    for (i = 0; i < c->region_bricks; i++)
        if (n == 0 || c->region[i] != c->region[n - 1]) c->region[n++] = c->region[i];
    c->region_bricks = n;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_REGION, 3 * (size_t)n, sizeof(int)));
    places = (int *)ctx->surface_memory[SPRINGLS__SURFACE_REGION].data;
    for (i = n = 0; i < c->region_bricks; i++) {
        springls__place_of_key(c->region[i], place);
        for (axis = 0; axis < 3; axis++) {
            c->region_lower[axis] = i == 0 ? place[axis] : springls__imin(c->region_lower[axis], place[axis]);
            c->region_upper[axis] = i == 0 ? place[axis] : springls__imax(c->region_upper[axis], place[axis]);
        }
        if (springls__surface_reaches(&ctx->model.grid, place)) memcpy(places + 3 * (size_t)n++, place, sizeof place);
    }
    c->region_in_table = n;
    c->whole = SPRINGLS__LARGEST_REGION_SHARE * n > c->store[c->now].bricks;
    if (!springls__surface_is_stale(ctx)) return SPRINGLS_OK;
    ctx->surface_region = n;
    if (n == 0) springls__forget_surface(ctx);
    return SPRINGLS_OK;
}

/* Collects the bricks that have to be made again: the region. Precondition: what has moved is known. */
SPRINGLS__FN springls_status springls__collect_region(springls_context *ctx, springls__contour_chunks *c)
{
    const springls__contour_store *before = &c->store[c->now];
    const int count = ctx->model.set.count;
    size_t most = 0;
    int i, place[3], moved = 0;
    c->region_bricks = 0;
    for (i = 0; i < count; i++) {
        if (c->reach[i] == 0.0f) continue;
        most += c->reach[i] > SPRINGLS__REGION_REACH ? 54 : 16;
        moved++;
    }
    for (i = 0; i < before->springls; i++) most += c->is_left[i] ? 0 : 27;
    for (i = 0; i < before->bricks; i++) most += c->moved_phi[i] ? 64 : 0;
    c->whole = moved > count / SPRINGLS__LARGEST_REGION_SHARE;
    if (c->whole) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__reserve_region(ctx, c, most));
    for (i = 0; i < count; i++) {
        if (c->reach[i] == 0.0f) continue;
        springls__add_place_to_region(c, ctx->model.set.s[i].p, c->reach[i]);
        if (c->seen_as[i] >= 0) springls__add_place_to_region(c, before->seen[c->seen_as[i]].p, c->reach[i]);
    }
    for (i = 0; i < before->springls; i++) {
        const springls__seen_springl *seen = &before->seen[i];
        if (!c->is_left[i])
            springls__add_place_to_region(c, seen->p, seen->flags & SPRINGLS__SEEN_CREASED ? SPRINGLS__CREASED_REGION_REACH
                                                                                            : SPRINGLS__REGION_REACH);
    }
    for (i = 0; i < before->bricks; i++) {
        springls__place_of_contour_brick(ctx, &before->brick[i], place);
        springls__add_eighths_to_region(c, place, c->moved_phi[i]);
    }
    return springls__take_region(ctx, c);
}

/* Adds all bricks around the region to it. Where the table gets no more bricks from that, it is the whole. */
SPRINGLS__FN springls_status springls__widen_region(springls_context *ctx, springls__contour_chunks *c)
{
    const int bricks = c->region_bricks, in_table = c->region_in_table;
    int i, axis, place[3], lower[3], upper[3];
    SPRINGLS__TRY(springls__reserve_region(ctx, c, 27 * (size_t)bricks));
    for (i = 0; i < bricks; i++) {
        springls__place_of_key(c->region[i], place);
        for (axis = 0; axis < 3; axis++) {
            lower[axis] = place[axis] - 1;
            upper[axis] = place[axis] + 1;
        }
        springls__add_box_to_region(c, lower, upper);
    }
    SPRINGLS__TRY(springls__take_region(ctx, c));
    c->whole = c->whole || c->region_in_table <= in_table;
    return SPRINGLS_OK;
}

/* ---- whether the new triangles fit ---- */

/* Returns whether the new triangles of the region have the border of those that they replace. */
SPRINGLS__FN bool springls__region_fits(const springls__contour_chunks *c)
{
    const springls__contour_store *before = &c->store[c->now], *after = &c->store[1 - c->now];
    uint64_t was = 0, is = 0;
    int i;
    for (i = 0; i < before->bricks; i++)
        if (springls__is_in_region(c, before->window, &before->brick[i])) was += springls__border_of_brick(before, &before->brick[i]);
    for (i = 0; i < after->bricks; i++)
        if (after->brick[i].table >= 0) is += springls__border_of_brick(after, &after->brick[i]);
    return was == is;
}

/* ---- what is published then ---- */

/* Returns whether all bricks within reach of a place are in the region. */
SPRINGLS__FN bool springls__region_surrounds(const springls__contour_chunks *c, springls__v3 p)
{
    int lower[3], upper[3], at[3], axis;
    springls__box_of_bricks_within(p, SPRINGLS__REGION_REACH, lower, upper);
    for (axis = 0; axis < 3; axis++)
        if (lower[axis] < c->region_lower[axis] || upper[axis] > c->region_upper[axis]) return false;
    for (at[2] = lower[2]; at[2] <= upper[2]; at[2]++)
        for (at[1] = lower[1]; at[1] <= upper[1]; at[1]++)
            for (at[0] = lower[0]; at[0] <= upper[0]; at[0]++)
                if (!springls__region_has(c, springls__place_key(at))) return false;
    return true;
}

/* Writes the springls that the new contour was made from: those of before where it is kept, all around or in part. */
SPRINGLS__FN void springls__see_springls_work(void *arg, int begin, int end, float *memory)
{
    const springls__contour_chunks *c = (const springls__contour_chunks *)arg;
    const springls__model *model = &c->ctx->model;
    const springls__surfel *surfel = (const springls__surfel *)c->ctx->surface_memory[SPRINGLS__SURFACE_SURFEL].data;
    springls__seen_springl *after = c->store[1 - c->now].seen;
    (void)memory;
    for (; begin < end; begin++) {
        springls__seen_springl *seen = &after[begin];
        if (!c->whole && c->seen_as[begin] >= 0 && c->reach[begin] == 0.0f && !springls__region_surrounds(c, model->set.s[begin].p)) {
            *seen = c->store[c->now].seen[c->seen_as[begin]];
            continue;
        }
        *seen = springls__see_springl(model, begin);
        if (surfel[begin].creased) seen->flags |= (uint32_t)SPRINGLS__SEEN_CREASED;
    }
}

/* Writes phi of the bricks that are not kept. */
SPRINGLS__FN void springls__see_phi_work(void *arg, int begin, int end, float *memory)
{
    const springls__contour_chunks *c = (const springls__contour_chunks *)arg;
    int v;
    (void)memory;
    for (; begin < end; begin++) {
        springls__contour_brick *brick = &c->store[1 - c->now].brick[begin];
        const int slot = springls__slot_of_contour_brick(c->ctx, brick);
        const float *phi = springls__phi_of_slot(c->ctx, slot);
        if (brick->table < 0) continue;
        brick->constant = slot < SPRINGLS__FIRST_SLOT ? slot : -1;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) brick->evidence[v] = (int8_t)springls__evidence_of(phi[v]);
    }
}

/* Makes room for the springls that the new contour is made from, and for what an update has of each. */
SPRINGLS__FN springls_status springls__reserve_seen(springls_context *ctx, springls__contour_chunks *c)
{
    springls__contour_store *store = &c->store[1 - c->now];
    const int count = ctx->model.set.count;
    store->springls = 0;
    store->seen_size = springls__table_size((size_t)count);
    SPRINGLS__TRY(springls__buffer_grow(ctx, &store->seen_memory, (size_t)count + 1, sizeof *store->seen, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &store->seen_table_memory, store->seen_size, sizeof(int), 0));
    store->seen = (springls__seen_springl *)store->seen_memory.data;
    store->seen_table = (int *)store->seen_table_memory.data;
    return SPRINGLS_OK;
}

/* Lists the springls of the new contour by their ids. */
SPRINGLS__FN void springls__list_seen(springls__contour_chunks *c)
{
    springls__contour_store *store = &c->store[1 - c->now];
    const int count = c->ctx->model.set.count;
    size_t slot;
    for (slot = 0; slot < store->seen_size; slot++) store->seen_table[slot] = -1;
    for (store->springls = 0; store->springls < count; store->springls++)
        store->seen_table[springls__seen_slot(store, store->seen[store->springls].id)] = store->springls;
}

#endif
