// engine_embed.cpp - springls inside a game loop: the engine's memory, threads, clock and log; a time budget a frame; uploads of
// changed chunks only; a brush that finds the surface by a ray; a ball that rolls on it; undo and rollback by snapshots. Nothing
// is drawn: the program prints the times of the frames. It needs C++17 and the library.
//
//   engine_embed [--grid 96] [--frames 240] [--threads 2] [--budget 5] [--json FILE|-] [--quiet]
#define SPRINGLS_STATIC
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace engine {

// ---- the engine ----

// Counts the platform's memory. Called by one thread at a time.
struct Heap {
    size_t bytes = 0, peak = 0, calls = 0;
    static void *alloc(size_t size, void *user)
    {
        Heap *heap = static_cast<Heap *>(user);
        heap->calls++;
        heap->peak = std::max(heap->peak, heap->bytes += size);
        return std::aligned_alloc(64, (size + 63) / 64 * 64);
    }
    static void free(void *memory, size_t size, void *user)
    {
        static_cast<Heap *>(user)->bytes -= size;
        std::free(memory);
    }
};

// A pool of threads that share the ranges of parallel loops.
class Jobs {
public:
    explicit Jobs(int threads)
    {
        for (int i = 1; i < threads; ++i) workers.emplace_back([this] { work(); });
    }
    ~Jobs()
    {
        {
            const std::lock_guard<std::mutex> lock(mutex);
            over = true;
        }
        wake.notify_all();
        for (std::thread &worker : workers) worker.join();
    }
    Jobs(const Jobs &) = delete;
    Jobs &operator=(const Jobs &) = delete;

    static void parallel_for(void *user, int count, int grain, springls_task task, void *arg)
    {
        static_cast<Jobs *>(user)->run(count, grain, task, arg);
    }

private:
    void run(int count, int grain, springls_task task, void *arg)
    {
        if (workers.empty() || count <= grain) return task(arg, 0, count);
        {
            const std::lock_guard<std::mutex> lock(mutex);
            loop = {task, arg, count, grain};
            next = 0;
            busy = static_cast<int>(workers.size());
            ++generation;
        }
        wake.notify_all();
        take_ranges(loop);
        std::unique_lock<std::mutex> lock(mutex);
        done.wait(lock, [this] { return busy == 0; });
    }

    struct Loop {
        springls_task task;
        void *arg;
        int count, grain;
    };

    void take_ranges(const Loop &l)
    {
        for (int begin; (begin = next.fetch_add(l.grain)) < l.count;) l.task(l.arg, begin, std::min(begin + l.grain, l.count));
    }

    void work()
    {
        unsigned seen = 0;
        std::unique_lock<std::mutex> lock(mutex);
        for (;;) {
            wake.wait(lock, [&] { return over || generation != seen; });
            if (over) return;
            seen = generation;
            const Loop mine = loop;
            lock.unlock();
            take_ranges(mine);
            lock.lock();
            if (--busy == 0) done.notify_one();
        }
    }

    std::vector<std::thread> workers;
    std::mutex mutex;
    std::condition_variable wake, done;
    Loop loop{};
    std::atomic<int> next{0};
    int busy = 0;
    unsigned generation = 0;
    bool over = false;
};

double now(void *) { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void log(void *, int level, const char *message)
{
    static const char *const levels[] = {"error", "warning", "info"};
    std::fprintf(stderr, "engine_embed: %s: %s\n", levels[std::clamp(level, 1, 3) - 1], message);
}

// ---- a mock of a GPU ----

// A vertex buffer and an index buffer that are written once.
struct Buffers {
    std::vector<float> vertices; // position and normal
    std::vector<uint16_t> indices;
    explicit Buffers(const springls_chunk &chunk)
        : vertices(6 * static_cast<size_t>(chunk.vertex_count)),
          indices(chunk.triangles, chunk.triangles + 3 * chunk.triangle_count)
    {
        for (size_t i = 0; i < static_cast<size_t>(chunk.vertex_count); ++i) {
            std::copy_n(chunk.positions + 3 * i, 3, vertices.data() + 6 * i);
            std::copy_n(chunk.normals + 3 * i, 3, vertices.data() + 6 * i + 3);
        }
    }
    size_t bytes() const { return vertices.size() * sizeof(float) + indices.size() * sizeof(uint16_t); }
};

// Two tables of buffers: the renderer reads the front one while the other one is updated.
class Mesh {
public:
    // Uploads to the back table; returns the number of bytes.
    size_t upload(const springls_chunk *chunks, int count)
    {
        size_t bytes = 0;
        for (int i = 0; i < count; ++i) {
            std::shared_ptr<const Buffers> fresh =
                chunks[i].triangle_count ? std::make_shared<const Buffers>(chunks[i]) : nullptr;
            if (fresh) bytes += fresh->bytes();
            late[{chunks[i].brick[0], chunks[i].brick[1], chunks[i].brick[2]}] = std::move(fresh);
        }
        put(late, table[1 - front]);
        return bytes;
    }
    // Swaps the tables, so that the next frame draws what has been uploaded.
    void flip()
    {
        front = 1 - front;
        put(late, table[1 - front]); // only the table is written twice: buffers are shared
        late.clear();
    }
    size_t bytes() const
    {
        size_t sum = 0;
        for (const auto &entry : table[front]) sum += entry.second->bytes();
        return sum;
    }
    size_t triangles() const
    {
        size_t sum = 0;
        for (const auto &entry : table[front]) sum += entry.second->indices.size() / 3;
        return sum;
    }

private:
    struct Brick {
        int x, y, z;
        bool operator<(const Brick &b) const { return z != b.z ? z < b.z : y != b.y ? y < b.y : x < b.x; }
    };
    using Table = std::map<Brick, std::shared_ptr<const Buffers>>;
    static void put(const Table &changes, Table &to)
    {
        for (const auto &change : changes) {
            if (change.second) to[change.first] = change.second;
            else to.erase(change.first);
        }
    }
    Table table[2], late;
    int front = 0;
};

// ---- the game ----

// The push tool: moves everything within its radius, fading towards the rim.
struct Brush {
    float center[3], radius, velocity[3];
    static void push(void *user, const float *points, int count, float, float *out)
    {
        const Brush &b = *static_cast<const Brush *>(user);
        for (int i = 0; i < count; ++i, points += 3, out += 3) {
            float d2 = 0;
            for (int k = 0; k < 3; ++k) d2 += (points[k] - b.center[k]) * (points[k] - b.center[k]);
            const float w = std::max(1 - d2 / (b.radius * b.radius), 0.0f);
            for (int k = 0; k < 3; ++k) out[k] = w * w * b.velocity[k];
        }
    }
};

struct Options {
    int grid = 96, frames = 240, threads = 2;
    double budget = 5; // milliseconds
    std::string json;
    bool quiet = false;
};

struct Report {
    std::vector<double> update, overrun, changes, uploaded; // of each frame: ms, ms, ms for chunks, bytes
    std::vector<double> frames_a_step;
    size_t whole_bytes = 0, triangles = 0, mesh_triangles = 0, peak_bytes = 0, bytes_left = 0, snapshot_bytes = 0;
    double snapshot_ms = 0, restore_ms = 0;
    int steps = 0, picks = 0, touches = 0, springls = 0;
    bool rollback_same = false;
};

class Game {
public:
    Game(const Options &o, Heap &memory) : options(o), heap(memory), jobs(o.threads)
    {
        springls_desc desc{};
        for (int &side : desc.grid.size) side = o.grid;
        desc.allocator = {Heap::alloc, Heap::free, &heap};
        desc.tasks = {Jobs::parallel_for, &jobs};
        desc.logger.log = log;
        desc.trace.now = now;
        if (springls_create(&desc, &model) != SPRINGLS_OK) throw std::string("the model could not be made");
        const float middle = 0.5f * static_cast<float>(o.grid - 1);
        springls_sphere ball{{middle, middle, middle}, radius()};
        if (springls_set_implicit(model, springls_implicit_sphere, &ball) != SPRINGLS_OK
            || springls_chunks_create(model, nullptr, &chunks) != SPRINGLS_OK)
            fail();
        brush.radius = 0.08f * static_cast<float>(o.grid);
        forces.velocity = Brush::push;
        forces.user = &brush;
        step.forces = &forces;
        step.dt = 1;
        step.max_displacement = 2;
        marble[0] = marble[2] = middle;
        marble[1] = middle + radius() + 4;
    }
    ~Game()
    {
        springls_chunks_destroy(model, chunks);
        springls_destroy(model);
    }
    Game(const Game &) = delete;
    Game &operator=(const Game &) = delete;

    Report play()
    {
        refresh_all(); // while the level loads
        report.whole_bytes = mesh.bytes();
        for (int frame = 0; frame < options.frames; ++frame) {
            const double begin = now(nullptr);
            update(frame, begin + 1e-3 * options.budget);
            const double ms = 1e3 * (now(nullptr) - begin);
            report.update.push_back(ms);
            report.overrun.push_back(std::max(ms - options.budget, 0.0));
        }
        finish();
        rollback();
        finish();
        report.triangles = mesh.triangles();
        report.springls = springls_count(model);
        report.peak_bytes = heap.peak;
        return report;
    }
    // Extracts the same surface as one mesh, to compare.
    size_t mesh_triangles()
    {
        springls_mesh whole;
        if (springls_extract_mesh(model, &whole) != SPRINGLS_OK) fail();
        const size_t count = static_cast<size_t>(whole.triangle_count);
        springls_mesh_free(model, &whole);
        return count;
    }

private:
    float radius() const { return 0.25f * static_cast<float>(options.grid); }
    [[noreturn]] void fail() const { throw std::string(springls_last_error(model)); }

    // Runs one frame: physics and picking query the model; the step in progress gets the rest of the budget; when it is done the
    // changed chunks are made, in as many frames as they take, and uploaded together.
    void update(int frame, double until)
    {
        double changes = 0;
        size_t bytes = 0;
        roll();
        aim(frame);
        if (!meshing && !springls_step_in_progress(model)) {
            if (report.steps % 4 == 0) remember();
            history.push_back(brush);
            if (springls_step_begin(model, &step) != SPRINGLS_OK) fail();
            frames_of_step = 0;
        }
        ++frames_of_step;
        bool done = false;
        if (!meshing) {
            if (springls_step_continue(model, std::max(until - now(nullptr), 0.0), &done) != SPRINGLS_OK) fail();
            if (done) {
                ++report.steps;
                report.frames_a_step.push_back(frames_of_step);
                if (springls_chunks_begin(model, chunks) != SPRINGLS_OK) fail();
                meshing = true;
            }
        }
        if (meshing) {
            const double begin = now(nullptr);
            bytes = refresh(std::max(until - begin, 0.0));
            changes = 1e3 * (now(nullptr) - begin);
        }
        report.changes.push_back(changes);
        report.uploaded.push_back(static_cast<double>(bytes));
    }

    // Continues the update of chunks, and uploads what has changed when it is done.
    size_t refresh(double seconds)
    {
        const springls_chunk *changed;
        int count;
        bool done = false;
        if (springls_chunks_continue(model, chunks, seconds, &changed, &count, &done) != SPRINGLS_OK) fail();
        meshing = !done;
        if (meshing) return 0;
        const size_t bytes = mesh.upload(changed, count);
        mesh.flip();
        return bytes;
    }

    // Brings the mesh up to date, however long that takes.
    void refresh_all()
    {
        if (!meshing && springls_chunks_begin(model, chunks) != SPRINGLS_OK) fail();
        meshing = true;
        while (meshing) refresh(1);
    }

    // Moves the mouse on a circle; a ray finds the place to push. The brush of a step in progress does not change.
    void aim(int frame)
    {
        if (meshing || springls_step_in_progress(model)) return;
        const float turn = 0.01f * static_cast<float>(frame), middle = 0.5f * static_cast<float>(options.grid - 1);
        const float eye[3] = {middle + 2 * radius() * std::cos(turn), middle, middle + 2 * radius() * std::sin(turn)};
        const float look[3] = {middle - eye[0], middle - eye[1], middle - eye[2]};
        springls_hit hit;
        if (springls_raycast(model, SPRINGLS_SURFACE_WATERTIGHT, eye, look, 1, 0, &hit) != SPRINGLS_OK) fail();
        if (hit.springl < 0) return;
        ++report.picks;
        springls_to_voxel(model, hit.point, 1, brush.center);
        for (int k = 0; k < 3; ++k) brush.velocity[k] = look[k] / (2 * radius());
    }

    // Lets a marble fall on the body and roll off: collision needs only the distance and its gradient.
    void roll()
    {
        const float size = 2, gravity = 0.02f;
        float distance, normal[3], speed = 0;
        fall[1] -= gravity;
        for (int k = 0; k < 3; ++k) marble[k] += fall[k];
        if (springls_sample_distance(model, marble, 1, &distance) != SPRINGLS_OK
            || springls_sample_gradient(model, marble, 1, normal) != SPRINGLS_OK)
            fail();
        if (distance >= size) return;
        for (int k = 0; k < 3; ++k) speed += fall[k] * normal[k];
        for (int k = 0; k < 3; ++k) {
            marble[k] += (size - distance) * normal[k];
            fall[k] -= std::min(speed, 0.0f) * normal[k] * 1.3f;
        }
        ++report.touches;
    }

    struct Moment {
        int step;
        std::vector<unsigned char> bytes;
    };

    // Saves the model for undo every few steps, reusing memory blocks.
    void remember()
    {
        Moment moment;
        size_t size = 0;
        const double begin = now(nullptr);
        if (undo.size() == 4) {
            moment = std::move(undo.front());
            undo.pop_front();
        }
        moment.step = report.steps;
        if (springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_FRAME, nullptr, 0, &size) != SPRINGLS_OK) fail();
        moment.bytes.resize(size);
        if (springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_FRAME, moment.bytes.data(), size, &size) != SPRINGLS_OK) fail();
        report.snapshot_ms = std::max(report.snapshot_ms, 1e3 * (now(nullptr) - begin));
        report.snapshot_bytes = size;
        undo.push_back(std::move(moment));
    }

    // Completes what is in progress.
    void finish()
    {
        bool done = false;
        const bool begun = springls_step_in_progress(model);
        if (meshing) refresh_all();
        while (!done)
            if (springls_step_continue(model, 1, &done) != SPRINGLS_OK) fail();
        report.steps += begun;
        refresh_all();
    }

    // Restores the oldest snapshot and runs forward with the same inputs, which gives the same bits.
    void rollback()
    {
        if (undo.empty()) return;
        const Moment &moment = undo.front();
        const uint64_t before = springls_state_hash(model);
        const double begin = now(nullptr);
        if (springls_restore(model, moment.bytes.data(), moment.bytes.size()) != SPRINGLS_OK) fail();
        report.restore_ms = 1e3 * (now(nullptr) - begin);
        for (int i = moment.step; i < report.steps; ++i) {
            brush = history[static_cast<size_t>(i)];
            if (springls_step(model, &step) != SPRINGLS_OK) fail();
        }
        report.rollback_same = springls_state_hash(model) == before;
    }

    Options options;
    Heap &heap;
    Jobs jobs;
    springls_context *model = nullptr;
    springls_chunks *chunks = nullptr;
    springls_forces forces{};
    springls_step_desc step{};
    Brush brush{};
    Mesh mesh;
    std::vector<Brush> history; // brush of every step begun
    std::deque<Moment> undo;
    float marble[3] = {}, fall[3] = {0.03f, 0, 0.05f};
    int frames_of_step = 0;
    bool meshing = false; // an update of chunks is in progress
    Report report;
};

