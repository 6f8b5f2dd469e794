/* snapshot.h - writes all that a model's future depends on as one block of bytes (snapshot_format.h). What can be computed from
   these (cells, omega, hierarchies) is not in it. Bricks are stored in their order, without their slots. */
#ifndef SPRINGLS__OUTPUT_SNAPSHOT_H
#define SPRINGLS__OUTPUT_SNAPSHOT_H

#include "../runtime/errors.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "../solver/step.h"
#include "../stages/window.h"
#include "snapshot_format.h"

/* Counts the bricks with voxels. */
SPRINGLS__FN int springls__active_bricks(const springls__grid *g)
{
    int i, n = 0, entries = (int)springls__entry_count(g);
    for (i = 0; i < entries; i++) n += g->top[i] >= SPRINGLS__FIRST_SLOT;
    return n;
}

/* Writes the runs of bricks that have no voxels and are inside: first number and count; returns how many there are. c: NULL counts
   them only. */
SPRINGLS__FN int springls__put_inside_runs(springls__coder *c, const springls__grid *g)
{
    int32_t first = 0, length = 0;
    int i, runs = 0, entries = (int)springls__entry_count(g);
    for (i = 0; i <= entries; i++) {
        const bool inside = i < entries && g->top[i] == SPRINGLS__INSIDE;
        const int brick = inside ? springls__brick_of_entry(g, i) : -1;
        if (length > 0 && brick != first + length) {
            if (c) SPRINGLS__CODE(c, first);
            if (c) SPRINGLS__CODE(c, length);
            length = 0;
            runs++;
        }
        if (inside && length++ == 0) first = brick;
    }
    return runs;
}

/* Returns a checksum, never 0, of the reference level set and the original surface: a FRAME snapshot, which leaves them out, can
   be restored only where it is the same. */
SPRINGLS__FN uint64_t springls__reference_stamp(springls_context *ctx)
{
    const springls__grid *g = &ctx->model.reference;
    const springls__surface *original = &ctx->original;
    uint64_t stamp = springls__checksum(1, &g->far_value, sizeof g->far_value, true);
    int i, entries = (int)springls__entry_count(g);
    if (ctx->reference_stamp) return ctx->reference_stamp;
    for (i = 0; i < entries; i++) {
        int side = springls__imin(g->top[i], SPRINGLS__FIRST_SLOT), brick = springls__brick_of_entry(g, i);
        if (side == SPRINGLS__OUTSIDE) continue;
        stamp = springls__checksum(stamp, &brick, sizeof brick, true);
        stamp = springls__checksum(stamp, &side, sizeof side, true);
        if (side >= SPRINGLS__FIRST_SLOT)
            stamp = springls__checksum(stamp, g->phi + (size_t)g->top[i] * SPRINGLS__BRICK_VOXELS,
                                       SPRINGLS__BRICK_VOXELS * sizeof(float), true);
    }
    if (!springls__is_unmoved(&ctx->original_window))
        stamp = springls__checksum(stamp, ctx->original_window.offset, sizeof ctx->original_window.offset, true);
    stamp = springls__checksum(stamp, original->points, 3 * (size_t)original->count * sizeof(springls__v3), true);
    if (original->source) stamp = springls__checksum(stamp, original->source, (size_t)original->count * sizeof(int), true);
    return ctx->reference_stamp = stamp | 1u;
}

/* Describes the attributes of the model. */
SPRINGLS__FN void springls__snapshot_attributes(const springls_context *ctx, springls__snapshot_state *s)
{
    int i;
    s->attributes = ctx->attribute_count;
    for (i = 0; i < s->attributes; i++) {
        const springls__attribute *attribute = &ctx->attributes[i];
        springls__attribute_entry *entry = &s->attribute[i];
        memcpy(entry->name, attribute->name, strlen(attribute->name));
        entry->channels = attribute->channels;
        entry->split = (int32_t)attribute->split;
        entry->fill = (int32_t)attribute->fill;
        entry->merge = (int32_t)attribute->merge;
    }
}

/* Returns how many neighbors all vertices have, in lists that are still in use. */
SPRINGLS__FN int64_t springls__neighbors_listed(const springls_context *ctx)
{
    int64_t n = 0;
    int i, m;
    if (ctx->neighbors_uses == 0) return 0;
    for (i = 0; i < ctx->model.set.count; i++)
        for (m = 0; m < 3; m++) n += springls__neighbor_count(ctx->model.cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW, m);
    return n;
}

