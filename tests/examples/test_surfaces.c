/* examples/surfaces: the net of walls on shapes that are known, walls that two labels share, and the program from its command line to its
 * files. Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_surfaces_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_surfaces_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#define main surfaces_main
#include "../../examples/surfaces/surfaces.c"
#undef main

#include "base/vec3.h"
#include "surface/mesh_check.h"
#include "surface/mesh_io.h"

#include <inttypes.h>
#include <math.h>
#include <sys/stat.h>
#include <unistd.h>

#include "json_report.h"
#include "scratch.h"

enum { SIDE = 40, VOXELS = SIDE * SIDE * SIDE };
static const int dims[3] = {SIDE, SIDE, SIDE};
static uint32_t map[VOXELS];

/* The label at a place, which is in voxels from the middle. */
typedef uint32_t (*label_at)(float x, float y, float z);
/* The distance of a place from a label's true surface. */
typedef float (*distance_at)(const float x[3]);

static const float middle[3] = {19.3f, 19.6f, 19.1f};

static void fill(label_at shape)
{
    for (int n = 0; n < VOXELS; ++n) {
        map[n] = shape((float)(n % SIDE) - middle[0], (float)(n / SIDE % SIDE) - middle[1], (float)(n / SIDE / SIDE) - middle[2]);
    }
}

static float ball_distance(const float x[3]) { return sqrtf(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) - 10.0f; }
static uint32_t ball(float x, float y, float z) { return ball_distance((const float[3]){x, y, z}) < 0.0f ? 7 : 0; }

/* A plane that is tilted by one voxel in ten. */
static float slope_distance(const float x[3]) { return (0.1f * x[0] + 0.03f * x[1] + x[2]) / sqrtf(1.0109f); }
static uint32_t slope(float x, float y, float z) { return slope_distance((const float[3]){x, y, z}) < 0.0f ? 7 : 0; }

/* A ball in three parts, which meet on a line that is not along an axis. */
static uint32_t thirds(float x, float y, float z)
{
    const float angle = atan2f(y + 0.2f * z, x - 0.1f * z);
    return x * x + y * y + z * z > 144.0f ? 0 : angle < -1.0f ? 4000000001u : angle < 1.2f ? 4000000002u : 3u;
}

static uint32_t noise(float x, float y, float z)
{
    const float value = sinf(12.9898f * x + 78.233f * y + 37.719f * z) * 43758.547f;
    return (uint32_t)(4.0f * (value - floorf(value)));
}

/* Makes the surface of a label of the map, of which the net stays. */
static bool surface_of(struct net *net, uint32_t label, struct label_surface *surface)
{
    uint32_t *vertices = malloc((net->count + 1) * sizeof *vertices);
    size_t count = 0;
    for (size_t v = 0; vertices && v < net->count; ++v) {
        bool has = false;
        for (size_t e = net->first[v]; e < net->first[v + 1]; ++e) has = has || net->labels[e] == label;
        if (has) vertices[count++] = (uint32_t)v;
    }
    const bool made = vertices && net_label(net, dims, map, label, vertices, count, surface);
    free(vertices);
    return made;
}

static bool net_of(label_at shape, int steps, struct net *net)
{
    fill(shape);
    return net_create(dims, map, net) && net_smooth(net, dims, map, steps);
}

static double volume_of(const struct label_surface *s)
{
    double sum = 0.0;
    for (size_t t = 0; t < s->triangle_count; ++t) {
        const float *a = s->places + 3 * s->triangles[3 * t], *b = s->places + 3 * s->triangles[3 * t + 1];
        const float *c = s->places + 3 * s->triangles[3 * t + 2];
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            sum += (double)a[i] * ((double)b[j] * (double)c[k] - (double)b[k] * (double)c[j]) / 6.0;
        }
    }
    return sum;
}

