/* snapshot.h - writes and restores all that a model's future depends on, as one block of bytes: a head, a struct of numbers, and
   arrays (springls__section). What can be computed from these (cells, omega, hierarchies) is not in it. Bricks are stored in
   their order, without their slots. springls_restore checks everything and allocates all memory before the model changes. */
#ifndef SPRINGLS__OUTPUT_SNAPSHOT_H
#define SPRINGLS__OUTPUT_SNAPSHOT_H

#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../model/attribute_values.h"
#include "../model/bvh.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "../model/host_access.h"
#include "../model/parameter_sets.h"
#include "../solver/step.h"
#include "../stages/events.h"

/* Bytes of an event without the pointers to its parts. */
#define SPRINGLS__EVENT_BYTES offsetof(springls_event, before)

typedef struct springls__snapshot_head {
    char magic[8];
    uint32_t version, byte_order;
    uint64_t size, checksum;  /* bytes of the block; checksum of all after this head */
} springls__snapshot_head;

static const char springls__snapshot_magic[8] = { 'S', 'P', 'R', 'I', 'N', 'G', 'L', 'S' };
enum { SPRINGLS__SNAPSHOT_VERSION = 3, SPRINGLS__BYTE_ORDER = 0x01020304 };

/* Describes an attribute; the policies are springls_policy. */
typedef struct springls__attribute_entry {
    char name[SPRINGLS_MAX_NAME_LENGTH + 1];
    int32_t channels, split, fill, merge;
} springls__attribute_entry;

/* Holds the numbers of a model and the sizes of its arrays. */
typedef struct springls__snapshot_state {
    double to_world[12], time;
    uint64_t reference_stamp;
    springls_stats stats;
    springls_params params;
    float way;
    int32_t size[3];
    int32_t kind, iteration, count, at_edges, neighbors_age, has_neighbors, bricks;
    int32_t components, events, event_parts;
    uint8_t components_found, components_fresh, volumes_locked, opposed;
    uint32_t next_id, step, last_component_id, last_contact_body;
    int32_t reference_bricks, original, given, has_source;
    int32_t attributes;
    springls__attribute_entry attribute[SPRINGLS_MAX_ATTRIBUTES];
} springls__snapshot_state;

/* Lists the arrays in their order. A new array of the springls extends the first of them (SPRINGLS__ARRAYS). */
typedef enum springls__section {
    SPRINGLS__SECTION_SET, /* one section for each array of the constellation */
    SPRINGLS__SECTION_NEIGHBORS = SPRINGLS__SECTION_SET + SPRINGLS__SPRINGL_ARRAY_COUNT,
    SPRINGLS__SECTION_SIDES,       /* a bit for each brick: 1 is constant and inside  */
    SPRINGLS__SECTION_BRICKS,      /* the numbers of the bricks with voxels           */
    SPRINGLS__SECTION_PHI,
    SPRINGLS__SECTION_COMPONENTS,
    SPRINGLS__SECTION_EVENTS,
    SPRINGLS__SECTION_EVENT_PARTS,
    SPRINGLS__SECTION_VALUES,      /* one section for each attribute                  */
    SPRINGLS__SECTION_REFERENCE_SIDES = SPRINGLS__SECTION_VALUES + SPRINGLS_MAX_ATTRIBUTES,
    SPRINGLS__SECTION_REFERENCE_BRICKS,
    SPRINGLS__SECTION_REFERENCE_PHI,
    SPRINGLS__SECTION_ORIGINAL,
    SPRINGLS__SECTION_SOURCE,
    SPRINGLS__SECTIONS
} springls__section;

/* Holds the offset of each section, bytes; the last one is the size of the block. Sections begin at multiples of 8. */
typedef struct springls__layout { uint64_t at[SPRINGLS__SECTIONS + 1]; } springls__layout;

SPRINGLS__FN uint64_t springls__side_bytes(const springls__grid *g) { return ((uint64_t)springls__brick_count(g) + 7) / 8; }

