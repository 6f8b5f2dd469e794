/* test_attributes.c - what springls carry: exact for linear functions, conserved where it is shared, in step with the springls
   whatever happens, and without any effect on them; material coordinates, on one side of every seam. */
#include "fixtures.h"

/* Channels: the correspondence, a label by half-space, and an amount. */
typedef struct carried { int place, label, amount; } carried;

static float label_of(const float *a) { return a[0] < 15.5f ? 1.0f : 2.0f; }

static float *particles_of(const springls_context *ctx)
{
    springls_view view = springls_view_particles(ctx);
    float *out = (float *)malloc((size_t)(view.count + 1) * 3 * sizeof *out);
    int i;
    for (i = 0; i < view.count; i++) memcpy(out + 3 * i, (const char *)view.data + (size_t)i * view.stride, 3 * sizeof *out);
    return out;
}

static springls_status carry(springls_context *ctx, carried *c)
{
    springls_attribute_desc place = { "place", 3, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_COPY };
    springls_attribute_desc label = { "label", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    springls_attribute_desc amount = { "amount", 1, SPRINGLS_POLICY_SHARE, SPRINGLS_POLICY_SHARE, SPRINGLS_POLICY_SHARE };
    float *p = particles_of(ctx), *values = (float *)malloc((size_t)springls_count(ctx) * sizeof *values);
    springls_status status = springls_add_attribute(ctx, &place, p, &c->place);
    int i;
    for (i = 0; i < springls_count(ctx); i++) values[i] = label_of(p + 3 * i);
    if (status == SPRINGLS_OK) status = springls_add_attribute(ctx, &label, values, &c->label);
    for (i = 0; i < springls_count(ctx); i++) values[i] = 1.0f;
    if (status == SPRINGLS_OK) status = springls_add_attribute(ctx, &amount, values, &c->amount);
    free(p);
    free(values);
    return status;
}

static double total(const springls_context *ctx, int index)
{
    springls_view view = springls_view_attribute(ctx, index);
    double sum = 0.0;
    int i;
    for (i = 0; i < view.count; i++) sum += (double)((const float *)((const char *)view.data + (size_t)i * view.stride))[0];
    return sum;
}

/* A shear that grows and folds the sphere: splits, fills and merges at every resampling, which no lazy step puts off. */
static void swirl(void *user, const float *x, int count, float time, float *v)
{
    int i;
    (void)user, (void)time;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        float y = (x[1] - 15.5f) / 8.0f;
        v[0] = 4.0f * y;
        v[1] = -1.5f * (x[1] - 15.5f) / 8.0f;
        v[2] = 0.6f * (x[2] - 15.5f) / 8.0f;
    }
}

static springls_status swirled(springls_context *ctx, int steps)
{
    springls_forces forces = fixture_forces(swirl, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.25f);
    springls_params params = springls_get_params(ctx);
    springls_status status;
    params.lazy_distance = 0.0f;
    status = springls_set_params(ctx, &params);
    step.max_displacement = 1.0f;
    for (; steps > 0 && status == SPRINGLS_OK; steps--) status = springls_step(ctx, &step);
    return status;
}

/* The value that is the correspondence itself stays the correspondence, where springls are split and filled: blending is exact
   for linear functions of it. It is approximate at the rims, and where values merge. */
TEST blends_are_linear_in_the_correspondence(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    springls_view a, v;
    carried c;
    int i, k, newborn = 0, wrong = 0;
    double sum = 0.0, worst = 0.0;
    ASSERT_OK(carry(ctx, &c));
    ASSERT_OK(swirled(ctx, 24));
    a = springls_view_correspondences(ctx);
    v = springls_view_attribute(ctx, c.place);
    ASSERT_EQ(springls_count(ctx), v.count);
    for (i = 0; i < v.count; i++) {
        const float *p = (const float *)((const char *)a.data + (size_t)i * a.stride),
            *q = (const float *)((const char *)v.data + (size_t)i * v.stride);
        double d2 = 0.0;
        for (k = 0; k < 3; k++) d2 += ((double)p[k] - (double)q[k]) * ((double)p[k] - (double)q[k]);
        newborn += springls_generations(ctx)[i] > 0;
        sum += sqrt(d2);
        worst = fmax(worst, sqrt(d2));
        wrong += sqrt(d2) > 0.2;
    }
    ASSERT_GT(newborn, 200);
    ASSERT_LT(sum / v.count, 0.02);
    ASSERT_LT(wrong, v.count / 200);
    springls_destroy(ctx);
    PASS();
}

