/* glTF 2.0 files as examples/common reads them: every accessor type, normalized or not, sparse, interleaved, for every attribute and
 * channel, beside the same file in floats; and what else the core has. The files are made here. Compiled like test_common.c, else
 * skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_gltf_built_without_their_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_gltf_built_without_their_libraries);
    GREATEST_MAIN_END();
}

#else

#include "character/character.h"
#include "character/gltf_character.h"
#include "surface/mesh_io.h"

#include <math.h>
#include <meshoptimizer.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "scratch.h"

/* assimp 5.2 loses memory of its own on some broken files; LeakSanitizer calls this function for what to ignore. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libassimp\n"; }

#define ASSERT_NEARm(message, expected, got, tolerance) \
    ASSERTm(message, fabs((double)(expected) - (double)(got)) <= (double)(tolerance))
#define ASSERT_NEAR(expected, got, tolerance) ASSERT_IN_RANGE((double)(expected), (double)(got), (double)(tolerance))

/* ---- a file ---- */

enum { BYTE = 5120, UBYTE = 5121, SHORT = 5122, USHORT = 5123, UINT = 5125, FLOAT = 5126 };

/* How an accessor is stored. sparse: 1 over a view, 2 without one; the indices of the sparse part are of type `index`. gap: bytes
 * between elements. */
struct storage {
    int type, index, sparse, gap;
    bool normalized;
};

static const struct storage floats = {FLOAT, USHORT, 0, 0, false};

/* JSON and bytes that grow. */
static struct {
    char views[65536], accessors[65536];
    unsigned char bytes[65536];
    size_t used;
    int view_count, accessor_count;
} made;

static size_t size_of(int type) { return type == BYTE || type == UBYTE ? 1 : type == SHORT || type == USHORT ? 2 : 4; }

static double one_of(int type)
{
    return type == BYTE ? 127.0 : type == UBYTE ? 255.0 : type == SHORT ? 32767.0 : type == USHORT ? 65535.0 : 4294967295.0;
}

static void append(char *to, size_t room, const char *format, ...)
{
    const size_t used = strlen(to);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(to + used, room - used, format, arguments);
    va_end(arguments);
}

static void begin_file(void) { memset(&made, 0, sizeof made); }

/* Stores a number, its lowest byte first. */
static void put(int type, double value)
{
    const float real = (float)value;
    uint32_t bits = value < 0.0 ? (uint32_t)(int32_t)value : (uint32_t)value;
    if (type == FLOAT) memcpy(&bits, &real, sizeof bits);
    for (size_t b = 0; b < size_of(type); ++b) made.bytes[made.used++] = (unsigned char)(bits >> 8 * b);
}

/* Begins a view at a multiple of four bytes; returns where. */
static size_t begin_view(void)
{
    while (made.used % 4) made.bytes[made.used++] = 0xAB;
    return made.used;
}

static int end_view(size_t start, int stride)
{
    append(made.views, sizeof made.views, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu", made.view_count ? "," : "", start,
           made.used - start);
    if (stride) append(made.views, sizeof made.views, ",\"byteStride\":%d", stride);
    append(made.views, sizeof made.views, "}");
    return made.view_count++;
}

/* Stores elements first, first + step, ...; with junk before and between them where there is a gap. */
static int put_elements(const double *raw, int first, int count, int step, int width, const struct storage *s)
{
    const size_t start = begin_view(), size = size_of(s->type) * (size_t)width;
    const int stride = s->gap ? (int)(size + 3) / 4 * 4 + s->gap : 0;
    for (int i = 0; i < s->gap; ++i) made.bytes[made.used++] = 0xCD;
    for (int e = 0; e < count; ++e) {
        for (int i = 0; i < width; ++i) put(s->type, raw[(first + e * step) * width + i]);
        for (size_t i = size; stride && i < (size_t)stride; ++i) made.bytes[made.used++] = 0xEF;
    }
    return end_view(start, stride);
}

/* Adds an accessor; returns its number. Sparse: every second element, over junk or over 0. */
static int add_accessor(const double *raw, int count, int width, const struct storage *s)
{
    static const char *const shapes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    const char *shape = width == 16 ? "MAT4" : shapes[width];
    char *json = made.accessors;
    append(json, sizeof made.accessors, "%s{\"componentType\":%d,\"count\":%d,\"type\":\"%s\"", made.accessor_count ? "," : "", s->type,
           count, shape);
    if (s->normalized) append(json, sizeof made.accessors, ",\"normalized\":true");
    if (s->sparse < 2) {
        double *under = malloc((size_t)(count * width) * sizeof *under);
        for (int i = 0; i < count * width; ++i) under[i] = s->sparse && i / width % 2 ? 77.0 : raw[i];
        append(json, sizeof made.accessors, ",\"bufferView\":%d,\"byteOffset\":%d", put_elements(under, 0, count, 1, width, s), s->gap);
        free(under);
    }
    if (s->sparse) {
        const int first = s->sparse == 1, step = s->sparse == 1 ? 2 : 1, sparse = (count - first + step - 1) / step;
        const size_t start = begin_view();
        for (int e = 0; e < sparse; ++e) put(s->index, first + e * step);
        const int indices = end_view(start, 0);
        append(json, sizeof made.accessors,
               ",\"sparse\":{\"count\":%d,\"indices\":{\"bufferView\":%d,\"componentType\":%d},\"values\":{\"bufferView\":%d,"
               "\"byteOffset\":%d}}",
               sparse, indices, s->index, put_elements(raw, first, sparse, step, width, s), s->gap);
    }
    append(json, sizeof made.accessors, "}");
    return made.accessor_count++;
}

static void put_word(FILE *file, size_t value)
{
    for (int b = 0; b < 4; ++b) fputc((int)(value >> 8 * b & 255), file);
}

/* Writes a GLB of the accessors and the rest of the JSON. */
static const char *write_file(const char *name, const char *rest)
{
    static char json[262144];
    json[0] = '\0';
    begin_view();
    append(json, sizeof json,
           "{\"asset\":{\"version\":\"2.0\"},%s,\"bufferViews\":[%s],\"accessors\":[%s],\"buffers\":[{\"byteLength\":%zu}]}", rest,
           made.views, made.accessors, made.used);
    while (strlen(json) % 4) append(json, sizeof json, " ");
    FILE *file = fopen(scratch(name), "wb");
    fwrite("glTF\2\0\0\0", 1, 8, file);
    put_word(file, 28 + strlen(json) + made.used);
    put_word(file, strlen(json));
    fwrite("JSON", 1, 4, file);
    fputs(json, file);
    put_word(file, made.used);
    fwrite("BIN\0", 1, 4, file);
    fwrite(made.bytes, 1, made.used, file);
    fclose(file);
    return scratch(name);
}

/* ---- every accessor ---- */

