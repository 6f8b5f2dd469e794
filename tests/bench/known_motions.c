/* known_motions.c - flows, the bodies in them, and both together. */
#include "known_motions.h"

#include "examples/common/springls/exact_flows.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* Everything is placed about this point of the grid. It is off the lattice: a gap whose middle plane has voxels on it stays
   open however narrow it becomes. */
static double middle_of(double grid)
{
    return 0.5 * grid + 0.37;
}

/* ---- flows: x - the middle, in units of the grid, goes in; grids a unit of time come out ---- */

/* Most last from 0 to DURATION. Those that go back have moved by one unit of their field at half time. */
enum { DURATION = 2 };

static void velocity(const void *user, const double x[3], double factor, double v[3])
{
    const struct known_flow *flow = user;
    double y[3];
    for (int c = 0; c < 3; ++c) {
        y[c] = (x[c] - flow->middle) / flow->grid;
    }
    if (flow->unsteady) {
        flow->unsteady(y, factor, v);
        factor = 1.0;
    } else {
        flow->field(y, v);
    }
    for (int c = 0; c < 3; ++c) {
        v[c] *= factor * flow->grid;
    }
}

/* The field's factor; the time itself for a flow that is unsteady otherwise. */
static double time_factor(const void *user, double time)
{
    const struct known_flow *flow = user;
    if (flow->unsteady) {
        return time;
    }
    if (flow->period > 0.0) {
        return cos(pi * time / flow->period);
    }
    const double there = pi / DURATION * cos(pi * time / DURATION);
    return flow->back > 0.0 ? there * (2.0 * time > DURATION ? flow->back : 1.0) : 1.0 / DURATION;
}

/* LeVeque's flow as it is at time 0; the middle is the corner of the grid. */
static void deform(const double x[3], double v[3])
{
    struct exact_flow unit = EXACT_DEFORMATION(1.0f, 1.0f);
    const float at[3] = {(float)x[0], (float)x[1], (float)x[2]};
    float out[3];
    exact_flow_velocity(&unit, at, 1, 0.0f, out);
    for (int c = 0; c < 3; ++c) {
        v[c] = (double)out[c];
    }
}

/* A ball's radius and place at half time, beside those of the start. */
static const double breathing_radius = 0.12, breathing_growth = 0.5, breathing_way[3] = {0.1, -0.06, 0.08};

/* A ball that swells on its way and shrinks on the way back. */
static void breathe(const double x[3], double time, double v[3])
{
    const double rate = pi / DURATION * cos(pi * time / DURATION), share = sin(pi * time / DURATION);
    double n[3], r2 = 1e-12;
    for (int c = 0; c < 3; ++c) {
        n[c] = x[c] - share * breathing_way[c];
        r2 += n[c] * n[c];
    }
    for (int c = 0; c < 3; ++c) {
        v[c] = rate * (breathing_way[c] + breathing_growth * breathing_radius * n[c] / sqrt(r2));
    }
}

/* The two parts of that flow as an application has them, by springls_velocity_fn and springls_pressure_fn. */
static void breathing_velocity(void *user, const float *points, int count, float time, float *out)
{
    const struct known_flow *flow = user;
    const double rate = flow->grid * pi / DURATION * cos(pi * (double)time / DURATION);
    (void)points;
    for (int i = 0; i < 3 * count; ++i) {
        out[i] = (float)(rate * breathing_way[i % 3]);
    }
}

static void breathing_pressure(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    const struct known_flow *flow = user;
    const double rate = flow->grid * pi / DURATION * cos(pi * (double)time / DURATION);
    (void)points;
    (void)normals;
    for (int i = 0; i < count; ++i) {
        out[i] = (float)(rate * breathing_growth * breathing_radius);
    }
}

/* Haller's unsteady ABC flow (Physica D 149, 2001), of period 2 pi in space, which is two thirds of the grid here. */
static void abc(const double x[3], double time, double v[3])
{
    const double wave = 3.0 * pi, a = sqrt(3.0) + 0.5 * time * sin(pi * time), b = sqrt(2.0), c = 1.0;
    const double y[3] = {wave * x[0], wave * x[1], wave * x[2]};
    v[0] = (a * sin(y[2]) + c * cos(y[1])) / wave;
    v[1] = (b * sin(y[0]) + a * cos(y[2])) / wave;
    v[2] = (c * sin(y[1]) + b * cos(y[0])) / wave;
}

