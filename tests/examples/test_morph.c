/* examples/morph.c from the command line to its files and report: a morph from nothing, between two rigs, of sheets, and weights.
 * What it stands on: test_morph_skeletons.c, test_morph_shapes.c, test_morph_files.c. Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_morph_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_morph_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#define main morph_main
#include "../../examples/morph/morph.c"
#undef main

#include "character/gltf_character.h"
#include "surface/mesh_io.h"

#include <assimp/cimport.h>
#include <assimp/scene.h>
#include <unistd.h>

#include "gltf_problems.h"
#include "json_report.h"
#include "morph_fixtures.h"

static int run_program(const char *const *arguments)
{
    char *argv[32] = {(char *)(uintptr_t)"morph"};
    int argc = 1;
    for (; arguments[argc - 1]; ++argc) argv[argc] = (char *)(uintptr_t)arguments[argc - 1];
    return morph_main(argc, argv);
}

/* A closed body in every frame, with weights that sum to 1, nearer to the target at the end than at the start. */
static greatest_test_res check_report(const char *path, int frames, double near)
{
    cJSON *json = read_report(path);
    ASSERT(json != NULL);
    ASSERT_EQ(frames, (int)number_of(json, "frames"));
    ASSERT_EQ(frames, (int)number_of(json, "watertight_frames"));
    ASSERT_EQ(0, (int)number_of(json, "self_intersections"));
    ASSERT_EQ(1, (int)number_of(json, "components_fewest"));
    ASSERT_EQ(0, (int)number_of(json, "frames_with_more_handles"));
    ASSERT(number_of(json, "thinnest_limb") > 0.5);
    ASSERT(number_of(json, "weight_sum_error_max") < 1e-5);
    ASSERT(number_of(json, "channel_weight_sum_error_max") < 1e-5);
    ASSERT(number_of(json, "channel_weights_from_looked_up_mean_l1") < 0.3);
    ASSERT(number_of(json, "distance_to_target_mean_voxels") < near);
    const cJSON *by_frame = cJSON_GetObjectItem(json, "by_frame");
    ASSERT(number_of(cJSON_GetArrayItem(by_frame, frames - 1), "missing_voxels")
           < number_of(cJSON_GetArrayItem(by_frame, 0), "missing_voxels"));
    cJSON_Delete(json);
    PASS();
}

static int strongest_joint(const struct influences *in)
{
    int most = 0;
    for (int k = 1; k < CHARACTER_BONES; ++k) most = in->weight[k] > in->weight[most] ? k : most;
    return in->joint[most];
}

/* Takes away what joints move whose names contain a word. */
static void cut_off(struct character *c, const char *word)
{
    int kept = 0;
    for (int t = 0; t < c->triangle_count; ++t) {
        if (!strstr(c->joints[strongest_joint(&c->influences[c->triangles[3 * t]])].name, word)) {
            memmove(c->triangles + 3 * kept++, c->triangles + 3 * t, 3 * sizeof *c->triangles);
        }
    }
    c->triangle_count = kept;
    for (int j = 0; j < c->joint_count; ++j) c->joints[j].bone = c->joints[j].bone && !strstr(c->joints[j].name, word);
}