TEST amounts_last(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    carried c;
    double before;
    ASSERT_OK(carry(ctx, &c));
    before = total(ctx, c.amount);
    ASSERT_OK(swirled(ctx, 24));
    ASSERT_GT(springls_get_stats(ctx).split + springls_get_stats(ctx).added, 50);
    ASSERT_GT(springls_get_stats(ctx).removed, 20);
    ASSERT_IN_RANGE(before, total(ctx, c.amount), 1e-3 * before);
    springls_destroy(ctx);
    PASS();
}

/* Labels are never mixed, and wrong only next to the border between them. */
TEST labels_stay_labels(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    springls_view a, v;
    carried c;
    int i;
    ASSERT_OK(carry(ctx, &c));
    ASSERT_OK(swirled(ctx, 24));
    a = springls_view_correspondences(ctx);
    v = springls_view_attribute(ctx, c.label);
    for (i = 0; i < v.count; i++) {
        const float *p = (const float *)((const char *)a.data + (size_t)i * a.stride);
        float label = *(const float *)((const char *)v.data + (size_t)i * v.stride);
        ASSERT(label == 1.0f || label == 2.0f);
        if (fabs((double)p[0] - 15.5) > 1.0) ASSERT_EQ(label_of(p), label);
    }
    springls_destroy(ctx);
    PASS();
}

/* With attributes the model is the same to the last bit. */
TEST the_model_does_not_notice(int paper)
{
    springls_params params = paper ? springls_paper_params() : springls_default_params();
    springls_context *with = fixture_sphere(32, &params, 15.5f, 15.5f, 15.5f, 8.0f),
        *without = fixture_sphere(32, &params, 15.5f, 15.5f, 15.5f, 8.0f);
    carried c;
    ASSERT_OK(carry(with, &c));
    ASSERT_OK(swirled(with, 8));
    ASSERT_OK(swirled(without, 8));
    ASSERT_EQ(springls_state_hash(without), springls_state_hash(with));
    ASSERT_EQ(springls_count(with), springls_view_attribute(with, c.place).count);
    springls_destroy(with);
    springls_destroy(without);
    PASS();
}

/* `steps` steps of a wind of one unit of time each. */
static springls_status blown(springls_context *ctx, float x, float y, float z, int steps)
{
    float wind[3] = { x, y, z };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    return springls_run(ctx, &step, steps);
}

/* ---- split, fill, merge, one at a time ---- */

