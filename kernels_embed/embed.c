/* embed.c - makes springls.h of its parts.

     embed src/springls_parts.h kernels_embed/one.cl ... > springls.h

   1. Quoted includes are replaced by the file they name (relative to the including file), under a banner with a
      greppable tag. <system> includes stay. A part with an include guard is taken once, before the first part that
      includes it at its top: so the order follows from the includes. A private guard (SPRINGLS__...) is left out. A part
      without a guard is taken as often as C would.
   2. The line  SPRINGLS__EMBED_KERNELS in a comment of its own  becomes the OpenCL program text, one string literal a
      line: every part that lies in kernels_embed/, then the .cl files of the command line and those that they include.
      #line directives in that text point into springls.h, so the build log of an OpenCL driver does too.
   3. The line  SPRINGLS__NAMESPACE_RENAMES in a comment of its own  becomes one #define for each function that is
      declared with SPRINGLS_API, so no function can be forgotten there.
   4. The line  SPRINGLS__LIST_OF_PARTS in a comment of its own  becomes a table of contents.
   5. An include of a part in a higher folder (the table below), a circle of includes and two tags of one name are refused.

   Without this tool these comments do nothing, and the parts compile as they are.
   Memory is never freed: the tool lives for some milliseconds. */
#include <ctype.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char PRODUCT[] = "springls.h";
static const char MATHS_FOLDER[] = "kernels_embed/";
static const char PRIVATE_GUARD[] = "SPRINGLS__";
static const char KERNELS_MARKER[] = "/* SPRINGLS__EMBED_KERNELS */";
static const char RENAMES_MARKER[] = "/* SPRINGLS__NAMESPACE_RENAMES */";
static const char LIST_MARKER[] = "/* SPRINGLS__LIST_OF_PARTS */";

/* The folders, lowest first: a part includes parts of its own folder and of lower ones. */
static const char *const folders[] = {
    "kernels_embed/interface", "kernels_embed/language", "kernels_embed/model", "kernels_embed/stages", "kernels_embed/output",
    "kernels_embed/device",
    "src/interface", "src/runtime", "src/model", "src/stages", "src/solver", "src/lifecycle", "src/input", "src/output",
    "src/tools"
};

/* ---- errors, memory, text ---- */

static void die(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fputs("embed: ", stderr);
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
    va_end(args);
    exit(1);
}

static void *resize(void *memory, size_t bytes)
{
    memory = realloc(memory, bytes);
    if (!memory) die("out of memory");
    return memory;
}

typedef struct text { char *at; size_t length, room; } text;

static void append(text *t, const char *bytes, size_t n)
{
    if (t->room - t->length <= n) t->at = resize(t->at, t->room = 2 * (t->length + n) + 64);
    memcpy(t->at + t->length, bytes, n);
    t->length += n;
    t->at[t->length] = 0;
}

static void append_string(text *t, const char *string) { append(t, string, strlen(string)); }

static char *copy(const char *bytes, size_t n)
{
    text t = { 0, 0, 0 };
    append(&t, bytes, n);
    return t.at;
}

static char *join(const char *a, const char *b, const char *c)
{
    text t = { 0, 0, 0 };
    append_string(&t, a);
    append_string(&t, b);
    append_string(&t, c);
    return t.at;
}

static const char *skip_blanks(const char *s)
{
    while (isspace((unsigned char)*s)) s++;
    return s;
}

static size_t word_length(const char *s)
{
    size_t n = 0;
    while (isalnum((unsigned char)s[n]) || s[n] == '_') n++;
    return n;
}

/* ---- lines: of a file, and of the product ---- */

typedef struct line {
    const char *string;   /* without its line end */
    const char *code;     /* the same with its comments blanked, so that examples in comments are not taken for code */
    size_t number;        /* in its file, from 0 on */
    int in_comment;       /* it begins inside a comment */
    int maths;            /* it belongs to the OpenCL program text */
} line;

typedef struct lines { line *at; size_t count, room; } lines;

static void add_line(lines *list, line l)
{
    if (list->count == list->room) list->at = resize(list->at, (list->room = 2 * list->room + 64) * sizeof *list->at);
    list->at[list->count++] = l;
}