enum { CORNERS = 8, KEYS = 5, TRIANGLES = 12 };

enum part { POSITION, NORMAL, TARGET, UV, COLOR3, COLOR4, JOINTS, WEIGHTS, INDICES, TIMES, MOVES, TURNS, SCALES, PARTS };

static const struct {
    const char *name;
    int count, width;
} parts[PARTS] = {{"POSITION", CORNERS, 3}, {"NORMAL", CORNERS, 3},  {"morph target", CORNERS, 3}, {"TEXCOORD_0", CORNERS, 2},
                  {"COLOR_0", CORNERS, 3},  {"COLOR_0", CORNERS, 4}, {"JOINTS_0", CORNERS, 4},     {"WEIGHTS_0", CORNERS, 4},
                  {"indices", 3 * TRIANGLES, 1}, {"times", KEYS, 1}, {"translation", KEYS, 3},     {"rotation", KEYS, 4},
                  {"scale", KEYS, 3}};

/* Returns the number that is stored for a part, within the range of the type. */
static double raw_number(enum part part, int index, int type)
{
    static const int faces[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    const int element = index / parts[part].width, i = index % parts[part].width;
    const bool has_sign = type == BYTE || type == SHORT || type == FLOAT;
    const double top = type == BYTE ? 127.0 : type == SHORT ? 32767.0 : type == USHORT ? 65535.0 : type == UINT ? 1e5 : 200.0;
    switch (part) {
    case POSITION: return (element >> i & 1 ? 0.75 : 0.25) * top - (has_sign && i == 0 ? top : 0.0);
    case TIMES: return floor(top / 10.0) * (element + 1);
    case INDICES: return faces[index];
    case JOINTS: return (element + i) % 2;
    case WEIGHTS: return i == 0 ? floor(top / 3.0) : i == 1 ? floor(top / (2.0 + element)) : 0.0;
    case TURNS: return floor(top * (0.2 + 0.15 * ((index * 7) % 5))) - (has_sign && index % 3 == 0 ? top : 0.0);
    case SCALES: return floor(top * (0.3 + 0.1 * ((index * 7) % 6)));
    default: return floor(top * ((index * 37) % 11) / 10.0) - (has_sign && index % 4 == 1 ? top + (type == BYTE) : 0.0);
    }
}

/* Writes the body, one of its parts stored in another way; or, as `plain`, what that stands for as floats. */
static const char *write_body(const char *name, enum part other, const struct storage *storage, bool plain)
{
    int number[PARTS];
    char rest[4096] = "";
    begin_file();
    for (int p = 0; p < PARTS; ++p) {
        const bool is_other = p == (int)other;
        const int type = is_other ? storage->type : p == JOINTS || p == INDICES ? USHORT : FLOAT, count = parts[p].count * parts[p].width;
        struct storage s = floats;
        double *raw = malloc((size_t)count * sizeof *raw);
        s.type = type;
        for (int i = 0; i < count; ++i) {
            raw[i] = raw_number((enum part)p, i, type == FLOAT || p == JOINTS ? UBYTE : type);
            if (is_other) raw[i] = raw_number((enum part)p, i, type);
            if (type != FLOAT) raw[i] = trunc(raw[i]);
            if (is_other && plain && storage->normalized && type != FLOAT) raw[i] = fmax(raw[i] / one_of(type), -1.0);
        }
        if (is_other && !plain) s = *storage;
        if (is_other && plain && p != JOINTS && p != INDICES) s.type = FLOAT;
        number[p] = add_accessor(raw, parts[p].count, parts[p].width, &s);
        free(raw);
    }
    append(
        rest, sizeof rest,
        "\"scenes\":[{\"nodes\":[0,2]}],\"nodes\":[{\"name\":\"low\",\"children\":[1]},{\"name\":\"high\",\"translation\":[0,1,0]},"
        "{\"name\":\"body\",\"mesh\":0,\"skin\":0}],\"skins\":[{\"joints\":[0,1]}],\"meshes\":[{\"weights\":[0.25],\"primitives\":[{"
        "\"attributes\":{\"POSITION\":%d,\"NORMAL\":%d,\"TEXCOORD_0\":%d,\"COLOR_0\":%d,\"JOINTS_0\":%d,\"WEIGHTS_0\":%d},\"indices\":%d,"
        "\"targets\":[{\"POSITION\":%d}]}]}],\"animations\":[{\"name\":\"clip\",\"channels\":[",
        number[POSITION], number[NORMAL], number[UV], number[other == COLOR4 ? COLOR4 : COLOR3], number[JOINTS], number[WEIGHTS],
        number[INDICES], number[TARGET]);
    append(
        rest, sizeof rest,
        "{\"sampler\":0,\"target\":{\"node\":1,\"path\":\"translation\"}},{\"sampler\":1,\"target\":{\"node\":1,\"path\":\"rotation\"}},"
        "{\"sampler\":2,\"target\":{\"node\":1,\"path\":\"scale\"}}],\"samplers\":["
        "{\"input\":%d,\"output\":%d},{\"input\":%d,\"output\":%d},{\"input\":%d,\"output\":%d}]}]",
        number[TIMES], number[MOVES], number[TIMES], number[TURNS], number[TIMES], number[SCALES]);
    return write_file(name, rest);
}

static bool near(double a, double b) { return fabs(a - b) <= 1e-5 * (1.0 + fabs(a)); }

/* Returns what differs between two characters, NULL: nothing. */
static const char *difference(const struct character *a, const struct character *b)
{
    struct affine skins[2][8], places[8];
    if (a->joint_count != b->joint_count || a->vertex_count != b->vertex_count || a->triangle_count != b->triangle_count
        || a->animation_count != b->animation_count || a->skinned != b->skinned)
        return "counts";
    if (memcmp(a->triangles, b->triangles, 3 * (size_t)a->triangle_count * sizeof *a->triangles) != 0) return "triangles";
    for (int i = 0; i < 3 * a->vertex_count; ++i) {
        if (!near((double)a->positions[i], (double)b->positions[i])) return "positions";
        if (!near((double)a->normals[i], (double)b->normals[i])) return "normals";
        if (!near((double)a->colors[i], (double)b->colors[i])) return "colors";
    }
    for (int i = 0; i < 2 * a->vertex_count; ++i)
        if (!near((double)a->uvs[i], (double)b->uvs[i])) return "texture coordinates";
    for (int v = 0; v < a->vertex_count; ++v)
        for (int k = 0; k < CHARACTER_BONES; ++k)
            if (a->influences[v].joint[k] != b->influences[v].joint[k]
                || !near((double)a->influences[v].weight[k], (double)b->influences[v].weight[k]))
                return "weights";
    for (int k = 0; k < 9 && a->animation_count; ++k) {
        if (!near(a->animations[0].duration, b->animations[0].duration)) return "duration";
        const double time = a->animations[0].duration * k / 9.0;
        character_pose(a, 0, time, 1.0, skins[0], places);
        character_pose(b, 0, time, 1.0, skins[1], places);
        for (int j = 0; j < a->joint_count; ++j)
            for (int i = 0; i < 12; ++i)
                if (!near(skins[0][j].m[i], skins[1][j].m[i])) return "poses";
    }
    return NULL;
}

/* Whether a type makes sense: joints and vertices are numbered by whole numbers. */
static bool may_be(int part, int type, bool normalized)
{
    const bool number = part == JOINTS || part == INDICES, whole = type == UBYTE || type == USHORT || type == UINT;
    return number ? whole && !normalized : type != FLOAT || !normalized;
}

/* Every type x normalized x sparse x interleaved, for every attribute and channel. */
TEST every_accessor_is_what_it_stands_for(void)
{
    static const int types[] = {BYTE, UBYTE, SHORT, USHORT, UINT, FLOAT}, indices[] = {UBYTE, USHORT, UINT};
    int files = 0;
    for (int part = 0; part < PARTS; ++part)
        for (int t = 0; t < 6; ++t)
            for (int way = 0; way < 12; ++way) {
                const struct storage s = {types[t], indices[way % 3], way % 3, way / 6 ? 4 : 0, way / 3 % 2 != 0};
                struct character plain, other;
                static char error[CHARACTER_TEXT], message[400];
                if (!may_be(part, s.type, s.normalized)) continue;
                snprintf(message, sizeof message, "%s of type %d, normalized %d, sparse %d, gap %d: ", parts[part].name, s.type,
                         s.normalized, s.sparse, s.gap);
                ASSERTm(error, character_read(write_body("plain.glb", (enum part)part, &s, true), NULL, &plain, error));
                ASSERTm(error, character_read(write_body("other.glb", (enum part)part, &s, false), NULL, &other, error));
                ASSERT(plain.vertex_count == CORNERS && plain.triangle_count == TRIANGLES && plain.skinned);
                const char *differs = difference(&plain, &other);
                if (differs) append(message, sizeof message, "%s", differs);
                ASSERTm(message, !differs);
                character_free(&plain);
                character_free(&other);
                ++files;
            }
    ASSERT_GT(files, 600);
    PASS();
}

/* ---- triangles ---- */

static const double square[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 1, 1};

#define ONE_NODE "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],"

/* Strips and fans turn as lists do, with indices and without; points and lines stay out. */
TEST strips_and_fans_are_triangles(void)
{
    static const int wanted[3][9] = {{0, 1, 2, 1, 3, 2, 2, 3, 4}, {0, 1, 2, 0, 2, 3, 0, 3, 4}, {0, 1, 2, 3, 4, 5}};
    static const int modes[] = {5, 6, 4};
    double numbers[6];
    for (int i = 0; i < 6; ++i) numbers[i] = i;
    for (int m = 0; m < 3; ++m)
        for (int indexed = 0; indexed < 2; ++indexed) {
            const int count = modes[m] == 4 ? 6 : 5, triangles = modes[m] == 4 ? 2 : 3;
            struct storage whole = floats;
            struct character c;
            static char error[CHARACTER_TEXT];
            char rest[1024] = "";
            whole.type = UBYTE;
            begin_file();
            const int position = add_accessor(square, count, 3, &floats), index = add_accessor(numbers, count, 1, &whole);
            append(rest, sizeof rest, ONE_NODE "\"meshes\":[{\"primitives\":[{\"mode\":1,\"attributes\":{\"POSITION\":%d}},"
                   "{\"mode\":%d,\"attributes\":{\"POSITION\":%d}", position, modes[m], position);
            if (indexed) append(rest, sizeof rest, ",\"indices\":%d", index);
            append(rest, sizeof rest, "}]}]");
            ASSERTm(error, character_read(write_file("strip.glb", rest), NULL, &c, error));
            ASSERT_EQ(triangles, c.triangle_count);
            ASSERT_MEM_EQ(wanted[m], c.triangles, 3 * (size_t)triangles * sizeof(int));
            character_free(&c);
        }
    PASS();
}

static double volume_of(const float *p, const int *triangles, const uint32_t *indices, size_t count)
{
    double sum = 0.0;
    for (size_t t = 0; t < count; ++t) {
        const float *q[3];
        for (size_t k = 0; k < 3; ++k) q[k] = p + 3 * (triangles ? (size_t)triangles[3 * t + k] : indices[3 * t + k]);
        for (int i = 0; i < 3; ++i)
            sum += (double)q[0][i]
                * ((double)q[1][(i + 1) % 3] * (double)q[2][(i + 2) % 3] - (double)q[1][(i + 2) % 3] * (double)q[2][(i + 1) % 3]) / 6.0;
    }
    return sum;
}

/* Adds the corners and faces of a box of 1 x 1 x 2. */
static void add_box(int *position, int *index)
{
    double corners[3 * CORNERS], faces[3 * TRIANGLES];
    struct storage whole = floats;
    whole.type = UBYTE;
    for (int i = 0; i < CORNERS; ++i) corners[3 * i] = i & 1, corners[3 * i + 1] = i >> 1 & 1, corners[3 * i + 2] = 2.0 * (i >> 2 & 1);
    for (int i = 0; i < 3 * TRIANGLES; ++i) faces[i] = raw_number(INDICES, i, UBYTE);
    *position = add_accessor(corners, CORNERS, 3, &floats);
    *index = add_accessor(faces, 3 * TRIANGLES, 1, &whole);
}

/* A node that mirrors reverses the winding, 3.7.4, alone and below another; two mirrors are none. */
TEST mirrored_nodes_are_turned(void)
{
    static const char *const nodes[] = {
        "\"nodes\":[{\"mesh\":0,\"scale\":[-1,1,1]}]", "\"nodes\":[{\"mesh\":0,\"scale\":[-2,-1,-0.5]}]",
        "\"nodes\":[{\"mesh\":0,\"matrix\":[0,1,0,0,1,0,0,0,0,0,1,0,5,0,0,1]}]",
        "\"nodes\":[{\"scale\":[1,-1,1],\"children\":[1]},{\"mesh\":0,\"scale\":[1,1,-1]}]", "\"nodes\":[{\"mesh\":0}]"};
    for (int n = 0; n < 5; ++n) {
        int position, index;
        static char error[CHARACTER_TEXT];
        char rest[1024] = "";
        struct character c;
        struct mesh mesh;
        begin_file();
        add_box(&position, &index);
        append(rest, sizeof rest,
               "\"scenes\":[{\"nodes\":[0]}],%s,\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":%d},\"indices\":%d}]}]",
               nodes[n], position, index);
        ASSERTm(error, character_read(write_file("mirror.glb", rest), NULL, &c, error));
        ASSERTm(error, mesh_read(scratch("mirror.glb"), &mesh, error));
        ASSERT_NEAR(2.0, volume_of(c.positions, c.triangles, NULL, (size_t)c.triangle_count), 1e-5);
        ASSERT_NEAR(2.0, volume_of(mesh.positions, NULL, mesh.indices, mesh.triangle_count), 1e-5);
        character_free(&c);
        mesh_free(&mesh);
    }
    PASS();
}

