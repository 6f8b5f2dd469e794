/* test_cell_list.c - cells, neighbours and bricks against searches through everything. */
#include "fixtures.h"
#include "../../src/model/neighbors.h"

/* Triangles everywhere, some partly or wholly outside the grid, one that spans it. */
static void make_soup(springls_context *ctx, int count, int huge)
{
    fixture_random_soup(ctx, count, -3.0f, 26.0f, 1.2f);
    if (!huge) return;
    fixture_add(ctx, springls__v3_make(1.0f, 2.0f, 11.0f), springls__v3_make(22.0f, 3.0f, 12.0f),
                springls__v3_make(8.0f, 21.0f, 13.0f));
}

static double springl_distance(const fixture_springl *s, d3 x)
{
    d3 t[3];
    int m;
    for (m = 0; m < 3; m++) t[m] = d3_of(s->q[m]);
    return d3_triangle_distance(t, x);
}

/* A walk around a box meets every springl within the radius, and none twice; with `covered`, all of their bricks are active. */
TEST walks_miss_nothing(int huge, int covered)
{
    springls_context *ctx = fixture_context(24, NULL);
    fixture_springl *all;
    int round, i, count;
    fixture_seed(21);
    make_soup(ctx, 900, huge);
    count = springls_count(ctx);
    all = fixture_copy(ctx);
    ASSERT_OK(fixture_stage(ctx, covered ? springls__cell_list_cover : springls__cell_list_build));
    ASSERT_EQ(covered, ctx->particles_outside == 0);
    for (round = 0; round < 300; round++) {
        springls__v3 x = fixture_point(-4.0f, 27.0f);
        float radius = fixture_between(0.05f, 3.0f);
        springls__cell_walk walk = springls__cell_walk_around(&ctx->model, x, radius);
        unsigned char *met = (unsigned char *)calloc((size_t)count, 1);
        while ((i = springls__cell_walk_next(&ctx->model, &walk)) >= 0) {
            ASSERT_LT(i, count);
            ASSERT_EQ(0, met[i]);
            met[i] = 1;
        }
        for (i = 0; i < count; i++)
            if (springl_distance(&all[i], d3_of(x)) <= (double)radius - 1e-5) ASSERT(met[i]);
        free(met);
    }
    free(all);
    springls_destroy(ctx);
    PASS();
}

/* A walk near a place meets every particle within the radius, none twice and, but for large springls, none beyond. */
TEST near_walks_meet_what_is_near(int huge)
{
    springls_context *ctx = fixture_context(24, NULL);
    int round, i, met, expected;
    fixture_seed(22);
    make_soup(ctx, 900, huge);
    ASSERT_OK(fixture_stage(ctx, springls__cell_list_cover));
    for (round = 0; round < 300; round++) {
        springls__v3 x = fixture_point(-4.0f, 27.0f);
        float radius = fixture_between(0.05f, 6.0f);
        springls__cell_walk walk = springls__cell_walk_near(&ctx->model, x, radius);
        unsigned char seen[901] = { 0 };
        for (met = 0; (i = springls__cell_walk_next(&ctx->model, &walk)) >= 0; met++) {
            ASSERT_EQ(0, seen[i]);
            seen[i] = 1;
        }
        for (i = expected = 0; i < springls_count(ctx); i++) {
            const springls__springl *s = &ctx->model.set.s[i];
            bool near_by = springls__length2(springls__sub(s->p, x)) <= radius * radius;
            expected += near_by || springls__is_large(s->bounding_radius);
            if (near_by) ASSERT(seen[i]);
        }
        ASSERT_EQ(expected, met);
    }
    springls_destroy(ctx);
    PASS();
}

