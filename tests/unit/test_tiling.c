/* test_tiling.c - many bodies in one space: label maps and shapes as input, labels of places, the mesh of all walls, and refusals. */
#include "fixtures.h"
#include "tilings.h"

/* ---- what is set ---- */

/* Every voxel keeps its label, smooth or not, wherever it is asked for. */
TEST voxels_keep_their_labels(int smooth)
{
    static int32_t labels[VOXELS], found[VOXELS], sampled[VOXELS];
    static float points[3 * VOXELS];
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_measures measures[3];
    int i, lost = 0, other = 0, voxels = 0;
    three_labels(labels, SIZE, 9.3f);
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, smooth));
    ASSERT_EQ(3, springls_tiling_count(tiling));
    ASSERT_EQ(3, springls_tiling_label(tiling, 0));
    ASSERT_EQ(65535, springls_tiling_label(tiling, 2));
    ASSERT_EQ(-1, springls_tiling_label(tiling, 3));
    ASSERT(springls_tiling_body(tiling, 70) && springls_tiling_body(tiling, 0) && !springls_tiling_body(tiling, 4));
    ASSERT_OK(springls_tiling_copy_labels(tiling, found));
    for (i = 0; i < VOXELS; i++) {
        points[3 * i] = (float)(i % SIZE);
        points[3 * i + 1] = (float)(i / SIZE % SIZE);
        points[3 * i + 2] = (float)(i / (SIZE * SIZE));
    }
    ASSERT_OK(springls_tiling_sample_labels(tiling, points, VOXELS, sampled));
    for (i = 0; i < VOXELS; i++) {
        lost += found[i] != labels[i];
        other += found[i] != sampled[i];
        voxels += labels[i] == 70;
    }
    ASSERT_EQ(0, lost);
    ASSERT_EQ(0, other);
    ASSERT_OK(springls_tiling_measure(tiling, measures));
    ASSERT_EQ(70, measures[1].label);
    ASSERT_EQ(voxels, (int)measures[1].voxels);
    ASSERT_EQ(springls_count(springls_tiling_body(tiling, 70)), measures[1].springls);
    ASSERT_IN_RANGE((double)voxels, measures[1].volume, (smooth ? 0.1 : 0.03) * (double)voxels);
    springls_tiling_destroy(tiling);
    PASS();
}

/* Labels of one voxel, alone and in another body, are bodies too, and voxels of random labels keep them. */
TEST little_labels_are_kept(int smooth)
{
    static int32_t labels[VOXELS], found[VOXELS];
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    int i, lost = 0;
    three_labels(labels, SIZE, 6.0f);
    labels[14 + SIZE * (14 + SIZE * 10)] = 77;
    labels[4 + SIZE * (4 + SIZE * 4)] = 78;
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, smooth));
    ASSERT_EQ(5, springls_tiling_count(tiling));
    ASSERT_OK(springls_tiling_copy_labels(tiling, found));
    ASSERT_MEM_EQ(labels, found, sizeof labels);
    fixture_seed(5u);
    for (i = 0; i < VOXELS; i++) {
        const int x = i % SIZE, y = i / SIZE % SIZE, z = i / (SIZE * SIZE);
        const bool inner = x > 8 && x < 18 && y > 8 && y < 18 && z > 8 && z < 18;
        labels[i] = inner ? (int32_t)(fixture_bits() % 4u) : 0;
    }
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, smooth));
    ASSERT_OK(springls_tiling_copy_labels(tiling, found));
    for (i = 0; i < VOXELS; i++) lost += labels[i] != found[i];
    if (GREATEST_IS_VERBOSE()) printf("  lost %d\n", lost);
    ASSERT_EQ(0, lost);
    springls_tiling_destroy(tiling);
    PASS();
}

/* ---- walls ---- */

typedef struct side { int a, b, triangles; } side; /* of triangles, a < b */

