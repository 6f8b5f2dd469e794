/* openvdb_advection PROBLEM GRID PERIOD - a level set of OpenVDB on the problems of the example programs.

   PROBLEM: leveque (PERIOD = T) or zalesak (PERIOD = revolutions). tools::LevelSetAdvection as its class sets itself up:
   HJWENO5_BIAS and TVD_RK2, the tracker with HJWENO5_BIAS, half-width 3; the velocity is asked analytically. Voxel i at
   i/GRID; one thread. advect() is called once every 0.005 of time (LeVeque) or 1/628 turn: one call over the whole period
   would let the CFL step jump across T/2, where the velocity vanishes. One JSON object on stdout. */
#define SPRINGLS_STATIC
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetAdvect.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <numeric>
#include <set>

extern "C" {
#include "examples/common/base/progress.h"
}

using openvdb::Vec3d;
using openvdb::Vec3s;

/* Velocity in world units a unit of time; the domain is [0,1]^3. */
struct Velocity {
    using ValueType = float;
    using VectorType = Vec3s;
    bool rotates;
    float period; /* of LeVeque's flow; a turn takes 1 */

    openvdb::math::Transform transform() const { return openvdb::math::Transform(); }

    Vec3s operator()(const Vec3d &x, float time) const
    {
        const float pi = 3.14159265f;
        if (rotates) {
            return Vec3s(-2.0f * pi * float(x[1] - 0.5), 2.0f * pi * float(x[0] - 0.5), 0.0f);
        }
        const float px = pi * float(x[0]), py = pi * float(x[1]), pz = pi * float(x[2]);
        const float s = std::cos(pi * time / period);
        const float sx = std::sin(px), sy = std::sin(py), sz = std::sin(pz);
        const float tx = std::sin(2.0f * px), ty = std::sin(2.0f * py), tz = std::sin(2.0f * pz);
        return Vec3s(2.0f * s * sx * sx * ty * tz, -s * tx * sy * sy * tz, -s * tx * ty * sz * sz);
    }
    Vec3s operator()(const openvdb::Coord &ijk, float time) const { return (*this)(ijk.asVec3d(), time); }
};

/* The exact shape at the start, which is also the exact answer at the end. */
struct Shape {
    bool notched;
    springls_sphere sphere;
    springls_notched_sphere notched_sphere;
    double volume;

    explicit Shape(bool is_notched) : notched(is_notched)
    {
        sphere = {{0.35f, 0.35f, 0.35f}, 0.15f};
        notched_sphere = {{0.5f, 0.75f, 0.5f}, 0.15f, 0.05f, 0.125f};
        volume = 4.0 / 3.0 * 3.14159265358979 * 0.15 * 0.15 * 0.15;
        if (notched) { /* less the slot: |x| < w/2 and y < roof, by Simpson over x and y of the sphere's depth in z */
            const double r = 0.15, half = 0.025, roof = -r + 0.125;
            const int n = 2000;
            for (int i = 0; i < n; ++i) {
                const double x = half * (i + 0.5) / n;
                const double reach = std::sqrt(r * r - x * x);
                for (int j = 0; j < n; ++j) {
                    const double y = -reach + (roof + reach) * (j + 0.5) / n;
                    volume -= 2.0 * (half / n) * ((roof + reach) / n) * 2.0 * std::sqrt(std::max(0.0, r * r - x * x - y * y));
                }
            }
        }
    }
    float distance(const Vec3s &x) const
    {
        const float p[3] = {x[0], x[1], x[2]};
        float d;
        if (notched) {
            springls_implicit_notched_sphere(const_cast<springls_notched_sphere *>(&notched_sphere), p, 1, &d);
        } else {
            springls_implicit_sphere(const_cast<springls_sphere *>(&sphere), p, 1, &d);
        }
        return d;
    }
};

static openvdb::FloatGrid::Ptr level_set_of(const Shape &shape, int grid)
{
    const float h = 1.0f / float(grid), width = 3.0f * h;
    openvdb::FloatGrid::Ptr result = openvdb::FloatGrid::create(width);
    result->setTransform(openvdb::math::Transform::createLinearTransform(h));
    result->setGridClass(openvdb::GRID_LEVEL_SET);
    openvdb::FloatGrid::Accessor voxels = result->getAccessor();
    for (int k = 0; k < grid; ++k) {
        for (int j = 0; j < grid; ++j) {
            for (int i = 0; i < grid; ++i) {
                const float d = shape.distance(Vec3s(float(i), float(j), float(k)) * h);
                if (std::fabs(d) < width) {
                    voxels.setValue(openvdb::Coord(i, j, k), d);
                } else if (d < 0.0f) {
                    voxels.setValueOff(openvdb::Coord(i, j, k), -width);
                }
            }
        }
    }
    result->pruneGrid();
    return result;
}

