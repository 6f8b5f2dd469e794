#!/bin/bash
# matrix.sh: are springls.h and springls_cl.h clean in every way they can be used, and does springls.h do the same in all of
# them? A check passes when its commands succeed and say nothing.
# From the repository's root. The last line is "N passed, N failed".
set -u
here=tests/portability
out=build/compile
warnings='-Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Werror -ffp-contract=off -I.'
rm -rf $out; mkdir -p $out

# ---- running checks: as many at a time as there are processors ----

count=0
jobs=$(nproc 2> /dev/null || echo 2)

# check NAME COMMAND...: $w is a folder of the check's own.
check() {
    local name=$1; shift
    count=$((count + 1))
    w=$out/$(printf %03d $count); mkdir $w
    echo "$name" > $w/name
    ( w=$w; "$@" > $w/log 2>&1 && [ ! -s $w/log ] && touch $w/passed ) &
    [ "$(jobs -rp | wc -l)" -lt $jobs ] || wait -n
}

fails()   { if "$@" > /dev/null 2>&1; then echo "this should have failed: $*"; return 1; fi; }
nothing() { [ -z "$1" ] || { echo "$2:" $1; return 1; }; }

# The functions an object or shared library defines for others.
exported() { nm -g --defined-only "$@" | sed -n 's/.* [TDBRVWCi] //p' | sort; }
# Of springls.h; of both headers for a compiler with -DWITH_OPENCL.
public_functions() {
    case $1 in *WITH_OPENCL*) set -- springls.h springls_cl.h ;; *) set -- springls.h ;; esac
    sed -n 's/^ *#define \(springls_[a-z0-9_]*\) SPRINGLS__NAME(.*/\1/p' "$@" | sort
}

# ---- the checks ----

compiles() { "$@" $warnings -c -o $w/object.o; }
parses()   { "$@" $warnings -fsyntax-only $here/implement.c; }
# Compilers warn of more the more they optimise. A function's stack, bytes; jobs need less (tests/unit/test_stack.c).
optimises() {
    "$@" $warnings -fstack-usage -c -o $w/o.o $here/implement.c && { [ $1 != gcc ] ||
        nothing "$(awk -F'\t' '$2 > 16384 && $1 !~ /springls__append_divided/' $w/o.su)" "on the stack"; }
}

