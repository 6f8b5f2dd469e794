#!/bin/bash
# busy.sh: how long LeVeque's test takes beside busy loops, by the pool of threads and by OpenMP, in turn for ROUNDS rounds. LOADS=0:
# on the machine as it is. Prints medians; fails when two runs leave different bits.
set -u
loads=${LOADS:-8} rounds=${ROUNDS:-5} grid=${GRID:-64} threads=${THREADS_OF_RUNS:-2} period=${PERIOD:-2.5}
folder=build/bench/busy
mkdir -p $folder && rm -f $folder/*

pids=
for ((i = 0; i < loads; i++)); do
    sh -c 'while :; do :; done' & pids="$pids $!"
done
trap 'kill $pids 2> /dev/null' EXIT

# run NAME THREADS COMMAND...: adds "wall processor" to NAME's file and the hash to that of all.
run() {
    local name=$1 count=$2 TIMEFORMAT='%R %U %S'; shift 2
    { time "$@" --grid $grid --period $period --threads $count --quiet --json - > $folder/report; } 2> $folder/time
    awk '{ print $1, $2 + $3 }' $folder/time >> "$folder/$name.times"
    sed -n 's/.*"state_hash": //p' $folder/report >> $folder/hashes
}
median() { sort -n | awk '{ v[NR] = $1 } END { printf "%.2f", NR % 2 ? v[(NR + 1) / 2] : (v[NR / 2] + v[NR / 2 + 1]) / 2 }'; }

for ((i = 0; i < rounds; i++)); do
    run "one thread" 1 build/leveque
    run "the pool, $threads threads" $threads build/leveque
    run "OpenMP, passive, $threads threads" $threads env OMP_WAIT_POLICY=passive build/bench/leveque_openmp
    [ "${SPIN:-1}" = 0 ] || run "OpenMP, $threads threads" $threads build/bench/leveque_openmp
done

echo "LeVeque $grid^3, period $period, beside $loads busy loops on $(nproc) processors: medians of $rounds runs"
echo
echo "| | seconds, wall clock | of processors | wall clock over one thread's |"
echo "|---|---|---|---|"
for name in "one thread" "the pool, $threads threads" "OpenMP, passive, $threads threads" "OpenMP, $threads threads"; do
    file="$folder/$name.times"
    [ -e "$file" ] || continue
    echo "| $name | $(cut -d ' ' -f 1 "$file" | median) | $(cut -d ' ' -f 2 "$file" | median) |" \
        "$(paste -d ' ' "$file" "$folder/one thread.times" | awk '{ print $1 / $3 }' | median) |"
done
[ "$(sort -u $folder/hashes | wc -l)" = 1 ] && [ "$(wc -l < $folder/hashes)" -gt 1 ] || { echo "busy: the bits differ"; exit 1; }
