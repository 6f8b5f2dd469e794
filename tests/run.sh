#!/bin/sh
# run.sh LOG COMMAND...: runs a test program, a hang of which ends after SPRINGLS_TEST_SECONDS. Writes what it prints to LOG, and as
# the last line: "counts PASSED FAILED SKIPPED SECONDS", where seconds are of processor time. A program that ends without its
# report, or with a status that its report does not explain, counts as one failure more: skipped tests are reported, with status 0.
# Succeeds in every case: report.sh adds up.
log=$1
shift
# What examples allocate has no allocator of the tests' (dirty_memory.h): glibc fills it, new and freed.
case $1 in */examples/*) export MALLOC_PERTURB_=119 ;; esac
limit=
! command -v timeout > /dev/null 2>&1 || limit="timeout ${SPRINGLS_TEST_SECONDS:-900}"
$limit "$@" > "$log" 2>&1
status=$?
times > "$log.times"
seconds=$(awk 'NR == 2 { gsub("[ms]", " "); printf "%.1f", $1 * 60 + $2 + $3 * 60 + $4 }' "$log.times")
rm "$log.times"
counts=$(sed -n 's/^Pass: \([0-9]*\), fail: \([0-9]*\), skip: \([0-9]*\)\.$/\1 \2 \3/p' "$log" | tail -n 1)
set -- ${counts:-0 0 0} "$@"
if [ -z "$counts" ] || { [ $status != 0 ] && [ "$2" = 0 ]; }; then
    [ $status != 124 ] || echo "stopped: it took longer than its time" >> "$log"
    echo "FAIL $4: ended with status $status and no failed test of its own" >> "$log"
    counts="$1 $(($2 + 1)) $3"
fi
echo "counts $counts $seconds" >> "$log"
