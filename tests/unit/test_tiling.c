/* test_tiling.c - many bodies in one space: label maps and shapes as input, labels of places, walls that stay closed in a flow, bodies that
   meet and vanish, the same bits for any threads, refusals, and memory that runs out. */
#include "fixtures.h"

#include <time.h>

enum { SIZE = 28, VOXELS = SIZE * SIZE * SIZE, BALL = 24, BALL_VOXELS = BALL * BALL * BALL };

/* ---- what is set ---- */

static bool error_has(const springls_tiling *tiling, const char *text) { return strstr(springls_tiling_last_error(tiling), text) != NULL; }

/* Part of a ball on one side of a plane through its center; side 0: all of it. */
typedef struct part { float center[3], radius, normal[3]; int side; } part;

static void part_of_ball(void *user, const float *points, int count, float *out)
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

static part part_at(float x, float y, float z, float radius, int side)
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

static springls_tiling *tiling_of_size(int size, fixture_heap *heap)
{
    springls_desc desc = fixture_desc(size, NULL);
    springls_tiling *tiling = NULL;
    desc.backend = NULL;
    if (heap) desc.allocator = fixture_allocator(heap);
    return springls_tiling_create(&desc, &tiling) == SPRINGLS_OK ? tiling : NULL;
}

/* Three bodies that touch, of labels 3, 70 and 65535, in a ball. */
static void three_labels(int32_t *labels, int size, float radius)
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
            const float x = walls->positions[3 * walls->triangles[3 * t + k] + i], y = walls->positions[3 * walls->triangles[3 * u + k] + i];
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

/* ---- motion ---- */

/* A swirl about the grid's middle that is faster inside, back and forth: all labels share it. */
static void swirl(void *user, const springls_tiling_batch *batch, float *out)
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

static springls_status set_two_halves(springls_tiling *tiling, float radius)
{
    part first = part_at(12.4f, 13.7f, 13.1f, radius, 1), second = part_at(12.4f, 13.7f, 13.1f, radius, -1);
    springls_status status = springls_tiling_add_implicit(tiling, 9, part_of_ball, &second);
    return status == SPRINGLS_OK ? springls_tiling_add_implicit(tiling, 4, part_of_ball, &first) : status;
}

/* How far the wall is from its plane: half the difference of the distances of both bodies, and their sum, the gap. */
static void wall_error(springls_tiling *tiling, float radius, double *error, double *gap)
{
    const part p = part_at(12.4f, 13.7f, 13.1f, radius, 0);
    const d3 n = d3_make((double)p.normal[0], (double)p.normal[1], (double)p.normal[2]), u = d3_make(-0.36, 0.8, 0.0);
    const d3 across = d3_scale(u, 1.0 / d3_length(u)), up = d3_cross(n, across);
    float point[3], a, b;
    int i, k, count = 0;
    *error = *gap = 0.0;
    for (i = -6; i <= 6; i++) {
        for (k = -6; k <= 6; k++) {
            d3 x = d3_make(12.4, 13.7, 13.1);
            if (i * i + k * k > 36) continue;
            x = d3_mad(d3_mad(x, across, (double)i * (double)radius / 7.0), up, (double)k * (double)radius / 7.0);
            point[0] = (float)x.x, point[1] = (float)x.y, point[2] = (float)x.z;
            springls_sample_distance(springls_tiling_body(tiling, 4), point, 1, &a);
            springls_sample_distance(springls_tiling_body(tiling, 9), point, 1, &b);
            *error += fabs((double)a - (double)b) / 2.0;
            *gap += fabs((double)a + (double)b);
            count++;
        }
    }
    *error /= count;
    *gap /= count;
}

/* Two halves of a ball in a flow that comes back: their wall comes back too, closed, and volumes stay. The bits are the same however
   the work is divided. */
TEST walls_stay_closed(void)
{
    uint64_t hash = 0;
    int run;
    for (run = 0; run < 3; run++) {
        fixture_workers workers;
        springls_threads *threads = run == 2 ? springls_threads_create(3) : NULL;
        springls_desc desc = fixture_desc(BALL + 4, NULL);
        springls_tiling *tiling;
        springls_tiling_step_desc step = springls_default_tiling_step_desc();
        springls_tiling_measures before[2], after[2];
        springls_tiling_report report;
        double error, gap;
        int i, faced = 0;
        desc.backend = NULL;
        if (run) desc.tasks = run == 1 ? fixture_tasks(&workers, 3, 0) : springls_threads_tasks(threads);
        ASSERT_OK(springls_tiling_create(&desc, &tiling));
        ASSERT_OK(set_two_halves(tiling, 7.0f));
        ASSERT_OK(springls_tiling_measure(tiling, before));
        step.velocity = swirl;
        step.dt = 0.0625f;
        for (i = 0; i < 32; i++) {
            ASSERT_OK(springls_tiling_step(tiling, &step, &report));
            ASSERT_EQ(0, report.vanished_count);
            faced += report.faced;
        }
        ASSERT_GT(faced, 1000);
        ASSERT_IN_RANGE(2.0, springls_time(springls_tiling_body(tiling, 4)), 1e-5);
        ASSERT_OK(springls_tiling_measure(tiling, after));
        for (i = 0; i < 2; i++) ASSERT_IN_RANGE(before[i].volume, after[i].volume, 0.005 * before[i].volume);
        wall_error(tiling, 7.0f, &error, &gap);
        if (GREATEST_IS_VERBOSE()) printf("  wall %.4f, gap %.4f\n", error, gap);
        ASSERT_LT(error, 0.02);
        ASSERT_LT(gap, 0.06);
        if (run) ASSERT(hash == springls_tiling_state_hash(tiling));
        hash = springls_tiling_state_hash(tiling);
        springls_tiling_destroy(tiling);
        springls_threads_destroy(threads);
    }
    PASS();
}