/* Returns whether springls lack a list. neighbors_missing may be set if none does: a device does not wait to find out. */
SPRINGLS__FN bool springls__neighbors_are_missing(const springls_context *ctx)
{
    int i;
    for (i = 0; ctx->neighbors_uses > 0 && ctx->neighbors_missing && i < ctx->model.set.count; i++)
        if (ctx->model.cells.neighbors[(size_t)i * SPRINGLS__NEIGHBOR_ROW] == SPRINGLS__NOT_FOUND) return true;
    return false;
}

/* Lists the numbers that a snapshot copies from the context and back: X(name in the snapshot, member of the context). Times are no
   part of a state. */
#define SPRINGLS__SNAPSHOT_COPIES(X)                                                                                             \
    X(time, time) X(iteration, iteration) X(lag, lag) X(lag_turned, lag_turned) X(opposed, opposed)                              \
    X(springls, model.set.count) X(at_edges, model.set.at_edges) X(next_id, model.set.next_id) X(step, model.set.step)           \
    X(neighbors_uses, neighbors_uses) X(components, component_count) X(events, event_count) X(event_parts, event_part_count)     \
    X(new_events, new_events) X(components_found, components_found) X(volumes_locked, volumes_locked)                            \
    X(last_component_id, last_component_id) X(last_contact_body, last_contact_body)                                              \
    X(steps, stats.steps) X(added, stats.added) X(split, stats.split) X(removed, stats.removed) X(reshaped, stats.reshaped)      \
    X(refused, stats.refused) X(left, stats.left) X(volume_correction, stats.volume_correction)                                  \
    X(largest_displacement, stats.largest_displacement) X(moving_share, stats.moving_share)

/* Fills the numbers from the model. */
SPRINGLS__FN void springls__snapshot_fill(springls_context *ctx, springls_snapshot_kind kind, springls__snapshot_state *s)
{
    memset(s, 0, sizeof *s);
#define SPRINGLS__STORE(name, member) s->name = ctx->member;
    SPRINGLS__SNAPSHOT_COPIES(SPRINGLS__STORE)
#undef SPRINGLS__STORE
    s->kind = (int32_t)kind;
    s->reference_stamp = kind == SPRINGLS_SNAPSHOT_KIND_FRAME ? springls__reference_stamp(ctx) : 0;
    s->params = ctx->model.params;
    s->neighbors = springls__neighbors_listed(ctx);
    s->neighbors_missing = springls__neighbors_are_missing(ctx);
    s->bricks = ctx->model.grid.active_count;
    s->reference_bricks = springls__active_bricks(&ctx->model.reference);
    s->original = ctx->original.count;
    s->given = ctx->original.given;
    s->has_source = ctx->original.source != NULL;
    s->original_tools = ctx->original.joints;
    s->window_x = ctx->window.offset[0];
    s->window_y = ctx->window.offset[1];
    s->window_z = ctx->window.offset[2];
    s->original_window_x = ctx->original_window.offset[0];
    s->original_window_y = ctx->original_window.offset[1];
    s->original_window_z = ctx->original_window.offset[2];
    s->inside_runs = springls__put_inside_runs(NULL, &ctx->model.grid);
    s->reference_inside_runs = springls__put_inside_runs(NULL, &ctx->model.reference);
    springls__snapshot_attributes(ctx, s);
}

/* Writes a grid into sections, the first of which is `inside`: runs of bricks inside, numbers and values of those with voxels. */
SPRINGLS__FN void springls__put_grid(char *out, const springls__layout *layout, int inside, const springls__grid *g)
{
    springls__coder runs = springls__writer(out + layout->at[inside]);
    springls__coder numbers = springls__writer(out + layout->at[inside + 1]);
    springls__coder values = springls__writer(out + layout->at[inside + 2]);
    int i, entries = (int)springls__entry_count(g);
    springls__put_inside_runs(&runs, g);
    for (i = 0; i < entries; i++) {
        int brick = springls__brick_of_entry(g, i);
        if (g->top[i] < SPRINGLS__FIRST_SLOT) continue;
        SPRINGLS__CODE(&numbers, brick);
        springls__code(&values, g->phi + (size_t)g->top[i] * SPRINGLS__BRICK_VOXELS, SPRINGLS__BRICK_VOXELS, sizeof(float));
    }
}

