/* isosurface.h - the zero level as a welded mesh. The vertex on an edge of the voxel grid belongs to the first of the up to four
   cubes around it, in the order in which cubes are visited: brick by brick, x fastest. So a cube knows which vertices are its
   own, how many come before follows from a scan, and others find the number of a vertex by asking the cube that owns it. */

/* A cube with triangles: its case, the edges it owns << 8, vertices owned by those before it in the brick << 20. */
typedef uint32_t springls__cube;

SPRINGLS__MATHS int springls__cube_case(springls__cube cube) { return (int)(cube & 255u); }
SPRINGLS__MATHS bool springls__cube_owns(springls__cube cube, int edge) { return (cube >> 8 >> edge & 1u) != 0u; }
SPRINGLS__MATHS int springls__cube_first(springls__cube cube) { return (int)(cube >> 20); }

/* Cube (x, y, z) of a brick, each from -1 on, among those of active brick i. */
SPRINGLS__MATHS int springls__cube_index(int x, int y, int z) { return x + 1 + 9 * (y + 1 + 9 * (z + 1)); }

SPRINGLS__MATHS SPRINGLS__GLOBAL springls__cube *springls__cubes_of(const springls__model *model, int i)
{
    return (SPRINGLS__GLOBAL springls__cube *)model->scratch[1] + (size_t)i * SPRINGLS__CUBES;
}

/* How many triangles and vertices active bricks have; after the scan, those before them. */
SPRINGLS__MATHS SPRINGLS__GLOBAL uint32_t *springls__triangles_before(const springls__model *model)
{
    return (SPRINGLS__GLOBAL uint32_t *)model->scratch[2];
}

SPRINGLS__MATHS SPRINGLS__GLOBAL uint32_t *springls__vertices_before(const springls__model *model)
{
    return (SPRINGLS__GLOBAL uint32_t *)model->scratch[3];
}

/* The cube that a vertex belongs to, its brick, and the edge that carries the vertex there. */
typedef struct springls__vertex_owner { int cube[3], brick, edge; } springls__vertex_owner;

/* Of the vertex on an edge of the cube whose corner 0 is voxel (x, y, z): of the four cubes the first in the brick of the lowest
   number. Cubes that begin before the domain belong to the bricks at its border. */
SPRINGLS__MATHS springls__vertex_owner springls__owner_of(const springls__grid *g, int x, int y, int z, int edge)
{
    const int axis = springls__mc_edge_axis(edge), b = axis == 0 ? 1 : 0, c = axis == 2 ? 1 : 2;
    springls__vertex_owner owner;
    int at[3], at_b, at_c, k;
    at[0] = x;
    at[1] = y;
    at[2] = z;
    at_b = at[b] + (edge & 1);
    at_c = at[c] + (edge >> 1 & 1);
    owner.cube[axis] = at[axis];
    owner.brick = -1;
    for (k = 3; k >= 0; k--) {
        int brick;
        at[b] = at_b - (k & 1);
        at[c] = at_c - (k >> 1);
        brick = springls__brick_at(g, springls__imax(at[0], 0), springls__imax(at[1], 0), springls__imax(at[2], 0));
        if ((owner.brick >= 0 && brick >= owner.brick) || g->top[brick] < SPRINGLS__FIRST_SLOT) continue;
        owner.brick = brick;
        owner.edge = 4 * axis + k;
        owner.cube[b] = at[b];
        owner.cube[c] = at[c];
        if ((at_b & 7) != 0 && (at_c & 7) != 0) break; /* all four are in one brick */
    }
    return owner;
}

/* The edges with a vertex that belongs to a cube. */
SPRINGLS__MATHS uint32_t springls__own_edges(const springls__grid *g, int x, int y, int z, int mask)
{
    uint32_t own = 0u;
    int edge;
    for (edge = 0; edge < 12; edge++) {
        int a = springls__mc_edge_corner(edge), b = a | 1 << springls__mc_edge_axis(edge);
        springls__vertex_owner owner;
        if (((mask >> a ^ mask >> b) & 1) == 0) continue;
        owner = springls__owner_of(g, x, y, z, edge);
        if (owner.cube[0] == x && owner.cube[1] == y && owner.cube[2] == z) own |= 1u << edge;
    }
    return own;
}