static void add_string(lines *list, const char *string)
{
    line l = { 0, "", 0, 0, 0 };
    l.string = string;
    add_line(list, l);
}

/* Returns a copy of a line in which comments are blanks. Nothing begins a comment within a literal. */
static const char *blank_comments(const char *string, int *in_comment)
{
    char *s = copy(string, strlen(string)), *code = s;
    char quote = 0;
    for (; *s; s++) {
        if (*in_comment) {
            if (s[0] == '*' && s[1] == '/') {
                *in_comment = 0;
                *s++ = ' ';
            }
            *s = ' ';
        } else if (quote) {
            if (s[0] == '\\' && s[1]) s++;
            else if (*s == quote) quote = 0;
        } else if (*s == '"' || *s == '\'') {
            quote = *s;
        } else if (s[0] == '/' && s[1] == '*') {
            *in_comment = 1;
            *s++ = ' ';
            *s = ' ';
        } else if (s[0] == '/' && s[1] == '/') {
            *s = 0;
            break;
        }
    }
    return code;
}

static lines read_lines(const char *path, const char *asked_by)
{
    lines list = { 0, 0, 0 };
    text file = { 0, 0, 0 };
    char block[4096];
    size_t n;
    char *s, *end;
    int in_comment = 0;
    FILE *in = fopen(path, "rb");
    if (!in) die("%s: cannot open %s: %s", asked_by, path, strerror(errno));
    while ((n = fread(block, 1, sizeof block, in)) > 0) append(&file, block, n);
    if (ferror(in)) die("%s: cannot read %s: %s", asked_by, path, strerror(errno));
    fclose(in);
    if (!file.length) die("%s: %s is empty", asked_by, path);
    if (memchr(file.at, 0, file.length)) die("%s: %s is no text file (it holds a zero byte)", asked_by, path);
    for (s = file.at; *s; s = end) {
        line l = { 0, 0, 0, 0, 0 };
        end = strchr(s, '\n');
        end = end ? end + 1 : s + strlen(s);
        for (n = (size_t)(end - s); n > 0 && (s[n - 1] == '\n' || s[n - 1] == '\r'); n--) {}
        l.string = copy(s, n);
        l.number = list.count;
        l.in_comment = in_comment;
        l.code = blank_comments(l.string, &in_comment);
        add_line(&list, l);
    }
    if (in_comment) die("%s: a comment does not end", path);
    return list;
}

/* Returns what follows "#name" in a line that is this directive, else NULL. */
static const char *directive(const line *l, const char *name)
{
    const char *s = skip_blanks(l->code);
    size_t n = strlen(name);
    if (*s != '#') return 0;
    s = skip_blanks(s + 1);
    if (word_length(s) != n || memcmp(s, name, n) != 0) return 0;
    return skip_blanks(s + n);
}

/* Returns whether the line has this marker and nothing else. */
static int is_marker(const line *l, const char *marker)
{
    const char *s = skip_blanks(l->string);
    size_t n = strlen(marker);
    return !l->in_comment && strncmp(s, marker, n) == 0 && !*skip_blanks(s + n);
}

/* Returns the name X of a file whose first two lines of code are #ifndef X and #define X, else NULL. */
static char *guard_of(const lines *file)
{
    const char *guard = 0, *defined;
    size_t i;
    for (i = 0; i < file->count; i++) {
        if (!*skip_blanks(file->at[i].code)) continue;
        if (!guard) {
            if (!(guard = directive(&file->at[i], "ifndef"))) return 0;
            continue;
        }
        defined = directive(&file->at[i], "define");
        if (!defined || word_length(defined) != word_length(guard) || memcmp(defined, guard, word_length(guard)) != 0) return 0;
        return copy(guard, word_length(guard));
    }
    return 0;
}

/* Removes the #ifndef and the #define of a file's guard, and its #endif, which is the last of the file. */
static void drop_guard(lines *file)
{
    size_t i, n = 0, end = file->count;
    int found = 0;
    while (!directive(&file->at[--end], "endif")) {}
    for (i = 0; i < file->count; i++) {
        const char *code = skip_blanks(file->at[i].code);
        if (i == end || (found < 2 && *code)) found++;
        else file->at[n++] = file->at[i];
    }
    while (n > 0 && !*skip_blanks(file->at[n - 1].string)) n--;
    file->count = n;
}

