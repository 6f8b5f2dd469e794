#!/bin/sh
# fuzz.sh NAME MINUTES: runs build/fuzz/NAME on its seeds and on what it makes of them. Prints runs and coverage, and fails when it
# has found something: then build/fuzz/NAME-* are the inputs.
set -u
name=$1 minutes=$2
mkdir -p "build/fuzz/corpus/$name"
rm -f build/fuzz/"$name"-*
"build/fuzz/$name" -fork=1 -ignore_crashes=1 -ignore_timeouts=1 -ignore_ooms=1 -len_control=0 -max_len=1500 -timeout=100 \
    -report_slow_units=100 -rss_limit_mb=3000 -close_fd_mask=3 -max_total_time=$((60 * minutes)) -artifact_prefix="build/fuzz/$name-" \
    "build/fuzz/corpus/$name" "tests/fuzz/seeds/$name" \
    > "build/fuzz/$name.log" 2>&1 < /dev/null
runs=$(sed -n 's/^#\([0-9]*\):.*/\1/p' "build/fuzz/$name.log" | tail -n 1)
coverage=$(sed -n 's/^#.* cov: \([0-9]*\) .*/\1/p' "build/fuzz/$name.log" | tail -n 1)
found=$(ls build/fuzz/"$name"-* 2> /dev/null | wc -l)
echo "fuzz $name: ${runs:-0} runs, ${coverage:-0} edges, $found findings in $minutes minutes"
[ "$found" = 0 ]
