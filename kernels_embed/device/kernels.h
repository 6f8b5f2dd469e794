/* kernels.h - the table of kernels: what is done to all springls, all bricks or the like at once. A row X(name, ...) makes of
   springls__name_element, which does one element, a loop in C (src/runtime/launch.h), a kernel springls_name in OpenCL
   (entry_points.cl) and a row of the test that compares the two. */
#ifndef SPRINGLS__KERNEL_DEVICE_KERNELS_H
#define SPRINGLS__KERNEL_DEVICE_KERNELS_H

#include "../model/cell_list.h"
#include "../model/model.h"
#include "../model/neighbors.h"
#include "../stages/advect.h"
#include "../stages/contract.h"
#include "../stages/cover.h"
#include "../stages/evolve.h"
#include "../stages/fill_from_springls.h"
#include "../stages/fill_gaps.h"
#include "../stages/keep_edges.h"
#include "../stages/overlap.h"
#include "../stages/project_brick.h"
#include "../stages/rebuild.h"
#include "../stages/relax.h"
#include "../stages/resample.h"
#include "../stages/sleep.h"
#include "../stages/specks.h"
#include "../stages/topology.h"
#include "../stages/track.h"
#include "../stages/unsigned_distance.h"
#include "../stages/unsigned_to_signed.h"
#include "../stages/window.h"
#include "../stages/write.h"
#include "../output/isosurface.h"

