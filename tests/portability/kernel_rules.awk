# kernel_rules.awk: the rules of kernels_embed/README.md whose breach NVIDIA's compiler punishes, by never ending or by wrong code.
# On the OpenCL text (print_kernels.c):
#   - a structure has no pointer to private memory and no bool
#   - an array has as many initialisers as elements; only tables of constants have rows
function fault(what) { print "kernels: line " NR ": " what ": " $0; bad = 1 }

# Returns line without comments.
function code(line,    at, result) {
    while (line != "") {
        at = index(line, commented ? "*/" : "/*")
        if (!commented) result = result (at ? substr(line, 1, at - 1) : line)
        if (!at) break
        line = substr(line, at + 2)
        commented = !commented
    }
    return result
}

# Returns how many values a list has: commas within parentheses count for nothing.
function values_of(list) {
    while (gsub(/\([^()]*\)/, "", list)) continue
    return gsub(/,/, ",", list) + 1
}

# line: of a declaration; reads on where its lists do.
function check_arrays(line,    bound, list) {
    while (match(line, /\[[A-Za-z0-9_ *+]+\] *= *\{/)) {
        bound = substr(line, RSTART + 1, RLENGTH)
        sub(/\].*/, "", bound)
        line = substr(line, RSTART + RLENGTH)
        while (line !~ /\}/ && (getline list) > 0) line = line code(list)
        list = substr(line, 1, index(line, "}") - 1)
        if (bound in size) bound = size[bound]
        if (list ~ /\{/ || values_of(list) != bound + 0) fault("an array of " bound " initialised in part, or in rows")
    }
}

{ line = code($0) }
line ~ /^#define SPRINGLS__[A-Z_]+ [0-9]+ *$/ { split(line, word, / +/); size[word[2]] = word[3] }
line ~ /^typedef struct/ { structure = 1 }
structure && line ~ /\*[a-z_]+[;,]/ && line !~ /SPRINGLS__(GLOBAL|LOCAL)|__global|__local/ {
    fault("a pointer to private memory in a structure")
}
structure && line ~ /(^|[ {])bool / { fault("bool in a structure") }
line ~ /}/ { structure = 0 }
line ~ /\] *= *\{/ && line !~ /SPRINGLS__CONST/ { check_arrays(line) }
END { exit bad }
