#!/bin/sh
# cover_lines.sh: counts, part by part, the lines of springls.h that the tests of build/test-cover have run; build/cover/not_reached
# lists the others. First runs the inputs that fuzzers have kept. Fails below 95 %.
set -u
tests=build/test-cover out=build/cover least=95
export LLVM_PROFILE_FILE="$PWD/$out/%4m.profraw"

for corpus in build/fuzz/corpus/*; do
    program=$tests/fuzz/fuzz_${corpus##*/}
    [ -x "$program" ] && find "$corpus" -type f -exec "$program" {} + > /dev/null 2>&1
done

# Some tests are compiled with a library of their own.
objects=$tests/library.o
for test in $(grep -l -E 'springls_under_test|define SPRINGLS_IMPLEMENTATION' tests/unit/test_*.c tests/backend/test_*.c); do
    program=build/test-cover/${test#tests/}
    [ -x "${program%.c}" ] && objects="$objects -object ${program%.c}"
done
llvm-profdata merge -sparse -o "$out/all.profdata" "$out"/*.profraw || exit 1
# shellcheck disable=SC2086
llvm-cov export -format=lcov -instr-profile="$out/all.profdata" $objects springls.h > "$out/lines.info" || exit 1

# Counts lcov's records "DA:line,times" for the parts, whose headings are in springls.h.
awk -F '[:,]' -v least=$least -v list="$out/not_reached" '
    FNR == NR { if ($0 ~ /^\/\* ======== >>/) { split($0, name, /[()]/); part = name[2] }
                part_of[FNR] = part; text[FNR] = $0; next }
    $1 == "SF" { ours = $2 ~ /springls\.h$/ }
    ours && $1 == "DA" { if ($3 > times[$2] + 0 || !($2 in times)) times[$2] = $3 }
    END {
        for (i = 1; i in part_of; i++) {
            if (!(i in times)) continue
            part = part_of[i]
            if (!(part in all)) order[++parts] = part
            all[part]++; every++
            if (times[i] > 0) { reached[part]++; hit++ } else print part ":" i ": " text[i] > list
        }
        for (i = 1; i <= parts; i++)
            printf "%6d of %6d  %5.1f %%  %s\n", reached[order[i]], all[order[i]], 100 * reached[order[i]] / all[order[i]], order[i]
        if (!every) { print "no lines were found"; exit 1 }
        printf "%6d of %6d  %5.1f %%  springls.h; the others: %s\n", hit, every, 100 * hit / every, list
        exit 100 * hit < least * every
    }' springls.h "$out/lines.info"
