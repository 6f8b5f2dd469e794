/* springls.h - Spring Level Sets in one header of C99.

   The method: B. C. Lucas, M. Kazhdan, R. H. Taylor, "Spring Level Sets: A Deformable Model Representation to Provide
   Interoperability between Meshes and Level Sets", IEEE TVCG 19(5), 2013: "the paper" below.


   WHAT IT IS

   One deformable model in three forms that are kept in agreement:

     springls   a triangle soup; each triangle hangs by three springs on a particle and moves with the flow
     points     each particle p remembers its place a on the original surface
     phi        a signed distance on a sparse grid, negative inside; its zero level is a watertight surface

   Springls carry detail and correspondence; phi says what is inside, where springls are missing and where they are
   superfluous. Topology changes by itself, or is preserved on request.


   DO THIS

     #define SPRINGLS_IMPLEMENTATION
     #include "springls.h"

   in exactly one C or C++ file, and include springls.h without the macro everywhere else. Link the C maths library
   (-lm). Compile the implementation with -ffp-contract=off (see DETERMINISM), and with -fopenmp for threads.


   MACROS, defined before the include

     SPRINGLS_IMPLEMENTATION  the function bodies, in one file of the program
     SPRINGLS_STATIC          every function private to the including file; several files may each have their own copy
     SPRINGLS_DLL             export the functions from (implementation) or import them from (user) a shared library
     SPRINGLS_NAMESPACE       =foo: springls_step is foo_springls_step for the linker; two versions fit one program.
                              Define it alike in every file that includes the header
     SPRINGLS_ASSERT(c)       internal checks; the default is assert of <assert.h>. Wrong arguments never come here:
                              they return a status
     SPRINGLS_NO_SIMD         plain C in the hot loops too. GCC and clang make vectors of 4 floats, of 8 where the target
                              has AVX2 (-mavx2, -march=native); the results are the same bits


   STEP BY STEP

     1. Fill a springls_desc: zero all of it, set grid.size. spacing, origin and direction place the voxels in the
        world. Hooks for memory, threads, log, progress and trace are optional.
     2. springls_create(&desc, &ctx).
     3. Give it a surface: springls_set_mesh, _set_level_set, _set_labels, _set_threshold, _set_implicit or
        _set_springls. Each replaces the model and makes it its own reference: a = p.
     4. Fill a springls_forces: callbacks that answer for a batch of points, or sampled grids. Speeds are voxels a unit
        of time, points are voxel coordinates.
     5. Fill a springls_step_desc: forces, mode, dt, max_displacement = 2: then dt may be as long as you like, and is cut
        into sub-steps of two voxels. With dt = 0 a step is as long as max_displacement (d_max) allows.
     6. springls_step or springls_run. Check the status; springls_last_error has the sentence.
     7. Read: springls_extract_mesh (watertight), springls_view_* (no copy), springls_sample_distance, springls_closest,
        springls_measure ...
     8. springls_mesh_free for meshes, springls_destroy for the context.


   DATA FLOW

     mesh, volume, function --> springls + phi --> step, step, ... --> mesh, springls, distances, correspondences

   SPRINGLS_MODE_FLUID, Algorithm 2. With the paper's set, steps up to about d_max. On every M-th step (resample_period):

       advect  relax  contract  resample  relax  (evolve  rebuild) x evolve_iterations  fill_gaps

     on the others:

       advect  relax  (evolve  rebuild) x evolve_iterations

     With the default set, steps up to two voxels (springls_step_desc.max_displacement = 2). On every M-th step:

       advect  relax  [keep_edges]  project  contract  resample  fill_gaps  [volume_lock]

     on the others:

       advect  relax  [keep_edges]  project  [volume_lock]

     predict = 1 and evolve_iterations = 0: phi is carried along before it is projected: a voxel takes the value of the place that
     the springls around it have come from. Where none is near and the surface may have passed, the voxels around decide the
     side. eq. 23 is left out, and with it curvature of eq. 22 (springls_forces.curvature_weight smooths too); with
     evolve_iterations > 0 it follows. After a way of more than band_half_width + 1 voxels, phi is made afresh
     (unsigned_to_signed), which does not preserve topology: cut such steps by max_displacement.
     project_level_set = 1: near springls phi is their oriented distance, to second order; and unsigned_to_signed lets
     springls say on which side of them a voxel lies, so that clefts, hollows and pockets that the paper's background does not
     reach stay outside. Springls with the inside before them, left where bodies have met, go; so does a single voxel of the
     other side, unless topology is PRESERVED or a thin sheet has it.
     resample_last = 1: contract and resample come when phi has followed, and the second relax is left out.
     Three switches of the default set keep sheets that are thinner than a voxel, which phi alone loses. keep_thin = 1: contract
     keeps a springl far from the zero level while the other side of its sheet is behind it, or neighbours are beside it.
     nucleate = 1: project makes a voxel inside that both sides of a sheet claim; a thread or drop of that size may vanish.
     fill_from_springls = 1: fill_gaps first adds springls where the neighbours of one leave a wide opening, on the surface that
     they span; the zero level's triangles follow only where no springl is within 0.75 voxels, at sheets 1.5, not d_max. A wide hole
     then takes a few calls. Half way through such a sheet the zero level may be islands: the springls are the surface.
     keep_edges = 1: springls at a crease are turned into their own side of it before phi follows (keep_edges), and project,
     split and fill ask each side by itself: see SHARP EDGES.
     On every M-th step, after the last rebuild, triangles that face against grad phi are turned (section 4.3.1).

   SPRINGLS_MODE_ELASTIC, Algorithm 3. Steps of any size; phi is made afresh from the springls:

       advect  unsigned_to_signed  [keep_edges]  (evolve  rebuild) x evolve_iterations  [project]  relax  fill_gaps  contract  resample

   with at least three of (evolve  rebuild) where predict = 1: there is nothing to carry. Topology is not preserved: phi is
   made afresh.

   SPRINGLS_MODE_ADVECT_ONLY: advect. phi stays.

   one_to_one leaves out contract, resample and fill_gaps: springl i stays springl i. fill_gaps ends with track for the
   springls that it adds. Every stage but project, keep_edges and volume_lock may also be
   called alone, in any order.


   PARAMETERS

   springls_paper_params() has the paper's rules, springls_default_params() what we recommend. Lengths are voxels. Where
   the columns differ, each member is a switch of its own, so the effect of one change can be measured.

     symbol     member               meaning                                             default   paper     unit
     d_max      d_max                capsule radius: nearer than it is covered           0.5       0.5       voxel
     r          particle_radius      springs rest at 2r                                  0.05      0.05      voxel
     R          neighbor_radius      range of neighbours, d_max + 2r                     0.6       0.6       voxel
                max_neighbors        nearest edges kept a vertex, 1..8                   8         8
                relax_iterations     iterations of Algorithm 1                           1         5 (p)
     H          threshold            Fig. 8a                                             TANH      TANH
     W          weight               Fig. 8b                                             LINEAR    LINEAR
     gamma      torque               NORMALIZED eq. 20, PHYSICAL eq. 19                  NORM.     NORM.
     lambda_c   sharpness            of H(lambda_c x)                                    5         5
     kappa_int  kappa_int            internal spring constant, eq. 4                     1.5       0.3
     kappa_ext  kappa_ext            external spring constant, eq. 5                     1         1
     xi         relax_step_length    eq. 17                                              0.2       0.1
     rho        relax_step_rotation  eq. 18                                              0.2       0.1
                relax_same_side      1: neighbours that face the other way do not pull   0         0
     (1+eps)    contract_distance    remove beyond this |phi(p)|, (1 + 0.25) d_max       0.625     0.625     voxel
                min_angle            smaller angles are bad                              20        20        degree
                max_angle            larger angles are bad                               160       160       degree
                min_area             smaller triangles are bad                           0.05      0         voxel^2
                reshape              1: a bad triangle is given a good shape; 0: removed 1         0
                merge_distance       the younger of two nearer particles goes; 0: never  0.6       0         voxel
                keep_thin            1: far springls of a thin sheet stay                1         0
     M          resample_period      steps from one resampling to the next               5         5
                resample_last        see DATA FLOW                                       1         0
                split_edge           split when the longest edge exceeds it              2         never (d) voxel
                split_area           or the area exceeds it                              4         3 (p)     voxel^2
                placement            of new springls: COPY, QUADRATIC                    QUADR.    COPY
                band_half_width      phi is a distance within it                         3         3 (p)     voxel
                capture              omega is clamped here, eq. 21                       2         2 (d)     voxel
                evolve_iterations    (evolve, rebuild) pairs a step                      0         4
     delta t    evolve_step          eq. 23                                              0.75      0.75 (p)
     epsilon    evolve_width         half-width of the compact delta                     1.5       1.5 (d)   voxel
     lambda     curvature            of eq. 22; positive smooths                         0         0
                predict              1: springls carry phi along                         1         0
                project_level_set    1: near springls phi is their oriented distance     1         0
                nucleate             1: project makes voxels of thin sheets inside       1         0
                fill_from_springls   1: first fill holes among the springls              1         0
                keep_edges           1: sides of a sharp edge are not averaged           1         0
                topology             FREE, PRESERVED                                     FREE      FREE
                nearest_rule         nearest instead of average correspondence beyond it never     never (d) voxel
                track_iterations     projections on the original surface, eq. 26         4         4
     lambda     track_step           of eq. 26                                           0.5       0.5
                vertex_velocity      1: every vertex has its own velocity, unlike eq. 2  1         0
                half_time_sampling   1: RK4 samples half a step, as the author's program 0         0
                volume_lock          1: see VOLUME LOCK                                  0         0
                initial_stride       marching cubes on every n-th voxel                  1         2 (p)
                project_initial      1: initial springls are moved onto the zero level   1         1 (d)

   (p) not in the paper's text, or other than there: the value of the author's program. (d) see DEVIATIONS.


   SHARP EDGES

   Edges are looked for when a model is set: by springls_set_mesh, and from level sets with project_initial = 1; not by
   springls_set_springls, and not when the switch is turned on later. With keep_edges = 1 such an edge stays an edge, where
   springls about it fall into sides: groups of normals 50 degrees or more apart, each a patch and not a strip, with next to nothing between them. Rims of thin sheets and rounded edges of a radius
   of a voxel or more are smooth surfaces, and are treated as without the switch. At an edge phi is the larger (convex) or
   smaller (concave) of the heights over the sides: beyond a convex edge that is less than the distance, by up to 29 % at a
   right angle. Marching cubes cuts edges off between voxels all the same: the extracted mesh is as sharp as the distance of
   the exact shape, sampled at voxels, would make it. springls_stats.at_edges counts springls that lie at edges.


   ATTRIBUTES

   springls_add_attribute gives every springl some floats under a name; they follow through splits, fills and merges by the policies
   of its springls_attribute_desc: COPY for labels, BLEND for what is continuous, SHARE for amounts. For colours, weights and the
   like take BLEND, BLEND and, for merge, COPY: of two springls that merge the elder keeps place and correspondence, and so what
   belongs to them. Blending means values with weights that are not negative and add up to 1, so a range is kept, and sums of
   channels (bone weights) stay 1; of what curves over the original it takes a little off at each interpolation. What is known on
   the mesh that was set need not be carried: springls_mesh_materials says where on it the vertices of an extracted mesh lie,
   springls_corner_materials the same for corners, on one side of every seam of texture coordinates, and springls_interpolate_material takes the
   values from there, which no number of steps wears off. springls_get_provenance says of each springl whether it is original,
   split or filled, and how old. Attributes cost nothing when there are none, and change nothing about the model. With a backend
   they live on the host, which at each resampling reads what it needs of the springls.
   springls_combine, _combine_implicit, _offset, _smooth and _remesh keep attributes as they keep springls.


   VOLUME LOCK

   With volume_lock = 1 every step of SPRINGLS_MODE_FLUID and SPRINGLS_MODE_ELASTIC ends with each component's volume (of its marching
   cubes surface, as springls_measure tells it, to about 1 part in 10^6) being what it was before the first step with the switch on: its
   springls and phi are moved along their normals by one small distance a component. When components merge their volumes add up; when
   one splits the parts share its volume as they divide it. A component that appears from nothing keeps the volume it appears
   with; parts of less than 10 voxels count as
   belonging to the largest. It holds the volume against forces too, so it is not for contours that are to grow. It is cosmetic: it hides a loss
   of volume and improves nothing else, and it is off in every figure we report. springls_stats.volume_correction is what it
   had to do. It needs 8 bytes more a voxel of active bricks and 4 a brick of the grid.


   MEMORY

   All memory comes from desc.allocator, or malloc; the library calls it only from the thread that called the library.
   phi and omega live in bricks of 8 x 8 x 8 voxels that exist only near the surface, so memory grows with the area of
   the surface; a top table has one int a brick. springls_memory_used tells the bytes held. Buffers grow and are reused;
   springls_reset keeps them, springls_destroy returns them. Views (springls_view_*, springls_ids) belong to the context
   until the next call that changes the model. A springls_mesh belongs to the caller: springls_mesh_free. Arrays handed
   in are borrowed during the call.


   THREADS

   A context belongs to one thread at a time; different contexts are independent; there is no global state. Inside a
   call, work is cut into ranges that go to desc.tasks.parallel_for, to OpenMP when compiled with it, or run in the
   calling thread. Force callbacks then run on several threads at once, with different ranges: they must not write to
   shared state. GCC's OpenMP threads wait in a busy loop, which costs ten times the work where the machine has something
   else to do: set OMP_WAIT_POLICY=passive in the environment.


   FRAMES

   springls_step_begin and springls_step_continue are springls_step in pieces, for a budget of time a frame: the same bits
   however it is cut. A stage is left between its parts, and inside the loops that are its work:

     advect               the forces' batches
     relax                finding neighbours, every iteration
     contract             choosing, every round of merging
     project              the projection, removal of specks, every sweep that re-distances
     fill_gaps            looking for holes, looking for bare triangles
     evolve, rebuild      omega, eq. 23, every sweep
     unsigned_to_signed   omega, sides; the growth of the background is a part for each size of block

   What else a part does is not cut, and a call may take that much longer than it was allowed: springls are sorted into cells,
   bricks are added and dropped, springls removed or split, attributes follow; where topology is preserved, phi is committed;
   resample, keep_edges and volume_lock are one part each. On a device parts are asked for and the host goes on; a call waits
   where a part wants a number back. springls_chunks: the zero level in bricks, and which have changed. springls_snapshot,
   springls_restore: back, and on again to the bit.


   ERRORS

   Calls that can fail return a springls_status: 0 is success, failures are negative. springls_last_error(ctx) tells
   what and where. Nothing aborts, nothing is printed; log lines go to desc.logger. After OUT_OF_MEMORY the context can
   be used, but its model may be incomplete: set it again. NON_FINITE from a force leaves the springls as they were.
   When max_springls is reached, splits and fills are refused and counted in springls_stats.refused: that is no error.


   DETERMINISM

   The same input gives the same bits for every number of threads, every cut into ranges and every optimisation level,
   provided the compiler does not fuse a*b+c. Clang obeys a pragma in this header; GCC needs -ffp-contract=off. Flags that
   permit the compiler to change arithmetic (-ffast-math) lose the promise. springls_fp_contract_detected() tells
   whether a build fuses; springls_state_hash() compares states. Transcendental functions that the state depends on are
   the library's own. Force callbacks must be deterministic too.


   LIMITS

     - The grid is 4 to 4096 voxels a side and does not move. The model is closed at the border of the grid.
     - Sheets thinner than about a voxel have no watertight zero level, though their springls carry them on (default set: see
       DATA FLOW). Threads of that size break.
     - At most 8 neighbour edges a vertex (section 4.8 of the paper).
     - float32 in voxel units throughout.
     - OpenCL is a header of its own, springls_cl.h. springls_kernel_source() has the kernels' text for hosts of your own.


   DEVIATIONS of springls_paper_params() from the paper

     - omega is clamped at 2 voxels (capture), not at d_max (eq. 21): with d_max phi feels no force where it has fallen
       half a voxel behind and never catches up.
     - Springls are split when their area exceeds 3 voxel^2, as Table 2 says and the author's program does; section 4.6
       prints a longest edge of 1.5 voxels, which makes five times as many springls as the paper counts.
     - Initial springls of a level set come from marching cubes on every second voxel, as in the author's program, moved so
       that they straddle the zero level: chords that all lie inside it would cost half a percent of the volume.
     - A filled springl always takes the average of its neighbours' correspondences, as in the author's program. Section 4.7
       takes the nearest one when it is more than 2 voxels from the average; that nearly doubles the tracking error of
       LeVeque's test (nearest_rule = 2).
     - A vertex's neighbours are its nearest edges, found at a resampling and kept until the next one. The closest points
       on those edges are taken afresh in every iteration.
     - contract judges a particle by phi taken before the step's advect, when phi and springls were in step. After a
       step as long as d_max a good springl is further than contract_distance from the old zero level. Called alone,
       springls_contract takes phi as it is.
     - The compact delta of eq. 23 has half-width 1.5 voxels, and the data term is -grad(omega^2)/2, smooth at the surface.
     - Runge-Kutta stages sample the time of their stage. The author's program spans half a step: half_time_sampling.
     - Signs. In eq. 23 as printed springls repel phi and curvature sharpens. Here springls attract, and positive curvature
       smooths, as gradient descent on eq. 22 does. The term omega^2/2 times curvature is dropped.
     - rebuild re-distances with sub-voxel care at the interface instead of counting layers of voxels.


   MAP from the paper to functions

     eq. 1, 2           springls_advect, springls_forces
     eq. 3-20, Alg. 1   springls_relax (kernels_embed/relax.h)
     eq. 21             omega, inside springls_evolve (src/omega.h)
     eq. 22, 23         springls_evolve
     eq. 24, 25         springls_step_desc.stop_at_topology
     eq. 26             springls_track
     eq. 27             springls_pack_matrix
     section 2.3.2      springls_extract_surfels
     section 4.1        springls_set_mesh and the other inputs
     section 4.3.1      springls_step: turns flipped triangles (src/relax.h)
     section 4.4        springls_fill_gaps (src/fill_gaps.h; src/fill_from_springls.h is not the paper's)
     section 4.5        springls_unsigned_to_signed, params.topology
     section 4.6        springls_contract, springls_resample
     section 4.7        springls_track, springls_hit.material
     section 4.8        springls_max_speed (CFL), one_to_one, springls_set_relax_mask
     section 5.2        springls_velocity_deformation, springls_velocity_rotation, springls_implicit_notched_sphere
     Table 2            springls_advect ... springls_rebuild, one function a row
     Algorithm 2, 3     springls_step, springls_run with SPRINGLS_MODE_FLUID, SPRINGLS_MODE_ELASTIC
*/
