/* tiling_snapshot.h - a tiling as one block of bytes, laid out as that of a model (output/snapshot_format.h): numbers, the grid, and for
   each body its label and the block of its model. So all that is said of those blocks holds for these. */
#ifndef SPRINGLS__TILING_TILING_SNAPSHOT_H
#define SPRINGLS__TILING_TILING_SNAPSHOT_H

#include "../output/restore.h"
#include "bodies.h"
#include "tiling_rest.h"

/* Lists the numbers of a tiling: X(type, name). */
#define SPRINGLS__TILING_NUMBERS(X) X(int32_t, bodies) X(uint32_t, steps) X(int32_t, facing_known) X(int32_t, idle)

typedef struct springls__tiling_state {
#define SPRINGLS__NUMBER_MEMBER(type, name) type name;
    SPRINGLS__TILING_NUMBERS(SPRINGLS__NUMBER_MEMBER)
#undef SPRINGLS__NUMBER_MEMBER
} springls__tiling_state;

static const springls__named springls__tiling_numbers[] = {
#define SPRINGLS__NUMBER_ROW(type, name) { #name, offsetof(springls__tiling_state, name), sizeof(type) },
    SPRINGLS__TILING_NUMBERS(SPRINGLS__NUMBER_ROW)
#undef SPRINGLS__NUMBER_ROW
};
enum {
    SPRINGLS__TILING_NAMED = sizeof springls__tiling_numbers / sizeof springls__tiling_numbers[0],
    SPRINGLS__BODY_HEAD_BYTES = 8 /* of a body's section: its label, and its steps without forces, of older blocks 0 */
};

/* ---- to a block ---- */

/* Writes the head of a section. */
SPRINGLS__FN void springls__begin_section(springls__coder *c, const char *tag, uint64_t bytes)
{
    char name[4];
    memcpy(name, tag, sizeof name);
    springls__code(c, name, sizeof name, 1);
    springls__code_zeros(c, 4); /* flags */
    SPRINGLS__CODE(c, bytes);
}

/* Finds how many bytes the models' blocks have, and the tiling's. */
SPRINGLS__FN springls_status springls__size_of_block(springls_tiling *tiling, springls_snapshot_kind kind, size_t *size)
{
    const char *call = "tiling_snapshot";
    double bytes = 0.0;
    int i;
    *size = SPRINGLS__HEAD_BYTES + 2 * SPRINGLS__SECTION_HEAD_BYTES + (int)SPRINGLS__TILING_NAMED * SPRINGLS__NAMED_BYTES
          + SPRINGLS__GRID_BYTES;
    for (i = 0; i < tiling->count; i++) {
        springls__tiling_body *body = &tiling->body[i];
        body->status = springls_snapshot(body->ctx, kind, NULL, 0, &body->block_size);
        if (body->status != SPRINGLS_OK) return springls__body_failed(tiling, body->status, call, body->label, body->ctx);
        *size += (size_t)SPRINGLS__SECTION_HEAD_BYTES + (size_t)SPRINGLS__BODY_HEAD_BYTES + body->block_size;
        bytes += (double)body->block_size;
    }
    if (bytes < (double)(SIZE_MAX / 2)) return SPRINGLS_OK;
    return springls__fail(tiling->host, SPRINGLS_OUT_OF_MEMORY, "%s: a size overflows", call);
}

/* Writes the block: every section is a multiple of 8 bytes. */
SPRINGLS__FN springls_status springls__write_block(springls_tiling *tiling, springls_snapshot_kind kind, char *out, size_t size)
{
    springls__coder c = springls__writer(out + SPRINGLS__HEAD_BYTES);
    springls__tiling_state state;
    double to_world[12];
    int i;
    state.bodies = tiling->count;
    state.steps = tiling->steps;
    state.facing_known = tiling->facing_known;
    state.idle = 0; /* of older blocks, for all bodies */
    springls__begin_section(&c, "TILE", (uint64_t)SPRINGLS__TILING_NAMED * SPRINGLS__NAMED_BYTES);
    springls__put_named(&c, springls__tiling_numbers, SPRINGLS__TILING_NAMED, &state);
    springls__begin_section(&c, "GRID", SPRINGLS__GRID_BYTES);
    memcpy(to_world, tiling->host->lattice_to_world, sizeof to_world);
    springls__code_grid(&c, tiling->host->model.grid.size, to_world);
    for (i = 0; i < tiling->count; i++) {
        springls__tiling_body *body = &tiling->body[i];
        size_t written;
        springls__begin_section(&c, "BODY", SPRINGLS__BODY_HEAD_BYTES + (uint64_t)body->block_size);
        SPRINGLS__CODE(&c, body->label);
        SPRINGLS__CODE(&c, body->rest.idle);
        body->status = springls_snapshot(body->ctx, kind, c.out, body->block_size, &written);
        if (body->status != SPRINGLS_OK)
            return springls__body_failed(tiling, body->status, "tiling_snapshot", body->label, body->ctx);
        c.out += written;
    }
    springls__put_head(out, springls__tiling_magic, 2u + (uint32_t)tiling->count, size);
    return SPRINGLS_OK;
}

