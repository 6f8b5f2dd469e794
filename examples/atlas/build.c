/* build.c - from subjects to a point distribution model. */
#include "atlas/atlas.h"

#include "base/progress.h"
#include "base/vec3.h"
#include "springls/run_options.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool atlas_subjects_read(struct atlas_build *build)
{
    const struct atlas_build_settings *set = &build->settings;
    build->subjects = calloc((size_t)set->count, sizeof *build->subjects);
    build->shapes = calloc((size_t)set->count, sizeof *build->shapes);
    if (!build->subjects || !build->shapes) {
        return atlas_no_memory();
    }
    for (int s = 0; s < set->count; ++s) {
        if (!atlas_subject_read(set->names[s], set->images, set->landmarks, set->mirror, &build->subjects[s])) {
            return false;
        }
        if (build->subjects[s].oriented != build->subjects[0].oriented) {
            return atlas_fail("%s: meshes and label maps in one atlas", set->names[s]);
        }
        if (build->subjects[s].target.open != build->subjects[0].target.open) {
            return atlas_fail("%s: open and closed surfaces in one atlas", set->names[s]);
        }
        if (build->subjects[s].landmark_count != build->subjects[0].landmark_count) {
            return atlas_fail("%s: %d landmarks, the first subject has %d", set->names[s], build->subjects[s].landmark_count,
                              build->subjects[0].landmark_count);
        }
    }
    return true;
}

/* Chooses vertices that are far from each other as landmarks, on meshes with the same triangles: they stand for marks set by
 * hand. */
static bool choose_landmarks(struct atlas_build *build, int wanted)
{
    int chosen[ATLAS_MAX_LANDMARKS];
    if (!atlas_same_triangles(build)) {
        return atlas_fail("--vertex-landmarks is for meshes of the same triangles");
    }
    const struct shape_mesh *first = &build->subjects[0].mesh;
    const int count = points_spread(first->positions, first->vertex_count, wanted, chosen);
    for (int s = 0; s < build->settings.count; ++s) {
        struct atlas_subject *subject = &build->subjects[s];
        subject->landmark_count = count;
        subject->landmarks = malloc((3 * (size_t)count + 1) * sizeof *subject->landmarks);
        if (!subject->landmarks) {
            return atlas_no_memory();
        }
        for (int l = 0; l < count; ++l) {
            memcpy(subject->landmarks + 3 * l, subject->mesh.positions + 3 * chosen[l], 3 * sizeof *subject->landmarks);
        }
    }
    return true;
}

/* Chooses how orientations are found: by landmarks, by the patient's axes of label maps, else by a search. */
static enum orientation choose_orientation(const struct atlas_build *build)
{
    const char *said = build->settings.orientation;
    const bool known = strcmp(said, "auto") == 0 ? build->subjects[0].oriented : strcmp(said, "known") == 0;
    return build->subjects[0].landmark_count > 0 ? ORIENTATION_MARKED : known ? ORIENTATION_KNOWN : ORIENTATION_SEARCH;
}

/* Lays the template's springls on every subject. */
static bool correspond(struct atlas_build *build, int round, struct progress *bar)
{
    const struct atlas_build_settings *set = &build->settings;
    const enum orientation orientation = choose_orientation(build);
    for (int s = 0; s < set->count; ++s) {
        if (!atlas_correspond(&build->template, &build->subjects[s], orientation)) {
            return false;
        }
        progress_update(bar, (size_t)(round * set->count + s + 1), set->names[s]);
    }
    return true;
}

/* Places the template's landmarks: on the first subject in the first round, later at the mean of the aligned shapes. */
static bool place_landmarks(struct atlas_build *build, int round)
{
    const int count = build->subjects[0].landmark_count, subjects = round > 0 ? build->settings.count : 1;
    struct atlas_template *template = &build->template;
    template->landmark_count = count;
    template->landmarks = calloc(3 * (size_t)count + 1, sizeof *template->landmarks);
    if (!template->landmarks) {
        return atlas_no_memory();
    }
    for (int s = 0; s < subjects; ++s) {
        struct similarity aligned = similarity_identity();
        if (round > 0 && !similarity_fit(build->subjects[s].shape, build->shapes[s], NULL, (size_t)build->atlas.mean.vertex_count,
                                         true, &aligned)) {
            return atlas_fail("%s: no shape", build->subjects[s].name);
        }
        for (int l = 0; l < count; ++l) {
            float place[3];
            similarity_apply(&aligned, build->subjects[s].landmarks + 3 * l, place);
            vec3_add_scaled(template->landmarks + 3 * l, 1.0f / (float)subjects, place, template->landmarks + 3 * l);
        }
    }
    return true;
}