static int compare_sides(const void *x, const void *y)
{
    const side *p = (const side *)x, *q = (const side *)y;
    return p->a != q->a ? (p->a > q->a) - (p->a < q->a) : (p->b > q->b) - (p->b < q->b);
}

/* Lists the sides of all triangles, each once; returns how many there are. */
static int sides_of(const springls_walls *walls, side *sides)
{
    int i, k, n = 0, count = 0;
    for (i = 0; i < walls->triangle_count; i++)
        for (k = 0; k < 3; k++, n++) {
            const int a = walls->triangles[3 * i + k], b = walls->triangles[3 * i + (k + 1) % 3];
            sides[n].a = a < b ? a : b;
            sides[n].b = a < b ? b : a;
            sides[n].triangles = 1;
        }
    qsort(sides, (size_t)n, sizeof *sides, compare_sides);
    for (i = 0; i < n; i++) {
        if (count && compare_sides(&sides[count - 1], &sides[i]) == 0) sides[count - 1].triangles++;
        else sides[count++] = sides[i];
    }
    return count;
}

/* The volume that a label has by the walls: each is its boundary on one side. */
static double volume_by_walls(const springls_walls *walls, int32_t label)
{
    double volume = 0.0;
    int i, k;
    for (i = 0; i < walls->triangle_count; i++) {
        const double sign = (double)(walls->labels[2 * i] == label) - (double)(walls->labels[2 * i + 1] == label);
        d3 p[3];
        for (k = 0; k < 3; k++) {
            const float *x = walls->positions + 3 * walls->triangles[3 * i + k];
            p[k] = d3_make((double)x[0], (double)x[1], (double)x[2]);
        }
        volume += sign * d3_dot(p[0], d3_cross(p[1], p[2])) / 6.0;
    }
    return volume;
}

/* Walls of three bodies in a ball: two triangles at each side but for edges, which have three or more, in one line that forks at two
   corners or more; volumes are those of the voxels, and every triangle separates the labels on its two sides. */
TEST walls_meet_in_edges(int smooth)
{
    static int32_t labels[VOXELS];
    static const int32_t name[3] = { 3, 70, 65535 };
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_measures measures[3];
    springls_walls walls, none;
    side *sides;
    int i, k, count, many = 0, open = 0;
    three_labels(labels, SIZE, 9.3f);
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_extract(tiling, &walls));
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, smooth));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_extract(tiling, NULL));
    ASSERT_OK(springls_tiling_extract(tiling, &walls));
    ASSERT_OK(springls_tiling_measure(tiling, measures));
    sides = (side *)malloc(3 * (size_t)walls.triangle_count * sizeof *sides);
    count = sides_of(&walls, sides);
    for (i = 0; i < count; i++) {
        many += sides[i].triangles > 2;
        open += sides[i].triangles < 2;
    }
    if (GREATEST_IS_VERBOSE()) printf("  %d triangles, %d edges, %d corners\n", walls.triangle_count, walls.edge_count, walls.corner_count);
    ASSERT_EQ(0, open);
    ASSERT_EQ(walls.edge_count, many);
    ASSERT_GT(walls.edge_count, 40);
    ASSERT_GT(walls.corner_count, 1);
    for (i = 0; i < walls.edge_count; i++) {
        side edge;
        const side *found;
        edge.a = walls.edges[2 * i] < walls.edges[2 * i + 1] ? walls.edges[2 * i] : walls.edges[2 * i + 1];
        edge.b = walls.edges[2 * i] + walls.edges[2 * i + 1] - edge.a;
        found = (const side *)bsearch(&edge, sides, (size_t)count, sizeof *sides, compare_sides);
        ASSERT(found && found->triangles > 2);
    }
    for (i = 0; i < walls.triangle_count; i++) ASSERT(walls.labels[2 * i] != walls.labels[2 * i + 1]);
    for (k = 0; k < 3; k++)
        ASSERT_IN_RANGE((double)measures[k].voxels, volume_by_walls(&walls, name[k]), (smooth ? 0.06 : 0.03) * (double)measures[k].voxels);
    free(sides);
    springls_walls_free(tiling, &walls);
    memset(&none, 0, sizeof none);
    ASSERT_MEM_EQ(&none, &walls, sizeof none);
    springls_walls_free(tiling, NULL);
    springls_walls_free(NULL, &walls);
    springls_tiling_destroy(tiling);
    PASS();
}

