/* isosurface.h - the watertight zero level as a welded mesh; the springls as a soup. */

/* Welded marching cubes: voxel positions and triangles, in scratch 1 and 2. */
typedef struct springls__raw_mesh { springls__v3 *positions; int *triangles; int vertex_count, triangle_count; } springls__raw_mesh;

SPRINGLS__FN int springls__count_triangles(const springls_context *ctx)
{
    const springls__grid *g = &ctx->model.grid;
    float tile[SPRINGLS__TILE_VOXELS];
    int i, x, y, z, total = 0;
    for (i = 0; i < g->active_count; i++) {
        springls__cube_range range = springls__brick_cubes(g, g->active[i]);
        springls__load_tile(g, g->phi, g->active[i], springls__alone(), tile);
        for (z = range.lo[2]; z <= range.hi[2]; z++)
            for (y = range.lo[1]; y <= range.hi[1]; y++)
                for (x = range.lo[0]; x <= range.hi[0]; x++) total += springls__mc_count(springls__mc_case(springls__tile_cube(tile, x, y, z)));
    }
    return total;
}

/* A hash table from cube edges to vertices. */
typedef struct springls__weld { uint64_t *keys; int *vertices; size_t mask; } springls__weld;

/* The number of the edge from a voxel (one may be -1) along an axis; never 0. */
SPRINGLS__FN uint64_t springls__edge_key(const springls__grid *g, int x, int y, int z, int axis)
{
    uint64_t nx = (uint64_t)g->size[0] + 2, ny = (uint64_t)g->size[1] + 2;
    return 1 + (uint64_t)axis + 3 * ((uint64_t)(x + 1) + nx * ((uint64_t)(y + 1) + ny * (uint64_t)(z + 1)));
}

SPRINGLS__FN int springls__weld_vertex(springls__weld *weld, springls__raw_mesh *mesh, uint64_t key, springls__v3 position)
{
    size_t at = (size_t)((key * 0x9E3779B97F4A7C15u) >> 20) & weld->mask;
    while (weld->keys[at] != key) {
        if (weld->keys[at] == 0) {
            weld->keys[at] = key;
            weld->vertices[at] = mesh->vertex_count;
            mesh->positions[mesh->vertex_count++] = position;
            break;
        }
        at = (at + 1) & weld->mask;
    }
    return weld->vertices[at];
}

SPRINGLS__FN void springls__weld_brick(const springls__grid *g, int slot, springls__weld *weld, springls__raw_mesh *mesh)
{
    springls__cube_range range = springls__brick_cubes(g, slot);
    float tile[SPRINGLS__TILE_VOXELS];
    int x, y, z, k, m;
    springls__load_tile(g, g->phi, slot, springls__alone(), tile);
    for (z = range.lo[2]; z <= range.hi[2]; z++)
        for (y = range.lo[1]; y <= range.hi[1]; y++)
            for (x = range.lo[0]; x <= range.hi[0]; x++) {
                springls__mc_cell cell = springls__tile_cube(tile, x, y, z);
                int mask = springls__mc_case(cell);
                for (k = 0; k < springls__mc_count(mask); k++, mesh->triangle_count++)
                    for (m = 0; m < 3; m++) {
                        int edge = springls__mc_edge(mask, k, m), corner = springls__mc_edge_corner(edge);
                        uint64_t key = springls__edge_key(g, range.origin[0] + x + (corner & 1), range.origin[1] + y + ((corner >> 1) & 1),
                                                          range.origin[2] + z + (corner >> 2), springls__mc_edge_axis(edge));
                        mesh->triangles[3 * mesh->triangle_count + m] =
                            springls__weld_vertex(weld, mesh, key, springls__cube_vertex(&range, cell, x, y, z, edge));
                    }
            }
}

SPRINGLS__FN springls_status springls__isosurface(springls_context *ctx, springls__raw_mesh *mesh)
{
    const springls__grid *g = &ctx->model.grid;
    springls__weld weld;
    size_t triangles = (size_t)springls__count_triangles(ctx), room = 16;
    int i;
    while (room < 3 * triangles) room *= 2; /* a closed mesh has half as many vertices as triangles: a sixth full */
    SPRINGLS__TRY(springls__scratch(ctx, 1, 3 * triangles, sizeof *mesh->positions, (void **)&mesh->positions));
    SPRINGLS__TRY(springls__scratch(ctx, 2, 3 * triangles, sizeof *mesh->triangles, (void **)&mesh->triangles));
    SPRINGLS__TRY(springls__scratch(ctx, 3, room, sizeof *weld.keys, (void **)&weld.keys));
    SPRINGLS__TRY(springls__scratch(ctx, 4, room, sizeof *weld.vertices, (void **)&weld.vertices));
    memset(weld.keys, 0, room * sizeof *weld.keys);
    weld.mask = room - 1;
    mesh->vertex_count = mesh->triangle_count = 0;
    for (i = 0; i < g->active_count; i++) springls__weld_brick(g, g->active[i], &weld, mesh);
    return SPRINGLS_OK;
}

