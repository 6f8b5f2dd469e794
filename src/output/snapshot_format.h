/* snapshot_format.h - the bytes of a snapshot (docs/snapshot-format.md): a head, then sections with a tag each. Numbers are
   little-endian on every machine, and no struct of the compiler is copied: one text writes and reads each record, field by
   field. */
#ifndef SPRINGLS__OUTPUT_SNAPSHOT_FORMAT_H
#define SPRINGLS__OUTPUT_SNAPSHOT_FORMAT_H

#include "../model/attribute_values.h"
#include "../model/grid.h"
#include "../model/parameter_sets.h"
#include "../runtime/arrays.h"
#include "../stages/events.h"
#include "../../kernels_embed/model/neighbors.h"

enum { SPRINGLS__SNAPSHOT_VERSION = 1 };

/* Bytes of a head, a section's head, a named number, and of the records below. */
enum {
    SPRINGLS__HEAD_BYTES = 32,
    SPRINGLS__SECTION_HEAD_BYTES = 16,
    SPRINGLS__NAME_BYTES = 24,
    SPRINGLS__NAMED_BYTES = SPRINGLS__NAME_BYTES + 8,
    SPRINGLS__GRID_BYTES = 16 + 12 * 8,
    SPRINGLS__SPRINGL_BYTES = 12 * 4,
    SPRINGLS__ATTRIBUTE_BYTES = SPRINGLS_MAX_NAME_LENGTH + 1 + 4 * 4,
    SPRINGLS__PART_BYTES = 40,
    SPRINGLS__COMPONENT_BYTES = SPRINGLS__PART_BYTES + 24,
    SPRINGLS__EVENT_BYTES = 40
};

static const char springls__snapshot_magic[8] = { 's', 'p', 'r', 'i', 'n', 'g', 'l', 's' };
static const char springls__tiling_magic[8] = { 's', 'p', 'r', 't', 'i', 'l', 'e', 's' }; /* of many models (tiling_snapshot.h) */

/* ---- bytes of numbers ---- */

SPRINGLS__FN bool springls__little_endian(void)
{
    const uint32_t one = 1;
    unsigned char first;
    memcpy(&first, &one, 1);
    return first == 1;
}

/* Copies numbers of `width` bytes from memory into a block, or back. */
SPRINGLS__FN void springls__copy_numbers(void *to, const void *from, size_t count, size_t width)
{
    size_t i, k;
    if (count == 0) return;
    if (width == 1 || springls__little_endian()) {
        memcpy(to, from, count * width);
        return;
    }
    for (i = 0; i < count; i++)
        for (k = 0; k < width; k++) ((char *)to)[i * width + k] = ((const char *)from)[(i + 1) * width - 1 - k];
}

/* Returns 32-bit number i of a block's section, which need not be aligned. */
SPRINGLS__FN int32_t springls__int_at(const char *data, size_t i)
{
    int32_t value;
    springls__copy_numbers(&value, data + i * sizeof value, 1, sizeof value);
    return value;
}

/* Returns up to 8 bytes as one word: of a block, or (numbers) of 32-bit numbers in memory as a block has them. */
SPRINGLS__FN uint64_t springls__word_of(const char *data, size_t bytes, bool numbers)
{
    char word[8] = { 0, 0, 0, 0, 0, 0, 0, 0 };
    uint64_t value;
    if (numbers) springls__copy_numbers(word, data, bytes / 4, 4);
    else memcpy(word, data, bytes);
    springls__copy_numbers(&value, word, 1, sizeof value);
    return value;
}

/* Computes a checksum in four independent chains of 8-byte words. A change of any one word changes the result. */
SPRINGLS__FN uint64_t springls__checksum(uint64_t seed, const void *data, size_t bytes, bool numbers)
{
    const uint64_t prime = 1099511628211u;
    const char *p = (const char *)data;
    uint64_t chain[4];
    size_t i, k;
    for (k = 0; k < 4; k++) chain[k] = seed ^ (14695981039346656037u + k);
    for (i = 0; i + 32 <= bytes; i += 32)
        for (k = 0; k < 4; k++) {
            chain[k] = (chain[k] ^ springls__word_of(p + i + 8 * k, 8, numbers)) * prime;
            chain[k] ^= chain[k] >> 29;
        }
    for (k = 0; i < bytes; i += 8, k++)
        chain[k] = (chain[k] ^ springls__word_of(p + i, bytes - i < 8 ? bytes - i : 8, numbers)) * prime;
    for (k = 1; k < 4; k++) chain[0] = (chain[0] ^ chain[k]) * prime + (uint64_t)bytes;
    return chain[0];
}

