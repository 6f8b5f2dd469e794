/* snapshot.h - writes and restores all that a model's future depends on, as one block of bytes (snapshot_format.h). What can be
   computed from these (cells, omega, hierarchies) is not in it. Bricks are stored in their order, without their slots.
   springls_restore checks everything and allocates all memory before the model changes. */
#ifndef SPRINGLS__OUTPUT_SNAPSHOT_H
#define SPRINGLS__OUTPUT_SNAPSHOT_H

#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../model/bvh.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "../solver/step.h"
#include "../stages/window.h"
#include "snapshot_format.h"

/* ---- writing ---- */

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

/* Fills the statistics, but for times: they are no part of a state. */
SPRINGLS__FN void springls__snapshot_stats(const springls_stats *stats, springls__snapshot_state *s)
{
    s->steps = stats->steps;
    s->added = stats->added;
    s->split = stats->split;
    s->removed = stats->removed;
    s->reshaped = stats->reshaped;
    s->refused = stats->refused;
    s->left = stats->left;
    s->volume_correction = stats->volume_correction;
    s->largest_displacement = stats->largest_displacement;
    s->moving_share = stats->moving_share;
}

/* Fills the numbers from the model. */
SPRINGLS__FN void springls__snapshot_fill(springls_context *ctx, springls_snapshot_kind kind, springls__snapshot_state *s)
{
    memset(s, 0, sizeof *s);
    s->kind = (int32_t)kind;
    s->time = ctx->time;
    s->reference_stamp = kind == SPRINGLS_SNAPSHOT_KIND_FRAME ? springls__reference_stamp(ctx) : 0;
    s->params = ctx->model.params;
    s->iteration = ctx->iteration;
    s->lag = ctx->lag;
    s->opposed = ctx->opposed;
    s->springls = ctx->model.set.count;
    s->at_edges = ctx->model.set.at_edges;
    s->neighbors_age = springls__imax(ctx->neighbors_age, -1);
    s->bricks = ctx->model.grid.active_count;
    s->components = ctx->component_count;
    s->events = ctx->event_count;
    s->event_parts = ctx->event_part_count;
    s->components_found = ctx->components_found;
    s->components_fresh = ctx->components_fresh;
    s->volumes_locked = ctx->volumes_locked;
    s->last_component_id = ctx->last_component_id;
    s->last_contact_body = ctx->last_contact_body;
    s->next_id = ctx->model.set.next_id;
    s->step = ctx->model.set.step;
    s->reference_bricks = springls__active_bricks(&ctx->model.reference);
    s->original = ctx->original.count;
    s->given = ctx->original.given;
    s->has_source = ctx->original.source != NULL;
    s->window_x = ctx->window.offset[0];
    s->window_y = ctx->window.offset[1];
    s->window_z = ctx->window.offset[2];
    s->original_window_x = ctx->original_window.offset[0];
    s->original_window_y = ctx->original_window.offset[1];
    s->original_window_z = ctx->original_window.offset[2];
    s->inside_runs = springls__put_inside_runs(NULL, &ctx->model.grid);
    s->reference_inside_runs = springls__put_inside_runs(NULL, &ctx->model.reference);
    springls__snapshot_stats(&ctx->stats, s);
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
    case SPRINGLS__SECTION_NUMBERS: springls__put_named(c, springls__snapshot_numbers, SPRINGLS__NUMBERS, s); break;
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
        for (i = 0; i < s->bricks; i++) springls__code(c, &ctx->model.grid.calm[ctx->model.grid.active[i]], 1, 1);
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
    case SPRINGLS__SECTION_NEIGHBORS: return ctx->model.cells.neighbors;
    case SPRINGLS__SECTION_ORIGINAL: return ctx->original.points;
    case SPRINGLS__SECTION_SOURCE: return ctx->original.source_memory.data;
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

/* Writes the head of a block that is complete but for it. */
SPRINGLS__FN void springls__put_head(char *out, const springls__layout *layout)
{
    springls__coder c = springls__writer(out + sizeof springls__snapshot_magic);
    uint32_t version = SPRINGLS__SNAPSHOT_VERSION, count = layout->count;
    uint64_t size = layout->size;
    uint64_t checksum = springls__checksum(size, out + SPRINGLS__HEAD_BYTES, (size_t)(size - SPRINGLS__HEAD_BYTES), false);
    memcpy(out, springls__snapshot_magic, sizeof springls__snapshot_magic);
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
    springls__put_grid(out, layout, SPRINGLS__SECTION_INSIDE, &ctx->model.grid);
    if (s->kind == SPRINGLS_SNAPSHOT_KIND_ALL)
        springls__put_grid(out, layout, SPRINGLS__SECTION_REFERENCE_INSIDE, &ctx->model.reference);
    springls__put_head(out, layout);
}

SPRINGLS_API springls_status springls_snapshot(springls_context *ctx, springls_snapshot_kind kind, void *out,
                                               size_t room, size_t *size)
{
    springls__snapshot_state state;
    springls__layout layout;
    if (size) *size = 0;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!size) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "snapshot: size is NULL");
    if (kind != SPRINGLS_SNAPSHOT_KIND_ALL && kind != SPRINGLS_SNAPSHOT_KIND_FRAME)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "snapshot: there is no kind %d", (int)kind);
    SPRINGLS__TRY(springls__finish_step(ctx));
    springls__end_reading(ctx);
    SPRINGLS__TRY(springls__use_host(ctx, false));
    springls__snapshot_fill(ctx, kind, &state);
    layout = springls__layout_of(&ctx->model.grid, &state);
    *size = (size_t)layout.size;
    if (*size != layout.size) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "snapshot: a size overflows");
    if (!out) return SPRINGLS_OK;
    if (room < *size)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "snapshot: %lu bytes are needed, not %lu",
                              (unsigned long)*size, (unsigned long)room);
    springls__snapshot_write(ctx, &state, &layout, (char *)out);
    return SPRINGLS_OK;
}

