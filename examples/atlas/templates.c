/* templates.c - registers the subjects of an atlas to the images of a few of them (fusion.h). */
#include "atlas/atlas.h"

#include "base/progress.h"
#include "base/threads.h"
#include "base/vec3.h"
#include "imaging/segment_image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MARGIN = 8 }; /* voxels around a template's mask */

void atlas_templates_choose(const struct atlas_build *build, int wanted, int *chosen)
{
    const int count = build->settings.count;
    size_t volumes[ATLAS_MAX_SUBJECTS];
    for (int s = 0; s < count; ++s) {
        const struct volume *labels = &build->subjects[s].labels;
        volumes[s] = 0;
        for (size_t n = 0; n < volume_voxels(labels); ++n) {
            volumes[s] += labels->data[n] > 0.5f;
        }
    }
    for (int t = 0; t < wanted; ++t) {
        const int rank = (2 * t + 1) * count / (2 * wanted);
        for (int s = 0; s < count; ++s) {
            int smaller = 0;
            for (int o = 0; o < count; ++o) {
                smaller += volumes[o] < volumes[s] || (volumes[o] == volumes[s] && o < s);
            }
            chosen[t] = smaller == rank ? s : chosen[t];
        }
    }
}

/* Cuts the part of a subject's image that lies around its mask. */
static bool cut_image(const struct atlas_subject *subject, struct volume *part)
{
    const struct volume *image = &subject->image;
    int lo[3], hi[3], dims[3];
    for (int a = 0; a < 3; ++a) {
        lo[a] = image->dims[a] - 1;
        hi[a] = 0;
    }
    for (int v = 0; v < subject->mesh.vertex_count; ++v) {
        float index[3];
        volume_world_to_index(image, subject->mesh.positions + 3 * v, index);
        for (int a = 0; a < 3; ++a) {
            const int at = (int)fmaxf(0.0f, fminf((float)(image->dims[a] - 1), floorf(index[a])));
            lo[a] = at < lo[a] ? at : lo[a];
            hi[a] = at > hi[a] ? at : hi[a];
        }
    }
    for (int a = 0; a < 3; ++a) {
        lo[a] = lo[a] > MARGIN ? lo[a] - MARGIN : 0;
        hi[a] = hi[a] + 1 + MARGIN < image->dims[a] ? hi[a] + 1 + MARGIN : image->dims[a] - 1;
        dims[a] = hi[a] - lo[a] + 1;
    }
    if (!atlas_crop(image, lo, dims, part)) {
        return false;
    }
    part->minimum = image->minimum;
    part->maximum = image->maximum;
    return true;
}

/* Samples a subject's mask, 0 or 1 at its voxels, at the places of the template's voxels. */
static bool sample_mask(const struct fusion_map *map, const struct volume *grid, const struct volume *labels, float *mask)
{
    struct volume binary = *labels; /* the same grid with other data */
    binary.data = malloc(volume_voxels(labels) * sizeof *binary.data);
    if (!binary.data) {
        return false;
    }
    for (size_t n = 0; n < volume_voxels(labels); ++n) {
        binary.data[n] = labels->data[n] > 0.5f ? 1.0f : 0.0f;
    }
    fusion_sample(map, grid, &binary, mask);
    free(binary.data);
    return true;
}

/* Returns the number from 1 of a label in the atlas's list, 0: it is not there. */
static int number_of(const struct atlas *atlas, int count, uint32_t label)
{
    for (int l = 0; l < count; ++l) {
        if (atlas->label_ids[l] == label) {
            return l + 1;
        }
    }
    return 0;
}

/* Lists the labels of the subjects' maps. Returns how many; 0 where there is only one, or, with a note, more than vote. */
static int list_labels(struct atlas_build *build)
{
    struct atlas *atlas = &build->atlas;
    int count = 0;
    for (int s = 0; s < build->settings.count; ++s) {
        const struct atlas_subject *subject = &build->subjects[s];
        for (size_t n = 0; n < volume_voxels(&subject->labels); ++n) {
            const uint32_t value = (uint32_t)subject->labels.data[n];
            const uint32_t label = value > 0 && subject->label_ids ? subject->label_ids[value - 1] : value;
            if (label != 0 && number_of(atlas, count, label) == 0) {
                if (count == FUSION_MAX_LABELS) {
                    fprintf(stderr, "atlas: more than %d labels: they are not voted on, and arrive with the surface\n", FUSION_MAX_LABELS);
                    return 0;
                }
                atlas->label_ids[count++] = label;
            }
        }
    }
    return count > 1 ? count : 0;
}

/* Takes the labels of a subject's map that are nearest to the places of the template's voxels. */
static void take_labels(const struct atlas_build *build, const struct fusion_map *map, int s, struct fusion_template *template)
{
    const size_t voxels = volume_voxels(&template->image);
    for (size_t n = 0; n < voxels; ++n) {
        float place[3];
        fusion_place(map, &template->image, n, place);
        template->labels[(size_t)s * voxels + n] =
            number_of(&build->atlas, template->label_count, atlas_label_at(&build->subjects[s], place));
    }
}