/* ---- skins ---- */

/* Writes two boxes, each with a skin of its own, of one joint: the lower at the origin, the upper at y = 1, which a clip turns by a
 * quarter about z. The second box is bound in a space of its own: half of it, moved by (3, 1, 0), is the world. A channel that moves
 * weights of morph targets is in the clip too. swap: the second box comes first. */
static const char *write_skins(bool swap)
{
    static const double times[2] = {0, 1}, turns[8] = {0, 0, 0, 1, 0, 0, 0.70710678118654752, 0.70710678118654752}, weights[2] = {0, 1};
    static const double offsets[2][16] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                          {0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 3, 0, 0, 1}};
    double zero[4 * CORNERS] = {0}, share[4 * CORNERS] = {0};
    struct storage whole = floats;
    char rest[4096] = "";
    int position, index;
    whole.type = UBYTE;
    for (int i = 0; i < CORNERS; ++i) share[4 * i] = 1.0;
    begin_file();
    add_box(&position, &index);
    const int joint = add_accessor(zero, CORNERS, 4, &whole), weight = add_accessor(share, CORNERS, 4, &floats),
              low = add_accessor(offsets[0], 1, 16, &floats), high = add_accessor(offsets[1], 1, 16, &floats),
              time = add_accessor(times, 2, 1, &floats), turn = add_accessor(turns, 2, 4, &floats),
              morph = add_accessor(weights, 2, 1, &floats);
    append(rest, sizeof rest,
           "\"scenes\":[{\"nodes\":[0,2,3]}],\"nodes\":[{\"name\":\"low\",\"children\":[1]},{\"name\":\"high\",\"translation\":[0,1,0]},"
           "{\"mesh\":0,\"skin\":%d},{\"mesh\":0,\"skin\":%d}],"
           "\"skins\":[{\"joints\":[0],\"inverseBindMatrices\":%d},{\"joints\":[1],\"inverseBindMatrices\":%d}],",
           swap, !swap, low, high);
    append(rest, sizeof rest,
           "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":%d,\"JOINTS_0\":%d,\"WEIGHTS_0\":%d},\"indices\":%d}]}],"
           "\"animations\":[{\"channels\":[{\"sampler\":0,\"target\":{\"node\":2,\"path\":\"weights\"}},"
           "{\"sampler\":1,\"target\":{\"node\":1,\"path\":\"rotation\"}}],"
           "\"samplers\":[{\"input\":%d,\"output\":%d},{\"input\":%d,\"output\":%d}]}]",
           position, joint, weight, index, time, morph, time, turn);
    return write_file("skins.glb", rest);
}

