/* solids_shapes.c - rings, a knot, a boulder, a bowl with a wall, and solids of cubes with sharp edges. */
#include "solids_shapes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979

static bool make_room(struct mesh *mesh, size_t vertices, size_t triangles)
{
    memset(mesh, 0, sizeof *mesh);
    mesh->positions = malloc(3 * vertices * sizeof *mesh->positions);
    mesh->indices = malloc(3 * triangles * sizeof *mesh->indices);
    if (!mesh->positions || !mesh->indices) {
        mesh_free(mesh);
        return false;
    }
    return true;
}

static void add_place(struct mesh *mesh, double x, double y, double z)
{
    float *place = mesh->positions + 3 * mesh->vertex_count++;
    place[0] = (float)x;
    place[1] = (float)y;
    place[2] = (float)z;
}

static void add_triangle(struct mesh *mesh, int a, int b, int c)
{
    uint32_t *corner = mesh->indices + 3 * mesh->triangle_count++;
    corner[0] = (uint32_t)a;
    corner[1] = (uint32_t)b;
    corner[2] = (uint32_t)c;
}

static void add_quad(struct mesh *mesh, int a, int b, int c, int d)
{
    add_triangle(mesh, a, b, c);
    add_triangle(mesh, a, c, d);
}

/* ---- tubes ---- */

static void circle(double u, double place[3])
{
    place[0] = cos(u);
    place[1] = sin(u);
    place[2] = 0.0;
}

static void trefoil(double u, double place[3])
{
    place[0] = sin(u) + 2.0 * sin(2.0 * u);
    place[1] = cos(u) - 2.0 * cos(2.0 * u);
    place[2] = -sin(3.0 * u);
}

/* Makes a tube around a closed curve that is never upright. */
static bool tube(void (*curve)(double, double *), int along, int around, double radius, struct mesh *mesh)
{
    if (!make_room(mesh, (size_t)(along * around), (size_t)(2 * along * around))) {
        return false;
    }
    for (int i = 0; i < along; ++i) {
        const double u = 2.0 * PI * i / along, step = 1e-4;
        double at[3], ahead[3];
        curve(u, at);
        curve(u + step, ahead);
        const double t[3] = {ahead[0] - at[0], ahead[1] - at[1], ahead[2] - at[2]};
        const double flat = hypot(t[0], t[1]), length = hypot(flat, t[2]);
        const double n[3] = {t[1] / flat, -t[0] / flat, 0.0}; /* level, and b = n x t upwards */
        const double b[3] = {n[1] * t[2] / length, -n[0] * t[2] / length, (n[0] * t[1] - n[1] * t[0]) / length};
        for (int j = 0; j < around; ++j) {
            const double c = radius * cos(2.0 * PI * j / around), s = radius * sin(2.0 * PI * j / around);
            add_place(mesh, at[0] + c * n[0] + s * b[0], at[1] + c * n[1] + s * b[1], at[2] + c * n[2] + s * b[2]);
            const int down = (i + 1) % along * around, right = (j + 1) % around;
            add_quad(mesh, i * around + j, down + j, down + right, i * around + right);
        }
    }
    return true;
}

/* ---- surfaces around the z axis ---- */

typedef void profile(double s, double angle, double *r, double *z); /* s from 0 at the lower pole to 1 at the upper one */

static void boulder(double s, double angle, double *r, double *z)
{
    const double polar = PI * (1.0 - s), x = sin(polar) * cos(angle), y = sin(polar) * sin(angle), up = cos(polar);
    const double radius = 1.0 + 0.12 * sin(3.0 * x + 1.0) * sin(4.0 * y) + 0.1 * cos(5.0 * up + 2.0 * x)
        + 0.02 * sin(17.0 * x) * sin(19.0 * y + up) + 0.015 * cos(23.0 * up + 9.0 * y);
    *r = radius * sin(polar);
    *z = radius * up;
}

/* A bowl with a round rim: outside up, over the rim, inside down. */
static void bowl(double s, double angle, double *r, double *z)
{
    const double outer = 1.0, wall = 0.1, middle = outer - 0.5 * wall, rim = 0.62 * PI, turn = 0.08; /* share of the way over the rim */
    const double side = 0.5 * (1.0 - turn), over = (s - side) / turn;
    const double polar = s < side ? rim * s / side : s > 1.0 - side ? rim * (1.0 - s) / side : rim;
    const double radius = s < side ? outer : s > 1.0 - side ? outer - wall : middle;
    (void)angle;
    *r = radius * sin(polar);
    *z = -radius * cos(polar);
    if (s >= side && s <= 1.0 - side) {
        *r += 0.5 * wall * (cos(PI * over) * sin(rim) + sin(PI * over) * cos(rim));
        *z += 0.5 * wall * (-cos(PI * over) * cos(rim) + sin(PI * over) * sin(rim));
    }
}

