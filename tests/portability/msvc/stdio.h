/* The declarations of stdio.h that springls.h uses, for checks for Microsoft's target, where no Windows SDK is. */
#ifndef MSVC_STDIO_H
#define MSVC_STDIO_H
#include <stdarg.h>
#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif
int snprintf(char *text, size_t size, const char *format, ...);
int vsnprintf(char *text, size_t size, const char *format, va_list values);
#ifdef __cplusplus
}
#endif
#endif