/* ---- checking ---- */

/* Returns whether all floats are finite. */
SPRINGLS__FN bool springls__all_finite(const char *data, uint64_t bytes)
{
    uint64_t i;
    uint32_t bad = 0;
    for (i = 0; i < bytes / 4; i++)
        bad |= (uint32_t)(((uint32_t)springls__int_at(data, (size_t)i) & 0x7f800000u) == 0x7f800000u);
    return !bad;
}

/* Returns whether all ints lie in [low, high]. */
SPRINGLS__FN bool springls__all_between(const char *data, uint64_t bytes, int low, int high)
{
    uint64_t i;
    bool good = true;
    for (i = 0; i < bytes / 4; i++) {
        int value = springls__int_at(data, (size_t)i);
        good = good && value >= low && value <= high;
    }
    return good;
}

/* Returns whether all bytes are 0 or 1. */
SPRINGLS__FN bool springls__all_flags(const char *data, uint64_t bytes)
{
    uint64_t i;
    unsigned char all = 0;
    for (i = 0; i < bytes; i++) all = (unsigned char)(all | (unsigned char)data[i]);
    return all <= 1;
}

/* Walks through the runs of bricks that are inside, in a block. bits: of an older block, which has a bit for each brick of the
   domain; NULL: it has runs. */
typedef struct springls__inside_walk {
    const char *bits, *runs;
    int at, end;       /* bricks, with bits; otherwise runs */
    int first, length; /* of the run */
} springls__inside_walk;

/* Begins to walk. section: of a grid's runs; behind that of its bits. */
SPRINGLS__FN springls__inside_walk springls__walk_inside(const springls__grid *g, const springls__layout *layout,
                                                         const char *block, int section)
{
    springls__inside_walk w;
    memset(&w, 0, sizeof w);
    w.bits = layout->at[section - 1] ? block + layout->at[section - 1] : NULL;
    w.runs = block + layout->at[section];
    w.end = w.bits ? (int)springls__brick_count(g) : (int)(layout->bytes[section] / (2 * sizeof(int32_t)));
    return w;
}

