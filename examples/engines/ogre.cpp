// ogre.cpp - springls inside OGRE 1.12: OGRE's memory, its work queue's threads and its log serve the library; chunks become
// OGRE's meshes. LeVeque's flow draws a ball out, and the checks on it show where its points have come from.
//
//   ogre [--grid 64] [--steps 8] [--threads 2] [--picture FILE.png] [--alone]
//
// Prints the state's hash. --alone: the same without OGRE, by the library's own defaults, which leaves the same bits.
#define SPRINGLS_STATIC
#define SPRINGLS_IMPLEMENTATION
#include "examples/common/springls/exact_flows.h"
#include "springls.h"

#include <Ogre.h>

#include <algorithm>
#include <atomic>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <thread>
#include <vector>

namespace {

// ---- what OGRE gives to the library ----

void *allocate(size_t size, void *)
{
    try {
        return Ogre::AlignedMemory::allocate(size, 64);
    } catch (const std::bad_alloc &) {
        return nullptr;
    }
}

void release(void *memory, size_t, void *) { Ogre::AlignedMemory::deallocate(memory); }

void log(void *, int level, const char *message)
{
    const Ogre::LogMessageLevel levels[] = {Ogre::LML_CRITICAL, Ogre::LML_WARNING, Ogre::LML_NORMAL};
    Ogre::LogManager::getSingleton().logMessage(std::string("springls: ") + message, levels[std::min(std::max(level, 1), 3) - 1]);
}

// Parallel loops by requests to OGRE's work queue. Requests that come late find nothing left to do, and may outlive the loop.
class Jobs : public Ogre::WorkQueue::RequestHandler {
public:
    Jobs(Ogre::WorkQueue &work_queue, int threads)
        : queue(work_queue), channel(queue.getChannel("springls")), helpers(threads - 1)
    {
        queue.addRequestHandler(channel, this);
    }
    ~Jobs() override
    {
        queue.abortRequestsByChannel(channel);
        queue.removeRequestHandler(channel, this);
    }
    Jobs(const Jobs &) = delete;
    Jobs &operator=(const Jobs &) = delete;

    static void parallel_for(void *user, int count, int grain, springls_task task, void *arg)
    {
        Jobs &jobs = *static_cast<Jobs *>(user);
        const auto loop = std::make_shared<Loop>(task, arg, count, grain);
        for (int i = 0; i < jobs.helpers && (i + 1) * grain < count; ++i) jobs.queue.addRequest(jobs.channel, 0, Ogre::Any(loop));
        loop->take_ranges();
        while (loop->done < count) std::this_thread::yield();
    }

    Ogre::WorkQueue::Response *handleRequest(const Ogre::WorkQueue::Request *request, const Ogre::WorkQueue *) override
    {
        Ogre::any_cast<std::shared_ptr<Loop>>(request->getData())->take_ranges();
        return OGRE_NEW Ogre::WorkQueue::Response(request, true, Ogre::Any());
    }

private:
    struct Loop {
        Loop(springls_task what, void *with, int how_many, int at_once) : task(what), arg(with), count(how_many), grain(at_once) {}
        void take_ranges()
        {
            for (int begin; (begin = next.fetch_add(grain)) < count;) {
                const int end = std::min(begin + grain, count);
                task(arg, begin, end);
                done += end - begin;
            }
        }
        springls_task task;
        void *arg;
        int count, grain;
        std::atomic<int> next{0}, done{0};
    };
    Ogre::WorkQueue &queue;
    Ogre::uint16 channel;
    int helpers;
};

// ---- the model ----

struct Options {
    int grid = 64, steps = 8, threads = 2;
    std::string picture;
    bool alone = false;
};

constexpr float ball_center = 0.35f; // of the grid, in all directions

// LeVeque's ball and flow (section 5.1), of which a picture has `steps` parts of 24.
class Model {
public:
    Model(int grid, springls_desc desc) : flow EXACT_DEFORMATION(static_cast<float>(grid), 2.5f)
    {
        const float n = static_cast<float>(grid);
        const springls_chunks_desc with_correspondences = {0, true, false};
        springls_sphere ball = {{ball_center * n, ball_center * n, ball_center * n}, 0.15f * n};
        for (int &side : desc.grid.size) side = grid;
        if (springls_create(&desc, &model) != SPRINGLS_OK) throw std::string(springls_create_error(&desc));
        forces.velocity = exact_flow_velocity;
        forces.user = &flow;
        step.forces = &forces;
        step.dt = flow.period / 24;
        step.max_displacement = 2;
        check(springls_set_implicit(model, springls_implicit_sphere, &ball));
        check(springls_chunks_create(model, &with_correspondences, &chunks));
    }
    ~Model()
    {
        springls_chunks_destroy(model, chunks);
        springls_destroy(model);
    }
    Model(const Model &) = delete;
    Model &operator=(const Model &) = delete;

