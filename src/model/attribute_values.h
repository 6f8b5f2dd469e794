/* attribute_values.h - storage of attributes: `channels` floats for each springl, in the order of springls. */
#ifndef SPRINGLS__MODEL_ATTRIBUTE_VALUES_H
#define SPRINGLS__MODEL_ATTRIBUTE_VALUES_H

#include "../runtime/memory.h"

SPRINGLS__FN bool springls__policy_known(springls_policy policy)
{
    return policy == SPRINGLS_POLICY_COPY || policy == SPRINGLS_POLICY_BLEND || policy == SPRINGLS_POLICY_SHARE;
}

/* Returns the values of springl i. */
SPRINGLS__FN float *springls__values_of(const springls__attribute *attribute, int i)
{
    return (float *)attribute->values.data + (size_t)i * (size_t)attribute->channels;
}

SPRINGLS__FN void springls__values_copy(const springls__attribute *attribute, int to, int from)
{
    size_t bytes = (size_t)attribute->channels * sizeof(float);
    if (to != from) memcpy(springls__values_of(attribute, to), springls__values_of(attribute, from), bytes);
}

/* Makes room for the values of `count` springls; keeps those of the first `keep`. */
SPRINGLS__FN springls_status springls__values_reserve(springls_context *ctx, springls__attribute *attribute, int count, int keep)
{
    size_t bytes = (size_t)attribute->channels * sizeof(float);
    return springls__buffer_grow(ctx, &attribute->values, (size_t)springls__imax(count, 1), bytes, (size_t)keep * bytes);
}

/* Makes room for count elements in working memory `which`. */
SPRINGLS__FN springls_status springls__attribute_work(springls_context *ctx, int which, size_t count, size_t element)
{
    return springls__buffer_grow(ctx, &ctx->attribute_memory[which], count ? count : 1, element, 0);
}

#endif
