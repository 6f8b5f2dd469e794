/* skin.c - a skin for particles: a dam breaks in a tank (FLIP), and a model follows the union of the particles, frame by frame. */
#include "springls.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NX = 24, NY = 10, NZ = 16, CELLS = NX * NY * NZ, MOST = 8 * 8 * NY * 10, BIN = 32 };

static float x[MOST][3], v[MOST][3];                        /* particles, cells and cells a unit of time */
static float u[3][CELLS], before[3][CELLS], weight[3][CELLS]; /* velocity k on the lower wall k of each cell */
static float pressure[CELLS];
static int fluid[CELLS], bin[CELLS][BIN], binned[CELLS], particles;
static const int size[3] = {NX, NY, NZ}, step_to[3] = {1, NX, NX * NY};
static const float radius = 0.8f; /* of a particle, cells */

static int clampi(int i, int most) { return i < 0 ? 0 : i > most ? most : i; }
static int cell_at(const float *p)
{
    return clampi((int)p[0], NX - 1) + NX * (clampi((int)p[1], NY - 1) + NY * clampi((int)p[2], NZ - 1));
}

/* The eight places around p where velocity k is known, and their shares. */
static void around(const float *p, int k, int place[8], float share[8])
{
    int at[3];
    float t[3];
    for (int a = 0; a < 3; a++) {
        float q = p[a] - (a == k ? 0 : 0.5f);
        at[a] = clampi((int)floorf(q), size[a] - 2);
        t[a] = fminf(fmaxf(q - (float)at[a], 0), 1);
    }
    for (int c = 0; c < 8; c++) {
        place[c] = 0;
        share[c] = 0;
        for (int a = 0; a < 3; a++) place[c] += step_to[a] * (at[a] + (c >> a & 1));
        share[c] = (c & 1 ? t[0] : 1 - t[0]) * (c & 2 ? t[1] : 1 - t[1]) * (c & 4 ? t[2] : 1 - t[2]);
    }
}

static float velocity_at(float field[3][CELLS], const float *p, int k)
{
    int place[8];
    float share[8], sum = 0;
    around(p, k, place, share);
    for (int c = 0; c < 8; c++) sum += share[c] * field[k][place[c]];
    return sum;
}

/* Returns whether wall f of cells along axis k is one of the tank, whose cells are 1 to size - 2. */
static int is_wall(int f, int k) { return f <= 1 || f >= size[k] - 1; }

/* Velocities do not pass walls; where there is no fluid, they are those of the neighbours that have some. */
static void walls_and_air(void)
{
    for (int k = 0; k < 3; k++)
        for (int round = 0; round < 3; round++)
            for (int c = 0; c < CELLS; c++) {
                int at[3] = {c % NX, c / NX % NY, c / (NX * NY)}, n = 0;
                float sum = 0;
                if (is_wall(at[k], k)) u[k][c] = 0;
                if (weight[k][c] > 0 || is_wall(at[k], k)) continue;
                for (int a = 0; a < 6; a++) {
                    int to = at[a / 2] + (a % 2 ? 1 : -1), d = c + (a % 2 ? 1 : -1) * step_to[a / 2];
                    if (to >= 0 && to < size[a / 2] && weight[k][d] > 0) sum += u[k][d], n++;
                }
                if (n) u[k][c] = sum / (float)n;
            }
}

/* Makes the fluid incompressible: pressures by Gauss and Seidel; walls push back, air does not. */
static void project(void)
{
    memset(pressure, 0, sizeof pressure);
    for (int round = 0; round < 60; round++)
        for (int c = 0; c < CELLS; c++) {
            int at[3] = {c % NX, c / NX % NY, c / (NX * NY)};
            float flow = 0, sum = 0, open = 0;
            if (!fluid[c]) continue;
            for (int k = 0; k < 3; k++) {
                if (!is_wall(at[k], k)) sum += pressure[c - step_to[k]], open++, flow -= u[k][c];
                if (!is_wall(at[k] + 1, k)) sum += pressure[c + step_to[k]], open++, flow += u[k][c + step_to[k]];
            }
            pressure[c] = (sum - flow - 0.5f * fminf(8.0f - (float)binned[c], 0)) / open; /* crowds drift apart */
        }
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < CELLS; c++)
            if (!is_wall(c / step_to[k] % size[k], k) && (fluid[c] || fluid[c - step_to[k]]))
                u[k][c] -= pressure[c] - pressure[c - step_to[k]];
}