    void whole_step() { check(springls_step(model, &step)); }

    // Goes on for a time, in seconds. Returns true when a step has been completed.
    bool part_of_step(double seconds)
    {
        bool done = false;
        if (!springls_step_in_progress(model)) check(springls_step_begin(model, &step));
        check(springls_step_continue(model, seconds, &done));
        return done;
    }

    // Calls update(chunk) for each chunk that has changed.
    template <class Update> void for_changed_chunks(Update update)
    {
        const springls_chunk *changed;
        int count;
        check(springls_chunks_update(model, chunks, &changed, &count));
        for (int i = 0; i < count; ++i) update(changed[i]);
    }
    uint64_t hash() const { return springls_state_hash(model); }

private:
    void check(springls_status status) const
    {
        if (status != SPRINGLS_OK) throw std::string(springls_last_error(model));
    }
    springls_context *model = nullptr;
    springls_chunks *chunks = nullptr;
    struct exact_flow flow;
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
};

// ---- the scene ----

struct Vertex {
    float position[3], normal[3], checks[3]; // checks: the place in the texture
};

constexpr float checks_wide = 0.1f; // two checks, of the grid: a third of the ball; its poles are in the middle of one

// Makes a texture of 2^3 checks, which repeats: the squares are sharp, however far apart the vertices are.
void make_checks(const std::string &name, const std::string &group)
{
    constexpr int check = 32, side = 2 * check;
    const auto texture =
        Ogre::TextureManager::getSingleton().createManual(name, group, Ogre::TEX_TYPE_3D, side, side, side, 0, Ogre::PF_BYTE_RGB);
    std::vector<unsigned char> texels;
    for (int i = 0; i < side * side * side; ++i) {
        const bool blue = (i / check + i / side / check + i / side / side / check) % 2 == 0;
        for (const int value : {blue ? 51 : 230, blue ? 115 : 140, blue ? 191 : 51}) texels.push_back(static_cast<unsigned char>(value));
    }
    texture->getBuffer()->blitFromMemory(Ogre::PixelBox(side, side, side, Ogre::PF_BYTE_RGB, texels.data()));
}

Ogre::AxisAlignedBox write_vertices(const springls_chunk &chunk, float grid, Ogre::VertexData &data)
{
    const size_t count = static_cast<size_t>(chunk.vertex_count);
    std::vector<Vertex> vertices(count);
    Ogre::AxisAlignedBox box;
    for (size_t i = 0; i < count; ++i) {
        std::copy_n(chunk.positions + 3 * i, 3, vertices[i].position);
        std::copy_n(chunk.normals + 3 * i, 3, vertices[i].normal);
        std::transform(chunk.correspondences + 3 * i, chunk.correspondences + 3 * i + 3, vertices[i].checks,
                       [grid](float x) { return (x - ball_center * grid) / (checks_wide * grid) + 0.25f; });
        box.merge(Ogre::Vector3(vertices[i].position));
    }
    data.vertexCount = count;
    data.vertexDeclaration->addElement(0, offsetof(Vertex, position), Ogre::VET_FLOAT3, Ogre::VES_POSITION);
    data.vertexDeclaration->addElement(0, offsetof(Vertex, normal), Ogre::VET_FLOAT3, Ogre::VES_NORMAL);
    data.vertexDeclaration->addElement(0, offsetof(Vertex, checks), Ogre::VET_FLOAT3, Ogre::VES_TEXTURE_COORDINATES);
    const auto buffer = Ogre::HardwareBufferManager::getSingleton().createVertexBuffer(sizeof(Vertex), count, Ogre::HBU_GPU_ONLY);
    buffer->writeData(0, count * sizeof(Vertex), vertices.data());
    data.vertexBufferBinding->setBinding(0, buffer);
    return box;
}

void write_triangles(const springls_chunk &chunk, Ogre::IndexData &data)
{
    data.indexCount = 3 * static_cast<size_t>(chunk.triangle_count);
    data.indexBuffer = Ogre::HardwareBufferManager::getSingleton().createIndexBuffer(Ogre::HardwareIndexBuffer::IT_16BIT,
                                                                                     data.indexCount, Ogre::HBU_GPU_ONLY);
    data.indexBuffer->writeData(0, data.indexCount * sizeof(uint16_t), chunk.triangles);
}

// A window on the model: a mesh and an entity for each brick of its surface.
class Scene {
public:
    Scene(Ogre::Root &root, float grid)
        : window(*root.createRenderWindow("springls", 640, 480, false)), manager(*root.createSceneManager()), size(grid)
    {
        const auto material = Ogre::MaterialManager::getSingleton().create("checks", group());
        make_checks("checks", group());
        material->getTechnique(0)->getPass(0)->createTextureUnitState("checks");
        material->setCullingMode(Ogre::CULL_NONE);
        material->setSpecular(0.3f, 0.3f, 0.3f, 1);
        material->setShininess(30);
        manager.setAmbientLight(Ogre::ColourValue(0.25f, 0.25f, 0.25f));
        manager.createLight("sun")->setType(Ogre::Light::LT_DIRECTIONAL);
        place(*manager.getLight("sun"))->setDirection(-0.4f, -0.9f, -0.5f);
        Ogre::Camera &camera = *manager.createCamera("eye");
        camera.setAutoAspectRatio(true);
        camera.setNearClipDistance(1);
        place(camera)->setPosition(1.1f * grid, 0.8f * grid, 1.2f * grid);
        camera.getParentSceneNode()->lookAt({0.45f * grid, 0.4f * grid, 0.4f * grid}, Ogre::Node::TS_WORLD);
        window.addViewport(&camera)->setBackgroundColour(Ogre::ColourValue(0.93f, 0.94f, 0.96f));
    }

