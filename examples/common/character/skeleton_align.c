#include "character/skeleton_align.h"

#include "base/vec3.h"
#include "character/skeleton_limbs.h"
#include "shapes/shapes.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- mapping joints ---- */

/* Marks joints that vertices depend on, and the joints above them. */
static bool *used_joints(const struct character *character)
{
    bool *used = calloc((size_t)character->joint_count + 1, sizeof *used);
    for (int j = character->joint_count - 1; used && j >= 0; --j) {
        const int parent = character->joints[j].parent;
        used[j] = used[j] || character->joints[j].bone;
        if (used[j] && parent >= 0) {
            used[parent] = true;
        }
    }
    return used;
}

/* Returns true if two joints have the same name, but for case and signs. */
static bool same_name(const char *a, const char *b)
{
    for (;; ++a, ++b) {
        while (*a && !isalnum((unsigned char)*a)) {
            ++a;
        }
        while (*b && !isalnum((unsigned char)*b)) {
            ++b;
        }
        if (tolower((unsigned char)*a) != tolower((unsigned char)*b)) {
            return false;
        }
        if (!*a) {
            return true;
        }
    }
}

/* Nodes without a name are called nodes[N]: that is their number in their file. */
static bool is_numbered(const char *name) { return strncmp(name, "nodes[", 6) == 0; }

/* Returns true if two skeletons have the same joints in the same order, as in two files from one: then numbers are names too. */
static bool same_skeleton(const struct character *a, const struct character *b)
{
    bool same = a->joint_count == b->joint_count;
    for (int j = 0; same && j < a->joint_count; ++j) {
        same = strcmp(a->joints[j].name, b->joints[j].name) == 0 && a->joints[j].parent == b->joints[j].parent;
    }
    return same;
}

static int map_by_names(const struct character *source, const bool *source_used, const struct character *target,
                        const bool *target_used, int *map)
{
    const bool same = same_skeleton(source, target);
    int pairs = 0;
    for (int i = 0; i < source->joint_count; ++i) {
        const bool named = source_used[i] && (same || !is_numbered(source->joints[i].name));
        map[i] = -1;
        for (int j = 0; map[i] < 0 && named && j < target->joint_count; ++j) {
            if (target_used[j] && same_name(source->joints[i].name, target->joints[j].name)) {
                map[i] = j;
                ++pairs;
            }
        }
    }
    return pairs;
}

static int first_bone(const struct character *character)
{
    for (int j = 0; j < character->joint_count; ++j) {
        if (character->joints[j].bone) {
            return j;
        }
    }
    return -1;
}

static int count_true(const bool *flags, int count)
{
    int sum = 0;
    for (int i = 0; flags && i < count; ++i) {
        sum += flags[i];
    }
    return sum;
}

static int map_by_file(const struct character *source, const struct character *target, const char *path, int *map,
                       char error[CHARACTER_TEXT])
{
    char line[512], a[CHARACTER_NAME], b[CHARACTER_NAME];
    int pairs = 0, number = 0;
    FILE *file = fopen(path, "r");
    if (!file) {
        snprintf(error, CHARACTER_TEXT, "%.200s: cannot open", path);
        return 0;
    }
    while (fgets(line, sizeof line, file)) {
        ++number;
        line[strcspn(line, "#\n")] = '\0';
        const int read = sscanf(line, "%63s %63s", a, b);
        if (read < 1) {
            continue;
        }
        const int i = character_joint(source, a), j = read == 2 ? character_joint(target, b) : -1;
        if (i < 0 || j < 0) {
            snprintf(error, CHARACTER_TEXT, "%.120s, line %d: %s%s", path, number,
                     read < 2 ? "a pair of names is wanted" : i < 0 ? "the source has no joint " : "the target has no joint ",
                     read < 2 ? "" : i < 0 ? a : b);
            fclose(file);
            return 0;
        }
        pairs += map[i] < 0;
        map[i] = j;
    }
    fclose(file);
    if (pairs == 0) {
        snprintf(error, CHARACTER_TEXT, "%.200s: no pair of joints", path);
    }
    return pairs;
}

