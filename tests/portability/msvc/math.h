/* The declarations of math.h that springls.h uses. */
#ifndef MSVC_MATH_H
#define MSVC_MATH_H
#ifdef __cplusplus
extern "C" {
#endif
double fabs(double x);
float fabsf(float x);
double floor(double x);
double sqrt(double x);
float sqrtf(float x);
#ifdef __cplusplus
}
float fabs(float x);
float floor(float x);
float sqrt(float x);
#endif
#endif
