#!/bin/sh
# report.sh GROUP LOG... [-- GROUP LOG...]: prints the logs that run.sh has written, and adds up their counts for each group and for
# all. The last line is "N passed, N failed". Fails when a test has.
set -u
summary= all_passed=0 all_failed=0 all_skipped=0

end_group() {
    summary="$summary$group: $passed passed, $failed failed, $skipped skipped
"
    all_passed=$((all_passed + passed)) all_failed=$((all_failed + failed)) all_skipped=$((all_skipped + skipped))
}

group=
for log; do
    if [ "$log" = -- ]; then
        end_group
        group=
    elif [ -z "$group" ]; then
        group=$log passed=0 failed=0 skipped=0
    else
        read -r p f s seconds << EOF
$(sed -n 's/^counts //p' "$log" | tail -n 1)
EOF
        echo "== $log, ${seconds} s"
        grep -v '^counts ' "$log"
        passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
    fi
done
end_group
printf %s "$summary"
[ $all_skipped = 0 ] || echo "$all_skipped skipped"
echo "$all_passed passed, $all_failed failed"
[ $all_failed = 0 ]
