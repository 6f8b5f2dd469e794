/* test_vector.c - the functions that state depends on, against libm in double precision, and SIMD against single numbers. */
#include "fixtures.h"

/* exp has a relative error below 3e-7 on [-80, 80]. */
TEST exp_is_accurate(void)
{
    double worst = 0.0;
    int i;
    for (i = 0; i <= 200000; i++) {
        float x = -80.0f + 160.0f * (float)i / 200000.0f;
        double exact = exp((double)x), e = fabs((double)springls__exp(x) - exact) / exact;
        if (e > worst) worst = e;
    }
    ASSERT_IN_RANGE(0.0, worst, 3e-7);
    ASSERT_EQ(1.0f, springls__exp(0.0f));
    PASS();
}

/* Beyond [-80, 80] exp stays at its value there: finite, and not zero. */
TEST exp_is_clamped(void)
{
    ASSERT_EQ(springls__exp(80.0f), springls__exp(1e30f));
    ASSERT_EQ(springls__exp(-80.0f), springls__exp(-1e30f));
    ASSERT(springls__exp(-1e30f) > 0.0f);
    ASSERT(springls__exp(1e30f) < FLT_MAX);
    PASS();
}

/* tanh is accurate to a few units in the last place, odd, never above 1, and never falls. */
TEST tanh_is_accurate(void)
{
    double worst = 0.0;
    float before = -2.0f;
    int i;
    for (i = -120000; i <= 120000; i++) {
        float x = (float)i * 1e-4f, t = springls__tanh(x);
        double exact = tanh((double)x), e = fabs((double)t - exact) / (fabs(exact) > 1e-30 ? fabs(exact) : 1.0);
        if (e > worst) worst = e;
        ASSERT_EQ(-t, springls__tanh(-x));
        ASSERT(t >= -1.0f && t <= 1.0f);
        ASSERT(t >= before - 1.2e-7f);
        before = t;
    }
    ASSERT_IN_RANGE(0.0, worst, 6e-7);
    ASSERT_EQ(1.0f, springls__tanh(1e30f));
    ASSERT_EQ(-1.0f, springls__tanh(-1e30f));
    PASS();
}

/* atanh is accurate within 0.999 of the poles, odd to rounding, and finite beyond. */
TEST atanh_is_accurate(void)
{
    double worst = 0.0;
    int i;
    for (i = -9990; i <= 9990; i++) {
        float x = (float)i * 1e-4f;
        double e = fabs((double)springls__atanh(x) - atanh((double)x)) / (1.0 / (1.0 - (double)x * (double)x));
        if (e > worst) worst = e; /* in units of the argument: a pole amplifies its rounding */
    }
    ASSERT_IN_RANGE(0.0, worst, 1e-6);
    ASSERT_IN_RANGE(atanh(0.999), springls__atanh(5.0f), 1e-3);
    ASSERT_IN_RANGE(-atanh(0.999), springls__atanh(-5.0f), 1e-3);
    ASSERT_IN_RANGE(-(double)springls__atanh(0.7f), springls__atanh(-0.7f), 3e-7);
    PASS();
}

/* sin(pi x) and cos(pi x) have an absolute error below 2e-7 for moderate x; larger x add the rounding of x itself. */
TEST sinpi_and_cospi_are_accurate(void)
{
    double worst = 0.0, worst_far = 0.0;
    int i;
    for (i = -200000; i <= 200000; i++) {
        float x = (float)i * 1e-5f;
        double s = fabs((double)springls__sinpi(x) - sin(fixture_pi * (double)x));
        double c = fabs((double)springls__cospi(x) - cos(fixture_pi * (double)x));
        if (s > worst) worst = s;
        if (c - fixture_pi * 1.2e-7 > worst) worst = c - fixture_pi * 1.2e-7; /* x + 1/2 rounds */
    }
    ASSERT_IN_RANGE(0.0, worst, 2e-7);
    for (i = -1000; i <= 1000; i++) {
        float x = (float)i + 0.25f;
        double e = fabs((double)springls__sinpi(x) - sin(fixture_pi * (double)x));
        if (e > worst_far) worst_far = e;
    }
    ASSERT_IN_RANGE(0.0, worst_far, 2e-7);
    for (i = -5; i <= 5; i++) ASSERT_EQ(0.0f, springls__sinpi((float)i));
    PASS();
}

/* atan2 has an absolute error below 5e-7 in all four quadrants, and is 0 at the origin. */
TEST atan2_is_accurate(void)
{
    double worst = 0.0;
    int i;
    for (i = 0; i < 100000; i++) {
        double angle = (i + 0.5) / 100000.0 * 2.0 * fixture_pi - fixture_pi, r = exp((double)(i % 37) - 18.0), e;
        float y = (float)(r * sin(angle)), x = (float)(r * cos(angle));
        e = fabs((double)springls__atan2(y, x) - atan2((double)y, (double)x));
        if (e > worst) worst = e;
    }
    ASSERT_IN_RANGE(0.0, worst, 5e-7);
    ASSERT_EQ(0.0f, springls__atan2(0.0f, 0.0f));
    PASS();
}

