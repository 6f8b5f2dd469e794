/* The declarations of time.h that springls.h and springls_cl.h use. */
#ifndef MSVC_TIME_H
#define MSVC_TIME_H
typedef long clock_t;
typedef long long time_t;
#define CLOCKS_PER_SEC ((clock_t)1000)
#ifdef __cplusplus
extern "C" {
#endif
clock_t clock(void);
time_t time(time_t *at);
#ifdef __cplusplus
}
#endif
#endif