/* Root mean square of the distances of vertices within `reach` of the middle along x and y. */
static double misfit(const struct label_surface *s, distance_at distance, float reach)
{
    double sum = 0.0, count = 0.0;
    for (size_t v = 0; v < s->vertex_count; ++v) {
        float x[3];
        vec3_sub(s->places + 3 * v, middle, x);
        if (fabsf(x[0]) < reach && fabsf(x[1]) < reach && x[2] > -15.0f) {
            sum += (double)(distance(x) * distance(x));
            count += 1.0;
        }
    }
    return sqrt(sum / count);
}

struct edge {
    uint32_t from, to;
};

static int compare_edges(const void *a, const void *b)
{
    const struct edge *x = a, *y = b;
    return x->from != y->from ? (x->from > y->from) - (x->from < y->from) : (x->to > y->to) - (x->to < y->to);
}

/* Counts edges without their opposite (`open`), and those that two triangles have in the same direction (`twice`). */
static void count_edges(const struct label_surface *s, size_t *open, size_t *twice)
{
    const size_t count = 3 * s->triangle_count;
    struct edge *edges = malloc((2 * count + 1) * sizeof *edges), *back = edges + count;
    for (size_t e = 0; e < count; ++e) {
        edges[e].from = back[e].to = s->triangles[e];
        edges[e].to = back[e].from = s->triangles[e % 3 == 2 ? e - 2 : e + 1];
    }
    qsort(edges, count, sizeof *edges, compare_edges);
    qsort(back, count, sizeof *back, compare_edges);
    *open = *twice = 0;
    for (size_t e = 0; e < count; ++e) {
        *open += compare_edges(&edges[e], &back[e]) != 0;
        *twice += e > 0 && compare_edges(&edges[e], &edges[e - 1]) == 0;
    }
    free(edges);
}

/* ---- the net ---- */

TEST steps_of_voxels_are_flattened(void)
{
    const struct {
        label_at shape;
        distance_at distance;
        double before, after;
    } cases[] = {{ball, ball_distance, 0.12, 0.07}, {slope, slope_distance, 0.2, 0.1}};
    for (size_t c = 0; c < 2; ++c) {
        for (int smooth = 0; smooth < 2; ++smooth) {
            struct net net;
            struct label_surface surface;
            ASSERT(net_of(cases[c].shape, 40 * smooth, &net) && surface_of(&net, 7, &surface));
            const double error = misfit(&surface, cases[c].distance, 12.0f);
            ASSERT(smooth ? error < cases[c].after : error > cases[c].before);
            label_surface_free(&surface);
            net_free(&net);
        }
    }
    PASS();
}

TEST a_ball_keeps_its_volume(void)
{
    struct net net;
    struct label_surface surface;
    ASSERT(net_of(ball, 40, &net) && surface_of(&net, 7, &surface));
    ASSERT_IN_RANGE(4188.8, volume_of(&surface), 0.01 * 4188.8); /* and so its triangles face outwards */
    label_surface_free(&surface);
    net_free(&net);
    PASS();
}