// ---- output ----

double quantile(std::vector<double> values, double q)
{
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[static_cast<size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

void print_row(const char *name, const std::vector<double> &v, double scale)
{
    std::printf("%-24s %10.2f %10.2f %10.2f\n", name, scale * quantile(v, 0.5), scale * quantile(v, 0.95),
                scale * quantile(v, 1));
}

void print(const Options &o, const Report &r)
{
    std::printf("grid %d^3, %d springls, %d threads, %d frames, %d steps, budget %.1f ms\n", o.grid, r.springls,
                o.threads, o.frames, r.steps, o.budget);
    std::printf("%-24s %10s %10s %10s\n", "", "p50", "p95", "max");
    print_row("update, ms", r.update, 1);
    print_row("over the budget, ms", r.overrun, 1);
    print_row("chunks, ms", r.changes, 1);
    print_row("frames a step", r.frames_a_step, 1);
    print_row("uploaded, KiB", r.uploaded, 1.0 / 1024);
    std::printf("whole mesh %.0f KiB; snapshot %.0f KiB, at most %.2f ms; restore %.2f ms\n",
                static_cast<double>(r.whole_bytes) / 1024, static_cast<double>(r.snapshot_bytes) / 1024,
                r.snapshot_ms, r.restore_ms);
    std::printf("%d picks, %d touches of the marble; rollback: %s; memory at most %.1f MiB, %lu bytes left\n",
                r.picks, r.touches, r.rollback_same ? "the same bits" : "DIFFERENT",
                static_cast<double>(r.peak_bytes) / 1048576, static_cast<unsigned long>(r.bytes_left));
}

void print_json_row(FILE *file, const char *name, const std::vector<double> &v)
{
    std::fprintf(file, "  \"%s\": {\"p50\": %.4f, \"p95\": %.4f, \"max\": %.4f},\n", name, quantile(v, 0.5),
                 quantile(v, 0.95), quantile(v, 1));
}

bool write_json(const Options &o, const Report &r)
{
    FILE *file = o.json == "-" ? stdout : std::fopen(o.json.c_str(), "w");
    if (!file) return false;
    std::fprintf(file,
                 "{\n  \"problem\": \"engine_embed\", \"grid\": %d, \"frames\": %d, \"threads\": %d, \"budget_ms\": "
                 "%g, \"steps\": %d, \"springls_final\": %d,\n",
                 o.grid, o.frames, o.threads, o.budget, r.steps, r.springls);
    print_json_row(file, "update_ms", r.update);
    print_json_row(file, "overrun_ms", r.overrun);
    print_json_row(file, "chunks_ms", r.changes);
    print_json_row(file, "frames_a_step", r.frames_a_step);
    print_json_row(file, "uploaded_bytes", r.uploaded);
    std::fprintf(file,
                 "  \"mesh_bytes\": %lu, \"snapshot_bytes\": %lu, \"snapshot_ms\": %.3f, \"restore_ms\": %.3f, "
                 "\"peak_bytes\": %lu,\n",
                 static_cast<unsigned long>(r.whole_bytes), static_cast<unsigned long>(r.snapshot_bytes),
                 r.snapshot_ms, r.restore_ms, static_cast<unsigned long>(r.peak_bytes));
    std::fprintf(file, "  \"picks\": %d, \"touches\": %d, \"rollback_same\": %s\n}\n", r.picks, r.touches,
                 r.rollback_same ? "true" : "false");
    const bool good = std::ferror(file) == 0;
    return file == stdout ? std::fflush(file) == 0 && good : std::fclose(file) == 0 && good;
}

Report run(const Options &options)
{
    Heap heap;
    auto game = std::make_unique<Game>(options, heap);
    Report report = game->play();
    report.mesh_triangles = game->mesh_triangles();
    game.reset();
    report.bytes_left = heap.bytes;
    return report;
}

bool parse_number(const char *text, double low, double high, double *value)
{
    char *end;
    *value = std::strtod(text, &end);
    return end != text && *end == 0 && *value >= low && *value <= high;
}

int main(int argc, char **argv)
{
    Options o;
    for (int i = 1; i < argc; ++i) {
        const std::string name = argv[i];
        double value = 0;
        if (name == "--help") {
            std::puts("engine_embed: springls inside a game loop; prints what frames cost\n"
                      "  --grid N        voxels a side, 32 to 512 (96)\n"
                      "  --frames N      1 to 100000 (240)\n"
                      "  --threads N     1 to 64 (2)\n"
                      "  --budget MS     milliseconds a frame for the update, 0.1 to 1000 (5)\n"
                      "  --json FILE     the numbers as JSON; - is standard output\n"
                      "  --quiet         no table");
            return 0;
        }
        if (name == "--quiet") {
            o.quiet = true;
            continue;
        }
        const char *text = i + 1 < argc ? argv[++i] : nullptr;
        bool good = text != nullptr;
        if (good && name == "--grid" && (good = parse_number(text, 32, 512, &value))) o.grid = static_cast<int>(value);
        else if (good && name == "--frames" && (good = parse_number(text, 1, 100000, &value))) o.frames = static_cast<int>(value);
        else if (good && name == "--threads" && (good = parse_number(text, 1, 64, &value))) o.threads = static_cast<int>(value);
        else if (good && name == "--budget" && (good = parse_number(text, 0.1, 1000, &value))) o.budget = value;
        else if (good && name == "--json") o.json = text;
        else good = false;
        if (!good) {
            std::fprintf(stderr, "engine_embed: %s%s%s is no good; see --help\n", name.c_str(), text ? " " : "",
                         text ? text : "");
            return 2;
        }
    }
    try {
        const Report report = run(o);
        if (!o.quiet && o.json != "-") print(o, report);
        if (!o.json.empty() && !write_json(o, report)) throw "cannot write " + o.json;
        return report.rollback_same ? 0 : 1;
    } catch (const std::string &why) {
        std::fprintf(stderr, "engine_embed: %s\n", why.c_str());
        return 1;
    }
}

} // namespace engine

#ifndef ENGINE_EMBED_TEST
int main(int argc, char **argv) { return engine::main(argc, argv); }
#endif