/* Pushes outwards what faces label 0. */
static void grow(void *user, const springls_tiling_batch *batch, float *out)
{
    const float *speed = (const float *)user;
    int i;
    for (i = 0; i < batch->batch.count; i++)
        out[i] = batch->label == 0 ? -speed[0] : batch->facing[i] == 0 ? speed[0] : 0.0f;
}

/* Two balls that grow meet in the middle and face each other there; no voxel is between them, and none is in both. */
TEST bodies_meet(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(8.2f, 13.6f, 13.3f, 3.5f, 0), second = part_at(18.9f, 13.6f, 13.3f, 3.5f, 0);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    static int32_t labels[VOXELS], facing[20000];
    float speed = 0.2f;
    int i, wrong = 0, met = 0;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, part_of_ball, &first));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &second));
    ASSERT_OK(springls_tiling_facing(tiling, 1, facing));
    for (i = 0; i < springls_count(springls_tiling_body(tiling, 1)); i++) ASSERT_EQ(0, facing[i]);
    step.pressure = grow;
    step.user = &speed;
    step.dt = 1.0f;
    for (i = 0; i < 15; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_OK(springls_tiling_copy_labels(tiling, labels));
    for (i = 0; i < VOXELS; i++) {
        const d3 x = d3_make(i % SIZE, i / SIZE % SIZE, i / (SIZE * SIZE));
        const double a = d3_distance(x, d3_make(8.2, 13.6, 13.3)) - 6.5, b = d3_distance(x, d3_make(18.9, 13.6, 13.3)) - 6.5;
        const double sure = 0.35;
        if (a < -sure && a < b - sure) wrong += labels[i] != 1;
        else if (b < -sure && b < a - sure) wrong += labels[i] != 2;
        else if (a > sure && b > sure) wrong += labels[i] != 0;
    }
    if (GREATEST_IS_VERBOSE()) printf("  wrong voxels %d\n", wrong);
    ASSERT_LT(wrong, 6);
    ASSERT_OK(springls_tiling_facing(tiling, 1, facing));
    for (i = 0; i < springls_count(springls_tiling_body(tiling, 1)); i++) met += facing[i] == 2;
    if (GREATEST_IS_VERBOSE()) printf("  met %d\n", met);
    ASSERT_GT(met, 30);
    springls_tiling_destroy(tiling);
    PASS();
}

/* ---- surface tension and volumes that are held ---- */

static float stronger_inside(void *user, int32_t low, int32_t high)
{
    const float *factor = (const float *)user;
    return low == 4 && high == 9 ? *factor : 1.0f;
}

static double area_of(const springls_tiling *tiling, bool inside)
{
    springls_walls walls;
    double area = 0.0;
    int i, k;
    if (springls_tiling_extract((springls_tiling *)(uintptr_t)tiling, &walls) != SPRINGLS_OK) return 0.0;
    for (i = 0; i < walls.triangle_count; i++) {
        d3 p[3];
        if (inside != (walls.labels[2 * i] != 0 && walls.labels[2 * i + 1] != 0)) continue;
        for (k = 0; k < 3; k++) {
            const float *x = walls.positions + 3 * walls.triangles[3 * i + k];
            p[k] = d3_make((double)x[0], (double)x[1], (double)x[2]);
        }
        area += 0.5 * d3_length(d3_cross(d3_sub(p[1], p[0]), d3_sub(p[2], p[0])));
    }
    springls_walls_free((springls_tiling *)(uintptr_t)tiling, &walls);
    return area;
}

/* Two halves of a ball become a double bubble: their volumes stay, areas fall, pressures are those of Laplace's law, 2 / R. A stronger
   tension of the wall between them makes it smaller. A third body that is held is not there. */
TEST bubbles_keep_their_volumes(float factor)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_hold held[3];
    double before, inside;
    int i;
    ASSERT_OK(set_two_halves(tiling, 7.0f));
    memset(held, 0, sizeof held);
    held[0].label = 9;
    held[1].label = 4;
    held[2].label = 5;
    inside = area_of(tiling, true);
    before = area_of(tiling, false) + (double)factor * inside;
    step.tension = 1.0f;
    step.tension_of = stronger_inside;
    step.user = &factor;
    step.held = held;
    step.held_count = 3;
    step.integrator = SPRINGLS_INTEGRATOR_EULER;
    step.dt = 0.5f;
    for (i = 0; i < 16; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    if (GREATEST_IS_VERBOSE())
        printf("  volumes %.2f %.2f of %.2f %.2f, pressures %.4f %.4f, areas %.1f (%.1f) of %.1f (%.1f)\n", held[0].volume, held[1].volume,
               held[0].target, held[1].target, held[0].pressure, held[1].pressure, area_of(tiling, false), area_of(tiling, true), before,
               inside);
    for (i = 0; i < 2; i++) {
        ASSERT_IN_RANGE(718.4, held[i].target, 3.0);
        ASSERT_IN_RANGE(held[i].target, held[i].volume, 0.0015 * held[i].target);
        ASSERT_IN_RANGE(factor > 1.0f ? 0.36 : 0.33, held[i].pressure, 0.03);
    }
    ASSERT(held[2].volume == 0.0 && held[2].pressure == 0.0 && held[2].target == 0.0);
    ASSERT_LT(area_of(tiling, false) + (double)factor * area_of(tiling, true), 0.985 * before);
    ASSERT_LT(area_of(tiling, true), (factor > 1.0f ? 0.84 : 0.89) * inside);
    springls_tiling_destroy(tiling);
    PASS();
}