/* Writes the neighbor lists. */
SPRINGLS__FN void springls__put_neighbors(const springls_context *ctx, const springls__layout *layout, char *out)
{
    springls__coder counts = springls__writer(out + layout->at[SPRINGLS__SECTION_NEIGHBOR_COUNTS]);
    springls__coder edges = springls__writer(out + layout->at[SPRINGLS__SECTION_NEIGHBOR_EDGES]);
    int i;
    if (!layout->at[SPRINGLS__SECTION_NEIGHBOR_COUNTS]) return;
    for (i = 0; i < ctx->model.set.count; i++)
        springls__code_neighbors(&counts, &edges, ctx->model.cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW);
}

/* Writes a section of records, or an attribute. */
SPRINGLS__FN void springls__put_records(springls_context *ctx, const springls__snapshot_state *s, int section, springls__coder *c)
{
    int32_t size[3];
    double to_world[12];
    int i, a = springls__attribute_of(section);
    if (a >= 0) {
        springls__attribute_entry entry = s->attribute[a];
        springls__code_attribute(c, &entry);
        springls__code(c, ctx->attributes[a].values.data, (size_t)s->springls * (size_t)entry.channels, sizeof(float));
        return;
    }
    switch (section) {
    case SPRINGLS__SECTION_NUMBERS: springls__put_named(c, springls__snapshot_numbers, SPRINGLS__NUMBERS_WRITTEN, s); break;
    case SPRINGLS__SECTION_PARAMS: springls__put_named(c, springls__snapshot_params, SPRINGLS__PARAMS_NAMED, &s->params); break;
    case SPRINGLS__SECTION_GRID:
        for (i = 0; i < 3; i++) size[i] = ctx->model.grid.size[i];
        memcpy(to_world, ctx->lattice_to_world, sizeof to_world);
        springls__code_grid(c, size, to_world);
        break;
    case SPRINGLS__SECTION_OF(S):
        for (i = 0; i < s->springls; i++) springls__code_springl(c, &ctx->model.set.s[i]);
        break;
    case SPRINGLS__SECTION_CALM:
        for (i = 0; i < s->bricks; i++)
            springls__code(c, &ctx->model.grid.calm[ctx->model.grid.active[i] * SPRINGLS__OCTANTS], SPRINGLS__OCTANTS, 1);
        break;
    case SPRINGLS__SECTION_COMPONENTS:
        for (i = 0; i < s->components; i++) springls__code_component(c, (springls__component *)ctx->component_memory.data + i);
        break;
    case SPRINGLS__SECTION_EVENTS:
        for (i = 0; i < s->events; i++) springls__code_event(c, (springls_event *)ctx->event_memory.data + i);
        break;
    case SPRINGLS__SECTION_EVENT_PARTS:
        for (i = 0; i < s->event_parts; i++) springls__code_part(c, (springls_component *)ctx->event_part_memory.data + i);
        break;
    default: break;
    }
}

/* Returns the array of a section that holds an array of numbers as it is. */
SPRINGLS__FN void *springls__section_memory(springls_context *ctx, int section)
{
    if (section >= SPRINGLS__SECTION_SET && section < SPRINGLS__SECTION_NEIGHBORS)
        return ctx->memory[section - SPRINGLS__SECTION_SET].data;
    switch (section) {
    case SPRINGLS__SECTION_ORIGINAL: return ctx->original.points;
    case SPRINGLS__SECTION_SOURCE: return ctx->original.source_memory.data;
    case SPRINGLS__SECTION_TOOLS: return ctx->original.joint_memory.data;
    default: return NULL; /* of a grid */
    }
}

/* Writes a section's data at out + layout->at[section], but for grids. */
SPRINGLS__FN void springls__put_section(springls_context *ctx, const springls__snapshot_state *s, const springls__layout *layout,
                                        int section, char *out)
{
    springls__coder c = springls__writer(out + layout->at[section]);
    size_t width = (size_t)springls__section_of(section)->width;
    void *memory = springls__section_memory(ctx, section);
    if (width == 0) springls__put_records(ctx, s, section, &c);
    else if (memory) springls__code(&c, memory, (size_t)layout->bytes[section] / width, width);
}

