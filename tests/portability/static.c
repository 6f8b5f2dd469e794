/* A private copy of which almost nothing is called: no warning about the rest. */
#define SPRINGLS_STATIC
#include "implement.c"

int main(void) { return springls_version() == SPRINGLS_VERSION ? 0 : 1; }
