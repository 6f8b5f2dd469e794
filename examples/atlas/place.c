/* place.c - fits an atlas to an image: by a coarse search, then as an active shape model (Cootes et al. 1995).
 *
 * In every round each vertex searches along its normal for the shift that fits the image best; then the pose and the mode
 * weights are fitted to these places by least squares. The search distance falls from round to round. */
#include "atlas/atlas.h"

#include "base/threads.h"
#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LOOKS = 3, ROUNDS = 12, SCALES = 3, FEW = 150, CANDIDATES = 16, ORIENTATIONS = 60 };

/* Shifts tried on either side of a vertex, and the distance between them in voxels of the image. */
static const int look_shifts[LOOKS] = {10, 6, 4};
static const float look_spacing[LOOKS] = {2.0f, 1.0f, 0.5f}, max_weight = 3.0f;

static float finest(const struct volume *image) { return fminf(image->spacing[0], fminf(image->spacing[1], image->spacing[2])); }

/* Returns the distance between samples in mm: profiles have the one they were learned at, windows use voxels of the image. */
static float spacing_of(const struct atlas_view *view, int look)
{
    return view->learned ? (float)view->atlas->spacing : look_spacing[look] * finest(view->image);
}

static void make_shape(const struct atlas *atlas, struct atlas_placing *placing)
{
    shape_model_shape(&atlas->model, placing->weights, placing->modes, placing->shape);
    similarity_apply_all(&placing->pose, placing->shape, (size_t)atlas->mean.vertex_count, placing->shape);
}

/* ---- rounds ---- */

struct look_loop {
    const struct atlas_view *view;
    const float *shape;
    const float *normals;
    float *places;
    double *sure;
    int shifts;
    float spacing;
};

static void run_look_loop(void *arg, int begin, int end)
{
    const struct look_loop *loop = arg;
    const struct atlas_view *view = loop->view;
    const float *shape = loop->shape;
    const float *normals = loop->normals;
    float *places = loop->places;
    double *sure = loop->sure;
    const int shifts = loop->shifts;
    const float spacing = loop->spacing;
    for (int v = begin; v < end; ++v) {
        float costs[64];
        int best = shifts;
        atlas_shift_costs(view, v, shape + 3 * v, normals + 3 * v, spacing, shifts, costs);
        for (int s = 0; s <= 2 * shifts; ++s) { /* the nearer one of equal costs */
            const bool nearer = abs(s - shifts) < abs(best - shifts);
            best = costs[s] < costs[best] || (costs[s] <= costs[best] && nearer) ? s : best;
        }
        vec3_add_scaled(shape + 3 * v, spacing * (float)(best - shifts), normals + 3 * v, places + 3 * v);
        const double cost = (double)costs[best];
        sure[v] = view->learned ? 1.0 / (1.0 + cost) : fmax(0.0, -cost);
        if (best == 0 || best == 2 * shifts) { /* the best place may lie beyond the last shift */
            sure[v] *= 0.1;
        }
    }
}

/* Finds each vertex's best place along its normal, and how certain it is. */
static void look(const struct atlas_view *view, int which, const float *shape, const float *normals, float *places, double *sure)
{
    const int vertices = view->atlas->mean.vertex_count, shifts = look_shifts[which];
    const float spacing = spacing_of(view, which);
    struct look_loop loop = {view, shape, normals, places, sure, shifts, spacing};
    threads_for(vertices, 16, run_look_loop, &loop);
}

