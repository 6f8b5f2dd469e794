/* Shapes of examples/morph: distances to a mesh, contours that leave one piece, heat weights and a texture atlas of a tube, and
 * meshes that cut themselves. Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_morph_shapes_built_without_their_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_morph_shapes_built_without_their_libraries);
    GREATEST_MAIN_END();
}

#else

#include "base/vec3.h"
#include "character/mesh_voxels.h"
#include "character/solid_handles.h"
#include "character/thin_places.h"
#include "morph/morph.h"

#include "morph_fixtures.h"

/* ---- voxels ---- */

/* Two tetrahedra, one inside the other: distances are those to the outer one. */
TEST a_mesh_that_overlaps_itself_has_one_distance(void)
{
    const float positions[24] = {4, 4, 4, 24, 4, 4, 4, 24, 4, 4, 4, 24, 6, 6, 6, 11, 6, 6, 6, 11, 6, 6, 6, 11};
    const int triangles[24] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2, 4, 6, 5, 4, 5, 7, 5, 6, 7, 4, 7, 6};
    const struct solid_grid grid = {{29, 28, 27}, {0, 0, 0}, 1.0};
    enum { COUNT = 29 * 28 * 27 };
    float *phi = malloc(COUNT * sizeof *phi);
    int *nearest = malloc(COUNT * sizeof *nearest);
    ASSERT(mesh_voxels(&grid, positions, triangles, 8, 1.5f, phi, nearest));
    for (int z = 1; z < 26; ++z) {
        for (int y = 1; y < 27; ++y) {
            for (int x = 1; x < 28; ++x) {
                const int at = (z * 28 + y) * 29 + x;
                const float slope = (float)(x + y + z - 32) / sqrtf(3.0f);
                const float inside = fmaxf(fmaxf(4.0f - (float)x, 4.0f - (float)y), fmaxf(4.0f - (float)z, slope));
                if (inside < 0.0f) ASSERT_NEAR(inside, phi[at], inside > -1.4f ? 2e-4 : 1.0);
                if (inside > 0.0f) ASSERT(phi[at] > 0.0f && phi[at] > inside - 1.0f);
                if (inside < 0.0f && inside > -1.0f) ASSERT(nearest[at] >= 0 && nearest[at] < 4);
            }
        }
    }
    free(phi);
    free(nearest);
    PASS();
}

static float ball_at(const float p[3], float x, float y, float z, float radius)
{
    const float d[3] = {p[0] - x, p[1] - y, p[2] - z};
    return vec3_length(d) - radius;
}

enum { ROOM = 40 }; /* voxels a side of the grid for contours */

/* Fills the grid; which: 0 two balls, a drop and a hollow in one of the balls, 1 a rod through the balls, 2 a thin rod between. */
static void fill_room(float *phi, int which)
{
    for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
        const float p[3] = {(float)(n % ROOM), (float)(n / ROOM % ROOM), (float)(n / (ROOM * ROOM))};
        const float left = ball_at(p, 10, 20, 20, 6), right = ball_at(p, 30, 20, 20, 6), drop = ball_at(p, 20, 33, 20, 1.6f);
        const float rod = ball_at(p, fmaxf(10, fminf(30, p[0])), 20, 20, which == 1 ? 5 : 0.9f);
        phi[n] = fminf(left, right);
        phi[n] = which == 0 ? fmaxf(fminf(phi[n], drop), -ball_at(p, 10, 20, 20, 1.8f)) : fminf(phi[n], rod);
    }
}

/* Makes the model of a morph, empty, in a grid of ROOM^3 voxels, and the arrays that the contour works in. */
static springls_status begin_room(struct morph *morph)
{
    springls_desc desc = springls_default_desc();
    springls_params params = springls_default_params();
    if (run_set_members("test", MORPH_SET, &params) != CLI_CONTINUE) return SPRINGLS_INVALID_ARGUMENT;
    desc.params = &params;
    for (int k = 0; k < 3; ++k) desc.grid.size[k] = ROOM, desc.grid.spacing[k] = 1.0;
    morph->grid = desc.grid;
    morph->pressure = malloc(ROOM * ROOM * ROOM * sizeof(float));
    morph->way = malloc(3 * ROOM * ROOM * ROOM * sizeof(float));
    morph->shape = malloc(ROOM * ROOM * ROOM * sizeof(float));
    return springls_create(&desc, &morph->ctx);
}

static void end_room(struct morph *morph)
{
    free(morph->pressure);
    free(morph->way);
    free(morph->shape);
    springls_destroy(morph->ctx);
}