/* ---- records ---- */

/* Writes a block, or reads it: `in` is NULL or `out` is. bad: what has been read cannot be. */
typedef struct springls__coder { char *out; const char *in; bool bad; } springls__coder;

SPRINGLS__FN springls__coder springls__writer(char *out)
{
    springls__coder c;
    c.out = out;
    c.in = NULL;
    c.bad = false;
    return c;
}

SPRINGLS__FN springls__coder springls__reader(const char *in)
{
    springls__coder c;
    c.out = NULL;
    c.in = in;
    c.bad = false;
    return c;
}

/* Copies numbers of `width` bytes from memory into the block, or from the block into memory. */
SPRINGLS__FN void springls__code(springls__coder *c, void *numbers, size_t count, size_t width)
{
    if (c->in) {
        springls__copy_numbers(numbers, c->in, count, width);
        c->in += count * width;
    } else {
        springls__copy_numbers(c->out, numbers, count, width);
        c->out += count * width;
    }
}

#define SPRINGLS__CODE(coder, number) springls__code(coder, &(number), 1, sizeof(number))

/* Codes an integer that lies in 0 .. last. */
SPRINGLS__FN void springls__code_choice(springls__coder *c, int32_t *value, int32_t last)
{
    SPRINGLS__CODE(c, *value);
    if (*value >= 0 && *value <= last) return;
    c->bad = true;
    *value = 0;
}

SPRINGLS__FN void springls__code_bool(springls__coder *c, bool *value)
{
    int32_t number = c->in ? 0 : *value;
    springls__code_choice(c, &number, 1);
    *value = number == 1;
}

SPRINGLS__FN void springls__code_zeros(springls__coder *c, size_t bytes)
{
    if (c->in) {
        c->in += bytes;
    } else {
        memset(c->out, 0, bytes);
        c->out += bytes;
    }
}

/* SPRINGLS__PART_BYTES. */
SPRINGLS__FN void springls__code_part(springls__coder *c, springls_component *part)
{
    SPRINGLS__CODE(c, part->id);
    springls__code_bool(c, &part->cavity);
    SPRINGLS__CODE(c, part->volume);
    SPRINGLS__CODE(c, part->area);
    springls__code(c, part->center, 3, sizeof(float));
    SPRINGLS__CODE(c, part->correction);
}

/* SPRINGLS__COMPONENT_BYTES. */
SPRINGLS__FN void springls__code_component(springls__coder *c, springls__component *component)
{
    springls__code_part(c, &component->view);
    SPRINGLS__CODE(c, component->target);
    springls__code(c, component->deepest, 3, sizeof(int32_t));
    springls__code_zeros(c, 4);
}

/* SPRINGLS__EVENT_BYTES; the parts are apart. */
SPRINGLS__FN void springls__code_event(springls__coder *c, springls_event *event)
{
    int32_t kind = c->in ? 0 : (int32_t)event->kind;
    SPRINGLS__CODE(c, event->time);
    springls__code(c, event->place, 3, sizeof(float));
    SPRINGLS__CODE(c, event->step);
    springls__code_choice(c, &kind, (int32_t)SPRINGLS_EVENT_KIND_DEATH);
    event->kind = (springls_event_kind)kind;
    springls__code_bool(c, &event->cavity);
    SPRINGLS__CODE(c, event->before_count);
    SPRINGLS__CODE(c, event->after_count);
}

/* SPRINGLS__SPRINGL_BYTES: triangle and particle; the other members follow from these. */
SPRINGLS__FN void springls__code_springl(springls__coder *c, springls__springl *s)
{
    springls__code(c, s, 12, sizeof(float));
    if (c->in) *s = springls__springl_finished(*s);
}

