/* metric.h - lengths, normals and curvature in the world, for kernels that count in voxels.
   Voxels may be longer along one axis than along another, and axes may be oblique. phi and triangles are in voxels all the same;
   what has to be right in the world asks the metric. With J from voxels to the world, in smallest spacings, lengths of voxel vectors
   are sqrt(u' J'J u), and slopes along world directions are those of a covector g with the square g' (J'J)^-1 g. The metric is that
   inverse: it turns a surface's normal, a covector, into the way to go. */
#ifndef SPRINGLS__KERNEL_MODEL_METRIC_H
#define SPRINGLS__KERNEL_MODEL_METRIC_H

#include "../language/vector.h"

/* A symmetric matrix; all zero stands for the identity: the grid has one spacing and orthogonal axes, and voxels are enough. */
typedef struct springls__metric { float xx, yy, zz, xy, xz, yz; } springls__metric;

SPRINGLS__MATHS bool springls__is_uniform(springls__metric m) { return m.xx == 0.0f; }

SPRINGLS__MATHS springls__v3 springls__metric_times(springls__metric m, springls__v3 v)
{
    return springls__v3_make(m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
                             m.xz * v.x + m.yz * v.y + m.zz * v.z);
}

/* Returns a' m b. */
SPRINGLS__MATHS float springls__metric_product(springls__metric m, springls__v3 a, springls__v3 b)
{
    return springls__dot(a, springls__metric_times(m, b));
}

SPRINGLS__MATHS springls__metric springls__metric_inverse(springls__metric m)
{
    springls__metric out;
    float scale;
    out.xx = m.yy * m.zz - m.yz * m.yz;
    out.yy = m.xx * m.zz - m.xz * m.xz;
    out.zz = m.xx * m.yy - m.xy * m.xy;
    out.xy = m.xz * m.yz - m.xy * m.zz;
    out.xz = m.xy * m.yz - m.xz * m.yy;
    out.yz = m.xy * m.xz - m.yz * m.xx;
    scale = 1.0f / (m.xx * out.xx + m.xy * out.xy + m.xz * out.xz);
    out.xx *= scale; out.yy *= scale; out.zz *= scale;
    out.xy *= scale; out.xz *= scale; out.yz *= scale;
    return out;
}

/* Returns how much phi changes along a way of one smallest spacing along the world's normal, where it has the gradient g of voxels:
   the length of g in the world. */
SPRINGLS__MATHS float springls__world_slope(springls__metric m, springls__v3 g)
{
    return springls__is_uniform(m) ? springls__length(g) : springls__sqrt(springls__metric_product(m, g, g));
}

/* Returns the way in voxels of one smallest spacing along the world's normal of a surface with the unit normal n in voxels; zero for
   zero. */
SPRINGLS__MATHS springls__v3 springls__along_normal(springls__metric m, springls__v3 n)
{
    const float slope = springls__world_slope(m, n);
    if (springls__is_uniform(m) || !(slope > 0.0f)) return n;
    return springls__scale(springls__metric_times(m, n), 1.0f / slope);
}

#endif
