/* springls.h - Spring Level Sets in one C99 header.

   The method: B. C. Lucas, M. Kazhdan, R. H. Taylor, "Spring Level Sets: A Deformable Model Representation to Provide
   Interoperability between Meshes and Level Sets", IEEE TVCG 19(5), 2013. "The paper" below is this one; section, equation
   and table numbers are its own.


   WHAT IT IS

   One deformable model in three forms that are kept in agreement:

     springls   a triangle soup: each triangle hangs by three springs on a particle, and moves with the flow
     points     each particle p remembers its place a on the original surface
     phi        a signed distance on a sparse voxel grid, negative inside; its zero level is a watertight surface

   Springls carry detail and correspondence. phi shows what is inside, and where springls are missing or too many. The topology
   changes by itself, or is preserved on request.

   The paper's words:

     springl           a particle, three springs and a triangle: an element of the surface
     constellation     all springls of a model
     correspondence    a: the place on the original surface that a particle came from
     original surface  the model as it was set; its signed distance is phi_ref
     capsule           all places within d_max of a springl: the zero level there is covered
     omega             the unsigned distance to the springls
     narrow band       the voxels near the zero level, where phi is a distance


   QUICK START

     #define SPRINGLS_IMPLEMENTATION
     #include "springls.h"

   in exactly one C or C++ file; include springls.h without the macro everywhere else. Link the C maths library (-lm).
   Compile the implementation with -O3; for threads with -DSPRINGLS_THREADS -pthread, and give contexts a pool: THREADS.


   STEP BY STEP

     1. Take springls_default_desc(), or zero a springls_desc, and set grid.size. spacing, origin and direction place the voxels
        in the world. Units: shapes, forces, meshes and answers are in world units, unless a comment names another: UNITS.
        Hooks for memory, threads, log, progress and trace are optional.
     2. springls_create(&desc, &ctx). springls_create_error(&desc) returns why a description is refused.
     3. Set a surface: springls_set_mesh, _set_level_set, _set_labels, _set_threshold, _set_implicit or _set_springls. Each
        replaces the model and makes it the original surface: a = p.
     4. Fill a springls_forces: callbacks for batches of points, or sampled grids. Points are of the world, speeds are
        world units a unit of time; with voxel_units both are of the lattice. Or move springls yourself: see MOTION FROM OUTSIDE.
     5. Zero a springls_step_desc and fill it: forces, mode, dt. dt may be as long as you like: it is divided into sub-steps of at
        most two voxels, or of max_displacement. With dt = 0 a step is as long as that allows.
     6. springls_step or springls_run. Check the status; springls_last_error returns why a call has failed.
     7. Read: springls_extract_mesh (watertight), springls_view_* (no copy), springls_sample_distance, springls_raycast and
        springls_closest (on the watertight surface too), springls_measure ...
     8. springls_mesh_free for meshes, springls_destroy for the context.


   CORE

   Twenty-one functions, of which most programs are made; examples/recipes/core.c calls each, and docs/recipes.md shows it. All else
   follows in the interface by topic.

     a model       springls_default_desc, springls_create, springls_destroy; springls_create_error: why none was made;
                   springls_last_error: why a later call has failed
     parameters    springls_get_params, springls_set_params
     input         springls_set_mesh, springls_set_level_set, springls_set_implicit
     motion        springls_default_forces, springls_default_step_desc, springls_step
     sculpting     springls_combine_implicit: union, intersection, difference with a shape
     output        springls_extract_mesh, springls_mesh_free
     questions     springls_measure, springls_sample_distance, springls_raycast
     keeping       springls_snapshot, springls_restore


   MACROS, defined before the include

     SPRINGLS_IMPLEMENTATION  adds the function bodies; in one file of the program
     SPRINGLS_STATIC          makes every function private to the including file; several files may each have their own copy
     SPRINGLS_DLL             exports the functions from (implementation) or imports them from (user) a shared library
     SPRINGLS_NAMESPACE       =foo: springls_step is foo_springls_step for the linker, so that two versions fit one program.
                              Define it alike in every file that includes the header
     SPRINGLS_ASSERT(c)       checks the library itself; the default is assert of <assert.h>. Wrong arguments return a status
                              and never reach it
     SPRINGLS_THREADS         adds a pool of threads, springls_threads_create: POSIX threads (-pthread), or those of Windows. In
                              the file with SPRINGLS_IMPLEMENTATION; without it the pool's functions give no threads
     SPRINGLS_NO_OPENCL       leaves out the program text of the kernels, half of the object at -O2: springls_kernel_source
                              gives no lines, and springls_cl.h cannot be included
     SPRINGLS_NO_SNAPSHOTS, _NO_CHUNKS, _NO_TOOLS (combinations, offsets, smoothing, remeshing, following a level set), _NO_EVENTS
                              (components too), _NO_QUERIES (samples, closest points, rays), _NO_TILINGS   leave these functions out
     SPRINGLS_MINIMAL         leaves all of them and the kernels' text out: a third of the object remains (gcc -O2). Define these alike in
                              every file that includes the header: a function that is declared and left out is not found by the linker
     SPRINGLS_NO_SIMD         compiles the hot loops as plain C too. Without it GCC and clang use vectors of 4 floats, of 8 where
                              the target has AVX2 (-mavx2, -march=native); the results have the same bits


   DATA FLOW

     mesh, volume, function --> springls + phi --> step, step, ... --> mesh, springls, distances, correspondences

   A step runs stages in a fixed order. "paper" and "default" are the two parameter sets; "Mth" is every M-th step
   (resample_period), "-" never, "4 x" four times.

   SPRINGLS_MODE_FLUID, Algorithm 2: for active contours and fluids. Steps of up to d_max with the paper's set, of up to two
   voxels with the default set, unless springls_step_desc.max_displacement has another number.

     stage              paper   default   does
     advect             every   every     moves springls by the forces
     relax              every   Mth       lets each springl seek equilibrium with its neighbours; on every step with pressure
                                          or curvature, without a velocity, or with one_to_one
     contract           Mth     -         removes, reshapes or merges springls
     resample           Mth     -         splits large springls
     relax              Mth     -
     keep_edges         -       Mth       turns springls at sharp edges to their own side; only in models that have such
                                          edges, and on every step where relax is
     project            -       every     carries phi along with the springls, and makes it their distance
     evolve, rebuild    4 x     -         moves phi towards the springls; makes it a distance again
     (orientation)      Mth     Mth       turns triangles that face against grad phi (section 4.3.1);
                                          with keep_thin, not those that are nearly parallel to it
     contract           -       Mth
     resample           -       Mth
     fill_gaps          Mth     Mth       adds springls where the surface is bare, and tracks them
     relax              -       Mth       its last part: triangles cover the surface again
     volume_lock        -       -         with params.volume_lock = 1: every step
     components         -       -         with params.components = 1: every step in which volume_lock does not run

   SPRINGLS_MODE_ELASTIC, Algorithm 3: for steps of any size. phi is recomputed from the springls, which does not preserve
   topology.

     stage                paper   default
     advect               every   every
     unsigned_to_signed   every   every     makes phi from the springls alone
     keep_edges           -       every
     evolve, rebuild      4 x     3 x       at least 3 x where carry_level_set = 1, since phi is not carried here
     project              -       every
     relax                every   every
     fill_gaps            every   every
     contract             every   every
     resample             every   every
     relax                -       every     its last part: triangles cover the surface again
     volume_lock          -       -
     components           -       -

   SPRINGLS_MODE_ADVECT_ONLY: advect. phi stays.

   With lazy_distance > 0, as in the default set, "every" and "Mth" count whole steps: see LAZY STEPS.

   one_to_one leaves out contract, resample and fill_gaps: springl i stays springl i. Every stage but project, keep_edges,
   volume_lock and components may also be run alone, in any order: springls_advect, springls_run_stage.

   These switches of the default set change what stages do:

     switch                   stage                what it changes
     carry_level_set = 1      project              phi moves with the springls: a voxel takes the value of the place that the
                                                   springls around it came from. If no springl is near and the surface may
                                                   have passed, the neighbouring voxels decide the side.
                                                   After a motion of more than band_half_width + 1 voxels phi is recomputed
                                                   by unsigned_to_signed, which does not preserve topology: steps that are
                                                   divided make no such motions
                              advect               in a step, also moves springls by evolve_step lambda times the curvature, as
                                                   one iteration of eq. 23 would move phi: see CURVATURE
     evolve_iterations = 0    evolve, rebuild      left out. With a number > 0 they run after phi has been carried
     cover = 1                relax                ends with triangles that cover the surface: see COVERAGE
     project_level_set = 1    project              phi near springls is their oriented distance, to second order
                              unsigned_to_signed   near springls, they decide the side of a voxel: clefts, hollows and pockets
                                                   that the paper's background cannot reach stay outside
                              contract             removes springls with the inside in front of them, which are left where
                                                   bodies have met
     resample_last = 1        contract, resample   run after phi has followed the springls; the second relax is left out
     keep_thin = 1            contract             keeps a springl far from the zero level while the other side of its sheet is
                                                   behind it, or neighbours are beside it; and both sides of a gap
                              relax                springls that face each other across a gap do not pull each other
     nucleate = 1             project              makes a voxel inside when both sides of a thin sheet claim it, and outside
                                                   between the sides of a gap; filaments and drops of that size may vanish
     min_component = 1        project              first joins parts of up to 64 voxels to the rest, where the springls show a
                              springls_set_mesh    limb that runs on between voxels. Then removes the parts and bubbles that
                                                   have less volume than this, voxel^3 (at most 16, since a search takes
                                                   longer in larger parts), and fills holes of sheets that are narrower than
                                                   a voxel. Not with topology PRESERVED
     fill_from_springls = 1   fill_gaps            first adds springls where the neighbours of one leave a wide gap, on the
                                                   surface that they span; a wide hole takes a few calls. Then adds the zero
                                                   level's triangles, but only where no springl is within 0.75 voxel, or 1.5
                                                   voxels at thin sheets (without the switch: d_max)
     keep_edges = 1           keep_edges           runs, where the model has sharp edges: see SHARP EDGES
                              project, resample    average each side of an edge by itself
                              fill_gaps            the same

   keep_thin, nucleate and fill_from_springls keep sheets that are thinner than a voxel, which phi alone loses. Within such
   a sheet the zero level may be islands: there the springls are the surface. The three also keep gaps between bodies, or between
   parts of one: while a gap is thinner than a voxel phi may be one component, but the springls of both sides stay, and drawn
   apart the bodies are as they were. Bodies whose surfaces have passed through each other by more than a tenth
   of a voxel have met, and merge.


   PARAMETERS

   springls_paper_params() has the paper's rules, springls_default_params() what we recommend. Lengths are in voxels. Where
   the columns differ, each member is a switch of its own, so that the effect of one change can be measured.

     symbol     member               meaning                                             default   paper     unit
     d_max      d_max                capsule radius: a place nearer than it is covered   0.5       0.5       voxel
     r          particle_radius      springs rest at 2r                                  0.05      0.05      voxel
     R          neighbor_radius      range of neighbours, d_max + 2r                     0.6       0.6       voxel
                max_neighbors        nearest edges kept a vertex, 1..8                   8         8
                relax_iterations     iterations of Algorithm 1; 0: relax does nothing    1         5
     H          threshold            Fig. 8a                                             TANH      TANH
     W          weight               Fig. 8b                                             LINEAR    LINEAR
     gamma      torque               NORMALIZED eq. 20, PHYSICAL eq. 19                  NORM.     NORM.
     lambda_c   sharpness            of H(lambda_c x)                                    5         5
     kappa_int  kappa_int            internal spring constant, eq. 4                     1.5       0.3
     kappa_ext  kappa_ext            external spring constant, eq. 5                     1         1
     xi         relax_step_length    eq. 17                                              0.2       0.1
     rho        relax_step_rotation  eq. 18                                              0.2       0.1
                cover                1: triangles cover the surface, see COVERAGE        1         0
                relax_same_side      1: neighbours that face the opposite way do not pull 0        0
     (1+eps)    contract_distance    remove beyond this |phi(p)|, (1 + 0.25) d_max       0.625     0.625     voxel
                min_angle            smaller angles are bad                              20        20        degree
                max_angle            larger angles are bad                               160       160       degree
                min_area             smaller triangles are bad                           0.05      0         voxel^2
                reshape              1: a bad triangle is given a good shape; 0: removed 1         0
                merge_distance       of two nearer particles the younger goes; 0: never  0.6       0         voxel
                keep_thin            1: springls of a thin sheet stay                    1         0
     M          resample_period      steps from one resampling to the next: LAZY STEPS   5         5
                resample_last        1: resampling comes after phi has followed          1         0
                split_edge           split when the longest edge exceeds it              2         never (d) voxel
                split_area           or the area exceeds it                              4         3 (p)     voxel^2
                placement            of new springls: COPY, QUADRATIC                    QUADR.    COPY
                band_half_width      phi is a distance within it                         3         3 (p)     voxel
                capture_range        omega is clamped here, eq. 21                       2         2 (d)     voxel
                evolve_iterations    (evolve, rebuild) pairs a step                      0         4
     delta t    evolve_step          eq. 23                                              0.75      0.75 (p)
     epsilon    evolve_width         half-width of the compact delta                     1.5       1.5 (d)   voxel
     lambda     curvature            of eq. 22; positive smooths: see CURVATURE          0         0         voxel
                carry_level_set      1: springls carry phi along                         1         0
                lazy_distance        voxels that springls may be ahead of phi: LAZY STEPS 3.5      0         voxel
                project_level_set    1: near springls phi is their oriented distance     1         0
                nucleate             1: project makes voxels of thin sheets inside       1         0
                fill_from_springls   1: first fill holes among the springls              1         0
                keep_edges           1: sides of a sharp edge are not averaged           1         0
                min_component        smaller bodies and bubbles are joined or removed    1         0         voxel^3
                topology             FREE, PRESERVED                                     FREE      FREE
                contact              MERGE, SEPARATE: see CONTACT                        MERGE     MERGE
                nearest_rule         nearest instead of average correspondence beyond it never     never (d) voxel
                track_iterations     steps of eq. 26 towards the original surface        4         4
     lambda     track_step           of eq. 26                                           0.5       0.5
                vertex_velocity      1: every vertex has its own velocity, unlike eq. 2  1         0
                half_time_sampling   1: RK4 samples half a step, as the author's program 0         0
                volume_lock          1: see VOLUME LOCK                                  0         0
                components           1: see EVENTS                                       0         0
                contouring           LEVEL_SET, SPRINGLS: see CONTOURING                 LEVEL_S.  LEVEL_S.
                split_input          1: a mesh's large triangles are divided, tiny ones  1         0
                                     thinned out
                initial_stride       marching cubes on every n-th voxel                  1         2 (p)
                project_initial      1: initial springls are moved onto the zero level   1         1 (d)

   (p) not in the paper's text, or other than there: the value of the author's program. (d) see DEVIATIONS.


   LAZY STEPS

   With lazy_distance > 0 a step or sub-step of SPRINGLS_MODE_FLUID may be lazy: it only advects. It is lazy if springls are near
   the place where phi last followed, and would still be after one more step like it. Summed over the steps since then,

     - the largest displacements are at most lazy_distance, and at most band_half_width + 0.5 voxel, beyond which phi is not known
       well enough; in models with thin sheets or gaps, whose sides may move against each other, at most 0.15 voxel;
     - springls turn or stretch by at most 0.18: the largest displacement of a vertex relative to its particle, as a share of
       their distance.

   The step after the last lazy one is whole: phi follows, and the other stages run as in the table of DATA FLOW. With
   resample_last = 1 it counts as several of resample_period where springls have moved far since phi last followed: one for each
   two voxels, rounded, so that three voxels still count as one. So the default set resamples after about ten voxels.

   Where max_displacement cuts a step into sub-steps these are equal parts of the largest distance above, unless they would be
   shorter than three quarters of max_displacement, or springls turn too much in two of them. When a step with max_displacement is
   so much longer than those before it that phi could not be carried along, phi follows first.

     - Phi is never seen behind: every call that reads the level set makes it follow first. The first such call after a lazy step
       takes the time of project, and memory for a second phi. Springls, and views of springls, stay as they are.
     - Reading changes nothing that comes later: the next step goes on from the phi that the steps have left, and so do
       springls_snapshot and springls_state_hash. Calls that change the model make phi follow for good.
     - Every step is a whole one with a pressure, curvature_weight, stop_at_topology, volume_lock, components, contact SEPARATE,
       topology PRESERVED, evolve_iterations or curvature. Steps in which nothing moves, or after springls_write or a stage called
       alone, are whole too. Where force callbacks read the level set, set lazy_distance = 0.
     - The results are those of steps as long as lazy_distance: changes of phi in between, as when two bodies touch and part
       again, are lost.


   UNITS

     world units         shapes, meshes, distances, queries, chunks, components, events, measures, error estimates; forces, their regions
                         and samples, springls_max_speed, curvature_weight; springls_offset and _smooth; velocity, pressure, region, tension
                         and held volumes of springls_tiling_step_desc
     voxels on request   the same of forces and of springls_tiling_step_desc, with voxel_units: batches, velocities, pressures, regions
     voxels              springls themselves: views, springls_write, springls_set_springls, springls_pack_matrix; dense volumes and phi.
                         They are the arrays of the model, shown without a copy: springls_to_world and springls_to_voxel convert
     voxels              what tells how finely a motion or a mesh is made up, and scales with the grid: springls_params,
                         max_displacement, rest_displacement, reach and tolerance of springls_follow_desc, tolerance of
                         springls_chunks_desc, rupture_thickness, gaps of springls_tiling_report, largest_displacement of springls_stats
     smallest spacings   volume_correction of springls_stats, correction of springls_component, errors of springls_lod

   On a grid with spacing 1, origin 0 and no direction both are the same, to the bit.


   CURVATURE

   Curvature is div(n): the sum of the two principal curvatures of phi's level, 2/R for a ball of radius R. Two
   numbers smooth by it:

     springls_forces.curvature_weight  a force, world unit^2 a unit of time (voxel^2 with voxel_units), with either set. A ball
                                       of radius R has the radius sqrt(R^2 - 4 weight t) after the time t
     params.curvature                  lambda of eq. 22, voxel. It acts in every step or sub-step, however long dt is.
       carry_level_set = 1             Springls and phi move by evolve_step lambda times the curvature, and at most by half of
                                       max_displacement. A ball has the radius sqrt(R^2 - 4 evolve_step lambda n) after n steps
       carry_level_set = 0             Only phi moves. If no springl is near, each iteration of eq. 23 moves it by evolve_step
                                       lambda times the curvature; near springls it comes to rest lambda times the curvature
                                       away from them

   Steps are stable while weight times dt is below about one voxel^2.

   Where voxels are longer along one axis, or axes are oblique, curvature is that of the world, and "voxel" above is the smallest
   spacing: balls stay balls. springls_smooth, _offset and volume_lock, distances,
   gradients, closest points, rays, volumes, areas and error estimates are those of the world too, on every grid. Lengths that
   parameters give (the band, split sizes, topology) are voxels: features have to be as wide as the longest of them.


   COVERAGE

   With cover = 1 springls cover the surface once: relax ends by giving every springl a triangle 1.04 times as large as its
   share of the surface. The share is the part of its tangent plane that is nearer to its particle than to those of its
   neighbours: its Voronoi cell. The triangle has the centroid and the elongation of the cell, and its corners where the cell
   has them, in the gaps between neighbours. A paraboloid is fitted to the neighbours' particles: the triangle is turned by its
   slopes, by 0.15 at most, and not beside sharp edges, and where the surface is bent its plane lies halfway between the
   particle and the surface at the corners, at most 0.1 voxel from the particle. So the particle is near the middle of its
   triangle and not in it; the normal is that of the triangle. kappa_int has no effect; the springs turn a triangle, and do not
   size it. Meanwhile the triangle is equilateral about its particle with arms of 0.45 voxel: longer ones would round creases
   off. Springls of the keep mask keep their triangles. On resampling steps, and in every step of SPRINGLS_MODE_ELASTIC, shares
   are measured at the end, after springls have been added and removed; in between triangles flow with the surface. A triangle's
   edges stay below split_edge: where springls are further apart, fill_gaps adds some.

   springls_measures.coverage is the springls' area over the zero level's, about 1.06 from the first resampling on (without
   cover about 0.3). Of the zero level 87 to 91 % lie within a tenth of a voxel of a springl that faces the same way, and
   13 % of two such springls (examples leveque and zalesak, 64^3 and 128^3 voxels; docs/coverage.md). Triangles about scattered
   particles leave gaps: for a closed surface take springls_extract_mesh. Where a sheet is about as thin as a voxel the zero level is off
   the surface, and less of it is covered; where it is islands the coverage is higher, and on boxes of a few voxels, where
   corners of triangles stick out beyond edges.


   SHARP EDGES

   With keep_edges = 1 a sharp edge of the model that was set stays sharp. An edge is where the springls around a place fall
   into sides: groups whose normals are 50 degrees or more apart (in voxels, and in the world), each a patch and not a strip, with
   almost no springl between them. Rims of thin sheets, and rounded edges with a radius of a voxel or more, are smooth surfaces.

   Edges are looked for when a model is set: by springls_set_mesh, and from level sets with project_initial = 1. They are
   not looked for by springls_set_springls, nor when the switch is turned on later.

   At an edge phi is the larger (convex) or smaller (concave) of the heights above the sides. Beyond a convex edge that is
   less than the distance, by up to 29 % at a right angle. Marching cubes still cuts edges off between voxels: the extracted
   mesh is as sharp as the distance of the exact shape, sampled at voxels, would make it. springls_stats.at_edges counts the
   springls at edges.


   CONTOURING

   The watertight surface of params.contouring = SPRINGLS_CONTOURING_LEVEL_SET is the zero level of phi, by marching cubes. It rounds edges
   off, serrates rims, and loses sheets thinner than a voxel or two, while springls hold all of these.

   With SPRINGLS_CONTOURING_SPRINGLS springls_extract_mesh, _chunks, _measure, _closest, _raycast and _sample_inside show what springls
   hold. Their planes are intersected with the lines of the grid; along each line the cheapest sequence of in and out explains where they
   meet it, and phi decides where there are no springls. An edge of the grid may be crossed several times, so that a sheet may be thinner
   than a voxel. In faces and cells of the grid the surface gets corners where springls differ by more than 37 degrees. The mesh is

     - closed, also at the border of the grid, and oriented; each vertex has one fan of triangles; no triangles of a cell cross each other,
       and those of different cells cannot. Where springls contradict each other it may have specks and handles;
     - sharp: a turned box of 10 to 18 voxels has its area to .02 %, and 99 % of its edges (marching cubes: -5 %, none);
     - whole: LeVeque's sheet at half time (64^3 voxels, T = 3) has one part and -.4 % of its volume (4 parts, -13 %); plates of 2 to .1
       voxels are one body with .1 to 1.4 % less than their volume. Their rims are off by .1 voxel in the mean, by up to .8.

   Changing contouring alone by springls_set_params changes nothing of the model. Normals of vertices are those of springls, between the
   sides at corners; correspondences and springls are of the side of a sheet that the vertex is on. The mesh is made on the host, with an
   OpenCL device from a copy of the model, and kept until the model changes. It takes some 1.3 times as long as that of the zero level, and
   until springls_destroy some 8 KB for each brick that is active or beside one. springls_closest, springls_raycast and
   springls_sample_inside follow the same mesh, of which a call with few of them makes no more than it needs: of a ball of 17,600 springls a
   pick takes 2.5 ms. springls_chunks cut it by bricks: a published vertex stays until its edge, face or cell of the grid has it more than
   half the tolerance away, and only chunks with other triangles or with vertices that moved are listed. An update makes the mesh again
   where springls or phi are not as published, by half the tolerance, and keeps the rest: so no vertex is further than the tolerance from
   the mesh. Where that is more than a third, or the tolerance is negative, it makes the whole mesh. On the same ball all takes some 50 ms,
   and a brush about 7 (.5 for the zero level, which a consumer can ask for: springls_chunks_desc.zero_level). For that a consumer has a
   copy of its mesh, 32 bytes a springl twice, and .7 KB a brick twice.

   So do components, events and volume_lock. A component is what a connected part of the mesh bounds: sheets below a voxel are bodies, and
   two bodies stay two while springls hold the gap between them. With components or volume_lock each sub-step makes the mesh once at its
   end, with volume_lock once more for each correction. There a change of contouring ends the step in progress, and components are found
   anew. Distances are those of phi with either value: they miss a sheet that is too thin for phi. min_component and contact use phi too,
   since they change the model.


   LEVELS OF DETAIL

   springls_chunks_lod finds triangles for chunks that are further away, with half, a quarter or an eighth of the resolution: index buffers
   over the vertices that a chunk has. A vertex buffer with normals, correspondences, ids and attributes serves all levels.

     level   edges, voxels   error, voxels   triangles of a wavy surface
       1     up to 3         up to .25       21 %
       2     up to 6         up to .5         8 %
       3     up to 12        up to 1          5 %

   errors are of the chunk's vertices, in the smallest spacing, and springls_lod has those of each chunk. Draw a chunk at the highest level
   whose error is less than half a pixel at its distance. Correspondences off by springls_lod.material_error move a texture by as much.

   Two chunks thin out their common border by the finer one of their levels and by the places of its vertices alone. So both find the same
   edges, whatever the levels are, and there are no cracks: every side of a triangle has one that runs the other way. Where a chunk
   changes its level, ask again for the neighbors whose common border becomes finer or coarser by that; a chunk at level 0 stays as it is.
   An update that changes a border lists the chunks on both sides.


   MOTION FROM OUTSIDE

   Springls need no field to move. A solver that has its own points (masses and springs, finite elements, a skeleton) finds a
   springl's point by the springl's index, id or attribute, never by its place, in one of two ways:

     springls_write         puts springls where the solver has them, between two steps. The next step makes phi follow; a
                            springls_step_desc of zeros does that, relaxes and resamples, and no more
     springls_forces        *_batch callbacks evaluate velocities, pressures and affine maps of springls whose indices and ids
                            they are given; a step divides itself by max_displacement

   Splits, fills and removals give springls other indices at every resampling, but ids last; springls_get_provenance has the
   parent of a new springl. The simplest way is an attribute with the policies COPY that holds the number of the solver's point:
   new springls take it from the springl they were split from or added beside (examples/soft_body.c).

   springls_set_springls takes springls that a solver has made; springls_set_reference_mesh gives them an original surface.


   ATTRIBUTES

   springls_add_attribute gives every springl some floats under a name. They follow through splits, fills and merges by the
   policies of its springls_attribute_desc: COPY for labels, BLEND for continuous values, SHARE for amounts. For colours,
   weights and the like take BLEND for split and fill and COPY for merge: of two springls that merge the elder keeps its place
   and correspondence, to which such values belong.

   Blending uses weights that are not negative and add up to 1: values stay in their range, and channels that sum to 1 (bone
   weights) still do. Each interpolation smooths a function that curves over the original surface a little.

   A function of the mesh that was set need not be carried. springls_mesh_materials finds where on that mesh the vertices of
   an extracted mesh lie; springls_corner_materials finds the same for corners, on one side of every seam of texture
   coordinates; springls_interpolate_material takes the values from there. No number of steps wears them off.

   springls_set_mesh makes several springls of a triangle much larger than a voxel (split_input = 1). springls_springl_materials
   finds the triangle, and the place in it, that each springl comes from: that is how values of triangles or vertices become an
   attribute.

   springls_get_provenance reports of each springl whether it is original, split or filled, and its age. Without attributes
   nothing is computed for them; with them the model has the same bits. With a backend they live on the host, which reads the
   springls that it needs at each resampling. springls_combine, _combine_implicit, _offset, _smooth and _remesh keep
   attributes as they keep springls.


   CONTACT

   With contact = MERGE bodies that touch become one, as in every level set; surfaces inside the union are removed. With SEPARATE
   each body keeps its surface, for fingers that touch, folds, and bodies that are pressed together and come apart:

     - Bodies are the components of the inside as they are in the first step with the switch: a body that touches itself merges.
       springls_combine adds those of the other model. New springls are of the body that they come from.
     - Springls of two bodies do not pull, bury, merge or fill each other. Those that lie in another body stay, but have no
       part in phi: while bodies overlap, phi, meshes, measures and volume_lock are those of their union.
     - Drawn apart, bodies are as they were. Nothing keeps them from passing through each other: that is up to the forces, which
       can distinguish bodies by springl (springls_batch) or by correspondence.
     - Components (EVENTS) are those of the union: while bodies overlap they are one, and one of them has a new id when they part.
       Correspondences and attributes distinguish bodies for good.
     - The topology within a body stays free. One that splits is still one body, and its parts merge when they meet.

   The library notices that a springl lies in another body when the springl passes the surface of that body. So no step may move a
   springl by more than two voxels. Up to two voxels, long steps press bodies together and draw them apart as short steps do.


   REST

   Work follows motion. A springl stirs when a point of it moves by more than 0.001 voxel, and when it is added or removed.
   Bricks of 8 x 8 x 8 voxels fall asleep when none has stirred in them, or in the 26 around, for resample_period + 1 steps.
   Those of a closed mesh are asleep from the start.
   Steps of SPRINGLS_MODE_FLUID leave the springls in bricks that are asleep, and phi there, as they are, to the bit; when all
   sleep and nothing moves, a step ends after advect. While a brick is awake, springls at rest go on turning as they relax, which moves
   phi to and fro by about 0.02 voxel: by so much a model that sleeps may differ from a model that is kept awake.

     - A springl that stirs in a brick or beside it wakes the brick; springls_combine and
       springls_follow_level_set wake those that they change, and complete these alone.
       springls_set_params, stages that are called alone, inputs and the other tools wake all.
     - A tool that acts in one place states its box in springls_forces.region_lower and _upper, in the units of the forces:
       springls outside are not visited.
     - Nothing sleeps with evolve_iterations > 0, carry_level_set = 0 or volume_lock = 1.
     - A model just set from a level set or a function is awake: springls_settle brings it to rest, springls_at_rest tells.


   EVENTS

   With components = 1 (or volume_lock = 1) the components of the model are followed: bodies, each connected inside the watertight
   surface (CONTOURING), and cavities, each connected outside and enclosed by a body. springls_components lists them with volume, area and
   centroid; springls_events lists what has happened to them in the last step, and in calls since the step before: births, splits,
   mergers and deaths, with the components before and after and the place where they met or parted.

     - Ids last. The largest part of a split keeps the id, and a merger has that of its largest part; other parts get new ids,
       which are never used again. A component that splits and merges in one step gets ids as if it had split a step before.
     - `build/soft_body --events` prints the events of a bar that is drawn out and tears.
     - Springls link a component before to a component after: the two are linked if they share at least a tenth of the springls of
       one of them, and at least three springls or more than half. A component without a link to the past is born; a component
       without a link to the present has died.
     - springls_component_ids has the body of each springl, springls_component_of that of any place: of vertices, chunks, rays.
     - Components are found at the end of a sub-step, on the host, in about the time of one stage; without the switch nothing is
       computed. With it no step is lazy; otherwise it changes no bit of the model. Snapshots hold components and
       events.
     - SPRINGLS_MODE_ADVECT_ONLY keeps the level set, and so its components; with SPRINGLS_CONTOURING_SPRINGLS components follow the
       springls.


   ERRORS OF PLACE

   springls_springl_errors estimates two errors of each springl: how far its particle is from where the motion takes its
   correspondence, and how far its correspondence is from where the particle has come from. springls_mesh_errors does the same
   for vertices. A springl that is split off or filled in gets an error from the standard error of a quadratic fit there, the
   distance from the fit, and the errors of the springls that it was made from. Every step adds errors of integration and of
   rounding; original springls have no others. For the error of integration the flow at each particle is evaluated twice more, at
   the end and in the middle of the cubic through both ends of the step: Simpson's rule along it shows how far the Runge-Kutta
   method was off. Pressure, curvature and affine maps are not evaluated again.

   The estimate is larger than the error for at least 95 % of the springls, and of the vertices of the zero level, on LeVeque's
   flow and on the motions of `make motions`, which lists these shares. The median of estimate over error is 1 to 30, and more
   where motion runs backwards and errors of integration cancel. A springl with too few neighbours for a fit gets an estimate
   of 6 voxels or more; beside a tear it may be off by more. With the paper's parameters splits copy correspondences, and
   estimates are about half a voxel.


   VOLUME LOCK

   With volume_lock = 1 each component of the model keeps the volume that it had before the first step with the switch on.
   At the end of every step of SPRINGLS_MODE_FLUID and SPRINGLS_MODE_ELASTIC the springls and phi of a component move along
   their normals by one small distance; its volume (of its watertight surface, as springls_measure computes it) is then right to
   about 1 part in 10^6; with SPRINGLS_CONTOURING_SPRINGLS of a ball to 1 in 10^5, of a plate of half a voxel to 1 in 10^3.

     - When components merge, their volumes add up; when one splits, its parts share its volume in proportion to their own.
     - A component that appears from nothing keeps the volume that it appears with.
     - Parts of less than 10 voxels count as belonging to the largest component; a model of such parts alone is not locked.
     - Forces that should grow or shrink the model have no effect on its volume: the switch is not for active contours.
     - It hides a loss of volume and improves nothing else. It is off in every figure that we report.
     - springls_component.correction is the distance by which a component moved, springls_stats.volume_correction the largest.
     - It takes 12 bytes a voxel of active bricks and 4 bytes an entry of the table of bricks (MEMORY).


   MEMORY

   All memory comes from desc.allocator, or malloc, and is allocated only on the thread that called the library. phi and omega
   live in bricks of 8 x 8 x 8 voxels that exist only near the surface, so memory grows with the area of the surface; two
   tables, of the model and of the original, have one int a brick of the box around a body. The size of the grid costs nothing:
   a small ball takes as much in 4096^3 voxels as in 256^3, and two of them at opposite corners no more than two near to each
   other. A body that is 2000 voxels wide along each axis takes 64 MiB a table. The table of several bodies is along each axis
   at most as long as the sum of their widths, and never longer than the box around all. Dense inputs need a byte and an int for
   each brick of the grid while they are set. springls_memory_used returns the bytes held. Buffers grow and are reused;
   springls_reset keeps them, springls_destroy returns them.

   A surface has about one springl for each voxel^2 of its area, up to 1.4 where it is folded, whatever a flow does to it: a flow
   that stretches it tenfold makes ten times as many. Folded until it fills the grid it has one to two a voxel: some 40 thousand
   in 32^3. springls_desc.max_springls is the bound that holds always.

   Views (springls_view_*, springls_ids) belong to the context, until the next call that changes the model. A springls_mesh
   belongs to the caller, who frees it by springls_mesh_free. Arrays that are passed in are borrowed during the call.


   MANY BODIES

   springls_tiling holds bodies that fill a space without gap or overlap, such as cells, organs of an atlas or bubbles. Each has a label,
   and label 0 is what is around them. Set them by a label map (springls_tiling_set_labels), or one by one
   (springls_tiling_add_implicit, _add_mesh).

     each body      is an ordinary model, springls_tiling_body(tiling, label): springls, correspondences, attributes, meshes. Label 0's
                    is that of all bodies together, whose outside is label 0
     a place        has the label of the body whose signed distance is lowest there, so exactly one: springls_tiling_sample_labels
     a wall         is two sheets of springls, one of each body. Every springl faces a label, which callbacks get beside its own
     all walls      as one mesh, two labels a triangle, with the edges where three or more meet: springls_tiling_extract. The closest
                    place of a wall to a point: springls_tiling_closest_wall
     attributes     are each body's own, added to springls_tiling_body(tiling, label): they follow its springls, springls that come from
                    the other side of a wall get them as fills do, and bodies that join keep those of the same names

   springls_tiling_step moves each body by itself, and then sees to the walls:

     mirror         on every 8th step: where one side of a wall has a springl and the other none, the other gets that springl, turned
                    round and with its correspondence, which lies on the first body's original surface; attributes follow the
                    policy for fills
     half way       sheets that are more than 0.15 voxel apart, or have passed each other by that, meet half way
     contact        bodies that grow into each other face each other from then on; with film, before: what is between them, of label 0,
                    breaks where it is as thin as the caller says for each pair
     joining        bodies that share a wall become one where film says so, or by springls_tiling_join
     neighbours     pairs that have come to share a wall, or do so no more, are reported: the T1 changes of a foam
     vanishing      a body of which no voxel is left is removed, though it has thin sheets still, and reported
     failures       of memory too, leave the tiling as it was before the step. For that a step keeps a copy of the bodies, which takes
                    about a third of the memory that they hold
     memory         in which stages work is freed as soon as a body has made its step: there is as much of it as threads need, however
                    many bodies there are

   Callbacks are asked for both sides of a wall: give both the same velocity, and pressures of opposite sign. Two sheets are twice as many
   springls as one: the halves of a ball take about four times as long as the ball. Bodies are worked on side by side with tasks.

   With tension the walls become films: the vertices of their mesh go down the slope of tension times area, so that within a wall they move
   by its mean curvature, and lines where walls meet by the pull of all of them; tension_of gives each pair of labels its own. held keeps
   volumes, by the pressures that this takes, or lets bodies grow to a target. Bubbles come to rest at the angles of Plateau's laws. A wall
   that has shrunk to a line where four meet gives way to one between the two others (a T1 change), where that is shorter. Both
   make the mesh anew in every step. Tension is in squared world units: a dt of 0.5 spacing^2 / tension is stable.

   Bodies rest as models do (REST). A body whose model sleeps, where closing and looking at its walls has changed nothing in 8 steps, costs
   next to nothing until a force acts on it or springls of it are changed by hand, or something moves beside it: so a step costs as much as
   the bodies where something happens, and that of label 0. Forces that act in one place state its box (region_lower, region_upper). A body
   is put to rest as it is, and its walls are no longer closed, after 256 steps without forces on it or on bodies beside it, or since one of
   them was last changed by hand, where models may sleep: at lines where walls meet some would add springls and remove them again for
   ever. springls_tiling_snapshot writes all bodies as one block, which
   springls_tiling_restore reads.

   With a backend each body makes its own step on the device, one body after the other, and the walls are the host's: for a few large
   bodies rather than many.

   Not there yet: windows and combinations of whole tilings.


   A WORLD WITHOUT WALLS

   With springls_desc.follow the grid is a window that moves with its model, as the floating origin of a game does. When the
   advect of a step brings a springl nearer than 16 voxels to the border, the window moves by whole bricks of 8^3 voxels so
   that the model's box is in its middle. springls_window_offset returns how far it has come.

     - World coordinates do not change: shapes, meshes, queries, events and forces are where they were. Far from
       the origin a float has few digits; voxel coordinates (views, springls_write) keep theirs.
     - Forces with voxel_units get lattice coordinates: voxel coordinates plus the offset. So flows stay where they are.
       Their regions are on the lattice too, as are samples of the model's own grid with all forces.
     - Chunks are named by bricks of the lattice. All are meshed again after a move.
     - Correspondences and the original surface stay in the window that they were set in: where the model has come from.
     - Snapshots hold the place of the window. An input and springls_reset put it back, to springls_desc.window.
     - springls_combine takes models in different windows of one lattice; a union has to fit in one window.

   Rounding: a coordinate that a move makes smaller keeps all its bits. One that becomes larger is rounded to a float of that
   size, by at most 2^-24 of the window's width: as much as one addition of a wind, and once in at least eight voxels. Nothing else
   depends on how far the model has come: a ball whose coordinates are multiples of 2^-12 has the same bits in its window after
   10,000 voxels of a wind of whole voxels (tests/unit/test_window.c).

   The window's sides should be at least 40 voxels longer than the model: the margin on both sides and a brick. A model that is
   less than a brick shorter than the window, or longer, is cut off at its border, as in a grid that stays. springls_stats.left
   counts springls that were removed because they had left the grid. A window moves by at most 2^30 voxels from its place.


   THREADS

   One thread uses a context at a time; different contexts are independent; there is no global state. Inside a call, work is
   divided into ranges that go to desc.tasks.parallel_for, or to OpenMP when compiled with it, or run in the calling thread.
   Force callbacks run on several threads at once, with different batches: they must not write to shared state. Results have the
   same bits for any number of threads.

   A host that has a job system gives it as parallel_for. For others the library has a pool, where the implementation is
   compiled with SPRINGLS_THREADS:

     springls_threads *threads = springls_threads_create(0);  one a processor
     desc.tasks = springls_threads_tasks(threads);
     ...
     springls_threads_destroy(threads);                       after the contexts

     - The caller works too, and waits only for pieces of work that others have begun. A thread that gets no processor
       delays nothing, so a pool may have as many threads as there are processors on a machine with other work.
     - Between loops its threads sleep. Nothing is taken from the processors before a loop is run.
     - One pool serves any number of contexts, and loops that run at the same time in several threads of the host. Each is
       run by its caller, and by those of the pool that have nothing else to do.
     - A task may run a loop of the same pool, a force callback for example: its thread runs it, and those that sleep help.
     - Of count threads as many exist as the system has started: springls_threads_count.
     - Destroy it when no loop runs. A process that was forked has no threads of its parent's: make a pool there.

   OpenMP is for programs that have it anyway. The threads of GCC's OpenMP wait in busy loops, for the next loop and for the last
   of them at the end of each: where other programs run, that can cost many times the work. Set OMP_WAIT_POLICY=passive in the
   environment before such a program starts, or use the pool.


   FRAMES

   springls_step_begin and springls_step_continue run a step in pieces, for a budget of time a frame, with the same bits
   however it is divided. A stage is a table of entries. A step can be left between two entries, and inside the loop that an
   entry ends with:

     advect               over batches of the forces
     relax                over springls: finding neighbours; every iteration; the shares of the surface (cover)
     keep_edges           over springls: every kernel
     contract             over springls: choosing; every round of merging
     resample             over springls: choosing, splitting, storing
     project              over bricks: the projection; the search for parts to join; removal of parts; every sweep that
                          re-distances
     fill_gaps            over springls and bricks: finding holes; finding bare triangles
     evolve, rebuild      over bricks: omega; eq. 23; every sweep
     unsigned_to_signed   over bricks: omega; sides. The growth of the background is one entry for each size of block
     CONTOURING           over springls: hits; over bricks: sides, crossings, arcs, triangles, for an update of chunks

   springls_combine_begin and springls_combine_continue run a combination in the same way:

     combine              over springls: which stay; seams; over bricks: both reference level sets; phi of the result; then as
                          redistance, keep_edges, fill_gaps and project. Hierarchies are built, and the springls and the original
                          triangles of the other taken, in parts

   What an entry does besides its loop is not divided, and a call may take that much longer than its budget: springls are
   sorted into cells, bricks are added and dropped, springls are removed or split, attributes follow, preserved topology is
   checked; with CONTOURING also bricks are listed, hits are put into rows, vertices are gathered, get their normals and are
   compared with those shown. volume_lock and components are one entry each. On a device, entries are enqueued and the host
   continues; a call waits where an entry needs a number from the device.

   A skin for particles: in each frame a step with the fluid's velocity, then springls_follow_level_set with the union of the particles.
   springls_chunks lists which bricks of the surface have changed. springls_snapshot and springls_restore go back to an
   earlier model and continue from it with the same bits; springls_snapshot_delta keeps what a stroke has changed alone, and
   springls_snapshot_patch makes the snapshot again.


   ERRORS

   Calls that can fail return a springls_status: 0 is success, failures are negative. springls_last_error(ctx) returns what
   failed and where. Nothing aborts and nothing is printed; log lines go to desc.logger. After OUT_OF_MEMORY the context can
   be used, but its model may be incomplete: set it again. NON_FINITE from a force leaves the springls as they were. When
   max_springls is reached, new springls are refused and counted in springls_stats.refused: that is no error.


   DETERMINISM

   The same input gives the same bits for every number of threads, every division into ranges and every optimisation level,
   provided the compiler does not fuse a*b+c. GCC and clang obey pragmas in this header; other compilers, and clang with
   -ffp-contract=fast, need -ffp-contract=off. Flags that let the compiler change arithmetic (-ffast-math, -Ofast) end at the
   implementation with GCC; with clang, and other compilers, they break the promise. Whatever the flags, an input that is not
   finite is refused. springls_fp_contract_detected() reports a build that breaks it; springls_state_hash() compares states.
   Threads of yours that flush denormal numbers to zero (FTZ, DAZ) change no bit. In two cases the implementation does not compile,
   with one error that gives the reason: on the x87 unit, which does not round as C does (-msse2 -mfpmath=sse is needed), and with
   tcc, which miscompiles functions that return structs of three floats.
   Transcendental functions that the state depends on are the library's own. Force callbacks must be deterministic too.


   LIMITS

     - The grid has 4 to 4096 voxels a side and does not grow. The model is closed at the border of the grid.
     - Sheets thinner than about a voxel have no watertight zero level, though the default set keeps their springls (see
       DATA FLOW). Filaments of that thickness break. A sheet that runs askew with the unit normal n has voxels inside without
       a gap between them only if it is |n.x| + |n.y| + |n.z| voxels thick, at most 1.73: one of 1.2 may have hundreds of
       handles from springls_set_implicit on. Choose the grid so that the sheets that matter are two voxels thick.
     - A vertex has at most 8 neighbour edges (section 4.8).
     - Everything inside is float32, in voxel units.
     - OpenCL has a header of its own, springls_cl.h. springls_kernel_source() has the kernels' text for other hosts.


   DEVIATIONS of springls_paper_params() from the paper

     - omega is clamped at 2 voxels (capture_range), not at d_max (eq. 21): with d_max phi feels no force where it has
       fallen half a voxel behind, and never catches up.
     - Springls are split when their area exceeds 3 voxel^2, as Table 2 and the author's program do; section 4.6 prints a
       longest edge of 1.5 voxels, which makes about ten times as many springls as the paper counts.
     - Initial springls of a level set come from marching cubes on every second voxel, as in the author's program. They are
       moved to straddle the zero level: chords that all lie inside it would cost half a percent of the volume.
     - A filled springl always takes the average of its neighbours' correspondences, as in the author's program. Section 4.7
       takes the nearest one when it is more than 2 voxels from the average; that nearly doubles the tracking error of
       LeVeque's test (nearest_rule = 2).
     - A vertex's neighbours are its nearest edges, found at a resampling and kept until the next one. The closest points on
       those edges are found again in every iteration.
     - contract judges a particle by phi as it was before the step's advect, when phi and springls agreed. After a step as
       long as d_max a good springl is further than contract_distance from the old zero level. SPRINGLS_STAGE_CONTRACT, run
       alone, takes phi as it is.
     - The compact delta of eq. 23 has the half-width 1.5 voxels, and the data term is -grad(omega^2)/2, which is smooth at
       the surface.
     - Runge-Kutta stages sample the time of their stage. The author's program spans half a step: half_time_sampling.
     - stop_at_topology holds a springl back where phi falls along a motion with its normal, or grows along one against it.
       Eq. 24 as printed takes grad phi . n for the direction of the motion: it would hold every springl that moves inward,
       and none that runs outward into another sheet. Motions of less than 0.05 voxel along the normal, or more along the
       surface than along the normal, are free.
     - Signs: in eq. 23 as printed springls repel phi and curvature sharpens. Here springls attract and positive curvature
       smooths, as gradient descent on eq. 22 does. The term omega^2/2 times curvature is dropped.
     - rebuild finds distances with sub-voxel accuracy at the interface, instead of counting layers of voxels.


   MAP from the paper to functions and files

     eq. 1, 2           springls_advect, springls_forces
     eq. 3-20, Alg. 1   SPRINGLS_STAGE_RELAX (kernels_embed/stages/relax.h)
     eq. 21             omega, inside SPRINGLS_STAGE_EVOLVE (kernels_embed/stages/unsigned_distance.h)
     eq. 22, 23         SPRINGLS_STAGE_EVOLVE
     eq. 24, 25         springls_step_desc.stop_at_topology
     eq. 26             SPRINGLS_STAGE_TRACK
     eq. 27             springls_pack_matrix
     section 2.3.2, 6   springls_extract_surfels
     section 4.1        springls_set_mesh and the other inputs
     section 4.3.1      springls_step turns flipped triangles (src/stages/relax.h)
     section 4.4        SPRINGLS_STAGE_FILL_GAPS (src/stages/fill_gaps.h; fill_from_springls.h beside it is not the paper's)
     section 4.5        SPRINGLS_STAGE_UNSIGNED_TO_SIGNED, params.topology
     section 4.6        SPRINGLS_STAGE_CONTRACT, SPRINGLS_STAGE_RESAMPLE
     section 4.7        SPRINGLS_STAGE_TRACK, springls_hit.material
     section 4.8        springls_max_speed (CFL), one_to_one, springls_set_keep_mask
     section 5.2        springls_implicit_notched_sphere
     Table 2            springls_stage, one a row: springls_advect, springls_run_stage
     Algorithm 2, 3     springls_step, springls_run with SPRINGLS_MODE_FLUID, SPRINGLS_MODE_ELASTIC
*/
