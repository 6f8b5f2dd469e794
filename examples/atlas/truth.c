/* truth.c - compares correspondences with true ones, where subjects are meshes with the same triangles: vertex k of one
 * subject is vertex k of all. The correspondences are computed without this knowledge. */
#include "atlas/atlas.h"

#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A place on a mesh. */
struct spot {
    uint32_t triangle;
    float weight[3];
};

static void spot_place(const struct shape_mesh *mesh, const float *positions, const struct spot *spot, float place[3])
{
    const int *corner = mesh->triangles + 3 * (size_t)spot->triangle;
    memset(place, 0, 3 * sizeof *place);
    for (int k = 0; k < 3; ++k) {
        vec3_add_scaled(place, spot->weight[k], positions + 3 * corner[k], place);
    }
}

static void find_spot(const struct bvh *bvh, const struct shape_mesh *mesh, const float *positions, const float point[3],
                      struct spot *spot) {
    float closest[3] = {0.0f, 0.0f, 0.0f};
    bvh_distance(bvh, point, closest, &spot->triangle);
    const int *corner = mesh->triangles + 3 * (size_t)spot->triangle;
    mesh_barycentric(positions + 3 * corner[0], positions + 3 * corner[1], positions + 3 * corner[2], closest, spot->weight);
}

bool atlas_same_triangles(const struct atlas_build *build)
{
    const struct shape_mesh *first = &build->subjects[0].mesh;
    bool same = build->settings.count > 1;
    for (int s = 0; same && s < build->settings.count; ++s) {
        const struct shape_mesh *mesh = &build->subjects[s].mesh;
        same = !build->subjects[s].oriented && mesh->vertex_count == first->vertex_count &&
               mesh->triangle_count == first->triangle_count &&
               memcmp(mesh->triangles, first->triangles, 3 * (size_t)mesh->triangle_count * sizeof *mesh->triangles) == 0;
    }
    return same;
}

/* Finds a subject's true vertices on the template as it lies on that subject. */
static bool find_spots(const struct atlas_build *build, int subject, struct spot *spots)
{
    const struct shape_mesh *mesh = &build->template.mesh;
    const struct atlas_subject *s = &build->subjects[subject];
    struct bvh bvh;
    if (!bvh_build(&bvh, s->shape, (const uint32_t *)(const void *)mesh->triangles, (size_t)mesh->triangle_count)) {
        return atlas_no_memory();
    }
    for (int k = 0; k < s->mesh.vertex_count; ++k) {
        find_spot(&bvh, mesh, s->shape, s->mesh.positions + 3 * k, &spots[k]);
    }
    bvh_free(&bvh);
    return true;
}

static int compare_doubles(const void *left, const void *right)
{
    const double a = *(const double *)left, b = *(const double *)right;
    return a < b ? -1 : a > b;
}

/* Maps a true vertex of one subject to another by the correspondence and returns its distance from the true place there, mm. */
static double error_of(const struct atlas_build *build, const struct spot *spot, int to, int k)
{
    float place[3], d[3];
    spot_place(&build->template.mesh, build->subjects[to].shape, spot, place);
    vec3_sub(place, build->subjects[to].mesh.positions + 3 * k, d);
    return (double)vec3_length(d);
}

/* Averages over the subjects the place of each true vertex on the mean shape. */
static bool model_spots(const struct atlas_build *build, const struct spot *spots, int vertices, struct spot *own)
{
    const struct shape_mesh *mesh = &build->template.mesh;
    const float *mean = build->atlas.mean.positions;
    struct bvh bvh;
    if (!bvh_build(&bvh, mean, (const uint32_t *)(const void *)mesh->triangles, (size_t)mesh->triangle_count)) {
        return atlas_no_memory();
    }
    for (int k = 0; k < vertices; ++k) {
        float middle[3] = {0.0f, 0.0f, 0.0f}, place[3];
        for (int s = 0; s < build->settings.count; ++s) {
            spot_place(mesh, mean, &spots[(size_t)s * (size_t)vertices + (size_t)k], place);
            vec3_add_scaled(middle, 1.0f / (float)build->settings.count, place, middle);
        }
        find_spot(&bvh, mesh, mean, middle, &own[k]);
    }
    bvh_free(&bvh);
    return true;
}