/* Drops and hollows vanish, and what the shape connects grows together, even along a rod thinner than two voxels. */
TEST a_contour_leaves_one_piece(void)
{
    float *phi = malloc(ROOM * ROOM * ROOM * sizeof *phi);
    for (int which = 1; which < 3; ++which) {
        struct morph morph = {.settings = {.iterations = 2, .pace = 1.0f, .reach = 60}};
        const struct solid_grid grid = {{ROOM, ROOM, ROOM}, {0, 0, 0}, 1.0};
        springls_mesh mesh;
        struct mesh_check check;
        bool whole;
        ASSERT_EQ(SPRINGLS_OK, begin_room(&morph));
        fill_room(phi, 0);
        ASSERT(solid_is_whole(&grid, phi, &whole) && !whole);
        ASSERT_EQ(SPRINGLS_OK, springls_set_level_set(morph.ctx, phi));
        ASSERT_EQ(SPRINGLS_OK, springls_extract_mesh(morph.ctx, &mesh));
        ASSERT_EQ(4, mesh_components(mesh.vertex_count, mesh.triangles, mesh.triangle_count));
        springls_mesh_free(morph.ctx, &mesh);
        fill_room(morph.shape, which);
        ASSERT(solid_is_whole(&grid, morph.shape, &whole) && whole);
        ASSERT(morph_contour(&morph, false));
        ASSERT_EQ(SPRINGLS_OK, springls_extract_mesh(morph.ctx, &mesh));
        ASSERT(mesh_check(mesh.positions, mesh.vertex_count, mesh.triangles, mesh.triangle_count, &check));
        ASSERT_EQ(1, check.components);
        ASSERT_EQ(0, check.open_edges + check.intersections);
        springls_mesh_free(morph.ctx, &mesh);
        end_room(&morph);
    }
    free(phi);
    PASS();
}

/* A slanted ring, of voxels that hang together at edges where it is thin, or by faces all around, becomes one piece without a handle. */
TEST a_contour_cuts_a_slanted_ring(void)
{
    for (int thick = 0; thick < 2; ++thick) {
        struct morph morph = {.settings = {.iterations = 1, .pace = 1.0f, .reach = 60}};
        springls_measures measures;
        ASSERT_EQ(SPRINGLS_OK, begin_room(&morph));
        for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
            const float x = (float)(n % ROOM) - 20, y = (float)(n / ROOM % ROOM) - 20, z = (float)(n / (ROOM * ROOM)) - 20;
            const float across = sqrtf(0.5f) * (y - z), along = sqrtf(0.5f) * (y + z), around = sqrtf(x * x + along * along) - 10;
            morph.shape[n] = sqrtf(around * around + across * across) - (thick ? 1.2f : 0.7f) - 0.1f * (x + 10);
        }
        ASSERT_EQ(SPRINGLS_OK, springls_set_level_set(morph.ctx, morph.shape));
        ASSERT_EQ(SPRINGLS_OK, springls_copy_level_set(morph.ctx, morph.shape));
        ASSERT_EQ(SPRINGLS_OK, springls_measure(morph.ctx, &measures));
        ASSERT(thick ? measures.components == 1 && measures.euler == 0 : measures.components > 1);
        ASSERT(morph_contour(&morph, false));
        ASSERT_EQ(SPRINGLS_OK, springls_measure(morph.ctx, &measures));
        ASSERT_EQ(1, measures.components);
        ASSERT_EQ(2, measures.euler);
        end_room(&morph);
    }
    PASS();
}

/* Fills the grid with a block, into which `width` voxels of crevice go from above; width 0: none. */
static void fill_block(float *phi, float width)
{
    for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
        const float x = (float)(n % ROOM), y = (float)(n / ROOM % ROOM), z = (float)(n / (ROOM * ROOM));
        const float block = fmaxf(fmaxf(fabsf(x - 20), fabsf(y - 20)), fabsf(z - 20)) - 11.5f;
        const float crevice = fmaxf(fabsf(x - 20) - 0.5f * width, 15.5f - y);
        phi[n] = width > 0.0f ? fmaxf(block, -crevice) : block;
    }
}

/* A crevice deepens along its narrow mouth, until a frame's steps gain nothing. */
TEST a_contour_opens_a_crevice(void)
{
    struct morph morph = {.settings = {.iterations = 1, .pace = 1.0f, .reach = 60}};
    float *phi = malloc(ROOM * ROOM * ROOM * sizeof *phi);
    int left = 0;
    ASSERT_EQ(SPRINGLS_OK, begin_room(&morph));
    fill_block(phi, 0.0f);
    ASSERT_EQ(SPRINGLS_OK, springls_set_level_set(morph.ctx, phi));
    fill_block(morph.shape, 2.0f);
    ASSERT(morph_contour(&morph, true));
    ASSERT_EQ(SPRINGLS_OK, springls_copy_level_set(morph.ctx, phi));
    for (int n = 0; n < ROOM * ROOM * ROOM; ++n) left += morph.shape[n] > 0.1f && phi[n] < -1.0f;
    ASSERT_EQ(0, left);
    end_room(&morph);
    free(phi);
    PASS();
}

