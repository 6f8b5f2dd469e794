/* examples/rig and what it stands on: templates, bodies made of capsules in several poses, turned and scaled, rigged characters
 * whose own joints are the truth, weights and files read back, animations of another character, and bad input.
 * Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_rig_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_rig_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

    /* The program, whose inner functions are called here. */
#define main rig_main
#include "../../examples/rig/rig.c"
#undef main
#include "../../examples/rig/output.c"
#undef MARGIN
#include "../../examples/rig/body.c"
#include "../../examples/rig/sides.c"

#include <unistd.h>

#include "gltf_problems.h"
#include "json_report.h"
#include "scratch.h"

/* assimp 5.2 loses memory of its own on some broken files; LeakSanitizer calls this function for what to ignore. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libassimp\n"; }

static void write_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    fputs(text, file);
    fclose(file);
}

static int run_program(const char *const *arguments)
{
    char *argv[32] = {(char *)(uintptr_t) "build/rig"};
    int argc = 1;
    for (; arguments[argc - 1]; ++argc) argv[argc] = (char *)(uintptr_t)arguments[argc - 1];
    return rig_main(argc, argv);
}

/* ---- bodies of capsules ---- */

struct capsule {
    float from[3], to[3], radius;
};

/* A joint that the template must find, in the pose of the capsules. */
struct truth {
    const char *name;
    float place[3];
};

/* Turns and scales: rows of a rotation times a scale. */
struct turn {
    const char *name;
    float rows[3][3], scale;
    const char *up; /* for --up where the body does not stand on y or z; NULL: found */
};