struct Measures {
    double volume = 0.0, mean = 0.0, max = 0.0; /* volume: world; distances of the vertices to the shape: voxels */
    int components = 0, euler = 0, vertices = 0;
};

static Measures measure(const openvdb::FloatGrid &level_set, const Shape &shape, int grid)
{
    std::vector<Vec3s> points;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(level_set, points, quads, 0.0);
    Measures m;
    std::vector<int> parent(points.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](int i) {
        while (parent[size_t(i)] != i) {
            i = parent[size_t(i)] = parent[size_t(parent[size_t(i)])];
        }
        return i;
    };
    std::set<std::pair<openvdb::Index32, openvdb::Index32>> edges;
    for (const openvdb::Vec4I &q : quads) {
        for (int c = 0; c < 4; ++c) {
            const auto a = q[c], b = q[(c + 1) % 4];
            edges.insert({std::min(a, b), std::max(a, b)});
            parent[size_t(root(int(a)))] = root(int(b));
        }
        const Vec3d a = points[q[0]], b = points[q[1]], c = points[q[2]], d = points[q[3]];
        m.volume += a.dot(b.cross(c)) / 6.0 + a.dot(c.cross(d)) / 6.0;
    }
    m.volume = std::fabs(m.volume); /* volumeToMesh turns its faces inwards */
    for (size_t i = 0; i < points.size(); ++i) {
        const double d = std::fabs(shape.distance(points[i])) * grid;
        m.mean += d / double(points.size());
        m.max = std::max(m.max, d);
        m.components += root(int(i)) == int(i);
    }
    m.vertices = int(points.size());
    m.euler = int(points.size()) - int(edges.size()) + int(quads.size());
    return m;
}

int main(int argc, char **argv)
{
    const bool zalesak = argc > 1 && std::strcmp(argv[1], "zalesak") == 0;
    const int grid = argc > 2 ? std::atoi(argv[2]) : 0;
    const double period = argc > 3 ? std::atof(argv[3]) : 0.0;
    if ((!zalesak && (argc < 2 || std::strcmp(argv[1], "leveque") != 0)) || grid < 8 || !(period > 0.0)) {
        std::fprintf(stderr, "usage: openvdb_advection leveque|zalesak GRID PERIOD\n");
        return 2;
    }
    tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    openvdb::initialize();
    const Shape shape(zalesak);
    openvdb::FloatGrid::Ptr level_set = level_set_of(shape, grid);
    const Measures start = measure(*level_set, shape, grid);

    openvdb::tools::LevelSetAdvection<openvdb::FloatGrid, Velocity> advection(*level_set, {zalesak, float(period)});
    advection.setSpatialScheme(openvdb::math::HJWENO5_BIAS);
    advection.setTemporalScheme(openvdb::math::TVD_RK2);
    advection.setTrackerSpatialScheme(openvdb::math::HJWENO5_BIAS);
    /* An even number of calls: none crosses T/2. */
    const int calls = zalesak ? int(std::lround(628.0 * period)) : 2 * std::max(1, int(std::lround(period / 0.01)));
    size_t cfl_steps = 0;
    struct progress bar;
    progress_begin(&bar, "OpenVDB", size_t(calls), false);
    const double before = elapsed_seconds();
    for (int i = 0; i < calls; ++i) {
        cfl_steps += advection.advect(float(period * i / calls), float(period * (i + 1) / calls));
        progress_update(&bar, size_t(i + 1), nullptr);
    }
    const double seconds = elapsed_seconds() - before;
    progress_end(&bar);

    const Measures end = measure(*level_set, shape, grid);
    const auto percent = [](double a, double b) { return 100.0 * (a / b - 1.0); };
    std::printf("{\n  \"method\": \"OpenVDB %s, HJWENO5_BIAS, TVD_RK2\",\n", openvdb::getLibraryVersionString());
    std::printf("  \"problem\": \"%s\",\n  \"grid\": %d,\n  \"period\": %g,\n", argv[1], grid, period);
    std::printf("  \"steps\": %zu,\n  \"threads\": 1,\n  \"vertices\": %d,\n", cfl_steps, end.vertices);
    std::printf("  \"surface_mean\": %.6g,\n  \"surface_max\": %.6g,\n", end.mean, end.max);
    std::printf("  \"volume_change_percent\": %.6g,\n", percent(end.volume, start.volume));
    std::printf("  \"volume_error_percent\": %.6g,\n", percent(end.volume, shape.volume));
    std::printf("  \"start_volume_error_percent\": %.6g,\n", percent(start.volume, shape.volume));
    std::printf("  \"components\": %d,\n  \"euler\": %d,\n", end.components, end.euler);
    std::printf("  \"seconds_total\": %.6g,\n  \"peak_rss_mib\": %.6g\n}\n", seconds, peak_rss_mib());
    return 0;
}
