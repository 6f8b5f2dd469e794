/* films.h - surface tension, and volumes that are held. The walls of a tiling are a mesh (walls.h); its energy is the sum of surface
   tension times area over all walls. Each vertex goes down the energy's slope, for the area around it: within a wall that is motion by mean
   curvature, and where walls meet it is the pull of all of them, so that they come to rest at the angles of Plateau's and Neumann's laws.

   With the force F_v, the area m_v that belongs to vertex v, and the slope g_iv of the volume of body i, vertices move with

       u_v = (F_v + sum over i of p_i g_iv) / m_v

   where the pressures p_i are the Lagrange multipliers of the volumes that are held: sum over v of g_iv u_v is what body i lacks, over dt.
   What springls lose on their way, always alike, is aimed for in addition (drift).
   Springls take the mean velocity of the vertices about them, of the wall that they are part of: both sheets of a wall move alike.

   Where a wall has shrunk to a line, four walls meet in one: the pulls cancel, and no vertex would move, though the line is not stable. Two
   of the four bodies, opposite to each other, draw back from it, and the wall between the two others grows in between (a T1 change). The
   tip of body c, between a and b, is pulled by the walls with both, and held by the new one, with the length l of the line:

       f_c = |F_ca + F_cb| - tension_ab l

   Of the two pairs that may draw back those do whose f are positive, and larger in sum. */
#ifndef SPRINGLS__TILING_FILMS_H
#define SPRINGLS__TILING_FILMS_H

#include "walls.h"

enum { SPRINGLS__FILM_LABELS = 6 }; /* a vertex: more are passed over */

/* A vertex of the walls: the force on it, its direction in the solver, the area that belongs to it (mass), and the labels of its walls, -1
   behind the last. World units. */
typedef struct springls__film {
    double force[3], along[3], mass;
    springls__v3 place, velocity; /* voxels                                                                            */
    int32_t label[SPRINGLS__FILM_LABELS];
    int junction;                 /* its number, -1: it is none                                                        */
} springls__film;

enum { SPRINGLS__JUNCTION_LABELS = 4, SPRINGLS__JUNCTION_PAIRS = 6 };

/* A vertex with four labels: what the walls of each pair of them pull, pair p opposite to pair 5 - p, and how fast the label at each place
   of the vertex's list draws back, voxels. World units. */
typedef struct springls__junction {
    double pull[SPRINGLS__JUNCTION_PAIRS][3];
    bool walled[SPRINGLS__JUNCTION_PAIRS], draws_back[SPRINGLS__JUNCTION_LABELS];
    springls__v3 velocity[SPRINGLS__JUNCTION_LABELS];
    int film;
} springls__junction;

static const int springls__pair_places[SPRINGLS__JUNCTION_PAIRS][2] = { { 0, 1 }, { 0, 2 }, { 0, 3 }, { 1, 2 }, { 1, 3 }, { 2, 3 } };

#define SPRINGLS__FILM_REACH 1.5f /* voxels: from a springl to the vertices that it follows */

/* Finds the normal of a triangle of the walls, as long as twice its area, and its corners. */
SPRINGLS__FN void springls__film_triangle(const springls_walls *walls, int triangle, double corner[3][3], double normal[3])
{
    int i, k;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++)
            corner[i][k] = (double)walls->positions[3 * (size_t)walls->triangles[3 * (size_t)triangle + (size_t)i] + (size_t)k];
    for (k = 0; k < 3; k++) {
        const int u = (k + 1) % 3, v = (k + 2) % 3;
        normal[k] = (corner[1][u] - corner[0][u]) * (corner[2][v] - corner[0][v])
                  - (corner[1][v] - corner[0][v]) * (corner[2][u] - corner[0][u]);
    }
}

SPRINGLS__FN void springls__name_film(springls__film *film, int32_t label)
{
    int i;
    for (i = 0; i < SPRINGLS__FILM_LABELS; i++) {
        if (film->label[i] == label) return;
        if (film->label[i] != SPRINGLS__NO_LABEL) continue;
        film->label[i] = label;
        return;
    }
}

