/* correspond.c - lays a template's springls on a subject: springl i of the template becomes springl i of the subject.
 *
 * 1. Finds the pose: rotation, translation and scale (surface_register).
 * 2. Moves the springls like a mesh. Each is pulled along the subject's signed distance; warp_fit makes one smooth displacement
 *    of these pulls, and springls_write puts every springl where that takes its corners from their places on the template.
 * 3. Runs Algorithm 2 with one_to_one and pressure = minus the signed distance: springls and level set come to rest on the
 *    surface, less than a voxel away. Open surfaces have no level set and end with step 2. */
#include "atlas/atlas.h"

#include "base/threads.h"
#include "base/vec3.h"
#include "springls/run_options.h"
#include "springls/segment_model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CELLS = 32, MAX_CELLS = 64, CENTERS = 200, WARP_STEPS = 12, LEARNING_STEPS = 20, SETTLE_STEPS = 40 };

/* ---- template ---- */

static void bounds(const struct shape_mesh *mesh, float lo[3], float hi[3])
{
    for (int k = 0; k < 3; ++k) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
    }
    for (int v = 0; v < mesh->vertex_count; ++v) {
        for (int k = 0; k < 3; ++k) {
            lo[k] = fminf(lo[k], mesh->positions[3 * v + k]);
            hi[k] = fmaxf(hi[k], mesh->positions[3 * v + k]);
        }
    }
}

/* Makes a grid with `cells` voxels along the longest side of the mesh and half as many again on every side, since subjects
 * differ. */
static bool create_model(const struct shape_mesh *mesh, int cells, const springls_params *params, springls_backend *backend,
                         double *voxel, springls_context **ctx) {
    float lo[3], hi[3];
    springls_desc desc;
    springls_params whole = atlas_smooth_params(params);
    whole.split_input = 0; /* springl i is triangle i */
    whole.keep_edges = 0;  /* sharp edges of surfaces of labels come from their voxels */
    memset(&desc, 0, sizeof desc);
    bounds(mesh, lo, hi);
    const double longest = (double)fmaxf(hi[0] - lo[0], fmaxf(hi[1] - lo[1], hi[2] - lo[2])), margin = 0.5 * longest;
    *voxel = longest / cells;
    for (int k = 0; k < 3; ++k) {
        desc.grid.size[k] = (int)ceil(((double)(hi[k] - lo[k]) + 2.0 * margin) / *voxel);
        desc.grid.spacing[k] = *voxel;
        desc.grid.origin[k] = (double)lo[k] - margin;
    }
    desc.params = &whole;
    desc.tasks = run_tasks();
    desc.backend = backend;
    const springls_status status = springls_create(&desc, ctx);
    return status == SPRINGLS_OK || atlas_fail("model: %s", springls_status_string(status));
}

static bool choose_centers(struct atlas_template *template)
{
    const struct shape_mesh *mesh = &template->mesh;
    const size_t count = (size_t)mesh->triangle_count;
    float *middles = malloc(3 * count * sizeof *middles);
    template->centers = malloc(CENTERS * sizeof *template->centers);
    template->center_points = malloc(3 * CENTERS * sizeof *template->center_points);
    template->center_normals = malloc(3 * CENTERS * sizeof *template->center_normals);
    if (!middles || !template->centers || !template->center_points || !template->center_normals) {
        free(middles);
        return atlas_no_memory();
    }
    for (size_t t = 0; t < count; ++t) {
        for (size_t k = 0; k < 3; ++k) {
            const int *c = mesh->triangles + 3 * t;
            middles[3 * t + k] = (mesh->positions[3 * (size_t)c[0] + k] + mesh->positions[3 * (size_t)c[1] + k]
                                  + mesh->positions[3 * (size_t)c[2] + k]) / 3.0f;
        }
    }
    template->center_count = points_spread(middles, mesh->triangle_count, CENTERS, template->centers);
    for (int i = 0; i < template->center_count; ++i) {
        const int *c = mesh->triangles + 3 * template->centers[i];
        float corners[9];
        for (int k = 0; k < 3; ++k) {
            memcpy(corners + 3 * k, mesh->positions + 3 * c[k], 3 * sizeof *corners);
        }
        vec3_triangle_normal(corners, template->center_normals + 3 * i);
        memcpy(template->center_points + 3 * i, middles + 3 * template->centers[i], 3 * sizeof *middles);
    }
    free(middles);
    return true;
}

/* Extracts the zero level of a model of the mesh. lost: the share of the mesh's vertices that are a voxel or more away from
 * it. */