/* Whatever space a skin is bound in: its joints and its part are where they rest, and turn together. */
TEST skins_are_bound_in_their_own_spaces(void)
{
    for (int swap = 0; swap < 2; ++swap) {
        struct affine skin[8], places[8];
        struct character c;
        static char error[CHARACTER_TEXT];
        float posed[6 * CORNERS];
        ASSERTm(error, character_read(write_skins(swap != 0), NULL, &c, error));
        ASSERT_EQ(2 * CORNERS, c.vertex_count);
        ASSERT_NEAR(1.0, c.joints[character_joint(&c, "high")].neutral.m[7], 1e-6);
        ASSERT_NEAR(1.0, c.joints[character_joint(&c, "high")].neutral.m[0], 1e-6);
        ASSERT_NEAR(0.0, c.joints[character_joint(&c, "low")].neutral.m[7], 1e-6);
        ASSERT_NEAR(1.0, c.animations[0].duration, 1e-6);
        character_pose(&c, 0, 0.999999, 1.0, skin, places);
        character_skin(&c, skin, posed);
        for (int v = 0; v < CORNERS; ++v) {
            const double box[3] = {v & 1, v >> 1 & 1, 2.0 * (v >> 2 & 1)};
            const int low = 3 * (v + swap * CORNERS), high = 3 * (v + !swap * CORNERS);
            for (int i = 0; i < 3; ++i) {
                ASSERT_NEAR(box[i], c.positions[low + i], 1e-5);
                ASSERT_NEAR(0.5 * box[i] + (i == 0 ? 3.0 : i == 1 ? 1.0 : 0.0), c.positions[high + i], 1e-5);
            }
            ASSERT_NEAR(-0.5 * box[1], posed[high], 1e-4);
            ASSERT_NEAR(0.5 * box[0] + 4.0, posed[high + 1], 1e-4);
        }
        character_free(&c);
    }
    PASS();
}

/* ---- morph targets ---- */

/* The weights of the node go before those of the mesh; a target of weight 0 adds nothing. */
TEST morph_targets_have_their_default_weights(void)
{
    static const struct {
        const char *mesh, *node;
        double size;
    } cases[] = {{"", "", 1.0},
                 {"\"weights\":[0.5,0],", "", 1.5},
                 {"\"weights\":[0.5,0],", ",\"weights\":[0,2]", 1.2},
                 {"\"weights\":[0.5,1],", "", 1.6}};
    for (int k = 0; k < 4; ++k) {
        int position, index, targets[2];
        static char error[CHARACTER_TEXT];
        char rest[1024] = "";
        struct mesh mesh;
        begin_file();
        add_box(&position, &index);
        for (int t = 0; t < 2; ++t) {
            double offsets[3 * CORNERS];
            const struct storage way = {FLOAT, UBYTE, t ? 2 : 0, 0, false};
            for (int i = 0; i < 3 * CORNERS; ++i) offsets[i] = (t ? 0.1 : 1.0) * (i % 3 == 2 ? 2.0 * (i / 12) : i / 3 >> i % 3 & 1);
            targets[t] = add_accessor(offsets, CORNERS, 3, &way);
        }
        append(rest, sizeof rest,
               "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0%s}],\"meshes\":[{%s\"primitives\":[{\"attributes\":{\"POSITION\":%d},"
               "\"indices\":%d,\"targets\":[{\"POSITION\":%d},{\"POSITION\":%d}]}]}]",
               cases[k].node, cases[k].mesh, position, index, targets[0], targets[1]);
        ASSERTm(error, mesh_read(write_file("targets.glb", rest), &mesh, error));
        ASSERT_NEAR(2.0 * pow(cases[k].size, 3.0), volume_of(mesh.positions, NULL, mesh.indices, mesh.triangle_count), 1e-4);
        mesh_free(&mesh);
    }
    PASS();
}

/* ---- clips ---- */

