/* test_openvdb.cc - beside another library: a torus mesh given to both becomes a level set in both, both make a mesh of springls'
   level set, both unite, intersect and subtract the same bodies, and both turn a torus. Skipped where OpenVDB is not installed. */
#include "greatest.h"
#include "springls.h"
#include "examples/common/springls/exact_flows.h"

GREATEST_MAIN_DEFS();

#if !__has_include(<openvdb/openvdb.h>)

TEST openvdb_is_not_installed(void) { SKIPm("there is no OpenVDB"); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(openvdb_is_not_installed);
    GREATEST_MAIN_END();
}

#else

#include <openvdb/openvdb.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/LevelSetAdvect.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <cmath>
#include <vector>

static const int size = 48;

/* A torus of radii 14 and 6 about the middle of the grid: 48 x 24 quadrilaterals, each two triangles. */
struct Torus {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    Torus()
    {
        const int around = 48, across = 24;
        for (int i = 0; i < around; ++i)
            for (int j = 0; j < across; ++j) {
                const double u = 2.0 * M_PI * i / around, v = 2.0 * M_PI * j / across, ring = 14.0 + 6.0 * std::cos(v);
                const auto at = [&](int k, int l) { return unsigned(k % around * across + l % across); };
                points.emplace_back(23.6 + ring * std::cos(u), 23.3 + ring * std::sin(u), 23.9 + 6.0 * std::sin(v));
                triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
                triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
            }
    }
};

static springls_context *torus_model(const Torus &torus)
{
    springls_desc desc = {};
    springls_context *ctx = nullptr;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = size;
    springls_create(&desc, &ctx);
    springls_set_mesh(ctx, torus.points[0].asPointer(), int(torus.points.size()), 0,
                      reinterpret_cast<const int *>(torus.triangles[0].asPointer()), int(torus.triangles.size()), nullptr);
    return ctx;
}

/* The springls' level set as a grid of OpenVDB, voxel by voxel. */
static openvdb::FloatGrid::Ptr as_openvdb(springls_context *ctx)
{
    auto grid = openvdb::FloatGrid::create(3.0f);
    auto access = grid->getAccessor();
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    for (int z = 0; z < size; ++z)
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const float at[3] = { float(x), float(y), float(z) };
                float phi;
                springls_sample_distance(ctx, at, 1, &phi);
                access.setValue(openvdb::Coord(x, y, z), std::fmax(-3.0f, std::fmin(3.0f, phi)));
            }
    return grid;
}

/* Six times the volume under a triangle. */
static double under(const openvdb::Vec3d &a, const openvdb::Vec3d &b, const openvdb::Vec3d &c) { return a.dot(b.cross(c)); }

/* Both libraries take the mesh's exact distance next to it. */
TEST mesh_distances_agree(void)
{
    const Torus torus;
    springls_context *ctx = torus_model(torus);
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> mesh(torus.points, torus.triangles);
    const auto theirs = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        mesh, *openvdb::math::Transform::createLinearTransform(1.0), 3.0f, 3.0f, openvdb::tools::DISABLE_RENORMALIZATION);
    double worst = 0.0;
    int compared = 0;
    for (auto voxel = theirs->cbeginValueOn(); voxel; ++voxel) {
        const openvdb::Coord ijk = voxel.getCoord();
        const float at[3] = { float(ijk[0]), float(ijk[1]), float(ijk[2]) };
        float phi;
        if (std::fabs(*voxel) > 1.0f) continue; /* further out theirs need not be the nearest triangle's */
        ASSERT_EQ(SPRINGLS_OK, springls_sample_distance(ctx, at, 1, &phi));
        worst = std::fmax(worst, std::fabs(std::fabs(double(phi)) - std::fabs(double(*voxel))));
        if (std::fabs(phi) > 0.1f) ASSERT_EQ(*voxel < 0.0f, phi < 0.0f); /* what is nearer counts as outside with them */
        ++compared;
    }
    ASSERT_GT(compared, 5000);
    ASSERT_LT(worst, 1e-3);
    springls_destroy(ctx);
    PASS();
}

