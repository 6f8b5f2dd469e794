/* isosurface.h - the zero level as a welded mesh. The vertex on an edge of the voxel grid belongs to the first of the up to
   four cubes around it, in the order in which cubes are visited: brick by brick, x fastest. So each cube has the number of its
   own vertices; a scan gives how many come before; and the number of another cube's vertex is found at the cube that owns
   it. */
#ifndef SPRINGLS__KERNEL_OUTPUT_ISOSURFACE_H
#define SPRINGLS__KERNEL_OUTPUT_ISOSURFACE_H

#include "../model/correspondence_fit.h"
#include "../model/grid.h"
#include "../model/marching_cubes.h"
#include "../model/model.h"
#include "../model/neighborhood.h"
#include "../stages/fill_gaps.h"
#include "../stages/track.h"

#define SPRINGLS__CUBE_ROWS 81 /* of nine cubes, in a brick */

/* A cube with triangles: its case, the edges it owns << 8, vertices owned by those before it in the brick << 20. */
typedef uint32_t springls__cube;

SPRINGLS__MATHS int springls__cube_case(springls__cube cube) { return (int)(cube & 255u); }
SPRINGLS__MATHS bool springls__cube_owns(springls__cube cube, int edge) { return (cube >> 8 >> edge & 1u) != 0u; }
SPRINGLS__MATHS int springls__cube_first(springls__cube cube) { return (int)(cube >> 20); }

/* Returns the place of cube (x, y, z), each from -1 on, among those of a brick. */
SPRINGLS__MATHS int springls__cube_index(int x, int y, int z) { return x + 1 + 9 * (y + 1 + 9 * (z + 1)); }

SPRINGLS__MATHS SPRINGLS__GLOBAL springls__cube *springls__cubes_of(const springls__model *model, int i)
{
    return springls__cubes(model) + (size_t)i * SPRINGLS__CUBES;
}

/* Returns the triangles of active brick i before each of its rows of cubes. */
SPRINGLS__MATHS SPRINGLS__GLOBAL uint32_t *springls__triangles_of_rows(const springls__model *model, int i)
{
    return springls__row_triangles(model) + (size_t)i * SPRINGLS__CUBE_ROWS;
}

/* The cube that a vertex belongs to, the entry of its brick, and the edge that carries the vertex there. */
typedef struct springls__vertex_owner { int cube[3], entry, edge; } springls__vertex_owner;

/* Finds the owner of the vertex on an edge of the cube whose corner 0 is voxel (x, y, z): of the four cubes around the edge the
   first in the brick of the lowest number. Cubes that begin before the domain belong to the bricks at its border. */
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
    owner.entry = -1;
    for (k = 3; k >= 0; k--) {
        int entry;
        at[b] = at_b - (k & 1);
        at[c] = at_c - (k >> 1);
        entry = springls__entry_at(g, springls__imax(at[0], 0), springls__imax(at[1], 0), springls__imax(at[2], 0));
        if ((owner.entry >= 0 && entry >= owner.entry) || g->top[entry] < SPRINGLS__FIRST_SLOT) continue;
        owner.entry = entry;
        owner.edge = 4 * axis + k;
        owner.cube[b] = at[b];
        owner.cube[c] = at[c];
        if ((at_b & 7) != 0 && (at_c & 7) != 0) break; /* all four are in one brick */
    }
    return owner;
}

/* Returns the edges, as bits, whose vertices belong to the cube: edges that no earlier cube shares and, if earlier cubes lie in other
   bricks, some more. mask: the cube's case. */
SPRINGLS__MATHS uint32_t springls__own_edges(const springls__grid *g, int x, int y, int z, int mask)
{
    uint32_t own = 0u;
    int edge;
    bool first[3];
    first[0] = (x & 7) == 0;
    first[1] = (y & 7) == 0;
    first[2] = (z & 7) == 0;
    for (edge = 0; edge < 12; edge++) {
        int axis = springls__mc_edge_axis(edge), a = springls__mc_edge_corner(edge);
        springls__vertex_owner owner;
        if (!((edge & 1) || first[axis == 0 ? 1 : 0]) || !((edge & 2) || first[axis == 2 ? 1 : 2])) continue;
        if (((mask >> a ^ mask >> (a | 1 << axis)) & 1) == 0) continue;
        if ((edge & 3) != 3) {
            owner = springls__owner_of(g, x, y, z, edge);
            if (owner.cube[0] != x || owner.cube[1] != y || owner.cube[2] != z) continue;
        }
        own |= 1u << edge;
    }
    return own;
}

