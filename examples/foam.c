/* foam.c - a foam of random bubbles comes to rest under surface tension, with every volume held: the angles of Plateau's laws, walls,
 * volumes, and how often bubbles change their neighbours (T1). Bubbles are the cells of random places in a ball. */
#include "base/progress.h"
#include "pictures/raycast.h"
#include "springls.h"
#include "springls/run_options.h"
#include "surface/mesh_io.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_CELLS = 1000, LEAST_GRID = 20, MOST_GRID = 512, PICTURE = 420, FRAMES = 4 };
enum { LOOK = 5, MET = 6 }; /* steps between two counts of neighbours; triangles of a wall that counts */
static const float CALM = 0.25f; /* of the time a step: in the last quarter of the steps */

struct foam {
    struct cli_common common;
    int cells, steps, seed, grid;
    float dt;
    springls_tiling *tiling;
    springls_tiling_hold held[MOST_CELLS];
    float place[MOST_CELLS][3];
    double radius;          /* of the ball that is filled */
    int *faces;             /* triangles of each pair of cells */
    unsigned char *touch;   /* pairs that touch */
    int gained, lost;       /* pairs, since the beginning */
    double area[2];         /* of all walls: at the beginning, now */
    struct image picture[FRAMES];
    char caption[FRAMES][48];
};

static bool works(const struct foam *foam, springls_status status)
{
    if (status != SPRINGLS_OK) {
        fprintf(stderr, "foam: %s\n", springls_tiling_last_error(foam->tiling));
    }
    return status == SPRINGLS_OK;
}

static bool no_memory(void) { return cli_fail("foam", CLI_EXIT_FAILURE, "not enough memory") == CLI_CONTINUE; }

/* ---- random cells ---- */

static double random_number(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / 16777216.0;
}

static void random_places(struct foam *foam)
{
    uint32_t state = (uint32_t)foam->seed;
    for (int i = 0; i < foam->cells;) {
        float *p = foam->place[i];
        double r2 = 0.0;
        for (int k = 0; k < 3; k++) {
            const double x = 2.0 * random_number(&state) - 1.0;
            p[k] = (float)(0.5 * foam->grid + x * foam->radius);
            r2 += x * x;
        }
        i += r2 < 0.9;
    }
}

/* Gives every voxel of the ball the nearest place, and, where they are to even out, moves places to the middles of their voxels. */
static void label_voxels(struct foam *foam, int32_t *labels, bool even_out)
{
    static double sum[MOST_CELLS][4];
    const int n = foam->grid;
    memset(sum, 0, sizeof sum);
    for (int v = 0; v < n * n * n; v++) {
        const float x[3] = {(float)(v % n), (float)(v / n % n), (float)(v / (n * n))};
        float least = HUGE_VALF;
        double from_middle = 0.0;
        int nearest = 0;
        for (int k = 0; k < 3; k++) {
            from_middle += (x[k] - 0.5 * n) * (x[k] - 0.5 * n);
        }
        labels[v] = 0;
        if (from_middle >= foam->radius * foam->radius) {
            continue;
        }
        for (int i = 0; i < foam->cells; i++) {
            const float *p = foam->place[i];
            const float d2 = (x[0] - p[0]) * (x[0] - p[0]) + (x[1] - p[1]) * (x[1] - p[1]) + (x[2] - p[2]) * (x[2] - p[2]);
            if (d2 < least) {
                least = d2;
                nearest = i;
            }
        }
        labels[v] = nearest + 1;
        for (int k = 0; k < 3; k++) {
            sum[nearest][k] += (double)x[k];
        }
        sum[nearest][3] += 1.0;
    }
    for (int i = 0; i < foam->cells && even_out; i++) {
        for (int k = 0; k < 3 && sum[i][3] > 0.0; k++) {
            foam->place[i][k] = (float)(sum[i][k] / sum[i][3]);
        }
    }
}

