/* test_raycast.c - rays and closest points of the watertight surface, against all triangles of springls_extract_mesh. */
#include "fixtures.h"
#include "../../src/model/closest_point.h"
#include "../../src/model/ray.h"
#include "../../src/model/transform.h"

#define WATERTIGHT SPRINGLS_SURFACE_WATERTIGHT
#define SOUP SPRINGLS_SURFACE_SOUP

enum { SIZE = 32, RAYS = 20000 };
static const float middle[3] = { 15.7f, 16.2f, 15.9f };

/* ---- bodies ---- */

typedef enum body { BALL, TORUS, BOX, NOTCHED, AT_BORDER, SHEET, OBLIQUE, BODIES } body;

static springls_status set_body(springls_context *ctx, body which, const float center[3])
{
    springls_sphere ball = { { 0, 0, 0 }, 9.0f };
    springls_torus torus = { { 0, 0, 0 }, { 1.0f, 2.0f, 1.5f }, 8.0f, 3.0f };
    springls_box box = { { 0, 0, 0 }, { 8.0f, 6.5f, 5.0f } };
    springls_notched_sphere notched = { { 0, 0, 0 }, 9.0f, 4.0f, 10.0f };
    size_t bytes = 3 * sizeof(float);
    if (which == AT_BORDER) ball.center[1] = -11.0f; /* reaches beyond the grid */
    if (which == SHEET) box.half[1] = 0.8f;
    if (which == OBLIQUE) ball.radius = 4.5f;
    ball.center[0] += center[0];
    ball.center[1] += center[1];
    ball.center[2] += center[2];
    memcpy(torus.center, center, bytes);
    memcpy(box.center, center, bytes);
    memcpy(notched.center, center, bytes);
    if (which == TORUS) return springls_set_implicit(ctx, springls_implicit_torus, &torus);
    if (which == BOX || which == SHEET) return springls_set_implicit(ctx, springls_implicit_box, &box);
    if (which == NOTCHED) return springls_set_implicit(ctx, springls_implicit_notched_sphere, &notched);
    return springls_set_implicit(ctx, springls_implicit_sphere, &ball);
}

static struct exact_flow turning(void)
{
    struct exact_flow flow = EXACT_ROTATION(0, 0, 0, 1.0f, -2.0f, 3.0f, 0.06f);
    memcpy(flow.center, middle, sizeof middle);
    return flow;
}

static springls_status turn(springls_context *ctx, int steps)
{
    struct exact_flow flow = turning();
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    forces.voxel_units = true;
    return springls_run(ctx, &step, steps);
}

/* A body after some steps; OBLIQUE is in a grid that is neither even nor along the axes of the world. */
static springls_context *make_body(body which, const springls_tasks *tasks)
{
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_context *ctx = NULL;
    const double spacing[3] = { 0.45, 0.9, 0.6 }, direction[9] = { 0.8, -0.36, 0.48, 0.6, 0.48, -0.64, 0.0, 0.8, 0.6 };
    float center[3];
    int k;
    for (k = 0; k < 3 && which == OBLIQUE; k++) {
        desc.grid.spacing[k] = spacing[k];
        desc.grid.origin[k] = 100.0 * k - 70.0;
    }
    for (k = 0; k < 9 && which == OBLIQUE; k++) desc.grid.direction[k] = direction[k];
    if (tasks) desc.tasks = *tasks;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return NULL;
    springls_to_world(ctx, middle, 1, center);
    if (set_body(ctx, which, center) == SPRINGLS_OK && (which == AT_BORDER || turn(ctx, 6) == SPRINGLS_OK))
        return fixture_of_zero_level(ctx);
    springls_destroy(ctx);
    return NULL;
}

/* ---- the judge: a hierarchy over the triangles of the extracted mesh, which test_query.c holds against brute force ---- */

typedef struct judge {
    springls_context *ctx;
    springls_mesh mesh;
    springls__surface surface;
    float lower[3], upper[3];
} judge;

