#include "imaging/segment_image.h"

#include "base/scalar.h"
#include "base/threads.h"
#include "imaging/parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { OTSU_CLASSES = 1024, PERCENTILE_CLASSES = 4096 };

/* ---- intensities ---- */

/* Convolves `count` rows of `width` values, whose starts are `stride` apart, across the rows; beyond the first and the last row
 * values are constant. copy: room for count + 2 half_width rows. */
static void blur_rows(float *rows, int count, size_t width, size_t stride, const float *kernel, int half_width, float *copy)
{
    const float *middle = copy + (size_t)half_width * width;
    for (int i = -half_width; i < count + half_width; ++i) {
        const size_t row = (size_t)(i < 0 ? 0 : i < count ? i : count - 1);
        memcpy(copy + (size_t)(i + half_width) * width, rows + row * stride, width * sizeof *copy);
    }
    const size_t together = stride == width ? (size_t)count : 1; /* rows that are one run of memory */
    for (size_t i = 0; i < (size_t)count; i += together) {
        float *sum = rows + i * stride;
        const float *own = middle + i * width;
        for (size_t n = 0; n < together * width; ++n) {
            sum[n] = kernel[0] * own[n];
        }
        for (int d = 1; d <= half_width; ++d) {
            const float *before = own - (size_t)d * width, *after = own + (size_t)d * width;
            for (size_t n = 0; n < together * width; ++n) {
                sum[n] += kernel[d] * (before[n] + after[n]);
            }
        }
    }
}

/* Computes half a Gaussian kernel of 3 standard deviations (in voxels): half_width + 1 weights. */
static void gaussian(float deviation, int half_width, float *kernel)
{
    float sum = 0.0f;
    for (int d = 0; d <= half_width; ++d) {
        kernel[d] = expf(-0.5f * (float)(d * d) / (deviation * deviation));
        sum += d > 0 ? 2.0f * kernel[d] : kernel[d];
    }
    for (int d = 0; d <= half_width; ++d) {
        kernel[d] /= sum;
    }
}

struct blur_loop {
    const struct volume *image;
    float *values;
    int a;
    const size_t *widths;
    const size_t *strides;
    const size_t *steps;
    const float *kernel;
    int half_width;
    size_t room;
    bool *good;
};

static void run_blur_loop(void *arg, int begin, int end)
{
    const struct blur_loop *loop = arg;
    const struct volume *image = loop->image;
    float *values = loop->values;
    const int a = loop->a;
    const size_t *widths = loop->widths;
    const size_t *strides = loop->strides;
    const size_t *steps = loop->steps;
    const float *kernel = loop->kernel;
    const int half_width = loop->half_width;
    const size_t room = loop->room;
    bool good = true;
    for (int p = begin; p < end; ++p) {
        float *copy = good ? malloc(room * sizeof *copy) : NULL;
        if (copy) {
            blur_rows(values + (size_t)p * steps[a], image->dims[a], widths[a], strides[a], kernel, half_width, copy);
        }
        good = good && copy != NULL;
        free(copy);
    }
    threads_lock();
    *loop->good = *loop->good && good;
    threads_unlock();
}

bool segment_blur(const struct volume *image, float size, float *values)
{
    const size_t line = (size_t)image->dims[0], slice = line * (size_t)image->dims[1];
    const size_t widths[3] = {1, line, line}, strides[3] = {1, line, slice}, steps[3] = {line, slice, line};
    const int sets[3] = {image->dims[1] * image->dims[2], image->dims[2], image->dims[1]}; /* of rows, `steps` apart */
    bool good = true;
    for (int a = 0; a < 3 && good; ++a) {
        const float variance = 0.25f * (size * size / (image->spacing[a] * image->spacing[a]) - 1.0f);
        if (!(variance > 0.01f)) {
            continue;
        }
        const int half_width = (int)ceilf(3.0f * sqrtf(variance));
        const size_t room = (size_t)(image->dims[a] + 2 * half_width) * widths[a];
        float *kernel = malloc((size_t)(half_width + 1) * sizeof *kernel);
        good = kernel != NULL;
        if (good) {
            gaussian(sqrtf(variance), half_width, kernel);
        }
        struct blur_loop loop = {image, values, a, widths, strides, steps, kernel, half_width, room, &good};
        threads_for(good ? sets[a] : 0, 16, run_blur_loop, &loop);
        free(kernel);
    }
    return good;
}