static bool set_cells(struct foam *foam)
{
    int32_t *labels = malloc((size_t)foam->grid * (size_t)foam->grid * (size_t)foam->grid * sizeof *labels);
    if (!labels) {
        return no_memory();
    }
    random_places(foam);
    label_voxels(foam, labels, true);
    label_voxels(foam, labels, true);
    label_voxels(foam, labels, false);
    const bool done = works(foam, springls_tiling_set_labels(foam->tiling, labels, 2));
    free(labels);
    for (int i = 0; i < foam->cells; i++) {
        foam->held[i].label = i + 1;
    }
    return done;
}

/* ---- vectors ---- */

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static bool normalize(double *a)
{
    const double l = sqrt(dot(a, a));
    for (int k = 0; k < 3; k++) {
        a[k] /= l > 0.0 ? l : 1.0;
    }
    return l > 0.0;
}

/* A mean and a standard deviation, degrees. */
struct spread {
    double sum, sum2;
    int count;
};

static void add_angle(struct spread *s, const double *a, const double *b)
{
    const double cosine = dot(a, b), angle = 57.295779513082321 * acos(cosine < -1.0 ? -1.0 : cosine > 1.0 ? 1.0 : cosine);
    s->sum += angle;
    s->sum2 += angle * angle;
    s->count++;
}

static void print_angles(const char *what, const struct spread *s, double wanted)
{
    const double n = s->count > 0 ? s->count : 1, mean = s->sum / n;
    printf("%s: mean %.2f (%.2f), standard deviation %.2f, of %d\n", what, mean, wanted, sqrt(fmax(s->sum2 / n - mean * mean, 0.0)),
           s->count);
}

/* ---- lines and points where films meet ---- */

enum { MOST_LABELS = 4, LINES = 3, CORNERS = 4 };

/* The labels about each vertex of the walls, ascending; more than MOST_LABELS are counted alone. */
struct around {
    int count;
    int32_t label[MOST_LABELS];
};

static void add_label(struct around *a, int32_t label)
{
    int at = 0;
    while (at < a->count && at < MOST_LABELS && a->label[at] < label) {
        at++;
    }
    if (at < a->count && at < MOST_LABELS && a->label[at] == label) {
        return;
    }
    for (int i = MOST_LABELS - 1; i > at; i--) {
        a->label[i] = a->label[i - 1];
    }
    if (at < MOST_LABELS) {
        a->label[at] = label;
    }
    a->count++;
}

static bool has_label(const struct around *a, int32_t label)
{
    for (int i = 0; i < a->count && i < MOST_LABELS; i++) {
        if (a->label[i] == label) {
            return true;
        }
    }
    return false;
}

static struct around *labels_around(const springls_walls *walls)
{
    struct around *around = calloc((size_t)walls->vertex_count + 1, sizeof *around);
    for (int t = 0; around && t < walls->triangle_count; t++) {
        for (int i = 0; i < 3; i++) {
            add_label(&around[walls->triangles[3 * t + i]], walls->labels[2 * t]);
            add_label(&around[walls->triangles[3 * t + i]], walls->labels[2 * t + 1]);
        }
    }
    return around;
}

static void place_of(const springls_walls *walls, int vertex, double *out)
{
    for (int k = 0; k < 3; k++) {
        out[k] = (double)walls->positions[3 * vertex + k];
    }
}

/* Finds the direction of the line where the films of three labels meet, from p on: that of the edges 1 to 3.5 voxels from it. */
static bool line_from(const springls_walls *walls, const struct around *around, const double *p, const int32_t *three, double *way)
{
    int found = 0;
    way[0] = way[1] = way[2] = 0.0;
    for (int e = 0; e < walls->edge_count; e++) {
        double q[3], d[3], l2;
        const struct around *a = &around[walls->edges[2 * e]];
        place_of(walls, walls->edges[2 * e], q);
        for (int k = 0; k < 3; k++) {
            d[k] = q[k] - p[k];
        }
        l2 = dot(d, d);
        if (l2 < 1.0 || l2 > 12.25 || a->count != LINES || !has_label(a, three[0]) || !has_label(a, three[1]) || !has_label(a, three[2])) {
            continue;
        }
        for (int k = 0; k < 3; k++) {
            way[k] += d[k];
        }
        found++;
    }
    return normalize(way) && found > 1;
}

