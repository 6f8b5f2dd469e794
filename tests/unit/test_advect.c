/* test_advect.c - moving springls (section 4.2): orders of accuracy, time sampling, every kind of force. */
#include "fixtures.h"

/* A few springls far from each other. */
static springls_context *few(const springls_params *params, int count)
{
    springls_context *ctx = fixture_context(32, params);
    fixture_seed(41);
    fixture_random_soup(ctx, count, 6.0f, 26.0f, 1.0f);
    return ctx;
}

static springls_params vertices_move(int own)
{
    springls_params p = springls_paper_params();
    p.vertex_velocity = own;
    return p;
}

static d3 rotation_exact(d3 x, double angle)
{
    d3 center = d3_make(16.0, 15.0, 14.0), axis = d3_make(1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0);
    return d3_add(center, d3_rotate(d3_sub(x, center), d3_scale(axis, angle)));
}

/* Largest error of all points after turning by one radian in n steps. */
static double rotation_error(int steps, springls_integrator integrator)
{
    springls_params p = vertices_move(1);
    springls_context *ctx = few(&p, 30);
    struct exact_flow flow = EXACT_ROTATION(16.0f, 15.0f, 14.0f, 1.0f, 2.0f, 2.0f, 1.0f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    fixture_springl *start = fixture_copy(ctx);
    double worst = 0.0;
    int i, m;
    forces.integrator = integrator;
    for (i = 0; i < steps; i++) springls_advect(ctx, &forces, (float)i / (float)steps, 1.0f / (float)steps);
    for (i = 0; i < 30; i++)
        for (m = 0; m < 4; m++) {
            d3 exact = rotation_exact(d3_of(m < 3 ? start[i].q[m] : start[i].p), 1.0);
            double e = d3_distance(exact, d3_of(m < 3 ? fixture_vertex(ctx, i, m) : fixture_particle(ctx, i)));
            if (e > worst) worst = e;
        }
    free(start);
    springls_destroy(ctx);
    return worst;
}

/* Halving the step divides the error of a rotation by 16 with Runge-Kutta, by 2 with Euler. */
TEST rotation_has_its_order(void)
{
    double order = log2(rotation_error(1, SPRINGLS_INTEGRATOR_RK4) / rotation_error(2, SPRINGLS_INTEGRATOR_RK4));
    ASSERT_IN_RANGE(4.0, order, 0.35);
    order = log2(rotation_error(2, SPRINGLS_INTEGRATOR_RK4) / rotation_error(4, SPRINGLS_INTEGRATOR_RK4));
    ASSERT_IN_RANGE(4.0, order, 0.35);
    order = log2(rotation_error(16, SPRINGLS_INTEGRATOR_EULER) / rotation_error(32, SPRINGLS_INTEGRATOR_EULER));
    ASSERT_IN_RANGE(1.0, order, 0.1);
    ASSERT_LT(rotation_error(16, SPRINGLS_INTEGRATOR_RK4), 2e-5);
    PASS();
}

/* LeVeque's flow in double precision: u of section 5.2, x = voxel / n, in voxels. */
static d3 deformation(d3 v, double n, double period, double t)
{
    double x = fixture_pi * v.x / n, y = fixture_pi * v.y / n, z = fixture_pi * v.z / n, s = n * cos(fixture_pi * t / period);
    return d3_make(2.0 * sin(x) * sin(x) * sin(2.0 * y) * sin(2.0 * z) * s, -sin(2.0 * x) * sin(y) * sin(y) * sin(2.0 * z) * s,
                   -sin(2.0 * x) * sin(2.0 * y) * sin(z) * sin(z) * s);
}

static d3 deformation_exact(d3 x, double n, double period, double from, double to)
{
    const int steps = 400;
    double h = (to - from) / steps;
    int i;
    for (i = 0; i < steps; i++) {
        double t = from + h * i;
        d3 k1 = deformation(x, n, period, t), k2 = deformation(d3_mad(x, k1, 0.5 * h), n, period, t + 0.5 * h);
        d3 k3 = deformation(d3_mad(x, k2, 0.5 * h), n, period, t + 0.5 * h), k4 = deformation(d3_mad(x, k3, h), n, period, t + h);
        x = d3_mad(x, d3_add(d3_add(k1, k4), d3_scale(d3_add(k2, k3), 2.0)), h / 6.0);
    }
    return x;
}

static double deformation_error(int steps)
{
    springls_params p = vertices_move(1);
    springls_context *ctx = few(&p, 40);
    struct exact_flow flow = EXACT_DEFORMATION(32.0f, 1.5f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    fixture_springl *start = fixture_copy(ctx);
    const float from = 0.2f, to = 0.8f;
    double sum = 0.0;
    int i;
    for (i = 0; i < steps; i++)
        springls_advect(ctx, &forces, from + (to - from) * (float)i / (float)steps, (to - from) / (float)steps);
    for (i = 0; i < 40; i++) {
        sum +=
            d3_distance(deformation_exact(d3_of(start[i].p), 32.0, 1.5, (double)from, (double)to), d3_of(fixture_particle(ctx, i)));
        sum += d3_distance(deformation_exact(d3_of(start[i].q[1]), 32.0, 1.5, (double)from, (double)to),
                           d3_of(fixture_vertex(ctx, i, 1)));
    }
    free(start);
    springls_destroy(ctx);
    return sum / 80.0;
}

/* The same for LeVeque's unsteady deformation: fourth order in time only if time is sampled at t, t + dt/2, t + dt. */
TEST deformation_has_its_order(void)
{
    double order = log2(deformation_error(4) / deformation_error(8));
    ASSERT_IN_RANGE(4.0, order, 0.5);
    order = log2(deformation_error(8) / deformation_error(16));
    ASSERT_IN_RANGE(4.0, order, 0.5);
    ASSERT_LT(deformation_error(64), 2e-5);
    PASS();
}

/* The flows with exact answers are the formulas, in double precision. */
TEST flows_are_the_formulas(void)
{
    struct exact_flow wave = EXACT_DEFORMATION(40.0f, 3.0f);
    struct exact_flow turn = EXACT_ROTATION(3.0f, 4.0f, 5.0f, 0.0f, 0.0f, 2.5f, 0.7f);
    int i;
    fixture_seed(42);
    for (i = 0; i < 2000; i++) {
        springls__v3 x = fixture_point(0.0f, 40.0f);
        float t = fixture_between(0.0f, 3.0f), u[3];
        exact_flow_velocity(&wave, &x.x, 1, t, u);
        ASSERT_LT(d3_distance(deformation(d3_of(x), 40.0, 3.0, (double)t), d3_make((double)u[0], (double)u[1], (double)u[2])),
                  1e-4);
        exact_flow_velocity(&turn, &x.x, 1, t, u); /* the axis needs no length */
        ASSERT_LT(d3_distance(d3_make(-0.7 * ((double)x.y - 4.0), 0.7 * ((double)x.x - 3.0), 0.0),
                              d3_make((double)u[0], (double)u[1], (double)u[2])),
                  1e-5);
    }
    PASS();
}

/* ---- time ---- */

typedef struct clockwork { float times[8]; int calls; float c[4]; } clockwork;

/* Along x: c0 + c1 t + c2 t^2 + c3 t^3. */
static void polynomial_wind(void *user, const float *points, int count, float time, float *out)
{
    clockwork *clock_of = (clockwork *)user;
    int i;
    (void)points;
    if (clock_of->calls < 8) clock_of->times[clock_of->calls] = time;
    clock_of->calls++;
    for (i = 0; i < count; i++) {
        out[3 * i] = clock_of->c[0] + time * (clock_of->c[1] + time * (clock_of->c[2] + time * clock_of->c[3]));
        out[3 * i + 1] = out[3 * i + 2] = 0.0f;
    }
}

/* Time is sampled at t, t + dt/2 twice, t + dt, so that a velocity cubic in time is integrated exactly; then at the end and the
   middle of the path, for the error. */
TEST time_is_sampled_where_it_should_be(void)
{
    springls_params p = vertices_move(0);
    springls_context *ctx = few(&p, 1);
    clockwork clock_of = { { 0.0f }, 0, { 0.5f, -1.0f, 2.0f, 3.0f } };
    springls_forces forces = fixture_forces(polynomial_wind, &clock_of);
    springls__v3 before = fixture_particle(ctx, 0), after;
    const double t = 0.25, u = 0.75;
    ASSERT_OK(springls_advect(ctx, &forces, 0.25f, 0.5f));
    after = fixture_particle(ctx, 0);
    ASSERT_EQ(6, clock_of.calls);
    ASSERT_EQ(0.25f, clock_of.times[0]);
    ASSERT_EQ(0.5f, clock_of.times[1]);
    ASSERT_EQ(0.5f, clock_of.times[2]);
    ASSERT_EQ(0.75f, clock_of.times[3]);
    ASSERT_EQ(0.75f, clock_of.times[4]);
    ASSERT_EQ(0.5f, clock_of.times[5]);
    ASSERT_IN_RANGE(0.5 * (u - t) - 0.5 * (u * u - t * t) + 2.0 / 3.0 * (u * u * u - t * t * t)
                        + 0.75 * (u * u * u * u - t * t * t * t),
                    after.x - before.x, 3e-6);
    springls_destroy(ctx);
    PASS();
}

/* half_time_sampling samples time over half of each step, as the author's program does: of v = 2t it makes
   2t dt + dt^2/2 where dt^2 is right. */
TEST half_time_sampling_shows_the_defect(void)
{
    springls_params p = vertices_move(0);
    clockwork clock_of = { { 0.0f }, 0, { 0.0f, 2.0f, 0.0f, 0.0f } };
    springls_forces forces = fixture_forces(polynomial_wind, &clock_of);
    springls_context *ctx;
    springls__v3 before;
    p.half_time_sampling = 1;
    ctx = few(&p, 1);
    before = fixture_particle(ctx, 0);
    ASSERT_OK(springls_advect(ctx, &forces, 1.0f, 0.5f));
    ASSERT_EQ(1.125f, clock_of.times[1]);
    ASSERT_EQ(1.25f, clock_of.times[3]);
    ASSERT_IN_RANGE(2.0 * 0.5 + 0.125, fixture_particle(ctx, 0).x - before.x, 3e-6);
    springls_destroy(ctx);
    PASS();
}

/* Euler evaluates once, at t, and moves by dt times the velocity. */
TEST euler_evaluates_once(void)
{
    springls_params p = vertices_move(0);
    springls_context *ctx = few(&p, 1);
    clockwork clock_of = { { 0.0f }, 0, { 0.0f, 1.0f, 0.0f, 0.0f } };
    springls_forces forces = fixture_forces(polynomial_wind, &clock_of);
    springls__v3 before = fixture_particle(ctx, 0);
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    ASSERT_OK(springls_advect(ctx, &forces, 2.0f, 0.25f));
    ASSERT_EQ(1, clock_of.calls);
    ASSERT_EQ(2.0f, clock_of.times[0]);
    ASSERT_IN_RANGE(0.5, fixture_particle(ctx, 0).x - before.x, 2e-6);
    springls_destroy(ctx);
    PASS();
}

/* ---- kinds of force ---- */

static void pressure_of_x(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)normals;
    (void)time;
    for (i = 0; i < count; i++) out[i] = 0.1f * points[3 * i];
}

/* Pressure moves the whole springl along its own normal by pressure times time, and hands the unit normal over. */
TEST pressure_acts_along_the_normal(void)
{
    springls_params p = vertices_move(0);
    springls_context *ctx = few(&p, 60);
    fixture_springl *before = fixture_copy(ctx);
    springls_forces forces = fixture_forces(NULL, NULL);
    int i, m;
    forces.pressure = pressure_of_x;
    forces.pressure_weight = -0.5f;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 2.0f));
    for (i = 0; i < 60; i++) {
        d3 move = d3_scale(fixture_normal(&before[i]), -0.5 * 2.0 * 0.1 * (double)before[i].p.x);
        fixture_springl now = fixture_get(ctx, i);
        ASSERT_LT(d3_distance(d3_add(d3_of(before[i].p), move), d3_of(now.p)), 1e-5);
        for (m = 0; m < 3; m++) ASSERT_LT(d3_distance(d3_add(d3_of(before[i].q[m]), move), d3_of(now.q[m])), 1e-5);
    }
    free(before);
    springls_destroy(ctx);
    PASS();
}