/* Writes the head of a section, and zeros behind its data. */
SPRINGLS__FN void springls__put_section_head(const springls__layout *layout, int section, char *out)
{
    const uint64_t end = layout->at[section] + layout->bytes[section];
    springls__coder c = springls__writer(out + layout->at[section] - SPRINGLS__SECTION_HEAD_BYTES);
    uint64_t bytes = layout->bytes[section];
    char tag[4];
    memcpy(tag, springls__section_of(section)->tag, sizeof tag);
    springls__code(&c, tag, sizeof tag, 1);
    springls__code_zeros(&c, 4); /* flags */
    SPRINGLS__CODE(&c, bytes);
    memset(out + end, 0, (size_t)(springls__padded(bytes) - bytes));
}

/* Writes the head of a block of `size` bytes with `count` sections; the rest of the block must be complete. */
SPRINGLS__FN void springls__put_head(char *out, const char magic[8], uint32_t count, uint64_t size)
{
    springls__coder c = springls__writer(out + sizeof springls__snapshot_magic);
    uint32_t version = SPRINGLS__SNAPSHOT_VERSION;
    uint64_t checksum = springls__checksum(size, out + SPRINGLS__HEAD_BYTES, (size_t)(size - SPRINGLS__HEAD_BYTES), false);
    memcpy(out, magic, sizeof springls__snapshot_magic);
    SPRINGLS__CODE(&c, version);
    SPRINGLS__CODE(&c, count);
    SPRINGLS__CODE(&c, size);
    SPRINGLS__CODE(&c, checksum);
}

/* Writes the block, layout->size bytes. */
SPRINGLS__FN void springls__snapshot_write(springls_context *ctx, const springls__snapshot_state *s,
                                           const springls__layout *layout, char *out)
{
    int section;
    for (section = 0; section < SPRINGLS__SECTIONS; section++) {
        if (!layout->at[section]) continue;
        springls__put_section_head(layout, section, out);
        springls__put_section(ctx, s, layout, section, out);
    }
    springls__put_neighbors(ctx, layout, out);
    springls__put_grid(out, layout, SPRINGLS__SECTION_INSIDE, &ctx->model.grid);
    if (s->kind == SPRINGLS_SNAPSHOT_KIND_ALL)
        springls__put_grid(out, layout, SPRINGLS__SECTION_REFERENCE_INSIDE, &ctx->model.reference);
    springls__put_head(out, springls__snapshot_magic, layout->count, layout->size);
}

/* Readies a model for a snapshot, and finds the snapshot's numbers, and where its sections lie; layout.size: its bytes. */
SPRINGLS__FN springls_status springls__snapshot_begin(springls_context *ctx, springls_snapshot_kind kind, springls__snapshot_state *state,
                                                      springls__layout *layout)
{
    SPRINGLS__TRY(springls__finish_step(ctx));
    SPRINGLS__TRY(springls__settle_components(ctx));
    SPRINGLS__TRY(springls__use_host(ctx, false));
    springls__snapshot_fill(ctx, kind, state);
    *layout = springls__layout_of(&ctx->model.grid, state);
    return (size_t)layout->size == layout->size ? SPRINGLS_OK : springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "snapshot: a size overflows");
}

SPRINGLS__SNAPSHOTS_API springls_status springls_snapshot(springls_context *ctx, springls_snapshot_kind kind, void *out,
                                                          size_t capacity, size_t *size)
{
    springls__snapshot_state state;
    springls__layout layout;
    if (size) *size = 0;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!size) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "snapshot: size is NULL");
    if (kind != SPRINGLS_SNAPSHOT_KIND_ALL && kind != SPRINGLS_SNAPSHOT_KIND_FRAME)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "snapshot: there is no kind %d: it may be 0 or 1", (int)kind);
    SPRINGLS__TRY(springls__snapshot_begin(ctx, kind, &state, &layout));
    *size = (size_t)layout.size;
    if (!out) return SPRINGLS_OK;
    if (capacity < *size)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "snapshot: %lu bytes are needed, not %lu",
                              (unsigned long)*size, (unsigned long)capacity);
    springls__snapshot_write(ctx, &state, &layout, (char *)out);
    return SPRINGLS_OK;
}

#endif
