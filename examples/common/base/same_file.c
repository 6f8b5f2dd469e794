#define _POSIX_C_SOURCE 200809L

#include "base/same_file.h"

#include <fnmatch.h>
#include <glob.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { FOLDER = 1024, PLACE = 2 * FOLDER, MOST_LINKS = 8 };

bool file_exists(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISREG(info.st_mode);
}

/* Copies the folder of a path, "." without one; returns the name in it. */
static const char *split(const char *path, char folder[PLACE])
{
    const char *slash = strrchr(path, '/');
    snprintf(folder, PLACE, "%.*s", slash ? (int)(slash - path + 1) : 1, slash ? path : ".");
    return slash ? slash + 1 : path;
}

static bool same_inode(const struct stat *a, const struct stat *b) { return a->st_dev == b->st_dev && a->st_ino == b->st_ino; }

/* Splits the last name off a path to a folder, in place, and drops slashes and "." after it. Returns the name, which is moved by one
 * byte to make room for the zero that ends the rest; NULL: none is left. */
static const char *take_last(char *path)
{
    size_t end = strlen(path), begin;
    for (;;) {
        while (end > 0 && path[end - 1] == '/') { --end; }
        for (begin = end; begin > 0 && path[begin - 1] != '/'; --begin) { }
        if (end - begin != 1 || path[begin] != '.') { break; }
        end = begin;
    }
    path[end] = '\0';
    if (begin == end) { return NULL; }
    memmove(path + begin + 1, path + begin, end - begin + 1); /* the zero that ends the folder comes between */
    path[begin] = '\0';
    return path + begin + 1;
}

/* Returns whether two paths lead to one folder, which may have folders at its end that are not there yet. */
static bool same_folder(const char *a, const char *b)
{
    struct stat of_a, of_b;
    char rest_a[PLACE], rest_b[PLACE];
    const bool has_a = stat(a[0] ? a : ".", &of_a) == 0, has_b = stat(b[0] ? b : ".", &of_b) == 0;
    if (has_a || has_b) {
        return has_a && has_b && same_inode(&of_a, &of_b);
    }
    snprintf(rest_a, sizeof rest_a, "%.*s", PLACE - 2, a); /* leaves take_last one byte */
    snprintf(rest_b, sizeof rest_b, "%.*s", PLACE - 2, b);
    const char *name_a = take_last(rest_a), *name_b = take_last(rest_b);
    return name_a && name_b && strcmp(name_a, name_b) == 0 && same_folder(rest_a, rest_b);
}

/* Puts the place that a path leads to where its last name is a link. */
static void follow_links(const char *path, char place[PLACE])
{
    snprintf(place, PLACE, "%s", path);
    for (int i = 0; i < MOST_LINKS; ++i) {
        char target[FOLDER], folder[PLACE], next[2 * PLACE];
        const ssize_t length = readlink(place, target, sizeof target - 1);
        if (length < 0) {
            return;
        }
        target[length] = '\0';
        split(place, folder);
        snprintf(next, sizeof next, "%s%s%s", target[0] == '/' ? "" : folder, target[0] == '/' ? "" : "/", target);
        snprintf(place, PLACE, "%.*s", PLACE - 1, next);
    }
}

bool same_file(const char *a, const char *b)
{
    char place_a[PLACE], place_b[PLACE], folder_a[PLACE], folder_b[PLACE];
    struct stat of_a, of_b;
    const bool has_a = stat(a, &of_a) == 0, has_b = stat(b, &of_b) == 0;
    if (has_a || has_b) {
        return has_a && has_b && S_ISREG(of_a.st_mode) && same_inode(&of_a, &of_b);
    }
    follow_links(a, place_a);
    follow_links(b, place_b);
    return strcmp(split(place_a, folder_a), split(place_b, folder_b)) == 0 && same_folder(folder_a, folder_b);
}

/* Returns whether the path, as it is written, leads to a place in the folder that fits the pattern. */
static bool fits(const char *path, const char *pattern)
{
    char of_path[PLACE], there[PLACE];
    const char *name = split(path, of_path), *wanted = split(pattern, there);
    return fnmatch(wanted, name, 0) == 0 && same_folder(of_path, there);
}

/* Finds what is there and fits a pattern; its folder is taken as it is written, whatever characters it has. */
static bool find(const char *pattern, glob_t *found)
{
    char escaped[2 * PLACE], *to = escaped;
    const char *name = strrchr(pattern, '/'); /* take_pattern puts one */
    for (const char *from = pattern; *from; ++from) {
        if (from < name && strchr("*?[\\", *from)) { *to++ = '\\'; }
        *to++ = *from;
    }
    *to = '\0';
    return glob(escaped, 0, NULL, found) == 0;
}

/* Returns whether a file that is there and fits the pattern is the file at the path, by a link. */
static bool is_linked(const char *path, const char *pattern)
{
    glob_t found;
    bool linked = false;
    if (find(pattern, &found)) {
        for (size_t i = 0; i < found.gl_pathc && !linked; ++i) { linked = same_file(found.gl_pathv[i], path); }
        globfree(&found);
    }
    return linked;
}

/* Copies the first pattern, in its folder; returns the patterns that follow. */
static const char *take_pattern(const char *patterns, const char *folder, char pattern[PLACE])
{
    const int length = (int)strcspn(patterns, "|");
    snprintf(pattern, PLACE, "%.*s/%.*s", FOLDER, folder, length < FOLDER - 2 ? length : FOLDER - 2, patterns);
    return patterns + length + (patterns[length] == '|');
}

bool file_fits(const char *path, const char *folder, const char *patterns)
{
    char place[PLACE], pattern[PLACE];
    follow_links(path, place);
    while (*patterns) {
        patterns = take_pattern(patterns, folder, pattern);
        if (fits(path, pattern) || fits(place, pattern) || is_linked(path, pattern)) {
            return true;
        }
    }
    return false;
}

bool folder_fits(const char *folder, const char *patterns, char *path, size_t size)
{
    char pattern[PLACE];
    struct stat info;
    glob_t found;
    bool fits_one = false;
    while (*patterns && !fits_one) {
        patterns = take_pattern(patterns, folder, pattern);
        if (find(pattern, &found)) {
            for (size_t i = 0; i < found.gl_pathc && !fits_one; ++i) {
                fits_one = stat(found.gl_pathv[i], &info) == 0 && S_ISDIR(info.st_mode);
                snprintf(path, size, "%s", found.gl_pathv[i]);
            }
            globfree(&found);
        }
    }
    return fits_one;
}
