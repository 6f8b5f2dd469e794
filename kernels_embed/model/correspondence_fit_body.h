/* correspondence_fit_body.h - the fit of correspondence_fit.h, for one place and for several at once. */

/* Weighted sums over particles, in two tangent coordinates u and v that are 1 at the fit's radius. */
typedef struct SPRINGLS__W(correspondence_fit) {
    SPRINGLS__NUM3 origin, n;
    SPRINGLS__NUM3 e1, e2;     /* tangents, of length 1 / radius */
    SPRINGLS__NUM3 a0;         /* correspondences are summed relative to it */
    SPRINGLS__NUM moments[15]; /* of 1, u, v, uu, uv, vv, uuu, uuv, uvv, vvv, uuuu, uuuv, uuvv, uvvv, vvvv */
    SPRINGLS__NUM3 right[6];   /* of a - a0 times vv, uv, uu, v, u, 1 */
} SPRINGLS__W(correspondence_fit);

/* Begins a fit over no particles at `origin`; n, tangent: unit vectors, perpendicular to each other. */
SPRINGLS__W_MATHS SPRINGLS__W(correspondence_fit) SPRINGLS__W(correspondence_fit_begin)(SPRINGLS__NUM3 origin, SPRINGLS__NUM3 n,
                                                                                        SPRINGLS__NUM3 tangent, SPRINGLS__NUM3 a0)
{
    const SPRINGLS__NUM zero = SPRINGLS__W(broadcast)(0.0f);
    SPRINGLS__W(correspondence_fit) fit;
    int i;
    fit.origin = origin;
    fit.n = n;
    fit.e1 = SPRINGLS__W(scale)(tangent, SPRINGLS__W(broadcast)(1.0f / SPRINGLS__FIT_RADIUS));
    fit.e2 = SPRINGLS__W(cross)(n, fit.e1);
    fit.a0 = a0;
    for (i = 0; i < 15; i++) fit.moments[i] = zero;
    for (i = 0; i < 6; i++) fit.right[i] = SPRINGLS__W(v3_make)(zero, zero, zero);
    return fit;
}

/* Adds a particle with its normal and correspondence, unless it is too far, faces elsewhere, or lies on another sheet. */
SPRINGLS__W_MATHS void SPRINGLS__W(correspondence_fit_add)(SPRINGLS__W(correspondence_fit) *fit, SPRINGLS__NUM3 p,
                                                           SPRINGLS__NUM3 normal, SPRINGLS__NUM3 a)
{
    const float r = SPRINGLS__FIT_RADIUS;
    const SPRINGLS__NUM3 d = SPRINGLS__W(sub)(p, fit->origin);
    const SPRINGLS__NUM r2 = SPRINGLS__W(length2)(d) * (1.0f / (r * r));
    const SPRINGLS__NUM height = SPRINGLS__W(fabs)(SPRINGLS__W(dot)(d, fit->n)), facing = SPRINGLS__W(dot)(normal, fit->n);
    const SPRINGLS__COND counts = (r2 < 1.0f) & (height <= SPRINGLS__FIT_SHEET_HEIGHT * r)
                                & (facing >= SPRINGLS__FIT_SHEET_FACING);
    SPRINGLS__NUM w, u, v, wu, wv, wuu, wuv, wvv, wuuu, wvvv, *m = fit->moments;
    if (!SPRINGLS__W(any)(counts)) return;
    w = SPRINGLS__W(select)(counts, SPRINGLS__FIT_WEIGHT(r2), SPRINGLS__W(broadcast)(0.0f));
    u = SPRINGLS__W(dot)(d, fit->e1);
    v = SPRINGLS__W(dot)(d, fit->e2);
    wu = w * u;
    wv = w * v;
    wuu = wu * u;
    wuv = wu * v;
    wvv = wv * v;
    wuuu = wuu * u;
    wvvv = wvv * v;
    m[0] += w;
    m[1] += wu;
    m[2] += wv;
    m[3] += wuu;
    m[4] += wuv;
    m[5] += wvv;
    m[6] += wuuu;
    m[7] += wuu * v;
    m[8] += wvv * u;
    m[9] += wvvv;
    m[10] += wuuu * u;
    m[11] += wuuu * v;
    m[12] += wuv * u * v;
    m[13] += wvvv * u;
    m[14] += wvvv * v;
    a = SPRINGLS__W(sub)(a, fit->a0);
    fit->right[0] = SPRINGLS__W(mad)(fit->right[0], a, wvv);
    fit->right[1] = SPRINGLS__W(mad)(fit->right[1], a, wuv);
    fit->right[2] = SPRINGLS__W(mad)(fit->right[2], a, wuu);
    fit->right[3] = SPRINGLS__W(mad)(fit->right[3], a, wv);
    fit->right[4] = SPRINGLS__W(mad)(fit->right[4], a, wu);
    fit->right[5] = SPRINGLS__W(mad)(fit->right[5], a, w);
}