/* ---- paths ---- */

/* Returns the path of a quoted include: relative to the including file, without any "folder/..". */
static char *resolve(const char *from, const char *name, size_t length)
{
    const char *slash = strrchr(from, '/'), *s, *end;
    text whole = { 0, 0, 0 }, path = { 0, 0, 0 };
    if (slash) append(&whole, from, (size_t)(slash - from) + 1);
    append(&whole, name, length);
    append(&path, "", 0);
    for (s = whole.at; *s; s = end) {
        end = strchr(s, '/');
        end = end ? end + 1 : s + strlen(s);
        if (strncmp(s, "./", 2) == 0) continue;
        if (strncmp(s, "../", 3) == 0 && path.length > 0 && strcmp(path.at + path.length - 1, "/") == 0
            && (path.length < 3 || strcmp(path.at + path.length - 3, "../") != 0)) {
            path.at[--path.length] = 0;
            while (path.length > 0 && path.at[path.length - 1] != '/') path.at[--path.length] = 0;
            continue;
        }
        append(&path, s, (size_t)(end - s));
    }
    return path.at;
}

static const char *base_name(const char *path) { return strrchr(path, '/') ? strrchr(path, '/') + 1 : path; }

/* Returns whether a path leads through kernels_embed/. */
static int is_maths(const char *path)
{
    const char *found = strstr(path, MATHS_FOLDER);
    return found && (found == path || found[-1] == '/');
}

/* Returns "relax" for src/stages/relax.h, "relax:kernel" for kernels_embed/stages/relax.h. */
static char *tag_of(const char *path)
{
    const char *base = base_name(path), *dot = strrchr(base, '.');
    char *name = copy(base, dot ? (size_t)(dot - base) : strlen(base));
    return join(name, is_maths(path) ? ":kernel" : "", "");
}

/* Returns the place of a part's folder in the table of folders; -1: it is not there. */
static int folder_rank(const char *path)
{
    size_t i, folder = (size_t)(base_name(path) - path);
    for (i = 0; i < sizeof folders / sizeof *folders; i++) {
        size_t n = strlen(folders[i]) + 1;
        if (folder >= n && memcmp(path + folder - n, folders[i], n - 1) == 0 && (folder == n || path[folder - n - 1] == '/'))
            return (int)i;
    }
    return -1;
}

/* ---- step 1: the parts in reading order ---- */

typedef struct part { const char *path; int guarded; } part;

static struct { part *at; size_t count, room; } parts;   /* every file taken so far */
static lines product;                                    /* markers still in it */
static lines device_text;                                /* of the .cl files */

/* The files that include each other down to this one: one that is twice among them is a circle. */
typedef struct chain { const char *path; const struct chain *up; } chain;

static const part *find_part(const char *path)
{
    size_t i;
    for (i = 0; i < parts.count; i++)
        if (strcmp(parts.at[i].path, path) == 0) return &parts.at[i];
    return 0;
}

static void add_part(const char *path, int guarded)
{
    part p;
    p.path = path;
    p.guarded = guarded;
    if (parts.count == parts.room)
        parts.at = resize(parts.at, (parts.room = 2 * parts.room + 16) * sizeof *parts.at);
    parts.at[parts.count++] = p;
}

/* Returns the file that a quoted include names; NULL when the line is none. */
static char *quoted_include(const line *l, const char *from, const char *where)
{
    const char *name = directive(l, "include"), *end;
    if (!name || *name != '"') return 0;
    end = strchr(name + 1, '"');
    if (!end) die("%s: an include without its closing quote", where);
    return resolve(from, name + 1, (size_t)(end - name) - 1);
}

/* Returns "path:line" for messages. index: from 0 on. */
static char *place(const char *path, size_t index)
{
    char number[32];
    sprintf(number, ":%lu", (unsigned long)index + 1);
    return join(path, number, "");
}

static void banner(const char *path)
{
    text t = { 0, 0, 0 };
    append_string(&t, "/* ======== >>");
    append_string(&t, tag_of(path));
    append_string(&t, "  (");
    append_string(&t, path);
    append_string(&t, ") ");
    while (t.length < 114) append_string(&t, "=");
    append_string(&t, " */");
    add_string(&product, "");
    add_string(&product, t.at);
}