SPRINGLS__FN bool springls__bit_at(const char *bits, int i) { return bits[i >> 3] >> (i & 7) & 1; }

/* Goes on to the next run; returns whether there is one. */
SPRINGLS__FN bool springls__next_inside(springls__inside_walk *w)
{
    if (w->bits) {
        while (w->at < w->end && !springls__bit_at(w->bits, w->at)) w->at += w->bits[w->at >> 3] ? 1 : 8 - (w->at & 7);
        w->first = w->at;
        while (w->at < w->end && springls__bit_at(w->bits, w->at)) w->at++;
        w->length = w->at - w->first;
        return w->length > 0;
    }
    if (w->at == w->end) return false;
    w->first = springls__int_at(w->runs, 2 * (size_t)w->at);
    w->length = springls__int_at(w->runs, 2 * (size_t)w->at + 1);
    w->at++;
    return true;
}

/* Returns whether the numbers of the bricks with voxels, and the runs of those inside, ascend, exist, and have none in common.
   section: of the runs. */
SPRINGLS__FN bool springls__bricks_good(const springls__grid *g, const springls__layout *layout, const char *block, int section,
                                        int count)
{
    const char *numbers = block + layout->at[section + 1];
    const int bricks = (int)springls__brick_count(g);
    springls__inside_walk walk = springls__walk_inside(g, layout, block, section);
    int i = 0, last = -1, end = 0;
    while (springls__next_inside(&walk)) {
        if (walk.first < end || walk.length < 1 || walk.length > bricks - walk.first) return false;
        end = walk.first + walk.length;
        for (; i < count && springls__int_at(numbers, (size_t)i) < end; i++) {
            int brick = springls__int_at(numbers, (size_t)i);
            if (brick <= last || brick >= walk.first) return false;
            last = brick;
        }
    }
    for (; i < count; i++) {
        int brick = springls__int_at(numbers, (size_t)i);
        if (brick <= last || brick >= bricks) return false;
        last = brick;
    }
    return true;
}

/* Returns whether an attribute has a name of its own and valid members. */
SPRINGLS__FN bool springls__entry_good(const springls__snapshot_state *s, int row)
{
    const springls__attribute_entry *a = &s->attribute[row];
    int i;
    if (a->name[0] == 0 || a->name[SPRINGLS_MAX_NAME_LENGTH] != 0 || a->channels < 1 || a->channels > SPRINGLS_MAX_CHANNELS)
        return false;
    for (i = 0; i < row; i++)
        if (strcmp(a->name, s->attribute[i].name) == 0) return false;
    return true;
}

SPRINGLS__FN bool springls__finite_double(double x) { return x >= -DBL_MAX && x <= DBL_MAX; }

SPRINGLS__FN bool springls__flag_good(int32_t flag) { return flag == 0 || flag == 1; }

/* Returns whether a window can be there. */
SPRINGLS__FN bool springls__offset_good(int32_t x, int32_t y, int32_t z)
{
    const int32_t limit = SPRINGLS__FURTHEST_WINDOW;
    return x >= -limit && x <= limit && y >= -limit && y <= limit && z >= -limit && z <= limit && x % SPRINGLS__BRICK == 0
        && y % SPRINGLS__BRICK == 0 && z % SPRINGLS__BRICK == 0;
}

