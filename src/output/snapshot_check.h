/* snapshot_check.h - reads the numbers and the layout of a snapshot, and checks every byte that a model depends on, before the
   model changes: a block may come from anywhere. */
#ifndef SPRINGLS__OUTPUT_SNAPSHOT_CHECK_H
#define SPRINGLS__OUTPUT_SNAPSHOT_CHECK_H

#include "../runtime/finite.h"
#include "snapshot.h"

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
    int i = 0, end = 0; /* behind the last brick that has been found */
    bool more = true;
    while (more) {
        int first;
        more = springls__next_inside(&walk);
        first = more ? walk.first : bricks;
        for (; i < count && springls__int_at(numbers, (size_t)i) < first; i++) {
            if (springls__int_at(numbers, (size_t)i) < end) return false;
            end = springls__int_at(numbers, (size_t)i) + 1;
        }
        if (more && (first < end || walk.length < 1 || walk.length > bricks - first)) return false;
        if (more) end = first + walk.length;
    }
    return i == count;
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

SPRINGLS__FN bool springls__flag_good(int32_t flag) { return flag == 0 || flag == 1; }

/* Returns whether a window can be there. */
SPRINGLS__FN bool springls__offset_good(int32_t x, int32_t y, int32_t z)
{
    const int32_t limit = SPRINGLS__FURTHEST_WINDOW;
    return x >= -limit && x <= limit && y >= -limit && y <= limit && z >= -limit && z <= limit && x % SPRINGLS__BRICK == 0
        && y % SPRINGLS__BRICK == 0 && z % SPRINGLS__BRICK == 0;
}

