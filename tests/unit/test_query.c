/* test_query.c - the triangle hierarchy against brute force; questions in world coordinates; material coordinates. */
#include "fixtures.h"
#include "../../src/model/mesh_distance.h"
#include "../../src/model/ray.h"
#include "../../src/model/transform.h"

static uint32_t random_state = 1u;
static float random_unit(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (float)(random_state >> 8) / 16777216.0f;
}

static springls__v3 random_point(float size)
{
    float x = size * random_unit(), y = size * random_unit();
    return springls__v3_make(x, y, size * random_unit());
}

static springls_context *make_context(int size, const double spacing[3], const double origin[3], const double direction[9])
{
    springls_desc desc = fixture_desc(size, NULL);
    springls_context *ctx = NULL;
    int k;
    for (k = 0; k < 3; k++) {
        desc.grid.spacing[k] = spacing ? spacing[k] : 1.0;
        desc.grid.origin[k] = origin ? origin[k] : 0.0;
    }
    for (k = 0; k < 9 && direction; k++) desc.grid.direction[k] = direction[k];
    springls_create(&desc, &ctx);
    return ctx;
}

/* ---- triangles ---- */

enum { SOUP = 3000 };
static springls__v3 soup[3 * SOUP];
static springls__springl soup_springls[SOUP];

/* Triangles of all shapes and sizes, some of them flat, one in ten a copy of another. */
static void make_soup(void)
{
    int i, m;
    for (i = 0; i < SOUP; i++) {
        springls__v3 c = random_point(60.0f);
        float size = 0.05f + 6.0f * random_unit() * random_unit() * random_unit();
        for (m = 0; m < 3; m++) soup[3 * i + m] = springls__mad(c, random_point(1.0f), size);
        if (i % 17 == 0) soup[3 * i + 2] = springls__lerp(soup[3 * i], soup[3 * i + 1], 0.3f);
        if (i % 10 == 9)
            for (m = 0; m < 3; m++) soup[3 * i + m] = soup[3 * (i / 2) + m];
        memcpy(soup_springls[i].q, soup + 3 * i, sizeof soup_springls[i].q);
    }
}

TEST closest_is_exact(void)
{
    springls_context *ctx = make_context(8, NULL, NULL, NULL);
    springls__surface surface;
    int i, t;
    memset(&surface, 0, sizeof surface);
    make_soup();
    ASSERT_EQ(SPRINGLS_OK, springls__surface_build(ctx, &surface, soup_springls, SOUP));
    for (i = 0; i < 2000; i++) {
        springls__v3 x = random_point(80.0f);
        springls__surface_hit h = springls__surface_closest(&surface, x, FLT_MAX), g, near, far;
        springls__tri_hit best;
        int first = -1;
        best.d2 = FLT_MAX;
        for (t = 0; t < SOUP; t++) {
            springls__tri_hit hit = springls__tri_closest(springls__surface_triangle(&surface, t), x);
            if (hit.d2 < best.d2) { best = hit; first = t; }
        }
        ASSERT_EQ(first, h.triangle);
        ASSERT_EQ(best.d2, h.hit.d2);
        g = springls__surface_closest_from(&surface, x, FLT_MAX, i % SOUP); /* a guess changes nothing */
        ASSERT_EQ(first, g.triangle);
        near = springls__surface_closest(&surface, x, 0.99f * sqrtf(best.d2));
        far = springls__surface_closest(&surface, x, 1.01f * sqrtf(best.d2) + 1e-6f);
        ASSERT_EQ(-1, near.triangle);
        ASSERT_EQ(first, far.triangle);
    }
    springls__surface_free(ctx, &surface);
    springls_destroy(ctx);
    PASS();
}

