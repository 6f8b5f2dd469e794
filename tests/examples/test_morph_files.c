/* Files of examples/morph: glTF read back, with materials and images, animated pictures, and malformed files. Compiled like
 * test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_morph_files_built_without_their_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_morph_files_built_without_their_libraries);
    GREATEST_MAIN_END();
}

#else

#include "character/gltf_character.h"
#include "character/surface_place.h"
#include "morph/apng.h"

#include <assimp/cimport.h>
#include <assimp/scene.h>
#include <dirent.h>
#include <sys/stat.h>

#include "gltf_problems.h"
#include "json_report.h"
#include "morph_fixtures.h"

/* What is missing is counted here; the other tests go on without it. */
TEST files_have_judges(void)
{
    if (!gltf_judges_are_here()) SKIPm("there is no Python with numpy, or no validator of Khronos (.ci/deps.sh judges)");
    PASS();
}

TEST a_sequence_is_read_back(void)
{
    const float colors[24] = {0.1f, 0.5f, 0.9f, 1, 0, 0, 0, 1, 0, 0.02f, 0.2f, 0.3f};
    struct gltf_mesh frames[3];
    memset(frames, 0, sizeof frames);
    for (int f = 0; f < 3; ++f) {
        frames[f].positions = corners, frames[f].colors = colors, frames[f].triangles = tetrahedra;
        frames[f].vertex_count = 8, frames[f].triangle_count = f == 1 ? 8 : 4;
    }
    struct character c;
    char error[CHARACTER_TEXT];
    ASSERT(gltf_write_sequence(scratch("sequence.glb"), frames, 3, 10, NULL));
    ASSERT(gltf_problems(scratch("sequence.glb")) <= 0);
    const struct aiScene *scene = aiImportFile(scratch("sequence.glb"), 0);
    ASSERT(scene != NULL);
    ASSERT_EQ(3u, scene->mNumMeshes);
    ASSERT_EQ(1u, scene->mNumAnimations);
    ASSERT_EQ(3u, scene->mAnimations[0]->mNumChannels);
    const struct aiNodeAnim *second = scene->mAnimations[0]->mChannels[1];
    ASSERT_STR_EQ("frame 1", second->mNodeName.data);
    ASSERT_EQ(3u, second->mNumScalingKeys);
    ASSERT_NEAR(0.0, second->mScalingKeys[0].mValue.x, 0.0);
    ASSERT_NEAR(1.0, second->mScalingKeys[1].mValue.x, 0.0);
    ASSERT_NEAR(100.0, second->mScalingKeys[1].mTime, 1e-3); /* milliseconds */
    ASSERT_NEAR(0.0, second->mScalingKeys[2].mValue.x, 0.0);
    ASSERT_EQ(8u, scene->mMeshes[1]->mNumFaces);
    ASSERT_NEAR(pow(0.5, 2.2), scene->mMeshes[0]->mColors[0][0].g, 1e-4);
    aiReleaseImport(scene);
    ASSERT(!character_read(scratch("none.glb"), NULL, &c, error) && strstr(error, "cannot open"));
    PASS();
}

TEST a_skinned_character_is_read_back(void)
{
    struct character c, again;
    char error[CHARACTER_TEXT];
    struct affine skin[64], places[64], skin_again[64], places_again[64];
    ASSERT(character_build(1, &c, error));
    ASSERT(gltf_write_character(scratch("skinned.glb"), &c));
    ASSERT(gltf_problems(scratch("skinned.glb")) <= 0);
    ASSERT(character_read(scratch("skinned.glb"), NULL, &again, error));
    ASSERT(again.skinned && again.unnormal == 0 && again.vertex_count == c.vertex_count && again.animation_count == 1);
    ASSERT_STR_EQ("walk", again.animations[0].name);
    float *there = malloc(3 * (size_t)c.vertex_count * sizeof *there), *here = malloc(3 * (size_t)c.vertex_count * sizeof *here);
    character_pose(&c, 0, 0.35, 1.0, skin, places);
    character_skin(&c, skin, here);
    character_pose(&again, 0, 0.35, 1.0, skin_again, places_again);
    character_skin(&again, skin_again, there);
    for (int i = 0; i < 3 * c.vertex_count; ++i) {
        ASSERT_NEAR(c.positions[i], again.positions[i], 1e-5);
        ASSERT_NEAR(here[i], there[i], 1e-5); /* the same keys */
        ASSERT_NEAR(c.normals[i], again.normals[i], 1e-5);
    }
    for (int v = 0; v < 3 * c.vertex_count; v += 101) ASSERT_NEAR(c.colors[v], again.colors[v], 2e-3);
    /* Cut anywhere, it is refused in one line. */
    size_t length;
    char *bytes = whole_file(scratch("skinned.glb"), &length);
    for (size_t part = 1; part < 8; ++part) {
        struct character broken;
        FILE *file = fopen(scratch("cut.glb"), "wb");
        fwrite(bytes, 1, length * part / 8, file);
        fclose(file);
        ASSERT(!character_read(scratch("cut.glb"), NULL, &broken, error));
        ASSERT(error[0] && !strchr(error, '\n'));
    }
    free(bytes);
    free(there);
    free(here);
    character_free(&c);
    character_free(&again);
    PASS();
}

