/* The declarations of string.h that springls.h and springls_cl.h use. */
#ifndef MSVC_STRING_H
#define MSVC_STRING_H
#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif
void *memcpy(void *to, const void *from, size_t size);
void *memmove(void *to, const void *from, size_t size);
void *memset(void *memory, int value, size_t size);
int memcmp(const void *a, const void *b, size_t size);
size_t strlen(const char *text);
char *strchr(const char *text, int character);
char *strstr(const char *text, const char *part);
int strcmp(const char *a, const char *b);
#ifdef __cplusplus
}
#endif
#endif
