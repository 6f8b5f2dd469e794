/* segment_find.c - finds the atlas's object in an image that shows much more than the subjects' images do, such as a whole head:
 * where the correlation with a template's image, both on coarse cubes, is highest of all places. Only the part of the image around
 * that place is looked at from then on. */
#include "atlas/atlas.h"

#include "base/threads.h"
#include "base/vec3.h"
#include "imaging/resample.h"
#include "imaging/segment_image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float cells = 500.0f;           /* of a template: its object has some hundred, and whole bodies are searched in seconds */
static const double much_more = 8.0;         /* times the volume of a template's image */
static const double found_from = 0.5;        /* correlation; best places in images of other things reach .3 to .6 */
static const double least_share = 0.5;       /* of a template's cells that have to lie in the image */

static double box_volume(const struct volume *image)
{
    return (double)volume_voxels(image) * (double)image->spacing[0] * (double)image->spacing[1] * (double)image->spacing[2];
}

bool atlas_shows_much_more(const struct atlas_segment *run)
{
    return box_volume(&run->image) > much_more * box_volume(&run->atlas.templates[0].image);
}

/* Samples an image on cubes along the axes of the world, whatever its own are; NaN beyond it. */
static bool make_coarse(const struct volume *image, float side, struct volume *coarse)
{
    const size_t bytes = volume_voxels(image) * sizeof(float);
    const float sides[3] = {side, side, side};
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    int dims[3];
    for (int corner = 0; corner < 8; ++corner) {
        float index[3], place[3];
        for (int a = 0; a < 3; ++a) {
            index[a] = corner >> a & 1 ? (float)(image->dims[a] - 1) : 0.0f;
        }
        volume_index_to_world(image, index, place);
        for (int a = 0; a < 3; ++a) {
            lo[a] = fminf(lo[a], place[a]);
            hi[a] = fmaxf(hi[a], place[a]);
        }
    }
    for (int a = 0; a < 3; ++a) {
        dims[a] = (int)((hi[a] - lo[a]) / side) + 1;
    }
    float *values = malloc(bytes);
    bool good = values && volume_create(dims, sides, lo, coarse);
    unsigned char *valid = good ? malloc(volume_voxels(coarse)) : NULL;
    good = good && valid;
    if (good) {
        memcpy(values, image->data, bytes);
        good = segment_blur(image, side, values);
    }
    if (good) {
        resample_volume(image, values, NULL, coarse, coarse->data, valid);
        for (size_t n = 0; n < volume_voxels(coarse); ++n) {
            coarse->data[n] = valid[n] ? coarse->data[n] : NAN;
        }
    }
    free(values);
    free(valid);
    return good || atlas_no_memory();
}

struct find_loop {
    const struct volume *image, *template;
    int first[3], places[3]; /* offsets of the template from the image, in cubes */
    double *correlations;    /* one for each place */
};

/* Computes the correlation of the two where the template's first cube lies on cube `at` of the image. */
static double correlation_at(const struct volume *image, const struct volume *template, const int at[3])
{
    double n = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
    size_t t = 0;
    for (int k = 0; k < template->dims[2]; ++k) {
        for (int j = 0; j < template->dims[1]; ++j) {
            const int y = at[1] + j, z = at[2] + k;
            const bool in = y >= 0 && z >= 0 && y < image->dims[1] && z < image->dims[2];
            const size_t row = in ? (size_t)image->dims[0] * ((size_t)y + (size_t)image->dims[1] * (size_t)z) : 0;
            for (int i = 0; i < template->dims[0]; ++i, ++t) {
                const int x = at[0] + i;
                if (in && x >= 0 && x < image->dims[0] && !isnan(image->data[row + (size_t)x]) && !isnan(template->data[t])) {
                    const double p = (double)image->data[row + (size_t)x], q = (double)template->data[t];
                    n += 1.0, a += p, b += q, aa += p * p, bb += q * q, ab += p * q;
                }
            }
        }
    }
    const double spread = (aa - a * a / n) * (bb - b * b / n);
    return n >= least_share * (double)volume_voxels(template) && spread > 0.0 ? (ab - a * b / n) / sqrt(spread) : -1.0;
}

static void run_find_loop(void *arg, int begin, int end)
{
    const struct find_loop *loop = arg;
    for (int p = begin; p < end; ++p) {
        int at[3];
        volume_place(loop->places, (size_t)p, at);
        for (int a = 0; a < 3; ++a) {
            at[a] += loop->first[a];
        }
        loop->correlations[p] = correlation_at(loop->image, loop->template, at);
    }
}

/* Finds the place of one template. shift: from the template's places to the image's, mm. */
static bool find_template(const struct volume *image, const struct volume *template, double *correlation, float shift[3])
{
    struct find_loop loop = {.image = image, .template = template};
    size_t count = 1, best = 0;
    int at[3];
    for (int a = 0; a < 3; ++a) {
        loop.first[a] = -template->dims[a] / 2;
        loop.places[a] = image->dims[a];
        count *= (size_t)image->dims[a];
    }
    loop.correlations = malloc(count * sizeof *loop.correlations);
    if (!loop.correlations) {
        return atlas_no_memory();
    }
    threads_for((int)count, 64, run_find_loop, &loop);
    for (size_t p = 0; p < count; ++p) {
        best = loop.correlations[p] > loop.correlations[best] ? p : best;
    }
    *correlation = loop.correlations[best];
    volume_place(loop.places, best, at);
    for (int a = 0; a < 3; ++a) {
        shift[a] = image->origin[a] + image->spacing[a] * (float)(at[a] + loop.first[a]) - template->origin[a];
    }
    free(loop.correlations);
    return true;
}

