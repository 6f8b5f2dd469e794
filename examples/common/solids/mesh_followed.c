/* mesh_followed.c - places spread over a mesh, and how far the model is from them. */
#include "mesh_followed.h"

#include "base/bvh.h"
#include "base/vec3.h"
#include "solids/solid_mesh.h"
#include "springls/indices.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 20000 };

static double triangle_area(const float *positions, const int *t)
{
    return vec3_triangle_area(positions + 3 * (size_t)t[0], positions + 3 * (size_t)t[1], positions + 3 * (size_t)t[2]);
}

/* Puts place number `number` into a triangle, by a sequence that fills the unit square evenly (Roberts 2018, the R2 sequence), folded
 * at the diagonal. */
static void place_in(const float *positions, const int *t, int number, float place[3])
{
    double s = fmod(0.7548776662466927 * number, 1.0), r = fmod(0.5698402909980532 * number, 1.0);
    if (s + r > 1.0) {
        s = 1.0 - s;
        r = 1.0 - r;
    }
    const float *a = positions + 3 * (size_t)t[0], *b = positions + 3 * (size_t)t[1], *c = positions + 3 * (size_t)t[2];
    for (int k = 0; k < 3; ++k) {
        place[k] = (float)((1.0 - s - r) * (double)a[k] + s * (double)b[k] + r * (double)c[k]);
    }
}

/* Spreads places over a mesh, each standing for the same area. Returns how many: 0 where there is no area. */
static int spread(const float *positions, const int *triangles, int triangle_count, float *places)
{
    double whole = 0.0, before = 0.0;
    int count = 0;
    for (int i = 0; i < triangle_count; ++i) {
        whole += triangle_area(positions, triangles + 3 * (size_t)i);
    }
    for (int i = 0; i < triangle_count && whole > 0.0; ++i) {
        before += triangle_area(positions, triangles + 3 * (size_t)i);
        for (; count < PLACES && (count + 0.5) * whole <= before * PLACES; ++count) {
            place_in(positions, triangles + 3 * (size_t)i, count, places + 3 * (size_t)count);
        }
    }
    return count;
}

/* Finds how far the model's surface is from places. */
static springls_status distances_to_model(springls_context *ctx, const float *places, int count, float *distances)
{
    springls_hit *hits = malloc(((size_t)count + 1) * sizeof *hits);
    const springls_status status = hits ? springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, places, count, hits) : SPRINGLS_OUT_OF_MEMORY;
    for (int i = 0; status == SPRINGLS_OK && i < count; ++i) {
        distances[i] = hits[i].springl >= 0 ? hits[i].distance : INFINITY;
    }
    free(hits);
    return status;
}

/* Finds how far a mesh is from places. */
static springls_status distances_to_mesh(const springls_mesh *mesh, const float *places, int count, float *distances)
{
    struct bvh bvh;
    uint32_t *indices = unsigned_indices(mesh);
    const bool fine = indices && mesh->triangle_count > 0 && bvh_build(&bvh, mesh->positions, indices, (size_t)mesh->triangle_count);
    for (int i = 0; i < count; ++i) {
        distances[i] = fine ? bvh_distance(&bvh, places + 3 * (size_t)i, NULL, NULL) : INFINITY;
    }
    if (fine) {
        bvh_free(&bvh);
    }
    free(indices);
    return fine || mesh->triangle_count == 0 ? SPRINGLS_OK : SPRINGLS_OUT_OF_MEMORY;
}

/* Counts which places of a mesh are followed, and which are covered. result: of the model, NULL: the model itself. */
static springls_status follow(springls_context *ctx, const float *positions, const int *triangles, int triangle_count, float distance,
                              const springls_mesh *result, struct mesh_followed *followed)
{
    float *places = malloc(3 * PLACES * sizeof *places), *distances = malloc(PLACES * sizeof *distances);
    uint8_t *inside = malloc(PLACES);
    const bool room = places && distances && inside;
    const int count = room ? spread(positions, triangles, triangle_count, places) : 0;
    springls_status status = room ? SPRINGLS_OK : SPRINGLS_OUT_OF_MEMORY;
    int followed_places = 0, within = 0;
    if (status == SPRINGLS_OK) {
        status = result ? distances_to_mesh(result, places, count, distances) : distances_to_model(ctx, places, count, distances);
    }
    if (status == SPRINGLS_OK) {
        status = springls_sample_inside(ctx, places, count, inside);
    }
    for (int i = 0; status == SPRINGLS_OK && i < count; ++i) {
        followed_places += distances[i] <= distance;
        within += distances[i] > distance && inside[i];
    }
    followed->area = count ? (double)followed_places / count : 0.0;
    followed->within = count ? (double)within / count : 0.0;
    free(places);
    free(distances);
    free(inside);
    return status;
}

