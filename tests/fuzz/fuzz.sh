#!/bin/sh
# fuzz.sh NAME MINUTES: runs a fuzzer on its seeds and on inputs made from them, half of the time with sanitizers (build/fuzz/NAME),
# and half without them, many times faster (build/fuzz/NAME-plain). Prints runs and coverage. Fails when there are findings: their
# inputs are build/fuzz/NAME-*; earlier ones are moved to build/fuzz/found. A finding ends the process, and another one begins, up to
# 20 for each half.
set -u
name=$1 minutes=$2 longest=1500
case $name in small_*) longest=200 ;; esac
corpus=build/fuzz/corpus/$name seeds=tests/fuzz/seeds/$name
mkdir -p "$corpus" build/fuzz/found
mv -f build/fuzz/"$name"-finding-* build/fuzz/found 2> /dev/null
rm -f "build/fuzz/$name.log" "build/fuzz/$name-plain.log"

# Runs a program for half of the minutes. Inputs that libFuzzer prefers for their rare features take it more time than small models
# take (-entropic=0).
run_half() {
    most_runs=20 end=$(($(date +%s) + 30 * minutes))
    while left=$((end - $(date +%s))) && [ "$left" -gt 0 ] && [ "$most_runs" -gt 0 ]; do
        "build/fuzz/$1" -print_final_stats=1 -entropic=0 -len_control=0 -max_len=$longest -timeout=100 -report_slow_units=100 \
            -rss_limit_mb=3000 -close_fd_mask=3 -max_total_time="$left" -artifact_prefix="build/fuzz/$name-finding-" \
            "$corpus" "$seeds" >> "build/fuzz/$1.log" 2>&1 < /dev/null
        most_runs=$((most_runs - 1))
    done
}

# Adds up the runs of a program.
runs_of() { echo $(($(sed -n 's/^stat::number_of_executed_units: //p' "build/fuzz/$1.log" | paste -sd+ - | sed 's/^$/0/'))); }

# Sets `seconds` to the processor time of all programs that have ended.
read_clock() {
    times > "build/fuzz/$name.times"
    seconds=$(awk 'NR == 2 { gsub("[ms]", " "); printf "%d", $1 * 60 + $2 + $3 * 60 + $4 }' "build/fuzz/$name.times")
}

# Runs a program for half of the minutes, and sets `result` to its runs, and those a second of a processor.
measure_half() {
    read_clock
    before=$seconds
    run_half "$1"
    read_clock
    runs=$(runs_of "$1")
    result="$runs runs$2 ($((runs / (seconds > before ? seconds - before : 1))) a second of a processor)"
}

measure_half "$name" " with sanitizers"
slow=$result
measure_half "$name-plain" " without"
coverage=$(sed -n 's/^#.* cov: \([0-9]*\) .*/\1/p' "build/fuzz/$name.log" | sort -n | tail -n 1)
found=$(find build/fuzz -maxdepth 1 -name "$name-finding-*" | wc -l)
echo "fuzz $name: $slow, $result, ${coverage:-0} edges, $found findings in $minutes minutes"
[ "$found" = 0 ]