/* Of one and the same level set: vertices of our mesh lie on the zero of their interpolation, and the volumes agree. */
TEST iso_surfaces_agree(void)
{
    const Torus torus;
    springls_context *ctx = torus_model(torus);
    const auto grid = as_openvdb(ctx);
    const openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::BoxSampler> sampler(*grid);
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec4I> quads;
    springls_mesh mesh;
    springls_measures measures;
    double volume = 0.0;
    ASSERT_EQ(SPRINGLS_OK, springls_extract_mesh(ctx, &mesh));
    ASSERT_GT(mesh.vertex_count, 3000);
    for (int i = 0; i < mesh.vertex_count; ++i) {
        const float *x = mesh.positions + 3 * i;
        ASSERT_LT(std::fabs(sampler.isSample(openvdb::Vec3R(x[0], x[1], x[2]))), 2e-3f); /* vertices keep 1e-3 off voxels */
    }
    openvdb::tools::volumeToMesh(*grid, points, quads);
    for (const auto &q : quads) { /* theirs run the other way round */
        volume -= (under(points[q[0]], points[q[1]], points[q[2]]) + under(points[q[0]], points[q[2]], points[q[3]])) / 6.0;
    }
    ASSERT_EQ(SPRINGLS_OK, springls_measure(ctx, &measures));
    ASSERT_IN_RANGE(volume, measures.volume, 0.005 * volume);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* Returns whether their zero passes between a voxel and one beside it. */
static bool at_zero(const openvdb::FloatGrid::ConstAccessor &theirs, const openvdb::Coord &ijk)
{
    bool found = false;
    for (int axis = 0; axis < 3; ++axis)
        for (int way = -1; way <= 1; way += 2) {
            openvdb::Coord beside = ijk;
            beside[axis] += way;
            found = found || (theirs.getValue(beside) < 0.0f) != (theirs.getValue(ijk) < 0.0f);
        }
    return found;
}

/* How far a model is from a level set of theirs, over the voxels at the latter's zero. */
struct Difference {
    double mean = 0.0, largest = 0.0;
    int voxels = 0;
    Difference(springls_context *ctx, const openvdb::FloatGrid &theirs)
    {
        const auto values = theirs.getConstAccessor();
        for (auto voxel = theirs.cbeginValueOn(); voxel; ++voxel) {
            const openvdb::Coord ijk = voxel.getCoord();
            const float at[3] = { float(ijk[0]), float(ijk[1]), float(ijk[2]) };
            float phi;
            if (!at_zero(values, ijk) || springls_sample_distance(ctx, at, 1, &phi) != SPRINGLS_OK) continue;
            mean += std::fabs(double(phi) - double(*voxel));
            largest = std::fmax(largest, std::fabs(double(phi) - double(*voxel)));
            ++voxels;
        }
        mean /= voxels;
    }
    void print() const
    {
        if (GREATEST_IS_VERBOSE()) printf("%d voxels, mean %.4f, largest %.3f\n", voxels, mean, largest);
    }
};

/* Samples a shape of the library within three voxels of its zero. */
static openvdb::FloatGrid::Ptr sampled(springls_implicit_fn shape, void *user)
{
    auto grid = openvdb::FloatGrid::create(3.0f);
    auto access = grid->getAccessor();
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    for (int z = 0; z < size; ++z)
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                const float at[3] = { float(x), float(y), float(z) };
                float phi;
                shape(user, at, 1, &phi);
                if (std::fabs(phi) < 3.0f) access.setValue(openvdb::Coord(x, y, z), phi);
                else if (phi < 0.0f) access.setValueOff(openvdb::Coord(x, y, z), -3.0f);
            }
    return grid;
}

static springls_context *implicit_model(springls_implicit_fn shape, void *user)
{
    springls_desc desc = {};
    springls_context *ctx = nullptr;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = size;
    springls_create(&desc, &ctx);
    springls_set_implicit(ctx, shape, user);
    return ctx;
}