/* Replaces the correspondence at the origin, where it is not known yet, by that of a fit with the terms vv, uv, uu, v, u, 1 from
   number `first` on: eliminates all but the constant one. It stays where particles lie badly around the origin, which would make
   large errors of small ones: the value is a sum of the particles' correspondences whose factors are together, without their
   signs, at most the root of moments[0] / last pivot (Cauchy-Schwarz), and that is bounded. */
SPRINGLS__W_MATHS void SPRINGLS__W(correspondence_fit_solve)(const SPRINGLS__W(correspondence_fit) *fit, int first,
                                                             SPRINGLS__NUM3 *a, SPRINGLS__COND *known)
{
    const SPRINGLS__NUM *m = fit->moments;
    const SPRINGLS__NUM row[6][6] = { { m[14] },
                                      { m[13], m[12] },
                                      { m[12], m[11], m[10] },
                                      { m[9], m[8], m[7], m[5] },
                                      { m[8], m[7], m[6], m[4], m[3] },
                                      { m[5], m[4], m[3], m[2], m[1], m[0] } };
    const float most = 8.0f; /* times the errors of correspondences */
    SPRINGLS__NUM left[6][6]; /* the lower triangle */
    SPRINGLS__NUM3 right[6], found;
    SPRINGLS__COND good;
    int i, j, k;
    for (i = first; i < 6; i++) {
        for (j = first; j <= i; j++) left[i][j] = row[i][j];
        right[i] = fit->right[i];
    }
    good = m[0] > 0.0f;
    for (k = first; k < 5; k++) {
        const SPRINGLS__NUM inverse = 1.0f / left[k][k];
        good = good & (left[k][k] > SPRINGLS__FIT_SINGULAR * m[0]);
        for (i = k + 1; i < 6; i++) {
            const SPRINGLS__NUM factor = left[i][k] * inverse;
            for (j = k + 1; j <= i; j++) left[i][j] -= factor * left[j][k];
            right[i] = SPRINGLS__W(mad)(right[i], right[k], -factor);
        }
    }
    good = good & (left[5][5] > m[0] / (most * most)) & SPRINGLS__W(not)(*known);
    found = SPRINGLS__W(add)(fit->a0, SPRINGLS__W(scale)(right[5], 1.0f / left[5][5]));
    a->x = SPRINGLS__W(select)(good, found.x, a->x);
    a->y = SPRINGLS__W(select)(good, found.y, a->y);
    a->z = SPRINGLS__W(select)(good, found.z, a->z);
    *known = *known | good;
}

/* Returns the correspondence at the origin: by a quadratic, by a plane where too few neighbors lie around it for one, else a0. */
SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(correspondence_fit_end)(const SPRINGLS__W(correspondence_fit) *fit)
{
    SPRINGLS__COND known = fit->moments[0] < 0.0f; /* nowhere */
    SPRINGLS__NUM3 a = fit->a0;
    SPRINGLS__W(correspondence_fit_solve)(fit, 0, &a, &known);
    if (SPRINGLS__W(any)(SPRINGLS__W(not)(known))) SPRINGLS__W(correspondence_fit_solve)(fit, 3, &a, &known);
    return a;
}