/* Returns whether each number alone, and those that depend on each other, can be those of a model. */
SPRINGLS__FN bool springls__numbers_in_range(const springls__snapshot_state *s)
{
    const int furthest = INT32_MAX / 2; /* counters that will grow */
    if (springls__params_fault(&s->params) || !springls__finite_double(s->time)) return false;
    if (s->springls < 0 || s->springls > INT32_MAX / 3 - 1) return false;
    if (s->at_edges < 0 || s->at_edges > INT32_MAX / 3 - 1) return false; /* some may have been removed since they were counted */
    if (s->iteration < 0 || s->iteration > furthest || s->steps < 0 || s->steps > furthest) return false;
    if (s->neighbors_age < -1 || s->neighbors_age > furthest) return false;
    if (s->components < 0 || s->events < 0 || s->event_parts < 0) return false;
    if (s->original < 0 || s->bricks < 0 || s->reference_bricks < 0) return false;
    if (s->inside_runs < 0 || s->reference_inside_runs < 0) return false;
    if (s->given < s->original || s->given > INT32_MAX / 3 || (!s->has_source && s->given != s->original)) return false;
    if (!springls__flag_good(s->has_source) || !springls__flag_good(s->components_found)) return false;
    if (!(s->lag >= 0.0f) || !springls__flag_good(s->opposed)) return false;
    if (!springls__offset_good(s->window_x, s->window_y, s->window_z)
        || !springls__offset_good(s->original_window_x, s->original_window_y, s->original_window_z)) return false;
    if (!springls__flag_good(s->components_fresh) || !springls__flag_good(s->volumes_locked)) return false;
    if (!springls__all_finite((const char *)&s->volume_correction, 4)
        || !springls__all_finite((const char *)&s->largest_displacement, 4)
        || !springls__all_finite((const char *)&s->moving_share, 4)) return false;
    return (uint32_t)s->springls <= s->next_id && s->step <= 0x3fffffffu;
}

/* Returns why the numbers cannot be those of a model of this context, as the end of "the block is ..."; NULL: they can. */
SPRINGLS__FN const char *springls__numbers_fault(springls_context *ctx, const springls__snapshot_state *s)
{
    int i;
    if (s->kind != SPRINGLS_SNAPSHOT_KIND_ALL && s->kind != SPRINGLS_SNAPSHOT_KIND_FRAME) return "of an unknown kind";
    if (!springls__numbers_in_range(s)) return "damaged";
    for (i = 0; i < s->attributes; i++)
        if (!springls__entry_good(s, i)) return "damaged";
    if (s->kind == SPRINGLS_SNAPSHOT_KIND_FRAME && s->reference_stamp != springls__reference_stamp(ctx))
        return "of another original surface, which it leaves out";
    return NULL;
}

/* Returns whether an array of the constellation has valid elements: floats and flags. */
SPRINGLS__FN bool springls__springl_array_good(int array, const char *data, uint64_t bytes)
{
    static const uint64_t floats = SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | SPRINGLS__BIT(PHI_AT) | SPRINGLS__BIT(SYNCED_POSITION)
                                 | SPRINGLS__BIT(ERROR);
    static const uint64_t flags = SPRINGLS__BIT(MASK) | SPRINGLS__BIT(EDGE) | SPRINGLS__BIT(OVERLAPPED);
    if (floats >> array & 1u) return springls__all_finite(data, bytes);
    if (flags >> array & 1u) return springls__all_flags(data, bytes);
    return true;
}

/* Returns whether the components have ascending ids, finite volumes, and voxels of the domain. */
SPRINGLS__FN bool springls__components_good(const springls__grid *g, const springls__snapshot_state *s, const char *data)
{
    springls__coder c = springls__reader(data);
    springls__component component;
    uint32_t before = 0;
    int i;
    for (i = 0; i < s->components; i++) {
        springls__code_component(&c, &component);
        if (c.bad || component.view.id <= before || component.view.id > s->last_component_id) return false;
        if (!springls__finite_double(component.target) || !springls__finite_double(component.view.volume)) return false;
        if (!springls__grid_contains(g, component.deepest[0], component.deepest[1], component.deepest[2])) return false;
        before = component.view.id;
    }
    return true;
}

