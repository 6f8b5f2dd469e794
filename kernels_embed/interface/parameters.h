/* parameters.h - declares the parameters of the model, which host code and kernels read alike. */
#ifndef SPRINGLS__KERNEL_INTERFACE_PARAMETERS_H
#define SPRINGLS__KERNEL_INTERFACE_PARAMETERS_H

/* Names the function H of Fig. 8a, which limits the force on a vertex (eq. 13): H(x) = x or H(x) = tanh(x). */
typedef enum springls_threshold { SPRINGLS_THRESHOLD_LINEAR, SPRINGLS_THRESHOLD_TANH } springls_threshold;

/* Names the function W of Fig. 8b, which turns a neighbour's distance into a force (eq. 12): W_a, W_b, W_c, W_d in this order. */
typedef enum springls_weight {
    SPRINGLS_WEIGHT_LINEAR,
    SPRINGLS_WEIGHT_ATANH,
    SPRINGLS_WEIGHT_SPLINE_FAR,
    SPRINGLS_WEIGHT_SPLINE_NEAR
} springls_weight;

/* Names the formula of the torque on a springl: eq. 20 or eq. 19. */
typedef enum springls_torque { SPRINGLS_TORQUE_NORMALIZED, SPRINGLS_TORQUE_PHYSICAL } springls_torque;

/* Names what the level set may do: change its topology, or keep it (section 4.5). */
typedef enum springls_topology { SPRINGLS_TOPOLOGY_FREE, SPRINGLS_TOPOLOGY_PRESERVED } springls_topology;

/* Names what bodies that touch do: become one, as level sets do, or stay two (manual, CONTACT). */
typedef enum springls_contact { SPRINGLS_CONTACT_MERGE, SPRINGLS_CONTACT_SEPARATE } springls_contact;

/* Names what the watertight surface is made of: the zero level of phi, or springls (manual, CONTOURING). */
typedef enum springls_contouring { SPRINGLS_CONTOURING_LEVEL_SET, SPRINGLS_CONTOURING_SPRINGLS } springls_contouring;

/* Names the rule that gives a split or filled springl its place and its correspondence. */
typedef enum springls_placement {
    SPRINGLS_PLACEMENT_COPY,     /* the paper: flat halves; the correspondence is copied (split), averaged or nearest (fill) */
    SPRINGLS_PLACEMENT_QUADRATIC /* both come from a quadratic moving-least-squares fit to the neighbouring particles        */
} springls_placement;

/* Holds the parameters of a model; lengths are in voxels, areas in voxel^2. Get a set from springls_default_params() or
   springls_paper_params() and change members: a zeroed structure is refused, because 0 is a legal value of many members.
   The manual's chapter PARAMETERS lists both sets and the symbols of the paper; a member out of range is refused by name. */