/* A body grows to a target that the caller sets, and its neighbour makes room. */
TEST targets_are_reached(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_hold held[2];
    int i;
    ASSERT_OK(set_two_halves(tiling, 7.0f));
    memset(held, 0, sizeof held);
    held[0].label = 4;
    held[0].target = 760.0;
    held[1].label = 9;
    step.held = held;
    step.held_count = 2;
    step.dt = 0.5f;
    for (i = 0; i < 4; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    if (GREATEST_IS_VERBOSE()) printf("  %.2f %.2f\n", held[0].volume, held[1].volume);
    ASSERT_IN_RANGE(760.0, held[0].volume, 2.0);
    ASSERT_IN_RANGE(held[1].target, held[1].volume, 2.0);
    springls_tiling_destroy(tiling);
    PASS();
}

static float bad_factor(void *user, int32_t low, int32_t high)
{
    (void)low;
    (void)high;
    return *(const float *)user;
}

/* The pressure in a ball is twice the tension over the radius, in world units, whatever the spacing. */
TEST tension_is_in_world_units(double spacing)
{
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_tiling *tiling = NULL;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_hold held;
    const double radius = 8.0 * spacing;
    springls_sphere ball;
    int i;
    desc.backend = NULL;
    for (i = 0; i < 3; i++) {
        desc.grid.spacing[i] = spacing;
        ball.center[i] = (float)(desc.grid.origin[i] + spacing * 0.5 * (SIZE - 1));
    }
    ball.radius = (float)radius;
    ASSERT_OK(springls_tiling_create(&desc, &tiling));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, springls_implicit_sphere, &ball));
    memset(&held, 0, sizeof held);
    held.label = 1;
    step.tension = 1.0f;
    step.held = &held;
    step.held_count = 1;
    step.dt = (float)(0.5 * spacing * spacing);
    for (i = 0; i < 4; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_IN_RANGE(2.0 / radius, held.pressure, 0.1 / radius);
    ASSERT_IN_RANGE(4.18879 * radius * radius * radius, held.volume, 0.02 * 4.18879 * radius * radius * radius);
    springls_tiling_destroy(tiling);
    PASS();
}

static void to_the_border(void *user, const springls_tiling_batch *batch, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < 3 * batch->batch.count; i++) out[i] = i % 3 == 0 ? -1.0f : 0.0f;
}

/* What cannot be held, and factors that are none, are refused, and nothing moves. */
TEST what_cannot_be_held_is_refused(void)
{
    part ball = part_at(7.2f, 13.6f, 13.3f, 5.0f, 0);
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_hold held[2];
    float factor = -1.0f;
    uint64_t hash;
    int i;
    memset(held, 0, sizeof held);
    held[0].label = held[1].label = 5;
    step.tension = 1.0f;
    step.held = held;
    step.dt = 0.5f;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 5, part_of_ball, &ball));
    step.velocity = to_the_border;
    step.dt = 1.0f;
    step.tension = 0.0f;
    for (i = 0; i < 5; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    step.velocity = NULL;
    step.tension = 1.0f;
    hash = springls_tiling_state_hash(tiling);
    step.held_count = 1;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    ASSERT(strstr(springls_tiling_last_error(tiling), "border"));
    step.held_count = 2;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    ASSERT(strstr(springls_tiling_last_error(tiling), "twice"));
    step.held_count = 0;
    step.tension_of = bad_factor;
    step.user = &factor;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_step(tiling, &step, NULL));
    factor = NAN;
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_tiling_step(tiling, &step, NULL));
    ASSERT(strstr(springls_tiling_last_error(tiling), "tension_of"));
    ASSERT(hash == springls_tiling_state_hash(tiling) && held[0].target == 0.0);
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

/* Shrinks label 2, and lets label 1 be. */
static void shrink_second(void *user, const springls_tiling_batch *batch, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < batch->batch.count; i++)
        out[i] = batch->label == 2 ? -0.5f : batch->label == 0 && batch->facing[i] == 2 ? 0.5f : 0.0f;
}

/* A body that vanishes is reported once, and the other stays. */
TEST bodies_vanish(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(8.2f, 13.6f, 13.3f, 4.5f, 0), second = part_at(19.0f, 13.6f, 13.3f, 3.0f, 0);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    springls_tiling_measures measures[2];
    double before;
    int i, vanished = 0;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, part_of_ball, &first));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &second));
    ASSERT_OK(springls_tiling_measure(tiling, measures));
    before = measures[0].volume;
    step.pressure = shrink_second;
    step.dt = 1.0f;
    for (i = 0; i < 12; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        if (report.vanished_count) ASSERT_EQ(2, report.vanished[0]);
        vanished += report.vanished_count;
    }
    ASSERT_EQ(1, vanished);
    ASSERT_EQ(1, springls_tiling_count(tiling));
    ASSERT(!springls_tiling_body(tiling, 2));
    ASSERT_OK(springls_tiling_measure(tiling, measures));
    ASSERT_IN_RANGE(before, measures[0].volume, 0.01 * before);
    springls_tiling_destroy(tiling);
    PASS();
}

/* Presses label 2 together from all sides. */
static void press_second(void *user, const springls_tiling_batch *batch, float *out)
{
    const float *speed = (const float *)user;
    int i;
    for (i = 0; i < batch->batch.count; i++)
        out[i] = batch->label == 2 ? -*speed : batch->facing[i] == 2 ? *speed : 0.0f;
}