SPRINGLS__TILINGS_API springls_status springls_tiling_snapshot(springls_tiling *tiling, springls_snapshot_kind kind, void *out,
                                                               size_t capacity, size_t *size)
{
    size_t bytes;
    if (size) *size = 0;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    if (!size) return springls__fail_null(tiling->host, "tiling_snapshot", "size");
    if (kind != SPRINGLS_SNAPSHOT_KIND_ALL && kind != SPRINGLS_SNAPSHOT_KIND_FRAME)
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "tiling_snapshot: there is no kind %d: it may be 0 or 1", (int)kind);
    SPRINGLS__TRY(springls__bodies_to_host(tiling, "tiling_snapshot"));
    SPRINGLS__TRY(springls__note_changes(tiling));
    SPRINGLS__TRY(springls__size_of_block(tiling, kind, &bytes));
    *size = bytes;
    if (out && capacity < bytes)
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "tiling_snapshot: %lu bytes are needed, not %lu",
                              (unsigned long)bytes, (unsigned long)capacity);
    return out ? springls__write_block(tiling, kind, (char *)out, bytes) : SPRINGLS_OK;
}

/* ---- from a block ---- */

/* Where a block has the model of a body. */
typedef struct springls__body_block { const char *block; size_t size; int32_t label, idle; } springls__body_block;

/* A block that is read: its numbers, and the models that it has. */
typedef struct springls__tiling_block {
    springls__tiling_state state;
    springls__buffer models;    /* springls__body_block */
    bool has_numbers, has_grid;
} springls__tiling_block;

SPRINGLS__FN springls_status springls__block_fails(springls_tiling *tiling, const char *fault)
{
    return springls__fail(tiling->host, SPRINGLS_BAD_SNAPSHOT, "tiling_restore: the block is %s", fault);
}

/* Reads the grid of a block, which has to be that of the tiling. */
SPRINGLS__FN springls_status springls__read_block_grid(springls_tiling *tiling, const char *data, uint64_t bytes)
{
    springls__coder c = springls__reader(data);
    int32_t size[3];
    double to_world[12];
    if (bytes != SPRINGLS__GRID_BYTES) return springls__block_fails(tiling, "damaged");
    springls__code_grid(&c, size, to_world);
    if (!c.bad && memcmp(size, tiling->host->model.grid.size, sizeof size) == 0
        && memcmp(to_world, tiling->host->lattice_to_world, sizeof to_world) == 0) return SPRINGLS_OK;
    return springls__block_fails(tiling, "of another grid");
}

/* Reads a section whose tag is known; *count counts the models. */
SPRINGLS__FN springls_status springls__read_section(springls_tiling *tiling, springls__tiling_block *read, const char *tag,
                                                    const char *data, uint64_t bytes, int *count)
{
    springls__body_block *model;
    springls__coder c = springls__reader(data);
    if (memcmp(tag, "TILE", 4) == 0) {
        if (read->has_numbers || bytes % SPRINGLS__NAMED_BYTES) return springls__block_fails(tiling, "damaged");
        read->has_numbers = true;
        return springls__get_named(tiling->host, springls__tiling_numbers, SPRINGLS__TILING_NAMED, data, bytes, &read->state);
    }
    if (memcmp(tag, "GRID", 4) == 0) {
        read->has_grid = true;
        return springls__read_block_grid(tiling, data, bytes);
    }
    if (bytes < SPRINGLS__BODY_HEAD_BYTES || *count > SPRINGLS__LARGEST_LABEL) return springls__block_fails(tiling, "damaged");
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &read->models, (size_t)*count + 1, sizeof *model, (size_t)*count * sizeof *model));
    model = (springls__body_block *)read->models.data + *count;
    SPRINGLS__CODE(&c, model->label);
    SPRINGLS__CODE(&c, model->idle);
    model->block = data + SPRINGLS__BODY_HEAD_BYTES;
    model->size = (size_t)bytes - SPRINGLS__BODY_HEAD_BYTES;
    if (model->label < 0 || model->label > SPRINGLS__LARGEST_LABEL || model->idle < 0 || model->idle > SPRINGLS__MOST_IDLE
        || (*count == 0) != (model->label == 0)
        || (*count > 0 && model->label <= (model - 1)->label)) return springls__block_fails(tiling, "damaged");
    ++*count;
    return SPRINGLS_OK;
}

