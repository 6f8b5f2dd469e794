/* test_marching_cubes.c - derives the case table from its rules, then checks what the rules promise on whole grids.
   With the argument --print-table it prints the table for kernels_embed/marching_cubes.h. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "greatest.h"
#include "../../kernels_embed/model/marching_cubes.h"

/* ---- the derivation: nothing below uses the table ---- */

enum { MAX_TRIANGLES = 6 };

typedef struct { int count; int edge[3 * MAX_TRIANGLES]; } case_mesh;
typedef struct { int count; int edge[12]; } edge_loop;

static int is_inside(int mask, int corner) { return (mask >> corner) & 1; }

static int edge_between(int a, int b)
{
    int low = a < b ? a : b;
    int axis = (a ^ b) >> 1;
    int x = low & 1, y = (low >> 1) & 1, z = (low >> 2) & 1;
    int k = axis == 0 ? y + 2 * z : axis == 1 ? x + 2 * z : x + 2 * y;
    return 4 * axis + k;
}

static int edge_lower(int edge)
{
    int corner;
    for (corner = 0; corner < 8; ++corner) {
        int other = corner | 1 << (edge >> 2);
        if (other != corner && edge_between(corner, other) == edge) return corner;
    }
    return -1;
}

static int edge_upper(int edge) { return edge_lower(edge) | 1 << (edge >> 2); }

/* Corner i of a cube face, counter-clockwise seen from outside the cube; face = 2 axis + side. */
static int face_corner(int face, int i)
{
    static const int ring[4] = { 0, 1, 3, 2 };
    int axis = face >> 1, side = face & 1;
    int step = ring[(side ? i : 4 - i) & 3];
    return side << axis | (step & 1) << (axis + 1) % 3 | (step >> 1) << (axis + 2) % 3;
}

/* The cube faces that an edge belongs to, as bits. */
static int faces_of(int edge)
{
    int a = edge_lower(edge), axis, bits = 0;
    for (axis = 0; axis < 3; ++axis)
        if (axis != edge >> 2) bits |= 1 << (2 * axis + ((a >> axis) & 1));
    return bits;
}

/* The face rule: every run of inside corners around a face is cut off by one segment, so two diagonal inside corners stay
   apart. Writes segments (from, to) with the inside on their left seen from outside the cube; returns how many. */
static int face_segments(int mask, int face, int from[2], int to[2])
{
    int count = 0, i;
    for (i = 0; i < 4; ++i) {
        int last = i, before = face_corner(face, (i + 3) & 3);
        if (!is_inside(mask, face_corner(face, i)) || is_inside(mask, before)) continue;
        while (is_inside(mask, face_corner(face, (last + 1) & 3))) ++last;
        from[count] = edge_between(before, face_corner(face, i));
        to[count] = edge_between(face_corner(face, last & 3), face_corner(face, (last + 1) & 3));
        ++count;
    }
    return count;
}

/* Follows the segments around the cube. Every crossed edge starts one segment and ends one. */
static int trace_loops(int mask, edge_loop loops[4])
{
    int next[12], face, i, count = 0;
    for (i = 0; i < 12; ++i) next[i] = -1;
    for (face = 0; face < 6; ++face) {
        int from[2], to[2], n = face_segments(mask, face, from, to);
        for (i = 0; i < n; ++i) next[from[i]] = to[i];
    }
    for (i = 0; i < 12; ++i) {
        edge_loop *loop = &loops[count];
        int edge = i;
        if (next[i] < 0) continue;
        for (loop->count = 0; next[edge] >= 0;) {
            int to = next[edge];
            loop->edge[loop->count++] = edge;
            next[edge] = -1;
            edge = to;
        }
        ++count;
    }
    return count;
}

static springls__v3 edge_point(int edge, float t)
{
    int a = edge_lower(edge);
    return springls__v3_make((float)(a & 1) + (edge >> 2 == 0 ? t : 0.0f), (float)((a >> 1) & 1) + (edge >> 2 == 1 ? t : 0.0f),
                             (float)(a >> 2) + (edge >> 2 == 2 ? t : 0.0f));
}