/* Packets have the distances of single places, and their winding numbers up to what directed areas leave open. */
TEST packets_are_as_exact(void)
{
    springls_context *ctx = make_context(8, NULL, NULL, NULL);
    springls__surface surface;
    int i, k;
    memset(&surface, 0, sizeof surface);
    make_soup();
    ASSERT_EQ(SPRINGLS_OK, springls__surface_build(ctx, &surface, soup_springls, SOUP));
    ASSERT_EQ(SPRINGLS_OK, springls__surface_make_dipoles(ctx, &surface));
    for (i = 0; i < 500; i++) {
        const springls__v3 corner = random_point(80.0f);
        const float reach = i % 2 ? 3.0f : 1000.0f;
        springls__packet packet;
        float d2[SPRINGLS__PACKET], w[1][SPRINGLS__PACKET];
        for (k = 0; k < SPRINGLS__PACKET; k++) {
            packet.x[k] = corner.x + (float)(k & 1);
            packet.y[k] = corner.y + (float)(k >> 1 & 1);
            packet.z[k] = corner.z + (float)(k >> 2);
        }
        springls__packet_bound(&packet);
        springls__packet_closest(&surface, &packet, reach, i % 3 ? i % SOUP : -1, d2);
        springls__packets_winding(&surface, &packet, 1, 8.0f, w);
        for (k = 0; k < SPRINGLS__PACKET; k++) {
            const springls__v3 x = springls__v3_make(packet.x[k], packet.y[k], packet.z[k]);
            const springls__surface_hit h = springls__surface_closest(&surface, x, reach);
            ASSERT_EQ(h.triangle < 0 ? reach * reach : h.hit.d2, d2[k]);
            ASSERT_IN_RANGE(springls__surface_winding(&surface, x, 8.0f), w[0][k], 0.01f);
        }
    }
    springls__surface_free(ctx, &surface);
    springls_destroy(ctx);
    PASS();
}

/* Eight packets that go down together, as those of voxels: near the winding numbers of single places. */
TEST eight_packets_are_as_exact(void)
{
    enum { PACKETS = 8 };
    springls_context *ctx = make_context(8, NULL, NULL, NULL);
    springls__surface surface;
    double sum = 0.0;
    int i, p, k;
    memset(&surface, 0, sizeof surface);
    make_soup();
    ASSERT_EQ(SPRINGLS_OK, springls__surface_build(ctx, &surface, soup_springls, SOUP));
    ASSERT_EQ(SPRINGLS_OK, springls__surface_make_dipoles(ctx, &surface));
    for (i = 0; i < 100; i++) {
        const springls__v3 corner = random_point(80.0f);
        springls__packet packets[PACKETS];
        float w[PACKETS][SPRINGLS__PACKET], alone[1][SPRINGLS__PACKET];
        for (p = 0; p < PACKETS; p++) {
            for (k = 0; k < SPRINGLS__PACKET; k++) {
                packets[p].x[k] = corner.x + (float)(2 * (p & 1) + (k & 1));
                packets[p].y[k] = corner.y + (float)(2 * (p >> 1 & 1) + (k >> 1 & 1));
                packets[p].z[k] = corner.z + (float)(2 * (p >> 2) + (k >> 2));
            }
            springls__packet_bound(&packets[p]);
        }
        springls__packets_winding(&surface, packets, PACKETS, 2.5f, w);
        for (p = 0; p < PACKETS; p++) {
            springls__packets_winding(&surface, &packets[p], 1, 2.5f, alone);
            for (k = 0; k < SPRINGLS__PACKET; k++) {
                const springls__v3 x = springls__v3_make(packets[p].x[k], packets[p].y[k], packets[p].z[k]);
                const float exact = springls__surface_winding(&surface, x, 16.0f);
                ASSERT_IN_RANGE(exact, w[p][k], 0.05f);
                ASSERT_IN_RANGE(exact, alone[0][k], 0.05f);
                sum += fabs((double)(w[p][k] - exact));
            }
        }
    }
    ASSERT_LT(sum / (100 * PACKETS * SPRINGLS__PACKET), 0.005);
    springls__surface_free(ctx, &surface);
    springls_destroy(ctx);
    PASS();
}

