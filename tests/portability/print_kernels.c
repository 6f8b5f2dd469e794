/* Prints the OpenCL program text that springls.h carries: what a driver gets to see, quoting undone by the C compiler. */
#include <stdio.h>
#define SPRINGLS_STATIC
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

int main(void)
{
    const char *const *lines;
    int count, i;
    springls_kernel_source(&lines, &count);
    for (i = 0; i < count; i++) fputs(lines[i], stdout);
    return ferror(stdout) || fflush(stdout) != 0;
}