/* A body that shares a wall and is pressed to nothing vanishes when it has no voxel left. Nothing faces it from then on, and the other body
   stays as it is, without more springls than before. That sheets are not looked at in every step (period) makes no difference. */
TEST walls_vanish(int period)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(13.2f, 13.6f, 13.3f, 7.0f, 1), second = part_at(13.2f, 13.6f, 13.3f, 7.0f, -1);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    springls_tiling_measures now[2];
    static int32_t facing[20000];
    float speed = 0.4f;
    double volume = 0.0;
    int i, k, springls, after = 0, facing_it = 0;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, part_of_ball, &first));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &second));
    ASSERT_OK(springls_tiling_measure(tiling, now));
    springls = now[0].springls;
    step.pressure = press_second;
    step.user = &speed;
    step.dt = 1.0f;
    step.wall_period = period;
    for (i = 0; i < 30 && after < 17; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        ASSERT_OK(springls_tiling_measure(tiling, now));
        if (report.vanished_count) {
            ASSERT_EQ(2, report.vanished[0]);
            volume = now[0].volume;
        } else if (!after) {
            ASSERT(now[1].voxels > 0);
            continue;
        }
        after++;
        ASSERT_OK(springls_tiling_facing(tiling, 1, facing));
        for (k = 0; k < springls_count(springls_tiling_body(tiling, 1)); k++) facing_it += facing[k] == 2;
    }
    if (GREATEST_IS_VERBOSE()) printf("  %d steps, %d springls, volume %.1f\n", i, now[0].springls, now[0].volume);
    ASSERT_EQ(17, after);
    ASSERT_EQ(1, springls_tiling_count(tiling));
    ASSERT_EQ(0, facing_it);
    ASSERT_IN_RANGE(volume, now[0].volume, 0.05 * volume);
    ASSERT_LT(now[0].springls, springls);
    springls_tiling_destroy(tiling);
    PASS();
}

/* Where all bodies have vanished there are none: nothing has a label or a wall, until one is added. */
TEST all_vanish(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part ball = part_at(13.2f, 13.6f, 13.3f, 2.5f, 0);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_measures measures[1];
    springls_walls walls;
    static int32_t labels[VOXELS];
    float speed = 0.5f, point[3] = { 3.0f, 3.0f, 3.0f };
    int i;
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &ball));
    step.pressure = press_second;
    step.user = &speed;
    step.dt = 1.0f;
    for (i = 0; i < 12 && springls_tiling_count(tiling); i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_EQ(0, springls_tiling_count(tiling));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_step(tiling, &step, NULL));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_copy_labels(tiling, labels));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_sample_labels(tiling, point, 1, labels));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_measure(tiling, measures));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_extract(tiling, &walls));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 3, part_of_ball, &ball));
    ASSERT_IN_RANGE((double)i, springls_time(springls_tiling_body(tiling, 3)), 1e-4);
    ASSERT_IN_RANGE((double)i, springls_time(springls_tiling_body(tiling, 0)), 1e-4);
    ASSERT_EQ(springls_count(springls_tiling_body(tiling, 3)), springls_count(springls_tiling_body(tiling, 0)));
    ASSERT_OK(springls_tiling_copy_labels(tiling, labels));
    springls_tiling_destroy(tiling);
    PASS();
}

/* ---- what callers do meanwhile ---- */

/* A model that a caller has replaced has lost what its springls face: a step finds it again. Its original surface, and with it the wall,
   are where they were. */
TEST models_may_be_replaced(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(12.4f, 13.7f, 13.1f, 7.0f, 1);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_context *body;
    uint64_t before;
    static int32_t facing[20000];
    int i, k, faced = 0;
    ASSERT_OK(set_two_halves(tiling, 7.0f));
    body = springls_tiling_body(tiling, 4);
    step.velocity = swirl;
    step.dt = 0.0f;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    for (k = 0; k < 2; k++) {
        if (k == 0) ASSERT_OK(springls_set_implicit(body, part_of_ball, &first));
        else ASSERT_OK(springls_remove_attribute(body, springls_find_attribute(body, "tiling.facing")));
        before = springls_tiling_state_hash(tiling);
        ASSERT_OK(springls_tiling_facing(tiling, 4, facing));
        ASSERT(before == springls_tiling_state_hash(tiling));
        ASSERT_EQ(-1, springls_find_attribute(body, "tiling.facing"));
        step.dt = 0.0625f;
        for (i = 0; i < 9; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    }
    ASSERT_OK(springls_tiling_facing(tiling, 4, facing));
    for (i = 0; i < springls_count(body); i++) faced += facing[i] == 9;
    ASSERT_GT(faced, 60);
    ASSERT_OK(springls_reset(springls_tiling_body(tiling, 0)));
    first.center[0] = 24.0f;
    first.radius = 2.0f;
    first.side = 0;
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_tiling_add_implicit(tiling, 5, part_of_ball, &first));
    ASSERT(error_has(tiling, "label 0"));
    springls_tiling_destroy(tiling);
    PASS();
}

/* A body that comes later has the time of the others. */
TEST later_bodies_have_the_time(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    part first = part_at(8.2f, 13.6f, 13.3f, 4.5f, 0), second = part_at(19.0f, 13.6f, 13.3f, 3.0f, 0);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    ASSERT_OK(springls_tiling_add_implicit(tiling, 1, part_of_ball, &first));
    step.dt = 0.75f;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_OK(springls_tiling_add_implicit(tiling, 2, part_of_ball, &second));
    ASSERT_IN_RANGE(0.75, springls_time(springls_tiling_body(tiling, 0)), 1e-6);
    ASSERT_IN_RANGE(0.75, springls_time(springls_tiling_body(tiling, 2)), 1e-6);
    springls_tiling_destroy(tiling);
    PASS();
}

