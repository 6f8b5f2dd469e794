/* rods.c - the middles of limbs, by which none falls apart in a pose or half way between two bodies.
 *
 * Along each bone that both characters have go places in the middle of the source's limb and of the target's, found once, in the
 * neutral pose, with what a ball there may have for its radius. In a frame they are posed as the bone is, and mixed; balls around
 * them and all between are united with the frame's shape. Of limbs that only the target has, the target's middles grow. */
#include "morph/morph.h"

#include "base/vec3.h"
#include "character/solid_handles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define THIN 0.87f     /* voxels: radius of a rod along a bone at least: half a voxel's diagonal, so that voxels all along it are inside */
#define THICK 1.5f     /* voxels: radius of a rod at most; thin_places.h leaves no limb thinner */
#define NEARBY 3.0f    /* voxels: what is inside within this distance has its middle taken */
#define SECTION 0.87f  /* voxels: half the thickness of a cross-section, so that each has voxels all over it */
#define WITHIN 0.5f    /* voxel: limbs are compared in thickness where their middles are so deep: not beyond their tips */
#define STEP 1.0f      /* voxels along a bone from place to place */
#define CLEARANCE 0.9f /* voxels: up to where a rod changes the shape around it */
#define FADE 5.0f      /* rods at joints are thinner from 1 - 1 / FADE of the way to the target on, and gone there */

enum { CENTERINGS = 6, AROUND = 7 * 7 * 7 + 1 }; /* AROUND: more voxels than a cube of twice NEARBY has, one room to try the next */

static bool add_place(struct rods *rods, const struct rod_place *place)
{
    if (rods->place_count == rods->place_room) {
        const int room = rods->place_room > 0 ? 2 * rods->place_room : 256;
        struct rod_place *places = realloc(rods->places, (size_t)room * sizeof *places);
        if (!places) { return false; }
        rods->places = places;
        rods->place_room = room;
    }
    rods->places[rods->place_count++] = *place;
    return true;
}

/* A voxel around a place, and phi there. */
struct voxel_around {
    float way[3]; /* from the place to it, voxels */
    float phi;
};

/* Lists the voxels within NEARBY of a place, but for the border of the grid. Returns how many they are. */
static int list_around(const int size[3], const float *phi, const float place[3], struct voxel_around list[AROUND])
{
    int lo[3], hi[3], count = 0;
    for (int k = 0; k < 3; ++k) {
        lo[k] = (int)fmaxf(1.0f, ceilf(place[k] - NEARBY));
        hi[k] = (int)fminf((float)size[k] - 2.0f, floorf(place[k] + NEARBY));
    }
    for (int z = lo[2]; z <= hi[2]; ++z) {
        for (int y = lo[1]; y <= hi[1]; ++y) {
            for (int x = lo[0]; x <= hi[0]; ++x) {
                const float p[3] = {(float)x, (float)y, (float)z};
                struct voxel_around *voxel = &list[count];
                vec3_sub(p, place, voxel->way);
                voxel->phi = phi[((size_t)z * (size_t)size[1] + (size_t)y) * (size_t)size[0] + (size_t)x];
                count += vec3_dot(voxel->way, voxel->way) <= NEARBY * NEARBY;
            }
        }
    }
    return count;
}

/* Moves a place, in voxels, to the mean of what is inside around it; along: not in this direction, NULL: in all. Returns the
 * radius of a rod there: 0 where the body is not near. */
static float center(const int size[3], const float *phi, const float along[3], float place[3])
{
    struct voxel_around around[AROUND];
    for (int round = 0; round < CENTERINGS; ++round) {
        const int count = list_around(size, phi, place, around);
        float move[3] = {0.0f, 0.0f, 0.0f};
        int inside = 0;
        for (int n = 0; n < count; ++n) {
            if (around[n].phi >= 0.0f) { continue; }
            vec3_add_scaled(move, 1.0f, around[n].way, move);
            ++inside;
        }
        if (inside == 0) { return 0.0f; }
        for (int k = 0; k < 3; ++k) { move[k] /= (float)inside; }
        if (along) { vec3_add_scaled(move, -vec3_dot(move, along), along, move); }
        vec3_add_scaled(place, 1.0f, move, place);
    }
    return fmaxf(0.0f, fminf(THICK, -morph_sample(size, phi, place)));
}

/* Returns how deep a limb's cross-section is around a place in its middle, and across a direction: the largest depth of its voxels. */
static float depth_across(const int size[3], const float *phi, const float place[3], const float along[3])
{
    struct voxel_around around[AROUND];
    const int count = list_around(size, phi, place, around);
    float depth = 0.0f;
    for (int n = 0; n < count; ++n) {
        if (fabsf(vec3_dot(around[n].way, along)) <= SECTION) { depth = fmaxf(depth, -around[n].phi); }
    }
    return depth;
}

