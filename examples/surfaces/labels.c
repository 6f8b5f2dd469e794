/* labels.c - the labels of a map, their names, and which of them are wanted. */
#include "surfaces/surfaces.h"

#include "pictures/image.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool surfaces_read_names(struct surfaces *run)
{
    const struct surfaces_settings *set = &run->settings;
    char error[VOLUME_TEXT];
    return (set->table ? label_names_read(set->table, &run->names, error)
                       : label_names_of_segments(set->labels, &run->names, error))
        || surfaces_fail("%s", error);
}

/* ---- what is wanted ---- */

/* Copies an item of a list up to one of `ends`; returns what follows, NULL at the end of the list. */
static const char *next_item(const char *list, const char *ends, char item[LABEL_NAME])
{
    const size_t length = strcspn(list, ends), kept = length < LABEL_NAME ? length : LABEL_NAME - 1;
    memcpy(item, list, kept);
    item[kept] = '\0';
    return list[length] ? list + length + 1 : NULL;
}

/* Marks the labels from `from` on that one of the two lists has. Returns false if an item is no label. */
static bool choose(struct surfaces *run, size_t from)
{
    const struct surfaces_settings *set = &run->settings;
    char item[LABEL_NAME];
    uint32_t id;
    for (const char *at = set->chosen; at;) {
        at = next_item(at, ",", item);
        if (!label_read(item, &id)) {
            return surfaces_fail("--label wants whole numbers from 0 to 4294967295: K or K1,K2,...; this is '%s'", item);
        }
        for (size_t l = from; l < run->count; ++l) {
            run->labels[l].chosen = run->labels[l].chosen || run->labels[l].id == id;
        }
    }
    for (const char *at = set->named; at;) {
        at = next_item(at, ";", item);
        for (size_t l = from; l < run->count; ++l) {
            run->labels[l].chosen = run->labels[l].chosen || strcmp(run->labels[l].name, item) == 0;
        }
    }
    for (size_t l = from; l < run->count; ++l) {
        run->labels[l].chosen = run->labels[l].chosen || (!set->chosen && !set->named);
        run->chosen += run->labels[l].chosen;
    }
    return true;
}

/* ---- the labels of a layer ---- */

static void describe(const struct surfaces *run, int layer, uint32_t id, size_t number, struct surfaces_label *label)
{
    const struct label_name *name = label_names_find(&run->names, id, run->settings.table ? 0 : layer);
    const struct color color = color_hsv(0.618034f * (float)number, 0.55f, 0.9f);
    memset(label, 0, sizeof *label);
    label->id = id;
    label->layer = layer;
    memcpy(label->color, (const float[3]){color.r, color.g, color.b}, sizeof label->color);
    if (name) {
        memcpy(label->name, name->name, sizeof label->name);
    }
    if (name && name->color[0] >= 0.0f) {
        memcpy(label->color, name->color, sizeof label->color);
    }
}

/* Finds where an id is, or would be, in an ascending list. */
static size_t place_of(const uint32_t *ids, size_t count, uint32_t id)
{
    size_t low = 0, high = count;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (ids[middle] < id) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

/* Lists the ids of the map but 0, ascending, with the voxels of each. Returns false if there are too many. */
static bool list_ids(const struct volume *map, uint32_t *ids, size_t *voxels, size_t *count)
{
    const size_t total = volume_voxels(map);
    size_t at = 0;
    *count = 0;
    for (size_t n = 0; n < total; ++n) {
        const uint32_t id = map->ids[n];
        if (id == 0) {
            continue;
        }
        if (!(at < *count && ids[at] == id)) {
            at = place_of(ids, *count, id);
        }
        if (!(at < *count && ids[at] == id)) {
            if (*count == SURFACES_MAX_LABELS) {
                return false;
            }
            memmove(ids + at + 1, ids + at, (*count - at) * sizeof *ids);
            memmove(voxels + at + 1, voxels + at, (*count - at) * sizeof *voxels);
            ids[at] = id;
            voxels[at] = 0;
            ++*count;
        }
        ++voxels[at];
    }
    return true;
}

/* Returns true if most neighbours are equal, as in every label map. */
static bool is_smooth(const struct volume *map)
{
    size_t pairs = 0, equal = 0;
    for (size_t n = 1; n < volume_voxels(map); ++n) {
        const bool counts = map->ids[n - 1] != 0 && map->ids[n] != 0;
        pairs += counts;
        equal += counts && map->ids[n - 1] == map->ids[n];
    }
    return 2 * equal >= pairs;
}

static bool add_labels(struct surfaces *run, int layer, const uint32_t *ids, const size_t *voxels, size_t count)
{
    struct surfaces_label *grown = realloc(run->labels, (run->count + count + 1) * sizeof *grown);
    if (!grown) {
        return surfaces_no_memory();
    }
    run->labels = grown;
    const size_t from = run->count;
    for (size_t l = 0; l < count; ++l) {
        describe(run, layer, ids[l], from + l, &run->labels[from + l]);
        run->labels[from + l].voxels = voxels[l];
    }
    run->count += count;
    return choose(run, from);
}

bool surfaces_read_layer(struct surfaces *run, int layer)
{
    const size_t certain = 64; /* so few values are no scan, however noisy */
    const struct surfaces_settings *set = &run->settings;
    char error[VOLUME_TEXT];
    const bool all = layer >= 0; /* of several */
    if (!volume_read_labels(set->labels, all ? layer : set->layer, "--layer", &run->map, error)) {
        return surfaces_fail("%s", error);
    }
    run->layers = run->map.frame_count;
    memcpy(run->warning, run->map.warning, sizeof run->warning);
    run->voxel_mm3 = run->map.spacing[0] * run->map.spacing[1] * run->map.spacing[2];
    free(run->map.data); /* only ids are used */
    run->map.data = NULL;
    uint32_t *ids = malloc((SURFACES_MAX_LABELS + 1) * sizeof *ids);
    size_t *voxels = malloc((SURFACES_MAX_LABELS + 1) * sizeof *voxels), count = 0;
    bool good = ids && voxels ? true : surfaces_no_memory();
    if (good && (!list_ids(&run->map, ids, voxels, &count) || (count > certain && !is_smooth(&run->map)))) {
        good = surfaces_fail("%.200s: a label map is wanted, with whole numbers of which most neighbours are equal; this looks like a scan",
                             set->labels);
    }
    good = good && add_labels(run, run->map.frame, ids, voxels, count);
    free(ids);
    free(voxels);
    return good;
}
