/* Compiled twice, with -DPART=1 and -DPART=2, and linked into one program: both files hold a whole springls. */
#include "implement.c"

int part2(void);

#if PART == 1
int main(void) { return springls_version() == SPRINGLS_VERSION && part2() == SPRINGLS_VERSION ? 0 : 1; }
#else
int part2(void) { return springls_version(); }
#endif