/* The double gyre (Shadden et al., Physica D 212, 2005) on [0,2] x [0,1], which is the middle of the grid; one period lasts 10. */
static void double_gyre(const double x[3], double time, double v[3])
{
    const double strength = 0.1, sway = 0.25 * sin(2.0 * pi * time / 10.0);
    const double at = 2.0 * x[0] + 1.0, up = 2.0 * x[1] + 0.5;
    const double f = sway * at * at + (1.0 - 2.0 * sway) * at, slope = 2.0 * sway * at + 1.0 - 2.0 * sway;
    v[0] = -0.5 * pi * strength * sin(pi * f) * cos(pi * up);
    v[1] = 0.5 * pi * strength * cos(pi * f) * sin(pi * up) * slope;
    v[2] = 0.0;
}

/* A whole turn a grid's length along y. */
static void twist(const double x[3], double v[3])
{
    v[0] = 2.0 * pi * x[1] * x[2];
    v[1] = 0.0;
    v[2] = -2.0 * pi * x[1] * x[0];
}

static void shear(const double x[3], double v[3])
{
    v[0] = x[1];
    v[1] = v[2] = 0.0;
}

static const double growth = 1.6;

static void grow(const double x[3], double v[3])
{
    for (int c = 0; c < 3; ++c) {
        v[c] = log(growth) * x[c];
    }
}

/* Moves both sides of the plane x = 0 towards it and lets them out sideways; without divergence. Bodies that have merged
   there stay joined by a thread on the way back, and rightly so; they go back several times as far, until it is thinner than
   a voxel. */
static void pull_together(double speed, double width, const double x[3], double v[3])
{
    const double t = tanh(x[0] / width), out = 0.5 * speed / width * (1.0 - t * t);
    v[0] = -speed * t;
    v[1] = out * x[1];
    v[2] = out * x[2];
}

/* Squeezes what is between the bodies, and their poles, to a thirtieth. */
static void press(const double x[3], double v[3]) { pull_together(0.12, 0.035, x, v); }

/* To a fifth: less than a voxel of gap remains between bodies that are close already, and they keep their shape. */
static void touch(const double x[3], double v[3]) { pull_together(0.08, 0.05, x, v); }

/* Two radians about a skew axis and along. */
static void screw(const double x[3], double v[3])
{
    static const double turn[3] = {0.53452, 1.06904, 1.60357}, along[3] = {0.08, -0.05, 0.06};
    v[0] = turn[1] * x[2] - turn[2] * x[1] + along[0];
    v[1] = turn[2] * x[0] - turn[0] * x[2] + along[1];
    v[2] = turn[0] * x[1] - turn[1] * x[0] + along[2];
}

/* A vortex with a core of a tenth of the grid: what is inside goes round six times as fast as what is outside. */
static void swirl(const double x[3], double v[3])
{
    const double core = 0.1, angle = 0.175 / (x[0] * x[0] + x[1] * x[1] + core * core);
    v[0] = -angle * x[1];
    v[1] = angle * x[0];
    v[2] = 0.0;
}

/* A turn about the axis through the middle that is parallel to z. */
static void turn(const double x[3], double v[3])
{
    v[0] = -2.0 * pi * x[1];
    v[1] = 2.0 * pi * x[0];
    v[2] = 0.0;
}

static const double ball_radius = 0.2;

/* Slides along x round a ball in the middle, which stays where it is. */
static void wind(const double x[3], double v[3])
{
    const double speed = 0.3, r2 = fmax(x[0] * x[0] + x[1] * x[1] + x[2] * x[2], 1e-12);
    for (int c = 0; c < 3; ++c) {
        v[c] = speed * ((c == 0 ? 1.0 : 0.0) - x[0] * x[c] / r2);
    }
}

/* ---- a part with edges: an angle with a square hole in one leg, of cells a little larger than a voxel ---- */

static const double part_size = 0.36, cell_voxels = 1.3;

static bool part_has(int cells, int i, int j, int k)
{
    const int leg = cells / 3, depth = 2 * cells / 3;
    const bool angle = (i < leg || j < leg) && i >= 0 && j >= 0 && k >= 0 && i < cells && j < cells && k < depth;
    const bool hole = i >= cells / 2 && i < 5 * cells / 6 && k >= depth / 3 && k < 2 * depth / 3;
    return angle && !hole;
}

