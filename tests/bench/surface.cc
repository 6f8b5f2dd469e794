/* surface PAGE PICTURE - the watertight surface of models with known shapes, three times from one state: the zero level of phi, the mesh of
   what springls hold (manual, CONTOURING), and OpenVDB's volumeToMesh of the same phi, where OpenVDB is installed. Writes a page of
   Markdown, and LeVeque's sheet as a picture. One thread; times are the processor's. */
#define SPRINGLS_STATIC
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#if __has_include(<openvdb/openvdb.h>)
#define WITH_OPENVDB 1
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/global_control.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

extern "C" {
#include "examples/common/pictures/image.h"
#include "examples/common/pictures/raycast.h"
}
#include "examples/common/springls/exact_flows.h"

namespace {

const double pi = 3.14159265358979;

/* ---- meshes ---- */

struct Mesh {
    std::vector<float> points;
    std::vector<int> triangles;
    double milliseconds = 0.0;
};

void check(springls_context *ctx, springls_status status)
{
    if (status == SPRINGLS_OK) return;
    std::fprintf(stderr, "surface: %s\n", ctx ? springls_last_error(ctx) : "there is no context");
    std::exit(1);
}

double now() { return 1000.0 * double(std::clock()) / CLOCKS_PER_SEC; }

Mesh extracted(springls_context *ctx, springls_contouring contouring)
{
    springls_params params = springls_get_params(ctx);
    springls_mesh mesh;
    Mesh out;
    params.contouring = contouring;
    check(ctx, springls_set_params(ctx, &params));
    ctx->surface_version = 0; /* the call makes the mesh that it returns */
    const double begun = now();
    check(ctx, springls_extract_mesh(ctx, &mesh));
    out.milliseconds = now() - begun;
    out.points.assign(mesh.positions, mesh.positions + 3 * mesh.vertex_count);
    out.triangles.assign(mesh.triangles, mesh.triangles + 3 * mesh.triangle_count);
    springls_mesh_free(ctx, &mesh);
    return out;
}

/* What OpenVDB makes of phi. */
Mesh of_openvdb(springls_context *ctx, int size)
{
    Mesh out;
#ifdef WITH_OPENVDB
    std::vector<float> phi(size_t(size) * size_t(size) * size_t(size));
    check(ctx, springls_copy_level_set(ctx, phi.data()));
    const float width = *std::max_element(phi.begin(), phi.end());
    auto grid = openvdb::FloatGrid::create(width);
    auto voxels = grid->getAccessor();
    for (int z = 0, i = 0; z < size; ++z)
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x, ++i) {
                if (std::fabs(phi[size_t(i)]) < width) voxels.setValue(openvdb::Coord(x, y, z), phi[size_t(i)]);
                else if (phi[size_t(i)] < 0.0f) voxels.setValueOff(openvdb::Coord(x, y, z), -width);
            }
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec4I> quads;
    const double begun = now();
    openvdb::tools::volumeToMesh(*grid, points, quads, 0.0);
    out.milliseconds = now() - begun;
    for (const openvdb::Vec3s &p : points) out.points.insert(out.points.end(), { p[0], p[1], p[2] });
    for (const openvdb::Vec4I &q : quads)
        for (const int corner : { 0, 1, 2, 0, 2, 3 }) out.triangles.push_back(int(q[corner]));
#else
    (void)ctx, (void)size;
#endif
    return out;
}

springls__mesh_report report_of(const Mesh &mesh)
{
    springls__mesh_report report = {};
    std::vector<int32_t> parent(mesh.points.size() / 3 + 1);
    std::vector<uint64_t> half_edges(mesh.triangles.size() + 1);
    if (!mesh.triangles.empty())
        springls__mesh_measure(mesh.points.data(), int(mesh.points.size() / 3), mesh.triangles.data(), int(mesh.triangles.size() / 3),
                               parent.data(), half_edges.data(), &report);
    return report;
}

/* ---- models with known shapes ---- */

struct Truth {
    double volume = 0.0, area = 0.0; /* area 0: not known */
    std::function<double(const float *)> distance; /* from a place to the surface, voxels */
};