/* ---- rotating and scaling bones ---- */

/* Returns the nearest mapped joint above a joint, -1: none. */
static int mapped_above(const struct character *source, const int *map, int joint)
{
    int up = source->joints[joint].parent;
    while (up >= 0 && map[up] < 0) {
        up = source->joints[up].parent;
    }
    return up;
}

struct bone_ends { /* of a joint and its mapped children: three or more points, the joint first */
    float *from, *to;
    double *weights;
    size_t count;
};

/* Fits rotation and scale for two children or more by least squares; a cross of light points keeps the parent's orientation
 * where the children leave it open. */
static struct affine fit_fork(struct bone_ends *ends, const struct affine *above)
{
    struct similarity fit;
    double size = 0.0;
    for (size_t n = 1; n < ends->count; ++n) {
        float d[3];
        vec3_sub(ends->from + 3 * n, ends->from, d);
        size = fmax(size, (double)vec3_length(d));
    }
    for (int k = 0; k < 6; ++k) {
        float *from = ends->from + 3 * ends->count, *to = ends->to + 3 * ends->count;
        for (int i = 0; i < 3; ++i) {
            const double step = k / 2 == i ? (k % 2 ? -0.1 : 0.1) * size : 0.0;
            from[i] = ends->from[i] + (float)step;
            to[i] = ends->to[i];
        }
        for (int i = 0; i < 3; ++i) {
            to[i] += (float)(above->m[4 * i + k / 2] * (k % 2 ? -0.1 : 0.1) * size);
        }
        ends->weights[ends->count++] = 0.3;
    }
    struct affine a = *above;
    if (similarity_fit(ends->from, ends->to, ends->weights, ends->count, true, &fit)) {
        for (int i = 0; i < 9; ++i) {
            a.m[4 * (i / 3) + i % 3] = fit.scale * fit.rotation[i / 3][i % 3];
        }
    }
    return a;
}

static struct affine fit_bone(struct bone_ends *ends, const struct affine *above)
{
    float d[3], e[3], turned[3];
    if (ends->count > 2) {
        return fit_fork(ends, above);
    }
    vec3_sub(ends->from + 3 * (ends->count - 1), ends->from, d);
    vec3_sub(ends->to + 3 * (ends->count - 1), ends->to, e);
    const double length = (double)vec3_length(d), wanted = (double)vec3_length(e), scale = cbrt(affine_determinant(above));
    if (!(length > 0.0) || !(wanted > 0.0)) { /* there is no joint beyond */
        return *above;
    }
    struct affine linear = *above;
    linear.m[3] = linear.m[7] = linear.m[11] = 0.0;
    affine_apply(&linear, d, turned);
    const struct affine turn = affine_turn(turned, e);
    struct affine a = affine_after(&turn, &linear);
    for (int i = 0; i < 12; ++i) {
        a.m[i] *= wanted / (length * scale);
    }
    return a;
}

/* Returns the ratio of the target's total bone length to the source's. */
static double skeleton_ratio(const struct character *source, const struct character *target, const int *map)
{
    double from = 0.0, to = 0.0;
    for (int i = 0; i < source->joint_count; ++i) {
        const int up = map[i] >= 0 ? mapped_above(source, map, i) : -1;
        if (up >= 0) {
            float a[3], b[3], c[3], d[3];
            joint_place(&source->joints[i], a);
            joint_place(&source->joints[up], b);
            joint_place(&target->joints[map[i]], c);
            joint_place(&target->joints[map[up]], d);
            vec3_sub(a, b, a);
            vec3_sub(c, d, c);
            from += (double)vec3_length(a);
            to += (double)vec3_length(c);
        }
    }
    return from > 0.0 && to > 0.0 ? to / from : 1.0;
}