/* Lattice point 0 of an axis; not on the voxels' lattice. */
static double part_corner(const struct known_flow *flow)
{
    return middle_of(flow->grid) - 0.5 * cell_voxels * flow->part_cells;
}

/* The eight cells about a vertex show how many of the axes have a face there: two or more make an edge. */
static bool part_on_edge(const void *user, const float x[3])
{
    const struct known_flow *flow = user;
    int at[3], axes = 0;
    for (int c = 0; c < 3; ++c) {
        at[c] = (int)lround(((double)x[c] - part_corner(flow)) / cell_voxels);
    }
    for (int axis = 0; axis < 3; ++axis) {
        bool face = false;
        for (int q = 0; q < 4; ++q) {
            int a[3], b[3];
            for (int c = 0; c < 3; ++c) {
                const int side = c == (axis + 1) % 3 ? q & 1 : c == (axis + 2) % 3 ? q >> 1 : 0;
                a[c] = at[c] - side;
                b[c] = a[c] - (c == axis);
            }
            face = face || part_has(flow->part_cells, a[0], a[1], a[2]) != part_has(flow->part_cells, b[0], b[1], b[2]);
        }
        axes += face;
    }
    return axes > 1;
}

/* The two triangles of a cell's face towards `side` of `axis`, counter-clockwise from outside. */
static void add_face(struct mesh *mesh, const struct known_flow *flow, const int cell[3], int axis, int side)
{
    static const int corners[6][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
    for (int k = 0; k < 6; ++k) {
        const int *corner = corners[side ? k : 5 - k];
        int at[3] = {cell[0], cell[1], cell[2]};
        at[axis] += side;
        at[(axis + 1) % 3] += corner[0];
        at[(axis + 2) % 3] += corner[1];
        for (int c = 0; c < 3; ++c) {
            mesh->positions[3 * mesh->vertex_count + (size_t)c] = (float)(part_corner(flow) + cell_voxels * at[c]);
        }
        mesh->indices[mesh->vertex_count] = (uint32_t)mesh->vertex_count; /* a soup: springls_set_mesh joins its corners */
        ++mesh->vertex_count;
    }
    mesh->triangle_count += 2;
}

static bool make_part(const struct known_flow *flow, struct mesh *mesh)
{
    const int n = flow->part_cells;
    const size_t most = 6u * 12u * (size_t)(n * n); /* corners; the part has fewer than 12 n^2 faces */
    memset(mesh, 0, sizeof *mesh);
    mesh->positions = malloc(most * 3 * sizeof(float));
    mesh->indices = malloc(most * sizeof(uint32_t));
    for (int i = 0; mesh->positions && mesh->indices && i < 6 * n * n * n; ++i) {
        const int face = i % 6, cell[3] = {i / 6 % n, i / 6 / n % n, i / 6 / n / n};
        int next[3] = {cell[0], cell[1], cell[2]};
        next[face / 2] += face % 2 ? 1 : -1;
        if (part_has(n, cell[0], cell[1], cell[2]) && !part_has(n, next[0], next[1], next[2])) {
            add_face(mesh, flow, cell, face / 2, face % 2);
        }
    }
    return mesh->positions && mesh->indices;
}

/* ---- scanned bodies ---- */

/* In the middle, its longest side `size` of the grid's. */
static void fit(struct mesh *mesh, double grid, double size)
{
    double low[3], high[3], longest = 0.0;
    for (int c = 0; c < 3; ++c) {
        low[c] = high[c] = (double)mesh->positions[c];
        for (size_t i = 0; i < mesh->vertex_count; ++i) {
            low[c] = fmin(low[c], (double)mesh->positions[3 * i + (size_t)c]);
            high[c] = fmax(high[c], (double)mesh->positions[3 * i + (size_t)c]);
        }
        longest = fmax(longest, high[c] - low[c]);
    }
    for (size_t i = 0; i < 3 * mesh->vertex_count; ++i) {
        const double middle = 0.5 * (low[i % 3] + high[i % 3]);
        mesh->positions[i] = (float)(middle_of(grid) + size * grid * ((double)mesh->positions[i] - middle) / longest);
    }
}

static bool read_body(const char *name, double grid, double size, struct mesh *mesh)
{
    const char *data = getenv("SPRINGLS_DATA");
    char path[1024], error[MESH_TEXT];
    if (!data || !data[0]) {
        printf("SPRINGLS_DATA is not set: a stand-in moves instead of %s.\n", name);
        return false;
    }
    snprintf(path, sizeof path, "%s/meshes/%s", data, name);
    if (!mesh_read(path, mesh, error)) {
        printf("A stand-in moves instead of %s: %s\n", name, error);
        return false;
    }
    fit(mesh, grid, size);
    return true;
}

/* ---- the motions ---- */

const int known_components[KNOWN_MOTIONS][3] = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {2, 1, 2}, {2, 1, 2}, {1, 1, 1},
                                                {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1},
                                                {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}};