static springls_status judge_make(judge *j, springls_context *ctx)
{
    int i, k;
    memset(j, 0, sizeof *j);
    j->ctx = ctx;
    SPRINGLS__TRY(springls_extract_mesh(ctx, &j->mesh));
    SPRINGLS__TRY(springls__surface_reserve(ctx, &j->surface, j->mesh.triangle_count));
    for (i = 0; i < 3 * j->mesh.triangle_count; i++)
        j->surface.points[i] = springls__world_to_model(ctx, j->mesh.positions + 3 * j->mesh.triangles[i]);
    for (k = 0; k < 3; k++) {
        j->lower[k] = FLT_MAX;
        j->upper[k] = -FLT_MAX;
        for (i = 0; i < j->mesh.vertex_count; i++) {
            j->lower[k] = fminf(j->lower[k], j->mesh.positions[3 * i + k]);
            j->upper[k] = fmaxf(j->upper[k], j->mesh.positions[3 * i + k]);
        }
    }
    return springls__surface_finish(ctx, &j->surface, j->mesh.triangle_count);
}

static void judge_free(judge *j)
{
    springls__surface_free(j->ctx, &j->surface);
    springls_mesh_free(j->ctx, &j->mesh);
    springls_destroy(j->ctx);
}

static springls__surface_hit judge_ray(const judge *j, const float *origin, const float *direction)
{
    return springls__surface_ray(&j->surface, springls__world_to_model(j->ctx, origin),
                                 springls__normalize(springls__load3(direction)), 1e18f);
}

/* Whether a place is inside the mesh: its distance, with the side that the nearest triangle shows. Places near an edge or a
   corner of triangles are not judged. */
static bool judge_inside(const judge *j, const float *place)
{
    springls__v3 x = springls__world_to_model(j->ctx, place);
    springls__surface_hit h = springls__surface_closest(&j->surface, x, FLT_MAX);
    float side = springls__is_mirrored(j->ctx) ? -1.0f : 1.0f;
    if (fminf(fminf(h.hit.bary[0], h.hit.bary[1]), h.hit.bary[2]) < 1e-3f) return false;
    return springls__dot(springls__sub(x, h.hit.point), springls__tri_area2(springls__surface_triangle(&j->surface, h.triangle)))
           * side < 0.0f;
}

static void random_place(const judge *j, float out[3])
{
    int k;
    for (k = 0; k < 3; k++) out[k] = fixture_between(j->lower[k], j->upper[k]);
}

/* ---- rays ---- */

static float origins[3 * RAYS], directions[3 * RAYS], targets[3 * RAYS];
static springls_hit hits[RAYS];

/* Rays from a ball around the body to places in its box; some along an axis of the grid, some through voxel centers. */
static void aim(const judge *j)
{
    int i, k;
    float radius = 0.0f, center[3];
    for (k = 0; k < 3; k++) {
        radius += j->upper[k] - j->lower[k];
        center[k] = 0.5f * (j->lower[k] + j->upper[k]);
    }
    fixture_seed(3);
    for (i = 0; i < RAYS; i++) {
        springls__v3 away = fixture_direction();
        float *o = origins + 3 * i, *d = directions + 3 * i, *x = targets + 3 * i, voxel[3], along[3] = { 0.0f, 0.0f, 0.0f };
        random_place(j, x);
        springls_to_voxel(j->ctx, x, 1, voxel);
        for (k = 0; k < 3 && i % 4 == 1; k++) voxel[k] = floorf(voxel[k]); /* through the corner of eight cubes */
        for (k = 0; k < 3 && i % 8 == 2; k++) voxel[k] = floorf(2.0f * voxel[k]) / 2.0f;
        springls_to_world(j->ctx, voxel, 1, x);
        o[0] = center[0] + radius * away.x;
        o[1] = center[1] + radius * away.y;
        o[2] = center[2] + radius * away.z;
        if (i % 8 == 1 || i % 8 == 2) { /* along an axis, or a diagonal, of the grid */
            for (k = 0; k < 3; k++) along[k] = i % 8 == 1 ? (float)(k == i / 8 % 3) : (i >> (3 + k) & 1 ? 40.0f : -40.0f);
            for (k = 0; k < 3; k++) voxel[k] -= (i % 8 == 1 ? 64.0f : 1.0f) * along[k];
            springls_to_world(j->ctx, voxel, 1, o);
        }
        for (k = 0; k < 3; k++) d[k] = x[k] - o[k];
    }
}

