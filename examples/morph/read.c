/* read.c - the two characters: reads them, lends bones to one that has none, and brings the source onto the target's skeleton. */
#include "morph/morph.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Notes what of a character could not be read, or has been changed. */
static void note_changes(const char *name, const struct character *character)
{
    if (character->missing_pictures > 0) {
        fprintf(stderr, "morph: %s: textures that cannot be read, and are left out: %d\n", name, character->missing_pictures);
    }
    if (character->unnormal > 0) {
        fprintf(stderr, "morph: %s: the bone weights of %d vertices do not sum to 1; they are scaled\n", name, character->unnormal);
    }
    if (character->unweighted > 0) {
        fprintf(stderr, "morph: %s: %d vertices have no bone weights; they follow the first bone of their part\n", name,
                character->unweighted);
    }
}

static bool read_one(const char *path, int number, const char *props, bool quiet, struct character *character)
{
    char error[CHARACTER_TEXT];
    const bool good = path ? character_read(path, props, character, error) : character_build(number, character, error);
    if (good && !quiet) { note_changes(morph_name(path), character); }
    return good || morph_fail("%s", error);
}

bool morph_read_donor(const char *path, struct character *donor)
{
    char error[CHARACTER_TEXT];
    if (!character_read(path, NULL, donor, error)) { return morph_fail("%s", error); }
    if (donor->skinned) { return true; }
    character_free(donor);
    memset(donor, 0, sizeof *donor);
    return morph_fail("--donor %s: no part has bones", path);
}

/* Gives a body without bones the skeleton of --donor, or of the other character. */
static bool lend_bones(const struct morph *morph, struct character *body, const char *path, const struct character *other)
{
    struct character donor;
    struct rig_mesh mesh;
    if (body->skinned) {
        return true;
    }
    if (!morph->settings.donor && !other->skinned) {
        return morph_fail("%s: no part has bones, and there is no donor of any", path);
    }
    if (morph->settings.donor && !morph_read_donor(morph->settings.donor, &donor)) { return false; }
    const bool good = morph_rig(morph, path, body, morph->settings.donor ? &donor : other, &mesh);
    morph_rig_free(&mesh);
    if (morph->settings.donor) {
        character_free(&donor);
    }
    return good;
}

bool morph_check_props(const char *names, const struct character *one, const struct character *other)
{
    char name[CHARACTER_NAME];
    for (const char *at = names; at && strcmp(names, "all") != 0; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL) {
        snprintf(name, sizeof name, "%.*s", (int)strcspn(at, ","), at);
        if (!character_has_prop(one, name) && !character_has_prop(other, name)) {
            return morph_fail("--props: no rigid part on a bone is named like \"%s\" (see --list)", name);
        }
    }
    return true;
}

bool morph_read(struct morph *morph)
{
    const struct morph_settings *set = &morph->settings;
    struct character *source = &morph->source.character, *target = &morph->target.character;
    char error[CHARACTER_TEXT];
    if (!read_one(set->source, 0, set->props, set->common.quiet, source)
        || !read_one(set->target, 1, set->props, set->common.quiet, target)) {
        return false;
    }
    if (!morph_check_props(set->props, source, target)) { return false; }
    if (set->donor && source->skinned && target->skinned) {
        return morph_fail("--donor has no effect: both characters have bones");
    }
    if (!lend_bones(morph, source, set->source, target) || !lend_bones(morph, target, set->target, source)) {
        return false;
    }
    morph->animation = character_animation(target, set->animation);
    if (morph->animation < 0) {
        return set->animation ? morph_fail("%s: no animation %s (see --list)", morph_name(set->target), set->animation)
                              : morph_fail("%s: no animation", morph_name(set->target));
    }
    morph->source.pulls = malloc(3 * ((size_t)source->vertex_count + 1) * sizeof(float));
    morph->target.pulls = malloc(3 * ((size_t)target->vertex_count + 1) * sizeof(float));
    if (!morph->source.pulls || !morph->target.pulls) {
        return morph_no_memory();
    }
    if (!skeleton_align(source, target, set->map, &morph->alignment, error)) {
        return morph_fail("%s", error);
    }
    skeleton_rescale(source, target, &morph->alignment, morph->source.pulls, morph->target.pulls);
    return true;
}
