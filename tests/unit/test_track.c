/* test_track.c - correspondences (section 4.7): projection on the original surface, and the rule for new springls. */
#include "fixtures.h"
#include "../../src/model/cell_bricks.h"
#include "../../kernels_embed/stages/track.h"

static const d3 center = { 15.5, 15.5, 15.5 };

/* Each projection of eq. 26 leaves (1 - lambda) of the distance to the original surface, along its normal; four with
   lambda = 1/2 leave a sixteenth. */
TEST projection_converges(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    int i, count;
    p.initial_stride = 1;
    p.project_initial = 1;
    ctx = fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, 10.0f);
    count = springls_count(ctx);
    fixture_seed(71);
    fixture_here(ctx);
    for (i = 0; i < count; i++) {
        d3 n = d3_sub(d3_of(ctx->model.set.a[i]), center);
        double off = (double)fixture_between(-1.5f, 1.5f);
        ctx->model.set.a[i] = d3_float(d3_mad(center, n, (10.0 + off) / d3_length(n)));
    }
    for (i = 0; i < count; i++) { /* one step, then the stage */
        springls__v3 a = ctx->model.set.a[i];
        double off = d3_distance(d3_of(a), center) - 10.0;
        d3 direction = d3_sub(d3_of(a), center);
        ctx->model.set.a[i] = springls__project_on_original(&ctx->model, a);
        ASSERT_IN_RANGE(off / 16.0, d3_distance(d3_of(ctx->model.set.a[i]), center) - 10.0, 0.06);
        ASSERT_GT(d3_dot(direction, d3_sub(d3_of(ctx->model.set.a[i]), center)) / d3_length(direction)
                      / d3_distance(d3_of(ctx->model.set.a[i]), center),
                  0.9995);
    }
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
    for (i = 0; i < count; i++) ASSERT_IN_RANGE(10.0, d3_distance(d3_of(fixture_origin(ctx, i)), center), 0.03);
    springls_destroy(ctx);
    PASS();
}

/* The original surface is the one that was set last, wherever the model has gone since. */
TEST reference_is_what_was_set(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 13.5f, 15.5f, 15.5f, 8.0f);
    int i;
    ASSERT_OK(fixture_translate(ctx, 4.0f, 0.0f, 0.0f));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    for (i = 0; i < springls_count(ctx); i++) {
        springls__v3 *a = &fixture_here(ctx)->set.a[i];
        *a = springls__add(*a, springls__v3_make(0.0f, 0.0f, 0.5f));
    }
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
    for (i = 0; i < springls_count(ctx); i++)
        ASSERT_IN_RANGE(8.0, d3_distance(d3_of(fixture_origin(ctx, i)), d3_make(13.5, 15.5, 15.5)), 0.1);
    for (i = 0; i < 6; i++) {
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    }
    ASSERT_OK(springls_set_reference(ctx));
    for (i = 0; i < springls_count(ctx); i++) {
        springls__v3 a = fixture_origin(ctx, i), p = fixture_particle(ctx, i);
        ASSERT_MEM_EQ(&p, &a, sizeof a);
        fixture_here(ctx)->set.a[i] = springls__add(a, springls__v3_make(0.0f, 0.5f, 0.0f));
    }
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
    for (i = 0; i < springls_count(ctx); i++) { /* onto the zero level as it is now, four voxels further */
        springls__v3 a = fixture_origin(ctx, i);
        const springls__grid *g = &fixture_here(ctx)->grid;
        float d = springls__grid_sample_smooth(g, g->phi, a); /* the zero that eq. 26 steps to */
        ASSERT_IN_RANGE(0.0, d, 0.08); /* a sixteenth of a voxel, and interpolation */
        ASSERT_IN_RANGE(8.0, d3_distance(d3_of(a), d3_make(17.5, 15.5, 15.5)), 0.5);
    }
    springls_destroy(ctx);
    PASS();
}

