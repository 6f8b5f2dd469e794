# embed.sh - the checks of kernels_embed/embed.c; read by matrix.sh, whose check, $w and $out they use.

embed=$PWD/build/embed

# file PATH LINE...: writes it, in the check's own folder
file() { mkdir -p "$(dirname "$1")"; printf '%s\n' "${@:2}" > "$1"; }

# complains WHAT COMMAND...: one line on stderr that holds WHAT, exit status 1
complains() {
    local said
    said=$("${@:2}" 2>&1 > /dev/null)
    [ $? = 1 ] || { echo "exit status is not 1"; return 1; }
    case $said in *$'\n'*) echo "more than one line: $said"; return 1 ;; *"$1"*) ;;
    *) echo "said '$said' and not '$1'"; return 1 ;; esac
}

embed_errors() (
    cd $w
    file src/a.h '/* x */' '#include "nowhere.h"'
    complains 'src/a.h:2: cannot open src/nowhere.h' $embed src/a.h || return
    file src/a.h '#include "../b/b.h"'
    file b/b.h 'int b;' '#include "../src/a.h"'
    complains 'b/b.h:2: src/a.h includes itself' $embed src/a.h || return
    file src/a.h '#include "../b"'
    complains 'cannot read b' $embed src/a.h || return
    file src/a.h 'int a; /* no end'
    complains 'src/a.h: a comment does not end' $embed src/a.h || return
    file src/a.h 'SPRINGLS_API int nameless;'
    file src/m.h '/* SPRINGLS__NAMESPACE_RENAMES */' '#include "a.h"'
    complains 'names no springls_ function' $embed src/m.h || return
    file src/a.h 'int a;'
    file k.cl 'kernel'
    complains 'no part holds the line' $embed src/a.h k.cl || return
    file x.h '#ifndef X_H' '#define X_H' 'int x;' '#endif'
    file k.cl 'kernel' '#include "x.h"'
    complains 'k.cl:2: no part of springls.h includes x.h' $embed src/a.h k.cl || return
    file src/a.h '/* SPRINGLS__EMBED_KERNELS */' '/* SPRINGLS__EMBED_KERNELS */'
    complains 'more than one line' $embed src/a.h || return
    file src/a.h 'int a;'
    if [ -e /dev/full ]; then complains 'cannot write' sh -c "$embed src/a.h > /dev/full" || return; fi
    printf 'a\0b\n' > src/a.h
    complains 'zero byte' $embed src/a.h
)

# An include of a higher folder, a circle in spite of guards, a part in no listed folder, two parts of one name: refused with the
# line.
embed_folders() (
    cd $w
    guarded() { file "$1" "#ifndef SPRINGLS__$2" "#define SPRINGLS__$2" "${@:3}" '#endif'; }
    file src/root.h '#include "model/grid.h"'
    guarded src/model/grid.h GRID 'int grid;' '#include "../stages/relax.h"'
    guarded src/stages/relax.h RELAX 'int relax;'
    complains 'src/model/grid.h:4: src/stages/relax.h lies in a higher folder: src/stages is above src/model' $embed src/root.h || return
    complains 'lies in a higher folder' $embed $PWD/src/root.h || return
    guarded src/model/grid.h GRID '#include "cells.h"'
    guarded src/model/cells.h CELLS '' '#include "grid.h"'
    complains 'src/model/cells.h:4: src/model/grid.h includes itself, by way of this line' $embed src/root.h || return
    guarded src/model/grid.h GRID '#include "../other/cells.h"'
    guarded src/other/cells.h CELLS
    complains 'src/model/grid.h:3: src/other/cells.h lies in no folder that embed.c lists' $embed src/root.h || return
    guarded src/model/grid.h GRID '#include "../../kernels_embed/device/k.cl"'
    guarded kernels_embed/device/k.cl K
    file kernels_embed/model/k.cl '#include "../../src/model/grid.h"'
    complains 'kernels_embed/model/k.cl:1: src/model/grid.h lies in a higher folder' $embed src/root.h kernels_embed/model/k.cl || return
    guarded src/model/grid.h GRID '#include "../runtime/grid.h"'
    guarded src/runtime/grid.h GRID_TOO
    complains 'two parts or headings have the tag >>grid' $embed src/root.h || return
    guarded src/model/grid.h GRID '#include "../../kernels_embed/model/grid.h"' '/* ---- >>grid:api ---- */' 'int grid;'
    guarded kernels_embed/model/grid.h KERNEL_GRID
    $embed src/root.h > out.h && grep -q '>>grid:kernel ' out.h && grep -q '>>grid  (src' out.h || cat out.h
)

# What make check does with the parts as they are, and one line too much.
embed_own_folders() (
    cp -r src kernels_embed $w && cd $w && $embed src/springls_parts.h kernels_embed/device/entry_points.cl > /dev/null || return
    line=$(grep -n '^#include "../runtime/arrays.h"' src/model/bvh.h | cut -d: -f1)
    sed -i 's,^#include "../runtime/arrays.h",#include "../stages/relax.h"\n&,' src/model/bvh.h
    complains "src/model/bvh.h:$line: src/stages/relax.h lies in a higher folder: src/stages is above src/model" \
        $embed src/springls_parts.h kernels_embed/device/entry_points.cl
)

# A part that does not include what it uses is found.
parts_alone() (
    alone=$PWD/tests/portability/alone.sh
    cd $w
    file good.h '#ifndef SPRINGLS__GOOD_H' '#define SPRINGLS__GOOD_H' 'static int springls__one(void) { return 1; }' '#endif'
    file bad.h '#ifndef SPRINGLS__BAD_H' '#define SPRINGLS__BAD_H' 'static int springls__two(void) { return 2 * springls__one(); }' '#endif'
    $alone good.h > out && ! $alone good.h bad.h > out 2>&1 && grep -q '^parts: bad.h does not compile alone' out || cat out
)