static const float matrix[12] = { 0.2f, -0.3f, 0.1f, 0.4f, 0.25f, -0.1f, 0.05f, -0.6f, -0.15f, 0.3f, 0.2f, 0.7f };

static d3 by_matrix(d3 x)
{
    const float *a = matrix;
    return d3_make((double)a[0] * x.x + (double)a[1] * x.y + (double)a[2] * x.z + (double)a[3],
                   (double)a[4] * x.x + (double)a[5] * x.y + (double)a[6] * x.z + (double)a[7],
                   (double)a[8] * x.x + (double)a[9] * x.y + (double)a[10] * x.z + (double)a[11]);
}

static void same_matrix(void *user, const float *points, const float *correspondences, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)points;
    (void)correspondences;
    (void)time;
    for (i = 0; i < count; i++) memcpy(out + 12 * i, matrix, sizeof matrix);
}

/* An affine force moves every vertex by A q + b of its own place, with either rule for velocities. */
TEST affine_moves_each_vertex(int own)
{
    springls_params p = vertices_move(own);
    springls_context *ctx = few(&p, 300);
    fixture_springl *before = fixture_copy(ctx);
    springls_forces forces = fixture_forces(NULL, NULL);
    int i, m;
    forces.affine = same_matrix;
    forces.affine_weight = 0.5f;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 0.4f));
    for (i = 0; i < 300; i++) {
        fixture_springl now = fixture_get(ctx, i);
        for (m = 0; m < 4; m++) {
            d3 x = d3_of(m < 3 ? before[i].q[m] : before[i].p);
            ASSERT_LT(d3_distance(d3_mad(x, by_matrix(x), 0.2), d3_of(m < 3 ? now.q[m] : now.p)), 1e-5);
        }
    }
    free(before);
    springls_destroy(ctx);
    PASS();
}

