/* messages.c - errors of a morph, each one line on stderr. */
#include "morph/morph.h"

bool morph_fail(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    const bool failed = cli_failed("morph", format, arguments);
    va_end(arguments);
    return failed;
}

bool morph_no_memory(void) { return morph_fail("not enough memory"); }

bool morph_check(springls_context *ctx, springls_status status, const char *what)
{
    const char *reason = springls_last_error(ctx);
    return status == SPRINGLS_OK || morph_fail("%s: %s", what, *reason ? reason : springls_status_string(status));
}
