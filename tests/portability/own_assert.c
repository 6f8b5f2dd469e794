/* With a check of the user's own, the library neither needs <assert.h> nor calls what that calls. */
extern void user_check(int holds, const char *what);
#define SPRINGLS_ASSERT(condition) user_check((condition) ? 1 : 0, #condition)
#include "implement.c"

#ifdef assert
#error "assert.h came in although SPRINGLS_ASSERT was defined"
#endif
