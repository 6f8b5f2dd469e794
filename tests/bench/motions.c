/* motions - the default parameters, the same for all, on motions whose answer is known: bodies that are twisted, sheared and
 * blown up and brought back, two that touch and part, a part with sharp edges that turns, a ball that a vortex rolls up.
 *
 *   GRID=64 make motions     another grid than 128^3
 *   STEP=1 make motions      voxels a step at most, instead of 2
 *   ORDERS=1 make motions    quick: one order of the springls instead of the mean over three
 *   ONLY=cover make motions  the table of coverage alone
 *
 * The scanned bodies come from SPRINGLS_DATA; without it other shapes stand in for them. Prints tables;
 * build/bench/motions.json has every figure of every run. */
#include "springls.h"

#include "motion.h"
#include "table.h"

#include <math.h>
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

/* All last from 0 to DURATION. Those that go back have moved by one unit of their field at half time. */
enum { DURATION = 2 };

struct flow {
    double grid;
    void (*field)(const double x[3], double v[3]);
    double back;    /* times as far back as there; 0: on and on */
    int part_cells; /* of the part's longest side */
};

static void velocity(const void *user, const double x[3], double factor, double v[3])
{
    const struct flow *flow = user;
    double y[3];
    for (int c = 0; c < 3; ++c) {
        y[c] = (x[c] - middle_of(flow->grid)) / flow->grid;
    }
    flow->field(y, v);
    for (int c = 0; c < 3; ++c) {
        v[c] *= factor * flow->grid;
    }
}