/* A map makes the same tiling wherever it is set, and reading leaves it so; before the first step too. */
TEST the_past_does_not_matter(void)
{
    static int32_t labels[BALL_VOXELS], facing[20000];
    springls_tiling *used = tiling_of_size(BALL, NULL), *fresh = tiling_of_size(BALL, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    int i;
    three_labels(labels, BALL, 7.0f);
    step.velocity = swirl;
    step.dt = 0.0625f;
    ASSERT_OK(springls_tiling_set_labels(used, labels, 1));
    for (i = 0; i < 3; i++) ASSERT_OK(springls_tiling_step(used, &step, NULL));
    ASSERT_OK(springls_tiling_set_labels(used, labels, 1));
    ASSERT_OK(springls_tiling_set_labels(fresh, labels, 1));
    ASSERT_OK(springls_tiling_facing(used, 70, facing));
    ASSERT_OK(springls_tiling_facing(used, 0, facing));
    ASSERT(springls_tiling_state_hash(used) == springls_tiling_state_hash(fresh));
    for (i = 0; i < 8; i++) {
        ASSERT_OK(springls_tiling_step(used, &step, NULL));
        ASSERT_OK(springls_tiling_step(fresh, &step, NULL));
        ASSERT(springls_tiling_state_hash(used) == springls_tiling_state_hash(fresh));
    }
    springls_tiling_destroy(used);
    springls_tiling_destroy(fresh);
    PASS();
}

/* Springls that a wall gets from its other side inherit the attributes of the caller, who may have all but one. */
TEST mirrored_springls_inherit(void)
{
    springls_tiling *tiling = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    springls_attribute_desc attribute = { "A", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    static const int32_t label[3] = { 0, 4, 9 };
    static float ones[20000];
    char name[2] = "A";
    int i, k, mirrored = 0;
    for (i = 0; i < 20000; i++) ones[i] = 1.0f;
    ASSERT_OK(set_two_halves(tiling, 7.0f));
    attribute.name = name;
    for (k = 0; k < 3; k++) {
        springls_context *body = springls_tiling_body(tiling, label[k]);
        for (name[0] = 'A'; springls_attribute_count(body) < SPRINGLS_MAX_ATTRIBUTES; name[0]++)
            ASSERT_OK(springls_add_attribute(body, &attribute, ones, NULL));
    }
    step.velocity = swirl;
    step.dt = 0.0625f;
    for (i = 0; i < 24; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, &report));
        mirrored += report.mirrored;
    }
    ASSERT_GT(mirrored, 0);
    for (k = 0; k < 3; k++) {
        springls_context *body = springls_tiling_body(tiling, label[k]);
        const float *values = springls_view_attribute(body, springls_find_attribute(body, "A")).data;
        for (i = 0; i < springls_count(body); i++) ASSERT_IN_RANGE(1.0, values[i], 1e-6);
    }
    springls_tiling_destroy(tiling);
    PASS();
}

/* Those for which max_springls has no room are refused, and not counted as mirrored. */
TEST mirrored_springls_are_counted(void)
{
    springls_desc desc = fixture_desc(BALL, NULL);
    springls_tiling *tiling;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report;
    static int32_t labels[BALL_VOXELS];
    static const int32_t label[4] = { 0, 3, 70, 65535 };
    int64_t refused = 0, added = 0;
    int i, k, run, largest = 0;
    three_labels(labels, BALL, 7.0f);
    desc.backend = NULL;
    for (run = 0; run < 2; run++) {
        if (run) desc.max_springls = largest;
        ASSERT_OK(springls_tiling_create(&desc, &tiling));
        ASSERT_OK(springls_tiling_set_labels(tiling, labels, 0));
        for (k = 0; k < 4; k++) {
            const int springls = springls_count(springls_tiling_body(tiling, label[k]));
            if (springls > largest) largest = springls;
        }
        step.velocity = swirl;
        step.dt = 0.0625f;
        for (i = 0; i < 8; i++) {
            added = 0;
            for (k = 0; k < 4; k++) added -= springls_get_stats(springls_tiling_body(tiling, label[k])).added;
            ASSERT_OK(springls_tiling_step(tiling, &step, &report));
            for (k = 0; k < 4; k++) added += springls_get_stats(springls_tiling_body(tiling, label[k])).added;
        }
        for (k = 0; k < 4; k++) refused += springls_get_stats(springls_tiling_body(tiling, label[k])).refused;
        ASSERT_GT(report.mirrored, 0);
        ASSERT(report.mirrored <= (int)added);
        springls_tiling_destroy(tiling);
    }
    ASSERT(refused > 0);
    PASS();
}

/* ---- snapshots ---- */

/* Writes a snapshot into a block that is as large as it is. */
static char *block_of(springls_tiling *tiling, springls_snapshot_kind kind, size_t *size)
{
    char *block = NULL;
    size_t written = 0;
    if (springls_tiling_snapshot(tiling, kind, NULL, 0, size) == SPRINGLS_OK) block = (char *)malloc(*size);
    if (!block || springls_tiling_snapshot(tiling, kind, block, *size, &written) != SPRINGLS_OK || written != *size) *size = 0;
    return block;
}

/* A tiling goes on from a snapshot with the same bits: another one with other bodies, and the same one after a body has vanished. What
   readers have asked before does not matter. */
