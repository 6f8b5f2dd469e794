/* solids_openvdb INPUT.ply OUTPUT.off SPACING - what Blender's voxel remesh does: a level set of the mesh by OpenVDB's meshToVolume,
   and its zero level by volumeToMesh, in quads that are split. One JSON object on stdout. */
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

extern "C" {
#include "examples/common/surface/mesh_io.h"
}

using openvdb::Vec3I;
using openvdb::Vec3s;
using openvdb::Vec4I;

static bool write_off(const char *path, const std::vector<Vec3s> &points, const std::vector<Vec3I> &triangles,
                      const std::vector<Vec4I> &quads)
{
    std::FILE *file = std::fopen(path, "w");
    if (!file) {
        return false;
    }
    std::fprintf(file, "OFF\n%zu %zu 0\n", points.size(), triangles.size() + 2 * quads.size());
    for (const Vec3s &p : points) {
        std::fprintf(file, "%.9g %.9g %.9g\n", double(p[0]), double(p[1]), double(p[2]));
    }
    for (const Vec3I &t : triangles) { /* OpenVDB's are clockwise from outside */
        std::fprintf(file, "3 %u %u %u\n", t[0], t[2], t[1]);
    }
    for (const Vec4I &q : quads) {
        std::fprintf(file, "3 %u %u %u\n3 %u %u %u\n", q[0], q[2], q[1], q[0], q[3], q[2]);
    }
    return std::fclose(file) == 0;
}

int main(int argc, char **argv)
{
    char error[MESH_TEXT];
    struct mesh mesh;
    const float width = 3.0f; /* of the band, voxels */
    if (argc != 4 || std::atof(argv[3]) <= 0.0) {
        std::fprintf(stderr, "usage: solids_openvdb INPUT OUTPUT SPACING\n");
        return 2;
    }
    if (!mesh_read(argv[1], &mesh, error)) {
        std::fprintf(stderr, "solids_openvdb: %s\n", error);
        return 1;
    }
    openvdb::initialize();
    std::vector<Vec3s> points(mesh.vertex_count), surface;
    std::vector<Vec3I> triangles(mesh.triangle_count), rest;
    std::vector<Vec4I> quads;
    for (std::size_t v = 0; v < points.size(); ++v) {
        points[v] = Vec3s(mesh.positions + 3 * v);
    }
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        triangles[t] = Vec3I(mesh.indices + 3 * t);
    }
    mesh_free(&mesh);
    const openvdb::math::Transform::Ptr transform = openvdb::math::Transform::createLinearTransform(std::atof(argv[3]));
    const openvdb::FloatGrid::Ptr grid = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, points, triangles, width);
    openvdb::tools::volumeToMesh(*grid, surface, rest, quads, 0.0);
    if (!write_off(argv[2], surface, rest, quads)) {
        std::fprintf(stderr, "solids_openvdb: cannot write %s\n", argv[2]);
        return 1;
    }
    std::printf("{\"triangles\": %zu}\n", rest.size() + 2 * quads.size());
    return 0;
}
