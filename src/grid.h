/* grid.h - the sparse grid: bricks of 8x8x8 voxels near the surface, constant elsewhere.

   A voxel outside the domain counts as outside the object, at the mirrored distance of the voxel at the border: the
   object ends half a voxel beyond the outermost voxel centres, and its surface is always closed. */

SPRINGLS__FN int springls__voxel_in_brick(int x, int y, int z) { return (x & 7) + 8 * (y & 7) + 64 * (z & 7); }

SPRINGLS__FN int springls__brick_at(const springls__grid *g, int x, int y, int z)
{
    return (x >> 3) + g->bricks[0] * ((y >> 3) + g->bricks[1] * (z >> 3));
}

SPRINGLS__FN int springls__slot_at(const springls__grid *g, int x, int y, int z)
{
    return g->top[springls__brick_at(g, x, y, z)];
}

/* The first voxel of a slot's brick. */
SPRINGLS__FN void springls__slot_origin(const springls__grid *g, int slot, int origin[3])
{
    int brick = g->slot_brick[slot];
    origin[0] = 8 * (brick % g->bricks[0]);
    origin[1] = 8 * (brick / g->bricks[0] % g->bricks[1]);
    origin[2] = 8 * (brick / (g->bricks[0] * g->bricks[1]));
}

/* The bricks that a row of voxels (or cells) along x reaches beyond its own, by the faces of the brick that it touches: bit
   (dx+1) + 3(dy+1) + 9(dz+1). */
SPRINGLS__FN uint32_t springls__reach_of_row(bool first_x, bool last_x, bool first_y, bool last_y, bool first_z, bool last_z)
{
    uint32_t x = 2u | (uint32_t)first_x | (uint32_t)last_x << 2;
    uint32_t xy = x << 3 | (first_y ? x : 0u) | (last_y ? x << 6 : 0u);
    return xy << 9 | (first_z ? xy : 0u) | (last_z ? xy << 18 : 0u);
}

/* Value at a voxel of the domain. */
SPRINGLS__FN float springls__grid_voxel(const springls__grid *g, const float *field, int x, int y, int z)
{
    return field[(size_t)springls__slot_at(g, x, y, z) * SPRINGLS__BRICK_VOXELS + (size_t)springls__voxel_in_brick(x, y, z)];
}

SPRINGLS__FN bool springls__grid_contains(const springls__grid *g, int x, int y, int z)
{
    return x >= 0 && y >= 0 && z >= 0 && x < g->size[0] && y < g->size[1] && z < g->size[2];
}

/* phi at any voxel; beyond the domain by the border rule above. */
SPRINGLS__FN float springls__grid_phi(const springls__grid *g, const float *phi, int x, int y, int z)
{
    float v = springls__grid_voxel(g, phi, springls__iclamp(x, 0, g->size[0] - 1), springls__iclamp(y, 0, g->size[1] - 1),
                                   springls__iclamp(z, 0, g->size[2] - 1));
    return springls__grid_contains(g, x, y, z) ? v : springls__fabs(v);
}

/* Trilinear value at x, the border rule included. */
SPRINGLS__FN float springls__grid_sample(const springls__grid *g, const float *phi, springls__v3 x)
{
    float fx = springls__clamp(x.x, -1.0f, (float)g->size[0]), fy = springls__clamp(x.y, -1.0f, (float)g->size[1]);
    float fz = springls__clamp(x.z, -1.0f, (float)g->size[2]);
    int i = (int)springls__floor(fx), j = (int)springls__floor(fy), k = (int)springls__floor(fz), c;
    float u = fx - (float)i, v = fy - (float)j, w = fz - (float)k, corner[8];
    bool inner = springls__grid_contains(g, i, j, k) && springls__grid_contains(g, i + 1, j + 1, k + 1);
    if (inner && (i & 7) != 7 && (j & 7) != 7 && (k & 7) != 7) { /* all eight in one brick */
        const float *b = phi + (size_t)springls__slot_at(g, i, j, k) * SPRINGLS__BRICK_VOXELS + springls__voxel_in_brick(i, j, k);
        corner[0] = b[0];  corner[1] = b[1];  corner[2] = b[8];  corner[3] = b[9];
        corner[4] = b[64]; corner[5] = b[65]; corner[6] = b[72]; corner[7] = b[73];
    } else if (inner) {
        for (c = 0; c < 8; c++) corner[c] = springls__grid_voxel(g, phi, i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2));
    } else {
        for (c = 0; c < 8; c++) corner[c] = springls__grid_phi(g, phi, i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2));
    }
    return springls__trilinear(corner, u, v, w);
}