static bool turned(profile *shape, int along, int around, struct mesh *mesh)
{
    double r, z;
    if (!make_room(mesh, (size_t)((along - 1) * around + 2), (size_t)(2 * (along - 1) * around))) {
        return false;
    }
    for (int i = 1; i < along; ++i) {
        for (int j = 0; j < around; ++j) {
            const double angle = 2.0 * PI * j / around;
            shape((double)i / along, angle, &r, &z);
            add_place(mesh, r * cos(angle), r * sin(angle), z);
        }
    }
    const int lower = (along - 1) * around, upper = lower + 1;
    shape(0.0, 0.0, &r, &z);
    add_place(mesh, 0.0, 0.0, z);
    shape(1.0, 0.0, &r, &z);
    add_place(mesh, 0.0, 0.0, z);
    for (int j = 0; j < around; ++j) {
        const int right = (j + 1) % around, last = (along - 2) * around;
        add_triangle(mesh, lower, right, j);
        add_triangle(mesh, upper, last + j, last + right);
        for (int i = 0; i + 2 < along; ++i) {
            add_quad(mesh, i * around + j, i * around + right, (i + 1) * around + right, (i + 1) * around + j);
        }
    }
    return true;
}

/* ---- solids of cubes ---- */

struct cubes {
    int dims[3];
    const char *there; /* '#', x fastest */
};

static bool is_there(const struct cubes *c, const int at[3])
{
    for (int k = 0; k < 3; ++k) {
        if (at[k] < 0 || at[k] >= c->dims[k]) {
            return false;
        }
    }
    return c->there[at[0] + c->dims[0] * (at[1] + c->dims[1] * at[2])] == '#';
}

/* Returns the vertex at a place of the lattice. */
static int lattice_vertex(const struct cubes *c, int parts, const int at[3], int *numbers, struct mesh *mesh)
{
    int *number = &numbers[at[0] + (c->dims[0] * parts + 1) * (at[1] + (c->dims[1] * parts + 1) * at[2])];
    if (*number < 0) {
        *number = (int)mesh->vertex_count;
        add_place(mesh, (double)at[0] / parts, (double)at[1] / parts, (double)at[2] / parts);
    }
    return *number;
}

/* Adds the face of a cube that looks along an axis, in parts x parts squares. */
static void add_face(const struct cubes *c, int parts, const int cube[3], int axis, int upper, int *numbers, struct mesh *mesh)
{
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int i = 0; i < parts; ++i) {
        for (int j = 0; j < parts; ++j) {
            int corner[4];
            for (int k = 0; k < 4; ++k) {
                int at[3];
                at[axis] = (cube[axis] + upper) * parts;
                at[u] = cube[u] * parts + i + (k == 1 || k == 2);
                at[v] = cube[v] * parts + j + (k >= 2);
                corner[k] = lattice_vertex(c, parts, at, numbers, mesh);
            }
            add_quad(mesh, corner[0], corner[upper ? 1 : 3], corner[2], corner[upper ? 3 : 1]);
        }
    }
}

static bool of_cubes(const struct cubes *c, int parts, struct mesh *mesh)
{
    size_t places = 1;
    for (int k = 0; k < 3; ++k) {
        places *= (size_t)(c->dims[k] * parts + 1);
    }
    int *numbers = malloc(places * sizeof *numbers);
    if (!numbers || !make_room(mesh, places, 12 * (size_t)(parts * parts) * strlen(c->there))) {
        free(numbers);
        return false;
    }
    memset(numbers, 0xff, places * sizeof *numbers); /* -1 */
    for (int i = 0; c->there[i]; ++i) {
        const int cube[3] = {i % c->dims[0], i / c->dims[0] % c->dims[1], i / (c->dims[0] * c->dims[1])};
        for (int side = 0; side < 6 && c->there[i] == '#'; ++side) {
            int next[3] = {cube[0], cube[1], cube[2]};
            next[side / 2] += side % 2 ? 1 : -1;
            if (!is_there(c, next)) {
                add_face(c, parts, cube, side / 2, side % 2, numbers, mesh);
            }
        }
    }
    free(numbers);
    return true;
}

static const struct cubes block = {{3, 2, 1}, "######"};
static const struct cubes bracket = {{5, 4, 3}, "#####" "#.#.#" "#####" "#####"
                                                "....." "....." "....." "#####"
                                                "....." "....." "....." "#####"};
static const struct cubes cage = {{3, 3, 3}, "####.####" "#.#...#.#" "####.####"};

/* ---- all ---- */

/* Turns a mesh, so that no side of it lies along the axes. */
static void incline(struct mesh *mesh)
{
    const double a = 0.5, b = 0.3, ca = cos(a), sa = sin(a), cb = cos(b), sb = sin(b);
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        float *p = mesh->positions + 3 * v;
        const double x = ca * (double)p[0] - sa * (double)p[1], y = sa * (double)p[0] + ca * (double)p[1], z = (double)p[2];
        p[0] = (float)x;
        p[1] = (float)(cb * y - sb * z);
        p[2] = (float)(sb * y + cb * z);
    }
}

bool solids_shape(int number, struct mesh *mesh, const char **name)
{
    static const char *const names[SOLIDS_GENERATED] = {"ring", "knot", "boulder", "bowl", "block", "bracket", "cage"};
    bool fine = false;
    *name = names[number];
    switch (number) {
    case 0: fine = tube(circle, 96, 48, 0.45, mesh); break;
    case 1: fine = tube(trefoil, 240, 32, 0.5, mesh); break;
    case 2: fine = turned(boulder, 80, 120, mesh); break;
    case 3: fine = turned(bowl, 120, 96, mesh); break;
    case 4: fine = of_cubes(&block, 20, mesh); break;
    case 5: fine = of_cubes(&bracket, 10, mesh); break;
    default: fine = of_cubes(&cage, 9, mesh); break;
    }
    if (fine && number != 6) { /* the cage: its sides stay along the axes, as a grid has them */
        incline(mesh);
    }
    return fine;
}
