/* winding_body.h - solid angles of triangles, for single points and for several at once. */

/* Returns the angle of (x, y) in (-pi, pi]; 0 at the origin. Absolute error below 5e-7. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(atan2)(SPRINGLS__NUM y, SPRINGLS__NUM x)
{
    SPRINGLS__NUM ax = SPRINGLS__W(fabs)(x), ay = SPRINGLS__W(fabs)(y);
    SPRINGLS__NUM hi = SPRINGLS__W(max)(ax, ay), lo = SPRINGLS__W(min)(ax, ay);
    SPRINGLS__NUM r = lo / SPRINGLS__W(max)(hi, SPRINGLS__W(broadcast)(1.17549435e-38f)); /* the least normal number: never 0 / 0 */
    SPRINGLS__NUM s = r * r;
    SPRINGLS__NUM a = r * (1.0f + s * (-0.33333037f + s * (0.19991872f + s * (-0.14197798f + s * (0.10618371f
                         + s * (-0.07456855f + s * (0.04213762f + s * (-0.01573125f + s * 0.00276628f))))))));
    a = SPRINGLS__W(select)(ay > ax, 1.57079633f - a, a);
    a = SPRINGLS__W(select)(x < 0.0f, 3.14159265f - a, a);
    return SPRINGLS__W(select)(y < 0.0f, -a, a);
}

/* Returns the solid angle under which t is seen from x, positive when its normal points away from x. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(solid_angle)(springls__tri t, SPRINGLS__NUM3 x)
{
    const springls__v3 n = springls__tri_area2(t);
    SPRINGLS__NUM3 a = SPRINGLS__W(sub)(SPRINGLS__W(broadcast3)(t.a), x);
    SPRINGLS__NUM3 b = SPRINGLS__W(sub)(SPRINGLS__W(broadcast3)(t.b), x);
    SPRINGLS__NUM3 c = SPRINGLS__W(sub)(SPRINGLS__W(broadcast3)(t.c), x);
    SPRINGLS__NUM la = SPRINGLS__W(length)(a), lb = SPRINGLS__W(length)(b), lc = SPRINGLS__W(length)(c);
    SPRINGLS__NUM volume = SPRINGLS__W(dot)(a, SPRINGLS__W(broadcast3)(n));
    SPRINGLS__NUM angle = la * lb * lc + SPRINGLS__W(dot)(a, b) * lc + SPRINGLS__W(dot)(b, c) * la + SPRINGLS__W(dot)(c, a) * lb;
    return 2.0f * SPRINGLS__W(atan2)(volume, angle);
}
