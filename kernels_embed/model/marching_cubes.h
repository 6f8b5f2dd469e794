/* marching_cubes.h - the iso-surface phi = 0 inside one cube of eight grid values.
   Inside is phi < 0, outside is phi >= 0, everywhere in the library. Inside is 6-connected and outside 26-connected, the same
   pair that springls__is_simple keeps, so the mesh has exactly the topology of the digital object:
     - two inside corners that are diagonal on a face, or opposite in the cube, are never joined;
     - two opposite outside corners are joined by a tube through the ring of inside corners between them.
   Corner c of a cube is at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge 4 a + k runs along axis a in the direction of growing
   coordinates; k holds the other two coordinates, the lower axis in bit 0. Triangles are counter-clockwise seen from outside:
   their normals point to growing phi. Neighbouring cubes share edges exactly, so welding by (lower corner, axis) gives a
   closed manifold wherever the border of the grid is outside. At most six triangles a cube. */
#ifndef SPRINGLS__KERNEL_MODEL_MARCHING_CUBES_H
#define SPRINGLS__KERNEL_MODEL_MARCHING_CUBES_H

#include "grid.h"
#include "model.h"

typedef struct springls__mc_cell { float phi[8]; } springls__mc_cell;

/* Holds what the rules above give, made and checked by tests/unit/test_marching_cubes.c (test_marching_cubes --print-table). */
SPRINGLS__CONST unsigned char springls__mc_triangle_count[256] = {
    0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 2, 1, 2, 2, 3, 2, 3, 3, 4, 2, 3, 3, 4, 3, 4, 4, 3,
    1, 2, 2, 3, 2, 3, 3, 4, 2, 3, 3, 4, 3, 4, 4, 3, 2, 3, 3, 2, 3, 4, 4, 3, 3, 4, 4, 3, 4, 5, 5, 2,
    1, 2, 2, 3, 2, 3, 3, 4, 2, 3, 3, 4, 3, 4, 4, 3, 2, 3, 3, 4, 3, 2, 4, 3, 3, 4, 4, 5, 4, 3, 5, 2,
    2, 3, 3, 4, 3, 4, 4, 5, 3, 4, 4, 5, 4, 5, 5, 4, 3, 4, 4, 3, 4, 3, 5, 2, 4, 5, 5, 4, 5, 4, 6, 1,
    1, 2, 2, 3, 2, 3, 3, 4, 2, 3, 3, 4, 3, 4, 4, 3, 2, 3, 3, 4, 3, 4, 4, 5, 3, 4, 4, 5, 4, 5, 5, 4,
    2, 3, 3, 4, 3, 4, 4, 5, 3, 4, 2, 3, 4, 5, 3, 2, 3, 4, 4, 3, 4, 5, 5, 4, 4, 5, 3, 2, 5, 6, 4, 1,
    2, 3, 3, 4, 3, 4, 4, 5, 3, 4, 4, 5, 2, 3, 3, 2, 3, 4, 4, 5, 4, 3, 5, 4, 4, 5, 5, 6, 3, 2, 4, 1,
    3, 4, 4, 5, 4, 5, 5, 6, 4, 5, 3, 4, 3, 4, 2, 1, 2, 3, 3, 2, 3, 2, 4, 1, 3, 4, 2, 1, 2, 1, 1, 0
};

