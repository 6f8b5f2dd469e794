/* params.h - the parameters, which hosts and kernels share. */
#ifndef SPRINGLS__KERNEL_INTERFACE_PARAMETERS_H
#define SPRINGLS__KERNEL_INTERFACE_PARAMETERS_H

typedef enum springls_threshold { SPRINGLS_THRESHOLD_LINEAR, SPRINGLS_THRESHOLD_TANH } springls_threshold;           /* paper, Fig. 8a */
typedef enum springls_weight { SPRINGLS_WEIGHT_LINEAR, SPRINGLS_WEIGHT_ATANH, SPRINGLS_WEIGHT_SPLINE_FAR,           /* paper, Fig. 8b: */
                               SPRINGLS_WEIGHT_SPLINE_NEAR } springls_weight;                             /* W_a W_b W_c W_d */
typedef enum springls_torque { SPRINGLS_TORQUE_NORMALIZED, SPRINGLS_TORQUE_PHYSICAL } springls_torque; /* eq. 20, 19   */
typedef enum springls_topology { SPRINGLS_TOPOLOGY_FREE, SPRINGLS_TOPOLOGY_PRESERVED } springls_topology; /* sec. 4.5  */

/* Where a split or filled springl gets its place and its correspondence. */
typedef enum springls_placement {
    SPRINGLS_PLACEMENT_COPY,     /* the paper: flat children, correspondences copied (split), averaged or nearest (fill)   */
    SPRINGLS_PLACEMENT_QUADRATIC /* a quadratic moving-least-squares fit over neighbouring particles, for both             */
} springls_placement;

/* All lengths are voxels. Get a set from springls_default_params() or springls_paper_params(), then change members;
   a zeroed structure is refused because zero is a meaningful value of many members. */
typedef struct springls_params {
    unsigned cookie;  /* set by the two functions, checked by springls_create */

    /* Table 1 */
    float d_max;             /* springl capsule radius                                                          */
    float particle_radius;   /* r: particle and vertex radius; springs rest at length 2r                        */
    float neighbor_radius;   /* R: neighbours of a vertex lie within it                                         */
    int max_neighbors;       /* nearest edges kept a vertex, 1..8 (section 4.8)                                 */

    /* relax: section 4.3, Algorithm 1 */
    int relax_iterations;
    springls_threshold threshold;
    springls_weight weight;
    springls_torque torque;
    float sharpness;         /* lambda_c of H(lambda_c x)                                                       */
    float kappa_int;         /* internal spring constant (eq. 4)                                                */
    float kappa_ext;         /* external spring constant (eq. 5)                                                */
    float relax_step_length;   /* xi  (eq. 10, 17)                                                              */
    float relax_step_rotation; /* rho (eq. 11, 18)                                                              */
    int relax_same_side;     /* 1: ignore neighbours facing the other way; 0: the paper                         */

    /* contract: section 4.6 */
    float contract_distance; /* remove when |phi(p)| exceeds it: (1 + eps) d_max                                */
    float min_angle, max_angle; /* degrees; triangles outside are bad                                           */
    float min_area;          /* voxel^2; smaller triangles are bad; 0: the paper                                */
    int reshape;             /* 1: give a bad triangle a good shape about its own particle; 0: remove it        */
    float merge_distance;    /* remove the younger of two same-side particles closer than it; 0: never          */
    int keep_thin;           /* 1: keep far springls of a sheet too thin for phi; 0: the paper, remove them     */

    /* resample: section 4.6 */
    int resample_period;     /* M of Algorithm 2                                                                */
    int resample_last;       /* 1: contract and resample when the level set has followed; 0: before (Algorithm 2) */
    float split_edge;        /* split at the longest edge when it is longer (section 4.6)                       */
    float split_area;        /* voxel^2; or when the area is larger (Table 2)                                   */
    springls_placement placement; /* of split and filled springls                                               */

    /* level set: sections 4.4, 4.5 */
    float band_half_width;   /* phi is a distance within it, clamped a voxel beyond                             */
    float capture;           /* omega is clamped here (eq. 21; the paper: d_max)                                */
    int evolve_iterations;   /* Evolve and Rebuild pairs a step (Algorithm 2: 4)                                */
    float evolve_step;       /* delta t of eq. 23                                                               */
    float evolve_width;      /* half-width of the compact delta of eq. 23                                       */
    float curvature;         /* lambda of eq. 22                                                                */
    int predict;             /* 1: springls carry phi along; eq. 23 may be left out (evolve_iterations 0)       */
    int project_level_set;   /* 1: springls say side and value of phi near them, to second order; 0: the paper  */
    int nucleate;            /* 1: a voxel between the two sides of a thin sheet is inside, where the level set is
                                projected; 0: phi alone says so                                                 */
    int fill_from_springls;  /* 1: fill holes among springls first, the zero level's far from them; 0: the paper */
    int keep_edges;          /* 1: sides of a sharp edge are not averaged; 0: the paper                         */
    springls_topology topology;

    /* track: section 4.7 */
    float nearest_rule;      /* take the nearest correspondence when it is further than this from the average   */
    int track_iterations;    /* projections on the original surface (eq. 26)                                    */
    float track_step;        /* lambda of eq. 26                                                                */

    /* advect: section 4.2 */
    int vertex_velocity;     /* 1: every vertex moves with its own velocity, but pressure and curvature push the
                                springl as a whole; 0: all with the particle's (eq. 2)                           */
    int half_time_sampling;  /* 1: RK4 samples time over half a step, as the author's program does              */

    /* after a step */
    int volume_lock;         /* 1: every component keeps its volume by an offset of its surface; 0: the paper   */

    /* initial springls from a level set or shape */
    int initial_stride;      /* marching cubes on every n-th voxel: 1, 2 or 4, which divide a brick             */
    int project_initial;     /* 1: move particles and vertices onto the zero level                              */
} springls_params;

#endif