/* Returns the bytes of a section without padding; 0 when the snapshot has none. */
SPRINGLS__FN uint64_t springls__section_bytes(const springls__grid *g, const springls__snapshot_state *s, int section)
{
    const uint64_t brick = SPRINGLS__BRICK_VOXELS * sizeof(float);
    const bool all = s->kind == SPRINGLS_SNAPSHOT_KIND_ALL;
    int a = section - SPRINGLS__SECTION_VALUES;
    if (section < SPRINGLS__SECTION_NEIGHBORS) return (uint64_t)s->count * springls__element_size((springls__array)section);
    if (a >= 0 && a < SPRINGLS_MAX_ATTRIBUTES)
        return a < s->attributes ? (uint64_t)s->count * (uint64_t)s->attribute[a].channels * sizeof(float) : 0;
    switch (section) {
    case SPRINGLS__SECTION_NEIGHBORS: return s->has_neighbors ? (uint64_t)s->count * SPRINGLS__NEIGHBOR_ROW * sizeof(int) : 0;
    case SPRINGLS__SECTION_SIDES: return springls__side_bytes(g);
    case SPRINGLS__SECTION_BRICKS: return (uint64_t)s->bricks * sizeof(int);
    case SPRINGLS__SECTION_PHI: return (uint64_t)s->bricks * brick;
    case SPRINGLS__SECTION_COMPONENTS: return (uint64_t)s->components * sizeof(springls__component);
    case SPRINGLS__SECTION_EVENTS: return (uint64_t)s->events * SPRINGLS__EVENT_BYTES;
    case SPRINGLS__SECTION_EVENT_PARTS: return (uint64_t)s->event_parts * sizeof(springls_component);
    case SPRINGLS__SECTION_REFERENCE_SIDES: return all ? springls__side_bytes(g) : 0;
    case SPRINGLS__SECTION_REFERENCE_BRICKS: return all ? (uint64_t)s->reference_bricks * sizeof(int) : 0;
    case SPRINGLS__SECTION_REFERENCE_PHI: return all ? (uint64_t)s->reference_bricks * brick : 0;
    case SPRINGLS__SECTION_ORIGINAL: return all ? (uint64_t)s->original * 3 * sizeof(springls__v3) : 0;
    default: return all && s->has_source ? (uint64_t)s->original * sizeof(int) : 0;
    }
}

SPRINGLS__FN springls__layout springls__layout_of(const springls__grid *g, const springls__snapshot_state *s)
{
    springls__layout layout;
    uint64_t at = sizeof(springls__snapshot_head) + (sizeof *s + 7) / 8 * 8;
    int section;
    for (section = 0; section < SPRINGLS__SECTIONS; section++) {
        layout.at[section] = at;
        at += (springls__section_bytes(g, s, section) + 7) / 8 * 8;
    }
    layout.at[SPRINGLS__SECTIONS] = at;
    return layout;
}

/* Computes a checksum in four independent chains of 8-byte words. A change of any one word changes the result. */
SPRINGLS__FN uint64_t springls__checksum(uint64_t seed, const void *data, size_t bytes)
{
    const uint64_t prime = 1099511628211u;
    const char *p = (const char *)data;
    uint64_t chain[4], word;
    size_t i, k;
    for (k = 0; k < 4; k++) chain[k] = seed ^ (14695981039346656037u + k);
    for (i = 0; i + 32 <= bytes; i += 32)
        for (k = 0; k < 4; k++) {
            memcpy(&word, p + i + 8 * k, 8);
            chain[k] = (chain[k] ^ word) * prime;
            chain[k] ^= chain[k] >> 29;
        }
    for (k = 0; i < bytes; i += 8, k++) {
        word = 0;
        memcpy(&word, p + i, bytes - i < 8 ? bytes - i : 8);
        chain[k] = (chain[k] ^ word) * prime;
    }
    for (k = 1; k < 4; k++) chain[0] = (chain[0] ^ chain[k]) * prime + (uint64_t)bytes;
    return chain[0];
}

/* ---- writing ---- */

/* Counts the bricks with voxels. */
SPRINGLS__FN int springls__active_bricks(const springls__grid *g)
{
    int i, n = 0, bricks = (int)springls__brick_count(g);
    for (i = 0; i < bricks; i++) n += g->top[i] >= SPRINGLS__FIRST_SLOT;
    return n;
}

/* Returns a checksum, never 0, of the reference level set and the original surface: a FRAME snapshot, which leaves them out, can
   be restored only where it is the same. */
