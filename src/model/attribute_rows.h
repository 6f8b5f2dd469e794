/* attribute_rows.h - storage of attributes: each springl has a row of `channels` floats in each of them. */
#ifndef SPRINGLS__MODEL_ATTRIBUTE_ROWS_H
#define SPRINGLS__MODEL_ATTRIBUTE_ROWS_H

#include "../runtime/memory.h"

SPRINGLS__FN bool springls__policy_known(springls_policy policy)
{
    return policy == SPRINGLS_POLICY_COPY || policy == SPRINGLS_POLICY_BLEND || policy == SPRINGLS_POLICY_SHARE;
}

SPRINGLS__FN float *springls__attribute_row(const springls__attribute *attribute, int i)
{
    return (float *)attribute->values.data + (size_t)i * (size_t)attribute->channels;
}

SPRINGLS__FN void springls__row_copy(const springls__attribute *attribute, int to, int from)
{
    size_t bytes = (size_t)attribute->channels * sizeof(float);
    if (to != from) memcpy(springls__attribute_row(attribute, to), springls__attribute_row(attribute, from), bytes);
}

/* Makes room for `rows` rows; keeps the first `keep`. */
SPRINGLS__FN springls_status springls__rows_reserve(springls_context *ctx, springls__attribute *attribute, int rows, int keep)
{
    size_t row = (size_t)attribute->channels * sizeof(float);
    return springls__buffer_grow(ctx, &attribute->values, (size_t)springls__imax(rows, 1), row, (size_t)keep * row);
}

/* Makes room for count elements in working memory `which`. */
SPRINGLS__FN springls_status springls__attribute_work(springls_context *ctx, int which, size_t count, size_t element)
{
    return springls__buffer_grow(ctx, &ctx->attribute_memory[which], count ? count : 1, element, 0);
}

#endif
