/* topology.h - topology preservation (section 4.5, after Han et al.): a voxel may change sides only where it is simple.
   Inside is 6-connected and outside 26-connected, here and in marching cubes. */

SPRINGLS__FN unsigned springls__inside_mask(const springls__grid *g, const float *phi, int x, int y, int z)
{
    unsigned mask = 0;
    int d;
    for (d = 0; d < 27; d++)
        if (springls__grid_phi(g, phi, x + d % 3 - 1, y + d / 3 % 3 - 1, z + d / 9 - 1) < 0.0f) mask |= 1u << d;
    return mask;
}

typedef struct springls__colour_job { springls_context *ctx; int colour; } springls__colour_job;

/* Voxels of one parity have no neighbour of the same parity: they may change together, in any order. The present sides
   live in phi, which receives what is granted of what phi_next asks for. */
SPRINGLS__FN void springls__colour_task(void *arg, int begin, int end)
{
    const springls__colour_job *job = (const springls__colour_job *)arg;
    springls__grid *g = &job->ctx->grid;
    int cx = job->colour & 1, cy = job->colour >> 1 & 1, cz = job->colour >> 2, x, y, z;
    for (; begin < end; begin++) {
        float *phi = g->phi + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        const float *next = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        int origin[3];
        springls__slot_origin(g, g->active[begin], origin);
        for (z = cz; z < 8; z += 2)
            for (y = cy; y < 8; y += 2)
                for (x = cx; x < 8; x += 2) {
                    int v = x + 8 * y + 64 * z;
                    if ((phi[v] < 0.0f) == (next[v] < 0.0f)) continue;
                    if (!springls__grid_contains(g, origin[0] + x, origin[1] + y, origin[2] + z)) continue;
                    if (springls__is_simple(springls__inside_mask(g, g->phi, origin[0] + x, origin[1] + y, origin[2] + z)))
                        phi[v] = next[v];
                }
    }
}

/* What was not granted is taken out of phi_next. */
SPRINGLS__FN void springls__hold_task(void *arg, int begin, int end)
{
    const springls__grid *g = &((const springls_context *)arg)->grid;
    const float held = 0.25f; /* a voxel that may not change stays next to the interface */
    int x;
    for (; begin < end; begin++) {
        const float *phi = g->phi + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        float *next = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        for (x = 0; x < SPRINGLS__BRICK_VOXELS; x++)
            if ((phi[x] < 0.0f) != (next[x] < 0.0f)) next[x] = phi[x] < 0.0f ? -held : held;
    }
}

/* The front goes on by about a voxel a pass: `passes` of them for a step of that many voxels. */
SPRINGLS__FN void springls__preserve_topology(springls_context *ctx, int passes)
{
    springls__colour_job job;
    job.ctx = ctx;
    for (; passes > 0; passes--)
        for (job.colour = 0; job.colour < 8; job.colour++)
            springls__parallel(ctx, ctx->grid.active_count, 8, springls__colour_task, &job);
    springls__parallel(ctx, ctx->grid.active_count, 8, springls__hold_task, ctx);
}