SPRINGLS__FN uint64_t springls__reference_stamp(springls_context *ctx)
{
    const springls__grid *g = &ctx->model.reference;
    const springls__surface *original = &ctx->original;
    uint64_t stamp = springls__checksum(1, &g->far_value, sizeof g->far_value);
    int i, bricks = (int)springls__brick_count(g);
    if (ctx->reference_stamp) return ctx->reference_stamp;
    for (i = 0; i < bricks; i++) {
        int side = springls__imin(g->top[i], SPRINGLS__FIRST_SLOT);
        if (side == SPRINGLS__OUTSIDE) continue;
        stamp = springls__checksum(stamp, &i, sizeof i);
        stamp = springls__checksum(stamp, &side, sizeof side);
        if (side >= SPRINGLS__FIRST_SLOT)
            stamp = springls__checksum(stamp, g->phi + (size_t)g->top[i] * SPRINGLS__BRICK_VOXELS,
                                       SPRINGLS__BRICK_VOXELS * sizeof(float));
    }
    stamp = springls__checksum(stamp, original->points, 3 * (size_t)original->count * sizeof(springls__v3));
    if (original->source) stamp = springls__checksum(stamp, original->source, (size_t)original->count * sizeof(int));
    return ctx->reference_stamp = stamp | 1u;
}

/* Fills the struct of numbers from the model. */
SPRINGLS__FN void springls__snapshot_numbers(springls_context *ctx, springls_snapshot_kind kind, springls__snapshot_state *s)
{
    int i;
    memset(s, 0, sizeof *s);
    memcpy(s->to_world, ctx->to_world, sizeof s->to_world);
    s->time = ctx->time;
    s->reference_stamp = springls__reference_stamp(ctx);
    s->stats = ctx->stats;
    s->params = ctx->model.params;
    for (i = 0; i < 3; i++) s->size[i] = ctx->model.grid.size[i];
    s->kind = (int32_t)kind;
    s->iteration = ctx->iteration;
    s->way = ctx->way;
    s->opposed = ctx->opposed;
    s->count = ctx->model.set.count;
    s->at_edges = ctx->model.set.at_edges;
    s->neighbors_age = ctx->neighbors_age;
    s->has_neighbors = ctx->neighbors_age >= 0;
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
    s->attributes = ctx->attribute_count;
    for (i = 0; i < s->attributes; i++) {
        const springls__attribute *attribute = &ctx->attributes[i];
        springls__attribute_entry *row = &s->attribute[i];
        memcpy(row->name, attribute->name, strlen(attribute->name));
        row->channels = attribute->channels;
        row->split = (int32_t)attribute->split;
        row->fill = (int32_t)attribute->fill;
        row->merge = (int32_t)attribute->merge;
    }
}

SPRINGLS__FN void springls__put(char *out, const springls__layout *layout, int section, const void *data, uint64_t bytes)
{
    if (bytes) memcpy(out + layout->at[section], data, (size_t)bytes);
}

/* Writes a grid into three sections, the first of which is `sides`: sides, numbers and values of its bricks. */
SPRINGLS__FN void springls__put_grid(char *out, const springls__layout *layout, int sides, const springls__grid *g)
{
    const size_t brick = SPRINGLS__BRICK_VOXELS * sizeof(float);
    char *side = out + layout->at[sides], *numbers = out + layout->at[sides + 1], *values = out + layout->at[sides + 2];
    int i, bricks = (int)springls__brick_count(g);
    memset(side, 0, (size_t)springls__side_bytes(g));
    for (i = 0; i < bricks; i++) {
        if (g->top[i] == SPRINGLS__INSIDE) side[i >> 3] = (char)(side[i >> 3] | 1 << (i & 7));
        if (g->top[i] < SPRINGLS__FIRST_SLOT) continue;
        memcpy(numbers, &i, sizeof i);
        memcpy(values, g->phi + (size_t)g->top[i] * SPRINGLS__BRICK_VOXELS, brick);
        numbers += sizeof i;
        values += brick;
    }
}

/* Writes the reference level set and the original surface. */
SPRINGLS__FN void springls__put_reference(const springls_context *ctx, const springls__snapshot_state *s,
                                          const springls__layout *layout, char *out)
{
    const springls__grid *g = &ctx->model.grid;
    springls__put_grid(out, layout, SPRINGLS__SECTION_REFERENCE_SIDES, &ctx->model.reference);
    springls__put(out, layout, SPRINGLS__SECTION_ORIGINAL, ctx->original.points,
                  springls__section_bytes(g, s, SPRINGLS__SECTION_ORIGINAL));
    springls__put(out, layout, SPRINGLS__SECTION_SOURCE, ctx->original.source,
                  springls__section_bytes(g, s, SPRINGLS__SECTION_SOURCE));
}

