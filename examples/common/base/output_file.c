#define _XOPEN_SOURCE 700

#include "base/output_file.h"

#include "base/write_error.h"

#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* Finds the regular file that is replaced, through links; "" for none. Returns false where it may not be written. */
static bool find_place(const char *path, char place[OUTPUT_FILE_PATH])
{
    struct stat info;
    place[0] = '\0';
    if (stat(path, &info) != 0 || !S_ISREG(info.st_mode)) {
        return true;
    }
    char *target = access(path, W_OK) == 0 ? realpath(path, NULL) : NULL;
    const bool found = target && strlen(target) + 8 < OUTPUT_FILE_PATH;
    if (found) {
        strcpy(place, target);
    } else if (target) {
        errno = ENAMETOOLONG;
    }
    free(target);
    return found;
}

bool output_file_open(struct output_file *output, const char *path)
{
    if (strlen(path) + sizeof ".part" > OUTPUT_FILE_PATH) {
        errno = ENAMETOOLONG;
        return false;
    }
    if (!find_place(path, output->place)) {
        return false;
    }
    errno = 0; /* of a new file the search has left that there is none */
    strcpy(output->path, output->place[0] ? output->place : path);
    strcat(output->path, output->place[0] ? ".part" : "");
    output->file = fopen(output->path, "wb");
    if (!output->file && output->place[0]) { /* the folder takes no new file: the old one is written in place */
        strcpy(output->path, output->place);
        output->place[0] = '\0';
        output->file = fopen(output->path, "wb");
    }
    return output->file != NULL;
}

/* Puts the new file, with the rights of the old one, in its place. */
static bool replace(const struct output_file *output)
{
    struct stat info;
    return output->place[0] == '\0'
        || (stat(output->place, &info) == 0 && chmod(output->path, info.st_mode & 07777) == 0
            && rename(output->path, output->place) == 0);
}

bool output_file_close(struct output_file *output, bool good)
{
    good = fclose(output->file) == 0 && good;
    good = good && replace(output);
    if (!good) {
        partial_file_remove(output->path);
    }
    return good;
}