/* While only triangles change about their particles, the list is kept, and is what a new one would be. */
TEST changed_triangles_keep_the_list(int huge)
{
    springls_context *ctx = fixture_context(24, NULL);
    int round, i, n;
    fixture_seed(23);
    make_soup(ctx, 300, 0);
    ASSERT_OK(fixture_stage(ctx, springls__cell_list_cover));
    for (round = 0; round < 10; round++) {
        uint32_t *ids;
        float radius;
        int large;
        n = springls_count(ctx);
        for (i = 0; i < n; i++) {
            springls__springl s = ctx->model.set.s[i];
            float size = huge && fixture_between(0.0f, 1.0f) < 0.1f ? fixture_between(0.1f, 8.0f) : fixture_between(0.8f, 1.25f);
            int m;
            for (m = 0; m < 3; m++) s.q[m] = springls__mad(s.p, springls__sub(s.q[m], s.p), size);
            ctx->model.set.s[i] = springls__springl_finished(s);
        }
        springls__triangles_changed(ctx);
        ASSERT(ctx->particles_listed);
        ASSERT_OK(fixture_stage(ctx, springls__cell_list_cover));
        radius = ctx->model.cells.bounding_radius;
        large = ctx->model.cells.unbinned_count;
        ids = (uint32_t *)malloc((size_t)n * sizeof *ids);
        memcpy(ids, ctx->model.cells.ids, (size_t)(n - large) * sizeof *ids);
        springls__constellation_moved(ctx);
        ASSERT_OK(fixture_stage(ctx, springls__cell_list_cover));
        ASSERT_EQ(large, ctx->model.cells.unbinned_count);
        ASSERT_EQ(radius, ctx->model.cells.bounding_radius);
        ASSERT_EQ(0, memcmp(ids, ctx->model.cells.ids, (size_t)(n - large) * sizeof *ids));
        free(ids);
    }
    springls_destroy(ctx);
    PASS();
}

typedef struct found { int springl; double d; } found;

static double edge_distance(const fixture_springl *s, int e, d3 q)
{
    return d3_distance(q, d3_on_segment(q, d3_of(s->q[e]), d3_of(s->q[(e + 1) % 3])));
}

static double nearest_edge(const fixture_springl *s, d3 q)
{
    double a = edge_distance(s, 0, q), b = edge_distance(s, 1, q), c = edge_distance(s, 2, q);
    return a < b ? (a < c ? a : c) : (b < c ? b : c);
}

static int by_distance(const void *a, const void *b)
{
    const found *x = (const found *)a, *y = (const found *)b;
    if (x->d != y->d) return x->d < y->d ? -1 : 1;
    return (x->springl > y->springl) - (x->springl < y->springl);
}

/* Each vertex has the closest edge of each of the nearest springls within R, nearest first, at most as many as allowed:
   the distances are those of a search through all springls in double precision. */
TEST neighbors_are_the_nearest(int huge, int most, int same_side)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    fixture_springl *all;
    found *near;
    int i, m, k, count, full = 0, some = 0;
    p.max_neighbors = most;
    p.neighbor_radius = 0.9f;
    p.relax_same_side = same_side;
    ctx = fixture_context(24, &p);
    fixture_seed(22);
    make_soup(ctx, 1000, huge);
    if (huge) /* a crowd */
        for (i = 0; i < 60; i++) {
            springls__v3 c = fixture_point(10.0f, 12.0f);
            fixture_add(ctx, c, springls__add(c, fixture_point(0.2f, 1.0f)), springls__add(c, fixture_point(-1.0f, 0.1f)));
        }
    count = springls_count(ctx);
    all = fixture_copy(ctx);
    near = (found *)malloc((size_t)count * sizeof *near);
    ASSERT_OK(fixture_stage(ctx, springls__neighbors_build));
    for (i = 0; i < count; i++) {
        const int *row = ctx->model.cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW;
        for (m = 0; m < 3; m++) {
            const int *codes = row + SPRINGLS__MAX_NEIGHBORS * m;
            d3 q = d3_of(all[i].q[m]);
            int n = 0, length = 0;
            for (k = 0; k < count; k++) {
                double facing = d3_dot(fixture_normal(&all[i]), fixture_normal(&all[k]));
                if (k == i || (same_side && facing <= 0.0)) continue;
                near[n].springl = k;
                near[n].d = nearest_edge(&all[k], q);
                if (near[n].d < 0.9 + 1e-5) n++;
            }
            qsort(near, (size_t)n, sizeof *near, by_distance);
            while (length < SPRINGLS__MAX_NEIGHBORS && codes[length] >= 0) length++;
            for (k = length; k < SPRINGLS__MAX_NEIGHBORS; k++) ASSERT_EQ(-1, codes[k]);
            ASSERT(length <= most);
            if (length < most) { /* none left out but on the very border of R */
                ASSERT(length <= n);
                for (k = length; k < n; k++) ASSERT_GT(near[k].d, 0.9 - 1e-5);
            }
            for (k = 0; k < length; k++) {
                int springl = codes[k] / 3, edge = codes[k] % 3, j;
                ASSERT(springl != i && springl < count);
                ASSERT_IN_RANGE(near[k].d, edge_distance(&all[springl], edge, q), 1e-5);
                ASSERT_IN_RANGE(nearest_edge(&all[springl], q), edge_distance(&all[springl], edge, q), 1e-5);
                for (j = 0; j < k; j++) ASSERT_NEQ(springl, codes[j] / 3);
            }
            full += length == most;
            some += length > 0;
        }
    }
    ASSERT_GT(some, 500);
    if (huge) ASSERT_GT(full, 20);
    free(near);
    free(all);
    springls_destroy(ctx);
    PASS();
}

