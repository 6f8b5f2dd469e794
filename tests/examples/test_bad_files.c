/* test_bad_files.c - broken and cut files, and every file of a collection of broken ones, through the readers of examples/common and
   on into the library: a reader fails with one line, or what it has read becomes a model, or the library refuses it with a reason.
   Compiled like test_common.c, else skipped; the collection is skipped where SPRINGLS_DATA is not set. */
#define _POSIX_C_SOURCE 200809L
#include "fixtures.h"

#ifdef TEST_EXAMPLES_COMMON
#include "../../examples/common/surface/mesh_io.h"
#include "../../examples/common/imaging/volume.h"
#include "scratch.h"

#include <dirent.h>
#include <sys/stat.h>

/* assimp 5.2 loses memory of its own on some broken files; LeakSanitizer calls this function for what to ignore. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libassimp\n"; }

/* ---- broken on purpose ---- */

/* What assimp would wait for, end the program at, or reserve all memory for. */
TEST broken_surfaces_are_refused(void)
{
#define PLY_VERTICES "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
#define PLY_FACES "element face 2\nproperty list uchar int vertex_indices\n"
#define PLY_PLACES "0 0 0\n1 0 0\n0 1 0\n"
    static const struct {
        const char *name, *text, *reason;
    } files[] = {
        {"a.ply", PLY_VERTICES "element face 1\n", "has no end"},
        {"a.ply", PLY_VERTICES PLY_FACES "end_headers\n" PLY_PLACES, "line 9 of the PLY header"},
        {"a.ply", PLY_VERTICES "\n" PLY_FACES "end_header\n" PLY_PLACES, "line 7 of the PLY header"},
        {"a.ply", "ply\nformat ascii 1.0\nelement vertex 300000000e-8\nend_header\n" PLY_PLACES, "line 3 of the PLY header"},
        {"a.ply", "ply\nformat ascii 1.0\nelement vertex 00000000000000000000000000000003000\nend_header\n" PLY_PLACES,
         "line 3 of the PLY header"},
        {"a.ply", "PLY\nformat ascii 1.0\nelement vertex 4000000000\nend_header\n", "promises 4000000000 elements"},
        {"a.ply", PLY_VERTICES PLY_FACES "end_header\n" PLY_PLACES "3 0 1 2\n0\n", "a face has no corners"},
        {"a.ply", PLY_VERTICES PLY_FACES "end_header\n" PLY_PLACES "3 0 1 2\n3 0 1 7\n", "names vertex 7 of 3"},
        {"a.ply", PLY_VERTICES PLY_FACES "end_header\n" PLY_PLACES "3 0 1 2\n3 0 1\n", "face 1 has fewer values"},
        {"a.ply", PLY_VERTICES PLY_FACES "end_header\n" PLY_PLACES "3 0 1 2 1\n3 0 1 2\n", "face 0 has more values"},
        {"a.ply", PLY_VERTICES PLY_FACES "end_header\n" PLY_PLACES "3 0 1 2\n-3 0 1 2\n", "face 1: its list has no length"},
        {"a.ply", PLY_VERTICES PLY_FACES "end_header\n" PLY_PLACES "3000000000e-9 0 1 2\n3 0 1 2\n", "face 0: its list has no length"},
        {"a.ply", PLY_VERTICES PLY_FACES "end_header\n" PLY_PLACES "999999999 0 1 2\n3 0 1 2\n", "face 0 has fewer values"},
        {"a.ply", PLY_VERTICES PLY_FACES "end_header\n" PLY_PLACES "\n3 0 1 2\n", "the file ends in face 1"},
        {"a.ply",
         PLY_VERTICES "element stroke 1\nproperty list uchar int n\n" PLY_FACES "end_header\n" PLY_PLACES "1 0\n3 0 1 2\n3 0 1 2\n",
         "elements 'stroke' before those of 'face' are not read"},
        {"a.ply", PLY_VERTICES "property list float int n\nend_header\n", "line 7 of the PLY header"},
        {"a.ply", "plyx\nformat ascii 1.0\nend_header\n", "a PLY file begins with ply"},
        {"a.txt", "plyx\nformat ascii 1.0\nend_header\n", "a PLY file begins with ply"},
        {"a.ply", "ply\nformat text 1.0\nend_header\n", "line 2 of the PLY header"},
        {"a.ply", "ply\nelement vertex 3\nend_header\n", "the PLY header has no format"},
        {"a.ply", "ply\nformat binary_big_endian 1.0\nelement face 1\nproperty list int int n\nend_header\n\xff\xff\xff\xfd",
         "face 0: its list has no length, or a negative one"},
        {"a.ply", "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list int int n\nend_header\n\xff\xff\xff\x7f",
         "the file ends in face 0"},
        {"a.off", "OFF\n# places\n3 4000000000 0\n" PLY_PLACES "3 0 1 2\n", "promises 4000000000 elements"},
        {"a.off", "COFF 4000000000 1 0\n", "promises 4000000000 elements"},
        {"a.off", "OFF\n3 400000000e-8 0\n" PLY_PLACES "3 0 1 2\n3 0 1 2\n3 0 1 2\n3 0 1 2\n", "no numbers of vertices and faces"},
        {"a.off", "OFF 3e0 400000000\n3 1 0\n" PLY_PLACES "3 0 1 2\n", "no numbers of vertices and faces"},
        {"a.off", "OFF\n3 2 0\n" PLY_PLACES "3 0 1 2\n", "ends before its 3 vertices and 2 faces"},
        {"a.off", "OFF\n3 2 0\n" PLY_PLACES "3 0 1 2\n0\n", "face 1 has not 1 to 9 corners"},
        {"a.off", "OFF\n3 2 0\n" PLY_PLACES "3 0 1 2\n3 0 1 -2\n", "face 1 names vertex -2 of 3"},
        {"a.off", "OFF\n3 2 0\n" PLY_PLACES "3 0 1 2\n3 0 1\n", "face 1 has fewer than 3 corners"},
    };
    for (size_t i = 0; i < sizeof files / sizeof *files; ++i) {
        char error[MESH_TEXT];
        struct mesh mesh;
        FILE *file = fopen(scratch(files[i].name), "wb");
        ASSERT(file && fputs(files[i].text, file) >= 0);
        fclose(file);
        ASSERT_FALSE(mesh_read(scratch(files[i].name), &mesh, error));
        ASSERTm(error, strstr(error, files[i].reason) && !strchr(error, '\n'));
    }
    char error[MESH_TEXT];
    struct mesh mesh;
    ASSERT_FALSE(mesh_read("tests", &mesh, error));
    ASSERTm(error, strstr(error, "a folder"));
    PASS();
}

