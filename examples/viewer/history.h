/* history.h - undo and redo: the model before each change, as snapshots. */
#ifndef EXAMPLES_VIEWER_HISTORY_H
#define EXAMPLES_VIEWER_HISTORY_H

#include "viewer/model.h"

enum { VIEWER_MAX_STATES = 64 };

struct viewer_state {
    void *block;
    size_t size;
};

/* states[0 .. at - 1] are before the model, those behind `at` after it. */
struct viewer_history {
    struct viewer_state states[VIEWER_MAX_STATES];
    int count, at;
};

/* Before a change: what could be redone is forgotten. The oldest states go when there are many, or large ones. */
bool viewer_history_keep(struct viewer_history *history, struct viewer_model *model);

/* The same bits as then. False: nothing to undo or redo, model->error empty; or a failure, which it tells. */
bool viewer_history_undo(struct viewer_history *history, struct viewer_model *model);
bool viewer_history_redo(struct viewer_history *history, struct viewer_model *model);
void viewer_history_clear(struct viewer_history *history);

#endif