/* Finds the surface tension of a wall; fails if the caller's factor is none. */
SPRINGLS__FN springls_status springls__tension_of(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc,
                                                  const int32_t labels[2], double *tension)
{
    const int low = labels[0] > labels[1];
    const float factor = desc->tension_of ? (desc->tension_of)(desc->user, labels[low], labels[!low]) : 1.0f;
    *tension = (double)desc->tension * (double)factor;
    if (springls__finite_float(factor) && factor >= 0.0f) return SPRINGLS_OK;
    return springls__fail(tiling->host, springls__finite_float(factor) ? SPRINGLS_INVALID_ARGUMENT : SPRINGLS_NON_FINITE,
                          "%s: tension_of gives the factor %g between labels %ld and %ld: 0 or more, and finite", call, (double)factor,
                          (long)labels[low], (long)labels[!low]);
}

/* Finds the pull of a triangle on its corner i: `tension`, over twice its area, times its normal across the opposite side. */
SPRINGLS__FN void springls__film_pull(double corner[3][3], const double n[3], double tension, int i, double pull[3])
{
    const double *from = corner[(i + 1) % 3], *to = corner[(i + 2) % 3];
    int k;
    for (k = 0; k < 3; k++) {
        const int u = (k + 1) % 3, v = (k + 2) % 3;
        pull[k] = -0.5 * tension * (n[u] * (to[v] - from[v]) - n[v] * (to[u] - from[u]));
    }
}

/* Adds what a triangle gives to its vertices and to the volumes of the bodies on its two sides. */
SPRINGLS__FN springls_status springls__add_film(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc,
                                                int triangle)
{
    const springls_walls *walls = &tiling->walls;
    const int32_t *labels = walls->labels + 2 * (size_t)triangle;
    springls__film *films = (springls__film *)tiling->films.data;
    double corner[3][3], n[3], area2, tension, volume = 0.0;
    int i, k;
    springls__film_triangle(walls, triangle, corner, n);
    area2 = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    SPRINGLS__TRY(springls__tension_of(tiling, call, desc, labels, &tension));
    tension = area2 > 0.0 ? tension / area2 : 0.0;
    for (k = 0; k < 3; k++) volume += corner[0][k] * n[k];
    for (i = 0; i < 3; i++) {
        springls__film *film = &films[walls->triangles[3 * (size_t)triangle + (size_t)i]];
        double pull[3];
        springls__film_pull(corner, n, tension, i, pull);
        film->mass += area2 / 6.0;
        for (k = 0; k < 3; k++) film->force[k] += pull[k];
        for (k = 0; k < 2; k++) springls__name_film(film, labels[k]);
    }
    for (k = 0; k < 2; k++) {
        springls__tiling_body *body = &tiling->body[springls__body_number(tiling, labels[k])];
        body->held.volume += (k ? -volume : volume) / 6.0;
    }
    return SPRINGLS_OK;
}

/* ---- pressures ---- */

/* Adds the slopes of volumes, each times its body's `way`, to `along` of the vertices. */
SPRINGLS__FN void springls__push_films(const springls_tiling *tiling)
{
    const springls_walls *walls = &tiling->walls;
    springls__film *films = (springls__film *)tiling->films.data;
    double corner[3][3], n[3];
    int t, i, k;
    for (i = 0; i < walls->vertex_count; i++) memset(films[i].along, 0, sizeof films[i].along);
    for (t = 0; t < walls->triangle_count; t++) {
        const int behind = springls__body_number(tiling, walls->labels[2 * (size_t)t]);
        const int before = springls__body_number(tiling, walls->labels[2 * (size_t)t + 1]);
        const double push = (tiling->body[behind].held.way - tiling->body[before].held.way) / 6.0;
        if (push == 0.0) continue;
        springls__film_triangle(walls, t, corner, n);
        for (i = 0; i < 3; i++)
            for (k = 0; k < 3; k++) films[walls->triangles[3 * (size_t)t + (size_t)i]].along[k] += push * n[k];
    }
}