SPRINGLS__CONST unsigned char springls__mc_triangles[256][18] = {
    {0}, {0,4,8}, {0,9,5}, {4,8,5, 8,9,5}, {1,10,4}, {0,1,8, 1,10,8}, {0,9,5, 1,10,4}, {1,8,5, 1,10,8, 8,9,5}, {1,5,11},
    {0,4,8, 1,5,11}, {0,9,1, 9,11,1}, {1,9,11, 1,4,9, 4,8,9}, {4,5,10, 5,11,10}, {0,10,8, 0,5,10, 5,11,10},
    {0,11,4, 0,9,11, 11,10,4}, {8,9,10, 9,11,10}, {2,8,6}, {0,4,2, 4,6,2}, {0,9,5, 2,8,6}, {2,4,6, 2,9,4, 9,5,4},
    {1,10,4, 2,8,6}, {0,6,2, 0,10,6, 0,1,10}, {0,9,5, 1,10,4, 2,8,6}, {1,10,5, 10,6,5, 6,2,5, 2,9,5}, {1,5,11, 2,8,6},
    {0,4,2, 4,6,2, 1,5,11}, {0,9,1, 9,11,1, 2,8,6}, {1,6,11, 1,4,6, 6,2,11, 2,9,11}, {2,8,6, 4,5,10, 5,11,10},
    {0,5,2, 5,11,2, 11,6,2, 11,10,6}, {0,11,4, 0,9,11, 11,10,4, 2,8,6}, {2,11,6, 2,9,11, 11,10,6}, {2,7,9}, {0,4,8, 2,7,9},
    {0,2,5, 2,7,5}, {2,5,8, 2,7,5, 5,4,8}, {1,10,4, 2,7,9}, {0,1,8, 1,10,8, 2,7,9}, {0,2,5, 2,7,5, 1,10,4},
    {1,8,5, 1,10,8, 8,2,5, 2,7,5}, {1,5,11, 2,7,9}, {0,4,8, 1,5,11, 2,7,9}, {0,11,1, 0,7,11, 0,2,7},
    {1,4,11, 4,8,11, 8,2,11, 2,7,11}, {2,7,9, 4,5,10, 5,11,10}, {0,10,8, 0,5,10, 5,11,10, 2,7,9},
    {0,2,4, 2,10,4, 2,7,10, 7,11,10}, {2,10,8, 2,7,10, 7,11,10}, {6,7,8, 7,9,8}, {0,6,9, 0,4,6, 6,7,9}, {0,7,5, 0,8,7, 8,6,7},
    {4,6,5, 6,7,5}, {1,10,4, 6,7,8, 7,9,8}, {0,1,9, 1,7,9, 1,10,7, 10,6,7}, {0,7,5, 0,8,7, 8,6,7, 1,10,4},
    {1,7,5, 1,10,7, 10,6,7}, {1,5,11, 6,7,8, 7,9,8}, {0,6,9, 0,4,6, 6,7,9, 1,5,11}, {0,8,1, 8,6,1, 6,11,1, 6,7,11},
    {1,6,11, 1,4,6, 6,7,11}, {4,5,10, 5,11,10, 6,7,8, 7,9,8}, {0,6,9, 0,10,6, 0,5,10, 5,11,10, 6,7,9},
    {0,11,4, 0,7,11, 0,8,7, 8,6,7, 11,10,4}, {6,7,10, 7,11,10}, {3,6,10}, {0,4,8, 3,6,10}, {0,9,5, 3,6,10},
    {3,6,10, 4,8,5, 8,9,5}, {1,3,4, 3,6,4}, {0,1,8, 1,6,8, 1,3,6}, {0,9,5, 1,3,4, 3,6,4}, {1,3,5, 3,9,5, 3,6,9, 6,8,9},
    {1,5,11, 3,6,10}, {0,4,8, 1,5,11, 3,6,10}, {0,9,1, 9,11,1, 3,6,10}, {1,9,11, 1,4,9, 4,8,9, 3,6,10},
    {3,4,11, 3,6,4, 4,5,11}, {0,5,8, 5,11,8, 11,3,8, 3,6,8}, {0,11,4, 0,9,11, 11,3,4, 3,6,4}, {3,9,11, 3,6,9, 6,8,9},
    {2,8,3, 8,10,3}, {0,4,2, 4,10,2, 10,3,2}, {0,9,5, 2,8,3, 8,10,3}, {2,9,3, 9,5,3, 5,10,3, 5,4,10}, {1,3,4, 3,8,4, 3,2,8},
    {0,1,2, 1,3,2}, {0,9,5, 1,3,4, 3,8,4, 3,2,8}, {1,3,5, 3,9,5, 3,2,9}, {1,5,11, 2,8,3, 8,10,3},
    {0,4,2, 4,10,2, 10,3,2, 1,5,11}, {0,9,1, 9,11,1, 2,8,3, 8,10,3}, {1,9,11, 1,4,9, 4,2,9, 4,10,2, 10,3,2},
    {2,8,3, 8,4,3, 4,11,3, 4,5,11}, {0,5,2, 5,11,2, 11,3,2}, {0,11,4, 0,9,11, 11,3,4, 3,8,4, 3,2,8}, {2,9,3, 9,11,3},
    {2,7,9, 3,6,10}, {0,4,8, 2,7,9, 3,6,10}, {0,2,5, 2,7,5, 3,6,10}, {2,5,8, 2,7,5, 5,4,8, 3,6,10}, {1,3,4, 3,6,4, 2,7,9},
    {0,1,8, 1,6,8, 1,3,6, 2,7,9}, {0,2,5, 2,7,5, 1,3,4, 3,6,4}, {1,8,5, 1,6,8, 1,3,6, 8,2,5, 2,7,5}, {1,5,11, 2,7,9, 3,6,10},
    {0,4,8, 1,5,11, 2,7,9, 3,6,10}, {0,11,1, 0,7,11, 0,2,7, 3,6,10}, {1,4,11, 4,8,11, 8,2,11, 2,7,11, 3,6,10},
    {2,7,9, 3,4,11, 3,6,4, 4,5,11}, {0,5,8, 5,11,8, 11,3,8, 3,6,8, 2,7,9}, {0,11,4, 0,7,11, 0,2,7, 11,3,4, 3,6,4},
    {2,7,8, 7,11,8, 11,3,8, 3,6,8}, {3,8,10, 3,7,8, 7,9,8}, {0,4,9, 4,10,9, 10,3,9, 3,7,9}, {0,10,5, 0,8,10, 10,3,5, 3,7,5},
    {3,5,10, 3,7,5, 5,4,10}, {1,3,4, 3,8,4, 3,7,8, 7,9,8}, {0,1,9, 1,7,9, 1,3,7}, {0,7,5, 0,8,7, 8,3,7, 8,4,3, 4,1,3},
    {1,3,5, 3,7,5}, {1,5,11, 3,8,10, 3,7,8, 7,9,8}, {0,4,9, 4,10,9, 10,3,9, 3,7,9, 1,5,11},
    {0,11,1, 0,7,11, 0,8,7, 8,3,7, 8,10,3}, {1,4,11, 4,7,11, 4,10,7, 10,3,7}, {3,4,11, 3,8,4, 3,7,8, 7,9,8, 4,5,11},
    {0,3,9, 0,5,3, 5,11,3, 3,7,9}, {0,8,7, 8,4,3, 4,0,11, 3,7,8, 7,11,0, 11,3,4}, {3,7,11}, {3,11,7}, {0,4,8, 3,11,7},
    {0,9,5, 3,11,7}, {3,11,7, 4,8,5, 8,9,5}, {1,10,4, 3,11,7}, {0,1,8, 1,10,8, 3,11,7}, {0,9,5, 1,10,4, 3,11,7},
    {1,8,5, 1,10,8, 8,9,5, 3,11,7}, {1,5,3, 5,7,3}, {0,4,8, 1,5,3, 5,7,3}, {0,9,1, 9,7,1, 7,3,1},
    {1,4,3, 4,8,3, 8,7,3, 8,9,7}, {3,5,7, 3,10,5, 10,4,5}, {0,7,8, 0,5,7, 7,3,8, 3,10,8}, {0,9,4, 9,7,4, 7,3,4, 3,10,4},
    {3,8,7, 3,10,8, 8,9,7}, {2,8,6, 3,11,7}, {0,4,2, 4,6,2, 3,11,7}, {0,9,5, 2,8,6, 3,11,7}, {2,4,6, 2,9,4, 9,5,4, 3,11,7},
    {1,10,4, 2,8,6, 3,11,7}, {0,6,2, 0,10,6, 0,1,10, 3,11,7}, {0,9,5, 1,10,4, 2,8,6, 3,11,7},
    {1,10,5, 10,6,5, 6,2,5, 2,9,5, 3,11,7}, {1,5,3, 5,7,3, 2,8,6}, {0,4,2, 4,6,2, 1,5,3, 5,7,3}, {0,9,1, 9,7,1, 7,3,1, 2,8,6},
    {1,7,3, 1,9,7, 1,4,9, 4,2,9, 4,6,2}, {2,8,6, 3,5,7, 3,10,5, 10,4,5}, {0,6,2, 0,10,6, 0,5,10, 5,3,10, 5,7,3},
    {0,9,4, 9,7,4, 7,3,4, 3,10,4, 2,8,6}, {2,9,6, 9,10,6, 9,7,10, 7,3,10}, {2,3,9, 3,11,9}, {0,4,8, 2,3,9, 3,11,9},
    {0,2,5, 2,11,5, 2,3,11}, {2,3,8, 3,4,8, 3,11,4, 11,5,4}, {1,10,4, 2,3,9, 3,11,9}, {0,1,8, 1,10,8, 2,3,9, 3,11,9},
    {0,2,5, 2,11,5, 2,3,11, 1,10,4}, {1,8,5, 1,10,8, 8,2,5, 2,11,5, 2,3,11}, {1,5,3, 5,9,3, 9,2,3},
    {0,4,8, 1,5,3, 5,9,3, 9,2,3}, {0,2,1, 2,3,1}, {1,4,3, 4,8,3, 8,2,3}, {2,3,9, 3,5,9, 3,10,5, 10,4,5},
    {0,10,8, 0,5,10, 5,3,10, 5,9,3, 9,2,3}, {0,2,4, 2,10,4, 2,3,10}, {2,3,8, 3,10,8}, {3,9,6, 3,11,9, 9,8,6},
    {0,6,9, 0,4,6, 6,3,9, 3,11,9}, {0,8,5, 8,6,5, 6,3,5, 3,11,5}, {3,4,6, 3,11,4, 11,5,4}, {1,10,4, 3,9,6, 3,11,9, 9,8,6},
    {0,6,9, 0,10,6, 0,1,10, 6,3,9, 3,11,9}, {0,8,5, 8,6,5, 6,3,5, 3,11,5, 1,10,4}, {1,10,5, 10,6,5, 6,3,5, 3,11,5},
    {1,5,3, 5,9,3, 9,6,3, 9,8,6}, {0,6,9, 0,4,6, 6,3,9, 3,5,9, 3,1,5}, {0,8,1, 8,6,1, 6,3,1}, {1,4,3, 4,6,3},
    {3,9,6, 3,5,9, 3,10,5, 10,4,5, 9,8,6}, {0,5,10, 5,9,3, 9,0,6, 3,10,5, 10,6,0, 6,3,9}, {0,3,4, 0,8,3, 8,6,3, 3,10,4},
    {3,10,6}, {6,10,7, 10,11,7}, {0,4,8, 6,10,7, 10,11,7}, {0,9,5, 6,10,7, 10,11,7}, {4,8,5, 8,9,5, 6,10,7, 10,11,7},
    {1,6,4, 1,11,6, 11,7,6}, {0,1,8, 1,6,8, 1,11,6, 11,7,6}, {0,9,5, 1,6,4, 1,11,6, 11,7,6},
    {1,8,5, 1,6,8, 1,11,6, 11,7,6, 8,9,5}, {1,7,10, 1,5,7, 7,6,10}, {0,4,8, 1,7,10, 1,5,7, 7,6,10},
    {0,9,1, 9,7,1, 7,10,1, 7,6,10}, {1,7,10, 1,9,7, 1,4,9, 4,8,9, 7,6,10}, {4,5,6, 5,7,6}, {0,7,8, 0,5,7, 7,6,8},
    {0,6,4, 0,9,6, 9,7,6}, {6,8,7, 8,9,7}, {2,10,7, 2,8,10, 10,11,7}, {0,4,2, 4,10,2, 10,7,2, 10,11,7},
    {0,9,5, 2,10,7, 2,8,10, 10,11,7}, {2,10,7, 2,4,10, 2,9,4, 9,5,4, 10,11,7}, {1,11,4, 11,7,4, 7,2,4, 2,8,4},
    {0,7,2, 0,11,7, 0,1,11}, {0,9,5, 1,11,4, 11,7,4, 7,2,4, 2,8,4}, {1,2,5, 1,11,2, 11,7,2, 2,9,5},
    {1,7,10, 1,5,7, 7,2,10, 2,8,10}, {0,4,2, 4,10,2, 10,7,2, 10,1,7, 1,5,7}, {0,9,1, 9,7,1, 7,10,1, 7,2,10, 2,8,10},
    {1,4,9, 4,10,2, 10,1,7, 2,9,4, 9,7,1, 7,2,10}, {2,5,7, 2,8,5, 8,4,5}, {0,5,2, 5,7,2}, {0,9,4, 9,7,4, 7,2,4, 2,8,4},
    {2,9,7}, {2,11,9, 2,6,11, 6,10,11}, {0,4,8, 2,11,9, 2,6,11, 6,10,11}, {0,2,5, 2,11,5, 2,6,11, 6,10,11},
    {2,5,8, 2,11,5, 2,6,11, 6,10,11, 5,4,8}, {1,9,4, 1,11,9, 9,2,4, 2,6,4}, {0,1,8, 1,6,8, 1,11,6, 11,2,6, 11,9,2},
    {0,2,5, 2,11,5, 2,6,11, 6,1,11, 6,4,1}, {1,11,6, 11,5,2, 5,1,8, 2,6,11, 6,8,1, 8,2,5}, {1,5,10, 5,9,10, 9,2,10, 2,6,10},
    {0,4,8, 1,5,10, 5,9,10, 9,2,10, 2,6,10}, {0,10,1, 0,6,10, 0,2,6}, {1,2,10, 1,4,2, 4,8,2, 2,6,10}, {2,4,9, 2,6,4, 4,5,9},
    {0,5,8, 5,6,8, 5,9,6, 9,2,6}, {0,2,4, 2,6,4}, {2,6,8}, {8,10,9, 10,11,9}, {0,11,9, 0,4,11, 4,10,11},
    {0,10,5, 0,8,10, 10,11,5}, {4,10,5, 10,11,5}, {1,9,4, 1,11,9, 9,8,4}, {0,1,9, 1,11,9}, {0,8,5, 8,11,5, 8,4,11, 4,1,11},
    {1,11,5}, {1,8,10, 1,5,8, 5,9,8}, {0,4,9, 4,10,9, 10,1,9, 1,5,9}, {0,8,1, 8,10,1}, {1,4,10}, {4,5,8, 5,9,8}, {0,5,9},
    {0,8,4}, {0}
};

