/* surface_fit.h - laying one surface on another: nearest places, rigid alignment with scale, smooth deformation.
 *
 * A `target` is a triangle mesh that answers where its nearest place is. A `pose` takes the template's coordinates to the
 * target's; places and distances are told in the template's coordinates. */
#ifndef EXAMPLES_SHAPES_SURFACE_FIT_H
#define EXAMPLES_SHAPES_SURFACE_FIT_H

#include "base/bvh.h"
#include "shapes/shapes.h"

struct target {
    const float *positions; /* borrowed */
    const int *triangles;
    size_t vertex_count, triangle_count;
    float *normals;         /* 3 a vertex, weighted by area */
    unsigned char *rim;     /* 1 a triangle: bit k, no other triangle has the edge from corner k to the next one */
    bool open;              /* some edge belongs to one triangle only */
    struct bvh bvh;
    double center[3], radius; /* of the surface: area-weighted middle, root mean square distance from it */
};

struct target_hit {
    float place[3], normal[3];
    float signed_distance; /* negative inside */
    uint32_t vertex;       /* of the target, the nearest of the triangle's corners */
    bool on_rim;           /* the nearest place lies on the edge of an open surface: what is there is unknown */
};

/* False: memory is short, or no triangle has an area. */
bool target_create(const float *positions, size_t vertex_count, const int *triangles, size_t triangle_count,
                   struct target *target);
void target_free(struct target *target);
void target_nearest(const struct target *target, const struct similarity *pose, const float point[3], struct target_hit *hit);

/* Vertex normals of length 1, weighted by area. */
void mesh_normals(const float *positions, size_t vertex_count, const int *triangles, size_t triangle_count, float *normals);

/* Of a place in the plane of a triangle: weights of its corners. */
void mesh_barycentric(const float *a, const float *b, const float *c, const float *place, float weight[3]);

/* `wanted` of the points, spread evenly: each the furthest from those before. Returns how many. */
int points_spread(const float *points, int count, int wanted, int *chosen);

/* Smooth displacements: u(x) = sum over centres of kernel(|x - c|) weight, of two Gaussian kernels (surface_fit.c). As a
 * Gaussian process (Luethi et al. 2018) it says beforehand: displacements of some size, alike where they are near. */
struct warp {
    int count, pinned; /* the last `pinned` centres are landmarks */
    float *centers;    /* 3 each, template coordinates */
    double *weights; /* 3 each */
    double size;     /* of the template: shape_size */
};

/* No displacement yet. landmarks (3 floats each) become the last centres. */
bool warp_create(const float *centers, int count, const float *landmarks, int landmark_count, double size, struct warp *warp);
void warp_free(struct warp *warp);
bool warp_copy(const struct warp *from, struct warp *to); /* weights only: same centres */

/* x + u(x), and its derivative (NULL: not wanted), row-major. */
void warp_apply(const struct warp *warp, const float point[3], float place[3], float derivative[9]);

/* One step of the fit: with the centres now at `now` (3 each, landmarks not among them), the most probable displacement
 * that brings each near its nearest place on the target, along the target's normal only: where it slides along the surface
 * is left to smoothness, and to landmarks, which have their places on the target (its coordinates) given.
 * Nearest places on a rim, and those that face away from `normals`, say nothing. False: LAPACK refuses, or memory. */
bool warp_fit(struct warp *warp, const struct target *target, const struct similarity *pose, const float *now,
              const float *normals, const float *landmarks);

/* What a centre is wanted to do: its displacement from the template, and the covariance of that. */
struct warp_constraint {
    double displacement[3], covariance[3][3];
};

/* A wish that counts along `normal` with deviation `sigma`, and little across it. */
struct warp_constraint warp_constraint_along(const double displacement[3], const float normal[3], double sigma);

/* The most probable displacement after one wish a centre. False: LAPACK refuses, or memory. */
bool warp_solve(struct warp *warp, const struct warp_constraint *constraints);

/* How improbable the displacement is, and what is left of the distances: the smaller the better. */
double warp_cost(const struct warp *warp, const struct target *target, const struct similarity *pose);

/* What is to be laid on targets: points of a template's surface with their normals, and landmarks. */
struct fit_source {
    const float *points, *normals, *landmarks;
    int count, landmark_count;
    double size; /* of the template: shape_size */
};

enum orientation {
    ORIENTATION_KNOWN,  /* the axes of both mean the same */
    ORIENTATION_SEARCH, /* nothing is known: all are tried, the best taken by the cost of the warps that they need */
    ORIENTATION_MARKED  /* by landmarks: three or more, not in a line */
};

/* The i-th of many rotations that are spread evenly, whatever their number. */
void rotation_number(int i, double rotation[3][3]);

/* The pose of the template on the target. landmarks: on the target, as many as the cast has. */
bool surface_register(const struct target *target, const struct fit_source *source, enum orientation orientation,
                      const float *landmarks, struct similarity *pose, double *cost);

#endif
