#!/bin/sh
# run.sh PROGRAM... [--opencl PROGRAM...]: runs test programs one after the other, those behind --opencl on a processor by OpenCL,
# and adds up what they report. The last line is "N passed, N failed". A program that ends without its report, or with a
# status that its report does not explain, counts as one failure more; one that finds no OpenCL as so many tests skipped.
set -u
limit=          # a test that hangs fails
! command -v timeout > /dev/null 2>&1 || limit="timeout ${SPRINGLS_TEST_SECONDS:-900}"
passed=0 failed=0 skipped=0
all_passed=0 all_failed=0 all_skipped=0
log=$(mktemp) || exit 1
trap 'rm -f "$log"' EXIT

begin_group() { group=$1 passed=0 failed=0 skipped=0; }
end_group() {
    summary="${summary:-}$group: $passed passed, $failed failed, $skipped skipped
"
    all_passed=$((all_passed + passed)) all_failed=$((all_failed + failed)) all_skipped=$((all_skipped + skipped))
}

unset SPRINGLS_TEST_BACKEND
begin_group scalar
for program; do
    if [ "$program" = --opencl ]; then
        end_group
        begin_group opencl
        export SPRINGLS_TEST_BACKEND=cpu
        continue
    fi
    echo "== $program${SPRINGLS_TEST_BACKEND:+ on OpenCL}"
    $limit "$program" > "$log" 2>&1
    status=$?
    cat "$log"
    if [ $status = 77 ]; then
        skipped=$((skipped + $(unset SPRINGLS_TEST_BACKEND; "$program" -l | grep -c '^  ')))
        continue
    fi
    set -- $(sed -n 's/^Pass: \([0-9]*\), fail: \([0-9]*\), skip: \([0-9]*\)\.$/\1 \2 \3/p' "$log" | tail -n 1)
    passed=$((passed + ${1:-0})) failed=$((failed + ${2:-0})) skipped=$((skipped + ${3:-0}))
    if [ $# = 0 ] || { [ $status != 0 ] && [ "$2" = 0 ]; }; then
        [ $status != 124 ] || echo "stopped: it took longer than its time"
        echo "FAIL $program: ended with status $status and no failed test of its own"
        failed=$((failed + 1))
    fi
done
end_group
printf %s "$summary"
[ $all_skipped = 0 ] || echo "$all_skipped skipped"
echo "$all_passed passed, $all_failed failed"
[ $all_failed = 0 ]