static const struct turn turns[] = {
    {"as it is", {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 1.0f, NULL},
    {"turned to the right, 100 times", {{0, 0, -1}, {0, 1, 0}, {1, 0, 0}}, 100.0f, NULL},
    {"turned round, a hundredth", {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}}, 0.01f, NULL},
    {"z upwards", {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, 1.0f, NULL},
    {"turned by 40 degrees", {{0.76604444f, 0, 0.64278761f}, {0, 1, 0}, {-0.64278761f, 0, 0.76604444f}}, 1.0f, NULL},
    {"head downwards", {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, 1.0f, "0,-1,0"},
};

static void turned(const struct turn *turn, const float p[3], float out[3])
{
    for (int i = 0; i < 3; ++i) out[i] = turn->scale * vec3_dot(turn->rows[i], p);
}

enum { AROUND = 16, RINGS = 8 };

/* Writes capsules as closed surfaces, which overlap; mirror: those with x > 0 twice. */
static void write_capsules(const char *path, const struct capsule *capsules, int count, const struct turn *turn)
{
    FILE *file = fopen(path, "w");
    int first = 1;
    for (int n = 0; n < 2 * count; ++n) {
        const struct capsule *c = &capsules[n / 2];
        const float side = n % 2 ? -1.0f : 1.0f;
        if (n % 2 && c->from[0] <= 0.0f && c->to[0] <= 0.0f) continue;
        float from[3] = {side * c->from[0], c->from[1], c->from[2]}, to[3] = {side * c->to[0], c->to[1], c->to[2]},
              axis[3], u[3], v[3];
        vec3_sub(to, from, axis);
        vec3_normalize(axis);
        const float other[3] = {fabsf(axis[0]) < 0.5f, fabsf(axis[0]) >= 0.5f, 0.0f};
        vec3_cross(other, axis, u);
        vec3_normalize(u);
        vec3_cross(axis, u, v);
        for (int r = 0; r < RINGS; ++r) {
            const float angle = 3.14159265f * ((float)r / (RINGS - 1) - 0.5f);
            for (int k = 0; k < AROUND; ++k) {
                const float a = 6.2831853f * (float)k / AROUND;
                float p[3], q[3];
                vec3_add_scaled(r < RINGS / 2 ? from : to, c->radius * sinf(angle), axis, p);
                vec3_add_scaled(p, c->radius * cosf(angle) * cosf(a), u, p);
                vec3_add_scaled(p, c->radius * cosf(angle) * sinf(a), v, p);
                turned(turn, p, q);
                fprintf(file, "v %.7g %.7g %.7g\n", (double)q[0], (double)q[1], (double)q[2]);
            }
        }
        for (int r = 0; r + 1 < RINGS; ++r) {
            for (int k = 0; k < AROUND; ++k) {
                const int a = first + r * AROUND + k, b = first + r * AROUND + (k + 1) % AROUND;
                fprintf(file, "f %d %d %d\nf %d %d %d\n", a, b, a + AROUND, b, b + AROUND, a + AROUND);
            }
        }
        for (int k = 1; k + 1 < AROUND; ++k) { /* the poles, small but open otherwise */
            const int top = first + (RINGS - 1) * AROUND;
            fprintf(file, "f %d %d %d\nf %d %d %d\n", first, first + k + 1, first + k, top, top + k, top + k + 1);
        }
        first += RINGS * AROUND;
    }
    fclose(file);
}

static const struct capsule t_pose[] = {
    {{0, 0.95f, 0}, {0, 1.36f, 0}, 0.14f},          {{0, 1.45f, 0}, {0, 1.56f, 0}, 0.055f},
    {{0, 1.66f, 0}, {0, 1.70f, 0.01f}, 0.11f},      {{0.06f, 1.42f, 0}, {0.46f, 1.42f, 0}, 0.055f},
    {{0.46f, 1.42f, 0}, {0.84f, 1.42f, 0}, 0.042f}, {{0.10f, 0.92f, 0}, {0.11f, 0.50f, 0}, 0.082f},
    {{0.11f, 0.50f, 0}, {0.12f, 0.09f, 0}, 0.055f}, {{0.12f, 0.05f, -0.02f}, {0.12f, 0.05f, 0.16f}, 0.05f}};
static const struct truth t_joints[] = {{"hips", {0, 0.94f, 0}},
                                        {"head", {0, 1.55f, 0}},
                                        {"upper_arm.L", {0.17f, 1.42f, 0}},
                                        {"lower_arm.L", {0.46f, 1.42f, 0}},
                                        {"hand.L", {0.71f, 1.42f, 0}},
                                        {"thigh.L", {0.10f, 0.90f, 0}},
                                        {"shin.L", {0.11f, 0.50f, 0}},
                                        {"foot.L", {0.12f, 0.09f, 0}},
                                        {NULL, {0, 0, 0}}};

static const struct capsule a_pose[] = {{{0, 0.95f, 0}, {0, 1.36f, 0}, 0.14f},
                                        {{0, 1.45f, 0}, {0, 1.56f, 0}, 0.055f},
                                        {{0, 1.66f, 0}, {0, 1.70f, 0.01f}, 0.11f},
                                        {{0.10f, 1.42f, 0}, {0.36f, 1.18f, 0}, 0.055f},
                                        {{0.36f, 1.18f, 0}, {0.60f, 0.90f, 0.06f}, 0.042f},
                                        {{0.10f, 0.92f, 0}, {0.14f, 0.50f, 0.02f}, 0.082f},
                                        {{0.14f, 0.50f, 0.02f}, {0.18f, 0.09f, 0}, 0.055f},
                                        {{0.18f, 0.05f, -0.02f}, {0.19f, 0.05f, 0.16f}, 0.05f}};
static const struct truth a_joints[] = {{"hips", {0, 0.94f, 0}},
                                        {"head", {0, 1.55f, 0}},
                                        {"upper_arm.L", {0.16f, 1.37f, 0}},
                                        {"lower_arm.L", {0.36f, 1.18f, 0}},
                                        {"hand.L", {0.53f, 0.98f, 0.04f}},
                                        {"thigh.L", {0.10f, 0.90f, 0}},
                                        {"shin.L", {0.14f, 0.50f, 0.02f}},
                                        {"foot.L", {0.18f, 0.09f, 0}},
                                        {NULL, {0, 0, 0}}};

/* Arms that hang down and touch the hips. */
static const struct capsule i_pose[] = {{{0, 0.95f, 0}, {0, 1.36f, 0}, 0.14f},
                                        {{0, 1.45f, 0}, {0, 1.56f, 0}, 0.055f},
                                        {{0, 1.66f, 0}, {0, 1.70f, 0.01f}, 0.11f},
                                        {{0.06f, 1.42f, 0}, {0.20f, 1.42f, 0}, 0.055f},
                                        {{0.20f, 1.42f, 0}, {0.22f, 1.14f, 0}, 0.055f},
                                        {{0.22f, 1.14f, 0}, {0.235f, 0.82f, 0}, 0.045f},
                                        {{0.10f, 0.92f, 0}, {0.11f, 0.50f, 0}, 0.082f},
                                        {{0.11f, 0.50f, 0}, {0.12f, 0.09f, 0}, 0.055f},
                                        {{0.12f, 0.05f, -0.02f}, {0.12f, 0.05f, 0.16f}, 0.05f}};
static const struct truth i_joints[] = {{"hips", {0, 0.94f, 0}},
                                        {"head", {0, 1.55f, 0}},
                                        {"lower_arm.L", {0.22f, 1.14f, 0}},
                                        {"hand.L", {0.23f, 0.92f, 0}},
                                        {"shin.L", {0.11f, 0.50f, 0}},
                                        {"foot.L", {0.12f, 0.09f, 0}},
                                        {NULL, {0, 0, 0}}};

/* Thighs that are one from above the knees downwards. */
static const struct capsule knees_touch[] = {{{0, 0.95f, 0}, {0, 1.36f, 0}, 0.14f},
                                             {{0, 1.45f, 0}, {0, 1.56f, 0}, 0.055f},
                                             {{0, 1.66f, 0}, {0, 1.70f, 0.01f}, 0.11f},
                                             {{0.06f, 1.42f, 0}, {0.46f, 1.42f, 0}, 0.055f},
                                             {{0.46f, 1.42f, 0}, {0.84f, 1.42f, 0}, 0.042f},
                                             {{0.10f, 0.92f, 0}, {0.05f, 0.50f, 0}, 0.082f},
                                             {{0.05f, 0.50f, 0}, {0.09f, 0.09f, 0}, 0.055f},
                                             {{0.09f, 0.05f, -0.02f}, {0.09f, 0.05f, 0.16f}, 0.05f}};
static const struct truth knees_joints[] = {{"head", {0, 1.55f, 0}},
                                            {"upper_arm.L", {0.17f, 1.42f, 0}},
                                            {"lower_arm.L", {0.46f, 1.42f, 0}},
                                            {"hand.L", {0.71f, 1.42f, 0}},
                                            {"shin.L", {0.05f, 0.50f, 0}},
                                            {"foot.L", {0.09f, 0.09f, 0}},
                                            {NULL, {0, 0, 0}}};
static const struct truth knees_hips[] = {{"hips", {0, 0.94f, 0}}, {"thigh.L", {0.10f, 0.90f, 0}}, {NULL, {0, 0, 0}}};

static const struct capsule four_legs[] = {{{0, 0.80f, -0.45f}, {0, 0.80f, 0.40f}, 0.17f},
                                           {{0, 0.88f, 0.45f}, {0, 1.12f, 0.72f}, 0.08f},
                                           {{0, 1.15f, 0.74f}, {0, 1.08f, 0.98f}, 0.09f},
                                           {{0, 0.84f, -0.58f}, {0, 0.50f, -0.95f}, 0.04f},
                                           {{0.12f, 0.74f, 0.36f}, {0.12f, 0.42f, 0.34f}, 0.075f},
                                           {{0.12f, 0.42f, 0.34f}, {0.12f, 0.05f, 0.36f}, 0.05f},
                                           {{0.12f, 0.74f, -0.42f}, {0.12f, 0.46f, -0.40f}, 0.085f},
                                           {{0.12f, 0.46f, -0.40f}, {0.12f, 0.26f, -0.48f}, 0.055f},
                                           {{0.12f, 0.26f, -0.48f}, {0.12f, 0.05f, -0.44f}, 0.05f}};
static const struct truth four_joints[] = {{"hips", {0, 0.80f, -0.43f}},
                                           {"neck", {0, 0.88f, 0.45f}},
                                           {"front_upper_leg.L", {0.12f, 0.80f, 0.36f}},
                                           {"front_lower_leg.L", {0.12f, 0.42f, 0.34f}},
                                           {"front_foot.L", {0.12f, 0.10f, 0.36f}},
                                           {"hind_upper_leg.L", {0.12f, 0.80f, -0.43f}},
                                           {"hind_lower_leg.L", {0.12f, 0.46f, -0.40f}},
                                           {"hind_foot.L", {0.12f, 0.26f, -0.48f}},
                                           {NULL, {0, 0, 0}}};

static bool joint_of_report(const cJSON *json, const char *name, float place[3])
{
    const cJSON *joint = cJSON_GetObjectItem(cJSON_GetObjectItem(json, "joints"), name);
    for (int i = 0; i < 3; ++i) {
        const cJSON *value = cJSON_GetArrayItem(joint, i);
        if (!cJSON_IsNumber(value)) return false;
        place[i] = (float)value->valuedouble;
    }
    return true;
}

/* Compares one joint with the truth: within a share of `scale`, and nearer than its partner on the other side. */
static greatest_test_res check_joint(const cJSON *json, const char *what, const char *name, const float truth[3],
                                     double scale, double within)
{
    static char message[256];
    float place[3], other[3], d[3];
    ASSERTm(name, joint_of_report(json, name, place));
    vec3_sub(place, truth, d);
    const double error = (double)vec3_length(d) / scale;
    snprintf(message, sizeof message, "%s, %s: off by %.1f %%", what, name, 100.0 * error);
    ASSERTm(message, error < within);
    const size_t length = strlen(name);
    if (length > 2 && name[length - 2] == '.') {
        char partner[64];
        snprintf(partner, sizeof partner, "%.*s%c", (int)length - 1, name, name[length - 1] == 'L' ? 'R' : 'L');
        ASSERTm(partner, joint_of_report(json, partner, other));
        vec3_sub(other, truth, other);
        ASSERTm(message, vec3_length(d) < vec3_length(other));
    }
    PASS();
}

/* Compares joints, and those of the other side, within a share of the height. */
static greatest_test_res check_joints(const cJSON *json, const struct truth *joints, const struct turn *turn, bool over_length,
                                      double within)
{
    for (; joints->name; ++joints) {
        float truth[3], mirrored[3] = {-joints->place[0], joints->place[1], joints->place[2]};
        const double scale = over_length ? 2.05 * (double)turn->scale : number_of(json, "height");
        turned(turn, joints->place, truth);
        CHECK_CALL(check_joint(json, turn->name, joints->name, truth, scale, within));
        if (strstr(joints->name, ".L")) {
            char right[64];
            snprintf(right, sizeof right, "%.*sR", (int)strlen(joints->name) - 1, joints->name);
            turned(turn, mirrored, truth);
            CHECK_CALL(check_joint(json, turn->name, right, truth, scale, within));
        }
    }
    PASS();
}

static greatest_test_res check_body(const struct capsule *capsules, int count, const struct truth *joints,
                                    const char *skeleton, const struct turn *turn, bool over_length)
{
    write_capsules(scratch("body.obj"), capsules, count, turn);
    const char *const line[] = {
        scratch("body.obj"),      "--template", skeleton, "--grid", "88", "--quiet", "--json", scratch("body.json"),
        turn->up ? "--up" : NULL, turn->up,     NULL};
    ASSERT_EQm(turn->name, 0, run_program(line));
    cJSON *json = read_report(scratch("body.json"));
    ASSERT(json != NULL);
    ASSERT_EQ(0, (int)number_of(json, "vertices_on_both_sides"));
    CHECK_CALL(check_joints(json, joints, turn, over_length, 0.06));
    cJSON_Delete(json);
    PASS();
}

#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

TEST a_body_in_t_pose_any_way_round(void)
{
    for (int t = 0; t < COUNT(turns); ++t)
        CHECK_CALL(check_body(t_pose, COUNT(t_pose), t_joints, "biped", &turns[t], false));
    PASS();
}

TEST a_body_in_a_pose_any_way_round(void)
{
    for (int t = 0; t < COUNT(turns); ++t)
        CHECK_CALL(check_body(a_pose, COUNT(a_pose), a_joints, "biped", &turns[t], false));
    PASS();
}

TEST arms_that_touch_the_hips_are_found(void)
{
    return check_body(i_pose, COUNT(i_pose), i_joints, "biped", &turns[0], false);
}

/* Where knees touch, legs are searched in a thinner body, and said to be a guess. */
TEST knees_that_touch_are_parted_and_doubted(void)
{
    CHECK_CALL(check_body(knees_touch, COUNT(knees_touch), knees_joints, "biped", &turns[0], false));
    cJSON *json = read_report(scratch("body.json"));
    CHECK_CALL(check_joints(json, knees_hips, &turns[0], false, 0.11)); /* a guess: 0.1 too low; the knees are 0.24 lower */
    const cJSON *confidence = cJSON_GetObjectItem(json, "confidence");
    ASSERT_EQ(0.0, number_of(confidence, "thigh"));
    ASSERT_GT(number_of(confidence, "upper_arm"), 0.5);
    cJSON_Delete(json);
    PASS();
}

/* Runs the program on a file of the collection; NULL: there is none. */
static cJSON *report_of(const char *file, const char *skeleton)
{
    const char *data = getenv("SPRINGLS_DATA");
    char path[1024];
    snprintf(path, sizeof path, "%s/%s", data ? data : "", file);
    const char *const line[] = {path, "--template", skeleton, "--grid", "88", "--quiet", "--json", scratch("file.json"), NULL};
    return data && run_program(line) == 0 ? read_report(scratch("file.json")) : NULL;
}

/* A cow whose thighs are near each other: heat goes from one side to the other, weights do not stay there. */
TEST weights_keep_to_their_side(void)
{
    if (!getenv("SPRINGLS_DATA")) SKIPm("SPRINGLS_DATA is not set");
    cJSON *json = report_of("meshes/spot.obj", "quadruped");
    ASSERT(json != NULL);
    ASSERT_GT((int)number_of(json, "vertices_on_both_sides_by_heat"), 0);
    ASSERT_EQ(0, (int)number_of(json, "vertices_on_both_sides"));
    cJSON_Delete(json);
    PASS();
}

/* A body that is a wall, thinner than a voxel, is taken as full: it is symmetric, and sure of its limbs. */
TEST a_double_shell_is_taken_as_full(void)
{
    if (!getenv("SPRINGLS_DATA")) SKIPm("SPRINGLS_DATA is not set");
    char path[1024];
    snprintf(path, sizeof path, "%s/reports/rig-ai-shell/shell_closed.ply", getenv("SPRINGLS_DATA"));
    if (access(path, R_OK) != 0) SKIPm("reports/rig-ai-shell is not in the collection");
    cJSON *json = report_of("reports/rig-ai-shell/shell_closed.ply", "biped");
    ASSERT(json != NULL);
    ASSERT_EQ(1, (int)number_of(json, "parts"));
    ASSERT_LT(number_of(json, "role_cost"), 0.2);
    ASSERT_GT(number_of(cJSON_GetObjectItem(json, "confidence"), "upper_arm"), 0.5);
    cJSON_Delete(json);
    PASS();
}

TEST a_quadruped_any_way_round(void)
{
    for (int t = 0; t < 5; ++t)
        CHECK_CALL(check_body(four_legs, COUNT(four_legs), four_joints, "quadruped", &turns[t], false));
    PASS();
}

/* --facing turns left and right round, and is refused along the sides. */
TEST facing_decides_left_and_right(void)
{
    float left[3], right[3];
    write_capsules(scratch("body.obj"), t_pose, COUNT(t_pose), &turns[0]);
    const char *const back[] = {scratch("body.obj"),  "--facing", "0,0,-1", "--grid", "64", "--quiet", "--json",
                                scratch("body.json"), NULL};
    const char *const side[] = {scratch("body.obj"), "--facing", "1,0,0", "--grid", "64", "--quiet", NULL};
    ASSERT_EQ(0, run_program(back));
    cJSON *json = read_report(scratch("body.json"));
    ASSERT(joint_of_report(json, "hand.L", left) && joint_of_report(json, "hand.R", right));
    ASSERT(left[0] < -0.5f && right[0] > 0.5f);
    cJSON_Delete(json);
    ASSERT_EQ(1, run_program(side));
    PASS();
}

/* ---- rigged characters without their rigs ---- */

struct own_joint {
    const char *joint, *own;
};

static const struct own_joint kaykit[] = {{"hips", "hips"},
                                          {"spine", "spine"},
                                          {"chest", "chest"},
                                          {"head", "head"},
                                          {"upper_arm.L", "upperarm.l"},
                                          {"lower_arm.L", "lowerarm.l"},
                                          {"hand.L", "wrist.l"},
                                          {"thigh.L", "upperleg.l"},
                                          {"shin.L", "lowerleg.l"},
                                          {"foot.L", "foot.l"},
                                          {"toes.L", "toes.l"},
                                          {"upper_arm.R", "upperarm.r"},
                                          {"lower_arm.R", "lowerarm.r"},
                                          {"hand.R", "wrist.r"},
                                          {"thigh.R", "upperleg.r"},
                                          {"shin.R", "lowerleg.r"},
                                          {"foot.R", "foot.r"},
                                          {"toes.R", "toes.r"},
                                          {NULL, NULL}};
static const struct own_joint figure[] = {
    {"hips", "nodes[2]"},         {"spine", "nodes[11]"},       {"chest", "nodes[12]"},       {"neck", "nodes[19]"},
    {"head", "nodes[20]"},        {"upper_arm.L", "nodes[16]"}, {"lower_arm.L", "nodes[17]"}, {"hand.L", "nodes[18]"},
    {"thigh.L", "nodes[7]"},      {"shin.L", "nodes[8]"},       {"foot.L", "nodes[9]"},       {"toes.L", "nodes[10]"},
    {"upper_arm.R", "nodes[13]"}, {"lower_arm.R", "nodes[14]"}, {"hand.R", "nodes[15]"},      {"thigh.R", "nodes[3]"},
    {"shin.R", "nodes[4]"},       {"foot.R", "nodes[5]"},       {"toes.R", "nodes[6]"},       {NULL, NULL}};
static const struct own_joint robot[] = {{"hips", "Hips"},
                                         {"spine", "Abdomen"},
                                         {"chest", "Torso"},
                                         {"neck", "Neck"},
                                         {"head", "Head"},
                                         {"upper_arm.L", "UpperArm.L"},
                                         {"lower_arm.L", "LowerArm.L"},
                                         {"hand.L", "Palm2.L"},
                                         {"thigh.L", "UpperLeg.L"},
                                         {"shin.L", "LowerLeg.L"},
                                         {"foot.L", "Foot.L"},
                                         {"upper_arm.R", "UpperArm.R"},
                                         {"lower_arm.R", "LowerArm.R"},
                                         {"hand.R", "Palm2.R"},
                                         {"thigh.R", "UpperLeg.R"},
                                         {"shin.R", "LowerLeg.R"},
                                         {"foot.R", "Foot.R"},
                                         {NULL, NULL}};
static const struct own_joint fox[] = {{"hips", "b_Hip_01"},
                                       {"spine", "b_Spine01_02"},
                                       {"chest", "b_Spine02_03"},
                                       {"neck", "b_Neck_04"},
                                       {"head", "b_Head_05"},
                                       {"tail", "b_Tail01_012"},
                                       {"tail_middle", "b_Tail02_013"},
                                       {"tail_tip", "b_Tail03_014"},
                                       {"front_upper_leg.L", "b_LeftUpperArm_09"},
                                       {"front_lower_leg.L", "b_LeftForeArm_010"},
                                       {"front_foot.L", "b_LeftHand_011"},
                                       {"front_upper_leg.R", "b_RightUpperArm_06"},
                                       {"front_lower_leg.R", "b_RightForeArm_07"},
                                       {"front_foot.R", "b_RightHand_08"},
                                       {"hind_upper_leg.L", "b_LeftLeg01_015"},
                                       {"hind_lower_leg.L", "b_LeftLeg02_016"},
                                       {"hind_foot.L", "b_LeftFoot01_017"},
                                       {"hind_toes.L", "b_LeftFoot02_018"},
                                       {"hind_upper_leg.R", "b_RightLeg01_019"},
                                       {"hind_lower_leg.R", "b_RightLeg02_020"},
                                       {"hind_foot.R", "b_RightFoot01_021"},
                                       {"hind_toes.R", "b_RightFoot02_022"},
                                       {NULL, NULL}};

/* Finds a joint by name, one that vertices depend on or that has joints below: parts of a character may have the names of bones. */
static int bone_named(const struct character *c, const char *name)
{
    for (int j = 0; j < c->joint_count; ++j) {
        bool inner = c->joints[j].bone;
        for (int k = j + 1; k < c->joint_count; ++k) inner = inner || c->joints[k].parent == j;
        if (inner && strcmp(c->joints[j].name, name) == 0) return j;
    }
    return -1;
}

/* Compares with the character's own joints; the program reads the surface only. length: 0, or the scale of errors. */
static greatest_test_res check_character(const char *file, const char *skeleton, const struct own_joint *joints,
                                         double length)
{
    const char *data = getenv("SPRINGLS_DATA");
    char path[1024], error[CHARACTER_TEXT];
    struct character own;
    double mean = 0.0, worst = 0.0;
    int count = 0;
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    snprintf(path, sizeof path, "%s/rigged/%s", data, file);
    const char *const line[] = {path, "--template", skeleton, "--quiet", "--json", scratch("own.json"), NULL};
    ASSERT(character_read(path, NULL, &own, error));
    ASSERT_EQm(file, 0, run_program(line));
    cJSON *json = read_report(scratch("own.json"));
    const double scale = length > 0.0 ? length : number_of(json, "height");
    printf("\n%s, %% of %.4g:", file, scale);
    for (const struct own_joint *j = joints; j->joint; ++j, ++count) {
        float place[3], truth[3] = {0.0f, 0.0f, 0.0f};
        const int found = bone_named(&own, j->own);
        ASSERTm(j->own, found >= 0 && joint_of_report(json, j->joint, place));
        joint_place(&own.joints[found], truth);
        vec3_sub(place, truth, place);
        const double off = (double)vec3_length(place) / scale;
        printf(" %s %.1f", j->joint, 100.0 * off);
        mean += off;
        worst = fmax(worst, off);
    }
    printf("; mean %.1f, worst %.1f\n", 100.0 * mean / count, 100.0 * worst);
    for (const struct own_joint *j = joints; j->joint; ++j) {
        float truth[3];
        joint_place(&own.joints[bone_named(&own, j->own)], truth);
        CHECK_CALL(check_joint(json, file, j->joint, truth, scale, 0.06));
    }
    cJSON_Delete(json);
    character_free(&own);
    PASS();
}

/* Writes a character's surface, turned; inside out again where the turn is a reflection. */
static void write_turned(const char *path, const struct character *c, const struct turn *turn, bool mirrored)
{
    FILE *file = fopen(path, "w");
    for (int v = 0; v < c->vertex_count; ++v) {
        float p[3];
        turned(turn, c->positions + 3 * v, p);
        fprintf(file, "v %.7g %.7g %.7g\n", (double)p[0], (double)p[1], (double)p[2]);
    }
    for (int t = 0; t < c->triangle_count; ++t) {
        const int *corner = c->triangles + 3 * t;
        fprintf(file, "f %d %d %d\n", corner[0] + 1, corner[mirrored ? 2 : 1] + 1, corner[mirrored ? 1 : 2] + 1);
    }
    fclose(file);
}

/* Compares with the character's own joints, turned. In a mirror its left hand is the right one. */
static greatest_test_res check_turned(const char *file, const struct own_joint *joints, const struct turn *turn)
{
    const char *data = getenv("SPRINGLS_DATA");
    char path[1024], error[CHARACTER_TEXT], name[64];
    struct character own;
    float across[3];
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    vec3_cross(turn->rows[0], turn->rows[1], across);
    const bool mirrored = vec3_dot(across, turn->rows[2]) < 0.0f;
    snprintf(path, sizeof path, "%s/rigged/%s", data, file);
    ASSERT(character_read(path, NULL, &own, error));
    write_turned(scratch("turned.obj"), &own, turn, mirrored);
    const char *const line[] = {scratch("turned.obj"), "--template", "biped", "--quiet", "--json", scratch("turned.json"), NULL};
    ASSERT_EQm(turn->name, 0, run_program(line));
    cJSON *json = read_report(scratch("turned.json"));
    for (const struct own_joint *j = joints; j->joint; ++j) {
        float place[3], truth[3];
        snprintf(name, sizeof name, "%s", j->joint);
        char *side = strchr(name, '.');
        if (mirrored && side) { side[1] = side[1] == 'L' ? 'R' : 'L'; }
        joint_place(&own.joints[bone_named(&own, j->own)], place);
        turned(turn, place, truth);
        CHECK_CALL(check_joint(json, turn->name, name, truth, number_of(json, "height"), 0.06));
    }
    cJSON_Delete(json);
    character_free(&own);
    PASS();
}

TEST a_man_in_a_mirror_and_turned(void)
{
    static const struct turn ways[] = {
        {"mirrored", {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 1.0f, NULL},
        {"turned by a quarter", {{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}}, 1.0f, NULL},
        {"mirrored, and turned by a quarter", {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}}, 1.0f, NULL},
    };
    for (int t = 0; t < COUNT(ways); ++t) CHECK_CALL(check_turned("CesiumMan.glb", figure, &ways[t]));
    PASS();
}

TEST the_knight(void) { return check_character("Knight.glb", "biped", kaykit, 0.0); }
TEST the_mage(void) { return check_character("Mage.glb", "biped", kaykit, 0.0); }
TEST the_man(void) { return check_character("CesiumMan.glb", "biped", figure, 0.0); }
TEST the_figure(void) { return check_character("RiggedFigure.glb", "biped", figure, 0.0); }
TEST the_robot(void) { return check_character("robot_expressive.glb", "biped", robot, 0.0); }
TEST the_fox(void) { return check_character("Fox.glb", "quadruped", fox, 154.7); } /* over its length */

/* ---- weights, files, motion ---- */

static greatest_test_res check_weights(const struct character *c)
{
    for (int v = 0; v < c->vertex_count; ++v) {
        float sum = 0.0f;
        int used = 0;
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            sum += c->influences[v].weight[k];
            used += c->influences[v].weight[k] > 0.0f;
        }
        ASSERT_IN_RANGE(1.0, (double)sum, 1e-5);
        ASSERT(used >= 1 && used <= 4);
    }
    PASS();
}

TEST the_file_is_read_back(void)
{
    struct character c;
    struct image picture;
    char error[CHARACTER_TEXT];
    write_capsules(scratch("body.obj"), t_pose, COUNT(t_pose), &turns[0]);
    const char *const line[] = {scratch("body.obj"), "--grid", "64",   "--size", "64",
                                "--quiet",           "--out",  folder, NULL};
    const char *const file[] = {scratch("body.obj"), "--grid", "64", "--quiet", "--out", scratch("other.glb"), NULL};
    ASSERT_EQ(0, run_program(line));
    ASSERT_EQ(0, run_program(file));
    ASSERT(image_read_file(scratch("rigged.png"), &picture));
    image_free(&picture);
    char *one = whole_file(scratch("rigged.glb"), NULL), *two = whole_file(scratch("other.glb"), NULL);
    ASSERT_EQ(0, memcmp(one, two, 1 << 22)); /* the same file both ways */
    free(one);
    free(two);
    ASSERT(character_read(scratch("rigged.glb"), NULL, &c, error));
    ASSERT(c.skinned && c.unnormal == 0 && c.unweighted == 0);
    ASSERT_EQ(19 + 2, c.joint_count); /* the template's joints, the body's node and the file's root */
    CHECK_CALL(check_weights(&c));
    const int hand = character_joint(&c, "hand.L"), parent = character_joint(&c, "lower_arm.L");
    ASSERT(hand >= 0 && c.joints[hand].parent == parent);
    for (int v = 0; v < c.vertex_count; ++v) { /* the end of the left hand hangs on the left hand */
        float heaviest = 0.0f;
        int joint = -1;
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            joint = c.influences[v].weight[k] > heaviest ? c.influences[v].joint[k] : joint;
            heaviest = fmaxf(heaviest, c.influences[v].weight[k]);
        }
        if (c.positions[3 * v] > 0.84f) ASSERT_EQ(hand, joint);
    }
    character_free(&c);
    PASS();
}