/* Writes how fast each volume grows where the vertices are pushed by `along`, or by `force`, into `product`. */
SPRINGLS__FN void springls__grow_films(const springls_tiling *tiling, bool by_force)
{
    const springls_walls *walls = &tiling->walls;
    const springls__film *films = (const springls__film *)tiling->films.data;
    double corner[3][3], n[3];
    int t, i, k;
    for (i = 0; i < tiling->count; i++) tiling->body[i].held.product = 0.0;
    for (t = 0; t < walls->triangle_count; t++) {
        springls__tiling_body *behind = &tiling->body[springls__body_number(tiling, walls->labels[2 * (size_t)t])];
        springls__tiling_body *before = &tiling->body[springls__body_number(tiling, walls->labels[2 * (size_t)t + 1])];
        double growth = 0.0;
        springls__film_triangle(walls, t, corner, n);
        for (i = 0; i < 3; i++) {
            const springls__film *film = &films[walls->triangles[3 * (size_t)t + (size_t)i]];
            const double *push = by_force ? film->force : film->along;
            for (k = 0; k < 3; k++) growth += push[k] * n[k] / (6.0 * film->mass);
        }
        behind->held.product += growth;
        before->held.product -= growth;
    }
}

/* Returns whether a body has a target, and walls that may move. */
SPRINGLS__FN bool springls__keeps_volume(const springls__held *held) { return held->target > 0.0 && held->volume > 0.0; }

/* Finds the pressures by conjugate gradients; `missing` has what each volume lacks, over dt, and is used up. */
SPRINGLS__FN void springls__solve_pressures(const springls_tiling *tiling)
{
    const int rounds = 50;
    double square = 0.0, next, along, first;
    int i, k;
    for (i = 0; i < tiling->count; i++) {
        springls__held *held = &tiling->body[i].held;
        held->pressure = 0.0;
        if (!springls__keeps_volume(held)) held->missing = 0.0;
        held->way = held->missing;
        square += held->missing * held->missing;
    }
    first = square;
    for (k = 0; k < rounds && square > 1e-10 * first; k++) {
        springls__push_films(tiling);
        springls__grow_films(tiling, false);
        for (i = 0, along = 0.0; i < tiling->count; i++) along += tiling->body[i].held.way * tiling->body[i].held.product;
        if (!(along > 0.0)) break;
        for (i = 0, next = 0.0; i < tiling->count; i++) {
            springls__held *held = &tiling->body[i].held;
            if (!springls__keeps_volume(held)) continue;
            held->pressure += square / along * held->way;
            held->missing -= square / along * held->product;
            next += held->missing * held->missing;
        }
        for (i = 0; i < tiling->count; i++) {
            springls__held *held = &tiling->body[i].held;
            if (springls__keeps_volume(held)) held->way = held->missing + next / square * held->way;
        }
        square = next;
    }
}

/* Returns a velocity in voxels, at most half a voxel in a step, of one in world units. */
SPRINGLS__FN springls__v3 springls__film_speed(const springls_tiling *tiling, const double u[3], double dt)
{
    const double *to_voxel = tiling->host->window.to_voxel;
    double v[3], largest;
    int k;
    for (k = 0; k < 3; k++) v[k] = to_voxel[4 * k] * u[0] + to_voxel[4 * k + 1] * u[1] + to_voxel[4 * k + 2] * u[2];
    largest = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) * dt / 0.5;
    for (k = 0; k < 3; k++) v[k] /= largest > 1.0 ? largest : 1.0;
    return springls__v3_make((float)v[0], (float)v[1], (float)v[2]);
}

/* Finds the velocities of all vertices. */
SPRINGLS__FN void springls__move_films(springls_tiling *tiling, double dt)
{
    springls__film *films = (springls__film *)tiling->films.data;
    int i, k;
    springls__grow_films(tiling, true);
    for (i = 0; i < tiling->count; i++) {
        springls__held *held = &tiling->body[i].held;
        held->missing = (held->target + held->drift - held->volume) / dt - held->product;
    }
    springls__solve_pressures(tiling);
    for (i = 0; i < tiling->count; i++) tiling->body[i].held.way = tiling->body[i].held.pressure;
    springls__push_films(tiling);
    for (i = 0; i < tiling->walls.vertex_count; i++) {
        double u[3];
        for (k = 0; k < 3; k++) u[k] = (films[i].force[k] + films[i].along[k]) / films[i].mass;
        films[i].velocity = springls__film_speed(tiling, u, dt);
    }
}

/* ---- lines where four walls meet ---- */