/* Returns the class of a value among `classes` equal classes between low and high. */
static int class_of(float value, double low, double high, int classes)
{
    const double place = ((double)value - low) / (high - low) * classes;
    return place <= 0 ? 0 : place >= classes - 1 ? classes - 1 : (int)place;
}

static const double crowded = 0.99; /* share of the voxels in one class from which on the classes are too wide */

/* Narrows low..high to the values of one class. */
static void narrow(const struct volume *image, int chosen, double *low, double *high)
{
    double least = *high, most = *low;
    for (size_t n = 0; n < volume_voxels(image); n++) {
        const double value = (double)image->data[n];
        if (!(value >= *low && value <= *high) || class_of(image->data[n], *low, *high, PERCENTILE_CLASSES) != chosen) continue;
        least = fmin(least, value);
        most = fmax(most, value);
    }
    *low = least;
    *high = most;
}

float segment_percentile(const struct volume *image, double share)
{
    double low = (double)image->minimum, high = (double)image->maximum;
    while (high > low) {
        size_t counts[PERCENTILE_CLASSES] = {0}, total = 0;
        double below = 0;
        int c = 0;
        for (size_t n = 0; n < volume_voxels(image); n++) {
            if (isfinite(image->data[n])) {
                counts[class_of(image->data[n], low, high, PERCENTILE_CLASSES)]++;
                total++;
            }
        }
        counts[0] -= image->replaced; /* these voxels have the minimum */
        total -= image->replaced;
        const double wanted = share * (double)total;
        while (c < PERCENTILE_CLASSES - 1 && below + (double)counts[c] < wanted) below += (double)counts[c++];
        if ((double)counts[c] <= crowded * (double)total) return (float)(low + (high - low) * (c + 1) / PERCENTILE_CLASSES);
        narrow(image, c, &low, &high); /* a few voxels far away have made one class of all others */
    }
    return (float)low;
}

float segment_otsu(const struct volume *image)
{
    double low = (double)segment_percentile(image, 0.001), high = (double)segment_percentile(image, 0.999);
    const size_t total = volume_voxels(image) - image->replaced;
    size_t counts[OTSU_CLASSES] = {0};
    double sum = 0, below = 0, sum_below = 0, best = -1;
    int first = 0, last = 0;
    if (!(high > low)) { low = (double)image->minimum; high = (double)image->maximum; }
    if (!(high > low)) return image->minimum;
    for (size_t n = 0; n < volume_voxels(image); n++) counts[class_of(image->data[n], low, high, OTSU_CLASSES)]++;
    counts[0] -= image->replaced; /* these voxels have the minimum */
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
        if (between >= best) last = c; /* equal over empty classes: take their middle */
    }
    return (float)(low + (high - low) * (0.5 * (first + last) + 1) / OTSU_CLASSES);
}

static size_t voxel_index(const int dims[3], const int place[3])
{
    return (size_t)place[0] + (size_t)dims[0] * ((size_t)place[1] + (size_t)dims[1] * (size_t)place[2]);
}

/* Returns the change of the intensity over `size` mm at a voxel, by central differences. */
static float change(const struct volume *image, const float *values, const int place[3], float size)
{
    const size_t strides[3] = {1, (size_t)image->dims[0], (size_t)image->dims[0] * (size_t)image->dims[1]};
    const size_t at = voxel_index(image->dims, place);
    float sum = 0.0f;
    for (int a = 0; a < 3; ++a) {
        const bool up = place[a] + 1 < image->dims[a], down = place[a] > 0;
        const float length = image->spacing[a] * (up && down ? 2.0f : 1.0f);
        const float slope = (values[up ? at + strides[a] : at] - values[down ? at - strides[a] : at]) / length;
        sum += slope * slope;
    }
    return size * sqrtf(sum);
}