/* The walker that comes with morph moves an A-posed body that looks the other way: limbs stay parallel, seen from
 * each body's front, left stays left. */
TEST a_walk_is_taken_over(void)
{
    struct character walker, body;
    char error[CHARACTER_TEXT];
    struct affine skin[64], places[64], ours_skin[64], ours[64];
    static const char *const limbs[][4] = {{"leg.l", "shin.l", "thigh.L", "shin.L"},
                                           {"shin.l", "foot.l", "shin.L", "foot.L"},
                                           {"leg.r", "shin.r", "thigh.R", "shin.R"},
                                           {"arm.l", "forearm.l", "upper_arm.L", "lower_arm.L"},
                                           {"forearm.r", "hand.r", "lower_arm.R", "hand.R"}};
    ASSERT(character_build(0, &walker, error));
    ASSERT(gltf_write_character(scratch("walker.glb"), &walker));
    write_capsules(scratch("body.obj"), a_pose, COUNT(a_pose), &turns[2]);
    const char *const line[] = {scratch("body.obj"), "--animation", scratch("walker.glb"), "--grid", "88",
                                "--quiet",           "--out",       scratch("walks.glb"),  NULL};
    ASSERT_EQ(0, run_program(line));
    ASSERT(gltf_problems(scratch("walks.glb")) <= 0);
    ASSERT(character_read(scratch("walks.glb"), NULL, &body, error));
    ASSERT_EQ(1, body.animation_count);
    ASSERT_STR_EQ("walk", body.animations[0].name);
    for (int f = 0; f < 6; ++f) {
        const double time = walker.animations[0].duration * f / 6.0;
        character_pose(&walker, 0, time, 1.0, skin, places);
        character_pose(&body, 0, time, 1.0, ours_skin, ours);
        for (int l = 0; l < COUNT(limbs); ++l) {
            float theirs[3], mine[3];
            const int a = character_joint(&walker, limbs[l][0]), b = character_joint(&walker, limbs[l][1]),
                      c = character_joint(&body, limbs[l][2]), d = character_joint(&body, limbs[l][3]);
            ASSERT(a >= 0 && b >= 0 && c >= 0 && d >= 0);
            for (int i = 0; i < 3; ++i) {
                theirs[i] = (float)(places[b].m[4 * i + 3] - places[a].m[4 * i + 3]);
                mine[i] = (float)((ours[d].m[4 * i + 3] - ours[c].m[4 * i + 3])
                                  * (i == 1 ? 1.0 : -1.0)); /* looks along -z */
            }
            vec3_normalize(theirs);
            vec3_normalize(mine);
            ASSERTm(limbs[l][2], vec3_dot(theirs, mine) > 0.98f);
        }
    }
    character_free(&walker);
    character_free(&body);
    PASS();
}

