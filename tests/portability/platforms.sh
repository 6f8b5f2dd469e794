#!/bin/bash
# platforms.sh [PAGE]: does one program leave the same bits on every platform that is at hand? Prints a table, and writes it to
# PAGE when given. Compilers and emulators that are not there are left out and counted. From the repository's root.
# The last line is "N passed, N failed".
set -u
program=tests/portability/platform.c
out=build/platforms
rm -rf $out; mkdir -p $out

count=0
jobs=$(nproc 2> /dev/null || echo 2)

# platform "NAME" "RUNNER" COMPILER FLAGS...: builds the program for a platform and runs it. RUNNER - : the program itself.
platform() {
    local name=$1 runner=$2; shift 2
    command -v "$1" > /dev/null || { echo "$name: $1 is not here"; return; }
    [ "$runner" = - ] || command -v ${runner%% *} > /dev/null || { echo "$name: ${runner%% *} is not here"; return; }
    count=$((count + 1))
    local w=$out/$(printf %03d $count); mkdir $w
    printf '%s | `%s`' "$name" "$*" > $w/name
    local extension=; case $1 in *mingw*) extension=.exe ;; emcc) extension=.js ;; esac
    ( "$@" -Wall -Wextra -o $w/program$extension $program -lm > $w/log 2>&1 && [ ! -s $w/log ] &&
        ${runner#-} $w/program$extension 2> $w/errors | tr -d '\r' > $w/hashes; echo "${PIPESTATUS[0]}" > $w/status ) &
    [ $((count % jobs)) != 0 ] || wait
}

for level in -O0 -O1 -O2 -O3; do platform "x86-64" - gcc $level; done
for std in c99 c11 c17 c2x; do platform "x86-64, $std" - gcc -std=$std -O2; done
for std in 11 14 17 20; do platform "x86-64, C++$std" - g++ -x c++ -std=c++$std -O2; done
platform "x86-64, one lane" - gcc -O2 -DSPRINGLS_NO_SIMD
platform "x86-64, fused multiply-add at hand" - gcc -O2 -march=native
for compiler in clang clang-13 clang-14 clang-15 clang-16 clang-19; do
    platform "x86-64" - $compiler -O2
    platform "x86-64, C++20" - $compiler -x c++ -std=c++20 -O2
    platform "x86-64, fused multiply-add at hand" - $compiler -O3 -march=native
done
platform "x86-64, musl" - musl-gcc -static -O2
platform "i686, SSE2" - i686-linux-gnu-gcc -static -O2 -msse2 -mfpmath=sse
platform "arm64" qemu-aarch64 aarch64-linux-gnu-gcc -static -O2
platform "arm, NEON" qemu-arm arm-linux-gnueabihf-gcc -static -O2 -mfpu=neon
platform "arm, VFP" qemu-arm arm-linux-gnueabihf-gcc -static -O2
platform "riscv64" qemu-riscv64 riscv64-linux-gnu-gcc -static -O2
platform "s390x, big-endian" qemu-s390x s390x-linux-gnu-gcc -static -O2
platform "Windows, x86-64" wine x86_64-w64-mingw32-gcc -O2
platform "Windows, x86-64, C++17" wine x86_64-w64-mingw32-g++ -x c++ -std=c++17 -O2
# Debian's Emscripten expects modules of Debian's Node, and no fetch, wherever Node comes from.
export NODE_PATH=/usr/share/nodejs
platform "WebAssembly" "node --no-experimental-fetch" emcc -O2 -s ALLOW_MEMORY_GROWTH=1
platform "WebAssembly, SIMD" "node --no-experimental-fetch" emcc -O2 -msimd128 -fno-slp-vectorize -s ALLOW_MEMORY_GROWTH=1
wait

# ---- the result ----

passed=0 failed=0
first=$(ls $out/*/hashes | head -n 1)
table() {
    echo "| Platform | Command | Same bits |"
    echo "|---|---|---|"
    for w in $out/???; do echo "| $(cat $w/name) | $([ -e $w/same ] && echo yes || echo no) |"; done
}
page() {
    echo "# Platforms"
    echo
    echo "\`make portability PAGE=docs/platforms.md\` has written this page. One program (\`$program\`) holds the library and moves three"
    echo "models: both parameter sets, a flow of the library's own and a callback of the program. Each row is one build of it, with the flags"
    echo "shown and no others. \"Same bits\": it compiled without a warning, and its hashes are those of the first row:"
    echo
    sed 's/^/    /' $first
    echo
    table
    echo
    echo "Emulators run the foreign programs: QEMU, Wine, Node. The OpenCL backend is compared by the tests (\`make test\`), on PoCL."
}
for w in $out/???; do
    if [ "$(cat $w/status)" = 0 ] && [ -s $w/hashes ] && cmp -s $first $w/hashes; then passed=$((passed + 1)); touch $w/same
    else failed=$((failed + 1)); echo "FAIL $(cat $w/name)"; head -qn 8 $w/log $w/hashes $w/errors 2> /dev/null | cut -c -150 | sed 's/^/    /'; fi
done
table
[ $# = 0 ] || page > "$1"
echo "$passed passed, $failed failed"
[ $failed = 0 ]
