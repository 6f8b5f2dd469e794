/* Prints the hash of every history: the same lines from every compiler, at every optimisation level, on every machine. */
#include "histories.h"

GREATEST_MAIN_DEFS(); /* of fixtures.h */

int main(void)
{
    int history;
    for (history = 0; history < HISTORIES; history++)
        printf("%016llx %s\n", (unsigned long long)history_run(history, NULL, NULL), history_name(history));
    return springls_fp_contract_detected();
}