/* SPRINGLS__GRID_BYTES: size, width of a brick, place in the world. */
SPRINGLS__FN void springls__code_grid(springls__coder *c, int32_t *size, double *to_world)
{
    int32_t brick = SPRINGLS__BRICK;
    springls__code(c, size, 3, sizeof(int32_t));
    SPRINGLS__CODE(c, brick);
    springls__code(c, to_world, 12, sizeof(double));
    if (brick != SPRINGLS__BRICK) c->bad = true;
}

/* Describes an attribute; the policies are springls_policy. */
typedef struct springls__attribute_entry {
    char name[SPRINGLS_MAX_NAME_LENGTH + 1];
    int32_t channels, split, fill, merge;
} springls__attribute_entry;

/* SPRINGLS__ATTRIBUTE_BYTES; the values follow. */
SPRINGLS__FN void springls__code_attribute(springls__coder *c, springls__attribute_entry *entry)
{
    const int32_t last = (int32_t)SPRINGLS_POLICY_SHARE;
    springls__code(c, entry->name, sizeof entry->name, 1);
    SPRINGLS__CODE(c, entry->channels);
    springls__code_choice(c, &entry->split, last);
    springls__code_choice(c, &entry->fill, last);
    springls__code_choice(c, &entry->merge, last);
}

/* How many neighbors a vertex has, in the first vertex of a springl whose neighbors are not found yet. */
enum { SPRINGLS__COUNT_NOT_FOUND = 255 };

/* Returns how many neighbors vertex m has in a row of the neighbor lists. */
SPRINGLS__FN int springls__neighbor_count(const int *row, int m)
{
    int n = 0;
    while (n < SPRINGLS__MAX_NEIGHBORS && row[SPRINGLS__MAX_NEIGHBORS * m + n] >= 0) n++;
    return n;
}

/* Codes the row of a springl: how many neighbors each vertex has, and their edges. */
SPRINGLS__FN void springls__code_neighbors(springls__coder *counts, springls__coder *edges, int *row)
{
    const bool missing = counts->out && row[0] == SPRINGLS__NOT_FOUND;
    int m, k;
    if (counts->in) springls__no_neighbors_yet(row);
    for (m = 0; m < 3; m++) {
        uint8_t count = (uint8_t)(missing && m == 0 ? SPRINGLS__COUNT_NOT_FOUND : counts->out ? springls__neighbor_count(row, m) : 0);
        SPRINGLS__CODE(counts, count);
        if (count == SPRINGLS__COUNT_NOT_FOUND) count = 0;
        else if (m == 0 && count == 0) row[0] = -1;
        for (k = 0; k < count; k++) SPRINGLS__CODE(edges, row[SPRINGLS__MAX_NEIGHBORS * m + k]);
    }
}

/* ---- named numbers: a reader finds them by name, and those that a block does not have are 0 ---- */

/* Lists the numbers of a model and the sizes of its arrays: X(type of 4 or 8 bytes, name of at most 23 characters). */
#define SPRINGLS__SNAPSHOT_NUMBERS(X)                                                                                            \
    X(int32_t, kind) X(double, time) X(uint64_t, reference_stamp) X(int32_t, iteration) X(uint32_t, step) X(uint32_t, next_id)   \
    X(int32_t, springls) X(int32_t, at_edges) X(int32_t, neighbors_uses) X(int32_t, neighbors_missing) X(int64_t, neighbors)     \
    X(int32_t, bricks) X(int32_t, attributes) X(int32_t, components) X(int32_t, events) X(int32_t, event_parts)                  \
    X(int32_t, new_events) X(int32_t, components_found) X(int32_t, volumes_locked)                                               \
    X(uint32_t, last_component_id) X(uint32_t, last_contact_body)                                     \
    X(int32_t, reference_bricks) X(int32_t, original) X(int32_t, given) X(int32_t, has_source)                                   \
    X(int32_t, steps) X(int64_t, added) X(int64_t, split) X(int64_t, removed) X(int64_t, reshaped) X(int64_t, refused)           \
    X(float, volume_correction) X(float, largest_displacement) X(float, moving_share) X(float, lag) X(float, lag_turned)         \
    X(int32_t, opposed)                                                                                                          \
    X(int64_t, left) X(int32_t, window_x) X(int32_t, window_y) X(int32_t, window_z)                                              \
    X(int32_t, original_window_x) X(int32_t, original_window_y) X(int32_t, original_window_z)                                    \
    X(int32_t, inside_runs) X(int32_t, reference_inside_runs) X(int32_t, original_tools)