/* Writes a joint that moves and turns: values of the keys at 0, 1, 3 s; groups: 3 where they have tangents. */
static const char *write_clip(const char *interpolation, int groups, const double *moves, const double *turns)
{
    static const double times[3] = {0, 1, 3};
    int position, index;
    char rest[2048] = "";
    begin_file();
    add_box(&position, &index);
    const int input = add_accessor(times, 3, 1, &floats), move = add_accessor(moves, 3 * groups, 3, &floats),
              turn = add_accessor(turns, 3 * groups, 4, &floats);
    append(
        rest, sizeof rest,
        ONE_NODE
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":%d},\"indices\":%d}]}],\"animations\":[{\"channels\":["
        "{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"translation\"}},{\"sampler\":1,\"target\":{\"node\":0,\"path\":\"rotation\"}}],"
        "\"samplers\":[{\"input\":%d,\"output\":%d,\"interpolation\":\"%s\"},{\"input\":%d,\"output\":%d,\"interpolation\":\"%s\"}]}]",
        position, index, input, move, interpolation, input, turn, interpolation);
    return write_file("clip.glb", rest);
}

/* Checks where the joint is, and its turn about z, of a character and of the same after it was written and read again. */
static greatest_test_res check_clip(const char *path, int count, const double *times, const double *x, const double *angles)
{
    struct character c, again;
    static char error[CHARACTER_TEXT];
    ASSERTm(error, character_read(path, NULL, &c, error));
    ASSERT(gltf_write_character(scratch("again.glb"), &c));
    ASSERTm(error, character_read(scratch("again.glb"), NULL, &again, error));
    ASSERT_EQ(1, again.animation_count);
    for (int k = 0; k < count; ++k)
        for (int which = 0; which < 2; ++which) {
            const struct character *who = which ? &again : &c;
            struct affine skin[8], places[8];
            const int joint = character_joint(who, "nodes[0]");
            ASSERT(joint >= 0);
            character_pose(who, 0, times[k], 1.0, skin, places);
            ASSERT_NEAR(x[k], places[joint].m[3], 1e-5);
            ASSERT_NEAR(angles[k], atan2(places[joint].m[4], places[joint].m[0]), 1e-5);
        }
    character_free(&c);
    character_free(&again);
    PASS();
}

TEST steps_hold_and_cubic_splines_bend(void)
{
    static const double moves[9] = {0, 0, 0, 2, 0, 0, 4, 0, 0};
    static const double turns[12] = {0, 0, 0, 1, 0, 0, 0.70710678118654752, 0.70710678118654752, 0, 0, 0, 1};
    static const double times[] = {0.0, 0.75, 1.0, 2.0, 2.99};
    static const double held[] = {0, 0, 2, 2, 2}, held_turns[] = {0, 0, 1.5707963267949, 1.5707963267949, 1.5707963267949};
    static const double straight[] = {0, 1.5, 2, 3, 3.99},
                        arcs[] = {0, 0.75 * 1.5707963267949, 1.5707963267949, 0.5 * 1.5707963267949, 0.005 * 1.5707963267949};
    CHECK_CALL(check_clip(write_clip("STEP", 1, moves, turns), 5, times, held, held_turns));
    CHECK_CALL(check_clip(write_clip("LINEAR", 1, moves, turns), 5, times, straight, arcs));
    /* Appendix C.5; the tangents of the second segment count for its two seconds. */
    double cubic[27] = {0}, cubic_turns[36] = {0}, x[5], angles[5];
    for (int k = 0; k < 3; ++k) {
        cubic[9 * k + 3] = moves[3 * k];
        cubic[9 * k] = 0.5 * k;
        cubic[9 * k + 6] = 1.0 - k;
        for (int i = 0; i < 4; ++i) cubic_turns[12 * k + 4 + i] = turns[4 * k + i];
        cubic_turns[12 * k + 2] = 0.25, cubic_turns[12 * k + 10] = -0.5;
    }
    for (int s = 0; s < 5; ++s) {
        const int k = times[s] < 1.0 ? 0 : 1;
        const double length = k ? 2.0 : 1.0, t = (times[s] - (k ? 1.0 : 0.0)) / length, t2 = t * t, t3 = t2 * t;
        const double h[4] = {2 * t3 - 3 * t2 + 1, length * (t3 - 2 * t2 + t), 3 * t2 - 2 * t3, length * (t3 - t2)};
        x[s] = h[0] * moves[3 * k] + h[1] * (1.0 - k) + h[2] * moves[3 * k + 3] + h[3] * 0.5 * (k + 1);
        const double z = h[0] * turns[4 * k + 2] - h[1] * 0.5 + h[2] * turns[4 * k + 6] + h[3] * 0.25,
                     w = h[0] * turns[4 * k + 3] + h[2] * turns[4 * k + 7];
        angles[s] = 2.0 * atan2(z, w);
    }
    CHECK_CALL(check_clip(write_clip("CUBICSPLINE", 3, cubic, cubic_turns), 5, times, x, angles));
    PASS();
}

/* ---- compression ---- */

/* A box of 1 x 1 x 2, by Draco's encoder (edgebreaker, positions of 11 bits): corner i is at its bits; attributes: 0 POSITION; 1 COLOR_0,
 * bytes 20 i + 40 k; 2 JOINTS_0: 0, 1, 0, 0; 3 WEIGHTS_0: 255 - 30 i, 30 i, 0, 0. Corners come in another order. */
static const unsigned char draco_box[] = {
    68, 82, 65, 67, 79, 2, 2, 1, 1, 0, 0, 0, 8, 12, 3, 11, 0, 0, 3, 95, 75, 21, 1, 1, 16, 255, 2, 53, 65, 255, 2, 53, 65, 255, 2,
    53, 65, 4, 255, 0, 0, 0, 0, 0, 1, 0, 0, 2, 0, 0, 1, 0, 9, 3, 0, 0, 2, 1, 2, 2, 3, 1, 1, 1, 1, 4, 2, 4, 0, 2, 1, 1, 4, 2, 4, 1,
    3, 1, 1, 1, 1, 0, 12, 3, 1, 24, 1, 8, 31, 1, 32, 4, 0, 138, 83, 130, 252, 255, 255, 1, 240, 127, 0, 0, 224, 255, 253, 23, 0,
    250, 255, 127, 1, 0, 4, 0, 0, 0, 0, 255, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 64, 11, 1, 1, 1, 0, 9, 3, 1, 16,
    15, 1, 8, 1, 16, 1, 24, 4, 0, 114, 173, 168, 160, 201, 121, 120, 60, 254, 60, 79, 81, 209, 99, 136, 138, 42, 227, 249, 124, 2,
    0, 0, 0, 0, 220, 0, 0, 0, 1, 1, 1, 1, 1, 2, 1, 62, 1, 2, 3, 0, 191, 147, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0, 9, 3, 1, 16, 15, 1,
    8, 1, 24, 1, 16, 4, 0, 32, 60, 165, 241, 240, 0, 0, 179, 180, 0, 0, 252, 14, 0, 121, 61, 0, 0, 91, 46, 0, 0, 248, 59, 0, 0, 0,
    0, 0, 0, 255, 0, 0, 0};

