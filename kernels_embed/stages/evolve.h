/* evolve.h - the signed level set follows the springls (section 4.5, eq. 21-23). */
#ifndef SPRINGLS__KERNEL_STAGES_EVOLVE_H
#define SPRINGLS__KERNEL_STAGES_EVOLVE_H

#include "../model/grid.h"
#include "../model/model.h"

/* Returns mean curvature times |grad phi| in the world, from a 3x3x3 block (x fastest): the regularisation of eq. 23. It is to be
   added: the gradient descent of eq. 22 smooths, where eq. 23 as printed would sharpen. With the metric m, the gradient g and the
   second derivatives H it is the trace of m H, less (m g)' H (m g) over the square of g. */
SPRINGLS__MATHS float springls__curvature_motion(const float b[27], springls__metric m)
{
    float x = 0.5f * (b[14] - b[12]), y = 0.5f * (b[16] - b[10]), z = 0.5f * (b[22] - b[4]);
    float xx = b[14] + b[12] - 2.0f * b[13], yy = b[16] + b[10] - 2.0f * b[13], zz = b[22] + b[4] - 2.0f * b[13];
    float xy = 0.25f * (b[17] + b[9] - b[11] - b[15]);
    float xz = 0.25f * (b[23] + b[3] - b[5] - b[21]);
    float yz = 0.25f * (b[25] + b[1] - b[7] - b[19]);
    float g2 = x * x + y * y + z * z;
    float numerator = (y * y + z * z) * xx + (x * x + z * z) * yy + (x * x + y * y) * zz
                    - 2.0f * (x * y * xy + x * z * xz + y * z * yz);
    if (!springls__is_uniform(m)) {
        springls__v3 g = springls__v3_make(x, y, z), to = springls__metric_times(m, g);
        springls__metric second;
        second.xx = xx; second.yy = yy; second.zz = zz;
        second.xy = xy; second.xz = xz; second.yz = yz;
        g2 = springls__dot(g, to);
        numerator = g2 * (m.xx * xx + m.yy * yy + m.zz * zz + 2.0f * (m.xy * xy + m.xz * xz + m.yz * yz))
                  - springls__metric_product(second, to, to);
    }
    return g2 > 1e-6f ? springls__clamp(numerator / g2, -1.0f, 1.0f) : 0.0f;
}

/* Returns f times the upwind difference of phi along one axis. */
SPRINGLS__VEC_MATHS springls__vec springls__upwind(springls__vec f, springls__vec m, springls__vec c, springls__vec p)
{
    return f * springls__vec_select(f > 0.0f, c - m, p - c);
}

/* Returns phi after one step of eq. 23 without its curvature term. The springls attract: the data term's velocity is
   -grad(omega^2)/2, the vector to the nearest springl (eq. 23's minus sign would repel). First-order upwind. omega^2 is
   smooth at the surface where omega has a kink. */
SPRINGLS__VEC_MATHS springls__vec springls__evolved(springls__cross7 phi, springls__cross7 omega, float step)
{
    springls__vec fx = 0.25f * (omega.xm * omega.xm - omega.xp * omega.xp);
    springls__vec fy = 0.25f * (omega.ym * omega.ym - omega.yp * omega.yp);
    springls__vec fz = 0.25f * (omega.zm * omega.zm - omega.zp * omega.zp);
    springls__vec change = springls__upwind(fx, phi.xm, phi.c, phi.xp) + springls__upwind(fy, phi.ym, phi.c, phi.yp)
                         + springls__upwind(fz, phi.zm, phi.c, phi.zp);
    return phi.c - springls__vec_clamp(step * change, -0.9f, 0.9f);
}

/* Writes phi of a row of eight voxels after one step of eq. 23 where |phi| <= width; phi and omega point into tiles. */
SPRINGLS__MATHS void springls__evolve_row(SPRINGLS__LOCAL const float *phi, SPRINGLS__LOCAL const float *omega, float width,
                                          float step, SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec c = springls__vec_load(phi + i);
        springls__vmask inside = springls__vec_fabs(c) <= width;
        if (springls__vec_any(inside)) {
            springls__vec next = springls__evolved(springls__tile_cross(phi + i), springls__tile_cross(omega + i), step);
            c = springls__vec_select(inside, next, c);
        }
        springls__vec_store(out + i, c);
    }
}

/* Writes phi of active brick i after one step of eq. 23 to phi_next, from phi and omega. */
SPRINGLS__MATHS void springls__evolve_element(const springls__model *model, springls__arguments args, int i,
                                              SPRINGLS__LOCAL float *memory)
{
    const springls__grid *g = &model->grid;
    const float width = model->params.evolve_width, step = model->params.evolve_step, lambda = model->params.curvature;
    SPRINGLS__LOCAL float *phi = memory, *omega = memory + SPRINGLS__TILE_VOXELS;
    float block[27];
    int row, x, d;
    (void)args;
    springls__load_tile(g, g->phi, g->active[i], model->group, phi);
    springls__load_tile(g, g->omega, g->active[i], model->group, omega);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items) {
        int at = springls__tile_index(0, row & 7, row >> 3);
        SPRINGLS__GLOBAL float *out = g->phi_next + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS + 8 * row;
        springls__evolve_row(phi + at, omega + at, width, step, out);
        for (x = 0; x < 8 && lambda != 0.0f; x++) {
            if (springls__fabs(phi[at + x]) > width) continue;
            for (d = 0; d < 27; d++) block[d] = phi[at + x + springls__tile_step(d)];
            out[x] += step * lambda * springls__curvature_motion(block, g->metric);
        }
    }
}

#endif