SPRINGLS__MATHS bool springls__mc_inside(float phi) { return phi < 0.0f; }

/* Returns the case of a cube: bit c is set when corner c is inside. */
SPRINGLS__MATHS int springls__mc_case(springls__mc_cell cell)
{
    int mask = 0, c;
    for (c = 0; c < 8; ++c) mask |= (int)springls__mc_inside(cell.phi[c]) << c;
    return mask;
}

SPRINGLS__MATHS int springls__mc_count(int mask) { return (int)springls__mc_triangle_count[mask]; }

/* Returns the edge that carries vertex 0, 1 or 2 of a triangle. */
SPRINGLS__MATHS int springls__mc_edge(int mask, int triangle, int vertex)
{
    return (int)springls__mc_triangles[mask][3 * triangle + vertex];
}

SPRINGLS__MATHS int springls__mc_edge_axis(int edge) { return edge >> 2; }

/* Returns the corner where an edge begins; it ends at this corner | 1 << axis. */
SPRINGLS__MATHS int springls__mc_edge_corner(int edge)
{
    int k = edge & 3;
    return edge < 4 ? k << 1 : edge < 8 ? (k & 1) | (k & 2) << 1 : k;
}

/* Returns where phi crosses zero on an edge: 0 at its lower corner a, 1 at its upper corner b; always in this order, so that all
   cubes around the edge get the same bits. Stays 1/1024 off the corners: a grid value of exactly zero would otherwise put
   several vertices on one point and make triangles of no area. NaN and infinite values give a place beside a corner. */