/* Lists kernels: name, elements worth a task of their own, arrays that it writes. It may read all of the model. */
#define SPRINGLS__KERNELS(X)                                                                                                     \
    X(write, 512, SPRINGLS__BIT(S))                                                                                              \
    X(wake, 4096, SPRINGLS__BIT(CALM) | SPRINGLS__BIT(AWAKE) | SPRINGLS__BIT(NEAR_AWAKE))                                        \
    X(calm, 4096, SPRINGLS__BIT(CALM))                                                                                           \
    X(stir, 4096, SPRINGLS__BIT(CALM))                                                                                           \
    X(awake, 64, SPRINGLS__BIT(AWAKE))                                                                                           \
    X(near_awake, 64, SPRINGLS__BIT(NEAR_AWAKE))                                                                                 \
    X(asleep, 1024, SPRINGLS__BIT(ASLEEP))                                                                                       \
    X(cell_key, 1024, SPRINGLS__BIT(KEY))                                                                                        \
    X(neighbors, 64, SPRINGLS__BIT(NEIGHBORS))                                                                                   \
    X(shorten_arms, 512, SPRINGLS__ROLE_BIT(relaxed_springls))                                                                   \
    X(cover, 128, SPRINGLS__ROLE_BIT(relaxed_springls))                                                                          \
    X(orient, 256, SPRINGLS__BIT(S))                                                                                             \
    X(sample_phi, 512, SPRINGLS__BIT(PHI_AT))                                                                                    \
    X(contract, 256, SPRINGLS__ROLE_BIT(contract_action))                                                                        \
    X(reshape, 256, SPRINGLS__BIT(S))                                                                                            \
    X(merge_begin, 4096, SPRINGLS__ROLE_BIT(contract_action))                                                                    \
    X(merge, 256, SPRINGLS__ROLE_BIT(next_contract_action))                                                                      \
    X(overgrown, 512, SPRINGLS__ROLE_BIT(split_number))                                                                          \
    X(split, 64, SPRINGLS__ROLE_BIT(split_halves))                                                                               \
    X(split_store, 512, SPRINGLS__SET_BITS)                                                                                      \
    X(track, 256, SPRINGLS__BIT(A))                                                                                              \
    X(edge_normal, 512, SPRINGLS__ROLE_BIT(side_normal) | SPRINGLS__ROLE_BIT(was_at_edge))                                       \
    X(edge_cells, 64, SPRINGLS__ROLE_BIT(edge_cells))                                                                            \
    X(edge_candidate, 512, SPRINGLS__ROLE_BIT(edge_candidate))                                                                   \
    X(edge_side, 64, SPRINGLS__BIT(EDGE) | SPRINGLS__ROLE_BIT(side_normal))                                                      \
    X(edge_turn, 256, SPRINGLS__BIT(S))                                                                                          \
    X(seed, 64, SPRINGLS__ROLE_BIT(seeds) | SPRINGLS__ROLE_BIT(seed_action))                                                     \
    X(seed_choose, 512, SPRINGLS__ROLE_BIT(next_seed_action))                                                                    \
    X(seed_count, 4096, SPRINGLS__ROLE_BIT(seed_number))                                                                         \
    X(insert_seeds, 512, SPRINGLS__SET_BITS)                                                                                     \
    X(fill, 16, SPRINGLS__SET_BITS)                                                                                              \
    X(fit_new_springls, 16,                                                                                                      \
      SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | SPRINGLS__BIT(SYNCED_POSITION) | SPRINGLS__BIT(COMPONENT) | SPRINGLS__BIT(CAVITY)    \
          | SPRINGLS__BIT(CONTACT_BODY) | SPRINGLS__BIT(ERROR))                                                                  \
    X(omega_constant, 1024, SPRINGLS__BIT(OMEGA))                                                                                \
    X(omega_forget, 256, SPRINGLS__BIT(OMEGA) | SPRINGLS__ROLE_BIT(omega_missing))                                               \
    X(commit_simple_color, 8, SPRINGLS__BIT(PHI))                                                                                \
    X(revert_unsimple, 8, SPRINGLS__BIT(PHI_NEXT))                                                                               \
    X(band, 32, SPRINGLS__ROLE_BIT(band_mask))                                                                                   \
    X(overlap, 64, SPRINGLS__BIT(OVERLAPPED))                                                                                    \
    X(oriented, 256, SPRINGLS__ROLE_BIT(oriented_springls))                                                                      \
    X(grow_line, 64, SPRINGLS__ROLE_BIT(has_grown) | SPRINGLS__ROLE_BIT(brick_state))                                            \
    X(mark_phi_synced, 1024, SPRINGLS__BIT(SYNCED_POSITION))                                                                     \
    X(displacement, 1024, SPRINGLS__ROLE_BIT(synced_distance2))                                                                  \
    X(extent, 1024, SPRINGLS__ROLE_BIT(extent))                                                                                  \
    X(departed, 1024, SPRINGLS__ROLE_BIT(has_departed))                                                                          \
    X(attach_vertex_data, 256, SPRINGLS__ROLE_BIT(vertex_gradient) | SPRINGLS__ROLE_BIT(vertex_correspondence)                   \
                                   | SPRINGLS__ROLE_BIT(vertex_springl))