static d3 corner_of(const springls_walls *walls, int triangle, int k)
{
    const float *x = walls->positions + 3 * walls->triangles[3 * triangle + k];
    return d3_make((double)x[0], (double)x[1], (double)x[2]);
}

static double sixfold_volume(d3 a, d3 b, d3 c, d3 d) { return d3_dot(d3_sub(b, a), d3_cross(d3_sub(c, a), d3_sub(d, a))); }

/* Whether a side of triangle t that shares no vertex with triangle u passes through its inside. */
static bool passes_through(const springls_walls *walls, int t, int u)
{
    const d3 a = corner_of(walls, u, 0), b = corner_of(walls, u, 1), c = corner_of(walls, u, 2);
    int k, i;
    for (k = 0; k < 3; k++) {
        const int v[2] = { walls->triangles[3 * t + k], walls->triangles[3 * t + (k + 1) % 3] };
        const d3 p = corner_of(walls, t, k), q = corner_of(walls, t, (k + 1) % 3);
        bool shared = false;
        double x, y, z;
        for (i = 0; i < 3; i++) shared = shared || walls->triangles[3 * u + i] == v[0] || walls->triangles[3 * u + i] == v[1];
        if (shared || sixfold_volume(p, a, b, c) * sixfold_volume(q, a, b, c) >= 0.0) continue;
        x = sixfold_volume(p, q, a, b), y = sixfold_volume(p, q, b, c), z = sixfold_volume(p, q, c, a);
        if ((x > 0.0 && y > 0.0 && z > 0.0) || (x < 0.0 && y < 0.0 && z < 0.0)) return true;
    }
    return false;
}

static bool boxes_touch(const springls_walls *walls, int t, int u)
{
    int i, k;
    for (i = 0; i < 3; i++) {
        float low[2] = { 1e9f, 1e9f }, high[2] = { -1e9f, -1e9f };
        for (k = 0; k < 3; k++) {
            const float x = walls->positions[3 * walls->triangles[3 * t + k] + i],
                        y = walls->positions[3 * walls->triangles[3 * u + k] + i];
            if (x < low[0]) low[0] = x;
            if (x > high[0]) high[0] = x;
            if (y < low[1]) low[1] = y;
            if (y > high[1]) high[1] = y;
        }
        if (low[0] > high[1] || low[1] > high[0]) return false;
    }
    return true;
}

/* No triangle crosses another, of walls that are smooth and of those between voxels of random labels; some need four a pair of voxels. */
TEST walls_do_not_cross(int noise, int smooth)
{
    static int32_t labels[BALL_VOXELS];
    springls_tiling *tiling = tiling_of_size(BALL, NULL);
    springls_walls walls;
    int i, t, u, crossing = 0;
    three_labels(labels, BALL, 5.0f);
    fixture_seed(9u);
    for (i = 0; i < BALL_VOXELS && noise; i++) {
        const int x = i % BALL, y = i / BALL % BALL, z = i / (BALL * BALL);
        labels[i] = x > 8 && x < 16 && y > 8 && y < 16 && z > 8 && z < 16 ? (int32_t)(fixture_bits() % 4u) : 0;
    }
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, smooth));
    ASSERT_OK(springls_tiling_extract(tiling, &walls));
    for (t = 0; t < walls.triangle_count; t++)
        for (u = 0; u < t; u++)
            crossing += boxes_touch(&walls, t, u) && (passes_through(&walls, t, u) || passes_through(&walls, u, t));
    if (GREATEST_IS_VERBOSE()) printf("  %d triangles, %d vertices, %d cross\n", walls.triangle_count, walls.vertex_count, crossing);
    ASSERT_EQ(0, crossing);
    springls_walls_free(tiling, &walls);
    springls_tiling_destroy(tiling);
    PASS();
}

