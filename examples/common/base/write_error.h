/* write_error.h - what follows a failed write: a message with its reason, and the removal of what it has left. */
#ifndef EXAMPLES_BASE_WRITE_ERROR_H
#define EXAMPLES_BASE_WRITE_ERROR_H

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

/* Returns the reason in errno, which not every failure sets: callers set it to 0 before the work. */
static inline const char *write_reason(void) { return errno ? strerror(errno) : "no reason given"; }

/* Puts "PATH: cannot be written: REASON" into a text; returns false. */
static inline bool write_error(char *text, size_t size, const char *path)
{
    snprintf(text, size, "%.200s: cannot be written: %s", path, write_reason());
    return false;
}

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

/* Removes what an earlier run has left under the name of a file that this run leaves out; leaves a device or a pipe. Returns false, with
 * errno's reason, if it is still there. */
static inline bool earlier_file_remove(const char *path)
{
    struct stat info;
    errno = 0;
    return stat(path, &info) != 0 || !S_ISREG(info.st_mode) || remove(path) == 0;
}

#endif
