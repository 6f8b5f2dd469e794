/* Skeletons of examples/morph: skinning against matrices made by hand, the force that carries springls from pose to pose, rigs
 * brought together joint by joint, and clips that move another body. Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_morph_skeletons_built_without_their_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_morph_skeletons_built_without_their_libraries);
    GREATEST_MAIN_END();
}

#else

/* Its inner functions are called here. */
#include "../../examples/morph/skinning.c"

#include "character/clip_transfer.h"

#include "morph_fixtures.h"

/* ---- poses ---- */

TEST placements_and_matrices_are_each_others_inverse(void)
{
    struct placement p = {{1, -2, 3}, {0.5, -0.5, 0.5, 0.5}, {2, 0.5, 3}}, half;
    const struct affine a = placement_matrix(&p), back = affine_inverse(&a), one = affine_after(&a, &back);
    const struct placement again = placement_of(&a);
    for (int i = 0; i < 12; ++i) ASSERT_NEAR(affine_identity().m[i], one.m[i], 1e-12);
    for (int i = 0; i < 3; ++i) {
        ASSERT_NEAR(p.translation[i], again.translation[i], 1e-12);
        ASSERT_NEAR(p.scale[i], again.scale[i], 1e-12);
    }
    for (int i = 0; i < 4; ++i) ASSERT_NEAR(p.rotation[i], again.rotation[i], 1e-12);
    ASSERT_NEAR(3.0, affine_determinant(&a), 1e-12);
    const double still[4] = {1, 0, 0, 0}, quarter[4] = {0.70710678118654752, 0, 0, -0.70710678118654752};
    quaternion_slerp(still, quarter, 0.5, half.rotation);
    ASSERT_NEAR(cos(3.14159265358979 / 8), half.rotation[0], 1e-9);
    ASSERT_NEAR(-sin(3.14159265358979 / 8), half.rotation[3], 1e-9);
    PASS();
}

TEST skinning_is_the_weighted_sum_of_matrices(void)
{
    const struct character c = by_hand();
    struct affine skin[2], places[2];
    float posed[9];
    character_pose(&c, 0, 1.0, 1.0, skin, places); /* the upper bone lies along -x now */
    character_skin(&c, skin, posed);
    const float expected[9] = {-1, 1, 0, -0.5f, 1.5f, 0, 0.5f, 1, 0};
    for (int i = 0; i < 9; ++i) ASSERT_NEAR(expected[i], posed[i], 1e-6);
    ASSERT_NEAR(1.0, places[1].m[7], 1e-12);
    character_pose(&c, 0, 0.5, 1.0, skin, places); /* half way between two keys: an eighth of a turn */
    character_skin(&c, skin, posed);
    ASSERT_NEAR(-0.70710678, posed[0], 1e-6);
    ASSERT_NEAR(1.70710678, posed[1], 1e-6);
    character_pose(&c, 0, 1.0, 0.5, skin, places); /* half way from the neutral pose: the same */
    character_skin(&c, skin, posed);
    ASSERT_NEAR(-0.70710678, posed[0], 1e-6);
    character_pose(&c, -1, 1.0, 1.0, skin, places);
    character_skin(&c, skin, posed);
    for (int i = 0; i < 9; ++i) ASSERT_NEAR(hand_positions[i], posed[i], 1e-6);
    PASS();
}

/* The force that springls get takes a point from one pose to the next exactly as skinning from the neutral pose would, in one of
 * Euler's steps and in two. */
TEST the_affine_force_goes_from_pose_to_pose(void)
{
    const struct character c = by_hand();
    struct affine before[2], after[2], places[2];
    character_pose(&c, 0, 0.3, 1.0, before, places);
    character_pose(&c, 0, 0.9, 1.0, after, places);
    const struct skinning s = {NULL, before, after, 5.0f, 0.0f};
    const struct affine from = influences_blend(&hand_influences[1], before), to = influences_blend(&hand_influences[1], after);
    const springls_grid_desc grid = {.size = {32, 32, 32}, .spacing = {0.25, 0.25, 0.25}, .origin = {-3, -1, 2}};
    const float x[3] = {0.1f, 1.7f, 0.4f};
    float start[3], end[3];
    affine_apply(&from, x, start);
    affine_apply(&to, x, end);
    for (int steps = 1; steps <= 2; ++steps) {
        float voxel[3];
        morph_to_voxel(&grid, start, voxel);
        for (int n = 0; n < steps; ++n) {
            const struct affine m = motion(&s, 5.0f + (float)n / (float)steps, &hand_influences[1], NULL);
            float out[12], moved[3];
            to_velocity(&grid, &m, out);
            for (int i = 0; i < 3; ++i) {
                moved[i] = out[4 * i] * voxel[0] + out[4 * i + 1] * voxel[1] + out[4 * i + 2] * voxel[2] + out[4 * i + 3];
            }
            for (int i = 0; i < 3; ++i) voxel[i] += moved[i] / (float)steps;
        }
        for (int i = 0; i < 3; ++i) ASSERT_NEAR(((double)end[i] - grid.origin[i]) / grid.spacing[i], voxel[i], 1e-4);
    }
    PASS();
}

