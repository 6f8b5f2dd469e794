/* restore.h - makes the model that of a snapshot. Everything has been checked and all memory allocated before it changes. */
#ifndef SPRINGLS__OUTPUT_RESTORE_H
#define SPRINGLS__OUTPUT_RESTORE_H

#include "../runtime/memory.h"
#include "../model/bvh.h"
#include "snapshot_check.h"

/* Returns the top table of a grid of a block. section: of its runs of bricks inside. count: of its bricks with voxels. */
SPRINGLS__FN springls__table springls__table_of_block(const springls__grid *g, const springls__layout *layout, int section,
                                                      const char *block, int count)
{
    const char *numbers = block + layout->at[section + 1];
    springls__inside_walk walk = springls__walk_inside(g, layout, block, section);
    springls__brick_groups groups = springls__no_groups();
    int i;
    for (i = 0; i < count; i++) springls__keep_brick(g, &groups, springls__int_at(numbers, (size_t)i));
    while (springls__next_inside(&walk))
        for (i = 0; i < walk.length; i++) springls__keep_brick(g, &groups, walk.first + i);
    return springls__table_of(g, &groups);
}

/* Finds the top tables of a block: the model's and, if there is one, the reference's. */
SPRINGLS__FN void springls__tables_of_block(const springls_context *ctx, const springls__snapshot_state *s,
                                            const springls__layout *layout, const char *block, springls__table tables[2])
{
    const springls__grid *g = &ctx->model.grid;
    tables[0] = springls__table_of_block(g, layout, SPRINGLS__SECTION_INSIDE, block, s->bricks);
    tables[1] = ctx->model.reference.table;
    if (s->kind == SPRINGLS_SNAPSHOT_KIND_ALL)
        tables[1] = springls__table_of_block(g, layout, SPRINGLS__SECTION_REFERENCE_INSIDE, block, s->reference_bricks);
}

/* Grows all memory of the context to what the snapshot needs; the model stays as it is. */
SPRINGLS__FN springls_status springls__snapshot_reserve(springls_context *ctx, const springls__snapshot_state *s,
                                                        const springls__table tables[2])
{
    springls__surface *original = &ctx->original;
    size_t n = (size_t)s->original, kept = (size_t)original->count;
    int i;
    SPRINGLS__TRY(springls__constellation_reserve(ctx, springls__imax(s->springls, ctx->model.set.count)));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_NEIGHBORS, (size_t)s->springls + 1,
                                 ctx->neighbors_uses > 0 ? (size_t)ctx->model.set.count : 0));
    SPRINGLS__TRY(springls__grid_reserve(ctx, springls__imax(SPRINGLS__FIRST_SLOT + s->bricks, ctx->model.grid.slot_count)));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_TOP, springls__entries_of(&tables[0]),
                                 springls__entry_count(&ctx->model.grid)));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_TOP, springls__entries_of(&tables[1]),
                                 springls__entry_count(&ctx->model.reference)));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->component_memory, (size_t)s->components + 1, sizeof(springls__component),
                                        (size_t)ctx->component_count * sizeof(springls__component)));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->event_memory, (size_t)s->events + 1, sizeof(springls_event),
                                        (size_t)ctx->event_count * sizeof(springls_event)));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->event_part_memory, (size_t)s->event_parts + 1, sizeof(springls_component),
                                        (size_t)ctx->event_part_count * sizeof(springls_component)));
    for (i = 0; i < s->attributes; i++) {
        springls__buffer *values = &ctx->attributes[i].values;
        size_t row = (size_t)s->attribute[i].channels * sizeof(float);
        size_t used = (size_t)ctx->model.set.count * (size_t)ctx->attributes[i].channels * sizeof(float);
        if (i >= ctx->attribute_count) used = 0;
        SPRINGLS__TRY(springls__buffer_grow(ctx, values, (size_t)springls__imax(s->springls, 1), row, used));
    }
    if (s->kind == SPRINGLS_SNAPSHOT_KIND_FRAME) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_PHI,
                                 (size_t)(SPRINGLS__FIRST_SLOT + s->reference_bricks),
                                 (size_t)ctx->model.reference.slot_count));
    SPRINGLS__TRY(springls__bvh_reserve(ctx, n));
    SPRINGLS__TRY(springls__surface_room(ctx, original, n + 1, kept));
    SPRINGLS__TRY(springls__joints_room(ctx, original, s->original_tools));
    return springls__buffer_grow(ctx, &original->source_memory, n + 1, sizeof(int), original->source ? kept * sizeof(int) : 0);
}