/* Largest cosine of the three angles: small is well shaped. */
static float worst_cosine(int e0, int e1, int e2)
{
    springls__v3 p[3];
    float worst = -1.0f;
    int i;
    p[0] = edge_point(e0, 0.5f); p[1] = edge_point(e1, 0.5f); p[2] = edge_point(e2, 0.5f);
    for (i = 0; i < 3; ++i) {
        springls__v3 u = springls__normalize(springls__sub(p[(i + 1) % 3], p[i]));
        springls__v3 v = springls__normalize(springls__sub(p[(i + 2) % 3], p[i]));
        worst = springls__max(worst, springls__dot(u, v));
    }
    return worst;
}

/* The best triangulation of a loop on edge mid-points, among those without a diagonal in a cube face (the neighbour could
   have the same one): dynamic programming over the chords i-j; ties go to the lower middle vertex. */
static int split_loop(const edge_loop *loop, case_mesh *mesh)
{
    float cost[12][12];
    int middle[12][12], stack[24], depth = 0, n = loop->count, span, i;
    memset(middle, 0, sizeof middle);
    for (span = 1; span < n; ++span)
        for (i = 0; i + span < n; ++i) {
            int j = i + span, k;
            int chord = span > 1 && span < n - 1;
            cost[i][j] = span > 1 ? 9.0f : -1.0f;
            if (chord && (faces_of(loop->edge[i]) & faces_of(loop->edge[j]))) continue;
            for (k = i + 1; k < j; ++k) {
                float c = springls__max(springls__max(cost[i][k], cost[k][j]),
                                        worst_cosine(loop->edge[i], loop->edge[k], loop->edge[j]));
                if (c < cost[i][j] - 1e-5f) { cost[i][j] = c; middle[i][j] = k; }
            }
        }
    if (cost[0][n - 1] > 1.0f) return 0;
    stack[depth++] = 0; stack[depth++] = n - 1;
    while (depth) {
        int j = stack[--depth], k;
        i = stack[--depth];
        if (j - i < 2) continue;
        k = middle[i][j];
        mesh->edge[3 * mesh->count] = loop->edge[i];
        mesh->edge[3 * mesh->count + 1] = loop->edge[k];
        mesh->edge[3 * mesh->count + 2] = loop->edge[j];
        ++mesh->count;
        stack[depth++] = k; stack[depth++] = j;
        stack[depth++] = i; stack[depth++] = k;
    }
    return 1;
}

static int inside_components(int mask, int label[8])
{
    int count = 0, c, pass, axis;
    for (c = 0; c < 8; ++c) label[c] = is_inside(mask, c) ? c : -1;
    for (pass = 0; pass < 8; ++pass)
        for (c = 0; c < 8; ++c)
            for (axis = 0; axis < 3; ++axis) {
                int d = c ^ 1 << axis;
                if (label[c] >= 0 && label[d] > label[c]) label[d] = label[c];
            }
    for (c = 0; c < 8; ++c) count += label[c] == c;
    return count;
}

/* The loop point on an edge of some axis; a triangle around one corner has one of each. */
static int loop_edge_of_axis(const edge_loop *loop, int axis)
{
    int i;
    for (i = 0; i < loop->count; ++i)
        if (loop->edge[i] >> 2 == axis) return loop->edge[i];
    return -1;
}

/* All outside corners of a cube are 26-connected, so every 6-connected inside part gets one sheet: a disc when the part has
   one loop, a tube when it has two (only the ring around two opposite outside corners has). */