/* Of equally near springls the one with the lower number comes first, and stays when there is room for one. */
TEST ties_go_by_number(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    int i, most;
    for (most = 1; most <= 8; most += 7) {
        const int *row;
        p.max_neighbors = most;
        ctx = fixture_context(16, &p);
        for (i = 0; i < 6; i++)
            fixture_add(ctx, springls__v3_make(7.0f, 7.0f, 8.25f), springls__v3_make(8.0f, 7.0f, 8.25f),
                        springls__v3_make(7.0f, 8.0f, 8.25f));
        fixture_add(ctx, springls__v3_make(7.0f, 7.0f, 8.0f), springls__v3_make(8.0f, 7.0f, 8.0f),
                    springls__v3_make(7.0f, 8.0f, 8.0f));
        ASSERT_OK(fixture_stage(ctx, springls__neighbors_build));
        row = ctx->model.cells.neighbors + 6 * SPRINGLS__NEIGHBOR_ROW;
        for (i = 0; i < (most == 1 ? 1 : 6); i++) ASSERT_EQ(i, row[i] / 3);
        ASSERT_EQ(-1, row[most == 1 ? 1 : 6]);
        springls_destroy(ctx);
    }
    PASS();
}

/* Springls of a cell are in ascending order, so that what is summed over them is summed in one order only. */
TEST cells_are_ordered(void)
{
    springls_context *ctx = fixture_context(24, NULL);
    int x, i, before, cell[3];
    fixture_seed(23);
    fixture_random_soup(ctx, 4000, 0.0f, 23.0f, 0.8f);
    ASSERT_OK(fixture_stage(ctx, springls__cell_list_cover));
    for (x = 0; x < 12 * 12 * 12; x++) {
        springls__v3 middle =
            springls__v3_make((float)(2 * (x % 12) + 1), (float)(2 * (x / 12 % 12) + 1), (float)(2 * (x / 144) + 1));
        springls__cell_walk walk = springls__cell_walk_begin(&ctx->model, middle, middle);
        before = -1;
        while ((i = springls__cell_walk_next(&ctx->model, &walk)) >= 0) {
            springls__v3 p = fixture_particle(ctx, i);
            ASSERT_GT(i, before);
            before = i;
            cell[0] = springls__iclamp((int)floorf(p.x), 0, 23); /* what is outside counts for the cell at the border */
            cell[1] = springls__iclamp((int)floorf(p.y), 0, 23);
            cell[2] = springls__iclamp((int)floorf(p.z), 0, 23);
            ASSERT_EQ(x, cell[0] / 2 + 12 * (cell[1] / 2 + 12 * (cell[2] / 2)));
        }
    }
    springls_destroy(ctx);
    PASS();
}

