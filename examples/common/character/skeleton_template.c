#include "character/skeleton_template.h"

#include <cjson/cJSON.h>

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_FILE = 1 << 20 };

struct reader {
    const char *path;
    struct skeleton_template *skeleton;
    char *error;
};

static bool fail(const struct reader *r, const char *format, ...)
{
    va_list arguments;
    const int used = snprintf(r->error, CHARACTER_TEXT, "%.120s: ", r->path);
    va_start(arguments, format);
    vsnprintf(r->error + used, CHARACTER_TEXT - (size_t)used, format, arguments);
    va_end(arguments);
    for (char *c = r->error; *c; ++c) { /* names may have line ends */
        *c = *c == '\n' || *c == '\r' ? ' ' : *c;
    }
    return false;
}

static char *read_text(const char *path)
{
    FILE *file = fopen(path, "rb");
    char *text = file ? calloc(MAX_FILE + 1, 1) : NULL;
    const size_t length = text ? fread(text, 1, MAX_FILE, file) : 0;
    if (file) { fclose(file); }
    if (length == 0) {
        free(text);
        return NULL;
    }
    return text;
}

static int find(const struct skeleton_template *s, const char *name)
{
    for (int j = 0; j < s->count; ++j) {
        if (strcmp(s->joints[j].name, name) == 0) { return j; }
    }
    return -1;
}

static bool read_place(const struct reader *r, const cJSON *item, struct template_joint *joint)
{
    static const char *const names[] = {"between", "limb", "axis", "narrow", "height", "bend", "share"};
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItem(item, "place"));
    joint->place = PLACE_BETWEEN;
    for (int p = 0; text && p < (int)(sizeof names / sizeof *names); ++p) {
        if (strcmp(text, names[p]) == 0) {
            joint->place = (enum template_place)p;
            return true;
        }
    }
    return !text || fail(r, "joint %.60s: \"place\" is between, limb, axis, narrow, height, bend or share", joint->name);
}

static bool read_joint(const struct reader *r, const cJSON *item)
{
    struct skeleton_template *s = r->skeleton;
    struct template_joint *joint = &s->joints[s->count];
    const char *name = cJSON_GetStringValue(cJSON_GetObjectItem(item, "name")),
               *parent = cJSON_GetStringValue(cJSON_GetObjectItem(item, "parent")),
               *hint = cJSON_GetStringValue(cJSON_GetObjectItem(item, "hint"));
    const cJSON *position = cJSON_GetObjectItem(item, "position");
    if (!name || !name[0] || strlen(name) >= CHARACTER_NAME || find(s, name) >= 0) {
        return fail(r, "joint %d: a name of its own is wanted", s->count);
    }
    memset(joint, 0, sizeof *joint);
    snprintf(joint->name, sizeof joint->name, "%s", name);
    snprintf(joint->hint, sizeof joint->hint, "%.63s", hint ? hint : name);
    joint->mirror = -1;
    joint->parent = parent ? find(s, parent) : -1;
    joint->end = cJSON_IsTrue(cJSON_GetObjectItem(item, "end"));
    joint->optional = cJSON_IsTrue(cJSON_GetObjectItem(item, "optional"));
    if (s->count == 0 ? parent != NULL : joint->parent < 0) {
        return fail(r, "joint %.60s: its parent must be a joint before it; only the first has none", name);
    }
    for (int i = 0; i < 3; ++i) {
        const cJSON *value = cJSON_GetArrayItem(position, i);
        if (!cJSON_IsNumber(value) || !(fabs(value->valuedouble) < 1e6)) {
            return fail(r, "joint %.60s: \"position\" is three numbers", name);
        }
        joint->position[i] = (float)value->valuedouble;
    }
    ++s->count;
    return read_place(r, item, joint);
}

/* Finds the mirrors, once all joints are read. */
static bool read_mirrors(const struct reader *r, const cJSON *joints)
{
    struct skeleton_template *s = r->skeleton;
    for (int j = 0; j < s->count; ++j) {
        const char *mirror = cJSON_GetStringValue(cJSON_GetObjectItem(cJSON_GetArrayItem(joints, j), "mirror"));
        s->joints[j].mirror = mirror ? find(s, mirror) : -1;
        if (mirror && (s->joints[j].mirror < 0 || s->joints[j].mirror == j)) {
            return fail(r, "joint %.60s: its mirror is no other joint", s->joints[j].name);
        }
    }
    for (int j = 0; j < s->count; ++j) {
        const int m = s->joints[j].mirror, up = s->joints[j].parent, other = m >= 0 ? s->joints[m].parent : -1;
        if (m >= 0 && (s->joints[m].mirror != j || (other != up && (up < 0 || s->joints[up].mirror != other)))) {
            return fail(r, "joint %.60s: it and its mirror do not hang alike", s->joints[j].name);
        }
        if (m < 0 && up >= 0 && s->joints[up].mirror >= 0) {
            return fail(r, "joint %.60s: below a limb every joint has a mirror", s->joints[j].name);
        }
    }
    return true;
}