/* A limb grows out of a ball though it is hardly thicker than a voxel. */
TEST a_contour_grows_a_thin_limb(void)
{
    struct morph morph = {.settings = {.iterations = 1, .pace = 1.0f, .reach = 60}};
    float *phi = malloc(ROOM * ROOM * ROOM * sizeof *phi);
    int left = 0;
    ASSERT_EQ(SPRINGLS_OK, begin_room(&morph));
    for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
        const float p[3] = {(float)(n % ROOM), (float)(n / ROOM % ROOM), (float)(n / (ROOM * ROOM))};
        phi[n] = ball_at(p, 12, 20, 20, 6);
        morph.shape[n] = fminf(phi[n], ball_at(p, fmaxf(12, fminf(30, p[0])), 20.3f, 20.4f, 1.0f));
    }
    ASSERT_EQ(SPRINGLS_OK, springls_set_level_set(morph.ctx, phi));
    ASSERT(morph_contour(&morph, true));
    ASSERT_EQ(SPRINGLS_OK, springls_copy_level_set(morph.ctx, phi));
    for (int n = 0; n < ROOM * ROOM * ROOM; ++n) left += morph.shape[n] < -0.1f && phi[n] > 1.0f;
    ASSERT_EQ(0, left);
    end_room(&morph);
    free(phi);
    PASS();
}

/* A repair opens a crevice whose mouth a film of one voxel closes, and fills a wider hollow behind one. */
TEST a_repair_opens_crevices_and_fills_hollows(void)
{
    const struct solid_grid grid = {{ROOM, ROOM, ROOM}, {0, 0, 0}, 1.0};
    float *phi = malloc(ROOM * ROOM * ROOM * sizeof *phi);
    const int film = (20 * ROOM + 29) * ROOM + 20, within = (20 * ROOM + 20) * ROOM + 20;
    for (int wide = 0; wide < 2; ++wide) {
        struct solid_repair repair;
        fill_block(phi, wide ? 6.0f : 1.2f);
        for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
            const int y = n / ROOM % ROOM, beside = abs(n % ROOM - 20), along = abs(n / (ROOM * ROOM) - 20);
            if (beside < 4 && along < 12 && y > 15 && y < 30 && (y == 29 || along > 8)) phi[n] = fminf(phi[n], -0.1f);
        }
        ASSERT(phi[within] > 0.0f && phi[film] < 0.0f);
        ASSERT(solid_repair(&grid, phi, NULL, ROOM, true, &repair));
        ASSERT_EQ(wide, repair.filled > 0);
        ASSERT_EQ(wide, phi[within] < 0.0f);
    }
    free(phi);
    PASS();
}

/* A bridge goes along the middle of a limb, though another way is shorter. */
TEST a_bridge_follows_a_limb(void)
{
    const struct solid_grid grid = {{ROOM, ROOM, ROOM}, {0, 0, 0}, 1.0};
    const float around[4][3] = {{10, 20, 20}, {10, 32, 20}, {30, 32, 20}, {30, 20, 20}};
    float *phi = malloc(ROOM * ROOM * ROOM * sizeof *phi);
    unsigned char *limbs = calloc(ROOM * ROOM * ROOM, 1);
    for (int k = 0; k < 3; ++k) solid_mark_way(&grid, around[k], around[k + 1], limbs);
    for (int known = 0; known < 2; ++known) {
        struct solid_repair repair;
        bool whole;
        for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
            const float p[3] = {(float)(n % ROOM), (float)(n / ROOM % ROOM), (float)(n / (ROOM * ROOM))};
            phi[n] = fminf(ball_at(p, 10, 20, 20, 6), ball_at(p, 30, 20, 20, 6));
        }
        ASSERT(solid_repair(&grid, phi, known ? limbs : NULL, ROOM, false, &repair));
        ASSERT(solid_is_whole(&grid, phi, &whole) && whole);
        ASSERT_EQ(1, repair.joined);
        ASSERT_EQ(known, phi[(20 * ROOM + 32) * ROOM + 20] < 0.0f);
    }
    free(phi);
    free(limbs);
    PASS();
}

