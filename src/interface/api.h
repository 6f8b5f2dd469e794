#ifndef SPRINGLS_H
#define SPRINGLS_H

#include <stddef.h>
#include <stdint.h>
#if !defined(__cplusplus)
#include <stdbool.h>
#endif

#define SPRINGLS_VERSION_MAJOR 0
#define SPRINGLS_VERSION_MINOR 1
#define SPRINGLS_VERSION_PATCH 0
#define SPRINGLS_VERSION (SPRINGLS_VERSION_MAJOR * 10000 + SPRINGLS_VERSION_MINOR * 100 + SPRINGLS_VERSION_PATCH)

/* Chooses the linkage of every public function: the manual's chapter MACROS lists SPRINGLS_STATIC, SPRINGLS_DLL and
   SPRINGLS_NAMESPACE. */
#ifndef SPRINGLS_API
#if defined(SPRINGLS_STATIC)
#if defined(__GNUC__)
#define SPRINGLS_API __attribute__((__unused__)) static
#else
#define SPRINGLS_API static
#endif
#elif defined(SPRINGLS_DLL) && defined(_WIN32)
#if defined(SPRINGLS_IMPLEMENTATION)
#define SPRINGLS_API __declspec(dllexport)
#else
#define SPRINGLS_API __declspec(dllimport)
#endif
#elif defined(SPRINGLS_DLL) && defined(__GNUC__)
#define SPRINGLS_API __attribute__((__visibility__("default"))) extern
#else
#define SPRINGLS_API extern
#endif
#endif

/* What a program may leave out (manual, MACROS). */
#ifdef SPRINGLS_MINIMAL
#ifndef SPRINGLS_NO_OPENCL
#define SPRINGLS_NO_OPENCL
#endif
#ifndef SPRINGLS_NO_SNAPSHOTS
#define SPRINGLS_NO_SNAPSHOTS
#endif
#ifndef SPRINGLS_NO_CHUNKS
#define SPRINGLS_NO_CHUNKS
#endif
#ifndef SPRINGLS_NO_TOOLS
#define SPRINGLS_NO_TOOLS
#endif
#ifndef SPRINGLS_NO_EVENTS
#define SPRINGLS_NO_EVENTS
#endif
#ifndef SPRINGLS_NO_QUERIES
#define SPRINGLS_NO_QUERIES
#endif
#ifndef SPRINGLS_NO_TILINGS
#define SPRINGLS_NO_TILINGS
#endif
#endif

/* SPRINGLS__NAMESPACE_RENAMES */