/* Every triangle between two labels is one of both, and they face each other: so the solids fill the ball without gap or overlap. */
TEST labels_that_touch_have_the_same_triangles(void)
{
    static const uint32_t labels[3] = {4000000001u, 4000000002u, 3u};
    struct net net;
    struct label_surface surfaces[3];
    size_t alone = 0, shared = 0;
    ASSERT(net_of(thirds, 40, &net));
    for (int l = 0; l < 3; ++l) {
        size_t open, twice;
        ASSERT(surface_of(&net, labels[l], &surfaces[l]));
        count_edges(&surfaces[l], &open, &twice);
        ASSERT_EQ(0, open);
        ASSERT_EQ(0, twice);
        ASSERT(volume_of(&surfaces[l]) > 1500.0);
    }
    struct edge *keys = malloc(3 * 40000 * sizeof *keys); /* the two least vertices of the net of a triangle: diagonals are unique */
    size_t count = 0;
    for (int l = 0; l < 3; ++l) {
        const struct label_surface *s = &surfaces[l];
        for (size_t t = 0; t < s->triangle_count; ++t) {
            uint32_t v[3];
            for (int k = 0; k < 3; ++k) v[k] = s->vertices[s->triangles[3 * t + (size_t)k]];
            for (int i = 0; i < 3; ++i) {
                for (int j = 0; j < 2; ++j) {
                    const uint32_t low = v[j] < v[j + 1] ? v[j] : v[j + 1], high = v[j] < v[j + 1] ? v[j + 1] : v[j];
                    v[j] = low, v[j + 1] = high;
                }
            }
            ASSERT(count < 3 * 40000 && v[0] < 65536 && v[1] < 65536);
            keys[count++] = (struct edge){v[0] << 16 | v[1], v[2]};
        }
    }
    qsort(keys, count, sizeof *keys, compare_edges);
    for (size_t n = 0; n < count;) {
        size_t same = 1;
        while (n + same < count && compare_edges(&keys[n], &keys[n + same]) == 0) ++same;
        ASSERT(same <= 2);
        *(same == 2 ? &shared : &alone) += 1;
        n += same;
    }
    /* Of three half-discs and a sphere of radius 12, in pairs of triangles a square voxel at least. */
    ASSERT(shared > 1000 && alone > 3000);
    for (int l = 0; l < 3; ++l) label_surface_free(&surfaces[l]);
    free(keys);
    net_free(&net);
    PASS();
}

/* The outside is all that single triangles bound: its volume is the sum of the labels'. */
TEST volumes_add_up(void)
{
    struct net net;
    double sum = 0.0;
    ASSERT(net_of(noise, 20, &net));
    for (uint32_t l = 0; l < 4; ++l) { /* 0 too, whose surface faces the other way from outside */
        struct label_surface surface;
        size_t open, twice;
        ASSERT(surface_of(&net, l, &surface));
        count_edges(&surface, &open, &twice);
        ASSERT_EQ(0, open);
        sum += volume_of(&surface);
        label_surface_free(&surface);
    }
    ASSERT_IN_RANGE(0.0, sum, 0.01); /* every triangle is there twice, once each way */
    net_free(&net);
    PASS();
}

static uint32_t crumbs(float x, float y, float z)
{
    const bool voxel = fabsf(x - 5.0f) < 0.5f && fabsf(y) < 0.5f && fabsf(z) < 0.5f;
    const bool sheet = x + 3.3f > 0.0f && x + 3.3f < 1.0f && y * y + z * z < 64.0f;
    return voxel ? 1 : sheet ? 2 : 3;
}

TEST thin_labels_stay(void)
{
    struct net net;
    ASSERT(net_of(crumbs, 1000, &net));
    for (uint32_t l = 1; l < 3; ++l) {
        struct label_surface surface;
        ASSERT(surface_of(&net, l, &surface));
        ASSERT(volume_of(&surface) > (l == 1 ? 0.0 : 40.0));
        label_surface_free(&surface);
    }
    net_free(&net);
    PASS();
}

/* ---- the program ---- */

static int run_program(const char *const *arguments)
{
    char *argv[32] = {(char *)(uintptr_t) "build/surfaces"};
    int argc = 1;
    for (; arguments[argc - 1]; ++argc) argv[argc] = (char *)(uintptr_t)arguments[argc - 1];
    return surfaces_main(argc, argv);
}

#define RUN(...) run_program((const char *const[]){__VA_ARGS__, "--quiet", NULL})

/* Runs the program; returns its status, with what it says on stderr in `text`. */
static int run_to_text(const char *const *arguments, char *text, size_t size)
{
    const char *path = scratch("stderr.txt");
    fflush(stderr);
    const int kept = dup(2);
    FILE *file = fopen(path, "w");
    dup2(fileno(file), 2);
    const int status = run_program(arguments);
    fflush(stderr);
    dup2(kept, 2);
    close(kept);
    fclose(file);
    char *whole = whole_file(path, NULL);
    snprintf(text, size, "%s", whole);
    free(whole);
    return status;
}

