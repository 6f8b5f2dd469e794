/* evolve.h - the signed level set follows the springls (section 4.5, eq. 21-23). */

/* One voxel and its six neighbours. */
typedef struct springls__cross7 { float c, xm, xp, ym, yp, zm, zp; } springls__cross7;

/* Mean curvature times |grad phi| from a 3x3x3 block (x fastest): the regularisation of eq. 23. It is ADDED: the
   gradient descent of eq. 22 smooths, where eq. 23 as printed would sharpen. */
SPRINGLS__MATHS float springls__curvature_motion(const float b[27])
{
    float x = 0.5f * (b[14] - b[12]), y = 0.5f * (b[16] - b[10]), z = 0.5f * (b[22] - b[4]);
    float xx = b[14] + b[12] - 2.0f * b[13], yy = b[16] + b[10] - 2.0f * b[13], zz = b[22] + b[4] - 2.0f * b[13];
    float xy = 0.25f * (b[17] + b[9] - b[11] - b[15]);
    float xz = 0.25f * (b[23] + b[3] - b[5] - b[21]);
    float yz = 0.25f * (b[25] + b[1] - b[7] - b[19]);
    float g2 = x * x + y * y + z * z;
    float numerator = (y * y + z * z) * xx + (x * x + z * z) * yy + (x * x + y * y) * zz
                    - 2.0f * (x * y * xy + x * z * xz + y * z * yz);
    return g2 > 1e-6f ? springls__clamp(numerator / g2, -1.0f, 1.0f) : 0.0f;
}

/* phi after one step of eq. 23 without its curvature term. The springls attract: the data term's velocity is
   -grad(omega^2)/2, the vector to the nearest springl (eq. 23's minus sign would repel). First-order upwind. omega^2 is
   smooth at the surface where omega has a kink. */
SPRINGLS__MATHS float springls__evolve_voxel(springls__cross7 phi, springls__cross7 omega, float step)
{
    float fx = 0.25f * (omega.xm * omega.xm - omega.xp * omega.xp);
    float fy = 0.25f * (omega.ym * omega.ym - omega.yp * omega.yp);
    float fz = 0.25f * (omega.zm * omega.zm - omega.zp * omega.zp);
    float change = fx * (fx > 0.0f ? phi.c - phi.xm : phi.xp - phi.c) + fy * (fy > 0.0f ? phi.c - phi.ym : phi.yp - phi.c)
                 + fz * (fz > 0.0f ? phi.c - phi.zm : phi.zp - phi.c);
    return phi.c - springls__clamp(step * change, -0.9f, 0.9f);
}