/* Value at x to third order: trilinear interpolation adds u (1 - u) / 2 times the second difference along each axis. */
SPRINGLS__FN float springls__grid_sample_smooth(const springls__grid *g, const float *phi, springls__v3 x)
{
    float c = springls__grid_sample(g, phi, x);
    float u = x.x - springls__floor(x.x), v = x.y - springls__floor(x.y), w = x.z - springls__floor(x.z);
    float xx = springls__grid_sample(g, phi, springls__v3_make(x.x - 1.0f, x.y, x.z)) + springls__grid_sample(g, phi, springls__v3_make(x.x + 1.0f, x.y, x.z)) - 2.0f * c;
    float yy = springls__grid_sample(g, phi, springls__v3_make(x.x, x.y - 1.0f, x.z)) + springls__grid_sample(g, phi, springls__v3_make(x.x, x.y + 1.0f, x.z)) - 2.0f * c;
    float zz = springls__grid_sample(g, phi, springls__v3_make(x.x, x.y, x.z - 1.0f)) + springls__grid_sample(g, phi, springls__v3_make(x.x, x.y, x.z + 1.0f)) - 2.0f * c;
    return c - 0.5f * (u * (1.0f - u) * xx + v * (1.0f - v) * yy + w * (1.0f - w) * zz);
}

/* Gradient of the trilinear values by central differences over one voxel. */
SPRINGLS__FN springls__v3 springls__grid_gradient(const springls__grid *g, const float *phi, springls__v3 x)
{
    const float h = 0.5f;
    return springls__v3_make(
        springls__grid_sample(g, phi, springls__v3_make(x.x + h, x.y, x.z)) - springls__grid_sample(g, phi, springls__v3_make(x.x - h, x.y, x.z)),
        springls__grid_sample(g, phi, springls__v3_make(x.x, x.y + h, x.z)) - springls__grid_sample(g, phi, springls__v3_make(x.x, x.y - h, x.z)),
        springls__grid_sample(g, phi, springls__v3_make(x.x, x.y, x.z + h)) - springls__grid_sample(g, phi, springls__v3_make(x.x, x.y, x.z - h)));
}

/* A brick with a margin of one voxel: 10x10x10 values, x fastest. */
enum { SPRINGLS__TILE = 10, SPRINGLS__TILE_VOXELS = 1000 };

SPRINGLS__FN int springls__tile_index(int x, int y, int z) { return x + 1 + SPRINGLS__TILE * (y + 1 + SPRINGLS__TILE * (z + 1)); }

SPRINGLS__FN void springls__load_border_tile(const springls__grid *g, const float *field, const int origin[3], float *tile)
{
    int x, y, z;
    for (z = -1; z <= 8; z++)
        for (y = -1; y <= 8; y++)
            for (x = -1; x <= 8; x++)
                tile[springls__tile_index(x, y, z)] = springls__grid_phi(g, field, origin[0] + x, origin[1] + y, origin[2] + z);
}

SPRINGLS__FN void springls__load_tile(const springls__grid *g, const float *field, int slot, float *tile)
{
    int origin[3], y, z;
    springls__slot_origin(g, slot, origin);
    if (origin[0] == 0 || origin[1] == 0 || origin[2] == 0 || origin[0] + 9 > g->size[0] || origin[1] + 9 > g->size[1]
        || origin[2] + 9 > g->size[2]) {
        springls__load_border_tile(g, field, origin, tile);
        return;
    }
    for (z = -1; z <= 8; z++) {
        for (y = -1; y <= 8; y++) {
            const int *top = g->top + springls__brick_at(g, origin[0], origin[1] + y, origin[2] + z);
            size_t row = (size_t)springls__voxel_in_brick(0, origin[1] + y, origin[2] + z);
            float *out = tile + springls__tile_index(0, y, z);
            out[-1] = field[(size_t)top[-1] * SPRINGLS__BRICK_VOXELS + row + 7];
            memcpy(out, field + (size_t)top[0] * SPRINGLS__BRICK_VOXELS + row, 8 * sizeof *out);
            out[8] = field[(size_t)top[1] * SPRINGLS__BRICK_VOXELS + row];
        }
    }
}