/* A ray to a place inside of the mesh meets it, and every ray meets what it meets of the mesh, at the same depth. */
TEST rays_meet_the_mesh(int which)
{
    judge j;
    double sum = 0.0;
    int i, found = 0, inside = 0;
    ASSERT_OK(judge_make(&j, make_body((body)which, NULL)));
    aim(&j);
    ASSERT_OK(springls_raycast(j.ctx, WATERTIGHT, origins, directions, RAYS, 0.0f, hits));
    for (i = 0; i < RAYS; i++) {
        springls__surface_hit h = judge_ray(&j, origins + 3 * i, directions + 3 * i);
        double apart;
        if (judge_inside(&j, targets + 3 * i)) {
            inside++;
            ASSERT(hits[i].springl >= 0);
        }
        if (i % 4 == 1 || i % 8 == 2) continue; /* through edges of the mesh: rounding decides whether they meet its rim */
        ASSERT_EQ(h.triangle >= 0, hits[i].springl >= 0);
        if (h.triangle < 0) continue;
        apart = fabs((double)h.t - (double)(hits[i].distance / j.ctx->smallest_spacing));
        ASSERT_LT(apart, 0.02);
        sum += apart;
        found++;
    }
    ASSERT_GT(found, RAYS / 4);
    ASSERT_GT(inside, RAYS / 40);
    ASSERT_LT(sum / found, 1e-4);
    judge_free(&j);
    PASS();
}

/* Nor does a ray get out, wherever it begins and whichever way it goes. */
TEST rays_from_inside_meet_the_mesh(int which)
{
    judge j;
    int i, k, count = 0;
    ASSERT_OK(judge_make(&j, make_body((body)which, NULL)));
    fixture_seed(5);
    while (count < RAYS / 4) {
        float *o = origins + 3 * count, *d = directions + 3 * count, voxel[3];
        springls__v3 away = fixture_direction();
        random_place(&j, o);
        if (count % 2) {
            springls_to_voxel(j.ctx, o, 1, voxel);
            for (k = 0; k < 3; k++) voxel[k] = floorf(voxel[k]);
            springls_to_world(j.ctx, voxel, 1, o);
        }
        if (!judge_inside(&j, o)) continue;
        d[0] = away.x; d[1] = away.y; d[2] = away.z;
        for (k = 0; k < 3 && count % 4 == 1; k++) d[k] = k == count / 4 % 3 ? (count % 8 == 1 ? 1e-20f : -1e20f) : 0.0f;
        count++;
    }
    ASSERT_OK(springls_raycast(j.ctx, WATERTIGHT, origins, directions, count, 0.0f, hits));
    for (i = 0; i < count; i++) ASSERT(hits[i].springl >= 0);
    judge_free(&j);
    PASS();
}