typedef struct springls_params {
    unsigned cookie;  /* set by the two functions, checked by springls_create and springls_set_params            */

    /* Table 1 */
    float d_max;             /* radius of a springl's capsule: what is nearer to the springl is covered by it        */
    float particle_radius;   /* r: springs rest at the length 2r                                                   */
    float neighbor_radius;   /* R: neighbours of a vertex lie within it                                            */
    int max_neighbors;       /* nearest edges that a vertex keeps, 1..8 (section 4.8)                              */

    /* relax: section 4.3, Algorithm 1 */
    int relax_iterations;    /* 0: relax does nothing                                                              */
    springls_threshold threshold;
    springls_weight weight;
    springls_torque torque;
    float sharpness;         /* lambda_c of H(lambda_c x)                                                          */
    float kappa_int;         /* internal spring constant (eq. 4); no effect with cover                             */
    float kappa_ext;         /* external spring constant (eq. 5)                                                   */
    float relax_step_length;   /* xi  (eq. 10, 17)                                                                 */
    float relax_step_rotation; /* rho (eq. 11, 18)                                                                 */
    int cover;               /* 1: triangles cover the surface (manual, COVERAGE); 0: springs decide, as in the paper */
    int relax_same_side;     /* 1: neighbours that face the opposite way do not pull; 0: all pull, as in the paper */

    /* contract: section 4.6 */
    float contract_distance; /* (1 + eps) d_max: a springl is removed where |phi(p)| exceeds it                    */
    float min_angle, max_angle; /* degrees: a triangle with an angle outside is bad                                */
    float min_area;          /* voxel^2: a smaller triangle is bad; 0: no limit, as in the paper                   */
    int reshape;             /* 1: a bad triangle becomes equilateral about its particle; 0: it is removed         */
    float merge_distance;    /* of two particles of one side that are nearer, the younger is removed; 0: never     */
    int keep_thin;           /* 1: springls of a sheet too thin for phi stay; 0: they are removed, as in the paper */

    /* resample: section 4.6 */
    int resample_period;     /* M of Algorithm 2: steps from one resampling to the next                            */
    int resample_last;       /* 1: contract and resample after the level set has followed; 0: before (Algorithm 2) */
    float split_edge;        /* a triangle is split when its longest edge is longer (section 4.6)                  */
    float split_area;        /* voxel^2: or when its area is larger (Table 2)                                      */
    springls_placement placement; /* of split and filled springls                                                  */

    /* level set: sections 4.4, 4.5 */
    float band_half_width;   /* phi is a distance within it, and clamped one voxel beyond                          */
    float capture_range;     /* the unsigned distance omega is clamped here (eq. 21; the paper: d_max)             */
    int evolve_iterations;   /* pairs of evolve and rebuild in a step (Algorithm 2: 4)                             */
    float evolve_step;       /* delta t of eq. 23                                                                  */
    float evolve_width;      /* half-width of the compact delta of eq. 23                                          */
    float curvature;         /* voxel; lambda of eq. 22: positive smooths (manual, CURVATURE)                      */
    int carry_level_set;     /* 1: springls carry phi along, so that evolve_iterations may be 0; 0: the paper      */
    float lazy_distance;     /* voxels that springls may move before phi follows; until then a step only advects (manual, LAZY
                                STEPS); 0: phi follows in every step, as in the paper                              */
    int project_level_set;   /* 1: phi near springls is their oriented distance, to second order; 0: the paper     */
    int nucleate;            /* 1: project makes a voxel between the two sides of a thin sheet inside; 0: it does not */
    int fill_from_springls;  /* 1: fill_gaps first fills holes among springls, then the zero level; 0: the paper   */
    int keep_edges;          /* 1: the sides of a sharp edge are not averaged; 0: the paper                        */
    float min_component;     /* 0..16 voxel^3: smaller bodies and bubbles of phi are joined or removed; 0: all stay */
    springls_topology topology;
    springls_contact contact; /* MERGE: bodies that touch become one, as in the paper; SEPARATE: they stay two      */

    /* track: section 4.7 */
    float nearest_rule;      /* a filled springl takes the nearest correspondence, not the average, when the two are
                                further apart than this                                                            */
    int track_iterations;    /* steps of eq. 26 towards the original surface                                       */
    float track_step;        /* lambda of eq. 26                                                                   */

    /* advect: section 4.2 */
    int vertex_velocity;     /* 1: every vertex moves with the velocity at its own place, while pressure and curvature
                                move the springl as a whole; 0: all move with the particle's (eq. 2)               */
    int half_time_sampling;  /* 1: RK4 samples time over half a step, as the author's program does                 */

    /* after a step */
    int volume_lock;         /* 1: every component keeps its volume (manual, VOLUME LOCK); 0: the paper            */
    int components;          /* 1: components have ids that last, and events (manual, EVENTS); 0: the paper        */

    /* output */
    springls_contouring contouring; /* LEVEL_SET: the mesh is the zero level; SPRINGLS: it is what springls show   */

    /* initial springls: of a mesh; of a level set or shape */
    int split_input;         /* 1: springls_set_mesh divides triangles with an edge longer than split_edge, or than that of
                                an equilateral triangle of split_area, and thins out those far below a voxel;
                                0: each triangle becomes one springl                                               */
    int initial_stride;      /* marching cubes on every n-th voxel: 1, 2 or 4                                      */
    int project_initial;     /* 1: particles and vertices are moved onto the zero level                            */
} springls_params;

#endif
