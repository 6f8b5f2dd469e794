/* width_simd.h - makes the next *_body.h the text for SPRINGLS__LANES numbers at once: SPRINGLS__W(name) is springls__vec_name.
   It has no guard because it is included before every body. */
#undef SPRINGLS__WIDTH
#undef SPRINGLS__NUM
#undef SPRINGLS__NUM3
#undef SPRINGLS__COND
#undef SPRINGLS__W
#undef SPRINGLS__W_MATHS
#define SPRINGLS__WIDTH SPRINGLS__LANES
#define SPRINGLS__NUM springls__vec
#define SPRINGLS__NUM3 springls__vec3
#define SPRINGLS__COND springls__vmask
#define SPRINGLS__W(name) springls__vec_##name
#define SPRINGLS__W_MATHS SPRINGLS__VEC_MATHS