/* A mesh of large triangles that resample splits: labels copied, shares halved, correspondences blended. */
TEST halves_take_the_values_of_their_whole(void)
{
    springls_params params = springls_default_params();
    springls_context *ctx;
    springls_view a, place, amount;
    springls_provenance *confidence;
    carried c;
    int i, k, before, halves = 0;
    params.initial_stride = 2;
    params.split_edge = 1.0f;
    ctx = fixture_sphere(32, &params, 15.5f, 15.5f, 15.5f, 8.0f);
    ASSERT_OK(carry(ctx, &c));
    before = springls_count(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
    ASSERT_GT(springls_count(ctx), before + before / 2);
    ASSERT_IN_RANGE((double)before, total(ctx, c.amount), 1e-3);
    a = springls_view_correspondences(ctx);
    place = springls_view_attribute(ctx, c.place);
    amount = springls_view_attribute(ctx, c.amount);
    confidence = (springls_provenance *)malloc((size_t)springls_count(ctx) * sizeof *confidence);
    ASSERT_OK(springls_get_provenance(ctx, confidence));
    for (i = 0; i < springls_count(ctx); i++) {
        const float *p = (const float *)((const char *)a.data + (size_t)i * a.stride);
        /* a mean lies below the arc: here of two voxels */
        for (k = 0; k < 3; k++) ASSERT_IN_RANGE((double)p[k], (double)place.data[3 * i + k], 0.35);
        ASSERT(amount.data[i] == 1.0f || amount.data[i] == 0.5f);
        ASSERT_EQ(amount.data[i] == 0.5f, confidence[i].kind == SPRINGLS_KIND_SPLIT);
        ASSERT_EQ(amount.data[i] == 1.0f, confidence[i].kind == SPRINGLS_KIND_ORIGINAL);
        ASSERT_EQ(0, confidence[i].age);
        ASSERT_EQ(springls_generations(ctx)[i], confidence[i].generation);
        if (i < before) ASSERT_EQ(springls_ids(ctx)[i], confidence[i].parent);
        else ASSERT_LT(confidence[i].parent, (uint32_t)before);
        halves += amount.data[i] == 0.5f;
    }
    ASSERT_EQ(2 * (springls_count(ctx) - before), halves);
    free(confidence);
    springls_destroy(ctx);
    PASS();
}

/* A cap is cut out of a sphere: fill_gaps closes it, nothing is shared there, and the rest keeps what it has. */
TEST new_springls_take_values_from_nearby(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    springls_view amount, place;
    springls_provenance *confidence;
    carried c;
    uint8_t *keep = (uint8_t *)malloc((size_t)springls_count(ctx));
    int i, kept = 0, filled = 0;
    for (i = 0; i < springls_count(ctx); i++) kept += keep[i] = fixture_particle(ctx, i).z < 20.0f;
    ASSERT_OK(fixture_keep(ctx, keep));
    ASSERT_OK(carry(ctx, &c));
    for (i = 0; i < 6; i++) ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    ASSERT_GT(springls_count(ctx), kept + 50);
    ASSERT_IN_RANGE((double)kept, total(ctx, c.amount), 1e-3);
    amount = springls_view_attribute(ctx, c.amount);
    place = springls_view_attribute(ctx, c.place);
    confidence = (springls_provenance *)malloc((size_t)springls_count(ctx) * sizeof *confidence);
    ASSERT_OK(springls_get_provenance(ctx, confidence));
    for (i = 0; i < springls_count(ctx); i++) {
        ASSERT_EQ(i < kept ? SPRINGLS_KIND_ORIGINAL : SPRINGLS_KIND_FILLED, confidence[i].kind);
        ASSERT_EQ(i < kept ? 1.0f : 0.0f, amount.data[i]);
        if (i < kept) continue;
        ASSERT_LT(place.data[3 * i + 2], 20.0f); /* means of what is there do not run away */
        ASSERT_GT(place.data[3 * i + 2], 15.0f);
        filled++;
    }
    ASSERT_GT(filled, 50);
    free(confidence);
    free(keep);
    springls_destroy(ctx);
    PASS();
}

/* Every springl of a sphere twice: contract leaves one of each pair, with the sum, the mean, or what it had. */
TEST merged_springls_add_average_or_keep(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    springls_attribute_desc sum = { "sum", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_SHARE },
        mean = { "mean", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_BLEND },
                            own = { "own", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    springls_view v;
    float *values;
    int i, n, sums, means, owns;
    ASSERT_OK(springls_remesh(ctx)); /* so that none is too near another yet */
    n = springls_count(ctx);
    for (i = 0; i < n; i++) {
        springls__springl s = fixture_here(ctx)->set.s[i];
        fixture_add_at(ctx, s.q[0], s.q[1], s.q[2], s.p, ctx->model.set.a[i]);
    }
    values = (float *)malloc(2 * (size_t)n * sizeof *values);
    for (i = 0; i < 2 * n; i++) values[i] = i < n ? 1.0f : 3.0f;
    ASSERT_OK(springls_add_attribute(ctx, &sum, values, &sums));
    ASSERT_OK(springls_add_attribute(ctx, &mean, values, &means));
    ASSERT_OK(springls_add_attribute(ctx, &own, values, &owns));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_LTE(springls_count(ctx), n);
    ASSERT_GT(springls_count(ctx), n / 2);
    ASSERT_IN_RANGE(4.0 * n, total(ctx, sums), 1e-2 * n);
    v = springls_view_attribute(ctx, means);
    for (i = 0; i < v.count; i++) {
        ASSERT_GT(v.data[i], 1.5f);
        ASSERT_LT(v.data[i], 3.0f);
    }
    v = springls_view_attribute(ctx, owns);
    for (i = 0; i < v.count; i++) ASSERT(v.data[i] == 1.0f || v.data[i] == 3.0f);
    free(values);
    springls_destroy(ctx);
    PASS();
}

TEST confidence_ages(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    springls_provenance *confidence;
    int i, steps, young = 0;
    ASSERT_OK(swirled(ctx, 24));
    steps = springls_get_stats(ctx).steps;
    confidence = (springls_provenance *)malloc((size_t)springls_count(ctx) * sizeof *confidence);
    ASSERT_OK(springls_get_provenance(ctx, confidence));
    for (i = 0; i < springls_count(ctx); i++) {
        ASSERT_EQ(confidence[i].kind == SPRINGLS_KIND_ORIGINAL, springls_generations(ctx)[i] == 0);
        if (confidence[i].kind == SPRINGLS_KIND_ORIGINAL) ASSERT_EQ(steps, confidence[i].age);
        ASSERT_LTE(confidence[i].age, steps);
        young += confidence[i].age < steps / 2;
    }
    ASSERT_GT(young, 20);
    free(confidence);
    springls_destroy(ctx);
    PASS();
}

/* ---- the table ---- */

TEST the_table_is_checked_and_kept(void)
{
    springls_context *ctx = fixture_sphere(24, NULL, 11.5f, 11.5f, 11.5f, 5.0f);
    springls_attribute_desc desc = { "a", 2, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_SHARE }, out;
    char name[40];
    float *values = (float *)calloc((size_t)springls_count(ctx) * 2, sizeof *values);
    int index, i;
    ASSERT_EQ(0, springls_attribute_count(ctx));
    ASSERT_OK(springls_add_attribute(ctx, &desc, NULL, &index));
    ASSERT_EQ(0, index);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_add_attribute(ctx, &desc, NULL, &index)); /* the same name */
    ASSERT_EQ(-1, index);
    ASSERT_OK(springls_describe_attribute(ctx, 0, &out));
    ASSERT_STR_EQ("a", out.name);
    ASSERT_EQ(2, out.channels);
    ASSERT_EQ(SPRINGLS_POLICY_COPY, out.split);
    ASSERT_EQ(SPRINGLS_POLICY_BLEND, out.fill);
    ASSERT_EQ(SPRINGLS_POLICY_SHARE, out.merge);
    ASSERT_EQ(2 * sizeof(float), springls_view_attribute(ctx, 0).stride);
    ASSERT_EQ(0.0f, springls_view_attribute(ctx, 0).data[1]);
    values[1] = 4.0f;
    ASSERT_OK(springls_set_attribute(ctx, 0, values));
    ASSERT_EQ(4.0f, springls_view_attribute(ctx, 0).data[1]);
    values[0] = NAN;
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_set_attribute(ctx, 0, values));
    ASSERT_EQ(4.0f, springls_view_attribute(ctx, 0).data[1]);
    ASSERT_OK(springls_set_attribute(ctx, 0, NULL));
    ASSERT_EQ(0.0f, springls_view_attribute(ctx, 0).data[1]);
    desc.name = "b";
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_add_attribute(ctx, &desc, values, NULL));
    desc.channels = 0;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_add_attribute(ctx, &desc, NULL, NULL));
    desc.channels = SPRINGLS_MAX_CHANNELS + 1;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_add_attribute(ctx, &desc, NULL, NULL));
    desc.channels = 1;
    desc.fill = (springls_policy)7;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_add_attribute(ctx, &desc, NULL, NULL));
    desc.fill = SPRINGLS_POLICY_COPY;
    desc.name = "";
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_add_attribute(ctx, &desc, NULL, NULL));
    desc.name = "a name of more than thirty-one letters";
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_add_attribute(ctx, &desc, NULL, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_add_attribute(ctx, NULL, NULL, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_add_attribute(NULL, &desc, NULL, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_remove_attribute(ctx, 1));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_attribute(ctx, -1, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_describe_attribute(ctx, 1, &out));
    ASSERT_EQ(NULL, springls_view_attribute(ctx, 5).data);
    ASSERT_EQ(-1, springls_find_attribute(ctx, "b"));
    ASSERT_EQ(-1, springls_find_attribute(NULL, "a"));
    desc.name = name;
    for (i = 1; i < SPRINGLS_MAX_ATTRIBUTES; i++) {
        snprintf(name, sizeof name, "n%d", i);
        ASSERT_OK(springls_add_attribute(ctx, &desc, NULL, NULL));
    }
    snprintf(name, sizeof name, "one more");
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_add_attribute(ctx, &desc, NULL, NULL));
    ASSERT_OK(springls_remove_attribute(ctx, 0));
    ASSERT_EQ(0, springls_find_attribute(ctx, "n1"));
    ASSERT_OK(springls_add_attribute(ctx, &desc, NULL, &index));
    ASSERT_EQ(SPRINGLS_MAX_ATTRIBUTES - 1, index);
    ASSERT_OK(springls_reset(ctx));
    ASSERT_EQ(0, springls_attribute_count(ctx));
    free(values);
    springls_destroy(ctx);
    PASS();
}

