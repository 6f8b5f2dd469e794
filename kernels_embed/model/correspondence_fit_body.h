/* correspondence_fit_body.h - the fit of correspondence_fit.h, for one place and for several at once. */

/* The sums of a fit, in two tangent coordinates u and v that are 1 at the fit's radius. */
typedef struct SPRINGLS__W(correspondence_fit) {
    SPRINGLS__NUM3 origin, n;
    SPRINGLS__NUM3 e1, e2;     /* tangents, of length 1 / radius */
    SPRINGLS__NUM moments[15]; /* of 1, u, v, uu, uv, vv, uuu, uuv, uvv, vvv, uuuu, uuuv, uuvv, uvvv, vvvv */
} SPRINGLS__W(correspondence_fit);

/* A particle as a fit takes it; weight 0: not at all. */
typedef struct SPRINGLS__W(fit_sample) { SPRINGLS__NUM weight, u, v; } SPRINGLS__W(fit_sample);

/* A polynomial with the terms vv, uv, uu, v, u, 1. Times a particle's weight, it is the share of the particle's correspondence in
   that of the origin. */
typedef struct SPRINGLS__W(fit_shares) { SPRINGLS__NUM factor[6]; } SPRINGLS__W(fit_shares);

/* Begins a fit over no particles at `origin`; n, tangent: unit vectors, perpendicular to each other. */
SPRINGLS__W_MATHS SPRINGLS__W(correspondence_fit) SPRINGLS__W(correspondence_fit_begin)(SPRINGLS__NUM3 origin, SPRINGLS__NUM3 n,
                                                                                        SPRINGLS__NUM3 tangent)
{
    SPRINGLS__W(correspondence_fit) fit;
    int i;
    fit.origin = origin;
    fit.n = n;
    fit.e1 = SPRINGLS__W(scale)(tangent, SPRINGLS__W(broadcast)(1.0f / SPRINGLS__CORRESPONDENCE_RADIUS));
    fit.e2 = SPRINGLS__W(cross)(n, fit.e1);
    for (i = 0; i < 15; i++) fit.moments[i] = SPRINGLS__W(broadcast)(0.0f);
    return fit;
}

/* Returns a particle with its normal as the fit takes it: with weight 0 if it is too far, faces elsewhere or is of another sheet. */
SPRINGLS__W_MATHS SPRINGLS__W(fit_sample) SPRINGLS__W(fit_sample_of)(const SPRINGLS__W(correspondence_fit) *fit, SPRINGLS__NUM3 p,
                                                                    SPRINGLS__NUM3 normal)
{
    const float r = SPRINGLS__CORRESPONDENCE_RADIUS;
    const SPRINGLS__NUM3 d = SPRINGLS__W(sub)(p, fit->origin);
    const SPRINGLS__NUM r2 = SPRINGLS__W(length2)(d) * (1.0f / (r * r));
    const SPRINGLS__NUM height = SPRINGLS__W(fabs)(SPRINGLS__W(dot)(d, fit->n)), facing = SPRINGLS__W(dot)(normal, fit->n);
    const SPRINGLS__COND counts = (r2 < 1.0f) & (height <= SPRINGLS__FIT_SHEET_HEIGHT * r)
                                & (facing >= SPRINGLS__FIT_SHEET_FACING);
    SPRINGLS__W(fit_sample) sample;
    sample.weight = SPRINGLS__W(select)(counts, SPRINGLS__FIT_WEIGHT(r2), SPRINGLS__W(broadcast)(0.0f));
    sample.u = SPRINGLS__W(dot)(d, fit->e1);
    sample.v = SPRINGLS__W(dot)(d, fit->e2);
    return sample;
}

/* Adds a particle to the sums. */
SPRINGLS__W_MATHS void SPRINGLS__W(correspondence_fit_add)(SPRINGLS__W(correspondence_fit) *fit, SPRINGLS__W(fit_sample) sample)
{
    const SPRINGLS__NUM w = sample.weight, u = sample.u, v = sample.v, wu = w * u, wv = w * v;
    const SPRINGLS__NUM wuu = wu * u, wuv = wu * v, wvv = wv * v, wuuu = wuu * u, wvvv = wvv * v;
    SPRINGLS__NUM *m = fit->moments;
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
}