/* Finds the signs of the four rows of voxels around a row of cubes; false if all are the same. */
SPRINGLS__MATHS bool springls__signs_around(SPRINGLS__LOCAL const float *signs, int y, int z, uint32_t row[4])
{
    uint32_t all = (1u << SPRINGLS__TILE) - 1u, some = 0u;
    int k;
    for (k = 0; k < 4; k++) {
        row[k] = (uint32_t)signs[y + 1 + (k & 1) + SPRINGLS__TILE * (z + 1 + (k >> 1))];
        all &= row[k];
        some |= row[k];
    }
    return some != 0u && all != (1u << SPRINGLS__TILE) - 1u;
}

/* Returns the case of the cube at x between the four rows. */
SPRINGLS__MATHS int springls__case_between(const uint32_t row[4], int x)
{
    uint32_t mask = 0u;
    int k;
    for (k = 0; k < 4; k++) mask |= (row[k] >> (x + 1) & 3u) << 2 * k;
    return (int)mask;
}

/* Floats that work items share: a tile, its signs (whole numbers), and counts of the rows of cubes: triangles, vertices. */
#define SPRINGLS__SURFACE_FLOATS (SPRINGLS__TILE_VOXELS + SPRINGLS__TILE * SPRINGLS__TILE + 2 * SPRINGLS__CUBE_ROWS)

/* Counts row n of the cubes of active brick i, and fills them in; vertices are counted from the row's begin. */
SPRINGLS__MATHS void springls__count_row(const springls__model *model, const springls__cube_range *range, int i, int n,
                                         SPRINGLS__LOCAL const float *signs, SPRINGLS__LOCAL float *rows)
{
    SPRINGLS__GLOBAL springls__cube *cubes = springls__cubes_of(model, i) + 9 * n;
    const int y = n % 9 - 1, z = n / 9 - 1, *o = range->origin;
    uint32_t row[4], triangles = 0u, vertices = 0u, own;
    int x;
    for (x = 0; x < 9; x++) cubes[x] = 0u;
    if (y >= range->lo[1] && y <= range->hi[1] && z >= range->lo[2] && z <= range->hi[2]
        && springls__signs_around(signs, y, z, row))
        for (x = range->lo[0]; x <= range->hi[0]; x++) {
            int mask = springls__case_between(row, x);
            if (springls__mc_count(mask) == 0) continue;
            own = springls__own_edges(&model->grid, o[0] + x, o[1] + y, o[2] + z, mask);
            cubes[x + 1] = (uint32_t)mask | own << 8 | vertices << 20;
            triangles += (uint32_t)springls__mc_count(mask);
            for (; own; own &= own - 1u) vertices++;
        }
    rows[n] = (float)triangles;
    rows[SPRINGLS__CUBE_ROWS + n] = (float)vertices;
}

