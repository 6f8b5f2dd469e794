/* segment_labels.c - which part of the object a place belongs to, and figures of the parts.
 *
 * Where the atlas's subjects vote and have several labels, each voxel of the object takes the label with the largest weighted share of
 * the votes, with the weights of the votes for the object. Else, and where nobody has the place, the region of the atlas arrives there
 * with the surface. */
#include "atlas/atlas.h"

#include "imaging/resample.h"

#include <math.h>
#include <stdlib.h>

/* Sums the templates' shares of each label at a place. Returns the number from 1 of the largest, 0: nobody has the place. */
static int largest_share(const struct atlas_segment *run, const float place[3], float *share)
{
    const int count = run->atlas.templates[0].label_count;
    float sums[FUSION_MAX_LABELS] = {0.0f};
    int largest = 0;
    for (int t = 0; t < run->atlas.template_count; ++t) {
        const struct fusion_template *template = &run->atlas.templates[t];
        const size_t voxels = volume_voxels(&template->image);
        float there[3], index[3];
        fusion_back(&run->maps[t], place, 1, there);
        volume_world_to_index(&template->image, there, index);
        for (int l = 0; l < count; ++l) {
            sums[l] += run->trust[t] * resample_at(template->image.dims, run->shares[t] + (size_t)l * voxels, index);
        }
    }
    *share = 0.0f;
    for (int l = 0; l < count; ++l) {
        if (sums[l] > *share) {
            *share = sums[l];
            largest = l + 1;
        }
    }
    return largest;
}

static bool has_votes(const struct atlas_segment *run) { return run->fused && run->atlas.templates[0].label_count > 0; }

uint32_t atlas_voted_label(const struct atlas_segment *run, const float place[3])
{
    float share;
    const int number = has_votes(run) ? largest_share(run, place, &share) : 0;
    return number > 0 ? run->atlas.label_ids[number - 1] : 0;
}

/* Returns the label of a place inside the result. */
static uint32_t label_at(const struct atlas_segment *run, const struct target *surface, const float place[3])
{
    const struct similarity identity = similarity_identity();
    const uint32_t voted = atlas_voted_label(run, place);
    struct target_hit hit;
    if (voted != 0) {
        return voted;
    }
    target_nearest(surface, &identity, place, &hit);
    return run->regions[hit.vertex] > 0 ? run->regions[hit.vertex] : has_votes(run) ? run->atlas.label_ids[0] : 1;
}

bool atlas_segment_labels(const struct atlas_segment *run, const struct volume *grid, uint32_t *labels)
{
    const struct shape_mesh *mesh = &run->stages[ATLAS_STAGES - 1];
    const size_t voxels = volume_voxels(grid);
    struct target surface;
    uint8_t *mask = malloc(voxels);
    if (!mask || !target_create(mesh->positions, (size_t)mesh->vertex_count, mesh->triangles, (size_t)mesh->triangle_count, &surface)) {
        free(mask);
        return atlas_no_memory();
    }
    const bool good = atlas_segment_mask(run, ATLAS_STAGES - 1, grid, mask);
    for (size_t n = 0; good && n < voxels; ++n) {
        int at[3];
        float place[3];
        volume_place(grid->dims, n, at);
        const float index[3] = {(float)at[0], (float)at[1], (float)at[2]};
        volume_index_to_world(grid, index, place);
        labels[n] = mask[n] ? label_at(run, &surface, place) : 0;
    }
    target_free(&surface);
    free(mask);
    return good;
}

/* Returns true if the reference tells where the label is: --label may ask for others only. */
static bool is_compared(const struct atlas_segment *run, uint32_t label)
{
    int asked[ATLAS_MAX_LABELS];
    const int count = run->settings.label_text ? atlas_read_labels(run->settings.label_text, asked) : 0;
    bool compared = count == 0;
    for (int l = 0; l < count; ++l) {
        compared = compared || (uint32_t)asked[l] == label;
    }
    return run->reference.ids && compared;
}

/* Counts a label's voxels, and where the reference has it too. */
static void measure_label(const struct atlas_segment *run, const uint32_t *labels, struct atlas_part *part)
{
    const uint32_t *truth = is_compared(run, part->label) ? run->reference.ids : NULL;
    const double voxel = 1e-3 * (double)run->image.spacing[0] * (double)run->image.spacing[1] * (double)run->image.spacing[2];
    size_t found = 0, there = 0, both = 0;
    for (size_t n = 0; n < volume_voxels(&run->image); ++n) {
        const bool in = truth && truth[n] == part->label;
        found += labels[n] == part->label;
        there += in;
        both += in && labels[n] == part->label;
    }
    part->volume = voxel * (double)found;
    part->dice = truth && found + there > 0 ? 2.0 * (double)both / (double)(found + there) : (double)NAN;
}

bool atlas_measure_parts(struct atlas_segment *run)
{
    const size_t voxels = volume_voxels(&run->image);
    if (!has_votes(run)) {
        return true;
    }
    uint32_t *labels = malloc(voxels * sizeof *labels);
    const bool good = (labels || atlas_no_memory()) && atlas_segment_labels(run, &run->image, labels);
    run->part_count = good ? run->atlas.templates[0].label_count : 0;
    for (int l = 0; l < run->part_count; ++l) {
        run->parts[l].label = run->atlas.label_ids[l];
        measure_label(run, labels, &run->parts[l]);
    }
    free(labels);
    return good;
}