/* Fits weights of the first modes to the places, which are in the model's coordinates. */
static void fit_weights(const struct atlas *atlas, const float *places, const double *sure, int modes, double *weights)
{
    const size_t vertices = (size_t)atlas->mean.vertex_count;
    double total = 0.0;
    for (size_t v = 0; v < vertices; ++v) {
        total += sure[v];
    }
    for (int m = 0; m < modes; ++m) { /* in increasing order: each mode fits what the modes before it have left */
        const float *mode = atlas->model.mode + 3 * vertices * (size_t)m;
        double along = 0.0, square = 0.0;
        for (size_t v = 0; v < vertices; ++v) {
            for (size_t k = 3 * v; k < 3 * v + 3; ++k) {
                double left = (double)places[k] - (double)atlas->mean.positions[k];
                for (int e = 0; e < m; ++e) {
                    left -= weights[e] * atlas->model.deviation[e] * (double)atlas->model.mode[3 * vertices * (size_t)e + k];
                }
                along += sure[v] * left * (double)mode[k];
                square += sure[v] * (double)mode[k] * (double)mode[k];
            }
        }
        /* Regularises: a weight is as improbable as its square, and a vertex's place is uncertain by about a voxel of the
         * atlas. */
        const double noise = atlas->voxel * atlas->voxel * total / (double)vertices;
        const double deviation = atlas->model.deviation[m];
        weights[m] = square > 0.0 ? along / (square + noise / (deviation * deviation)) / deviation : 0.0;
        weights[m] = fmax(-(double)max_weight, fmin((double)max_weight, weights[m]));
    }
}

static bool refine(const struct atlas_view *view, int modes, int first_look, struct atlas_placing *placing)
{
    const struct atlas *atlas = view->atlas;
    const size_t vertices = (size_t)atlas->mean.vertex_count;
    float *normals = malloc(3 * vertices * sizeof *normals), *places = malloc(3 * vertices * sizeof *places);
    float *bare = malloc(3 * vertices * sizeof *bare);
    double *sure = malloc(vertices * sizeof *sure);
    const bool good = (normals && places && bare && sure) || atlas_no_memory();
    const int maximum = modes < atlas->model.modes ? modes : atlas->model.modes;
    for (int l = first_look; good && l < LOOKS; ++l) {
        for (int round = 0; round < ROUNDS; ++round) {
            struct similarity pose;
            make_shape(atlas, placing);
            mesh_normals(placing->shape, vertices, atlas->mean.triangles, (size_t)atlas->mean.triangle_count, normals);
            look(view, l, placing->shape, normals, places, sure);
            shape_model_shape(&atlas->model, placing->weights, placing->modes, bare);
            if (!similarity_fit(bare, places, sure, vertices, true, &pose)) {
                break;
            }
            placing->pose = pose;
            const struct similarity back = similarity_inverse(&pose);
            similarity_apply_all(&back, places, vertices, places);
            placing->modes = maximum < round + 1 || l > first_look ? maximum : round + 1;
            fit_weights(atlas, places, sure, placing->modes, placing->weights);
        }
    }
    if (good) {
        make_shape(atlas, placing);
    }
    free(normals);
    free(places);
    free(bare);
    free(sure);
    return good;
}

bool atlas_place_refine(const struct atlas_view *view, int modes, struct atlas_placing *placing)
{
    return refine(view, modes, modes > 0 ? 1 : 0, placing);
}

/* ---- the coarse search ---- */

struct candidate {
    struct similarity pose;
    double cost;
    int cell; /* breaks ties between equal costs in the same way for any number of threads */
};

static void add_candidate(struct candidate *best, int *count, const struct candidate *fresh)
{
    int at = *count < CANDIDATES ? (*count)++ : CANDIDATES;
    while (at > 0 && (best[at - 1].cost > fresh->cost || (best[at - 1].cost >= fresh->cost && best[at - 1].cell > fresh->cell))) {
        if (at < CANDIDATES) {
            best[at] = best[at - 1];
        }
        --at;
    }
    if (at < CANDIDATES) {
        best[at] = *fresh;
    }
}

struct search_loop {
    const struct atlas_view *view;
    const int *few;
    int count;
    const float *normals;
    struct candidate *best;
    int *found;
    const double *scales;
    const struct volume *image;
    const double *center;
    const int *cells;
    int orientations;
};