static int derive_case(int mask, case_mesh *mesh)
{
    edge_loop loops[4];
    int label[8], loop_label[4], count = trace_loops(mask, loops), i, j, k;
    mesh->count = 0;
    inside_components(mask, label);
    for (i = 0; i < count; ++i) {
        int a = edge_lower(loops[i].edge[0]), b = edge_upper(loops[i].edge[0]);
        loop_label[i] = is_inside(mask, a) ? label[a] : label[b];
    }
    for (i = 0; i < count; ++i) {
        int partners = 0, partner = i;
        for (j = 0; j < count; ++j)
            if (j != i && loop_label[j] == loop_label[i]) { partner = j; ++partners; }
        if (partners == 0) {
            if (!split_loop(&loops[i], mesh)) return 0;
        } else {
            if (partners != 1 || loops[i].count != 3 || loops[partner].count != 3) return 0;
            for (k = 0; k < 3; ++k) {
                int e0 = loops[i].edge[k], e1 = loops[i].edge[(k + 1) % 3];
                mesh->edge[3 * mesh->count] = e0;
                mesh->edge[3 * mesh->count + 1] = e1;
                mesh->edge[3 * mesh->count + 2] = loop_edge_of_axis(&loops[partner], 3 - (e0 >> 2) - (e1 >> 2));
                ++mesh->count;
            }
        }
    }
    return 1;
}

static void print_table(void)
{
    case_mesh mesh;
    int mask, i, column = 0;
    printf("SPRINGLS__CONST unsigned char springls__mc_triangle_count[256] = {");
    for (mask = 0; mask < 256; ++mask) {
        derive_case(mask, &mesh);
        printf("%s%d%s", mask % 32 ? " " : "\n    ", mesh.count, mask < 255 ? "," : "\n");
    }
    printf("};\n\nSPRINGLS__CONST unsigned char springls__mc_triangles[256][18] = {\n");
    for (mask = 0; mask < 256; ++mask) {
        char row[96];
        int n = 0;
        derive_case(mask, &mesh);
        n += sprintf(row + n, "{%s", mesh.count ? "" : "0");
        for (i = 0; i < 3 * mesh.count; ++i)
            n += sprintf(row + n, "%s%d", i == 0 ? "" : i % 3 ? "," : ", ", mesh.edge[i]);
        n += sprintf(row + n, "}%s", mask < 255 ? "," : "");
        if (column && column + n + 1 > 126) { printf("\n"); column = 0; }
        column += column ? printf(" %s", row) : printf("    %s", row);
    }
    printf("\n};\n");
}

/* ---- the table against the derivation ---- */

static case_mesh table_case(int mask)
{
    case_mesh mesh;
    int i;
    mesh.count = springls__mc_count(mask);
    for (i = 0; i < 3 * mesh.count; ++i) mesh.edge[i] = springls__mc_edge(mask, i / 3, i % 3);
    return mesh;
}

/* used[a][b] = how many triangles run along a -> b. */
static void count_sides(const case_mesh *mesh, int used[12][12])
{
    int i, v;
    memset(used, 0, sizeof(int[12][12]));
    for (i = 0; i < mesh->count; ++i)
        for (v = 0; v < 3; ++v) ++used[mesh->edge[3 * i + v]][mesh->edge[3 * i + (v + 1) % 3]];
}

TEST edge_numbers_follow_the_stated_rule(void)
{
    int e, a, axis, seen = 0;
    for (e = 0; e < 12; ++e) {
        ASSERT_EQ(edge_lower(e), springls__mc_edge_corner(e));
        ASSERT_EQ(e >> 2, springls__mc_edge_axis(e));
        seen |= 1 << (edge_lower(e) * 3 + (e >> 2));
    }
    for (a = 0; a < 8; ++a)
        for (axis = 0; axis < 3; ++axis) ASSERT_EQ(!((a >> axis) & 1), (seen >> (a * 3 + axis)) & 1);
    PASS();
}

TEST table_is_what_the_rules_give(void)
{
    int mask, i;
    for (mask = 0; mask < 256; ++mask) {
        case_mesh derived;
        ASSERT(derive_case(mask, &derived));
        ASSERT_EQ(derived.count, springls__mc_count(mask));
        for (i = 0; i < 3 * derived.count; ++i) ASSERT_EQ(derived.edge[i], springls__mc_edge(mask, i / 3, i % 3));
    }
    PASS();
}