/* ---- bad input ---- */

static void ball_of(const char *path, int rows)
{
    FILE *file = fopen(path, "w");
    for (int r = 0; r <= rows; ++r)
        for (int k = 0; k < AROUND; ++k) {
            const double a = 3.14159265358979 * r / 16, b = 6.28318530717959 * k / AROUND;
            fprintf(file, "v %.6f %.6f %.6f\n", sin(a) * cos(b), cos(a), sin(a) * sin(b));
        }
    for (int r = 0; r < rows; ++r)
        for (int k = 0; k < AROUND; ++k) {
            const int a = 1 + r * AROUND + k, b = 1 + r * AROUND + (k + 1) % AROUND;
            fprintf(file, "f %d %d %d\nf %d %d %d\n", a, b, a + AROUND, b, b + AROUND, a + AROUND);
        }
    fclose(file);
}

TEST templates_are_refused_in_one_line(void)
{
    static const char *const texts[] = {
        "",
        "not JSON",
        "{}",
        "{\"joints\": [1, 2]}",
        "{\"joints\": [{\"name\": \"a\", \"position\": [0, 0, 0]}, {\"name\": \"a\", \"parent\": \"a\", "
        "\"position\": [0, 0, 0]}, 1, 1, 1, 1, 1, 1]}",
        "{\"joints\": [{\"name\": \"a\", \"position\": [0, 0, 0]}, {\"name\": \"b\", \"parent\": \"c\", "
        "\"position\": [0, 0, 0]}, 1, 1, 1, 1, 1, 1]}",
        "{\"joints\": [{\"name\": \"a\", \"parent\": \"c\", \"position\": [0, 0, 0]}, 1, 1, 1, 1, 1, 1, 1]}",
        "{\"joints\": [{\"name\": \"a\", \"position\": [0, 1e30, 0]}, 1, 1, 1, 1, 1, 1, 1]}",
        "{\"joints\": [{\"name\": \"a\", \"position\": [0, 0, 0], \"place\": \"there\"}, 1, 1, 1, 1, 1, 1, 1]}"};
    struct skeleton_template s;
    char error[CHARACTER_TEXT];
    ASSERT(skeleton_template_read("examples/rig/biped.json", &s, error));
    ASSERT_EQ(24, s.count);
    ASSERT(s.limbs == 2 && s.trunk_ends == 1 && !s.ground[0] && s.ground[1]);
    ASSERT(skeleton_template_read("examples/rig/quadruped.json", &s, error));
    ASSERT(s.limbs == 2 && s.trunk_ends == 2 && s.ground[0] && s.ground[1]);
    for (int t = 0; t < COUNT(texts); ++t) {
        write_file(scratch("bad.json"), texts[t]);
        error[0] = '\0';
        ASSERTm(texts[t], !skeleton_template_read(scratch("bad.json"), &s, error));
        ASSERT(error[0] && !strchr(error, '\n'));
    }
    /* The biped with one thing wrong. */
    static const char *const wrong[][2] = {{"\"mirror\": \"shin.R\"", "\"mirror\": \"thigh.R\""},
                                           {"\"end\": true", "\"end\": false"},
                                           {"\"parent\": \"hips\"", "\"parent\": \"toes.L\""},
                                           {"\"parent\": \"neck\"", "\"parent\": \"chest\""}};
    for (int w = 0; w < COUNT(wrong); ++w) {
        char *text = whole_file("examples/rig/biped.json", NULL), *at = strstr(text, wrong[w][0]),
             *changed = calloc(1, 1 << 16);
        ASSERT(at != NULL);
        snprintf(changed, 1 << 16, "%.*s%s%s", (int)(at - text), text, wrong[w][1], at + strlen(wrong[w][0]));
        write_file(scratch("bad.json"), changed);
        error[0] = '\0';
        ASSERTm(wrong[w][1], !skeleton_template_read(scratch("bad.json"), &s, error));
        ASSERT(error[0] && !strchr(error, '\n'));
        free(text);
        free(changed);
    }
    PASS();
}