/* Measures nearest places after the rigid alignment (with scale) of the first subject, without the springls. */
static double rigid_error(const struct atlas_build *build)
{
    const struct atlas_subject *first = &build->subjects[0];
    const struct similarity back = similarity_inverse(&first->pose);
    double sum = 0.0;
    for (int s = 1; s < build->settings.count; ++s) {
        const struct atlas_subject *to = &build->subjects[s];
        const struct similarity across = similarity_after(&back, &to->pose), identity = similarity_identity();
        for (int k = 0; k < first->mesh.vertex_count; ++k) {
            struct target_hit hit;
            float at[3], d[3];
            similarity_apply(&across, first->mesh.positions + 3 * k, at);
            target_nearest(&to->target, &identity, at, &hit);
            vec3_sub(hit.place, to->mesh.positions + 3 * k, d);
            sum += (double)vec3_length(d) / first->mesh.vertex_count / (build->settings.count - 1);
        }
    }
    return sum;
}

static double mean_of(const double *values, size_t count)
{
    double sum = 0.0;
    for (size_t i = 0; i < count; ++i) {
        sum += values[i];
    }
    return sum / (double)count;
}

static void summarise(const struct atlas_build *build, const struct spot *spots, const struct spot *own, int vertices,
                      double *errors, struct atlas_truth *truth) {
    const int count = build->settings.count;
    size_t n = 0;
    for (int to = 0; to < count; ++to) {
        for (int k = 0; k < vertices; ++k) {
            errors[n++] = error_of(build, &own[k], to, k);
        }
    }
    truth->mean = mean_of(errors, n);
    for (size_t i = 0; i < n; ++i) {
        truth->deviation += (errors[i] - truth->mean) * (errors[i] - truth->mean) / (double)n;
    }
    truth->deviation = sqrt(truth->deviation);
    qsort(errors, n, sizeof *errors, compare_doubles);
    truth->p95 = errors[(size_t)(0.95 * (double)(n - 1))];
    truth->worst = errors[n - 1];
    n = 0;
    for (int from = 0; from < count; ++from) {
        for (int to = 0; to < count; ++to) {
            for (int k = 0; from != to && k < vertices; ++k) {
                errors[n++] = error_of(build, &spots[(size_t)from * (size_t)vertices + (size_t)k], to, k);
            }
        }
    }
    truth->between_mean = mean_of(errors, n);
    qsort(errors, n, sizeof *errors, compare_doubles);
    truth->between_p95 = errors[(size_t)(0.95 * (double)(n - 1))];
    truth->rigid_mean = rigid_error(build);
}

bool atlas_truth_measure(struct atlas_build *build)
{
    struct atlas_truth *truth = &build->truth;
    memset(truth, 0, sizeof *truth);
    if (!atlas_same_triangles(build)) {
        return true;
    }
    const int vertices = build->subjects[0].mesh.vertex_count, count = build->settings.count;
    const size_t all = (size_t)count * (size_t)vertices;
    struct spot *spots = malloc((all + (size_t)vertices) * sizeof *spots);
    double *errors = malloc(all * (size_t)count * sizeof *errors);
    bool good = (spots && errors) || atlas_no_memory();
    for (int s = 0; good && s < count; ++s) {
        good = find_spots(build, s, spots + (size_t)s * (size_t)vertices);
    }
    good = good && model_spots(build, spots, vertices, spots + all);
    if (good) {
        truth->known = true;
        summarise(build, spots, spots + all, vertices, errors, truth);
    }
    free(spots);
    free(errors);
    return good;
}