TEST every_case_is_an_oriented_surface_ending_on_faces(void)
{
    int mask, a, b, face, i, used[12][12], segment[12][12];
    for (mask = 0; mask < 256; ++mask) {
        case_mesh mesh = table_case(mask);
        count_sides(&mesh, used);
        memset(segment, 0, sizeof segment);
        for (face = 0; face < 6; ++face) {
            int from[2], to[2], n = face_segments(mask, face, from, to);
            for (i = 0; i < n; ++i) ++segment[from[i]][to[i]];
        }
        for (a = 0; a < 12; ++a)
            for (b = 0; b < 12; ++b) {
                ASSERT(used[a][b] <= 1);
                if (segment[a][b]) {
                    ASSERT(used[a][b] == 1 && used[b][a] == 0);
                } else if (!segment[b][a]) {
                    ASSERT_EQ(used[a][b], used[b][a]);
                    ASSERTm("a diagonal lies in a cube face", !used[a][b] || !(faces_of(a) & faces_of(b)));
                }
            }
    }
    PASS();
}

/* Sides of triangles in one cube face, edges named as on the lower face of that axis. */
static void sides_on_face(int mask, int axis, int side, int found[12][12])
{
    case_mesh mesh = table_case(mask);
    int used[12][12], a, b, bit = 1 << (2 * axis + side), flip = side << axis;
    count_sides(&mesh, used);
    memset(found, 0, sizeof(int[12][12]));
    for (a = 0; a < 12; ++a)
        for (b = 0; b < 12; ++b)
            if (used[a][b] && (faces_of(a) & faces_of(b) & bit))
                ++found[edge_between(edge_lower(a) ^ flip, edge_upper(a) ^ flip)]
                       [edge_between(edge_lower(b) ^ flip, edge_upper(b) ^ flip)];
}

TEST neighbouring_cubes_meet_without_cracks(void)
{
    int axis, low, high, c, a, b, lower[12][12], upper[12][12], pairs = 0;
    for (axis = 0; axis < 3; ++axis)
        for (low = 0; low < 256; ++low)
            for (high = 0; high < 256; ++high) {
                int same = 1;
                for (c = 0; c < 8; ++c)
                    if (!((c >> axis) & 1)) same = same && is_inside(low, c | 1 << axis) == is_inside(high, c);
                if (!same) continue;
                ++pairs;
                sides_on_face(low, axis, 1, upper);
                sides_on_face(high, axis, 0, lower);
                for (a = 0; a < 12; ++a)
                    for (b = 0; b < 12; ++b) ASSERT_EQ(upper[a][b], lower[b][a]);
            }
    ASSERT_EQ(3 * 16 * 16 * 16, pairs);
    PASS();
}

TEST every_inside_part_has_one_sheet(void)
{
    int mask, i, v, e;
    for (mask = 0; mask < 256; ++mask) {
        case_mesh mesh = table_case(mask);
        int used[12][12], label[8], parts = inside_components(mask, label), tube, vertices = 0, sides = 0, seen = 0, a, b;
        int outside = 255 & ~mask, group[12], groups = 0, pass;
        for (e = 0; e < 12; ++e) group[e] = e;
        for (pass = 0; pass < 12; ++pass)
            for (i = 0; i < mesh.count; ++i)
                for (v = 0; v < 3; ++v) {
                    int p = mesh.edge[3 * i + v], q = mesh.edge[3 * i + (v + 1) % 3];
                    int g = group[p] < group[q] ? group[p] : group[q];
                    group[p] = group[q] = g;
                }
        count_sides(&mesh, used);
        for (i = 0; i < 3 * mesh.count; ++i) seen |= 1 << mesh.edge[i];
        for (e = 0; e < 12; ++e) {
            int crossed = is_inside(mask, edge_lower(e)) != is_inside(mask, edge_upper(e));
            ASSERT_EQ(crossed, (seen >> e) & 1);
            vertices += crossed;
            groups += crossed && group[e] == e;
        }
        for (a = 0; a < 12; ++a)
            for (b = 0; b < a; ++b) sides += used[a][b] || used[b][a];
        tube = outside == 129 || outside == 66 || outside == 36 || outside == 24; /* two opposite corners */
        ASSERT_EQ(mask == 255 ? 0 : parts, groups);
        ASSERT_EQ(mask == 255 ? 0 : tube ? 0 : parts, vertices - sides + mesh.count);
    }
    PASS();
}

