#include "viewer/history.h"

#include <stdlib.h>
#include <string.h>

#define MAX_BYTES ((size_t)1 << 29)

static void truncate_to(struct viewer_history *history, int count)
{
    while (history->count > count) {
        free(history->states[--history->count].block);
    }
}

void viewer_history_clear(struct viewer_history *history)
{
    truncate_to(history, 0);
    history->at = 0;
}

static void forget_oldest(struct viewer_history *history)
{
    free(history->states[0].block);
    --history->count;
    --history->at;
    memmove(history->states, history->states + 1, (size_t)history->count * sizeof *history->states);
}

static void make_room(struct viewer_history *history, size_t size)
{
    for (int i = 0; i < history->count; ++i) {
        size += history->states[i].size;
    }
    while (history->at > 0 && (history->count == VIEWER_MAX_STATES || size > MAX_BYTES)) {
        size -= history->states[0].size;
        forget_oldest(history);
    }
}

/* Takes a snapshot of the model. */
static bool take(struct viewer_model *model, struct viewer_state *state)
{
    *state = (struct viewer_state){.like = viewer_model_grid(model)};
    if (!viewer_model_check(model, springls_snapshot(model->ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &state->size))) {
        return false;
    }
    state->block = malloc(state->size);
    if (!state->block) {
        return viewer_model_check(model, SPRINGLS_OUT_OF_MEMORY);
    }
    const springls_status status =
        springls_snapshot(model->ctx, SPRINGLS_SNAPSHOT_KIND_ALL, state->block, state->size, &state->size);
    if (!viewer_model_check(model, status)) {
        free(state->block);
        return false;
    }
    return true;
}

/* Appends the present state behind `count` others; after a failure all states are as they were. */
static bool append(struct viewer_history *history, struct viewer_model *model, int count)
{
    struct viewer_state state;
    if (!viewer_model_finish(model) || !take(model, &state)) {
        return false;
    }
    truncate_to(history, count);
    make_room(history, state.size);
    history->states[history->count++] = state;
    return true;
}

bool viewer_history_keep(struct viewer_history *history, struct viewer_model *model)
{
    const bool good = append(history, model, history->at);
    history->at = good ? history->count : history->at;
    return good;
}

static bool go_to(struct viewer_history *history, struct viewer_model *model, int at)
{
    const struct viewer_state *state = &history->states[at];
    if (!viewer_model_restore(model, &state->like, state->block, state->size)) {
        return false;
    }
    history->at = at;
    return true;
}

bool viewer_history_revert(struct viewer_history *history, struct viewer_model *model)
{
    const bool good = history->at > 0 && go_to(history, model, history->at - 1);
    if (good) {
        truncate_to(history, history->at);
    }
    return good;
}

bool viewer_history_undo(struct viewer_history *history, struct viewer_model *model)
{
    model->error[0] = '\0';
    if (history->at == 0 || !viewer_model_finish(model)
        || (history->at == history->count && !append(history, model, history->count))) {
        return false;
    }
    return history->at > 0 && go_to(history, model, history->at - 1);
}

bool viewer_history_redo(struct viewer_history *history, struct viewer_model *model)
{
    model->error[0] = '\0';
    return history->at + 1 < history->count && viewer_model_finish(model) && go_to(history, model, history->at + 1);
}
