/* scratch.h - what stages keep in working memory: X(role, element type, number of the scratch array). A role has an accessor,
   springls__role(model); its array is SPRINGLS__ROLE_ARRAY(role). Roles with one number share memory: only one of them is in
   use at a time. Numbers 0 and 7 have what several stages build while roles of their own are in use. */
#ifndef SPRINGLS__KERNEL_MODEL_SCRATCH_H
#define SPRINGLS__KERNEL_MODEL_SCRATCH_H

/* Lists the roles that kernels use. */
#define SPRINGLS__KERNEL_ROLES(X)                                                                                                \
    /* built by several stages */                                                                                                \
    X(brick_rank, uint32_t, 0)                  /* of a slot: its place among the active ones                                 */ \
    X(synced_distance2, float, 7)               /* of a particle: squared distance to synced_position                         */ \
    X(cell_count, uint32_t, 0)                  /* of an active brick: springls in its cells; scanned: before it              */ \
    X(unbinned_number, uint32_t, 0)             /* 1 for a springl in no cell; scanned: its number                            */ \
    X(stay_number, uint32_t, 0)                 /* on a device: 1 for a springl that stays; scanned: its new place            */ \
    /* advect */                                                                                                                 \
    X(moved_springls, springls__springl, 0)     /* springls after a motion; trades places with S                              */ \
    X(displacement2, float, 1)                  /* of the particle, squared; FLT_MAX: not finite                              */ \
    X(turning2, float, 2)                       /* of a springl: see springls__turned2                                        */ \
    X(moved_error, float, 4)                    /* ERROR after a motion; trades places with it                                */ \
    X(motion_class, uint8_t, 3)                 /* how far a springl moves: SPRINGLS__MOTION_...                              */ \
    /* window */                                                                                                                 \
    X(extent, float, 7)                         /* of a particle: see springls__extent_element                                 */ \
    X(has_departed, uint8_t, 2)                 /* 1: is removed because it has left the window                               */ \
    /* relax */                                                                                                                  \
    X(relaxed_springls, springls__springl, 1)   /* springls after an iteration; trades places with S                          */ \
    /* contract, compaction, inheritance of attributes */                                                                        \
    X(contract_action, uint8_t, 1)              /* KEEP, REMOVE, RESHAPE or UNDECIDED                                         */ \
    X(next_contract_action, uint8_t, 2)         /* after a round of merging; trades places with it                            */ \
    /* resample */                                                                                                               \
    X(split_number, uint32_t, 1)                /* 1 for a springl to split; scanned: the number of its second half           */ \
    X(split_halves, struct springls__half, 2)   /* two for each springl that is split                                         */ \
    /* keep_edges */                                                                                                             \
    X(side_normal, springls__v3, 4)             /* of a springl; at an edge, of the side it is on                             */ \
    X(edge_candidate, uint8_t, 6)               /* 1: may lie at an edge                                                      */ \
    X(was_at_edge, uint8_t, 7)                  /* EDGE before the stage                                                      */ \
    X(edge_cells, uint32_t, 5)                  /* two of a slot: bits of the cells with springls that were at an edge        */ \
    /* fill_gaps: from springls */                                                                                               \
    X(seeds, struct springls__seed, 1)          /* the springl wanted beside one                                              */ \
    X(seed_action, uint8_t, 2)                  /* KEEP, REMOVE or UNDECIDED                                                  */ \
    X(next_seed_action, uint8_t, 3)             /* after a round of choosing; trades places with it                           */ \
    X(seed_number, uint32_t, 4)                 /* 1 for a seed that is kept; scanned: its number                             */ \
    /* fill_gaps: from the zero level */                                                                                         \
    X(exposed, uint8_t, 1)                      /* CUBES an active brick: bit k for the k-th triangle of a cube               */ \
    X(exposed_count, uint32_t, 2)               /* of an active brick; scanned: before it                                     */ \
    /* omega */                                                                                                                  \
    X(omega_missing, uint8_t, 1)                /* of an active brick: 1 where omega is unknown                               */ \
    /* project */                                                                                                                \
    X(oriented_springls, struct springls__oriented, 0) /* in the order of the cells, then the large ones                      */ \
    X(has_unknown_side, uint8_t, 1)             /* of an active brick: 1 where the side of some voxels is unknown             */ \
    X(has_opposed, uint8_t, 2)                  /* of an active brick: 1 where springls face against each other, 2 asleep     */ \
    X(has_joint_candidates, uint8_t, 1)         /* of an active brick: 1 where voxels may join others                         */ \
    /* rebuild */                                                                                                                \
    X(band_mask, uint32_t, 0)                   /* of an active brick: the bricks around it that the band reaches             */ \
    /* unsigned_to_signed */                                                                                                     \
    X(brick_state, uint8_t, 2)                  /* of an entry of the top table: OPEN, BLOCKED or BACKGROUND                  */ \
    X(has_grown, uint8_t, 1)                    /* of an active brick, or a line of bricks                                    */ \
    X(region_label, int, 1)                     /* of a voxel, then of entries of the top table: see regions.h               */ \
    /* the isosurface */                                                                                                         \
    X(cubes, uint32_t, 1)                       /* CUBES an active brick: springls__cube                                      */ \
    X(triangles_before, uint32_t, 2)            /* of an active brick: its triangles; scanned: those before it                */ \
    X(vertices_before, uint32_t, 3)             /* the same of vertices                                                       */ \
    X(surface_rank, int, 4)                     /* of a slot: its place among the active ones                                 */ \
    X(row_triangles, uint32_t, 7)               /* CUBE_ROWS an active brick: triangles before each row of cubes              */ \
    X(surface_positions, springls__v3, 5)       /* of vertices, voxels                                                        */ \
    X(surface_corners, int, 6)                  /* three vertices a triangle                                                  */ \
    X(vertex_gradient, springls__v3, 1)         /* of phi                                                                     */ \
    X(vertex_correspondence, springls__v3, 2)                                                                                    \
    X(vertex_springl, int, 3)                   /* the nearest one; -1: none                                                  */