/* Returns whether the events have as many parts as there are. */
SPRINGLS__FN bool springls__events_good(const springls__snapshot_state *s, const char *data)
{
    springls__coder c = springls__reader(data);
    springls_event event;
    int64_t parts = 0;
    int i;
    for (i = 0; i < s->events; i++) {
        springls__code_event(&c, &event);
        if (c.bad || event.before_count < 0 || event.after_count < 0) return false;
        parts += (int64_t)event.before_count + event.after_count;
    }
    return parts == s->event_parts;
}

/* Returns whether the parts of events can be loaded; nothing depends on their numbers. */
SPRINGLS__FN bool springls__event_parts_good(const springls__snapshot_state *s, const char *data)
{
    springls__coder c = springls__reader(data);
    springls_component part;
    int i;
    for (i = 0; i < s->event_parts; i++) springls__code_part(&c, &part);
    return !c.bad;
}

/* Returns whether a section has valid elements. */
SPRINGLS__FN bool springls__section_good(const springls__grid *g, const springls__snapshot_state *s,
                                         const springls__layout *layout, const char *block, int section)
{
    const char *data = block + layout->at[section];
    const uint64_t bytes = layout->bytes[section];
    if (springls__attribute_of(section) >= 0)
        return true; /* sums of SPRINGLS_POLICY_SHARE may have overflowed, and nothing else depends on attributes */
    if (section >= SPRINGLS__SECTION_SET && section < SPRINGLS__SECTION_NEIGHBORS)
        return springls__springl_array_good(section - SPRINGLS__SECTION_SET, data, bytes);
    switch (section) {
    case SPRINGLS__SECTION_NUMBERS:
    case SPRINGLS__SECTION_PARAMS:
    case SPRINGLS__SECTION_GRID: /* checked by springls__snapshot_numbers_read */
    case SPRINGLS__SECTION_SIDES:
    case SPRINGLS__SECTION_INSIDE:
    case SPRINGLS__SECTION_REFERENCE_SIDES:
    case SPRINGLS__SECTION_REFERENCE_INSIDE:
    case SPRINGLS__SECTION_BRICKS:
    case SPRINGLS__SECTION_REFERENCE_BRICKS: /* checked together by springls__bricks_good */
    case SPRINGLS__SECTION_CALM: return true;
    case SPRINGLS__SECTION_NEIGHBORS: return springls__all_between(data, bytes, SPRINGLS__NOT_FOUND, 3 * s->springls - 1);
    case SPRINGLS__SECTION_COMPONENTS: return springls__components_good(g, s, data);
    case SPRINGLS__SECTION_EVENTS: return springls__events_good(s, data);
    case SPRINGLS__SECTION_EVENT_PARTS: return springls__event_parts_good(s, data);
    case SPRINGLS__SECTION_SOURCE:
        return springls__all_between(data, bytes, 0, s->given <= INT32_MAX / 2 ? 2 * s->given - 1 : INT32_MAX);
    default: return springls__all_finite(data, bytes);
    }
}

/* Returns whether the block has the sections that its numbers promise, and these have valid elements. */
SPRINGLS__FN bool springls__sections_good(const springls__grid *g, const springls__snapshot_state *s,
                                          const springls__layout *layout, const char *block)
{
    int section;
    for (section = SPRINGLS__SECTION_SET; section < SPRINGLS__SECTIONS; section++) {
        const uint64_t bytes = springls__section_bytes(g, s, section);
        if (!layout->at[section] && (bytes == 0 || springls__section_of(section)->use != SPRINGLS__SECTION_USED))
            continue;
        if (layout->bytes[section] != bytes) return false;
    }
    if (s->events == 0 && s->event_parts > 0) return false;
    if (!springls__bricks_good(g, layout, block, SPRINGLS__SECTION_INSIDE, s->bricks)
        || !springls__bricks_good(g, layout, block, SPRINGLS__SECTION_REFERENCE_INSIDE,
                                  s->kind == SPRINGLS_SNAPSHOT_KIND_ALL ? s->reference_bricks : 0)) return false;
    for (section = SPRINGLS__SECTION_SET; section < SPRINGLS__SECTIONS; section++)
        if (layout->at[section] && !springls__section_good(g, s, layout, block, section)) return false;
    return true;
}