/* Writes the map with voxels of 1 x 1.5 x 2 mm; mirrored: along x. */
static bool write_map(const char *path, bool mirrored)
{
    const float spacing[3] = {1.0f, 1.5f, 2.0f}, origin[3] = {-20.0f, 30.0f, 5.0f};
    char error[VOLUME_TEXT];
    struct volume like;
    if (!volume_create(dims, spacing, origin, &like)) return false;
    like.affine[0][0] *= mirrored ? -1.0 : 1.0;
    const bool good = volume_write(path, &like, VOLUME_UINT32, map, error);
    volume_free(&like);
    return good;
}

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    fputs(text, file);
    fclose(file);
}

static const char snap_table[] = "################\n# ITK-SnAP Label Description File\n"
                                 "    0     0    0    0        0  0  0    \"Clear Label\"\n"
                                 "    3   255  128    0        1  1  1    \"left, \"\"third\"\"\"\n"
                                 "4000000001 0 0 255 0.5 1 1 \"one / two\"\r\n";

TEST ids_of_32_bits_names_and_volumes_are_reported(void)
{
    const char *const extensions[] = {"map.nii.gz", "map.nrrd", "map.mha"};
    fill(thirds);
    write_text(scratch("table.txt"), snap_table);
    ASSERT_EQ(0, mkdir(scratch("out"), 0777));
    write_text(scratch("out/surfaces.png"), "an earlier run's");
    for (int f = 0; f < 6; ++f) {
        ASSERT(write_map(scratch(extensions[f / 2]), f % 2 == 1));
        ASSERT_EQ(0, RUN(scratch(extensions[f / 2]), "--table", scratch("table.txt"), "--out", scratch("out"), "--no-pictures"));
        cJSON *json = read_report(scratch("out/report.json")), *labels = cJSON_GetObjectItem(json, "labels");
        ASSERT_EQ(3, cJSON_GetArraySize(labels));
        double sum = 0.0, voxels = 0.0;
        for (int l = 0; l < 3; ++l) {
            const double ids[3] = {3.0, 4000000001.0, 4000000002.0};
            const cJSON *label = cJSON_GetArrayItem(labels, l);
            ASSERT_EQ(ids[l], number_of(label, "label"));
            ASSERT_IN_RANGE(number_of(label, "voxels_ml"), number_of(label, "volume_ml"), 0.02 * number_of(label, "voxels_ml"));
            sum += number_of(label, "volume_ml");
            voxels += number_of(label, "voxels");
        }
        ASSERT_EQ(7239.0, voxels > 7200.0 && voxels < 7280.0 ? 7239.0 : voxels); /* a ball of radius 12 */
        ASSERT_IN_RANGE(21.715, sum, 0.25);
        ASSERT_STR_EQ("one / two", cJSON_GetStringValue(cJSON_GetObjectItem(cJSON_GetArrayItem(labels, 1), "name")));
        ASSERT_EQ(0, access(scratch("out/label_4000000001_one___two.ply"), R_OK));
        ASSERT_EQ(0, access(scratch("out/label_4000000002.ply"), R_OK));
        ASSERT_EQ(0, access(scratch("out/surfaces.glb"), R_OK));
        ASSERT(access(scratch("out/surfaces.png"), F_OK) != 0);
        cJSON_Delete(json);
    }
    char *table = whole_file(scratch("out/table.csv"), NULL);
    ASSERT(strstr(table, "label,name,layer,voxels,voxels_ml,volume_ml,area_cm2,triangles\n3,\"left, \"\"\"\"third\"\"\"\"\",0,"));
    free(table);
    PASS();
}

