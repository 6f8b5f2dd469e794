/* sides.c - subjects of the other side of the body among label maps, which have patients' axes.
 *
 * Moments that are odd in x change their signs in a mirror. A subject whose moments lie far from the median of all, and nearer to it
 * with their signs changed, is the mirror image of what most subjects are. Near an even mix the median is that of neither side: there
 * each subject gets the sign with which all come to lie together. Shapes that are symmetric have the same moments on both sides. */
#include "atlas/atlas.h"

#include "base/vec3.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOMENTS = 6, FEWEST = 4, ROUNDS = 8, LONGEST_LIST = 400, ROOM_FOR_MORE = 20 };

static const double clearly = 1.5;    /* times as far from the median as in the mirror */
static const double unusual = 3.0;    /* times as far as the subject in the middle */
static const double one_sided = 0.02; /* least length of the median: symmetric shapes have less, by chance */
static const double two_sided = 0.04; /* the same with signs chosen, which lengthen the median of symmetric shapes */
static const double apart = 2.0;      /* least length of that median, in distances of the subject in the middle from it */

struct odd {
    double moments[MOMENTS];
};

/* A triangle's center and area. */
static double triangle_at(const struct shape_mesh *mesh, int t, double center[3])
{
    const int *corners = mesh->triangles + 3 * t;
    const float *a = mesh->positions + 3 * corners[0], *b = mesh->positions + 3 * corners[1], *c = mesh->positions + 3 * corners[2];
    for (int k = 0; k < 3; ++k) {
        center[k] = ((double)a[k] + (double)b[k] + (double)c[k]) / 3.0;
    }
    return vec3_triangle_area(a, b, c);
}

/* Computes the surface's moments up to order three that are odd in x, about its center and in units of its size. */
static struct odd odd_moments(const struct shape_mesh *mesh)
{
    struct odd odd = {{0.0}};
    double area = 0.0, middle[3] = {0.0, 0.0, 0.0}, square = 0.0, x[3];
    for (int t = 0; t < mesh->triangle_count; ++t) {
        const double weight = triangle_at(mesh, t, x);
        area += weight;
        for (int a = 0; a < 3; ++a) {
            middle[a] += weight * x[a];
            square += weight * x[a] * x[a];
        }
    }
    for (int a = 0; a < 3; ++a) {
        middle[a] /= area;
        square -= area * middle[a] * middle[a];
    }
    const double size = sqrt(square / area);
    for (int t = 0; t < mesh->triangle_count; ++t) {
        const double weight = triangle_at(mesh, t, x) / area;
        for (int a = 0; a < 3; ++a) {
            x[a] = (x[a] - middle[a]) / size;
        }
        const double rest[MOMENTS] = {x[1], x[2], x[0] * x[0], x[1] * x[1], x[2] * x[2], x[1] * x[2]};
        for (int m = 0; m < MOMENTS; ++m) {
            odd.moments[m] += weight * x[0] * rest[m];
        }
    }
    return odd;
}

static int compare_numbers(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, compare_numbers);
    return 0.5 * (values[(count - 1) / 2] + values[count / 2]);
}

static const struct odd none = {{0.0}}; /* of symmetric shapes */

static double distance(const struct odd *a, double sign, const struct odd *b)
{
    double sum = 0.0;
    for (int m = 0; m < MOMENTS; ++m) {
        const double d = sign * a->moments[m] - b->moments[m];
        sum += d * d;
    }
    return sqrt(sum);
}

/* Computes the medians of the moments, where `signs` are -1 for those of the mirror image; signs NULL: as they are. */
static struct odd middle_of(const struct odd *all, const double *signs, int count, double *values)
{
    struct odd middle;
    for (int m = 0; m < MOMENTS; ++m) {
        for (int s = 0; s < count; ++s) {
            values[s] = (signs ? signs[s] : 1.0) * all[s].moments[m];
        }
        middle.moments[m] = median(values, count);
    }
    return middle;
}

/* Returns the median of the distances from `middle`. */
static double spread(const struct odd *all, const double *signs, const struct odd *middle, int count, double *values)
{
    for (int s = 0; s < count; ++s) {
        values[s] = distance(&all[s], signs ? signs[s] : 1.0, middle);
    }
    return median(values, count);
}

