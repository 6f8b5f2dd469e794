#include "shapes/surface_fit.h"

#include "base/threads.h"
#include "base/vec3.h"

#include <lapacke.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Deviation of a landmark, and bounds of a noise that is learned, in sizes of the template. */
static const double landmark_noise = 0.02, least_noise = 0.002, most_noise = 0.04;

const struct warp_prior warp_prior_rough = {{0.6, 0.3}, {0.07, 0.07}, 0.0, 0.02, 0.0894427191, false},
                        warp_prior_exact = {{1.0, 0.4}, {0.1, 0.03}, 0.1, 0.02, 0.3, true};

/* ---- targets ---- */

void mesh_normals(const float *positions, size_t vertex_count, const int *triangles, size_t triangle_count, float *normals)
{
    memset(normals, 0, 3 * vertex_count * sizeof *normals);
    for (size_t t = 0; t < triangle_count; ++t) {
        const int *corner = triangles + 3 * t;
        float e[3], f[3], n[3];
        vec3_sub(positions + 3 * corner[1], positions + 3 * corner[0], e);
        vec3_sub(positions + 3 * corner[2], positions + 3 * corner[0], f);
        vec3_cross(e, f, n);
        for (int k = 0; k < 3; ++k) {
            vec3_add_scaled(normals + 3 * corner[k], 1.0f, n, normals + 3 * corner[k]);
        }
    }
    for (size_t v = 0; v < vertex_count; ++v) {
        vec3_normalize(normals + 3 * v);
    }
}

struct half_edge {
    int low, high;
    uint32_t half;
};

static int compare_edges(const void *left, const void *right)
{
    const struct half_edge *a = left, *b = right;
    if (a->low != b->low) {
        return a->low < b->low ? -1 : 1;
    }
    return a->high < b->high ? -1 : a->high > b->high;
}

static bool find_rims(struct target *target)
{
    const size_t count = 3 * target->triangle_count;
    struct half_edge *edges = malloc(count * sizeof *edges);
    for (size_t h = 0; edges && h < count; ++h) {
        const int a = target->triangles[h], b = target->triangles[h % 3 == 2 ? h - 2 : h + 1];
        edges[h].low = a < b ? a : b;
        edges[h].high = a < b ? b : a;
        edges[h].half = (uint32_t)h;
    }
    if (!edges) {
        return false;
    }
    qsort(edges, count, sizeof *edges, compare_edges);
    for (size_t h = 0; h < count; ++h) {
        const bool alone = (h == 0 || compare_edges(edges + h - 1, edges + h) != 0)
                        && (h + 1 == count || compare_edges(edges + h, edges + h + 1) != 0);
        if (alone) {
            target->rim[edges[h].half / 3] |= (unsigned char)(1 << edges[h].half % 3);
            target->open = true;
        }
    }
    free(edges);
    return true;
}

/* Computes center and size by area, so that they do not depend on the triangulation. */
static bool measure(struct target *target)
{
    double area = 0.0, square = 0.0;
    for (size_t t = 0; t < target->triangle_count; ++t) {
        const int *corner = target->triangles + 3 * t;
        float c[9], normal[3];
        for (int k = 0; k < 3; ++k) {
            memcpy(c + 3 * k, target->positions + 3 * corner[k], 3 * sizeof *c);
        }
        const double a = (double)vec3_triangle_normal(c, normal);
        area += a;
        for (int k = 0; k < 3; ++k) {
            const double m = ((double)c[k] + (double)c[3 + k] + (double)c[6 + k]) / 3.0;
            target->center[k] += a * m;
            square += a * m * m;
        }
    }
    if (!(area > 0.0)) {
        return false;
    }
    for (int k = 0; k < 3; ++k) {
        target->center[k] /= area;
        square -= area * target->center[k] * target->center[k];
    }
    target->radius = sqrt(fmax(square, 0.0) / area);
    return target->radius > 0.0;
}