/* Lists the numbers that only older blocks have. */
#define SPRINGLS__OLD_NUMBERS(X) X(int32_t, neighbors_age) X(int32_t, components_fresh)

/* Holds the numbers of a model. */
typedef struct springls__snapshot_state {
#define SPRINGLS__NUMBER_MEMBER(type, name) type name;
    SPRINGLS__SNAPSHOT_NUMBERS(SPRINGLS__NUMBER_MEMBER) SPRINGLS__OLD_NUMBERS(SPRINGLS__NUMBER_MEMBER)
#undef SPRINGLS__NUMBER_MEMBER
    springls_params params;
    springls__attribute_entry attribute[SPRINGLS_MAX_ATTRIBUTES];
} springls__snapshot_state;

/* Describes a named number in a struct. */
typedef struct springls__named { const char *name; size_t offset, bytes; } springls__named;

static const springls__named springls__snapshot_numbers[] = {
#define SPRINGLS__NUMBER_ROW(type, name) { #name, offsetof(springls__snapshot_state, name), sizeof(type) },
    SPRINGLS__SNAPSHOT_NUMBERS(SPRINGLS__NUMBER_ROW) SPRINGLS__OLD_NUMBERS(SPRINGLS__NUMBER_ROW)
#undef SPRINGLS__NUMBER_ROW
};
static const springls__named springls__snapshot_params[] = {
#define SPRINGLS__PARAM_ROW(name, low, high) { #name, offsetof(springls_params, name), 4 },
    SPRINGLS__PARAMS(SPRINGLS__PARAM_ROW, SPRINGLS__PARAM_ROW)
#undef SPRINGLS__PARAM_ROW
};
#define SPRINGLS__ONE_NUMBER(type, name) + 1
enum {
    SPRINGLS__NUMBERS_WRITTEN = 0 SPRINGLS__SNAPSHOT_NUMBERS(SPRINGLS__ONE_NUMBER),
    SPRINGLS__NUMBERS = SPRINGLS__NUMBERS_WRITTEN SPRINGLS__OLD_NUMBERS(SPRINGLS__ONE_NUMBER), /* which come last */
    SPRINGLS__PARAMS_NAMED = sizeof springls__snapshot_params / sizeof springls__snapshot_params[0]
};
#undef SPRINGLS__ONE_NUMBER

SPRINGLS__FN void springls__put_named(springls__coder *c, const springls__named *list, size_t count, const void *from)
{
    size_t i;
    for (i = 0; i < count; i++) {
        const char *number = (const char *)from + list[i].offset;
        memset(c->out, 0, SPRINGLS__NAMED_BYTES);
        memcpy(c->out, list[i].name, strlen(list[i].name));
        springls__copy_numbers(c->out + SPRINGLS__NAME_BYTES, number, 1, list[i].bytes);
        c->out += SPRINGLS__NAMED_BYTES;
    }
}

/* Returns the number of that name; NULL: there is none. name: SPRINGLS__NAME_BYTES, zeros at the end. */
SPRINGLS__FN const springls__named *springls__find_named(const springls__named *list, size_t count, const char *name)
{
    size_t i;
    if (name[SPRINGLS__NAME_BYTES - 1] != 0) return NULL;
    for (i = 0; i < count; i++)
        if (strcmp(list[i].name, name) == 0) return &list[i];
    return NULL;
}

/* Refuses a block for something whose name this version does not have. */
SPRINGLS__FN springls_status springls__unknown(springls_context *ctx, const char *what, const char *name, size_t length)
{
    char text[SPRINGLS__NAME_BYTES];
    size_t i;
    for (i = 0; i < length && name[i]; i++) text[i] = name[i] >= ' ' && name[i] <= '~' ? name[i] : '?';
    text[i] = 0;
    return springls__fail(ctx, SPRINGLS_BAD_SNAPSHOT, "restore: the block has a %s '%s', of a newer version", what, text);
}

