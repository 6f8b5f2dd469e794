/* index_of.h - finds springls by their ids. */
#ifndef SPRINGLS__MODEL_INDEX_OF_H
#define SPRINGLS__MODEL_INDEX_OF_H

#include "../runtime/algorithms.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "host_access.h"

/* Returns the index of the springl with an id, from the ascending keys id << 32 | index of all; -1: there is none. */
SPRINGLS__FN int springls__index_among(const uint64_t *keys, int count, uint32_t id)
{
    int first = 0, end = count;
    while (first < end) {
        const int middle = first + (end - first) / 2;
        if ((uint32_t)(keys[middle] >> 32) < id) first = middle + 1;
        else end = middle;
    }
    return first < count && (uint32_t)(keys[first] >> 32) == id ? (int)(uint32_t)keys[first] : -1;
}

SPRINGLS_API springls_status springls_index_of(springls_context *ctx, const uint32_t *ids, int count, int *out)
{
    uint64_t *keys;
    int i, springls;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (count < 0) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "index_of: the count %d is negative", count);
    if (count > 0 && (!ids || !out)) return springls__fail_null(ctx, "index_of", ids ? "out" : "ids");
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(ID)));
    springls = ctx->model.set.count;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->id_memory, (size_t)springls + 1, sizeof *keys, 0));
    keys = (uint64_t *)ctx->id_memory.data;
    for (i = 0; i < springls; i++) keys[i] = (uint64_t)ctx->model.set.id[i] << 32 | (uint64_t)(uint32_t)i;
    springls__sort_keys(keys, (size_t)springls);
    for (i = 0; i < count; i++) out[i] = springls__index_among(keys, springls, ids[i]);
    return SPRINGLS_OK;
}

#endif