/* Marks the subjects that are mirror images of most. */
static int mark_few(const struct odd *all, int count, double *values, bool *mirrored)
{
    const struct odd middle = middle_of(all, NULL, count, values);
    const double usual = spread(all, NULL, &middle, count, values), side = distance(&middle, 1.0, &none);
    int found = 0;
    for (int s = 0; s < count; ++s) {
        const double as_it_is = distance(&all[s], 1.0, &middle), in_mirror = distance(&all[s], -1.0, &middle);
        mirrored[s] = side > fmax(one_sided, usual) && as_it_is > clearly * in_mirror && as_it_is > unusual * usual;
        found += mirrored[s];
    }
    return found;
}

/* Gives each subject the sign with which it is nearer to the middle of all with theirs, beginning with the most one-sided subject. */
static struct odd choose_signs(const struct odd *all, int count, double *values, double *signs)
{
    struct odd middle = none;
    for (int s = 0; s < count; ++s) {
        middle = distance(&all[s], 1.0, &none) > distance(&middle, 1.0, &none) ? all[s] : middle;
    }
    for (int round = 0; round < ROUNDS; ++round) {
        for (int s = 0; s < count; ++s) {
            signs[s] = distance(&all[s], 1.0, &middle) <= distance(&all[s], -1.0, &middle) ? 1.0 : -1.0;
        }
        middle = middle_of(all, signs, count, values);
    }
    return middle;
}

/* Marks the fewer of two groups that are each other's mirror images. Near an even mix the median of all is that of neither. */
static int mark_group(const struct odd *all, int count, double *values, double *signs, bool *mirrored)
{
    const struct odd middle = choose_signs(all, count, values, signs);
    const double usual = spread(all, signs, &middle, count, values), side = distance(&middle, 1.0, &none);
    int plus = 0, found = 0;
    for (int s = 0; s < count; ++s) {
        plus += signs[s] > 0.0;
    }
    const double other = 2 * plus >= count ? -1.0 : 1.0;
    for (int s = 0; s < count; ++s) {
        const double as_it_is = distance(&all[s], -signs[s], &middle), in_mirror = distance(&all[s], signs[s], &middle);
        mirrored[s] = side > fmax(two_sided, apart * usual) && signs[s] == other && as_it_is > clearly * in_mirror
            && as_it_is > unusual * usual;
        found += mirrored[s];
    }
    return found;
}

/* Lists the marked subjects' names; where they are many, "and N more" is the end. */
static void list_names(const struct atlas_build *build, const bool *mirrored, int left, char list[LONGEST_LIST])
{
    size_t length = 0;
    list[0] = 0;
    for (int s = 0; s < build->settings.count && left > 0; ++s) {
        const char *name = build->settings.names[s], *between = length > 0 ? ", " : "";
        if (!mirrored[s]) {
            continue;
        }
        if (length + strlen(between) + strlen(name) + ROOM_FOR_MORE > LONGEST_LIST) {
            snprintf(list + length, LONGEST_LIST - length, length > 0 ? " and %d more" : "%d subjects", left);
            return;
        }
        length += (size_t)snprintf(list + length, LONGEST_LIST - length, "%s%s", between, name);
        --left;
    }
}

bool atlas_sides_agree(const struct atlas_build *build)
{
    const int count = build->settings.count;
    char list[LONGEST_LIST];
    bool mirrored[ATLAS_MAX_SUBJECTS];
    if (count < FEWEST || !build->subjects[0].oriented || build->settings.any_side) {
        return true;
    }
    struct odd *all = malloc((size_t)count * sizeof *all);
    double *values = malloc(2 * (size_t)count * sizeof *values);
    const bool good = all && values;
    int found = 0;
    for (int s = 0; good && s < count; ++s) {
        all[s] = odd_moments(&build->subjects[s].mesh);
    }
    if (good) {
        found = mark_few(all, count, values, mirrored);
        found = found > 0 ? found : mark_group(all, count, values, values + count, mirrored);
    }
    free(all);
    free(values);
    if (!good) {
        return atlas_no_memory();
    }
    list_names(build, mirrored, found, list);
    return found == 0
        || atlas_fail("mirrored, or of the other side of the body than the others: %s (%s--any-side takes all as they are)", list,
                      build->settings.folder ? "" : "mirror:FILE takes the mirror image of one, ");
}