TEST a_mesh_is_at_its_place_and_all_are_in_the_glb(void)
{
    char error[MESH_TEXT];
    struct mesh one, all;
    fill(ball);
    for (int n = 0; n < VOXELS; ++n) map[n] += map[n] && n % SIDE > 20 ? 1 : 0;
    ASSERT(write_map(scratch("map.nii.gz"), false));
    ASSERT_EQ(0, RUN(scratch("map.nii.gz"), "--out", scratch("place"), "--meshes", "stl"));
    ASSERT_EQ(0, access(scratch("place/surfaces.png"), R_OK));
    ASSERT(mesh_read(scratch("place/label_8.stl"), &one, error));
    ASSERT(mesh_read(scratch("place/surfaces.glb"), &all, error));
    ASSERT(all.triangle_count > one.triangle_count);
    float low = INFINITY, high = -INFINITY;
    for (size_t v = 0; v < one.vertex_count; ++v) {
        low = fminf(low, one.positions[3 * v + 2]);
        high = fmaxf(high, one.positions[3 * v + 2]);
    }
    /* The ball's poles, seen in a part of it that lies a voxel beside them. */
    ASSERT_IN_RANGE(5.0f + 2.0f * (middle[2] - 9.9f), low, 0.8f);
    ASSERT_IN_RANGE(5.0f + 2.0f * (middle[2] + 9.9f), high, 0.8f);
    mesh_free(&one);
    mesh_free(&all);
    PASS();
}

/* ---- walls.vtk ---- */

static uint32_t crumbled(float x, float y, float z) { return x * x + y * y + z * z < 36.0f ? noise(x, y, z) : 0; }

struct walls_file {
    float *places;
    int *triangles;
    uint32_t *labels;
    int vertex_count, triangle_count;
};

static bool read_walls(const char *path, struct walls_file *w)
{
    FILE *file = fopen(path, "r");
    bool good = file && fscanf(file, "# vtk DataFile Version 3.0 %*[^\n] ASCII DATASET POLYDATA POINTS %d float", &w->vertex_count) == 1;
    w->places = malloc(((size_t)w->vertex_count + 1) * 3 * sizeof *w->places);
    for (int i = 0; good && i < 3 * w->vertex_count; ++i) good = fscanf(file, "%f", &w->places[i]) == 1;
    good = good && fscanf(file, " POLYGONS %d %*d", &w->triangle_count) == 1;
    w->triangles = malloc(((size_t)w->triangle_count + 1) * 3 * sizeof *w->triangles);
    w->labels = malloc(((size_t)w->triangle_count + 1) * 2 * sizeof *w->labels);
    for (int t = 0; good && t < w->triangle_count; ++t) {
        int *v = w->triangles + 3 * t;
        good = fscanf(file, " 3 %d %d %d", &v[0], &v[1], &v[2]) == 3;
    }
    good = good && fscanf(file, " CELL_DATA %*d SCALARS labels unsigned_int 2 LOOKUP_TABLE default") == 0;
    for (int i = 0; good && i < 2 * w->triangle_count; ++i) good = fscanf(file, "%" SCNu32, &w->labels[i]) == 1;
    if (file) fclose(file);
    return good;
}

static void walls_free(struct walls_file *w)
{
    free(w->places);
    free(w->triangles);
    free(w->labels);
}

/* Gathers the triangles that bound a label, facing outwards. */
static struct label_surface bounds_of(const struct walls_file *w, uint32_t label)
{
    struct label_surface s = {.places = w->places};
    s.triangles = malloc(((size_t)w->triangle_count + 1) * 3 * sizeof *s.triangles);
    for (int t = 0; t < w->triangle_count; ++t) {
        const uint32_t *sides = w->labels + 2 * t;
        if ((sides[0] == label) == (sides[1] == label)) continue;
        for (int k = 0; k < 3; ++k) {
            s.triangles[3 * s.triangle_count + (size_t)k] = (uint32_t)w->triangles[3 * t + (sides[0] == label ? k : 2 - k)];
        }
        ++s.triangle_count;
    }
    return s;
}

