/* vector_body.h - three-vectors and the functions of one number that every stage needs, for single numbers (vector.h) and for
   several at once (simd.h). tanh, atanh, exp, sin and cos are our own: those of libm and OpenCL differ in the last bits. */

SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(clamp)(SPRINGLS__NUM x, float lo, float hi)
{
    return SPRINGLS__W(min)(SPRINGLS__W(max)(x, SPRINGLS__W(broadcast)(lo)), SPRINGLS__W(broadcast)(hi));
}

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(v3_make)(SPRINGLS__NUM x, SPRINGLS__NUM y, SPRINGLS__NUM z)
{
    SPRINGLS__NUM3 v;
    v.x = x;
    v.y = y;
    v.z = z;
    return v;
}

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(load_v3)(const float *x, const float *y, const float *z)
{
    return SPRINGLS__W(v3_make)(SPRINGLS__W(load)(x), SPRINGLS__W(load)(y), SPRINGLS__W(load)(z));
}

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(broadcast3)(springls__v3 v)
{
    return SPRINGLS__W(v3_make)(SPRINGLS__W(broadcast)(v.x), SPRINGLS__W(broadcast)(v.y), SPRINGLS__W(broadcast)(v.z));
}

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(add)(SPRINGLS__NUM3 a, SPRINGLS__NUM3 b)
{
    return SPRINGLS__W(v3_make)(a.x + b.x, a.y + b.y, a.z + b.z);
}

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(sub)(SPRINGLS__NUM3 a, SPRINGLS__NUM3 b)
{
    return SPRINGLS__W(v3_make)(a.x - b.x, a.y - b.y, a.z - b.z);
}

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(scale)(SPRINGLS__NUM3 a, SPRINGLS__NUM s)
{
    return SPRINGLS__W(v3_make)(a.x * s, a.y * s, a.z * s);
}

/* Returns a + s b. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(mad)(SPRINGLS__NUM3 a, SPRINGLS__NUM3 b, SPRINGLS__NUM s)
{
    return SPRINGLS__W(v3_make)(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s);
}

SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(dot)(SPRINGLS__NUM3 a, SPRINGLS__NUM3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(cross)(SPRINGLS__NUM3 a, SPRINGLS__NUM3 b)
{
    return SPRINGLS__W(v3_make)(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(length2)(SPRINGLS__NUM3 a) { return SPRINGLS__W(dot)(a, a); }
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(length)(SPRINGLS__NUM3 a) { return SPRINGLS__W(sqrt)(SPRINGLS__W(dot)(a, a)); }

/* Returns the unit vector along a; the zero vector stays zero. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(normalize)(SPRINGLS__NUM3 a)
{
    const SPRINGLS__NUM zero = SPRINGLS__W(broadcast)(0.0f), l2 = SPRINGLS__W(length2)(a);
    const SPRINGLS__COND nonzero = l2 > 1e-30f;
    a = SPRINGLS__W(scale)(a, 1.0f / SPRINGLS__W(sqrt)(l2));
    return SPRINGLS__W(v3_make)(SPRINGLS__W(select)(nonzero, a.x, zero), SPRINGLS__W(select)(nonzero, a.y, zero),
                                SPRINGLS__W(select)(nonzero, a.z, zero));
}

/* Returns exp(x) for x in [-80, 80], relative error below 3e-7: x = k ln 2 + r with |r| <= ln 2 / 2, a series in r, and
   2^k by its bits. Clamps x beyond. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(exp)(SPRINGLS__NUM x)
{
    SPRINGLS__NUM in = SPRINGLS__W(clamp)(x, -80.0f, 80.0f), k = SPRINGLS__W(floor)(in * 1.44269504f + 0.5f);
    SPRINGLS__NUM r = (in - k * 0.693359375f) + k * 2.12194440e-4f;
    SPRINGLS__NUM e = 1.0f + r * (1.0f + r * (0.5f + r * (1.66666667e-1f + r * (4.16666667e-2f
                           + r * (8.33333333e-3f + r * 1.38888889e-3f)))));
    return e * SPRINGLS__W(of_bits)((SPRINGLS__W(to_int)(k) + 127) << 23);
}

/* Returns tanh(x) = (1 - e) / (1 + e) with e = exp(-2|x|); an odd series where that would cancel. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(tanh)(SPRINGLS__NUM x)
{
    SPRINGLS__NUM a = SPRINGLS__W(fabs)(x), x2 = x * x, e = SPRINGLS__W(exp)(-2.0f * a), t = (1.0f - e) / (1.0f + e);
    SPRINGLS__NUM series = x * (1.0f + x2 * (-3.33333333e-1f + x2 * (1.33333333e-1f + x2 * (-5.39682540e-2f
                              + x2 * 2.18694885e-2f))));
    return SPRINGLS__W(select)(a < 0.25f, series, SPRINGLS__W(select)(x < 0.0f, -t, t));
}

/* Returns the natural logarithm of x in [2^-20, 2^20], by halving into [2/3, 4/3] and the atanh series. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(ln)(SPRINGLS__NUM x)
{
    SPRINGLS__NUM k = SPRINGLS__W(broadcast)(0.0f), s, s2;
    SPRINGLS__COND more;
    for (more = x > 1.33333333f; SPRINGLS__W(any)(more); more = x > 1.33333333f) {
        x = SPRINGLS__W(select)(more, x * 0.5f, x);
        k = SPRINGLS__W(select)(more, k + 1.0f, k);
    }
    for (more = x < 0.66666667f; SPRINGLS__W(any)(more); more = x < 0.66666667f) {
        x = SPRINGLS__W(select)(more, x * 2.0f, x);
        k = SPRINGLS__W(select)(more, k - 1.0f, k);
    }
    s = (x - 1.0f) / (x + 1.0f);
    s2 = s * s;
    return k * 0.69314718f + 2.0f * s * (1.0f + s2 * (0.33333333f + s2 * (0.2f + s2 * (0.14285714f + s2 * 0.11111111f))));
}

/* Returns atanh(x) = log((1 + x) / (1 - x)) / 2, its argument kept 1e-3 away from the poles. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(atanh)(SPRINGLS__NUM x)
{
    SPRINGLS__NUM c = SPRINGLS__W(clamp)(x, -0.999f, 0.999f);
    return 0.5f * SPRINGLS__W(ln)((1.0f + c) / (1.0f - c));
}

/* Returns sin(pi x) for |x| < 2^31: reduced to [-1/2, 1/2], odd polynomial of degree 11 (absolute error below 2e-7). */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(sinpi)(SPRINGLS__NUM x)
{
    SPRINGLS__NUM k = SPRINGLS__W(floor)(x + 0.5f), r = x - k, r2 = r * r;
    SPRINGLS__NUM s = r * (3.14159265f + r2 * (-5.16771278f + r2 * (2.55016404f + r2 * (-0.599264529f
                         + r2 * (0.0821458866f + r2 * -0.00737043094f)))));
    return SPRINGLS__W(negated_if_odd)(s, SPRINGLS__W(to_int)(k));
}

SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(cospi)(SPRINGLS__NUM x) { return SPRINGLS__W(sinpi)(x + 0.5f); }