/* Returns why a block cannot be a snapshot, as the end of "the block is ..."; NULL: it can. */
SPRINGLS__FN const char *springls__head_fault(const char *block, size_t size, uint32_t *sections)
{
    springls__coder c = springls__reader(block + sizeof springls__snapshot_magic);
    uint32_t version;
    uint64_t bytes, checksum;
    if (memcmp(block, springls__snapshot_magic, sizeof springls__snapshot_magic) != 0) return "no snapshot";
    SPRINGLS__CODE(&c, version);
    SPRINGLS__CODE(&c, *sections);
    SPRINGLS__CODE(&c, bytes);
    SPRINGLS__CODE(&c, checksum);
    if (version != SPRINGLS__SNAPSHOT_VERSION) return "of another version of the format";
    if (bytes != size) return "not as long as it says";
    if (checksum != springls__checksum(bytes, block + SPRINGLS__HEAD_BYTES, size - SPRINGLS__HEAD_BYTES, false)) return "damaged";
    return NULL;
}

/* Returns the section of a tag, for an attribute the first that has no place yet; -1: none. */
SPRINGLS__FN int springls__section_of_tag(const springls__layout *layout, const char *tag)
{
    int row, section;
    for (row = 0; row < SPRINGLS__SECTION_ROWS; row++)
        if (memcmp(springls__section_list[row].tag, tag, 4) == 0) break;
    if (row == SPRINGLS__SECTION_ROWS) return -1;
    section = springls__section_list[row].section;
    while (springls__attribute_of(section) >= 0 && layout->at[section]) section++;
    return section;
}

/* Finds the sections of a block. Those that are unknown and optional are skipped. */
SPRINGLS__FN springls_status springls__find_sections(springls_context *ctx, const char *block, size_t size, uint32_t count,
                                                     springls__layout *layout)
{
    const char *const damaged = "restore: the block is damaged";
    uint64_t at = SPRINGLS__HEAD_BYTES, bytes;
    uint32_t i, flags;
    memset(layout, 0, sizeof *layout);
    for (i = 0; i < count; i++) {
        springls__coder c;
        int section;
        if (size - at < SPRINGLS__SECTION_HEAD_BYTES) return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "%s", damaged);
        c = springls__reader(block + at + 4);
        SPRINGLS__CODE(&c, flags);
        SPRINGLS__CODE(&c, bytes);
        section = springls__section_of_tag(layout, block + at);
        if (section < 0 && !(flags & SPRINGLS__SECTION_OPTIONAL))
            return springls__unknown(ctx, "section", block + at, 4);
        at += SPRINGLS__SECTION_HEAD_BYTES;
        if (bytes > size - at || springls__padded(bytes) > size - at)
            return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "%s", damaged);
        if (section >= 0) {
            if (section >= SPRINGLS__SECTIONS || layout->at[section])
                return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "%s", damaged);
            layout->at[section] = at;
            layout->bytes[section] = bytes;
        }
        at += springls__padded(bytes);
    }
    return at == size ? SPRINGLS_OK : springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "%s", damaged);
}

/* Reads the heads of the attributes. */
SPRINGLS__FN bool springls__entries_read(const springls__layout *layout, const char *block, springls__snapshot_state *s)
{
    int i;
    if (s->attributes < 0 || s->attributes > SPRINGLS_MAX_ATTRIBUTES) return false;
    for (i = 0; i < s->attributes; i++) {
        const int section = SPRINGLS__SECTION_VALUES + i;
        springls__coder c = springls__reader(block + layout->at[section]);
        if (!layout->at[section] || layout->bytes[section] < SPRINGLS__ATTRIBUTE_BYTES) return false;
        springls__code_attribute(&c, &s->attribute[i]);
        if (c.bad) return false;
    }
    return true;
}