/* The members of a hit agree with each other. */
TEST hits_are_whole(void)
{
    judge j;
    int i, k, m, found = 0;
    ASSERT_OK(judge_make(&j, make_body(OBLIQUE, NULL)));
    aim(&j);
    ASSERT_OK(springls_raycast(j.ctx, WATERTIGHT, origins, directions, RAYS, 0.0f, hits));
    for (i = 0; i < RAYS; i++) {
        const springls_hit *h = &hits[i];
        springls__v3 o = springls__load3(origins + 3 * i), d = springls__normalize(springls__load3(directions + 3 * i));
        springls__v3 x = springls__load3(h->point), on = springls__v3_make(0.0f, 0.0f, 0.0f);
        float world[3], corner[9], phi;
        if (h->springl < 0) {
            ASSERT_EQ(-1, h->material_triangle);
            continue;
        }
        found++;
        ASSERT_EQ(springls_ids(j.ctx)[h->springl], h->id);
        ASSERT_LT(springls__length(springls__sub(springls__mad(o, d, h->distance), x)), 1e-4f);
        ASSERT_IN_RANGE(1.0f, springls__length(springls__load3(h->normal)), 1e-4f);
        for (m = 0; m < 3; m++) {
            springls__v3 q = fixture_vertex(j.ctx, h->springl, m);
            springls_to_world(j.ctx, &q.x, 1, corner + 3 * m);
            on = springls__mad(on, springls__load3(corner + 3 * m), h->barycentric[m]);
        }
        ASSERT_LT(springls__length(springls__sub(on, x)), 0.9f); /* the longest step between voxels */
        ASSERT(h->material_triangle >= 0);
        if (i % 20) continue;
        for (k = 0; k < 3; k++) world[k] = h->point[k];
        ASSERT_OK(springls_sample_distance(j.ctx, world, 1, &phi));
        ASSERT_IN_RANGE(0.0f, phi, 0.05f);
        { /* max_distance is in world units */
            springls_hit again;
            ASSERT_OK(springls_raycast(j.ctx, WATERTIGHT, origins + 3 * i, directions + 3 * i, 1, h->distance * 0.999f, &again));
            ASSERT_EQ(-1, again.springl);
            ASSERT_OK(springls_raycast(j.ctx, WATERTIGHT, origins + 3 * i, directions + 3 * i, 1, h->distance * 1.001f, &again));
            ASSERT_MEM_EQ(h, &again, sizeof again);
        }
    }
    ASSERT_GT(found, RAYS / 4);
    judge_free(&j);
    PASS();
}

/* Material coordinates, turned by the exact flow, are at the hit but for the height of the mesh's chords; normals point away from
   the center. */
TEST material_is_where_it_was(void)
{
    const struct exact_flow flow = turning();
    const d3 center = d3_make((double)middle[0], (double)middle[1], (double)middle[2]);
    const d3 turned = d3_scale(d3_make(1.0, -2.0, 3.0), 6.0 * (double)flow.angular_velocity / sqrt(14.0));
    double worst = 0.0, sum = 0.0, highest = 0.0;
    judge j;
    int i, n = 0;
    ASSERT_OK(judge_make(&j, make_body(BALL, NULL)));
    aim(&j);
    ASSERT_OK(springls_raycast(j.ctx, WATERTIGHT, origins, directions, RAYS / 4, 0.0f, hits));
    for (i = 0; i < RAYS / 4; i++) {
        d3 x = d3_sub(d3_of(springls__load3(hits[i].point)), center), error, normal = d3_of(springls__load3(hits[i].normal));
        double along, height;
        if (hits[i].springl < 0) continue;
        error = d3_sub(d3_rotate(d3_sub(d3_of(springls__load3(hits[i].material)), center), turned), x);
        height = d3_dot(error, normal);
        along = d3_length(d3_mad(error, normal, -height));
        worst = fmax(worst, along);
        highest = fmax(highest, fabs(height));
        sum += along;
        n++;
        ASSERT_GT(d3_dot(x, normal), 0.998 * d3_length(x));
    }
    ASSERT_GT(n, RAYS / 16);
    ASSERT_LT(sum / n, 0.003);
    ASSERT_LT(worst, 0.03);
    ASSERT_LT(highest, 0.07);
    judge_free(&j);
    PASS();
}

/* ---- closest points ---- */

TEST closest_is_that_of_the_mesh(int which)
{
    enum { POINTS = 600 };
    springls_hit one;
    judge j;
    int i, k;
    ASSERT_OK(judge_make(&j, make_body((body)which, NULL)));
    fixture_seed(7);
    for (i = 0; i < POINTS; i++) {
        float stretch = i % 3 == 0 ? 1.0f : i % 3 == 1 ? 3.0f : 100.0f;
        for (k = 0; k < 3; k++) {
            float half = 0.5f * (j.upper[k] - j.lower[k]);
            origins[3 * i + k] = j.lower[k] + half + half * stretch * fixture_between(-1.0f, 1.0f);
        }
    }
    ASSERT_OK(springls_closest(j.ctx, WATERTIGHT, origins, POINTS, hits));
    for (i = 0; i < POINTS; i++) {
        springls__v3 x = springls__world_to_model(j.ctx, origins + 3 * i);
        springls__surface_hit h = springls__surface_closest(&j.surface, x, FLT_MAX);
        float best = springls__sqrt(h.hit.d2) * j.ctx->smallest_spacing;
        ASSERT(hits[i].springl >= 0);
        ASSERT_IN_RANGE(best, hits[i].distance, 1e-5f * (40.0f + best));
        ASSERT_IN_RANGE(hits[i].distance,
                        springls__length(springls__sub(springls__load3(hits[i].point), springls__load3(origins + 3 * i))),
                        1e-5f * (300.0f + best));
        ASSERT_OK(springls_closest(j.ctx, WATERTIGHT, origins + 3 * i, 1, &one)); /* whatever was looked for before */
        ASSERT_MEM_EQ(&hits[i], &one, sizeof one);
    }
    judge_free(&j);
    PASS();
}