/* Aligns the shapes and computes their mean. */
static bool align(struct atlas_build *build, float *mean)
{
    const size_t vertices = (size_t)build->template.mesh.vertex_count;
    for (int s = 0; s < build->settings.count; ++s) {
        free(build->shapes[s]);
        build->shapes[s] = malloc(3 * vertices * sizeof **build->shapes);
        if (!build->shapes[s]) {
            return atlas_no_memory();
        }
        memcpy(build->shapes[s], build->subjects[s].shape, 3 * vertices * sizeof **build->shapes);
    }
    return shapes_align(build->shapes, build->settings.count, vertices, !build->settings.keep_scale, mean)
        || atlas_fail("the shapes cannot be aligned");
}

static bool make_correspondences(struct atlas_build *build)
{
    const struct atlas_build_settings *set = &build->settings;
    const struct atlas_subject *first = &build->subjects[0];
    const int rounds = set->count > 1 ? set->rounds : 1;
    struct progress bar;
    progress_begin(&bar, "atlas build", (size_t)(rounds * set->count), !cli_may_print(&set->common));
    build->backend = run_backend("atlas build", &set->common);
    bool good = atlas_template_create(&first->mesh, first->target.open, true, set->common.grid, &build->params, build->backend,
                                      &build->template);
    for (int round = 0; good && round < rounds; ++round) {
        good = place_landmarks(build, round) && correspond(build, round, &bar);
        struct shape_mesh *mean = &build->atlas.mean;
        const struct shape_mesh *mesh = &build->template.mesh;
        atlas_mesh_free(mean);
        good = good && atlas_mesh_copy(mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count, mean)
            && align(build, mean->positions);
        if (good && round + 1 < rounds) { /* the next round starts from the mean shape */
            const int cells = build->template.cells;
            atlas_template_free(&build->template);
            good = atlas_template_create(mean, first->target.open, false, cells, &build->params, build->backend,
                                         &build->template);
        }
    }
    progress_end(&bar);
    return good;
}

/* Takes the vertices of meshes as they are: the correspondences were made before. */
static bool take_vertices(struct atlas_build *build)
{
    const struct shape_mesh *first = &build->subjects[0].mesh;
    struct shape_mesh *mean = &build->atlas.mean;
    struct atlas_template *template = &build->template;
    double center[3];
    if (build->settings.count < 2 || !atlas_same_triangles(build)) {
        return build->settings.extends
                   ? atlas_fail("meshes to add need the same triangles as the atlas, as correspondence.ply of atlas segment has")
                   : atlas_fail("--same-vertices is for two or more meshes of the same triangles");
    }
    for (int s = 0; s < build->settings.count; ++s) {
        struct atlas_subject *subject = &build->subjects[s];
        const size_t size = 3 * (size_t)first->vertex_count * sizeof *subject->shape;
        subject->pose = similarity_identity();
        subject->shape = malloc(size);
        if (!subject->shape) {
            return atlas_no_memory();
        }
        memcpy(subject->shape, subject->mesh.positions, size);
    }
    shape_size(first->positions, (size_t)first->vertex_count, center, &template->size);
    template->voxel = template->size / 16.0; /* of its own size: there was no grid */
    template->open = build->subjects[0].target.open;
    return atlas_mesh_copy(first->positions, first->vertex_count, first->triangles, first->triangle_count, &template->mesh)
        && atlas_mesh_copy(first->positions, first->vertex_count, first->triangles, first->triangle_count, mean);
}

