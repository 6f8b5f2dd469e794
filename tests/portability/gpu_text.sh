#!/bin/bash
# gpu_text.sh KERNELS.cl: what compilers for GPUs make of the OpenCL text, on a machine without one: clang makes PTX for NVIDIA and
# IR for SPIR-V of it, and ptxas of the CUDA toolkit, where it is there, code for one GPU. Prints a row a kernel; fails where the PTX of
# one has more than 18,000 instructions, that of all more than 110,000 (a compiler's time grows with them, and seconds say little on a
# busy machine: 10 to 14 s of clang and of ptxas for 83,000), registers are spilled, a work group has more than 32 KB of local memory, or
# the arguments of a kernel more than 1024 bytes, which is what every OpenCL device has. Without clang and libclc: skipped (77).
set -u
arch=${GPU_ARCH:-sm_90}
w=$(mktemp -d) || exit 1
trap 'rm -rf "$w"' EXIT
{ cat "$1"; echo 'float3 springls_velocity(float3 x, float time, __global const float *user) { return x; }'; } > "$w/text.cl"

# seconds COMMAND...: runs it, prints the seconds of a processor that it took.
seconds() {
    local TIMEFORMAT=%U
    { time "$@" > "$w/out" 2> "$w/log"; } 2>&1
}

# to_ptx CLANG: with libclc of the same version, whose functions the text calls.
to_ptx() {
    "$1" -x cl -cl-std=CL1.2 -cl-fp32-correctly-rounded-divide-sqrt -D__OPENCL_VERSION__=120 --target=nvptx64-nvidia-nvcl \
        -Xclang -target-cpu -Xclang sm_80 -Xclang -target-feature -Xclang +ptx70 -Xclang -finclude-default-header -ffp-contract=off \
        -Xclang -mlink-builtin-bitcode -Xclang /usr/lib/clc/nvptx64--nvidiacl.bc -w -O2 -S -o "$w/text.ptx" "$w/text.cl"
}

for clang in clang-{20..14} clang; do
    command -v $clang > /dev/null 2>&1 || continue
    taken=$(seconds to_ptx $clang)
    [ -s "$w/text.ptx" ] && break
    if grep -q 'text\.cl:.*error' "$w/log"; then cat "$w/log"; exit 1; fi
done
if [ ! -s "$w/text.ptx" ]; then
    echo "gpu-text: there is no clang with a libclc of its version: skipped"
    exit 77
fi
bad=0
echo "$clang, PTX: $taken s"
spirv=$(seconds $clang -x cl -cl-std=CL1.2 -D__OPENCL_VERSION__=120 --target=spir64 -Xclang -finclude-default-header -w -O0 -emit-llvm -c \
    -o "$w/text.bc" "$w/text.cl")
[ -s "$w/text.bc" ] || { cat "$w/log"; bad=1; }
echo "$clang, IR for SPIR-V: $spirv s"
for translator in llvm-spirv-${clang#clang-} llvm-spirv; do
    command -v $translator > /dev/null 2>&1 || continue
    taken=$(seconds $translator "$w/text.bc" -o "$w/text.spv")
    [ -s "$w/text.spv" ] || { cat "$w/log"; bad=1; }
    echo "$translator, SPIR-V: $taken s"
    break
done

# Bytes of each kernel's arguments, and its instructions; those of functions that are called count as one kernel, "functions".
awk '/\.entry /              { match($0, /springls_[a-z0-9_]+/); name = substr($0, RSTART, RLENGTH); bytes[name] = count[name] = 0; head = 1 }
     /^(\.visible )?\.func/    { name = "functions"; head = 0 }
     head && /\.b8 /          { match($0, /\[[0-9]+\]/); bytes[name] += substr($0, RSTART + 1, RLENGTH - 2); next }
     head && /\.param \.[a-z]64/ { bytes[name] += 8 }
     head && /\.param \.[a-z]32/ { bytes[name] += 4 }
     head && /^\)/            { head = 0 }
     /^\t[a-z@].*;$/           { count[name]++ }
     END { for (name in count) print name, bytes[name] + 0, count[name] }' "$w/text.ptx" > "$w/kernels"
awk '$2 > 1024 { print "gpu-text: " $1 " has " $2 " bytes of arguments; 1024 are sure to be allowed"; bad = 1 }
     $3 > 18000 { print "gpu-text: " $1 " has " $3 " instructions"; bad = 1 }
     { all += $3 }
     END { print "PTX: " all " instructions"; if (all > 110000) { print "gpu-text: too many"; bad = 1 } exit bad }' "$w/kernels" || bad=1

if ! command -v ptxas > /dev/null 2>&1; then
    echo "gpu-text: registers and memory are not checked, there is no ptxas here"
    exit $bad
fi
taken=$(seconds ptxas -arch="$arch" -v -o "$w/text.cubin" "$w/text.ptx")
[ -s "$w/text.cubin" ] || { cat "$w/log"; exit 1; }
echo "ptxas, $arch: $taken s"
echo '| Kernel | Seconds | Instructions of PTX | Registers | Stack, bytes | Spilled, bytes | Local memory, bytes | Arguments, bytes |'
echo '|---|---|---|---|---|---|---|---|'
# Its times are the clock's; together they are made to be the processor's, so that what else runs does not count.
# What it prints of functions that are not inlined comes before the kernel's registers.
awk -v total="$taken" -v clock="$(awk '/Compile time = /{ s += $(NF - 1) } END { print s / 1000 }' "$w/log")" '
    FILENAME == ARGV[1]       { arguments[$1] = $2; instructions[$1] = $3; next }
    /Compiling entry function/ { split($0, part, "\047"); name = part[2]; spilled = 0; next }
    / bytes spill stores/     { for (i = 2; i <= NF; i++) if ($i == "spill") spilled += $(i - 2) }
    /Used [0-9]+ registers/   { registers = number("Used [0-9]+"); stack = number("[0-9]+ bytes cumulative"); memory = number("[0-9]+ bytes smem") }
    /Compile time = /         {
        seconds = number("= [0-9.]+") / 1000 * total / clock
        printf "| %s | %.2f | %d | %d | %d | %d | %d | %d |\n", substr(name, 10), seconds, instructions[name], registers, stack, spilled,
            memory, arguments[name]
        if (spilled > 0) fault("spills " spilled " bytes")
        if (memory > 32768) fault("has " memory " bytes of local memory")
    }
    function number(pattern,    text) { if (!match($0, pattern)) return 0; text = substr($0, RSTART, RLENGTH); gsub(/[^0-9.]/, "", text); return text + 0 }
    function fault(what) { faults = faults "gpu-text: " name " " what "\n"; bad = 1 }
    END { printf "%s", faults; exit bad }' "$w/kernels" "$w/log" || bad=1
exit $bad