/* Which voxels of a row of a tile are inside, one bit each. */
SPRINGLS__MATHS uint32_t springls__signs_of_row(const float *row)
{
    uint32_t signs = 0u;
    int x;
    for (x = 0; x < SPRINGLS__TILE; x++) signs |= (uint32_t)springls__mc_inside(row[x]) << x;
    return signs;
}

/* The case of the cube at x between four rows. */
SPRINGLS__MATHS int springls__case_between(const uint32_t row[4], int x)
{
    return (int)((row[0] >> (x + 1) & 3u) | (row[1] >> (x + 1) & 3u) << 2 | (row[2] >> (x + 1) & 3u) << 4 | (row[3] >> (x + 1) & 3u) << 6);
}

/* To SCRATCH1: the cubes of active brick i, 0 for those without triangles. To SCRATCH2 and 3: how many triangles and vertices
   they have. To SCRATCH4, for its slot: i. */
SPRINGLS__MATHS void springls__surface_count_element(const springls__model *model, springls__job job, int i)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL springls__cube *cubes = springls__cubes_of(model, i);
    springls__cube_range range = springls__brick_cubes(g, g->active[i]);
    float tile[SPRINGLS__TILE_VOXELS];
    uint32_t signs[SPRINGLS__TILE * SPRINGLS__TILE], triangles = 0u, vertices = 0u;
    int x, y, z, k;
    (void)job;
    springls__load_tile(g, g->phi, g->active[i], tile);
    for (k = 0; k < SPRINGLS__TILE * SPRINGLS__TILE; k++) signs[k] = springls__signs_of_row(tile + SPRINGLS__TILE * k);
    for (k = 0; k < SPRINGLS__CUBES; k++) cubes[k] = 0u;
    for (z = range.lo[2]; z <= range.hi[2]; z++)
        for (y = range.lo[1]; y <= range.hi[1]; y++) {
            uint32_t row[4], all = (1u << SPRINGLS__TILE) - 1u, some = 0u, own;
            for (k = 0; k < 4; k++) {
                row[k] = signs[y + 1 + (k & 1) + SPRINGLS__TILE * (z + 1 + (k >> 1))];
                all &= row[k];
                some |= row[k];
            }
            if (some == 0u || all == (1u << SPRINGLS__TILE) - 1u) continue;
            for (x = range.lo[0]; x <= range.hi[0]; x++) {
                int mask = springls__case_between(row, x);
                if (springls__mc_count(mask) == 0) continue;
                own = springls__own_edges(g, range.origin[0] + x, range.origin[1] + y, range.origin[2] + z, mask);
                cubes[springls__cube_index(x, y, z)] = (uint32_t)mask | own << 8 | vertices << 20;
                triangles += (uint32_t)springls__mc_count(mask);
                for (; own; own &= own - 1u) vertices++;
            }
        }
    springls__triangles_before(model)[i] = triangles;
    springls__vertices_before(model)[i] = vertices;
    ((SPRINGLS__GLOBAL int *)model->scratch[4])[g->active[i]] = i;
}