SPRINGLS__FN springls__cross7 springls__tile_cross(const float *t)
{
    springls__cross7 v;
    v.c = t[0];
    v.xm = t[-1];
    v.xp = t[1];
    v.ym = t[-SPRINGLS__TILE];
    v.yp = t[SPRINGLS__TILE];
    v.zm = t[-SPRINGLS__TILE * SPRINGLS__TILE];
    v.zp = t[SPRINGLS__TILE * SPRINGLS__TILE];
    return v;
}

SPRINGLS__FN void springls__swap_fields(float **a, springls__buffer *a_memory, float **b, springls__buffer *b_memory)
{
    springls__buffer memory = *a_memory;
    float *field = *a;
    *a_memory = *b_memory;
    *a = *b;
    *b_memory = memory;
    *b = field;
}

/* What was written becomes the field. */
SPRINGLS__FN void springls__swap_phi(springls__grid *g) { springls__swap_fields(&g->phi, &g->phi_memory, &g->phi_next, &g->next_memory); }

/* A brick with a margin of three voxels, to be sampled at places that the surface has come from. */
enum { SPRINGLS__WIDE_MARGIN = 3, SPRINGLS__WIDE = 8 + 2 * SPRINGLS__WIDE_MARGIN };

typedef struct springls__wide_tile {
    const springls__grid *g;
    const float *field;
    int origin[3];
    float value[SPRINGLS__WIDE * SPRINGLS__WIDE * SPRINGLS__WIDE];
} springls__wide_tile;

SPRINGLS__FN void springls__load_wide_tile(const springls__grid *g, const float *field, const int origin[3], springls__wide_tile *tile)
{
    const int m = SPRINGLS__WIDE_MARGIN;
    int x, y, z;
    bool border = false;
    float *out = tile->value;
    tile->g = g;
    tile->field = field;
    memcpy(tile->origin, origin, sizeof tile->origin);
    for (x = 0; x < 3; x++) border = border || origin[x] == 0 || origin[x] + 8 + m > g->size[x];
    for (z = origin[2] - m; z < origin[2] + 8 + m; z++)
        for (y = origin[1] - m; y < origin[1] + 8 + m; y++, out += SPRINGLS__WIDE) {
            if (border) {
                for (x = 0; x < SPRINGLS__WIDE; x++) out[x] = springls__grid_phi(g, field, origin[0] - m + x, y, z);
            } else {
                const int *top = g->top + springls__brick_at(g, origin[0], y, z);
                size_t row = (size_t)springls__voxel_in_brick(0, y, z);
                memcpy(out, field + (size_t)top[-1] * SPRINGLS__BRICK_VOXELS + row + 8 - m, (size_t)m * sizeof *out);
                memcpy(out + m, field + (size_t)top[0] * SPRINGLS__BRICK_VOXELS + row, 8 * sizeof *out);
                memcpy(out + m + 8, field + (size_t)top[1] * SPRINGLS__BRICK_VOXELS + row, (size_t)m * sizeof *out);
            }
        }
}

/* Trilinear value at x, in voxels from the brick's first one. */
SPRINGLS__FN float springls__wide_tile_sample(const springls__wide_tile *tile, springls__v3 x)
{
    const int m = SPRINGLS__WIDE_MARGIN, sy = SPRINGLS__WIDE, sz = SPRINGLS__WIDE * SPRINGLS__WIDE;
    const float lower = (float)-m, upper = (float)(7 + m);
    float i = springls__floor(x.x), j = springls__floor(x.y), k = springls__floor(x.z), corner[8];
    const float *t;
    if (!(i >= lower && j >= lower && k >= lower && i < upper && j < upper && k < upper)) {
        springls__v3 origin = springls__v3_make((float)tile->origin[0], (float)tile->origin[1], (float)tile->origin[2]);
        return springls__grid_sample(tile->g, tile->field, springls__add(x, origin));
    }
    t = tile->value + ((int)i + m) + sy * ((int)j + m) + sz * ((int)k + m);
    corner[0] = t[0];
    corner[1] = t[1];
    corner[2] = t[sy];
    corner[3] = t[sy + 1];
    corner[4] = t[sz];
    corner[5] = t[sz + 1];
    corner[6] = t[sz + sy];
    corner[7] = t[sz + sy + 1];
    return springls__trilinear(corner, x.x - i, x.y - j, x.z - k);
}