static void spin(void *user, const float *points, const float *correspondences, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)points;
    (void)correspondences;
    (void)time;
    memset(out, 0, (size_t)count * 12 * sizeof *out);
    for (i = 0; i < count; i++) { /* about the vertical through (16, 16) */
        out[12 * i + 1] = -1.0f;
        out[12 * i + 3] = 16.0f;
        out[12 * i + 4] = 1.0f;
        out[12 * i + 7] = -16.0f;
    }
}

/* A rigid rotation given as an affine force keeps every length of every springl, though velocities belong to particles. */
TEST affine_rotation_is_rigid(void)
{
    springls_params p = vertices_move(0);
    springls_context *ctx = few(&p, 50);
    fixture_springl *before = fixture_copy(ctx);
    springls_forces forces = fixture_forces(NULL, NULL);
    int i, m;
    forces.affine = spin;
    for (i = 0; i < 20; i++) ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 0.05f));
    for (i = 0; i < 50; i++) {
        fixture_springl now = fixture_get(ctx, i);
        for (m = 0; m < 3; m++) {
            ASSERT_IN_RANGE(d3_distance(d3_of(before[i].q[m]), d3_of(before[i].q[(m + 1) % 3])),
                            d3_distance(d3_of(now.q[m]), d3_of(now.q[(m + 1) % 3])), 2e-5);
            ASSERT_IN_RANGE(d3_distance(d3_of(before[i].q[m]), d3_of(before[i].p)), d3_distance(d3_of(now.q[m]), d3_of(now.p)),
                            2e-5);
        }
    }
    free(before);
    springls_destroy(ctx);
    PASS();
}

static void home(void *user, const float *points, const float *correspondences, int count, float time, float *out)
{
    int i, k;
    (void)user;
    (void)points;
    (void)time;
    memset(out, 0, (size_t)count * 12 * sizeof *out);
    for (i = 0; i < count; i++)
        for (k = 0; k < 3; k++) {
            out[12 * i + 5 * k] = -1.0f;
            out[12 * i + 4 * k + 3] = correspondences[3 * i + k];
        }
}

/* The affine force is given the correspondences: particles can be sent back to where they come from. */
TEST affine_maps_are_given_correspondences(void)
{
    springls_params p = vertices_move(0);
    springls_context *ctx = few(&p, 300);
    springls_forces forces = fixture_forces(NULL, NULL);
    int i;
    ASSERT_OK(fixture_translate(ctx, 1.5f, -0.5f, 2.0f));
    forces.affine = home;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
    for (i = 0; i < 300; i++) ASSERT_LT(d3_distance(d3_of(fixture_origin(ctx, i)), d3_of(fixture_particle(ctx, i))), 1e-5);
    springls_destroy(ctx);
    PASS();
}

/* With their own velocities vertices follow a rotation, so triangles turn with the body; without, they only shift. */
TEST vertex_velocity_turns_triangles(void)
{
    struct exact_flow flow = EXACT_ROTATION(16.0f, 15.0f, 14.0f, 1.0f, 2.0f, 2.0f, 0.8f);
    int own, i, m;
    for (own = 0; own < 2; own++) {
        springls_params p = vertices_move(own);
        springls_context *ctx = few(&p, 60);
        fixture_springl *before = fixture_copy(ctx);
        springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
        for (i = 0; i < 10; i++) ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 0.1f));
        for (i = 0; i < 60; i++) {
            fixture_springl now = fixture_get(ctx, i);
            d3 p1 = rotation_exact(d3_of(before[i].p), 0.8);
            ASSERT_LT(d3_distance(p1, d3_of(now.p)), 1e-4);
            for (m = 0; m < 3; m++) {
                d3 turned = rotation_exact(d3_of(before[i].q[m]), 0.8);
                d3 shifted = d3_add(d3_of(before[i].q[m]), d3_sub(d3_of(now.p), d3_of(before[i].p)));
                ASSERT_LT(d3_distance(own ? turned : shifted, d3_of(now.q[m])), 1e-4);
            }
        }
        free(before);
        springls_destroy(ctx);
    }
    PASS();
}

