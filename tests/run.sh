#!/bin/sh
# run.sh PROGRAM...: runs test programs one after the other and adds up what they report.
# The last line is "N passed, N failed". A program that ends without its report, or with a status that its report does
# not explain, counts as one failure more.
set -u
limit=          # a test that hangs fails
! command -v timeout > /dev/null 2>&1 || limit="timeout ${SPRINGLS_TEST_SECONDS:-900}"
passed=0 failed=0 skipped=0
log=$(mktemp) || exit 1
trap 'rm -f "$log"' EXIT
for program; do
    echo "== $program"
    $limit "$program" > "$log" 2>&1
    status=$?
    cat "$log"
    set -- $(sed -n 's/^Pass: \([0-9]*\), fail: \([0-9]*\), skip: \([0-9]*\)\.$/\1 \2 \3/p' "$log" | tail -n 1)
    passed=$((passed + ${1:-0})) failed=$((failed + ${2:-0})) skipped=$((skipped + ${3:-0}))
    if [ $# = 0 ] || { [ $status != 0 ] && [ "$2" = 0 ]; }; then
        [ $status != 124 ] || echo "stopped: it took longer than its time"
        echo "FAIL $program: ended with status $status and no failed test of its own"
        failed=$((failed + 1))
    fi
done
[ $skipped = 0 ] || echo "$skipped skipped"
echo "$passed passed, $failed failed"
[ $failed = 0 ]