    void update(const springls_chunk &chunk)
    {
        const std::string name = Ogre::StringConverter::toString(chunk.brick[0]) + ","
            + Ogre::StringConverter::toString(chunk.brick[1]) + "," + Ogre::StringConverter::toString(chunk.brick[2]);
        if (manager.hasEntity(name)) {
            manager.destroyEntity(name);
            Ogre::MeshManager::getSingleton().remove(name, group());
        }
        if (chunk.triangle_count == 0) return;
        const Ogre::MeshPtr mesh = Ogre::MeshManager::getSingleton().createManual(name, group());
        Ogre::SubMesh &part = *mesh->createSubMesh();
        part.useSharedVertices = false;
        part.vertexData = OGRE_NEW Ogre::VertexData();
        part.setMaterialName("checks", group());
        mesh->_setBounds(write_vertices(chunk, size, *part.vertexData));
        write_triangles(chunk, *part.indexData);
        mesh->load();
        manager.getRootSceneNode()->attachObject(manager.createEntity(name, mesh));
    }
    bool closed() const { return window.isClosed(); }
    void save(const std::string &file) { window.writeContentsToFile(file); }

private:
    static const std::string &group() { return Ogre::ResourceGroupManager::DEFAULT_RESOURCE_GROUP_NAME; }
    Ogre::SceneNode *place(Ogre::MovableObject &object)
    {
        Ogre::SceneNode *node = manager.getRootSceneNode()->createChildSceneNode();
        node->attachObject(&object);
        return node;
    }
    Ogre::RenderWindow &window;
    Ogre::SceneManager &manager;
    float size; // of the grid
};

// ---- the program ----

uint64_t run_alone(const Options &options)
{
    Model model(options.grid, springls_default_desc());
    for (int i = 0; i < options.steps; ++i) model.whole_step();
    return model.hash();
}

uint64_t run(const Options &options)
{
    Ogre::LogManager logs;
    logs.createLog("ogre.log", true, false, true); // kept in memory
    Ogre::Root root("", "", "");
    root.loadPlugin(OGRE_PLUGINS "/RenderSystem_GL");
    root.loadPlugin(OGRE_PLUGINS "/Codec_STBI");
    root.setRenderSystem(root.getAvailableRenderers().at(0));
    static_cast<Ogre::DefaultWorkQueueBase *>(root.getWorkQueue())->setWorkerThreadCount(static_cast<size_t>(options.threads));
    root.initialise(false);
    Scene scene(root, static_cast<float>(options.grid));
    Jobs jobs(*root.getWorkQueue(), options.threads);

    springls_desc desc = springls_default_desc();
    desc.allocator = {allocate, release, nullptr};
    desc.tasks = {Jobs::parallel_for, &jobs};
    desc.logger.log = log;
    desc.trace.now = [](void *) { return 1e-6 * static_cast<double>(Ogre::Root::getSingleton().getTimer()->getMicroseconds()); };
    Model model(options.grid, desc);
    const auto upload = [&scene](const springls_chunk &chunk) { scene.update(chunk); };
    model.for_changed_chunks(upload);
    for (int steps = 0; steps < options.steps && !scene.closed();) {
        if (model.part_of_step(0.008)) { // of the 16 ms that a frame has
            ++steps;
            model.for_changed_chunks(upload);
        }
        root.renderOneFrame();
    }
    if (!options.picture.empty()) scene.save(options.picture);
    return model.hash();
}

bool parse(int argc, char **argv, Options &options)
{
    for (int i = 1; i < argc; ++i) {
        const std::string name = argv[i];
        int *number = name == "--grid" ? &options.grid : name == "--steps" ? &options.steps
            : name == "--threads" ? &options.threads : nullptr;
        if (name == "--alone") {
            options.alone = true;
        } else if (name == "--picture" && i + 1 < argc) {
            options.picture = argv[++i];
        } else if (number && i + 1 < argc) {
            char *end;
            const long value = std::strtol(argv[++i], &end, 10);
            if (*end != 0 || value < 1 || value > 512) return false;
            *number = static_cast<int>(value);
        } else {
            return false;
        }
    }
    return options.grid >= 16 && options.threads <= 64;
}

} // namespace

int main(int argc, char **argv)
{
    Options options;
    if (!parse(argc, argv, options)) {
        std::fputs("ogre [--grid 16..512] [--steps 1..512] [--threads 1..64] [--picture FILE.png] [--alone]\n", stderr);
        return 2;
    }
    try {
        std::printf("state %016" PRIx64 "\n", options.alone ? run_alone(options) : run(options));
        return 0;
    } catch (const std::string &why) {
        std::fprintf(stderr, "ogre: %s\n", why.c_str());
    } catch (const std::exception &why) { // Ogre::Exception is one
        std::fprintf(stderr, "ogre: %s\n", why.what());
    }
    return 1;
}
