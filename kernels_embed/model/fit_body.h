/* fit_body.h - the quadratic fit of fit.h, for one place and for several at once. */

typedef struct SPRINGLS__W(fit) {
    SPRINGLS__NUM3 origin, e1, e2, n; /* the tangent frame */
    SPRINGLS__NUM3 a0;                /* correspondences are summed relative to it */
    SPRINGLS__NUM normal_matrix[21];  /* lower triangle, row by row */
    SPRINGLS__NUM right[24];
    SPRINGLS__NUM count;
} SPRINGLS__W(fit);

/* Begins a fit over no particles at `origin`; n, e1, e2: an orthonormal frame. */
SPRINGLS__W_MATHS SPRINGLS__W(fit) SPRINGLS__W(fit_begin_in)(SPRINGLS__NUM3 origin, SPRINGLS__NUM3 n, SPRINGLS__NUM3 e1,
                                                             SPRINGLS__NUM3 a0)
{
    SPRINGLS__W(fit) fit;
    int i;
    fit.origin = origin;
    fit.n = n;
    fit.a0 = a0;
    fit.e1 = e1;
    fit.e2 = SPRINGLS__W(cross)(n, e1);
    fit.count = SPRINGLS__W(broadcast)(0.0f);
    for (i = 0; i < 21; i++) fit.normal_matrix[i] = SPRINGLS__W(broadcast)(0.0f);
    for (i = 0; i < 24; i++) fit.right[i] = SPRINGLS__W(broadcast)(0.0f);
    return fit;
}

/* A particle as an equation of the fit; weight 0: it is too far, faces elsewhere, or lies on another sheet. */
typedef struct SPRINGLS__W(fit_equation) {
    SPRINGLS__NUM term[SPRINGLS__FIT_TERMS], value[SPRINGLS__FIT_VALUES], weight;
} SPRINGLS__W(fit_equation);

SPRINGLS__W_MATHS SPRINGLS__W(fit_equation) SPRINGLS__W(fit_equation_of)(const SPRINGLS__W(fit) *fit, SPRINGLS__NUM3 p,
                                                                         SPRINGLS__NUM3 normal, SPRINGLS__NUM3 a)
{
    SPRINGLS__NUM3 from_origin = SPRINGLS__W(sub)(p, fit->origin);
    SPRINGLS__NUM3 d = SPRINGLS__W(scale)(from_origin, SPRINGLS__W(broadcast)(1.0f / SPRINGLS__FIT_RADIUS));
    SPRINGLS__NUM r2 = SPRINGLS__W(length2)(d), h = SPRINGLS__W(dot)(d, fit->n);
    SPRINGLS__COND within = (SPRINGLS__W(length2)(from_origin) < SPRINGLS__FIT_RADIUS * SPRINGLS__FIT_RADIUS) & (r2 < 1.0f);
    SPRINGLS__COND counts = within & (SPRINGLS__W(fabs)(h) <= 0.4f) & (SPRINGLS__W(dot)(normal, fit->n) >= 0.4f);
    SPRINGLS__W(fit_equation) e;
    e.term[0] = SPRINGLS__W(broadcast)(1.0f);
    e.term[1] = SPRINGLS__W(dot)(d, fit->e1);
    e.term[2] = SPRINGLS__W(dot)(d, fit->e2);
    e.term[3] = e.term[1] * e.term[1];
    e.term[4] = e.term[1] * e.term[2];
    e.term[5] = e.term[2] * e.term[2];
    e.value[0] = h;
    e.value[1] = a.x - fit->a0.x;
    e.value[2] = a.y - fit->a0.y;
    e.value[3] = a.z - fit->a0.z;
    e.weight = SPRINGLS__W(select)(counts, (1.0f - r2) * (1.0f - r2) / (r2 + 0.02f), SPRINGLS__W(broadcast)(0.0f));
    return e;
}

/* Adds a particle with its normal and correspondence. Returns false where it is too far, faces elsewhere, or lies on another
   sheet: weight 0 changes nothing. */
