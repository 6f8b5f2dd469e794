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

/* Linkage. SPRINGLS_STATIC: everything private to this file. SPRINGLS_DLL: exported from (implementation) or imported
   into (user) a shared library. SPRINGLS_NAMESPACE=foo: every public function is called foo_springls_... at link time. */
#ifndef SPRINGLS_API
#if defined(SPRINGLS_STATIC)
#if defined(__GNUC__)
#define SPRINGLS_API __attribute__((unused)) static
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
#define SPRINGLS_API __attribute__((visibility("default"))) extern
#else
#define SPRINGLS_API extern
#endif
#endif

/* SPRINGLS__NAMESPACE_RENAMES */

#ifdef __cplusplus
extern "C" {
#endif

/* ---- >>status:api --------------------------------------------------------------------------------------------- */

/* Every call that can fail returns one of these: zero is success, all failures are negative.
   springls_last_error() has the sentence that belongs to the last failure of a context. */
typedef enum springls_status {
    SPRINGLS_OK = 0,
    SPRINGLS_INVALID_ARGUMENT = -1, /* NULL, a size out of range, parameters that were not made by a *_params() call    */
    SPRINGLS_OUT_OF_MEMORY = -2,    /* the allocator returned NULL; the context is usable, its model may be incomplete */
    SPRINGLS_BAD_MESH = -3,         /* an index out of range, no triangle with an area, or none in the grid             */
    SPRINGLS_NON_FINITE = -4,       /* NaN or infinity in the input, or returned by a force callback                   */
    SPRINGLS_EMPTY_MODEL = -5,      /* no springls, or an input without a surface in the grid                          */
    SPRINGLS_DEVICE_FAILED = -7,           /* the backend's device failed: the context goes on without it. A step or stage has been
                                       ended by scalar code; ask again for a mesh, an answer, or an input. last_error says if
                                       the model could not be brought back: then it is empty                             */
    SPRINGLS_CANCELLED = -6,        /* the progress callback asked to stop: model as after the last step; inputs: empty */
    SPRINGLS_BAD_SNAPSHOT = -8      /* springls_restore: damaged, or of another grid; the model is as it was            */
} springls_status;

/* A constant English phrase for any status; never NULL. */
SPRINGLS_API const char *springls_status_string(springls_status status);

/* SPRINGLS_VERSION of the implementation, and the same as "major.minor.patch". */
SPRINGLS_API int springls_version(void);
SPRINGLS_API const char *springls_version_string(void);

/* ---- >>host:api: what the caller may supply. Zero-initialised members mean the default ------------------------ */

/* Memory. alloc returns at least `size` bytes aligned to 64, or NULL; free gets the same size back.
   Both NULL: malloc. Only called from the thread that calls the library. */
typedef struct springls_allocator {
    void *(*alloc)(size_t size, void *user);
    void (*free)(void *memory, size_t size, void *user);
    void *user;
} springls_allocator;

/* Threads. parallel_for must run task(arg, begin, end) over disjoint ranges covering [0, count), in any order, on any
   threads, and return when all are done. `grain` is the smallest range worth a task. NULL: OpenMP when compiled with
   it, else the calling thread. Results do not depend on how the ranges are cut. */
typedef void (*springls_task)(void *arg, int begin, int end);
typedef struct springls_tasks {
    void (*parallel_for)(void *user, int count, int grain, springls_task task, void *arg);
    void *user;
} springls_tasks;

/* Log. level: 1 error, 2 warning, 3 information. message is one line, valid during the call. NULL: silence. */
typedef struct springls_logger {
    void (*log)(void *user, int level, const char *message);
    void *user;
} springls_logger;

/* Called after every step of springls_run, and during springls_set_mesh and _set_implicit. fraction is in [0,1]. Return
   non-zero to cancel. */
typedef struct springls_progress {
    int (*report)(void *user, float fraction);
    void *user;
} springls_progress;

/* Called before (begin = 1) and after (begin = 0) every stage; seconds is the stage's time, 0 at its begin.
   now: a clock in seconds; NULL: OpenMP's wall clock when compiled with it, else C's processor time. */
typedef struct springls_trace {
    void (*stage)(void *user, int stage, int begin, double seconds);
    double (*now)(void *user);
    void *user;
} springls_trace;

/* ---- >>parameters:api ----------------------------------------------------------------------------------------- */

#include "../../kernels_embed/interface/parameters.h"

/* What we recommend: accurate tracking, topology change and speed at once. */
SPRINGLS_API springls_params springls_default_params(void);

/* The paper's rules and constants (eq. 1-26, Table 1). The manual's chapter DEVIATIONS lists what differs. */
SPRINGLS_API springls_params springls_paper_params(void);

/* ---- >>life_cycle:api ----------------------------------------------------------------------------------------- */

typedef struct springls_context springls_context;

/* The voxel grid in the world. Voxel (i,j,k) has its centre at world = origin + direction * (spacing .* (i,j,k)).
   The model ends half a voxel beyond the outermost centres. */
typedef struct springls_grid_desc {
    int size[3];         /* voxels, 4..4096 a side                                                              */
    double spacing[3];   /* world units a voxel; all zero: 1                                                    */
    double origin[3];    /* world position of voxel (0,0,0)                                                     */
    double direction[9]; /* row-major, columns are the axes' unit vectors; all zero: identity                   */
} springls_grid_desc;

/* Where the stages run, made by springls_cl_create of springls_cl.h. One may serve several contexts of one thread, and must
   outlive them. */
typedef struct springls_backend springls_backend;

typedef struct springls_desc {
    springls_grid_desc grid;
    const springls_params *params; /* copied; NULL: springls_default_params()                                   */
    int max_springls;              /* more are refused and counted (set_springls: refused); 0: 64 million; set_mesh takes any number */
    springls_allocator allocator;
    springls_tasks tasks;
    springls_logger logger;
    springls_progress progress;
    springls_trace trace;
    springls_backend *backend;     /* NULL: here, by scalar code and `tasks`                                    */
} springls_desc;

/* Makes an empty model. On failure *out is NULL and nothing is left allocated. A context belongs to one thread at a
   time; different contexts are independent. There is no global state. */
SPRINGLS_API springls_status springls_create(const springls_desc *desc, springls_context **out);
SPRINGLS_API void springls_destroy(springls_context *ctx); /* NULL is allowed */

/* Back to an empty model; keeps memory and parameters. */
SPRINGLS_API springls_status springls_reset(springls_context *ctx);

/* The sentence for the last failure, "" after none; belongs to the context. With ctx = NULL: "no context". */
SPRINGLS_API const char *springls_last_error(const springls_context *ctx);

/* Parameters may be read and replaced between any two calls, band_half_width only while there is no model.
   INVALID_ARGUMENT names the member that is out of range; nothing changes then. */
SPRINGLS_API springls_params springls_get_params(const springls_context *ctx);
SPRINGLS_API springls_status springls_set_params(springls_context *ctx, const springls_params *params);

/* Points, 3 floats each, between world and voxel coordinates. in and out may be the same. */
SPRINGLS_API void springls_to_voxel(const springls_context *ctx, const float *world, int count, float *voxel);
SPRINGLS_API void springls_to_world(const springls_context *ctx, const float *voxel, int count, float *world);

/* Bytes now held from the allocator. */
SPRINGLS_API size_t springls_memory_used(const springls_context *ctx);

/* ---- >>input:api: each call replaces the model and makes it its own reference (a_n = p_n, phi_ref = phi) ------ */

/* What springls_set_mesh found. Everything but `triangles_dropped` describes the input after welding equal points. */
typedef struct springls_mesh_report {
    int triangles_dropped;   /* no area, or a repeated corner                                                   */
    int boundary_edges;      /* edges of one triangle: the surface is open there                                */
    int nonmanifold_edges;   /* edges of three or more triangles                                                */
    int misoriented_edges;   /* edges whose two triangles run the same way along it                             */
    int components;
    bool closed;             /* no boundary, non-manifold or misoriented edge                                   */
    bool flipped;            /* the input was inside out and has been turned                                    */
    bool used_winding;       /* not closed: inside is where the generalised winding number exceeds one half     */
    double volume, area;     /* world units                                                                     */
} springls_mesh_report;

/* Indexed triangle mesh, world coordinates, counter-clockwise seen from outside. `stride` is the bytes from one
   position to the next (0: 12). Every triangle becomes a springl (section 4.1), without loss. Steps expect them about as large as a voxel: a
   mesh of larger ones needs springls_resample, until the count stops growing, before its first step. An inside-out, open or
   dirty mesh is repaired as `report` says (report may be NULL). Triangles are dropped only if they have no area. Holes are
   closed by a film, whose springls follow those of the triangles.
   BAD_MESH: index out of range, nothing left. NON_FINITE: a used position is. */
SPRINGLS_API springls_status springls_set_mesh(springls_context *ctx, const float *positions, int position_count,
                                               size_t stride, const int *triangles, int triangle_count,
                                               springls_mesh_report *report);

/* Dense signed distance or any function negative inside, one float a voxel, x fastest. Re-distanced near its zero. */
SPRINGLS_API springls_status springls_set_level_set(springls_context *ctx, const float *phi);

/* The voxels of a label map equal to `label` (label < 0: all that are not 0). One int32 a voxel, x fastest. */
SPRINGLS_API springls_status springls_set_labels(springls_context *ctx, const int32_t *labels, int32_t label);

/* The voxels with low <= intensity <= high; NaN is outside. The surface is placed by interpolating the intensity. */
SPRINGLS_API springls_status springls_set_threshold(springls_context *ctx, const float *intensity, float low, float high);

/* An implicit function, negative inside, asked in batches of world points (3 floats each). Of Lipschitz constant 1: a signed
   distance, or a lower bound of one; parts of a steeper function's surface are missed. Never stored densely. */
typedef void (*springls_implicit_fn)(void *user, const float *points, int count, float *out);
SPRINGLS_API springls_status springls_set_implicit(springls_context *ctx, springls_implicit_fn fn, void *user);

/* Ready-made shapes for springls_set_implicit: pass the function and a pointer to the structure. World units. */
typedef struct springls_sphere { float center[3], radius; } springls_sphere;
typedef struct springls_box { float center[3], half[3]; } springls_box;
typedef struct springls_torus { float center[3], axis[3], major, minor; } springls_torus;
typedef struct springls_metasphere { const springls_sphere *spheres; int count; } springls_metasphere; /* merged spheres */
typedef struct springls_notched_sphere { float center[3], radius, slot_width, slot_depth; } springls_notched_sphere; /* Zalesak */
SPRINGLS_API void springls_implicit_sphere(void *sphere, const float *points, int count, float *out);
SPRINGLS_API void springls_implicit_box(void *box, const float *points, int count, float *out);
SPRINGLS_API void springls_implicit_torus(void *torus, const float *points, int count, float *out);
SPRINGLS_API void springls_implicit_metasphere(void *metasphere, const float *points, int count, float *out);
SPRINGLS_API void springls_implicit_notched_sphere(void *notched_sphere, const float *points, int count, float *out);

/* Raw springls, voxel coordinates: per springl 9 floats of vertices, 3 of particle, 3 of correspondence. particles
   NULL: centroids; correspondences NULL: the particles. The level set follows by unsigned_to_signed. */
SPRINGLS_API springls_status springls_set_springls(springls_context *ctx, const float *vertices, const float *particles,
                                                   const float *correspondences, int count);

/* Makes the present model the original: a_n = p_n, phi_ref = phi, fresh reference triangles. */
SPRINGLS_API springls_status springls_set_reference(springls_context *ctx);

/* One byte a springl: 0 relaxes, 1 keeps its shape (a kept feature, section 4.8). Follows splits. NULL: all relax. */
SPRINGLS_API springls_status springls_set_relax_mask(springls_context *ctx, const uint8_t *mask);

/* ---- >>forces:api: eq. 1 and 2, in voxels and voxels a unit of time ------------------------------------------- */

/* Batch callbacks, called from any worker at once with different ranges; never one call a point. All points are voxel
   coordinates, 3 floats each. time is the time of the Runge-Kutta stage. */
typedef void (*springls_pressure_fn)(void *user, const float *points, const float *normals, int count, float time, float *out);
typedef void (*springls_velocity_fn)(void *user, const float *points, int count, float time, float *out);
/* out: 12 floats a point, a row-major 3x4 matrix [A b]; the velocity at x is A x + b. correspondences are a_n. */
typedef void (*springls_affine_fn)(void *user, const float *points, const float *correspondences, int count, float time, float *out);

/* A sampled field: `channels` floats a sample (1 pressure, 3 velocity), x fastest, trilinear between samples, constant
   beyond them. It lies on the model's grid (size all zero) or on a grid of its own. Values are voxels of the model's
   grid a unit of time. The data is borrowed during the call. A displacement field is a velocity grid applied with
   dt = 1 and SPRINGLS_INTEGRATOR_EULER. */
typedef struct springls_sampled_field {
    const float *data;
    springls_grid_desc grid;
    unsigned version; /* with a backend: while it and data stay the same, and it is not 0, the samples are not sent again */
} springls_sampled_field;

typedef enum springls_integrator { SPRINGLS_INTEGRATOR_RK4, SPRINGLS_INTEGRATOR_EULER } springls_integrator;

typedef struct springls_forces {
    springls_pressure_fn pressure; /* rho: along the outward normal                                             */
    springls_velocity_fn velocity; /* sigma                                                                     */
    springls_affine_fn affine;     /* A(p, a)                                                                   */
    void *user;                    /* handed to all three                                                       */
    springls_sampled_field pressure_grid; /* data NULL: none; added to the callback's                           */
    springls_sampled_field velocity_grid;
    float pressure_weight;         /* lambda_rho;   0 means 1                                                   */
    float velocity_weight;         /* lambda_sigma; 0 means 1                                                   */
    float affine_weight;           /* lambda_A;     0 means 1                                                   */
    float curvature_weight;        /* motion by mean curvature of the level set, smoothing when positive        */
    springls_integrator integrator;
} springls_forces;

/* Two flows with exact answers, for tests and benchmarks; user points to the structure. */
typedef struct springls_deformation_flow { float grid_size, period; } springls_deformation_flow; /* LeVeque, x = voxel/N */
typedef struct springls_rotation_flow { float center[3], axis[3], angular_velocity; } springls_rotation_flow;
SPRINGLS_API void springls_velocity_deformation(void *deformation_flow, const float *points, int count, float time, float *out);
SPRINGLS_API void springls_velocity_rotation(void *rotation_flow, const float *points, int count, float time, float *out);

/* The largest speed of any particle now, voxels a unit of time: f_max of section 4.8. */
SPRINGLS_API springls_status springls_max_speed(springls_context *ctx, const springls_forces *forces, float time, float *speed);

/* ---- >>stages:api: Table 2, each callable alone --------------------------------------------------------------- */

SPRINGLS_API springls_status springls_advect(springls_context *ctx, const springls_forces *forces, float time, float dt);
SPRINGLS_API springls_status springls_relax(springls_context *ctx);              /* Algorithm 1, params.relax_iterations times   */
SPRINGLS_API springls_status springls_contract(springls_context *ctx);           /* section 4.6                                  */
SPRINGLS_API springls_status springls_resample(springls_context *ctx);           /* section 4.6                                  */
SPRINGLS_API springls_status springls_evolve(springls_context *ctx);             /* eq. 21-23: one Evolve, omega taken afresh    */
SPRINGLS_API springls_status springls_rebuild(springls_context *ctx);            /* re-distance phi, move the narrow band        */
SPRINGLS_API springls_status springls_fill_gaps(springls_context *ctx);          /* section 4.4, and track for what it adds      */
SPRINGLS_API springls_status springls_unsigned_to_signed(springls_context *ctx); /* section 4.5                                  */
SPRINGLS_API springls_status springls_track(springls_context *ctx);              /* eq. 26 for every correspondence              */

/* ---- >>drivers:api -------------------------------------------------------------------------------------------- */

typedef enum springls_mode {
    SPRINGLS_MODE_FLUID,      /* Algorithm 2: active contour                                                         */
    SPRINGLS_MODE_ELASTIC,    /* Algorithm 3: steps of any size                                                      */
    SPRINGLS_MODE_ADVECT_ONLY /* "behaves like a mesh": springls move, the level set stays                           */
} springls_mode;

typedef struct springls_step_desc {
    const springls_forces *forces;
    springls_mode mode;
    float dt;               /* time to advance; 0: one step in which the fastest particle moves max_displacement */
    float max_displacement; /* voxels; dt is cut into sub-steps in which no particle goes further, adapted to the
                               force as it changes; 2 suits the default set, 1.3 where accuracy counts most,
                               0.5 the paper's; 0: never cut (d_max when dt is 0)                               */
    bool one_to_one;        /* no contract, resample or fill_gaps: springls keep their indices (section 4.8)    */
    bool stop_at_topology;  /* eq. 24-25: springls stop where the topology constraint stops the level set       */
    bool stop_at_rest;      /* springls_run ends, with OK, after a step in which at most one springl in a thousand
                               moved by more than a hundredth of a voxel: an active contour has arrived         */
} springls_step_desc;

/* One step of the chosen algorithm from the context's time. NON_FINITE leaves the model as it was before the step, or before
   the sub-step that the force failed in. */
SPRINGLS_API springls_status springls_step(springls_context *ctx, const springls_step_desc *step);

/* The same step in as many calls as you like, for a budget a frame: springls_step is the two of them without a limit, and the
   bits are the same however a step is cut. _begin checks and notes; *step and *step->forces are copied, but what the forces
   point to (user, data) is borrowed until the step is done, and callbacks come in _continue only.
   _continue works for about `seconds` by trace.now (without it: see springls_trace; C's processor time counts all threads
   together) and says whether the step is done; 0 seconds: the least it can, one part. Loops over springls and bricks are cut to
   fit, what lies between them is not: see MANUAL, FRAMES. On a device a part counts as done when it has been asked for.
   A failure ends the step, as it ends springls_step. Without a step in progress there is nothing to do: OK, *done = true.
   Between the calls the model is on its way: counts, views, ids, get_provenance, springl_materials, mesh_attribute, sample_*,
   inside, closest, raycast, surfels and the soup tell what is there now, springls that have moved and a level set that may not
   have followed yet (in SPRINGLS_MODE_ELASTIC steps it may be half made). springls_set_*, _reset and _restore drop the step with the
   model. Every other call that changes the model, or wants it whole (a stage, a step, parameters, time, mask, reference,
   max_speed, meshes, chunks, measures, snapshots), ends the step first, however long that takes, and returns its failure if it
   has one. */
SPRINGLS_API springls_status springls_step_begin(springls_context *ctx, const springls_step_desc *step);
SPRINGLS_API springls_status springls_step_continue(springls_context *ctx, double seconds, bool *done);
SPRINGLS_API bool springls_step_in_progress(const springls_context *ctx);

/* `steps` steps with progress reports. */
SPRINGLS_API springls_status springls_run(springls_context *ctx, const springls_step_desc *step, int steps);

SPRINGLS_API double springls_time(const springls_context *ctx);
SPRINGLS_API void springls_set_time(springls_context *ctx, double time); /* one that is not finite is ignored */

/* ---- >>snapshots:api: undo, rollback, files -------------------------------------------------------------------- */

/* A model as one block of bytes: springls, level set, attributes, parameters, time, statistics. A context of the same grid
   (size and place in the world) that is given the block goes on as this one would have, to the bit: on another backend, with
   other threads, on another machine of the same byte order. Not in it: what springls_desc holds, forces, meshes and chunks
   that have been made. */
typedef enum springls_snapshot_kind {
    SPRINGLS_SNAPSHOT_ALL,  /* all of it                                                                        */
    SPRINGLS_SNAPSHOT_FRAME /* without the original surface and its level set, which stay the same from input (set_reference,
                               combine) to input: smaller and made faster, for undo and rollback. Restores where they are the
                               same: in this context, or one that a block with all has been restored to         */
} springls_snapshot_kind;

/* Writes the block to out, *size bytes; with out = NULL it only says how many. INVALID_ARGUMENT: room is less. */
SPRINGLS_API springls_status springls_snapshot(springls_context *ctx, springls_snapshot_kind kind, void *out, size_t room,
                                               size_t *size);

/* BAD_SNAPSHOT: cut short, altered, of another version or grid; OUT_OF_MEMORY: either way the model stays as it was. */
SPRINGLS_API springls_status springls_restore(springls_context *ctx, const void *block, size_t size);

/* ---- >>read:api: views are voxel coordinates and stay valid until the next call that changes the model -------- */

typedef struct springls_view { const float *data; int count; size_t stride; } springls_view; /* stride in bytes */

SPRINGLS_API int springls_count(const springls_context *ctx);
SPRINGLS_API springls_view springls_view_vertices(const springls_context *ctx);        /* 9 floats: q0 q1 q2         */
SPRINGLS_API springls_view springls_view_particles(const springls_context *ctx);       /* 3 floats: p                */
SPRINGLS_API springls_view springls_view_correspondences(const springls_context *ctx); /* 3 floats: a                */

/* Stable identity, never reused: one per springl, in springl order. And where it came from: 0 an original springl,
   1 or more: splits and fills between it and one. */
SPRINGLS_API const uint32_t *springls_ids(const springls_context *ctx);
SPRINGLS_API const uint32_t *springls_generations(const springls_context *ctx);

/* The paper's 4x4 rows (eq. 27), 16 floats a springl: p phi | q1 a.x | q2 a.y | q3 a.z. */
SPRINGLS_API springls_status springls_pack_matrix(springls_context *ctx, float *out);

/* Surfels (section 2.3.2): centre 3, normal 3, radius 1: 7 floats a springl, world units. */
SPRINGLS_API springls_status springls_extract_surfels(springls_context *ctx, float *out);

/* ---- >>mesh_out:api ------------------------------------------------------------------------------------------- */

typedef struct springls_mesh {
    int vertex_count, triangle_count;
    float *positions;       /* 3 a vertex, world                                                                */
    float *normals;         /* 3 a vertex, unit, outward                                                        */
    float *correspondences; /* 3 a vertex, world: the place on the original surface                             */
    int *springls;          /* 1 a vertex: the nearest springl, -1 when none is within a voxel                  */
    int *triangles;         /* 3 a triangle, counter-clockwise seen from outside                                */
    size_t bytes;           /* for springls_mesh_free                                                           */
} springls_mesh;

/* The watertight zero level: welded, closed, every edge between exactly two triangles. An empty model gives an empty
   mesh. The mesh owns its arrays, made by the context's allocator. */
SPRINGLS_API springls_status springls_extract_mesh(springls_context *ctx, springls_mesh *out);

/* The springls themselves: three vertices each, normals flat. */
SPRINGLS_API springls_status springls_extract_soup(springls_context *ctx, springls_mesh *out);

SPRINGLS_API void springls_mesh_free(springls_context *ctx, springls_mesh *mesh); /* a zeroed mesh is allowed */

/* The zero level in chunks, one a brick of 8^3 voxels, to upload only what has changed. A chunk is a small mesh of its own; where
   chunks meet each has its vertices, with the same bits, so that together they are watertight. */
typedef struct springls_chunk {
    int brick[3];            /* which: cubes of marching cubes from voxel 8 brick on, 8 a side (9 at the grid's lower border) */
    int vertex_count, triangle_count; /* 0: there is nothing any more                                           */
    float *positions;        /* 3 a vertex, world                                                               */
    float *normals;          /* 3 a vertex, unit, outward                                                       */
    float *correspondences;  /* 3 a vertex, world; NULL without desc.material                                   */
    uint32_t *ids;           /* 1 a vertex: id of the nearest springl, UINT32_MAX: none within a voxel; NULL likewise */
    uint16_t *triangles;     /* 3 a triangle, numbers of the chunk's vertices, counter-clockwise seen from outside */
} springls_chunk;

typedef struct springls_chunks_desc {
    float tolerance; /* voxels: what phi may move before its chunk counts as changed; 0: 0.05; negative: nothing, and the
                        chunks are springls_extract_mesh's mesh to the bit. Springls at rest still relax, some 0.001 voxels a
                        step, so then all chunks change in every step                                           */
    bool material;   /* correspondences and ids too: most of the time that a chunk takes                        */
} springls_chunks_desc;

/* What one consumer has been shown; any number of them. desc NULL: the defaults. Destroy it before the context. */
typedef struct springls_chunks springls_chunks;
SPRINGLS_API springls_status springls_chunks_create(springls_context *ctx, const springls_chunks_desc *desc,
                                                    springls_chunks **out);
SPRINGLS_API void springls_chunks_destroy(springls_context *ctx, springls_chunks *chunks); /* NULL is allowed */

/* The chunks that have changed since the last call, in the order of their bricks, those that are gone with no triangles: at first
   all. Whatever has happened in between (steps, inputs, restore), afterwards the chunks that the consumer has are the zero level,
   within the tolerance. They belong to `chunks` until its next call. After a failure nothing is lost: the next call tells it. */
SPRINGLS_API springls_status springls_chunks_update(springls_context *ctx, springls_chunks *chunks, const springls_chunk **changed,
                                                    int *count);

/* A dense copy of phi, in voxels, x fastest: size[0]*size[1]*size[2] floats. */
SPRINGLS_API springls_status springls_copy_level_set(springls_context *ctx, float *out);

/* ---- >>queries:api: world coordinates, batches of 3 floats a point -------------------------------------------- */

/* phi, in world units when the spacing is uniform (else in units of the smallest spacing); clamped outside the band. */
SPRINGLS_API springls_status springls_sample_distance(springls_context *ctx, const float *points, int count, float *out);
/* grad phi, world components: of unit length where phi is a distance and the spacing uniform. */
SPRINGLS_API springls_status springls_sample_gradient(springls_context *ctx, const float *points, int count, float *out);
/* 1 inside, 0 outside: one byte a point. */
SPRINGLS_API springls_status springls_sample_inside(springls_context *ctx, const float *points, int count, uint8_t *out);

/* A place on the model. `material` is the same place on the original surface: its point, the triangle of the original
   surface it lies on, and the barycentric coordinates there (section 4.7). */
typedef struct springls_hit {
    int springl;                 /* -1: nothing found                                                           */
    float point[3];              /* world                                                                       */
    float barycentric[3];        /* in the springl                                                              */
    float distance;              /* world, from the query point or along the ray                                */
    float material[3];           /* world                                                                       */
    int material_triangle;       /* of the mesh given, or of the initial springls                               */
    float material_barycentric[3];
} springls_hit;

/* The closest place of any springl, wherever the point is. Springls leave gaps between them: it may be further than the zero
   level. A point that is not finite refuses the batch; `out` stays as it was. */
SPRINGLS_API springls_status springls_closest(springls_context *ctx, const float *points, int count, springls_hit *out);
/* The first springl along each ray, from either side, up to max_distance (world units; 0: any). Rays pass through the gaps
   between springls: for a closed surface, give the mesh of springls_extract_mesh to a second context (springls_set_mesh). Directions need not be unit
   vectors; a direction of no length hits nothing. */
SPRINGLS_API springls_status springls_raycast(springls_context *ctx, const float *origins, const float *directions,
                                              int count, float max_distance, springls_hit *out);

/* ---- >>attributes:api: what springls carry, by name ----------------------------------------------------------- */

/* Any number of floats a springl: colours, texture coordinates without seams, bone weights, labels, temperature, mass. They
   belong to the model: an input or springls_reset removes them all. Without attributes nothing is computed, and with them
   nothing about the model itself changes by a bit. What becomes of the values where springls are split, filled in and merged: */
typedef enum springls_policy {
    SPRINGLS_POLICY_COPY,  /* split: of the springl that is split. fill: of the neighbour with the nearest correspondence. merge: the
                       one that stays keeps its own. For labels                                                           */
    SPRINGLS_POLICY_BLEND, /* split and fill: of the neighbours on the same side of the surface, with weights that are not negative
                       and add up to 1, and that are exact, where that is possible, for functions linear in the
                       correspondence. merge: mean of the two, weighted by area. For what is continuous                   */
    SPRINGLS_POLICY_SHARE  /* split: half each. fill: 0. merge, and removal: added to that of the nearest neighbour that stays, if
                       there is one within 2.5 voxels. For amounts, whose sum is to last                                  */
} springls_policy;

#define SPRINGLS_MAX_ATTRIBUTES 32   /* a model                        */
#define SPRINGLS_MAX_CHANNELS 1024   /* an attribute                   */
#define SPRINGLS_MAX_NAME 31         /* characters of a name, from 1 on */

typedef struct springls_attribute_desc {
    const char *name; /* of this model's attributes no other has it */
    int channels;     /* floats a springl                           */
    springls_policy split, fill, merge;
} springls_attribute_desc;

/* values: `channels` floats a springl, in springl order; NULL: zeros. *index (may be NULL): its number, 0 for the first. */
SPRINGLS_API springls_status springls_add_attribute(springls_context *ctx, const springls_attribute_desc *desc,
                                                    const float *values, int *index);
/* Those behind it have numbers smaller by one then. */
SPRINGLS_API springls_status springls_remove_attribute(springls_context *ctx, int index);
SPRINGLS_API int springls_attribute_count(const springls_context *ctx);
/* name points into the context, until an attribute is removed. INVALID_ARGUMENT: there is no such number. */
SPRINGLS_API springls_status springls_describe_attribute(springls_context *ctx, int index, springls_attribute_desc *out);
SPRINGLS_API int springls_find_attribute(const springls_context *ctx, const char *name); /* -1: none of that name */
SPRINGLS_API springls_status springls_set_attribute(springls_context *ctx, int index, const float *values); /* NULL: zeros */
SPRINGLS_API springls_view springls_view_attribute(const springls_context *ctx, int index); /* data NULL: there is none */

/* An attribute on the vertices of a mesh that springls_extract_mesh (or _soup) has made of the model as it is now: `channels`
   floats a vertex. Filled by BLEND: blended likewise; by another policy: that of the neighbour with the nearest correspondence. */
SPRINGLS_API springls_status springls_mesh_attribute(springls_context *ctx, const springls_mesh *mesh, int index, float *out);

/* How far the place and the correspondence of a springl are to be trusted, and where it came from. */
typedef enum springls_kind {
    SPRINGLS_KIND_ORIGINAL, /* of the input: exact but for the error of advection           */
    SPRINGLS_KIND_SPLIT,    /* part of one: interpolated between neighbours                 */
    SPRINGLS_KIND_FILLED    /* put into a gap, or a part of such a one: extrapolated, maybe */
} springls_kind;
typedef struct springls_provenance {
    springls_kind kind;
    int age;             /* steps since it was last given its place: by input, split or fill      */
    uint32_t generation; /* see springls_generations                                              */
    uint32_t parent;     /* id of the springl that it was split from or filled in beside; its own: none */
} springls_provenance;
SPRINGLS_API springls_status springls_get_provenance(springls_context *ctx, springls_provenance *out); /* one a springl */

/* ---- >>material:api: places on the original surface ------------------------------------------------------------ */

/* A function of the material coordinates does not wear off, whatever the motion: give the values on the mesh that was set and
   ask for the places on it. triangle: of the mesh given to springls_set_mesh, as numbered there, else of the initial springls;
   -1: none. */
typedef struct springls_material { int triangle; float barycentric[3]; } springls_material;

SPRINGLS_API springls_status springls_springl_materials(springls_context *ctx, springls_material *out); /* one a springl */
/* One a vertex of an extracted mesh. */
SPRINGLS_API springls_status springls_mesh_materials(springls_context *ctx, const springls_mesh *mesh, springls_material *out);

/* For what has seams, texture coordinates above all: one a corner, 3 a triangle, so that the three of a triangle lie on one
   side of every seam. neighbors: 3 a triangle of the original, the triangle across the edge from corner m to the next, -1 at a
   seam (springls_find_seams makes it). The centroid says which side; a corner beyond a seam is put to the nearest place before
   it. */
SPRINGLS_API springls_status springls_corner_materials(springls_context *ctx, const springls_mesh *mesh, const int *neighbors,
                                                       springls_material *out);

/* Which triangles meet at their edges: where the two corners at either end agree in their position and in their `channels` values
   (channels = 2 for texture coordinates; values may be NULL with 0). values: one row a corner. neighbors: 3 a triangle. */
SPRINGLS_API springls_status springls_find_seams(springls_context *ctx, const float *positions, int position_count, size_t stride,
                                                 const int *triangles, int triangle_count, const float *values, int channels,
                                                 int *neighbors);

/* Values at such places: barycentric means of rows of `channels` values, one a corner of the original, or with `triangles`, its
   triangles' 3 indices each, one a vertex. Where there is no triangle: zeros. Needs no context. Places
   are held against triangle_count; the indices in `triangles` are not: they are the caller's. */
SPRINGLS_API springls_status springls_interpolate_material(const springls_material *places, int count, const float *values, int channels,
                                             const int *triangles, int triangle_count, float *out);

/* How many triangles the original surface has, as numbered in materials: those given to springls_set_mesh, or the initial
   springls. */
SPRINGLS_API int springls_material_count(const springls_context *ctx);

/* ---- >>tools:api: one call each; springls that stay keep identity, correspondence and attributes --------------- */

typedef enum springls_operation { SPRINGLS_OPERATION_UNION, SPRINGLS_OPERATION_INTERSECTION, SPRINGLS_OPERATION_DIFFERENCE } springls_operation;

/* The solid becomes what the operation makes of it and another one, on the same grid and with the same band_half_width.
   Springls of both stay where they bound the result, the other's turned round in a difference; what reaches over the seam is
   drawn in, the seam is closed, and with params.keep_edges it is sharp. Attributes of the other with the name and channels of
   one here are taken over; where it has none of that name its springls get zeros. The original surface becomes both originals
   together: material triangles of the other are numbered from this one's springls_material_count (before the call) on. The
   other only changes in what queries have prepared. EMPTY_MODEL: nothing is left, and the model is empty; or one of the two had
   no springls to begin with (of a function: no zero in the grid), and the model stays as it was. When memory runs out the model
   is empty. */
SPRINGLS_API springls_status springls_combine(springls_context *ctx, springls_operation operation, springls_context *other);

/* With an implicit function in the place of the other, asked as by springls_set_implicit. */
SPRINGLS_API springls_status springls_combine_implicit(springls_context *ctx, springls_operation operation,
                                                       springls_implicit_fn fn, void *user);

/* Grows (distance > 0) or shrinks the solid by any distance, world units of a grid with uniform spacing: all places within that
   distance of it, or further than that from its outside. Parts may meet, or vanish: EMPTY_MODEL when nothing is left, and the
   model is empty. */
SPRINGLS_API springls_status springls_offset(springls_context *ctx, float distance);

/* Motion by mean curvature for as long as a ball of radius `length` (world units) lasts: what is smaller goes, sharp edges become
   round. keep_volume: each component keeps its volume (see VOLUME LOCK in the manual). */
SPRINGLS_API springls_status springls_smooth(springls_context *ctx, float length, bool keep_volume);

/* Springls of even size everywhere: large ones are split, crowded ones merged, poor ones reshaped, gaps filled, until the count
   is steady. To be called once for a mesh of triangles much larger or smaller than a voxel. */
SPRINGLS_API springls_status springls_remesh(springls_context *ctx);

/* ---- >>measures:api ------------------------------------------------------------------------------------------- */

typedef enum springls_stage {
    SPRINGLS_STAGE_ADVECT, SPRINGLS_STAGE_RELAX, SPRINGLS_STAGE_CONTRACT, SPRINGLS_STAGE_RESAMPLE, SPRINGLS_STAGE_EVOLVE,
    SPRINGLS_STAGE_REBUILD, SPRINGLS_STAGE_FILL_GAPS, SPRINGLS_STAGE_TRACK, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED,
    SPRINGLS_STAGE_PROJECT, /* of phi: params.predict, params.project_level_set */
    SPRINGLS_STAGE_KEEP_EDGES, /* params.keep_edges */
    SPRINGLS_STAGE_VOLUME_LOCK, /* params.volume_lock */
    SPRINGLS_STAGE_COUNT
} springls_stage;
SPRINGLS_API const char *springls_stage_name(springls_stage stage); /* "advect", ...; "" when out of range */

typedef struct springls_stats {
    int springls, steps, bricks; /* steps: sub-steps count, here and for params.resample_period                 */
    int64_t added, split, removed, reshaped, refused; /* since the model was set                                */
    int at_edges;            /* springls at sharp edges, of the input or the last step: params.keep_edges       */
    float volume_correction; /* params.volume_lock: largest offset of a component in the last step, voxels; 1.5
                                at most a step                                                                  */
    float moved;             /* largest displacement of the last advect (of a sub-step), voxels                 */
    float moving;            /* share of springls that moved more than 1/100 voxel in it                        */
    double seconds[SPRINGLS_STAGE_COUNT];
} springls_stats;
SPRINGLS_API springls_stats springls_get_stats(const springls_context *ctx);

/* Of the welded zero level: volume by the divergence theorem and area in world units, bounds, topology. */
typedef struct springls_measures {
    double volume, area;
    float lower[3], upper[3];
    int components, euler;
} springls_measures;
SPRINGLS_API springls_status springls_measure(springls_context *ctx, springls_measures *out);

/* A 64-bit hash of springls, correspondences and phi: equal for equal states, whatever threads made them. */
SPRINGLS_API uint64_t springls_state_hash(const springls_context *ctx);

/* True when the compiler fuses multiplications and additions in this build, which loses the promise of equal bits:
   compile the implementation with -ffp-contract=off. */
SPRINGLS_API bool springls_fp_contract_detected(void);

/* The OpenCL text of the maths, one line a string, for hosts that build their own programs. */
SPRINGLS_API void springls_kernel_source(const char *const **lines, int *count);

#ifdef __cplusplus
}
#endif
#endif /* SPRINGLS_H */
