/* test_attributes.c - what springls carry: exact for linear functions, conserved where it is shared, in step with the springls whatever
   happens, and without any effect on them; material coordinates, on one side of every seam. */
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
    springls_attribute_desc place = { "place", 3, SPRINGLS_BLEND, SPRINGLS_BLEND, SPRINGLS_COPY };
    springls_attribute_desc label = { "label", 1, SPRINGLS_COPY, SPRINGLS_COPY, SPRINGLS_COPY };
    springls_attribute_desc amount = { "amount", 1, SPRINGLS_SHARE, SPRINGLS_SHARE, SPRINGLS_SHARE };
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

/* A shear that grows and folds the sphere: splits, fills and merges at every resampling. */
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
    springls_step_desc step = fixture_step(&forces, SPRINGLS_FLUID, 0.25f);
    springls_status status = SPRINGLS_OK;
    step.max_displacement = 1.0f;
    for (; steps > 0 && status == SPRINGLS_OK; steps--) status = springls_step(ctx, &step);
    return status;
}

/* The value that is the correspondence itself stays the correspondence, where springls are split and filled: blending is exact for
   linear functions of it. It is approximate at the rims, and where values merge. */
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
        const float *p = (const float *)((const char *)a.data + (size_t)i * a.stride), *q = (const float *)((const char *)v.data + (size_t)i * v.stride);
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
    ASSERT_GT(springls_get_stats(ctx).split, 20);
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
    springls_context *with = fixture_sphere(32, &params, 15.5f, 15.5f, 15.5f, 8.0f), *without = fixture_sphere(32, &params, 15.5f, 15.5f, 15.5f, 8.0f);
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

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(blends_are_linear_in_the_correspondence);
    RUN_TEST(amounts_last);
    RUN_TEST(labels_stay_labels);
    RUN_TESTp(the_model_does_not_notice, 0);
    RUN_TESTp(the_model_does_not_notice, 1);
    GREATEST_MAIN_END();
}