/* Refuses a circle and an include of a higher folder. asked_by: the line of the include. */
static void check_include(const char *path, const char *asked_by, const chain *up)
{
    const chain *c;
    int from, to;
    for (c = up; c; c = c->up)
        if (strcmp(c->path, path) == 0) die("%s: %s includes itself, by way of this line", asked_by, path);
    if (!up || (from = folder_rank(up->path)) < 0) return;
    to = folder_rank(path);
    if (to < 0) die("%s: %s lies in no folder that embed.c lists", asked_by, path);
    if (to > from) die("%s: %s lies in a higher folder: %s is above %s", asked_by, path, folders[to], folders[from]);
}

static void take(const char *path, const char *asked_by, const chain *up);

/* Takes what the file includes before its first line of other code, and takes those lines out of it. */
static void take_includes_at_top(lines *file, const char *path, const chain *here)
{
    size_t i, n = 0;
    int code_before = 0;
    for (i = 0; i < file->count; i++) {
        char *where = place(path, file->at[i].number);
        char *inner = code_before ? 0 : quoted_include(&file->at[i], path, where);
        if (inner) {
            take(inner, where, here);
            continue;
        }
        code_before |= *skip_blanks(file->at[i].code) != 0;
        if (!code_before && n > 0 && !*skip_blanks(file->at[i].string) && !*skip_blanks(file->at[n - 1].string)) continue;
        file->at[n++] = file->at[i];
    }
    file->count = n;
}

static int is_device(const char *path)
{
    size_t n = strlen(path);
    return n > 3 && strcmp(path + n - 3, ".cl") == 0;
}

/* Returns whether a part is, or is included by, a .cl file. */
static int in_device(const chain *here)
{
    return is_device(here->path) || (here->up && in_device(here->up));
}

/* Returns whether text of its own follows line i in a file, before another include. */
static int text_follows(const lines *file, size_t i)
{
    while (++i < file->count)
        if (*skip_blanks(file->at[i].string)) return !directive(&file->at[i], "include");
    return 0;
}

/* Adds the lines of a part to the product, or to the device's text, each include replaced by what it names. */
static void add_text(const lines *file, const chain *here, int maths)
{
    size_t i;
    for (i = 0; i < file->count; i++) {
        line l = file->at[i];
        char *where = place(here->path, l.number), *inner = quoted_include(&l, here->path, where);
        size_t before = product.count;
        l.maths = maths;
        if (!inner) {
            add_line(in_device(here) ? &device_text : &product, l);
            continue;
        }
        take(inner, where, here);
        /* The root is a mere list of includes; anywhere else the reader has to see where the part goes on. */
        if (here->up && product.count > before && text_follows(file, i))
            add_string(&product, join("/* -------- back in ", here->path, " -------- */"));
    }
}

/* Takes a part: into the product, or a .cl file into the device's text, with the texts without a guard that it includes; parts with
   one must be in the product. */
static void take(const char *path, const char *asked_by, const chain *up)
{
    chain here;
    const part *known = find_part(path);
    int device;
    char *guard;
    lines file;
    here.path = path;
    here.up = up;
    check_include(path, asked_by, up);
    device = in_device(&here);
    if (known && known->guarded) return;
    file = read_lines(path, asked_by);
    guard = guard_of(&file);
    if (device && guard && !is_device(path)) die("%s: no part of springls.h includes %s", asked_by, path);
    if (guard && strncmp(guard, PRIVATE_GUARD, strlen(PRIVATE_GUARD)) == 0) drop_guard(&file);
    if (!known) add_part(path, guard != 0);
    if (up || device) take_includes_at_top(&file, path, &here);
    if (up && !device && known) add_string(&product, join("/* -------- again: ", path, " -------- */"));
    else if (up && !device) banner(path);
    /* A text without a guard is the device's too where one of its parts includes it. */
    add_text(&file, &here, is_maths(path) && (guard || !up || !up->up || is_maths(up->path)));
}

/* ---- step 2: the OpenCL program text ---- */

