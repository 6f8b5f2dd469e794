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

# begin NAME COMMAND...: a folder $w for the next row. Waits while as many rows are being made as there are processors.
begin() {
    [ "$count" -lt "$jobs" ] || wait -n
    count=$((count + 1))
    w=$out/$(printf %03d $count); mkdir $w
    printf '%s | `%s`' "$1" "${*:2}" > $w/name
}

# size_of OBJECT COMPILER: bytes of program and data. The size of binutils reads objects of its own platform alone.
size_of() {
    local tool=size
    case $2 in
    emcc) wc -c < $1; return ;;
    *-linux-*gcc | *mingw32-g*) tool=${2%-g*}-size ;;
    esac
    $tool $1 | awk 'NR == 2 { print $1 + $2 + $3 }'
}

# make_and_run "RUNNER" COMPILER FLAGS...: in $w; the object apart, to measure it and its frames.
make_and_run() {
    local runner=$1 extension= link= object='-x none'; shift
    case $1 in *mingw*) extension=.exe ;; emcc) extension=.js link='-s ALLOW_MEMORY_GROWTH=1' object= ;; esac
    "$@" -Wall -Wextra -fstack-usage -c -o $w/object.o $program && [ ! -s $w/log ] || return
    size_of $w/object.o $1 > $w/size
    cut -f 2 $w/object.su | sort -n | tail -n 1 > $w/frame
    "$@" $object $w/object.o -o $w/program$extension $link -lm && [ ! -s $w/log ] || return
    ${runner#-} $w/program$extension 2> $w/errors | tr -d '\r' > $w/hashes
    return ${PIPESTATUS[0]}
}

# platform "NAME" "RUNNER" COMPILER FLAGS...: builds the program for a platform and runs it. RUNNER - : the program itself.
platform() {
    local name=$1 runner=$2; shift 2
    command -v "$1" > /dev/null || { echo "$name: $1 is not here"; return; }
    [ "$runner" = - ] || command -v ${runner%% *} > /dev/null || { echo "$name: ${runner%% *} is not here"; return; }
    begin "$name" "$@"
    ( make_and_run "$runner" "$@" > $w/log 2>&1; echo $? > $w/status ) &
}

# refused "NAME" "WORDS" COMPILER FLAGS...: the header is refused with a reason, and no other message.
refused() {
    local name=$1 words=$2; shift 2
    command -v "$1" > /dev/null || { echo "$name: $1 is not here"; return; }
    begin "$name" "$@"
    echo "$words" > $w/refused
    ( ! "$@" -c -o $w/object.o $program > $w/log 2>&1 && [ "$(grep -c 'error:' $w/log)" = 1 ] &&
        grep -q "error:.*$words" $w/log; echo $? > $w/status ) &
}

# checked "NAME" COMPILER FLAGS...: the header compiles without a warning where nothing can be linked or run.
checked() {
    local name=$1; shift
    command -v "$1" > /dev/null || { echo "$name: $1 is not here"; return; }
    begin "$name" "$@"
    touch $w/checked
    ( "$@" -Wall -Wextra -I. -fsyntax-only tests/portability/implement.c > $w/log 2>&1 && [ ! -s $w/log ]; echo $? > $w/status ) &
}

for level in -O0 -O1 -O2 -O3; do platform "x86-64" - gcc $level; done
for std in c99 c11 c17 c2x; do platform "x86-64, $std" - gcc -std=$std -O1; done
for std in 11 14 17 20; do platform "x86-64, C++$std" - g++ -x c++ -std=c++$std -O1; done
platform "x86-64, one lane" - gcc -O2 -DSPRINGLS_NO_SIMD
platform "x86-64, fused multiply-add at hand" - gcc -O2 -march=x86-64-v3
platform "x86-64, denormal numbers flushed" - gcc -O2 -DFLUSH_DENORMALS
platform "x86-64, -Ofast" - gcc -Ofast
for compiler in clang clang-13 clang-14 clang-15 clang-16 clang-19; do
    platform "x86-64" - $compiler -O2
    platform "x86-64, C++20" - $compiler -x c++ -std=c++20 -O1
    platform "x86-64, fused multiply-add at hand" - $compiler -O2 -march=x86-64-v3