/* A body that fills all but the outermost voxels is enclosed on all sides: the areas of its walls add up to nothing. */
TEST walls_close_beside_the_border(void)
{
    static int32_t labels[VOXELS];
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_walls walls;
    d3 sum = d3_make(0.0, 0.0, 0.0);
    double volume = 0.0;
    int i, k;
    for (i = 0; i < VOXELS; i++) {
        const int at[3] = { i % SIZE, i / SIZE % SIZE, i / (SIZE * SIZE) };
        labels[i] = 7;
        for (k = 0; k < 3; k++) if (at[k] == 0 || at[k] == SIZE - 1) labels[i] = 0;
    }
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 0));
    ASSERT_OK(springls_tiling_extract(tiling, &walls));
    for (i = 0; i < walls.triangle_count; i++) {
        d3 p[3], area;
        for (k = 0; k < 3; k++) {
            const float *x = walls.positions + 3 * walls.triangles[3 * i + k];
            p[k] = d3_make((double)x[0], (double)x[1], (double)x[2]);
        }
        area = d3_scale(d3_cross(d3_sub(p[1], p[0]), d3_sub(p[2], p[0])), walls.labels[2 * i] == 7 ? 0.5 : -0.5);
        sum = d3_add(sum, area);
        volume += d3_dot(area, p[0]) / 3.0;
    }
    ASSERT_LT(d3_length(sum), 1e-3);
    ASSERT_IN_RANGE((SIZE - 2.0) * (SIZE - 2.0) * (SIZE - 2.0), volume, 0.02 * VOXELS);
    springls_walls_free(tiling, &walls);
    springls_tiling_destroy(tiling);
    PASS();
}

/* ---- meshes, and the closest wall ---- */

/* The corners of a box, and its triangles. */
static springls_status add_box(springls_tiling *tiling, int32_t label, float lower, float upper, springls_mesh_report *report)
{
    static const int triangles[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                      2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    float corner[24];
    int i;
    for (i = 0; i < 8; i++) {
        corner[3 * i] = i & 1 ? upper : lower;
        corner[3 * i + 1] = i & 2 ? 20.3f : 6.7f;
        corner[3 * i + 2] = i & 4 ? 19.6f : 7.2f;
    }
    return springls_tiling_add_mesh(tiling, label, corner, 8, 0, triangles, 12, report);
}

/* Boxes that are meshes share a wall; the closest wall to a point, its labels and distance are those of the boxes. */
TEST walls_are_found(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_mesh_report report;
    springls_wall_hit hit[4];
    const float points[12] = { 13.9f, 13.0f, 13.0f, 8.0f, 12.0f, 14.0f, 24.0f, 12.5f, 13.0f, 17.0f, 12.0f, 1.0f };
    const float distance[4] = { 0.6f, 1.5f, 2.2f, 6.2f }, at[4] = { 13.3f, 6.5f, 21.8f, 7.2f };
    const float far_away[3] = { -1e25f, 12.0f, 12.0f };
    static const int axis[4] = { 0, 0, 0, 2 };
    static const int32_t low[4] = { 5, 0, 0, 0 }, high[4] = { 8, 5, 8, 8 };
    uint64_t before;
    int i, bad[3] = { 0, 1, 9 };
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_add_mesh(NULL, 5, points, 4, 0, bad, 1, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_add_mesh(tiling, 5, NULL, 4, 0, bad, 1, NULL));
    ASSERT_STATUS(SPRINGLS_BAD_MESH, springls_tiling_add_mesh(tiling, 5, points, 4, 0, bad, 1, NULL));
    ASSERT(error_has(tiling, "tiling_add_mesh: label 5"));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_closest_wall(tiling, points, 4, hit));
    ASSERT(error_has(tiling, "tiling_closest_wall: the tiling has no bodies"));
    ASSERT_OK(add_box(tiling, 5, 6.5f, 13.3f, &report));
    ASSERT(report.closed && report.springls > 100);
    ASSERT_OK(add_box(tiling, 8, 13.3f, 21.8f, NULL));
    before = springls_tiling_state_hash(tiling);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, add_box(tiling, 8, 13.3f, 21.8f, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, add_box(tiling, 9, 15.3f, 18.8f, NULL));
    ASSERT(error_has(tiling, "label 9 would be where label 8 is"));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_closest_wall(NULL, points, 4, hit));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_closest_wall(tiling, points, 4, NULL));
    ASSERT_OK(springls_tiling_closest_wall(tiling, points, 4, hit));
    for (i = 0; i < 4; i++) {
        if (GREATEST_IS_VERBOSE())
            printf("  %.3f at %.3f, labels %d %d\n", hit[i].distance, hit[i].point[axis[i]], hit[i].labels[0], hit[i].labels[1]);
        ASSERT_EQ(low[i], hit[i].labels[0]);
        ASSERT_EQ(high[i], hit[i].labels[1]);
        ASSERT_IN_RANGE(distance[i], hit[i].distance, 0.05f);
        ASSERT_IN_RANGE(at[i], hit[i].point[axis[i]], 0.05f);
    }
    ASSERT_OK(springls_tiling_closest_wall(tiling, far_away, 1, hit));
    ASSERT_EQ(0, hit[0].labels[0]);
    ASSERT_EQ(5, hit[0].labels[1]);
    ASSERT_IN_RANGE(1.0f, hit[0].distance / 1e25f, 1e-6f);
    ASSERT(before == springls_tiling_state_hash(tiling));
    springls_tiling_destroy(tiling);
    PASS();
}