/* Adds a box to a mesh. */
static void add_box(const float lo[3], const float hi[3], struct character *c)
{
    static const int faces[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    for (int i = 0; i < 36; ++i) c->triangles[3 * c->triangle_count + i] = c->vertex_count + faces[i];
    for (int v = 0; v < 8; ++v)
        for (int i = 0; i < 3; ++i) c->positions[3 * (c->vertex_count + v) + i] = v >> i & 1 ? hi[i] : lo[i];
    c->vertex_count += 8;
    c->triangle_count += 12;
}

/* Two legs that do not reach the hips and stand on one plate: both are joined with the trunk along their bones, and the plate is cut. */
TEST limbs_with_gaps_are_joined_along_their_bones(void)
{
    static const float boxes[4][2][3] = {{{10, 26, 15}, {30, 36, 25}}, {{12, 6, 18}, {16, 22, 22}}, {{24, 6, 18}, {28, 22, 22}},
                                         {{12, 4, 18}, {28, 8, 22}}};
    static const float places[6][3] = {{20, 24, 20}, {20, 32, 20}, {14, 24, 20}, {14, 10, 20}, {26, 24, 20}, {26, 10, 20}};
    static const int parents[6] = {-1, 0, 0, 2, 0, 4};
    float positions[3 * 32];
    int triangles[3 * 48];
    struct joint joints[6] = {{.bone = false}};
    struct morph morph = {.settings = {.limbs = 2.5f, .thicken = -1.0f, .reach = ROOM, .common = {.grid = ROOM, .quiet = true}}};
    struct character *skeleton = &morph.target.character, body = {.positions = positions, .triangles = triangles};
    struct morph_solid solid;
    float *phi = malloc(ROOM * ROOM * ROOM * sizeof *phi);
    for (int b = 0; b < 4; ++b) add_box(boxes[b][0], boxes[b][1], &body);
    for (int j = 0; j < 6; ++j) {
        joints[j].parent = parents[j];
        joints[j].bone = true;
        joints[j].neutral = affine_identity();
        for (int i = 0; i < 3; ++i) joints[j].neutral.m[4 * i + 3] = (double)places[j][i];
    }
    skeleton->joints = joints;
    skeleton->joint_count = 6;
    ASSERT_EQ(SPRINGLS_OK, begin_room(&morph));
    ASSERT(morph_solid_make(&morph, morph.ctx, &morph.grid, NULL, &body, &solid));
    ASSERT_EQ(SPRINGLS_OK, springls_copy_level_set(morph.ctx, phi));
    const struct solid_grid grid = morph_voxels(&morph.grid);
    ASSERT_EQ(1, solid_euler(&grid, phi));
    ASSERT(solid.cut > 0);
    ASSERT(phi[(20 * ROOM + 24) * ROOM + 17] < 0.0f && phi[(20 * ROOM + 24) * ROOM + 23] < 0.0f);
    end_room(&morph);
    free(phi);
    PASS();
}

/* A limb along x that is 3 voxels thick has half of the thickness of the thinner of two bodies of 6 and 8 there; where one of them has no
 * limb nothing is compared. */
TEST limbs_are_compared_with_the_thinner_body(void)
{
    struct affine still = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    struct rod_place places[2] = {{.joint = 0, .before = -1, .root = -1, .middle = {{10, 20, 20}, {10, 20, 20}}, .radius = {1.5f, 1.5f}},
                                  {.joint = 0, .before = 0, .root = -1, .middle = {{20, 20, 20}, {20, 20, 20}}, .radius = {1.5f, 1.5f}}};
    struct joint mover = {.bone = true};
    struct morph morph = {.rods = {places, 2, 2}, .skin = &still, .target = {.character = {.joints = &mover, .joint_count = 1}}};
    float *phi = malloc(ROOM * ROOM * ROOM * sizeof *phi);
    int joint = 0;
    for (int k = 0; k < 3; ++k) morph.grid.size[k] = ROOM, morph.grid.spacing[k] = 1.0;
    for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
        const float p[3] = {(float)(n % ROOM), (float)(n / ROOM % ROOM), (float)(n / (ROOM * ROOM))};
        phi[n] = ball_at(p, fmaxf(5, fminf(35, p[0])), 20, 20, 1.5f);
    }
    ASSERT_NEAR(1.0, morph_thinnest_limb(&morph, 0.5f, phi, &joint), 0.0);
    ASSERT_EQ(-1, joint);
    places[1].depth[0] = 3.0f;
    places[1].depth[1] = 4.0f;
    ASSERT_NEAR(0.5, morph_thinnest_limb(&morph, 0.5f, phi, &joint), 1e-6);
    ASSERT_EQ(0, joint);
    mover.bone = false;
    ASSERT_NEAR(1.0, morph_thinnest_limb(&morph, 0.5f, phi, &joint), 0.0);
    free(phi);
    PASS();
}

/* ---- a tube ---- */

enum { RINGS = 41, AROUND = 24, TUBE_VERTICES = RINGS * AROUND + 2, TUBE_TRIANGLES = 2 * AROUND * RINGS };

/* A tube along y from -1 to 1, closed by flat ends. */
static void make_tube(float *positions, int *triangles)
{
    int used = 0;
    for (int r = 0; r < RINGS; ++r) {
        for (int k = 0; k < AROUND; ++k) {
            const float turn = 6.2831853f * (float)k / AROUND;
            float *p = positions + 3 * (r * AROUND + k);
            p[0] = 0.2f * sinf(turn), p[1] = -1.0f + 2.0f * (float)r / (RINGS - 1), p[2] = 0.2f * cosf(turn);
        }
    }
    for (int end = 0; end < 2; ++end) {
        const float middle[3] = {0.0f, end ? 1.0f : -1.0f, 0.0f};
        memcpy(positions + 3 * (RINGS * AROUND + end), middle, sizeof middle);
    }
    for (int k = 0; k < AROUND; ++k) {
        const int next = (k + 1) % AROUND;
        for (int r = 0; r + 1 < RINGS; ++r) {
            const int a = r * AROUND + k, b = r * AROUND + next, two[6] = {a, b, b + AROUND, a, b + AROUND, a + AROUND};
            memcpy(triangles + 3 * used, two, sizeof two);
            used += 2;
        }
        const int top = (RINGS - 1) * AROUND, ends[6] = {next, k, RINGS * AROUND, top + k, top + next, RINGS * AROUND + 1};
        memcpy(triangles + 3 * used, ends, sizeof ends);
        used += 2;
    }
}