static double time_factor(const void *user, double time)
{
    const struct flow *flow = user;
    const double there = pi / DURATION * cos(pi * time / DURATION);
    return flow->back > 0.0 ? there * (2.0 * time > DURATION ? flow->back : 1.0) : 1.0 / DURATION;
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
static double part_corner(const struct flow *flow)
{
    return middle_of(flow->grid) - 0.5 * cell_voxels * flow->part_cells;
}

/* The eight cells about a vertex show how many of the axes have a face there: two or more make an edge. */
static bool part_on_edge(const void *user, const float x[3])
{
    const struct flow *flow = user;
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
static void add_face(struct mesh *mesh, const struct flow *flow, const int cell[3], int axis, int side)
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

static bool make_part(const struct flow *flow, struct mesh *mesh)
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

enum motion_number { TWIST, SHEAR, GROW, TOUCH, PRESS, SCREW, SWIRL, TURN, WIND, MOTIONS };

static const int wanted_parts[MOTIONS][3] = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {2, 1, 2}, {2, 1, 2}, {1, 1, 1}, {1, 1, 1},
                                              {1, 1, 1}, {1, 1, 1}};

struct bodies {
    struct mesh meshes[MOTIONS];
    springls_box bar, box;
    springls_notched_sphere notched;
    springls_torus torus;
    springls_sphere near[2], far[2], ball, still;
    springls_metasphere two_near, two_far;
};

static void take_shape(struct motion *motion, springls_implicit_fn shape, void *data)
{
    motion->problem.shape = shape;
    motion->problem.shape_data = data;
}

/* Two balls on both sides of the plane x = 0, their centres `apart` from it. */
static void two_balls(float n, float apart, springls_sphere spheres[2], springls_metasphere *two)
{
    const float m = (float)middle_of((double)n);
    const springls_sphere left = {{m - apart * n, m, m}, 0.1f * n}, right = {{m + apart * n, m, m}, 0.1f * n};
    spheres[0] = left;
    spheres[1] = right;
    two->spheres = spheres;
    two->count = 2;
}

static void make_bodies(struct bodies *b, float n, struct motion *motions, struct flow *flows)
{
    const float m = (float)middle_of((double)n);
    const springls_box bar = {{m, m, m}, {0.12f * n, 0.3f * n, 0.12f * n}};
    const springls_notched_sphere notched = {{m, m, m}, 0.25f * n, 0.1f * n, 0.35f * n};
    const springls_torus torus = {{m, m, m}, {0.0f, 0.0f, 1.0f}, 0.22f * n, 0.07f * n};
    const springls_sphere ball = {{m + 0.22f * n, m, m}, 0.12f * n}, still = {{m, m, m}, (float)ball_radius * n};
    const springls_box box = {{m + 0.2f * n, m, m}, {0.12f * n, 0.1f * n, 0.14f * n}};
    b->bar = bar;
    b->notched = notched;
    b->torus = torus;
    b->ball = ball;
    b->still = still;
    b->box = box;
    two_balls(n, 0.11f, b->near, &b->two_near);
    two_balls(n, 0.14f, b->far, &b->two_far);
    if (read_body("armadillo.off", (double)n, 0.6, &b->meshes[TWIST])) {
        motions[TWIST].mesh = &b->meshes[TWIST];
    } else {
        take_shape(&motions[TWIST], springls_implicit_box, &b->bar);
    }
    if (read_body("stanford-bunny.obj", (double)n, 0.5, &b->meshes[GROW])) {
        motions[GROW].mesh = &b->meshes[GROW];
    } else {
        take_shape(&motions[GROW], springls_implicit_notched_sphere, &b->notched);
    }
    flows[SCREW].part_cells = (int)(part_size * (double)n / cell_voxels);
    if (make_part(&flows[SCREW], &b->meshes[SCREW])) {
        motions[SCREW].mesh = &b->meshes[SCREW];
        motions[SCREW].on_edge = part_on_edge;
    }
    take_shape(&motions[SHEAR], springls_implicit_torus, &b->torus);
    take_shape(&motions[TOUCH], springls_implicit_metasphere, &b->two_near);
    take_shape(&motions[PRESS], springls_implicit_metasphere, &b->two_far);
    take_shape(&motions[SWIRL], springls_implicit_sphere, &b->ball);
    take_shape(&motions[TURN], springls_implicit_box, &b->box);
    take_shape(&motions[WIND], springls_implicit_sphere, &b->still);
}

static void make_motions(int grid, struct motion motions[MOTIONS], struct flow flows[MOTIONS])
{
    static const double back[MOTIONS] = {1.0, 1.0, 1.0, 4.0, 2.5, 0.0, 0.0, 0.0, 0.0};
    static void (*const fields[MOTIONS])(const double *, double *) = {twist, shear, grow, touch, press, screw, swirl, turn, wind};
    for (int m = 0; m < MOTIONS; ++m) {
        struct benchmark *problem = &motions[m].problem;
        flows[m].grid = grid;
        flows[m].field = fields[m];
        problem->grid = grid;
        problem->duration = DURATION;
        flows[m].back = back[m];
        problem->reverses = back[m] == 1.0;
        problem->flow = &flows[m];
        problem->exact_velocity = velocity;
        problem->exact_time_factor = time_factor;
        motions[m].halfway_volume = m == GROW ? growth * growth * growth : 1.0;
    }
}

/* ---- tables ---- */

/* Three figures that belong together: mean, 99 in 100, largest. */
static const char *error_cell(const struct motion_case *c, int orders, enum motion_figure first, char text[TABLE_CELL])
{
    double means[3];
    for (int k = 0; k < 3; ++k) {
        means[k] = motion_mean(c, orders, (enum motion_figure)((int)first + k));
    }
    snprintf(text, TABLE_CELL, isfinite(means[0]) ? "%.4f / %.3f / %.2f" : "-", means[0], means[1], means[2]);
    return text;
}

/* Mean and largest. */
static const char *edge_cell(const struct motion_case *c, int orders, enum motion_figure first)
{
    return cell2("%.3f / %.2f", motion_mean(c, orders, first), motion_mean(c, orders, (enum motion_figure)((int)first + 1)));
}

/* A count at the start, at half time and at the end; a range where the orders differ. */
static const char *phases_cell(const struct motion_case *c, int orders, enum motion_figure first, char text[TABLE_CELL])
{
    size_t length = 0;
    for (int k = 0; k < 3; ++k) {
        const struct motion_spread s = motion_spread(c, orders, (enum motion_figure)((int)first + k));
        const char *number = s.least < s.most ? cell2("%g..%g", s.least, s.most) : cell("%g", s.mean);
        length += (size_t)snprintf(text + length, TABLE_CELL - length, "%s%s", k > 0 ? ", " : "", number);
    }
    return text;
}

static void print_errors(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "errors|tracking mean / 99 %% / max|tracking mean, orders|at half time|volume at half time|volume at the end");
    for (const struct motion_case *c = cases; c < cases + MOTIONS; ++c) {
        const struct motion_spread tracking = motion_spread(c, orders, MOTION_tracking_mean);
        char end[TABLE_CELL], halfway[TABLE_CELL];
        table_row(&table, "%s|%s|%s|%s|%s|%s", c->name, error_cell(c, orders, MOTION_tracking_mean, end),
                  cell2("%.4f..%.4f", tracking.least, tracking.most), error_cell(c, orders, MOTION_halfway_mean, halfway),
                  cell("%+.3f %%", motion_mean(c, orders, MOTION_volume_halfway)),
                  cell("%+.3f %%", motion_mean(c, orders, MOTION_volume_end)));
    }
    table_print(&table, stdout);
    printf("\n");
}

