#!/bin/bash
# run.sh [PAGE]: what springls does on the OpenCL device of this machine: limits, compile times, whether it has the scalar bits, and
# times, as a page of Markdown, written to PAGE when given. Needs bash and the programs that `make device` has built, here or on
# another machine of the same kind; takes about six minutes. From the repository's root.
#   PARTS="flows brush"   some of: start scenarios tests flows kernels brush
#   GRIDS="64 128"        sizes of LeVeque's test        SCALAR=256   the largest that scalar code runs too
#   GRID=128              of kernels and brush           LIMIT=120    seconds that a program may take
# A driver that no .icd file names, as in containers, is looked for in the folders that drivers are mounted at. The last line counts
# the checks as the tests do.
set -u
page=${1:-}
parts=${PARTS:-start scenarios tests flows kernels brush}
grids=${GRIDS:-64 128 256 512}
grid=${GRID:-128}
limit=${LIMIT:-120}
w=$(mktemp -d) || exit 1
trap 'rm -rf "$w"' EXIT
passed=0; failed=0

# note STATUS WHAT: counts a check.
note() {
    if [ "$1" = 0 ]; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "FAIL: $2" >&2; fi
}

# ---- the driver, and OpenCL's loader, which may lie beside the programs ----

find_drivers() {
    local driver folder
    local folders="/usr/local/nvidia/lib64 /usr/lib/wsl/lib /usr/lib/x86_64-linux-gnu /usr/lib/aarch64-linux-gnu /usr/lib64 /opt/rocm/lib"
    [ ! -e build/device/libOpenCL.so.1 ] || export LD_LIBRARY_PATH=$PWD/build/device${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
    [ -z "${OCL_ICD_VENDORS:-}" ] || return
    mkdir "$w/vendors"
    cp /etc/OpenCL/vendors/*.icd "$w/vendors/" 2> /dev/null
    for driver in libnvidia-opencl.so.1 libamdocl64.so libigdrcl.so; do
        ! grep -qsF "$driver" "$w"/vendors/*.icd || continue
        for folder in $folders; do
            [ -e "$folder/$driver" ] || continue
            echo "$folder/$driver" > "$w/vendors/$driver.icd"
            export LD_LIBRARY_PATH=$folder${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
            break
        done
    done
    export OCL_ICD_VENDORS=$w/vendors
}

# Drivers' caches, and the library's, are new ones, so that the first start compiles.
empty_caches() {
    export POCL_CACHE_DIR=$w/cache/pocl CUDA_CACHE_PATH=$w/cache/cuda CUDA_CACHE_MAXSIZE=1073741824 XDG_CACHE_HOME=$w/cache/user
    mkdir -p "$POCL_CACHE_DIR" "$CUDA_CACHE_PATH" "$XDG_CACHE_HOME"
}

# ---- rows ----

# field FILE NAME: a number or text of a JSON object with a member a line.
field() { [ ! -e "$1" ] || sed -n "s/^ *\"$2\": *\"\{0,1\}\([^\",]*\)\"\{0,1\},\{0,1\}$/\1/p" "$1" | head -n 1; }

# motion PROGRAM GRID BACKEND: runs a test flow into $w/PROGRAM-GRID-BACKEND.
motion() { timeout "$limit" "build/$1" --grid "$2" --backend "$3" --quiet --json "$w/$1-$2-$3" > "$w/log" 2>&1; }

# flow PROGRAM GRID: a row of the table of flows.
flow() {
    local device=$w/$1-$2-opencl scalar=$w/$1-$2-scalar same=
    if ! motion "$1" "$2" opencl; then
        echo "| $1 | $2 | failed, or more than $limit s | | | | | | | |"
        note 1 "$1 $2: $(tail -n 1 "$w/log")"
        return
    fi
    [ "$2" -gt "${SCALAR:-256}" ] || motion "$1" "$2" scalar || rm -f "$scalar"
    if [ -e "$scalar" ]; then
        same=differ; [ "$(field "$device" state_hash)" != "$(field "$scalar" state_hash)" ] || same=equal
        [ $same = equal ] || [ "$exact" = no ]; note $? "$1 $2: other bits than scalar code"
    fi
    awk -v name="$1" -v grid="$2" -v seconds="$(field "$device" seconds_total)" -v steps="$(field "$device" steps)" \
        -v kernels="$(field "$device" kernels_per_step)" -v reads="$(field "$device" downloads_per_step)" \
        -v error="$(field "$device" deformation_mean)" -v hash="$(field "$device" state_hash)" -v same=$same \
        -v scalar="$(field "$scalar" seconds_total)" 'BEGIN {
            if (scalar != "") scalar = sprintf("%.2f", scalar)
            printf "| %s | %d | %.2f | %.2f | %.0f | %.1f | %.4f | %s | %s | %s |\n", name, grid, seconds, 1e3 * seconds / steps, kernels,
                reads, error, scalar, hash, same }'
}

# tested PROGRAM: a row of the table of tests.
tested() {
    SPRINGLS_TEST_BACKEND=$kind timeout "$limit" "build/test/$1" > "$w/log" 2>&1
    local status=$? counts
    counts=$(sed -n 's/^Pass: \(.*\)\.$/pass: \1/p' "$w/log" | tail -n 1)
    echo "| ${1##*/} | ${counts:-no end: status $status} |"
    [ $status = 0 ] || grep FAIL "$w/log" >&2
    note $status "$1"
}