/* Bricks may come and go in any order: the top table, the ordered list of slots and the values stay consistent. */
TEST bricks_come_and_go(void)
{
    springls_context *ctx = fixture_context(40, NULL); /* 5 x 5 x 5 bricks */
    springls__grid *g = &ctx->model.grid;
    unsigned char present[125];
    int round, i, n, list[40];
    fixture_seed(24);
    memset(present, 0, sizeof present);
    for (round = 0; round < 200; round++) {
        uint8_t keep[125];
        for (n = 0; n < 40; n++) list[n] = (int)(fixture_bits() % 125u); /* repetitions and present ones among them */
        n = (int)(fixture_bits() % 41u);
        for (i = 0; i < n; i++) present[list[i]] = 1;
        ASSERT_OK(springls__grid_add_bricks(ctx, list, n));
        for (i = 0; i < g->active_count; i++) {
            float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
            int brick = g->slot_brick[g->active[i]], v;
            if (phi[0] == 4.0f || phi[0] == -4.0f) /* new: mark it with its number, odd ones inside */
                for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) phi[v] = brick % 2 ? -(float)(brick + 10) : (float)(brick + 10);
        }
        for (n = 0, i = 0; i < 125; i++) {
            int slot = springls__slot_of_brick(g, i);
            ASSERT_EQ(present[i] != 0, slot >= SPRINGLS__FIRST_SLOT);
            if (!present[i]) continue;
            n++;
            ASSERT_EQ(i, g->slot_brick[slot]);
            ASSERT_EQ((float)(i % 2 ? -(i + 10) : i + 10), g->phi[(size_t)slot * SPRINGLS__BRICK_VOXELS + 99]);
        }
        ASSERT_EQ(n, g->active_count);
        for (i = 1; i < g->active_count; i++) ASSERT_LT(g->slot_brick[g->active[i - 1]], g->slot_brick[g->active[i]]);
        for (i = 0; i < g->active_count; i++) {
            keep[i] = fixture_bits() % 3u != 0;
            if (!keep[i]) present[g->slot_brick[g->active[i]]] = 0;
        }
        ASSERT_OK(springls__flags_begin(ctx, true));
        for (i = 0; i < g->active_count; i++)
            ctx->model.work.brick_flag[springls__entry_of_brick(g, g->slot_brick[g->active[i]])] = keep[i];
        ASSERT_OK(springls__change_bricks(ctx, springls__count_flags(ctx)));
        for (i = 0; i < 125; i++) /* what went is constant, on the side it was on */
            if (!present[i] && springls__slot_of_brick(g, i) != SPRINGLS__OUTSIDE)
                ASSERT(springls__slot_of_brick(g, i) == SPRINGLS__INSIDE && i % 2 == 1);
    }
    springls_destroy(ctx);
    PASS();
}

/* phi between voxels is trilinear across brick borders; beyond the domain it is the border voxel's distance, outside. */
TEST sampling_crosses_bricks(void)
{
    springls_context *ctx = fixture_context(20, NULL);
    springls__grid *g = &ctx->model.grid;
    int list[27], i, v;
    for (i = 0; i < 27; i++) list[i] = i;
    ASSERT_OK(springls__grid_add_bricks(ctx, list, 27));
    for (i = 0; i < g->active_count; i++) {
        int o[3];
        springls__slot_origin(g, g->active[i], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++)
            g->phi[g->active[i] * SPRINGLS__BRICK_VOXELS + v] =
                0.25f * (float)(o[0] + (v & 7)) - 0.5f * (float)(o[1] + (v >> 3 & 7)) + 0.125f * (float)(o[2] + (v >> 6)) + 0.3f;
    }
    fixture_seed(25);
    for (i = 0; i < 3000; i++) {
        springls__v3 x = fixture_point(0.0f, 19.0f), n;
        ASSERT_IN_RANGE(0.25 * (double)x.x - 0.5 * (double)x.y + 0.125 * (double)x.z + 0.3, springls__grid_sample(g, g->phi, x),
                        1e-5);
        x = fixture_point(0.5f, 18.5f);
        n = springls__grid_gradient(g, g->phi, x);
        ASSERT_LT(d3_distance(d3_make(0.25, -0.5, 0.125), d3_of(n)), 2e-5);
    }
    ASSERT_EQ(springls__fabs(springls__grid_voxel(g, g->phi, 0, 19, 7)),
              springls__grid_sample(g, g->phi, springls__v3_make(-1.0f, 20.0f, 7.0f)));
    ASSERT(springls__grid_sample(g, g->phi, springls__v3_make(-100.0f, 300.0f, 7.0f)) > 0.0f);
    springls_destroy(ctx);
    PASS();
}