/* Returns a line as a C string literal that ends in a newline: octal escapes for what is not ASCII, and no trigraphs. */
static const char *literal(const char *string)
{
    text t = { 0, 0, 0 };
    char escape[8], before = 0;
    append_string(&t, "    \"");
    for (; *string; before = *string++) {
        unsigned char c = (unsigned char)*string;
        if (c == '"' || c == '\\' || (c == '?' && before == '?')) sprintf(escape, "\\%c", c);
        else if (c == '\t') sprintf(escape, "\\t");
        else if (c < 32 || c > 126) sprintf(escape, "\\%03o", (unsigned)c);
        else sprintf(escape, "%c", c);
        append_string(&t, escape);
    }
    append_string(&t, "\\n\",");
    return t.at;
}

static const char *line_directive(size_t number)
{
    char digits[32];
    sprintf(digits, "%lu", (unsigned long)number);
    return literal(join(join("#line ", digits, " \""), PRODUCT, "\""));
}

static size_t product_line(size_t index, size_t marker, size_t growth)
{
    return index + 1 + (index > marker ? growth : 0);
}

/* Returns the literals that replace the marker. Makes them twice: the line numbers in them depend on how many they are. */
static lines kernel_literals(size_t marker)
{
    lines list = { 0, 0, 0 };
    size_t round, i, growth = 0;
    for (round = 0; round < 2; round++) {
        int consecutive = 0;
        list.count = 0;
        for (i = 0; i < product.count; i++) {
            if (product.at[i].maths) {
                if (!consecutive) add_string(&list, line_directive(product_line(i, marker, growth)));
                add_string(&list, literal(product.at[i].string));
            }
            consecutive = product.at[i].maths;
        }
        /* The text of a .cl file stands nowhere in springls.h but in these literals: point at them. */
        if (device_text.count > 0) add_string(&list, line_directive(marker + 1 + list.count + 1));
        for (i = 0; i < device_text.count; i++) add_string(&list, literal(device_text.at[i].string));
        growth = list.count - 1;
    }
    return list;
}

/* ---- step 3: the renames of SPRINGLS_NAMESPACE ---- */

static int known_name(const lines *names, const char *name)
{
    size_t i;
    for (i = 0; i < names->count; i++)
        if (strcmp(names->at[i].string, name) == 0) return 1;
    return 0;
}

/* Returns the names of all functions that SPRINGLS_API declares: after that word, the first springls_x before a parenthesis. */
static lines public_names(void)
{
    static const char api[] = "SPRINGLS_API";
    lines names = { 0, 0, 0 };
    text code = { 0, 0, 0 };
    const char *s;
    size_t i, n;
    int continued = 0;
    append_string(&code, "");
    for (i = 0; i < product.count; i++) {
        const char *c = product.at[i].code;
        int in_directive = continued || *skip_blanks(c) == '#';
        n = strlen(c);
        continued = in_directive && n > 0 && c[n - 1] == '\\';
        if (in_directive) continue;
        append_string(&code, c);
        append_string(&code, "\n");
    }
    for (s = code.at; (s = strstr(s, api)) != 0; ) {
        const char *declaration = s;
        int found = 0;
        if ((s > code.at && (isalnum((unsigned char)s[-1]) || s[-1] == '_')) || word_length(s) != strlen(api)) {
            s++;
            continue;
        }
        for (s += strlen(api); *s && *s != ';' && *s != '{' && !found; s += n) {
            n = word_length(s);
            if (n > 9 && memcmp(s, "springls_", 9) == 0 && *skip_blanks(s + n) == '(') {
                char *name = copy(s, n);
                if (!known_name(&names, name)) add_string(&names, name);
                found = 1;
            }
            if (!n) n = 1;
        }
        if (!found)
            die("a declaration with %s names no springls_ function: %.*s", api, (int)strcspn(declaration, "\n"),
                declaration);
    }
    return names;
}

