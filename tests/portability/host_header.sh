#!/bin/sh
# host_header.sh: prints the header of a program that defines every word of host_words.txt as a macro; any use of one is an error.
words=$(sed 's/#.*//' "${0%/*}/host_words.txt") || exit 1
echo '#include "tests/portability/standard.h"'
echo "$words" | tr -s ' ' '\n' | grep . |
    sed -E 's/\(\)$/(...)/; s/^([A-Za-z0-9_]+)(.*)/#undef \1\n#define \1\2 HOST MACRO/'
