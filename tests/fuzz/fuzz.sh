#!/bin/sh
# fuzz.sh NAME MINUTES: runs build/fuzz/NAME on its seeds and on inputs made from them. Prints runs and coverage. Fails when there
# are findings: their inputs are build/fuzz/NAME-*; earlier ones are moved to build/fuzz/found. A finding ends the process, and
# another one begins, up to MOST_RUNS.
set -u
name=$1 minutes=$2 most_runs=20
log=build/fuzz/$name.log
mkdir -p "build/fuzz/corpus/$name" build/fuzz/found
mv -f build/fuzz/"$name"-* build/fuzz/found 2> /dev/null
rm -f "$log"
end=$(($(date +%s) + 60 * minutes))
while left=$((end - $(date +%s))) && [ "$left" -gt 0 ] && [ "$most_runs" -gt 0 ]; do
    "build/fuzz/$name" -print_final_stats=1 -len_control=0 -max_len=1500 -timeout=100 -report_slow_units=100 -rss_limit_mb=3000 \
        -close_fd_mask=3 -max_total_time="$left" -artifact_prefix="build/fuzz/$name-" \
        "build/fuzz/corpus/$name" "tests/fuzz/seeds/$name" >> "$log" 2>&1 < /dev/null
    most_runs=$((most_runs - 1))
done
inputs=$(sed -n 's/^stat::number_of_executed_units: //p' "$log" | paste -sd+ - | sed 's/^$/0/')
coverage=$(sed -n 's/^#.* cov: \([0-9]*\) .*/\1/p' "$log" | sort -n | tail -n 1)
found=$(ls build/fuzz/"$name"-* 2> /dev/null | wc -l)
echo "fuzz $name: $(($inputs)) runs, ${coverage:-0} edges, $found findings in $minutes minutes"
[ "$found" = 0 ]
