#!/bin/sh
# text.sh: has no line of the sources more than 140 characters? Does no identifier of the library have the name of a macro that programs
# are known to define (host_words.txt)? The compile matrix finds the latter too, with more compilers, in minutes.
set -u
here=tests/portability
sources=$(find src kernels_embed examples tests springls_cl.h -type f \( -name '*.[ch]' -o -name '*.cc' -o -name '*.cl' \
    -o -name '*.cpp' -o -name '*.js' -o -name '*.py' -o -name '*.awk' \)) || exit 1
[ -n "$sources" ] || { echo "text: no sources here"; exit 1; }
long=$(echo "$sources" | xargs awk 'length($0) > 140 { print FILENAME ":" FNR ": " length($0) " characters" }') || exit 1
[ -z "$long" ] || { echo "text: lines of more than 140 characters:"; echo "$long"; exit 1; }

mkdir -p build
$here/host_header.sh > build/host_words.h || { echo "text: $here/host_header.sh fails"; exit 1; }
errors=$(${CC:-cc} -std=gnu99 -w -I. -DSPRINGLS_THREADS -include build/host_words.h -fsyntax-only -x c - 2>&1 << 'EOF'
#define SPRINGLS_IMPLEMENTATION
#include "src/springls_parts.h"
EOF
) || {
    echo "text: words of $here/host_words.txt, which programs have as macros:"
    echo "$errors" | grep -E 'error:|(expansion of|expanded from) macro' | grep -v '^build/host\|^\./build/host' | sort -u | head -n 8
    exit 1
}
echo "text: lines of at most 140 characters, no name that programs have as a macro"