SPRINGLS__FN void springls__fill(float *field, int slot, float value)
{
    float *brick = field + (size_t)slot * SPRINGLS__BRICK_VOXELS;
    int i;
    for (i = 0; i < SPRINGLS__BRICK_VOXELS; i++) brick[i] = value;
}

/* Room for `slots` slots. A reference grid (omega_memory unused) has phi only. */
SPRINGLS__FN springls_status springls__grid_reserve(springls_context *ctx, springls__grid *g, int slots, bool phi_only)
{
    size_t n = (size_t)slots, used = (size_t)g->slot_count, brick = SPRINGLS__BRICK_VOXELS * sizeof(float);
    SPRINGLS__TRY(springls__grow(ctx, &g->slot_memory, n, sizeof(int), used * sizeof(int)));
    g->slot_brick = (int *)g->slot_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &g->active_memory, n, sizeof(int), (size_t)g->active_count * sizeof(int)));
    g->active = (int *)g->active_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &g->free_memory, n, sizeof(int), (size_t)g->free_count * sizeof(int)));
    g->free_slots = (int *)g->free_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &g->phi_memory, n, brick, used * brick));
    g->phi = (float *)g->phi_memory.data;
    if (phi_only) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grow(ctx, &g->next_memory, n, brick, used * brick));
    g->phi_next = (float *)g->next_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &g->omega_memory, n, brick, used * brick));
    g->omega = (float *)g->omega_memory.data;
    SPRINGLS__TRY(springls__grow(ctx, &g->cell_memory, n, SPRINGLS__CELLS * sizeof(uint32_t), used * SPRINGLS__CELLS * sizeof(uint32_t)));
    g->cell = (uint32_t *)g->cell_memory.data;
    return SPRINGLS_OK;
}

/* Everything outside: keeps memory. */
SPRINGLS__FN void springls__grid_clear(springls_context *ctx, springls__grid *g, bool phi_only)
{
    size_t i, bricks = (size_t)g->bricks[0] * (size_t)g->bricks[1] * (size_t)g->bricks[2];
    int slot;
    g->far_value = ctx->params.band_half_width + 1.0f;
    for (i = 0; i < bricks; i++) g->top[i] = SPRINGLS__OUTSIDE;
    g->active_count = g->free_count = 0;
    g->slot_count = SPRINGLS__FIRST_SLOT;
    for (slot = 0; slot < SPRINGLS__FIRST_SLOT; slot++) {
        float value = slot == SPRINGLS__INSIDE ? -g->far_value : g->far_value;
        g->slot_brick[slot] = -1;
        springls__fill(g->phi, slot, value);
        if (phi_only) continue;
        springls__fill(g->phi_next, slot, value);
        springls__fill(g->omega, slot, ctx->params.capture);
        memset(g->cell + (size_t)slot * SPRINGLS__CELLS, 0, SPRINGLS__CELLS * sizeof *g->cell);
    }
}

