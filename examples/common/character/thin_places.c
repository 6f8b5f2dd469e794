#include "character/thin_places.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EDGE 1.2f /* voxels: edges and corners are at most this far from a ball that touches their sides */
#define SLACK 0.1f /* voxel: a ball fits where the depth is less than its radius by up to this, since voxels miss the middle */

/* Voxels lo..hi within `reach` of a place, and within the grid less its border. */
struct range {
    int lo[3], hi[3];
};

static struct range around(const int size[3], const float place[3], float reach)
{
    struct range r;
    for (int k = 0; k < 3; ++k) {
        r.lo[k] = (int)fmaxf(1.0f, ceilf(place[k] - reach));
        r.hi[k] = (int)fminf((float)size[k] - 2.0f, floorf(place[k] + reach));
    }
    return r;
}

static size_t voxel_at(const int size[3], int x, int y, int z)
{
    return ((size_t)z * (size_t)size[1] + (size_t)y) * (size_t)size[0] + (size_t)x;
}

static float distance_from(const float place[3], int x, int y, int z)
{
    const float d[3] = {(float)x - place[0], (float)y - place[1], (float)z - place[2]};
    return sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

static void place_of(const int size[3], size_t voxel, float place[3])
{
    const int at = (int)voxel;
    place[0] = (float)(at % size[0]);
    place[1] = (float)(at / size[0] % size[1]);
    place[2] = (float)(at / (size[0] * size[1]));
}

/* Marks what is within a ball of `radius` around a place. */
static void mark_ball(const int size[3], const float place[3], float radius, bool *marks)
{
    const struct range r = around(size, place, radius);
    for (int z = r.lo[2]; z <= r.hi[2]; ++z) {
        for (int y = r.lo[1]; y <= r.hi[1]; ++y) {
            for (int x = r.lo[0]; x <= r.hi[0]; ++x) {
                if (distance_from(place, x, y, z) <= radius) { marks[voxel_at(size, x, y, z)] = true; }
            }
        }
    }
}

/* Marks what is thick: in or near a ball of `radius` that is in the body. */
static void mark_thick(const int size[3], size_t count, const float *phi, float radius, bool *thick)
{
    for (size_t n = 0; n < count; ++n) {
        float place[3];
        if (phi[n] > SLACK - radius) { continue; }
        place_of(size, n, place);
        mark_ball(size, place, radius + EDGE, thick);
    }
}

/* Finds whether a voxel is one of the deepest around it, and in *middle the mean place of the voxels inside around it by their
 * depths: the middle of a thin limb. */
static bool find_middle(const int size[3], const float *phi, size_t voxel, float middle[3])
{
    float place[3], sum = 0.0f;
    place_of(size, voxel, place);
    const struct range r = around(size, place, 1.0f);
    memset(middle, 0, 3 * sizeof *middle);
    for (int z = r.lo[2]; z <= r.hi[2]; ++z) {
        for (int y = r.lo[1]; y <= r.hi[1]; ++y) {
            for (int x = r.lo[0]; x <= r.hi[0]; ++x) {
                const float here = phi[voxel_at(size, x, y, z)], depth = here < 0.0f ? -here : 0.0f;
                if (here < phi[voxel] - 0.5f) { return false; }
                middle[0] += depth * (float)x;
                middle[1] += depth * (float)y;
                middle[2] += depth * (float)z;
                sum += depth;
            }
        }
    }
    for (int k = 0; sum > 0.0f && k < 3; ++k) { middle[k] /= sum; }
    return sum > 0.0f;
}

/* Unites a level set with a ball. */
static void add_ball(const int size[3], const float place[3], float radius, float *phi)
{
    const struct range r = around(size, place, radius + 1.0f);
    for (int z = r.lo[2]; z <= r.hi[2]; ++z) {
        for (int y = r.lo[1]; y <= r.hi[1]; ++y) {
            for (int x = r.lo[0]; x <= r.hi[0]; ++x) {
                float *here = &phi[voxel_at(size, x, y, z)];
                *here = fminf(*here, distance_from(place, x, y, z) - radius);
            }
        }
    }
}

int thin_places_thicken(const struct solid_grid *grid, float *phi, float thickness)
{
    const int *size = grid->size;
    const size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    const float radius = 0.5f * thickness;
    bool *thick = calloc(count, sizeof *thick);
    float *before = malloc(count * sizeof *before), middle[3];
    int added = thick && before ? 0 : -1;
    if (added == 0) {
        memcpy(before, phi, count * sizeof *phi);
        mark_thick(size, count, before, radius, thick);
        for (size_t n = 0; n < count; ++n) {
            if (before[n] < 0.0f && !thick[n] && find_middle(size, before, n, middle)) { add_ball(size, middle, radius, phi); }
        }
        for (size_t n = 0; n < count; ++n) { added += phi[n] < 0.0f && before[n] >= 0.0f; }
    }
    free(thick);
    free(before);
    return added;
}