TEST a_morph_from_nothing(void)
{
    const char *const line[] = {"--grid", "48", "--frames", "6", "--blend", "4", "--size", "64", "--channel", "--quiet", "--out",
                                folder, "--json", scratch("morph.json"), NULL};
    ASSERT_EQ(0, run_program(line));
    CHECK_CALL(check_report(scratch("morph.json"), 6, 0.4));
    const struct aiScene *scene = aiImportFile(scratch("morph.glb"), 0);
    ASSERT(scene != NULL);
    ASSERT_EQ(6u, scene->mNumMeshes);
    ASSERT(!scene->mMeshes[5]->mColors[0] && scene->mMeshes[5]->mTextureCoords[0] && scene->mMeshes[5]->mNormals);
    ASSERT_EQ(6u, scene->mNumTextures);
    aiReleaseImport(scene);
    ASSERT(gltf_problems(scratch("morph.glb")) <= 0 && gltf_problems(scratch("skinned.glb")) <= 0);
    struct mesh_check check;
    struct character skinned; /* with the bone weights that have come along */
    char error[CHARACTER_TEXT];
    ASSERT(character_read(scratch("skinned.glb"), NULL, &skinned, error));
    ASSERT(skinned.skinned && skinned.unnormal == 0 && skinned.unweighted == 0);
    ASSERT_EQ(19 + 2, skinned.joint_count); /* the target's joints, the body's node and the file's root */
    struct mesh joined; /* in the neutral pose, without the charts' seams */
    ASSERT(mesh_read(scratch("skinned.glb"), &joined, error));
    ASSERT(mesh_check(joined.positions, (int)joined.vertex_count, (const int *)joined.indices, (int)joined.triangle_count, &check));
    ASSERT_EQ(0, check.intersections);
    ASSERT_EQ(0, check.open_edges);
    mesh_free(&joined);
    character_free(&skinned);
    const char *const made[] = {"morph.png", "strip.png", "frame000.png", "frame005.png"};
    for (int i = 0; i < 4; ++i) {
        struct image picture;
        ASSERTm(made[i], image_read_file(scratch(made[i]), &picture));
        image_free(&picture);
    }
    PASS();
}

/* Two rigs that share no name, of different sizes, one without hands, one without feet: a tail and horns grow, arms shrink. */
TEST a_morph_between_two_rigs(void)
{
    for (int armless = 0; armless < 2; ++armless) {
        struct character source, target;
        char error[CHARACTER_TEXT];
        ASSERT(character_build(armless, &source, error) && character_build(1, &target, error));
        if (armless) cut_off(&target, "arm"), cut_off(&target, "hand");
        change_rig(&source, "hand", 40.0, 1.5707963);
        change_rig(&target, "foot", 0.1, 0.0);
        ASSERT(gltf_write_character(scratch("a.glb"), &source) && gltf_write_character(scratch("b.glb"), &target));
        character_free(&source);
        character_free(&target);
        const char *const line[] = {scratch("a.glb"), scratch("b.glb"), "--grid",           "64",  "--frames", "22",
                                    "--blend",        "9",              "--quiet", "--json", scratch("rigs.json"), NULL};
        ASSERT_EQ(0, run_program(line));
        cJSON *json = read_report(scratch("rigs.json"));
        ASSERT(json != NULL);
        ASSERT_STR_EQ("limbs", cJSON_GetObjectItem(json, "joints_paired_by")->valuestring);
        ASSERT_EQ((int)number_of(json, "frames"), (int)number_of(json, "watertight_frames"));
        ASSERT_EQ(1, (int)number_of(json, "components_most"));
        ASSERT_EQ(0, (int)number_of(json, "frames_with_more_handles"));
        ASSERT_EQ(0, (int)number_of(json, "specks_left_out_most"));
        ASSERT(number_of(json, "distance_to_target_mean_voxels") < 0.15);
        ASSERT(number_of(json, "distance_from_target_mean_voxels") < 0.15);
        ASSERT(number_of(json, "distance_max_voxels") < 3.0);
        ASSERT(number_of(json, "volume_off_monotone_percent") < 5.0);
        cJSON_Delete(json);
    }
    PASS();
}

/* Shows a file by three.js in Chromium, and keeps what is seen in build/test/pictures. Returns 0, 1: it is not shown, -1: one of
 * these is missing. */
static int gltf_shown(const char *path, const char *name, const char *clip)
{
    char command[1200];
    snprintf(command, sizeof command,
             "mkdir -p build/test/pictures && command -v node > /dev/null 2>&1 || exit 77; "
             "timeout 100 node tests/examples/gltf_view.js '%s' build/test/pictures/%s.png %s", path, name, clip);
    return gltf_run(command);
}