static float weight_on(const struct influences *influences, int joint)
{
    float weight = 0.0f;
    for (int k = 0; k < CHARACTER_BONES; ++k) weight += influences->joint[k] == joint ? influences->weight[k] : 0.0f;
    return weight;
}

static const char *write_draco(size_t size)
{
    begin_file();
    memcpy(made.bytes, draco_box, size);
    made.used = size;
    end_view(0, 0);
    append(
        made.accessors, sizeof made.accessors,
        "{\"componentType\":5126,\"count\":8,\"type\":\"VEC3\"},{\"componentType\":5121,\"count\":8,\"type\":\"VEC3\",\"normalized\":true},"
        "{\"componentType\":5121,\"count\":8,\"type\":\"VEC4\"},{\"componentType\":5121,\"count\":8,\"type\":\"VEC4\",\"normalized\":true},"
        "{\"componentType\":5123,\"count\":36,\"type\":\"SCALAR\"}");
    return write_file(
        "draco.glb",
        "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],\"scenes\":[{\"nodes\":[0,1,2]}],\"nodes\":[{\"name\":\"low\"},"
        "{\"name\":\"high\"},{\"mesh\":0,\"skin\":0}],\"skins\":[{\"joints\":[0,1]}],\"meshes\":[{\"primitives\":[{\"attributes\":{"
        "\"POSITION\":0,\"COLOR_0\":1,\"JOINTS_0\":2,\"WEIGHTS_0\":3},\"indices\":4,\"extensions\":{\"KHR_draco_mesh_compression\":{"
        "\"bufferView\":0,\"attributes\":{\"POSITION\":0,\"COLOR_0\":1,\"JOINTS_0\":2,\"WEIGHTS_0\":3}}}}]}]");
}

TEST draco_is_decoded(void)
{
    struct character c;
    static char error[CHARACTER_TEXT];
    ASSERTm(error, character_read(write_draco(sizeof draco_box), NULL, &c, error));
    ASSERT(c.vertex_count == 8 && c.triangle_count == 12 && c.skinned && c.unnormal == 0);
    ASSERT_NEAR(2.0, volume_of(c.positions, c.triangles, NULL, 12), 5e-3);
    for (int v = 0; v < 8; ++v) {
        const int i =
            (int)lroundf(c.positions[3 * v]) + 2 * (int)lroundf(c.positions[3 * v + 1]) + 2 * (int)lroundf(c.positions[3 * v + 2]);
        ASSERT_NEAR(30.0 * i / 255.0, weight_on(&c.influences[v], character_joint(&c, "high")), 1e-5);
        for (int k = 0; k < 3; ++k) ASSERT_NEAR(pow((20.0 * i + 40.0 * k) / 255.0, 1.0 / 2.2), c.colors[3 * v + k], 1e-4);
    }
    character_free(&c);
    for (size_t cut = 1; cut < sizeof draco_box; cut += 7) {
        if (character_read(write_draco(sizeof draco_box - cut), NULL, &c, error)) character_free(&c);
        else ASSERTm(error, strstr(error, "KHR_draco_mesh_compression") && !strchr(error, '\n'));
    }
    PASS();
}

/* Encodes a view; returns the compression's JSON up to its mode. */
static void put_compressed(const unsigned char *encoded, size_t size, int stride, int count, const char *mode)
{
    const size_t start = begin_view();
    memcpy(made.bytes + start, encoded, size);
    made.used += size;
    append(
        made.views, sizeof made.views,
        "%s{\"buffer\":1,\"byteLength\":%d,\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,"
        "\"byteStride\":%d,\"count\":%d,%s}}}",
        made.view_count++ ? "," : "", stride * count, start, size, stride, count, mode);
}

/* A box whose corners are shorts, its faces triangles or a sequence of indices. spoilt: a byte of the code is changed. */
static const char *write_meshopt(bool triangles, bool spoilt)
{
    unsigned short corners[CORNERS][4];
    unsigned int faces[3 * TRIANGLES];
    unsigned char code[1024];
    begin_file();
    for (int i = 0; i < CORNERS; ++i) {
        for (int k = 0; k < 3; ++k) corners[i][k] = (unsigned short)((i >> k & 1) * (k == 2 ? 65534 : 32767));
        corners[i][3] = 0;
    }
    for (int i = 0; i < 3 * TRIANGLES; ++i) faces[i] = (unsigned)raw_number(INDICES, i, UBYTE);
    size_t size = meshopt_encodeVertexBuffer(code, sizeof code, corners, CORNERS, sizeof corners[0]);
    code[0] = (unsigned char)(code[0] ^ (spoilt ? 0x55 : 0));
    put_compressed(code, size, 8, CORNERS, "\"mode\":\"ATTRIBUTES\"");
    size = triangles ? meshopt_encodeIndexBuffer(code, sizeof code, faces, 3 * TRIANGLES)
                     : meshopt_encodeIndexSequence(code, sizeof code, faces, 3 * TRIANGLES);
    put_compressed(code, size, 2, 3 * TRIANGLES, triangles ? "\"mode\":\"TRIANGLES\"" : "\"mode\":\"INDICES\",\"filter\":\"NONE\"");
    append(made.accessors, sizeof made.accessors,
           "{\"bufferView\":0,\"componentType\":5123,\"normalized\":true,\"count\":8,\"type\":\"VEC3\"},"
           "{\"bufferView\":1,\"componentType\":5123,\"count\":36,\"type\":\"SCALAR\"}");
    return write_file("meshopt.glb", "\"extensionsRequired\":[\"KHR_mesh_quantization\",\"EXT_meshopt_compression\"],"
                                     "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"scale\":[2,2,2]}],"
                                     "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}]");
}

TEST meshopt_is_decoded(void)
{
    static char error[MESH_TEXT];
    struct mesh mesh;
    for (int triangles = 0; triangles < 2; ++triangles) {
        ASSERTm(error, mesh_read(write_meshopt(triangles != 0, false), &mesh, error));
        ASSERT_EQ(12u, mesh.triangle_count);
        ASSERT_NEAR(2.0, volume_of(mesh.positions, NULL, mesh.indices, mesh.triangle_count), 1e-3);
        mesh_free(&mesh);
        ASSERT_FALSE(mesh_read(write_meshopt(triangles != 0, true), &mesh, error));
        ASSERTm(error, strstr(error, "EXT_meshopt_compression cannot be decoded"));
    }
    PASS();
}