/* A box, and a rod of 0.7 voxel from it that leads from a corner of voxels to the next. */
TEST thin_limbs_become_thick_and_corners_stay(void)
{
    const struct solid_grid grid = {{ROOM, ROOM, ROOM}, {0, 0, 0}, 1.0};
    const size_t count = (size_t)ROOM * ROOM * ROOM;
    float *phi = malloc(count * sizeof *phi), *before = malloc(count * sizeof *before);
    ASSERT(phi && before);
    for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
        const float p[3] = {(float)(n % ROOM), (float)(n / ROOM % ROOM), (float)(n / (ROOM * ROOM))};
        const float along = fmaxf(12.0f, fminf(34.0f, (p[0] + p[1]) / 2.0f));
        const float box = fmaxf(fmaxf(fabsf(p[0] - 11), fabsf(p[1] - 11)), fabsf(p[2] - 20)) - 6.3f;
        before[n] = phi[n] = fminf(box, ball_at(p, along, along, 20, 0.7f));
    }
    bool whole;
    ASSERT(solid_is_whole(&grid, phi, &whole));
    ASSERT(!whole); /* its voxels touch at edges only */
    const int added = thin_places_thicken(&grid, phi, 2.5f);
    ASSERT(added > 0);
    ASSERT(solid_is_whole(&grid, phi, &whole));
    ASSERT(whole);
    int changed = 0;
    for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
        const int at[3] = {n % ROOM, n / ROOM % ROOM, n / (ROOM * ROOM)};
        ASSERT(phi[n] <= before[n]);
        if (at[0] < 17 && at[1] < 17) ASSERT_EQ(before[n] < 0.0f, phi[n] < 0.0f);
        if (at[0] == at[1] && at[2] == 20 && at[0] > 20 && at[0] < 34) ASSERT(phi[n] < -1.0f);
        changed += phi[n] < 0.0f && before[n] >= 0.0f;
    }
    ASSERT_EQ(added, changed);
    free(phi);
    free(before);
    PASS();
}

/* phi of a model is clamped beyond its band, which is 2 to 6 voxels: the middle of a thick body looks no deeper than that. */
TEST a_thick_body_stays_at_the_largest_thickness(void)
{
    const struct solid_grid grid = {{ROOM, ROOM, ROOM}, {0, 0, 0}, 1.0};
    const size_t count = (size_t)ROOM * ROOM * ROOM;
    float *phi = malloc(count * sizeof *phi), *before = malloc(count * sizeof *before);
    ASSERT(phi && before);
    for (float band = 2.0f; band <= 3.0f; ++band) {
        for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
            const float p[3] = {(float)(n % ROOM), (float)(n / ROOM % ROOM), (float)(n / (ROOM * ROOM))};
            before[n] = phi[n] = fmaxf(-band - 1.0f, fminf(ball_at(p, 20, 20, 20, 15), band + 1.0f));
        }
        ASSERT_EQ(0, thin_places_thicken(&grid, phi, 2.0f * band));
        ASSERT_MEM_EQ(before, phi, count * sizeof *phi);
    }
    free(phi);
    free(before);
    PASS();
}

/* Signed distance of a ring in the plane z = 20 around (20, 20), with this radius of its tube, which swells where x is large. */
static float ring_at(const float p[3], float radius)
{
    const float around = sqrtf((p[0] - 20) * (p[0] - 20) + (p[1] - 20) * (p[1] - 20)) - 10;
    return sqrtf(around * around + (p[2] - 20) * (p[2] - 20)) - radius - 0.1f * (p[0] - 10);
}

/* Counts the voxels whose side has changed, from x = lo on. */
static int count_changes(const float *phi, const float *before, int lo)
{
    int changes = 0;
    for (int n = 0; n < ROOM * ROOM * ROOM; ++n) { changes += n % ROOM >= lo && (phi[n] < 0.0f) != (before[n] < 0.0f); }
    return changes;
}

enum { ON_SURFACE = (22 * ROOM + 20) * ROOM + 28 }; /* a voxel beside the plate */

/* A ring is cut where it is thinnest, two that share a place once each; a body without handles stays as it is to the bit; the small
 * tunnel of a plate is closed where films may be as large. */