static lines namespace_renames(void)
{
    lines names = public_names(), list = { 0, 0, 0 };
    size_t i;
    add_string(&list, "#ifdef SPRINGLS_NAMESPACE");
    add_string(&list, "  #define SPRINGLS__JOIN_NAME(space, name) space##_##name");
    add_string(&list, "  #define SPRINGLS__EXPAND_NAME(space, name) SPRINGLS__JOIN_NAME(space, name)");
    add_string(&list, "  #define SPRINGLS__NAME(name) SPRINGLS__EXPAND_NAME(SPRINGLS_NAMESPACE, name)");
    for (i = 0; i < names.count; i++) {
        const char *name = names.at[i].string;
        add_string(&list, join(join("  #define ", name, " SPRINGLS__NAME("), name, ")"));
    }
    add_string(&list, "#endif");
    return list;
}

/* ---- all together ---- */

/* Puts the lines in the place of the marker line. */
static void replace_line(size_t marker, lines by)
{
    lines old = product;
    size_t i;
    memset(&product, 0, sizeof product);
    for (i = 0; i < marker; i++) add_line(&product, old.at[i]);
    for (i = 0; i < by.count; i++) add_line(&product, by.at[i]);
    for (i = marker + 1; i < old.count; i++) add_line(&product, old.at[i]);
}

/* Returns the index of the only line with this marker, or -1. */
static long find_marker(const char *marker)
{
    long found = -1;
    size_t i;
    for (i = 0; i < product.count; i++) {
        if (!is_marker(&product.at[i], marker)) continue;
        if (found >= 0) die("more than one line %s", marker);
        found = (long)i;
    }
    return found;
}

/* Puts above everything that the file is generated. */
static void add_head(void)
{
    lines head = { 0, 0, 0 };
    size_t i;
    add_string(&head, join("/* ", PRODUCT, " is GENERATED by `make springls.h`: do not edit it, edit the parts it is made of. */"));
    for (i = 0; i < product.count; i++) add_line(&head, product.at[i]);
    product = head;
}

/* Returns the table of contents. */
static lines list_of_parts(void)
{
    lines list = { 0, 0, 0 };
    size_t i;
    add_string(&list, join("/* ", PRODUCT, " is made of these parts, in this order; search for >>name:"));
    for (i = 1; i < parts.count; i++) {
        text t = { 0, 0, 0 };
        if (is_device(parts.at[i].path)) continue;
        append_string(&t, "     >>");
        append_string(&t, tag_of(parts.at[i].path));
        do append_string(&t, " "); while (t.length < 28);
        append_string(&t, parts.at[i].path);
        add_string(&list, t.at);
    }
    add_string(&list, "*/");
    return list;
}

/* Refuses two banners or headings with one tag: what follows >> in a line of dashes, to the next blank. */
static void check_tags(void)
{
    lines tags = { 0, 0, 0 };
    size_t i;
    for (i = 0; i < product.count; i++) {
        const char *tag = strstr(product.at[i].string, "---- >>");
        if (!tag) tag = strstr(product.at[i].string, "==== >>");
        if (!tag) continue;
        tag = copy(tag + 5, strcspn(tag + 5, " "));
        if (known_name(&tags, tag)) die("two parts or headings have the tag %s", tag);
        add_string(&tags, tag);
    }
}

int main(int argc, char **argv)
{
    long marker;
    size_t i;
    int f;
    if (argc < 2 || argv[1][0] == '-') {
        fprintf(stderr, "usage: embed src/springls_parts.h [kernels_embed/x.cl ...] > %s\n", PRODUCT);
        return 2;
    }
    take(argv[1], "command line", 0);
    for (f = 2; f < argc; f++) take(argv[f], "command line", 0);
    check_tags();
    add_head();
    /* The renames first: after them only the literals move lines, and their #line directives allow for that. */
    marker = find_marker(LIST_MARKER);
    if (marker >= 0) replace_line((size_t)marker, list_of_parts());
    marker = find_marker(RENAMES_MARKER);
    if (marker >= 0) replace_line((size_t)marker, namespace_renames());
    marker = find_marker(KERNELS_MARKER);
    if (marker >= 0) {
        replace_line((size_t)marker, kernel_literals((size_t)marker));
    } else if (argc > 2) {
        die("no part holds the line %s that %s is for", KERNELS_MARKER, argv[2]);
    }
    for (i = 0; i < product.count; i++) {
        fputs(product.at[i].string, stdout);
        fputc('\n', stdout);
    }
    if (fflush(stdout) != 0 || ferror(stdout)) die("cannot write the result: %s", strerror(errno));
    return 0;
}
