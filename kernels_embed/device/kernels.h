/* kernels.h - the table of kernels: what is done to all springls, all bricks or the like at once. A row X(name, ...) makes of
   springls__name_element, which does one element, a loop in C (src/runtime/launch.h), a kernel springls_name in OpenCL
   (entry_points.cl) and a row of the test that compares the two. */
#ifndef SPRINGLS__KERNEL_DEVICE_KERNELS_H
#define SPRINGLS__KERNEL_DEVICE_KERNELS_H

#include "../model/cell_list.h"
#include "../model/collectives.h"
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
#include "../stages/regions.h"
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

/* Lists the programs of OpenCL into which kernels are divided, by the stages that use them. Each is compiled when one of its
   kernels is first needed, the first one with the backend. */
#define SPRINGLS__PROGRAMS(X) X(LISTS) X(MOVE) X(RESAMPLE) X(EDGES) X(FILL) X(LEVEL_SET) X(SIGNS) X(SURFACE)

/* Lists kernels: name, program, elements worth a task of their own, arrays that it writes. It may read all of the model. */
#define SPRINGLS__KERNELS(X)                                                                                                     \
    X(write, MOVE, 512, SPRINGLS__BIT(S))                                                                                        \
    X(wake, LISTS, 4096, SPRINGLS__BIT(CALM) | SPRINGLS__BIT(AWAKE) | SPRINGLS__BIT(NEAR_AWAKE))                                 \
    X(calm, LISTS, 4096, SPRINGLS__BIT(CALM))                                                                                    \
    X(stir, LISTS, 4096, SPRINGLS__BIT(CALM))                                                                                    \
    X(lull, LISTS, 4096, SPRINGLS__BIT(AWAKE) | SPRINGLS__BIT(NEAR_AWAKE))                                                       \
    X(awake, LISTS, 64, SPRINGLS__BIT(AWAKE))                                                                                    \
    X(near_awake, LISTS, 64, SPRINGLS__BIT(NEAR_AWAKE))                                                                          \
    X(asleep, LISTS, 1024, SPRINGLS__BIT(ASLEEP))                                                                                \
    X(cell_key, LISTS, 1024, SPRINGLS__BIT(KEY))                                                                                 \
    X(neighbors, RESAMPLE, 64, SPRINGLS__BIT(NEIGHBORS))                                                                         \
    X(shorten_arms, RESAMPLE, 512, SPRINGLS__ROLE_BIT(relaxed_springls))                                                         \
    X(cover, RESAMPLE, 128, SPRINGLS__ROLE_BIT(relaxed_springls))                                                                \
    X(orient, RESAMPLE, 256, SPRINGLS__BIT(S))                                                                                   \
    X(sample_phi, RESAMPLE, 512, SPRINGLS__BIT(PHI_AT))                                                                          \
    X(contract, RESAMPLE, 256, SPRINGLS__ROLE_BIT(contract_action))                                                              \
    X(reshape, RESAMPLE, 256, SPRINGLS__BIT(S))                                                                                  \
    X(merge_begin, RESAMPLE, 4096, SPRINGLS__ROLE_BIT(contract_action))                                                          \
    X(merge, RESAMPLE, 256, SPRINGLS__ROLE_BIT(next_contract_action))                                                            \
    X(overgrown, RESAMPLE, 512, SPRINGLS__ROLE_BIT(split_number))                                                                \
    X(split, RESAMPLE, 64, SPRINGLS__ROLE_BIT(split_halves))                                                                     \
    X(split_store, RESAMPLE, 512, SPRINGLS__SET_BITS)                                                                            \
    X(track, MOVE, 256, SPRINGLS__BIT(A))                                                                                        \
    X(edge_normal, EDGES, 512, SPRINGLS__ROLE_BIT(side_normal) | SPRINGLS__ROLE_BIT(was_at_edge))                                \
    X(edge_cells, EDGES, 64, SPRINGLS__ROLE_BIT(edge_cells))                                                                     \
    X(edge_candidate, EDGES, 512, SPRINGLS__ROLE_BIT(edge_candidate))                                                            \
    X(edge_side, EDGES, 64, SPRINGLS__BIT(EDGE) | SPRINGLS__ROLE_BIT(side_normal))                                               \
    X(edge_turn, EDGES, 256, SPRINGLS__BIT(S))                                                                                   \
    X(seed, FILL, 64, SPRINGLS__ROLE_BIT(seeds) | SPRINGLS__ROLE_BIT(seed_action))                                               \
    X(seed_choose, FILL, 512, SPRINGLS__ROLE_BIT(next_seed_action))                                                              \
    X(seed_count, FILL, 4096, SPRINGLS__ROLE_BIT(seed_number))                                                                   \
    X(insert_seeds, FILL, 512, SPRINGLS__SET_BITS)                                                                               \
    X(fill, FILL, 16, SPRINGLS__SET_BITS)                                                                                        \
    X(fit_new_springls, FILL, 16,                                                                                                \
      SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | SPRINGLS__BIT(SYNCED_POSITION) | SPRINGLS__BIT(COMPONENT) | SPRINGLS__BIT(CAVITY)    \
          | SPRINGLS__BIT(CONTACT_BODY) | SPRINGLS__BIT(ERROR))                                                                  \
    X(omega_constant, LISTS, 1024, SPRINGLS__BIT(OMEGA))                                                                         \
    X(omega_forget, LEVEL_SET, 256, SPRINGLS__BIT(OMEGA) | SPRINGLS__ROLE_BIT(omega_missing))                                    \
    X(commit_simple_color, LEVEL_SET, 8, SPRINGLS__BIT(PHI))                                                                     \
    X(revert_unsimple, LEVEL_SET, 8, SPRINGLS__BIT(PHI_NEXT))                                                                    \
    X(band, LEVEL_SET, 32, SPRINGLS__ROLE_BIT(band_mask))                                                                        \
    X(overlap, LEVEL_SET, 64, SPRINGLS__BIT(OVERLAPPED))                                                                         \
    X(oriented, LEVEL_SET, 256, SPRINGLS__ROLE_BIT(oriented_springls))                                                           \
    X(grow_line, SIGNS, 64, SPRINGLS__ROLE_BIT(has_grown) | SPRINGLS__ROLE_BIT(brick_state))                                     \
    X(region_begin, SIGNS, 64, SPRINGLS__ROLE_BIT(region_label) | SPRINGLS__BIT(PHI_NEXT))                                       \
    X(region_resolve, SIGNS, 64, SPRINGLS__BIT(TOP) | SPRINGLS__BIT(PHI))                                                        \
    X(mark_phi_synced, LISTS, 1024, SPRINGLS__BIT(SYNCED_POSITION))                                                              \
    X(displacement, LISTS, 1024, SPRINGLS__ROLE_BIT(synced_distance2))                                                           \
    X(extent, LISTS, 1024, SPRINGLS__ROLE_BIT(extent))                                                                           \
    X(departed, LISTS, 1024, SPRINGLS__ROLE_BIT(has_departed))                                                                   \
    X(scan_chunk, LISTS, 1, SPRINGLS__BIT(SUMS))                                                                                 \
    X(scan_sums, LISTS, 1, SPRINGLS__BIT(SUMS) | SPRINGLS__BIT(COUNTS))                                                          \
    X(scan_apply, LISTS, 1, 0) /* and the array that it is given */                                                              \
    X(count_chunk, LISTS, 1, SPRINGLS__BIT(SUMS))                                                                                \
    X(largest_chunk, LISTS, 1, SPRINGLS__BIT(SUMS))                                                                              \
    X(largest_sums, LISTS, 1, SPRINGLS__BIT(COUNTS))                                                                             \
    X(counts_clear, LISTS, 16, SPRINGLS__BIT(COUNTS))                                                                            \
    X(cells_clear, LISTS, 64, SPRINGLS__BIT(CELL))                                                                               \
    X(cells_prefix, LISTS, 64, SPRINGLS__BIT(CELL) | SPRINGLS__ROLE_BIT(cell_count))                                             \
    X(cells_base, LISTS, 64, SPRINGLS__BIT(CELL) | SPRINGLS__BIT(PLACES))                                                        \
    X(cells_sort, LISTS, 64, SPRINGLS__BIT(IDS) | SPRINGLS__BIT(PLACES))                                                         \
    X(unbinned_flag, LISTS, 4096, SPRINGLS__ROLE_BIT(unbinned_number))                                                           \
    X(unbinned_scatter, LISTS, 4096, SPRINGLS__BIT(UNBINNED))                                                                    \
    X(brick_lists_rank, LISTS, 1024, SPRINGLS__ROLE_BIT(brick_rank))                                                             \
    X(brick_lists_clear, LISTS, 1024, SPRINGLS__BIT(BRICK_LIST_FIRST))                                                           \
    X(brick_lists_sort, LISTS, 8, SPRINGLS__BIT(BRICK_LIST_IDS))                                                                 \
    X(bricks_begin, LISTS, 4096, SPRINGLS__BIT(BRICK_FLAG))                                                                      \
    X(mark_outside, LISTS, 1024, SPRINGLS__BIT(BRICK_FLAG))                                                                      \
    X(mark_cover, LISTS, 64, SPRINGLS__BIT(BRICK_FLAG))                                                                          \
    X(mark_band, LISTS, 64, SPRINGLS__BIT(BRICK_FLAG))                                                                           \
    X(mark_near, LISTS, 512, SPRINGLS__BIT(BRICK_FLAG))                                                                          \
    X(bricks_count, LISTS, 1, SPRINGLS__BIT(SUMS))                                                                               \
    X(bricks_sums, LISTS, 1, SPRINGLS__BIT(SUMS) | SPRINGLS__BIT(COUNTS))                                                        \
    X(bricks_drop, LISTS, 1, SPRINGLS__BIT(TOP) | SPRINGLS__BIT(SLOT_BRICK) | SPRINGLS__BIT(AWAKE) | SPRINGLS__BIT(FREE_SLOTS))  \
    X(bricks_add, LISTS, 1, SPRINGLS__BIT(TOP) | SPRINGLS__BIT(SLOT_BRICK) | SPRINGLS__BIT(PHI) | SPRINGLS__BIT(ACTIVE)          \
                          | SPRINGLS__BIT(NEW_SLOTS))                                                                            \
    X(bricks_fill, LISTS, 16, SPRINGLS__BIT(PHI) | SPRINGLS__BIT(PHI_NEXT) | SPRINGLS__BIT(OMEGA) | SPRINGLS__BIT(CELL)          \
                            | SPRINGLS__BIT(CALM) | SPRINGLS__BIT(AWAKE) | SPRINGLS__BIT(NEAR_AWAKE))                            \
    X(compact_flag, LISTS, 4096, SPRINGLS__ROLE_BIT(stay_number))                                                                \
    X(compact_out, LISTS, 256, SPRINGLS__BIT(SPARE))                                                                             \
    X(compact_in, LISTS, 256, SPRINGLS__SET_BITS)                                                                                \
    X(attach_vertex_data, SURFACE, 256, SPRINGLS__ROLE_BIT(vertex_gradient) | SPRINGLS__ROLE_BIT(vertex_correspondence)          \
                                   | SPRINGLS__ROLE_BIT(vertex_springl))