/* Debian's gltfpack quantizes all that a character has, and compresses it: its vertices move as before, within the quantization. */
TEST files_of_gltfpack_are_read(void)
{
    static const char *const options[] = {"-kn", "-kn -c", "-kn -cc -vp 16", "-kn -noq"};
    struct character whole, packed;
    static char error[CHARACTER_TEXT], command[1400];
    struct affine skin[256], places[256];
    if (system("command -v gltfpack > /dev/null 2>&1") != 0) SKIPm("there is no gltfpack (.ci/deps.sh judges)");
    ASSERT(character_build(1, &whole, error) && gltf_write_character(scratch("whole.glb"), &whole));
    character_free(&whole);
    ASSERTm(error, character_read(scratch("whole.glb"), NULL, &whole, error));
    for (int o = 0; o < 4; ++o) {
        snprintf(command, sizeof command, "gltfpack -i '%s' -o '%s' %s > /dev/null 2>&1", scratch("whole.glb"), scratch("packed.glb"),
                 options[o]);
        ASSERT_EQm(command, 0, system(command));
        ASSERTm(error, character_read(scratch("packed.glb"), NULL, &packed, error));
        ASSERT(packed.skinned && packed.unnormal == 0 && packed.animation_count == 1 && packed.triangle_count > 0);
        float *posed[2] = {malloc(3 * (size_t)whole.vertex_count * sizeof(float)), malloc(3 * (size_t)packed.vertex_count * sizeof(float))};
        for (int k = 0; k < 4; ++k) { /* the box of each pose: gltfpack orders vertices anew */
            double box[2][6];
            for (int w = 0; w < 2; ++w) {
                const struct character *c = w ? &packed : &whole;
                ASSERT(c->joint_count <= 256);
                character_pose(c, k ? 0 : -1, 0.31 * k, 1.0, skin, places);
                character_skin(c, skin, posed[w]);
                for (int i = 0; i < 6; ++i) box[w][i] = i < 3 ? 1e30 : -1e30;
                for (int i = 0; i < 3 * c->vertex_count; ++i) {
                    box[w][i % 3] = fmin(box[w][i % 3], (double)posed[w][i]);
                    box[w][3 + i % 3] = fmax(box[w][3 + i % 3], (double)posed[w][i]);
                }
            }
            for (int i = 0; i < 6; ++i) ASSERT_NEARm(options[o], box[0][i], box[1][i], 0.02 * (box[0][4] - box[0][1]));
        }
        free(posed[0]);
        free(posed[1]);
        character_free(&packed);
    }
    character_free(&whole);
    PASS();
}

/* ---- containers ---- */

TEST buffers_may_be_text(void)
{
    static const char text[] =
        "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0,\"name\":\"a\\nb\"}],\"meshes\":[{\"primitives\":[{\"attributes\":{"
        "\"POSITION\":0}}]}],\"accessors\":[{\"bufferView\":0,\"componentType\":5120,\"count\":3,\"type\":\"VEC3\"}],\"bufferViews\":["
        "{\"buffer\":0,\"byteLength\":12,\"byteStride\":4}],\"buffers\":[{\"byteLength\":12,\"uri\":\"data:application/octet-stream;base64,"
        "AAAAAAoAAAAA9gAA\"}]}";
    static const float wanted[] = {0, 0, 0, 10, 0, 0, 0, -10, 0};
    struct character c;
    static char error[CHARACTER_TEXT];
    FILE *file = fopen(scratch("text.gltf"), "wb");
    fputs(text, file);
    fclose(file);
    ASSERTm(error, character_read(scratch("text.gltf"), NULL, &c, error));
    ASSERT_MEM_EQ(wanted, c.positions, sizeof wanted);
    character_free(&c);
    PASS();
}

/* One line, that names what is wrong. */
TEST what_cannot_be_read_is_named(void)
{
#define ASSET "{\"asset\":{\"version\":\"2.0\"}"
#define TRIANGLE "\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}]"
#define BYTES "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]"
#define VIEW "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}]"
#define ACCESSOR(rest) "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"" rest "}]"
#define WHOLE TRIANGLE "," BYTES "," VIEW "," ACCESSOR("")
    static const struct {
        const char *text, *reason;
    } files[] = {
        {ASSET "," WHOLE "}", NULL},
        {ASSET ",\"extensionsRequired\":[\"KHR_texture_transform\",\"KHR_materials_unlit\"]," WHOLE "}", NULL},
        {ASSET ",\"extensionsRequired\":[\"EXT_mesh_gpu_instancing\"]," WHOLE "}", "requires the extension EXT_mesh_gpu_instancing"},
        {"{\"asset\":{\"version\":\"3.0\"}," WHOLE "}", "version 3.0 of glTF"},
        {"{\"asset\":{\"version\":\"2.1\",\"minVersion\":\"2.1\"}," WHOLE "}", "version 2.1 of glTF"},
        {"{\"asset\":{\"version\":\"2.1\"}," WHOLE "}", NULL},
        {"{" WHOLE "}", "its asset has no version"},
        {ASSET "," WHOLE, "its JSON is broken"},
        {ASSET ",\"meshes\":3}", "meshes is no list"},
        {ASSET ",\"nodes\":[7]}", "node 0: it is no object"},
        {ASSET "}", "no nodes"},
        {ASSET ",\"nodes\":[{\"mesh\":1}]}", "mesh names a mesh that there is not"},
        {ASSET ",\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"children\":[0]}]}", "node 0: it is within itself"},
        {ASSET ",\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"children\":[1]},{}]}", "node 1: it is within itself, or has two parents"},
        {ASSET ",\"nodes\":[{\"scale\":[1,\"a\",1]}]}", "node 0: its matrix, translation, rotation or scale"},
        {ASSET "," TRIANGLE "," BYTES "," VIEW ",\"accessors\":[{\"bufferView\":0,\"componentType\":5124,\"count\":3,\"type\":\"VEC3\"}]}",
         "accessor 0: componentType 5124"},
        {ASSET "," TRIANGLE "," BYTES "," VIEW ",\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC2\"}]}",
         "accessor 0: type VEC2 is not what it is used for"},
        {ASSET "," TRIANGLE "," BYTES "," VIEW ",\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}]}",
         "accessor 0: its 4 elements do not lie within buffer view 0 of 36 bytes"},
        {ASSET "," TRIANGLE ",\"accessors\":[{\"componentType\":5126,\"count\":99999999,\"type\":\"VEC3\"}]}", "without bytes for them"},
        {ASSET "," TRIANGLE "," BYTES "," VIEW "," ACCESSOR(",\"sparse\":{\"count\":1}") "}", "accessor 0: its sparse part"},
        {ASSET "," TRIANGLE "," BYTES "," VIEW "," ACCESSOR(",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":0,\"byteOffset\":15,"
                                                            "\"componentType\":5121},\"values\":{\"bufferView\":0}}") "}",
         "names element 63 of 3"},
        {ASSET "," TRIANGLE "," BYTES "," VIEW "," ACCESSOR(",\"sparse\":{\"count\":2,\"indices\":{\"bufferView\":0,"
                                                            "\"componentType\":5121},\"values\":{\"bufferView\":0}}") "}",
         "accessor 0: its sparse part names element 0 after 0"},
        {ASSET ",\"nodes\":[{\"mesh\":0,\"skin\":0}],\"skins\":[{\"joints\":[0],\"skeleton\":99}],"
               "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"JOINTS_0\":1,\"WEIGHTS_0\":2}}]}]," BYTES "," VIEW ","
               ACCESSOR("},{\"componentType\":5121,\"count\":3,\"type\":\"VEC4\"},"
                        "{\"componentType\":5126,\"count\":3,\"type\":\"VEC4\"") "}",
         "skeleton names a node that there is not"},
        {ASSET ",\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},"
               "\"targets\":[{\"POSITION\":9}]}]}]," BYTES "," VIEW "," ACCESSOR("") "}",
         "POSITION names an accessor that there is not"},
        {ASSET "," TRIANGLE "," BYTES ",\"bufferViews\":[{\"buffer\":0,\"byteOffset\":8,\"byteLength\":36}]," ACCESSOR("") "}",
         "buffer view 0: it is not within buffer 0"},
        {ASSET "," TRIANGLE ",\"buffers\":[{\"byteLength\":36}]," VIEW "," ACCESSOR("") "}", "buffer 0: it has no bytes"},
        {ASSET "," TRIANGLE ",\"buffers\":[{\"byteLength\":36,\"uri\":\"none.bin\"}]," VIEW "," ACCESSOR("") "}",
         "none.bin cannot be read"},
        {ASSET ",\"animations\":[{\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"scale\"}}],\"samplers\":[{\"input\":0,"
               "\"output\":0,\"interpolation\":\"CURVED\"}]}]," WHOLE "}",
         "interpolation CURVED"},
    };
    static const char deep_end[] = "}";
    static char error[CHARACTER_TEXT];
    struct character c;
    for (size_t i = 0; i <= sizeof files / sizeof *files; ++i) {
        FILE *file = fopen(scratch("bad.gltf"), "wb");
        const bool deep = i == sizeof files / sizeof *files; /* lists within lists use up no stack */
        fputs(deep ? ASSET ",\"extras\":" : files[i].text, file);
        for (int k = 0; deep && k < 100000; ++k) fputc('[', file);
        for (int k = 0; deep && k < 100000; ++k) fputc(']', file);
        if (deep) fputs(deep_end, file);
        fclose(file);
        const char *reason = deep ? "its JSON is broken" : files[i].reason;
        const bool good = character_read(scratch("bad.gltf"), NULL, &c, error);
        ASSERTm(good ? files[i].text : error, good == !reason);
        if (good) character_free(&c);
        else ASSERTm(error, strstr(error, reason) && !strchr(error, '\n'));
    }
    PASS();
}

