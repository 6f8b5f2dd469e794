/* test_topology.c - simple points against flood fills, Euler numbers and whole objects grown and shrunk. */
#include <stdint.h>
#include <string.h>

#include "greatest.h"
#include "../../kernels_embed/stages/topology.h"

static uint32_t random_state = 1u;
static uint32_t random_bits(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}

/* A mask with about density/16 of its voxels inside. */
static unsigned int random_mask(unsigned int density)
{
    unsigned int mask = 0u;
    int i;
    for (i = 0; i < 27; ++i) mask |= (unsigned int)((random_bits() >> 8) % 16u < density) << i;
    return mask;
}

/* ---- oracles on voxels [0,3)^3, centre (1,1,1) ---- */

static int at(unsigned int mask, int x, int y, int z) { return (int)(mask >> (x + 3 * y + 9 * z)) & 1; }

static int distance2(int p, int q)
{
    int dx = p % 3 - q % 3, dy = p / 3 % 3 - q / 3 % 3, dz = p / 9 - q / 9;
    return dx * dx + dy * dy + dz * dz;
}

/* Parts of the set bits, neighbours at squared distance <= reach, that come within touch of the centre. */
static int count_parts(unsigned int set, int reach, int touch)
{
    int seen[27], stack[27], depth, start, q, count = 0;
    memset(seen, 0, sizeof seen);
    for (start = 0; start < 27; ++start) {
        if (!((set >> start) & 1u) || seen[start] || distance2(start, 13) > touch) continue;
        ++count;
        seen[start] = 1;
        for (stack[0] = start, depth = 1; depth;) {
            int p = stack[--depth];
            for (q = 0; q < 27; ++q)
                if (((set >> q) & 1u) && !seen[q] && distance2(p, q) <= reach) { seen[q] = 1; stack[depth++] = q; }
        }
    }
    return count;
}

static unsigned int within(int reach)
{
    unsigned int set = 0u;
    int q;
    for (q = 0; q < 27; ++q)
        if (q != 13 && distance2(q, 13) <= reach) set |= 1u << q;
    return set;
}

static int oracle_t6(unsigned int mask) { return count_parts(mask & within(2), 1, 1); }
static int oracle_t26(unsigned int mask) { return count_parts(~mask & within(3), 3, 3); }

/* Euler number of the inside of the block as a 6-connected object: voxels - pairs + squares - cubes. */
static int block_euler(unsigned int mask)
{
    int x, y, z, extent, c, euler = 0;
    for (extent = 0; extent < 8; ++extent)
        for (z = 0; z + (extent >> 2) < 3; ++z)
            for (y = 0; y + ((extent >> 1) & 1) < 3; ++y)
                for (x = 0; x + (extent & 1) < 3; ++x) {
                    int all = 1, dimension = (extent & 1) + ((extent >> 1) & 1) + (extent >> 2);
                    for (c = 0; c < 8; ++c)
                        if ((c & extent) == c) all = all && at(mask, x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2));
                    if (all) euler += dimension & 1 ? -1 : 1;
                }
    return euler;
}

TEST check_mask(unsigned int mask)
{
    unsigned int centre = 1u << 13;
    int t6 = oracle_t6(mask), t26 = oracle_t26(mask);
    ASSERT_EQ(t6 == 1, springls__touches_one_inside(mask));
    ASSERT_EQ(t26 == 1, springls__touches_one_outside(mask));
    ASSERT_EQ(t6 == 1 && t26 == 1, springls__is_simple(mask));
    ASSERT_EQ(springls__is_simple(mask), springls__is_simple(mask ^ centre));
    /* the same by another road: one part to stick to, and no hole or cavity made or closed */
    ASSERT_EQ(t6 == 1 && block_euler(mask | centre) == block_euler(mask & ~centre), springls__is_simple(mask));
    PASS();
}

TEST bits_are_numbered_as_documented(void)
{
    int x, y, z;
    for (z = -1; z <= 1; ++z)
        for (y = -1; y <= 1; ++y)
            for (x = -1; x <= 1; ++x)
                ASSERT_EQ(1u << ((x + 1) + 3 * (y + 1) + 9 * (z + 1)), springls__mask27_bit(x, y, z));
    PASS();
}

TEST known_neighbourhoods(void)
{
    unsigned int all = 0x7ffffffu, west = springls__mask27_bit(-1, 0, 0), east = springls__mask27_bit(1, 0, 0);
    ASSERT(!springls__is_simple(0u));                                 /* a lone voxel               */
    ASSERT(!springls__is_simple(all));                                /* a cavity                   */
    ASSERT(springls__is_simple(west));                                /* the end of a line          */
    ASSERT(!springls__is_simple(west | east));                        /* the middle of a line       */
    ASSERT(!springls__is_simple(springls__mask27_bit(-1, -1, 0)));    /* diagonal: not connected    */
    ASSERT(springls__is_simple(west | springls__mask27_bit(1, 1, 0)));/* a diagonal one is nothing  */
    ASSERT(springls__is_simple(0x3ffffu));                            /* a flat surface, from above */
    ASSERT(springls__is_simple(all & ~springls__mask27_bit(1, 1, 1)));/* a dent reached by a corner */
    ASSERT(!springls__is_simple(all & ~west & ~east));                /* a tunnel                   */
    PASS();
}

