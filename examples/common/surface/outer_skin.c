/* outer_skin.c - sees each triangle from the ball's way, and decides patch by patch.
 *
 *   seen from its front       it bounds the solid, and stays
 *   seen from its back        the same, turned; a patch is turned as a whole, as most of its area is seen
 *   seen from both sides      a fin, which bounds nothing, or a wall of a body that is open wide: then the winding number is about 0 on
 *                             one side of it, and 1 on the other
 *   not seen                  within the solid, or in a crevice that is too narrow for the ball
 *
 * A patch of which most is seen stays whole, crevices too. Of others, unseen regions go: the inner wall behind a puncture. A lone
 * patch that is not seen stays if it lies where what is seen leaves the inside open, by the winding number: a triangle of a soup, deep
 * in a notch, but not a shell within a shell. */
#include "surface/outer_skin.h"

#include "base/bvh.h"
#include "base/bvh_winding.h"
#include "base/vec3.h"
#include "surface/mesh_patches.h"
#include "surface/skin_space.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { UNSEEN = 0, FRONT = 1, BACK = 2, BOTH = 3 }; /* how a triangle is seen, as its patch faces */
enum { LEAVE_OUT, KEEP };
enum { MOST_PLACES = 16, MOST_VOXELS = 176 }; /* of a triangle that are looked at; along the longest side of the space */
enum { MOST_WOUND = 4000 };                   /* about so many triangles of a patch have their winding numbers computed, evenly */
enum { CHAMBER_PLACES = 200 };                /* of which it is asked whether they lie within the skin */

static const double MUCH = 0.1;  /* of what is enclosed */
static const float WIDE = 2.0f;  /* times the radius of the widest ball that is tried: openings that are asked about */

struct finder {
    const float *positions;
    const uint32_t *indices;
    size_t count;
    const struct outer_skin_spec *spec;
    struct outer_skin *skin;
    struct mesh_patches patches;
    struct skin_space space;
    struct bvh bvh;
    float radius; /* of the ball, voxels of the space */
    float most;   /* the widest that is tried */
    double walls; /* volume that the ball leaves free; 0: there are no chambers */
    float *areas;
    unsigned char *seen, *kept;
    unsigned char *facing; /* 1: turned against the file */
};

/* ---- seeing ---- */

/* Loads a triangle's corners as its patch faces. */
static void corners_of(const struct finder *f, size_t t, float c[9])
{
    for (int i = 0; i < 3; ++i) {
        const int from = f->facing[t] && i ? 3 - i : i;
        memcpy(c + 3 * i, f->positions + 3 * (size_t)f->indices[3 * t + (size_t)from], 3 * sizeof *c);
    }
}

/* Puts place number i of a triangle by a sequence that fills it evenly (Roberts 2018), the center first. */
static void place_of(const float c[9], int i, float place[3])
{
    float s = (float)fmod(1.0 / 3.0 + 0.7548776662466927 * i, 1.0), r = (float)fmod(1.0 / 3.0 + 0.5698402909980532 * i, 1.0);
    if (s + r > 1.0f) {
        s = 1.0f - s;
        r = 1.0f - r;
    }
    for (int k = 0; k < 3; ++k) {
        place[k] = c[k] + s * (c[3 + k] - c[k]) + r * (c[6 + k] - c[k]);
    }
}

/* Returns whether a ball of a radius that touches a place from the direction n can have come there from outside. */
static bool sees(const struct finder *f, float radius, const float place[3], const float n[3])
{
    const float away = (radius + 0.5f) * f->space.spacing;
    float at[3];
    vec3_add_scaled(place, away, n, at);
    return skin_space_width(&f->space, at) >= radius && !bvh_any_hit(&f->bvh, place, n, 1e-3f * f->space.spacing, away);
}

/* Returns how a triangle is seen by a ball of a radius: a side counts from a quarter of the places that are looked at, both of them
 * only where each has half. */