/* ---- sampled fields ---- */

static void fill_field(const springls_grid_desc *grid, float *data)
{
    int x, y, z;
    for (z = 0; z < grid->size[2]; z++)
        for (y = 0; y < grid->size[1]; y++)
            for (x = 0; x < grid->size[0]; x++) {
                double at[3];
                d3 v;
                int r, c, ijk[3];
                ijk[0] = x;
                ijk[1] = y;
                ijk[2] = z;
                for (r = 0; r < 3; r++)
                    for (at[r] = grid->origin[r], c = 0; c < 3; c++)
                        at[r] += grid->direction[3 * r + c] * grid->spacing[c] * ijk[c];
                v = by_matrix(d3_make(at[0], at[1], at[2]));
                *data++ = (float)v.x;
                *data++ = (float)v.y;
                *data++ = (float)v.z;
            }
}

static springls_grid_desc plain_grid(int size)
{
    springls_grid_desc grid;
    int k;
    memset(&grid, 0, sizeof grid);
    for (k = 0; k < 3; k++) {
        grid.size[k] = size;
        grid.spacing[k] = 1.0;
        grid.direction[4 * k] = 1.0;
    }
    return grid;
}

/* A field sampled from an affine function gives it back exactly everywhere between samples: on the model's grid and on
   a turned, stretched and shifted grid of its own; applied with dt = 1 and Euler it is a displacement field. */
