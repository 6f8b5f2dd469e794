#include "imaging/overlap.h"

static struct overlap finish_overlap(size_t a, size_t b, size_t both)
{
    struct overlap result = {a, b, both, 1.0, 1.0};
    if (a + b > 0) {
        result.dice = 2.0 * (double)both / (double)(a + b);
        result.jaccard = (double)both / (double)(a + b - both);
    }
    return result;
}

static bool has_label(float value, float label) { return label < 0.0f ? value != 0.0f : value == label; }

struct overlap overlap_labels(const float *a, const float *b, size_t count, float label)
{
    size_t in_a = 0, in_b = 0, both = 0;
    for (size_t i = 0; i < count; ++i) {
        const bool x = has_label(a[i], label), y = has_label(b[i], label);
        in_a += x;
        in_b += y;
        both += x && y;
    }
    return finish_overlap(in_a, in_b, both);
}

struct overlap overlap_masks(const uint8_t *a, const uint8_t *b, size_t count)
{
    size_t in_a = 0, in_b = 0, both = 0;
    for (size_t i = 0; i < count; ++i) {
        in_a += a[i] != 0;
        in_b += b[i] != 0;
        both += a[i] != 0 && b[i] != 0;
    }
    return finish_overlap(in_a, in_b, both);
}

double overlap_milliliters(size_t voxels, const float spacing[3])
{
    return (double)voxels * (double)spacing[0] * (double)spacing[1] * (double)spacing[2] / 1000.0;
}