two_copies() {  # COMPILER FLAGS-OF-1 FLAGS-OF-2
    $1 $warnings $2 -DPART=1 -c -o $w/1.o $here/pair.c && $1 $warnings $3 -DPART=2 -c -o $w/2.o $here/pair.c &&
        $1 -o $w/pair $w/1.o $w/2.o -lm && $w/pair
}
namespaces() {
    two_copies "$1" -DSPRINGLS_NAMESPACE=first -DSPRINGLS_NAMESPACE=second &&
        nothing "$(exported $w/1.o | grep -v -e ^first_springls_ -e '^main$')" "without the prefix" &&
        nothing "$(comm -3 <(exported $w/1.o | sed -n 's/^first_//p') <(public_functions "$1"))" "not in both lists"
}
only_public_names() {
    $1 $warnings -c -o $w/o.o $here/implement.c &&
        nothing "$(comm -3 <(exported $w/o.o) <(public_functions "$1"))" "declared or defined, not both"
}
shared_library() {
    $1 $warnings -fPIC -fvisibility=hidden -DSPRINGLS_DLL -shared -o $w/libspringls.so $here/implement.c -lm &&
        nothing "$(comm -3 <(exported -D $w/libspringls.so) <(public_functions "$1"))" "exported or public, not both" &&
        $1 $warnings -DSPRINGLS_DLL -DUSE_MAIN -o $w/user $here/use.c -L$w -lspringls -Wl,-rpath,$w && $w/user
}
hidden_library() {
    $1 $warnings -fPIC -fvisibility=hidden -shared -o $w/libspringls.so $here/implement.c -lm &&
        nothing "$(exported -D $w/libspringls.so)" "exported without SPRINGLS_DLL"
}
c_and_cxx() {  # the implementation compiled as C++, its user as C, and the other way round
    $1 -std=c99 $warnings -DUSE_MAIN -c -o $w/use_c.o $here/use.c &&
        $2 -std=c++11 -x c++ $warnings -c -o $w/implement_cxx.o $here/implement.c &&
        $2 -o $w/1 $w/use_c.o $w/implement_cxx.o -lm && $w/1 &&
        $2 -std=c++11 -x c++ $warnings -DUSE_MAIN -c -o $w/use_cxx.o $here/use.c &&
        $1 -std=c99 $warnings -c -o $w/implement_c.o $here/implement.c &&
        $2 -o $w/2 $w/use_cxx.o $w/implement_c.o -lm && $w/2
}
own_assert() {
    $1 -std=c99 $warnings -c -o $w/o.o $here/own_assert.c &&
        nothing "$(nm -u $w/o.o | grep -e __assert -e ' abort')" "called in spite of SPRINGLS_ASSERT" &&
        { nm -u $w/o.o | grep -q user_check || { echo "SPRINGLS_ASSERT is never used"; return 1; }; }
}
few_headers() {
    nothing "$($1 $warnings -H -fsyntax-only $here/use.c 2>&1 | sed -n 's/^\.\.* //p' | grep -v -E '(^|/)((header|springls|springls_cl|stddef|stdint|stdbool)\.h$|(bits|sys|gnu)/|stdc-predef|features)')" \
        "the declarations include"
}
prefixed_macros() {
    nothing "$(sed -nE 's/^ *# *define +([A-Za-z0-9_]+).*/\1/p' springls.h springls_cl.h |
        grep -v -E '^(SPRINGLS_|springls_|CL_TARGET_OPENCL_VERSION$|CL_USE_DEPRECATED_OPENCL_1_2_APIS$)')" \
        "macros without the prefix"
}
without_opencl() {
    $1 $warnings -o $w/program $here/no_opencl.c -lm && nothing "$(readelf -d $w/program | grep -i opencl)" "needed to start" && $w/program
}
installed() {
    local before=$(cksum springls.h)
    make -s install DESTDIR=$PWD/$w PREFIX= && cp $here/use.c $here/header.h $w && $1 ${warnings/-I./-I$w/include} -DWITH_OPENCL -c -o $w/o.o $w/use.c &&
        grep -q "^Version: $(sed -n 's/.*VERSION_[A-Z]* \([0-9]*\)$/\1/p' src/interface/api.h | paste -s -d .)$" $w/share/pkgconfig/springls.pc &&
        make -s uninstall DESTDIR=$PWD/$w PREFIX= && nothing "$(cd $w && find include share -type f)" "left by uninstall" &&
        nothing "$([ "$before" = "$(cksum springls.h)" ] || echo springls.h)" "changed by install"
}
without_kernels() {
    $1 -std=c99 $warnings -DSPRINGLS_NO_OPENCL -c -o $w/o.o $here/implement.c &&
        nothing "$(strings $w/o.o | grep "__kernel void")" "of the kernels' text is in the object" &&
        fails $1 -std=c99 -DSPRINGLS_NO_OPENCL -DWITH_OPENCL -I. -fsyntax-only $here/implement.c
}
# What is left out is neither declared nor in the object, and what stays works.
left_out() {  # COMPILER MACRO FUNCTION
    printf '#include "springls.h"\nvoid *called(void);\nvoid *called(void) { return (void *)%s; }\n' $3 > $w/call.c
    $1 -std=c99 $warnings -D$2 -c -o $w/o.o $here/implement.c &&
        nothing "$(exported $w/o.o | grep -x "$3")" "left in" &&
        $1 -std=c99 -w -I. -c -o $w/call.o $w/call.c && fails $1 -std=c99 -w -D$2 -I. -c -o $w/call.o $w/call.c &&
        $1 -std=c99 -O1 -w -D$2 -I. -o $w/minimal examples/minimal.c -lm && (cd $w && ./minimal > said)
}
with_a_pool() { "$@" $warnings -o $w/threads $here/threads.c -lm -pthread && $w/threads; }
with_a_pool_on_windows() {
    "$@" $warnings -static -o $w/threads.exe $here/threads.c -lm && { ! command -v wine > /dev/null || WINEDEBUG=-all wine $w/threads.exe 2> /dev/null; }
}
minimal_is_silent() { $1 -x c++ -Wall -Wextra -Wpedantic -I. -fsyntax-only examples/minimal.c > $w/said 2>&1 && nothing "$(cat $w/said)" "from minimal.c"; }
# What models have become at the end of their lives, in this build.
lives() { "$@" -std=c99 -ffp-contract=off -I. -Itests -o $w/hashes $here/hashes.c tests/library.c -lm -pthread && $w/hashes > $out/lives.${w##*/}; }
# The library without any flag, on the machine's own instructions, which may be able to fuse; the callbacks of the program do not.
plain_lives() {
    "$@" -O2 -march=native -I. -c -o $w/library.o tests/library.c &&
        "$@" -ffp-contract=off -I. -Itests -o $w/hashes $here/hashes.c $w/library.o -lm -pthread && $w/hashes > $out/lives.${w##*/}
}
same_lives() {
    local first= other
    for other in $out/lives.*; do
        first=${first:-$other}
        diff $first $other || echo "$(cat $out/${other##*.}/name) differs from $(cat $out/${first##*.}/name)"
    done
}
# What a C program sees of both must be the same program: the parts as they are, and the header made of them.
parts_compile() { $1 -std=c99 $warnings -DSPRINGLS_PARTS -fsyntax-only tests/library.c; }

# The implementation as Microsoft's compiler has it: _MSC_VER, no __GNUC__, long of 32 bits; msvc/ declares what springls.h uses of
# the C library. clang knows extensions of GCC there too, so they are looked for in the text
for_msvc() {  # COMPILER LANGUAGE STANDARD FLAGS
    local compile="$1 -x $2 $3 ${4-} --target=x86_64-pc-windows-msvc -fms-compatibility -fms-compatibility-version=19.30 -nostdlibinc"
    mkdir $w/headers && ln -s /usr/include/CL $w/headers/CL && compile="$compile -isystem $here/msvc -isystem $w/headers $warnings"
    $compile -fsyntax-only $here/implement.c &&
        nothing "$(${compile/-DWITH_OPENCL/} -DSPRINGLS_NO_OPENCL -E -P $here/implement.c | grep -oE '__attribute__|__builtin_[a-z_]+|__typeof__|__extension__' |
            grep -v -e __builtin_va_ -e __builtin_offsetof | sort -u)" "extensions of GCC"
}

# With springls_cl.h, and with it all of springls.h.
opencl=-DWITH_OPENCL
. $here/embed.sh
. $here/host.sh
check "macros all begin with SPRINGLS" prefixed_macros
for cc in gcc clang; do
    cxx=${cc/gcc/g}++   # g++, clang++
    if ! command -v $cc > /dev/null; then echo "$cc: not here, its checks are left out"; continue; fi
    languages='-std=c99 -std=c11'
    if command -v $cxx > /dev/null; then languages="$languages -std=c++11 -std=c++20"
    else echo "$cxx: not here, its checks are left out"; fi
    for std in $languages; do
        case $std in *c++*) compile="$cxx -x c++ $std" ;; *) compile="$cc $std" ;; esac
        for with in "" $opencl; do
            check "$cc $std $with: declarations" compiles $compile $with $here/use.c
            check "$cc $std $with: implementation" parses $compile $with
            check "$cc $std $with: other headers' names stay free" compiles $compile $with -fno-builtin $here/clean_names.c
        done
    done
    # As C and, where it is had, as C++.
    for compile in "$cc -std=c99" "$compile"; do
        check "$compile: private copy, mostly unused" compiles $compile $opencl $here/static.c
        check "$compile: private copy with threads, mostly unused" compiles $compile $opencl -DSPRINGLS_THREADS $here/static.c
        check "$compile: a pool of threads" with_a_pool $compile
        check "$compile: goes on without OpenCL" without_opencl "$compile"
        check "$compile: implementation at -O2" optimises $compile $opencl -O2
    done
    check "$cc: implementation at -O3 -DNDEBUG" optimises $cc -std=c99 $opencl -O3 -DNDEBUG
    check "$cc: implementation at -O1" optimises $cc -std=c99 $opencl -O1
    check "$cc: implementation with OpenMP" compiles $cc -std=c99 -fopenmp $here/implement.c
    check "$cc: the parts compile without the tool" parts_compile $cc
    check "$cc: SPRINGLS_NO_OPENCL leaves the kernels' text out" without_kernels $cc
    for cut in SNAPSHOTS:snapshot CHUNKS:chunks_update TOOLS:combine EVENTS:events QUERIES:raycast TILINGS:tiling_step; do
        check "$cc: SPRINGLS_NO_${cut%:*}" left_out $cc SPRINGLS_NO_${cut%:*} springls_${cut#*:}
    done
    check "$cc: SPRINGLS_MINIMAL" left_out $cc SPRINGLS_MINIMAL springls_closest
    case $languages in *c++*)
        for std in c++11 c++20; do check "$cxx -std=$std -Wpedantic: minimal.c" minimal_is_silent "$cxx -std=$std"; done ;;
    esac
    for with in "" $opencl; do
        c99="$cc -std=c99 $with"
        check "$c99: declarations include only stddef, stdint, stdbool" few_headers "$c99"
        check "$c99: defines the public functions and no others" only_public_names "$c99"
    done
    # With springls_cl.h, which has both.
    check "$c99: two plain copies clash (so the next checks mean something)" fails two_copies "$c99" "" ""
    check "$c99: two private copies in one program" two_copies "$c99" -DSPRINGLS_STATIC -DSPRINGLS_STATIC
    check "$c99: two namespaces in one program" namespaces "$c99"
    check "$c99: shared library exports the public functions and no others" shared_library "$c99"
    check "$c99: shared library without SPRINGLS_DLL exports nothing" hidden_library "$c99"
    check "$cc: what is installed is complete" installed "$cc -std=c99"
    check "$cc: SPRINGLS_ASSERT of the user's own" own_assert "$cc"
    for flags in -O0 -O3 '-O3 -march=native -fopenmp' '-O2 -DSPRINGLS_NO_SIMD'; do check "$cc $flags: histories" lives $cc $flags; done
    check "$cc, no -std and no -ffp-contract: histories" plain_lives $cc
    case $languages in *c++*) check "$cc: C and C++ link with one another" c_and_cxx $cc $cxx ;; esac
done
if command -v clang > /dev/null; then
    for with in "" -DSPRINGLS_THREADS $opencl; do
        for std in c99 c11; do check "clang for Windows as MSVC, -std=$std $with: implementation" for_msvc clang c -std=$std $with; done
        check "clang for Windows as MSVC, -std=c++17 $with: implementation" for_msvc clang c++ -std=c++17 $with
    done
fi
if command -v x86_64-w64-mingw32-gcc > /dev/null; then
    check "mingw: a pool of threads" with_a_pool_on_windows x86_64-w64-mingw32-gcc -std=c99
    check "mingw, C++: a pool of threads" with_a_pool_on_windows x86_64-w64-mingw32-g++ -x c++ -std=c++11
else echo "mingw: not here, its checks are left out"; fi
wait
check "all builds leave the same bits" same_lives
wait

# ---- the result ----

passed=0 failed=0
for w in $out/???; do
    if [ -e $w/passed ]; then passed=$((passed + 1))
    else failed=$((failed + 1)); echo "FAIL $(cat $w/name)"; head -n 8 $w/log | sed 's/^/    /'; fi
done
[ $failed != 0 ] || rm -rf $out
echo "$passed passed, $failed failed"
[ $failed = 0 ]