/* Numbers the vertices that have four labels. */
SPRINGLS__FN springls_status springls__list_junctions(springls_tiling *tiling)
{
    springls__film *films = (springls__film *)tiling->films.data;
    springls__junction *junctions;
    int i, count = 0;
    for (i = 0; i < tiling->walls.vertex_count; i++) {
        const int32_t *label = films[i].label;
        const bool four = label[SPRINGLS__JUNCTION_LABELS - 1] != SPRINGLS__NO_LABEL
                          && label[SPRINGLS__JUNCTION_LABELS] == SPRINGLS__NO_LABEL;
        films[i].junction = four ? count++ : -1;
    }
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->junctions, (size_t)count + 1, sizeof *junctions, 0));
    junctions = (springls__junction *)tiling->junctions.data;
    memset(junctions, 0, (size_t)count * sizeof *junctions);
    for (i = 0; i < tiling->walls.vertex_count; i++)
        if (films[i].junction >= 0) junctions[films[i].junction].film = i;
    tiling->junction_count = count;
    return SPRINGLS_OK;
}

/* Returns the place of a label among those of a vertex with four, -1: it has another four. */
SPRINGLS__FN int springls__place_at_film(const springls__film *film, int32_t label)
{
    int i;
    for (i = 0; i < SPRINGLS__JUNCTION_LABELS; i++)
        if (film->label[i] == label) return i;
    return -1;
}

/* Returns the number of the pair of two places of four, -1: they are none. */
SPRINGLS__FN int springls__pair_of_places(int a, int b)
{
    const int low = springls__imin(a, b), high = springls__imax(a, b);
    int p;
    for (p = 0; p < SPRINGLS__JUNCTION_PAIRS; p++)
        if (springls__pair_places[p][0] == low && springls__pair_places[p][1] == high) return p;
    return -1;
}

/* Adds the pulls of a triangle to its corners that are junctions. */
SPRINGLS__FN springls_status springls__pull_junctions(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc,
                                                      int triangle)
{
    const springls_walls *walls = &tiling->walls;
    const int32_t *labels = walls->labels + 2 * (size_t)triangle;
    const springls__film *films = (const springls__film *)tiling->films.data;
    double corner[3][3], n[3], pull[3], area2, tension;
    int i, k;
    for (i = 0; i < 3; i++) {
        const springls__film *film = &films[walls->triangles[3 * (size_t)triangle + (size_t)i]];
        springls__junction *junction;
        int pair;
        if (film->junction < 0) continue;
        springls__film_triangle(walls, triangle, corner, n);
        area2 = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        SPRINGLS__TRY(springls__tension_of(tiling, call, desc, labels, &tension));
        springls__film_pull(corner, n, area2 > 0.0 ? tension / area2 : 0.0, i, pull);
        junction = (springls__junction *)tiling->junctions.data + film->junction;
        pair = springls__pair_of_places(springls__place_at_film(film, labels[0]), springls__place_at_film(film, labels[1]));
        if (pair < 0) continue;
        junction->walled[pair] = true;
        for (k = 0; k < 3; k++) junction->pull[pair][k] += pull[k];
    }
    return SPRINGLS_OK;
}

/* Returns the first of the two opposite pairs of a line where four walls meet that share none; -1: it is no such line. */
SPRINGLS__FN int springls__parted_pair(const springls__junction *junction)
{
    int p, found = -1, missing = 0;
    for (p = 0; p < SPRINGLS__JUNCTION_PAIRS; p++) missing += !junction->walled[p];
    for (p = 0; p < 3; p++)
        if (!junction->walled[p] && !junction->walled[5 - p]) found = p;
    return missing == 2 ? found : -1;
}

/* Finds what draws the body at place c of a junction back, where the two bodies of pair `new_wall` meet: a force, and its length. */
SPRINGLS__FN double springls__withdraw(const springls__junction *junction, int c, int new_wall, double held, double force[3])
{
    const double *one = junction->pull[springls__pair_of_places(c, springls__pair_places[new_wall][0])];
    const double *other = junction->pull[springls__pair_of_places(c, springls__pair_places[new_wall][1])];
    double length;
    int k;
    for (k = 0; k < 3; k++) force[k] = one[k] + other[k];
    length = sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
    for (k = 0; k < 3; k++) force[k] *= length > held ? (length - held) / length : 0.0;
    return length - held;
}

