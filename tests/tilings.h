/* tilings.h - what the tests of tilings share: parts of balls, label maps, a flow, and blocks of snapshots. */
#ifndef TILINGS_H
#define TILINGS_H

#include "fixtures.h"

enum { SIZE = 28, VOXELS = SIZE * SIZE * SIZE, BALL = 24, BALL_VOXELS = BALL * BALL * BALL };

FIXTURE bool error_has(const springls_tiling *tiling, const char *text) { return strstr(springls_tiling_last_error(tiling), text) != NULL; }

/* Part of a ball on one side of a plane through its center; side 0: all of it. */
typedef struct part { float center[3], radius, normal[3]; int side; } part;

FIXTURE void part_of_ball(void *user, const float *points, int count, float *out)
{
    const part *p = (const part *)user;
    int i, k;
    for (i = 0; i < count; i++) {
        double r2 = 0.0, h = 0.0, v;
        for (k = 0; k < 3; k++) {
            const double d = (double)points[3 * i + k] - (double)p->center[k];
            r2 += d * d;
            h += d * (double)p->normal[k];
        }
        v = sqrt(r2) - (double)p->radius;
        h *= (double)p->side;
        out[i] = (float)(p->side && h > v ? h : v);
    }
}

FIXTURE part part_at(float x, float y, float z, float radius, int side)
{
    part p;
    p.center[0] = x;
    p.center[1] = y;
    p.center[2] = z;
    p.radius = radius;
    p.normal[0] = 0.8f;
    p.normal[1] = 0.36f;
    p.normal[2] = 0.48f;
    p.side = side;
    return p;
}

FIXTURE springls_tiling *tiling_of_size(int size, fixture_heap *heap)
{
    springls_desc desc = fixture_desc(size, NULL);
    springls_tiling *tiling = NULL;
    if (heap) desc.allocator = fixture_allocator(heap);
    return springls_tiling_create(&desc, &tiling) == SPRINGLS_OK ? tiling : NULL;
}

/* Three bodies that touch, of labels 3, 70 and 65535, in a ball. */
FIXTURE void three_labels(int32_t *labels, int size, float radius)
{
    static const int32_t name[3] = { 3, 70, 65535 };
    const d3 middle = d3_make(size / 2.0 - 0.4, size / 2.0 - 0.3, size / 2.0 - 0.6);
    int i, k;
    for (i = 0; i < size * size * size; i++) {
        const d3 x = d3_make(i % size, i / size % size, i / (size * size)), way = d3_sub(x, middle);
        int best = 0;
        const double height[3] = { d3_dot(way, d3_make(1.0, 0.2, 0.1)), d3_dot(way, d3_make(-0.5, 0.9, 0.1)),
                                   d3_dot(way, d3_make(-0.5, -0.8, 0.3)) };
        for (k = 1; k < 3; k++) if (height[k] > height[best]) best = k;
        labels[i] = d3_length(way) < (double)radius ? name[best] : 0;
    }
}

/* A swirl about the grid's middle that is faster inside, back and forth: all labels share it. */
FIXTURE void swirl(void *user, const springls_tiling_batch *batch, float *out)
{
    const float turn = batch->batch.time < 1.0f ? 0.3f : -0.3f;
    int i;
    (void)user;
    for (i = 0; i < batch->batch.count; i++) {
        const float *p = batch->batch.points + 3 * i;
        const float x = p[0] - 13.0f, y = p[1] - 13.0f, z = p[2] - 13.0f, w = turn * (9.0f - 0.1f * (x * x + y * y + z * z)) * 0.2f;
        out[3 * i] = -w * y + 0.3f * w * z;
        out[3 * i + 1] = w * x;
        out[3 * i + 2] = -0.3f * w * x;
    }
}

FIXTURE springls_status set_two_halves(springls_tiling *tiling, float radius)
{
    part first = part_at(12.4f, 13.7f, 13.1f, radius, 1), second = part_at(12.4f, 13.7f, 13.1f, radius, -1);
    springls_status status = springls_tiling_add_implicit(tiling, 9, part_of_ball, &second);
    return status == SPRINGLS_OK ? springls_tiling_add_implicit(tiling, 4, part_of_ball, &first) : status;
}

/* Writes a snapshot into a block that is as large as it is. */
FIXTURE char *block_of(springls_tiling *tiling, springls_snapshot_kind kind, size_t *size)
{
    char *block = NULL;
    size_t written = 0;
    if (springls_tiling_snapshot(tiling, kind, NULL, 0, size) == SPRINGLS_OK) block = (char *)malloc(*size);
    if (!block || springls_tiling_snapshot(tiling, kind, block, *size, &written) != SPRINGLS_OK || written != *size) *size = 0;
    return block;
}

#endif