SPRINGLS__W_MATHS SPRINGLS__COND SPRINGLS__W(fit_add)(SPRINGLS__W(fit) *fit, SPRINGLS__NUM3 p, SPRINGLS__NUM3 normal,
                                                      SPRINGLS__NUM3 a)
{
    const SPRINGLS__W(fit_equation) e = SPRINGLS__W(fit_equation_of)(fit, p, normal, a);
    const SPRINGLS__COND counts = e.weight > 0.0f;
    int i, j;
    if (!SPRINGLS__W(any)(counts)) return counts;
    for (i = 0; i < SPRINGLS__FIT_TERMS; i++) {
        const SPRINGLS__NUM scaled = e.weight * e.term[i];
        for (j = 0; j <= i; j++) fit->normal_matrix[i * (i + 1) / 2 + j] += scaled * e.term[j];
        for (j = 0; j < SPRINGLS__FIT_VALUES; j++) fit->right[SPRINGLS__FIT_VALUES * i + j] += scaled * e.value[j];
    }
    fit->count += SPRINGLS__W(select)(counts, SPRINGLS__W(broadcast)(1.0f), SPRINGLS__W(broadcast)(0.0f));
    return counts;
}

/* The fitted surface at the origin. */
typedef struct SPRINGLS__W(fit_result) {
    SPRINGLS__NUM3 point, normal, a;
    SPRINGLS__COND ok; /* false: too few neighbors, or they lie on a line */
} SPRINGLS__W(fit_result);

/* Factors the first `terms` rows of the normal matrix by Cholesky into l, row by row; false when it is close to singular. */
SPRINGLS__W_MATHS SPRINGLS__COND SPRINGLS__W(fit_factor)(const SPRINGLS__W(fit) *fit, int terms, SPRINGLS__NUM l[21])
{
    SPRINGLS__COND ok = fit->count > 0.0f;
    int i, j, k;
    for (i = 0; i < terms; i++) {
        for (j = 0; j <= i; j++) {
            SPRINGLS__NUM sum = fit->normal_matrix[i * (i + 1) / 2 + j];
            for (k = 0; k < j; k++) sum -= l[i * (i + 1) / 2 + k] * l[j * (j + 1) / 2 + k];
            if (i == j) {
                ok = ok & (sum > 1e-5f * fit->normal_matrix[0]); /* coordinates are at most 1 */
                if (!SPRINGLS__W(any)(ok)) return ok;
                l[i * (i + 1) / 2 + i] = SPRINGLS__W(sqrt)(sum);
            } else {
                l[i * (i + 1) / 2 + j] = sum / l[j * (j + 1) / 2 + j];
            }
        }
    }
    return ok;
}

/* Solves for one right-hand side, and replaces it in x by the solution. */
SPRINGLS__W_MATHS void SPRINGLS__W(fit_substitute)(const SPRINGLS__NUM l[21], int terms, SPRINGLS__NUM x[SPRINGLS__FIT_TERMS])
{
    int i, k;
    for (i = 0; i < terms; i++) {
        SPRINGLS__NUM sum = x[i];
        for (k = 0; k < i; k++) sum -= l[i * (i + 1) / 2 + k] * x[k];
        x[i] = sum / l[i * (i + 1) / 2 + i];
    }
    for (i = terms - 1; i >= 0; i--) {
        SPRINGLS__NUM sum = x[i];
        for (k = i + 1; k < terms; k++) sum -= l[k * (k + 1) / 2 + i] * x[k];
        x[i] = sum / l[i * (i + 1) / 2 + i];
    }
}

/* The first `terms` coefficients of the height and of the three coordinates of a, and the Cholesky factor l. */
typedef struct SPRINGLS__W(fit_solution) {
    SPRINGLS__NUM x[SPRINGLS__FIT_VALUES][SPRINGLS__FIT_TERMS], l[21];
    int terms;
    SPRINGLS__COND ok; /* false: there are none */
} SPRINGLS__W(fit_solution);

