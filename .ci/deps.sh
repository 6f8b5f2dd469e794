#!/bin/sh
# deps.sh GROUP...: finds what a group of make targets needs and this machine lacks, and installs it through the system's package
# manager. Groups are the cases below: folders of examples/common and programs (examples/examples.mk says which a program uses),
# `examples`, which is all of them, and what other targets want. CC and CXX name the compilers that are wanted. Takes some
# hundredths of a second when nothing is missing: all headers are looked for in one run of the preprocessor.
set -u
CC=${CC:-cc} CXX=${CXX:-g++}
missing=

need()         { case " $missing " in *" $1 "*) ;; *) missing="$missing $1" ;; esac; }
need_command() { command -v "$1" > /dev/null 2>&1 || need "$2"; }
need_file()    { [ -e "$1" ] || need "$2"; }

need_library() {
    for library in /usr/lib*/"$1" /usr/lib*/*/"$1" /usr/local/lib*/"$1"; do [ ! -e "$library" ] || return 0; done
    need "$2"
}

# need_headers "header package" ...
need_headers() {
    if command -v "$CC" > /dev/null 2>&1; then
        for pair; do printf '#if !__has_include(<%s>)\nmissing %s\n#endif\n' "${pair% *}" "${pair#* }"; done |
            "$CC" -E -P -x c - 2> /dev/null | sed -n 's/^missing //p'
    else
        for pair; do echo "${pair#* }"; done   # no compiler, so no way to look: a package twice installed does no harm
    fi
}

compiler_package() { case "$1" in *clang*) echo clang ;; *g++*|*c++*) echo g++ ;; *) echo gcc ;; esac; }