/* Reads the head of a block, and finds its sections. */
SPRINGLS__FN springls_status springls__read_block(springls_tiling *tiling, springls__tiling_block *read, const char *block, size_t size)
{
    uint64_t at = SPRINGLS__HEAD_BYTES, bytes = 0;
    uint32_t sections = 0, flags = 0, i;
    const char *fault = size < SPRINGLS__HEAD_BYTES ? "too short" : springls__head_fault(springls__tiling_magic, block, size, &sections);
    int count = 0;
    if (fault) return springls__block_fails(tiling, strcmp(fault, "no snapshot") == 0 ? "no snapshot of a tiling" : fault);
    for (i = 0; i < sections; i++) {
        const char *tag = block + at;
        springls__coder c;
        if (size - at < SPRINGLS__SECTION_HEAD_BYTES) return springls__block_fails(tiling, "damaged");
        c = springls__reader(tag + 4);
        SPRINGLS__CODE(&c, flags);
        SPRINGLS__CODE(&c, bytes);
        at += SPRINGLS__SECTION_HEAD_BYTES;
        if (bytes > size - at || springls__padded(bytes) > size - at) return springls__block_fails(tiling, "damaged");
        if (memcmp(tag, "TILE", 4) == 0 || memcmp(tag, "GRID", 4) == 0 || memcmp(tag, "BODY", 4) == 0)
            SPRINGLS__TRY(springls__read_section(tiling, read, tag, block + at, bytes, &count));
        else if (!(flags & SPRINGLS__SECTION_OPTIONAL)) return springls__unknown(tiling->host, "section", tag, 4);
        at += springls__padded(bytes);
    }
    if (at != size || !read->has_numbers || !read->has_grid || read->state.bodies != count || count == 1
        || !springls__flag_good(read->state.facing_known) || read->state.idle < 0 || read->state.idle > SPRINGLS__MOST_IDLE)
        return springls__block_fails(tiling, "damaged");
    return SPRINGLS_OK;
}

/* Returns whether the labels that springls face are valid; true without the attribute. */
SPRINGLS__FN bool springls__facing_good(const springls__snapshot_state *state, const springls__layout *layout, const char *block)
{
    int a, i;
    for (a = 0; a < state->attributes; a++) {
        springls__coder c = springls__reader(block + layout->at[SPRINGLS__SECTION_VALUES + a] + SPRINGLS__ATTRIBUTE_BYTES);
        if (strcmp(state->attribute[a].name, springls__facing_name) != 0) continue;
        if (state->attribute[a].channels != 1) return false;
        for (i = 0; i < state->springls; i++) {
            float value = 0.0f;
            SPRINGLS__CODE(&c, value);
            if (springls__is_nan_float(value) || value < -1.0f || value > (float)SPRINGLS__LARGEST_LABEL
                || value != (float)(int32_t)value) return false;
        }
    }
    return true;
}

/* Returns whether a model's window has not moved: that of a tiling never does. */
SPRINGLS__FN bool springls__window_at_home(const springls__snapshot_state *state)
{
    return !state->window_x && !state->window_y && !state->window_z && !state->original_window_x && !state->original_window_y
        && !state->original_window_z;
}

