/* test_bad_files.c - every file of a collection of broken ones, through the readers of examples/common and on into
   the library: a reader fails with one line, or what it has read becomes a model, or the library refuses it with a reason.
   Compiled with examples/common as test_common.c is; skipped where SPRINGLS_DATA is not set. */
#define _POSIX_C_SOURCE 200809L
#include "fixtures.h"

#ifdef TEST_EXAMPLES_COMMON
#include "../../examples/common/surface/mesh_io.h"
#include "../../examples/common/imaging/volume.h"
#include <dirent.h>
#include <sys/stat.h>

/* assimp 5.2 loses memory of its own on some broken files; LeakSanitizer calls this function for what to ignore. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libassimp\n"; }

typedef struct tally { int files, meshes, volumes, models; } tally;

/* A step, and the mesh is closed. */
static greatest_test_res use(springls_context *ctx)
{
    float wind[3] = { 0.3f, 0.1f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_mesh mesh;
    springls__mesh_report report;
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
    t->files++;
    error[0] = '\0';
    if (mesh_read(path, &mesh, error)) {
        t->meshes++;
        CHECK_CALL(try_mesh(&mesh, t));
    } else {
        ASSERTm(path, error[0] && !strchr(error, '\n') && mesh.vertex_count == 0);
    }
    mesh_free(&mesh);
    error[0] = '\0';
    if (volume_read(path, 0, &volume, error)) {
        t->volumes++;
        CHECK_CALL(try_volume(&volume, t));
    } else {
        ASSERTm(path, error[0] && !strchr(error, '\n') && volume.data == NULL);
    }
    volume_free(&volume);
    PASS();
}

static greatest_test_res try_folder(const char *folder, tally *t)
{
    DIR *listing = opendir(folder);
    struct dirent *entry;
    char path[2048];
    ASSERTm(folder, listing != NULL);
    while ((entry = readdir(listing)) != NULL) {
        struct stat about;
        if (entry->d_name[0] == '.') continue;
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
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
    char folder[1024];
    tally t = { 0, 0, 0, 0 };
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    snprintf(folder, sizeof folder, "%s/bad", data);
    CHECK_CALL(try_folder(folder, &t));
    ASSERT_GT(t.files, 100);
    ASSERT_GT(t.meshes, 20);
    ASSERT_GT(t.volumes, 10);
    ASSERT_GT(t.models, 30);
    PASS();
}
#else
TEST every_bad_file(void) { SKIPm("examples/common needs libraries that are not here"); }
#endif

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(every_bad_file);
    GREATEST_MAIN_END();
}