TEST snapshots_go_on(void)
{
    static int32_t labels[BALL_VOXELS];
    springls_tiling *tiling = tiling_of_size(BALL, NULL), *other = tiling_of_size(BALL, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_context *kept;
    part ball = part_at(12.0f, 11.0f, 12.0f, 3.5f, 0);
    char *all, *frame, *again, *delta;
    size_t all_size, frame_size, size;
    uint64_t begun, end;
    int i;
    three_labels(labels, BALL, 6.0f);
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 1));
    ASSERT_OK(springls_tiling_add_implicit(other, 70, part_of_ball, &ball));
    step.velocity = swirl;
    step.dt = 0.125f;
    for (i = 0; i < 5; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    begun = springls_tiling_state_hash(tiling);
    ASSERT_OK(springls_tiling_copy_labels(tiling, labels));
    all = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &all_size);
    frame = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_FRAME, &frame_size);
    ASSERT(frame_size > 1000 && frame_size < all_size);
    kept = springls_tiling_body(other, 70);
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(other, frame, frame_size));
    ASSERT_EQ(1, springls_tiling_count(other));
    ASSERT_OK(springls_tiling_restore(other, all, all_size));
    ASSERT_EQ(3, springls_tiling_count(other));
    ASSERT(springls_tiling_body(other, 70) == kept);
    ASSERT(springls_tiling_state_hash(other) == begun);
    again = block_of(other, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    ASSERT_EQ(all_size, size);
    ASSERT_MEM_EQ(all, again, size);
    for (i = 0; i < 6; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
        ASSERT_OK(springls_tiling_step(other, &step, NULL));
    }
    end = springls_tiling_state_hash(tiling);
    ASSERT(end != begun && springls_tiling_state_hash(other) == end);
    ASSERT_OK(springls_tiling_restore(other, frame, frame_size));
    for (i = 0; i < 6; i++) ASSERT_OK(springls_tiling_step(other, &step, NULL));
    ASSERT(springls_tiling_state_hash(other) == end);
    free(again);
    again = block_of(other, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    delta = (char *)malloc(size + 64);
    ASSERT_OK(springls_snapshot_delta(kept, again, size, all, all_size, delta, size + 64, &frame_size));
    ASSERT_LT(frame_size, all_size);
    free(again);
    free(delta);
    free(all);
    free(frame);
    springls_tiling_destroy(tiling);
    springls_tiling_destroy(other);
    PASS();
}

/* Gives a block the checksum of what it has. */
static void seal(char *block, size_t size)
{
    uint64_t word, chain[4], i, k, count = (size - 32) / 8;
    for (k = 0; k < 4; k++) chain[k] = (uint64_t)size ^ (14695981039346656037u + k);
    for (i = 0; i < count; i++) {
        memcpy(&word, block + 32 + 8 * i, 8);
        chain[i % 4] = (chain[i % 4] ^ word) * 1099511628211u;
        if (i < count / 4 * 4) chain[i % 4] ^= chain[i % 4] >> 29;
    }
    for (k = 1; k < 4; k++) chain[0] = (chain[0] ^ chain[k]) * 1099511628211u + (uint64_t)(size - 32);
    memcpy(block + 24, chain, 8);
}

/* Blocks that are altered, or of something else, are refused, and leave the tiling as it is; those without bodies are good. */
TEST bad_snapshots_are_refused(void)
{
    springls_tiling *tiling = tiling_of_size(BALL, NULL), *larger = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    char *block, *bad, *none;
    size_t size, none_size, i, at, model;
    uint64_t bytes;
    uint64_t hash;
    int32_t number;
    float value = 1e30f;
    none = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &none_size);
    ASSERT_OK(set_two_halves(tiling, 4.0f));
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    hash = springls_tiling_state_hash(tiling);
    block = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    bad = (char *)malloc(size);
    memcpy(bad, block, size);
    seal(bad, size);
    ASSERT_MEM_EQ(block, bad, size);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_snapshot(NULL, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &at));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_snapshot(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_snapshot(tiling, (springls_snapshot_kind)2, NULL, 0, &at));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_snapshot(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, bad, size - 1, &at));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_restore(NULL, block, size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_restore(tiling, NULL, size));
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(larger, block, size));
    ASSERT(strstr(springls_tiling_last_error(larger), "another grid"));
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_restore(springls_tiling_body(tiling, 4), block, size));
    for (i = 0; i < 200; i++) { /* any byte, in places all over the block */
        at = i < 100 ? i : (size_t)(((uint64_t)size * (i - 100u)) / 100u);
        memcpy(bad, block, size);
        bad[at] = (char)(bad[at] ^ 4);
        ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, bad, size));
        if (at >= 32) seal(bad, size); /* what is made to deceive may be good, but has no effects that are not */
        if (at >= 32 && at < 100) springls_tiling_restore(tiling, bad, size);
        ASSERT_OK(springls_tiling_restore(tiling, block, size));
        ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, block, at));
    }
    for (at = 32; memcmp(block + at, "BODY", 4) != 0; at += 8) continue;
    memcpy(bad, block, size);
    number = 4;
    memcpy(bad + at + 16, &number, 4);
    seal(bad, size);
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, bad, size)); /* the first label is 0 */
    for (at = 32; memcmp(block + at, "tiling.facing", 13) != 0; at += 8) continue;
    memcpy(bad, block, size);
    memcpy(bad + at + 48, &value, 4);
    seal(bad, size);
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, bad, size)); /* the model's own checksum */
    for (model = at; memcmp(block + model, "BODY", 4) != 0; model -= 8) continue;
    memcpy(&bytes, block + model + 8, sizeof bytes);
    seal(bad + model + 24, (size_t)bytes - 8);
    seal(bad, size);
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, bad, size)); /* no label */
    memcpy(bad, block, size);
    memcpy(bad + 32, "NEWS", 4);
    seal(bad, size);
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, bad, size));
    ASSERT(hash == springls_tiling_state_hash(tiling));
    ASSERT_OK(springls_tiling_restore(tiling, none, none_size));
    ASSERT_EQ(0, springls_tiling_count(tiling));
    ASSERT(!springls_tiling_body(tiling, 0));
    ASSERT_OK(springls_tiling_restore(tiling, block, size));
    ASSERT(hash == springls_tiling_state_hash(tiling));
    free(block);
    free(bad);
    free(none);
    springls_tiling_destroy(tiling);
    springls_tiling_destroy(larger);
    PASS();
}