/* ---- nothing is kept, nothing changes ---- */

/* After every step the answers are those of a context that has never been looked at. */
TEST answers_follow_the_steps(void)
{
    enum { COUNT = 300 };
    static springls_hit other[COUNT];
    springls_context *ctx = make_body(TORUS, NULL), *fresh;
    springls_desc desc = fixture_desc(SIZE, NULL);
    int i, s;
    for (s = 0; s < 6; s++) {
        size_t size;
        void *block;
        uint64_t hash = springls_state_hash(ctx);
        judge j;
        ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
        block = malloc(size);
        ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
        ASSERT_OK(springls_create(&desc, &fresh));
        ASSERT_OK(springls_restore(fresh, block, size));
        free(block);
        ASSERT_OK(judge_make(&j, fresh));
        if (s == 0) aim(&j);
        ASSERT_OK(springls_raycast(ctx, WATERTIGHT, origins, directions, COUNT, 0.0f, hits));
        ASSERT_OK(springls_raycast(fresh, WATERTIGHT, origins, directions, COUNT, 0.0f, other));
        ASSERT_MEM_EQ(hits, other, sizeof other);
        ASSERT_OK(springls_closest(ctx, WATERTIGHT, origins, COUNT, hits));
        ASSERT_OK(springls_closest(fresh, WATERTIGHT, origins, COUNT, other));
        ASSERT_MEM_EQ(hits, other, sizeof other);
        ASSERT_EQ(hash, springls_state_hash(ctx));
        judge_free(&j);
        ASSERT_OK(turn(ctx, 1));
    }
    for (i = 0; i < COUNT; i++) ASSERT(hits[i].springl >= 0);
    springls_destroy(ctx);
    PASS();
}

/* No hierarchy is built: the memory stays what it is, even where springls have left the band. */
TEST a_query_builds_nothing(void)
{
    springls_context *ctx = make_body(BALL, NULL), *far;
    float shift[3] = { 2.0f, 9.0f, 1.0f };
    springls_forces forces = fixture_forces(fixture_wind, shift);
    springls_hit hit, before;
    uint64_t hash;
    size_t bytes;
    static float phi[SIZE * SIZE * SIZE];
    float o[3] = { -20.0f, 16.0f, 16.0f }, d[3] = { 1.0f, 0.0f, 0.0f };
    ASSERT(ctx != NULL);
    ASSERT_OK(springls_copy_level_set(ctx, phi)); /* phi follows the last steps */
    bytes = springls_memory_used(ctx);
    ASSERT_OK(springls_raycast(ctx, WATERTIGHT, o, d, 1, 0.0f, &before));
    ASSERT_OK(springls_closest(ctx, WATERTIGHT, o, 1, &hit));
    ASSERT_EQ(bytes, springls_memory_used(ctx));
    ASSERT_OK(springls_raycast(ctx, SOUP, o, d, 1, 0.0f, &hit));
    ASSERT_GT(springls_memory_used(ctx), bytes);
    far = make_body(BALL, NULL);
    ASSERT_OK(springls_advect(far, &forces, 0.0f, 1.0f)); /* the level set stays, and the grid too */
    hash = springls_state_hash(far);
    ASSERT_OK(springls_raycast(far, WATERTIGHT, o, d, 1, 0.0f, &hit));
    ASSERT_EQ(hash, springls_state_hash(far));
    ASSERT_EQ(before.distance, hit.distance);
    ASSERT(hit.springl >= 0);
    springls_destroy(far);
    springls_destroy(ctx);
    PASS();
}