static int children(const struct skeleton_template *s, int joint, int *last)
{
    int count = 0;
    for (int j = joint + 1; j < s->count; ++j) {
        if (s->joints[j].parent == joint) {
            *last = j;
            ++count;
        }
    }
    return count;
}

bool skeleton_template_below(const struct skeleton_template *s, int joint, int above)
{
    while (joint > above) { joint = s->joints[joint].parent; }
    return joint == above;
}

/* Adds the pair of limbs that begins with a left joint. */
static bool add_limb(const struct reader *r, int root)
{
    struct skeleton_template *s = r->skeleton;
    int end = root, next = -1;
    if (s->limbs == 2) { return fail(r, "more than two pairs of limbs"); }
    for (int count; (count = children(s, end, &next)) > 0; end = next) {
        if (count > 1) { return fail(r, "joint %.60s: a limb does not branch", s->joints[end].name); }
    }
    if (!s->joints[end].end || end == root) {
        return fail(r, "joint %.60s: its limb ends without an \"end\"", s->joints[root].name);
    }
    s->limb_root[s->limbs][0] = root;
    s->limb_root[s->limbs][1] = s->joints[root].mirror;
    s->limb_end[s->limbs][0] = end;
    s->limb_end[s->limbs][1] = s->joints[end].mirror;
    ++s->limbs;
    return true;
}

static bool find_ends(const struct reader *r)
{
    struct skeleton_template *s = r->skeleton;
    float lowest = INFINITY, highest = -INFINITY;
    for (int j = 0; j < s->count; ++j) {
        const struct template_joint *joint = &s->joints[j];
        int unused;
        lowest = fminf(lowest, joint->position[1]);
        highest = fmaxf(highest, joint->position[1]);
        if (joint->end != (children(s, j, &unused) == 0)) {
            return fail(r, "joint %.60s: \"end\" is for the joints without children, and for all of them",
                        joint->name);
        }
        if (joint->mirror < 0 && joint->end) {
            if (s->trunk_ends == 2 || (joint->optional && s->trunk_ends == 0)) {
                return fail(r, "the trunk ends in a head and perhaps in an optional tail");
            }
            s->trunk_end[s->trunk_ends++] = j;
        }
        if (joint->mirror >= 0 && joint->position[0] > 0.0f && s->joints[joint->parent].mirror < 0
            && !add_limb(r, j)) {
            return false;
        }
    }
    s->height = highest - lowest;
    if (s->trunk_ends == 0 || s->limbs != 2 || !(s->height > 0.0f)) {
        return fail(r, "a head's end, two pairs of limbs and a height are wanted");
    }
    for (int l = 0; l < 2; ++l) {
        s->ground[l] = s->joints[s->limb_end[l][0]].position[1] - lowest < 0.1f * s->height;
    }
    return s->ground[0] || s->ground[1] || fail(r, "no pair of limbs stands on the ground");
}

bool skeleton_template_read(const char *path, struct skeleton_template *skeleton, char error[CHARACTER_TEXT])
{
    const struct reader r = {path, skeleton, error};
    char *text = read_text(path);
    memset(skeleton, 0, sizeof *skeleton);
    if (!text) { return fail(&r, "cannot be read"); }
    cJSON *json = cJSON_Parse(text);
    free(text);
    const cJSON *joints = cJSON_GetObjectItem(json, "joints");
    const char *name = cJSON_GetStringValue(cJSON_GetObjectItem(json, "name"));
    const int count = cJSON_GetArraySize(joints);
    snprintf(skeleton->name, sizeof skeleton->name, "%.63s", name ? name : "template");
    bool good = json || fail(&r, "no JSON");
    good = good
        && ((cJSON_IsArray(joints) && count >= 8 && count <= TEMPLATE_JOINTS)
            || fail(&r, "\"joints\" is an array of 8 to %d joints", TEMPLATE_JOINTS));
    for (int j = 0; good && j < count; ++j) { good = read_joint(&r, cJSON_GetArrayItem(joints, j)); }
    good = good && read_mirrors(&r, joints) && find_ends(&r);
    cJSON_Delete(json);
    return good;
}