/* A square of two triangles whose materials differ: an image in four colors, and red. Corners are doubled along the diagonal. */
static const unsigned char four_colors[] = {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 0};

static void make_square(struct character *c, const struct byte_image *image)
{
    static float positions[18] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0},
                 uvs[12] = {0, 1, 1, 1, 1, 0, 0, 1, 1, 0, 0, 0},
                 normals[18], colors[18];
    static int triangles[6] = {0, 1, 2, 3, 4, 5}, materials_of[2] = {0, 1};
    static struct influences influences[6];
    static struct material materials[2];
    static struct picture picture;
    *c = by_hand();
    c->positions = positions, c->normals = normals, c->uvs = uvs, c->colors = colors, c->influences = influences;
    c->vertex_count = 6, c->triangles = triangles, c->materials_of = materials_of, c->triangle_count = 2;
    c->materials = materials, c->material_count = 2, c->pictures = &picture, c->picture_count = 1;
    for (int v = 0; v < 6; ++v) {
        normals[3 * v] = normals[3 * v + 1] = 0.0f, normals[3 * v + 2] = 1.0f;
        colors[3 * v] = colors[3 * v + 1] = colors[3 * v + 2] = 1.0f;
        memset(&influences[v], 0, sizeof influences[v]);
        influences_add(&influences[v], v % 2, 1.0f);
    }
    materials[0] = materials[1] = material_plain();
    snprintf(materials[0].name, sizeof materials[0].name, "cloth");
    materials[0].image = 0, materials[0].two_sided = true, materials[0].alpha = MATERIAL_MASK, materials[0].cutoff = 0.25f;
    materials[1].base[1] = materials[1].base[2] = 0.0f, materials[1].metallic = 0.75f, materials[1].roughness = 0.125f;
    memset(&picture, 0, sizeof picture);
    picture.image = *image;
}

/* The color at a place is that of its own triangle's material, however near the other one is. */
static greatest_test_res check_square(const struct character *c)
{
    const struct place cloth = {0, {0.25f, 0.5f, 0.25f}}, red = {1, {0.499f, 0.499f, 0.002f}}, edge = {0, {0.499f, 0.002f, 0.499f}};
    float color[3], here[3];
    ASSERT_EQ(2, c->triangle_count);
    place_color(c, &red, color);
    ASSERT(color[0] > 0.99f && color[1] == 0.0f && color[2] == 0.0f);
    place_color(c, &edge, here);
    ASSERT(here[0] + here[1] + here[2] > 0.5f && (here[1] > 0.2f || here[2] > 0.2f));
    place_color(c, &cloth, color); /* the lower right quarter of the image */
    ASSERT(color[0] > 0.8f && color[1] > 0.8f && color[2] < 0.2f);
    PASS();
}

