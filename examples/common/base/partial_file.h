/* partial_file.h - removes what a failed write has left. */
#ifndef EXAMPLES_BASE_PARTIAL_FILE_H
#define EXAMPLES_BASE_PARTIAL_FILE_H

#include <errno.h>
#include <stdio.h>
#include <sys/stat.h>

/* Removes a file that was written in part; leaves a device or a pipe. Keeps errno's reason for the message that follows. */
static inline void partial_file_remove(const char *path)
{
    const int reason = errno;
    struct stat info;
    if (stat(path, &info) == 0 && S_ISREG(info.st_mode)) {
        remove(path);
    }
    errno = reason;
}

#endif