done
platform "x86-64, musl" - musl-gcc -static -O1
platform "i686, SSE2" qemu-i386 i686-linux-gnu-gcc -static -O1 -msse2 -mfpmath=sse
refused "i686, x87" "compile with -msse2 -mfpmath=sse" i686-linux-gnu-gcc
platform "arm64" qemu-aarch64 aarch64-linux-gnu-gcc -static -O1
platform "arm64, denormal numbers flushed" qemu-aarch64 aarch64-linux-gnu-gcc -static -O1 -DFLUSH_DENORMALS
platform "arm, NEON" qemu-arm arm-linux-gnueabihf-gcc -static -O1 -mfpu=neon
platform "arm, VFP" qemu-arm arm-linux-gnueabihf-gcc -static -O1
platform "riscv64" qemu-riscv64 riscv64-linux-gnu-gcc -static -O1
platform "s390x, big-endian" qemu-s390x s390x-linux-gnu-gcc -static -O1
platform "s390x, floats computed in double" qemu-s390x s390x-linux-gnu-gcc -static -std=c99 -O1
platform "Windows, x86-64" wine x86_64-w64-mingw32-gcc -O1
platform "Windows, x86-64, C++17" wine x86_64-w64-mingw32-g++ -x c++ -std=c++17 -O1
for flags in "" "-DWIN32_LEAN_AND_MEAN -DNOMINMAX"; do
    platform "Windows, x86-64, after windows.h" wine x86_64-w64-mingw32-gcc -O1 -include windows.h $flags
done
platform "Windows, x86-64, C++17, after windows.h" wine x86_64-w64-mingw32-g++ -x c++ -std=c++17 -O1 -include windows.h
for std in "c -std=c99" "c -std=c11" "c++ -std=c++17"; do
    checked "Windows, x86-64, as MSVC" clang -x $std --target=x86_64-pc-windows-msvc -fms-compatibility-version=19.30 \
        -nostdlibinc -isystem tests/portability/msvc
done
refused "x86-64, tcc" "of a 12-byte struct that a function returns it stores 16 bytes" tcc
# Debian's Emscripten expects modules of Debian's Node, and no fetch, wherever Node comes from.
export NODE_PATH=/usr/share/nodejs
platform "WebAssembly" "node --no-experimental-fetch" emcc -O2
platform "WebAssembly, SIMD" "node --no-experimental-fetch" emcc -O2 -msimd128 -fno-slp-vectorize
wait

# ---- the result ----

passed=0 failed=0
first=$(ls $out/*/hashes | head -n 1)
verdict() {
    if [ ! -e $1/passed ]; then echo no; elif [ -e $1/refused ]; then echo "refused: $(cat $1/refused)"
    elif [ -e $1/checked ]; then echo "compiles, not run"; else echo yes; fi
}
table() {
    echo "| Platform | Command | Object, KB | Largest frame, bytes | Same bits |"
    echo "|---|---|---:|---:|---|"
    for w in $out/???; do
        echo "| $(cat $w/name) | $([ ! -s $w/size ] || echo $(($(cat $w/size) / 1000))) | $(cat $w/frame 2> /dev/null) | $(verdict $w) |"
    done
}
page() {
    echo "<!-- written by: make portability PAGE=docs/platforms.md -->"
    echo
    echo "# Platforms"
    echo
    echo "\`make portability PAGE=docs/platforms.md\` has written this page. It needs no data. One program (\`$program\`) holds the library and moves three"
    echo "models: both parameter sets, a flow of the library's own and a callback of the program. Each row is one build of it, with the flags"
    echo "shown and no others. \"Same bits\": it compiled without a warning, and its hashes are those of the first row, also of the bytes of"
    echo "snapshots, so that each platform reads what any other has written:"
    echo
    sed 's/^/    /' $first
    echo
    echo "\"Object\" is program and data, about half of it at \`-O2\` the text of the OpenCL kernels (\`SPRINGLS_NO_OPENCL\` leaves it out);"
    echo "\"largest frame\" is of one function. \"Refused\": the header has one error that gives the reason, and what to do. \"Compiles, not"
    echo "run\": without a warning, against the declarations of the C library in \`tests/portability/msvc\`; Microsoft's compiler is not at hand."
    echo
    table
    echo
    echo "\`$(gcc --version | head -n 1)\`, \`$(clang --version | head -n 1)\`. Emulators run the foreign programs: QEMU, Wine, Node. The OpenCL"
    echo "backend is compared by the tests (\`make test-all\`), on PoCL, and by \`make device\` on a GPU."
    echo
    echo "- **Denormal numbers flushed**: the host has set FTZ and DAZ (arm: FZ), as audio and game engines do."
    echo "- **tcc** 0.9.27 compiles \`v = f(g(a), -q)\` wrongly where \`g\` returns a struct of three floats (\`tests/portability/tcc.c\`): it stores both registers, 16"
    echo "  bytes, in a temporary of 12, over the local variable beside it. The library's vectors are such structs."
    echo "- **x87**: each operation would have to be stored to be rounded to float. Every x86 processor since 2001 has SSE2."
}
for w in $out/???; do
    if [ "$(cat $w/status)" = 0 ] && { [ -e $w/refused ] || [ -e $w/checked ] || { [ -s $w/hashes ] && cmp -s $first $w/hashes; }; }; then passed=$((passed + 1)); touch $w/passed
    else failed=$((failed + 1)); echo "FAIL $(cat $w/name)"; head -qn 8 $w/log $w/hashes $w/errors 2> /dev/null | cut -c -150 | sed 's/^/    /'; fi
done
table
[ $# = 0 ] || page > "$1"
echo "$passed passed, $failed failed"
[ $failed = 0 ]
