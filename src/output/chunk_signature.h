/* chunk_signature.h - what the springls of a brick show to the vertices of its chunk, summed up: a change makes the chunk dirty though its
   triangles stay. */
#ifndef SPRINGLS__OUTPUT_CHUNK_SIGNATURE_H
#define SPRINGLS__OUTPUT_CHUNK_SIGNATURE_H

#include "../runtime/algorithms.h"
#include "../runtime/context.h"
#include "../model/attribute_values.h"

/* Holds sums over the springls with their particle in a brick: hashes of ids, particles p, correspondences a. A change shows
   that correspondences have moved along the surface. */
typedef struct springls__brick_signature {
    uint64_t ids;
    uint64_t values; /* of attributes, of the springls that vertices of the brick may show */
    springls__v3 particles, correspondences;
    int count;
} springls__brick_signature;

/* A brick of the lattice, counted in bricks. */
typedef struct springls__lattice_brick { int at[3]; } springls__lattice_brick;

/* Returns a hash of the attributes of springl i. */
SPRINGLS__FN uint64_t springls__hash_attributes(const springls_context *ctx, int i)
{
    uint64_t hash = (uint64_t)ctx->model.set.id[i] * 0x9e3779b97f4a7c15u + 1u;
    int a, c;
    for (a = 0; a < ctx->attribute_count; a++) {
        const springls__attribute *attribute = &ctx->attributes[a];
        const float *values = springls__values_of(attribute, i);
        for (c = 0; c < attribute->channels; c++) {
            uint32_t bits;
            memcpy(&bits, values + c, sizeof bits);
            hash = (hash ^ bits) * 0xff51afd7ed558ccdu;
            hash ^= hash >> 29;
        }
    }
    return hash;
}

/* Finds which signature the springls at a place belong to; -1: none. */
typedef int (*springls__signature_of_place)(const springls_context *ctx, const springls_chunks *c, springls__v3 p);

/* Adds a hash of attributes to the signatures around p whose vertices springls__mesh_attribute may find there. */
SPRINGLS__FN void springls__add_values(const springls_context *ctx, const springls_chunks *c, springls__signature_of_place find,
                                       springls__v3 p, uint64_t hash, springls__brick_signature *signature)
{
    const float reach = 2.5f; /* voxels: sources of an interpolation (interpolation.h) */
    int last = -1, k;
    for (k = 0; k < 8; k++) {
        const springls__v3 corner = springls__v3_make(k & 1 ? reach : -reach, k & 2 ? reach : -reach, k & 4 ? reach : -reach);
        const int i = (find)(ctx, c, springls__add(p, corner));
        if (i < 0 || i == last) continue;
        signature[i].values += hash; /* a brick that two corners lie in has it twice, each time */
        last = i;
    }
}

/* Sums up `count` signatures. */
SPRINGLS__FN void springls__collect_signatures(const springls_context *ctx, const springls_chunks *c, springls__signature_of_place find,
                                               int count, springls__brick_signature *signature)
{
    int i, at;
    memset(signature, 0, (size_t)count * sizeof *signature);
    for (i = 0; i < ctx->model.set.count; i++) {
        const springls__v3 p = ctx->model.set.s[i].p;
        if ((at = (find)(ctx, c, p)) >= 0) {
            signature[at].ids += springls__hash(SPRINGLS__HASH_BEGIN, &ctx->model.set.id[i], sizeof(uint32_t));
            signature[at].particles = springls__add(signature[at].particles, p);
            signature[at].correspondences = springls__add(signature[at].correspondences, ctx->model.set.a[i]);
            signature[at].count++;
        }
        if (ctx->attribute_count) springls__add_values(ctx, c, find, p, springls__hash_attributes(ctx, i), signature);
    }
}

/* Returns whether the ids are the same and the mean p and a differ by at most the tolerance, voxels. */
SPRINGLS__FN bool springls__signatures_agree(const springls__brick_signature *now, const springls__brick_signature *before,
                                             float tolerance)
{
    float limit = tolerance * (float)now->count;
    return now->ids == before->ids && now->values == before->values
        && springls__length2(springls__sub(now->particles, before->particles)) <= limit * limit
        && springls__length2(springls__sub(now->correspondences, before->correspondences)) <= limit * limit;
}

#endif
