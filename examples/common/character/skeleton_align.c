#include "character/skeleton_align.h"

#include "base/vec3.h"
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

static int map_by_names(const struct character *source, const bool *source_used, const struct character *target,
                        const bool *target_used, int *map)
{
    int pairs = 0;
    for (int i = 0; i < source->joint_count; ++i) {
        map[i] = -1;
        for (int j = 0; map[i] < 0 && source_used[i] && j < target->joint_count; ++j) {
            if (target_used[j] && same_name(source->joints[i].name, target->joints[j].name)) {
                map[i] = j;
                ++pairs;
            }
        }
    }
    return pairs;
}

/* Computes the mean direction of the joints below a joint. */
static void branch_direction(const struct character *character, int joint, float direction[3])
{
    float origin[3], place[3];
    joint_place(&character->joints[joint], origin);
    memset(direction, 0, 3 * sizeof *direction);
    for (int j = joint; j < character->joint_count; ++j) {
        for (int up = j; up >= joint; up = character->joints[up].parent) {
            if (up == joint) {
                joint_place(&character->joints[j], place);
                vec3_sub(place, origin, place);
                vec3_add_scaled(direction, 1.0f, place, direction);
                break;
            }
        }
    }
}

/* Computes the direction from a joint to the middle of a child's branch. */
static void child_direction(const struct character *character, int joint, int child, float direction[3])
{
    float from[3], to[3], branch[3];
    joint_place(&character->joints[joint], from);
    joint_place(&character->joints[child], to);
    branch_direction(character, child, branch);
    vec3_sub(to, from, direction);
    vec3_add_scaled(direction, 0.1f, branch, direction);
    vec3_normalize(direction);
}

static int map_branches(const struct character *source, const bool *source_used, const struct character *target,
                        const bool *target_used, int i, int j, int *map)
{
    int pairs = 1;
    map[i] = j;
    for (;;) { /* pair the best two children that are still unpaired */
        int best_i = -1, best_j = -1;
        float best = -2.0f;
        for (int a = i + 1; a < source->joint_count; ++a) {
            if (source->joints[a].parent != i || !source_used[a] || map[a] >= 0) {
                continue;
            }
            for (int b = j + 1; b < target->joint_count; ++b) {
                bool alone = target->joints[b].parent == j && target_used[b];
                for (int other = 0; alone && other < source->joint_count; ++other) {
                    alone = map[other] != b;
                }
                if (alone) {
                    float u[3], v[3];
                    child_direction(source, i, a, u);
                    child_direction(target, j, b, v);
                    if (vec3_dot(u, v) > best) {
                        best = vec3_dot(u, v), best_i = a, best_j = b;
                    }
                }
            }
        }
        if (best_i < 0) {
            return pairs;
        }
        pairs += map_branches(source, source_used, target, target_used, best_i, best_j, map);
    }
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

/* Returns the bone with the most bones below it: the first bone may belong to a helper chain, as for feet. */
static int trunk(const struct character *character)
{
    int best = -1, best_below = -1;
    for (int j = 0; j < character->joint_count; ++j) {
        int below = 0;
        for (int k = j + 1; character->joints[j].bone && k < character->joint_count; ++k) {
            int up = k;
            while (up > j) {
                up = character->joints[up].parent;
            }
            below += up == j && character->joints[k].bone;
        }
        if (character->joints[j].bone && below > best_below) {
            best_below = below;
            best = j;
        }
    }
    return best;
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

int skeleton_map(const struct character *source, const struct character *target, const char *file, int *map, const char **how,
                 char error[CHARACTER_TEXT])
{
    bool *source_used = used_joints(source), *target_used = used_joints(target);
    const int ours = count_true(source_used, source->joint_count), theirs = count_true(target_used, target->joint_count);
    int pairs = 0;
    snprintf(error, CHARACTER_TEXT, "not enough memory");
    for (int i = 0; i < source->joint_count; ++i) {
        map[i] = -1;
    }
    *how = "file";
    if (file) {
        pairs = map_by_file(source, target, file, map, error);
    } else if (source_used && target_used) {
        *how = "names";
        pairs = map_by_names(source, source_used, target, target_used, map);
        if (2 * pairs < (ours < theirs ? ours : theirs)) {
            const int i = trunk(source), j = trunk(target);
            *how = "hierarchy";
            for (int k = 0; k < source->joint_count; ++k) {
                map[k] = -1;
            }
            pairs = i >= 0 && j >= 0 ? map_branches(source, source_used, target, target_used, i, j, map) : 0;
            snprintf(error, CHARACTER_TEXT, "the skeletons have nothing in common");
        }
    }
    free(source_used);
    free(target_used);
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

bool skeleton_rescale(struct character *source, const struct character *target, const int *map)
{
    struct affine *bones = malloc(((size_t)source->joint_count + 1) * sizeof *bones);
    if (!bones) {
        return false;
    }
    skeleton_fit_bones(source, target, map, bones);
    character_skin(source, bones, source->positions);
    for (int v = 0; v < source->vertex_count; ++v) {
        const struct influences old = source->influences[v];
        struct influences *now = &source->influences[v];
        memset(now, 0, sizeof *now);
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            if (old.weight[k] > 0.0f) {
                const int up = map[old.joint[k]] >= 0 ? old.joint[k] : mapped_above(source, map, old.joint[k]);
                influences_add(now, up >= 0 ? map[up] : first_bone(target), old.weight[k]);
            }
        }
        influences_normalize(now, first_bone(target));
    }
    free(bones);
    return true;
}