static void take_shape(struct motion *motion, springls_implicit_fn shape, void *data)
{
    motion->problem.shape = shape;
    motion->problem.shape_data = data;
}

static springls_sphere ball_at(double x, double y, double z, double radius)
{
    const springls_sphere ball = {{(float)x, (float)y, (float)z}, (float)radius};
    return ball;
}

/* Two balls on both sides of the plane x = 0, their centres `apart` from it. */
static void two_balls(double n, double apart, springls_sphere spheres[2], springls_metasphere *two)
{
    const double m = middle_of(n);
    spheres[0] = ball_at(m - apart * n, m, m, 0.1 * n);
    spheres[1] = ball_at(m + apart * n, m, m, 0.1 * n);
    two->spheres = spheres;
    two->count = 2;
}

static void make_shapes(struct known_motions *all, float n)
{
    const double size = (double)n, middle = middle_of(size);
    const float m = (float)middle;
    const springls_box bar = {{m, m, m}, {0.12f * n, 0.3f * n, 0.12f * n}};
    const springls_box box = {{m + 0.2f * n, m, m}, {0.12f * n, 0.1f * n, 0.14f * n}};
    const springls_notched_sphere notched = {{m, m, m}, 0.25f * n, 0.1f * n, 0.35f * n};
    const springls_notched_sphere zalesak = {{0.5f * n, 0.75f * n, 0.5f * n}, 0.15f * n, 0.05f * n, 0.125f * n};
    const springls_torus torus = {{m, m, m}, {0.0f, 0.0f, 1.0f}, 0.22f * n, 0.07f * n};
    all->bar = bar;
    all->box = box;
    all->notched = notched;
    all->zalesak = zalesak;
    all->torus = torus;
    all->ball = ball_at(middle + 0.22 * size, middle, middle, 0.12 * size);
    all->still = ball_at(middle, middle, middle, ball_radius * size);
    all->leveque = ball_at(0.35 * size, 0.35 * size, 0.35 * size, 0.15 * size);
    all->breathing = ball_at(middle, middle, middle, breathing_radius * size);
    all->carried = ball_at(middle - 0.1 * size, middle - 0.1 * size, middle - 0.1 * size, 0.14 * size);
    all->stirred = ball_at(middle, middle, middle, 0.12 * size);
    two_balls(size, 0.11, all->near, &all->two_near);
    two_balls(size, 0.14, all->far, &all->two_far);
}

static void make_bodies(struct known_motions *all, int grid, bool scans)
{
    struct motion *motions = all->motions;
    make_shapes(all, (float)grid);
    take_shape(&motions[TWIST], springls_implicit_box, &all->bar);
    take_shape(&motions[SHEAR], springls_implicit_torus, &all->torus);
    take_shape(&motions[GROW], springls_implicit_notched_sphere, &all->notched);
    take_shape(&motions[TOUCH], springls_implicit_metasphere, &all->two_near);
    take_shape(&motions[PRESS], springls_implicit_metasphere, &all->two_far);
    take_shape(&motions[SWIRL], springls_implicit_sphere, &all->ball);
    take_shape(&motions[TURN], springls_implicit_box, &all->box);
    take_shape(&motions[WIND], springls_implicit_sphere, &all->still);
    take_shape(&motions[ZALESAK], springls_implicit_notched_sphere, &all->zalesak);
    take_shape(&motions[BREATHE], springls_implicit_sphere, &all->breathing);
    take_shape(&motions[ABC], springls_implicit_sphere, &all->carried);
    take_shape(&motions[GYRE], springls_implicit_sphere, &all->stirred);
    for (int m = LEVEQUE_SHORT; m <= LEVEQUE; ++m) {
        take_shape(&motions[m], springls_implicit_sphere, &all->leveque);
    }
    all->flows[SCREW].part_cells = (int)(part_size * grid / cell_voxels);
    if (make_part(&all->flows[SCREW], &all->meshes[SCREW])) {
        motions[SCREW].mesh = &all->meshes[SCREW];
        motions[SCREW].on_edge = part_on_edge;
    }
    if (scans && read_body("armadillo.off", grid, 0.6, &all->meshes[TWIST])) {
        motions[TWIST].mesh = &all->meshes[TWIST];
        motions[TWIST].problem.shape = NULL;
        all->names[TWIST] = "armadillo twisted and back";
    }
    if (scans && read_body("stanford-bunny.obj", grid, 0.5, &all->meshes[GROW])) {
        motions[GROW].mesh = &all->meshes[GROW];
        motions[GROW].problem.shape = NULL;
        all->names[GROW] = "bunny 1.6 times as large and back";
    }
}