/* What the limbs are taken for comes with its confidence: high for a man, low for a man as a quadruped, which is noted, not refused,
 * unless --accept says that it is right. */
TEST limbs_have_a_confidence(void)
{
    static const char *const names[2][3] = {{"head", "upper_arm", "thigh"}, {"head", "front_upper_leg", "hind_upper_leg"}};
    double least[2] = {1.0, 1.0};
    const char *errors = scratch("notes");
    char report[512];
    snprintf(report, sizeof report, "%s", scratch("confidence.json"));
    write_capsules(scratch("body.obj"), t_pose, COUNT(t_pose), &turns[0]);
    ASSERT(freopen(errors, "w", stderr) != NULL);
    for (int way = 0; way < 3; ++way) {
        const char *const line[] = {scratch("body.obj"), "--grid", "64", "--json", report, "--template", way ? "quadruped" : "biped",
                                    way == 2 ? "--accept" : NULL, NULL};
        ASSERT_EQ(0, run_program(line));
        cJSON *json = read_report(report);
        for (int k = 0; k < 3 && way < 2; ++k) {
            const double confidence = number_of(cJSON_GetObjectItem(json, "confidence"), names[way][k]);
            ASSERTm(names[way][k], confidence >= 0.0 && confidence <= 1.0);
            least[way] = fmin(least[way], confidence);
        }
        cJSON_Delete(json);
    }
    ASSERT_GT(least[0], 0.25);
    ASSERT_LT(least[1], least[0]);
    fflush(stderr);
    char *text = whole_file(errors, NULL);
    const char *note = strstr(text, "unlike those of the template quadruped");
    ASSERT(note && !strstr(note + 1, "unlike") && !strstr(text, "template biped"));
    free(text);
    PASS();
}