/* ---- material coordinates and seams ---- */

enum { RINGS = 26, SLICES = 52, POINTS = (RINGS - 1) * SLICES + 2, TRIANGLES = 2 * (RINGS - 1) * SLICES };

static float globe_points[3 * POINTS], globe_uv[6 * TRIANGLES];
static int globe[3 * TRIANGLES], globe_count;

static int globe_at(int ring,
                    int slice) { return ring == 0 ? 0 : ring == RINGS ? POINTS - 1 : 1 + (ring - 1) * SLICES + slice % SLICES; }

static void globe_triangle(const int ring[3], const int slice[3])
{
    int k;
    for (k = 0; k < 3; k++) {
        globe[3 * globe_count + k] = globe_at(ring[k], slice[k]);
        globe_uv[6 * globe_count + 2 * k] = (float)slice[k] / SLICES;
        globe_uv[6 * globe_count + 2 * k + 1] = (float)ring[k] / RINGS;
    }
    globe_count++;
}

/* A ball of rings and slices, in texture coordinates a rectangle: u = 0 and u = 1 are the seam. */
static springls_status set_globe(springls_context *ctx)
{
    int r, s;
    globe_count = 0;
    for (r = 0; r <= RINGS; r++)
        for (s = 0; s < SLICES; s++) {
            double polar = fixture_pi * r / RINGS, around = 2.0 * fixture_pi * s / SLICES;
            float *p = globe_points + 3 * globe_at(r, s);
            p[0] = (float)(15.7 + 8.5 * sin(polar) * cos(around));
            p[1] = (float)(15.3 + 8.5 * sin(polar) * sin(around));
            p[2] = (float)(15.6 + 8.5 * cos(polar));
        }
    for (r = 0; r < RINGS; r++)
        for (s = 0; s < SLICES; s++) {
            int upper[3] = { r, r + 1, r + 1 }, lower[3] = { r, r + 1, r }, one[3] = { s, s, s + 1 },
                two[3] = { s, s + 1, s + 1 };
            if (r < RINGS - 1) globe_triangle(upper, one);
            if (r > 0) globe_triangle(lower, two);
        }
    return springls_set_mesh(ctx, globe_points, POINTS, 0, globe, globe_count, NULL);
}

