#include "registration/relation.h"

#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MIN_PAIRS = 16, CLASSES = 256, INFORMATION_CLASSES = 32, SHADES = 8, LINE_ROUNDS = 8 };
static const float near_line = 0.05f; /* distance from a line at which a pair weighs half */
static const double clearly_less = 0.7; /* of the variance that a line leaves unexplained, for a curve to be taken */
static const double least_gain = 0.03;  /* of the variance, that a curve has to explain more: a motion too bends the relation */
static const float lowest = -0.5f, highest = 1.5f; /* values are cut to this range before they come here */

static bool both_known(float a, float b) { return isfinite(a) && isfinite(b); }

/* Number, means, sums of squares and of products about the means. */
struct moments {
    double number, a, b, aa, bb, ab;
};

static void add_pair(struct moments *m, double weight, double a, double b)
{
    m->number += weight;
    m->a += weight * a, m->b += weight * b;
    m->aa += weight * a * a, m->bb += weight * b * b, m->ab += weight * a * b;
}

static void center_moments(struct moments *m)
{
    if (m->number > 0.0) {
        m->a /= m->number;
        m->b /= m->number;
        m->aa = fmax(0.0, m->aa - m->number * m->a * m->a);
        m->bb = fmax(0.0, m->bb - m->number * m->b * m->b);
        m->ab -= m->number * m->a * m->b;
    }
}

static struct moments find_moments(const float *a, const float *b, size_t count)
{
    struct moments m = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    for (size_t n = 0; n < count; ++n) {
        if (both_known(a[n], b[n])) {
            add_pair(&m, 1.0, (double)a[n], (double)b[n]);
        }
    }
    center_moments(&m);
    return m;
}

static double correlation_of(const struct moments *m)
{
    return m->aa > 0.0 && m->bb > 0.0 ? m->ab / sqrt(m->aa * m->bb) : 0.0;
}

double relation_correlation(const float *a, const float *b, size_t count, size_t *common)
{
    const struct moments m = find_moments(a, b, count);
    *common = (size_t)m.number;
    return correlation_of(&m);
}

/* Makes the deviations equal: unlike the regression of a on b, whose slope falls with every voxel that is not yet in its place. */
static void line_of(const struct moments *m, struct relation *relation)
{
    const double gain = m->bb > 0.0 ? (m->ab < 0.0 ? -1.0 : 1.0) * sqrt(m->aa / m->bb) : 1.0;
    relation->gain = (float)gain;
    relation->offset = (float)(m->a - gain * m->b);
}

/* Fits a line in rounds, in which pairs weigh less the farther they were from it (Cauchy's weights): those that are not yet in
 * their places do not bend it. Returns the cost of the pairs, which the rounds lower. */
static double follow_line(const float *a, const float *b, size_t count, struct relation *relation)
{
    double cost = INFINITY;
    for (int round = 0; round < LINE_ROUNDS; ++round) {
        const float scale = 1.0f / (near_line * near_line * (1.0f + relation->gain * relation->gain));
        struct moments m = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
        cost = 0.0;
        for (size_t n = 0; n < count; ++n) {
            if (both_known(a[n], b[n])) {
                const float off = a[n] - relation->gain * b[n] - relation->offset;
                const double weight = 1.0 / (1.0 + (double)(scale * off * off));
                add_pair(&m, weight, (double)a[n], (double)b[n]);
                cost -= log(weight);
            }
        }
        center_moments(&m);
        if (!(m.bb > 0.0 && m.aa > 0.0)) {
            break;
        }
        line_of(&m, relation);
    }
    return cost;
}

/* Begins with equal deviations, and with equal windows of intensities; takes the line that more pairs are near to. */
static void fit_line(const float *a, const float *b, size_t count, const struct moments *all, struct relation *relation)
{
    const double r = correlation_of(all);
    struct relation other = *relation;
    relation->explained = other.explained = r * r;
    line_of(all, relation);
    other.gain = r < 0.0 ? -1.0f : 1.0f;
    other.offset = r < 0.0 ? 1.0f : 0.0f;
    if (!(follow_line(a, b, count, relation) <= follow_line(a, b, count, &other))) {
        *relation = other;
    }
}