/* Few large springls, so that fits fall back on the springls around: the answer is the same before and after a query of the springls
   themselves, which builds their hierarchy. */
TEST earlier_queries_do_not_matter(void)
{
    enum { COUNT = 200 };
    static const int triangles[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                      2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    static float corners[24], places[3 * COUNT];
    static springls_hit before[COUNT], after[COUNT];
    springls_sphere ball = fixture_ball(23.0f, 16.0f, 16.0f, 4.0f);
    springls_params params = springls_default_params();
    springls_context *ctx;
    springls_hit any;
    int i;
    params.split_input = 0;
    ctx = fixture_context(SIZE, &params);
    for (i = 0; i < 24; i++) corners[i] = 9.0f + 14.0f * (float)(i / 3 >> i % 3 & 1);
    for (i = 0; i < 3 * COUNT; i++) places[i] = 32.0f * (float)(i * 7919 % 1000) / 1000.0f;
    ASSERT_OK(springls_set_mesh(ctx, corners, 8, 0, triangles, 12, NULL));
    ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &ball));
    ASSERT_OK(springls_closest(ctx, WATERTIGHT, places, COUNT, before));
    ASSERT_OK(springls_closest(ctx, SOUP, places, 1, &any));
    ASSERT_OK(springls_closest(ctx, WATERTIGHT, places, COUNT, after));
    ASSERT_MEM_EQ(before, after, sizeof before);
    springls_destroy(ctx);
    PASS();
}

TEST threads_do_not_matter(void)
{
    static springls_hit first[2][1000];
    fixture_workers workers;
    int run, k;
    for (run = 0; run < 3; run++) {
        springls_tasks tasks = fixture_tasks(&workers, run == 0 ? 1 : 3 * run, run);
        judge j;
        ASSERT_OK(judge_make(&j, make_body(NOTCHED, &tasks)));
        aim(&j);
        for (k = 0; k < 2; k++) {
            if (k == 0) ASSERT_OK(springls_raycast(j.ctx, WATERTIGHT, origins, directions, 1000, 0.0f, hits));
            else ASSERT_OK(springls_closest(j.ctx, WATERTIGHT, targets, 1000, hits));
            if (run == 0) memcpy(first[k], hits, sizeof first[k]);
            ASSERT_MEM_EQ(first[k], hits, sizeof first[k]);
        }
        judge_free(&j);
    }
    PASS();
}

/* ---- which surface ---- */

/* The soup's hits lie on springls; a hole in the soup is none in the zero level. */
TEST the_soup_has_gaps(void)
{
    springls_context *ctx = fixture_sphere(SIZE, NULL, 16.0f, 16.0f, 16.0f, 9.0f);
    uint8_t *keep;
    float o[3] = { 16.1f, 16.2f, 40.0f }, d[3] = { 0.0f, 0.0f, -2.0f };
    springls_hit hit;
    int i, m;
    ASSERT(ctx != NULL);
    keep = (uint8_t *)malloc((size_t)springls_count(ctx));
    for (i = 0; i < springls_count(ctx); i++) { /* a hole at the top */
        springls__v3 p = fixture_particle(ctx, i);
        keep[i] = !(p.z > 16.0f && fabsf(p.x - 16.0f) < 3.0f && fabsf(p.y - 16.0f) < 3.0f);
    }
    ASSERT_OK(springls_raycast(ctx, SOUP, o, d, 1, 0.0f, &hit));
    ASSERT_IN_RANGE(15.0f, hit.distance, 0.1f);
    ASSERT_OK(fixture_keep(ctx, keep));
    ASSERT_OK(springls_raycast(ctx, SOUP, o, d, 1, 0.0f, &hit));
    ASSERT_IN_RANGE(33.0f, hit.distance, 0.1f); /* the far wall */
    ASSERT_LT(hit.normal[2], -0.9f);
    {
        springls__v3 on = springls__v3_make(0.0f, 0.0f, 0.0f);
        for (m = 0; m < 3; m++) on = springls__mad(on, fixture_vertex(ctx, hit.springl, m), hit.barycentric[m]);
        ASSERT_LT(springls__length(springls__sub(on, springls__load3(hit.point))), 1e-4f);
    }
    ASSERT_OK(springls_raycast(ctx, WATERTIGHT, o, d, 1, 0.0f, &hit));
    ASSERT_IN_RANGE(15.0f, hit.distance, 0.1f);
    ASSERT_GT(hit.normal[2], 0.9f);
    o[2] = 27.0f;
    ASSERT_OK(springls_closest(ctx, SOUP, o, 1, &hit));
    ASSERT_GT(hit.distance, 2.5f);
    ASSERT_OK(springls_closest(ctx, WATERTIGHT, o, 1, &hit));
    ASSERT_IN_RANGE(2.0f, hit.distance, 0.1f);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_raycast(ctx, (springls_surface)2, o, d, 1, 0.0f, &hit));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_closest(ctx, (springls_surface)-1, o, 1, &hit));
    free(keep);
    springls_destroy(ctx);
    PASS();
}