bool target_create(const float *positions, size_t vertex_count, const int *triangles, size_t triangle_count,
                   struct target *target) {
    memset(target, 0, sizeof *target);
    target->positions = positions;
    target->triangles = triangles;
    target->vertex_count = vertex_count;
    target->triangle_count = triangle_count;
    target->normals = malloc(3 * vertex_count * sizeof *target->normals);
    target->rim = calloc(triangle_count + 1, sizeof *target->rim);
    const bool good = target->normals && target->rim && measure(target) && find_rims(target)
                   && bvh_build(&target->bvh, positions, (const uint32_t *)(const void *)triangles, triangle_count);
    if (good) {
        mesh_normals(positions, vertex_count, triangles, triangle_count, target->normals);
    } else {
        target_free(target);
    }
    return good;
}

void target_free(struct target *target)
{
    free(target->normals);
    free(target->rim);
    bvh_free(&target->bvh);
    memset(target, 0, sizeof *target);
}

void mesh_barycentric(const float *a, const float *b, const float *c, const float *place, float weight[3])
{
    float e[3], f[3], d[3];
    vec3_sub(b, a, e);
    vec3_sub(c, a, f);
    vec3_sub(place, a, d);
    const float ee = vec3_dot(e, e), ef = vec3_dot(e, f), ff = vec3_dot(f, f), de = vec3_dot(d, e), df = vec3_dot(d, f);
    const float det = ee * ff - ef * ef;
    weight[1] = det > 0.0f ? (ff * de - ef * df) / det : 0.0f;
    weight[2] = det > 0.0f ? (ee * df - ef * de) / det : 0.0f;
    weight[0] = 1.0f - weight[1] - weight[2];
}

void target_nearest(const struct target *target, const struct similarity *pose, const float point[3], struct target_hit *hit)
{
    float at[3], place[3] = {0.0f, 0.0f, 0.0f}, weight[3], normal[3] = {0.0f, 0.0f, 0.0f}, away[3];
    uint32_t triangle = 0;
    similarity_apply(pose, point, at);
    const float distance = bvh_distance(&target->bvh, at, place, &triangle);
    const int *corner = target->triangles + 3 * (size_t)triangle;
    const float *p = target->positions;
    mesh_barycentric(p + 3 * corner[0], p + 3 * corner[1], p + 3 * corner[2], place, weight);
    hit->on_rim = false;
    hit->vertex = (uint32_t)corner[weight[1] > weight[0] ? (weight[2] > weight[1] ? 2 : 1) : weight[2] > weight[0] ? 2 : 0];
    for (int k = 0; k < 3; ++k) { /* edge k is opposite corner k + 2 */
        vec3_add_scaled(normal, weight[k], target->normals + 3 * corner[k], normal);
        hit->on_rim = hit->on_rim || ((target->rim[triangle] >> k & 1) && weight[(k + 2) % 3] < 1e-3f);
    }
    vec3_normalize(normal);
    vec3_sub(at, place, away);
    const struct similarity back = similarity_inverse(pose);
    similarity_apply(&back, place, hit->place);
    for (int r = 0; r < 3; ++r) {
        hit->normal[r] = (float)(back.rotation[r][0] * (double)normal[0] + back.rotation[r][1] * (double)normal[1]
                                 + back.rotation[r][2] * (double)normal[2]);
    }
    hit->signed_distance = copysignf(distance * (float)back.scale, vec3_dot(away, normal));
}

int points_spread(const float *points, int count, int wanted, int *chosen)
{
    float *distance = malloc(((size_t)count + 1) * sizeof *distance);
    int have = 0, next = 0;
    for (int i = 0; distance && i < count; ++i) {
        distance[i] = INFINITY;
    }
    while (distance && have < wanted && have < count) {
        chosen[have++] = next;
        const float *last = points + 3 * next;
        int furthest = 0;
        for (int i = 0; i < count; ++i) {
            float d[3];
            vec3_sub(points + 3 * i, last, d);
            distance[i] = fminf(distance[i], vec3_dot(d, d));
            if (distance[i] > distance[furthest]) {
                furthest = i;
            }
        }
        next = furthest;
    }
    free(distance);
    return have;
}