/* Finds the cubes of active brick i, 0 for those without triangles, and counts their triangles and vertices. */
SPRINGLS__MATHS void springls__surface_count_element(const springls__model *model, springls__arguments args, int i,
                                                     SPRINGLS__LOCAL float *tile)
{
    const springls__group group = model->group;
    SPRINGLS__LOCAL float *signs = tile + SPRINGLS__TILE_VOXELS, *rows = signs + SPRINGLS__TILE * SPRINGLS__TILE;
    SPRINGLS__GLOBAL springls__cube *cubes = springls__cubes_of(model, i);
    const springls__cube_range range = springls__brick_cubes(&model->grid, model->grid.active[i]);
    int n, x, k;
    (void)args;
    springls__load_tile(&model->grid, model->grid.phi, model->grid.active[i], group, tile);
    for (n = group.item; n < SPRINGLS__TILE * SPRINGLS__TILE; n += group.items)
        signs[n] = (float)springls__signs_of_row(tile + SPRINGLS__TILE * n);
    SPRINGLS__BARRIER;
    for (n = group.item; n < SPRINGLS__CUBE_ROWS; n += group.items) springls__count_row(model, &range, i, n, signs, rows);
    SPRINGLS__BARRIER;
    for (k = 0; k < 2 && group.item == 0; k++) { /* sums of the rows before */
        float sum = 0.0f;
        for (n = k * SPRINGLS__CUBE_ROWS; n < (k + 1) * SPRINGLS__CUBE_ROWS; n++) {
            float one = rows[n];
            rows[n] = sum;
            sum += one;
        }
        (k ? springls__vertices_before(model) : springls__triangles_before(model))[i] = (uint32_t)sum;
    }
    SPRINGLS__BARRIER;
    if (group.item == 0) springls__surface_rank(model)[model->grid.active[i]] = i;
    for (n = group.item; n < SPRINGLS__CUBE_ROWS; n += group.items) {
        uint32_t vertices = (uint32_t)rows[SPRINGLS__CUBE_ROWS + n];
        springls__triangles_of_rows(model, i)[n] = (uint32_t)rows[n];
        for (x = 0; x < 9 && vertices > 0u; x++)
            if (cubes[9 * n + x]) cubes[9 * n + x] += vertices << 20;
    }
}

/* Returns the number of a vertex that another cube owns, which numbers its vertices in the order of its triangles. */
SPRINGLS__MATHS int springls__vertex_elsewhere(const springls__model *model, int x, int y, int z, int edge)
{
    springls__vertex_owner owner = springls__owner_of(&model->grid, x, y, z, edge);
    int i = springls__surface_rank(model)[model->grid.top[owner.entry]], axis, k, other, number;
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

/* Writes the vertices that a cube owns, and its triangles from number `first` on. */
SPRINGLS__MATHS void springls__surface_cube(const springls__model *model, const springls__cube_range *range, int i, int x, int y,
                                            int z, springls__mc_cell cell, springls__cube cube, uint32_t first)
{
    SPRINGLS__GLOBAL springls__v3 *positions = springls__surface_positions(model);
    SPRINGLS__GLOBAL int *corners = springls__surface_corners(model) + 3 * (size_t)first;
    const int mask = springls__cube_case(cube), *o = range->origin;
    const int count = 3 * springls__mc_count(mask);
    int place = (int)springls__vertices_before(model)[i] + springls__cube_first(cube), vertex[12], k;
    uint32_t seen = 0u;
    for (k = 0; k < count; k++) {
        int edge = springls__mc_edge(mask, 0, k);
        if (!(seen >> edge & 1u) && springls__cube_owns(cube, edge)) {
            positions[place] = springls__cube_vertex(range, cell, x, y, z, edge);
            vertex[edge] = place++;
        } else if (!(seen >> edge & 1u)) {
            vertex[edge] = springls__vertex_elsewhere(model, o[0] + x, o[1] + y, o[2] + z, edge);
        }
        seen |= 1u << edge;
        corners[k] = vertex[edge];
    }
}

/* Writes vertices and triangles of active brick i. */
SPRINGLS__MATHS void springls__surface_element(const springls__model *model, springls__arguments args, int i,
                                               SPRINGLS__LOCAL float *tile)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL const springls__cube *cubes = springls__cubes_of(model, i);
    SPRINGLS__GLOBAL const uint32_t *before = springls__triangles_before(model) + i;
    springls__cube_range range = springls__brick_cubes(g, g->active[i]);
    uint32_t end = i + 1 < g->active_count ? before[1] : (uint32_t)args.surface.triangles;
    int n, x;
    if (end == before[0]) return;
    springls__load_tile(g, g->phi, g->active[i], model->group, tile);
    for (n = model->group.item; n < SPRINGLS__CUBE_ROWS; n += model->group.items) {
        uint32_t first = before[0] + springls__triangles_of_rows(model, i)[n];
        const int y = n % 9 - 1, z = n / 9 - 1;
        for (x = -1; x < 8; x++) {
            springls__cube cube = cubes[springls__cube_index(x, y, z)];
            if (cube == 0u) continue;
            springls__surface_cube(model, &range, i, x, y, z, springls__tile_cube(tile, x, y, z), cube, first);
            first += (uint32_t)springls__mc_count(springls__cube_case(cube));
        }
    }
}