/* Walls of crumbs as small as a voxel: no triangle crosses another, each bounds two labels, and those of a label enclose it. */
TEST walls_bound_all_labels_and_never_cross(void)
{
    for (int mirrored = 0; mirrored < 2; ++mirrored) {
        struct walls_file walls = {0};
        fill(mirrored ? thirds : crumbled);
        ASSERT(write_map(scratch("map.nii.gz"), mirrored));
        ASSERT_EQ(
            0,
            RUN(scratch("map.nii.gz"), "--out", scratch("walls"), "--no-pictures", "--meshes", "none", "--smooth", mirrored ? "40" : "5"));
        ASSERT(read_walls(scratch("walls/walls.vtk"), &walls));
        ASSERT(walls.triangle_count > 1000);
        ASSERT_EQ(0, mesh_mark_crossings(walls.places, walls.triangles, walls.triangle_count, NULL));
        for (int t = 0; t < walls.triangle_count; ++t) ASSERT(walls.labels[2 * t] != walls.labels[2 * t + 1]);
        static const uint32_t labels[2][3] = {{1, 2, 3}, {4000000001u, 4000000002u, 3u}};
        for (int l = 0; l < 3; ++l) {
            struct label_surface s = bounds_of(&walls, labels[mirrored][l]);
            size_t open, twice;
            double voxels = 0.0;
            for (int n = 0; n < VOXELS; ++n) voxels += map[n] == labels[mirrored][l];
            count_edges(&s, &open, &twice);
            ASSERT_EQ(0, open);
            ASSERT_IN_RANGE(3.0 * voxels, volume_of(&s), 0.25 * 3.0 * voxels);
            free(s.triangles);
        }
        walls_free(&walls);
    }
    PASS();
}

TEST threads_do_not_change_a_bit(void)
{
    size_t lengths[2];
    char *files[2];
    fill(thirds);
    ASSERT(write_map(scratch("map.nii.gz"), false));
    for (int t = 0; t < 2; ++t) {
        ASSERT_EQ(0, RUN(scratch("map.nii.gz"), "--threads", t ? "3" : "1", "--out", scratch(t ? "three" : "one"), "--no-pictures"));
        files[t] = whole_file(scratch(t ? "three/surfaces.glb" : "one/surfaces.glb"), &lengths[t]);
    }
    ASSERT_EQ(lengths[0], lengths[1]);
    ASSERT_EQ(0, memcmp(files[0], files[1], lengths[0]));
    free(files[0]);
    free(files[1]);
    PASS();
}

/* Writes a file as Slicer does: two layers of 6^3 voxels, of which the second overlaps the first. */
static void write_segments(const char *path)
{
    FILE *file = fopen(path, "wb");
    fputs("NRRD0004\ntype: unsigned char\ndimension: 4\nspace: left-posterior-superior\nsizes: 2 6 6 6\n"
          "space directions: none (2,0,0) (0,2,0) (0,0,2)\nkinds: list domain domain domain\nencoding: raw\nspace origin: (0,0,0)\n"
          "Segment0_ID:=Segment_1\nSegment0_Name:=liver\nSegment0_LabelValue:=1\nSegment0_Layer:=0\nSegment0_Color:=1 0 0\n"
          "Segment1_Name:=left kidney\nSegment1_LabelValue:=2\nSegment1_Layer:=0\n"
          "Segment2_Name:=tumour\nSegment2_LabelValue:=1\nSegment2_Layer:=1\n\n", file);
    for (int n = 0; n < 216; ++n) {
        const int x = n % 6, y = n / 6 % 6;
        fputc(y > 0 && y < 5 ? 1 + (x >= 3) : 0, file);
        fputc(x > 1 && x < 4 && y > 1 && y < 4, file);
    }
    fclose(file);
}