/* Finds the pull that a new wall between a pair would have: its tension, times the length of the line. */
SPRINGLS__FN springls_status springls__new_pull(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc,
                                                const springls__junction *junction, int new_wall, double *pull)
{
    const springls__film *film = (const springls__film *)tiling->films.data + junction->film;
    double length = 0.0, tension;
    int32_t labels[2];
    int p, i, count = 0;
    for (p = 0; p < SPRINGLS__JUNCTION_PAIRS; p++) {
        const double *f = junction->pull[p];
        if (!junction->walled[p]) continue;
        for (i = 0; i < 2; i++) labels[i] = film->label[springls__pair_places[p][i]];
        SPRINGLS__TRY(springls__tension_of(tiling, call, desc, labels, &tension));
        if (!(tension > 0.0)) continue;
        length += sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]) / tension;
        count++;
    }
    for (i = 0; i < 2; i++) labels[i] = film->label[springls__pair_places[new_wall][i]];
    SPRINGLS__TRY(springls__tension_of(tiling, call, desc, labels, &tension));
    *pull = count > 0 ? tension * length / (double)count : DBL_MAX;
    return SPRINGLS_OK;
}

/* Finds which two bodies draw back from a junction, and how fast. */
SPRINGLS__FN springls_status springls__split_junction(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc,
                                                      springls__junction *junction)
{
    const springls__film *film = (const springls__film *)tiling->films.data + junction->film;
    const int parted = springls__parted_pair(junction);
    double most = 0.0;
    int way, i, k;
    if (parted < 0) return SPRINGLS_OK;
    for (way = 0; way < 2; way++) {
        const int new_wall = way ? 5 - parted : parted;
        double held, force[2][3], drawn[2];
        SPRINGLS__TRY(springls__new_pull(tiling, call, desc, junction, new_wall, &held));
        for (i = 0; i < 2; i++)
            drawn[i] = springls__withdraw(junction, springls__pair_places[5 - new_wall][i], new_wall, held, force[i]);
        if (!(drawn[0] > 0.0 && drawn[1] > 0.0 && drawn[0] + drawn[1] > most)) continue;
        most = drawn[0] + drawn[1];
        memset(junction->draws_back, 0, sizeof junction->draws_back);
        for (i = 0; i < 2; i++) {
            const int c = springls__pair_places[5 - new_wall][i];
            for (k = 0; k < 3; k++) force[i][k] = (force[i][k] + film->along[k]) / film->mass;
            junction->draws_back[c] = true;
            junction->velocity[c] = springls__film_speed(tiling, force[i], (double)desc->dt);
        }
    }
    return SPRINGLS_OK;
}

/* Finds what happens at all junctions. */
SPRINGLS__FN springls_status springls__split_junctions(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc)
{
    int i;
    SPRINGLS__TRY(springls__list_junctions(tiling));
    for (i = 0; i < tiling->walls.triangle_count && tiling->junction_count > 0; i++)
        SPRINGLS__TRY(springls__pull_junctions(tiling, call, desc, i));
    for (i = 0; i < tiling->junction_count; i++)
        SPRINGLS__TRY(springls__split_junction(tiling, call, desc, (springls__junction *)tiling->junctions.data + i));
    return SPRINGLS_OK;
}

/* ---- the walls in a step ---- */

SPRINGLS__FN void springls__free_films(springls_tiling *tiling) { springls_walls_free(tiling, &tiling->walls); }

/* Takes over what is held; a label that is gone is passed over. */
SPRINGLS__FN springls_status springls__take_held(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc)
{
    int k;
    for (k = 0; k < tiling->count; k++) memset(&tiling->body[k].held, 0, sizeof tiling->body[k].held);
    for (k = 0; k < desc->held_count; k++) {
        const int i = springls__body_number(tiling, desc->held[k].label);
        if (i < 1) continue;
        if (tiling->body[i].held.is_given)
            return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: label %ld is held twice", call, (long)desc->held[k].label);
        tiling->body[i].held.is_given = true;
        tiling->body[i].held.target = desc->held[k].target;
        tiling->body[i].held.drift = desc->held[k].drift;
    }
    return SPRINGLS_OK;
}