static bool cut_surface(const struct shape_mesh *from, struct atlas_template *template, float *lost)
{
    const struct similarity identity = similarity_identity();
    springls_mesh surface;
    struct target target;
    memset(&surface, 0, sizeof surface);
    bool good =
        atlas_check(template->ctx,
                    springls_set_mesh(template->ctx, from->positions, from->vertex_count, 0, from->triangles,
                                      from->triangle_count, NULL),
                    "template") &&
        atlas_check(template->ctx, springls_extract_mesh(template->ctx, &surface), "template") &&
        atlas_mesh_copy(surface.positions, surface.vertex_count, surface.triangles, surface.triangle_count, &template->mesh) &&
        atlas_drop_specks(&template->mesh) >= 0;
    springls_mesh_free(template->ctx, &surface);
    const struct shape_mesh *mesh = &template->mesh;
    *lost = 1.0f;
    if (good &&
        target_create(mesh->positions, (size_t)mesh->vertex_count, mesh->triangles, (size_t)mesh->triangle_count, &target)) {
        *lost = 0.0f;
        for (int v = 0; v < from->vertex_count; ++v) {
            struct target_hit hit;
            target_nearest(&target, &identity, from->positions + 3 * v, &hit);
            *lost += fabsf(hit.signed_distance) > (float)template->voxel ? 1.0f / (float)from->vertex_count : 0.0f;
        }
        target_free(&target);
    }
    return good;
}

bool atlas_template_create(const struct shape_mesh *from, bool open, bool cut, int cells, const springls_params *params,
                           springls_backend *backend, struct atlas_template *template)
{
    double center[3];
    float lost = 1.0f;
    bool good = true;
    memset(template, 0, sizeof *template);
    template->open = open;
    const bool given = cells > 0;
    for (cells = given ? cells : CELLS; good && lost > 0.002f;
         cells *= 2) { /* finer until almost nothing is lost, such as thin plates */
        springls_destroy(template->ctx);
        atlas_mesh_free(&template->mesh);
        template->ctx = NULL;
        good = create_model(from, cells, params, backend, &template->voxel, &template->ctx);
        if (good && cut && !open) {
            good = cut_surface(from, template, &lost);
        } else {
            lost = 0.0f;
        }
        template->cells = cells;
        if (given || cells >= MAX_CELLS) {
            lost = 0.0f;
        }
    }
    if (good && (!cut || open)) {
        good = atlas_mesh_copy(from->positions, from->vertex_count, from->triangles, from->triangle_count, &template->mesh);
    }
    template->normals = good ? malloc(3 * (size_t)template->mesh.vertex_count * sizeof *template->normals) : NULL;
    if (!template->normals) {
        return good && atlas_no_memory();
    }
    const struct shape_mesh *mesh = &template->mesh;
    mesh_normals(mesh->positions, (size_t)mesh->vertex_count, mesh->triangles, (size_t)mesh->triangle_count, template->normals);
    shape_size(mesh->positions, (size_t)mesh->vertex_count, center, &template->size);
    return choose_centers(template);
}

void atlas_template_free(struct atlas_template *template)
{
    atlas_mesh_free(&template->mesh);
    springls_destroy(template->ctx);
    free(template->normals);
    free(template->centers);
    free(template->center_points);
    free(template->center_normals);
    free(template->landmarks);
    memset(template, 0, sizeof *template);
}

/* ---- forces ---- */

struct motion {
    const springls_context *ctx;
    const struct target *target;
    const struct similarity *pose;
    const float *landmarks;
    struct warp warp;
    int steps; /* of the warp */
    float voxel;
};

/* Pushes towards the subject's surface, at most one voxel in a unit of time. */
static void press(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    const struct motion *f = user;
    (void)normals;
    (void)time;
    for (int i = 0; i < count; ++i) {
        struct target_hit hit;
        float place[3];
        springls_to_world(f->ctx, points + 3 * i, 1, place);
        target_nearest(f->target, f->pose, place, &hit);
        out[i] = fmaxf(-1.0f, fminf(1.0f, -hit.signed_distance / f->voxel));
    }
}

/* ---- moving ---- */

static const float *item(springls_view view, int index)
{
    return (const float *)(const void *)((const char *)view.data + (size_t)index * view.stride);
}

/* Collects the present places of the warps' centers and the normals of their springls. */
static void look_at_centers(const struct atlas_template *template, float *now, float *normals)
{
    const springls_view particles = springls_view_particles(template->ctx), vertices = springls_view_vertices(template->ctx);
    for (int i = 0; i < template->center_count; ++i) {
        springls_to_world(template->ctx, item(particles, template->centers[i]), 1, now + 3 * i);
        vec3_triangle_normal(item(vertices, template->centers[i]), normals + 3 * i);
    }
}