TEST rays_are_exact(void)
{
    springls_context *ctx = make_context(8, NULL, NULL, NULL);
    springls__surface surface;
    int i, t, hits = 0;
    memset(&surface, 0, sizeof surface);
    make_soup();
    ASSERT_EQ(SPRINGLS_OK, springls__surface_build(ctx, &surface, soup_springls, SOUP));
    for (i = 0; i < 4000; i++) {
        springls__v3 x = random_point(60.0f), d = springls__sub(random_point(2.0f), springls__v3_make(1.0f, 1.0f, 1.0f));
        springls__surface_hit h, one, best;
        springls__ray ray;
        if (i % 5 == 0) d = springls__v3_make(0.0f, i % 2 ? 1.0f : -1.0f, 0.0f); /* along an axis */
        ray = springls__ray_make(x, d);
        best.triangle = -1;
        best.t = 1e18f;
        for (t = 0; t < SOUP; t++)
            if (springls__ray_triangle(&ray, springls__surface_triangle(&surface, t), best.t, &one)
                && (one.t < best.t || best.triangle < 0)) { best = one; best.triangle = t; }
        h = springls__surface_ray(&surface, x, d, 1e18f);
        ASSERT_EQ(best.triangle, h.triangle);
        if (h.triangle < 0) continue;
        hits++;
        ASSERT_EQ(best.t, h.t);
        ASSERT_LT(springls__length(springls__sub(springls__mad(x, d, h.t), h.hit.point)), 1e-2f);
    }
    ASSERT_GT(hits, 100);
    ASSERT_EQ(-1, springls__surface_ray(&surface, random_point(1.0f), springls__v3_make(0.0f, 0.0f, 0.0f), 1e18f).triangle);
    springls__surface_free(ctx, &surface);
    springls_destroy(ctx);
    PASS();
}

/* ---- a sphere in the world ---- */

enum { AROUND = 96, RINGS = 48, SPHERE_POINTS = AROUND * (RINGS - 1) + 2, SPHERE_TRIANGLES = 2 * AROUND * (RINGS - 1) };
static float position[3 * SPHERE_POINTS];
static int triangle[3 * SPHERE_TRIANGLES];

static void put_triangle(int *n, int a, int b, int c)
{
    triangle[3 * *n] = a;
    triangle[3 * *n + 1] = b;
    triangle[3 * *n + 2] = c;
    ++*n;
}

/* An ellipsoid with half axes r[]. */
static void make_ellipsoid(const double center[3], const double r[3])
{
    const double pi = 3.14159265358979;
    int i, j, n = 0, p = 0;
    for (j = 1; j < RINGS; j++)
        for (i = 0; i < AROUND; i++, p++) {
            position[3 * p] = (float)(center[0] + r[0] * sin(pi * j / RINGS) * cos(2 * pi * i / AROUND));
            position[3 * p + 1] = (float)(center[1] + r[1] * sin(pi * j / RINGS) * sin(2 * pi * i / AROUND));
            position[3 * p + 2] = (float)(center[2] - r[2] * cos(pi * j / RINGS));
        }
    for (j = 0; j < 2; j++, p++)
        for (i = 0; i < 3; i++) position[3 * p + i] = (float)(center[i] + (i == 2 ? (j ? r[2] : -r[2]) : 0.0));
    for (i = 0; i < AROUND; i++) {
        int next = (i + 1) % AROUND;
        put_triangle(&n, p - 2, next, i);
        put_triangle(&n, p - 1, (RINGS - 2) * AROUND + i, (RINGS - 2) * AROUND + next);
        for (j = 0; j < RINGS - 2; j++) {
            put_triangle(&n, j * AROUND + i, j * AROUND + next, (j + 1) * AROUND + next);
            put_triangle(&n, j * AROUND + i, (j + 1) * AROUND + next, (j + 1) * AROUND + i);
        }
    }
}

/* Sphere of radius 12 about (100, -50, 30) in a grid with axes permuted and one of them turned round. */
static const double world_center[3] = { 100.0, -50.0, 30.0 };
static springls_context *world_sphere(double sx, double sy, double sz)
{
    static const double direction[9] = { 0, 0, 1, -1, 0, 0, 0, 1, 0 };
    double spacing[3], origin[3], r[3] = { 12.0, 12.0, 12.0 };
    springls_context *ctx;
    int k;
    spacing[0] = sx; spacing[1] = sy; spacing[2] = sz;
    for (k = 0; k < 3; k++)
        origin[k] = world_center[k] - 31.5 * (direction[3 * k] * sx + direction[3 * k + 1] * sy + direction[3 * k + 2] * sz);
    ctx = make_context(64, spacing, origin, direction);
    make_ellipsoid(world_center, r);
    if (ctx && springls_set_mesh(ctx, position, SPHERE_POINTS, 0, triangle, SPHERE_TRIANGLES, NULL) != SPRINGLS_OK) {
        springls_destroy(ctx);
        return NULL;
    }
    return ctx;
}

