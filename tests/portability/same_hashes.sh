#!/bin/sh
# same_hashes.sh PROGRAM PROGRAM: does every history (hashes.c) end in the same bits in two builds? Reports as a test program does.
first=$("$1") second=$("$2")
histories=$(echo "$first" | grep -c .)
if [ "$first" = "$second" ] && [ "$histories" -gt 0 ]; then
    echo "Pass: $histories, fail: 0, skip: 0."
    exit
fi
echo "FAIL same_hashes: $1 leaves"
echo "$first"
echo "but $2"
echo "$second"
echo "Pass: 0, fail: 1, skip: 0."
exit 1
