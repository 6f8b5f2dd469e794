/* polygon.c - cuts ears (Meisters 1975), the roundest first, in the plane of Newell's normal. */
#include "surface/polygon.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What is left of a polygon: a ring of corners. */
struct ring {
    const double (*at)[2];
    size_t *next, *before;
    double *roundness; /* of the triangle of a corner and its neighbors; not above 0: no ear */
    size_t left;
};

/* Returns twice the area of a triangle in the plane, positive when counter-clockwise. */
static double twice_area(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static double distance2(const double a[2], const double b[2])
{
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
}

static double roundness(const struct ring *r, size_t i)
{
    const double *a = r->at[r->before[i]], *b = r->at[i], *c = r->at[r->next[i]];
    const double longest2 = fmax(distance2(a, b), fmax(distance2(b, c), distance2(c, a)));
    const double ratio = longest2 > 0.0 ? twice_area(a, b, c) / longest2 : 0.0, flat = 1e-9;
    return fabs(ratio) > flat ? ratio : 0.0;
}

/* Returns whether no other corner lies in the triangle of a corner and its neighbors, or on it; but for those at the places of the three,
 * which a polygon with a bridge to its hole has. */
static bool is_free(const struct ring *r, size_t i)
{
    const double *a = r->at[r->before[i]], *b = r->at[i], *c = r->at[r->next[i]];
    for (size_t k = r->next[r->next[i]]; k != r->before[i]; k = r->next[k]) {
        const double *p = r->at[k];
        const bool elsewhere = distance2(p, a) > 0.0 && distance2(p, b) > 0.0 && distance2(p, c) > 0.0;
        if (elsewhere && twice_area(a, b, p) >= 0.0 && twice_area(b, c, p) >= 0.0 && twice_area(c, a, p) >= 0.0) {
            return false;
        }
    }
    return true;
}

/* Returns the roundest ear; of what has none, the roundest corner. `start`: a corner that is left. */
static size_t find_ear(struct ring *r, size_t start)
{
    size_t roundest = start, i = start;
    for (size_t k = 0; k < r->left; ++k, i = r->next[i]) {
        r->roundness[i] = roundness(r, i);
    }
    for (size_t tries = 0; tries < r->left; ++tries) {
        size_t best = start;
        double most = 0.0;
        for (size_t k = 0; k < r->left; ++k, i = r->next[i]) {
            if (r->roundness[i] > most) {
                most = r->roundness[i];
                best = i;
            }
        }
        if (!(most > 0.0)) {
            break;
        }
        if (is_free(r, best)) {
            return best;
        }
        roundest = tries == 0 ? best : roundest;
        r->roundness[best] = 0.0;
    }
    return roundest;
}

static void cut_ears(struct ring *r, int *triangles)
{
    for (size_t i = 0; i < r->left; ++i) {
        r->next[i] = (i + 1) % r->left;
        r->before[i] = (i + r->left - 1) % r->left;
    }
    for (size_t start = 0; r->left > 2; --r->left) {
        const size_t ear = find_ear(r, start), before = r->before[ear], next = r->next[ear];
        *triangles++ = (int)before;
        *triangles++ = (int)ear;
        *triangles++ = (int)next;
        r->next[before] = next;
        r->before[next] = before;
        start = next;
    }
}

/* Projects the corners along Newell's normal, on the two axes that it is not nearest to, so that the polygon is counter-clockwise. */
static void project(const double *places, size_t count, double (*at)[2])
{
    double normal[3] = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < count; ++i) {
        const double *p = places + 3 * i, *q = places + 3 * ((i + 1) % count);
        for (int k = 0; k < 3; ++k) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            normal[k] += (p[a] - q[a]) * (p[b] - places[b] + q[b] - places[b]);
        }
    }
    const int longest = fabs(normal[0]) >= fabs(normal[1]) ? (fabs(normal[0]) >= fabs(normal[2]) ? 0 : 2)
                                                           : (fabs(normal[1]) >= fabs(normal[2]) ? 1 : 2);
    const int first = (longest + 1) % 3, second = (longest + 2) % 3;
    for (size_t i = 0; i < count; ++i) {
        at[i][0] = (places[3 * i + (size_t)first] - places[first]) * (normal[longest] < 0.0 ? -1.0 : 1.0);
        at[i][1] = places[3 * i + (size_t)second] - places[second];
    }
}

/* Cuts along the first diagonal of four corners, but where a corner beside it is concave or straight. */
static void cut_four(const double (*at)[2], int *triangles)
{
    const double first = fmin(twice_area(at[0], at[1], at[2]), twice_area(at[2], at[3], at[0]));
    const bool other = first <= 0.0 && fmin(twice_area(at[1], at[2], at[3]), twice_area(at[3], at[0], at[1])) > first;
    const int cut[2][6] = {{0, 1, 2, 0, 2, 3}, {1, 2, 3, 1, 3, 0}};
    memcpy(triangles, cut[other], sizeof cut[other]);
}

bool polygon_cut(const double *places, size_t count, int *triangles)
{
    if (count == 3) {
        triangles[0] = 0, triangles[1] = 1, triangles[2] = 2;
        return true;
    }
    double (*at)[2] = malloc(count * sizeof *at), *round = malloc(count * sizeof *round);
    size_t *links = malloc(2 * count * sizeof *links);
    const bool fine = at && round && links;
    if (fine) {
        struct ring ring = {.next = links, .before = links + count, .roundness = round, .left = count};
        project(places, count, at);
        ring.at = (const double (*)[2])at;
        if (count == 4) {
            cut_four(ring.at, triangles);
        } else {
            cut_ears(&ring, triangles);
        }
    }
    free(at);
    free(round);
    free(links);
    return fine;
}