/* ---- refusals ---- */

TEST wrong_inputs_are_refused(void)
{
    static int32_t labels[VOXELS];
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part ball = part_at(13.0f, 13.0f, 13.0f, 5.0f, 0), beside = part_at(19.0f, 13.0f, 13.0f, 3.0f, 0);
    uint64_t before;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_set_labels(NULL, labels, 0));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_set_labels(tiling, NULL, 0));
    three_labels(labels, SIZE, 6.0f);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_set_labels(tiling, labels, 33));
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 0));
    before = springls_tiling_state_hash(tiling);
    labels[5] = 2;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_set_labels(tiling, labels, 0));
    ASSERT(error_has(tiling, "label 2 touches the border"));
    labels[5] = 65536;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_set_labels(tiling, labels, 0));
    ASSERT(error_has(tiling, "(5, 0, 0) has label 65536"));
    labels[5] = -1;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_set_labels(tiling, labels, 0));
    memset(labels, 0, sizeof labels);
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_set_labels(tiling, labels, 0));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_add_implicit(tiling, 5, NULL, &ball));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_add_implicit(tiling, 0, part_of_ball, &ball));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_add_implicit(tiling, 65536, part_of_ball, &ball));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_add_implicit(tiling, 70, part_of_ball, &ball));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_add_implicit(tiling, 5, part_of_ball, &ball));
    ASSERT(error_has(tiling, "would be where label"));
    ball.center[0] = 1.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_add_implicit(tiling, 5, part_of_ball, &ball));
    ASSERT(error_has(tiling, "border"));
    ball.center[0] = 100.0f;
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_add_implicit(tiling, 5, part_of_ball, &ball));
    ASSERT(error_has(tiling, "label 5"));
    ASSERT(before == springls_tiling_state_hash(tiling));
    beside.center[0] = 23.4f;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 5, part_of_ball, &beside));
    ASSERT_EQ(4, springls_tiling_count(tiling));
    ASSERT_EQ(5, springls_tiling_label(tiling, 1));
    springls_tiling_destroy(tiling);
    PASS();
}