/* Registers a subject to a template, and samples its image, mask and labels there. error: receives what is wrong. */
static bool add_subject(const struct atlas_build *build, int s, struct fusion_template *template, char error[VOLUME_TEXT])
{
    const struct atlas_subject *self = &build->subjects[template->self], *subject = &build->subjects[s];
    const size_t voxels = volume_voxels(&template->image);
    struct fusion_map map;
    float shift[3];
    for (int a = 0; a < 3; ++a) {
        shift[a] = (float)(subject->target.center[a] - self->target.center[a]);
    }
    if (!fusion_register(&template->image, &subject->image, shift, &map, error)) {
        return false;
    }
    fusion_sample(&map, &template->image, &subject->image, template->images + (size_t)s * voxels);
    const bool good = sample_mask(&map, &template->image, &subject->labels, template->masks + (size_t)s * voxels);
    if (template->labels) {
        take_labels(build, &map, s, template);
    }
    registration_free(&map.registration);
    snprintf(error, VOLUME_TEXT, "not enough memory");
    return good;
}

static bool make_template(const struct atlas_build *build, int self, int labels, struct fusion_template *template)
{
    const size_t count = (size_t)build->settings.count, vertices = (size_t)build->atlas.mean.vertex_count;
    template->self = self;
    template->count = build->settings.count;
    template->vertices = (int)vertices;
    template->level = 0.5f;
    if (!cut_image(&build->subjects[self], &template->image)) {
        return false;
    }
    const size_t voxels = volume_voxels(&template->image);
    template->images = malloc(count * voxels * sizeof *template->images);
    template->masks = malloc(count * voxels * sizeof *template->masks);
    template->places = malloc(3 * vertices * sizeof *template->places);
    template->label_count = labels;
    template->labels = labels > 0 ? malloc(count * voxels * sizeof *template->labels) : NULL;
    if (!template->images || !template->masks || !template->places || (labels > 0 && !template->labels)) {
        return atlas_no_memory();
    }
    memcpy(template->places, build->subjects[self].shape, 3 * vertices * sizeof *template->places);
    return true;
}

struct fill_loop {
    const struct atlas_build *build;
    struct fusion_template *template;
    struct progress *bar;
    int done;   /* registrations, those to other templates too */
    int failed; /* the first subject of those that failed; -1: none */
    char error[VOLUME_TEXT];
};

static void run_fill_loop(void *arg, int begin, int end)
{
    struct fill_loop *loop = arg;
    for (int s = begin; s < end; ++s) {
        char error[VOLUME_TEXT];
        const bool good = add_subject(loop->build, s, loop->template, error);
        threads_lock();
        if (!good && (loop->failed < 0 || s < loop->failed)) {
            loop->failed = s;
            memcpy(loop->error, error, sizeof error);
        }
        progress_update(loop->bar, (size_t)++loop->done, loop->build->settings.names[s]);
        threads_unlock();
    }
}

/* Registers all subjects to a template. They take turns on the threads: each by itself is small. */
static bool fill_template(const struct atlas_build *build, struct fusion_template *template, struct progress *bar, int before)
{
    const size_t voxels = volume_voxels(&template->image);
    struct fill_loop loop = {.build = build, .template = template, .bar = bar, .done = before, .failed = -1};
    threads_for(template->count, 1, run_fill_loop, &loop);
    if (loop.failed >= 0) {
        return atlas_fail("%s: %s", build->subjects[loop.failed].name, loop.error);
    }
    bool good = true;
    for (int s = 0; good && s < template->count; ++s) {
        good = fusion_normalize(template, template->images + (size_t)s * voxels);
    }
    return (good && fusion_prepare(template)) || atlas_no_memory();
}

bool atlas_templates_make(struct atlas_build *build)
{
    const struct atlas_build_settings *set = &build->settings;
    struct atlas *atlas = &build->atlas;
    int chosen[FUSION_MAX_TEMPLATES] = {0};
    struct progress bar;
    bool good = true;
    if (!build->subjects[0].image.data || set->count < FUSION_MIN_SUBJECTS || set->templates < 1) {
        return true;
    }
    atlas_templates_choose(build, set->templates, chosen);
    const int labels = list_labels(build);
    progress_begin(&bar, "registration", (size_t)(set->templates * set->count), !cli_may_print(&set->common));
    for (int t = 0; good && t < set->templates; ++t) {
        atlas->template_count = t + 1;
        good = make_template(build, chosen[t], labels, &atlas->templates[t])
            && fill_template(build, &atlas->templates[t], &bar, t * set->count);
    }
    progress_end(&bar);
    return good;
}