TEST handles_are_cut_where_they_are_thin_and_small_tunnels_are_closed(void)
{
    const struct solid_grid grid = {{ROOM, ROOM, ROOM}, {0, 0, 0}, 1.0};
    const size_t count = (size_t)ROOM * ROOM * ROOM;
    float *phi = malloc(count * sizeof *phi), *before = malloc(count * sizeof *before);
    struct solid_handles handles;
    bool whole;
    ASSERT(phi && before);
    for (int shape = 0; shape < 5; ++shape) { /* a ball, a ring, two, a plate with a tunnel, the same to be cut */
        for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
            const float p[3] = {(float)(n % ROOM), (float)(n / ROOM % ROOM), (float)(n / (ROOM * ROOM))};
            const float turned[3] = {p[0], p[2], p[1]}, hole = hypotf(p[0] - 20, p[1] - 20) - 1.5f;
            const float ring = ring_at(p, 2), plate = fmaxf(fmaxf(fabsf(p[0] - 20), fabsf(p[1] - 20)) - 12, fabsf(p[2] - 20) - 1.5f);
            const float bored = plate > 0 && hole < 0 ? hypotf(plate, hole) : fmaxf(plate, -hole);
            const float shapes[4] = {ball_at(p, 20, 20, 20, 9), ring, fminf(ring, ring_at(turned, 2)), bored};
            before[n] = phi[n] = shape > 2 && n == ON_SURFACE ? 0.0f : shapes[shape < 4 ? shape : 3];
        }
        ASSERT_EQ(shape == 0 ? 1 : shape == 2 ? -2 : 0, solid_euler(&grid, phi));
        ASSERT(solid_cut_handles(&grid, phi, NULL, shape == 3 ? 16 : 0, &handles));
        ASSERT_EQ(1, solid_euler(&grid, phi));
        ASSERT(solid_is_whole(&grid, phi, &whole));
        ASSERT(whole);
        ASSERT_EQ(handles.cut + handles.filled, count_changes(phi, before, 0));
        if (shape == 0) ASSERT_MEM_EQ(before, phi, count * sizeof *phi);
        if (shape == 1) ASSERT_EQ(0, count_changes(phi, before, 15)); /* the thin side */
        if (shape == 3) ASSERT(handles.filled > 0 && handles.filled <= 16 && handles.cut == 0);
        if (shape == 3) ASSERT_EQ(0, count_changes(phi, before, 22)); /* beyond the hole, also where phi is 0 */
        if (shape == 4) ASSERT(handles.cut > 9 && handles.filled == 0);
    }
    free(phi);
    free(before);
    PASS();
}

/* A limb along the thin side of a ring is not cut: the cut is on the other side, which is thicker. */
TEST limbs_are_not_cut(void)
{
    const struct solid_grid grid = {{ROOM, ROOM, ROOM}, {0, 0, 0}, 1.0};
    float *phi = malloc((size_t)ROOM * ROOM * ROOM * sizeof *phi), *before = malloc((size_t)ROOM * ROOM * ROOM * sizeof *phi);
    unsigned char *limbs = calloc((size_t)ROOM * ROOM * ROOM, 1);
    struct solid_handles handles;
    ASSERT(phi && before && limbs);
    for (int n = 0; n < ROOM * ROOM * ROOM; ++n) {
        const float p[3] = {(float)(n % ROOM), (float)(n / ROOM % ROOM), (float)(n / (ROOM * ROOM))};
        before[n] = phi[n] = ring_at(p, 2);
    }
    for (int k = 0; k < 24; ++k) { /* from one side of the thick place round to the other */
        const float a = 0.8f + 0.195f * (float)k, b = a + 0.195f;
        const float from[3] = {20 + 10 * cosf(a), 20 + 10 * sinf(a), 20}, to[3] = {20 + 10 * cosf(b), 20 + 10 * sinf(b), 20};
        solid_mark_way(&grid, from, to, limbs);
    }
    ASSERT(solid_cut_handles(&grid, phi, limbs, 0, &handles));
    ASSERT_EQ(1, solid_euler(&grid, phi));
    ASSERT(handles.cut > 0);
    ASSERT_EQ(handles.cut, count_changes(phi, before, 25));
    free(phi);
    free(before);
    free(limbs);
    PASS();
}

TEST heat_weights_of_a_tube_are_symmetric_and_sum_to_one(void)
{
    float *positions = malloc(3 * TUBE_VERTICES * sizeof *positions), *weights = malloc(2 * TUBE_VERTICES * sizeof *weights);
    int *triangles = malloc(3 * TUBE_TRIANGLES * sizeof *triangles);
    const struct bone bones[2] = {{{0, -0.9f, 0}, {0, 0, 0}}, {{0, 0, 0}, {0, 0.9f, 0}}};
    struct heat_report report;
    struct mesh_check check;
    make_tube(positions, triangles);
    ASSERT(mesh_check(positions, TUBE_VERTICES, triangles, TUBE_TRIANGLES, &check));
    ASSERT_EQ(0, check.open_edges);
    ASSERT_EQ(2, check.euler);
    ASSERT(heat_weights(positions, TUBE_VERTICES, triangles, TUBE_TRIANGLES, bones, 2, weights, &report));
    ASSERT(report.sum_error < 1e-5);
    ASSERT_EQ(TUBE_VERTICES, report.visible);
    for (int r = 0; r < RINGS; ++r) {
        const float *mine = weights + 2 * (r * AROUND + 3), *other = weights + 2 * ((RINGS - 1 - r) * AROUND + 3);
        ASSERT_NEAR(1.0, mine[0] + mine[1], 1e-6);
        ASSERT_NEAR(mine[0], other[1], 2e-3); /* the diagonals of the quads break the symmetry a little */
        if (r > 0) ASSERT(mine[1] > weights[2 * ((r - 1) * AROUND + 3) + 1]); /* rising along the tube */
    }
    ASSERT_NEAR(0.5, weights[2 * (RINGS / 2 * AROUND + 3)], 2e-3);
    ASSERT(weights[0] > 0.95f && weights[2 * ((RINGS - 1) * AROUND) + 1] > 0.95f);
    ASSERT(!heat_weights(positions, TUBE_VERTICES, triangles, TUBE_TRIANGLES, bones, 0, weights, &report));
    free(positions);
    free(weights);
    free(triangles);
    PASS();
}