/* Every cut of a good file, plain and compressed, is refused (or, where only padding went, read). */
TEST cut_volumes_are_refused(void)
{
    const int dims[3] = {6, 5, 4};
    const float spacing[3] = {1.0f, 1.0f, 1.0f}, origin[3] = {0.0f, 0.0f, 0.0f};
    static const char *const names[] = {"c.nii", "c.nii.gz"};
    struct volume made, back;
    char error[VOLUME_TEXT], text[4096];
    ASSERT(volume_create(dims, spacing, origin, &made));
    for (int n = 0; n < 2; ++n) {
        const char *path = scratch(names[n]);
        ASSERT(volume_write(path, &made, VOLUME_FLOAT32, made.data, error));
        FILE *file = fopen(path, "rb");
        ASSERT(file);
        const size_t size = fread(text, 1, sizeof text, file);
        fclose(file);
        for (size_t cut = 0; cut < size; cut += 3) {
            file = fopen(path, "wb");
            ASSERT(file);
            fwrite(text, 1, cut, file);
            fclose(file);
            ASSERT_FALSE(volume_read(path, 0, &back, error));
            ASSERT(error[0] && !strchr(error, '\n'));
        }
    }
    volume_free(&made);
    PASS();
}

/* ---- the collection ---- */

typedef struct tally { int files, meshes, volumes, refused, models; } tally; /* refused: by both readers */

/* A step, and the mesh is closed. */
static greatest_test_res use(springls_context *ctx)
{
    float wind[3] = { 0.3f, 0.1f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_mesh mesh;
    springls__mesh_report report;
    forces.voxel_units = true; /* the meshes are of any size */
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    report = fixture_report(&mesh);
    ASSERT_EQ(0, report.boundary_edges);
    ASSERT_EQ(0, report.nonmanifold_edges);
    springls_mesh_free(ctx, &mesh);
    PASS();
}

/* A grid of about 40 voxels a side, with a margin of four, around the mesh. */
static springls_desc grid_around(const struct mesh *mesh)
{
    springls_desc desc = fixture_desc(48, NULL);
    double lower[3] = { DBL_MAX, DBL_MAX, DBL_MAX }, upper[3] = { -DBL_MAX, -DBL_MAX, -DBL_MAX }, side = 0.0;
    size_t i;
    int k;
    for (i = 0; i < mesh->vertex_count; i++)
        for (k = 0; k < 3; k++) {
            lower[k] = fmin(lower[k], (double)mesh->positions[3 * i + (size_t)k]);
            upper[k] = fmax(upper[k], (double)mesh->positions[3 * i + (size_t)k]);
        }
    for (k = 0; k < 3; k++) side = fmax(side, upper[k] - lower[k]);
    for (k = 0; k < 3; k++) {
        desc.grid.spacing[k] = side > 0.0 ? side / 40.0 : 1.0;
        desc.grid.origin[k] = lower[k] - 4.0 * desc.grid.spacing[k];
    }
    return desc;
}

static greatest_test_res try_mesh(const struct mesh *mesh, tally *t)
{
    springls_desc desc = grid_around(mesh);
    springls_context *ctx;
    springls_status status = springls_create(&desc, &ctx);
    size_t i;
    int *triangles;
    if (status != SPRINGLS_OK) { /* coordinates beyond all bounds */
        ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, status);
        PASS();
    }
    triangles = (int *)malloc((mesh->triangle_count * 3 + 1) * sizeof *triangles);
    for (i = 0; i < mesh->triangle_count * 3; i++) triangles[i] = (int)mesh->indices[i];
    status = springls_set_mesh(ctx, mesh->positions, (int)mesh->vertex_count, 0, triangles, (int)mesh->triangle_count, NULL);
    free(triangles);
    ASSERT(status == SPRINGLS_OK || (status == SPRINGLS_BAD_MESH && strlen(springls_last_error(ctx)) > 10));
    t->models += status == SPRINGLS_OK;
    if (status == SPRINGLS_OK) CHECK_CALL(use(ctx));
    springls_destroy(ctx);
    PASS();
}