/* A pinned joint is where it was put, in the report and in the file; the others stay. */
TEST pinned_joints_are_moved(void)
{
    float place[3], other[2][3];
    char report[512], glb[512], error[CHARACTER_TEXT];
    snprintf(report, sizeof report, "%s", scratch("pinned.json"));
    snprintf(glb, sizeof glb, "%s", scratch("pinned.glb"));
    write_capsules(scratch("body.obj"), t_pose, COUNT(t_pose), &turns[0]);
    for (int way = 0; way < 2; ++way) {
        const char *const line[] = {scratch("body.obj"), "--grid", "64", "--quiet", "--json", report, "--out", glb,
                                    way ? "--pin" : NULL, "lower_arm.L=0.5,1.41,0.01;shin.R=-0.11,0.45,0.02", NULL};
        ASSERT_EQ(0, run_program(line));
        cJSON *json = read_report(report);
        ASSERT(joint_of_report(json, "lower_arm.R", other[way]) && joint_of_report(json, "lower_arm.L", place));
        cJSON_Delete(json);
    }
    struct character c;
    ASSERT_MEM_EQ(other[0], other[1], sizeof other[0]);
    ASSERT(fabsf(place[0] - 0.5f) < 1e-4f && fabsf(place[1] - 1.41f) < 1e-4f && fabsf(place[2] - 0.01f) < 1e-4f);
    ASSERT(character_read(glb, NULL, &c, error));
    joint_place(&c.joints[character_joint(&c, "shin.R")], place);
    ASSERT(fabsf(place[0] + 0.11f) < 1e-4f && fabsf(place[1] - 0.45f) < 1e-4f && fabsf(place[2] - 0.02f) < 1e-4f);
    character_free(&c);
    PASS();
}