/* The files of the morph before this test, in a browser; the pictures are left for the eye. */
TEST three_js_shows_the_files(void)
{
    if (access(scratch("morph.glb"), R_OK) != 0) SKIPm("the test that writes the files has not run");
    const int sequence = gltf_shown(scratch("morph.glb"), "morph", "morph");
    if (sequence < 0) SKIPm("no node, three.js (.ci/deps.sh judges) or Chromium");
    ASSERT_EQ(0, sequence);
    ASSERT_EQ(0, gltf_shown(scratch("skinned.glb"), "skinned", "walk"));
    ASSERT_EQ(1, gltf_shown(scratch("skinned.glb"), "none", "swim"));
    PASS();
}

/* ---- sheets ---- */

enum { SHEET = 10, BOX_CORNERS = 8, CAPE_VERTICES = (SHEET + 1) * (SHEET + 1) + BOX_CORNERS,
       CAPE_TRIANGLES = 2 * SHEET * SHEET + 12 };

/* A body of a box on two bones, a cape behind it that leans, or one of these alone. */
static void make_cape(struct character *c, bool box, bool cape)
{
    static float positions[3 * CAPE_VERTICES], normals[3 * CAPE_VERTICES], uvs[2 * CAPE_VERTICES], colors[3 * CAPE_VERTICES];
    static int triangles[3 * CAPE_TRIANGLES], materials_of[CAPE_TRIANGLES];
    static struct influences influences[CAPE_VERTICES];
    static const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    *c = by_hand();
    c->positions = positions, c->normals = normals, c->uvs = uvs, c->colors = colors, c->triangles = triangles;
    c->materials_of = materials_of, c->influences = influences, c->triangle_count = 0;
    for (int v = 0; v < BOX_CORNERS; ++v) {
        const float p[3] = {v & 1 ? 0.3f : -0.3f, v & 2 ? 2.0f : 0.0f, v & 4 ? 0.25f : -0.25f};
        memcpy(positions + 3 * v, p, sizeof p);
    }
    for (int f = 0; box && f < 6; ++f) {
        const int *q = faces[f], two[6] = {q[0], q[1], q[2], q[0], q[2], q[3]};
        memcpy(triangles + 3 * c->triangle_count, two, sizeof two);
        c->triangle_count += 2;
    }
    c->vertex_count = BOX_CORNERS;
    for (int i = 0; cape && i <= SHEET; ++i) {
        for (int k = 0; k <= SHEET; ++k, ++c->vertex_count) {
            const float p[3] = {(float)k / SHEET - 0.5f, 1.9f * (float)i / SHEET, -0.25f - 0.5f * (1.0f - (float)i / SHEET)};
            memcpy(positions + 3 * c->vertex_count, p, sizeof p);
            if (i < SHEET && k < SHEET) {
                const int a = c->vertex_count, two[6] = {a, a + 1, a + SHEET + 2, a, a + SHEET + 2, a + SHEET + 1};
                memcpy(triangles + 3 * c->triangle_count, two, sizeof two);
                c->triangle_count += 2;
            }
        }
    }
    for (int v = 0; v < c->vertex_count; ++v) {
        memset(&influences[v], 0, sizeof influences[v]);
        influences_add(&influences[v], 0, 1.0f - 0.5f * positions[3 * v + 1]);
        influences_add(&influences[v], 1, 0.5f * positions[3 * v + 1] + 1e-6f);
        influences_normalize(&influences[v], 0);
    }
    for (int i = 0; i < 3 * c->vertex_count; ++i) colors[i] = 1.0f;
    character_smooth(c, 0, 0);
}