static unsigned char look(const struct finder *f, float radius, size_t t)
{
    const float voxel2 = f->space.spacing * f->space.spacing;
    const int places = f->areas[t] < voxel2 * 4.0f ? 1 : (int)fminf(f->areas[t] / (4.0f * voxel2) + 1.0f, MOST_PLACES);
    float c[9], normal[3], back[3], place[3];
    int front_seen = 0, back_seen = 0;
    corners_of(f, t, c);
    if (!(vec3_triangle_normal(c, normal) > 0.0f)) {
        return UNSEEN;
    }
    for (int k = 0; k < 3; ++k) {
        back[k] = -normal[k];
    }
    for (int i = 0; i < places; ++i) {
        place_of(c, i, place);
        front_seen += sees(f, radius, place, normal);
        back_seen += sees(f, radius, place, back);
    }
    if (2 * front_seen >= places && 2 * back_seen >= places) {
        return BOTH;
    }
    return 4 * (front_seen > back_seen ? front_seen : back_seen) < places ? UNSEEN : front_seen >= back_seen ? FRONT : BACK;
}

/* ---- the opening ---- */

/* Returns the share of the area that a ball of a radius sees from both sides, from about 20,000 triangles. */
static double sheets_at(const struct finder *f, float radius)
{
    const size_t step = f->count / 20000 + 1;
    double both = 0.0, sum = 0.0;
    for (size_t t = 0; t < f->count; t += step) {
        sum += (double)f->areas[t];
        both += look(f, radius, t) == BOTH ? (double)f->areas[t] : 0.0;
    }
    return sum > 0.0 ? both / sum : 0.0;
}

/* Returns the share of what is enclosed, walls included, that is a chamber: a ball of a radius fits there, but only smaller ones get in. */
static double chambers_at(const struct finder *f, float radius, double walls)
{
    const double chambers = (double)skin_space_chambers(&f->space, f->radius, radius) * pow((double)f->space.spacing, 3.0);
    return chambers > 0.0 ? chambers / (chambers + walls) : 0.0;
}

/* Returns the least radius of a ball that gets to less than a tenth of the chambers that are there for one of `radius`. */
static float radius_that_fills(const struct finder *f, float radius)
{
    const float step = 1.2f;
    const double little = 0.1 * (double)skin_space_chambers(&f->space, f->radius, radius);
    float fills = f->radius;
    while (fills < radius && (double)skin_space_chambers(&f->space, fills, radius) > little) {
        fills = fminf(fills * step, radius);
    }
    return fills;
}

/* Decides about a hollow body with openings: where walls are of a few voxels, it is taken as shut, for as it is, it has nothing that voxels
 * can hold. */
static bool judge_chambers(struct finder *f, float most)
{
    const double thinnest = 3.5; /* voxels: three, and what the ball leaves free along edges */
    if (skin_space_chambers(&f->space, f->radius, most) + skin_space_chambers(&f->space, f->radius, WIDE * most) == 0) {
        return true;
    }
    f->walls = skin_space_closed(&f->space, f->radius);
    const double thickness = 2.0 * f->walls / (f->skin->area + 1e-300); /* mean: both sides have area */
    if (thickness < thinnest * (double)f->space.spacing && chambers_at(f, most, f->walls) > MUCH) {
        f->radius = radius_that_fills(f, most);
    }
    return f->walls >= 0.0;
}

/* Finds the radius of the ball: the least one from which on no more area stops being seen from both sides, for that is how holes look
 * from inside. */
static bool find_radius(struct finder *f, float least, float most)
{
    const float step = 1.2f;
    const double alike = 0.01;
    const double rest = sheets_at(f, most);
    f->radius = least;
    while (f->radius < most && sheets_at(f, f->radius) > rest + alike) {
        f->radius = fminf(f->radius * step, most);
    }
    return judge_chambers(f, most);
}

/* ---- patches ---- */

/* Sums up the area of a patch by how it is seen. */
static void sum_patch(const struct finder *f, int patch, double area[4])
{
    memset(area, 0, 4 * sizeof *area);
    for (int i = f->patches.first[patch]; i < f->patches.first[patch + 1]; ++i) {
        const int t = f->patches.triangles[i];
        area[f->seen[t]] += (double)f->areas[t];
    }
}

static void turn_patch(struct finder *f, int patch)
{
    static const unsigned char other[4] = {UNSEEN, BACK, FRONT, BOTH};
    for (int i = f->patches.first[patch]; i < f->patches.first[patch + 1]; ++i) {
        const int t = f->patches.triangles[i];
        f->facing[t] ^= 1;
        f->seen[t] = other[f->seen[t]];
    }
}

