/* A user's file: the declarations only. */
#include "header.h"

const char *use(void);
const char *use(void) { return springls_status_string(SPRINGLS_OK); }

#ifdef USE_MAIN
int main(void) { return use() && springls_version() == SPRINGLS_VERSION ? 0 : 1; }
#endif