/* Writes the events. */
SPRINGLS__FN void springls__put_events(const springls_context *ctx, const springls__layout *layout, char *out)
{
    const springls_event *event = (const springls_event *)ctx->event_memory.data;
    int i;
    out += layout->at[SPRINGLS__SECTION_EVENTS];
    for (i = 0; i < ctx->event_count; i++) memcpy(out + (size_t)i * SPRINGLS__EVENT_BYTES, &event[i], SPRINGLS__EVENT_BYTES);
}

/* Writes the head of a block that is complete but for it. */
SPRINGLS__FN void springls__put_head(char *out, uint64_t size)
{
    springls__snapshot_head head;
    memset(&head, 0, sizeof head);
    memcpy(head.magic, springls__snapshot_magic, sizeof head.magic);
    head.version = SPRINGLS__SNAPSHOT_VERSION;
    head.byte_order = SPRINGLS__BYTE_ORDER;
    head.size = size;
    head.checksum = springls__checksum(size, out + sizeof head, (size_t)(size - sizeof head));
    memcpy(out, &head, sizeof head);
}

/* Writes the block, layout->at[SPRINGLS__SECTIONS] bytes. */
SPRINGLS__FN void springls__snapshot_write(const springls_context *ctx, const springls__snapshot_state *s,
                                           const springls__layout *layout, char *out)
{
    const springls__grid *g = &ctx->model.grid;
    const size_t head = sizeof(springls__snapshot_head);
    int i;
    for (i = 0; i < SPRINGLS__SECTIONS; i++) { /* padding */
        uint64_t end = layout->at[i] + springls__section_bytes(g, s, i);
        memset(out + end, 0, (size_t)(layout->at[i + 1] - end));
    }
    memset(out + head, 0, (size_t)(layout->at[0] - head));
    memcpy(out + head, s, sizeof *s);
    for (i = 0; i < SPRINGLS__SECTION_NEIGHBORS; i++)
        springls__put(out, layout, i, ctx->memory[i].data, springls__section_bytes(g, s, i));
    springls__put(out, layout, SPRINGLS__SECTION_NEIGHBORS, ctx->model.cells.neighbors,
                  springls__section_bytes(g, s, SPRINGLS__SECTION_NEIGHBORS));
    springls__put_grid(out, layout, SPRINGLS__SECTION_SIDES, g);
    springls__put(out, layout, SPRINGLS__SECTION_COMPONENTS, ctx->component_memory.data,
                  springls__section_bytes(g, s, SPRINGLS__SECTION_COMPONENTS));
    springls__put_events(ctx, layout, out);
    springls__put(out, layout, SPRINGLS__SECTION_EVENT_PARTS, ctx->event_part_memory.data,
                  springls__section_bytes(g, s, SPRINGLS__SECTION_EVENT_PARTS));
    for (i = 0; i < s->attributes; i++)
        springls__put(out, layout, SPRINGLS__SECTION_VALUES + i, ctx->attributes[i].values.data,
                      springls__section_bytes(g, s, SPRINGLS__SECTION_VALUES + i));
    if (s->kind == SPRINGLS_SNAPSHOT_KIND_ALL) springls__put_reference(ctx, s, layout, out);
    springls__put_head(out, layout->at[SPRINGLS__SECTIONS]);
}

SPRINGLS_API springls_status springls_snapshot(springls_context *ctx, springls_snapshot_kind kind, void *out,
                                               size_t room, size_t *size)
{
    springls__snapshot_state state;
    springls__layout layout;
    if (size) *size = 0;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!size || (kind != SPRINGLS_SNAPSHOT_KIND_ALL && kind != SPRINGLS_SNAPSHOT_KIND_FRAME))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "snapshot: size is NULL, or there is no kind %d", (int)kind);
    SPRINGLS__TRY(springls__finish_step(ctx));
    springls__end_reading(ctx);
    SPRINGLS__TRY(springls__use_host(ctx, false));
    springls__snapshot_numbers(ctx, kind, &state);
    layout = springls__layout_of(&ctx->model.grid, &state);
    *size = (size_t)layout.at[SPRINGLS__SECTIONS];
    if (*size != layout.at[SPRINGLS__SECTIONS]) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "snapshot: a size overflows");
    if (!out) return SPRINGLS_OK;
    if (room < *size)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "snapshot: %lu bytes are needed, not %lu",
                              (unsigned long)*size, (unsigned long)room);
    springls__snapshot_write(ctx, &state, &layout, (char *)out);
    return SPRINGLS_OK;
}

/* ---- checking ---- */

/* Returns element i of a section, which need not be aligned. */
SPRINGLS__FN int springls__int_at(const char *data, size_t i)
{
    int value;
    memcpy(&value, data + i * sizeof value, sizeof value);
    return value;
}