/* ---- warps ---- */

/* Evaluates the kernel between a point and center c; gradient: its derivative by the point. */
static double kernel(const struct warp *warp, const float point[3], int c, double gradient[3])
{
    const struct warp_prior *prior = &warp->prior;
    double d[3], d2 = 0.0, sum = 0.0, slope = 0.0;
    for (int k = 0; k < 3; ++k) {
        d[k] = (double)point[k] - (double)warp->centers[3 * c + k];
        d2 += d[k] * d[k];
    }
    for (int i = 0; i < 2; ++i) {
        const double length = prior->length[i] * warp->size, fall = 0.5 / (length * length);
        const double deviation = prior->deviation[i] * warp->size, part = deviation * deviation * exp(-d2 * fall);
        sum += part;
        slope -= fall * part;
    }
    for (int k = 0; k < 3; ++k) {
        const double linear = prior->stretch * prior->stretch * ((double)warp->centers[3 * c + k] - warp->middle[k]);
        sum += linear * ((double)point[k] - warp->middle[k]);
        gradient[k] = 2.0 * slope * d[k] + linear;
    }
    return sum;
}

/* Evaluates the kernel between all pairs of centers. */
static void fill_kernels(struct warp *warp)
{
    const size_t count = (size_t)warp->count;
    double gradient[3];
    for (size_t a = 0; a < count; ++a) {
        for (size_t b = 0; b <= a; ++b) {
            warp->kernels[a * count + b] = warp->kernels[b * count + a] = kernel(warp, warp->centers + 3 * a, (int)b, gradient);
        }
    }
}

bool warp_create(const float *centers, int count, const float *landmarks, int landmark_count, double size,
                 const struct warp_prior *prior, struct warp *warp)
{
    const size_t all = 3 * (size_t)(count + landmark_count);
    memset(warp, 0, sizeof *warp);
    warp->count = count + landmark_count;
    warp->pinned = landmark_count;
    warp->size = size;
    warp->prior = *prior;
    warp->centers = malloc((all + 1) * sizeof *warp->centers);
    warp->weights = calloc(all + 1, sizeof *warp->weights);
    warp->kernels = malloc(((size_t)warp->count * (size_t)warp->count + 1) * sizeof *warp->kernels);
    if (!warp->centers || !warp->weights || !warp->kernels) {
        warp_free(warp);
        return false;
    }
    memcpy(warp->centers, centers, 3 * (size_t)count * sizeof *centers);
    for (int i = 0; i < 3 * count; ++i) {
        warp->middle[i % 3] += (double)centers[i] / count;
    }
    if (landmark_count > 0) {
        memcpy(warp->centers + 3 * count, landmarks, 3 * (size_t)landmark_count * sizeof *landmarks);
    }
    fill_kernels(warp);
    return true;
}

void warp_free(struct warp *warp)
{
    free(warp->centers);
    free(warp->weights);
    free(warp->kernels);
    memset(warp, 0, sizeof *warp);
}

bool warp_copy(const struct warp *from, struct warp *to)
{
    if (from->count == to->count) {
        memcpy(to->weights, from->weights, 3 * (size_t)from->count * sizeof *to->weights);
    }
    return from->count == to->count;
}

void warp_apply(const struct warp *warp, const float point[3], float place[3], float derivative[9])
{
    double u[3] = {0.0, 0.0, 0.0}, g[9] = {0.0};
    for (int c = 0; c < warp->count; ++c) {
        const double *w = warp->weights + 3 * c;
        double gradient[3];
        const double value = kernel(warp, point, c, gradient);
        for (int r = 0; r < 3; ++r) {
            u[r] += value * w[r];
            for (int k = 0; derivative && k < 3; ++k) {
                g[3 * r + k] += gradient[k] * w[r];
            }
        }
    }
    for (int r = 0; r < 3; ++r) {
        place[r] = (float)((double)point[r] + u[r]);
        for (int k = 0; derivative && k < 3; ++k) {
            derivative[3 * r + k] = (float)(g[3 * r + k] + (r == k ? 1.0 : 0.0));
        }
    }
}

