/* project.h - phi near the springls becomes their oriented distance: eq. 23 decides the side, the springls the value.
   It takes the chord error of flat triangles and the lag of the moving front out of the level set. */

SPRINGLS__FN void springls__project_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    const springls__grid *g = &ctx->grid;
    const float width = 1.2f, reach = SPRINGLS__PROJECT_RADIUS; /* width: no voxel beyond it is next to the zero level */
    float tile[SPRINGLS__TILE_VOXELS], weight[SPRINGLS__BRICK_VOXELS], value[SPRINGLS__BRICK_VOXELS];
    springls__v3 direction[SPRINGLS__BRICK_VOXELS];
    int x, y, z, v, o[3];
    uint32_t k;
    for (; begin < end; begin++) {
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        springls__slot_origin(g, g->active[begin], o);
        springls__load_tile(g, g->phi, g->active[begin], tile);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            springls__cross7 c = springls__tile_cross(tile + springls__tile_index(v & 7, v >> 3 & 7, v >> 6));
            out[v] = c.c;
            weight[v] = value[v] = 0.0f;
            direction[v] = springls__fabs(c.c) < width
                ? springls__normalize(springls__v3_make(c.xp - c.xm, c.yp - c.ym, c.zp - c.zm)) : springls__v3_make(0.0f, 0.0f, 0.0f);
        }
        for (k = ctx->cells.near_first[begin]; k < ctx->cells.near_first[begin + 1]; k++) {
            const springls__springl *s = &ctx->set.s[ctx->cells.near_ids[k]];
            springls__v3 n = springls__springl_normal(s), p = s->p;
            int lo[3], hi[3];
            lo[0] = springls__imax((int)springls__floor(p.x - reach) + 1 - o[0], 0);
            lo[1] = springls__imax((int)springls__floor(p.y - reach) + 1 - o[1], 0);
            lo[2] = springls__imax((int)springls__floor(p.z - reach) + 1 - o[2], 0);
            hi[0] = springls__imin((int)springls__floor(p.x + reach) - o[0], 7);
            hi[1] = springls__imin((int)springls__floor(p.y + reach) - o[1], 7);
            hi[2] = springls__imin((int)springls__floor(p.z + reach) - o[2], 7);
            for (z = lo[2]; z <= hi[2]; z++)
                for (y = lo[1]; y <= hi[1]; y++)
                    for (x = lo[0]; x <= hi[0]; x++) {
                        springls__say say;
                        v = x + 8 * y + 64 * z;
                        say = springls__oriented_distance(springls__v3_make((float)(o[0] + x), (float)(o[1] + y), (float)(o[2] + z)),
                                                          direction[v], p, n);
                        weight[v] += say.weight;
                        value[v] += say.value;
                    }
        }
        if (ctx->params.keep_edges) springls__project_edges(ctx, begin, o, out, width, weight, value);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) out[v] = springls__corrected_phi(out[v], weight[v], value[v]);
    }
}

SPRINGLS__FN springls_status springls__project_level_set(springls_context *ctx)
{
    SPRINGLS__TRY(springls__near_build(ctx, SPRINGLS__PROJECT_RADIUS)); /* the band has moved: lists follow its bricks */
    springls__parallel(ctx, ctx->grid.active_count, 4, springls__project_task, ctx);
    springls__commit_phi(ctx);
    springls__redistance_sweeps(ctx, 2);
    return SPRINGLS_OK;
}
