/* voxel_block.h - the 4 x 4 x 4 voxels about a place, read once for all samples that a Newton step takes there: the same bits as those of
   kernels_embed/model/grid.h, in a quarter of the time. */
#ifndef SPRINGLS__MODEL_VOXEL_BLOCK_H
#define SPRINGLS__MODEL_VOXEL_BLOCK_H

#include "grid.h"

/* first: of the block. whole: all of it lies in the top table; otherwise samples are taken from the grid. */
typedef struct springls__voxel_block {
    const springls__grid *grid;
    float first[3];
    bool whole;
    float phi[64];
} springls__voxel_block;

/* Reads the block whose first voxel is (i, j, k). */
SPRINGLS__FN void springls__block_read(springls__voxel_block *block, int i, int j, int k)
{
    const springls__grid *g = block->grid;
    int x, y, z;
    for (z = 0; z < 4; z++)
        for (y = 0; y < 4; y++) {
            const int row = springls__voxel_in_brick(0, j + y, k + z);
            const float *left = g->phi + (size_t)springls__slot_at(g, i, j + y, k + z) * SPRINGLS__BRICK_VOXELS + row;
            const float *right = g->phi + (size_t)springls__slot_at(g, i + 3, j + y, k + z) * SPRINGLS__BRICK_VOXELS + row;
            for (x = 0; x < 4; x++) block->phi[x + 4 * (y + 4 * z)] = ((i + x) >> 3 == i >> 3 ? left : right)[(i + x) & 7];
        }
}

/* Returns the block about x, which serves places up to a voxel from there. */
SPRINGLS__FN springls__voxel_block springls__voxel_block_about(const springls__grid *g, springls__v3 x)
{
    const springls__table *t = &g->table;
    springls__voxel_block block;
    int axis;
    block.grid = g;
    block.first[0] = springls__floor(x.x) - 1.0f;
    block.first[1] = springls__floor(x.y) - 1.0f;
    block.first[2] = springls__floor(x.z) - 1.0f;
    block.whole = true;
    for (axis = 0; axis < 3; axis++) /* NaN is not whole */
        block.whole = block.whole && block.first[axis] >= (float)t->lower[axis] && block.first[axis] + 4.0f <= (float)t->upper[axis];
    if (block.whole) springls__block_read(&block, (int)block.first[0], (int)block.first[1], (int)block.first[2]);
    return block;
}

/* Returns springls__grid_sample of phi at x. */
SPRINGLS__FN float springls__block_sample(const springls__voxel_block *block, springls__v3 x)
{
    const float i = springls__floor(x.x), j = springls__floor(x.y), k = springls__floor(x.z);
    const float a = i - block->first[0], b = j - block->first[1], c = k - block->first[2];
    const float *v;
    float corner[8];
    if (!(block->whole && a >= 0.0f && b >= 0.0f && c >= 0.0f && a <= 2.0f && b <= 2.0f && c <= 2.0f))
        return springls__grid_sample(block->grid, block->grid->phi, x);
    v = block->phi + (int)a + 4 * (int)b + 16 * (int)c;
    corner[0] = v[0];  corner[1] = v[1];  corner[2] = v[4];  corner[3] = v[5];
    corner[4] = v[16]; corner[5] = v[17]; corner[6] = v[20]; corner[7] = v[21];
    return springls__trilinear(corner, x.x - i, x.y - j, x.z - k);
}

/* Returns the difference of the samples at x + (dx, dy, dz) and x - (dx, dy, dz), and their sum. */
SPRINGLS__FN float springls__block_difference(const springls__voxel_block *block, springls__v3 x, springls__v3 step, float *sum)
{
    const float before = springls__block_sample(block, springls__sub(x, step));
    const float after = springls__block_sample(block, springls__add(x, step));
    *sum = before + after;
    return after - before;
}

/* Returns springls__grid_gradient of phi at x. */
SPRINGLS__FN springls__v3 springls__block_gradient(const springls__voxel_block *block, springls__v3 x)
{
    const float d = 0.5f;
    float sum;
    springls__v3 slope;
    slope.x = springls__block_difference(block, x, springls__v3_make(d, 0.0f, 0.0f), &sum);
    slope.y = springls__block_difference(block, x, springls__v3_make(0.0f, d, 0.0f), &sum);
    slope.z = springls__block_difference(block, x, springls__v3_make(0.0f, 0.0f, d), &sum);
    return slope;
}

/* Returns springls__grid_sample_smooth of phi at x. */
SPRINGLS__FN float springls__block_sample_smooth(const springls__voxel_block *block, springls__v3 x)
{
    const float c = springls__block_sample(block, x);
    springls__v3 sum;
    springls__block_difference(block, x, springls__v3_make(1.0f, 0.0f, 0.0f), &sum.x);
    springls__block_difference(block, x, springls__v3_make(0.0f, 1.0f, 0.0f), &sum.y);
    springls__block_difference(block, x, springls__v3_make(0.0f, 0.0f, 1.0f), &sum.z);
    return springls__third_order(x, c, springls__v3_make(sum.x - 2.0f * c, sum.y - 2.0f * c, sum.z - 2.0f * c));
}

#endif
