/* register_start.c - where the affine map begins: at the files' world coordinates, or with the centres of mass and the principal
 * axes laid on each other. Levenberg-Marquardt finds the nearest minimum only, some centimetres and 30 degrees away. */
#include "registration/register.h"

#include "imaging/resample.h"

#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double min_overlap = 0.3;  /* share of the smaller image that must lie inside the other one */
static const double clearly_more = 0.02; /* correlation by which another start has to be better than the headers' */

/* Center of mass, and the principal axes as rows, longest first, right-handed. Values are masses. */
struct mass {
    double center[3], axes[3][3];
};

static void world_of(const struct volume *image, size_t n, double x[3])
{
    int place[3];
    float world[3];
    volume_place(image->dims, n, place);
    volume_index_to_world(image, (const float[3]){(float)place[0], (float)place[1], (float)place[2]}, world);
    for (int a = 0; a < 3; ++a) {
        x[a] = (double)world[a];
    }
}

static bool find_mass(const struct volume *image, struct mass *mass)
{
    double sum = 0.0, first[3] = {0.0, 0.0, 0.0}, second[9] = {0.0}, lengths[3], x[3];
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        const double weight = fmax(0.0, (double)image->data[n]);
        world_of(image, n, x);
        sum += weight;
        for (int a = 0; a < 3; ++a) {
            first[a] += weight * x[a];
        }
    }
    for (int a = 0; a < 3; ++a) {
        mass->center[a] = first[a] / sum;
    }
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        const double weight = fmax(0.0, (double)image->data[n]);
        world_of(image, n, x);
        for (int a = 0; a < 9; ++a) {
            second[a] += weight * (x[a / 3] - mass->center[a / 3]) * (x[a % 3] - mass->center[a % 3]);
        }
    }
    if (!(sum > 0.0) || LAPACKE_dsyev(LAPACK_ROW_MAJOR, 'V', 'U', 3, second, 3, lengths) != 0) {
        return false;
    }
    for (int a = 0; a < 3; ++a) { /* eigenvectors are columns, shortest first */
        mass->axes[0][a] = second[3 * a + 2];
        mass->axes[1][a] = second[3 * a + 1];
    }
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        mass->axes[2][a] = mass->axes[0][b] * mass->axes[1][c] - mass->axes[0][c] * mass->axes[1][b];
    }
    return true;
}

/* Builds the map x -> R (x - from) + to. */
static void map_about(const double rotation[3][3], const double from[3], const double to[3], double map[3][4])
{
    for (int r = 0; r < 3; ++r) {
        map[r][3] = to[r];
        for (int c = 0; c < 3; ++c) {
            map[r][c] = rotation[r][c];
            map[r][3] -= rotation[r][c] * from[c];
        }
    }
}

/* The rotations of a cube: the signed permutations whose determinant is 1. k = 0 is the identity. */
static bool cube_rotation(int k, double rotation[3][3])
{
    static const int permutations[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
    const int *p = permutations[k / 8];
    double sign = k < 24 ? 1.0 : -1.0; /* the first three permutations are even */
    memset(rotation, 0, 9 * sizeof(double));
    for (int a = 0; a < 3; ++a) {
        rotation[a][p[a]] = k >> a & 1 ? -1.0 : 1.0;
        sign *= rotation[a][p[a]];
    }
    return sign > 0.0;
}

/* The rotation that takes the fixed image's principal axes to the moving one's; k: which two of them change their direction. */
static void axes_rotation(const struct mass *fixed, const struct mass *moving, int k, double rotation[3][3])
{
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
            rotation[r][c] = 0.0;
            for (int a = 0; a < 3; ++a) {
                rotation[r][c] += (k == 0 || k - 1 == a ? 1.0 : -1.0) * moving->axes[a][r] * fixed->axes[a][c];
            }
        }
    }
}

static double box(const struct volume *image)
{
    return (double)image->spacing[0] * (double)image->spacing[1] * (double)image->spacing[2] * (double)volume_voxels(image);
}