TEST materials_and_images_are_read_back(void)
{
    unsigned char rgb[sizeof four_colors];
    const struct byte_image image = {2, 2, rgb};
    struct character c, again;
    char error[CHARACTER_TEXT];
    memcpy(rgb, four_colors, sizeof rgb);
    make_square(&c, &image);
    ASSERT(gltf_write_character(scratch("square.glb"), &c));
    ASSERT(gltf_problems(scratch("square.glb")) <= 0);
    ASSERT(character_read(scratch("square.glb"), NULL, &again, error));
    ASSERT(again.material_count == 2 && again.picture_count == 1 && again.missing_pictures == 0);
    const struct material *cloth = &again.materials[0], *red = &again.materials[1];
    ASSERT_STR_EQ("cloth", cloth->name);
    ASSERT(cloth->image == 0 && cloth->two_sided && cloth->alpha == MATERIAL_MASK && cloth->cutoff == 0.25f);
    ASSERT(red->image == -1 && !red->two_sided && red->alpha == MATERIAL_OPAQUE);
    ASSERT_NEAR(0.75, red->metallic, 1e-6);
    ASSERT_NEAR(0.125, red->roughness, 1e-6);
    ASSERT_MEM_EQ(four_colors, again.pictures[0].image.rgb, sizeof four_colors);
    CHECK_CALL(check_square(&again));
    /* The image goes on as it was in the file. */
    struct character third;
    ASSERT(gltf_write_character(scratch("again.glb"), &again));
    ASSERT(character_read(scratch("again.glb"), NULL, &third, error));
    ASSERT(third.pictures[0].size == again.pictures[0].size
           && memcmp(third.pictures[0].bytes, again.pictures[0].bytes, again.pictures[0].size) == 0);
    character_free(&third);
    character_free(&again);
    PASS();
}

/* Writes a triangle with an image beside it. extension: of its baseColorTexture, JSON after its index. */
static void write_beside(const char *uri, const char *extension)
{
    static const float data[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1, 1, 1, 0};
    static const char text[] =
        "{\"asset\":{\"version\":\"2.0\"},\"extensionsUsed\":[\"KHR_texture_transform\"],"
        "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{"
        "\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1},\"material\":0}]}],\"materials\":[{\"pbrMetallicRoughness\":{"
        "\"baseColorTexture\":{\"index\":0%s}}}],\"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"%s\"}],\"buffers\":[{\"uri\":"
        "\"beside.bin\",\"byteLength\":60}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,"
        "\"byteLength\":24}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],"
        "\"max\":[1,1,0]},{\"bufferView\":1,\"componentType\":5126,\"count\":3,\"type\":\"VEC2\"}]}";
    FILE *file = fopen(scratch("beside.bin"), "wb");
    fwrite(data, sizeof data, 1, file);
    fclose(file);
    file = fopen(scratch("beside.gltf"), "w");
    fprintf(file, text, extension, uri);
    fclose(file);
}

TEST an_image_beside_the_file_is_read(void)
{
    struct image image;
    struct character c;
    char error[CHARACTER_TEXT];
    ASSERT(image_create(&image, 4, 4, color_rgb(0.2f, 0.4f, 0.8f)));
    ASSERT(image_write_png(&image, scratch("a skin.png")));
    for (int there = 1; there >= 0; --there) {
        write_beside(there ? "a%20skin.png" : "no.png", "");
        ASSERT(character_read(scratch("beside.gltf"), NULL, &c, error));
        ASSERT_EQ(1, c.material_count);
        ASSERT_EQ(there, c.picture_count);
        ASSERT_EQ(!there, c.missing_pictures);
        ASSERT_EQ(there ? 0 : -1, c.materials[0].image);
        for (int v = 0; v < 3; ++v) ASSERT_NEAR(1.0, c.normals[3 * v + 2], 1e-6); /* the file has none */
        character_free(&c);
    }
    image_free(&image);
    PASS();
}

/* KHR_texture_transform: scale, then a quarter turn, then offset, in coordinates whose v runs downwards. */
TEST texture_coordinates_are_moved_as_the_file_says(void)
{
    static const float wanted[] = {0.5f, 0.5f, 0.5f, 0.0f, 0.25f, 0.0f};
    struct image image;
    struct character c;
    char error[CHARACTER_TEXT];
    ASSERT(image_create(&image, 4, 4, color_rgb(0.2f, 0.4f, 0.8f)));
    ASSERT(image_write_png(&image, scratch("a skin.png")));
    write_beside("a%20skin.png", ",\"extensions\":{\"KHR_texture_transform\":{\"offset\":[0.25,0.5],\"rotation\":1.57079633,"
                                 "\"scale\":[0.5,0.25]}}");
    ASSERT(character_read(scratch("beside.gltf"), NULL, &c, error));
    for (int i = 0; i < 6; ++i) ASSERT_NEAR(wanted[i], c.uvs[i], 1e-6);
    character_free(&c);
    image_free(&image);
    PASS();
}