TEST sampled_fields_are_trilinear(int own_grid)
{
    springls_params p = vertices_move(1);
    springls_context *ctx = few(&p, 200);
    springls_grid_desc grid = plain_grid(32);
    springls_forces forces = fixture_forces(NULL, NULL);
    fixture_springl *before = fixture_copy(ctx);
    float *data;
    int i, m;
    if (own_grid) { /* turned by 30 degrees about z */
        grid.size[0] = 30;
        grid.size[1] = 35;
        grid.size[2] = 20;
        grid.spacing[0] = 1.9;
        grid.spacing[1] = 1.7;
        grid.spacing[2] = 2.3;
        grid.origin[0] = 3.0;
        grid.origin[1] = -14.0;
        grid.origin[2] = -4.0;
        grid.direction[0] = grid.direction[4] = cos(fixture_pi / 6.0);
        grid.direction[1] = -0.5;
        grid.direction[3] = 0.5;
    }
    data = (float *)malloc((size_t)(grid.size[0] * grid.size[1] * grid.size[2]) * 3 * sizeof *data);
    fill_field(&grid, data);
    forces.velocity_grid.data = data;
    if (own_grid) forces.velocity_grid.grid = grid;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
    for (i = 0; i < 200; i++) {
        fixture_springl now = fixture_get(ctx, i);
        for (m = 0; m < 4; m++) {
            d3 x = d3_of(m < 3 ? before[i].q[m] : before[i].p);
            ASSERT_LT(d3_distance(d3_add(x, by_matrix(x)), d3_of(m < 3 ? now.q[m] : now.p)), 5e-5);
        }
    }
    free(data);
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* In a model whose grid has an origin and a spacing, the field's grid is still in the world; its values, and speeds, are there too unless
   the forces are in voxels. */
TEST sampled_fields_lie_in_the_world(int voxel_units)
{
    springls_desc desc = fixture_desc(16, NULL);
    springls_context *ctx;
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_grid_desc grid = plain_grid(8);
    const double unit = voxel_units ? 1.0 : 0.5; /* of velocities, voxels */
    float data[3 * 512], speed;
    springls__v3 before;
    int i;
    forces.voxel_units = voxel_units != 0;
    desc.grid.spacing[0] = desc.grid.spacing[1] = desc.grid.spacing[2] = 0.5;
    desc.grid.origin[0] = 10.0;
    ASSERT_OK(springls_create(&desc, &ctx));
    fixture_add(ctx, springls__v3_make(5.0f, 6.0f, 7.0f), springls__v3_make(6.0f, 6.0f, 7.0f), springls__v3_make(5.0f, 7.0f, 7.0f));
    before = fixture_particle(ctx, 0);
    grid.origin[0] = 10.0;
    for (i = 0; i < 512; i++) {
        data[3 * i] = (float)(i % 8); /* world x - 10: half the voxel */
        data[3 * i + 1] = data[3 * i + 2] = 0.0f;
    }
    forces.velocity_grid.data = data;
    forces.velocity_grid.grid = grid;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    ASSERT_OK(springls_max_speed(ctx, &forces, 0.0f, &speed));
    ASSERT_IN_RANGE(0.5 * (double)before.x, speed, 1e-5);
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
    ASSERT_IN_RANGE((1.0 + 0.5 / unit) * (double)before.x, fixture_particle(ctx, 0).x, 1e-5);
    springls_destroy(ctx);
    PASS();
}

/* Beyond its samples a field is constant; an axis may have a single sample. */
TEST sampled_fields_end(void)
{
    springls_params p = vertices_move(0);
    springls_context *ctx = fixture_context(16, &p);
    springls_forces forces = fixture_forces(NULL, NULL);
    float data[2] = { 0.25f, 0.75f };
    fixture_springl before[3];
    int i;
    for (i = 0; i < 3; i++) {
        float x = i == 0 ? -1.0f : i == 1 ? 4.5f : 17.0f;
        fixture_add(ctx, springls__v3_make(x, 8.0f, 8.0f), springls__v3_make(x, 9.0f, 8.0f), springls__v3_make(x, 8.0f, 9.0f));
        before[i] = fixture_get(ctx, i);
    }
    forces.pressure_grid.data = data; /* two samples along x, at 4 and 5 */
    forces.pressure_grid.grid = plain_grid(1);
    forces.pressure_grid.grid.size[0] = 2;
    forces.pressure_grid.grid.origin[0] = 4.0;
    forces.pressure_weight = 2.0f;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
    ASSERT_IN_RANGE(0.5, fixture_particle(ctx, 0).x - before[0].p.x, 1e-6); /* normals are +x */
    ASSERT_IN_RANGE(1.0, fixture_particle(ctx, 1).x - before[1].p.x, 1e-6);
    ASSERT_IN_RANGE(1.5, fixture_particle(ctx, 2).x - before[2].p.x, 2e-6);
    springls_destroy(ctx);
    PASS();
}

/* ---- the rest ---- */

/* Contributions add up, each times its weight; a weight of zero means one. */
TEST weights_weigh(void)
{
    springls_params p = vertices_move(0);
    springls_context *ctx = fixture_context(16, &p);
    springls_forces forces;
    float wind[3] = { 0.5f, -0.25f, 0.125f }, speed;
    springls__v3 before;
    fixture_add(ctx, springls__v3_make(8.0f, 8.0f, 8.0f), springls__v3_make(9.0f, 8.0f, 8.0f),
                springls__v3_make(8.0f, 9.0f, 8.0f)); /* normal +z */
    before = fixture_particle(ctx, 0);
    forces = fixture_forces(fixture_wind, wind);
    forces.pressure = pressure_of_x;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    ASSERT_OK(springls_max_speed(ctx, &forces, 0.0f, &speed));
    ASSERT_IN_RANGE(sqrt(0.25 + 0.0625 + pow(0.125 + 0.1 * (double)before.x, 2.0)), speed, 1e-6);
    forces.velocity_weight = 2.0f;
    forces.pressure_weight = -1.0f;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
    ASSERT_IN_RANGE((double)before.x + 1.0, fixture_particle(ctx, 0).x, 1e-6);
    ASSERT_IN_RANGE((double)before.y - 0.5, fixture_particle(ctx, 0).y, 1e-6);
    ASSERT_IN_RANGE((double)before.z + 0.25 - 0.1 * (double)before.x, fixture_particle(ctx, 0).z, 1e-6);
    springls_destroy(ctx);
    PASS();
}

/* max_speed is the largest speed of any particle, and changes nothing. */
TEST max_speed_is_the_largest(void)
{
    springls_context *ctx = few(NULL, 300);
    struct exact_flow flow = EXACT_ROTATION(16.0f, 15.0f, 14.0f, 0.0f, 0.0f, 1.0f, 0.3f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    uint64_t hash = springls_state_hash(ctx);
    double largest = 0.0;
    float speed;
    int i;
    for (i = 0; i < 300; i++) {
        springls__v3 x = fixture_particle(ctx, i);
        double v = 0.3 * hypot((double)x.x - 16.0, (double)x.y - 15.0);
        if (v > largest) largest = v;
    }
    ASSERT_OK(springls_max_speed(ctx, &forces, 0.0f, &speed));
    ASSERT_IN_RANGE(largest, speed, 1e-5);
    ASSERT(hash == springls_state_hash(ctx));
    springls_destroy(ctx);
    PASS();
}

typedef struct spoiler { int at; float value; } spoiler;

static void spoiled_wind(void *user, const float *points, int count, float time, float *out)
{
    const spoiler *s = (const spoiler *)user;
    int i;
    (void)points;
    (void)time;
    for (i = 0; i < 3 * count; i++) out[i] = 1.0f;
    if (count > s->at) out[3 * s->at + 1] = s->value;
}

/* A force that is NaN or infinite anywhere is refused with NON_FINITE and a sentence; no springl has moved. */
TEST bad_forces_move_nothing(void)
{
    springls_context *ctx = few(NULL, 300);
    spoiler bad;
    springls_forces forces = fixture_forces(spoiled_wind, &bad);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
    uint64_t hash = springls_state_hash(ctx);
    float speed;
    int kind, limit;
    for (kind = 0; kind < 5; kind++) {
        bad.at = kind < 2 ? 0 : 10;
        bad.value = kind % 2 ? HUGE_VALF : (float)NAN;
        if (kind == 4) bad.value = 3e38f; /* finite: the message names the limit */
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_advect(ctx, &forces, 0.0f, 0.5f));
        ASSERT(strstr(springls_last_error(ctx), "advect: a force is NaN, or would move a springl by 1e9 voxels or more") != NULL);
        ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_max_speed(ctx, &forces, 0.0f, &speed));
        ASSERT(strstr(springls_last_error(ctx), "max_speed: a force is NaN, or a speed is 1e9") != NULL);
        for (limit = 0; limit < 2; limit++) {
            step.max_displacement = limit ? 1.0f : -1.0f; /* 1: the speed is measured first */
            ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_step(ctx, &step));
            ASSERT_EQ(0, strncmp(springls_last_error(ctx), limit ? "step: " : "advect: ", 6));
        }
        ASSERT(hash == springls_state_hash(ctx));
        ASSERT_EQ(0.0, springls_time(ctx));
    }
    bad.value = 1.0f;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 0.5f));
    ASSERT_IN_RANGE(0.5 * sqrt(3.0), springls_get_stats(ctx).largest_displacement, 1e-5);
    ASSERT_EQ(1.0f, springls_get_stats(ctx).moving_share);
    springls_destroy(ctx);
    PASS();
}

/* A curvature force moves a sphere inward by curvature 2/R, everywhere alike. */
TEST curvature_shrinks_spheres(void)
{
    double moved[2];
    int k, i;
    for (k = 0; k < 2; k++) {
        float radius = k ? 11.0f : 6.0f;
        springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, radius);
        springls_forces forces = fixture_forces(NULL, NULL);
        d3 center = d3_make(15.5, 15.5, 15.5);
        double before = 0.0, after = 0.0;
        forces.curvature_weight = 0.5f;
        forces.integrator = SPRINGLS_INTEGRATOR_EULER;
        for (i = 0; i < springls_count(ctx); i++) before += d3_distance(d3_of(fixture_particle(ctx, i)), center);
        ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 0.2f));
        for (i = 0; i < springls_count(ctx); i++) after += d3_distance(d3_of(fixture_particle(ctx, i)), center);
        moved[k] = (before - after) / springls_count(ctx);
        ASSERT_IN_RANGE(0.1 * 2.0 / (double)radius, moved[k], 0.1 * 2.0 / (double)radius * 0.02);
        springls_destroy(ctx);
    }
    ASSERT_GT(moved[0], moved[1]);
    PASS();
}