/* A grid has more voxels than int counts: refused before a label is read. */
TEST large_grids_are_refused(void)
{
    springls_tiling *tiling = tiling_of_size(1300, NULL);
    int32_t label = 0;
    springls_walls walls;
    ASSERT(tiling);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_set_labels(tiling, &label, 0));
    ASSERT(error_has(tiling, "1300 x 1300 x 1300 voxels"));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_extract(tiling, &walls));
    springls_tiling_destroy(tiling);
    PASS();
}

static void not_a_number(void *user, const springls_tiling_batch *batch, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < 3 * batch->batch.count; i++) out[i] = batch->label == 70 ? NAN : 0.3f;
}

TEST wrong_calls_are_refused(void)
{
    static int32_t labels[VOXELS];
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_tiling *tiling;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_measures measures[3];
    springls_tiling_hold hold;
    float point[3] = { 3.0f, 3.0f, 3.0f };
    uint64_t before;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_create(NULL, &tiling));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_create(&desc, NULL));
    desc.window[1] = 8;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_create(&desc, &tiling));
    ASSERT(!tiling);
    springls_tiling_destroy(NULL);
    ASSERT_STR_EQ("no tiling", springls_tiling_last_error(NULL));
    ASSERT_EQ(0, springls_tiling_count(NULL));
    ASSERT_EQ(-1, springls_tiling_label(NULL, 0));
    ASSERT(!springls_tiling_body(NULL, 0) && !springls_tiling_memory_used(NULL) && !springls_tiling_state_hash(NULL));
    tiling = tiling_of_size(SIZE, NULL);
    ASSERT(!springls_tiling_body(tiling, 0));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_step(tiling, &step, NULL));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_copy_labels(tiling, labels));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_sample_labels(tiling, point, 1, labels));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_measure(tiling, measures));
    three_labels(labels, SIZE, 6.0f);
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 1));
    before = springls_tiling_state_hash(tiling);
    step.velocity = not_a_number;
    step.dt = 1.0f;
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_tiling_step(tiling, &step, NULL)); /* the first step */
    ASSERT(before == springls_tiling_state_hash(tiling));
    step = springls_default_tiling_step_desc();
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_facing(tiling, 8, labels));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_facing(tiling, 3, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_measure(tiling, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_copy_labels(tiling, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_sample_labels(tiling, point, -1, labels));
    point[1] = NAN;
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_tiling_sample_labels(tiling, point, 1, labels));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(NULL, &step, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, NULL, NULL));
    step.dt = -1.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    step.dt = 1.0f;
    step.wall_period = -1;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    step.wall_period = 1;
    step.tension = -1.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    step.tension = 0.0f;
    step.held_count = 1;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    memset(&hold, 0, sizeof hold);
    step.held = &hold;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    ASSERT(error_has(tiling, "label 0"));
    hold.label = 70;
    hold.target = -1.0;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    ASSERT(error_has(tiling, "label 70"));
    step.held_count = 0;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    before = springls_tiling_state_hash(tiling);
    step.velocity = not_a_number;
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_tiling_step(tiling, &step, NULL));
    ASSERT(error_has(tiling, "label 70"));
    ASSERT(before == springls_tiling_state_hash(tiling));
    springls_tiling_destroy(tiling);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TESTp(voxels_keep_their_labels, 0);
    RUN_TESTp(voxels_keep_their_labels, 3);
    RUN_TESTp(little_labels_are_kept, 0);
    RUN_TESTp(little_labels_are_kept, 4);
    RUN_TESTp(walls_meet_in_edges, 0);
    RUN_TESTp(walls_meet_in_edges, 2);
    RUN_TESTp(walls_do_not_cross, 0, 3);
    RUN_TESTp(walls_do_not_cross, 1, 3);
    RUN_TEST(walls_close_beside_the_border);
    RUN_TEST(walls_are_found);
    RUN_TEST(wrong_inputs_are_refused);
    RUN_TEST(large_grids_are_refused);
    RUN_TEST(wrong_calls_are_refused);
    GREATEST_MAIN_END();
}