static void make_flows(struct known_motions *all, int grid)
{
    static const double back[KNOWN_MOTIONS] = {1.0, 1.0, 1.0, 4.0, 2.5};
    static void (*const fields[KNOWN_MOTIONS])(const double *, double *) = {twist, shear, grow,   touch,  press,  screw, swirl,
                                                                            turn,  wind,  deform, deform, deform, turn};
    static const double periods[3] = {1.25, 2.0, 2.5};
    for (int m = 0; m < KNOWN_MOTIONS; ++m) {
        struct benchmark *problem = &all->motions[m].problem;
        struct known_flow *flow = &all->flows[m];
        const bool leveque = m >= LEVEQUE_SHORT && m <= LEVEQUE;
        flow->grid = grid;
        flow->field = fields[m];
        flow->middle = leveque ? 0.0 : m == ZALESAK ? 0.5 * grid : middle_of(grid);
        flow->period = leveque ? periods[m - LEVEQUE_SHORT] : 0.0;
        flow->back = back[m];
        problem->name = all->names[m];
        problem->grid = grid;
        /* The paper's steps, in pairs: of 0.64 / grid, and 628 a turn on 128^3. */
        problem->steps = leveque ? 2 * (int)floor(flow->period * grid / 1.28 + 0.5)
                       : m == ZALESAK ? 2 * (int)floor(314.0 * grid / 128.0) : 0;
        problem->duration = leveque ? flow->period : DURATION;
        problem->reverses = back[m] == 1.0 || leveque || m == ZALESAK || m == BREATHE;
        problem->flow = flow;
        problem->exact_velocity = velocity;
        problem->exact_time_factor = time_factor;
        all->motions[m].halfway_volume = m == GROW ? growth * growth * growth
                                       : m == BREATHE ? pow(1.0 + breathing_growth, 3.0) : 1.0;
    }
    all->flows[BREATHE].unsteady = breathe;
    all->motions[BREATHE].problem.velocity = breathing_velocity;
    all->motions[BREATHE].pressure = breathing_pressure;
    all->flows[ABC].unsteady = abc;
    all->motions[ABC].problem.duration = 1.0;
    all->flows[GYRE].unsteady = double_gyre;
    all->motions[GYRE].problem.duration = 2.6;
}

void known_motions_make(int grid, bool scans, struct known_motions *all)
{
    static const char *const names[KNOWN_MOTIONS] = {"bar twisted and back", "torus sheared and back",
        "notched ball 1.6 times as large and back", "two balls made to touch and parted", "two balls pressed flat and parted",
        "part with edges turned and moved", "ball rolled up by a vortex", "box, one turn", "ball at rest in a wind",
        "LeVeque, period 1.25", "LeVeque, period 2", "LeVeque, period 2.5", "Zalesak, one turn", "ball that swells and shrinks",
        "ball in an unsteady ABC flow", "ball in a double gyre"};
    memset(all, 0, sizeof *all);
    memcpy(all->names, names, sizeof names);
    make_flows(all, grid);
    make_bodies(all, grid, scans);
}

void known_motions_free(struct known_motions *all)
{
    for (int m = 0; m < KNOWN_MOTIONS; ++m) {
        mesh_free(&all->meshes[m]);
    }
}
