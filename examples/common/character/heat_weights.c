#include "character/heat_weights.h"

#include "base/bvh.h"
#include "base/threads.h"
#include "base/vec3.h"
#include "shapes/surface_fit.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* A symmetric sparse matrix by rows, the diagonal separate. */
struct matrix {
    int size;
    int *row; /* size + 1 */
    int *column;
    double *value, *diagonal;
};

struct entry {
    int row, column;
    double value;
};

static void matrix_free(struct matrix *m)
{
    free(m->row);
    free(m->column);
    free(m->value);
    free(m->diagonal);
}

static int compare_entries(const void *a, const void *b)
{
    const struct entry *e = a, *f = b;
    return e->row != f->row ? (e->row > f->row) - (e->row < f->row) : (e->column > f->column) - (e->column < f->column);
}

/* Computes the cotangent Laplacian (Pinkall & Polthier 1993): entry ij is -(cot alpha + cot beta)/2, angles opposite the edge
 * ij. It is positive semi-definite for any triangles; area[v] is a third of the area of the triangles at v. */
static bool laplacian(const float *positions, int vertex_count, const int *triangles, int triangle_count, struct matrix *m,
                      double *area)
{
    const size_t count = 6 * (size_t)triangle_count;
    struct entry *entries = malloc((count + 1) * sizeof *entries);
    m->size = vertex_count;
    m->row = calloc((size_t)vertex_count + 1, sizeof *m->row);
    m->column = malloc((count + 1) * sizeof *m->column);
    m->value = malloc((count + 1) * sizeof *m->value);
    m->diagonal = calloc((size_t)vertex_count + 1, sizeof *m->diagonal);
    if (!entries || !m->row || !m->column || !m->value || !m->diagonal) {
        free(entries);
        return false;
    }
    memset(area, 0, (size_t)vertex_count * sizeof *area);
    size_t used = 0;
    for (int t = 0; t < triangle_count; ++t) {
        for (int k = 0; k < 3; ++k) {
            const int i = triangles[3 * t + (k + 1) % 3], j = triangles[3 * t + (k + 2) % 3], at = triangles[3 * t + k];
            float u[3], v[3], across[3];
            vec3_sub(positions + 3 * i, positions + 3 * at, u);
            vec3_sub(positions + 3 * j, positions + 3 * at, v);
            vec3_cross(u, v, across);
            const double twice = (double)vec3_length(across), size = (double)(vec3_length(u) * vec3_length(v));
            const double half = 0.5 * (double)vec3_dot(u, v) / fmax(twice, 1e-3 * size + 1e-30); /* limits slivers */
            const struct entry both[2] = {{i, j, -half}, {j, i, -half}};
            memcpy(entries + used, both, sizeof both);
            used += 2;
            m->diagonal[i] += half;
            m->diagonal[j] += half;
            area[at] += twice / 6.0;
        }
    }
    qsort(entries, used, sizeof *entries, compare_entries);
    int filled = 0;
    for (size_t e = 0; e < used; ++e) {
        if (e > 0 && entries[e].row == entries[e - 1].row && entries[e].column == entries[e - 1].column) {
            m->value[filled - 1] += entries[e].value;
        } else {
            m->column[filled] = entries[e].column;
            m->value[filled++] = entries[e].value;
        }
        m->row[entries[e].row + 1] = filled;
    }
    for (int v = 0; v < vertex_count; ++v) { /* vertices without triangles have empty rows */
        m->row[v + 1] = m->row[v + 1] > m->row[v] ? m->row[v + 1] : m->row[v];
    }
    free(entries);
    return true;
}

static void multiply(const struct matrix *m, const double *x, double *out)
{
    for (int i = 0; i < m->size; ++i) {
        double sum = m->diagonal[i] * x[i];
        for (int e = m->row[i]; e < m->row[i + 1]; ++e) {
            sum += m->value[e] * x[m->column[e]];
        }
        out[i] = sum;
    }
}