/* Cuts the part around a shape: half of its longest side on each side of it. */
static bool cut_part(const struct volume *image, const float *shape, int vertices, struct volume *part)
{
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY}, longest = 0.0f;
    int first[3], dims[3];
    for (int v = 0; v < vertices; ++v) {
        float index[3];
        volume_world_to_index(image, shape + 3 * v, index);
        for (int a = 0; a < 3; ++a) {
            lo[a] = fminf(lo[a], index[a]);
            hi[a] = fmaxf(hi[a], index[a]);
        }
    }
    for (int a = 0; a < 3; ++a) {
        longest = fmaxf(longest, (hi[a] - lo[a]) * image->spacing[a]);
    }
    for (int a = 0; a < 3; ++a) {
        const float margin = 0.5f * longest / image->spacing[a], last = (float)(image->dims[a] - 1);
        first[a] = (int)fmaxf(0.0f, fminf(last, floorf(lo[a] - margin)));
        dims[a] = (int)fmaxf(0.0f, fminf(last, ceilf(hi[a] + margin))) - first[a] + 1;
    }
    if (!atlas_crop(image, first, dims, part)) {
        return false;
    }
    part->minimum = image->minimum;
    part->maximum = image->maximum;
    return true;
}

/* The middle of a template's object, and its longest side. */
static void middle_of(const struct fusion_template *template, float middle[3], float *longest)
{
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int i = 0; i < 3 * template->vertices; ++i) {
        lo[i % 3] = fminf(lo[i % 3], template->places[i]);
        hi[i % 3] = fmaxf(hi[i % 3], template->places[i]);
    }
    *longest = 0.0f;
    for (int a = 0; a < 3; ++a) {
        middle[a] = 0.5f * (lo[a] + hi[a]);
        *longest = fmaxf(*longest, hi[a] - lo[a]);
    }
}

/* Finds the place of all templates. best: the template that fits best there; middles: of each one's object there. */
static bool find_templates(const struct atlas_segment *run, const struct volume *coarse, double *highest, int *best, float shift[3],
                           float *middles)
{
    bool good = true;
    *highest = -2.0;
    for (int t = 0; good && t < run->atlas.template_count; ++t) {
        struct volume template = {.data = NULL};
        double correlation = 0.0;
        float there[3], longest;
        good = make_coarse(&run->atlas.templates[t].image, coarse->spacing[0], &template)
            && find_template(coarse, &template, &correlation, there);
        middle_of(&run->atlas.templates[t], middles + 3 * t, &longest);
        for (int a = 0; good && a < 3; ++a) {
            middles[3 * t + a] += there[a];
        }
        if (good && correlation > *highest) {
            *highest = correlation;
            *best = t;
            memcpy(shift, there, sizeof there);
        }
        volume_free(&template);
    }
    return good;
}

/* Returns true if more than half of the other templates find the object where the best one does, within half its longest side: in other
 * contrasts and other parts of the body each finds a place of its own. */
static bool find_one_place(const struct atlas_segment *run, int best, const float *middles)
{
    int close = 0;
    float middle[3], longest;
    middle_of(&run->atlas.templates[best], middle, &longest);
    for (int t = 0; t < run->atlas.template_count; ++t) {
        float away[3];
        vec3_sub(middles + 3 * t, middles + 3 * best, away);
        close += t != best && vec3_length(away) <= 0.5f * longest;
    }
    return run->atlas.template_count < 2 || 2 * close > run->atlas.template_count - 1;
}

bool atlas_find(struct atlas_segment *run)
{
    const struct fusion_template *templates = run->atlas.templates;
    const float side = cbrtf((float)box_volume(&templates[0].image) / cells);
    struct volume coarse = {.data = NULL};
    float shift[3] = {0.0f, 0.0f, 0.0f};
    double highest = -2.0;
    int best = 0;
    float *middles = malloc(3 * (size_t)run->atlas.template_count * sizeof *middles);
    const bool good = (middles || atlas_no_memory()) && make_coarse(&run->image, side, &coarse)
                   && find_templates(run, &coarse, &highest, &best, shift, middles);
    const bool one_place = good && find_one_place(run, best, middles);
    volume_free(&coarse);
    free(middles);
    if (!good) {
        return false;
    }
    if (highest < found_from) {
        return atlas_fail("%.200s: the atlas's object is not found: the correlation with the subjects' images is %.2f at the best "
                          "place, %.2f is wanted. Cut out the part around the object", run->settings.image, highest, found_from);
    }
    if (!one_place) {
        return atlas_fail("%.200s: the atlas's object is not found: the subjects' images fit best at different places. Another contrast, "
                          "or another part of the body? Else cut out the part around the object", run->settings.image);
    }
    const size_t length = 3 * (size_t)templates[best].vertices;
    run->confidence.searched = true;
    run->placing.pose = similarity_identity();
    run->placing.shape = malloc(length * sizeof *run->placing.shape);
    if (!run->placing.shape) {
        return atlas_no_memory();
    }
    for (size_t i = 0; i < length; ++i) {
        run->placing.shape[i] = templates[best].places[i] + shift[i % 3];
    }
    return cut_part(&run->image, run->placing.shape, templates[best].vertices, &run->part);
}
