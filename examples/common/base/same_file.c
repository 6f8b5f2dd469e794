#define _POSIX_C_SOURCE 200809L

#include "base/same_file.h"

#include <fnmatch.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

enum { FOLDER = 1024 };

bool file_exists(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISREG(info.st_mode);
}

/* Copies the folder of a path, "." without one; returns the name in it. */
static const char *split(const char *path, char folder[FOLDER])
{
    const char *slash = strrchr(path, '/');
    snprintf(folder, FOLDER, "%.*s", slash ? (int)(slash - path + 1) : 1, slash ? path : ".");
    return slash ? slash + 1 : path;
}

static bool same_inode(const struct stat *a, const struct stat *b) { return a->st_dev == b->st_dev && a->st_ino == b->st_ino; }

/* Returns whether two paths lead to one folder; where neither is there, whether they are the same text. */
static bool same_folder(const char *a, const char *b)
{
    struct stat of_a, of_b;
    const bool has_a = stat(a, &of_a) == 0, has_b = stat(b, &of_b) == 0;
    return has_a && has_b ? same_inode(&of_a, &of_b) : has_a == has_b && strcmp(a, b) == 0;
}

bool same_file(const char *a, const char *b)
{
    char folder_a[FOLDER], folder_b[FOLDER];
    struct stat of_a, of_b;
    const bool has_a = stat(a, &of_a) == 0, has_b = stat(b, &of_b) == 0;
    if (has_a || has_b) {
        return has_a && has_b && S_ISREG(of_a.st_mode) && same_inode(&of_a, &of_b);
    }
    return strcmp(split(a, folder_a), split(b, folder_b)) == 0 && same_folder(folder_a, folder_b);
}

bool file_fits(const char *path, const char *folder, const char *patterns)
{
    char of_path[FOLDER], pattern[FOLDER], place[2 * FOLDER], there[FOLDER];
    const char *name = split(path, of_path);
    for (size_t length; *patterns; patterns += length + (patterns[length] == '|')) {
        length = strcspn(patterns, "|");
        snprintf(pattern, sizeof pattern, "%.*s", (int)length, patterns);
        snprintf(place, sizeof place, "%.*s/%s", FOLDER - 1, folder, pattern);
        const char *wanted = split(place, there);
        if (fnmatch(wanted, name, 0) == 0 && same_folder(of_path, there)) {
            return true;
        }
    }
    return false;
}