TEST seams_are_found(void)
{
    springls_context *ctx = fixture_context(32, NULL);
    int *neighbors = (int *)malloc(3 * TRIANGLES * sizeof *neighbors), i, k, open = 0;
    ASSERT_OK(set_globe(ctx));
    ASSERT_EQ(TRIANGLES, globe_count);
    ASSERT_OK(springls_find_seams(ctx, globe_points, POINTS, 0, globe, globe_count, NULL, 0, neighbors));
    for (i = 0; i < 3 * globe_count; i++) ASSERT_GTE(neighbors[i], 0); /* as a surface it is closed */
    ASSERT_OK(springls_find_seams(ctx, globe_points, POINTS, 0, globe, globe_count, globe_uv, 2, neighbors));
    for (i = 0; i < globe_count; i++)
        for (k = 0; k < 3; k++) {
            float u = globe_uv[6 * i + 2 * k], next = globe_uv[6 * i + 2 * ((k + 1) % 3)];
            bool on_seam = (u == 0.0f && next == 0.0f) || (u == 1.0f && next == 1.0f),
                at_pole = globe_uv[6 * i + 2 * k + 1] == 0.0f
                        || globe_uv[6 * i + 2 * k + 1] == 1.0f || globe_uv[6 * i + 2 * ((k + 1) % 3) + 1] == 0.0f
                            || globe_uv[6 * i + 2 * ((k + 1) % 3) + 1] == 1.0f;
            if (!at_pole) ASSERT_EQ(on_seam, neighbors[3 * i + k] < 0);
            open += neighbors[3 * i + k] < 0;
        }
    ASSERT_GTE(open, 2 * (RINGS - 2));
    ASSERT_STATUS(SPRINGLS_BAD_MESH,
                  springls_find_seams(ctx, globe_points, POINTS - 1, 0, globe, globe_count, NULL, 0, neighbors));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_find_seams(ctx, NULL, POINTS, 0, globe, globe_count, NULL, 0, neighbors));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT,
                  springls_find_seams(ctx, globe_points, POINTS, 0, globe, globe_count, NULL, 2, neighbors));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT,
                  springls_find_seams(ctx, globe_points, POINTS, 3, globe, globe_count, NULL, 0, neighbors));
    free(neighbors);
    springls_destroy(ctx);
    PASS();
}

