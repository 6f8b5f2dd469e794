#!/bin/sh
# trust.sh: checks that every file, test and command that docs/trust.md names exists, that tests/every_call.h has every public
# call that returns a status, and that every call with a metric is tested on other grids. Reports as the test programs do.
page=docs/trust.md
passed=0 failed=0

# check MESSAGE COMMAND...
check() {
    message=$1
    shift
    if "$@" > /dev/null 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "FAIL $page: $message"
    fi
}

# ticked TEXT: what stands between backquotes, a line each.
ticked() { echo "$1" | grep -o '`[^`]*`' | tr -d '`'; }

# check_tests CELL: "`file`: `test`, `test`; `file`: ..."
check_tests() {
    file=
    for name in $(ticked "$1"); do
        case $name in
            */*) file=$name; check "there is no $name" [ -f "$name" ] ;;
            *) check "$file has no test $name" grep -qE "^(TEST|    def) $name\(" "$file" ;;
        esac
    done
}

check_command() {
    case $1 in
        "make "*) check "there is no $1" grep -q "^${1#make }:.*##" Makefile tests/tests.mk tests/bench/bench.mk ;;
        build/test/*) check "nothing makes $1" ls "tests/${1#build/test/}".[cp]* ;;
        *) check "$1 is no command" false ;;
    esac
}

rows=$(mktemp)
grep '^| .*`tests/' $page > "$rows"
while IFS='|' read -r _ promise tests command result _; do
    check_tests "$tests"
    check_command "$(ticked "$command")"
    check "no result:$promise" [ -n "$(echo "$result" | tr -d ' ')" ]
done < "$rows"
[ "$passed" -gt 50 ] || check "its rows are not found" false

for call in $(sed -n 's/^SPRINGLS_API springls_status springls_\([a-z_]*\)(.*/\1/p' src/interface/api.h); do
    case $call in
        tiling_*) check "tests/unit/test_tiling_memory.c lets no memory of $call run out" grep -q "CALL_$call" tests/unit/test_tiling_memory.c ;;
        *) check "tests/every_call.h has no $call" grep -q "X($call, [01])" tests/every_call.h ;;
    esac
done

# Calls that have no metric: nothing of theirs depends on spacing and direction.
no_metric="at_rest attribute_count chunks_destroy combine_in_progress create_error default_desc default_forces default_step_desc
describe_attribute find_attribute fp_contract_detected generations get_params get_stats ids index_of kernel_source last_error memory_used
remove_attribute reset set_params set_time stage_name status_string step_in_progress threads_count threads_create threads_destroy
threads_tasks tiling_count tiling_label tiling_last_error tiling_memory_used tiling_state_hash time version version_string"
for call in $(sed -n 's/^SPRINGLS_API .*[ *]springls_\([a-z_]*\)(.*/\1/p' src/interface/api.h); do
    case " $(echo $no_metric) " in
        *" $call "*) ;;
        *) check "no tests/unit/test_metric*.c runs springls_$call on other grids" \
               grep -qw "springls_$call" tests/unit/test_metric*.c tests/unit/metric_grids.h ;;
    esac
done
rm -f "$rows"

echo "Total: $((passed + failed)) checks"
echo "Pass: $passed, fail: $failed, skip: 0."
[ $failed = 0 ]