/* Returns the distance in mm from the face of the image's box, negative inside. */
static float box_distance(const struct volume *image, const int place[3])
{
    float distance = -INFINITY;
    for (int a = 0; a < 3; ++a) {
        const float half = 0.5f * (float)image->dims[a], from_middle = fabsf((float)place[a] + 0.5f - half);
        distance = scalar_max(distance, image->spacing[a] * (from_middle - half));
    }
    return distance;
}

struct pressure_loop {
    const struct volume *image;
    const float *values;
    float low;
    float high;
    float ramp;
    float size;
    const struct volume *padded;
    int margin;
};

static void run_pressure_loop(void *arg, int begin, int end)
{
    const struct pressure_loop *loop = arg;
    const struct volume *image = loop->image;
    const float *values = loop->values;
    const float low = loop->low;
    const float high = loop->high;
    const float ramp = loop->ramp;
    const float size = loop->size;
    const struct volume *padded = loop->padded;
    const int margin = loop->margin;
    for (int k = begin - margin; k < end - margin; ++k) {
        float *pressure = padded->data + (size_t)(k + margin) * (size_t)padded->dims[0] * (size_t)padded->dims[1];
        for (int j = -margin; j < image->dims[1] + margin; ++j) {
            for (int i = -margin; i < image->dims[0] + margin; ++i, ++pressure) {
                const int place[3] = {i, j, k};
                const float border = -box_distance(image, place) / size;
                *pressure = scalar_max(-1.0f, border);
                if (border > 0.0f) {
                    const float value = values[voxel_index(image->dims, place)];
                    const float inside = scalar_min(value - low, high - value) / scalar_max(ramp, change(image, values, place, size));
                    *pressure = scalar_max(-1.0f, scalar_min(scalar_min(1.0f, inside), border));
                }
            }
        }
    }
}

void segment_pressure(const struct volume *image, const float *values, float low, float high, float ramp, float size,
                      const struct volume *padded)
{
    const int margin = (padded->dims[0] - image->dims[0]) / 2;
    struct pressure_loop loop = {image, values, low, high, ramp, size, padded, margin};
    threads_for(image->dims[2] + 2 * margin, 1, run_pressure_loop, &loop);
}

struct combine_loop {
    const struct volume *image;
    const struct segment_push *push;
    const struct volume *padded;
    int margin;
    float contrast;
};

static void run_combine_loop(void *arg, int begin, int end)
{
    const struct combine_loop *loop = arg;
    const struct volume *image = loop->image;
    const struct segment_push *push = loop->push;
    const struct volume *padded = loop->padded;
    const int margin = loop->margin;
    const float contrast = loop->contrast;
    for (int k = begin - margin; k < end - margin; ++k) {
        size_t n = (size_t)(k + margin) * (size_t)padded->dims[0] * (size_t)padded->dims[1];
        for (int j = -margin; j < image->dims[1] + margin; ++j) {
            for (int i = -margin; i < image->dims[0] + margin; ++i, ++n) {
                const int place[3] = {i, j, k};
                const float border = -box_distance(image, place) / push->size;
                float sum = push->pressure_weight * push->pressure[n];
                if (border > 0.0f) {
                    const size_t at = voxel_index(image->dims, place);
                    if (push->region_weight > 0.0f && contrast != 0.0f) {
                        /* Chan and Vese: ((u - c2)^2 - (u - c1)^2) / (c1 - c2)^2, which is linear in u */
                        const float region = (2.0f * push->image[at] - push->inside - push->outside) / contrast;
                        sum += push->region_weight * fmaxf(-1.0f, fminf(1.0f, region));
                    }
                    if (push->edge_weight > 0.0f) { /* Caselles: 1 / (1 + (|grad u| / K)^2) */
                        const float steep = change(image, push->image, place, push->size) / push->ramp;
                        sum *= 1.0f - push->edge_weight + push->edge_weight / (1.0f + steep * steep);
                    }
                }
                if (push->away) { /* beyond `stay` from the start only push back */
                    sum = fminf(sum, (push->stay - push->away[n]) / push->size);
                    sum = fmaxf(sum, (-push->stay - push->away[n]) / push->size);
                }
                padded->data[n] = scalar_max(-1.0f, scalar_min(scalar_min(1.0f, sum), border));
            }
        }
    }
}