void skeleton_fit_bones(const struct character *source, const struct character *target, const int *map, struct affine *bones)
{
    const size_t capacity = (size_t)source->joint_count + 8;
    struct bone_ends ends = {malloc(3 * capacity * sizeof(float)), malloc(3 * capacity * sizeof(float)),
                             malloc(capacity * sizeof(double)), 0};
    const double ratio = skeleton_ratio(source, target, map);
    for (int i = 0; i < source->joint_count; ++i) {
        const int up = mapped_above(source, map, i), parent = source->joints[i].parent;
        struct affine above = affine_identity();
        for (int k = 0; k < 3; ++k) {
            above.m[5 * k] = ratio;
        }
        above = up >= 0 ? bones[up] : above;
        bones[i] = map[i] < 0 && parent >= 0 ? bones[parent] : above;
        if (map[i] < 0 || !ends.from || !ends.to || !ends.weights) {
            continue;
        }
        ends.count = 0;
        for (int j = i; j < source->joint_count; ++j) {
            if (map[j] >= 0 && (j == i || mapped_above(source, map, j) == i)) {
                joint_place(&source->joints[j], ends.from + 3 * ends.count);
                joint_place(&target->joints[map[j]], ends.to + 3 * ends.count);
                ends.weights[ends.count++] = 1.0;
            }
        }
        float moved[3];
        bones[i] = fit_bone(&ends, &above);
        bones[i].m[3] = bones[i].m[7] = bones[i].m[11] = 0.0;
        affine_apply(&bones[i], ends.from, moved);
        for (int k = 0; k < 3; ++k) { /* the joint itself moves onto its counterpart */
            bones[i].m[4 * k + 3] = (double)(ends.to[k] - moved[k]);
        }
    }
    free(ends.from);
    free(ends.to);
    free(ends.weights);
}

/* ---- alignment ---- */

/* Lists for each joint that nothing is mapped to (mapped: not its own but a flag) the highest such joint above it, -1: mapped. */
static void list_alone(const struct character *c, const bool *used, const bool *mapped, int *alone)
{
    for (int j = 0; j < c->joint_count; ++j) {
        const int up = c->joints[j].parent;
        alone[j] = mapped[j] || !used[j] ? -1 : up >= 0 && alone[up] >= 0 ? alone[up] : j;
    }
    for (int j = 0; j < c->joint_count; ++j) { /* helpers between the root and the first joint are no limbs */
        for (int up = c->joints[j].parent; mapped[j] && up >= 0; up = c->joints[up].parent) { alone[up] = -1; }
    }
}

static bool pair_names(const struct character *source, const struct character *target, struct alignment *a)
{
    bool *source_used = used_joints(source), *target_used = used_joints(target);
    const int ours = count_true(source_used, source->joint_count), theirs = count_true(target_used, target->joint_count);
    bool good = source_used && target_used;
    if (good) {
        a->pairs = map_by_names(source, source_used, target, target_used, a->map);
        good = a->pairs > 0 && 10 * a->pairs >= 9 * (ours < theirs ? ours : theirs);
    }
    free(source_used);
    free(target_used);
    return good;
}

static bool pair_limbs(const struct character *source, const struct character *target, struct alignment *a)
{
    struct skeleton_limbs ours, theirs;
    if (!skeleton_limbs_find(source, &ours) || !skeleton_limbs_find(target, &theirs)) { return false; }
    a->pairs = skeleton_limbs_pair(source, &ours, &theirs, a->map, a->bones);
    for (int j = 0; j < source->joint_count; ++j) { a->shrinks[j] = skeleton_limbs_alone(source, &ours, &theirs, j); }
    for (int j = 0; j < target->joint_count; ++j) {
        a->grows[j] = skeleton_limbs_alone(target, &theirs, &ours, j);
        a->bone_above[j] = a->grows[j] < 0 ? skeleton_limbs_above(target, &theirs, j) : -1;
    }
    return true;
}