/* ---- geometry ---- */

static uint32_t random_state = 1u;
static uint32_t random_bits(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}
static float random_unit(void) { return (float)(random_bits() >> 8) * (1.0f / 16777216.0f); }

TEST normals_point_to_growing_phi(void)
{
    int mask, i, v;
    for (mask = 0; mask < 256; ++mask) {
        case_mesh mesh = table_case(mask);
        for (i = 0; i < mesh.count; ++i) {
            springls__v3 p[3], up = springls__v3_make(0.0f, 0.0f, 0.0f), normal;
            for (v = 0; v < 3; ++v) {
                int e = mesh.edge[3 * i + v];
                p[v] = edge_point(e, 0.5f);
                up = springls__mad(up, springls__sub(edge_point(e, 1.0f), edge_point(e, 0.0f)),
                                   is_inside(mask, edge_lower(e)) ? 1.0f : -1.0f);
            }
            normal = springls__normalize(springls__cross(springls__sub(p[1], p[0]), springls__sub(p[2], p[0])));
            ASSERT(springls__dot(normal, up) > 0.5f);
        }
    }
    PASS();
}

/* Does segment a-b pass through the inside of triangle t? */
static int segment_pierces(springls__v3 a, springls__v3 b, const springls__v3 t[3])
{
    springls__v3 n = springls__cross(springls__sub(t[1], t[0]), springls__sub(t[2], t[0])), x;
    float da = springls__dot(springls__sub(a, t[0]), n), db = springls__dot(springls__sub(b, t[0]), n);
    int i;
    if (da * db >= 0.0f) return 0;
    x = springls__lerp(a, b, da / (da - db));
    for (i = 0; i < 3; ++i) {
        springls__v3 side = springls__sub(t[(i + 1) % 3], t[i]);
        if (springls__dot(springls__cross(side, springls__sub(x, t[i])), n) <= 1e-6f) return 0;
    }
    return 1;
}

TEST no_case_cuts_itself(void)
{
    int mask, round, i, j, v;
    random_state = 7u;
    for (mask = 0; mask < 256; ++mask) {
        case_mesh mesh = table_case(mask);
        for (round = 0; round < 60; ++round) {
            springls__v3 point[12];
            for (i = 0; i < 12; ++i) {
                float t = random_unit();
                uint32_t kind = random_bits() % 3u;
                point[i] = edge_point(i, kind == 0 ? t : kind == 1 ? 0.01f + 0.02f * t : 0.97f + 0.02f * t);
            }
            for (i = 0; i < mesh.count; ++i)
                for (j = 0; j < mesh.count; ++j) {
                    springls__v3 t[3];
                    for (v = 0; v < 3; ++v) t[v] = point[mesh.edge[3 * j + v]];
                    for (v = 0; v < 3; ++v) {
                        int a = mesh.edge[3 * i + v], b = mesh.edge[3 * i + (v + 1) % 3], k, touches = 0;
                        for (k = 0; k < 3; ++k) touches = touches || mesh.edge[3 * j + k] == a || mesh.edge[3 * j + k] == b;
                        ASSERT(touches || !segment_pierces(point[a], point[b], t));
                    }
                }
        }
    }
    PASS();
}