/* Returns the volume of a closed patch, positive when it faces outwards. */
static double patch_volume(const struct finder *f, int patch)
{
    const float *origin = f->positions + 3 * (size_t)f->indices[3 * (size_t)f->patches.triangles[f->patches.first[patch]]];
    double volume = 0.0;
    for (int i = f->patches.first[patch]; i < f->patches.first[patch + 1]; ++i) {
        float c[9], n[3];
        corners_of(f, (size_t)f->patches.triangles[i], c);
        for (int k = 0; k < 9; ++k) {
            c[k] -= origin[k % 3];
        }
        vec3_cross(c + 3, c + 6, n);
        volume += (double)vec3_dot(c, n) / 6.0;
    }
    return volume;
}

/* Returns how much wider the space before a patch is than behind it, for one that is seen from both sides: area times voxels. */
static double patch_lean(const struct finder *f, int patch)
{
    const float away = 1.5f * f->space.spacing;
    double lean = 0.0;
    for (int i = f->patches.first[patch]; i < f->patches.first[patch + 1]; ++i) {
        const size_t t = (size_t)f->patches.triangles[i];
        float c[9], n[3], place[3], at[2][3];
        corners_of(f, t, c);
        vec3_triangle_normal(c, n);
        place_of(c, 0, place);
        vec3_add_scaled(place, away, n, at[0]);
        vec3_add_scaled(place, -away, n, at[1]);
        lean += (double)f->areas[t] * (double)(skin_space_width(&f->space, at[0]) - skin_space_width(&f->space, at[1]));
    }
    return lean;
}

/* Keeps what is seen of a patch: all of it, or where much is not, what is, turned where that is seen from behind. */
static void keep_seen(struct finder *f, int patch)
{
    const double little = 0.25;
    double area[4];
    sum_patch(f, patch, area);
    const double all = area[UNSEEN] + area[FRONT] + area[BACK] + area[BOTH];
    const bool whole = area[UNSEEN] < little * all && area[BOTH] < little * all;
    for (int i = f->patches.first[patch]; i < f->patches.first[patch + 1]; ++i) {
        const int t = f->patches.triangles[i];
        f->kept[t] = whole || f->seen[t] == FRONT || f->seen[t] == BACK;
        if (!whole && f->seen[t] == BACK) {
            f->facing[t] ^= 1;
            f->seen[t] = FRONT;
        }
    }
}

/* Turns patches to where they are seen from, and keeps what is seen. */
static void judge_patches(struct finder *f)
{
    for (int p = 0; p < f->patches.count; ++p) {
        double area[4];
        sum_patch(f, p, area);
        const bool from_both = area[BOTH] > area[FRONT] + area[BACK];
        if (from_both ? patch_lean(f, p) < 0.0 : area[BACK] > area[FRONT]) {
            turn_patch(f, p);
            ++f->skin->turned;
        }
        keep_seen(f, p);
    }
}

/* ---- what is not seen ---- */

/* Makes a tree of the triangles that are kept, or of all, as they face. */
static bool tree_of(const struct finder *f, bool all, struct bvh *tree)
{
    float *corners = malloc((9 * f->count + 1) * sizeof *corners);
    size_t n = 0;
    memset(tree, 0, sizeof *tree);
    for (size_t t = 0; corners && t < f->count; ++t) {
        if (all || f->kept[t]) {
            corners_of(f, t, corners + 9 * n++);
        }
    }
    const bool fine = corners && (n == 0 || bvh_build(tree, corners, NULL, n));
    free(corners);
    return fine;
}

/* Computes the winding number before and behind a triangle. */
static void wind(const struct finder *f, const struct bvh_winding *w, size_t t, double *before, double *behind)
{
    const float off = 0.05f * f->space.spacing;
    float c[9], n[3], center[3], at[3];
    corners_of(f, t, c);
    vec3_triangle_normal(c, n);
    place_of(c, 0, center);
    vec3_add_scaled(center, off, n, at);
    *before = bvh_winding_at(w, at);
    vec3_add_scaled(center, -off, n, at);
    *behind = bvh_winding_at(w, at);
}

/* Keeps what is seen from both sides of a patch, and yet bounds something: most of its area has the inside on one side, by the winding
 * number of the whole mesh. */