static void advance(float dt)
{
    memset(u, 0, sizeof u), memset(weight, 0, sizeof weight), memset(binned, 0, sizeof binned), memset(fluid, 0, sizeof fluid);
    for (int i = 0; i < particles; i++) {
        int c = cell_at(x[i]), place[8];
        float share[8];
        fluid[c] = 1;
        if (binned[c] < BIN) bin[c][binned[c]++] = i;
        for (int k = 0; k < 3; k++) {
            around(x[i], k, place, share);
            for (int d = 0; d < 8; d++) u[k][place[d]] += share[d] * v[i][k], weight[k][place[d]] += share[d];
        }
    }
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < CELLS; c++) {
            if (weight[k][c] > 0) u[k][c] /= weight[k][c];
            before[k][c] = u[k][c];
            if (k == 2) u[k][c] -= 1.0f * dt; /* gravity */
        }
    walls_and_air();
    project();
    walls_and_air();
    for (int i = 0; i < particles; i++) {
        float half[3], now[3];
        for (int k = 0; k < 3; k++) now[k] = velocity_at(u, x[i], k), half[k] = x[i][k] + 0.5f * dt * now[k];
        for (int k = 0; k < 3; k++) v[i][k] = now[k] + 0.9f * (v[i][k] - velocity_at(before, x[i], k)); /* FLIP and some PIC */
        for (int k = 0; k < 3; k++) x[i][k] = fminf(fmaxf(x[i][k] + dt * velocity_at(u, half, k), 1.05f), (float)size[k] - 1.05f);
    }
}

/* The least of a squared distance and those of the particles of cell c from p. */
static float nearest_in(int c, const float *p, float least)
{
    for (int n = 0; n < binned[c]; n++) {
        const float *q = x[bin[c][n]];
        float d2 = (p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) + (p[2] - q[2]) * (p[2] - q[2]);
        least = d2 < least ? d2 : least;
    }
    return least;
}

/* The distance to the union of the particles, cut short at a cell. Where there are particles in the cell of a place, only those cells
   are looked into that may have nearer ones. */
static void union_of(void *user, const float *p, int count, float *out)
{
    (void)user;
    for (int i = 0; i < count; i++, p += 3) {
        float least = nearest_in(cell_at(p), p, (1.0f + radius) * (1.0f + radius)), reach = sqrtf(least);
        int from[3], to[3];
        for (int k = 0; k < 3; k++) {
            from[k] = clampi((int)floorf(p[k] - reach), size[k]);
            to[k] = clampi((int)floorf(p[k] + reach), size[k] - 1);
        }
        for (int z = from[2]; z <= to[2]; z++)
            for (int y = from[1]; y <= to[1]; y++)
                for (int c = from[0] + NX * (y + NY * z); c <= to[0] + NX * (y + NY * z); c++) least = nearest_in(c, p, least);
        out[i] = sqrtf(least) - radius;
    }
}

static void flow(void *user, const float *p, int count, float time, float *out)
{
    (void)user, (void)time;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) out[3 * i + k] = velocity_at(u, p + 3 * i, k);
}

static void bin_again(void)
{
    memset(binned, 0, sizeof binned);
    for (int i = 0; i < particles; i++) {
        int c = cell_at(x[i]);
        if (binned[c] < BIN) bin[c][binned[c]++] = i;
    }
}

static void ok(springls_context *model, springls_status status)
{
    if (status != SPRINGLS_OK) puts(springls_last_error(model)), exit(1);
}

int main(int argc, char **argv)
{
    const int frames = argc > 1 ? atoi(argv[1]) : 24;
    const float dt = 0.25f;
    springls_desc desc = springls_default_desc();
    springls_params params = springls_default_params();
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    springls_follow_desc follow = {.fn = union_of};
    springls_context *skin, *alone;
    springls_measures m, right;

    for (int i = 0; i < MOST; i++, particles++) { /* two a cell along each axis, a little off their places */
        int at[3] = {i % 16, i / 16 % (2 * NY - 4), i / (16 * (2 * NY - 4))};
        if (at[2] >= 20) break;
        for (int k = 0; k < 3; k++) x[i][k] = 1.25f + 0.5f * (float)at[k] + 0.1f * ((float)((i * (7 + 4 * k)) % 13) / 13 - 0.5f);
    }
    params.keep_edges = 0; /* a fluid has none */
    desc.params = &params;
    for (int k = 0; k < 3; k++) desc.grid.size[k] = 2 * size[k], desc.grid.spacing[k] = 0.5;
    if (springls_create(&desc, &skin) || springls_create(&desc, &alone)) return puts("no memory"), 1;
    bin_again();
    ok(skin, springls_set_implicit(skin, union_of, NULL));
    forces.velocity = flow;
    step.forces = &forces;
    step.dt = dt;
    for (int frame = 1; frame <= frames; frame++) {
        advance(dt);
        bin_again();
        ok(skin, springls_step(skin, &step));               /* springls come along with the flow */
        ok(skin, springls_follow_level_set(skin, &follow)); /* and lie on the particles' union */
        if (frames > 4 && frame % (frames / 4) != 0) continue;
        ok(skin, springls_measure(skin, &m));
        ok(alone, springls_set_implicit(alone, union_of, NULL));
        ok(alone, springls_measure(alone, &right));
        printf("frame %3d: front at %4.1f, volume off by %.1f %%\n", frame, m.upper[0], fabs(100 * (m.volume / right.volume - 1)));
    }
    springls_destroy(skin);
    springls_destroy(alone);
    return 0;
}