/* Finds, where they are not known yet, the shares of a fit with the terms from number `first` on: over all particles the sum of
   share times term is 1 for the constant term and 0 for the others. They stay unknown where particles lie so badly around the
   origin that errors would grow: the sum of the shares' magnitudes is at most the root of moments[0] / last pivot
   (Cauchy-Schwarz), and that is bounded. */
SPRINGLS__W_MATHS void SPRINGLS__W(fit_shares_solve)(const SPRINGLS__W(correspondence_fit) *fit, int first,
                                                     SPRINGLS__W(fit_shares) *shares, SPRINGLS__COND *known)
{
    const SPRINGLS__NUM *m = fit->moments;
    const SPRINGLS__NUM lower[21] = { m[14], m[13], m[12], m[12], m[11], m[10], m[9], m[8], m[7], m[5], m[8],
                                      m[7],  m[6],  m[4],  m[3],  m[5],  m[4],  m[3], m[2], m[1], m[0] }; /* row by row */
    const float most = 8.0f; /* how often an error of the correspondences may count */
    SPRINGLS__NUM left[6][6]; /* the lower triangle */
    SPRINGLS__NUM inverse[6], found[6];
    SPRINGLS__COND good;
    int i, j, k;
    for (i = first; i < 6; i++)
        for (j = first; j <= i; j++) left[i][j] = lower[i * (i + 1) / 2 + j];
    good = m[0] > 0.0f;
    for (k = first; k < 5; k++) {
        inverse[k] = 1.0f / left[k][k];
        good = good & (left[k][k] > SPRINGLS__FIT_SINGULAR * m[0]);
        for (i = k + 1; i < 6; i++) {
            const SPRINGLS__NUM factor = left[i][k] * inverse[k];
            for (j = k + 1; j <= i; j++) left[i][j] -= factor * left[j][k];
        }
    }
    good = good & (left[5][5] > m[0] / (most * most)) & SPRINGLS__W(not)(*known);
    found[5] = 1.0f / left[5][5];
    for (k = 4; k >= first; k--) {
        SPRINGLS__NUM sum = left[5][k] * found[5];
        for (i = k + 1; i < 5; i++) sum += left[i][k] * found[i];
        found[k] = -sum * inverse[k];
    }
    for (k = first; k < 6; k++) shares->factor[k] = SPRINGLS__W(select)(good, found[k], shares->factor[k]);
    *known = *known | good;
}

/* Returns the shares: of a quadratic, of a plane where too few neighbors lie around the origin for one, else 0. */
SPRINGLS__W_MATHS SPRINGLS__W(fit_shares) SPRINGLS__W(fit_shares_of)(const SPRINGLS__W(correspondence_fit) *fit)
{
    SPRINGLS__COND known = fit->moments[0] < 0.0f; /* nowhere */
    SPRINGLS__W(fit_shares) shares;
    int k;
    for (k = 0; k < 6; k++) shares.factor[k] = SPRINGLS__W(broadcast)(0.0f);
    SPRINGLS__W(fit_shares_solve)(fit, 0, &shares, &known);
    if (SPRINGLS__W(any)(SPRINGLS__W(not)(known))) SPRINGLS__W(fit_shares_solve)(fit, 3, &shares, &known);
    return shares;
}

/* Returns the share of a particle. */
SPRINGLS__W_MATHS SPRINGLS__NUM SPRINGLS__W(fit_share)(const SPRINGLS__W(fit_shares) *shares, SPRINGLS__W(fit_sample) sample)
{
    const SPRINGLS__NUM *f = shares->factor, u = sample.u, v = sample.v;
    return sample.weight * (f[5] + u * (f[4] + u * f[2] + v * f[1]) + v * (f[3] + v * f[0]));
}