/* A flat field of springls at z = 15.5 with given correspondences, and one new springl among them. */
static springls_context *field(const springls_params *p, int *fresh)
{
    springls_context *ctx = fixture_context(32, p);
    int x, y;
    for (y = 0; y < 5; y++)
        for (x = 0; x < 5; x++)
            if (x != 2 || y != 2)
                fixture_add(ctx, springls__v3_make((float)x + 10.0f, (float)y + 10.0f, 15.5f),
                            springls__v3_make((float)x + 10.8f, (float)y + 10.0f, 15.5f),
                            springls__v3_make((float)x + 10.0f, (float)y + 10.8f, 15.5f));
    *fresh = fixture_add(ctx, springls__v3_make(12.0f, 12.0f, 15.5f), springls__v3_make(12.8f, 12.0f, 15.5f),
                         springls__v3_make(12.0f, 12.8f, 15.5f));
    return ctx;
}

/* A new springl takes the average of its neighbours' correspondences within R; the nearest neighbour's when that is
   further than nearest_rule from the average; and those of springls that are new as well count for nothing. */
TEST new_springls_take_their_neighbours_average(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    springls__v3 a;
    d3 mean = d3_make(0.0, 0.0, 0.0), nearest_a = mean;
    double nearest = DBL_MAX;
    int fresh, i, m, n = 0, beside;
    ctx = field(&p, &fresh);
    fixture_seed(72);
    for (i = 0; i < fresh; i++)
        fixture_here(ctx)->set.a[i] = springls__add(springls__v3_make(5.0f, 6.0f, 7.0f), fixture_point(-0.5f, 0.5f));
    ASSERT_OK(fixture_stage(ctx, springls__cell_list_cover));
    for (i = 0; i < fresh; i++) { /* within R: some vertex or the particle is that close to the other's triangle */
        fixture_springl s = fixture_get(ctx, i), f = fixture_get(ctx, fresh);
        double d = DBL_MAX;
        d3 t[3];
        for (m = 0; m < 3; m++) t[m] = d3_of(s.q[m]);
        for (m = 0; m < 4; m++) d = fmin(d, d3_triangle_distance(t, d3_of(m < 3 ? f.q[m] : f.p)));
        if (d < nearest) {
            nearest = d;
            nearest_a = d3_of(s.a);
        }
        if (d > 0.6) continue;
        mean = d3_add(mean, d3_of(s.a));
        n++;
    }
    ASSERT_GT(n, 2);
    a = springls__correspondence_of_neighbors(&ctx->model, ctx->model.set.s[fresh], fresh, &beside);
    ASSERT_LT(d3_distance(d3_scale(mean, 1.0 / n), d3_of(a)), 1e-5);
    ctx->model.params.nearest_rule = 1e-4f; /* any average is too far now */
    a = springls__correspondence_of_neighbors(&ctx->model, ctx->model.set.s[fresh], fresh, &beside);
    ASSERT_LT(d3_distance(nearest_a, d3_of(a)), 1e-5);
    springls_destroy(ctx);
    PASS();
}

/* Where nobody is within R the range doubles until somebody is. */
TEST the_range_grows(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx = fixture_context(32, &p);
    springls__v3 a;
    int beside;
    fixture_add(ctx, springls__v3_make(5.0f, 5.0f, 5.0f), springls__v3_make(6.0f, 5.0f, 5.0f), springls__v3_make(5.0f, 6.0f, 5.0f));
    fixture_add(ctx, springls__v3_make(12.0f, 5.0f, 5.0f), springls__v3_make(13.0f, 5.0f, 5.0f),
                springls__v3_make(12.0f, 6.0f, 5.0f));
    ctx->model.set.a[0] = springls__v3_make(1.0f, 2.0f, 3.0f);
    ASSERT_OK(fixture_stage(ctx, springls__cell_list_cover));
    a = springls__correspondence_of_neighbors(&ctx->model, ctx->model.set.s[1], 1, &beside);
    ASSERT_EQ(0, beside);
    ASSERT_EQ(1.0f, a.x);
    ASSERT_EQ(2.0f, a.y);
    ASSERT_EQ(3.0f, a.z);
    springls_destroy(ctx);
    PASS();
}

SUITE(track)
{
    RUN_TEST(projection_converges);
    RUN_TEST(reference_is_what_was_set);
    RUN_TEST(new_springls_take_their_neighbours_average);
    RUN_TEST(the_range_grows);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(track);
    GREATEST_MAIN_END();
}