TEST crossings_stay_between_the_corners(void)
{
    const float lo = 1.0f / 1024.0f, hi = 1.0f - 1.0f / 1024.0f, big = 3.0e38f;
    float zero = 0.0f;
    springls__mc_cell cell;
    int c;
    ASSERT(springls__mc_crossing(-1.0f, 1.0f) == 0.5f);
    ASSERT(springls__mc_crossing(1.0f, -3.0f) == 0.25f);
    ASSERT(springls__mc_crossing(-0.5f, 0.0f) == hi);
    ASSERT(springls__mc_crossing(0.0f, -0.5f) == lo);
    ASSERT(springls__mc_crossing(-1e-40f, 0.0f) >= lo);
    ASSERT(springls__mc_crossing(-big, big * 10.0f) == lo);
    ASSERT(springls__mc_crossing(zero / zero, -1.0f) == lo);
    ASSERT(!springls__mc_inside(0.0f) && !springls__mc_inside(-0.0f) && springls__mc_inside(-1e-30f));
    for (c = 0; c < 8; ++c) cell.phi[c] = c == 0 || c == 6 ? -0.25f : 0.75f;
    ASSERT_EQ(65, springls__mc_case(cell));
    ASSERT(springls__mc_edge_crossing(cell, 0) == 0.25f);
    ASSERT(springls__mc_edge_crossing(cell, 10) == 0.75f);
    PASS();
}

/* ---- whole grids: the welded mesh has the topology of the digital object ---- */

enum { N = 12, CELLS = N * N * N, MAX_FACES = 5 * CELLS, MAX_SIDES = 3 * MAX_FACES };

static float field[CELLS];
static springls__v3 mesh_point[3 * CELLS];
static int mesh_voxel[3 * CELLS], mesh_index[3 * CELLS], mesh_face[MAX_FACES][3], vertex_count, face_count;
static int label_in[CELLS], label_out[CELLS], queue[CELLS];

static int voxel_at(int x, int y, int z) { return x + N * (y + N * z); }

static int voxel_inside(int x, int y, int z)
{
    return x >= 0 && y >= 0 && z >= 0 && x < N && y < N && z < N && field[voxel_at(x, y, z)] < 0.0f;
}

static void make_field(int kind)
{
    int x, y, z, i, pass;
    float threshold = 0.1f + 0.8f * random_unit();
    for (i = 0; i < CELLS; ++i) {
        float r = random_unit();
        field[i] = kind == 0 ? r - threshold : kind == 1 ? (r < threshold ? -1.0f : 1.0f)
                 : kind == 2 ? (float)(int)(r * 3.0f) - 1.0f : (r - threshold) * 40.0f;
    }
    for (pass = 0; kind == 3 && pass < 2; ++pass)
        for (i = 0; i + N * N + N + 1 < CELLS; ++i) field[i] = 0.25f * (field[i] + field[i + 1] + field[i + N] + field[i + N * N]);
    for (z = 0; z < N; ++z)
        for (y = 0; y < N; ++y)
            for (x = 0; x < N; ++x) {
                float *f = &field[voxel_at(x, y, z)];
                *f = springls__clamp(*f, -3.0f, 3.0f);
                if (x == 0 || y == 0 || z == 0 || x == N - 1 || y == N - 1 || z == N - 1) *f = *f < 0.0f ? -*f : *f;
            }
}