/* Fails if a body that is held has a voxel at the border of the grid: its walls are open there, and enclose no volume. */
SPRINGLS__FN springls_status springls__check_enclosed(springls_tiling *tiling, const char *call)
{
    const int *size = tiling->host->model.grid.size;
    const int32_t *label = (const int32_t *)tiling->film_memory[0].data;
    int at[3];
    for (at[2] = 0; at[2] < size[2]; at[2]++)
        for (at[1] = 0; at[1] < size[1]; at[1]++) {
            const bool inside = at[1] > 0 && at[2] > 0 && at[1] + 1 < size[1] && at[2] + 1 < size[2];
            for (at[0] = 0; at[0] < size[0]; at[0] += inside ? size[0] - 1 : 1) {
                const int32_t one = label[springls__voxel_index(&tiling->host->model.grid, at[0], at[1], at[2])];
                if (!tiling->body[springls__body_number(tiling, one)].held.is_given) continue;
                return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT,
                                      "%s: label %ld is to be held, but touches the border of the grid, where its walls are open", call,
                                      (long)one);
            }
        }
    return SPRINGLS_OK;
}

/* Makes the walls, and finds how fast each of their vertices moves by surface tension and pressures. */
SPRINGLS__FN springls_status springls__pull_films(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc)
{
    const double spacing = (double)tiling->host->smallest_spacing, least = 0.3 * spacing * spacing;
    springls__film *films;
    int i, k;
    SPRINGLS__TRY(springls__read_bodies(tiling, call));
    memset(&tiling->walls, 0, sizeof tiling->walls);
    SPRINGLS__TRY(springls__extract_walls(tiling, tiling->film_memory, &tiling->walls));
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->films, (size_t)tiling->walls.vertex_count + 1, sizeof *films, 0));
    films = (springls__film *)tiling->films.data;
    memset(films, 0, (size_t)tiling->walls.vertex_count * sizeof *films);
    for (i = 0; i < tiling->walls.vertex_count; i++) {
        for (k = 0; k < SPRINGLS__FILM_LABELS; k++) films[i].label[k] = SPRINGLS__NO_LABEL;
        films[i].place = springls__world_to_voxel(tiling->host, tiling->walls.positions + 3 * (size_t)i);
    }
    SPRINGLS__TRY(springls__take_held(tiling, call, desc));
    if (desc->held_count > 0) SPRINGLS__TRY(springls__check_enclosed(tiling, call));
    for (i = 0; i < tiling->walls.triangle_count; i++) SPRINGLS__TRY(springls__add_film(tiling, call, desc, i));
    for (i = 0; i < tiling->walls.vertex_count; i++)
        if (films[i].mass < least) films[i].mass = least;
    for (i = 0; i < tiling->count; i++) {
        springls__held *held = &tiling->body[i].held;
        if (held->is_given && !(held->target > 0.0)) held->target = held->volume;
    }
    springls__move_films(tiling, (double)desc->dt);
    return springls__split_junctions(tiling, call, desc);
}

SPRINGLS__FN bool springls__film_has(const springls__film *film, int32_t label)
{
    int i;
    for (i = 0; i < SPRINGLS__FILM_LABELS; i++)
        if (film->label[i] == label) return true;
    return false;
}

/* Returns how fast a label draws back from a junction; NULL: it does not. */
SPRINGLS__FN const springls__v3 *springls__drawing_back(const springls__junction *junction, const springls__film *film, int32_t label)
{
    const int i = springls__place_at_film(film, label);
    return i >= 0 && junction->draws_back[i] ? &junction->velocity[i] : NULL;
}

/* Returns the velocity of a vertex as the wall between two labels has it. */
SPRINGLS__FN springls__v3 springls__vertex_velocity(const springls_tiling *tiling, const springls__film *film, int32_t own, int32_t facing)
{
    const springls__junction *junction;
    const springls__v3 *velocity;
    if (film->junction < 0) return film->velocity;
    junction = (const springls__junction *)tiling->junctions.data + film->junction;
    velocity = springls__drawing_back(junction, film, own);
    if (!velocity) velocity = springls__drawing_back(junction, film, facing);
    return velocity ? *velocity : film->velocity;
}

/* Returns the velocity at a place of a body's surface, where it faces a label: the mean of the vertices of that wall, or of any wall of the
   body's where that has none there. */