springls_context *new_model(int size)
{
    springls_desc desc = {};
    springls_context *ctx = nullptr;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = size;
    check(ctx, springls_create(&desc, &ctx));
    return ctx;
}

const double center[3] = { 31.37, 31.52, 31.21 }, axis[3] = { 0.48, 0.6, 0.64 };

/* Turns a vector about the axis. */
void turn(const double x[3], double angle, double out[3])
{
    const double c = std::cos(angle), s = std::sin(angle);
    const double along = (x[0] * axis[0] + x[1] * axis[1] + x[2] * axis[2]) * (1.0 - c);
    for (int k = 0; k < 3; ++k) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        out[k] = c * x[k] + s * (axis[a] * x[b] - axis[b] * x[a]) + along * axis[k];
    }
}

/* A box about the center, turned by an angle. */
Truth box_truth(double hx, double hy, double hz, double angle)
{
    Truth truth;
    truth.volume = 8.0 * hx * hy * hz;
    truth.area = 8.0 * (hx * hy + hy * hz + hz * hx);
    truth.distance = [=](const float *at) {
        const double half[3] = { hx, hy, hz };
        double x[3], outside = 0.0, inside = -1e9;
        for (int k = 0; k < 3; ++k) x[k] = double(at[k]) - center[k];
        double local[3];
        turn(x, -angle, local);
        for (int k = 0; k < 3; ++k) {
            const double beyond = std::fabs(local[k]) - half[k];
            outside += beyond > 0.0 ? beyond * beyond : 0.0;
            inside = std::max(inside, beyond);
        }
        return outside > 0.0 ? std::sqrt(outside) : -inside;
    };
    return truth;
}

void set_box(springls_context *ctx, double hx, double hy, double hz, double angle)
{
    const int triangles[36] = { 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7,
                                0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5 };
    float points[24];
    for (int i = 0; i < 8; ++i) {
        const double x[3] = { i & 1 ? hx : -hx, i & 2 ? hy : -hy, i & 4 ? hz : -hz };
        double turned[3];
        turn(x, angle, turned);
        for (int k = 0; k < 3; ++k) points[3 * i + k] = float(center[k] + turned[k]);
    }
    check(ctx, springls_set_mesh(ctx, points, 8, 0, triangles, 12, nullptr));
}

void squeeze(void *user, const float *points, int count, float, float *out)
{
    for (int i = 0; i < count; ++i) {
        out[3 * i] = out[3 * i + 1] = 0.0f;
        out[3 * i + 2] = *static_cast<const float *>(user) * (float(center[2]) - points[3 * i + 2]);
    }
}

void whirl(void *, const float *points, int count, float, float *out)
{
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < 3; ++k) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            const double arm_a = double(points[3 * i + a]) - center[a], arm_b = double(points[3 * i + b]) - center[b];
            out[3 * i + k] = float(pi / 180.0 * (axis[a] * arm_b - axis[b] * arm_a));
        }
}

void run(springls_context *ctx, springls_velocity_fn velocity, void *user, float dt, int steps, bool one_to_one)
{
    springls_forces forces = {};
    springls_step_desc step = springls_default_step_desc();
    forces.velocity = velocity;
    forces.user = user;
    forces.integrator = SPRINGLS_INTEGRATOR_RK4;
    step.forces = &forces;
    step.dt = dt;
    step.one_to_one = one_to_one;
    for (int i = 0; i < steps; ++i) check(ctx, springls_step(ctx, &step));
}

/* A plate of 22.6 x 18.8 voxels, turned by 20 steps of a degree; below a voxel it is squeezed first. */
springls_context *plate(double thickness)
{
    springls_context *ctx = new_model(64);
    float rate = float(std::log(1.5 / thickness) / 8.0);
    set_box(ctx, 11.3, 9.4, thickness < 1.0 ? 0.75 : 0.5 * thickness, 0.0);
    if (thickness < 1.0) run(ctx, squeeze, &rate, 1.0f, 8, true); /* ordinary steps lose springls of thin ones */
    run(ctx, whirl, nullptr, 1.0f, 20, thickness < 1.0);
    return ctx;
}

/* A ball that LeVeque's flow has drawn out until half of its period, by points of its surface that the flow carries exactly. */
struct Sheet {
    springls_context *ctx = nullptr;
    springls__surface surface = {};