TEST weights_sum_to_one(void)
{
    char error[CHARACTER_TEXT];
    struct influences in;
    memset(&in, 0, sizeof in);
    for (int j = 0; j < 20; ++j)
        influences_add(&in, j, 0.1f + 0.01f * (float)j); /* more bones than there is room for: the heaviest stay */
    for (int k = 0; k < CHARACTER_BONES; ++k) ASSERT(in.joint[k] >= 20 - CHARACTER_BONES);
    influences_normalize(&in, 0);
    float sum = 0.0f;
    for (int k = 0; k < CHARACTER_BONES; ++k) sum += in.weight[k];
    ASSERT_NEAR(1.0, sum, 1e-6);
    memset(&in, 0, sizeof in);
    ASSERT_EQ(0.0f, influences_normalize(&in, 3));
    ASSERT_EQ(3, in.joint[0]);
    for (int number = 0; number < 2; ++number) {
        struct character c;
        struct places places;
        ASSERT(character_build(number, &c, error));
        ASSERT(places_create(&c, &places));
        for (int v = 0; v < c.vertex_count; v += 7) {
            struct place place;
            const float distance = places_find(&places, c.positions + 3 * v, &place);
            const struct influences at = place_influences(&c, &place);
            sum = 0.0f;
            for (int k = 0; k < CHARACTER_BONES; ++k) sum += at.weight[k];
            ASSERT_NEAR(0.0, distance, 1e-5);
            ASSERT_NEAR(1.0, sum, 1e-5);
        }
        places_free(&places);
        character_free(&c);
    }
    PASS();
}

/* ---- skeletons ---- */

TEST alignment_makes_joints_coincide(void)
{
    struct character source, target;
    char error[CHARACTER_TEXT];
    struct alignment a;
    ASSERT(character_build(0, &source, error) && character_build(1, &target, error));
    ASSERT(skeleton_align(&source, &target, NULL, &a, error));
    ASSERT_EQ(15, a.pairs);
    ASSERT_STR_EQ("names", a.how);
    for (int i = 0; i < source.joint_count; ++i) {
        float from[3], to[3], moved[3];
        joint_place(&source.joints[i], from);
        joint_place(&target.joints[a.map[i]], to);
        affine_apply(&a.bones[i], from, moved);
        for (int k = 0; k < 3; ++k) ASSERT_NEAR(to[k], moved[k], 1e-5);
        ASSERT_EQ(-1, a.shrinks[i]);
        if (strcmp(source.joints[i].name, "forearm.l") == 0) { /* one joint beyond: the bone's other end coincides too */
            const int hand = character_joint(&source, "hand.l");
            joint_place(&source.joints[hand], from);
            joint_place(&target.joints[a.map[hand]], to);
            affine_apply(&a.bones[i], from, moved);
            for (int k = 0; k < 3; ++k) ASSERT_NEAR(to[k], moved[k], 1e-5);
        }
    }
    for (int j = 0; j < target.joint_count; ++j) { /* tail and horns grow from their first joints */
        const int tail = character_joint(&target, "tail");
        ASSERT_EQ(j < 15 ? -1 : j == tail + 1 ? tail : j, a.grows[j]);
    }
    float *shrink = malloc(3 * (size_t)source.vertex_count * sizeof *shrink),
          *grow = malloc(3 * (size_t)target.vertex_count * sizeof *grow);
    skeleton_rescale(&source, &target, &a, shrink, grow);
    for (int v = 0; v < source.vertex_count; ++v) {
        for (int k = 0; k < CHARACTER_BONES; ++k)
            ASSERT(source.influences[v].joint[k] >= 0 && source.influences[v].joint[k] < target.joint_count);
        for (int k = 0; k < 3; ++k) ASSERT_EQ(0.0f, shrink[3 * v + k]);
    }
    free(shrink);
    free(grow);
    alignment_free(&a);
    character_free(&source);
    character_free(&target);
    PASS();
}