/* Checks the model of a body, and makes all the room that it needs; the body's model stays as it is. */
SPRINGLS__FN springls_status springls__prepare_body(springls_tiling *tiling, springls__tiling_body *body, const springls__body_block *model)
{
    const char *call = "tiling_restore";
    springls__snapshot_state state;
    springls__layout layout;
    springls__table tables[2];
    springls_status status = springls__use_host(body->ctx, false);
    if (status == SPRINGLS_OK) status = springls__snapshot_read(body->ctx, model->block, model->size, &state, &layout);
    if (status == SPRINGLS_OK && !(springls__window_at_home(&state) && springls__facing_good(&state, &layout, model->block)))
        return springls__block_fails(tiling, "damaged");
    if (status == SPRINGLS_OK) {
        springls__tables_of_block(body->ctx, &state, &layout, model->block, tables);
        status = springls__snapshot_reserve(body->ctx, &state, tables);
    }
    return status == SPRINGLS_OK ? status : springls__body_failed(tiling, status, call, model->label, body->ctx);
}

/* Lists the bodies of a block: a body whose label the tiling has keeps its model, any other gets a new model. */
SPRINGLS__FN springls_status springls__list_restored(springls_tiling *tiling, const springls__tiling_block *read,
                                                     springls__tiling_body *body)
{
    const springls__body_block *model = (const springls__body_block *)read->models.data;
    int i;
    for (i = 0; i < read->state.bodies; i++) {
        const int number = springls__body_number(tiling, model[i].label);
        if (number >= 0) body[i] = tiling->body[number];
        else SPRINGLS__TRY(springls__body_create(tiling, "tiling_restore", model[i].label, &body[i]));
        SPRINGLS__TRY(springls__prepare_body(tiling, &body[i], &model[i]));
    }
    return SPRINGLS_OK;
}

/* Frees the bodies of a list that are not among others, and the list. */
SPRINGLS__FN void springls__free_others(springls_tiling *tiling, springls__buffer *list, int count, const springls__tiling_body *others,
                                        int other_count)
{
    springls__tiling_body *body = (springls__tiling_body *)list->data;
    int i, k;
    for (i = k = 0; i < count; i++) {
        while (k < other_count && others[k].label < body[i].label) k++;
        if (k == other_count || others[k].ctx != body[i].ctx) springls__body_free(&body[i]);
    }
    springls__buffer_free(tiling->host, list);
}

/* Takes the models of a block that has been read. All that can fail has been done. */
SPRINGLS__FN void springls__take_restored(springls_tiling *tiling, const springls__tiling_block *read, springls__buffer *bodies)
{
    const springls__body_block *model = (const springls__body_block *)read->models.data;
    springls__tiling_body *body = (springls__tiling_body *)bodies->data;
    int i;
    for (i = 0; i < read->state.bodies; i++) {
        const springls_status status = springls_restore(body[i].ctx, model[i].block, model[i].size);
        SPRINGLS_ASSERT(status == SPRINGLS_OK);
        (void)status;
        memset(&body[i].rest, 0, sizeof body[i].rest);
        body[i].rest.idle = springls__imax(model[i].idle, read->state.idle);
    }
    springls__free_others(tiling, &tiling->bodies, tiling->count, body, read->state.bodies);
    tiling->bodies = *bodies;
    tiling->body = body;
    tiling->count = read->state.bodies;
    tiling->steps = read->state.steps;
    tiling->facing_known = read->state.facing_known != 0;
    springls__note_springls(tiling);
    tiling->neighbors_known = false;
    tiling->neighbor_count = 0;
}

SPRINGLS__TILINGS_API springls_status springls_tiling_restore(springls_tiling *tiling, const void *block, size_t size)
{
    springls__tiling_block read;
    springls__buffer bodies;
    springls_status status;
    int listed = 0;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    if (!block) return springls__fail_null(tiling->host, "tiling_restore", "the block");
    memset(&read, 0, sizeof read);
    memset(&bodies, 0, sizeof bodies);
    status = springls__read_block(tiling, &read, (const char *)block, size);
    if (status == SPRINGLS_OK)
        status = springls__buffer_grow(tiling->host, &bodies, (size_t)read.state.bodies + 1, sizeof(springls__tiling_body), 0);
    if (status == SPRINGLS_OK) {
        memset(bodies.data, 0, bodies.bytes);
        status = springls__list_restored(tiling, &read, (springls__tiling_body *)bodies.data);
        listed = read.state.bodies;
    }
    if (status == SPRINGLS_OK) springls__take_restored(tiling, &read, &bodies);
    else springls__free_others(tiling, &bodies, listed, tiling->body, tiling->count);
    springls__buffer_free(tiling->host, &read.models);
    return status;
}

#endif