    Truth truth(struct exact_flow flow, springls_sphere ball, float until)
    {
        const int across = 1440, down = 720, steps = 200;
        Mesh mesh;
        for (int j = 0; j <= down; ++j)
            for (int i = 0; i < across; ++i) {
                const double u = 2.0 * pi * i / across, v = pi * j / down;
                const double n[3] = { std::sin(v) * std::cos(u), std::sin(v) * std::sin(u), std::cos(v) };
                for (int k = 0; k < 3; ++k) mesh.points.push_back(float(double(ball.center[k]) + double(ball.radius) * n[k]));
                if (j == down) continue;
                const int a = j * across + i, b = j * across + (i + 1) % across;
                mesh.triangles.insert(mesh.triangles.end(), { a, a + across, b + across, a, b + across, b });
            }
        const int count = int(mesh.points.size() / 3);
        std::vector<float> k1(mesh.points.size()), k2(k1), k3(k1), k4(k1), at(k1);
        const float h = until / steps;
        for (int s = 0; s < steps; ++s) {
            const auto ask = [&](const std::vector<float> &from, float by, float time, std::vector<float> &out) {
                for (size_t i = 0; i < at.size(); ++i) at[i] = mesh.points[i] + by * from[i];
                exact_flow_velocity(&flow, at.data(), count, time, out.data());
            };
            const float t = h * float(s);
            ask(k1, 0.0f, t, k1);
            ask(k1, 0.5f * h, t + 0.5f * h, k2);
            ask(k2, 0.5f * h, t + 0.5f * h, k3);
            ask(k3, h, t + h, k4);
            for (size_t i = 0; i < at.size(); ++i) mesh.points[i] += h / 6.0f * (k1[i] + 2.0f * k2[i] + 2.0f * k3[i] + k4[i]);
        }
        const int triangles = int(mesh.triangles.size() / 3);
        check(ctx, springls__surface_reserve(ctx, &surface, triangles));
        for (int i = 0; i < 3 * triangles; ++i) surface.points[i] = springls__load3(&mesh.points[3 * size_t(mesh.triangles[size_t(i)])]);
        check(ctx, springls__surface_finish(ctx, &surface, triangles));
        Truth truth;
        truth.volume = 4.0 / 3.0 * pi * std::pow(double(ball.radius), 3.0);
        truth.distance = [this](const float *x) {
            return std::sqrt(double(springls__surface_closest(&surface, springls__load3(x), 1e9f).hit.d2));
        };
        return truth;
    }
};

/* ---- the page ---- */