/* Measures the angles between the four lines at each place where films of four labels meet. Returns false if memory is short. */
static bool measure_corners(const springls_walls *walls, const struct around *around, struct spread *angles)
{
    struct around *done = calloc((size_t)walls->vertex_count + 1, sizeof *done);
    int count = 0;
    if (!done) {
        return false;
    }
    for (int v = 0; v < walls->vertex_count; v++) {
        double p[3], way[CORNERS][3];
        bool fresh = around[v].count == CORNERS, all = true;
        for (int i = 0; i < count && fresh; i++) {
            fresh = memcmp(done[i].label, around[v].label, sizeof done[i].label) != 0;
        }
        if (!fresh) {
            continue;
        }
        done[count++] = around[v];
        place_of(walls, v, p);
        for (int i = 0; i < CORNERS && all; i++) {
            int32_t three[3];
            for (int k = 0, j = 0; k < CORNERS; k++) {
                if (k != i) {
                    three[j++] = around[v].label[k];
                }
            }
            all = line_from(walls, around, p, three, way[i]);
        }
        for (int i = 0; i < CORNERS && all; i++) {
            for (int k = 0; k < i; k++) {
                add_angle(angles, way[i], way[k]);
            }
        }
    }
    free(done);
    return true;
}

/* Finds the way from p, square to the line t, into the film between two labels: to its triangles 1 to 3 voxels off. */
static bool film_from(const springls_walls *walls, const double *p, const double *t, int32_t one, int32_t other, double *way)
{
    way[0] = way[1] = way[2] = 0.0;
    for (int i = 0; i < walls->triangle_count; i++) {
        const int32_t *label = walls->labels + 2 * i;
        double d[3] = {0.0, 0.0, 0.0}, along, l2;
        if (!(label[0] == one && label[1] == other) && !(label[0] == other && label[1] == one)) {
            continue;
        }
        for (int j = 0; j < 3; j++) {
            for (int k = 0; k < 3; k++) {
                d[k] += ((double)walls->positions[3 * walls->triangles[3 * i + j] + k] - p[k]) / 3.0;
            }
        }
        along = dot(d, t);
        for (int k = 0; k < 3; k++) {
            d[k] -= along * t[k];
        }
        l2 = dot(d, d);
        if (fabs(along) > 1.5 || l2 < 1.0 || l2 > 9.0) {
            continue;
        }
        for (int k = 0; k < 3; k++) {
            way[k] += d[k] / sqrt(l2);
        }
    }
    return normalize(way);
}

/* Measures the angles between the three films at every seventh edge, away from corners. */
static void measure_lines(const springls_walls *walls, const struct around *around, struct spread *angles)
{
    for (int e = 0; e < walls->edge_count; e += 7) {
        const struct around *a = &around[walls->edges[2 * e]];
        double p[3], q[3], t[3] = {0.0, 0.0, 0.0}, way[LINES][3];
        bool all = a->count == LINES && around[walls->edges[2 * e + 1]].count == LINES;
        place_of(walls, walls->edges[2 * e], p);
        for (int v = 0; v < walls->edge_count && all; v++) { /* the line's direction: from the mean of its places before to that behind */
            const struct around *b = &around[walls->edges[2 * v]];
            double d[3], sign;
            place_of(walls, walls->edges[2 * v], q);
            for (int k = 0; k < 3; k++) {
                d[k] = q[k] - p[k];
            }
            if (dot(d, d) > 6.25) {
                continue;
            }
            all = b->count <= LINES; /* else a corner is here */
            if (b->count == LINES && memcmp(b->label, a->label, LINES * sizeof *a->label) == 0) {
                sign = dot(d, t) < 0.0 ? -1.0 : 1.0;
                for (int k = 0; k < 3; k++) {
                    t[k] += sign * d[k];
                }
            }
        }
        all = all && normalize(t);
        for (int i = 0; i < LINES && all; i++) {
            all = film_from(walls, p, t, a->label[i], a->label[(i + 1) % LINES], way[i]);
        }
        for (int i = 0; i < LINES && all; i++) {
            add_angle(angles, way[i], way[(i + 1) % LINES]);
        }
    }
}