static void judge_sheets(struct finder *f, int patch, const struct bvh_winding *whole)
{
    const double outside = 0.3, inside = 0.7, half = 0.5;
    double walls = 0.0, sum = 0.0, before, behind;
    for (int i = f->patches.first[patch]; i < f->patches.first[patch + 1]; ++i) {
        const size_t t = (size_t)f->patches.triangles[i];
        if (f->seen[t] != BOTH || f->kept[t]) {
            continue;
        }
        wind(f, whole, t, &before, &behind);
        sum += (double)f->areas[t];
        walls += before + behind > 2.0 * outside && before + behind < 2.0 * inside ? (double)f->areas[t] : 0.0;
    }
    for (int i = f->patches.first[patch]; walls > half * sum && i < f->patches.first[patch + 1]; ++i) {
        f->kept[f->patches.triangles[i]] |= f->seen[f->patches.triangles[i]] == BOTH;
    }
}

static bool is_unseen(const struct finder *f, int t) { return f->seen[t] == UNSEEN && !f->kept[t]; }

static bool any_kept(const struct finder *f, int patch)
{
    for (int i = f->patches.first[patch]; i < f->patches.first[patch + 1]; ++i) {
        if (f->kept[f->patches.triangles[i]]) {
            return true;
        }
    }
    return false;
}

/* Decides about the unseen part of a patch. skin: the winding number of what is kept; whole: of the mesh. Of a closed patch, it stays
 * where it lies in another part of the solid: so parts may overlap. Of other patches, where the skin leaves the inside open. */
static void judge_unseen(struct finder *f, int patch, const struct bvh_winding *skin, const struct bvh_winding *whole)
{
    const double open_from = 0.15, open_to = 0.85, half = 0.5;
    double open = 0.0, covered = 0.0, sum = 0.0, lean = 0.0, before, behind;
    int unseen = 0, number = 0;
    for (int i = f->patches.first[patch]; i < f->patches.first[patch + 1]; ++i) {
        unseen += is_unseen(f, f->patches.triangles[i]);
    }
    const bool any_seen = any_kept(f, patch);
    const int step = unseen / MOST_WOUND + 1;
    for (int i = f->patches.first[patch]; i < f->patches.first[patch + 1]; ++i) {
        const size_t t = (size_t)f->patches.triangles[i];
        if (!is_unseen(f, (int)t) || number++ % step) {
            continue;
        }
        const double area = (double)f->areas[t];
        wind(f, skin, t, &before, &behind);
        open += before + behind > 2.0 * open_from && before + behind < 2.0 * open_to ? area : 0.0;
        lean += area * (behind - before);
        sum += area;
        if (f->patches.closed[patch]) {
            wind(f, whole, t, &before, &behind);
            covered += before > half ? area : 0.0;
        }
    }
    if (!(open > half * sum) && !(any_seen && f->patches.closed[patch] && covered > half * sum)) {
        return;
    }
    for (int i = f->patches.first[patch]; i < f->patches.first[patch + 1]; ++i) {
        const size_t t = (size_t)f->patches.triangles[i];
        f->kept[t] = f->kept[t] || f->seen[t] == UNSEEN;
        f->facing[t] ^= !any_seen && lean < 0.0;
    }
}

/* Counts a closed patch that is not seen and faces into a hollow, and keeps it on request. */
static void judge_cavity(struct finder *f, int patch, const struct bvh_winding *whole)
{
    double before, behind;
    wind(f, whole, (size_t)f->patches.triangles[f->patches.first[patch]], &before, &behind);
    if (!(behind - before > 0.5 && fabs(before) < 0.5)
        || fabs(patch_volume(f, patch)) < (double)f->spec->speck * pow((double)f->spec->spacing, 3.0)) {
        return;
    }
    ++f->skin->cavities;
    for (int i = f->patches.first[patch]; f->spec->cavities && i < f->patches.first[patch + 1]; ++i) {
        f->kept[f->patches.triangles[i]] = KEEP;
    }
}