static int resting_bodies(const springls_tiling *tiling)
{
    int i, count = springls_at_rest(springls_tiling_body(tiling, 0));
    for (i = 0; i < springls_tiling_count(tiling); i++)
        count += springls_at_rest(springls_tiling_body(tiling, springls_tiling_label(tiling, i)));
    return count;
}

/* A tiling that comes to rest has the bits of one that is restored, which looks at everything again, and costs next to nothing; what
   is pushed moves. */
TEST bodies_rest(void)
{
    static int32_t labels[BALL_VOXELS];
    springls_tiling *tiling = tiling_of_size(BALL, NULL), *other = tiling_of_size(BALL, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report report, again;
    char *block;
    size_t size;
    clock_t begin;
    double moving, resting;
    int i, k;
    three_labels(labels, BALL, 6.0f);
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 2));
    step.dt = 0.125f;
    begin = clock();
    for (i = 0; i < 40; i++) ASSERT_OK(springls_tiling_step(tiling, &step, &report));
    moving = (double)(clock() - begin) / CLOCKS_PER_SEC;
    for (k = resting_bodies(tiling); k < 4 && i < 400; k = resting_bodies(tiling), i++) ASSERT_OK(springls_tiling_step(tiling, &step, &report));
    if (GREATEST_IS_VERBOSE()) printf("  at rest after %d steps\n", i);
    ASSERT_EQ(4, k);
    for (i = 0; i < 250; i++) ASSERT_OK(springls_tiling_step(tiling, &step, &report));
    block = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    ASSERT_OK(springls_tiling_restore(other, block, size));
    begin = clock();
    for (i = 0; i < 40; i++) ASSERT_OK(springls_tiling_step(tiling, &step, &report));
    resting = (double)(clock() - begin) / CLOCKS_PER_SEC;
    for (i = 0; i < 40; i++) ASSERT_OK(springls_tiling_step(other, &step, &again));
    if (GREATEST_IS_VERBOSE()) printf("  moving %.4f resting %.4f\n", moving, resting);
    ASSERT_LT(resting, 0.1 * moving);
    ASSERT_EQ(report.faced, again.faced);
    ASSERT(report.rms_gap == again.rms_gap);
    free(block);
    block = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    ASSERT(springls_tiling_state_hash(tiling) == springls_tiling_state_hash(other));
    step.velocity = swirl;
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT(springls_tiling_state_hash(tiling) != springls_tiling_state_hash(other));
    ASSERT_OK(springls_tiling_step(other, &step, NULL));
    ASSERT(springls_tiling_state_hash(tiling) == springls_tiling_state_hash(other));
    free(block);
    springls_tiling_destroy(tiling);
    springls_tiling_destroy(other);
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
    desc.backend = NULL;
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

/* ---- memory that runs out ---- */

enum { CALL_tiling_create, CALL_tiling_set_labels, CALL_tiling_add_implicit, CALL_tiling_facing, CALL_tiling_step,
       CALL_first_step, CALL_tiling_sample_labels, CALL_tiling_copy_labels, CALL_tiling_measure, CALL_tiling_extract,
       CALL_tiling_snapshot, CALL_tiling_restore, CALLS };

/* A block of bodies that tilings which are to be starved do not have, but for label 3. */
static char *restored;
static size_t restored_size;

static void make_restored(void)
{
    springls_tiling *tiling = tiling_of_size(BALL, NULL);
    part one = part_at(12.0f, 12.0f, 12.0f, 4.5f, 1), other = part_at(12.0f, 12.0f, 12.0f, 4.5f, -1);
    if (springls_tiling_add_implicit(tiling, 3, part_of_ball, &one) == SPRINGLS_OK
        && springls_tiling_add_implicit(tiling, 5, part_of_ball, &other) == SPRINGLS_OK)
        restored = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &restored_size);
    springls_tiling_destroy(tiling);
}