/* A rotation keeps lengths and is the rotation of double precision. */
TEST rotate_turns(void)
{
    int i;
    fixture_seed(3);
    for (i = 0; i < 5000; i++) {
        springls__v3 v = fixture_point(-3.0f, 3.0f), w = springls__scale(fixture_direction(), fixture_between(0.0f, 3.1f)), r;
        r = springls__rotate(v, springls__turn_by(w));
        ASSERT_LT(d3_distance(d3_rotate(d3_of(v), d3_of(w)), d3_of(r)), 5e-6);
    }
    PASS();
}

/* The unit vector of a zero vector is zero, of any other has length 1, however small or large. */
TEST normalize_has_no_hole(void)
{
    springls__v3 zero = springls__normalize(springls__v3_make(0.0f, 0.0f, 0.0f));
    float scale;
    ASSERT_EQ(0.0f, springls__length(zero));
    for (scale = 1e-14f; scale < 1e18f; scale *= 10.0f)
        ASSERT_IN_RANGE(1.0, springls__length(springls__normalize(springls__v3_make(scale, -2.0f * scale, 0.5f * scale))), 3e-7);
    PASS();
}

/* Trilinear values are exact for a function linear along each axis. */
TEST trilinear_is_exact(void)
{
    int i, c;
    fixture_seed(5);
    for (i = 0; i < 1000; i++) {
        float k[8], corner[8];
        float u = fixture_between(0.0f, 1.0f), v = fixture_between(0.0f, 1.0f), w = fixture_between(0.0f, 1.0f);
        double x = (double)u, y = (double)v, z = (double)w, exact;
        for (c = 0; c < 8; c++) k[c] = fixture_between(-1.0f, 1.0f);
        for (c = 0; c < 8; c++) {
            float a = (float)(c & 1), b = (float)(c >> 1 & 1), d = (float)(c >> 2);
            corner[c] = k[0] + k[1] * a + k[2] * b + k[3] * d + k[4] * a * b + k[5] * b * d + k[6] * a * d + k[7] * a * b * d;
        }
        exact = (double)k[0] + (double)k[1] * x + (double)k[2] * y + (double)k[3] * z + (double)k[4] * x * y + (double)k[5] * y * z
              + (double)k[6] * x * z + (double)k[7] * x * y * z;
        ASSERT_IN_RANGE(exact, springls__trilinear(corner, u, v, w), 2e-6);
    }
    PASS();
}

/* Does every lane of `wide` hold the bits of the single number one[lane]? */
static int lanes_are(springls__vec wide, const float *one)
{
    float lane[SPRINGLS__LANES];
    springls__vec_store(lane, wide);
    return memcmp(lane, one, sizeof lane) == 0;
}