static void print_error_estimates(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "half time / end|springls within the estimate|median estimate over error|"
                      "vertices of the zero level within it|median");
    for (const struct motion_case *c = cases; c < cases + MOTIONS; ++c) {
        static const char share[] = "%.1f %% / %.1f %%", ratio[] = "%.1f / %.1f";
        table_row(&table, "%s|%s|%s|%s|%s", c->name,
                  cell2(share, motion_mean(c, orders, MOTION_within_halfway), motion_mean(c, orders, MOTION_within_end)),
                  cell2(ratio, motion_mean(c, orders, MOTION_ratio_halfway), motion_mean(c, orders, MOTION_ratio_end)),
                  cell2(share, motion_mean(c, orders, MOTION_mesh_within_halfway),
                        motion_mean(c, orders, MOTION_mesh_within_end)),
                  cell2(ratio, motion_mean(c, orders, MOTION_mesh_ratio_halfway), motion_mean(c, orders, MOTION_mesh_ratio_end)));
    }
    table_print(&table, stdout);
    printf("\n");
}

static void print_surfaces(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "from the exact surface|to the zero level, start mean / 99 %% / max|to the zero level|to springls|"
                      "at sharp edges: to the zero level, start mean / max|to the zero level|to springls");
    for (const struct motion_case *c = cases; c < cases + MOTIONS; ++c) {
        char start[TABLE_CELL], end[TABLE_CELL], soup[TABLE_CELL];
        table_row(&table, "%s|%s|%s|%s|%s|%s|%s", c->name, error_cell(c, orders, MOTION_start_mean, start),
                  error_cell(c, orders, MOTION_end_mean, end), error_cell(c, orders, MOTION_soup_mean, soup),
                  edge_cell(c, orders, MOTION_start_edge_mean), edge_cell(c, orders, MOTION_end_edge_mean),
                  edge_cell(c, orders, MOTION_soup_edge_mean));
    }
    table_print(&table, stdout);
    printf("\n");
}

static void print_coverage(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "coverage|covered, mean|least|covered twice, most|area of the springls over the surface's");
    for (const struct motion_case *c = cases; c < cases + MOTIONS; ++c) {
        table_row(&table, "%s|%s|%s|%s|%s", c->name, cell("%.1f %%", 100.0 * motion_mean(c, orders, MOTION_covered_mean)),
                  cell("%.1f %%", 100.0 * motion_spread(c, orders, MOTION_covered_least).least),
                  cell("%.1f %%", 100.0 * motion_spread(c, orders, MOTION_covered_twice_most).most),
                  cell2("%.2f to %.2f", motion_spread(c, orders, MOTION_coverage_least).least,
                        motion_spread(c, orders, MOTION_coverage_most).most));
    }
    table_print(&table, stdout);
    printf("\n");
}

static void print_topology(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "start, half time, end|parts wanted|parts|Euler");
    for (int m = 0; m < MOTIONS; ++m) {
        char parts[TABLE_CELL], euler[TABLE_CELL];
        table_row(&table, "%s|%d, %d, %d|%s|%s", cases[m].name, wanted_parts[m][0], wanted_parts[m][1], wanted_parts[m][2],
                  phases_cell(&cases[m], orders, MOTION_components_start, parts),
                  phases_cell(&cases[m], orders, MOTION_euler_start, euler));
    }
    table_print(&table, stdout);
    printf("\n");
}