static int class_of(float value, int classes)
{
    const float place = (value - lowest) / (highest - lowest) * (float)classes;
    return place <= 0.0f ? 0 : place >= (float)(classes - 1) ? classes - 1 : (int)place;
}

/* Returns the median of a histogram, straight within its class. */
static float median_of(const unsigned *classes, unsigned total)
{
    const float half = 0.5f * (float)total;
    float below = 0.0f;
    int c = 0;
    while (c < CLASSES - 1 && below + (float)classes[c] < half) {
        below += (float)classes[c++];
    }
    const float part = classes[c] > 0 ? (half - below) / (float)classes[c] : 0.5f;
    return lowest + (highest - lowest) * ((float)c + part) / (float)CLASSES;
}

/* Fits the median of `of` for each class of `by`: a median bears up to half of the pairs being not yet in their places. */
static bool fit_curve(const float *of, const float *by, size_t count, struct relation *relation)
{
    unsigned *joint = calloc((size_t)RELATION_NODES * CLASSES, sizeof *joint), total[RELATION_NODES] = {0}, all = 0;
    double sum[RELATION_NODES] = {0.0};
    if (!joint) {
        return false;
    }
    for (size_t n = 0; n < count; ++n) {
        if (both_known(of[n], by[n])) {
            const int node = class_of(by[n], RELATION_NODES);
            ++joint[node * CLASSES + class_of(of[n], CLASSES)];
            ++total[node];
            ++all;
            sum[node] += (double)by[n];
        }
    }
    relation->nodes = 0;
    for (int node = 0; node < RELATION_NODES; ++node) {
        if (total[node] >= MIN_PAIRS && (double)total[node] > 5e-4 * (double)all) { /* neighbours stand in for rare values */
            relation->at[relation->nodes] = (float)(sum[node] / (double)total[node]);
            relation->to[relation->nodes++] = median_of(joint + node * CLASSES, total[node]);
        }
    }
    free(joint);
    return relation->nodes > 0;
}

static float along_curve(const struct relation *relation, float value)
{
    const float *at = relation->at, *to = relation->to;
    const int last = relation->nodes - 1;
    if (!(value > at[0])) {
        return isnan(value) ? value : to[0];
    }
    if (value >= at[last]) {
        return to[last];
    }
    int low = 0, high = last;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        *(at[middle] <= value ? &low : &high) = middle;
    }
    return to[low] + (value - at[low]) / (at[high] - at[low]) * (to[high] - to[low]);
}

/* Returns 1 - (variance that the curve leaves) / (variance of `of`). */
static double curve_explains(const struct relation *relation, const float *of, const float *by, size_t count)
{
    const struct moments m = find_moments(of, by, count);
    double left = 0.0;
    for (size_t n = 0; n < count; ++n) {
        if (both_known(of[n], by[n])) {
            const double d = (double)(of[n] - along_curve(relation, by[n]));
            left += d * d;
        }
    }
    return m.aa > 0.0 ? fmax(0.0, 1.0 - left / m.aa) : 0.0;
}

bool relation_fit(const float *a, const float *b, size_t count, enum relation_kind kind, struct relation *relation)
{
    const struct moments m = find_moments(a, b, count);
    const bool of_fixed = kind == RELATION_FIXED_CURVE;
    memset(relation, 0, sizeof *relation);
    relation->kind = kind;
    if (m.number < MIN_PAIRS) {
        return false;
    }
    fit_line(a, b, count, &m, relation);
    if (kind == RELATION_SAME || kind == RELATION_LINE) {
        return true;
    }
    if (!fit_curve(of_fixed ? b : a, of_fixed ? a : b, count, relation)) {
        return false;
    }
    relation->explained = curve_explains(relation, of_fixed ? b : a, of_fixed ? a : b, count);
    return true;
}

bool relation_clearly_better(const struct relation *curve, const struct relation *line)
{
    return curve->explained > line->explained + least_gain && 1.0 - curve->explained < clearly_less * (1.0 - line->explained);
}