TEST an_animated_picture_begins_with_its_first_frame(void)
{
    struct image frames[2], again;
    size_t length;
    ASSERT(image_create(&frames[0], 9, 7, color_rgb(1.0f, 0.0f, 0.2f))
           && image_create(&frames[1], 9, 7, color_rgb(0.0f, 1.0f, 0.0f)));
    ASSERT(apng_write(scratch("film.png"), frames, 2, 12));
    ASSERT(image_read_file(scratch("film.png"), &again));
    ASSERT(again.width == 9 && again.height == 7);
    for (int i = 0; i < 3 * 9 * 7; ++i) ASSERT_NEAR(frames[0].rgb[i], again.rgb[i], 0.5 / 255.0);
    char *bytes = whole_file(scratch("film.png"), &length);
    int controls = 0;
    for (size_t i = 0; i + 4 < length; ++i) controls += memcmp(bytes + i, "fcTL", 4) == 0;
    ASSERT_EQ(2, controls);
    ASSERT(memcmp(bytes + 37, "acTL", 4) == 0);
    free(bytes);
    image_free(&again);
    image_free(&frames[1]);
    ASSERT(!apng_write(scratch("film.png"), frames, 0, 12));
    image_free(&frames[0]);
    PASS();
}

static greatest_test_res try_folder(const char *name, int *good, int *bad)
{
    DIR *listing = opendir(name);
    struct dirent *entry;
    ASSERTm(name, listing != NULL);
    while ((entry = readdir(listing)) != NULL) {
        char path[1024], error[CHARACTER_TEXT];
        struct stat about;
        if (entry->d_name[0] == '.') continue;
        snprintf(path, sizeof path, "%s/%s", name, entry->d_name);
        if (stat(path, &about) != 0) continue;
        if (S_ISDIR(about.st_mode)) {
            CHECK_CALL(try_folder(path, good, bad));
            continue;
        }
        struct character c;
        error[0] = '\0';
        if (character_read(path, "all", &c, error)) {
            ++*good;
            for (int v = 0; v < c.vertex_count; ++v) {
                float sum = 0.0f;
                for (int k = 0; k < CHARACTER_BONES; ++k) {
                    ASSERTm(path, c.influences[v].joint[k] >= 0 && c.influences[v].joint[k] < c.joint_count);
                    sum += c.influences[v].weight[k];
                }
                ASSERT_NEAR(1.0, sum, 1e-5);
            }
            character_free(&c);
        } else {
            ++*bad;
            ASSERTm(path, error[0] && !strchr(error, '\n') && c.positions == NULL);
        }
    }
    closedir(listing);
    PASS();
}

TEST malformed_files_are_refused_in_one_line(void)
{
    const char *data = getenv("SPRINGLS_DATA"), *const folders[] = {"gltf_validator", "assimp", "meshes_generated"};
    char name[1024];
    int good = 0, bad = 0;
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    for (int f = 0; f < 3; ++f) {
        snprintf(name, sizeof name, "%s/bad/%s", data, folders[f]);
        CHECK_CALL(try_folder(name, &good, &bad));
    }
    ASSERT_GT(bad, 60);
    ASSERT_GT(good, 5);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(files_have_judges);
    RUN_TEST(a_sequence_is_read_back);
    RUN_TEST(a_skinned_character_is_read_back);
    RUN_TEST(materials_and_images_are_read_back);
    RUN_TEST(an_image_beside_the_file_is_read);
    RUN_TEST(texture_coordinates_are_moved_as_the_file_says);
    RUN_TEST(an_animated_picture_begins_with_its_first_frame);
    RUN_TEST(malformed_files_are_refused_in_one_line);
    if (!remove_folder()) return 1;
    GREATEST_MAIN_END();
}

#endif