/* Colors a place by where it is on the tube. */
static void place_as_color(const void *user, int triangle, const float weight[3], float color[3])
{
    const float *positions = *(float *const *)user;
    const int *corner = ((int *const *)user)[1] + 3 * triangle;
    for (int i = 0; i < 3; ++i) {
        color[i] = 0.5f;
        for (int k = 0; k < 3; ++k) color[i] += 0.5f * weight[k] * positions[3 * corner[k] + i];
    }
}

/* Every point of the surface finds its own color in the image: charts neither overlap nor bleed. */
TEST an_atlas_has_a_texel_for_every_place(void)
{
    float *positions = malloc(3 * TUBE_VERTICES * sizeof *positions);
    int *triangles = malloc(3 * TUBE_TRIANGLES * sizeof *triangles);
    struct texture_atlas atlas;
    struct image image;
    make_tube(positions, triangles);
    const void *const surface[2] = {positions, triangles};
    ASSERT(texture_atlas_unwrap(positions, TUBE_VERTICES, triangles, TUBE_TRIANGLES, 256, &atlas));
    ASSERT(atlas.triangle_count == TUBE_TRIANGLES && atlas.vertex_count < 2 * TUBE_VERTICES);
    ASSERT(texture_atlas_bake(&atlas, place_as_color, surface, &image));
    for (int t = 0; t < TUBE_TRIANGLES; ++t) {
        float uv[2] = {0.0f, 0.0f}, expected[3];
        const float third[3] = {1.0f / 3.0f, 1.0f / 3.0f, 1.0f / 3.0f};
        for (int k = 0; k < 3; ++k) {
            const int v = atlas.triangles[3 * t + k];
            ASSERT_EQ(triangles[3 * t + k], atlas.vertex_of[v]);
            for (int i = 0; i < 2; ++i) {
                ASSERT(atlas.uvs[2 * v + i] > 0.0f && atlas.uvs[2 * v + i] < 1.0f);
                uv[i] += atlas.uvs[2 * v + i] / 3.0f;
            }
        }
        place_as_color(surface, t, third, expected);
        const float *texel = image.rgb + 3 * ((size_t)(uv[1] * 256.0f) * 256 + (size_t)(uv[0] * 256.0f));
        for (int i = 0; i < 3; ++i) ASSERT_NEAR(expected[i], texel[i], 0.015);
    }
    image_free(&image);
    texture_atlas_free(&atlas);
    ASSERT(!texture_atlas_unwrap(positions, TUBE_VERTICES, triangles, TUBE_TRIANGLES, 8, &atlas)); /* too small for the gutters */
    memset(positions, 0, 3 * TUBE_VERTICES * sizeof *positions);
    ASSERT(!texture_atlas_unwrap(positions, TUBE_VERTICES, triangles, TUBE_TRIANGLES, 256, &atlas)); /* no area */
    free(positions);
    free(triangles);
    PASS();
}

/* ---- meshes ---- */

TEST meshes_that_cut_themselves_are_found_out(void)
{
    struct mesh_check check;
    ASSERT(mesh_check(corners, 8, tetrahedra, 4, &check));
    ASSERT(check.open_edges == 0 && check.intersections == 0 && check.components == 1 && check.euler == 2);
    ASSERT(mesh_check(corners, 8, tetrahedra, 8, &check));
    ASSERT(check.open_edges == 0 && check.intersections > 0 && check.components == 2 && check.euler == 4);
    ASSERT(mesh_check(corners, 8, tetrahedra, 3, &check));
    ASSERT_EQ(3, check.open_edges);
    ASSERT(!mesh_check(corners, 3, tetrahedra, 4, &check)); /* an index out of range */
    PASS();
}

TEST specks_are_left_out(void)
{
    float positions[24];
    int triangles[24], count = 8;
    memcpy(positions, corners, sizeof positions);
    memcpy(triangles, tetrahedra, sizeof triangles);
    for (int i = 12; i < 24; ++i) positions[i] *= 0.1f; /* 1/6000 */
    ASSERT_EQ(0, mesh_drop_specks(positions, 8, triangles, &count, 1e-5));
    ASSERT_EQ(8, count);
    ASSERT_EQ(1, mesh_drop_specks(positions, 8, triangles, &count, 1e-2));
    ASSERT_EQ(4, count);
    ASSERT_EQ(0, memcmp(triangles, tetrahedra, 12 * sizeof *triangles));
    PASS();
}