/* Reads a section of named numbers into `to`; fails when one has an unknown name. */
SPRINGLS__FN springls_status springls__get_named(springls_context *ctx, const springls__named *list, size_t count,
                                                 const char *data, uint64_t bytes, void *to)
{
    uint64_t i;
    for (i = 0; i < bytes / SPRINGLS__NAMED_BYTES; i++) {
        const char *entry = data + i * SPRINGLS__NAMED_BYTES;
        const springls__named *number = springls__find_named(list, count, entry);
        if (!number) return springls__unknown(ctx, "number", entry, SPRINGLS__NAME_BYTES - 1);
        springls__copy_numbers((char *)to + number->offset, entry + SPRINGLS__NAME_BYTES, 1, number->bytes);
    }
    return SPRINGLS_OK;
}

/* ---- sections ---- */

/* Lists the sections in the order in which they are written. */
typedef enum springls__section {
    SPRINGLS__SECTION_NUMBERS,
    SPRINGLS__SECTION_PARAMS,
    SPRINGLS__SECTION_GRID,
    SPRINGLS__SECTION_SET,         /* one section for each array of the constellation */
    SPRINGLS__SECTION_NEIGHBORS = SPRINGLS__SECTION_SET + SPRINGLS__SPRINGL_ARRAY_COUNT, /* of older blocks: rows as in memory */
    SPRINGLS__SECTION_NEIGHBOR_COUNTS, /* how many neighbors each vertex has */
    SPRINGLS__SECTION_NEIGHBOR_EDGES,
    SPRINGLS__SECTION_SIDES,       /* of older blocks: a bit for each brick of the domain: 1 is constant and inside */
    SPRINGLS__SECTION_INSIDE,      /* runs of these bricks                            */
    SPRINGLS__SECTION_BRICKS,      /* the numbers of the bricks with voxels           */
    SPRINGLS__SECTION_PHI,
    SPRINGLS__SECTION_BRICK_CALM,  /* of older blocks: a byte for each of them; not used */
    SPRINGLS__SECTION_CALM,        /* a byte for each octant of them: sleep.h         */
    SPRINGLS__SECTION_COMPONENTS,
    SPRINGLS__SECTION_EVENTS,
    SPRINGLS__SECTION_EVENT_PARTS,
    SPRINGLS__SECTION_VALUES,      /* one section for each attribute                  */
    SPRINGLS__SECTION_REFERENCE_SIDES = SPRINGLS__SECTION_VALUES + SPRINGLS_MAX_ATTRIBUTES,
    SPRINGLS__SECTION_REFERENCE_INSIDE,
    SPRINGLS__SECTION_REFERENCE_BRICKS,
    SPRINGLS__SECTION_REFERENCE_PHI,
    SPRINGLS__SECTION_ORIGINAL,
    SPRINGLS__SECTION_SOURCE,
    SPRINGLS__SECTION_TOOLS,       /* the first triangle of each tool in the original surface */
    SPRINGLS__SECTIONS
} springls__section;

/* Which blocks have a section. */
typedef enum springls__section_use {
    SPRINGLS__SECTION_USED,
    SPRINGLS__SECTION_MAY_MISS, /* in older ones: its numbers are 0 */
    SPRINGLS__SECTION_ONLY_READ /* none but older ones               */
} springls__section_use;

/* Describes a section. width: bytes of its numbers; 0: records. */
typedef struct springls__section_info {
    int section;
    const char *tag;
    int width;
    springls__section_use use;
} springls__section_info;

#define SPRINGLS__SECTION_OF(array) (SPRINGLS__SECTION_SET + (int)SPRINGLS__ARRAY_##array)

