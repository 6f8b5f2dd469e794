#!/bin/sh
# kernels.sh KERNELS.cl: is the OpenCL text clean OpenCL C 1.2, 2.0 and 3.0? Compiled by clang with every warning there is, but for:
#   -Wpadded, -Wunused-macros, -Wunused-function, -Wmissing-prototypes   of no meaning to a program text on its own
#   -Wdeclaration-after-statement                                       warns of something C90 forbids
#   -Wconditional-uninitialized                                         it takes loops that always run for loops that may not
#   -Wbad-function-cast                                                 (int)springls__floor(x) is what is meant
#   -Wfloat-equal                                                       comparing with exact values is meant where it is done
# __OPENCL_VERSION__ is the device's and defined by its driver, not by clang; -nostdlibinc: no host header may come in.
set -u
if ! command -v clang > /dev/null 2>&1; then
    echo "kernels: not checked, there is no clang here"
    exit 0
fi
for version in 1.2 2.0 3.0; do
    clang -x cl -cl-std=CL$version -D__OPENCL_VERSION__=${version%.*}${version#*.}0 -nostdlibinc -fsyntax-only -Weverything -Werror -Wno-padded -Wno-unused-macros -Wno-unused-function \
        -Wno-missing-prototypes -Wno-declaration-after-statement -Wno-float-equal -Wno-bad-function-cast -Wno-conditional-uninitialized "$1" || exit 1
done
echo "kernels: clean, $(wc -l < "$1") lines"