static int extract_mesh(void)
{
    int x, y, z, c, i, v;
    vertex_count = face_count = 0;
    for (i = 0; i < 3 * CELLS; ++i) mesh_index[i] = -1;
    for (z = 0; z + 1 < N; ++z)
        for (y = 0; y + 1 < N; ++y)
            for (x = 0; x + 1 < N; ++x) {
                springls__mc_cell cell;
                int mask;
                for (c = 0; c < 8; ++c) cell.phi[c] = field[voxel_at(x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2))];
                mask = springls__mc_case(cell);
                for (i = 0; i < springls__mc_count(mask); ++i, ++face_count)
                    for (v = 0; v < 3; ++v) {
                        int e = springls__mc_edge(mask, i, v), a = springls__mc_edge_corner(e), axis = springls__mc_edge_axis(e);
                        int low = voxel_at(x + (a & 1), y + ((a >> 1) & 1), z + (a >> 2)), key = 3 * low + axis;
                        int step = axis == 0 ? 1 : axis == 1 ? N : N * N;
                        springls__v3 p = springls__mc_point(x, y, z, e, springls__mc_edge_crossing(cell, e));
                        if (mesh_index[key] < 0) {
                            mesh_index[key] = vertex_count;
                            mesh_point[vertex_count] = p;
                            mesh_voxel[vertex_count++] = field[low] < 0.0f ? low : low + step;
                        } else if (memcmp(&p, &mesh_point[mesh_index[key]], sizeof p) != 0) {
                            return 0;
                        }
                        mesh_face[face_count][v] = mesh_index[key];
                    }
            }
    return 1;
}

/* Labels the voxels that are inside (or outside), connected by steps of at most reach moved axes; returns how many parts. */
static int flood(int *label, int inside, int reach)
{
    int i, count = 0, head, tail, dx, dy, dz;
    for (i = 0; i < CELLS; ++i) label[i] = -1;
    for (i = 0; i < CELLS; ++i) {
        if ((field[i] < 0.0f) != inside || label[i] >= 0) continue;
        label[i] = count;
        queue[0] = i;
        for (head = 0, tail = 1; head < tail; ++head)
            for (dz = -1; dz <= 1; ++dz)
                for (dy = -1; dy <= 1; ++dy)
                    for (dx = -1; dx <= 1; ++dx) {
                        int q = queue[head], x = q % N + dx, y = q / N % N + dy, z = q / N / N + dz, n;
                        if (dx * dx + dy * dy + dz * dz > reach || x < 0 || y < 0 || z < 0 || x >= N || y >= N || z >= N) continue;
                        n = voxel_at(x, y, z);
                        if ((field[n] < 0.0f) != inside || label[n] >= 0) continue;
                        label[n] = count;
                        queue[tail++] = n;
                    }
        ++count;
    }
    return count;
}

/* Euler number of every 6-connected part: voxels, pairs, squares of four and blocks of eight, all inside. */
static void digital_euler(int *euler)
{
    int x, y, z, extent, c;
    for (z = 0; z < N; ++z)
        for (y = 0; y < N; ++y)
            for (x = 0; x < N; ++x)
                for (extent = 0; extent < 8; ++extent) {
                    int all = 1, dimension = (extent & 1) + ((extent >> 1) & 1) + (extent >> 2);
                    for (c = 0; c < 8; ++c)
                        if ((c & extent) == c) all = all && voxel_inside(x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2));
                    if (all) euler[label_in[voxel_at(x, y, z)]] += dimension & 1 ? -1 : 1;
                }
}

static int64_t side_key[MAX_SIDES];
static int side_owner[MAX_SIDES];
static int compare_keys(const void *a, const void *b)
{
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return x < y ? -1 : x > y;
}