TEST sheets_become_one_voxel_thick(void)
{
    struct character c;
    FILE *errors = freopen(scratch("notes"), "w", stderr);
    ASSERT(errors != NULL);
    make_cape(&c, true, true);
    ASSERT(gltf_write_character(scratch("cape.glb"), &c));
    make_cape(&c, true, false);
    ASSERT(gltf_write_character(scratch("box.glb"), &c));
    make_cape(&c, false, true);
    ASSERT(gltf_write_character(scratch("sheet.glb"), &c));
    const char *const worn[] = {scratch("cape.glb"), scratch("box.glb"), "--grid", "40", "--frames", "2",
                                "--json", scratch("cape.json"), NULL};
    ASSERT_EQ(0, run_program(worn));
    cJSON *json = read_report(scratch("cape.json"));
    ASSERT(json != NULL);
    const int bare = (int)number_of(cJSON_GetObjectItem(json, "source"), "sheet_triangles"); /* the upper edge touches the box */
    ASSERT(bare > 3 * SHEET * SHEET / 2 && bare <= 2 * SHEET * SHEET);
    ASSERT_EQ(0, (int)number_of(cJSON_GetObjectItem(json, "target"), "sheet_triangles"));
    ASSERT_EQ(1, (int)number_of(cJSON_GetObjectItem(json, "source"), "bodies_found"));
    ASSERT_EQ(2, (int)number_of(json, "watertight_frames"));
    ASSERT_EQ(1, (int)number_of(json, "components_most"));
    cJSON_Delete(json);
    const char *const alone[] = {scratch("sheet.glb"), scratch("sheet.glb"), "--grid", "40", "--frames", "2", "--quiet", NULL};
    ASSERT_EQ(0, run_program(alone));
    const char *const left[] = {scratch("sheet.glb"), scratch("box.glb"), "--grid", "40", "--frames", "2",
                                "--thicken", "0", "--quiet", NULL};
    ASSERT_EQ(1, run_program(left));
    fflush(stderr);
    size_t length;
    char *text = whole_file(scratch("notes"), &length);
    ASSERTm(text, strstr(text, "cape.glb: sheets without an inside (1, of "));
    ASSERTm(text, strstr(text, " triangles) are made one voxel thick; --thicken X"));
    ASSERTm(text, strstr(text, "sheet.glb: encloses nothing: a sheet; --thicken 1 makes it solid"));
    free(text);
    PASS();
}

TEST weights_from_nothing(void)
{
    const char *const line[] = {
        "--weights", "--grid", "48", "--size", "64", "--quiet", "--out", folder, "--json", scratch("weights.json"), NULL};
    struct character rigged;
    char error[CHARACTER_TEXT];
    ASSERT_EQ(0, run_program(line));
    cJSON *json = read_report(scratch("weights.json"));
    ASSERT(json != NULL);
    ASSERT(number_of(json, "weights_from_artists_mean_l1") < 0.6);
    ASSERT(number_of(json, "weight_sum_error_max") < 1e-4);
    cJSON_Delete(json);
    ASSERT(character_read(scratch("rigged.glb"), NULL, &rigged, error));
    ASSERT(rigged.skinned && rigged.animation_count == 1);
    ASSERT(gltf_problems(scratch("rigged.glb")) <= 0);
    character_free(&rigged);
    PASS();
}