bool relation_choose(const float *a, const float *b, size_t count, struct relation *relation)
{
    struct relation curves[2];
    if (!relation_fit(a, b, count, RELATION_LINE, relation) || !relation_fit(a, b, count, RELATION_CURVE, &curves[0])
        || !relation_fit(a, b, count, RELATION_FIXED_CURVE, &curves[1])) {
        return false;
    }
    const struct relation *best = &curves[curves[1].explained > curves[0].explained];
    if (relation_clearly_better(best, relation)) {
        *relation = *best;
    }
    return true;
}

bool relation_of_fixed(const struct relation *relation) { return relation->kind == RELATION_FIXED_CURVE; }

void relation_apply(const struct relation *relation, float *values, size_t count)
{
    for (size_t n = 0; n < count && relation->kind != RELATION_SAME; ++n) {
        values[n] = relation->kind == RELATION_LINE ? relation->gain * values[n] + relation->offset
                                                    : along_curve(relation, values[n]);
    }
}

/* Returns the squares that the best combination of the first `used` functions leaves of a: 1, b, and both times x, y, z. */
static double squares_left(const double sums[SHADES + 1][SHADES + 1], int used)
{
    double matrix[SHADES * SHADES], x[SHADES];
    for (int i = 0; i < used; ++i) {
        for (int j = 0; j <= i; ++j) {
            matrix[i * used + j] = sums[i][j];
        }
        matrix[i * used + i] *= 1.0 + 1e-9;
        x[i] = sums[SHADES][i];
    }
    double left = sums[SHADES][SHADES];
    if (LAPACKE_dposv(LAPACK_ROW_MAJOR, 'L', used, 1, matrix, used, x, 1) == 0) {
        for (int i = 0; i < used; ++i) {
            left -= x[i] * sums[SHADES][i];
        }
    }
    return left;
}

double relation_shading(const float *a, const float *b, const int dims[3])
{
    double sums[SHADES + 1][SHADES + 1] = {{0.0}};
    size_t n = 0;
    for (int k = 0; k < dims[2]; ++k) {
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                if (!both_known(a[n], b[n])) {
                    continue;
                }
                const double x = 2.0 * i / dims[0] - 1.0, y = 2.0 * j / dims[1] - 1.0, z = 2.0 * k / dims[2] - 1.0;
                const double v = (double)b[n], f[SHADES + 1] = {1.0, v, x, y, z, x * v, y * v, z * v, (double)a[n]};
                for (int r = 0; r <= SHADES; ++r) {
                    for (int c = 0; c <= r; ++c) {
                        sums[r][c] += f[r] * f[c];
                    }
                }
            }
        }
    }
    const double line = squares_left((const double(*)[SHADES + 1])sums, 2);
    return line > 0.0 ? 1.0 - squares_left((const double(*)[SHADES + 1])sums, SHADES) / line : 0.0;
}

/* The functions of a shading: 1 and places up to the second order, alone and times the value. */
static void shading_functions(double v, const double at[3], double f[RELATION_SHADING])
{
    enum { PLACES = RELATION_SHADING / 2 };
    const double x = at[0], y = at[1], z = at[2], places[PLACES] = {1.0, x, y, z, x * x, y * y, z * z, x * y, y * z, z * x};
    for (int p = 0; p < PLACES; ++p) {
        f[p] = places[p];
        f[PLACES + p] = v * places[p];
    }
}

/* -1..1 along the axes of the grid. */
static void place_in_box(const int dims[3], const float index[3], double at[3])
{
    for (int a = 0; a < 3; ++a) {
        at[a] = 2.0 * (double)index[a] / (double)(dims[a] > 1 ? dims[a] - 1 : 1) - 1.0;
    }
}

float relation_unshade(const double shading[RELATION_SHADING], const int dims[3], const float index[3], float value)
{
    double at[3], f[RELATION_SHADING], sum = 0.0;
    place_in_box(dims, index, at);
    shading_functions((double)value, at, f);
    for (int i = 0; i < RELATION_SHADING; ++i) {
        sum += shading[i] * f[i];
    }
    return (float)sum;
}

static void place_of_pair(const int dims[3], const float *u, size_t n, float index[3])
{
    index[0] = (float)(n % (size_t)dims[0]) + u[3 * n];
    index[1] = (float)(n / (size_t)dims[0] % (size_t)dims[1]) + u[3 * n + 1];
    index[2] = (float)(n / ((size_t)dims[0] * (size_t)dims[1])) + u[3 * n + 2];
}