/* Finds the middles of both bodies near a place of the neutral pose. */
static void find_middles(const struct morph *morph, const float *const phi[2], const float place[3], const float along[3],
                         struct rod_place *found)
{
    for (int b = 0; b < 2; ++b) {
        morph_to_voxel(&morph->grid, place, found->middle[b]);
        found->radius[b] = center(morph->grid.size, phi[b], along, found->middle[b]);
        if (along && found->radius[b] >= WITHIN) { found->depth[b] = depth_across(morph->grid.size, phi[b], found->middle[b], along); }
    }
}

/* Adds the places of one bone, from a joint to one below it, and the ways between them. */
static bool add_bone(struct morph *morph, const float *const phi[2], int from, int to, int root)
{
    struct rods *rods = &morph->rods;
    const struct joint *joints = morph->target.character.joints;
    float ends[2][3], way[3], along[3];
    joint_place(&joints[from], ends[0]);
    joint_place(&joints[to], ends[1]);
    vec3_sub(ends[1], ends[0], way);
    memcpy(along, way, sizeof along);
    const float length = vec3_normalize(along) / (float)morph->grid.spacing[0];
    const int steps = (int)fmaxf(1.0f, ceilf(length / STEP));
    bool good = true;
    for (int s = 1; good && s <= steps; ++s) {
        struct rod_place place;
        float at[3];
        memset(&place, 0, sizeof place);
        place.joint = from;
        place.root = root;
        place.before = s == 1 ? from : rods->place_count - 1;
        if (s < steps) {
            vec3_add_scaled(ends[0], (float)s / (float)steps, way, at);
            find_middles(morph, phi, at, along, &place);
        } else { /* the joint's own place, which is there already */
            place = rods->places[to]; /* without a depth */
            place.joint = to;
            place.root = root;
            place.before = steps == 1 ? from : rods->place_count - 1;
        }
        good = add_place(rods, &place);
    }
    return good;
}

static bool make_rods(struct morph *morph, const float *const phi[2])
{
    const struct character *target = &morph->target.character;
    bool good = true;
    for (int j = 0; good && j < target->joint_count; ++j) { /* place j is joint j's */
        struct rod_place place;
        float at[3];
        memset(&place, 0, sizeof place);
        place.joint = j;
        place.before = place.root = -1;
        joint_place(&target->joints[j], at);
        find_middles(morph, phi, at, NULL, &place);
        good = add_place(&morph->rods, &place);
    }
    for (int j = 0; good && j < target->joint_count; ++j) {
        const int root = morph->alignment.grows[j], above = morph->alignment.bone_above[j];
        if (root >= 0) {
            good = j == root || add_bone(morph, phi, target->joints[j].parent, j, root);
        } else if (above >= 0) {
            for (int at = j; good && at != above && at >= 0; at = target->joints[at].parent) {
                good = target->joints[at].parent < 0 || add_bone(morph, phi, target->joints[at].parent, at, -1);
            }
        }
    }
    return good;
}

bool morph_make_rods(struct morph *morph)
{
    const size_t count = morph_voxel_count(morph);
    float *phi[2] = {malloc(count * sizeof **phi), malloc(count * sizeof **phi)};
    const bool good = ((phi[0] && phi[1]) || morph_no_memory())
        && morph_check(morph->ctx, springls_copy_level_set(morph->ctx, phi[0]), "level set")
        && morph_check(morph->other, springls_copy_level_set(morph->other, phi[1]), "level set")
        && (make_rods(morph, (const float *const *)phi) || morph_no_memory());
    free(phi[0]);
    free(phi[1]);
    return good;
}

void morph_add_rod(const int size[3], float *phi, const float from[3], const float to[3], float radius, float radius_to)
{
    const float most = fmaxf(radius, radius_to);
    float axis[3];
    int lo[3], hi[3];
    vec3_sub(to, from, axis);
    const float square = vec3_dot(axis, axis);
    for (int k = 0; k < 3; ++k) {
        lo[k] = (int)fmaxf(1.0f, floorf(fminf(from[k], to[k]) - most - CLEARANCE));
        hi[k] = (int)fminf((float)size[k] - 2.0f, ceilf(fmaxf(from[k], to[k]) + most + CLEARANCE));
    }
    for (int z = lo[2]; z <= hi[2]; ++z) {
        for (int y = lo[1]; y <= hi[1]; ++y) {
            for (int x = lo[0]; x <= hi[0]; ++x) {
                const float p[3] = {(float)x, (float)y, (float)z};
                float d[3];
                vec3_sub(p, from, d);
                const float part = square > 0.0f ? fmaxf(0.0f, fminf(1.0f, vec3_dot(d, axis) / square)) : 0.0f;
                vec3_add_scaled(d, -part, axis, d);
                float *here = phi + ((size_t)z * (size_t)size[1] + (size_t)y) * (size_t)size[0] + (size_t)x;
                *here = fminf(*here, vec3_length(d) - radius - part * (radius_to - radius));
            }
        }
    }
}