/* Topology, correspondences, ids and the level set do not change when springls move. */
TEST advect_only_moves(void)
{
    springls_context *ctx = fixture_sphere(24, NULL, 11.5f, 11.5f, 11.5f, 6.0f);
    fixture_springl *before = fixture_copy(ctx);
    float *phi = fixture_phi(ctx), *now;
    int i;
    ASSERT_OK(fixture_translate(ctx, 0.3f, 0.2f, -0.4f));
    now = fixture_phi(ctx);
    ASSERT_MEM_EQ(phi, now, 24 * 24 * 24 * sizeof *phi);
    for (i = 0; i < springls_count(ctx); i++) {
        fixture_springl s = fixture_get(ctx, i);
        ASSERT_MEM_EQ(&before[i].a, &s.a, sizeof s.a);
        ASSERT_EQ(before[i].id, s.id);
        ASSERT_LT(d3_distance(d3_add(d3_of(before[i].p), d3_make(0.3, 0.2, -0.4)), d3_of(s.p)), 1e-5);
    }
    free(before);
    free(phi);
    free(now);
    springls_destroy(ctx);
    PASS();
}

/* The deformation for a batch. */
static void deformation_of_batch(void *user, const springls_batch *batch, float *out)
{
    exact_flow_velocity(user, batch->points, batch->count, batch->time, out);
}

/* Callbacks for points, for batches, and a region around all springls, whose list fills blocks in another way, move springls in the
   same way, bit by bit; the last springls fill no register and no block. */
TEST callbacks_of_any_kind_move_alike(int count)
{
    struct exact_flow flow = EXACT_DEFORMATION(32.0f, 1.5f);
    int own, euler;
    for (own = 0; own < 2; own++)
        for (euler = 0; euler < 2; euler++) {
            springls_params p = vertices_move(own);
            uint64_t hash[3];
            int by, k;
            for (by = 0; by < 3; by++) {
                springls_context *ctx = few(&p, count);
                springls_forces forces = fixture_forces(by == 1 ? NULL : exact_flow_velocity, &flow);
                if (by == 1) forces.velocity_batch = deformation_of_batch;
                for (k = 0; k < 3 && by == 2; k++) forces.region_upper[k] = 32.0f;
                forces.integrator = euler ? SPRINGLS_INTEGRATOR_EULER : SPRINGLS_INTEGRATOR_RK4;
                forces.velocity_weight = 0.75f;
                ASSERT_OK(springls_advect(ctx, &forces, 0.3f, 0.05f));
                ASSERT_EQ(count, ctx->motion.count);
                hash[by] = springls_state_hash(ctx);
                springls_destroy(ctx);
            }
            ASSERT(hash[0] == hash[1]);
            ASSERT(hash[0] == hash[2]);
        }
    PASS();
}

SUITE(advect)
{
    RUN_TEST(rotation_has_its_order);
    RUN_TEST(deformation_has_its_order);
    RUN_TEST(flows_are_the_formulas);
    RUN_TEST(time_is_sampled_where_it_should_be);
    RUN_TEST(half_time_sampling_shows_the_defect);
    RUN_TEST(euler_evaluates_once);
    RUN_TEST(pressure_acts_along_the_normal);
    RUN_TESTp(affine_moves_each_vertex, 0);
    RUN_TESTp(affine_moves_each_vertex, 1);
    RUN_TEST(affine_rotation_is_rigid);
    RUN_TEST(affine_maps_are_given_correspondences);
    RUN_TEST(vertex_velocity_turns_triangles);
    RUN_TESTp(sampled_fields_are_trilinear, 0);
    RUN_TESTp(sampled_fields_are_trilinear, 1);
    RUN_TESTp(sampled_fields_lie_in_the_world, 0);
    RUN_TESTp(sampled_fields_lie_in_the_world, 1);
    RUN_TEST(sampled_fields_end);
    RUN_TEST(weights_weigh);
    RUN_TEST(max_speed_is_the_largest);
    RUN_TESTp(callbacks_of_any_kind_move_alike, 43);
    RUN_TESTp(callbacks_of_any_kind_move_alike, 201);
    RUN_TEST(bad_forces_move_nothing);
    RUN_TEST(curvature_shrinks_spheres);
    RUN_TEST(advect_only_moves);
}

/* ---- forces in world units ---- */

/* A world that is turned, stretched and mirrored against the voxels. */
static springls_context *in_the_world(double stretch)
{
    springls_params p = springls_paper_params();
    springls_desc desc = fixture_desc(24, &p);
    springls_context *ctx = NULL;
    static const double direction[9] = { 0.0, 0.6, 0.8, -1.0, 0.0, 0.0, 0.0, 0.8, -0.6 };
    springls_sphere ball;
    float center[3] = { 11.0f, 12.0f, 11.5f };
    memcpy(desc.grid.direction, direction, sizeof direction);
    desc.grid.spacing[0] = desc.grid.spacing[1] = 0.25;
    desc.grid.spacing[2] = 0.25 * stretch;
    desc.grid.origin[0] = 5.0;
    p.vertex_velocity = 1;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return NULL;
    springls_to_world(ctx, center, 1, ball.center);
    ball.radius = 1.5f;
    return springls_set_implicit(ctx, springls_implicit_sphere, &ball) == SPRINGLS_OK ? ctx : NULL;
}

/* Drifts and shears in the world; user: a count of the points outside of it. */
static void world_wind(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)time;
    for (i = 0; i < count; i++) {
        if (points[3 * i] < 4.0f || points[3 * i] > 30.0f) ++*(int *)user; /* voxels begin at 0 */
        out[3 * i] = 0.5f;
        out[3 * i + 1] = 0.25f * (points[3 * i] - 5.0f);
        out[3 * i + 2] = -0.125f;
    }
}

static void world_map(void *user, const float *points, const float *correspondences, int count, float time, float *out)
{
    static const float map[12] = { 0.0f, 0.0f, 0.0f, 0.5f, 0.25f, 0.0f, 0.0f, -1.25f, 0.0f, 0.0f, 0.0f, -0.125f };
    int i;
    (void)user, (void)points, (void)correspondences, (void)time;
    for (i = 0; i < count; i++) memcpy(out + 12 * i, map, sizeof map);
}