/* Adds the weighted products of all pairs: of the functions with each other and with a. */
static void add_shading(const float *a, const float *b, const int dims[3], const float *u, const double shading[RELATION_SHADING],
                        double scale, double matrix[RELATION_SHADING * RELATION_SHADING], double right[RELATION_SHADING])
{
    enum { N = RELATION_SHADING };
    const size_t count = (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2];
    memset(matrix, 0, N * N * sizeof *matrix);
    memset(right, 0, N * sizeof *right);
    for (size_t n = 0; n < count; ++n) {
        double at[3], f[N];
        float index[3];
        if (!both_known(a[n], b[n])) {
            continue;
        }
        place_of_pair(dims, u, n, index);
        place_in_box(dims, index, at);
        shading_functions((double)b[n], at, f);
        double off = (double)a[n];
        for (int i = 0; i < N; ++i) {
            off -= shading[i] * f[i];
        }
        const double weight = 1.0 / (1.0 + off * off / (scale * scale));
        for (int i = 0; i < N; ++i) {
            for (int j = 0; j <= i; ++j) {
                matrix[i * N + j] += weight * f[i] * f[j];
            }
            right[i] += weight * f[i] * (double)a[n];
        }
    }
}

bool relation_fit_shading(const float *a, const float *b, const int dims[3], const float *u, const struct relation *line,
                          double shading[RELATION_SHADING])
{
    enum { N = RELATION_SHADING };
    double matrix[N * N];
    memset(shading, 0, N * sizeof *shading);
    shading[0] = (double)line->offset;
    shading[N / 2] = (double)line->gain;
    for (int round = 0; round < LINE_ROUNDS; ++round) { /* first all pairs count, at last those near by */
        double next[N];
        add_shading(a, b, dims, u, shading, (double)near_line * pow(2.0, fmax(0.0, 2.0 - 0.5 * round)), matrix, next);
        for (int i = 0; i < N; ++i) {
            matrix[i * N + i] = matrix[i * N + i] * (1.0 + 1e-6) + 1e-9;
        }
        if (LAPACKE_dposv(LAPACK_ROW_MAJOR, 'L', N, 1, matrix, N, next, 1) != 0) {
            return false;
        }
        memcpy(shading, next, sizeof next);
    }
    return true;
}

static void extremes(const float *values, const float *others, size_t count, float *low, float *high)
{
    *low = INFINITY;
    *high = -INFINITY;
    for (size_t n = 0; n < count; ++n) {
        if (both_known(values[n], others[n])) {
            *low = fminf(*low, values[n]);
            *high = fmaxf(*high, values[n]);
        }
    }
}

double relation_mutual_information(const float *a, const float *b, size_t count)
{
    enum { N = INFORMATION_CLASSES };
    double joint[N][N] = {{0.0}}, of_a[N] = {0.0}, of_b[N] = {0.0}, total = 0.0, bits = 0.0;
    float low[2], high[2];
    extremes(a, b, count, &low[0], &high[0]);
    extremes(b, a, count, &low[1], &high[1]);
    if (!(high[0] > low[0] && high[1] > low[1])) {
        return 0.0;
    }
    for (size_t n = 0; n < count; ++n) {
        if (both_known(a[n], b[n])) {
            const int i = (int)((float)N * (a[n] - low[0]) / (high[0] - low[0])),
                      j = (int)((float)N * (b[n] - low[1]) / (high[1] - low[1]));
            joint[i < N ? i : N - 1][j < N ? j : N - 1] += 1.0;
            total += 1.0;
        }
    }
    for (int i = 0; i < N; ++i) {
        for (int j = 0; j < N; ++j) {
            of_a[i] += joint[i][j];
            of_b[j] += joint[i][j];
        }
    }
    for (int i = 0; i < N; ++i) {
        for (int j = 0; j < N; ++j) {
            bits += joint[i][j] > 0.0 ? joint[i][j] / total * log2(joint[i][j] * total / (of_a[i] * of_b[j])) : 0.0;
        }
    }
    return bits;
}