/* joints without a name are numbered as in their file: numbers are names only where the skeletons are the same. */
TEST numbers_are_names_of_the_same_skeleton_only(void)
{
    struct character source, target;
    char error[CHARACTER_TEXT];
    struct alignment a;
    ASSERT(character_build(1, &source, error) && character_build(1, &target, error));
    for (int j = 0; j < source.joint_count; ++j) {
        snprintf(source.joints[j].name, CHARACTER_NAME, "nodes[%d]", j);
        snprintf(target.joints[j].name, CHARACTER_NAME, "nodes[%d]", j);
    }
    ASSERT(skeleton_align(&source, &target, NULL, &a, error));
    ASSERT_STR_EQ("names", a.how);
    for (int j = 0; j < source.joint_count; ++j) ASSERT_EQ(j, a.map[j]);
    alignment_free(&a);
    snprintf(target.joints[0].name, CHARACTER_NAME, "root");
    ASSERT(skeleton_align(&source, &target, NULL, &a, error));
    ASSERT_STR_EQ("limbs", a.how);
    alignment_free(&a);
    character_free(&source);
    character_free(&target);
    PASS();
}

TEST joints_are_paired_by_file(void)
{
    struct character source, target;
    char error[CHARACTER_TEXT];
    struct alignment a;
    ASSERT(character_build(0, &source, error) && character_build(1, &target, error));
    FILE *file = fopen(scratch("map.txt"), "w");
    fputs("# arms are legs\narm.l leg.l   # remark\n\nhips hips\n", file);
    fclose(file);
    ASSERT(skeleton_align(&source, &target, scratch("map.txt"), &a, error));
    ASSERT_EQ(2, a.pairs);
    ASSERT_EQ(character_joint(&target, "leg.l"), a.map[character_joint(&source, "arm.l")]);
    ASSERT_EQ(-1, a.map[character_joint(&source, "head")]);
    alignment_free(&a);
    file = fopen(scratch("wrong.txt"), "w");
    fputs("hips hips\narm.l nothing\n", file);
    fclose(file);
    ASSERT(!skeleton_align(&source, &target, scratch("wrong.txt"), &a, error));
    ASSERT(strstr(error, "line 2") && strstr(error, "nothing"));
    ASSERT(!skeleton_align(&source, &target, scratch("absent.txt"), &a, error));
    character_free(&source);
    character_free(&target);
    PASS();
}

/* Limb by limb: left with left whichever way the two face, with other numbers of joints, and without a tail on one side. */
TEST joints_of_different_rigs_are_paired_limb_by_limb(void)
{
    for (int turn = 0; turn < 4; ++turn) {
        struct character source, target;
        char error[CHARACTER_TEXT];
        struct alignment a;
        ASSERT(character_build(turn % 2, &source, error) && character_build(1 - turn % 2, &target, error));
        const int hand = character_joint(&source, "hand.l"), tail = character_joint(turn % 2 ? &source : &target, "tail");
        change_rig(&source, "hand", 40.0, 1.5707963 * turn);
        change_rig(&target, "foot", 0.1, 0.3);
        ASSERT(skeleton_align(&source, &target, NULL, &a, error));
        ASSERT_STR_EQ("limbs", a.how);
        for (int j = 0; j < 15; ++j) { /* the joints that both bodies have, numbered alike */
            const char *const message = source.joints[j].name;
            const bool hands = j == hand || j == character_joint(&source, "i92"), feet = j == 11 || j == 14;
            float from[3], to[3], moved[3], off[3];
            if (hands) {
                ASSERT_EQm(message, -1, a.map[j]);
                continue;
            }
            ASSERT_EQm(message, feet ? j - 1 : j, a.map[j]);
            joint_place(&source.joints[j], from);
            joint_place(&target.joints[j], to);
            affine_apply(&a.bones[j], from, moved);
            vec3_sub(moved, to, off);
            ASSERTm(message, vec3_length(off) < 0.1f * 0.25f); /* a seventh of the height: hips and chests differ */
        }
        const int *alone = turn % 2 ? a.shrinks : a.grows, *other = turn % 2 ? a.grows : a.shrinks;
        ASSERT(alone[tail] == tail && alone[tail + 1] == tail);
        ASSERT(alone[tail + 2] == tail + 2 && alone[tail + 3] == tail + 3); /* horns */
        for (int j = 0; j < 15; ++j) { /* hands and feet have no bones */
            ASSERT_EQ(-1, (turn % 2 ? source : target).joints[j].bone ? alone[j] : -1);
            ASSERT_EQ(-1, (turn % 2 ? target : source).joints[j].bone ? other[j] : -1);
        }
        alignment_free(&a);
        character_free(&source);
        character_free(&target);
    }
    PASS();
}