# started NAME: a row of the table of starts.
started() {
    local seconds
    seconds=$(timeout 240 build/test/device/report start 2> "$w/log"); note $? "start: $(tail -n 1 "$w/log")"
    echo "| $1 | ${seconds:-failed | } |"
}

# ---- sections ----

start_section() {
    empty_caches
    printf '## Start\n\nSeconds of `springls_cl_create` and of `springls_cl_prepare` on all processors, each in a process of its own.\n\n'
    printf '| | Create | Prepare |\n|---|---|---|\n'
    started 'without any cache'
    started "again, with the driver's cache"
    if [ "$kind" = gpu ]; then # PoCL is asked for no programs
        export SPRINGLS_CACHE=$w/cache/springls
        mkdir -p "$SPRINGLS_CACHE"
        started "into the library's cache" > /dev/null
        CUDA_CACHE_DISABLE=1 started "again, with the library's cache alone"
        unset SPRINGLS_CACHE
    fi
    printf '\n'
}

scenarios_section() {
    timeout "$limit" build/test/device/report scenarios 2> "$w/log"; note $? "scenarios: $(tail -n 1 "$w/log")"
}

tests_section() {
    local test
    printf '## Tests\n\n| Program | |\n|---|---|\n'
    for test in backend/test_opencl_parity backend/test_opencl_transfers unit/test_determinism; do tested $test; done
    printf '\n'
}

flows_section() {
    local size
    printf '## Flows\n\nThe default set of parameters; scalar code on %s processors of the same machine.\n\n' "$(nproc)"
    printf '| Flow | Grid | Seconds | ms a step | Kernels a step | Readings a step | Mean error, voxels | Scalar, seconds | State hash | Scalar bits |\n'
    printf '|---|---|---|---|---|---|---|---|---|---|\n'
    for size in $grids; do flow leveque "$size"; done
    flow zalesak "$grid"
    printf '\n'
}

kernels_section() {
    timeout "$limit" build/test/device/report --grid "$grid" kernels 2> "$w/log"; note $? "kernels: $(tail -n 1 "$w/log")"
}

brush_section() {
    timeout "$limit" build/test/device/report --grid "$grid" brush 2> "$w/log"; note $? "brush: $(tail -n 1 "$w/log")"
}

make_page() {
    local device part
    device=$(build/test/device/report device 2> "$w/log"); note $? "there is no OpenCL device here: $(tail -n 1 "$w/log")"
    [ -n "$device" ] || return
    exact=$(sed -n 's/^| Rounds as C does | \(.*\) |$/\1/p' <<< "$device")
    kind=gpu; ! grep -q '^| Kind | processor' <<< "$device" || kind=cpu
    printf '# OpenCL on one device\n\nMade by `make device PAGE=docs/gpu.md`, %s. [OpenCL](opencl.md) explains what is measured.\n\n' "$(date +%F)"
    printf '%s\n\n' "$device"
    for part in $parts; do ${part}_section; done
}

find_drivers
make_page > >(tee "$w/page.md")
wait $!
[ -z "$page" ] || cp "$w/page.md" "$page"
echo "Pass: $passed, fail: $failed, skip: 0."
[ "$failed" = 0 ]