/* Returns whether all floats are finite. */
SPRINGLS__FN bool springls__all_finite(const char *data, uint64_t bytes)
{
    uint64_t i;
    uint32_t bits, bad = 0;
    for (i = 0; i + 4 <= bytes; i += 4) {
        memcpy(&bits, data + i, 4);
        bad |= (uint32_t)((bits & 0x7f800000u) == 0x7f800000u);
    }
    return !bad;
}

/* Returns whether all ints lie in [low, high]. */
SPRINGLS__FN bool springls__all_between(const char *data, uint64_t bytes, int low, int high)
{
    uint64_t i;
    bool good = true;
    for (i = 0; i < bytes / sizeof(int); i++) {
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

/* Returns whether the numbers of the bricks with voxels ascend, exist, and are not marked as constant. */
SPRINGLS__FN bool springls__bricks_good(const char *sides, const char *numbers, int count, size_t bricks)
{
    int i, last = -1;
    for (i = 0; i < count; i++) {
        int brick = springls__int_at(numbers, (size_t)i);
        if (brick <= last || (size_t)brick >= bricks || (sides[brick >> 3] >> (brick & 7) & 1)) return false;
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
    return springls__policy_known((springls_policy)a->split) && springls__policy_known((springls_policy)a->fill)
        && springls__policy_known((springls_policy)a->merge);
}

/* Returns whether each number alone, and those that depend on each other, can be those of a model. */
SPRINGLS__FN bool springls__numbers_in_range(const springls__snapshot_state *s)
{
    const int furthest = INT32_MAX / 2; /* counters that will grow */
    if (springls__params_fault(&s->params) || !(s->time > -DBL_MAX && s->time < DBL_MAX)) return false;
    if (s->count < 0 || s->count > INT32_MAX / 3 - 1 || s->at_edges < 0 || s->at_edges > s->count) return false;
    if (!(s->way >= 0.0f)) return false;
    if (s->iteration < 0 || s->iteration > furthest || s->stats.steps < 0 || s->stats.steps > furthest) return false;
    if (s->neighbors_age < -1 || s->neighbors_age > furthest || s->has_neighbors != (s->neighbors_age >= 0)) return false;
    if (s->components < 0 || s->events < 0 || s->event_parts < 0) return false;
    if (s->original < 0 || s->bricks < 0 || s->reference_bricks < 0) return false;
    if (s->given < s->original || s->given > INT32_MAX / 3 || (!s->has_source && s->given != s->original)) return false;
    if (s->attributes < 0 || s->attributes > SPRINGLS_MAX_ATTRIBUTES || s->has_source < 0 || s->has_source > 1) return false;
    return (uint32_t)s->count <= s->next_id && s->step <= 0x3fffffffu;
}

/* Returns why the numbers cannot be those of a model of this context, as the end of "the block is ..."; NULL: they can. */
SPRINGLS__FN const char *springls__numbers_fault(springls_context *ctx, const springls__snapshot_state *s)
{
    int i;
    if (s->kind != SPRINGLS_SNAPSHOT_KIND_ALL && s->kind != SPRINGLS_SNAPSHOT_KIND_FRAME) return "of an unknown kind";
    if (memcmp(s->size, ctx->model.grid.size, sizeof s->size) != 0
        || memcmp(s->to_world, ctx->to_world, sizeof s->to_world) != 0)
        return "of another grid";
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
    static const uint64_t flags = SPRINGLS__BIT(MASK) | SPRINGLS__BIT(EDGE);
    if (floats >> array & 1u) return springls__all_finite(data, bytes);
    if (flags >> array & 1u) return springls__all_flags(data, bytes);
    return true;
}

/* Returns whether the components have ascending ids, finite volumes, and voxels of the domain. */
SPRINGLS__FN bool springls__components_good(const springls__grid *g, const springls__snapshot_state *s, const char *data)
{
    springls__component c;
    uint32_t before = 0;
    int i;
    for (i = 0; i < s->components; i++) {
        memcpy(&c, data + (size_t)i * sizeof c, sizeof c);
        if (c.view.id <= before || c.view.id > s->last_component_id) return false;
        if (!(c.target >= -DBL_MAX && c.target <= DBL_MAX && c.view.volume >= -DBL_MAX && c.view.volume <= DBL_MAX)) return false;
        if (!springls__grid_contains(g, c.deepest[0], c.deepest[1], c.deepest[2])) return false;
        before = c.view.id;
    }
    return true;
}

/* Returns whether the events have as many parts as there are. */
SPRINGLS__FN bool springls__events_good(const springls__snapshot_state *s, const char *data)
{
    springls_event event;
    int64_t parts = 0;
    int i;
    for (i = 0; i < s->events; i++) {
        memcpy(&event, data + (size_t)i * SPRINGLS__EVENT_BYTES, SPRINGLS__EVENT_BYTES);
        if (event.before_count < 0 || event.after_count < 0) return false;
        parts += (int64_t)event.before_count + event.after_count;
    }
    return parts == s->event_parts;
}

/* Returns whether a section has valid elements. */
SPRINGLS__FN bool springls__section_good(const springls__grid *g, const springls__snapshot_state *s,
                                         const springls__layout *layout, const char *block, int section)
{
    const char *data = block + layout->at[section];
    const uint64_t bytes = springls__section_bytes(g, s, section);
    if (section < SPRINGLS__SECTION_NEIGHBORS) return springls__springl_array_good(section, data, bytes);
    if (section >= SPRINGLS__SECTION_VALUES && section < SPRINGLS__SECTION_REFERENCE_SIDES)
        return true; /* sums of SPRINGLS_POLICY_SHARE may have overflowed, and nothing else depends on attributes */
    switch (section) {
    case SPRINGLS__SECTION_NEIGHBORS: return springls__all_between(data, bytes, -1, 3 * s->count - 1);
    case SPRINGLS__SECTION_SIDES:
    case SPRINGLS__SECTION_REFERENCE_SIDES: return true;
    case SPRINGLS__SECTION_BRICKS:
        return springls__bricks_good(block + layout->at[section - 1], data, s->bricks, springls__brick_count(g));
    case SPRINGLS__SECTION_REFERENCE_BRICKS:
        return !bytes
            || springls__bricks_good(block + layout->at[section - 1], data, s->reference_bricks, springls__brick_count(g));
    case SPRINGLS__SECTION_COMPONENTS: return springls__components_good(g, s, data);
    case SPRINGLS__SECTION_EVENTS: return springls__events_good(s, data);
    case SPRINGLS__SECTION_EVENT_PARTS: return true; /* nothing depends on them */
    case SPRINGLS__SECTION_SOURCE:
        return springls__all_between(data, bytes, 0, s->given <= INT32_MAX / 2 ? 2 * s->given - 1 : INT32_MAX);
    default: return springls__all_finite(data, bytes);
    }
}

SPRINGLS__FN bool springls__arrays_good(const springls__grid *g, const springls__snapshot_state *s,
                                        const springls__layout *layout, const char *block)
{
    int section;
    for (section = 0; section < SPRINGLS__SECTIONS; section++)
        if (!springls__section_good(g, s, layout, block, section)) return false;
    return true;
}

/* Returns why a block cannot be a snapshot that this machine has written, as the end of "the block is ..."; NULL: it can. */
SPRINGLS__FN const char *springls__head_fault(const char *block, size_t size)
{
    springls__snapshot_head head;
    memcpy(&head, block, sizeof head);
    if (memcmp(head.magic, springls__snapshot_magic, sizeof head.magic) != 0) return "no snapshot";
    if (head.version != SPRINGLS__SNAPSHOT_VERSION || head.byte_order != SPRINGLS__BYTE_ORDER)
        return "of another version or machine";
    if (head.size != size) return "not as long as it says";
    if (head.checksum != springls__checksum(head.size, block + sizeof head, size - sizeof head)) return "damaged";
    return NULL;
}

/* Reads the numbers and the layout of a block, and checks all of it. */
SPRINGLS__FN springls_status springls__snapshot_read(springls_context *ctx, const char *block, size_t size,
                                                     springls__snapshot_state *s, springls__layout *layout)
{
    const springls__grid *g = &ctx->model.grid;
    const char *fault;
    if (size < sizeof(springls__snapshot_head) + sizeof *s)
        return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is too short");
    memcpy(s, block + sizeof(springls__snapshot_head), sizeof *s);
    fault = springls__head_fault(block, size);
    if (!fault) fault = springls__numbers_fault(ctx, s);
    if (!fault) {
        *layout = springls__layout_of(g, s);
        if (layout->at[SPRINGLS__SECTIONS] != size || !springls__arrays_good(g, s, layout, block)) fault = "damaged";
    }
    return fault ? springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block is %s", fault) : SPRINGLS_OK;
}

/* ---- restoring ---- */

/* Grows all memory of the context to what the snapshot needs; the model stays as it is. */
SPRINGLS__FN springls_status springls__snapshot_reserve(springls_context *ctx, const springls__snapshot_state *s)
{
    springls__surface *original = &ctx->original;
    size_t n = (size_t)s->original, kept = (size_t)original->count;
    int i;
    SPRINGLS__TRY(springls__constellation_reserve(ctx, springls__imax(s->count, ctx->model.set.count)));
    if (s->has_neighbors)
        SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_NEIGHBORS, (size_t)s->count + 1,
                                     ctx->neighbors_age >= 0 ? (size_t)ctx->model.set.count : 0));
    SPRINGLS__TRY(springls__grid_reserve(ctx, springls__imax(SPRINGLS__FIRST_SLOT + s->bricks, ctx->model.grid.slot_count)));
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
        SPRINGLS__TRY(springls__buffer_grow(ctx, values, (size_t)springls__imax(s->count, 1), row, used));
    }
    if (s->kind == SPRINGLS_SNAPSHOT_KIND_FRAME) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_PHI,
                                 (size_t)(SPRINGLS__FIRST_SLOT + s->reference_bricks),
                                 (size_t)ctx->model.reference.slot_count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, bvh_items, n));
    SPRINGLS__TRY(springls__surface_room(ctx, original, n + 1, kept));
    return springls__buffer_grow(ctx, &original->source_memory, n + 1, sizeof(int), original->source ? kept * sizeof(int) : 0);
}