/* Copies the corners of all springls, 9 floats each in mm. */
static float *copy_corners(const springls_context *ctx)
{
    const springls_view vertices = springls_view_vertices(ctx);
    float *corners = malloc(9 * (size_t)vertices.count * sizeof *corners);
    for (int i = 0; corners && i < vertices.count; ++i) {
        springls_to_world(ctx, item(vertices, i), 3, corners + 9 * (size_t)i);
    }
    return corners;
}

/* Returns for each corner the first one at the same vertex of the template, or itself; NULL if memory is short. count: all corners, of
 * which those of the mesh are the first. */
static int *first_corners(const struct shape_mesh *mesh, int count)
{
    int *firsts = malloc(((size_t)count + 1) * sizeof *firsts), *of_vertex = malloc(((size_t)mesh->vertex_count + 1) * sizeof *of_vertex);
    for (int v = 0; of_vertex && v < mesh->vertex_count; ++v) {
        of_vertex[v] = -1;
    }
    for (int c = 0; firsts && of_vertex && c < count; ++c) {
        int *first = c < 3 * mesh->triangle_count ? &of_vertex[mesh->triangles[c]] : NULL;
        if (first && *first < 0) {
            *first = c;
        }
        firsts[c] = first ? *first : c;
    }
    free(of_vertex);
    if (!firsts || !of_vertex) {
        free(firsts);
        return NULL;
    }
    return firsts;
}

struct put_loop {
    springls_context *ctx;
    const struct warp *warp;
    const float *corners;
    const int *firsts;
    float *moved;
};

static void run_put_loop(void *arg, int begin, int end)
{
    const struct put_loop *loop = arg;
    for (int c = begin; c < end; ++c) {
        if (loop->firsts[c] == c) {
            float *moved = loop->moved + 3 * (size_t)c;
            warp_apply(loop->warp, loop->corners + 3 * (size_t)c, moved, NULL);
            springls_to_voxel(loop->ctx, moved, 1, moved);
        }
    }
}

/* Puts every springl where the displacement takes it from its corners on the template. firsts: by first_corners, because the displacement
 * takes long. moved: room for as many. */
static bool put_springls(springls_context *ctx, const struct warp *warp, const float *corners, const int *firsts, float *moved)
{
    const int count = springls_count(ctx);
    struct put_loop loop = {ctx, warp, corners, firsts, moved};
    threads_for(3 * count, 64, run_put_loop, &loop);
    for (int c = 0; c < 3 * count; ++c) {
        memcpy(moved + 3 * (size_t)c, moved + 3 * (size_t)firsts[c], 3 * sizeof *moved);
    }
    return atlas_check(ctx, springls_write(ctx, 0, count, moved, NULL), "displacement");
}

static bool move_like_a_mesh(struct atlas_template *template, struct motion *motion)
{
    const size_t count = 3 * (size_t)template->center_count;
    float *now = malloc(2 * count * sizeof *now), *corners = copy_corners(template->ctx);
    float *moved = malloc(9 * (size_t)springls_count(template->ctx) * sizeof *moved);
    int *firsts = first_corners(&template->mesh, 3 * springls_count(template->ctx));
    bool good = (now && corners && moved && firsts) || atlas_no_memory();
    for (int s = 0; good && s < motion->steps; ++s) {
        look_at_centers(template, now, now + count);
        good = (warp_fit(&motion->warp, motion->target, motion->pose, now, now + count, motion->landmarks)
                || atlas_fail("the displacement's equations cannot be solved"))
            && put_springls(template->ctx, &motion->warp, corners, firsts, moved);
    }
    free(now);
    free(corners);
    free(moved);
    free(firsts);
    return good;
}

static bool run_to_rest(struct atlas_template *template, struct motion *motion, int *steps)
{
    const springls_forces push = {.pressure = press, .user = motion, .voxel_units = true,
                                  .integrator = SPRINGLS_INTEGRATOR_EULER};
    const springls_step_desc step = {.forces = &push, .mode = SPRINGLS_MODE_FLUID, .dt = 0.5f, .max_displacement = 0.5f,
                                     .one_to_one = true};
    bool good = atlas_check(template->ctx, springls_run_stage(template->ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED), "level set");
    bool moving = true;
    for (int s = 0; good && moving && s < SETTLE_STEPS; ++s) {
        good = atlas_check(template->ctx, springls_step(template->ctx, &step), "pressure");
        moving = springls_get_stats(template->ctx).moving_share > 0.01f;
        ++*steps;
    }
    return good;
}