TEST sampling_in_the_world(void)
{
    springls_context *ctx = fixture_of_zero_level(world_sphere(0.5, 0.5, 0.5));
    int i, k;
    ASSERT(ctx != NULL);
    for (i = 0; i < 500; i++) {
        float x[3], d, g[3], length, r;
        uint8_t inside;
        springls__v3 n = springls__normalize(springls__sub(random_point(2.0f), springls__v3_make(1, 1, 1)));
        r = 11.0f + 2.0f * random_unit();
        x[0] = (float)world_center[0] + r * n.x;
        x[1] = (float)world_center[1] + r * n.y;
        x[2] = (float)world_center[2] + r * n.z;
        ASSERT_EQ(SPRINGLS_OK, springls_sample_distance(ctx, x, 1, &d));
        ASSERT_EQ(SPRINGLS_OK, springls_sample_gradient(ctx, x, 1, g));
        ASSERT_EQ(SPRINGLS_OK, springls_sample_inside(ctx, x, 1, &inside));
        ASSERT_IN_RANGE(r - 12.0f, d, 0.03f);
        ASSERT_EQ(d < 0.0f, inside);
        length = sqrtf(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
        if (fabsf(r - 12.0f) > 0.9f) continue;
        ASSERT_IN_RANGE(1.0f, length, 0.05f);
        for (k = 0; k < 3; k++) ASSERT_IN_RANGE(k == 0 ? n.x : k == 1 ? n.y : n.z, g[k], 0.08f);
    }
    springls_destroy(ctx);
    PASS();
}

/* Distances are the world's, also when voxels are not cubes. */
TEST closest_in_the_world(void)
{
    static const double spacing[2][3] = { { 0.5, 0.5, 0.5 }, { 0.45, 0.9, 0.6 } };
    int kind, i, t;
    for (kind = 0; kind < 2; kind++) {
        springls_context *ctx = world_sphere(spacing[kind][0], spacing[kind][1], spacing[kind][2]);
        ASSERT(ctx != NULL);
        for (i = 0; i < 60; i++) {
            float x[3];
            springls_hit hit;
            double best = 1e30, d2 = 0.0;
            int k;
            for (k = 0; k < 3; k++) x[k] = (float)world_center[k] + 40.0f * (random_unit() - 0.5f);
            for (t = 0; t < SPHERE_TRIANGLES; t++) {
                springls__tri tri;
                springls__tri_hit h;
                tri.a = springls__load3(position + 3 * triangle[3 * t]);
                tri.b = springls__load3(position + 3 * triangle[3 * t + 1]);
                tri.c = springls__load3(position + 3 * triangle[3 * t + 2]);
                h = springls__tri_closest(tri, springls__load3(x));
                if ((double)h.d2 < best) best = (double)h.d2;
            }
            ASSERT_EQ(SPRINGLS_OK, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, x, 1, &hit));
            ASSERT(hit.springl >= 0);
            ASSERT_IN_RANGE(sqrt(best), (double)hit.distance, 1e-3);
            for (k = 0; k < 3; k++) d2 += ((double)x[k] - (double)hit.point[k]) * ((double)x[k] - (double)hit.point[k]);
            ASSERT_IN_RANGE((double)hit.distance, sqrt(d2), 1e-3);
        }
        springls_destroy(ctx);
    }
    PASS();
}

TEST rays_in_the_world(void)
{
    springls_context *ctx = world_sphere(0.45, 0.9, 0.6);
    int i, k;
    ASSERT(ctx != NULL);
    for (i = 0; i < 200; i++) {
        float from[3], along[3];
        springls_hit hit;
        springls__v3 n = springls__normalize(springls__sub(random_point(2.0f), springls__v3_make(1, 1, 1)));
        along[0] = -3.0f * n.x; along[1] = -3.0f * n.y; along[2] = -3.0f * n.z;
        for (k = 0; k < 3; k++) from[k] = (float)world_center[k] - 10.0f * along[k];
        ASSERT_EQ(SPRINGLS_OK, springls_raycast(ctx, SPRINGLS_SURFACE_SOUP, from, along, 1, 0.0f, &hit));
        ASSERT(hit.springl >= 0);
        ASSERT_IN_RANGE(18.0f, hit.distance, 0.05f);
        ASSERT_EQ(SPRINGLS_OK, springls_raycast(ctx, SPRINGLS_SURFACE_SOUP, from, along, 1, 17.0f, &hit));
        ASSERT_EQ(-1, hit.springl);
        for (k = 0; k < 3; k++) along[k] = -along[k];
        ASSERT_EQ(SPRINGLS_OK, springls_raycast(ctx, SPRINGLS_SURFACE_SOUP, from, along, 1, 0.0f, &hit));
        ASSERT_EQ(-1, hit.springl);
    }
    springls_destroy(ctx);
    PASS();
}