static float *world_particles(springls_context *ctx)
{
    springls_view view = springls_view_particles(ctx);
    float *out = (float *)malloc(3 * sizeof *out * (size_t)(view.count + 1));
    int i;
    for (i = 0; i < view.count; i++)
        springls_to_world(ctx, (const float *)(const void *)((const char *)view.data + (size_t)i * view.stride), 1, out + 3 * i);
    return out;
}

/* A velocity and an affine map of the world move every place as they do in the world. */
TEST forces_may_be_of_the_world(int affine)
{
    springls_context *ctx = in_the_world(2.0);
    springls_forces forces = springls_default_forces();
    float *before, *after;
    int i, outside = 0, count;
    ASSERT(ctx);
    before = world_particles(ctx);
    forces.user = &outside;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    if (affine) forces.affine = world_map;
    else forces.velocity = world_wind;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 0.5f));
    after = world_particles(ctx);
    count = springls_count(ctx);
    ASSERT_GT(count, 100);
    ASSERT_EQ(0, outside);
    for (i = 0; i < count; i++) {
        ASSERT_IN_RANGE(before[3 * i] + 0.25f, after[3 * i], 2e-5f);
        ASSERT_IN_RANGE(before[3 * i + 1] + 0.125f * (before[3 * i] - 5.0f), after[3 * i + 1], 2e-5f);
        ASSERT_IN_RANGE(before[3 * i + 2] - 0.0625f, after[3 * i + 2], 2e-5f);
    }
    springls_destroy(ctx);
    free(before);
    free(after);
    PASS();
}

static void out_of_the_ball(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    int i, k;
    (void)time;
    for (i = 0; i < count; i++) {
        const float *center = (const float *)user;
        float along = 0.0f;
        for (k = 0; k < 3; k++) along += (points[3 * i + k] - center[k]) * normals[3 * i + k];
        out[i] = along > 0.0f ? 0.5f : -100.0f;
    }
}

/* A pressure and curvature are speeds of the world, outwards, also where voxels are mirrored. */
TEST pressure_may_be_of_the_world(int curvature)
{
    springls_context *ctx = in_the_world(1.0);
    springls_forces forces = springls_default_forces();
    float center[3] = { 11.0f, 12.0f, 11.5f };
    float *after;
    int i, k;
    ASSERT(ctx);
    springls_to_world(ctx, center, 1, center);
    forces.user = center;
    if (curvature) forces.curvature_weight = 0.5f * 0.75f; /* times 2 / 1.5: a speed of .5 inwards */
    else forces.pressure = out_of_the_ball;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 0.125f));
    after = world_particles(ctx);
    for (i = 0; i < springls_count(ctx); i++) {
        float r2 = 0.0f;
        for (k = 0; k < 3; k++) r2 += (after[3 * i + k] - center[k]) * (after[3 * i + k] - center[k]);
        ASSERT_IN_RANGE(curvature ? 1.5 - 0.0625 : 1.5 + 0.0625, sqrt((double)r2), 0.012);
    }
    springls_destroy(ctx);
    free(after);
    PASS();
}

static void along_y(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user; (void)points; (void)time;
    for (i = 0; i < count; i++) {
        out[3 * i] = out[3 * i + 2] = 0.0f;
        out[3 * i + 1] = 1.0f;
    }
}

/* With world units the region is a box of the world, oblique in voxels: just those whose particle lies in it move. */
TEST regions_may_be_of_the_world(int at_rest)
{
    springls_context *ctx = in_the_world(2.0);
    springls_forces forces = springls_default_forces();
    float *before, *after, center[3] = { 11.0f, 12.0f, 11.5f };
    int i, k, inside = 0;
    ASSERT(ctx);
    springls_to_world(ctx, center, 1, center);
    if (at_rest) ASSERT_OK(springls_settle(ctx, 60));
    before = world_particles(ctx);
    forces.velocity = along_y;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    for (k = 0; k < 3; k++) {
        forces.region_lower[k] = center[k] - 0.2f;
        forces.region_upper[k] = center[k] + 2.0f;
    }
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 0.125f));
    after = world_particles(ctx);
    for (i = 0; i < springls_count(ctx); i++) {
        bool in = true;
        for (k = 0; k < 3; k++)
            in = in && before[3 * i + k] >= forces.region_lower[k] && before[3 * i + k] <= forces.region_upper[k];
        ASSERT_IN_RANGE(before[3 * i + 1] + (in ? 0.125f : 0.0f), after[3 * i + 1], 2e-5f);
        inside += in;
    }
    ASSERT_GT(inside, 20);
    ASSERT_LT(inside, springls_count(ctx) / 2);
    springls_destroy(ctx);
    free(before);
    free(after);
    PASS();
}

/* Turns about a centre, in the plane of x and y. */
static void turn_about(void *user, const springls_batch *batch, float *out)
{
    const float *center = (const float *)user;
    int i;
    for (i = 0; i < batch->count; i++) {
        out[3 * i] = -0.6f * (batch->points[3 * i + 1] - center[1]);
        out[3 * i + 1] = 0.6f * (batch->points[3 * i] - center[0]);
        out[3 * i + 2] = 0.0f;
    }
}

/* Returns forces about a centre, of lengths `unit` times as large along each axis: a swirl, samples and a region; where spacings are
   alike, and so normals are, a pressure and curvature, too. */
static springls_forces forces_about(const float *center, const float *unit, const float *samples, bool alike)
{
    springls_forces forces = springls_default_forces();
    int k;
    forces.user = (void *)(uintptr_t)center;
    forces.velocity_batch = turn_about;
    forces.velocity_grid.data = samples;
    forces.velocity_weight = 0.5f;
    if (alike) {
        forces.pressure = out_of_the_ball;
        forces.pressure_weight = unit[0];
        forces.curvature_weight = 0.3f * unit[0] * unit[0];
    }
    for (k = 0; k < 3; k++) {
        forces.region_lower[k] = center[k] - 2.5f * unit[k];
        forces.region_upper[k] = center[k] + 9.0f * unit[k];
    }
    return forces;
}