/* Poses a place of a rod: returns its radius. */
static float pose_place(const struct morph *morph, const struct rod_place *place, float part, float posed[3])
{
    const float share = place->root >= 0 ? 1.0f : part;
    float middle[3], voxel[3];
    for (int k = 0; k < 3; ++k) {
        voxel[k] = (1.0f - share) * place->middle[0][k] + share * place->middle[1][k];
        middle[k] = (float)(morph->grid.origin[k] + morph->grid.spacing[k] * (double)voxel[k]);
    }
    if (place->root >= 0) {
        float way[3];
        joint_place(&morph->target.character.joints[place->root], way);
        vec3_sub(way, middle, way);
        vec3_add_scaled(middle, 1.0f - part, way, middle);
    }
    affine_apply(&morph->skin[place->joint], middle, posed);
    morph_to_voxel(&morph->grid, posed, posed);
    return (1.0f - share) * place->radius[0] + share * place->radius[1];
}

/* Poses the ends of the rod that ends at a place. Returns false where none does, or either end is not in the body. */
static bool pose_rod(const struct morph *morph, const struct rod_place *to, float part, float ends[2][3], float radii[2])
{
    if (to->before < 0) { return false; }
    struct rod_place from = morph->rods.places[to->before];
    from.root = to->root; /* a limb that grows begins at a joint that others share */
    radii[0] = pose_place(morph, &from, part, ends[0]);
    radii[1] = pose_place(morph, to, part, ends[1]);
    return from.radius[0] + from.radius[1] > 0.0f && to->radius[0] + to->radius[1] > 0.0f;
}

/* Finds whether a rod goes along a limb's bone. At a joint the middle is taken in all directions, and the bones beside it move the
 * body away from it; a joint that moves nothing is a handle for artists. */
static bool is_along_bone(const struct morph *morph, const struct rod_place *to)
{
    const struct character *target = &morph->target.character;
    return morph->rods.places[to->before].joint == to->joint && target->joints[to->joint].bone;
}

void morph_add_rods(const struct morph *morph, float part, float *phi)
{
    for (int n = 0; n < morph->rods.place_count; ++n) {
        float ends[2][3], radii[2];
        if (!pose_rod(morph, &morph->rods.places[n], part, ends, radii)) { continue; }
        const bool along = is_along_bone(morph, &morph->rods.places[n]);
        for (int k = 0; along && k < 2; ++k) { radii[k] = radii[k] > 0.0f ? fmaxf(radii[k], THIN) : 0.0f; }
        const float left = along ? 1.0f : fminf(1.0f, FADE * (1.0f - part));
        if (left * radii[0] > 0.0f && left * radii[1] > 0.0f) {
            morph_add_rod(morph->grid.size, phi, ends[0], ends[1], left * radii[0], left * radii[1]);
        }
    }
}

void morph_mark_limbs(struct morph *morph, float part)
{
    const struct solid_grid grid = morph_voxels(&morph->grid);
    memset(morph->limbs, 0, morph_voxel_count(morph));
    for (int n = 0; n < morph->rods.place_count; ++n) {
        float ends[2][3], radii[2];
        if (pose_rod(morph, &morph->rods.places[n], part, ends, radii)) { solid_mark_way(&grid, ends[0], ends[1], morph->limbs); }
    }
}

float morph_thinnest_limb(const struct morph *morph, float part, const float *model, int *joint)
{
    float thinnest = 1.0f;
    *joint = -1;
    for (int n = 0; n < morph->rods.place_count; ++n) {
        const struct rod_place *place = &morph->rods.places[n];
        const float thinner = fminf(place->depth[0], place->depth[1]);
        const bool moves = morph->target.character.joints[place->joint].bone; /* else it is a handle for artists, and no limb's bone */
        float ends[2][3], radii[2], along[3];
        if (!moves || place->root >= 0 || thinner <= 0.0f || !pose_rod(morph, place, part, ends, radii)) { continue; }
        vec3_sub(ends[1], ends[0], along);
        vec3_normalize(along);
        const float share = depth_across(morph->grid.size, model, ends[1], along) / thinner;
        if (share < thinnest) {
            thinnest = share;
            *joint = place->joint;
        }
    }
    return thinnest;
}