/* The arrays of a mesh, in one block. */
SPRINGLS__FN springls_status springls__mesh_allocate(springls_context *ctx, int vertices, int triangles, springls_mesh *mesh)
{
    size_t v = (size_t)vertices, t = (size_t)triangles;
    char *block;
    memset(mesh, 0, sizeof *mesh);
    if (v == 0) return SPRINGLS_OK;
    mesh->bytes = v * (9 * sizeof(float) + sizeof(int)) + t * 3 * sizeof(int);
    block = (char *)springls__allocate(ctx, mesh->bytes);
    if (!block) {
        mesh->bytes = 0;
        return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "a mesh of %d vertices does not fit in memory", vertices);
    }
    mesh->positions = (float *)(void *)block;
    mesh->normals = mesh->positions + 3 * v;
    mesh->correspondences = mesh->normals + 3 * v;
    mesh->springls = (int *)(void *)(mesh->correspondences + 3 * v);
    mesh->triangles = mesh->springls + v;
    mesh->vertex_count = vertices;
    mesh->triangle_count = triangles;
    return SPRINGLS_OK;
}

/* Triangles stay counter-clockwise seen from outside in a mirrored world. */
SPRINGLS__FN void springls__keep_orientation(const springls_context *ctx, springls_mesh *mesh)
{
    int t;
    if (!springls__is_mirrored(ctx)) return;
    for (t = 0; t < mesh->triangle_count; t++) {
        int corner = mesh->triangles[3 * t + 1];
        mesh->triangles[3 * t + 1] = mesh->triangles[3 * t + 2];
        mesh->triangles[3 * t + 2] = corner;
    }
}

/* The correspondence of a point near a springl: the quadratic fit around it, or the springl's own. */
SPRINGLS__FN springls__v3 springls__correspondence_at(const springls_context *ctx, int springl, springls__v3 x)
{
    springls__v3 a = ctx->model.set.a[springl];
    springls__fit_result fit = springls__fit_at(&ctx->model, x, springls__springl_normal(ctx->model.set.s[springl]), a, ctx->model.set.count);
    return fit.ok ? fit.a : a;
}

typedef struct springls__dress_job { springls_context *ctx; const springls__v3 *positions; springls_mesh *mesh; } springls__dress_job;

/* World position, normal, nearest springl and correspondence of each vertex. */
SPRINGLS__FN void springls__dress_task(void *arg, int begin, int end)
{
    const springls__dress_job *job = (const springls__dress_job *)arg;
    springls_context *ctx = job->ctx;
    for (; begin < end; begin++) {
        springls__v3 x = job->positions[begin], n = springls__normal_to_world(ctx, springls__grid_gradient(&ctx->model.grid, ctx->model.grid.phi, x)), a = x;
        int nearest = springls__nearest_springl(&ctx->model, x, 1.0f);
        if (nearest >= 0) a = springls__correspondence_at(ctx, nearest, x);
        springls_to_world(ctx, &x.x, 1, job->mesh->positions + 3 * begin);
        springls_to_world(ctx, &a.x, 1, job->mesh->correspondences + 3 * begin);
        memcpy(job->mesh->normals + 3 * begin, &n.x, 3 * sizeof(float));
        job->mesh->springls[begin] = nearest;
    }
}

SPRINGLS_API springls_status springls_extract_mesh(springls_context *ctx, springls_mesh *out)
{
    springls__raw_mesh raw;
    springls__dress_job job;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__use_host(ctx, false));
    if (!out) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "extract_mesh: out is NULL");
    memset(out, 0, sizeof *out);
    SPRINGLS__TRY(springls__cells_build(ctx));
    SPRINGLS__TRY(springls__isosurface(ctx, &raw));
    SPRINGLS__TRY(springls__mesh_allocate(ctx, raw.vertex_count, raw.triangle_count, out));
    if (raw.vertex_count == 0) return SPRINGLS_OK;
    memcpy(out->triangles, raw.triangles, (size_t)raw.triangle_count * 3 * sizeof *raw.triangles);
    springls__keep_orientation(ctx, out);
    job.ctx = ctx;
    job.positions = raw.positions;
    job.mesh = out;
    springls__parallel(ctx, raw.vertex_count, 256, springls__dress_task, &job);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_extract_soup(springls_context *ctx, springls_mesh *out)
{
    int i, m;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__use_host(ctx, false));
    if (!out) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "extract_soup: out is NULL");
    if (ctx->model.set.count > INT32_MAX / 3) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "extract_soup: too many springls for int indices");
    SPRINGLS__TRY(springls__mesh_allocate(ctx, 3 * ctx->model.set.count, ctx->model.set.count, out));
    for (i = 0; i < ctx->model.set.count; i++) {
        springls__v3 n = springls__normal_to_world(ctx, springls__springl_normal(ctx->model.set.s[i]));
        springls_to_world(ctx, &ctx->model.set.s[i].q[0].x, 3, out->positions + 9 * i);
        for (m = 0; m < 3; m++) {
            springls_to_world(ctx, &ctx->model.set.a[i].x, 1, out->correspondences + 9 * i + 3 * m);
            memcpy(out->normals + 9 * i + 3 * m, &n.x, 3 * sizeof(float));
            out->springls[3 * i + m] = i;
            out->triangles[3 * i + m] = 3 * i + m;
        }
    }
    springls__keep_orientation(ctx, out);
    return SPRINGLS_OK;
}

SPRINGLS_API void springls_mesh_free(springls_context *ctx, springls_mesh *mesh)
{
    if (!ctx || !mesh) return;
    springls__release(ctx, mesh->positions, mesh->bytes);
    memset(mesh, 0, sizeof *mesh);
}