/* Has a row for each section, the attributes one together. A tag is never used again for anything else. */
static const springls__section_info springls__section_list[] = {
    { SPRINGLS__SECTION_NUMBERS, "NUMB", 0, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_PARAMS, "PARM", 0, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_GRID, "GRID", 0, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(S), "SPRG", 0, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(A), "CORR", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(ID), "SPID", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(GENERATION), "GENR", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(MASK), "MASK", 1, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(COMPONENT), "BODY", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(CAVITY), "CAVT", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(CONTACT_BODY), "CONT", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(OVERLAPPED), "OVER", 1, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(EDGE), "EDGE", 1, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(ERROR), "ERRO", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(PARENT), "PRNT", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(BIRTH), "BRTH", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(PHI_AT), "PHIP", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_OF(SYNCED_POSITION), "SYNC", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_NEIGHBORS, "NEAR", 4, SPRINGLS__SECTION_ONLY_READ },
    { SPRINGLS__SECTION_NEIGHBOR_COUNTS, "NCNT", 0, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_NEIGHBOR_EDGES, "NEDG", 0, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_SIDES, "SIDE", 1, SPRINGLS__SECTION_ONLY_READ },
    { SPRINGLS__SECTION_INSIDE, "INSD", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_BRICKS, "BRIK", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_PHI, "PHIV", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_BRICK_CALM, "CALM", 1, SPRINGLS__SECTION_ONLY_READ },
    { SPRINGLS__SECTION_CALM, "OCTC", 0, SPRINGLS__SECTION_MAY_MISS },
    { SPRINGLS__SECTION_COMPONENTS, "COMP", 0, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_EVENTS, "EVNT", 0, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_EVENT_PARTS, "PART", 0, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_VALUES, "ATTR", 0, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_REFERENCE_SIDES, "RSID", 1, SPRINGLS__SECTION_ONLY_READ },
    { SPRINGLS__SECTION_REFERENCE_INSIDE, "RINS", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_REFERENCE_BRICKS, "RBRK", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_REFERENCE_PHI, "RPHI", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_ORIGINAL, "ORIG", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_SOURCE, "SRCE", 4, SPRINGLS__SECTION_USED },
    { SPRINGLS__SECTION_TOOLS, "TOOL", 4, SPRINGLS__SECTION_USED },
};
enum { SPRINGLS__SECTION_ROWS = sizeof springls__section_list / sizeof springls__section_list[0] };

/* Has no value when a section has no row. */
typedef char springls__all_sections_have_tags
    [(int)SPRINGLS__SECTION_ROWS + SPRINGLS_MAX_ATTRIBUTES - 1 == (int)SPRINGLS__SECTIONS ? 1 : -1];

/* A reader may skip a section with this flag that it does not know. */
enum { SPRINGLS__SECTION_OPTIONAL = 1 };

/* Returns the attribute of a section; -1: it is no attribute's. */
SPRINGLS__FN int springls__attribute_of(int section)
{
    int a = section - SPRINGLS__SECTION_VALUES;
    return a >= 0 && a < SPRINGLS_MAX_ATTRIBUTES ? a : -1;
}

SPRINGLS__FN const springls__section_info *springls__section_of(int section)
{
    int row;
    if (springls__attribute_of(section) >= 0) section = SPRINGLS__SECTION_VALUES;
    for (row = 0; springls__section_list[row].section != section; row++) continue;
    return &springls__section_list[row];
}

/* Holds where a block has the data of each section, and how many bytes; at 0: it does not have it. */
typedef struct springls__layout {
    uint64_t at[SPRINGLS__SECTIONS], bytes[SPRINGLS__SECTIONS], size;
    uint32_t count;
} springls__layout;

SPRINGLS__FN uint64_t springls__side_bytes(const springls__grid *g) { return ((uint64_t)springls__brick_count(g) + 7) / 8; }

