/* mesh_measure.h - measures an indexed triangle mesh, and counts its faults. Allocates nothing. */
#ifndef SPRINGLS__MODEL_MESH_MEASURE_H
#define SPRINGLS__MODEL_MESH_MEASURE_H

#include "../../kernels_embed/language/vector.h"
#include "../runtime/algorithms.h"
#include "../runtime/finite.h"

/* Holds measures, in the units of the positions, and counts. */
typedef struct springls__mesh_report {
    double volume;             /* by the divergence theorem, positive when wound outwards; meaningless with
                                  unbalanced edges                                                              */
    double area;
    float lo[3], hi[3];        /* of the vertices in use; zeros without any                                     */
    int vertices;              /* in use                                                                        */
    int edges, triangles;      /* of the triangles that count: neither invalid nor with a repeated vertex       */
    int euler;                 /* vertices - edges + triangles: 2 for a sphere, 0 for a torus                   */
    int components;            /* connected through shared vertices                                             */
    int boundary_edges;        /* used by one triangle                                                          */
    int misoriented_edges;     /* used by two triangles that run along it in the same direction                */
    int nonmanifold_edges;     /* used by three or more                                                         */
    int unbalanced_edges;      /* used more often in one direction; none: the mesh has an inside                */
    int degenerate_triangles;  /* of no area, those with a repeated vertex included                             */
    int invalid_triangles;     /* with an index out of range or a vertex that is not finite                     */
} springls__mesh_report;

/* Returns in v the vertices of triangle t, and true if it is valid: indices in range, coordinates finite. */
SPRINGLS__FN bool springls__mesh_triangle(const float *positions, int n, const int32_t *triangles, int t, int32_t v[3])
{
    int i, c;
    for (i = 0; i < 3; ++i) {
        v[i] = triangles[3 * (size_t)t + (size_t)i];
        if (v[i] < 0 || v[i] >= n) return false;
        for (c = 0; c < 3; ++c)
            if (!springls__finite_float(positions[3 * (size_t)v[i] + (size_t)c])) return false;
    }
    return true;
}

/* Returns whether two of the three vertices are the same. */
SPRINGLS__FN bool springls__mesh_repeats(const int32_t v[3]) { return v[0] == v[1] || v[1] == v[2] || v[2] == v[0]; }

/* Adds the area of one triangle and six times its volume about the center; counts it as degenerate when it has no area. */
SPRINGLS__FN void springls__mesh_add(springls__mesh_report *report, const float *positions, const int32_t v[3],
                                     const double center[3])
{
    double p[3][3], u[3], w[3], x[3], side2, longest2 = 0.0, area2;
    int i, c;
    for (i = 0; i < 3; ++i)
        for (c = 0; c < 3; ++c) p[i][c] = (double)positions[3 * (size_t)v[i] + (size_t)c] - center[c];
    for (c = 0; c < 3; ++c) { u[c] = p[1][c] - p[0][c]; w[c] = p[2][c] - p[0][c]; }
    for (c = 0; c < 3; ++c) x[c] = u[(c + 1) % 3] * w[(c + 2) % 3] - u[(c + 2) % 3] * w[(c + 1) % 3];
    for (i = 0; i < 3; ++i) {
        for (side2 = 0.0, c = 0; c < 3; ++c) side2 += (p[(i + 1) % 3][c] - p[i][c]) * (p[(i + 1) % 3][c] - p[i][c]);
        if (side2 > longest2) longest2 = side2;
    }
    area2 = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    if (area2 <= 1e-7 * longest2) ++report->degenerate_triangles;
    report->area += 0.5 * area2;
    report->volume += p[0][0] * x[0] + p[0][1] * x[1] + p[0][2] * x[2];
}

