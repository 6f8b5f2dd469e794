# host.sh - the checks of the macros that a program has defined before it includes the headers; read by matrix.sh, whose check, $w and
# $warnings they use.

# The header of a program that defines every word of host_words.txt.
host_header() { $here/host_header.sh; }
# The real headers whose macros are words, where they are at hand: not term.h, which OpenCL's own header does not compile after.
real_header() {
    echo '#include "tests/portability/standard.h"'
    for h in complex.h tgmath.h curses.h termios.h sys/param.h sys/sysmacros.h sys/socket.h X11/Xlib.h X11/Xutil.h; do
        printf '#if __has_include(<%s>)\n#include <%s>\n#endif\n' $h $h
    done
    [ "$1" = "$opencl" ] || printf '#if __has_include(<term.h>)\n#include <curses.h>\n#include <term.h>\n#endif\n'
}
after_header() { # KIND-OF-HEADER OPENCL COMPILER...
    "$1"_header "$2" > $w/host.h && "${@:3}" $2 $warnings -w -DSPRINGLS_THREADS -include $w/host.h -fsyntax-only $here/implement.c
}
# A program that defines all the words leaves the bits of one that defines none.
runs_after_header() { # COMPILER
    host_header > $w/host.h && $1 -O1 -I. -include $w/host.h -o $w/host $here/platform.c -lm && $1 -O1 -I. -o $w/plain $here/platform.c -lm &&
        $w/host > $w/host.hashes && $w/plain > $w/plain.hashes && [ -s $w/plain.hashes ] && diff $w/host.hashes $w/plain.hashes
}

# The words of both headers that do not begin with springls: of the code and of what macros stand for.
own_words() { # COMPILER
    cat springls.h springls_cl.h | $1 -fpreprocessed -dD -E -P -x c - 2> /dev/null | grep -vE '^ *# *(if|elif|else|endif|include|pragma|error|line|undef)' |
        sed -E 's/"([^"\\]|\\.)*"//g' | grep -oE '\b[A-Za-z][A-Za-z0-9_]*' | sort -u | grep -viE '^(springls_|CL_|clk_|defined$|[ulf]+$|e[0-9]+f?$|x[0-9a-f]+[ul]*$)'
}
# Both headers, preprocessed in a program that renames each of those words: a word inside a longer one, or in a string, was expanded
# before it was joined with others or made a string, so a program's macro of that name would be what is joined.
joined_unexpanded() { # COMPILER
    { echo '#include "tests/portability/standard.h"'
      own_words $1 | sed 's/.*/#define & renamed_&/'; } > $w/renamed.h
    [ $(wc -l < $w/renamed.h) -gt 1000 ] && $1 -w -DNDEBUG -DSPRINGLS_THREADS $opencl -I. -include $w/renamed.h -E -P $here/implement.c > $w/renamed.i &&
        grep -q '\brenamed_ctx\b' $w/renamed.i || { echo "nothing was renamed"; return 1; }
    nothing "$(grep -oE '[A-Za-z0-9_]+|"([^"\\]|\\.)*"' $w/renamed.i | grep .renamed_ | sort -u | head -n 8)" "expanded before they are joined"
}
# Macros with arguments: no word of ours is followed by a parenthesis, so a function that a member points to is called as (x.member)(...).
# Left out are words of C, functions of its library, and those of OpenCL, which springls_cl.h calls by their names without cl.
uncalled() { # COMPILER
    { echo '#include "tests/portability/standard.h"'
      own_words $1 | grep -vxE '[A-Z][a-z][A-Za-z]*|bool|double|float|for|if|int|return|size_t|sizeof|switch|void|while|bsearch|calloc|clock|dl(close|open|sym)|fabsf?|f(close|open|read|seek|tell|write)|floor|free|malloc|mem(cmp|cpy|move|set)|offsetof|qsort|remove|rename|rewind|snprintf|sqrtf?|str(chr|cmp|len|str)|time|clock_gettime|gettimeofday|pthread_[a-z_]*|sysconf|va_(start|end)|vsnprintf' |
          sed 's/.*/#define &(...) renamed_&/'; } > $w/renamed.h
    $1 -w -DNDEBUG -DSPRINGLS_THREADS $opencl -I. -include $w/renamed.h -E -P $here/implement.c > $w/renamed.i &&
        nothing "$(grep -oE 'renamed_[A-Za-z0-9_]+' $w/renamed.i | sort -u | head -n 8)" "called by a bare name"
}

# A library of -Ofast refuses what is not finite as any other does, and leaves the same bits; clang's may leave others if it says so.
# Its program is linked without that flag, which would flush denormal numbers.
fast_math() { # COMPILER
    $1 -std=c99 -Ofast -I. -Itests -c -o $w/library.o tests/library.c || return
    for test in not_finite bad_input; do
        $1 -std=c99 -O1 -I. -Itests -o $w/$test tests/unit/test_$test.c $w/library.o -lm -pthread && $w/$test > $w/said || { tail -n 8 $w/said; return 1; }
    done
    $1 -std=c99 -O1 -ffp-contract=off -I. -Itests -o $w/hashes $here/hashes.c $w/library.o -lm -pthread || return
    if $w/hashes > $w/lives; then cp $w/lives $out/lives.${w##*/}; else [ $1 = clang ]; fi
}

# After and before mingw-w64's windows.h.
beside_windows() { # COMPILER FLAGS...
    "$@" $warnings -DSPRINGLS_THREADS -include windows.h -idirafter /usr/include -fsyntax-only $here/implement.c &&
        echo '#include <windows.h>' | cat $here/implement.c - > $w/before.c && "$@" $warnings -DSPRINGLS_THREADS -I$here -idirafter /usr/include -fsyntax-only $w/before.c
}

check "no word is expanded before it is joined" joined_unexpanded gcc
check "no word is called but by a name of ours" uncalled gcc
for compile in "gcc -std=gnu99" "clang -std=gnu11" "g++ -x c++ -std=gnu++17" "clang++ -x c++ -std=gnu++20"; do
    command -v ${compile%% *} > /dev/null || continue
    for with in "" $opencl; do
        check "$compile $with: after the macros of host_words.txt" after_header host "$with" $compile
        check "$compile $with: after real headers with macros" after_header real "$with" $compile
    done
done
check "the same bits after the macros of host_words.txt" runs_after_header "gcc -std=gnu99"
for cc in gcc clang; do
    ! command -v $cc > /dev/null || check "$cc -Ofast: what is not finite is refused; the same bits, or a report" fast_math $cc
done
for compile in "x86_64-w64-mingw32-gcc -std=c99" "x86_64-w64-mingw32-g++ -x c++ -std=c++17"; do
    if ! command -v ${compile%% *} > /dev/null; then echo "${compile%% *}: not here, its checks are left out"; continue; fi
    for flags in "" "-DWIN32_LEAN_AND_MEAN" "-DNOMINMAX" "-DWIN32_LEAN_AND_MEAN -DNOMINMAX"; do
        check "$compile $flags $opencl: beside windows.h" beside_windows $compile $flags $opencl
    done
done
