/* combine_undo.h - remembers the model before a combination, to go back to it on failure: its arrays, one after the other, and numbers. The
   original surface and the reference level set go back by themselves (combined_originals.h). */
#ifndef SPRINGLS__TOOLS_COMBINE_UNDO_H
#define SPRINGLS__TOOLS_COMBINE_UNDO_H

#include "../runtime/arrays.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../model/constellation.h"

/* The arrays that a combination may change, but those that are found again when they are needed. */
#define SPRINGLS__UNDO_BITS                                                                                                      \
    (SPRINGLS__SET_BITS | SPRINGLS__BIT(ASLEEP) | SPRINGLS__BIT(NEIGHBORS)                                                       \
     | ((SPRINGLS__GRID_BITS) & ~(SPRINGLS__BIT(OMEGA) | SPRINGLS__BIT(CELL) | SPRINGLS__BIT(PHI_NEXT))))

/* Lists the numbers that a combination may change: X(member of the context). */
#define SPRINGLS__UNDO_NUMBERS(X)                                                                                                \
    X(stats) X(lag) X(lag_turned) X(away) X(opposed) X(at_rest) X(neighbors_uses) X(neighbors_missing) X(last_contact_body)      \
    X(reference_stamp) X(volumes_locked)

/* What is saved: arrays, values of attributes, components. */
enum {
    SPRINGLS__UNDO_ATTRIBUTES = SPRINGLS__ARRAY_COUNT,
    SPRINGLS__UNDO_COMPONENTS = SPRINGLS__UNDO_ATTRIBUTES + SPRINGLS_MAX_ATTRIBUTES,
    SPRINGLS__UNDO_PARTS
};

typedef struct springls__undo {
    springls_context was;
    size_t bytes[SPRINGLS__UNDO_PARTS]; /* of each part                                 */
    size_t all;
    bool found;                         /* components were up to date                   */
    bool whole;                         /* all has been saved: it is possible to go back */
} springls__undo;

/* Returns a part of the model; bytes: 0 if it is not saved. */
SPRINGLS__FN springls__buffer *springls__undo_part(springls_context *ctx, int part, size_t *bytes)
{
    const size_t count = (size_t)ctx->model.set.count;
    *bytes = 0;
    if (part >= (int)SPRINGLS__UNDO_COMPONENTS) {
        *bytes = ctx->component_count ? ctx->component_memory.bytes : 0;
        return &ctx->component_memory;
    }
    if (part >= (int)SPRINGLS__UNDO_ATTRIBUTES) {
        springls__attribute *attribute = &ctx->attributes[part - (int)SPRINGLS__UNDO_ATTRIBUTES];
        if (part - (int)SPRINGLS__UNDO_ATTRIBUTES < ctx->attribute_count)
            *bytes = count * (size_t)attribute->channels * sizeof(float);
        return &attribute->values;
    }
    if (springls__has_array(SPRINGLS__UNDO_BITS, part) && (part != (int)SPRINGLS__ARRAY_NEIGHBORS || ctx->neighbors_uses > 0))
        *bytes = springls__used(ctx, (springls__array)part) * springls__element_size((springls__array)part);
    return &ctx->memory[part];
}

SPRINGLS__FN springls_status springls__undo_begin(springls_context *ctx, springls__undo *undo)
{
    int part;
    undo->was = *ctx;
    undo->found = ctx->components_version == springls__components_source(ctx);
    for (part = 0, undo->all = 0; part < (int)SPRINGLS__UNDO_PARTS; part++) {
        springls__undo_part(ctx, part, &undo->bytes[part]);
        undo->all += undo->bytes[part];
    }
    return springls__buffer_grow(ctx, &ctx->undo_memory, undo->all + 1, 1, 0);
}

/* Copies bytes begin <= i < end of all parts together to the memory of the undo, or back. */
SPRINGLS__FN void springls__undo_copy(springls_context *ctx, const springls__undo *undo, size_t begin, size_t end, bool back)
{
    size_t first = 0, unused_bytes;
    int part;
    for (part = 0; part < (int)SPRINGLS__UNDO_PARTS && first < end; first += undo->bytes[part++]) {
        const size_t from = begin > first ? begin - first : 0;
        const size_t to = end - first < undo->bytes[part] ? end - first : undo->bytes[part];
        char *saved = (char *)ctx->undo_memory.data + first + from, *own;
        if (from >= to) continue;
        own = (char *)springls__undo_part(ctx, part, &unused_bytes)->data + from;
        if (back) memcpy(own, saved, to - from);
        else memcpy(saved, own, to - from);
    }
}

/* Goes back to the model as it was saved. */
SPRINGLS__FN void springls__undo_back(springls_context *ctx, const springls__undo *undo)
{
    int part;
    ctx->model = undo->was.model;
    ctx->work.added = 0;
    springls__bind(ctx);
    springls__undo_copy(ctx, undo, 0, undo->all, true);
    for (part = 0; part < (int)SPRINGLS__ARRAY_COUNT; part++) {
        if (!springls__has_array(SPRINGLS__UNDO_BITS, part)) continue;
        ctx->memory[part].host_stale = false;
        ctx->memory[part].device_stale = ctx->memory[part].device_bytes > 0;
    }
    ctx->omega_fresh = false;
    springls__note_writes(ctx, SPRINGLS__UNDO_BITS);
    springls__constellation_changed(ctx);
#define SPRINGLS__UNDO_NUMBER(member) ctx->member = undo->was.member;
    SPRINGLS__UNDO_NUMBERS(SPRINGLS__UNDO_NUMBER)
#undef SPRINGLS__UNDO_NUMBER
    if (undo->found) ctx->components_version = springls__components_source(ctx);
}

#endif
