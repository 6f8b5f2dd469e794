/* register_start.c - where the affine map begins: at the files' world coordinates, or with the centres of mass and the principal
 * axes laid on each other. Levenberg-Marquardt finds the nearest minimum only, some centimetres and 30 degrees away. */
#include "registration/register.h"

#include "imaging/resample.h"

#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double min_overlap = 0.3;  /* share of the smaller image that must lie inside the other one */
static const double mirror_share = 0.6; /* of the variance that is left unexplained, for an image to count as mirrored */
static const double mirror_gain = 0.01;   /* and what has to be gained at least: heads are nearly symmetric */
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

/* Returns the mean value on the faces of the image's box: what is around the body, dark or bright. */
static double value_around(const struct volume *image)
{
    double sum = 0.0, number = 0.0;
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        int place[3];
        bool face = false;
        volume_place(image->dims, n, place);
        for (int a = 0; a < 3; ++a) {
            face = face || place[a] == 0 || place[a] == image->dims[a] - 1;
        }
        if (face && isfinite(image->data[n])) {
            sum += (double)image->data[n];
            number += 1.0;
        }
    }
    return number > 0.0 ? sum / number : 0.0;
}

/* Returns the mass of a voxel: its value, or in an image whose surroundings are bright what it lacks of their value. */
static double mass_at(const struct volume *image, size_t n, double around)
{
    const double value = (double)image->data[n];
    return isfinite(value) ? fmax(0.0, around > 0.5 ? around - value : value) : 0.0;
}

static bool find_mass(const struct volume *image, struct mass *mass)
{
    const double around = value_around(image);
    double sum = 0.0, first[3] = {0.0, 0.0, 0.0}, second[9] = {0.0}, lengths[3], x[3];
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        const double weight = mass_at(image, n, around);
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
        const double weight = mass_at(image, n, around);
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

/* Returns the volume of the voxels that have data, mm^3. */
static double known_volume(const struct volume *image)
{
    size_t known = 0;
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        known += isfinite(image->data[n]) != 0;
    }
    return box(image) * (double)known / (double)volume_voxels(image);
}

double register_min_voxels(const struct volume *fixed, const struct volume *moving)
{
    const double f = known_volume(fixed), m = known_volume(moving);
    return f > 0.0 ? min_overlap * (double)volume_voxels(fixed) * fmin(f, m) / box(fixed) : INFINITY;
}

void register_through(const struct volume *moving, const double map[3][4], const struct volume *fixed, float *values)
{
    float m[3][4];
    resample_map(fixed, map, moving, m);
    size_t n = 0;
    for (int k = 0; k < fixed->dims[2]; ++k) {
        for (int j = 0; j < fixed->dims[1]; ++j) {
            for (int i = 0; i < fixed->dims[0]; ++i, ++n) {
                float x[3];
                resample_place((const float(*)[4])m, i, j, k, x);
                values[n] = resample_in_box(moving->dims, x) ? resample_at(moving->dims, moving->data, x) : NAN;
            }
        }
    }
}

enum { CUBE = 48, AXES = 4 };
static const double no_overlap = -2.0; /* below any correlation */

/* Returns how much of the two images goes together through a map: the root of the share of variance that the relation explains,
 * for a line the size of the correlation. values: one item a voxel of the fixed image, to work in. */
static double agreement(const struct volume *fixed, const struct volume *moving, const double map[3][4],
                        const struct relation *relation, float *values)
{
    size_t common = 0;
    register_through(moving, map, fixed, values);
    relation_correlation(fixed->data, values, volume_voxels(fixed), &common);
    return (double)common >= register_min_voxels(fixed, moving) ? sqrt(relation->explained) : no_overlap;
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

/* Tries the mirror images, which no map of a body to itself can reach. motion: REGISTER_ALIGN_NONE where the images lie as they are; then
 * both are moved, here alone. */
static bool look_in_mirrors(const struct volume *fixed, const struct volume *moving, const struct mass masses[2],
                            enum register_align motion, double best, float *values, struct registration *result)
{
    bool good = true;
    if (motion == REGISTER_ALIGN_NONE) {
        double tried[3][4];
        struct relation found = {.kind = RELATION_LINE};
        motion = REGISTER_ALIGN_RIGID;
        register_identity(tried);
        good = register_affine_related(fixed, moving, motion, tried, &found);
        best = good ? fmax(best, agreement(fixed, moving, (const double(*)[4])tried, &found, values)) : best;
    }
    result->mirrored = 0;
    result->as_it_is = result->in_mirror = best;
    for (int axis = 0; good && axis < 3; ++axis) {
        double mirror[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}, tried[3][4];
        struct relation found = {.kind = RELATION_LINE};
        mirror[axis][axis] = -1.0;
        map_about((const double(*)[3])mirror, masses[0].center, masses[1].center, tried);
        good = register_affine_related(fixed, moving, motion, tried, &found);
        const double agrees = good ? agreement(fixed, moving, (const double(*)[4])tried, &found, values) : no_overlap;
        if (agrees > result->in_mirror + mirror_gain && 1.0 - agrees * agrees < mirror_share * (1.0 - best * best)) {
            result->mirrored = 1 + axis;
            result->in_mirror = agrees;
        }
    }
    return good;
}

bool register_find_start(const struct volume *fixed, const struct volume *moving, const struct register_settings *settings,
                         struct registration *result, bool *overlap)
{
    const enum register_align align = settings->align;
    const enum register_align motion = align == REGISTER_ALIGN_AFFINE ? REGISTER_ALIGN_RIGID : align;
    int last = last_candidate(align, settings->start);
    struct mass masses[2];
    double best = no_overlap;
    float *values = malloc(volume_voxels(fixed) * sizeof *values);
    bool good = values != NULL;
    register_identity(result->affine);
    const bool massive = good && find_mass(fixed, &masses[0]) && find_mass(moving, &masses[1]);
    last = massive ? last : 0;
    for (int number = 0; good && number <= last; ++number) {
        double tried[3][4];
        struct relation found = {.kind = RELATION_LINE};
        if (!candidate(number, &masses[0], &masses[1], tried)) {
            continue;
        }
        good = register_affine_related(fixed, moving, motion, tried, &found);
        const double agrees = good ? agreement(fixed, moving, (const double(*)[4])tried, &found, values) : no_overlap;
        if (agrees > best + (number > 0 ? clearly_more : 0.0)) {
            best = agrees;
            result->relation = found;
            memcpy(result->affine, tried, sizeof tried);
        }
        result->headers_apart = number == 0 ? good && !(agrees > no_overlap) : result->headers_apart;
    }
    *overlap = best > no_overlap;
    if (good && *overlap && massive && settings->similarity == REGISTER_AUTO) {
        good = look_in_mirrors(fixed, moving, masses, motion, best, values, result);
    }
    free(values);
    return good;
}
