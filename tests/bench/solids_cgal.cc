/* solids_cgal - what `make solids` wants of CGAL; one JSON object on stdout.

   solids_cgal wrap INPUT.ply OUTPUT.off ALPHA OFFSET   Alpha_wrap_3 of the triangles; both lengths in the mesh's unit
   solids_cgal crossings INPUT.ply|.off                 how many pairs of triangles cross */
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>
#include <vector>

typedef CGAL::Exact_predicates_inexact_constructions_kernel Kernel;
typedef CGAL::Surface_mesh<Kernel::Point_3> Mesh;

struct Soup {
    std::vector<Kernel::Point_3> points;
    std::vector<std::vector<std::size_t>> triangles;
};

static int wrap(const Soup &soup, const char *output, double alpha, double offset)
{
    Mesh result;
    CGAL::alpha_wrap_3(soup.points, soup.triangles, alpha, offset, result);
    if (!CGAL::IO::write_polygon_mesh(output, result, CGAL::parameters::stream_precision(9))) {
        return 1;
    }
    std::printf("{\"triangles\": %zu}\n", std::size_t(result.number_of_faces()));
    return 0;
}

static int crossings(Soup &soup)
{
    Mesh mesh;
    std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs;
    CGAL::Polygon_mesh_processing::orient_polygon_soup(soup.points, soup.triangles); /* vertices of several sheets are doubled */
    CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(soup.points, soup.triangles, mesh);
    CGAL::Polygon_mesh_processing::self_intersections(mesh, std::back_inserter(pairs));
    std::printf("{\"crossings\": %zu}\n", pairs.size());
    return 0;
}

int main(int argc, char **argv)
{
    Soup soup;
    const bool wraps = argc == 6 && std::strcmp(argv[1], "wrap") == 0, counts = argc == 3 && std::strcmp(argv[1], "crossings") == 0;
    if (!wraps && !counts) {
        std::fprintf(stderr, "usage: solids_cgal wrap INPUT OUTPUT ALPHA OFFSET | crossings INPUT\n");
        return 2;
    }
    if (!CGAL::IO::read_polygon_soup(argv[2], soup.points, soup.triangles)) {
        std::fprintf(stderr, "solids_cgal: cannot read %s\n", argv[2]);
        return 1;
    }
    return wraps ? wrap(soup, argv[3], std::atof(argv[4]), std::atof(argv[5])) : crossings(soup);
}