static bool judge_all_unseen(struct finder *f)
{
    struct bvh tree[2] = {{0}, {0}};
    struct bvh_winding winding[2] = {{0}, {0}};
    bool fine = tree_of(f, true, &tree[1]) && bvh_winding_make(&tree[1], &winding[1]);
    for (int p = 0; fine && p < f->patches.count; ++p) {
        judge_sheets(f, p, &winding[1]);
    }
    fine = fine && tree_of(f, false, &tree[0]) && bvh_winding_make(&tree[0], &winding[0]);
    for (int p = 0; fine && p < f->patches.count; ++p) {
        double area[4];
        bool none = true, left = false;
        for (int i = f->patches.first[p]; i < f->patches.first[p + 1]; ++i) {
            none = none && !f->kept[f->patches.triangles[i]];
            left = left || !f->kept[f->patches.triangles[i]];
        }
        sum_patch(f, p, area);
        if (left && area[UNSEEN] > 0.0) {
            judge_unseen(f, p, &winding[0], &winding[1]);
        }
        if (none && f->patches.closed[p] && !f->kept[f->patches.triangles[f->patches.first[p]]] && area[BOTH] == 0.0) {
            judge_cavity(f, p, &winding[1]);
        }
    }
    bvh_winding_free(&winding[0]);
    bvh_winding_free(&winding[1]);
    bvh_free(&tree[0]);
    bvh_free(&tree[1]);
    return fine;
}

/* ---- all ---- */

/* Leaves closed patches out that are specks. */
static void drop_specks(struct finder *f)
{
    const double least = (double)f->spec->speck * pow((double)f->spec->spacing, 3.0);
    double largest = 0.0;
    for (int p = 0; p < f->patches.count; ++p) {
        largest = fmax(largest, fabs(patch_volume(f, p)));
    }
    for (int p = 0; p < f->patches.count; ++p) {
        const double volume = fabs(patch_volume(f, p));
        if (!f->patches.closed[p] || !f->kept[f->patches.triangles[f->patches.first[p]]] || volume >= least
            || volume >= OUTER_SKIN_SPECK_SHARE * largest) {
            continue;
        }
        ++f->skin->specks;
        for (int i = f->patches.first[p]; i < f->patches.first[p + 1]; ++i) {
            f->kept[f->patches.triangles[i]] = LEAVE_OUT;
        }
    }
}

/* Returns the share of the chambers for a ball of a radius that lies outside the skin. -1: memory. */
static double chambers_outside(const struct finder *f, float radius)
{
    float places[CHAMBER_PLACES][3];
    const size_t step = skin_space_chambers(&f->space, f->radius, radius) / CHAMBER_PLACES + 1;
    const size_t n = skin_space_places_in_chambers(&f->space, f->radius, radius, step, CHAMBER_PLACES, places);
    struct bvh tree;
    struct bvh_winding winding = {0};
    double outside = 0.0;
    const bool fine = tree_of(f, false, &tree) && bvh_winding_make(&tree, &winding);
    for (size_t i = 0; fine && i < n; ++i) {
        outside += fabs(bvh_winding_at(&winding, places[i])) < 0.5;
    }
    bvh_winding_free(&winding);
    bvh_free(&tree);
    return fine ? outside / (double)(n + !n) : -1.0;
}

/* Says of a body that stays hollow behind openings how much of it does, and what would fill it. */
static bool note_hollow(struct finder *f)
{
    for (float radius = f->most; f->walls > 0.0 && radius <= WIDE * f->most; radius *= WIDE) {
        const double share = chambers_at(f, radius, f->walls), outside = share > MUCH ? chambers_outside(f, radius) : 0.0;
        if (outside < 0.0) {
            return false;
        }
        if (share * outside > MUCH) {
            f->skin->hollow = share * outside;
            f->skin->fills = radius_that_fills(f, radius) * f->space.spacing / f->spec->spacing;
            return true;
        }
    }
    return true;
}

/* A body that is open wide is seen from both sides nearly everywhere. If most of what is seen would be left out as sheets, all of it is
 * kept instead, as it faces in the file. */
static void keep_open_body(struct finder *f)
{
    const double most = 0.5;
    double sheets = 0.0, kept = 0.0;
    for (size_t t = 0; t < f->count; ++t) {
        *(f->kept[t] ? &kept : &sheets) += f->kept[t] || f->seen[t] == BOTH ? (double)f->areas[t] : 0.0;
    }
    f->skin->open = sheets > most * (sheets + kept);
    if (f->skin->open) {
        memset(f->kept, KEEP, f->count);
        memset(f->facing, 0, f->count);
        f->skin->turned = 0;
    }
}