/* Gives each vertex the label that most subjects have half a voxel inside it. */
static bool vote_regions(struct atlas_build *build)
{
    struct atlas *atlas = &build->atlas;
    const int vertices = atlas->mean.vertex_count, count = build->settings.count;
    float *normals = malloc(3 * (size_t)vertices * sizeof *normals);
    uint32_t *votes = calloc((size_t)vertices * (size_t)count, sizeof *votes);
    atlas->regions = calloc((size_t)vertices, sizeof *atlas->regions);
    const bool good = (normals && votes && atlas->regions) || atlas_no_memory();
    for (int s = 0; good && s < count; ++s) {
        const struct atlas_subject *subject = &build->subjects[s];
        if (!subject->labels.data) {
            continue;
        }
        const float depth =
            0.75f * fmaxf(subject->labels.spacing[0], fmaxf(subject->labels.spacing[1], subject->labels.spacing[2]));
        mesh_normals(subject->shape, (size_t)vertices, atlas->mean.triangles, (size_t)atlas->mean.triangle_count, normals);
        for (int v = 0; v < vertices; ++v) {
            float inside[3];
            vec3_add_scaled(subject->shape + 3 * v, -depth, normals + 3 * v, inside);
            votes[v * count + s] = atlas_label_at(subject, inside);
        }
    }
    for (int v = 0; good && v < vertices; ++v) {
        int best = 0;
        for (int s = 0; s < count; ++s) {
            int same = 0;
            for (int t = 0; t < count; ++t) {
                same += votes[v * count + t] == votes[v * count + s];
            }
            if (votes[v * count + s] != 0 && same > best) {
                best = same;
                atlas->regions[v] = votes[v * count + s];
            }
        }
    }
    free(normals);
    free(votes);
    return good;
}

bool atlas_model_make(struct atlas_build *build)
{
    const struct atlas_build_settings *set = &build->settings;
    struct atlas *atlas = &build->atlas;
    const struct shape_mesh *mesh = &build->template.mesh;
    atlas_mesh_free(&atlas->mean);
    if (!atlas_mesh_copy(mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count, &atlas->mean)
        || !align(build, atlas->mean.positions)) {
        return false;
    }
    const size_t vertices = (size_t)atlas->mean.vertex_count;
    atlas->oriented = build->subjects[0].oriented;
    atlas->voxel = build->template.voxel;
    atlas->subjects = set->count;
    if (!shape_model_build(build->shapes, set->count, vertices, set->modes, &atlas->model)
        || (set->count > 2 && set->samples > 0 && !shape_curves_make(build->shapes, set->count, vertices, set->samples, &build->curves))) {
        return atlas_no_memory();
    }
    atlas->generalization = build->curves.modes > 0 ? build->curves.generalization[build->curves.modes - 1] : 0.0;
    return vote_regions(build) && atlas_learn(build);
}

bool atlas_build_run(struct atlas_build *build)
{
    const struct atlas_build_settings *set = &build->settings;
    struct atlas *atlas = &build->atlas;
    const double begin = elapsed_seconds();
    if (!atlas_subjects_read(build) || !atlas_sides_agree(build)) {
        return false;
    }
    if (set->vertex_landmarks > 0 && !choose_landmarks(build, set->vertex_landmarks)) {
        return false;
    }
    const double read = elapsed_seconds();
    if (!(set->same_vertices ? take_vertices(build) : make_correspondences(build))) {
        return false;
    }
    build->correspond_seconds = elapsed_seconds() - read;
    bool good = atlas_model_make(build) && (set->same_vertices || atlas_truth_measure(build)) && atlas_templates_make(build),
         all[ATLAS_MAX_SUBJECTS];
    for (int s = 0; s < set->count; ++s) {
        all[s] = true;
    }
    for (int t = 0; good && t < atlas->template_count; ++t) {
        good = fusion_learn(&atlas->templates[t], all) || atlas_no_memory();
    }
    build->seconds = elapsed_seconds() - begin;
    return good;
}

void atlas_build_free(struct atlas_build *build)
{
    for (int s = 0; build->subjects && s < build->settings.count; ++s) {
        atlas_subject_free(&build->subjects[s]);
        free(build->shapes ? build->shapes[s] : NULL);
    }
    free(build->subjects);
    free(build->shapes);
    atlas_template_free(&build->template);
    springls_cl_destroy(build->backend);
    shape_curves_free(&build->curves);
    atlas_free(&build->atlas);
}