enum { MOST_MOVED = 3000 };

/* Moves a ball by forces_about on a grid of these spacings; writes its particles, in voxels, if `particles` is not NULL and has room for
   them. */
static uint64_t moved_by_all(const double *spacing, bool voxel_units, float *particles, int *count, float *speed)
{
    springls_desc desc = fixture_desc(16, NULL);
    springls_sphere ball = fixture_ball(7.5f * (float)spacing[0], 7.5f * (float)spacing[1], 7.5f * (float)spacing[2],
                                        4.0f * (float)spacing[0]);
    float *samples = (float *)malloc(3 * 4096 * sizeof *samples), unit[3], center[3];
    springls_forces forces;
    springls_step_desc step;
    springls_context *ctx = NULL;
    springls_view view;
    uint64_t hash = 0;
    int i, k;
    for (k = 0; k < 3; k++) {
        desc.grid.spacing[k] = spacing[k];
        unit[k] = voxel_units ? 1.0f : (float)spacing[k];
        center[k] = 7.5f * unit[k];
    }
    for (i = 0; i < 3 * 4096; i++) samples[i] = 0.02f * (float)(i % 16 - i / 48 % 16) * unit[i % 3];
    forces = forces_about(center, unit, samples, spacing[0] == spacing[2]);
    forces.voxel_units = voxel_units;
    step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
    if (springls_create(&desc, &ctx) == SPRINGLS_OK && springls_set_implicit(ctx, springls_implicit_sphere, &ball) == SPRINGLS_OK
        && springls_max_speed(ctx, &forces, 0.0f, speed) == SPRINGLS_OK && springls_run(ctx, &step, 3) == SPRINGLS_OK) {
        view = springls_view_particles(ctx);
        *count = view.count;
        for (i = 0; i < view.count && particles && view.count <= MOST_MOVED; i++) {
            const float *p = (const float *)(const void *)((const char *)view.data + (size_t)i * view.stride);
            memcpy(particles + 3 * i, p, 3 * sizeof *p);
        }
        hash = springls_state_hash(ctx);
    }
    springls_destroy(ctx);
    free(samples);
    return hash;
}

/* Where the world is the lattice, both units have the same bits. */
TEST units_of_the_lattice(void)
{
    const double spacing[3] = { 1.0, 1.0, 1.0 };
    float speed[2];
    int count[2];
    uint64_t hash = moved_by_all(spacing, false, NULL, &count[0], &speed[0]);
    ASSERT(hash != 0);
    ASSERT_EQ(hash, moved_by_all(spacing, true, NULL, &count[1], &speed[1]));
    ASSERT_EQ(speed[0], speed[1]);
    PASS();
}

/* Elsewhere forces of the world move springls as those in voxels do that are as many times larger as voxels are smaller than a unit of
   the world, along each axis; speeds are those of the world. */
TEST units_are_the_worlds(double along_xy, double along_z)
{
    static float in_world[3 * MOST_MOVED], in_voxels[3 * MOST_MOVED];
    const double spacing[3] = { along_xy, along_xy, along_z };
    float speed[2];
    int count[2], i;
    ASSERT(moved_by_all(spacing, false, in_world, &count[0], &speed[0]) != 0);
    ASSERT(moved_by_all(spacing, true, in_voxels, &count[1], &speed[1]) != 0);
    ASSERT_EQ(count[0], count[1]);
    ASSERT_LT(count[0], MOST_MOVED);
    ASSERT_GT(speed[1], 0.1f);
    if (along_xy == along_z) ASSERT_IN_RANGE(along_xy * (double)speed[1], speed[0], 1e-5);
    for (i = 0; i < 3 * count[0]; i++) ASSERT_IN_RANGE(in_voxels[i], in_world[i], 1e-4);
    PASS();
}

typedef struct warnings { int count; char last[256]; } warnings;

static void count_warnings(void *user, int level, const char *message)
{
    warnings *w = (warnings *)user;
    if (level != 2) return;
    w->count++;
    snprintf(w->last, sizeof w->last, "%s", message);
}

/* A region that lies outside the grid, as one in other units does, is warned of; one in the grid that has no springl is not. */
TEST a_region_outside_is_warned_of(void)
{
    warnings w = { 0, "" };
    springls_desc desc = fixture_desc(24, NULL);
    springls_context *ctx = NULL;
    springls_sphere ball = fixture_ball(11.0f, 11.0f, 11.0f, 5.0f);
    springls_forces forces = springls_default_forces();
    springls_step_desc step;
    int k;
    desc.logger.log = count_warnings;
    desc.logger.user = &w;
    for (k = 0; k < 3; k++) {
        desc.grid.origin[k] = 100.0;
        ball.center[k] += 100.0f;
        forces.region_lower[k] = 105.0f;
        forces.region_upper[k] = 112.0f;
    }
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    forces.voxel_units = true;
    forces.velocity = along_y;
    step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    w.count = 0;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(1, w.count);
    ASSERT(strstr(w.last, "voxel_units is true"));
    ASSERT_EQ(0.0f, springls_get_stats(ctx).moving_share);
    forces.voxel_units = false;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(1, w.count);
    ASSERT_GT(springls_get_stats(ctx).moving_share, 0.1f);
    for (k = 0; k < 3; k++) forces.region_lower[k] = 111.0f; /* within the ball, where there are no springls */
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(1, w.count);
    springls_destroy(ctx);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(advect);
    RUN_TEST(units_of_the_lattice);
    RUN_TESTp(units_are_the_worlds, 0.25, 0.25);
    RUN_TESTp(units_are_the_worlds, 0.5, 1.0);
    RUN_TESTp(forces_may_be_of_the_world, 0);
    RUN_TESTp(forces_may_be_of_the_world, 1);
    RUN_TESTp(pressure_may_be_of_the_world, 0);
    RUN_TESTp(pressure_may_be_of_the_world, 1);
    RUN_TESTp(regions_may_be_of_the_world, 0);
    RUN_TESTp(regions_may_be_of_the_world, 1);
    RUN_TEST(a_region_outside_is_warned_of);
    GREATEST_MAIN_END();
}
