#include "surface/animation.h"

#include "base/affine.h"

#include <stdlib.h>
#include <string.h>

static void free_keys(struct keys *keys)
{
    free(keys->times);
    free(keys->values);
}

void animation_free(struct animation *animation)
{
    for (int c = 0; c < animation->channel_count; ++c) {
        free_keys(&animation->channels[c].translation);
        free_keys(&animation->channels[c].rotation);
        free_keys(&animation->channels[c].scale);
    }
    free(animation->channels);
    memset(animation, 0, sizeof *animation);
}

int keys_width(const struct keys *keys, int width) { return keys->interpolation == KEYS_CUBIC ? 3 * width : width; }

double *keys_value(const struct keys *keys, int width, int k)
{
    return keys->values + (size_t)keys_width(keys, width) * (size_t)k + (keys->interpolation == KEYS_CUBIC ? width : 0);
}

/* Finds the last key that is not after `time`, and the fraction of the way to the next key. */
static int find_key(const struct keys *keys, double time, double *fraction)
{
    int low = 0, high = keys->count - 1;
    *fraction = 0.0;
    while (low < high) {
        const int middle = (low + high + 1) / 2;
        if (keys->times[middle] <= time) {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    if (low + 1 < keys->count && time > keys->times[low]) {
        *fraction = (time - keys->times[low]) / (keys->times[low + 1] - keys->times[low]);
    }
    return low;
}

/* Cubic Hermite spline between two keys whose values are a and b; tangents are a second's. */
static void sample_cubic(const double *a, const double *b, int width, double seconds, double t, double *out)
{
    const double *leaves = a + width, *arrives = b - width, t2 = t * t, t3 = t2 * t;
    for (int i = 0; i < width; ++i) {
        out[i] = (2.0 * t3 - 3.0 * t2 + 1.0) * a[i] + seconds * (t3 - 2.0 * t2 + t) * leaves[i]
               + (3.0 * t2 - 2.0 * t3) * b[i] + seconds * (t3 - t2) * arrives[i];
    }
}

void keys_sample(const struct keys *keys, int width, double time, double *out)
{
    double t;
    if (keys->count == 0) {
        return;
    }
    const int k = find_key(keys, time, &t);
    const double *a = keys_value(keys, width, k);
    const bool between = t > 0.0 && keys->interpolation != KEYS_STEP;
    const double *b = keys_value(keys, width, between ? k + 1 : k);
    if (keys->interpolation == KEYS_CUBIC && between) {
        sample_cubic(a, b, width, keys->times[k + 1] - keys->times[k], t, out);
        if (width == 4) {
            quaternion_slerp(out, out, 0.0, out); /* of length 1 */
        }
    } else if (width == 4) {
        quaternion_slerp(a, b, between ? t : 0.0, out);
    } else {
        for (int i = 0; i < width; ++i) {
            out[i] = a[i] + (between ? t : 0.0) * (b[i] - a[i]);
        }
    }
}