/* Computes x + u(x) at a center. */
static void warp_apply_to_center(const struct warp *warp, int a, float place[3])
{
    const double *row = warp->kernels + (size_t)a * (size_t)warp->count;
    double u[3] = {0.0, 0.0, 0.0};
    for (int c = 0; c < warp->count; ++c) {
        for (int r = 0; r < 3; ++r) {
            u[r] += row[c] * warp->weights[3 * c + r];
        }
    }
    for (int r = 0; r < 3; ++r) {
        place[r] = (float)((double)warp->centers[3 * a + r] + u[r]);
    }
}

/* A measured displacement of a center from the template. Its covariance is variance I - surer normal normal^T. */
struct constraint {
    double displacement[3], normal[3], variance, surer;
};

/* Makes a constraint with the warp's noise along `normal` and a weak one across it. */
static struct constraint constraint_along(const struct warp *warp, const double displacement[3], const float normal[3])
{
    const double along2 = pow(warp->prior.noise * warp->size, 2.0), across2 = pow(warp->prior.slide * warp->size, 2.0);
    struct constraint constraint = {.variance = across2, .surer = fmax(0.0, across2 - along2)};
    for (int r = 0; r < 3; ++r) {
        constraint.displacement[r] = displacement[r];
        constraint.normal[r] = (double)normal[r];
    }
    return constraint;
}