/* Lists kernels whose elements meet, at a counter, in a list or at a root (collectives.h, regions.h): the host runs them in order. */
#define SPRINGLS__ORDERED_KERNELS(X)                                                                                             \
    X(cells_count, LISTS, 512, SPRINGLS__BIT(CELL) | SPRINGLS__BIT(COUNTS))                                                      \
    X(cells_radius, LISTS, 512, SPRINGLS__BIT(COUNTS))                                                                           \
    X(cells_scatter, LISTS, 512, SPRINGLS__BIT(CELL) | SPRINGLS__BIT(IDS) | SPRINGLS__BIT(PLACES))                               \
    X(brick_lists_count, LISTS, 128, SPRINGLS__BIT(BRICK_LIST_FIRST))                                                            \
    X(brick_lists_scatter, LISTS, 128, SPRINGLS__BIT(BRICK_LIST_FIRST) | SPRINGLS__BIT(BRICK_LIST_IDS))                          \
    X(region_join, SIGNS, 64, SPRINGLS__ROLE_BIT(region_label))                                                                  \
    X(region_vote, SIGNS, 64, SPRINGLS__BIT(PHI_NEXT))

/* Lists kernels whose elements are bricks, which the items of a work group share on a device; last: floats they share. */
#define SPRINGLS__BRICK_KERNELS(X)                                                                                               \
    X(exposure, FILL, 4, SPRINGLS__ROLE_BIT(exposed) | SPRINGLS__ROLE_BIT(exposed_count), SPRINGLS__TILE_VOXELS)                 \
    X(omega, LEVEL_SET, 4, SPRINGLS__BIT(OMEGA), 1)                                                                              \
    X(evolve, LEVEL_SET, 4, SPRINGLS__BIT(PHI_NEXT), 2 * SPRINGLS__TILE_VOXELS)                                                  \
    X(subvoxel, LEVEL_SET, 8, SPRINGLS__BIT(PHI_NEXT), SPRINGLS__TILE_VOXELS)                                                    \
    X(redistance, LEVEL_SET, 8, SPRINGLS__BIT(PHI_NEXT), SPRINGLS__TILE_VOXELS)                                                  \
    X(project, LEVEL_SET, 4, SPRINGLS__BIT(PHI_NEXT) | SPRINGLS__ROLE_BIT(has_unknown_side) | SPRINGLS__ROLE_BIT(has_opposed),   \
      SPRINGLS__SUMS_FLOATS)                                                                                                     \
    X(resolve_sides, LEVEL_SET, 8, SPRINGLS__BIT(OMEGA), SPRINGLS__TILE_VOXELS)                                                  \
    X(find_joint_candidates, LEVEL_SET, 8, SPRINGLS__ROLE_BIT(has_joint_candidates), SPRINGLS__TILE_VOXELS)                      \
    X(join_parts, LEVEL_SET, 8, SPRINGLS__BIT(PHI_NEXT), SPRINGLS__TILE_VOXELS)                                                  \
    X(specks, LEVEL_SET, 8, SPRINGLS__BIT(PHI_NEXT), SPRINGLS__TILE_VOXELS)                                                      \
    X(brick_state, SIGNS, 64, SPRINGLS__ROLE_BIT(brick_state), SPRINGLS__ROWS)                                                   \
    X(brick_side, SIGNS, 64, SPRINGLS__BIT(TOP) | SPRINGLS__BIT(PHI), 1)                                                         \
    X(grow, SIGNS, 8, SPRINGLS__BIT(PHI_NEXT) | SPRINGLS__ROLE_BIT(has_grown), SPRINGLS__ROWS)                                   \
    X(sides, SIGNS, 4, SPRINGLS__BIT(PHI), SPRINGLS__BRICK_VOXELS)                                                               \
    X(with_sign, SIGNS, 64, SPRINGLS__BIT(PHI), 1)                                                                               \
    X(surface_count, SURFACE, 8,                                                                                                 \
      SPRINGLS__ROLE_BIT(cubes) | SPRINGLS__ROLE_BIT(triangles_before) | SPRINGLS__ROLE_BIT(vertices_before)                     \
          | SPRINGLS__ROLE_BIT(surface_rank) | SPRINGLS__ROLE_BIT(row_triangles),                                                \
      SPRINGLS__SURFACE_FLOATS)                                                                                                  \
    X(surface, SURFACE, 8, SPRINGLS__ROLE_BIT(surface_positions) | SPRINGLS__ROLE_BIT(surface_corners), SPRINGLS__TILE_VOXELS)

/* Lists kernels that have springls__name_elements besides, for several elements at once, which C calls. */
#define SPRINGLS__SIMD_KERNELS(X) X(relax, RESAMPLE, 128, SPRINGLS__ROLE_BIT(relaxed_springls))

/* Lists such kernels of a device whose loop in C is the stage's own (displace.cl). */
#define SPRINGLS__DEVICE_KERNELS(X)                                                                                              \
    X(displace, MOVE, 128,                                                                                                       \
      SPRINGLS__ROLE_BIT(moved_springls) | SPRINGLS__ROLE_BIT(displacement2) | SPRINGLS__ROLE_BIT(turning2)                      \
          | SPRINGLS__ROLE_BIT(moved_error) | SPRINGLS__ROLE_BIT(motion_class))

#endif