/* Returns a sorting key of the half-edge from a to b: lower vertex << 32 | higher vertex << 1 | 1 when a is the higher. */
SPRINGLS__FN uint64_t springls__half_edge_key(int32_t a, int32_t b)
{
    uint64_t low = (uint64_t)(a < b ? a : b), high = (uint64_t)(a < b ? b : a);
    return low << 32 | high << 1 | (uint64_t)(a > b);
}

/* Counts the edges by their sorted half-edge keys. */
SPRINGLS__FN void springls__mesh_count_edges(springls__mesh_report *report, const uint64_t *half_edges, size_t count)
{
    size_t i = 0;
    while (i < count) {
        uint64_t edge = half_edges[i] >> 1;
        int upward = 0, downward = 0; /* half-edges from the lower vertex to the higher, and back */
        for (; i < count && half_edges[i] >> 1 == edge; ++i)
            if (half_edges[i] & 1) ++downward;
            else ++upward;
        ++report->edges;
        report->boundary_edges += upward + downward == 1;
        report->misoriented_edges += upward + downward == 2 && upward != 1;
        report->nonmanifold_edges += upward + downward > 2;
        report->unbalanced_edges += upward != downward;
    }
}

/* Enters a vertex when it is first used: as a component of its own, and into the bounds. */
SPRINGLS__FN void springls__mesh_use_vertex(springls__mesh_report *report, const float *positions, int32_t *parent, int32_t a)
{
    int c;
    if (parent[a] >= 0) return;
    parent[a] = a;
    for (c = 0; c < 3; ++c) {
        float x = positions[3 * (size_t)a + (size_t)c];
        report->lo[c] = report->vertices ? springls__min(report->lo[c], x) : x;
        report->hi[c] = report->vertices ? springls__max(report->hi[c], x) : x;
    }
    ++report->vertices;
}

/* Counts the triangles and their vertices, joins the components, and lists the half-edges. Returns the number of these. */
SPRINGLS__FN size_t springls__mesh_count(const float *positions, int n, const int32_t *triangles, int m, int32_t *parent,
                                         uint64_t *half_edges, springls__mesh_report *report)
{
    size_t count = 0;
    int32_t v[3], i;
    int t;
    for (i = 0; i < n; ++i) parent[i] = -1;
    for (t = 0; t < m; ++t) {
        if (!springls__mesh_triangle(positions, n, triangles, t, v)) { ++report->invalid_triangles; continue; }
        if (springls__mesh_repeats(v)) { ++report->degenerate_triangles; continue; }
        ++report->triangles;
        for (i = 0; i < 3; ++i) {
            half_edges[count++] = springls__half_edge_key(v[i], v[(i + 1) % 3]);
            springls__mesh_use_vertex(report, positions, parent, v[i]);
        }
        for (i = 1; i < 3; ++i) springls__join_trees(parent, v[0], v[i]);
    }
    for (i = 0; i < n; ++i) report->components += parent[i] == i;
    return count;
}

/* Measures n vertices (3 floats each) and m triangles (3 indices each). Sums in index order in double precision: the same mesh
   gives the same bits. parent: n and half_edges: 3 m entries of working memory. */
SPRINGLS__FN void springls__mesh_measure(const float *positions, int n, const int32_t *triangles, int m, int32_t *parent,
                                         uint64_t *half_edges, springls__mesh_report *report)
{
    size_t count;
    double center[3];
    int32_t v[3];
    int t, c;
    memset(report, 0, sizeof *report);
    count = springls__mesh_count(positions, n, triangles, m, parent, half_edges, report);
    for (c = 0; c < 3; ++c) center[c] = 0.5 * ((double)report->lo[c] + (double)report->hi[c]);
    for (t = 0; t < m; ++t)
        if (springls__mesh_triangle(positions, n, triangles, t, v) && !springls__mesh_repeats(v))
            springls__mesh_add(report, positions, v, center);
    report->volume /= 6.0;
    springls__sort_keys(half_edges, count);
    springls__mesh_count_edges(report, half_edges, count);
    report->euler = report->vertices - report->edges + report->triangles;
}

#endif
