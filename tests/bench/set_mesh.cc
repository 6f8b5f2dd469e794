/* set_mesh GRID MESH... - how long it takes to set a model from a mesh and to extract its zero level, beside OpenVDB's meshToLevelSet and
   volumeToMesh where that is installed. A voxel is a (GRID - 10)th of the mesh's longest side; seconds of the processor, one thread. */
#define SPRINGLS_STATIC
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#if __has_include(<openvdb/openvdb.h>)
#define WITH_OPENVDB 1
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/global_control.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <vector>

extern "C" {
#include "examples/common/base/cli.h"
#include "examples/common/solids/solid_grid.h"
#include "examples/common/surface/mesh_io.h"
}

namespace {

/* Seconds of the processor. */
struct Times {
    double set = 0.0, extract = 0.0;
};

double now() { return double(std::clock()) / CLOCKS_PER_SEC; }

void check(const char *mesh, springls_context *ctx, springls_status status)
{
    if (status == SPRINGLS_OK) return;
    std::fprintf(stderr, "set_mesh: %s: %s\n", mesh, ctx ? springls_last_error(ctx) : "not enough memory");
    std::exit(1);
}

Times ours(const char *name, const mesh &m, const springls_grid_desc &grid)
{
    springls_params params = springls_default_params();
    springls_desc desc;
    springls_context *ctx = nullptr;
    springls_mesh surface;
    Times times;
    std::vector<int> triangles(m.indices, m.indices + 3 * m.triangle_count);
    std::memset(&desc, 0, sizeof desc);
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    desc.grid = grid;
    desc.params = &params;
    check(name, ctx, springls_create(&desc, &ctx));
    const double begun = now();
    check(name, ctx, springls_set_mesh(ctx, m.positions, int(m.vertex_count), 0, triangles.data(), int(m.triangle_count), nullptr));
    times.set = now() - begun;
    check(name, ctx, springls_extract_mesh(ctx, &surface));
    times.extract = now() - begun - times.set;
    springls_mesh_free(ctx, &surface);
    springls_destroy(ctx);
    return times;
}

#ifdef WITH_OPENVDB
Times of_openvdb(const mesh &m, double spacing)
{
    const float width = 3.0f; /* of the band, voxels: what volumeToMesh needs */
    const auto transform = openvdb::math::Transform::createLinearTransform(spacing);
    std::vector<openvdb::Vec3s> points(m.vertex_count), surface;
    std::vector<openvdb::Vec3I> triangles(m.triangle_count), rest;
    std::vector<openvdb::Vec4I> quads;
    Times times;
    for (std::size_t v = 0; v < points.size(); ++v) points[v] = openvdb::Vec3s(m.positions + 3 * v);
    for (std::size_t t = 0; t < triangles.size(); ++t) triangles[t] = openvdb::Vec3I(m.indices + 3 * t);
    const double begun = now();
    const auto grid = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, points, triangles, width);
    times.set = now() - begun;
    openvdb::tools::volumeToMesh(*grid, surface, rest, quads, 0.0);
    times.extract = now() - begun - times.set;
    return times;
}
#endif

/* Ends a row with OpenVDB's seconds and the ratio of ours to them, "-" where OpenVDB is not installed. */
void print_other(double own, double other)
{
#ifdef WITH_OPENVDB
    std::printf(" %.2f | %.1f |\n", other, own / other);
#else
    (void)own, (void)other;
    std::printf(" - | - |\n");
#endif
}

/* Prints the row of a mesh; returns both sums, ours and OpenVDB's. */
std::pair<double, double> row(const char *path, int size)
{
    char error[MESH_TEXT];
    mesh m;
    double lower[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, upper[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    if (!mesh_read(path, &m, error)) {
        std::fprintf(stderr, "set_mesh: %s\n", error);
        std::exit(1);
    }
    for (std::size_t i = 0; i < 3 * m.triangle_count; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const double x = double(m.positions[3 * std::size_t(m.indices[i]) + c]);
            lower[c] = std::min(lower[c], x);
            upper[c] = std::max(upper[c], x);
        }
    const springls_grid_desc grid = solid_grid_of(lower, upper, size);
    const Times own = ours(path, m, grid);
    const double sum = own.set + own.extract;
    double other = 0.0;
    std::printf("| %s | %zu | %.2f | %.2f | %.2f |", std::strrchr(path, '/') ? std::strrchr(path, '/') + 1 : path, m.triangle_count,
                own.set, own.extract, sum);
#ifdef WITH_OPENVDB
    const Times theirs = of_openvdb(m, grid.spacing[0]);
    other = theirs.set + theirs.extract;
#endif
    print_other(sum, other);
    std::fflush(stdout);
    mesh_free(&m);
    return {sum, other};
}

} // namespace

int main(int argc, char **argv)
{
    int size = 0;
    double sum = 0.0, other = 0.0;
    if (argc < 3 || !cli_read_int(argv[1], &size) || size < 24 || size > 1024) {
        std::fprintf(stderr, "usage: set_mesh GRID MESH... (a grid of 24 to 1024)\n");
        return 2;
    }
#ifdef WITH_OPENVDB
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    openvdb::initialize();
#endif
    std::printf("| Mesh | Triangles | Set, s | Extract, s | Both, s | OpenVDB, s | Ratio |\n|---|---|---|---|---|---|---|\n");
    for (int i = 2; i < argc; ++i) {
        const auto both = row(argv[i], size);
        sum += both.first;
        other += both.second;
    }
    std::printf("| all | | | | %.2f |", sum);
    print_other(sum, other);
    return 0;
}