double register_min_voxels(const struct volume *fixed, const struct volume *moving)
{
    return min_overlap * (double)volume_voxels(fixed) * fmin(1.0, box(moving) / box(fixed));
}

double register_correlation(const float *a, const float *b, size_t count, size_t *common)
{
    double sum[5] = {0.0, 0.0, 0.0, 0.0, 0.0}, number = 0.0;
    for (size_t n = 0; n < count; ++n) {
        if (isfinite(a[n]) && isfinite(b[n])) {
            const double x = (double)a[n], y = (double)b[n];
            sum[0] += x, sum[1] += y, sum[2] += x * x, sum[3] += y * y, sum[4] += x * y;
            number += 1.0;
        }
    }
    const double xx = sum[2] - sum[0] * sum[0] / number, yy = sum[3] - sum[1] * sum[1] / number;
    const double xy = sum[4] - sum[0] * sum[1] / number;
    *common = (size_t)number;
    return xx > 0.0 && yy > 0.0 ? xy / sqrt(xx * yy) : 0.0;
}

enum { CUBE = 48, AXES = 4 };
static const double no_overlap = -2.0; /* below any correlation */

/* Returns the correlation of the two images through a map. values, valid: one item a voxel of the fixed image, to work in. */
static double agreement(const struct volume *fixed, const struct volume *moving, const double map[3][4], float *values,
                        unsigned char *valid)
{
    size_t common = 0;
    resample_volume(moving, moving->data, map, fixed, values, valid);
    for (size_t n = 0; n < volume_voxels(fixed); ++n) {
        values[n] = valid[n] ? values[n] : NAN;
    }
    const double correlation = register_correlation(fixed->data, values, volume_voxels(fixed), &common);
    return (double)common >= register_min_voxels(fixed, moving) ? correlation : no_overlap;
}

/* Computes a candidate's map: 0 that of the world coordinates, 1 with the centres of mass laid on each other, then with rotations
 * too. Returns false where there is none of this number. */
static bool candidate(int number, const struct mass *fixed, const struct mass *moving, double map[3][4])
{
    double rotation[3][3];
    if (number == 0) {
        register_identity(map);
        return true;
    }
    if (number > CUBE) {
        axes_rotation(fixed, moving, number - 1 - CUBE, rotation);
    } else if (!cube_rotation(number - 1, rotation)) {
        return false;
    }
    map_about((const double(*)[3])rotation, fixed->center, moving->center, map);
    return true;
}

static int last_candidate(enum register_align align, enum register_start start)
{
    if (align == REGISTER_ALIGN_NONE || start == REGISTER_START_HEADERS) {
        return 0;
    }
    return align == REGISTER_ALIGN_TRANSLATION || start == REGISTER_START_CENTERS ? 1 : CUBE + AXES;
}

bool register_find_start(const struct volume *fixed, const struct volume *moving, enum register_align align,
                         enum register_start start, double map[3][4], bool *overlap)
{
    const enum register_align motion = align == REGISTER_ALIGN_AFFINE ? REGISTER_ALIGN_RIGID : align;
    int last = last_candidate(align, start);
    struct mass masses[2];
    double best = no_overlap;
    float *values = malloc(volume_voxels(fixed) * sizeof *values);
    unsigned char *valid = malloc(volume_voxels(fixed));
    bool good = values && valid;
    register_identity(map);
    if (good && last > 0 && !(find_mass(fixed, &masses[0]) && find_mass(moving, &masses[1]))) {
        last = 0;
    }
    for (int number = 0; good && number <= last; ++number) {
        double tried[3][4];
        if (!candidate(number, &masses[0], &masses[1], tried)) {
            continue;
        }
        good = align == REGISTER_ALIGN_NONE || register_affine(fixed, moving, motion, tried);
        const double correlation = good ? agreement(fixed, moving, (const double(*)[4])tried, values, valid) : no_overlap;
        if (correlation > best + (number > 0 ? clearly_more : 0.0)) {
            best = correlation;
            memcpy(map, tried, sizeof tried);
        }
    }
    *overlap = best > no_overlap;
    free(values);
    free(valid);
    return good;
}