SPRINGLS__FN springls__v3 springls__film_velocity(const springls_tiling *tiling, int32_t own, int32_t facing, springls__v3 x)
{
    const springls__grid *g = &tiling->host->model.grid;
    const springls__film *films = (const springls__film *)tiling->films.data;
    const int *vertex = (const int *)tiling->film_memory[1].data;
    const float reach = SPRINGLS__FILM_REACH;
    springls__v3 sum[2];
    float weight[2] = { 0.0f, 0.0f };
    int lower[3], upper[3], at[3], k;
    memset(sum, 0, sizeof sum);
    lower[0] = springls__imax((int)(x.x - reach), 0), upper[0] = springls__imin((int)(x.x + reach), g->size[0] - 2);
    lower[1] = springls__imax((int)(x.y - reach), 0), upper[1] = springls__imin((int)(x.y + reach), g->size[1] - 2);
    lower[2] = springls__imax((int)(x.z - reach), 0), upper[2] = springls__imin((int)(x.z + reach), g->size[2] - 2);
    for (at[2] = lower[2]; at[2] <= upper[2]; at[2]++)
        for (at[1] = lower[1]; at[1] <= upper[1]; at[1]++)
            for (at[0] = lower[0]; at[0] <= upper[0]; at[0]++) {
                const int v = vertex[springls__voxel_index(g, at[0], at[1], at[2])];
                float near2, w;
                if (v < 0) continue;
                near2 = springls__length2(springls__sub(films[v].place, x)) / (reach * reach);
                if (near2 >= 1.0f || !springls__film_has(&films[v], own)) continue;
                w = (1.0f - near2) * (1.0f - near2);
                for (k = 0; k < 2; k++) {
                    if (k == 0 && !springls__film_has(&films[v], facing)) continue;
                    sum[k] = springls__mad(sum[k], springls__vertex_velocity(tiling, &films[v], own, facing), w);
                    weight[k] += w;
                }
            }
    k = weight[0] > 0.0f ? 0 : 1;
    return weight[k] > 0.0f ? springls__scale(sum[k], 1.0f / weight[k]) : springls__v3_make(0.0f, 0.0f, 0.0f);
}

/* ---- what the caller holds ---- */

/* Fails if what is to be held of a description is no body's volume. */
SPRINGLS__FN springls_status springls__check_held(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc)
{
    int i;
    SPRINGLS__TRY(springls__check_amount(tiling->host, call, "tension", (double)desc->tension));
    if (desc->held_count < 0 || (desc->held_count > 0 && !desc->held))
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: held_count is %d, held is %s", call, desc->held_count,
                              desc->held ? "given" : "NULL");
    for (i = 0; i < desc->held_count; i++) {
        const springls_tiling_hold *hold = &desc->held[i];
        if (hold->label < 1 || hold->label > SPRINGLS__LARGEST_LABEL)
            return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: held number %d has label %ld: labels are 1 to %d", call, i,
                                  (long)hold->label, (int)SPRINGLS__LARGEST_LABEL);
        if (!springls__finite(hold->target) || hold->target < 0.0 || !springls__finite(hold->drift))
            return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT,
                                  "%s: label %ld is held at the volume %g with the drift %g: 0 or more, and finite", call,
                                  (long)hold->label, hold->target, hold->drift);
    }
    return SPRINGLS_OK;
}

/* Gives the caller what the step has found of what is held. */
SPRINGLS__FN void springls__give_held(const springls_tiling *tiling, const springls_tiling_step_desc *desc)
{
    const double learned = 0.1, largest = 0.003; /* of what is missing, in a step; of the target: more is no loss by steps */
    int k;
    for (k = 0; k < desc->held_count; k++) {
        springls_tiling_hold *hold = &desc->held[k];
        const int i = springls__body_number(tiling, hold->label);
        const springls__held *held = i < 1 ? NULL : &tiling->body[i].held;
        hold->volume = held ? held->volume : 0.0;
        hold->pressure = held ? held->pressure : 0.0;
        if (!held) continue;
        hold->target = held->target;
        if (fabs(held->target - held->volume) < largest * held->target) hold->drift += learned * (held->target - held->volume);
        if (fabs(hold->drift) > largest * held->target) hold->drift = 0.0;
    }
}

#endif