/* ---- looking at the foam ---- */

static double triangle_area(const springls_walls *walls, int t)
{
    double p[3][3], u[3], v[3], n[3];
    for (int i = 0; i < 3; i++) {
        place_of(walls, walls->triangles[3 * t + i], p[i]);
    }
    for (int k = 0; k < 3; k++) {
        u[k] = p[1][k] - p[0][k];
        v[k] = p[2][k] - p[0][k];
    }
    for (int k = 0; k < 3; k++) {
        n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
    }
    return 0.5 * sqrt(dot(n, n));
}

/* Sums up the area, and counts pairs of cells that have come to touch or have parted. */
static void look_at(struct foam *foam, const springls_walls *walls, bool first)
{
    const int n = foam->cells + 1;
    memset(foam->faces, 0, (size_t)n * (size_t)n * sizeof *foam->faces);
    foam->area[1] = 0.0;
    for (int t = 0; t < walls->triangle_count; t++) {
        const int32_t *label = walls->labels + 2 * t;
        const int low = label[0] < label[1] ? label[0] : label[1], high = label[0] < label[1] ? label[1] : label[0];
        if (foam->faces[low * n + high] < MET) {
            foam->faces[low * n + high]++;
        }
        foam->area[1] += triangle_area(walls, t);
    }
    if (first) {
        foam->area[0] = foam->area[1];
    }
    for (int low = 1; low < n; low++) {
        for (int high = low + 1; high < n; high++) {
            unsigned char *touch = &foam->touch[low * n + high];
            const int faces = foam->faces[low * n + high];
            const bool now = *touch ? faces > 0 : faces == MET;
            foam->gained += !first && now && !*touch;
            foam->lost += !first && !now && *touch;
            *touch = now;
        }
    }
}

/* ---- pictures ---- */

struct look {
    float *positions, *colors;
    uint32_t *indices;
    size_t vertices, triangles;
};

/* Returns whether a cell is drawn: the foam is cut open before its middle. */
static bool is_drawn(const struct foam *foam, int32_t label)
{
    const float *p = foam->place[label > 0 ? label - 1 : 0];
    return label > 0 && (p[0] + 0.8f * p[1] < 0.9f * (float)foam->grid || p[2] < 0.5f * (float)foam->grid);
}

enum { MOST_FILMS = 8 }; /* of a cell about a vertex: others share the last */

/* What has been drawn of a vertex of the walls: one for each film between the cell at work and another one. */
struct drawn {
    int count;
    int32_t behind[MOST_FILMS];
    int vertex[MOST_FILMS];
};

/* Returns the drawn vertex of a film towards a label, `fresh` where there is none. */
static int drawn_vertex(struct drawn *drawn, int32_t label, int fresh)
{
    for (int i = 0; i < drawn->count; i++) {
        if (drawn->behind[i] == label) {
            return drawn->vertex[i];
        }
    }
    if (drawn->count == MOST_FILMS) {
        return drawn->vertex[MOST_FILMS - 1];
    }
    drawn->behind[drawn->count] = label;
    drawn->vertex[drawn->count++] = fresh;
    return fresh;
}