/* Lists the roles that only host code uses. */
#define SPRINGLS__HOST_ROLES(X)                                                                                                  \
    X(lane_memory, float, 6)                    /* of the lanes of advect, project and contouring (launch.h)                     */ \
    X(region_springls, int, 5)                  /* springls in the region of the forces                                       */ \
    /* input, combine: bricks to add */                                                                                          \
    X(brick_wanted, uint8_t, 1)                 /* of an entry of the top table; of a brick of dense voxels                   */ \
    X(brick_list, int, 2)                       /* the bricks wanted                                                          */ \
    X(brick_reach, uint32_t, 3)                 /* of a brick wanted: mask of those around it that its band meets             */ \
    X(brick_centers, float, 1)                  /* the distance at the center of a brick                                      */ \
    X(initial_before, int, 1)                   /* initial springls of an active brick; summed up: of those before it         */ \
    /* components, events, volume_lock */                                                                                        \
    X(brick_nodes, int32_t, 3) X(node_sums_list, struct springls__node_sums, 4)                                                  \
    X(current_components, struct springls__current_component, 1)                                                                 \
    X(springl_components, struct springls__bounded_components, 2)                                                                \
    X(component_votes, uint64_t, 3) X(vote_counts, int64_t, 4) X(component_links, struct springls__component_link, 5)            \
    X(largest_links, struct springls__largest_link, 3) X(component_order, uint64_t, 3)                                           \
    X(seam_springls, struct springls__seam_springl, 3) X(seam_keys, uint64_t, 4)                                                 \
    X(body_labels, int32_t, 7) X(lock_parent, int32_t, 4) X(body_votes, struct springls__body_vote, 4)                           \
    /* output */                                                                                                                 \
    X(mesh_half_edges, uint64_t, 3) X(mesh_parent, int32_t, 4)                                                                   \
    X(brick_signatures, struct springls__brick_signature, 1) /* of a slot, or of a brick of a contour                         */

#endif