/* ---- material coordinates ---- */

static void rotate(springls__v3 *x)
{
    const float c = 0.8f, s = 0.6f;
    springls__v3 p = springls__sub(*x, springls__v3_make(31.5f, 31.5f, 31.5f));
    *x = springls__v3_make(32.7f + c * p.x - s * p.y, 30.9f + s * p.x + c * p.y, 33.1f + p.z);
}

/* Any place of a rigidly moved model comes back to where it was on the mesh given. */
TEST rigid_motion_keeps_material(void)
{
    const double center[3] = { 31.5, 31.5, 31.5 }, r[3] = { 22.0, 14.0, 18.0 };
    springls_context *ctx = make_context(64, NULL, NULL, NULL);
    float worst = 0.0f;
    int i, k, m, s, turned;
    ASSERT(ctx != NULL);
    for (turned = 0; turned < 2; turned++) {
        make_ellipsoid(center, r);
        for (i = 0; i < SPHERE_TRIANGLES && turned; i++) {
            int swap = triangle[3 * i];
            triangle[3 * i] = triangle[3 * i + 1];
            triangle[3 * i + 1] = swap;
        }
        ASSERT_EQ(SPRINGLS_OK, springls_set_mesh(ctx, position, SPHERE_POINTS, 0, triangle, SPHERE_TRIANGLES, NULL));
        for (s = 0; s < fixture_here(ctx)->set.count; s++) {
            for (m = 0; m < 3; m++) rotate(&ctx->model.set.s[s].q[m]);
            rotate(&ctx->model.set.s[s].p);
        }
        springls__constellation_changed(ctx);
        for (i = 0; i < 1000; i++) {
            int t = (int)(random_unit() * (float)SPHERE_TRIANGLES);
            float u = random_unit(), v = random_unit() * (1.0f - u), b[3], back[3] = { 0, 0, 0 };
            springls__v3 place = springls__v3_make(0, 0, 0), there;
            springls_hit hit;
            float x[3], error;
            b[0] = u; b[1] = v; b[2] = 1.0f - u - v;
            for (k = 0; k < 3; k++) place = springls__mad(place, springls__load3(position + 3 * triangle[3 * t + k]), b[k]);
            there = place;
            rotate(&there);
            x[0] = there.x; x[1] = there.y; x[2] = there.z;
            ASSERT_EQ(SPRINGLS_OK, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, x, 1, &hit));
            ASSERT(hit.material_triangle >= 0);
            error = springls__length(springls__sub(springls__load3(hit.material), place));
            worst = springls__max(worst, error);
            for (m = 0; m < 3; m++) /* in the mesh that was given, its own corners in its own order */
                for (k = 0; k < 3; k++)
                    back[k] += hit.material_barycentric[m] * position[3 * triangle[3 * hit.material_triangle + m] + k];
            ASSERT_LT(springls__length(springls__sub(springls__load3(back), springls__load3(hit.material))), 1e-4f);
        }
    }
    ASSERT_LT(worst, 2e-3f);
    springls_destroy(ctx);
    PASS();
}