/* After some motion: places on the original are where the motion has come from, texture coordinates of every triangle lie on
   one side of the seam, and in its middle they are right. */
TEST textures_keep_their_seam(void)
{
    springls_context *ctx = fixture_context(32, NULL);
    springls_mesh mesh;
    springls_material *places, *corners;
    float *at, *uv;
    int *neighbors = (int *)malloc(3 * TRIANGLES * sizeof *neighbors), i, k, across = 0, torn = 0;
    double sum = 0.0;
    const d3 center = d3_make(15.7, 15.3, 15.6), moved = d3_make(1.7, 1.1, -0.6);
    ASSERT_OK(set_globe(ctx));
    ASSERT_EQ(globe_count, springls_material_triangle_count(ctx));
    ASSERT_OK(springls_find_seams(ctx, globe_points, POINTS, 0, globe, globe_count, globe_uv, 2, neighbors));
    ASSERT_OK(blown(ctx, 0.34f, 0.22f, -0.12f, 5));
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    places = (springls_material *)malloc((size_t)mesh.vertex_count * sizeof *places);
    corners = (springls_material *)malloc((size_t)mesh.triangle_count * 3 * sizeof *corners);
    at = (float *)malloc((size_t)mesh.vertex_count * 3 * sizeof *at);
    uv = (float *)malloc((size_t)mesh.triangle_count * 6 * sizeof *uv);
    ASSERT_OK(springls_mesh_materials(ctx, &mesh, places));
    ASSERT_OK(springls_interpolate_material(places, mesh.vertex_count, globe_points, 3, globe, globe_count, at));
    for (i = 0; i < mesh.vertex_count; i++) {
        d3 x = d3_sub(d3_make((double)mesh.positions[3 * i], (double)mesh.positions[3 * i + 1],
                              (double)mesh.positions[3 * i + 2]), moved);
        double off = d3_distance(x, d3_make((double)at[3 * i], (double)at[3 * i + 1], (double)at[3 * i + 2]));
        ASSERT_LT(off, 0.5);
        sum += off;
    }
    ASSERT_LT(sum / mesh.vertex_count, 0.03);
    ASSERT_OK(springls_corner_materials(ctx, &mesh, neighbors, corners));
    ASSERT_OK(springls_interpolate_material(corners, 3 * mesh.triangle_count, globe_uv, 2, NULL, globe_count, uv));
    for (i = 0; i < mesh.triangle_count; i++) {
        d3 x = d3_make(0.0, 0.0, 0.0);
        double u = 0.0, v = 0.0, exact, off, lowest = 2.0, highest = -1.0;
        for (k = 0; k < 3; k++) {
            const float *p = mesh.positions + 3 * mesh.triangles[3 * i + k];
            x = d3_add(x, d3_scale(d3_make((double)p[0], (double)p[1], (double)p[2]), 1.0 / 3.0));
            u += (double)uv[6 * i + 2 * k] / 3.0;
            v += (double)uv[6 * i + 2 * k + 1] / 3.0;
            lowest = fmin(lowest, (double)uv[6 * i + 2 * k]);
            highest = fmax(highest, (double)uv[6 * i + 2 * k]);
        }
        x = d3_sub(d3_sub(x, moved), center);
        if (v < 0.08 || v > 0.92) continue; /* where all meridians meet */
        exact = atan2(x.y, x.x) / (2.0 * fixture_pi);
        if (exact < 0.0) exact += 1.0;
        off = fabs(u - exact);
        ASSERT_LT(fmin(off, 1.0 - off) * 2.0 * fixture_pi * 8.5 * sin(fixture_pi * v), 0.6); /* half a triangle at the seam */
        torn += highest - lowest > 0.5;
        across += fmin(exact, 1.0 - exact) < 0.01;
    }
    ASSERT_EQ(0, torn);
    ASSERT_GT(across, 20);
    neighbors[5] = TRIANGLES;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_corner_materials(ctx, &mesh, neighbors, corners));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_corner_materials(ctx, &mesh, NULL, corners));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_mesh_materials(ctx, NULL, places));
    places[0].triangle = globe_count;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_interpolate_material(places, 1, globe_points, 3, globe, globe_count, at));
    free(neighbors);
    free(places);
    free(corners);
    free(at);
    free(uv);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* Every third vertex of every fifth chunk has the values of the vertex of the mesh at its place, 3 a vertex. Chunks are listed again
   where springls have got other values. */