SPRINGLS__MATHS float springls__mc_crossing(float phi_a, float phi_b)
{
    return springls__clamp(phi_a / (phi_a - phi_b), 9.765625e-4f, 1.0f - 9.765625e-4f);
}

SPRINGLS__MATHS float springls__mc_edge_crossing(springls__mc_cell cell, int edge)
{
    int a = springls__mc_edge_corner(edge);
    return springls__mc_crossing(cell.phi[a], cell.phi[a | 1 << springls__mc_edge_axis(edge)]);
}

/* Returns the vertex at parameter t of an edge of the cube whose corner 0 is voxel (i, j, k), in voxel units. Adds the whole
   numbers first, so that all cubes around the edge get the same bits. */
SPRINGLS__MATHS springls__v3 springls__mc_point(int i, int j, int k, int edge, float t)
{
    int a = springls__mc_edge_corner(edge), axis = springls__mc_edge_axis(edge);
    return springls__v3_make((float)(i + (a & 1)) + (axis == 0 ? t : 0.0f), (float)(j + (a >> 1 & 1)) + (axis == 1 ? t : 0.0f),
                             (float)(k + (a >> 2 & 1)) + (axis == 2 ? t : 0.0f));
}

/* Marching cubes of an active brick: cells from -1 if the brick is at the lower border of the domain, so that the
   closing surface half a voxel outside is met too. */