void segment_combine(const struct volume *image, const struct segment_push *push, const struct volume *padded)
{
    const int margin = (padded->dims[0] - image->dims[0]) / 2;
    const float contrast = push->inside - push->outside;
    struct combine_loop loop = {image, push, padded, margin, contrast};
    threads_for(image->dims[2] + 2 * margin, 1, run_combine_loop, &loop);
}

/* Returns the label of a voxel; of values below 0, which are no labels, 2^32 or more. */
static uint64_t label_of(const struct volume *labels, size_t n)
{
    return labels->ids ? labels->ids[n] : (uint64_t)llroundf(fmaxf(-1e9f, fminf(1e9f, labels->data[n])));
}

size_t segment_mask(const struct volume *labels, const uint32_t *wanted, int count, uint8_t *mask)
{
    const size_t total = volume_voxels(labels);
    size_t set = 0;
    for (size_t n = 0; n < total; n++) {
        const uint64_t value = label_of(labels, n);
        bool inside = count == 0 && value != 0;
        for (int c = 0; c < count; c++) inside = inside || value == wanted[c];
        mask[n] = inside;
        set += inside;
    }
    return set;
}

/* ---- connected components ---- */

static void reverse(float *phi, const struct parts_run *run)
{
    for (int n = run->first; n < run->first + run->count; ++n) {
        phi[n] = -phi[n];
    }
}

static void reverse_all_but(float *phi, const struct parts *parts, int root)
{
    for (int r = 0; r < parts->count; ++r) {
        if (parts->runs[r].root != root) {
            reverse(phi, &parts->runs[r]);
        }
    }
}

bool segment_keep_largest(const int dims[3], float *phi)
{
    struct parts below, above;
    memset(&above, 0, sizeof above);
    const bool good = parts_find(dims, phi, true, &below) && parts_find(dims, phi, false, &above);
    if (good) { /* both are known before either changes */
        reverse_all_but(phi, &below, parts_largest(&below));
        reverse_all_but(phi, &above, parts_largest(&above));
    }
    parts_free(&below);
    parts_free(&above);
    return good;
}

bool segment_remove_parts(const int dims[3], float *phi, size_t least, bool largest, struct segment_parts *left)
{
    struct parts parts;
    memset(left, 0, sizeof *left);
    if (!parts_find(dims, phi, true, &parts)) {
        return false;
    }
    const int best = parts_largest(&parts);
    for (int r = 0; r < parts.count; ++r) {
        const int root = parts.runs[r].root;
        const size_t voxels = (size_t)parts.runs[root].voxels;
        const bool keep = voxels >= least && (!largest || root == best);
        if (!keep) {
            reverse(phi, &parts.runs[r]);
        }
        if (r == root) {
            left->kept += keep;
            left->removed += !keep;
            left->voxels += keep ? voxels : 0;
        }
    }
    parts_free(&parts);
    return true;
}

/* Returns true if the flag is set at a voxel or one of its face neighbors. */
static bool is_set_around(const int dims[3], const uint8_t *flags, const int place[3])
{
    const size_t strides[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]};
    const size_t at = voxel_index(dims, place);
    bool set = flags[at] != 0;
    for (int a = 0; a < 3; ++a) {
        set = set || (place[a] > 0 && flags[at - strides[a]]) || (place[a] + 1 < dims[a] && flags[at + strides[a]]);
    }
    return set;
}

static bool is_on_edge(const int dims[3], const int place[3])
{
    int faces = 0;
    for (int a = 0; a < 3; ++a) {
        faces += place[a] == 0 || place[a] == dims[a] - 1;
    }
    return faces >= 2;
}

