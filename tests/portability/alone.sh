#!/bin/sh
# alone.sh PART...: does each part compile by itself? Then it includes what it uses, and an editor can check it.
# A text without an include guard is no part of its own.
set -u
if [ "${1:-}" = -one ]; then
    grep -q '^#ifndef SPRINGLS_.*H$' "$2" || exit 0
    errors=$(${CC:-cc} -std=c99 -Werror -Wno-unused-const-variable -fsyntax-only -x c "$2" 2>&1) && exit 0
    echo "parts: $2 does not compile alone: it does not include what it uses, or is wrong"
    echo "$errors" | grep -m 3 'error:'
    exit 1
fi
printf '%s\n' "$@" | xargs -n 1 -P "$(nproc 2> /dev/null || echo 2)" "$0" -one || exit 1
echo "parts: each compiles alone"
