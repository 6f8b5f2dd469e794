/* track.h - correspondences stay on the original surface (section 4.7). */

/* eq. 26: one step along the gradient of the signed distance to the original surface. */
SPRINGLS__MATHS springls__v3 springls__project_step(springls__v3 a, float phi, springls__v3 gradient, float step)
{
    return springls__mad(a, gradient, -step * phi);
}