/* Replaces the bricks of a grid by those of three sections, the first of which is `sides`, in slots of their order. */
SPRINGLS__FN void springls__get_grid(springls__grid *g, const springls__layout *layout, int sides, const char *block, int count)
{
    const char *side = block + layout->at[sides], *numbers = block + layout->at[sides + 1];
    int i, bricks = (int)springls__brick_count(g);
    for (i = 0; i < bricks; i++) g->top[i] = side[i >> 3] >> (i & 7) & 1 ? SPRINGLS__INSIDE : SPRINGLS__OUTSIDE;
    for (i = 0; i < count; i++) g->top[springls__int_at(numbers, (size_t)i)] = SPRINGLS__FIRST_SLOT + i;
    memcpy(g->phi + SPRINGLS__FIRST_SLOT * SPRINGLS__BRICK_VOXELS, block + layout->at[sides + 2],
           (size_t)count * SPRINGLS__BRICK_VOXELS * sizeof(float));
    g->slot_count = SPRINGLS__FIRST_SLOT + count;
    g->free_count = 0;
}

/* Initializes what the model's grid keeps of a brick besides phi. */
SPRINGLS__FN void springls__fresh_slots(springls_context *ctx, const char *numbers, int count)
{
    springls__grid *g = &ctx->model.grid;
    int i;
    for (i = 0; i < count; i++) {
        int slot = SPRINGLS__FIRST_SLOT + i;
        g->active[i] = slot;
        g->slot_brick[slot] = springls__int_at(numbers, (size_t)i);
        springls__fill(g->omega, slot, -1.0f); /* unknown */
    }
    memcpy(g->phi_next, g->phi, (size_t)g->slot_count * SPRINGLS__BRICK_VOXELS * sizeof(float));
    memset(g->cell, 0, (size_t)g->slot_count * SPRINGLS__CELLS * sizeof *g->cell);
    g->active_count = count;
}