headers='stdio.h libc6-dev'
programs='springls pictures imaging surface shapes atlas viewer engine_embed'
for group in $(printf '%s\n' "$@" | sed "s/^examples\$/$programs/; s/^bench\$/$programs scan openvdb/; s/^judges\$/judges openvdb elastix/"); do
    need_command "${CC%% *}" "$(compiler_package "$CC")"
    case $group in
    make)
        need_command make make ;;
    engine_embed|test)   # C++; of the tests, the engine's game loop is
        need_command "${CXX%% *}" "$(compiler_package "$CXX")" ;;
    base|character|solids)   # folders that need what they use, and no more
        ;;
    springls)
        headers="$headers
            CL/cl.h opencl-headers" ;;
    pictures)
        headers="$headers
            stb/stb_image_write.h libstb-dev
            zlib.h zlib1g-dev" ;;
    imaging)   # GDCM's face is C++; without it there is little in it
        need_command "${CXX%% *}" "$(compiler_package "$CXX")"
        headers="$headers
            nifti/nifti2_io.h libnifti2-dev
            teem/nrrd.h libteem-dev
            zlib.h zlib1g-dev" ;;
    surface)   # Draco's decoder is C++
        need_command "${CXX%% *}" "$(compiler_package "$CXX")"
        headers="$headers
            assimp/cimport.h libassimp-dev
            cjson/cJSON.h libcjson-dev
            draco/compression/decode.h libdraco-dev
            meshoptimizer.h libmeshoptimizer-dev" ;;
    shapes|registration)
        headers="$headers
            lapacke.h liblapacke-dev" ;;
    atlas)
        headers="$headers
            cjson/cJSON.h libcjson-dev" ;;
    viewer)
        headers="$headers
            GLFW/glfw3.h libglfw3-dev
            epoxy/gl.h libepoxy-dev"
        need_library libEGL.so.1 libegl1   # pictures without a display
        need_library dri/swrast_dri.so libgl1-mesa-dri ;;
    scan)   # a head for segment
        need_file "${HEAD_SCAN:-/usr/share/mricron/templates/ch2bet.nii.gz}" mricron-data ;;
    fresh)   # a bare system to try all this in
        need_command mmdebstrap mmdebstrap
        need_command git git ;;
    openvdb)
        headers="$headers
            openvdb/openvdb.h libopenvdb-dev
            tbb/tbb.h libtbb-dev
            boost/version.hpp libboost-dev
            boost/iostreams/stream.hpp libboost-iostreams-dev" ;;
    cgal)   # wraps meshes beside mend
        headers="$headers
            CGAL/alpha_wrap_3.h libcgal-dev" ;;
    elastix)   # registers beside register
        need_command elastix elastix ;;
    plastimatch)   # another, which the table does without
        need_command plastimatch plastimatch ;;
    judges)   # what tests compare with, and skip where it is missing
        need_command gltfpack gltfpack
        headers="$headers
            CGAL/Surface_mesh.h libcgal-dev"
        [ -x /usr/bin/python3 ] && /usr/bin/python3 -c 'import scipy, skimage' 2> /dev/null ||
            for package in python3-scipy python3-skimage; do need $package; done
        # Not packages of the system: Khronos' validator of glTF files and a program that shows them, where npm is at hand.
        [ -d build/npm/node_modules/gltf-validator ] || ! command -v npm > /dev/null 2>&1 ||
            timeout 120 npm install --prefix build/npm --no-audit --no-fund --loglevel=error gltf-validator@2.0.0-dev.3.10 three@0.187.0 ||
            echo "Going on without gltf-validator and three: npm could not fetch them." ;;
    matrix)
        headers="$headers
            CL/cl.h opencl-headers"
        for c in gcc g++ clang; do need_command $c $c; done
        need_command x86_64-w64-mingw32-g++ g++-mingw-w64-x86-64
        echo '#include <omp.h>' | clang -fopenmp -E - > /dev/null 2>&1 || need libomp-dev ;;
    portability)   # compilers for other platforms, and what runs their programs
        need_command clang clang
        need_command musl-gcc musl-tools
        for pair in i686:i386 aarch64:arm64 riscv64:riscv64 s390x:s390x; do
            need_command ${pair%:*}-linux-gnu-gcc "gcc-${pair%:*}-linux-gnu libc6-dev-${pair#*:}-cross"
        done
        need_command arm-linux-gnueabihf-gcc "gcc-arm-linux-gnueabihf libc6-dev-armhf-cross"
        need_command qemu-aarch64 qemu-user
        need_command tcc tcc
        need_command x86_64-w64-mingw32-g++ g++-mingw-w64-x86-64
        need_command wine "wine wine64"
        need_command emcc "emscripten node-acorn" ;;
    web)   # the page's compiler
        need_command emcc "emscripten node-acorn" ;;
    npm)   # the package for JavaScript
        need_command emcc "emscripten node-acorn"
        need_command npm npm ;;
    web-test)   # a browser without a display
        need_command node nodejs
        need_command chromium-headless-shell chromium-headless-shell ;;
    python)   # the one of the system: its packages hold the modules
        [ -x /usr/bin/python3 ] && /usr/bin/python3 -c 'import cffi, numpy, nibabel' 2> /dev/null ||
            for package in python3 python3-cffi python3-numpy python3-nibabel; do need $package; done ;;
    dicom)   # folders of DICOM files, which programs do without
        ls /usr/include/gdcm-*/gdcmImageReader.h > /dev/null 2>&1 || need libgdcm-dev ;;
    maxflow)   # segment's graph cuts, which it does without
        ls /usr/include/maxflow-*/maxflow.h > /dev/null 2>&1 || need libmaxflow-dev ;;
    cohort)   # scans by the hundred: a workflow and its pictures
        need_command snakemake snakemake
        [ -x /usr/bin/python3 ] && /usr/bin/python3 -c 'import PIL, nibabel, numpy, yaml' 2> /dev/null ||
            for package in python3-pil python3-nibabel python3-numpy python3-yaml; do need $package; done ;;
    slurm)   # a cluster of one machine, on which a test runs that workflow
        need_command slurmctld slurmctld
        need_command slurmd slurmd
        need_command sbatch slurm-client
        need_command munged munge ;;
    engines)   # what holds the library in examples/engines, and a display for it
        need_command "${CXX%% *}" "$(compiler_package "$CXX")"
        need_command pkg-config pkg-config
        need_library libGL.so.1 libgl1
        need_library dri/swrast_dri.so libgl1-mesa-dri
        headers="$headers
            OGRE/Ogre.h libogre-1.12-dev" ;;
    packages)   # what finds the library for a program
        for command in cmake gdb meson pkg-config; do need_command $command $command; done
        [ -x /usr/bin/python3 ] && /usr/bin/python3 -c 'import cffi, numpy, venv' 2> /dev/null ||
            for package in python3 python3-cffi python3-numpy; do need $package; done ;;
    opencl)   # a device that every machine can have: its processors, by PoCL
        headers="$headers
            CL/cl.h opencl-headers"
        need_library libOpenCL.so.1 ocl-icd-libopencl1
        need_file /etc/OpenCL/vendors/pocl.icd pocl-opencl-icd ;;
    rusticl)   # an OpenCL of another make, on the processors
        headers="$headers
            CL/cl.h opencl-headers"
        need_library libOpenCL.so.1 ocl-icd-libopencl1
        need_file /etc/OpenCL/vendors/rusticl.icd mesa-opencl-icd ;;
    oclgrind)   # a device that looks at every access; and clang's sanitizer that does so for C
        headers="$headers
            CL/cl.h opencl-headers"
        need_command oclgrind oclgrind
        need_command clang clang
        echo 'int main(void) { return 0; }' | clang -x c -fsanitize=memory -o /dev/null - 2> /dev/null || need libclang-rt-dev ;;
    gpu-text)   # compilers for GPUs, which need none; libclc of clang's version
        headers="$headers
            CL/cl.h opencl-headers"
        need_command clang-15 clang-15
        need_command llvm-spirv-15 llvm-spirv-15
        need_file /usr/lib/clc/nvptx64--nvidiacl.bc libclc-15 ;;
    valgrind)   # runs a program with a look at every access
        need_command valgrind valgrind ;;
    fuzz)   # libFuzzer
        need_command clang clang
        echo 'int LLVMFuzzerTestOneInput(void); int LLVMFuzzerTestOneInput(void) { return 0; }' |
            clang -x c -fsanitize=fuzzer -o /dev/null - 2> /dev/null || need libclang-rt-dev ;;
    display)   # a window that nobody needs to see: a virtual display, OpenGL drawn by the processor
        need_command Xvfb xvfb
        need_library libEGL.so.1 libegl1
        need_library libGL.so.1 libgl1
        need_library dri/swrast_dri.so libgl1-mesa-dri ;;
    *)
        echo "deps.sh: no such group: $group" >&2; exit 2 ;;
    esac
done
# Word by word into pairs; the names hold no blanks.
set -- $headers
pairs=
while [ $# -ge 2 ]; do pairs="$pairs$1 $2
"; shift 2; done
IFS='
'
for package in $(need_headers $pairs); do need "$package"; done
unset IFS

[ -n "$missing" ] || exit 0

as_root=
[ "$(id -u)" = 0 ] || as_root=sudo
if ! command -v apt-get > /dev/null 2>&1 || { [ -n "$as_root" ] && ! command -v sudo > /dev/null 2>&1; }; then
    {
        echo "These Debian packages, or what your system calls them, are missing:$missing"
        echo "There is no apt-get with the right to use it here: please install them, then run make again."
    } >&2
    exit 1
fi
echo "Installing through apt-get, because it is missing:$missing"
log=$(mktemp)
# A stale or empty list of packages is the usual reason for a failure, and an unreachable mirror is none if the
# packages are at hand: so the result of `update` does not matter, that of `install` does.
{ $as_root apt-get update; $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
    $missing; } > "$log" 2>&1
status=$?
if [ $status != 0 ]; then
    tail -n 15 "$log" >&2
    echo "apt-get could not install:$missing" >&2
fi
rm -f "$log"
exit $status