/* A spacing of zero is a spacing of one, in every answer. */
TEST zero_spacing_is_one(void)
{
    const double zero[3] = { 0.0, 0.0, 0.0 };
    springls_sphere ball = { { 31.0f, 33.0f, 32.0f }, 12.0f };
    springls_hit hit[2][50];
    int k, s, m, i;
    for (k = 0; k < 2; k++) {
        springls_context *ctx = make_context(64, k ? zero : NULL, NULL, NULL);
        float x[150];
        ASSERT_EQ(SPRINGLS_OK, springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        for (s = 0; s < fixture_here(ctx)->set.count; s++) {
            for (m = 0; m < 3; m++) rotate(&ctx->model.set.s[s].q[m]);
            rotate(&ctx->model.set.s[s].p);
        }
        springls__constellation_changed(ctx);
        random_state = 5u;
        for (i = 0; i < 150; i++) x[i] = 20.0f + 24.0f * random_unit();
        memset(hit[k], 0, sizeof hit[k]);
        ASSERT_EQ(SPRINGLS_OK, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, x, 50, hit[k]));
        springls_destroy(ctx);
    }
    ASSERT_MEM_EQ(hit[0], hit[1], sizeof hit[0]);
    PASS();
}

/* Twelve big triangles: too few neighbours for a fit. */
TEST coarse_box_keeps_material(void)
{
    static const int face[36] = { 0,2,3, 0,3,1, 4,5,7, 4,7,6, 0,1,5, 0,5,4, 2,6,7, 2,7,3, 0,4,6, 0,6,2, 1,3,7, 1,7,5 };
    springls_context *ctx = make_context(64, NULL, NULL, NULL);
    float corner[24];
    int i, k, m, s;
    ASSERT(ctx != NULL);
    for (i = 0; i < 8; i++)
        for (k = 0; k < 3; k++) corner[3 * i + k] = i >> k & 1 ? 43.0f : 20.0f;
    ASSERT_EQ(SPRINGLS_OK, springls_set_mesh(ctx, corner, 8, 0, face, 12, NULL));
    for (s = 0; s < fixture_here(ctx)->set.count; s++) {
        for (m = 0; m < 3; m++) rotate(&ctx->model.set.s[s].q[m]);
        rotate(&ctx->model.set.s[s].p);
    }
    springls__constellation_changed(ctx);
    for (i = 0; i < 200; i++) {
        springls__v3 place = random_point(22.0f), there;
        springls_hit hit;
        float x[3];
        place = springls__v3_make(20.5f + place.x, 20.5f + place.y, i % 2 ? 43.0f : 20.0f);
        there = place;
        rotate(&there);
        x[0] = there.x; x[1] = there.y; x[2] = there.z;
        ASSERT_EQ(SPRINGLS_OK, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, x, 1, &hit));
        ASSERT_LT(springls__length(springls__sub(springls__load3(hit.material), place)), 1e-3f);
    }
    springls_destroy(ctx);
    PASS();
}

/* ---- reading, bad input ---- */

/* phi at a place between the voxels of a dense grid of 64^3, by linear interpolation. */
static double interpolated(const float *phi, const float x[3])
{
    int base[3], corner, k;
    double sum = 0.0;
    for (k = 0; k < 3; k++) base[k] = (int)x[k];
    for (corner = 0; corner < 8; corner++) {
        double weight = 1.0;
        int at = 0;
        for (k = 2; k >= 0; k--) {
            int up = corner >> k & 1;
            double along = (double)x[k] - base[k];
            weight *= up ? along : 1.0 - along;
            at = 64 * at + base[k] + up;
        }
        sum += weight * (double)phi[at];
    }
    return sum;
}