/* Adds the closed surface of a cell, or each of its films with vertices of its own, so that a picture shows sharp edges between them. */
static void draw_cell(const springls_walls *walls, int32_t label, bool sharp, struct drawn *drawn, struct look *look)
{
    const struct color c = color_mix(color_hsv(0.618034f * (float)label, 0.55f, 0.95f), color_rgb(1.0f, 1.0f, 1.0f), 0.25f);
    for (int t = 0; t < walls->triangle_count; t++) {
        const bool behind = walls->labels[2 * t] == label;
        if (!behind && walls->labels[2 * t + 1] != label) {
            continue;
        }
        for (int i = 0; i < 3; i++) {
            const int v = walls->triangles[3 * t + (behind ? i : 2 - i)];
            const size_t begun = look->vertices;
            const int vertex = drawn_vertex(&drawn[v], sharp ? walls->labels[2 * t + behind] : label, (int)begun);
            if (vertex == (int)begun) {
                memcpy(look->positions + 3 * begun, walls->positions + 3 * v, 3 * sizeof(float));
                look->colors[3 * begun] = c.r;
                look->colors[3 * begun + 1] = c.g;
                look->colors[3 * begun + 2] = c.b;
                look->vertices++;
            }
            look->indices[3 * look->triangles + (size_t)i] = (uint32_t)vertex;
        }
        look->triangles++;
    }
    for (int t = 0; t < walls->triangle_count; t++) {
        for (int i = 0; i < 3; i++) {
            drawn[walls->triangles[3 * t + i]].count = 0;
        }
    }
}

/* Makes a look at the foam: cut open, with sharp edges, or all cells, each a closed surface. */
static bool make_look(const struct foam *foam, const springls_walls *walls, bool cut_open, struct look *look)
{
    const size_t most = 2 * (size_t)walls->triangle_count;
    struct drawn *drawn = calloc((size_t)walls->vertex_count + 1, sizeof *drawn);
    look->positions = malloc((9 * most + 1) * sizeof(float));
    look->colors = malloc((9 * most + 1) * sizeof(float));
    look->indices = malloc((3 * most + 1) * sizeof(uint32_t));
    look->vertices = look->triangles = 0;
    if (!drawn || !look->positions || !look->colors || !look->indices) {
        free(drawn);
        return false;
    }
    for (int i = 1; i <= foam->cells; i++) {
        if (!cut_open || is_drawn(foam, i)) {
            draw_cell(walls, i, cut_open, drawn, look);
        }
    }
    free(drawn);
    return true;
}

static void free_look(struct look *look)
{
    free(look->positions);
    free(look->colors);
    free(look->indices);
}

static bool take_picture(struct foam *foam, const springls_walls *walls, int frame, int step)
{
    struct look look;
    struct raycast_scene scene = {0};
    const float n = (float)foam->grid;
    bool done = make_look(foam, walls, true, &look);
    if (done) {
        scene.positions = look.positions;
        scene.vertex_count = look.vertices;
        scene.indices = look.indices;
        scene.triangle_count = look.triangles;
        scene.vertex_colors = look.colors;
        scene.camera = (struct raycast_camera){{0.5f * n + 2.0f * n, 0.5f * n + 1.7f * n, 0.5f * n + 1.5f * n},
                                               {0.5f * n, 0.5f * n, 0.5f * n}, {0.0f, 0.0f, 1.0f}, 0.0f, 2.3f * (float)foam->radius};
        done = raycast_render(&scene, PICTURE, PICTURE, &foam->picture[frame]);
        snprintf(foam->caption[frame], sizeof foam->caption[frame], "step %d", step);
    }
    free_look(&look);
    return done || no_memory();
}

static bool write_picture(struct foam *foam)
{
    const char *captions[FRAMES];
    char path[1024];
    struct image strip;
    for (int i = 0; i < FRAMES; i++) {
        captions[i] = foam->caption[i];
    }
    if (!image_strip(foam->picture, captions, FRAMES, FRAMES, color_rgb(1.0f, 1.0f, 1.0f), &strip)) {
        return no_memory();
    }
    const bool done = image_write_small_png(&strip, 255, run_path(foam->common.out, "foam.png", path, sizeof path))
                   || cli_write_failed("foam", path);
    image_free(&strip);
    return done;
}