/* Copies section `section` into memory that is large enough. */
SPRINGLS__FN void springls__get(void *to, const springls__grid *g, const springls__snapshot_state *s,
                                const springls__layout *layout, const char *block, int section)
{
    uint64_t bytes = springls__section_bytes(g, s, section);
    if (bytes) memcpy(to, block + layout->at[section], (size_t)bytes);
}

/* Replaces the attributes by those of the snapshot. */
SPRINGLS__FN void springls__get_attributes(springls_context *ctx, const springls__snapshot_state *s,
                                           const springls__layout *layout, const char *block)
{
    int i;
    for (i = 0; i < s->attributes; i++) {
        springls__attribute *attribute = &ctx->attributes[i];
        const springls__attribute_entry *entry = &s->attribute[i];
        memcpy(attribute->name, entry->name, sizeof entry->name);
        attribute->channels = entry->channels;
        attribute->split = (springls_policy)entry->split;
        attribute->fill = (springls_policy)entry->fill;
        attribute->merge = (springls_policy)entry->merge;
        springls__get(attribute->values.data, &ctx->model.grid, s, layout, block, SPRINGLS__SECTION_VALUES + i);
    }
    ctx->attribute_count = s->attributes;
}

/* Replaces the arrays of the model and its attributes by those of the snapshot. Precondition: springls__snapshot_reserve. */
SPRINGLS__FN void springls__snapshot_take(springls_context *ctx, const springls__snapshot_state *s,
                                          const springls__layout *layout, const char *block)
{
    const springls__grid *g = &ctx->model.grid;
    int i;
    for (i = 0; i < SPRINGLS__SECTION_NEIGHBORS; i++) springls__get(ctx->memory[i].data, g, s, layout, block, i);
    springls__get(ctx->model.cells.neighbors, g, s, layout, block, SPRINGLS__SECTION_NEIGHBORS);
    springls__get(ctx->component_memory.data, g, s, layout, block, SPRINGLS__SECTION_COMPONENTS);
    for (i = 0; i < s->events; i++)
        memcpy((springls_event *)ctx->event_memory.data + i,
               block + layout->at[SPRINGLS__SECTION_EVENTS] + (size_t)i * SPRINGLS__EVENT_BYTES, SPRINGLS__EVENT_BYTES);
    springls__get(ctx->event_part_memory.data, g, s, layout, block, SPRINGLS__SECTION_EVENT_PARTS);
    springls__get_grid(&ctx->model.grid, layout, SPRINGLS__SECTION_SIDES, block, s->bricks);
    springls__fresh_slots(ctx, block + layout->at[SPRINGLS__SECTION_BRICKS], s->bricks);
    springls__get_attributes(ctx, s, layout, block);
}