SPRINGLS__FN springls_status springls__grid_create(springls_context *ctx, springls__grid *g, bool phi_only)
{
    size_t bricks = 1;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        g->size[axis] = ctx->desc.grid.size[axis];
        g->bricks[axis] = (g->size[axis] + 7) / 8;
        bricks *= (size_t)g->bricks[axis];
    }
    SPRINGLS__TRY(springls__grow(ctx, &g->top_memory, bricks, sizeof(int), 0));
    g->top = (int *)g->top_memory.data;
    SPRINGLS__TRY(springls__grid_reserve(ctx, g, SPRINGLS__FIRST_SLOT, phi_only));
    springls__grid_clear(ctx, g, phi_only);
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__grid_free(springls_context *ctx, springls__grid *g)
{
    springls__buffer_free(ctx, &g->top_memory);
    springls__buffer_free(ctx, &g->slot_memory);
    springls__buffer_free(ctx, &g->active_memory);
    springls__buffer_free(ctx, &g->free_memory);
    springls__buffer_free(ctx, &g->phi_memory);
    springls__buffer_free(ctx, &g->next_memory);
    springls__buffer_free(ctx, &g->omega_memory);
    springls__buffer_free(ctx, &g->cell_memory);
    memset(g, 0, sizeof *g);
}

SPRINGLS__FN int springls__compare_int(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

/* Gives every brick of the list (any order, repetitions and present bricks allowed) a slot that continues the constant
   it had, and keeps `active` ordered by brick. */
SPRINGLS__FN springls_status springls__grid_add_bricks(springls_context *ctx, springls__grid *g, int *list, int count)
{
    int i, n = 0, write, read;
    qsort(list, (size_t)count, sizeof *list, springls__compare_int);
    for (i = 0; i < count; i++)
        if (g->top[list[i]] < SPRINGLS__FIRST_SLOT && (n == 0 || list[n - 1] != list[i])) list[n++] = list[i];
    if (n == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grid_reserve(ctx, g, g->slot_count + n, false));
    write = g->active_count + n - 1;
    read = g->active_count - 1;
    g->active_count += n;
    for (i = n - 1; i >= 0; i--) { /* merge from the back */
        int slot = g->free_count ? g->free_slots[--g->free_count] : g->slot_count++;
        int side = g->top[list[i]];
        while (read >= 0 && g->slot_brick[g->active[read]] > list[i]) g->active[write--] = g->active[read--];
        g->active[write--] = slot;
        g->slot_brick[slot] = list[i];
        g->top[list[i]] = slot;
        springls__fill(g->phi, slot, side == SPRINGLS__INSIDE ? -g->far_value : g->far_value);
        springls__fill(g->phi_next, slot, side == SPRINGLS__INSIDE ? -g->far_value : g->far_value);
        springls__fill(g->omega, slot, -1.0f); /* unknown */
        memset(g->cell + (size_t)slot * SPRINGLS__CELLS, 0, SPRINGLS__CELLS * sizeof *g->cell);
    }
    return SPRINGLS_OK;
}

/* Drops the active slots with keep[i] == 0 (i: place in `active`); their bricks become constant. */
SPRINGLS__FN void springls__grid_drop_bricks(springls__grid *g, const uint8_t *keep)
{
    int i, n = 0;
    for (i = 0; i < g->active_count; i++) {
        int slot = g->active[i];
        if (keep[i]) {
            g->active[n++] = slot;
            continue;
        }
        g->top[g->slot_brick[slot]] = g->phi[(size_t)slot * SPRINGLS__BRICK_VOXELS] < 0.0f ? SPRINGLS__INSIDE : SPRINGLS__OUTSIDE;
        g->slot_brick[slot] = -1;
        g->free_slots[g->free_count++] = slot;
    }
    g->active_count = n;
}

/* phi_ref = phi: the same slots, phi only. */
SPRINGLS__FN springls_status springls__grid_copy_phi(springls_context *ctx, springls__grid *to, const springls__grid *from)
{
    size_t bricks = (size_t)from->bricks[0] * (size_t)from->bricks[1] * (size_t)from->bricks[2];
    SPRINGLS__TRY(springls__grid_reserve(ctx, to, from->slot_count, true));
    to->far_value = from->far_value;
    to->slot_count = from->slot_count;
    to->active_count = from->active_count;
    memcpy(to->top, from->top, bricks * sizeof *to->top);
    memcpy(to->slot_brick, from->slot_brick, (size_t)from->slot_count * sizeof *to->slot_brick);
    memcpy(to->active, from->active, (size_t)from->active_count * sizeof *to->active);
    memcpy(to->phi, from->phi, (size_t)from->slot_count * SPRINGLS__BRICK_VOXELS * sizeof *to->phi);
    return SPRINGLS_OK;
}