/* Replaces the bricks of a grid by those of a block, in slots of their order. section: of its runs of bricks inside. */
SPRINGLS__FN void springls__get_grid(springls__grid *g, const springls__table *table, const springls__layout *layout, int section,
                                     const char *block, int count)
{
    const char *numbers = block + layout->at[section + 1];
    springls__inside_walk walk = springls__walk_inside(g, layout, block, section);
    int i, entries = (int)springls__entries_of(table);
    springls__take_table(g, table);
    for (i = 0; i < entries; i++) g->top[i] = SPRINGLS__OUTSIDE;
    while (springls__next_inside(&walk))
        for (i = 0; i < walk.length; i++) g->top[springls__entry_of_brick(g, walk.first + i)] = SPRINGLS__INSIDE;
    for (i = 0; i < count; i++)
        g->top[springls__entry_of_brick(g, springls__int_at(numbers, (size_t)i))] = SPRINGLS__FIRST_SLOT + i;
    springls__copy_numbers(g->phi + SPRINGLS__FIRST_SLOT * SPRINGLS__BRICK_VOXELS, block + layout->at[section + 2],
                           (size_t)count * SPRINGLS__BRICK_VOXELS, sizeof(float));
    g->slot_count = SPRINGLS__FIRST_SLOT + count;
    g->free_count = 0;
}

/* Initializes the slot arrays of the model's grid besides phi. calm: a byte for each octant; NULL: zeros. */
SPRINGLS__FN void springls__fresh_slots(springls_context *ctx, const char *numbers, const char *calm, int count)
{
    springls__grid *g = &ctx->model.grid;
    int i;
    for (i = 0; i < count; i++) {
        int slot = SPRINGLS__FIRST_SLOT + i;
        g->active[i] = slot;
        g->slot_brick[slot] = springls__int_at(numbers, (size_t)i);
        springls__fill(g->omega, slot, -1.0f); /* unknown */
        springls__wake_slot(g, slot);
        if (calm) memcpy(g->calm + slot * SPRINGLS__OCTANTS, calm + i * SPRINGLS__OCTANTS, SPRINGLS__OCTANTS);
    }
    memcpy(g->phi_next, g->phi, (size_t)g->slot_count * SPRINGLS__BRICK_VOXELS * sizeof(float));
    memset(g->cell, 0, (size_t)g->slot_count * SPRINGLS__CELLS * sizeof *g->cell);
    g->active_count = count;
}

/* Copies the numbers of a section into memory that is large enough; zeros where the block does not have it. */
SPRINGLS__FN void springls__get_array(springls_context *ctx, const springls__snapshot_state *s, const springls__layout *layout,
                                      const char *block, int section)
{
    const size_t bytes = (size_t)springls__section_bytes(&ctx->model.grid, s, section);
    const size_t width = (size_t)springls__section_of(section)->width;
    void *memory = springls__section_memory(ctx, section);
    if (bytes == 0) return;
    if (layout->at[section]) springls__copy_numbers(memory, block + layout->at[section], bytes / width, width);
    else memset(memory, 0, bytes);
}