/* Returns the bytes that a section has without padding; 0 when the snapshot has none. */
SPRINGLS__FN uint64_t springls__section_bytes(const springls__grid *g, const springls__snapshot_state *s, int section)
{
    const uint64_t brick = SPRINGLS__BRICK_VOXELS * sizeof(float), count = (uint64_t)s->springls;
    const bool all = s->kind == SPRINGLS_SNAPSHOT_KIND_ALL;
    int a = springls__attribute_of(section);
    if (a >= 0)
        return a < s->attributes ? SPRINGLS__ATTRIBUTE_BYTES + count * (uint64_t)s->attribute[a].channels * sizeof(float) : 0;
    if (section == SPRINGLS__SECTION_OF(S)) return count * SPRINGLS__SPRINGL_BYTES;
    if (section >= SPRINGLS__SECTION_SET && section < SPRINGLS__SECTION_NEIGHBORS)
        return count * springls__element_size((springls__array)(section - SPRINGLS__SECTION_SET));
    switch (section) {
    case SPRINGLS__SECTION_NUMBERS: return (uint64_t)SPRINGLS__NUMBERS_WRITTEN * SPRINGLS__NAMED_BYTES;
    case SPRINGLS__SECTION_PARAMS: return (uint64_t)SPRINGLS__PARAMS_NAMED * SPRINGLS__NAMED_BYTES;
    case SPRINGLS__SECTION_GRID: return SPRINGLS__GRID_BYTES;
    case SPRINGLS__SECTION_NEIGHBORS: return s->neighbors_age >= 0 ? count * SPRINGLS__NEIGHBOR_ROW * sizeof(int32_t) : 0;
    case SPRINGLS__SECTION_NEIGHBOR_COUNTS: return s->neighbors_uses > 0 ? 3 * count : 0;
    case SPRINGLS__SECTION_NEIGHBOR_EDGES: return (uint64_t)s->neighbors * sizeof(int32_t);
    case SPRINGLS__SECTION_SIDES: return springls__side_bytes(g);
    case SPRINGLS__SECTION_INSIDE: return (uint64_t)s->inside_runs * 2 * sizeof(int32_t);
    case SPRINGLS__SECTION_BRICKS: return (uint64_t)s->bricks * sizeof(int32_t);
    case SPRINGLS__SECTION_PHI: return (uint64_t)s->bricks * brick;
    case SPRINGLS__SECTION_BRICK_CALM: return (uint64_t)s->bricks;
    case SPRINGLS__SECTION_CALM: return (uint64_t)s->bricks * SPRINGLS__OCTANTS;
    case SPRINGLS__SECTION_COMPONENTS: return (uint64_t)s->components * SPRINGLS__COMPONENT_BYTES;
    case SPRINGLS__SECTION_EVENTS: return (uint64_t)s->events * SPRINGLS__EVENT_BYTES;
    case SPRINGLS__SECTION_EVENT_PARTS: return (uint64_t)s->event_parts * SPRINGLS__PART_BYTES;
    case SPRINGLS__SECTION_REFERENCE_SIDES: return all ? springls__side_bytes(g) : 0;
    case SPRINGLS__SECTION_REFERENCE_INSIDE: return all ? (uint64_t)s->reference_inside_runs * 2 * sizeof(int32_t) : 0;
    case SPRINGLS__SECTION_REFERENCE_BRICKS: return all ? (uint64_t)s->reference_bricks * sizeof(int32_t) : 0;
    case SPRINGLS__SECTION_REFERENCE_PHI: return all ? (uint64_t)s->reference_bricks * brick : 0;
    case SPRINGLS__SECTION_ORIGINAL: return all ? (uint64_t)s->original * 9 * sizeof(float) : 0;
    case SPRINGLS__SECTION_SOURCE: return all && s->has_source ? (uint64_t)s->original * sizeof(int32_t) : 0;
    default: return all ? (uint64_t)s->original_tools * sizeof(int32_t) : 0;
    }
}

SPRINGLS__FN uint64_t springls__padded(uint64_t bytes) { return (bytes + 7) / 8 * 8; }

/* Places the sections of a block; empty ones are left out. */
SPRINGLS__FN springls__layout springls__layout_of(const springls__grid *g, const springls__snapshot_state *s)
{
    springls__layout layout;
    int section;
    memset(&layout, 0, sizeof layout);
    layout.size = SPRINGLS__HEAD_BYTES;
    for (section = 0; section < SPRINGLS__SECTIONS; section++) {
        uint64_t bytes = springls__section_bytes(g, s, section);
        if (!bytes || springls__section_of(section)->use == SPRINGLS__SECTION_ONLY_READ) continue;
        layout.count++;
        layout.bytes[section] = bytes;
        layout.at[section] = layout.size + SPRINGLS__SECTION_HEAD_BYTES;
        layout.size = layout.at[section] + springls__padded(bytes);
    }
    return layout;
}

#endif