static void run_search_loop(void *arg, int begin, int end)
{
    const struct search_loop *loop = arg;
    const struct atlas_view *view = loop->view;
    const int *few = loop->few;
    const int count = loop->count;
    const float *normals = loop->normals;
    struct candidate *best = loop->best;
    int *found = loop->found;
    const double *scales = loop->scales;
    const struct volume *image = loop->image;
    const double *center = loop->center;
    const int *cells = loop->cells;
    const int orientations = loop->orientations;
    for (int p = begin; p < end; ++p) {
        const int cell[3] = {p % cells[0], p / cells[0] % cells[1], p / cells[0] / cells[1]};
        float index[3], middle[3];
        for (int a = 0; a < 3; ++a) {
            index[a] = ((float)cell[a] + 0.5f) / (float)cells[a] * (float)image->dims[a] - 0.5f;
        }
        volume_index_to_world(image, index, middle);
        struct candidate local = {.cost = INFINITY}, trial = {.cell = p};
        for (int t = 0; t < orientations * SCALES; ++t) {
            trial.pose = similarity_identity();
            if (!view->atlas->oriented) {
                rotation_number(t / SCALES, trial.pose.rotation);
            }
            trial.pose.scale = scales[t % SCALES];
            for (int r = 0; r < 3; ++r) {
                const double *row = trial.pose.rotation[r];
                trial.pose.translation[r] =
                    (double)middle[r] - trial.pose.scale * (row[0] * center[0] + row[1] * center[1] + row[2] * center[2]);
            }
            trial.cost = atlas_surface_cost(view, &trial.pose, few, count, normals, spacing_of(view, 0));
            local = trial.cost < local.cost ? trial : local;
        }
        threads_lock();
        add_candidate(best, found, &local);
        threads_unlock();
    }
}

/* Tries all translations a quarter of the atlas's size apart, in three sizes; an atlas from label maps only in the patient's
 * orientation, others in many rotations. */
static int search(const struct atlas_view *view, const int *few, int count, const float *normals, struct candidate *best)
{
    static const double scales[SCALES] = {1.0, 0.87, 1.15};
    const struct volume *image = view->image;
    double center[3], radius;
    int found = 0, cells[3];
    shape_size(view->atlas->mean.positions, (size_t)view->atlas->mean.vertex_count, center, &radius);
    for (int a = 0; a < 3; ++a) {
        const double extent = (double)image->spacing[a] * image->dims[a] / (0.25 * radius);
        cells[a] = extent < 1.0 ? 1 : extent > 64.0 ? 64 : (int)extent;
    }
    const int orientations = view->atlas->oriented ? 1 : ORIENTATIONS, places = cells[0] * cells[1] * cells[2];
    struct search_loop loop = {view, few, count, normals, best, &found, scales, image, center, cells, orientations};
    threads_for(places, 16, run_search_loop, &loop);
    return found;
}

bool atlas_place_start(const struct atlas_view *view, struct atlas_placing *placing)
{
    const struct atlas *atlas = view->atlas;
    const size_t vertices = (size_t)atlas->mean.vertex_count;
    struct candidate best[CANDIDATES];
    int few[FEW];
    float *normals = malloc(3 * vertices * sizeof *normals);
    memset(placing, 0, sizeof *placing);
    placing->shape = malloc(3 * vertices * sizeof *placing->shape);
    if (!normals || !placing->shape) {
        free(normals);
        return atlas_no_memory();
    }
    mesh_normals(atlas->mean.positions, vertices, atlas->mean.triangles, (size_t)atlas->mean.triangle_count, normals);
    const int count = points_spread(atlas->mean.positions, (int)vertices, FEW, few);
    const int found = search(view, few, count, normals, best);
    double minimum = INFINITY;
    struct similarity pose = similarity_identity();
    bool good = true;
    for (int c = 0; good && c < found; ++c) { /* choose by the cost after a first adjustment of the pose */
        placing->pose = best[c].pose;
        good = refine(view, 0, 0, placing);
        const double cost = good ? atlas_surface_cost(view, &placing->pose, few, count, normals, spacing_of(view, 1)) : INFINITY;
        if (cost < minimum) {
            minimum = cost;
            pose = best[c].pose; /* the pose before that adjustment */
        }
    }
    placing->pose = pose;
    if (good) {
        make_shape(atlas, placing);
    }
    free(normals);
    return good;
}
