/* The declarations of process.h that springls.h uses where SPRINGLS_THREADS is defined. */
#ifndef MSVC_PROCESS_H
#define MSVC_PROCESS_H
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif
uintptr_t _beginthreadex(void *security, unsigned stack, unsigned(__stdcall *start)(void *), void *arg, unsigned flags, unsigned *id);
#ifdef __cplusplus
}
#endif
#endif