static greatest_test_res try_volume(const struct volume *volume, tally *t)
{
    springls_desc desc = fixture_desc(0, NULL);
    springls_context *ctx;
    springls_status status;
    memcpy(desc.grid.size, volume->dims, sizeof desc.grid.size);
    status = springls_create(&desc, &ctx);
    if (status != SPRINGLS_OK) { /* a side shorter than four voxels */
        ASSERT_EQ(SPRINGLS_INVALID_ARGUMENT, status);
        PASS();
    }
    status = springls_set_threshold(ctx, volume->data, 0.5f * (volume->minimum + volume->maximum), FLT_MAX);
    ASSERT(status == SPRINGLS_OK || (status == SPRINGLS_EMPTY_MODEL && strlen(springls_last_error(ctx)) > 10));
    t->models += status == SPRINGLS_OK;
    if (status == SPRINGLS_OK) CHECK_CALL(use(ctx));
    springls_destroy(ctx);
    PASS();
}

/* Both readers on one file, whatever its name. */
static greatest_test_res try_file(const char *path, tally *t)
{
    char error[512]; /* room for MESH_TEXT and VOLUME_TEXT */
    struct mesh mesh;
    struct volume volume;
    bool read;
    t->files++;
    error[0] = '\0';
    read = mesh_read(path, &mesh, error);
    if (read) {
        t->meshes++;
        CHECK_CALL(try_mesh(&mesh, t));
    } else {
        ASSERTm(path, error[0] && !strchr(error, '\n') && mesh.vertex_count == 0);
    }
    mesh_free(&mesh);
    error[0] = '\0';
    if (volume_read(path, 0, &volume, error)) {
        read = true;
        t->volumes++;
        CHECK_CALL(try_volume(&volume, t));
    } else {
        ASSERTm(path, error[0] && !strchr(error, '\n') && volume.data == NULL);
    }
    volume_free(&volume);
    t->refused += !read;
    PASS();
}

static greatest_test_res try_folder(const char *root, tally *t)
{
    DIR *listing = opendir(root);
    struct dirent *entry;
    char path[2048];
    ASSERTm(root, listing != NULL);
    while ((entry = readdir(listing)) != NULL) {
        struct stat about;
        if (entry->d_name[0] == '.') continue;
        snprintf(path, sizeof path, "%s/%s", root, entry->d_name);
        if (stat(path, &about) != 0) continue;
        if (S_ISDIR(about.st_mode)) CHECK_CALL(try_folder(path, t));
        else CHECK_CALL(try_file(path, t));
    }
    closedir(listing);
    PASS();
}

TEST every_bad_file(void)
{
    const char *data = getenv("SPRINGLS_DATA");
    char root[1024];
    tally t = { 0, 0, 0, 0, 0 };
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    snprintf(root, sizeof root, "%s/bad", data);
    CHECK_CALL(try_folder(root, &t));
    ASSERT_GT(t.files, 100);
    ASSERT_GT(t.meshes, 20);
    ASSERT_GTE(t.volumes, 15);
    ASSERT_GTE(t.refused, 15);
    ASSERT_GT(t.models, 30);
    PASS();
}

TEST byte_order_does_not_matter(void)
{
    static const char *const names[] = {"ok_int16.nii", "ok_big_endian.nii"};
    const char *data = getenv("SPRINGLS_DATA");
    struct volume volume[2]; /* little-endian, big-endian */
    char path[1024], error[VOLUME_TEXT];
    int i;
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    for (i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/bad/volumes_generated/%s", data, names[i]);
        ASSERTm(error, volume_read(path, 0, &volume[i], error));
    }
    ASSERT(volume_same_grid(&volume[0], &volume[1]));
    ASSERT_MEM_EQ(volume[0].data, volume[1].data, volume_voxels(&volume[0]) * sizeof(float));
    for (i = 0; i < 2; i++) volume_free(&volume[i]);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(broken_surfaces_are_refused);
    RUN_TEST(cut_volumes_are_refused);
    RUN_TEST(byte_order_does_not_matter);
    RUN_TEST(every_bad_file);
    remove_folder();
    GREATEST_MAIN_END();
}

#else

TEST every_bad_file(void) { SKIPm("examples/common needs libraries that are not here"); }

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(every_bad_file);
    GREATEST_MAIN_END();
}

#endif