static double dot(const double *a, const double *b, int count)
{
    double sum = 0.0;
    for (int i = 0; i < count; ++i) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Solves by conjugate gradients with a diagonal preconditioner; x holds the first guess. work: 4 * size. Returns the
 * iterations. */
static int solve(const struct matrix *m, const double *b, double *x, double *work)
{
    const int n = m->size;
    double *r = work, *z = r + n, *p = z + n, *mp = p + n;
    multiply(m, x, mp);
    for (int i = 0; i < n; ++i) {
        r[i] = b[i] - mp[i];
        p[i] = z[i] = r[i] / m->diagonal[i];
    }
    double rz = dot(r, z, n);
    const double enough = 1e-14 * dot(b, b, n);
    int iteration = 0;
    while (iteration < 5000 && dot(r, r, n) > enough) {
        multiply(m, p, mp);
        const double step = rz / dot(p, mp, n);
        for (int i = 0; i < n; ++i) {
            x[i] += step * p[i];
            r[i] -= step * mp[i];
            z[i] = r[i] / m->diagonal[i];
        }
        const double next = dot(r, z, n);
        for (int i = 0; i < n; ++i) {
            p[i] = z[i] + next / rz * p[i];
        }
        rz = next;
        ++iteration;
    }
    return iteration;
}

/* ---- heat of the bones at a vertex ---- */

static float segment_distance(const struct bone *bone, const float point[3], float nearest[3])
{
    float along[3], d[3];
    vec3_sub(bone->to, bone->from, along);
    vec3_sub(point, bone->from, d);
    const float square = vec3_dot(along, along);
    const float t = square > 0.0f ? fmaxf(0.0f, fminf(1.0f, vec3_dot(d, along) / square)) : 0.0f;
    vec3_add_scaled(bone->from, t, along, nearest);
    vec3_sub(point, nearest, d);
    return vec3_length(d);
}

/* Returns true if the straight line to the bone stays inside the body: it goes inward and meets no other triangle. */
static bool is_visible(const struct bvh *bvh, const float point[3], const float normal[3], const float there[3], float edge)
{
    float direction[3];
    vec3_sub(there, point, direction);
    const float length = vec3_length(direction);
    if (length <= 2.0f * edge) {
        return true;
    }
    vec3_normalize(direction);
    return vec3_dot(direction, normal) < 0.0f && !bvh_any_hit(bvh, point, direction, edge, length);
}

/* Computes the heat at a vertex and each bone's share, equal for bones that are equally near. */
static bool warm(const struct bvh *bvh, const float *point, const float *normal, const struct bone *bones, int count, float edge,
                 double *heat, float *share)
{
    float best = INFINITY, nearest[3], there[3] = {0.0f, 0.0f, 0.0f};
    int equal = 0;
    for (int b = 0; b < count; ++b) {
        best = fminf(best, segment_distance(&bones[b], point, nearest));
    }
    for (int b = 0; b < count; ++b) {
        share[b] = segment_distance(&bones[b], point, nearest) <= 1.0001f * best ? 1.0f : 0.0f;
        if (share[b] > 0.0f) {
            memcpy(there, nearest, sizeof there);
            ++equal;
        }
    }
    for (int b = 0; b < count; ++b) {
        share[b] /= (float)equal;
    }
    const double d = (double)fmaxf(best, 0.5f * edge);
    *heat = equal / (d * d);
    return is_visible(bvh, point, normal, there, edge);
}

static float mean_edge(const float *positions, const int *triangles, int triangle_count)
{
    double sum = 0.0;
    for (int i = 0; i < 3 * triangle_count; ++i) {
        float d[3];
        vec3_sub(positions + 3 * triangles[i], positions + 3 * triangles[i % 3 == 2 ? i - 2 : i + 1], d);
        sum += (double)vec3_length(d) / (3.0 * triangle_count);
    }
    return (float)sum;
}

struct heat {
    struct matrix matrix;
    struct bvh bvh;
    double *area, *heat, *right, *x, *work;
    float *normals;
};

static void heat_free(struct heat *h)
{
    matrix_free(&h->matrix);
    bvh_free(&h->bvh);
    free(h->area);
    free(h->heat);
    free(h->right);
    free(h->x);
    free(h->work);
    free(h->normals);
}

static bool heat_create(const float *positions, int vertex_count, const int *triangles, int triangle_count, struct heat *h)
{
    const size_t n = (size_t)vertex_count + 1;
    memset(h, 0, sizeof *h);
    h->area = malloc(n * sizeof *h->area);
    h->heat = malloc(n * sizeof *h->heat);
    h->right = malloc(n * sizeof *h->right);
    h->x = malloc(n * sizeof *h->x);
    h->work = malloc(4 * n * sizeof *h->work);
    h->normals = malloc(3 * n * sizeof *h->normals);
    if (!h->area || !h->heat || !h->right || !h->x || !h->work || !h->normals) {
        return false;
    }
    mesh_normals(positions, (size_t)vertex_count, triangles, (size_t)triangle_count, h->normals);
    return laplacian(positions, vertex_count, triangles, triangle_count, &h->matrix, h->area)
           && bvh_build(&h->bvh, positions, (const uint32_t *)triangles, (size_t)triangle_count);
}

struct warm_loop {
    struct heat *h;
    const float *positions;
    const struct bone *bones;
    int bone_count;
    float edge;
    float *weights;
    int *visible_count;
};

static void run_warm_loop(void *arg, int begin, int end)
{
    const struct warm_loop *loop = arg;
    struct heat *h = loop->h;
    const float *positions = loop->positions;
    const struct bone *bones = loop->bones;
    const int bone_count = loop->bone_count;
    const float edge = loop->edge;
    float *weights = loop->weights;
    int visible_count = 0;
    for (int v = begin; v < end; ++v) {
        const bool warmed = warm(&h->bvh, positions + 3 * v, h->normals + 3 * v, bones, bone_count, edge, &h->heat[v],
                                 weights + (size_t)v * (size_t)bone_count);
        h->heat[v] = warmed && h->area[v] > 0.0 ? h->area[v] * h->heat[v] : 0.0;
        visible_count += h->heat[v] > 0.0;
    }
    threads_lock();
    *loop->visible_count += visible_count;
    threads_unlock();
}

bool heat_weights(const float *positions, int vertex_count, const int *triangles, int triangle_count, const struct bone *bones,
                  int bone_count, float *weights, struct heat_report *report)
{
    struct heat h;
    memset(report, 0, sizeof *report);
    bool good = bone_count > 0 && triangle_count > 0 && heat_create(positions, vertex_count, triangles, triangle_count, &h);
    if (!good) {
        if (bone_count > 0 && triangle_count > 0) {
            heat_free(&h);
        }
        return false;
    }
    const float edge = mean_edge(positions, triangles, triangle_count);
    int visible_count = 0;
    struct warm_loop loop = {&h, positions, bones, bone_count, edge, weights, &visible_count};
    threads_for(vertex_count, 256, run_warm_loop, &loop);
    report->visible = visible_count;
    for (int v = 0; v < vertex_count; ++v) {
        h.matrix.diagonal[v] += h.heat[v];
        h.matrix.diagonal[v] = h.matrix.diagonal[v] > 0.0 ? h.matrix.diagonal[v] : 1.0;
    }
    for (int b = 0; visible_count > 0 && b < bone_count; ++b) {
        for (int v = 0; v < vertex_count; ++v) {
            h.x[v] = (double)weights[(size_t)v * (size_t)bone_count + (size_t)b];
            h.right[v] = h.heat[v] * h.x[v];
        }
        report->iterations += solve(&h.matrix, h.right, h.x, h.work);
        for (int v = 0; v < vertex_count; ++v) { /* obtuse triangles violate the maximum principle */
            weights[(size_t)v * (size_t)bone_count + (size_t)b] = (float)fmax(0.0, h.x[v]);
        }
    }
    for (int v = 0; v < vertex_count; ++v) {
        float *w = weights + (size_t)v * (size_t)bone_count, sum = 0.0f;
        for (int b = 0; b < bone_count; ++b) {
            sum += w[b];
        }
        report->sum_error = h.area[v] > 0.0 ? fmax(report->sum_error, fabs((double)sum - 1.0)) : report->sum_error;
        for (int b = 0; sum > 0.0f && b < bone_count; ++b) {
            w[b] /= sum;
        }
    }
    heat_free(&h);
    return visible_count > 0;
}
