#include "segment_image.h"

#include <math.h>

enum { OTSU_CLASSES = 1024, PERCENTILE_CLASSES = 4096 };

/* The class of a value among `classes` equal ones between low and high. */
static int class_of(float value, double low, double high, int classes)
{
    const double place = ((double)value - low) / (high - low) * classes;
    return place <= 0 ? 0 : place >= classes - 1 ? classes - 1 : (int)place;
}

float segment_percentile(const struct volume *image, double share)
{
    const double low = (double)image->minimum, high = (double)image->maximum;
    const size_t total = volume_voxels(image);
    size_t counts[PERCENTILE_CLASSES] = {0};
    double seen = 0;
    if (!(high > low)) return image->minimum;
    for (size_t n = 0; n < total; n++) counts[class_of(image->data[n], low, high, PERCENTILE_CLASSES)]++;
    for (int c = 0; c < PERCENTILE_CLASSES; c++) {
        seen += (double)counts[c];
        if (seen >= share * (double)total) return (float)(low + (high - low) * (c + 1) / PERCENTILE_CLASSES);
    }
    return image->maximum;
}

float segment_otsu(const struct volume *image)
{
    double low = (double)segment_percentile(image, 0.001), high = (double)segment_percentile(image, 0.999);
    const size_t total = volume_voxels(image);
    size_t counts[OTSU_CLASSES] = {0};
    double sum = 0, below = 0, sum_below = 0, best = -1;
    int first = 0, last = 0;
    if (!(high > low)) { low = (double)image->minimum; high = (double)image->maximum; }
    if (!(high > low)) return image->minimum;
    for (size_t n = 0; n < total; n++) counts[class_of(image->data[n], low, high, OTSU_CLASSES)]++;
    for (int c = 0; c < OTSU_CLASSES; c++) sum += (double)c * (double)counts[c];
    for (int c = 0; c + 1 < OTSU_CLASSES; c++) {
        below += (double)counts[c];
        sum_below += (double)c * (double)counts[c];
        const double above = (double)total - below;
        if (!(below > 0) || !(above > 0)) continue;
        const double difference = sum_below / below - (sum - sum_below) / above;
        const double between = below * above * difference * difference;
        if (between > best) {
            best = between;
            first = c;
        }
        if (between >= best) last = c; /* equal over empty classes: the middle of them */
    }
    return (float)(low + (high - low) * (0.5 * (first + last) + 1) / OTSU_CLASSES);
}

void segment_pressure(const struct volume *image, float low, float high, float ramp, float *pressure)
{
    const size_t total = volume_voxels(image);
    for (size_t n = 0; n < total; n++) {
        const float inside = fminf(image->data[n] - low, high - image->data[n]) / ramp;
        pressure[n] = fmaxf(-1, fminf(1, inside));
    }
}

size_t segment_mask(const struct volume *labels, const int *wanted, int count, uint8_t *mask)
{
    const size_t total = volume_voxels(labels);
    size_t set = 0;
    for (size_t n = 0; n < total; n++) {
        const long value = lroundf(fmaxf(-1e9f, fminf(1e9f, labels->data[n])));
        bool inside = count == 0 && value != 0;
        for (int c = 0; c < count; c++) inside = inside || value == wanted[c];
        mask[n] = inside;
        set += inside;
    }
    return set;
}

void segment_distance(const struct volume *image, const float *phi, float *distance)
{
    const int *dims = image->dims;
    const size_t strides[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]};
    const float smallest = fminf(image->spacing[0], fminf(image->spacing[1], image->spacing[2]));
    const float largest = fmaxf(image->spacing[0], fmaxf(image->spacing[1], image->spacing[2]));
    const bool uniform = largest - smallest <= 1e-4f * largest;
    for (int k = 0; k < dims[2]; k++)
        for (int j = 0; j < dims[1]; j++)
            for (int i = 0; i < dims[0]; i++) {
                const int place[3] = {i, j, k};
                const size_t n = (size_t)i * strides[0] + (size_t)j * strides[1] + (size_t)k * strides[2];
                float voxels = 0, world = 0; /* squared lengths of the gradient */
                for (int a = 0; a < 3 && !uniform; a++) {
                    const size_t up = place[a] + 1 < dims[a] ? strides[a] : 0, down = place[a] > 0 ? strides[a] : 0;
                    const float slope = (phi[n + up] - phi[n - down]) / (up && down ? 2.0f : 1.0f);
                    voxels += slope * slope;
                    world += slope * slope / (image->spacing[a] * image->spacing[a]);
                }
                /* far away phi is constant and has no direction: the smallest spacing never says too much */
                distance[n] = phi[n] * (voxels > 0.01f ? sqrtf(voxels / world) : smallest);
            }
}

double segment_motion(const float *before, const float *after, size_t count)
{
    double sum = 0, near = 0;
    for (size_t n = 0; n < count; n++)
        if (fabsf(before[n]) < 1 || fabsf(after[n]) < 1) {
            sum += fabs((double)after[n] - (double)before[n]);
            near += 1;
        }
    return near > 0 ? sum / near : 0;
}
