/* topology.h - simple points: voxels that may change sides without changing the topology of the object.
   Inside is 6-connected and outside 26-connected, as in marching_cubes.h. A neighbourhood of 3 x 3 x 3 voxels is a mask of 27
   bits, set = inside: voxel (dx, dy, dz), each -1, 0 or 1, is bit (dx + 1) + 3 (dy + 1) + 9 (dz + 1). The centre, bit 13,
   never matters: whether a voxel is simple does not depend on the side it is on. */

SPRINGLS__MATHS unsigned int springls__mask27_bit(int dx, int dy, int dz) { return 1u << (dx + 3 * dy + 9 * dz + 13); }

/* The masks spread by one voxel along +-x, +-y or +-z; what leaves the block is lost. */
SPRINGLS__MATHS unsigned int springls__mask27_spread_x(unsigned int m)
{
    return m | (m & 0x36db6dbu) << 1 | (m & 0x6db6db6u) >> 1;
}

SPRINGLS__MATHS unsigned int springls__mask27_spread_y(unsigned int m)
{
    return m | (m & 0x0fc7e3fu) << 3 | (m & 0x7e3f1f8u) >> 3;
}

SPRINGLS__MATHS unsigned int springls__mask27_spread_z(unsigned int m)
{
    return m | (m & 0x003ffffu) << 9 | m >> 9;
}

/* Is the centre next to exactly one part of the inside? Parts are 6-connected through the 18 neighbours that share a face or
   an edge with the centre; only parts with one of the 6 face neighbours count (topological number T6 = 1). */
SPRINGLS__MATHS int springls__touches_one_inside(unsigned int mask27)
{
    unsigned int faces = mask27 & 0x0415410u;
    unsigned int near18 = mask27 & 0x2ebdebau;
    unsigned int part = faces & (~faces + 1u), before = 0u;
    while (part != before) {
        before = part;
        part = (springls__mask27_spread_x(part) | springls__mask27_spread_y(part) | springls__mask27_spread_z(part)) & near18;
    }
    return faces != 0u && (faces & ~part) == 0u;
}

/* Is the centre next to exactly one part of the outside, 26-connected through its 26 neighbours (T26 = 1)? */
SPRINGLS__MATHS int springls__touches_one_outside(unsigned int mask27)
{
    unsigned int outside = ~mask27 & 0x7ffdfffu;
    unsigned int part = outside & (~outside + 1u), before = 0u;
    while (part != before) {
        before = part;
        part = springls__mask27_spread_z(springls__mask27_spread_y(springls__mask27_spread_x(part))) & outside;
    }
    return outside != 0u && part == outside;
}

/* May the centre change sides? 1 when neither parts, holes nor cavities of the object would appear, join or vanish. */
SPRINGLS__MATHS int springls__is_simple(unsigned int mask27)
{
    return springls__touches_one_inside(mask27) && springls__touches_one_outside(mask27);
}