static springls_status call_of(springls_tiling *tiling, int call)
{
    static int32_t labels[BALL_VOXELS];
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_measures measures[8];
    springls_walls walls;
    springls_status status;
    float point[3] = { 12.0f, 12.0f, 12.0f };
    part ball = part_at(18.9f, 18.7f, 18.8f, 2.5f, 0);
    springls_tiling_hold hold;
    char *block;
    size_t size;
    memset(&hold, 0, sizeof hold);
    hold.label = 70;
    step.velocity = swirl;
    step.dt = 1.0f;
    step.wall_period = 1;
    step.tension = 0.1f;
    step.held = &hold;
    step.held_count = call == CALL_first_step;
    switch (call) {
    case CALL_tiling_set_labels: three_labels(labels, BALL, 3.6f); return springls_tiling_set_labels(tiling, labels, 1);
    case CALL_tiling_add_implicit: return springls_tiling_add_implicit(tiling, 12, part_of_ball, &ball);
    case CALL_tiling_facing: return springls_tiling_facing(tiling, 3, labels);
    case CALL_first_step:
    case CALL_tiling_step: return springls_tiling_step(tiling, &step, NULL);
    case CALL_tiling_sample_labels: return springls_tiling_sample_labels(tiling, point, 1, labels);
    case CALL_tiling_copy_labels: return springls_tiling_copy_labels(tiling, labels);
    case CALL_tiling_measure: return springls_tiling_measure(tiling, measures);
    case CALL_tiling_snapshot:
        status = springls_tiling_snapshot(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size);
        block = status == SPRINGLS_OK ? (char *)malloc(size) : NULL;
        if (block) status = springls_tiling_snapshot(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size);
        free(block);
        return status;
    case CALL_tiling_restore: return springls_tiling_restore(tiling, restored, restored_size);
    case CALL_tiling_extract:
        status = springls_tiling_extract(tiling, &walls);
        springls_walls_free(tiling, &walls);
        return status;
    default: return SPRINGLS_OK;
    }
}

/* Makes a tiling that has moved, and lets allocation number k of a call fail. *failed: it did. */
static greatest_test_res starve(int call, int k, bool *failed)
{
    fixture_heap heap;
    springls_desc desc = fixture_desc(BALL, NULL);
    springls_tiling *tiling = NULL;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_status status;
    uint64_t before;
    int i;
    desc.backend = NULL;
    desc.allocator = fixture_allocator(&heap);
    if (call == CALL_tiling_create) heap.fail_at = k;
    status = springls_tiling_create(&desc, &tiling);
    step.velocity = swirl;
    step.dt = 0.5f;
    if (call != CALL_tiling_create) {
        ASSERT_OK(call_of(tiling, CALL_tiling_set_labels));
        for (i = 0; i < 7 && call == CALL_tiling_step; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
        before = springls_tiling_state_hash(tiling);
        heap.fail_at = heap.calls + k;
        status = call_of(tiling, call);
        if (status != SPRINGLS_OK) {
            ASSERT_GT(strlen(springls_tiling_last_error(tiling)), 0u);
            ASSERT(before == springls_tiling_state_hash(tiling));
        }
    }
    *failed = heap.calls > heap.fail_at;
    ASSERT(status == SPRINGLS_OK || (*failed && status == SPRINGLS_OUT_OF_MEMORY));
    heap.fail_at = -1;
    if (tiling) ASSERT_EQ(heap.bytes, springls_tiling_memory_used(tiling));
    if (status != SPRINGLS_OK && tiling) ASSERT_OK(call_of(tiling, call));
    springls_tiling_destroy(tiling);
    ASSERT_EQ(0, heap.blocks);
    ASSERT_EQ(0, heap.wrong_sizes);
    PASS();
}

/* Each allocation of a step and of create fails, and of other calls the first ones and every 37th. */
TEST allocations_may_fail(int call)
{
    bool failed = true;
    int k, total = 0;
    for (k = 0; failed; k += k < 4 || call == CALL_tiling_step || call == CALL_tiling_create ? 1 : 37) {
        CHECK_CALL(starve(call, k, &failed));
        total += failed;
    }
    if (GREATEST_IS_VERBOSE()) printf("  %d\n", total);
    ASSERT(total > 0 || call == CALL_tiling_sample_labels || call == CALL_tiling_snapshot); /* these may need none */
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    int call;
    GREATEST_MAIN_BEGIN();
    RUN_TESTp(voxels_keep_their_labels, 0);
    RUN_TESTp(voxels_keep_their_labels, 3);
    RUN_TESTp(little_labels_are_kept, 0);
    RUN_TESTp(little_labels_are_kept, 4);
    RUN_TESTp(walls_meet_in_edges, 0);
    RUN_TESTp(walls_meet_in_edges, 2);
    RUN_TESTp(walls_do_not_cross, 0, 3);
    RUN_TESTp(walls_do_not_cross, 1, 3);
    RUN_TEST(walls_stay_closed);
    RUN_TEST(bodies_meet);
    RUN_TESTp(bubbles_keep_their_volumes, 1.0f);
    RUN_TESTp(bubbles_keep_their_volumes, 1.4f);
    RUN_TESTp(tension_is_in_world_units, 1.0);
    RUN_TESTp(tension_is_in_world_units, 0.5);
    RUN_TEST(what_cannot_be_held_is_refused);
    RUN_TEST(walls_close_beside_the_border);
    RUN_TEST(targets_are_reached);
    RUN_TEST(bodies_vanish);
    RUN_TESTp(walls_vanish, 1);
    RUN_TESTp(walls_vanish, 8);
    RUN_TEST(all_vanish);
    RUN_TEST(models_may_be_replaced);
    RUN_TEST(later_bodies_have_the_time);
    RUN_TEST(the_past_does_not_matter);
    RUN_TEST(mirrored_springls_inherit);
    RUN_TEST(mirrored_springls_are_counted);
    RUN_TEST(snapshots_go_on);
    RUN_TEST(bad_snapshots_are_refused);
    RUN_TEST(bodies_rest);
    RUN_TEST(wrong_inputs_are_refused);
    RUN_TEST(large_grids_are_refused);
    RUN_TEST(wrong_calls_are_refused);
    make_restored();
    for (call = 0; call < CALLS; call++) RUN_TESTp(allocations_may_fail, call);
    free(restored);
    GREATEST_MAIN_END();
}