# Parts stand in the order of their includes, each after those that it includes at its top; no private guard and no line of an
# include that was taken is left.
embed_order() (
    cd $w
    file src/root.h '/* root */' '#include "b.h"' '#include "a.h"'
    file src/a.h '/* a.h */' '#ifndef SPRINGLS__A' '#define SPRINGLS__A' '' 'int a;' '#ifdef X' '#endif' '' '#endif'
    file src/b.h '/* b.h */' '#ifndef SPRINGLS__B' '#define SPRINGLS__B' '' '#include "a.h"' '#include "a.h"' '' 'int b;' '#include "c.h"' 'int d;' '#endif'
    file src/c.h 'int c;'
    $embed src/root.h | sed '/>>/d' > out.h
    printf '%s\n' '/* root */' '' '/* a.h */' '' 'int a;' '#ifdef X' '#endif' '' '/* b.h */' '' 'int b;' '' 'int c;' \
        '/* -------- back in src/b.h -------- */' 'int d;' > expected
    sed 1d out.h | diff expected - || return
    file src/root.h '#include "b.h"' '/* SPRINGLS__LIST_OF_PARTS */' '#include "a.h"' # the list stands where its line is
    $embed src/root.h | sed -n '/made of these parts/,$p' | grep -o 'src/[a-z]*\.h$' > out.h
    printf '%s\n' src/a.h src/b.h src/c.h | diff <(sort out.h) -
)

# What is no include stays as it is; what is one is taken as often as C would take it.
embed_includes() (
    cd $w
    file src/a.h '/* #include "x.h"' '   #include "y.h" */' '// #include "z.h"' 'const char *s = "/*";' \
        '# include "once.h" /* why */' '#include "once.h"' '#include "many.h"' '#include "many.h"' '#include <math.h>'
    file src/once.h '/* c */' '#ifndef ONCE' '#define ONCE' 'int once;' '#endif'
    printf 'int many;\r\n/* no line end */' > src/many.h
    $embed src/a.h > out.h || return
    [ "$(grep -c '^int once;$' out.h) $(grep -c '^int many;$' out.h) $(grep -c 'include ' out.h)" = '1 2 4' ] || cat out.h
)

# The text in the literals is the text of the parts, byte for byte, and its #line directives are right.
embed_kernels() (
    cd $w
    tricky='/* tab	quote " backslash \ question ??/ ??? umlaut ä percent %d \n */'
    file kernels_embed/one.h '#ifndef SPRINGLS__ONE' '#define SPRINGLS__ONE' '#include "two.h"' "$tricky" 'one' '#include "two.h"' '#endif'
    file kernels_embed/two.h 'two'
    # A part with a guard is in the text once, from the host; texts without one are repeated wherever they are included.
    file kernels_embed/b.cl '#include "one.h"' '#include "c.cl"' '#include "two.h"' 'bee'
    file kernels_embed/c.cl '#ifndef SPRINGLS__C' '#define SPRINGLS__C' 'see' '#endif'
    file kernels_embed/a.cl '#include "c.cl"' 'ay'
    file src/a.h '#include "../kernels_embed/one.h"' 'host' '#ifdef PRINT' '#include <stdio.h>' 'const char *const k[] = {' \
        '/* SPRINGLS__EMBED_KERNELS */' '0 };' 'int main(void) { int i; for (i = 0; k[i]; i++) fputs(k[i], stdout); return 0; }' \
        '#endif' 'tail'
    $embed src/a.h kernels_embed/b.cl kernels_embed/a.cl > springls.h || return
    sed -n '/^#ifdef PRINT/,/^#endif/p' springls.h > print.c
    $1 -DPRINT -o print print.c && ./print > text || return
    printf '%s\n' two "$tricky" one two see two bee ay | cmp - <(grep -v '^#line' text) || return
    # Every line of the text is found in the line of springls.h that #line claims for it.
    awk '/^#line/ { n = $2; next } { print n++ ":" $0 }' text | grep -E ':(two|one|see|ay|bee)$' |
        while IFS=: read -r n word; do sed -n "${n}p" springls.h | grep -q "$word" || echo "line $n holds no $word"; done
)

embed_renames() (
    cd $w
    file src/a.h '/* SPRINGLS__NAMESPACE_RENAMES */' '#define SPRINGLS_API extern \' ' SPRINGLS_API_not springls_no(' \
        '/* SPRINGLS_API int springls_not(int); */' 'SPRINGLS_API int' 'springls_one (int);' \
        'SPRINGLS_API springls_type *springls_two(int (*springls_three)(int));' 'SPRINGLS_API int springls_one(int x) { }'
    $embed src/a.h | sed -n 's/.*define \(springls_[a-z]*\) SPRINGLS__NAME(\1)$/\1/p' | tr '\n' ' ' > names
    [ "$(cat names)" = 'springls_one springls_two ' ] || cat names
)

check "embed: errors in one clear line" embed_errors
check "embed: folders, circles and tags" embed_folders
check "embed: a higher folder in our own parts" embed_own_folders
check "embed: order of the parts" embed_order
check "parts: each includes what it uses" parts_alone
check "embed: includes" embed_includes
check "embed: OpenCL text and its line numbers" embed_kernels "${CC:-cc}"
check "embed: list of public functions" embed_renames
