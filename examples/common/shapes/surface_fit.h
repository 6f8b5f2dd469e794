/* surface_fit.h - laying one surface on another: nearest places, rigid alignment with scale, smooth deformation.
 *
 * A `target` is a triangle mesh with a search for nearest places. A `pose` maps the template's coordinates to the target's;
 * places and distances are returned in the template's coordinates. */
#ifndef EXAMPLES_SHAPES_SURFACE_FIT_H
#define EXAMPLES_SHAPES_SURFACE_FIT_H

#include "base/bvh.h"
#include "shapes/shapes.h"

struct target {
    const float *positions; /* borrowed */
    const int *triangles;
    size_t vertex_count, triangle_count;
    float *normals;         /* 3 a vertex, weighted by area */
    unsigned char *rim;     /* 1 a triangle: bit k is set if no other triangle has the edge from corner k to the next one */
    bool open;              /* at least one edge belongs to one triangle only */
    struct bvh bvh;
    double center[3], radius; /* of the surface: area-weighted center, root mean square distance from it */
};

struct target_hit {
    float place[3], normal[3];
    float signed_distance; /* negative inside */
    uint32_t vertex;       /* of the target, the nearest corner of the triangle */
    bool on_rim;           /* the nearest place is on the edge of an open surface, beyond which nothing is known */
};

/* Builds a target. Returns false if memory is short or no triangle has an area. */
bool target_create(const float *positions, size_t vertex_count, const int *triangles, size_t triangle_count,
                   struct target *target);
void target_free(struct target *target);
void target_nearest(const struct target *target, const struct similarity *pose, const float point[3], struct target_hit *hit);

/* Computes unit vertex normals, weighted by area. */
void mesh_normals(const float *positions, size_t vertex_count, const int *triangles, size_t triangle_count, float *normals);

/* Computes the barycentric weights of a place in the plane of a triangle. */
void mesh_barycentric(const float *a, const float *b, const float *c, const float *place, float weight[3]);

/* Chooses up to `wanted` of the points evenly, each the farthest from those before. Returns how many. */
int points_spread(const float *points, int count, int wanted, int *chosen);

/* What a warp expects, in sizes of the template (root mean square distance of its surface from its center).
 *   length, deviation  of two Gaussian kernels: two scales make long and short displacements probable
 *   stretch deviation of each element of a linear displacement's matrix beside the kernels (by itself, not in sizes): corrects
 *           the pose, so that the kernels need only explain the shape
 *   noise   deviation of a center from its place on the target, along the normal
 *   slide   the same from its present place along the surface: limits how far a step slides, and does not matter any more as
 *           the steps become small
 *   learns  each fit makes the noise one under which what it saw is more probable */
struct warp_prior {
    double length[2], deviation[2], stretch, noise, slide;
    bool learns;
};

/* For targets whose surface voxels have made rough, and for exact ones, such as closed meshes. Exact ones show by their shape where
 * along the surface a place went, and only with a small noise is this used. */
extern const struct warp_prior warp_prior_rough, warp_prior_exact;

/* A smooth displacement u(x) = sum over centers c of kernel(x, c) weight: two Gaussian kernels and a linear one. As a Gaussian
 * process (Luethi et al. 2018) it expects displacements of a certain size that are similar at near places. */
struct warp {
    int count, pinned; /* the last `pinned` centres are landmarks */
    float *centers;    /* 3 each, template coordinates */
    double *weights;   /* 3 each */
    double *kernels;   /* between all pairs of centers */
    double size, middle[3]; /* of the template: shape_size, and mean of its centers */
    struct warp_prior prior;
};

/* Makes a zero displacement. landmarks (3 floats each) become the last centers. */
bool warp_create(const float *centers, int count, const float *landmarks, int landmark_count, double size,
                 const struct warp_prior *prior, struct warp *warp);
void warp_free(struct warp *warp);
bool warp_copy(const struct warp *from, struct warp *to); /* copies the weights, for the same centers */

/* Computes x + u(x) and its row-major derivative (or NULL). */
void warp_apply(const struct warp *warp, const float point[3], float place[3], float derivative[9]);

/* Fits one step: with the centers now at `now` (3 each, without landmarks), finds the most probable displacement that brings
 * each near its nearest place on the target along the target's normal; motion along the surface is determined by smoothness,
 * and by landmarks, whose places on the target (in its coordinates) are given. Ignores nearest places on a rim and those that
 * face away from `normals`. Returns false if LAPACK fails or memory is short. */
bool warp_fit(struct warp *warp, const struct target *target, const struct similarity *pose, const float *now,
              const float *normals, const float *landmarks);

/* Returns the cost of a fit: how improbable the displacement is, and the remaining distances. */
double warp_cost(const struct warp *warp, const struct target *target, const struct similarity *pose);

/* The template as it is laid on targets: points of its surface with normals, and landmarks. */
struct fit_source {
    const float *points, *normals, *landmarks;
    int count, landmark_count;
    double size; /* of the template: shape_size */
    const struct warp_prior *prior;
};

enum orientation {
    ORIENTATION_KNOWN,  /* the axes of both have the same meaning */
    ORIENTATION_SEARCH, /* unknown: rotations are tried, and the one with the lowest cost of its warp is chosen */
    ORIENTATION_MARKED  /* by landmarks: three or more that are not collinear */
};

/* Returns the i-th of a sequence of rotations that is evenly spread for every length. */
void rotation_number(int i, double rotation[3][3]);

/* Finds the pose of the template on the target. landmarks: on the target, as many as the source has. */
bool surface_register(const struct target *target, const struct fit_source *source, enum orientation orientation,
                      const float *landmarks, struct similarity *pose, double *cost);

#endif