/* Tiles hold a brick and the voxels around it, at the border by the border rule. */
TEST tiles_hold_the_margin(int size)
{
    springls_context *ctx = fixture_sphere(size, NULL, 6.0f, (float)size - 8.0f, 10.0f, 7.5f); /* reaches across two borders */
    springls__grid *g = &ctx->model.grid;
    enum { MARGIN = 3, WIDTH = 8 + 2 * MARGIN };
    float tile[SPRINGLS__TILE_VOXELS], wide[WIDTH * WIDTH * WIDTH];
    int i, x, y, z;
    ASSERT_GT(g->active_count, 4);
    for (i = 0; i < g->active_count; i++) {
        bool border = false;
        int o[3], axis;
        springls__slot_origin(g, g->active[i], o);
        for (axis = 0; axis < 3; axis++) border = border || o[axis] == 0 || o[axis] + 8 + MARGIN > size;
        springls__load_tile(g, g->phi, g->active[i], springls__alone(), tile);
        springls__load_rows(g, g->phi, o, border, MARGIN, springls__alone(), wide);
        for (z = -MARGIN; z < 8 + MARGIN; z++)
            for (y = -MARGIN; y < 8 + MARGIN; y++)
                for (x = -MARGIN; x < 8 + MARGIN; x++) {
                    const float phi = springls__grid_phi(g, g->phi, o[0] + x, o[1] + y, o[2] + z);
                    ASSERT_EQ(phi, wide[x + MARGIN + WIDTH * (y + MARGIN + WIDTH * (z + MARGIN))]);
                    if (x < -1 || y < -1 || z < -1 || x > 8 || y > 8 || z > 8) continue;
                    ASSERT_EQ(phi, tile[springls__tile_index(x, y, z)]);
                }
    }
    springls_destroy(ctx);
    PASS();
}

SUITE(cells)
{
    RUN_TESTp(walks_miss_nothing, 0, 0);
    RUN_TESTp(walks_miss_nothing, 0, 1);
    RUN_TESTp(walks_miss_nothing, 1, 0);
    RUN_TESTp(walks_miss_nothing, 1, 1);
    RUN_TESTp(near_walks_meet_what_is_near, 0);
    RUN_TESTp(near_walks_meet_what_is_near, 1);
    RUN_TESTp(changed_triangles_keep_the_list, 0);
    RUN_TESTp(changed_triangles_keep_the_list, 1);
    RUN_TESTp(neighbors_are_the_nearest, 0, 8, 0);
    RUN_TESTp(neighbors_are_the_nearest, 1, 8, 0);
    RUN_TESTp(neighbors_are_the_nearest, 1, 3, 1);
    RUN_TEST(ties_go_by_number);
    RUN_TEST(cells_are_ordered);
    RUN_TEST(bricks_come_and_go);
    RUN_TEST(sampling_crosses_bricks);
    RUN_TESTp(tiles_hold_the_margin, 16);
    RUN_TESTp(tiles_hold_the_margin, 17);
    RUN_TESTp(tiles_hold_the_margin, 20);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(cells);
    GREATEST_MAIN_END();
}