static bool write_mesh(struct foam *foam, const springls_walls *walls)
{
    char path[1024], error[MESH_TEXT];
    struct look look;
    bool done = make_look(foam, walls, false, &look) || no_memory();
    if (done) {
        const struct mesh_arrays mesh = {.positions = look.positions, .vertex_count = look.vertices, .indices = look.indices,
                                         .triangle_count = look.triangles, .colors = look.colors};
        done = mesh_write(run_path(foam->common.out, "foam.glb", path, sizeof path), &mesh, error)
            || cli_fail("foam", CLI_EXIT_FAILURE, "%s", error) == CLI_CONTINUE;
    }
    free_look(&look);
    return done;
}

/* ---- the run ---- */

static bool print_all_angles(const springls_walls *walls)
{
    struct around *around = labels_around(walls);
    struct spread lines = {0.0, 0.0, 0}, corners = {0.0, 0.0, 0};
    const bool measured = around && measure_corners(walls, around, &corners);
    if (measured) {
        measure_lines(walls, around, &lines);
        print_angles("angles where three films meet", &lines, 120.0);
        print_angles("angles where four lines meet", &corners, 109.47);
    }
    free(around);
    return measured || no_memory();
}

/* Returns the picture that shows a step, -1: none does. Most happens in the first steps: pictures lie ever further apart. */
static int frame_of(const struct foam *foam, int step)
{
    int frame = FRAMES - 1;
    while (frame >= 0) {
        const double way = (double)frame / (FRAMES - 1);
        const int at = (int)(way * way * foam->steps + 0.5);
        if (step == (at > frame ? at : frame)) {
            break;
        }
        frame--;
    }
    return frame;
}

/* Takes a look at the foam after a step: at all of it in the end. */
static bool observe(struct foam *foam, int step)
{
    const int frame = frame_of(foam, step);
    const bool pictured = foam->common.out && frame >= 0, last = step == foam->steps, counted = step % LOOK == 0 || last;
    springls_walls walls;
    bool done = true;
    if (!counted && !pictured) {
        return true;
    }
    if (!works(foam, springls_tiling_extract(foam->tiling, &walls))) {
        return false;
    }
    if (counted) {
        look_at(foam, &walls, step == 0);
    }
    if (pictured) {
        done = take_picture(foam, &walls, frame, step);
    }
    if (last) {
        done = done && print_all_angles(&walls) && (!foam->common.out || (write_picture(foam) && write_mesh(foam, &walls)));
    }
    springls_walls_free(foam->tiling, &walls);
    return done;
}

static void print_volumes(const struct foam *foam)
{
    double mean = 0.0, largest = 0.0, total[2] = {0.0, 0.0};
    int alive = 0;
    for (int i = 0; i < foam->cells; i++) {
        const springls_tiling_hold *h = &foam->held[i];
        const double error = h->target > 0.0 ? fabs(h->volume / h->target - 1.0) : 0.0;
        alive += h->volume > 0.0;
        mean += error / foam->cells;
        largest = fmax(largest, error);
        total[0] += h->target;
        total[1] += h->volume;
    }
    printf("bubbles: %d of %d; volumes are off by %.3f %% in the mean, %.3f %% at most, all together %+.4f %%\n", alive, foam->cells,
           100.0 * mean, 100.0 * largest, 100.0 * (total[1] / total[0] - 1.0));
}