static int find_part(int *parent, int i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

TEST check_field(void)
{
    static int euler_object[CELLS], euler_mesh[CELLS], parent[3 * CELLS], fan[3 * CELLS], next_corner[MAX_SIDES];
    static int64_t packed[MAX_SIDES];
    int i, v, sides = 0, inside_parts, outside_parts, surfaces = 0;
    double volume = 0.0;
    ASSERT(extract_mesh());
    inside_parts = flood(label_in, 1, 1);
    outside_parts = flood(label_out, 0, 3);
    memset(euler_object, 0, sizeof euler_object);
    memset(euler_mesh, 0, sizeof euler_mesh);
    digital_euler(euler_object);
    for (i = 0; i < vertex_count; ++i) { parent[i] = i; fan[i] = 0; ++euler_mesh[label_in[mesh_voxel[i]]]; }
    for (i = 0; i < face_count; ++i) {
        springls__v3 a = mesh_point[mesh_face[i][0]], b = mesh_point[mesh_face[i][1]], c = mesh_point[mesh_face[i][2]];
        springls__v3 area = springls__cross(springls__sub(b, a), springls__sub(c, a));
        ASSERT(springls__length2(area) > 0.0f);
        volume += (double)springls__dot(a, springls__cross(b, c)) / 6.0;
        ++euler_mesh[label_in[mesh_voxel[mesh_face[i][0]]]];
        for (v = 0; v < 3; ++v) {
            int p = mesh_face[i][v], q = mesh_face[i][(v + 1) % 3];
            ASSERT_EQ(label_in[mesh_voxel[p]], label_in[mesh_voxel[q]]);
            if (p < q) --euler_mesh[label_in[mesh_voxel[p]]];
            ++fan[p];
            parent[find_part(parent, p)] = find_part(parent, q);
            packed[sides] = (int64_t)p << 32 | q;
            side_key[sides] = packed[sides];
            ++sides;
        }
    }
    ASSERT(vertex_count == 0 || volume > 0.0);

    /* closed: sorted directed sides are distinct and every one has its opposite */
    qsort(side_key, (size_t)sides, sizeof side_key[0], compare_keys);
    for (i = 0; i < sides; ++i) {
        int64_t opposite = (side_key[i] & 0xffffffff) << 32 | side_key[i] >> 32;
        ASSERT(i == 0 || side_key[i] != side_key[i - 1]);
        ASSERT(bsearch(&opposite, side_key, (size_t)sides, sizeof opposite, compare_keys) != NULL);
    }
    /* manifold: turning around a vertex from triangle to triangle meets all of its triangles */
    for (i = 0; i < sides; ++i) {
        const int64_t *at = (const int64_t *)bsearch(&packed[i], side_key, (size_t)sides, sizeof packed[0], compare_keys);
        side_owner[at - side_key] = i;
    }
    for (i = 0; i < sides; ++i) {
        int before = i - i % 3 + (i + 2) % 3;
        int64_t key = (packed[before] & 0xffffffff) << 32 | packed[before] >> 32;
        const int64_t *at = (const int64_t *)bsearch(&key, side_key, (size_t)sides, sizeof key, compare_keys);
        next_corner[i] = side_owner[at - side_key];
    }
    for (i = 0; i < sides; ++i) {
        int turn = 1, at = next_corner[i];
        for (; at != i && turn <= 64; at = next_corner[at]) ++turn;
        ASSERT_EQ(fan[packed[i] >> 32], turn);
    }
    for (i = 0; i < vertex_count; ++i) surfaces += find_part(parent, i) == i;
    ASSERT_EQ(inside_parts + outside_parts - 1, surfaces);
    for (i = 0; i < inside_parts; ++i) ASSERT_EQ(2 * euler_object[i], euler_mesh[i]);
    PASS();
}

TEST random_grids_give_the_topology_of_the_digital_object(void)
{
    int seed;
    for (seed = 1; seed <= 120; ++seed) {
        random_state = (uint32_t)seed * 2654435761u;
        make_field(seed & 3);
        CHECK_CALL(check_field());
    }
    PASS();
}

SUITE(marching_cubes)
{
    RUN_TEST(edge_numbers_follow_the_stated_rule);
    RUN_TEST(table_is_what_the_rules_give);
    RUN_TEST(every_case_is_an_oriented_surface_ending_on_faces);
    RUN_TEST(neighbouring_cubes_meet_without_cracks);
    RUN_TEST(every_inside_part_has_one_sheet);
    RUN_TEST(normals_point_to_growing_phi);
    RUN_TEST(no_case_cuts_itself);
    RUN_TEST(crossings_stay_between_the_corners);
    RUN_TEST(random_grids_give_the_topology_of_the_digital_object);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--print-table") == 0) {
        print_table();
        return 0;
    }
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(marching_cubes);
    GREATEST_MAIN_END();
}