TEST chunks_have_values_of(springls_context *ctx, const springls_mesh *mesh, int attribute, const float *of_mesh)
{
    const springls_chunks_desc desc = { .tolerance = -1.0f, .correspondences = true }, without = { .tolerance = -1.0f };
    const springls_view view = springls_view_attribute(ctx, attribute);
    const springls_chunk *changed;
    springls_chunks *chunks, *bare;
    float *values = (float *)malloc((size_t)view.count * 3 * sizeof *values), *out;
    int i, v, w, count, found = 0;
    ASSERT_OK(springls_chunks_create(ctx, &desc, &chunks));
    ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &count));
    for (i = 0; i < count; i += 5) {
        out = (float *)malloc((size_t)changed[i].vertex_count * 3 * sizeof *out);
        ASSERT_OK(springls_chunk_attribute(ctx, &changed[i], attribute, out));
        for (v = 0; v < changed[i].vertex_count; v += 3)
            for (w = 0; w < mesh->vertex_count; w++) {
                if (memcmp(changed[i].positions + 3 * v, mesh->positions + 3 * w, 12) != 0) continue;
                ASSERT(memcmp(out + 3 * v, of_mesh + 3 * w, 12) == 0);
                found++;
            }
        free(out);
    }
    ASSERT_GT(found, 50);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunk_attribute(NULL, changed, attribute, values));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunk_attribute(ctx, changed, 9, values));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunk_attribute(ctx, NULL, attribute, values));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunk_attribute(ctx, changed, attribute, NULL));
    memcpy(values, view.data, (size_t)view.count * 3 * sizeof *values);
    values[0] += 1.0f;
    ASSERT_OK(springls_set_attribute(ctx, attribute, values));
    ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &count));
    ASSERT_IN_RANGE(4.5, (double)count, 3.5); /* the springl's brick and some around */
    ASSERT_OK(springls_chunks_create(ctx, &without, &bare));
    ASSERT_OK(springls_chunks_update(ctx, bare, &changed, &count));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunk_attribute(ctx, changed, attribute, values));
    springls_chunks_destroy(ctx, bare);
    springls_chunks_destroy(ctx, chunks);
    free(values);
    PASS();
}

/* On vertices, by either contouring: a blended attribute that is the correspondence is the vertex's correspondence, a label one of the
   labels. */
TEST vertices_have_the_values_of_springls(springls_contouring contouring)
{
    springls_params params = springls_default_params();
    springls_context *ctx;
    springls_mesh mesh;
    carried c;
    float *place, *label;
    double sum = 0.0;
    int i, k, wrong = 0;
    params.contouring = contouring;
    ctx = fixture_sphere(32, &params, 15.5f, 15.5f, 15.5f, 8.0f);
    ASSERT_OK(carry(ctx, &c));
    ASSERT_OK(blown(ctx, 0.5f, 0.2f, 0.1f, 2));
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    place = (float *)malloc((size_t)mesh.vertex_count * 3 * sizeof *place);
    label = (float *)malloc((size_t)mesh.vertex_count * sizeof *label);
    ASSERT_OK(springls_mesh_attribute(ctx, &mesh, c.place, place));
    ASSERT_OK(springls_mesh_attribute(ctx, &mesh, c.label, label));
    for (i = 0; i < mesh.vertex_count; i++) {
        double off = 0.0;
        for (k = 0; k < 3; k++) off = fmax(off, fabs((double)mesh.correspondences[3 * i + k] - (double)place[3 * i + k]));
        sum += off;
        wrong += off > 0.1;
        ASSERT(label[i] == 1.0f || label[i] == 2.0f);
    }
    ASSERT_LT(sum / mesh.vertex_count, 0.01);
    ASSERT_LT(wrong, mesh.vertex_count / 100);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_mesh_attribute(ctx, &mesh, 9, place));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_mesh_attribute(ctx, NULL, c.place, place));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_mesh_attribute(ctx, &mesh, c.place, NULL));
    CHECK_CALL(chunks_have_values_of(ctx, &mesh, c.place, place));
    free(place);
    free(label);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* ---- memory ---- */

