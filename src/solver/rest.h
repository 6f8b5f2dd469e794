/* rest.h - finds whether a contour has arrived although its springls tremble: by how far they have come along their normals over several
   steps, springl by springl. */
#ifndef SPRINGLS__SOLVER_REST_H
#define SPRINGLS__SOLVER_REST_H

#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../model/host_access.h"
#include "../model/index_of.h"
#include "../model/transform.h"

/* Where springls were at the last look, on the lattice. */
typedef struct springls__rest_watch {
    springls__buffer ids, places, indices;
    int count;
} springls__rest_watch;

SPRINGLS__FN void springls__rest_watch_free(springls_context *ctx, springls__rest_watch *watch)
{
    springls__buffer_free(ctx, &watch->ids);
    springls__buffer_free(ctx, &watch->places);
    springls__buffer_free(ctx, &watch->indices);
}

/* Counts the springls of the last look that are still there, and those of them that have come further than `displacement` voxels along
   their normals since. */
SPRINGLS__FN void springls__count_moving(const springls_context *ctx, const springls__rest_watch *watch, float displacement, int *known,
                                         int *moving)
{
    const springls__v3 *places = (const springls__v3 *)watch->places.data;
    const int *indices = (const int *)watch->indices.data;
    int i;
    *known = *moving = 0;
    for (i = 0; i < watch->count; i++) {
        const int j = indices[i];
        springls__v3 way;
        if (j < 0) continue;
        way = springls__sub(springls__to_lattice(&ctx->window, ctx->model.set.s[j].p), places[i]);
        *moving += springls__fabs(springls__dot(way, springls__springl_normal(ctx->model.set.s[j]))) > displacement;
        ++*known;
    }
}

/* Looks where the springls are, and finds the share of them that has moved since the last look; 1 at the first. */
SPRINGLS__FN springls_status springls__rest_look(springls_context *ctx, springls__rest_watch *watch, float displacement, float *share)
{
    const size_t n = (size_t)ctx->model.set.count;
    int known, moving, i;
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(ID)));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &watch->indices, (size_t)watch->count + 1, sizeof(int), 0));
    SPRINGLS__TRY(springls_index_of(ctx, (const uint32_t *)watch->ids.data, watch->count, (int *)watch->indices.data));
    springls__count_moving(ctx, watch, displacement, &known, &moving);
    *share = known > 0 ? (float)moving / (float)known : 1.0f;
    watch->count = 0;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &watch->ids, n + 1, sizeof(uint32_t), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &watch->places, n + 1, sizeof(springls__v3), 0));
    memcpy(watch->ids.data, ctx->model.set.id, n * sizeof(uint32_t));
    for (i = 0; i < ctx->model.set.count; i++)
        ((springls__v3 *)watch->places.data)[i] = springls__to_lattice(&ctx->window, ctx->model.set.s[i].p);
    watch->count = ctx->model.set.count;
    return SPRINGLS_OK;
}

#endif
