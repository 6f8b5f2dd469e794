/* collectives.cl - how a device changes which bricks are active: items flag the bricks to have, then chunks of the top table count and
   scan them. */

/* ---- bricks come and go: those flagged become the active ones (springls__cl_bricks) ---- */

/* Flags the bricks that are active, or none; nothing is counted yet of those that the top table has no room for. */
SPRINGLS__MATHS void springls__bricks_begin_element(const springls__model *model, springls__arguments args, int i)
{
    if (i == 0) model->work.counts[SPRINGLS__COUNT_BRICKS_BEYOND] = 0u;
    model->work.brick_flag[i] = args.brick_flag.keep && model->grid.top[i] >= SPRINGLS__FIRST_SLOT ? 1u : 0u;
}

/* Flags a brick; counts it as beyond when the top table does not have it. */
SPRINGLS__MATHS void springls__mark(const springls__model *model, const int origin[3])
{
    const springls__grid *g = &model->grid;
    int place[3], axis;
    for (axis = 0; axis < 3; axis++) place[axis] = origin[axis] / SPRINGLS__BRICK;
    if (!springls__has_entry(g, place)) SPRINGLS__NEXT(model->work.counts + SPRINGLS__COUNT_BRICKS_BEYOND);
    else atomic_or((volatile __global uint *)(model->work.brick_flag + springls__entry_at(g, origin[0], origin[1], origin[2])), 1u);
}

/* Marks bricks around the one at `origin`. */
SPRINGLS__MATHS void springls__mark_around(const springls__model *model, const int origin[3], uint mask)
{
    int d, at[3];
    for (d = 0; d < 27 && mask; d++)
        if ((mask >> d & 1u) && springls__brick_around(&model->grid, origin, d, at))
            springls__mark(model, at);
}

/* Marks the brick of particle i, which is outside all active ones. */
SPRINGLS__MATHS void springls__mark_outside_element(const springls__model *model, springls__arguments args, int i)
{
    int origin[3];
    (void)args;
    if (model->cells.key[i] != SPRINGLS__OUTSIDE_KEY) return;
    springls__origin_of_place(&model->grid, model->set.s[i].p, origin);
    springls__mark(model, origin);
}

SPRINGLS__MATHS void springls__mark_cover_element(const springls__model *model, springls__arguments args, int i)
{
    int origin[3];
    uint mask = springls__bricks_to_cover(model, i, origin);
    (void)args;
    springls__mark_around(model, origin, mask);
}

/* Marks the bricks that the band of active brick i reaches. */
SPRINGLS__MATHS void springls__mark_band_element(const springls__model *model, springls__arguments args, int i)
{
    int origin[3];
    (void)args;
    springls__slot_origin(&model->grid, model->grid.active[i], origin);
    springls__mark_around(model, origin, springls__band_mask(model)[i]);
}

/* Marks the bricks within the band of springl i. */
SPRINGLS__MATHS void springls__mark_near_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__box box = springls__box_around(model->set.s[i], model->params.band_half_width + 1.0f);
    int lo[3], hi[3], at[3];
    (void)args;
    springls__origin_of_place(&model->grid, box.lower, lo);
    springls__origin_of_place(&model->grid, box.upper, hi);
    for (at[2] = lo[2]; at[2] <= hi[2]; at[2] += SPRINGLS__BRICK)
        for (at[1] = lo[1]; at[1] <= hi[1]; at[1] += SPRINGLS__BRICK)
            for (at[0] = lo[0]; at[0] <= hi[0]; at[0] += SPRINGLS__BRICK) springls__mark(model, at);
}

/* Returns whether a brick beside that of an entry has none. */
SPRINGLS__MATHS bool springls__at_table_end(const springls__grid *g, int entry)
{
    int place[3], axis;
    bool at_end = false;
    springls__entry_origin(g, entry, place);
    for (axis = 0; axis < 3; axis++) {
        place[axis] /= SPRINGLS__BRICK;
        at_end = at_end || !springls__keeps_place(&g->table.groups, axis, springls__imax(place[axis] - 1, 0))
                 || !springls__keeps_place(&g->table.groups, axis, springls__imin(place[axis] + 1, g->bricks[axis] - 1));
    }
    return at_end;
}

/* Counts, in chunk i of the top table, the bricks to drop, those to add and those that are active then: three sums a chunk. Counts
   those to add at an end of the table as beyond it. */
SPRINGLS__MATHS void springls__bricks_count_element(const springls__model *model, springls__arguments args, int i)
{
    uint dropped = 0, added = 0, active = 0;
    int b;
    for (b = springls__chunk_begin(args.chunk, i); b < springls__chunk_end(args.chunk, i); b++) {
        int there = model->grid.top[b] >= SPRINGLS__FIRST_SLOT, wanted = model->work.brick_flag[b] != 0u;
        dropped += there && !wanted ? 1u : 0u;
        added += wanted && !there ? 1u : 0u;
        active += wanted ? 1u : 0u;
        if (wanted && !there && springls__at_table_end(&model->grid, b))
            SPRINGLS__NEXT(model->work.counts + SPRINGLS__COUNT_BRICKS_BEYOND);
    }
    model->work.sums[3 * i] = dropped;
    model->work.sums[3 * i + 1] = added;
    model->work.sums[3 * i + 2] = active;
}

/* Replaces one of the three sums (i) of each chunk by that of the chunks before it; counts the sum of all. */
SPRINGLS__MATHS void springls__bricks_sums_element(const springls__model *model, springls__arguments args, int i)
{
    model->work.counts[SPRINGLS__COUNT_BRICKS + i] = springls__prefix_sums(model->work.sums + i, args.chunk.chunks, 3, 0u);
}

SPRINGLS__MATHS void springls__bricks_drop_element(const springls__model *model, springls__arguments args, int i)
{
    int place = model->grid.free_count + (int)model->work.sums[3 * i], b, slot;
    for (b = springls__chunk_begin(args.chunk, i); b < springls__chunk_end(args.chunk, i); b++) {
        slot = model->grid.top[b];
        if (slot >= SPRINGLS__FIRST_SLOT && !model->work.brick_flag[b]) springls__drop_brick(&model->grid, slot, place++);
    }
}

/* Gives new bricks their slots and lists all that are active now. */
SPRINGLS__MATHS void springls__bricks_add_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__grid *g = &model->grid;
    int n = (int)model->work.sums[3 * i + 1], place = (int)model->work.sums[3 * i + 2], b;
    for (b = springls__chunk_begin(args.brick_add.chunk, i); b < springls__chunk_end(args.brick_add.chunk, i); b++) {
        if (!model->work.brick_flag[b]) continue;
        if (g->top[b] < SPRINGLS__FIRST_SLOT) {
            int slot = springls__slot_of_new(g, args.brick_add.free_count, n);
            model->work.new_slots[n++] = slot;
            springls__add_brick(g, b, slot);
        }
        g->active[place++] = g->top[b];
    }
}

SPRINGLS__MATHS void springls__bricks_fill_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__fill_new_brick(&model->grid, model->work.new_slots[i]);
}
