/* max_flow.cpp - libmaxflow, which is C++, for C. */
#if defined(__has_include)
#if __has_include(<maxflow.h>)
#define HAS_MAXFLOW 1
#endif
#endif

#ifdef HAS_MAXFLOW
#include <maxflow.h>
#endif

#include <cstddef>
#include <cstdlib>
#include <new>

extern "C" {
#include "imaging/max_flow.h"
}

#ifdef HAS_MAXFLOW
namespace {

typedef maxflow::Graph_FFF Graph;

/* Of libmaxflow's nodes and edges, which it reallocates where they were too few: here there are just enough. */
constexpr size_t node_bytes = 64, edge_bytes = 80;

/* Without it libmaxflow ends the program. */
void give_up(const char *) { throw std::bad_alloc(); }

/* libmaxflow does not free the nodes where it has no room for the edges. */
bool has_room(size_t voxels)
{
    void *room = std::malloc(voxels * (node_bytes + 3 * edge_bytes));
    std::free(room);
    return room != nullptr;
}

void connect(Graph &graph, const int dims[3], const float *gain, const float *walls)
{
    const int strides[3] = {1, dims[0], dims[0] * dims[1]};
    int n = 0;
    for (int k = 0; k < dims[2]; ++k) {
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                const int place[3] = {i, j, k};
                graph.add_tweights(n, gain[n] > 0.0f ? gain[n] : 0.0f, gain[n] < 0.0f ? -gain[n] : 0.0f);
                for (int a = 0; a < 3; ++a) {
                    if (place[a] + 1 < dims[a]) {
                        const float wall = walls[3 * static_cast<size_t>(n) + static_cast<size_t>(a)];
                        graph.add_edge(n, n + strides[a], wall, wall);
                    }
                }
            }
        }
    }
}

} // namespace

bool max_flow_is_there(void) { return true; }

bool max_flow_cut(const int dims[3], const float *gain, const float *walls, uint8_t *inside)
{
    const size_t voxels = static_cast<size_t>(dims[0]) * static_cast<size_t>(dims[1]) * static_cast<size_t>(dims[2]);
    if (voxels > 0x7fffffff / 6 || !has_room(voxels)) {
        return false;
    }
    try {
        Graph graph(static_cast<int>(voxels), static_cast<int>(3 * voxels), give_up);
        graph.add_node(static_cast<int>(voxels));
        connect(graph, dims, gain, walls);
        graph.maxflow();
        for (size_t n = 0; n < voxels; ++n) {
            inside[n] = graph.what_segment(static_cast<int>(n)) == Graph::SOURCE;
        }
    } catch (const std::bad_alloc &) {
        return false;
    }
    return true;
}

#else

bool max_flow_is_there(void) { return false; }

bool max_flow_cut(const int *, const float *, const float *, uint8_t *) { return false; }

#endif
