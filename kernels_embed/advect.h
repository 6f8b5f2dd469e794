/* advect.h - moving points (section 4.2) and the two flows with exact answers (section 5.2). */

/* u of LeVeque's deformation in the unit cube, x = voxel / N, in voxels a unit of time; s(t) = cos(pi t / T). */
SPRINGLS__MATHS springls__v3 springls__deformation_velocity(springls__v3 voxel, float n, float period, float time)
{
    springls__v3 x = springls__scale(voxel, 1.0f / n);
    float sx = springls__sinpi(x.x), sy = springls__sinpi(x.y), sz = springls__sinpi(x.z);
    float s2x = springls__sinpi(2.0f * x.x), s2y = springls__sinpi(2.0f * x.y), s2z = springls__sinpi(2.0f * x.z);
    float s = n * springls__cospi(time / period);
    return springls__v3_make(2.0f * sx * sx * s2y * s2z * s, -s2x * sy * sy * s2z * s, -s2x * s2y * sz * sz * s);
}

SPRINGLS__MATHS springls__v3 springls__rotation_velocity(springls__v3 x, springls__v3 center, springls__v3 axis, float omega)
{
    return springls__scale(springls__cross(axis, springls__sub(x, center)), omega);
}

/* One displacement of the classical fourth-order Runge-Kutta scheme from its four slopes. */
SPRINGLS__MATHS springls__v3 springls__rk4(springls__v3 k1, springls__v3 k2, springls__v3 k3, springls__v3 k4, float dt)
{
    springls__v3 middle = springls__add(k2, k3);
    return springls__scale(springls__add(springls__add(k1, k4), springls__scale(middle, 2.0f)), dt * (1.0f / 6.0f));
}

/* eq. 24-25: a springl that the topology constraint holds back. phi along its way must change as its normal motion says;
   a change the other way means that it has run into the sheet on the far side of the held voxels. One that moves along its
   surface rather than along its normal is free: there phi hardly changes, and the error of the normal would decide. */
SPRINGLS__MATHS int springls__held_by_topology(float phi_before, float phi_after, springls__v3 displacement, springls__v3 normal)
{
    float along = springls__dot(displacement, normal), normally = springls__fabs(along);
    return normally > 0.05f && normally > 0.5f * springls__length(displacement) && (phi_after - phi_before) * along < 0.0f;
}
