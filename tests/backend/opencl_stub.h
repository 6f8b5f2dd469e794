/* opencl_stub.h - how tests control opencl_stub.c; dlsym finds it there. */
#ifndef OPENCL_STUB_H
#define OPENCL_STUB_H

typedef struct stub_controls {
    /* Forgets faults and counts calls from 0 again. */
    void (*begin)(void);
    /* Call number `call` of a function ("clFinish"; NULL: of all but releases and clSetKernelArg) gives `error`; with `on` all
       calls after it do too, but for releases: a lost device. */
    void (*fail)(const char *function, int call, int error, int on);
    /* Makes the list of platforms empty, or whole again. */
    void (*hide_platforms)(int hidden);
    int (*calls)(const char *function);
    /* Pairs of a kernel and a size of its work group that have been started so far: a driver may compile each. */
    int (*compiled)(void);
    /* Objects that are not released; those of memory alone. */
    int (*objects)(void);
    int (*memories)(void);
    /* The first function that was given an object that there is not, or ""; the function that failed on demand, or "". */
    const char *(*misuse)(void);
    const char *(*failed)(void);
    /* Until begin(): the platform has another name than PoCL's (1), and compiled programs are their text besides (2). */
    void (*other_driver)(int kind);
} stub_controls;

#endif