/* Lists kernels whose elements are bricks, which the items of a work group share on a device; last: floats they share. */
#define SPRINGLS__BRICK_KERNELS(X)                                                                                               \
    X(exposure, 4, SPRINGLS__ROLE_BIT(exposed) | SPRINGLS__ROLE_BIT(exposed_count), SPRINGLS__TILE_VOXELS)                       \
    X(omega, 4, SPRINGLS__BIT(OMEGA), 1)                                                                                         \
    X(evolve, 4, SPRINGLS__BIT(PHI_NEXT), 2 * SPRINGLS__TILE_VOXELS)                                                             \
    X(subvoxel, 8, SPRINGLS__BIT(PHI_NEXT), SPRINGLS__TILE_VOXELS)                                                               \
    X(redistance, 8, SPRINGLS__BIT(PHI_NEXT), SPRINGLS__TILE_VOXELS)                                                             \
    X(project, 4, SPRINGLS__BIT(PHI_NEXT) | SPRINGLS__ROLE_BIT(has_unknown_side) | SPRINGLS__ROLE_BIT(has_opposed),              \
      SPRINGLS__SUMS_FLOATS + SPRINGLS__WIDE_VOXELS)                                                                             \
    X(resolve_sides, 8, SPRINGLS__BIT(OMEGA), SPRINGLS__TILE_VOXELS)                                                             \
    X(find_joint_candidates, 8, SPRINGLS__ROLE_BIT(has_joint_candidates), SPRINGLS__TILE_VOXELS)                                 \
    X(join_parts, 8, SPRINGLS__BIT(PHI_NEXT), SPRINGLS__TILE_VOXELS)                                                             \
    X(specks, 8, SPRINGLS__BIT(PHI_NEXT), SPRINGLS__TILE_VOXELS)                                                                 \
    X(brick_state, 64, SPRINGLS__ROLE_BIT(brick_state), SPRINGLS__ROWS)                                                          \
    X(brick_side, 64, SPRINGLS__BIT(TOP) | SPRINGLS__BIT(PHI), 1)                                                                \
    X(grow, 8, SPRINGLS__BIT(PHI_NEXT) | SPRINGLS__ROLE_BIT(has_grown), SPRINGLS__ROWS)                                          \
    X(sides, 4, SPRINGLS__BIT(PHI), SPRINGLS__BRICK_VOXELS)                                                                      \
    X(with_sign, 64, SPRINGLS__BIT(PHI), 1)                                                                                      \
    X(surface_count, 8,                                                                                                          \
      SPRINGLS__ROLE_BIT(cubes) | SPRINGLS__ROLE_BIT(triangles_before) | SPRINGLS__ROLE_BIT(vertices_before)                     \
          | SPRINGLS__ROLE_BIT(surface_rank) | SPRINGLS__ROLE_BIT(row_triangles),                                                \
      SPRINGLS__SURFACE_FLOATS)                                                                                                  \
    X(surface, 8, SPRINGLS__ROLE_BIT(surface_positions) | SPRINGLS__ROLE_BIT(surface_corners), SPRINGLS__TILE_VOXELS)

/* Lists kernels that have springls__name_elements besides, for several elements at once, which C calls. */
#define SPRINGLS__SIMD_KERNELS(X)                                                                                                \
    X(displace, 128,                                                                                                             \
      SPRINGLS__ROLE_BIT(moved_springls) | SPRINGLS__ROLE_BIT(displacement2) | SPRINGLS__ROLE_BIT(turning2)                      \
          | SPRINGLS__ROLE_BIT(moved_error) | SPRINGLS__ROLE_BIT(motion_class))                                                  \
    X(relax, 128, SPRINGLS__ROLE_BIT(relaxed_springls))

/* Lists kernels that only a device has, where work items do together what one loop does in C (collectives.cl, regions.cl): name,
   elements that a core of a processor takes at once. */
#define SPRINGLS__COLLECTIVES(X)                                                                                                 \
    X(scan_chunk, 1) X(scan_sums, 1) X(scan_apply, 1)                                                                            \
    X(count_chunk, 1) X(largest_chunk, 1) X(largest_sums, 1)                                                                     \
    X(counts_clear, 16)                                                                                                          \
    X(cells_clear, 64) X(cells_count, 512) X(cells_prefix, 64) X(cells_base, 64) X(cells_scatter, 512) X(cells_sort, 64)         \
    X(unbinned_flag, 4096) X(unbinned_scatter, 4096)                                                                                   \
    X(bricks_begin, 4096) X(bricks_count, 1) X(bricks_sums, 1) X(bricks_drop, 1) X(bricks_add, 1) X(bricks_fill, 16)             \
    X(mark_outside, 1024) X(mark_cover, 64) X(mark_band, 64) X(mark_near, 512)                                                   \
    X(brick_lists_rank, 1024) X(brick_lists_clear, 1024) X(brick_lists_count, 128) X(brick_lists_scatter, 128)                   \
    X(brick_lists_sort, 8)                                                                                                       \
    X(compact_flag, 4096) X(compact_out, 256) X(compact_in, 256)                                                                 \
    X(region_begin, 64) X(region_join, 64) X(region_vote, 64) X(region_resolve, 64)

#endif