#define MAX_LANES 8
#define ASSERT_FUNCTION(name)                                                             \
    do {                                                                                  \
        for (lane = 0; lane < SPRINGLS__LANES; lane++) one[lane] = springls__##name(x[lane]); \
        ASSERTm(#name, lanes_are(springls__vec_##name(springls__vec_load(x)), one));      \
    } while (0)

/* Several numbers at once give the bits that each gives alone, whatever its size and its neighbours in the vector. */
TEST lanes_are_single_numbers(void)
{
    float x[MAX_LANES], one[MAX_LANES];
    int i, lane;
    fixture_seed(6);
    for (i = 0; i < 30000; i++) {
        const float size = i % 3 == 0 ? 0.5f : i % 3 == 1 ? 12.0f : 300.0f;
        for (lane = 0; lane < MAX_LANES; lane++) x[lane] = i % 7 == lane ? 0.0f : fixture_between(-size, size);
        ASSERT_FUNCTION(exp);
        ASSERT_FUNCTION(tanh);
        ASSERT_FUNCTION(atanh);
        ASSERT_FUNCTION(sinpi);
        ASSERT_FUNCTION(cospi);
        ASSERT_FUNCTION(floor);
        ASSERT_FUNCTION(fabs);
        for (lane = 0; lane < MAX_LANES; lane++) x[lane] = springls__fabs(x[lane]) + 1e-6f;
        ASSERT_FUNCTION(ln);
        ASSERT_FUNCTION(sqrt);
    }
    PASS();
}

/* Several vectors at once give the bits that each gives alone, in the functions of vectors and in distances to a triangle. */
TEST lanes_are_single_vectors(void)
{
    float x[3][MAX_LANES], one[4][MAX_LANES];
    int i, lane;
    fixture_seed(7);
    for (i = 0; i < 30000; i++) {
        springls__v3 a = i % 5 ? fixture_point(-2.0f, 2.0f) : springls__v3_make(0.0f, 0.0f, 0.0f);
        springls__tri t;
        springls__tri_plan plan;
        springls__vec3 wide;
        t.a = fixture_point(-2.0f, 2.0f);
        t.b = i % 11 ? fixture_point(-2.0f, 2.0f) : t.a;
        t.c = i % 13 ? fixture_point(-2.0f, 2.0f) : t.b;
        plan = springls__tri_plan_make(t);
        for (lane = 0; lane < MAX_LANES; lane++) {
            springls__v3 p = springls__scale(fixture_direction(), i % 7 == lane ? 0.0f : fixture_between(0.0f, 3.0f)), n;
            n = springls__normalize(springls__add(springls__cross(p, a), p));
            x[0][lane] = p.x;
            x[1][lane] = p.y;
            x[2][lane] = p.z;
            one[0][lane] = n.x;
            one[1][lane] = n.y;
            one[2][lane] = n.z;
            one[3][lane] = springls__tri_distance2(&plan, p);
        }
        wide = springls__vec_load_v3(x[0], x[1], x[2]);
        ASSERT(lanes_are(springls__vec_tri_distance2(&plan, wide), one[3]));
        wide = springls__vec_normalize(springls__vec_add(springls__vec_cross(wide, springls__vec_broadcast3(a)), wide));
        ASSERT(lanes_are(wide.x, one[0]) && lanes_are(wide.y, one[1]) && lanes_are(wide.z, one[2]));
    }
    PASS();
}

/* Adds to x what lies so far along each axis of a triangle: along ab, along ac, and along its normal. */
static springls__v3 beside(springls__tri t, float u, float v, float height)
{
    const springls__v3 ab = springls__sub(t.b, t.a), ac = springls__sub(t.c, t.a);
    return springls__mad(springls__mad(springls__mad(t.a, ab, u), ac, v), springls__normalize(springls__cross(ab, ac)), height);
}

/* Distances to the closest point of a triangle have the bits of single places over its face, edges and corners, and where it has no area:
   a point, a segment, corners on a line, and so thin that n^2 <= 1e-20. */
TEST lanes_are_closest_points(void)
{
    static const float along[] = { -0.7f, 0.0f, 0.2f, 0.4f, 1.0f, 1.8f };
    enum { ALONG = sizeof along / sizeof along[0] };
    float x[3][MAX_LANES], one[MAX_LANES];
    int i, k, lane, regions[3] = { 0, 0, 0 }, flat = 0;
    fixture_seed(9);
    for (i = 0; i < 3000; i++) {
        springls__tri t;
        t.a = fixture_point(-2.0f, 2.0f);
        t.b = i % 8 == 1 ? t.a : fixture_point(-2.0f, 2.0f);
        t.c = i % 16 == 1 ? t.a : i % 8 == 2 ? springls__lerp(t.a, t.b, fixture_between(-1.0f, 2.0f)) : fixture_point(-2.0f, 2.0f);
        if (i % 8 == 3) t.c = springls__mad(t.b, fixture_direction(), 1e-11f);
        if (i % 8 == 4) { /* tiny all around */
            t.b = springls__scale(fixture_direction(), 1e-6f);
            t.c = springls__scale(fixture_direction(), 1e-6f);
            t.a = springls__v3_make(0.0f, 0.0f, 0.0f);
        }
        flat += springls__length2(springls__tri_area2(t)) <= 1e-20f;
        for (k = 0; k < ALONG * ALONG; k += MAX_LANES) {
            for (lane = 0; lane < MAX_LANES; lane++) {
                const int n = (k + lane) % (ALONG * ALONG);
                const springls__v3 p = beside(t, along[n % ALONG], along[n / ALONG], i % 3 ? fixture_between(-1.0f, 1.0f) : 0.0f);
                const springls__tri_hit hit = springls__tri_closest(t, p);
                x[0][lane] = p.x;
                x[1][lane] = p.y;
                x[2][lane] = p.z;
                one[lane] = hit.d2;
                regions[(hit.bary[0] > 0.0f) + (hit.bary[1] > 0.0f) + (hit.bary[2] > 0.0f) - 1]++;
            }
            for (lane = 0; lane < MAX_LANES; lane += SPRINGLS__LANES)
                ASSERT(lanes_are(springls__vec_tri_closest2(t, springls__vec_load_v3(x[0] + lane, x[1] + lane, x[2] + lane)), one + lane));
        }
    }
    ASSERT_GT(flat, 1000);
    for (k = 0; k < 3; k++) ASSERT_GT(regions[k], 5000); /* corners, edges, face */
    PASS();
}

SUITE(vector)
{
    RUN_TEST(exp_is_accurate);
    RUN_TEST(exp_is_clamped);
    RUN_TEST(tanh_is_accurate);
    RUN_TEST(atanh_is_accurate);
    RUN_TEST(sinpi_and_cospi_are_accurate);
    RUN_TEST(atan2_is_accurate);
    RUN_TEST(rotate_turns);
    RUN_TEST(normalize_has_no_hole);
    RUN_TEST(trilinear_is_exact);
    RUN_TEST(lanes_are_single_numbers);
    RUN_TEST(lanes_are_single_vectors);
    RUN_TEST(lanes_are_closest_points);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(vector);
    GREATEST_MAIN_END();
}
