/* errors.h - the text of the last failure, the caller's log and the caller's progress report. */
#ifndef SPRINGLS__RUNTIME_ERRORS_H
#define SPRINGLS__RUNTIME_ERRORS_H

#include "base.h"
#include "context.h"
#include "finite.h"

SPRINGLS__FN void springls__log(const springls_context *ctx, int level, const char *format, ...) SPRINGLS__PRINTF(3, 4);
SPRINGLS__FN springls_status springls__fail(springls_context *ctx, springls_status status, const char *format, ...)
    SPRINGLS__PRINTF(3, 4);

/* Sends a line to the caller's log. level: 1 error, 2 warning, 3 information. */
SPRINGLS__FN void springls__log(const springls_context *ctx, int level, const char *format, ...)
{
    char message[256];
    va_list args;
    if (!ctx->desc.logger.log) return;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    (ctx->desc.logger.log)(ctx->desc.logger.user, level, message);
}

/* Stores and logs the reason of a failure; returns its status. */
SPRINGLS__FN springls_status springls__fail(springls_context *ctx, springls_status status, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(ctx->error, sizeof ctx->error, format, args);
    va_end(args);
    springls__log(ctx, 1, "%s", ctx->error);
    return status;
}

/* Fails because an argument of a call is NULL. */
SPRINGLS__FN springls_status springls__fail_null(springls_context *ctx, const char *call, const char *argument)
{
    return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: %s is NULL", call, argument);
}

/* Fails when a number is negative or not finite. */
SPRINGLS__FN springls_status springls__check_amount(springls_context *ctx, const char *call, const char *argument, double x)
{
    if (springls__finite(x) && x >= 0.0 && x <= (double)FLT_MAX) return SPRINGLS_OK;
    return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: %s is %g, not 0 or more and finite", call, argument, x);
}

/* Reports the progress of a long call, a fraction in [0,1]; returns true when the caller cancels it. */
SPRINGLS__FN bool springls__cancelled(const springls_context *ctx, float fraction)
{
    return ctx->desc.progress.report && (ctx->desc.progress.report)(ctx->desc.progress.user, fraction) != 0;
}

#endif
