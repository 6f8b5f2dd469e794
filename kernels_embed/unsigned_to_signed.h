/* unsigned_to_signed.h - the side of the springls that a point lies on. */

/* What one springl says: the point's height over it, positive in front, with a weight that falls off so fast that the
   nearest springls decide. A solid angle would not do: the far side of a thin sheet counts there as much as the near one. */
SPRINGLS__MATHS float springls__side(const springls__tri_plan plan, springls__v3 x)
{
    float d2 = springls__tri_distance2(plan, x) + 0.01f;
    return springls__dot(plan.n, springls__sub(x, plan.t.a)) / (d2 * d2 * springls__sqrt(d2));
}