static bool emit(struct finder *f)
{
    struct outer_skin *skin = f->skin;
    size_t n = 0;
    skin->indices = malloc((3 * f->count + 1) * sizeof *skin->indices);
    skin->source = malloc((f->count + 1) * sizeof *skin->source);
    for (size_t t = 0; skin->indices && skin->source && t < f->count; ++t) {
        if (!f->kept[t]) {
            *(f->seen[t] == BOTH ? &skin->sheets : &skin->hidden) += (double)f->areas[t];
            continue;
        }
        for (size_t k = 0; k < 3; ++k) {
            skin->indices[3 * n + k] = f->indices[3 * t + (f->facing[t] && k ? 3 - k : k)];
        }
        skin->source[n++] = (uint32_t)t;
    }
    skin->triangle_count = n;
    return skin->indices && skin->source;
}

static bool prepare(struct finder *f)
{
    f->areas = malloc((f->count + 1) * sizeof *f->areas);
    f->seen = calloc(f->count + 1, 1);
    f->kept = calloc(f->count + 1, 1);
    f->facing = calloc(f->count + 1, 1);
    if (!f->areas || !f->seen || !f->kept || !f->facing || !mesh_patches_find(f->indices, f->count, &f->patches)
        || !bvh_build(&f->bvh, f->positions, f->indices, f->count)) {
        return false;
    }
    for (size_t t = 0; t < f->count; ++t) {
        float c[9], n[3];
        corners_of(f, t, c);
        f->areas[t] = vec3_triangle_normal(c, n);
        f->skin->area += (double)f->areas[t];
    }
    memcpy(f->facing, f->patches.turned, f->count);
    f->skin->patches = f->patches.count;
    return true;
}

/* Measures the space around the mesh and settles on a ball: from one voxel, below which it would slip through walls. */
static bool choose_ball(struct finder *f)
{
    float lower[3], upper[3], longest = 0.0f;
    for (int k = 0; k < 3; ++k) {
        lower[k] = f->bvh.nodes[0].lo[k];
        upper[k] = f->bvh.nodes[0].hi[k];
        longest = fmaxf(longest, upper[k] - lower[k]);
    }
    const float spacing = fmaxf(f->spec->spacing, longest / MOST_VOXELS), least = 1.0f, widest_gap = 0.04f; /* share of the size */
    const float given = f->spec->opening * f->spec->spacing / spacing;
    const float most = f->spec->opening > 0.0f ? fmaxf(given, least) : fmaxf(0.5f * widest_gap * longest / spacing, 2.0f * least);
    const float asked = f->spec->opening > 0.0f ? most : WIDE * most;  /* a given opening asks for no wider ones */
    const float widest = fmaxf(asked, 0.1f * longest / spacing); /* that sides are compared by, and openings looked for */
    if (!skin_space_make(f->positions, f->indices, f->count, spacing, widest + 1.0f, &f->space)) {
        return false;
    }
    f->radius = f->most = most;
    if (!(f->spec->opening > 0.0f) && !find_radius(f, least, most)) {
        return false;
    }
    f->skin->opening = f->radius * spacing / f->spec->spacing;
    return true;
}

bool outer_skin_find(const float *positions, const uint32_t *indices, size_t triangle_count, const struct outer_skin_spec *spec,
                     struct outer_skin *skin, const char **why)
{
    struct finder f = {.positions = positions, .indices = indices, .count = triangle_count, .spec = spec, .skin = skin};
    memset(skin, 0, sizeof *skin);
    *why = "not enough memory";
    bool fine = prepare(&f) && choose_ball(&f);
    for (size_t t = 0; fine && t < f.count; ++t) {
        f.seen[t] = look(&f, f.radius, t);
    }
    if (fine) {
        judge_patches(&f);
        fine = judge_all_unseen(&f);
    }
    if (fine) {
        keep_open_body(&f);
        drop_specks(&f);
        fine = (skin->open || note_hollow(&f)) && emit(&f); /* parts of an open body are turned later: it may not be hollow then */
    }
    free(f.areas);
    free(f.seen);
    free(f.kept);
    free(f.facing);
    mesh_patches_free(&f.patches);
    skin_space_free(&f.space);
    bvh_free(&f.bvh);
    if (!fine) {
        outer_skin_free(skin);
    }
    return fine;
}

void outer_skin_free(struct outer_skin *skin)
{
    free(skin->indices);
    free(skin->source);
    memset(skin, 0, sizeof *skin);
}