/* The number of the vertex on an edge of a cube that is not the cube's. Its owner numbers vertices as triangles come to them. */
SPRINGLS__MATHS int springls__vertex_elsewhere(const springls__model *model, int x, int y, int z, int edge)
{
    springls__vertex_owner owner = springls__owner_of(&model->grid, x, y, z, edge);
    int i = ((SPRINGLS__GLOBAL const int *)model->scratch[4])[model->grid.top[owner.brick]], axis, k, other, number;
    uint32_t seen = 0u;
    springls__cube cube;
    for (axis = 0; axis < 3; axis++) owner.cube[axis] -= springls__imax(owner.cube[axis], 0) & ~7;
    cube = springls__cubes_of(model, i)[springls__cube_index(owner.cube[0], owner.cube[1], owner.cube[2])];
    number = (int)springls__vertices_before(model)[i] + springls__cube_first(cube);
    for (k = 0; (other = springls__mc_edge(springls__cube_case(cube), 0, k)) != owner.edge; k++) {
        if (springls__cube_owns(cube, other) && !(seen >> other & 1u)) number++;
        seen |= 1u << other;
    }
    return number;
}

/* Vertices of active brick i to SCRATCH5, triangles to SCRATCH6. */
SPRINGLS__MATHS void springls__surface_element(const springls__model *model, springls__job job, int i)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL const springls__cube *cubes = springls__cubes_of(model, i);
    SPRINGLS__GLOBAL springls__v3 *positions = (SPRINGLS__GLOBAL springls__v3 *)model->scratch[5];
    SPRINGLS__GLOBAL int *corner = (SPRINGLS__GLOBAL int *)model->scratch[6] + 3 * (size_t)springls__triangles_before(model)[i];
    springls__cube_range range = springls__brick_cubes(g, g->active[i]);
    float tile[SPRINGLS__TILE_VOXELS];
    int place = (int)springls__vertices_before(model)[i], vertex[12], n, k;
    bool loaded = false;
    (void)job;
    for (n = 0; n < SPRINGLS__CUBES; n++) {
        const int x = n % 9 - 1, y = n / 9 % 9 - 1, z = n / 81 - 1, mask = springls__cube_case(cubes[n]), *o = range.origin;
        springls__mc_cell cell;
        uint32_t seen = 0u;
        if (cubes[n] == 0u) continue;
        if (!loaded) springls__load_tile(g, g->phi, g->active[i], tile);
        loaded = true;
        cell = springls__tile_cube(tile, x, y, z);
        for (k = 0; k < 3 * springls__mc_count(mask); k++) {
            int edge = springls__mc_edge(mask, 0, k);
            if (!(seen >> edge & 1u) && springls__cube_owns(cubes[n], edge)) {
                positions[place] = springls__cube_vertex(&range, cell, x, y, z, edge);
                vertex[edge] = place++;
            } else if (!(seen >> edge & 1u)) {
                vertex[edge] = springls__vertex_elsewhere(model, o[0] + x, o[1] + y, o[2] + z, edge);
            }
            seen |= 1u << edge;
            *corner++ = vertex[edge];
        }
    }
}

/* The correspondence of a point near a springl: the quadratic fit around it, or the springl's own. */
SPRINGLS__MATHS springls__v3 springls__correspondence_at(const springls__model *model, int springl, springls__v3 x)
{
    springls__v3 a = model->set.a[springl];
    springls__fit_result fit = springls__fit_at(model, x, springls__springl_normal(model->set.s[springl]), a, model->set.count);
    return fit.ok ? fit.a : a;
}

/* Of vertex i (SCRATCH5): gradient of phi to SCRATCH1, correspondence to SCRATCH2, nearest springl to SCRATCH3. */
SPRINGLS__MATHS void springls__dress_element(const springls__model *model, springls__job job, int i)
{
    springls__v3 x = ((SPRINGLS__GLOBAL const springls__v3 *)model->scratch[5])[i];
    int nearest = springls__nearest_springl(model, x, 1.0f);
    (void)job;
    ((SPRINGLS__GLOBAL springls__v3 *)model->scratch[1])[i] = springls__grid_gradient(&model->grid, model->grid.phi, x);
    ((SPRINGLS__GLOBAL springls__v3 *)model->scratch[2])[i] = nearest < 0 ? x : springls__correspondence_at(model, nearest, x);
    ((SPRINGLS__GLOBAL int *)model->scratch[3])[i] = nearest;
}