/* Reads the neighbor lists; of an older block, rows as they were in memory. */
SPRINGLS__FN void springls__get_neighbors(springls_context *ctx, const springls__snapshot_state *s, const springls__layout *layout,
                                          const char *block)
{
    springls__coder counts = springls__reader(block + layout->at[SPRINGLS__SECTION_NEIGHBOR_COUNTS]);
    springls__coder edges = springls__reader(block + layout->at[SPRINGLS__SECTION_NEIGHBOR_EDGES]);
    springls__coder rows = springls__reader(block + layout->at[SPRINGLS__SECTION_NEIGHBORS]);
    const bool listed = layout->at[SPRINGLS__SECTION_NEIGHBOR_COUNTS] != 0, old = layout->at[SPRINGLS__SECTION_NEIGHBORS] != 0;
    int i;
    for (i = 0; i < s->springls; i++) {
        int *row = ctx->model.cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW;
        if (listed) springls__code_neighbors(&counts, &edges, row);
        if (!old) continue;
        springls__code(&rows, row, SPRINGLS__NEIGHBOR_ROW, sizeof *row);
        if (row[0] == SPRINGLS__NOT_FOUND) springls__no_neighbors_yet(row);
    }
}

/* Replaces the attributes by those of the snapshot. */
SPRINGLS__FN void springls__get_attributes(springls_context *ctx, const springls__snapshot_state *s,
                                           const springls__layout *layout, const char *block)
{
    int i;
    for (i = 0; i < s->attributes; i++) {
        springls__attribute *attribute = &ctx->attributes[i];
        const springls__attribute_entry *entry = &s->attribute[i];
        const char *values = block + layout->at[SPRINGLS__SECTION_VALUES + i] + SPRINGLS__ATTRIBUTE_BYTES;
        memcpy(attribute->name, entry->name, sizeof entry->name);
        attribute->channels = entry->channels;
        attribute->split = (springls_policy)entry->split;
        attribute->fill = (springls_policy)entry->fill;
        attribute->merge = (springls_policy)entry->merge;
        springls__copy_numbers(attribute->values.data, values, (size_t)s->springls * (size_t)entry->channels, sizeof(float));
    }
    ctx->attribute_count = s->attributes;
}

/* Replaces components and events by those of the snapshot. */
SPRINGLS__FN void springls__get_components(springls_context *ctx, const springls__snapshot_state *s,
                                           const springls__layout *layout, const char *block)
{
    springls__coder components = springls__reader(block + layout->at[SPRINGLS__SECTION_COMPONENTS]);
    springls__coder events = springls__reader(block + layout->at[SPRINGLS__SECTION_EVENTS]);
    springls__coder parts = springls__reader(block + layout->at[SPRINGLS__SECTION_EVENT_PARTS]);
    int i;
    /* Clears padding, so that users can compare components and events by bytes. */
    if (s->components) memset(ctx->component_memory.data, 0, (size_t)s->components * sizeof(springls__component));
    if (s->events) memset(ctx->event_memory.data, 0, (size_t)s->events * sizeof(springls_event));
    if (s->event_parts) memset(ctx->event_part_memory.data, 0, (size_t)s->event_parts * sizeof(springls_component));
    for (i = 0; i < s->components; i++)
        springls__code_component(&components, (springls__component *)ctx->component_memory.data + i);
    for (i = 0; i < s->events; i++) springls__code_event(&events, (springls_event *)ctx->event_memory.data + i);
    for (i = 0; i < s->event_parts; i++) springls__code_part(&parts, (springls_component *)ctx->event_part_memory.data + i);
}

/* Replaces the arrays of the model and its attributes by those of the snapshot. Precondition: springls__snapshot_reserve. */
SPRINGLS__FN void springls__snapshot_take(springls_context *ctx, const springls__snapshot_state *s, const springls__table *table,
                                          const springls__layout *layout, const char *block)
{
    springls__coder c = springls__reader(block + layout->at[SPRINGLS__SECTION_OF(S)]);
    int i;
    for (i = 0; i < s->springls; i++) springls__code_springl(&c, &ctx->model.set.s[i]);
    for (i = SPRINGLS__SECTION_SET; i < SPRINGLS__SECTION_NEIGHBORS; i++)
        if (springls__section_of(i)->width) springls__get_array(ctx, s, layout, block, i);
    springls__get_neighbors(ctx, s, layout, block);
    springls__get_components(ctx, s, layout, block);
    springls__get_grid(&ctx->model.grid, table, layout, SPRINGLS__SECTION_INSIDE, block, s->bricks);
    springls__fresh_slots(ctx, block + layout->at[SPRINGLS__SECTION_BRICKS],
                          layout->at[SPRINGLS__SECTION_CALM] ? block + layout->at[SPRINGLS__SECTION_CALM] : NULL, s->bricks);
    springls__get_attributes(ctx, s, layout, block);
}