typedef struct springls__cube_range { int lo[3], hi[3], origin[3]; } springls__cube_range;

SPRINGLS__MATHS springls__cube_range springls__brick_cubes(const springls__grid *g, int slot)
{
    springls__cube_range range;
    int axis;
    springls__slot_origin(g, slot, range.origin);
    for (axis = 0; axis < 3; axis++) {
        range.lo[axis] = range.origin[axis] == 0 ? -1 : 0;
        range.hi[axis] = springls__imin(7, g->size[axis] - 1 - range.origin[axis]);
    }
    return range;
}

SPRINGLS__INNER springls__mc_cell springls__tile_cube(SPRINGLS__LOCAL const float *tile, int x, int y, int z)
{
    springls__mc_cell cell;
    int c;
    for (c = 0; c < 8; c++) cell.phi[c] = tile[springls__tile_index(x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2))];
    return cell;
}

/* Returns the cube at any voxel (x, y, z) from the grid itself: slower, but without a tile. */
SPRINGLS__MATHS springls__mc_cell springls__grid_cube(const springls__grid *g, int x, int y, int z)
{
    springls__mc_cell cell;
    springls__grid_corners(g, g->phi, x, y, z, cell.phi);
    return cell;
}

SPRINGLS__INNER springls__v3 springls__cube_vertex(const springls__cube_range *range, springls__mc_cell cell, int x, int y, int z,
                                                   int edge)
{
    return springls__mc_point(range->origin[0] + x, range->origin[1] + y, range->origin[2] + z, edge,
                              springls__mc_edge_crossing(cell, edge));
}

SPRINGLS__MATHS springls__tri springls__cube_triangle(const springls__cube_range *range, springls__mc_cell cell, int mask, int x,
                                                      int y, int z, int triangle)
{
    springls__tri t;
    t.a = springls__cube_vertex(range, cell, x, y, z, springls__mc_edge(mask, triangle, 0));
    t.b = springls__cube_vertex(range, cell, x, y, z, springls__mc_edge(mask, triangle, 1));
    t.c = springls__cube_vertex(range, cell, x, y, z, springls__mc_edge(mask, triangle, 2));
    return t;
}

#endif
