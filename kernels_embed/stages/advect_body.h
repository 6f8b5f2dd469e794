/* advect_body.h - the velocity of the deformation test (section 5.2), at one point and at several. */

/* Returns u of LeVeque's deformation in the unit cube, x = voxel / n, in voxels a unit of time; amplitude: n s(t). */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(deformation_velocity)(SPRINGLS__NUM3 voxel, float n, float amplitude)
{
    SPRINGLS__NUM3 x = SPRINGLS__W(scale)(voxel, SPRINGLS__W(broadcast)(1.0f / n));
    SPRINGLS__NUM sx = SPRINGLS__W(sinpi)(x.x), sy = SPRINGLS__W(sinpi)(x.y), sz = SPRINGLS__W(sinpi)(x.z);
    SPRINGLS__NUM s2x = SPRINGLS__W(sinpi)(2.0f * x.x), s2y = SPRINGLS__W(sinpi)(2.0f * x.y);
    SPRINGLS__NUM s2z = SPRINGLS__W(sinpi)(2.0f * x.z);
    return SPRINGLS__W(v3_make)(2.0f * sx * sx * s2y * s2z * amplitude, -s2x * sy * sy * s2z * amplitude,
                                -s2x * s2y * sz * sz * amplitude);
}