static struct constraint isotropic_constraint(const double displacement[3], double sigma)
{
    struct constraint constraint = {.variance = sigma * sigma};
    memcpy(constraint.displacement, displacement, sizeof constraint.displacement);
    return constraint;
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Computes the inverse of K + variances, n x n for n centers. */
static bool invert_isotropic(const struct warp *warp, const struct constraint *constraints, double *inverse)
{
    const int n = warp->count;
    memcpy(inverse, warp->kernels, (size_t)n * (size_t)n * sizeof *inverse);
    for (int a = 0; a < n; ++a) {
        inverse[(size_t)a * (size_t)(n + 1)] += constraints[a].variance;
    }
    const bool good = LAPACKE_dpotrf(LAPACK_ROW_MAJOR, 'L', n, inverse, n) == 0
                   && LAPACKE_dpotri(LAPACK_ROW_MAJOR, 'L', n, inverse, n) == 0;
    for (int a = 0; good && a < n; ++a) { /* the other half */
        for (int b = 0; b < a; ++b) {
            inverse[(size_t)b * (size_t)n + (size_t)a] = inverse[(size_t)a * (size_t)n + (size_t)b];
        }
    }
    return good;
}

/* Computes I - U^T G U: columns of U are the normals times sqrt(surer). */
static void fill_capacity(const struct warp *warp, const struct constraint *constraints, const double *inverse, double *capacity)
{
    const size_t n = (size_t)warp->count;
    for (size_t a = 0; a < n; ++a) {
        for (size_t b = 0; b <= a; ++b) {
            const double both = sqrt(constraints[a].surer * constraints[b].surer) * dot(constraints[a].normal, constraints[b].normal);
            capacity[a * n + b] = (a == b ? 1.0 : 0.0) - both * inverse[a * n + b];
        }
    }
}

/* Sets weights = (G x I) wanted, 3 numbers a center. */
static void multiply(const double *inverse, int count, const double *wanted, double *weights)
{
    for (int a = 0; a < count; ++a) {
        double *w = weights + 3 * a;
        w[0] = w[1] = w[2] = 0.0;
        for (int b = 0; b < count; ++b) {
            const double value = inverse[(size_t)a * (size_t)count + (size_t)b];
            for (int r = 0; r < 3; ++r) {
                w[r] += value * wanted[3 * b + r];
            }
        }
    }
}

/* Sets the warp's noise to one under which the constraints are more probable, by a step of MacKay's fixed-point iteration (1992):
 * their derivative by the noise vanishes where the squares of the weights along the normals are the inverse of the whole matrix
 * there, (1 / capacity - 1) / surer by the same formula as in solve. inverse: the capacity's. */
static void learn_noise(struct warp *warp, const struct constraint *constraints, const double *inverse)
{
    double found = 0.0, expected = 0.0;
    for (int a = 0; a < warp->count; ++a) {
        const double along = dot(constraints[a].normal, warp->weights + 3 * a);
        found += along * along;
        expected += constraints[a].surer > 0.0 ? (inverse[(size_t)a * (size_t)(warp->count + 1)] - 1.0) / constraints[a].surer : 0.0;
    }
    if (expected > 0.0) {
        warp->prior.noise = fmin(most_noise, fmax(least_noise, warp->prior.noise * sqrt(found / expected)));
    }
}

/* Finds the most probable displacement under one constraint a center, and learns the noise if the prior does: the weights are the
 * inverse of K x I + covariance = (K + variances) x I - U U^T, times the displacements. By Woodbury's formula, with G the inverse of
 * K + variances and H = G x I,
 *   (H^-1 - U U^T)^-1 = H + H U (I - U^T H U)^-1 U^T H,
 * which takes matrices of one row a center instead of three. Returns false if LAPACK fails or memory is short. */
static bool solve(struct warp *warp, const struct constraint *constraints)
{
    const int n = warp->count;
    const size_t square = (size_t)n * (size_t)n;
    double *inverse = malloc((2 * square + 4 * (size_t)n + 1) * sizeof *inverse);
    if (!inverse) {
        return false;
    }
    double *capacity = inverse + square, *wanted = capacity + square, *along = wanted + 3 * n;
    bool good = invert_isotropic(warp, constraints, inverse);
    for (int a = 0; a < n; ++a) {
        memcpy(wanted + 3 * a, constraints[a].displacement, sizeof constraints[a].displacement);
    }
    if (good) {
        multiply(inverse, n, wanted, warp->weights);
        fill_capacity(warp, constraints, inverse, capacity);
        for (int a = 0; a < n; ++a) {
            along[a] = sqrt(constraints[a].surer) * dot(constraints[a].normal, warp->weights + 3 * a);
        }
        good = LAPACKE_dposv(LAPACK_ROW_MAJOR, 'L', n, 1, capacity, n, along, 1) == 0;
    }
    if (good) {
        for (int i = 0; i < 3 * n; ++i) {
            wanted[i] += sqrt(constraints[i / 3].surer) * along[i / 3] * constraints[i / 3].normal[i % 3];
        }
        multiply(inverse, n, wanted, warp->weights);
    }
    if (good && warp->prior.learns) {
        good = LAPACKE_dpotri(LAPACK_ROW_MAJOR, 'L', n, capacity, n) == 0;
        if (good) {
            learn_noise(warp, constraints, capacity);
        }
    }
    free(inverse);
    return good;
}

static struct constraint follow_surface(const struct warp *warp, int a, const struct target *target, const struct similarity *pose,
                                        const float at[3], const float normal[3])
{
    const double loose = 20.0 * warp->size;
    struct target_hit hit;
    double displacement[3];
    float offset[3];
    target_nearest(target, pose, at, &hit);
    const bool known = !hit.on_rim && vec3_dot(hit.normal, normal) > 0.3f;
    vec3_sub(hit.place, at, offset);
    const double along = known ? (double)vec3_dot(offset, hit.normal) : 0.0;
    for (int r = 0; r < 3; ++r) {
        displacement[r] = (double)at[r] - (double)warp->centers[3 * a + r] + along * (double)hit.normal[r];
    }
    return known ? constraint_along(warp, displacement, hit.normal) : isotropic_constraint(displacement, loose);
}

static struct constraint follow_landmark(const struct warp *warp, int a, const struct similarity *back,
                                              const float landmark[3])
{
    double displacement[3];
    float to[3];
    similarity_apply(back, landmark, to);
    for (int r = 0; r < 3; ++r) {
        displacement[r] = (double)to[r] - (double)warp->centers[3 * a + r];
    }
    return isotropic_constraint(displacement, landmark_noise * warp->size);
}

bool warp_fit(struct warp *warp, const struct target *target, const struct similarity *pose, const float *now,
              const float *normals, const float *landmarks)
{
    const struct similarity back = similarity_inverse(pose);
    const int free_centers = warp->count - warp->pinned;
    struct constraint *constraints = malloc(((size_t)warp->count + 1) * sizeof *constraints);
    for (int a = 0; constraints && a < warp->count; ++a) {
        constraints[a] = a < free_centers ? follow_surface(warp, a, target, pose, now + 3 * a, normals + 3 * a)
                                     : follow_landmark(warp, a, &back, landmarks + 3 * (a - free_centers));
    }
    const bool good = constraints && solve(warp, constraints);
    free(constraints);
    return good;
}

double warp_cost(const struct warp *warp, const struct target *target, const struct similarity *pose)
{
    const double sigma2 = warp->prior.noise * warp->prior.noise * warp->size * warp->size;
    double cost = 0.0;
    for (int a = 0; a < warp->count; ++a) {
        struct target_hit hit;
        float at[3];
        warp_apply_to_center(warp, a, at);
        for (int k = 0; k < 3; ++k) { /* weights^T K weights, where K weights is u at the centers */
            cost += warp->weights[3 * a + k] * ((double)at[k] - (double)warp->centers[3 * a + k]);
        }
        if (a >= warp->count - warp->pinned) {
            continue;
        }
        target_nearest(target, pose, at, &hit);
        cost += hit.on_rim ? 0.0 : (double)(hit.signed_distance * hit.signed_distance) / sigma2;
    }
    return cost / warp->count;
}

/* ---- registration ---- */

enum { ICP_POINTS = 100, ICP_STEPS = 15, ORIENTATIONS = 200, TRIES = 24, WARP_POINTS = 100, WARP_STEPS = 8, WARP_ROUNDS = 3 };

/* Runs iterated closest points; keeps the size unless `scaling`. Returns the root mean square distance. */
static double icp(const struct target *target, const float *points, int count, bool scaling, int steps, struct similarity *pose)
{
    float places[3 * ICP_POINTS];
    double weights[ICP_POINTS], sum = 0.0;
    for (int step = 0; step <= steps; ++step) {
        int used = 0;
        sum = 0.0;
        for (int i = 0; i < count; ++i) {
            struct target_hit hit;
            target_nearest(target, pose, points + 3 * i, &hit);
            similarity_apply(pose, hit.place, places + 3 * i);
            weights[i] = hit.on_rim ? 0.0 : 1.0;
            used += !hit.on_rim;
            sum += weights[i] * (double)(hit.signed_distance * hit.signed_distance);
        }
        sum = used > 0 ? sqrt(sum / used) : INFINITY;
        struct similarity better;
        if (step == steps || !similarity_fit(points, places, weights, (size_t)count, true, &better)) {
            break;
        }
        if (!scaling) { /* rotate about the common center */
            similarity_fit(points, places, weights, (size_t)count, false, &better);
            const double scale = pose->scale;
            double center[3] = {0.0, 0.0, 0.0}, total = 0.0;
            for (int i = 0; i < count; ++i) {
                total += weights[i];
                for (int k = 0; k < 3; ++k) {
                    center[k] += weights[i] * (double)points[3 * i + k];
                }
            }
            for (int r = 0; r < 3; ++r) {
                for (int k = 0; k < 3; ++k) {
                    better.translation[r] += (1.0 - scale) * better.rotation[r][k] * center[k] / fmax(total, 1.0);
                }
            }
            better.scale = scale;
        }
        *pose = better;
    }
    return sum;
}

/* Places the template center on center in the same size, with a given rotation. */
static void place(const struct target *target, const double center[3], double size, struct similarity *pose)
{
    pose->scale = target->radius / size;
    for (int r = 0; r < 3; ++r) {
        pose->translation[r] = target->center[r];
        for (int k = 0; k < 3; ++k) {
            pose->translation[r] -= pose->scale * pose->rotation[r][k] * center[k];
        }
    }
}

/* Makes Shoemake's random quaternions (1992) from three additive recurrences (Roberts 2018). */
void rotation_number(int i, double rotation[3][3])
{
    const double g = 1.2207440846057596, turn = 6.283185307179586;
    const double u = fmod(0.5 + i / g, 1.0), v = turn * fmod(0.5 + i / (g * g), 1.0), w = turn * fmod(0.5 + i / (g * g * g), 1.0);
    const double a = sqrt(1.0 - u) * sin(v), b = sqrt(1.0 - u) * cos(v), c = sqrt(u) * sin(w), d = sqrt(u) * cos(w);
    const double matrix[3][3] = {{1 - 2 * (b * b + c * c), 2 * (a * b - c * d), 2 * (a * c + b * d)},
                                 {2 * (a * b + c * d), 1 - 2 * (a * a + c * c), 2 * (b * c - a * d)},
                                 {2 * (a * c - b * d), 2 * (b * c + a * d), 1 - 2 * (a * a + b * b)}};
    memcpy(rotation, matrix, sizeof matrix);
}

struct attempt {
    struct similarity pose;
    double distance;
};

static int compare_attempts(const void *left, const void *right)
{
    const struct attempt *a = left, *b = right;
    return a->distance < b->distance ? -1 : a->distance > b->distance;
}

/* Alternates between pose and warp: the similarity part of the warp moves into the pose. */
static bool refine(const struct target *target, const struct fit_source *source, const float *landmarks, struct similarity *pose,
                   double *cost)
{
    struct warp warp;
    const size_t bytes = 3 * (size_t)source->count * sizeof(float);
    float *now = malloc(bytes);
    bool good = now && warp_create(source->points, source->count, source->landmarks, source->landmark_count, source->size,
                                   source->prior, &warp);
    if (!good) {
        free(now);
        return false;
    }
    /* Keeps one noise, under which costs can be compared, and short steps, since what is nearest changes with the pose. */
    warp.prior.learns = false;
    warp.prior.slide = warp_prior_rough.slide;
    for (int round = 0; good && round < WARP_ROUNDS; ++round) {
        struct similarity within;
        memset(warp.weights, 0, 3 * (size_t)warp.count * sizeof *warp.weights);
        memcpy(now, source->points, bytes);
        for (int step = 0; good && step < WARP_STEPS; ++step) {
            good = warp_fit(&warp, target, pose, now, source->normals, landmarks);
            for (int i = 0; i < source->count; ++i) {
                warp_apply_to_center(&warp, i, now + 3 * i);
            }
        }
        *cost = warp_cost(&warp, target, pose);
        if (round + 1 < WARP_ROUNDS && similarity_fit(source->points, now, NULL, (size_t)source->count, true, &within)) {
            *pose = similarity_after(&within, pose);
        }
    }
    warp_free(&warp);
    free(now);
    return good;
}

/* Moves different attempts to the front of `attempts`, the nearest first; returns how many. */
static int keep_different(struct attempt *attempts, int count, int maximum)
{
    const double min_angle = 0.2; /* radians */
    int kept = 0;
    qsort(attempts, (size_t)count, sizeof *attempts, compare_attempts);
    for (int i = 0; i < count && kept < maximum; ++i) {
        bool fresh = true;
        for (int k = 0; fresh && k < kept; ++k) {
            fresh = similarity_angle(&attempts[i].pose, &attempts[k].pose) > min_angle;
        }
        if (fresh) {
            attempts[kept++] = attempts[i];
        }
    }
    return kept;
}

struct first_loop {
    const struct target *target;
    const struct fit_source *few;
    enum orientation orientation;
    const double *center;
    struct attempt *attempts;
};

static void run_first_loop(void *arg, int begin, int end)
{
    const struct first_loop *loop = arg;
    const struct target *target = loop->target;
    const struct fit_source *few = loop->few;
    const enum orientation orientation = loop->orientation;
    const double *center = loop->center;
    struct attempt *attempts = loop->attempts;
    for (int i = begin; i < end; ++i) {
        attempts[i].pose = similarity_identity();
        if (orientation == ORIENTATION_SEARCH) {
            rotation_number(i, attempts[i].pose.rotation);
        }
        place(target, center, few->size, &attempts[i].pose);
        icp(target, few->points, few->count, false, ICP_STEPS, &attempts[i].pose);
        attempts[i].distance = icp(target, few->points, few->count, !target->open, ICP_STEPS, &attempts[i].pose);
    }
}

/* Makes the first poses: the landmarks' own, or center on center in the same size with `tries` rotations. */
static int first_attempts(const struct target *target, const struct fit_source *few, enum orientation orientation,
                          const float *landmarks, const double center[3], struct attempt *attempts) {
    if (orientation == ORIENTATION_MARKED) {
        return similarity_fit(few->landmarks, landmarks, NULL, (size_t)few->landmark_count, true, &attempts[0].pose) ? 1 : 0;
    }
    const int tries = orientation == ORIENTATION_SEARCH ? ORIENTATIONS : 1;
    struct first_loop loop = {target, few, orientation, center, attempts};
    threads_for(tries, 1, run_first_loop, &loop);
    return keep_different(attempts, tries, TRIES);
}

struct refine_loop {
    const struct target *target;
    const struct fit_source *few;
    const float *landmarks;
    struct attempt *attempts;
};

static void run_refine_loop(void *arg, int begin, int end)
{
    const struct refine_loop *loop = arg;
    const struct target *target = loop->target;
    const struct fit_source *few = loop->few;
    const float *landmarks = loop->landmarks;
    struct attempt *attempts = loop->attempts;
    for (int i = begin; i < end; ++i) {
        if (!refine(target, few, landmarks, &attempts[i].pose, &attempts[i].distance)) {
            attempts[i].distance = INFINITY;
        }
    }
}

bool surface_register(const struct target *target, const struct fit_source *source, enum orientation orientation,
                      const float *landmarks, struct similarity *pose, double *cost)
{
    struct attempt attempts[ORIENTATIONS];
    float points[3 * WARP_POINTS], normals[3 * WARP_POINTS];
    int chosen[WARP_POINTS];
    double center[3], radius;
    struct fit_source few = *source;
    few.count = points_spread(source->points, source->count, WARP_POINTS, chosen);
    if (few.count < 3) {
        return false;
    }
    for (int i = 0; i < few.count; ++i) {
        memcpy(points + 3 * i, source->points + 3 * chosen[i], 3 * sizeof *points);
        memcpy(normals + 3 * i, source->normals + 3 * chosen[i], 3 * sizeof *normals);
    }
    few.points = points;
    few.normals = normals;
    shape_size(source->points, (size_t)source->count, center, &radius);
    const int tries = first_attempts(target, &few, orientation, landmarks, center, attempts);
    struct refine_loop loop = {target, &few, landmarks, attempts};
    threads_for(tries, 1, run_refine_loop, &loop);
    if (tries > 0) {
        qsort(attempts, (size_t)tries, sizeof *attempts, compare_attempts);
        *pose = attempts[0].pose;
        *cost = attempts[0].distance;
    }
    return tries > 0 && isfinite(*cost);
}