/* Shares of rays, from around the model to places in its mesh, that pass. */
int passing_rays(springls_context *ctx, int size, int *count)
{
    const int most = 100000;
    std::vector<float> at, from, directions;
    std::vector<uint8_t> inside(most);
    uint32_t state = 7;
    const auto between = [&](float low, float high) {
        state = state * 1664525u + 1013904223u;
        return low + (high - low) * float(state >> 8) / 16777216.0f;
    };
    const int n = springls_count(ctx);
    for (int i = 0; i < most; ++i) { /* beside springls: in thin sheets, too */
        const springls__v3 p = ctx->model.set.s[int(between(0.0f, float(n) - 0.5f))].p;
        for (const float x : { p.x, p.y, p.z }) at.push_back(x + between(-0.2f, 0.2f));
    }
    check(ctx, springls_sample_inside(ctx, at.data(), most, inside.data()));
    *count = 0;
    for (int i = 0; i < most; ++i) {
        if (!inside[size_t(i)]) continue;
        for (int k = 0; k < 3; ++k) from.push_back(between(-1.0f, 1.0f) < 0.0f ? -2.0f : float(size) + 2.0f);
        for (int k = 0; k < 3; ++k) directions.push_back(at[size_t(3 * i + k)] - from[size_t(3 * *count + k)]);
        ++*count;
    }
    std::vector<springls_hit> hits(size_t(*count) + 1);
    if (*count) check(ctx, springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, from.data(), directions.data(), *count, 0.0f, hits.data()));
    int passed = 0;
    for (int i = 0; i < *count; ++i) {
        const float *d = &directions[size_t(3 * i)];
        const double length = std::sqrt(double(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
        passed += hits[size_t(i)].springl < 0 && !(double(hits[size_t(i)].distance) <= length * 1.0001);
    }
    return passed;
}

void write_row(FILE *page, const char *model, const char *surface, const Mesh &mesh, const Truth &truth)
{
    const springls__mesh_report report = report_of(mesh);
    std::vector<double> distance;
    double mean = 0.0, of_vertices = 0.0;
    char area[32] = "-";
    for (size_t i = 0; i < mesh.points.size(); i += 3) {
        distance.push_back(truth.distance(&mesh.points[i]));
        of_vertices += distance.back() * 3.0 / double(mesh.points.size());
    }
    for (size_t t = 0; t < mesh.triangles.size(); t += 3) { /* and the middles of triangles */
        float middle[3];
        for (size_t k = 0; k < 3; ++k)
            middle[k] = (mesh.points[3 * size_t(mesh.triangles[t]) + k] + mesh.points[3 * size_t(mesh.triangles[t + 1]) + k]
                         + mesh.points[3 * size_t(mesh.triangles[t + 2]) + k]) / 3.0f;
        distance.push_back(truth.distance(middle));
    }
    if (distance.empty()) {
        std::fprintf(page, "| %s | %s | none | -100 | -100 | - | - | - | - | 0 | - |\n", model, surface);
        return;
    }
    for (const double d : distance) mean += d / double(distance.size());
    std::sort(distance.begin(), distance.end());
    if (truth.area > 0.0) std::snprintf(area, sizeof area, "%.2f", 100.0 * (report.area / truth.area - 1.0));
    std::fprintf(page, "| %s | %s | %d / %d | %.2f | %s | %.4f | %.4f | %.3f | %.2f | %.1f | %.0f |\n", model, surface,
                 report.components, report.euler, 100.0 * (report.volume / truth.volume - 1.0), area, of_vertices, mean,
                 distance[distance.size() * 99 / 100], distance.back(), report.triangles / 1000.0, mesh.milliseconds);
    std::fflush(page);
}

/* How far places on the edges of a box are from a mesh: a row of the table of edges. */
std::string edge_row(springls_context *ctx, const char *surface, const Mesh &mesh, const double half[3], double angle)
{
    springls__surface tree = {};
    const int triangles = int(mesh.triangles.size() / 3), along = 200;
    double mean = 0.0, largest = 0.0;
    char text[160];
    if (triangles == 0) return "";
    check(ctx, springls__surface_reserve(ctx, &tree, triangles));
    for (int i = 0; i < 3 * triangles; ++i) tree.points[i] = springls__load3(&mesh.points[3 * size_t(mesh.triangles[size_t(i)])]);
    check(ctx, springls__surface_finish(ctx, &tree, triangles));
    for (int edge = 0; edge < 12; ++edge)
        for (int i = 0; i < along; ++i) {
            const int a = edge / 4, b = (a + 1) % 3, c = (a + 2) % 3;
            double x[3], turned[3];
            float at[3];
            x[a] = half[a] * (2.0 * (i + 0.5) / along - 1.0);
            x[b] = edge & 1 ? half[b] : -half[b];
            x[c] = edge & 2 ? half[c] : -half[c];
            turn(x, angle, turned);
            for (int k = 0; k < 3; ++k) at[k] = float(center[k] + turned[k]);
            const double d = std::sqrt(double(springls__surface_closest(&tree, springls__load3(at), 1e9f).hit.d2));
            mean += d / (12.0 * along);
            largest = std::max(largest, d);
        }
    springls__surface_free(ctx, &tree);
    std::snprintf(text, sizeof text, "| %s | %.4f | %.3f |\n", surface, mean, largest);
    return text;
}

struct Case { Mesh level, springls, openvdb; };

Case write_case(FILE *page, const char *model, springls_context *ctx, int size, const Truth &truth, std::string *rays)
{
    Case c;
    c.level = extracted(ctx, SPRINGLS_CONTOURING_LEVEL_SET);
    c.openvdb = of_openvdb(ctx, size);
    c.springls = extracted(ctx, SPRINGLS_CONTOURING_SPRINGLS);
    write_row(page, model, "springls", c.springls, truth);
    write_row(page, model, "zero level", c.level, truth);
#ifdef WITH_OPENVDB
    write_row(page, model, "OpenVDB", c.openvdb, truth);
#endif
    int count = 0;
    const int passed = passing_rays(ctx, size, &count);
    char text[160];
    std::snprintf(text, sizeof text, "| %s | %d | %d |\n", model, count, passed);
    *rays += text;
    return c;
}

bool draw(const Mesh &mesh, const Mesh &framed, struct image *picture)
{
    const float direction[3] = { -0.55f, -0.35f, 0.75f }, up[3] = { 0.0f, 0.0f, 1.0f };
    const std::vector<uint32_t> indices(mesh.triangles.begin(), mesh.triangles.end());
    raycast_scene scene = {};
    scene.positions = mesh.points.data();
    scene.vertex_count = mesh.points.size() / 3;
    scene.indices = indices.data();
    scene.triangle_count = mesh.triangles.size() / 3;
    scene.base_color = color_rgb(0.45f, 0.62f, 0.80f);
    scene.supersampling = 3;
    scene.camera = raycast_frame_points(framed.points.data(), framed.points.size() / 3, direction, up, 30.0f, 1.0f);
    return raycast_render(&scene, 480, 480, picture);
}

void write_picture(const Case &c, const char *path)
{
    const Mesh *const meshes[3] = { &c.springls, &c.level, &c.openvdb };
    const char *const captions[3] = { "springls", "zero level", "OpenVDB" };
    struct image pictures[3], strip;
    int n = 0;
    bool ok = true;
    for (int i = 0; i < 3 && ok; ++i)
        if (!meshes[i]->triangles.empty()) ok = draw(*meshes[i], c.springls, &pictures[n++]);
    ok = ok && image_strip(pictures, captions, n, n, color_rgb(1.0f, 1.0f, 1.0f), &strip) && image_write_small_png(&strip, 128, path);
    if (!ok) {
        std::fprintf(stderr, "surface: cannot write %s\n", path);
        std::exit(1);
    }
}

} // namespace

