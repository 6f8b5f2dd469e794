/* scalar.h - fminf and fmaxf without their care for NaN, which makes them calls: images have none (volume_read replaces it). */
#ifndef EXAMPLES_BASE_SCALAR_H
#define EXAMPLES_BASE_SCALAR_H

static inline float scalar_min(float a, float b) { return a < b ? a : b; }
static inline float scalar_max(float a, float b) { return a > b ? a : b; }
static inline float scalar_clamp(float x, float low, float high) { return scalar_max(scalar_min(x, high), low); }

#endif
