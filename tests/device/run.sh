#!/bin/bash
# run.sh [PAGE]: what springls does on the OpenCL device of this machine: limits, compile times, whether it has the scalar bits, and
# times, as a page of Markdown, written to PAGE when given. Needs bash and the programs that `make device` has built, here or on
# another machine of the same kind; takes about six minutes. From the repository's root.
#   GRIDS="64 128"   sizes of LeVeque's test        SCALAR=256    the largest that scalar code runs too
#   GRID=128         of kernels and brush           LIMIT=75      seconds a program may take
# A driver whose .icd file is missing, as in containers, is looked for in the folders that drivers are mounted at. The last line
# is "N passed, N failed".
set -u
page=${1:-}
grids=${GRIDS:-64 128 256 512 1024}
limit=${LIMIT:-75}
w=$(mktemp -d) || exit 1
trap 'rm -rf "$w"' EXIT
passed=0; failed=0

# note STATUS NAME: counts a check.
note() {
    if [ "$1" = 0 ]; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "FAIL: $2" >&2; fi
}

# ---- the driver, where no .icd file names it ----

folders="/usr/local/nvidia/lib64 /usr/lib/wsl/lib /usr/lib/x86_64-linux-gnu /usr/lib/aarch64-linux-gnu /usr/lib64 /opt/rocm/lib"
if [ -z "${OCL_ICD_VENDORS:-}" ] && ! ls /etc/OpenCL/vendors/*.icd > /dev/null 2>&1; then
    mkdir "$w/vendors"
    for driver in libnvidia-opencl.so.1 libamdocl64.so libigdrcl.so; do
        for folder in $folders; do
            [ -e "$folder/$driver" ] || continue
            echo "$folder/$driver" > "$w/vendors/${driver%%.*}.icd"
            export LD_LIBRARY_PATH=$folder${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
            break
        done
    done
    export OCL_ICD_VENDORS=$w/vendors
fi
# OpenCL's loader may lie beside the programs.
[ ! -e build/device/libOpenCL.so.1 ] || export LD_LIBRARY_PATH=$PWD/build/device${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}

# ---- rows ----

# field FILE NAME: a number or text of a JSON object with a member a line.
field() { sed -n "s/^ *\"$2\": *\"\{0,1\}\([^\",]*\)\"\{0,1\},\{0,1\}$/\1/p" "$1" | head -n 1; }

# motion PROGRAM GRID BACKEND: runs a test flow into $w/PROGRAM-GRID-BACKEND.
motion() { timeout "$limit" "build/$1" --grid "$2" --backend "$3" --quiet --json "$w/$1-$2-$3" > "$w/log" 2>&1; }

# row PROGRAM GRID: a row of the table of flows.
row() {
    local d=$w/$1-$2-opencl s=$w/$1-$2-scalar same=
    if ! motion "$1" "$2" opencl; then
        echo "| $1 | $2 | failed, or more than $limit s | | | | | | |"
        note 1 "$1 $2: $(tail -n 1 "$w/log")"
        return
    fi
    [ "$2" -gt "${SCALAR:-256}" ] || motion "$1" "$2" scalar || rm -f "$s"
    if [ -e "$s" ]; then
        same=differ; [ "$(field "$d" state_hash)" != "$(field "$s" state_hash)" ] || same=equal
        [ $same = equal ] || [ "$exact" = no ]; note $? "$1 $2: other bits than scalar code"
    fi
    awk -v name="$1" -v grid="$2" -v seconds="$(field "$d" seconds_total)" -v steps="$(field "$d" steps)" \
        -v kernels="$(field "$d" kernels_per_step)" -v reads="$(field "$d" downloads_per_step)" \
        -v error="$(field "$d" deformation_mean)" -v hash="$(field "$d" state_hash)" -v same=$same \
        -v scalar="$([ ! -e "$s" ] || field "$s" seconds_total)" 'BEGIN {
            printf "| %s | %d | %.2f | %.2f | %.0f | %.1f | %.4f | %s | %s | %s |\n", name, grid, seconds, 1e3 * seconds / steps, kernels, reads,
                error, scalar == "" ? "" : sprintf("%.2f", scalar), hash, same }'
}

# tested PROGRAM: a row of the table of tests.
tested() {
    SPRINGLS_TEST_BACKEND=$kind timeout "$limit" "build/test/$1" > "$w/log" 2>&1
    local status=$? counts
    counts=$(grep -E '^Pass: ' "$w/log" | tail -n 1)
    echo "| ${1##*/} | ${counts:-no end: status $status} |"
    note $status "$1: $(grep -m 1 FAIL "$w/log")"
}

# start NAME VARIABLE=VALUE...: a row of the table of starts.
start() {
    local name=$1 seconds; shift
    seconds=$(env "$@" timeout 240 build/test/device/report start 2> "$w/log"); note $? "start: $(tail -n 1 "$w/log")"
    echo "| $name | ${seconds:-failed} |"
}

# ---- the page ----

make_page() {
    local device
    device=$(build/test/device/report device) || { echo "run.sh: there is no OpenCL device here" >&2; note 1 "no device"; return; }
    exact=$(sed -n 's/^| Rounds as C does | \(.*\) |$/\1/p' <<< "$device")
    kind=gpu; ! grep -q 'Portable Computing Language' <<< "$device" || kind=cpu
    echo "<!-- written by: make device PAGE=docs/gpu.md -->"
    printf '# OpenCL on one device\n\nMade by `make device PAGE=docs/gpu.md`, %s. What the words mean: [OpenCL](opencl.md).\n\n' "$(date +%F)"
    printf '%s\n\n' "$device"
    printf '## Start\n\nSeconds of `springls_cl_create` and of `springls_cl_prepare`, each in a process of its own.\n\n'
    printf '| | Create | Prepare |\n|---|---|---|\n'
    mkdir "$w/cache"
    start 'without any cache' CUDA_CACHE_DISABLE=1 POCL_CACHE_DIR="$w/cache/pocl" SPRINGLS_CACHE=
    start "again, with the driver's cache" CUDA_CACHE_PATH="$w/cache/cuda" POCL_CACHE_DIR="$w/cache/pocl" > /dev/null
    start "again, with the driver's cache" CUDA_CACHE_PATH="$w/cache/cuda" POCL_CACHE_DIR="$w/cache/pocl"
    export CUDA_CACHE_PATH=$w/cache/cuda POCL_CACHE_DIR=$w/cache/pocl CUDA_CACHE_MAXSIZE=1073741824
    printf '\n'
    build/test/device/report scenarios 2> "$w/log"; note $? "scenarios: $(tail -n 1 "$w/log")"
    printf '## Tests\n\n| Program | |\n|---|---|\n'
    for test in backend/test_opencl_parity backend/test_opencl_transfers unit/test_determinism; do tested $test; done
    printf '\n## Flows\n\nThe default set of parameters; scalar code on %s processors of the same machine.\n\n' "$(nproc)"
    printf '| Flow | Grid | Seconds | ms a step | Kernels a step | Readings a step | Mean error, voxels | Scalar, seconds | State hash | Scalar bits |\n'
    printf '|---|---|---|---|---|---|---|---|---|---|\n'
    for grid in $grids; do row leveque "$grid"; done
    row zalesak "${GRID:-128}"
    printf '\n'
    for part in kernels brush; do
        timeout "$limit" build/test/device/report --grid "${GRID:-128}" $part 2> "$w/log"; note $? "$part: $(tail -n 1 "$w/log")"
    done
}

make_page > >(tee "$w/page.md")
wait $!
[ -z "$page" ] || cp "$w/page.md" "$page"
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
