/* entries.h - the entries that tables consist of. A stage is a constant table which reads like its algorithm, down to kernels:

     static const springls__entry springls__rebuild[] = {
         SPRINGLS__KERNEL(subvoxel, BRICKS)
         SPRINGLS__SWAP(ARRAY_PHI, ARRAY_PHI_NEXT)
         SPRINGLS__REPEAT_WHILE(springls__sweeps_band)
             SPRINGLS__KERNEL(redistance, BRICKS)
             SPRINGLS__SWAP(ARRAY_PHI, ARRAY_PHI_NEXT)
         SPRINGLS__END
         SPRINGLS__CALL(springls__band_follow)
     SPRINGLS__END };

   Why tables: a step can be left after any entry, and inside every kernel, and resumed where it was, so its place has to be data: a
   table, a number, and those of the tables that have called it (resumable.h runs them). And the docs print what runs.

   A table counts the rounds of one loop at a time (springls__round): a loop inside a loop is a table of its own. */
#ifndef SPRINGLS__RUNTIME_ENTRIES_H
#define SPRINGLS__RUNTIME_ENTRIES_H

#include "kernel_table.h"

typedef enum springls__entry_kind {
    SPRINGLS__ENTRY_DO, SPRINGLS__ENTRY_KERNEL, SPRINGLS__ENTRY_ROOM, SPRINGLS__ENTRY_SWAP, /* do something */
    SPRINGLS__ENTRY_CALL, SPRINGLS__ENTRY_IF, SPRINGLS__ENTRY_REPEAT_WHILE, SPRINGLS__ENTRY_END
} springls__entry_kind;

/* What a kernel runs over. */
typedef enum springls__over { SPRINGLS__OVER_SPRINGLS, SPRINGLS__OVER_BRICKS, SPRINGLS__OVER_SLOTS } springls__over;

typedef struct springls__entry {
    springls__entry_kind kind;
    const char *name;        /* of what is run, called or asked                                                  */
    int what;                /* KERNEL: its number; ROOM, SWAP: an array; CALL: the stage whose clock runs, or -1 */
    int other;               /* KERNEL, ROOM: the extent; SWAP: the other array                                  */
    size_t element;          /* ROOM: bytes                                                                      */
    springls_status (*run)(springls_context *ctx);
    bool (*when)(const springls_context *ctx);
    void (*arguments)(const springls_context *ctx, springls__arguments *args); /* NULL: the kernel takes none    */
    const struct springls__entry *table;
} springls__entry;

/* Runs a function, which may end with a loop (springls__loop). */
#define SPRINGLS__DO(function) { SPRINGLS__ENTRY_DO, #function, 0, 0, 0, function, NULL, NULL, NULL },
/* Runs a kernel over all springls, active bricks or slots; _WITH: with arguments that a function writes. */
#define SPRINGLS__KERNEL(name, over)                                                                                             \
    { SPRINGLS__ENTRY_KERNEL, #name, (int)SPRINGLS__KERNEL_##name, (int)SPRINGLS__OVER_##over, 0, NULL, NULL, NULL, NULL },
#define SPRINGLS__KERNEL_WITH(name, over, arguments)                                                                             \
    { SPRINGLS__ENTRY_KERNEL, #name, (int)SPRINGLS__KERNEL_##name, (int)SPRINGLS__OVER_##over, 0, NULL, NULL, arguments, NULL },
/* Makes room for a role of the working memory (scratch.h), an element for each springl, brick or slot. */
#define SPRINGLS__ROOM(role, over)                                                                                               \
    { SPRINGLS__ENTRY_ROOM, #role, (int)SPRINGLS__ROLE_##role, (int)SPRINGLS__OVER_##over,                                       \
      sizeof *springls__##role((const springls__model *)NULL), NULL, NULL, NULL, NULL },
/* Exchanges two arrays: ARRAY_ and ROLE_ names. */
#define SPRINGLS__SWAP(a, b)                                                                                                     \
    { SPRINGLS__ENTRY_SWAP, #a ", " #b, (int)SPRINGLS__##a, (int)SPRINGLS__##b, 0, NULL, NULL, NULL, NULL },
/* Runs another table; STAGE: while the clock of a stage runs. */
#define SPRINGLS__CALL(table) { SPRINGLS__ENTRY_CALL, #table, -1, 0, 0, NULL, NULL, NULL, table },
#define SPRINGLS__STAGE(name, table) { SPRINGLS__ENTRY_CALL, #table, (int)SPRINGLS_STAGE_##name, 0, 0, NULL, NULL, NULL, table },
/* Begin a block, which runs once or again and again while a condition is true. */
#define SPRINGLS__IF(condition) { SPRINGLS__ENTRY_IF, #condition, 0, 0, 0, NULL, condition, NULL, NULL },
#define SPRINGLS__REPEAT_WHILE(condition) { SPRINGLS__ENTRY_REPEAT_WHILE, #condition, 0, 0, 0, NULL, condition, NULL, NULL },
/* Ends a block, or the table. */
#define SPRINGLS__END { SPRINGLS__ENTRY_END, "", 0, 0, 0, NULL, NULL, NULL, NULL },

#endif