TEST wrong_lines_end_with_a_status(void)
{
    FILE *quiet = freopen(scratch("errors"), "w", stderr);
    const char *const unknown[] = {"--nonsense", NULL}, *const alone[] = {"one.glb", NULL},
                      *const small[] = {"--grid", "8", NULL};
    const char *const absent[] = {"a.glb", "b.glb", NULL}, *const still[] = {"--animation", "Swim", "--grid", "32", NULL};
    const char *const props[] = {"--props", "nope", "--grid", "32", NULL};
    const char *const texture[] = {"--texture", "8", "--grid", "32", "--quiet", "--out", scratch("texture"), NULL};
    const char *const points[][4] = {
        {scratch("point.obj"), "a.glb"}, {scratch("point.obj"), "--weights"}, {"--donor", scratch("point.obj"), "--weights"}};
    const char *const vain[][4] = {{"--list", "--weights"}, {"--weights", "--frames", "3"}, {"--weights", "a.glb", "b.glb"},
                                   {"--size", "64"}, {"--view", "0,0,1"}, {"--texture", "0"}, {"--channel"}};
    const char *const donor[] = {scratch("flat.obj"), "--weights", "--donor", scratch("flat.obj"), "--grid", "32", NULL};
    FILE *flat = fopen(scratch("flat.obj"), "w");
    ASSERT(flat && fputs("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", flat) >= 0 && fclose(flat) == 0);
    FILE *point = fopen(scratch("point.obj"), "w");
    ASSERT(point && fputs("v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", point) >= 0 && fclose(point) == 0);
    ASSERT(quiet != NULL);
    for (size_t i = 0; i < sizeof points / sizeof *points; ++i) ASSERT_EQ(1, run_program(points[i]));
    for (size_t i = 0; i < sizeof vain / sizeof *vain; ++i) ASSERT_EQm(vain[i][0], 2, run_program(vain[i]));
    ASSERT_EQ(2, run_program(unknown));
    ASSERT_EQ(2, run_program(alone));
    ASSERT_EQ(2, run_program(small));
    ASSERT_EQ(1, run_program(absent));
    ASSERT_EQ(1, run_program(still));
    ASSERT_EQ(1, run_program(props));
    ASSERT_EQ(1, run_program(texture));
    ASSERT_EQ(1, run_program(donor));
    fflush(stderr);
    size_t length, lines = 0, named = 0, refused = 0;
    char *text = whole_file(scratch("errors"), &length);
    for (size_t i = 0; i < length; ++i) lines += text[i] == '\n';
    ASSERT_EQ(18u, lines);
    for (const char *t = text; (t = strstr(t, "point.obj: the body has no size")) != NULL; ++t) ++named;
    for (const char *t = text; (t = strstr(t, " has no effect with")) != NULL; ++t) ++refused;
    ASSERT_EQ(3u, named);
    ASSERT_EQ(7u, refused);
    ASSERT(strstr(text, "nope") && strstr(text, "--texture 8") && strstr(text, "flat.obj: no part has bones"));
    free(text);
    PASS();
}

TEST characters_of_the_collection(void)
{
    const char *data = getenv("SPRINGLS_DATA");
    char knight[1024], mage[1024], man[1024], robot[1024], error[CHARACTER_TEXT];
    struct character c;
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    snprintf(knight, sizeof knight, "%s/rigged/Knight.glb", data);
    snprintf(mage, sizeof mage, "%s/rigged/Mage.glb", data);
    snprintf(man, sizeof man, "%s/rigged/CesiumMan.glb", data);
    snprintf(robot, sizeof robot, "%s/rigged/robot_expressive.glb", data);
    ASSERT(character_read(man, NULL, &c, error));
    ASSERT_EQ(210, c.unnormal); /* the trap: weights that sum to 0.18 to 0.99 */
    ASSERT_EQ(3273, c.vertex_count);
    ASSERT(c.picture_count == 1 && c.pictures[0].image.rgb != NULL);
    character_free(&c);
    ASSERT(character_read(robot, NULL, &c, error)); /* bones and parts share names */
    ASSERT_EQ(19, c.part_count);
    ASSERT_EQ(0, c.unweighted);
    character_free(&c);
    ASSERT(character_read(knight, "helmet,cape", &c, error));
    ASSERT_EQ(8, c.part_count);
    ASSERT_EQ(9, c.prop_count);
    ASSERT(character_animation(&c, "Walking_A") >= 0 && character_animation(&c, "3") == 3 && character_animation(&c, "99") == -1);
    character_free(&c);
    const char *const line[] = {
        knight,    mage,     "--animation",          "Walking_A", "--grid", "40", "--frames", "3", "--blend", "2",
        "--channel", "--quiet", "--json", scratch("knight.json"), NULL};
    ASSERT_EQ(0, run_program(line));
    CHECK_CALL(check_report(scratch("knight.json"), 3, 0.6));
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(a_morph_from_nothing);
    RUN_TEST(a_morph_between_two_rigs);
    RUN_TEST(three_js_shows_the_files);
    RUN_TEST(sheets_become_one_voxel_thick);
    RUN_TEST(weights_from_nothing);
    RUN_TEST(characters_of_the_collection);
    RUN_TEST(wrong_lines_end_with_a_status);
    if (!remove_folder()) return 1;
    GREATEST_MAIN_END();
}

#endif