/* Theirs is the smaller or larger of two distances, which is one next to its zero, but at the seam. */
TEST booleans_agree(springls_operation operation)
{
    springls_torus torus = { { 23.6f, 23.3f, 23.9f }, { 0.0f, 0.0f, 1.0f }, 13.0f, 6.0f };
    springls_sphere ball = { { 35.2f, 24.1f, 30.3f }, 8.0f };
    springls_context *ctx = implicit_model(springls_implicit_torus, &torus);
    springls_context *other = implicit_model(springls_implicit_sphere, &ball);
    const auto theirs = sampled(springls_implicit_torus, &torus), cut = sampled(springls_implicit_sphere, &ball);
    ASSERT_EQ(SPRINGLS_OK, springls_combine(ctx, operation, other));
    if (operation == SPRINGLS_OPERATION_UNION) openvdb::tools::csgUnion(*theirs, *cut);
    else if (operation == SPRINGLS_OPERATION_INTERSECTION) openvdb::tools::csgIntersection(*theirs, *cut);
    else openvdb::tools::csgDifference(*theirs, *cut);
    const Difference difference(ctx, *theirs);
    difference.print();
    ASSERT_GT(difference.voxels, 500);
    ASSERT_LT(difference.mean, 0.005);
    ASSERT_LT(difference.largest, 0.2);
    springls_destroy(ctx);
    springls_destroy(other);
    PASS();
}

/* A rotation for their advection, in voxels. */
struct Turning {
    using ValueType = float;
    using VectorType = openvdb::Vec3s;
    struct exact_flow flow;
    openvdb::math::Transform transform() const { return openvdb::math::Transform(); }
    openvdb::Vec3s operator()(const openvdb::Vec3d &x, float time) const
    {
        const float at[3] = { float(x[0]), float(x[1]), float(x[2]) };
        openvdb::Vec3s v;
        exact_flow_velocity(const_cast<struct exact_flow *>(&flow), at, 1, time, v.asPointer());
        return v;
    }
    openvdb::Vec3s operator()(const openvdb::Coord &ijk, float time) const { return (*this)(ijk.asVec3d(), time); }
};

/* A torus turns by an eighth about an axis across its own. */
TEST advection_agrees(void)
{
    springls_torus torus = { { 23.6f, 23.3f, 23.9f }, { 0.0f, 0.0f, 1.0f }, 13.0f, 6.0f };
    Turning turning = { EXACT_ROTATION(23.6f, 23.3f, 23.9f, 0.6f, 0.8f, 0.0f, float(M_PI / 4.0)) };
    springls_context *ctx = implicit_model(springls_implicit_torus, &torus);
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    const auto theirs = sampled(springls_implicit_torus, &torus);
    openvdb::tools::LevelSetAdvection<openvdb::FloatGrid, Turning> advection(*theirs, turning);
    advection.advect(0.0, 1.0);
    forces.velocity = exact_flow_velocity;
    forces.user = &turning.flow;
    step.forces = &forces;
    step.dt = 1.0f;
    ASSERT_EQ(SPRINGLS_OK, springls_step(ctx, &step));
    const Difference difference(ctx, *theirs);
    difference.print();
    ASSERT_GT(difference.voxels, 5000);
    ASSERT_LT(difference.mean, 0.01);
    ASSERT_LT(difference.largest, 0.2);
    springls_destroy(ctx);
    PASS();
}

SUITE(openvdb_cross_check)
{
    RUN_TEST(mesh_distances_agree);
    RUN_TEST(iso_surfaces_agree);
    RUN_TESTp(booleans_agree, SPRINGLS_OPERATION_UNION);
    RUN_TESTp(booleans_agree, SPRINGLS_OPERATION_INTERSECTION);
    RUN_TESTp(booleans_agree, SPRINGLS_OPERATION_DIFFERENCE);
    RUN_TEST(advection_agrees);
}

int main(int argc, char **argv)
{
    openvdb::initialize();
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(openvdb_cross_check);
    GREATEST_MAIN_END();
}

#endif