/* Returns whether a model can have these numbers: each number by itself, and numbers that depend on each other together. */
SPRINGLS__FN bool springls__numbers_in_range(const springls__snapshot_state *s)
{
    const int furthest = INT32_MAX / 2; /* counters that will grow */
    if (springls__params_fault(&s->params) || !springls__finite(s->time)) return false;
    if (s->springls < 0 || s->springls > INT32_MAX / 3 - 1) return false;
    if (s->at_edges < 0 || s->at_edges > INT32_MAX / 3 - 1) return false; /* some may have been removed since they were counted */
    if (s->iteration < 0 || s->iteration > furthest || s->steps < 0 || s->steps > furthest) return false;
    if (s->neighbors_age < -1 || s->neighbors_age > furthest || s->neighbors_uses < 0) return false;
    if (s->neighbors < 0 || s->neighbors > (s->neighbors_uses ? (int64_t)s->springls * SPRINGLS__NEIGHBOR_ROW : 0)) return false;
    if (s->components < 0 || s->events < 0 || s->event_parts < 0 || s->new_events < 0 || s->new_events > s->events) return false;
    if (s->original < 0 || s->bricks < 0 || s->reference_bricks < 0) return false;
    if (s->inside_runs < 0 || s->reference_inside_runs < 0) return false;
    if (s->original_tools < 0 || s->original_tools > s->original) return false;
    if (s->given < s->original || s->given > INT32_MAX / 3 || (!s->has_source && s->given != s->original)) return false;
    if (!springls__flag_good(s->neighbors_missing) || !springls__flag_good(s->has_source) || !springls__flag_good(s->components_found)
        || !springls__flag_good(s->components_fresh)) return false;
    if (springls__is_nan_float(s->lag) || s->lag < 0.0f) return false;
    if (springls__is_nan_float(s->lag_turned) || s->lag_turned < 0.0f || !springls__flag_good(s->opposed)) return false;
    if (!springls__offset_good(s->window_x, s->window_y, s->window_z)
        || !springls__offset_good(s->original_window_x, s->original_window_y, s->original_window_z)) return false;
    if (!springls__flag_good(s->volumes_locked)) return false;
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
        if (!springls__finite(component.target) || !springls__finite(component.view.volume)) return false;
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

/* Returns whether the neighbor lists have as many edges as their counts, of springls that there are. */
SPRINGLS__FN bool springls__neighbors_good(const springls__snapshot_state *s, const springls__layout *layout, const char *block)
{
    const uint8_t *count = (const uint8_t *)block + layout->at[SPRINGLS__SECTION_NEIGHBOR_COUNTS];
    int64_t edges = 0;
    int i, m;
    for (i = 0; i < s->springls; i++)
        for (m = 0; m < 3; m++, count++)
            if (*count <= SPRINGLS__MAX_NEIGHBORS) edges += *count;
            else if (m > 0 || *count != SPRINGLS__COUNT_NOT_FOUND) return false;
    return edges == s->neighbors
        && springls__all_between(block + layout->at[SPRINGLS__SECTION_NEIGHBOR_EDGES], (uint64_t)edges * sizeof(int32_t), 0,
                                 3 * s->springls - 1);
}

/* Returns whether an older block's rows of neighbors name springls that there are. If none were found yet, the rest of a row may be
   anything: older versions left it as it was in memory. */
SPRINGLS__FN bool springls__neighbor_rows_good(const springls__snapshot_state *s, const char *data)
{
    const size_t row = SPRINGLS__NEIGHBOR_ROW;
    int i;
    for (i = 0; i < s->springls; i++)
        if (springls__int_at(data, row * (size_t)i) != SPRINGLS__NOT_FOUND
            && !springls__all_between(data + row * (size_t)i * sizeof(int32_t), row * sizeof(int32_t), -1, 3 * s->springls - 1))
            return false;
    return true;
}

/* Returns whether the first triangles of tools ascend, and are there. */
SPRINGLS__FN bool springls__tools_good(const springls__snapshot_state *s, const char *data)
{
    int i, before = 0;
    for (i = 0; i < s->original_tools; i++) {
        const int first = springls__int_at(data, (size_t)i);
        if (first <= before || first >= s->original) return false;
        before = first;
    }
    return true;
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
    case SPRINGLS__SECTION_NEIGHBOR_EDGES: /* checked with their counts */
    case SPRINGLS__SECTION_BRICK_CALM:
    case SPRINGLS__SECTION_CALM: return true;
    case SPRINGLS__SECTION_NEIGHBORS: return springls__neighbor_rows_good(s, data);
    case SPRINGLS__SECTION_NEIGHBOR_COUNTS: return springls__neighbors_good(s, layout, block);
    case SPRINGLS__SECTION_COMPONENTS: return springls__components_good(g, s, data);
    case SPRINGLS__SECTION_EVENTS: return springls__events_good(s, data);
    case SPRINGLS__SECTION_EVENT_PARTS: return springls__event_parts_good(s, data);
    case SPRINGLS__SECTION_TOOLS: return springls__tools_good(s, data);
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

/* Returns why a block that begins with `magic` cannot be a snapshot, as the end of "the block is ..."; NULL: it can. */
SPRINGLS__FN const char *springls__head_fault(const char magic[8], const char *block, size_t size, uint32_t *sections)
{
    springls__coder c = springls__reader(block + sizeof springls__snapshot_magic);
    uint32_t version = 0;
    uint64_t bytes = 0, checksum = 0;
    if (memcmp(block, magic, sizeof springls__snapshot_magic) != 0) return "no snapshot";
    SPRINGLS__CODE(&c, version);
    SPRINGLS__CODE(&c, *sections);
    SPRINGLS__CODE(&c, bytes);
    SPRINGLS__CODE(&c, checksum);
    if (version != SPRINGLS__SNAPSHOT_VERSION) return "of another version of the format";
    if (bytes != size) return "not as long as its header has it";
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

/* Finds the sections of a block. Those that are unknown and optional, or have no data, are as if they were not there. */
SPRINGLS__FN springls_status springls__find_sections(springls_context *ctx, const char *block, size_t size, uint32_t count,
                                                     springls__layout *layout)
{
    const char *const damaged = "restore: the block is damaged";
    uint64_t at = SPRINGLS__HEAD_BYTES, bytes = 0;
    uint32_t i, flags = 0;
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
        if (section >= 0 && bytes > 0) {
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
    s->components_fresh = 1; /* of all blocks but some old ones */
    if (bytes[SPRINGLS__SECTION_GRID] != SPRINGLS__GRID_BYTES || bytes[SPRINGLS__SECTION_NUMBERS] % SPRINGLS__NAMED_BYTES
        || bytes[SPRINGLS__SECTION_PARAMS] % SPRINGLS__NAMED_BYTES)
        return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is damaged");
    springls__code_grid(&c, size, to_world);
    if (c.bad || memcmp(size, ctx->model.grid.size, sizeof size) != 0
        || memcmp(to_world, ctx->lattice_to_world, sizeof to_world) != 0)
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
    fault = springls__head_fault(springls__snapshot_magic, block, size, &sections);
    if (fault) return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is %s", fault);
    SPRINGLS__TRY(springls__find_sections(ctx, block, size, sections, layout));
    SPRINGLS__TRY(springls__snapshot_numbers_read(ctx, block, layout, s));
    if (springls__sections_good(&ctx->model.grid, s, layout, block)) return SPRINGLS_OK;
    return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is damaged");
}

#endif