/* Completes an alignment whose joints are mapped by names: computes the bones' maps, and which joints only one has. */
static bool complete(const struct character *source, const struct character *target, struct alignment *a)
{
    bool *used[2] = {used_joints(source), used_joints(target)};
    bool *mapped[2] = {calloc((size_t)source->joint_count + 1, sizeof(bool)),
                       calloc((size_t)target->joint_count + 1, sizeof(bool))};
    const bool good = used[0] && used[1] && mapped[0] && mapped[1];
    for (int j = 0; good && j < source->joint_count; ++j) {
        if (a->map[j] >= 0) { mapped[0][j] = mapped[1][a->map[j]] = true; }
    }
    if (good) {
        list_alone(source, used[0], mapped[0], a->shrinks);
        list_alone(target, used[1], mapped[1], a->grows);
        skeleton_fit_bones(source, target, a->map, a->bones);
    }
    for (int j = 0; good && j < target->joint_count; ++j) {
        int up = target->joints[j].parent;
        while (up >= 0 && !(mapped[1][up] && target->joints[up].bone)) { up = target->joints[up].parent; }
        a->bone_above[j] = mapped[1][j] && target->joints[j].bone ? up : -1;
    }
    for (int k = 0; k < 2; ++k) {
        free(used[k]);
        free(mapped[k]);
    }
    return good;
}

bool skeleton_align(const struct character *source, const struct character *target, const char *file, struct alignment *a,
                    char error[CHARACTER_TEXT])
{
    const size_t ours = (size_t)source->joint_count + 1, theirs = (size_t)target->joint_count + 1;
    memset(a, 0, sizeof *a);
    a->map = malloc(ours * sizeof *a->map);
    a->bones = malloc(ours * sizeof *a->bones);
    a->shrinks = malloc(ours * sizeof *a->shrinks);
    a->grows = malloc(theirs * sizeof *a->grows);
    a->bone_above = malloc(theirs * sizeof *a->bone_above);
    snprintf(error, CHARACTER_TEXT, "not enough memory");
    bool good = a->map && a->bones && a->shrinks && a->grows && a->bone_above;
    for (int i = 0; good && i < source->joint_count; ++i) { a->map[i] = -1; }
    if (good && file) {
        a->how = "file";
        a->pairs = map_by_file(source, target, file, a->map, error);
        good = a->pairs > 0 && complete(source, target, a);
    } else if (good && pair_names(source, target, a)) {
        a->how = "names";
        good = complete(source, target, a);
    } else if (good) {
        a->how = "limbs";
        good = pair_limbs(source, target, a);
    }
    if (!good) { alignment_free(a); }
    return good;
}

void alignment_free(struct alignment *a)
{
    free(a->map);
    free(a->bones);
    free(a->shrinks);
    free(a->grows);
    free(a->bone_above);
    memset(a, 0, sizeof *a);
}

/* Adds to each vertex's pull the way to the first joint of limbs that only one character has. bones: NULL, or the maps that the
 * surface has been moved by. */
static void add_pulls(const struct character *c, const int *alone, const struct affine *bones, float *pulls)
{
    for (int v = 0; v < c->vertex_count; ++v) {
        const struct influences *in = &c->influences[v];
        memset(pulls + 3 * v, 0, 3 * sizeof *pulls);
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            const int root = in->weight[k] > 0.0f ? alone[in->joint[k]] : -1;
            if (root >= 0) {
                float place[3];
                joint_place(&c->joints[root], place);
                if (bones) { affine_apply(&bones[root], place, place); }
                vec3_sub(place, c->positions + 3 * v, place);
                vec3_add_scaled(pulls + 3 * v, in->weight[k], place, pulls + 3 * v);
            }
        }
    }
}

void skeleton_rescale(struct character *source, const struct character *target, const struct alignment *a, float *shrink,
                      float *grow)
{
    character_skin(source, a->bones, source->positions);
    add_pulls(source, a->shrinks, a->bones, shrink);
    add_pulls(target, a->grows, NULL, grow);
    for (int v = 0; v < source->vertex_count; ++v) {
        const struct influences old = source->influences[v];
        struct influences *now = &source->influences[v];
        memset(now, 0, sizeof *now);
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            if (old.weight[k] > 0.0f) {
                const int up = a->map[old.joint[k]] >= 0 ? old.joint[k] : mapped_above(source, a->map, old.joint[k]);
                influences_add(now, up >= 0 ? a->map[up] : first_bone(target), old.weight[k]);
            }
        }
        influences_normalize(now, first_bone(target));
    }
}
