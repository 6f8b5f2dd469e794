#!/bin/sh
# test_run.sh: checks what run.sh counts of a program that passes, fails, is skipped, or ends in another way than it reports; and
# that the tests of Python are skipped, with status 0, where a package of theirs is missing. Reports as the test programs do.
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT
passed=0 failed=0

# counts EXPECTED COMMAND...: EXPECTED is "PASSED FAILED SKIPPED".
counts() {
    expected=$1
    shift
    tests/run.sh "$folder/log" "$@"
    if grep -q "^counts $expected [0-9.]*\$" "$folder/log"; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "FAIL $*: expected $expected; run.sh says"
        cat "$folder/log"
    fi
}

counts '3 0 1' sh -c 'echo "Pass: 3, fail: 0, skip: 1."'
counts '0 0 2' sh -c 'echo "Pass: 0, fail: 0, skip: 2."'
counts '2 1 0' sh -c 'echo "Pass: 2, fail: 1, skip: 0."; exit 1'
# A status that the report does not explain is a failure, also of tests that were skipped.
counts '0 1 1' sh -c 'echo "Pass: 0, fail: 0, skip: 1."; exit 1'
counts '0 1 1' sh -c 'echo "Pass: 0, fail: 0, skip: 1."; exit 77'
counts '3 1 0' sh -c 'echo "Pass: 3, fail: 0, skip: 0."; kill -KILL $$'
counts '0 1 0' true
counts '0 1 0' "$folder/none"

# missing MODULE: without it a test of Python is skipped; what it imports besides is not asked for.
missing() {
    rm -rf "$folder/modules"
    mkdir "$folder/modules"
    for module in cffi nibabel numpy scipy skimage springls; do : > "$folder/modules/$module.py"; done
    echo "raise ModuleNotFoundError('there is no $1', name='$1')" > "$folder/modules/$1.py"
    counts '0 0 1' env "PYTHONPATH=$folder/modules" /usr/bin/python3 "$2"
}

if [ -x /usr/bin/python3 ]; then
    for module in nibabel numpy scipy skimage; do missing $module tests/examples/test_judges.py; done
    for module in nibabel numpy; do missing $module tests/examples/test_python.py; done
fi

echo "Pass: $passed, fail: $failed, skip: 0."
[ $failed = 0 ]
