#!/bin/sh
# oclgrind.sh PROGRAM: runs PROGRAM (opencl_small.c) on Oclgrind, a simulated OpenCL device that checks every access to memory, data
# races between work items, and the calls into OpenCL. Fails when it reports anything. Takes a minute of processor time.
#   Optimised text has instructions that it does not know: hence the build options.
#   Not asked for are uninitialised values (OCLGRIND_UNINITIALIZED=1): five times as slow, and it takes particles after `relax` for
#   such, which MemorySanitizer does not, on the same text compiled as C (make msan).
#   The library is named rather than preloaded (what the command oclgrind does): PoCL's calls into itself would end in it as well.
set -u
library=
for at in /usr/lib/oclgrind /usr/lib/*/oclgrind /usr/local/lib; do [ ! -e "$at/liboclgrind-rt.so" ] || library=$at/liboclgrind-rt.so; done
if [ -z "$library" ]; then
    echo "oclgrind: there is no liboclgrind-rt.so"
    exit 1
fi
log=$(mktemp) || exit 1
trap 'rm -f "$log"' EXIT
OCLGRIND_CHECK_API=1 OCLGRIND_DATA_RACES=1 OCLGRIND_MAX_ERRORS=20 OCLGRIND_LOG=$log \
    OCLGRIND_BUILD_OPTIONS="-cl-opt-disable -Dalways_inline=" "$1" "$library"
status=$?
cat "$log"
if [ $status = 0 ] && [ ! -s "$log" ]; then
    echo "oclgrind: nothing to report"
else
    echo "oclgrind: FAIL"
    exit 1
fi