/* Moves a joint to a share of the way from the one above it to one below. */
static void move_joint(struct character *c, int joint, int below, double share)
{
    const double *above = c->joints[c->joints[joint].parent].neutral.m, *end = c->joints[below].neutral.m;
    for (int i = 3; i < 12; i += 4) c->joints[joint].neutral.m[i] = above[i] + share * (end[i] - above[i]);
}

/* Wherever elbows are, and one higher than the other: a joint of the left arm is paired as that of the right arm is. */
TEST both_sides_are_paired_alike(void)
{
    int elbows = 0;
    for (int step = 1; step < 20; ++step) {
        struct character source, target;
        char error[CHARACTER_TEXT];
        struct alignment a;
        ASSERT(character_build(0, &source, error) && character_build(0, &target, error));
        const int left = character_joint(&source, "forearm.l"), right = character_joint(&source, "forearm.r");
        const int hands[2] = {character_joint(&source, "hand.l"), character_joint(&source, "hand.r")};
        move_joint(&source, left, hands[0], 0.05 * step - 0.02);
        move_joint(&source, right, hands[1], 0.05 * step + 0.02);
        change_rig(&target, "foot", 0.1, 0.3);
        ASSERT(skeleton_align(&source, &target, NULL, &a, error));
        ASSERT_STR_EQ("limbs", a.how);
        ASSERT_EQ(a.map[left] == left, a.map[right] == right); /* numbered alike in both */
        elbows += a.map[left] == left;
        alignment_free(&a);
        character_free(&source);
        character_free(&target);
    }
    ASSERT(elbows > 0 && elbows < 19);
    PASS();
}

/* Computes the direction from one joint to another at a time of a clip. */
static void limb_direction(const struct character *c, int clip, double time, const char *from, const char *to, float out[3])
{
    struct affine skin[64], places[64];
    character_pose(c, clip, time, 1.0, skin, places);
    for (int i = 0; i < 3; ++i)
        out[i] = (float)(places[character_joint(c, to)].m[4 * i + 3] - places[character_joint(c, from)].m[4 * i + 3]);
    vec3_normalize(out);
}

TEST clips_move_the_other_body(void)
{
    static const char *const limbs[][2] = {
        {"leg.l", "shin.l"}, {"shin.r", "foot.r"}, {"arm.l", "forearm.l"}, {"forearm.r", "hand.r"}};
    struct character source, target;
    char error[CHARACTER_TEXT];
    struct alignment alignment;
    struct animation *clips;
    int count;
    ASSERT(character_build(0, &source, error) && character_build(1, &target, error));
    ASSERT(skeleton_align(&source, &target, NULL, &alignment, error));
    ASSERT(clips_transfer(&source, &alignment, &target, 24, &clips, &count)); /* another pose of the arms, so not the same */
    ASSERT_EQ(1, count);
    ASSERT_STR_EQ("walk (source)", clips[0].name);
    struct character moved = target;
    moved.animations = clips;
    for (int n = 0; n < 6; ++n) {
        for (int l = 0; l < 4; ++l) {
            float theirs[3], ours[3];
            const double time = 1.2 * n / 6.0;
            limb_direction(&source, 0, time, limbs[l][0], limbs[l][1], theirs);
            limb_direction(&moved, 0, time, limbs[l][0], limbs[l][1], ours);
            ASSERTm(limbs[l][0], vec3_dot(theirs, ours) > 0.99f);
        }
    }
    /* The clip once more, which that body has now: left out. */
    struct animation *again;
    int more;
    snprintf(clips[0].name, sizeof clips[0].name, "walk");
    ASSERT(clips_transfer(&source, &alignment, &moved, 24, &again, &more));
    ASSERT_EQ(0, more);
    clips_free(again, more);
    clips_free(clips, count);
    alignment_free(&alignment);
    character_free(&source);
    character_free(&target);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(placements_and_matrices_are_each_others_inverse);
    RUN_TEST(skinning_is_the_weighted_sum_of_matrices);
    RUN_TEST(the_affine_force_goes_from_pose_to_pose);
    RUN_TEST(weights_sum_to_one);
    RUN_TEST(alignment_makes_joints_coincide);
    RUN_TEST(numbers_are_names_of_the_same_skeleton_only);
    RUN_TEST(joints_are_paired_by_file);
    RUN_TEST(joints_of_different_rigs_are_paired_limb_by_limb);
    RUN_TEST(both_sides_are_paired_alike);
    RUN_TEST(clips_move_the_other_body);
    if (!remove_folder()) return 1;
    GREATEST_MAIN_END();
}

#endif
