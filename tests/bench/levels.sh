#!/bin/bash
# levels.sh: how long examples/minimal.c takes to compile at each level of optimisation, how large it is, and how fast it runs on one
# thread: the best of ROUNDS runs. Prints a table; fails when two levels print different figures.
set -eu
cc=${CC:-cc} rounds=${ROUNDS:-5} folder=build/bench/levels TIMEFORMAT=%2U
mkdir -p $folder

echo '| Flags | Compile, s | Program, KiB | Run, s |'
echo '|---|---|---|---|'
for flags in -O0 -O1 -O2 -O3 '-O3 -march=native' '-O3 -DSPRINGLS_NO_OPENCL' '-O3 -DSPRINGLS_NO_SIMD' \
             '-O2 -DSPRINGLS_MINIMAL' '-O1 -DSPRINGLS_MINIMAL' '-Os -DSPRINGLS_MINIMAL'; do
    compile=$(TIMEFORMAT=%1U; { time $cc -std=c99 $flags -I. -o $folder/minimal examples/minimal.c -lm; } 2>&1)
    strip $folder/minimal
    for ((i = 0; i < rounds; i++)); do
        { time $folder/minimal > $folder/said; } 2>&1
        [ -e $folder/first ] || cp $folder/said $folder/first
        cmp $folder/said $folder/first >&2
    done | sort -n > $folder/times
    echo "| \`$flags\` | $compile | $(($(wc -c < $folder/minimal) / 1024)) | $(head -n 1 $folder/times) |"
done
rm -f $folder/first