/* Returns true if a voxel of the run, on a grid with a margin around the box, lies on an edge of the box; if any does, so does an end. */
static bool run_on_edge(const int dims[3], int margin, const struct parts_run *run)
{
    const int padded[3] = {dims[0] + 2 * margin, dims[1] + 2 * margin, dims[2] + 2 * margin};
    int first[3], last[3];
    volume_place(padded, (size_t)run->first, first);
    volume_place(padded, (size_t)(run->first + run->count - 1), last);
    for (int a = 0; a < 3; ++a) {
        first[a] -= margin;
        last[a] -= margin;
    }
    return is_on_edge(dims, first) || is_on_edge(dims, last);
}

/* Returns for the root of each part whether the part reaches an edge of the box, to be freed; NULL if memory is short. */
static bool *parts_on_edges(const int dims[3], int margin, const struct parts *parts)
{
    bool *reach = calloc((size_t)parts->count + 1, sizeof *reach);
    for (int r = 0; reach && r < parts->count; ++r) {
        reach[parts->runs[r].root] |= run_on_edge(dims, margin, &parts->runs[r]);
    }
    return reach;
}

bool segment_clear_edges(const struct volume *image, const struct volume *padded)
{
    const int margin = (padded->dims[0] - image->dims[0]) / 2;
    struct parts parts;
    bool *reach = parts_find(padded->dims, padded->data, true, &parts) ? parts_on_edges(image->dims, margin, &parts) : NULL;
    for (int r = 0; reach && r < parts.count; ++r) {
        if (reach[parts.runs[r].root]) {
            reverse(padded->data, &parts.runs[r]);
        }
    }
    const bool good = reach != NULL;
    free(reach);
    parts_free(&parts);
    return good;
}

/* Sets `reached` at the places that the ball's center can reach from the edge of the box without entering shut < 0; *any: there are some.
 * Returns false if memory is short. */
static bool flood_ball_centers(const int dims[3], const float *shut, uint8_t *reached, bool *any)
{
    struct parts parts;
    bool *outside = parts_find(dims, shut, false, &parts) ? parts_on_edges(dims, 0, &parts) : NULL;
    *any = false;
    memset(reached, 0, (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2]);
    for (int r = 0; outside && r < parts.count; ++r) {
        if (outside[parts.runs[r].root]) {
            memset(reached + parts.runs[r].first, 1, (size_t)parts.runs[r].count);
            *any = true;
        }
    }
    const bool good = outside != NULL;
    free(outside);
    parts_free(&parts);
    return good;
}

bool segment_pressure_solid(const struct volume *image, float size, const struct volume *padded)
{
    const int *dims = image->dims, margin = (padded->dims[0] - dims[0]) / 2;
    const size_t total = volume_voxels(image);
    uint8_t *object = malloc(total), *reached = malloc(total);
    float *shut = malloc(total * sizeof *shut);
    bool good = object && reached && shut, any = false;
    int place[3];
    for (size_t n = 0; good && n < total; ++n) {
        volume_place(dims, n, place);
        const int there[3] = {place[0] + margin, place[1] + margin, place[2] + margin};
        object[n] = padded->data[voxel_index(padded->dims, there)] > 0.0f;
    }
    for (size_t n = 0; good && n < total; ++n) {
        volume_place(dims, n, place);
        shut[n] = is_set_around(dims, object, place) ? -1.0f : 1.0f;
    }
    good = good && flood_ball_centers(dims, shut, reached, &any);
    for (size_t n = 0; good && any && n < total; ++n) { /* otherwise the image has no outside */
        volume_place(dims, n, place);
        if (!object[n] && !is_set_around(dims, reached, place)) {
            const int there[3] = {place[0] + margin, place[1] + margin, place[2] + margin};
            padded->data[voxel_index(padded->dims, there)] = fminf(1.0f, -box_distance(image, place) / size);
        }
    }
    free(object);
    free(reached);
    free(shut);
    return good;
}

/* ---- distances ---- */

/* Puts the smaller of a[j] and a[j + 1] first, without a jump. */
static void put_in_order(float a[3], float weight[3], int j)
{
    const float first = a[j], second = a[j + 1], v = weight[j], w = weight[j + 1];
    const bool swap = second < first;
    a[j] = swap ? second : first;
    a[j + 1] = swap ? first : second;
    weight[j] = swap ? w : v;
    weight[j + 1] = swap ? v : w;
}