/* Reads the numbers of a block, and checks them. */
SPRINGLS__FN springls_status springls__snapshot_numbers_read(springls_context *ctx, const char *block,
                                                             const springls__layout *layout, springls__snapshot_state *s)
{
    const uint64_t *at = layout->at, *bytes = layout->bytes;
    springls__coder c = springls__reader(block + at[SPRINGLS__SECTION_GRID]);
    const char *fault;
    int32_t size[3];
    double to_world[12];
    memset(s, 0, sizeof *s);
    s->params = springls_default_params();
    if (bytes[SPRINGLS__SECTION_GRID] != SPRINGLS__GRID_BYTES || bytes[SPRINGLS__SECTION_NUMBERS] % SPRINGLS__NAMED_BYTES
        || bytes[SPRINGLS__SECTION_PARAMS] % SPRINGLS__NAMED_BYTES)
        return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is damaged");
    springls__code_grid(&c, size, to_world);
    if (c.bad || memcmp(size, ctx->model.grid.size, sizeof size) != 0 || memcmp(to_world, ctx->lattice_to_world, sizeof to_world) != 0)
        return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is of another grid");
    SPRINGLS__TRY(springls__get_named(ctx, springls__snapshot_numbers, SPRINGLS__NUMBERS, block + at[SPRINGLS__SECTION_NUMBERS],
                                      bytes[SPRINGLS__SECTION_NUMBERS], s));
    SPRINGLS__TRY(springls__get_named(ctx, springls__snapshot_params, SPRINGLS__PARAMS_NAMED,
                                      block + at[SPRINGLS__SECTION_PARAMS], bytes[SPRINGLS__SECTION_PARAMS], &s->params));
    fault = springls__entries_read(layout, block, s) ? springls__numbers_fault(ctx, s) : "damaged";
    return fault ? springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is %s", fault) : SPRINGLS_OK;
}

/* Reads the numbers and the layout of a block, and checks all of it. */
SPRINGLS__FN springls_status springls__snapshot_read(springls_context *ctx, const char *block, size_t size,
                                                     springls__snapshot_state *s, springls__layout *layout)
{
    const char *fault;
    uint32_t sections = 0;
    if (size < SPRINGLS__HEAD_BYTES) return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is too short");
    fault = springls__head_fault(block, size, &sections);
    if (fault) return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is %s", fault);
    SPRINGLS__TRY(springls__find_sections(ctx, block, size, sections, layout));
    SPRINGLS__TRY(springls__snapshot_numbers_read(ctx, block, layout, s));
    if (springls__sections_good(&ctx->model.grid, s, layout, block)) return SPRINGLS_OK;
    return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is damaged");
}

/* ---- restoring ---- */

/* Returns the top table of a grid of a block. section: of its runs of bricks inside. count: of its bricks with voxels. */
SPRINGLS__FN springls__table springls__table_of_block(const springls__grid *g, const springls__layout *layout, int section,
                                                      const char *block, int count)
{
    const char *numbers = block + layout->at[section + 1];
    springls__inside_walk walk = springls__walk_inside(g, layout, block, section);
    springls__brick_box box = springls__empty_box();
    int i;
    for (i = 0; i < count; i++) springls__box_add_brick(g, &box, springls__int_at(numbers, (size_t)i), 0);
    while (springls__next_inside(&walk))
        for (i = 0; i < walk.length; i++) springls__box_add_brick(g, &box, walk.first + i, 0);
    return springls__table_for(g, &box);
}