TEST every_filling_of_the_18_neighbours(void)
{
    unsigned int near18 = within(2), filling = 0u;
    random_state = 11u;
    do {
        CHECK_CALL(check_mask(filling | (random_mask(8u) & ~near18)));
        filling = (filling - near18) & near18;
    } while (filling);
    PASS();
}

TEST every_filling_of_faces_and_corners(void)
{
    unsigned int set = within(3) & ~(within(2) & ~within(1)), edges = within(2) & ~within(1), filling = 0u;
    random_state = 12u;
    do {
        CHECK_CALL(check_mask(filling));
        CHECK_CALL(check_mask(filling | edges));
        CHECK_CALL(check_mask(filling | (random_mask(12u) & edges)));
        filling = (filling - set) & set;
    } while (filling);
    PASS();
}

TEST random_masks(void)
{
    int i;
    random_state = 13u;
    for (i = 0; i < 100000; ++i) CHECK_CALL(check_mask(random_mask(1u + (unsigned int)i % 15u)));
    PASS();
}

/* ---- whole objects: 8^3 voxels in a border of outside ---- */

enum { N = 10, VOXELS = N * N * N };

static unsigned char object[VOXELS];
static int seen[VOXELS], stack[VOXELS];

static int count_object_parts(int side, int reach)
{
    int start, depth, count = 0, dx, dy, dz;
    memset(seen, 0, sizeof seen);
    for (start = 0; start < VOXELS; ++start) {
        if (object[start] != side || seen[start]) continue;
        ++count;
        seen[start] = 1;
        for (stack[0] = start, depth = 1; depth;) {
            int p = stack[--depth];
            for (dz = -1; dz <= 1; ++dz)
                for (dy = -1; dy <= 1; ++dy)
                    for (dx = -1; dx <= 1; ++dx) {
                        int x = p % N + dx, y = p / N % N + dy, z = p / N / N + dz, q = x + N * (y + N * z);
                        if (dx * dx + dy * dy + dz * dz > reach || x < 0 || y < 0 || z < 0 || x >= N || y >= N || z >= N) continue;
                        if (object[q] != side || seen[q]) continue;
                        seen[q] = 1;
                        stack[depth++] = q;
                    }
        }
    }
    return count;
}

static int object_euler(void)
{
    int p, extent, c, euler = 0;
    for (p = 0; p < VOXELS - N * N - N - 1; ++p)
        for (extent = 0; extent < 8; ++extent) {
            int all = 1, dimension = (extent & 1) + ((extent >> 1) & 1) + (extent >> 2);
            for (c = 0; c < 8; ++c)
                if ((c & extent) == c) all = all && object[p + (c & 1) + N * ((c >> 1) & 1) + N * N * (c >> 2)];
            if (all) euler += dimension & 1 ? -1 : 1;
        }
    return euler;
}

static unsigned int neighbourhood(int x, int y, int z)
{
    unsigned int mask = 0u;
    int dx, dy, dz;
    for (dz = -1; dz <= 1; ++dz)
        for (dy = -1; dy <= 1; ++dy)
            for (dx = -1; dx <= 1; ++dx)
                if (object[x + dx + N * (y + dy + N * (z + dz))]) mask |= springls__mask27_bit(dx, dy, dz);
    return mask;
}

TEST objects_keep_their_topology_through_simple_points(void)
{
    int seed;
    for (seed = 1; seed <= 60; ++seed) {
        int x, y, z, step, flips = 0, inside, outside, euler;
        random_state = (uint32_t)seed * 2654435761u;
        memset(object, 0, sizeof object);
        for (z = 1; z < N - 1; ++z)
            for (y = 1; y < N - 1; ++y)
                for (x = 1; x < N - 1; ++x)
                    object[x + N * (y + N * z)] = random_bits() % 16u < 1u + (unsigned int)seed % 15u;
        inside = count_object_parts(1, 1);
        outside = count_object_parts(0, 3);
        euler = object_euler();
        for (step = 0; step < 6000; ++step) {
            int grow = (step / 1500) & 1, p;
            x = 1 + (int)(random_bits() % (N - 2));
            y = 1 + (int)(random_bits() % (N - 2));
            z = 1 + (int)(random_bits() % (N - 2));
            p = x + N * (y + N * z);
            if (object[p] == grow && random_bits() % 8u) continue;
            if (!springls__is_simple(neighbourhood(x, y, z))) continue;
            object[p] = !object[p];
            if (++flips % 50) continue;
            ASSERT_EQ(inside, count_object_parts(1, 1));
            ASSERT_EQ(outside, count_object_parts(0, 3));
            ASSERT_EQ(euler, object_euler());
        }
        ASSERT(flips > 50);
        ASSERT_EQ(inside, count_object_parts(1, 1));
        ASSERT_EQ(outside, count_object_parts(0, 3));
        ASSERT_EQ(euler, object_euler());
    }
    PASS();
}

SUITE(topology)
{
    RUN_TEST(bits_are_numbered_as_documented);
    RUN_TEST(known_neighbourhoods);
    RUN_TEST(every_filling_of_the_18_neighbours);
    RUN_TEST(every_filling_of_faces_and_corners);
    RUN_TEST(random_masks);
    RUN_TEST(objects_keep_their_topology_through_simple_points);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(topology);
    GREATEST_MAIN_END();
}