static void print_costs(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "springls|at the start|mean|at the end|smallest angle min / mean|steps|ms a step|s");
    for (const struct motion_case *c = cases; c < cases + MOTIONS; ++c) {
        table_row(&table, "%s|%s|%s|%s|%s|%s|%s|%s", c->name, cell("%.0f", motion_mean(c, orders, MOTION_springls_start)),
                  cell("%.0f", motion_mean(c, orders, MOTION_springls_mean)),
                  cell("%.0f", motion_mean(c, orders, MOTION_springls_end)),
                  cell2("%.1f / %.1f", motion_mean(c, orders, MOTION_smallest_angle_min),
                        motion_mean(c, orders, MOTION_smallest_angle_mean)),
                  cell("%.0f", motion_mean(c, orders, MOTION_steps)), cell("%.1f", motion_mean(c, orders, MOTION_cpu_ms_a_step)),
                  cell("%.2f", motion_mean(c, orders, MOTION_cpu_seconds)));
    }
    table_print(&table, stdout);
}

static bool write_json(const struct motion_case *cases, int orders)
{
    struct json_writer json;
    if (!make_folder("build/bench") || !json_open(&json, "build/bench/motions.json")) {
        return false;
    }
    json_object_begin(&json, NULL);
    json_integer(&json, "grid", cases[0].motion->problem.grid);
    json_number(&json, "max_displacement", (double)cases[0].setting.max_displacement);
    json_array_begin(&json, "cases");
    for (int m = 0; m < MOTIONS; ++m) {
        json_object_begin(&json, NULL);
        motion_json(&json, &cases[m], orders);
        json_object_end(&json);
    }
    json_array_end(&json);
    json_object_end(&json);
    return json_close(&json);
}

int main(void)
{
    static struct bodies bodies;
    static struct flow flows[MOTIONS];
    static struct motion motions[MOTIONS];
    static struct motion_case cases[MOTIONS];
    const int grid = (int)environment_number("GRID", 128.0);
    const double step = environment_number("STEP", 2.0);
    const int orders = (int)environment_number("ORDERS", MOTION_ORDERS);
    if (grid < 32 || grid > 512 || !(step > 0.0 && step <= 8.0) || orders < 1 || orders > MOTION_ORDERS) {
        fprintf(stderr, "motions: GRID is 32..512, STEP up to 8, ORDERS 1..%d\n", (int)MOTION_ORDERS);
        return 2;
    }
    make_motions(grid, motions, flows);
    make_bodies(&bodies, (float)grid, motions, flows);
    const char *const names[MOTIONS] = {motions[TWIST].mesh ? "armadillo twisted and back" : "bar twisted and back",
                                        "torus sheared and back",
                                        motions[GROW].mesh ? "bunny 1.6 times as large and back"
                                                           : "notched ball 1.6 times as large and back",
                                        "two balls made to touch and parted", "two balls pressed flat and parted",
                                        "part with edges turned and moved",
                                        "ball rolled up by a vortex", "box, one turn", "ball at rest in a wind"};
    for (int m = 0; m < MOTIONS; ++m) {
        cases[m].name = names[m];
        cases[m].motion = &motions[m];
        cases[m].setting.params = springls_default_params();
        cases[m].setting.max_displacement = (float)step;
    }
    printf("Default parameters on %d^3, at most %g voxels a step. Lengths in voxels; every figure is the mean over %d orders of\n"
           "the springls, which differ by chance alone. Tracking is from a particle to the place where the exact flow takes its\n"
           "correspondence; the exact surface is that of the start moved by the exact flow, by points of it. ms and s are\n"
           "processor time of the steps.\n\n", grid, step, orders);
    fflush(stdout);
    motion_run_all(cases, MOTIONS, orders);
    const char *only = getenv("ONLY");
    if (!only || strcmp(only, "cover") != 0) {
        print_errors(cases, orders);
        print_error_estimates(cases, orders);
        print_surfaces(cases, orders);
        print_topology(cases, orders);
        print_costs(cases, orders);
    }
    print_coverage(cases, orders);
    int failures = motion_print_failures(cases, MOTIONS, orders);
    if (!write_json(cases, orders)) {
        fprintf(stderr, "motions: cannot write build/bench/motions.json\n");
        ++failures;
    }
    for (int m = 0; m < MOTIONS; ++m) {
        mesh_free(&bodies.meshes[m]);
    }
    return failures > 0;
}