/* Finds the top tables of a block, the model's and, where it has one, that of the reference. */
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
    if (s->neighbors_age >= 0)
        SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_NEIGHBORS, (size_t)s->springls + 1,
                                     ctx->neighbors_age >= 0 ? (size_t)ctx->model.set.count : 0));
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
    return springls__buffer_grow(ctx, &original->source_memory, n + 1, sizeof(int), original->source ? kept * sizeof(int) : 0);
}

/* Replaces the bricks of a grid by those of a block, in slots of their order. section: of its runs of bricks inside. */
SPRINGLS__FN void springls__get_grid(springls__grid *g, const springls__table *table, const springls__layout *layout, int section,
                                     const char *block, int count)
{
    const char *numbers = block + layout->at[section + 1];
    springls__inside_walk walk = springls__walk_inside(g, layout, block, section);
    int i, entries = (int)springls__entries_of(table);
    g->table = *table;
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

/* Initializes what the model's grid keeps of a brick besides phi. calm: a byte each; NULL: zeros. */
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
        if (calm) g->calm[slot] = (uint8_t)calm[i];
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
    /* Clears padding: what a user compares by bytes is equal after a restore. */
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
    for (i = SPRINGLS__SECTION_SET; i <= SPRINGLS__SECTION_NEIGHBORS; i++)
        if (springls__section_of(i)->width) springls__get_array(ctx, s, layout, block, i);
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
    if (!s->has_source) return;
    original->source = (int *)original->source_memory.data;
    springls__get_array(ctx, s, layout, block, SPRINGLS__SECTION_SOURCE);
}

/* Replaces the statistics; the times stay those of the context. */
SPRINGLS__FN void springls__stats_take(springls_stats *stats, const springls__snapshot_state *s)
{
    stats->steps = s->steps;
    stats->added = s->added;
    stats->split = s->split;
    stats->removed = s->removed;
    stats->reshaped = s->reshaped;
    stats->refused = s->refused;
    stats->left = s->left;
    stats->volume_correction = s->volume_correction;
    stats->largest_displacement = s->largest_displacement;
    stats->moving_share = s->moving_share;
}

/* Replaces the numbers of the model, except parameters and attributes, by those of the snapshot. */
SPRINGLS__FN void springls__numbers_take(springls_context *ctx, const springls__snapshot_state *s)
{
    const int window[3] = { s->window_x, s->window_y, s->window_z };
    const int original_window[3] = { s->original_window_x, s->original_window_y, s->original_window_z };
    springls__place_window(ctx, &ctx->window, window);
    springls__place_window(ctx, &ctx->original_window, original_window);
    ctx->model.set.count = s->springls;
    ctx->model.set.at_edges = s->at_edges;
    ctx->model.set.next_id = s->next_id;
    ctx->model.set.step = s->step;
    ctx->time = s->time;
    ctx->iteration = s->iteration;
    ctx->lag = s->lag;
    ctx->away = FLT_MAX;
    ctx->opposed = s->opposed != 0;
    ctx->saved.in_use = false;
    springls__stats_take(&ctx->stats, s);
    ctx->component_count = s->components;
    ctx->event_count = s->events;
    ctx->event_part_count = s->event_parts;
    ctx->last_component_id = s->last_component_id;
    ctx->last_contact_body = s->last_contact_body;
    ctx->components_found = s->components_found != 0;
    ctx->volumes_locked = s->volumes_locked != 0;
    ctx->model.grid.some_asleep = 0;
    springls__constellation_changed(ctx);
    ctx->components_fresh = s->components_fresh != 0;
    ctx->neighbors_age = s->neighbors_age;
    ctx->neighbors_missing = true;
}

SPRINGLS_API springls_status springls_restore(springls_context *ctx, const void *block, size_t size)
{
    springls__snapshot_state s;
    springls__layout layout;
    springls__table tables[2];
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!block) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "restore: the block is NULL");
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
    springls__numbers_take(ctx, &s);
    return SPRINGLS_OK;
}

#endif