#define SPRINGLS__MATERIAL_RADIUS 1.0f /* voxels: how far from a vertex its springl may be */

/* Voxels: no springl further away counts for a fit, whatever is rounded. */
#define SPRINGLS__SAMPLE_RANGE (1.01f * SPRINGLS__CORRESPONDENCE_RADIUS)

/* Finds the next springl of a walk that counts for a fit around springl `center`; -1: none is left. */
SPRINGLS__NOINLINE int springls__next_sample(const springls__model *model, const springls__correspondence_fit *fit, int center,
                                             springls__cell_walk *walk, springls__fit_sample *sample)
{
    const float r = SPRINGLS__SAMPLE_RANGE;
    int i;
    while ((i = springls__cell_walk_next(model, walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *s = &model->set.s[i];
        if (springls__length2(springls__sub(s->p, fit->origin)) > r * r) continue;
        if (springls__of_two_contact_bodies(model, center, i)) continue;
        *sample = springls__fit_sample_of(fit, s->p, springls__springl_normal(*s));
        if (sample->weight > 0.0f) break;
    }
    return i;
}

#define SPRINGLS__KEPT_SAMPLES 32 /* most fits have fewer; what is left is sampled twice */

/* Returns the correspondence of a point near a springl: by the fit around it, or else the springl's own. */
SPRINGLS__MATHS springls__v3 springls__correspondence_at(const springls__model *model, int springl, springls__v3 x)
{
    const springls__v3 a = model->set.a[springl], n = springls__springl_normal(model->set.s[springl]);
    springls__correspondence_fit fit = springls__correspondence_fit_begin(x, n, springls__any_tangent(n));
    springls__cell_walk walk = springls__cell_walk_near(model, x, SPRINGLS__SAMPLE_RANGE), rest = walk;
    springls__v3 sum = springls__v3_make(0.0f, 0.0f, 0.0f);
    springls__fit_sample sample, kept[SPRINGLS__KEPT_SAMPLES];
    springls__fit_shares shares;
    springls__fit_result edge;
    int i, k, count = 0, index[SPRINGLS__KEPT_SAMPLES];
    if (model->params.keep_edges && springls__place_at_edge(model, x, n, a, model->set.count, &edge)) return edge.ok ? edge.a : a;
    while ((i = springls__next_sample(model, &fit, springl, &walk, &sample)) >= 0) {
        springls__correspondence_fit_add(&fit, sample);
        if (count == SPRINGLS__KEPT_SAMPLES) continue;
        kept[count] = sample;
        index[count++] = i;
        rest = walk;
    }
    shares = springls__fit_shares_of(&fit);
    for (k = 0; k < count; k++)
        sum = springls__mad(sum, springls__sub(model->set.a[index[k]], a), springls__fit_share(&shares, kept[k]));
    while ((i = springls__next_sample(model, &fit, springl, &rest, &sample)) >= 0)
        sum = springls__mad(sum, springls__sub(model->set.a[i], a), springls__fit_share(&shares, sample));
    return springls__add(a, sum);
}

/* Finds the gradient of phi, the correspondence and the nearest springl at vertex i. */
SPRINGLS__MATHS void springls__attach_vertex_data_element(const springls__model *model, springls__arguments args, int i)
{
    springls__v3 x = springls__surface_positions(model)[i];
    int nearest = springls__nearest_springl(model, x, SPRINGLS__MATERIAL_RADIUS);
    (void)args;
    springls__vertex_gradient(model)[i] = springls__grid_gradient(&model->grid, model->grid.phi, x);
    springls__vertex_correspondence(model)[i] = nearest < 0 ? x : springls__correspondence_at(model, nearest, x);
    springls__vertex_springl(model)[i] = nearest;
}

#endif