TEST packed_forms(void)
{
    springls_context *ctx = world_sphere(0.45, 0.9, 0.6);
    float *matrix, *surfel, *phi;
    springls_view q, p;
    double largest = 0.0;
    int i, k;
    ASSERT(ctx != NULL);
    matrix = (float *)malloc(16 * SPHERE_TRIANGLES * sizeof *matrix);
    surfel = (float *)malloc(7 * SPHERE_TRIANGLES * sizeof *surfel);
    phi = (float *)malloc(64 * 64 * 64 * sizeof *phi);
    ASSERT(matrix && surfel && phi);
    ASSERT_EQ(SPRINGLS_OK, springls_pack_matrix(ctx, matrix));
    ASSERT_EQ(SPRINGLS_OK, springls_extract_surfels(ctx, surfel));
    ASSERT_EQ(SPRINGLS_OK, springls_copy_level_set(ctx, phi));
    q = springls_view_vertices(ctx);
    p = springls_view_particles(ctx);
    ASSERT_EQ(SPHERE_TRIANGLES, q.count);
    for (i = 0; i < SPHERE_TRIANGLES; i++) {
        const float *vertex = (const float *)(const void *)((const char *)(const void *)q.data + (size_t)i * q.stride);
        const float *particle = (const float *)(const void *)((const char *)(const void *)p.data + (size_t)i * p.stride);
        double outward = 0.0, r = 0.0;
        ASSERT_MEM_EQ(particle, (matrix + 16 * i), 12);
        for (k = 0; k < 3; k++) ASSERT_MEM_EQ((vertex + 3 * k), (matrix + 16 * i + 4 * k + 4), 12);
        ASSERT_EQ(ctx->model.set.a[i].x, matrix[16 * i + 7]);
        ASSERT_EQ(ctx->model.set.a[i].y, matrix[16 * i + 11]);
        ASSERT_EQ(ctx->model.set.a[i].z, matrix[16 * i + 15]);
        for (k = 0; k < 3; k++) {
            double d = (double)surfel[7 * i + k] - world_center[k];
            r += d * d;
            outward += d * (double)surfel[7 * i + 3 + k];
        }
        ASSERT_IN_RANGE(12.0, sqrt(r), 0.05);
        ASSERT_GT(outward, 0.97 * sqrt(r));
        ASSERT(surfel[7 * i + 6] > 0.0f && surfel[7 * i + 6] < 1.0f);
    }
    for (i = 0; i < 64 * 64 * 64; i += 37) /* what has been read is here */
        ASSERT_EQ(phi[i], springls__grid_phi(&ctx->model.grid, ctx->model.grid.phi, i % 64, i / 64 % 64, i / 4096));
    ASSERT_OK(fixture_translate(ctx, 0.5f, -0.3f, 0.2f)); /* away from phi = 0: the level set stays */
    ASSERT_OK(springls_pack_matrix(ctx, matrix));
    for (i = 0; i < SPHERE_TRIANGLES; i++) {
        ASSERT_IN_RANGE(interpolated(phi, matrix + 16 * i), matrix[16 * i + 3], 1e-4);
        largest = fmax(largest, fabs((double)matrix[16 * i + 3]));
    }
    ASSERT_GT(largest, 0.3);
    free(matrix);
    free(surfel);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

TEST coordinates_there_and_back(void)
{
    springls_context *ctx = world_sphere(0.45, 0.9, 0.6);
    float x[6] = { 100.0f, -50.0f, 30.0f, 90.0f, -45.0f, 33.0f }, y[6];
    int k;
    ASSERT(ctx != NULL);
    springls_to_voxel(ctx, x, 2, y);
    for (k = 0; k < 3; k++) ASSERT_IN_RANGE(31.5f, y[k], 1e-4f);
    springls_to_world(ctx, y, 2, y); /* in place */
    for (k = 0; k < 6; k++) ASSERT_IN_RANGE(x[k], y[k], 1e-4f);
    springls_destroy(ctx);
    PASS();
}

TEST bad_points_are_refused(void)
{
    springls_context *ctx = world_sphere(0.5, 0.5, 0.5);
    float bad[3] = { 0.0f, NAN, 0.0f }, far[3] = { 3e38f, -3e38f, 3e38f }, out[3];
    springls_hit hit;
    ASSERT(ctx != NULL);
    ASSERT_EQ(SPRINGLS_NON_FINITE, springls_sample_distance(ctx, bad, 1, out));
    ASSERT_EQ(SPRINGLS_NON_FINITE, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, bad, 1, &hit));
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, NULL, 1, &hit));
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, far, -1, &hit));
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, springls_raycast(ctx, SPRINGLS_SURFACE_SOUP, far, far, 1, -1.0f, &hit));
    ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, springls_closest(NULL, SPRINGLS_SURFACE_SOUP, far, 1, &hit));
    ASSERT_EQ(SPRINGLS_OK, springls_sample_distance(ctx, far, 1, out));
    ASSERT_GT(out[0], 0.0f);
    ASSERT_EQ(SPRINGLS_OK, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, far, 1, &hit));
    ASSERT(hit.springl >= 0);
    ASSERT_EQ(SPRINGLS_OK, springls_reset(ctx)); /* an empty model answers "nothing" */
    far[0] = far[1] = far[2] = 1.0f;
    ASSERT_EQ(SPRINGLS_OK, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, far, 1, &hit));
    ASSERT_EQ(-1, hit.springl);
    ASSERT_EQ(SPRINGLS_OK, springls_raycast(ctx, SPRINGLS_SURFACE_SOUP, far, far, 1, 0.0f, &hit));
    ASSERT_EQ(-1, hit.springl);
    springls_destroy(ctx);
    PASS();
}