/* Sets each vertex of the mesh to the mean of the corners that springls have there. */
static bool weld(const struct atlas_template *template, float *positions)
{
    const struct shape_mesh *mesh = &template->mesh;
    const springls_view vertices = springls_view_vertices(template->ctx);
    int *corners = calloc((size_t)mesh->vertex_count + 1, sizeof *corners);
    if (!corners) {
        return atlas_no_memory();
    }
    memset(positions, 0, 3 * (size_t)mesh->vertex_count * sizeof *positions);
    for (int c = 0; c < 3 * mesh->triangle_count; ++c) {
        const int v = mesh->triangles[c];
        float place[3];
        springls_to_world(template->ctx, item(vertices, c / 3) + 3 * (c % 3), 1, place);
        vec3_add_scaled(positions + 3 * v, 1.0f, place, positions + 3 * v);
        corners[v]++;
    }
    for (int v = 0; v < mesh->vertex_count; ++v) {
        for (int k = 0; k < 3; ++k) {
            positions[3 * v + k] /= (float)(corners[v] > 0 ? corners[v] : 1);
        }
    }
    free(corners);
    return true;
}

/* Sets the model from the template and checks that triangle t of the mesh became springl t. */
static bool set_template(struct atlas_template *template)
{
    const struct shape_mesh *mesh = &template->mesh;
    springls_mesh_report report;
    if (!atlas_check(template->ctx, springls_set_mesh(template->ctx, mesh->positions, mesh->vertex_count, 0, mesh->triangles,
                                                      mesh->triangle_count, &report), "template")) {
        return false;
    }
    return (report.triangles_dropped == 0 && !report.flipped && springls_count(template->ctx) >= mesh->triangle_count)
        || atlas_fail("template: %s", report.flipped ? "it is inside out" : "triangles without an area");
}

/* Copies the springls' particles to the subject's coordinates. */
static bool copy_particles(const struct atlas_template *template, struct atlas_subject *subject)
{
    const springls_view particles = springls_view_particles(template->ctx);
    const size_t count = (size_t)template->mesh.triangle_count;
    free(subject->particles);
    subject->particles = malloc((3 * count + 1) * sizeof *subject->particles);
    for (size_t i = 0; subject->particles && i < count; ++i) {
        springls_to_world(template->ctx, item(particles, (int)i), 1, subject->particles + 3 * i);
    }
    if (subject->particles) {
        similarity_apply_all(&subject->pose, subject->particles, count, subject->particles);
    }
    return subject->particles || atlas_no_memory();
}

static void measure(const struct atlas_template *template, struct atlas_subject *subject)
{
    double sum = 0.0, worst = 0.0;
    int counted = 0;
    for (int v = 0; v < template->mesh.vertex_count; ++v) {
        struct target_hit hit;
        target_nearest(&subject->target, &subject->pose, subject->shape + 3 * v, &hit);
        const double distance = fabs((double)hit.signed_distance) * subject->pose.scale;
        counted += !hit.on_rim;
        sum += hit.on_rim ? 0.0 : distance;
        worst = fmax(worst, hit.on_rim ? 0.0 : distance);
    }
    subject->mean_distance = counted > 0 ? sum / counted : (double)NAN;
    subject->largest_distance = worst;
}

bool atlas_correspond(struct atlas_template *template, struct atlas_subject *subject, enum orientation orientation)
{
    const bool exact = !subject->labels.data && !template->open; /* beyond a rim nothing stops an open surface that slides */
    const struct fit_source source = {template->center_points, template->center_normals, template->landmarks,
                                      template->center_count, template->landmark_count, template->size,
                                      exact ? &warp_prior_exact : &warp_prior_rough};
    struct motion motion = {.ctx = template->ctx, .target = &subject->target, .pose = &subject->pose,
                            .landmarks = subject->landmarks, .steps = exact ? LEARNING_STEPS : WARP_STEPS,
                            .voxel = (float)template->voxel};
    const size_t vertices = (size_t)template->mesh.vertex_count;
    free(subject->shape);
    subject->shape = malloc(3 * vertices * sizeof *subject->shape);
    if (!subject->shape) {
        return atlas_no_memory();
    }
    if (!surface_register(&subject->target, &source, orientation, subject->landmarks, &subject->pose, &subject->cost)) {
        return atlas_fail("%s: cannot be laid on the template", subject->name);
    }
    bool good = warp_create(source.points, source.count, source.landmarks, source.landmark_count, source.size, source.prior,
                            &motion.warp)
             || atlas_no_memory();
    subject->steps = motion.steps;
    good = good && set_template(template) && move_like_a_mesh(template, &motion)
        && (template->open || run_to_rest(template, &motion, &subject->steps)) && weld(template, subject->shape)
        && copy_particles(template, subject);
    if (good) {
        measure(template, subject);
        similarity_apply_all(&subject->pose, subject->shape, vertices, subject->shape);
    }
    warp_free(&motion.warp);
    return good;
}
