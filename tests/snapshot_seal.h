/* snapshot_seal.h - the head of a snapshot whose bytes have been changed. Includes the private part of snapshots. */
#ifndef SNAPSHOT_SEAL_H
#define SNAPSHOT_SEAL_H

#include "fixtures.h"
#include "../src/output/snapshot.h"

/* Writes the length and checksum into the head. */
FIXTURE void fixture_seal(void *bytes, size_t size)
{
    springls__coder c = springls__writer((char *)bytes + 16);
    uint64_t length = size, sum;
    sum = springls__checksum(length, (char *)bytes + SPRINGLS__HEAD_BYTES, size - SPRINGLS__HEAD_BYTES, false);
    SPRINGLS__CODE(&c, length);
    SPRINGLS__CODE(&c, sum);
}

#endif