static bool is_little(const struct mesh_followed *f)
{
    const double enough = 0.9;
    return f->area + f->within < enough || (f->volume > 0.0 && f->volume < enough) || f->bodies > f->report.components;
}

/* Judges by the volume and the bodies, and cavities, that a model or its mesh has. */
static void judge(struct mesh_followed *followed, const springls_measures *measures)
{
    const double little_area = 0.005;
    const springls_mesh_report *report = &followed->report;
    /* parts that are turned or nested change what the mesh's own volume is; where parts overlap, it counts twice */
    const bool apart = !report->parts_turned && !report->parts_nested && followed->within < little_area;
    followed->volume = report->closed && apart && report->volume != 0.0 ? measures->volume / fabs(report->volume) : 0.0;
    followed->bodies = measures->components;
    followed->little = is_little(followed);
}

/* Finds how much of a mesh is followed by a mesh that was extracted, NULL: by the model itself. */
static springls_status find_followed(springls_context *ctx, const float *positions, const int *triangles, int triangle_count,
                                     float distance, const springls_mesh *result, struct mesh_followed *followed)
{
    springls_measures measures;
    springls_status status = follow(ctx, positions, triangles, triangle_count, distance, result, followed);
    if (status == SPRINGLS_OK && result) {
        status = solid_measure(result, &measures) ? SPRINGLS_OK : SPRINGLS_OUT_OF_MEMORY;
    } else if (status == SPRINGLS_OK) {
        status = springls_measure(ctx, &measures);
    }
    if (status == SPRINGLS_OK) {
        judge(followed, &measures);
    }
    return status;
}

springls_status mesh_followed_by_mesh(springls_context *ctx, const float *positions, const int *triangles, int triangle_count,
                                      float distance, const springls_mesh *result, struct mesh_followed *followed)
{
    const springls_mesh *taken = followed->report.closed ? result : NULL;
    return find_followed(ctx, positions, triangles, triangle_count, distance, taken, followed);
}

springls_status mesh_followed(springls_context *ctx, const float *positions, int position_count, const int *triangles,
                              int triangle_count, float distance, struct mesh_followed *followed)
{
    memset(followed, 0, sizeof *followed);
    springls_status status = springls_set_mesh(ctx, positions, position_count, 0, triangles, triangle_count, &followed->report);
    if (status == SPRINGLS_OK) {
        status = find_followed(ctx, positions, triangles, triangle_count, distance, NULL, followed);
    }
    return status;
}

void mesh_followed_text(const struct mesh_followed *followed, char *text, size_t room)
{
    const springls_mesh_report *r = &followed->report;
    char *at = text;
    const char *end = text + room;
#define SAY(...) (at += at < end ? snprintf(at, (size_t)(end - at), __VA_ARGS__) : 0)
    SAY("%d part%s%s", r->components, r->components == 1 ? "" : "s", r->closed ? "" : ", open");
    if (r->parts_turned) {
        SAY(", %d turned", r->parts_turned);
    }
    if (r->parts_nested) {
        SAY(", %d nested", r->parts_nested);
    }
    if (r->triangles_dropped) {
        SAY(", %d triangles dropped", r->triangles_dropped);
    }
    SAY("; the model has %d bod%s, follows %.1f %% of the area", followed->bodies, followed->bodies == 1 ? "y" : "ies",
        100.0 * followed->area);
    if (followed->within >= 0.0005) {
        SAY(", covers %.1f %%", 100.0 * followed->within);
    }
    if (followed->volume > 0.0) {
        SAY(", and has %.1f %% of the volume", 100.0 * followed->volume);
    }
#undef SAY
}

const char *mesh_followed_advice(const struct mesh_followed *followed)
{
    if (followed->report.closed) {
        return "walls and parts thinner than two voxels are lost or fall apart: try a finer --grid";
    }
    return "the mesh is open: sheets that bound nothing are left out, and walls thinner than two voxels fall apart: close its holes, or "
           "try a finer --grid";
}
