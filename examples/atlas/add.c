/* add.c - takes subjects into an atlas whose vertices they have: atlas add. */
#define _POSIX_C_SOURCE 200809L

#include "atlas/atlas.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PATH = 1400 };

static int by_name(const void *left, const void *right) { return strcmp(left, right); }

/* Lists the meshes of the folder subjects/ beside an atlas. Returns how many, 0 after one line on stderr. */
static int list_meshes(const char *atlas, char (*paths)[MAX_PATH])
{
    char folder[1100];
    const char *slash = strrchr(atlas, '/');
    int count = 0;
    snprintf(folder, sizeof folder, "%.*ssubjects", slash ? (int)(slash - atlas) + 1 : 0, atlas);
    DIR *directory = opendir(folder);
    for (struct dirent *entry; directory && (entry = readdir(directory)) != NULL;) {
        const char *dot = strrchr(entry->d_name, '.');
        if (dot && strcmp(dot, ".ply") == 0 && entry->d_name[0] != '.' && count < ATLAS_MAX_SUBJECTS) {
            snprintf(paths[count++], MAX_PATH, "%s/%.255s", folder, entry->d_name);
        }
    }
    if (directory) {
        closedir(directory);
    }
    qsort(paths, (size_t)count, sizeof *paths, by_name);
    if (count == 0) {
        atlas_fail("%s: no meshes of the atlas's subjects there: make it again by atlas build", folder);
    }
    return count;
}

/* Gives the new atlas what the old one has learned beside shapes: the two have the same vertices. */
static void keep_learned(struct atlas *old, struct atlas *new)
{
    new->oriented = old->oriented;
    new->voxel = old->voxel;
    free(new->regions);
    new->regions = old->regions;
    new->samples = old->samples;
    new->spacing = old->spacing;
    new->profiles = old->profiles;
    new->spreads = old->spreads;
    memcpy(new->templates, old->templates, sizeof new->templates);
    memcpy(new->label_ids, old->label_ids, sizeof new->label_ids);
    new->template_count = old->template_count;
    old->regions = NULL;
    old->profiles = old->spreads = NULL;
    old->template_count = 0;
    memset(old->templates, 0, sizeof old->templates);
}

bool atlas_add_run(struct atlas_build *build)
{
    struct atlas_build_settings *set = &build->settings;
    struct atlas old;
    static char paths[ATLAS_MAX_SUBJECTS][MAX_PATH];
    const int there = list_meshes(set->extends, paths);
    if (there == 0 || !atlas_read(set->extends, &old)) {
        return false;
    }
    bool good = there + set->count <= ATLAS_MAX_SUBJECTS || atlas_fail("more than %d subjects", ATLAS_MAX_SUBJECTS);
    if (good) {
        memmove(set->names + there, set->names, (size_t)set->count * sizeof *set->names);
        for (int s = 0; s < there; ++s) {
            set->names[s] = paths[s];
        }
        set->count += there;
        good = atlas_build_run(build);
    }
    const struct shape_mesh *a = &old.mean, *b = &build->atlas.mean;
    if (good && (a->vertex_count != b->vertex_count || a->triangle_count != b->triangle_count
                 || memcmp(a->triangles, b->triangles, 3 * (size_t)a->triangle_count * sizeof *a->triangles) != 0)) {
        good = atlas_fail("%s: its meshes have other triangles", set->extends);
    }
    if (good) {
        keep_learned(&old, &build->atlas);
    }
    atlas_free(&old);
    return good;
}