TEST bad_input_ends_with_one_line(void)
{
    ball_of(scratch("ball.obj"), 16);
    ball_of(scratch("bowl.obj"), 2);
    write_file(scratch("flat.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write_file(scratch("bad.json"), "{\"joints\": []}");
    write_capsules(scratch("body.obj"), t_pose, COUNT(t_pose), &turns[0]);
    char body[512];
    snprintf(body, sizeof body, "%s", scratch("body.obj"));
    struct character walker;
    char walks[512], error[CHARACTER_TEXT];
    snprintf(walks, sizeof walks, "%s", scratch("walker.glb"));
    ASSERT(character_build(0, &walker, error) && gltf_write_character(walks, &walker));
    character_free(&walker);
    const char *const lines[][8] = {{scratch("ball.obj"), NULL},
                                    {scratch("bowl.obj"), NULL},
                                    {scratch("flat.obj"), NULL},
                                    {"none.obj", NULL},
                                    {body, "--template", "snake", NULL},
                                    {body, "--template", scratch("bad.json"), NULL},
                                    {body, "--template", "none.json", NULL},
                                    {body, "--animation", body, "--grid", "64", NULL},
                                    {body, "--animation", "none.glb", "--grid", "64", NULL},
                                    {body, "--animation", walks, "--motion", "none", NULL},
                                    {body, "--grid", "64", "--pin", "hand.L", NULL},
                                    {body, "--grid", "64", "--pin", "tail=0,1,0", NULL},
                                    {body, "--grid", "64", "--pin", "hand.L=0,1,nan", NULL},
                                    {body, "--grid", "64", "--pin", "hand.L=0,1,0;hand.R=0,0,900", NULL}};
    char point[512];
    snprintf(point, sizeof point, "%s", scratch("point.obj"));
    write_file(point, "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n");
    const char *const points[][6] = {{point}, {body, "--animation", point, "--grid", "64", NULL}};
    const char *const usage[][6] = {{NULL}, {body, "--grid", "8"}, {body, "--nonsense"}, {body, "--motion", "0"}, {body, "--fps", "9"},
                                    {body, "--size", "99"}, {body, "--view", "1,0,0", "--out", "a.glb"}, {body, "--backend", "scalar"}};
    const char *errors = scratch("errors");
    ASSERT(freopen(errors, "w", stderr) != NULL);
    for (int l = 0; l < COUNT(lines); ++l) ASSERT_EQm(lines[l][0], 1, run_program(lines[l]));
    for (int l = 0; l < COUNT(points); ++l) ASSERT_EQ(1, run_program(points[l]));
    for (int l = 0; l < COUNT(usage); ++l) ASSERT_EQ(2, run_program(usage[l]));
    fflush(stderr);
    int count = 0;
    char *text = whole_file(errors, NULL);
    for (const char *c = text; *c; ++c) count += *c == '\n';
    ASSERT_EQ(COUNT(lines) + COUNT(points) + COUNT(usage), count);
    const char *named = strstr(text, "point.obj: the body has no size");
    ASSERT(named && strstr(named + 1, "point.obj: the body has no size"));
    ASSERT(strstr(text, "walker.glb: no animation none"));
    ASSERT(strstr(text, "the body has") && strstr(text, "encloses nothing")
           && strstr(text, "biped, quadruped or a JSON file"));
    free(text);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) { return 1; }
    RUN_TEST(templates_are_refused_in_one_line);
    RUN_TEST(a_body_in_t_pose_any_way_round);
    RUN_TEST(a_body_in_a_pose_any_way_round);
    RUN_TEST(arms_that_touch_the_hips_are_found);
    RUN_TEST(knees_that_touch_are_parted_and_doubted);
    RUN_TEST(weights_keep_to_their_side);
    RUN_TEST(a_double_shell_is_taken_as_full);
    RUN_TEST(a_quadruped_any_way_round);
    RUN_TEST(facing_decides_left_and_right);
    RUN_TEST(the_knight);
    RUN_TEST(the_mage);
    RUN_TEST(the_man);
    RUN_TEST(the_figure);
    RUN_TEST(the_robot);
    RUN_TEST(the_fox);
    RUN_TEST(a_man_in_a_mirror_and_turned);
    RUN_TEST(the_file_is_read_back);
    RUN_TEST(a_walk_is_taken_over);
    RUN_TEST(pinned_joints_are_moved);
    RUN_TEST(limbs_have_a_confidence);
    RUN_TEST(bad_input_ends_with_one_line);
    if (!remove_folder()) { return 1; }
    GREATEST_MAIN_END();
}

#endif