#ifdef __cplusplus
extern "C" {
#endif

/* The functions follow by topic; the manual's chapter CORE has the twenty-one to begin with.

   These rules hold for every declaration below; the comments name only what differs.

   - A point or vector is 3 floats, x first. `count` counts points, springls or triangles, not floats.
   - World coordinates are those of the caller. Voxel coordinates are those of the grid: voxel (i,j,k) has its centre at
     (i,j,k). With springls_desc.follow the grid moves, and voxel coordinates with it; lattice coordinates are those of the grid
     where springls_desc.grid has placed it (manual, UNITS, A WORLD WITHOUT WALLS).
   - Dense volumes hold one value a voxel, x fastest: size[0] * size[1] * size[2] values.
   - Arrays that are passed in belong to the caller and are used during the call only. NULL is allowed if the count is 0.
   - Pointers into the context belong to it, and stay valid until the next call that changes the model.
   - With ctx = NULL a function returns INVALID_ARGUMENT, 0 or NULL, or does nothing.
   - Every function that returns a springls_status may return INVALID_ARGUMENT (a NULL that is not allowed, a number out of
     range: the model stays as it was), OUT_OF_MEMORY and, with a backend, DEVICE_FAILED. Comments list the other failures.
   - Equations, sections and tables are those of the paper. */

/* ---- >>status:api ------------------------------------------------------------------------------------------------- */

/* Reports how a call ended: zero is success, every failure is negative. springls_last_error() has the sentence. */
typedef enum springls_status {
    SPRINGLS_OK = 0,
    SPRINGLS_INVALID_ARGUMENT = -1, /* a NULL, a size or number out of range, parameters not made by a *_params() call   */
    SPRINGLS_OUT_OF_MEMORY = -2,    /* the allocator returned NULL; the context is usable, its model may be incomplete   */
    SPRINGLS_BAD_MESH = -3,         /* an index out of range, no triangle with an area or in the grid, or no inside      */
    SPRINGLS_NON_FINITE = -4,       /* a NaN or infinity in the input, or from a force callback                          */
    SPRINGLS_EMPTY_MODEL = -5,      /* there are no springls, or the input has no surface in the grid                    */
    SPRINGLS_CANCELLED = -6,        /* the progress callback returned non-zero: after a step the model is whole, after an
                                       input it is empty                                                                 */
    SPRINGLS_DEVICE_FAILED = -7,    /* the backend's device failed, and the context continues without it. A stage or step
                                       has been completed by scalar code; a mesh, a query or an input has to be requested
                                       again. When the model could not be read back it is empty: springls_last_error()
                                       reports that                                                                      */
    SPRINGLS_BAD_SNAPSHOT = -8      /* springls_restore: damaged, or of another grid or version; the model is unchanged  */
} springls_status;

/* Returns a constant English phrase for any status, never NULL. */
SPRINGLS_API const char *springls_status_string(springls_status status);

/* Returns the SPRINGLS_VERSION that the implementation was compiled with. */
SPRINGLS_API int springls_version(void);

/* Returns the version that the implementation was compiled with as "major.minor.patch". */
SPRINGLS_API const char *springls_version_string(void);

/* ---- >>host:api: what the caller may supply; zero-initialised members mean the default ---------------------------- */

/* Supplies memory. alloc returns at least `size` bytes aligned as malloc's, or NULL; free receives the same size. Both NULL:
   malloc and free. They are called only from the thread that calls the library. */
typedef struct springls_allocator {
    void *(*alloc)(size_t size, void *user);
    void (*free)(void *memory, size_t size, void *user);
    void *user;
} springls_allocator;

/* Does the work of the elements begin <= i < end. */
typedef void (*springls_task)(void *arg, int begin, int end);

/* Supplies threads. parallel_for runs task(arg, begin, end) over disjoint ranges that cover [0, count), in any order, on
   any threads, and returns when all are done; a range of fewer than `grain` elements is not worth a task. NULL: OpenMP when
   compiled with it, else the calling thread. Results do not depend on the ranges. */
typedef struct springls_tasks {
    void (*parallel_for)(void *user, int count, int grain, springls_task task, void *arg);
    void *user;
} springls_tasks;

/* Holds threads for springls_tasks, where the implementation was compiled with SPRINGLS_THREADS (manual, THREADS). */
typedef struct springls_threads springls_threads;

/* Creates a pool in which `count` threads work, the one that calls parallel_for among them: it starts count - 1, at most 255.
   count 0 or less: one a processor of the machine. When the system refuses to start a thread, the pool has those before it.
   NULL: compiled without SPRINGLS_THREADS, no memory, or the system has refused a lock. Its memory comes from calloc. */
SPRINGLS_API springls_threads *springls_threads_create(int count);

/* Ends the threads and frees the pool; NULL is allowed. No loop of it may run any more, and contexts that have it can only be
   destroyed. */
SPRINGLS_API void springls_threads_destroy(springls_threads *threads);

/* Returns how many threads work in a loop of the pool, its caller among them: fewer than springls_threads_create was given where
   the system has refused some. NULL: 1. */
SPRINGLS_API int springls_threads_count(const springls_threads *threads);

/* Returns the pool as springls_desc.tasks takes it, which borrows it; zeros for NULL. Any number of contexts may have the same
   pool, and any threads of the caller's may run loops on it at the same time, of contexts or through parallel_for. A task may run
   a loop of the same pool. A task has to return: no longjmp and no exception. */
SPRINGLS_API springls_tasks springls_threads_tasks(springls_threads *threads);

/* Receives log lines. level: 1 error, 2 warning, 3 information. message is one line, valid during the call. NULL: no
   log. */
typedef struct springls_logger {
    void (*log)(void *user, int level, const char *message);
    void *user;
} springls_logger;

/* Receives the progress of long calls, fraction in [0,1]: after every step of springls_run, and while a mesh or an implicit
   function is sampled (springls_set_mesh, _set_implicit, _combine_implicit, _offset). report returns non-zero to cancel the
   call. */
typedef struct springls_progress {
    int (*report)(void *user, float fraction);
    void *user;
} springls_progress;

/* Traces stages. `stage` is called before (begin = 1, seconds = 0) and after (begin = 0, seconds = the time taken) every
   stage; its number is a springls_stage. `now` returns a time in seconds; NULL: the wall clock when compiled with OpenMP or
   SPRINGLS_THREADS, else the C library's clock(), which counts the processor time of all threads. */
typedef struct springls_trace {
    void (*stage)(void *user, int stage, int begin, double seconds);
    double (*now)(void *user);
    void *user;
} springls_trace;

/* ---- >>parameters:api ----------------------------------------------------------------------------------------- */

#include "../../kernels_embed/interface/parameters.h"

/* Returns the recommended parameters: accurate tracking, free topology and long steps. */
SPRINGLS_API springls_params springls_default_params(void);

/* Returns the paper's rules and constants (eq. 1-26, Table 1). The manual's chapter DEVIATIONS lists what differs from the
   print. */
SPRINGLS_API springls_params springls_paper_params(void);

/* ---- >>life_cycle:api ----------------------------------------------------------------------------------------- */

/* Holds one model, its memory and its parameters. */
typedef struct springls_context springls_context;

/* Places the voxel grid in the world: voxel (i,j,k) has its centre at origin + direction * (spacing .* (i,j,k)). The domain
   ends half a voxel beyond the outermost centres. */
typedef struct springls_grid_desc {
    int size[3];         /* voxels, 4..4096 a side                                                                  */
    double spacing[3];   /* world units a voxel; all zero: 1                                                        */
    double origin[3];    /* world position of voxel (0,0,0)                                                         */
    double direction[9]; /* row-major, its columns are the unit vectors of the grid's axes; all zero: identity      */
} springls_grid_desc;

/* Runs stages on a device; made by springls_cl_create of springls_cl.h. One backend may serve several contexts of one
   thread, and must be destroyed after them. */
typedef struct springls_backend springls_backend;

/* Describes a context to be created. Zero all of it and set grid.size; every other member may stay zero. */
typedef struct springls_desc {
    springls_grid_desc grid;
    const springls_params *params; /* copied; NULL: springls_default_params()                                       */
    int max_springls;              /* more are refused and counted in springls_stats.refused; springls_set_springls and
                                      springls_combine fail, springls_set_mesh takes any number of triangles, but
                                      divides no more when there are so many. 0: 64,000,000                         */
    springls_allocator allocator;
    springls_tasks tasks;
    springls_logger logger;
    springls_progress progress;
    springls_trace trace;
    springls_backend *backend;     /* NULL: stages run as scalar code, on `tasks`                                   */
    bool follow;                   /* the grid is a window that moves with the model, by whole bricks of 8^3 voxels
                                      (manual, A WORLD WITHOUT WALLS); grid.size has to be multiples of 8           */
    int window[3];                 /* voxels from the place of `grid` to where the window is after an input and
                                      springls_reset, multiples of 8 up to 2^30; 0: at its place. Not 0: grid.size
                                      has to be multiples of 8. With springls_window_offset of another model it makes
                                      one beside that, on the same lattice, as springls_combine needs                */
} springls_desc;

/* Returns a description with all defaults filled in but grid.size. A zeroed one with grid.size means the same. */
SPRINGLS_API springls_desc springls_default_desc(void);

/* Creates a context with an empty model. On failure *out is NULL, nothing is left allocated, the logger has the reason, and
   springls_create_error returns it. One thread uses a context at a time; different contexts are independent. */
SPRINGLS_API springls_status springls_create(const springls_desc *desc, springls_context **out);

/* Returns why springls_create refuses a description: a constant sentence that names the member; "" when it does not: then only
   memory can be missing. NULL counts as a description that is refused. */
SPRINGLS_API const char *springls_create_error(const springls_desc *desc);

/* Frees the context and all that belongs to it; NULL is allowed. */
SPRINGLS_API void springls_destroy(springls_context *ctx);

/* Empties the model and removes its attributes; keeps memory and parameters, sets the time to 0, and puts a grid that has moved
   back to its place. */
SPRINGLS_API springls_status springls_reset(springls_context *ctx);

/* Returns the sentence of the context's last failure, "" after none; it belongs to the context. ctx NULL: "no context". */
SPRINGLS_API const char *springls_last_error(const springls_context *ctx);

/* Returns the parameters in use; ctx NULL: the default ones. */
SPRINGLS_API springls_params springls_get_params(const springls_context *ctx);

/* Replaces the parameters, between any two calls; band_half_width only while the model is empty. INVALID_ARGUMENT: a member
   is out of range, springls_last_error() names it, and nothing changes. */
SPRINGLS_API springls_status springls_set_params(springls_context *ctx, const springls_params *params);

/* Writes where the grid is now (springls_desc.follow): how many voxels it has moved from where springls_desc.grid placed it. This
   added to voxel coordinates gives lattice coordinates, which no move changes. Zeros: it has not moved, or ctx is NULL. `offset`
   may be NULL. */
SPRINGLS_API void springls_window_offset(const springls_context *ctx, int offset[3]);

/* Converts `count` points from world to voxel coordinates; `world` and `voxel` may be the same array. */
SPRINGLS_API void springls_to_voxel(const springls_context *ctx, const float *world, int count, float *voxel);

/* Converts `count` points from voxel to world coordinates; `voxel` and `world` may be the same array. */
SPRINGLS_API void springls_to_world(const springls_context *ctx, const float *voxel, int count, float *world);

/* Returns how many bytes the context holds from its allocator. */
SPRINGLS_API size_t springls_memory_used(const springls_context *ctx);

/* ---- >>input:api: each call replaces the model and makes it the original surface: a_n = p_n, phi_ref = phi -------- */

/* An input removes all attributes, sets the time to 0 and puts a grid that has moved back to where springls_desc.grid places it.
   One that fails after its arguments were found good leaves the model as it was, or empty. springls_set_reference,
   _set_reference_mesh, _set_keep_mask and springls_write change the model that is there. */

/* Reports what springls_set_mesh found. All members but triangles_dropped and springls describe the input after equal points
   were welded and repeated triangles dropped. */
typedef struct springls_mesh_report {
    int triangles_dropped;   /* without an area, with a repeated corner, or with the corners of another triangle    */
    int boundary_edges;      /* edges of one triangle: the surface is open there                                    */
    int nonmanifold_edges;   /* edges of three or more triangles                                                    */
    int misoriented_edges;   /* edges along which both triangles run in the same direction                          */
    int components;          /* parts that share no point                                                           */
    bool closed;             /* there is no boundary, non-manifold or misoriented edge                              */
    bool flipped;            /* the input was inside out as a whole and has been turned                             */
    int parts_turned;        /* patches of triangles that hang together by edges, turned to face outwards           */
    int parts_nested;        /* closed patches within another one: hollows, and solids within a solid               */
    bool used_winding;       /* not closed: inside is where the generalised winding number exceeds one half         */
    double volume, area;     /* world units; volume is negative for a mesh that is inside out                       */
    int springls;            /* made of triangles and their parts, and of the film that closes holes                */
} springls_mesh_report;

/* Sets the model from a triangle mesh (section 4.1). A triangle with an area becomes a springl. With params.split_input = 1
   a triangle with an edge longer than split_edge becomes several: it is cut from the middle of its longest edge, and its
   parts again, narrow ones in strips, alike on both sides of every edge and only within the grid. Where closed parts of the
   mesh overlap, springls inside the solid are not set (a seam on voxel planes may keep a small handle). Springls are
   in the order of the triangles. With split_input = 1 triangles far below a voxel (more than 32 corners in half a voxel) are
   thinned out to a quarter of a voxel, and some become no springl.
   springls_springl_materials finds the triangle that each comes from, so that values which were given for triangles or corners
   can be handed to springls_add_attribute. With split_input = 0 springl i is the i-th triangle with an area, unless parts
   overlap.
   positions: position_count points, world coordinates, `stride` bytes from one to the next (0: 12; a multiple of 4).
   triangles: 3 indices each, counter-clockwise seen from outside. report: may be NULL.
   An open, inside-out or otherwise defective mesh is repaired as `report` shows: triangles that hang together by edges are made
   to face alike, and each such part outwards, or as a hollow inwards within another; holes are closed by a film of springls,
   which come after those of the triangles. With triangles smaller than half a voxel call springls_remesh next: the time of a
   search grows with the springls in a cell.
   BAD_MESH: an index is out of range, no triangle has an area, or all lie outside the grid; or nothing is inside, as with a
   flat patch, with sheets that lie on each other, or with parts smaller than a voxel or than min_component: then the model is
   empty. With params.contouring = SPRINGLS_CONTOURING_SPRINGLS plates down to a fiftieth of a voxel are set. NON_FINITE: a used
   position. */
SPRINGLS_API springls_status springls_set_mesh(springls_context *ctx, const float *positions, int position_count,
                                               size_t stride, const int *triangles, int triangle_count,
                                               springls_mesh_report *report);

/* Sets the model from a dense volume whose zero level is the surface, negative inside; any function will do, since it is
   made a distance near its zero. NON_FINITE: a value is. EMPTY_MODEL: there is no zero in the grid. */
SPRINGLS_API springls_status springls_set_level_set(springls_context *ctx, const float *phi);

/* Sets the model from the voxels of a dense volume that equal `label`; label < 0: all that are not 0. EMPTY_MODEL: there
   are none. */
SPRINGLS_API springls_status springls_set_labels(springls_context *ctx, const int32_t *labels, int32_t label);

/* Sets the model from the voxels with low <= intensity <= high of a dense volume; NaN is outside. The surface lies where
   the interpolated intensity reaches a limit. EMPTY_MODEL: there are no such voxels. */
SPRINGLS_API springls_status springls_set_threshold(springls_context *ctx, const float *intensity, float low, float high);

/* Evaluates an implicit function, negative inside, at `count` world points, into one float a point. It must be a signed
   distance or a lower bound of one (Lipschitz constant 1), which may be cut short: parts of a steeper function's surface are missed. The
   smaller the bound, the more places are evaluated: one of 7 voxels or more costs no more than the distance. It is called from several
   threads at once. */
typedef void (*springls_implicit_fn)(void *user, const float *points, int count, float *out);

/* Sets the model from an implicit function, which is sampled in the narrow band only. NON_FINITE: it returned NaN.
   EMPTY_MODEL: there is no zero in the grid. CANCELLED. */
SPRINGLS_API springls_status springls_set_implicit(springls_context *ctx, springls_implicit_fn fn, void *user);

/* Describe the shapes of the functions below, in world units. A metasphere is a union of spheres that merge smoothly. */
typedef struct springls_sphere { float center[3], radius; } springls_sphere;
typedef struct springls_box { float center[3], half[3]; } springls_box;
typedef struct springls_torus { float center[3], axis[3], major, minor; } springls_torus;
typedef struct springls_metasphere { const springls_sphere *spheres; int count; } springls_metasphere;
typedef struct springls_notched_sphere { float center[3], radius, slot_width, slot_depth; } springls_notched_sphere; /* Zalesak */

/* Evaluate the signed distance of a shape: functions for springls_set_implicit, with a pointer to the structure as
   `user`. Of a shape with a number that is not finite they are NaN, which inputs refuse. */
SPRINGLS_API void springls_implicit_sphere(void *sphere, const float *points, int count, float *out);
SPRINGLS_API void springls_implicit_box(void *box, const float *points, int count, float *out);
SPRINGLS_API void springls_implicit_torus(void *torus, const float *points, int count, float *out);
SPRINGLS_API void springls_implicit_metasphere(void *metasphere, const float *points, int count, float *out);
SPRINGLS_API void springls_implicit_notched_sphere(void *notched_sphere, const float *points, int count, float *out);

/* Sets the model from `count` springls in voxel coordinates: 9 floats of vertices, 3 of the particle and 3 of the
   correspondence each. particles NULL: the centroids. correspondences NULL: the particles. The level set is made by
   unsigned_to_signed. The original surface is that of the springls; where the correspondences lie on another one, set
   that by springls_set_reference_mesh. NON_FINITE: a number is not finite or exceeds 10^6. */
SPRINGLS_API springls_status springls_set_springls(springls_context *ctx, const float *vertices, const float *particles,
                                                   const float *correspondences, int count);

/* Takes the present model as the original surface: a_n = p_n, phi_ref = phi; material triangles are the springls of this
   moment. EMPTY_MODEL. */
SPRINGLS_API springls_status springls_set_reference(springls_context *ctx);

/* Takes a mesh as the original surface of the present model: phi_ref is its signed distance, and material coordinates number
   its triangles. The arguments are those of springls_set_mesh, which repairs and reports the mesh in the same way; the world
   coordinates are those of the grid. Springls, correspondences and phi stay: correspondences that lie on the mesh keep their
   bits until a stage adds springls, others are moved onto it by SPRINGLS_STAGE_TRACK where it is near. EMPTY_MODEL: there are no
   springls. Other failures: as springls_set_mesh. After a failure nothing has changed. */
SPRINGLS_API springls_status springls_set_reference_mesh(springls_context *ctx, const float *positions, int position_count,
                                                         size_t stride, const int *triangles, int triangle_count,
                                                         springls_mesh_report *report);

/* Moves springls first .. first + count - 1, between two steps, to where a solver of the caller's has them: voxel coordinates
   as in views, 9 floats of vertices and 3 of the particle a springl.
   - vertices NULL: each triangle moves by as much as its particle, without turning. particles NULL: each particle keeps its
     barycentric coordinates in its triangle, and its offset from there. Everything else of a springl stays.
   - The level set follows in the next step, as after springls_advect. Motion since it last followed adds up: phi is carried along
     up to params.band_half_width + 1 voxels, and recomputed beyond that. Move springls by at most two
     voxels from one step to the next. A step without forces, springls_step_desc all zero, makes it follow at once;
     springls_combine, _offset, _smooth and _remesh take such a step first. With
     params.carry_level_set = 0 it follows by eq. 23, as far as springls may advect there. SPRINGLS_STAGE_UNSIGNED_TO_SIGNED
     recomputes phi after a motion of any size.
   - Springls may leave the grid, as by springls_advect; the level set ends at its border.
   - With a backend only the range is sent to the device.
   INVALID_ARGUMENT: the range is not one of springls_count springls, both arrays are NULL with count > 0, or a step is in
   progress, after which indices may be others. NON_FINITE: a number is not finite or exceeds 10^6. After a failure nothing has
   moved. */
SPRINGLS_API springls_status springls_write(springls_context *ctx, int first, int count, const float *vertices,
                                            const float *particles);

/* Sets which springls are kept (section 4.8): one byte a springl; NULL: none. Where it is not 0 a springl is neither relaxed,
   reshaped, turned, merged, removed nor split: in a step only advect and volume_lock move it. Of two close springls the one
   that is not kept is merged away. New springls beside kept ones are not kept. An input, springls_combine and springls_offset
   still replace or remove kept springls. */
SPRINGLS_API springls_status springls_set_keep_mask(springls_context *ctx, const uint8_t *mask);

/* ---- >>forces:api: eq. 1 and 2, in world units and world units a unit of time ---------------------------------- */

/* With springls_forces.voxel_units "world" in this chapter reads "voxels": lattice coordinates, so that a move of the grid
   (springls_desc.follow) changes nothing that a callback gets. */

/* Evaluates the pressure rho at `count` particles, world coordinates, with their outward unit normals: one float each.
   Called from several threads at once with different batches; `time` is that of the Runge-Kutta stage. No callback may
   call a function that is given the context it serves, except counts, views, ids, springls_to_voxel and springls_to_world. */
typedef void (*springls_pressure_fn)(void *user, const float *points, const float *normals, int count, float time, float *out);

/* Evaluates the velocity sigma at `count` points, world coordinates: 3 floats each. Called like the pressure, and
   twice more in a step, for its error. */
typedef void (*springls_velocity_fn)(void *user, const float *points, int count, float time, float *out);

/* Evaluates the affine map A(p, a) of `count` particles p with the correspondences a, world coordinates: 12 floats each,
   the row-major 3x4 matrix [A b]; the velocity of a place x of the springl is A x + b. Called like the pressure. */
typedef void (*springls_affine_fn)(void *user, const float *points, const float *correspondences, int count, float time,
                                   float *out);

/* Holds a batch of points of springls, for callbacks that find their answer by springl instead of by place. With
   params.vertex_velocity a velocity is evaluated at the particles, then at vertices 0, 1 and 2 of the same springls; a
   pressure or an affine map at the particles only. In a Runge-Kutta stage each springl comes once for each of these. */
typedef struct springls_batch {
    int count;                    /* of points, one a springl                                                       */
    int vertex;                   /* -1: the points are particles; 0, 1, 2: that vertex of the springls             */
    float time;                   /* of the Runge-Kutta stage                                                       */
    const float *points;          /* 3 each, world coordinates, as moved by the stage                               */
    const float *normals;         /* 3 each: outward unit normal of the springl                                     */
    const float *correspondences; /* 3 each, world coordinates                                                      */
    const int *springls;          /* index of each point's springl, as in views and springls_write                  */
    const uint32_t *ids;          /* its id, as in springls_ids                                                     */
} springls_batch;

/* Evaluates a force for a batch: `out` has 1, 3 or 12 floats a point, as the callbacks above. The batch is valid during the
   call. Called like the pressure. */
typedef void (*springls_batch_fn)(void *user, const springls_batch *batch, float *out);

/* Holds a sampled field, x fastest: 1 float a sample for a pressure, 3 for a velocity, in world units a unit of
   time. It is linear between samples and constant beyond them. The data is borrowed during the call. A displacement
   field is a velocity grid, applied with dt = 1 and SPRINGLS_INTEGRATOR_EULER. */
typedef struct springls_sampled_field {
    const float *data;
    springls_grid_desc grid; /* places the samples in the world, with voxel_units too; size all zero: the model's grid */
    unsigned version;        /* with a backend: samples are sent again when this or `data` changes; 0: every time   */
} springls_sampled_field;

/* Names how motion is integrated over a step: fourth-order Runge-Kutta (the paper) or one forward step. */
typedef enum springls_integrator { SPRINGLS_INTEGRATOR_RK4, SPRINGLS_INTEGRATOR_EULER } springls_integrator;

/* Sums up what moves springls (eq. 1). Members that are zero or NULL add nothing, except that a weight of 0 means 1. */
typedef struct springls_forces {
    springls_pressure_fn pressure; /* rho, along the outward normal                                                 */
    springls_velocity_fn velocity; /* sigma                                                                         */
    springls_affine_fn affine;     /* A(p, a)                                                                       */
    springls_batch_fn pressure_batch; /* added to the pressure callback                                             */
    springls_batch_fn velocity_batch; /* added to the velocity callback                                             */
    springls_batch_fn affine_batch;   /* added to the affine callback                                               */
    void *user;                    /* handed to all of them                                                         */
    springls_sampled_field pressure_grid; /* data NULL: none; added to the pressure callback                        */
    springls_sampled_field velocity_grid; /* data NULL: none; added to the velocity callback                        */
    float pressure_weight;         /* lambda_rho;   0: 1                                                            */
    float velocity_weight;         /* lambda_sigma; 0: 1                                                            */
    float affine_weight;           /* lambda_A;     0: 1                                                            */
    float curvature_weight;        /* motion along the normal by this times the level set's curvature, the sum of both principal
                                      ones (2/R for a ball): positive smooths; 0: none. World units^2 a unit of time           */
    springls_integrator integrator;
    bool voxel_units;              /* false: all of this is of the world, as shapes and meshes are: points, normals, correspondences,
                                      velocities, pressures, samples, maps, curvature_weight and the region. true: callbacks get
                                      lattice coordinates, and normals there; velocities, pressures and samples are voxels a unit
                                      of time, curvature_weight is in squares of the smallest spacing, for every spacing and
                                      direction of the grid, and the region is a box of the lattice. Where world and lattice are
                                      the same (spacing 1, origin 0, no direction) this changes nothing, not a bit. Elsewhere
                                      forces of the world run on the host: a backend's device evaluates those in voxels */
    float region_lower[3], region_upper[3]; /* springls whose particle is outside this box
                                      when a step or sub-step begins do not move and are not visited: a tool that acts in one
                                      place takes time for the springls there alone. The logger is warned of a box outside the
                                      grid. Both all zero: everywhere                                               */
    bool world_units;              /* not read: of earlier versions, where the world was not the default            */
} springls_forces;

/* Returns forces that add nothing, with all weights 1. Zeroed ones mean the same. */
SPRINGLS_API springls_forces springls_default_forces(void);

/* Finds the largest speed of any particle at `time`, in the units of the forces: f_max of section 4.8. NON_FINITE: from a
   force. */
SPRINGLS_API springls_status springls_max_speed(springls_context *ctx, const springls_forces *forces, float time, float *speed);

/* ---- >>stages:api: Table 2, each callable alone, in any order ----------------------------------------------------- */

/* Names the stages: those of Table 2, tracking (section 4.7), and those of the default parameters, which run only within steps. */
typedef enum springls_stage {
    SPRINGLS_STAGE_ADVECT,             /* springls_advect                                                           */
    SPRINGLS_STAGE_RELAX,              /* lets each springl seek equilibrium with its neighbours, params.relax_iterations times
                                          (Algorithm 1, eq. 3-20)                                                   */
    SPRINGLS_STAGE_CONTRACT,           /* removes springls far from the zero level, and removes or reshapes those of bad shape
                                          (section 4.6)                                                             */
    SPRINGLS_STAGE_RESAMPLE,           /* splits every springl that is too large once, at its longest edge (section 4.6) */
    SPRINGLS_STAGE_EVOLVE,             /* moves phi towards the springls by one step (eq. 21-23)                    */
    SPRINGLS_STAGE_REBUILD,            /* turns phi into a distance again, and moves the narrow band with its zero level */
    SPRINGLS_STAGE_FILL_GAPS,          /* adds springls where the zero level is bare, and tracks them (section 4.4) */
    SPRINGLS_STAGE_TRACK,              /* moves every correspondence onto the original surface (eq. 26)             */
    SPRINGLS_STAGE_UNSIGNED_TO_SIGNED, /* makes phi from the springls alone (section 4.5)                           */
    SPRINGLS_STAGE_PROJECT,            /* of phi: params.carry_level_set, params.project_level_set                  */
    SPRINGLS_STAGE_KEEP_EDGES,         /* params.keep_edges                                                         */
    SPRINGLS_STAGE_VOLUME_LOCK,        /* params.volume_lock                                                        */
    SPRINGLS_STAGE_COMPONENTS,         /* params.components, without params.volume_lock                             */
    SPRINGLS_STAGE_COUNT
} springls_stage;

/* Returns the name of a stage, "advect" for the first; "" when it is out of range. */
SPRINGLS_API const char *springls_stage_name(springls_stage stage);

/* Moves springls by the forces from `time` to time + dt (eq. 1, 2); the level set stays. NON_FINITE: a force is, and
   nothing moves. */
SPRINGLS_API springls_status springls_advect(springls_context *ctx, const springls_forces *forces, float time, float dt);

/* Runs one stage alone on the model as it is: SPRINGLS_STAGE_RELAX to SPRINGLS_STAGE_UNSIGNED_TO_SIGNED. Completes a step in progress.
   INVALID_ARGUMENT: it is none of these, and a step in progress goes on. EMPTY_MODEL: there are no springls to make phi from. */
SPRINGLS_API springls_status springls_run_stage(springls_context *ctx, springls_stage stage);

/* ---- >>drivers:api -------------------------------------------------------------------------------------------- */

/* Names the algorithm of a step; the manual's chapter DATA FLOW has the stages. */
typedef enum springls_mode {
    SPRINGLS_MODE_FLUID,      /* Algorithm 2: active contours and fluids                                            */
    SPRINGLS_MODE_ELASTIC,    /* Algorithm 3: steps of any size; phi is recomputed from the springls                 */
    SPRINGLS_MODE_ADVECT_ONLY /* springls move, the level set stays: the model behaves like a mesh                  */
} springls_mode;

/* Describes a step. Zero all of it, then set forces and dt. All zero: no time passes, and phi follows the springls that springls_write
   has moved. */
typedef struct springls_step_desc {
    const springls_forces *forces; /* NULL: none                                                                    */
    springls_mode mode;
    float dt;               /* time to advance; 0: as long as the fastest particle takes for max_displacement       */
    float max_displacement; /* voxels, 0.001 or more: dt is divided into sub-steps in which no particle moves further. 0: what suits
                               the parameters, 2 with carry_level_set, as in the default set, else d_max, as in the paper's. 1.3
                               gives the default set's best accuracy. Negative: dt is never divided, as for displacements with
                               SPRINGLS_INTEGRATOR_EULER; with dt = 0 it is as 0                                    */
    bool one_to_one;        /* no contract, resample or fill_gaps: springls keep their indices (section 4.8)        */
    bool stop_at_topology;  /* springls stop where preserved topology stops the level set (eq. 24, 25)              */
    bool stop_at_rest;      /* springls_run ends with OK after a step in which at most one springl in 1000 moved by more
                               than 0.01 voxel: an active contour has arrived                                       */
    int rest_steps;         /* more than 1: for noisy forces, under which springls tremble on their place. stop_at_rest then looks
                               after so many steps, and counts how far springls have come along their normals since the last look */
    float rest_share;       /* of the springls that may still move for stop_at_rest; 0: 0.001                       */
    float rest_displacement; /* voxels that count as moving, with rest_steps above 1; 0: 0.01                       */
} springls_step_desc;

/* Returns a description of a step without forces: all zero. */
SPRINGLS_API springls_step_desc springls_default_step_desc(void);

/* Runs one step of the chosen algorithm from the context's time. NON_FINITE: from a force; the model is as before the
   sub-step in which it occurred. INVALID_ARGUMENT: also when dt would need more than 10000 sub-steps. EMPTY_MODEL. */
SPRINGLS_API springls_status springls_step(springls_context *ctx, const springls_step_desc *step);

/* Begins a step that springls_step_continue completes in as many calls as the caller likes. The result has the same bits as
   springls_step, however it is divided. *step and *step->forces are copied; `user` and `data` of the forces are borrowed
   until the step is done. Forces are called in springls_step_continue only. INVALID_ARGUMENT, EMPTY_MODEL: no step begins.

   While a step is in progress:
   - counts, views, ids, springls_get_provenance, _springl_materials, _mesh_attribute, _chunk_attribute, _sample_*, _copy_level_set,
     _pack_matrix, _closest, _raycast, _extract_surfels and _extract_soup read the model as it is at that moment: springls
     have moved, and the level set may not have followed (in SPRINGLS_MODE_ELASTIC it may be incomplete);
   - springls_set_* inputs, springls_reset and springls_restore drop the step together with the model;
   - every other call that changes the model or needs it whole completes the step first, however long that takes, and
     returns its failure: stages, steps, parameters, time, mask, reference, springls_max_speed, meshes, chunks, measures,
     snapshots. */
SPRINGLS_API springls_status springls_step_begin(springls_context *ctx, const springls_step_desc *step);

/* Continues the step for about `seconds` by trace.now (see springls_trace), and sets *done when it is complete; 0 seconds or
   less: one entry of the step's tables, the least there is. What an entry does besides its loop is not divided (manual, FRAMES), so
   a call may take longer. On a device an entry counts as done when it has been enqueued. Without a step in progress: OK, *done = true. A
   failure of the step ends it; one of the arguments, NULL or NaN, leaves it in progress. */
SPRINGLS_API springls_status springls_step_continue(springls_context *ctx, double seconds, bool *done);

/* Returns true between springls_step_begin and the call that completes or drops the step. */
SPRINGLS_API bool springls_step_in_progress(const springls_context *ctx);

/* Runs `steps` steps, and reports progress after each. CANCELLED: after a whole step. Other failures: as springls_step. */
SPRINGLS_API springls_status springls_run(springls_context *ctx, const springls_step_desc *step, int steps);

/* Runs steps in which no time passes until the model is at rest, at most `steps`: after an input, so that the first steps of a game or
   a tool do not pay for it. For a budget of time run such steps, springls_step_desc all zero, by springls_step_begin and _continue
   until springls_at_rest. EMPTY_MODEL. */
SPRINGLS_API springls_status springls_settle(springls_context *ctx, int steps);

/* Returns true when all of the model sleeps (manual, REST): a step without forces then costs next to nothing and changes nothing. */
SPRINGLS_API bool springls_at_rest(const springls_context *ctx);

/* Returns the model's time. */
SPRINGLS_API double springls_time(const springls_context *ctx);

/* Sets the model's time; a time that is not finite is ignored. */
SPRINGLS_API void springls_set_time(springls_context *ctx, double time);

/* ---- >>snapshots:api: undo, rollback, files -------------------------------------------------------------------- */

/* Names what a snapshot holds. Neither kind holds the members of springls_desc, forces, meshes or chunks. */
typedef enum springls_snapshot_kind {
    SPRINGLS_SNAPSHOT_KIND_ALL,  /* springls, level set, original surface, attributes, parameters, time, statistics   */
    SPRINGLS_SNAPSHOT_KIND_FRAME /* all but the original surface and its level set, which change at inputs,
                                    springls_set_reference and springls_combine only: smaller and faster, for undo and
                                    rollback. It can be restored where they are the same: in this context, or in one that an
                                    ALL snapshot of this model was restored to                                        */
} springls_snapshot_kind;

#ifndef SPRINGLS_NO_SNAPSHOTS
/* Writes the model into `out`, at most `capacity` bytes, and their number into *size; out NULL: the number only. A context
   of the same springls_desc.grid and .follow that restores it continues with the same bits as this one, on any backend,
   number of threads, or machine. Equal states are equal bytes. The bytes are a file format, which later versions of the library
   read too (docs/snapshot-format.md). Completes a step in progress, and finds components that are out of date: their failures are
   returned, too. INVALID_ARGUMENT: also when capacity is less than *size. */
SPRINGLS_API springls_status springls_snapshot(springls_context *ctx, springls_snapshot_kind kind, void *out, size_t capacity,
                                               size_t *size);

/* Replaces the model by a snapshot of `size` bytes; springls_stats.seconds stay as they are. BAD_SNAPSHOT: it is cut short,
   altered, of another grid, or has what this version does not have. After any failure the model is unchanged. A snapshot of
   more springls than this context's max_springls is restored too: then none are added until there are fewer. */
SPRINGLS_API springls_status springls_restore(springls_context *ctx, const void *snapshot, size_t size);

/* Writes the difference from one snapshot, `base`, to another into `out`, at most `capacity` bytes, and its number of bytes into *size;
   out NULL: the number only, which takes as long. It is at most snapshot_size + 64; where there is that much room it is found once. For
   undo keep the newest snapshot of kind ALL, and for each stroke the difference from the snapshot after it to the one before it:
   so cuts are undone too, and a stroke takes memory for what it has changed. Snapshots of tilings (springls_tiling_snapshot) have
   differences too; any context does. BAD_SNAPSHOT: one of the two is no snapshot, or is cut short. INVALID_ARGUMENT: also when
   capacity is less than *size. `out` overlaps neither. Takes a quarter of base_size of memory, at most 1 GiB: OUT_OF_MEMORY. The model has
   no part in it. A difference is for the version of the library that made it, and is no file format. */
SPRINGLS_API springls_status springls_snapshot_delta(springls_context *ctx, const void *base, size_t base_size, const void *snapshot,
                                                     size_t snapshot_size, void *out, size_t capacity, size_t *size);

/* Makes a snapshot again, byte by byte, from `base` and the difference of springls_snapshot_delta: at most `capacity` bytes into
   `out`, which may overlap neither, and their number into *size; out NULL: the number only. springls_restore takes it.
   BAD_SNAPSHOT: `base` is no snapshot, or not the one of the difference, or the difference is cut short or names places outside;
   what `out` then holds is undefined. Bytes that were altered are found by springls_restore. INVALID_ARGUMENT: also when capacity
   is less than *size. */
SPRINGLS_API springls_status springls_snapshot_patch(springls_context *ctx, const void *base, size_t base_size, const void *delta,
                                                     size_t delta_size, void *out, size_t capacity, size_t *size);
#endif

/* ---- >>read:api: the springls, in voxel coordinates unless a comment names another unit --------------------------- */

/* Shows an array of the context without a copy: `count` rows of floats, `stride` bytes from one to the next; data NULL:
   none. Rows need not be adjacent: row i begins at (const char *)data + i * stride. */
typedef struct springls_view { const float *data; int count; size_t stride; } springls_view;

/* Returns the number of springls. */
SPRINGLS_API int springls_count(const springls_context *ctx);

/* Show the springls in springl order: 9 floats of vertices q0 q1 q2, 3 of the particle p, 3 of the correspondence a. */
SPRINGLS_API springls_view springls_view_vertices(const springls_context *ctx);
SPRINGLS_API springls_view springls_view_particles(const springls_context *ctx);
SPRINGLS_API springls_view springls_view_correspondences(const springls_context *ctx);

/* Returns the ids of the springls, one each: a number that no other springl of this model ever gets. */
SPRINGLS_API const uint32_t *springls_ids(const springls_context *ctx);

/* Finds the indices of `count` springls by their ids, in any order; -1: the model has none of that id any more. Takes time for the
   springls of the model and for `count`. */
SPRINGLS_API springls_status springls_index_of(springls_context *ctx, const uint32_t *ids, int count, int *out);

/* Returns the generations of the springls, one each: 0 for an original springl, else the splits and fills that lead to
   one. */
SPRINGLS_API const uint32_t *springls_generations(const springls_context *ctx);

/* Writes the paper's 4x4 matrix (eq. 27), 16 floats a springl: p phi | q1 a.x | q2 a.y | q3 a.z. */
SPRINGLS_API springls_status springls_pack_matrix(springls_context *ctx, float *out);

/* Writes surfels (section 6), 7 floats a springl, world units: centre 3, outward unit normal 3, radius 1. The normal is that of
   phi at the particle; where phi has no gradient, as between the sides of a thin sheet or beyond the narrow band, that of the
   triangle. */
SPRINGLS_API springls_status springls_extract_surfels(springls_context *ctx, float *out);

/* ---- >>events:api: components with ids that last, and what happens to them (params.components) --------------------- */

/* Describes a component of the model: a body, a connected part of the inside of the watertight surface (params.contouring), or a cavity,
   a connected part of the outside that a body encloses, such as a bubble. World units. */
typedef struct springls_component {
    uint32_t id;            /* from 1; no other component of this model ever gets it                                */
    bool cavity;
    double volume, area;    /* a body's volume is without its cavities, its area with theirs                        */
    float center[3];        /* centroid of the volume                                                               */
    float correction;       /* smallest spacings: its offset by params.volume_lock at the end of the last step      */
} springls_component;

#ifndef SPRINGLS_NO_EVENTS
/* Lists the components of the present surface by ascending ids. They are found by this call when the surface has changed since the last
   step; ids and events are the same whether or not anybody asks. Needs params.components or params.volume_lock: INVALID_ARGUMENT
   without. Completes a step in progress. The list belongs to the context, until the next call that changes the model. */
SPRINGLS_API springls_status springls_components(springls_context *ctx, const springls_component **components, int *count);

/* Returns the ids of the bodies that the springls belong to, one each, in springl order; 0: none. New springls have that of the
   springl they are born beside, until components are found at the end of the step. NULL while params.components and
   params.volume_lock are 0. Belongs to the context, until the next call that changes the model. */
SPRINGLS_API const uint32_t *springls_component_ids(const springls_context *ctx);

/* Finds the ids of the bodies at `count` world points, such as vertices of meshes and chunks, or hits of rays; 0: none. A point
   inside has the body that it lies in; one outside, within the narrow band, the body that descent of phi leads to or, with
   SPRINGLS_CONTOURING_SPRINGLS, the nearest one. Conditions as for springls_components. NON_FINITE: a point is. */
SPRINGLS_API springls_status springls_component_of(springls_context *ctx, const float *points, int count, uint32_t *out);
#endif

/* Names what happens to components. */
typedef enum springls_event_kind {
    SPRINGLS_EVENT_KIND_BIRTH, /* one has appeared that does not come from another                                  */
    SPRINGLS_EVENT_KIND_SPLIT, /* one has become several; the largest part keeps its id                             */
    SPRINGLS_EVENT_KIND_MERGE, /* several have become one, with the id of the largest of them; of equal ones the
                                  lowest. If the largest of them has itself been split off in the same step, from a
                                  component whose id stays with a larger part, the id is new                        */
    SPRINGLS_EVENT_KIND_DEATH  /* one has vanished, or a cavity has opened                                          */
} springls_event_kind;

/* Describes an event. */
typedef struct springls_event {
    double time;            /* of the model when it was found: the end of a sub-step                                */
    float place[3];         /* world: where parts have met or parted; the centroid of what was born or died         */
    int step;               /* springls_stats.steps then                                                            */
    springls_event_kind kind;
    bool cavity;            /* it happened to cavities: a bubble was closed (birth), opened or vanished (death), ... */
    int before_count, after_count;
    const springls_component *before, *after; /* the parts as they were before and after; birth, death: none, NULL  */
} springls_event;

#ifndef SPRINGLS_NO_EVENTS
/* Lists the events of the last step and of the calls before and after it, in order of time: those of springls_combine, _offset,
   _remesh or a stage call between two steps are listed until the step after the second begins, so that a caller who asks after
   each step sees all of them. Conditions and ownership as for springls_components. Parts of a few voxels are included: their
   volumes show which. */
SPRINGLS_API springls_status springls_events(springls_context *ctx, const springls_event **events, int *count);
#endif

/* ---- >>mesh_out:api ------------------------------------------------------------------------------------------- */

/* Holds a mesh that was made by the context's allocator; free it by springls_mesh_free. */
typedef struct springls_mesh {
    int vertex_count, triangle_count;
    float *positions;       /* 3 a vertex, world                                                                    */
    float *normals;         /* 3 a vertex, unit, outward                                                            */
    float *correspondences; /* 3 a vertex, world: the place on the original surface                                 */
    int *springls;          /* 1 a vertex: index of the nearest springl (of a mesh of springls: the one with the most weight there),
                               -1 when none is within a voxel                                                       */
    int *triangles;         /* 3 a triangle, counter-clockwise seen from outside                                    */
    size_t bytes;           /* for springls_mesh_free                                                               */
    uint64_t version;       /* of the springls that it shows: springls_mesh_errors refuses it when they have changed; 0, as of a
                               mesh that the caller makes: it is not known                                          */
} springls_mesh;

/* Extracts the watertight surface as a mesh: welded, closed, every edge between exactly two triangles. By params.contouring that is
   the zero level, or the surface of what springls hold, which keeps sharp edges and sheets below a voxel (manual, CONTOURING). An
   empty model gives an empty mesh. On failure *out is empty. */
SPRINGLS_API springls_status springls_extract_mesh(springls_context *ctx, springls_mesh *out);

/* Extracts the springls themselves: three vertices each, with the springl's normal and index, and each with its own correspondence, as
   springls_hit.material has it on SPRINGLS_SURFACE_SOUP. */
SPRINGLS_API springls_status springls_extract_soup(springls_context *ctx, springls_mesh *out);

/* Frees the arrays of a mesh of this context and zeroes it; a zeroed mesh and NULL are allowed. */
SPRINGLS_API void springls_mesh_free(springls_context *ctx, springls_mesh *mesh);

/* Holds one chunk of the watertight surface (params.contouring, or desc.zero_level), the part in one brick of 8^3 voxels, as a mesh of
   its own. Neighbouring chunks repeat the vertices that they share, with the same bits, so that together they are watertight. */
typedef struct springls_chunk {
    int brick[3];            /* its cubes begin at voxel 8 brick of the lattice: 8 a side, 9 at the grid's lower
                                border. It names the same place when the grid has moved (springls_desc.follow)      */
    int vertex_count, triangle_count; /* 0: the chunk is empty now                                                  */
    float *positions;        /* 3 a vertex, world                                                                   */
    float *normals;          /* 3 a vertex, unit, outward                                                           */
    float *correspondences;  /* 3 a vertex, world; NULL without desc.correspondences                                */
    uint32_t *ids;           /* 1 a vertex: id of the nearest springl, or of the one that counts most there where the mesh
                                is of what springls hold; UINT32_MAX when none is within a voxel; NULL without
                                desc.correspondences                                                                */
    uint16_t *triangles;     /* 3 a triangle: indices of this chunk's vertices, counter-clockwise seen from outside */
} springls_chunk;

/* Describes what a consumer of chunks needs. */
typedef struct springls_chunks_desc {
    float tolerance;      /* voxels, at most 0.5: a chunk counts as changed when phi has changed by more, or a vertex of what
                             springls hold (params.contouring) has moved by half of it; 0: 0.05; negative: none, and the chunks are
                             the mesh of springls_extract_mesh to the bit. Springls at rest relax by some 0.001 voxel a step,
                             so that without a tolerance all chunks change                                           */
    bool correspondences; /* fill springls_chunk.correspondences and ids, which take most of the time of a chunk; a chunk has
                             changed, too, when the attributes of its springls have                                  */
    bool zero_level;      /* chunks of the zero level of phi whatever params.contouring is: what a brush changes takes a tenth of
                             the time, edges are rounded off, and sheets below a voxel or two may be lost            */
} springls_chunks_desc;

/* Remembers which chunks one consumer has received. A context may have any number of consumers. */
typedef struct springls_chunks springls_chunks;

#ifndef SPRINGLS_NO_CHUNKS
/* Creates the memory of a consumer, by the context's allocator; desc NULL: the defaults. On failure *out is NULL. */
SPRINGLS_API springls_status springls_chunks_create(springls_context *ctx, const springls_chunks_desc *desc,
                                                    springls_chunks **out);

/* Frees the memory of a consumer, before its context is destroyed; NULL is allowed. */
SPRINGLS_API void springls_chunks_destroy(springls_context *ctx, springls_chunks *chunks);

/* Lists the chunks that have changed since the last call, in brick order; at first all, and a vanished one without
   triangles. Whatever happened in between (steps, inputs, restore, another params.contouring), the consumer's chunks then are the
   watertight surface, within the tolerance. The list belongs to `chunks` until its next call. After a failure the next call lists
   what this one would have listed. The same as springls_chunks_begin and one springls_chunks_continue. */
SPRINGLS_API springls_status springls_chunks_update(springls_context *ctx, springls_chunks *chunks,
                                                    const springls_chunk **changed, int *count);

/* Begins what springls_chunks_update does, in as many calls of springls_chunks_continue as the caller likes, with the same
   bits. Completes a step in progress. Until the update is done, queries read the model as during a step; every call that changes
   the model, or begins a step or an update of other chunks, completes the update first and returns its failure, and the next
   springls_chunks_continue returns the list; inputs and springls_restore drop it with the model, and springls_chunks_continue
   begins again. */
SPRINGLS_API springls_status springls_chunks_begin(springls_context *ctx, springls_chunks *chunks);

/* Continues the update for about `seconds` by trace.now, as springls_step_continue does a step. *done: it is complete, and
   *changed and *count are those of springls_chunks_update; until then NULL and 0. A failure of the update ends it; one of the
   arguments, NULL or NaN, leaves it in progress. INVALID_ARGUMENT: also without springls_chunks_begin since it was last done. */
SPRINGLS_API springls_status springls_chunks_continue(springls_context *ctx, springls_chunks *chunks, double seconds,
                                                      const springls_chunk **changed, int *count, bool *done);
#endif

/* Asks for the triangles of a chunk at a level of detail, and receives them. They lie between vertices that the chunk has: its positions,
   normals, correspondences, ids and attributes serve all levels. Zero all of it, and set chunk, level, neighbors and triangles. */
typedef struct springls_lod {
    const springls_chunk *chunk; /* as springls_chunks_update lists it, or a copy of the caller's; read: brick, positions, triangles,
                                    and correspondences where they are not NULL                                       */
    int level;              /* 0: as it is; 1, 2, 3: half, a quarter, an eighth of the resolution: edges may get 3, 6, 12 voxels long */
    int neighbors[6];       /* levels of the chunks at -x, +x, -y, +y, -z, +z of it on the lattice: each border is that of the
                               finer level of both. A chunk without triangles may have any                              */
    uint16_t *triangles;    /* written: 3 a triangle, indices of the chunk's vertices; room for as many as chunk has      */
    int triangle_count;     /* written                                                                                */
    float error;            /* written: world units; no vertex of the chunk is further from these triangles, or from the edges of the
                               common border where the chunk's own triangles there are gone. At most 2^level / 8 smallest
                               spacings, but where a whole body vanishes                                                */
    float material_error;   /* written: world units of the original surface; no vertex's correspondence is further from what is
                               interpolated at the closest place; 0 without correspondences                            */
} springls_lod;

#ifndef SPRINGLS_NO_CHUNKS
/* Finds the triangles of `count` chunks at their levels of detail (manual, LEVELS OF DETAIL). Chunks of any levels together are closed
   wherever the chunks themselves are, if each is given the levels that its neighbors have: two chunks find the same edges at their
   common border. The chunks are those that one update has listed, or all that a consumer holds after an update. The model has no part in
   it. Results do not depend on threads. INVALID_ARGUMENT: also an index out of range, a position or correspondence that is not finite,
   and more than 65536 vertices. After a failure nothing is written. */
SPRINGLS_API springls_status springls_chunks_lod(springls_context *ctx, springls_lod *lod, int count);
#endif

/* Writes phi as a dense volume, in voxels, clamped outside the narrow band. */
SPRINGLS_API springls_status springls_copy_level_set(springls_context *ctx, float *out);

/* ---- >>queries:api: batches of world points. A point that is not finite: NON_FINITE, and `out` stays as it was ---- */

#ifndef SPRINGLS_NO_QUERIES
/* Samples the signed distance in world units, one float a point: phi, clamped outside the narrow band; if the spacing is not uniform
   that to the zero level, clamped at what the band reaches along the axis of the smallest spacing. */
SPRINGLS_API springls_status springls_sample_distance(springls_context *ctx, const float *points, int count, float *out);

/* Samples the gradient of the distance, 3 floats a point, world components: of unit length where it is one. */
SPRINGLS_API springls_status springls_sample_gradient(springls_context *ctx, const float *points, int count, float *out);

/* Samples whether the watertight surface bounds points, one byte each, 1 inside, 0 outside: by the sign of phi, or with
   SPRINGLS_CONTOURING_SPRINGLS by the mesh of springls_extract_mesh; while a step or an update of chunks is in progress by the sign
   of phi. */
SPRINGLS_API springls_status springls_sample_inside(springls_context *ctx, const float *points, int count, uint8_t *out);
#endif

/* Names the surface that closest points and rays are found on. */
typedef enum springls_surface {
    SPRINGLS_SURFACE_WATERTIGHT, /* params.contouring SPRINGLS: the mesh of springls_extract_mesh, thin sheets too. A call with up
                                    to 16 queries makes the parts of the mesh that it needs; one with more, or when calls since
                                    the last change of the model have made as much as that together, the whole mesh and a
                                    hierarchy. Both find the same, except where springls contradict each other. LEVEL_SET, and
                                    while a step or an update of chunks is in progress: the zero level, closed. Nothing is built
                                    then but, where springls have come or gone, the list of them by cell. A sheet thinner than
                                    about a voxel may have springls and no zero level: it is not found. A closest point further
                                    away than phi reaches takes ten times as long as a near one                               */
    SPRINGLS_SURFACE_SOUP        /* the triangles of the springls, with gaps that rays pass through. A hierarchy is built at
                                    the first query after springls have moved                                                 */
} springls_surface;

/* Holds a place on the surface and, as `material`, the same place on the original surface (section 4.7). */
typedef struct springls_hit {
    int springl;                 /* WATERTIGHT: the springl nearest to `point`: of all that face its side, if one of these
                                    is within a voxel; SOUP: the springl that `point` lies on. -1: none             */
    uint32_t id;                 /* of the springl, as springls_ids                                                 */
    float point[3];              /* world                                                                           */
    float normal[3];             /* world, unit, outward. WATERTIGHT: of phi, as the vertices of the zero level's mesh have
                                    it, or interpolated from the vertices of the mesh of springls; SOUP: of the springl */
    float barycentric[3];        /* in the springl: its place closest to `point`                                    */
    float distance;              /* world units, never negative: from the query point, or along the ray             */
    float material[3];           /* world. WATERTIGHT: from a quadratic fit of the correspondences around, as in
                                    springls_extract_mesh; SOUP: from a linear one                                  */
    int material_triangle;       /* of the mesh that was set, or of the initial springls; -1: there is none         */
    float material_barycentric[3];
} springls_hit;

#ifndef SPRINGLS_NO_QUERIES
/* Finds the closest place of the surface to each point, at any distance: beyond 10^7 voxels one that is the
   closest as far as a float resolves the distance. Distances are at most FLT_MAX. A model without springls has none. */
SPRINGLS_API springls_status springls_closest(springls_context *ctx, springls_surface surface, const float *points, int count,
                                              springls_hit *out);

/* Finds the first place of the surface along each ray, from either side, within max_distance (world units; 0: any).
   directions: 3 floats a ray, of any length; a direction of length 0 finds nothing. No digit is lost however far a ray begins. A
   ray from outside to a place inside the watertight surface always finds it. */
SPRINGLS_API springls_status springls_raycast(springls_context *ctx, springls_surface surface, const float *origins,
                                              const float *directions, int count, float max_distance, springls_hit *out);
#endif

/* ---- >>attributes:api: named values that springls carry ----------------------------------------------------------- */

/* An attribute is any number of floats a springl: colours, texture coordinates without seams, bone weights, labels,
   temperature, mass. Attributes belong to the model: an input or springls_reset removes them all. The model has
   the same bits with and without them, and without any nothing is computed for them. */

/* Names what becomes of the values of an attribute where springls are split, filled in and merged. */
typedef enum springls_policy {
    SPRINGLS_POLICY_COPY,  /* for labels. split: the values of the springl that is split. fill: those of the neighbour with the
                              nearest correspondence. merge: the springl that stays keeps its own                           */
    SPRINGLS_POLICY_BLEND, /* for continuous values. split and fill: a mean of the neighbours on the same side of the surface,
                              with weights that are not negative, add up to 1, and where possible reproduce functions that
                              are linear in the correspondence. merge: the mean of the two, weighted by area                */
    SPRINGLS_POLICY_SHARE  /* for amounts whose sum is to last. split: half each. fill: 0. merge and removal: added to the
                              nearest springl that stays, if one is within 2.5 voxels                                       */
} springls_policy;

#define SPRINGLS_MAX_ATTRIBUTES 32  /* attributes of a model        */
#define SPRINGLS_MAX_CHANNELS 1024  /* channels of an attribute     */
#define SPRINGLS_MAX_NAME_LENGTH 31 /* characters of a name, 1 .. 31 */

/* Describes an attribute. */
typedef struct springls_attribute_desc {
    const char *name; /* no other attribute of the model has it */
    int channels;     /* floats a springl                       */
    springls_policy split, fill, merge;
} springls_attribute_desc;

/* Adds an attribute, and sets *index (may be NULL) to its number, counted from 0. values: `channels` floats a springl, in
   springl order; NULL: zeros. NON_FINITE: a value is. */
SPRINGLS_API springls_status springls_add_attribute(springls_context *ctx, const springls_attribute_desc *desc,
                                                    const float *values, int *index);

/* Removes an attribute; those after it have numbers smaller by one from then on. */
SPRINGLS_API springls_status springls_remove_attribute(springls_context *ctx, int index);

/* Returns the number of attributes. */
SPRINGLS_API int springls_attribute_count(const springls_context *ctx);

/* Describes an attribute of the model. out->name points into the context, until an attribute is removed. */
SPRINGLS_API springls_status springls_describe_attribute(springls_context *ctx, int index, springls_attribute_desc *out);

/* Returns the number of the attribute of that name, -1 when there is none. */
SPRINGLS_API int springls_find_attribute(const springls_context *ctx, const char *name);

/* Replaces the values of an attribute: `channels` floats a springl; NULL: zeros. springls_chunks with correspondences then list the
   chunks that show springls with other values. NON_FINITE: a value is. */
SPRINGLS_API springls_status springls_set_attribute(springls_context *ctx, int index, const float *values);

/* Shows the values of an attribute: `channels` floats a springl; data NULL: there is no such attribute. */
SPRINGLS_API springls_view springls_view_attribute(const springls_context *ctx, int index);

/* Interpolates an attribute at the vertices of a mesh that springls_extract_mesh or _extract_soup made of the model as it
   is now: `channels` floats a vertex. With the fill policy BLEND values are blended in the same way, with another policy
   they are those of the neighbour with the nearest correspondence. */
SPRINGLS_API springls_status springls_mesh_attribute(springls_context *ctx, const springls_mesh *mesh, int index, float *out);

#ifndef SPRINGLS_NO_CHUNKS
/* The same at the vertices of a chunk of a consumer with correspondences, before the model changes: `channels` floats a vertex, with the
   bits that a vertex of the mesh at its place has. Chunks that show springls with new values are listed by the next
   springls_chunks_update. The first call after springls have moved builds a hierarchy over all of them. INVALID_ARGUMENT: also a chunk
   without correspondences. */
SPRINGLS_API springls_status springls_chunk_attribute(springls_context *ctx, const springls_chunk *chunk, int index, float *out);
#endif

/* Names the origin of a springl, which decides how exact its place and its correspondence are. */
typedef enum springls_kind {
    SPRINGLS_KIND_ORIGINAL, /* from the input: exact except for the error of advection                        */
    SPRINGLS_KIND_SPLIT,    /* half of another springl: interpolated between neighbours                       */
    SPRINGLS_KIND_FILLED    /* added in a gap, or half of such a springl: interpolated, or even extrapolated  */
} springls_kind;

/* Holds the history of a springl. */
typedef struct springls_provenance {
    springls_kind kind;
    int age;             /* steps since an input, a split or a fill gave it its place                             */
    uint32_t generation; /* as springls_generations                                                               */
    uint32_t parent;     /* id of the springl that it was split from or added beside; its own id when there is none */
} springls_provenance;

/* Writes the history of every springl, in springl order. */
SPRINGLS_API springls_status springls_get_provenance(springls_context *ctx, springls_provenance *out);

/* Holds estimates of two errors, world units; if the spacing is not uniform, as if all errors were along the longest. On the motions of
   the benchmarks at least 95 % of the springls have smaller ones (manual, ERRORS OF PLACE). Included are errors of splits and fills, of
   Runge-Kutta steps and of rounding, not those of forces nor of SPRINGLS_INTEGRATOR_EULER. */
typedef struct springls_error_estimate {
    float place;          /* from the particle to where the motion takes its correspondence                          */
    float correspondence; /* on the original surface: from it to where the particle has come from                    */
} springls_error_estimate;

/* Estimates the errors of every springl, in springl order. Completes a step in progress. */
SPRINGLS_API springls_status springls_springl_errors(springls_context *ctx, springls_error_estimate *out);

/* Estimates the errors of the vertices of a mesh that springls_extract_mesh or _extract_soup made of the model as it is now, and
   of their correspondences. Completes a step in progress. INVALID_ARGUMENT: also when springls have moved, come or gone since. */
SPRINGLS_API springls_status springls_mesh_errors(springls_context *ctx, const springls_mesh *mesh, springls_error_estimate *out);

/* Holds where a material point is now. */
typedef struct springls_material_place {
    float place[3];         /* world                                                                                */
    float error;            /* world units: an estimate of how far off it is, as springls_error_estimate.place; FLT_MAX: there is
                               no place, since the surface that the point lay on is gone                            */
    int springl;            /* whose correspondence is the nearest; -1: none is within four voxels                  */
    uint32_t id;            /* of the springl                                                                       */
} springls_material_place;

/* Finds where `count` points of the original surface are now, world coordinates there: landmarks, seams, electrodes. The inverse of the
   correspondence, by the springls near; a point off the original surface goes along with it. Takes time for all springls where they
   have changed since the last call, and for each point. Completes a step in progress. NON_FINITE: a point is. */
SPRINGLS_API springls_status springls_place_now(springls_context *ctx, const float *points, int count, springls_material_place *out);

/* ---- >>material:api: places on the original surface ------------------------------------------------------------ */

/* Holds a material coordinate: a place on the original surface. Values that are given on the original surface and looked up
   by material coordinates do not wear off, however long the motion. triangle: as numbered in the mesh given to
   springls_set_mesh, otherwise an initial springl; -1: none. */
typedef struct springls_material { int triangle; float barycentric[3]; } springls_material;

/* Finds the material coordinates of the particles, one a springl. */
SPRINGLS_API springls_status springls_springl_materials(springls_context *ctx, springls_material *out);

/* Finds the material coordinates of the vertices of an extracted mesh, one a vertex. */
SPRINGLS_API springls_status springls_mesh_materials(springls_context *ctx, const springls_mesh *mesh, springls_material *out);

/* Finds the material coordinates of the corners of an extracted mesh, 3 a triangle, all three on one side of every seam:
   for texture coordinates. neighbors: 3 a triangle of the original surface, the triangle across the edge from corner m to
   the next, -1 at a seam (springls_find_seams makes it). The centroid of a triangle decides the side; a corner beyond the
   seam gets the nearest place before it. */
SPRINGLS_API springls_status springls_corner_materials(springls_context *ctx, const springls_mesh *mesh, const int *neighbors,
                                                       springls_material *out);

/* Finds which triangles of a mesh meet without a seam: where the corners at both ends of an edge agree in position and in
   `values`, one row of `channels` floats a corner (2 for texture coordinates; NULL with 0 channels). Positions and
   triangles: as for springls_set_mesh. neighbors: 3 a triangle, -1 at a seam. BAD_MESH: an index is out of range. */
SPRINGLS_API springls_status springls_find_seams(springls_context *ctx, const float *positions, int position_count, size_t stride,
                                                 const int *triangles, int triangle_count, const float *values, int channels,
                                                 int *neighbors);

/* Interpolates values at `count` material coordinates, `channels` floats each, zeros if there is no triangle. values:
   rows of `channels` floats, one a corner of the original surface, or one a vertex when `triangles` has its 3 indices a
   triangle (NULL: corners). Needs no context. INVALID_ARGUMENT: a place is not below triangle_count; the indices in
   `triangles` are not checked. */
SPRINGLS_API springls_status springls_interpolate_material(const springls_material *places, int count, const float *values,
                                                           int channels, const int *triangles, int triangle_count, float *out);

/* Returns how many triangles the original surface has, as material coordinates number them. */
SPRINGLS_API int springls_material_triangle_count(const springls_context *ctx);

/* ---- >>tools:api: springls that stay keep identity, correspondence and attributes --------------------------------- */

/* Names a boolean operation of two solids. */
typedef enum springls_operation {
    SPRINGLS_OPERATION_UNION,
    SPRINGLS_OPERATION_INTERSECTION,
    SPRINGLS_OPERATION_DIFFERENCE
} springls_operation;

#ifndef SPRINGLS_NO_TOOLS
/* Combines the solid with another one, on the same grid and with the same band_half_width.
   - Grids that have moved (springls_desc.follow) may be at different places. For a union a grid that follows first moves to the
     middle of both. INVALID_ARGUMENT, and nothing has changed: it is a union, and the particles of both do not lie in one window.
     Correspondences keep their voxel coordinates.
   - Springls of both stay where they bound the result; those of a subtracted solid are turned round. Springls that cross
     the seam are pulled in to it and its gaps are filled; params.keep_edges makes it sharp.
   - An attribute of the other model with the name and channels of one here is taken over; its springls get zeros in the
     rest.
   - The original surface becomes both originals together: triangles of the other are numbered from this model's
     springls_material_triangle_count on, as it was before the call.
   - With params.contact = SPRINGLS_CONTACT_SEPARATE solids that are united stay two bodies, as far as their springls stay; after
     the other operations bodies are found again.
   - Memory grows by the other's original surface, some 80 bytes a triangle. Whenever 16384 have come, those go that no springl's
     correspondence on the same tool is near (1 voxel): so it is bounded by the springls that there are, however often one place is
     cut. The rest keep their numbers. springls_set_reference begins anew with the present springls, in the same memory. Besides, room for a
     copy of springls and level set, to go back on failure, stays for the next combination until springls_destroy. It is kept because the
     first use of fresh memory takes about as long as the copy itself.
   - The other model must be another context. It stays as it is, but for a step in progress, which is completed first.
   EMPTY_MODEL: one of the two had no springls, and the model stays as it is; or nothing is left, and the model is empty.
   After any other failure the model is as it was before. The same as springls_combine_begin and one springls_combine_continue. */
SPRINGLS_API springls_status springls_combine(springls_context *ctx, springls_operation operation, springls_context *other);

/* Combines the solid with an implicit function, which is sampled as by springls_set_implicit, in the same way. Where that fails the
   model stays as it is. */
SPRINGLS_API springls_status springls_combine_implicit(springls_context *ctx, springls_operation operation,
                                                       springls_implicit_fn fn, void *user);

/* Begins what springls_combine does, in as many calls of springls_combine_continue as the caller likes, with the same bits. Completes a
   step, an update of chunks or a combination in progress; takes the step that springls_write waits for, and copies the other model where
   it lies in another window, undivided. The other model is borrowed until the combination is done: it may be read, but must not be
   destroyed, and if it or its attributes change, the combination fails with INVALID_ARGUMENT. Until then calls meet this model as
   they meet a model with a step in progress (springls_step_begin): queries read the model as it is at that moment; calls that change the
   model, or need it whole, complete the combination first and return its failure; inputs, springls_reset and springls_restore drop the
   combination; springls_restore takes the model as it was before. */
SPRINGLS_API springls_status springls_combine_begin(springls_context *ctx, springls_operation operation, springls_context *other);

/* Begins what springls_combine_implicit does: samples the function, undivided, into a model that it keeps until the end. */
SPRINGLS_API springls_status springls_combine_implicit_begin(springls_context *ctx, springls_operation operation,
                                                             springls_implicit_fn fn, void *user);

/* Continues the combination for about `seconds` by trace.now, as springls_step_continue does a step, and sets *done when it is
   complete. Without one in progress: OK, *done = true. A failure of the combination ends it, and the model is as it was before; one
   of the arguments, NULL or NaN, leaves it in progress. */
SPRINGLS_API springls_status springls_combine_continue(springls_context *ctx, double seconds, bool *done);

/* Returns true between springls_combine_begin or springls_combine_implicit_begin and the call that completes or drops the combination;
   false for NULL. */
SPRINGLS_API bool springls_combine_in_progress(const springls_context *ctx);
#endif

/* Writes one row of values, `channels` floats, a point into `out` for attribute number `attribute` (springls_find_attribute) of springls
   that have just been made at `count` world points. Called on the caller's thread. */
typedef void (*springls_values_fn)(void *user, int attribute, const float *points, int count, float *out);

/* Describes the level set that springls_follow_level_set follows. Zero all of it, and set fn or phi. */
typedef struct springls_follow_desc {
    springls_implicit_fn fn;   /* as for springls_set_implicit; NULL: phi                                           */
    const float *phi;          /* a dense volume as for springls_set_level_set, of the grid where it is now (follow); fn NULL */
    void *user;                /* handed to fn and values                                                           */
    springls_values_fn values; /* attributes of springls on parts that come from none; NULL: zeros                  */
    float reach;               /* voxels, at most params.band_half_width: springls within it are kept; 0: 1.5       */
    float tolerance;           /* voxels: bricks whose phi differs by less stay as they are; 0: 0.05                */
} springls_follow_desc;

#ifndef SPRINGLS_NO_TOOLS
/* Replaces the level set by another one, such as that of a fluid's particles in this frame, and keeps the springls near it: they
   are drawn onto its zero level, with their ids, correspondences and attributes. Others are removed. Bare places near them are
   filled as by SPRINGLS_STAGE_FILL_GAPS; springls of parts that no springl is near, such as new drops, are made as by an input, with the
   place where they come as correspondence, and values of desc->values. Take a step with the flow's velocity before each call, so
   that springls come along. The original surface stays. A step in progress is completed first. INVALID_ARGUMENT: also fn and phi
   both given, or neither. NON_FINITE: a value of fn or phi is NaN; one of desc->values is not finite, then the model is empty.
   EMPTY_MODEL: there are no springls, or the new level set has no zero in the grid: the model stays as it is. OUT_OF_MEMORY: also
   more than max_springls; the model may be empty. */
SPRINGLS_API springls_status springls_follow_level_set(springls_context *ctx, const springls_follow_desc *desc);

/* Grows (distance > 0) or shrinks the solid by a distance in world units, less than 10^4 times the smallest spacing: to
   all places within the distance, or further than that from the outside. Parts may meet or vanish. EMPTY_MODEL: nothing is
   left. After a failure the model is empty. */
SPRINGLS_API springls_status springls_offset(springls_context *ctx, float distance);

/* Smooths by mean curvature motion for as long as a ball of radius `length` (world units) would last: a ball of radius R ends
   with sqrt(R^2 - length^2), smaller features vanish, sharp edges become round. Steps are the longer the smoother the model
   is. keep_volume: every component keeps its volume (manual, VOLUME LOCK), and the motion ends early when all are round.
   EMPTY_MODEL: nothing is left. Other failures: as springls_run. */
SPRINGLS_API springls_status springls_smooth(springls_context *ctx, float length, bool keep_volume);

/* Makes springls of even size everywhere: splits large ones, merges crowded ones, reshapes bad ones and fills gaps until
   their number is steady. The level set stays as it is. It saves time for a mesh of triangles much smaller than a voxel.
   EMPTY_MODEL. */
SPRINGLS_API springls_status springls_remesh(springls_context *ctx);
#endif

/* ---- >>tiling:api: many bodies in one space, without gap or overlap (manual, MANY BODIES) -------------------------- */

/* Holds bodies that touch, each under a label from 1 to 65,535, on one grid. Label 0 is what is around them. The label of a place is that
   of the body whose signed distance is lowest there; label 0 has that of all bodies together, negated. So no place has two labels or
   none. Each body is a model of its own, with springls, correspondences and attributes; the wall between two bodies is two sheets of
   springls, which steps keep together. With tiling = NULL a function does as one with ctx = NULL. */
typedef struct springls_tiling springls_tiling;

#ifndef SPRINGLS_NO_TILINGS
/* Creates a tiling without bodies. desc: as for springls_create, and for every body alike; follow and window have to be zero; progress and
   trace are not called. Where tasks are given, and no backend, bodies are worked on side by side: allocator and logger are then called from
   several threads at once, and tasks.parallel_for from within its tasks, as that of springls_threads may be. With a backend bodies take
   turns on it, and walls are worked on on the host. Results do not depend on either. On failure *out is NULL, and the logger has the
   reason. */
SPRINGLS_API springls_status springls_tiling_create(const springls_desc *desc, springls_tiling **out);

/* Frees the tiling and all of its bodies; NULL is allowed. */
SPRINGLS_API void springls_tiling_destroy(springls_tiling *tiling);

/* Returns the sentence of the tiling's last failure, "" after none; it belongs to the tiling, and names the label where one is at fault.
   tiling NULL: "no tiling". */
SPRINGLS_API const char *springls_tiling_last_error(const springls_tiling *tiling);

/* Returns how many bytes the tiling and its bodies hold from the allocator. */
SPRINGLS_API size_t springls_tiling_memory_used(const springls_tiling *tiling);

/* Replaces all bodies by those of a dense label map, one label a voxel, x fastest, then y. smooth: how often each label's voxels are
   smoothed by (1 2 1) / 4 along each axis, 0 to 32, so that walls are no stairs; every voxel keeps its label. INVALID_ARGUMENT: also a
   label below 0 or above 65,535, one that touches the border of the grid, or a grid of more than 2^31 - 1 voxels. EMPTY_MODEL: all
   labels are 0, or one has too few voxels to have a surface. After a failure the tiling is as before. */
SPRINGLS_API springls_status springls_tiling_set_labels(springls_tiling *tiling, const int32_t *labels, int smooth);

/* Adds a body, sampled as by springls_set_implicit, with a new label. INVALID_ARGUMENT: also a label that is taken or out of range, a
   body that touches the border of the grid, or one that would overlap another: a voxel lies deeper than a quarter of a voxel in both;
   bodies may touch. EMPTY_MODEL, NON_FINITE: as springls_set_implicit. After a failure the tiling is as before. */
SPRINGLS_API springls_status springls_tiling_add_implicit(springls_tiling *tiling, int32_t label, springls_implicit_fn fn, void *user);

/* Adds the body that a triangle mesh bounds, as springls_set_mesh makes it; report: may be NULL. As springls_tiling_add_implicit;
   BAD_MESH, NON_FINITE: as springls_set_mesh. */
SPRINGLS_API springls_status springls_tiling_add_mesh(springls_tiling *tiling, int32_t label, const float *positions, int position_count,
                                                      size_t stride, const int *triangles, int triangle_count,
                                                      springls_mesh_report *report);

/* Returns how many bodies there are, without label 0. */
SPRINGLS_API int springls_tiling_count(const springls_tiling *tiling);

/* Returns the label of body number 0, 1, ..., springls_tiling_count - 1, ascending; -1: there is none. */
SPRINGLS_API int32_t springls_tiling_label(const springls_tiling *tiling, int number);

/* Returns the model of a label, of label 0 that of all bodies together; NULL: there is none. It belongs to the tiling, and is gone when
   the body is. Calls that read a model, and springls_add_attribute, may be used; calls that move or replace this model alone take its walls
   apart, and the next step finds anew what its springls face. Its attribute "tiling.facing" belongs to the tiling: add one less
   than SPRINGLS_MAX_ATTRIBUTES. */
SPRINGLS_API springls_context *springls_tiling_body(const springls_tiling *tiling, int32_t label);

/* Writes the label that each springl of a label's model faces, in springl order: that of the body whose sheet lies before it, else 0; -1:
   not known, as of springls that have faced a body that is gone. out: of springls_count of that model. INVALID_ARGUMENT: also a label
   without a body. */
SPRINGLS_API springls_status springls_tiling_facing(springls_tiling *tiling, int32_t label, int32_t *out);
#endif

/* Holds a batch of points of the springls of one label. batch: as callbacks of springls_forces get it, but that normals point out of the
   label into what it faces, for label 0 too. Both sides of a wall are asked, each by itself: the label and what it faces are exchanged. */
typedef struct springls_tiling_batch {
    int32_t label;
    const int32_t *facing; /* of each point: the label that its springl faces; -1: not known                         */
    springls_batch batch;
} springls_tiling_batch;

/* Evaluates a velocity, 3 floats a point, or a pressure, 1 float. Called like springls_batch_fn. The two sides of a wall should get the
   same velocity, and pressures that differ in sign, such as p[label] - p[facing]; where they do not, sheets meet half way. */
typedef void (*springls_tiling_fn)(void *user, const springls_tiling_batch *batch, float *out);

/* Holds the volume of a body in steps. Zero all but the label, and hand the same to every step: snapshots do not have it. A body at the
   border of the grid cannot be held, and neither can a label twice. */
typedef struct springls_tiling_hold {
    int32_t label;
    double target;                   /* world units^3; 0: what the body has when the step begins, which is written here */
    double volume;                   /* written: what the body had when the step began, by the walls of the tiling     */
    double pressure;                 /* written: above that of label 0; tension over world units                      */
    double drift;                    /* written, and read by the next step: what is aimed for beyond the target, because steps lose
                                        about as much; world units^3                                                  */
} springls_tiling_hold;

/* Returns the factor of the wall between two labels, the lower one first: its tension is the factor times that of the description. 0 or
   more. Called by the thread of the caller, for each triangle of the walls. */
typedef float (*springls_tension_fn)(void *user, int32_t low, int32_t high);

/* Names what becomes of two bodies that come near each other: what is between them parts, and they share a wall; or they become one. */
typedef enum springls_film { SPRINGLS_FILM_PART, SPRINGLS_FILM_JOIN } springls_film;

/* Returns what becomes of two bodies, and how near to each other they come before: *rupture_thickness, voxels, 0 to 0.9, is 0.06 when it is
   called, the lower label first. Two that share a wall join at once, unless the thickness is 0. Called from several threads at once. */
typedef springls_film (*springls_film_fn)(void *user, int32_t low, int32_t high, float *rupture_thickness);

/* Describes a step of a tiling. Zero all of it. */
typedef struct springls_tiling_step_desc {
    springls_tiling_fn velocity;     /* sigma, world units a unit of time; NULL: none                                */
    springls_tiling_fn pressure;     /* rho, along the normals of the batch; NULL: none                              */
    void *user;                      /* handed to all of them                                                        */
    float tension;                   /* surface tension, world units^2 a unit of time: walls move by it times the sum of both
                                        principal curvatures                                                          */
    springls_tension_fn tension_of;  /* the factor of each wall; NULL: 1                                             */
    springls_film_fn film;           /* what becomes of bodies that come near each other, where sheets are drawn together; NULL: they
                                        share a wall                                                                  */
    springls_tiling_hold *held;      /* the bodies whose volumes are held; a label that is gone is passed over       */
    int held_count;
    springls_integrator integrator;
    float region_lower[3], region_upper[3]; /* world: springls whose particle is outside this box when a step or sub-step begins are not
                                        moved by velocity and pressure; bodies that are at rest elsewhere cost nothing. What is elsewhere
                                        is found by bricks of 8^3 voxels; label 0 takes part where it is touched, and with film all
                                        bodies do. Both all zero: everywhere; they have to be with tension or held volumes */
    bool voxel_units;                /* true: batches, velocity, pressure and region are in voxels, as with springls_forces.voxel_units */
    float dt;                        /* time to advance; 0: none passes, and the walls settle                        */
    float max_displacement;          /* voxels; as springls_step_desc.max_displacement                               */
    int wall_period;                 /* the sheets of walls are drawn together after every so many steps; 0: after every 8th with a
                                        velocity, or tension, alone, which moves both alike, else after every step    */
} springls_tiling_step_desc;

#ifndef SPRINGLS_NO_TILINGS
/* Returns a description of a step without forces: all zero. */
SPRINGLS_API springls_tiling_step_desc springls_default_tiling_step_desc(void);
#endif

/* Reports what a step did. Zeros where sheets were not looked at. */
typedef struct springls_tiling_report {
    const int32_t *vanished;         /* labels of bodies that are gone, ascending: no voxel has had their label any more. The
                                        tiling's, until the next step                                                */
    int vanished_count;
    const int32_t *met, *parted;     /* 2 labels a pair, the lower first, label 0 left out: bodies that share a wall now, and did not
                                        when sheets were last looked at, and those that do no more: changes of neighbours (T1). Not
                                        known, and so none, in the first look after a body has been set, added, joined or restored. The
                                        tiling's, until the next step                                                */
    int met_count, parted_count;     /* pairs                                                                        */
    const int32_t *joined;           /* 2 labels a pair: of the body that two have become, and the one that is gone  */
    int joined_count;
    int mirrored;                    /* springls that bodies have got from the other side of a wall, with its correspondence, which
                                        lies on the other body's original surface; attributes as in fills             */
    int faced;                       /* springls with a sheet before them                                            */
    float mean_gap, rms_gap, largest_gap; /* voxels: of those, between the two sheets of a wall, before they were drawn together */
} springls_tiling_report;

#ifndef SPRINGLS_NO_TILINGS
/* Moves all bodies from their time by dt, by SPRINGLS_MODE_FLUID, then closes walls and draws their two sheets together where they are
   more than .15 voxel apart. Bodies that come nearer than .06 voxel face each other from then on; in a step they should not come more
   than .9 voxel nearer. With tension, or volumes that are held, the vertices of the walls' mesh move at most half a voxel in a step by
   that. After 256 steps without forces or edits, of it or beside it, a body is put to rest as it is, and its walls are no longer closed.
   report: may be NULL. INVALID_ARGUMENT: also a tension or a target below 0, a label that cannot be held, a region that is none, and one
   with tension or held volumes. NON_FINITE: from a callback. EMPTY_MODEL: there are no bodies. DEVICE_FAILED: bodies that met
   this failure go on without the device. After a failure, of memory too, the tiling is as before the step, and so is what is held. */
SPRINGLS_API springls_status springls_tiling_step(springls_tiling *tiling, const springls_tiling_step_desc *step,
                                                  springls_tiling_report *report);

/* Joins two bodies that share a wall into one, of the first label, which goes; springls elsewhere keep correspondences and attributes, on
   both original surfaces together, as by springls_combine. The models of both are gone, that of the first label is new. In a step, film
   joins bodies so; the targets of two that are held add up. INVALID_ARGUMENT: also labels that share no wall. After a failure the tiling is
   as before. */
SPRINGLS_API springls_status springls_tiling_join(springls_tiling *tiling, int32_t label, int32_t other);

/* Finds the label of `count` world points. EMPTY_MODEL: there are no bodies. */
SPRINGLS_API springls_status springls_tiling_sample_labels(springls_tiling *tiling, const float *points, int count, int32_t *out);

/* Writes the label of every voxel, x fastest, then y. out: one a voxel of the grid. EMPTY_MODEL: there are no bodies. */
SPRINGLS_API springls_status springls_tiling_copy_labels(springls_tiling *tiling, int32_t *out);
#endif

/* Holds measures of a body. Labels and voxels are exact. Volume and area, as meshes of springls_tiling_body, are those of each model
   alone, which overlap a little, or leave a gap, where the two sheets of a wall are not in one place. */
typedef struct springls_tiling_measures {
    int32_t label;
    int springls;
    int64_t voxels;                  /* whose label it is                                                            */
    double volume, area;             /* of its watertight surface, world units, as springls_measure                  */
} springls_tiling_measures;

#ifndef SPRINGLS_NO_TILINGS
/* Measures all bodies, in the order of springls_tiling_label: one a body. EMPTY_MODEL: there are no bodies. */
SPRINGLS_API springls_status springls_tiling_measure(springls_tiling *tiling, springls_tiling_measures *out);
#endif

/* Holds the walls of a tiling as one mesh, world coordinates. Walls share the vertices where they meet. */
typedef struct springls_walls {
    float *positions;  int vertex_count;    /* 3 a vertex                                                            */
    int *triangles;    int triangle_count;  /* 3 a triangle, counter-clockwise seen from its second label            */
    int32_t *labels;                        /* 2 a triangle: what is behind it, and what is in front                 */
    int *edges;        int edge_count;      /* 2 vertices an edge: sides of triangles along which three or more walls meet */
    int *corners;      int corner_count;    /* vertices where other than two of these edges end                      */
    size_t bytes;                           /* of the block that holds them                                          */
} springls_walls;

#ifndef SPRINGLS_NO_TILINGS
/* Makes the mesh of all walls: one vertex in each cube of voxels that has several labels, and one more in each wall between two voxels that
   needs four triangles instead of two, so that no triangle crosses another. So mesh generators take it (tetgen -pA fills every
   region). Regions are those of voxels that are neighbours along an axis; two that touch beside that share vertices or edges. Walls end
   at the outermost voxels. Free it by springls_walls_free. On failure *walls is all zero. INVALID_ARGUMENT: also a grid of more than
   2^31 - 1 voxels. EMPTY_MODEL: there are no bodies. */
SPRINGLS_API springls_status springls_tiling_extract(springls_tiling *tiling, springls_walls *walls);

/* Frees the arrays of springls_tiling_extract, and zeroes the structure; NULL is allowed. */
SPRINGLS_API void springls_walls_free(springls_tiling *tiling, springls_walls *walls);
#endif

/* Holds the closest place of a wall to a point, world coordinates and units. */
typedef struct springls_wall_hit {
    float point[3], distance;               /* FLT_MAX: there is no wall                                             */
    int32_t labels[2];                      /* of the wall there, the lower one first; -1: there is none             */
} springls_wall_hit;

#ifndef SPRINGLS_NO_TILINGS
/* Finds the closest place of any wall to `count` world points. It makes the mesh of all walls (springls_tiling_extract), whose places they
   are, and a hierarchy of its triangles: call it once for many points. Failures: as springls_tiling_extract; NON_FINITE: a point. */
SPRINGLS_API springls_status springls_tiling_closest_wall(springls_tiling *tiling, const float *points, int count, springls_wall_hit *out);

/* Writes the tiling into `out`, at most `capacity` bytes, and their number into *size; out NULL: the number only. A tiling of the same
   springls_desc.grid that restores it continues with the same bits, but for springls_tiling_hold, which the caller keeps. kind: as for
   springls_snapshot; a snapshot without original surfaces (FRAME) is restored only into a tiling that has its bodies, with their original
   surfaces. The bytes are a file format (docs/snapshot-format.md). INVALID_ARGUMENT: also when capacity is less than *size. */
SPRINGLS_API springls_status springls_tiling_snapshot(springls_tiling *tiling, springls_snapshot_kind kind, void *out, size_t capacity,
                                                      size_t *size);

/* Replaces all bodies by those of a snapshot. Labels that the tiling has keep their contexts (springls_tiling_body); contexts of
   other labels are gone. BAD_SNAPSHOT: it is no tiling's, cut short, altered, of another grid, or has what this version does not have.
   After any failure the tiling is unchanged. */
SPRINGLS_API springls_status springls_tiling_restore(springls_tiling *tiling, const void *snapshot, size_t size);

/* Returns a hash of all bodies, as springls_state_hash, and of what their springls face. NULL: 0. */
SPRINGLS_API uint64_t springls_tiling_state_hash(const springls_tiling *tiling);
#endif

/* ---- >>measures:api ------------------------------------------------------------------------------------------- */

/* Counts what has happened to the model since it was set. */
typedef struct springls_stats {
    int springls, steps, bricks; /* springls and bricks at present; steps counts every sub-step                     */
    int64_t added, split, removed, reshaped, refused; /* springls; refused: those beyond max_springls               */
    int64_t left;               /* of those removed: springls that had left the grid                                */
    int at_edges;               /* springls at sharp edges, of the input or the last step (params.keep_edges)       */
    float volume_correction;    /* smallest spacings: the largest offset of a component in the last step, at most 1.5
                                   (params.volume_lock)                                                             */
    float largest_displacement; /* voxels: of any particle in the last advect, which may be of a sub-step           */
    float moving_share;         /* share of the springls that moved by more than 0.01 voxel in it                   */
    double seconds[SPRINGLS_STAGE_COUNT]; /* by trace.now                                                           */
} springls_stats;

/* Returns the statistics. */
SPRINGLS_API springls_stats springls_get_stats(const springls_context *ctx);

/* Holds measures of the mesh of springls_extract_mesh, in world units: volume by the divergence theorem, area, bounds, topology.
   coverage: the springls' area over the mesh's; 0 if there is none. */
typedef struct springls_measures {
    double volume, area, coverage;
    float lower[3], upper[3];
    int components, euler;
} springls_measures;

/* Measures the watertight surface, as params.contouring has it. An empty model gives zeros. */
SPRINGLS_API springls_status springls_measure(springls_context *ctx, springls_measures *out);

/* Returns a 64-bit hash of springls, correspondences, ids and phi: equal states have equal hashes, whatever threads made
   them. NULL: 0. A step in progress is hashed as far as it has come; an update of chunks is completed first. */
SPRINGLS_API uint64_t springls_state_hash(const springls_context *ctx);

/* Returns true when this build fuses multiplications and additions, keeps more digits than a float has, reorders sums, or estimates
   square roots, and so breaks the promise of equal bits: compile the implementation without -ffast-math (GCC: with it the bits are
   the same), with -ffp-contract=off. */
SPRINGLS_API bool springls_fp_contract_detected(void);

/* Gives the OpenCL text of the kernels, *count strings of one line each, for hosts that build their own programs. Either
   pointer may be NULL; the text is constant. With SPRINGLS_NO_OPENCL there are none. */
SPRINGLS_API void springls_kernel_source(const char *const **strings, int *count);

#ifdef __cplusplus
}
#endif
#endif /* SPRINGLS_H */
