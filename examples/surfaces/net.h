/* net.h - the walls between the labels of a map as one net, which all labels share.
 *
 * A cell is a cube whose corners are the centers of eight voxels. A cell whose corners have more than one label has a vertex, and a
 * pair of neighbours with different labels has a wall: the quadrilateral of the vertices of the four cells around it (surface nets,
 * Gibson 1998). So two labels that touch have the same triangles between them, wherever the vertices are: no gap, no overlap.
 *
 * The vertices are then moved to where the net is fair, each within its cell, so that a voxel's center stays on the side of its
 * label, and no label, however thin, is lost. A step is
 *
 *   x <- clamp(x - c L L x + m (x - x before)),     (L x)_i = x_i - mean of the neighbours of x_i
 *
 * of second order: a plane's steps, which are the voxels' and not the object's, are flattened, while round shapes do not shrink as they
 * would by x <- x - c L x. A vertex where three labels meet follows its neighbours on that line alone, and one where four meet stays
 * with those alone. All this is in voxels, since the steps are as high as a voxel along every axis. */
#ifndef EXAMPLES_SURFACES_NET_H
#define EXAMPLES_SURFACES_NET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { NET_NONE = -1 };

struct net {
    int dims[3];      /* cells along each axis, one more than voxels: cell (i,j,k) has voxels i-1, i and so on as corners */
    int32_t *vertex_of; /* a cell's vertex, or NET_NONE */
    size_t count;
    uint32_t *cells;  /* of a vertex, ascending */
    float *places;    /* 3 a vertex, in voxels of the map: (0,0,0) is the center of the first one */
    /* The labels of each vertex's corners, once each: first[v] to first[v + 1]. */
    size_t *first;
    uint32_t *labels;
};

/* Makes the net of a label map of dims[] voxels, x fastest; outside is label 0. Returns false if memory is short. */
bool net_create(const int dims[3], const uint32_t *map, struct net *net);
/* Makes it fair by so many steps. Returns false if memory is short. */
bool net_smooth(struct net *net, const int dims[3], const uint32_t *map, int steps);
void net_free(struct net *net);

/* Looks up the labels of a cell's corners: corner c lies at c & 1, c >> 1 & 1, c >> 2. */
void net_corners(const int dims[3], const uint32_t *map, const struct net *net, uint32_t cell, uint32_t corners[8]);

/* Surface of one label: closed, each triangle's front outside. */
struct label_surface {
    float *places;      /* 3 a vertex, in voxels */
    uint32_t *vertices; /* of the net, one a vertex */
    size_t vertex_count;
    uint32_t *triangles;
    size_t triangle_count;
};

/* Makes the surface of a label. vertices: those of the net with that label, ascending. A vertex of the net that joins two sheets becomes
 * two vertices at one place. */
bool net_label(const struct net *net, const int dims[3], const uint32_t *map, uint32_t label, const uint32_t *vertices, size_t count,
               struct label_surface *surface);
void label_surface_free(struct label_surface *surface);

#endif
