/* width_float.h - makes the next *_body.h the text for single numbers: SPRINGLS__W(name) is springls__name. It has no guard
   because it is included before every body. */
#undef SPRINGLS__WIDTH
#undef SPRINGLS__NUM
#undef SPRINGLS__NUM3
#undef SPRINGLS__COND
#undef SPRINGLS__W
#undef SPRINGLS__W_MATHS
#define SPRINGLS__WIDTH 1
#define SPRINGLS__NUM float
#define SPRINGLS__NUM3 springls__v3
#define SPRINGLS__COND bool
#define SPRINGLS__W(name) springls__##name
#define SPRINGLS__W_MATHS SPRINGLS__INNER