/* Copies the reference level set and the original surface, and builds its hierarchy. */
SPRINGLS__FN void springls__original_take(springls_context *ctx, const springls__snapshot_state *s, const springls__table *table,
                                          const springls__layout *layout, const char *block)
{
    springls__surface *original = &ctx->original;
    springls__grid_constants(ctx, &ctx->model.reference);
    ctx->reference_stamp = 0;
    springls__get_grid(&ctx->model.reference, table, layout, SPRINGLS__SECTION_REFERENCE_INSIDE, block, s->reference_bricks);
    springls__surface_forget(original);
    if (s->original == 0) return;
    springls__get_array(ctx, s, layout, block, SPRINGLS__SECTION_ORIGINAL);
    springls__surface_finish(ctx, original, s->original);
    original->given = s->given;
    original->joints = s->original_tools;
    springls__get_array(ctx, s, layout, block, SPRINGLS__SECTION_TOOLS);
    if (!s->has_source) return;
    original->source = (int *)original->source_memory.data;
    springls__get_array(ctx, s, layout, block, SPRINGLS__SECTION_SOURCE);
}

/* Replaces the numbers of the model, except parameters and attributes, by those of the snapshot. */
SPRINGLS__FN void springls__numbers_take(springls_context *ctx, const springls__snapshot_state *s, const springls__layout *layout)
{
    const int window[3] = { s->window_x, s->window_y, s->window_z };
    const int original_window[3] = { s->original_window_x, s->original_window_y, s->original_window_z };
    springls__place_window(ctx, &ctx->window, window);
    springls__place_window(ctx, &ctx->original_window, original_window);
    springls__constellation_changed(ctx); /* before the numbers that it clears */
#define SPRINGLS__RESTORE(name, member) ctx->member = s->name;
    SPRINGLS__SNAPSHOT_COPIES(SPRINGLS__RESTORE)
#undef SPRINGLS__RESTORE
    ctx->neighbors_missing = s->neighbors_missing;
    if (layout->at[SPRINGLS__SECTION_NEIGHBORS]) { /* an older block */
        ctx->neighbors_uses = springls__imax(0, s->params.resample_period - s->neighbors_age);
        ctx->neighbors_missing = true;
    }
    ctx->components_version = s->components_fresh ? springls__components_source(ctx) : 0;
    ctx->model.grid.some_asleep = 0;
    ctx->away = FLT_MAX;
    ctx->saved.in_use = false;
}

SPRINGLS__SNAPSHOTS_API springls_status springls_restore(springls_context *ctx, const void *block, size_t size)
{
    springls__snapshot_state s;
    springls__layout layout;
    springls__table tables[2];
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!block) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "restore: the block is NULL");
    if (ctx->step.combination) springls__abandon_step(ctx); /* the original surface, too, is as before it */
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__snapshot_read(ctx, (const char *)block, size, &s, &layout));
    springls__tables_of_block(ctx, &s, &layout, (const char *)block, tables);
    SPRINGLS__TRY(springls__snapshot_reserve(ctx, &s, tables));
    springls__abandon_step(ctx);
    springls__discard_device_copies(ctx);
    ctx->model.params = s.params;
    springls__model_constants(ctx);
    springls__snapshot_take(ctx, &s, &tables[0], &layout, (const char *)block);
    if (s.kind == SPRINGLS_SNAPSHOT_KIND_ALL) springls__original_take(ctx, &s, &tables[1], &layout, (const char *)block);
    springls__numbers_take(ctx, &s, &layout);
    return SPRINGLS_OK;
}

#endif