static bool run(struct foam *foam)
{
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    const clock_t begin = clock();
    step.tension = 1.0f;
    step.held = foam->held;
    step.held_count = foam->cells;
    step.integrator = SPRINGLS_INTEGRATOR_EULER;
    step.dt = foam->dt;
    if (!set_cells(foam) || !observe(foam, 0)) {
        return false;
    }
    for (int i = 1; i <= foam->steps; i++) {
        step.dt = 4 * i > 3 * foam->steps ? CALM * foam->dt : foam->dt; /* shorter steps miss volumes by less */
        if (!works(foam, springls_tiling_step(foam->tiling, &step, NULL)) || !observe(foam, i)) {
            return false;
        }
    }
    print_volumes(foam);
    printf("area of all films: %.1f, %.1f in the beginning\n", foam->area[1], foam->area[0]);
    printf("pairs of neighbours: %d met, %d parted\n", foam->gained, foam->lost);
    printf("%d steps on a grid of %d^3 took %.1f s of processors, %.0f MiB\n", foam->steps, foam->grid,
           (double)(clock() - begin) / CLOCKS_PER_SEC, (double)springls_tiling_memory_used(foam->tiling) / 1048576.0);
    return true;
}

static bool prepare(struct foam *foam)
{
    springls_desc desc = springls_default_desc();
    const size_t pairs = ((size_t)foam->cells + 1) * ((size_t)foam->cells + 1);
    foam->radius = cbrt((double)foam->cells * 650.0 * 0.2387324); /* 650 voxels a bubble */
    foam->grid = foam->common.grid > 0 ? foam->common.grid : (int)(2.0 * foam->radius) + 12;
    if (foam->common.grid > 0) {
        foam->radius = 0.5 * (double)foam->grid - 6.0;
    }
    foam->faces = calloc(pairs, sizeof *foam->faces);
    foam->touch = calloc(pairs, 1);
    desc.tasks = run_tasks();
    for (int k = 0; k < 3; k++) {
        desc.grid.size[k] = foam->grid;
    }
    if (!foam->faces || !foam->touch) {
        return no_memory();
    }
    if (springls_tiling_create(&desc, &foam->tiling) != SPRINGLS_OK) {
        const char *why = springls_create_error(&desc);
        return *why ? cli_fail("foam", CLI_EXIT_FAILURE, "%s", why) == CLI_CONTINUE : no_memory();
    }
    return true;
}

int main(int argc, char **argv)
{
    static struct foam foam;
    springls_params params;
    foam.common = cli_common_defaults();
    foam.cells = 40;
    foam.steps = 40;
    foam.seed = 7;
    foam.dt = 0.5f;
    const struct cli_option options[] = {
        {"cells", CLI_INT, &foam.cells, "N", "bubbles", 2.0, MOST_CELLS, NULL},
        {"steps", CLI_INT, &foam.steps, "N", "steps", FRAMES - 1, 100000.0, NULL},
        {"seed", CLI_INT, &foam.seed, "N", "of the random places", 0.0, 1e9, NULL},
        {"dt", CLI_FLOAT, &foam.dt, "T", "time a step: voxel^2, as the surface tension is 1", 0.01, 1.0, NULL},
    };
    static const struct cli_writes writes[] = {{.files = "foam.png"}, {.files = "foam.glb"}};
    const struct cli_program program = {.name = "foam", .summary = "a foam of random bubbles comes to rest", .common = &foam.common,
                                        .options = options, .option_count = sizeof options / sizeof *options,
                                        .without = "params|backend|json|quiet", .writes = writes,
                                        .writes_count = sizeof writes / sizeof *writes};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_CONTINUE && foam.common.grid > 0) {
        status = cli_grid("foam", &foam.common, 0, LEAST_GRID, MOST_GRID);
    }
    if (status == CLI_CONTINUE) {
        status = run_options("foam", &foam.common, NULL, &params);
    }
    if (status != CLI_CONTINUE) {
        return status;
    }
    status = prepare(&foam) && run(&foam) ? EXIT_SUCCESS : EXIT_FAILURE;
    for (int i = 0; i < FRAMES; i++) {
        image_free(&foam.picture[i]);
    }
    springls_tiling_destroy(foam.tiling);
    free(foam.faces);
    free(foam.touch);
    return status;
}