/* Returns the smallest solution d of sum over the axes of weight (max(d - a, 0))^2 = 1, a[] being the nearer neighbors' distances
 * and weights 1 / spacing^2. */
static float eikonal(float a[3], float weight[3])
{
    float sum = 0.0f, linear = 0.0f, square = 0.0f, d = INFINITY;
    put_in_order(a, weight, 0);
    put_in_order(a, weight, 1);
    put_in_order(a, weight, 0);
    for (int i = 0; i < 3 && a[i] < d; ++i) {
        const float w = weight[i];
        sum += w;
        linear += w * a[i];
        square += w * a[i] * a[i];
        d = (linear + sqrtf(scalar_max(0.0f, linear * linear - sum * (square - 1.0f)))) / sum;
    }
    return d;
}

static float nearer(const float *distance, size_t at, size_t stride, int place, int size)
{
    const float before = place > 0 ? fabsf(distance[at - stride]) : INFINITY;
    return scalar_min(before, place + 1 < size ? fabsf(distance[at + stride]) : INFINITY);
}

/* Sweeps a line of voxels along x. down: bits of the axes that are swept from their ends. */
static void sweep_line(const struct volume *image, const float weights[3], float known, int down, int j, int k, float *distance)
{
    const int *dims = image->dims;
    const size_t line = (size_t)dims[0], slice = line * (size_t)dims[1];
    for (int x = 0; x < dims[0]; ++x) {
        const int i = down & 1 ? dims[0] - 1 - x : x;
        const size_t at = (size_t)i + line * (size_t)j + slice * (size_t)k;
        const float present = fabsf(distance[at]);
        if (present < known) {
            continue;
        }
        float weight[3] = {weights[0], weights[1], weights[2]};
        float a[3] = {nearer(distance, at, 1, i, dims[0]), nearer(distance, at, line, j, dims[1]),
                      nearer(distance, at, slice, k, dims[2])};
        if (scalar_min(a[0], scalar_min(a[1], a[2])) < present) {
            distance[at] = copysignf(scalar_max(known, scalar_min(present, eikonal(a, weight))), distance[at]);
        }
    }
}

struct sweep_loop {
    const struct volume *image;
    const float *weights;
    float known;
    int down;
    int front;
    int rows;
    int slices;
    float *distance;
    int first;
};

static void run_sweep_loop(void *arg, int begin, int end)
{
    const struct sweep_loop *loop = arg;
    const struct volume *image = loop->image;
    const float *weights = loop->weights;
    const float known = loop->known;
    const int down = loop->down;
    const int front = loop->front;
    const int rows = loop->rows;
    const int slices = loop->slices;
    float *distance = loop->distance;
    const int first = loop->first;
    for (int z = first + begin; z < first + end; ++z) {
        const int y = front - z;
        sweep_line(image, weights, known, down, down & 2 ? rows - 1 - y : y, down & 4 ? slices - 1 - z : z, distance);
    }
}

void segment_extend_distance(const struct volume *image, float known, float *distance)
{
    const int *dims = image->dims, rows = dims[1], slices = dims[2];
    const size_t total = volume_voxels(image);
    float weights[3];
    for (int a = 0; a < 3; ++a) {
        weights[a] = 1.0f / (image->spacing[a] * image->spacing[a]);
    }
    for (size_t n = 0; n < total; ++n) {
        distance[n] = fabsf(distance[n]) < known ? distance[n] : copysignf(1e9f, distance[n]);
    }
    for (int down = 0; down < 8; ++down) {
        for (int front = 0; front < rows + slices - 1; ++front) { /* lines with y + z = front do not need each other */
            const int first = front < rows ? 0 : front - rows + 1, last = front < slices ? front : slices - 1;
            struct sweep_loop loop = {image, weights, known, down, front, rows, slices, distance, first};
            threads_for(last - first + 1, 16, run_sweep_loop, &loop);
        }
    }
}
