/* rebuild.h - re-distancing: phi becomes a signed distance again without moving its zero level (Table 2). */

/* True when a voxel and one of its six neighbours lie on different sides. */
SPRINGLS__MATHS int springls__at_interface(springls__cross7 v)
{
    float lo = springls__least(v), hi = springls__most(v);
    return v.c < 0.0f ? hi >= 0.0f : lo < 0.0f;
}

/* Square of the slope along one axis: central, or the steeper side where the two disagree (a ridge or a thin sheet). One
   side flat makes the central slope half of the steeper: that is a ridge, whatever the rounding. */
SPRINGLS__MATHS float springls__slope2(float m, float c, float p)
{
    float central = 0.5f * (p - m), left = c - m, right = p - c;
    float steep = springls__max(springls__fabs(left), springls__fabs(right));
    float flat = springls__fabs(central);
    float slope = flat < 0.65f * steep ? steep : flat;
    return slope * slope;
}

/* Sub-voxel distance of a voxel near the interface: phi over its slope. A slope within 5 % of 1 is left as it is, from 10 %
   on it becomes 1: what is a distance already does not creep, however often it is rebuilt. */
SPRINGLS__MATHS float springls__interface_distance(springls__cross7 v)
{
    float g2 = springls__slope2(v.xm, v.c, v.xp) + springls__slope2(v.ym, v.c, v.yp) + springls__slope2(v.zm, v.c, v.zp);
    float excess = springls__sqrt(springls__max(g2, 1e-4f)) - 1.0f;
    float share = springls__clamp(20.0f * springls__fabs(excess) - 1.0f, 0.0f, 1.0f);
    return v.c / (1.0f + share * excess);
}

/* Beside a plane a voxel that is not at the interface is at least 1/sqrt(3) away. Beside a sharp edge or corner it can be
   nearer, and the way by its neighbours would be too long: there too its own slope tells its distance d. One of its 26
   neighbours is then on the other side, unlike with the remnants of parts that have vanished. */
#define SPRINGLS__NEAR 0.577f

SPRINGLS__MATHS int springls__at_sharp_edge(float phi, float d)
{
    return springls__fabs(phi) < 1.0f && springls__fabs(d) < SPRINGLS__NEAR;
}

/* First guess for a voxel that gets its distance from its neighbours: it is not near. */
SPRINGLS__MATHS float springls__distance_guess(float phi, float far_value)
{
    float d = springls__clamp(springls__fabs(phi), SPRINGLS__NEAR, far_value);
    return phi < 0.0f ? -d : d;
}

/* |grad d| = 1 (Godunov) from the smaller neighbour distance along each axis. */
SPRINGLS__MATHS float springls__eikonal(float x, float y, float z)
{
    float a = springls__min(x, springls__min(y, z)), c = springls__max(x, springls__max(y, z));
    float b = springls__max(springls__min(x, y), springls__min(springls__max(x, y), z));
    float one = a + 1.0f;
    float two = 0.5f * (a + b + springls__sqrt(springls__max(2.0f - (a - b) * (a - b), 0.0f)));
    float sum = a + b + c;
    float three = (sum + springls__sqrt(springls__max(sum * sum - 3.0f * (a * a + b * b + c * c - 1.0f), 0.0f))) * (1.0f / 3.0f);
    float d = one > b ? two : one;
    return d > c ? three : d;
}

/* New distance of a voxel from its neighbours'. It keeps its own at the interface, and where it is near and one of its 26
   neighbours on the other side (touches): near springls alone are no surface. */
SPRINGLS__MATHS float springls__redistance(springls__cross7 v, int touches, float far_value)
{
    float d = springls__eikonal(springls__min(springls__fabs(v.xm), springls__fabs(v.xp)),
                                springls__min(springls__fabs(v.ym), springls__fabs(v.yp)),
                                springls__min(springls__fabs(v.zm), springls__fabs(v.zp)));
    d = springls__min(d, far_value);
    if ((touches && springls__fabs(v.c) < SPRINGLS__NEAR) || springls__at_interface(v)) return v.c;
    return v.c < 0.0f ? -d : d;
}

/* Rows of eight voxels; phi points into a tile. */
SPRINGLS__MATHS void springls__interface_row(SPRINGLS__LOCAL const float *phi, float far_value, SPRINGLS__GLOBAL float *out);
SPRINGLS__MATHS void springls__redistance_row(SPRINGLS__LOCAL const float *phi, float far_value, SPRINGLS__GLOBAL float *out);

/* Sub-voxel distances at the interface; the rest keeps its value as a first guess. */
SPRINGLS__MATHS void springls__subvoxel_element(const springls__model *model, springls__job job, int i,
                                                SPRINGLS__LOCAL float *tile)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL float *out = g->phi_next + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    int row;
    (void)job;
    springls__load_tile(g, g->phi, g->active[i], model->group, tile);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items)
        springls__interface_row(tile + springls__tile_index(0, row & 7, row >> 3), g->far_value, out + 8 * row);
}

/* One Jacobi sweep of |grad phi| = 1; voxels at the interface keep their distance. */
SPRINGLS__MATHS void springls__redistance_element(const springls__model *model, springls__job job, int i,
                                                  SPRINGLS__LOCAL float *tile)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL float *out = g->phi_next + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    int row;
    (void)job;
    springls__load_tile(g, g->phi, g->active[i], model->group, tile);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items)
        springls__redistance_row(tile + springls__tile_index(0, row & 7, row >> 3), g->far_value, out + 8 * row);
}

/* Which of the 27 bricks around (and including) a brick the band reaches. */
SPRINGLS__MATHS uint32_t springls__band_neighbor_mask(SPRINGLS__GLOBAL const float *phi, float half_width)
{
    uint32_t reach = 0;
    int x, y, z;
    for (z = 0; z < 8; z++)
        for (y = 0; y < 8; y++) {
            uint32_t row = 0;
            for (x = 0; x < 8; x++) row |= (uint32_t)(springls__fabs(phi[x + 8 * y + 64 * z]) < half_width) << x;
            if (row) reach |= springls__neighbor_mask_of_row((row & 1u) != 0, row >> 7 != 0, y == 0, y == 7, z == 0, z == 7);
        }
    return reach;
}

/* To SCRATCH0, one a brick. */
SPRINGLS__MATHS void springls__band_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    ((SPRINGLS__GLOBAL uint32_t *)model->work.scratch[0])[i] = springls__band_neighbor_mask(
        model->grid.phi + (size_t)model->grid.active[i] * SPRINGLS__BRICK_VOXELS, model->params.band_half_width);
}