SPRINGLS__W_MATHS SPRINGLS__W(fit_solution) SPRINGLS__W(fit_coefficients)(const SPRINGLS__W(fit) *fit, int terms)
{
    SPRINGLS__W(fit_solution) s;
    int i, v;
    s.ok = SPRINGLS__W(fit_factor)(fit, terms, s.l);
    s.terms = SPRINGLS__W(any)(s.ok) ? terms : 0;
    for (v = 0; v < SPRINGLS__FIT_VALUES; v++) {
        for (i = 0; i < SPRINGLS__FIT_TERMS; i++)
            s.x[v][i] = i < s.terms ? fit->right[SPRINGLS__FIT_VALUES * i + v] : SPRINGLS__W(broadcast)(0.0f);
        SPRINGLS__W(fit_substitute)(s.l, s.terms, s.x[v]);
    }
    return s;
}

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(select3)(SPRINGLS__COND where, SPRINGLS__NUM3 yes, SPRINGLS__NUM3 no)
{
    return SPRINGLS__W(v3_make)(SPRINGLS__W(select)(where, yes.x, no.x), SPRINGLS__W(select)(where, yes.y, no.y),
                                SPRINGLS__W(select)(where, yes.z, no.z));
}

/* Replaces the result by that of the first `terms` coefficients where it is not ok, at least so many neighbors count, and the
   matrix is not close to singular. */
SPRINGLS__W_MATHS void SPRINGLS__W(fit_solve)(const SPRINGLS__W(fit) *fit, int terms, float neighbors,
                                              SPRINGLS__W(fit_result) *result)
{
    const SPRINGLS__COND due = SPRINGLS__W(select)(result->ok, SPRINGLS__W(broadcast)(0.0f), fit->count) >= neighbors;
    SPRINGLS__W(fit_solution) s;
    SPRINGLS__NUM3 normal;
    SPRINGLS__COND good;
    if (!SPRINGLS__W(any)(due)) return;
    s = SPRINGLS__W(fit_coefficients)(fit, terms);
    good = due & s.ok;
    normal = SPRINGLS__W(sub)(SPRINGLS__W(sub)(fit->n, SPRINGLS__W(scale)(fit->e1, s.x[0][1])),
                              SPRINGLS__W(scale)(fit->e2, s.x[0][2]));
    result->point = SPRINGLS__W(select3)(good, SPRINGLS__W(mad)(fit->origin, fit->n, s.x[0][0] * SPRINGLS__FIT_RADIUS),
                                         result->point);
    result->normal = SPRINGLS__W(select3)(good, SPRINGLS__W(normalize)(normal), result->normal);
    result->a = SPRINGLS__W(select3)(good, SPRINGLS__W(add)(fit->a0, SPRINGLS__W(v3_make)(s.x[1][0], s.x[2][0], s.x[3][0])),
                                     result->a);
    result->ok = result->ok | good;
}

/* Solves for a quadratic with ten neighbors or more, for a plane with four or more and where the quadratic is close to singular;
   not ok with fewer. */
SPRINGLS__W_MATHS SPRINGLS__W(fit_result) SPRINGLS__W(fit_highest)(const SPRINGLS__W(fit) *fit)
{
    SPRINGLS__W(fit_result) result;
    result.ok = fit->count < 0.0f;
    result.point = fit->origin;
    result.normal = fit->n;
    result.a = fit->a0;
    SPRINGLS__W(fit_solve)(fit, 6, 10.0f, &result);
    SPRINGLS__W(fit_solve)(fit, 3, 4.0f, &result);
    return result;
}

/* Solves the fit, but keeps the place where all neighbors lie to one side, at the rim of a wide hole: the height is unreliable
   there. */