/* ---- the collection ---- */

TEST reports_are_as_they_should_be(void)
{
    static const struct {
        const char *name;
        double volume;
    } meshes[] = {{"gltf-quantized/ball_short.glb", 14.11},     {"gltf-quantized/ball_gltfpack.glb", 14.11},
                  {"gltf-draco-meshopt/ball_draco.glb", 14.11}, {"gltf-draco-meshopt/ball_meshopt.glb", 14.11},
                  {"gltf-mirrored/two_wheels.glb", 3.987},      {"gltf-sparse-morph/morph_default_weight.glb", 14.02}};
    static const char *const pairs[][2] = {{"gltf-weights-ubyte/tube_ubyte.glb", "gltf-weights-ubyte/tube_float.glb"},
                                           {"gltf-anim-int16/tube_int16.glb", "gltf-anim-int16/tube_float.glb"},
                                           {"gltf-uv-ushort/body_ushort.glb", "gltf-uv-ushort/body_float.glb"}};
    const char *data = getenv("SPRINGLS_DATA");
    static char path[1024], error[CHARACTER_TEXT];
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    snprintf(path, sizeof path, "%s/reports", data);
    if (access(path, R_OK) != 0) SKIPm("reports is not in the collection");
    for (int i = 0; i < 6; ++i) {
        struct mesh mesh;
        snprintf(path, sizeof path, "%s/reports/%s", data, meshes[i].name);
        ASSERTm(error, mesh_read(path, &mesh, error));
        ASSERT_NEARm(path, meshes[i].volume, volume_of(mesh.positions, NULL, mesh.indices, mesh.triangle_count), 0.01);
        mesh_free(&mesh);
    }
    for (int i = 0; i < 3; ++i) {
        struct character c[2];
        for (int w = 0; w < 2; ++w) {
            snprintf(path, sizeof path, "%s/reports/%s", data, pairs[i][w]);
            ASSERTm(error, character_read(path, NULL, &c[w], error));
        }
        ASSERT_EQ(c[1].unnormal, c[0].unnormal);
        ASSERT_EQ(c[1].vertex_count, c[0].vertex_count);
        for (int v = 0; v < 2 * c[0].vertex_count; ++v) ASSERT_NEARm(path, c[1].uvs[v], c[0].uvs[v], 1e-4);
        for (int v = 0; v < c[0].vertex_count; ++v)
            ASSERT_NEARm(path, weight_on(&c[1].influences[v], 2), weight_on(&c[0].influences[v], 2), 3e-3);
        for (int k = 0; k < 5 && c[0].animation_count; ++k) {
            struct affine skins[2][16], places[16];
            for (int w = 0; w < 2; ++w) character_pose(&c[w], 0, 0.2 * k * c[0].animations[0].duration, 1.0, skins[w], places);
            for (int j = 0; j < c[0].joint_count; ++j)
                for (int m = 0; m < 12; ++m) ASSERT_NEARm(path, skins[1][j].m[m], skins[0][j].m[m], 1e-3);
        }
        character_free(&c[0]);
        character_free(&c[1]);
    }
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(every_accessor_is_what_it_stands_for);
    RUN_TEST(strips_and_fans_are_triangles);
    RUN_TEST(mirrored_nodes_are_turned);
    RUN_TEST(skins_are_bound_in_their_own_spaces);
    RUN_TEST(morph_targets_have_their_default_weights);
    RUN_TEST(steps_hold_and_cubic_splines_bend);
    RUN_TEST(draco_is_decoded);
    RUN_TEST(meshopt_is_decoded);
    RUN_TEST(files_of_gltfpack_are_read);
    RUN_TEST(buffers_may_be_text);
    RUN_TEST(what_cannot_be_read_is_named);
    RUN_TEST(reports_are_as_they_should_be);
    if (!remove_folder()) return 1;
    GREATEST_MAIN_END();
}

#endif
