/* test_self_intersections.cc - CGAL looks for triangles that cross each other in the meshes of lives of models: a flow and random
   edits (LONG_STEPS, LONG_EDITS: make long); and it finds the places of a mesh that are closest to points, as springls_closest
   does. Skipped where CGAL is not installed. */
#include "greatest.h"
#include "springls.h"

GREATEST_MAIN_DEFS();

#if !__has_include(<CGAL/Polygon_mesh_processing/self_intersections.h>)

TEST cgal_is_not_installed(void) { SKIPm("there is no CGAL"); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(cgal_is_not_installed);
    GREATEST_MAIN_END();
}

#else

#include "long_lives.h"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/distance.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

typedef CGAL::Exact_predicates_inexact_constructions_kernel Kernel;
typedef CGAL::Surface_mesh<Kernel::Point_3> Mesh;

enum { CHECKPOINTS = 10 };

static bool to_cgal(const springls_mesh &from, Mesh &to)
{
    for (int i = 0; i < from.vertex_count; ++i) {
        const float *x = from.positions + 3 * i;
        to.add_vertex(Kernel::Point_3(double(x[0]), double(x[1]), double(x[2])));
    }
    for (int i = 0; i < from.triangle_count; ++i) {
        const int *t = from.triangles + 3 * i;
        if (to.add_face(Mesh::Vertex_index(unsigned(t[0])), Mesh::Vertex_index(unsigned(t[1])), Mesh::Vertex_index(unsigned(t[2])))
            == Mesh::null_face())
            return false;
    }
    return true;
}

TEST no_triangles_cross(int kind, const char *variable, int usual)
{
    const char *text = getenv(variable);
    const int length = text && text[0] ? atoi(text) : usual;
    life l;
    ASSERT_EQ(SPRINGLS_OK, life_begin(&l, kind));
    for (int i = 0; i < 2 * CHECKPOINTS; ++i) { /* of the zero level, then of springls */
        springls_params params = springls_get_params(l.ctx);
        springls_mesh mesh;
        springls_measures measures;
        Mesh judged;
        params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
        if (i % 2) params.contouring = SPRINGLS_CONTOURING_SPRINGLS;
        if (i % 2 == 0) ASSERT_EQ(SPRINGLS_OK, life_advance(&l, length / CHECKPOINTS > 0 ? length / CHECKPOINTS : 1));
        ASSERT_EQ(SPRINGLS_OK, springls_set_params(l.ctx, &params));
        ASSERT_EQ(SPRINGLS_OK, springls_extract_mesh(l.ctx, &mesh));
        ASSERT_EQ(SPRINGLS_OK, springls_measure(l.ctx, &measures));
        ASSERT(to_cgal(mesh, judged)); /* edges of two triangles, in order */
        ASSERT(CGAL::is_closed(judged));
        ASSERT_IN_RANGE(CGAL::to_double(CGAL::Polygon_mesh_processing::volume(judged)), measures.volume, 1e-4 * measures.volume);
        ASSERT_FALSE(CGAL::Polygon_mesh_processing::does_self_intersect(judged));
        springls_mesh_free(l.ctx, &mesh);
        params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
        ASSERT_EQ(SPRINGLS_OK, springls_set_params(l.ctx, &params));
    }
    life_end(&l);
    PASS();
}

/* From every vertex of the mesh after half a flow to the mesh of before, and the largest of these, half a Hausdorff distance. */
TEST closest_places_agree(void)
{
    typedef CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_face_graph_triangle_primitive<Mesh>>> Tree;
    springls_mesh before, after;
    double largest = 0.0;
    Mesh judged;
    life l, moved;
    ASSERT_EQ(SPRINGLS_OK, life_begin(&l, LIFE_FLOW));
    ASSERT_EQ(SPRINGLS_OK, life_begin(&moved, LIFE_FLOW));
    ASSERT_EQ(SPRINGLS_OK, life_advance(&moved, 50));
    ASSERT_EQ(SPRINGLS_OK, springls_extract_mesh(l.ctx, &before));
    ASSERT_EQ(SPRINGLS_OK, springls_extract_mesh(moved.ctx, &after));
    ASSERT(to_cgal(before, judged));
    Tree tree(faces(judged).first, faces(judged).second, judged);
    std::vector<Kernel::Point_3> points;
    for (int i = 0; i < after.vertex_count; ++i) {
        const float *x = after.positions + 3 * i;
        springls_hit hit;
        points.emplace_back(double(x[0]), double(x[1]), double(x[2]));
        ASSERT_EQ(SPRINGLS_OK, springls_closest(l.ctx, SPRINGLS_SURFACE_WATERTIGHT, x, 1, &hit));
        ASSERT_IN_RANGE(std::sqrt(tree.squared_distance(points.back())), double(hit.distance), 1e-4);
        largest = std::fmax(largest, double(hit.distance));
    }
    ASSERT_GT(largest, 5.0);
    ASSERT_IN_RANGE(CGAL::Polygon_mesh_processing::max_distance_to_triangle_mesh<CGAL::Sequential_tag>(points, judged), largest,
                    1e-4);
    springls_mesh_free(l.ctx, &before);
    springls_mesh_free(moved.ctx, &after);
    life_end(&moved);
    life_end(&l);
    PASS();
}

SUITE(self_intersections)
{
    RUN_TEST(closest_places_agree);
    RUN_TESTp(no_triangles_cross, LIFE_FLOW, "LONG_STEPS", 200);
    RUN_TESTp(no_triangles_cross, LIFE_EDITS, "LONG_EDITS", 30);
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(self_intersections);
    GREATEST_MAIN_END();
}

#endif
