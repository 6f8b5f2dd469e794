/* fuzz_surface.c - files of meshes and of characters: read, or refused in a line. The first byte chooses the extension. */
#define _POSIX_C_SOURCE 200809L
#include "fuzz_file.h"
#include "../../examples/common/character/character.h"
#include "../../examples/common/surface/mesh_io.h"

/* assimp 5.2 leaks memory of its own on some broken files. It has no frame pointers: only slow unwinding shows whose leak it is. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libassimp\n"; }
const char *__asan_default_options(void);
const char *__asan_default_options(void) { return "fast_unwind_on_malloc=0"; }

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const extensions[] = { ".ply", ".obj", ".stl", ".off", ".gltf", ".glb" };
    char path[256], error[MESH_TEXT] = "", reason[CHARACTER_TEXT] = "";
    struct mesh mesh;
    struct character character;
    size_t i;
    if (!size) return 0;
    fuzz_file_write(path, extensions[data[0] % 6], data + 1, size - 1);
    if (mesh_read(path, &mesh, error)) {
        for (i = 0; i < 3 * mesh.vertex_count; i++) FUZZ_CHECK(mesh.positions[i] - mesh.positions[i] == 0.0f);
        for (i = 0; i < 3 * mesh.triangle_count; i++) FUZZ_CHECK(mesh.indices[i] < mesh.vertex_count);
    } else {
        fuzz_check_reason(error);
        FUZZ_CHECK(mesh.vertex_count == 0);
    }
    mesh_free(&mesh);
    if (character_read(path, NULL, &character, reason)) character_free(&character);
    else fuzz_check_reason(reason);
    unlink(path);
    return 0;
}
