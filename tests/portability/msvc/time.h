/* The declarations of time.h that springls.h uses. */
#ifndef MSVC_TIME_H
#define MSVC_TIME_H
typedef long clock_t;
#define CLOCKS_PER_SEC ((clock_t)1000)
#ifdef __cplusplus
extern "C" {
#endif
clock_t clock(void);
#ifdef __cplusplus
}
#endif
#endif