/* Rays that begin beyond all digits, end before the body, or go nowhere; a model that is not there. */
TEST strange_rays(void)
{
    springls_context *ctx = fixture_sphere(SIZE, NULL, 16.0f, 16.0f, 16.0f, 9.0f);
    const float o[18] = { 16, 16, 1e30f, 3e38f, 3e38f, 3e38f, 16, 16, 16, 16, 16, 7, 16, 100, 16, -1e9f, 16, 16 };
    const float d[18] = { 0, 0, -1e30f, -3e38f, -3e38f, -3e38f, 0, 0, 0, 1e-44f, 0, 0, 0, -1e-30f, 0, 1, 0, 0 };
    springls_hit hit[6];
    int i;
    ASSERT(ctx != NULL);
    ASSERT_OK(springls_raycast(ctx, WATERTIGHT, o, d, 6, 0.0f, hit));
    ASSERT(hit[0].springl >= 0);
    ASSERT_IN_RANGE(25.0f, hit[0].point[2], 0.05f);
    ASSERT_EQ(-1, hit[2].springl);
    ASSERT(hit[4].springl >= 0);
    ASSERT_IN_RANGE(75.0f, hit[4].distance, 0.05f);
    ASSERT(hit[5].springl >= 0);
    ASSERT_IN_RANGE(7.0f, hit[5].point[0], 0.05f);
    ASSERT_OK(springls_raycast(ctx, WATERTIGHT, o, d, 6, 50.0f, hit));
    for (i = 0; i < 6; i++) ASSERT_EQ(i == 3 ? hit[3].springl : -1, hit[i].springl);
    ASSERT_OK(springls_reset(ctx));
    ASSERT_OK(springls_raycast(ctx, WATERTIGHT, o, d, 6, 0.0f, hit));
    for (i = 0; i < 6; i++) ASSERT_EQ(-1, hit[i].springl);
    ASSERT_OK(springls_closest(ctx, WATERTIGHT, o, 6, hit));
    for (i = 0; i < 6; i++) ASSERT_EQ(-1, hit[i].springl);
    springls_destroy(ctx);
    PASS();
}

/* Rays that begin far away on a diagonal, and points far away, up to the end of float: the answers of near ones, on both
   surfaces. */