/* ---- shapes: slope one everywhere, zero where they should be ---- */

/* The steepest of many directions; how often the gradient is shorter than one. */
static float steepest(springls_implicit_fn fn, void *shape, float size, int *flat)
{
    float worst = 0.0f;
    int i, m;
    *flat = 0;
    for (i = 0; i < 20000; i++) {
        springls__v3 x = springls__sub(random_point(2.0f * size), springls__v3_make(size, size, size));
        springls__v3 along = springls__normalize(springls__sub(random_point(2.0f), springls__v3_make(1.0f, 1.0f, 1.0f)));
        float y[24], d[8], g = 0.0f;
        const float h = 2e-3f;
        for (m = 0; m < 6; m++) {
            y[3 * m] = x.x; y[3 * m + 1] = x.y; y[3 * m + 2] = x.z;
            y[3 * m + m / 2] += m % 2 ? h : -h;
        }
        for (m = 6; m < 8; m++) {
            springls__v3 end = springls__mad(x, along, m % 2 ? h : -h);
            y[3 * m] = end.x; y[3 * m + 1] = end.y; y[3 * m + 2] = end.z;
        }
        fn(shape, y, 8, d);
        for (m = 0; m < 3; m++) g += (d[2 * m + 1] - d[2 * m]) * (d[2 * m + 1] - d[2 * m]) / (4.0f * h * h);
        worst = springls__max(worst, fabsf(d[7] - d[6]) / (2.0f * h)); /* across an edge the three slopes above mix two sides */
        *flat += g < 0.98f;
    }
    return worst;
}

TEST shapes_have_slope_one(void)
{
    springls_sphere balls[3] = { { { 0, 0, 0 }, 1.0f }, { { 1.2f, 0, 0 }, 0.8f }, { { 0.2f, 1.1f, 0.1f }, 0.7f } };
    springls_box box = { { 0.1f, 0.2f, -0.1f }, { 0.8f, 0.5f, 1.0f } };
    springls_torus torus = { { 0.1f, 0, 0 }, { 1.0f, 2.0f, -1.0f }, 1.0f, 0.3f };
    springls_metasphere meta;
    springls_notched_sphere notched = { { 0, 0, 0 }, 1.2f, 0.4f, 1.0f };
    int flat;
    meta.spheres = balls;
    meta.count = 2;
    ASSERT_LT(steepest(springls_implicit_sphere, balls, 2.0f, &flat), 1.01f);
    ASSERT_LT(flat, 100);
    ASSERT_LT(steepest(springls_implicit_box, &box, 2.0f, &flat), 1.01f);
    ASSERT_LT(flat, 400);
    ASSERT_LT(steepest(springls_implicit_torus, &torus, 2.0f, &flat), 1.01f);
    ASSERT_LT(flat, 400);
    ASSERT_LT(steepest(springls_implicit_metasphere, &meta, 2.0f, &flat), 1.01f);
    ASSERT_LT(flat, 400);
    ASSERT_LT(steepest(springls_implicit_notched_sphere, &notched, 2.0f, &flat), 1.02f);
    ASSERT_LT(flat, 400);
    PASS();
}

SUITE(triangles)
{
    RUN_TEST(closest_is_exact);
    RUN_TEST(packets_are_as_exact);
    RUN_TEST(eight_packets_are_as_exact);
    RUN_TEST(rays_are_exact);
}

SUITE(world)
{
    RUN_TEST(sampling_in_the_world);
    RUN_TEST(closest_in_the_world);
    RUN_TEST(rays_in_the_world);
    RUN_TEST(rigid_motion_keeps_material);
    RUN_TEST(zero_spacing_is_one);
    RUN_TEST(coarse_box_keeps_material);
    RUN_TEST(packed_forms);
    RUN_TEST(coordinates_there_and_back);
    RUN_TEST(bad_points_are_refused);
    RUN_TEST(shapes_have_slope_one);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(triangles);
    RUN_SUITE(world);
    GREATEST_MAIN_END();
}