/* Whichever allocation fails, attributes and springls stay in step, and all memory comes back. */
static greatest_test_res starve(int fail_at, int *failed)
{
    springls_desc desc = fixture_desc(24, NULL);
    springls_sphere ball = fixture_ball(11.5f, 11.5f, 11.5f, 5.0f);
    springls_params params = springls_default_params();
    springls_context *ctx;
    springls_mesh mesh;
    fixture_heap heap;
    carried c;
    float *out;
    int i, starved = 0;
    params.split_edge = 1.2f;
    params.resample_period = 1;
    desc.params = &params;
    desc.allocator = fixture_allocator(&heap);
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    heap.fail_at = heap.calls + fail_at;
    starved += carry(ctx, &c) == SPRINGLS_OUT_OF_MEMORY;
    for (i = 0; i < 3; i++) {
        springls_status status = i == 1 ? springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE) : swirled(ctx, 2);
        ASSERT(status == SPRINGLS_OK || status == SPRINGLS_OUT_OF_MEMORY);
        starved += status == SPRINGLS_OUT_OF_MEMORY;
        if (springls_attribute_count(ctx) > 0) {
            ASSERT_EQ(springls_count(ctx), springls_view_attribute(ctx, 0).count);
            ASSERT_GTE(ctx->attributes[0].values.bytes, (size_t)springls_count(ctx) * 3 * sizeof(float));
        }
    }
    if (springls_extract_mesh(ctx, &mesh) == SPRINGLS_OK) {
        out = (float *)malloc((size_t)(mesh.vertex_count + 1) * 3 * sizeof *out);
        if (springls_attribute_count(ctx) > 0) starved += springls_mesh_attribute(ctx, &mesh, 0, out) == SPRINGLS_OUT_OF_MEMORY;
        free(out);
    } else {
        starved++;
    }
    springls_mesh_free(ctx, &mesh);
    *failed = heap.calls > heap.fail_at;
    if (*failed) ASSERT_EQ(1, starved);
    else ASSERT_EQ(0, starved);
    ASSERT_EQ(heap.bytes, springls_memory_used(ctx));
    springls_destroy(ctx);
    ASSERT_EQ(0, heap.blocks);
    ASSERT_EQ(0, heap.wrong_sizes);
    PASS();
}

TEST every_allocation_may_fail(void)
{
    int fail_at, failed = 1;
    for (fail_at = 0; failed; fail_at++) CHECK_CALL(starve(fail_at, &failed));
    ASSERT_GT(fail_at, 20);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(blends_are_linear_in_the_correspondence);
    RUN_TEST(amounts_last);
    RUN_TEST(labels_stay_labels);
    RUN_TESTp(the_model_does_not_notice, 0);
    RUN_TESTp(the_model_does_not_notice, 1);
    RUN_TEST(halves_take_the_values_of_their_whole);
    RUN_TEST(new_springls_take_values_from_nearby);
    RUN_TEST(merged_springls_add_average_or_keep);
    RUN_TEST(confidence_ages);
    RUN_TEST(the_table_is_checked_and_kept);
    RUN_TEST(seams_are_found);
    RUN_TEST(textures_keep_their_seam);
    RUN_TESTp(vertices_have_the_values_of_springls, SPRINGLS_CONTOURING_LEVEL_SET);
    RUN_TESTp(vertices_have_the_values_of_springls, SPRINGLS_CONTOURING_SPRINGLS);
    RUN_TEST(every_allocation_may_fail);
    GREATEST_MAIN_END();
}
