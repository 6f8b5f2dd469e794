/* history.h - undo and redo by snapshots of the model before each change. */
#ifndef EXAMPLES_VIEWER_HISTORY_H
#define EXAMPLES_VIEWER_HISTORY_H

#include "viewer/model.h"

enum { VIEWER_MAX_STATES = 256 };

struct viewer_state {
    struct viewer_model like; /* its grid; without a context */
    void *block;
    size_t size;
};

/* states[0 .. at - 1] are older than the model, the later ones newer. */
struct viewer_history {
    struct viewer_state states[VIEWER_MAX_STATES];
    int count, at;
};

/* Saves the model before a change and drops the states to redo. The oldest states are dropped when there are many, or large
 * ones. After a failure nothing is dropped, and the reason is in model->error. */
bool viewer_history_keep(struct viewer_history *history, struct viewer_model *model);

/* Restores what was saved last and drops it: the change after it has failed, and cannot be redone. */
bool viewer_history_revert(struct viewer_history *history, struct viewer_model *model);

/* Restore the model bit by bit, in its own grid. Return false when there is nothing to undo or redo, with an empty model->error, or
 * after a failure with the reason in model->error; the model and its states stay as they were then. */
bool viewer_history_undo(struct viewer_history *history, struct viewer_model *model);
bool viewer_history_redo(struct viewer_history *history, struct viewer_model *model);
void viewer_history_clear(struct viewer_history *history);

#endif