TEST segments_and_layers_are_chosen(void)
{
    write_segments(scratch("two.seg.nrrd"));
    const struct {
        const char *option, *value;
        int count;
        const char *name;
    } cases[] = {{"--smooth", "5", 3, "liver"}, {"--layer", "1", 1, "tumour"}, {"--layer", "0", 2, "liver"},
                 {"--name", "left kidney;tumour", 2, "left kidney"}, {"--label", "2", 1, "left kidney"}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; ++c) {
        ASSERT_EQ(0, RUN(scratch("two.seg.nrrd"), cases[c].option, cases[c].value, "--out", scratch("slicer"), "--no-pictures"));
        cJSON *json = read_report(scratch("slicer/report.json")), *labels = cJSON_GetObjectItem(json, "labels");
        ASSERT_EQ(cases[c].count, cJSON_GetArraySize(labels));
        ASSERT_STR_EQ(cases[c].name, cJSON_GetStringValue(cJSON_GetObjectItem(cJSON_GetArrayItem(labels, 0), "name")));
        cJSON_Delete(json);
    }
    ASSERT_EQ(0, access(scratch("slicer/layer_1_label_1_tumour.ply"), R_OK));
    PASS();
}

TEST bad_input_gets_a_line(void)
{
    char text[512];
    fill(noise);
    for (int n = 0; n < VOXELS; ++n) map[n] = (uint32_t)n * 2654435761u >> 20;
    ASSERT(write_map(scratch("scan.nii.gz"), false));
    memset(map, 0, sizeof map);
    ASSERT(write_map(scratch("empty.nii.gz"), false));
    fill(ball);
    ASSERT(write_map(scratch("map.nii.gz"), false));
    write_segments(scratch("layers.nrrd"));
    write_text(scratch("bad.txt"), "1 2 three\n");
    write_text(scratch("twice.txt"), "1 liver 1 2 3 0\n1 spleen 1 2 3 0\n");
    write_text(scratch("none.txt"), "# nothing\n");
    const struct {
        int status;
        const char *file, *option, *value, *reason;
    } cases[] = {{1, "scan.nii.gz", NULL, NULL, "looks like a scan"},
                 {1, "empty.nii.gz", NULL, NULL, "no voxel has a label"},
                 {1, "map.nii.gz", "--label", "9", "no voxel has a label asked for"},
                 {1, "map.nii.gz", "--label", "9.5", "--label wants whole numbers"},
                 {1, "map.nii.gz", "--name", "liver", "no voxel has a label asked for"},
                 {2, "map.nii.gz", "--meshes", "ply", "--out"}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; ++c) {
        const char *const words[] = {scratch(cases[c].file), cases[c].option, cases[c].value, NULL};
        ASSERT_EQ(cases[c].status, run_to_text(words, text, sizeof text));
        ASSERTm(text, strncmp(text, "surfaces: ", 10) == 0 && strstr(text, cases[c].reason));
    }
    const struct {
        const char *table, *reason;
    } tables[] = {
        {"bad.txt", "line 1"}, {"twice.txt", "label 1 has a line already"}, {"none.txt", "without labels"}, {"gone.txt", "not readable"}};
    for (size_t c = 0; c < sizeof tables / sizeof *tables; ++c) {
        const char *const words[] = {scratch("map.nii.gz"), "--table", scratch(tables[c].table), NULL};
        ASSERT_EQ(1, run_to_text(words, text, sizeof text));
        ASSERTm(text, strstr(text, tables[c].reason));
    }
    write_text(scratch("good.txt"), snap_table);
    const char *const layers[] = {scratch("layers.nrrd"), "--table", scratch("good.txt"), NULL};
    ASSERT_EQ(1, run_to_text(layers, text, sizeof text));
    ASSERTm(text, strstr(text, "choose one with --layer"));
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(steps_of_voxels_are_flattened);
    RUN_TEST(a_ball_keeps_its_volume);
    RUN_TEST(labels_that_touch_have_the_same_triangles);
    RUN_TEST(volumes_add_up);
    RUN_TEST(thin_labels_stay);
    RUN_TEST(ids_of_32_bits_names_and_volumes_are_reported);
    RUN_TEST(a_mesh_is_at_its_place_and_all_are_in_the_glb);
    RUN_TEST(walls_bound_all_labels_and_never_cross);
    RUN_TEST(threads_do_not_change_a_bit);
    RUN_TEST(segments_and_layers_are_chosen);
    RUN_TEST(bad_input_gets_a_line);
    if (!remove_folder()) return 1;
    GREATEST_MAIN_END();
}

#endif
