/* The declarations of stdio.h that springls.h and springls_cl.h use, for checks for Microsoft's target, where no Windows SDK is. */
#ifndef MSVC_STDIO_H
#define MSVC_STDIO_H
#include <stdarg.h>
#include <stddef.h>
#define SEEK_END 2
typedef struct FILE FILE;
#ifdef __cplusplus
extern "C" {
#endif
FILE *fopen(const char *name, const char *mode);
int fclose(FILE *file);
size_t fread(void *to, size_t size, size_t count, FILE *file);
size_t fwrite(const void *from, size_t size, size_t count, FILE *file);
int fseek(FILE *file, long offset, int from);
long ftell(FILE *file);
void rewind(FILE *file);
int remove(const char *name);
int rename(const char *from, const char *to);
int snprintf(char *text, size_t size, const char *format, ...);
int vsnprintf(char *text, size_t size, const char *format, va_list values);
#ifdef __cplusplus
}
#endif
#endif