SPRINGLS__W_MATHS SPRINGLS__W(fit_result) SPRINGLS__W(fit_end)(const SPRINGLS__W(fit) *fit)
{
    SPRINGLS__W(fit_result) result = SPRINGLS__W(fit_highest)(fit);
    SPRINGLS__NUM u = fit->normal_matrix[1], v = fit->normal_matrix[3], w = 0.6f * fit->normal_matrix[0];
    SPRINGLS__COND to_one_side = u * u + v * v > w * w;
    result.point = SPRINGLS__W(select3)(to_one_side, fit->origin, result.point);
    result.normal = SPRINGLS__W(select3)(to_one_side, fit->n, result.normal);
    return result;
}

/* The box of the correspondences that a fit has taken. */
typedef struct SPRINGLS__W(fit_box) { SPRINGLS__NUM3 lower, upper; } SPRINGLS__W(fit_box);

SPRINGLS__W_MATHS SPRINGLS__W(fit_box) SPRINGLS__W(fit_box_begin)(void)
{
    const SPRINGLS__NUM high = SPRINGLS__W(broadcast)(FLT_MAX), low = SPRINGLS__W(broadcast)(-FLT_MAX);
    SPRINGLS__W(fit_box) box;
    box.lower = SPRINGLS__W(v3_make)(high, high, high);
    box.upper = SPRINGLS__W(v3_make)(low, low, low);
    return box;
}

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(min3)(SPRINGLS__NUM3 a, SPRINGLS__NUM3 b)
{
    return SPRINGLS__W(v3_make)(SPRINGLS__W(min)(a.x, b.x), SPRINGLS__W(min)(a.y, b.y), SPRINGLS__W(min)(a.z, b.z));
}

SPRINGLS__W_MATHS SPRINGLS__NUM3 SPRINGLS__W(max3)(SPRINGLS__NUM3 a, SPRINGLS__NUM3 b)
{
    return SPRINGLS__W(v3_make)(SPRINGLS__W(max)(a.x, b.x), SPRINGLS__W(max)(a.y, b.y), SPRINGLS__W(max)(a.z, b.z));
}

/* Adds a particle with its normal and correspondence to a fit and its box, where it counts. */
SPRINGLS__W_MATHS void SPRINGLS__W(fit_add_in_box)(SPRINGLS__W(fit) *fit, SPRINGLS__W(fit_box) *box, SPRINGLS__NUM3 p,
                                                   SPRINGLS__NUM3 normal, SPRINGLS__NUM3 a)
{
    const SPRINGLS__COND counts = SPRINGLS__W(fit_add)(fit, p, normal, a);
    if (!SPRINGLS__W(any)(counts)) return;
    box->lower = SPRINGLS__W(select3)(counts, SPRINGLS__W(min3)(box->lower, a), box->lower);
    box->upper = SPRINGLS__W(select3)(counts, SPRINGLS__W(max3)(box->upper, a), box->upper);
}

/* Ends a fit: clamps its correspondence to a voxel beyond the range of the neighbors. Not ok either where the fitted surface is
   further than a voxel from the origin, or turned away from n. */
SPRINGLS__W_MATHS SPRINGLS__W(fit_result) SPRINGLS__W(fit_end_in_box)(const SPRINGLS__W(fit) *fit,
                                                                    const SPRINGLS__W(fit_box) *box)
{
    const SPRINGLS__NUM one = SPRINGLS__W(broadcast)(1.0f);
    const SPRINGLS__NUM3 margin = SPRINGLS__W(v3_make)(one, one, one);
    SPRINGLS__W(fit_result) result = SPRINGLS__W(fit_end)(fit);
    SPRINGLS__NUM3 a = SPRINGLS__W(max3)(result.a, SPRINGLS__W(sub)(box->lower, margin));
    SPRINGLS__NUM off2, facing;
    result.a = SPRINGLS__W(min3)(a, SPRINGLS__W(add)(box->upper, margin));
    off2 = SPRINGLS__W(length2)(SPRINGLS__W(sub)(result.point, fit->origin));
    facing = SPRINGLS__W(dot)(result.normal, fit->n);
    result.ok = result.ok & (off2 <= 1.0f) & (facing >= 0.3f);
    return result;
}