/* Copies the reference level set and the original surface, and builds its hierarchy. */
SPRINGLS__FN void springls__original_take(springls_context *ctx, const springls__snapshot_state *s,
                                          const springls__layout *layout, const char *block)
{
    springls__surface *original = &ctx->original;
    springls__grid_constants(ctx, &ctx->model.reference);
    ctx->reference_stamp = 0;
    springls__get_grid(&ctx->model.reference, layout, SPRINGLS__SECTION_REFERENCE_SIDES, block, s->reference_bricks);
    springls__surface_forget(original);
    if (s->original == 0) return;
    springls__get(original->points, &ctx->model.grid, s, layout, block, SPRINGLS__SECTION_ORIGINAL);
    springls__surface_finish(ctx, original, s->original);
    original->given = s->given;
    if (!s->has_source) return;
    original->source = (int *)original->source_memory.data;
    springls__get(original->source, &ctx->model.grid, s, layout, block, SPRINGLS__SECTION_SOURCE);
}

/* Replaces the numbers of the model, except parameters and attributes, by those of the snapshot. */
SPRINGLS__FN void springls__numbers_take(springls_context *ctx, const springls__snapshot_state *s)
{
    ctx->model.set.count = s->count;
    ctx->model.set.at_edges = s->at_edges;
    ctx->model.set.next_id = s->next_id;
    ctx->model.set.step = s->step;
    ctx->time = s->time;
    ctx->iteration = s->iteration;
    ctx->way = s->way;
    ctx->opposed = s->opposed != 0;
    ctx->held.in_use = false;
    ctx->stats = s->stats;
    ctx->component_count = s->components;
    ctx->event_count = s->events;
    ctx->event_part_count = s->event_parts;
    ctx->last_component_id = s->last_component_id;
    ctx->last_contact_body = s->last_contact_body;
    ctx->components_found = s->components_found != 0;
    ctx->volumes_locked = s->volumes_locked != 0;
    springls__constellation_changed(ctx);
    ctx->components_fresh = s->components_fresh != 0;
    ctx->neighbors_age = s->neighbors_age;
}

SPRINGLS_API springls_status springls_restore(springls_context *ctx, const void *block, size_t size)
{
    springls__snapshot_state s;
    springls__layout layout;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!block) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "restore: the block is NULL");
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__snapshot_read(ctx, (const char *)block, size, &s, &layout));
    SPRINGLS__TRY(springls__snapshot_reserve(ctx, &s));
    springls__abandon_step(ctx);
    springls__discard_device_copies(ctx);
    ctx->model.params = s.params;
    springls__model_constants(ctx);
    springls__snapshot_take(ctx, &s, &layout, (const char *)block);
    if (s.kind == SPRINGLS_SNAPSHOT_KIND_ALL) springls__original_take(ctx, &s, &layout, (const char *)block);
    springls__numbers_take(ctx, &s);
    return SPRINGLS_OK;
}

#endif
