#!/bin/sh
# rusticl.sh TEST LEVEQUE: what Mesa's Rusticl makes of the kernels on llvmpipe, an OpenCL of another make than PoCL, which does not
# divide as C does: runs TEST (test_opencl_tolerance.c), then LeVeque's flow there and without it. Fails where errors differ by more
# than 5 %. The first run compiles for minutes; Mesa keeps that in its cache. Without Rusticl: skipped (77).
set -u
vendor=${RUSTICL_ICD:-/etc/OpenCL/vendors/rusticl.icd}
if [ ! -e "$vendor" ]; then
    echo "rusticl: there is no $vendor: skipped"
    exit 77
fi
export OCL_ICD_VENDORS="$vendor" RUSTICL_ENABLE=llvmpipe
bad=0
"$1" || bad=1
w=$(mktemp -d) || exit 1
trap 'rm -rf "$w"' EXIT
echo '| LeVeque | Backend | Deformation, mean | Surface, mean | Volume error, % | Components | Seconds |'
echo '|---|---|---|---|---|---|---|'
for grid in ${GRIDS:-32}; do
    for backend in scalar opencl; do
        "$2" --grid "$grid" --steps "${STEPS:-0}" --backend $backend --quiet --json "$w/$backend" || exit 1
    done
    grep -q '"backend": "rusticl' "$w/opencl" || { echo "rusticl: FAIL: there is no device"; exit 1; }
    awk -F '[:,]' -v grid="$grid" '
        { gsub(/[ "]/, "") }
        $1 ~ /^(deformation_mean|surface_mean|volume_error_percent|components|seconds_total)$/ && NF <= 3 && !((FILENAME, $1) in of) {
            of[FILENAME, $1] = $2
        }
        function differs(name) { a = of[ARGV[1], name]; b = of[ARGV[2], name]; d = a > b ? a - b : b - a; return d > .05 * a }
        END {
            for (i = 1; i <= 2; i++)
                printf "| %s | %s | %.5f | %.5f | %.3f | %s | %.1f |\n", grid, i == 1 ? "scalar" : "Rusticl",
                       of[ARGV[i], "deformation_mean"], of[ARGV[i], "surface_mean"], of[ARGV[i], "volume_error_percent"],
                       of[ARGV[i], "components"], of[ARGV[i], "seconds_total"]
            exit differs("deformation_mean") || differs("surface_mean") || differs("components")
        }' "$w/scalar" "$w/opencl" || { echo "rusticl: FAIL: LeVeque $grid differs by more than 5 %"; bad=1; }
done
exit $bad
