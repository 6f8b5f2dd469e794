/* sides.c - subjects of the other side of the body among label maps, which have patients' axes.
 *
 * Moments that are odd in x change their signs in a mirror. A subject whose moments lie far from the median of all, and nearer to it
 * with their signs changed, is the mirror image of what most subjects are. Shapes that are symmetric tell nothing, and are not asked. */
#include "atlas/atlas.h"

#include "base/vec3.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOMENTS = 6, FEWEST = 4, LONGEST_LIST = 400 };

static const double clearly = 1.5;    /* times as far from the median as in the mirror */
static const double unusual = 3.0;    /* times as far as the subject in the middle */
static const double one_sided = 0.02; /* least length of the median: symmetric shapes have less, by chance */

struct odd {
    double moments[MOMENTS];
};

/* A triangle's center and area. */
static double triangle_at(const struct shape_mesh *mesh, int t, double center[3])
{
    const int *corners = mesh->triangles + 3 * t;
    const float *a = mesh->positions + 3 * corners[0], *b = mesh->positions + 3 * corners[1], *c = mesh->positions + 3 * corners[2];
    float u[3], v[3], normal[3];
    vec3_sub(b, a, u);
    vec3_sub(c, a, v);
    vec3_cross(u, v, normal);
    for (int k = 0; k < 3; ++k) {
        center[k] = ((double)a[k] + (double)b[k] + (double)c[k]) / 3.0;
    }
    return 0.5 * (double)vec3_length(normal);
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

static double distance(const struct odd *a, double sign, const struct odd *b)
{
    double sum = 0.0;
    for (int m = 0; m < MOMENTS; ++m) {
        const double d = sign * a->moments[m] - b->moments[m];
        sum += d * d;
    }
    return sqrt(sum);
}

/* Adds the names of mirrored subjects to a list. */
static void list_mirrored(const struct atlas_build *build, const struct odd *all, double *values, char list[LONGEST_LIST])
{
    const int count = build->settings.count;
    struct odd middle;
    for (int m = 0; m < MOMENTS; ++m) {
        for (int s = 0; s < count; ++s) {
            values[s] = all[s].moments[m];
        }
        middle.moments[m] = median(values, count);
    }
    for (int s = 0; s < count; ++s) {
        values[s] = distance(&all[s], 1.0, &middle);
    }
    const struct odd none = {{0.0}};
    const double usual = median(values, count), side = distance(&middle, 1.0, &none);
    for (int s = 0; s < count && side > fmax(one_sided, usual); ++s) {
        const double as_it_is = distance(&all[s], 1.0, &middle), in_mirror = distance(&all[s], -1.0, &middle);
        if (as_it_is > clearly * in_mirror && as_it_is > unusual * usual) {
            const size_t length = strlen(list);
            snprintf(list + length, LONGEST_LIST - length, "%s%s", length > 0 ? ", " : "", build->settings.names[s]);
        }
    }
}

bool atlas_sides_agree(const struct atlas_build *build)
{
    const int count = build->settings.count;
    char list[LONGEST_LIST] = "";
    if (count < FEWEST || !build->subjects[0].oriented || build->settings.any_side) {
        return true;
    }
    struct odd *all = malloc((size_t)count * sizeof *all);
    double *values = malloc((size_t)count * sizeof *values);
    const bool good = all && values;
    for (int s = 0; good && s < count; ++s) {
        all[s] = odd_moments(&build->subjects[s].mesh);
    }
    if (good) {
        list_mirrored(build, all, values, list);
    }
    free(all);
    free(values);
    return (good || atlas_no_memory())
        && (!list[0] || atlas_fail("mirrored, or of the other side of the body than most subjects: %s (mirror:FILE takes its mirror image, "
                                   "--any-side takes all as they are)", list));
}