/* The second one is nine tenths of the first, around the same place: a skin where it faces inwards, a body where it does not. */
TEST inner_skins_are_dropped(void)
{
    const float middle = 0.25f;
    for (int shape = 0; shape < 3; ++shape) { /* a skin, a body, a small hollow */
        float positions[24];
        int triangles[24], count = 8;
        memcpy(positions, corners, 12 * sizeof *positions);
        memcpy(triangles, tetrahedra, 12 * sizeof *triangles);
        for (int i = 0; i < 12; ++i) {
            positions[12 + i] = middle + (shape == 2 ? 0.5f : 0.9f) * (positions[i] - middle);
            triangles[12 + i] = 4 + triangles[shape == 1 || i % 3 == 0 ? i : i % 3 == 1 ? i + 1 : i - 1];
        }
        ASSERT_EQ(shape == 0 ? 1 : 0, mesh_drop_inner_skins(positions, 8, triangles, &count));
        ASSERT_EQ(shape == 0 ? 4 : 8, count);
        ASSERT_EQ(0, memcmp(triangles, tetrahedra, 12 * sizeof *triangles));
    }
    PASS();
}

/* A body with a skin inside, each triangle with corners of its own: it is still one skin. Without the last triangle of each it is an
 * open lining, and with the three sides of a rim a lining that belongs to the body's closed surface: these stay. */
TEST seams_are_no_borders_of_skins_and_linings_stay(void)
{
    static const int rim[] = {0, 3, 7, 0, 7, 4, 3, 2, 6, 3, 6, 7, 2, 0, 4, 2, 4, 6};
    for (int shape = 0; shape < 3; ++shape) { /* a skin, an open lining, one with a rim */
        float places[36], positions[3 * 42];
        int surface[42], triangles[42], used = 0;
        for (int i = 0; i < 36; ++i) places[i] = i < 12 ? corners[i] : 0.25f + 0.9f * (corners[i % 12] - 0.25f);
        for (int i = 0; i < 24; ++i) {
            if (shape > 0 && i % 12 > 8) continue;
            surface[used++] = i < 12 ? tetrahedra[i] : 4 + tetrahedra[i % 3 == 0 ? i - 12 : i % 3 == 1 ? i - 11 : i - 13];
        }
        for (int i = 0; shape == 2 && i < 18; ++i) surface[used++] = rim[i];
        for (int i = 0; i < used; ++i) {
            memcpy(positions + 3 * i, places + 3 * surface[i], 3 * sizeof *positions);
            triangles[i] = i;
        }
        if (shape == 0) positions[0] = -0.0f; /* the same place as 0 */
        int count = used / 3;
        struct mesh_check check;
        ASSERT(mesh_check(places, 8, surface, count, &check));
        ASSERT_EQ(shape == 1 ? 6 : 0, check.open_edges);
        ASSERT_EQ(shape == 0 ? 1 : 0, mesh_drop_inner_skins(positions, used, triangles, &count));
        ASSERT_EQ(shape == 0 ? 4 : used / 3, count);
        for (int i = 0; i < 3 * count; ++i) ASSERT_EQ(i, triangles[i]);
        /* The lining as a chart of its own, with a seam along the rim. */
        for (int i = 0; i < used; ++i) triangles[i] = surface[i] + (i >= 18 && shape == 2 && surface[i] > 3 ? 4 : 0);
        count = used / 3;
        ASSERT_EQ(shape == 0 ? 1 : 0, mesh_drop_inner_skins(places, 12, triangles, &count));
    }
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(a_mesh_that_overlaps_itself_has_one_distance);
    RUN_TEST(a_contour_leaves_one_piece);
    RUN_TEST(a_contour_cuts_a_slanted_ring);
    RUN_TEST(limbs_are_compared_with_the_thinner_body);
    RUN_TEST(a_contour_opens_a_crevice);
    RUN_TEST(a_contour_grows_a_thin_limb);
    RUN_TEST(a_repair_opens_crevices_and_fills_hollows);
    RUN_TEST(a_bridge_follows_a_limb);
    RUN_TEST(limbs_with_gaps_are_joined_along_their_bones);
    RUN_TEST(thin_limbs_become_thick_and_corners_stay);
    RUN_TEST(a_thick_body_stays_at_the_largest_thickness);
    RUN_TEST(handles_are_cut_where_they_are_thin_and_small_tunnels_are_closed);
    RUN_TEST(limbs_are_not_cut);
    RUN_TEST(heat_weights_of_a_tube_are_symmetric_and_sum_to_one);
    RUN_TEST(an_atlas_has_a_texel_for_every_place);
    RUN_TEST(meshes_that_cut_themselves_are_found_out);
    RUN_TEST(specks_are_left_out);
    RUN_TEST(inner_skins_are_dropped);
    RUN_TEST(seams_are_no_borders_of_skins_and_linings_stay);
    if (!remove_folder()) return 1;
    GREATEST_MAIN_END();
}

#endif