TEST what_is_far_away_is_found(int soup)
{
    static const float far_away[7] = { 1e3f, 1e6f, 1e9f, 1e13f, 1e20f, 1e30f, 1.5e38f };
    const springls_surface surface = soup ? SPRINGLS_SURFACE_SOUP : WATERTIGHT;
    springls_context *ctx = fixture_sphere(SIZE, NULL, 16.0f, 16.0f, 16.0f, 9.0f);
    springls_hit hit[3];
    int i, k;
    for (i = 0; i < 7; i++) {
        /* on a diagonal of the world, which floats name exactly and on which the body's middle lies: from both ends, and past it */
        const float s = far_away[i], o[9] = { s, s, s, s, -s, s, -s, -s, -s }, d[9] = { -s, -s, -s, s, s, s, s, s, s };
        const float p[9] = { s, 16, 16, 0.5f * s, s, -s, 16, -s, 16 };
        ASSERT_OK(springls_raycast(ctx, surface, o, d, 3, 0.0f, hit));
        ASSERT(hit[0].springl >= 0 && hit[2].springl >= 0);
        ASSERT_EQ(-1, hit[1].springl);
        for (k = 0; k < 3; k++) {
            ASSERT_IN_RANGE(16.0 + 9.0 / sqrt(3.0), (double)hit[0].point[k], 0.1);
            ASSERT_IN_RANGE(16.0 - 9.0 / sqrt(3.0), (double)hit[2].point[k], 0.1);
        }
        ASSERT_IN_RANGE(sqrt(3.0) * ((double)s - 16.0) - 9.0, (double)hit[0].distance, 0.1 + 1e-6 * (double)s);
        ASSERT_OK(springls_raycast(ctx, surface, o, d, 3, s, hit)); /* shorter than to the body */
        for (k = 0; k < 3; k++) ASSERT_EQ(-1, hit[k].springl);
        ASSERT_OK(springls_closest(ctx, surface, p, 3, hit));
        for (k = 0; k < 3; k++) ASSERT(hit[k].springl >= 0);
        ASSERT_IN_RANGE((double)s - 16.0 - 9.0, (double)hit[0].distance, 0.1 + 1e-6 * (double)s);
        ASSERT_IN_RANGE((double)s + 16.0 - 9.0, (double)hit[2].distance, 0.1 + 1e-6 * (double)s);
        ASSERT_GT(hit[0].point[0], 22.0f);
        ASSERT_LT(hit[2].point[1], 10.0f);
        if (s > 1e5f) ASSERT_IN_RANGE(1.5 * (double)s, (double)hit[1].distance, 1e-4 * (double)s);
        if (s > 1e5f) ASSERT(hit[1].point[1] > 16.0f && hit[1].point[2] < 16.0f);
    }
    springls_destroy(ctx);
    PASS();
}

/* A single point so far from the surface that the active brick nearest to it has none of it: then all bricks of a ring are
   looked up, also those that are not active (AddressSanitizer sees reads beside the table). */
TEST one_point_beyond_the_band(void)
{
    static const float at[4][3] = { { 0, 0, 0 }, { -10, -10, -10 }, { 31, 31, 0 }, { 1e8f, 16, 16 } };
    springls_context *ctx = fixture_sphere(SIZE, NULL, 16.0f, 16.0f, 16.0f, 8.0f);
    int i;
    for (i = 0; i < 4; i++) {
        const double distance = d3_distance(d3_make(at[i][0], at[i][1], at[i][2]), d3_make(16.0, 16.0, 16.0)) - 8.0;
        springls_hit hit;
        ASSERT_OK(springls_closest(ctx, WATERTIGHT, at[i], 1, &hit));
        ASSERT_IN_RANGE(distance, (double)hit.distance, 0.1 + 1e-6 * distance);
    }
    springls_destroy(ctx);
    PASS();
}

SUITE(rays)
{
    int which;
    RUN_TEST(one_point_beyond_the_band);
    RUN_TESTp(what_is_far_away_is_found, 0);
    RUN_TESTp(what_is_far_away_is_found, 1);
    for (which = 0; which < BODIES; which++) RUN_TESTp(rays_meet_the_mesh, which);
    for (which = 0; which < BODIES; which++) RUN_TESTp(rays_from_inside_meet_the_mesh, which);
    for (which = 0; which < BODIES; which++) RUN_TESTp(closest_is_that_of_the_mesh, which);
    RUN_TEST(hits_are_whole);
    RUN_TEST(material_is_where_it_was);
    RUN_TEST(answers_follow_the_steps);
    RUN_TEST(a_query_builds_nothing);
    RUN_TEST(earlier_queries_do_not_matter);
    RUN_TEST(threads_do_not_matter);
    RUN_TEST(the_soup_has_gaps);
    RUN_TEST(strange_rays);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(rays);
    GREATEST_MAIN_END();
}