int main(int argc, char **argv)
{
    const char *const path = argc > 1 ? argv[1] : "docs/surface.md", *const picture = argc > 2 ? argv[2] : "docs/pictures/surface.png";
    std::string rays, edges;
    char date[32];
    const std::time_t today = std::time(nullptr);
    FILE *page = std::fopen(path, "w");
    if (!page) {
        std::fprintf(stderr, "surface: cannot write %s\n", path);
        return 1;
    }
#ifdef WITH_OPENVDB
    openvdb::initialize();
    tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
#endif
    std::strftime(date, sizeof date, "%Y-%m-%d", std::localtime(&today));
    std::fprintf(page, "# The watertight surface\n\nMade by `make surface`, %s.\n\n", date);
    std::fputs(
        "Each model's surface is made three times from one state: the mesh of what springls hold\n"
        "(`params.contouring = SPRINGLS_CONTOURING_SPRINGLS`; the manual in `springls.h`, CONTOURING), the zero level of phi by the\n"
        "library's marching cubes, and by OpenVDB's `volumeToMesh` of the same phi. Volume and area: error, %. Distances are voxels,\n"
        "from vertices and middles of triangles (the first column: from vertices alone) to the exact surface: mean, 99 %, largest.\n"
        "Times are the processor's, of the whole call, on one thread of a machine that may be busy; OpenVDB's has neither normals nor\n"
        "correspondences.\n\n"
        "Plates of 22.6 x 18.8 voxels have been turned by 20 degrees in 20 steps; those below a voxel were squeezed to that from 1.5\n"
        "voxels before, one to one (`springls_step_desc.one_to_one`). LeVeque's sheet is the ball at half of its period.\n\n"
        "| Model | Surface | Components / Euler number | Volume | Area | Vertices, mean | Mean | 99 % | Largest | Triangles, 1000 | ms |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|\n",
        page);
    {
        springls_context *ctx = new_model(64);
        springls_sphere ball = { { 31.3f, 30.7f, 32.1f }, 18.0f };
        Truth truth;
        truth.volume = 4.0 / 3.0 * pi * 5832.0;
        truth.area = 4.0 * pi * 324.0;
        truth.distance = [](const float *x) {
            const double d[3] = { double(x[0]) - 31.3, double(x[1]) - 30.7, double(x[2]) - 32.1 };
            return std::fabs(std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - 18.0);
        };
        check(ctx, springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        write_case(page, "ball of 18 voxels", ctx, 64, truth, &rays);
        springls_destroy(ctx);
    }
    {
        springls_context *ctx = new_model(64);
        const double angle = 20.0 * pi / 180.0, half[3] = { 9.0, 7.0, 5.0 };
        set_box(ctx, half[0], half[1], half[2], angle);
        const Case c = write_case(page, "box, turned by 20 degrees", ctx, 64, box_truth(half[0], half[1], half[2], angle), &rays);
        edges = edge_row(ctx, "springls", c.springls, half, angle) + edge_row(ctx, "zero level", c.level, half, angle)
              + edge_row(ctx, "OpenVDB", c.openvdb, half, angle);
        springls_destroy(ctx);
    }
    for (const double thickness : { 2.0, 1.0, 0.5, 0.25, 0.1 }) {
        springls_context *ctx = plate(thickness);
        char name[64];
        std::snprintf(name, sizeof name, "plate of %g voxels", thickness);
        write_case(page, name, ctx, 64, box_truth(11.3, 9.4, 0.5 * thickness, 20.0 * pi / 180.0), &rays);
        springls_destroy(ctx);
    }
    {
        const int n = 128;
        springls_context *ctx = new_model(n);
        springls_notched_sphere body = { { 0.5f * n, 0.75f * n, 0.5f * n }, 0.15f * n, 0.05f * n, 0.125f * n };
        struct exact_flow flow = EXACT_ROTATION(0.5f * n, 0.5f * n, 0.5f * n, 0.0f, 0.0f, 1.0f, float(2.0 * pi / 160.0));
        Truth truth;
        check(ctx, springls_set_implicit(ctx, springls_implicit_notched_sphere, &body));
        const springls__mesh_report start = report_of(extracted(ctx, SPRINGLS_CONTOURING_SPRINGLS));
        truth.volume = start.volume;
        truth.area = start.area;
        truth.distance = [&body](const float *x) {
            float d;
            springls_implicit_notched_sphere(&body, x, 1, &d);
            return std::fabs(double(d));
        };
        run(ctx, exact_flow_velocity, &flow, 1.0f, 160, false);
        write_case(page, "Zalesak, 128^3, one turn (against its start)", ctx, n, truth, &rays);
        springls_destroy(ctx);
    }
    Case shown;
    for (const int n : { 128, 64 }) {
        const float size = float(n);
        Sheet sheet;
        springls_sphere ball = { { 0.35f * size, 0.35f * size, 0.35f * size }, 0.15f * size };
        struct exact_flow flow = EXACT_DEFORMATION(size, 3.0f);
        char name[64];
        sheet.ctx = new_model(n);
        check(sheet.ctx, springls_set_implicit(sheet.ctx, springls_implicit_sphere, &ball));
        run(sheet.ctx, exact_flow_velocity, &flow, n == 64 ? 0.075f : 0.0375f, n == 64 ? 20 : 40, false);
        std::snprintf(name, sizeof name, "LeVeque, %d^3, T = 3, half time", n);
        shown = write_case(page, name, sheet.ctx, n, sheet.truth(flow, ball, 1.5f), &rays);
        springls__surface_free(sheet.ctx, &sheet.surface);
        springls_destroy(sheet.ctx);
    }
    write_picture(shown, picture);
    std::fprintf(
        page,
        "\n![LeVeque's sheet at half time, 64^3, T = 3](pictures/surface.png)\n\n## Edges\n\n"
        "How far places on the twelve edges of the box are from its surface, voxels.\n\n| Surface | Mean | Largest |\n|---|---|---|\n%s"
        "\n## Rays\n\n"
        "Rays from the corners around each model to places inside the mesh of springls, beside springls: none may pass.\n\n"
        "| Model | Rays | Pass |\n|---|---|---|\n%s",
        edges.c_str(), rays.c_str());
    return std::fclose(page) == 0 ? 0 : 1;
}
